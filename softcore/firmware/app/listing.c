// SPDX-License-Identifier: Apache-2.0
#include "app/listing.h"

#include "app/events.h"
#include "app/image_watch.h"
#include "app/profile.h"
#include "app/program.h"
#include "app/scope.h"
#include "app/wiring.h"
#include "base/grbl.h"
#include "base/settings.h"
#include "base/text.h"
#include "hal/hal.h"
#include "link/output.h"

/* Rows of a list: grbl's settings come before ours, so that numbers ascend. */
#define ROWS (GRBL_ROWS + SETTINGS)
/* Types and formats of values as in grblHAL. */
#define WHOLE "5|#########0"
#define DECIMAL "6|#########0.000"
#define GROUP_OF_GRBL 0u    /* grblHAL's root, which needs no name */

static listing_kind list;
static unsigned next, end;

void listing_stop(void) { next = end; }

void listing_begin(listing_kind kind) {
    list = kind;
    next = 0;
    end = kind == LISTING_GROUPS ? SETTINGS_GROUPS
        : kind == LISTING_COST || kind == LISTING_INPUTS ? 1
        : kind == LISTING_MEMORY ? hal_memory_words()
                                 : ROWS;
}

bool listing_open(void) { return next < end; }

static void tell_value(unsigned row) {
    char value[GRBL_VALUE];
    if (row < GRBL_ROWS) {
        grbl_value(row, value, sizeof value);
        output_line("$%u=%s", (uint32_t)GRBL_TABLE_ROWS[row].number, value);
    } else {
        setting which = (setting)(row - GRBL_ROWS);
        output_line("$%u=%u", settings_number(which), settings_get(which));
    }
}

/* A value that cannot be set is sent as both ends of its range. */
__attribute__((noinline)) static void tell_words(unsigned row) {
    char value[GRBL_VALUE];
    if (row < GRBL_ROWS) {
        const grbl_table_row *one = &GRBL_TABLE_ROWS[row];
        grbl_value(row, value, sizeof value);
        output_line("[SETTING:%u|%u|%s|%s|%s|%s|%s]", (uint32_t)one->number, GROUP_OF_GRBL, one->title,
                    one->unit, one->source < GRBL_RESOLUTION ? WHOLE : DECIMAL, value, value);
    } else {
        setting which = (setting)(row - GRBL_ROWS);
        const settings_table_row *one = settings_row(which);
        char point[32] = "";
        if (which - SETTINGS_ALIKE < SETTINGS_SO_MANY)
            text_print(point, sizeof point, ", %c%u",
                       "XYZ"[(which - SETTINGS_ALIKE) / (SETTINGS_SO_MANY / HAL_AXES)],
                       (which - SETTINGS_ALIKE) % (SETTINGS_SO_MANY / HAL_AXES) + 1);
        output_line("[SETTING:%u|%u|%s%s|%s|" WHOLE "|%u|%u]", settings_number(which), one->group + 1u,
                    one->title, point, SETTINGS_TABLE_UNITS[one->unit], one->lowest, one->highest);
    }
}

/* Number of blocks and clocks per block; longest step of each task of the main loop; longest time
   from an event of the gateware to the end of its interrupt; time spent on checking the image. Times
   are in clocks since reset. */
static void tell_cost(void) {
    program_cost cost = program_profile();
    output_line("[PRF:blocks %u,mean %u,worst %u,events %u,path %u,program %u,link %u,interrupt %u,"
                "image %u]",
                cost.blocks, cost.blocks ? cost.total / cost.blocks : 0, cost.worst,
                profile_worst(0), profile_worst(1), profile_worst(2), profile_worst(3), events_worst(),
                image_watch_clocks());
}

bool listing_tell(void) {
    switch (list) {
    case LISTING_VALUES: tell_value(next); break;
    case LISTING_WORDS: tell_words(next); break;
    case LISTING_COST: tell_cost(); break;
    case LISTING_INPUTS: wiring_tell_inputs(); break;
    case LISTING_MEMORY: next = wiring_read_memory(next); return next == end;
    case LISTING_SCOPE: next += scope_tell(next, end); return next == end;
    default: output_line("[SETTINGGROUP:%u|0|%s]", next + 1u, SETTINGS_TABLE_GROUPS[next]); break;
    }
    return ++next == end;
}

bool listing_begin_one(uint32_t number) {
    unsigned row = grbl_find(number);
    if (row == GRBL_ROWS)
        row += settings_find(number);
    if (row == ROWS)
        return false;
    list = LISTING_WORDS;
    next = row;
    end = row + 1;
    return true;
}

void listing_begin_scope(uint32_t first, uint32_t last) {
    list = LISTING_SCOPE;
    next = first;
    end = last;
}
