// SPDX-License-Identifier: Apache-2.0
/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF; check value 0x29B1 for "123456789". */
#pragma once
#include <stdint.h>

#define CRC_START 0xffffu

/* The polynomial has only few terms, so that shifts do the work of a table: the upper half of the
   byte is folded in first, then three shifted copies are added. */
static inline uint16_t crc_step(uint16_t value, uint8_t byte) {
    uint32_t x = (uint32_t)(value >> 8 ^ byte);
    x ^= x >> 4;
    return (uint16_t)((uint32_t)value << 8 ^ x << 12 ^ x << 5 ^ x);
}
