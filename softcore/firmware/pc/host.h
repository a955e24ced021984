// SPDX-License-Identifier: Apache-2.0
/* The firmware as a library for a computer: functions that Python calls. The target has none of
   them. */
#pragma once
#include <stdint.h>

#include "hal/hal.h"

/* Checking a tape: reader, words and their meaning, without motion. */

/* The effect of a block of a checked tape. Distances in pulses, speeds in um/min. */
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
    uint32_t given;             /* retraction items in force after the block, a bit for each */
    int64_t items[6];           /* R L H E Q Z */
    uint64_t dwell;             /* clocks */
    uint32_t jump_period;       /* clocks */
    int32_t jump_distance;
    uint32_t jump_speed, jump_high;
    int32_t servo;              /* feed mode of G95 that begins; -1: G95 ends; 0: no change */
    int32_t arc;                /* 1 counter-clockwise, -1 clockwise, 0 for a line */
    int32_t plane, centre[2];   /* move_plane; from the start, 1/64 pulse */
    int32_t offset[3];          /* of the program frame, after the block */
    int32_t skipped;
    int32_t via[3];             /* a line that comes before the move */
} gk_record;

/* gk_check_line enters a line by hand before a check, such as the defaults of the retraction data,
   or a setting; returns 0, or -1 with one sentence in `message`. gk_check_machine sets the machine
   whose clock, scale and travel are used for the check, and forgets entered lines. gk_check_forget
   forgets both the machine and entered lines. */
void gk_check_forget(void);
void gk_check_machine(uint32_t clock_hz, uint32_t pulses_per_mm, uint32_t jump_axis,
                      uint32_t level_limit);
int gk_check_line(const char *line, char *message, uint32_t size);

/* Number of blocks of a tape without a fault; or -1, with one sentence in `message`. */
int gk_check(const uint8_t *tape, uint32_t length, char *message, uint32_t size);

/* The same, with the TV check and a record for each block, at most `count`. `place` gets the code,
   line and character of a fault. */
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

/* The motions of a tape without a fault, in order, with the wire offset. At most `count` are
   filled; returns their number, or -1 as above. */
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
void gk_level_limit(uint32_t level);     /* highest level of the current, 20 after gk_boot */
void host_gap_boot(void);       /* called by gk_boot, as the other host_..._boot */
void host_image_boot(void);
void host_flash_boot(void);
void host_wiring_boot(void);
void host_walk_boot(void);
bool host_gap_moved(int32_t position);  /* of the jump axis; true: the condition switches */
int32_t host_frame(unsigned axis);      /* machine frame less the count of gk_axis */
void host_gap_restart(int32_t position);    /* the deepest one is this */
void host_gap_arm(int32_t depth);       /* switch the condition at this depth */
void host_clock_boot(void);
void host_cost(uint32_t clocks);        /* let the clock advance for work of the firmware */
int32_t host_sleep(uint32_t clocks);    /* a sleep; returns how far the machine moves meanwhile */
void host_link_boot(void);
bool host_link_held(void);      /* a `!` or Ctrl-X holds the machine */
void gk_pulse_lasts(uint32_t lasts);    /* not 0: the pulse does not end, nothing switches */
void gk_pass(uint32_t passes);  /* passes of the main loop, each 1000 clocks */

/* The link and the gateware's receiver. Bytes come at once. Bytes that are not real-time bytes wait
   until the firmware takes them, in a queue of at most `depth` entries; the target's has 256. */
void gk_queue(uint32_t depth);
uint32_t gk_send(const uint8_t *bytes, uint32_t length);
void gk_send_broken(void);      /* a byte without its stop bit */
uint32_t gk_receive(uint8_t *bytes, uint32_t size);

/* Most path pulses that the model makes in a pass. At 0 it stands still; it then reports
   backpressure, unless gk_stuck is on. */
void gk_speed(uint32_t pulses);
void gk_stuck(uint32_t on);
/* Move along the path, forward or back, as far as it is loaded; returns the pulses made. */
int32_t gk_go(int32_t pulses);
/* Pulses that the machine makes before every write of a bound: it moves while the firmware
   calculates. */
void gk_creep(int32_t pulses);
void gk_stored(int32_t pulses); /* commanded and not yet made; negative on the way back */
void gk_state(uint32_t state);  /* hal_motion_state */
void gk_moving(uint32_t on);    /* pulses are still on their way */
void gk_lags(uint32_t on);      /* the axes are not yet in position */
void gk_shorted(uint32_t on);   /* Ss of the gap */
uint32_t gk_override(void);     /* of the feed << 8 | of rapids, percent */
uint32_t gk_pace_slot(void);    /* slot whose rate was changed last */
void gk_event(uint32_t kind, uint32_t detail, uint32_t first, uint32_t second);
void gk_trip(uint32_t cause, uint32_t axes);    /* with CAUSE_GUARD, `axes` is that of hal_damage */
void gk_arm(void);              /* the operator presses ARM */
void gk_live(uint32_t causes);  /* causes that keep the interlock from clearing */
void gk_switches(uint32_t low, uint32_t high);  /* limit switches that are pressed, by axis */
void gk_lose(uint32_t axis, int32_t pulses);    /* pulses that the axis does not make */
void gk_check_found(uint32_t axis, uint32_t check); /* the result of hal_axis_check */
void gk_index(uint32_t axes);       /* the index of these coders comes: an event of those armed */
uint32_t gk_index_armed(void);
void gk_axis_words(uint32_t axis, int32_t words[4]); /* soft limits, gain and lag, as written */
/* Mode, gear (steps, pulses) and backlash as written, how often the gear was written, and offset and
   friction of the drive. */
void gk_drive_words(uint32_t axis, uint32_t words[7]);
int32_t gk_pitch(uint32_t axis);    /* the pitch error as written, pulses */
/* The ramp as written: start rate and acceleration, those of the way back, and the lead. */
void gk_ramp_words(uint32_t words[5]);
void gk_fin(uint32_t passes);   /* passes until FIN; 0xffffffff for never */
int32_t gk_bound(uint32_t bound);
int32_t gk_position(void);
uint32_t gk_walk(void);         /* the walk as written, path pulses; 0xffffffff: not since boot */
void gk_drawn(int32_t pulses);  /* machining goes on so far before the front */
void gk_slot(uint32_t slot, gk_segment *segment);   /* as it was written */
int32_t gk_axis(uint32_t axis); /* commanded position */
/* Bit 0 run, 1 hold, 2 discharge, 3 retraction data valid, 4 safe, 5 held by `!` or Ctrl-X. */
uint32_t gk_flags(void);
void gk_data(uint32_t words[10]);   /* retraction data in force, then the jump period */
/* Values for the power supply that are in force: clocks, steps of voltage. */
typedef struct {
    uint32_t on, wait, off, rest, level, voltage, negative;   /* level: steps of the supply */
} gk_power;

/* Values written for the gap: references in 1/1024; presets dame, open, ok; counting mode, window
   and weight; criteria as in their setting; clocks; pulses. All but servo, period, convert,
   lag_time and those of the short (code, clocks) are those of the condition in force. */
typedef struct {
    uint32_t reference[3], presets[3], servo, period, step, convert, lag_time, counting[3], criteria,
        delay_least, short_mean, short_mean_time, short_current;
} gk_gap;

void gk_power_read(gk_power *words);
void gk_gap_read(gk_gap *words);
void gk_discharges(uint32_t count); /* count more pulses with a discharge */
void gk_opens(uint32_t count);      /* count more open pulses */
void gk_fluid(uint32_t flags);      /* of hal_fluid_state */
/* hal_feed_mode, with the first references after window, and the other words at the end. */
void gk_feed_mode_read(uint32_t words[14]);
void gk_mean(uint32_t level);       /* one more mean of the gap voltage was taken */
/* The oscilloscope: what was written, and what is read. Entries have 36 bits. */
#define GK_SCOPE 64
typedef struct {
    uint32_t depth, source, classes, level, after, recording, count, time;
    uint64_t entries[GK_SCOPE];
} gk_scope;

void gk_scope_read(gk_scope *words);
void gk_scope_write(const gk_scope *words);
void gk_watch(bool closed, bool asks); /* calls would be too early; its interrupt is pending */
uint32_t gk_answers(void);      /* answers to that interrupt since boot */
uint32_t gk_pets(void);         /* watchdog calls in the right order since boot */
uint32_t gk_sleeps(void);       /* times the processor went to sleep since boot */
/* The next `times` sleeps last their whole time, and the machine moves `pulses` in each. All later
   ones end at once. */
void gk_sleep_lasts(uint32_t times, int32_t pulses);
void gk_sleep_says(uint8_t byte);   /* a byte that comes over the link in the next sleep */
/* An event that the interrupt takes as the next sleep ends: it ends none early. */
void gk_sleep_meets(uint32_t kind, uint32_t detail);
/* Settings that guard the machine: whether low fluid trips; for each axis, the following errors at
   rest and in motion. */
void gk_guards(uint32_t words[7]);
/* A flash memory, which survives gk_boot: `order` gets `handle`, the clock, and 0 deselect, 1 select
   or 2 exchange a byte. Without one (0) a blank memory answers that forgets what is written. */
typedef uint8_t (*gk_flash_order)(void *handle, uint64_t clock, uint32_t order, uint8_t byte);
void gk_flash(gk_flash_order order, void *handle);
void gk_flash_region(uint32_t first, uint32_t sectors); /* sectors of 4096 bytes */
/* Words, at most 256, that take the place of the firmware in memory, and the digest for them. */
void gk_image(const uint32_t *words, uint32_t count, uint32_t digest);
/* The image that each gk_boot begins with, as the gateware brings it; ARM is held or not; has an image
   been started that the loader of the target would stop at? */
void gk_configured(const uint32_t *words, uint32_t count, uint32_t digest);
void gk_press_arm(uint32_t held);
uint32_t gk_hangs(void);
void gk_inputs(uint32_t levels, uint32_t voltage, uint32_t cell);   /* as hal_inputs */
uint32_t gk_words_read(void);   /* words of the memory that were read in order, from the first */
uint32_t gk_unwatched(void);    /* tasks that began before the watchdog's first key */

/* Edges of the control flow that were taken since the last call, and never before or never as
   often. */
uint32_t gk_coverage(void);

/* number + 1, which is undefined for the largest number: a sanitizer must notice it. */
int32_t gk_overflow(int32_t number);

/* Size of a gk_record in bytes, to check a second definition of its layout. */
uint32_t gk_record_size(void);

/* Single functions. */
int32_t gk_distance(uint64_t digits, uint32_t decimals, int inch, int32_t *pulses);
int32_t gk_speed_of(uint64_t digits, uint32_t decimals, int inch, uint32_t *um_per_min);
uint32_t gk_rate(uint32_t um_per_min);
uint32_t gk_speed_of_rate(uint32_t rate);
uint32_t gk_speed_of_count(uint32_t pulses, uint32_t clocks);
uint32_t gk_acceleration(uint32_t mm_per_s2);
uint32_t gk_lead(uint32_t percent, uint32_t per_s);
uint32_t gk_braking(uint32_t rate, uint32_t start_rate, uint32_t acceleration);
uint32_t gk_root(uint64_t square);

/* Arcs. Prepare an arc from its move: delta, 1 for counter-clockwise, plane (move_plane), centre.
   `numbers` gets pieces, length, radius and calls of arc_prepare; `directions` the tangents at its
   ends. */
void gk_arc(const int32_t delta[3], int32_t ccw, int32_t plane, const int32_t centre[2],
            uint32_t numbers[4], int32_t directions[2][3]);

/* A piece of the arc prepared last; returns the path pulses before it. */
uint32_t gk_arc_piece(uint32_t index, gk_segment *piece);
