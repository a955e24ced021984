// SPDX-License-Identifier: Apache-2.0
#include "gap/gap.h"

#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "gap/in_force.h"

#define PERIOD_LIMIT ((1u << 24) - 1)   /* clocks */

static bool stale;              /* the gateware has yet to get the condition as it is now */
static bool servo;              /* what drives the electrode is not the feed F */
static bool counted;            /* ... but counted classes */
static uint32_t way_limit;      /* pulses under servo without a discharge that are too many, 0 none */
static uint32_t seen;           /* discharges when the last one was noticed, */
static int32_t seen_at;         /* and the front then */
static uint64_t time_limit;     /* clocks under servo without progress that are too many, 0 none */
static uint64_t stood;          /* such clocks so far, */
static int32_t stood_at;        /* the front meanwhile, */
static uint32_t looked;         /* and the clock up to which they are counted */

void gap_init(void) {
    in_force_init();
    stale = servo = counted = false;
    depth_series_drop();
    depth_series_replaced();
    conditions_reset();
    feed_modes_init();
    gap_settings();
}

/* Bring the condition in force to the gateware anew. Later, while what was staged last waits for a
   pulse to end. */
static void refresh(void) {
    stale = !depth_series_take_stage();
    if (stale)
        return;
    in_force_stage_now();
    hal_condition_commit();
}

/* Condition or class have changed. */
static void apply(void) {
    (void)depth_series_take_stage();
    in_force_apply();
    refresh();
}

void gap_condition(const condition_row *condition) {
    (void)depth_series_take_stage();
    in_force_set(condition);
    depth_series_replaced();
    apply();
}

/* The gateware gets the classes with the program's first condition, without which nothing is machined. */
void gap_start(void) {
    depth_series_drop();
    conditions_start();
    in_force_start();
}

void gap_class_enter(unsigned number, const gap_class *c, bool by_hand) {
    in_force_enter_class(number, c, by_hand);
    apply();
}

/* What servo, converter and law are to do; the times of the settings are converted elsewhere. */
static void drive(void) {
    hal_servo(counted, settings_get(SET_SERVO_MODE), settings_get(SET_SERVO_WINDOW),
              settings_get(SET_SERVO_WEIGHT));
    uint32_t mode = settings_get(SET_FLUID_MODE);
    hal_fluid detector = {
        .convert = mode != 0 || feed_modes_measures(),
        .manual = mode != 1,
        .manual_class = settings_get(SET_FLUID_CLASS),
        .threshold = {settings_get(SET_FLUID_THRESHOLD_0), settings_get(SET_FLUID_THRESHOLD_1),
                      settings_get(SET_FLUID_THRESHOLD_2)},
        .hysteresis = settings_get(SET_FLUID_HYSTERESIS),
        .lowest = settings_get(SET_FLUID_LOWEST),
        .highest = settings_get(SET_FLUID_HIGHEST),
    };
    hal_fluid_write(&detector);
    feed_modes_settings();
}

void gap_servo(unsigned mode, const condition_row *judged) {
    counted = mode == FEED_CLASSES;
    servo = counted || mode == FEED_ZERO;
    if (judged && !depth_series_reached() && in_force_take_references(judged))
        apply();
    feed_modes_select(mode);
    seen_at = stood_at = hal_front();
    stood = 0;
    looked = hal_cycle_low();
    drive();
}

void gap_settings(void) {
    uint32_t period = units_clocks_of_us(settings_get(SET_SERVO_PERIOD_US));
    hal_servo_period(period < PERIOD_LIMIT ? period : PERIOD_LIMIT);
    way_limit = (uint32_t)units_pulses_of_um(settings_get(SET_NO_DISCHARGE_UM));
    time_limit = (uint64_t)settings_get(SET_NO_PROGRESS_S) * hal_clock_hz();
    drive();
}

/* Raise an alarm: apart from the watch, which is called in every round and has to be quick. */
__attribute__((noinline)) static void refuse(fault_code code, const char *format, uint32_t bound) {
    fault f = {.line = alarm_line()};
    fault_at(&f, code, 0, format, bound);
    alarm_raise(&f);
}

/* What is wrong with the detector, or a null pointer. */
static const char *trouble(uint32_t flags) {
    if (flags & HAL_FLUID_SILENT)
        return "the converter does not answer";
    if (flags & HAL_FLUID_LOW)
        return "the fluid's cell reads too low: a shorted wire";
    if (flags & HAL_FLUID_HIGH)
        return "the fluid's cell reads too high: an open circuit";
    if (flags & HAL_FLUID_DISORDERED)
        return "the thresholds of the fluid's classes are out of order";
    return 0;
}

/* ... and with what is in use of it: the class as measured, or the converter alone. */
static const char *trouble_now(uint32_t state) {
    if (settings_get(SET_FLUID_MODE) == 1)
        return trouble(state);
    return feed_modes_measures() ? trouble(state & HAL_FLUID_SILENT) : 0;
}

bool gap_ready(fault *f) {
    uint32_t state = hal_fluid_state();
    /* An event that told of another class may have been dropped with an alarm. */
    if (in_force_set_fluid(HAL_FLUID_CLASS(state)))
        apply();
    const char *what = trouble_now(state);
    if (what)
        return fault_at(f, FAULT_FLUID, 0, "%s", what);
    return settings_get(SET_FLUID_MODE) != 1 || state & HAL_FLUID_KNOWN;
}

bool gap_fluid(const hal_event *event) {
    const char *what = trouble(event->first);
    if (what && settings_get(SET_FLUID_MODE) == 1) {
        refuse(FAULT_FLUID, what, 0);
        return false;
    }
    if (!settings_get(SET_FLUID_MODE))
        return false; /* the converter runs for the voltage alone: the cell may not even be there */
    if (in_force_set_fluid(event->detail))
        apply();
    return true;
}

/* A servo that never sees a discharge would drive the electrode through anything. */
static void watch_way(int32_t front, bool machining) {
    uint32_t counts[4];
    hal_gap_counts(counts);
    uint32_t discharges = counts[1] + counts[2] + counts[3];
    if (discharges != seen || !machining) {
        seen = discharges;
        seen_at = front;
    } else if (way_limit && (uint32_t)front - (uint32_t)seen_at > way_limit) {
        refuse(FAULT_NO_DISCHARGE, "no discharge on the last %u um of the way",
               settings_get(SET_NO_DISCHARGE_UM));
    }
}

/* And one that is never asked for DOWN would stand for ever, as would feed by the voltage at a rate
   of nothing. Time counts while there is a way to go
   and nothing but the servo decides whether it is gone: not on hold, nor in a retraction or a jump. */
static void watch_time(int32_t front, const gap_view *view) {
    uint32_t now = hal_cycle_low(), passed = now - looked;
    looked = now;
    if (front != stood_at || !view->machining) {
        stood_at = front;
        stood = 0;
        return;
    }
    if (view->held || hal_motion_read().state != MOTION_FRONT || view->at_front)
        return;
    stood += passed;
    if (time_limit && stood > time_limit) {
        refuse(FAULT_NO_PROGRESS, "no progress in %u s of machining at the front",
               settings_get(SET_NO_PROGRESS_S));
    }
}

/* Bring the gateware what it lacks; true if there was anything. */
static bool bring(void) {
    if (!stale)
        return depth_series_step();
    refresh();
    return !stale;
}

bool gap_settled(void) { return !stale && !depth_series_waits(); }

bool gap_serves(void) { return servo || feed_modes_measures(); }

/* The settings may have come to rely on a detector that has told of its trouble before. */
bool gap_watch(const gap_view *view) {
    bool brought = bring();
    if (view->machining) {
        const char *what = trouble_now(hal_fluid_state());
        if (what) {
            refuse(FAULT_FLUID, what, 0);
            return brought;
        }
    }
    if (!gap_serves())
        return brought;
    uint32_t counts[4];
    hal_gap_counts(counts);
    stale = feed_modes_watch(view->machining, counts) || stale;
    int32_t front = hal_front();
    if (servo)
        watch_way(front, view->machining);
    watch_time(front, view);
    return brought;
}
