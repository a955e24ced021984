// SPDX-License-Identifier: Apache-2.0
/* The path: where the machine came from and where it goes.

   The history keeps the blocks of the path, programmed lines and arcs. The gateware distributes
   segments: a line, or a piece of an arc. Segments are numbered along the path, and the gateware's
   slot of a segment is its number modulo HAL_SLOTS. The gateware holds a window of segments on both
   sides of the machine, so that it can run forward and backward by itself. `path_step` moves the
   window along with the machine, and makes the segments anew from their blocks. A virtual block
   precedes the first one: it goes along the jump axis up to the soft limit, so that a sinker can
   retract from the path's first point. Coordinates count path pulses from that first point. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "hal/hal.h"

#define PATH_LEAD 56    /* most units of the history that are appended but not yet entered */

void path_init(void);

/* Forget the path, and with it any damage in its registers. Only while the outputs are safe. */
void path_forget(void);

/* Forget the path and begin a new one where the machine stands. Only at rest, while path pulses are
   not allowed. */
void path_begin(void);

/* May a block be appended now? PATH_WAIT: only after the machine has moved on. PATH_UNCOVERED:
   never, because the remembered path would no longer cover the retractable limit. */
typedef enum { PATH_ROOM, PATH_WAIT, PATH_UNCOVERED } path_room;
path_room path_has_room(void);

/* Append a move, which the machine then carries out; returns the block's number. With the discharge
   off, it is marked if it leads away from the work. */
uint32_t path_append(const path_move *move, uint32_t rate, bool rapid, bool discharge);

/* How far back from the front the machine can go along the path: to the oldest point remembered, or
   to the back limit. */
uint32_t path_remembered(void);

/* Remember at least so much of the path behind the front, until it is 0 or the path is forgotten. */
void path_keep(uint32_t distance);

/* Scale every feed and every rapid by these percentages, also in the present segment: in force
   after a few steps. Retractions have speeds of their own. */
void path_override(uint32_t feed, uint32_t rapid);

/* Call when the discharge goes off, or when the electrode has `touched`. The present segment's
   direction is then taken as the one to the work, unless the segment leads away from it. A touch
   before the machine has moved in the segment says nothing about its direction and is ignored. */
void path_note_work(bool touched);

/* Call when a touch-off has found the work. The present segment's direction is then taken as the one
   to it, whatever it was: that to the other side of a hole leads away from the first. */
void path_note_touch(void);

/* Put a retractable limit and a ceiling (machine frame) in force. Only at the front. The search
   back along the path takes several calls: call path_bounds_step until it returns true. */
void path_set_bounds(uint32_t limit, bool ceiling, int32_t height);
bool path_bounds_step(void);

/* One step of housekeeping: at most one slot is written; true if there was something to do. */
bool path_step(void);

/* Have all blocks been carried out, and does the machine rest at the front? */
bool path_at_front(void);

/* Can the machine move on without path_step? It has not reached the end of the loaded segments, and
   is still in the segment where path_step saw it last. */
bool path_goes_on(void);

/* Does it still, if nothing has been done since path_goes_on was true? Quick. */
bool path_goes_further(void);

/* The rate of the present segment; 0 if the machine is at the end of the loaded segments. */
uint32_t path_pace(void);

/* Call for each segment that the machine has entered at the front, in order, with its slot. Returns
   the number of its block. */
uint32_t path_entered_slot(unsigned slot);

/* The block within which the machine stands, if it is the one of the front; else 0, as after a retraction
   to an earlier one. Of an arc of many pieces only the last ones count. */
uint32_t path_within(void);

uint32_t path_next(void);           /* number of the next block to be appended */
uint32_t path_reached(void);        /* all blocks with lower numbers have been entered */
uint32_t path_free(void);           /* units that may be appended before the machine moves on, at
                                       most PATH_LEAD; a line takes one, an arc two */

/* Is the back limit, the furthest point that a retraction may reach, set by the ceiling or the soft
   limit (true), or by the beginning of the path (false)? */
bool path_has_back_limit(void);
