// SPDX-License-Identifier: Apache-2.0
/* The history of the path: a ring of units of 16 bytes, from which the segments for the gateware
   are made.

   A block is a programmed line or arc and takes one or two units. Its number is that of its first
   unit and counts up without end. The segments of a block are its pieces; a line is one segment. A
   segment is made anew each time it is asked for, and is always the same. An arc must first be made
   ready, in many steps of some thousand clocks. Two ready arcs are kept, for the two sides of the
   window. A function that needs an arc which is not ready does one such step and returns false:
   call it again. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "hal/hal.h"

#define PATH_UNIT 16    /* bytes */

/* A segment of the path: piece `piece` of a block. */
typedef struct {
    uint32_t block, piece;
} path_place;

/* A segment. path.c sets `start`; corners.c `corner`, `slows` and `turn`. */
typedef struct {
    path_place at;
    int32_t start;              /* coordinate where it begins */
    uint32_t length, rate;      /* path pulses; of the feed with the override, at most `bound` */
    uint32_t bound;             /* highest rate that its curve and its axes allow, 0 for no bound */
    bool tight;                 /* the highest speed is too much for its curve or an axis */
    bool corner;                /* the junction at its end is passed at the start/stop speed */
    bool slows;                 /* the same, but only forward, because the next feed is lower */
    uint32_t turn;              /* highest rate at the junction at its end, 0 for no bound */
    bool away;                  /* leads away from the work */
    int8_t way[HAL_AXES];       /* from its start to its end, 1/64 */
    int32_t from[HAL_AXES], to[HAL_AXES];   /* tangents at start and end of its block, 2**-15 */
} path_segment;

/* Forget all blocks. The next one gets this number and begins at the commanded position. */
void history_forget(uint32_t first);

uint32_t history_oldest(void);      /* number of the oldest block remembered */
uint32_t history_next(void);        /* number of the next block to be appended */
bool history_empty(void);
bool history_has_room(void);        /* for any block */

/* Append a block; returns its number. There must be room. `rapid`: the rate is that of rapids;
   `away`: a line that leads away from the work. */
uint32_t history_append(const path_move *move, uint32_t rate, bool rapid, bool away);

/* Set the percentages that scale the rates of feeds and rapids in segments made from now on; false
   if they have not changed. */
bool history_override(uint32_t feed, uint32_t rapid);

/* The rate of a block's segments, including the override. */
uint32_t history_rate(uint32_t block);

/* Commanded position of an axis at the end of all blocks. */
int32_t history_end(unsigned axis);

/* Put a line along one axis before the oldest block, while nothing has been appended yet. */
void history_prepend(unsigned axis, int32_t travel, uint32_t rate);

/* Path pulses of the oldest block. For an arc it is 0 until the arc has been made ready once. */
uint32_t history_oldest_length(void);
void history_drop(void);            /* forget the oldest block */

/* Is the block of a place ready? False: one step was done, call again. */
bool history_ready(path_place at);

/* Make the segment at a place. False: one step was done, call again. Leaves the members of `s` that
   it does not set at zero. */
bool history_make(path_place at, hal_segment *move, path_segment *s);

/* The next place on the path, after a segment that has just been made. */
path_place history_following(path_place at);

/* Go to the place before. False: one step was done, call again. */
bool history_preceding(path_place *at);
