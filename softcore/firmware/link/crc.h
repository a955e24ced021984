// SPDX-License-Identifier: Apache-2.0
/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF; check value 0x29B1 for "123456789". */
#pragma once
#include <stdint.h>

#define CRC_START 0xffffu

/* The polynomial has so few terms that what a byte adds is three shifts of it, after its upper half has
   gone round once. */
static inline uint16_t crc_step(uint16_t value, uint8_t byte) {
    uint32_t x = (uint32_t)(value >> 8 ^ byte);
    x ^= x >> 4;
    return (uint16_t)((uint32_t)value << 8 ^ x << 12 ^ x << 5 ^ x);
}
