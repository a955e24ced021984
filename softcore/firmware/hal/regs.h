/* Generated from regmap.py, flashmap.py, linkmap.py, scopemap.py and tables/ in softcore by `python -m softcore.generate`; do not edit. */
#pragma once
#include <stddef.h>
#include <stdint.h>

/* What this gateware is, and its clock. */
typedef volatile struct {
    const uint32_t ident; /* Always ``GAPK``, first letter lowest, so that the firmware can refuse other gateware. */
    const uint32_t build; /* Digest of the gateware: its sources, the board and its pins; 0 in a simulation. */
    const uint32_t clock_hz; /* Clock frequency. [Hz] */
    const uint32_t pulses_per_mm; /* Unit of position. [pulse/mm] */
    const uint32_t shape; /* Sizes of this build. */
    const uint32_t cycle_low; /* Clocks since reset, lower half. Reading it latches the upper half. [clock] */
    const uint32_t cycle_high; /* Upper half of the clock count latched by the last read of the lower. [2**32 clock] */
    uint32_t sleep; /* Stop the processor until there is an event or a byte from the host, or until this time is over. [clock] */
} system_regs;
_Static_assert(offsetof(system_regs, ident) == 0x0, "");
_Static_assert(offsetof(system_regs, build) == 0x4, "");
_Static_assert(offsetof(system_regs, clock_hz) == 0x8, "");
_Static_assert(offsetof(system_regs, pulses_per_mm) == 0xc, "");
_Static_assert(offsetof(system_regs, shape) == 0x10, "");
_Static_assert(offsetof(system_regs, cycle_low) == 0x14, "");
_Static_assert(offsetof(system_regs, cycle_high) == 0x18, "");
_Static_assert(offsetof(system_regs, sleep) == 0x1c, "");
#define SYSTEM_SHAPE_AXES_SHIFT 0
#define SYSTEM_SHAPE_AXES_MASK 0x0000000fu
#define SYSTEM_SHAPE_SLOTS_SHIFT 4
#define SYSTEM_SHAPE_SLOTS_MASK 0x00000ff0u
#define SYSTEM_SHAPE_JUMP_AXIS_SHIFT 12
#define SYSTEM_SHAPE_JUMP_AXIS_MASK 0x0000f000u
#define SYSTEM_SLEEP_VALUE_SHIFT 0
#define SYSTEM_SLEEP_VALUE_MASK 0x0000ffffu
#define SYSTEM ((system_regs *)0x80000000u)

/* Serial flash memory of journal and firmware; see ``softcore.flash``. */
typedef volatile struct {
    uint32_t send; /* Exchange a byte with the memory. Does nothing while ``busy``. */
    uint32_t select; /* Select the memory, around the bytes of a command. */
    const uint32_t status; /* State of the exchange. */
    const uint32_t region; /* The journal's region of the memory, and two firmware slots behind it: nothing else is ever written. */
} flash_regs;
_Static_assert(offsetof(flash_regs, send) == 0x0, "");
_Static_assert(offsetof(flash_regs, select) == 0x4, "");
_Static_assert(offsetof(flash_regs, status) == 0x8, "");
_Static_assert(offsetof(flash_regs, region) == 0xc, "");
#define FLASH_SEND_VALUE_SHIFT 0
#define FLASH_SEND_VALUE_MASK 0x000000ffu
#define FLASH_SELECT_VALUE_SHIFT 0
#define FLASH_SELECT_VALUE_MASK 0x00000001u
#define FLASH_STATUS_RECEIVED_SHIFT 0
#define FLASH_STATUS_RECEIVED_MASK 0x000000ffu
#define FLASH_STATUS_BUSY_SHIFT 8
#define FLASH_STATUS_BUSY_MASK 0x00000100u
#define FLASH_REGION_FIRST_SHIFT 0
#define FLASH_REGION_FIRST_MASK 0x0000ffffu
#define FLASH_REGION_SECTORS_SHIFT 16
#define FLASH_REGION_SECTORS_MASK 0x00ff0000u
#define FLASH_REGION_SLOT_SHIFT 24
#define FLASH_REGION_SLOT_MASK 0xff000000u
#define FLASH ((flash_regs *)0x80000080u)

/* Bytes to and from the host; see ``softcore.link_decoder``. */
typedef volatile struct {
    const uint32_t receive; /* Oldest entry of the receive queue. Reading takes it. */
    uint32_t transmit; /* Send a byte. Lost if the transmitter is not ready. */
    const uint32_t status; /* State of the link. */
    const uint32_t notes; /* Real-time bytes that came since the last read. Reading clears them. */
    uint32_t release; /* End the effect of a real-time byte, unless the byte has come again and the firmware has not seen that yet. */
    const uint32_t override; /* Overrides as set by their real-time bytes. */
    const uint32_t waiting; /* Length of the receive queue. [entry] */
} link_regs;
_Static_assert(offsetof(link_regs, receive) == 0x0, "");
_Static_assert(offsetof(link_regs, transmit) == 0x4, "");
_Static_assert(offsetof(link_regs, status) == 0x8, "");
_Static_assert(offsetof(link_regs, notes) == 0xc, "");
_Static_assert(offsetof(link_regs, release) == 0x10, "");
_Static_assert(offsetof(link_regs, override) == 0x14, "");
_Static_assert(offsetof(link_regs, waiting) == 0x18, "");
#define LINK_RECEIVE_DATA_SHIFT 0
#define LINK_RECEIVE_DATA_MASK 0x000000ffu
#define LINK_RECEIVE_MARK_SHIFT 8
#define LINK_RECEIVE_MARK_MASK 0x00000100u
#define LINK_RECEIVE_VALID_SHIFT 9
#define LINK_RECEIVE_VALID_MASK 0x00000200u
#define LINK_TRANSMIT_VALUE_SHIFT 0
#define LINK_TRANSMIT_VALUE_MASK 0x000000ffu
#define LINK_STATUS_READY_SHIFT 0
#define LINK_STATUS_READY_MASK 0x00000001u
#define LINK_STATUS_HOLD_SHIFT 1
#define LINK_STATUS_HOLD_MASK 0x00000002u
#define LINK_STATUS_RESET_SHIFT 2
#define LINK_STATUS_RESET_MASK 0x00000004u
#define LINK_NOTES_STATUS_SHIFT 0
#define LINK_NOTES_STATUS_MASK 0x00000001u
#define LINK_NOTES_HOLD_SHIFT 1
#define LINK_NOTES_HOLD_MASK 0x00000002u
#define LINK_NOTES_RESUME_SHIFT 2
#define LINK_NOTES_RESUME_MASK 0x00000004u
#define LINK_NOTES_RETRACT_SHIFT 3
#define LINK_NOTES_RETRACT_MASK 0x00000008u
#define LINK_NOTES_STOP_SHIFT 4
#define LINK_NOTES_STOP_MASK 0x00000010u
#define LINK_NOTES_CANCEL_SHIFT 5
#define LINK_NOTES_CANCEL_MASK 0x00000020u
#define LINK_RELEASE_HOLD_SHIFT 0
#define LINK_RELEASE_HOLD_MASK 0x00000001u
#define LINK_RELEASE_RESET_SHIFT 1
#define LINK_RELEASE_RESET_MASK 0x00000002u
#define LINK_RELEASE_OVERRIDE_SHIFT 2
#define LINK_RELEASE_OVERRIDE_MASK 0x00000004u
#define LINK_OVERRIDE_FEED_SHIFT 0
#define LINK_OVERRIDE_FEED_MASK 0x000000ffu
#define LINK_OVERRIDE_RAPID_SHIFT 8
#define LINK_OVERRIDE_RAPID_MASK 0x00007f00u
#define LINK_WAITING_VALUE_SHIFT 0
#define LINK_WAITING_VALUE_MASK 0x000001ffu
#define LINK ((link_regs *)0x80000100u)

/* The path: its window of segments, and the machine's place on it. Coordinates are path pulses and wrap at 32 bits. */
typedef volatile struct {
    uint32_t slot_select; /* Choose a slot to be written, beginning with its first word. Segment n is in slot n modulo the number of slots. */
    uint32_t slot_data; /* Next word of the slot: a line has 6, an arc 16; see ``rtl.motion.path``. */
    int32_t ahead; /* End of the loaded segments: no forward pulse passes it. [pulse] */
    int32_t behind; /* Start of the loaded segments: no backward pulse passes it. [pulse] */
    int32_t back_limit; /* Back limit: the lowest point that a retraction may reach (ceiling, soft limit or start of the path). [pulse] */
    int32_t fast_ahead; /* Next corner ahead, or a place before it: there the ramp is back at the start/stop speed. [pulse] */
    int32_t fast_behind; /* Next corner behind, or a place before it, for the way back. [pulse] */
    uint32_t fast_ahead_rate; /* Bound of every rate from that place ahead on; 0 for the start/stop speed alone. [2**-28 pulse/clock] */
    uint32_t fast_behind_rate; /* The same from the place behind on, for the way back. [2**-28 pulse/clock] */
    uint32_t fast_slot; /* Put both corners with their rates in force, if the machine is still in the segment of this slot. */
    uint32_t origin; /* Put the (resting) machine at coordinate 0, at the start of a slot's segment. */
    const int32_t command; /* Path coordinate of the last pulse Ps. [pulse] */
    const int32_t position; /* Path coordinate of the last ramped pulse Pp. [pulse] */
    const int32_t front; /* Furthest path coordinate commanded. [pulse] */
    const uint32_t slot; /* Slot of the segment in which the machine is. */
    const uint32_t status; /* State of the motion. */
    uint32_t pace; /* New feed of a segment, for ``pace_slot``. [2**-32 pulse/clock] */
    uint32_t pace_slot; /* Put ``pace`` in force at once, if the machine is in the segment of this slot. The rate in the slot must be written before. */
} path_regs;
_Static_assert(offsetof(path_regs, slot_select) == 0x0, "");
_Static_assert(offsetof(path_regs, slot_data) == 0x4, "");
_Static_assert(offsetof(path_regs, ahead) == 0x8, "");
_Static_assert(offsetof(path_regs, behind) == 0xc, "");
_Static_assert(offsetof(path_regs, back_limit) == 0x10, "");
_Static_assert(offsetof(path_regs, fast_ahead) == 0x14, "");
_Static_assert(offsetof(path_regs, fast_behind) == 0x18, "");
_Static_assert(offsetof(path_regs, fast_ahead_rate) == 0x1c, "");
_Static_assert(offsetof(path_regs, fast_behind_rate) == 0x20, "");
_Static_assert(offsetof(path_regs, fast_slot) == 0x24, "");
_Static_assert(offsetof(path_regs, origin) == 0x28, "");
_Static_assert(offsetof(path_regs, command) == 0x2c, "");
_Static_assert(offsetof(path_regs, position) == 0x30, "");
_Static_assert(offsetof(path_regs, front) == 0x34, "");
_Static_assert(offsetof(path_regs, slot) == 0x38, "");
_Static_assert(offsetof(path_regs, status) == 0x3c, "");
_Static_assert(offsetof(path_regs, pace) == 0x40, "");
_Static_assert(offsetof(path_regs, pace_slot) == 0x44, "");
#define PATH_SLOT_SELECT_VALUE_SHIFT 0
#define PATH_SLOT_SELECT_VALUE_MASK 0x000000ffu
#define PATH_FAST_AHEAD_RATE_VALUE_SHIFT 0
#define PATH_FAST_AHEAD_RATE_VALUE_MASK 0x03ffffffu
#define PATH_FAST_BEHIND_RATE_VALUE_SHIFT 0
#define PATH_FAST_BEHIND_RATE_VALUE_MASK 0x03ffffffu
#define PATH_FAST_SLOT_VALUE_SHIFT 0
#define PATH_FAST_SLOT_VALUE_MASK 0x000000ffu
#define PATH_ORIGIN_VALUE_SHIFT 0
#define PATH_ORIGIN_VALUE_MASK 0x000000ffu
#define PATH_SLOT_VALUE_SHIFT 0
#define PATH_SLOT_VALUE_MASK 0x000000ffu
#define PATH_STATUS_MOVING_SHIFT 0
#define PATH_STATUS_MOVING_MASK 0x00000001u
#define PATH_STATUS_REVERSE_SHIFT 1
#define PATH_STATUS_REVERSE_MASK 0x00000002u
#define PATH_STATUS_IN_POSITION_SHIFT 2
#define PATH_STATUS_IN_POSITION_MASK 0x00000004u
#define PATH_STATUS_STATE_SHIFT 3
#define PATH_STATUS_STATE_MASK 0x00000078u
#define PATH_STATUS_BACKPRESSURE_SHIFT 7
#define PATH_STATUS_BACKPRESSURE_MASK 0x00000080u
#define PATH_PACE_VALUE_SHIFT 0
#define PATH_PACE_VALUE_MASK 0x3fffffffu
#define PATH_PACE_SLOT_VALUE_SHIFT 0
#define PATH_PACE_SLOT_VALUE_MASK 0x000000ffu
#define PATH ((path_regs *)0x80000200u)

/* Accelerator/decelerator; see ``rtl.motion.ramp``. */
typedef volatile struct {
    uint32_t start_rate; /* Start/stop speed: any change of speed below it is immediate. [2**-32 pulse/clock] */
    uint32_t acceleration; /* Slope of the linear ramp. [2**-32 pulse/clock per 16 clock] */
    uint32_t back_start_rate; /* Start/stop speed on the way back. [2**-32 pulse/clock] */
    uint32_t back_acceleration; /* Slope of the ramp on the way back. [2**-32 pulse/clock per 16 clock] */
    uint32_t lead; /* Lag of the position loop that the velocity feed-forward makes up; 0: the plain loop. Taken over at rest. See ``rtl.motion.feed_forward``. [clock] */
} ramp_regs;
_Static_assert(offsetof(ramp_regs, start_rate) == 0x0, "");
_Static_assert(offsetof(ramp_regs, acceleration) == 0x4, "");
_Static_assert(offsetof(ramp_regs, back_start_rate) == 0x8, "");
_Static_assert(offsetof(ramp_regs, back_acceleration) == 0xc, "");
_Static_assert(offsetof(ramp_regs, lead) == 0x10, "");
#define RAMP_START_RATE_VALUE_SHIFT 0
#define RAMP_START_RATE_VALUE_MASK 0x3fffffffu
#define RAMP_ACCELERATION_VALUE_SHIFT 0
#define RAMP_ACCELERATION_VALUE_MASK 0x3fffffffu
#define RAMP_BACK_START_RATE_VALUE_SHIFT 0
#define RAMP_BACK_START_RATE_VALUE_MASK 0x3fffffffu
#define RAMP_BACK_ACCELERATION_VALUE_SHIFT 0
#define RAMP_BACK_ACCELERATION_VALUE_MASK 0x3fffffffu
#define RAMP_LEAD_VALUE_SHIFT 0
#define RAMP_LEAD_VALUE_MASK 0x07ffffffu
#define RAMP ((ramp_regs *)0x80000300u)

/* Retraction data in force and the start of retractions; see ``rtl.motion.retraction``. The data words are staged: ``commit`` puts them in force together. */
typedef volatile struct {
    uint32_t rate; /* Retraction speed. [2**-32 pulse/clock] */
    uint32_t limit; /* Retractable limit: distance from the first start point. [pulse] */
    uint32_t high_rate; /* High re-advance speed. [2**-32 pulse/clock] */
    uint32_t low_rate; /* Low re-advance speed. [2**-32 pulse/clock] */
    uint32_t changeover; /* Changeover position: distance before the start point. [pulse] */
    uint32_t low_lead; /* Braking distance from the low re-advance speed to the start/stop speed. [pulse] */
    uint32_t jump_distance; /* How far a jump goes. [pulse] */
    uint32_t jump_rate; /* Speed of a jump upwards. [2**-32 pulse/clock] */
    uint32_t jump_high_rate; /* Speed of a jump back, down to the changeover position. [2**-32 pulse/clock] */
    uint32_t commit; /* Put the staged data in force: at once if the machine is at the front, else when it is there again. */
    uint32_t jump_period; /* Machining time between jumps; 0 for none. [clock] */
    uint32_t gain; /* Depth beyond the first start point that ends a short burst. [pulse] */
    uint32_t repeats; /* Return of the short in a short burst that halts the machine; 0 for no bound. */
    uint32_t walk; /* Distance before the front to which the operator walks along the path, 0 for none. Taken over at rest. [pulse] */
    uint32_t settle; /* Time at rest at the limit, with small error counters, until a short there halts. [clock] */
    uint32_t control; /* What motion may do. */
    uint32_t command; /* Orders to the retraction. */
    const int32_t start; /* Start point BS: furthest commanded position of this short. [pulse] */
    const int32_t first; /* First start point of the short burst; the limit is measured from it. [pulse] */
    const uint32_t burst; /* Number of shorts so far after the first of the present short burst. */
} retraction_regs;
_Static_assert(offsetof(retraction_regs, rate) == 0x0, "");
_Static_assert(offsetof(retraction_regs, limit) == 0x4, "");
_Static_assert(offsetof(retraction_regs, high_rate) == 0x8, "");
_Static_assert(offsetof(retraction_regs, low_rate) == 0xc, "");
_Static_assert(offsetof(retraction_regs, changeover) == 0x10, "");
_Static_assert(offsetof(retraction_regs, low_lead) == 0x14, "");
_Static_assert(offsetof(retraction_regs, jump_distance) == 0x18, "");
_Static_assert(offsetof(retraction_regs, jump_rate) == 0x1c, "");
_Static_assert(offsetof(retraction_regs, jump_high_rate) == 0x20, "");
_Static_assert(offsetof(retraction_regs, commit) == 0x24, "");
_Static_assert(offsetof(retraction_regs, jump_period) == 0x28, "");
_Static_assert(offsetof(retraction_regs, gain) == 0x2c, "");
_Static_assert(offsetof(retraction_regs, repeats) == 0x30, "");
_Static_assert(offsetof(retraction_regs, walk) == 0x34, "");
_Static_assert(offsetof(retraction_regs, settle) == 0x38, "");
_Static_assert(offsetof(retraction_regs, control) == 0x3c, "");
_Static_assert(offsetof(retraction_regs, command) == 0x40, "");
_Static_assert(offsetof(retraction_regs, start) == 0x44, "");
_Static_assert(offsetof(retraction_regs, first) == 0x48, "");
_Static_assert(offsetof(retraction_regs, burst) == 0x4c, "");
#define RETRACTION_RATE_VALUE_SHIFT 0
#define RETRACTION_RATE_VALUE_MASK 0x3fffffffu
#define RETRACTION_LIMIT_VALUE_SHIFT 0
#define RETRACTION_LIMIT_VALUE_MASK 0x7fffffffu
#define RETRACTION_HIGH_RATE_VALUE_SHIFT 0
#define RETRACTION_HIGH_RATE_VALUE_MASK 0x3fffffffu
#define RETRACTION_LOW_RATE_VALUE_SHIFT 0
#define RETRACTION_LOW_RATE_VALUE_MASK 0x3fffffffu
#define RETRACTION_CHANGEOVER_VALUE_SHIFT 0
#define RETRACTION_CHANGEOVER_VALUE_MASK 0x7fffffffu
#define RETRACTION_LOW_LEAD_VALUE_SHIFT 0
#define RETRACTION_LOW_LEAD_VALUE_MASK 0x00ffffffu
#define RETRACTION_JUMP_DISTANCE_VALUE_SHIFT 0
#define RETRACTION_JUMP_DISTANCE_VALUE_MASK 0x7fffffffu
#define RETRACTION_JUMP_RATE_VALUE_SHIFT 0
#define RETRACTION_JUMP_RATE_VALUE_MASK 0x3fffffffu
#define RETRACTION_JUMP_HIGH_RATE_VALUE_SHIFT 0
#define RETRACTION_JUMP_HIGH_RATE_VALUE_MASK 0x3fffffffu
#define RETRACTION_COMMIT_VALID_SHIFT 0
#define RETRACTION_COMMIT_VALID_MASK 0x00000001u
#define RETRACTION_GAIN_VALUE_SHIFT 0
#define RETRACTION_GAIN_VALUE_MASK 0x0000ffffu
#define RETRACTION_REPEATS_VALUE_SHIFT 0
#define RETRACTION_REPEATS_VALUE_MASK 0x000000ffu
#define RETRACTION_WALK_VALUE_SHIFT 0
#define RETRACTION_WALK_VALUE_MASK 0x7fffffffu
#define RETRACTION_SETTLE_VALUE_SHIFT 0
#define RETRACTION_SETTLE_VALUE_MASK 0x00ffffffu
#define RETRACTION_CONTROL_RUN_SHIFT 0
#define RETRACTION_CONTROL_RUN_MASK 0x00000001u
#define RETRACTION_CONTROL_HOLD_SHIFT 1
#define RETRACTION_CONTROL_HOLD_MASK 0x00000002u
#define RETRACTION_COMMAND_RETRACT_SHIFT 0
#define RETRACTION_COMMAND_RETRACT_MASK 0x00000001u
#define RETRACTION_COMMAND_RELEASE_SHIFT 1
#define RETRACTION_COMMAND_RELEASE_MASK 0x00000002u
#define RETRACTION_BURST_VALUE_SHIFT 0
#define RETRACTION_BURST_VALUE_MASK 0x000000ffu
#define RETRACTION ((retraction_regs *)0x80000400u)

/* Queue of the gateware's events, oldest first. An event at its head interrupts the CPU. */
typedef volatile struct {
    const uint32_t head; /* The oldest event. */
    const uint32_t cycle; /* Time of the event. [clock] */
    const int32_t path; /* Path coordinate at that time. [pulse] */
    const uint32_t first; /* First value; its meaning depends on the kind. */
    const uint32_t second; /* Second value; its meaning depends on the kind. */
    const int32_t x; /* Encoder position of X at that time. [pulse] */
    const int32_t y; /* Encoder position of Y at that time. [pulse] */
    const int32_t z; /* Encoder position of Z at that time. [pulse] */
    uint32_t pop; /* Drop the oldest event. */
    uint32_t status; /* State of the queue. */
    uint32_t index; /* Axes of which the next index of the coder shall be an event, bit 0 X. It names all that wait for one; an event, and outputs that become safe, end the wait. See ``rtl.motion.index``. */
} event_regs;
_Static_assert(offsetof(event_regs, head) == 0x0, "");
_Static_assert(offsetof(event_regs, cycle) == 0x4, "");
_Static_assert(offsetof(event_regs, path) == 0x8, "");
_Static_assert(offsetof(event_regs, first) == 0xc, "");
_Static_assert(offsetof(event_regs, second) == 0x10, "");
_Static_assert(offsetof(event_regs, x) == 0x14, "");
_Static_assert(offsetof(event_regs, y) == 0x18, "");
_Static_assert(offsetof(event_regs, z) == 0x1c, "");
_Static_assert(offsetof(event_regs, pop) == 0x20, "");
_Static_assert(offsetof(event_regs, status) == 0x24, "");
_Static_assert(offsetof(event_regs, index) == 0x28, "");
#define EVENT_HEAD_KIND_SHIFT 0
#define EVENT_HEAD_KIND_MASK 0x000000ffu
#define EVENT_HEAD_DETAIL_SHIFT 8
#define EVENT_HEAD_DETAIL_MASK 0x0000ff00u
#define EVENT_HEAD_SLOT_SHIFT 16
#define EVENT_HEAD_SLOT_MASK 0x00ff0000u
#define EVENT_HEAD_VALID_SHIFT 24
#define EVENT_HEAD_VALID_MASK 0x01000000u
#define EVENT_POP_VALUE_SHIFT 0
#define EVENT_POP_VALUE_MASK 0x00000001u
#define EVENT_STATUS_LOST_SHIFT 0
#define EVENT_STATUS_LOST_MASK 0x00000001u
#define EVENT_INDEX_VALUE_SHIFT 0
#define EVENT_INDEX_VALUE_MASK 0x00000007u
#define EVENT ((event_regs *)0x80000500u)

/* Classes of the discharges, and the short detector. */
typedef volatile struct {
    uint32_t short_ratio; /* A short is detected if `needed` of the last `window` pulses were shorted. */
    uint32_t short_duration; /* A short is also detected after so long without a clear sample; 0: never. [clock] */
    uint32_t clear_needed; /* Clear samples in a row that end a short. */
    uint32_t blanking; /* From the start of a pulse (or sensing pulse) until the comparators are read. [clock] */
    uint32_t settle; /* From the ignition until the comparators are read. [clock] */
    uint32_t confirm; /* Within a pulse, an arc or short counts as abnormal after this time; 0 counts as 1. [clock] */
    uint32_t delay_least; /* Least delay of a good discharge. [clock] */
    uint32_t criteria; /* How discharges are classified; see ``rtl.gap.discriminator``. */
    uint32_t reference; /* References of the comparators. */
    const uint32_t open_count; /* Pulses without a discharge. */
    const uint32_t ok_count; /* Good discharges. */
    const uint32_t dame_count; /* Arcs: discharges below the arc level. */
    const uint32_t short_count; /* Shorted pulses. */
    const uint32_t status; /* State of the gap. */
    uint32_t short_mean; /* A short by the mean voltage below this; 0: by shorted pulses. It needs the converter. [1/4096 full scale] */
    uint32_t short_mean_time; /* Time of that mean; 0 for never. [clock] */
    uint32_t lag_time; /* After the ramp has come down to the start/stop speed, the axes may be faster for this time. Contact with the discharge off trips the interlock in this time. [clock] */
    uint32_t short_current; /* A pulse counts as shorted for Ss by the current, if that flows with a shorter ignition delay; 0: by the voltage. See ``rtl.gap.conduction``. [clock] */
} gap_regs;
_Static_assert(offsetof(gap_regs, short_ratio) == 0x0, "");
_Static_assert(offsetof(gap_regs, short_duration) == 0x4, "");
_Static_assert(offsetof(gap_regs, clear_needed) == 0x8, "");
_Static_assert(offsetof(gap_regs, blanking) == 0xc, "");
_Static_assert(offsetof(gap_regs, settle) == 0x10, "");
_Static_assert(offsetof(gap_regs, confirm) == 0x14, "");
_Static_assert(offsetof(gap_regs, delay_least) == 0x18, "");
_Static_assert(offsetof(gap_regs, criteria) == 0x1c, "");
_Static_assert(offsetof(gap_regs, reference) == 0x20, "");
_Static_assert(offsetof(gap_regs, open_count) == 0x24, "");
_Static_assert(offsetof(gap_regs, ok_count) == 0x28, "");
_Static_assert(offsetof(gap_regs, dame_count) == 0x2c, "");
_Static_assert(offsetof(gap_regs, short_count) == 0x30, "");
_Static_assert(offsetof(gap_regs, status) == 0x34, "");
_Static_assert(offsetof(gap_regs, short_mean) == 0x38, "");
_Static_assert(offsetof(gap_regs, short_mean_time) == 0x3c, "");
_Static_assert(offsetof(gap_regs, lag_time) == 0x40, "");
_Static_assert(offsetof(gap_regs, short_current) == 0x44, "");
#define GAP_SHORT_RATIO_NEEDED_SHIFT 0
#define GAP_SHORT_RATIO_NEEDED_MASK 0x0000003fu
#define GAP_SHORT_RATIO_WINDOW_SHIFT 6
#define GAP_SHORT_RATIO_WINDOW_MASK 0x00000fc0u
#define GAP_SHORT_DURATION_VALUE_SHIFT 0
#define GAP_SHORT_DURATION_VALUE_MASK 0x00ffffffu
#define GAP_CLEAR_NEEDED_VALUE_SHIFT 0
#define GAP_CLEAR_NEEDED_VALUE_MASK 0x000000ffu
#define GAP_BLANKING_VALUE_SHIFT 0
#define GAP_BLANKING_VALUE_MASK 0x0000ffffu
#define GAP_SETTLE_VALUE_SHIFT 0
#define GAP_SETTLE_VALUE_MASK 0x000000ffu
#define GAP_CONFIRM_VALUE_SHIFT 0
#define GAP_CONFIRM_VALUE_MASK 0x000000ffu
#define GAP_DELAY_LEAST_VALUE_SHIFT 0
#define GAP_DELAY_LEAST_VALUE_MASK 0x0000ffffu
#define GAP_CRITERIA_CURRENT_SHIFT 0
#define GAP_CRITERIA_CURRENT_MASK 0x00000001u
#define GAP_CRITERIA_DELAY_SHIFT 1
#define GAP_CRITERIA_DELAY_MASK 0x00000002u
#define GAP_CRITERIA_NOISE_SHIFT 2
#define GAP_CRITERIA_NOISE_MASK 0x00000004u
#define GAP_CRITERIA_RELAXATION_SHIFT 3
#define GAP_CRITERIA_RELAXATION_MASK 0x00000008u
#define GAP_REFERENCE_OPEN_SHIFT 0
#define GAP_REFERENCE_OPEN_MASK 0x000003ffu
#define GAP_REFERENCE_ARC_SHIFT 10
#define GAP_REFERENCE_ARC_MASK 0x000ffc00u
#define GAP_REFERENCE_SHORT_SHIFT 20
#define GAP_REFERENCE_SHORT_MASK 0x3ff00000u
#define GAP_STATUS_SHORTED_SHIFT 0
#define GAP_STATUS_SHORTED_MASK 0x00000001u
#define GAP_STATUS_LAST_SHIFT 1
#define GAP_STATUS_LAST_MASK 0x00000006u
#define GAP_SHORT_MEAN_VALUE_SHIFT 0
#define GAP_SHORT_MEAN_VALUE_MASK 0x00000fffu
#define GAP_SHORT_MEAN_TIME_VALUE_SHIFT 0
#define GAP_SHORT_MEAN_TIME_VALUE_MASK 0x00ffffffu
#define GAP_LAG_TIME_VALUE_SHIFT 0
#define GAP_LAG_TIME_VALUE_MASK 0x0fffffffu
#define GAP_SHORT_CURRENT_VALUE_SHIFT 0
#define GAP_SHORT_CURRENT_VALUE_MASK 0x0000ffffu
#define GAP ((gap_regs *)0x80000600u)

/* Discharge pulses; see ``rtl.power``. */
typedef volatile struct {
    uint32_t on_time; /* Pulse on-time. [clock] */
    uint32_t off_time; /* Pulse off-time. [clock] */
    uint32_t level; /* Current level. [IP] */
    uint32_t sense_on; /* Sensing pulse on-time. [clock] */
    uint32_t sense_off; /* Sensing pulse off-time. [clock] */
    uint32_t control; /* Discharge. */
    uint32_t off_extra; /* Additional off-time after an abnormal pulse. [clock] */
    uint32_t supply; /* Orders to the power supply. */
    const uint32_t limits; /* Limits of the build, which no register can exceed. */
    uint32_t wait_time; /* Longest wait for the ignition. [clock] */
} power_regs;
_Static_assert(offsetof(power_regs, on_time) == 0x0, "");
_Static_assert(offsetof(power_regs, off_time) == 0x4, "");
_Static_assert(offsetof(power_regs, level) == 0x8, "");
_Static_assert(offsetof(power_regs, sense_on) == 0xc, "");
_Static_assert(offsetof(power_regs, sense_off) == 0x10, "");
_Static_assert(offsetof(power_regs, control) == 0x14, "");
_Static_assert(offsetof(power_regs, off_extra) == 0x18, "");
_Static_assert(offsetof(power_regs, supply) == 0x1c, "");
_Static_assert(offsetof(power_regs, limits) == 0x20, "");
_Static_assert(offsetof(power_regs, wait_time) == 0x24, "");
#define POWER_ON_TIME_VALUE_SHIFT 0
#define POWER_ON_TIME_VALUE_MASK 0x000fffffu
#define POWER_OFF_TIME_VALUE_SHIFT 0
#define POWER_OFF_TIME_VALUE_MASK 0x000fffffu
#define POWER_LEVEL_VALUE_SHIFT 0
#define POWER_LEVEL_VALUE_MASK 0x0000003fu
#define POWER_SENSE_ON_VALUE_SHIFT 0
#define POWER_SENSE_ON_VALUE_MASK 0x0000ffffu
#define POWER_SENSE_OFF_VALUE_SHIFT 0
#define POWER_SENSE_OFF_VALUE_MASK 0x0000ffffu
#define POWER_CONTROL_MACHINING_SHIFT 0
#define POWER_CONTROL_MACHINING_MASK 0x00000001u
#define POWER_CONTROL_CUT_SHIFT 1
#define POWER_CONTROL_CUT_MASK 0x00000002u
#define POWER_OFF_EXTRA_VALUE_SHIFT 0
#define POWER_OFF_EXTRA_VALUE_MASK 0x000fffffu
#define POWER_SUPPLY_VOLTAGE_SHIFT 0
#define POWER_SUPPLY_VOLTAGE_MASK 0x0000000fu
#define POWER_SUPPLY_NEGATIVE_SHIFT 4
#define POWER_SUPPLY_NEGATIVE_MASK 0x00000010u
#define POWER_LIMITS_LEVEL_SHIFT 0
#define POWER_LIMITS_LEVEL_MASK 0x0000003fu
#define POWER_LIMITS_OFF_SHIFT 6
#define POWER_LIMITS_OFF_MASK 0x03ffffc0u
#define POWER_WAIT_TIME_VALUE_SHIFT 0
#define POWER_WAIT_TIME_VALUE_MASK 0x000fffffu
#define POWER ((power_regs *)0x80000700u)

/* Interlock and watchdog; see ``rtl.safety``. */
typedef volatile struct {
    const uint32_t live; /* Causes present now. By bit: 0 `power_on`, nobody has cleared the interlock since power-on; 1 `estop`, emergency stop; 2 `drive_fault`, a drive reports a fault; 3 `limit_low`, an axis is on its lower limit switch; 4 `limit_high`, an axis is on its upper limit switch; 5 `fluid_low`, the fluid is below its level; 6 `watchdog`, the firmware stopped calling the watchdog; 7 `error_saturated`, a deviation counter reached its limit; 8 `encoder`, an encoder made an illegal transition; 9 `following_stopped`, position deviation at rest above its limit; 10 `following_moving`, position deviation in motion above its limit; 11 `firmware`, the firmware has tripped it; 12 `coder`, a coder does not show the motion of its axis; 13 `travel`, a command beyond a soft limit; 14 `contact`, the electrode touched the work with the discharge off; 15 `gate`, the gap had current or voltage with both sources off; 16 `memory`, the processor's memory read wrong; 17 `guard`, a guarded register of the gateware is damaged. */
    const uint32_t latched; /* Causes since the interlock was cleared, by the same bits. */
    const uint32_t status; /* State of the interlock. */
    uint32_t pet; /* Watchdog call: ``0xA5`` at the start of a step of the main loop, ``0x5A`` at its end, ``0xC3`` from the handler of interrupt 1. */
    uint32_t clear; /* Operator's acknowledgement ``0x5A``: clears causes that are no longer present. */
    uint32_t stop; /* Trip the interlock (cause ``firmware``). */
    uint32_t fluid; /* Fluid supervision. */
    const uint32_t period; /* Longest time between two watchdog calls. [clock] */
    const uint32_t arming; /* Permission to discharge; see ``rtl.safety.arming``. */
    uint32_t disarm; /* Open the main contactor until the button is pressed again. */
    uint32_t leave; /* Operator's order ``0x5A`` to leave the pressed limit switches. Only while safe. They then do not trip until they are released, another cause comes, or a pulse would go further onto one of them. Meanwhile there is no discharge, and motion is slow. */
    const uint32_t limits; /* Limit switches, debounced. */
    const uint32_t damage; /* Damage that cause ``guard`` has found since the interlock was cleared. */
    const uint32_t watch; /* State of the watchdog; see ``rtl.safety.watchdog``. */
    const uint32_t inputs; /* Levels of the machine's inputs, not debounced; 1: active. For whoever checks the wires. */
} safety_regs;
_Static_assert(offsetof(safety_regs, live) == 0x0, "");
_Static_assert(offsetof(safety_regs, latched) == 0x4, "");
_Static_assert(offsetof(safety_regs, status) == 0x8, "");
_Static_assert(offsetof(safety_regs, pet) == 0xc, "");
_Static_assert(offsetof(safety_regs, clear) == 0x10, "");
_Static_assert(offsetof(safety_regs, stop) == 0x14, "");
_Static_assert(offsetof(safety_regs, fluid) == 0x18, "");
_Static_assert(offsetof(safety_regs, period) == 0x1c, "");
_Static_assert(offsetof(safety_regs, arming) == 0x20, "");
_Static_assert(offsetof(safety_regs, disarm) == 0x24, "");
_Static_assert(offsetof(safety_regs, leave) == 0x28, "");
_Static_assert(offsetof(safety_regs, limits) == 0x2c, "");
_Static_assert(offsetof(safety_regs, damage) == 0x30, "");
_Static_assert(offsetof(safety_regs, watch) == 0x34, "");
_Static_assert(offsetof(safety_regs, inputs) == 0x38, "");
#define SAFETY_LIVE_VALUE_SHIFT 0
#define SAFETY_LIVE_VALUE_MASK 0x0003ffffu
#define SAFETY_LATCHED_VALUE_SHIFT 0
#define SAFETY_LATCHED_VALUE_MASK 0x0003ffffu
#define SAFETY_STATUS_SAFE_SHIFT 0
#define SAFETY_STATUS_SAFE_MASK 0x00000001u
#define SAFETY_STATUS_FIRST_SHIFT 1
#define SAFETY_STATUS_FIRST_MASK 0x0000003eu
#define SAFETY_STATUS_SIMULTANEOUS_SHIFT 6
#define SAFETY_STATUS_SIMULTANEOUS_MASK 0x00ffffc0u
#define SAFETY_STATUS_BLAMED_SHIFT 24
#define SAFETY_STATUS_BLAMED_MASK 0x07000000u
#define SAFETY_PET_VALUE_SHIFT 0
#define SAFETY_PET_VALUE_MASK 0x000000ffu
#define SAFETY_CLEAR_VALUE_SHIFT 0
#define SAFETY_CLEAR_VALUE_MASK 0x000000ffu
#define SAFETY_STOP_VALUE_SHIFT 0
#define SAFETY_STOP_VALUE_MASK 0x00000001u
#define SAFETY_FLUID_REQUIRED_SHIFT 0
#define SAFETY_FLUID_REQUIRED_MASK 0x00000001u
#define SAFETY_ARMING_CONTACTOR_SHIFT 0
#define SAFETY_ARMING_CONTACTOR_MASK 0x00000001u
#define SAFETY_ARMING_ARMED_SHIFT 1
#define SAFETY_ARMING_ARMED_MASK 0x00000002u
#define SAFETY_ARMING_PRESSED_SHIFT 2
#define SAFETY_ARMING_PRESSED_MASK 0x00000004u
#define SAFETY_DISARM_VALUE_SHIFT 0
#define SAFETY_DISARM_VALUE_MASK 0x00000001u
#define SAFETY_LEAVE_VALUE_SHIFT 0
#define SAFETY_LEAVE_VALUE_MASK 0x000000ffu
#define SAFETY_LIMITS_LOW_SHIFT 0
#define SAFETY_LIMITS_LOW_MASK 0x00000007u
#define SAFETY_LIMITS_HIGH_SHIFT 3
#define SAFETY_LIMITS_HIGH_MASK 0x00000038u
#define SAFETY_LIMITS_LEAVING_SHIFT 6
#define SAFETY_LIMITS_LEAVING_MASK 0x00000040u
#define SAFETY_DAMAGE_AXES_SHIFT 0
#define SAFETY_DAMAGE_AXES_MASK 0x00000007u
#define SAFETY_DAMAGE_WORD_SHIFT 3
#define SAFETY_DAMAGE_WORD_MASK 0x00000008u
#define SAFETY_DAMAGE_SEGMENT_SHIFT 4
#define SAFETY_DAMAGE_SEGMENT_MASK 0x00000010u
#define SAFETY_DAMAGE_PLACE_SHIFT 5
#define SAFETY_DAMAGE_PLACE_MASK 0x00000020u
#define SAFETY_DAMAGE_PULSES_SHIFT 6
#define SAFETY_DAMAGE_PULSES_MASK 0x00000040u
#define SAFETY_DAMAGE_SETTINGS_SHIFT 7
#define SAFETY_DAMAGE_SETTINGS_MASK 0x00000380u
#define SAFETY_DAMAGE_FLUID_SHIFT 10
#define SAFETY_DAMAGE_FLUID_MASK 0x00000400u
#define SAFETY_DAMAGE_RATE_SHIFT 11
#define SAFETY_DAMAGE_RATE_MASK 0x00000800u
#define SAFETY_DAMAGE_LATCH_SHIFT 12
#define SAFETY_DAMAGE_LATCH_MASK 0x00001000u
#define SAFETY_WATCH_ASKED_SHIFT 0
#define SAFETY_WATCH_ASKED_MASK 0x00000001u
#define SAFETY_WATCH_OPEN_SHIFT 1
#define SAFETY_WATCH_OPEN_MASK 0x00000002u
#define SAFETY_INPUTS_ESTOP_SHIFT 0
#define SAFETY_INPUTS_ESTOP_MASK 0x00000001u
#define SAFETY_INPUTS_DRIVE_FAULT_SHIFT 1
#define SAFETY_INPUTS_DRIVE_FAULT_MASK 0x0000000eu
#define SAFETY_INPUTS_LIMIT_LOW_SHIFT 4
#define SAFETY_INPUTS_LIMIT_LOW_MASK 0x00000070u
#define SAFETY_INPUTS_LIMIT_HIGH_SHIFT 7
#define SAFETY_INPUTS_LIMIT_HIGH_MASK 0x00000380u
#define SAFETY_INPUTS_FLUID_LOW_SHIFT 10
#define SAFETY_INPUTS_FLUID_LOW_MASK 0x00000400u
#define SAFETY_INPUTS_FIN_SHIFT 11
#define SAFETY_INPUTS_FIN_MASK 0x00000800u
#define SAFETY_INPUTS_ARM_SHIFT 12
#define SAFETY_INPUTS_ARM_MASK 0x00001000u
#define SAFETY_INPUTS_ENC_A_SHIFT 13
#define SAFETY_INPUTS_ENC_A_MASK 0x0000e000u
#define SAFETY_INPUTS_ENC_B_SHIFT 16
#define SAFETY_INPUTS_ENC_B_MASK 0x00070000u
#define SAFETY_INPUTS_GAP_HIGH_SHIFT 19
#define SAFETY_INPUTS_GAP_HIGH_MASK 0x00080000u
#define SAFETY_INPUTS_GAP_ARC_SHIFT 20
#define SAFETY_INPUTS_GAP_ARC_MASK 0x00100000u
#define SAFETY_INPUTS_GAP_SHORT_SHIFT 21
#define SAFETY_INPUTS_GAP_SHORT_MASK 0x00200000u
#define SAFETY_INPUTS_GAP_CURRENT_SHIFT 22
#define SAFETY_INPUTS_GAP_CURRENT_MASK 0x00400000u
#define SAFETY_INPUTS_GAP_NOISE_SHIFT 23
#define SAFETY_INPUTS_GAP_NOISE_MASK 0x00800000u
#define SAFETY_INPUTS_ADC_DATA_SHIFT 24
#define SAFETY_INPUTS_ADC_DATA_MASK 0x01000000u
#define SAFETY_INPUTS_ENC_INDEX_SHIFT 25
#define SAFETY_INPUTS_ENC_INDEX_MASK 0x0e000000u
#define SAFETY ((safety_regs *)0x80000800u)

/* M, S and T functions of the machine side. */
typedef volatile struct {
    uint32_t send; /* Send a function. */
    uint32_t timeout; /* Longest wait for each edge of FIN. [clock] */
    uint32_t status; /* State of the handshake. */
} auxiliary_regs;
_Static_assert(offsetof(auxiliary_regs, send) == 0x0, "");
_Static_assert(offsetof(auxiliary_regs, timeout) == 0x4, "");
_Static_assert(offsetof(auxiliary_regs, status) == 0x8, "");
#define AUXILIARY_SEND_CODE_SHIFT 0
#define AUXILIARY_SEND_CODE_MASK 0x0000ffffu
#define AUXILIARY_SEND_LETTER_SHIFT 16
#define AUXILIARY_SEND_LETTER_MASK 0x00030000u
#define AUXILIARY_STATUS_BUSY_SHIFT 0
#define AUXILIARY_STATUS_BUSY_MASK 0x00000001u
#define AUXILIARY_STATUS_TIMED_OUT_SHIFT 1
#define AUXILIARY_STATUS_TIMED_OUT_MASK 0x00000002u
#define AUXILIARY ((auxiliary_regs *)0x80000900u)

/* One axis. */
typedef volatile struct {
    const int32_t command; /* Commanded position: sum of the axis pulses Pi. [pulse] */
    const int32_t position; /* Position: sum of the feedback pulses FP. [pulse] */
    const int32_t error; /* Reversible error counter Er. [pulse] */
    const uint32_t overshoot; /* Furthest travel beyond the last mark (end of a retraction). [pulse] */
    uint32_t follow_stopped; /* Following error allowed at rest. [pulse] */
    uint32_t follow_moving; /* Following error allowed in motion. [pulse] */
    uint32_t window; /* Following error up to which the axis is in position. [pulse] */
    uint32_t mode; /* Output of the axis. */
    uint32_t step_time; /* Shape of step pulses. */
    uint32_t adopt; /* Take the position as command, clear Er and the faults. Only while safe. */
    const uint32_t status; /* Faults. */
    int32_t low; /* Lower soft limit: no command goes below it. [pulse] */
    int32_t high; /* Upper soft limit. [pulse] */
    uint32_t model; /* What the axis knows of its drive. */
    uint32_t gear; /* Electronic gear: n steps of the output, or n edges of the coder, for m pulses. Writing it begins the count anew; see ``rtl.motion.gear`` and ``rtl.motion.coder_gear``. */
    uint32_t backlash; /* Compensation of backlash. After writing it the axis counts as having come up, and ``taken_up`` is 0; see ``rtl.motion.backlash``. */
} axis_regs;
_Static_assert(offsetof(axis_regs, command) == 0x0, "");
_Static_assert(offsetof(axis_regs, position) == 0x4, "");
_Static_assert(offsetof(axis_regs, error) == 0x8, "");
_Static_assert(offsetof(axis_regs, overshoot) == 0xc, "");
_Static_assert(offsetof(axis_regs, follow_stopped) == 0x10, "");
_Static_assert(offsetof(axis_regs, follow_moving) == 0x14, "");
_Static_assert(offsetof(axis_regs, window) == 0x18, "");
_Static_assert(offsetof(axis_regs, mode) == 0x1c, "");
_Static_assert(offsetof(axis_regs, step_time) == 0x20, "");
_Static_assert(offsetof(axis_regs, adopt) == 0x24, "");
_Static_assert(offsetof(axis_regs, status) == 0x28, "");
_Static_assert(offsetof(axis_regs, low) == 0x2c, "");
_Static_assert(offsetof(axis_regs, high) == 0x30, "");
_Static_assert(offsetof(axis_regs, model) == 0x34, "");
_Static_assert(offsetof(axis_regs, gear) == 0x38, "");
_Static_assert(offsetof(axis_regs, backlash) == 0x3c, "");
#define AXIS_FOLLOW_STOPPED_VALUE_SHIFT 0
#define AXIS_FOLLOW_STOPPED_VALUE_MASK 0x0003ffffu
#define AXIS_FOLLOW_MOVING_VALUE_SHIFT 0
#define AXIS_FOLLOW_MOVING_VALUE_MASK 0x0003ffffu
#define AXIS_WINDOW_VALUE_SHIFT 0
#define AXIS_WINDOW_VALUE_MASK 0x00000fffu
#define AXIS_MODE_STEP_SHIFT 0
#define AXIS_MODE_STEP_MASK 0x00000001u
#define AXIS_MODE_REVERSE_SHIFT 1
#define AXIS_MODE_REVERSE_MASK 0x00000002u
#define AXIS_MODE_SWAP_SHIFT 2
#define AXIS_MODE_SWAP_MASK 0x00000004u
#define AXIS_MODE_OFFSET_SHIFT 3
#define AXIS_MODE_OFFSET_MASK 0x00007ff8u
#define AXIS_MODE_FRICTION_SHIFT 15
#define AXIS_MODE_FRICTION_MASK 0x007f8000u
#define AXIS_STEP_TIME_WIDTH_SHIFT 0
#define AXIS_STEP_TIME_WIDTH_MASK 0x000000ffu
#define AXIS_STEP_TIME_SPACE_SHIFT 8
#define AXIS_STEP_TIME_SPACE_MASK 0x0000ff00u
#define AXIS_STEP_TIME_SETUP_SHIFT 16
#define AXIS_STEP_TIME_SETUP_MASK 0x00ff0000u
#define AXIS_ADOPT_VALUE_SHIFT 0
#define AXIS_ADOPT_VALUE_MASK 0x00000001u
#define AXIS_STATUS_SATURATED_SHIFT 0
#define AXIS_STATUS_SATURATED_MASK 0x00000001u
#define AXIS_STATUS_ILLEGAL_SHIFT 1
#define AXIS_STATUS_ILLEGAL_MASK 0x00000002u
#define AXIS_STATUS_CHECK_SHIFT 2
#define AXIS_STATUS_CHECK_MASK 0x0000001cu
#define AXIS_STATUS_BEYOND_LOW_SHIFT 5
#define AXIS_STATUS_BEYOND_LOW_MASK 0x00000020u
#define AXIS_STATUS_BEYOND_HIGH_SHIFT 6
#define AXIS_STATUS_BEYOND_HIGH_MASK 0x00000040u
#define AXIS_MODEL_GAIN_SHIFT 0
#define AXIS_MODEL_GAIN_MASK 0x00003fffu
#define AXIS_MODEL_LAG_SHIFT 14
#define AXIS_MODEL_LAG_MASK 0x07ffc000u
#define AXIS_GEAR_STEPS_SHIFT 0
#define AXIS_GEAR_STEPS_MASK 0x0000ffffu
#define AXIS_GEAR_SURPLUS_SHIFT 16
#define AXIS_GEAR_SURPLUS_MASK 0xffff0000u
#define AXIS_BACKLASH_SIZE_SHIFT 0
#define AXIS_BACKLASH_SIZE_MASK 0x00001fffu
#define AXIS_BACKLASH_TAKEN_UP_SHIFT 13
#define AXIS_BACKLASH_TAKEN_UP_MASK 0x0fffe000u
#define AXIS(i) ((axis_regs *)(0x80000a00u + 0x40u * (i)))

/* Error of the screws' pitch at the places of the axes; see ``rtl.motion.backlash``. */
typedef volatile struct {
    uint32_t x; /* How far the screw takes X too far up. [pulse] */
    uint32_t y; /* How far the screw takes Y too far up. [pulse] */
    uint32_t z; /* How far the screw takes Z too far up. [pulse] */
} pitch_regs;
_Static_assert(offsetof(pitch_regs, x) == 0x0, "");
_Static_assert(offsetof(pitch_regs, y) == 0x4, "");
_Static_assert(offsetof(pitch_regs, z) == 0x8, "");
#define PITCH_X_VALUE_SHIFT 0
#define PITCH_X_VALUE_MASK 0x00001fffu
#define PITCH_Y_VALUE_SHIFT 0
#define PITCH_Y_VALUE_MASK 0x00001fffu
#define PITCH_Z_VALUE_SHIFT 0
#define PITCH_Z_VALUE_MASK 0x00001fffu
#define PITCH ((pitch_regs *)0x80000ac0u)

/* The machining condition in force. Its words, staged in the registers that ``rtl.power.condition`` names, come into force together, between two pulses. They may not change while ``pending``. See ``rtl.power.condition_switch``. */
typedef volatile struct {
    uint32_t order; /* Orders to the switch. */
    int32_t depth; /* Put the staged words in force when the jump axis has reached this depth; arms. [pulse] */
    uint32_t settle; /* Shortest wait for power supply and comparators; see ``rtl.power.settling``. [clock] */
    const uint32_t status; /* State of the switch. */
} condition_regs;
_Static_assert(offsetof(condition_regs, order) == 0x0, "");
_Static_assert(offsetof(condition_regs, depth) == 0x4, "");
_Static_assert(offsetof(condition_regs, settle) == 0x8, "");
_Static_assert(offsetof(condition_regs, status) == 0xc, "");
#define CONDITION_ORDER_COMMIT_SHIFT 0
#define CONDITION_ORDER_COMMIT_MASK 0x00000001u
#define CONDITION_ORDER_DISARM_SHIFT 1
#define CONDITION_ORDER_DISARM_MASK 0x00000002u
#define CONDITION_ORDER_RESTART_SHIFT 2
#define CONDITION_ORDER_RESTART_MASK 0x00000004u
#define CONDITION_SETTLE_VALUE_SHIFT 0
#define CONDITION_SETTLE_VALUE_MASK 0x00ffffffu
#define CONDITION_STATUS_ARMED_SHIFT 0
#define CONDITION_STATUS_ARMED_MASK 0x00000001u
#define CONDITION_STATUS_PENDING_SHIFT 1
#define CONDITION_STATUS_PENDING_MASK 0x00000002u
#define CONDITION_STATUS_COUNT_SHIFT 2
#define CONDITION_STATUS_COUNT_MASK 0x000003fcu
#define CONDITION_STATUS_SETTLED_SHIFT 10
#define CONDITION_STATUS_SETTLED_MASK 0x00000400u
#define CONDITION ((condition_regs *)0x80000b00u)

/* The gap oscilloscope; see ``rtl.gap.scope``. The trigger and ``after`` may change only while it does not run. */
typedef volatile struct {
    uint32_t order; /* Orders to it. */
    uint32_t trigger; /* What is waited for. */
    uint32_t after; /* Entries that follow the trigger's, less than ``depth``. */
    const uint32_t status; /* State of it. */
    const uint32_t depth; /* Size of the ring; 0: this build has no oscilloscope. */
    const uint32_t time; /* Clock count in the clock after the trigger's. [clock] */
    uint32_t place; /* Choose an entry to be read, 0 for the oldest. */
    const uint32_t entry; /* The chosen entry. */
    const uint32_t entry_rest; /* The rest of the chosen entry. Reading it chooses the next entry. */
} scope_regs;
_Static_assert(offsetof(scope_regs, order) == 0x0, "");
_Static_assert(offsetof(scope_regs, trigger) == 0x4, "");
_Static_assert(offsetof(scope_regs, after) == 0x8, "");
_Static_assert(offsetof(scope_regs, status) == 0xc, "");
_Static_assert(offsetof(scope_regs, depth) == 0x10, "");
_Static_assert(offsetof(scope_regs, time) == 0x14, "");
_Static_assert(offsetof(scope_regs, place) == 0x18, "");
_Static_assert(offsetof(scope_regs, entry) == 0x1c, "");
_Static_assert(offsetof(scope_regs, entry_rest) == 0x20, "");
#define SCOPE_ORDER_ARM_SHIFT 0
#define SCOPE_ORDER_ARM_MASK 0x00000001u
#define SCOPE_ORDER_STOP_SHIFT 1
#define SCOPE_ORDER_STOP_MASK 0x00000002u
#define SCOPE_ORDER_FORCE_SHIFT 2
#define SCOPE_ORDER_FORCE_MASK 0x00000004u
#define SCOPE_TRIGGER_SOURCE_SHIFT 0
#define SCOPE_TRIGGER_SOURCE_MASK 0x00000007u
#define SCOPE_TRIGGER_CLASSES_SHIFT 3
#define SCOPE_TRIGGER_CLASSES_MASK 0x000001f8u
#define SCOPE_TRIGGER_LEVEL_SHIFT 9
#define SCOPE_TRIGGER_LEVEL_MASK 0x001ffe00u
#define SCOPE_AFTER_VALUE_SHIFT 0
#define SCOPE_AFTER_VALUE_MASK 0x0000ffffu
#define SCOPE_STATUS_RECORDING_SHIFT 0
#define SCOPE_STATUS_RECORDING_MASK 0x00000003u
#define SCOPE_STATUS_COUNT_SHIFT 2
#define SCOPE_STATUS_COUNT_MASK 0x0003fffcu
#define SCOPE_DEPTH_VALUE_SHIFT 0
#define SCOPE_DEPTH_VALUE_MASK 0x0000ffffu
#define SCOPE_PLACE_VALUE_SHIFT 0
#define SCOPE_PLACE_VALUE_MASK 0x0000ffffu
#define SCOPE_ENTRY_STAMP_SHIFT 0
#define SCOPE_ENTRY_STAMP_MASK 0x000001ffu
#define SCOPE_ENTRY_VOLTAGE_SHIFT 9
#define SCOPE_ENTRY_VOLTAGE_MASK 0x001ffe00u
#define SCOPE_ENTRY_SAMPLED_SHIFT 21
#define SCOPE_ENTRY_SAMPLED_MASK 0x00200000u
#define SCOPE_ENTRY_HIGH_SHIFT 22
#define SCOPE_ENTRY_HIGH_MASK 0x00400000u
#define SCOPE_ENTRY_ARC_SHIFT 23
#define SCOPE_ENTRY_ARC_MASK 0x00800000u
#define SCOPE_ENTRY_SHORT_SHIFT 24
#define SCOPE_ENTRY_SHORT_MASK 0x01000000u
#define SCOPE_ENTRY_CURRENT_SHIFT 25
#define SCOPE_ENTRY_CURRENT_MASK 0x02000000u
#define SCOPE_ENTRY_NOISE_SHIFT 26
#define SCOPE_ENTRY_NOISE_MASK 0x04000000u
#define SCOPE_ENTRY_ON_SHIFT 27
#define SCOPE_ENTRY_ON_MASK 0x08000000u
#define SCOPE_ENTRY_SENSE_SHIFT 28
#define SCOPE_ENTRY_SENSE_MASK 0x10000000u
#define SCOPE_ENTRY_PULSE_SHIFT 29
#define SCOPE_ENTRY_PULSE_MASK 0xe0000000u
#define SCOPE_ENTRY_REST_SHORTED_SHIFT 0
#define SCOPE_ENTRY_REST_SHORTED_MASK 0x00000001u
#define SCOPE_ENTRY_REST_STATE_SHIFT 1
#define SCOPE_ENTRY_REST_STATE_MASK 0x0000000eu
#define SCOPE ((scope_regs *)0x80000b80u)

/* Gap servo by counted pulses; see ``rtl.gap.preset_counter`` and ``rtl.motion.retraction``. */
typedef volatile struct {
    uint32_t control; /* The servo. */
    uint32_t presets; /* Presets of the counters, 0 for off. */
    uint32_t counting; /* How pulses are counted; see ``rtl.gap.preset_counter``. */
    uint32_t period; /* Period of the time device; 0 for no strobes. [clock] */
    uint32_t step; /* Length of a step by UP or DOWN. [pulse] */
    const uint32_t ups; /* Number of UP since reset. */
    const uint32_t downs; /* Number of DOWN since reset. */
    const uint32_t status; /* State of the counters. */
} servo_regs;
_Static_assert(offsetof(servo_regs, control) == 0x0, "");
_Static_assert(offsetof(servo_regs, presets) == 0x4, "");
_Static_assert(offsetof(servo_regs, counting) == 0x8, "");
_Static_assert(offsetof(servo_regs, period) == 0xc, "");
_Static_assert(offsetof(servo_regs, step) == 0x10, "");
_Static_assert(offsetof(servo_regs, ups) == 0x14, "");
_Static_assert(offsetof(servo_regs, downs) == 0x18, "");
_Static_assert(offsetof(servo_regs, status) == 0x1c, "");
#define SERVO_CONTROL_VALUE_SHIFT 0
#define SERVO_CONTROL_VALUE_MASK 0x00000001u
#define SERVO_PRESETS_DAME_SHIFT 0
#define SERVO_PRESETS_DAME_MASK 0x000000ffu
#define SERVO_PRESETS_OPEN_SHIFT 8
#define SERVO_PRESETS_OPEN_MASK 0x0000ff00u
#define SERVO_PRESETS_OK_SHIFT 16
#define SERVO_PRESETS_OK_MASK 0x00ff0000u
#define SERVO_COUNTING_WINDOW_SHIFT 0
#define SERVO_COUNTING_WINDOW_MASK 0x000000ffu
#define SERVO_COUNTING_WEIGHT_SHIFT 8
#define SERVO_COUNTING_WEIGHT_MASK 0x00000f00u
#define SERVO_COUNTING_MODE_SHIFT 12
#define SERVO_COUNTING_MODE_MASK 0x00007000u
#define SERVO_PERIOD_VALUE_SHIFT 0
#define SERVO_PERIOD_VALUE_MASK 0x00ffffffu
#define SERVO_STEP_VALUE_SHIFT 0
#define SERVO_STEP_VALUE_MASK 0x0000ffffu
#define SERVO_STATUS_DAME_SHIFT 0
#define SERVO_STATUS_DAME_MASK 0x00000001u
#define SERVO_STATUS_OPEN_SHIFT 1
#define SERVO_STATUS_OPEN_MASK 0x00000002u
#define SERVO_STATUS_HELD_SHIFT 2
#define SERVO_STATUS_HELD_MASK 0x00000004u
#define SERVO ((servo_regs *)0x80000d00u)

/* Converter and fluid detector; see ``rtl.gap.sampler`` and ``rtl.gap.fluid``. Settings may change at any time; the next average uses them. */
typedef volatile struct {
    uint32_t control; /* The detector. */
    uint32_t threshold_0; /* Threshold between the classes 0 and 1. */
    uint32_t threshold_1; /* Threshold between the classes 1 and 2. */
    uint32_t threshold_2; /* Threshold between the classes 2 and 3. */
    uint32_t hysteresis; /* Hysteresis on either side of a threshold. */
    uint32_t bounds; /* Range of codes of a sound cell, inclusive. */
    const uint32_t level; /* Last average of the cell. */
    const uint32_t voltage; /* Last sample of the gap voltage. */
    const uint32_t status; /* Results of the detector. */
} fluid_regs;
_Static_assert(offsetof(fluid_regs, control) == 0x0, "");
_Static_assert(offsetof(fluid_regs, threshold_0) == 0x4, "");
_Static_assert(offsetof(fluid_regs, threshold_1) == 0x8, "");
_Static_assert(offsetof(fluid_regs, threshold_2) == 0xc, "");
_Static_assert(offsetof(fluid_regs, hysteresis) == 0x10, "");
_Static_assert(offsetof(fluid_regs, bounds) == 0x14, "");
_Static_assert(offsetof(fluid_regs, level) == 0x18, "");
_Static_assert(offsetof(fluid_regs, voltage) == 0x1c, "");
_Static_assert(offsetof(fluid_regs, status) == 0x20, "");
#define FLUID_CONTROL_CONVERT_SHIFT 0
#define FLUID_CONTROL_CONVERT_MASK 0x00000001u
#define FLUID_CONTROL_MANUAL_SHIFT 1
#define FLUID_CONTROL_MANUAL_MASK 0x00000002u
#define FLUID_CONTROL_MANUAL_CLASS_SHIFT 2
#define FLUID_CONTROL_MANUAL_CLASS_MASK 0x0000000cu
#define FLUID_THRESHOLD_0_VALUE_SHIFT 0
#define FLUID_THRESHOLD_0_VALUE_MASK 0x00000fffu
#define FLUID_THRESHOLD_1_VALUE_SHIFT 0
#define FLUID_THRESHOLD_1_VALUE_MASK 0x00000fffu
#define FLUID_THRESHOLD_2_VALUE_SHIFT 0
#define FLUID_THRESHOLD_2_VALUE_MASK 0x00000fffu
#define FLUID_HYSTERESIS_VALUE_SHIFT 0
#define FLUID_HYSTERESIS_VALUE_MASK 0x000000ffu
#define FLUID_BOUNDS_LOWEST_SHIFT 0
#define FLUID_BOUNDS_LOWEST_MASK 0x00000fffu
#define FLUID_BOUNDS_HIGHEST_SHIFT 12
#define FLUID_BOUNDS_HIGHEST_MASK 0x00fff000u
#define FLUID_LEVEL_VALUE_SHIFT 0
#define FLUID_LEVEL_VALUE_MASK 0x00000fffu
#define FLUID_VOLTAGE_VALUE_SHIFT 0
#define FLUID_VOLTAGE_VALUE_MASK 0x00000fffu
#define FLUID_STATUS_CLASS_SHIFT 0
#define FLUID_STATUS_CLASS_MASK 0x00000003u
#define FLUID_STATUS_MEASURED_SHIFT 2
#define FLUID_STATUS_MEASURED_MASK 0x0000000cu
#define FLUID_STATUS_KNOWN_SHIFT 4
#define FLUID_STATUS_KNOWN_MASK 0x00000010u
#define FLUID_STATUS_BROKEN_LOW_SHIFT 5
#define FLUID_STATUS_BROKEN_LOW_MASK 0x00000020u
#define FLUID_STATUS_BROKEN_HIGH_SHIFT 6
#define FLUID_STATUS_BROKEN_HIGH_MASK 0x00000040u
#define FLUID_STATUS_DISORDERED_SHIFT 7
#define FLUID_STATUS_DISORDERED_MASK 0x00000080u
#define FLUID_STATUS_FAULT_SHIFT 8
#define FLUID_STATUS_FAULT_MASK 0x00000100u
#define FLUID ((fluid_regs *)0x80000e00u)

/* Feed by the mean gap voltage; see ``rtl.gap.removal`` and ``rtl.gap.feed_mode``. The converter has to run. */
typedef volatile struct {
    uint32_t control; /* The feed mode, and the measurement that it needs. */
    uint32_t unit; /* Unit distance; 0 for none. [pulse] */
    uint32_t window; /* Longest time of a mean; 0 for no bound. [clock] */
    uint32_t no_load; /* Mean voltage without discharges. [2**-16 full scale] */
    uint32_t reference; /* References of the condition. */
    uint32_t share; /* Es of G95 P5, a share of the time. [2**-16] */
    uint32_t least; /* Lowest Ex; a lower one counts as it. [2**-16 full scale] */
    uint32_t bounds; /* Bounds of Es/Ex. */
    uint32_t gain; /* K of feed modes 1 and 2. [2**-32 pulse/clock per 1/16 full scale] */
    uint32_t highest; /* Highest feed of feed modes 2 and 3. [2**-32 pulse/clock] */
    const uint32_t voltage; /* Last measurement. */
    const uint32_t status; /* Result of the last measurement. */
    const uint32_t in_force; /* Feed at the front in force. [2**-32 pulse/clock] */
} feed_regs;
_Static_assert(offsetof(feed_regs, control) == 0x0, "");
_Static_assert(offsetof(feed_regs, unit) == 0x4, "");
_Static_assert(offsetof(feed_regs, window) == 0x8, "");
_Static_assert(offsetof(feed_regs, no_load) == 0xc, "");
_Static_assert(offsetof(feed_regs, reference) == 0x10, "");
_Static_assert(offsetof(feed_regs, share) == 0x14, "");
_Static_assert(offsetof(feed_regs, least) == 0x18, "");
_Static_assert(offsetof(feed_regs, bounds) == 0x1c, "");
_Static_assert(offsetof(feed_regs, gain) == 0x20, "");
_Static_assert(offsetof(feed_regs, highest) == 0x24, "");
_Static_assert(offsetof(feed_regs, voltage) == 0x28, "");
_Static_assert(offsetof(feed_regs, status) == 0x2c, "");
_Static_assert(offsetof(feed_regs, in_force) == 0x30, "");
#define FEED_CONTROL_MODE_SHIFT 0
#define FEED_CONTROL_MODE_MASK 0x00000003u
#define FEED_CONTROL_MEASURE_SHIFT 2
#define FEED_CONTROL_MEASURE_MASK 0x00000004u
#define FEED_CONTROL_SHARES_SHIFT 3
#define FEED_CONTROL_SHARES_MASK 0x00000008u
#define FEED_UNIT_VALUE_SHIFT 0
#define FEED_UNIT_VALUE_MASK 0x0000ffffu
#define FEED_NO_LOAD_VALUE_SHIFT 0
#define FEED_NO_LOAD_VALUE_MASK 0x0000ffffu
#define FEED_REFERENCE_VOLTAGE_SHIFT 0
#define FEED_REFERENCE_VOLTAGE_MASK 0x0000ffffu
#define FEED_REFERENCE_DROP_SHIFT 16
#define FEED_REFERENCE_DROP_MASK 0xffff0000u
#define FEED_SHARE_VALUE_SHIFT 0
#define FEED_SHARE_VALUE_MASK 0x0000ffffu
#define FEED_LEAST_VALUE_SHIFT 0
#define FEED_LEAST_VALUE_MASK 0x0000ffffu
#define FEED_BOUNDS_LOWEST_SHIFT 0
#define FEED_BOUNDS_LOWEST_MASK 0x0000ffffu
#define FEED_BOUNDS_HIGHEST_SHIFT 16
#define FEED_BOUNDS_HIGHEST_MASK 0xffff0000u
#define FEED_GAIN_VALUE_SHIFT 0
#define FEED_GAIN_VALUE_MASK 0x3fffffffu
#define FEED_HIGHEST_VALUE_SHIFT 0
#define FEED_HIGHEST_VALUE_MASK 0x3fffffffu
#define FEED_VOLTAGE_MEAN_SHIFT 0
#define FEED_VOLTAGE_MEAN_MASK 0x0000ffffu
#define FEED_VOLTAGE_DROP_SHIFT 16
#define FEED_VOLTAGE_DROP_MASK 0xffff0000u
#define FEED_STATUS_RATIO_SHIFT 0
#define FEED_STATUS_RATIO_MASK 0x0000ffffu
#define FEED_STATUS_WINDOWS_SHIFT 16
#define FEED_STATUS_WINDOWS_MASK 0x00ff0000u
#define FEED_STATUS_KNOWN_SHIFT 24
#define FEED_STATUS_KNOWN_MASK 0x01000000u
#define FEED_IN_FORCE_VALUE_SHIFT 0
#define FEED_IN_FORCE_VALUE_MASK 0x3fffffffu
#define FEED ((feed_regs *)0x80000f00u)

/* Causes of the interlock, by bit of SAFETY->live and SAFETY->latched. */
#define CAUSE_POWER_ON 0
#define CAUSE_ESTOP 1
#define CAUSE_DRIVE_FAULT 2
#define CAUSE_LIMIT_LOW 3
#define CAUSE_LIMIT_HIGH 4
#define CAUSE_FLUID_LOW 5
#define CAUSE_WATCHDOG 6
#define CAUSE_ERROR_SATURATED 7
#define CAUSE_ENCODER 8
#define CAUSE_FOLLOWING_STOPPED 9
#define CAUSE_FOLLOWING_MOVING 10
#define CAUSE_FIRMWARE 11
#define CAUSE_CODER 12
#define CAUSE_TRAVEL 13
#define CAUSE_CONTACT 14
#define CAUSE_GATE 15
#define CAUSE_MEMORY 16
#define CAUSE_GUARD 17
#define CAUSES 18
#define AXES 3

/* Bytes of the link; marks by LINK->receive. */
#define REALTIME_STATUS 0x3fu
#define REALTIME_HOLD 0x21u
#define REALTIME_RESUME 0x7eu
#define REALTIME_RESET 0x18u
#define REALTIME_RETRACT 0xb0u
#define REALTIME_STOP 0x9eu
#define REALTIME_CANCEL 0x85u
#define REALTIME_DOOR 0x84u
#define REALTIME_PASSED_OVER(byte) ((byte) == 0x98u || (byte) == 0x99u || (byte) == 0x9au || (byte) == 0x9bu || (byte) == 0x9cu || (byte) == 0x9du || (byte) == 0x9fu || (byte) == 0xa0u || (byte) == 0xa1u)
#define OVERRIDE_FEED_LEAST 10
#define OVERRIDE_FEED_MOST 200
#define OVERRIDE_RAPID_LEAST 25
#define OVERRIDE_RAPID_MOST 100
#define OVERRIDE_BYTES(row) row(0x90u, feed, 100, 0) row(0x91u, feed, 0, 10) row(0x92u, feed, 0, -10) row(0x93u, feed, 0, 1) row(0x94u, feed, 0, -1) row(0x95u, rapid, 100, 0) row(0x96u, rapid, 50, 0) row(0x97u, rapid, 25, 0)
#define MARK_FRAMING 0
#define MARK_OVERRUN 1
#define MARK_RESET 2
#define FRAME_START 0x02u
#define FRAME_END 0x03u
#define FRAME_ESCAPE 0x10u
#define FRAME_FLIP 0x40u
