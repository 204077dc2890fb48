/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A copy of a table whose numbers can be spoilt. */
typedef struct copy {
    kt_method method;
    double a[KT_METHOD_STAGES_MAX * KT_METHOD_STAGES_MAX], b[KT_METHOD_STAGES_MAX], c[KT_METHOD_STAGES_MAX];
    double e[KT_METHOD_STAGES_MAX], e_low[KT_METHOD_STAGES_MAX];
    double dense_a[KT_METHOD_STAGES_MAX * KT_METHOD_STAGES_MAX], dense_c[KT_METHOD_STAGES_MAX];
    double dense_d[KT_METHOD_DENSE_TERMS_MAX * KT_METHOD_STAGES_MAX];
    struct {
        double *values;
        int count;
        const char *name;
    } arrays[8];
    int count;
} copy;

/* a_ij, of which an explicit table has those with j < i alone. */
static double entry(const kt_method *m, int i, int j) {
    if (kt_method_is_implicit(m))
        return m->a[i * m->stages + j];
    return j < i ? m->a[i * (i - 1) / 2 + j] : 0.0;
}

static const double *copy_array(copy *to, const char *name, double *values, const double *from, int count) {
    if (from == NULL)
        return NULL;
    memcpy(values, from, (size_t)count * sizeof *values);
    to->arrays[to->count].values = values;
    to->arrays[to->count].count = count;
    to->arrays[to->count].name = name;
    to->count++;
    return values;
}

static void copy_method(copy *to, const kt_method *m) {
    const int s = m->stages, slots = kt_method_slots(m), w = kt_method_fresh(m) + 1, d = m->dense_stages;
    to->count = 0;
    to->method = *m;
    to->method.a = copy_array(to, "a", to->a, m->a, kt_method_is_implicit(m) ? s * s : s * (s - 1) / 2);
    to->method.b = copy_array(to, "b", to->b, m->b, s);
    to->method.c = copy_array(to, "c", to->c, m->c, s);
    to->method.e = copy_array(to, "e", to->e, m->e, s);
    to->method.e_low = copy_array(to, "e_low", to->e_low, m->e_low, s);
    to->method.dense_a = copy_array(to, "dense_a", to->dense_a, m->dense_a, d * w + d * (d - 1) / 2);
    to->method.dense_c = copy_array(to, "dense_c", to->dense_c, m->dense_c, d);
    to->method.dense_d = copy_array(to, "dense_d", to->dense_d, m->dense_d, m->dense_terms * slots);
}

KT_TEST(every_built_in_table_fulfils_its_order_conditions) {
    for (int i = 0; i < kt_method_count(); i++) {
        kt_error error = {KT_OK, "", ""};
        const kt_method *m = kt_method_at(i);
        if (!kt_check_equal_int(m->name, kt_method_check(m, &error), KT_OK))
            kt_note("%s: %s", error.where, error.message);
    }
}

/* Ensures that no claim is too modest, and that the conditions of every order have an effect. */
KT_TEST(no_built_in_table_fulfils_more_than_it_claims) {
    for (int i = 0; i < kt_method_count(); i++) {
        kt_method m = *kt_method_at(i);
        kt_note("%s", m.name);
        m.order++;
        kt_check_equal_int("order + 1", kt_method_check(&m, NULL), KT_ERROR_ARGUMENT);
        m.order--;
        if (m.e != NULL) {
            m.embedded_order++;
            kt_check_equal_int("embedded order + 1", kt_method_check(&m, NULL), KT_ERROR_ARGUMENT);
            m.embedded_order--;
        }
        if (m.e_low != NULL) {
            m.embedded_order_low++;
            kt_check_equal_int("low embedded order + 1", kt_method_check(&m, NULL), KT_ERROR_ARGUMENT);
            m.embedded_order_low--;
        }
        m.dense_order = kt_method_dense_order(&m) + 1;
        if (m.gamma == NULL) /* see rosenbrock.c */
            kt_check_equal_int("dense order + 1", kt_method_check(&m, NULL), KT_ERROR_ARGUMENT);
    }
}

static double largest_entry(const copy *m) {
    double largest = 0.0;
    for (int j = 0; j < m->count; j++)
        for (int l = 0; l < m->arrays[j].count; l++)
            largest = fmax(largest, fabs(m->arrays[j].values[l]));
    return largest;
}

/* The smallest change of one value, doubled from 1e-16 on, at which the table is rejected. */
static double change_that_is_seen(copy *m, double *value) {
    const double kept = *value;
    double change = 1e-16;
    do {
        change *= 2.0;
        *value = kept + change;
    } while (change < 1.0 && kt_method_check(&m->method, NULL) == KT_OK);
    *value = kept;
    return change;
}

/* Every coefficient of every table enters some condition. Rounding of the largest coefficients bounds the changes that
 * can be seen. Changes of 2 to 50 eps of the largest were detected. */
KT_TEST(a_change_of_any_coefficient_is_rejected) {
    static copy spoilt;
    for (int i = 0; i < kt_method_count(); i++) {
        copy_method(&spoilt, kt_method_at(i));
        const double bound = 64.0 * DBL_EPSILON * largest_entry(&spoilt);
        KT_WORST worst = kt_worst_make(spoilt.method.name);
        for (int j = 0; j < spoilt.count; j++)
            for (int l = 0; l < spoilt.arrays[j].count; l++)
                kt_worst_below(&worst, change_that_is_seen(&spoilt, &spoilt.arrays[j].values[l]), bound, "%s[%d]",
                               spoilt.arrays[j].name, l);
        kt_check_equal_int("the table itself", kt_method_check(&spoilt.method, NULL), KT_OK);
    }
}

static double gamma_entry(const kt_method *m, int i, int j) {
    return m->gamma != NULL ? m->gamma[i * m->stages + j] : 0.0;
}

/* Compares the eight conditions of order 4, written out by hand, with those from the trees. They are in HNW II.1,
 * (1.11), and for linearly implicit methods in HW IV.7, (7.11). The weights are b, or the embedded b - e. Besides,
 * beta = alpha + gamma, beta_i is its row sum, and c_i that of alpha. Explicit methods have no gamma. */
static void check_order_4(const kt_method *m, bool embedded) {
    const int s = m->stages;
    double sum[8] = {0.0}, beta[KT_METHOD_STAGES_MAX] = {0.0};
    for (int i = 0; i < s; i++) {
        beta[i] = m->c[i];
        for (int j = 0; j < s; j++)
            beta[i] += gamma_entry(m, i, j);
    }
    for (int i = 0; i < s; i++) {
        double tall = 0.0, bushy = 0.0, tallest = 0.0, mixed = 0.0;
        for (int j = 0; j < s; j++) {
            const double alpha = entry(m, i, j), both = alpha + gamma_entry(m, i, j);
            tall += both * beta[j];
            bushy += both * m->c[j] * m->c[j];
            mixed += alpha * beta[j];
            for (int k = 0; k < s; k++)
                tallest += both * (entry(m, j, k) + gamma_entry(m, j, k)) * beta[k];
        }
        const double b = m->b[i] - (embedded ? m->e[i] : 0.0), c = m->c[i];
        const double terms[8] = {b,         b * beta[i], b * c * c, b * tall, b * c * c * c, b * c * mixed,
                                 b * bushy, b * tallest};
        for (int j = 0; j < 8; j++)
            sum[j] += terms[j];
    }
    static const double expected[8] = {1.0,       1.0 / 2.0, 1.0 / 3.0,  1.0 / 6.0,
                                       1.0 / 4.0, 1.0 / 8.0, 1.0 / 12.0, 1.0 / 24.0};
    const double bound = (m->order > 5 || m->gamma != NULL ? 64.0 : 8.0) * DBL_EPSILON;
    KT_WORST worst = kt_worst_make(m->name);
    for (int j = 0; j < 8; j++) /* measured: dop853's terms reach 40 in size, those of rodas5p 20 */
        kt_worst_near(&worst, sum[j], expected[j], bound, "condition %d", j + 1);
}

KT_TEST(conditions_of_order_4_are_those_of_the_textbook) {
    for (int k = 0; k < kt_method_count(); k++)
        for (int embedded = 0; embedded <= (kt_method_at(k)->gamma != NULL); embedded++)
            if (kt_method_at(k)->order >= 4)
                check_order_4(kt_method_at(k), embedded);
}

/* The numbers of rooted trees: A. Cayley 1857, OEIS A000081. */
KT_TEST(every_tree_is_made_once) {
    static const int expected[] = {0, 1, 1, 2, 4, 9, 20, 48, 115, 286, 719, 1842, 4766};
    for (int nodes = 1; nodes <= KT_METHOD_ORDER_MAX; nodes++)
        kt_check_equal_int("trees", kt_tree_count(nodes), expected[nodes]);
}

/* The table satisfies the conditions of all tall trees,
 *     sum b = 1, sum b c = 1/2, sum b a c = 1/6
 * It violates that of the bushy tree of order 3, since
 *     sum b c^2 = 5/12 */
KT_TEST(bushy_trees_are_checked_beside_tall_ones) {
    static const double a[] = {0.5, 0.0, 1.0}, b[] = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, c[] = {0.0, 0.5, 1.0};
    kt_error error;
    kt_method m;
    memset(&m, 0, sizeof m);
    m.stages = 3;
    m.order = 3;
    m.a = a;
    m.b = b;
    m.c = c;
    kt_check_equal_int("status", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "method");
    kt_check_contains("words", error.message, "order 3 of the tree [..] fails: the sum is 0.41666666666666");
    m.order = 2;
    kt_check_equal_int("as order 2", kt_method_check(&m, &error), KT_OK);
}

/* The SSP method of order 3 by Shu and Osher, a table that is not built in (J. Comput. Phys. 77 (1988) 439). */
static const double ssp_a[] = {1.0, 1.0 / 4.0, 1.0 / 4.0};
static const double ssp_b[] = {1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0};
static const double ssp_c[] = {0.0, 1.0, 1.0 / 2.0};

static kt_method ssp_method(void) {
    kt_method m;
    memset(&m, 0, sizeof m);
    m.name = "ssp3";
    m.stages = 3;
    m.order = 3;
    m.a = ssp_a;
    m.b = ssp_b;
    m.c = ssp_c;
    return m;
}

KT_TEST(a_callers_table_is_accepted_if_its_conditions_hold) {
    kt_error error;
    kt_method m = ssp_method();
    kt_check_equal_int("ssp3", kt_method_check(&m, &error), KT_OK);
    m.order = 2;
    kt_check_equal_int("claimed as order 2", kt_method_check(&m, &error), KT_OK);
}

KT_TEST(a_rejection_names_the_condition_that_fails) {
    kt_error error;
    kt_method m = ssp_method();
    const double wrong_b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 2.0};
    m.b = wrong_b; /* sum b = 1, sum b c = 7/12 */
    kt_check_equal_int("order 2", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "ssp3");
    kt_check_contains("tree", error.message, "b: the condition of order 2 of the tree [.] fails");
    kt_check_contains("residual", error.message, "not 0.5 (off by 0.0833)");

    m = ssp_method();
    m.order = 4;
    kt_check_equal_int("order 4", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("tree", error.message, "order 4 of the tree [[[.]]] fails: the sum is 0, not 0.0416");

    m = ssp_method();
    const double wrong_c[] = {0.0, 1.0, 0.6};
    m.c = wrong_c;
    kt_check_equal_int("row sum", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("stage", error.message, "stage 3: the row of a sums to 0.5, but c is 0.59999999999999998");

    m = *kt_method_find("dopri5");
    m.embedded_order = 5;
    kt_check_equal_int("embedded", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("embedded", error.message, "error weights e: the condition of order 5 of the tree [[[[.]]]]");
    m = *kt_method_find("dop853");
    m.dense_order = 8;
    kt_check_equal_int("dense", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("dense", error.message, "dense output: the condition of order 8");
}

KT_TEST(a_malformed_table_is_rejected_without_reading_beyond_it) {
    kt_error error;
    const double not_finite[] = {1.0, (double)NAN, 0.25}, zeros[] = {0.0, 0.0, 0.0};
    kt_check_equal_int("none", kt_method_check(NULL, &error), KT_ERROR_ARGUMENT);
#define KT_REJECTD(what, change)                                                                                       \
    do {                                                                                                               \
        kt_method m = ssp_method();                                                                                    \
        change;                                                                                                        \
        kt_check_equal_int(what, kt_method_check(&m, &error), KT_ERROR_ARGUMENT);                                      \
        kt_check_true("says why", error.message[0] != '\0');                                                           \
    } while (0)
    KT_REJECTD("no stage", m.stages = 0);
    KT_REJECTD("too many stages", m.stages = KT_METHOD_STAGES_MAX);
    KT_REJECTD("negative stages of the dense output", m.dense_stages = -1);
    KT_REJECTD("order 0", m.order = 0);
    KT_REJECTD("order 13", m.order = 13);
    KT_REJECTD("no a", m.a = NULL);
    KT_REJECTD("no b", m.b = NULL);
    KT_REJECTD("no c", m.c = NULL);
    KT_REJECTD("not finite", m.a = not_finite);
    kt_check_contains("words", error.message, "a coefficient is not finite");
    KT_REJECTD("embedded order without e", m.embedded_order = 2);
    KT_REJECTD("e without embedded order", m.e = zeros);
    KT_REJECTD("e of zeros", (m.e = zeros, m.embedded_order = 2));
    KT_REJECTD("dense terms without d", m.dense_terms = 1);
    KT_REJECTD("too many dense terms", (m.dense_terms = 9, m.dense_d = ssp_a));
    KT_REJECTD("dense stages without a", m.dense_stages = 1);
    KT_REJECTD("fsal that is not", m.fsal = true);
#undef KT_REJECTD
}

/* ---- a caller's table -------------------------------------------------------------------------------------------- */

/* Fehlberg's 4(5), continued with the lower order. It is not built in. Source: HNW II.5, table 5.1. */
static const double fehlberg_a[] = {1.0 / 4.0,        3.0 / 32.0,      9.0 / 32.0,    1932.0 / 2197.0,
                                    -7200.0 / 2197.0, 7296.0 / 2197.0, 439.0 / 216.0, -8.0,
                                    3680.0 / 513.0,   -845.0 / 4104.0, -8.0 / 27.0,   2.0,
                                    -3544.0 / 2565.0, 1859.0 / 4104.0, -11.0 / 40.0};
static const double fehlberg_b[] = {25.0 / 216.0, 0.0, 1408.0 / 2565.0, 2197.0 / 4104.0, -1.0 / 5.0, 0.0};
static const double fehlberg_c[] = {0.0, 1.0 / 4.0, 3.0 / 8.0, 12.0 / 13.0, 1.0, 1.0 / 2.0};
static const double fehlberg_e[] = {
    25.0 / 216.0 - 16.0 / 135.0, 0.0,        1408.0 / 2565.0 - 6656.0 / 12825.0, 2197.0 / 4104.0 - 28561.0 / 56430.0,
    -1.0 / 5.0 + 9.0 / 50.0,     -2.0 / 55.0};

KT_TEST(a_copy_of_a_built_in_table_gives_the_same_bits) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method own = *kt_method_at(i);
        const kt_integrator_options options = fixed_step(0.05);
        if (!goes_by_its_table(&own)) /* no table of a caller's */
            continue;
        kt_integrator *it = integrator_begin(&own, &problem_kepler, options);
        kt_integrator *built_in = integrator_begin(kt_method_at(i), &problem_kepler, options);
        integrate_to(it, 1.0);
        integrate_to(built_in, 1.0);
        kt_check_equal_bits(own.name, kt_integrator_state(it), kt_integrator_state(built_in), 4);
    }
}

KT_TEST(a_callers_table_is_checked_and_used) {
    kt_error error;
    kt_method m;
    memset(&m, 0, sizeof m);
    m.name = "fehlberg";
    m.stages = 6;
    m.order = 4;
    m.embedded_order = 4; /* both are of order 4: the estimate is of order h^5 */
    m.a = fehlberg_a;
    m.b = fehlberg_b;
    m.c = fehlberg_c;
    m.e = fehlberg_e;
    const kt_integrator_options options = tolerance(1e-6, 1e-6);
    kt_integrator *it = integrator_begin(&m, &problem_kepler, options);
    integrate_to(it, 9.0);
    kt_check_below("error over tolerance", error_at(&problem_kepler, 9.0, kt_integrator_state(it)) / 1e-6, 100.0);

    m.order = 5;
    void *memory = malloc(kt_integrator_size(&m, 4));
    kt_check_equal_int("rejected", kt_integrator_init(memory, kt_integrator_size(&m, 4), &m, 4, &options, &it, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "fehlberg");
    kt_check_contains("words", error.message, "b: the condition of order 5");
    free(memory);
}
