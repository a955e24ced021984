// SPDX-License-Identifier: Apache-2.0
/* The host's side of the serial port: real-time bytes at any time outside a tape frame, lines in the
   manner of grbl 1.1, and tape in frames.

   Frame: STX, length, sequence, payload, CRC-16/CCITT-FALSE of all but STX, high byte first. Answer:
   ACK or NAK, then the sequence. Length 0 begins a tape, length 255 (without payload) ends it. A frame
   for which there is no room is answered when there is, or not at all if the sender repeats it
   first; a repeated sequence number is acknowledged and dropped. While more frames of a tape are to
   come, lines are not: any byte but STX and the real-time ones begins a frame whose STX was hit. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "fault.h"

/* Each is true if there was something to do. */
bool link_step(void);               /* bytes in and out */
bool link_serve(void);              /* at most one line or report */
void link_restart(void);            /* forget what was typed, and greet */
void link_answer(const fault *f);   /* to a line: ok, or the error with its message */
