/* The inputs that the dynamics reject, and the messages. Rejected calls leave everything untouched. The smallest
 * mechanisms are here, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include <math.h>
#include <string.h>

static const double not_a_number = (double)NAN;

/* A pendulum that turns about z, with a rod hanging on a ball at its end. */
static void grow_pendulum(kt_tree *tree) {
    memset(tree, 0, sizeof *tree);
    tree->description = kt_description_default();
    tree->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&tree->description, tree->body, 2, NULL, 0, NULL, 0);
    for (int i = 0; i < 2; i++) {
        kt_body *body = &tree->body[i];
        *body = kt_body_default();
        body->mass = 2.0;
        body->com = kt_vec3_make(0.5, 0.0, 0.0);
        body->inertia = kt_sym3_make(0.1, 0.2, 0.2, 0.0, 0.0, 0.0);
    }
    tree->body[0].name = "arm";
    tree->body[0].joint.type = KT_JOINT_REVOLUTE;
    tree->body[1].name = "rod";
    tree->body[1].parent = "arm";
    tree->body[1].joint.type = KT_JOINT_SPHERICAL;
    tree->body[1].joint.at = kt_vec3_make(1.0, 0.0, 0.0);
    kt_tree_compile(tree, NULL);
}

/* q: angle, quaternion; v: rate, angular velocity */
typedef struct inputs {
    double q[5], v[4], x[4];
    kt_wrench external[3];
} inputs;

static const inputs fine = {.q = {0.3, 1.0, 0.0, 0.0, 0.0}, .v = {1.0, 2.0, 3.0, 4.0}, .x = {0.1, 0.2, 0.3, 0.4}};

typedef enum call { FORWARD, INVERSE, MASS, KINEMATICS, CALLS } call;

/* One of the calls, with outputs that must keep their bits when it fails. */
static kt_status try_call(const kt_tree *tree, call which, const inputs *in, kt_error *error) {
    const kt_model *m = tree->model;
    double out[16], before[16];
    kt_status status = KT_OK;
    for (int i = 0; i < 16; i++)
        out[i] = before[i] = i + 0.5;
    memset(error, 0, sizeof *error);
    switch (which) {
    case FORWARD:
        status = kt_dynamics_forward(m, tree->data, in->q, in->v, in->x, in->external, out, error);
        break;
    case INVERSE:
        status = kt_dynamics_inverse(m, tree->data, in->q, in->v, in->x, in->external, out, error);
        break;
    case MASS:
        status = kt_dynamics_mass(m, tree->data, in->q, out, error);
        break;
    default:
        status = kt_kinematics_update(m, tree->data, in->q, in->v, in->x, error);
        break;
    }
    if (status != KT_OK)
        kt_check_equal_bits("outputs after the failure", out, before, 16);
    return status;
}

static void rejected(const kt_tree *tree, call which, const inputs *in, kt_status code, const char *where,
                     const char *message) {
    kt_error error;
    kt_check_equal_int("status", try_call(tree, which, in, &error), code);
    kt_check_equal_int("code in the error", error.code, code);
    kt_check_text("where", error.where, where);
    kt_check_contains("message", error.message, message);
}

KT_TEST(numbers_that_are_not_finite_are_rejected_by_the_name_of_their_joint) {
    kt_tree tree;
    const double bad[2] = {not_a_number, -(double)INFINITY};
    grow_pendulum(&tree);
    for (int i = 0; i < 2; i++)
        for (call c = FORWARD; c < CALLS; c++) {
            inputs in = fine;
            in.q[0] = bad[i];
            rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", i ? "position is -inf" : "position is nan");
            in = fine;
            in.q[3] = bad[i];
            rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'rod'",
                     i ? "position[2] is -inf" : "position[2] is nan");
            if (c == MASS)
                continue;
            in = fine;
            in.v[2] = bad[i];
            rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'rod'",
                     i ? "velocity[1] is -inf" : "velocity[1] is nan");
            in = fine;
            in.x[0] = bad[i];
            rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", c == FORWARD ? "force is" : "acceleration is");
            if (c == KINEMATICS)
                continue;
            in = fine;
            in.external[2].force.y = bad[i];
            rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "body 'rod'", "external wrench");
        }
}

/* A post on the ground, and two rods one on the other that turn about z: in their plane, or in space. */
static void grow_rods(kt_tree *tree, kt_plan plan) {
    static const char *const name[] = {"post", "upper", "lower"};
    kt_model_options options = kt_model_options_default();
    options.plan = plan;
    memset(tree, 0, sizeof *tree);
    tree->description = kt_description_of(tree->body, 3, NULL, 0, NULL, 0);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &tree->body[i];
        *body = kt_body_of(name[i], i > 0 ? name[i - 1] : NULL, i > 0 ? KT_JOINT_REVOLUTE : KT_JOINT_FIXED, 2.0);
        body->com = kt_vec3_make(0.5, 0.0, 0.0);
    }
    kt_tree_compile(tree, &options);
}

/* Components that a joint does not feel, or that are across a plane, leave no trace in the numbers. */
KT_TEST(wrenches_that_are_not_finite_are_rejected_wherever_they_point) {
    static const char *const where[] = {"", "body 'post'", "body 'upper'", "body 'lower'"};
    const kt_plan plans[] = {KT_PLAN_AUTO, KT_PLAN_SPATIAL};
    for (int i = 0; i < 16 * 6; i++) {
        kt_tree tree;
        kt_wrench external[4] = {{.force = {0.0, 0.0, 0.0}}};
        const int body = i / 2 % 4, k = i / 8 % 6;
        kt_vec3 *part = k < 3 ? &external[body].moment : &external[body].force;
        *(k % 3 == 0 ? &part->x : k % 3 == 1 ? &part->y : &part->z) = i / 48 ? (double)INFINITY : not_a_number;
        grow_rods(&tree, plans[i % 2]);
        const double q[2] = {0.3, 0.4};
        double out[2] = {5.0, 6.0};
        kt_error error = {KT_OK, "", ""};
        for (int inverse = 0; inverse < 2; inverse++) {
            const kt_status status =
                inverse ? kt_dynamics_inverse(tree.model, tree.data, q, NULL, NULL, external, out, &error)
                        : kt_dynamics_forward(tree.model, tree.data, q, NULL, NULL, external, out, &error);
            kt_check_equal_int("status", status, body ? KT_ERROR_NOT_FINITE : KT_OK); /* the world's is ignored */
            if (body) {
                kt_check_text("where", error.where, where[body]);
                kt_check_true("outputs as they were", out[0] == 5.0 && out[1] == 6.0);
            }
        }
    }
}

KT_TEST(a_quaternion_of_zeros_is_rejected_and_one_of_any_other_norm_is_not) {
    kt_tree tree;
    grow_pendulum(&tree);
    for (call c = FORWARD; c < CALLS; c++) {
        inputs in = fine;
        kt_error error;
        in.q[1] = 0.0;
        rejected(&tree, c, &in, KT_ERROR_ARGUMENT, "joint 'rod'", "quaternion is zero");
        in.q[2] = 5e-324;
        kt_check_equal_int("the smallest", try_call(&tree, c, &in, &error), KT_OK);
        in.q[2] = 1e300;
        kt_check_equal_int("a huge one", try_call(&tree, c, &in, &error), KT_OK);
        for (int k = 3; k <= 4; k++) {
            in.q[2] = in.q[3] = in.q[4] = 0.0;
            in.q[k] = 1.0;
            kt_check_equal_int("a half turn", try_call(&tree, c, &in, &error), KT_OK);
        }
    }
}

/* The quaternion of a free joint follows its position. */
KT_TEST(a_quaternion_of_zeros_is_rejected_behind_any_position) {
    static const double zeros[7] = {1.0, 2.0, 3.0}, half_turn[7] = {[4] = 1.0};
    kt_body body = kt_body_of("kite", NULL, KT_JOINT_FREE, 1.0);
    body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    const kt_description description = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    const kt_model *model = kt_test_model(&description, NULL);
    kt_data *data = kt_test_data(model);
    double a[6];
    kt_error error = {0};
    kt_check_equal_int("zeros", kt_dynamics_forward(model, data, zeros, NULL, NULL, NULL, a, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "quaternion is zero");
    kt_check_text("joint", error.where, "joint 'kite'");
    kt_check_equal_int("a half turn at the origin",
                       kt_dynamics_forward(model, data, half_turn, NULL, NULL, NULL, a, &error), KT_OK);
    kt_check_equal_int("its kinematics", kt_kinematics_update(model, data, half_turn, NULL, NULL, &error), KT_OK);
}

KT_TEST(results_that_overflow_are_rejected) {
    kt_tree tree;
    grow_pendulum(&tree);
    inputs in = fine;
    in.v[0] = 1e200; /* its square is infinite */
    rejected(&tree, FORWARD, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "huge");
    rejected(&tree, INVERSE, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "huge");
    rejected(&tree, KINEMATICS, &in, KT_ERROR_NOT_FINITE, "joint 'rod'", "huge");
    tree.body[1].joint.type = KT_JOINT_PRISMATIC;
    kt_tree_compile(&tree, NULL);
    in = fine;
    in.q[1] = 1e200; /* and so is the inertia */
    rejected(&tree, MASS, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "huge");
}

KT_TEST(the_entry_of_the_world_among_wrenches_is_ignored) {
    kt_tree tree;
    grow_pendulum(&tree);
    inputs in = fine;
    kt_error error;
    in.external[0].force.x = (double)INFINITY;
    for (call c = FORWARD; c < CALLS; c++)
        kt_check_equal_int("a wrench on the world", try_call(&tree, c, &in, &error), KT_OK);
}

/* ---- singular positions -------------------------------------------------------------------------------------- */

/* Gimbals: two massless rings that turn about z and x, and a body that turns about y. At a quarter turn of the second
 * ring its axis coincides with the first one's. The two can then turn against each other without resistance. */
static void grow_gimbals(kt_tree *tree) {
    static const char *names[3] = {"outer", "inner", "wheel"};
    memset(tree, 0, sizeof *tree);
    tree->description = kt_description_of(tree->body, 3, NULL, 0, NULL, 0);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &tree->body[i];
        *body = kt_body_of(names[i], i ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 0.0);
        body->joint.axis = kt_vec3_make(i == 1, i == 2, i == 0);
    }
    tree->body[2].mass = 1.0;
    tree->body[2].inertia = kt_sym3_make(0.1, 0.2, 0.15, 0.0, 0.0, 0.0);
    kt_tree_compile(tree, NULL);
}

/* The inertia about z is `J_z cos^2` of the second angle, so that a_z grows as `1 / cos^2`. */
KT_TEST(singular_positions_are_rejected_and_those_beside_them_are_not) {
    kt_tree tree;
    kt_error error;
    double a[3] = {1.0, 2.0, 3.0};
    const double before[3] = {1.0, 2.0, 3.0}, tau[3] = {1.0, 0.0, 0.0}, quarter = acos(0.0);
    grow_gimbals(&tree);
    const double at[3] = {0.4, quarter, 0.9}, near[3] = {0.4, quarter - 1e-4, 0.0};
    kt_check_equal_int("status", kt_dynamics_forward(tree.model, tree.data, at, NULL, tau, NULL, a, &error),
                       KT_ERROR_SINGULAR);
    kt_check_text("where", error.where, "joint 'outer'");
    kt_check_contains("message", error.message,
                      "no positive inertia along one of its degrees of freedom at this position");
    kt_check_equal_bits("accelerations", a, before, 3);
    kt_check_equal_int("next to it", kt_dynamics_forward(tree.model, tree.data, near, NULL, tau, NULL, a, &error),
                       KT_OK);
    const double c = sin(1e-4); /* the ring and the wheel turn together: 0.15 cos^2 about z */
    kt_check_near("acceleration next to it", a[0] * c * c * 0.15, 1.0, 1e-7);
}

/* The inertia that remains is rounding of either sign, for all angles of the other rings and every mounting. */
KT_TEST(gimbal_lock_is_rejected_at_every_angle) {
    kt_random random = kt_random_of_test();
    KT_WORST rejections = kt_worst_make("status");
    for (int n = 0; n < 300; n++) {
        kt_tree tree;
        kt_error error;
        double a[3];
        grow_gimbals(&tree);
        if (n % 3 == 0)
            tree.body[0].joint.rotation = kt_tree_rotation(&random);
        tree.body[2].inertia = kt_tree_inertia(&random, kt_random_uniform(&random, 0.1, 100.0), 1.0);
        kt_tree_compile(&tree, NULL);
        const double q[3] = {kt_random_uniform(&random, -3.0, 3.0), acos(0.0), kt_random_uniform(&random, -3.0, 3.0)};
        const kt_status status = kt_dynamics_forward(tree.model, tree.data, q, NULL, NULL, NULL, a, &error);
        kt_worst_near(&rejections, status, KT_ERROR_SINGULAR, 0.0, "%d: at %g and %g", n, q[0], q[2]);
    }
}

/* ---- the smallest mechanisms ------------------------------------------------------------------------------------- */

KT_TEST(a_mechanism_without_freedoms_has_dynamics_of_no_numbers) {
    for (int bodies = 0; bodies < 3; bodies++) {
        kt_tree tree = {.description = kt_description_default()};
        kt_error error;
        kt_vec3 center;
        double nothing = 0.5;
        kt_wrench w[3];
        for (int i = 0; i < bodies; i++) {
            tree.body[i] = kt_body_default();
            tree.body[i].name = i ? "b" : "a";
            tree.body[i].parent = i ? "a" : NULL;
            tree.body[i].mass = 3.0;
            tree.body[i].joint.at = kt_vec3_make(1.0, 0.0, 0.0);
        }
        tree.description.gravity = kt_vec3_make(0.0, -2.0, 0.0);
        tree.description.bodies = tree.body;
        tree.description.body_count = bodies;
        kt_tree_compile(&tree, NULL);
        const kt_model *m = tree.model;
        kt_data *d = tree.data;
        kt_check_equal_int("velocities", tree.nv, 0);
        kt_check_equal_int("forward", kt_dynamics_forward(m, d, &nothing, NULL, NULL, NULL, &nothing, &error), KT_OK);
        kt_check_equal_int("inverse", kt_dynamics_inverse(m, d, &nothing, NULL, NULL, NULL, &nothing, &error), KT_OK);
        kt_check_equal_int("mass", kt_dynamics_mass(m, d, &nothing, &nothing, &error), KT_OK);
        kt_check_equal_int("kinematics", kt_kinematics_update(m, d, &nothing, NULL, NULL, &error), KT_OK);
        kt_check_equal_bits("outputs", &nothing, (double[]){0.5}, 1);
        kt_check_equal_bits("moving mass", (double[]){kt_mass_center(m, d, &center)}, (double[]){0.0}, 1);
        kt_joint_reactions(m, d, NULL, w);
        for (int i = 1; i <= bodies; i++) { /* weights: each carries its own and those above */
            kt_check_near("place", kt_body_pose(m, d, i).position.x, i, 0.0);
            kt_check_near("weight", w[i].force.y, 6.0 * (bodies + 1 - i), 0.0);
            kt_check_near("moment", w[i].moment.z, i == 1 && bodies == 2 ? 6.0 : 0.0, 0.0);
        }
    }
}

KT_TEST(accelerations_may_be_written_over_forces) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    const kt_tree_plan plan = kt_tree_plan_default();
    double a[KT_TREE_NV], x[KT_TREE_NV];
    kt_tree_sample(&tree, &plan, &random, &s);
    const size_t nv = (size_t)tree.nv;
    kt_tree_forward(&tree, &s, a);
    memcpy(x, s.tau, sizeof x);
    kt_tree_forward(&tree, &s, s.tau);
    kt_check_equal_bits("accelerations", s.tau, a, nv);
    memcpy(s.tau, x, sizeof x);
    kt_tree_inverse(&tree, &s, x);
    kt_tree_inverse(&tree, &s, s.a);
    kt_check_equal_bits("forces", s.a, x, nv);
}
