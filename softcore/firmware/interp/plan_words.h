// SPDX-License-Identifier: Apache-2.0
/* What the parts of plan_block share: the block at work and how its words are taken. For plan*.c. */
#pragma once
#include "interp/plan.h"

#define AXIS_LETTERS (BLOCK_BIT('X') | BLOCK_BIT('Y') | BLOCK_BIT('Z'))

/* Groups of G codes: one of a group per block. The non-modal ones exclude each other as well. */
typedef enum {
    G_MOTION, G_ONCE, G_UNITS, G_DISTANCE, G_FEED, G_PLANE, G_WIRE, G_SYSTEM, G_GROUPS
} g_group;

typedef struct {
    const block *b;
    fault *f;
    plan *p;
    const modal *before;
    int16_t g[G_GROUPS];        /* tenths by group, -1 for none */
    uint32_t column[G_GROUPS];
    uint32_t free;              /* letters that nothing has used yet */
} context;

/* Use a letter of the block, if it is there. */
const word *take(context *c, char letter);

/* Of a word. */
bool distance(context *c, const word *w, char letter, int32_t *pulses);
bool speed(context *c, const word *w, char letter, uint32_t *um_per_min);

/* A whole number of a word, up to a limit; `what` says what it is. */
bool whole(context *c, char letter, uint32_t lowest, uint32_t highest, const char *what,
           uint32_t *value);

/* The block carries no motion and no word but these letters. */
bool alone(context *c, uint32_t allowed);

/* The gap is looked at before a pulse of the condition ends. */
bool seen_condition(context *c, const technology_row *row, uint32_t column);

/* The condition that a word names. */
bool find_condition(context *c, const word *w, const technology_row **row);

/* Of plan_retraction.c. */
bool plan_retraction(context *c, bool mdi, uint32_t highest_speed, unsigned jump_axis);
bool plan_defaults(context *c, uint32_t highest_speed);
bool plan_jump(context *c, uint32_t highest_speed);

/* Of plan_series.c. */
bool plan_series(context *c, unsigned jump_axis);

/* Of plan_path.c: where a block leads, in which frame, and on which side the wire goes. */
void select_system(modal *state, unsigned system);
bool plan_set_position(context *c);
bool enter_wire(context *c);
bool enter_system(context *c);
bool plan_plane(context *c);
bool plan_wire(context *c, bool mdi);
bool plan_move(context *c, uint32_t highest_speed, const travel_range *t);
