// SPDX-License-Identifier: Apache-2.0
#include "link/frame.h"

#include "base/units.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "link/crc.h"
#include "link/output.h"
#include "link/tape.h"

#define LONGEST 64          /* payload */
#define LENGTH_BEGIN 0
#define LENGTH_END 255

/* A frame that stops in the middle is given up after this time. The sender repeats it later. */
#define STALL_US 50000

static enum { CLOSED, LENGTH, SEQUENCE, PAYLOAD, CHECK_HIGH, CHECK_LOW, END } state;
static uint8_t length, sequence, count, payload[LONGEST];
static uint8_t flip;        /* bits to flip in the next byte, if the last one was FRAME_ESCAPE */
static uint16_t crc, check;
static uint32_t stall_clocks;
static bool waiting;        /* a good frame waits for room */
static uint8_t last_sequence;
static bool begun;          /* a tape has been begun */
static frame_counts counts;
static frame_part part;     /* result of the present byte */

void frame_restart(void) {
    state = CLOSED;
    waiting = begun = false;
    sequence = 0;
}

void frame_init(void) {
    counts = (frame_counts){0};
    stall_clocks = units_clocks_of_us(STALL_US);
    frame_restart();
}

bool frame_open(void) { return state != CLOSED; }
frame_counts frame_count(void) { return counts; }
void frame_ask_again(void) { output_answer(FRAME_NAK, sequence); }

void frame_begin(void) {
    counts.damaged += state != CLOSED;
    counts.begun++;
    state = LENGTH;
    crc = CRC_START;
    count = flip = 0;
    waiting = false; /* the sender did not wait for the answer: it will repeat the waiting frame */
}

static void give_up(void) {
    state = CLOSED;
    counts.damaged++;
    frame_ask_again();
}

static void damaged(void) {
    give_up();
    part = FRAME_BROKEN;
}

void frame_damaged(void) { give_up(); }

/* Give the waiting frame to the tape if there is room for it. */
static void deliver(void) {
    if (length == LENGTH_BEGIN) {
        if (!tape_begin())
            return;
        begun = true;
    } else if (!begun || (sequence != last_sequence && sequence != (uint8_t)(last_sequence + 1))) {
        waiting = false;
        output_answer(FRAME_NAK, sequence);
        return;
    } else if (sequence == last_sequence) {
        /* A repeated frame: the acknowledgement was lost. */
    } else if (length == LENGTH_END) {
        tape_end();
    } else {
        if (tape_room() < length)
            return;
        tape_put(payload, length);
    }
    last_sequence = sequence;
    waiting = false;
    output_answer(FRAME_ACK, sequence);
}

/* FRAME_END has come. If it is not at its place, a byte was lost or came twice. */
static void end(void) {
    if (state != END || check != crc) {
        damaged();
        return;
    }
    state = CLOSED;
    waiting = true;
    part = FRAME_WHOLE;
    deliver();
}

static void take(uint8_t byte) {
    if (byte == FRAME_END) {
        end();
        return;
    }
    if (byte == FRAME_ESCAPE) {
        if (flip)
            damaged();
        flip = FRAME_FLIP;
        return;
    }
    byte ^= flip;
    flip = 0;
    if (state <= SEQUENCE)
        crc = crc_step(crc, byte);
    switch (state) {
    case LENGTH:
        length = byte;
        state = SEQUENCE;
        if (length > LONGEST && length != LENGTH_END)
            damaged();
        break;
    case SEQUENCE:
        sequence = byte;
        state = length == LENGTH_BEGIN || length == LENGTH_END ? CHECK_HIGH : PAYLOAD;
        break;
    case CHECK_HIGH:
        check = (uint16_t)(byte << 8);
        state = CHECK_LOW;
        break;
    case CHECK_LOW:
        check |= byte;
        state = END;
        break;
    default: damaged(); break;
    }
}

frame_part frame_byte(uint8_t byte) {
    part = FRAME_MORE;
    take(byte);
    return part;
}

/* A quick way for payload, most of what comes: a byte takes half the time that frame_byte needs. */
int frame_receive(unsigned *taken, unsigned most) {
    if (state != PAYLOAD)
        return hal_receive();
    uint16_t sum = crc;
    uint8_t turn = flip, *at = payload + count, *end_of_payload = payload + length;
    int entry = -1;
    while (*taken < most && at != end_of_payload) {
        entry = hal_receive();
        if (entry < 0 || entry & (int)HAL_MARK || entry == FRAME_START || entry == FRAME_END ||
            (entry == FRAME_ESCAPE && turn))
            break;
        ++*taken;
        if (entry == FRAME_ESCAPE) {
            turn = FRAME_FLIP;
        } else {
            *at = (uint8_t)entry ^ turn;
            sum = crc_step(sum, *at++);
            turn = 0;
        }
        entry = -1;
    }
    crc = sum;
    flip = turn;
    count = (uint8_t)(at - payload);
    if (at == end_of_payload)
        state = CHECK_HIGH;
    return at == end_of_payload && *taken < most ? hal_receive() : entry;
}

bool frame_wait(uint32_t clocks) {
    if (state == CLOSED || clocks <= stall_clocks)
        return false;
    bool empty = state == LENGTH && !flip;
    give_up();
    return !empty;
}

void frame_step(void) {
    if (waiting)
        deliver();
}
