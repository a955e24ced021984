// SPDX-License-Identifier: Apache-2.0
/* The firmware itself: what it is, and other firmware over the link into a slot of the flash memory
   (store/slots.h), which the next power-on starts. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

void firmware_boot(void);           /* before all else; on the target it may not come back */
void firmware_tell_version(void);   /* the answer to `$I` */
void firmware_tell_found(void);     /* what power-on found wrong with a slot, if anything */

/* A line that begins with `$FIRMWARE`, which is decoded in place and must stay until it is answered.
   True: firmware_answers tells when it is. */
bool firmware_line(char *line, uint32_t length, fault *f);
bool firmware_answers(void);
const fault *firmware_answer(void);
void firmware_stop(void);           /* give up what is under way */

/* Work on it, unless the journal does; true if more can be done at once, and the journal has to wait.
   It waits while the machine is armed or moves. */
bool firmware_step(bool journal_works);
