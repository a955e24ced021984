// SPDX-License-Identifier: Apache-2.0
/* Machining conditions: the rows that the C word chooses from. */
#pragma once
#include <stdint.h>

typedef struct {
    uint16_t number;
    uint8_t ip;         /* current level, IP */
    uint16_t on_us, off_us;
} technology_row;

/* The row of a number, or a null pointer. */
const technology_row *technology_find(uint32_t number);

/* Bring a row to the power supply. */
void technology_apply(const technology_row *row);

extern const technology_row TECHNOLOGY[];
extern const unsigned TECHNOLOGY_ROWS;
