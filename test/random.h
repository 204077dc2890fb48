/* Random numbers for tests: xoshiro256** (Blackman and Vigna, 2018) seeded by splitmix64. Equal on every machine, but
 * for the last bits of the normal ones (log and sine).
 *
 * The seed is fixed unless the environment variable KT_SEED gives another, and is printed once by each program. A
 * stream depends on the seed and on its name alone, so a test sees the same numbers when it is run by itself.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_RANDOM_H
#define KT_TEST_RANDOM_H

#include <stdint.h>

typedef struct kt_random {
    uint64_t s[4];
} kt_random;

uint64_t kt_random_seed(void);

/* The stream of the test that is running. */
kt_random kt_random_of_test(void);

/* The number of random scenes of a test: KT_SAMPLE, two or more, if that is set. Sanitizers need a few alone. */
int kt_sample(int usual);

/* A number of random scenes in FOLDER-long, and a short sample of it in FOLDER-quick. */
#ifdef KT_QUICK
#define KT_SHORT(quick, usual) (quick)
#else
#define KT_SHORT(quick, usual) (usual)
#endif

/* A stream of any name, and with another seed. */
kt_random kt_random_named(const char *name);
kt_random kt_random_seeded(uint64_t seed, const char *name);

uint64_t kt_random_bits(kt_random *random);

/* lower <= value < upper */
double kt_random_uniform(kt_random *random, double lower, double upper);

/* lower <= value <= upper */
int kt_random_int(kt_random *random, int lower, int upper);

/* Mean 0, variance 1. */
double kt_random_normal(kt_random *random);

/* A direction, uniform on the sphere in n dimensions (n = 3: an axis; n = 4: a rotation as a quaternion). */
void kt_random_direction(kt_random *random, int n, double *x);

#endif
