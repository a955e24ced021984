// SPDX-License-Identifier: Apache-2.0
#include "base/grbl.h"

#include "base/settings.h"
#include "base/text.h"
#include "base/units.h"

unsigned grbl_find(uint32_t number) {
    unsigned row = number < SETTINGS_FIRST ? 0 : GRBL_ROWS;
    while (row < GRBL_ROWS && GRBL_TABLE_ROWS[row].number != number)
        row++;
    return row;
}

/* The value in thousandths of its unit. */
static uint32_t thousandths(const grbl_table_row *row) {
    switch (row->source) {
    case GRBL_RESOLUTION: return settings_axis_resolution(row->value);
    case GRBL_SPEED: return settings_axis_speed(row->value);
    case GRBL_ACCELERATION: return settings_get(SET_ACCELERATION_MM_S2) * 1000;
    case GRBL_FEED: return settings_get((setting)row->follows[0]) * 1000;
    case GRBL_LENGTH: return settings_get((setting)row->follows[0]);
    default: return settings_travel_um(row->value);
    }
}

void grbl_value(unsigned row, char *text, size_t size) {
    const grbl_table_row *one = &GRBL_TABLE_ROWS[row];
    if (one->source < GRBL_RESOLUTION) {
        uint32_t number = (uint32_t)one->value;
        if (one->source != GRBL_CONSTANT)
            number = settings_get((setting)one->follows[0]);
        text_print(text, size, "%u", one->source == GRBL_ON ? number != 0 : number);
        return;
    }
    uint32_t value = thousandths(one);
    text_print(text, size, "%u.%u%u%u", value / 1000, value / 100 % 10, value / 10 % 10, value % 10);
}

bool grbl_refuses(const char *line, uint32_t length, fault *f) {
    uint32_t at = 1, number;
    if (!settings_read_number(line, length, &at, &number) || at == length || line[at] != '=')
        return false;
    unsigned row = grbl_find(number);
    if (row == GRBL_ROWS)
        return false;
    const grbl_table_row *one = &GRBL_TABLE_ROWS[row];
    uint32_t first = one->follows[0], second = one->follows[1];
    if (first == SETTINGS)
        fault_at(f, FAULT_SETTING, 0, "$%u (%s) cannot be changed", number, one->title);
    else if (second == SETTINGS)
        fault_at(f, FAULT_SETTING, 0, "$%u (%s) follows from $%u: set that one", number, one->title,
                 settings_number((setting)first));
    else
        fault_at(f, FAULT_SETTING, 0, "$%u (%s) follows from $%u and $%u: set those", number, one->title,
                 settings_number((setting)first), settings_number((setting)second));
    return true;
}
