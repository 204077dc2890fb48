/* The matrices of Newton's equations (second_order_newton.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_NEWTON_MATRICES_H
#define KT_STEP_NEWTON_MATRICES_H

#include "integrator/complex.h"
#include "step/simulation_core.h"

#define KT_SQUARE(x) ((x) * (x))

/* The matrices of an implicit method: type, name, count, meaning. */
#define KT_NEWTON_ARRAYS(X)                                                                                            \
    X(double, basis, size->basis, "of the velocities that the loops leave, nv x free")                                 \
    X(double, mass, size->free * size->free, "mass matrix, column-major")                                              \
    X(double, stiffness, size->free * size->nv, "stiffness matrix, free x nv")                                         \
    X(double, damping, size->free * size->nv, "damping matrix, free x nv")                                             \
    X(double, along, 2 * size->along, "loops: stiffness and damping along them, free x free each")                     \
    X(double, state_force, size->free * size->states, "of kt_state_derivatives")                                       \
    X(double, rate_q, size->states * size->nv, "likewise")                                                             \
    X(double, rate_v, size->states * size->nv, "likewise")                                                             \
    X(double, rate_x, size->states * size->states, "likewise")                                                         \
    X(double, real, KT_SQUARE(size->free + size->states), "factors for a real sigma")                                  \
    X(double, re, KT_SQUARE(size->free + size->states), "for a complex one, real parts")                               \
    X(double, im, KT_SQUARE(size->free + size->states), "imaginary parts")                                             \
    X(int, pivot, 2 * (size->free + size->states), "of the real and the complex factors")                              \
    X(double, turning, 7 * size->turning, "quaternion and angular velocity of each, where J is from")                  \
    X(double, vectors, size->vectors, "complex vectors of nq + states")                                                \
    X(char, stiffness_work, size->stiffness_work, "of the derivatives")

typedef struct kt_newton_matrices {
    kt_complex sigma[2]; /* sigma of the real and the complex factors */
    KT_ARENA_DECLARE(KT_NEWTON_ARRAYS)
} kt_newton_matrices;

#endif
