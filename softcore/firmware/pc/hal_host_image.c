// SPDX-License-Identifier: Apache-2.0
/* The image of the firmware on a computer: words given by a test; empty after reset. */
#include "hal/hal.h"
#include "pc/host.h"

#define WORDS 256

static uint32_t words[WORDS];
static hal_image image;

void host_image_boot(void) { image = (hal_image){0}; }

void gk_image(const uint32_t *from, uint32_t count, uint32_t digest) {
    count = count < WORDS ? count : WORDS;
    for (uint32_t at = 0; at < count; at++)
        words[at] = from[at];
    image = (hal_image){words, count, digest};
}

hal_image hal_image_read(void) { return image; }
