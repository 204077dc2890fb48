/* A chain set in motion by the classical Runge-Kutta method. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_STEPPER_H
#define KT_BENCH_STEPPER_H

#include "chain.h"
#include "kinetree/integrator.h"

typedef struct kt_stepper {
    kt_chain *chain; /* stays the caller's; its error is the first failure */
    kt_integrator *integrator;
    kt_integrator_callbacks callbacks;
    void *memory; /* of the integrator */
    size_t size;
    double *start; /* 2 n: positions, velocities */
} kt_stepper;

/* Allocates all of it for a chain that must outlive it. */
KT_CHECKED kt_status kt_stepper_make(kt_chain *chain, kt_stepper *stepper, kt_error *error);
void kt_stepper_free(kt_stepper *stepper);

/* Task for kt_bench_measure: steps from the chain's state on. */
void kt_stepper_run(void *stepper, long repetitions);

#endif
