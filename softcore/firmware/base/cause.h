// SPDX-License-Identifier: Apache-2.0
/* Why the interlock has tripped, in words. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

/* "axis Z", "axes X and Z"; of a mask, bit 0 X. Returns the length. */
size_t cause_axes(char *buffer, size_t size, unsigned axes);

/* Note a trip (FAULT_TRIP, or FAULT_LIMIT) by a cause of `CAUSE_...`, with the axes that raised it and
   what the gateware knows beside, as it is now. The text begins as said. Returns false, as fault_at
   does. */
bool cause_fault(fault *f, const char *begin, unsigned cause, unsigned axes);

/* May the counted position differ from the true one after it? And after any of these, by bit, also
   where they came later than another one? */
bool cause_loses_position(unsigned cause);
bool cause_miscounts(uint32_t causes);

/* Add to a trip what has become of the position. */
void cause_position(fault *f, bool lost);
