// SPDX-License-Identifier: Apache-2.0
/* Homing on the index of an axis's coder ($560), after the switch has been left for the second time. */
#pragma once
#include <stdbool.h>

bool homing_index_wanted(void);     /* of the axis that is homed */
void homing_index_leave(void);      /* the axis is about to leave the switch */
void homing_index_search(void);     /* on, away from the switch, until the index comes */
void homing_index_found(void);      /* a step: the axis comes to rest, and goes back onto its index */
