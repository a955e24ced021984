// SPDX-License-Identifier: Apache-2.0
/* A model machine for the firmware on a computer. It stands still, or follows the path at once. It
   does not model time, servo or gap; the real gateware is simulated elsewhere. */
#include "app/events.h"
#include "app/main_loop.h"
#include "base/move.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "pc/host.h"

#define PASS_CLOCKS 1000
#define QUEUE 16

static uint32_t clock_hz, pulses_per_mm, jump_axis;
static hal_segment slots[HAL_SLOTS];
static int32_t bounds[BOUNDS];
static int32_t position, front;
static uint32_t slot, offset;       /* place in the segment */
static bool begun;                  /* the first segment has been entered */
static unsigned entered_slot;
static int32_t base[HAL_AXES];      /* axes at the start of the segment */
static int32_t frame[HAL_AXES];     /* machine frame less gk_axis */
static int32_t stood[HAL_AXES];     /* axes after the last pulse */
static hal_motion_state state;
static uint32_t speed;
static bool stuck;
static bool run, hold, discharge, safe, armed, interrupts;
static uint32_t live, cause, blamed;
static hal_limits switches;
static int32_t lost_pulses[HAL_AXES]; /* missing from the commands: models a gateware fault */
static hal_retraction data;
static uint32_t period;
static uint32_t fin_passes, busy_passes;
static bool late, under_way, lags;
static unsigned paced;              /* slot */
static bool damaged;               /* the path, until it is forgotten */
static hal_event queue[QUEUE];
static uint32_t queue_head, queue_tail;
static bool lost;
static uint32_t pets, unwatched, answers;
static uint8_t expected_pet;
static bool watch_closed, watch_asks;
static uint32_t guards[1 + 2 * HAL_AXES];  /* as written: see gk_guards */
static int32_t start_first;
static int32_t creep;               /* pulses that the machine makes before a bound is written */
static int32_t stored;              /* pulses commanded and not yet made */
static int32_t errors[HAL_AXES];

static int32_t travel(const hal_segment *s, uint32_t at, unsigned axis) {
    uint64_t magnitude = s->delta[axis] < 0 ? 0u - (uint32_t)s->delta[axis] : (uint32_t)s->delta[axis];
    int32_t steps = (int32_t)((2 * at * magnitude + s->length) / (2 * (uint64_t)s->length));
    return s->delta[axis] < 0 ? -steps : steps;
}

/* Place within an arc. It is followed pulse by pulse, as in the gateware. */
static struct {
    int64_t remainder, pace, error, along, across;
    int32_t major, minor;       /* steps made, of either sign */
} walk;

static bool follows(const hal_segment *s, unsigned axis) {
    return s->arc && (axis == s->major || axis == s->minor);
}

static void stand(const hal_segment *s, bool end) {
    const hal_arc_state *at = end ? &s->end : &s->start;
    walk.remainder = 0;
    walk.pace = at->pace;
    walk.error = at->error;
    walk.along = at->along;
    walk.across = at->across;
    walk.major = end ? s->delta[s->major] : 0;
    walk.minor = end ? s->delta[s->minor] : 0;
}

static void walk_forward(const hal_segment *s) {
    int64_t whole = (int64_t)s->length << s->shift;
    walk.remainder += 2 * walk.pace;
    walk.pace += s->change;
    if (walk.remainder < whole)
        return;
    walk.remainder -= 2 * whole;
    walk.major += s->delta[s->major] < 0 ? -1 : 1;
    walk.error += walk.along + MOVE_FINE;
    walk.along += 2 * MOVE_FINE;
    int64_t middle = walk.error + walk.across / 2 + MOVE_FINE / 4;
    if (s->outward ? middle < 0 : middle >= 0) {
        walk.error += walk.across + MOVE_FINE;
        walk.across += 2 * MOVE_FINE;
        walk.minor += s->delta[s->minor] < 0 ? -1 : 1;
    }
}

static void walk_back(const hal_segment *s) {
    int64_t whole = (int64_t)s->length << s->shift;
    walk.pace -= s->change;
    walk.remainder -= 2 * walk.pace;
    if (walk.remainder >= -whole)
        return;
    walk.remainder += 2 * whole;
    walk.major -= s->delta[s->major] < 0 ? -1 : 1;
    walk.error -= walk.along - MOVE_FINE;
    walk.along -= 2 * MOVE_FINE;
    int64_t middle = walk.error - walk.across / 2 + MOVE_FINE / 4;
    if (s->outward ? middle >= 0 : middle < 0) {
        walk.error -= walk.across - MOVE_FINE;
        walk.across -= 2 * MOVE_FINE;
        walk.minor -= s->delta[s->minor] < 0 ? -1 : 1;
    }
}

static int32_t distance(int32_t from, int32_t to) { return (int32_t)((uint32_t)to - (uint32_t)from); }

int32_t gk_axis(uint32_t axis) {
    const hal_segment *s = &slots[slot];
    if (!s->length)
        return base[axis];
    if (follows(s, axis))
        return base[axis] + (axis == s->major ? walk.major : walk.minor);
    return base[axis] + travel(s, offset, axis);
}

static void announce(uint32_t kind, uint32_t detail, uint32_t first, uint32_t second) {
    if (queue_head - queue_tail == QUEUE) {
        lost = true;
        return;
    }
    hal_event *e = &queue[queue_head++ % QUEUE];
    *e = (hal_event){.kind = (uint8_t)kind, .detail = (uint8_t)detail, .slot = (uint8_t)slot,
                     .cycle_low = hal_cycle_low(), .path = position, .first = first,
                     .second = second};
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        e->encoder[axis] = gk_axis(axis) + frame[axis];
    if (interrupts)
        events_interrupt();
}

static void enter(void) {
    if (!begun || slot == (entered_slot + 1) % HAL_SLOTS) {
        begun = true;
        entered_slot = slot;
        announce(EVENT_SEGMENT, 0, 0, 0);
    }
}

/* Move forward by `pulses`, but at most to the end of the segment. */
static int32_t go_forward(int32_t pulses) {
    int32_t ahead = distance(position, bounds[BOUND_AHEAD]);
    if (ahead <= 0)
        return 0;
    if (!begun)
        enter();
    if (offset == slots[slot].length) {
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            base[axis] += slots[slot].delta[axis];
        slot = (slot + 1) % HAL_SLOTS;
        offset = 0;
        stand(&slots[slot], false);
        if (position == front)
            enter();
    }
    int32_t step = (int32_t)(slots[slot].length - offset);
    step = step < pulses ? step : pulses;
    step = step < ahead ? step : ahead;
    if (!offset)
        stand(&slots[slot], false);
    for (int32_t i = 0; slots[slot].arc && i < step; i++)
        walk_forward(&slots[slot]);
    offset += (uint32_t)step;
    position = (int32_t)((uint32_t)position + (uint32_t)step);
    if (distance(front, position) > 0)
        front = position;
    return step;
}

static int32_t go_back(int32_t pulses) {
    int32_t behind = distance(bounds[BOUND_BEHIND], position);
    int32_t above = distance(bounds[BOUND_BACK_LIMIT], position);
    behind = above < behind ? above : behind;
    if (behind <= 0)
        return 0;
    if (offset == 0) {
        slot = (slot + HAL_SLOTS - 1) % HAL_SLOTS;
        offset = slots[slot].length;
        stand(&slots[slot], true);
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            base[axis] -= slots[slot].delta[axis];
    }
    int32_t step = (int32_t)offset < pulses ? (int32_t)offset : pulses;
    step = step < behind ? step : behind;
    for (int32_t i = 0; slots[slot].arc && i < step; i++)
        walk_back(&slots[slot]);
    offset -= (uint32_t)step;
    position = (int32_t)((uint32_t)position - (uint32_t)step);
    return step;
}

/* Switch the condition if the jump axis has reached its depth. */
static void look_at_depth(void) {
    if (jump_axis < HAL_AXES && host_gap_moved(gk_axis(jump_axis)))
        announce(EVENT_CONDITION, hal_condition_count(), (uint32_t)hal_axis_position(jump_axis), 0);
}

void hal_condition_arm(int32_t depth) {
    host_gap_arm(jump_axis < HAL_AXES ? depth - frame[jump_axis] : depth);
    look_at_depth();
}

void hal_condition_restart(void) { host_gap_restart(gk_axis(jump_axis < HAL_AXES ? jump_axis : 0)); }

static void stand_here(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        stood[axis] = gk_axis(axis);
}

int32_t gk_go(int32_t pulses) {
    int32_t made = 0;
    while (made < pulses || made < -pulses) {
        int32_t step = pulses > 0 ? go_forward(pulses - made) : go_back(-pulses - made);
        if (!step)
            break;
        made += step;
        stand_here();
        look_at_depth();
    }
    return pulses > 0 ? made : -made;
}

void gk_boot(uint32_t hz, uint32_t per_mm, uint32_t axis) {
    clock_hz = hz;
    pulses_per_mm = per_mm;
    jump_axis = axis;
    host_clock_boot();
    host_link_boot();
    position = front = 0;
    slot = offset = 0;
    begun = run = hold = discharge = armed = interrupts = late = lost = false;
    safe = true;
    live = cause = blamed = 0;
    switches = (hal_limits){0};
    creep = stored = 0;
    for (unsigned i = 0; i < HAL_AXES; i++)
        base[i] = stood[i] = errors[i] = lost_pulses[i] = frame[i] = 0;
    for (unsigned i = 0; i < HAL_SLOTS; i++)
        slots[i] = (hal_segment){0};
    for (unsigned i = 0; i < BOUNDS; i++)
        bounds[i] = 0;
    state = MOTION_HALTED;
    speed = 1u << 30;
    data = (hal_retraction){0};
    period = 0;
    fin_passes = 1;
    under_way = lags = damaged = watch_closed = watch_asks = stuck = false;
    queue_head = queue_tail = 0;
    pets = unwatched = answers = busy_passes = 0;
    host_gap_boot();
    host_image_boot();
    host_flash_boot();
    host_wiring_boot();
    host_walk_boot();
    expected_pet = 0xa5;
    main_loop_boot();
}

void gk_pass(uint32_t passes) {
    while (passes--) {
        main_loop_pass();
        host_cost(PASS_CLOCKS);
        if (busy_passes && busy_passes != UINT32_MAX)
            busy_passes--;
        if (run && !hold && !host_link_held() && !safe && speed && state == MOTION_FRONT &&
            go_forward((int32_t)speed))
            stand_here();
        look_at_depth();
    }
}

void gk_speed(uint32_t pulses) { speed = pulses; }
void gk_stuck(uint32_t on) { stuck = on; }
void gk_state(uint32_t value) { state = (hal_motion_state)value; }
void gk_moving(uint32_t on) { under_way = on; }
void gk_lags(uint32_t on) { lags = on; }
uint32_t gk_pace_slot(void) { return paced; }
void gk_creep(int32_t pulses) { creep = pulses; }
void gk_stored(int32_t pulses) { stored = pulses; }
void gk_live(uint32_t causes) { live = causes; }
void gk_arm(void) { armed = !safe; }
void gk_switches(uint32_t low, uint32_t high) {
    switches.low = (uint8_t)low;
    switches.high = (uint8_t)high;
    switches.leaving = switches.leaving && (low | high);
}
void gk_lose(uint32_t axis, int32_t pulses) { lost_pulses[axis] = pulses; }
void gk_fin(uint32_t passes) { fin_passes = passes; }
int32_t gk_bound(uint32_t bound) { return bounds[bound]; }
int32_t gk_position(void) { return position; }

void gk_words(const hal_segment *s, gk_segment *words) {
    *words = (gk_segment){
        .length = s->length, .rate = s->rate, .highest = s->highest, .arc = s->arc,
        .outward = s->outward, .away = s->away,
        .major = s->major, .minor = s->minor, .shift = s->shift, .change = s->change,
        .start_pace = s->start.pace, .start_error = s->start.error,
        .start_along = s->start.along, .start_across = s->start.across,
        .end_pace = s->end.pace, .end_error = s->end.error, .end_along = s->end.along,
        .end_across = s->end.across,
    };
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        words->delta[axis] = s->delta[axis];
}

void gk_slot(uint32_t number, gk_segment *segment) { gk_words(&slots[number], segment); }
uint32_t gk_pets(void) { return pets; }
uint32_t gk_answers(void) { return answers; }
void gk_watch(bool closed, bool asks) {
    watch_closed = closed;
    watch_asks = asks;
}
uint32_t gk_unwatched(void) { return unwatched; }
void gk_guards(uint32_t words[7]) {
    for (unsigned i = 0; i < sizeof guards / sizeof *guards; i++)
        words[i] = guards[i];
}

void gk_event(uint32_t kind, uint32_t detail, uint32_t first, uint32_t second) {
    if (kind == EVENT_RETRACTION_START)
        start_first = position;
    announce(kind, detail, first, second);
}

void gk_trip(uint32_t number, uint32_t axes) {
    cause = number;
    blamed = axes;
    damaged = number == CAUSE_GUARD;
    safe = true;
    armed = false;
    state = MOTION_HALTED;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        errors[axis] = 5; /* the drives are off, and the axes coast */
    announce(EVENT_TRIP, number, axes, 0);
}

uint32_t gk_flags(void) {
    return (uint32_t)run | (uint32_t)hold << 1 | (uint32_t)discharge << 2 |
           (uint32_t)data.valid << 3 | (uint32_t)safe << 4 | (uint32_t)host_link_held() << 5;
}

void gk_data(uint32_t words[10]) {
    const uint32_t all[10] = {data.rate, data.limit, data.high_rate, data.low_rate,
                              data.changeover, data.low_lead, data.jump_distance, data.jump_rate,
                              data.jump_high_rate, period};
    for (unsigned i = 0; i < 10; i++)
        words[i] = all[i];
}

bool hal_is_gapkeeper(void) { return true; }
uint32_t hal_clock_hz(void) { return clock_hz; }
uint32_t hal_pulses_per_mm(void) { return pulses_per_mm; }
unsigned hal_jump_axis(void) { return jump_axis; }

void hal_slot_write(unsigned number, const hal_segment *segment) { slots[number] = *segment; }
void hal_slot_pace(unsigned number, uint32_t length, uint32_t rate) {
    slots[number].length = length;
    slots[number].rate = rate;
    paced = number;
}
void hal_fast_slot(unsigned number) { (void)number; }
void hal_bound_write(hal_bound bound, int32_t coordinate) {
    if (bound <= BOUND_BEHIND)
        (void)gk_go(creep);
    bounds[bound] = coordinate;
}

void hal_origin(unsigned number) {
    damaged = false;
    /* The machine's slot may have been written again. */
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        base[axis] = stood[axis];
    position = front = 0;
    slot = number;
    offset = 0;
    begun = false;
    state = MOTION_FRONT;
    slots[number].length = 0;
}

int32_t hal_command(void) { return position + stored; }
int32_t hal_position(void) { return position; }
int32_t hal_front(void) { return front; }
/* At the end of a segment the machine is already in the next one, if there is one. */
unsigned hal_slot(void) {
    bool end = begun && offset == slots[slot].length && distance(position, bounds[BOUND_AHEAD]) > 0;
    return end ? (slot + 1) % HAL_SLOTS : slot;
}
hal_motion hal_motion_read(void) {
    return (hal_motion){.moving = under_way, .in_position = !lags, .backpressure = !speed && !stuck,
                        .state = state};
}

void hal_retraction_commit(const hal_retraction *words) { data = *words; }
void hal_jump_period(uint32_t clocks) { period = clocks; }
void hal_short_burst(uint32_t gain, uint32_t repeats, uint32_t settle) {
    (void)gain;
    (void)repeats;
    (void)settle;
}
void hal_control(bool new_run, bool new_hold) {
    run = new_run;
    hold = new_hold;
}
void hal_retract(void) { announce(EVENT_RETRACTION_START, EVENT_CAUSE_OPERATOR, 0, 0); }
int32_t hal_first(void) { return start_first; }
uint32_t hal_shorts(void) { return 0; }

bool hal_event_pop(hal_event *event) {
    if (queue_head == queue_tail)
        return false;
    *event = queue[queue_tail++ % QUEUE];
    return true;
}
bool hal_event_lost(void) {
    bool was = lost;
    lost = false;
    unwatched += expected_pet == 0xa5; /* the events' task calls this first */
    return was;
}
void hal_interrupts(bool events) {
    interrupts = events;
    if (events)
        events_interrupt();
}

void hal_discharge(bool machining) { discharge = machining; }

void hal_pet(uint8_t key) {
    if (key == 0xc3) {
        answers++;
        return;
    }
    pets += key == expected_pet;
    expected_pet = key == 0xa5 ? 0x5a : 0xa5;
}
bool hal_watch_open(void) { return !watch_closed; }
bool hal_watch_asked(void) { return watch_asks; }
bool hal_safe(void) { return safe; }
unsigned hal_first_cause(void) { return cause; }
uint32_t hal_causes(void) { return safe ? 1u << cause | live : 0; }
unsigned hal_blamed(void) { return blamed; }
hal_limits hal_limits_read(void) { return switches; }
void hal_leave(void) { switches.leaving = safe && !live && (switches.low | switches.high); }
void hal_interlock_clear(void) {
    safe = damaged || live != 0 || (!switches.leaving && (switches.low | switches.high));
}
uint32_t hal_damage(void) { return cause == CAUSE_GUARD ? blamed : 0; }
void hal_interlock_trip(void) { safe = true; }
void hal_fluid_required(bool required) { guards[0] = required; }
bool hal_armed(void) { return armed && !safe; }
void hal_disarm(void) { armed = false; }

void hal_auxiliary_send(hal_letter letter, uint32_t code) {
    (void)letter;
    (void)code;
    busy_passes = fin_passes == UINT32_MAX ? 0 : fin_passes;
    late = fin_passes == UINT32_MAX;
}
void hal_auxiliary_timeout(uint32_t clocks) { (void)clocks; }
bool hal_auxiliary_busy(void) { return busy_passes; }
bool hal_auxiliary_timed_out(void) {
    bool was = late;
    late = false;
    return was;
}

void hal_axis_shift(unsigned axis, int32_t by) { frame[axis] += by; }
int32_t host_frame(unsigned axis) { return frame[axis]; }
int32_t hal_axis_command(unsigned axis) { return gk_axis(axis) + frame[axis] - lost_pulses[axis]; }
int32_t hal_axis_position(unsigned axis) { return gk_axis(axis) + frame[axis]; }
int32_t hal_axis_error(unsigned axis) { return errors[axis]; }
uint32_t hal_axis_overshoot(unsigned axis) {
    (void)axis;
    return 7;
}
void hal_axis_errors(unsigned axis, uint32_t stopped, uint32_t moving, uint32_t window) {
    guards[1 + 2 * axis] = stopped;
    guards[2 + 2 * axis] = moving;
    (void)window;
}
void hal_axis_adopt(unsigned axis) {
    if (safe)
        errors[axis] = 0;
}
