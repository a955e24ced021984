// SPDX-License-Identifier: Apache-2.0
/* Why the interlock has tripped, in words. */
#pragma once
#include <stdbool.h>
#include <stddef.h>

#include "fault.h"

/* "axis Z", "axes X and Z"; of a mask, bit 0 X. Returns the length. */
size_t cause_axes(char *buffer, size_t size, unsigned axes);

/* Note a trip (FAULT_TRIP) by a cause of `CAUSE_...`, with the axes that raised it and what the gateware
   knows beside, as it is now. The text begins as said. Returns false, as fault_at does. */
bool cause_fault(fault *f, const char *begin, unsigned cause, unsigned axes);

/* Add whether the counted position may differ from the true one after it. */
void cause_position(fault *f, unsigned cause);
