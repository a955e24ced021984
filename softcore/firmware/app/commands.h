// SPDX-License-Identifier: Apache-2.0
/* The operator's side of the link. It takes real-time bytes, lines and `$` commands, and sends
   answers, reports and lists. Each step is short. */
#pragma once
#include <stdbool.h>

void commands_init(void);               /* at power-on */
bool commands_step(void);               /* bytes in and out; true if there was something to do */
bool commands_wait(void);               /* an override byte waits; it does not wake the processor */
bool commands_serve(void);              /* at most one line or report; true if there was one */
void commands_answer_program(void);     /* send the program's answer to a line, if there is one */
