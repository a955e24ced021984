// SPDX-License-Identifier: Apache-2.0
/* What a block means: checks it completely and says what is to be done, without doing anything.
   So a block with an error moves nothing, and `tape check` uses the very same judgement. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "block.h"
#include "gap.h"
#include "retraction.h"
#include "technology.h"

typedef enum { MODE_NONE, MODE_RAPID, MODE_FEED } motion_mode;

/* Modal state of a program. Positions in pulses; machine = program + offset. */
typedef struct {
    bool inch, incremental;
    motion_mode mode;
    uint32_t feed;                  /* um/min, 0: none yet */
    int32_t position[HAL_AXES];     /* machine frame, at the end of what is planned */
    int32_t offset[HAL_AXES];
    retraction_memory memory;
    retraction_jump jump;
    const technology_row *condition;
    bool machining;                 /* M03 is in force */
    uint8_t servo;                  /* law of G95, 0 for G94 */
    uint8_t served;                 /* ... that the last motion was under */
} modal;

typedef enum {
    ACT_NONE, ACT_DWELL, ACT_RETRACTION, ACT_DEFAULTS, ACT_JUMP, ACT_SET_POSITION, ACT_TABLE
} plan_act;

typedef enum { STOP_NONE, STOP_PROGRAM, STOP_OPTIONAL, STOP_END } plan_stop;

typedef struct {
    modal after;                    /* modal state when the block has been carried out */
    bool moves;
    int32_t delta[HAL_AXES];
    uint32_t speed;                 /* um/min */
    plan_act act;
    uint64_t dwell;                 /* clocks */
    bool acts_before, acts_after;   /* something waits for the front, before or after the motion */
    bool changes_condition;
    bool changes_servo;             /* to `after.served` */
    unsigned class_number;          /* of ACT_TABLE, */
    gap_class class_row;            /* and its row; GAP_CLASSES for none */
    bool machining_on, machining_off;
    int32_t s, t;                   /* codes, -1 for none */
    int32_t m[BLOCK_CODES];         /* M codes for the machine side before the motion, -1 ends */
    bool fluid_off;                 /* M09, after the motion */
    plan_stop stop;
    int64_t name;                   /* program number, -1 for none */
} plan;

/* State in which a program starts: absolute, millimetres, nothing else said; keeps position, frame
   and the MDI layer of the retraction memory. */
void plan_start(modal *state);

/* Judge a block. `mdi`: G36 fills the MDI layer. Without the limits of a machine (`tape check`),
   pass its defaults. */
bool plan_block(const block *b, const modal *state, bool mdi, uint32_t highest_speed,
                int32_t soft_limit, unsigned jump_axis, plan *p, fault *f);
