// SPDX-License-Identifier: Apache-2.0
/* What is kept of an arc while it is worked out; see arc.h. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fixed.h"
#include "base/move.h"

/* Below this radius (pulses) an arc is a chain of single steps, at most so many. */
#define ARC_LEAST_RADIUS 32
#define ARC_CHAIN 352

/* Border between two pieces: the place there, and the curve's tangent. */
typedef struct {
    int32_t at[2];          /* from the start, pulses by axis of the plane, second one turned */
    int64_t square[2];      /* of the radius, fine pulses, where the curve passes `at` of an axis */
    uint32_t length;        /* path pulses from the start */
    int32_t tangent[2];     /* magnitude by axis of the plane, 2**-30 */
} arc_border;

/* The curve at a border. */
typedef struct {
    int64_t at[2];              /* from the centre */
    int64_t radius, square;
    int64_t tangent[2];         /* 2**-30 */
    int64_t plane;              /* path length in the plane */
} arc_ideal;

/* What is to be worked out next; each takes some thousand clocks. */
typedef enum {
    ARC_RADII, ARC_START_ANGLE, ARC_SWEEP, ARC_TANGENTS, ARC_DIVISOR,
    ARC_CHOOSE_STEP, ARC_MAKE_STEP, ARC_CHAIN_LENGTH,   /* a chain of single steps */
    ARC_PLANE_DIVISOR, ARC_PIECES, ARC_NEAR_START, ARC_NEAR_END, ARC_ROLES   /* pieces */
} arc_phase;

typedef struct {
    arc_phase phase;
    path_move move;
    unsigned axis[3];           /* first and second of the plane, third */
    int32_t start[2], end[2];   /* from the centre, fine; a clockwise arc has its second axis turned */
    int32_t to[2];              /* end from the start, pulses, second axis turned likewise */
    int64_t square[2];          /* of the radius at start and end */
    int64_t radius[2];
    int64_t angle, sweep;       /* at the start; to the end */
    int64_t lead[2];            /* by which the tangent turns outwards, at start and end */
    int64_t slope;              /* change of the radius along the arc, 2**-30 */
    int64_t bend, turn;         /* angle of the tangent at the start, and by how much it turns */
    fixed_divisor by_turn, by_plane;
    int64_t plane, total;       /* length in the plane, and with the third axis */
    uint32_t length;            /* path pulses */
    unsigned parts;             /* pieces between two turns of the tangent by 45 degrees: 2**parts */
    uint32_t first, pieces;     /* number of the first border in multiples of that angle */
    arc_border memo[2];
    uint32_t memo_of[2];
    arc_border half;            /* a border half worked out, */
    arc_ideal ideal;
    uint32_t half_of;           /* and its number; */
    unsigned tried, tries;      /* where the axes change their roles, places tried for it (a set), */
    unsigned steps_done;        /* ... for the next one, */
    arc_border candidate, best; /* it and the best of them, */
    int64_t lacks;              /* what it lacks, units of the error */
    int64_t path, off;          /* its path length, and what that is off */
    unsigned room;              /* pulses by which borders between may be moved */
    bool chain;                 /* ... a chain of single steps */
    int64_t done;               /* angle behind the last step of the chain */
    int64_t reached;
    int8_t steps[ARC_CHAIN][2];
    int16_t place[2];           /* of the last step, pulses from the start */
} arc;
