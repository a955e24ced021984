// SPDX-License-Identifier: Apache-2.0
/* Data of an arc while it is cut into pieces; see arc.h. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fixed.h"
#include "base/move.h"

/* Below this radius (pulses) an arc is a chain of single steps, at most ARC_CHAIN of them. */
#define ARC_LEAST_RADIUS 32
#define ARC_CHAIN 352

/* Border between two pieces: its place, and the curve's tangent there. */
typedef struct {
    int32_t at[2];          /* from the start, pulses; see `start` of an arc for the second axis */
    int64_t square[2];      /* of the radius, fine pulses, where the curve passes `at` of an axis */
    uint32_t length;        /* path pulses from the start */
    int32_t tangent[2];     /* magnitude on each axis of the plane, 2**-30 */
} arc_border;

/* The exact curve at a border. */
typedef struct {
    int64_t at[2];              /* from the centre */
    int64_t radius, square;
    int64_t tangent[2];         /* 2**-30 */
    int64_t plane;              /* path length in the plane */
} arc_ideal;

/* The phases of arc_prepare; each takes some thousand clocks. */
typedef enum {
    ARC_RADII, ARC_START_ANGLE, ARC_SWEEP, ARC_TANGENTS, ARC_DIVISOR,
    ARC_CHOOSE_STEP, ARC_MAKE_STEP, ARC_CHAIN_LENGTH,   /* a chain of single steps */
    ARC_PLANE_DIVISOR, ARC_PIECES, ARC_NEAR_START, ARC_NEAR_END, ARC_ROLES   /* pieces */
} arc_phase;

typedef struct {
    arc_phase phase;
    path_move move;
    unsigned axis[3];           /* first and second axis of the plane, and the third axis */
    int32_t start[2], end[2];   /* from the centre, fine pulses; a clockwise arc has the sign of its
                                   second axis turned, which makes every arc counter-clockwise */
    int32_t to[2];              /* from start to end, pulses, with the same sign */
    int64_t square[2];          /* of the radius at start and end */
    int64_t radius[2];
    int64_t angle, sweep;       /* angle of the start, and from there to the end */
    int64_t lead[2];            /* angle by which the tangent turns outwards, at start and end */
    int64_t slope;              /* growth of the radius along the arc, 2**-30 */
    int64_t bend, turn;         /* angle of the tangent at the start, and by how much it turns */
    fixed_divisor by_turn, by_plane;
    int64_t plane, total;       /* length in the plane, and with the third axis */
    uint32_t length;            /* path pulses */
    unsigned parts;             /* the tangent turns by 45 degrees in 2**parts pieces */
    uint32_t first, pieces;     /* number of the first border, in multiples of a piece's turn */
    arc_border memo[2];         /* the two borders calculated last */
    uint32_t memo_of[2];        /* and their numbers */
    /* The border being calculated: */
    arc_border half;
    arc_ideal ideal;
    uint32_t half_of;           /* its number */
    unsigned tried, tries;      /* places tried so far (a bit for each), and their number */
    unsigned steps_done;        /* of the present try */
    arc_border candidate, best; /* of the present try, and the best one so far */
    int64_t lacks;              /* change of the square that the candidate needs, in error units */
    int64_t path, off;          /* of the best: path length, and how far that is from a whole one */
    unsigned room;              /* pulses by which a border may be moved */
    /* A chain of single steps: */
    bool chain;
    int64_t done;               /* angle up to the last step */
    int64_t reached;            /* angle of the last step's place */
    int8_t steps[ARC_CHAIN][2];
    int16_t place[2];           /* of the last step, pulses from the start */
} arc;
