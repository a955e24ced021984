// SPDX-License-Identifier: Apache-2.0
/* Lists of the settings, the costs of the firmware's work, and the record of the gap oscilloscope.
   Each step sends one line: a whole list at once would take too long. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef enum {
    LISTING_VALUES, /* `$$`: `$n=value`, as grbl 1.1 */
    LISTING_WORDS,  /* `$ES`: title, unit and range of each setting, as grblHAL */
    LISTING_GROUPS, /* `$EG`: the groups that `$ES` refers to */
    LISTING_COST,   /* `$P`: one line, what the firmware's work took */
    LISTING_INPUTS, /* `$INPUTS`, of app/wiring.h */
    LISTING_MEMORY, /* `$MEMORY`, of app/wiring.h: a row is a word */
    LISTING_SCOPE,  /* entries of the oscilloscope; by listing_begin_scope */
} listing_kind;

void listing_stop(void);
void listing_begin(listing_kind kind);
bool listing_open(void);    /* lines are still to be sent */
bool listing_tell(void);    /* send the next line; true if it was the last */

/* Begin `$ES` for one setting; false if no setting has this number. */
bool listing_begin_one(uint32_t number);

/* Begin to send the entries of a full record from `first` to before `last`. */
void listing_begin_scope(uint32_t first, uint32_t last);
