// SPDX-License-Identifier: Apache-2.0
/* What went wrong: a code, where it stands on the tape, and one clear sentence. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The numbers are part of the interface to the host (`error:N`, `ALARM:N`): never renumber. */
typedef enum {
    FAULT_NONE = 0,
    /* Tape. */
    FAULT_NO_START = 1,     /* no start code before the data */
    FAULT_PARITY = 2,       /* TH: character parity */
    FAULT_BLANK = 3,        /* blank inside EIA data */
    FAULT_CODE = 4,         /* character that is not in the code */
    FAULT_TV = 5,           /* odd number of characters in a block */
    FAULT_TOO_LONG = 6,     /* more characters than a block may have */
    FAULT_NO_END = 7,       /* material or rewind stop before the end word */
    /* Link. */
    FAULT_LINE = 8,         /* line damaged, out of sequence, or without room: it may be sent again */
    /* Block. */
    FAULT_CHARACTER = 10,   /* character out of place */
    FAULT_NUMBER = 11,      /* number missing or malformed */
    FAULT_OVERFLOW = 12,    /* number too long or out of range */
    FAULT_DUPLICATE = 13,   /* word twice in a block */
    FAULT_CONFLICT = 14,    /* words that exclude each other */
    FAULT_UNKNOWN = 15,     /* word or code that the dialect does not have */
    FAULT_COMMENT = 16,     /* comment not closed */
    FAULT_PLACE = 17,       /* word without meaning in this block */
    FAULT_MISSING = 18,     /* word missing in this block */
    FAULT_REFUSED = 19,     /* known, but not in this version */
    FAULT_ARC = 20,         /* no circle fits what is said of the arc */
    FAULT_CORNER = 21,      /* the wire offset does not fit the path */
    /* Program. */
    FAULT_FEED = 30,        /* feed missing, zero or too high */
    FAULT_MODE = 31,        /* axis words without G00 or G01 */
    FAULT_RETRACTION = 32,  /* retraction data invalid or incomplete */
    FAULT_CONDITION = 33,   /* machining condition unknown or missing */
    FAULT_TRAVEL = 34,      /* target beyond the travel */
    FAULT_HISTORY = 35,     /* path history does not cover the retractable limit */
    FAULT_SETTING = 36,     /* setting unknown or out of range */
    FAULT_LOCKED = 37,      /* machine locked by an alarm */
    FAULT_BUSY = 38,        /* not while a program runs */
    FAULT_TABLE = 39,       /* row of a table (G10) invalid */
    /* Machine. */
    FAULT_TRIP = 40,        /* interlock */
    FAULT_HALT_LIMIT = 41,  /* still short at the retractable limit */
    FAULT_HALT_FLOOR = 42,  /* still short where the path begins or at the ceiling */
    FAULT_HALT_SERIES = 43, /* too many shorts in series */
    FAULT_HALT_NO_DATA = 44, /* short without retraction data */
    FAULT_FIN = 45,         /* machine side did not answer */
    FAULT_EVENTS = 46,      /* gateware events lost */
    FAULT_RESET = 47,       /* operator's reset during motion */
    FAULT_HALT_SERVO = 48,  /* the servo would widen the gap beyond the retractable limit */
    FAULT_FLUID = 49,       /* the fluid's resistance is not known */
    FAULT_NO_DISCHARGE = 50, /* under servo a long way without a discharge */
    FAULT_NO_PROGRESS = 51, /* under servo a long time without new depth */
    FAULT_CONTACT = 52,     /* the electrode touches with the discharge off */
    FAULT_NOT_ARMED = 53,   /* nobody at the machine has allowed the discharge */
    FAULT_POSITION_LOST = 54, /* what the counters say of the axes may not be true */
    FAULT_GUARD = 55,       /* the axes are not where the path has led them, or firmware is damaged */
    FAULT_STUCK = 56,       /* motion is wanted, and nothing moves */
} fault_code;

typedef struct {
    fault_code code;
    uint32_t line;      /* source line, 0 for MDI */
    uint32_t block;     /* number of the N word, 0 for none */
    uint32_t column;    /* character of the block, from 1; 0 for none */
    char text[120];     /* what was wrong, without the place */
} fault;

/* Note the first fault of a place; a later one does not replace it. Always returns false, for use in
   conditions. The line is filled in by whoever knows it. */
bool fault_at(fault *f, fault_code code, uint32_t column, const char *format, ...);

/* One sentence: the place, then what was wrong. */
size_t fault_sentence(const fault *f, char *buffer, size_t size);
