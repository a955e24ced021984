// SPDX-License-Identifier: Apache-2.0
#include "app/jog.h"

#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"
#include "link/lines.h"

static jog_phase phase;
static uint64_t heard;      /* clock at which the host was heard last */
static uint32_t silence;    /* the longest, in clocks */

jog_phase jog_now(void) { return phase; }
bool jog_active(void) { return phase != JOG_NONE; }
void jog_end(void) { phase = JOG_ENDING; }
void jog_stop(void) {
    phase = JOG_NONE;
    heard = 0;
}
void jog_heard(void) { heard = hal_cycle(); }
bool jog_silent(void) { return hal_cycle() - heard > silence; }

void jog_begin(void) {
    silence = units_clocks_of_us(settings_get(SET_JOG_SILENCE_MS) * 1000);
    phase = JOG_UNDER_WAY;
    /* A jog may have waited in the queue since its host has gone. */
    if (lines_ended() > heard)
        heard = lines_ended();
}
