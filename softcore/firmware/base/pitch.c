// SPDX-License-Identifier: Apache-2.0
#include "base/pitch.h"

#include "base/settings.h"
#include "hal/hal.h"

#include "base/rare.h"

#define POINTS (SET_PITCH_Y_1 - SET_PITCH_X_1)
#define STEEPEST 100u       /* pulses of way for a pulse of error */
#define WIDEST 4095         /* pulses that the gateware makes up for, up or down */

static int32_t reference[HAL_AXES];     /* error that is not made up for */

static uint32_t of_axis(setting of_x, unsigned axis) { return settings_get((setting)(of_x + axis)); }

static setting point_of(unsigned axis, uint32_t point) {
    return (setting)(SET_PITCH_X_1 + axis * POINTS + point);
}

static int32_t at_point(unsigned axis, uint32_t point) {
    return (int32_t)(settings_get(point_of(axis, point)) - settings_row(SET_PITCH_X_1)->initial);
}

static uint32_t size_of(int32_t value) { return (uint32_t)(value < 0 ? -value : value); }

bool pitch_sound(fault *f) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t before = at_point(axis, 0), least = before, most = before;
        for (uint32_t next = 1; next < of_axis(SET_PITCH_POINTS_X, axis); next++) {
            int32_t here = at_point(axis, next);
            if (size_of(here - before) * STEEPEST > of_axis(SET_PITCH_STEP_X, axis))
                return fault_at(f, FAULT_SETTING, 0,
                                "the pitch of %c in $%u differs from that before by more than 1/%u of the way",
                                "XYZ"[axis], settings_number(point_of(axis, next)), STEEPEST);
            least = here < least ? here : least;
            most = here > most ? here : most;
            before = here;
        }
        if (most - least > WIDEST)
            return fault_at(f, FAULT_SETTING, 0,
                            "the pitch table of %c ($%u and on) is more than %u pulses wide",
                            "XYZ"[axis], settings_number(point_of(axis, 0)), (uint32_t)WIDEST);
    }
    return true;
}

static int32_t error_at(unsigned axis, int32_t place) {
    uint32_t points = of_axis(SET_PITCH_POINTS_X, axis), step = of_axis(SET_PITCH_STEP_X, axis);
    uint32_t way = (uint32_t)place + of_axis(SET_PITCH_FIRST_X, axis);
    if (!points)
        return 0;
    if ((int32_t)way <= 0)
        return at_point(axis, 0);
    uint32_t point = way / step;
    if (point + 1 >= points)
        return at_point(axis, points - 1);
    int32_t from = at_point(axis, point), change = at_point(axis, point + 1) - from;
    /* The slope in 2**-30 by two divisions of 32 bits: a change has 13 bits, a step 20. */
    uint32_t high = size_of(change) << 18;
    uint32_t slope = (high / step << 12) + (high % step << 12) / step;
    int64_t product = (int64_t)slope * (way % step);
    return from + (int32_t)(((change < 0 ? -product : product) + (1 << 29)) >> 30);
}

static int32_t error_here(unsigned axis) { return error_at(axis, hal_axis_command(axis)); }

void pitch_refer(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        reference[axis] = error_here(axis) - settings_pitch(axis);
}

/* Axes that were moved by hand between two references could ask for more than the widest. */
void pitch_follow(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t pulses = error_here(axis) - reference[axis];
        settings_put_pitch(axis, pulses > WIDEST ? WIDEST : pulses < -WIDEST ? -WIDEST : pulses);
    }
}
