// SPDX-License-Identifier: Apache-2.0
/* What went wrong: a code, where it stands on the tape, and one clear sentence. */
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

/* Note the first fault of a place; a later one does not replace it. Always returns false, for use in
   conditions. The line is filled in by whoever knows it. */
bool fault_at(fault *f, fault_code code, uint32_t column, const char *format, ...);

/* Numbers of `error:N` and `ALARM:N`: those of grbl where it has the same. */
uint32_t fault_error(fault_code code);
uint32_t fault_alarm(fault_code code);

/* One sentence: the place, then what was wrong. */
size_t fault_sentence(const fault *f, char *buffer, size_t size);
