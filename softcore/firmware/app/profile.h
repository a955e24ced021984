// SPDX-License-Identifier: Apache-2.0
/* Records how many clocks the steps of the main loop take. */
#pragma once
#include <stdint.h>

#define PROFILE_TASKS 4         /* events, path, program, link */

void profile_init(void);
void profile_note(unsigned task, uint32_t clocks);  /* record one step of a task */
uint32_t profile_worst(unsigned task);              /* its longest step since profile_init */
