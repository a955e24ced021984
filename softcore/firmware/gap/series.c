// SPDX-License-Identifier: Apache-2.0
#include "gap/series.h"

#include "app/events.h"
#include "app/program.h"
#include "gap/gap.h"
#include "gap/law.h"
#include "link/output.h"

typedef struct {
    int32_t depth;              /* machine frame */
    technology_row row;
} series_row;

static series_row steps[SERIES_STEPS];
static bool running;
static unsigned count;          /* steps: the first `told` have been switched and told of, */
static unsigned next, told;     /* those before `next` switched */
static bool armed;              /* the next is staged, and the gateware may switch */
static uint8_t seen;            /* switches that the gateware had counted before */
static bool reached;            /* the condition in force is one of the series */

bool series_check(int32_t depth, int32_t offset, const technology_row *row, unsigned law,
                  uint32_t column, fault *f) {
    if (running && count == SERIES_STEPS)
        return fault_at(f, FAULT_CONDITION, column, "no more than %u steps fit a series (G39)",
                        (uint32_t)SERIES_STEPS);
    if (running && depth >= steps[count - 1].depth)
        return fault_at(f, FAULT_CONDITION, column,
                        "a step of G39 must lie deeper than the one before it, at %p mm",
                        steps[count - 1].depth - offset);
    return law_check(law, row, column, f);
}

void series_add(int32_t depth, const technology_row *row) {
    if (!running) {
        hal_condition_restart();
        running = true;
        count = next = told = 0;
    }
    if (count < SERIES_STEPS)
        steps[count++] = (series_row){depth, *row};
}

bool series_law(unsigned law, uint32_t column, fault *f) {
    if (reached && !law_check(law, gap_row(), column, f))
        return false;
    for (unsigned i = next; running && i < count; i++)
        if (!law_check(law, &steps[i].row, column, f))
            return false;
    return true;
}

const technology_row *series_unseen(void) {
    const technology_row *row = gap_row();
    if (row && !technology_seen(row))
        return row;
    for (unsigned i = next; running && i < count; i++)
        if (!technology_seen(&steps[i].row))
            return &steps[i].row;
    return 0;
}

/* Has the gateware switched to the step that is staged? */
static void look(void) {
    if (!armed || hal_condition_count() == seen)
        return;
    armed = false;
    reached = true;
    gap_switched(&steps[next++].row);
}

bool series_take_stage(void) {
    if (armed) {
        hal_condition_disarm();
        look();
        armed = false;
    }
    return !hal_condition_pending();
}

void series_drop(void) {
    (void)series_take_stage();
    running = false;
    count = next;
}

bool series_end(void) {
    (void)series_take_stage();
    if (running && told != next)
        return false;
    series_drop();
    return true;
}

void series_replaced(void) { reached = false; }
bool series_reached(void) { return reached; }

bool series_step(void) {
    look();
    if (armed || !running || next == count || hal_condition_pending())
        return false;
    gap_stage(&steps[next].row);
    seen = hal_condition_count();
    armed = true;
    hal_condition_arm(steps[next].depth);
    return true;
}

void series_switched(const hal_event *event, uint64_t cycle) {
    look();
    if (told == next)
        return;
    const series_row *step = &steps[told++];
    unsigned axis = hal_jump_axis();
    int32_t position[HAL_AXES];
    for (unsigned i = 0; i < HAL_AXES; i++)
        position[i] = i == axis ? (int32_t)event->first : event->encoder[i];
    output_event("condition", cycle, events_line(), position, ",%u,%u,%d", step->row.number,
                 (uint32_t)step->row.milli_ip, step->depth - program_offset()[axis]);
}
