// SPDX-License-Identifier: Apache-2.0
#include "app/homing_axis.h"

#include "app/homing.h"
#include "app/machine.h"
#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"
#include "path/path.h"
#include "base/rare.h"

#define REST_US 50000       /* axes are at rest when they have stood for this time */

static int32_t stood[HAL_AXES]; /* places of the axes at the last look */

void homing_axis_go(int32_t way, uint32_t speed) {
    uint32_t highest = settings_highest_speed();
    path_move move = {0};
    move.delta[homing_now.axis] = way;
    hal_axis_limits(homing_now.axis, -UNITS_POSITION_LIMIT, UNITS_POSITION_LIMIT);
    path_append(&move, units_rate(speed < highest ? speed : highest), false, false);
    machine_run(true);
}

int32_t homing_axis_pull_off(void) {
    int32_t way = units_pulses_of_um(settings_get(SET_HOME_PULL_OFF_UM));
    return homing_now.down ? way : -way;
}

/* The error counters cannot tell it: with the drives off an axis never reaches its command. Between
   two edges of a coarse coder an axis goes to and fro over one of them. */
bool homing_axis_stands(void) {
    uint32_t now = hal_cycle_low();
    for (unsigned k = 0; k < HAL_AXES; k++) {
        uint32_t edge = settings_edge(k), reach = edge > 1 ? edge : 0;
        int32_t at = hal_axis_position(k);
        if ((uint32_t)at - (uint32_t)stood[k] + reach > 2 * reach) {
            stood[k] = at;
            homing_now.since = now;
        }
    }
    return now - homing_now.since > units_clocks_of_us(REST_US);
}
