// SPDX-License-Identifier: Apache-2.0
/* Retraction memory: what the tape says lies over what was entered by hand, word by word.

   Speeds in um/min, distances in pulses, the ceiling in the machine frame. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "hal/hal.h"

typedef enum { ITEM_R, ITEM_L, ITEM_H, ITEM_E, ITEM_Q, ITEM_Z, ITEMS } retraction_item;

typedef struct {
    uint8_t given;              /* bit by item */
    int32_t value[ITEMS];
} retraction_layer;

typedef struct {
    retraction_layer mdi, tape;
} retraction_memory;

typedef struct {
    uint32_t period;            /* clocks of machining between jumps; 0 for none */
    int32_t distance;
    uint32_t speed, high;
} retraction_jump;

extern const char RETRACTION_LETTERS[ITEMS];

/* Items of both layers together; the tape's win. */
retraction_layer retraction_combined(const retraction_memory *memory);

/* Check a combined set: each item in range, Q not above L, and, where asked, none missing but Z.
   The columns (by item, 0 if the item is not in the block) say where a fault stands. */
bool retraction_check(const retraction_layer *set, bool complete, uint32_t highest_speed,
                      const uint32_t columns[ITEMS], fault *f);

/* Are all items but the ceiling there? */
bool retraction_complete(const retraction_layer *set);

/* The register values of a set and a jump. */
hal_retraction retraction_rates(const retraction_layer *set, const retraction_jump *jump,
                                uint32_t start_rate, uint32_t acceleration);
