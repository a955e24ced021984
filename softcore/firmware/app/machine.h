// SPDX-License-Identifier: Apache-2.0
/* State of the whole machine: locked by an alarm, free or held; discharge; alarms. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

void machine_init(void);

bool machine_locked(void);
bool machine_held(void);
bool machine_machining(void);           /* the program has switched the discharge on (M03) */
bool machine_burns(void);               /* machining, and the operator has not switched it off */
bool machine_dry(void);                 /* dry run: M03 switches nothing on */
bool machine_goes(void);                /* path pulses are allowed, and forward motion is wanted */

/* Does the machine's state allow a block that moves, or that switches the discharge on? False with
   a fault that says what to do. */
bool machine_allows(bool moves, bool burns, fault *f);

/* The position is lost if the axes may stand elsewhere than the counters say. It is known again
   when the operator confirms it, or by homing; `homed`: all axes. */
bool machine_position_lost(void);
bool machine_homed(void);               /* known by homing, and not lost since then */
uint32_t machine_frame(void);           /* number of the machine frame: a loss, and homing, end it */
void machine_know_position(bool homed);
void machine_lose_position(void);

void machine_run(bool run);             /* path pulses are allowed */
/* Hold the feed or end the hold, also one that a `!` began in the gateware. The end switches the
   discharge on again after machine_quench; if that is not allowed: false with a fault, and the hold
   stays. */
bool machine_hold(bool hold, fault *f);
void machine_walk(void);                /* lift the hold, and a wait, for a walk: until the next hold or
                                           its end. Only away from the front */
void machine_quench(void);              /* no discharge until the hold ends */
void machine_wait(bool wait);           /* hold by the program: no jump begins, no axis advances */
void machine_discharge(bool machining);
void machine_retract(void);             /* operator's order */

/* Call after the outputs went off (alarm_outputs_off): ends running, machining and hold. */
void machine_stop(void);

/* Take the alarm that was raised: lock the machine until machine_free. A later step tells the host
   with machine_tell_alarm: both at once would take too long for one pass of the main loop. */
void machine_take_alarm(void);
void machine_tell_alarm(void);

/* Clear the interlock, if it is open; false with a fault if it stays open. */
bool machine_clear(fault *f);
void machine_free(void);
#define MACHINE_UNLOCKED_ROWS 2
void machine_tell_unlocked(unsigned row);   /* tell what restricts the machine: at most one line */

/* Raise the alarm of an event of the gateware; `position` is the encoders' position in clock
   `cycle`. */
void machine_halted(unsigned detail, uint64_t cycle, const int32_t *position);
void machine_tripped(unsigned cause, unsigned axes, uint64_t cycle, const int32_t *position);
void machine_events_lost(void);
