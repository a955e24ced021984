// SPDX-License-Identifier: Apache-2.0
/* M, S and T functions of the machine side: strobe, then wait for FIN. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef enum { AUXILIARY_DONE, AUXILIARY_WAIT, AUXILIARY_LATE } auxiliary_result;

void auxiliary_init(void);

void auxiliary_send(hal_letter letter, uint32_t code);
auxiliary_result auxiliary_poll(void);

/* What was sent last since power-on: the code of S or T, 0 for none; whether M08 was, not M09. */
uint32_t auxiliary_last(hal_letter letter);
bool auxiliary_fluid(void);
