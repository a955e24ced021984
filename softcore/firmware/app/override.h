// SPDX-License-Identifier: Apache-2.0
/* Overrides of the constant feed and of rapids. The gateware counts their bytes; here they are brought to
   the path. What goes by the gap (G95), a retraction, its way back and a jump have speeds of their own:
   no override changes them. */
#pragma once

void override_step(void);   /* bring what the operator wants to the path, where it may act */
void override_end(void);    /* back to 100 %: the program has ended, or there was a reset */
