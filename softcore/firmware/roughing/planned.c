// SPDX-License-Identifier: Apache-2.0
#include "roughing/planned.h"

#include "base/settings.h"
#include "base/units.h"
#include "roughing/staircase.h"

#define WITHIN_MILLI_IP 10      /* as near as a condition must have the current that is planned */

static technology_row rows[STAIRCASE_STEPS];
static int32_t depths[STAIRCASE_STEPS + 1];
static unsigned added, held;
static bool given;              /* the supply can be set to all that were added */
static uint32_t step_ma;        /* of the supply, when they were */

void planned_forget(void) {
    added = held = 0;
    given = true;
}

void planned_add(uint32_t ip, uint32_t depth_um) {
    if (added == STAIRCASE_STEPS)
        return;
    technology_row *row = &rows[added];
    uint32_t level;
    *row = technology_planned(ip);
    uint32_t off = row->milli_ip > ip * 1000 ? row->milli_ip - ip * 1000 : ip * 1000 - row->milli_ip;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    given = given && off <= WITHIN_MILLI_IP && technology_level(row, &level);
    if (given)
        row->milli_ip = (uint16_t)(level * step_ma * 1000 / TECHNOLOGY_IP_MA);
    depths[++added] = units_pulses_of_um(depth_um);
}

bool planned_hold(void) {
    held = given ? added : 0;
    return held;
}

void planned_presume(void) {
    rows[0] = technology_planned(1);
    rows[0].reference_mv = rows[0].drop_mv = 1;     /* as entered by hand, for any law */
    depths[1] = 0;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    added = held = 1;
}

unsigned planned_count(void) { return step_ma == settings_get(SET_CURRENT_STEP_MA) ? held : 0; }
const technology_row *planned_first(void) {
    static technology_row first;
    first = rows[0];
    return &first;
}
const technology_row *planned_row(unsigned step) { return &rows[step]; }
int32_t planned_depth(unsigned step) { return depths[step]; }
