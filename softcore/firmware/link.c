// SPDX-License-Identifier: Apache-2.0
#include "link.h"

#include "events.h"
#include "execute.h"
#include "frame.h"
#include "hal.h"
#include "machine.h"
#include "output.h"
#include "path.h"
#include "planner.h"
#include "program.h"
#include "reader.h"
#include "settings.h"
#include "text.h"
#include "watch.h"

#define VERSION "0.1"
#define BURST 24            /* bytes taken per step; the gateware's queue holds 256 */
#define TYPED 256           /* characters of lines that wait; a power of two */

/* Rows of `$#`: work offsets, G92, wire offsets. */
#define OFFSET_ROWS (PLAN_SYSTEMS + PLAN_WIRES)

#define REALTIME_STATUS '?'
#define REALTIME_HOLD '!'
#define REALTIME_RESUME '~'
#define REALTIME_RESET 0x18
#define REALTIME_RETRACT 0x92

static char typed[TYPED];   /* lines as they come, each ended by '\n' */
static uint32_t typed_head, typed_tail;
static bool typed_lost;     /* the line being typed did not fit */
static uint32_t listing;    /* next row of `$$`, SETTINGS when none is asked for */
static unsigned offset_row; /* next row of `$#`, OFFSET_ROWS when none is asked for */
static enum { STATUS_NONE, STATUS_WANTED, STATUS_BEGUN } status;
static bool line_open;      /* a block entered by hand has not been answered */
static bool greets;         /* the greeting is to be said */

static void forget(void) {
    typed_head = typed_tail = 0;
    typed_lost = line_open = greets = false;
    status = STATUS_NONE;
    listing = SETTINGS;
    offset_row = OFFSET_ROWS;
    planner_stop();
    frame_init();
}

void link_restart(void) {
    forget();
    greets = true;
}

void link_answer(const fault *f) {
    char sentence[200];
    line_open = false;
    if (!f || f->code == FAULT_NONE) {
        output_line("ok");
        return;
    }
    fault_sentence(f, sentence, sizeof sentence);
    output_line("[MSG:%s]", sentence);
    output_line("error:%u", (uint32_t)f->code);
}

static const char *state_name(void) {
    if (machine_locked() || machine_position_lost())
        return "Alarm";
    if (machine_held() || program_paused())
        return "Hold";
    return program_running() || !path_at_front() || planner_busy() ? "Run" : "Idle";
}

/* In two steps: all of it at once would take too long for one pass of the main loop. */
static void tell_status(void) {
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
               "|Ln:%u|Er:%d,%d,%d|Rt:%u,%u|Gap:%u,%u,%u,%u%s%s%s%s>", events_line(),
               hal_axis_error(0), hal_axis_error(1), hal_axis_error(2),
               (uint32_t)hal_motion_read().state, hal_shorts(), counts[0], counts[1], counts[2],
               counts[3], hal_armed() ? "|Armed" : "", machine_position_lost() ? "|Lost" : "",
               *masked ? "|Off:" : "", masked);
    output_line("%s", report);
    status = STATUS_NONE;
}

static bool realtime(uint8_t byte) {
    switch (byte) {
    case REALTIME_STATUS:
        if (status == STATUS_NONE)
            status = STATUS_WANTED;
        return true;
    case REALTIME_HOLD: machine_hold(true); return true;
    case REALTIME_RESUME:
        machine_hold(false);
        program_resume();
        return true;
    case REALTIME_RESET: machine_reset(); return true;
    case REALTIME_RETRACT: machine_retract(); return true;
    default: return false;
    }
}

static void line_byte(uint8_t byte) {
    char c = byte == '\r' ? '\n' : (char)byte;
    if (c == '\n' && typed_lost) {
        fault f = {0};
        fault_at(&f, FAULT_TOO_LONG, 0, "lines came faster than they were answered");
        typed_lost = false;
        link_answer(&f);
        return;
    }
    if (typed_head - typed_tail < TYPED) {
        typed[typed_head++ % TYPED] = c;
        return;
    }
    typed_lost = true;
    while (typed_head != typed_tail && typed[(typed_head - 1) % TYPED] != '\n')
        typed_head--;
}

static void assign(const char *line, uint32_t length, fault *f) {
    uint32_t which, value;
    if (!settings_read(line, length, &which, &value, f))
        return;
    if (program_running())
        fault_at(f, FAULT_BUSY, 0, "settings cannot change while a program runs");
    else if ((machine_machining() || hal_motion_read().moving) && settings_guard(which))
        fault_at(f, FAULT_BUSY, 0, "setting %u guards the machine: M05 and rest come first", which);
    else
        settings_enter(which, value, f);
}

/* `$P`: blocks read and clocks per block, longest pass of the main loop by task, and longest time
   from an event of the gateware to the end of its interrupt; all since reset, in clocks. */
static void tell_cost(void) {
    program_cost cost = program_profile();
    output_line("[PRF:blocks %u,mean %u,worst %u,events %u,path %u,program %u,link %u,interrupt %u]",
                cost.blocks, cost.blocks ? cost.total / cost.blocks : 0, cost.worst,
                watch_worst(0), watch_worst(1), watch_worst(2), watch_worst(3), events_worst());
}

/* Is the line this text, given in capitals? */
static bool says(const char *line, uint32_t length, const char *text) {
    uint32_t at = 0;
    for (; at < length && text[at]; at++)
        if ((line[at] >= 'a' && line[at] <= 'z' ? line[at] - 'a' + 'A' : line[at]) != text[at])
            return false;
    return at == length && !text[at];
}

/* A line that begins with `$`. */
static void command(const char *line, uint32_t length) {
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
        planner_line(line + 2, length - 2);
        return; /* answered when it has been carried out */
    }
    if (says(line, length, "$POSITION=HERE"))
        machine_take_position(&f);
    else if (length == 2 && (c == 'X' || c == 'x'))
        machine_unlock(&f);
    else if (length == 2 && (c == 'I' || c == 'i'))
        output_line("[VER:" VERSION ":Gapkeeper]");
    else if (length == 2 && (c == 'P' || c == 'p'))
        tell_cost();
    else if (length == 1)
        output_line("[HLP:$$ $# $n=value $X $POSITION=HERE $I $P $B ~ ! ? ctrl-x]");
    else if (c >= '0' && c <= '9')
        assign(line, length, &f);
    else
        fault_at(&f, FAULT_REFUSED, 0, "this $ command is not in this version");
    link_answer(&f);
}

/* True if there was a line. */
static bool take_line(void) {
    static char line[READER_BLOCK_SIZE];
    uint32_t end = typed_tail, length = 0;
    while (end != typed_head && typed[end % TYPED] != '\n')
        end++;
    if (end == typed_head)
        return false;
    for (; typed_tail != end; typed_tail++)
        if (length < sizeof line)
            line[length++] = typed[typed_tail % TYPED];
    typed_tail++;
    if (length == 0) {
        /* An empty line is the second half of CR LF; grbl's senders count no answer for it. */
        return true;
    }
    if (line[0] == '$') {
        command(line, length);
        return true;
    }
    fault f = {0};
    if (machine_locked())
        fault_at(&f, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X");
    else if (program_on_tape() || !program_line(line, length))
        fault_at(&f, FAULT_BUSY, 0, "a program is running");
    if (f.code != FAULT_NONE)
        link_answer(&f);
    else
        line_open = true;
    return true;
}

static void tell_setting(void) {
    output_line("$%u=%u (%s)", listing, settings_get((setting)listing),
                SETTING_ROWS[listing].name);
    if (++listing == SETTINGS)
        link_answer(0);
}

/* `$#`: offsets as grbl tells them, mm in the machine frame; the wire offsets that have been entered. */
static void tell_offset(void) {
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
        link_answer(0);
}

bool link_step(void) {
    unsigned taken = 0;
    for (; taken < BURST; taken++) {
        int byte = hal_receive();
        if (byte < 0)
            break;
        if (frame_open())
            frame_byte((uint8_t)byte);
        else if (byte == FRAME_START)
            frame_begin();
        else if (!realtime((uint8_t)byte) && !frame_lost())
            line_byte((uint8_t)byte);
    }
    frame_step();
    return output_step() || taken;
}

bool link_serve(void) {
    if (!output_has_room() || machine_alarm_waits())
        return false;
    if (greets) {
        greets = false;
        output_line("Gapkeeper " VERSION " ['$' for help]");
    } else if (status != STATUS_NONE) {
        tell_status();
    } else if (listing < SETTINGS) {
        tell_setting();
    } else if (offset_row < OFFSET_ROWS) {
        tell_offset();
    } else if (planner_busy()) {
        return planner_serve();
    } else {
        return !line_open && take_line();
    }
    return true;
}
