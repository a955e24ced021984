// SPDX-License-Identifier: Apache-2.0
/* Lets the correction of the screws' pitch follow the commanded places of the axes.

   While the position is lost, or the machine is locked, the correction stays as it is: so nothing
   moves then. Homing goes without it, so that a switch is found at the same place each time. When
   the position is known again the axes walk to their corrected places. */
#pragma once

void pitch_watch_step(void);    /* call in every round of the main loop, if settings_screws */
