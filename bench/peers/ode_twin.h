/* A mechanism in ODE. Every body is free and every joint is a constraint, as in this library's absolute formulation.
 * Semi-implicit Euler steps are taken by dWorldStep, whose exact solver is cubic in the number of constraints. With
 * more than 50 bodies the iterative dWorldQuickStep is used. Error reduction and mixing have ODE's defaults. Contacts
 * with the ground have Coulomb's pyramid along the slip (dContactApprox1). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PEERS_ODE_TWIN_H
#define KT_BENCH_PEERS_ODE_TWIN_H

#include "twin.h"

typedef struct kt_ode_twin kt_ode_twin;

/* Builds the twin at the poses and twists of `source`; NULL if a body has no mass or there is no memory. */
kt_ode_twin *kt_ode_twin_create(const kt_twin *source);
void kt_ode_twin_free(kt_ode_twin *twin);

/* Puts all bodies where the poses and twists of the source are. */
void kt_ode_twin_start(kt_ode_twin *twin);
void kt_ode_twin_step(kt_ode_twin *twin, double step, long count);

/* From now on, steps are taken by dWorldQuickStep. */
void kt_ode_twin_set_quick(kt_ode_twin *twin);

/* The hinge between body i and its parent: its angle from the start, and a torque for the next step. */
double kt_ode_twin_angle(const kt_ode_twin *twin, int i, double *rate);
void kt_ode_twin_turn(kt_ode_twin *twin, int i, double torque);

/* Writes poses and twists of the bodies' frames into those of `to`. */
void kt_ode_twin_read(const kt_ode_twin *twin, const kt_twin *to);

#endif
