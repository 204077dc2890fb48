/* Experimental. Generated C: the dynamics of one mechanism as C99. Part of libkinetree-scene.
 *
 *     FILE *source = fopen("arm.c", "w"), *header = fopen("arm.h", "w");
 *     status = kt_codegen_write(model, "arm", KT_CODEGEN_FORWARD | KT_CODEGEN_MASS, false, source, header, &error);
 *
 * The two generated files need no library. The functions allocate nothing, and compute sines and cosines themselves.
 * Zeros, axes and rotations of the model are folded into the code. All other numbers are members of NAME_parameters,
 * with the numbers of the model as NAME_default. A program changes members and calls NAME_prepare. Members are masses
 * (kg), centres of mass (m), inertias, positions of joint frames, pitches, armature, markers, and gravity.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_CODEGEN_H
#define KINETREE_CODEGEN_H

#include "kinetree/model.h"
#include "kinetree/simulation.h"

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Functions of a generated file. X(id, name, meaning) */
#define KT_CODEGEN_LIST(X)                                                                                             \
    X(KT_CODEGEN_FORWARD, forward, "accelerations for given joint forces, as kt_dynamics_forward")                     \
    X(KT_CODEGEN_INVERSE, inverse, "joint forces for given accelerations, as kt_dynamics_inverse")                     \
    X(KT_CODEGEN_BIAS, bias, "joint forces without accelerations: gravity, centrifugal and Coriolis forces")           \
    X(KT_CODEGEN_MASS, mass, "the mass matrix, as kt_dynamics_mass")                                                   \
    X(KT_CODEGEN_EFFECTS, effects, "joint forces of all effects, as kt_effect_forces")                                 \
    X(KT_CODEGEN_STATES, states, "rates of auxiliary states, as kt_auxiliary_state_rates")                             \
    X(KT_CODEGEN_ACCELERATION, acceleration, "accelerations under all effects, as kt_acceleration_evaluate")           \
    X(KT_CODEGEN_ENERGY, energy, "kinetic energy, and potential energy of gravity")                                    \
    X(KT_CODEGEN_MARKERS, markers, "positions and velocities of all markers, world axes")                              \
    X(KT_CODEGEN_JACOBIANS, jacobians, "Jacobians of all markers, as kt_point_jacobian")                               \
    X(KT_CODEGEN_INVERSE_DERIVATIVES, inverse_derivatives, "by q and v, as kt_dynamics_inverse_derivatives")           \
    X(KT_CODEGEN_FORWARD_DERIVATIVES, forward_derivatives, "by q, v and tau, as kt_dynamics_forward_derivatives")      \
    X(KT_CODEGEN_EFFECT_DERIVATIVES, effect_derivatives, "derivatives of the forces of effects by q and v")            \
    X(KT_CODEGEN_LOOPS, loops, "equations of the loops: residuals, A, and the right-hand side of accelerations")       \
    X(KT_CODEGEN_PROJECT, project, "positions and velocities projected onto the loops, as kt_state_project")           \
    X(KT_CODEGEN_HEUN, heun, "a step of Heun's method, as kt_step_evaluate with heun")                                 \
    X(KT_CODEGEN_RK4, rk4, "a step of the classical Runge-Kutta method, as kt_step_evaluate with rk4")                 \
    X(KT_CODEGEN_SEMI_IMPLICIT, semi_implicit, "a semi-implicit Euler step, as kt_batch_step_semi_implicit")           \
    X(KT_CODEGEN_HEUN_DERIVATIVES, heun_derivatives, "A and B of a heun step, as kt_step_derivatives")                 \
    X(KT_CODEGEN_RK4_DERIVATIVES, rk4_derivatives, "A and B of an rk4 step, as kt_step_derivatives")                   \
    X(KT_CODEGEN_SEMI_IMPLICIT_DERIVATIVES, semi_implicit_derivatives, "A and B of a semi-implicit Euler step")

/* Indices of functions, in the order of KT_CODEGEN_LIST. */
enum {
    KT_CODEGEN_FORWARD_INDEX,                   /* forward dynamics */
    KT_CODEGEN_INVERSE_INDEX,                   /* inverse dynamics */
    KT_CODEGEN_BIAS_INDEX,                      /* bias forces */
    KT_CODEGEN_MASS_INDEX,                      /* the mass matrix */
    KT_CODEGEN_EFFECTS_INDEX,                   /* forces of effects */
    KT_CODEGEN_STATES_INDEX,                    /* rates of auxiliary states */
    KT_CODEGEN_ACCELERATION_INDEX,              /* accelerations with effects */
    KT_CODEGEN_ENERGY_INDEX,                    /* energies */
    KT_CODEGEN_MARKERS_INDEX,                   /* places of markers */
    KT_CODEGEN_JACOBIANS_INDEX,                 /* Jacobians of markers */
    KT_CODEGEN_INVERSE_DERIVATIVES_INDEX,       /* derivatives of inverse dynamics */
    KT_CODEGEN_FORWARD_DERIVATIVES_INDEX,       /* derivatives of forward dynamics */
    KT_CODEGEN_EFFECT_DERIVATIVES_INDEX,        /* derivatives of forces of effects */
    KT_CODEGEN_LOOPS_INDEX,                     /* equations of loops */
    KT_CODEGEN_PROJECT_INDEX,                   /* projection onto the loops */
    KT_CODEGEN_HEUN_INDEX,                      /* a step of Heun's method */
    KT_CODEGEN_RK4_INDEX,                       /* a step of the classical Runge-Kutta method */
    KT_CODEGEN_SEMI_IMPLICIT_INDEX,             /* a semi-implicit Euler step */
    KT_CODEGEN_HEUN_DERIVATIVES_INDEX,          /* A and B of a heun step */
    KT_CODEGEN_RK4_DERIVATIVES_INDEX,           /* A and B of an rk4 step */
    KT_CODEGEN_SEMI_IMPLICIT_DERIVATIVES_INDEX, /* A and B of a semi-implicit Euler step */
    KT_CODEGEN_COUNT                            /* how many functions there are */
};

/* Bits of functions. */
enum {
#define KT_CODEGEN_BIT(id, name, meaning) id = 1 << id##_INDEX,
    KT_CODEGEN_LIST(KT_CODEGEN_BIT)
#undef KT_CODEGEN_BIT
        KT_CODEGEN_STEPS = KT_CODEGEN_HEUN | KT_CODEGEN_RK4 | KT_CODEGEN_SEMI_IMPLICIT, /* the steps */
    KT_CODEGEN_STEP_DERIVATIVES = 7 << KT_CODEGEN_HEUN_DERIVATIVES_INDEX,               /* their A and B */
    KT_CODEGEN_ALL = (1 << KT_CODEGEN_COUNT) - 1 /* all functions that the model has (kt_codegen_write) */
};

/* Returns the name of a function with the index 0 <= k < KT_CODEGEN_COUNT; NULL for other numbers. */
KT_API const char *kt_codegen_name(int k);

/* Returns the meaning of a function in a few words; NULL for other numbers. */
KT_API const char *kt_codegen_meaning(int k);

/* Returns a hash of all that a generated file folds: types of joints, axes, rotations, zeros, the order of bodies, and
 * loops. The header of a generated file has this number as NAME_STRUCTURE. The file fits a model if both are equal.
 * Returns 0 for NULL.
 * Cost: O(bodies). */
KT_API uint64_t kt_codegen_structure(const kt_model *model);

/* Writes a source file and its header to two streams, which stay open.
 *
 * name: an identifier of C, with which all public names of the file begin.
 * functions: a sum of KT_CODEGEN_ bits.
 * constant: whether all numbers are constants of the file, which then has no parameters.
 *
 * Without loops the functions are those of dynamics.h. With loops, NAME_forward returns the accelerations of the closed
 * mechanism, as kt_acceleration_evaluate, but without effects. NAME_forward_derivatives has their derivatives, as
 * kt_acceleration_derivatives. Steps are projected onto the loops, as kt_step_evaluate. NAME_inverse, NAME_bias and
 * NAME_mass remain the functions of the tree: tau = M a + h is the sum of the joint forces and of the forces A' lambda
 * of the loops. The forces of the loops have no power in a closed motion. NAME_loops has one row for each independent
 * equation (NAME_NR), in axes of the generated file's choice. Equations that repeat others are left out, as when the
 * model was compiled. If a loop depends on time, NAME_forward, NAME_forward_derivatives, NAME_loops, NAME_project and
 * steps have the time as an argument before q.
 *
 * Forces of effects are in NAME_effects, in NAME_acceleration and in the steps alone; add them to the tau of
 * NAME_forward. Derivatives of dynamics leave out forces of effects, too. If forces depend on time, effects and steps
 * have the time as an argument before q. If there are auxiliary states, effects and steps have them as an argument x
 * after v, and a step writes the next x after the next v. NAME_acceleration has both arguments in any case. Effects
 * call functions of the C library.
 *
 * A step also writes NAME_forward, and NAME_effects and NAME_states if the model has these. Its tau is constant from
 * the beginning to the end. With A and B, the next state changes by A (dq, dv) + B dtau. A and B exist for models
 * without quaternions and auxiliary states, and also write NAME_forward_derivatives and NAME_effect_derivatives.
 *
 * With KT_CODEGEN_ALL, functions are left out for which the model has nothing: loops and project without equations,
 * states without auxiliary states, markers and Jacobians without markers, A and B with quaternions or auxiliary states.
 *
 * Matrices are column-major. Outputs that are Jacobians, derivatives or the mass matrix may not overlap the inputs.
 * Each function returns 0. NAME_forward, its derivatives and the steps return the number of the body whose joint has no
 * inertia, or whose quaternion has no norm. NAME_forward, its derivatives, NAME_project and steps return minus the
 * number of a loop, counted from 1, if its equations depend on others in this position, or if it cannot be closed. Then
 * these functions write nothing.
 *
 * Errors: KT_ERROR_ARGUMENT for a wrong name or set of functions. KT_ERROR_MODEL names what cannot be generated: loops
 * on helices or splines, and loops that are functions in C; loops that contradict each other by rounding; bodies of
 * variable mass, coordinates that move no mass, hard contacts, forces along paths, and effects and auxiliary states
 * that are functions in C. KT_ERROR_MEMORY. KT_ERROR_FILE. Cost: O(size of the files). */
KT_API KT_CHECKED kt_status kt_codegen_write(const kt_model *model, const char *name, unsigned functions, bool constant,
                                             FILE *source, FILE *header, kt_error *error);

/* Returns the present numbers of a model in the order of the struct NAME_parameters, for a file with these functions.
 * When the file is written, the numbers are those of NAME_default. After kt_parameter_set, copy the new numbers to a
 * NAME_parameters, and call NAME_prepare. This call writes at most `room` numbers, and the number of all numbers to
 * *count.
 * Errors: those of kt_codegen_write, except for the name and the files. Allocates memory. Cost: that of generating the
 * equations. */
KT_API KT_CHECKED kt_status kt_codegen_numbers(const kt_model *model, unsigned functions, double *numbers, int room,
                                               int *count, kt_error *error);

/* ---- in a simulation --------------------------------------------------------------------------------------------- */

/* NAME_acceleration of a generated file in double precision. Its first argument is a NAME_model. */
typedef int kt_native_acceleration(const void *generic, double t, const double *q, const double *v, const double *x,
                                   const double *tau, double *a);

/* A generated file that is linked to the program, or loaded. The caller sets the first three members. The page
 * include/pages/generated-c.md has a program. */
typedef struct kt_native {
    uint64_t structure;                   /* NAME_STRUCTURE of the header */
    kt_native_acceleration *acceleration; /* NAME_acceleration */
    const void *prepared;                 /* a NAME_model with the numbers of the model; NULL if the file has none */
    const kt_model *model;                /* written by kt_native_use */
    uint64_t computed;                    /* accelerations that the file has computed */
    uint64_t left; /* accelerations that the library has computed: with wrenches on bodies, next to singular positions
                      of loops, and beyond the range of angles */
    int refused;   /* what the file last returned in place of an acceleration: a body, or minus a loop; 0: nothing */
} kt_native;

/* Lets simulations with these options compute accelerations by a generated file, with any method. The library computes
 * projections, derivatives, events and records. A record differs from a record without generated code by rounding, and
 * with adaptive steps by as much as the tolerances permit.
 *
 * Sets `acceleration`, `user` and `equals_model`. The file must have the numbers of the model. If the numbers of the
 * model change, prepare the file's model anew (kt_codegen_numbers). An ensemble advances such simulations one after the
 * other, and batches reject them.
 * Ownership: native, the file's model and the model must outlive the simulation. Simulations in several threads need
 * one kt_native each, and may share the file's model.
 * Errors: KT_ERROR_ARGUMENT (the file was generated for another structure; the options have functions of the
 * caller). On failure native and options are unchanged.
 * Cost: that of kt_codegen_structure. */
KT_API KT_CHECKED kt_status kt_native_use(kt_native *native, const kt_model *model, kt_simulation_options *options,
                                          kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
