/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

kt_tree_plan kt_tree_plan_default(void) {
    return (kt_tree_plan){.bodies = 12, .types = KT_TREE_ALL_TYPES, .massless = true, .from_world = 0.15};
}

kt_tree_plan kt_tree_plan_planar(void) {
    return (kt_tree_plan){.bodies = 12, .types = KT_TREE_PLANAR_TYPES, .from_world = 0.15, .planar = 1};
}

/* ---- pieces -------------------------------------------------------------------------------------------------- */

kt_vec3 kt_tree_vector(kt_random *random, double lower, double upper) {
    const double x = kt_random_uniform(random, lower, upper), y = kt_random_uniform(random, lower, upper);
    return kt_vec3_make(x, y, kt_random_uniform(random, lower, upper));
}

kt_vec3 kt_tree_direction(kt_random *random) {
    double x[3];
    kt_random_direction(random, 3, x);
    return kt_vec3_make(x[0], x[1], x[2]);
}

kt_rotation kt_tree_rotation(kt_random *random) {
    double q[4];
    kt_random_direction(random, 4, q);
    const kt_mat3 r = kt_mat3_from_quat(kt_quat_make(q[0], q[1], q[2], q[3]));
    const kt_vec3 angles = kt_tree_vector(random, -3.0, 3.0);
    switch (kt_random_int(random, 0, 7)) {
    case 1:
        return kt_rotation_rpy(angles.x, angles.y, angles.z);
    case 2:
        return kt_rotation_euler(313, angles.x, angles.y, angles.z);
    case 3:
        return kt_rotation_vector(angles);
    case 4:
        return kt_rotation_cgr(angles);
    case 5:
        return kt_rotation_axis_angle(kt_vec3_make(q[0], q[1], q[2]), angles.x);
    case 6:
        return kt_rotation_matrix(r);
    case 7:
        return (kt_rotation){.type = KT_ROTATION_NONE};
    default:
        return kt_rotation_quaternion(q[0], q[1], q[2], q[3]);
    }
}

kt_sym3 kt_tree_inertia(kt_random *random, double mass, double size) {
    const kt_vec3 e = kt_tree_vector(random, 0.3 * size, size);
    const double k = mass / 12.0, xx = e.x * e.x, yy = e.y * e.y, zz = e.z * e.z;
    double q[4];
    kt_random_direction(random, 4, q);
    return kt_sym3_rotate(kt_mat3_from_quat(kt_quat_make(q[0], q[1], q[2], q[3])),
                          kt_sym3_make(k * (yy + zz), k * (zz + xx), k * (xx + yy), 0.0, 0.0, 0.0));
}

/* Half of them a coordinate axis, one way or the other. */
static kt_vec3 draw_axis(kt_random *random) {
    const double length = kt_random_int(random, 0, 1) ? 1.0 : kt_random_uniform(random, 0.5, 3.0);
    if (kt_random_int(random, 0, 1))
        return kt_vec3_scale(length, kt_tree_direction(random));
    const double s = kt_random_int(random, 0, 1) ? length : -length;
    const int k = kt_random_int(random, 0, 2);
    return kt_vec3_make(k == 0 ? s : 0.0, k == 1 ? s : 0.0, k == 2 ? s : 0.0);
}

/* At least 30 degrees away from the first one; or left out. */
static kt_vec3 draw_second_axis(kt_random *random, kt_vec3 axis) {
    const kt_vec3 n = kt_vec3_normalize(axis);
    kt_vec3 other;
    if (kt_random_int(random, 0, 3) == 0)
        return kt_vec3_make(0.0, 0.0, 0.0);
    do
        other = kt_tree_direction(random);
    while (kt_vec3_norm(kt_vec3_cross(n, other)) < 0.5);
    return kt_vec3_scale(kt_random_uniform(random, 0.5, 3.0), other);
}

static int dofs(kt_joint_type type) {
#define NV(id, name, nq, nv) nv,
    static const int nv[] = {KT_JOINT_LIST(NV)};
    return nv[type];
}

static kt_joint draw_joint(kt_random *random, kt_joint_type type) {
    kt_joint joint = kt_joint_default();
    joint.type = type;
    joint.axis = draw_axis(random);
    joint.axis2 = draw_second_axis(random, joint.axis);
    joint.pitch = kt_random_uniform(random, -0.5, 0.5);
    joint.at = kt_tree_vector(random, -1.0, 1.0);
    joint.rotation = kt_tree_rotation(random);
    for (int i = 0; i < KT_JOINT_NQ_MAX; i++)
        joint.position[i] = kt_random_uniform(random, -1.0, 1.0);
    for (int i = 0; i < KT_JOINT_NV_MAX; i++)
        joint.velocity[i] = kt_random_uniform(random, -1.0, 1.0);
    if (type == KT_JOINT_SPHERICAL || type == KT_JOINT_FREE)
        kt_random_direction(random, 4, joint.position + (type == KT_JOINT_FREE ? 3 : 0));
    return joint;
}

/* ---- the description ----------------------------------------------------------------------------------------- */

/* Types: each of the set once, in random order, then any of them. */
static void draw_types(const kt_tree_plan *plan, kt_random *random, kt_joint_type *types) {
    kt_joint_type set[KT_JOINT_TYPE_COUNT];
    int count = 0;
    for (int t = 0; t < KT_JOINT_TYPE_COUNT; t++)
        if (plan->types & 1U << t)
            set[count++] = (kt_joint_type)t;
    for (int i = count - 1; i > 0; i--) {
        const int j = kt_random_int(random, 0, i);
        const kt_joint_type t = set[i];
        set[i] = set[j];
        set[j] = t;
    }
    for (int i = 0; i < plan->bodies; i++)
        types[i] = i < count ? set[i] : set[kt_random_int(random, 0, count - 1)];
    if (plan->floats)
        types[0] = KT_JOINT_FREE;
}

/* A body of one freedom may lack mass if it carries another body with mass. The joint between them must have one or two
 * freedoms whose axes are generic. A body that turns or slides about one axis may be a point. */
static void take_mass(kt_tree *tree, const int *parent, int count, kt_random *random) {
    bool bears[KT_TREE_BODIES] = {false};
    for (int i = count - 1; i >= 0; i--) {
        kt_body *body = &tree->body[i];
        const int nv = dofs(body->joint.type);
        const int chance = kt_random_int(random, 0, 3);
        if (nv == 1 && bears[i] && chance < 2) {
            body->mass = 0.0;
            body->joint.axis = kt_tree_direction(random); /* no two slides in line */
            body->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            continue;
        }
        if (nv == 1 && chance == 2)
            body->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        if (parent[i] >= 0 && (nv == 1 || nv == 2))
            bears[parent[i]] = true;
    }
}

/* A joint between bodies whose normal is `above`, in the parent's axes, moved into the plane; returns its own. */
static kt_vec3 flatten_joint(kt_joint *joint, kt_vec3 above, kt_random *random) {
    kt_mat3 r;
    kt_error e;
    if (kt_rotation_evaluate(&joint->rotation, &r, &e) != KT_OK)
        abort();
    const kt_vec3 n = kt_vec3_normalize(kt_mat3_apply_transposed(r, above));
    const double length = kt_random_uniform(random, 0.5, 3.0), sign = kt_random_int(random, 0, 1) ? 1.0 : -1.0;
    joint->axis = kt_vec3_scale(sign * length, n);
    if (joint->type == KT_JOINT_PRISMATIC) {
        const kt_vec3 across = kt_vec3_normalize(kt_vec3_cross(n, kt_tree_direction(random)));
        joint->axis = kt_vec3_scale(length, across);
    }
    return n;
}

/* Every step-th tree into a plane of its own, or all into one. Some bodies that turn become points, well off their
 * axes.
 */
static void flatten(kt_tree *tree, const int *parent, int count, const kt_tree_plan *plan, kt_random *random) {
    kt_vec3 normal[KT_TREE_BODIES];
    int number[KT_TREE_BODIES], trees = 0;
    tree->normal = plan->one_plane ? kt_tree_direction(random) : kt_vec3_make(0.0, 0.0, 0.0);
    for (int i = 0; i < count; i++) {
        kt_joint *joint = &tree->body[i].joint;
        number[i] = parent[i] < 0 ? trees++ : number[parent[i]];
        if (number[i] % plan->planar != 0)
            continue;
        const kt_vec3 above = parent[i] >= 0    ? normal[parent[i]]
                              : plan->one_plane ? tree->normal
                                                : kt_tree_direction(random);
        normal[i] = flatten_joint(joint, above, random);
        const double off = kt_vec3_norm(kt_vec3_cross(normal[i], tree->body[i].com));
        if (joint->type == KT_JOINT_REVOLUTE && off > 0.2 && kt_random_int(random, 0, 2) == 0)
            tree->body[i].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    }
}

void kt_tree_describe(kt_tree *tree, const kt_tree_plan *plan, kt_random *random) {
    kt_joint_type types[KT_TREE_BODIES];
    int parent[KT_TREE_BODIES], place[KT_TREE_BODIES];
    kt_body grown[KT_TREE_BODIES];
    memset(tree, 0, sizeof *tree);
    draw_types(plan, random, types);
    for (int i = 0; i < plan->bodies; i++) {
        kt_body *body = &tree->body[i];
        const bool on_world = i == 0 || (!plan->floats && kt_random_uniform(random, 0.0, 1.0) < plan->from_world);
        /* chains more often than bushes */
        parent[i] = on_world ? -1 : kt_random_int(random, 0, 2) ? i - 1 : kt_random_int(random, 0, i - 1);
        snprintf(tree->name[i], sizeof tree->name[i], "b%d", i);
        *body = kt_body_default();
        body->name = tree->name[i];
        body->parent = on_world ? (i % 2 ? "world" : NULL) : tree->name[parent[i]];
        body->joint = draw_joint(random, types[i]);
        body->mass = kt_random_uniform(random, 0.2, 3.0);
        body->com = kt_tree_vector(random, -0.5, 0.5);
        body->inertia = kt_tree_inertia(random, body->mass, 1.0);
        const kt_vec3 at = kt_tree_vector(random, -1.0, 1.0);
        tree->marker[i] = (kt_marker){.name = "tip", .at = at, .rotation = kt_rotation_vector(at)};
        body->markers = &tree->marker[i];
        body->marker_count = 1;
    }
    if (plan->massless)
        take_mass(tree, parent, plan->bodies, random);
    if (plan->planar)
        flatten(tree, parent, plan->bodies, plan, random);
    for (int i = 0; plan->with_armature > 0.0 && i < plan->bodies; i++)
        for (int k = 0; k < KT_JOINT_NV_MAX && kt_random_uniform(random, 0.0, 1.0) < plan->with_armature; k++)
            tree->body[i].joint.armature[k] = kt_random_uniform(random, 0.01, 2.0);
    for (int i = 0; plan->is_shuffled && i < plan->bodies; i++) { /* Fisher and Yates, inside out */
        place[i] = i;
        const int j = kt_random_int(random, 0, i);
        place[i] = place[j];
        place[j] = i;
    }
    if (plan->is_shuffled) {
        memcpy(grown, tree->body, sizeof grown);
        for (int i = 0; i < plan->bodies; i++)
            tree->body[i] = grown[place[i]];
    }
    tree->description = kt_description_of(tree->body, plan->bodies, NULL, 0, NULL, 0);
    if (!plan->weightless)
        tree->description.gravity = kt_vec3_scale(9.81, kt_tree_direction(random));
}

static void release_tree_model(void *model) { kt_model_free(model); }

static void release_tree_data(void *data) { kt_data_free(data); }

void kt_tree_own(const kt_tree *tree) {
    kt_test_own(tree->model, release_tree_model);
    kt_test_own(tree->data, release_tree_data);
}

void kt_tree_compile(kt_tree *tree, const kt_model_options *options) {
    tree->model = kt_test_model(&tree->description, options);
    tree->data = kt_test_data(tree->model);
    tree->count = kt_model_body_count(tree->model);
    tree->nq = kt_model_nq(tree->model);
    tree->nv = kt_model_nv(tree->model);
}

void kt_tree_grow(kt_tree *tree, const kt_tree_plan *plan, kt_random *random) {
    kt_tree_describe(tree, plan, random);
    kt_tree_compile(tree, NULL);
}

void kt_tree_free(kt_tree *tree) {
    kt_test_release(tree->data);
    kt_test_release(tree->model);
    tree->data = NULL;
    tree->model = NULL;
}

/* ---- states and calls ---------------------------------------------------------------------------------------- */

void kt_tree_state_draw(const kt_tree *tree, kt_random *random, kt_tree_state *state) {
    memset(state, 0, sizeof *state);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        for (int i = 0; i < c.nq; i++)
            state->q[c.q + i] = kt_random_uniform(random, -1.0, 1.0);
        if (c.type == KT_JOINT_SPHERICAL || c.type == KT_JOINT_FREE)
            kt_random_direction(random, 4, state->q + c.q + c.nq - 4);
        else if (c.type != KT_JOINT_FIXED && c.type != KT_JOINT_PRISMATIC) /* an angle comes first, or last */
            state->q[c.type == KT_JOINT_PLANAR ? c.q + 2 : c.q] *= 3.14159265358979;
        state->external[b].moment = kt_tree_vector(random, -1.0, 1.0);
        state->external[b].force = kt_tree_vector(random, -1.0, 1.0);
    }
    for (int i = 0; i < tree->nv; i++) {
        state->v[i] = kt_random_uniform(random, -1.0, 1.0);
        state->a[i] = kt_random_uniform(random, -1.0, 1.0);
        state->tau[i] = kt_random_uniform(random, -1.0, 1.0);
    }
}

void kt_tree_sample(kt_tree *tree, const kt_tree_plan *plan, kt_random *random, kt_tree_state *state) {
    kt_tree_grow(tree, plan, random);
    kt_tree_state_draw(tree, random, state);
}

void kt_tree_forward(const kt_tree *tree, const kt_tree_state *s, double *a) {
    kt_error e = {0};
    kt_need_fine("forward dynamics",
                 kt_dynamics_forward(tree->model, tree->data, s->q, s->v, s->tau, s->external, a, &e), &e);
}

void kt_tree_inverse(const kt_tree *tree, const kt_tree_state *s, double *tau) {
    kt_error e = {0};
    kt_need_fine("inverse dynamics",
                 kt_dynamics_inverse(tree->model, tree->data, s->q, s->v, s->a, s->external, tau, &e), &e);
}

void kt_tree_mass(const kt_tree *tree, const kt_tree_state *s, double *mass) {
    kt_error e = {0};
    kt_need_fine("mass matrix", kt_dynamics_mass(tree->model, tree->data, s->q, mass, &e), &e);
}

void kt_tree_kinematics(const kt_tree *tree, const kt_tree_state *s) {
    kt_error e = {0};
    kt_need_fine("kinematics", kt_kinematics_update(tree->model, tree->data, s->q, s->v, s->a, &e), &e);
}

double kt_tree_largest(const double *x, int n) {
    double largest = 0.0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(x[i]));
    return largest;
}

void kt_tree_burden(kt_effect effects[KT_TREE_BURDENS]) {
    for (int i = 0; i < KT_TREE_BURDENS; i++)
        effects[i] = kt_effect_default();
    effects[0].type = KT_EFFECT_SPRING;
    effects[0].between[0] = (kt_end){.body = "b1", .at = {0.3, -0.2, 4.0}};
    effects[0].between[1] = (kt_end){.body = "b6", .marker = "tip"};
    effects[0].stiffness = 3.0;
    effects[0].damping = 0.4;
    effects[0].length = 0.5;
    effects[1].type = KT_EFFECT_DRAG;
    effects[1].between[0] = (kt_end){.body = "b4", .marker = "tip"};
    effects[1].linear = 0.7;
    effects[2].type = KT_EFFECT_BUSHING;
    effects[2].between[0] = (kt_end){.body = "b2", .at = {0.1, 0.2, -0.3}};
    effects[2].between[1] = (kt_end){.body = "b3"};
    for (int i = 0; i < 3; i++)
        effects[2].stiffnesses[i] = effects[2].dampings[i] = 1.0 + i;
}
