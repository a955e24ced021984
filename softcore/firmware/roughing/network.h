// SPDX-License-Identifier: Apache-2.0
/* A small neural network that learns two to eight samples of three inputs and one output.
   host/roughing has the same network and explains it. Both do the same operations in single
   precision in the same order, so their results are the same to the bit.

   There is one network, with one question at a time. Learning takes some millions of clocks, so it
   is cut into steps of less than 5000. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define NETWORK_INPUTS 3
#define NETWORK_SAMPLES 8

/* Begin to learn: no samples yet. */
void network_begin(uint32_t seed);

/* Add a sample; samples beyond NETWORK_SAMPLES are ignored. */
void network_sample(float first, float second, float third, float output);

/* Set the inputs of the question, for which an output is wanted. `signs` says how the output must
   depend on each input: 1 rising, -1 falling, 0 free. */
void network_ask(float first, float second, float third, const int8_t signs[NETWORK_INPUTS]);

/* One step; false when there is nothing left to do. */
bool network_step(void);

/* Get the output. Returns whether it can be trusted: all samples were learned, and the output is
   proved to be monotone over the samples and the question. */
bool network_answer(float *output);

unsigned network_iterations(void);
