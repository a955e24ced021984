// SPDX-License-Identifier: Apache-2.0
/* The firmware as a library of a computer: what Python calls. None of it is on the target. */
#pragma once
#include <stdint.h>

#include "hal/hal.h"

/* Checking a tape: the reader, the words and their meaning, without any motion. */

/* What a block of a checked tape would do. Distances in pulses, speeds in um/min. */
typedef struct {
    uint32_t line;
    int32_t moves, delta[3];
    uint32_t speed;
    int32_t act;                /* plan_act */
    int32_t stop;               /* plan_stop */
    int32_t machining;          /* 1 on, -1 off, 0 as it was */
    int32_t condition;          /* number, 0 for none */
    int32_t s, t, m[6];         /* codes for the machine side, -1 for none */
    int32_t fluid_off;
    uint32_t given;             /* retraction items in force after the block, by bit */
    int64_t items[6];           /* R L H E Q Z */
    uint64_t dwell;             /* clocks */
    uint32_t jump_period;       /* clocks */
    int32_t jump_distance;
    uint32_t jump_speed, jump_high;
    int32_t servo;              /* the motion begins to be under a law of G95, its number, or ends (-1) */
    int32_t arc;                /* 1 counter-clockwise, -1 clockwise, 0 for a line */
    int32_t plane, centre[2];   /* move_plane; from the start, 1/64 pulse */
    int32_t offset[3];          /* of the program frame, after the block */
    int32_t skipped;
    int32_t via[3];             /* first, in a line of its own */
} gk_record;

/* Enter a line by hand before a check, such as the defaults of the retraction data, or a setting. 0, or -1 with one
   sentence in `message`. gk_check_forget takes back what was entered, and the machine; gk_check_machine
   says of which machine clock, scale and travel are to be judged, and takes back what was entered. */
void gk_check_forget(void);
void gk_check_machine(uint32_t clock_hz, uint32_t pulses_per_mm, uint32_t jump_axis);
int gk_check_line(const char *line, char *message, uint32_t size);

/* Blocks of a tape that has no fault; or -1, with one sentence in `message`. */
int gk_check(const uint8_t *tape, uint32_t length, char *message, uint32_t size);

/* The same, with the TV check and what each block means: `count` records are filled at most. Of a
   fault, its code, line and character are written to `place`. */
int gk_check_records(const uint8_t *tape, uint32_t length, int tv, gk_record *records,
                     uint32_t count, uint32_t place[3], char *message, uint32_t size);

/* A segment as the gateware gets it: the words of its slot. */
typedef struct {
    uint32_t length, rate, highest;
    int32_t delta[3];
    uint32_t arc, outward, away, major, minor, shift;
    int32_t change;
    uint32_t start_pace;
    int32_t start_error, start_along, start_across;
    uint32_t end_pace;
    int32_t end_error, end_along, end_across;
} gk_segment;

void gk_words(const hal_segment *segment, gk_segment *words);
/* The motions that a tape without a fault makes, in order, with the wire offset; `count` are filled at
   most, and their number returned. -1 as above. */
typedef struct {
    uint32_t line;
    int32_t delta[3];           /* pulses */
    int32_t arc, plane, centre[2];  /* as in gk_record */
    uint32_t speed;
} gk_motion;

int gk_check_motions(const uint8_t *tape, uint32_t length, gk_motion *motions, uint32_t count,
                     uint32_t place[3], char *message, uint32_t size);

/* The whole firmware on a model of the machine (`hal_host.c`). */
void gk_boot(uint32_t clock_hz, uint32_t pulses_per_mm, uint32_t jump_axis);
void host_gap_boot(void);    /* their parts of that */
void host_image_boot(void);
bool host_gap_moved(int32_t position);  /* of the jump axis; true: the condition is switched by depth */
void host_gap_arm(int32_t depth);    /* the condition is to be switched there */
void host_clock_boot(void);
void host_cost(uint32_t clocks);    /* the firmware does something that takes its time */
int32_t host_sleep(uint32_t clocks);    /* a sleep; returns how far the machine goes meanwhile */
void host_link_boot(void);
bool host_link_held(void);   /* a `!` or Ctrl-X lets nothing go forward */
/* A pulse goes on for so long as this is not 0: what is staged is not taken over. */
void gk_pulse_lasts(uint32_t lasts);
void gk_pass(uint32_t passes);  /* passes of the main loop, each 1000 clocks */

/* The line, and the gateware that takes it: bytes come at once, and what is no real-time byte waits in
   a queue of `depth` entries at most, 256 on the target, until the firmware takes it. */
void gk_queue(uint32_t depth);
uint32_t gk_send(const uint8_t *bytes, uint32_t length);
void gk_send_broken(void);      /* a byte without its stop bit */
uint32_t gk_receive(uint8_t *bytes, uint32_t size);

/* How the model moves by itself: path pulses per pass at most. At 0 it stands still, and says that
   events wait: unless it is stuck. */
void gk_speed(uint32_t pulses);
void gk_stuck(uint32_t on);
/* Move along the path, forward or back, as far as it is loaded; returns the pulses made. */
int32_t gk_go(int32_t pulses);
/* Pulses that the machine makes before every write of the bounds of what is loaded: it moves while the
   firmware looks. */
void gk_creep(int32_t pulses);
void gk_stored(int32_t pulses); /* commanded and not yet made; below zero on the way back */
void gk_state(uint32_t state);  /* hal_motion_state */
void gk_moving(uint32_t on);    /* pulses are still on their way, */
void gk_lags(uint32_t on);      /* and the axes not yet in position */
void gk_shorted(uint32_t on);   /* the gap, Ss */
uint32_t gk_override(void);     /* of the feed << 8 | of rapids, percent */
uint32_t gk_pace_slot(void);    /* slot whose rate was changed last */
void gk_event(uint32_t kind, uint32_t detail, uint32_t first, uint32_t second);
void gk_trip(uint32_t cause, uint32_t axes);    /* of CAUSE_GUARD: what hal_damage says */
void gk_arm(void);              /* a hand presses the button */
void gk_live(uint32_t causes);  /* causes that keep the interlock from clearing */
void gk_switches(uint32_t low, uint32_t high);  /* limit switches that are pressed, by axis */
void gk_lose(uint32_t axis, int32_t pulses);    /* pulses that the axis has not made */
void gk_check_found(uint32_t axis, uint32_t check); /* what hal_axis_check says */
void gk_axis_words(uint32_t axis, int32_t words[3]); /* soft limits and gain, as written */
void gk_fin(uint32_t passes);   /* passes until FIN; 0xffffffff for never */
int32_t gk_bound(uint32_t bound);
int32_t gk_position(void);
void gk_slot(uint32_t slot, gk_segment *segment);   /* as it was written */
int32_t gk_axis(uint32_t axis); /* commanded position */
/* Bit 0 run, 1 hold, 2 discharge, 3 retraction data valid, 4 safe, 5 held by `!` or Ctrl-X. */
uint32_t gk_flags(void);
void gk_data(uint32_t words[10]);   /* retraction data in force, then the jump period */
/* What the power supply was told, as is in force: clocks, steps of voltage. */
typedef struct {
    uint32_t on, off, rest, level, voltage, negative;   /* level: steps of the supply */
} gk_power;

/* What the gap was told: references in 1/1024, presets dame, open, ok; clocks; pulses. */
typedef struct {
    uint32_t reference[3], presets[3], servo, mode, period, step, convert, lag_time;
} gk_gap;

void gk_power_read(gk_power *words);
void gk_gap_read(gk_gap *words);
void gk_discharges(uint32_t count); /* so many more have been seen, */
void gk_opens(uint32_t count);      /* and pulses without one */
void gk_fluid(uint32_t flags);      /* of hal_fluid_state */
void gk_feed_mode_read(uint32_t words[12]);   /* a hal_feed_mode, with the references behind its window */
void gk_mean(uint32_t level);       /* one more mean of the gap voltage was taken */
void gk_watch(bool closed, bool asks); /* the watchdog takes no call yet; asks for its interrupt */
uint32_t gk_answers(void);      /* to that interrupt since boot */
uint32_t gk_pets(void);         /* watchdog calls in the right order since boot */
uint32_t gk_sleeps(void);       /* times the processor went to sleep since boot */
/* Nothing ends the next sleeps, so many of them, and the machine goes so far in each; all behind them
   end at once. */
void gk_sleep_lasts(uint32_t times, int32_t pulses);
void gk_sleep_says(uint8_t byte);   /* comes over the link in the next sleep */
/* What guards the machine: low fluid trips; of each axis, following errors at rest and in motion. */
void gk_guards(uint32_t words[7]);
/* What stands for the firmware in memory, at most 256 words, and the digest that it must have. */
void gk_image(const uint32_t *words, uint32_t count, uint32_t digest);
uint32_t gk_unwatched(void);    /* tasks that began before the watchdog's first key */

/* Edges of the control flow taken since the last call and never before, or never as often. */
uint32_t gk_coverage(void);

/* One more than a number: undefined for the largest, which a sanitizer has to notice. */
int32_t gk_overflow(int32_t number);

/* Bytes of a gk_record, for whoever writes its layout down once more. */
uint32_t gk_record_size(void);

/* Single functions. */
int32_t gk_distance(uint64_t digits, uint32_t decimals, int inch, int32_t *pulses);
int32_t gk_speed_of(uint64_t digits, uint32_t decimals, int inch, uint32_t *um_per_min);
uint32_t gk_rate(uint32_t um_per_min);
uint32_t gk_speed_of_rate(uint32_t rate);
uint32_t gk_speed_of_count(uint32_t pulses, uint32_t clocks);
uint32_t gk_acceleration(uint32_t mm_per_s2);
uint32_t gk_braking(uint32_t rate, uint32_t start_rate, uint32_t acceleration);
uint32_t gk_root(uint64_t square);

/* Arcs. Prepare one, from its move: delta, 1 for counter-clockwise, plane (move_plane), centre. The
   numbers that describe it: pieces, length, radius, calls of arc_prepare; tangents at its ends. */
void gk_arc(const int32_t delta[3], int32_t ccw, int32_t plane, const int32_t centre[2],
            uint32_t numbers[4], int32_t directions[2][3]);

/* A piece of the arc prepared last; returns the path pulses before it. */
uint32_t gk_arc_piece(uint32_t index, gk_segment *piece);
