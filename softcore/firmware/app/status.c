// SPDX-License-Identifier: Apache-2.0
#include "app/status.h"

#include "app/auxiliary.h"
#include "app/execute.h"
#include "app/homing.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/program.h"
#include "app/walk.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/text.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "link/lines.h"
#include "link/output.h"
#include "path/path.h"
#include "roughing/commands.h"

static enum { PART_NONE, PART_PLACE, PART_FEED, PART_OURS, PART_SEND } part;

void status_init(void) { part = PART_NONE; }
void status_want(void) { part = part == PART_NONE ? PART_PLACE : part; }

bool status_idle(void) {
    return !machine_locked() && !machine_held() && meter_rests() && !machine_machining() &&
           !program_running() && !homing_active() && path_at_front() && !roughing_busy();
}

/* State names of grbl. Hold:1: the machine is still coming to rest, or retracts. */
static const char *state_name(void) {
    if (homing_active() && !machine_held())
        return "Home";
    if (machine_locked() || (machine_position_lost() && !homing_active()))
        return "Alarm";
    if (jog_active())
        return "Jog";
    if (machine_held() || program_paused())
        return meter_rests() ? "Hold:0" : "Hold:1";
    return status_idle() ? "Idle" : "Run";
}

/* Bytes that a host may send now without losing one: room in the queue of lines, less the bytes
   that wait in the gateware's queue. */
static uint32_t bytes_free(void) {
    uint32_t waiting = hal_waiting(), room = lines_free();
    room = room < STATUS_BYTES ? room : STATUS_BYTES;
    return waiting < room ? room - waiting : 0;
}

/* Letters as in grbl: P: the electrode touches; X Y Z: a limit switch is pressed. */
static void pins(char text[HAL_AXES + 6]) {
    hal_limits limits = hal_limits_read();
    bool touches = machine_burns() && hal_shorted();
    char *at = text;
    if (touches || limits.low | limits.high)
        for (const char *name = "|Pn:"; *name;)
            *at++ = *name++;
    if (touches)
        *at++ = 'P';
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        if ((limits.low | limits.high) >> axis & 1)
            *at++ = "XYZ"[axis];
    *at = '\0';
}

bool status_wanted(void) { return part != PART_NONE; }

/* Not inlined into the pass, which must stay quick. */
__attribute__((noinline)) void status_tell(void) {
    static char report[OUTPUT_LINE];
    static uint32_t length;
    static int32_t errors[HAL_AXES];
    static uint32_t number;
    int32_t places[HAL_AXES];
    uint32_t size = sizeof report - length;
    switch (part) {
    case PART_NONE: break;
    case PART_PLACE:
        /* With their places, so that all are of one moment: the sum of place and error is the
           command's place. */
        number = alarm_number();
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            places[axis] = hal_axis_position(axis), errors[axis] = hal_axis_error(axis);
        length = text_print(report, sizeof report, "<%s|MPos:%p,%p,%p|Bf:%u,%u", state_name(),
                            places[0], places[1], places[2], path_free(), bytes_free());
        part = PART_FEED;
        break;
    case PART_FEED: {
        const int32_t *offset = program_offset();
        hal_overrides override = hal_overrides_read();
        uint32_t um = meter_feed();
        bool burns = machine_burns(), fluid = auxiliary_fluid();
        char on[HAL_AXES + 6];
        pins(on);
        watch_between();
        length += text_print(report + length, size,
                             "|Ln:%u|FS:%u.%u%u%u,0%s|WCO:%p,%p,%p|Ov:%u,%u,100%s%s%s", number,
                             um / 1000, um / 100 % 10, um / 10 % 10, um % 10, on, offset[0],
                             offset[1], offset[2], (uint32_t)override.feed, (uint32_t)override.rapid,
                             burns || fluid ? "|A:" : "", burns ? "S" : "", fluid ? "F" : "");
        part = PART_OURS;
        break;
    }
    case PART_OURS: {
        uint32_t counts[4];
        char masked[SETTINGS_MASKED];
        hal_gap_counts(counts);
        settings_masked(masked, sizeof masked);
        watch_between();
        if (walk_told())
            length += text_print(report + length, size, "|Wk:%p,%p", walk_goal(), walk_distance());
        text_print(report + length, sizeof report - length, "|Er:%d,%d,%d|Rt:%u,%u|Gap:%u,%u,%u,%u%s%s%s%s%s>",
                   errors[0], errors[1], errors[2],
                   (uint32_t)hal_motion_read().state, hal_shorts(), counts[0], counts[1], counts[2],
                   counts[3], hal_armed() ? "|Armed" : "", machine_position_lost() ? "|Lost" : "",
                   *masked ? "|Off:" : "", masked, settings_short());
        part = PART_SEND;
        break;
    }
    case PART_SEND:
        output_line("%s", report);
        part = PART_NONE;
        length = 0;
    }
}

void status_tell_modes(void) {
    static const uint32_t MOTION[] = {80, 0, 1, 2, 3};
    const modal *state = execute_state();
    uint32_t um = state->feed;
    output_line("[GC:G%u G%u G%u G%u G%u G%u M%u M%u T%u F%u.%u%u%u S%u]", MOTION[state->mode],
                54 + (uint32_t)state->system, 17 + (uint32_t)state->plane, state->inch ? 20u : 21u,
                state->incremental ? 91u : 90u, state->servo ? 95u : 94u, state->machining ? 3u : 5u,
                auxiliary_fluid() ? 8u : 9u, auxiliary_last(AUXILIARY_T), um / 1000, um / 100 % 10,
                um / 10 % 10, um % 10, auxiliary_last(AUXILIARY_S));
}
