/* Works estimated from powers at the ends of steps. The estimates change no bit of the motion, true works are within
 * their uncertainty, and a wrong energy is visible. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/analysis.h"
#include "kinetree/effect.h"
#include "kinetree/scene.h"

#include "files/scene/collect.h"
#include "sanitized.h"
#include "scene_files.h"
#include "scenes.h"

#include <math.h>

enum { RECORDS = 40 };

/* ---- the estimate and the works of the method -------------------------------------------------------------------- */

/* The records of a run; of each the net work, and its uncertainty where it is estimated. */
typedef struct ledger {
    int count;
    double net[RECORDS + 2], uncertainty[RECORDS + 2], turned;
    kt_energy_watch watch;
} ledger;

static int enter(const kt_record *r, void *user) {
    ledger *l = user;
    const int k = l->count++;
    const bool integrated = !isnan(r->work.dissipated);
    l->net[k] = integrated ? r->work.dissipated - r->work.supplied : r->estimate.net;
    l->uncertainty[k] = integrated ? 0.0 : r->estimate.error;
    l->turned = integrated ? 0.0 : r->estimate.turned;
    kt_energy_watch_add(&l->watch, r);
    return 0;
}

static bool run(const char *name, const kt_model *model, const kt_run *given, unsigned record, bool watch, ledger *l) {
    kt_run run = *given;
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    run.duration = fmin(run.duration, 1.0);
    run.interval = run.duration / RECORDS;
    options.record = record | KT_RECORD_ENERGY;
    options.watch_works = watch;
    l->count = 0;
    l->watch = kt_energy_watch_start(model);
    kt_status status = kt_simulation_create(model, &run, &options, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_run(simulation, enter, l, &error);
    kt_simulation_free(simulation);
    return kt_fine(name, status, &error);
}

static const char *const methods[] = {NULL, "dopri5", "dop853", "radau5", "rodas5p", "tsit5"};
enum {
    METHODS = sizeof methods / sizeof *methods,
    SHARE = KT_ADDRESS_SANITIZER ? 5 : KT_SHORT(5, 1) /* of the runs; the long tier has all */
};

static int asked, compared;

/* The largest difference of estimated and integrated works at a record, in uncertainties; those of the method are as
 * accurate as its tolerances. */
static void compare(const char *name, const kt_model *model, const kt_run *given, kt_worst *off, kt_worst *bits) {
    kt_run run_of = *given;
    static ledger plain, watched, balanced;
    for (int m = 0; m < METHODS; m++) {
        if (asked++ % SHARE > 0)
            continue;
        run_of.integrator = methods[m];
        run_of.step = 0.0;
        run_of.record = KT_RECORD_ENERGY;
        run_of.relative = run_of.absolute = fmin(fmax(run_of.relative, 1e-9), 1e-6);
        if (!run(name, model, &run_of, 0, false, &plain) || !run(name, model, &run_of, 0, true, &watched) ||
            !run(name, model, &run_of, KT_RECORD_BALANCE, false, &balanced))
            return;
        compared++;
        for (int k = 0; k < watched.count; k++) {
            const double allowed = watched.uncertainty[k] + 1e-6 * (watched.turned + watched.watch.kinetic) + 1e-12;
            kt_worst_below(off, fabs(watched.net[k] - balanced.net[k]) / allowed, 1.0, "%s by %s, record %d", name,
                           methods[m] ? methods[m] : "default", k);
        }
        kt_worst_near(bits, watched.watch.kinetic, plain.watch.kinetic, 0.0, "%s by %s", name,
                      methods[m] ? methods[m] : "default");
        kt_worst_near(bits, watched.watch.change, plain.watch.change, 0.0, "%s by %s", name,
                      methods[m] ? methods[m] : "default");
        kt_worst_below(off, kt_energy_watch_error(&watched.watch), KT_ENERGY_ERROR, "%s by %s, warned of", name,
                       methods[m] ? methods[m] : "default");
    }
}

KT_TEST(works_at_bundled_scenes_are_within_their_uncertainty) {
    KT_WORST off = kt_worst_make("off, in uncertainties"), bits = kt_worst_make("energies with the watch and without");
    asked = compared = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_scene *scene = kt_test_bundled(kt_bundled(i));
        const kt_model *model = kt_test_model(&scene->description, NULL);
        if (kt_model_nv(model) < 30 && kt_model_energetics(model) != KT_ENERGY_CONSERVED &&
            !kt_is_switched(&scene->description)) /* rodas5p rejects friction of contacts */
            compare(kt_bundled(i), model, &scene->run, &off, &bits);
    }
    kt_check_above("runs compared", compared, 18 * METHODS / SHARE - 1);
}

/* ---- a wrong energy ---------------------------------------------------------------------------------------------- */

/* A damper that dissipates a little more than it reports. */
static int lie(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const double *share = user;
    (void)t, (void)q;
    *force = -0.2 * v;
    if (balance)
        balance->dissipated = 0.2 * v * v * (1.0 - *share);
    return 0;
}

/* A pendulum that a sine drives, with the damper that lies. Returns the error that the watch finds. */
static double error_of(double share, double tolerance, double step, const char *integrator) {
    kt_body body = kt_body_of("arm", NULL, KT_JOINT_REVOLUTE, 1.0);
    body.joint.position[0] = 1.0;
    body.com = (kt_vec3){0.0, -0.5, 0.0};
    body.inertia = kt_sym3_make(0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
    kt_effect effects[2];
    effects[0] = kt_effect_of(KT_EFFECT_CUSTOM, "arm");
    effects[0].joint_force = lie;
    effects[0].user = &share;
    effects[1] = kt_effect_of(KT_EFFECT_MOTOR, "arm");
    effects[1].torque = kt_function_sine(1.0, 0.5, 0.0, 0.0);
    kt_description d = kt_description_default();
    d.gravity = (kt_vec3){0.0, -9.81, 0.0};
    kt_describe(&d, &body, 1, NULL, 0, effects, 2);
    static ledger l;
    kt_run run_of = kt_run_fixed(integrator, step, 1.0);
    run_of.relative = run_of.absolute = tolerance;
    double found = (double)NAN;
    const kt_model *model = kt_scene_compile(&d);
    if (run("pendulum", model, &run_of, 0, true, &l))
        found = kt_energy_watch_error(&l.watch);
    return found;
}

KT_TEST(energy_that_does_not_add_up_is_found_in_a_driven_damped_motion) {
    kt_check_below("right", error_of(0.0, 1e-8, 0.0, "dopri5"), KT_ENERGY_ERROR);
    kt_check_above("a damper that takes 5 % more than it says", error_of(0.05, 1e-8, 0.0, "dopri5"), KT_ENERGY_ERROR);
    kt_check_above("the same by an implicit method", error_of(0.05, 1e-8, 0.0, "radau5"), KT_ENERGY_ERROR);
    kt_check_below("rk4 with a short step", error_of(0.0, 0.0, 1e-3, "rk4"), KT_ENERGY_ERROR);
    kt_check_above("Euler's method with a step of 1/100 s", error_of(0.0, 0.0, 1e-2, "euler"), KT_ENERGY_ERROR);
}

/* ---- forces that jump -------------------------------------------------------------------------------------------- */

/* A cart of 1 kg under a force that changes each tenth of a second. The work is v^2 / 2, and the speed v is the sum of
 * F dt. */
KT_TEST(inputs_that_jump_begin_the_estimate_anew) {
    kt_body body = kt_body_of("cart", NULL, KT_JOINT_PRISMATIC, 1.0);
    kt_description d = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {0};
    options.watch_works = true;
    options.record = KT_RECORD_ENERGY;
    kt_simulation *simulation = kt_test_simulation(kt_scene_compile(&d), NULL, &options);
    KT_WORST off = kt_worst_make("work of a force");
    double v = 0.0;
    for (int k = 0; k < 20; k++) {
        const double force = k % 2 == 0 ? 3.0 : -1.0 * k;
        kt_record record = {0};
        kt_need_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
        kt_test_advance(simulation, 0.1 * (k + 1));
        kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        v += 0.1 * force;
        kt_worst_near(&off, -record.estimate.net, 0.5 * v * v, 1e-12, "tick %d", k);
    }
}

/* A lift of 1 kg under a constant force, whose position and velocity jump. Jumps, too, supply the energy that they add,
 * so that the net work is the change of v^2 / 2 + g q, at q and v of a fall with a constant acceleration. */
KT_TEST(states_that_jump_add_their_energy_to_the_estimate) {
    const double g = 9.81, force = 14.0, a = force - g, places[] = {0.5, -0.7, 0.2}, speeds[] = {-2.0, 1.5, 3.0};
    kt_body body = kt_body_of("lift", NULL, KT_JOINT_PRISMATIC, 1.0);
    kt_description d = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {0};
    d.gravity = (kt_vec3){-g, -g, -g}; /* along the axis, whichever it is */
    options.watch_works = true;
    options.record = KT_RECORD_ENERGY;
    kt_simulation *simulation = kt_test_simulation(kt_scene_compile(&d), NULL, &options);
    KT_WORST off = kt_worst_make("work of a force and of jumps");
    double q = 0.0, v = 0.0;
    kt_need_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
    for (int k = 0; k < 3; k++) {
        kt_record record = {0};
        kt_test_advance(simulation, 0.3 * (k + 1));
        q += 0.3 * v + 0.5 * 0.09 * a;
        v += 0.3 * a;
        kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        kt_worst_near(&off, -record.estimate.net, 0.5 * v * v + g * q, 1e-12, "before jump %d", k);
        q = places[k];
        v = speeds[k];
        kt_need_fine("jump", kt_simulation_jump(simulation, &q, &v, &error), &error);
    }
}
