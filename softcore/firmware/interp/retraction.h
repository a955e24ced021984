// SPDX-License-Identifier: Apache-2.0
/* Retraction memory of two layers. For each word a value from the tape overrides the value entered
   by hand (MDI).

   Speeds in um/min, distances in pulses, the ceiling in the machine frame. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "hal/hal.h"

typedef enum { ITEM_R, ITEM_L, ITEM_H, ITEM_E, ITEM_Q, ITEM_Z, ITEMS } retraction_item;

typedef struct {
    uint8_t given;              /* a bit for each item that has a value */
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

/* Both layers combined; values of the tape override. */
retraction_layer retraction_combined(const retraction_memory *memory);

/* Check both layers combined: each item in range, and Q not above L. `complete`: no item may be
   missing but Z. `columns` gives the place of a fault, for each item its column in the block, 0 if
   it is not there. */
bool retraction_check(const retraction_memory *memory, bool complete, uint32_t highest_speed,
                      const uint32_t columns[ITEMS], fault *f);

/* Do both layers together have all items? The ceiling Z may be missing. */
bool retraction_complete(const retraction_memory *memory);

/* Convert a combined set and a jump into register values. They are valid if the set is complete. */
hal_retraction retraction_rates(const retraction_layer *set, const retraction_jump *jump,
                                uint32_t start_rate, uint32_t acceleration);
