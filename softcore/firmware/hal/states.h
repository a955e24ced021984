/* Generated from softcore/tables/states.py by `python -m softcore.generate`; do not edit. */
#pragma once

/* What the motion is doing. */
typedef enum {
    MOTION_FRONT = 0,
    MOTION_STOPPING = 1,
    MOTION_RETRACTING = 2,
    MOTION_AT_LIMIT = 3,
    MOTION_HIGH = 4,
    MOTION_LOW = 5,
    MOTION_HALTED = 6,
} hal_motion_state;

/* Results of a coder's supervision. */
typedef enum {
    CHECK_NONE = 0,
    CHECK_MODEL = 1,
    CHECK_SILENT = 2,
    CHECK_PHASE_A = 3,
    CHECK_PHASE_B = 4,
    CHECK_AGAINST = 5,
    CHECK_SHARE = 6,
    CHECK_RATE = 7,
    CHECKS = 8,
} hal_check;

#define CHECK_TEXTS \
    [CHECK_NONE] = "it is sound", \
    [CHECK_MODEL] = "the axis does not follow its drive's command", \
    [CHECK_SILENT] = "both phases are silent", \
    [CHECK_PHASE_A] = "phase A is silent", \
    [CHECK_PHASE_B] = "phase B is silent", \
    [CHECK_AGAINST] = "it counts against the command", \
    [CHECK_SHARE] = "it counts much less, or much more, than was commanded", \
    [CHECK_RATE] = "it counts faster than any drive goes",
