// SPDX-License-Identifier: Apache-2.0
#include "link/link.h"

#include "base/units.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "link/frame.h"
#include "link/lines.h"
#include "link/output.h"

/* Work of one step, counted in bytes of a frame's payload, 150 clocks each. A byte of a line costs
   two, the end of a line or a refusal costs several, and an answer ends the step. */
#define BURST 40
#define COST_BYTE 2
#define COST_LINE 12
#define COST_ANSWER BURST
#define QUIET_US 5000       /* after this pause the next byte starts a line or a frame */

static uint32_t last_byte;  /* clock in which the last byte was taken */
static uint32_t quiet_clocks;
static bool quiet;          /* the last byte was taken more than quiet_clocks ago */
static uint32_t errors;
static char order_end;      /* a line's end that was left for this step, or 0 */
static link_come come;      /* what this step has received */

void link_restart(void) {
    quiet = false;
    lines_restart();
    frame_restart();
}

void link_init(void) {
    lines_init();
    frame_init();
    link_restart();
    errors = 0;
    /* Start in a pause: if the first step finds no byte, the line is quiet at once. */
    quiet_clocks = units_clocks_of_us(QUIET_US);
    last_byte = hal_cycle_low() - quiet_clocks - 1;
}

uint32_t link_errors(void) { return errors; }
bool link_rests(void) { return quiet && !frame_open() && output_empty(); }
bool link_order_waits(void) { return order_end; }

/* Take a mark that the receiver put into the queue: a reset, or an error at this place. */
__attribute__((noinline)) static unsigned take_mark(unsigned mark) {
    if (mark == MARK_RESET) {
        come = LINK_RESET;
        return COST_ANSWER;
    }
    errors++;
    if (frame_open()) {
        frame_damaged();
        lines_frame_bad();
    } else {
        lines_damaged(mark);
    }
    return COST_BYTE;
}

static unsigned take_frame(uint8_t byte) {
    switch (frame_byte(byte)) {
    case FRAME_WHOLE: lines_frame_good(); break;
    case FRAME_BROKEN: lines_frame_bad(); break;
    default: break;
    }
    return COST_BYTE;
}

/* Take an entry of the receive queue; returns its cost. */
__attribute__((noinline)) static unsigned take(unsigned entry) {
    if (entry & HAL_MARK)
        return take_mark(entry & ~HAL_MARK);
    if (entry == FRAME_START) {
        lines_cut();
        frame_begin();
        return COST_LINE;
    }
    if (frame_open())
        return take_frame((uint8_t)entry);
    if (entry == FRAME_END) {
        lines_frame_end();
        return COST_LINE;
    }
    if (entry == '\n' || entry == '\r')
        watch_between(); /* to judge a line takes as long as many bytes */
    switch (lines_byte((uint8_t)entry)) {
    case LINES_MORE: return COST_BYTE;
    case LINES_ENDED: return COST_LINE;
    case LINES_RESUME: come = LINK_RESUME; return COST_ANSWER;
    case LINES_RETRACT: come = LINK_RETRACT; return COST_ANSWER;
    default: return COST_ANSWER;
    }
}

/* Does an entry end an order? An order ends only at the start of a step, and no byte is taken behind
   it, as its answer takes as long as all bytes of a step. */
static bool ends_order(int entry) {
    return (entry == '\n' || entry == '\r') && !frame_open() && lines_order();
}

link_come link_take(void) {
    unsigned spent = 0;
    int entry;
    come = LINK_NOTHING;
    if (order_end) {
        spent = take((uint8_t)order_end);
        order_end = 0;
    }
    while (come == LINK_NOTHING && spent < BURST && (entry = frame_receive(&spent, BURST)) >= 0) {
        if (spent && ends_order(entry)) {
            order_end = (char)entry;
            break;
        }
        spent += take((unsigned)entry);
    }
    return spent && come == LINK_NOTHING ? LINK_TAKEN : come;
}

bool link_step(bool taken) {
    if (taken) {
        last_byte = hal_cycle_low();
        quiet = false;
    } else if (!quiet || frame_open()) {
        uint32_t since = hal_cycle_low() - last_byte;
        if (frame_wait(since))
            lines_frame_stalled();
        if (!quiet && since > quiet_clocks) {
            quiet = true;
            lines_quiet();
        }
    }
    frame_step();
    /* An order and its answer take as long as the bytes that a step sends: those wait for the next. */
    return (come <= LINK_TAKEN && output_step()) || taken;
}
