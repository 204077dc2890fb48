/* Bounces of hard stops that come to rest, and the limit of their number. */
#include "kinetree/simulation.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "check.h"
#include "scenes.h"

static const double g = 9.81;

static void add_stop(kt_lone *lone, kt_effect *stop, double lower, double restitution) {
    *stop = kt_effect_default();
    stop->type = KT_EFFECT_JOINT_LIMIT;
    stop->joint = lone->body.name;
    stop->lower = lower;
    stop->restitution = restitution;
    lone->description.effects = stop;
    lone->description.effect_count = 1;
}

static kt_simulation *start(const kt_model *model, const char *method, double step, unsigned record) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    run.duration = 100.0;
    run.relative = run.absolute = method != NULL && strcmp(method, "dop853") == 0 ? 1e-13 : 1e-10;
    options.record = record;
    return model != NULL ? kt_scene_simulate(model, &run, &options) : NULL;
}

/* A finger that is pressed against a stop bounces in ever lower jumps, at last lower than the rounding of where the
 * stop is. It rests from there on, and the work on the finger equals the lost energy. Speeds shrink by e, from the
 * first down to the rest velocity or sqrt(2 a 16 eps x). */
KT_TEST(pressed_finger_comes_to_rest_on_a_stop_anywhere) {
    static const char *const methods[] = {"dopri5", "rk4", "radau5", NULL};
    kt_random random = kt_random_of_test();
    kt_worst place = kt_worst_make("place, relative"), energy = kt_worst_make("work that is not lost, relative");
    int late = 0, more = 0;
    for (int run = 0; run < 200; run++) {
        const double a = pow(10.0, kt_random_uniform(&random, 0.0, 6.0)), e = kt_random_uniform(&random, 0.0, 0.9);
        const double x = pow(10.0, kt_random_uniform(&random, -3.0, 4.0)), way = kt_random_uniform(&random, 0.01, 0.5);
        const double v = sqrt(2.0 * a * way), stop = 2.0 * v / a * (1.0 + e) / (1.0 - e);
        const double rest = fmax(1e-6, sqrt(2.0 * a * 16.0 * DBL_EPSILON * x));
        const int count = e > 0.0 ? (int)ceil(log(rest / v) / log(e)) + 1 : 1;
        kt_lone r;
        kt_effect limit;
        kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
        add_stop(&r, &limit, x, e);
        r.body.joint.position[0] = x + way;
        kt_model *model = kt_scene_compile(&r.description);
        kt_simulation *simulation = start(model, methods[run % 4], run % 4 == 1 ? 0.1 * v / a : 0.0, KT_RECORD_BALANCE);
        kt_error error = {0};
        kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
        if (status == KT_OK)
            status = kt_simulation_set_torque(simulation, &(double){-a}, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(simulation, stop, &error);
        if (kt_fine("runs", status, &error)) {
            const kt_contact_counts counts = kt_simulation_contacts(simulation);
            kt_worst_near(&place, kt_simulation_positions(simulation)[0] / (x + way), x / (x + way), 8.0 * DBL_EPSILON,
                          "run %d", run);
            kt_worst_near(&energy, counts.dissipated / (a * way), 1.0, 1e-8, "run %d: a %g x %g e %g", run, a, x, e);
            late += counts.closings != 1 || kt_simulation_velocities(simulation)[0] != 0.0;
            more += (int)counts.impacts > count;
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
    kt_check_worst(&place);
    kt_check_worst(&energy);
    kt_check_below("fingers that do not rest", late, 0.0);
    kt_check_below("fingers with more impacts than until rest", more, 0.0);
}

/* The cost of a step has a bound. A ball that bounces more than 10,000 times within one step causes an error with the
 * name of its event. */
KT_TEST(bounces_within_a_step_have_a_limit) {
    kt_lone r;
    kt_effect limit;
    kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
    add_stop(&r, &limit, 0.0, 0.9999);
    limit.name = "anvil";
    r.body.joint.position[0] = 1e-6;
    r.description.gravity = kt_vec3_make(-g, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "rk4", 50.0, 0);
    kt_error error = {0};
    if (simulation != NULL) {
        kt_check_true("ends", kt_simulation_advance(simulation, 50.0, &error) == KT_ERROR_STEP);
        kt_check_contains("words", error.message, "10000 instants of events lie within 50 s");
        kt_check_contains("words", error.message, "larger rest_velocity");
        kt_check_contains("where", error.where, "event 'anvil.lower' at t = ");
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}
