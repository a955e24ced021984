/* Generated from softcore/tables/events.py by `python -m softcore.generate`; do not edit. */
#pragma once

/* Kinds in the gateware's queue. */
typedef enum {
    EVENT_NONE = 0,
    EVENT_RETRACTION_START = 1,
    EVENT_RETRACTION_END = 2,
    EVENT_READVANCE = 3,
    EVENT_RESUME = 4,
    EVENT_HALT = 5,
    EVENT_SEGMENT = 6,
    EVENT_TRIP = 7,
    EVENT_FLUID_CLASS = 8,
    EVENT_CONDITION = 9,
    EVENT_INDEX = 10,
} hal_event_kind;

/* Details: letters on the line, by their number in the gateware; 0 is none. */
#define EVENT_CAUSES "?sjo"
#define EVENT_REASONS "?clp"
#define EVENT_PHASES "?hl"
#define EVENT_CAUSE_SHORT 1
#define EVENT_CAUSE_JUMP 2
#define EVENT_CAUSE_OPERATOR 3
#define EVENT_REASON_CLEARED 1
#define EVENT_REASON_LIMIT 2
#define EVENT_REASON_PATH_START 3
#define EVENT_PHASE_HIGH 1
#define EVENT_PHASE_LOW 2
#define EVENT_HALT_LIMIT 1
#define EVENT_HALT_BACK_LIMIT 2
#define EVENT_HALT_BURST 3
#define EVENT_HALT_NO_DATA 4
#define EVENT_HALT_SERVO 5
#define EVENT_HALT_CONTACT 6
#define EVENT_SOURCE_TAPE 't'
#define EVENT_SOURCE_MDI 'm'

/* Name of an event on the line, and the form of what follows its place. With
   `_FULL` it has what may be left out, too. */
#define EVENT_WORD_PROGRAM_START "start"
#define EVENT_FORMAT_PROGRAM_START ""
#define EVENT_FORMAT_PROGRAM_START_FULL ",%u"
#define EVENT_WORD_BLOCK "block"
#define EVENT_FORMAT_BLOCK ",%s"
#define EVENT_WORD_RETRACTION_SET "set"
#define EVENT_FORMAT_RETRACTION_SET ",%u,%d,%u,%u,%d,%s,%c"
#define EVENT_WORD_RETRACTION_START "retract"
#define EVENT_FORMAT_RETRACTION_START ",%c,%u,%u"
#define EVENT_WORD_RETRACTION_END "back"
#define EVENT_FORMAT_RETRACTION_END ",%c,%d,%s,%u"
#define EVENT_WORD_READVANCE "advance"
#define EVENT_FORMAT_READVANCE ",%c,%u,%u,%u"
#define EVENT_WORD_RESUME "resume"
#define EVENT_WORD_FLUID_CLASS "fluid"
#define EVENT_FORMAT_FLUID_CLASS ",%u,%u,%u,%u,%u,%u"
#define EVENT_WORD_CONDITION "condition"
#define EVENT_FORMAT_CONDITION ",%u,%u"
#define EVENT_FORMAT_CONDITION_FULL ",%u,%u,%d"
#define EVENT_WORD_AUX "aux"
#define EVENT_FORMAT_AUX ",%c,%u"
#define EVENT_WORD_ALARM "alarm"
#define EVENT_FORMAT_ALARM ",%u,%s"
#define EVENT_WORD_PAUSE "pause"
#define EVENT_WORD_PROGRAM_END "end"
