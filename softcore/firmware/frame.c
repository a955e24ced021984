// SPDX-License-Identifier: Apache-2.0
#include "frame.h"

#include "hal.h"
#include "output.h"
#include "program.h"
#include "units.h"

#define LONGEST 64          /* payload */
#define LENGTH_BEGIN 0
#define LENGTH_END 255

/* A frame that stops in the middle is given up after this; the sender repeats it later. */
#define STALL_US 50000
/* After a damaged frame its rest could read as real-time bytes: everything is dropped until the line
   has been quiet for so long, then the sender is asked again. */
#define QUIET_US 5000

static enum { CLOSED, LENGTH, SEQUENCE, PAYLOAD, CHECK_HIGH, CHECK_LOW, DAMAGED } state;
static uint8_t length, sequence, count, payload[LONGEST];
static uint16_t crc, check;
static uint32_t last_byte;  /* clock of it */
static bool waiting;        /* a good frame waits for room */
static uint8_t last_sequence;
static bool begun;          /* a tape has been begun */

void frame_init(void) {
    state = CLOSED;
    waiting = begun = false;
    sequence = 0;
}

bool frame_open(void) { return state != CLOSED; }

/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF. The polynomial has so few terms that what a
   byte adds is three shifts of it, after its upper half has gone round once. */
static uint16_t crc_step(uint16_t value, uint8_t byte) {
    uint32_t x = (uint32_t)(value >> 8 ^ byte);
    x ^= x >> 4;
    return (uint16_t)((uint32_t)value << 8 ^ x << 12 ^ x << 5 ^ x);
}

void frame_begin(void) {
    state = LENGTH;
    crc = 0xffff;
    count = 0;
    waiting = false; /* the sender did not wait: it will send that frame again */
    last_byte = hal_cycle_low();
}

bool frame_lost(void) {
    if (!program_tape_due())
        return false;
    state = DAMAGED;
    last_byte = hal_cycle_low();
    return true;
}

/* Give the waiting frame to the program if it can take it. */
static void deliver(void) {
    if (length == LENGTH_BEGIN) {
        if (!program_tape_begin())
            return;
        begun = true;
    } else if (!begun || (sequence != last_sequence && sequence != (uint8_t)(last_sequence + 1))) {
        waiting = false;
        output_answer(FRAME_NAK, sequence);
        return;
    } else if (sequence == last_sequence) {
        /* The acknowledgement was lost. */
    } else if (length == LENGTH_END) {
        program_tape_end();
    } else {
        if (program_tape_room() < length)
            return;
        for (unsigned i = 0; i < length; i++)
            program_tape_byte(payload[i]);
    }
    last_sequence = sequence;
    waiting = false;
    output_answer(FRAME_ACK, sequence);
}

void frame_byte(uint8_t byte) {
    last_byte = hal_cycle_low();
    if (state == LENGTH || state == SEQUENCE || state == PAYLOAD)
        crc = crc_step(crc, byte);
    switch (state) {
    case LENGTH:
        length = byte;
        state = length <= LONGEST || length == LENGTH_END ? SEQUENCE : DAMAGED;
        break;
    case SEQUENCE:
        sequence = byte;
        state = length == LENGTH_BEGIN || length == LENGTH_END ? CHECK_HIGH : PAYLOAD;
        break;
    case PAYLOAD:
        payload[count++] = byte;
        if (count == length)
            state = CHECK_HIGH;
        break;
    case CHECK_HIGH:
        check = (uint16_t)(byte << 8);
        state = CHECK_LOW;
        break;
    case CHECK_LOW:
        if ((check | byte) == crc) {
            state = CLOSED;
            waiting = true;
            deliver();
        } else {
            state = DAMAGED;
        }
        break;
    default: break;
    }
}

void frame_step(void) {
    if (waiting)
        deliver();
    if (state == CLOSED)
        return;
    uint32_t quiet = hal_cycle_low() - last_byte;
    if (quiet > units_clocks_of_us(state == DAMAGED ? QUIET_US : STALL_US)) {
        state = CLOSED;
        output_answer(FRAME_NAK, sequence);
    }
}
