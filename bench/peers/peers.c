/* Kinetree beside MuJoCo, in turns, in one run, on the same chains: forward dynamics (ABA against kinematics, comPos,
 * crb, factorM, comVel, rne, solveM) and inverse dynamics (RNEA against kinematics, comPos, comVel, rne).
 *
 * A line is trusted if the two find the same:
 *   tau    torques for the same accelerations,             max |tau' - tau| / max |h|
 *   back   torques, by RNEA, of MuJoCo's accelerations:    max |RNEA(a') - tau| / max |h|
 * at most (4 + n) eps, h the bias force: rounding errors of n links add up along the chain (measured, 6e-16 and 1.5e-15
 * at n = 32). The difference of the accelerations themselves, max |a' - a| / max |a|, is shown; the condition of the
 * mass matrix stands between it and eps.
 */
#include "mujoco.h"
#include "report.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { LINES_MAX = 40, BOUND_AT = 32 };

/* What ABA and RNEA may cost at n = BOUND_AT, as parts of what MuJoCo takes for the same. */
static const double forward_most = 0.18, inverse_most = 0.17;

enum { FORWARD, FORWARD_PEER, INVERSE, INVERSE_PEER, CALL_COUNT };
static const char *const call_names[CALL_COUNT] = {"ABA", "MuJoCo forward", "RNEA", "MuJoCo inverse"};

typedef struct line {
    int n;
    kt_isa level;
    kt_bench_times times[CALL_COUNT];
    kt_bench_ratio forward, inverse;
    double a, tau, back; /* differences, see above */
} line;

static const char about[] = "Times kinetree and MuJoCo in turns, for chains of 1 to --max links.\n";

static const char columns[] =
    "n,call," KT_CSV_TIMES
    ",ratio_low,ratio_median,ratio_high,difference_a,difference_tau,difference_back," KT_CSV_ORIGIN;

/* ---- measuring --------------------------------------------------------------------------------------------------- */

/* Runs each call once, and compares. */
static kt_status compare(kt_chain *c, kt_mujoco *twin, line *out, kt_error *error) {
    const size_t n = (size_t)c->n;
    double *bias = malloc(n * sizeof *bias), *back = malloc(n * sizeof *back);
    kt_status status = KT_OK;
    if (!bias || !back)
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory to compare chains of %d links", c->n);
    if (status == KT_OK)
        status = kt_dynamics_inverse(c->model, c->data, c->q, c->v, NULL, NULL, bias, error);
    if (status == KT_OK) {
        kt_chain_forward(c, 1);
        kt_chain_inverse(c, 1);
        kt_mujoco_forward(twin, 1);
        kt_mujoco_inverse(twin, 1);
        status = c->error.code;
        if (status != KT_OK && error)
            *error = c->error;
    }
    if (status == KT_OK)
        status = kt_dynamics_inverse(c->model, c->data, c->q, c->v, twin->a, NULL, back, error);
    if (status == KT_OK) {
        out->a = kt_chain_difference(twin->a, c->a, c->a, c->n);
        out->tau = kt_chain_difference(twin->torque, c->torque, bias, c->n);
        out->back = kt_chain_difference(back, c->tau, bias, c->n);
    }
    free(bias);
    free(back);
    return status;
}

static kt_status measure(int n, const kt_bench_options *options, line *out, kt_error *error) {
    kt_chain chain;
    kt_mujoco twin;
    kt_status status = kt_chain_make(n, options->level, false, &chain, error);
    if (status != KT_OK)
        return status;
    status = kt_mujoco_make(&chain, &twin, error);
    if (status == KT_OK) {
        const kt_bench_task tasks[CALL_COUNT] = {[FORWARD] = {kt_chain_forward, &chain},
                                                 [FORWARD_PEER] = {kt_mujoco_forward, &twin},
                                                 [INVERSE] = {kt_chain_inverse, &chain},
                                                 [INVERSE_PEER] = {kt_mujoco_inverse, &twin}};
        *out = (line){.n = n, .level = kt_model_isa(chain.model)};
        status = compare(&chain, &twin, out, error);
        if (status == KT_OK) {
            kt_bench_measure(tasks, CALL_COUNT, options->seconds, out->times);
            out->forward = kt_bench_compare(&out->times[FORWARD], &out->times[FORWARD_PEER]);
            out->inverse = kt_bench_compare(&out->times[INVERSE], &out->times[INVERSE_PEER]);
        }
        kt_mujoco_free(&twin);
    }
    kt_chain_free(&chain);
    return status;
}

static bool is_trusted(const line *l) {
    const double bound = (4.0 + l->n) * DBL_EPSILON;
    return l->tau <= bound && l->back <= bound;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static void print_heading(kt_isa level, const char *csv) {
    char title[80];
    (void)snprintf(title, sizeof title, "Kinetree and MuJoCo %s on chains of n links", kt_mujoco_version());
    kt_bench_heading(title, level, csv);
    printf("us a call (lower quartile of the rounds); their ratio round by round: median [quartiles]; differences.\n\n"
           "%5s |%9s%10s%8s %-15s |%9s%10s%8s %-15s |%8s%9s%9s\n",
           "n", "ABA", "MuJoCo", "ratio", "", "RNEA", "MuJoCo", "ratio", "", "a", "tau", "back");
}

static void print_pair(const kt_bench_times *own, const kt_bench_times *peer, const kt_bench_ratio *ratio) {
    printf(" |%9.4g%10.4g%8.4f [%.4f %.4f]", 1e6 * own->low, 1e6 * peer->low, ratio->median, ratio->low, ratio->high);
}

static void print_line(const line *l) {
    printf("%5d", l->n);
    print_pair(&l->times[FORWARD], &l->times[FORWARD_PEER], &l->forward);
    print_pair(&l->times[INVERSE], &l->times[INVERSE_PEER], &l->inverse);
    printf(" |%8.1e%9.1e%9.1e%s\n", l->a, l->tau, l->back, is_trusted(l) ? "" : "  THE TWO DISAGREE");
    (void)fflush(stdout);
}

static void write_line(kt_csv *csv, const line *l) {
    for (int i = 0; i < CALL_COUNT; i++) {
        const kt_bench_ratio *ratio = i == FORWARD ? &l->forward : i == INVERSE ? &l->inverse : NULL;
        kt_csv_number(csv, l->n);
        kt_csv_text(csv, call_names[i]);
        kt_csv_times(csv, &l->times[i]);
        kt_csv_number(csv, ratio ? ratio->low : 1.0);
        kt_csv_number(csv, ratio ? ratio->median : 1.0);
        kt_csv_number(csv, ratio ? ratio->high : 1.0);
        kt_csv_number(csv, l->a);
        kt_csv_number(csv, l->tau);
        kt_csv_number(csv, l->back);
        kt_csv_origin(csv, l->level);
        kt_csv_line(csv);
    }
}

/* The last line; whether both bounds hold. */
static bool conclude(const line *lines, int count) {
    for (int i = 0; i < count; i++) {
        if (lines[i].n != BOUND_AT)
            continue;
        const double forward = lines[i].forward.median, inverse = lines[i].inverse.median;
        const bool forward_holds = forward <= forward_most, inverse_holds = inverse <= inverse_most;
        printf("\nn = %d: ABA costs %.3f of MuJoCo's time, bound %.2f: %s; RNEA %.3f, bound %.2f: %s\n", BOUND_AT,
               forward, forward_most, forward_holds ? "holds" : "MISSED", inverse, inverse_most,
               inverse_holds ? "holds" : "MISSED");
        return forward_holds && inverse_holds;
    }
    printf("\nn = %d, where the bounds are set, was not measured\n", BOUND_AT);
    return false;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static int run(const kt_bench_options *options, line *lines, kt_csv *csv) {
    int count = 0;
    bool trusted = true;
    for (long n = 1; count == 0 || lines[count - 1].n < options->max; n *= 2) { /* 1, 2, 4 ... and max itself */
        kt_error error;
        line *l = &lines[count];
        if (measure(n < options->max ? (int)n : options->max, options, l, &error) != KT_OK)
            return kt_bench_tell(&error);
        if (count++ == 0)
            print_heading(l->level, options->csv);
        print_line(l);
        write_line(csv, l);
        trusted &= is_trusted(l);
    }
    const bool holds = conclude(lines, count);
    return !trusted ? KT_BENCH_FAILED : options->check && !holds ? KT_BENCH_MISSED : KT_BENCH_DONE;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 256, .seconds = 1.0};
    const int status = kt_bench_read(argc, argv, about, &options);
    if (status >= 0)
        return status;
    kt_csv csv;
    line *lines = calloc(LINES_MAX, sizeof *lines);
    if (!lines || !kt_csv_open(&csv, options.csv, columns)) {
        free(lines);
        return KT_BENCH_FAILED;
    }
    const int result = run(&options, lines, &csv);
    free(lines);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
