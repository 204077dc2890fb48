/* Diagonally implicit methods of one solved stage: implicit Euler and the trapezoidal rule (Crank-Nicolson), [MSD 5.25]
 * and [MSD 5.35].
 *
 * Both are A-stable. Implicit Euler is L-stable and damps every motion. The trapezoidal rule damps none. An infinitely
 * stiff component oscillates from step to step, since R(z) -> -1.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.3.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double ends[] = {0.0, 1.0};
static const double euler_a[] = {0.0, 0.0, 0.0, 1.0}, euler_b[] = {0.0, 1.0};
static const double trapezoid_a[] = {0.0, 0.0, 0.5, 0.5}, trapezoid_b[] = {0.5, 0.5};

const kt_method kt_method_implicit_euler = {
    .name = "implicit-euler",
    .title = "Implicit Euler, 1768: L-stable, damps strongly",
    .source = "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.3",
    .family = &kt_family_dirk,
    .stages = 2,
    .order = 1,
    .fsal = true,
    .a = euler_a,
    .b = euler_b,
    .c = ends,
};

const kt_method kt_method_crank_nicolson = {
    .name = "crank-nicolson",
    .title = "Crank-Nicolson 1947, trapezoidal rule: A-stable, damps nothing",
    .source = "J. Crank, P. Nicolson, Proc. Cambridge Phil. Soc. 43 (1947) 50",
    .family = &kt_family_dirk,
    .stages = 2,
    .order = 2,
    .fsal = true,
    .a = trapezoid_a,
    .b = trapezoid_b,
    .c = ends,
};
