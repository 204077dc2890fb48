/* The loops of a planar tree that stay in its plane. Their axes lie in it or along its normal, and both ends have the
 * same direction across.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linkage.h"

/* A four-bar in the plane of x and y, with one loop more, between its coupler and its rocker. */
static void check_plan(const char *what, const kt_loop *given, const char *expected) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    kt_loop *loop = linkage_close(&l, "more", given->type, "coupler", kt_vec3_make(0.1, 0.0, 0.0), "rocker",
                                  kt_vec3_make(0.3, 0.0, 0.0));
    loop->axis = given->axis;
    loop->axis2 = given->axis2;
    loop->between[0].rotation = given->between[0].rotation;
    loop->between[1].rotation = given->between[1].rotation;
    linkage_compile(&l);
    kt_check_text(what, kt_model_plan(l.model), expected);
}

static kt_rotation about(kt_vec3 axis, double angle) { return kt_rotation_vector(kt_vec3_scale(angle, axis)); }

static const kt_vec3 x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, z = {0.0, 0.0, 1.0}, oblique = {0.0, 0.6, 0.8};

KT_TEST(coaxial_loops_are_planar_where_both_axes_are) {
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_COAXIAL;
    loop.axis = z;
    check_plan("along the normal", &loop, "planar");
    loop.axis = x;
    check_plan("in the plane", &loop, "planar");
    loop.axis = oblique;
    check_plan("oblique", &loop, "spatial");
    loop.axis = z;
    loop.between[1].rotation = about(x, 0.3);
    check_plan("along the normal, and the other not", &loop, "spatial");
    loop.axis = x;
    loop.between[1].rotation = about(y, 0.3);
    check_plan("in the plane, and the other not", &loop, "spatial");
    loop.between[1].rotation = about(z, 0.3);
    check_plan("both in the plane", &loop, "planar");
    loop.between[0].rotation = about(y, 0.3);
    check_plan("the other in the plane, and the first not", &loop, "spatial");
}

KT_TEST(orthogonal_loops_are_planar_where_both_axes_are) {
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_ORTHOGONAL;
    static const struct {
        kt_vec3 first, second;
        const char *plan;
    } table[] = {{{1, 0, 0}, {0, 1, 0}, "planar"},      {{0, 0, 1}, {1, 0, 0}, "planar"},
                 {{1, 0, 0}, {0, 0, 1}, "planar"},      {{0, 0, 1}, {0, 0.6, 0.8}, "spatial"},
                 {{0, 0.6, 0.8}, {0, 0, 1}, "spatial"}, {{1, 0, 0}, {0, 0.6, 0.8}, "spatial"},
                 {{0, 0.6, 0.8}, {1, 0, 0}, "spatial"}, {{0, 0.6, 0.8}, {0, 0.6, 0.8}, "spatial"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        loop.axis = table[i].first;
        loop.axis2 = table[i].second;
        check_plan("axes", &loop, table[i].plan);
    }
}

KT_TEST(parallel_loops_are_planar_where_the_ends_agree_on_the_normal) {
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_PARALLEL;
    check_plan("alike", &loop, "planar");
    loop.between[1].rotation = about(z, 0.3);
    check_plan("turned in the plane", &loop, "planar");
    loop.between[1].rotation = about(x, 0.3);
    check_plan("turned out of it", &loop, "spatial");
    loop.between[0].rotation = about(x, 0.3);
    check_plan("both turned out of it alike", &loop, "planar");
}
