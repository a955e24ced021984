/* Generated from softcore/tables/grbl.py by `python -m softcore.generate`; do not edit. */
#pragma once
#include <stdint.h>

#include "base/settings_table.h"

#define GRBL_ROWS 23u

/* Source of a value. All but a constant have three decimals. */
typedef enum {
    GRBL_CONSTANT,
    GRBL_ON,
    GRBL_NUMBER,
    GRBL_RESOLUTION,
    GRBL_SPEED,
    GRBL_ACCELERATION,
    GRBL_TRAVEL,
    GRBL_FEED,
    GRBL_LENGTH,
} grbl_source;

typedef struct {
    uint16_t number;
    uint8_t source;
    uint8_t value;          /* of a constant; for other sources the axis */
    uint8_t follows[2];     /* settings that it follows from; SETTINGS for none */
    const char *title;
    const char *unit;
} grbl_table_row;

extern const grbl_table_row GRBL_TABLE_ROWS[GRBL_ROWS];
