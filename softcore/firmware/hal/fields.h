// SPDX-License-Identifier: Apache-2.0
/* Fields of registers, by the names in `regs.h`. */
#ifndef HAL_FIELDS_H
#define HAL_FIELDS_H

#include <stdint.h>

#define GET(word, field) (((word) & field##_MASK) >> field##_SHIFT)
#define PUT(value, field) (((uint32_t)(value) << field##_SHIFT) & field##_MASK)

#endif
