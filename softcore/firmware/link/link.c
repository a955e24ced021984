// SPDX-License-Identifier: Apache-2.0
#include "link/link.h"

#include "base/units.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "link/frame.h"
#include "link/lines.h"
#include "link/output.h"

/* What is taken per step, in bytes of a frame's payload. A byte of a line takes as long as two of them,
   150 clocks each; the end of a line, or what is refused, as long as several; more than an answer is not
   said. */
#define BURST 40
#define COST_BYTE 2
#define COST_LINE 12
#define COST_ANSWER BURST
#define QUIET_US 5000       /* without a byte: what comes then is the start of something */

static uint32_t last_byte;  /* clock in which the last one was taken */
static uint32_t quiet_clocks;
static bool quiet;          /* that was so long ago */
static uint32_t errors;
static char order_end;      /* the character that was put off to this step, or 0 */
static link_come come;      /* what has come in this step */

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
    /* What the first step finds came before; if there is nothing the line is quiet. */
    quiet_clocks = units_clocks_of_us(QUIET_US);
    last_byte = hal_cycle_low() - quiet_clocks - 1;
}

uint32_t link_errors(void) { return errors; }
bool link_rests(void) { return quiet && !frame_open() && output_empty(); }
bool link_order_waits(void) { return order_end; }

/* The receiver saw an error where the entry stands. */
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

/* Take an entry of the receive queue; what that costs. */
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
    switch (lines_byte((uint8_t)entry)) {
    case LINES_MORE: return COST_BYTE;
    case LINES_ENDED: return COST_LINE;
    case LINES_RESUME: come = LINK_RESUME; return COST_ANSWER;
    case LINES_RETRACT: come = LINK_RETRACT; return COST_ANSWER;
    default: return COST_ANSWER;
    }
}

/* The end of an order begins a step: its answer takes as long as a burst of bytes. */
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
    while (spent < BURST && (entry = frame_receive(&spent, BURST)) >= 0) {
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
    return output_step() || taken;
}
