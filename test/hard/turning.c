/* Kind 8: fast and awkward rotations.
 *
 * Three quantities are kept. The first is energy. The second is angular momentum: all of it in free flight, and that
 * about the vertical under gravity. The third is the spin of a body of revolution about its own axis. A body that spins
 * about its intermediate axis turns over at regular times. Elliptic integrals give the period (apps/scenes/flip.yaml:
 * every 5.0259 s), and thus the number of turns.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <math.h>

/* ---- a rotor in gimbals ------------------------------------------------------------------------------------------ */

/* About the vertical, the outer gimbal's free axis. */
static void watch_gimbals(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_wrench now = kt_hard_momentum(view);
    kt_hard_watch_energy(w, view, 0);
    if (w->count == 0) {
        w->momentum = now;
        w->momentum_most = kt_vec3_norm(now.moment);
    }
    kt_hard_raise(w, 1, fabs(now.moment.z - w->momentum.moment.z) / w->momentum_most);
}

static const kt_hard_motion gimbals = {.scene = "gimbals",
                                       .duration = 2.0,
                                       .shorter = 0.2,
                                       .integrator = "dop853",
                                       .tolerance = 1e-11,
                                       .step = 1e-5,
                                       .interval = 0.01,
                                       .watch = watch_gimbals};

/* ---- a racket ---------------------------------------------------------------------------------------------------- */

/* number[0]: times that the intermediate axis has turned over, that is, passed at right angles to where it began. */
static void watch_flips(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_wrench now = kt_hard_momentum(view);
    const double along = kt_vec3_dot(kt_mat3_apply(view->pose[0].rotation, kt_vec3_make(0.0, 1.0, 0.0)), now.moment);
    kt_hard_watch_energy(w, view, 0);
    if (w->count == 0)
        w->momentum = now;
    kt_hard_raise(w, 1, kt_vec3_norm(kt_vec3_sub(now.moment, w->momentum.moment)) / kt_vec3_norm(w->momentum.moment));
    if (w->count > 0 && (along > 0.0) != (w->number[1] > 0.0))
        w->number[0] += 1.0;
    w->number[1] = along;
    /* Half a period lies before the first turn and half of one behind the last. */
    w->observed[2] = fabs(w->number[0] - floor(view->t / 5.0259 + 0.5));
}

/* The duration of 1256.4 s is 249.985 periods. It ends half a period away from the next turn, as `250 times 5.0259` s
 * are 1256.475 s. */
static const kt_hard_motion flips = {.scene = "flip",
                                     .duration = 1256.4,
                                     .shorter = 100.518,
                                     .integrator = "dop853",
                                     .tolerance = 1e-12,
                                     .step = 1e-3,
                                     .interval = 0.1,
                                     .watch = watch_flips};

/* ---- tops -------------------------------------------------------------------------------------------------------- */

/* Watches each top: the angular momentum about the vertical through its point, and its spin. */
static void watch_tops(kt_hard_watch *w, const kt_hard_view *view) {
    kt_hard_watch_energy(w, view, 0);
    for (int i = 0; i < 2; i++) {
        const kt_body *body = &view->description->bodies[i];
        const kt_vec3 body_axis = view->pose[i].rotation.z, omega = view->twist[i].angular;
        const kt_sym3 about =
            kt_sym3_rotate(view->pose[i].rotation, kt_sym3_shift(body->inertia, body->mass, body->com));
        const double vertical = kt_sym3_apply(about, omega).z, spin = kt_vec3_dot(omega, body_axis);
        if (w->count == 0) {
            w->number[2 * i] = vertical;
            w->number[2 * i + 1] = spin;
        }
        kt_hard_raise(w, 1, fabs(vertical / w->number[2 * i] - 1.0));
        kt_hard_raise(w, 2, fabs(spin / w->number[2 * i + 1] - 1.0));
    }
}

static const kt_hard_motion tops = {.scene = "spinning-top",
                                    .duration = 100.0,
                                    .shorter = 20.0,
                                    .integrator = "dop853",
                                    .tolerance = 1e-12,
                                    .step = 1e-3,
                                    .interval = 0.01,
                                    .watch = watch_tops};

/* ---- gimbal lock ------------------------------------------------------------------------------------------------- */

static void watch_pair(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_mat3 a = view->pose[0].rotation, b = view->pose[1].rotation;
    kt_hard_raise(w, 0, fmax(kt_vec3_norm(kt_vec3_sub(a.x, b.x)), kt_vec3_norm(kt_vec3_sub(a.z, b.z))));
    kt_hard_watch_energy(w, view, 1);
}

static const kt_hard_motion lock = {
    .scene = "gimbal-lock", .duration = 10.0, .integrator = "rk4", .step = 1e-3, .interval = 0.1, .watch = watch_pair};

/* Three times the values measured over the full length, except for the turns, which are counted. */
const kt_hard_case kt_hard_turning[] = {
    {.number = 8,
     .name = "rotor at 1e4 rad/s in gimbals",
     .motion = &gimbals,
     .why = "the gimbals tremble at the rotor's pace, and almost all energy is in a spin that does not change",
     .measures = {{"energy", "of the kinetic", 3e-14}, {"momentum about the vertical", "of all", 6e-13}}},
    {.number = 8,
     .name = "intermediate axis, 1000 turns",
     .motion = &flips,
     .why = "the axis is unstable: an error grows a thousandfold before every flip",
     .measures = {{"energy", "of the kinetic", 2e-10},
                  {"angular momentum", "of all", 9e-11},
                  {"flips missed", "", 0.0}}},
    {.number = 8,
     .name = "top through the upright",
     .motion = &tops,
     .why = "Euler angles of a top are singular where it stands upright, and one of these comes back there always",
     .measures = {{"energy", "of the kinetic", 1.2e-12},
                  {"momentum about the vertical", "of it", 1.2e-11},
                  {"spin", "of it", 1.5e-14}}},
    {.number = 8,
     .name = "Euler angles at gimbal lock",
     .motion = &lock,
     .why = "two of the three angles turn about one axis there",
     .measures = {{"against the same by quaternion", "rad", 5e-14}, {"energy", "of the kinetic", 1.5e-13}}},
    {.name = NULL}};
