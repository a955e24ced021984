// SPDX-License-Identifier: Apache-2.0
#include "link/lines.h"

#include "hal/hal.h"
#include "hal/regs.h"
#include "link/crc.h"
#include "link/frame.h"
#include "link/output.h"
#include "link/tape.h"

#define ROOM 512            /* characters of the queue; a power of two, more than one line takes */
#define CHECK LINES_CHECK   /* characters */
#define NUMBER_DIGITS 5
#define ORDER_START 8       /* characters that are enough to recognise an order */
#define REFUSED 0x80u       /* with the reason: first character of a refused line in the queue */

typedef enum {
    GOOD, FRAMING, OVERRUN, CHARACTER, CUT, TOO_LONG, FORM, CHECK_WRONG, SEQUENCE, GUARDED, ON_TAPE,
    STALE, REASONS
} reason;

static const char *const TEXTS[REASONS] = {
    [FRAMING] = "a character came without its stop bit",
    [OVERRUN] = "characters came faster than they were taken",
    [CHARACTER] = "it has a character that no line has",
    [CUT] = "a frame begins or ends in it",
    [TOO_LONG] = "it has too many characters",
    [FORM] = "number and check are not of the form @17 text*5A3C",
    [CHECK_WRONG] = "its check is wrong",
    [SEQUENCE] = "its number is not the next",
    [GUARDED] = "until a reset it needs a number and a check",
    [ON_TAPE] = "between the frames of a tape it needs a number and a check",
    [STALE] = "what came before it was damaged, and a part of it may be missing",
};

/* From `tail` to `head`: complete lines as they were received, each with '\n'. From `head` to
   `end`: the beginning of the next line. A refused line has only REFUSED with the reason, and its
   number if that can be read. */
static char queue[ROOM];
static uint32_t head, tail, end;    /* free-running */
static uint32_t alarmed;            /* `end` when an alarm came; it follows `tail` otherwise */

/* Number of lines that came when the queue was full. While there are any, all further lines are
   refused, so that answers keep their order and no line is carried out after one that is
   missing. */
static uint32_t overflowed;
static bool overflow_told;

/* The line that is being received. */
static struct {
    uint32_t length;
    reason trouble;         /* the first error in it */
    bool lost;              /* a part of it did not fit into the queue */
    bool numbered;          /* it begins with '@' */
    enum { NUMBER, TEXT, UNREADABLE } part; /* of a numbered line; its number may be unreadable */
    uint32_t number;
    uint32_t text;          /* characters before its text */
    char start[ORDER_START];    /* first characters of its text */
    uint32_t star, check;   /* characters before the last '*'; value of the digits after it */
    bool hex;               /* all characters after the '*' are hexadecimal digits */
    uint16_t crc, crc_before;   /* of all characters, and of those before the last '*' */
} now;
static bool returned;       /* the last byte was a carriage return */
static reason before;       /* error between the last line and this one */

/* A plain line may have lost its beginning until a line has ended (until_end) and until there was a
   pause on the link (until_quiet). */
static bool until_end, until_quiet;
static bool told;           /* while a tape is due: the sender was told that this part is lost */

/* The numbered lines accepted last, by number modulo KNOWN, with their answers. One that comes again
   gets the same answer again: it was lost. */
#define KNOWN 64
static struct known {
    bool there, answered;
    uint16_t number, check, code;
} known[KNOWN];
static uint16_t next;           /* number of the next one */
/* The line taken last, `there` if it has a number: orders may pass it, more than KNOWN of them. */
static struct known taken;
static bool guarded;
static lines_counts counts;
static uint64_t ended;      /* clock at which the last line that was kept has ended */

static void begin(void) {
    end = head;
    /* The line before may have been dropped: what comes now has come after the alarm. */
    if ((int32_t)(alarmed - head) > 0)
        alarmed = head;
    now.length = now.number = now.text = now.star = 0;
    now.trouble = GOOD;
    now.lost = now.numbered = false;
    now.part = NUMBER;
    now.crc = CRC_START;
}

void lines_restart(void) {
    head = tail = alarmed = overflowed = 0;
    overflow_told = told = guarded = false;
    for (unsigned at = 0; at < KNOWN; at++)
        known[at].there = false;
    next = 0;
    taken.there = false;
    before = GOOD;
    until_end = returned = false;
    until_quiet = true;
    begin();
}

void lines_init(void) {
    counts = (lines_counts){0};
    ended = 0;
    lines_restart();
}

void lines_alarm(void) { alarmed = end; }
bool lines_guarded(void) { return guarded; }
bool lines_whole(void) { return !until_quiet; }
lines_counts lines_count(void) { return counts; }
uint64_t lines_ended(void) { return ended; }
bool lines_wait(void) { return tail != head || overflowed; }
uint32_t lines_free(void) { return ROOM - 1 - (end - tail); }

static void say(uint32_t code, bool has_number, uint32_t number) {
    if (code && has_number)
        output_line("error:%u @%u", fault_error((fault_code)code), number);
    else if (code)
        output_line("error:%u", fault_error((fault_code)code));
    else if (has_number)
        output_line("ok @%u", number);
    else
        output_line("ok");
}

/* Send the sentence of a fault; returns its code. */
static uint32_t explain(const fault *f) {
    if (!f || f->code == FAULT_NONE)
        return FAULT_NONE;
    output_message(f);
    return f->code;
}

/* ---- receiving */

static void refuse(reason why) {
    uint32_t stored = end - head;
    counts.refused++;
    if (overflowed || ROOM - (head - tail) < NUMBER_DIGITS + 2) {
        overflowed++;
    } else {
        queue[head++ % ROOM] = (char)(REFUSED | why);
        if (now.part == TEXT && now.number <= UINT16_MAX && stored >= now.text)
            head += now.text - 2; /* only the digits of its number, which are already in place */
        queue[head++ % ROOM] = '\n';
    }
    begin();
}

/* Refuse a line without a number. While a tape is due, it may be the remainder of one or more
   damaged frames: then answer only once, and ask for the frame again. */
static void refuse_plain(reason why) {
    if (!tape_due()) {
        refuse(why);
    } else if (told) {
        begin();
    } else {
        told = true;
        frame_ask_again();
        refuse(why);
    }
}

/* Add the line to those that wait; false if there was no room. */
static bool keep(void) {
    if (overflowed || now.lost) {
        counts.refused++;
        overflowed++;
        begin();
        return false;
    }
    ended = hal_cycle();
    queue[end++ % ROOM] = '\n';
    head = end;
    counts.accepted++;
    begin();
    return true;
}

/* Answer a line, which is `there` if it has a number, and keep the answer of a numbered one. */
static void answer(struct known *line, const fault *f) {
    struct known *one = &known[line->number % KNOWN];
    line->code = (uint16_t)explain(f);
    line->answered = true;
    if (line->there && one->number == line->number)
        *one = *line;
    say(line->code, line->there, line->number);
}

static bool is_again(const struct known *one) {
    return one->there && one->number == now.number && one->check == now.check;
}

static bool is_text(const char *order) {
    uint32_t length = 0;
    for (; order[length]; length++) {
        char c = now.start[length];
        if ((c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c) != order[length])
            return false;
    }
    return now.length - now.text - (now.numbered ? CHECK : 0) == length;
}

bool lines_order(void) { return is_text("$RESUME") || is_text("$RETRACT"); }

static reason judge_plain(void) {
    if (guarded)
        return GUARDED;
    if (tape_due())
        return ON_TAPE;
    if (before != GOOD)
        return before;
    if (now.trouble != GOOD)
        return now.trouble;
    return until_end || until_quiet ? STALE : GOOD;
}

/* What a good line is: an order, or else `other`. */
static lines_part order_or(lines_part other) {
    return is_text("$RESUME") ? LINES_RESUME : is_text("$RETRACT") ? LINES_RETRACT : other;
}

/* A line without a number has ended. */
__attribute__((noinline)) static lines_part end_plain(void) {
    reason why = judge_plain();
    before = GOOD;
    until_end = false;
    if (why != GOOD) {
        refuse_plain(why);
        return LINES_ENDED;
    }
    lines_part is = order_or(LINES_ENDED);
    if (is == LINES_ENDED)
        (void)keep();
    return is;
}

/* A repeated line: answer it again, unless its first answer is still to come. */
static lines_part repeat(const struct known *one) {
    begin();
    if (one->answered)
        say(one->code, true, one->number);
    return one->answered ? LINES_ANSWERED : LINES_ENDED;
}

static reason judge_numbered(void) {
    if (now.trouble != GOOD)
        return now.trouble;
    if (now.part != TEXT || now.number > UINT16_MAX || now.star < now.text || !now.hex ||
        now.length != now.star + CHECK)
        return FORM;
    return now.check == now.crc_before ? GOOD : CHECK_WRONG;
}

__attribute__((noinline)) static lines_part end_numbered(void) {
    reason why = judge_numbered();
    struct known *one = &known[now.number % KNOWN];
    if (why == GOOD) {
        /* Its check proves that it is whole, whatever came before. */
        before = GOOD;
        told = until_end = until_quiet = false;
        if (is_again(one))
            return repeat(one);
        if (is_again(&taken))
            return repeat(&taken);
        if (now.number != next)
            why = SEQUENCE;
    }
    if (why != GOOD) {
        refuse(why);
        return LINES_ENDED;
    }
    lines_part is = order_or(LINES_ENDED);
    uint16_t check = (uint16_t)now.check;
    if (is == LINES_ENDED && !keep())
        return LINES_ENDED;
    *one = (struct known){.there = true, .number = next++, .check = check};
    guarded = true;
    return is;
}

void lines_ordered(const fault *f) {
    struct known line = {.there = false};
    if (now.numbered)
        line = known[now.number % KNOWN];
    counts.accepted++;
    begin();
    answer(&line, f);
}

/* Append a hexadecimal digit to `value`; false if `c` is not one. */
static bool read_hex(char c, uint32_t *value) {
    if (c >= '0' && c <= '9')
        *value = *value << 4 | (uint32_t)(c - '0');
    else if (c >= 'A' && c <= 'F')
        *value = *value << 4 | (uint32_t)(c - 'A' + 10);
    else
        return false;
    return true;
}

/* Find number and check of a line, one character in each call. */
static void read_form(char c) {
    if (now.length == 0) {
        now.numbered = c == '@';
    } else if (now.numbered && now.part == NUMBER) {
        if (c >= '0' && c <= '9' && now.length <= NUMBER_DIGITS) {
            now.number = now.number * 10 + (uint32_t)(c - '0');
        } else {
            now.part = c == ' ' && now.length > 1 ? TEXT : UNREADABLE;
            now.text = now.length + 1;
        }
    } else if (c == '*') {
        now.star = now.length;
        now.crc_before = now.crc;
        now.check = 0;
        now.hex = true;
    } else if (!read_hex(c, &now.check)) {
        now.hex = false;
    }
}

lines_part lines_byte(uint8_t byte) {
    char c = (char)byte;
    bool follows = c == '\n' && returned; /* the second half of CR LF */
    returned = c == '\r';
    if (c == '\n' || c == '\r') {
        /* An empty line may be a remainder of a frame or of a numbered line, or half of a CR LF. */
        if (!now.length && before == GOOD && (follows || guarded || tape_due()))
            return LINES_MORE;
        return now.numbered ? end_numbered() : end_plain();
    }
    if (byte >= 0x80) {
        if (now.length && now.trouble == GOOD)
            now.trouble = CHARACTER;
        return LINES_MORE;
    }
    read_form(c);
    uint32_t place = now.length++ - now.text; /* in its text */
    now.crc = crc_step(now.crc, byte);
    if (place < ORDER_START)
        now.start[place] = c;
    else if (place == LINES_LONGEST + (now.numbered ? CHECK : 0) && now.trouble == GOOD)
        now.trouble = TOO_LONG;
    now.lost = now.lost || end - tail >= ROOM - 1;
    if (!now.lost)
        queue[end++ % ROOM] = c;
    return LINES_MORE;
}

void lines_damaged(unsigned mark) {
    reason why = mark == MARK_FRAMING ? FRAMING : OVERRUN;
    if (!now.length)
        before = why;
    else if (now.trouble == GOOD)
        now.trouble = why;
}

void lines_cut(void) {
    /* The remainder of a damaged frame was already answered with the frame. */
    bool remainder = told && tape_due() && !now.numbered;
    if (now.length && !remainder)
        refuse(CUT);
    begin();
    before = GOOD;
    told = returned = false;
}

void lines_frame_good(void) { until_end = until_quiet = false; }

void lines_frame_bad(void) {
    until_end = until_quiet = true;
    told = true;
}

void lines_frame_end(void) {
    if (!now.length)
        return;
    if (now.numbered)
        refuse(CUT);
    else
        refuse_plain(CUT);
}

void lines_frame_stalled(void) { until_end = true; }

void lines_quiet(void) {
    bool due = tape_due();
    /* After the end of a line, or a reset, a pause means that no more of it will come. */
    bool remainder = until_quiet && !until_end;
    if (now.length && !now.numbered && (due || remainder))
        refuse_plain(due ? ON_TAPE : STALE);
    until_quiet = told = returned = false; /* a line feed from here on is a line of its own */
}

/* ---- handing out */

static uint32_t take_number(void) {
    uint32_t number = 0;
    for (; queue[tail % ROOM] >= '0' && queue[tail % ROOM] <= '9'; tail++)
        number = number * 10 + (uint32_t)(queue[tail % ROOM] - '0');
    tail++; /* the space, or the line's end */
    return number;
}

static void tell_refused(void) {
    reason why = (reason)((uint8_t)queue[tail++ % ROOM] & ~REFUSED);
    bool has_number = queue[tail % ROOM] != '\n';
    uint32_t number = take_number();
    if (has_number)
        output_line("[MSG:Line @%u is refused: %s.]", number, TEXTS[why]);
    else
        output_line("[MSG:A line is refused: %s.]", TEXTS[why]);
    say(why == TOO_LONG && !has_number ? FAULT_TOO_LONG : FAULT_LINE, has_number, number);
}

/* Tell the number of lost lines once; each further call answers one of them. */
static void tell_overflow(void) {
    if (overflow_told) {
        say(FAULT_LINE, false, 0);
        overflowed--;
    } else {
        output_line("[MSG:%u lines came faster than they were answered, and are refused.]",
                    overflowed);
    }
    overflow_told = overflowed;
}

lines_kind lines_take(char text[LINES_TEXT_SIZE], uint32_t *length) {
    if (tail == head && !overflowed)
        return LINES_NONE;
    if (tail == head) {
        tell_overflow();
        return LINES_REFUSED;
    }
    if ((uint8_t)queue[tail % ROOM] & REFUSED) {
        tell_refused();
        return LINES_REFUSED;
    }
    bool overtaken = (int32_t)(alarmed - tail) > 0;
    if (!overtaken)
        alarmed = tail;
    taken = (struct known){.there = queue[tail % ROOM] == '@'};
    if (taken.there) {
        tail++;
        taken.number = (uint16_t)take_number();
    }
    uint32_t count = 0;
    for (; queue[tail % ROOM] != '\n'; tail++)
        text[count++] = queue[tail % ROOM];
    tail++;
    if (taken.there) {
        uint32_t check = 0;
        for (uint32_t at = count - CHECK + 1; at < count; at++)
            (void)read_hex(text[at], &check);
        taken.check = (uint16_t)check;
        count -= CHECK;
    }
    *length = count;
    if (!overtaken)
        return LINES_TEXT;
    /* An unlock among them would let the lines behind it move the machine. */
    fault f = {0};
    fault_at(&f, FAULT_LOCKED, 0, "stopped by an alarm or a reset");
    answer(&taken, &f);
    return LINES_REFUSED;
}

void lines_answer(const fault *f) { answer(&taken, f); }
