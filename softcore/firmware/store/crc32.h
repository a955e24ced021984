// SPDX-License-Identifier: Apache-2.0
/* CRC-32 as in Ethernet: polynomial 0x04C11DB7 reflected; check value 0xCBF43926 for "123456789".
   Begin with CRC32_START, and invert the last value. */
#pragma once
#include <stdint.h>

#define CRC32_START 0xffffffffu

static inline uint32_t crc32_step(uint32_t value, uint8_t byte) {
    value ^= byte;
    for (unsigned bit = 0; bit < 8; bit++)
        value = value >> 1 ^ (0xedb88320u & (0u - (value & 1)));
    return value;
}
