// SPDX-License-Identifier: Apache-2.0
/* Basic data of the roughing planner for one pair of materials: the undersize that each current
   needs at each depth, for a few areas. They are entered line by line in this order: the depths,
   then for each area the area and its currents. The rules are those of tapes/basic/README.md. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

#define BASIC_AREAS 8
#define BASIC_DEPTHS 12
#define BASIC_CURRENTS 16       /* of an area */
#define BASIC_ROWS 80           /* currents of all areas: five whole ones */

void basic_forget(void);

/* Forget all data and set the depths, in um. */
bool basic_depths(const uint32_t *depths, unsigned count, fault *f);

/* Begin an area, in 1/100 mm2, larger than the one before. */
bool basic_area(uint32_t area, fault *f);

/* Add a current of the last area, in 1/100 IP, with its least undersize at each depth, in 0.1 um. */
bool basic_current(uint32_t ip, const uint32_t *undersize, unsigned count, fault *f);

/* Take an area out, with its currents. */
bool basic_drop(uint32_t area, fault *f);

/* The lines that would enter the data again, by their number from 0, each without its `$B`. False
   behind the last one. */
bool basic_line(unsigned number, char *text, size_t size);

/* Are there data, and are they complete? False with a fault. */
bool basic_ready(fault *f);

/* Convert a stored whole number: value / unit. */
float basic_number(uint32_t value, int32_t unit);

/* The data, in mm2, mm, IP and um. */
unsigned basic_area_count(void);
unsigned basic_depth_count(void);
unsigned basic_current_count(unsigned area);
float basic_area_of(unsigned area);
float basic_depth_of(unsigned depth);
float basic_ip_of(unsigned area, unsigned current);
float basic_undersize_of(unsigned area, unsigned current, unsigned depth);
