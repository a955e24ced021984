// SPDX-License-Identifier: Apache-2.0
/* A small neural network that learns two to eight samples of three inputs and an output: the one of
   host/roughing, which says how and why. Both do the same operations in single precision in the same order,
   and so come to the same bits.

   There is one, and one question to it at a time. Learning takes some millions of clocks, so it is
   cut into steps of less than 5000. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define NETWORK_INPUTS 3
#define NETWORK_SAMPLES 8

/* Begin to learn: no samples yet. */
void network_begin(uint32_t seed);

/* Add a sample; those beyond NETWORK_SAMPLES are left out. */
void network_sample(float first, float second, float third, float output);

/* What is to be inferred after learning, and how the output must depend on each input: 1 rise, -1
   fall, 0 as it likes. */
void network_ask(float first, float second, float third, const int8_t signs[NETWORK_INPUTS]);

/* One step; false when there is nothing left to do. */
bool network_step(void);

/* The answer, and whether it can be trusted: all samples were learned, and the output is proved
   monotone over them and the question. */
bool network_answer(float *output);

unsigned network_iterations(void);
