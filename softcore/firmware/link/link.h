// SPDX-License-Identifier: Apache-2.0
/* The host's side of the serial port: real-time bytes, which the gateware takes out of the stream,
   lines in the manner of grbl 1.1 (see lines.h), and tape in frames. The whole protocol is told in
   host/link.

   Frame: FRAME_START, then stuffed length, sequence, payload, CRC-16 of these, high byte first, then
   FRAME_END. Answer: ACK or NAK, then the sequence. Length 0 begins a tape, length 255 (without
   payload) ends it. A frame for which there is no room is answered when there is, or not at all if
   the sender repeats it first; a repeated sequence number is acknowledged and dropped. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void link_init(void);               /* at power-on */
void link_restart(void);            /* forget what has come */

/* Take bytes, but no more than the watchdog bears, whatever they are. A reset or an order ends that,
   and is to be carried out at once; the answer to an order is given to lines_ordered. */
typedef enum { LINK_NOTHING, LINK_TAKEN, LINK_RESET, LINK_RESUME, LINK_RETRACT } link_come;
link_come link_take(void);
bool link_order_waits(void);        /* the next bytes to be taken are the end of an order */

/* The rest of a step, in which bytes were `taken` or not: pauses on the line, a frame that waits for
   room, bytes out. True if there was something to do. */
bool link_step(bool taken);

bool link_rests(void);              /* the line is quiet, and nothing waits to be sent */

uint32_t link_errors(void);         /* that the receiver saw, since power-on */
