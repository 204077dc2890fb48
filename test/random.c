/* xoshiro256**: Blackman, Vigna, "Scrambled linear pseudorandom number generators", 2018; its state is filled by
 * splitmix64 as its authors advise. A stream's name enters the seed through the FNV-1a hash. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "random.h"

#include <math.h>
#include <stdlib.h>

static const uint64_t default_seed = 20240229;

uint64_t kt_random_seed(void) {
    const char *text = getenv("KT_SEED");
    return text != NULL && *text != '\0' ? strtoull(text, NULL, 0) : default_seed;
}

int kt_sample(int usual) {
    const char *text = getenv("KT_SAMPLE");
    const int wanted = text != NULL ? atoi(text) : usual;
    return wanted > 2 ? wanted : 2;
}

static uint64_t splitmix(uint64_t *x) {
    uint64_t z = *x += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
}

kt_random kt_random_seeded(uint64_t seed, const char *name) {
    uint64_t hash = 0xCBF29CE484222325U;
    for (; *name != '\0'; name++)
        hash = (hash ^ (unsigned char)*name) * 0x100000001B3U;
    uint64_t x = seed ^ hash;
    kt_random random;
    for (int i = 0; i < 4; i++)
        random.s[i] = splitmix(&x);
    return random;
}

kt_random kt_random_named(const char *name) { return kt_random_seeded(kt_random_seed(), name); }

static uint64_t rotate(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

uint64_t kt_random_bits(kt_random *random) {
    uint64_t *s = random->s;
    uint64_t result = rotate(s[1] * 5, 7) * 9;
    uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

static double unit(kt_random *random) { return (double)(kt_random_bits(random) >> 11) * 0x1p-53; }

double kt_random_uniform(kt_random *random, double lower, double upper) {
    double value = lower + (upper - lower) * unit(random);
    return value < upper ? value : lower; /* the sum may round up to upper */
}

int kt_random_int(kt_random *random, int lower, int upper) {
    uint64_t range = (uint64_t)((int64_t)upper - lower) + 1;
    return (int)(lower + (int64_t)((kt_random_bits(random) >> 32) * range >> 32));
}

/* Box and Muller; 1 - u is never 0. */
double kt_random_normal(kt_random *random) {
    double radius = sqrt(-2.0 * log(1.0 - unit(random)));
    return radius * sin(6.283185307179586 * unit(random));
}

void kt_random_direction(kt_random *random, int n, double *x) {
    double square;
    do {
        square = 0.0;
        for (int i = 0; i < n; i++) {
            x[i] = kt_random_normal(random);
            square += x[i] * x[i];
        }
    } while (square < 1e-12);
    for (int i = 0; i < n; i++)
        x[i] /= sqrt(square);
}
