// SPDX-License-Identifier: Apache-2.0
/* The host's side of the serial port: real-time bytes, which the gateware takes out of the stream,
   lines in the manner of grbl 1.1 (see lines.h), and tape in frames. The whole protocol is told in
   host/link.py.

   Frame: FRAME_START, then stuffed length, sequence, payload, CRC-16 of these, high byte first, then
   FRAME_END. Answer: ACK or NAK, then the sequence. Length 0 begins a tape, length 255 (without payload) ends it. A frame
   for which there is no room is answered when there is, or not at all if the sender repeats it
   first; a repeated sequence number is acknowledged and dropped. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* Each is true if there was something to do. */
bool link_step(void);               /* bytes in and out */
bool link_serve(void);              /* at most one line or report */
void link_init(void);               /* at power-on */
void link_restart(void);            /* forget what has come, and greet when the line is quiet */
void link_answer(const fault *f);   /* to a line: ok, or the error with its message */

/* What the operator may order at any time, but not of a locked machine. */
void link_resume(fault *f);
void link_retract(fault *f);
