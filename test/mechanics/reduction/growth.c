/* Mechanisms in which successive substitutions could multiply rounding errors. In rows of windows, each crank turns
 * three times as fast as the one before. Ropes have heavy links on light ones. The reference is the elimination of [M
 * A'; A 0] in long double. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/simulation.h"

#include "derivative/kkt.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WINDOWS = 20, BARS = 40, COORDINATES = 64, ROWS = 5 * WINDOWS, MOST = 2 * COORDINATES };

/* ---- the reference ----------------------------------------------------------------------------------------------- */

/* The matrices of a state: M (nv x nv), A (rows x nv), b'' and f = tau - h. Further, independent rows of A, and the
 * inverse of [M A'; A 0] with these rows. */
typedef struct matrices {
    int nv, rows, rank, chosen[COORDINATES];
    double mass[COORDINATES * COORDINATES], jacobian[ROWS * COORDINATES], force[COORDINATES], drift[ROWS];
    long double whole[MOST * MOST], inverse[MOST * MOST];
} matrices;

/* A solution, and how far one unit of eps in the matrices and in the right-hand sides moves it. */
typedef struct solution {
    double x[MOST], moved[MOST];
} solution;

/* Gram and Schmidt with pivots. */
static void choose_rows(matrices *m) {
    static long double a[ROWS][COORDINATES];
    bool taken[ROWS] = {false};
    long double first = 0.0L;
    for (int r = 0; r < m->rows; r++)
        for (int i = 0; i < m->nv; i++)
            a[r][i] = (long double)m->jacobian[i * m->rows + r];
    for (m->rank = 0; m->rank < m->nv; m->rank++) {
        int best = -1;
        long double most = 0.0L;
        for (int r = 0; r < m->rows; r++) {
            long double square = 0.0L;
            for (int i = 0; i < m->nv; i++)
                square += a[r][i] * a[r][i];
            if (!taken[r] && square > most) {
                most = square;
                best = r;
            }
        }
        first = m->rank ? first : most;
        if (best < 0 || most < 1e-22L * first)
            return;
        taken[best] = true;
        m->chosen[m->rank] = best;
        for (int r = 0; r < m->rows; r++) {
            long double dot = 0.0L;
            for (int i = 0; i < m->nv && !taken[r]; i++)
                dot += a[r][i] * a[best][i];
            for (int i = 0; i < m->nv && !taken[r]; i++)
                a[r][i] -= dot / most * a[best][i];
        }
    }
}

static void swap_rows(long double *a, int n, int i, int j) {
    for (int c = 0; c < n; c++) {
        const long double x = a[i * n + c];
        a[i * n + c] = a[j * n + c];
        a[j * n + c] = x;
    }
}

/* Gauss and Jordan with row pivots. */
static void invert(const long double *of, int n, long double *inverse) {
    static long double a[MOST * MOST];
    memcpy(a, of, (size_t)(n * n) * sizeof *a);
    for (int i = 0; i < n * n; i++)
        inverse[i] = i % (n + 1) ? 0.0L : 1.0L;
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j; i < n; i++)
            best = fabsl(a[i * n + j]) > fabsl(a[best * n + j]) ? i : best;
        swap_rows(a, n, j, best);
        swap_rows(inverse, n, j, best);
        for (int i = 0; i < n; i++) {
            const long double factor = a[i * n + j] / a[j * n + j];
            for (int c = 0; c < n && i != j && factor != 0.0L; c++) {
                a[i * n + c] -= factor * a[j * n + c];
                inverse[i * n + c] -= factor * inverse[j * n + c];
            }
        }
    }
    for (int i = 0; i < n; i++)
        for (int c = 0; c < n; c++)
            inverse[i * n + c] /= a[i * n + i];
}

static void find_matrices(const linkage *l, const double *tau, matrices *m) {
    kt_error e = {0};
    m->nv = l->nv;
    m->rows = l->rows;
    kt_need_fine("mass", kt_dynamics_mass(l->model, l->data, l->q, m->mass, &e), &e);
    kt_need_fine("bias", kt_dynamics_inverse(l->model, l->data, l->q, l->v, NULL, NULL, m->force, &e), &e);
    kt_need_fine("equations",
                 kt_loop_equations(l->model, l->data, 0.0, l->q, l->v, m->jacobian, NULL, NULL, m->drift, &e), &e);
    for (int i = 0; i < m->nv; i++)
        m->force[i] = tau[i] - m->force[i];
    choose_rows(m);
    const int n = m->nv + m->rank;
    memset(m->whole, 0, sizeof m->whole);
    for (int i = 0; i < m->nv; i++) {
        for (int j = 0; j < m->nv; j++)
            m->whole[i * n + j] = (long double)m->mass[j * m->nv + i];
        for (int r = 0; r < m->rank; r++)
            m->whole[i * n + m->nv + r] = m->whole[(m->nv + r) * n + i] =
                (long double)m->jacobian[i * m->rows + m->chosen[r]];
    }
    invert(m->whole, n, m->inverse);
}

/* Solves [M A'; A 0] (x, -lambda) = (f, b) with refinement. The error bound is `|dx| <= eps |inverse| (|matrix| |x| +
 * |right|)`. Its last bracket is the largest among forces and among equations. */
static void solve(const matrices *m, const double *f, const double *b, solution *s) {
    const int n = m->nv + m->rank;
    long double x[MOST] = {0.0L}, left[MOST], most[2] = {0.0L, 0.0L};
    for (int round = 0; round < 4; round++) {
        for (int i = 0; i < n; i++) {
            left[i] = (long double)(i < m->nv ? f[i] : b[m->chosen[i - m->nv]]);
            long double terms = fabsl(left[i]);
            for (int j = 0; j < n; j++) {
                left[i] -= m->whole[i * n + j] * x[j];
                terms += fabsl(m->whole[i * n + j] * x[j]);
            }
            most[i >= m->nv] = round < 3 ? 0.0L : fmaxl(most[i >= m->nv], terms);
        }
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                x[i] += m->inverse[i * n + j] * left[j];
    }
    for (int i = 0; i < n; i++) {
        long double sum = 0.0L;
        for (int j = 0; j < n; j++)
            sum += fabsl(m->inverse[i * n + j]) * most[j >= m->nv];
        s->x[i] = (double)x[i];
        s->moved[i] = DBL_EPSILON * (double)sum;
    }
}

/* ---- what is compared -------------------------------------------------------------------------------------------- */

typedef struct errors {
    kt_worst acceleration, equation, force, kkt, position, velocity;
} errors;

static errors begin(void) {
    return (errors){kt_worst_make("accelerations"),       kt_worst_make("equations of accelerations"),
                    kt_worst_make("forces of loops"),     kt_worst_make("with any right-hand side"),
                    kt_worst_make("projected positions"), kt_worst_make("projected velocities")};
}

static void conclude(const errors *e) {
    kt_check_worst(&e->acceleration);
    kt_check_worst(&e->equation);
    kt_check_worst(&e->force);
    kt_check_worst(&e->kkt);
    kt_check_worst(&e->position);
    kt_check_worst(&e->velocity);
}

/* Compares accelerations with the exact ones. A a = b holds up to the rounding of orthogonal factors, 16 eps |row|
 * max|a|, or 256 times for few equations. Measured of seven seeds: 6 and 40. A' lambda is unique even if equations
 * depend on each other. */
static void compare_accelerations(const linkage *l, const double *tau, const matrices *m, const char *of, errors *e) {
    static solution exact;
    double a[COORDINATES], lambda[ROWS], fastest = 0.0;
    kt_error error = {0};
    kt_need_fine("moves", kt_acceleration_evaluate(l->model, l->data, 0.0, l->q, l->v, tau, NULL, a, &error), &error);
    kt_need_fine("reacts", kt_multiplier_evaluate(l->model, l->data, 0.0, l->q, l->v, tau, NULL, lambda, &error),
                 &error);
    const double eps = (l->model->group[0].form == KT_FORM_DELASSUS ? 256.0 : 16.0) * DBL_EPSILON;
    solve(m, m->force, m->drift, &exact);
    for (int i = 0; i < m->nv; i++) {
        kt_worst_near(&e->acceleration, a[i], exact.x[i], 4.0 * exact.moved[i], "%s, %d", of, i);
        fastest = fmax(fastest, fabs(exact.x[i]));
    }
    for (int r = 0; r < m->rows; r++) {
        long double left = -(long double)m->drift[r];
        double size = 0.0;
        for (int i = 0; i < m->nv; i++) {
            left += (long double)m->jacobian[i * m->rows + r] * (long double)a[i];
            size = hypot(size, m->jacobian[i * m->rows + r]);
        }
        kt_worst_below(&e->equation, (double)fabsl(left), eps * size * fastest, "%s, %d", of, r);
    }
    for (int i = 0; i < m->nv; i++) {
        double force = 0.0, expected = 0.0, moved = 0.0;
        for (int r = 0; r < m->rows; r++)
            force += m->jacobian[i * m->rows + r] * lambda[r];
        for (int r = 0; r < m->rank; r++) {
            const double arm = m->jacobian[i * m->rows + m->chosen[r]];
            expected -= arm * exact.x[m->nv + r];
            moved += fabs(arm) * exact.moved[m->nv + r];
        }
        kt_worst_near(&e->force, force, expected, 4.0 * moved, "%s, %d", of, i);
    }
}

/* Dense groups' maps are matrices, which mix all coordinates: their errors are those of the largest. */
static void compare_saddle(const linkage *l, const matrices *m, const char *of, kt_random *random, errors *e) {
    static solution exact;
    double f[COORDINATES], b[ROWS], most = 0.0;
    const size_t size = kt_kkt_init(NULL, NULL, l->model, NULL);
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_kkt w;
    kt_error error = {0};
    memset(b, 0, sizeof b);
    for (int i = 0; i < m->nv; i++) {
        const double x = kt_random_uniform(random, -1.0, 1.0);
        f[i] = kt_random_uniform(random, -1.0, 1.0);
        for (int r = 0; r < m->rows; r++)
            b[r] += m->jacobian[i * m->rows + r] * x;
    }
    solve(m, f, b, &exact);
    for (int i = 0; i < m->nv; i++)
        most = fmax(most, exact.moved[i]);
    (void)kt_kkt_init(&w, memory, l->model, l->data);
    kt_need_fine("factors", kt_kkt_factor(&w, KT_ROWS_ALL, KT_METRIC_MASS, 0.0, l->q, &error), &error);
    kt_kkt_solve(&w, 1, f, b);
    for (int i = 0; i < m->nv; i++)
        kt_worst_near(&e->kkt, f[i], exact.x[i], 4.0 * (l->model->group[0].has_fronts ? exact.moved[i] : most),
                      "%s, %d", of, i);
    free(memory);
}

/* From 1e-5 away, for lengths of `size`. */
static void compare_projection(const linkage *l, double size, const char *of, errors *e) {
    double q[2 * COORDINATES];
    kt_residual left = {(double)NAN, (double)NAN};
    kt_error error = {0};
    for (int i = 0; i < l->nv; i++) {
        q[i] = l->q[i] + 1e-5 * (7 * i % 5 - 2);
        q[l->nq + i] = l->v[i] + 1e-5 * (7 * i % 5 - 2);
    }
    (void)(kt_fine("projects", kt_state_project(l->model, l->data, 0.0, q, q + l->nq, NULL, &error), &error) &&
           kt_fine("is left", kt_loop_residual(l->model, l->data, 0.0, q, q + l->nq, &left, &error), &error));
    kt_worst_below(&e->position, left.position, 4.0 * DBL_EPSILON * size, "%s", of);
    kt_worst_below(&e->velocity, left.velocity, 4.0 * DBL_EPSILON * size, "%s", of);
}

/* Moves the mechanism in its freedoms, 1 rad/s at most, and compares. */
static void compare(linkage *l, double size, const char *of, kt_random *random, errors *e) {
    static double basis[COORDINATES * COORDINATES];
    static matrices m;
    double tau[COORDINATES], fastest = 0.0;
    int columns = 0;
    kt_error error = {0};
    kt_need_fine("moves freely", kt_loop_nullspace(l->model, l->data, 0.0, l->q, basis, &columns, &error), &error);
    for (int i = 0; i < l->nv; i++) {
        l->v[i] = 0.0;
        for (int c = 0; c < columns; c++)
            l->v[i] += (1.0 + 0.3 * c) * basis[c * l->nv + i];
        fastest = fmax(fastest, fabs(l->v[i]));
        tau[i] = kt_random_uniform(random, -10.0, 10.0);
    }
    for (int i = 0; i < l->nv; i++)
        l->v[i] /= fastest;
    find_matrices(l, tau, &m);
    compare_accelerations(l, tau, &m, of, e);
    compare_saddle(l, &m, of, random, e);
    compare_projection(l, size, of, e);
}

/* ---- rows of windows --------------------------------------------------------------------------------------------- */

typedef enum course { RISING, FALLING, ALTERNATING, HUMP, VALLEY, COURSES } course;
static const char *const course_name[] = {"rising", "falling", "alternating", "hump", "valley"};

static double gain_of(course c, int i) {
    const bool up = c == RISING || (c == ALTERNATING && i % 2 == 0) || (c == HUMP && i < WINDOWS / 2) ||
                    (c == VALLEY && i >= WINDOWS / 2);
    return up ? 3.0 : 1.0 / 3.0;
}

typedef struct row_kind {
    const char *name;
    kt_plan plan;
    bool carried; /* by a body that turns */
    int loose;    /* each so many windows are closed by a rod, which leaves one more freedom */
    double heavy; /* cranks' masses vary from 10^-heavy to 10^heavy */
} row_kind;

static void scale_mass(kt_body *b, double by) {
    const kt_sym3 j = b->inertia;
    b->mass *= by;
    b->inertia = kt_sym3_make(by * j.xx, by * j.yy, by * j.zz, by * j.xy, by * j.xz, by * j.yz);
}

/* Adds a coupler from `tip` on the last body, `at` in the world, to the next crank's, and the loop that closes the
 * window. */
static void add_coupler(linkage *l, int i, bool loose, kt_vec3 tip, kt_vec3 d, double turn) {
    const int last = l->description.body_count - 1;
    const double length = kt_vec3_norm(d);
    char name[16];
    (void)snprintf(name, sizeof name, "coupler%d", i);
    linkage_bar(l, name, l->body_name[last], tip, kt_vec3_make(loose ? 0.7 * length : length, 0.0, 0.0),
                atan2(d.y, d.x) - turn, 0.0);
}

/* A crank has one arm for either coupler; that of the next is so many times longer. */
static void build_row(linkage *l, course c, const row_kind *kind, kt_structure structure, kt_random *random) {
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
    kt_vec3 at = none, tip = none;
    double turn = 0.0;
    char name[16];
    linkage_begin(l);
    l->options.structure = structure;
    l->options.plan = kind->plan;
    if (kind->carried)
        linkage_bar(l, "base", NULL, none, kt_vec3_make(5.0, 0.3, 0.0), 0.2, 0.1);
    for (int i = 0; i <= WINDOWS; i++) {
        const double lean = kt_random_uniform(random, -0.3, 0.3), in = kt_random_uniform(random, 0.8, 1.2);
        const double out = in * gain_of(c, i);
        const bool loose = kind->loose && i % kind->loose == 0;
        const kt_vec3 pivot = kt_vec3_make(5.0 * i, 0.0, 0.0), up = kt_vec3_make(-sin(lean), cos(lean), 0.0);
        const kt_vec3 d = kt_vec3_sub(kt_vec3_add(pivot, kt_vec3_scale(in, up)), at);
        if (i)
            add_coupler(l, i, loose, tip, d, turn);
        (void)snprintf(name, sizeof name, "crank%d", i);
        scale_mass(linkage_bar(l, name, kind->carried ? "base" : NULL, pivot, kt_vec3_make(0.0, in, 0.0), lean, 0.0),
                   pow(10.0, kt_random_uniform(random, -kind->heavy, kind->heavy)));
        const int own = l->description.body_count - 1;
        if (i)
            linkage_close(l, name, loose ? KT_LOOP_DISTANCE : KT_LOOP_REVOLUTE, l->body_name[own - 1],
                          kt_vec3_scale(2.0, l->body[own - 1].com), l->body_name[own], kt_vec3_make(0.0, in, 0.0))
                ->function = kt_function_constant(0.3 * kt_vec3_norm(d));
        tip = kt_vec3_make(0.0, out, 0.0);
        at = kt_vec3_add(pivot, kt_vec3_scale(out, up));
        turn = lean;
    }
    linkage_compile(l);
}

/* Fronts change their parameters by orthogonal factors alone until they are minimised out. Nothing grows, for any gains
 * and their order. Errors are those of the matrices' own rounding (in a valley 1e-11 by its condition), for fronts and
 * dense matrices alike. */
KT_TEST(gains_of_windows_multiply_no_error) {
    static const row_kind kinds[] = {{.name = "narrow"},
                                     {.name = "in space", .plan = KT_PLAN_SPATIAL},
                                     {.name = "carried", .carried = true},
                                     {.name = "loose", .loose = 2, .heavy = 1.0},
                                     {.name = "carried, of many masses", .carried = true, .heavy = 3.0}};
    static linkage l;
    kt_random random = kt_random_of_test();
    errors fronts = begin(), dense = begin();
    int narrow = 0;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        for (course c = RISING; c < COURSES; c++) {
            const kt_random same = random;
            for (int d = 0; d < 2; d++) {
                char of[48];
                random = same;
                (void)snprintf(of, sizeof of, "%s, %s", kinds[k].name, course_name[c]);
                build_row(&l, c, &kinds[k], d ? KT_STRUCTURE_DENSE : KT_STRUCTURE_FRONTS, &random);
                narrow += l.model->group[0].form == KT_FORM_FRONT4;
                compare(&l, 5.0 * WINDOWS, of, &random, d ? &dense : &fronts);
            }
        }
    kt_check_equal_int("narrow", narrow, COURSES);
    kt_note("fronts");
    conclude(&fronts);
    kt_note("dense matrices");
    conclude(&dense);
}

/* ---- ropes ------------------------------------------------------------------------------------------------------- */

/* Bars held at both ends, every second one `heavy` times as heavy as the others. */
static void build_rope(linkage *l, double heavy, kt_plan plan, kt_random *random) {
    double last = 0.0;
    kt_vec3 end = kt_vec3_make(0.0, 0.0, 0.0);
    char name[16];
    linkage_begin(l);
    l->options.structure = KT_STRUCTURE_FRONTS;
    l->options.plan = plan;
    for (int i = 0; i < BARS; i++) {
        const double angle = -1.0 + 2.0 * i / BARS + kt_random_uniform(random, -0.1, 0.1);
        (void)snprintf(name, sizeof name, "bar%d", i);
        scale_mass(linkage_bar(l, name, i ? l->body_name[i - 1] : NULL, kt_vec3_make(i ? 1.0 : 0.0, 0.0, 0.0),
                               kt_vec3_make(1.0, 0.0, 0.0), angle - last, 0.0),
                   i % 2 ? 1.0 : heavy);
        end = kt_vec3_add(end, kt_vec3_make(cos(angle), sin(angle), 0.0));
        last = angle;
    }
    linkage_close(l, "end", KT_LOOP_SPHERICAL, NULL, end, l->body_name[BARS - 1], kt_vec3_make(1.0, 0.0, 0.0));
    linkage_compile(l);
}

/* Whether the plan reports that a group is left to the fronts for its digits. */
static bool is_told(const kt_model *model) {
    kt_plan_step step[KT_PLAN_STEPS_MAX];
    const kt_run run = kt_run_default();
    const int count = kt_plan_steps(model, &run, step);
    bool told = false;
    for (int i = 0; i < count; i++)
        told = told || (step[i].dropped && strstr(step[i].dropped, "lose digits"));
    return told;
}

/* Ropes solved by their few equations had large errors if heavy links had a mass of 1e6 or 1e9. Accelerations were off
 * by 7e-12 and 6e-9, respectively. Forces in the ropes were off by 3e-9 and 2e-6. These ropes are left to the
 * fronts. */
KT_TEST(ropes_of_heavy_links_on_light_ones_are_left_to_the_fronts) {
    static linkage l;
    kt_random random = kt_random_of_test();
    errors e = begin();
    int wrong = 0;
    for (int k = 0; k < 8; k++) {
        const double heavy = pow(1e3, k % 4);
        char of[48];
        (void)snprintf(of, sizeof of, "masses 1 and %g, %s", heavy, k < 4 ? "in a plane" : "in space");
        build_rope(&l, heavy, k < 4 ? KT_PLAN_AUTO : KT_PLAN_SPATIAL, &random);
        wrong += (l.model->group[0].form == KT_FORM_DELASSUS) != (k % 4 < 2) || is_told(l.model) != (k % 4 >= 2);
        compare(&l, BARS, of, &random, &e);
    }
    kt_check_equal_int("not of few equations, or not told so, where they should be", wrong, 0);
    conclude(&e);
}
