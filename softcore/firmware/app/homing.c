// SPDX-License-Identifier: Apache-2.0
#include "app/homing.h"

#include "app/control.h"
#include "app/events.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/status.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "hal/regs.h"
#include "path/path.h"

/* Compiled for size: nothing here is in a hurry. */
#ifdef __clang__
#pragma clang attribute push(__attribute__((minsize)), apply_to = function)
#endif

#define REST_US 50000       /* axes without drives rest when they have stood for so long */
#define LEAVE_UM_MIN 60000  /* on a switch the gateware allows no more */
#define AGAIN 2             /* the slow approach looks as many pull-offs far */

typedef enum { NONE, SEEK, STOP, LEAVE } homing_phase;

static homing_phase phase;
static uint32_t order;          /* axes still to come, as digits; the present one is lowest */
static unsigned axis;
static bool down, slow;         /* its switch is at its lower end; this is the slow approach */
static int32_t switched;        /* where it was pressed */
static int32_t stood[HAL_AXES];
static uint32_t since;          /* clock from which on the axes have stood there */
static fault result;
static bool ended;

void homing_init(void) {
    phase = NONE;
    ended = false;
}

bool homing_active(void) { return phase != NONE; }
bool homing_answers(void) { return ended; }

const fault *homing_answer(void) {
    ended = false;
    return result.code == FAULT_NONE ? 0 : &result;
}

static void end(void) {
    phase = NONE;
    ended = true;
    override_step();
}

void homing_stop(void) {
    if (phase == NONE)
        return;
    settings_renew();
    result = (fault){0};
    fault_at(&result, FAULT_LOCKED, 0, "stopped by an alarm or a reset");
    end();
}

static void fail(fault_code code, const char *why) {
    fault f = {.line = alarm_line()};
    fault_at(&f, code, 0, "%c: %s", "XYZ"[axis], why);
    alarm_raise(&f);
}

static bool pressed(void) {
    hal_limits limits = hal_limits_read();
    return (down ? limits.low : limits.high) >> axis & 1;
}

/* Go along the axis; the position is not known, so the soft limits mean nothing. */
static void go(int32_t way, uint32_t speed) {
    uint32_t highest = settings_highest_speed();
    path_move move = {0};
    move.delta[axis] = way;
    hal_axis_limits(axis, -UNITS_POSITION_LIMIT, UNITS_POSITION_LIMIT);
    path_append(&move, units_rate(speed < highest ? speed : highest), false, false);
    machine_run(true);
}

static int32_t pull_off(void) {
    int32_t way = units_pulses_of_um(settings_get(SET_HOME_PULL_OFF_UM));
    return down ? way : -way;
}

static void leave(void) {
    uint32_t speed = settings_get(SET_HOME_SLOW_MM_MIN) * 1000;
    phase = LEAVE;
    go(switched + pull_off() - hal_axis_command(axis), speed < LEAVE_UM_MIN ? speed : LEAVE_UM_MIN);
}

static void seek(void) {
    phase = SEEK;
    if (slow) {
        go(-AGAIN * pull_off(), settings_get(SET_HOME_SLOW_MM_MIN) * 1000);
        return;
    }
    /* As grbl: half as far again as the travel is long. */
    uint32_t um = settings_travel_um(axis) / 2 * 3, most = UNITS_POSITION_LIMIT / (uint32_t)units_pulses_of_um(1);
    int32_t way = units_pulses_of_um(um < most ? um : most);
    go(down ? -way : way, settings_get(SET_HOME_FAST_MM_MIN) * 1000);
}

static void next(void) {
    if (!order) {
        machine_know_position();
        result = (fault){0};
        end();
        return;
    }
    axis = order % 10 - 1;
    order /= 10;
    down = settings_get(SET_HOME_DOWN) >> axis & 1;
    slow = false;
    if (pressed()) {
        switched = hal_axis_command(axis);
        leave();
    } else {
        seek();
    }
}

/* The digits in reverse, so that the first one comes lowest; 0 if they are not axes. */
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

bool homing_begin(fault *f) {
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
    if (machine_locked() ? !control_unlock(f)
                         : !status_idle() && fault_at(f, FAULT_BUSY, 0, "$H needs the state Idle or Alarm"))
        return false;
    if (f->code != FAULT_NONE)
        return false;
    machine_lose_position();
    phase = STOP;
    slow = false;
    axis = HAL_AXES;    /* none yet: first of all the axes come to rest */
    since = hal_cycle_low();
    override_step();
    return true;
}

bool homing_takes(unsigned cause, unsigned axes, const int32_t *place) {
    if (phase != SEEK || cause != (down ? CAUSE_LIMIT_LOW : CAUSE_LIMIT_HIGH) || axes != 1u << axis)
        return false;
    phase = STOP;
    switched = place[axis];
    since = hal_cycle_low();
    machine_run(false);
    return true;
}

/* Have the axes stood? With the drives off they never reach their commands. */
static bool stands(void) {
    uint32_t now = hal_cycle_low();
    for (unsigned k = 0; k < HAL_AXES; k++)
        if (hal_axis_position(k) != stood[k]) {
            stood[k] = hal_axis_position(k);
            since = now;
        }
    return now - since > units_clocks_of_us(REST_US);
}

static void stopped(void) {
    fault f = {.line = alarm_line()};
    if (!stands())
        return;
    if (axis == HAL_AXES) {
        machine_run(false);
        control_begin_path();
        next();
    } else if (machine_clear(&f)) {
        control_begin_path();
        leave();
    } else {
        alarm_raise(&f);
    }
}

/* Off the switch. After the slow approach this is the end of the travel. */
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
    const travel_range *travel = settings_travel();
    hal_axis_shift(axis, (down ? travel->low : travel->high)[axis] - pull_off() - switched);
    settings_renew();
    control_begin_path();
    next();
}

void homing_step(void) {
    if (phase == NONE)
        return;
    if (phase == STOP) {
        stopped();
        return;
    }
    if (!path_at_front() || !events_idle() || !meter_rests())
        return;
    if (phase == LEAVE)
        left();
    else
        fail(FAULT_HOME_NOT_FOUND, FAULT_TEXT_HOME_NOT_FOUND);
}

#ifdef __clang__
#pragma clang attribute pop
#endif
