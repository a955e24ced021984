// SPDX-License-Identifier: Apache-2.0
/* Lists of the settings, a line in each step: all at once would take too long. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef enum {
    LISTING_VALUES, /* `$$`: `$n=value`, as grbl 1.1 */
    LISTING_WORDS,  /* `$ES`: what each is called, its unit and its range, as grblHAL */
    LISTING_GROUPS, /* `$EG`: the groups that these name */
} listing_kind;

void listing_stop(void);
void listing_begin(listing_kind kind);
bool listing_open(void);    /* there are lines to come */
bool listing_tell(void);    /* the next of them; true if it was the last */

/* Begin `$ES` for the setting of a number alone; false if there is none. */
bool listing_begin_one(uint32_t number);
