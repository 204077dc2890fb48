/* A tree in MuJoCo: the same numbers, and the calls that do the same work. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_MUJOCO_H
#define KT_BENCH_MUJOCO_H

#include "chain.h"

typedef struct kt_mujoco {
    int n, nq;
    void *model, *data;  /* mjModel, mjData */
    const double *q, *v; /* n each: of the chain that it was made from */
    const double *tau, *acceleration;
    double *a, *torque; /* n each: results */
    double *force;      /* n: tau minus the bias force */
    double *mass;       /* n x n */
} kt_mujoco;

/* The version of the library that runs. */
const char *kt_mujoco_version(void);

/* Makes the twin of a chain or of another tree, at its state and under its torques. The caller gives the description of
 * the tree again. Inverse dynamics uses the accelerations in the chain's `a` at the time of the call. The chain must
 * outlive the twin. On failure *error holds the reason. */
KT_CHECKED kt_status kt_mujoco_make(const kt_description *description, const kt_chain *chain, kt_mujoco *twin,
                                    kt_error *error);
void kt_mujoco_free(kt_mujoco *twin);

/* Tasks for kt_bench_measure. Forward: kinematics, comPos, crb, factorM, comVel, rne, solveM. Inverse: kinematics,
 * comPos, comVel, rne. Mass: kinematics, comPos, crb, fullM. Factor: factorM; solve: solveM, tau into a. Contacts,
 * constraints, actuators and passive forces are not called. */
void kt_mujoco_forward(void *twin, long repetitions);
void kt_mujoco_inverse(void *twin, long repetitions);
void kt_mujoco_mass(void *twin, long repetitions);
void kt_mujoco_factor(void *twin, long repetitions);
void kt_mujoco_solve(void *twin, long repetitions);
/* mj_step by its RK4, under tau. */
void kt_mujoco_step(void *twin, long repetitions);

#endif
