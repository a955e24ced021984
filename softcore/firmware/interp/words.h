// SPDX-License-Identifier: Apache-2.0
/* Shared by all parts of the interpreter: the present block, and functions that take its words. A
   function that returns false has recorded a fault. */
#pragma once
#include "interp/block.h"
#include "interp/plan.h"

#define AXIS_LETTERS (BLOCK_BIT('X') | BLOCK_BIT('Y') | BLOCK_BIT('Z'))

/* Groups of G codes. A block may have one code of each group; all non-modal codes are one group. */
typedef enum {
    G_MOTION, G_ONCE, G_UNITS, G_DISTANCE, G_FEED, G_PLANE, G_WIRE, G_SYSTEM, G_FRAME, G_GROUPS,
    G_SILENT    /* codes without effect on this machine; any number may be in a block */
} g_group;

typedef struct {
    const block *b;
    fault *f;
    plan *p;
    const modal *before;
    int16_t g[G_GROUPS];        /* the code of each group in tenths, -1 for none */
    uint32_t column[G_GROUPS];
    uint32_t free;              /* letters that have not been used yet */
    bool blending;              /* G64 is in the block; it may have P and Q */
} context;

/* Take a word by its letter and mark it as used; 0 if the block does not have it, or if it has been
   used already. */
const word *words_take(context *c, char letter);

/* Convert the number of a word. */
bool words_distance(context *c, const word *w, char letter, int32_t *pulses);
bool words_speed(context *c, const word *w, char letter, uint32_t *um_per_min);

/* Take a word with a whole number between two limits. `what` names it in a message. Without the
   word, `value` stays. */
bool words_whole(context *c, char letter, uint32_t lowest, uint32_t highest, const char *what,
           uint32_t *value);

/* Check that the block has no other code and only the allowed letters. */
bool words_alone(context *c, uint32_t allowed);

/* Check that every word of the block has been taken. */
bool words_used(context *c);

/* Check that the comparators at the gap are read before a pulse of the condition ends. */
bool words_seen(context *c, const condition_row *row, uint32_t column);

/* Find the condition that a word names. */
bool words_condition(context *c, const word *w, const condition_row **row);
