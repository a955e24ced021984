// SPDX-License-Identifier: Apache-2.0
/* The only way from the firmware to the gateware. `hal_regs.c` implements it with the registers of
   `regs.h`; on the host a model of the machine takes its place, so that everything above it is
   tested there. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/event_kinds.h"

#define HAL_AXES 3
#define HAL_SLOTS 64        /* segments in the gateware's window */
#define HAL_NO_AXIS 15      /* jump axis of a machine without one (wire) */

/* What the gateware knows about itself. */
bool hal_is_gapkeeper(void);

/* The firmware as it was loaded: its words in memory, and the digest that they had then. */
typedef struct {
    const volatile uint32_t *words;
    uint32_t count, digest;
} hal_image;

hal_image hal_image_read(void);
uint32_t hal_clock_hz(void);
uint32_t hal_pulses_per_mm(void);
unsigned hal_jump_axis(void);
uint64_t hal_cycle(void);       /* clocks since reset */
uint32_t hal_cycle_low(void);   /* lower half, for short intervals */
void hal_sleep(uint32_t clocks); /* until an event or a byte, at the longest for so long */

/* Link. */
#define HAL_MARK 0x100u
int hal_receive(void);          /* next byte, or HAL_MARK and a MARK of regs.h; -1 for nothing */

#define NOTE_STATUS 1u
#define NOTE_HOLD 2u
#define NOTE_RESUME 4u
#define NOTE_RETRACT 8u
#define NOTE_STOP 16u
uint32_t hal_notes(void);       /* real-time bytes that have come since it was asked last, by bit */

/* The feed may go on after a `!`; the reset of a Ctrl-X has been carried out. */
void hal_release_hold(void);
void hal_release_reset(void);

/* Overrides as their real-time bytes have set them, percent; and back to 100. */
typedef struct {
    uint8_t feed, rapid;
} hal_overrides;

hal_overrides hal_overrides_read(void);
void hal_release_override(void);
uint32_t hal_waiting(void);     /* entries in the receive queue */
bool hal_transmit_ready(void);
void hal_transmit(uint8_t byte);

/* Path window; see the block `path` of the register reference. */
typedef struct {
    uint32_t pace;              /* of the major axis; see rtl.motion.arc */
    int32_t error, along, across;
} hal_arc_state;

typedef struct {
    uint32_t length;            /* path pulses */
    uint32_t rate;              /* 2**-32 pulse/clock */
    uint32_t highest;           /* either way; 0 for no bound */
    int32_t delta[HAL_AXES];    /* pulses */
    bool arc, outward;          /* a piece of an arc; its minor axis leads away from the centre */
    bool away;                  /* a line: with the discharge off it leads away from the work */
    uint8_t major, minor, shift;
    int32_t change;             /* of the pace, each pulse */
    hal_arc_state start, end;
} hal_segment;

typedef enum {
    BOUND_AHEAD, BOUND_BEHIND, BOUND_BACK_LIMIT, BOUND_FAST_AHEAD, BOUND_FAST_BEHIND, BOUNDS
} hal_bound;

typedef enum {
    MOTION_FRONT, MOTION_STOPPING, MOTION_RETRACTING, MOTION_AT_LIMIT, MOTION_HIGH, MOTION_LOW,
    MOTION_HALTED
} hal_motion_state;

typedef struct {
    bool moving;
    bool in_position;
    bool backpressure;           /* events wait to be taken, and forward motion for that */
    hal_motion_state state;
} hal_motion;

void hal_slot_write(unsigned slot, const hal_segment *segment);
/* Another rate for the segment of `length` in a slot; in force at once, if the machine is in it. */
void hal_slot_pace(unsigned slot, uint32_t length, uint32_t rate);
void hal_bound_write(hal_bound bound, int32_t coordinate);
void hal_fast_slot(unsigned slot);  /* the fast bounds are those seen from this slot */
void hal_origin(unsigned slot);
int32_t hal_command(void);      /* path coordinate of the last pulse Ps */
int32_t hal_position(void);     /* path coordinate of the last ramped pulse */
int32_t hal_front(void);        /* furthest path coordinate commanded */
unsigned hal_slot(void);        /* slot of the segment in which the machine is */
hal_motion hal_motion_read(void);
void hal_ramp(uint32_t start_rate, uint32_t acceleration);

/* Retraction. */
typedef struct {
    uint32_t rate, limit, high_rate, low_rate, changeover, low_lead;
    uint32_t jump_distance, jump_rate, jump_high_rate;
    bool valid;
} hal_retraction;

void hal_retraction_commit(const hal_retraction *data);
void hal_jump_period(uint32_t clocks);
void hal_short_burst(uint32_t gain, uint32_t repeats, uint32_t settle);
void hal_control(bool run, bool hold);
void hal_retract(void);         /* operator's order: retract now */
int32_t hal_first(void);        /* first start point of the series, path coordinate */
uint32_t hal_shorts(void);      /* shorts in the series */

/* Event queue. */
typedef struct {
    uint8_t kind, detail, slot; /* hal_event_kind */
    uint32_t cycle_low;
    int32_t path;
    uint32_t first, second;
    int32_t encoder[HAL_AXES];
} hal_event;

bool hal_event_pop(hal_event *event);   /* false: queue empty */
bool hal_event_lost(void);              /* an event found the queue full; reading clears it */
void hal_interrupts(bool events); /* the watchdog's are on from the first time on */

/* Gap and power. */
typedef struct {
    uint32_t needed, window, duration, clear, blanking; /* pulses, pulses, clocks, samples, clocks */
} hal_short_detector;

typedef struct {
    uint32_t settle, confirm, delay_least;              /* clocks */
    bool current, delay, noise;                         /* criteria */
} hal_discriminator;

void hal_short_write(const hal_short_detector *detector);
void hal_lag_time(uint32_t clocks);                     /* of the axes behind the ramp */
void hal_gap_counts(uint32_t counts[4]);                /* open, ok, dame, short */
bool hal_shorted(void);                                 /* Ss, as the last pulses have left it */
void hal_discriminate(const hal_discriminator *rules);
/* Clocks on, off, and more off after an abnormal pulse; current in steps of the supply. */
void hal_pulse(uint32_t on, uint32_t off, uint32_t rest, uint32_t level);
uint32_t hal_level_limit(void);                             /* highest that the gateware lets through */
void hal_supply(uint32_t voltage, bool negative);           /* steps of the supply */
void hal_references(uint32_t open, uint32_t arc, uint32_t shorted); /* 1/1024 of full scale */
void hal_sense(uint32_t on, uint32_t off);                  /* clocks */
void hal_discharge(bool machining);

/* Servo. */
void hal_servo(bool on, uint32_t mode, uint32_t window, uint32_t weight);
void hal_servo_period(uint32_t clocks);
void hal_servo_step(uint32_t pulses);
void hal_presets(uint32_t dame, uint32_t open, uint32_t ok); /* pulses */

/* Feed by the mean voltage. Levels are 2**-16 of the converter's full scale. */
typedef struct {
    uint32_t mode;                          /* 0 constant, else the number after G95 P less one */
    uint32_t measure;
    uint32_t unit, window;                  /* path pulses, clocks */
    uint32_t least;                         /* level: lowest Ex */
    uint32_t lowest, highest;               /* bounds of Es/Ex, 1/4096 */
    uint32_t gain;                          /* 2**-32 pulse/clock per 1/16 of full scale */
    uint32_t fastest;                       /* 2**-32 pulse/clock */
} hal_feed_mode;

typedef struct {
    uint32_t mean;                          /* level */
    uint8_t windows;                        /* means taken, wraps */
    bool known;
} hal_feed_mode_state;

void hal_feed_mode_write(const hal_feed_mode *words);
void hal_feed_mode_references(uint32_t no_load, uint32_t voltage, uint32_t drop); /* levels: Vs, Es */
hal_feed_mode_state hal_feed_mode_read(void);

/* The condition. What hal_pulse, hal_supply, hal_references, hal_presets, hal_servo_step and
   hal_feed_mode_references are told is staged, and comes into force together, between two pulses. None of
   it may be called while that is pending. */
void hal_condition_commit(void);            /* as soon as the pulse under way is over; disarms */
void hal_condition_arm(int32_t depth);      /* when the jump axis is at a depth (pulses) or has been */
void hal_condition_disarm(void);
void hal_condition_restart(void);           /* it has been where it is, and no deeper */
bool hal_condition_pending(void);
uint8_t hal_condition_count(void);          /* switches by depth since reset, wraps */

/* Fluid. Codes of the cell. */
#define HAL_FLUID_LOW 1u        /* flags of EVENT_FLUID_CLASS, in `first`; `second` is the level */
#define HAL_FLUID_HIGH 2u
#define HAL_FLUID_DISORDERED 4u
#define HAL_FLUID_SILENT 8u
#define HAL_FLUID_KNOWN 16u     /* of hal_fluid_state only: there is an average, */
#define HAL_FLUID_CLASS(state) ((state) >> 8 & 3u)      /* and the class in force */
#define HAL_FLUID_MEASURED(first) ((first) >> 4 & 3u)   /* class; another may be in force by hand */

typedef struct {
    bool convert, manual;
    uint32_t manual_class, threshold[3], hysteresis, lowest, highest;
} hal_fluid;

void hal_fluid_write(const hal_fluid *detector);
uint32_t hal_fluid_state(void); /* the flags as they are now */

/* Safety. */
typedef struct {
    uint8_t low, high;      /* limit switches that are pressed, bit 0 X */
    bool leaving;           /* they are just being left */
} hal_limits;

/* What the cause `guard` has found: axes whose positions do not belong together, bit 0 X, and */
#define HAL_DAMAGE_AXES 7u
#define HAL_DAMAGE_WORD 8u      /* a word of the path window */
#define HAL_DAMAGE_SEGMENT 16u  /* the segment at work */
#define HAL_DAMAGE_PLACE 32u    /* the place on the path */
#define HAL_DAMAGE_PULSES 64u   /* path pulses on their way */
#define HAL_DAMAGE_BOUNDS(damage) ((damage) >> 7 & 7u) /* axes: a soft limit, a bound of the error, the gain */
#define HAL_DAMAGE_FLUID 1024u  /* whether low fluid trips */
#define HAL_DAMAGE_RATE 2048u   /* the rate of the ramp */
#define HAL_DAMAGE_LATCH 4096u  /* the latch of the interlock */

void hal_pet(uint8_t key);
bool hal_watch_open(void);      /* a call of the watchdog is not too soon */
bool hal_watch_asked(void);     /* the watchdog's interrupt is to be answered */
bool hal_safe(void);
unsigned hal_first_cause(void);
uint32_t hal_causes(void);      /* those latched, by bit */
unsigned hal_blamed(void);      /* axes that raised it, bit 0 X */
hal_limits hal_limits_read(void);
void hal_leave(void);           /* excuse the limit switches that are pressed, while safe */
uint32_t hal_damage(void);
void hal_interlock_clear(void);
void hal_interlock_trip(void);
void hal_fluid_required(bool required);
bool hal_armed(void);           /* a hand at the machine has allowed the discharge */
void hal_disarm(void);          /* it has to do so anew */

/* Machine side. */
typedef enum { AUXILIARY_M, AUXILIARY_S, AUXILIARY_T } hal_letter;
void hal_auxiliary_send(hal_letter letter, uint32_t code);
void hal_auxiliary_timeout(uint32_t clocks);
bool hal_auxiliary_busy(void);
bool hal_auxiliary_timed_out(void);     /* reading clears it */

/* Axes. */
int32_t hal_axis_command(unsigned axis);
int32_t hal_axis_position(unsigned axis);
int32_t hal_axis_error(unsigned axis);
uint32_t hal_axis_overshoot(unsigned axis);
void hal_axis_errors(unsigned axis, uint32_t stopped, uint32_t moving, uint32_t window);
void hal_axis_mode(unsigned axis, bool step, bool reverse);
void hal_axis_step_time(unsigned axis, uint32_t width, uint32_t space, uint32_t setup);
void hal_axis_adopt(unsigned axis);
void hal_axis_limits(unsigned axis, int32_t low, int32_t high); /* soft limits, pulses */
void hal_axis_gain(unsigned axis, uint32_t gain);   /* of the loop, 2**-20 pulse/tick per pulse */

typedef enum {
    CHECK_NONE, CHECK_MODEL, CHECK_SILENT, CHECK_PHASE_A, CHECK_PHASE_B, CHECK_AGAINST, CHECK_SHARE,
    CHECK_RATE, CHECKS
} hal_check;    /* what the supervision of a coder has found; see rtl.motion.supervision */

hal_check hal_axis_check(unsigned axis);
bool hal_axis_beyond(unsigned axis, bool high);     /* a pulse beyond a soft limit was refused */
