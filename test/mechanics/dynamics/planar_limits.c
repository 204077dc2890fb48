/* The inputs that the planar recursions reject, alone and next to spatial ones, with the messages of the others.
 * Rejected calls leave everything untouched. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* An arm about z on the ground, a plate fixed to it, and a slider along x on the plate. If `mixed`, a ball joint of its
 * own on the ground comes first. q: (quaternion), angle, place. v: (angular velocity), rates. */
static bool grow(kt_tree *tree, bool mixed, double mass) {
    static const char *const names[] = {"ball", "arm", "plate", "slider"};
    static const kt_joint_type types[] = {KT_JOINT_SPHERICAL, KT_JOINT_REVOLUTE, KT_JOINT_FIXED, KT_JOINT_PRISMATIC};
    const int first = mixed ? 0 : 1;
    memset(tree, 0, sizeof *tree);
    tree->description = kt_description_of(tree->body, 4 - first, NULL, 0, NULL, 0);
    for (int i = first; i < 4; i++) {
        kt_body *body = &tree->body[i - first];
        *body = kt_body_of(names[i], i > 1 ? names[i - 1] : NULL, types[i], 0.0);
        if (i == 3)
            body->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        body->mass = i == 1 || i == 2 ? mass : 2.0;
        if (i == 0)
            body->inertia = kt_sym3_make(0.1, 0.2, 0.2, 0.0, 0.0, 0.0);
        body->com = kt_vec3_make(i == 2 ? 0.5 : 0.0, 0.0, 0.0);
    }
    kt_tree_compile(tree, NULL);
    return kt_check_text("plan", kt_model_plan(tree->model), mixed ? "mixed" : "planar");
}

typedef struct inputs {
    double q[6], v[5], x[5];
} inputs;

typedef enum call { FORWARD, INVERSE, MASS, KINEMATICS, CALLS } call;

static void rejected(const kt_tree *tree, call which, const inputs *in, kt_status code, const char *where,
                     const char *message) {
    const kt_model *m = tree->model;
    double out[25], before[25];
    kt_error error = {KT_OK, "", ""};
    kt_status status = KT_OK;
    for (int i = 0; i < 25; i++)
        out[i] = before[i] = i + 0.5;
    switch (which) {
    case FORWARD:
        status = kt_dynamics_forward(m, tree->data, in->q, in->v, in->x, NULL, out, &error);
        break;
    case INVERSE:
        status = kt_dynamics_inverse(m, tree->data, in->q, in->v, in->x, NULL, out, &error);
        break;
    case MASS:
        status = kt_dynamics_mass(m, tree->data, in->q, out, &error);
        break;
    default:
        status = kt_kinematics_update(m, tree->data, in->q, in->v, in->x, &error);
        break;
    }
    kt_check_equal_int("status", status, code);
    kt_check_text("where", error.where, where);
    kt_check_contains("message", error.message, message);
    kt_check_equal_bits("outputs", out, before, 25);
}

static inputs fine(bool mixed) {
    inputs in = {.q = {1.0, 0.0, 0.0, 0.0, 0.3, 0.7}, .v = {0.0, 0.0, 0.0, 1.0, 2.0}, .x = {0.0, 0.0, 0.0, 0.1, 0.2}};
    if (!mixed) {
        memmove(in.q, in.q + 4, 2 * sizeof *in.q);
        memmove(in.v, in.v + 3, 2 * sizeof *in.v);
        memmove(in.x, in.x + 3, 2 * sizeof *in.x);
    }
    return in;
}

/* The square of 1e200 is infinite; 1e200 m away so are inertia and place. */
KT_TEST(motions_in_planes_that_overflow_are_rejected) {
    for (int mixed = 0; mixed <= 1; mixed++) {
        kt_tree tree;
        const int q = mixed ? 4 : 0, v = mixed ? 3 : 0;
        if (!grow(&tree, mixed, 1.0))
            return;
        inputs in = fine(mixed);
        in.v[v] = 1e200;
        rejected(&tree, FORWARD, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "huge");
        rejected(&tree, INVERSE, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "look for a position, velocity");
        rejected(&tree, KINEMATICS, &in, KT_ERROR_NOT_FINITE, "joint 'slider'", "its motion overflows");
        in = fine(mixed);
        in.q[q + 1] = 1e200;
        rejected(&tree, MASS, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "the inertia that it carries overflows");
    }
}

/* The spatial part's fault, next to a plane where all is well. */
KT_TEST(a_spatial_motion_that_overflows_beside_a_plane_is_rejected) {
    kt_tree tree;
    if (!grow(&tree, true, 1.0))
        return;
    inputs in = fine(true);
    in.v[1] = 1e200;
    in.v[2] = 1e200;
    rejected(&tree, FORWARD, &in, KT_ERROR_NOT_FINITE, "joint 'ball'", "huge");
    rejected(&tree, INVERSE, &in, KT_ERROR_NOT_FINITE, "joint 'ball'", "huge");
    tree.body[0].joint.type = KT_JOINT_CYLINDRICAL; /* and its mass far from the axis */
    tree.body[0].com = kt_vec3_make(1.0, 0.0, 0.0);
    tree.body[0].joint.axis = kt_vec3_make(1.0, 1.0, 0.0);
    kt_tree_compile(&tree, NULL);
    inputs far = fine(true);
    far.q[1] = 1e200;
    far.v[0] = far.v[1] = 1e200;
    rejected(&tree, KINEMATICS, &far, KT_ERROR_NOT_FINITE, "joint 'ball'", "its motion overflows");
}

/* All coordinates are plain numbers here. They are checked together first, and then one by one. */
KT_TEST(numbers_in_planes_that_are_not_finite_are_rejected_by_the_name_of_their_joint) {
    kt_tree tree;
    if (!grow(&tree, false, 1.0))
        return;
    for (call c = FORWARD; c < CALLS; c++) {
        inputs in = fine(false);
        in.q[1] = (double)NAN;
        rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'slider'", "its position is");
        if (c == MASS)
            continue;
        in = fine(false);
        in.v[0] = (double)INFINITY;
        rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'arm'", "its velocity is inf");
        in = fine(false);
        in.x[1] = (double)INFINITY;
        rejected(&tree, c, &in, KT_ERROR_NOT_FINITE, "joint 'slider'",
                 c == FORWARD ? "its force is inf" : "its acceleration is inf");
    }
}

/* A massless arm turns a point mass m at the distance r: `m r^2 a = tau - 2 m r r' w`, and nothing at r = 0. */
KT_TEST(a_singular_position_in_a_plane_is_rejected_and_those_beside_it_are_not) {
    for (int mixed = 0; mixed <= 1; mixed++) {
        kt_tree tree;
        const int q = mixed ? 4 : 0, v = mixed ? 3 : 0;
        kt_error error;
        double a[5];
        if (!grow(&tree, mixed, 0.0))
            return;
        inputs in = fine(mixed);
        in.q[q + 1] = 0.0;
        rejected(&tree, FORWARD, &in, KT_ERROR_SINGULAR, "joint 'arm'",
                 "no positive inertia along one of its degrees of freedom");
        KT_WORST worst = kt_worst_make("acceleration");
        for (int k = 0; k >= -6; k--) {
            const double r = pow(10.0, k), m = 2.0, *rate = in.v + v, *tau = in.x + v;
            in.q[q + 1] = r;
            const kt_status status = kt_dynamics_forward(tree.model, tree.data, in.q, in.v, in.x, NULL, a, &error);
            const double expected = (tau[0] - 2.0 * m * r * rate[1] * rate[0]) / (m * r * r);
            const double size = (fabs(tau[0]) + 2.0 * m * r * fabs(rate[1] * rate[0])) / (m * r * r);
            kt_check_equal_int("status", status, KT_OK);
            kt_worst_near(&worst, a[v], expected, 8.0 * DBL_EPSILON * size, "r = %g", r);
        }
    }
}
