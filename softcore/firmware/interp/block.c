// SPDX-License-Identifier: Apache-2.0
#include "interp/block.h"

#include "interp/reader.h"

#define CODE_LIMIT 99999999u /* of numbers that are names: N, O, C, S, T */
#define CODE_DIGITS 10000000u /* of G and M, decimals included */

/* Letters of the dialect. Some numbers may have a sign. Names are whole numbers without one. */
#define SIGNED (BLOCK_BIT('X') | BLOCK_BIT('Y') | BLOCK_BIT('Z') | \
                BLOCK_BIT('I') | BLOCK_BIT('J') | BLOCK_BIT('K') | BLOCK_BIT('R'))
#define NAMES (BLOCK_BIT('N') | BLOCK_BIT('O') | BLOCK_BIT('C') | BLOCK_BIT('D') | \
               BLOCK_BIT('S') | BLOCK_BIT('T'))
#define KNOWN (SIGNED | NAMES | BLOCK_BIT('G') | BLOCK_BIT('M') | BLOCK_BIT('F') | \
               BLOCK_BIT('P') | BLOCK_BIT('L') | BLOCK_BIT('H') | \
               BLOCK_BIT('E') | BLOCK_BIT('Q') | BLOCK_BIT('U') | BLOCK_BIT('V') | \
               BLOCK_BIT('W') | BLOCK_BIT('A') | BLOCK_BIT('B'))

void block_begin(block *b, const char *text, uint32_t length) {
    b->present = 0;
    b->g_count = b->m_count = 0;
    b->skipped = b->begun = false;
    b->text = text;
    b->length = length;
    b->at = b->comment = 0;
}

/* The next character that is not a deleted one, without taking it; '\0' at the end. */
static char peek(block *b) {
    while (b->at < b->length && b->text[b->at] == READER_DELETED)
        b->at++;
    return b->at < b->length ? b->text[b->at] : '\0';
}

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool expression(char c) { return c == '#' || c == '[' || c == ']' || c == '='; }

static bool refuse_expression(const block *b, fault *f) {
    return fault_at(f, FAULT_REFUSED, b->at + 1,
                    "variables and expressions (# [ ] =) are not in this version; write the number");
}

/* Does a word without a number belong to an O-word of LinuxCNC, such as `o100 sub`? */
static bool structured(const block *b, char letter) {
    return letter == 'O' || block_has(b, 'O');
}

/* Read digits with at most one decimal point, as an integer and the number of its decimals.
   Decimals beyond UNITS_DECIMALS are ignored. */
static bool read_number(block *b, char letter, word *w, fault *f) {
    uint64_t digits = 0;
    unsigned significant = 0, decimals = 0;
    bool any = false, point = false;
    char c = peek(b);
    while (c == ' ' || c == '\t') {
        b->at++;
        c = peek(b);
    }
    if (c == '+' || c == '-') {
        if (!(SIGNED & BLOCK_BIT(letter)))
            return fault_at(f, FAULT_NUMBER, b->at + 1, "the word %c takes no sign", letter);
        w->negative = c == '-';
        b->at++;
        c = peek(b);
    }
    for (; is_digit(c) || (c == '.' && !point); c = peek(b)) {
        b->at++;
        if (c == '.') {
            point = true;
            continue;
        }
        any = true;
        if (point && decimals == UNITS_DECIMALS)
            continue;
        if (digits || c != '0')
            significant++;
        if (significant > UNITS_DIGITS)
            return fault_at(f, FAULT_OVERFLOW, b->at,
                            "the number of the word %c has more than %u digits", letter,
                            (uint32_t)UNITS_DIGITS);
        digits = digits * 10 + (unsigned)(c - '0');
        decimals += point;
    }
    if (!any && expression(c))
        return refuse_expression(b, f);
    if (!any && structured(b, letter))
        return fault_at(f, FAULT_REFUSED, w->column,
                        "O-words (sub, call, if, while and so on) are not in this version; write the "
                        "moves out");
    if (!any)
        return fault_at(f, FAULT_NUMBER, b->at + 1, "the number of the word %c is missing", letter);
    if (c == '.')
        return fault_at(f, FAULT_NUMBER, b->at + 1, "second decimal point in the word %c", letter);
    if (point && NAMES & BLOCK_BIT(letter))
        return fault_at(f, FAULT_NUMBER, w->column, "the word %c takes no decimal point", letter);
    if (NAMES & BLOCK_BIT(letter) && digits > CODE_LIMIT)
        return fault_at(f, FAULT_OVERFLOW, w->column, "the number of the word %c is too large",
                        letter);
    w->number = (units_number){digits, decimals};
    return true;
}

static bool add_code(block *b, char letter, const word *w, fault *f) {
    code_word *list = letter == 'G' ? b->g : b->m;
    uint8_t *count = letter == 'G' ? &b->g_count : &b->m_count;
    uint32_t most = letter == 'G' ? BLOCK_G_CODES : BLOCK_CODES;
    units_number number = w->number;
    if (number.digits >= CODE_DIGITS)
        return fault_at(f, FAULT_UNKNOWN, w->column, "the code after %c is unknown", letter);
    uint32_t tenths = (uint32_t)number.digits;
    if (number.decimals == 0)
        tenths *= 10;
    for (; number.decimals > 1; number.decimals--) {
        if (tenths % 10)
            return fault_at(f, FAULT_UNKNOWN, w->column, "the code after %c is unknown", letter);
        tenths /= 10;
    }
    if (tenths > UINT16_MAX)
        return fault_at(f, FAULT_UNKNOWN, w->column, "the code after %c is unknown", letter);
    for (unsigned i = 0; i < *count; i++)
        if (list[i].tenths == tenths)
            return fault_at(f, FAULT_DUPLICATE, w->column, "the same %c code stands twice", letter);
    if (*count == most)
        return fault_at(f, FAULT_CONFLICT, w->column, "more than %u %c codes in the block", most,
                        letter);
    list[(*count)++] = (code_word){(uint16_t)tenths, w->column};
    return true;
}

static bool read_word(block *b, char letter, fault *f) {
    word w = {.column = (uint16_t)(b->at + 1)};
    b->at++;
    if (letter == ':')
        letter = 'O';
    if (!(KNOWN & BLOCK_BIT(letter)))
        return fault_at(f, FAULT_UNKNOWN, w.column, "the word %c is unknown", letter);
    if (!read_number(b, letter, &w, f))
        return false;
    if (letter == 'G' || letter == 'M')
        return add_code(b, letter, &w, f);
    if (b->present & BLOCK_BIT(letter))
        return fault_at(f, FAULT_DUPLICATE, w.column, "the word %c stands twice", letter);
    b->present |= BLOCK_BIT(letter);
    *BLOCK_WORD(b, letter) = w;
    return true;
}

block_result block_step(block *b, bool skip, uint32_t budget, fault *f) {
    uint32_t limit = b->at + budget;
    while (b->at < limit) {
        char c = peek(b);
        if (c == '\0') {
            if (!b->comment)
                return BLOCK_DONE;
            fault_at(f, FAULT_COMMENT, b->comment, "the comment is not closed");
            return BLOCK_FAULT;
        }
        if (b->comment) {
            b->at++;
            if (c == ')') {
                b->comment = 0;
            } else if (c == '(') {
                /* Its end would be a guess: text of the comment could become words of the
                   program. */
                fault_at(f, FAULT_COMMENT, b->at, "a comment begins within a comment");
                return BLOCK_FAULT;
            }
            continue;
        }
        if (c >= 'a' && c <= 'z')
            c = (char)(c - 'a' + 'A');
        if (c == ' ' || c == '\t') {
            b->at++;
        } else if (c == '(') {
            b->comment = ++b->at;
        } else if (c == ';') {
            b->at = b->length;
            return BLOCK_DONE;
        } else if (c == '/' && !b->begun) {
            b->at++;
            if (skip) {
                b->skipped = true;
                return BLOCK_DONE;
            }
        } else if ((c >= 'A' && c <= 'Z') || c == ':') {
            if (!read_word(b, c, f))
                return BLOCK_FAULT;
        } else if (expression(c)) {
            refuse_expression(b, f);
            return BLOCK_FAULT;
        } else {
            /* A line entered by hand may hold any byte, but messages to the host are ASCII. */
            if (c > ' ' && c < 0x7f)
                fault_at(f, FAULT_CHARACTER, b->at + 1, "the character '%c' is out of place", c);
            else
                fault_at(f, FAULT_CHARACTER, b->at + 1, "the byte %x is out of place",
                         (unsigned)(uint8_t)c);
            return BLOCK_FAULT;
        }
        b->begun = b->begun || !(c == ' ' || c == '\t' || c == '(');
    }
    return BLOCK_MORE;
}
