// SPDX-License-Identifier: Apache-2.0
#include "gap/depth_series.h"

#include "gap/feed_modes.h"
#include "gap/in_force.h"
#include "hal/hal.h"

static depth_step steps[DEPTH_SERIES_STEPS];
static bool running;
static unsigned count;          /* number of steps */
static unsigned next, told;     /* steps before `next` are switched, before `told` also told */
static bool armed;              /* the next step is staged, and the gateware may switch to it */
static uint8_t seen;            /* count of the gateware's switches when it was armed */
static bool reached;            /* the condition in force is one of the depth series */

bool depth_series_check(int32_t depth, int32_t offset, const condition_row *row, unsigned mode,
                        uint32_t column, fault *f) {
    if (running && count == DEPTH_SERIES_STEPS)
        return fault_at(f, FAULT_CONDITION, column, "no more than %u steps fit a series (G39)",
                        (uint32_t)DEPTH_SERIES_STEPS);
    if (running && depth >= steps[count - 1].depth)
        return fault_at(f, FAULT_CONDITION, column,
                        "a step of G39 must lie deeper than the one before it, at %p mm",
                        steps[count - 1].depth - offset);
    return feed_modes_check(mode, row, column, f);
}

void depth_series_add(int32_t depth, const condition_row *row) {
    if (!running) {
        hal_condition_restart();
        running = true;
        count = next = told = 0;
    }
    if (count < DEPTH_SERIES_STEPS)
        steps[count++] = (depth_step){depth, *row};
}

bool depth_series_check_mode(unsigned mode, uint32_t column, fault *f) {
    if (reached && !feed_modes_check(mode, in_force_row(), column, f))
        return false;
    for (unsigned i = next; running && i < count; i++)
        if (!feed_modes_check(mode, &steps[i].row, column, f))
            return false;
    return true;
}

const condition_row *depth_series_unseen(void) {
    const condition_row *row = in_force_row();
    if (row && !conditions_seen(row))
        return row;
    for (unsigned i = next; running && i < count; i++)
        if (!conditions_seen(&steps[i].row))
            return &steps[i].row;
    return 0;
}

/* Notice whether the gateware has switched to the staged step. */
static void look(void) {
    if (!armed || hal_condition_count() == seen)
        return;
    armed = false;
    reached = true;
    in_force_switched(&steps[next++].row);
}

bool depth_series_take_stage(void) {
    if (armed) {
        hal_condition_disarm();
        look();
        armed = false;
    }
    return !hal_condition_pending();
}

__attribute__((noinline)) void depth_series_drop(void) {
    (void)depth_series_take_stage();
    running = false;
    count = next;
}

bool depth_series_end(void) {
    (void)depth_series_take_stage();
    if (running && told != next)
        return false;
    depth_series_drop();
    return true;
}

void depth_series_replaced(void) { reached = false; }
bool depth_series_reached(void) { return reached; }

bool depth_series_waits(void) {
    look();
    return running && !armed && next != count;
}

bool depth_series_step(void) {
    if (!depth_series_waits() || hal_condition_pending())
        return false;
    in_force_stage(&steps[next].row);
    seen = hal_condition_count();
    armed = true;
    hal_condition_arm(steps[next].depth);
    return true;
}

const depth_step *depth_series_switched(void) {
    look();
    return told == next ? 0 : &steps[told++];
}
