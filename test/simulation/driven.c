/* Mechanisms whose drives leave no degree of freedom: position and velocity follow from the time alone, whatever method
 * integrates them. */
#include "../formulation.h"
#include "scenes.h"

#include "kinetree/scene.h"

#include <math.h>
#include <string.h>

static const char crank[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: crank, position: {polynomial: [0, 6.28]}}\n";

/* A damper and a spring, for powers and for forces that an implicit method would linearise. */
static const char four_bar[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, position: 60 deg}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
    "  - {name: coupler, parent: crank, joint: {type: revolute, at: [1, 0, 0], position: -50 deg}, mass: 2, shape: "
    "{type: "
    "rod, to: [3, 0, 0]}, markers: {tip: [3, 0, 0]}}\n"
    "  - {name: rocker, joint: {type: revolute, at: [2.5, 0, 0], position: 70 deg}, mass: 1, shape: {type: rod, to: "
    "[2, 0, "
    "0]}, markers: {tip: [2, 0, 0]}}\n"
    "loops:\n"
    "  - {name: close, type: revolute, between: [coupler.tip, rocker.tip]}\n"
    "  - {name: drive, type: motion, joint: crank, position: {sine: {amplitude: 0.4, frequency: 1.5, offset: 1.0}}}\n"
    "effects:\n"
    "  - {type: joint_damper, joint: rocker, damping: 1e4}\n"
    "  - {type: joint_spring, joint: rocker, stiffness: 1e5}\n";

/* A quaternion, all of whose rotations are driven. */
static const char ball[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: yaw, joint: {type: revolute, axis: z}, mass: 1, inertia: [1, 1, 1]}\n"
    "  - {name: ball, joint: {type: spherical}, mass: 1, inertia: [1, 2, 3]}\n"
    "loops:\n"
    "  - {name: together, type: parallel, between: [yaw, ball]}\n"
    "  - {name: drive, type: motion, joint: yaw, position: {sine: {amplitude: 2, frequency: 1}}}\n";

/* The largest difference to the state of dop853 at 1e-13 over all records. */
typedef struct compared {
    kt_worst worst;
    const kt_kept *right;
} compared;

static int compare(const kt_record *record, void *user) {
    compared *c = user;
    const double *right = c->right->state[record->index];
    const size_t nq = (size_t)c->right->nq, nv = (size_t)c->right->nv;
    for (size_t i = 0; i < nq + nv; i++) /* both are those that close the loops: what remains is rounding */
        kt_worst_near(&c->worst, i < nq ? record->q[i] : record->v[i - nq], right[i], i < nq ? 1e-14 : 1e-12,
                      "%s[%zu] at %g s", i < nq ? "q" : "v", i < nq ? i : i - nq, record->time);
    return 0;
}

static void check_method(const kt_model *model, const kt_absolute *absolute, const kt_run *run, const kt_kept *right) {
    const kt_simulation_options options = kt_formulated(absolute);
    kt_error error = {KT_OK, "", ""};
    compared c = {kt_worst_make(run->integrator), right};
    kt_simulation *simulation = kt_scene_simulate(model, run, &options);
    if (simulation == NULL)
        return;
    kt_note("%s, step %g%s", run->integrator, run->step, absolute != NULL ? ", absolute" : "");
    if (kt_fine("run", kt_simulation_run(simulation, compare, &c, &error), &error))
        kt_check_worst(&c.worst);
    kt_check_below("steps", (double)kt_simulation_counts_get(simulation).steps, 400.0);
    kt_simulation_free(simulation);
}

static void check_scene(const char *text) {
    static kt_kept right;
    kt_scene scene;
    kt_error error;
    kt_model *model = NULL;
    if (!kt_fine("scene", kt_scene_parse("driven", text, strlen(text), &scene, NULL, NULL, &error), &error) ||
        !kt_fine("model", kt_model_compile(&scene.description, NULL, &model, &error), &error))
        return;
    kt_check_equal_int("degrees of freedom", kt_model_mobility(model).minimal, 0);
    kt_run run = kt_run_fixed("dop853", 0.0, 1.0);
    run.relative = run.absolute = 1e-13;
    run.interval = 0.025;
    kt_kept *kept = kt_kept_empty(model);
    kt_simulation *simulation = kt_scene_simulate(model, &run, NULL);
    (void)kt_fine("reference", kt_simulation_run(simulation, kt_keep, kept, &error), &error);
    kt_simulation_free(simulation);
    right = *kept;
    kt_absolute *absolute = kt_formulate(&scene.description, NULL, model, KT_FORMULATION_ABSOLUTE);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        if (!kt_method_is_implicit(method) && strcmp(method->name, "auto") != 0)
            continue;
        for (int k = 0; k < 4; k++) {
            run.integrator = method->name;
            run.step = k % 2 == 0 ? 2.5e-3 : 0.0; /* records at the ends of steps: positions are those of the loops */
            run.relative = run.absolute = 1e-9;
            if (run.step > 0.0 || kt_method_is_adaptive(method))
                check_method(model, k < 2 ? NULL : absolute, &run, &right);
        }
    }
    kt_absolute_free(absolute);
    kt_model_free(model);
    kt_scene_free(&scene);
}

KT_TEST(driven_crank_turns_by_every_implicit_method) { check_scene(crank); }
KT_TEST(driven_four_bar_moves_by_every_implicit_method) { check_scene(four_bar); }
KT_TEST(driven_ball_turns_by_every_implicit_method) { check_scene(ball); }
