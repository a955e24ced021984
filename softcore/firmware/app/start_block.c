// SPDX-License-Identifier: Apache-2.0
#include "app/start_block.h"

#include "app/events.h"
#include "app/machine.h"
#include "app/resume.h"
#include "base/settings.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "link/output.h"
#include "path/path.h"

#define FROM_WORD 6         /* characters of `$FROM=` */
#define FROM_DIGITS 8
#define M_FLUID_ON 8
#define M_FLUID_OFF 9

static uint32_t first;              /* block at which the tape begins, 0: no block is left out */
static bool skipped, fluid;
static int32_t place[HAL_AXES];     /* machine frame, where the next block begins, or was left */
static bool rests;                  /* the block was left within its motion */
static path_move rest;              /* what is left of it */

void start_block_line(const char *line, uint32_t length, fault *f) {
    uint32_t named = 0;
    bool number = length > FROM_WORD && length <= FROM_WORD + FROM_DIGITS;
    for (uint32_t i = FROM_WORD; number && i < length; i++) {
        number = line[i] >= '0' && line[i] <= '9';
        named = 10 * named + (uint32_t)(line[i] - '0');
    }
    resume_drop();
    if (!number)
        fault_at(f, FAULT_COMMAND, 0, "$FROM takes the number of a block of the next tape, as $FROM=7, or LAST");
    else if (!(first = named))
        resume_forget();
}

void start_block_last(const modal *state, fault *f) { first = resume_ask(state, f); }

void start_block_done(void) {
    first = 0;
    skipped = false;
    resume_drop();
}

void start_block_drop(void) {
    rests = false;
    start_block_done();
}

void start_block_begin(modal *state) {
    resume_begin(state, machine_dry());
    skipped = fluid = rests = false;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        place[axis] = state->position[axis];
}

bool start_block_skips(uint32_t line, const char *text, uint32_t length) {
    resume_text(text, length);
    bool skips = line < first;
    skipped = skipped || skips;
    return skips;
}

bool start_block_due(void) { return skipped || resume_asked(); }

static void add(const path_move *move) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        place[axis] += move->delta[axis];
}

void start_block_move(const plan *p) {
    if (p->corners)
        add(&p->corner);
    if (p->moves)
        add(&p->move);
}

void start_block_function(int32_t m) {
    if (m == M_FLUID_ON || m == M_FLUID_OFF)
        fluid = m == M_FLUID_ON;
}

bool start_block_fluid(void) { return fluid; }

bool start_block_goes(void) {
    unsigned jump = hal_jump_axis();
    int32_t way[HAL_AXES];
    bool across = false;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        way[axis] = place[axis] - hal_axis_command(axis);
        across = across || (axis != jump && way[axis]);
    }
    /* Up first, and down last. A wire machine has no jump axis: it goes straight there. */
    int32_t along = jump < HAL_AXES ? way[jump] : 0;
    bool up = along > 0;
    path_move move = {0};
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        if (axis == jump ? up || !across : !up)
            move.delta[axis] = way[axis];
    if (!across && !along)
        return false;
    /* No faster than contact can stop the axes at once. */
    uint32_t start = settings_start_rate(), highest = settings_highest_rate();
    path_append(&move, start < highest ? start : highest, true, false);
    machine_run(true);
    return true;
}

bool start_block_rests(void) { return rests; }

const path_move *start_block_rest(const path_move *move) {
    if (!rests)
        return move;
    rests = false;
    return rest.delta[0] || rest.delta[1] || rest.delta[2] ? &rest : 0;
}

bool start_block_tell(uint32_t line, const plan *p, fault *f) {
    if (resume_asked()) {
        if (!resume_matches(line, f))
            return false;
        rests = resume_rest(p, place, place, &rest);
    }
    watch_between(); /* the comparison, this line and the event that follows each take long */
    output_line("[MSG:block %u %s at X%p Y%p Z%p: ~ goes there without discharge, and on from there]",
                first, rests ? "was left" : "begins", place[0] - output_origin(0),
                place[1] - output_origin(1), place[2] - output_origin(2));
    watch_between();
    events_now(EVENT_WORD_PAUSE, "");
    return true;
}
