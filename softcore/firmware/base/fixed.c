// SPDX-License-Identifier: Apache-2.0
#include "base/fixed.h"

#include <stdbool.h>

/* Not inlined: here memory is scarcer than time. */
#define SHARED __attribute__((noinline))

#define TWO_PI 7244019458077122842  /* 2**-60 */
#define SECTORS 32                  /* of a turn; the sines of their middles are known */
static const int64_t SINE[SECTORS / 4 + 1] = {
    0, 899695310372275547, 1764815834521887442, 2562115475870945497, 3260954456333195553,
    3834476785802888710, 4260642322793532497, 4523073764714963030, FIXED_ONE,
};

SHARED int64_t fixed_product(int64_t a, int64_t b) {
    uint64_t u = (uint64_t)fixed_magnitude(a), v = (uint64_t)fixed_magnitude(b);
    uint32_t u0 = (uint32_t)u, u1 = (uint32_t)(u >> 32), v0 = (uint32_t)v, v1 = (uint32_t)(v >> 32);
    uint64_t middle = (uint64_t)u1 * v0 + ((uint64_t)u0 * v0 >> 32);
    uint64_t other = (uint64_t)u0 * v1 + (uint32_t)middle;
    uint64_t high = (uint64_t)u1 * v1 + (middle >> 32) + (other >> 32);
    int64_t result = (int64_t)(high << 2 | (uint32_t)other >> 30);
    return (a < 0) != (b < 0) ? -result : result;
}

SHARED int64_t fixed_ratio(int64_t numerator, int64_t denominator) {
    uint64_t remainder = (uint64_t)numerator, quotient = 0, divisor = (uint64_t)denominator;
    for (unsigned i = 0; i <= 62; i++) {
        quotient <<= 1;
        if (remainder >= divisor) {
            remainder -= divisor;
            quotient |= 1;
        }
        remainder <<= 1;
    }
    return (int64_t)quotient;
}

SHARED fixed_divisor fixed_divisor_of(int64_t value) {
    fixed_divisor d = {0};
    while (value <= FIXED_ONE / 2) {
        value <<= 1;
        d.shift++;
    }
    d.inverse = fixed_ratio(FIXED_ONE / 2, value);
    return d;
}

__attribute__((noinline)) int64_t fixed_fraction(int64_t value, const fixed_divisor *d) {
    return fixed_product(fixed_scaled(value, d->shift), d->inverse) * 2;
}

static int64_t sine_of_sector(unsigned sector) {
    unsigned in = sector % (SECTORS / 2);
    int64_t sine = SINE[in <= SECTORS / 4 ? in : SECTORS / 2 - in];
    return sector % SECTORS < SECTORS / 2 ? sine : -sine;
}

/* Takes sine and cosine of the nearest sector and turns them by the remaining angle, at most pi/32,
   for which power series up to the seventh power are enough. */
void fixed_sine_cosine(int64_t angle, int64_t *sine, int64_t *cosine) {
    unsigned sector = (unsigned)((angle + FIXED_TURN / SECTORS / 2) / (FIXED_TURN / SECTORS));
    int64_t remainder = angle - (int64_t)sector * (FIXED_TURN / SECTORS);
    int64_t r = fixed_product(fixed_scaled(remainder, 4), TWO_PI) >> 2;
    int64_t rr = fixed_product(r, r);
    int64_t s = FIXED_ONE - fixed_product(rr, 109802048057794950);                      /* 1/42 */
    s = FIXED_ONE - fixed_product(fixed_product(rr, s), 230584300921369395);      /* 1/20 */
    s = FIXED_ONE - fixed_product(fixed_product(rr, s), 768614336404564651);      /* 1/6 */
    s = fixed_product(r, s);
    int64_t c = FIXED_ONE - fixed_product(rr, 82351536043346213);                       /* 1/56 */
    c = FIXED_ONE - fixed_product(fixed_product(rr, c), 153722867280912930);      /* 1/30 */
    c = FIXED_ONE - fixed_product(fixed_product(rr, c), 384307168202282325);      /* 1/12 */
    c = FIXED_ONE - (fixed_product(rr, c) >> 1);
    int64_t s0 = sine_of_sector(sector), c0 = sine_of_sector(sector + SECTORS / 4);
    *sine = fixed_product(s0, c) + fixed_product(c0, s);
    *cosine = fixed_product(c0, c) - fixed_product(s0, s);
}

/* Finds the nearest sector, and the remaining angle from its tangent. */
int64_t fixed_angle_of(int32_t x, int32_t y) {
    static const uint32_t border[4] = {6455, 19880, 35030, 53784}; /* tangents, 2**-16 */
    int64_t u = fixed_magnitude(x), v = fixed_magnitude(y);
    bool swap = v > u;
    if (swap) {
        int64_t other = u;
        u = v;
        v = other;
    }
    unsigned sector = 0;
    while (sector < 4 && v << 16 > u * border[sector])
        sector++;
    int64_t s = sine_of_sector(sector), c = sine_of_sector(sector + SECTORS / 4);
    int64_t along = fixed_product(u << 31, c) + fixed_product(v << 31, s);
    int64_t across = fixed_product(v << 31, c) - fixed_product(u << 31, s);
    int64_t t = fixed_ratio(fixed_magnitude(across), along);
    int64_t tt = fixed_product(t, t);
    int64_t sum = FIXED_ONE / 11 - fixed_product(tt, FIXED_ONE / 13);
    sum = FIXED_ONE / 9 - fixed_product(tt, sum);
    sum = FIXED_ONE / 7 - fixed_product(tt, sum);
    sum = FIXED_ONE / 5 - fixed_product(tt, sum);
    sum = FIXED_ONE / 3 - fixed_product(tt, sum);
    int64_t remainder = fixed_product(t, FIXED_ONE - fixed_product(tt, sum));
    remainder = fixed_product(remainder, FIXED_PER_RADIAN);
    int64_t angle = (int64_t)sector * (FIXED_TURN / SECTORS) +
                    (across < 0 ? -remainder : remainder);
    if (swap)
        angle = FIXED_TURN / 4 - angle;
    if (x < 0)
        angle = FIXED_TURN / 2 - angle;
    if (y < 0)
        angle = -angle;
    return angle < 0 ? angle + FIXED_TURN : angle < FIXED_TURN ? angle : angle - FIXED_TURN;
}
