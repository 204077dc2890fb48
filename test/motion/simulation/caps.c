/* Limits of iterations: a special case reaches each of them. The counts always report the limit, and an error reports
 * it if the result is incomplete.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "mechanics/constraint/linkage.h"
#include "scenes.h"

#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A crank of 1 m from x, a rod of 2 m, a slider on x: phi = |crank's tip - slider| - 2, coordinates (angle, x). */
static void make_slider_crank(linkage *l, double angle, double x) {
    linkage_begin(l);
    (void)linkage_bar(l, "crank", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), angle, 0.0);
    kt_body *slider = linkage_bar(l, "slider", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.1, 0.0, 0.0), x, 0.0);
    slider->joint.type = KT_JOINT_PRISMATIC;
    slider->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    kt_loop *rod = linkage_close(l, "rod", KT_LOOP_DISTANCE, "crank", kt_vec3_make(1.0, 0.0, 0.0), "slider",
                                 kt_vec3_make(0.0, 0.0, 0.0));
    rod->function = kt_function_constant(2.0);
}

/* ---- assembly ---------------------------------------------------------------------------------------------------- */

static kt_iterations assemble(double angle, double x, double *reached) {
    static linkage l;
    kt_error error;
    kt_iterations seen = {0, 0, 0, 0};
    make_slider_crank(&l, angle, x);
    linkage_compile(&l);
    seen = kt_data_iterations(l.data);
    kt_check_true("assembles", kt_fine("assemble", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &error), &error));
    kt_check_below("open, m", linkage_residual(&l, 0.0).position, 1e-12);
    *reached = l.q[0];
    seen = kt_data_iterations(l.data);
    kt_check_equal_int("told once", kt_data_iterations(l.data).assembly, 0);
    return seen;
}

/* Near the upper dead centre the closed states are x = 3 - 3/4 angle^2 + ..., of curvature 3/2. The centre of curvature
 * lies 2/3 below. Seen from there, the distances of all closed states differ only in terms of fourth order. For a state
 * 1e-6 off the centre of curvature, the nearest angle is (1e-6 / (4 0.708))^(1/3). This is 7e-3, and the distance along
 * the way there is as flat as 1e-6. */
KT_TEST(assembly_that_ends_at_its_cap_is_told) {
    double angle = 0.0;
    const kt_iterations flat = assemble(1e-6, 3.0 - 2.0 / 3.0, &angle);
    kt_check_equal_int("steps", flat.assembly, KT_ASSEMBLY_STEPS_MAX);
    kt_check_equal_int("capped", flat.capped, 1);
    kt_check_below("it did not get there, rad", angle, 6e-3);
    const kt_iterations usual = assemble(0.3, 2.9, &angle);
    kt_check_above("steps", usual.assembly, 1);
    kt_check_below("steps", usual.assembly, 50);
    kt_check_equal_int("capped", usual.capped, 0);
}

/* ---- projection -------------------------------------------------------------------------------------------------- */

/* The slider is driven beyond the dead centre, where nothing closes the loop. */
KT_TEST(projection_that_ends_at_its_cap_is_told) {
    static linkage l;
    kt_error error;
    make_slider_crank(&l, 0.5, 2.9);
    kt_loop *drive = linkage_close(&l, "drive", KT_LOOP_MOTION, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                   kt_vec3_make(0.0, 0.0, 0.0));
    drive->joint = "slider";
    drive->function = kt_function_ramp(2.7, 3.5, 0.0, 2.0);
    linkage_compile(&l);
    kt_run run = kt_run_fixed("rk4", 1e-2, 2.0);
    kt_simulation *simulation = kt_test_simulation(l.model, &run, NULL);
    kt_status status = KT_OK;
    kt_iterations seen = kt_simulation_counts_of(simulation).iterations;
    while (status == KT_OK && kt_simulation_time(simulation) < 2.0) {
        seen = kt_simulation_counts_of(simulation).iterations;
        status = kt_simulation_step(simulation, HUGE_VAL, &error);
    }
    kt_note("%s: %s", error.where, error.message);
    kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
    kt_check_contains("what", error.message, "'rod' by");
    kt_check_above("steps before", seen.position, 1);
    kt_check_below("steps before", seen.position, 5);
    kt_check_equal_int("capped before", seen.capped, 0);
    seen = kt_simulation_counts_of(simulation).iterations;
    kt_check_equal_int("steps", seen.position, KT_POSITION_STEPS_MAX);
    kt_check_equal_int("capped", seen.capped, 1);

    /* they go with a checkpoint, and from zero with a new start */
    const size_t size = kt_simulation_state_size(simulation);
    void *block = malloc(size);
    kt_simulation_save(simulation, block);
    (void)kt_fine("start", kt_simulation_set_state(simulation, 0.0, l.q, l.v, &error), &error);
    seen = kt_simulation_counts_of(simulation).iterations;
    kt_check_below("steps of a start", seen.position, 5);
    kt_check_equal_int("capped", seen.capped, 0);
    (void)kt_fine("restore", kt_simulation_restore(simulation, block, &error), &error);
    seen = kt_simulation_counts_of(simulation).iterations;
    kt_check_equal_int("steps", seen.position, KT_POSITION_STEPS_MAX);
    kt_check_equal_int("capped", seen.capped, 1);
    free(block);
}

/* The steps of a projection after a usual step: rk4, a ten thousandth of the scene's duration. The rope of 100 links,
 * reduced link by link, takes a second one of the velocities. */
KT_TEST(bundled_scenes_stay_far_from_all_caps) {
    int looped = 0;
    unsigned position = 0, velocity = 0, capped = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const char *name = kt_bundled(i);
        const kt_scene *scene = kt_test_bundled(name);
        if (scene->description.loop_count == 0 || strcmp(name, "flyball-governor") == 0 ||
            strcmp(name, "five-bar") == 0) /* rk4 needs shorter steps there */
            continue;
        kt_run run = kt_run_fixed("rk4", 1e-4 * scene->run.duration, 1.0);
        kt_simulation *simulation = kt_test_simulation(kt_test_model(&scene->description, NULL), &run, NULL);
        kt_error error;
        (void)kt_fine(name, kt_simulation_advance(simulation, 300.0 * run.step, &error), &error);
        const kt_iterations seen = kt_simulation_counts_of(simulation).iterations;
        kt_note("%s: %u and %u steps", name, seen.position, seen.velocity);
        position = seen.position > position ? seen.position : position;
        velocity = seen.velocity > velocity ? seen.velocity : velocity;
        capped += seen.capped;
        looped++;
    }
    kt_check_above("scenes with loops", looped, 20);
    kt_check_below("position", position, 2);
    kt_check_below("velocity", velocity, 2);
    kt_check_equal_int("capped", capped, 0);
}

/* ---- how fast it decays ------------------------------------------------------------------------------------------ */

/* Thirty bars in a row with equal dampers decay at thirty rates, which lie close to each other at the fast end. Eight
 * directions do not separate these rates to a hundredth. Two bars need no more than four. */
static unsigned decay(int bars) {
    static linkage l;
    static kt_effect damper[32];
    char name[32][16];
    linkage_begin(&l);
    for (int i = 0; i < bars; i++) {
        (void)snprintf(name[i], sizeof name[i], "bar%d", i);
        (void)linkage_bar(&l, name[i], i > 0 ? name[i - 1] : NULL, kt_vec3_make(i > 0 ? 1.0 : 0.0, 0.0, 0.0),
                          kt_vec3_make(1.0, 0.0, 0.0), 0.1, 0.0);
        damper[i] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, name[i]);
        damper[i].damping = 50.0;
    }
    l.description.effects = damper;
    l.description.effect_count = bars;
    linkage_compile(&l);
    kt_run run = kt_run_fixed("rkc2", 1e-3, 1.0);
    kt_simulation *simulation = kt_test_simulation(l.model, &run, NULL);
    kt_test_advance(simulation, 0.1);
    const unsigned capped = kt_simulation_counts_of(simulation).iterations.capped;
    return capped;
}

KT_TEST(estimate_of_the_decay_that_ends_at_its_cap_is_told) {
    kt_check_above("capped, thirty bars", decay(30), 1);
    kt_check_equal_int("capped, two bars", decay(2), 0);
}
