// SPDX-License-Identifier: Apache-2.0
/* Counts the edges of the control flow that have been taken, as guidance for a fuzzer. In a build
   with coverage, the compiler calls __sanitizer_cov_trace_pc in every block of code; else this is
   idle. */
#include "pc/host.h"

#include <string.h>

#if defined(__clang__)
#define UNTRACED __attribute__((no_sanitize("coverage")))
#else
#define UNTRACED __attribute__((no_sanitize_coverage))
#endif

#define EDGES (1u << 16)

static uint8_t taken[EDGES];    /* times since the last call of gk_coverage, saturating */
static uint8_t seen[EDGES];     /* orders of magnitude of these counts so far, a bit for each */
static uintptr_t last;

void __sanitizer_cov_trace_pc(void);

UNTRACED void __sanitizer_cov_trace_pc(void) {
    uintptr_t here = (uintptr_t)__builtin_return_address(0);
    uint8_t *count = &taken[(here ^ last) % EDGES];
    if (*count != UINT8_MAX)
        ++*count;
    last = here >> 1;
}

UNTRACED static uint8_t size(uint8_t count) {
    uint8_t bit = 1;
    for (; count > 1; count >>= 1)
        bit = (uint8_t)(bit << 1);
    return bit;
}

UNTRACED uint32_t gk_coverage(void) {
    uint32_t fresh = 0;
    for (uint32_t edge = 0; edge < EDGES; edge++) {
        if (!taken[edge])
            continue;
        uint8_t bit = size(taken[edge]);
        fresh += !(seen[edge] & bit);
        seen[edge] |= bit;
    }
    memset(taken, 0, sizeof taken);
    last = 0;
    return fresh;
}
