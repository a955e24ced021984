// SPDX-License-Identifier: Apache-2.0
/* Division of 64-bit numbers by one that is not zero, rounded down, and its rest. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

uint64_t division_quotient(uint64_t value, uint64_t divisor);
uint64_t division_rest(uint64_t value, uint64_t divisor);
