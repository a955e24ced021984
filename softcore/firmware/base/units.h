// SPDX-License-Identifier: Apache-2.0
/* Exact conversions between the units of programs and those of the gateware, in integers only. A
   programmed number is given as its digits and the number of its decimals. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define UNITS_DIGITS 12             /* most significant digits of a programmed number */
#define UNITS_DECIMALS 7            /* most decimals of it */
#define UNITS_POSITION_LIMIT (1 << 28) /* pulses; a move between two such points fits a segment */
#define UNITS_RADIUS_LIMIT 11000000 /* pulses; three times as many 1/64 pulses fit 32 bits */
#define UNITS_RATE_LIMIT ((1u << 30) - 1) /* 2**-32 pulse/clock: one pulse in four clocks */

void units_init(uint32_t clock_hz, uint32_t pulses_per_mm);

typedef struct {
    uint64_t digits;        /* below 10**UNITS_DIGITS */
    unsigned decimals;      /* at most UNITS_DECIMALS */
} units_number;

/* Distance in pulses; halves round away from zero. False if it does not fit. */
bool units_distance(units_number number, bool inch, int32_t *pulses);

/* The same in 1/64 pulse, for radii; false above units_radius_limit. */
bool units_fine(units_number number, bool inch, int32_t *fine);
int32_t units_radius_limit(void);   /* pulses: 1 m, or what fits */

/* Speed in um/min; halves round up. False if it does not fit 31 bits. */
bool units_speed(units_number number, bool inch, uint32_t *um_per_min);

/* Clocks of a time in seconds or milliseconds; false above 36 000 s. */
bool units_clocks(units_number number, bool milliseconds, uint64_t *clocks);

uint32_t units_rate(uint32_t um_per_min);       /* saturates at UNITS_RATE_LIMIT */
uint32_t units_speed_of_rate(uint32_t rate);    /* um/min */
uint32_t units_speed_of_count(uint32_t pulses, uint32_t clocks);    /* um/min */
uint32_t units_acceleration(uint32_t mm_per_s2); /* 2**-32 pulse/clock per 16 clock, at least 1 */
uint64_t units_gain(uint32_t per_s);             /* 2**-32 per clock */
uint32_t units_gain_of_tick(uint32_t per_s);     /* 2**-20 per tick of 32 us; up to 1900 1/s */
uint32_t units_lead(uint32_t percent, uint32_t per_s); /* clocks: a share of 1 / per_s */
uint32_t units_clocks_of_ns(uint32_t ns);       /* rounded up */
uint32_t units_clocks_of_us(uint32_t us);       /* rounded up, saturating */
uint32_t units_tenths_of_um(uint32_t pulses);
int32_t units_pulses_of_um(uint32_t um);
uint32_t units_fine_of_nm(uint32_t nm);   /* 1/64 pulse, rounded down */

/* Path pulses needed to brake from `rate` to `start_rate` at `acceleration`, rounded up. */
uint32_t units_braking(uint32_t rate, uint32_t start_rate, uint32_t acceleration);

/* value / divisor, rounded down. A value below 2**32 uses the divider of the CPU; a 64-bit division
   takes about a thousand clocks. */
uint64_t units_quotient(uint64_t value, uint32_t divisor);
uint32_t units_root(uint64_t square);           /* nearest integer to the square root */
