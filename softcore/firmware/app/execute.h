// SPDX-License-Identifier: Apache-2.0
/* Carries out one block step by step, after the interpreter has accepted it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/plan.h"

typedef enum {
    EXECUTE_MORE, EXECUTE_WAIT, EXECUTE_DONE, EXECUTE_END, EXECUTE_FAULT
} execute_result;

/* Put the members of the modal state that outlive power-off (plan.h): work offsets, the places of G28
   and G30, wire offsets. The offset of G92 does not outlive it, as in grbl, and is taken back. */
void execute_put_places(const uint32_t *kept);

void execute_init(void);
bool execute_start(void);           /* prepare modal state, retraction memory and path for a new
                                       tape; call again until it returns true */
void execute_resynchronise(void);   /* take the position from the machine */
void execute_abort(void);
const modal *execute_state(void);   /* after all blocks carried out or appended so far */

/* `p` and `text` must stay until the block is done. `line` is as for alarm_set_line. */
void execute_begin(const plan *p, bool by_hand, uint32_t line, const char *text, uint32_t length);
execute_result execute_step(fault *f);

bool execute_paused(void);          /* in M00 or M01 */
bool execute_acts(void);            /* carries out something at the front that waits for no motion */
void execute_resume(void);
