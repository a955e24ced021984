// SPDX-License-Identifier: Apache-2.0
/* State of the machine as a whole: locked by an alarm, free, held; discharge; alarms. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

void machine_init(void);

bool machine_locked(void);
bool machine_held(void);
bool machine_machining(void);
bool machine_goes(void);                /* path pulses are allowed, and wanted forward */

/* Does the machine's state forbid a block that moves or that switches the discharge on? The sentence
   says what to do. */
bool machine_allows(bool moves, bool burns, fault *f);

/* The position is lost where what is counted may differ from where the axes are. The operator's word
   takes it for true as it stands; false if it cannot be taken now. */
bool machine_position_lost(void);
bool machine_take_position(fault *f);

void machine_run(bool run);             /* path pulses are allowed */
void machine_hold(bool hold);           /* false also ends the hold that a `!` began in the gateware */
void machine_wait(bool wait);           /* hold of the program's own: no jump begins, nothing advances */
void machine_discharge(bool machining);
void machine_retract(void);             /* operator's order */

/* Stop everything at once, and lock until machine_unlock. The host is told a little later. */
void machine_alarm(const fault *f);
bool machine_alarm_waits(void);
void machine_tell_alarm(void);
bool machine_unlock(fault *f);
#define MACHINE_UNLOCKED_ROWS 2
void machine_tell_unlocked(unsigned row);   /* what holds now, a line at most for each row */
void machine_reset(void);               /* operator's reset */

/* The gateware's events that end a program, with the encoders' position in clock `cycle`. */
void machine_halted(unsigned detail, uint64_t cycle, const int32_t *position);
void machine_tripped(unsigned cause, unsigned axes, uint64_t cycle, const int32_t *position);
void machine_events_lost(void);
