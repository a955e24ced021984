// SPDX-License-Identifier: Apache-2.0
#include "app/homing_cycle.h"

#include "app/control.h"
#include "app/events.h"
#include "app/homing.h"
#include "app/homing_axis.h"
#include "app/homing_index.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/status.h"
#include "base/alarm.h"
#include "base/pitch.h"
#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "path/path.h"

#include "base/rare.h" /* last */

#define LEAVE_UM_MIN 60000  /* highest speed that the gateware allows on a switch */
#define AGAIN 2             /* longest slow approach, in pull-offs */

static uint32_t order;          /* axes still to be homed, as digits; the next one is lowest */
static bool slow;               /* this is the slow approach */
static bool partly;             /* the place of axes that are not homed was known before */

static void fail(fault_code code, const char *why) {
    fault f = {.line = alarm_line()};
    fault_at(&f, code, 0, "%c: %s", "XYZ"[homing_now.axis], why);
    alarm_raise(&f);
}

static bool pressed(void) {
    hal_limits limits = hal_limits_read();
    return (homing_now.down ? limits.low : limits.high) >> homing_now.axis & 1;
}

static void leave(void) {
    uint32_t speed = settings_get(SET_HOME_SLOW_MM_MIN) * 1000;
    homing_now.phase = HOMING_LEAVE;
    if (slow && homing_index_wanted())
        homing_index_leave();
    homing_axis_go(homing_now.switched + homing_axis_pull_off() - hal_axis_command(homing_now.axis),
                   speed < LEAVE_UM_MIN ? speed : LEAVE_UM_MIN);
}

static void seek(void) {
    homing_now.phase = HOMING_SEEK;
    if (slow) {
        homing_axis_go(-AGAIN * homing_axis_pull_off(), settings_get(SET_HOME_SLOW_MM_MIN) * 1000);
        return;
    }
    if (settings_screws())
        settings_renew_screw(homing_now.axis); /* so that what is made up for does not add up */
    /* As grbl: at most 1.5 times the travel. */
    uint32_t um = settings_travel_um(homing_now.axis) / 2 * 3;
    uint32_t most = UNITS_POSITION_LIMIT / (uint32_t)units_pulses_of_um(1);
    int32_t way = units_pulses_of_um(um < most ? um : most);
    homing_axis_go(homing_now.down ? -way : way, settings_get(SET_HOME_FAST_MM_MIN) * 1000);
}

static void next(void) {
    if (!order) {
        /* All of three digits; the third axis of a wire machine, which has no jump axis, moves the wire. */
        bool all = settings_get(SET_HOME_ORDER) > (hal_jump_axis() < HAL_AXES ? 100 : 10);
        if (all || partly)
            machine_know_position(all);
        homing_end(0);
        override_step();
        return;
    }
    homing_now.axis = order % 10 - 1;
    order /= 10;
    homing_now.down = settings_get(SET_HOME_DOWN) >> homing_now.axis & 1;
    slow = false;
    if (pressed()) {
        homing_now.switched = hal_axis_command(homing_now.axis);
        leave();
    } else {
        seek();
    }
}

/* Reverse the digits, so that the first axis is the lowest digit. 0 if a digit is no axis, or comes
   twice. */
static uint32_t reversed(uint32_t digits) {
    uint32_t all = 0, seen = 0;
    for (; digits; digits /= 10) {
        uint32_t digit = digits % 10;
        if (digit < 1 || digit > HAL_AXES || seen >> digit & 1)
            return 0;
        seen |= 1u << digit;
        all = all * 10 + digit;
    }
    return all;
}

bool homing_cycle_begin(fault *f) {
    uint32_t number = settings_number(SET_HOME_ORDER);
    order = reversed(settings_get(SET_HOME_ORDER));
    if (!settings_get(SET_HOME_ORDER))
        return fault_at(f, FAULT_HOMING, 0, "homing is off: $%u names no axis", number);
    if (!order)
        return fault_at(f, FAULT_SETTING, 0,
                        "$%u must have digits 1 (X), 2 (Y) and 3 (Z), each at most once", number);
    if (settings_get(SET_STEP_AXES))
        return fault_at(f, FAULT_HOMING, 0, "homing needs coders: an axis by steps ($%u) has none",
                        settings_number(SET_STEP_AXES));
    if (!settings_gears(f) || !pitch_sound(f))
        return false;
    if (machine_locked() ? !control_unlock(f)
                         : !status_idle() &&
                               fault_at(f, FAULT_BUSY, 0, "$H needs the state Idle or Alarm"))
        return false;
    if (f->code != FAULT_NONE)
        return false;
    partly = !machine_position_lost();
    machine_lose_position();
    homing_now.phase = HOMING_STOP;
    slow = false;
    homing_now.axis = HAL_AXES;    /* none yet: the axes must come to rest first */
    homing_now.since = hal_cycle_low();
    override_step();
    return true;
}

static void stopped(void) {
    fault f = {.line = alarm_line()};
    if (!homing_axis_stands())
        return;
    if (homing_now.axis == HAL_AXES) {
        machine_run(false);
        control_begin_path();
        next();
    } else if (machine_clear(&f)) {
        watch_between();
        control_begin_path();
        leave();
    } else {
        alarm_raise(&f);
    }
}

/* The axis stands at the end of its travel, which is this place: its position is known. */
static void homed(int32_t place) {
    const travel_range *travel = settings_travel();
    int32_t end = (homing_now.down ? travel->low : travel->high)[homing_now.axis];
    hal_axis_shift(homing_now.axis, end - place);
    settings_renew();
    control_begin_path();
    next();
}

/* The way off the switch has ended. After the slow approach the reference is known, or the index is
   still to be found. */
static void left(void) {
    machine_run(false);
    if (pressed()) {
        fail(FAULT_HOME_NOT_LEFT, FAULT_TEXT_HOME_NOT_LEFT);
        return;
    }
    if (!slow) {
        slow = true;
        seek();
        return;
    }
    if (homing_index_wanted())
        homing_index_search();
    else
        homed(homing_now.switched + homing_axis_pull_off());
}

__attribute__((noinline)) void homing_cycle_step(void) {
    if (homing_now.phase == HOMING_NONE)
        return;
    if (homing_now.phase == HOMING_STOP) {
        stopped();
        return;
    }
    if (homing_now.phase == HOMING_FOUND) {
        homing_index_found();
        return;
    }
    if (!path_at_front() || !events_idle() || !meter_rests())
        return;
    switch (homing_now.phase) {
    case HOMING_LEAVE: left(); break;
    case HOMING_BACK:
        machine_run(false);
        homed(homing_now.index);
        break;
    case HOMING_INDEX: fail(FAULT_HOME_NOT_FOUND, "the index of the coder did not come"); break;
    default: fail(FAULT_HOME_NOT_FOUND, FAULT_TEXT_HOME_NOT_FOUND); break;
    }
}
