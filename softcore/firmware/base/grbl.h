// SPDX-License-Identifier: Apache-2.0
/* Settings with grbl's numbers, for senders that read them. Each is a constant or follows from our
   own settings; none is stored, and none can be set. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/grbl_table.h"

/* Row of a number; GRBL_ROWS if there is none. */
unsigned grbl_find(uint32_t number);

/* Write its value as grbl does: a constant as a whole number, others with three decimals. */
#define GRBL_VALUE 48   /* size of its buffer */
void grbl_value(unsigned row, char *text, size_t size);

/* Would the line `$n=…` set one of them? Then true, with a fault that names the settings it follows
   from. */
bool grbl_refuses(const char *line, uint32_t length, fault *f);
