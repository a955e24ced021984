// SPDX-License-Identifier: Apache-2.0
#include "app/keep.h"

#include <stddef.h>

#include "app/execute.h"
#include "app/firmware.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/program.h"
#include "app/resume.h"
#include "app/status.h"
#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "gap/condition_check.h"
#include "gap/gap.h"
#include "link/output.h"
#include "store/bookmark.h"
#include "store/flash.h"
#include "store/journal.h"
#include "store/slots.h"

enum { SETTINGS_KIND, PLACES_KIND, CONDITIONS_KIND, CLASSES_KIND };
_Static_assert(CLASSES_KIND + 1 == JOURNAL_KINDS, "the journal knows the number of kinds");

/* A setting in the journal: its number and its value, if this is not the initial one. */
#define SETTING_WORDS 2u
#define SETTINGS_A_PAGE (JOURNAL_PART / SETTING_WORDS)
#define SETTINGS_A_STEP 64u /* looked at between two calls of the watchdog */
/* Conditions are kept as they are in memory. A new layout needs a new mark. */
#define ROW_WORDS 11u
#define ROWS_A_PAGE (JOURNAL_PART / ROW_WORDS)
#define CLASSES_WORDS (GAP_CLASSES * sizeof(gap_class) / 4)
#define PAGES_OF(count, a_page) ((count) ? ((count) + (a_page) - 1) / (a_page) : 1)
_Static_assert(sizeof(condition_row) == 4 * ROW_WORDS, "the mark GKJ1 means another layout");
_Static_assert(PAGES_OF(SETTINGS, SETTINGS_A_PAGE) + 1 + PAGES_OF(CONDITIONS_ENTERED, ROWS_A_PAGE) +
               1 <= 12, "a sector must hold all kinds and some changes");
_Static_assert(PLAN_KEPT <= JOURNAL_PART && CLASSES_WORDS <= JOURNAL_PART, "they take one page");
/* L20 may subtract a coordinate from a position and an offset. */
#define PLACE_LIMIT (4 * (int64_t)UNITS_POSITION_LIMIT)

static unsigned refused;            /* parts of the journal that are not allowed any more */
static bool told;
static uint32_t editions[JOURNAL_KINDS];    /* as last noted */

/* ---- to the journal */

static unsigned pages_of(unsigned kind) {
    unsigned count = 0;
    switch (kind) {
    case SETTINGS_KIND: return PAGES_OF(settings_differing(), SETTINGS_A_PAGE);
    case CONDITIONS_KIND:
        for (unsigned at = 0; at < CONDITIONS_ENTERED; at++)
            count += conditions_by_hand(at) != 0;
        return PAGES_OF(count, ROWS_A_PAGE);
    default: return 1;
    }
}

static unsigned fill_settings(unsigned page, uint32_t *part) {
    unsigned seen = 0, at = 0;
    for (setting which = 0; which < SETTINGS; which++) {
        if (which % SETTINGS_A_STEP == 0)
            watch_between();
        if (settings_differs(which) && seen++ / SETTINGS_A_PAGE == page) {
            part[at++] = settings_number(which);
            part[at++] = settings_get(which);
        }
    }
    return at;
}

static unsigned fill_conditions(unsigned page, uint32_t *part) {
    unsigned seen = 0, at = 0;
    for (unsigned place = 0; place < CONDITIONS_ENTERED; place++) {
        const condition_row *row = conditions_by_hand(place);
        if (row && seen++ / ROWS_A_PAGE == page) {
            __builtin_memcpy(part + at, row, sizeof *row);
            at += ROW_WORDS;
        }
    }
    return at;
}

static unsigned fill(unsigned kind, unsigned page, uint32_t *part) {
    const void *from = execute_state()->systems;
    unsigned count = PLAN_KEPT;
    switch (kind) {
    case SETTINGS_KIND: return fill_settings(page, part);
    case CONDITIONS_KIND: return fill_conditions(page, part);
    case CLASSES_KIND:
        from = in_force_kept_class(0);
        count = CLASSES_WORDS;
        break;
    default: break;
    }
    __builtin_memcpy(part, from, count * sizeof *part);
    return count;
}

static uint32_t edition(unsigned kind) {
    switch (kind) {
    case SETTINGS_KIND: return settings_edition();
    case CONDITIONS_KIND: return conditions_edition();
    case PLACES_KIND: return execute_state()->edition;
    default: return in_force_edition();
    }
}

/* ---- from the journal */

void keep_open(void (*between)(void)) {
    static const journal_source SOURCE = {pages_of, fill};
    refused = 0;
    told = false;
    (void)journal_open(&SOURCE, between);
    resume_open(between);
}

void keep_load_settings(void) {
    const uint32_t *part;
    unsigned count;
    for (unsigned page = 0; (part = journal_load(SETTINGS_KIND, page, &count)); page++)
        for (unsigned at = 0; at + SETTING_WORDS <= count; at += SETTING_WORDS)
            refused += !settings_load(part[at], part[at + 1]);
}

/* A byte that is neither 0 nor 1 is no `bool`. */
static bool is_bool(const void *from, size_t at) { return ((const uint8_t *)from)[at] <= 1; }

static bool load_row(const uint32_t *from) {
    condition_row row;
    if (!is_bool(from, offsetof(condition_row, negative)) ||
        ((const uint8_t *)from)[offsetof(condition_row, from_ignition)] > CONDITIONS_RELAXATION)
        return false;
    __builtin_memcpy(&row, from, sizeof row);
    return condition_check_row(&row) && conditions_enter(&row, true);
}

void keep_load_gap(void) {
    const uint32_t *part;
    unsigned count;
    for (unsigned page = 0; (part = journal_load(CONDITIONS_KIND, page, &count)); page++)
        for (unsigned at = 0; at + ROW_WORDS <= count; at += ROW_WORDS)
            refused += !load_row(part + at);
    part = journal_load(CLASSES_KIND, 0, &count);
    for (unsigned number = 0; part && number < GAP_CLASSES && number < count; number++) {
        gap_class row;
        __builtin_memcpy(&row, part + number, sizeof row);
        if (row.share_percent >= GAP_SHARE_PERCENT && row.share_percent <= 100)
            in_force_enter_class(number, &row, true);
        else
            refused++;
    }
}

/* Work offsets and places, which follow each other; wire offsets; which of them there are. */
static bool places_sound(const uint32_t *kept) {
    unsigned at = 0;
    for (; at < (PLAN_SYSTEMS + PLAN_PLACES) * HAL_AXES; at++)
        if ((int32_t)kept[at] > PLACE_LIMIT || (int32_t)kept[at] < -PLACE_LIMIT)
            return false;
    for (; at < PLAN_KEPT - 1; at++)
        if (kept[at] > (uint32_t)units_radius_limit() / 10)
            return false;
    return is_bool(kept + at, 2) && is_bool(kept + at, 3);
}

void keep_load_places(void) {
    unsigned count;
    const uint32_t *part = journal_load(PLACES_KIND, 0, &count);
    if (part && count == PLAN_KEPT && places_sound(part))
        execute_put_places(part);
    else
        refused += part != 0;
}

void keep_begin(void (*between)(void)) {
    journal_begin(between);
    for (unsigned kind = 0; kind < JOURNAL_KINDS; kind++)
        editions[kind] = edition(kind);
}

static void tell(const char *format, uint32_t number) {
    fault said = {0};
    fault_at(&said, FAULT_NONE, 0, format, number);
    output_message(&said);
}

void keep_tell(void) {
    if (told)
        return;
    told = true;
    firmware_tell_found();
    resume_tell();
    static const char *const SAYS[] = {
        [JOURNAL_NONE] = "no flash memory answers (identity %u): power-off clears settings and offsets",
        [JOURNAL_UNREADABLE] = "the journal in flash memory cannot be read: settings, offsets, "
                               "conditions and fluid classes are as built",
        [JOURNAL_FAILED] = "the flash memory does not keep what is written: power-off clears it",
    };
    if (journal_now() != JOURNAL_KEEPS)
        tell(SAYS[journal_now()], flash_identity());
    if (refused)
        tell("out of range in the journal, so as built: %u settings, offsets or conditions", refused);
}

/* ---- in the main loop */

bool keep_step(void) {
    for (unsigned kind = 0; kind < JOURNAL_KINDS; kind++)
        if (edition(kind) != editions[kind]) {
            editions[kind] = edition(kind);
            journal_note(kind);
        }
    if (firmware_step(journal_waits() || bookmark_holds()))
        return true;
    bool more = false;
    if (journal_waits() && !bookmark_holds() &&
        (journal_holds() || (!machine_machining() && meter_rests()))) {
        watch_between();
        more = journal_step();
        if (journal_now() == JOURNAL_FAILED) {
            told = false;
            refused = 0;
            keep_tell();
        }
    }
    if (bookmark_waits() && !journal_holds() && !slots_busy()) {
        watch_between();
        more = resume_step() || more;
        watch_between();
    }
    return more;
}

bool keep_waits(void) { return journal_waits(); }

void keep_restore(char what, uint32_t length, fault *f) {
    bool all = what == '*';
    if (length != 6 || (!all && what != '$' && what != '#')) {
        fault_at(f, FAULT_COMMAND, 0, "$RST takes $ (settings), # (offsets and places) or * (all)");
        return;
    }
    if (!meter_rests() || (!status_idle() && !machine_locked())) {
        fault_at(f, FAULT_BUSY, 0, "$RST has to wait until the machine stands and no program runs");
        return;
    }
    if (all || what == '$') {
        settings_init(watch_between, watch_between);
        watch_between();
        gap_settings();
        watch_between();
        machine_lose_position(); /* drives may count otherwise now */
    }
    if (all || what == '#') {
        uint32_t none[PLAN_KEPT] = {0};
        execute_put_places(none);
    }
    if (all) {
        conditions_reset();
        in_force_forget_classes();
    }
    output_line("[MSG:Restoring defaults]");
}
