// SPDX-License-Identifier: Apache-2.0
/* Tape frames out of the byte stream of the link. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define FRAME_ACK 0x06
#define FRAME_NAK 0x15

void frame_init(void);              /* at power-on */
void frame_restart(void);
bool frame_open(void);              /* bytes belong to a frame now */
void frame_begin(void);             /* FRAME_START has come */

/* A byte that frame_receive has returned. FRAME_WHOLE: the frame has come whole; FRAME_BROKEN: it was
   damaged, and its rest is still to come. */
typedef enum { FRAME_MORE, FRAME_WHOLE, FRAME_BROKEN } frame_part;
frame_part frame_byte(uint8_t byte);
int frame_receive(unsigned *taken, unsigned most);  /* hal_receive, behind payload that it takes */
void frame_damaged(void);           /* the receiver saw an error in the frame that is open */
void frame_ask_again(void);         /* what has come instead of a frame may have been one */
bool frame_wait(uint32_t clocks);   /* since the last byte; true: one has stopped half-way */
void frame_step(void);              /* a frame may wait for room */

/* Since power-on: frames begun, and of these the ones that were damaged or stopped half-way. */
typedef struct {
    uint32_t begun, damaged;
} frame_counts;
frame_counts frame_count(void);
