// SPDX-License-Identifier: Apache-2.0
/* Machining conditions: the rows that the C word chooses from, built in or entered with G10. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "gap/built_in.h"

typedef struct {
    uint32_t number;
    uint16_t milli_ip;          /* current, 1/1000 IP */
    bool negative;              /* electrode negative */
    uint16_t on_us, off_us;
    uint16_t rest_us;           /* more off-time after an arc or a short */
    uint16_t open_v;            /* open voltage */
    uint8_t open_percent;       /* of the open voltage: the level that tells an open gap */
    uint8_t arc_v, short_v;     /* levels that tell an arc and a short */
    uint8_t dame, open, ok;     /* presets of the counters; all 0: those of the fluid's class */
    uint16_t step;              /* of the servo, pulses */
    uint32_t reference_mv;      /* Vs: mean voltage of G95 P2 and P3; 0 for none */
    uint32_t drop_mv;           /* Es: drop of the mean voltage of G95 P4; 0 for none */
} condition_row;

/* The row of a number, or a null pointer: the tape's, else the one entered by hand, else a built-in. */
const condition_row *conditions_find(uint32_t number);

/* Forget what tapes have entered: a new program starts. */
void conditions_start(void);

/* Forget all that was entered. */
void conditions_reset(void);

/* A row to start from for a number: that of the number if there is one, else a blank with the usual
   voltages, in which current and times are 0. */
condition_row conditions_draft(uint32_t number);

/* Enter a row; false if there is no room. By hand also instead of the tape's. */
bool conditions_enter(const condition_row *row, bool by_hand);

/* The condition of a planned current, in IP from 1 on: host/roughing's. A built-in one that has it;
   else number CONDITIONS_PLANNED + IP with times between those of its neighbours, or in proportion beyond
   the last.
   What has been entered by hand under its number counts as it does for C and G10. */
condition_row conditions_planned(uint32_t ip);

/* Current of a row in steps of the power supply (a setting); false if it has no such step, by more than
   1/100 IP, or the gateware does not let it through. */
bool conditions_level(const condition_row *row, uint32_t *level);

/* A pulse of the row lasts longer than the gap is not looked at after its start and after its ignition
   (settings): else no short would be seen. */
bool conditions_seen(const condition_row *row);
