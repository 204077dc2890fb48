/* Steps of mechanisms with loops, with the projection after them: coarse steps, which leave the loops open by much. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"

#include "kinetree/simulation.h"

#include <stdlib.h>

static const kt_method *every_other_method(int n) { return explicit_method(2 * n); }

KT_TEST(derivatives_follow_the_projection_of_coarse_steps) { compare_linkages(every_other_method, 12); }

static const kt_method *repeated_method(int n) { return explicit_method(n % 11); }

KT_TEST(derivatives_of_random_closed_mechanisms_hold) { compare_closed(repeated_method, 3, 12.0); }

/* ---- hard contacts ----------------------------------------------------------------------------------------------- */

/* Derivatives and the adjoint of a step of a mass of 1 kg above a hard stop. While the stop stays open,
 *     A = (1 h; 0 1)
 * There are no derivatives if the stop closes. There are none either if the mass rests on it and a force opens it. */
static void check_stop(const char *name, const kt_model *model, double q, double v, double tau, const char *words) {
    const double by_next[2] = {1.0, 0.0}, h = 0.1;
    const kt_step step = {.method = kt_method_find("rk4"), .t = 0.0, .h = h, .tau = &tau};
    const size_t size = kt_step_work_size(model, step.method);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    double A[4] = {0.0}, by_state[2];
    kt_error error = {0};
    kt_data *data = kt_test_data(model);
    kt_status status = kt_step_derivatives(model, data, work, size, &step, &q, &v, NULL, NULL, A, NULL, &error);
    const kt_status adjoint =
        kt_step_adjoint(model, data, work, size, &step, &q, &v, by_next, by_state, NULL, words ? &error : NULL);
    kt_check_equal_int("adjoint and derivatives agree", adjoint, status);
    kt_check_equal_int(name, status, words ? KT_ERROR_UNSUPPORTED : KT_OK);
    if (words != NULL) {
        kt_check_contains("which", error.where, "contact 'floor.lower' by t = 0.1 s");
        kt_check_contains("words", error.message, words);
    } else if (kt_switch_set(model) == 0) {
        kt_check_near("A", A[2], h, 1e-15);
        kt_check_near("A'", by_state[1], h, 1e-15);
    } else {
        kt_check_near("held", fabs(A[0]) + fabs(A[2]) + fabs(A[3]), 0.0, 1e-15);
    }
    free(work);
}

KT_TEST(steps_in_which_hard_contacts_close_or_open_are_rejected) {
    kt_description d = kt_description_default();
    kt_body body = kt_body_of("mass", NULL, KT_JOINT_PRISMATIC, 1.0);
    kt_effect floor = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "mass");
    floor.name = "floor";
    floor.lower = 0.0;
    floor.restitution = 0.5;
    d.gravity = kt_vec3_make(0.0, 0.0, -10.0);
    d.bodies = &body, d.body_count = 1;
    d.effects = &floor, d.effect_count = 1;
    kt_model *compiled = kt_test_model(&d, NULL);
    kt_simulation *simulation = kt_test_simulation(compiled, NULL, NULL);
    check_stop("above it", compiled, 1.0, 0.0, 0.0, NULL);
    check_stop("closes", compiled, 0.02, 0.0, 0.0, "closes (-0.03) within the step");
    check_stop("rests, and the model does not know it", compiled, 0.0, 0.0, 0.0, "closes (-0.05)");
    check_stop("rests", kt_simulation_model(simulation), 0.0, 0.0, 0.0, NULL);
    check_stop("is lifted", kt_simulation_model(simulation), 0.0, 0.0, 12.0, "opens, as its reaction would pull, (-2)");
}
