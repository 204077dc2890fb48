/* Kinds 5 and 6: very unequal masses, very long chains, very far away.
 *
 * Round trip: from torques tau to accelerations a by the articulated-body algorithm, and back to torques by Newton and
 * Euler. The algorithm is backward stable. The torques that come back are off by a few eps of the largest torque for
 * each link (4 + n, as in bench/peers). This is independent of the mass matrix's condition.
 *
 * A free chain with neither gravity nor torques keeps linear and angular momentum to rounding. Every step of a
 * Runge-Kutta method keeps linear invariants, and angular momentum to its order. Sums of n terms round by sqrt(n) eps.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- unequal ----------------------------------------------------------------------------------------------------- */

static void watch_energy(kt_hard_watch *w, const kt_hard_view *view) { kt_hard_watch_energy(w, view, 0); }

static const kt_hard_motion ratios = {.scene = "mass-ratios",
                                      .duration = 10.0,
                                      .integrator = "dop853",
                                      .tolerance = 1e-11,
                                      .step = 1e-4,
                                      .interval = 0.01,
                                      .watch = watch_energy};
static const kt_hard_motion massless = {.scene = "massless-link",
                                        .duration = 10.0,
                                        .integrator = "dop853",
                                        .tolerance = 1e-11,
                                        .step = 1e-3,
                                        .interval = 0.01,
                                        .watch = watch_energy};
static const kt_hard_motion needles = {
    .scene = "needles", .duration = 10.0, .integrator = "rk4", .step = 1e-3, .interval = 0.01, .watch = watch_energy};

/* A chain of n bars of 1 m, hinged about z and x by turns; `name` and the rest are the caller's. */
static bool make_chain(kt_hard *h, int n) {
    enum { NAME = 16 };
    if (!kt_hard_make(h, n, 0, 0) || !(h->names = calloc((size_t)n, NAME)))
        return false;
    for (int i = 0; i < n; i++) {
        kt_body *b = &h->bodies[i];
        char *name = h->names + (size_t)i * NAME;
        (void)snprintf(name, NAME, "b%d", i);
        b->name = name;
        b->parent = i ? name - NAME : NULL;
        b->joint.type = KT_JOINT_REVOLUTE;
        b->joint.axis = i % 2 ? kt_vec3_make(1.0, 0.0, 0.0) : kt_vec3_make(0.0, 0.0, 1.0);
        b->joint.at = kt_vec3_make(0.0, i ? -1.0 : 0.0, 0.0);
        b->mass = 1.0;
        b->com = kt_vec3_make(0.0, -0.5, 0.0);
        b->inertia = kt_sym3_make(1.0 / 12.0, 1e-3, 1.0 / 12.0, 0.0, 0.0, 0.0);
    }
    return true;
}

enum { LINKS = 60 };

/* sine, so that there is no need of a random generator: torques of all sizes and both signs */
static double some(int i) { return sin(12.9898 * (i + 1)); }

/* a -> tau -> a' : of torques that are of the size that each link needs. */
static double trip(kt_hard *h, kt_data *data) {
    double q[LINKS], v[LINKS], tau[LINKS], a[LINKS], back[LINKS], worst = 0.0, scale = 0.0;
    kt_error error;
    for (int i = 0; i < LINKS; i++) {
        q[i] = some(i);
        v[i] = some(i + 100);
        tau[i] = some(i + 200);
    }
    double bias[LINKS];
    if (!kt_hard_fine(h, kt_dynamics_inverse(h->model, data, q, v, NULL, NULL, bias, &error), &error) ||
        !kt_hard_fine(h, kt_dynamics_forward(h->model, data, q, v, tau, NULL, a, &error), &error) ||
        !kt_hard_fine(h, kt_dynamics_inverse(h->model, data, q, v, a, NULL, back, &error), &error))
        return (double)NAN;
    for (int i = 0; i < LINKS; i++) {
        worst = fmax(worst, fabs(back[i] - tau[i]));
        scale = fmax(scale, fmax(fabs(bias[i]), fabs(tau[i])));
    }
    return worst / scale;
}

static void run_trip(kt_hard *h) {
    static const double masses[] = {1e6, 1.0, 1e-6, 1.0, 0.0};
    static const kt_hard_motion any = {.integrator = "rk4"};
    kt_data *data = NULL;
    kt_error error;
    if (!make_chain(h, LINKS))
        return;
    for (int i = 0; i < LINKS; i++) {
        const double m = i == LINKS - 1 ? 1.0 : masses[i % 5];
        h->bodies[i].mass = m;
        h->bodies[i].inertia = kt_sym3_make(m / 12.0, m * 1e-12, m / 12.0, 0.0, 0.0, 0.0);
    }
    if (kt_hard_compile(h, &any) && kt_hard_fine(h, kt_data_create(h->model, &data, &error), &error))
        h->observed[0] = trip(h, data);
    kt_data_free(data);
}

/* ---- long -------------------------------------------------------------------------------------------------------- */

/* Adrift, folded like a rule: bars turn to and fro about z and x, every other at 1 rad/s, so that the whole does not.
 */
static bool drift(kt_hard *h, int n) {
    static const double angle[] = {0.5, -0.5}, rate[] = {1.0, -1.0};
    if (!make_chain(h, n))
        return false;
    h->bodies[0].joint.type = KT_JOINT_FREE;
    for (int i = 1; i < n; i++) {
        h->bodies[i].joint.axis = (i + 1) / 2 % 2 ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_make(1.0, 0.0, 0.0);
        h->bodies[i].joint.position[0] = angle[i % 2];
        h->bodies[i].joint.velocity[0] = rate[i % 2];
    }
    return true;
}

static bool drift_thousand(kt_hard *h) { return drift(h, 1000); }
static bool drift_ten_thousand(kt_hard *h) { return drift(h, 10000); }

/* Momenta against sums of magnitudes: sum m |v_c| <= n sqrt(2 T / n) for linear, and the chain's half length times that
 * for angular momentum. */
static void watch_momentum(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_wrench now = kt_hard_momentum(view);
    const double n = view->description->body_count, magnitude = sqrt(2.0 * n * kt_hard_kinetic(view));
    kt_hard_watch_energy(w, view, 0);
    if (w->count == 0) {
        w->momentum = now;
        w->momentum_most = magnitude;
    }
    kt_hard_raise(w, 1, kt_vec3_norm(kt_vec3_sub(now.force, w->momentum.force)) / w->momentum_most);
    kt_hard_raise(w, 2, kt_vec3_norm(kt_vec3_sub(now.moment, w->momentum.moment)) / (0.5 * n * w->momentum_most));
}

static const kt_hard_motion thousand = {.duration = 1.0,
                                        .shorter = 0.2,
                                        .integrator = "rk4",
                                        .step = 1e-3,
                                        .interval = 0.1,
                                        .change = drift_thousand,
                                        .watch = watch_momentum};
static const kt_hard_motion ten_thousand = {.duration = 1.0,
                                            .shorter = 0.02,
                                            .integrator = "rk4",
                                            .step = 1e-3,
                                            .interval = 0.01,
                                            .change = drift_ten_thousand,
                                            .watch = watch_momentum,
                                            .alone = true};

/* ---- far --------------------------------------------------------------------------------------------------------- */

static const kt_hard_motion near_by = {.scene = "four-bar",
                                       .duration = 10.0,
                                       .integrator = "rk4",
                                       .step = 1e-3,
                                       .interval = 10.0,
                                       .rank = 2,
                                       .watch = watch_energy};

/* Everything on the world moves with it: joints, and ends of loops. */
static bool move_away(kt_hard *h) {
    const kt_vec3 far = kt_vec3_make(1e6, -1e6, 1e6);
    for (int i = 0; i < h->description.body_count; i++)
        if (!h->bodies[i].parent)
            h->bodies[i].joint.at = kt_vec3_add(h->bodies[i].joint.at, far);
    for (int i = 0; i < h->description.loop_count; i++)
        for (int k = 0; k < 2; k++)
            if (!h->loops[i].between[k].body)
                h->loops[i].between[k].at = kt_vec3_add(h->loops[i].between[k].at, far);
    return true;
}

/* The same run at the origin and 1700 km away: joints' positions at the end. */
static void run_far_of(kt_hard *h, const char *scene, int rank) {
    enum { NQ = 16 };
    double q[2][NQ] = {{0.0}};
    kt_hard_motion motion = near_by;
    motion.scene = scene;
    motion.rank = rank;
    kt_hard_watch watch;
    for (int far = 0; far < 2; far++) {
        motion.change = far ? move_away : NULL;
        if (!kt_hard_open(h, &motion) || !kt_hard_start(h, &motion) || !kt_hard_follow(h, &motion, &watch))
            return;
        memcpy(q[far], kt_simulation_positions(h->simulation), (size_t)kt_model_nq(h->model) * sizeof(double));
        kt_hard_close(h);
    }
    h->observed[0] = 0.0;
    for (int i = 0; i < NQ; i++)
        h->observed[0] = fmax(h->observed[0], fabs(q[1][i] - q[0][i]));
}

static void run_far(kt_hard *h) { run_far_of(h, "four-bar", 2); }
static void run_far_ring(kt_hard *h) { run_far_of(h, "bricard", 4); }

/* Energies and momenta: three times the values measured over the full length. The far mechanisms are placed at whole
 * metres, which are exact there too. All positions are counted from one of their joints. Their runs are therefore equal
 * to the bit. */
const kt_hard_case kt_hard_masses[] = {
    {.number = 5,
     .name = "mass ratios of 1e6 and 1e-6",
     .motion = &ratios,
     .why = "the mass matrix spans twelve orders, and what moves the light one is lost in rounding of the heavy one",
     .measures = {{"energy", "of the kinetic", 2e-12}}},
    {.number = 5,
     .name = "massless link between bars",
     .motion = &massless,
     .why = "a link without inertia cannot be accelerated by itself",
     .measures = {{"energy", "of the kinetic", 6e-11}}},
    {.number = 5,
     .name = "needles, 1e-12 about the axis",
     .motion = &needles,
     .why = "a needle has next to no inertia about its own axis, and any rounding spins it",
     .measures = {{"energy", "of the kinetic", 2.1e-8}}},
    {.number = 5,
     .name = "torques and back, 60 such links",
     .run = run_trip,
     .why = "what goes in as torque must come out, though accelerations differ by twelve orders",
     .measures = {{"torque", "of the largest", (4.0 + LINKS) * DBL_EPSILON}}},
    {.number = 6,
     .name = "chain of 1,000 links",
     .motion = &thousand,
     .why = "errors add up along a chain",
     .measures = {{"energy", "of the kinetic", 2e-12},
                  {"momentum", "of the whole", 1.3e-12},
                  {"angular momentum", "of the whole", 2e-13}}},
    {.number = 6,
     .name = "chain of 10,000 links",
     .motion = &ten_thousand,
     .why = "the same, and recursion must not eat the stack",
     .measures = {{"energy", "of the kinetic", 2e-12},
                  {"momentum", "of the whole", 1.3e-12},
                  {"angular momentum", "of the whole", 6e-13}}},
    {.number = 6,
     .name = "four-bar 1700 km away",
     .run = run_far,
     .why = "there a double tells places to 1e-10 m only",
     .measures = {{"positions, against the one at the origin", "rad", 0.0}}},
    {.number = 6,
     .name = "Bricard's ring 1700 km away",
     .run = run_far_ring,
     .why = "there rounding of places, 1e-10 m, would make superfluous equations disagree",
     .measures = {{"positions, against the one at the origin", "rad", 0.0}}},
    {.name = NULL}};
