/* Generated from softcore/tables/faults.py by `python -m softcore.generate`; do not edit. */
#pragma once

/* Numbers of `error:N` and `ALARM:N`. */
typedef enum {
    FAULT_NONE = 0,
    FAULT_NO_START = 1,
    FAULT_PARITY = 2,
    FAULT_BLANK = 3,
    FAULT_CODE = 4,
    FAULT_TV = 5,
    FAULT_TOO_LONG = 6,
    FAULT_NO_END = 7,
    FAULT_LINE = 8,
    FAULT_CHARACTER = 10,
    FAULT_NUMBER = 11,
    FAULT_OVERFLOW = 12,
    FAULT_DUPLICATE = 13,
    FAULT_CONFLICT = 14,
    FAULT_UNKNOWN = 15,
    FAULT_COMMENT = 16,
    FAULT_PLACE = 17,
    FAULT_MISSING = 18,
    FAULT_REFUSED = 19,
    FAULT_ARC = 20,
    FAULT_CORNER = 21,
    FAULT_FEED = 30,
    FAULT_MODE = 31,
    FAULT_RETRACTION = 32,
    FAULT_CONDITION = 33,
    FAULT_TRAVEL = 34,
    FAULT_HISTORY = 35,
    FAULT_SETTING = 36,
    FAULT_LOCKED = 37,
    FAULT_BUSY = 38,
    FAULT_TABLE = 39,
    FAULT_TRIP = 40,
    FAULT_HALT_LIMIT = 41,
    FAULT_HALT_FLOOR = 42,
    FAULT_HALT_SERIES = 43,
    FAULT_HALT_NO_DATA = 44,
    FAULT_FIN = 45,
    FAULT_EVENTS = 46,
    FAULT_RESET = 47,
    FAULT_HALT_SERVO = 48,
    FAULT_FLUID = 49,
    FAULT_NO_DISCHARGE = 50,
    FAULT_NO_PROGRESS = 51,
    FAULT_CONTACT = 52,
    FAULT_NOT_ARMED = 53,
    FAULT_POSITION_LOST = 54,
    FAULT_GUARD = 55,
    FAULT_STUCK = 56,
} fault_code;

#define FAULT_TEXT_HALT_LIMIT \
    "still short at the retractable limit"
#define FAULT_TEXT_HALT_FLOOR \
    "still short where the way back ends (ceiling, soft limit or start of the path)"
#define FAULT_TEXT_HALT_SERIES \
    "too many shorts in series without new depth"
#define FAULT_TEXT_HALT_NO_DATA \
    "short without retraction data (G36)"
#define FAULT_TEXT_EVENTS \
    "events of the gateware were lost"
#define FAULT_TEXT_RESET \
    "reset by the operator during motion"
#define FAULT_TEXT_HALT_SERVO \
    "the servo would go back beyond the retractable limit or the ceiling or the soft limit"
#define FAULT_TEXT_CONTACT \
    "contact with the discharge off; only a move away from the work goes on from here"
#define FAULT_TEXT_NOT_ARMED \
    "the discharge is not armed: press the button ARM at the machine"
#define FAULT_TEXT_POSITION_LOST \
    "the position is lost; $POSITION=HERE takes what is counted for true"
#define FAULT_TEXT_STUCK \
    "nothing moves, although the path goes on"
