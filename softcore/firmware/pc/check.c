// SPDX-License-Identifier: Apache-2.0
/* Checking of tapes for a computer; see host.h. */
#include "pc/host.h"

#include "gap/gap.h"
#include "interp/wire_offset.h"
#include "path/arc.h"

#include <string.h>

#include "base/grbl.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "interp/interpreter.h"
#include "interp/plan.h"
#include "interp/reader.h"
#include "roughing/result.h"

/* The machine that a tape is checked for. By default it has the clock and the axes of the built-in
   sinker, and unlimited travel. */
static const struct check_machine {
    uint32_t clock_hz, pulses_per_mm, jump_axis;
    bool travel;
} SINKER = {2000000, 10000, 2, false};
static struct check_machine judged;
#define CHECK_SETTINGS 64       /* most settings entered by hand */

/* The state after the lines entered by hand. */
static modal entered;
static struct {
    uint32_t number, value;
} assigned[CHECK_SETTINGS];
static unsigned assignments;

static modal fresh(void) {
    modal state = {0};
    plan_start(&state);
    return state;
}

static void nothing(void) {}

static void prepare(void) {
    units_init(judged.clock_hz, judged.pulses_per_mm);
    settings_init(nothing, nothing);
    for (unsigned i = 0; i < assignments; i++)
        settings_set(assigned[i].number, assigned[i].value);
    if (!judged.travel) {       /* no machine is given: its supply has the steps of the setting */
        uint32_t steps = CONDITIONS_MAX_MA / settings_get(SET_CURRENT_STEP_MA);
        gk_level_limit(steps < CONDITIONS_LEVELS ? steps : CONDITIONS_LEVELS);
    }
    result_presume();
}

static const travel_range *travel(void) {
    return judged.travel ? settings_travel() : &TRAVEL_ALL;
}

static void forget(void) {
    assignments = 0;
    prepare();
    gap_init();
    entered = fresh();
}

void gk_check_forget(void) {
    judged = SINKER;
    forget();
}

void gk_check_machine(uint32_t clock_hz, uint32_t pulses_per_mm, uint32_t jump_axis,
                      uint32_t level_limit) {
    gk_boot(clock_hz, pulses_per_mm, jump_axis); /* the travel depends on the jump axis */
    gk_level_limit(level_limit);
    judged = (struct check_machine){clock_hz, pulses_per_mm, jump_axis, true};
    forget();
}

static bool parse(block *words, const char *text, uint32_t length, fault *f) {
    block_begin(words, text, length);
    block_result result;
    do
        result = block_step(words, settings_get(SET_BLOCK_SKIP), 16, f);
    while (result == BLOCK_MORE);
    if (result == BLOCK_FAULT)
        interpreter_unread(words, f);
    return result == BLOCK_DONE;
}

static bool judge(const block *words, const modal *state, bool by_hand, plan *p, fault *f) {
    plan_result result = PLAN_FAULT;
    if (interpreter_block(words, state, by_hand, settings_highest_speed(), travel(),
                          judged.jump_axis, p, f))
        do
            result = interpreter_arc_step(p, travel(), f);
        while (result == PLAN_MORE);
    return result == PLAN_DONE;
}

/* Carry out the changes of the depth series, as later blocks are judged by its state. */
static void follow_depth_series(const plan *p) {
    if (p->changes_condition || p->stop == STOP_END ||
        (p->act == ACT_DEPTH_SERIES && !p->step_condition))
        depth_series_drop();
    if (p->act == ACT_DEPTH_SERIES && p->step_condition)
        depth_series_add(p->step_depth, p->step_condition);
}

/* A line that begins with `$`. Without a machine, only settings have a meaning. */
static bool assign(const char *line, uint32_t length, fault *f) {
    uint32_t number, value;
    if (length < 2 || line[1] < '0' || line[1] > '9')
        return fault_at(f, FAULT_COMMAND, 0, "of the lines with $ a check takes settings only");
    if (grbl_refuses(line, length, f) || !settings_read(line, length, &number, &value, f) ||
        !settings_enter(number, value, f))
        return false;
    if (assignments == CHECK_SETTINGS)
        return fault_at(f, FAULT_SETTING, 0, "a check takes no more than %u settings",
                        (uint32_t)CHECK_SETTINGS);
    assigned[assignments].number = number;
    assigned[assignments++].value = value;
    return true;
}

int gk_check_line(const char *line, char *message, uint32_t size) {
    block words;
    plan p;
    fault f = {0};
    prepare();
    if (line[0] == '$') {
        if (assign(line, (uint32_t)strlen(line), &f))
            return 0;
    } else if (parse(&words, line, (uint32_t)strlen(line), &f) &&
        judge(&words, &entered, true, &p, &f)) {
        entered = p.after;
        follow_depth_series(&p);
        return 0;
    }
    fault_sentence(&f, message, size);
    return -1;
}

static void record(gk_record *r, uint32_t line, const plan *p, bool skipped) {
    retraction_layer set = retraction_combined(&p->after.memory);
    *r = (gk_record){.line = line, .skipped = skipped};
    if (skipped)
        return;
    r->moves = p->moves;
    r->speed = p->speed;
    r->act = p->act;
    r->stop = p->stop;
    r->machining = p->machining_on ? 1 : p->machining_off ? -1 : 0;
    r->condition = p->changes_condition ? p->after.condition->number : 0;
    r->s = p->s;
    r->t = p->t;
    r->fluid_off = p->fluid_off;
    bool more = true;
    for (unsigned i = 0; i < BLOCK_CODES; i++) {
        more = more && p->m[i] >= 0;
        r->m[i] = more ? p->m[i] : -1;
    }
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        r->delta[axis] = p->move.delta[axis];
    r->given = set.given;
    for (unsigned item = 0; item < ITEMS; item++)
        r->items[item] = set.given & (1u << item) ? set.value[item] : 0;
    r->dwell = p->dwell;
    r->jump_period = p->after.jump.period;
    r->jump_distance = p->after.jump.distance;
    r->jump_speed = p->after.jump.speed;
    r->jump_high = p->after.jump.high;
    r->servo = p->changes_servo ? p->after.served ? p->after.served : -1 : 0;
    r->arc = p->move.arc ? p->move.ccw ? 1 : -1 : 0;
    r->plane = p->move.plane;
    r->centre[0] = p->move.centre[0];
    r->centre[1] = p->move.centre[1];
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        r->offset[axis] = p->after.offset[axis];
    for (unsigned axis = 0; axis < HAL_AXES && p->corners; axis++)
        r->via[axis] = p->corner.delta[axis];
}

static struct {
    gk_motion *at;
    uint32_t count, room;
} motions;

static void note_motion(const path_move *m, uint32_t line, uint32_t speed) {
    if (motions.count++ >= motions.room)
        return;
    *motions.at++ = (gk_motion){line, {m->delta[0], m->delta[1], m->delta[2]},
                                m->arc ? m->ccw ? 1 : -1 : 0, m->plane,
                                {m->centre[0], m->centre[1]}, speed};
}

/* Give a block to the wire offset, and note what would be carried out then. */
static bool compensate(const block *words, plan *p, fault *f) {
    bool empty = !words->present && !words->g_count && !words->m_count;
    if (!wire_offset_take(p, words->text, empty ? 0 : words->length, f->line, f->block, f))
        return false;
    plan_result result;
    do
        result = wire_offset_step(travel(), f);
    while (result == PLAN_MORE);
    if (result == PLAN_FAULT)
        return false;
    for (const wire_offset_block *out; (out = wire_offset_next());) {
        if (out->p->corners)
            note_motion(&out->p->corner, out->line, out->p->corner_speed);
        if (out->p->moves)
            note_motion(&out->p->move, out->line, out->p->speed);
    }
    return true;
}

int gk_check_records(const uint8_t *tape, uint32_t length, int tv, gk_record *records,
                     uint32_t count, uint32_t place[3], char *message, uint32_t size) {
    reader r;
    block words;
    plan p = {0};
    modal state = entered;
    uint32_t blocks = 0;
    fault f = {0};
    prepare();
    gap_start();
    plan_start(&state);
    wire_offset_reset();
    reader_begin(&r, tv);
    for (uint32_t i = 0; i < length && f.code == FAULT_NONE; i++) {
        reader_result result = reader_byte(&r, tape[i], &f);
        if (result == READER_ENDED)
            break;
        if (result != READER_BLOCK)
            continue;
        f.line = r.line;
        if (!parse(&words, r.text, r.length, &f)) {
            f.block = block_has(&words, 'N') ? block_name(&words, 'N') : 0;
            break;
        }
        if (!words.skipped) {
            if (!judge(&words, &state, false, &p, &f))
                break;
            state = p.after;
            follow_depth_series(&p);
        }
        if (blocks < count)
            record(&records[blocks], r.line, &p, words.skipped);
        if (!words.skipped && !compensate(&words, &p, &f))
            break;
        blocks++;
        f = (fault){0};
        if (!words.skipped && p.stop == STOP_END)
            reader_stop(&r);
        else
            reader_next(&r);
    }
    if (f.code == FAULT_NONE && reader_finish(&r, &f))
        return (int)blocks;
    if (place) {
        place[0] = f.code;
        place[1] = f.line;
        place[2] = f.column;
    }
    fault_sentence(&f, message, size);
    return -1;
}

int gk_check_motions(const uint8_t *tape, uint32_t length, gk_motion *to, uint32_t count,
                     uint32_t place[3], char *message, uint32_t size) {
    motions.at = to;
    motions.room = count;
    motions.count = 0;
    int blocks = gk_check_records(tape, length, 0, 0, 0, place, message, size);
    motions.room = 0;
    return blocks < 0 ? -1 : (int)motions.count;
}

int gk_check(const uint8_t *tape, uint32_t length, char *message, uint32_t size) {
    return gk_check_records(tape, length, 0, 0, 0, 0, message, size);
}

int32_t gk_distance(uint64_t digits, uint32_t decimals, int inch, int32_t *pulses) {
    return units_distance((units_number){digits, decimals}, inch, pulses);
}

int32_t gk_speed_of(uint64_t digits, uint32_t decimals, int inch, uint32_t *um_per_min) {
    return units_speed((units_number){digits, decimals}, inch, um_per_min);
}

uint32_t gk_rate(uint32_t um_per_min) { return units_rate(um_per_min); }
uint32_t gk_speed_of_rate(uint32_t rate) { return units_speed_of_rate(rate); }
uint32_t gk_acceleration(uint32_t mm_per_s2) { return units_acceleration(mm_per_s2); }
uint32_t gk_lead(uint32_t percent, uint32_t per_s) { return units_lead(percent, per_s); }
uint32_t gk_root(uint64_t square) { return units_root(square); }

uint32_t gk_speed_of_count(uint32_t pulses, uint32_t clocks) {
    return units_speed_of_count(pulses, clocks);
}

uint32_t gk_braking(uint32_t rate, uint32_t start_rate, uint32_t acceleration) {
    return units_braking(rate, start_rate, acceleration);
}

int32_t gk_overflow(int32_t number) { return number + 1; }

uint32_t gk_record_size(void) { return sizeof(gk_record); }

static arc prepared;

void gk_arc(const int32_t delta[3], int32_t ccw, int32_t plane, const int32_t centre[2],
            uint32_t numbers[4], int32_t directions[2][3]) {
    path_move move = {.arc = true, .ccw = ccw, .plane = (move_plane)plane};
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        move.delta[axis] = delta[axis];
    move.centre[0] = centre[0];
    move.centre[1] = centre[1];
    arc_begin(&prepared, &move);
    uint32_t calls = 1;
    while (!arc_prepare(&prepared))
        calls++;
    numbers[0] = arc_pieces(&prepared);
    numbers[1] = arc_length(&prepared);
    numbers[2] = arc_radius(&prepared);
    numbers[3] = calls;
    for (unsigned end = 0; end < 2; end++)
        arc_direction(&prepared, end, directions[end]);
}

uint32_t gk_arc_piece(uint32_t index, gk_segment *piece) {
    hal_segment made;
    uint32_t before = arc_piece(&prepared, index, &made);
    gk_words(&made, piece);
    return before;
}
