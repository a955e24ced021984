// SPDX-License-Identifier: Apache-2.0
/* What the parts of the interpreter share: the block at work, and how its words are taken. Of the
   functions each that returns false has noted a fault. */
#pragma once
#include "interp/block.h"
#include "interp/plan.h"

#define AXIS_LETTERS (BLOCK_BIT('X') | BLOCK_BIT('Y') | BLOCK_BIT('Z'))

/* Groups of G codes: one of a group per block. The non-modal ones exclude each other as well. */
typedef enum {
    G_MOTION, G_ONCE, G_UNITS, G_DISTANCE, G_FEED, G_PLANE, G_WIRE, G_SYSTEM, G_FRAME, G_GROUPS,
    G_SILENT    /* changes nothing on this machine, and stands beside any other */
} g_group;

typedef struct {
    const block *b;
    fault *f;
    plan *p;
    const modal *before;
    int16_t g[G_GROUPS];        /* tenths by group, -1 for none */
    uint32_t column[G_GROUPS];
    uint32_t free;              /* letters that nothing has used yet */
    bool blending;              /* G64, which may bring P and Q */
} context;

/* Use a letter of the block, if it is there. */
const word *words_take(context *c, char letter);

/* Of a word. */
bool words_distance(context *c, const word *w, char letter, int32_t *pulses);
bool words_speed(context *c, const word *w, char letter, uint32_t *um_per_min);

/* A whole number of a word, up to a limit; `what` says what it is. */
bool words_whole(context *c, char letter, uint32_t lowest, uint32_t highest, const char *what,
           uint32_t *value);

/* The block carries no motion and no word but these letters. */
bool words_alone(context *c, uint32_t allowed);

/* The gap is looked at before a pulse of the condition ends. */
bool words_seen(context *c, const condition_row *row, uint32_t column);

/* The condition that a word names. */
bool words_condition(context *c, const word *w, const condition_row **row);
