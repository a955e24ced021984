// SPDX-License-Identifier: Apache-2.0
/* The axis that is homed: its motion. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

/* Move it by `way`, at `speed` um/min. Its position is not known, so its soft limits are out of
   force. */
void homing_axis_go(int32_t way, uint32_t speed);
int32_t homing_axis_pull_off(void); /* from the switch, pulses */
bool homing_axis_stands(void);      /* all axes have stood for some time */
