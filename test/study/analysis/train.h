/* A train of equal masses on equal springs and dampers, the first of them on a wall: a linear scene in closed form.
 *
 * Displacements u_i of n masses m, springs k and dampers c between neighbours, the last end free: shapes
 * u_i = sin(i theta_j), theta_j = (2 j - 1) pi / (2 n + 1), and m lambda^2 + (c lambda + k) 4 sin^2(theta_j / 2) = 0.
 * Joint coordinates are the differences q_i = u_i - u_{i-1}.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ANALYSIS_TRAIN_H
#define KT_TEST_ANALYSIS_TRAIN_H

#include "fixture.h"
#include "kinetree/stability.h"

enum { TRAIN_MAX = 8 };

typedef struct train {
    int count;
    double mass, stiffness, damping;
    kt_model *model;
} train;

/* Compiles; the running test owns the model. */
void train_open(train *t, int count, double mass, double stiffness, double damping);

/* The faster eigenvalue of shape j = 1 .. n (of a pair the one with im > 0); the shape itself in joint coordinates. */
kt_complex train_eigenvalue(const train *t, int j);
void train_shape(const train *t, int j, double *q);

/* Largest sqrt(energy / energy at the start) of a run. The run starts with velocities in shape j, and in all other
 * shapes a tenth as fast. HUGE_VAL if the run fails. */
double train_growth(const train *t, const kt_method *method, double step, double duration, int j);

#endif
