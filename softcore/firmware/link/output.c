// SPDX-License-Identifier: Apache-2.0
#include "link/output.h"

#include "base/text.h"
#include "hal/hal.h"

#define BURST 32 /* bytes per step: no step takes long even if the link is fast */

/* Form of a compact line: characters of its numbers, and the character for 0. */
#define CYCLE_DIGITS 4
#define LINE_DIGITS 1
#define PLACE_DIGITS 2
#define DIGIT '0'
#define COMPACT_LINES 31    /* most compact lines in a row */

static char queue[OUTPUT_QUEUE] __attribute__((aligned(4)));
static uint32_t head, tail; /* free-running */
static bool line_open;      /* a line has been sent in part */
static uint8_t answers[8];
static unsigned answer_count;
static int32_t frame[HAL_AXES];

/* The event sent last. A compact line counts from it. */
static struct {
    unsigned compact;       /* compact lines that may follow until the next full one */
    uint64_t cycle;
    uint32_t line;
    int32_t place[HAL_AXES];    /* program frame */
} last;

void output_init(void) {
    head = tail = 0;
    line_open = false;
    answer_count = 0;
    last.compact = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        frame[axis] = 0;
}

void output_frame(const int32_t *offset) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        frame[axis] = offset[axis];
}

int32_t output_origin(unsigned axis) { return frame[axis]; }

bool output_step(void) {
    unsigned sent = 0;
    uint32_t at = tail, end = head;
    bool open = line_open;
    for (; sent < BURST && hal_transmit_ready(); sent++) {
        if (answer_count && !open) {
            hal_transmit(answers[0]);
            answer_count--;
            for (unsigned k = 0; k < answer_count; k++)
                answers[k] = answers[k + 1];
            /* Bytes of an answer come in pairs that must stay together. */
            continue;
        }
        if (at == end)
            break;
        char c = queue[at++ % OUTPUT_QUEUE];
        open = c != '\n';
        hal_transmit((uint8_t)c);
    }
    tail = at;
    line_open = open;
    return sent;
}

bool output_empty(void) { return head == tail && !answer_count; }
bool output_has_room(void) { return OUTPUT_QUEUE - (head - tail) >= OUTPUT_RESERVE + OUTPUT_LINE; }

/* Put a line into the queue; false if there is no room. */
static bool finish(char *line, size_t length) {
    line[length++] = '\r';
    line[length++] = '\n';
    if (OUTPUT_QUEUE - (head - tail) < length)
        return false;
    size_t at = head % OUTPUT_QUEUE, first = OUTPUT_QUEUE - at;
    if (first > length)
        first = length;
    __builtin_memcpy(queue + at, line, first);
    __builtin_memcpy(queue, line + first, length - first);
    head += length;
    return true;
}

static void remember(uint64_t cycle, uint32_t line_number, const int32_t *position,
                     unsigned compact) {
    last.compact = compact;
    last.cycle = cycle;
    last.line = line_number;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        last.place[axis] = position[axis] - frame[axis];
}

void output_line(const char *format, ...) {
    char line[OUTPUT_LINE];
    va_list arguments;
    va_start(arguments, format);
    size_t length = text_vprint(line, sizeof line - 2, format, arguments);
    va_end(arguments);
    (void)finish(line, length);
}

/* The sentence is written where it is sent from: a copy of it takes as long as the refusal's own work. */
void output_message(const fault *f) {
    char line[OUTPUT_LINE];
    size_t length = text_print(line, sizeof line, "[MSG:");
    length += fault_sentence(f, line + length, sizeof line - 3 - length);
    line[length++] = ']';
    (void)finish(line, length);
}

void output_vevent(const char *name, uint64_t cycle, uint32_t line_number, const int32_t *position,
                   const char *format, va_list arguments) {
    char line[OUTPUT_LINE];
    size_t length = text_print(line, sizeof line, "[E:%s,%U,%u,%d,%d,%d", name, cycle, line_number,
                               position[0] - frame[0], position[1] - frame[1],
                               position[2] - frame[2]);
    length += text_vprint(line + length, sizeof line - 3 - length, format, arguments);
    line[length++] = ']';
    if (finish(line, length))
        remember(cycle, line_number, position, COMPACT_LINES);
}

/* Write the low bits of a number, 6 in a character, highest first. */
static char *put_bits(char *at, uint32_t value, unsigned characters) {
    for (unsigned shift = 6 * characters; shift;) {
        shift -= 6;
        *at++ = (char)(DIGIT + (value >> shift & 63));
    }
    return at;
}

/* Is `value` so near 0 that the bits of these characters are enough for it? */
static bool is_near(int32_t value, unsigned characters) {
    int32_t half = 1 << (6 * characters - 1);
    return value >= -half && value < half;
}

static bool fits_compact(uint64_t cycle, uint32_t line_number, const int32_t *position) {
    int64_t clocks = (int64_t)(cycle - last.cycle);
    bool near = last.compact && clocks == (int32_t)clocks &&
                is_near((int32_t)clocks, CYCLE_DIGITS) &&
                is_near((int32_t)(line_number - last.line), LINE_DIGITS);
    for (unsigned axis = 0; near && axis < HAL_AXES; axis++)
        near = is_near(position[axis] - frame[axis] - last.place[axis], PLACE_DIGITS);
    return near;
}

void output_block(uint64_t cycle, uint32_t line_number, const int32_t *position, const char *text) {
    if (!fits_compact(cycle, line_number, position)) {
        output_event(EVENT_WORD_BLOCK, cycle, line_number, position, EVENT_FORMAT_BLOCK, text);
        return;
    }
    char line[OUTPUT_LINE], *at = line, *end = line + sizeof line - 3;
    *at++ = '[';
    *at++ = 'B';
    at = put_bits(at, (uint32_t)cycle, CYCLE_DIGITS);
    at = put_bits(at, line_number, LINE_DIGITS);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        at = put_bits(at, (uint32_t)(position[axis] - frame[axis]), PLACE_DIGITS);
    while (*text && at < end)
        *at++ = *text++;
    *at++ = ']';
    if (finish(line, (size_t)(at - line)))
        remember(cycle, line_number, position, last.compact - 1);
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
