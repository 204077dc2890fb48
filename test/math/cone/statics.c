/* Rest of random bodies with up to eight frictional contacts, against two oracles that share no code with the solver.
 * Polygons inside and outside of the cones, and Lawson and Hanson's method of nonnegative least squares
 * (doi:10.1137/1.9781611971217), decide whether forces of rest exist. Dykstra's alternating projections find the least
 * ones (doi:10.1080/01621459.1983.10477029). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/statics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "squares.h"

enum { CONTACTS = 8, ROWS = 3 * CONTACTS, BODIES = 5, DOFS = 6 * BODIES, EDGES = 96 };

/* W p + b = 0 of contacts in random directions at random points of bodies, and of these with the world. */
typedef struct problem {
    int n;
    double J[ROWS][DOFS], inverse[DOFS], force[DOFS], mu[CONTACTS];
    double A[ROWS][DOFS], c[DOFS]; /* J M^-1/2, and the load that A' p balances */
    double W[ROWS][ROWS], b[ROWS]; /* A A', -A c */
} problem;

static void add_side(problem *p, int contact, int body, double sign, kt_random *random, double frame[3][3]) {
    double r[3];
    for (int k = 0; k < 3; k++)
        r[k] = kt_random_uniform(random, -0.3, 0.3);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            p->J[3 * contact + c][6 * body + k] += sign * frame[c][k];
            p->J[3 * contact + c][6 * body + 3 + k] += sign * (r[i] * frame[c][j] - r[j] * frame[c][i]);
        }
}

/* The frame of a contact: a normal near z, or anywhere. */
static void draw_frame(kt_random *random, bool any, double frame[3][3]) {
    double d[3], e[3] = {0.0, 0.0, 0.0}, norm;
    kt_random_direction(random, 3, d);
    for (int k = 0; k < 3; k++)
        frame[0][k] = any ? d[k] : 0.2 * d[k] + (k == 2);
    norm = sqrt(frame[0][0] * frame[0][0] + frame[0][1] * frame[0][1] + frame[0][2] * frame[0][2]);
    for (int k = 0; k < 3; k++)
        frame[0][k] /= norm;
    e[fabs(frame[0][0]) < 0.6 ? 0 : 1] = 1.0;
    for (int c = 1; c < 3; c++) {
        for (int k = 0; k < 3; k++) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            frame[c][k] = frame[c - 1][i] * e[j] - frame[c - 1][j] * e[i];
        }
        norm = sqrt(frame[c][0] * frame[c][0] + frame[c][1] * frame[c][1] + frame[c][2] * frame[c][2]);
        for (int k = 0; k < 3; k++)
            frame[c][k] /= norm;
        memcpy(e, frame[0], sizeof e);
    }
    for (int k = 0; k < 3; k++) { /* the third axis is normal to both */
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        frame[2][k] = frame[0][i] * frame[1][j] - frame[0][j] * frame[1][i];
    }
}

/* b of the load c, whose part that no force balances is removed. */
static void take_load(problem *p) {
    double Q[ROWS][DOFS], to[DOFS] = {0.0};
    int rank = 0;
    for (int i = 0; i < 3 * p->n; i++) {
        double *q = Q[rank], norm = 0.0, own = 0.0;
        memcpy(q, p->A[i], sizeof p->A[i]);
        for (int d = 0; d < DOFS; d++)
            own += q[d] * q[d];
        for (int pass = 0; pass < 2; pass++)
            for (int r = 0; r < rank; r++) {
                double along = 0.0;
                for (int d = 0; d < DOFS; d++)
                    along += Q[r][d] * q[d];
                for (int d = 0; d < DOFS; d++)
                    q[d] -= along * Q[r][d];
            }
        for (int d = 0; d < DOFS; d++)
            norm += q[d] * q[d];
        for (int d = 0; d < DOFS; d++)
            q[d] /= sqrt(norm);
        rank += norm > 1e-16 * own;
    }
    for (int r = 0; r < rank; r++) {
        double along = 0.0;
        for (int d = 0; d < DOFS; d++)
            along += Q[r][d] * p->c[d];
        for (int d = 0; d < DOFS; d++)
            to[d] += along * Q[r][d];
    }
    memcpy(p->c, to, sizeof to);
    for (int i = 0; i < 3 * p->n; i++) {
        p->b[i] = 0.0;
        for (int d = 0; d < DOFS; d++)
            p->b[i] -= p->A[i][d] * p->c[d];
    }
}

static void find_delassus(problem *p) {
    for (int i = 0; i < 3 * p->n; i++)
        for (int d = 0; d < DOFS; d++)
            p->A[i][d] = p->J[i][d] * sqrt(p->inverse[d]);
    for (int i = 0; i < 3 * p->n; i++)
        for (int j = 0; j < 3 * p->n; j++) {
            p->W[i][j] = 0.0;
            for (int d = 0; d < DOFS; d++)
                p->W[i][j] += p->A[i][d] * p->A[j][d];
        }
    for (int d = 0; d < DOFS; d++)
        p->c[d] = -sqrt(p->inverse[d]) * p->force[d];
    take_load(p);
}

static void draw_problem(kt_random *random, problem *p) {
    const int bodies = kt_random_int(random, 1, BODIES);
    const bool any = kt_random_int(random, 0, 1) == 1;
    memset(p, 0, sizeof *p);
    p->n = kt_random_int(random, 1, CONTACTS);
    for (int b = 0; b < bodies; b++) {
        const double mass = pow(10.0, kt_random_uniform(random, -1.0, 1.0));
        for (int k = 0; k < 6; k++) {
            p->inverse[6 * b + k] = k < 3 ? 1.0 / mass : 1.0 / (mass * kt_random_uniform(random, 0.01, 0.1));
            p->force[6 * b + k] = k == 2 ? -9.81 * mass : 0.3 * mass * kt_random_uniform(random, -1.0, 1.0);
        }
    }
    for (int i = 0; i < p->n; i++) {
        double frame[3][3];
        const int body = i < bodies ? i : kt_random_int(random, 0, bodies - 1),
                  other = kt_random_int(random, 0, BODIES);
        draw_frame(random, any, frame);
        add_side(p, i, body, 1.0, random, frame);
        if (other < body)
            add_side(p, i, other, -1.0, random, frame);
        p->mu[i] = kt_random_uniform(random, 0.1, 1.2);
    }
    find_delassus(p);
}

/* ---- the solver -------------------------------------------------------------------------------------------------- */

/* Solves with contacts in another order. factor: of all masses. Returns the margin. p: forces in the first order. */
static double solve_rest(const problem *p, const int *order, void *memory, double *force) {
    const int m = 3 * p->n;
    kt_statics *statics = kt_statics_init((size_t)m, (size_t)m, memory);
    for (int i = 0; i < p->n; i++) {
        const int of = order[i];
        (void)kt_statics_add(statics, KT_STATICS_CONE, p->mu[of], 0.0,
                             (p->W[3 * of][3 * of] + p->W[3 * of + 1][3 * of + 1] + p->W[3 * of + 2][3 * of + 2]) /
                                 3.0);
        for (int c = 0; c < 3; c++) {
            statics->p[3 * i + c] = -p->b[3 * of + c];
            for (int j = 0; j < m; j++)
                statics->matrix[(3 * i + c) * m + j] = p->W[3 * of + c][3 * order[j / 3] + j % 3];
        }
    }
    if (!kt_statics_begin_square(statics, true))
        return (double)NAN;
    kt_statics_find_margin(statics);
    kt_statics_find_least(statics);
    for (int i = 0; i < m; i++)
        force[3 * order[i / 3] + i % 3] = kt_statics_force(statics, i);
    return statics->margin;
}

/* |W p + b|, relative to the largest |b|. */
static double residual_of(const problem *p, const double *force) {
    double most = 0.0, largest = 0.0;
    for (int i = 0; i < 3 * p->n; i++) {
        double sum = p->b[i];
        for (int j = 0; j < 3 * p->n; j++)
            sum += p->W[i][j] * force[j];
        most = fmax(most, fabs(sum));
        largest = fmax(largest, fabs(p->b[i]));
    }
    return most / largest;
}

/* How far forces are outside of their cones, relative to the largest force. */
static double outside_of(const problem *p, const double *force) {
    double most = 0.0, largest = 0.0;
    for (int i = 0; i < p->n; i++) {
        most = fmax(most, hypot(force[3 * i + 1], force[3 * i + 2]) - p->mu[i] * force[3 * i]);
        largest = fmax(largest, fabs(force[3 * i]));
    }
    return most / largest;
}

/* ---- whether rest exists ----------------------------------------------------------------------------------------- */

/* The distance of c from A' K, with polygons in place of discs. widen: the polygons' corners, relative to the disc. */
static double distance_from_cone(const problem *p, double widen, squares *s) {
    s->m = DOFS;
    s->columns = 0;
    memcpy(s->c, p->c, sizeof s->c);
    for (int i = 0; i < p->n; i++)
        for (int e = 0; e < EDGES; e++) {
            const double angle = 2.0 * acos(-1.0) * e / EDGES, mu = widen * p->mu[i];
            double norm = 0.0;
            for (int k = 0; k < s->m; k++) {
                s->A[s->columns][k] =
                    p->A[3 * i][k] + mu * (cos(angle) * p->A[3 * i + 1][k] + sin(angle) * p->A[3 * i + 2][k]);
                norm += s->A[s->columns][k] * s->A[s->columns][k];
            }
            for (int k = 0; k < s->m; k++)
                s->A[s->columns][k] /= sqrt(norm);
            s->columns++;
        }
    return solve_squares(s);
}

/* Random loads: half of the contacts have forces in their cones, so that rest exists, or nearly exists. */
static void load_problem(kt_random *random, problem *p, double beyond) {
    double force[ROWS];
    for (int i = 0; i < p->n; i++) {
        const double angle = kt_random_uniform(random, 0.0, 6.283), part = kt_random_uniform(random, 0.0, beyond);
        force[3 * i] = kt_random_uniform(random, 0.0, 10.0);
        force[3 * i + 1] = part * p->mu[i] * force[3 * i] * cos(angle);
        force[3 * i + 2] = part * p->mu[i] * force[3 * i] * sin(angle);
    }
    for (int d = 0; d < DOFS; d++) {
        p->c[d] = 0.0;
        for (int i = 0; i < 3 * p->n; i++)
            p->c[d] += p->A[i][d] * force[i];
    }
    take_load(p);
}

static void count_up(int *order, int n) {
    for (int i = 0; i < n; i++)
        order[i] = i;
}

KT_TEST(rest_exists_where_polygons_inside_the_cones_have_it) {
    enum { PROBLEMS = 3000 };
    kt_random random = kt_random_of_test();
    KT_WORST residuals = kt_worst_make("W p + b"), cones = kt_worst_make("outside of cones");
    problem *p = malloc(sizeof *p);
    squares *s = malloc(sizeof *s);
    void *memory = aligned_alloc(KT_ARENA_ALIGNMENT, kt_statics_size(ROWS, ROWS));
    int inside = 0, beyond = 0, missed = 0, wrong = 0;
    for (int k = 0; k < PROBLEMS; k++) {
        double force[ROWS];
        int order[CONTACTS];
        draw_problem(&random, p);
        count_up(order, p->n);
        if (k % 4 > 0)
            load_problem(&random, p, k % 4 == 1 ? 1.0 : 1.6);
        const double margin = solve_rest(p, order, memory, force);
        const bool exists = margin >= -kt_statics_exact && residual_of(p, force) <= 1e-9;
        if (exists) {
            kt_worst_below(&residuals, residual_of(p, force), 1e-9, "problem %d", k);
            kt_worst_below(&cones, outside_of(p, force), 1e-8, "problem %d", k);
        }
        const bool is_inside = distance_from_cone(p, 1.0, s) < 1e-7;
        const bool is_outside = distance_from_cone(p, 1.0 / cos(acos(-1.0) / EDGES), s) > 1e-6;
        inside += is_inside;
        beyond += is_outside;
        missed += is_inside && !exists;
        wrong += is_outside && exists;
    }
    kt_note("rest in %d problems, none in %d, between the polygons %d", inside, beyond, PROBLEMS - inside - beyond);
    kt_check_above("with rest", inside, 0.2 * PROBLEMS);
    kt_check_above("without rest", beyond, 0.2 * PROBLEMS);
    kt_check_equal_int("missed", missed, 0);
    kt_check_equal_int("found without rest", wrong, 0);
    free(memory);
    free(s);
    free(p);
}

/* ---- which forces ------------------------------------------------------------------------------------------------ */

/* Projects x onto the cone |x_t| <= mu x_n. */
static void project_on_cone(double mu, double *x) {
    const double t = hypot(x[1], x[2]);
    if (t <= mu * x[0])
        return;
    const double n = mu * t <= -x[0] ? 0.0 : (x[0] + mu * t) / (1.0 + mu * mu);
    for (int k = 1; k < 3; k++)
        x[k] *= t > 0.0 ? mu * n / t : 0.0;
    x[0] = n;
}

/* Removes from x the part by which W x misses -b. basis: of the rows of W. */
static void project_on_balance(const problem *p, double (*basis)[ROWS], const double *first, int rank, double *x) {
    double to[ROWS] = {0.0};
    for (int r = 0; r < rank; r++) {
        double along = 0.0;
        for (int i = 0; i < 3 * p->n; i++)
            along += basis[r][i] * (first[i] - x[i]);
        for (int i = 0; i < 3 * p->n; i++)
            to[i] += along * basis[r][i];
    }
    for (int i = 0; i < 3 * p->n; i++)
        x[i] += to[i];
}

/* An orthonormal basis of the rows of the scaled W = A A', from the columns of A: nearly dependent rows of W have the
 * square of their remainder in A. Returns their number. */
static int basis_of_rows(const problem *p, const double *w, double (*basis)[ROWS]) {
    int rank = 0;
    for (int d = 0; d < DOFS && rank < 3 * p->n; d++) {
        double *z = basis[rank], norm = 0.0, own = 0.0;
        for (int j = 0; j < 3 * p->n; j++)
            z[j] = p->A[j][d] / w[j];
        for (int j = 0; j < 3 * p->n; j++)
            own += z[j] * z[j];
        for (int pass = 0; pass < 2; pass++)
            for (int r = 0; r < rank; r++) {
                double along = 0.0;
                for (int j = 0; j < 3 * p->n; j++)
                    along += basis[r][j] * z[j];
                for (int j = 0; j < 3 * p->n; j++)
                    z[j] -= along * basis[r][j];
            }
        for (int j = 0; j < 3 * p->n; j++)
            norm += z[j] * z[j];
        for (int j = 0; j < 3 * p->n; j++)
            z[j] /= sqrt(norm);
        rank += norm > 1e-16 * own;
    }
    return rank;
}

/* The least scaled forces by Dykstra's method, from scaled forces x that satisfy W x = -b. The method may stand still
 * for any number of steps before it converges. *apart: by how much forces in the cones then miss balance, relative to
 * x. */
static double least_by_projections(const problem *p, const double *w, double *x, double *apart) {
    static double basis[ROWS + 1][ROWS];
    double first[ROWS], shift[ROWS] = {0.0}, norm = 0.0;
    const int m = 3 * p->n, rank = basis_of_rows(p, w, basis);
    *apart = 0.0;
    memcpy(first, x, sizeof first);
    memset(x, 0, (size_t)m * sizeof *x);
    for (int k = 0; k < 20000; k++) {
        double before[ROWS];
        project_on_balance(p, basis, first, rank, x);
        for (int i = 0; i < m; i++)
            before[i] = x[i] += shift[i];
        for (int i = 0; i < p->n; i++)
            project_on_cone(p->mu[i], x + 3 * i);
        for (int i = 0; i < m; i++)
            shift[i] = before[i] - x[i];
    }
    memcpy(shift, x, sizeof shift);
    project_on_balance(p, basis, first, rank, x);
    for (int i = 0; i < m; i++) {
        norm += x[i] * x[i];
        *apart = fmax(*apart, fabs(x[i] - shift[i]));
    }
    *apart /= sqrt(norm);
    return sqrt(norm);
}

/* The forces are the least ones, in any order of contacts, and for all masses times a factor. */
KT_TEST(forces_of_rest_are_the_least_in_any_order_and_for_any_mass) {
    kt_random random = kt_random_of_test();
    KT_WORST least = kt_worst_make("norm"), turned = kt_worst_make("another order"), heavy = kt_worst_make("masses");
    problem *p = malloc(sizeof *p);
    void *memory = aligned_alloc(KT_ARENA_ALIGNMENT, kt_statics_size(ROWS, ROWS));
    int found = 0, shared = 0, stands = 0;
    for (int k = 0; found < 60; k++) {
        double force[ROWS], other[ROWS], scaled[ROWS], w[ROWS], norm = 0.0, most = 0.0, far = 0.0;
        int order[CONTACTS];
        draw_problem(&random, p);
        load_problem(&random, p, 1.0);
        count_up(order, p->n);
        if (!(solve_rest(p, order, memory, force) > 1e-3))
            continue;
        found++;
        for (int i = 0; i < 3 * p->n; i++) {
            const int at = i / 3 * 3;
            w[i] = sqrt((p->W[at][at] + p->W[at + 1][at + 1] + p->W[at + 2][at + 2]) / 3.0);
            scaled[i] = force[i] * w[i];
            norm += scaled[i] * scaled[i];
            most = fmax(most, fabs(force[i]));
        }
        double apart;
        const double theirs = least_by_projections(p, w, scaled, &apart);
        stands += !(apart <= 1e-6);
        if (apart <= 1e-6)
            kt_worst_near(&least, sqrt(norm), theirs, 1e-5 * sqrt(norm), "problem %d", k);
        for (int i = 0; i < p->n; i++)
            order[i] = p->n - 1 - i;
        (void)solve_rest(p, order, memory, other);
        for (int i = 0; i < 3 * p->n; i++)
            far = fmax(far, fabs(other[i] - force[i]) / most);
        kt_worst_below(&turned, far, 1e-5, "problem %d", k);
        const double factor = pow(10.0, kt_random_uniform(&random, -6.0, 6.0));
        for (int i = 0; i < ROWS; i++)
            for (int j = 0; j < ROWS; j++)
                p->W[i][j] /= factor;
        (void)solve_rest(p, order, memory, other);
        far = 0.0;
        for (int i = 0; i < 3 * p->n; i++)
            far = fmax(far, fabs(other[i] / factor - force[i]) / most);
        kt_worst_below(&heavy, far, 1e-5, "problem %d, masses times %.3g", k, factor);
        shared += p->n > 2;
    }
    kt_check_above("problems whose forces are shared", shared, 20.0);
    kt_check_below("problems whose projections stand still", stands, 3.0);
    free(memory);
    free(p);
}

/* A joint that other loops hold has the metric 0, or a rounding error below it. */
KT_TEST(an_item_that_no_force_moves_counts_with_the_weight_1) {
    static _Alignas(64) char memory[1 << 12];
    for (int k = 0; k < 2; k++) {
        kt_statics *statics = kt_statics_init(1, 1, memory);
        (void)kt_statics_add(statics, KT_STATICS_DRY, 2.0, 0.0, k == 0 ? 0.0 : -1e-18);
        statics->p[0] = 1.5;
        statics->matrix[0] = 1.0;
        kt_statics_begin(statics);
        kt_statics_find_margin(statics);
        kt_check_below("force, N m, error", fabs(kt_statics_force(statics, 0) - 1.5), 1e-15);
        kt_check_below("margin, error", fabs(statics->margin - kt_statics_cap),
                       1e-15); /* the reserve is 0.33 of the force */
    }
}

/* Expansion behind an impact begins at rest: no load, and a least impulse. Zero impulse is below it, for any mass. */
KT_TEST(least_forces_without_a_load_forbid_rest) {
    static _Alignas(64) char memory[1 << 12];
    static const double mass[] = {0x1p-40, 1.0, 0x1p40};
    for (int k = 0; k < 3; k++) {
        kt_statics *statics = kt_statics_init(3, 3, memory);
        (void)kt_statics_add(statics, KT_STATICS_CONE, 0.5, 1e-3 * mass[k], 1.0 / mass[k]);
        for (int i = 0; i < 9; i++)
            statics->matrix[i] = i % 4 == 0 ? 1.0 / mass[k] : 0.0;
        memset(statics->p, 0, 3 * sizeof *statics->p);
        kt_check_true("begins", kt_statics_begin_square(statics, true));
        kt_statics_find_margin(statics);
        kt_check_near("margin, relative to the least impulse", statics->margin, -1.0, 1e-15);
    }
}
