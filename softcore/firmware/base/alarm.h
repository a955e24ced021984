// SPDX-License-Identifier: Apache-2.0
/* Alarms. A module that finds a reason to stop the machine raises an alarm here. This call itself
   switches the outputs off. At the end of that step the main loop takes the alarm and ends the
   program. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "hal/hal.h"

typedef struct {
    fault what;
    uint64_t cycle;                 /* clock in which it happened */
    int32_t position[HAL_AXES];     /* position of the encoders at that time */
    bool guard;                     /* one of the alarms raised was FAULT_GUARD */
} alarm;

void alarm_init(void);

/* Stop path pulses, and switch the discharge off; the operator has to arm it again. Also ends a
   hold that a `!` began in the gateware. */
void alarm_outputs_off(void);

/* Raise an alarm and switch the outputs off. Of several alarms the first is kept until it is
   told. */
void alarm_raise(const fault *f);
void alarm_raise_at(const fault *f, uint64_t cycle, const int32_t *position);

bool alarm_raised(void);            /* an alarm was raised and must be taken */
const alarm *alarm_first(void);     /* the alarm that is kept */
void alarm_take(bool tell);         /* note that it is taken; `tell`: it must still be told */
bool alarm_untold(void);
void alarm_told(void);

/* Set the line of the block being carried out, for events and alarms: its source line; or, for a
   block entered by hand, ALARM_BY_HAND and its N word (0 for none), as it has no source line. */
#define ALARM_BY_HAND 0x80000000u
void alarm_set_line(uint32_t line);
uint32_t alarm_line(void);      /* source line; 0 by hand */
uint32_t alarm_number(void);    /* source line or N word: `Ln` */
