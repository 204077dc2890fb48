#include "tangle.h"

#include "model/internal.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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
    pose.rotation = kt_matrix_from_quat(kt_quat_make(p[0], p[1], p[2], p[3]));
    pose.position = kt_vec3_add(around, kt_tree_vector(random, -1.0, 1.0));
    return pose;
}

static int equations_of(kt_loop_type type) {
    static const int count[KT_LOOP_TYPE_COUNT] = {
        [KT_LOOP_SPHERICAL] = 3, [KT_LOOP_INLINE] = 2,    [KT_LOOP_INPLANE] = 1,     [KT_LOOP_DISTANCE] = 1,
        [KT_LOOP_PARALLEL] = 3,  [KT_LOOP_COAXIAL] = 2,   [KT_LOOP_ORTHOGONAL] = 1,  [KT_LOOP_REVOLUTE] = 5,
        [KT_LOOP_PRISMATIC] = 5, [KT_LOOP_SCREW] = 5,     [KT_LOOP_CYLINDRICAL] = 4, [KT_LOOP_PLANAR] = 3,
        [KT_LOOP_WELD] = 6,      [KT_LOOP_UNIVERSAL] = 4, [KT_LOOP_COUPLING] = 1,    [KT_LOOP_MOTION] = 1,
        [KT_LOOP_ROLLING] = 3};
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
        const int freedoms = freedoms_between(g->tree.model, body[0], body[1]);
        if (freedoms > equations && (!nearby || freedoms < equations + 6))
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

static bool draw_relation(tangle *g, kt_random *random, kt_loop *loop, kt_term *term, bool still) {
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
    for (int i = 0; i < found; i++) {
        term[i].joint = g->tree.description.bodies[kt_body_source(g->tree.model, joint[i])].name;
        term[i].coefficient = kt_random_uniform(random, 0.5, 2.0) * (i % 2 ? -1.0 : 1.0);
        loop->offset += term[i].coefficient * q0[kt_body_coordinates(g->tree.model, joint[i]).q];
    }
    loop->terms = term;
    loop->term_count = found;
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

/* An axis that a loop in the plane can have, in its frame: along the normal, in the plane, or any. */
static kt_vec3 draw_flat_axis(const tangle *g, kt_random *random, kt_loop_type type, kt_pose frame) {
    const kt_vec3 n = g->tree.normal, any = kt_tree_direction(random);
    const bool free = type == KT_LOOP_SPHERICAL || type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE ||
                      type == KT_LOOP_DISTANCE || type == KT_LOOP_PARALLEL || type == KT_LOOP_PRISMATIC ||
                      type == KT_LOOP_WELD;
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
        loop->type = (kt_loop_type)kt_random_int(random, 0, KT_LOOP_TYPE_COUNT - 1);
    while (!(plan->types & 1U << loop->type));
    if (loop->type == KT_LOOP_COUPLING || loop->type == KT_LOOP_MOTION)
        return draw_relation(g, random, loop, g->term[i], plan->still);
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
    if (!kt_tree_compile(&g->tree, NULL))
        return false;
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
    if (kt_model_compile(&g->tree.description, &plan->options, &g->tree.model, &error) != KT_OK ||
        kt_data_create(g->tree.model, &g->tree.data, &error) != KT_OK)
        return false;
    g->tree.count = kt_model_body_count(g->tree.model);
    const kt_freedom freedom = kt_model_freedom(g->tree.model);
    g->rows = freedom.equations;
    if (freedom.minimal < 1)
        return false;
    draw_state(g, random);
    return kt_state_assemble(g->tree.model, g->tree.data, g->t, g->q, g->v, &error) == KT_OK;
}

bool tangle_grow(tangle *g, const tangle_plan *plan, kt_random *random) {
    for (int tries = 0; tries < 40; tries++) {
        if (try_to_grow(g, plan, random))
            return true;
        tangle_free(g);
    }
    return kt_check_true("a closed mechanism can be had", false);
}

void tangle_free(tangle *g) { kt_tree_free(&g->tree); }

bool tangle_was_near_singular(const kt_model *model, const kt_data *data) {
    bool near = data->beside;
    for (size_t i = 0; i < model->n.group; i++)
        near = near || data->near[i];
    return near;
}

/* ---- its equations of motion ------------------------------------------------------------------------------------- */

bool tangle_system_of(const tangle *g, tangle_system *s) {
    const kt_tree *tree = &g->tree;
    kt_error e = {0};
    if (!kt_tree_fine("mass matrix", kt_dynamics_mass(tree->model, tree->data, g->q, s->mass, &e), &e) ||
        !kt_tree_fine("bias", kt_dynamics_inverse(tree->model, tree->data, g->q, g->v, NULL, g->external, s->force, &e),
                      &e))
        return false;
    for (int i = 0; i < tree->nv; i++)
        s->force[i] = g->tau[i] - s->force[i];
    return kt_tree_fine(
        "equations",
        kt_loop_equations(tree->model, tree->data, g->t, g->q, g->v, s->jacobian, NULL, NULL, s->drift, &e), &e);
}

/* Independent rows of A, by Gram-Schmidt with pivots; returns their number. */
static int choose_rows(const tangle_system *s, int rows, int nv, int *chosen) {
    static long double a[TANGLE_ROWS][KT_TREE_NV];
    bool taken[TANGLE_ROWS] = {false};
    long double first = 0.0L;
    for (int r = 0; r < rows; r++)
        for (int i = 0; i < nv; i++)
            a[r][i] = (long double)s->jacobian[i * rows + r];
    for (int count = 0;; count++) {
        int best = -1;
        long double most = 0.0L;
        for (int r = 0; r < rows; r++) {
            long double norm = 0.0L;
            for (int i = 0; i < nv; i++)
                norm += a[r][i] * a[r][i];
            if (!taken[r] && norm > most) {
                most = norm;
                best = r;
            }
        }
        if (count == 0)
            first = most;
        if (best < 0 || most < 1e-22L * first) /* 1e-11 of the first */
            return count;
        taken[best] = true;
        chosen[count] = best;
        for (int r = 0; r < rows; r++) {
            long double dot = 0.0L;
            for (int i = 0; i < nv && !taken[r]; i++)
                dot += a[r][i] * a[best][i];
            for (int i = 0; i < nv && !taken[r]; i++)
                a[r][i] -= dot / most * a[best][i];
        }
    }
}

/* K <- K^-1 by Gauss and Jordan with row pivots. */
static void invert(long double *k, int n) {
    int *order = malloc((size_t)n * sizeof *order);
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j; i < n; i++)
            if (fabsl(k[i * n + j]) > fabsl(k[best * n + j]))
                best = i;
        order[j] = best;
        for (int c = 0; c < n; c++) {
            const long double t = k[j * n + c];
            k[j * n + c] = k[best * n + c];
            k[best * n + c] = t;
        }
        const long double d = 1.0L / k[j * n + j];
        k[j * n + j] = 1.0L;
        for (int c = 0; c < n; c++)
            k[j * n + c] *= d;
        for (int i = 0; i < n; i++) {
            const long double f = k[i * n + j];
            if (i == j)
                continue;
            k[i * n + j] = 0.0L;
            for (int c = 0; c < n; c++)
                k[i * n + c] -= f * k[j * n + c];
        }
    }
    for (int j = n - 1; j >= 0; j--)
        for (int i = 0; i < n; i++) {
            const long double t = k[i * n + j];
            k[i * n + j] = k[i * n + order[j]];
            k[i * n + order[j]] = t;
        }
    free(order);
}

/* x <- x + K^-1 (right - K x). Multipliers may be so large that their part of the inverse's rounding is seen in
 * coordinates which the loops hold still; once x is near, what is left of the right side no longer has it. */
static void refine(const long double *k, const long double *inverse, int n, const long double *right, long double *x,
                   long double *left) {
    for (int i = 0; i < n; i++) {
        left[i] = right[i];
        for (int j = 0; j < n; j++)
            left[i] -= k[i * n + j] * x[j];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            x[i] += inverse[i * n + j] * left[j];
}

static long double length(const long double *x, int n) {
    long double sum = 0.0L;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrtl(sum);
}

/* |K_i| |x| + |right_i| and the same of a = way.by, of force or equation i. */
static long double products(const long double *row, int i, int n, int nv, const long double *x, tangle_way way) {
    long double sum = 0.0L, by = 0.0L;
    for (int j = 0; j < nv && way.by; j++) {
        sum += fabsl(row[j] * (long double)way.by[j]);
        by += (long double)way.by[j] * (long double)way.by[j];
    }
    if (way.mixes && i >= nv)
        return length(row, nv) * (length(x, nv) + sqrtl(by));
    for (int j = 0; j < n; j++)
        sum += fabsl(row[j] * x[j]);
    return sum;
}

/* K = [M A'; A 0], x = (a, -lambda), K x = (tau - h, b''); |dx| <= eps |K^-1| (|K| |x| + |right|), with the largest of
 * the last bracket among forces, and among equations: orthogonal factors mix them. */
int tangle_solve(const tangle *g, const tangle_system *s, tangle_way way, double *a, double *moved) {
    const int nv = g->tree.nv;
    int chosen[TANGLE_ROWS];
    const int rank = choose_rows(s, g->rows, nv, chosen), n = nv + rank;
    long double *k = calloc((size_t)n * (size_t)n, sizeof *k), *inverse = malloc((size_t)n * (size_t)n * sizeof *k);
    long double *right = malloc(3 * (size_t)n * sizeof *right), *x = right + n, *left = x + n;
    for (int i = 0; i < nv; i++) {
        for (int j = 0; j < nv; j++)
            k[i * n + j] = (long double)s->mass[j * nv + i];
        for (int r = 0; r < rank; r++)
            k[i * n + nv + r] = k[(nv + r) * n + i] = (long double)s->jacobian[i * g->rows + chosen[r]];
        right[i] = (long double)s->force[i];
    }
    for (int r = 0; r < rank; r++)
        right[nv + r] = (long double)s->drift[chosen[r]];
    memcpy(inverse, k, (size_t)(n * n) * sizeof *k);
    invert(inverse, n);
    memset(x, 0, (size_t)n * sizeof *x);
    for (int round = 0; round < 3; round++)
        refine(k, inverse, n, right, x, left);
    long double most[2] = {0.0L, 0.0L};
    for (int i = 0; i < n; i++)
        most[i >= nv] = fmaxl(most[i >= nv], fabsl(right[i]) + products(k + i * n, i, n, nv, x, way));
    for (int i = 0; i < nv; i++) {
        long double sum = 0.0L;
        for (int j = 0; j < n; j++)
            sum += fabsl(inverse[i * n + j]) * most[j >= nv];
        a[i] = (double)x[i];
        moved[i] = DBL_EPSILON * (double)sum;
    }
    free(right);
    free(inverse);
    free(k);
    return rank;
}
