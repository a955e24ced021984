// SPDX-License-Identifier: Apache-2.0
#include "app/walk.h"

#include "app/execute.h"
#include "app/homing.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/program.h"
#include "app/touch.h"
#include "base/units.h"
#include "hal/hal.h"
#include "path/path.h"

#define WALK_WORD 6         /* characters of `$WALK=` */
#define DIGITS_LIMIT 10000000000u

static int32_t goal;        /* distance ordered; 0: no walk */
static bool comes;          /* a new place: perhaps an order to go back is needed */
static bool lifts;          /* the hold is to be lifted away from the front */
static bool ends;           /* the machine is to come to the front */

void walk_drop(void) {
    goal = 0;
    comes = lifts = ends = false;
    hal_walk(0);
    path_keep(0);
}

static int32_t before_front(int32_t place) {
    return (int32_t)((uint32_t)hal_front() - (uint32_t)place);
}

int32_t walk_goal(void) { return goal; }
int32_t walk_distance(void) { return before_front(hal_position()); }
bool walk_told(void) {
    return goal || ((machine_held() || program_paused()) && walk_distance());
}

void walk_hold(void) { lifts = false; }
void walk_end(void) { ends = goal; }

/* Does the machine stand where it may go both ways? */
static bool stands(hal_motion motion) {
    return !motion.moving && (motion.state == MOTION_FRONT || motion.state == MOTION_HIGH ||
                              motion.state == MOTION_LOW);
}

/* Not inlined into walk_step, which every round calls and which must stay quick. */
__attribute__((noinline)) static void go_on(void) {
    hal_motion motion = hal_motion_read();
    if (!stands(motion))
        return;
    if (ends) {
        walk_drop();
        return;
    }
    bool back = comes && walk_distance() < goal;
    comes = false;
    if (back) {
        machine_run(true);
        machine_retract();
    } else if (lifts && motion.state != MOTION_FRONT) {
        lifts = false;
        machine_walk();
    }
}

void walk_step(void) {
    if (goal)
        go_on();
}

static bool read_distance(const char *line, uint32_t length, int32_t *pulses) {
    units_number number = {0};
    bool any = false, point = false;
    for (uint32_t at = WALK_WORD; at < length; at++) {
        bool digit = line[at] >= '0' && line[at] <= '9';
        if (digit && number.decimals < UNITS_DECIMALS) {
            number.digits = 10 * number.digits + (uint32_t)(line[at] - '0');
            number.decimals += point;
        }
        if (number.digits > DIGITS_LIMIT || !(digit || (line[at] == '.' && !point)))
            return false;
        any = any || digit;
        point = point || !digit;
    }
    return any && units_distance(number, false, pulses);
}

/* Does the state of the machine allow a walk? */
static bool allowed(fault *f) {
    if (jog_active() || program_jogs() || homing_active() || touch_now() != TOUCH_NONE)
        return fault_at(f, FAULT_BUSY, 0, "there is no walk in a jog, a homing cycle or a touch-off");
    if (!machine_held() && !program_paused())
        return fault_at(f, FAULT_BUSY, 0, "$WALK needs the state Hold: send ! first");
    if (execute_acts())
        return fault_at(f, FAULT_BUSY, 0, "the program carries out a function here: $WALK waits for its end");
    if (!goal && !(meter_rests() && stands(hal_motion_read())))
        return fault_at(f, FAULT_BUSY, 0, "the machine is still coming to rest: send $WALK again in Hold:0");
    return retraction_complete(&execute_state()->memory) ||
           fault_at(f, FAULT_RETRACTION, 0, "$WALK needs retraction data (G36): their speeds are those of the walk");
}

/* Can the machine walk there? Under servo it may have drawn back from the front already: nearer than
   that it would be at the front again, and cut. */
static bool reaches(int32_t distance, fault *f) {
    uint32_t most = path_remembered();
    int32_t drawn = before_front(hal_start());
    if (!distance)
        return fault_at(f, FAULT_WALK, 0, "$WALK=0 is the front, where machining goes on: that is what ~ does");
    if ((uint32_t)distance > most)
        return fault_at(f, FAULT_WALK, 0, "the way back along the path is %p mm here, no more", (int32_t)most);
    return distance > drawn ||
           fault_at(f, FAULT_WALK, 0, "the servo has drawn back: a walk is longer than %p mm here", drawn);
}

void walk_line(const char *line, uint32_t length, fault *f) {
    int32_t distance;
    if (!read_distance(line, length, &distance)) {
        fault_at(f, FAULT_COMMAND, 0, "$WALK takes a distance before the front in mm, as $WALK=1.5");
        return;
    }
    if (!allowed(f) || !reaches(distance, f))
        return;
    goal = distance;
    comes = lifts = true;
    ends = false;
    path_keep((uint32_t)goal);
    hal_walk((uint32_t)goal);
    /* At once: at the front nothing may come between, such as a new path. */
    walk_step();
}
