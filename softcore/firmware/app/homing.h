// SPDX-License-Identifier: Apache-2.0
/* State of the homing cycle (`$H`), for the modules that `homing_cycle` calls; `homing_cycle` itself
   carries the cycle out.

   The limit switch at one end of an axis is its reference. The guard of the limit switches stays in
   force: a pressed switch trips the interlock, which makes the outputs safe, as at any other time.
   The event of the trip has the place of the axis in that clock. During the cycle the trip of the
   wanted switch is no alarm.

   An axis whose reference is the index of its coder ($560) goes on from the pull-off until the index
   comes, whose event has the place of the axis, too, and back onto it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

typedef enum {
    HOMING_NONE, HOMING_SEEK, HOMING_STOP, HOMING_LEAVE,
    HOMING_INDEX,       /* on, away from the switch, until the index comes */
    HOMING_FOUND,       /* it has come, and the axis comes to rest */
    HOMING_BACK         /* back onto it */
} homing_phase;

typedef struct {
    homing_phase phase;
    unsigned axis;      /* the one that is homed; HAL_AXES before the first */
    bool down;          /* its switch is at its lower end */
    int32_t switched;   /* where the switch was pressed */
    uint32_t since;     /* clock from which on the axes have stood */
    int32_t index;      /* where the index of its coder came */
    int32_t before;     /* where the last one came on the way off the switch, if it `passed` one */
    bool passed;
    bool told;          /* the place of the index has been told */
} homing_state;

extern homing_state homing_now;

void homing_init(void);
bool homing_active(void);

/* End the cycle. Its answer to `$H` is the fault, or success if `why` is 0. */
void homing_end(const fault *why);

/* End a cycle under way, since an alarm or a reset has come. */
void homing_stop(void);

/* The interlock has tripped. True if the cause is the switch that the cycle looks for: the trip is
   then no alarm. `place`: the places of the axes in the clock of the trip. */
bool homing_takes(unsigned cause, unsigned axes, const int32_t *place);

/* The index of the coders of these axes has come. Nothing if the cycle does not look for it. */
void homing_indexed(uint32_t axes, const int32_t *place);

/* Has a cycle ended whose answer has not been taken yet? homing_answer takes it: 0 or a fault. */
bool homing_answers(void);
const fault *homing_answer(void);
