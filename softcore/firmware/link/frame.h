// SPDX-License-Identifier: Apache-2.0
/* Takes tape frames out of the byte stream of the link. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define FRAME_ACK 0x06
#define FRAME_NAK 0x15

void frame_init(void);              /* at power-on */
void frame_restart(void);
bool frame_open(void);              /* the next bytes belong to a frame */
void frame_begin(void);             /* FRAME_START has come */

/* Take a byte that frame_receive has returned. FRAME_WHOLE: the frame is complete. FRAME_BROKEN:
   the frame is damaged, and its remainder is still to come. */
typedef enum { FRAME_MORE, FRAME_WHOLE, FRAME_BROKEN } frame_part;
frame_part frame_byte(uint8_t byte);

/* Take the payload that has come, at most up to `*taken` == `most`; then return the next entry of
   the receive queue like hal_receive. */
int frame_receive(unsigned *taken, unsigned most);
void frame_damaged(void);           /* the receiver saw an error in the open frame */
void frame_ask_again(void);         /* answer NAK for something that may have been a frame */
bool frame_wait(uint32_t clocks);   /* time since the last byte; true: a frame stopped half-way */
void frame_step(void);              /* deliver a frame that waits for room */

/* Since power-on: frames begun, and those of them that were damaged or unfinished. */
typedef struct {
    uint32_t begun, damaged;
} frame_counts;
frame_counts frame_count(void);
