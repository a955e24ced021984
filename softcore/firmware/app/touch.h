// SPDX-License-Identifier: Apache-2.0
/* The touch-off under way, from the start of its motion to its end.

   Towards the work the gateware watches: with the discharge off, contact halts the machine. In a
   touch-off this is the end of the motion and no alarm. The place of contact is that of the axes in
   its clock. Away from the work firmware watches: it looks at the signal Ss in each pass, and the
   place is that of the axes when the gap is open. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef enum { TOUCH_NONE, TOUCH_LOOKS, TOUCH_FOUND, TOUCH_AT_START } touch_phase;

void touch_init(void);
void touch_begin(bool away);    /* the motion begins here */
void touch_end(void);           /* it is over; does nothing without one */

/* TOUCH_AT_START: there was nothing to find, as the electrode touched before it moved towards the
   work, or did not touch when it moved away. touch_look looks at the gap first. */
touch_phase touch_now(void);
touch_phase touch_look(void);

/* The machine has halted. True if this was the contact that is looked for. */
bool touch_takes(const hal_event *halt);

/* Tell the place found, or without one the place of the axes, in the form of grbl: `[PRB:x,y,z:1]`,
   in mm of the machine frame, with 0 for nothing found; or what was told last since power-on. */
void touch_tell(void);
void touch_tell_last(void);
