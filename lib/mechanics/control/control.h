/* Declarations that the files of this folder share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTROL_CONTROL_H
#define KT_CONTROL_CONTROL_H

#include "base/arena.h"
#include "control/least.h"
#include "dynamics/dynamics.h"
#include "kinetree/control.h"

static inline bool kt_is_twist_frame(kt_twist_frame frame) { return (unsigned)frame <= KT_TWIST_WORLD; }

/* Returns c_n and c_f of a link (frame.c): the contribution of joint velocities alone to its parent's acceleration. */
kt_twist kt_link_bias(const kt_model *model, const kt_link_kinematics *links, size_t i);

/* The work memory of the calls with a list of coordinates: type, name, count, meaning. */
#define KT_ACTUATION_FIELDS(X)                                                                                         \
    X(double, basis, n->v * n->v, "Z, nv x f")                                                                         \
    X(double, jacobian, n->row * n->v, "A")                                                                            \
    X(double, drift, n->row, "b''")                                                                                    \
    X(double, force, n->v, "M a + h - J' external - Q; a particular solution")                                         \
    X(double, factor, n->v * n->v, "the rows of Z that are chosen")                                                    \
    X(double, reflector_scale, n->v, "its reflectors")                                                                 \
    X(double, norm, n->v, "of its columns")                                                                            \
    X(double, sum, n->v, "in substitutions")                                                                           \
    X(double, right, n->v, "right-hand side")                                                                          \
    X(double, solution, n->v, "solution")                                                                              \
    X(double, unit, n->v, "a large change of each coordinate")                                                         \
    X(double, scale, n->v, "of actuators: their weights to the power -1/2")                                            \
    X(int32_t, pivot, n->v, "order of its columns")                                                                    \
    X(bool, chosen, n->v, "coordinates in the list")

typedef struct kt_actuation_work {
    const kt_model *model;
    int dofs; /* columns of Z */
    kt_least least;
    KT_ARENA_DECLARE(KT_ACTUATION_FIELDS)
} kt_actuation_work;

/* Initialises the work memory and checks the list: KT_ERROR_MEMORY, KT_ERROR_ARGUMENT. */
KT_CHECKED kt_status kt_actuation_begin(const kt_model *model, void *memory, size_t size, kt_coordinate_list list,
                                        kt_actuation_work *w, kt_error *error);

/* Computes Z at (t, q), and factors its rows of the coordinates in the list, each times scale[i] (NULL: 1).
 *
 * lack: the text of the error for a motion in which all these coordinates are at rest.
 *
 * Errors: those of kt_loop_nullspace; KT_ERROR_SINGULAR if a motion Z z exists in which all these coordinates are at
 * rest. The error names the joint that moves most. */
KT_CHECKED kt_status kt_actuation_factor(kt_actuation_work *w, kt_data *data, double t, const double *q,
                                         kt_coordinate_list list, const double *scale, const char *lack,
                                         kt_error *error);

/* Returns the largest motion of the coordinates, in units, while coordinate i moves by one unit.
 *
 * x (nv): the rates of all coordinates for a rate 1 of i. */
double kt_actuation_amplification(const kt_actuation_work *w, const double *x, int i);

#endif
