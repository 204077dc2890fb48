/* Which trees are taken for planar, and how their links are strung. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "model/model.h"

#include <float.h>
#include <string.h>

enum { MOST = 12 };

typedef struct world {
    kt_body body[MOST];
    int count;
    kt_loop loop[1];
    int loops;
    kt_plan plan;
} world;

static const kt_vec3 x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, z = {0.0, 0.0, 1.0};

/* A body with mass anywhere. */
static kt_body *add(world *w, const char *name, const char *parent, kt_joint_type type, kt_vec3 axis) {
    kt_body *body = &w->body[w->count++];
    *body = kt_body_of(name, parent, type, 1.0);
    body->joint.axis = axis;
    body->joint.at = kt_vec3_make(0.3, -0.2, 0.7);
    body->com = kt_vec3_make(0.1, 0.2, -0.3);
    body->inertia = kt_sym3_make(0.3, 0.4, 0.5, 0.01, 0.02, -0.03);
    return body;
}

static kt_model *compile(const world *w) {
    kt_model_options options = kt_model_options_default();
    kt_description d = kt_description_of(w->body, w->count, w->loop, w->loops, NULL, 0);
    d.gravity = kt_vec3_make(1.0, 2.0, 3.0);
    options.plan = w->plan;
    return kt_test_model(&d, &options);
}

static void check_plan(const char *what, const world *w, const char *plan) {
    kt_check_text(what, kt_model_plan(compile(w)), plan);
}

/* ---- joint types --------------------------------------------------------------------------------------------- */

KT_TEST(turns_about_one_direction_and_slides_across_it_are_planar) {
    world w = {.count = 0};
    add(&w, "cart", NULL, KT_JOINT_PRISMATIC, x);
    check_plan("a slide", &w, "planar");
    add(&w, "rod", "cart", KT_JOINT_REVOLUTE, kt_vec3_make(0.0, -3.0, 0.0));
    check_plan("a cart with a rod", &w, "planar");
    add(&w, "tool", "rod", KT_JOINT_FIXED, z);
    add(&w, "puck", "tool", KT_JOINT_PLANAR, y);
    add(&w, "piston", "rod", KT_JOINT_PRISMATIC, kt_vec3_make(1.0, 0.0, -2.0));
    check_plan("with a piston and a puck", &w, "planar");
    add(&w, "lift", "puck", KT_JOINT_PRISMATIC, y);
    check_plan("a slide out of the plane", &w, "spatial");
}

KT_TEST(other_joints_are_spatial) {
    static const kt_joint_type types[] = {KT_JOINT_SCREW, KT_JOINT_CYLINDRICAL, KT_JOINT_UNIVERSAL, KT_JOINT_SPHERICAL,
                                          KT_JOINT_FREE};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        world w = {.count = 0};
        add(&w, "arm", NULL, KT_JOINT_REVOLUTE, y);
        add(&w, "hand", "arm", types[i], y);
        check_plan(kt_joint_type_name(types[i]), &w, "spatial");
    }
}

KT_TEST(slides_alone_are_planar_where_a_plane_holds_them) {
    world w = {.count = 0};
    add(&w, "a", NULL, KT_JOINT_PRISMATIC, kt_vec3_make(1.0, 2.0, 3.0));
    add(&w, "b", "a", KT_JOINT_PRISMATIC, kt_vec3_make(-2.0, -4.0, -6.0));
    check_plan("one direction", &w, "planar");
    add(&w, "c", "b", KT_JOINT_PRISMATIC, kt_vec3_make(0.0, 1.0, -1.0));
    add(&w, "d", "a", KT_JOINT_PRISMATIC, kt_vec3_make(1.0, 3.0, 2.0));
    check_plan("two directions", &w, "planar");
    add(&w, "e", "d", KT_JOINT_PRISMATIC, z);
    check_plan("three", &w, "spatial");
}

/* ---- how parallel -------------------------------------------------------------------------------------------- */

KT_TEST(an_axis_that_is_oblique_by_more_than_rounding_is_spatial) {
    static const double tilt[] = {0.0, 4.0 * DBL_EPSILON, 1e-14, 1e-13, 1e-9, 1e-3};
    static const char *const plan[] = {"planar", "planar", "spatial", "spatial", "spatial", "spatial"};
    for (int i = 0; i < 6; i++) {
        world w = {.count = 0};
        add(&w, "arm", NULL, KT_JOINT_REVOLUTE, y);
        add(&w, "hand", "arm", KT_JOINT_REVOLUTE, kt_vec3_make(tilt[i], 1.0, 0.0));
        kt_note("tilt %g", tilt[i]);
        check_plan("a turn", &w, plan[i]);
        w.count = 1;
        add(&w, "hand", "arm", KT_JOINT_PRISMATIC, kt_vec3_make(1.0, tilt[i], 0.0));
        check_plan("a slide", &w, plan[i]);
    }
}

/* An axis that is written in many frames: rotations by generic angles about generic axes, and back. */
KT_TEST(rotations_between_parallel_axes_are_seen_through) {
    kt_random random = kt_random_of_test();
    int planar = 0;
    enum { TRIALS = 500 };
    for (int n = 0; n < TRIALS; n++) {
        world w = {.count = 0};
        static const char *const name[] = {"a", "b", "c", "d", "e", "f", "g", "h"};
        double direction[3];
        kt_random_direction(&random, 3, direction);
        kt_vec3 normal = kt_vec3_make(direction[0], direction[1], direction[2]);
        for (int i = 0; i < 8; i++) {
            kt_body *b = add(&w, name[i], i ? name[i - 1] : NULL, i % 3 == 1 ? KT_JOINT_FIXED : KT_JOINT_REVOLUTE, z);
            kt_mat3 r;
            kt_error e;
            b->joint.rotation =
                kt_rotation_rpy(kt_random_uniform(&random, -3.0, 3.0), kt_random_uniform(&random, -1.5, 1.5),
                                kt_random_uniform(&random, -3.0, 3.0));
            if (kt_rotation_evaluate(&b->joint.rotation, &r, &e) != KT_OK)
                return;
            normal = kt_mat3_apply_transposed(r, normal);
            b->joint.axis = kt_vec3_scale(kt_random_int(&random, 0, 1) ? 2.5 : -0.3, normal);
        }
        planar += strcmp(kt_model_plan(compile(&w)), "planar") == 0;
    }
    kt_check_equal_int("planar", planar, TRIALS);
}

/* ---- several trees ------------------------------------------------------------------------------------------- */

/* Links: spatial trees first, each depth first, then the planes. */
KT_TEST(spatial_trees_come_first_and_planes_one_by_one) {
    static const char *const order[] = {"ball", "hand", "a1", "a2", "a3", "b1", "b2"};
    world w = {.count = 0};
    add(&w, "a1", NULL, KT_JOINT_REVOLUTE, y);
    add(&w, "wall", NULL, KT_JOINT_FIXED, z);
    add(&w, "b1", "wall", KT_JOINT_REVOLUTE, x);
    add(&w, "ball", NULL, KT_JOINT_SPHERICAL, z);
    add(&w, "a2", "a1", KT_JOINT_PRISMATIC, x);
    add(&w, "a3", "wall", KT_JOINT_REVOLUTE, kt_vec3_make(0.0, -1.0, 0.0));
    add(&w, "hand", "ball", KT_JOINT_REVOLUTE, z);
    add(&w, "b2", "b1", KT_JOINT_REVOLUTE, x);
    kt_model *m = compile(&w);
    kt_check_text("plan", kt_model_plan(m), "mixed");
    kt_check_equal_int("planes", (long long)m->n.plane, 2);
    kt_check_equal_int("the first planar link", (long long)m->n.spatial, 3);
    kt_check_equal_int("the first planar angle", (long long)m->n.spatial_angle, 1);
    kt_check_equal_int("places", (long long)m->n.planar, 6);
    for (size_t i = 1; i < m->n.link; i++)
        kt_check_text("link", m->text + m->body[m->link[i].body].name, order[i - 1]);
    kt_check_equal_int("first of a plane", m->plane[0].first, 1);
    kt_check_equal_int("end of a plane", m->plane[0].last, 4);
    kt_check_equal_int("first of a plane", m->plane[1].first, 4);
    kt_check_equal_int("end of a plane", m->plane[1].last, 6);
    kt_check_near("turns the other way", m->planar[3].sign, -1.0, 0.0);
    kt_check_equal_int("parent", m->planar[2].parent, 1);
}

KT_TEST(a_spatial_plan_makes_all_trees_spatial_and_takes_no_memory_for_planes) {
    world w = {.count = 0};
    add(&w, "arm", NULL, KT_JOINT_REVOLUTE, y);
    add(&w, "hand", "arm", KT_JOINT_REVOLUTE, y);
    kt_model *planar = compile(&w);
    w.plan = KT_PLAN_SPATIAL;
    kt_model *spatial = compile(&w);
    kt_check_text("planar", kt_model_plan(planar), "planar");
    kt_check_text("spatial", kt_model_plan(spatial), "spatial");
    kt_check_equal_int("planes", (long long)spatial->n.plane + (long long)spatial->n.planar, 0);
    kt_check_equal_int("spatial links", (long long)spatial->n.spatial, (long long)spatial->n.link);
    kt_check_above("bytes saved", (double)kt_data_size(planar) - (double)kt_data_size(spatial), 1.0);
}
