// SPDX-License-Identifier: Apache-2.0
/* Queue of everything that the firmware sends. It never blocks: a caller with much to send asks for
   room first. Answers to tape frames are sent before it, between two lines. */
#pragma once
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define OUTPUT_QUEUE 4096       /* bytes; a power of two */
#define OUTPUT_LINE 400         /* longest line with its end */
#define OUTPUT_RESERVE 1024     /* kept free for alarms and answers */

void output_init(void);
bool output_step(void);                         /* send what the link takes; true if it took any */
bool output_empty(void);                        /* everything is sent */
bool output_has_room(void);                     /* for a few lines, without the reserve */
void output_line(const char *format, ...);      /* as text_print, with CR LF; dropped if full */
void output_message(const fault *f);             /* `[MSG:` and its sentence */
void output_answer(uint8_t code, uint8_t sequence); /* two bytes for a tape frame */

/* Send an event: cycle, line, place (machine frame), then what `format` adds. */
void output_event(const char *name, uint64_t cycle, uint32_t line, const int32_t *position,
                  const char *format, ...);
void output_vevent(const char *name, uint64_t cycle, uint32_t line, const int32_t *position,
                   const char *format, va_list arguments);

/* Send the event `block`. It is a compact event if its cycle, line and place are near those of the
   event before; full lines would limit the speed of short blocks. A compact event is `[B`, the low
   bits of cycle (24), line (6) and x, y, z (12 each), the block's text and `]`. A character holds 6
   bits, as `0` plus their value, the highest bits first. The reader chooses the numbers nearest to
   those of the event before. At least every 32nd event is full. */
void output_block(uint64_t cycle, uint32_t line, const int32_t *position, const char *text);

/* Origin of the program frame, subtracted from every event's place. */
void output_frame(const int32_t *offset);
int32_t output_origin(unsigned axis);
