// SPDX-License-Identifier: Apache-2.0
/* The state of jogging: from a jog's judgement until the axes rest. `app/jogging.h` has what ends
   it. */
#pragma once
#include <stdbool.h>

typedef enum { JOG_NONE, JOG_UNDER_WAY, JOG_ENDING } jog_phase;

jog_phase jog_now(void);
bool jog_active(void);          /* state Jog: under way, or coming to rest */

void jog_begin(void);           /* a jog has been accepted */
void jog_end(void);             /* it is cancelled, and the axes come to rest */
void jog_stop(void);            /* there is none any more, also at power-on */

/* The host has shown that it is there: it has sent a jog, or asked for its status report. */
void jog_heard(void);
bool jog_silent(void);          /* it has not done so for the longest silence of the settings */
