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

/* The code of S or T that was sent last since power-on, 0 for none. */
uint32_t auxiliary_last(hal_letter letter);
bool auxiliary_fluid(void);     /* of M08 and M09, M08 was sent last */
