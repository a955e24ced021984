// SPDX-License-Identifier: Apache-2.0
/* Gap, fluid and feed modes of the model machine of hal_host.c. A test can read the values that
   were written, and set the values that are read. */
#include <string.h>

#include "hal/hal.h"
#include "pc/host.h"

#define LEVEL_LIMIT 20          /* as the gateware is built by default */
#define SHORT_LEVEL 122         /* after reset */

/* The words of a condition. They are staged and come into force together. */
typedef struct {
    gk_power power;
    uint32_t reference[3], presets[3], counting[3], criteria, delay_least, step;
    uint32_t references[4];     /* no load, Vs, Es, Es as a share */
} condition;

static condition staged, in_force;
static uint32_t level_limit = LEVEL_LIMIT;
static bool armed, waits;       /* waits: the pulse does not end, so nothing switches */
static bool pending;
static int32_t depth, deepest;
static uint8_t switches;
static uint32_t discharges, opens;
static bool touches;            /* Ss */
static gk_gap gap;
static uint32_t fluid_state = HAL_FLUID_KNOWN;
static hal_feed_mode feed_mode;
static hal_feed_mode_state feed_mode_state;
static gk_scope scope;          /* the oscilloscope, which a test fills */
static uint32_t scope_place;

void host_gap_boot(void) {
    level_limit = LEVEL_LIMIT;
    touches = false;
    discharges = opens = 0;
    staged = in_force = (condition){.reference = {0, 0, SHORT_LEVEL}};
    armed = waits = pending = false;
    deepest = switches = 0;
    gap = (gk_gap){0};
    fluid_state = HAL_FLUID_KNOWN;
    feed_mode = (hal_feed_mode){0};
    feed_mode_state = (hal_feed_mode_state){0};
    scope = (gk_scope){.depth = 64};
}

static void take(void) {
    if (pending && !waits) {
        in_force = staged;
        pending = false;
    }
}

bool host_gap_moved(int32_t position) {
    deepest = position < deepest ? position : deepest;
    if (!armed || pending || deepest > depth)
        return false;
    armed = false;
    pending = true;
    switches++;
    take();
    return true;
}

void gk_pulse_lasts(uint32_t lasts) {
    waits = lasts;
    take();
}

void hal_condition_commit(void) {
    armed = false;
    pending = true;
    take();
}
void host_gap_arm(int32_t at) {
    depth = at;
    armed = true;
}
void hal_condition_disarm(void) { armed = false; }
void host_gap_restart(int32_t position) { deepest = position; }
bool hal_condition_pending(void) { return pending; }
uint8_t hal_condition_count(void) { return switches; }

void gk_power_read(gk_power *words) { *words = in_force.power; }
void gk_gap_read(gk_gap *words) {
    *words = gap;
    for (unsigned i = 0; i < 3; i++) {
        words->reference[i] = in_force.reference[i];
        words->presets[i] = in_force.presets[i];
        words->counting[i] = in_force.counting[i];
    }
    words->step = in_force.step;
    words->criteria = in_force.criteria;
    words->delay_least = in_force.delay_least;
}
void gk_fluid(uint32_t flags) { fluid_state = flags; }
void gk_feed_mode_read(uint32_t words[14]) {
    const uint32_t all[14] = {feed_mode.mode, feed_mode.measure, feed_mode.unit, feed_mode.window,
                              in_force.references[0], in_force.references[1],
                              in_force.references[2], feed_mode.least, feed_mode.lowest,
                              feed_mode.highest, feed_mode.gain, feed_mode.fastest,
                              feed_mode.shares, in_force.references[3]};
    memcpy(words, all, sizeof all);
}
void gk_mean(uint32_t level) {
    feed_mode_state = (hal_feed_mode_state){
        .mean = level, .windows = (uint8_t)(feed_mode_state.windows + 1), .known = true};
}
void gk_discharges(uint32_t count) { discharges += count; }
void gk_opens(uint32_t count) { opens += count; }

void hal_short_write(const hal_short_detector *detector) {
    gap.short_mean = detector->mean;
    gap.short_mean_time = detector->mean_time;
    gap.short_current = detector->current;
}
void hal_lag_time(uint32_t clocks) { gap.lag_time = clocks; }
void hal_gap_counts(uint32_t counts[4]) {
    counts[0] = opens;
    counts[2] = counts[3] = 0;
    counts[1] = discharges;
}
bool hal_shorted(void) { return touches; }
void gk_shorted(uint32_t on) { touches = on; }
void hal_discriminate(const hal_discriminator *rules) { (void)rules; }
void hal_criteria(const hal_criterion *c) {
    staged.criteria = c->current * 1u + c->delay * 2u + c->noise * 4u +
                      c->relaxation * 8u;
    staged.delay_least = c->delay_least;
}
void hal_pulse(uint32_t on, uint32_t wait, uint32_t off, uint32_t rest, uint32_t level) {
    staged.power = (gk_power){.on = on, .wait = wait, .off = off, .rest = rest, .level = level,
                              .voltage = staged.power.voltage, .negative = staged.power.negative};
}
uint32_t hal_level_limit(void) { return level_limit; }
void gk_level_limit(uint32_t level) { level_limit = level; }
void hal_supply(uint32_t voltage, bool negative) {
    staged.power.voltage = voltage;
    staged.power.negative = negative;
}
void hal_references(uint32_t open, uint32_t arc, uint32_t shorted) {
    staged.reference[0] = open;
    staged.reference[1] = arc;
    staged.reference[2] = shorted;
}
void hal_servo(bool on) { gap.servo = on; }
void hal_counting(uint32_t mode, uint32_t window, uint32_t weight) {
    staged.counting[0] = mode;
    staged.counting[1] = window;
    staged.counting[2] = weight;
}
void hal_servo_period(uint32_t clocks) { gap.period = clocks; }
void hal_servo_step(uint32_t pulses) { staged.step = pulses; }
void hal_presets(uint32_t dame, uint32_t open, uint32_t ok) {
    staged.presets[0] = dame;
    staged.presets[1] = open;
    staged.presets[2] = ok;
}
void hal_feed_mode_references(uint32_t no_load, uint32_t voltage, uint32_t drop, uint32_t share) {
    staged.references[0] = no_load;
    staged.references[1] = voltage;
    staged.references[2] = drop;
    staged.references[3] = share;
}
void hal_feed_mode_write(const hal_feed_mode *words) { feed_mode = *words; }
hal_feed_mode_state hal_feed_mode_read(void) { return feed_mode_state; }
void hal_fluid_write(const hal_fluid *detector) { gap.convert = detector->convert; }
uint32_t hal_fluid_state(void) { return fluid_state; }
void hal_sense(uint32_t on, uint32_t off) {
    (void)on;
    (void)off;
}
void hal_follow(uint32_t clocks) { (void)clocks; }

uint32_t hal_scope_depth(void) { return scope.depth; }
void hal_scope_arm(const hal_scope_trigger *trigger) {
    scope.source = trigger->source;
    scope.classes = trigger->classes;
    scope.level = trigger->level;
    scope.after = trigger->after;
    scope.recording = HAL_SCOPE_ARMED;
}
void hal_scope_order(hal_scope_ordered order) {
    scope.recording = order == HAL_SCOPE_STOP ? HAL_SCOPE_IDLE : HAL_SCOPE_TRIGGERED;
}
hal_scope_state hal_scope_read(void) {
    return (hal_scope_state){.recording = (hal_scope_recording)scope.recording, .count = scope.count,
                             .after = scope.after, .time = scope.time};
}
void hal_scope_choose(uint32_t place) { scope_place = place; }
uint64_t hal_scope_next(void) { return scope.entries[scope_place++ % GK_SCOPE]; }
void gk_scope_read(gk_scope *words) { *words = scope; }
void gk_scope_write(const gk_scope *words) { scope = *words; }
