// SPDX-License-Identifier: Apache-2.0
/* The processor's sleep in the model machine, and what comes in it. */
#include "hal/hal.h"
#include "pc/host.h"

static uint8_t says; /* byte that comes in the next sleep, 0 for none */
static uint32_t meets, met_detail; /* kind of the event at its end, 0 for none; its detail */

void hal_sleep(uint32_t clocks) {
    (void)gk_go(host_sleep(clocks));
    if (says)
        (void)gk_send(&says, 1);
    says = 0;
    if (meets)
        gk_event(meets, met_detail, 0, 0);
    meets = 0;
}

void gk_sleep_says(uint8_t byte) { says = byte; }
void gk_sleep_meets(uint32_t kind, uint32_t detail) {
    meets = kind;
    met_detail = detail;
}
