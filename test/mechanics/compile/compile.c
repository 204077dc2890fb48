/* From descriptions to models: the order of bodies and coordinates, and the descriptions that are accepted or rejected.
 * Failures leave nothing behind. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "string_up.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- order --------------------------------------------------------------------------------------------------- */

static int described(const kt_tree *tree, const char *name) {
    for (int i = 0; name && i < tree->description.body_count; i++)
        if (strcmp(tree->body[i].name, name) == 0)
            return i;
    return -1;
}

/* The rule, as the header words it: the description's order, except that a parent precedes its children. */
static void expect_order(const kt_tree *tree, int i, int *order, int *count) {
    if (i < 0)
        return;
    for (int k = 0; k < *count; k++)
        if (order[k] == i)
            return;
    expect_order(tree, described(tree, tree->body[i].parent), order, count);
    order[(*count)++] = i;
}

KT_TEST(bodies_keep_the_order_of_the_description_but_follow_their_parents) {
    kt_random random = kt_random_of_test();
    KT_WORST source = kt_worst_make("places in the description"), parent = kt_worst_make("parents come first");
    KT_WORST first = kt_worst_make("first coordinates");
    for (int n = 0; n < 100; n++) {
        kt_tree tree;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, KT_TREE_BODIES);
        plan.is_shuffled = n % 4 != 0;
        int order[KT_TREE_BODIES], count = 0, q = 0, v = 0;
        kt_tree_grow(&tree, &plan, &random);
        for (int i = 0; i < plan.bodies; i++)
            expect_order(&tree, i, order, &count);
        for (int b = 1; b < tree.count; b++) {
            const int i = kt_body_source(tree.model, b), up = kt_body_parent(tree.model, b);
            const kt_coordinates c = kt_body_coordinates(tree.model, b);
            kt_worst_near(&source, i, plan.is_shuffled ? order[b - 1] : b - 1, 0.0, "tree %d body %d", n, b);
            const int above = described(&tree, tree.body[i].parent);
            kt_worst_near(&parent, up, above < 0 ? 0 : kt_body_find(tree.model, tree.body[above].name), 0.0, "%d %d", n,
                          b);
            kt_worst_below(&parent, up >= b, 0.0, "tree %d body %d", n, b);
            kt_worst_near(&first, c.q, q, 0.0, "tree %d body %d", n, b);
            kt_worst_near(&first, c.v, v, 0.0, "tree %d body %d", n, b);
            q += c.nq;
            v += c.nv;
        }
        kt_worst_near(&first, tree.nq, q, 0.0, "tree %d", n);
        kt_worst_near(&first, tree.nv, v, 0.0, "tree %d", n);
    }
}

/* ---- inertia ------------------------------------------------------------------------------------------------- */

static const kt_vec3 ex = {1.0, 0.0, 0.0}, ey = {0.0, 1.0, 0.0}, ez = {0.0, 0.0, 1.0}, oblique = {1.0, -2.0, 0.5};

/* A rod along `along`, without thickness. */
static void load_rod(kt_body *body, kt_vec3 along) {
    body->mass = 49.0;
    body->shape.type = KT_SHAPE_ROD;
    body->shape.to = along;
    body->com_of_shape = body->inertia_of_shape = true;
}

static void rejected(kt_tree *tree, const char *what, const char *name) {
    kt_error error;
    kt_model *model = NULL;
    char where[40];
    const kt_status status = kt_model_compile(&tree->description, NULL, &model, &error);
    if (!kt_check_equal_int(what, status, KT_ERROR_MODEL))
        kt_model_free(model);
    if (status == KT_OK)
        return;
    snprintf(where, sizeof where, "body '%s'", name);
    kt_check_text("where", error.where, where);
    kt_check_contains("what is wrong", error.message,
                      "moves nothing that has inertia along one of its degrees of freedom");
    kt_check_contains("how to mend it", error.message, "or make the joint fixed");
    kt_check_true("no model", model == NULL);
}

KT_TEST(a_freedom_without_inertia_is_rejected_in_words) {
    kt_tree tree = {.count = 0};
    kt_error error;
    kt_model *model = NULL;
    (void)add(&tree, "crank", KT_JOINT_REVOLUTE, ez);
    kt_check_equal_int("status", kt_model_compile(&tree.description, NULL, &model, &error), KT_ERROR_MODEL);
    kt_check_equal_int("code", error.code, KT_ERROR_MODEL);
    kt_check_text("where", error.where, "body 'crank'");
    kt_check_text("message", error.message,
                  "its revolute joint moves nothing that has inertia along one of its degrees of freedom: give "
                  "'crank', or a body "
                  "that it carries, mass and inertia there, or make the joint fixed");
    kt_check_true("no model", model == NULL);
}

KT_TEST(every_joint_type_is_rejected_where_it_carries_no_mass) {
    for (int type = KT_JOINT_REVOLUTE; type < KT_JOINT_TYPE_COUNT; type++) {
        kt_tree tree = {.count = 0};
        add(&tree, "a", (kt_joint_type)type, ez)->joint.pitch = 0.1;
        rejected(&tree, kt_joint_type_name((kt_joint_type)type), "a");
    }
}

KT_TEST(a_slender_rod_that_turns_about_itself_is_rejected) {
    const kt_vec3 axes[4] = {ex, ey, oblique, kt_vec3_make(1.0, 1e-9, 3.0)};
    for (int i = 0; i < 4; i++) {
        kt_tree tree = {.count = 0};
        load_rod(add(&tree, "rod", KT_JOINT_REVOLUTE, axes[i]), axes[i]);
        rejected(&tree, "about its axis", "rod");
        tree.body[0].joint.type = KT_JOINT_SPHERICAL;
        rejected(&tree, "on a ball", "rod");
        tree.body[0].joint.type = KT_JOINT_FREE;
        rejected(&tree, "free", "rod");
        tree.body[0].joint.type = KT_JOINT_CYLINDRICAL;
        rejected(&tree, "sliding along it, too", "rod");
        tree.body[0].joint.type = KT_JOINT_REVOLUTE;
        tree.body[0].joint.rotation = kt_rotation_rpy(0.3, 1.5707963267948966, -1.0);
        rejected(&tree, "in a turned frame", "rod");
    }
}

KT_TEST(a_point_at_the_joint_it_turns_on_is_rejected) {
    kt_tree tree = {.count = 0};
    load(add(&tree, "point", KT_JOINT_REVOLUTE, ey), 1.0, kt_vec3_make(0.0, 3.0, 0.0), 0.0);
    rejected(&tree, "on the axis", "point");
    tree.body[0].joint.type = KT_JOINT_SPHERICAL;
    tree.body[0].com = oblique;
    rejected(&tree, "on a ball, in line with it", "point");
}

/* The second of two such bodies takes all the inertia that the first would have. */
KT_TEST(massless_bodies_that_move_as_their_child_moves_are_rejected) {
    static const kt_joint_type types[3] = {KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC, KT_JOINT_SCREW};
    static const double masses[3] = {1.0, 3.0, 49.0};
    const kt_vec3 axes[3] = {ez, oblique, kt_vec3_make(-0.3, 0.0, 7.0)};
    for (int t = 0; t < 3; t++)
        for (int m = 0; m < 3; m++)
            for (int a = 0; a < 3; a++) {
                kt_tree tree = {.count = 0};
                add(&tree, "first", types[t], axes[a])->joint.pitch = 0.2;
                kt_body *second = add(&tree, "second", types[t], axes[a]);
                second->joint.pitch = 0.2;
                load(second, masses[m], kt_vec3_make(0.4, 0.7, 0.1), 0.3);
                if (m == 2) /* the same axis, farther along it */
                    second->joint.at = axes[a];
                rejected(&tree, kt_joint_type_name(types[t]), "first");
            }
}

/* Inertia that rounding left over, of several sizes, is none. */
KT_TEST(rounding_is_not_taken_for_inertia) {
    for (int n = 0; n < 3; n++) { /* a table that slides both ways, with a point on it, on a massless turntable */
        kt_tree tree = {.count = 0};
        (void)add(&tree, "turntable", KT_JOINT_REVOLUTE, n ? oblique : ez);
        tree.body[0].joint.position[0] = 0.7;
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(n ? oblique : ez), 2);
        (void)add(&tree, "x", KT_JOINT_PRISMATIC, triad.x);
        load(add(&tree, "y", KT_JOINT_PRISMATIC, triad.y), n == 2 ? 49.0 : 0.7, kt_vec3_make(0.0, 0.0, 0.0), 0.0);
        tree.body[1].joint.position[0] = 3.0;
        rejected(&tree, "turntable", "turntable");
    }
    for (int n = 0; n < 2; n++) { /* gimbals of four rings */
        kt_tree tree = {.count = 0};
        const kt_vec3 axes[4] = {oblique, ez, ey, ex};
        static const char *names[4] = {"a", "b", "c", "d"};
        for (int i = 0; i < 4; i++)
            (void)add(&tree, names[i], KT_JOINT_REVOLUTE, axes[i]);
        load(&tree.body[3], 7.0, kt_vec3_make(0.3, n ? 5.0 : 0.0, 0.0), 0.1);
        tree.body[0].joint.rotation = kt_rotation_vector(kt_vec3_make(0.4, -0.2, 1.0));
        rejected(&tree, "four rings", "a");
    }
}

static void accepted(kt_tree *tree, const char *what) {
    kt_note("%s", what);
    kt_tree_compile(tree, NULL);
    kt_check_true("is a mechanism", tree->nv > 0);
    memset(tree, 0, sizeof *tree);
}

KT_TEST(massless_bodies_inside_regular_chains_are_accepted) {
    kt_tree tree = {.count = 0};
    (void)add(&tree, "ring", KT_JOINT_REVOLUTE, ez);
    load(add(&tree, "wheel", KT_JOINT_REVOLUTE, ex), 1.0, kt_vec3_make(0.0, 0.0, 0.0), 0.1);
    accepted(&tree, "two rings");
    (void)add(&tree, "outer", KT_JOINT_REVOLUTE, ez);
    (void)add(&tree, "inner", KT_JOINT_REVOLUTE, ex);
    load(add(&tree, "wheel", KT_JOINT_REVOLUTE, ey), 1.0, kt_vec3_make(0.0, 0.0, 0.0), 0.1);
    accepted(&tree, "three rings");
    (void)add(&tree, "upper", KT_JOINT_REVOLUTE, ez);
    load(add(&tree, "lower", KT_JOINT_REVOLUTE, ez), 1.0, ex, 0.0);
    tree.body[1].joint.at = ex;
    accepted(&tree, "an arm of two links with a point at its end");
    (void)add(&tree, "table", KT_JOINT_PRISMATIC, ex);
    load(add(&tree, "tool", KT_JOINT_PRISMATIC, oblique), 1.0, ex, 0.0);
    accepted(&tree, "two slides");
    (void)add(&tree, "carrier", KT_JOINT_FIXED, ez);
    load(add(&tree, "rotor", KT_JOINT_REVOLUTE, ez), 0.0, ex, 0.1);
    accepted(&tree, "inertia without mass");
    (void)add(&tree, "point", KT_JOINT_REVOLUTE, ez);
    load(&tree.body[0], 1.0, ex, 0.0);
    accepted(&tree, "a point pendulum");
}

/* Singular where it starts, but not everywhere: a mechanism, whose dynamics have to wait for a better position. */
KT_TEST(a_mechanism_that_starts_at_a_singular_position_is_accepted) {
    kt_tree tree = {.count = 0};
    (void)add(&tree, "outer", KT_JOINT_REVOLUTE, ez);
    (void)add(&tree, "inner", KT_JOINT_REVOLUTE, ex);
    load(add(&tree, "wheel", KT_JOINT_REVOLUTE, ey), 1.0, kt_vec3_make(0.0, 0.0, 0.0), 0.1);
    tree.body[1].joint.position[0] = 1.5707963267948966;
    accepted(&tree, "gimbals in lock");
}

/* Small next to the rest, but not zero: 1e-10 of the inertia about the same axis, 1e-12 of the mass that hangs on
 * it. */
KT_TEST(small_inertias_are_inertias) {
    kt_tree tree = {.count = 0};
    load(add(&tree, "ship", KT_JOINT_FREE, ez), 1e6, ex, 1e7);
    load(add(&tree, "mast", KT_JOINT_REVOLUTE, oblique), 1e3, ex, 1e3);
    load(add(&tree, "vane", KT_JOINT_REVOLUTE, oblique), 1e-3, kt_vec3_make(0.0, 0.0, 0.0), 1e-6);
    accepted(&tree, "a vane on a mast on a ship");
    load(add(&tree, "rotor", KT_JOINT_REVOLUTE, oblique), 1e-3, kt_vec3_make(0.0, 0.0, 0.0), 1e-7);
    load(add(&tree, "mast", KT_JOINT_REVOLUTE, oblique), 1e2, kt_vec3_make(0.0, 0.0, 0.0), 1e3);
    accepted(&tree, "a mast that turns in a rotor");
    load(add(&tree, "sledge", KT_JOINT_PRISMATIC, oblique), 1e-6, kt_vec3_make(0.0, 0.0, 0.0), 0.0);
    load(add(&tree, "load", KT_JOINT_PRISMATIC, oblique), 1e6, kt_vec3_make(0.0, 0.0, 0.0), 0.0);
    accepted(&tree, "a load that slides on a sledge");
}

/* ---- options and failures ------------------------------------------------------------------------------------ */

KT_TEST(a_level_that_there_is_not_is_rejected) {
    kt_tree tree = {.count = 0};
    kt_error error;
    kt_model *model = NULL;
    kt_model_options options = kt_model_options_default();
    load(add(&tree, "a", KT_JOINT_REVOLUTE, ez), 1.0, ex, 1.0);
    options.isa = (kt_isa)99;
    kt_check_equal_int("status", kt_model_compile(&tree.description, &options, &model, &error), KT_ERROR_UNSUPPORTED);
    kt_check_text("where", error.where, "options.isa");
    kt_check_contains("message", error.message, "KT_ISA_AUTO");
    kt_check_true("no model", model == NULL);
    options.isa = KT_ISA_BASE;
    kt_check_equal_int("baseline", kt_model_compile(&tree.description, &options, &model, &error), KT_OK);
    kt_check_equal_int("level", kt_model_isa(model), KT_ISA_BASE);
    kt_model_free(model);
}

KT_TEST(options_that_are_none_are_rejected) {
    kt_tree tree = {.count = 0};
    kt_error error;
    kt_model *model = NULL;
    kt_model_options wrong[2];
    static const char *const where[] = {"options.metric", "options.plan"};
    load(add(&tree, "a", KT_JOINT_REVOLUTE, ez), 1.0, ex, 1.0);
    for (int i = 0; i < 2; i++)
        wrong[i] = kt_model_options_default();
    wrong[0].metric = (kt_metric)(KT_METRIC_MASS + 1);
    wrong[1].plan = (kt_plan)77;
    for (int i = 0; i < 2; i++) {
        kt_check_equal_int("status", kt_model_compile(&tree.description, &wrong[i], &model, &error), KT_ERROR_ARGUMENT);
        kt_check_text("where", error.where, where[i]);
        kt_check_true("no model", model == NULL);
    }
    kt_check_equal_int("nowhere to put it", kt_model_compile(&tree.description, NULL, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_text("message", error.message, "'model' is NULL; it must be given");
}

KT_TEST(a_wrong_description_is_rejected_before_anything_is_made) {
    kt_tree tree = {.count = 0};
    kt_error error;
    kt_model *model = NULL;
    load(add(&tree, "a", KT_JOINT_REVOLUTE, ez), -1.0, ex, 1.0);
    kt_check_equal_int("status", kt_model_compile(&tree.description, NULL, &model, &error), KT_ERROR_MODEL);
    kt_check_contains("message", error.message, "mass is -1");
    kt_check_true("no model", model == NULL);
}

KT_TEST(a_model_outlives_its_description) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    const kt_tree_plan plan = kt_tree_plan_default();
    double a[KT_TREE_NV], b[KT_TREE_NV];
    kt_tree_sample(&tree, &plan, &random, &s);
    kt_tree_forward(&tree, &s, a);
    memset(&tree.description, 0xFF, sizeof tree.description);
    memset(tree.body, 0xFF, sizeof tree.body);
    memset(tree.name, 0xFF, sizeof tree.name);
    memset(tree.marker, 0xFF, sizeof tree.marker);
    kt_tree_forward(&tree, &s, b);
    kt_check_equal_bits("accelerations", b, a, (size_t)tree.nv);
    kt_check_text("name", kt_body_name(tree.model, 3), "b2");
    kt_check_text("marker", kt_marker_name(tree.model, 3, 0), "tip");
}

/* Every allocation in turn is made to fail. */
KT_TEST(a_compilation_that_runs_out_of_memory_leaves_nothing_behind) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    const kt_tree_plan plan = kt_tree_plan_default();
    kt_tree_describe(&tree, &plan, &random);
    int tried = 0;
    for (long n = 1;; n++) {
        kt_error error = {0};
        kt_model *model = NULL;
        kt_data *data = NULL;
        kt_interpose_start_failing(n);
        kt_status status = kt_model_compile(&tree.description, NULL, &model, &error);
        if (status == KT_OK)
            status = kt_data_create(model, &data, &error);
        const bool untouched = status == KT_OK || data == NULL;
        kt_data_free(data);
        kt_model_free(model);
        const long allocations = kt_interpose_stop();
        if (!kt_interpose_has_failed()) {
            kt_check_equal_int("in the end", status, KT_OK);
            kt_check_equal_int("all is released", kt_interpose_frees(), allocations);
            break;
        }
        tried++;
        kt_check_equal_int("status", status, KT_ERROR_MEMORY);
        kt_check_equal_int("released", kt_interpose_frees(), allocations - 1);
        kt_check_true("outputs are untouched", untouched);
    }
    kt_check_above("allocations made to fail", tried, 3.0);
}
