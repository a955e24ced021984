// SPDX-License-Identifier: Apache-2.0
#include "roughing/commands.h"

#include "base/text.h"
#include "base/units.h"
#include "roughing/basic.h"
#include "roughing/result.h"
#include "roughing/staircase.h"
#include "base/rare.h"

#define NUMBERS (1 + BASIC_DEPTHS + BASIC_STOCKS)
#define JOB_LEAST 3
#define JOB_NUMBERS 6
#define FINE 10             /* 0.1 um Rmax */
#define STEEPEST 6000       /* 1/100 degree */

static enum { IDLE, READING, ENTERING, LISTING, NAMING, NAMED, PLANNING, TELLING } doing;
static uint32_t told;       /* lines of the result, or of the list */

/* A line is taken, read and carried out in three passes of the main loop, to keep each of them
   short. */
static const char *line;
static uint32_t length;
static uint32_t numbers[NUMBERS];
static unsigned count;
static char name[BASIC_NAME];   /* of a pair; empty without one */

void roughing_init(void) {
    basic_forget();
    result_forget();
    roughing_stop();
}

void roughing_stop(void) { doing = IDLE; }
bool roughing_busy(void) { return doing != IDLE; }

/* Decimals of the numbers of a line; the last entry holds for all further numbers. */
static const struct {
    char name;
    uint8_t decimals[JOB_NUMBERS];
} LINES[] = {{'D', {3, 3, 3, 3, 3, 3}}, {'R', {1, 1, 1, 1, 1, 1}}, {'A', {2}},
             {'I', {2, 1, 1, 1, 1, 1}}, {'P', {2, 1, 3, 2, 0, 1}}, {'F', {2}}, {'L', {0}}, {'M', {0}}};

/* Append a digit if it fits. Numbers with decimals become floats by way of signed numbers; only a
   seed may have all 32 bits. There is no division, as all digits of a line are read in one pass of
   the main loop. */
static bool append(uint32_t *value, uint32_t digit, unsigned decimals) {
    uint32_t limit = decimals ? INT32_MAX : UINT32_MAX, before = *value * 10;
    if (*value > UINT32_MAX / 10 || before > limit - digit)
        return false;
    *value = before + digit;
    return true;
}

/* Read a number, in units of its last decimal. */
static bool read_number(uint32_t *at, unsigned decimals, uint32_t *value, fault *f) {
    unsigned digits = 0, behind = 0;
    bool point = false, fits = true;
    *value = 0;
    for (; fits && *at < length; (*at)++) {
        char c = line[*at];
        if (c == '.' && !point && decimals) {
            point = true;
            continue;
        }
        if (c < '0' || c > '9' || (point && ++behind > decimals))
            break;
        digits++;
        fits = append(value, (uint32_t)(c - '0'), decimals);
    }
    bool ended = digits && (*at == length || line[*at] == ',');
    for (; ended && behind < decimals; behind++)
        fits = fits && append(value, 0, decimals);
    if (!fits)
        return fault_at(f, FAULT_SETTING, *at + 2, "the number is too large");
    if (!ended)
        return decimals ? fault_at(f, FAULT_SETTING, *at + 3,
                                   "a number with at most %u digits behind the point is needed",
                                   decimals)
                        : fault_at(f, FAULT_SETTING, *at + 3, "a whole number is needed");
    return true;
}

static bool begin(bool program_runs, fault *f) {
    if (count < JOB_LEAST || count > JOB_NUMBERS)
        return fault_at(f, FAULT_SETTING, 0,
                        "$BP needs area, undersize and depth; gradient, seed and roughness may follow");
    if (!numbers[0] || !numbers[1] || !numbers[2])
        return fault_at(f, FAULT_SETTING, 0, "area, undersize and depth must be above 0");
    if (program_runs)
        return fault_at(f, FAULT_BUSY, 0, "nothing is planned while a program runs");
    uint32_t gradient = count > 3 ? numbers[3] : 0;
    if (gradient > STEEPEST)
        return fault_at(f, FAULT_SETTING, 0, "the gradient is at most 60 degrees");
    staircase_job job = {
        .area = numbers[0],
        .undersize = numbers[1],
        .depth_um = numbers[2],
        .taper = gradient,
        .parts = 1,
        .seed = count > 4 ? numbers[4] : 1,
        .rmax = count > 5 ? numbers[5] : FINE,
    };
    if (!staircase_begin(&job, f))
        return false;
    result_forget();
    doing = PLANNING;
    told = 0;
    return true;
}

void roughing_line(const char *from, uint32_t characters) {
    line = from;
    length = characters;
    doing = READING;
}

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* Read the name of a pair: letters, kept as capitals, digits, `_` and `-`. */
static bool read_name(fault *f) {
    unsigned at = 1;
    for (; at < length && at < BASIC_NAME; at++) {
        char c = line[at];
        if (c >= 'a' && c <= 'z')
            c -= 'a' - 'A';
        if (!is_digit(c) && !(c >= 'A' && c <= 'Z') && c != '_' && c != '-')
            break;
        name[at - 1] = c;
    }
    name[at - 1] = '\0';
    return at == length ||
           fault_at(f, FAULT_SETTING, at + 3,
                    "a pair has a name of at most %u letters, digits, _ and -",
                    (uint32_t)BASIC_NAME - 1);
}

static bool read_line(fault *f) {
    uint32_t at = 1;
    unsigned kind = 0;
    while (kind < sizeof LINES / sizeof *LINES && (!length || LINES[kind].name != line[0]))
        kind++;
    if (kind == sizeof LINES / sizeof *LINES)
        return fault_at(f, FAULT_SETTING, 0, "basic data are entered with $BM, $BD, $BR, $BA and $BI; $BL lists them, $BF forgets them");
    count = 0;
    name[0] = '\0';
    if (length == 1 && (line[0] == 'L' || line[0] == 'F' || line[0] == 'M'))
        return true;
    if (line[0] == 'M' || (line[0] == 'F' && !is_digit(line[1])))
        return read_name(f);
    do {
        unsigned decimals = LINES[kind].decimals[count < JOB_NUMBERS ? count : JOB_NUMBERS - 1];
        if (count == NUMBERS)
            return fault_at(f, FAULT_SETTING, at + 3, "more than %u numbers", (uint32_t)NUMBERS);
        /* Only the stock of a finish may differ to either side. */
        bool negative = line[0] == 'R' && count % 2 && at < length && line[at] == '-';
        at += negative;
        if (!read_number(&at, decimals, &numbers[count], f))
            return false;
        if (negative)
            numbers[count] = 0 - numbers[count];
        count++;
    } while (at++ < length);
    return true;
}

/* Carry out a line. */
static roughing_step enter(bool program_runs, fault *f) {
    doing = IDLE;
    switch (line[0]) {
    case 'D': basic_depths(numbers, count, f); break;
    case 'R': basic_finish(numbers, count, f); break;
    case 'A':
        if (count > 1)
            fault_at(f, FAULT_SETTING, 0, "$BA takes one area");
        else
            basic_area(numbers[0], f);
        break;
    case 'I': basic_current(numbers[0], numbers + 1, count - 1, f); break;
    case 'F':
        if (count > 1)
            fault_at(f, FAULT_SETTING, 0, "$BF takes one area or one pair, or none for all");
        else if (name[0])
            basic_remove(name, f);
        else if (count)
            basic_drop(numbers[0], f);
        else
            basic_forget();
        break;
    case 'L':
        if (count)
            fault_at(f, FAULT_SETTING, 0, "$BL takes no number");
        else
            doing = LISTING;
        told = 0;
        break;
    case 'M':
        if (name[0])
            basic_select(name);
        else
            doing = NAMING;
        break;
    default: begin(program_runs, f); break;
    }
    return doing == IDLE ? ROUGHING_ANSWERS : ROUGHING_WORKS;
}

/* Tenths of a length, rounded. */
static uint32_t tenths(float um) { return (uint32_t)(int32_t)(um * 10 + 0.5f); }

/* Write the note with this number; false if it does not apply. */
static bool note(uint32_t number, const staircase_result *found, char *text, size_t size) {
    uint32_t bottom = tenths(found->bottom_um), side = tenths(found->side_um);
    switch (number) {
    case 0:
        return (bottom || side) &&
               text_print(text, size, "The last step leaves %u.%u um on the bottom and %u.%u um on the side",
                          bottom / 10, bottom % 10, side / 10, side % 10);
    case 1:
        return found->greatest &&
               text_print(text, size,
                          "The undersize allows the greatest current of the basic data, or more");
    case 2:
        return found->ended && text_print(text, size, "The basic data have no greater current");
    case 3: return found->single && text_print(text, size, "The basic data have one depth only");
    case 4:
        return found->beyond &&
               text_print(text, size, "%u depths lie above the shallowest of the basic data",
                          found->beyond);
    case 5:
        return found->untrusted &&
               text_print(text, size, "%u networks were not trusted and were replaced by interpolation",
                          found->untrusted);
    default:
        return !result_hold() &&
               text_print(text, size,
                          "The power supply is not set to all of these currents: G39 P1 has no staircase");
    }
}

#define NOTES 7

/* Tell the result, one line in each call: the undersize, the currents from the surface down, the
   notes. */
static roughing_step tell(const staircase_result *found, char *text, size_t size) {
    uint32_t at = told++;
    if (at == 0) {
        uint32_t needs = tenths(found->beta_um), has = tenths(found->undersize_um);
        text_print(text, size, "The last step needs an undersize of %u.%u um, of %u.%u um allowed",
                   needs / 10, needs % 10, has / 10, has % 10);
        return ROUGHING_TELLS;
    }
    if (at <= found->count) {
        const staircase_run *run = &found->runs[found->count - at];
        result_add(run->level, run->depth_um);
        text_print(text, size, "IP %u to %p mm", run->level, units_pulses_of_um(run->depth_um));
        return ROUGHING_TELLS;
    }
    for (uint32_t number = at - found->count - 1; number < NOTES; number++, told++)
        if (note(number, found, text, size))
            return ROUGHING_TELLS;
    doing = IDLE;
    return ROUGHING_ANSWERS;
}

roughing_step roughing_serve(bool program_runs, char *text, size_t size, fault *f) {
    switch (doing) {
    case READING:
        doing = read_line(f) ? ENTERING : IDLE;
        return doing == IDLE ? ROUGHING_ANSWERS : ROUGHING_WORKS;
    case ENTERING: return enter(program_runs, f);
    case LISTING:
        text_print(text, size, "$B");
        if (basic_line(told++, text + 2, size - 2))
            return ROUGHING_TELLS;
        doing = IDLE;
        return ROUGHING_ANSWERS;
    case NAMING:
        text_print(text, size, "$BM%s", basic_selected());
        doing = NAMED;
        return ROUGHING_TELLS;
    case NAMED:
        doing = IDLE;
        return ROUGHING_ANSWERS;
    case PLANNING:
        if (program_runs)
            return ROUGHING_WAITS;
        if (!staircase_step())
            doing = TELLING;
        return ROUGHING_WORKS;
    default: break;
    }
    const staircase_result *found = staircase_found(f);
    if (found)
        return tell(found, text, size);
    doing = IDLE;
    return ROUGHING_ANSWERS;
}
