// SPDX-License-Identifier: Apache-2.0
/* Lets the correction of the screws' pitch follow the commanded places of the axes.

   While the position is lost, as in homing, or the machine is locked, the correction stays as it is.
   When the position is known again it goes on from there. So it changes with commanded motion, by at
   most a hundredth of its way; and after an unlock by as much of the way that an axis coasted or was
   pushed meanwhile, but not before it has left a limit switch. */
#pragma once

void pitch_watch_step(void);    /* call in every round of the main loop, if settings_screws */
