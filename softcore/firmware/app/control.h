// SPDX-License-Identifier: Apache-2.0
/* Alarms, reset and unlock: actions that affect machine, path, program and events together. */
#pragma once
#include <stdbool.h>

#include "base/fault.h"

/* Call at the end of a step that raised an alarm. Ends the program and locks the machine. A later
   step tells the host. */
void control_take_alarm(void);

/* Forget the path, and begin a new one where the machine stands. Only at rest, while path pulses are
   not allowed. */
void control_begin_path(void);

/* The operator's reset: everything stops. If the machine moves, this raises an alarm. */
void control_reset(void);

/* End a cancelled jog: forget the path that was left, and the hold. Only at rest. A tape that waits
   keeps the hold, so that it does not start by itself. */
void control_end_jog(void);

/* Unlock the machine and begin a new path where it stands. False with a fault if that is
   impossible. */
bool control_unlock(fault *f);

/* The operator confirms that the axes stand where the counters say. False with a fault if the
   machine is locked or busy. */
bool control_take_position(fault *f);
