// SPDX-License-Identifier: Apache-2.0
/* Tape frames out of the byte stream of the link. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define FRAME_START 0x02
#define FRAME_ACK 0x06
#define FRAME_NAK 0x15

void frame_init(void);
bool frame_open(void);              /* bytes belong to a frame now */
void frame_begin(void);             /* FRAME_START has come */
bool frame_lost(void);              /* what has come instead can only be a damaged FRAME_START */
void frame_byte(uint8_t byte);
void frame_step(void);              /* time-outs, and frames that waited for room */
