// SPDX-License-Identifier: Apache-2.0
/* Machine constants that the host writes before a run (`$n=value`) and lists (`$$`). */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/settings_table.h"
#include "base/travel.h"

/* Set initial values, call `stored`, which may replace them by settings_load, and write all to the
   gateware. This takes long, so `between` is called between the parts. */
void settings_init(void (*stored)(void), void (*between)(void));
bool settings_load(uint32_t number, uint32_t value);    /* false as settings_set */

/* Does a setting differ from its initial value? And a number that every change changes. */
bool settings_differs(setting which);
unsigned settings_differing(void);  /* how many do */
uint32_t settings_edition(void);

/* Write the registers again that the gateware guards: a bit in one of them may have flipped. */
void settings_renew(void);
void settings_renew_drives(void); /* those of mode, gear, backlash and pitch error: these then begin anew */
uint32_t settings_get(setting which);

/* Pulses of an edge of the axis's coder, rounded up; 1 with steps. */
uint32_t settings_edge(unsigned axis);

/* Has a table of a screw been entered? And the error of an axis's screw that is made up for, in
   pulses up; the axis walks to a new one. */
bool settings_screws(void);
int32_t settings_pitch(unsigned axis);
void settings_put_pitch(unsigned axis, int32_t pulses);

/* Backlash and pitch of an axis begin anew: it counts as having come up, and nothing is made up for.
   It does not move by it, so its place is lost. */
void settings_renew_screw(unsigned axis);

/* The setting with a number, SETTINGS if there is none; the number of a setting, and its row. */
setting settings_find(uint32_t number);
uint32_t settings_number(setting which);
const settings_table_row *settings_row(setting which);

/* Does this setting guard the machine, so that it may not change while the machine moves or
   machines? Also true for a number without a setting. */
bool settings_guard(uint32_t number);
bool settings_switch(uint32_t number);  /* the operator may change it while a program runs */

/* Write the names, separated by commas, of guards that settings have switched off and of coders
   that step axes do not have. The buffer needs SETTINGS_MASKED characters. */
#define SETTINGS_MASKED 96
void settings_masked(char *text, size_t size);
const char *settings_short(void); /* what tells a short, as in the status; empty: the voltage */
bool settings_set(uint32_t number, uint32_t value); /* false: unknown or out of range */

/* Is it a setting of servo, fluid, feed or short detector? Call gap_settings after such a change. */
bool settings_of_gap(uint32_t number);

/* Has every gear at most one step a pulse, and a coder at most 20 pulses an edge? False with a fault.
   The two numbers of a gear are set one after the other, so each alone is accepted. */
bool settings_gears(fault *f);

/* Is it a setting by whose change the drives and the counted positions part? The table of a pitch
   error is one: its axis would move at once. */
bool settings_of_drive(uint32_t number);

/* Read a whole number at `at` and move `at` behind it; false if there is none. */
bool settings_read_number(const char *line, uint32_t length, uint32_t *at, uint32_t *value);

/* Read a line `$n=value`, and set the setting. False with a fault. */
bool settings_read(const char *line, uint32_t length, uint32_t *number, uint32_t *value, fault *f);
bool settings_enter(uint32_t number, uint32_t value, fault *f);

/* Settings in the gateware's units. */
uint32_t settings_start_rate(void);

/* Of junctions: the change of a direction, 2**-15, that is at most the start/stop speed at the
   highest one. Of corners: the rate at which the lag rounds one of 90 degrees or more by the
   setting, 0 for no bound; the sine, 2**-15, up to which no bend needs a bound; clocks that the
   axes need to follow before a corner, and behind it. */
uint32_t settings_tangent_step(void);
uint32_t settings_corner_rate(void);
uint32_t settings_corner_sine(void);
uint32_t settings_corner_before(void);
uint32_t settings_corner_behind(void);
uint32_t settings_lag_clocks(void);  /* until the axes have caught up after a motion */
uint32_t settings_acceleration(void);
uint32_t settings_highest_speed(void);  /* um/min */
uint32_t settings_highest_rate(void);   /* the same as a rate */
uint32_t settings_axis_rate(unsigned axis);     /* highest of an axis; 0 for no own bound */
uint32_t settings_axis_speed(unsigned axis);    /* highest of an axis, um/min */
uint32_t settings_axis_resolution(unsigned axis);   /* steps, or pulses, of a m */
uint32_t settings_curve_rate(uint32_t radius);  /* highest rate on an arc; radius in pulses */
const travel_range *settings_travel(void);      /* the soft limits */
uint32_t settings_travel_um(unsigned axis);     /* distance between the soft limits of an axis */
const travel_range *settings_travel_now(void);  /* soft limits, and limit switches being left */
