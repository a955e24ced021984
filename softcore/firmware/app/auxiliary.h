// SPDX-License-Identifier: Apache-2.0
/* M, S and T functions of the machine side: strobe, then wait for FIN. */
#pragma once
#include <stdint.h>

#include "hal/hal.h"

typedef enum { AUXILIARY_DONE, AUXILIARY_WAIT, AUXILIARY_LATE } auxiliary_result;

void auxiliary_send(hal_letter letter, uint32_t code);
auxiliary_result auxiliary_poll(void);
