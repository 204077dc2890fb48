/* Warns if nothing has moved although no force holds the scene, or if all motion is below the absolute tolerance.
 *
 * A scene may rest on purpose: a box on the ground, a joint that a brake holds. Its weight then acts on a coordinate,
 * and other forces balance it. If no weight acts on any coordinate, gravity was forgotten, or it acts across the
 * joints. */
#include "records/gravity.h"
#include "subcommands/run.h"

#include "kinetree/dynamics.h"

#include <float.h>
#include <math.h>

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

static double length_of(kt_vec3 a) { return kt_vec3_norm(a); }

/* Returns a length of the mechanism, m: the largest distance of a joint or a centre of mass from its frame, or the
 * largest radius of gyration. */
static double mechanism_length_of(const kt_description *d) {
    double most = 0.0;
    for (int i = 0; i < d->body_count; i++) {
        const kt_body *body = &d->bodies[i];
        kt_vec3 com = {0.0, 0.0, 0.0};
        kt_sym3 inertia = body->inertia;
        if (kt_body_inertia(body, &com, &inertia, NULL) != KT_OK)
            com = body->com;
        const double gyration = body->mass > 0.0 ? sqrt((inertia.xx + inertia.yy + inertia.zz) / body->mass) : 0.0;
        most = fmax(fmax(most, length_of(body->joint.at)), fmax(length_of(com), gyration));
    }
    return most;
}

static double total_mass_of(const kt_model *model) {
    double mass = 0.0;
    for (int i = 1; i < kt_model_body_count(model); i++)
        mass += kt_body_mass(model, i);
    return mass;
}

/* Returns whether a weight acts on a coordinate in the present state, by more than rounding. */
static bool weight_acts(const kt_outcome *outcome) {
    const kt_simulation *simulation = outcome->simulation;
    const kt_model *model = outcome->model;
    const double weight = kt_vec3_norm(outcome->scene->description.gravity) * total_mass_of(model);
    const double lever = fmin(1.0, mechanism_length_of(&outcome->scene->description));
    kt_gravity *gravity = weight > 0.0 ? kt_gravity_create(model) : NULL;
    bool acts = false;
    if (gravity == NULL)
        return false;
    const double *forces =
        kt_gravity_evaluate(gravity, model, kt_simulation_time(simulation), kt_simulation_positions(simulation));
    for (int i = 0; i < kt_model_nv(model); i++)
        acts = acts || !(fabs(forces[i]) <= ROUNDING * weight * lever);
    kt_gravity_free(gravity);
    return acts;
}

static void warn_of_still_scene(kt_outcome *outcome) {
    const kt_description *d = &outcome->scene->description;
    const bool has_gravity = kt_vec3_norm(d->gravity) > 0.0, has_effects = d->effect_count > 0;
    if (has_effects && weight_acts(outcome))
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
    const kt_description *d = &outcome->scene->description;
    const double rounding = ROUNDING * fmax(moved->size, mechanism_length_of(d));
    if (moved->steps == 0 || outcome->failed.code != KT_OK || kt_model_mobility(outcome->model).minimal == 0)
        return;
    if (moved->position > rounding)
        warn_of_small_motion(outcome);
    else if (!(moved->velocity > rounding) && moved->state == 0.0 && !kt_is_driven(d))
        warn_of_still_scene(outcome);
}
