// SPDX-License-Identifier: Apache-2.0
/* Tape reader: punched bytes in, blocks of text out.

   The leader is ignored until a start code (ISO `%`, EIA ER) followed by an end of block, which
   shows whether the tape is ISO or EIA. A block of data before that means that the start code is
   missing or damaged. The tape is then refused: otherwise a second program further on could run in
   its place. From the start code on, every byte must have the right parity (TH) and be in the code,
   comments included. With TV every block must have an even number of characters, blanks not
   counted.

   Ref: ISO 840 / EIA RS-358 (even parity); EIA RS-244-B (odd parity). */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define READER_BLOCK_SIZE 256   /* characters of a block, its end not counted */
#define READER_DELETED '\x7f'   /* a deleted character: counts as a column, has no meaning */

typedef enum { READER_MORE, READER_BLOCK, READER_FAULT, READER_ENDED } reader_result;

typedef struct {
    enum { READ_LEADER, READ_DATA, READ_STOPPED } state;
    bool eia;
    bool tv;
    uint32_t line;      /* of the block being read; the start code stands on line 1 */
    uint32_t column;    /* bytes of the block so far */
    uint32_t counted;   /* those of them that TV counts */
    uint32_t length;    /* of `text` */
    char text[READER_BLOCK_SIZE];
    /* Of the leader: */
    uint8_t before, before_that;    /* the last two bytes */
    bool iso_data, eia_data;        /* all bytes since the last end of block are in this code */
    uint32_t run;                   /* number of these bytes, blanks not counted */
    uint32_t leader_bytes;
} reader;

void reader_begin(reader *r, bool tv);

/* Take one byte. READER_BLOCK: `text` holds the block of `line`; call reader_next before the next
   byte. READER_FAULT: `f` says what and where. */
reader_result reader_byte(reader *r, uint8_t byte, fault *f);
void reader_next(reader *r);

/* Call after the end word: everything after it on the tape is ignored. */
void reader_stop(reader *r);

/* Call when there are no more bytes. False with a fault unless the end word has been read. */
bool reader_finish(reader *r, fault *f);
