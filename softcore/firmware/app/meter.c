// SPDX-License-Identifier: Apache-2.0
#include "app/meter.h"

#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"

/* The machine is at rest if it has been in position, and no axis has moved further than an edge of
   its coder, for REST_US. An oscillating loop crosses its target faster, and a creeping one moves
   on in this time. A machine at rest may creep one pulse further: otherwise its last pulse would
   count as new motion. */
#define REST_US 20000
#define LOOK_US 2000    /* between two looks: more of them would slow down short blocks */
#define SPAN_US 250000  /* the feed is a mean over 1 to 2 spans: 0.1 um in one is 0.024 mm/min */

static uint32_t rest_clocks, span_clocks, look_clocks;
static uint32_t looked;
static bool rests;
static uint32_t moved;      /* clock of the last motion */
static int32_t stood[HAL_AXES]; /* position of the axes at that time */
static struct {
    uint32_t clock;
    int32_t place;          /* path coordinate */
} marks[2];                 /* [1] begins the present span, [0] the one before */

void meter_path_begins(void) {
    marks[1].clock = hal_cycle_low();
    marks[1].place = 0;
    marks[0] = marks[1];
}

void meter_init(void) {
    rest_clocks = units_clocks_of_us(REST_US);
    span_clocks = units_clocks_of_us(SPAN_US);
    look_clocks = units_clocks_of_us(LOOK_US);
    rests = false;
    moved = hal_cycle_low();
    meter_path_begins();
}

/* Has an axis left the position in `stood`? */
static bool leaves(void) {
    bool left = false;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t at = hal_axis_position(axis);
        if (at == stood[axis]) /* mostly; the edge takes a division */
            continue;
        uint32_t reach = settings_edge(axis) + rests;
        uint32_t way = (uint32_t)at - (uint32_t)stood[axis] + reach;
        if (way > 2 * reach) {
            stood[axis] = at;
            left = true;
        }
    }
    return left;
}

__attribute__((noinline)) static void look(uint32_t now) {
    looked = now;
    hal_motion motion = hal_motion_read();
    if (leaves() || motion.moving || !motion.in_position) {
        rests = false;
        moved = now;
    } else if (now - moved > rest_clocks) {
        rests = true;
    }
    if (now - marks[1].clock > span_clocks) {
        marks[0] = marks[1];
        marks[1].clock = now;
        marks[1].place = hal_position();
    }
}

void meter_step(void) {
    uint32_t now = hal_cycle_low();
    if (now - looked >= look_clocks)
        look(now);
}

bool meter_rests(void) {
    hal_motion motion = hal_motion_read();
    return rests && !motion.moving && motion.in_position;
}

uint32_t meter_feed(void) {
    if (meter_rests())
        return 0;
    int32_t way = (int32_t)((uint32_t)hal_position() - (uint32_t)marks[0].place);
    uint32_t pulses = way < 0 ? 0u - (uint32_t)way : (uint32_t)way;
    return units_speed_of_count(pulses, hal_cycle_low() - marks[0].clock);
}
