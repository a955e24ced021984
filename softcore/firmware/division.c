// SPDX-License-Identifier: Apache-2.0
/* Division of 64-bit numbers, which the compiler calls for: its own takes 1.4 KB and is no faster. The
   names under which it calls stand in memory.S. */
#include "division.h"

static __attribute__((noinline)) uint64_t divide(uint64_t value, uint64_t divisor, uint64_t *rest) {
    uint32_t low = (uint32_t)value, high = (uint32_t)(value >> 32);
    if (divisor >> 32) {
        /* The quotient has 32 bits at most. */
        uint64_t left = high;
        for (unsigned bit = 0; bit < 32; bit++) {
            bool carry = left >> 63;
            left = left << 1 | low >> 31;
            low <<= 1;
            if (carry || left >= divisor) {
                left -= divisor;
                low |= 1;
            }
        }
        *rest = left;
        return low;
    }
    uint32_t by = (uint32_t)divisor, left = high % by;
    high /= by;
    for (unsigned bit = 0; bit < 32; bit++) {
        bool carry = left >> 31;
        left = left << 1 | low >> 31;
        low <<= 1;
        if (carry || left >= by) {
            left -= by;
            low |= 1;
        }
    }
    *rest = left;
    return (uint64_t)high << 32 | low;
}

uint64_t division_quotient(uint64_t value, uint64_t divisor) {
    uint64_t rest;
    return divide(value, divisor, &rest);
}

uint64_t division_rest(uint64_t value, uint64_t divisor) {
    uint64_t rest;
    divide(value, divisor, &rest);
    return rest;
}
