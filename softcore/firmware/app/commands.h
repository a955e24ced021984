// SPDX-License-Identifier: Apache-2.0
/* What the operator says over the link: real-time bytes, lines and `$` commands; and what he is told:
   answers, reports, lists. Each step takes little time. */
#pragma once
#include <stdbool.h>

void commands_init(void);               /* at power-on */
bool commands_step(void);               /* bytes in and out; true if there was something to do */
bool commands_wait(void);               /* a byte has come that wakes nobody: an override */
bool commands_serve(void);              /* at most one line or report; likewise */
void commands_answer_program(void);     /* tell the program's answer to a line, if it has given one */
