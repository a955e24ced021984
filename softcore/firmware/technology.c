// SPDX-License-Identifier: Apache-2.0
#include "technology.h"

#include "hal.h"
#include "units.h"

/* Copper on steel, electrode positive, in hydrocarbon oil: from finishing to roughing. One IP is
   1.5 A (the unit of CN 1112469 A). On-times follow the usual practice of 10 us/A, off-times keep
   the duty factor between one third and two thirds. Fixed before any tape was tuned on them. */
const technology_row TECHNOLOGY[] = {
    {.number = 100, .ip = 1, .on_us = 15, .off_us = 25},
    {.number = 110, .ip = 2, .on_us = 30, .off_us = 30},
    {.number = 120, .ip = 4, .on_us = 60, .off_us = 40},
    {.number = 130, .ip = 6, .on_us = 100, .off_us = 50},
    {.number = 140, .ip = 9, .on_us = 150, .off_us = 75},
    {.number = 150, .ip = 12, .on_us = 200, .off_us = 100},
};
const unsigned TECHNOLOGY_ROWS = sizeof TECHNOLOGY / sizeof *TECHNOLOGY;

const technology_row *technology_find(uint32_t number) {
    for (unsigned i = 0; i < TECHNOLOGY_ROWS; i++)
        if (TECHNOLOGY[i].number == number)
            return &TECHNOLOGY[i];
    return 0;
}

void technology_apply(const technology_row *row) {
    hal_pulse(units_clocks_of_us(row->on_us), units_clocks_of_us(row->off_us), row->ip);
}
