/* A standing and stepping quadruped: torques of its twelve motors, and forces of feet that do not slip.
 *
 * Each foot on the ground is a loop that can be switched (kt_loop_set_on). Take accelerations a that these loops allow.
 * The equations of motion
 *
 *     M a + h = S' tau + A' f
 *
 * have many solutions: twelve torques and three forces a foot for eighteen equations. The program finds the solution
 * with the least
 *
 *     sum tau^2 + small sum f^2
 *
 * whose forces lie in the friction pyramids
 *
 *     |f_x|, |f_y| <= mu f_z / sqrt(2),  f_z >= f_min.
 *
 * The motors' rows give tau = (M a + h - A' f) of these rows. The six rows of the trunk are equations for f. The
 * remaining problem is a quadratic program in f.
 *
 * The dual method of Goldfarb and Idnani solves it. The method starts from the minimum without inequalities and adds
 * the most violated inequality. Inequalities whose multipliers would become negative are removed. Reference: "A
 * numerically stable dual method for solving strictly convex quadratic programs", Mathematical Programming 27, 1983.
 *
 * Each solution is then checked with kt_acceleration_evaluate and kt_multiplier_evaluate, which are independent of the
 * quadratic program. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEGS = 4, MOTORS = 12, TRUNK = 6, NV = TRUNK + MOTORS, NQ = NV + 1, MOST = 3 * LEGS, SIDES = 5 * LEGS };

static const double friction = 0.7, least_force = 5.0, small = 1e-4;

/* ---- the quadratic program --------------------------------------------------------------------------------------- */

/* min x'H x / 2 + g'x with E'x = e and C'x >= c; columns of E and C are n apart. */
typedef struct program {
    int n, equations, inequalities;
    double h[MOST * MOST], g[MOST];
    double e_matrix[MOST * TRUNK], e[TRUNK];
    double c_matrix[MOST * SIDES], c[SIDES];
} program;

typedef struct solution {
    double x[MOST], multiplier[SIDES]; /* of the inequalities */
    int active[SIDES], active_count, steps;
} solution;

/* Gaussian elimination with row pivots; a is n x n by rows. Returns false at a pivot of zero. */
static bool eliminate_gauss(int n, double *a, double *b) {
    for (int k = 0; k < n; k++) {
        int p = k;
        for (int i = k + 1; i < n; i++)
            p = fabs(a[i * n + k]) > fabs(a[p * n + k]) ? i : p;
        if (!(fabs(a[p * n + k]) > 1e-13))
            return false;
        for (int j = 0; j < n && p != k; j++) {
            const double x = a[k * n + j];
            a[k * n + j] = a[p * n + j];
            a[p * n + j] = x;
        }
        const double x = b[k];
        b[k] = b[p];
        b[p] = x;
        for (int i = k + 1; i < n; i++) {
            const double by = a[i * n + k] / a[k * n + k];
            for (int j = k; j < n; j++)
                a[i * n + j] -= by * a[k * n + j];
            b[i] -= by * b[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++)
            b[i] -= a[i * n + j] * b[j];
        b[i] /= a[i * n + i];
    }
    return true;
}

/* [H N; N' 0] (z, r) = (right, below): N has the equations and the active inequalities. */
static bool solve_kkt(const program *p, const solution *s, const double *right, const double *below, double *z,
                      double *r) {
    static double a[(MOST + TRUNK + SIDES) * (MOST + TRUNK + SIDES)], b[MOST + TRUNK + SIDES];
    const int k = p->equations + s->active_count, n = p->n + k;
    memset(a, 0, sizeof a);
    for (int i = 0; i < p->n; i++) {
        memcpy(a + i * n, p->h + i * p->n, (size_t)p->n * sizeof *a);
        b[i] = right[i];
    }
    for (int j = 0; j < k; j++) {
        const double *column =
            j < p->equations ? p->e_matrix + j * p->n : p->c_matrix + s->active[j - p->equations] * p->n;
        for (int i = 0; i < p->n; i++)
            a[i * n + p->n + j] = a[(p->n + j) * n + i] = column[i];
        b[p->n + j] = below ? below[j] : 0.0;
    }
    if (!eliminate_gauss(n, a, b))
        return false;
    memcpy(z, b, (size_t)p->n * sizeof *z);
    memcpy(r, b + p->n, (size_t)k * sizeof *r);
    return true;
}

static double slack_of(const program *p, const double *x, int side) {
    double sum = -p->c[side];
    for (int i = 0; i < p->n; i++)
        sum += p->c_matrix[side * p->n + i] * x[i];
    return sum;
}

static int most_violated(const program *p, const double *x) {
    int worst = -1;
    double least = -1e-9;
    for (int side = 0; side < p->inequalities; side++) {
        const double slack = slack_of(p, x, side);
        if (slack < least) {
            least = slack;
            worst = side;
        }
    }
    return worst;
}

/* Adds one inequality. Active inequalities whose multipliers reach zero on the way are removed. Returns false if there
 * is no solution. */
static bool add_inequality(const program *p, solution *s, int side) {
    double z[MOST], r[TRUNK + SIDES];
    const double *n = p->c_matrix + side * p->n;
    for (;;) {
        double along = 0.0, dual = (double)INFINITY;
        int leaves = -1;
        const bool moves = solve_kkt(p, s, n, NULL, z, r);
        for (int i = 0; i < p->n && moves; i++)
            along += n[i] * z[i];
        for (int j = 0; j < s->active_count && moves; j++)
            if (r[p->equations + j] > 1e-12 && s->multiplier[s->active[j]] / r[p->equations + j] < dual) {
                dual = s->multiplier[s->active[j]] / r[p->equations + j];
                leaves = j;
            }
        const double primal = moves && along > 1e-12 ? -slack_of(p, s->x, side) / along : (double)INFINITY;
        const double t = primal < dual ? primal : dual;
        if (!moves || !isfinite(t) || s->steps++ > 200)
            return false;
        for (int i = 0; i < p->n && isfinite(primal); i++)
            s->x[i] += t * z[i];
        for (int j = 0; j < s->active_count; j++)
            s->multiplier[s->active[j]] -= t * r[p->equations + j];
        s->multiplier[side] += t;
        if (primal <= dual) {
            s->active[s->active_count++] = side;
            return true;
        }
        s->multiplier[s->active[leaves]] = 0.0;
        s->active[leaves] = s->active[--s->active_count];
    }
}

static bool minimise_program(const program *p, solution *s) {
    double right[MOST], r[TRUNK + SIDES];
    memset(s, 0, sizeof *s);
    for (int i = 0; i < p->n; i++)
        right[i] = -p->g[i];
    bool fine = solve_kkt(p, s, right, p->e, s->x, r);
    for (int side = fine ? most_violated(p, s->x) : -1; side >= 0 && fine; side = most_violated(p, s->x))
        fine = add_inequality(p, s, side);
    return fine;
}

/* The violation of stationarity: the part of the gradient that the equations and the active sides do not balance. It is
 * measured as the largest component of a Newton step. */
static double stationarity(const program *p, const solution *s) {
    double gradient[MOST], below[TRUNK + SIDES] = {0.0}, z[MOST], r[TRUNK + SIDES], most = 0.0;
    for (int i = 0; i < p->n; i++) {
        gradient[i] = p->g[i];
        for (int j = 0; j < p->n; j++)
            gradient[i] += p->h[i * p->n + j] * s->x[j];
        for (int k = 0; k < s->active_count; k++)
            gradient[i] -= s->multiplier[s->active[k]] * p->c_matrix[s->active[k] * p->n + i];
    }
    solution none = {.active_count = 0}; /* the remainder must be a combination of the equations alone */
    if (!solve_kkt(p, &none, gradient, below, z, r))
        return (double)INFINITY;
    for (int i = 0; i < p->n; i++)
        most = fmax(most, fabs(z[i]));
    return most;
}

/* ---- the robot --------------------------------------------------------------------------------------------------- */

typedef struct robot {
    kt_body body[1 + 3 * LEGS];
    char name[1 + 3 * LEGS][8], foot_name[LEGS][8];
    kt_loop foot[LEGS];
    kt_description description;
    const kt_model *model;
    kt_model *compiled;
    kt_data *data;
    double q[NQ], v[NV];
} robot;

static void describe_robot(robot *r) {
    r->description = kt_description_default();
    r->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    for (int i = 0; i < 1 + 3 * LEGS; i++) {
        kt_body *b = &r->body[i];
        const int leg = (i - 1) / 3, part = (i - 1) % 3;
        const double side = leg % 2 ? -1.0 : 1.0;
        *b = kt_body_default();
        snprintf(r->name[i], sizeof r->name[i], "body%d", i);
        b->name = r->name[i];
        b->mass = i ? 0.8 - 0.2 * part : 9.0;
        b->inertia = (kt_sym3){0.02 * b->mass, 0.03 * b->mass, 0.025 * b->mass, 0.0, 0.0, 0.0};
        b->joint.type = i ? KT_JOINT_REVOLUTE : KT_JOINT_FREE;
        b->joint.position[3] = i ? 0.0 : 1.0;
        b->joint.position[2] = i ? 0.0 : 0.45;
        if (i == 0)
            continue;
        b->parent = part ? r->name[i - 1] : r->name[0];
        b->joint.axis = part ? kt_vec3_make(0.0, 1.0, 0.0) : kt_vec3_make(1.0, 0.0, 0.0);
        b->joint.at = part == 0   ? kt_vec3_make(leg < 2 ? 0.3 : -0.3, 0.15 * side, 0.0)
                      : part == 1 ? kt_vec3_make(0.0, 0.06 * side, 0.0)
                                  : kt_vec3_make(0.0, 0.0, -0.25);
        b->joint.position[0] = part == 0 ? 0.0 : part == 1 ? 0.6 : -1.2;
        b->com = kt_vec3_make(0.0, 0.0, part ? -0.11 : 0.0);
    }
    r->description.bodies = r->body;
    r->description.body_count = 1 + 3 * LEGS;
}

/* Builds the robot. Each foot is a switched loop that holds the foot at its initial position. */
static kt_status build_robot(robot *r, kt_error *error) {
    kt_model *tree = NULL;
    kt_data *data = NULL;
    describe_robot(r);
    kt_status status = kt_model_compile(&r->description, NULL, &tree, error);
    if (status == KT_OK)
        status = kt_data_create(tree, &data, error);
    if (status == KT_OK) {
        kt_model_initial(tree, r->q, r->v);
        status = kt_kinematics_update(tree, data, r->q, r->v, NULL, error);
    }
    for (int leg = 0; leg < LEGS && status == KT_OK; leg++) {
        kt_loop *foot = &r->foot[leg];
        *foot = kt_loop_default();
        snprintf(r->foot_name[leg], sizeof r->foot_name[leg], "foot%d", leg);
        foot->name = r->foot_name[leg];
        foot->type = KT_LOOP_SPHERICAL;
        foot->between[1].body = r->name[3 * leg + 3];
        foot->between[1].at = kt_vec3_make(0.0, 0.0, -0.25);
        foot->between[0].at =
            kt_point_position(tree, data, kt_body_find(tree, r->name[3 * leg + 3]), foot->between[1].at);
        foot->switching = KT_SWITCHED_ON;
    }
    r->description.loops = r->foot;
    r->description.loop_count = LEGS;
    if (status == KT_OK)
        status = kt_model_compile(&r->description, NULL, &r->compiled, error);
    if (status == KT_OK)
        status = kt_data_create(r->compiled, &r->data, error);
    r->model = r->compiled;
    kt_data_free(data);
    kt_model_free(tree);
    return status;
}

/* Computes accelerations with the feet in place: those nearest to the requested (x, y, z) m/s^2 of the trunk. */
static kt_status accelerate_trunk(robot *r, kt_vec3 asked, double *a, kt_error *error) {
    double jacobian[MOST * NV], basis[NV * NV], wanted[NV] = {asked.x, asked.y, asked.z};
    int columns = 0;
    kt_status status = kt_loop_equations(r->model, r->data, 0.0, r->q, r->v, jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = kt_loop_nullspace(r->model, r->data, 0.0, r->q, basis, &columns, error);
    memset(a, 0, NV * sizeof *a);
    /* At rest A a = 0: a = Z (Z_t' Z_t + small)^-1 Z_t' wanted, of the rows of the trunk and, weakly, of the others. */
    double m[NV * NV] = {0.0}, b[NV] = {0.0};
    for (int i = 0; i < columns && status == KT_OK; i++) {
        for (int k = 0; k < NV; k++) {
            const double weight = k < TRUNK ? 1.0 : 1e-6;
            b[i] += weight * basis[i * NV + k] * wanted[k];
            for (int j = 0; j < columns; j++)
                m[i * columns + j] += weight * basis[i * NV + k] * basis[j * NV + k];
        }
    }
    if (status == KT_OK && !eliminate_gauss(columns, m, b))
        return KT_ERROR_SINGULAR;
    for (int i = 0; i < columns && status == KT_OK; i++)
        for (int k = 0; k < NV; k++)
            a[k] += basis[i * NV + k] * b[i];
    return status;
}

/* The program of the forces: right = M a + h. */
static void pose_program(const double *right, const double *jacobian, int rows, program *p) {
    memset(p, 0, sizeof *p);
    p->n = rows;
    p->equations = TRUNK;
    p->inequalities = 5 * rows / 3;
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < rows; j++)
            for (int k = TRUNK; k < NV; k++)
                p->h[i * rows + j] += jacobian[k * rows + i] * jacobian[k * rows + j];
        p->h[i * rows + i] += small;
        for (int k = TRUNK; k < NV; k++)
            p->g[i] -= jacobian[k * rows + i] * right[k];
        for (int k = 0; k < TRUNK; k++)
            p->e_matrix[k * rows + i] = jacobian[k * rows + i];
    }
    memcpy(p->e, right, sizeof p->e);
    /* Rows of a foot are the second end minus the first, in the axes of the world, which makes f the force of the
     * ground. */
    for (int foot = 0; foot < rows / 3; foot++)
        for (int side = 0; side < 5; side++) {
            double *column = p->c_matrix + (5 * foot + side) * rows + 3 * foot;
            column[2] = side < 4 ? friction / sqrt(2.0) : 1.0;
            if (side < 4)
                column[side / 2] = side % 2 ? -1.0 : 1.0;
            p->c[5 * foot + side] = side < 4 ? 0.0 : least_force;
        }
}

/* Computes one command and prints the quality of its solution. Returns whether there is one. */
static bool command_trunk(robot *r, const char *what, kt_vec3 asked) {
    static program p;
    static solution s;
    kt_error error = {0};
    double a[NV], right[NV], jacobian[MOST * NV], tau[NV] = {0.0}, reached[NV], found[MOST];
    kt_status status = accelerate_trunk(r, asked, a, &error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(r->model, r->data, r->q, r->v, a, NULL, right, &error);
    if (status == KT_OK)
        status = kt_loop_equations(r->model, r->data, 0.0, r->q, r->v, jacobian, NULL, NULL, NULL, &error);
    if (status != KT_OK) {
        printf("%s: %s: %s\n", what, error.where, error.message);
        return false;
    }
    const int rows = kt_model_mobility(r->model).equations;
    pose_program(right, jacobian, rows, &p);
    if (!minimise_program(&p, &s)) {
        printf("%-28s no forces within friction can do it\n", what);
        return false;
    }
    double effort = 0.0, miss = 0.0, foot_miss = 0.0, worst = (double)INFINITY, least = (double)INFINITY;
    for (int k = TRUNK; k < NV; k++) {
        tau[k] = right[k];
        for (int i = 0; i < rows; i++)
            tau[k] -= jacobian[k * rows + i] * s.x[i];
        effort += tau[k] * tau[k];
    }
    if (kt_acceleration_evaluate(r->model, r->data, 0.0, r->q, r->v, tau, NULL, reached, &error) != KT_OK ||
        kt_multiplier_evaluate(r->model, r->data, 0.0, r->q, r->v, tau, NULL, found, &error) != KT_OK)
        return false;
    for (int k = 0; k < NV; k++)
        miss = fmax(miss, fabs(reached[k] - a[k]));
    for (int i = 0; i < rows; i++)
        foot_miss = fmax(foot_miss, fabs(found[i] - s.x[i]));
    for (int side = 0; side < p.inequalities; side++)
        worst = fmin(worst, slack_of(&p, s.x, side));
    for (int k = 0; k < s.active_count; k++)
        least = fmin(least, s.multiplier[s.active[k]]);
    printf("%-28s effort %8.3f, %2d sides active, %2d steps; missed: acceleration %.1e, forces %.1e N, cones %.1e N, "
           "gradient %.1e; least multiplier %.1e\n",
           what, effort, s.active_count, s.steps, miss, foot_miss, fmax(0.0, -worst), stationarity(&p, &s),
           s.active_count ? least : 0.0);
    return true;
}

static bool lift(robot *r, int leg, bool down) {
    kt_error error = {0};
    const kt_status status = kt_loop_set_on(&r->model, r->data, leg, down, &error);
    if (status != KT_OK)
        printf("%s: %s\n", error.where, error.message);
    return status == KT_OK;
}

int main(void) {
    static robot r;
    kt_error error = {0};
    if (build_robot(&r, &error) != KT_OK) {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
        return 1;
    }
    bool fine = command_trunk(&r, "four feet, still", kt_vec3_make(0.0, 0.0, 0.0));
    fine &= command_trunk(&r, "four feet, forward 2 m/s^2", kt_vec3_make(2.0, 0.0, 0.0));
    fine &= command_trunk(&r, "four feet, forward 4 m/s^2", kt_vec3_make(4.0, 0.0, 0.0));
    fine &= command_trunk(&r, "four feet, forward 4.7 m/s^2", kt_vec3_make(4.7, 0.0, 0.0));
    fine &= command_trunk(&r, "four feet, aside 2 m/s^2", kt_vec3_make(0.0, 2.0, 0.0));
    fine &= !command_trunk(&r, "four feet, forward 9 m/s^2", kt_vec3_make(9.0, 0.0, 0.0));
    fine &= lift(&r, 0, false) && command_trunk(&r, "three feet, 1.2 m/s^2", kt_vec3_make(1.0, 0.6, 0.0));
    fine &= lift(&r, 0, true) && command_trunk(&r, "four feet again, still", kt_vec3_make(0.0, 0.0, 0.0));
    kt_data_free(r.data);
    kt_model_free(r.compiled);
    return fine ? 0 : 1;
}
