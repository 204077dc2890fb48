/* Kinetree and MuJoCo, in turns, in one run, on the same mechanisms. These are chains of n links, 100 such links as a
 * tree in which each carries two, and the bundled human figure. The last one requires a build that reads scenes. The
 * comparisons are
 *
 *   forward dynamics    ABA against kinematics, comPos, crb, factorM, comVel, rne, solveM
 *   inverse dynamics    RNEA against kinematics, comPos, comVel, rne
 *   the mass matrix     CRBA, the whole matrix, against kinematics, comPos, crb, fullM
 *   its factors L'DL    against factorM
 *   a solution by them  against solveM
 *
 * A line is trusted if the two results agree to (4 + n) eps:
 *
 *   tau    torques for the same accelerations,             max |tau' - tau| / max |h|
 *   back   torques, by RNEA, of MuJoCo's accelerations:    max |RNEA(a') - tau| / max |h|
 *   M      the mass matrix,                                max |M' - M| / max |M|
 *   Mx     M x' of MuJoCo's solution of M x = tau:         max |M x' - tau| / max_i sum_j |M_ij x'_j|
 *
 * Here h is the bias force or 1. Rounding errors of n links add up along the chain. For chains of 32 links, 6e-16 and
 * 1.5e-15 were measured. The difference of the accelerations themselves, max |a' - a| / max |a|, is shown. It is larger
 * than eps by the condition of the mass matrix.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco.h"
#include "report.h"

#ifdef KT_SCENES
#include "kinetree/scene.h"
#endif

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINES_MAX = 40, BOUND_AT = 32, LONG = 100 };

enum { ABA, RNEA, CRBA, FACTOR, SOLVE, PAIRS };
static const char *const own_names[PAIRS] = {"ABA", "RNEA", "CRBA", "factors", "solution"};
static const char *const peer_names[PAIRS] = {"MuJoCo forward", "MuJoCo inverse", "MuJoCo mass", "MuJoCo factors",
                                              "MuJoCo solution"};

/* Bounds of the cost at n = BOUND_AT, as a part of MuJoCo's time for the same task. For the mass matrix the bound
 * applies at n = LONG, too. */
static const double most[PAIRS] = {0.18, 0.125, 0.2, 0.5, 0.4};

/* The bound of inverse dynamics of the human figure. */
static const double figure_most = 0.145;

typedef struct line {
    const char *tree;
    int n;
    kt_isa isa;
    kt_bench_times own[PAIRS], peer[PAIRS];
    kt_bench_ratio ratio[PAIRS];
    double a, tau, back, mass, product; /* differences, see above */
} line;

static const char about[] = "Times kinetree and MuJoCo in turns, for chains of 1 to --max links, a tree of 100\n"
                            "and a human figure.\n";

static const char columns[] =
    "n,tree,call," KT_CSV_TIMES ",ratio_low,ratio_median,ratio_high,"
    "difference_a,difference_tau,difference_back,difference_mass,difference_product," KT_CSV_ORIGIN;

/* ---- measuring --------------------------------------------------------------------------------------------------- */

static double largest(const double *x, size_t n) {
    double most_of = 0.0;
    for (size_t i = 0; i < n; i++)
        most_of = fmax(most_of, fabs(x[i]));
    return most_of;
}

/* max |M x - tau| over the largest sum of the terms of an entry. */
static double product_difference(const double *mass, const double *x, const double *tau, size_t n) {
    double difference = 0.0, scale = 0.0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0.0, size = 0.0;
        for (size_t j = 0; j < n; j++) {
            sum += mass[j * n + i] * x[j];
            size += fabs(mass[j * n + i] * x[j]);
        }
        if (!isfinite(sum))
            return (double)NAN;
        difference = fmax(difference, fabs(sum - tau[i]));
        scale = fmax(scale, size);
    }
    return difference / scale;
}

/* Runs each call once, and compares; bias and back: n numbers each. */
static kt_status compare(kt_chain *c, kt_mujoco *twin, double *bias, double *back, line *out, kt_error *error) {
    const size_t n = (size_t)c->n;
    kt_status status = kt_dynamics_inverse(c->model, c->data, c->q, c->v, NULL, NULL, bias, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < n; i++)
        bias[i] = fmax(fabs(bias[i]), 1.0);
    kt_chain_forward(c, 1);
    kt_chain_inverse(c, 1);
    kt_chain_mass(c, 1);
    kt_chain_factor(c, 1);
    kt_chain_solve(c, 1);
    if (c->error.code != KT_OK) {
        *error = c->error;
        return c->error.code;
    }
    kt_mujoco_inverse(twin, 1);
    kt_mujoco_forward(twin, 1);
    status = kt_dynamics_inverse(c->model, c->data, c->q, c->v, twin->a, NULL, back, error);
    if (status != KT_OK)
        return status;
    out->a = kt_chain_difference(twin->a, c->a, c->a, c->n);
    out->tau = kt_chain_difference(twin->torque, c->torque, bias, c->n);
    out->back = kt_chain_difference(back, c->tau, bias, c->n);
    kt_mujoco_mass(twin, 1);
    kt_mujoco_factor(twin, 1);
    kt_mujoco_solve(twin, 1);
    out->mass = 0.0;
    for (size_t k = 0; k < n * n; k++)
        out->mass = isfinite(twin->mass[k]) ? fmax(out->mass, fabs(twin->mass[k] - c->mass[k])) : (double)INFINITY;
    out->mass /= largest(c->mass, n * n);
    out->product = fmax(product_difference(c->mass, twin->a, c->tau, n), product_difference(c->mass, c->x, c->tau, n));
    return KT_OK;
}

static void measure_times(kt_chain *chain, kt_mujoco *twin, double seconds, line *out) {
    const kt_bench_task tasks[2 * PAIRS] = {
        {kt_chain_forward, chain}, {kt_mujoco_forward, twin}, {kt_chain_inverse, chain}, {kt_mujoco_inverse, twin},
        {kt_chain_mass, chain},    {kt_mujoco_mass, twin},    {kt_chain_factor, chain},  {kt_mujoco_factor, twin},
        {kt_chain_solve, chain},   {kt_mujoco_solve, twin}};
    static kt_bench_times times[2 * PAIRS];
    kt_bench_measure(tasks, 2 * PAIRS, seconds, times);
    for (int i = 0; i < PAIRS; i++) {
        out->own[i] = times[2 * i];
        out->peer[i] = times[2 * i + 1];
        out->ratio[i] = kt_bench_compare(&out->own[i], &out->peer[i]);
    }
}

static kt_status measure(const char *tree, const kt_description *description, const kt_bench_options *options,
                         line *out, kt_error *error) {
    kt_chain chain;
    kt_mujoco twin;
    kt_status status = kt_chain_of(description, options->isa, true, &chain, error);
    if (status != KT_OK)
        return status;
    status = kt_mujoco_make(description, &chain, &twin, error);
    if (status == KT_OK) {
        double *numbers = calloc(2 * (size_t)chain.n, sizeof *numbers);
        *out = (line){.tree = tree, .n = chain.n, .isa = kt_model_isa(chain.model)};
        if (!numbers)
            status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory to compare %d links", chain.n);
        else
            status = compare(&chain, &twin, numbers, numbers + chain.n, out, error);
        if (status == KT_OK)
            measure_times(&chain, &twin, options->seconds, out);
        free(numbers);
        kt_mujoco_free(&twin);
    }
    kt_chain_free(&chain);
    return status;
}

static bool is_trusted(const line *l) {
    const double bound = (4.0 + l->n) * DBL_EPSILON;
    return l->tau <= bound && l->back <= bound && l->mass <= bound && l->product <= bound;
}

/* ---- the tables -------------------------------------------------------------------------------------------------- */

static void print_heading(kt_isa isa, const char *csv) {
    char title[80];
    (void)snprintf(title, sizeof title, "Kinetree and MuJoCo %s on trees of n coordinates", kt_mujoco_version());
    kt_bench_heading(title, isa, csv);
    printf("us a call (lower quartile of the rounds); their ratio round by round: median [quartiles]; differences.\n\n"
           "%5s %-9s |%9s%10s%8s %-15s |%9s%10s%8s %-15s |%8s%9s%9s\n",
           "n", "", "ABA", "MuJoCo", "ratio", "", "RNEA", "MuJoCo", "ratio", "", "a", "tau", "back");
}

static void print_pairs(const line *l, int first, int end) {
    printf("%5d %-9s", l->n, l->tree);
    for (int i = first; i < end; i++)
        printf(" |%9.4g%10.4g%8.4f [%.4f %.4f]", 1e6 * l->own[i].low, 1e6 * l->peer[i].low, l->ratio[i].median,
               l->ratio[i].low, l->ratio[i].high);
}

static void print_line(const line *l) {
    print_pairs(l, ABA, CRBA);
    printf(" |%8.1e%9.1e%9.1e%s\n", l->a, l->tau, l->back, is_trusted(l) ? "" : "  THE TWO DISAGREE");
    (void)fflush(stdout);
}

static void print_mass(const line *lines, int count) {
    printf("\n%5s %-9s |%9s%10s%8s %-15s |%9s%10s%8s %-15s |%9s%10s%8s %-15s |%8s%9s\n", "n", "", "CRBA", "MuJoCo",
           "ratio", "", "factors", "MuJoCo", "ratio", "", "solution", "MuJoCo", "ratio", "", "M", "Mx");
    for (int i = 0; i < count; i++) {
        print_pairs(&lines[i], CRBA, PAIRS);
        printf(" |%8.1e%9.1e%s\n", lines[i].mass, lines[i].product, is_trusted(&lines[i]) ? "" : "  THE TWO DISAGREE");
    }
}

static void write_call(kt_csv *csv, const line *l, const char *call, const kt_bench_times *times,
                       kt_bench_ratio ratio) {
    const double numbers[] = {ratio.low, ratio.median, ratio.high, l->a, l->tau, l->back, l->mass, l->product};
    kt_csv_number(csv, l->n);
    kt_csv_text(csv, l->tree);
    kt_csv_text(csv, call);
    kt_csv_times(csv, times);
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        kt_csv_number(csv, numbers[k]);
    kt_csv_origin(csv, l->isa);
    kt_csv_line(csv);
}

static void write_line(kt_csv *csv, const line *l) {
    for (int i = 0; i < PAIRS; i++) {
        write_call(csv, l, own_names[i], &l->own[i], l->ratio[i]);
        write_call(csv, l, peer_names[i], &l->peer[i], (kt_bench_ratio){1.0, 1.0, 1.0});
    }
}

static bool conclude_pair(const line *l, int pair, double bound) {
    const bool holds = l->ratio[pair].median <= bound;
    printf("n = %d, %s: %s costs %.3f of MuJoCo's time, bound %.3f: %s\n", l->n, l->tree, own_names[pair],
           l->ratio[pair].median, bound, holds ? "holds" : "MISSED");
    return holds;
}

/* The last lines; whether all bounds hold. */
static bool conclude(const line *lines, int count) {
    bool holds = true, found = false;
    printf("\n");
    for (int i = 0; i < count; i++) {
        const bool chain = strcmp(lines[i].tree, "chain") == 0;
        for (int pair = 0; chain && lines[i].n == BOUND_AT && pair < PAIRS; pair++) {
            holds &= conclude_pair(&lines[i], pair, most[pair]);
            found = true;
        }
        if (chain && lines[i].n == LONG)
            holds &= conclude_pair(&lines[i], CRBA, most[CRBA]);
        if (strcmp(lines[i].tree, "humanoid") == 0)
            holds &= conclude_pair(&lines[i], RNEA, figure_most);
    }
    if (!found)
        printf("n = %d, where the bounds are set, was not measured\n", BOUND_AT);
    return holds && found;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

typedef struct table {
    const kt_bench_options *options;
    line *lines;
    int count;
    kt_csv *csv;
    bool trusted;
} table;

static kt_status add_line(table *t, const char *tree, const kt_description *description, kt_error *error) {
    line *l = &t->lines[t->count];
    const kt_status status = measure(tree, description, t->options, l, error);
    if (status != KT_OK)
        return status;
    if (t->count++ == 0)
        print_heading(l->isa, t->options->csv);
    print_line(l);
    write_line(t->csv, l);
    t->trusted &= is_trusted(l);
    return KT_OK;
}

static kt_status add_links(table *t, int n, int arity, kt_error *error) {
    kt_chain_description d;
    kt_status status = kt_chain_describe(n, arity, &d, error);
    if (status != KT_OK)
        return status;
    status = add_line(t, arity == 1 ? "chain" : "tree", &d.description, error);
    kt_chain_describe_free(&d);
    return status;
}

static kt_status add_figure(table *t, kt_error *error) {
#ifdef KT_SCENES
    kt_scene scene = kt_scene_default();
    kt_status status = kt_scene_read(KT_SCENES "/humanoid.yaml", &scene, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    status = add_line(t, "humanoid", &scene.description, error);
    kt_scene_free(&scene);
    return status;
#else
    (void)t, (void)error;
    return KT_OK;
#endif
}

/* Chains of 1, 2, 4 ... links below --max, then of --max, and of LONG if --max is larger. Then the others. */
static kt_status add_all(table *t, kt_error *error) {
    const int max = t->options->max;
    kt_status status = KT_OK;
    for (long n = 1, last = 0; status == KT_OK && last < max; n *= 2) {
        if (last < LONG && n > LONG && max > LONG)
            status = add_links(t, LONG, 1, error);
        last = n < max ? n : max;
        if (status == KT_OK)
            status = add_links(t, (int)last, 1, error);
    }
    if (status == KT_OK)
        status = add_links(t, LONG, 2, error);
    return status == KT_OK ? add_figure(t, error) : status;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 256, .seconds = 1.0};
    const int read = kt_bench_read(argc, argv, about, &options);
    if (read >= 0)
        return read;
    kt_csv csv;
    kt_error error;
    table t = {.options = &options, .csv = &csv, .trusted = true, .lines = calloc(LINES_MAX, sizeof *t.lines)};
    if (!t.lines || !kt_csv_open(&csv, options.csv, columns)) {
        free(t.lines);
        return KT_BENCH_FAILED;
    }
    int result = KT_BENCH_DONE;
    if (add_all(&t, &error) != KT_OK) {
        result = kt_bench_tell(&error);
    } else {
        print_mass(t.lines, t.count);
        const bool holds = conclude(t.lines, t.count);
        result = !t.trusted ? KT_BENCH_FAILED : options.check && !holds ? KT_BENCH_MISSED : KT_BENCH_DONE;
    }
    free(t.lines);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
