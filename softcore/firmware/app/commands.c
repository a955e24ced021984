// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"

#include "app/auxiliary.h"
#include "app/control.h"
#include "app/execute.h"
#include "app/firmware.h"
#include "app/homing.h"
#include "app/homing_cycle.h"
#include "app/jog.h"
#include "app/jogging.h"
#include "app/keep.h"
#include "app/listing.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/program.h"
#include "app/scope.h"
#include "app/start_block.h"
#include "app/status.h"
#include "app/touch.h"
#include "app/walk.h"
#include "app/wiring.h"
#include "base/alarm.h"
#include "base/grbl.h"
#include "base/settings.h"
#include "base/text.h"
#include "base/watch.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/frame.h"
#include "link/lines.h"
#include "link/link.h"
#include "link/output.h"
#include "link/tape.h"
#include "path/path.h"
#include "roughing/commands.h"

/* Rows of `$#`: work offsets, G28 and G30, G92 with the lines that grbl sends after it, wire
   offsets. */
#define OFFSET_PLACES PLAN_SYSTEMS
#define OFFSET_SET (OFFSET_PLACES + PLAN_PLACES)
#define OFFSET_WIRES OFFSET_SET /* D0 is none */
#define OFFSET_ROWS (OFFSET_WIRES + PLAN_WIRES)

static unsigned unlocked_rows;  /* rows still to be sent after an unlock */
static unsigned offset_row;     /* next row of `$#`; OFFSET_ROWS: nobody asked for it */
static bool reported;           /* the last thing sent was a complete status report */
static bool line_open;          /* a block entered by hand has not been answered */
static fault refusal;           /* of the last line; sent in the next step, to keep steps short */
static bool greets;             /* the greeting is still to be sent */
static hal_overrides overrides; /* as last read */
static uint32_t ignored;        /* bytes since power-on that would have moved a guarded machine */

/* This step noted a hold. It came before the orders that this step takes, or after them. */
static bool hold_came;

static void restart(void) {
    line_open = false;
    refusal.code = FAULT_NONE;
    greets = true;
    listing_stop();
    offset_row = OFFSET_ROWS;
    unlocked_rows = 0;
    roughing_stop();
    firmware_stop();
    link_restart();
}

void commands_init(void) {
    link_init();
    restart();
    status_init();
    ignored = 0;
}

/* Answer a line: ok, or the error with its message. */
static void answer(const fault *f) {
    line_open = false;
    lines_answer(f);
}

__attribute__((noinline)) void commands_answer_program(void) {
    if (program_answers()) {
        watch_between();
        answer(program_answer());
    }
    if (homing_answers())
        answer(homing_answer());
    if (firmware_answers())
        answer(firmware_answer());
}

/* Answer a line that was carried out, or keep its refusal for the next step. */
static void answer_with(const fault *f) {
    if (f->code == FAULT_NONE)
        answer(0);
    else
        refusal = *f;
}

static void tell_refusal(void) {
    answer(&refusal);
    refusal.code = FAULT_NONE;
}

/* Refuse a command; name it if grbl has it and this version does not. */
static void refuse_command(const char *line, uint32_t length, fault *f) {
    static const struct {
        const char *begin, *says;
    } ROWS[] = {
        {"H", "homing is $H: all axes of $533, in that order"},
        {"J", "a jog begins with $J="},
        {"C", "the check mode ($C) is not in this version; gapkeeper tape check reads a program"},
        {"SLP", "$SLP is not in this version; Ctrl-X makes the outputs safe"},
        {"N", "lines at the start ($N) are not kept: nothing is carried out at power-on"},
    };
    for (unsigned i = 0; i < sizeof ROWS / sizeof *ROWS; i++) {
        uint32_t at = 0;
        while (ROWS[i].begin[at] && at + 1 < length && (line[at + 1] & ~0x20) == (ROWS[i].begin[at] & ~0x20))
            at++;
        if (!ROWS[i].begin[at]) {
            fault_at(f, FAULT_COMMAND, 0, "%s", ROWS[i].says);
            return;
        }
    }
    fault_at(f, FAULT_COMMAND, 0, "this $ command is not in this version");
}

static bool is_free(fault *f) {
    return !machine_locked() ||
           fault_at(f, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X first");
}

static void resume(fault *f) {
    if (!is_free(f) || jog_active())
        return; /* a jog has no hold: it would be cancelled */
    if (hold_came) {
        fault_at(f, FAULT_BUSY, 0, "a hold came at the same time, and is in force: resume again");
        return;
    }
    if (machine_hold(false, f)) {
        walk_end();
        program_resume();
    }
}

static void retract(fault *f) {
    if (is_free(f) && !jog_active() && !homing_active())
        machine_retract();
}

/* A real-time byte has no answer. A message says why a byte did nothing. */
static void say(const fault *f) {
    if (f->code == FAULT_NOT_ARMED)
        output_message(f);
}

/* Carries out all real-time bytes except the reset and the hold. */
__attribute__((noinline)) static void obey_notes(uint32_t notes) {
    fault f = {0};
    bool resumes = notes & NOTE_RESUME, retracts = notes & NOTE_RETRACT;
    if (notes & NOTE_STATUS) {
        status_want();
        jog_heard();
    }
    if (notes & NOTE_CANCEL)
        jogging_cancel();
    /* Like grbl, only at rest. Switching off is safe, so a guarded link allows it too. */
    if (notes & NOTE_STOP && meter_rests())
        machine_quench();
    if (lines_guarded()) {
        ignored += resumes + retracts;
        return;
    }
    if (resumes)
        resume(&f);
    if (retracts)
        retract(&f);
    say(&f);
}

/* At rest, and not held in the middle of a motion. With safe outputs the drives are off, and an axis
   may rest away from its command. */
static bool stands(void) {
    hal_motion motion = hal_motion_read();
    return hal_safe() ? !motion.moving : path_at_front() && motion.in_position;
}

__attribute__((noinline)) static void assign(const char *line, uint32_t length, fault *f) {
    uint32_t number, value;
    if (grbl_refuses(line, length, f) || !settings_read(line, length, &number, &value, f))
        return;
    watch_between();
    bool loses = settings_of_drive(number) && settings_get(settings_find(number)) != value;
    if (program_running() && !settings_switch(number))
        fault_at(f, FAULT_BUSY, 0, "settings cannot change while a program runs");
    else if (((machine_machining() || !stands()) && settings_guard(number)) ||
             (loses && !status_idle() && !machine_locked()))
        fault_at(f, FAULT_BUSY, 0, "setting %u guards the machine: M05 and rest come first", number);
    else if (settings_enter(number, value, f)) {
        watch_between(); /* conversions take divisions of 64 bits */
        if (settings_of_gap(number))
            gap_settings();
        if (loses)
            machine_lose_position();
    }
}

/* Is the line equal to `text`, which is in capitals? Case does not matter in the line. */
static bool says(const char *line, uint32_t length, const char *text) {
    uint32_t at = 0;
    for (; at < length && text[at]; at++)
        if ((line[at] >= 'a' && line[at] <= 'z' ? line[at] - 'a' + 'A' : line[at]) != text[at])
            return false;
    return at == length && !text[at];
}

/* `$L`: counts of lines and frames received since power-on, and of damaged ones. */
__attribute__((noinline)) static void tell_link(void) {
    lines_counts lines = lines_count();
    frame_counts frames = frame_count();
    output_line("[LNK:lines %u,refused %u,frames %u,damaged %u,faulty %u,ignored %u]",
                lines.accepted, lines.refused, frames.begun, frames.damaged, link_errors(), ignored);
}

/* Later steps send what still restricts the machine, and then the answer: sending all at once would
   take too long. */
static void unlock(void) {
    fault f = {0};
    bool was_locked = machine_locked();
    if (control_unlock(&f) && was_locked)
        unlocked_rows = MACHINE_UNLOCKED_ROWS;
    else
        answer_with(&f);
}

__attribute__((noinline)) static void tell_unlocked(void) {
    machine_tell_unlocked(MACHINE_UNLOCKED_ROWS - unlocked_rows);
    if (--unlocked_rows == 0)
        answer(0);
}

static bool begins_list(const char *line, uint32_t length) {
    static const char *const LISTS[] = {
        [LISTING_VALUES] = "$$", [LISTING_WORDS] = "$ES", [LISTING_GROUPS] = "$EG",
        [LISTING_COST] = "$P", [LISTING_INPUTS] = "$INPUTS", [LISTING_MEMORY] = "$MEMORY"};
    for (unsigned kind = 0; kind < sizeof LISTS / sizeof *LISTS; kind++)
        if (says(line, length, LISTS[kind]))
            return listing_begin((listing_kind)kind), true;
    return false;
}

/* `$ES=n`: true if setting n exists; its line is then sent later. */
static bool begins_words(const char *line, uint32_t length, fault *f) {
    uint32_t at = 4, number;
    if (!settings_read_number(line, length, &at, &number) || at < length)
        return fault_at(f, FAULT_SETTING, at, "the words of a setting are asked for by $ES=number");
    return listing_begin_one(number) ||
           fault_at(f, FAULT_SETTING, 0, "setting %u does not exist", number);
}

/* A line that begins with `$`. */
__attribute__((noinline)) static void command(char *line, uint32_t length) {
    fault f = {0};
    char c = length > 1 ? line[1] : '\0';
    if (says(line, length, "$MEMORY") && !wiring_allowed(&f))
        return answer_with(&f);
    if (begins_list(line, length))
        return; /* answered at the end of the list */
    if (length == 2 && c == '#')
        return (void)(offset_row = 0);
    if (length > 2 && says(line, 3, "$J=")) {
        if (!jogging_allowed(&f))
            refusal = f;
        else
            line_open = program_jog(line, length);
        return; /* answered when it has been judged */
    }
    if (says(line, length, "$H")) {
        refusal = (fault){0};
        line_open = homing_cycle_begin(&refusal);
        return; /* answered at the end of the cycle */
    }
    if (c == 'B')
        return roughing_line(line + 2, length - 2); /* answered when it has been carried out */
    if (length > 3 && says(line, 4, "$ES=")) {
        if (!begins_words(line, length, &f))
            answer_with(&f);
        return;
    }
    if (length > 5 && says(line, 6, "$SCOPE")) {
        uint32_t first, end;
        (void)scope_line(line, length, &first, &end, &f); /* refused: f says why, and end is 0 */
        return end ? listing_begin_scope(first, end) : answer_with(&f);
    }
    if (length > 8 && says(line, 9, "$FIRMWARE")) {
        line_open = firmware_line(line, length, &f);
        return line_open ? (void)0 : answer_with(&f);
    }
    if (length > 6 && says(line, 7, "$LEVELS"))
        (void)wiring_levels(line, length, &f);
    else if (length > 4 && says(line, 5, "$RST="))
        keep_restore(line[5], length, &f);
    else if (length > 5 && says(line, 6, "$FROM="))
        program_running()
            ? (void)fault_at(&f, FAULT_BUSY, 0, "a program runs: $FROM is for the next tape")
        : says(line, length, "$FROM=LAST")
            ? start_block_last(execute_state(), &f)
            : start_block_line(line, length, &f);
    else if (length > 5 && says(line, 6, "$WALK="))
        is_free(&f) ? walk_line(line, length, &f) : (void)0;
    else if (says(line, length, "$POSITION=HERE"))
        control_take_position(&f);
    else if (length == 2 && (c == 'X' || c == 'x'))
        return unlock();
    else if (length == 2 && (c == 'I' || c == 'i'))
        firmware_tell_version();
    else if (length == 2 && (c == 'G' || c == 'g'))
        status_tell_modes();
    else if (length == 2 && (c == 'N' || c == 'n'))
        output_line("$N0="); /* there are no start-up lines: the machine never moves unasked */
    else if (length == 2 && (c == 'L' || c == 'l'))
        tell_link();
    else if (length == 1)
        output_line("[HLP:$$ $# $n=value $ES $ES=n $EG $G $N $X $H $POSITION=HERE $FROM=block $FROM=last $WALK=mm $RST=$ $RST=# $RST=* $J=line $I $P $L $B $INPUTS $MEMORY $LEVELS=open,arc $SCOPE $FIRMWARE $RESUME $RETRACT ~ ! ? ctrl-x]");
    else if (c >= '0' && c <= '9')
        assign(line, length, &f);
    else
        refuse_command(line, length, &f);
    answer_with(&f);
}

/* Take the next line that was received; true if there was one. */
__attribute__((noinline)) static bool take_line(void) {
    static char line[LINES_TEXT_SIZE];
    uint32_t length;
    lines_kind kind = lines_take(line, &length);
    if (kind != LINES_TEXT)
        return kind == LINES_REFUSED;
    if (length == 0 || (length == 1 && line[0] == '%')) {
        answer(0); /* does nothing, but senders for grbl expect an answer to every line */
        return true;
    }
    if (line[0] == '$') {
        command(line, length);
        return true;
    }
    fault f = {0};
    if (jog_active())
        fault_at(&f, FAULT_LOCKED, 0, "a jog is under way; send this line when it has ended");
    else if (is_free(&f) && (tape_runs() || !program_line(line, length)))
        fault_at(&f, FAULT_BUSY, 0, "a program is running");
    if (f.code != FAULT_NONE)
        refusal = f;
    else
        line_open = true;
    return true;
}

/* `$#`: the next row. Offsets as grbl sends them, mm in the machine frame; then the wire offsets
   that have been entered. */
__attribute__((noinline)) static void tell_offset(void) {
    const modal *state = execute_state();
    unsigned row = offset_row++;
    if (row < PLAN_SYSTEMS) {
        const int32_t *origin = state->systems[row];
        output_line("[G%u:%p,%p,%p]", 54 + row, origin[0], origin[1], origin[2]);
    } else if (row < OFFSET_SET) {
        const int32_t *place = state->places[row - OFFSET_PLACES];
        output_line("[G%u:%p,%p,%p]", row == OFFSET_PLACES ? 28u : 30u, place[0], place[1], place[2]);
    } else if (row == OFFSET_SET) {
        const int32_t *origin = state->systems[state->system];
        output_line("[G92:%p,%p,%p]", state->offset[0] - origin[0], state->offset[1] - origin[1],
                    state->offset[2] - origin[2]);
        output_line("[TLO:%p]", 0);
        touch_tell_last();
    } else if (state->wires_given >> (row - OFFSET_WIRES) & 1) {
        output_line("[D%u:%p]", row - OFFSET_WIRES, state->wires[row - OFFSET_WIRES]);
    }
    if (offset_row == OFFSET_ROWS)
        answer(0);
}

/* One step of the planner; sends a line of its result, or its answer. */
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
    /* A host that asks for reports without end must not block lines: after a report, others have a
       turn. */
    bool reports = status_wanted() && !reported;
    reported = false;
    if (greets) {
        /* Not in the middle of a line: its sender would take the greeting for the answer. */
        if (!lines_whole())
            return false;
        greets = false;
        output_line("Grbl 1.1h ['$' for help]"); /* our own name is in `$I` */
        keep_tell();
    } else if (reports) {
        status_tell();
        reported = !status_wanted();
    } else if (refusal.code != FAULT_NONE) {
        tell_refusal();
    } else if (unlocked_rows) {
        tell_unlocked();
    } else if (listing_open()) {
        if (listing_tell())
            answer(0);
    } else if (offset_row < OFFSET_ROWS) {
        tell_offset();
    } else if (roughing_busy()) {
        return serve_planner();
    } else {
        return (!line_open && take_line()) || status_wanted();
    }
    return true;
}

/* The operator's reset. It drops everything received; the greeting follows when the line is
   quiet. */
static void reset(void) {
    control_reset();
    watch_between(); /* the alarm, the line's answer and the rest take long, each by itself */
    commands_answer_program();
    watch_between();
    restart();
    hal_release_reset();
}

/* Not inlined into commands_step, which every pass calls and which must stay quick. */
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

bool commands_wait(void) {
    hal_overrides wanted = hal_overrides_read();
    return wanted.feed != overrides.feed || wanted.rapid != overrides.rapid;
}

/* On a guarded link no override takes effect: the byte may be a damaged one of another meaning. */
__attribute__((noinline)) static void obey_overrides(void) {
    hal_overrides wanted = hal_overrides_read();
    overrides = wanted;
    if (lines_guarded()) {
        if (wanted.feed == 100 && wanted.rapid == 100)
            return;
        ignored++;
        hal_release_override();
    }
    override_step();
}

bool commands_step(void) {
    uint32_t notes = hal_notes();
    hold_came = notes & NOTE_HOLD || (link_order_waits() && hold_came);
    if (notes)
        obey_notes(notes);
    if (commands_wait())
        obey_overrides();
    link_come come = link_take();
    if (come > LINK_TAKEN) {
        watch_between();
        obey(come);
    }
    /* The gateware already holds. The firmware follows last, as the hold may have come last. A reset
       in the same pass drops it with all the rest: nothing moves after it. */
    if (notes & NOTE_HOLD && come != LINK_RESET) {
        (void)machine_hold(true, 0);
        walk_hold();
        if (jog_active() || program_jogs())
            jogging_cancel();
    }
    return link_step(come != LINK_NOTHING);
}
