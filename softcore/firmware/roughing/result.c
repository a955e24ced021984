// SPDX-License-Identifier: Apache-2.0
#include "roughing/result.h"

#include "base/settings.h"
#include "base/units.h"
#include "roughing/staircase.h"
#include "base/rare.h"

#define WITHIN_MILLI_IP 10      /* largest deviation of a condition from the planned current */

static condition_row rows[STAIRCASE_STEPS];
static int32_t depths[STAIRCASE_STEPS + 1];
static unsigned added, held;
static bool given;              /* the supply can be set to all currents that were added */
static uint32_t step_ma;        /* of the supply at that time */

void result_forget(void) {
    added = held = 0;
    given = true;
}

void result_add(uint32_t ip, uint32_t depth_um) {
    if (added == STAIRCASE_STEPS)
        return;
    condition_row *row = &rows[added];
    uint32_t level;
    *row = conditions_planned(ip);
    uint32_t off = row->milli_ip > ip * 1000 ? row->milli_ip - ip * 1000 : ip * 1000 - row->milli_ip;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    given = given && off <= WITHIN_MILLI_IP && conditions_level(row, &level);
    if (given)
        row->milli_ip = (uint16_t)(level * step_ma * 1000 / CONDITIONS_IP_MA);
    depths[++added] = units_pulses_of_um(depth_um);
}

bool result_hold(void) {
    held = given ? added : 0;
    return held;
}

void result_presume(void) {
    rows[0] = conditions_planned(1);
    rows[0].reference_mv = rows[0].drop_mv = 1;     /* references for any feed mode */
    depths[1] = 0;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    added = held = 1;
}

unsigned result_count(void) { return step_ma == settings_get(SET_CURRENT_STEP_MA) ? held : 0; }
const condition_row *result_first(void) {
    static condition_row first;
    first = rows[0];
    return &first;
}
const condition_row *result_row(unsigned step) { return &rows[step]; }
int32_t result_depth(unsigned step) { return depths[step]; }
