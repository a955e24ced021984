// SPDX-License-Identifier: Apache-2.0
#include "app/events.h"

#include "app/homing.h"
#include "app/machine.h"
#include "app/resume.h"
#include "app/touch.h"
#include "base/alarm.h"
#include "base/text.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/gap.h"
#include "gap/in_force.h"
#include "interp/reader.h"
#include "link/output.h"
#include "path/path.h"

#define RING 16             /* gateware events; a power of two */
/* The interrupt handler takes events until this many wait in the ring. The gateware keeps the
   others and stops forward motion until the firmware takes them (backpressure). The bound also
   keeps interrupts from using up the watchdog's time. */
#define BUSY 8
#define NOTICES 64          /* a power of two, more than PATH_LEAD */
#define NOTICE_TEXT 72      /* most characters of a block's text that its event shows, and its end */
#define TEXTS 2048          /* bytes for the texts of all notices; a power of two */
#define OVERSHOOT_US 20000  /* every servo is at rest after this time */
/* A speed is reported only if it lasted this many pulses. Pulses are at least 4 clocks apart and
   counted in whole clocks, so the speed is then exact within 2 %. */
#define PLATEAU_PULSES 16
/* Letter of a detail; an unknown detail has the letter of "none". */
#define LETTER(letters, detail) (letters)[(detail) < sizeof(letters) - 1 ? (detail) : 0]

typedef struct {
    hal_event event;
    uint64_t cycle;
    int32_t first;          /* first start point of the short burst at that time */
} record;

typedef struct {
    uint32_t number, line, digest;
    uint32_t text;          /* where its text begins in `texts`, free-running */
} notice;

static record ring[RING];
static volatile uint32_t head; /* written by the interrupt handler only */
static uint32_t tail;
static volatile bool busy;      /* the interrupt is off */
static uint32_t worst;          /* see events_worst */
static notice notices[NOTICES];
static uint32_t notice_head, notice_tail;
static char texts[TEXTS];       /* texts follow each other; each is in one piece */
static uint32_t text_head;      /* where the next one may begin */
static uint32_t speed_high, speed_low, speed_jump_high;
static bool jumping;            /* the retraction under way is a jump */
static int32_t start_point;     /* where the retraction under way began */
static bool back_waits;         /* the end of a retraction, `back`, is still to be told */
static record back;
static bool blocks_wait;        /* blocks up to `entered` are still to be told, with `entry` */
static record entry;
static uint32_t entered;

void events_init(void) {
    busy = false;
    worst = 0;
    jumping = false;
    speed_high = speed_low = speed_jump_high = 0;
    events_drop();
}

void events_drop(void) {
    tail = head;
    notice_tail = notice_head;
    back_waits = blocks_wait = false;
}

uint32_t events_worst(void) { return worst; }

void events_speeds(uint32_t high, uint32_t low, uint32_t jump_high) {
    speed_high = high;
    speed_low = low;
    speed_jump_high = jump_high;
}

void events_interrupt(void) {
    while (head - tail < BUSY && hal_event_pop(&ring[head % RING].event)) {
        record *r = &ring[head % RING];
        uint64_t now = hal_cycle();
        uint32_t age = (uint32_t)now - r->event.cycle_low;
        r->cycle = now - age;
        /* Not of a retraction's start: its stamp is the short's, and the machine stops in
           between. */
        if (r->event.kind != EVENT_RETRACTION_START && age > worst)
            worst = age;
        r->first = hal_first();
        head++;
    }
    if (head - tail == BUSY) {
        busy = true;
        hal_interrupts(false);
    }
}

/* The longest text may have to leave the end of `texts` empty. */
bool events_notice_room(void) {
    return notice_head == notice_tail ||
           (notice_head - notice_tail < NOTICES &&
            text_head - notices[notice_tail % NOTICES].text <= TEXTS - 2 * NOTICE_TEXT);
}

void events_notice(uint32_t number, uint32_t line_number, const char *text, uint32_t length) {
    notice *n = &notices[notice_head++ % NOTICES];
    n->number = number;
    n->line = line_number;
    n->digest = resume_digest(line_number);
    uint32_t left = TEXTS - text_head % TEXTS;
    if (left < NOTICE_TEXT)
        text_head += left;
    n->text = text_head;
    char *to = &texts[text_head % TEXTS];
    unsigned at = 0;
    for (uint32_t i = 0; i < length && at < NOTICE_TEXT - 1; i++)
        if (text[i] != READER_DELETED)
            to[at++] = text[i];
    to[at++] = '\0';
    text_head += at;
}

static void tell_notice(uint64_t cycle, const int32_t *position) {
    notice *n = &notices[notice_tail++ % NOTICES];
    alarm_set_line(n->line);
    if (!(n->line & ALARM_BY_HAND)) {
        resume_at(n->line, n->digest, n->number);
        output_block(cycle, n->line, position, &texts[n->text % TEXTS]);
    }
}

static void here(int32_t position[HAL_AXES]) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        position[axis] = hal_axis_position(axis);
}

bool events_tell_notice(void) {
    if (notice_head == notice_tail)
        return false;
    int32_t position[HAL_AXES];
    here(position);
    tell_notice(hal_cycle(), position);
    return true;
}

void events_now(const char *name, const char *format, ...) {
    int32_t position[HAL_AXES];
    here(position);
    va_list arguments;
    va_start(arguments, format);
    output_vevent(name, hal_cycle(), alarm_line(), position, format, arguments);
    va_end(arguments);
}

__attribute__((noinline)) static void tell_back(void) {
    uint8_t detail = back.event.detail;
    /* The gateware names every back limit PATH_START. It is a real start only if neither the
       ceiling nor the soft limit sets the back limit. */
    if (detail == EVENT_REASON_PATH_START && path_has_back_limit())
        detail = EVENT_REASON_LIMIT;
    int32_t from = jumping ? start_point : back.first;
    uint32_t overshoot = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        uint32_t travel = hal_axis_overshoot(axis);
        overshoot = travel > overshoot ? travel : overshoot;
    }
    char speed[TEXT_NUMBER] = "-";
    if (back.event.first >= PLATEAU_PULSES)
        text_print(speed, sizeof speed, "%u",
                   units_speed_of_count(back.event.first, back.event.second));
    output_event(EVENT_WORD_RETRACTION_END, back.cycle, alarm_line(), back.event.encoder,
                 EVENT_FORMAT_RETRACTION_END, LETTER(EVENT_REASONS, detail), (int32_t)((uint32_t)from - (uint32_t)back.event.path), speed, overshoot);
    back_waits = false;
}

__attribute__((noinline)) static void tell_start(const record *r) {
    uint8_t detail = r->event.detail;
    jumping = detail != EVENT_CAUSE_SHORT;
    start_point = r->event.path;
    output_event(EVENT_WORD_RETRACTION_START, r->cycle, alarm_line(), r->event.encoder,
                 EVENT_FORMAT_RETRACTION_START, LETTER(EVENT_CAUSES, detail),
                 units_speed_of_rate(r->event.second), r->event.first);
}

__attribute__((noinline)) static void tell_readvance(const record *r) {
    bool high = r->event.detail == EVENT_PHASE_HIGH;
    uint32_t speed = !high ? speed_low : jumping && speed_jump_high ? speed_jump_high : speed_high;
    output_event(EVENT_WORD_READVANCE, r->cycle, alarm_line(), r->event.encoder,
                 EVENT_FORMAT_READVANCE, LETTER(EVENT_PHASES, r->event.detail), r->event.first, r->event.second, speed);
}

__attribute__((noinline)) static void tell_fluid(const record *r) {
    if (!gap_fluid(&r->event))
        return;
    gap_class c = in_force_class(in_force_fluid());
    output_event(EVENT_WORD_FLUID_CLASS, r->cycle, alarm_line(), r->event.encoder,
                 EVENT_FORMAT_FLUID_CLASS,
                 (uint32_t)in_force_fluid(), HAL_FLUID_MEASURED(r->event.first), r->event.second,
                 (uint32_t)c.dame, (uint32_t)c.open, (uint32_t)c.ok);
}

/* The gateware has switched to the condition of a depth. The event gives the place of the
   switch. */
__attribute__((noinline)) static void tell_condition(const record *r) {
    const depth_step *step = depth_series_switched();
    if (!step)
        return;
    unsigned axis = hal_jump_axis();
    int32_t position[HAL_AXES];
    for (unsigned i = 0; i < HAL_AXES; i++)
        position[i] = i == axis ? (int32_t)r->event.first : r->event.encoder[i];
    output_event(EVENT_WORD_CONDITION, r->cycle, alarm_line(), position,
                 EVENT_FORMAT_CONDITION_FULL, step->row.number,
                 (uint32_t)step->row.milli_ip, step->depth - output_origin(axis));
}

static bool block_waits(void) {
    return notice_head != notice_tail &&
           (int32_t)(notices[notice_tail % NOTICES].number - entered) <= 0;
}

/* One block in each pass: many blocks without motion may precede the segment. */
static void tell_block(void) {
    if (block_waits())
        tell_notice(entry.cycle, entry.event.encoder);
    blocks_wait = block_waits();
}

static void tell(const record *r) {
    switch (r->event.kind) {
    case EVENT_RETRACTION_START: tell_start(r); break;
    case EVENT_RETRACTION_END:
        back = *r;
        back_waits = true;
        break;
    case EVENT_READVANCE: tell_readvance(r); break;
    case EVENT_RESUME:
        output_event(EVENT_WORD_RESUME, r->cycle, alarm_line(), r->event.encoder, "");
        break;
    case EVENT_HALT:
        if (!touch_takes(&r->event))
            machine_halted(r->event.detail, r->cycle, r->event.encoder);
        break;
    case EVENT_SEGMENT:
        entry = *r;
        entered = path_entered_slot(r->event.slot);
        tell_block();
        break;
    case EVENT_FLUID_CLASS: tell_fluid(r); break;
    case EVENT_CONDITION: tell_condition(r); break;
    case EVENT_TRIP:
        if (!homing_takes(r->event.detail, r->event.first, r->event.encoder))
            machine_tripped(r->event.detail, r->event.first, r->cycle, r->event.encoder);
        break;
    case EVENT_INDEX: homing_indexed(r->event.first, r->event.encoder); break;
    default: break;
    }
}

bool events_step(void) {
    if (hal_event_lost()) {
        machine_events_lost();
        return true;
    }
    if (busy && head - tail <= BUSY / 2) {
        busy = false;
        hal_interrupts(true);
    }
    if (alarm_untold()) {
        /* Tell first what happened before the alarm. */
        if (blocks_wait)
            tell_block();
        else if (back_waits)
            tell_back();
        else
            machine_tell_alarm();
        return true;
    }
    if (!output_has_room())
        return false;
    if (blocks_wait) {
        tell_block();
        return true;
    }
    if (back_waits) {
        uint32_t age = (uint32_t)(hal_cycle() - back.cycle);
        bool due = head != tail || age > units_clocks_of_us(OVERSHOOT_US);
        if (due)
            tell_back();
        return due;
    }
    if (head != tail) {
        /* The handler cannot overwrite the record meanwhile: it takes no more than BUSY events. */
        tell(&ring[tail++ % RING]);
        return true;
    }
    /* The machine has passed blocks without an event of the gateware. */
    uint32_t reached = path_reached();
    if (notice_head != notice_tail && head == tail &&
        (int32_t)(notices[notice_tail % NOTICES].number - reached) < 0) {
        int32_t position[HAL_AXES];
        here(position);
        tell_notice(hal_cycle(), position);
        return true;
    }
    return false;
}

bool events_idle(void) { return head == tail && !back_waits && !blocks_wait; }
