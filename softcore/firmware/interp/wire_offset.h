// SPDX-License-Identifier: Apache-2.0
/* The wire offset (G40, G41, G42): between what a program says and what the machine does.

   The path goes beside the programmed one, by the offset to the left (G41) or right (G42) in the
   plane in force; the third axis is not changed. How a move ends depends on the next one, so a move
   is held until that is known, and with it one block without motion in the plane, whose functions
   act at the corner.

   * The first motion in the plane with G41 or G42 must be a line: it leads to the point beside the
     start of the next move. The first one after G40 must be a line too: it leads from the point
     beside the end of the move before to its own end.
   * Inside a corner the path ends and begins where the two offset curves meet. Outside it goes round
     the corner in an arc of the offset, or of less than 4 pulses in a line. Where the ends of the
     offset curves are at most two pulses apart in each axis, as at tangents, they are joined midway.
     A move that goes straight back beside the one before is inside or outside by how they bend apart.
   * It is an error if they do not meet on what is left of both moves, if an arc would keep a radius of
     less than 4 pulses, or if two blocks in a row have no motion in the plane. Only neighbours are
     looked at: a slot narrower than the wire is not found if its walls are not neighbours. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/plan.h"

typedef struct {
    const plan *p;
    const char *text;
    uint32_t length;            /* 0 for a block without words */
    uint32_t line, number;      /* number of the N word, 0 for none */
} wire_offset_block;

void wire_offset_reset(void);

/* Modal state after all blocks taken, of which some may be held; `executed` if none is. */
const modal *wire_offset_state(const modal *executed);

/* Take a judged block; it and its text must stay until wire_offset_next has returned 0. False with a
   fault if it cannot follow. Then call wire_offset_step until it is done: each call takes its time. */
bool wire_offset_take(plan *p, const char *text, uint32_t length, uint32_t line, uint32_t number,
                      fault *f);
bool wire_offset_ready(void); /* wire_offset_step has nothing to do */
plan_result wire_offset_step(const travel_range *t, fault *f);

/* The next block to be carried out; 0: take another one. */
const wire_offset_block *wire_offset_next(void);
