/* Floquet multipliers with auxiliary states. The oracle is the exponentials of the modes of a linear system at rest. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parsed.h"

#include "kinetree/analysis.h"
#include "kinetree/scene.h"

#include <math.h>
#include <string.h>

/* A linear system at rest: J q'' = -P q + x - D q', x' = -20 q - 0.5 x. Its multipliers over T are exp(lambda T). The
 * state `alone`, which nothing reads, has the multiplier exp(-3 T). */
KT_TEST(multipliers_of_a_rest_are_the_exponentials_of_its_modes) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: arm, joint: {type: prismatic, axis: x}, mass: 2}\n"
        "states: {x: {rate: \"-20*position.arm - 0.5*x\"}, alone: {rate: \"-3*alone\"}}\neffects:\n"
        "  - {type: expression, joint: arm, force: \"-50*position.arm + x - velocity.arm\"}\n";
    const double T = 0.7, q = 0.0, v = 0.0;
    kt_scene scene;
    kt_error error = {0};
    const kt_floquet_options options = kt_floquet_options_default(T);
    const kt_linearization_options linear = kt_linearization_options_default();
    kt_parsed_scene(text, &scene);
    kt_model *model = kt_scene_compile(&scene.description);
    kt_linearization *l = kt_test_linearization(model, &linear);
    kt_need_fine("system", kt_linearization_evaluate(l, 0.0, &q, &v, NULL, &error), &error);
    kt_modes *modes = kt_test_modes(model);
    kt_need_fine("evaluate", kt_modes_evaluate(modes, kt_linearization_system(l), &error), &error);
    kt_floquet *floquet = kt_test_floquet(model, &options);
    kt_need_fine("multipliers", kt_floquet_evaluate(floquet, 0.0, &q, &v, &error), &error);
    kt_check_equal_int("multipliers", kt_floquet_count(floquet), kt_modes_count(modes));
    KT_WORST distance = kt_worst_make("distance of the nearest multiplier");
    for (int i = 0; i < kt_modes_count(modes); i++) {
        const kt_mode mode = kt_modes_at(modes, i);
        const double re = exp(mode.real * T) * cos(mode.imaginary * T),
                     im = exp(mode.real * T) * sin(mode.imaginary * T);
        double nearest = HUGE_VAL;
        for (int j = 0; j < kt_floquet_count(floquet); j++) {
            const kt_multiplier mu = kt_floquet_at(floquet, j);
            nearest = fmin(nearest, hypot(mu.real - re, mu.imaginary - fabs(im)));
        }
        kt_worst_below(&distance, nearest, 1e-9, "mode %d", i);
    }
    kt_check_below("gap", kt_floquet_gap(floquet), 0.0);
    kt_floquet_auxiliary_states(floquet)[1] = 2.0;
    (void)kt_fine("again", kt_floquet_evaluate(floquet, 0.0, &q, &v, &error), &error);
    kt_check_near("gap of the state", kt_floquet_gap(floquet), 1.0 - exp(-3.0 * T), 1e-9);
}
