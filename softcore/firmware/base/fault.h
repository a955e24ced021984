// SPDX-License-Identifier: Apache-2.0
/* A fault: a code, its place on the tape, and one clear sentence. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault_codes.h"

typedef struct {
    fault_code code;
    uint32_t line;      /* source line, 0 for MDI */
    uint32_t block;     /* number of the N word, 0 for none */
    uint32_t column;    /* character of the block, from 1; 0 for none */
    char text[120];     /* what was wrong, without the place */
} fault;

/* Note a fault, unless `f` already holds one. Always returns false, for use in conditions. The
   caller that knows the line fills it in. */
bool fault_at(fault *f, fault_code code, uint32_t column, const char *format, ...);

/* Numbers of `error:N` and `ALARM:N`. They are grbl's if grbl has the same fault. */
uint32_t fault_error(fault_code code);
uint32_t fault_alarm(fault_code code);

/* One sentence: the place, then what was wrong. */
size_t fault_sentence(const fault *f, char *buffer, size_t size);
