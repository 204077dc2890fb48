/* Which mechanisms are computed in their plane, and which inputs are rejected there. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- what is planar -----------------------------------------------------------------------------------------------
 */

static const char *plan_of(linkage *l) {
    static char text[16] = "";
    text[0] = '\0';
    linkage_compile(l);
    (void)snprintf(text, sizeof text, "%s", kt_model_plan(l->model));
    return text;
}

/* A four-bar in the plane of x and y, closed at `(2, 0, 0)` of the coupler and the rocker's tip. */
static kt_loop *begin(linkage *l) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    return &l->loop[0];
}

KT_TEST(loops_that_hold_more_than_the_plane_does_are_spatial) {
    static linkage l;
    (void)begin(&l);
    kt_check_text("revolute about the normal", plan_of(&l), "planar");
    begin(&l)->axis = kt_vec3_make(0.0, 1e-9, 1.0);
    kt_check_text("with an oblique axis", plan_of(&l), "spatial");
    kt_loop *loop = begin(&l);
    loop->between[0].at.z += 1e-9;
    kt_check_text("with one end higher", plan_of(&l), "spatial");
    loop = begin(&l);
    loop->between[1].rotation = kt_rotation_matrix(
        (kt_mat3){kt_vec3_make(1.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), kt_vec3_make(0.0, 0.0, -1.0)});
    kt_check_text("with its axes opposed", plan_of(&l), "spatial");
    loop = begin(&l);
    loop->type = KT_LOOP_DISTANCE;
    loop->between[0].at.z += 0.3;
    kt_check_text("a rod from one height to another", plan_of(&l), "planar");
    loop = begin(&l);
    loop->type = KT_LOOP_SPHERICAL;
    loop->axis = kt_vec3_make(0.3, 0.2, 0.9);
    kt_check_text("spherical, whatever its axis", plan_of(&l), "planar");
    loop = begin(&l);
    loop->type = KT_LOOP_SCREW;
    loop->pitch = 0.1;
    kt_check_text("screw", plan_of(&l), "spatial");
}

/* One spatial body that is coupled makes all of them spatial; one that is not leaves them alone. */
KT_TEST(what_loops_connect_is_planar_together_or_not_at_all) {
    static linkage l;
    static const char *const plans[2] = {"mixed", "spatial"};
    for (int coupled = 0; coupled < 2; coupled++) {
        static kt_term terms[2];
        (void)begin(&l);
        kt_body *other =
            linkage_bar(&l, "other", NULL, kt_vec3_make(0.0, 0.0, 1.0), kt_vec3_make(0.0, 1.0, 0.0), 0.1, 0.0);
        other->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        if (coupled) {
            kt_loop *gear = linkage_close(&l, "gear", KT_LOOP_COUPLING, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                          kt_vec3_make(0.0, 0.0, 0.0));
            terms[0] = (kt_term){.joint = "crank", .coefficient = 1.0};
            terms[1] = (kt_term){.joint = "other", .coefficient = 2.0};
            gear->terms = terms;
            gear->term_count = 2;
        }
        kt_check_text(coupled ? "a gear to another plane" : "another plane", plan_of(&l),
                      coupled ? plans[1] : "planar");
    }
}

/* ---- wrenches that are no numbers -------------------------------------------------------------------------------- */

/* The planar recursions ignore wrenches across the plane. Powers and reactions would be NaN, and reported as right. */
KT_TEST(wrench_across_the_plane_that_is_not_finite_is_rejected) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    kt_wrench external[4], joints[4], loops[1];
    double a[3] = {7.0, 7.0, 7.0};
    kt_power power = {7.0, 7.0};
    kt_error error = {0};
    memset(external, 0, sizeof external);
    joints[1].force.z = loops[0].force.z = 7.0;
    external[2].force.z = (double)NAN;
    kt_check_text("plan", kt_model_plan(l.model), "planar");
    kt_check_equal_int("accelerations",
                       kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, a, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_contains("where", error.where, kt_body_name(l.model, 2));
    kt_check_equal_int("powers", kt_power_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, a, &power, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_equal_int("reactions",
                       kt_reaction_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, joints, loops, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_near("accelerations untouched", a[0], 7.0, 0.0);
    kt_check_near("powers untouched", power.supplied, 7.0, 0.0);
    kt_check_near("reactions untouched", joints[1].force.z + loops[0].force.z, 14.0, 0.0);
}

KT_TEST(power_that_overflows_is_rejected) {
    static linkage l;
    kt_error error = {0};
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    linkage_compile(&l);
    const double v = 1e120, tau = 1e200;
    double a = 7.0;
    kt_power power = {7.0, 7.0};
    kt_check_equal_int("acceleration", kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, &v, &tau, NULL, &a, &error),
                       KT_OK);
    a = 7.0;
    kt_check_equal_int("power", kt_power_evaluate(l.model, l.data, 0.5, l.q, &v, &tau, NULL, &a, &power, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "t = 0.5 s");
    kt_check_contains("message", error.message, "a power overflows");
    kt_check_near("untouched", a + power.supplied, 14.0, 0.0);
}
