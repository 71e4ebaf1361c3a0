/* Counter-based noise: a number depends on (seed, purpose, signal, index) and on nothing else. Mirrors `noise.py`. */
#ifndef NOISE_H
#define NOISE_H

#include <stdint.h>

#include "private.h"

/* Ten rounds of Philox 4x32 on a 128-bit counter with a 64-bit key, in place on `counter`. */
PRIVATE void noise_philox4x32(uint32_t counter[4], uint32_t k0, uint32_t k1);

/* A standard normal number by Box and Muller. */
PRIVATE double noise_standard_normal(uint64_t seed, uint64_t signal, uint64_t index, uint32_t purpose);

/* The seed of an instance that is given none: of the default run seed and the instance name. */
PRIVATE double noise_seed_of(uint64_t run_seed, const char *name);

#endif
