// SPDX-License-Identifier: Apache-2.0
/* What concerns machine, path, program and events at once: alarms, reset and unlock. */
#pragma once
#include <stdbool.h>

#include "base/fault.h"

/* Take the alarm that a step has raised, at its end: the program ends and the machine is locked. The
   host is told a little later. */
void control_take_alarm(void);

/* The operator's reset: everything stops; in motion that is an alarm. */
void control_reset(void);

/* Unlock the machine; a new path begins where it stands. False with a fault if it cannot be. */
bool control_unlock(fault *f);

/* The operator's word that the axes are where they are counted; false if it cannot be taken now. */
bool control_take_position(fault *f);
