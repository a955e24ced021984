/* Generated from softcore/tables/faults.py by `python -m softcore.generate`; do not edit. */
#pragma once

/* Our numbers. Grbl's number is sent instead if it has one (below). */
typedef enum {
    FAULT_NONE = 0,
    FAULT_NO_START = 101,
    FAULT_PARITY = 102,
    FAULT_BLANK = 103,
    FAULT_CODE = 104,
    FAULT_TV = 105,
    FAULT_TOO_LONG = 106,
    FAULT_NO_END = 107,
    FAULT_LINE = 108,
    FAULT_CHARACTER = 110,
    FAULT_NUMBER = 111,
    FAULT_OVERFLOW = 112,
    FAULT_DUPLICATE = 113,
    FAULT_CONFLICT = 114,
    FAULT_UNKNOWN = 115,
    FAULT_COMMENT = 116,
    FAULT_PLACE = 117,
    FAULT_MISSING = 118,
    FAULT_REFUSED = 119,
    FAULT_ARC = 120,
    FAULT_CORNER = 121,
    FAULT_MODAL = 122,
    FAULT_COMMAND = 123,
    FAULT_HOMING = 124,
    FAULT_FEED = 130,
    FAULT_JOG = 170,
    FAULT_JOG_TRAVEL = 171,
    FAULT_JOG_ENDED = 172,
    FAULT_MODE = 131,
    FAULT_RETRACTION = 132,
    FAULT_CONDITION = 133,
    FAULT_TRAVEL = 134,
    FAULT_HISTORY = 135,
    FAULT_SETTING = 136,
    FAULT_LOCKED = 137,
    FAULT_BUSY = 138,
    FAULT_START_BLOCK = 178,
    FAULT_WALK = 180,
    FAULT_TABLE = 139,
    FAULT_TRIP = 140,
    FAULT_LIMIT = 157,
    FAULT_HALT_LIMIT = 141,
    FAULT_HALT_BACK_LIMIT = 142,
    FAULT_HALT_BURST = 143,
    FAULT_HALT_NO_DATA = 144,
    FAULT_FIN = 145,
    FAULT_EVENTS = 146,
    FAULT_RESET = 147,
    FAULT_HALT_SERVO = 148,
    FAULT_FLUID = 149,
    FAULT_NO_DISCHARGE = 150,
    FAULT_NO_PROGRESS = 151,
    FAULT_CONTACT = 152,
    FAULT_NO_TOUCH = 173,
    FAULT_TOUCHES = 174,
    FAULT_HOME_NOT_FOUND = 175,
    FAULT_HOME_NOT_LEFT = 176,
    FAULT_HOME_RESET = 177,
    FAULT_NOT_ARMED = 153,
    FAULT_POSITION_LOST = 154,
    FAULT_GUARD = 155,
    FAULT_STUCK = 156,
} fault_code;

#define FAULT_TEXT_JOG_ENDED \
    "the jog was cancelled before it could begin"
#define FAULT_TEXT_START_BLOCK \
    "the tape ends before the block at which it was to begin"
#define FAULT_TEXT_HALT_LIMIT \
    "still short at the retractable limit"
#define FAULT_TEXT_HALT_BACK_LIMIT \
    "still short at the back limit (ceiling, soft limit or start of the path)"
#define FAULT_TEXT_HALT_BURST \
    "too many shorts in a burst without new depth"
#define FAULT_TEXT_HALT_NO_DATA \
    "retraction without data (G36)"
#define FAULT_TEXT_EVENTS \
    "events of the gateware were lost"
#define FAULT_TEXT_RESET \
    "reset by the operator during motion"
#define FAULT_TEXT_HALT_SERVO \
    "the servo would go back beyond the retractable limit or the ceiling or the soft limit"
#define FAULT_TEXT_CONTACT \
    "contact with the discharge off; from here only a move away from the work is possible"
#define FAULT_TEXT_NO_TOUCH \
    "the end of a touch-off (G38.2) was reached without contact"
#define FAULT_TEXT_TOUCHES \
    "the electrode touches the work before the touch-off begins"
#define FAULT_TEXT_HOME_NOT_FOUND \
    "the reference switch was not found"
#define FAULT_TEXT_HOME_NOT_LEFT \
    "the reference switch is still pressed after the pull-off"
#define FAULT_TEXT_HOME_RESET \
    "reset by the operator during homing"
#define FAULT_TEXT_NOT_ARMED \
    "the discharge is not armed: press the button ARM at the machine"
#define FAULT_TEXT_POSITION_LOST \
    "the position is lost; $POSITION=HERE accepts the counted position"
#define FAULT_TEXT_STUCK \
    "nothing moves, although the path goes on"

/* Numbers of grbl for `error:N`. */
#define FAULT_ERRORS \
    {FAULT_TOO_LONG, 11}, \
    {FAULT_CHARACTER, 1}, \
    {FAULT_NUMBER, 2}, \
    {FAULT_DUPLICATE, 25}, \
    {FAULT_UNKNOWN, 20}, \
    {FAULT_PLACE, 36}, \
    {FAULT_MISSING, 28}, \
    {FAULT_REFUSED, 20}, \
    {FAULT_ARC, 33}, \
    {FAULT_MODAL, 21}, \
    {FAULT_COMMAND, 3}, \
    {FAULT_HOMING, 5}, \
    {FAULT_FEED, 22}, \
    {FAULT_JOG, 16}, \
    {FAULT_JOG_TRAVEL, 15}, \
    {FAULT_MODE, 31}, \
    {FAULT_SETTING, 3}, \
    {FAULT_LOCKED, 9}, \
    {FAULT_BUSY, 8}

/* Numbers of grbl for `ALARM:N`. */
#define FAULT_ALARMS \
    {FAULT_TRAVEL, 2}, \
    {FAULT_LIMIT, 1}, \
    {FAULT_RESET, 3}, \
    {FAULT_NO_TOUCH, 5}, \
    {FAULT_TOUCHES, 4}, \
    {FAULT_HOME_NOT_FOUND, 9}, \
    {FAULT_HOME_NOT_LEFT, 8}, \
    {FAULT_HOME_RESET, 6}
