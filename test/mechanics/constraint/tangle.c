/* SPDX-License-Identifier: Apache-2.0 */
#include "tangle.h"

#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

tangle_plan tangle_plan_default(void) {
    tangle_plan plan = {.tree = kt_tree_plan_default(), .loops = 4, .types = TANGLE_ALL_TYPES, .nearby = 0.5};
    plan.tree.bodies = 14;
    plan.tree.from_world = 0.25;
    plan.options = kt_model_options_default();
    return plan;
}

tangle_plan tangle_plan_planar(void) {
    tangle_plan plan = tangle_plan_default();
    const int bodies = plan.tree.bodies;
    plan.tree = kt_tree_plan_planar();
    plan.tree.bodies = bodies;
    plan.tree.from_world = 0.25;
    plan.tree.one_plane = true;
    plan.types = TANGLE_PLANAR_TYPES;
    return plan;
}

/* ---- loops that are closed where the tree stands ----------------------------------------------------------------- */

static kt_pose pose_of(const kt_tree *tree, int body) {
    return body ? kt_body_pose(tree->model, tree->data, body) : kt_pose_identity();
}

/* An end on a body, its frame in the world given. */
static kt_end end_on(const kt_tree *tree, int body, kt_pose world) {
    const kt_pose b = pose_of(tree, body);
    kt_end end = kt_end_default();
    end.body = body ? tree->description.bodies[kt_body_source(tree->model, body)].name : NULL;
    end.at = kt_mat3_apply_transposed(b.rotation, kt_vec3_sub(world.position, b.position));
    end.rotation = kt_rotation_matrix(kt_mat3_multiply(kt_mat3_transpose(b.rotation), world.rotation));
    return end;
}

static kt_pose draw_pose(kt_random *random, kt_vec3 around) {
    double p[4];
    kt_pose pose;
    kt_random_direction(random, 4, p);
    pose.rotation = kt_mat3_from_quat(kt_quat_make(p[0], p[1], p[2], p[3]));
    pose.position = kt_vec3_add(around, kt_tree_vector(random, -1.0, 1.0));
    return pose;
}

static int equations_of(kt_loop_type type) {
    static const int count[KT_LOOP_TYPE_COUNT] = {
        [KT_LOOP_SPHERICAL] = 3, [KT_LOOP_INLINE] = 2,     [KT_LOOP_INPLANE] = 1,     [KT_LOOP_DISTANCE] = 1,
        [KT_LOOP_PARALLEL] = 3,  [KT_LOOP_COAXIAL] = 2,    [KT_LOOP_ORTHOGONAL] = 1,  [KT_LOOP_REVOLUTE] = 5,
        [KT_LOOP_PRISMATIC] = 5, [KT_LOOP_SCREW] = 5,      [KT_LOOP_CYLINDRICAL] = 4, [KT_LOOP_PLANAR] = 3,
        [KT_LOOP_WELD] = 6,      [KT_LOOP_UNIVERSAL] = 4,  [KT_LOOP_COUPLING] = 1,    [KT_LOOP_MOTION] = 1,
        [KT_LOOP_ROLLING] = 3,   [KT_LOOP_KNIFE_EDGE] = 1, [KT_LOOP_RATES] = 1,       [KT_LOOP_HOMOKINETIC] = 4,
        [KT_LOOP_SURFACE] = 1,   [KT_LOOP_CURVE] = 3};
    return count[type];
}

/* Freedoms between two bodies: those of the joints on the way from one to the other. */
static int freedoms_between(const kt_model *model, int a, int b) {
    int count = 0;
    while (a != b) { /* parents come before their children */
        int *deeper = a > b ? &a : &b;
        count += kt_body_coordinates(model, *deeper).nv;
        *deeper = kt_body_parent(model, *deeper);
    }
    return count;
}

/* Two bodies with freedoms enough between them. */
static bool draw_bodies(const tangle *g, const tangle_plan *plan, kt_random *random, int equations, int body[2]) {
    const int count = kt_model_body_count(g->tree.model);
    const bool nearby = kt_random_uniform(random, 0.0, 1.0) < plan->nearby;
    for (int tries = 0; tries < 300; tries++) {
        body[0] = kt_random_int(random, 0, count - 1);
        body[1] = kt_random_int(random, 0, count - 1);
        const int dofs = freedoms_between(g->tree.model, body[0], body[1]);
        if (dofs > equations && (!nearby || dofs < equations + 6))
            return true;
    }
    return false;
}

/* A function of time with this value at t = 0. */
static kt_function draw_function(kt_random *random, double value) {
    const double phase = kt_random_uniform(random, -1.0, 1.0), amplitude = kt_random_uniform(random, 0.05, 0.2);
    return kt_function_sine(amplitude, kt_random_uniform(random, 0.1, 0.5), phase, value - amplitude * sin(phase));
}

static bool is_scalar(kt_joint_type type) {
    return type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC || type == KT_JOINT_SCREW;
}

/* Up to three different scalar joints, from anywhere; returns their number. */
static int draw_joints(const tangle *g, kt_random *random, int joint[3]) {
    const int count = kt_model_body_count(g->tree.model), wanted = kt_random_int(random, 2, 3);
    int found = 0;
    for (int tries = 0; tries < 100 && found < wanted; tries++) {
        const int body = kt_random_int(random, 1, count - 1);
        bool fresh = is_scalar(kt_body_coordinates(g->tree.model, body).type);
        for (int i = 0; i < found; i++)
            fresh &= joint[i] != body;
        if (fresh)
            joint[found++] = body;
    }
    return found;
}

/* A formula of three joints. It has mixed derivatives and a third derivative by one joint, and it vanishes in the
 * present state. */
static void add_formula(tangle *g, kt_loop *loop, const double q[3]) {
    char *text = g->formula[loop - g->loop];
    const kt_term *term = loop->terms;
    (void)snprintf(text, sizeof g->formula[0], "0.4*sin(position.%s)*position.%s^2 + 0.3*(position.%s - %.17g)^3",
                   term[0].joint, term[1].joint, term[2].joint, q[2] - 0.5);
    loop->formula = text;
    loop->offset += 0.4 * sin(q[0]) * q[1] * q[1] + 0.3 * 0.125;
}

static bool draw_relation(tangle *g, kt_random *random, kt_loop *loop, kt_term *term, const tangle_plan *plan) {
    const bool still = plan->still;
    double at[3];
    int joint[3];
    const int found = draw_joints(g, random, joint);
    if (found < 2 || (still && loop->type == KT_LOOP_MOTION))
        return false;
    double q0[KT_TREE_NQ], v0[KT_TREE_NV];
    kt_model_initial(g->tree.model, q0, v0);
    const char *name = kt_body_name(g->tree.model, joint[0]);
    const double position = q0[kt_body_coordinates(g->tree.model, joint[0]).q];
    if (loop->type == KT_LOOP_MOTION) {
        loop->joint = g->tree.description.bodies[kt_body_source(g->tree.model, joint[0])].name;
        loop->function = draw_function(random, position);
        return name != NULL;
    }
    if (loop->type == KT_LOOP_RATES && !still)
        loop->function = draw_function(random, 0.3);
    for (int i = 0; i < found; i++) {
        term[i].joint = g->tree.description.bodies[kt_body_source(g->tree.model, joint[i])].name;
        term[i].coefficient = kt_random_uniform(random, 0.5, 2.0) * (i % 2 ? -1.0 : 1.0);
        at[i] = q0[kt_body_coordinates(g->tree.model, joint[i]).q];
        loop->offset += term[i].coefficient * at[i];
    }
    loop->terms = term;
    loop->term_count = found;
    if (loop->type == KT_LOOP_COUPLING && found == 3 && !plan->linear)
        add_formula(g, loop, at);
    return true;
}

/* A wheel of axle `axis` that touches a plane. */
static void draw_rolling(const tangle *g, kt_random *random, kt_loop *loop, const int body[2], kt_pose plane) {
    const kt_vec3 n = plane.rotation.z;
    kt_pose wheel = draw_pose(random, plane.position);
    kt_vec3 axle;
    do
        axle = kt_tree_direction(random);
    while (kt_vec3_norm(kt_vec3_cross(axle, n)) < 0.5);
    loop->radius = kt_random_uniform(random, 0.2, 0.6);
    loop->holonomic = kt_random_int(random, 0, 1);
    loop->axis = kt_mat3_apply_transposed(wheel.rotation, axle);
    loop->axis2 = kt_vec3_make(0.0, 0.0, 1.0);
    const kt_vec3 off = kt_vec3_sub(wheel.position, plane.position);
    const double height = loop->radius * kt_vec3_norm(kt_vec3_cross(axle, n)) - kt_vec3_dot(off, n);
    wheel.position = kt_vec3_add(wheel.position, kt_vec3_scale(height, n));
    loop->between[0] = end_on(&g->tree, body[0], wheel);
    loop->between[1] = end_on(&g->tree, body[1], plane);
}

/* A surface, and a point on it. */
static kt_vec3 draw_surface(kt_random *random, kt_loop *loop) {
    kt_surface *s = &loop->surface;
    const double a = kt_random_uniform(random, -3.0, 3.0), b = kt_random_uniform(random, -1.2, 1.2);
    *s = (kt_surface){.type = (kt_surface_type)kt_random_int(random, KT_SURFACE_PLANE, KT_SURFACE_TORUS),
                      .radius = kt_random_uniform(random, 0.5, 1.2),
                      .tube = kt_random_uniform(random, 0.2, 0.4)};
    const bool is_torus = s->type == KT_SURFACE_TORUS;
    const double rho = is_torus                       ? s->radius + s->tube * cos(b)
                       : s->type == KT_SURFACE_SPHERE ? s->radius * cos(b)
                                                      : s->radius;
    if (s->type == KT_SURFACE_PLANE)
        return kt_vec3_make(a, b, 0.0);
    const double z = is_torus ? s->tube * sin(b) : s->type == KT_SURFACE_SPHERE ? s->radius * sin(b) : b;
    return kt_vec3_make(rho * cos(a), rho * sin(a), z);
}

/* A curve, and a point on it; its arc length may be given. Points of splines are static. */
static kt_vec3 draw_curve(kt_random *random, kt_loop *loop, bool still) {
    static const kt_vec3 bow[] = {{-0.5, 0.1, 0.0}, {0.2, 0.6, 0.1}, {0.9, 0.4, -0.3}, {1.3, -0.3, -0.1}};
    kt_track *c = &loop->curve;
    const double a = kt_random_uniform(random, -2.5, 2.5);
    *c = (kt_track){.type = (kt_track_type)kt_random_int(random, KT_TRACK_LINE, KT_TRACK_SPLINE),
                    .radius = kt_random_uniform(random, 0.5, 1.2),
                    .pitch = kt_random_uniform(random, 0.2, 0.4),
                    .points = bow,
                    .point_count = 4};
    const double h = c->type == KT_TRACK_HELIX ? c->pitch : 0.0;
    const double length = c->type == KT_TRACK_LINE ? a : c->type == KT_TRACK_SPLINE ? 0.0 : a * hypot(c->radius, h);
    if (!still && kt_random_int(random, 0, 1))
        loop->function = draw_function(random, length);
    if (c->type == KT_TRACK_LINE)
        return kt_vec3_make(0.0, 0.0, a);
    if (c->type == KT_TRACK_SPLINE)
        return bow[0];
    return kt_vec3_make(c->radius * cos(a), c->radius * sin(a), h * a);
}

/* An axis that a loop in the plane can have, in its frame: along the normal, in the plane, or any. */
static kt_vec3 draw_flat_axis(const tangle *g, kt_random *random, kt_loop_type type, kt_pose frame) {
    const kt_vec3 n = g->tree.normal, any = kt_tree_direction(random);
    const bool free = type == KT_LOOP_SPHERICAL || type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE ||
                      type == KT_LOOP_DISTANCE || type == KT_LOOP_PARALLEL || type == KT_LOOP_PRISMATIC ||
                      type == KT_LOOP_WELD || type == KT_LOOP_KNIFE_EDGE || type == KT_LOOP_SURFACE;
    const int lie = kt_random_int(random, 0, free ? 2 : 1);
    const kt_vec3 axis = lie == 0   ? kt_vec3_scale(kt_random_int(random, 0, 1) ? 1.0 : -1.0, n)
                         : lie == 1 ? kt_vec3_normalize(kt_vec3_cross(n, any))
                                    : any;
    return kt_mat3_apply_transposed(frame.rotation, axis);
}

static bool draw_loop(tangle *g, const tangle_plan *plan, kt_random *random, int i) {
    kt_loop *loop = &g->loop[i];
    int body[2];
    *loop = kt_loop_default();
    snprintf(g->name[i], sizeof g->name[i], "loop%d", i);
    loop->name = g->name[i];
    do
        loop->type = (kt_loop_type)kt_random_int(random, 0, KT_LOOP_GEAR - 1);
    while (!(plan->types & 1U << loop->type));
    if (loop->type == KT_LOOP_COUPLING || loop->type == KT_LOOP_MOTION || loop->type == KT_LOOP_RATES)
        return draw_relation(g, random, loop, g->term[i], plan);
    const int equations = equations_of(loop->type), planar = equations < 3 ? equations : 3;
    if (!draw_bodies(g, plan, random, plan->tree.one_plane ? planar : equations, body))
        return false;
    kt_pose frame = draw_pose(random, pose_of(&g->tree, body[0]).position);
    if (loop->type == KT_LOOP_ROLLING) {
        draw_rolling(g, random, loop, body, frame);
        return true;
    }
    const kt_vec3 axis =
        plan->tree.one_plane ? draw_flat_axis(g, random, loop->type, frame) : kt_tree_direction(random);
    const kt_vec3 normal = kt_mat3_apply_transposed(frame.rotation, g->tree.normal),
                  across = kt_vec3_cross(normal, axis);
    const bool lies = plan->tree.one_plane && kt_vec3_norm(across) > 0.5;
    loop->axis = kt_vec3_scale(kt_random_uniform(random, 0.5, 2.0), axis);
    loop->axis2 = lies ? across : kt_vec3_cross(axis, kt_tree_direction(random));
    loop->pitch = kt_random_uniform(random, 0.1, 0.3) * (kt_random_int(random, 0, 1) ? 1.0 : -1.0);
    loop->between[0] = end_on(&g->tree, body[0], frame);
    if (loop->type == KT_LOOP_DISTANCE) {
        const kt_vec3 apart = kt_tree_vector(random, -1.0, 1.0);
        frame.position = kt_vec3_add(frame.position, apart);
        if (!plan->still && kt_random_int(random, 0, 1))
            loop->function = draw_function(random, kt_vec3_norm(apart));
    }
    if (loop->type == KT_LOOP_SURFACE || loop->type == KT_LOOP_CURVE) {
        const kt_vec3 at =
            loop->type == KT_LOOP_SURFACE ? draw_surface(random, loop) : draw_curve(random, loop, plan->still);
        const kt_mat3 shape = kt_mat3_multiply(frame.rotation, kt_triad_from_axis(kt_vec3_normalize(axis), 2));
        frame.position = kt_vec3_add(frame.position, kt_mat3_apply(shape, at));
    }
    const bool slides =
        loop->type == KT_LOOP_INLINE || loop->type == KT_LOOP_PRISMATIC || loop->type == KT_LOOP_CYLINDRICAL;
    if (plan->tree.one_plane && slides) { /* the ends at different heights, where the axis is oblique */
        const kt_vec3 along = kt_mat3_apply(frame.rotation, axis);
        frame.position = kt_vec3_add(frame.position, kt_vec3_scale(kt_random_uniform(random, -0.5, 0.5), along));
    }
    loop->between[1] = end_on(&g->tree, body[1], frame);
    return true;
}

/* ---- the mechanism ----------------------------------------------------------------------------------------------- */

static void draw_state(tangle *g, kt_random *random) {
    const kt_model *model = g->tree.model;
    double step[KT_TREE_NV];
    kt_model_initial(model, g->q, g->v);
    for (int i = 0; i < g->tree.nv; i++) {
        step[i] = kt_random_uniform(random, -0.2, 0.2);
        g->v[i] = kt_random_uniform(random, -1.0, 1.0);
        g->tau[i] = kt_random_uniform(random, -1.0, 1.0);
    }
    kt_position_add(model, g->q, step, g->q);
    for (int b = 0; b < g->tree.count; b++) {
        g->external[b].moment = kt_tree_vector(random, -1.0, 1.0);
        g->external[b].force = kt_tree_vector(random, -1.0, 1.0);
    }
    g->t = kt_random_uniform(random, 0.1, 0.4);
}

static bool try_to_grow(tangle *g, const tangle_plan *plan, kt_random *random) {
    kt_error error = {0};
    memset(g, 0, sizeof *g);
    kt_tree_describe(&g->tree, &plan->tree, random);
    kt_tree_compile(&g->tree, NULL);
    double q[KT_TREE_NQ], v[KT_TREE_NV];
    kt_model_initial(g->tree.model, q, v);
    if (kt_kinematics_update(g->tree.model, g->tree.data, q, NULL, NULL, &error) != KT_OK)
        return false;
    for (g->loops = 0; g->loops < plan->loops; g->loops++)
        if (!draw_loop(g, plan, random, g->loops))
            return false;
    kt_tree_free(&g->tree);
    g->tree.description.loops = g->loop;
    g->tree.description.loop_count = g->loops;
    const bool fine = kt_model_compile(&g->tree.description, &plan->options, &g->tree.model, &error) == KT_OK &&
                      kt_data_create(g->tree.model, &g->tree.data, &error) == KT_OK;
    kt_tree_own(&g->tree);
    if (!fine)
        return false;
    g->tree.count = kt_model_body_count(g->tree.model);
    const kt_mobility dof = kt_model_mobility(g->tree.model);
    g->rows = dof.equations;
    if (dof.minimal < 1)
        return false;
    draw_state(g, random);
    return kt_state_assemble(g->tree.model, g->tree.data, g->t, g->q, g->v, &error) == KT_OK;
}

void tangle_grow(tangle *g, const tangle_plan *plan, kt_random *random) {
    for (int tries = 0; tries < 40; tries++)
        if (try_to_grow(g, plan, random))
            return;
    kt_check_true("a closed mechanism can be had", false);
    kt_end_test();
}

/* ---- a rod at its dead centre ------------------------------------------------------------------------------------ */

/* A body on a revolute joint that moves and whose link is in a group, or 0. There is none if there is a screw or a
 * constant-velocity joint. Such a loop is closed at its initial state. If another state became the initial one, it
 * would be open. */
static int revolute_in_a_loop(const tangle *g) {
    const kt_model *model = g->tree.model;
    for (int i = 0; i < g->loops; i++)
        if (g->loop[i].type == KT_LOOP_SCREW || g->loop[i].type == KT_LOOP_HOMOKINETIC)
            return 0;
    for (int b = 1; b < g->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(model, b);
        if (c.type == KT_JOINT_REVOLUTE && model->link[model->body[b].link].group >= 0 && fabs(g->v[c.v]) > 0.2)
            return b;
    }
    return 0;
}

/* Makes the state the initial one. */
static void keep_state(tangle *g) {
    for (int b = 1; b < g->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(g->tree.model, b);
        kt_joint *joint = &g->tree.body[kt_body_source(g->tree.model, b)].joint;
        memcpy(joint->position, g->q + c.q, (size_t)c.nq * sizeof(double));
        memcpy(joint->velocity, g->v + c.v, (size_t)c.nv * sizeof(double));
        joint->given = c.nv ? KT_GIVEN_POSITION | KT_GIVEN_VELOCITY : 0;
    }
}

static void add_rod(tangle *g, const kt_end ends[2], double length) {
    kt_loop *rod = &g->loop[g->loops];
    (void)snprintf(g->name[g->loops], sizeof g->name[g->loops], "loop%d", g->loops);
    *rod = kt_loop_of(g->name[g->loops++], KT_LOOP_DISTANCE);
    rod->between[0] = ends[0];
    rod->between[1] = ends[1];
    rod->function = kt_function_constant(length);
}

bool tangle_add_dead_centre(tangle *g, double off, bool braced, const kt_model_options *options, kt_random *random) {
    const int first = revolute_in_a_loop(g), count = g->tree.description.body_count;
    const double apart = 2.0;
    kt_error error = {0};
    if (!first || count == KT_TREE_BODIES ||
        kt_kinematics_update(g->tree.model, g->tree.data, g->q, NULL, NULL, &error) != KT_OK)
        return false;
    const kt_body *like = &g->tree.body[kt_body_source(g->tree.model, first)];
    const kt_pose own = pose_of(&g->tree, first), up = pose_of(&g->tree, kt_body_parent(g->tree.model, first));
    const kt_vec3 axis = kt_vec3_normalize(kt_mat3_apply(own.rotation, like->joint.axis));
    const kt_vec3 across = kt_vec3_normalize(kt_vec3_cross(axis, kt_tree_direction(random)));
    const kt_vec3 side = kt_vec3_cross(axis, across), there = kt_vec3_add(own.position, kt_vec3_scale(apart, across));
    kt_body *body = &g->tree.body[count];
    (void)snprintf(g->tree.name[count], sizeof g->tree.name[count], "b%d", count);
    *body = kt_body_of(g->tree.name[count], like->parent, KT_JOINT_REVOLUTE, kt_random_uniform(random, 0.5, 2.0));
    body->joint.axis = kt_mat3_apply_transposed(up.rotation, axis);
    body->joint.at = kt_mat3_apply_transposed(up.rotation, kt_vec3_sub(there, up.position));
    body->joint.velocity[0] = g->v[kt_body_coordinates(g->tree.model, first).v];
    body->joint.given = KT_GIVEN_POSITION | KT_GIVEN_VELOCITY;
    body->inertia = kt_tree_inertia(random, body->mass, 0.5);
    for (int i = 0; i <= (int)braced; i++) {
        const double angle = off + i * acos(0.0);
        const kt_vec3 arm = kt_vec3_add(kt_vec3_scale(cos(angle), across), kt_vec3_scale(sin(angle), side));
        kt_end ends[2] = {kt_end_default(), kt_end_default()};
        ends[0].body = like->name;
        ends[0].at = kt_mat3_apply_transposed(own.rotation, arm);
        ends[1].body = body->name;
        ends[1].at = kt_mat3_apply_transposed(up.rotation, arm);
        add_rod(g, ends, apart);
    }
    keep_state(g);
    g->tree.description.body_count++;
    g->tree.description.loop_count = g->loops;
    kt_tree_compile(&g->tree, options);
    g->tree.count = kt_model_body_count(g->tree.model);
    g->rows = kt_model_mobility(g->tree.model).equations;
    kt_model_initial(g->tree.model, g->q, g->v);
    for (int i = 0; i < g->tree.nv; i++)
        g->tau[i] = kt_random_uniform(random, -1.0, 1.0);
    return true;
}

void tangle_disturb(const tangle *g, kt_random *random, double size, double *q, double *v) {
    double step[KT_TREE_NV];
    for (int i = 0; i < g->tree.nv; i++) {
        step[i] = kt_random_uniform(random, -size, size);
        v[i] = g->v[i] + kt_random_uniform(random, -size, size);
    }
    kt_position_add(g->tree.model, g->q, step, q);
}

bool tangle_was_near_singular(const kt_model *model, const kt_data *data) {
    bool near = data->interpolated;
    for (size_t i = 0; i < model->n.group; i++)
        near = near || data->near[i];
    return near;
}
