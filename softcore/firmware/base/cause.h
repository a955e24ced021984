// SPDX-License-Identifier: Apache-2.0
/* Says in words why the interlock has tripped. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

/* Write "axis Z" or "axes X and Z" for a mask of axes, bit 0 X. Returns the length. */
size_t cause_axes(char *buffer, size_t size, unsigned axes);

/* Note a trip (FAULT_TRIP, or FAULT_LIMIT) by a cause `CAUSE_...`, with the axes that raised it and
   with details that are now read from the gateware. The text starts with `begin`. Returns false,
   like fault_at. */
bool cause_fault(fault *f, const char *begin, unsigned cause, unsigned axes);

/* May the counted position differ from the true one after this first cause? And after any of
   `causes` (a bit for each), even if they followed another cause? */
bool cause_loses_position(unsigned cause);
bool cause_miscounts(uint32_t causes);

/* Add to the text of a trip whether the position is lost or kept. */
void cause_position(fault *f, bool lost);
