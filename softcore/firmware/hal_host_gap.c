// SPDX-License-Identifier: Apache-2.0
/* Gap, fluid and feed laws of the machine of hal_host.c: what is written is kept for a test to read,
   what is read is what the test has set. */
#include <string.h>

#include "hal.h"
#include "host.h"

static gk_power power;
static uint32_t discharges, opens;
static gk_gap gap;
static uint32_t fluid_state = HAL_FLUID_KNOWN;
static hal_law law;
static hal_law_state law_state;

void host_gap_boot(void) {
    discharges = opens = 0;
    power = (gk_power){0};
    gap = (gk_gap){0};
    fluid_state = HAL_FLUID_KNOWN;
    law = (hal_law){0};
    law_state = (hal_law_state){0};
}

void gk_power_read(gk_power *words) { *words = power; }
void gk_gap_read(gk_gap *words) { *words = gap; }
void gk_fluid(uint32_t flags) { fluid_state = flags; }
void gk_law_read(uint32_t words[12]) {
    _Static_assert(sizeof law == 12 * sizeof *words, "host.h has the wrong number of words");
    memcpy(words, &law, sizeof law);
}
void gk_mean(uint32_t level) {
    law_state = (hal_law_state){.mean = level, .windows = (uint8_t)(law_state.windows + 1), .known = true};
}
void gk_discharges(uint32_t count) { discharges += count; }
void gk_opens(uint32_t count) { opens += count; }

void hal_short_write(const hal_short_detector *detector) { (void)detector; }
void hal_gap_counts(uint32_t counts[4]) {
    counts[0] = opens;
    counts[2] = counts[3] = 0;
    counts[1] = discharges;
}
void hal_discriminate(const hal_discriminator *rules) { (void)rules; }
void hal_pulse(uint32_t on, uint32_t off, uint32_t rest, uint32_t level) {
    power = (gk_power){.on = on, .off = off, .rest = rest, .level = level,
                       .voltage = power.voltage, .negative = power.negative};
}
void hal_supply(uint32_t voltage, bool negative) {
    power.voltage = voltage;
    power.negative = negative;
}
void hal_references(uint32_t open, uint32_t arc, uint32_t shorted) {
    gap.reference[0] = open;
    gap.reference[1] = arc;
    gap.reference[2] = shorted;
}
void hal_servo(bool on, uint32_t mode, uint32_t window, uint32_t weight) {
    (void)window;
    (void)weight;
    gap.servo = on;
    gap.mode = mode;
}
void hal_servo_period(uint32_t clocks) { gap.period = clocks; }
void hal_servo_step(uint32_t pulses) { gap.step = pulses; }
void hal_presets(uint32_t dame, uint32_t open, uint32_t ok) {
    gap.presets[0] = dame;
    gap.presets[1] = open;
    gap.presets[2] = ok;
}
void hal_law_write(const hal_law *words) { law = *words; }
hal_law_state hal_law_read(void) { return law_state; }
void hal_fluid_write(const hal_fluid *detector) { gap.convert = detector->convert; }
uint32_t hal_fluid_state(void) { return fluid_state; }
void hal_sense(uint32_t on, uint32_t off) {
    (void)on;
    (void)off;
}
