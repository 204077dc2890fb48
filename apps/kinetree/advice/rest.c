/* Warns if nothing has moved although no force holds the scene, or if all motion is below the absolute tolerance.
 *
 * A scene may rest on purpose: a box on the ground, a joint that a brake holds. Its weight then acts on a coordinate,
 * and other forces balance it. If no weight acts on any coordinate, gravity was forgotten, or it acts across the
 * joints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/gravity.h"
#include "subcommands/run.h"

#include "kinetree/dynamics.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Motions up to this share of the size of the mechanism are rounding. */
#define ROUNDING (64.0 * DBL_EPSILON)
/* Adaptive steps bound errors by the absolute tolerance. A motion below this multiple of it has an error of a percent
 * or more. */
#define RESOLVED 100.0
/* A scene that is held in equilibrium creeps by the errors of steps: by at most a small share of its positions, or ten
 * times the absolute tolerance, and no faster than a multiple of that tolerance. */
#define CREEP 1e-5
#define CREEP_MOST 1e-3
#define CREEP_SPEED 1000.0

bool kt_is_held(const kt_outcome *outcome) {
    const kt_moved *moved = &outcome->so_far.moved;
    const double absolute = outcome->run->absolute;
    const double creep = fmax(CREEP * moved->size, fmin(10.0 * absolute, CREEP_MOST * moved->size));
    return moved->steps > 0 && moved->position <= creep && moved->velocity <= CREEP_SPEED * absolute;
}

/* The action of gravity on the coordinates. With M_ii the inertia that coordinate i moves, and the Cauchy-Schwarz
 * inequality over the bodies, the joint force of gravity is at most
 *     |Q_i| = |sum m_b g'J_bi| <= g sqrt(m M_ii),   m = sum m_b,
 * in all units, and it accelerates the coordinate by at most g sqrt(m / M_ii). Forces far below their bound are
 * rounding. */
typedef struct kt_felt_gravity {
    bool acts;   /* by more than rounding on a coordinate */
    double most; /* the largest bound of an acceleration: m/s2, rad/s2 */
} kt_felt_gravity;

/* Coordinates whose bound of the acceleration is computed, at most. */
#define PROBES 500

/* Returns M_ii, which is twice the kinetic energy of a unit velocity. v: room for nv zeros. */
static double inertia_of_coordinate(const kt_model *model, kt_data *data, const double *q, double *v, int i) {
    v[i] = 1.0;
    const kt_status status = kt_kinematics_update(model, data, q, v, NULL, NULL);
    v[i] = 0.0;
    return status == KT_OK ? 2.0 * kt_kinetic_energy(model, data) : (double)NAN;
}

static double total_mass_of(const kt_model *model) {
    double mass = 0.0;
    for (int i = 1; i < kt_model_body_count(model); i++)
        mass += kt_body_mass(model, i);
    return mass;
}

static kt_felt_gravity feel_gravity(const kt_outcome *outcome) {
    const kt_simulation *simulation = outcome->simulation;
    const kt_model *model = outcome->model;
    const double *q = kt_outcome_positions(outcome);
    const double g = kt_vec3_norm(outcome->scene->description.gravity), mass = total_mass_of(model);
    const int nv = kt_model_nv(model), stride = 1 + nv / PROBES;
    double *v = calloc((size_t)nv + 1, sizeof *v);
    kt_gravity *gravity = kt_gravity_create(model);
    kt_data *data = NULL;
    kt_felt_gravity felt = {0};
    if (v != NULL && gravity != NULL && kt_data_create(model, &data, NULL) == KT_OK) {
        const double *forces = kt_gravity_evaluate(gravity, model, kt_simulation_time(simulation), q);
        for (int i = 0; i < nv; i += stride)
            felt.most = fmax(felt.most, g * sqrt(mass / inertia_of_coordinate(model, data, q, v, i)));
        for (int i = 0; i < nv && !felt.acts; i++)
            felt.acts = forces[i] != 0.0 &&
                        !(fabs(forces[i]) <= ROUNDING * g * sqrt(mass * inertia_of_coordinate(model, data, q, v, i)));
    }
    kt_data_free(data);
    kt_gravity_free(gravity);
    free(v);
    return felt;
}

static void warn_of_still_scene(kt_outcome *outcome, const kt_felt_gravity *felt) {
    const kt_description *d = &outcome->scene->description;
    const bool has_gravity = kt_vec3_norm(d->gravity) > 0.0, has_effects = d->effect_count > 0;
    if (has_effects && felt->acts)
        return;
    const kt_warning warning =
        kt_warning_of("rest", (double)NAN, NULL,
                      has_gravity   ? "Compare gravity with the axes of the joints, or give the scene another start"
                      : has_effects ? "Give the scene gravity, a velocity at the start, or an effect that acts there"
                                    : "Give the scene gravity, an effect, or a velocity at the start");
    kt_warn(&outcome->warnings, &warning, "nothing has moved: the scene starts at rest, and %s%s",
            has_gravity   ? "gravity does not accelerate it"
            : has_effects ? "has no gravity"
                          : "has neither effects nor gravity",
            has_effects ? "; its effects exert no force on it at rest" : "");
}

static void warn_of_small_motion(kt_outcome *outcome) {
    const kt_moved *moved = &outcome->so_far.moved;
    const kt_run *run = outcome->run;
    const double most = fmax(moved->position, moved->velocity);
    char remedy[160];
    if (run->step > 0.0 || !(most < RESOLVED * run->absolute) || kt_is_held(outcome) || moved->state > most)
        return;
    (void)snprintf(remedy, sizeof remedy,
                   "Take --tolerance %g,%.0e, which lowers the absolute tolerance, or larger units. A scene that is "
                   "meant to rest needs no change",
                   run->relative, run->relative * most);
    const kt_warning warning = kt_warning_of("small_motion", most, NULL, remedy);
    kt_warn(&outcome->warnings, &warning,
            "no coordinate moves by more than %.2g m or rad, nor faster than %.2g m/s or rad/s, and the absolute "
            "tolerance is %g: the steps do not resolve this motion",
            moved->position, moved->velocity, run->absolute);
}

void kt_warn_of_rest(kt_outcome *outcome) {
    const kt_moved *moved = &outcome->so_far.moved;
    const double t = kt_simulation_time(outcome->simulation);
    if (moved->steps == 0 || outcome->failed.code != KT_OK || kt_model_mobility(outcome->model).minimal == 0)
        return;
    if (moved->position >= RESOLVED * outcome->run->absolute)
        return;
    const kt_felt_gravity felt = feel_gravity(outcome);
    if (moved->position > ROUNDING * (moved->size + 0.5 * felt.most * t * t))
        warn_of_small_motion(outcome);
    else if (moved->state == 0.0 && !kt_is_driven(&outcome->scene->description))
        warn_of_still_scene(outcome, &felt);
}
