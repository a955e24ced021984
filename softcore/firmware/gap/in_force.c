// SPDX-License-Identifier: Apache-2.0
#include "gap/in_force.h"

#include "base/settings.h"
#include "base/units.h"
#include "gap/feed_modes.h"
#include "hal/hal.h"

#define REFERENCE_FULL_V 100    /* voltage at the gap for the full scale of a reference */
#define REFERENCE_STEPS 1024
#define SHORT_V 12              /* without a condition, as in the gateware after reset */
#define DELAY_LIMIT ((1u << 16) - 1)    /* clocks */

/* Presets by the table of JP S60-10852 B, from its highest resistance (10**6 ohm cm and more) over
   1.25 x 10**5 (as its blurred column is read) and 4 x 10**4 to 10**3. The shares of the open voltage
   are those of a leak through 10 mm2 at 40 um behind 10 ohm. */
static const gap_class SECOND_PATENT[GAP_CLASSES] = {
    {3, 6, 14, 100}, {5, 5, 18, 99}, {8, 3, 22, 98}, {13, 2, 28, 75},
};

static gap_class classes[GAP_CLASSES];
static gap_class kept[GAP_CLASSES];     /* without the rows that a tape has entered */
static uint32_t edition;                /* of those */
static condition_row row;       /* the condition in force */
static uint32_t step_ma;        /* of the power supply at the last C or G39 P1 */
static bool conditioned;        /* a condition is in force */
static unsigned fluid;          /* class in force */
static bool tries;              /* these levels are tried */
static uint32_t tried_open, tried_arc;

void in_force_forget_classes(void) {
    for (unsigned i = 0; i < GAP_CLASSES; i++)
        classes[i] = kept[i] = SECOND_PATENT[i];
    edition++;
}

const gap_class *in_force_kept_class(unsigned number) { return &kept[number]; }
uint32_t in_force_edition(void) { return edition; }

void in_force_init(void) {
    in_force_forget_classes();
    conditioned = tries = false;
    fluid = 0;
}

gap_class in_force_class(unsigned number) { return classes[number]; }

void in_force_enter_class(unsigned number, const gap_class *c, bool by_hand) {
    classes[number] = *c;
    if (!by_hand)
        return;
    kept[number] = *c;
    edition++;
}

void in_force_start(void) {
    for (unsigned i = 0; i < GAP_CLASSES; i++)
        classes[i] = kept[i];
}

unsigned in_force_fluid(void) { return fluid; }

bool in_force_set_fluid(unsigned number) {
    bool changed = number != fluid;
    fluid = number % GAP_CLASSES;
    return changed;
}

const condition_row *in_force_row(void) { return conditioned ? &row : 0; }

void in_force_set(const condition_row *condition) {
    row = *condition;
    step_ma = settings_get(SET_CURRENT_STEP_MA);
    conditioned = true;
    tries = false;
}

void in_force_try(bool on, uint32_t open, uint32_t arc) {
    tries = on;
    tried_open = open;
    tried_arc = arc;
}

bool in_force_tries(void) { return tries; }

void in_force_switched(const condition_row *condition) {
    row = *condition;
    feed_modes_condition(&row, classes[fluid].share_percent);
}

bool in_force_current_kept(void) {
    return !conditioned || step_ma == settings_get(SET_CURRENT_STEP_MA);
}

bool in_force_take_references(const condition_row *judged) {
    if (!conditioned ||
        (row.reference_mv == judged->reference_mv && row.drop_mv == judged->drop_mv))
        return false;
    row.reference_mv = judged->reference_mv;
    row.drop_mv = judged->drop_mv;
    return true;
}

static uint32_t volts(uint32_t value_v) {
    uint32_t steps = value_v * REFERENCE_STEPS / REFERENCE_FULL_V;
    return steps < REFERENCE_STEPS ? steps : REFERENCE_STEPS - 1;
}

static void stage_levels(uint32_t open, uint32_t arc, uint32_t shorted) {
    hal_references(tries ? tried_open : open, tries ? tried_arc : arc, shorted);
}

/* What a row has instead of a setting, or the setting. */
static uint32_t own_or(uint32_t one_more, setting which) {
    return one_more ? one_more - 1 : settings_get(which);
}

/* Stage how pulses are counted, and by which criteria they are judged. */
static void stage_rules(const condition_row *r) {
    uint32_t criteria = own_or(r->criteria, SET_CRITERIA);
    uint32_t clocks = units_clocks_of_ns(own_or(r->delay_least_ns, SET_DELAY_LEAST_NS));
    hal_criterion rules = {
        .delay_least = clocks < DELAY_LIMIT ? clocks : DELAY_LIMIT,
        .current = criteria & 1,
        .delay = criteria & 2,
        .noise = criteria & 4,
        .relaxation = r->from_ignition == CONDITIONS_RELAXATION,
    };
    hal_criteria(&rules);
    hal_counting(own_or(r->counting, SET_SERVO_MODE), own_or(r->window, SET_SERVO_WINDOW),
                 own_or(r->weight, SET_SERVO_WEIGHT));
}

/* Stage a condition, adapted to the fluid's class, with a no-load voltage. */
static void stage(const condition_row *r, uint32_t no_load) {
    const gap_class *c = &classes[fluid];
    bool own = r->dame || r->open || r->ok;
    uint32_t level = 0, on = units_clocks_of_us(r->on_us), lag = conditions_lag();
    (void)conditions_level(r, &level);
    if (r->from_ignition)
        on = on > lag && r->from_ignition != CONDITIONS_RELAXATION ? on - lag : 1;
    hal_presets(own ? r->dame : c->dame, own ? r->open : c->open, own ? r->ok : c->ok);
    hal_pulse(on, units_clocks_of_us(conditions_wait_us(r)), units_clocks_of_us(r->off_us),
              units_clocks_of_us(r->rest_us), level);
    hal_supply(r->open_v / GAP_SUPPLY_STEP_V, r->negative);
    /* The fluid lowers the open voltage, but not the voltage of a discharge or of a short. */
    uint32_t left_v = (uint32_t)r->open_v * r->open_percent * c->share_percent / 10000;
    stage_levels(volts(left_v), volts(r->arc_v), volts(r->short_v));
    hal_servo_step(r->step);
    stage_rules(r);
    feed_modes_stage(r, no_load);
}

void in_force_stage(const condition_row *r) {
    stage(r, feed_modes_no_load_of(r, classes[fluid].share_percent));
}

void in_force_stage_now(void) {
    const gap_class *c = &classes[fluid];
    if (conditioned) {
        stage(&row, feed_modes_no_load());
        return;
    }
    hal_presets(c->dame, c->open, c->ok);
    stage_levels(0, 0, volts(SHORT_V));
}

void in_force_apply(void) {
    if (conditioned)
        feed_modes_condition(&row, classes[fluid].share_percent);
}
