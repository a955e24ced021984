// SPDX-License-Identifier: Apache-2.0
/* Hardware access of the target: every function is a few register accesses. */
#include "hal/fields.h"
#include "hal/hal.h"
#include "hal/regs.h"

_Static_assert(HAL_AXES == AXES, "hal.h and the register table disagree on the axes");

static int32_t frame[HAL_AXES];     /* machine frame less the gateware's count */

/* Positions wrap like the gateware's. */
static int32_t framed(unsigned axis, int32_t count) {
    return (int32_t)((uint32_t)count + (uint32_t)frame[axis]);
}
static int32_t counted(unsigned axis, int32_t place) {
    return (int32_t)((uint32_t)place - (uint32_t)frame[axis]);
}

#define IDENT 0x4b504147u   /* "GAPK", first letter lowest */

/* Numbers of the interrupt registers that LiteX's VexRiscv adds, and the bits of the standard ones. */
#define CSR_IRQ_MASK "0xbc0"
#define MIE_EXTERNAL (1u << 11)
#define MSTATUS_MIE (1u << 3)
#define IRQ_EVENT 1u
#define IRQ_WATCH 2u

bool hal_is_gapkeeper(void) { return SYSTEM->ident == IDENT; }

/* The reset address, and the word into which softcore/image.py writes the digest (link.ld). */
extern const uint32_t _start[], __image_digest[];

hal_image hal_image_read(void) {
    uint32_t bytes = (uint32_t)__image_digest - (uint32_t)_start;
    return (hal_image){_start, bytes / sizeof *_start, *__image_digest};
}

/* Of link.ld and start.S. */
extern hal_started __started;
extern const uint8_t image_loader[], image_loader_end[];
#define LOADER_BELOW 2048   /* bytes below the stack's end: no image, and none of our stack */

_Static_assert((uintptr_t)FLASH == 0x80000080u && offsetof(flash_regs, send) == 0 &&
               offsetof(flash_regs, select) == 4 && offsetof(flash_regs, status) == 8 &&
               FLASH_STATUS_RECEIVED_MASK == 0xff && FLASH_STATUS_BUSY_MASK == 0x100,
               "start.S and the register table disagree on the flash memory's port");

hal_started hal_started_read(void) { return __started; }

void hal_image_start(const hal_started *note, uint32_t count) {
    uint8_t *place = (uint8_t *)&__started - LOADER_BELOW;
    __started = *note;
    __builtin_memcpy(place, image_loader, (size_t)(image_loader_end - image_loader));
    __asm__ volatile(".word 0x0000100f" ::: "memory"); /* fence.i */
    ((void (*)(uint32_t, uint32_t))(uintptr_t)place)(count, note->digest);
}

uint32_t hal_clock_hz(void) { return SYSTEM->clock_hz; }
uint32_t hal_pulses_per_mm(void) { return SYSTEM->pulses_per_mm; }
unsigned hal_jump_axis(void) { return GET(SYSTEM->shape, SYSTEM_SHAPE_JUMP_AXIS); }
uint32_t hal_cycle_low(void) { return SYSTEM->cycle_low; }

uint64_t hal_cycle(void) {
    /* Interrupts are off meanwhile: their handler uses the same latch for the upper half. */
    uint32_t was;
    __asm__ volatile("csrrc %0, mstatus, %1" : "=r"(was) : "r"(MSTATUS_MIE) : "memory");
    uint32_t low = SYSTEM->cycle_low;
    uint32_t high = SYSTEM->cycle_high;
    __asm__ volatile("csrs mstatus, %0" ::"r"(was & MSTATUS_MIE) : "memory");
    return (uint64_t)high << 32 | low;
}

void hal_interrupts(bool events) {
    __asm__ volatile("csrw " CSR_IRQ_MASK ", %0" ::"r"(events ? IRQ_EVENT | IRQ_WATCH : IRQ_WATCH));
    /* Only when switching on: the handler only switches off, and other interrupts stay masked in
       it. */
    if (events) {
        __asm__ volatile("csrw mie, %0" ::"r"(MIE_EXTERNAL));
        __asm__ volatile("csrs mstatus, %0" ::"r"(MSTATUS_MIE) : "memory");
    }
}

int hal_receive(void) {
    uint32_t word = LINK->receive;
    _Static_assert(HAL_MARK == LINK_RECEIVE_MARK_MASK, "a mark is told from a byte by its bit");
    return word & LINK_RECEIVE_VALID_MASK
               ? (int)(word & (LINK_RECEIVE_MARK_MASK | LINK_RECEIVE_DATA_MASK))
               : -1;
}

_Static_assert(NOTE_STATUS == LINK_NOTES_STATUS_MASK && NOTE_HOLD == LINK_NOTES_HOLD_MASK &&
               NOTE_RESUME == LINK_NOTES_RESUME_MASK && NOTE_RETRACT == LINK_NOTES_RETRACT_MASK &&
               NOTE_STOP == LINK_NOTES_STOP_MASK && NOTE_CANCEL == LINK_NOTES_CANCEL_MASK,
               "hal.h and the register table disagree on the notes");

uint32_t hal_notes(void) { return LINK->notes; }
void hal_release_hold(void) { LINK->release = PUT(1, LINK_RELEASE_HOLD); }
void hal_release_reset(void) { LINK->release = PUT(1, LINK_RELEASE_RESET); }
void hal_release_override(void) { LINK->release = PUT(1, LINK_RELEASE_OVERRIDE); }

hal_overrides hal_overrides_read(void) {
    uint32_t word = LINK->override;
    return (hal_overrides){.feed = (uint8_t)GET(word, LINK_OVERRIDE_FEED),
                           .rapid = (uint8_t)GET(word, LINK_OVERRIDE_RAPID)};
}

uint32_t hal_waiting(void) { return LINK->waiting; }

bool hal_transmit_ready(void) { return LINK->status & LINK_STATUS_READY_MASK; }
void hal_transmit(uint8_t byte) { LINK->transmit = byte; }

hal_flash_region hal_flash_region_read(void) {
    uint32_t word = FLASH->region;
    return (hal_flash_region){GET(word, FLASH_REGION_FIRST), GET(word, FLASH_REGION_SECTORS),
                              GET(word, FLASH_REGION_SLOT)};
}

void hal_flash_select(bool on) { FLASH->select = on; }

uint8_t hal_flash_exchange(uint8_t byte) {
    uint32_t word;
    FLASH->send = byte;
    do
        word = FLASH->status;
    while (word & FLASH_STATUS_BUSY_MASK);
    return (uint8_t)GET(word, FLASH_STATUS_RECEIVED);
}

static void write_arc_state(const hal_arc_state *state) {
    PATH->slot_data = state->pace;
    PATH->slot_data = (uint32_t)state->error;
    PATH->slot_data = (uint32_t)state->along;
    PATH->slot_data = (uint32_t)state->across;
}

/* The words of a slot: see rtl.motion.path. */
void hal_slot_write(unsigned slot, const hal_segment *segment) {
    PATH->slot_select = slot;
    PATH->slot_data = segment->length;
    PATH->slot_data = segment->rate;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t delta = segment->delta[axis];
        PATH->slot_data = delta < 0 ? 1u << 31 | (0u - (uint32_t)delta) : (uint32_t)delta;
    }
    /* 0 means no bound, so a bound above 0 must stay above it. */
    uint32_t highest = segment->highest >> 4;
    highest += !highest && segment->highest;
    PATH->slot_data = segment->arc | (uint32_t)segment->major << 1 |
                      (uint32_t)segment->minor << 3 |
                      (uint32_t)(segment->arc ? segment->outward : segment->away) << 5 |
                      highest << 6;
    if (!segment->arc)
        return;
    PATH->slot_data = (uint32_t)segment->change;
    PATH->slot_data = segment->length << segment->shift;
    write_arc_state(&segment->start);
    write_arc_state(&segment->end);
}

/* Writes the window's memory first, so that a segment fetched meanwhile has the new rate. */
void hal_slot_pace(unsigned slot, uint32_t length, uint32_t rate) {
    PATH->slot_select = slot;
    PATH->slot_data = length;
    PATH->slot_data = rate;
    PATH->pace = rate;
    PATH->pace_slot = slot;
}

void hal_bound_write(hal_bound bound, int32_t value) {
    switch (bound) {
    case BOUND_AHEAD: PATH->ahead = value; break;
    case BOUND_BEHIND: PATH->behind = value; break;
    case BOUND_BACK_LIMIT: PATH->back_limit = value; break;
    case BOUND_FAST_AHEAD: PATH->fast_ahead = value; break;
    case BOUND_FAST_BEHIND: PATH->fast_behind = value; break;
    case BOUND_FAST_AHEAD_RATE: PATH->fast_ahead_rate = (uint32_t)value; break;
    default: PATH->fast_behind_rate = (uint32_t)value; break;
    }
}

void hal_fast_slot(unsigned slot) { PATH->fast_slot = slot; }
void hal_origin(unsigned slot) { PATH->origin = slot; }
int32_t hal_command(void) { return PATH->command; }
int32_t hal_position(void) { return PATH->position; }
int32_t hal_front(void) { return PATH->front; }
unsigned hal_slot(void) { return PATH->slot; }

hal_motion hal_motion_read(void) {
    uint32_t word = PATH->status;
    return (hal_motion){.moving = word & PATH_STATUS_MOVING_MASK,
                        .in_position = word & PATH_STATUS_IN_POSITION_MASK,
                        .backpressure = word & PATH_STATUS_BACKPRESSURE_MASK,
                        .state = (hal_motion_state)GET(word, PATH_STATUS_STATE)};
}

void hal_ramp(uint32_t start_rate, uint32_t acceleration) {
    RAMP->start_rate = start_rate;
    RAMP->acceleration = acceleration;
}

void hal_ramp_back(uint32_t start_rate, uint32_t acceleration) {
    RAMP->back_start_rate = start_rate;
    RAMP->back_acceleration = acceleration;
}

void hal_lead(uint32_t clocks) { RAMP->lead = clocks; }

void hal_retraction_commit(const hal_retraction *data) {
    RETRACTION->rate = data->rate;
    RETRACTION->limit = data->limit;
    RETRACTION->high_rate = data->high_rate;
    RETRACTION->low_rate = data->low_rate;
    RETRACTION->changeover = data->changeover;
    RETRACTION->low_lead = data->low_lead;
    RETRACTION->jump_distance = data->jump_distance;
    RETRACTION->jump_rate = data->jump_rate;
    RETRACTION->jump_high_rate = data->jump_high_rate;
    RETRACTION->commit = PUT(data->valid, RETRACTION_COMMIT_VALID);
}

void hal_jump_period(uint32_t clocks) { RETRACTION->jump_period = clocks; }

void hal_short_burst(uint32_t gain, uint32_t repeats, uint32_t settle) {
    RETRACTION->gain = gain;
    RETRACTION->repeats = repeats;
    RETRACTION->settle = settle;
}

void hal_control(bool run, bool hold) {
    RETRACTION->control = PUT(run, RETRACTION_CONTROL_RUN) | PUT(hold, RETRACTION_CONTROL_HOLD);
}

void hal_retract(void) { RETRACTION->command = PUT(1, RETRACTION_COMMAND_RETRACT); }
void hal_walk(uint32_t distance) { RETRACTION->walk = distance; }
int32_t hal_start(void) { return RETRACTION->start; }
int32_t hal_first(void) { return RETRACTION->first; }
uint32_t hal_shorts(void) { return RETRACTION->burst; }

bool hal_event_pop(hal_event *event) {
    uint32_t head = EVENT->head;
    if (!(head & EVENT_HEAD_VALID_MASK))
        return false;
    event->kind = GET(head, EVENT_HEAD_KIND);
    event->detail = GET(head, EVENT_HEAD_DETAIL);
    event->slot = GET(head, EVENT_HEAD_SLOT);
    event->cycle_low = EVENT->cycle;
    event->path = EVENT->path;
    event->first = EVENT->first;
    event->second = EVENT->second;
    event->encoder[0] = framed(0, EVENT->x);
    event->encoder[1] = framed(1, EVENT->y);
    event->encoder[2] = framed(2, EVENT->z);
    if (event->kind == EVENT_CONDITION && hal_jump_axis() < HAL_AXES)
        event->first = (uint32_t)framed(hal_jump_axis(), (int32_t)event->first);
    EVENT->pop = 1;
    return true;
}

bool hal_event_lost(void) {
    uint32_t lost = EVENT->status & EVENT_STATUS_LOST_MASK;
    if (lost)
        EVENT->status = lost;
    return lost;
}

void hal_short_write(const hal_short_detector *detector) {
    GAP->short_ratio = PUT(detector->needed, GAP_SHORT_RATIO_NEEDED) |
                       PUT(detector->window, GAP_SHORT_RATIO_WINDOW);
    GAP->short_duration = detector->duration;
    GAP->clear_needed = detector->clear;
    GAP->blanking = detector->blanking;
    GAP->short_mean = detector->mean;
    GAP->short_mean_time = detector->mean_time;
    GAP->short_current = detector->current;
}

void hal_lag_time(uint32_t clocks) { GAP->lag_time = clocks; }

void hal_gap_counts(uint32_t counts[4]) {
    counts[0] = GAP->open_count;
    counts[1] = GAP->ok_count;
    counts[2] = GAP->dame_count;
    counts[3] = GAP->short_count;
}

bool hal_shorted(void) { return GAP->status & GAP_STATUS_SHORTED_MASK; }

void hal_discriminate(const hal_discriminator *rules) {
    GAP->settle = rules->settle;
    GAP->confirm = rules->confirm;
}

void hal_criteria(const hal_criterion *c) {
    GAP->delay_least = c->delay_least;
    GAP->criteria = PUT(c->current, GAP_CRITERIA_CURRENT) | PUT(c->delay, GAP_CRITERIA_DELAY) |
                    PUT(c->noise, GAP_CRITERIA_NOISE) |
                    PUT(c->relaxation, GAP_CRITERIA_RELAXATION);
}

void hal_supply(uint32_t voltage, bool negative) {
    POWER->supply = PUT(voltage, POWER_SUPPLY_VOLTAGE) | PUT(negative, POWER_SUPPLY_NEGATIVE);
}

void hal_references(uint32_t open, uint32_t arc, uint32_t shorted) {
    GAP->reference = PUT(open, GAP_REFERENCE_OPEN) | PUT(arc, GAP_REFERENCE_ARC) |
                     PUT(shorted, GAP_REFERENCE_SHORT);
}

void hal_servo(bool on) { SERVO->control = on; }
void hal_servo_period(uint32_t clocks) { SERVO->period = clocks; }
void hal_servo_step(uint32_t pulses) { SERVO->step = pulses; }

void hal_counting(uint32_t mode, uint32_t window, uint32_t weight) {
    SERVO->counting = PUT(mode, SERVO_COUNTING_MODE) | PUT(window, SERVO_COUNTING_WINDOW) |
                      PUT(weight, SERVO_COUNTING_WEIGHT);
}

void hal_presets(uint32_t dame, uint32_t open, uint32_t ok) {
    SERVO->presets = PUT(dame, SERVO_PRESETS_DAME) | PUT(open, SERVO_PRESETS_OPEN) |
                     PUT(ok, SERVO_PRESETS_OK);
}

void hal_feed_mode_write(const hal_feed_mode *words) {
    FEED->unit = words->unit;
    FEED->window = words->window;
    FEED->least = words->least;
    FEED->bounds = PUT(words->lowest, FEED_BOUNDS_LOWEST) | PUT(words->highest, FEED_BOUNDS_HIGHEST);
    FEED->gain = words->gain;
    FEED->highest = words->fastest;
    FEED->control = PUT(words->mode, FEED_CONTROL_MODE) | PUT(words->measure, FEED_CONTROL_MEASURE) |
                    PUT(words->shares, FEED_CONTROL_SHARES);
}

void hal_feed_mode_references(uint32_t no_load, uint32_t voltage, uint32_t drop, uint32_t share) {
    FEED->share = share;
    FEED->no_load = no_load;
    FEED->reference = PUT(voltage, FEED_REFERENCE_VOLTAGE) | PUT(drop, FEED_REFERENCE_DROP);
}

void hal_condition_commit(void) { CONDITION->order = PUT(1, CONDITION_ORDER_COMMIT); }
void hal_condition_arm(int32_t depth) {
    CONDITION->depth = hal_jump_axis() < HAL_AXES ? counted(hal_jump_axis(), depth) : depth;
}
void hal_condition_disarm(void) { CONDITION->order = PUT(1, CONDITION_ORDER_DISARM); }
void hal_condition_restart(void) { CONDITION->order = PUT(1, CONDITION_ORDER_RESTART); }
bool hal_condition_pending(void) { return CONDITION->status & CONDITION_STATUS_PENDING_MASK; }
uint8_t hal_condition_count(void) {
    return (uint8_t)GET(CONDITION->status, CONDITION_STATUS_COUNT);
}

hal_feed_mode_state hal_feed_mode_read(void) {
    uint32_t status = FEED->status;
    return (hal_feed_mode_state){.mean = GET(FEED->voltage, FEED_VOLTAGE_MEAN),
                           .windows = (uint8_t)GET(status, FEED_STATUS_WINDOWS),
                           .known = status & FEED_STATUS_KNOWN_MASK};
}

void hal_fluid_write(const hal_fluid *detector) {
    FLUID->threshold_0 = detector->threshold[0];
    FLUID->threshold_1 = detector->threshold[1];
    FLUID->threshold_2 = detector->threshold[2];
    FLUID->hysteresis = detector->hysteresis;
    FLUID->bounds = PUT(detector->lowest, FLUID_BOUNDS_LOWEST) |
                    PUT(detector->highest, FLUID_BOUNDS_HIGHEST);
    FLUID->control = PUT(detector->convert, FLUID_CONTROL_CONVERT) |
                     PUT(detector->manual, FLUID_CONTROL_MANUAL) |
                     PUT(detector->manual_class, FLUID_CONTROL_MANUAL_CLASS);
}

uint32_t hal_fluid_state(void) {
    uint32_t status = FLUID->status;
    return (status & FLUID_STATUS_BROKEN_LOW_MASK ? HAL_FLUID_LOW : 0) |
           (status & FLUID_STATUS_BROKEN_HIGH_MASK ? HAL_FLUID_HIGH : 0) |
           (status & FLUID_STATUS_DISORDERED_MASK ? HAL_FLUID_DISORDERED : 0) |
           (status & FLUID_STATUS_FAULT_MASK ? HAL_FLUID_SILENT : 0) |
           (status & FLUID_STATUS_KNOWN_MASK ? HAL_FLUID_KNOWN : 0) |
           GET(status, FLUID_STATUS_CLASS) << 8;
}

void hal_pulse(uint32_t on, uint32_t wait, uint32_t off, uint32_t rest, uint32_t level) {
    POWER->on_time = on;
    POWER->wait_time = wait;
    POWER->off_time = off;
    POWER->off_extra = rest;
    POWER->level = level;
}

uint32_t hal_level_limit(void) { return GET(POWER->limits, POWER_LIMITS_LEVEL); }

void hal_sense(uint32_t on, uint32_t off) {
    POWER->sense_on = on;
    POWER->sense_off = off;
}

void hal_follow(uint32_t clocks) { CONDITION->settle = clocks; }

void hal_discharge(bool machining) {
    POWER->control = PUT(machining, POWER_CONTROL_MACHINING) | PUT(1, POWER_CONTROL_CUT);
}


void hal_sleep(uint32_t clocks) { SYSTEM->sleep = clocks; }

void hal_pet(uint8_t key) { SAFETY->pet = key; }
bool hal_watch_open(void) { return SAFETY->watch & SAFETY_WATCH_OPEN_MASK; }
bool hal_watch_asked(void) { return SAFETY->watch & SAFETY_WATCH_ASKED_MASK; }
bool hal_safe(void) { return SAFETY->status & SAFETY_STATUS_SAFE_MASK; }
unsigned hal_first_cause(void) { return GET(SAFETY->status, SAFETY_STATUS_FIRST); }
uint32_t hal_causes(void) { return SAFETY->latched; }
unsigned hal_blamed(void) { return GET(SAFETY->status, SAFETY_STATUS_BLAMED); }

hal_limits hal_limits_read(void) {
    uint32_t word = SAFETY->limits;
    return (hal_limits){.low = (uint8_t)GET(word, SAFETY_LIMITS_LOW),
                        .high = (uint8_t)GET(word, SAFETY_LIMITS_HIGH),
                        .leaving = word & SAFETY_LIMITS_LEAVING_MASK};
}

void hal_leave(void) { SAFETY->leave = 0x5a; }
uint32_t hal_damage(void) { return SAFETY->damage; }
void hal_interlock_clear(void) { SAFETY->clear = 0x5a; }
void hal_interlock_trip(void) { SAFETY->stop = 1; }
bool hal_arm_pressed(void) { return SAFETY->arming & SAFETY_ARMING_PRESSED_MASK; }
bool hal_armed(void) { return SAFETY->arming & SAFETY_ARMING_ARMED_MASK; }
void hal_disarm(void) { SAFETY->disarm = 1; }
void hal_fluid_required(bool required) { SAFETY->fluid = PUT(required, SAFETY_FLUID_REQUIRED); }

void hal_auxiliary_send(hal_letter letter, uint32_t code) {
    AUXILIARY->send = PUT(code, AUXILIARY_SEND_CODE) | PUT(letter, AUXILIARY_SEND_LETTER);
}

void hal_auxiliary_timeout(uint32_t clocks) { AUXILIARY->timeout = clocks; }
bool hal_auxiliary_busy(void) { return AUXILIARY->status & AUXILIARY_STATUS_BUSY_MASK; }

bool hal_auxiliary_timed_out(void) {
    uint32_t late = AUXILIARY->status & AUXILIARY_STATUS_TIMED_OUT_MASK;
    if (late)
        AUXILIARY->status = late;
    return late;
}

void hal_axis_shift(unsigned axis, int32_t by) { frame[axis] = framed(axis, by); }
int32_t hal_axis_command(unsigned axis) { return framed(axis, AXIS(axis)->command); }
int32_t hal_axis_position(unsigned axis) { return framed(axis, AXIS(axis)->position); }
int32_t hal_axis_error(unsigned axis) { return AXIS(axis)->error; }
uint32_t hal_axis_overshoot(unsigned axis) { return AXIS(axis)->overshoot; }

void hal_axis_errors(unsigned axis, uint32_t stopped, uint32_t moving, uint32_t window) {
    AXIS(axis)->follow_stopped = stopped;
    AXIS(axis)->follow_moving = moving;
    AXIS(axis)->window = window;
}

void hal_axis_mode(unsigned axis, const hal_drive *drive) {
    AXIS(axis)->mode = PUT(drive->step, AXIS_MODE_STEP) | PUT(drive->reverse, AXIS_MODE_REVERSE) |
                       PUT(drive->swap, AXIS_MODE_SWAP) |
                       PUT((uint32_t)drive->offset, AXIS_MODE_OFFSET) |
                       PUT(drive->friction, AXIS_MODE_FRICTION);
}

/* A gear 1:1 is written as such, so that both parts fit 16 bits. */
void hal_axis_gear(unsigned axis, uint32_t steps, uint32_t pulses) {
    uint32_t n = steps == pulses ? 1 : steps;
    AXIS(axis)->gear = PUT(n, AXIS_GEAR_STEPS) | PUT(pulses - steps, AXIS_GEAR_SURPLUS);
}

void hal_axis_backlash(unsigned axis, uint32_t pulses) {
    AXIS(axis)->backlash = PUT(pulses, AXIS_BACKLASH_SIZE);
}

void hal_axis_pitch(unsigned axis, int32_t pulses) {
    volatile uint32_t *errors = &PITCH->x;
    errors[axis] = (uint32_t)pulses;
}

void hal_axis_step_time(unsigned axis, uint32_t width, uint32_t space, uint32_t setup) {
    AXIS(axis)->step_time = PUT(width, AXIS_STEP_TIME_WIDTH) | PUT(space, AXIS_STEP_TIME_SPACE) |
                            PUT(setup, AXIS_STEP_TIME_SETUP);
}

void hal_axis_adopt(unsigned axis) { AXIS(axis)->adopt = 1; }

void hal_axis_limits(unsigned axis, int32_t low, int32_t high) {
    AXIS(axis)->low = counted(axis, low);
    AXIS(axis)->high = counted(axis, high);
}

void hal_axis_model(unsigned axis, uint32_t gain, uint32_t lag) {
    AXIS(axis)->model = PUT(gain, AXIS_MODEL_GAIN) | PUT(lag, AXIS_MODEL_LAG);
}
hal_check hal_axis_check(unsigned axis) {
    return (hal_check)GET(AXIS(axis)->status, AXIS_STATUS_CHECK);
}

bool hal_axis_beyond(unsigned axis, bool high) {
    uint32_t mask = high ? AXIS_STATUS_BEYOND_HIGH_MASK : AXIS_STATUS_BEYOND_LOW_MASK;
    return AXIS(axis)->status & mask;
}
