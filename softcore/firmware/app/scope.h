// SPDX-License-Identifier: Apache-2.0
/* The gap oscilloscope of the gateware (rtl/gap/scope.py), by lines:

     $SCOPE                      tell the state
     $SCOPE=trigger,before,level arm; the share before the trigger in % (50 if left out)
     $SCOPE=FORCE, $SCOPE=STOP   trigger now; stop
     $SCOPE=READ,first,count     send entries of a full record

   Triggers: NOW, SHORT (Ss), RETRACTION; OPEN, OK, ARC, SHORTED (a pulse of that class); RISE and
   FALL (the voltage crosses `level`, in 1/4096 of the converter's range).

   The state is `[SCOPE:state,depth,count,trigger,time,hz*CRC]`: idle, armed, triggered or full;
   entries of the ring, and in it; of a full record the number of the trigger's entry, and the lower
   32 bits of the clock count in its clock; the clock's frequency.

   Entries are `[SCOPE@first:entries*CRC]`, up to SCOPE_ENTRIES in a line. An entry has 36 bits, the
   registers `entry` and, above it, `entry_rest`, in 6 characters of 6 bits: `0` plus their value,
   the highest bits first. The CRC is that of all between `[` and `*`, as in a numbered line. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define SCOPE_ENTRIES 16u

/* Carry out a line that begins with `$SCOPE`. False if it is refused, with the reason in `f`. After
   READ, `first` and `end` are the entries to be sent; else `end` is 0. */
bool scope_line(const char *line, uint32_t length, uint32_t *first, uint32_t *end, fault *f);

/* Send a line of the entries from `first` to before `end`; returns how many. */
uint32_t scope_tell(uint32_t first, uint32_t end);
