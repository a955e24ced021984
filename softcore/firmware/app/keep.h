// SPDX-License-Identifier: Apache-2.0
/* What outlives power-off, and its way to the journal in the flash memory and back: settings, work and
   wire offsets with the places of G28 and G30, conditions and fluid classes entered by hand. What
   comes from the journal passes the checks of its entry. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* At power-on, in this order. `between` is called between the parts of what takes long. */
void keep_open(void (*between)(void));
void keep_load_settings(void);
void keep_load_gap(void);           /* conditions and classes */
void keep_load_places(void);
void keep_begin(void (*between)(void));

/* Send, once, what there is to say about the memory and its contents. */
void keep_tell(void);

/* Write what has changed, while the machine stands and does not discharge; true if more can be done
   at once. */
bool keep_step(void);
bool keep_waits(void);  /* something is still to be written */

/* `$RST=`: `$` the settings, `#` the offsets and places, `*` these, conditions and classes, back to
   what they are without a journal. */
void keep_restore(char what, uint32_t length, fault *f);
