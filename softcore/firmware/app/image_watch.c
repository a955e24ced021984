// SPDX-License-Identifier: Apache-2.0
#include "app/image_watch.h"

#include "base/alarm.h"
#include "hal/hal.h"

#define SLICE 64            /* words in a step: some 800 clocks */
#define SHARE 100           /* the pause after a step is this many times as long as the step */

static hal_image image;
static uint32_t at, digest; /* number of words read in this round, and their digest */
static uint32_t since, pause; /* clock of the last step, and the pause that follows it */
static uint32_t clocks;     /* spent on all steps */
static bool damaged;

void image_watch_init(void) {
    at = digest = pause = clocks = 0;
    since = hal_cycle_low();
    damaged = false;
}

bool image_watch_sound(fault *f) {
    return !damaged ||
           fault_at(f, FAULT_GUARD, 0, "the firmware in memory is not what was loaded: configure the "
                                       "controller anew");
}

/* Same function as in softcore/image.py. Every step can be undone, so one wrong word always changes
   the digest. */
static uint32_t mix(uint32_t sum, uint32_t word) {
    sum = (sum ^ word) * 0x9e3779b1u;
    return sum ^ sum >> 15;
}

__attribute__((noinline)) static void judge(void) {
    at = 0;
    if (digest == image.digest || damaged)
        return;
    damaged = true;
    fault f = {.line = alarm_line()};
    (void)image_watch_sound(&f);
    alarm_raise(&f);
    hal_interlock_trip();
}

__attribute__((noinline)) static void read_slice(void) {
    if (at == 0) {
        image = hal_image_read();
        digest = 0;
    }
    uint32_t end = image.count - at < SLICE ? image.count : at + SLICE, sum = digest;
    const volatile uint32_t *word = image.words + at, *last = image.words + end;
    for (; last - word >= 4; word += 4) /* a round of the loop costs as much as a word */
        sum = mix(mix(mix(mix(sum, word[0]), word[1]), word[2]), word[3]);
    for (; word < last; word++)
        sum = mix(sum, *word);
    at = end;
    digest = sum;
    if (at == image.count)
        judge();
}

void image_watch_step(void) {
    uint32_t now = hal_cycle_low();
    if (now - since < pause)
        return;
    read_slice();
    uint32_t took = hal_cycle_low() - now;
    clocks += took;
    since = now;
    pause = SHARE * took;
}

uint32_t image_watch_clocks(void) { return clocks; }
