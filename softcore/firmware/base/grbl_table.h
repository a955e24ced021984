/* Generated from softcore/tables/grbl.py by `python -m softcore.generate`; do not edit. */
#pragma once
#include <stdint.h>

#include "base/settings_table.h"

#define GRBL_ROWS 18u

/* What a value comes from; all but a constant have three decimals. */
typedef enum {
    GRBL_CONSTANT,
    GRBL_RESOLUTION,
    GRBL_SPEED,
    GRBL_ACCELERATION,
    GRBL_TRAVEL,
} grbl_source;

typedef struct {
    uint16_t number;
    uint8_t source;
    uint8_t value;          /* that of a constant; of others the axis */
    uint8_t follows[2];     /* settings that it follows from; SETTINGS for none */
    const char *title;
    const char *unit;
} grbl_table_row;

extern const grbl_table_row GRBL_TABLE_ROWS[GRBL_ROWS];
