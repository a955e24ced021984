/* Generated from softcore/tables/causes.py by `python -m softcore.generate`; do not edit. */
#pragma once

#include "hal/regs.h"

#define CAUSE_TEXTS \
    [CAUSE_POWER_ON] = "nobody has cleared the interlock since power-on", \
    [CAUSE_ESTOP] = "emergency stop", \
    [CAUSE_DRIVE_FAULT] = "a drive reports a fault", \
    [CAUSE_LIMIT_LOW] = "an axis is on its lower limit switch", \
    [CAUSE_LIMIT_HIGH] = "an axis is on its upper limit switch", \
    [CAUSE_FLUID_LOW] = "the fluid is below its level", \
    [CAUSE_WATCHDOG] = "the firmware stopped calling the watchdog", \
    [CAUSE_ERROR_SATURATED] = "a deviation counter reached its limit", \
    [CAUSE_ENCODER] = "an encoder made an illegal transition", \
    [CAUSE_FOLLOWING_STOPPED] = "position deviation at rest above its limit", \
    [CAUSE_FOLLOWING_MOVING] = "position deviation in motion above its limit", \
    [CAUSE_FIRMWARE] = "the firmware has tripped it", \
    [CAUSE_CODER] = "a coder does not show the motion of its axis", \
    [CAUSE_TRAVEL] = "a command beyond a soft limit", \
    [CAUSE_CONTACT] = "the electrode touched the work with the discharge off", \
    [CAUSE_GATE] = "the gap had current or voltage with both sources off", \
    [CAUSE_MEMORY] = "the processor's memory read wrong", \
    [CAUSE_GUARD] = "a guarded register of the gateware is damaged"
