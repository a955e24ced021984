// SPDX-License-Identifier: Apache-2.0
/* Journal in a ring of sectors of the flash memory: keeps the state of the machine over power-off.

   The state has kinds. A record has one kind, whole; the newest whole record of a kind counts. It
   takes one page or several, each with its own check (CRC-32), and no page is programmed twice. A
   page: sequence number of its record (4 bytes), kind, number of the page in the record, pages of the
   record, words of its part of the state, the mark GKJ1, this part, the check (4 bytes); the lowest
   byte first.

   When a sector is full, the next one is erased and gets a record of every kind. Its first page,
   written last, then makes it the present one. So there is always a sector with whole records of all
   kinds, whenever the power is cut, and a cut record leaves the one before it in force.

   Wear: a sector has 15 pages for records. A change takes 1 to 4 of them, and a new sector 4 to 10
   for all kinds; so at least 5 pages of changes go into a sector. In a ring of 16 sectors that may be
   erased 100 000 times this is 8 million pages: 2 million of the largest changes, or one every 5
   minutes for 19 years, day and night. An equal value is not written again. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define JOURNAL_KINDS 4
#define JOURNAL_PART 60u        /* most words of the state in a page */

/* Whoever owns the state: how many pages does a kind take now, at least 1, and what is in one of
   them? `fill` writes at most JOURNAL_PART words and returns their number. */
typedef struct {
    unsigned (*pages)(unsigned kind);
    unsigned (*fill)(unsigned kind, unsigned page, uint32_t *part);
} journal_source;

typedef enum {
    JOURNAL_KEEPS,
    JOURNAL_NONE,               /* no known memory answers */
    JOURNAL_UNREADABLE,         /* something is in the region, but no whole record of every kind */
    JOURNAL_FAILED              /* the memory does not take what is written; the journal has ended */
} journal_state;

/* Find the newest records. Takes long, so `between` is called between the parts. */
journal_state journal_open(const journal_source *source, void (*between)(void));
journal_state journal_now(void);

/* Read a part of the newest record of a kind, in place until the next call of the journal; a null
   pointer if there is none. `count` is its words. Call it before journal_begin. */
const uint32_t *journal_load(unsigned kind, unsigned part, unsigned *count);

/* The state is as loaded: only what differs from it is written from now on. */
void journal_begin(void (*between)(void));

/* A kind may have changed. It is written when nothing has changed for a quarter of a second. */
void journal_note(unsigned kind);

/* Is there work? And a step of it, which takes some 3000 clocks at most; true if more can be done
   at once. Call it only while the machine may be disturbed; a record waits half written without
   harm. */
bool journal_waits(void);
bool journal_step(void);
