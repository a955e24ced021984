// SPDX-License-Identifier: Apache-2.0
#include "app/resume.h"

#include "app/machine.h"
#include "base/settings.h"
#include "base/watch.h"
#include "gap/conditions.h"
#include "gap/in_force.h"
#include "interp/arc_words.h"
#include "interp/plane.h"
#include "link/output.h"
#include "path/path.h"
#include "store/bookmark.h"

/* Pulses. Where it was left so near to its beginning, a block begins anew. Of an arc this counts in its
   plane: on a full circle that is near to its end, too. */
#define NEAR 16

static bool asked;              /* the next tape is to go on */
static bool kept;               /* the tape under way moves the bookmark */
static uint32_t ours;           /* machine frame of the bookmark; 0: it is from before power-on */
static bool begun;              /* a tape has started, and not come to its first block */
static bookmark first;          /* what its first block makes of the bookmark */
static uint32_t sum;            /* of the tape's text so far */
static const modal *now;        /* the state of the tape under way; 0 before the first tape */
static uint32_t edition, entered;   /* its edition, and the sum of what outlives a tape in it */
static uint32_t under;          /* number of the block under way on the path; 0: none of a tape */
/* Where an alarm left it: 1 more than the motions before the one in which it was, 0: unknown. */
static uint32_t left_in;
static int32_t left[HAL_AXES];
static bool rests;              /* of the first block of this tape only a rest is carried out */
static uint32_t rest_of;        /* the block of which only a rest was carried out, without a corner */
static uint32_t before;         /* sum of what else was entered before the tape began */

static uint32_t mix(uint32_t total, uint32_t more) {
    total = (total ^ more) * 0x9e3779b1u;
    return total ^ total >> 15;
}

static uint32_t mix_all(uint32_t total, const void *from, unsigned count) {
    for (const uint32_t *next = from; count--; next++)
        total = mix(total, *next);
    return total;
}

void resume_open(void (*between)(void)) {
    asked = kept = begun = false;
    ours = 0;
    now = 0;
    bookmark_open(between);
}

void resume_tell(void) {
    if (bookmark_now()->line)
        output_line("[MSG:a tape was interrupted in block %u: $H, $FROM=last and the same tape go on there.]",
                    bookmark_now()->line);
}

/* Is the machine frame that of the interrupted run, and program zero where it was? */
static bool is_there(const int32_t *zero, fault *f) {
    const bookmark *last = bookmark_now();
    if (!last->line)
        return fault_at(f, FAULT_START_BLOCK, 0, "no tape was interrupted");
    if (ours != machine_frame() && !(last->homed && machine_homed()))
        return fault_at(f, FAULT_START_BLOCK, 0,
                        "$FROM=last needs $H before that run and now; $FROM=%u begins there without it",
                        last->line);
    int32_t way[HAL_AXES];
    bool same = true;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        same = same && zero[axis] == last->zero[axis];
        way[axis] = hal_axis_command(axis) - last->zero[axis];
    }
    return same ||
           fault_at(f, FAULT_START_BLOCK, 0,
                    "program zero is not where it was; here, in G54 and G21, G92 X%p Y%p Z%p sets it",
                    way[0], way[1], way[2]);
}

uint32_t resume_ask(const modal *state, fault *f) {
    int32_t zero[HAL_AXES];
    /* Tapes start in G54. */
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        zero[axis] = state->offset[axis] - state->systems[state->system][axis] + state->systems[0][axis];
    asked = is_there(zero, f);
    return asked ? bookmark_now()->line : 0;
}

bool resume_asked(void) { return asked; }
void resume_drop(void) { asked = false; }

void resume_forget(void) {
    under = left_in = 0;
    if (bookmark_now()->line)
        bookmark_move(0, 0);
}

/* Of what a tape uses but does not enter, and the journal keeps: settings of drives, screws and frame,
   conditions and classes of the fluid. */
static uint32_t entered_before(void) {
    uint32_t total = 0;
    for (setting at = 0; at < SETTINGS; at++) {
        if (at % 64 == 0)
            watch_between();
        setting_group group = settings_row(at)->group;
        if (group == GROUP_TRAVEL || group == GROUP_DRIVES ||
            (group == GROUP_PITCH && settings_differs(at)))
            total = mix(total + at, settings_get(at));
    }
    watch_between();
    total = mix_all(total, in_force_kept_class(0), GAP_CLASSES * sizeof(gap_class) / sizeof total);
    watch_between();
    const condition_row *row;
    for (unsigned place = 0; (row = conditions_by_hand(place)); place++)
        total = mix_all(total, row, sizeof *row / sizeof total);
    watch_between();
    return total;
}

void resume_begin(modal *state, bool dry) {
    now = state;
    kept = begun = !dry;
    rests = false;
    under = 0;
    sum = edition = 0;
    before = entered_before();
    first.homed = machine_homed();
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        if (asked)
            state->position[axis] = bookmark_now()->start[axis];
        first.start[axis] = state->position[axis];
        first.zero[axis] = state->offset[axis];
    }
}

__attribute__((noinline)) void resume_text(const char *text, uint32_t length) {
    for (uint32_t i = 0; i < length; i++)
        sum = mix(sum, (uint8_t)text[i]);
    sum = mix(sum, length);
}

__attribute__((noinline)) uint32_t resume_digest(uint32_t line) {
    if (!now)
        return 0;
    if (edition != now->edition) {
        const retraction_layer *mdi = &now->memory.mdi;
        watch_between();
        edition = now->edition;
        entered = mix_all(before, now->systems, PLAN_KEPT);
        for (unsigned item = 0; item < ITEMS; item++)
            if (mdi->given >> item & 1)
                entered = mix(entered + item, (uint32_t)mdi->value[item]);
        watch_between(); /* this takes long, and so does what comes around it */
    }
    /* Position and offsets follow from the text, what was entered, and where the tape began. */
    return mix(mix(sum, entered), line);
}

__attribute__((noinline)) void resume_at(uint32_t line, uint32_t digest, uint32_t number) {
    if (!kept)
        return;
    under = number;
    left_in = 0;
    if (begun) {
        rest_of = rests ? line : 0;
        first.line = line;
        first.digest = digest;
        bookmark_put(&first);
    } else {
        bookmark_move(line, digest);
    }
    begun = false;
    ours = machine_frame();
}

void resume_end(void) {
    if (kept)
        resume_forget();
}

bool resume_matches(uint32_t line, fault *f) {
    return is_there(first.zero, f) &&
           ((line == bookmark_now()->line && resume_digest(line) == bookmark_now()->digest) ||
            fault_at(f, FAULT_START_BLOCK, 0,
                     "not the interrupted tape, or settings, G10, G28.1, G30.1, G36 by hand "
                     "have changed; see $FROM=%u", bookmark_now()->line));
}

void resume_leave(void) {
    if (hal_motion_read().moving && !hal_safe())
        return;
    uint32_t within = under ? path_within() : 0;
    if (within)
        left_in = within - under + 1;
    under = 0;
    for (unsigned axis = 0; within && axis < HAL_AXES; axis++)
        left[axis] = hal_axis_command(axis);
}

bool resume_rest(const plan *p, const int32_t from[HAL_AXES], int32_t at[HAL_AXES],
                 path_move *rest) {
    bool corner = p->corners && rest_of != bookmark_now()->line;
    uint32_t main = 1 + (corner ? p->corner.arc ? 2u : 1u : 0u);
    if (left_in != main || ours != machine_frame() || !p->moves || p->act == ACT_TOUCH)
        return false;
    *rest = p->move;
    const plane_axes *axes = &PLANE_AXES[p->move.plane];
    bool more = false; /* of an arc, in its plane */
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t way = left[axis] - from[axis] - (p->corners ? p->corner.delta[axis] : 0);
        rest->delta[axis] -= way;
        if (rest->arc && axis == axes->third)
            continue;
        int32_t *centre = &rest->centre[axis == axes->second];
        *centre = (int32_t)((uint32_t)*centre - (uint32_t)way * MOVE_FINE);
        rests = rests || way > NEAR || way < -NEAR;
        more = more || rest->delta[axis] > NEAR || rest->delta[axis] < -NEAR;
    }
    /* So short a piece of a circle is a line. */
    rest->arc = rest->arc && more;
    rests = rests && (!rest->arc || arc_words_round(rest));
    for (unsigned axis = 0; rests && axis < HAL_AXES; axis++)
        at[axis] = left[axis];
    return rests;
}

bool resume_step(void) {
    bool failed = bookmark_failed(), more = bookmark_step();
    if (bookmark_failed() && !failed)
        output_line("[MSG:the flash memory does not keep the block of the tape: what it tells at power-on may be old.]");
    return more;
}
