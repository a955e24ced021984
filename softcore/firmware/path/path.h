// SPDX-License-Identifier: Apache-2.0
/* The path: remembers where the machine came from and knows where it goes.

   The history keeps its blocks, the programmed lines and arcs. Segments are what the gateware
   distributes, a line or a piece of an arc: they are numbered along the path, and the gateware's slot
   of a segment is its number modulo HAL_SLOTS. The gateware holds a window of them on both sides of
   the machine, so that it can run forward and backward by itself; `path_step` moves the window after
   the machine, and makes the segments anew from their blocks. Before the first block stands a virtual
   one along the jump axis up to the soft limit, so that a sinker can retract from the path's first
   point. Coordinates count path pulses from that first point. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "hal/hal.h"

#define PATH_LEAD 56    /* units of the history appended but not yet entered by the machine */

void path_init(void);

/* Only while the outputs are safe: there is no path any more, nor anything of it that is damaged. */
void path_forget(void);

/* Begin a new path where the machine stands; the old one is forgotten. Only at rest, and with path
   pulses not allowed. */
void path_begin(void);

/* May a block be appended now? PATH_WAIT: when the machine has gone on. PATH_UNCOVERED: never, the
   memory of the path would not reach back over the retractable limit. */
typedef enum { PATH_ROOM, PATH_WAIT, PATH_UNCOVERED } path_room;
path_room path_has_room(void);

/* Append a move and grant it; returns the block's number. With the discharge off it may lead away from
   the work. */
uint32_t path_append(const path_move *move, uint32_t rate, bool rapid, bool discharge);

/* Percentages of every feed and every rapid from now on, in the segment at work as well: in force after
   a few steps. Retractions have speeds of their own. */
void path_override(uint32_t feed, uint32_t rapid);

/* The discharge goes off, or the electrode has `touched`: the work is where the segment in which the
   machine is leads to, unless it leads away itself. What touches before the machine has moved says
   nothing of that. */
void path_note_work(bool touched);

/* Put a retractable limit and a ceiling (machine frame) in force, only at the front. Looks back along
   the path in several calls: go on with path_bounds_step until it returns true. */
void path_set_bounds(uint32_t limit, bool ceiling, int32_t height);
bool path_bounds_step(void);

/* One step of housekeeping: at most one slot is written; true if there was something to do. */
bool path_step(void);

/* Everything granted has been machined and the machine rests at the front. */
bool path_at_front(void);

/* The machine is short of the end of what is loaded, in the segment where path_step has last seen it. */
bool path_goes_on(void);

/* The lower rate at which the front may be going now, if the path goes on; 0 if it does not, as far as
   it is loaded. */
uint32_t path_pace(void);

/* The machine has entered the segment in `slot` at the front: called for every one, in order. Returns
   the number of its block. */
uint32_t path_entered_slot(unsigned slot);

uint32_t path_next(void);           /* number of the next block to be appended */
uint32_t path_reached(void);        /* blocks with lower numbers have been entered */
uint32_t path_free(void);           /* units that may be appended before the machine goes on; of
                                       PATH_LEAD. A line takes one, an arc two */

/* Is the lowest point of a retraction given by the ceiling or the soft limit (and not by the
   beginning of the path)? */
bool path_has_back_limit(void);
