/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "interpose.h"
#include "problems.h"

#include "integrator/integrator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* The count in the header, and less than 8 kB of struct, table and filled-up lines. */
KT_TEST(sizes_are_those_documented) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const size_t explicit = (size_t)m->stages + 4 + (size_t)m->dense_stages - (m->fsal ? 1 : 0);
        const bool implicit = kt_method_is_implicit(m);
        const bool switches = strcmp(kt_method_family_name(m), "switching") == 0;
        const size_t past = m->steps > 0 ? (size_t)m->steps - 1 : 0;
        const size_t n = 1000000, vectors = implicit                   ? 4 * n + (past > 0           ? 18
                                                                                  : m->gamma != NULL ? 23
                                                                                  : m->stages > 2    ? 21
                                                                                                     : 15)
                                            : switches                 ? 4 * n + 25
                                            : kt_method_stages_vary(m) ? (m->order == 2 ? 17 : 19)
                                                                       : explicit + past;
        const size_t bytes = kt_integrator_size(m, n);
        kt_note("%s: %zu bytes for one equation", m->name, kt_integrator_size(m, 1));
        kt_check_above("bytes for a million equations", (double)bytes, 8.0 * (double)(n * vectors));
        kt_check_below("bytes beyond the vectors", (double)bytes - 8.0 * (double)(n * vectors), 8192.0);
    }
}

KT_TEST(sizes_that_cannot_be_are_zero) {
    const kt_method *m = kt_method_find("dop853");
    kt_method wrong = *m;
    wrong.stages = 0;
    kt_check_equal_int("no equation", (long long)kt_integrator_size(m, 0), 0);
    kt_check_equal_int("no method", (long long)kt_integrator_size(NULL, 1), 0);
    kt_check_equal_int("no stage", (long long)kt_integrator_size(&wrong, 1), 0);
    kt_check_equal_int("too many equations", (long long)kt_integrator_size(m, SIZE_MAX / 8), 0);
    kt_check_equal_int("overflow", (long long)kt_integrator_size(m, SIZE_MAX), 0);
    const kt_method *implicit = kt_method_find("radau5");
    const size_t root = (size_t)1 << (4 * sizeof(size_t)); /* its square is one more than SIZE_MAX */
    kt_check_equal_int("overflow of n x n matrices", (long long)kt_integrator_size(implicit, root), 0);
    kt_check_above("vectors alone", (double)kt_integrator_size(m, root), 8.0 * (double)root);
}

/* At every offset, with guards on both sides; the bits of the motion do not depend on it. */
KT_TEST(memory_may_begin_anywhere_and_is_not_overrun) {
    kt_error error;
    enum { GUARD = 32 };
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const kt_integrator_options options = m->e != NULL ? tolerance(1e-6, 1e-6) : fixed_step(0.05);
        const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
        const size_t size = kt_integrator_size(m, 4);
        unsigned char *block = malloc(size + 64 + 2 * GUARD);
        double start[4], first[4], value[4];
        problem_kepler.solution(0.0, start);
        bool same = true, kept = true, aligned = true, inside = true;
        for (size_t offset = 0; offset < 64; offset++) {
            memset(block, 0xA5, size + 64 + 2 * GUARD);
            unsigned char *memory = block + GUARD + offset;
            kt_integrator *it = NULL;
            kt_fine("place", kt_integrator_init(memory, size, m, 4, &options, &it, &error), &error);
            const double *last = it->slopes + it->sizes.slots * it->sizes.stride;
            aligned = aligned && (uintptr_t)it % 64 == 0 && (uintptr_t)it->slopes % 64 == 0;
            inside = inside && (const unsigned char *)(const void *)last <= memory + size;
            kt_fine("start", kt_integrator_start(it, 0.0, start, &callbacks, &error), &error);
            integrate_to(it, 1.0);
            integrator_value(it, 0.999, value);
            if (offset == 0)
                memcpy(first, kt_integrator_state(it), sizeof first);
            same = same && same_bits(first, kt_integrator_state(it), 4);
            for (size_t j = 0; j < GUARD; j++)
                kept = kept && memory[-1 - (long)j] == 0xA5 && memory[size + j] == 0xA5;
        }
        kt_check_true(m->name, same);
        kt_check_true("guards", kept);
        kt_check_true("on cache lines", aligned);
        kt_check_true("inside", inside);
        free(block);
    }
}

KT_TEST(nothing_is_allocated) {
    kt_error error;
    const size_t size = kt_integrator_size(kt_method_find("dop853"), 4);
    void *memory = malloc(size);
    const kt_integrator_options options = tolerance(1e-9, 1e-9);
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
    kt_integrator *it = NULL;
    double start[4], value[4];
    problem_kepler.solution(0.0, start);
    kt_interpose_start();
    kt_status status = kt_integrator_init(memory, size, kt_method_find("dop853"), 4, &options, &it, &error);
    if (status == KT_OK)
        status = kt_integrator_start(it, 0.0, start, &callbacks, &error);
    for (int k = 0; k < 20 && status == KT_OK; k++)
        status = kt_integrator_step(it, 100.0, &error);
    if (status == KT_OK)
        status = kt_integrator_interpolate(it, kt_integrator_time(it) - 1e-3, value, &error);
    const kt_status rejected = kt_integrator_interpolate(it, -1.0, value, &error);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    kt_check_equal_int("status", status, KT_OK);
    kt_check_equal_int("a rejection", rejected, KT_ERROR_ARGUMENT);
    free(memory);
}

/* Scratch memory is filled with garbage between all calls. */
KT_TEST(garbage_in_scratch_changes_no_bit) {
    static const unsigned char bytes[] = {0xFF, 0x00, 0x7F, 0x55}; /* 0xFF..: NaN; 0x7F7F..: 1.4e306 */
    for (int i = 0; i < kt_method_count() + 5; i++) {
        const kt_method *m = kt_method_at(i < kt_method_count() ? i : i - 5);
        const kt_integrator_options options =
            i >= kt_method_count() && m->e != NULL ? tolerance(1e-6, 1e-6) : fixed_step(0.05);
        kt_integrator *clean = integrator_begin(m, &problem_kepler, options);
        kt_integrator *dirty = integrator_begin(m, &problem_kepler, options);
        double y[2][4];
        bool same = true;
        for (int k = 0; k < 12; k++) {
            kt_integrator_poison(dirty, bytes[k % 4]);
            integrator_step(clean, 9.0);
            integrator_step(dirty, 9.0);
            const double t0 = kt_integrator_previous_time(clean), t1 = kt_integrator_time(clean);
            kt_integrator_poison(dirty, bytes[(k + 1) % 4]);
            integrator_value(clean, 0.4 * t0 + 0.6 * t1, y[0]);
            integrator_value(dirty, 0.4 * t0 + 0.6 * t1, y[1]);
            same = same && same_bits(y[0], y[1], 4) && t1 == kt_integrator_time(dirty) &&
                   same_bits(kt_integrator_state(clean), kt_integrator_state(dirty), 4);
        }
        kt_check_true(m->name, same);
    }
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static kt_status place_status(const char *method, size_t n, const kt_integrator_options *options, size_t missing,
                              kt_error *error) {
    const kt_method *m = kt_method_find(method);
    const size_t size = kt_integrator_size(m, n == 0 ? 1 : n);
    void *memory = malloc(size);
    kt_integrator *it = NULL;
    const kt_status status = kt_integrator_init(memory, size - missing, m, n, options, &it, error);
    kt_check_true("integrator is set on success only", (status == KT_OK) == (it != NULL));
    free(memory);
    return status;
}

KT_TEST(wrong_options_are_rejected_with_words) {
    kt_error error;
    static const double zero[2] = {1.0, 0.0}, negative[2] = {1.0, -1.0};
#define KT_REJECTD(part, change)                                                                                       \
    do {                                                                                                               \
        kt_integrator_options o = kt_integrator_options_default();                                                     \
        change;                                                                                                        \
        kt_check_equal_int(#change, place_status("dopri5", 2, &o, 0, &error), KT_ERROR_ARGUMENT);                      \
        kt_check_contains("words", error.message, part);                                                               \
    } while (0)
    KT_REJECTD("step must be", o.step = -0.1);
    KT_REJECTD("step must be", o.step = (double)NAN);
    KT_REJECTD("tolerances must be", o.relative_tolerance = -1.0);
    KT_REJECTD("tolerances must be", o.absolute_tolerance = HUGE_VAL);
    KT_REJECTD("one of the tolerances", o.absolute_tolerance = o.relative_tolerance = 0.0);
    KT_REJECTD("absolute_tolerances[1] is -1", o.absolute_tolerances = negative);
    KT_REJECTD("absolute_tolerances[1] is 0", (o.absolute_tolerances = zero, o.relative_tolerance = 0.0));
    KT_REJECTD("initial_step, min_step and max_step", o.initial_step = -1.0);
    KT_REJECTD("initial_step, min_step and max_step", o.min_step = (double)NAN);
    KT_REJECTD("initial_step, min_step and max_step", o.max_step = HUGE_VAL);
    KT_REJECTD("max_step must not be below", (o.max_step = 0.1, o.min_step = 0.2));
    KT_REJECTD("safety", o.safety = 1.0);
    KT_REJECTD("alpha", o.alpha = 0.0);
    KT_REJECTD("beta", o.beta = 1.0);
    KT_REJECTD("factor_min", o.factor_min = 1.0);
    KT_REJECTD("factor_max", o.factor_max = 1.0);
#undef KT_REJECTD
    kt_integrator_options o = kt_integrator_options_default();
    kt_check_equal_int("no estimate", place_status("rk4", 2, &o, 0, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "method 'rk4' has no error estimate; give a step");
    kt_check_equal_int("no equation", place_status("dopri5", 0, &o, 0, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("memory", place_status("dopri5", 2, &o, 1, &error), KT_ERROR_MEMORY);
    kt_check_contains("words", error.message, "kt_integrator_size needs");
    kt_check_equal_int("as they are", place_status("dopri5", 2, &o, 0, &error), KT_OK);
    o.relative_tolerance = 0.0;
    kt_check_equal_int("absolute alone", place_status("dopri5", 2, &o, 0, &error), KT_OK);
}

KT_TEST(a_start_that_is_rejected_changes_nothing) {
    kt_error error;
    kt_integrator *it = integrator_begin(kt_method_find("rk4"), &problem_kepler, fixed_step(0.1));
    integrate_to(it, 0.3);
    double before[4];
    memcpy(before, kt_integrator_state(it), sizeof before);
    const double bad[4] = {1.0, 2.0, (double)NAN, 3.0};
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL}, none = {NULL, NULL, NULL};
    kt_check_equal_int("NaN", kt_integrator_start(it, 0.0, bad, &callbacks, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("words", error.message, "y[2] = ");
    kt_check_equal_int("jump", kt_integrator_jump(it, bad, &error), KT_ERROR_NOT_FINITE);
    kt_check_equal_int("time", kt_integrator_start(it, HUGE_VAL, before, &callbacks, &error), KT_ERROR_NOT_FINITE);
    kt_check_equal_int("no rhs", kt_integrator_start(it, 0.0, before, &none, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no state", kt_integrator_start(it, 0.0, NULL, &callbacks, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_bits("state", kt_integrator_state(it), before, 4);
    kt_check_near("time", kt_integrator_time(it), 0.3, 0.0);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

static bool unit_circle(double *y) {
    const double r = sqrt(y[0] * y[0] + y[1] * y[1]);
    if (fabs(r - 1.0) < 1e-9)
        return false;
    y[0] /= r;
    y[1] /= r;
    return true;
}

static int turn(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = -(1.0 + sin(t)) * y[1];
    dydt[1] = (1.0 + sin(t)) * y[0];
    return 0;
}

static int onto_circle(double t, double *y, bool *changed, void *user) {
    (void)t;
    (void)user;
    *changed = unit_circle(y);
    return 0;
}

/* At every step a fresh integrator takes over, with or without the previous state, and the old one goes on, too.
 */
static void check_restore(const kt_method *m, const kt_integrator_options *options, bool with_previous) {
    kt_error error;
    const kt_integrator_callbacks callbacks = {turn, onto_circle, NULL};
    kt_integrator *it = integrator_make(m, 2, *options);
    kt_fine("start", kt_integrator_start(it, 0.0, (double[]){1.0, 0.0}, &callbacks, &error), &error);
    bool same = true;
    for (int k = 0; k < 15; k++) {
        kt_integrator_memory memory;
        double y[2], previous[2], history[HISTORY_MAX], value[2][2];
        integrator_step(it, k % 3 == 2 ? kt_integrator_time(it) + 0.03 : HUGE_VAL);
        kt_integrator_save(it, &memory, y, with_previous ? previous : NULL, history);
        kt_integrator *other = integrator_make(m, 2, *options);
        kt_fine("restore",
                kt_integrator_restore(other, &memory, y, with_previous ? previous : NULL, history, &callbacks, &error),
                &error);
        const double t = 0.3 * kt_integrator_previous_time(it) + 0.7 * kt_integrator_time(it);
        if (with_previous) {
            integrator_value(it, t, value[0]);
            integrator_value(other, t, value[1]);
            same = same && same_bits(value[0], value[1], 2);
        } else
            same = same && kt_integrator_interpolate(other, t, value[1], NULL) == KT_ERROR_ARGUMENT;
        for (int l = 0; l < 3; l++) {
            integrator_step(it, HUGE_VAL);
            integrator_step(other, HUGE_VAL);
            const kt_integrator_memory *a = kt_integrator_memory_of(it), *b = kt_integrator_memory_of(other);
            same = same && same_bits(kt_integrator_state(it), kt_integrator_state(other), 2) && a->t == b->t &&
                   a->next_step == b->next_step && a->control_error == b->control_error && a->grid == b->grid &&
                   a->counts.steps == b->counts.steps;
        }
        double remembered[2][HISTORY_MAX] = {{0.0}, {0.0}};
        kt_integrator_save(it, &memory, y, NULL, remembered[0]);
        kt_integrator_save(other, &memory, y, NULL, remembered[1]);
        same = same && same_bits(remembered[0], remembered[1], HISTORY_MAX);
    }
    kt_check_true(m->name, same);
}

KT_TEST(a_restored_integrator_goes_on_with_the_same_bits) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const kt_integrator_options fixed = fixed_step(0.07), adaptive = tolerance(1e-5, 1e-5);
        check_restore(m, &fixed, true);
        check_restore(m, &fixed, false);
        if (m->e != NULL) {
            check_restore(m, &adaptive, true);
            check_restore(m, &adaptive, false);
        }
    }
}

KT_TEST(a_damaged_checkpoint_is_rejected) {
    kt_error error;
    kt_integrator *it = integrator_begin(kt_method_find("dopri5"), &problem_kepler, tolerance(1e-5, 1e-5));
    const kt_integrator_callbacks callbacks = {problem_kepler.rhs, NULL, NULL};
    integrate_to(it, 1.0);
    kt_integrator_memory good, bad;
    double y[4], wrong[4] = {0.0, 0.0, HUGE_VAL, 0.0};
    kt_integrator_save(it, &good, y, NULL, NULL);
    bad = good;
    bad.t = (double)NAN;
    kt_check_equal_int("t", kt_integrator_restore(it, &bad, y, NULL, NULL, &callbacks, &error), KT_ERROR_NOT_FINITE);
    bad = good;
    bad.next_step = -1.0;
    kt_check_equal_int("step", kt_integrator_restore(it, &bad, y, NULL, NULL, &callbacks, &error), KT_ERROR_ARGUMENT);
    bad = good;
    bad.control_error = 0.0;
    kt_check_equal_int("error", kt_integrator_restore(it, &bad, y, NULL, NULL, &callbacks, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("y", kt_integrator_restore(it, &good, wrong, NULL, NULL, &callbacks, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_equal_int("y", kt_integrator_restore(it, &good, y, wrong, NULL, &callbacks, &error), KT_ERROR_NOT_FINITE);
    kt_check_equal_bits("state", kt_integrator_state(it), y, 4);
    kt_check_equal_int("good", kt_integrator_restore(it, &good, y, NULL, NULL, &callbacks, &error), KT_OK);
}

/* Memories are written to files byte by byte, so no byte of them may be indeterminate. */
KT_TEST(a_memory_has_no_padding) {
    const size_t fields = 8 * sizeof(double) + 3 * sizeof(int64_t) + 2 * sizeof(int32_t) + sizeof(kt_integrator_counts);
    kt_check_equal_int("bytes", (long long)sizeof(kt_integrator_memory), (long long)fields);
    kt_check_equal_int("bytes", (long long)sizeof(kt_integrator_counts), 7 * 8);
}

/* ---- jumps ------------------------------------------------------------------------------------------------------- */

/* A ball that is thrown back: after the jump the motion is that of an integrator started there, step for step. */
KT_TEST(a_jump_keeps_the_time_and_forgets_the_rest) {
    kt_error error;
    kt_integrator_options options = tolerance(1e-7, 1e-7);
    const kt_integrator_callbacks callbacks = {turn, NULL, NULL};
    kt_integrator *it = integrator_make(kt_method_find("tsit5"), 2, options);
    kt_fine("start", kt_integrator_start(it, 0.0, (double[]){1.0, 0.0}, &callbacks, &error), &error);
    integrate_to(it, 1.25);
    const double next = kt_integrator_memory_of(it)->next_step, y[2] = {0.0, -1.0};
    kt_fine("jump", kt_integrator_jump(it, y, &error), &error);
    kt_check_near("time", kt_integrator_time(it), 1.25, 0.0);
    kt_check_equal_bits("state", kt_integrator_state(it), y, 2);
    kt_check_near("proposal", kt_integrator_memory_of(it)->next_step, next, 0.0);
    kt_check_equal_int("no previous state", kt_integrator_memory_of(it)->has_previous, 0);
    kt_check_equal_int("no value before", kt_integrator_interpolate(it, 1.24, (double[2]){0.0, 0.0}, &error),
                       KT_ERROR_ARGUMENT);

    options.initial_step = next;
    kt_integrator *other = integrator_make(kt_method_find("tsit5"), 2, options);
    kt_fine("start", kt_integrator_start(other, 1.25, y, &callbacks, &error), &error);
    for (int k = 0; k < 10; k++) {
        integrator_step(it, HUGE_VAL);
        integrator_step(other, HUGE_VAL);
    }
    kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(other), 2);
    kt_check_near("time", kt_integrator_time(it), kt_integrator_time(other), 0.0);
}

KT_TEST(a_jump_keeps_the_grid) {
    kt_error error;
    kt_integrator *it = integrator_begin(kt_method_find("rk4"), &problem_kepler, fixed_step(0.1));
    integrate_to(it, 0.25);
    kt_fine("jump", kt_integrator_jump(it, kt_integrator_state(it), &error), &error);
    integrator_step(it, HUGE_VAL);
    kt_check_near("time", kt_integrator_time(it), 3.0 * 0.1, 0.0);
}
