/* Generated from softcore/tables/settings.py by `python -m softcore.generate`; do not edit. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef enum {
    SET_SHORT_NEEDED,
    SET_SHORT_WINDOW,
    SET_SHORT_DURATION_US,
    SET_CLEAR_NEEDED,
    SET_BLANKING_NS,
    SET_SENSE_ON_NS,
    SET_SENSE_OFF_NS,
    SET_GAIN_PULSES,
    SET_REPEATS,
    SET_SETTLE_US,
    SET_START_SPEED_UM_S,
    SET_ACCELERATION_MM_S2,
    SET_HIGHEST_SPEED_MM_MIN,
    SET_FOLLOW_STOPPED,
    SET_FOLLOW_MOVING,
    SET_SOFT_LIMIT_UM,
    SET_STEP_AXES,
    SET_REVERSED_ENCODERS,
    SET_STEP_WIDTH_NS,
    SET_STEP_SPACE_NS,
    SET_STEP_SETUP_NS,
    SET_WINDOW,
    SET_TV,
    SET_BLOCK_SKIP,
    SET_OPTIONAL_STOP,
    SET_FIN_MS,
    SET_FLUID_REQUIRED,
    SET_SETTLE_NS,
    SET_CONFIRM_NS,
    SET_DELAY_LEAST_NS,
    SET_CRITERIA,
    SET_SERVO_PERIOD_US,
    SET_SERVO_MODE,
    SET_SERVO_WINDOW,
    SET_SERVO_WEIGHT,
    SET_NO_DISCHARGE_UM,
    SET_FLUID_MODE,
    SET_FLUID_CLASS,
    SET_FLUID_THRESHOLD_0,
    SET_FLUID_THRESHOLD_1,
    SET_FLUID_THRESHOLD_2,
    SET_FLUID_HYSTERESIS,
    SET_FLUID_LOWEST,
    SET_FLUID_HIGHEST,
    SET_NO_PROGRESS_S,
    SET_FEED_MODE_WINDOW_US,
    SET_FEED_MODE_GAIN_ZERO,
    SET_FEED_MODE_GAIN_FEED,
    SET_FEED_MODE_UNIT_UM,
    SET_FEED_MODE_LONGEST_MS,
    SET_FEED_MODE_LEAST_MV,
    SET_FEED_MODE_RATIO_LOWEST,
    SET_FEED_MODE_RATIO_HIGHEST,
    SET_FEED_MODE_NO_LOAD,
    SET_ARC_DIFFERENCE_NM,
    SET_CURRENT_STEP_MA,
    SET_LOOP_GAIN,
    SET_ARC_DEVIATION_NM,
    SET_LOW_X_UM,
    SET_LOW_Y_UM,
    SET_LOW_Z_UM,
    SET_HIGH_X_UM,
    SET_HIGH_Y_UM,
    SET_HIGH_Z_UM,
    SET_SHORT_MEAN_MV,
    SET_SHORT_MEAN_US,
    SET_FEED_MODE_DISCHARGE_UM,
    SET_SHORT_CURRENT_NS,
    SET_FEED_FORWARD,
    SET_BACK_ACCELERATION_MM_S2,
    SET_BACK_START_SPEED_UM_S,
    SET_IGNITION_LAG_NS,
    SET_JOG_SILENCE_MS,
    SET_FOLLOW_US,
    SET_GEAR_STEPS_X,
    SET_GEAR_STEPS_Y,
    SET_GEAR_STEPS_Z,
    SET_GEAR_PULSES_X,
    SET_GEAR_PULSES_Y,
    SET_GEAR_PULSES_Z,
    SET_BACKLASH_X,
    SET_BACKLASH_Y,
    SET_BACKLASH_Z,
    SET_REVERSED_DRIVES,
    SET_HIGHEST_SPEED_X,
    SET_HIGHEST_SPEED_Y,
    SET_HIGHEST_SPEED_Z,
    SET_HOME_ORDER,
    SET_HOME_DOWN,
    SET_HOME_SLOW_MM_MIN,
    SET_HOME_FAST_MM_MIN,
    SET_HOME_PULL_OFF_UM,
    SET_SINGLE_BLOCK,
    SET_DRY_RUN_MM_MIN,
    SET_CORNER_DEVIATION_NM,
    SET_DRIVE_LAG_US,
    SET_STEP_WIDTH_X_NS,
    SET_STEP_WIDTH_Y_NS,
    SET_STEP_WIDTH_Z_NS,
    SET_STEP_SPACE_X_NS,
    SET_STEP_SPACE_Y_NS,
    SET_STEP_SPACE_Z_NS,
    SET_STEP_SETUP_X_NS,
    SET_STEP_SETUP_Y_NS,
    SET_STEP_SETUP_Z_NS,
    SETTINGS,
} setting;

/* Range of the numbers; some in it may be unused. */
#define SETTINGS_FIRST 400u
#define SETTINGS_LAST 550u

/* The firmware applies the whole group again when a setting of it changes. */
typedef enum {
    GROUP_DETECTOR,
    GROUP_MOTION,
    GROUP_AXES,
    GROUP_DRIVES,
    GROUP_TRAVEL,
    GROUP_LOOP,
    GROUP_SIDE,
    GROUP_GAP,
    GROUP_PROGRAM,
    SETTINGS_GROUPS,
} setting_group;

typedef struct {
    uint32_t initial, lowest, highest;
    uint16_t number;        /* of the line `$number=value` */
    uint8_t group;
    bool guards : 1;        /* locked while the machine moves or machines */
    bool any_time : 1;      /* an operator's switch: may change while a program runs */
    const char *title;
    const char *unit;       /* empty for a pure number */
    const char *guard;      /* guard that the value 0 switches off, or 0 */
} settings_table_row;

extern const settings_table_row SETTINGS_TABLE_ROWS[SETTINGS];
extern const char *const SETTINGS_TABLE_GROUPS[SETTINGS_GROUPS];
