// SPDX-License-Identifier: Apache-2.0
/* The link of the model machine: a model of softcore.link_decoder, byte by byte. */
#include "hal/hal.h"
#include "hal/regs.h"
#include "pc/host.h"

#define BYTES (1u << 16)
#define BYTE_CLOCKS 80              /* time that the firmware spends on a byte */

static uint16_t queue[BYTES];       /* entries like those of the register `receive` */
static uint32_t head, tail, depth;
static uint8_t said[BYTES];
static uint32_t said_head, said_tail;
static bool hold, reset, reset_told;
static uint32_t notes;
static hal_overrides override;

void host_link_boot(void) {
    head = tail = said_head = said_tail = 0;
    depth = BYTES;
    hold = reset = reset_told = false;
    notes = 0;
    override = (hal_overrides){100, 100};
}

bool host_link_held(void) { return hold || reset; }
void gk_queue(uint32_t entries) { depth = entries; }

static void push(unsigned entry) {
    if (head - tail < depth)
        queue[head++ % BYTES] = (uint16_t)entry;
}

static uint8_t within(int32_t value, int32_t least, int32_t most) {
    return (uint8_t)(value < least ? least : value > most ? most : value);
}

/* Carry out a byte of an override; false if it is not one. */
static bool overrides(uint8_t byte) {
    enum { feed_LEAST = OVERRIDE_FEED_LEAST, feed_MOST = OVERRIDE_FEED_MOST,
           rapid_LEAST = OVERRIDE_RAPID_LEAST, rapid_MOST = OVERRIDE_RAPID_MOST };
    switch (byte) {
#define ROW(code, of, to, by) \
    case code: \
        override.of = within((to) ? (to) : override.of + (by), of##_LEAST, of##_MOST); \
        return true;
        OVERRIDE_BYTES(ROW)
#undef ROW
    default: return false;
    }
}

static void come(uint8_t byte) {
    switch (byte) {
    case REALTIME_STATUS: notes |= NOTE_STATUS; break;
    case REALTIME_HOLD:
    case REALTIME_DOOR:
        notes |= NOTE_HOLD;
        hold = true;
        break;
    case REALTIME_RESUME: notes |= NOTE_RESUME; break;
    case REALTIME_RETRACT: notes |= NOTE_RETRACT; break;
    case REALTIME_STOP: notes |= NOTE_STOP; break;
    case REALTIME_CANCEL: notes |= NOTE_CANCEL; break;
    case REALTIME_RESET:
        reset = true;
        reset_told = false;
        tail = head;
        push(HAL_MARK | MARK_RESET);
        break;
    default:
        if (REALTIME_PASSED_OVER(byte) || overrides(byte))
            break;
        push(head - tail < depth - 1 ? byte : HAL_MARK | MARK_OVERRUN);
        break;
    }
}

uint32_t gk_send(const uint8_t *bytes, uint32_t length) {
    for (uint32_t i = 0; i < length; i++)
        come(bytes[i]);
    return length;
}

void gk_send_broken(void) { push(HAL_MARK | MARK_FRAMING); }

uint32_t gk_receive(uint8_t *bytes, uint32_t size) {
    uint32_t count = 0;
    while (count < size && said_tail != said_head)
        bytes[count++] = said[said_tail++ % BYTES];
    return count;
}

int hal_receive(void) {
    if (head == tail)
        return -1;
    host_cost(BYTE_CLOCKS);
    int entry = queue[tail++ % BYTES];
    if (entry == (HAL_MARK | MARK_RESET))
        reset_told = true;
    return entry;
}

uint32_t hal_notes(void) {
    uint32_t read = notes;
    notes = 0;
    return read;
}

void hal_release_hold(void) { hold = hold && notes & NOTE_HOLD; }
void hal_release_reset(void) { reset = reset && !reset_told; }
void hal_release_override(void) { override = (hal_overrides){100, 100}; }
hal_overrides hal_overrides_read(void) { return override; }
uint32_t gk_override(void) { return (uint32_t)override.feed << 8 | override.rapid; }
uint32_t hal_waiting(void) { return head - tail; }

bool hal_transmit_ready(void) { return said_head - said_tail < BYTES; }

void hal_transmit(uint8_t byte) {
    if (hal_transmit_ready())
        said[said_head++ % BYTES] = byte;
}
