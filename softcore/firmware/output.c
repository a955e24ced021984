// SPDX-License-Identifier: Apache-2.0
#include "output.h"

#include "hal.h"
#include "text.h"

#define BURST 12 /* bytes per step: no step takes long even if the link is fast */

static char queue[OUTPUT_QUEUE] __attribute__((aligned(4)));
static uint32_t head, tail; /* free-running */
static bool line_open;      /* a line has been sent in part */
static uint8_t answers[8];
static unsigned answer_count;
static int32_t frame[HAL_AXES];

void output_init(void) {
    head = tail = 0;
    line_open = false;
    answer_count = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        frame[axis] = 0;
}

void output_frame(const int32_t *offset) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        frame[axis] = offset[axis];
}

bool output_step(void) {
    unsigned sent = 0;
    for (; sent < BURST && hal_transmit_ready(); sent++) {
        if (answer_count && !line_open) {
            hal_transmit(answers[0]);
            answer_count--;
            for (unsigned k = 0; k < answer_count; k++)
                answers[k] = answers[k + 1];
            /* The second byte of a pair must follow the first. */
            continue;
        }
        if (tail == head)
            break;
        char c = queue[tail++ % OUTPUT_QUEUE];
        line_open = c != '\n';
        hal_transmit((uint8_t)c);
    }
    return sent;
}

bool output_has_room(void) { return OUTPUT_QUEUE - (head - tail) >= OUTPUT_RESERVE + OUTPUT_LINE; }

static void finish(char *line, size_t length) {
    line[length++] = '\r';
    line[length++] = '\n';
    if (OUTPUT_QUEUE - (head - tail) < length)
        return;
    size_t at = head % OUTPUT_QUEUE, first = OUTPUT_QUEUE - at;
    if (first > length)
        first = length;
    __builtin_memcpy(queue + at, line, first);
    __builtin_memcpy(queue, line + first, length - first);
    head += length;
}

void output_line(const char *format, ...) {
    char line[OUTPUT_LINE];
    va_list arguments;
    va_start(arguments, format);
    size_t length = text_vprint(line, sizeof line - 2, format, arguments);
    va_end(arguments);
    finish(line, length);
}

void output_vevent(const char *name, uint64_t cycle, uint32_t line_number, const int32_t *position,
                   const char *format, va_list arguments) {
    char line[OUTPUT_LINE];
    size_t length = text_print(line, sizeof line, "[E:%s,%U,%u,%d,%d,%d", name, cycle, line_number,
                               position[0] - frame[0], position[1] - frame[1],
                               position[2] - frame[2]);
    length += text_vprint(line + length, sizeof line - 3 - length, format, arguments);
    line[length++] = ']';
    finish(line, length);
}

void output_event(const char *name, uint64_t cycle, uint32_t line, const int32_t *position,
                  const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    output_vevent(name, cycle, line, position, format, arguments);
    va_end(arguments);
}

void output_answer(uint8_t code, uint8_t sequence) {
    if (answer_count + 2 > sizeof answers)
        return;
    answers[answer_count++] = code;
    answers[answer_count++] = sequence;
}
