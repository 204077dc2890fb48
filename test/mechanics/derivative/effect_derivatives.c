/* The contributions of effects to derivatives (derivative/effect_derivatives.h), against differences of their joint
 * forces. Effects of every type are on trees in space and in a plane. Differences as in acceleration.c; rounding is
 * some eps / H of forces and derivatives (measured over twelve seeds: up to 0.36 of the bounds). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "derivative/effect_derivatives.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/relative_force.h"
#include "model/model.h"
#include "model/relative.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define H 0.005
enum { MECHANISMS = 40, SQUARE = KT_TREE_NV * KT_TREE_NV };

typedef struct stage {
    kt_tree tree;
    kt_tree_state state;
    kt_effect effect[4 * KT_EFFECT_TYPE_COUNT + 4];
    kt_loop loop;
    char coordinate[16], formula[100];
} stage;

/* ---- effects ----------------------------------------------------------------------------------------------------- */

static kt_effect *add(stage *s, kt_effect_type type) {
    kt_effect *effect = &s->effect[s->tree.description.effect_count++];
    *effect = kt_effect_of(type, NULL);
    return effect;
}

static kt_end end_at(stage *s, kt_random *random, int body) {
    return (kt_end){.body = body < 0 ? NULL : s->tree.name[body], .at = kt_tree_vector(random, -0.5, 0.5)};
}

/* Springs, dampers and stops that are smooth on the scale of a step. A stop is in contact. Friction is at speeds not
 * below those over which it changes. */
static void add_in_joint(stage *s, kt_random *random, const char *joint) {
    static const kt_effect_type types[] = {KT_EFFECT_JOINT_SPRING, KT_EFFECT_JOINT_DAMPER, KT_EFFECT_JOINT_FRICTION,
                                           KT_EFFECT_JOINT_LIMIT,  KT_EFFECT_MOTOR,        KT_EFFECT_SERVO};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        kt_effect *e = add(s, types[i]);
        e->joint = joint;
        e->stiffness = kt_random_uniform(random, 0.5, 2.0);
        e->damping = kt_random_uniform(random, 0.5, 2.0);
        e->coulomb = 0.7;
        e->breakaway = 1.1;
        e->stribeck = 0.9;
        e->smoothing = 0.6;
        e->viscous = 0.3;
        e->upper = -5.0;
        e->torque = kt_function_constant(1.5);
        e->target = kt_function_sine(0.7, 0.2, 0.1, 0.2);
        e->limit = kt_random_uniform(random, 1.0, 10.0);
    }
    kt_effect *formula = add(s, KT_EFFECT_EXPRESSION); /* with variables: test/model/effect/expression.c */
    formula->joint = joint;
    formula->formula[0] = "cos(t)";
}

static void add_between(stage *s, kt_random *random, int a, int b) {
    static const kt_effect_type types[] = {KT_EFFECT_SPRING, KT_EFFECT_BUSHING, KT_EFFECT_ATTRACTION,
                                           KT_EFFECT_CONTACT};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        kt_effect *e = add(s, types[i]);
        e->between[0] = end_at(s, random, a);
        e->between[1] = end_at(s, random, b);
        e->stiffness = types[i] == KT_EFFECT_CONTACT ? 0.01 : 1.3;
        e->damping = 0.4;
        e->length = 0.5;
        e->strength = 0.8;
        e->axis = kt_tree_direction(random);
        e->radius = 30.0;
        e->exponent = 1.7;
        e->dissipation = 0.01;
        e->friction = 0.4;
        e->slip = 1.5;
        e->rolling = 0.3;
        e->torsion = 0.2;
        e->turn = 1.2;
        for (int k = 0; k < 6; k++) {
            e->stiffnesses[k] = kt_random_uniform(random, 0.5, 2.0);
            e->dampings[k] = kt_random_uniform(random, 0.5, 2.0);
        }
    }
}

static void add_on(stage *s, kt_random *random, int body) {
    static const kt_effect_type types[] = {KT_EFFECT_FORCE, KT_EFFECT_TORQUE, KT_EFFECT_DRAG, KT_EFFECT_THRUST};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        kt_effect *e = add(s, types[i]);
        e->between[0] = end_at(s, random, body);
        e->linear = 0.6;
        e->quadratic = 0.3;
        for (int k = 0; k < 6; k++) {
            e->dampings[k] = kt_random_uniform(random, 0.0, 0.5);
            e->quadratics[k] = kt_random_uniform(random, 0.0, 0.3);
        }
        e->frame = kt_random_int(random, 0, 1) ? KT_FRAME_BODY : KT_FRAME_WORLD;
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_constant(kt_random_normal(random));
        e->mass = kt_function_sine(1.0, 0.3, 0.2, 3.0);
        e->exhaust = kt_tree_direction(random);
    }
}

/* A caller's own: wrenches on both ends that do not add up to nothing, and depend on all that moves. With d and u the
 * relative position and velocity, x the first end's x axis and w_0, w_1 the angular velocities
 *     f_0 = (0.5 + 0.1 d.d) d + 0.3 u + 0.2 x,   m_0 = 0.4 x cross d
 *     f_1 = -0.6 d - 0.7 v_1 + sin t e_z,        m_1 = -0.8 w_1 + 0.9 w_0 cross w_1 */
static int pull_own(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point);
    const kt_vec3 u = kt_vec3_sub(ends[1].velocity, ends[0].velocity), x = ends[0].axes.x;
    (void)user, (void)balance;
    wrenches[0].force = kt_vec3_add(kt_vec3_scale(0.5 + 0.1 * kt_vec3_dot(d, d), d),
                                    kt_vec3_add(kt_vec3_scale(0.3, u), kt_vec3_scale(0.2, x)));
    wrenches[0].moment = kt_vec3_scale(0.4, kt_vec3_cross(x, d));
    wrenches[1].force = kt_vec3_add(kt_vec3_scale(-0.6, d), kt_vec3_scale(-0.7, ends[1].velocity));
    wrenches[1].force.z += sin(t);
    wrenches[1].moment = kt_vec3_add(kt_vec3_scale(-0.8, ends[1].omega),
                                     kt_vec3_scale(0.9, kt_vec3_cross(ends[0].omega, ends[1].omega)));
    return 0;
}

static kt_mat3 diagonal(double s) { return kt_mat3_scale(s, kt_mat3_identity()); }

static int differentiate_pull(void *user, double t, const kt_effect_end *ends, kt_effect_derivatives *derivatives) {
    const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point), x = ends[0].axes.x;
    const kt_mat3 turned = kt_mat3_skew(x);
    kt_wrench_derivatives(*w)[2] = derivatives->wrench;
    (void)user;
    const kt_mat3 stiff =
        kt_mat3_add(diagonal(0.5 + 0.1 * kt_vec3_dot(d, d)), kt_mat3_scale(0.2, kt_outer_product(d, d)));
    w[0][1].by_pose[1][1] = stiff;
    w[0][0].by_pose[1][1] = kt_mat3_scale(-1.0, stiff);
    w[0][1].by_twist[1][1] = diagonal(0.3);
    w[0][0].by_twist[1][1] = diagonal(-0.3);
    w[0][0].by_pose[1][0] = kt_mat3_scale(-0.2, turned); /* dx = r cross x */
    w[0][0].by_pose[0][0] = kt_mat3_scale(0.4, kt_mat3_multiply(kt_mat3_skew(d), turned));
    w[0][1].by_pose[0][1] = kt_mat3_scale(0.4, turned);
    w[0][0].by_pose[0][1] = kt_mat3_scale(-0.4, turned);
    w[1][0].by_pose[1][1] = diagonal(0.6);
    w[1][1].by_pose[1][1] = diagonal(-0.6);
    w[1][1].by_twist[1][1] = diagonal(-0.7);
    w[1][1].by_twist[0][0] = kt_mat3_add(diagonal(-0.8), kt_mat3_scale(0.9, kt_mat3_skew(ends[0].omega)));
    w[1][0].by_twist[0][0] = kt_mat3_scale(-0.9, kt_mat3_skew(ends[1].omega));
    derivatives->by_time[1].force.z = cos(t);
    return 0;
}

static int drive_own(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)balance;
    *force = sin(q) * v + 0.3 * v * v + sin(t);
    return 0;
}

static int differentiate_drive(void *user, double t, double q, double v, double derivatives[3]) {
    (void)user;
    derivatives[0] = cos(q) * v;
    derivatives[1] = sin(q) + 0.6 * v;
    derivatives[2] = cos(t);
    return 0;
}

static void add_own(stage *s, kt_random *random, int a, int b, const char *joint) {
    kt_effect *e = add(s, KT_EFFECT_CUSTOM);
    e->between[0] = end_at(s, random, a);
    e->between[1] = end_at(s, random, b);
    e->end_count = 2;
    e->wrench = pull_own;
    e->wrench_derivatives = differentiate_pull;
    if (!joint)
        return;
    e = add(s, KT_EFFECT_CUSTOM);
    e->joint = joint;
    e->joint_force = drive_own;
    e->joint_force_derivatives = differentiate_drive;
}

/* A loop of any type that leaves a coordinate free, and effects in one of its coordinates. It is not closed: their
 * derivatives are those of their forces in every position. */
static void add_in_loop(stage *s, kt_random *random, bool planar) {
    kt_loop *loop = &s->loop;
    int body = s->tree.description.body_count - 1; /* that moves against the world and its parent */
    while (s->tree.body[body].joint.type == KT_JOINT_FIXED)
        body--;
    *loop = kt_loop_default();
    do
        loop->type = (kt_loop_type)kt_random_int(random, 0, KT_LOOP_GEAR - 1);
    while (kt_relative_count(loop->type) == 0 || (planar && loop->type != KT_LOOP_REVOLUTE));
    loop->name = "pin";
    loop->between[0] = end_at(s, random, -1);
    if (kt_random_int(random, 0, 1))
        loop->between[0].body = s->tree.body[body].parent;
    loop->between[1] = end_at(s, random, body);
    loop->axis = planar ? kt_vec3_make(0.0, 0.0, 1.0) : kt_tree_direction(random);
    loop->axis2 = kt_tree_direction(random);
    loop->pitch = 0.3;
    s->tree.description.loops = loop;
    s->tree.description.loop_count = 1;
    const int count = kt_relative_count(loop->type), k = kt_random_int(random, 0, count - 1);
    snprintf(s->coordinate, sizeof s->coordinate, count > 1 ? "pin[%d]" : "pin", k);
    snprintf(s->formula, sizeof s->formula, "cos(t)*position.%s^2 - 0.3*velocity.%s*position.%s", s->coordinate,
             s->coordinate, s->coordinate);
    const int before = s->tree.description.effect_count;
    add_in_joint(s, random, s->coordinate);
    for (int i = before; i < s->tree.description.effect_count; i++)
        s->effect[i].limit = 1e3; /* of servos: a kink */
    s->effect[s->tree.description.effect_count - 1].formula[0] = s->formula;
    kt_effect *own = add(s, KT_EFFECT_CUSTOM);
    own->joint = s->coordinate;
    own->joint_force = drive_own;
    own->joint_force_derivatives = differentiate_drive;
}

/* Every type, between bodies of one branch or of two, or of one and the world. */
static void grow(stage *s, const kt_tree_plan *plan, kt_random *random) {
    kt_tree_describe(&s->tree, plan, random);
    const char *joint = NULL;
    const int bodies = (int)s->tree.description.body_count;
    for (int i = 0; i < bodies; i++)
        if (s->tree.body[i].joint.type == KT_JOINT_REVOLUTE || s->tree.body[i].joint.type == KT_JOINT_PRISMATIC ||
            s->tree.body[i].joint.type == KT_JOINT_SCREW)
            joint = s->tree.name[i];
    s->tree.description.effects = s->effect;
    s->tree.description.effect_count = 0;
    if (joint)
        add_in_joint(s, random, joint);
    add_between(s, random, kt_random_int(random, 0, bodies - 2), bodies - 1);
    add_on(s, random, kt_random_int(random, 0, bodies - 1));
    add_between(s, random, bodies - 2, -1);
    add_own(s, random, kt_random_int(random, -1, bodies - 2), bodies - 1, joint);
    add_in_loop(s, random, plan->planar);
    kt_tree_compile(&s->tree, NULL);
}

/* Whether no angle of a loop is next to half a turn from where it is counted, and none nearly undefined. */
static bool is_smooth_in_loop(const stage *s) {
    const kt_tree *tree = &s->tree;
    const kt_model *m = tree->model;
    for (size_t i = 0; i < m->n.effect; i++) {
        const kt_effect_record *r = &m->effect[i];
        kt_effect_load load;
        kt_effect_end end[2];
        if (!r->relative.type)
            continue;
        (void)kt_effect_load_find(m, tree->data, 0.3, s->state.q, s->state.v, r, end, &load);
        const kt_relative_motion motion = kt_relative_motion_of(m, r, s->state.q, end);
        const double away = fabs(motion.position - r->relative.angle - (motion.counted[0] + motion.counted[1]));
        if (fabs(motion.rate) < 0.15 || fabs(motion.rate) > 3.0 || fabs(motion.position) > 4.0)
            return false; /* stops and servos have kinks there */
        if (kt_relative_is_length((kt_relative)r->relative.type))
            continue;
        if (kt_vec3_norm(motion.moment) > 1.3 || (r->relative.per_length == 0.0 && away > 2.9))
            return false;
    }
    return true;
}

/* No bushing is next to half a turn, where its moment jumps. */
static bool is_smooth(const stage *s) {
    const kt_tree *tree = &s->tree;
    bool smooth = true;
    kt_tree_kinematics(tree, &s->state);
    for (int i = 0; i < tree->description.effect_count; i++) {
        const kt_effect *e = &s->effect[i];
        kt_mat3 r[2] = {kt_mat3_identity(), kt_mat3_identity()};
        for (int k = 0; k < 2 && e->type == KT_EFFECT_BUSHING; k++)
            if (e->between[k].body)
                r[k] = kt_body_pose(tree->model, tree->data, kt_body_find(tree->model, e->between[k].body)).rotation;
        smooth &= kt_vec3_dot(r[0].x, r[1].x) + kt_vec3_dot(r[0].y, r[1].y) + kt_vec3_dot(r[0].z, r[1].z) > -0.9;
    }
    return smooth && is_smooth_in_loop(s);
}

/* ---- their forces ------------------------------------------------------------------------------------------------ */

/* The forces of all effects: tau + J' w, from inverse dynamics under w and without. */
static void sum_forces(const stage *s, const double *q, const double *v, double *f) {
    const kt_tree *tree = &s->tree;
    kt_dynamic_state at = {.t = 0.3, .q = q, .v = v};
    double with[KT_TREE_NV], without[KT_TREE_NV];
    kt_error e = {0};
    kt_need_fine("effects", kt_effects_apply(tree->model, tree->data, &at, &e), &e);
    kt_need_fine("with", kt_dynamics_inverse(tree->model, tree->data, q, NULL, NULL, at.external, with, &e), &e);
    kt_need_fine("without", kt_dynamics_inverse(tree->model, tree->data, q, NULL, NULL, NULL, without, &e), &e);
    for (int i = 0; i < tree->nv; i++)
        f[i] = (at.tau ? at.tau[i] : 0.0) + (without[i] - with[i]);
}

static void difference(const stage *s, int j, bool rate, double h, double *out) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    memset(out, 0, KT_TREE_NV * sizeof *out);
    for (int k = -4; k <= 4; k++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], step[KT_TREE_NV] = {0.0}, f[KT_TREE_NV];
        if (k == 0)
            continue;
        memcpy(v, s->state.v, sizeof v);
        (rate ? v : step)[j] += k * h;
        kt_position_add(s->tree.model, s->state.q, step, q);
        sum_forces(s, q, v, f);
        for (int i = 0; i < s->tree.nv; i++)
            out[i] += (k < 0 ? -weight[-k - 1] : weight[k - 1]) / h * f[i];
    }
}

/* Uses the one of three steps whose estimated error is least. Forces of bodies that are far out or fast change within
 * less than the first step. There is a kink or a jump next to the limit of a servo. The same occurs next to an angle at
 * which the turns of an open screw are counted anew. */
static void best_difference(const stage *s, int j, bool rate, double size, double *best, double *bound) {
    *bound = HUGE_VAL;
    for (double h = H; h > 0.01 * H; h *= 0.2) {
        double whole[KT_TREE_NV], half[KT_TREE_NV], apart = 0.0;
        difference(s, j, rate, h, whole);
        difference(s, j, rate, 0.5 * h, half);
        for (int i = 0; i < s->tree.nv; i++)
            apart = fmax(apart, fabs(half[i] - whole[i]));
        const double error = apart / 16.0 + 100.0 * DBL_EPSILON / h * size;
        if (error >= *bound)
            continue;
        *bound = error;
        for (int i = 0; i < s->tree.nv; i++)
            best[i] = half[i] + (half[i] - whole[i]) / 255.0;
    }
}

static void compare(const stage *s, const double *matrix, bool rate, kt_worst *worst, int n) {
    const int nv = s->tree.nv;
    double f[KT_TREE_NV];
    sum_forces(s, s->state.q, s->state.v, f);
    const double size = fmax(kt_tree_largest(f, nv), kt_tree_largest(matrix, nv * nv));
    for (int j = 0; j < nv; j++) {
        double expected[KT_TREE_NV], bound;
        best_difference(s, j, rate, size, expected, &bound);
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, -matrix[j * nv + i], expected[i], bound, "tree %d row %d column %d", n, i, j);
    }
}

/* d_q, d_v: minus the derivatives of their joint forces. */
static bool differentiate(const stage *s, double *d_q, double *d_v) {
    static kt_effect_dof path[2 * KT_TREE_NV];
    const kt_tree *tree = &s->tree;
    kt_derivative_work terms;
    kt_error e = {0};
    const kt_dynamic_state at = {.t = 0.3, .q = s->state.q, .v = s->state.v};
    void *memory = aligned_alloc(KT_ALIGNMENT, kt_dynamics_work_size(tree->model));
    kt_need_fine("terms",
                 kt_inverse_derivatives_fill(tree->model, tree->data, memory, &at, s->state.a, true, &terms, &e), &e);
    const size_t bytes = (size_t)(tree->nv * tree->nv) * sizeof *d_q;
    memset(terms.dq, 0, bytes);
    memset(terms.dv, 0, bytes);
    const bool differentiated = kt_fine("effects",
                                        kt_effects_differentiate(tree->model, tree->data, &at, &terms, path,
                                                                 &(kt_state_derivatives){NULL, NULL, NULL, NULL}, &e),
                                        &e);
    memcpy(d_q, terms.dq, bytes);
    memcpy(d_v, terms.dv, bytes);
    free(memory);
    return differentiated;
}

static void check_all(kt_tree_plan plan) {
    kt_random random = kt_random_of_test();
    static stage s;
    static double d_q[SQUARE], d_v[SQUARE];
    KT_WORST by_q = kt_worst_make("df/dq"), by_v = kt_worst_make("df/dv");
    int types[KT_EFFECT_TYPE_COUNT] = {0}, kinds = 0, own = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        grow(&s, &plan, &random);
        int draws = 0;
        bool smooth;
        do {
            kt_tree_state_draw(&s.tree, &random, &s.state);
            for (int i = 0; i < s.tree.nv; i++) /* at rest a stop's damping has a kink */
                s.state.v[i] += copysign(0.1, s.state.v[i]);
            smooth = is_smooth(&s);
        } while (!smooth && ++draws < 100);
        if (!smooth)
            continue;
        if (!differentiate(&s, d_q, d_v))
            return;
        compare(&s, d_q, false, &by_q, n);
        compare(&s, d_v, true, &by_v, n);
        for (int i = 0; i < s.tree.description.effect_count; i++)
            *(s.effect[i].type == KT_EFFECT_CUSTOM ? &own : &types[s.effect[i].type]) += 1;
    }
    for (int i = 0; i < KT_EFFECT_TYPE_COUNT; i++)
        kinds += types[i] > MECHANISMS / 4;
    kt_check_equal_int("types of effects", kinds, KT_EFFECT_TYPE_COUNT);
    kt_check_above("a caller's own", own, 1.2 * MECHANISMS);
}

/* ---- one by one -------------------------------------------------------------------------------------------------- */

/* Adds J' w of an end to f, and |J|' |w| to size. */
static void add_end(const kt_tree *tree, const kt_end *end, const kt_wrench *w, double *f, double *size) {
    double jacobian[6 * KT_TREE_NV];
    const char *name = end->body;
    const double load[6] = {w->moment.x, w->moment.y, w->moment.z, w->force.x, w->force.y, w->force.z};
    kt_point_jacobian(tree->model, tree->data, name ? kt_body_find(tree->model, name) : 0, end->at, jacobian);
    for (int i = 0; i < kt_model_nv(tree->model); i++)
        for (int k = 0; k < 6; k++) {
            f[i] += jacobian[6 * i + k] * load[k];
            size[i] += fabs(jacobian[6 * i + k] * load[k]);
        }
}

/* Adds the force of each effect, transformed to the coordinates by Jacobians of its ends. */
static void add_all(const stage *s, double *f, double *size) {
    const kt_tree *tree = &s->tree;
    kt_error e = {0};
    for (int i = 0; i < tree->description.effect_count; i++) {
        const kt_effect *effect = &s->effect[i];
        kt_effect_load load;
        kt_need_fine("load", kt_effect_evaluate(tree->model, tree->data, 0.0, s->state.q, s->state.v, i, &load, &e),
                     &e);
        for (int k = 0; k < load.end_count; k++)
            add_end(tree, &(effect->joint ? s->loop.between : effect->between)[k], &load.wrench[k], f, size);
        if (load.end_count == 0 && load.joint_force != 0.0)
            f[kt_body_coordinates(tree->model, kt_body_find(tree->model, effect->joint)).v] += load.joint_force;
    }
}

/* In a loop the force times the coordinate's rate is the power of the wrenches on both ends, wherever these are. */
static void check_power(const stage *s, kt_worst *worst, int n) {
    const kt_tree *tree = &s->tree;
    const kt_model *m = tree->model;
    for (size_t i = 0; i < m->n.effect; i++) {
        const kt_effect_record *r = &m->effect[i];
        kt_effect_load load;
        kt_effect_end end[2];
        double power = 0.0, size = 1.0;
        if (!r->relative.type || kt_effect_load_find(m, tree->data, 0.0, s->state.q, s->state.v, r, end, &load) != 0)
            continue;
        for (int k = 0; k < 2; k++) {
            const double parts[2] = {kt_vec3_dot(load.wrench[k].force, end[k].velocity),
                                     kt_vec3_dot(load.wrench[k].moment, end[k].omega)};
            power += parts[0] + parts[1];
            size += fabs(parts[0]) + fabs(parts[1]);
        }
        const double rate = kt_relative_motion_of(m, r, s->state.q, end).rate;
        kt_worst_near(worst, load.joint_force * rate, power, 64.0 * DBL_EPSILON * size, "mechanism %d, effect %zu", n,
                      i);
    }
}

/* Bounds: positions are rounded to some eps of the mechanism's few metres. This changes forces by the stiffnesses,
 * which are near 1. The change over forty seeds was up to 57 eps. */
KT_TEST(effects_add_up_to_their_generalised_forces) {
    kt_random random = kt_random_of_test();
    const kt_tree_plan plan = kt_tree_plan_default();
    KT_WORST worst = kt_worst_make("joint forces"), power = kt_worst_make("power in loops");
    for (int n = 0; n < MECHANISMS; n++) {
        static stage s;
        double f[KT_TREE_NV] = {0.0}, size[KT_TREE_NV] = {0.0}, wanted[KT_TREE_NV];
        kt_error e = {0};
        grow(&s, &plan, &random);
        kt_tree_state_draw(&s.tree, &random, &s.state);
        kt_tree_kinematics(&s.tree, &s.state);
        add_all(&s, f, size);
        kt_need_fine("forces", kt_effect_forces(s.tree.model, s.tree.data, 0.0, s.state.q, s.state.v, wanted, &e), &e);
        check_power(&s, &power, n);
        for (int i = 0; i < kt_model_nv(s.tree.model); i++)
            kt_worst_near(&worst, f[i], wanted[i], 200.0 * DBL_EPSILON * (1.0 + size[i]), "mechanism %d, %d", n, i);
    }
}

KT_TEST(forces_of_effects_change_as_their_differences_do) { check_all(kt_tree_plan_default()); }

KT_TEST(forces_of_effects_on_planar_trees_change_as_their_differences_do) { check_all(kt_tree_plan_planar()); }
