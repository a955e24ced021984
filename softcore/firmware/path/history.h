// SPDX-License-Identifier: Apache-2.0
/* The history of the path: a ring that holds it in units of 16 bytes, and the way from there to the
   segments that the gateware distributes.

   A block, that is a programmed line or arc, takes one or two units; its number is that of its first
   unit, and counts on without end. The segments of a block are its pieces, one of a line. They are
   made anew each time they are asked for, and are always the same. An arc has to be made ready
   first, in many steps of some thousand clocks; two of them are kept, for the two sides of the
   window. What needs an arc takes one such step and says so: ask again. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "hal/hal.h"

/* Units remembered, a power of two; the build gives what the memory has room for. */
#ifndef PATH_RING
#define PATH_RING 8192
#endif
#define PATH_UNIT 16    /* bytes */

/* A segment of the path: piece `piece` of a block. */
typedef struct {
    uint32_t block, piece;
} path_place;

/* A segment. Its start and what the junction at its end asks for are up to the window. */
typedef struct {
    path_place at;
    int32_t start;              /* coordinate where it begins */
    uint32_t length, rate;      /* the rate at the front at most, */
    uint32_t bound;             /* ... and what its curve allows, 0 for no bound */
    bool tight;                 /* the highest speed is too much for its curve */
    bool corner;                /* the junction at its end is taken at the start/stop speed, */
    bool slows;                 /* or so only forward, because the next feed is lower */
    bool away;                  /* leads away from the work */
    int8_t way[HAL_AXES];       /* from its start to its end, 1/64 */
    int32_t from[HAL_AXES], to[HAL_AXES];   /* tangents at start and end of its block, 2**-15 */
} path_segment;

/* Forget all; the next block gets this number, and begins where the axes are told to be. */
void history_forget(uint32_t first);

uint32_t history_oldest(void);      /* number of the oldest block remembered, */
uint32_t history_next(void);        /* and of the next one to be appended */
bool history_empty(void);
bool history_has_room(void);        /* for any block */

/* Append a block, if there is room; returns its number. A line may be a rapid, and may lead away from
   the work. */
uint32_t history_append(const path_move *move, uint32_t rate, bool rapid, bool away);

/* Percentages of the rates of feed and rapids that segments are made with from now on; false if they are
   those of before. */
bool history_override(uint32_t feed, uint32_t rapid);

/* The rate of a block's segments, the override in it. */
uint32_t history_rate(uint32_t block);

/* Where the axes are told to be at the end of all that was appended. */
int32_t history_end(unsigned axis);

/* Put a line along one axis before the oldest block, while nothing has been appended yet. */
void history_prepend(unsigned axis, int32_t travel, uint32_t rate);

/* Path pulses of the oldest block; of an arc 0 until it has been made ready once. */
uint32_t history_oldest_length(void);
void history_drop(void);            /* forget it */

/* Is the block of a place ready? False after a step towards that. */
bool history_ready(path_place at);

/* Make the segment at a place; false after a step towards that. Leaves the window's part of `s`
   zero. */
bool history_make(path_place at, hal_segment *move, path_segment *s);

/* The next place on the path, of a segment that has just been made. */
path_place history_following(path_place at);

/* The one before; false after a step towards knowing it. */
bool history_preceding(path_place *at);
