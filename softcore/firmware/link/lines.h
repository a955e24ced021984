// SPDX-License-Identifier: Apache-2.0
/* Lines as they come over the link: judged when they end, kept until they are taken, and answered in
   turn, one answer each. A line is carried out as it was sent, or refused whole.

   A numbered line, `@17 text*5A3C`, is refused unless its check is right and its number follows the
   last one; that same number is answered once more. The first one guards the link until a reset:
   lines without a number are then refused. Without a guard a plain line is taken if nothing is known
   to be missing from it.

   Orders ($RESUME, $RETRACT) are to be carried out when they end, before what waits. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define LINES_LONGEST 255   /* characters of a line's text */
#define LINES_CHECK 5       /* of '*' and the digits behind it */

void lines_init(void);                  /* at power-on */
void lines_restart(void);               /* nothing has come, the link is not guarded */
bool lines_guarded(void);
bool lines_whole(void);                 /* what comes now is the start of something */

/* A character: part of a line, its end, or the end of one that was answered at once. Or an order that
   is to be carried out now; then call lines_ordered. */
typedef enum { LINES_MORE, LINES_ENDED, LINES_ANSWERED, LINES_RESUME, LINES_RETRACT } lines_part;
lines_part lines_byte(uint8_t byte);
void lines_ordered(const fault *f);     /* the order's answer */
bool lines_order(void);                 /* what has come of the line reads as an order, whole */
void lines_damaged(unsigned mark);      /* the receiver saw an error here: a MARK of regs.h */
void lines_cut(void);                   /* a frame begins here */
void lines_frame_good(void);            /* it has come whole */
void lines_frame_bad(void);             /* it was damaged: its rest is still to come */
void lines_frame_end(void);             /* here ends one that was not recognised, or its rest */
void lines_frame_stalled(void);         /* it stopped half-way: it may have been a line's start */
void lines_quiet(void);                 /* nothing has come for a while */

/* The next line's text, of `length` characters; or the next refused line is answered. */
#define LINES_TEXT_SIZE (LINES_LONGEST + LINES_CHECK)
typedef enum { LINES_NONE, LINES_TEXT, LINES_REFUSED } lines_kind;
lines_kind lines_take(char text[LINES_TEXT_SIZE], uint32_t *length);

void lines_answer(const fault *f);      /* to the line taken last */

uint32_t lines_free(void);              /* characters that the queue of lines has room for */

/* Lines since power-on. What may be the rest of a damaged frame counts with that. */
typedef struct {
    uint32_t accepted, refused;
} lines_counts;
lines_counts lines_count(void);
