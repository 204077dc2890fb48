/* Arguments that an integrator cannot use: each is rejected, and the message names the fault. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

/* ---- tables ------------------------------------------------------------------------------------------------------ */

static void check_table(const char *what, kt_method m, const char *words) {
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int(what, kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, words);
}

KT_TEST(sizes_and_orders_out_of_range_are_rejected) {
    static const char stages[] = "a method has 1 to 32 stages", orders[] = "orders are 1 to 12";
    static const char together[] = "error weights and embedded orders belong together";
    const kt_method good = *kt_method_find("dop853");
    kt_method m;
#define KT_REJECTD(words, change)                                                                                      \
    do {                                                                                                               \
        m = good;                                                                                                      \
        change;                                                                                                        \
        check_table(#change, m, words);                                                                                \
    } while (0)
    KT_REJECTD(stages, m.stages = KT_METHOD_STAGES_MAX + 1);
    KT_REJECTD(stages, m.dense_stages = KT_METHOD_STAGES_MAX + 1);
    KT_REJECTD("a method of one stage cannot be fsal", (m.stages = 1, m.fsal = true));
    KT_REJECTD(orders, m.embedded_order = -1);
    KT_REJECTD(orders, m.embedded_order = KT_METHOD_ORDER_MAX + 1);
    KT_REJECTD(orders, m.embedded_order_low = -1);
    KT_REJECTD(orders, m.embedded_order_low = KT_METHOD_ORDER_MAX + 1);
    KT_REJECTD(orders, m.dense_order = -1);
    KT_REJECTD(orders, m.dense_order = KT_METHOD_ORDER_MAX + 1);
    KT_REJECTD("a dense output has 0 to 8 terms", m.dense_terms = -1);
    KT_REJECTD(together, m.embedded_order_low = 0);
    KT_REJECTD(together, (m.e = NULL, m.embedded_order = 0));
    KT_REJECTD("dense_stages > 0 needs dense_a and dense_c", m.dense_c = NULL);
#undef KT_REJECTD
}

/* One NaN in each array of the table that has all of them. */
KT_TEST(a_coefficient_that_is_not_finite_is_rejected_wherever_it_stands) {
    const kt_method good = *kt_method_find("dop853");
    const int s = good.stages, d = good.dense_stages, w = kt_method_fresh(&good) + 1;
    const struct {
        const char *name;
        size_t member;
        int count;
    } arrays[] = {
        {"a", offsetof(kt_method, a), s * (s - 1) / 2},
        {"b", offsetof(kt_method, b), s},
        {"c", offsetof(kt_method, c), s},
        {"e", offsetof(kt_method, e), s},
        {"e_low", offsetof(kt_method, e_low), s},
        {"dense_a", offsetof(kt_method, dense_a), d * w + d * (d - 1) / 2},
        {"dense_c", offsetof(kt_method, dense_c), d},
        {"dense_d", offsetof(kt_method, dense_d), good.dense_terms * (w + d)},
    };
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        double values[KT_METHOD_STAGES_MAX * KT_METHOD_STAGES_MAX];
        const double *own = values;
        kt_method m = good;
        memcpy(&own, (const char *)&good + arrays[i].member, sizeof own);
        memcpy(values, own, (size_t)arrays[i].count * sizeof *values);
        own = values;
        memcpy((char *)&m + arrays[i].member, &own, sizeof own);
        kt_check_equal_int("as it is", kt_method_check(&m, NULL), KT_OK);
        values[arrays[i].count - 1] = (double)NAN;
        check_table(arrays[i].name, m, "a coefficient is not finite");
    }
}

/* ---- options ----------------------------------------------------------------------------------------------------- */

static kt_status place(const kt_method *m, const kt_integrator_options *options, kt_error *error) {
    static char memory[8192];
    kt_integrator *it = NULL;
    return kt_integrator_init(memory, sizeof memory, m, 2, options, &it, error);
}

KT_TEST(options_at_and_beyond_the_ends_of_their_ranges) {
    static const double positive[2] = {1e-9, 1e-6}, with_zero[2] = {1e-9, 0.0};
    const kt_method *dopri5 = kt_method_find("dopri5");
    kt_error error;
    kt_integrator_options o;
#define KT_PLACED(status, change)                                                                                      \
    do {                                                                                                               \
        o = kt_integrator_options_default();                                                                           \
        change;                                                                                                        \
        kt_check_equal_int(#change, place(dopri5, &o, &error), status);                                                \
    } while (0)
#define KT_REJECTD(words, change)                                                                                      \
    do {                                                                                                               \
        KT_PLACED(KT_ERROR_ARGUMENT, change);                                                                          \
        kt_check_contains("words", error.message, words);                                                              \
    } while (0)
    KT_REJECTD("the relative tolerance 2.2e-16 is below the rounding of numbers; give 2.3e-16 or more",
               o.relative_tolerance = 2.2e-16);
    KT_REJECTD("the relative tolerance 4.94066e-324 is below", o.relative_tolerance = 5e-324);
    KT_PLACED(KT_OK, o.relative_tolerance = 2.3e-16);
    KT_PLACED(KT_OK, o.relative_tolerance = 0.0);
    KT_REJECTD("safety must be between 0 and 1", o.safety = 0.0);
    KT_REJECTD("safety must be between 0 and 1", o.safety = (double)NAN);
    KT_REJECTD("0 < alpha <= 2", o.alpha = 2.1);
    KT_REJECTD("0 <= beta <= alpha", o.beta = -0.1);
    KT_REJECTD("0 < factor_min < 1", o.factor_min = 0.0);
    KT_REJECTD("1 < factor_max", o.factor_max = HUGE_VAL);
    KT_PLACED(KT_OK, (o.alpha = 2.0, o.beta = 2.0));
    KT_PLACED(KT_OK, o.beta = 0.0);
    KT_PLACED(KT_OK, o.absolute_tolerance = 0.0);
    KT_PLACED(KT_OK, (o.absolute_tolerances = positive, o.relative_tolerance = 0.0));
    KT_PLACED(KT_OK, o.absolute_tolerances = with_zero);
    KT_PLACED(KT_OK, (o.absolute_tolerances = positive, o.absolute_tolerance = o.relative_tolerance = 0.0));
#undef KT_PLACED
#undef KT_REJECTD
}

KT_TEST(what_is_missing_is_named) {
    kt_error error;
    char memory[4096];
    kt_integrator *it = NULL;
    kt_integrator_options o = kt_integrator_options_default();
    const kt_method *rk4 = kt_method_find("rk4");
    kt_method nameless = *rk4;
    nameless.name = NULL;
    kt_check_equal_int("no name", place(&nameless, &o, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "method '' has no error estimate");
    kt_check_equal_int("no method", place(NULL, &o, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "'method' is NULL; it must be given");
    kt_check_equal_int("no options", kt_integrator_init(memory, sizeof memory, rk4, 1, NULL, &it, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "'options' is NULL; it must be given");
    o.step = 0.1;
    kt_check_equal_int("no place for it", kt_integrator_init(memory, sizeof memory, rk4, 1, &o, NULL, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("no memory", kt_integrator_init(NULL, sizeof memory, rk4, 1, &o, &it, &error), KT_ERROR_MEMORY);
    kt_check_contains("words", error.message, "0 bytes were given");
    kt_check_true("nothing was set", it == NULL);
    kt_check_equal_int("place", kt_integrator_init(memory, sizeof memory, rk4, 1, &o, &it, &error), KT_OK);
    kt_check_equal_int("no callbacks", kt_integrator_start(it, 0.0, (double[]){1.0}, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "a right-hand side must be given");
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

KT_TEST(every_number_of_a_checkpoint_is_checked) {
    static const char damaged[] = "of the integrator is ", missing[] = "the memory and a right-hand side must be given";
    kt_error error;
    kt_integrator *it = integrator_begin(kt_method_find("dopri5"), &problem_kepler, tolerance(1e-5, 1e-5));
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL}, none = {NULL, NULL, NULL};
    integrate_to(it, 1.0);
    kt_integrator_memory good, bad;
    double y[4], before[4];
    kt_integrator_save(it, &good, y, NULL, NULL);
    memcpy(before, y, sizeof before);
    y[0] += 0.5; /* so that a restore that went through would show */
#define KT_REJECTD(change)                                                                                             \
    do {                                                                                                               \
        bad = good;                                                                                                    \
        change;                                                                                                        \
        kt_check_equal_int(#change, kt_integrator_restore(it, &bad, y, NULL, NULL, &callbacks, &error),                \
                           KT_ERROR_ARGUMENT);                                                                         \
        kt_check_contains("words", error.message, damaged);                                                            \
    } while (0)
    KT_REJECTD(bad.previous_t = HUGE_VAL);
    KT_REJECTD(bad.origin = (double)NAN);
    KT_REJECTD(bad.last_step = -HUGE_VAL);
    KT_REJECTD(bad.last_step = 0.0);
    KT_REJECTD(bad.next_step = HUGE_VAL);
    KT_REJECTD(bad.control_error = HUGE_VAL);
    KT_REJECTD(bad.control_error = (double)NAN);
    KT_REJECTD(bad.advanced = (double)NAN);
    KT_REJECTD(bad.window = good.counts.steps + good.counts.rejected + 1);
    KT_REJECTD(bad.counts.steps = UINT64_MAX);
    KT_REJECTD(bad.grid = INT64_MAX);
    KT_REJECTD(bad.grid = INT64_MIN);
    KT_REJECTD(bad.on_grid = 2);
    KT_REJECTD(bad.has_previous = -1);
#undef KT_REJECTD
    kt_check_equal_int("no memory", kt_integrator_restore(it, NULL, y, NULL, NULL, &callbacks, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, missing);
    kt_check_equal_int("no callbacks", kt_integrator_restore(it, &good, y, NULL, NULL, NULL, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("no rhs", kt_integrator_restore(it, &good, y, NULL, NULL, &none, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, missing);
    kt_check_equal_bits("state", kt_integrator_state(it), before, 4);
}

/* The first number of these histories is a count or a choice, which becomes an integer. */
KT_TEST(choices_in_the_history_of_a_checkpoint_are_checked) {
    static const char *const methods[] = {"ab4", "radau5", "rodas5p", "bdf2", "implicit-euler"};
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
    kt_error error;
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        kt_integrator_options o = kt_integrator_options_default();
        kt_integrator_memory memory;
        double y[4], history[64];
        o.step = 1e-3;
        kt_integrator *it = integrator_begin(kt_method_find(methods[i]), &problem_kepler, o);
        integrate_to(it, 0.01);
        kt_need(kt_check_true("room", kt_integrator_history_size(it) <= 64));
        kt_integrator_save(it, &memory, y, NULL, history);
        kt_check_equal_int(methods[i], kt_integrator_restore(it, &memory, y, NULL, history, &callbacks, &error), KT_OK);
        history[0] = 1e300;
        kt_check_equal_int("choice", kt_integrator_restore(it, &memory, y, NULL, history, &callbacks, &error),
                           KT_ERROR_ARGUMENT);
        kt_check_contains("words", error.message, "of the integrator is 1e+300, which is out of range");
    }
}

KT_TEST(the_history_of_a_checkpoint_is_checked) {
    kt_error error;
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
    kt_integrator *it = integrator_begin(kt_method_find("rkc2"), &problem_kepler, tolerance(1e-5, 1e-5));
    integrate_to(it, 1.0);
    kt_integrator_memory memory;
    double y[4], history[2];
    kt_check_equal_int("numbers", (long long)kt_integrator_history_size(it), 2);
    kt_integrator_save(it, &memory, y, NULL, history);
    for (int i = 0; i < 2; i++) {
        const double good = history[i];
        history[i] = (double)NAN;
        kt_check_equal_int("damaged", kt_integrator_restore(it, &memory, y, NULL, history, &callbacks, &error),
                           KT_ERROR_ARGUMENT);
        kt_check_contains("words", error.message, "'history' of the integrator is nan");
        history[i] = good;
    }
    kt_fine("good", kt_integrator_restore(it, &memory, y, NULL, history, &callbacks, &error), &error);
}

/* There is no previous state yet. The state itself is stored in its place, and is not taken for one. */
KT_TEST(a_checkpoint_before_the_first_step_has_no_past) {
    kt_error error;
    const kt_integrator_options options = fixed_step(0.1);
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
    kt_integrator *it = integrator_begin(kt_method_find("rk4"), &problem_kepler, options);
    kt_integrator *other = integrator_make(kt_method_find("rk4"), 4, options);
    kt_integrator_memory memory;
    double y[4], previous[4], value[4];
    kt_integrator_save(it, &memory, y, previous, NULL);
    kt_check_equal_bits("previous", previous, y, 4);
    kt_fine("restore", kt_integrator_restore(other, &memory, y, previous, NULL, &callbacks, &error), &error);
    kt_check_equal_int("past", kt_integrator_memory_of(other)->has_previous, 0);
    kt_check_equal_int("value before", kt_integrator_interpolate(other, -0.05, value, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "outside of the last step");
    integrate_to(it, 0.3);
    integrate_to(other, 0.3);
    kt_check_equal_bits("state", kt_integrator_state(other), kt_integrator_state(it), 4);
}

/* ---- steps that lead nowhere ------------------------------------------------------------------------------------- */

static int turn(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = y[1];
    dydt[1] = -y[0];
    return 0;
}

static kt_status take_step(const kt_integrator_options *options, double t, double y0, double limit, int steps,
                           kt_error *error) {
    static char memory[8192];
    const kt_integrator_callbacks callbacks = {turn, NULL, NULL};
    kt_integrator *it = NULL;
    kt_status status = kt_integrator_init(memory, sizeof memory, kt_method_find("dopri5"), 2, options, &it, error);
    if (status == KT_OK)
        status = kt_integrator_start(it, t, (double[]){y0, 1.0}, &callbacks, error);
    while (status == KT_OK && steps-- > 0 && kt_integrator_time(it) < limit)
        status = kt_integrator_step(it, limit, error);
    return status;
}

/* y is 1 in both components. Its rounding eps is 2e14 times a tolerance of 1e-30. A tolerance just above eps is
 * accepted. */
KT_TEST(tolerances_below_the_rounding_of_the_state_are_rejected) {
    kt_error error;
    kt_integrator_options o = kt_integrator_options_default();
    o.relative_tolerance = 0.0;
    o.absolute_tolerance = 1e-30;
    kt_check_equal_int("1e-30 of 1", take_step(&o, 0.0, 1.0, 1.0, 10, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "are 2.22e+14 times below the rounding of the state");
    kt_check_equal_int("1e-30 of what grows from 0", take_step(&o, 0.0, 0.0, 1.0, 1000, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "below the rounding of the state");
    o.absolute_tolerance = 2.2e-16;
    kt_check_equal_int("2.2e-16 of 1", take_step(&o, 0.0, 1.0, 1.0, 1, &error), KT_ERROR_STEP);
    o.absolute_tolerance = 2.3e-16;
    kt_check_equal_int("2.3e-16 of 1", take_step(&o, 0.0, 1.0, 1.0, 1, &error), KT_OK);
}

/* 16 eps of 1000 s are 3.553e-12 s. */
KT_TEST(longest_step_that_is_lost_in_the_time_is_rejected) {
    kt_error error;
    kt_integrator_options o = kt_integrator_options_default();
    o.max_step = 3.5e-12;
    kt_check_equal_int("from 1000 s", take_step(&o, 1000.0, 1.0, HUGE_VAL, 1, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "max_step 3.5e-12 is lost in the rounding of the time");
    kt_check_equal_int("to 1000 s", take_step(&o, 0.0, 1.0, 1000.0, 1, &error), KT_ERROR_STEP);
    kt_check_equal_int("from 0 s on", take_step(&o, 0.0, 1.0, HUGE_VAL, 1, &error), KT_OK);
    o.max_step = 3.6e-12;
    kt_check_equal_int("a little longer", take_step(&o, 1000.0, 1.0, HUGE_VAL, 1, &error), KT_OK);
}
