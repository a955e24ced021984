// SPDX-License-Identifier: Apache-2.0
#include "gap/gap.h"

#include "app/events.h"
#include "app/machine.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/law.h"
#include "gap/series.h"
#include "link/output.h"
#include "path/path.h"

#define REFERENCE_FULL_V 100    /* at the gap, of a reference that is all ones */
#define REFERENCE_STEPS 1024
#define PERIOD_LIMIT ((1u << 24) - 1)   /* clocks */

/* Presets by the table of JP S60-10852 B, from its highest resistance (10**6 ohm cm and more) over
   1.25 x 10**5 (as its blurred column is read) and 4 x 10**4 to 10**3. The shares of the open voltage
   are those of a leak through 10 mm2 at 40 um behind 10 ohm. */
static const gap_class PATENT[GAP_CLASSES] = {
    {3, 6, 14, 100}, {5, 5, 18, 99}, {8, 3, 22, 98}, {13, 2, 28, 75},
};

static gap_class classes[GAP_CLASSES];
static gap_class kept[GAP_CLASSES];     /* the same without what the tape has entered */
static technology_row row;      /* the condition in force */
static uint32_t step_ma;        /* of the supply, when a C put it or the series' first in force */
static bool conditioned;        /* there is one, */
static bool stale;              /* which the gateware has yet to get as it is now */
static unsigned fluid;          /* class in force */
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
    for (unsigned i = 0; i < GAP_CLASSES; i++)
        classes[i] = kept[i] = PATENT[i];
    conditioned = stale = servo = counted = false;
    series_drop();
    series_replaced();
    fluid = 0;
    technology_reset();
    law_init();
    gap_settings();
}

static uint32_t volts(uint32_t value_v) {
    uint32_t steps = value_v * REFERENCE_STEPS / REFERENCE_FULL_V;
    return steps < REFERENCE_STEPS ? steps : REFERENCE_STEPS - 1;
}

/* As the fluid's class has it, with a no-load voltage. */
static void stage(const technology_row *r, uint32_t no_load) {
    const gap_class *c = &classes[fluid];
    bool own = r->dame || r->open || r->ok;
    uint32_t level = 0;
    (void)technology_level(r, &level);
    hal_presets(own ? r->dame : c->dame, own ? r->open : c->open, own ? r->ok : c->ok);
    hal_pulse(units_clocks_of_us(r->on_us), units_clocks_of_us(r->off_us),
              units_clocks_of_us(r->rest_us), level);
    hal_supply(r->open_v / GAP_SUPPLY_STEP_V, r->negative);
    /* The fluid leaves less than the source gives; what burns, burns at its own voltage. */
    uint32_t left_v = (uint32_t)r->open_v * r->open_percent * c->share_percent / 10000;
    hal_references(volts(left_v), volts(r->arc_v), volts(r->short_v));
    hal_servo_step(r->step);
    law_stage(r, no_load);
}

void gap_stage(const technology_row *r) {
    stage(r, law_no_load_of(r, classes[fluid].share_percent));
}

/* Bring the condition in force to the gateware anew; without one, the class's presets. Later, while what
   was staged last waits for a pulse to end. */
static void refresh(void) {
    const gap_class *c = &classes[fluid];
    stale = !series_take_stage();
    if (stale)
        return;
    if (conditioned)
        stage(&row, law_no_load());
    else
        hal_presets(c->dame, c->open, c->ok);
    hal_condition_commit();
}

/* Condition or class have changed. */
static void apply(void) {
    (void)series_take_stage();
    if (conditioned)
        law_condition(&row, classes[fluid].share_percent);
    refresh();
}

void gap_condition(const technology_row *condition) {
    (void)series_take_stage();
    row = *condition;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    conditioned = true;
    series_replaced();
    apply();
}

void gap_switched(const technology_row *condition) {
    row = *condition;
    law_condition(&row, classes[fluid].share_percent);
}

const technology_row *gap_row(void) { return conditioned ? &row : 0; }
bool gap_current_kept(void) { return !conditioned || step_ma == settings_get(SET_CURRENT_STEP_MA); }

/* The gateware gets the classes with the program's first condition, without which nothing is machined. */
void gap_start(void) {
    series_drop();
    technology_start();
    for (unsigned i = 0; i < GAP_CLASSES; i++)
        classes[i] = kept[i];
}

gap_class gap_class_row(unsigned number) { return classes[number]; }

void gap_class_enter(unsigned number, const gap_class *c, bool by_hand) {
    classes[number] = *c;
    if (by_hand)
        kept[number] = *c;
    apply();
}

/* What servo, converter and law are to do; the times of the settings are converted elsewhere. */
static void drive(void) {
    hal_servo(counted, settings_get(SET_SERVO_MODE), settings_get(SET_SERVO_WINDOW),
              settings_get(SET_SERVO_WEIGHT));
    uint32_t mode = settings_get(SET_FLUID_MODE);
    hal_fluid detector = {
        .convert = mode != 0 || law_measures(),
        .manual = mode != 1,
        .manual_class = settings_get(SET_FLUID_CLASS),
        .threshold = {settings_get(SET_FLUID_THRESHOLD_0), settings_get(SET_FLUID_THRESHOLD_1),
                      settings_get(SET_FLUID_THRESHOLD_2)},
        .hysteresis = settings_get(SET_FLUID_HYSTERESIS),
        .lowest = settings_get(SET_FLUID_LOWEST),
        .highest = settings_get(SET_FLUID_HIGHEST),
    };
    hal_fluid_write(&detector);
    law_settings();
}

void gap_servo(unsigned law, const technology_row *judged) {
    counted = law == LAW_CLASSES;
    servo = counted || law == LAW_ZERO;
    if (conditioned && judged && !series_reached() &&
        (row.reference_mv != judged->reference_mv || row.drop_mv != judged->drop_mv)) {
        row.reference_mv = judged->reference_mv;
        row.drop_mv = judged->drop_mv;
        apply();
    }
    law_select(law);
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

/* What is wrong with the detector, or a null pointer. */
static const char *trouble(uint32_t flags) {
    if (flags & HAL_FLUID_SILENT)
        return "the converter does not answer";
    if (flags & HAL_FLUID_LOW)
        return "the fluid's cell reads too low: a shorted wire";
    if (flags & HAL_FLUID_HIGH)
        return "the fluid's cell reads too high: a broken wire";
    if (flags & HAL_FLUID_DISORDERED)
        return "the thresholds of the fluid's classes are out of order";
    return 0;
}

/* ... and with what is in use of it: the class as measured, or the converter alone. */
static const char *trouble_now(uint32_t state) {
    if (settings_get(SET_FLUID_MODE) == 1)
        return trouble(state);
    return law_measures() ? trouble(state & HAL_FLUID_SILENT) : 0;
}

bool gap_ready(fault *f) {
    uint32_t state = hal_fluid_state();
    /* An event that told of another class may have been dropped with an alarm. */
    if (HAL_FLUID_CLASS(state) != fluid) {
        fluid = HAL_FLUID_CLASS(state);
        apply();
    }
    const char *what = trouble_now(state);
    if (what)
        return fault_at(f, FAULT_FLUID, 0, "%s", what);
    return settings_get(SET_FLUID_MODE) != 1 || state & HAL_FLUID_KNOWN;
}

void gap_fluid(const hal_event *event, uint64_t cycle) {
    const char *what = trouble(event->first);
    if (what && settings_get(SET_FLUID_MODE) == 1) {
        fault f = {.line = events_line()};
        fault_at(&f, FAULT_FLUID, 0, "%s", what);
        machine_alarm(&f);
        return;
    }
    if (!settings_get(SET_FLUID_MODE))
        return; /* the converter runs for the voltage alone: the cell may not even be there */
    bool changed = event->detail != fluid;
    fluid = event->detail % GAP_CLASSES;
    if (changed)
        apply();
    const gap_class *c = &classes[fluid];
    output_event("fluid", cycle, events_line(), event->encoder, ",%u,%u,%u,%u,%u,%u",
                 (uint32_t)fluid, HAL_FLUID_MEASURED(event->first), event->second,
                 (uint32_t)c->dame, (uint32_t)c->open, (uint32_t)c->ok);
}

/* A servo that never sees a discharge would drive the electrode through anything. */
static void watch_way(int32_t front) {
    uint32_t counts[4];
    hal_gap_counts(counts);
    uint32_t discharges = counts[1] + counts[2] + counts[3];
    if (discharges != seen || !machine_machining()) {
        seen = discharges;
        seen_at = front;
    } else if (way_limit && (uint32_t)front - (uint32_t)seen_at > way_limit) {
        fault f = {.line = events_line()};
        fault_at(&f, FAULT_NO_DISCHARGE, 0, "no discharge on the last %u um of the way",
                 settings_get(SET_NO_DISCHARGE_UM));
        machine_alarm(&f);
    }
}

/* And one that is never asked for DOWN would stand for ever, as would feed by the voltage at a rate
   of nothing. Time counts while there is a way to go
   and nothing but the servo decides whether it is gone: not on hold, nor in a retraction or a jump. */
static void watch_time(int32_t front) {
    uint32_t now = hal_cycle_low(), passed = now - looked;
    looked = now;
    if (front != stood_at || !machine_machining()) {
        stood_at = front;
        stood = 0;
        return;
    }
    if (machine_held() || hal_motion_read().state != MOTION_FRONT || path_at_front())
        return;
    stood += passed;
    if (time_limit && stood > time_limit) {
        fault f = {.line = events_line()};
        fault_at(&f, FAULT_NO_PROGRESS, 0, "no progress in %u s of machining at the front",
                 settings_get(SET_NO_PROGRESS_S));
        machine_alarm(&f);
    }
}

/* Bring the gateware what it lacks; true if there was anything. */
static bool bring(void) {
    if (!stale)
        return series_step();
    refresh();
    return !stale;
}

bool gap_serves(void) { return servo || law_measures(); }

/* The settings may have come to rely on a detector that has told of its trouble before. */
bool gap_watch(void) {
    bool brought = bring();
    if (machine_machining()) {
        const char *what = trouble_now(hal_fluid_state());
        if (what) {
            fault f = {.line = events_line()};
            fault_at(&f, FAULT_FLUID, 0, "%s", what);
            machine_alarm(&f);
            return brought;
        }
    }
    if (!gap_serves())
        return brought;
    uint32_t counts[4];
    hal_gap_counts(counts);
    stale = law_watch(machine_machining(), counts) || stale;
    int32_t front = hal_front();
    if (servo)
        watch_way(front);
    watch_time(front);
    return brought;
}
