// SPDX-License-Identifier: Apache-2.0
/* Overrides of the constant feed and of rapids. The gateware counts their bytes; this module
   applies them to the path. A feed by the gap (G95), a retraction, its re-advance and a jump have
   speeds of their own, which no override changes. */
#pragma once

void override_step(void);   /* apply the operator's overrides, unless the gap sets the feed */
void override_end(void);    /* back to 100 %, after a program's end or a reset */
