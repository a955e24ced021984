// SPDX-License-Identifier: Apache-2.0
/* Alarms. Whoever notices what must stop the machine raises an alarm here. The outputs are taken away
   in that very call; the main loop takes the alarm at the end of the step in which it was raised, and
   ends what was being done. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "hal/hal.h"

typedef struct {
    fault what;
    uint64_t cycle;                 /* clock in which it happened, */
    int32_t position[HAL_AXES];     /* and where the encoders were then */
    bool guard;                     /* a fault of the guard (FAULT_GUARD) is among those raised */
} alarm;

void alarm_init(void);

/* Path pulses stop, the discharge goes off, and a hand has to arm it anew. A hold that a `!` began in
   the gateware ends. */
void alarm_outputs_off(void);

/* Raise an alarm: the outputs go off. Of several the first is kept until it has been told. */
void alarm_raise(const fault *f);
void alarm_raise_at(const fault *f, uint64_t cycle, const int32_t *position);

bool alarm_raised(void);            /* one was raised, and is to be taken */
const alarm *alarm_first(void);     /* the one that is kept */
void alarm_take(bool tell);         /* it is taken; whether it still is to be told (later) */
bool alarm_untold(void);
void alarm_told(void);

/* Source line of the block being executed, for events and for what goes wrong meanwhile; of one that was
   entered by hand its N word, 0 for none, with ALARM_BY_HAND. It has no source line. */
#define ALARM_BY_HAND 0x80000000u
void alarm_set_line(uint32_t line);
uint32_t alarm_line(void);      /* source line; 0 by hand */
uint32_t alarm_number(void);    /* source line or N word: `Ln` */
