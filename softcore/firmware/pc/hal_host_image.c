// SPDX-License-Identifier: Apache-2.0
/* The image of the firmware on a computer: words given by a test; empty after reset, unless the test
   has given the image that a configuration brings. */
#include "hal/hal.h"
#include "pc/host.h"

#define WORDS 1024

static uint32_t words[WORDS], loaded[WORDS];
static hal_image image, configured;
static hal_started started;
static bool hangs, pressed;     /* a start went wrong; ARM is held */

static hal_image copied(uint32_t to[WORDS], const uint32_t *from, uint32_t count, uint32_t digest) {
    count = count < WORDS ? count : WORDS;
    for (uint32_t at = 0; at < count; at++)
        to[at] = from[at];
    return (hal_image){to, count, digest};
}

void host_image_boot(void) {
    image = configured;
    image.words = configured.count ? loaded : words;
    for (uint32_t at = 0; at < WORDS; at++)
        words[at] = 0;
    started = (hal_started){0};
    hangs = false;
}

void gk_image(const uint32_t *from, uint32_t count, uint32_t digest) {
    image = copied(words, from, count, digest);
}

void gk_configured(const uint32_t *from, uint32_t count, uint32_t digest) {
    configured = copied(loaded, from, count, digest);
}

hal_image hal_image_read(void) { return image; }
hal_started hal_started_read(void) { return started; }
uint32_t gk_hangs(void) { return hangs; }
void gk_press_arm(uint32_t held) { pressed = held; }
bool hal_arm_pressed(void) { return pressed; }

/* As image_loader of start.S. */
void hal_image_start(const hal_started *note, uint32_t count) {
    uint32_t digest = 0, word = 0;
    for (uint32_t at = 0; at < count; at++) {
        for (unsigned i = 0; i < 4; i++)
            word = word >> 8 | (uint32_t)hal_flash_exchange(0) << 24;
        if (at < WORDS)
            words[at] = word;
        if (at + 1 < count) {
            digest = (digest ^ word) * 0x9e3779b1u;
            digest ^= digest >> 15;
        }
    }
    hal_flash_select(false);
    started = *note;
    hangs = word != digest || digest != note->digest || count > WORDS;
    if (!hangs)
        image = (hal_image){words, count - 1, digest};
}
