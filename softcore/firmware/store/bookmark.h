// SPDX-License-Identifier: Apache-2.0
/* Bookmark in the tape under way: its block, kept in the flash memory while the machine cuts, so that
   a power cut does not lose the place.

   It lies in a ring of sectors at the ends of the firmware slots, which no firmware reaches. A sector
   begins with a head, which has the whole bookmark; marks of 16 bytes follow, each with a later block
   of the same tape. Both have a check (CRC-32). Of the sectors with a sound head the one of the
   highest sequence number counts, and in it the last sound mark, or else the head. No place is
   programmed twice between two erases: what a power cut leaves of a mark is passed over.

   Layout, lowest byte first, words of 4 bytes. Head: sequence number, the members of `bookmark`, the
   check. Mark, from the byte 48 on: block, digest, the check, and 4 bytes unused.

   The next sector is erased when a tape has ended or a sector is full, so before it is needed; after
   power-on when it is needed. Each tape takes a sector, and another one for every 253 blocks. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef struct {
    uint32_t line;              /* the block under way, 0: no tape is under way */
    uint32_t digest;            /* of the tape up to this block, and of the state before it */
    uint32_t homed;             /* 1: the axes were homed when the tape began */
    int32_t start[HAL_AXES];    /* where the axes then stood, in the machine frame */
    int32_t zero[HAL_AXES];     /* where program zero then was, in the machine frame */
} bookmark;

/* Find what the memory holds. Call it when the journal is open. */
void bookmark_open(void (*between)(void));
const bookmark *bookmark_now(void);

/* Put another one in its place, which begins a sector; or another block into it. A change is written
   at most once in a second; the end of a tape (block 0) at once. */
void bookmark_put(const bookmark *other);
void bookmark_move(uint32_t line, uint32_t digest);

/* bookmark_waits: is there anything to be written? bookmark_step: do a step of it, at most some 3000
   clocks; true if another one can follow at once. Call it then at any time, also while the machine
   cuts, but only while nobody else has a command in the memory. */
bool bookmark_waits(void);
bool bookmark_step(void);
bool bookmark_holds(void);      /* the memory is at work for it: others have to wait */
bool bookmark_failed(void);     /* the memory does not take what is written; nothing more is */
