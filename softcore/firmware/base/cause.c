// SPDX-License-Identifier: Apache-2.0
#include "base/cause.h"

#include "base/cause_texts.h"
#include "base/text.h"
#include "hal/hal.h"
#include "hal/regs.h"

#define AXES_TEXT 48     /* includes the room that text_print needs before a character */

static const char *const TEXT[CAUSES] = {CAUSE_TEXTS};

static const char *const CHECK_TEXT[CHECKS] = {CHECK_TEXTS};

/* LOSES_POSITION: first causes after which the counted position may differ from the true one.
   MISCOUNTS: those that mean this also if they follow another cause. Following errors do not: after
   a trip the axes coast, and a following error is normal. */
#define MISCOUNTS                                                                                  \
    (1u << CAUSE_ERROR_SATURATED | 1u << CAUSE_ENCODER | 1u << CAUSE_CODER | 1u << CAUSE_GUARD)
#define LOSES_POSITION                                                                             \
    (MISCOUNTS | 1u << CAUSE_FOLLOWING_STOPPED | 1u << CAUSE_FOLLOWING_MOVING)

bool cause_loses_position(unsigned cause) { return LOSES_POSITION >> cause & 1; }
bool cause_miscounts(uint32_t causes) { return causes & MISCOUNTS; }

size_t cause_axes(char *buffer, size_t size, unsigned axes) {
    size_t at = text_print(buffer, size, axes & (axes - 1) ? "axes " : "axis ");
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        if (!(axes >> axis & 1))
            continue;
        bool first = !(axes & ((1u << axis) - 1)), last = !(axes >> axis >> 1);
        at += text_print(buffer + at, size - at, "%s%c", first ? "" : last ? " and " : ", ",
                         "XYZ"[axis]);
    }
    return at;
}

static unsigned lowest(unsigned axes) {
    unsigned axis = 0;
    while (axis < HAL_AXES - 1 && !(axes >> axis & 1))
        axis++;
    return axis;
}

static const char *damage_text(uint32_t damage) {
    return damage & HAL_DAMAGE_WORD      ? "a word of the path"
           : damage & HAL_DAMAGE_SEGMENT ? "the segment at work"
           : damage & HAL_DAMAGE_PLACE   ? "the place on the path"
           : damage & HAL_DAMAGE_PULSES  ? "path pulses on their way"
           : damage & HAL_DAMAGE_FLUID   ? "whether low fluid trips"
           : damage & HAL_DAMAGE_RATE    ? "the rate of the ramp"
           : damage & HAL_DAMAGE_LATCH   ? "the latch of the interlock"
                                         : "the position";
}

/* "a guarded register of the gateware is damaged (...)", with axes, settings of axes, or something
   else. */
static size_t print_damage(char *buffer, size_t size, uint32_t damage) {
    char whose[AXES_TEXT];
    unsigned positions = damage & HAL_DAMAGE_AXES, settings = HAL_DAMAGE_SETTINGS(damage);
    if (!positions && !settings)
        return text_print(buffer, size, "%s (%s)", TEXT[CAUSE_GUARD], damage_text(damage));
    cause_axes(whose, sizeof whose, positions ? positions : settings);
    return text_print(buffer, size, "%s (%s%s)", TEXT[CAUSE_GUARD],
                      positions ? "" : "a setting of ", whose);
}

static size_t print_cause(char *buffer, size_t size, unsigned cause, unsigned axes) {
    char whose[AXES_TEXT];
    axes &= (1u << HAL_AXES) - 1;
    unsigned axis = lowest(axes);
    switch (cause) {
    case CAUSE_CODER:
        return text_print(buffer, size, "coder of axis %c: %s", "XYZ"[axis],
                          CHECK_TEXT[hal_axis_check(axis)]);
    case CAUSE_TRAVEL:
        return text_print(buffer, size, "a command beyond the %s soft limit of axis %c",
                          hal_axis_beyond(axis, true) ? "upper" : "lower", "XYZ"[axis]);
    case CAUSE_GUARD: return print_damage(buffer, size, hal_damage());
    case CAUSE_DRIVE_FAULT:
        /* A wire machine's third drive is that of the wire. */
        if (hal_jump_axis() >= HAL_AXES && axes >> (HAL_AXES - 1) & 1)
            return text_print(buffer, size, "the wire has a break or its drive reports a fault");
        break;
    default: break;
    }
    const char *text = cause < CAUSES ? TEXT[cause] : "unknown cause";
    if (!axes)
        return text_print(buffer, size, "%s", text);
    cause_axes(whose, sizeof whose, axes);
    return text_print(buffer, size, "%s (%s)", text, whose);
}

/* Writes the parts straight into the fault, so that no text is copied. */
bool cause_fault(fault *f, const char *begin, unsigned cause, unsigned axes) {
    bool limit = cause == CAUSE_LIMIT_LOW || cause == CAUSE_LIMIT_HIGH;
    bool first = f->code == FAULT_NONE;
    fault_at(f, limit ? FAULT_LIMIT : FAULT_TRIP, 0, "%s", begin);
    if (first) {
        size_t at = __builtin_strlen(f->text);
        print_cause(f->text + at, sizeof f->text - at, cause, axes);
    }
    return false;
}

void cause_position(fault *f, bool lost) {
    size_t at = __builtin_strlen(f->text);
    text_print(f->text + at, sizeof f->text - at, "; the position is %s", lost ? "lost" : "kept");
}
