// SPDX-License-Identifier: Apache-2.0
/* The part of the model machine that keeps the values written to an axis and to the ramp, and the
   axes' check results. */
#include "hal/hal.h"
#include "pc/host.h"

static int32_t limits[HAL_AXES][2];
static uint32_t gains[HAL_AXES], lags[HAL_AXES];
static uint32_t ramp[5]; /* speed and acceleration, those of the way back, lead */
static struct {
    hal_drive drive;
    uint32_t steps, pulses, backlash, begun, step_time[3];
} drives[HAL_AXES];
static int32_t pitch[HAL_AXES];
static hal_check check_found[HAL_AXES];
static uint32_t index_armed;

void hal_axis_limits(unsigned axis, int32_t low, int32_t high) {
    limits[axis][0] = low - host_frame(axis);
    limits[axis][1] = high - host_frame(axis);
}

void hal_axis_model(unsigned axis, uint32_t gain, uint32_t lag) {
    gains[axis] = gain;
    lags[axis] = lag;
}
void hal_ramp(uint32_t start_rate, uint32_t acceleration) {
    ramp[0] = start_rate;
    ramp[1] = acceleration;
}
void hal_ramp_back(uint32_t start_rate, uint32_t acceleration) {
    ramp[2] = start_rate;
    ramp[3] = acceleration;
}
void hal_lead(uint32_t clocks) { ramp[4] = clocks; }
hal_check hal_axis_check(unsigned axis) { return check_found[axis]; }
bool hal_axis_beyond(unsigned axis, bool high) {
    (void)axis;
    return high;
}

void gk_axis_words(uint32_t axis, int32_t words[4]) {
    words[3] = (int32_t)lags[axis];
    words[0] = limits[axis][0];
    words[1] = limits[axis][1];
    words[2] = (int32_t)gains[axis];
}

void gk_ramp_words(uint32_t words[5]) {
    for (unsigned i = 0; i < 5; i++)
        words[i] = ramp[i];
}

void hal_index_arm(uint32_t axes) { index_armed = axes; }
uint32_t gk_index_armed(void) { return index_armed; }
void gk_index(uint32_t axes) {
    axes &= index_armed;
    index_armed &= ~axes;
    if (axes)
        gk_event(EVENT_INDEX, 0, axes, 0);
}

void gk_check_found(uint32_t axis, uint32_t check) { check_found[axis] = (hal_check)check; }

void hal_axis_mode(unsigned axis, const hal_drive *drive) { drives[axis].drive = *drive; }
void hal_axis_gear(unsigned axis, uint32_t steps, uint32_t pulses) {
    drives[axis].steps = steps;
    drives[axis].pulses = pulses;
    drives[axis].begun++;
}
void hal_axis_backlash(unsigned axis, uint32_t pulses) { drives[axis].backlash = pulses; }
void hal_axis_pitch(unsigned axis, int32_t pulses) { pitch[axis] = pulses; }
int32_t gk_pitch(uint32_t axis) { return pitch[axis]; }
void gk_drive_words(uint32_t axis, uint32_t words[7]) {
    const hal_drive *drive = &drives[axis].drive;
    words[0] = drive->step | (uint32_t)drive->reverse << 1 | (uint32_t)drive->swap << 2;
    words[5] = (uint32_t)drive->offset;
    words[6] = drive->friction;
    words[1] = drives[axis].steps;
    words[2] = drives[axis].pulses;
    words[3] = drives[axis].backlash;
    words[4] = drives[axis].begun;
}
void hal_axis_step_time(unsigned axis, uint32_t width, uint32_t space, uint32_t setup) {
    drives[axis].step_time[0] = width;
    drives[axis].step_time[1] = space;
    drives[axis].step_time[2] = setup;
}
void gk_step_time(uint32_t axis, uint32_t clocks[3]) {
    for (unsigned which = 0; which < 3; which++)
        clocks[which] = drives[axis].step_time[which];
}
