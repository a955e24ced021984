// SPDX-License-Identifier: Apache-2.0
/* The firmware's only interface to the gateware. `hal_regs.c` implements it with the registers of
   `regs.h`. On a computer, a model of the machine implements it, so that all firmware above it can
   be tested there. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/event_kinds.h"
#include "hal/states.h"

#define HAL_AXES 3
#define HAL_SLOTS 64        /* segments in the gateware's window */
#define HAL_NO_AXIS 15      /* jump axis of a machine without one (wire) */

/* The gateware, clock and processor. */
bool hal_is_gapkeeper(void);    /* the gateware identifies itself as Gapkeeper's */

/* The firmware in memory, and the digest that it had when it was built. */
typedef struct {
    const volatile uint32_t *words;
    uint32_t count, digest;
} hal_image;

hal_image hal_image_read(void);

/* Firmware that was started from the flash memory: its digest, that of the firmware which the
   gateware was loaded with, its slot, and whether it has been confirmed. No digest of the firmware in
   memory: it is the one that the gateware was loaded with. */
typedef struct {
    uint32_t digest, base, slot, confirmed;
} hal_started;

hal_started hal_started_read(void);
/* Note this and start the image of `count` words, which are the next bytes of the flash memory. Does
   not come back on the target; if the image has another digest, all stands still there. */
void hal_image_start(const hal_started *note, uint32_t count);
uint32_t hal_clock_hz(void);
uint32_t hal_build(void);       /* digest of the gateware's sources; 0 in a simulation */
uint32_t hal_pulses_per_mm(void);
unsigned hal_jump_axis(void);
uint64_t hal_cycle(void);       /* clocks since reset */
uint32_t hal_cycle_low(void);   /* lower half, for short intervals */
void hal_sleep(uint32_t clocks); /* until an event or a byte comes, but no longer than this */

/* Link. */
#define HAL_MARK 0x100u
int hal_receive(void);          /* next byte, or HAL_MARK and a MARK of regs.h; -1 for nothing */

#define NOTE_STATUS 1u
#define NOTE_HOLD 2u
#define NOTE_RESUME 4u
#define NOTE_RETRACT 8u
#define NOTE_STOP 16u
#define NOTE_CANCEL 32u
uint32_t hal_notes(void);       /* real-time bytes since the last call, as bits NOTE_ */

void hal_release_hold(void);    /* end the hold that a `!` began */
void hal_release_reset(void);   /* the reset of a Ctrl-X has been carried out */

/* Overrides as set by their real-time bytes, percent; hal_release_override sets them to 100. */
typedef struct {
    uint8_t feed, rapid;
} hal_overrides;

hal_overrides hal_overrides_read(void);
void hal_release_override(void);
uint32_t hal_waiting(void);     /* entries in the receive queue */
bool hal_transmit_ready(void);
void hal_transmit(uint8_t byte);

/* Serial flash memory: exchange a byte, in which the processor waits for some 20 clocks (70 on a
   board). Its region for the journal, and that of each of the two firmware slots behind it, in
   sectors of 4096 bytes. */
typedef struct {
    uint32_t first, sectors;    /* sectors 0: there is none */
    uint32_t slot;              /* 0: there are none */
} hal_flash_region;

hal_flash_region hal_flash_region_read(void);
void hal_flash_select(bool on);
uint8_t hal_flash_exchange(uint8_t byte);

/* Path window; see the block `path` of the register reference. */
typedef struct {
    uint32_t pace;              /* of the major axis; see rtl.motion.arc */
    int32_t error, along, across;
} hal_arc_state;

typedef struct {
    uint32_t length;            /* path pulses */
    uint32_t rate;              /* 2**-32 pulse/clock */
    uint32_t highest;           /* highest rate in both directions; 0 for no bound */
    int32_t delta[HAL_AXES];    /* pulses */
    bool arc, outward;          /* a piece of an arc; its minor axis leads away from the centre */
    bool away;                  /* a line: with the discharge off it leads away from the work */
    uint8_t major, minor, shift;
    int32_t change;             /* of the pace with each pulse */
    hal_arc_state start, end;
} hal_segment;

typedef enum {
    BOUND_AHEAD, BOUND_BEHIND, BOUND_BACK_LIMIT, BOUND_FAST_AHEAD, BOUND_FAST_BEHIND,
    BOUND_FAST_AHEAD_RATE, BOUND_FAST_BEHIND_RATE, /* 2**-28 pulse/clock, 0 for none */
    BOUNDS
} hal_bound;

typedef struct {
    bool moving;
    bool in_position;
    bool backpressure;          /* many events wait, so the gateware stops forward motion */
    hal_motion_state state;
} hal_motion;

void hal_slot_write(unsigned slot, const hal_segment *segment);
/* Change the rate of the segment in a slot, which has this length; in force at once if the machine
   is in it. */
void hal_slot_pace(unsigned slot, uint32_t length, uint32_t rate);
void hal_bound_write(hal_bound bound, int32_t value);
void hal_fast_slot(unsigned slot);  /* the fast bounds hold while the machine is in this slot */
void hal_origin(unsigned slot);     /* the path coordinate begins at 0, in this slot */
int32_t hal_command(void);      /* path coordinate of the last pulse Ps */
int32_t hal_position(void);     /* path coordinate of the last ramped pulse */
int32_t hal_front(void);        /* furthest path coordinate commanded */
unsigned hal_slot(void);        /* slot of the segment in which the machine is */
hal_motion hal_motion_read(void);
void hal_ramp(uint32_t start_rate, uint32_t acceleration);
void hal_ramp_back(uint32_t start_rate, uint32_t acceleration);   /* on the way back */
void hal_lead(uint32_t clocks); /* of the velocity feed-forward; 0: the plain loop */

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
void hal_walk(uint32_t distance); /* the operator's walk: path pulses before the front, 0 for none */
int32_t hal_start(void);        /* start point: where machining goes on, path coordinate */
int32_t hal_first(void);        /* first start point of the short burst, path coordinate */
uint32_t hal_shorts(void);      /* shorts in the burst */

/* Event queue. */
typedef struct {
    uint8_t kind, detail, slot; /* hal_event_kind */
    uint32_t cycle_low;
    int32_t path;
    uint32_t first, second;
    int32_t encoder[HAL_AXES];
} hal_event;

bool hal_event_pop(hal_event *event);   /* false: queue empty */
bool hal_event_lost(void);      /* the queue was full and an event was lost; reading clears it */
void hal_interrupts(bool events); /* of events; the first call also enables the watchdog's */

/* Gap and power. */
typedef struct {
    uint32_t needed, window, duration, clear, blanking; /* pulses, pulses, clocks, samples, clocks */
    uint32_t mean, mean_time;                           /* code (0: by pulses), clocks */
    uint32_t current;                                   /* clocks (0: by the voltage) */
} hal_short_detector;

typedef struct {
    uint32_t settle, confirm;                           /* clocks */
} hal_discriminator;

typedef struct {
    uint32_t delay_least;                               /* clocks */
    bool current, delay, noise;                         /* which are in use */
    bool relaxation;                                    /* the main source charges a capacitor */
} hal_criterion;

void hal_short_write(const hal_short_detector *detector);
void hal_lag_time(uint32_t clocks);                     /* by which the axes lag behind the ramp */
void hal_gap_counts(uint32_t counts[4]);                /* open, ok, dame, short */
bool hal_shorted(void);                                 /* Ss after the last pulses */
void hal_discriminate(const hal_discriminator *rules);
void hal_criteria(const hal_criterion *c);
/* Clocks from an ignition at the pins to the clock that sees it, and from the gateware's last clock
   of a gate to the end of the pulse at its pin: rtl/pads.py. */
#define HAL_GAP_LATENCY 4u
/* Clocks of on-time, longest wait for the ignition from which the on-time counts (0: it counts from
   the gate), off-time, and additional off-time after an arc or a short; current in steps of the
   supply. */
void hal_pulse(uint32_t on, uint32_t wait, uint32_t off, uint32_t rest, uint32_t level);
uint32_t hal_level_limit(void);                         /* highest level that the gateware allows */
void hal_supply(uint32_t voltage, bool negative);           /* steps of the supply */
void hal_references(uint32_t open, uint32_t arc, uint32_t shorted); /* 1/1024 of full scale */
void hal_sense(uint32_t on, uint32_t off);                  /* clocks */
void hal_follow(uint32_t clocks);   /* shortest wait for supply and comparators */
void hal_discharge(bool machining);

/* Servo. */
void hal_servo(bool on);
void hal_servo_period(uint32_t clocks);
void hal_servo_step(uint32_t pulses);
void hal_counting(uint32_t mode, uint32_t window, uint32_t weight);
void hal_presets(uint32_t dame, uint32_t open, uint32_t ok); /* pulses */

/* Feed by the mean voltage. Levels are 2**-16 of the converter's full scale. */
typedef struct {
    uint32_t mode;                          /* 0 constant, else the number of G95 P less one */
    uint32_t measure;
    bool shares;                            /* Ex by the discharge per distance */
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
/* Levels: no-load voltage, Vs, Es; and Es as a share of the time, 2**-16. */
void hal_feed_mode_references(uint32_t no_load, uint32_t voltage, uint32_t drop, uint32_t share);
hal_feed_mode_state hal_feed_mode_read(void);

/* The gap oscilloscope; see the block `scope` of the register reference. */
typedef enum {
    HAL_SCOPE_NOW, HAL_SCOPE_SHORT, HAL_SCOPE_RETRACTION, HAL_SCOPE_CLASS, HAL_SCOPE_RISE,
    HAL_SCOPE_FALL
} hal_scope_source;
typedef enum { HAL_SCOPE_IDLE, HAL_SCOPE_ARMED, HAL_SCOPE_TRIGGERED, HAL_SCOPE_FULL } hal_scope_recording;
typedef enum { HAL_SCOPE_STOP, HAL_SCOPE_FORCE } hal_scope_ordered;

typedef struct {
    hal_scope_source source;
    uint32_t classes, level, after;         /* bits, code, entries */
} hal_scope_trigger;

typedef struct {
    hal_scope_recording recording;
    uint32_t count, after, time;            /* entries, entries, clock of the trigger (32 bits) */
} hal_scope_state;

uint32_t hal_scope_depth(void);             /* entries; 0: there is no oscilloscope */
void hal_scope_arm(const hal_scope_trigger *trigger);
void hal_scope_order(hal_scope_ordered order);
hal_scope_state hal_scope_read(void);
void hal_scope_choose(uint32_t place);      /* the entry that hal_scope_next returns first */
uint64_t hal_scope_next(void);              /* an entry, 36 bits */

/* The condition. Values given to hal_pulse, hal_supply, hal_references, hal_criteria, hal_presets,
   hal_counting, hal_servo_step and hal_feed_mode_references are staged. They come into force
   together, between two pulses. None of these functions may be called while hal_condition_pending. */
void hal_condition_commit(void);            /* switch after the present pulse; disarms */
void hal_condition_arm(int32_t depth);      /* switch at this depth of the jump axis (pulses) */
void hal_condition_disarm(void);
void hal_condition_restart(void);           /* the greatest depth so far is the present one */
bool hal_condition_pending(void);
uint8_t hal_condition_count(void);          /* switches by depth since reset, wraps */

/* Fluid. Thresholds and levels are codes of the conductivity cell. */
#define HAL_FLUID_LOW 1u        /* flags of EVENT_FLUID_CLASS, in `first`; `second` is the level */
#define HAL_FLUID_HIGH 2u
#define HAL_FLUID_DISORDERED 4u
#define HAL_FLUID_SILENT 8u
#define HAL_FLUID_KNOWN 16u     /* of hal_fluid_state only: there is an average */
#define HAL_FLUID_CLASS(state) ((state) >> 8 & 3u)      /* of hal_fluid_state: class in force */
#define HAL_FLUID_MEASURED(first) ((first) >> 4 & 3u)   /* measured class; not always in force */

typedef struct {
    bool convert, manual;
    uint32_t manual_class, threshold[3], hysteresis, lowest, highest;
} hal_fluid;

void hal_fluid_write(const hal_fluid *detector);
uint32_t hal_fluid_state(void); /* the present flags and class */

/* What the inputs are at: `levels` as the register `safety.inputs`, and the last codes of the converter
   for the gap voltage and the fluid's cell. */
typedef struct {
    uint32_t levels, voltage, cell;
} hal_inputs;

hal_inputs hal_inputs_read(void);
uint32_t hal_memory_words(void);
void hal_memory_read(uint32_t first, uint32_t end); /* read words of the memory, before `end` */

/* Safety. */
typedef struct {
    uint8_t low, high;      /* limit switches that are pressed, bit 0 X */
    bool leaving;           /* the axes may move away from them */
} hal_limits;

/* Damage that the cause `guard` has found. */
#define HAL_DAMAGE_AXES 7u      /* axes, bit 0 X: counts that disagree, or the backlash */
#define HAL_DAMAGE_WORD 8u      /* a word of the path window */
#define HAL_DAMAGE_SEGMENT 16u  /* the present segment */
#define HAL_DAMAGE_PLACE 32u    /* the place on the path */
#define HAL_DAMAGE_PULSES 64u   /* path pulses on their way */
/* Axes with damage in a soft limit, a bound of the following error, the gain, the output's mode, gear,
   backlash or pitch error. */
#define HAL_DAMAGE_SETTINGS(damage) ((damage) >> 7 & 7u)
#define HAL_DAMAGE_FLUID 1024u  /* the choice whether low fluid trips */
#define HAL_DAMAGE_RATE 2048u   /* the rate of the ramp */
#define HAL_DAMAGE_LATCH 4096u  /* the latch of the interlock */

void hal_pet(uint8_t key);
bool hal_watch_open(void);      /* a call of the watchdog would not be too early */
bool hal_watch_asked(void);     /* the watchdog's interrupt waits for its answer */
bool hal_safe(void);            /* the outputs are safe: the interlock has tripped */
unsigned hal_first_cause(void);
uint32_t hal_causes(void);      /* latched causes, a bit for each */
unsigned hal_blamed(void);      /* axes that raised the first cause, bit 0 X */
hal_limits hal_limits_read(void);
void hal_leave(void);           /* let pressed limit switches not trip while they are left */
uint32_t hal_damage(void);
void hal_interlock_clear(void);
void hal_interlock_trip(void);
void hal_fluid_required(bool required);
bool hal_arm_pressed(void);     /* the level of the button ARM */
bool hal_armed(void);           /* the operator has pressed ARM, which allows the discharge */
void hal_disarm(void);          /* the operator has to press ARM again */

/* Machine side. */
typedef enum { AUXILIARY_M, AUXILIARY_S, AUXILIARY_T } hal_letter;
void hal_auxiliary_send(hal_letter letter, uint32_t code);
void hal_auxiliary_timeout(uint32_t clocks);
bool hal_auxiliary_busy(void);
bool hal_auxiliary_timed_out(void);     /* reading clears it */

/* Axes. */
/* Positions are in the machine frame. The gateware counts from power-on; hal_axis_shift moves an
   axis's frame, so that its present place gets a number higher by so much. Only at rest; the soft
   limits must then be written again. */
void hal_axis_shift(unsigned axis, int32_t by);
/* The next index of the coders of these axes shall be an event, as bits; of the others, none. */
void hal_index_arm(uint32_t axes);
int32_t hal_axis_command(unsigned axis);
int32_t hal_axis_position(unsigned axis);
int32_t hal_axis_error(unsigned axis);
uint32_t hal_axis_overshoot(unsigned axis);
void hal_axis_errors(unsigned axis, uint32_t stopped, uint32_t moving, uint32_t window);
typedef struct {
    bool step, reverse, swap;   /* step output; the coder, and the drive, goes the other way */
    int32_t offset;             /* velocity command at which the axis stands still, pulses of Er */
    uint32_t friction;          /* velocity command that friction takes, pulses of Er */
} hal_drive;
void hal_axis_mode(unsigned axis, const hal_drive *drive);
void hal_axis_gear(unsigned axis, uint32_t steps, uint32_t pulses); /* begins to count steps anew */
void hal_axis_backlash(unsigned axis, uint32_t pulses);     /* the axis counts as having come up */
/* The screw takes the axis so far too far up. The axis walks there, except while safe. */
void hal_axis_pitch(unsigned axis, int32_t pulses);
void hal_axis_step_time(unsigned axis, uint32_t width, uint32_t space, uint32_t setup);
void hal_axis_adopt(unsigned axis);
void hal_axis_limits(unsigned axis, int32_t low, int32_t high); /* soft limits, pulses */
/* Gain of the loop, 2**-20 pulse/tick per pulse, and part of the drive's lag in a tick, 2**-16. */
void hal_axis_model(unsigned axis, uint32_t gain, uint32_t lag);

hal_check hal_axis_check(unsigned axis);
bool hal_axis_beyond(unsigned axis, bool high);     /* a pulse beyond a soft limit was refused */
