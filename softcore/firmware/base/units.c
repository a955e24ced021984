// SPDX-License-Identifier: Apache-2.0
#include "base/units.h"

#include "base/move.h"

typedef struct {
    uint32_t numerator, denominator;
} ratio;

static uint32_t clock_hz, pulses_per_mm;
static uint64_t rate_of_speed; /* 2**-64 pulse/clock per um/min */
static uint64_t speed_of_rate; /* um/min at one pulse per clock */

/* Value of the last digit, by the number of decimals. Most are whole numbers, which need no
   division. */
static ratio pulse_of_mm[UNITS_DECIMALS + 1], pulse_of_inch[UNITS_DECIMALS + 1];
static const ratio UM_OF_MM[UNITS_DECIMALS + 1] = {
    {1000, 1}, {100, 1}, {10, 1}, {1, 1}, {1, 10}, {1, 100}, {1, 1000}, {1, 10000},
};
static const ratio UM_OF_INCH[UNITS_DECIMALS + 1] = {
    {25400, 1}, {2540, 1}, {254, 1}, {127, 5}, {127, 50}, {127, 500}, {127, 5000}, {127, 50000},
};

/* numerator / 10**tens without the common factors of ten. */
static ratio decimal(uint32_t numerator, unsigned tens) {
    ratio r = {numerator, 1};
    for (; tens && r.numerator % 10 == 0; tens--)
        r.numerator /= 10;
    while (tens--)
        r.denominator *= 10;
    return r;
}

/* numerator * 2**shift / denominator, rounded down; the quotient must fit 64 bits. */
static uint64_t shifted_quotient(uint64_t numerator, unsigned shift, uint64_t denominator) {
    uint64_t quotient = numerator / denominator;
    uint64_t remainder = numerator % denominator;
    while (shift--) {
        remainder <<= 1;
        quotient <<= 1;
        if (remainder >= denominator) {
            remainder -= denominator;
            quotient |= 1;
        }
    }
    return quotient;
}

void units_init(uint32_t clock, uint32_t pulses) {
    clock_hz = clock;
    pulses_per_mm = pulses;
    for (unsigned decimals = 0; decimals <= UNITS_DECIMALS; decimals++) {
        pulse_of_mm[decimals] = decimal(pulses, decimals);
        pulse_of_inch[decimals] = decimal(pulses * 254, decimals + 1); /* 25.4 mm exactly */
    }
    uint64_t um_clocks_per_minute = (uint64_t)clock * 60000;
    rate_of_speed = shifted_quotient(pulses, 64, um_clocks_per_minute);
    speed_of_rate = um_clocks_per_minute / pulses; /* um/min at one pulse per clock */
}

uint64_t units_quotient(uint64_t value, uint32_t divisor) {
    return value >> 32 ? value / divisor : (uint32_t)value / divisor;
}

/* `digits` is below 2**40 and the numerator at most 2**22: no overflow. */
__attribute__((noinline)) static uint64_t rounded(uint64_t digits, ratio r) {
    uint64_t product = digits * r.numerator;
    return r.denominator == 1
               ? product
               : units_quotient(2 * product + r.denominator, 2 * r.denominator);
}

bool units_distance(units_number number, bool inch, int32_t *pulses) {
    ratio r = (inch ? pulse_of_inch : pulse_of_mm)[number.decimals];
    uint64_t count = rounded(number.digits, r);
    *pulses = (int32_t)count;
    return count <= UNITS_POSITION_LIMIT;
}

int32_t units_radius_limit(void) {
    uint32_t limit = pulses_per_mm * 1000;
    return limit < UNITS_RADIUS_LIMIT ? (int32_t)limit : UNITS_RADIUS_LIMIT;
}

bool units_fine(units_number number, bool inch, int32_t *fine) {
    int32_t pulses;
    if (!units_distance(number, inch, &pulses) || pulses > units_radius_limit())
        return false;
    /* Below 2**30 after the division, so below 2**58 before it. */
    *fine = (int32_t)rounded(number.digits * MOVE_FINE,
                             (inch ? pulse_of_inch : pulse_of_mm)[number.decimals]);
    return true;
}

bool units_speed(units_number number, bool inch, uint32_t *um_per_min) {
    uint64_t speed = rounded(number.digits, (inch ? UM_OF_INCH : UM_OF_MM)[number.decimals]);
    *um_per_min = (uint32_t)speed;
    return speed <= INT32_MAX;
}

bool units_clocks(units_number number, bool milliseconds, uint64_t *clocks) {
    /* Whole microseconds times kilohertz stay far below 2**63. */
    uint64_t us = rounded(number.digits, UM_OF_MM[number.decimals]);
    if (!milliseconds)
        us = rounded(number.digits, decimal(1000000, number.decimals));
    if (us > 36000ull * 1000000)
        return false;
    *clocks = units_quotient(us * (clock_hz / 1000), 1000);
    return true;
}

uint32_t units_rate(uint32_t um_per_min) {
    uint64_t high = (uint64_t)um_per_min * (uint32_t)(rate_of_speed >> 32);
    uint64_t low = (uint64_t)um_per_min * (uint32_t)rate_of_speed;
    uint64_t rate = high + ((low + 0x80000000u) >> 32);
    return rate < UNITS_RATE_LIMIT ? (uint32_t)rate : UNITS_RATE_LIMIT;
}

uint32_t units_speed_of_rate(uint32_t rate) {
    /* At most 2**30 times 60000 * 250 MHz / 1000: split so that nothing overflows. */
    uint64_t high = (uint64_t)rate * (uint32_t)(speed_of_rate >> 32);
    uint64_t low = (uint64_t)rate * (uint32_t)speed_of_rate;
    return (uint32_t)(high + ((low + 0x80000000u) >> 32));
}

uint32_t units_speed_of_count(uint32_t pulses, uint32_t clocks) {
    if (!clocks)
        return 0;
    uint64_t per_clock = ((uint64_t)pulses << 32) / clocks; /* 2**-32 pulse/clock */
    return per_clock > UINT32_MAX ? UINT32_MAX : units_speed_of_rate((uint32_t)per_clock);
}

uint32_t units_acceleration(uint32_t mm_per_s2) {
    uint64_t pulses = (uint64_t)mm_per_s2 * pulses_per_mm;
    uint64_t per_clock = shifted_quotient(pulses, 20, clock_hz);   /* 2**-20 pulse/s/clock */
    uint64_t acceleration = shifted_quotient(per_clock, 16, clock_hz);
    if (acceleration > UNITS_RATE_LIMIT)
        return UNITS_RATE_LIMIT;
    return acceleration ? (uint32_t)acceleration : 1;
}

uint64_t units_gain(uint32_t per_s) { return shifted_quotient(per_s, 32, clock_hz); }

/* per_s * 2**20 * 32e-6 */
uint32_t units_gain_of_tick(uint32_t per_s) { return (per_s * 2199023 + (1u << 15)) >> 16; }

uint32_t units_lead(uint32_t percent, uint32_t per_s) {
    uint64_t clocks = units_quotient((uint64_t)percent * clock_hz + per_s * 50, per_s * 100);
    return clocks < 1u << 27 ? (uint32_t)clocks : (1u << 27) - 1;
}

static uint32_t clocks_of(uint32_t time, uint32_t per_second) {
    uint64_t clocks = ((uint64_t)time * clock_hz + per_second - 1) / per_second;
    return clocks > UINT32_MAX ? UINT32_MAX : (uint32_t)clocks;
}

__attribute__((noinline)) uint32_t units_clocks_of_ns(uint32_t ns) { return clocks_of(ns, 1000000000); }
__attribute__((noinline)) uint32_t units_clocks_of_us(uint32_t us) { return clocks_of(us, 1000000); }

uint32_t units_tenths_of_um(uint32_t pulses) {
    if (pulses_per_mm == 10000)
        return pulses;
    return (uint32_t)(((uint64_t)pulses * 10000 + pulses_per_mm / 2) / pulses_per_mm);
}

int32_t units_pulses_of_um(uint32_t um) {
    uint64_t pulses = (uint64_t)um * pulses_per_mm / 1000;
    return pulses > UNITS_POSITION_LIMIT ? UNITS_POSITION_LIMIT : (int32_t)pulses;
}

uint32_t units_fine_of_nm(uint32_t nm) {
    return (uint32_t)((uint64_t)nm * pulses_per_mm * MOVE_FINE / 1000000);
}

uint32_t units_braking(uint32_t rate, uint32_t start_rate, uint32_t acceleration) {
    if (rate <= start_rate)
        return 0;
    /* v*v / 2a with v in 2**-32 pulse/clock and a in 2**-36 pulse/clock**2:
       8 (v*v - s*s) / (a * 2**32). Both squares are below 2**60. */
    uint64_t squares = (uint64_t)rate * rate - (uint64_t)start_rate * start_rate;
    uint32_t pulses = (uint32_t)(squares >> 29);
    return pulses / acceleration + 2;
}

/* Digit by digit: two bits of the square give one bit of the root. The remainder is at most twice
   the root, so 32 bits hold it until the last three steps. */
uint32_t units_root(uint64_t square) {
    unsigned count = 32;
    while (count > 8 && !(square >> 48)) {
        square <<= 16;
        count -= 8;
    }
    uint32_t root = 0, remainder = 0;
    for (; count > 3; count--) {
        remainder = remainder << 2 | (uint32_t)(square >> 62);
        square <<= 2;
        uint32_t trial = root << 2 | 1;
        root <<= 1;
        if (remainder >= trial) {
            remainder -= trial;
            root |= 1;
        }
    }
    uint64_t left = remainder;
    for (; count; count--) {
        left = left << 2 | square >> 62;
        square <<= 2;
        uint64_t trial = (uint64_t)root << 2 | 1;
        root <<= 1;
        if (left >= trial) {
            left -= trial;
            root |= 1;
        }
    }
    /* square = root**2 + left; beyond root**2 + root the root is nearer to root + 1. */
    return left > root ? root + 1 : root;
}
