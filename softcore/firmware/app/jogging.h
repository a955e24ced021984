// SPDX-License-Identifier: Apache-2.0
/* What allows a jog, and what ends it.

   A jog goes on only while the host shows that it is there. A cancelled jog slows down and rests;
   the path that was left is forgotten. A jog that had come before the cancellation, and was still
   waiting, is refused. */
#pragma once
#include <stdbool.h>

#include "base/fault.h"

void jogging_init(void);

/* May a jog begin now? False with a fault: FAULT_BUSY unless the machine is Idle, or jogs. */
bool jogging_allowed(fault *f);
void jogging_cancel(void);      /* 0x85, a hold, or silence; does nothing without a jog */
void jogging_step(void);        /* call all the time */
