// SPDX-License-Identifier: Apache-2.0
/* The wire offset (G40, G41, G42): turns the programmed path into the path of the machine.

   The machine's path lies to the left (G41) or right (G42) of the programmed one by the offset, in
   the plane in force; the third axis is not changed. The end of a move depends on the next move, so
   a move is held until the next one is known. One block without motion in the plane may be held
   with it; its functions act at the corner.

   * The first motion in the plane with G41 or G42 must be a line: it leads to the point beside the
     start of the next move. The first one after G40 must be a line too: it leads from the point
     beside the end of the move before to its own end.
   * Inside a corner the path changes from one offset curve to the other where they meet. Outside it
     goes round the corner in an arc with the offset as its radius; with an offset below 4 pulses,
     in a line. Where the ends of the offset curves are at most two pulses apart in each axis, as at
     tangents, they are joined midway. If a move goes straight back beside the one before (a cusp),
     the curvatures of the two decide which side is the inside.
   * It is an error if the curves do not meet on the remainders of both moves, if the radius of an
     arc would fall below 4 pulses, or if two blocks in a row have no motion in the plane. Only
     neighbouring moves are compared: a slot narrower than the wire is not found if its walls are
     not neighbours. */
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

/* Modal state after all blocks taken, including held ones; `executed` if no block is held. */
const modal *wire_offset_state(const modal *executed);

/* Take a judged block. The block and its text must stay until wire_offset_next has returned 0.
   False with a fault if the block cannot follow the ones before. Then call wire_offset_step until
   it is done. */
bool wire_offset_take(plan *p, const char *text, uint32_t length, uint32_t line, uint32_t number,
                      fault *f);
bool wire_offset_ready(void); /* wire_offset_step has nothing to do */
plan_result wire_offset_step(const travel_range *t, fault *f);

/* The next block to be carried out; 0: take another one. */
const wire_offset_block *wire_offset_next(void);
