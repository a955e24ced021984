// SPDX-License-Identifier: Apache-2.0
/* The path: a ring of segments that remembers where the machine came from and knows where it goes.

   Segments are numbered in order; the gateware's slot of a segment is its number modulo 16. The
   gateware holds a window of the ring on both sides of the machine, so that it can run forward and
   backward by itself; `path_step` moves the window after the machine. Before the first segment stands
   a virtual one along the jump axis up to the soft limit, so that a sinker can retract from the
   path's first point. Coordinates count path pulses from that first point. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal.h"

#define PATH_RING 256   /* segments remembered; a power of two */
#define PATH_LEAD 24    /* segments appended but not yet entered by the machine */

typedef struct {
    int32_t start;              /* coordinate where the segment begins */
    hal_segment move;
    int32_t floor;              /* lowest coordinate that the ceiling allows from this segment on */
    bool corner;                /* the junction at its end is taken at the start/stop speed, */
    bool slows;                 /* or so only forward, because the next feed is lower */
} path_segment;

void path_init(void);

/* Begin a new path where the machine stands; the old one is forgotten. Only at rest, and with path
   pulses not allowed. */
void path_begin(void);

/* May a segment be appended now? PATH_WAIT: when the machine has gone on. PATH_UNCOVERED: never, the
   memory of the path would not reach back over the retractable limit. */
typedef enum { PATH_ROOM, PATH_WAIT, PATH_UNCOVERED } path_room;
path_room path_has_room(void);

/* Append a move and grant it; returns its number. */
uint32_t path_append(const int32_t delta[HAL_AXES], uint32_t rate);

/* Put a retractable limit and a ceiling (machine frame) in force, only at the front. Looks back along
   the path in several calls: go on with path_bounds_step until it returns true. */
void path_set_bounds(uint32_t limit, bool ceiling, int32_t height);
bool path_bounds_step(void);

/* One step of housekeeping: at most one slot is written; true if one was. */
bool path_step(void);

/* Everything granted has been machined and the machine rests at the front. */
bool path_at_front(void);

/* The machine has entered the segment in `slot`; returns its number. */
uint32_t path_entered_slot(unsigned slot);

uint32_t path_next(void);           /* number of the next segment to be appended */
uint32_t path_reached(void);        /* segments with lower numbers have been entered */

/* Is the lowest point of a retraction given by the ceiling or the soft limit (and not by the
   beginning of the path)? */
bool path_floor_is_limit(void);
