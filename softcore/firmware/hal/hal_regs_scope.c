// SPDX-License-Identifier: Apache-2.0
/* Hardware access of the target: the gap oscilloscope. */
#include "hal/fields.h"
#include "hal/hal.h"
#include "hal/regs.h"

uint32_t hal_scope_depth(void) { return SCOPE->depth; }
void hal_scope_arm(const hal_scope_trigger *trigger) {
    SCOPE->order = PUT(1, SCOPE_ORDER_STOP);
    SCOPE->trigger = PUT(trigger->source, SCOPE_TRIGGER_SOURCE) |
                     PUT(trigger->classes, SCOPE_TRIGGER_CLASSES) |
                     PUT(trigger->level, SCOPE_TRIGGER_LEVEL);
    SCOPE->after = trigger->after;
    SCOPE->order = PUT(1, SCOPE_ORDER_ARM);
}
void hal_scope_order(hal_scope_ordered order) {
    SCOPE->order = order == HAL_SCOPE_STOP ? SCOPE_ORDER_STOP_MASK : SCOPE_ORDER_FORCE_MASK;
}
hal_scope_state hal_scope_read(void) {
    uint32_t status = SCOPE->status;
    return (hal_scope_state){.recording = GET(status, SCOPE_STATUS_RECORDING),
                             .count = GET(status, SCOPE_STATUS_COUNT),
                             .after = SCOPE->after, .time = SCOPE->time - 1};
}
void hal_scope_choose(uint32_t place) { SCOPE->place = place; }
uint64_t hal_scope_next(void) {
    uint32_t low = SCOPE->entry;
    return (uint64_t)SCOPE->entry_rest << 32 | low;
}
