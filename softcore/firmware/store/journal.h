// SPDX-License-Identifier: Apache-2.0
/* Journal in a ring of sectors of the flash memory: keeps the state of the machine over power-off.

   The state has several kinds, such as settings and offsets. A record holds everything of one kind.
   The newest complete record of a kind is in force. A record takes one page or more, each with its
   own check (CRC-32). No page is programmed twice between two erases.

   Layout of a page, lowest byte first: sequence number of the record (4 bytes); kind; number of this
   page in the record; number of pages of the record; number of words in this page (1 byte each); the
   mark GKJ1 (4 bytes); the words; the check (4 bytes).

   When a sector is full, the next one is erased, and a record of every kind is written into it. Its
   first page is written last and makes it the present sector. So at any cut of the power there is a
   sector with complete records of all kinds; a record that was cut leaves the one before it in force.

   Wear: a sector has 15 pages for records. The records of all kinds take 4 to 12 of them, so at least
   3 are left for changes, which take 1 to 6 pages each. A ring of 16 sectors that bear 100 000 erases
   takes 4.8 million pages of changes. The largest change takes a sector: 1.6 million of them, or one
   every 5 minutes for 15 years. A change that leaves the state as it is kept is not written. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define JOURNAL_KINDS 4
#define JOURNAL_PART 60u        /* most words of the state in a page */

/* Functions of the module that owns the state. `pages`: number of pages that a kind takes now, at
   least 1. `fill`: writes the words of one of these pages, at most JOURNAL_PART, and returns their
   number. */
typedef struct {
    unsigned (*pages)(unsigned kind);
    unsigned (*fill)(unsigned kind, unsigned page, uint32_t *part);
} journal_source;

typedef enum {
    JOURNAL_KEEPS,
    JOURNAL_NONE,               /* no known memory answers */
    JOURNAL_UNREADABLE,         /* the region is not empty, but lacks a complete record of a kind */
    JOURNAL_FAILED              /* the memory does not take what is written; the journal has ended */
} journal_state;

/* Find the newest records. This takes long, so `between` is called again and again meanwhile. */
journal_state journal_open(const journal_source *source, void (*between)(void));
journal_state journal_now(void);

/* Read a part of the newest record of a kind, in place until the next call of the journal; a null
   pointer if there is none. `count` is its words. Call it before journal_begin. */
const uint32_t *journal_load(unsigned kind, unsigned part, unsigned *count);

/* Call when the state has been loaded. From then on only changes against it are written. */
void journal_begin(void (*between)(void));

/* Call when a kind may have changed. It is written after a quarter of a second without changes. */
void journal_note(unsigned kind);

/* Has it a command or a write in the memory? Others then have to wait, and journal_step goes on. */
bool journal_holds(void);

/* journal_waits: is there anything to be written? journal_step: do a step of it, at most some 3000
   clocks; true if another one can follow at once. Without journal_holds call journal_step only while
   the machine may be disturbed. A record may stay half written for any time. */
bool journal_waits(void);
bool journal_step(void);
