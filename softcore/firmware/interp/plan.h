// SPDX-License-Identifier: Apache-2.0
/* What a block means: the modal state of a program, and what is to be done for a block. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "base/travel.h"
#include "gap/conditions.h"
#include "gap/in_force.h"
#include "interp/block.h"
#include "interp/retraction.h"

/* G00 to G03 and none of them. */
typedef enum { MODE_NONE, MODE_RAPID, MODE_FEED, MODE_CW, MODE_CCW } motion_mode;

#define PLAN_SYSTEMS 6      /* work offsets, G54 to G59 */
#define PLAN_WIRES 16       /* wire offsets, D0 to D15; D0 is always nothing */
#define PLAN_NO_WIRE 255
#define PLAN_PLACES 2       /* G28 and G30 */

/* Modal state of a program. Positions in pulses, of the path as it is programmed, without the wire
   offset; machine = program + offset. */
typedef struct {
    bool inch, incremental;
    motion_mode mode;
    uint32_t feed;                  /* um/min, 0: none yet */
    int32_t position[HAL_AXES];     /* machine frame, at the end of what is planned */
    int32_t offset[HAL_AXES];       /* in force: the work offset, and G92 on top of it */
    uint8_t system;                 /* of the work offsets the one in force */
    move_plane plane;
    int8_t side;                    /* of the wire: 1 left of the path (G41), -1 right, 0 on it, */
    uint8_t wire;                   /* by this offset, PLAN_NO_WIRE before the first D */
    const condition_row *condition;
    bool machining;                 /* M03 is in force */
    uint8_t servo;                  /* law of G95, 0 for G94 */
    uint8_t served;                 /* ... that the last motion was under */
    /* What only G10, G28.1, G30.1, G36, G37 and G38 change. States of the same edition have the
       same. */
    uint32_t edition;
    int32_t systems[PLAN_SYSTEMS][HAL_AXES];    /* work offsets */
    uint16_t wires_given;           /* bit by number */
    int32_t wires[PLAN_WIRES];
    retraction_memory memory;
    retraction_jump jump;
    int32_t places[PLAN_PLACES][HAL_AXES];  /* of G28 and G30, in the machine frame */
    bool stored[PLAN_PLACES];
} modal;

/* Copy a state. What follows the edition is skipped if both have the same: copying it would take half
   the time of a short block. */
void plan_copy(modal *to, const modal *from);

/* Something behind the edition is going to change, or has. */
void plan_edit(modal *state);

typedef enum {
    ACT_NONE, ACT_DWELL, ACT_RETRACTION, ACT_DEFAULTS, ACT_JUMP, ACT_SET_POSITION, ACT_TABLE,
    ACT_DEPTH_SERIES, ACT_PLANNED
} plan_act;

typedef enum { STOP_NONE, STOP_PROGRAM, STOP_OPTIONAL, STOP_END } plan_stop;

typedef struct {
    modal after;                    /* modal state when the block has been carried out */
    bool moves;
    path_move move;
    uint32_t speed;                 /* um/min */
    bool rapid, corner_rapid;       /* ... and that of the corner, are those of G00 */
    bool corners;                   /* before the move goes round a corner, or over a point (G28): */
    path_move corner;
    uint32_t corner_speed;
    plan_act act;
    uint64_t dwell;                 /* clocks */
    bool acts_before, acts_after;   /* something waits for the front, before or after the motion */
    bool changes_condition;
    bool changes_servo;             /* to `after.served` */
    bool changes_frame;             /* to `after.offset` */
    unsigned class_number;          /* of ACT_TABLE, */
    gap_class class_row;            /* and its row; GAP_CLASSES for none */
    const condition_row *step_condition; /* of ACT_DEPTH_SERIES: the step's condition, 0 for the end, */
    int32_t step_depth;           /* and its depth, machine frame; of ACT_PLANNED: Z 0 */
    bool machining_on, machining_off;
    int32_t s, t;                   /* codes, -1 for none */
    int32_t m[BLOCK_CODES];         /* M codes for the machine side before the motion, -1 ends */
    bool fluid_off;                 /* M09, after the motion */
    plan_stop stop;
    int64_t name;                   /* program number, -1 for none */
    /* Of an arc that interpreter_arc_step has not done with. */
    enum { ARC_NONE, ARC_RADIUS, ARC_CENTRE, ARC_TRAVEL } arc;
    int32_t radius;                 /* 1/64 pulse; below zero for the longer of two arcs */
    uint16_t columns[HAL_AXES], arc_column; /* words of the end point, and of centre or radius */
} plan;

/* State in which a program starts: absolute, millimetres, G17, G54, nothing else said; keeps position,
   work offsets, places of G28 and G30, what G92 has set, wire offsets and the MDI layer of the retraction memory. */
void plan_start(modal *state);

/* Put a work offset in force; what G92 has set stays on top. */
void plan_select_system(modal *state, unsigned system);

/* How a judgement in several calls stands. */
typedef enum { PLAN_MORE, PLAN_DONE, PLAN_FAULT } plan_result;
