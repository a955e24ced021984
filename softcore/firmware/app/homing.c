// SPDX-License-Identifier: Apache-2.0
#include "app/homing.h"

#include "app/machine.h"
#include "base/settings.h"
#include "hal/hal.h"
#include "hal/regs.h"

homing_state homing_now;
static fault result;
static bool ended;

void homing_init(void) {
    homing_now.phase = HOMING_NONE;
    ended = false;
}

bool homing_active(void) { return homing_now.phase != HOMING_NONE; }
bool homing_answers(void) { return ended; }

const fault *homing_answer(void) {
    ended = false;
    return result.code == FAULT_NONE ? 0 : &result;
}

void homing_end(const fault *why) {
    result = why ? *why : (fault){0};
    homing_now.phase = HOMING_NONE;
    ended = true;
}

void homing_stop(void) {
    fault f = {0};
    if (!homing_active())
        return;
    settings_renew();
    fault_at(&f, FAULT_LOCKED, 0, "stopped by an alarm or a reset");
    homing_end(&f);
}

__attribute__((noinline, section(".rare"))) void homing_indexed(uint32_t axes, const int32_t *place) {
    if (!(axes >> homing_now.axis & 1))
        return;
    if (homing_now.phase == HOMING_LEAVE) {
        homing_now.before = place[homing_now.axis];
        homing_now.passed = true;
        hal_index_arm(1u << homing_now.axis);
    } else if (homing_now.phase == HOMING_INDEX) {
        homing_now.index = place[homing_now.axis];
        homing_now.phase = HOMING_FOUND;
        homing_now.since = hal_cycle_low();
        machine_run(false);
    }
}

bool homing_takes(unsigned cause, unsigned axes, const int32_t *place) {
    if (homing_now.phase != HOMING_SEEK ||
        cause != (homing_now.down ? CAUSE_LIMIT_LOW : CAUSE_LIMIT_HIGH) ||
        axes != 1u << homing_now.axis)
        return false;
    homing_now.phase = HOMING_STOP;
    homing_now.switched = place[homing_now.axis];
    homing_now.since = hal_cycle_low();
    machine_run(false);
    return true;
}
