// SPDX-License-Identifier: Apache-2.0
/* Machining conditions: rows that the C word selects, built in or entered with G10. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/built_in.h"

#define CONDITIONS_RELAXATION 2u

typedef struct {
    uint32_t number;
    uint16_t milli_ip;          /* current, 1/1000 IP */
    bool negative;              /* electrode negative */
    uint8_t from_ignition;      /* 1: the on-time counts from the ignition; 0: from the gate;
                                   CONDITIONS_RELAXATION: the ignition ends the pulse, which charges
                                   a capacitor for at most the on-time */
    uint16_t on_us, off_us;
    uint16_t rest_us;           /* additional off-time after an arc or a short */
    uint16_t open_v;            /* open voltage */
    uint8_t open_percent;       /* of the open voltage: the level above which the gap is open */
    uint8_t arc_v, short_v;     /* levels below which there is an arc, or a short */
    uint8_t dame, open, ok;     /* presets of the counters; all 0: those of the fluid's class */
    uint16_t step;              /* of the servo, pulses */
    uint32_t reference_mv;      /* Vs: mean voltage of G95 P2 and P3; 0 for none */
    uint32_t drop_mv;           /* Es: drop of the mean voltage of G95 P4, P5; 0 for none */
    /* How pulses are counted and judged. Each is 1 more than the value of its setting would be; 0:
       the setting is in force. */
    uint8_t counting, weight, criteria;
    uint16_t window;
    uint16_t wait_us;           /* longest wait for the ignition; 0: as long as the on-time */
    uint32_t delay_least_ns;
} condition_row;

/* The row with a number: the tape's, else the one entered by hand, else a built-in one; a null
   pointer if there is none. */
const condition_row *conditions_find(uint32_t number);

/* Forget the rows that tapes have entered, as a new program starts. */
void conditions_start(void);

/* Forget all rows that were entered. */
void conditions_reset(void);

/* A row to begin with when a number is entered: the present row of this number, else a new one with
   the usual voltages, and with current and times 0. */
condition_row conditions_draft(uint32_t number);

/* Enter a row; false if there is no room. A row entered by hand also replaces the tape's. */
bool conditions_enter(const condition_row *row, bool by_hand);

/* The condition for a planned current, in IP from 1 on; host/roughing has the same. It is a
   built-in one with this current. If there is none, its number is CONDITIONS_PLANNED + IP, and its
   times lie between those of the neighbouring currents, or beyond the last in proportion to the
   current. A row entered by hand with that number replaces it, as for C and G10. */
condition_row conditions_planned(uint32_t ip);

/* The row in a place that was entered by hand; a null pointer if there is none. And a number that
   every change of such rows changes. */
const condition_row *conditions_by_hand(unsigned place);
uint32_t conditions_edition(void);

/* Ranges of G10 C: pulses (on-time, wait), off-time, open voltage. */
#define CONDITIONS_PULSE_US 2000    /* on_max_s of rtl/controller.py, which no register exceeds */
#define CONDITIONS_OFF_US 20000
#define CONDITIONS_OPEN_V_LOWEST 20
#define CONDITIONS_OPEN_V_HIGHEST 300

/* Current of a row in steps of the power supply (a setting). False if no step is within 1/100 IP of
   it, or if the gateware does not allow it. */
bool conditions_level(const condition_row *row, uint32_t *level);

/* Longest wait of a row's pulses for their ignition, us; 0 if their on-time counts from the gate. */
uint32_t conditions_wait_us(const condition_row *row);

/* Clocks from an ignition until the gateware sees it, and from the end of a gate until the current
   ends: the pads and a setting. */
uint32_t conditions_lag(void);

/* Does a pulse of the row last until the comparators are read, after blanking and settling
   (settings)? Otherwise no short would be seen. If its on-time counts from the ignition, the wait
   must last beyond the blanking, and the on-time beyond lag and settling. `conditions_judge` says in
   the fault what is too short. */
bool conditions_seen(const condition_row *row);
bool conditions_judge(const condition_row *row, uint32_t column, fault *f);
