/* A generated file, compiled by the system's compiler and loaded. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CODEGEN_GENERATED_H
#define KT_TEST_CODEGEN_GENERATED_H

#include "mechanics/dynamics/tree.h"

#include "kinetree/codegen.h"
#include "kinetree/sensitivity.h"

/* All functions but those that some models cannot have, or that have tests of their own. */
enum {
    KT_GENERATED_USUAL = KT_CODEGEN_ALL & ~(KT_CODEGEN_STATES | KT_CODEGEN_EFFECT_DERIVATIVES |
                                            KT_CODEGEN_STEP_DERIVATIVES | KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT),
    KT_GENERATED_WITH_LOOPS = KT_CODEGEN_FORWARD | KT_CODEGEN_ACCELERATION | KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT |
                              KT_CODEGEN_STEPS | KT_CODEGEN_FORWARD_DERIVATIVES
};

enum { KT_GENERATED_PARAMETERS = 800, KT_GENERATED_NAME = 64, KT_GENERATED_PREPARED = 40000 };

typedef int kt_generated_rates(const void *model, const double *q, const double *v, double *out);
typedef int kt_generated_given(const void *model, const double *q, const double *v, const double *x, double *out);
typedef int kt_generated_mass(const void *model, const double *q, double *out);
typedef int kt_generated_markers(const void *model, const double *q, const double *v, double *at, double *rate);
typedef int kt_generated_pair(const void *model, const double *q, const double *v, const double *x, double *by_q,
                              double *by_v);
typedef int kt_generated_three(const void *model, const double *q, const double *v, const double *x, double *by_q,
                               double *by_v, double *by_x);
typedef int kt_generated_loops(const void *model, const double *q, const double *v, double *phi, double *a,
                               double *right);
typedef int kt_generated_step(const void *model, const double *q, const double *v, const double *tau, double h,
                              double *next_q, double *next_v);
typedef int kt_generated_timed(const void *model, double t, const double *q, const double *v, double *out);
typedef int kt_generated_timed_given(const void *model, double t, const double *q, const double *v, const double *x,
                                     double *out);
typedef int kt_generated_timed_three(const void *model, double t, const double *q, const double *v, const double *x,
                                     double *by_q, double *by_v, double *by_x);
typedef int kt_generated_timed_pair(const void *model, double t, const double *q, const double *v, double *at,
                                    double *rate);
typedef int kt_generated_timed_loops(const void *model, double t, const double *q, const double *v, double *phi,
                                     double *a, double *right);
typedef int kt_generated_timed_step(const void *model, double t, const double *q, const double *v, const double *tau,
                                    double h, double *next_q, double *next_v);
typedef void kt_generated_prepare(const double *parameters, double *model);

typedef struct kt_generated {
    const char *folder;
    void *library; /* NULL: there is none */
    int count;     /* of parameters, with their names as in the header */
    char name[KT_GENERATED_PARAMETERS][KT_GENERATED_NAME];
    bool is_articulated;    /* its accelerations do not follow from the mass matrix */
    bool is_planar;         /* they follow from articulated bodies in a plane */
    bool has_parts[2];      /* the functions forward and mass are divided */
    bool loops_have_time;   /* forward, loops, project and steps have it as an argument */
    const double *standard; /* NAME_default */
    double model[KT_GENERATED_PREPARED];
    kt_generated_prepare *prepare;
    kt_generated_given *forward, *inverse;
    kt_native_acceleration *acceleration;
    kt_generated_rates *bias, *effects, *energy;
    kt_generated_mass *mass, *jacobians;
    kt_generated_pair *inverse_derivatives;
    kt_generated_three *forward_derivatives;
    kt_generated_markers *markers, *project;
    kt_generated_loops *loops;
    kt_generated_step *heun, *rk4, *semi_implicit;
    /* If forces depend on time, the functions of these addresses have it as an argument. */
    kt_generated_timed *effects_at;
    /* The same of loops. */
    kt_generated_timed_given *forward_at;
    kt_generated_timed_three *forward_derivatives_at;
    kt_generated_timed_pair *project_at;
    kt_generated_timed_loops *loops_at;
    kt_generated_timed_step *heun_at, *rk4_at, *semi_implicit_at;
} kt_generated;

/* Whether there is a compiler of this name. */
bool kt_generated_has(const char *compiler);

/* Skips the rest of the running test if there is no compiler of the name cc. */
void kt_generated_need_compiler(void);

/* Generates KT_GENERATED_USUAL of a model as mech.c, compiles with a command such as "cc -O1", loads, and prepares the
 * standard parameters. A failure ends the test. The file and its functions stay until the end of the test. */
void kt_generated_make(kt_generated *g, const kt_model *model, const char *compile);
/* The same without derivatives, which take most of the time of a compiler; their functions are NULL. */
void kt_generated_make_plain(kt_generated *g, const kt_model *model, const char *compile);
/* The same with some functions. If they are those of effects and steps alone, forces depend on time. */
void kt_generated_make_some(kt_generated *g, const kt_model *model, unsigned functions, const char *compile, bool fold);
/* The same with all numbers fixed: there are no parameters, and the functions ignore their model. */
void kt_generated_fold(kt_generated *g, const kt_model *model, const char *compile);

/* The library's step at the time t to the positions and velocities `next`; for the method NULL v += h a, then
 * q (+) h v, and with loops a projection. A failure ends the test. */
void kt_generated_library_step(const kt_tree *tree, const kt_method *method, double t, double h, const kt_tree_state *s,
                               double *next);

/* The number of a description that a parameter represents; NULL fails the test. */
double *kt_generated_number(kt_tree *tree, const char *name);

#endif
