/* Closed mechanisms by hand: bars in the plane and in space, and the calls that must succeed on them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CONSTRAINT_LINKAGE_H
#define KT_TEST_CONSTRAINT_LINKAGE_H

#include "fixture.h"

#include "kinetree/integrator.h"
#include "kinetree/mechanism.h"

enum { LINKAGE_BODIES = 96, LINKAGE_LOOPS = 48, LINKAGE_NQ = 2 * LINKAGE_BODIES };

/* Points into itself: not to be copied. */
typedef struct linkage {
    kt_description description;
    kt_model_options options;
    kt_body body[LINKAGE_BODIES];
    kt_loop loop[LINKAGE_LOOPS];
    char body_name[LINKAGE_BODIES][16], loop_name[LINKAGE_LOOPS][16];
    kt_model *model;
    kt_data *data;
    int nq, nv, rows;
    double q[LINKAGE_NQ], v[LINKAGE_NQ]; /* a state */
} linkage;

/* Nothing yet; gravity is -9.81 m/s^2 along y. */
void linkage_begin(linkage *l);

/* A slender uniform bar of 1 kg a metre, from its joint's origin to `to`. It is on a revolute joint about z at `at` of
 * `parent` (NULL: the world). It starts at `angle` and `rate`. It may be changed until the model is compiled. */
kt_body *linkage_bar(linkage *l, const char *name, const char *parent, kt_vec3 at, kt_vec3 to, double angle,
                     double rate);

/* A loop between points of two bodies (NULL: the world). */
kt_loop *linkage_close(linkage *l, const char *name, kt_loop_type type, const char *first, kt_vec3 at,
                       const char *second, kt_vec3 there);

/* The model, its data, and the initial state, which the running test owns. A failure ends the test. */
void linkage_compile(linkage *l);

/* compiles, and assembles at time t */
void linkage_build(linkage *l, double t);

/* Projects the state moved by 1e-4 in alternating directions, on two models of the same mechanism: the largest
 * difference of their positions and velocities. NaN where one cannot be projected. */
double linkage_projections_differ(const kt_model *const model[2], kt_data *const data[2], double t, const double *q,
                                  const double *v);

/* The same of assemblies, moved by up to `far`. */
double linkage_assemblies_differ(const kt_model *const model[2], kt_data *const data[2], double t, const double *q,
                                 const double *v, double far);

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

/* A four-bar in the plane, with ground pivots at 0 and (ground, 0). Crank and rocker start there, and the coupler is on
 * the crank. A loop of this type ("close") closes it on the rocker. Angles are counted from x; it is not assembled if
 * they do not fit. All lengths are multiplied by `size`. */
typedef struct four_bar {
    double crank, coupler, rocker, ground;
    double angle[3]; /* crank, coupler (against the crank), rocker */
    double rate;     /* of the crank */
    double size;
    kt_loop_type type;
} four_bar;
four_bar four_bar_default(void); /* lengths of 1, 2, 1.8, 2.2 m; about closed; revolute */
void linkage_four_bar(linkage *l, const four_bar *f);

/* N + 1 upright cranks of 1 m and N couplers between their tips: the benchmark A02 of the IFToMM library. theta is
 * counted from upright, clockwise. Closed by loops of this type. */
void linkage_windows(linkage *l, int n, double theta, double rate, kt_loop_type type);

/* The exact motion: theta'' = c sin(theta), c = 3/2 g (3 N + 1) / (4 N + 1). */
double windows_acceleration(int n, double theta);

/* Bricard's mechanism, five bars of 1 m and six revolute joints: A04. */
void linkage_bricard(linkage *l);

/* ---- motion ------------------------------------------------------------------------------------------------------ */

/* An integrator at work on a linkage's state. */
typedef struct linkage_run {
    linkage *l;
    void *memory;
    kt_integrator *integrator;
    long evaluations;
} linkage_run;

/* A failure of these ends the test. step > 0: fixed; else `tolerance` is the relative and the absolute one. Begins at
 * l->q, l->v. `loose`: without projection. */
void linkage_run_start(linkage_run *r, linkage *l, const char *method, double step, double tolerance, bool loose,
                       double t);
/* The same with other equations of motion than those of r->l. */
void linkage_run_begin(linkage_run *r, const char *method, double step, double tolerance, double t,
                       const kt_integrator_callbacks *callbacks);
/* On to this time; the state is then l's. */
void linkage_run_to(linkage_run *r, double t);

/* ---- calls that must succeed, or the test ends ------------------------------------------------------------------ */

void linkage_accelerate(const linkage *l, double t, double *a);
kt_residual linkage_residual(const linkage *l, double t);

#endif
