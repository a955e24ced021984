// SPDX-License-Identifier: Apache-2.0
/* Does the gateware do what it was told? At rest the axes are where the path has led them; and where
   motion is wanted there is some. */
#pragma once

/* In every round of the main loop; raises an alarm if not. */
void motion_watch_init(void);
void motion_watch_step(void);
