// SPDX-License-Identifier: Apache-2.0
#include "app/program.h"

#include "app/events.h"
#include "app/execute.h"
#include "app/homing.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/override.h"
#include "app/resume.h"
#include "app/start_block.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "interp/interpreter.h"
#include "interp/jog_words.h"
#include "interp/reader.h"
#include "interp/wire_offset.h"
#include "link/output.h"
#include "link/tape.h"
#include "path/path.h"

#define READ_BUDGET 20      /* bytes of tape per step: some 150 clocks each */
#define PARSE_BUDGET 40     /* characters per step */
#define JOG_START 3         /* characters of `$J=` */

typedef enum { STAGE_READ, STAGE_PARSE, STAGE_PLAN, STAGE_ARC, STAGE_COMPENSATE,
               STAGE_ANNOUNCE, STAGE_EXECUTE } stage;

static bool announced;      /* the event of the program's start has been told */
static bool took;           /* a byte of the tape was read in this step */
static reader tape_reader;

static stage at;
static bool by_hand;        /* the present block comes from a line entered by hand */
static char line_text[READER_BLOCK_SIZE];
static uint32_t line_length;
static bool line_waits;
static bool jogs;           /* this line is a jog */
static const fault *answer; /* to a finished line, until program_answer takes it */
static block words;
static plan work;
static const wire_offset_block *current;   /* being carried out */
static fault trouble;
static program_cost cost;
static uint32_t spent;      /* clocks spent on the present block so far */
static bool judged;         /* the block has been judged: `spent` is complete */

void program_init(void) {
    tape_init();
    announced = line_waits = by_hand = false;
    answer = 0;
    at = STAGE_READ;
    wire_offset_reset();
    start_block_drop();
    cost = (program_cost){0};
    judged = false;
    execute_init();
}

bool program_running(void) { return tape_runs() || at != STAGE_READ || line_waits; }
bool program_paused(void) { return at == STAGE_EXECUTE && execute_paused(); }
program_cost program_profile(void) { return cost; }
void program_resynchronise(void) { execute_resynchronise(); }
const int32_t *program_offset(void) { return execute_state()->offset; }

void program_resume(void) {
    if (program_paused())
        execute_resume();
}

static void answer_line(const fault *f) {
    static const fault none;
    by_hand = line_waits = false;
    answer = f ? f : &none;
}

bool program_answers(void) { return answer; }

const fault *program_answer(void) {
    const fault *told = answer;
    answer = 0;
    return told;
}

static void drop_block(void) {
    at = STAGE_READ;
    wire_offset_reset();
    execute_abort();
}

void program_abort(void) {
    if (by_hand || line_waits) {
        trouble = (fault){0};
        fault_at(&trouble, FAULT_LOCKED, 0, "stopped by an alarm or a reset");
        answer_line(&trouble);
    }
    tape_drop();
    drop_block();
    start_block_drop();
}

bool program_jogs(void) { return jogs && (by_hand || line_waits); }

void program_cancel_jog(void) {
    if (!program_jogs())
        return;
    trouble = (fault){.code = FAULT_JOG_ENDED, .text = FAULT_TEXT_JOG_ENDED};
    answer_line(&trouble);
    drop_block();
}

bool program_line(const char *text, uint32_t length) {
    if (line_waits || by_hand)
        return false;
    line_length = length < sizeof line_text ? length : sizeof line_text;
    for (uint32_t i = 0; i < line_length; i++)
        line_text[i] = text[i];
    line_waits = true;
    jogs = false;
    return true;
}

bool program_jog(const char *text, uint32_t length) {
    jogs = program_line(text, length);
    return jogs;
}

__attribute__((noinline)) static void fail(void) {
    if (by_hand) {
        /* The line did nothing yet: the operator gets an answer, and no alarm is needed. */
        at = STAGE_READ;
        answer_line(&trouble);
    } else {
        alarm_raise(&trouble);
    }
}

static void begin_block(const char *text, uint32_t length) {
    trouble = (fault){.line = by_hand ? 0 : tape_reader.line};
    block_begin(&words, text, length);
    if (program_jogs())
        words.at = JOG_START;
    at = STAGE_PARSE;
}

/* The tape starts to run with its first byte. */
static bool tape_starts(void) {
    if (tape_waits()) {
        if (machine_locked()) {
            trouble = (fault){0};
            fault_at(&trouble, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X first");
            fail();
            return false;
        }
        if (!path_at_front() || jog_active() || homing_active())
            return false; /* a line entered by hand still moves the machine */
        if (!execute_start())
            return false;
        reader_begin(&tape_reader, settings_get(SET_TV));
        announced = false;
        tape_run();
        return false; /* starting the tape is enough work for one step */
    }
    return tape_runs();
}

static void read_tape(void) {
    if (!tape_starts())
        return;
    trouble = (fault){0};
    int byte;
    for (unsigned i = 0; i < READ_BUDGET && (byte = tape_byte()) >= 0; i++) {
        took = true;
        switch (reader_byte(&tape_reader, (uint8_t)byte, &trouble)) {
        case READER_BLOCK: begin_block(tape_reader.text, tape_reader.length); return;
        case READER_FAULT: fail(); return;
        case READER_ENDED: return;
        default: break;
        }
    }
    if (tape_is_over() && !reader_finish(&tape_reader, &trouble))
        fail();
}

static void step_read(void) {
    if (!line_waits) {
        read_tape();
        return;
    }
    line_waits = false;
    by_hand = true;
    begin_block(line_text, line_length);
}

static void finish_block(void) {
    at = STAGE_READ;
    if (by_hand)
        answer_line(0);
    else if (tape_reader.state == READ_DATA)
        reader_next(&tape_reader);
}

static void step_parse(void) {
    bool skip = settings_get(SET_BLOCK_SKIP) && !program_jogs();
    switch (block_step(&words, skip, PARSE_BUDGET, &trouble)) {
    case BLOCK_DONE:
        if (words.skipped)
            finish_block();
        else
            at = STAGE_PLAN;
        break;
    case BLOCK_FAULT:
        if (!program_jogs())
            interpreter_unread(&words, &trouble);
        trouble.block = block_has(&words, 'N') ? block_name(&words, 'N') : 0;
        fail();
        break;
    default: break;
    }
}

static void next_block(void) {
    current = wire_offset_next();
    if (!current) {
        finish_block();
        return;
    }
    uint32_t line = by_hand ? ALARM_BY_HAND | current->number : current->line;
    execute_begin(current->p, by_hand, line, current->text, current->length);
    at = STAGE_EXECUTE;
}

static void step_compensate(void) {
    switch (wire_offset_step(settings_travel_now(), &trouble)) {
    case PLAN_FAULT: fail(); return;
    case PLAN_DONE:
        judged = true;
        at = STAGE_ANNOUNCE;
        if (by_hand || announced)
            next_block();
        return;
    default: return;
    }
}

static void step_arc(void) {
    switch (interpreter_arc_step(&work, settings_travel_now(), &trouble)) {
    case PLAN_MORE: return;
    case PLAN_FAULT: fail(); return;
    default: break;
    }
    if (!by_hand && work.stop == STOP_END)
        reader_stop(&tape_reader);
    cost.blocks++;
    /* A block without words, such as a comment, causes no event. */
    bool empty = !words.present && !words.g_count && !words.m_count;
    at = STAGE_COMPENSATE;
    if (!wire_offset_take(&work, words.text, empty ? 0 : words.length, tape_reader.line,
                          trouble.block, &trouble))
        fail();
    else if (wire_offset_ready())
        step_compensate(); /* a short step: do it now */
}

static bool judge(void) {
    const modal *before = wire_offset_state(execute_state());
    uint32_t highest = settings_highest_speed();
    const travel_range *travel = settings_travel_now();
    return program_jogs()
               ? jog_words_judge(&words, before, highest, travel, &work, &trouble)
               : interpreter_block(&words, before, by_hand, highest, travel, hal_jump_axis(), &work,
                                   &trouble);
}

static void step_plan(void) {
    if (!judge()) {
        fail();
        return;
    }
    watch_between(); /* to judge a block with many words takes long, and so does what follows */
    /* A line entered by hand is refused at once if the discharge is not armed. A tape is read
       ahead, so the operator may still press ARM in time. */
    if (!machine_allows(work.moves || work.here, work.machining_on && by_hand, &trouble)) {
        fail();
        return;
    }
    if (program_jogs() && work.moves) {
        jog_begin();
        override_step(); /* no override scales a jog */
    }
    at = STAGE_ARC;
    if (work.arc == ARC_NONE)
        step_arc(); /* no work without an arc: do it now */
}

static void step_announce(void) {
    if (!by_hand && !announced) {
        announced = true;
        alarm_set_line(tape_reader.line);
        if (work.name >= 0)
            events_now(EVENT_WORD_PROGRAM_START, EVENT_FORMAT_PROGRAM_START_FULL, (uint32_t)work.name);
        else
            events_now(EVENT_WORD_PROGRAM_START, EVENT_FORMAT_PROGRAM_START);
        return;
    }
    next_block();
}

static bool step_execute(void) {
    /* Only these fields: clearing the whole fault would double the time of a step that only
       waits. */
    trouble.code = FAULT_NONE;
    trouble.line = by_hand ? 0 : current->line;
    trouble.block = current->number;
    trouble.column = 0;
    execute_result result = execute_step(&trouble);
    switch (result) {
    case EXECUTE_DONE: next_block(); break;
    case EXECUTE_END:
        if (!by_hand) {
            tape_finish();
            resume_end();
        }
        finish_block();
        break;
    case EXECUTE_FAULT: alarm_raise(&trouble); break;
    default: break;
    }
    return result != EXECUTE_WAIT;
}

bool program_step(void) {
    if (!output_has_room())
        return false;
    uint32_t began = hal_cycle_low();
    stage was = at;
    took = false;
    tape_step();
    switch (at) {
    case STAGE_READ: step_read(); break;
    case STAGE_PARSE: step_parse(); break;
    case STAGE_PLAN: step_plan(); break;
    case STAGE_ARC: step_arc(); break;
    case STAGE_COMPENSATE: step_compensate(); break;
    case STAGE_ANNOUNCE: step_announce(); return true;
    case STAGE_EXECUTE: return step_execute();
    }
    if (was == STAGE_READ && at == STAGE_READ && !took)
        return false;
    spent += hal_cycle_low() - began;
    if (judged) {
        judged = false;
        cost.total += spent;
        cost.worst = spent > cost.worst ? spent : cost.worst;
        spent = 0;
    }
    return true;
}
