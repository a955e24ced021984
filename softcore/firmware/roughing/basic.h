// SPDX-License-Identifier: Apache-2.0
/* Basic data of the roughing planner for a few pairs of materials: the undersize that each current
   needs at each depth, and the stock that it leaves, for a few areas. They are entered line by line
   in this order: the pair's name, the depths, the finishes, then for each area the area and its
   currents. The rules are those of
   tapes/basic/README.md. One pair is in force: lines enter its data, and the planner uses them. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

#define BASIC_PAIRS 4
#define BASIC_NAME 24           /* characters of a pair's name, and its end */
#define BASIC_AREAS 16          /* of all pairs */
#define BASIC_DEPTHS 12
#define BASIC_CURRENTS 16       /* of an area */
#define BASIC_ROWS 160          /* currents of all areas: ten whole ones */
#define BASIC_STOCKS 2          /* on the bottom, on the side */
#define BASIC_FINISHES 6

/* Forget the data of all pairs; that in force has no name then. */
void basic_forget(void);

/* Put the pair of that name in force, whether there are data of it or not. */
void basic_select(const char *name);
const char *basic_selected(void);

/* Take a pair out, with all its data. */
bool basic_remove(const char *name, fault *f);

/* Forget the data of the pair in force and set its depths, in um. It is the last of the pairs then.
   Only areas of the last pair can be entered. */
bool basic_depths(const uint32_t *depths, unsigned count, fault *f);

/* Set the finishes of the pair in force, if it is the last: pairs of a roughness, in 0.1 um Rmax, and
   by how much the stock on the side differs from that for 1 um, a signed number of 0.1 um. The
   roughness rises; the stock does not rise with it, and differs by 0 at 1 um. */
bool basic_finish(const uint32_t *values, unsigned count, fault *f);

/* Begin an area, in 1/100 mm2, larger than the one before of the pair. */
bool basic_area(uint32_t area, fault *f);

/* Add a current of the last area, in 1/100 IP. The values, in 0.1 um, are its least undersize at each
   depth and, if it is known, the stock that it leaves on bottom and side, else 0. */
bool basic_current(uint32_t ip, const uint32_t *values, unsigned count, fault *f);

/* Take an area of the pair in force out, with its currents. */
bool basic_drop(uint32_t area, fault *f);

/* The lines that would enter the data of all pairs again, by their number from 0, each without its
   `$B`. False behind the last one. */
bool basic_line(unsigned number, char *text, size_t size);

/* Are there data of the pair in force, and are they complete? False with a fault. */
bool basic_ready(fault *f);

/* Convert a stored whole number: value / unit. */
float basic_number(uint32_t value, int32_t unit);

/* The data of the pair in force, in mm2, mm, IP and um. */
unsigned basic_area_count(void);
unsigned basic_depth_count(void);
unsigned basic_current_count(unsigned area);
float basic_area_of(unsigned area);
float basic_depth_of(unsigned depth);
float basic_ip_of(unsigned area, unsigned current);
float basic_undersize_of(unsigned area, unsigned current, unsigned depth);
float basic_stock_of(unsigned area, unsigned current, unsigned side);

/* Finishes of the pair in force: that of 1 um alone if none have been entered. Roughness in um, and
   difference of the stock in um. */
unsigned basic_finish_count(void);
float basic_roughness_of(unsigned finish);
float basic_difference_of(unsigned finish);
