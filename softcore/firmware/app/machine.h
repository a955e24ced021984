// SPDX-License-Identifier: Apache-2.0
/* State of the machine as a whole: locked by an alarm, free, held; discharge; alarms. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

void machine_init(void);

bool machine_locked(void);
bool machine_held(void);
bool machine_machining(void);           /* the program has it on (M03), */
bool machine_burns(void);               /* and no order of the operator has it off */
bool machine_goes(void);                /* path pulses are allowed, and wanted forward */

/* Does the machine's state forbid a block that moves or that switches the discharge on? The sentence
   says what to do. */
bool machine_allows(bool moves, bool burns, fault *f);

/* The position is lost where what is counted may differ from where the axes are. The operator's word
   takes it for true as it stands. */
bool machine_position_lost(void);
void machine_know_position(void);

void machine_run(bool run);             /* path pulses are allowed */
/* Hold the feed, or end the hold, that of a `!` in the gateware, too. What machine_quench has switched off
   goes on with that; false with a fault if it may not, and the hold stays. */
bool machine_hold(bool hold, fault *f);
void machine_quench(void);              /* no discharge until the hold ends */
void machine_wait(bool wait);           /* hold of the program's own: no jump begins, nothing advances */
void machine_discharge(bool machining);
void machine_retract(void);             /* operator's order */

/* The outputs have gone off (alarm_outputs_off): nothing runs, machines or is held any more. */
void machine_stop(void);

/* Take the alarm that was raised: the machine is locked until machine_free. The host is told in a later
   step, by machine_tell_alarm: all at once would take too long for one pass of the main loop. */
void machine_take_alarm(void);
void machine_tell_alarm(void);

/* Clear the interlock, if it is open; false with a fault if it stays open. */
bool machine_clear(fault *f);
void machine_free(void);
#define MACHINE_UNLOCKED_ROWS 2
void machine_tell_unlocked(unsigned row);   /* what holds now, a line at most for each row */

/* What the gateware's events raise alarms of, with the encoders' position in clock `cycle`. */
void machine_halted(unsigned detail, uint64_t cycle, const int32_t *position);
void machine_tripped(unsigned cause, unsigned axes, uint64_t cycle, const int32_t *position);
void machine_events_lost(void);
