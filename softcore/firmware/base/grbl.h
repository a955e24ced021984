// SPDX-License-Identifier: Apache-2.0
/* Settings that senders for grbl read, by grbl's numbers. None is stored: each is a constant, or follows
   from ours; and none can be set. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/grbl_table.h"

/* Row of a number; GRBL_ROWS if there is none. */
unsigned grbl_find(uint32_t number);

/* Its value as grbl tells it: a constant whole, others with three decimals. */
#define GRBL_VALUE 48   /* size of its buffer */
void grbl_value(unsigned row, char *text, size_t size);

/* Would the line `$n=…` set one of them? Then it is refused, naming the settings that it follows from. */
bool grbl_refuses(const char *line, uint32_t length, fault *f);
