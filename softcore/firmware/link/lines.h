// SPDX-License-Identifier: Apache-2.0
/* Lines that come over the link. A line is judged when it ends, kept until it is taken, and
   answered in turn. Each line has one answer. A line is either carried out as it was sent, or
   refused as a whole.

   A numbered line, `@17 text*5A3C`, is refused unless its check is right and its number is the next
   one. One of the last 64 that comes again, with the same check, gets the same answer again. The
   first numbered line guards the link until a reset: lines without a number are then refused. On a
   link without guard, a plain line is accepted unless a part of it may be missing.

   Orders ($RESUME, $RETRACT) are carried out when they end, before the lines that wait. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define LINES_LONGEST 255   /* characters of a line's text */
#define LINES_CHECK 5       /* of '*' and the digits behind it */

void lines_init(void);                  /* at power-on */
void lines_restart(void);               /* forget all lines, and end the guard */
bool lines_guarded(void);
bool lines_whole(void);                 /* the next byte is not the middle of a line or frame */

/* Take a character. LINES_MORE: part of a line. LINES_ENDED: end of a line. LINES_ANSWERED: end of
   a line that was answered at once. LINES_RESUME, LINES_RETRACT: an order to be carried out now;
   then call lines_ordered. */
typedef enum { LINES_MORE, LINES_ENDED, LINES_ANSWERED, LINES_RESUME, LINES_RETRACT } lines_part;
lines_part lines_byte(uint8_t byte);
void lines_ordered(const fault *f);     /* answer the order */
bool lines_order(void);                 /* the text received so far is a complete order */
void lines_damaged(unsigned mark);      /* the receiver saw an error here: a MARK of regs.h */
void lines_cut(void);                   /* a frame begins here */
void lines_frame_good(void);            /* it was received whole */
void lines_frame_bad(void);             /* it was damaged: its remainder is still to come */
void lines_frame_end(void);             /* an unrecognised frame or a remainder ends here */
void lines_frame_stalled(void);         /* it stopped half-way: it may have been part of a line */
void lines_quiet(void);                 /* nothing has come for a while */

/* Take the next line, of `length` characters (LINES_TEXT), or answer the next refused one
   (LINES_REFUSED). */
#define LINES_TEXT_SIZE (LINES_LONGEST + LINES_CHECK)
typedef enum { LINES_NONE, LINES_TEXT, LINES_REFUSED } lines_kind;
lines_kind lines_take(char text[LINES_TEXT_SIZE], uint32_t *length);

/* An alarm came: the lines that wait, and the one that is being received, are refused. */
void lines_alarm(void);

bool lines_wait(void);                  /* a line waits to be taken */
uint64_t lines_ended(void);             /* clock at which the last good line ended */

void lines_answer(const fault *f);      /* to the line taken last */

uint32_t lines_free(void);              /* characters that the queue of lines has room for */

/* Lines since power-on. What may be the remainder of a damaged frame counts with that frame. */
typedef struct {
    uint32_t accepted, refused;
} lines_counts;
lines_counts lines_count(void);
