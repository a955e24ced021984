// SPDX-License-Identifier: Apache-2.0
/* The link to the host over the serial port. It carries real-time bytes, which the gateware takes
   out of the stream, lines as in grbl 1.1 (see lines.h), and a tape in frames. host/link describes
   the whole protocol.

   Frame: FRAME_START; then, with stuffed bytes, length, sequence, payload and the CRC-16 of these,
   high byte first; then FRAME_END. Answer: ACK or NAK, then the sequence. Length 0 begins a tape,
   length 255 (without payload) ends it. A frame without room is answered when there is room, or not
   at all if the sender repeats it before. A repeated sequence number is acknowledged, and its frame
   dropped. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void link_init(void);               /* at power-on */
void link_restart(void);            /* forget what was received */

/* Take bytes, for a bounded time, so that the watchdog is called in time whatever comes. A reset or
   an order ends the step. The caller carries it out at once, and answers an order with
   lines_ordered. */
typedef enum { LINK_NOTHING, LINK_TAKEN, LINK_RESET, LINK_RESUME, LINK_RETRACT } link_come;
link_come link_take(void);
bool link_order_waits(void);        /* the next byte to be taken ends an order */

/* The second half of a step, with `taken` if the first half took bytes: handles pauses on the line
   and a frame that waits for room, and sends bytes. True if there was something to do. */
bool link_step(bool taken);

bool link_rests(void);              /* the line is quiet, and nothing waits to be sent */

uint32_t link_errors(void);         /* errors that the receiver saw since power-on */
