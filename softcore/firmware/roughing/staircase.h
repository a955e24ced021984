// SPDX-License-Identifier: Apache-2.0
/* The roughing planner on the controller. host/roughing explains it and finds the same staircase.
   It works on the basic data that have been entered (basic.h). The work is cut into steps of less
   than 5000 clocks. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

#define STAIRCASE_STEPS 33      /* the first condition, and as many as a depth series can have */

typedef struct {
    uint32_t area;              /* 1/100 mm2 */
    uint32_t undersize;         /* 0.1 um */
    uint32_t depth_um;
    uint32_t taper;             /* 1/100 degree */
    uint32_t parts;             /* steps of the power supply in one IP */
    uint32_t seed;
    uint32_t rmax;              /* roughness of the finished surface, 0.1 um */
} staircase_job;

typedef struct {
    uint32_t level;             /* current, in steps of the power supply */
    uint32_t depth_um;          /* depth to which it is used */
} staircase_run;

typedef struct {
    float undersize_um;         /* after the correction for the gradient */
    float ip, beta_um;          /* of the last step: current before rounding, undersize needed */
    float bottom_um, side_um;   /* stock left by the last step; on the side for the roughness */
    staircase_run runs[STAIRCASE_STEPS];    /* from the last step, the deepest, up */
    uint32_t count;
    uint32_t untrusted;         /* networks that were replaced by interpolation */
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
