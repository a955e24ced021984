// SPDX-License-Identifier: Apache-2.0
#include "gap/gap.h"

#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "gap/in_force.h"

#define PERIOD_LIMIT ((1u << 24) - 1)   /* clocks */

static bool stale;              /* the gateware does not yet have the condition as it is now */
static bool servo;              /* a servo moves the electrode, not the feed F */
static bool counted;            /* the servo goes by counted pulse classes */
static uint32_t way_limit;      /* most pulses under servo without a discharge, 0 for no limit */
static uint32_t seen;           /* count of discharges when the last one was noticed */
static int32_t seen_at;         /* the front at that time */
static uint64_t time_limit;     /* most clocks without progress, 0 for no limit */
static uint64_t stood;          /* clocks without progress so far */
static int32_t stood_at;        /* the front in that time */
static uint32_t looked;         /* the clock up to which they are counted */

void gap_init(void) {
    in_force_init();
    stale = servo = counted = false;
    depth_series_drop();
    depth_series_replaced();
    conditions_reset();
    feed_modes_init();
    gap_settings();
}

/* Write the condition in force to the gateware again. If the last staged one still waits for a
   pulse to end, do it later. */
static void refresh(void) {
    stale = !depth_series_take_stage();
    if (stale)
        return;
    in_force_stage_now();
    hal_condition_commit();
}

/* Call when the condition or the fluid's class has changed. */
static void apply(void) {
    (void)depth_series_take_stage();
    in_force_apply();
    refresh();
}

/* Is the gap voltage in use? */
static bool converts(void) {
    return feed_modes_measures() || settings_get(SET_SHORT_MEAN_MV);
}

/* Write what the converter and the fluid's detector have to do. */
__attribute__((noinline)) static void detect(void) {
    uint32_t mode = settings_get(SET_FLUID_MODE);
    hal_fluid detector = {
        .convert = mode != 0 || converts() || in_force_tries(),
        .manual = mode != 1,
        .manual_class = settings_get(SET_FLUID_CLASS),
        .threshold = {settings_get(SET_FLUID_THRESHOLD_0), settings_get(SET_FLUID_THRESHOLD_1),
                      settings_get(SET_FLUID_THRESHOLD_2)},
        .hysteresis = settings_get(SET_FLUID_HYSTERESIS),
        .lowest = settings_get(SET_FLUID_LOWEST),
        .highest = settings_get(SET_FLUID_HIGHEST),
    };
    hal_fluid_write(&detector);
}

void gap_condition(const condition_row *condition) {
    bool tried = in_force_tries();
    (void)depth_series_take_stage();
    in_force_set(condition);
    if (tried)
        detect();
    depth_series_replaced();
    apply();
}

/* The gateware gets the classes with the program's first condition; there is no machining
   before. */
void gap_start(void) {
    depth_series_drop();
    conditions_start();
    in_force_start();
}

void gap_class_enter(unsigned number, const gap_class *c, bool by_hand) {
    in_force_enter_class(number, c, by_hand);
    apply();
}

/* Write what servo, converter and feed mode have to do. gap_settings converts the times. */
static void drive(void) {
    hal_servo(counted);
    detect();
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

void gap_try(bool on, uint32_t open, uint32_t arc) {
    in_force_try(on, open, arc);
    detect();
    refresh();
}

void gap_end_trial(void) {
    if (in_force_tries())
        gap_try(false, 0, 0);
}

void gap_settings(void) {
    uint32_t period = units_clocks_of_us(settings_get(SET_SERVO_PERIOD_US));
    hal_servo_period(period < PERIOD_LIMIT ? period : PERIOD_LIMIT);
    way_limit = (uint32_t)units_pulses_of_um(settings_get(SET_NO_DISCHARGE_UM));
    time_limit = (uint64_t)settings_get(SET_NO_PROGRESS_S) * hal_clock_hz();
    drive();
    if (in_force_row())
        refresh(); /* settings of counting and criteria are staged with the condition */
}

/* Raise an alarm. Not inlined into the watch, which every round calls and which must stay quick. */
__attribute__((noinline)) static void refuse(fault_code code, const char *format, uint32_t bound) {
    fault f = {.line = alarm_line()};
    fault_at(&f, code, 0, format, bound);
    alarm_raise(&f);
}

/* The trouble of the detector in words, or a null pointer. */
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

/* The same, but only for the parts in use: the whole detector if it measures the class, or the
   converter alone. */
static const char *trouble_now(uint32_t state) {
    if (settings_get(SET_FLUID_MODE) == 1)
        return trouble(state);
    return converts() ? trouble(state & HAL_FLUID_SILENT) : 0;
}

bool gap_ready(fault *f) {
    gap_end_trial();
    if (stale)
        return false;
    uint32_t state = hal_fluid_state();
    /* An alarm may have dropped the event of a new class. */
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
        return false; /* the converter runs only for the voltage: there may be no cell */
    if (in_force_set_fluid(event->detail))
        apply();
    return true;
}

/* Watch for a servo that never sees a discharge: it would drive the electrode into the work. */
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

/* Watch for a servo that never gets DOWN, or a feed by the voltage with rate 0: the machine would
   stand for ever. Time counts only while there is a way to go that depends on the servo alone, and
   not during a hold, a retraction or a jump. */
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

/* Write to the gateware what it does not have yet; true if there was anything. */
static bool bring(void) {
    if (!stale)
        return depth_series_step();
    refresh();
    return !stale;
}

bool gap_settled(void) { return !stale && !depth_series_waits(); }

bool gap_serves(void) { return servo || feed_modes_measures(); }

/* Looks at the detector's state itself: its event may have come before a setting made use of it. */
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
