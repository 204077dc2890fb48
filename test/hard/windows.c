/* Kinds 1 and 3: linkages through positions where the freedom jumps or the drive is dead.
 *
 * N windows turn as one, theta'' = c sin(theta) (upright.h). The error is the largest distance of a crank's tip from
 * its exact place. One window is a parallelogram. At its change point all bars lie on a line, and it could continue
 * crossed. The coupler would then no longer stay parallel to itself.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- windows ----------------------------------------------------------------------------------------------------- */

/* The first n windows of forty. */
static bool keep_windows(kt_hard *h, int n) {
    h->description.body_count = 2 * n + 1;
    h->description.loop_count = n;
    return true;
}

static bool keep_one(kt_hard *h) { return keep_windows(h, 1); }
static bool keep_two(kt_hard *h) { return keep_windows(h, 2); }
static bool keep_ten(kt_hard *h) { return keep_windows(h, 10); }

/* n windows as those of the scene, which has forty. */
static bool make_windows(kt_hard *h, int n) {
    enum { NAME = 24 };
    if (!kt_hard_make(h, 2 * n + 1, n, 0) || !(h->names = calloc((size_t)(3 * n + 1), NAME)))
        return false;
    const kt_vec3 up = kt_vec3_make(0.0, 1.0, 0.0), along = kt_vec3_make(1.0, 0.0, 0.0);
    h->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    for (int i = 0; i < 2 * n + 1; i++) { /* `crank 0, coupler 1, crank 1` and so on */
        const bool couples = i % 2 == 1;
        kt_body *b = &h->bodies[i];
        char *name = h->names + (size_t)i * NAME;
        (void)snprintf(name, NAME, "%s%d", couples ? "coupler" : "crank", (i + 1) / 2);
        b->name = name;
        b->parent = couples ? name - NAME : NULL;
        b->joint.type = KT_JOINT_REVOLUTE;
        b->joint.at = couples ? up : kt_vec3_make(i / 2, 0.0, 0.0);
        b->joint.velocity[0] = couples ? 1.0 : -1.0;
        b->mass = 1.0;
        b->com = kt_vec3_scale(0.5, couples ? along : up);
        b->inertia = couples ? kt_sym3_make(0.0, 1.0 / 12.0, 1.0 / 12.0, 0.0, 0.0, 0.0)
                             : kt_sym3_make(1.0 / 12.0, 0.0, 1.0 / 12.0, 0.0, 0.0, 0.0);
    }
    for (int k = 0; k < n; k++) {
        kt_loop *l = &h->loops[k];
        char *name = h->names + (size_t)(2 * n + 1 + k) * NAME;
        (void)snprintf(name, NAME, "window%d", k + 1);
        l->name = name;
        l->type = KT_LOOP_REVOLUTE;
        l->axis = kt_vec3_make(0.0, 0.0, 1.0);
        l->between[0].body = h->bodies[2 * k + 1].name;
        l->between[0].at = along;
        l->between[1].body = h->bodies[2 * k + 2].name;
        l->between[1].at = up;
    }
    return true;
}

static bool make_hundred(kt_hard *h) { return make_windows(h, 100); }
static bool make_four_hundred(kt_hard *h) { return make_windows(h, 400); }

/* Two windows start `0.1 s` before they lie flat, at 4.887 rad/s. The hundredth step of 1e-3 s ends there. */
static bool keep_two_before_flat(kt_hard *h) {
    kt_upright m = {(long double)kt_upright_windows(2), 0.0L, 1.570796326794896619231321691639751442L, 4.887L};
    kt_upright_move(&m, -0.1L);
    for (int i = 0; i < 5; i++) {
        const double way = h->bodies[i].parent == NULL ? -1.0 : 1.0;
        h->bodies[i].joint.position[0] = way * (double)m.theta;
        h->bodies[i].joint.velocity[0] = way * (double)m.rate;
    }
    return keep_windows(h, 2);
}

static void watch_tips(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_vec3 up = kt_vec3_make(0.0, 1.0, 0.0);
    if (w->count == 0) {
        const kt_vec3 tip = kt_mat3_apply(view->pose[0].rotation, up);
        w->exact = (kt_upright){(long double)kt_upright_windows(view->description->loop_count), 0.0L,
                                (long double)atan2(tip.x, tip.y), -(long double)view->twist[0].angular.z};
    }
    kt_upright_move(&w->exact, (long double)view->t);
    const double x = (double)sinl(w->exact.theta), y = (double)cosl(w->exact.theta);
    for (int i = 0, crank = 0; i < view->description->body_count; i++) {
        if (view->parent[i] >= 0)
            continue;
        const kt_vec3 tip = kt_pose_apply(view->pose[i], up);
        kt_hard_raise(w, 0, hypot(tip.x - crank - x, tip.y - y));
        crank++;
    }
    kt_hard_watch_gap(w, view, 1);
}

/* The coupler's tilt, too. */
static void watch_parallel(kt_hard_watch *w, const kt_hard_view *view) {
    watch_tips(w, view);
    kt_hard_raise(w, 2, fabs(view->pose[1].rotation.x.y));
}

static const kt_hard_motion two = {.scene = "n-four-bar-40",
                                   .duration = 20.0,
                                   .integrator = "rk4",
                                   .step = 1e-3,
                                   .interval = 0.01,
                                   .rank = 4,
                                   .change = keep_two,
                                   .watch = watch_tips};
static const kt_hard_motion ten = {.scene = "n-four-bar-40",
                                   .duration = 20.0,
                                   .integrator = "rk4",
                                   .step = 1e-3,
                                   .interval = 0.01,
                                   .rank = 20,
                                   .change = keep_ten,
                                   .watch = watch_tips};
/* Adaptive, as test/reference has it; the step is the peers'. */
static const kt_hard_motion forty = {.scene = "n-four-bar-40",
                                     .duration = 20.0,
                                     .shorter = 1.0,
                                     .integrator = "tsit5",
                                     .tolerance = 1e-10,
                                     .step = 1e-3,
                                     .interval = 0.01,
                                     .rank = 80,
                                     .watch = watch_tips};
/* Longer rows, reduced link by link. The suite runs the beginning, and `bench/run hard` all. The longest row takes
 * fixed steps. Tolerances below 1e-10 place ever more steps next to singular positions, and rounding errors enter the
 * motion there. Measured with tsit5: tips are off by 1.3e-8 m at 1e-10. At 1e-11 they are off by 6.7e-6 m. */
static const kt_hard_motion hundred = {.duration = 20.0,
                                       .shorter = 1.0,
                                       .integrator = "tsit5",
                                       .tolerance = 1e-10,
                                       .step = 1e-3,
                                       .interval = 0.01,
                                       .rank = 200,
                                       .change = make_hundred,
                                       .watch = watch_tips};
static const kt_hard_motion four_hundred = {.duration = 20.0,
                                            .shorter = 0.5,
                                            .integrator = "rk4",
                                            .step = 1e-3,
                                            .interval = 0.01,
                                            .rank = 800,
                                            .change = make_four_hundred,
                                            .watch = watch_tips};
static const kt_hard_motion flat = {.scene = "n-four-bar-40",
                                    .duration = 1.0,
                                    .integrator = "rk4",
                                    .step = 1e-3,
                                    .interval = 0.01,
                                    .rank = 4,
                                    .change = keep_two_before_flat,
                                    .watch = watch_tips};
static const kt_hard_motion one = {.scene = "n-four-bar-40",
                                   .duration = 20.0,
                                   .integrator = "rk4",
                                   .step = 1e-3,
                                   .interval = 0.01,
                                   .rank = 2,
                                   .change = keep_one,
                                   .watch = watch_parallel};

/* ---- the slider-crank -------------------------------------------------------------------------------------------- */

/* The piston's place follows from the crank's angle, `x = r cos + sqrt(l^2 - r^2 sin^2)`, on the side where it
 * started. */
static void watch_piston(kt_hard_watch *w, const kt_hard_view *view) {
    const double r = 0.08, l = 0.25;
    const kt_vec3 crank = view->pose[0].rotation.x;
    const double x = r * crank.x + sqrt(l * l - r * r * crank.y * crank.y);
    kt_hard_raise(w, 0, fabs(view->pose[2].position.x - x));
    kt_hard_watch_energy(w, view, 1);
    kt_hard_watch_gap(w, view, 2);
}

static const kt_hard_motion slider = {.scene = "slider-crank",
                                      .duration = 10.0,
                                      .shorter = 2.0,
                                      .integrator = "rk4",
                                      .step = 1e-4,
                                      .interval = 1e-3,
                                      .rank = 2,
                                      .watch = watch_piston};

/* Bounds that are not derived are three times the values measured over the full length. Gaps are rounding of
 * coordinates up to 40 m. The promised bound is 1e-12, or 1e-11 for longer rows. */
const kt_hard_case kt_hard_windows[] = {
    {.number = 1,
     .name = "two four-bar windows",
     .motion = &two,
     .why = "the freedom jumps from 1 to 3 twice a turn, and equations that hold the motion drop out",
     .measures = {{"tips off the exact motion", "m", 1e-7}, {"gap", "m", 1e-12}}},
    {.number = 1,
     .name = "ten windows",
     .motion = &ten,
     .why = "from 1 to 11 freedoms at once",
     .measures = {{"tips off the exact motion", "m", 1e-7}, {"gap", "m", 1e-12}}},
    {.number = 1,
     .name = "forty windows",
     .motion = &forty,
     .why = "from 1 to 41 freedoms at once, in one group of 81 coordinates and 200 equations",
     .measures = {{"tips off the exact motion", "m", 1e-7}, {"gap", "m", 1e-12}}},
    {.number = 1,
     .name = "a hundred windows",
     .motion = &hundred,
     .why = "from 1 to 101 freedoms at once, and rounding along the row",
     .measures = {{"tips off the exact motion", "m", 1e-7}, {"gap", "m", 1e-11}}},
    {.number = 1,
     .name = "four hundred windows",
     .motion = &four_hundred,
     .why = "from 1 to 401 freedoms at once: 801 coordinates, 2000 equations",
     .measures = {{"tips off the exact motion", "m", 1e-7}, {"gap", "m", 1e-11}}},
    {.number = 1,
     .name = "windows, a step lands on it",
     .motion = &flat,
     .why = "the step ends where the rank falls, to 1e-15: an evaluation there has too few equations",
     .measures = {{"tips off the exact motion", "m", 5e-12}, {"gap", "m", 5e-15}}},
    {.number = 3,
     .name = "parallelogram, change point",
     .motion = &one,
     .why = "where all bars lie on a line it may go on crossed just as well",
     .measures = {{"tips off the exact motion", "m", 1e-9}, {"gap", "m", 5e-14}, {"coupler's tilt", "rad", 2.5e-13}}},
    {.number = 3,
     .name = "slider-crank, dead points",
     .motion = &slider,
     .why = "at both dead points the piston does not decide which way the crank goes on",
     .measures = {{"piston off its branch", "m", 8e-15}, {"energy", "of the kinetic", 1.5e-11}, {"gap", "m", 5e-14}}},
    {.name = NULL}};
