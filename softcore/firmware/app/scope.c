// SPDX-License-Identifier: Apache-2.0
#include "app/scope.h"

#include "base/settings.h"
#include "base/text.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "link/crc.h"
#include "link/output.h"

#define BEGIN 7             /* characters of `$SCOPE=` */
#define HALF 50
#define MOST_BEFORE 99      /* % */
#define LEVELS 4096

static const struct {
    char word[11];
    uint8_t source, classes;
} TRIGGERS[] = {
    {"NOW", HAL_SCOPE_NOW, 0},       {"SHORT", HAL_SCOPE_SHORT, 0},
    {"OPEN", HAL_SCOPE_CLASS, 1},    {"RETRACTION", HAL_SCOPE_RETRACTION, 0},
    {"OK", HAL_SCOPE_CLASS, 2},      {"ARC", HAL_SCOPE_CLASS, 4},
    {"SHORTED", HAL_SCOPE_CLASS, 8}, {"RISE", HAL_SCOPE_RISE, 0},
    {"FALL", HAL_SCOPE_FALL, 0},
};

/* Pass `word` at `*at`, up to a comma or the end of the line. Case does not matter. */
static bool passes(const char *line, uint32_t length, uint32_t *at, const char *word) {
    uint32_t place = *at;
    for (; *word; word++, place++)
        if (place == length || (line[place] & ~0x20) != *word)
            return false;
    if (place < length && line[place] != ',')
        return false;
    *at = place;
    return true;
}

/* Read `,number`. */
static bool number(const char *line, uint32_t length, uint32_t *at, uint32_t *value) {
    if (*at == length || line[*at] != ',')
        return false;
    ++*at;
    return settings_read_number(line, length, at, value);
}

/* Send a line with its CRC. */
static void tell(const char *text, size_t length) {
    uint16_t crc = CRC_START;
    for (size_t k = 0; k < length; k++)
        crc = crc_step(crc, (uint8_t)text[k]);
    watch_between();
    output_line("[%s*%x%x]", text, (unsigned)crc >> 8, (unsigned)crc & 0xffu);
}

static void tell_state(void) {
    static const char *const WORDS[] = {"idle", "armed", "triggered", "full"};
    hal_scope_state now = hal_scope_read();
    bool full = now.recording == HAL_SCOPE_FULL;
    char text[6 * TEXT_NUMBER];
    size_t length = text_print(text, sizeof text, "SCOPE:%s,%u,%u,%u,%u,%u", WORDS[now.recording],
                               hal_scope_depth(), now.count,
                               full ? now.count - 1 - now.after : 0u, now.time,
                               hal_clock_hz());
    tell(text, length);
}

static bool arm(const char *line, uint32_t length, fault *f) {
    uint32_t at = BEGIN, before = HALF, level = 0;
    unsigned row = 0;
    while (row < sizeof TRIGGERS / sizeof *TRIGGERS && !passes(line, length, &at, TRIGGERS[row].word))
        row++;
    if (row == sizeof TRIGGERS / sizeof *TRIGGERS)
        return fault_at(f, FAULT_COMMAND, BEGIN + 1, "the oscilloscope knows no such order or trigger");
    bool crosses = TRIGGERS[row].source >= HAL_SCOPE_RISE;
    if (at < length && (!number(line, length, &at, &before) || before > MOST_BEFORE))
        return fault_at(f, FAULT_COMMAND, at, "the share before the trigger is 0 to %u %%", MOST_BEFORE);
    if (crosses != (at < length) ||
        (crosses && (!number(line, length, &at, &level) || level >= LEVELS || at < length)))
        return fault_at(f, FAULT_COMMAND, at,
                        crosses ? "RISE and FALL need a level: RISE,before,level with 0 to 4095"
                                : "only RISE and FALL have a level");
    uint32_t depth = hal_scope_depth();
    hal_scope_trigger trigger = {.source = TRIGGERS[row].source, .classes = TRIGGERS[row].classes,
                                 .level = level, .after = depth - 1 - depth * before / 100};
    hal_scope_arm(&trigger);
    return true;
}

static bool begins_reading(const char *line, uint32_t length, uint32_t at, uint32_t *first,
                           uint32_t *end, fault *f) {
    uint32_t count;
    hal_scope_state now = hal_scope_read();
    if (now.recording != HAL_SCOPE_FULL)
        return fault_at(f, FAULT_BUSY, 0, "the oscilloscope has no full record to read");
    if (!number(line, length, &at, first) || !number(line, length, &at, &count) || at < length ||
        !count || *first >= now.count || count > now.count - *first)
        return fault_at(f, FAULT_COMMAND, at, "READ,first,count reads some of entries 0 to %u",
                        now.count - 1);
    *end = *first + count;
    return true;
}

bool scope_line(const char *line, uint32_t length, uint32_t *first, uint32_t *end, fault *f) {
    uint32_t at = BEGIN;
    *end = 0;
    if (!hal_scope_depth())
        return fault_at(f, FAULT_COMMAND, 0, "this controller is built without the oscilloscope");
    if (length == BEGIN - 1) {
        tell_state();
        return true;
    }
    if (line[BEGIN - 1] != '=')
        return fault_at(f, FAULT_COMMAND, BEGIN, "an order to the oscilloscope reads $SCOPE=order");
    if (passes(line, length, &at, "READ"))
        return begins_reading(line, length, at, first, end, f);
    bool stops = passes(line, length, &at, "STOP");
    if (stops || passes(line, length, &at, "FORCE")) {
        if (at < length)
            return fault_at(f, FAULT_COMMAND, at + 1, "STOP and FORCE have no numbers");
        hal_scope_order(stops ? HAL_SCOPE_STOP : HAL_SCOPE_FORCE);
        return true;
    }
    return arm(line, length, f);
}

uint32_t scope_tell(uint32_t first, uint32_t end) {
    char text[TEXT_NUMBER + 6 * SCOPE_ENTRIES];
    uint32_t count = end - first < SCOPE_ENTRIES ? end - first : SCOPE_ENTRIES;
    size_t length = text_print(text, TEXT_NUMBER, "SCOPE@%u:", first);
    hal_scope_choose(first);
    for (uint32_t k = 0; k < count; k++) {
        uint64_t entry = hal_scope_next();
        for (unsigned shift = 36; shift;) {
            shift -= 6;
            text[length++] = (char)('0' + (uint32_t)(entry >> shift & 63));
        }
    }
    text[length] = '\0';
    watch_between();
    tell(text, length);
    return count;
}
