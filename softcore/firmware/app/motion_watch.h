// SPDX-License-Identifier: Apache-2.0
/* Checks that the gateware does what it was told: at rest the axes are at the end of the path, and
   wanted motion takes place. */
#pragma once

/* Call the step in every round of the main loop. It raises an alarm if a check fails. */
void motion_watch_init(void);
void motion_watch_step(void);
