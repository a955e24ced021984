// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"

#include "app/control.h"
#include "app/events.h"
#include "app/execute.h"
#include "app/image_watch.h"
#include "app/machine.h"
#include "app/profile.h"
#include "app/program.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/text.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/frame.h"
#include "link/lines.h"
#include "link/link.h"
#include "link/output.h"
#include "link/tape.h"
#include "path/path.h"
#include "roughing/commands.h"

/* Small rather than fast: the link is slower than what is said over it. */
#ifdef __clang__
#pragma clang attribute push(__attribute__((minsize)), apply_to = function)
#endif

#define VERSION "0.1"
/* Rows of `$#`: work offsets, G92, wire offsets. */
#define OFFSET_ROWS (PLAN_SYSTEMS + PLAN_WIRES)

static uint32_t listing;    /* next row of `$$`, SETTINGS when none is asked for */
static unsigned unlocked_rows;  /* of what is told behind an unlock, still to come */
static unsigned offset_row; /* next row of `$#`, OFFSET_ROWS when none is asked for */
static enum { STATUS_NONE, STATUS_WANTED, STATUS_BEGUN } status;
static bool line_open;      /* a block entered by hand has not been answered */
static bool greets;         /* the greeting is to be said */
static uint32_t ignored;    /* since power-on: bytes that would have moved a guarded machine */

/* A hold was noted in this step: it may have come before what is taken now, or after it. */
static bool hold_came;

static void restart(void) {
    line_open = false;
    greets = true;
    listing = SETTINGS;
    offset_row = OFFSET_ROWS;
    unlocked_rows = 0;
    roughing_stop();
    link_restart();
}

void commands_init(void) {
    link_init();
    restart();
    status = STATUS_NONE;
    ignored = 0;
}

/* To a line: ok, or the error with its message. */
static void answer(const fault *f) {
    line_open = false;
    lines_answer(f);
}

__attribute__((noinline)) void commands_answer_program(void) {
    if (program_answers())
        answer(program_answer());
}

static const char *state_name(void) {
    if (machine_locked() || machine_position_lost())
        return "Alarm";
    if (machine_held() || program_paused())
        return "Hold";
    return program_running() || !path_at_front() || roughing_busy() ? "Run" : "Idle";
}

/* In two steps: all of it at once would take too long for one pass of the main loop. */
__attribute__((noinline)) static void tell_status(void) {
    static char report[OUTPUT_LINE];
    static uint32_t length;
    const int32_t *offset = program_offset();
    if (status == STATUS_WANTED) {
        length = text_print(report, sizeof report, "<%s|MPos:%p,%p,%p|WCO:%p,%p,%p", state_name(),
                            hal_axis_position(0), hal_axis_position(1), hal_axis_position(2),
                            offset[0], offset[1], offset[2]);
        status = STATUS_BEGUN;
        return;
    }
    uint32_t counts[4];
    char masked[SETTINGS_MASKED];
    hal_gap_counts(counts);
    settings_masked(masked, sizeof masked);
    text_print(report + length, sizeof report - length,
               "|Ln:%u|Er:%d,%d,%d|Rt:%u,%u|Gap:%u,%u,%u,%u%s%s%s%s>", alarm_line(),
               hal_axis_error(0), hal_axis_error(1), hal_axis_error(2),
               (uint32_t)hal_motion_read().state, hal_shorts(), counts[0], counts[1], counts[2],
               counts[3], hal_armed() ? "|Armed" : "", machine_position_lost() ? "|Lost" : "",
               *masked ? "|Off:" : "", masked);
    output_line("%s", report);
    status = STATUS_NONE;
}

static bool is_free(fault *f) {
    return !machine_locked() ||
           fault_at(f, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X");
}

static void resume(fault *f) {
    if (!is_free(f))
        return;
    if (hold_came) {
        fault_at(f, FAULT_BUSY, 0, "a hold came at the same time, and is in force: resume again");
        return;
    }
    machine_hold(false);
    program_resume();
}

static void retract(fault *f) {
    if (is_free(f))
        machine_retract();
}

/* Real-time bytes but the reset and the hold. */
__attribute__((noinline)) static void obey_notes(uint32_t notes) {
    fault f = {0};
    bool resumes = notes & NOTE_RESUME, retracts = notes & NOTE_RETRACT;
    if (notes & NOTE_STATUS && status == STATUS_NONE)
        status = STATUS_WANTED;
    if (lines_guarded()) {
        ignored += resumes + retracts;
        return;
    }
    if (resumes)
        resume(&f);
    if (retracts)
        retract(&f);
}

__attribute__((noinline)) static void assign(const char *line, uint32_t length, fault *f) {
    uint32_t number, value;
    if (!settings_read(line, length, &number, &value, f))
        return;
    if (program_running())
        fault_at(f, FAULT_BUSY, 0, "settings cannot change while a program runs");
    else if ((machine_machining() || hal_motion_read().moving) && settings_guard(number))
        fault_at(f, FAULT_BUSY, 0, "setting %u guards the machine: M05 and rest come first", number);
    else if (settings_enter(number, value, f) && settings_of_gap(number))
        gap_settings();
}

/* `$P`: blocks read and clocks per block, longest pass of the main loop by task, longest time from an
   event of the gateware to the end of its interrupt, and what the check of the image has taken; all since
   reset, in clocks. */
__attribute__((noinline)) static void tell_cost(void) {
    program_cost cost = program_profile();
    output_line("[PRF:blocks %u,mean %u,worst %u,events %u,path %u,program %u,link %u,interrupt %u,"
                "image %u]",
                cost.blocks, cost.blocks ? cost.total / cost.blocks : 0, cost.worst,
                profile_worst(0), profile_worst(1), profile_worst(2), profile_worst(3), events_worst(),
                image_watch_clocks());
}

/* Is the line this text, given in capitals? */
static bool says(const char *line, uint32_t length, const char *text) {
    uint32_t at = 0;
    for (; at < length && text[at]; at++)
        if ((line[at] >= 'a' && line[at] <= 'z' ? line[at] - 'a' + 'A' : line[at]) != text[at])
            return false;
    return at == length && !text[at];
}

/* `$L`: what came over the link since power-on, and what of it was damaged. */
__attribute__((noinline)) static void tell_link(void) {
    lines_counts lines = lines_count();
    frame_counts frames = frame_count();
    output_line("[LNK:lines %u,refused %u,frames %u,damaged %u,errors %u,ignored %u]",
                lines.accepted, lines.refused, frames.begun, frames.damaged, link_errors(), ignored);
}

/* What holds then is told in later steps, and answered behind it: all at once would take too long. */
static void unlock(void) {
    fault f = {0};
    bool was_locked = machine_locked();
    if (control_unlock(&f) && was_locked)
        unlocked_rows = MACHINE_UNLOCKED_ROWS;
    else
        answer(&f);
}

__attribute__((noinline)) static void tell_unlocked(void) {
    machine_tell_unlocked(MACHINE_UNLOCKED_ROWS - unlocked_rows);
    if (--unlocked_rows == 0)
        answer(0);
}

/* A line that begins with `$`. */
__attribute__((noinline)) static void command(const char *line, uint32_t length) {
    fault f = {0};
    char c = length > 1 ? line[1] : '\0';
    if (length == 2 && c == '$') {
        listing = 0;
        return; /* answered at the end of the list */
    }
    if (length == 2 && c == '#') {
        offset_row = 0;
        return;
    }
    if (c == 'B') {
        roughing_line(line + 2, length - 2);
        return; /* answered when it has been carried out */
    }
    if (says(line, length, "$POSITION=HERE"))
        control_take_position(&f);
    else if (length == 2 && (c == 'X' || c == 'x'))
        return unlock();
    else if (length == 2 && (c == 'I' || c == 'i'))
        output_line("[VER:" VERSION ":Gapkeeper]");
    else if (length == 2 && (c == 'P' || c == 'p'))
        tell_cost();
    else if (length == 2 && (c == 'L' || c == 'l'))
        tell_link();
    else if (length == 1)
        output_line("[HLP:$$ $# $n=value $X $POSITION=HERE $I $P $L $B $RESUME $RETRACT ~ ! ? ctrl-x]");
    else if (c >= '0' && c <= '9')
        assign(line, length, &f);
    else
        fault_at(&f, FAULT_REFUSED, 0, "this $ command is not in this version");
    answer(&f);
}

/* True if there was a line. */
__attribute__((noinline)) static bool take_line(void) {
    static char line[LINES_TEXT_SIZE];
    uint32_t length;
    lines_kind kind = lines_take(line, &length);
    if (kind != LINES_TEXT)
        return kind == LINES_REFUSED;
    if (length == 0) {
        answer(0);
        return true;
    }
    if (line[0] == '$') {
        command(line, length);
        return true;
    }
    fault f = {0};
    if (is_free(&f) && (tape_runs() || !program_line(line, length)))
        fault_at(&f, FAULT_BUSY, 0, "a program is running");
    if (f.code != FAULT_NONE)
        answer(&f);
    else
        line_open = true;
    return true;
}

__attribute__((noinline)) static void tell_setting(void) {
    const settings_table_row *row = &SETTINGS_TABLE_ROWS[listing];
    output_line("$%u=%u (%s%s%s)", (uint32_t)row->number, settings_get((setting)listing), row->title,
                *row->unit ? ", " : "", row->unit);
    if (++listing == SETTINGS)
        answer(0);
}

/* `$#`: offsets as grbl tells them, mm in the machine frame; the wire offsets that have been entered. */
__attribute__((noinline)) static void tell_offset(void) {
    const modal *state = execute_state();
    unsigned row = offset_row++;
    if (row < PLAN_SYSTEMS) {
        const int32_t *origin = state->systems[row];
        output_line("[G%u:%p,%p,%p]", 54 + row, origin[0], origin[1], origin[2]);
    } else if (row == PLAN_SYSTEMS) {
        const int32_t *origin = state->systems[state->system];
        output_line("[G92:%p,%p,%p]", state->offset[0] - origin[0], state->offset[1] - origin[1],
                    state->offset[2] - origin[2]);
    } else if (state->wires_given >> (row - PLAN_SYSTEMS) & 1) {
        output_line("[D%u:%p]", row - PLAN_SYSTEMS, state->wires[row - PLAN_SYSTEMS]);
    }
    if (offset_row == OFFSET_ROWS)
        answer(0);
}

/* A step of the planner: a line of its result, or its answer. */
__attribute__((noinline)) static bool serve_planner(void) {
    char line[OUTPUT_LINE / 2];
    fault f = {0};
    switch (roughing_serve(program_running(), line, sizeof line, &f)) {
    case ROUGHING_WAITS: return false;
    case ROUGHING_TELLS: output_line("[MSG:%s]", line); return true;
    case ROUGHING_ANSWERS: answer(&f); return true;
    default: return true;
    }
}

bool commands_serve(void) {
    if (!output_has_room() || alarm_untold())
        return false;
    if (greets) {
        /* Before that a sender may be in the middle of something. */
        if (!lines_whole())
            return false;
        greets = false;
        output_line("Gapkeeper " VERSION " ['$' for help]");
    } else if (status != STATUS_NONE) {
        tell_status();
    } else if (unlocked_rows) {
        tell_unlocked();
    } else if (listing < SETTINGS) {
        tell_setting();
    } else if (offset_row < OFFSET_ROWS) {
        tell_offset();
    } else if (roughing_busy()) {
        return serve_planner();
    } else {
        return !line_open && take_line();
    }
    return true;
}

#ifdef __clang__
#pragma clang attribute pop
#endif

/* The operator's reset: afterwards nothing has come, and the greeting is said when the line is quiet. */
static void reset(void) {
    control_reset();
    commands_answer_program();
    restart();
    hal_release_reset();
}

/* Apart from commands_step, which is called in every pass and has to be quick. */
__attribute__((noinline)) static void obey(link_come order) {
    fault f = {0};
    if (order == LINK_RESET) {
        reset();
        return;
    }
    if (order == LINK_RESUME)
        resume(&f);
    else
        retract(&f);
    lines_ordered(&f);
}

bool commands_step(void) {
    uint32_t notes = hal_notes();
    hold_came = notes & NOTE_HOLD || (link_order_waits() && hold_came);
    if (notes)
        obey_notes(notes);
    link_come come = link_take();
    if (come > LINK_TAKEN)
        obey(come);
    /* The hold is in force already. It goes last: it may have come last. */
    if (notes & NOTE_HOLD)
        machine_hold(true);
    return link_step(come != LINK_NOTHING);
}
