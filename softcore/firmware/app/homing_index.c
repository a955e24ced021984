// SPDX-License-Identifier: Apache-2.0
#include "app/homing_index.h"

#include "app/control.h"
#include "app/homing.h"
#include "app/homing_axis.h"
#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"
#include "link/output.h"
#include "base/rare.h"

/* An index that lies nearer to the end of the pull-off than this part of it may be passed or taken by
   chance, as the switch scatters. */
#define NEAR 8

bool homing_index_wanted(void) { return settings_get(SET_HOME_INDEX) >> homing_now.axis & 1; }

void homing_index_leave(void) {
    homing_now.passed = false;
    hal_index_arm(1u << homing_now.axis);
}

void homing_index_search(void) {
    uint32_t um = settings_get(SET_HOME_INDEX_UM), travel = settings_travel_um(homing_now.axis);
    int32_t way = units_pulses_of_um(um < travel ? um : travel);
    homing_now.phase = HOMING_INDEX;
    homing_now.told = false;
    control_begin_path();
    hal_index_arm(1u << homing_now.axis);
    homing_axis_go(homing_now.down ? way : -way, settings_get(SET_HOME_SLOW_MM_MIN) * 1000);
}

/* How far a place lies from the end of the pull-off. */
static uint32_t from_pull_off(int32_t place) {
    int32_t way = place - homing_now.switched - homing_axis_pull_off();
    return (uint32_t)(way < 0 ? -way : way);
}

static void tell(void) {
    uint32_t way = from_pull_off(homing_now.index), nearest = way;
    if (homing_now.passed && from_pull_off(homing_now.before) < nearest)
        nearest = from_pull_off(homing_now.before);
    char axis = "XYZ"[homing_now.axis];
    if (nearest < from_pull_off(homing_now.switched) / NEAR)
        output_line("[MSG:%c: an index is %p mm from the pull-off: it may be another next time. Change $%u.]",
                    axis, (int32_t)nearest, settings_number(SET_HOME_PULL_OFF_UM));
    else
        output_line("[MSG:%c: the index is %p mm behind the pull-off.]", axis, (int32_t)way);
    homing_now.told = true;
}

void homing_index_found(void) {
    bool rests = homing_axis_stands() && !hal_motion_read().moving;
    if (!homing_now.told) {
        if (output_has_room())
            tell();
    } else if (rests) {
        int32_t way = homing_now.index - hal_axis_command(homing_now.axis);
        homing_now.phase = HOMING_BACK;
        control_begin_path();
        if (way)
            homing_axis_go(way, settings_get(SET_HOME_SLOW_MM_MIN) * 1000);
    }
}
