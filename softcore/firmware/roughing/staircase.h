// SPDX-License-Identifier: Apache-2.0
/* The roughing planner on the machine: host/roughing, which says what it does and why, on the
   basic data that have been entered (basic.h). It comes to the same staircase. The work is cut into
   steps of less than 5000 clocks. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define STAIRCASE_STEPS 33      /* as many as a series has, and the first */

typedef struct {
    uint32_t area;              /* 1/100 mm2 */
    uint32_t undersize;         /* 0.1 um */
    uint32_t depth_um;
    uint32_t taper;             /* 1/100 degree */
    uint32_t parts;             /* of an IP, into which the supply divides it */
    uint32_t seed;
} staircase_job;

typedef struct {
    uint32_t level;             /* current, in parts of an IP */
    uint32_t depth_um;          /* to which it is used */
} staircase_run;

typedef struct {
    float undersize_um;        /* after the correction for the gradient */
    float ip, beta_um;         /* of the last step: the current before rounding, and what it needs */
    staircase_run runs[STAIRCASE_STEPS];    /* from the last step, the deepest, up */
    uint32_t count;
    uint32_t untrusted;         /* networks for which the interpolation stood in */
    uint32_t beyond;            /* depths that were inferred above the shallowest of the data */
    bool greatest;              /* the undersize allows the greatest current of the data, or more */
    bool ended;                 /* a greater current than the first is not in the data */
    bool single;                /* the data have one depth only */
} staircase_result;

/* Begin; false if there are no complete data. */
bool staircase_begin(const staircase_job *job, fault *f);

/* One step; false when there is nothing left to do. */
bool staircase_step(void);

/* The result when there is nothing left to do; a null pointer if the job was refused. */
const staircase_result *staircase_found(fault *f);
