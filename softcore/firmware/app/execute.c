// SPDX-License-Identifier: Apache-2.0
#include "app/execute.h"

#include "app/auxiliary.h"
#include "app/events.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/start_block.h"
#include "app/touch.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/text.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "gap/gap.h"
#include "link/output.h"
#include "path/path.h"
#include "roughing/result.h"

/* The parts of a block in their order. Between them the machine may move for hours. */
typedef enum {
    PART_START_BLOCK,   /* the first block after those left out: tell the operator, and wait */
    PART_START_WAITS, PART_START_WAY, PART_START_FLUID, PART_START_DISCHARGE,
    PART_BEFORE,        /* wait for the front, if something acts before the motion */
    PART_CONDITION, PART_CONDITION_TOLD, PART_S, PART_T, PART_M, PART_MACHINING_ON, PART_ACT,
    PART_BOUNDS, PART_TELL,
    PART_DWELL,
    PART_MOVE,
    PART_TOUCH,         /* wait for contact, or for the end of the way */
    PART_AFTER,         /* wait for the front, if something acts after the motion */
    PART_MACHINING_OFF, PART_FLUID_OFF, PART_STOP, PART_PAUSED, PART_END, PART_DONE
} part;

static modal state;
static const plan *work;
static bool by_hand;
static uint32_t line;
static const char *text;
static uint32_t length;
static bool starting;       /* a tape's start is half done */
static bool cornered;       /* the corner before the motion has been appended */
static bool told;           /* the block's event has been sent, or waits as a notice */
static bool skipped;        /* the block is left out: it only changes the state */
static part at;
static unsigned m_index;
static unsigned step_index; /* next step of a planned depth series */
static bool sent;           /* waiting for FIN */
static uint64_t dwell_end;
static bool resumed, was_machining;

const modal *execute_state(void) { return &state; }

void execute_init(void) {
    state = (modal){0};
    auxiliary_init();
    at = PART_DONE;
    sent = false;
    plan_start(&state);
    execute_resynchronise();
}

__attribute__((noinline)) void execute_put_places(const uint32_t *kept) {
    __builtin_memcpy(state.systems, kept, PLAN_KEPT * sizeof *kept);
    __builtin_memcpy(state.offset, state.systems[state.system], sizeof state.offset);
    plan_edit(&state);
    output_frame(state.offset);
}

void execute_resynchronise(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        state.position[axis] = hal_axis_command(axis);
}

void execute_abort(void) {
    starting = false;
    at = PART_DONE;
    touch_end();
    state.side = 0;
    sent = false;
    depth_series_drop();
}

/* Write the retraction memory to the gateware. */
static void commit(void) {
    retraction_layer set = retraction_combined(&state.memory);
    hal_retraction data =
        retraction_rates(&set, &state.jump, settings_start_rate(), settings_acceleration());
    hal_retraction_commit(&data);
    hal_jump_period(state.jump.period);
    events_speeds(units_speed_of_rate(data.high_rate), units_speed_of_rate(data.low_rate),
                  units_speed_of_rate(data.jump_high_rate));
    /* A jump may go further back than a retraction. The path must be remembered for both. */
    uint32_t reach = data.limit > data.jump_distance ? data.limit : data.jump_distance;
    path_set_bounds(reach, set.given & (1u << ITEM_Z), set.value[ITEM_Z]);
}

/* Set the feed mode. It decides whether overrides scale the feed, so they follow at once. */
static void serve(unsigned mode, const condition_row *judged) {
    gap_servo(machine_dry() ? FEED_CONSTANT : mode, judged);
    override_step();
}

bool execute_start(void) {
    starting = !starting;
    if (starting) {
        machine_run(false);
        serve(FEED_CONSTANT, 0);
        meter_path_begins();
        gap_start();
        path_begin();
        return false;
    }
    plan_start(&state);
    output_frame(state.offset);
    execute_resynchronise();
    start_block_begin(&state);
    commit();
    if (machine_dry())
        output_line("[MSG:dry run: no discharge, cuts at F%u]", settings_get(SET_DRY_RUN_MM_MIN));
    machine_run(true);
    return true;
}

static part before_motion(void) { return work->acts_before ? PART_BEFORE : PART_MOVE; }

void execute_begin(const plan *p, bool manual, uint32_t source_line, const char *source,
                   uint32_t source_length) {
    work = p;
    by_hand = manual;
    line = source_line;
    text = source;
    length = source_length;
    skipped = !manual && start_block_skips(source_line, source, source_length);
    told = source_length == 0 || skipped;
    at = !manual && !skipped && start_block_due() ? PART_START_BLOCK : before_motion();
    m_index = 0;
    step_index = 1;
    cornered = false;
    sent = resumed = false;
    if (manual && alarm_line())
        alarm_set_line(ALARM_BY_HAND);
}

/* Does the machine stop after this block? Single block is for blocks of a tape, as written there: not
   for a comment, nor for the arc that a wire offset puts in at a corner. */
static bool single(void) { return !by_hand && length && settings_get(SET_SINGLE_BLOCK); }

static part after_motion(void) { return work->acts_after || single() ? PART_AFTER : PART_DONE; }

/* Speed along a cut, um/min: its own, or the one of the dry run. A jog and a touch-off are no cuts. */
static uint32_t speed_of(uint32_t own, bool rapid) {
    uint32_t dry = 1000 * settings_get(SET_DRY_RUN_MM_MIN), highest = settings_highest_speed();
    if (!dry || rapid || jog_active() || work->act == ACT_TOUCH)
        return own;
    return dry < highest ? dry : highest;
}

bool execute_paused(void) { return at == PART_PAUSED || at == PART_START_WAITS; }
bool execute_acts(void) { return at != PART_DONE && !execute_paused() && path_at_front(); }
void execute_resume(void) { resumed = true; }

/* Is the machine at the front, and has everything been told that it did on the way? Each call tells
   one of the blocks that still wait. */
static bool at_front(void) { return path_at_front() && events_idle() && !events_tell_notice(); }

/* Like at_front, and the electrode itself has arrived: a function at the end of a cut must find
   it at its depth. No jump may begin from here to the next motion; it would take the electrode
   away. */
static bool arrived(void) {
    machine_wait(path_at_front());
    return hal_motion_read().in_position && at_front();
}

static void notice(void) {
    events_notice(path_next(), line, text, by_hand ? 0 : length);
    told = true;
}

static void tell(void) {
    alarm_set_line(line);
    if (!told) {
        notice();
        events_tell_notice();
    }
}

/* Send a function and wait for its FIN; true when it is done. */
static bool function(hal_letter letter, int32_t code, fault *f) {
    if (skipped && letter == AUXILIARY_M)
        start_block_function(code);
    if (skipped || code < 0)
        return true;
    if (!sent) {
        auxiliary_send(letter, (uint32_t)code);
        sent = true;
        return false;
    }
    switch (auxiliary_poll()) {
    case AUXILIARY_WAIT: return false;
    case AUXILIARY_LATE:
        fault_at(f, FAULT_FIN, 0, "the machine side did not answer %c%d in time", "MST"[letter],
                 code);
        return false;
    default: sent = false; return true;
    }
}

/* Tell the retraction data in force. Only a complete set is in force; an operator may enter it in
   several blocks. */
static void tell_set(void) {
    if (!retraction_complete(&state.memory))
        return;
    retraction_layer set = retraction_combined(&state.memory);
    char ceiling[TEXT_NUMBER] = "-";
    if (set.given & (1u << ITEM_Z))
        text_print(ceiling, sizeof ceiling, "%d", set.value[ITEM_Z] - state.offset[2]);
    events_now(EVENT_WORD_RETRACTION_SET, EVENT_FORMAT_RETRACTION_SET, (uint32_t)set.value[ITEM_R],
               set.value[ITEM_L], (uint32_t)set.value[ITEM_H],
               (uint32_t)set.value[ITEM_E], set.value[ITEM_Q], ceiling,
               by_hand ? EVENT_SOURCE_MDI : EVENT_SOURCE_TAPE);
}

/* Carry out the block's non-modal function. `state` is already the state after the block. */
static part act(fault *f) {
    if (skipped && work->act == ACT_DWELL)
        return PART_MOVE;
    if (skipped && work->act == ACT_TOUCH) {
        fault_at(f, FAULT_START_BLOCK, 0, "a touch-off (G38.2 to G38.5) cannot be left out: what it finds is not known");
        return at;
    }
    switch (work->act) {
    case ACT_DWELL:
        dwell_end = hal_cycle() + work->dwell;
        return PART_DWELL;
    case ACT_TOUCH:
        /* Until the axes have caught up after the motion before, contact would be a trip. */
        dwell_end = hal_cycle() + settings_lag_clocks();
        return PART_DWELL;
    case ACT_RETRACTION:
    case ACT_DEFAULTS:
    case ACT_JUMP:
        commit();
        return PART_BOUNDS;
    case ACT_TABLE:
        if (work->class_number < GAP_CLASSES)
            gap_class_enter(work->class_number, &work->class_row, by_hand);
        return PART_MOVE;
    case ACT_DEPTH_SERIES:
        if (work->step_condition)
            depth_series_add(work->step_depth, work->step_condition);
        else if (!depth_series_end())
            return PART_ACT;
        return PART_MOVE;
    case ACT_PLANNED:
        if (step_index >= result_count())
            return PART_MOVE;
        depth_series_add(work->step_depth - result_depth(step_index), result_row(step_index));
        step_index++;
        return PART_ACT;
    default: return PART_MOVE;
    }
}

static part move(fault *f) {
    if (skipped) {
        start_block_move(work);
        plan_copy(&state, &work->after);
        return PART_AFTER;
    }
    if (!work->moves) {
        if (!told) {
            /* A block that only changes modes is told in order with the motion. */
            if (!events_notice_room())
                return PART_MOVE;
            notice();
        }
        if (path_at_front() && events_idle() && events_tell_notice())
            return PART_MOVE;
        plan_copy(&state, &work->after);
        return after_motion();
    }
    path_room room = path_has_room();
    if (room == PATH_UNCOVERED) {
        fault_at(f, FAULT_HISTORY, 0,
                 "the path remembered would not cover the retractable limit; the blocks are too short");
        return PART_MOVE;
    }
    if (room == PATH_WAIT || !events_notice_room())
        return PART_MOVE;
    if (!told)
        notice();
    if (work->corners && !cornered && !start_block_rests()) {
        path_append(&work->corner, units_rate(speed_of(work->corner_speed, work->corner_rapid)),
                    work->corner_rapid, machine_machining());
        cornered = true;
        machine_run(true);
        return PART_MOVE;
    }
    if (work->act == ACT_TOUCH) {
        touch_begin(work->touch_away);
        override_step();
    }
    const path_move *way = start_block_rest(&work->move);
    if (way)
        path_append(way, units_rate(speed_of(work->speed, work->rapid)), work->rapid,
                    machine_machining());
    plan_copy(&state, &work->after);
    machine_run(true);
    return work->act == ACT_TOUCH ? PART_TOUCH : after_motion();
}

/* Forget the path up to here: the rest of a touch-off is never gone. */
static void begin_path(void) {
    events_drop();
    path_begin();
    meter_path_begins();
    execute_resynchronise();
}

/* The end of a touch-off: contact or its end, after which the axes come to rest, or the end of the
   way. */
static part touch(fault *f) {
    touch_phase found = touch_look();
    if (found == TOUCH_LOOKS ? !arrived() : !events_idle())
        return PART_TOUCH;
    if (found != TOUCH_LOOKS) {
        machine_run(false);
        if (!meter_rests())
            return PART_TOUCH;
        begin_path();
    }
    touch_tell();
    touch_end();
    override_step();
    if (found == TOUCH_AT_START)
        fault_at(f, FAULT_TOUCHES, 0, work->touch_away ? "the electrode does not touch the work before G38.4 or G38.5" : FAULT_TEXT_TOUCHES);
    else if (found == TOUCH_LOOKS && work->touch_needed)
        fault_at(f, FAULT_NO_TOUCH, 0, work->touch_away ? "the end of G38.4 was reached, and the electrode still touches" : FAULT_TEXT_NO_TOUCH);
    return after_motion();
}

static part stop(fault *f) {
    if (skipped && work->stop == STOP_END)
        fault_at(f, FAULT_START_BLOCK, 0, FAULT_TEXT_START_BLOCK);
    if (skipped)
        return PART_DONE;
    switch (work->stop) {
    case STOP_OPTIONAL:
        if (!settings_get(SET_OPTIONAL_STOP) && !single())
            return PART_DONE;
        break;
    case STOP_PROGRAM: break;
    case STOP_END: return PART_END;
    default:
        if (!single())
            return PART_DONE;
    }
    /* The discharge goes off: the operator may reach into the tank during a stop. */
    was_machining = machine_machining();
    machine_discharge(false);
    events_now(EVENT_WORD_PAUSE, "");
    return PART_PAUSED;
}

static void end(void) {
    machine_discharge(false);
    serve(FEED_CONSTANT, 0);
    override_end();
    machine_run(false);
    state.jump.period = 0;
    plan_edit(&state);
    hal_jump_period(0);
    if (!by_hand)
        events_now(EVENT_WORD_PROGRAM_END, "");
}

static bool ready(fault *f) { return machine_dry() || gap_ready(f); }

/* Switch the discharge on; false with a fault if that is not allowed. */
static bool switch_on(fault *f) {
    if (!machine_allows(false, true, f) || !ready(f))
        return false;
    machine_discharge(true);
    if (!machine_dry())
        events_now(EVENT_WORD_AUX, EVENT_FORMAT_AUX, 'M', 3u);
    return true;
}

/* Carry out part `at`. Returns the next part, or `at` again if this part is not finished. */
static part advance(fault *f) {
    switch (at) {
    case PART_START_BLOCK:
        return start_block_tell(line, work, f) ? PART_START_WAITS : at;
    case PART_START_WAITS:
        if (!resumed)
            return at;
        resumed = false;
        serve(FEED_CONSTANT, 0);
        return PART_START_WAY;
    case PART_START_WAY: return !arrived() || start_block_goes() ? at : PART_START_FLUID;
    case PART_START_FLUID:
        if (start_block_fluid() && !function(AUXILIARY_M, 8, f))
            return at;
        serve(state.served, state.condition);
        return PART_START_DISCHARGE;
    case PART_START_DISCHARGE:
        if (state.machining && !switch_on(f))
            return at;
        start_block_done();
        return before_motion();
    case PART_BEFORE:
        if (!arrived())
            return at;
        tell();
        if (!work->moves)
            plan_copy(&state, &work->after);
        return PART_CONDITION;
    case PART_CONDITION:
        if (work->changes_condition) {
            if (!depth_series_end())
                return at;
            gap_condition(work->after.condition);
            return PART_CONDITION_TOLD;
        }
        return PART_S;
    case PART_CONDITION_TOLD:
        events_now(EVENT_WORD_CONDITION, EVENT_FORMAT_CONDITION,
                   (uint32_t)work->after.condition->number,
                   (uint32_t)work->after.condition->milli_ip);
        return PART_S;
    case PART_S: return function(AUXILIARY_S, work->s, f) ? PART_T : at;
    case PART_T: return function(AUXILIARY_T, work->t, f) ? PART_M : at;
    case PART_M:
        if (m_index == BLOCK_CODES || work->m[m_index] < 0)
            return PART_MACHINING_ON;
        if (function(AUXILIARY_M, work->m[m_index], f))
            m_index++;
        return at;
    case PART_MACHINING_ON:
        if (work->machining_on && !skipped && !switch_on(f))
            return at;
        return PART_ACT;
    case PART_ACT:
        if (work->changes_servo)
            serve(work->after.served, work->after.condition);
        if (work->changes_frame)
            output_frame(work->after.offset);
        return act(f);
    case PART_BOUNDS: return path_bounds_step() ? PART_TELL : at;
    case PART_TELL:
        if (work->act != ACT_JUMP)
            tell_set();
        return PART_MOVE;
    case PART_DWELL: return hal_cycle() >= dwell_end ? PART_MOVE : at;
    case PART_MOVE: return move(f);
    case PART_TOUCH: return touch(f);
    case PART_AFTER:
        if (!arrived())
            return at;
        alarm_set_line(line);
        return PART_MACHINING_OFF;
    case PART_MACHINING_OFF:
        if (work->machining_off && !skipped) {
            machine_discharge(false);
            events_now(EVENT_WORD_AUX, EVENT_FORMAT_AUX, 'M', 5u);
        }
        return PART_FLUID_OFF;
    case PART_FLUID_OFF: return !work->fluid_off || function(AUXILIARY_M, 9, f) ? PART_STOP : at;
    case PART_STOP: return stop(f);
    case PART_PAUSED:
        machine_wait(!resumed || path_at_front()); /* the machine may have walked away */
        if (!resumed || !path_at_front() || (was_machining && !ready(f)))
            return at;
        machine_discharge(was_machining);
        return PART_DONE;
    case PART_END:
        if (!hal_motion_read().in_position || !depth_series_end())
            return at;
        end();
        return PART_DONE;
    default: return PART_DONE;
    }
}

execute_result execute_step(fault *f) {
    part was = at;
    at = advance(f);
    /* The processor must not sleep while it watches the gap itself. */
    bool watches = at == PART_TOUCH && work->touch_away;
    if (at == PART_DWELL || at == PART_MOVE || at == PART_DONE)
        machine_wait(false);
    if (f->code != FAULT_NONE)
        return EXECUTE_FAULT;
    if (at != PART_DONE)
        return at == was && !watches ? EXECUTE_WAIT : EXECUTE_MORE;
    return was == PART_END ? EXECUTE_END : EXECUTE_DONE;
}
