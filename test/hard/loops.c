/* Kinds `2, 4 and 7`: loops with more equations than they need, coordinates that cannot be kept, and long runs.
 *
 * For the overconstrained linkages, energy and gaps are watched, and the rank must be that of the mechanism. If
 * rounding makes a superfluous equation look independent, the linkage locks. The particle's angle from upright is that
 * of a pendulum, theta'' = g sin(theta), and has an exact solution (upright.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- more equations than needed ---------------------------------------------------------------------------------- */

static void watch_linkage(kt_hard_watch *w, const kt_hard_view *view) {
    kt_hard_watch_energy(w, view, 0);
    kt_hard_watch_gap(w, view, 1);
    /* It has moved: a linkage that locks keeps its energy, too. */
    w->number[0] = fmax(w->number[0], kt_hard_kinetic(view));
    if (view->t > 0.5 && w->number[0] < 0.1)
        kt_hard_raise(w, 0, 1.0);
}

static const kt_hard_motion bricard = {.scene = "bricard",
                                       .duration = 10.0,
                                       .integrator = "rk4",
                                       .step = 1e-3,
                                       .interval = 0.01,
                                       .rank = 4,
                                       .watch = watch_linkage};
static const kt_hard_motion bennett = {.scene = "bennett",
                                       .duration = 10.0,
                                       .integrator = "rk4",
                                       .step = 1e-3,
                                       .interval = 0.01,
                                       .rank = 2,
                                       .watch = watch_linkage};
static const kt_hard_motion sarrus = {.scene = "sarrus",
                                      .duration = 10.0,
                                      .integrator = "rk4",
                                      .step = 1e-3,
                                      .interval = 0.01,
                                      .rank = 4,
                                      .watch = watch_linkage};
static const kt_hard_motion in_space = {.scene = "four-bar",
                                        .duration = 10.0,
                                        .integrator = "rk4",
                                        .step = 1e-3,
                                        .interval = 0.01,
                                        .rank = 2,
                                        .plan = KT_PLAN_SPATIAL,
                                        .watch = watch_linkage};

/* ---- the particle ------------------------------------------------------------------------------------------------ */

/* Its place against the pendulum's; the start is at rest next to the centre, or moving below it. */
static void watch_particle(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_vec3 p = view->pose[1].position, v = view->twist[1].linear;
    if (w->count == 0)
        w->exact = (kt_upright){9.81L, 0.0L, (long double)atan2(p.x, p.y), (long double)(v.x * p.y - v.y * p.x)};
    kt_upright_move(&w->exact, (long double)view->t);
    kt_hard_raise(w, 0, hypot(p.x - (double)sinl(w->exact.theta), p.y - (double)cosl(w->exact.theta)));
    kt_hard_raise(w, 1, fabs(hypot(p.x, p.y) - 1.0));
}

/* The pendulum starts below the centre at 7 m/s. It passes the top at `sqrt(49 - 4 g) = 3.1` m/s, and goes round and
 * round. */
static bool start_below(kt_hard *h) {
    h->bodies[0].joint.position[0] = 0.0;
    h->bodies[1].joint.position[0] = -1.0;
    h->bodies[0].joint.velocity[0] = 7.0;
    return true;
}

#define PARTICLE                                                                                                       \
    .scene = "particle", .duration = 10.0, .integrator = "rk4", .step = 1e-3, .interval = 0.01, .rank = 1,             \
    .watch = watch_particle, .alone = true
static const kt_hard_motion near_centre = {PARTICLE, .reduction = KT_REDUCTION_PARTITION};
static const kt_hard_motion below = {PARTICLE, .reduction = KT_REDUCTION_PARTITION, .change = start_below};
static const kt_hard_motion near_centre_qr = {PARTICLE};
static const kt_hard_motion below_qr = {PARTICLE, .change = start_below};

/* ---- a million steps --------------------------------------------------------------------------------------------- */

/* number[0] and number[1]: the end of the first tenth, and of the whole. The error of a fixed step may grow as t: from
 * the tenth to the whole by one power of ten. A quantity that oscillates in between is measured by its largest error at
 * any view. */
static void watch_long(kt_hard_watch *w, const kt_hard_view *view) {
    kt_hard_watch_energy(w, view, 0);
    kt_hard_watch_gap(w, view, 1);
    w->number[0] = fmax(w->number[0], view->t);
}

static const kt_hard_motion million = {.scene = "four-bar",
                                       .duration = 1000.0,
                                       .shorter = 50.0,
                                       .integrator = "rk4",
                                       .step = 1e-3,
                                       .interval = 0.05,
                                       .rank = 2,
                                       .watch = watch_long};

/* A tenth of the run, then the whole: how the energy's error has grown, as a power of time. */
static void run_long(kt_hard *h) {
    kt_hard_motion tenth = million;
    kt_hard_watch early, late;
    tenth.duration /= 10.0;
    tenth.shorter /= 10.0;
    bool done = kt_hard_open(h, &tenth) && kt_hard_start(h, &tenth) && kt_hard_follow(h, &tenth, &early);
    kt_hard_close(h);
    done = done && kt_hard_open(h, &million) && kt_hard_start(h, &million) && kt_hard_follow(h, &million, &late);
    if (!done)
        return;
    memcpy(h->observed, late.observed, sizeof h->observed);
    h->observed[2] = log10(late.observed[0] / early.observed[0]);
}

const kt_hard_case kt_hard_loops[] = {
    {.number = 2,
     .name = "Bricard's ring",
     .motion = &bricard,
     .why = "one of five equations is always superfluous, and looks independent once rounding has moved the state",
     .measures = {{"energy", "of the kinetic", 2.5e-11}, {"gap", "m, rad", 1e-12}}},
    {.number = 2,
     .name = "Bennett's linkage",
     .motion = &bennett,
     .why = "three of five equations are superfluous, because lengths and twists happen to fit",
     .measures = {{"energy", "of the kinetic", 2e-11}, {"gap", "m, rad", 1e-12}}},
    {.number = 2,
     .name = "Sarrus' linkage",
     .motion = &sarrus,
     .why = "hinges about x and about y together leave a straight line",
     .measures = {{"energy", "of the kinetic", 4.2e-10}, {"gap", "m, rad", 1e-12}}},
    {.number = 2,
     .name = "planar linkage in space",
     .motion = &in_space,
     .why = "three of the five equations of a hinge say nothing in the plane, and nobody tells the engine",
     .measures = {{"energy", "of the kinetic", 8e-8}, {"gap", "m, rad", 1e-12}}},
    {.number = 4,
     .name = "partition, next to the centre",
     .motion = &near_centre,
     .why = "x cannot be the coordinate that is kept there: it does not move",
     .measures = {{"off the exact motion", "m", 4e-10}, {"off the circle", "m", 1e-15}}},
    {.number = 4,
     .name = "partition, below and above",
     .motion = &below,
     .why = "y cannot be kept there, and x not a quarter of a turn later",
     .measures = {{"off the exact motion", "m", 5e-10}, {"off the circle", "m", 1e-15}}},
    {.number = 4,
     .name = "QR, next to the centre",
     .motion = &near_centre_qr,
     .why = "the same, reduced without a choice of coordinates",
     .measures = {{"off the exact motion", "m", 4e-10}, {"off the circle", "m", 1e-15}}},
    {.number = 4,
     .name = "QR, below and above",
     .motion = &below_qr,
     .why = "the same, reduced without a choice of coordinates",
     .measures = {{"off the exact motion", "m", 5e-10}, {"off the circle", "m", 1e-15}}},
    {.number = 7,
     .name = "a million steps of a four-bar",
     .motion = &million,
     .run = run_long,
     .why = "every step leaves a gap of rounding, which must not add up",
     .measures = {{"energy", "of the kinetic", 6e-6},
                  {"gap", "m, rad", 4.0 * DBL_EPSILON * 1e4},
                  {"energy's error grows as t to the", "", 1.1}}},
    {.name = NULL}};
