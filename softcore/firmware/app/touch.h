// SPDX-License-Identifier: Apache-2.0
/* The touch-off under way, from the start of its motion to its end.

   The gateware watches: with the discharge off, contact halts the machine. In a touch-off this is
   the end of the motion and no alarm. The place of contact is that of the axes in its clock. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef enum { TOUCH_NONE, TOUCH_LOOKS, TOUCH_FOUND, TOUCH_AT_START } touch_phase;

void touch_begin(void);         /* the motion begins here */
void touch_end(void);           /* it is over; does nothing without one */
touch_phase touch_now(void);    /* TOUCH_AT_START: contact before it has moved */

/* The machine has halted. True if this was the contact that is looked for. */
bool touch_takes(const hal_event *halt);

/* Tell the place of contact, or without one the place of the axes, in the form of grbl:
   `[PRB:x,y,z:1]`, in mm of the machine frame, with 0 for no contact. */
void touch_tell(void);
