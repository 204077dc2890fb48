/* Rejected tries and failed steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const char *const adaptive[] = {"heun", "rkc2", "bs32", "rkc4", "dopri5", "tsit5", "radau5", "dop853"};
enum { ADAPTIVE = sizeof adaptive / sizeof *adaptive };

/* A problem that can be made to fail: at the call `at` (counted from 1), or beyond a time. */
typedef struct trap {
    const problem *p;
    int calls, at;
    double beyond; /* infinite: nowhere */
    int code;      /* the code that the callback then returns */
    bool poison;   /* or a value that is not finite */
    bool project;  /* the projection goes wrong, not the right-hand side */
} trap;

static int trapped(double t, const double *y, double *dydt, void *user) {
    trap *f = user;
    const int code = f->p->rhs(t, y, dydt, NULL);
    f->calls++;
    if (f->calls != f->at && (f->project || !(t > f->beyond)))
        return code;
    if (f->poison)
        dydt[f->p->n - 1] = (double)NAN;
    return f->code;
}

static int trapped_projection(double t, double *y, bool *changed, void *user) {
    const trap *f = user;
    *changed = false;
    if (!(t > f->beyond))
        return 0;
    if (f->poison) {
        y[0] = HUGE_VAL;
        *changed = true;
    }
    return f->code;
}

static kt_integrator *trap_begin(const kt_method *m, trap *f, kt_integrator_options options) {
    kt_error error;
    double y[PROBLEM_MAX];
    f->p->solution(f->p->start, y);
    const kt_integrator_callbacks callbacks = {trapped, f->project ? trapped_projection : NULL, f};
    kt_integrator *it = integrator_make(m, f->p->n, options);
    kt_fine("start", kt_integrator_start(it, f->p->start, y, &callbacks, &error), &error);
    return it;
}

/* ---- rejected tries ---------------------------------------------------------------------------------------------- */

/* The step that is accepted in the end has the bits of the same step taken at once. */
static void check_no_trace(const char *what, const char *method, trap f, double first_step) {
    kt_integrator_options options = tolerance(1e-6, 1e-6);
    options.initial_step = first_step;
    kt_integrator *it = trap_begin(kt_method_find(method), &f, options);
    integrator_step(it, HUGE_VAL);
    kt_note("%s: %s", method, what);
    kt_check_above("rejected", (double)kt_integrator_counts_of(it).rejected, 1.0);
    const kt_integrator_memory *memory = kt_integrator_memory_of(it);
    kt_check_below("proposal, over the step", memory->next_step / memory->last_step, 1.0);

    trap harmless = {.p = f.p, .beyond = HUGE_VAL, .project = f.project};
    options.initial_step = kt_integrator_memory_of(it)->last_step;
    kt_integrator *at_once = trap_begin(kt_method_find(method), &harmless, options);
    integrator_step(at_once, HUGE_VAL);
    kt_check_equal_int("rejected at once", (long long)kt_integrator_counts_of(at_once).rejected, 0);
    kt_check_near("time", kt_integrator_time(it), kt_integrator_time(at_once), 0.0);
    kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(at_once), f.p->n);
    const double t[1] = {f.p->start + 0.3 * options.initial_step};
    double y[2][PROBLEM_MAX];
    integrator_value(it, t[0], y[0]);
    integrator_value(at_once, t[0], y[1]);
    kt_check_equal_bits("value within", y[0], y[1], f.p->n);
}

KT_TEST(a_rejected_try_leaves_no_trace) {
    const trap none = {.p = &problem_chirp, .beyond = HUGE_VAL};
    trap fence = {.p = &problem_kepler, .beyond = 0.02, .code = 7};
    trap hole = {.p = &problem_kepler, .beyond = 0.02, .poison = true};
    for (int i = 0; i < ADAPTIVE; i++) {
        check_no_trace("error too large", adaptive[i], none, 0.6);
        check_no_trace("right-hand side rejects", adaptive[i], fence, 0.05);
        check_no_trace("right-hand side is not finite", adaptive[i], hole, 0.05);
        fence.project = hole.project = true;
        check_no_trace("projection rejects", adaptive[i], fence, 0.05);
        check_no_trace("projection is not finite", adaptive[i], hole, 0.05);
        fence.project = hole.project = false;
    }
}

/* ---- failed steps ------------------------------------------------------------------------------------------------ */

typedef struct snapshot {
    kt_integrator_memory memory;
    double y[PROBLEM_MAX], history[HISTORY_MAX], within[3][PROBLEM_MAX];
} snapshot;

static void look(kt_integrator *it, snapshot *s) {
    memset(s, 0, sizeof *s);
    kt_integrator_save(it, &s->memory, s->y, NULL, s->history);
    s->memory.counts = (kt_integrator_counts){0};
    for (int i = 0; i < 3; i++) {
        const double t = s->memory.previous_t + (0.2 + 0.35 * i) * (s->memory.t - s->memory.previous_t);
        integrator_value(it, t, s->within[i]);
    }
}

static bool same_memory(const kt_integrator_memory *a, const kt_integrator_memory *b) {
    return a->t == b->t && a->previous_t == b->previous_t && a->origin == b->origin && a->grid == b->grid &&
           a->last_step == b->last_step && a->next_step == b->next_step &&
           (a->last_error == b->last_error || (isnan(a->last_error) && isnan(b->last_error))) &&
           a->control_error == b->control_error && a->on_grid == b->on_grid && a->has_previous == b->has_previous;
}

static bool same(const snapshot *a, const snapshot *b) {
    return same_memory(&a->memory, &b->memory) && same_bits(a->y, b->y, PROBLEM_MAX) &&
           same_bits(a->within[0], b->within[0], 3 * PROBLEM_MAX);
}

/* The callback stops at its first, second, ... call in the sixth step, until the step gets through. */
static void check_stopped_step(const kt_method *m, const kt_integrator_options *options, bool looks_between) {
    kt_error error;
    trap f = {.p = &problem_kepler, .beyond = HUGE_VAL}, g = f;
    kt_integrator *it = trap_begin(m, &f, *options), *undisturbed = trap_begin(m, &g, *options);
    for (int i = 0; i < 5; i++) {
        integrator_step(it, 4.0);
        integrator_step(undisturbed, 4.0);
    }
    snapshot before, after;
    look(undisturbed, &before);
    f.code = -3;
    bool as_before = true;
    kt_status status;
    int stops = 0;
    do {
        f.calls = 0;
        f.at = stops + 1;
        status = kt_integrator_step(it, 4.0, &error);
        f.at = 0;
        if (status == KT_OK)
            break;
        stops++;
        if (looks_between || stops == 1) {
            look(it, &after);
            as_before = as_before && same(&before, &after);
        }
    } while (status == KT_ERROR_CALLBACK && stops < 100);
    kt_check_true(m->name, as_before);
    kt_check_equal_int("status in the end", status, KT_OK);
    /* With looks the new slope is computed before the step. Without, one more stage is evaluated unless it is fsal. */
    kt_check_above(
        "stops", stops,
        m->steps > 0
            ? 1.0
            : fmax(1.0, m->stages - (kt_method_stages_vary(m)
                                         ? 2
                                         : 1))); /* of rkc2 and of multistep methods as few as two evaluations */
    integrator_step(undisturbed, 4.0);
    look(undisturbed, &before);
    look(it, &after);
    kt_check_true("the step itself is undisturbed", same(&before, &after));
}

KT_TEST(a_stopped_step_leaves_everything_as_it_was) {
    for (int i = 0; i < kt_method_count() + ADAPTIVE; i++) {
        const bool fixed = i < kt_method_count();
        const kt_method *m = fixed ? kt_method_at(i) : kt_method_find(adaptive[i - kt_method_count()]);
        const kt_integrator_options options = fixed ? fixed_step(0.03) : tolerance(1e-5, 1e-5);
        kt_note("%s", fixed ? "fixed" : "adaptive");
        check_stopped_step(m, &options, true);
        check_stopped_step(m, &options, false);
    }
}

/* ---- the outcomes of callbacks ----------------------------------------------------------------------------------- */

static kt_status outcome(const char *method, double step, trap f, kt_error *error) {
    kt_integrator *it = trap_begin(kt_method_find(method), &f, step > 0.0 ? fixed_step(step) : tolerance(1e-6, 1e-6));
    kt_status status = KT_OK;
    while (status == KT_OK && kt_integrator_time(it) < 1.0)
        status = kt_integrator_step(it, 1.0, error);
    kt_check_below("time before the trap", kt_integrator_time(it), fmin(1.0, f.beyond));
    return status;
}

KT_TEST(callbacks_go_on_reject_or_stop) {
    kt_error error;
    for (int project = 0; project <= 1; project++) {
        trap f = {.p = &problem_kepler, .beyond = HUGE_VAL, .project = project};
        kt_note("%s", project ? "the projection" : "the right-hand side");
        kt_check_equal_int("fixed, 0", outcome("rk4", 0.1, f, &error), KT_OK);
        kt_check_equal_int("adaptive, 0", outcome("dopri5", 0.0, f, &error), KT_OK);
        f.beyond = 0.54;
        f.code = -4;
        const char *stopped = project ? "the projection stopped (code -4)" : "the right-hand side stopped (code -4)";
        kt_check_equal_int("fixed, < 0", outcome("rk4", 0.1, f, &error), KT_ERROR_CALLBACK);
        kt_check_contains("words", error.message, stopped);
        kt_check_contains("where", error.where, project ? "t = 0.6" : "t = 0.55"); /* the end, or a stage */
        kt_check_equal_int("adaptive, < 0", outcome("dopri5", 0.0, f, &error), KT_ERROR_CALLBACK);
        kt_check_contains("words", error.message, stopped);
        f.code = 5;
        kt_check_equal_int("fixed, > 0", outcome("rk4", 0.1, f, &error), KT_ERROR_CALLBACK);
        kt_check_contains("words", error.message,
                          "could not be computed (code 5); the step is fixed: take a smaller one");
        kt_check_equal_int("adaptive, > 0", outcome("dopri5", 0.0, f, &error), KT_ERROR_STEP);
        kt_check_contains("words", error.message,
                          project ? "the projection could not be computed at t = 0.54"
                                  : "the right-hand side could not be computed at t = 0.54");
        kt_check_contains("where", error.where, "t = 0.53999");
    }
}

KT_TEST(a_value_that_is_not_finite_is_named_with_its_time) {
    kt_error error;
    trap f = {.p = &problem_kepler, .beyond = 0.51, .poison = true};
    kt_check_equal_int("right-hand side, fixed", outcome("rk4", 0.1, f, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("component", error.message, "component 3 of the right-hand side is not finite");
    kt_check_contains("where", error.where, "t = 0.55");
    kt_check_equal_int("right-hand side, adaptive", outcome("dopri5", 0.0, f, &error), KT_ERROR_STEP);
    kt_check_contains("component", error.message, "component 3 of the right-hand side was not finite at t = 0.51");
    f.project = true;
    kt_check_equal_int("projection, fixed", outcome("rk4", 0.1, f, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("component", error.message, "component 0 of the projected state is not finite");
    kt_check_contains("where", error.where, "t = 0.6");
    kt_check_equal_int("projection, adaptive", outcome("dopri5", 0.0, f, &error), KT_ERROR_STEP);
    kt_check_contains("component", error.message, "component 0 of the projected state was not finite at t = 0.51");
}

/* y' = y^2, y = 1 / (1 - t) */
static int explosion(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = y[0] * y[0];
    return 0;
}

static kt_status explode(const char *method, const kt_integrator_options *options, kt_integrator **it,
                         kt_error *error) {
    const kt_integrator_callbacks callbacks = {explosion, NULL, NULL};
    *it = integrator_make(kt_method_find(method), 1, *options);
    kt_fine("start", kt_integrator_start(*it, 0.0, (double[]){1.0}, &callbacks, error), error);
    kt_status status = KT_OK;
    while (status == KT_OK && kt_integrator_time(*it) < 2.0)
        status = kt_integrator_step(*it, 2.0, error);
    return status;
}

KT_TEST(a_pole_ends_in_a_step_that_is_too_small) {
    for (int i = 0; i < ADAPTIVE; i++) {
        kt_error error;
        kt_integrator *it;
        const kt_integrator_options options = tolerance(1e-4, 1e-4);
        kt_check_equal_int(adaptive[i], explode(adaptive[i], &options, &it, &error), KT_ERROR_STEP);
        kt_check_contains("words", error.message, "Look for a jump or a pole of a force");
        kt_check_true("implicit methods are not sent to radau5",
                      (strstr(error.message, "radau5") == NULL) == kt_method_is_implicit(kt_method_find(adaptive[i])));
        kt_check_contains("time", error.where, "t = ");
        kt_check_near("time", kt_integrator_time(it), 1.0,
                      strcmp(adaptive[i], "rkc2") == 0 ? 2e-3 : 1e-3); /* the global error, magnified by y */
        const double y = kt_integrator_state(it)[0], next = kt_integrator_memory_of(it)->next_step;
        kt_check_equal_int("again", kt_integrator_step(it, 2.0, &error), KT_ERROR_STEP);
        kt_check_near("state", kt_integrator_state(it)[0], y, 0.0);
        kt_check_near("proposal", kt_integrator_memory_of(it)->next_step, next, 0.0);
    }
}

/* The slope of y0 is negative above 0 and positive below, so y0 jumps back and forth there. Its size and y1' are 1. */
static int chatter(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = y[0] > 0.0 ? -1.0 : 1.0;
    dydt[1] = 1.0;
    return 0;
}

/* Steps are accepted, but no longer than the jump allows, some 1e-13 s. A run of 1 s would take 1e13 steps. */
KT_TEST(a_motion_that_does_not_get_on_ends_after_a_bounded_number_of_tries) {
    const kt_integrator_callbacks callbacks = {chatter, NULL, NULL};
    for (int i = 0; i < ADAPTIVE; i++) {
        kt_error error;
        kt_status status = KT_OK;
        kt_integrator *it = integrator_make(kt_method_find(adaptive[i]), 2, tolerance(0.0, 1e-14));
        kt_fine("start", kt_integrator_start(it, 0.0, (double[]){0.1, 1.0}, &callbacks, &error), &error);
        double before[2] = {0.0, 0.0};
        while (status == KT_OK && kt_integrator_time(it) < 1.0) {
            memcpy(before, kt_integrator_state(it), sizeof before);
            status = kt_integrator_step(it, 1.0, &error);
        }
        const kt_integrator_counts counts = kt_integrator_counts_of(it);
        kt_check_equal_int(adaptive[i], status, KT_ERROR_STEP);
        if (kt_method_is_implicit(kt_method_find(adaptive[i]))) { /* its iteration jumps back and forth, too */
            kt_check_contains("words", error.message, "Newton's iteration did not converge. Look for a jump");
            kt_check_below("tries", (double)(counts.steps + counts.rejected), 20000.0);
            continue;
        }
        kt_check_contains("words", error.message, "the last 10000 tries of a step have advanced the time by");
        kt_check_contains("words", error.message,
                          "more would be needed: the motion makes no progress. Look for a jump");
        kt_check_equal_int("component", (long long)kt_integrator_blamed(it), 0);
        kt_check_equal_int("tries", (long long)(counts.steps + counts.rejected), 20000);
        kt_check_equal_bits("state", kt_integrator_state(it), before, 2);
        integrator_step(it, 1.0); /* another window of tries */
    }
}

static int no_motion(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)y;
    (void)user;
    dydt[0] = dydt[1] = 0.0;
    return 0;
}

/* At rest, each step is longer than the last one by the largest factor. */
KT_TEST(steps_without_a_limit_end_before_the_largest_number) {
    static const char *const methods[] = {"dopri5", "rkc4", "rodas5p"};
    const kt_integrator_callbacks callbacks = {no_motion, NULL, NULL};
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        kt_error error;
        kt_status status = KT_OK;
        kt_integrator *it = integrator_make(kt_method_find(methods[i]), 2, tolerance(1e-6, 1e-6));
        kt_fine("start", kt_integrator_start(it, 0.0, (double[]){1.0, 2.0}, &callbacks, &error), &error);
        for (int k = 0; k < 2000 && status == KT_OK; k++)
            status = kt_integrator_step(it, HUGE_VAL, &error);
        kt_check_equal_int(methods[i], status, KT_ERROR_STEP);
        kt_check_contains("words", error.message, "leads beyond the largest number");
        kt_check_true("the time is finite", isfinite(kt_integrator_time(it)));
        if (kt_method_is_implicit(kt_method_find(methods[i]))) /* Newton's matrix has the reciprocal of the step */
            continue;
        kt_fine("again", kt_integrator_start(it, 0.0, (double[]){1.0, 2.0}, &callbacks, &error), &error);
        kt_fine("the least step", kt_integrator_step(it, DBL_TRUE_MIN, &error), &error);
        kt_check_true("time", kt_integrator_time(it) == DBL_TRUE_MIN);
    }
}

static int oscillation(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = y[1];
    dydt[1] = -y[0];
    return 0;
}

/* A smooth motion with steps of some 0.1 s would take 1e13 of them to 1e12 s: only the end of the run is wrong. */
KT_TEST(a_run_of_too_many_steps_is_advised_to_end_earlier) {
    kt_error error = {0};
    kt_status status = KT_OK;
    kt_integrator *it = integrator_start(kt_method_find("dopri5"), 2, tolerance(1e-9, 1e-9), oscillation, NULL, 0.0,
                                         (double[]){1.0, 0.0});
    while (status == KT_OK && kt_integrator_time(it) < 1e6)
        status = kt_integrator_step(it, 1e12, &error);
    kt_check_equal_int("status", status, KT_ERROR_STEP);
    kt_check_contains("words", error.message,
                      "more would be needed: the run is too long for steps of this length. Loosen the tolerances, or "
                      "end the run earlier");
    kt_check_equal_int("no component is to blame", (long long)kt_integrator_blamed(it), 2);
}

static int constant(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)y;
    (void)user;
    dydt[0] = 0.0;
    return 0;
}

/* The status after `tries` tries of steps no longer than h, from t. */
static kt_status creep_for(int tries, double t, double h, double t_limit) {
    kt_error error;
    kt_status status = KT_OK;
    kt_integrator_options options = tolerance(1e-6, 1e-6);
    options.initial_step = options.max_step = h;
    kt_integrator *it = integrator_start(kt_method_find("bs32"), 1, options, constant, NULL, t, (double[]){1.0});
    for (int i = 0; status == KT_OK && i < tries; i++)
        status = kt_integrator_step(it, t_limit, &error);
    return status;
}

static kt_status creep(double t, double h, double t_limit) { return creep_for(10001, t, h, t_limit); }

KT_TEST(a_ten_thousand_millionth_of_the_time_a_try_is_progress) {
    kt_check_equal_int("0.99e-10 of the limit", creep(0.0, 0.99e-10 * 3.0, 3.0), KT_ERROR_STEP);
    kt_check_equal_int("1.01e-10 of the limit", creep(0.0, 1.01e-10 * 3.0, 3.0), KT_OK);
    kt_check_equal_int("0.99e-10 of now", creep(3.0, 0.99e-10 * 3.0, HUGE_VAL), KT_ERROR_STEP);
    kt_check_equal_int("1.01e-10 of now", creep(3.0, 1.01e-10 * 3.0, HUGE_VAL), KT_OK);
    kt_check_equal_int("backwards, 0.99e-10 of the limit", creep(-3.0, 0.99e-10 * 6.0, -6.0), KT_ERROR_STEP);
}

KT_TEST(a_thousand_millionth_of_the_time_a_try_is_no_progress_in_the_long_run) {
    kt_check_equal_int("0.99e-9, four windows of tries", creep_for(49999, 0.0, 0.99e-9 * 3.0, 3.0), KT_OK);
    kt_check_equal_int("0.99e-9, five windows of tries", creep_for(50001, 0.0, 0.99e-9 * 3.0, 3.0), KT_ERROR_STEP);
    kt_check_equal_int("1.01e-9, five windows of tries", creep_for(50001, 0.0, 1.01e-9 * 3.0, 3.0), KT_OK);
}

KT_TEST(a_state_that_overflows_is_not_committed) {
    kt_error error;
    kt_integrator *it;
    const kt_integrator_options options = fixed_step(0.5);
    kt_check_equal_int("status", explode("rk4", &options, &it, &error), KT_OK); /* 4 steps: 1e9 or so */
    kt_status status = KT_OK;
    while (status == KT_OK && kt_integrator_time(it) < 100.0)
        status = kt_integrator_step(it, HUGE_VAL, &error);
    kt_check_equal_int("status", status, KT_ERROR_NOT_FINITE);
    kt_check_contains("words", error.message, "not finite; the step is fixed");
    kt_check_true("finite", isfinite(kt_integrator_state(it)[0]));
}

static int steep(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)y;
    (void)user;
    dydt[0] = DBL_MAX;
    return 0;
}

/* All slopes are finite, the sum is not. */
KT_TEST(a_sum_that_overflows_is_not_committed) {
    for (int i = 0; i < kt_method_count(); i++) {
        kt_error error;
        kt_integrator *it = integrator_start(kt_method_at(i), 1, fixed_step(4.0), steep, NULL, 0.0, (double[]){3.0});
        kt_check_equal_int(kt_method_at(i)->name, kt_integrator_step(it, HUGE_VAL, &error), KT_ERROR_NOT_FINITE);
        kt_check_contains("words", error.message, "component 0 of the new state is not finite");
        kt_check_near("state", kt_integrator_state(it)[0], 3.0, 0.0);
    }
}

/* The second evaluation of an adaptive integration is that of the automatic first step. */
KT_TEST(a_stop_while_the_first_step_is_chosen_is_heeded) {
    for (int i = 0; i < ADAPTIVE; i++) {
        kt_error error;
        trap f = {.p = &problem_kepler, .beyond = HUGE_VAL, .at = 2, .code = -3}, g = f;
        g.at = 0;
        const kt_integrator_options options = tolerance(1e-6, 1e-6);
        kt_integrator *it = trap_begin(kt_method_find(adaptive[i]), &f, options);
        kt_integrator *undisturbed = trap_begin(kt_method_find(adaptive[i]), &g, options);
        kt_check_equal_int(adaptive[i], kt_integrator_step(it, 1.0, &error), KT_ERROR_CALLBACK);
        kt_check_near("time", kt_integrator_time(it), 0.0, 0.0);
        integrator_step(it, 1.0);
        integrator_step(undisturbed, 1.0);
        kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(undisturbed), 4);
    }
}

KT_TEST(steps_can_be_limited_in_number_and_from_below) {
    kt_error error;
    kt_integrator *it;
    kt_integrator_options options = tolerance(1e-4, 1e-4);
    options.max_steps = 20;
    kt_check_equal_int("max_steps", explode("dopri5", &options, &it, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "max_steps = 20 are used up");
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_check_equal_int("tries", (long long)counts.steps + (long long)counts.rejected, 20);
    options.max_steps = 0;
    options.min_step = 1e-3;
    kt_check_equal_int("min_step", explode("dopri5", &options, &it, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "a step below 0.001 would be needed: the error estimate was still");
    kt_check_above("last step", kt_integrator_memory_of(it)->last_step, 1e-3 * (1.0 - 1e-12));
}

KT_TEST(calls_out_of_order_are_rejected) {
    kt_error error;
    double y[4] = {1.0, 2.0, 3.0, 4.0};
    const kt_integrator_options options = fixed_step(0.1);
    kt_integrator *it = integrator_make(kt_method_find("rk4"), 4, options);
    kt_check_equal_int("step", kt_integrator_step(it, 1.0, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "kt_integrator_start first");
    kt_check_equal_int("interpolate", kt_integrator_interpolate(it, 0.0, y, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("jump", kt_integrator_jump(it, y, &error), KT_ERROR_ARGUMENT);
    it = integrator_begin(kt_method_find("rk4"), &problem_kepler, options);
    kt_check_equal_int("no way to go", kt_integrator_step(it, 0.0, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("NaN", kt_integrator_step(it, (double)NAN, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("nothing was evaluated", (long long)kt_integrator_counts_of(it).evaluations, 0);
}
