/* Random mechanisms at singular positions and next to them, for tests against the oracle in quadruple precision. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REFERENCE_NEAR_MECHANISMS_H
#define KT_TEST_REFERENCE_NEAR_MECHANISMS_H

#include "check.h"
#include "quadruple.h"

#include "kinetree/model.h"

typedef struct library {
    kt_description d;
    kt_model_options options;
    kt_body body[QUAD_BODIES];
    kt_loop loop[QUAD_LOOPS];
    char name[QUAD_BODIES + QUAD_LOOPS][8];
    kt_model *model;
    kt_data *data;
    int order[QUAD_BODIES]; /* where each body's coordinates are, in the order of the model */
} library;

/* A mechanism at a singular position q*, left vector lambda, and a direction w of a motion through it. */
typedef struct singular {
    quad_mechanism m;
    quad q[QUAD_NQ], lambda[QUAD_ROWS], w[QUAD_NV];
    double off[QUAD_LOOPS][3];
    int seed;
} singular;

/* The state at h from the singular position, before and after rounding. */
typedef struct near_state {
    quad q[QUAD_NQ], v[QUAD_NV], a[QUAD_NV];
    double q_of[QUAD_NQ], v_of[QUAD_NV];
    double least, most, speed, scale; /* singular values; |v|; the largest acceleration, or 1 */
} near_state;

/* The library's model of a mechanism; false, with a note, if it cannot be compiled. */
bool near_compile(library *l, const quad_mechanism *m);
void near_discard(library *l);

/* The next mechanism of the series after s->seed. */
void near_next(singular *s);

/* How many are taken: 40, or KT_MECHANISMS of the environment. */
int near_mechanisms(void);

/* The state at h from the position, on the motion along w; false if there is none. */
bool near_state_at(const singular *s, const quad_mechanism *m, double h, near_state *n);

/* The mechanism with its points moved by d, and as a description can hold it. */
quad_mechanism near_off_by(const singular *s, double d);

#endif
