// SPDX-License-Identifier: Apache-2.0
/* How long the steps of the main loop take, in clocks. */
#pragma once
#include <stdint.h>

#define PROFILE_TASKS 4         /* events, path, program, link */

void profile_init(void);
void profile_note(unsigned task, uint32_t clocks);  /* a step of a task has taken so long */
uint32_t profile_worst(unsigned task);              /* the longest since profile_init */
