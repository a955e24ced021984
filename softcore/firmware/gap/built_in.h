/* Generated from softcore/tables/conditions.py by `python -m softcore.generate`; do not edit. */
#pragma once

#define CONDITIONS_ENTERED 16   /* rows that can be entered */
#define CONDITIONS_IP_MA 1500   /* one IP */
#define CONDITIONS_MAX_MA 30000    /* highest current, if the machine sets no other */
#define CONDITIONS_LEVELS 63
#define CONDITIONS_PLANNED 900  /* a planned condition has this number + IP */

/* Defaults of a row. */
#define CONDITIONS_USUAL .open_v = 80, .open_percent = 75, .arc_v = 20, .short_v = 12, .step = 50

#define CONDITIONS_BUILT_IN \
    {.number = 100, .milli_ip = 1000, .on_us = 15, .off_us = 25, .rest_us = 25, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 110, .milli_ip = 2000, .on_us = 30, .off_us = 30, .rest_us = 30, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 120, .milli_ip = 4000, .on_us = 60, .off_us = 40, .rest_us = 40, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 130, .milli_ip = 6000, .on_us = 100, .off_us = 50, .rest_us = 50, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 140, .milli_ip = 9000, .on_us = 150, .off_us = 75, .rest_us = 75, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 150, .milli_ip = 12000, .on_us = 200, .off_us = 100, .rest_us = 100, .negative = false, \
     CONDITIONS_USUAL}, \
    {.number = 500, .milli_ip = 8000, .on_us = 5, .off_us = 40, .rest_us = 40, .negative = true, \
     CONDITIONS_USUAL}, \
    {.number = 510, .milli_ip = 2000, .on_us = 3, .off_us = 30, .rest_us = 30, .negative = true, \
     CONDITIONS_USUAL}, \
    {.number = 520, .milli_ip = 8000, .on_us = 5, .off_us = 40, .rest_us = 40, .negative = true, \
     .from_ignition = true, .wait_us = 20, CONDITIONS_USUAL}, \
    {.number = 530, .milli_ip = 2000, .on_us = 3, .off_us = 30, .rest_us = 30, .negative = true, \
     .from_ignition = true, .wait_us = 15, CONDITIONS_USUAL}
