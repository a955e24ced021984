// SPDX-License-Identifier: Apache-2.0
/* The meaning of a block: the modal state of a program, and what a block does. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/move.h"
#include "base/travel.h"
#include "gap/conditions.h"
#include "gap/in_force.h"
#include "interp/block.h"
#include "interp/retraction.h"

/* G00 to G03, or none of them. */
typedef enum { MODE_NONE, MODE_RAPID, MODE_FEED, MODE_CW, MODE_CCW } motion_mode;

#define PLAN_SYSTEMS 6      /* work offsets, G54 to G59 */
#define PLAN_WIRES 16       /* wire offsets, D0 to D15; D0 is always zero */
#define PLAN_NO_WIRE 255
#define PLAN_PLACES 2       /* G28 and G30 */

/* Modal state of a program. Positions are in pulses and belong to the programmed path, without the
   wire offset. Machine frame = program frame + offset. */
typedef struct {
    bool inch, incremental;
    motion_mode mode;
    uint32_t feed;                  /* um/min, 0: none yet */
    int32_t position[HAL_AXES];     /* machine frame, at the end of all planned motion */
    int32_t offset[HAL_AXES];       /* in force: the work offset plus that of G92 */
    uint8_t system;                 /* number of the work offset in force */
    move_plane plane;
    int8_t side;                    /* of the wire: 1 left of the path (G41), -1 right, 0 on it */
    uint8_t wire;                   /* number of its offset, PLAN_NO_WIRE before the first D */
    const condition_row *condition;
    bool machining;                 /* M03 is in force */
    uint8_t servo;                  /* feed mode of G95 P, 0 for G94 */
    uint8_t served;                 /* feed mode of the last motion */
    /* Only G10, G28.1, G30.1, G36, G37 and G38 change the members below. Two states with the same
       edition have the same values in them. */
    uint32_t edition;
    retraction_memory memory;
    retraction_jump jump;
    /* The members from here on outlive power-off: PLAN_KEPT words, as the journal has them. */
    int32_t systems[PLAN_SYSTEMS][HAL_AXES];    /* work offsets */
    int32_t places[PLAN_PLACES][HAL_AXES];  /* of G28 and G30, in the machine frame */
    int32_t wires[PLAN_WIRES];
    uint16_t wires_given;           /* bit by number */
    bool stored[PLAN_PLACES];
} modal;

#define PLAN_KEPT ((PLAN_SYSTEMS + PLAN_PLACES) * HAL_AXES + PLAN_WIRES + 1)
_Static_assert(offsetof(modal, systems) + PLAN_KEPT * 4 == offsetof(modal, stored) + PLAN_PLACES,
               "the kept members follow each other");

/* Copy a state. The members behind `edition` are skipped if both states have the same edition:
   copying them would take half the time of a short block. */
void plan_copy(modal *to, const modal *from);

/* Call when a member behind `edition` is about to change or has changed. */
void plan_edit(modal *state);

typedef enum {
    ACT_NONE, ACT_DWELL, ACT_RETRACTION, ACT_DEFAULTS, ACT_JUMP, ACT_SET_POSITION, ACT_TABLE,
    ACT_DEPTH_SERIES, ACT_PLANNED, ACT_TOUCH
} plan_act;

typedef enum { STOP_NONE, STOP_PROGRAM, STOP_OPTIONAL, STOP_END } plan_stop;

typedef struct {
    modal after;                    /* modal state when the block has been carried out */
    bool moves;
    bool here;                      /* it stores where the machine stands, which must be known */
    path_move move;
    uint32_t speed;                 /* um/min */
    bool rapid, corner_rapid;       /* the move, and the corner, have the rapid feed of G00 */
    bool corners;                   /* `corner` comes before the move: a corner or way point */
    path_move corner;
    uint32_t corner_speed;
    plan_act act;
    bool touch_needed;              /* of ACT_TOUCH: it is an alarm if it finds nothing */
    bool touch_away;                /* it looks for the end of contact */
    uint64_t dwell;                 /* clocks */
    bool acts_before, acts_after;   /* something waits for the front, before or after the motion */
    bool changes_condition;
    bool changes_servo;             /* to `after.served` */
    bool changes_frame;             /* to `after.offset` */
    unsigned class_number;          /* of ACT_TABLE: a class of the fluid, GAP_CLASSES for none */
    gap_class class_row;            /* its row */
    const condition_row *step_condition; /* of ACT_DEPTH_SERIES; 0 ends the series */
    int32_t step_depth;             /* its depth in the machine frame; of ACT_PLANNED: Z 0 */
    bool machining_on, machining_off;
    int32_t s, t;                   /* codes, -1 for none */
    int32_t m[BLOCK_CODES];         /* M codes for the machine side before the motion, -1 ends */
    bool fluid_off;                 /* M09, after the motion */
    plan_stop stop;
    int64_t name;                   /* program number, -1 for none */
    /* For interpreter_arc_step: the part of the judgement that comes next. */
    enum { ARC_NONE, ARC_RADIUS, ARC_CENTRE, ARC_TRAVEL } arc;
    int32_t radius;                 /* 1/64 pulse; negative for the longer of two arcs */
    uint16_t columns[HAL_AXES], arc_column; /* of the end point's words, and of centre or radius */
} plan;

/* Set the state in which a program starts: absolute, millimetres, G17, G54, no feed, no condition.
   Keeps the position, the work offsets, the places of G28 and G30, the offset of G92, the wire
   offsets and the MDI layer of the retraction memory. */
void plan_start(modal *state);

/* Begin the plan of a block: the state before it, and nothing else. */
void plan_begin(plan *p, const modal *state);

/* Put a work offset in force; the offset of G92 is still added to it. */
void plan_select_system(modal *state, unsigned system);

/* State of a judgement that takes several calls. */
typedef enum { PLAN_MORE, PLAN_DONE, PLAN_FAULT } plan_result;
