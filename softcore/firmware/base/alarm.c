// SPDX-License-Identifier: Apache-2.0
#include "base/alarm.h"

static bool raised;     /* an alarm has been raised and not yet taken */
static bool untold;
static alarm first;
static uint32_t line;

void alarm_init(void) {
    raised = untold = false;
    line = 0;
}

void alarm_outputs_off(void) {
    hal_control(false, false);
    hal_release_hold();
    hal_discharge(false);
    hal_disarm();
}

void alarm_raise_at(const fault *f, uint64_t cycle, const int32_t *position) {
    alarm_outputs_off();
    first.guard = f->code == FAULT_GUARD || (raised && first.guard);
    bool later = raised || untold;
    raised = true;
    if (later)
        return; /* later alarms are consequences of the first */
    first.what = *f;
    first.cycle = cycle;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        first.position[axis] = position[axis];
}

__attribute__((noinline)) void alarm_raise(const fault *f) {
    int32_t position[HAL_AXES];
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        position[axis] = hal_axis_position(axis);
    alarm_raise_at(f, hal_cycle(), position);
}

bool alarm_raised(void) { return raised; }
const alarm *alarm_first(void) { return &first; }

void alarm_take(bool tell) {
    raised = false;
    untold = tell;
}

bool alarm_untold(void) { return untold; }
void alarm_told(void) { untold = false; }

uint32_t alarm_line(void) { return line & ALARM_BY_HAND ? 0 : line; }
uint32_t alarm_number(void) { return line & ~ALARM_BY_HAND; }
void alarm_set_line(uint32_t number) { line = number; }
