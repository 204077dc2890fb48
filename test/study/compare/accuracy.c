/* Accuracy studies of mechanisms with exact answers. These are a pendulum by elliptic functions, a stiff oscillator by
 * the methods' stability polynomials, and a double pendulum that is chaotic.
 *
 * The pendulum is let go at rest from the angle a (Landau and Lifshitz, Mechanics, section 11):
 *     u(t) = 2 asin(k cd(w t | k^2)),  k = sin(a / 2),  w^2 = g / l
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"
#include "sanitized.h"

#include "kinetree/study.h"

#include <math.h>
#include <string.h>

#include <gsl/gsl_errno.h>
#include <gsl/gsl_sf_elljac.h>

static const double g = 9.81, start_angle = 1.5;

typedef struct bench {
    kt_body bodies[2];
    kt_effect effects[2];
    kt_description description;
    kt_run run;
    kt_accuracy_options options;
    kt_error error;
    kt_status status;
    kt_accuracy *study;
    const kt_accuracy_results *results;
} bench;

static kt_body make_bob(const char *name, const char *parent, double angle) {
    kt_body body = kt_body_of(name, parent, KT_JOINT_REVOLUTE, 1.0);
    body.joint.at = parent != NULL ? kt_vec3_make(0.0, -1.0, 0.0) : kt_vec3_make(0.0, 0.0, 0.0);
    body.joint.position[0] = angle;
    body.com = kt_vec3_make(0.0, -1.0, 0.0);
    return body;
}

/* Point masses on links of 1 m. */
static void make_pendulum(bench *b, int count, double angle, double duration) {
    memset(b, 0, sizeof *b);
    b->bodies[0] = make_bob("upper", NULL, angle);
    b->bodies[1] = make_bob("lower", "upper", 0.0);
    b->description = kt_description_default();
    b->description.gravity = kt_vec3_make(0.0, -g, 0.0);
    kt_describe(&b->description, b->bodies, count, NULL, 0, NULL, 0);
    b->run = kt_run_default();
    b->run.duration = duration;
    b->options = kt_accuracy_options_default();
    b->options.run_evaluations = KT_ADDRESS_SANITIZER ? 20000 : 100000;
}

/* x'' = -1001 x' - 1000 x: eigenvalues -1 and -1000. */
static void make_stiff(bench *b, double duration) {
    make_pendulum(b, 1, 0.0, duration);
    b->description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    b->bodies[0].joint.type = KT_JOINT_PRISMATIC;
    b->bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    b->bodies[0].joint.position[0] = 1.0;
    b->effects[0] = kt_effect_of(KT_EFFECT_SPRING, NULL);
    b->effects[0].between[1].body = "upper";
    b->effects[0].stiffness = 1000.0;
    b->effects[1] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, "upper");
    b->effects[1].damping = 1001.0;
    b->description.effects = b->effects;
    b->description.effect_count = 2;
}

/* Sanitizers make a study take twenty times as long. Under them, studies that need many evaluations are skipped. The
 * others run the same code. */
static bool takes_a_minute(const char *what) {
    if (KT_ADDRESS_SANITIZER)
        kt_skip(what, "a study takes a minute under sanitizers");
    return KT_ADDRESS_SANITIZER;
}

static void release_own_study(void *study) { kt_accuracy_free(study); }

static kt_status create_study(bench *b) {
    b->study = NULL;
    const kt_status status = kt_accuracy_create(&b->description, &b->run, &b->options, &b->study, &b->error);
    kt_test_own(b->study, release_own_study);
    return status;
}

/* The running test owns the study, and ends without it. */
static void make_study(bench *b) {
    b->status = create_study(b);
    if (b->status != KT_OK)
        kt_note("%s: %s", b->error.where, b->error.message);
    kt_need(kt_check_equal_int("study", b->status, KT_OK));
    b->results = kt_accuracy_results_of(b->study);
}

static const kt_accuracy_curve *curve_of(const bench *b, const char *name) {
    for (int i = 0; i < b->results->curve_count; i++)
        if (strcmp(b->results->curves[i].method->name, name) == 0)
            return &b->results->curves[i];
    return NULL;
}

/* ---- the truth --------------------------------------------------------------------------------------------------- */

static void exact(double t, double *angle, double *rate) {
    const double k = sin(0.5 * start_angle), w = sqrt(g), m = k * k;
    double sn, cn, dn;
    if (gsl_sf_elljac_e(w * t, m, &sn, &cn, &dn) != GSL_SUCCESS)
        sn = cn = dn = (double)NAN;
    const double cd = cn / dn;
    *angle = 2.0 * asin(k * cd);
    *rate = -2.0 * k * w * (1.0 - m) * sn / (dn * dn) / sqrt(1.0 - m * cd * cd);
}

static int compare(const kt_record *record, void *user) {
    double *worst = user;
    double angle, rate;
    exact(record->t, &angle, &rate);
    *worst = fmax(*worst, fabs(record->q[0] - angle));
    return 0;
}

/* The error of a pendulum's run, by the closed form; NaN after a failed check. */
static double true_error(const bench *b, const char *method, bool adaptive, double setting, int records) {
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_error error;
    kt_run run = b->run;
    double worst = 0.0;
    run.integrator = method;
    run.step = adaptive ? 0.0 : setting;
    run.relative = run.absolute = adaptive ? setting : 1.0;
    run.interval = run.duration / records;
    kt_status status = kt_model_compile(&b->description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &run, NULL, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_run(simulation, compare, &worst, &error);
    kt_check_equal_int("rerun", status, KT_OK);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status == KT_OK ? worst : (double)NAN;
}

/* ---- what the study says ----------------------------------------------------------------------------------------- */

/* The local error of an estimate of order q is C h^(q + 1), and it is held at the tolerance. The method dop853 combines
 * two estimates of orders q and r, with the error C h^(2 q - r + 1). The error of a run is C h^p. */
static double expected_slope(const kt_accuracy_curve *curve) {
    const kt_method *method = curve->method;
    if (!curve->adaptive)
        return method->order;
    if (kt_method_is_implicit(method)) /* the estimate is held at a power of the tolerance that makes it so */
        return 1.0;
    const int low = method->embedded_order_low > 0 ? method->embedded_order_low : method->embedded_order;
    return (double)method->order / (2 * method->embedded_order - low + 1);
}

/* Slopes over finite ranges of steps differ from the order by the next term of the error's expansion. For fixed steps,
 * the measured difference is at most 0.02. For tolerances, whose control is coarser, it is 0.08. For radau5, whose
 * steps are few, it is 0.2. */
KT_TEST(measured_slopes_are_the_orders) {
    bench b;
    if (takes_a_minute("orders"))
        return;
    make_pendulum(&b, 1, start_angle, 1.5);
    make_study(&b);
    for (int i = 0; i < b.results->curve_count; i++) {
        const kt_accuracy_curve *curve = &b.results->curves[i];
        kt_check_above(curve->method->name, curve->fitted, 3);
        kt_check_near(curve->method->name, curve->slope, expected_slope(curve),
                      !curve->adaptive                       ? 0.1
                      : kt_method_is_implicit(curve->method) ? 0.3
                                                             : 0.15);
    }
}

/* The errors that the study reports are those against the closed form. The settings that it recommends keep its goal
 * there. */
KT_TEST(recommended_settings_reach_their_goals) {
    static const double goals[] = {1e-3, 1e-6, 1e-9};
    bench b;
    make_pendulum(&b, 1, start_angle, 5.0);
    make_study(&b);
    for (size_t i = 0; i < sizeof goals / sizeof goals[0]; i++) {
        const int best = kt_accuracy_best(b.study, goals[i]);
        kt_need(kt_check_true("there is a setting", best >= 0));
        const kt_accuracy_point *point = &b.results->points[best];
        for (int c = 0; c < b.results->curve_count; c++) {
            const kt_accuracy_curve *curve = &b.results->curves[c];
            if (best < curve->first || best >= curve->first + curve->count)
                continue;
            const double error =
                true_error(&b, curve->method->name, curve->adaptive, point->setting, b.results->records);
            kt_note("%s with %g", curve->method->name, point->setting);
            kt_check_below("error", error, goals[i]);
            kt_check_near("as reported", point->error.position, error, b.results->uncertainty.position);
        }
    }
    kt_check_equal_int("no setting for what cannot be", b.study != NULL ? kt_accuracy_best(b.study, 1e-17) : 0, -1);
}

/* The difference of two solutions lies between the difference and the sum of their true errors. The reported
 * uncertainty is at least the better solution's error. */
KT_TEST(uncertainty_of_the_reference_is_honest) {
    bench b;
    make_pendulum(&b, 1, start_angle, 5.0);
    make_study(&b);
    const kt_accuracy_results *r = b.results;
    const double first = true_error(&b, r->reference->name, true, r->reference_tolerance, r->records);
    const double second = true_error(&b, r->check->name, true, r->check_tolerance, r->records);
    kt_note("true errors %.2g and %.2g", first, second);
    kt_check_below("the better one", fmin(first, second), r->uncertainty.position);
    kt_check_below("no more than both", r->uncertainty.position, first + second);
    kt_check_true("two methods", r->reference != r->check);
}

enum { GIVEN = 101 };

/* The closed form as the reference, moved by `off`. */
static kt_status study_with_truth(bench *b, double off, double q[GIVEN], double v[GIVEN]) {
    make_pendulum(b, 1, start_angle, 5.0);
    const kt_reference reference = {5.0 / (GIVEN - 1), GIVEN, q, v};
    const kt_method *const methods[] = {kt_method_find("rk4")};
    const double step = 0.01;
    for (int k = 0; k < GIVEN; k++) {
        exact(k * reference.interval, &q[k], &v[k]);
        q[k] += k > GIVEN / 2 ? off : 0.0;
    }
    b->options.reference = &reference;
    b->options.methods = methods;
    b->options.method_count = 1;
    b->options.steps = &step;
    b->options.step_count = 1;
    return create_study(b);
}

KT_TEST(given_reference_is_used_and_checked) {
    bench b;
    double q[GIVEN], v[GIVEN], amplitude = 1.0;
    kt_need(kt_check_equal_int("truth", study_with_truth(&b, 0.0, q, v), KT_OK));
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_true("given", r->reference == NULL);
    kt_check_equal_int("its records", r->records, GIVEN - 1);
    const double error = true_error(&b, "rk4", false, 0.01, GIVEN - 1);
    amplitude = r->amplitude;
    kt_check_near("error of rk4", r->points[0].error.position, error, 1e-12);
    kt_check_below("uncertainty: what dop853 is off at 1e-13", r->uncertainty.position, 1e-12);
    kt_need(kt_check_equal_int("a little off", study_with_truth(&b, 1e-8, q, v), KT_OK));
    kt_check_near("found", kt_accuracy_results_of(b.study)->uncertainty.position, 1e-8, 1e-12);
    kt_need(kt_check_equal_int("off from the middle on", study_with_truth(&b, 0.1, q, v), KT_OK));
    r = kt_accuracy_results_of(b.study);
    kt_check_equal_int("cut there", r->cut, KT_ACCURACY_DISAGREEMENT);
    kt_check_near("duration", r->duration, 2.5, 0.051);
    const double edges[] = {0.9e-5, 1.1e-5}; /* of the amplitude: from 1e-5 on it is another motion */
    for (int k = 0; k < 2; k++) {
        kt_need(kt_check_equal_int("next to the edge", study_with_truth(&b, edges[k] * amplitude, q, v), KT_OK));
        r = kt_accuracy_results_of(b.study);
        kt_check_equal_int("cut", r->cut, k ? KT_ACCURACY_DISAGREEMENT : KT_ACCURACY_WHOLE);
        kt_check_near("duration", r->duration, k ? 2.5 : 5.0, 0.051);
    }
    make_pendulum(&b, 1, start_angle, 5.0);
    const kt_reference wrong = {5.0 / (GIVEN - 1), GIVEN, v, q}; /* positions and velocities changed for each other */
    b.options.reference = &wrong;
    kt_check_equal_int("another motion", create_study(&b), KT_ERROR_ARGUMENT);
    kt_check_contains("in words", b.error.message, "of this scene");
}

/* A box of 1 kg rests until 5 s. Then 1000 N push it for 2 ms. At 10 s it is 4.999 m away. */
KT_TEST(reference_is_checked_with_steps_below_the_shortest_feature) {
    static const double rows[] = {0.0, 0.0, 5.0, 0.0, 5.001, 1000.0, 5.002, 0.0};
    static bench b;
    make_pendulum(&b, 1, 0.0, 10.0);
    b.options.run_evaluations = 100000;
    b.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    b.bodies[0].joint.type = KT_JOINT_PRISMATIC;
    b.effects[0] = kt_effect_of(KT_EFFECT_MOTOR, "upper");
    b.effects[0].torque = kt_function_table(rows, 8, KT_INTERPOLATION_LINEAR);
    b.description.effects = b.effects;
    b.description.effect_count = 1;
    make_study(&b);
    /* A hundredth of 1 ms would take more than the evaluations that a run may have, six a step. */
    kt_check_near("longest step of the check, s", b.results->check_step, 10.0 * 6.0 / 1e5, 1e-12);
    kt_check_near("amplitude, m", b.results->amplitude, 4.999, 1e-10);
    kt_check_below("uncertainty, m", b.results->uncertainty.position, 1e-9);
}

/* Bisection ends within 2 percent; a run past the limit must show it within its 3000 steps or so. */
KT_TEST(stability_limits_are_those_of_the_tableaus) {
    bench b;
    if (takes_a_minute("limits of stability"))
        return;
    make_stiff(&b, 5.0);
    make_study(&b);
    for (int i = 0; i < b.results->curve_count; i++) {
        const kt_accuracy_curve *curve = &b.results->curves[i];
        kt_stability stability;
        if (curve->adaptive)
            continue;
        kt_need(
            kt_check_equal_int(curve->method->name, kt_stability_make(curve->method, 2, &stability, &b.error), KT_OK));
        const double limit = kt_stability_real_limit(&stability) / 1000.0;
        if (isinf(limit)) /* implicit: no step is too long to be stable */
            kt_check_near("no limit", curve->stable_step, 0.0, 0.0);
        else
            kt_check_near("limit", curve->stable_step, limit, 0.02 * limit);
    }
}

/* dopri5's steps hover about its limit, 3.31 / 1000, at loose tolerances. */
KT_TEST(adaptive_methods_are_seen_to_be_held_by_stability) {
    bench b;
    make_stiff(&b, 5.0);
    make_study(&b);
    const kt_accuracy_curve *curve = curve_of(&b, "dopri5");
    if (curve != NULL)
        kt_check_near("mean step", curve->stable_step, 3.31e-3, 0.15 * 3.31e-3);
    make_pendulum(&b, 1, start_angle, 5.0);
    make_study(&b);
    for (int i = 0; i < b.results->curve_count; i++)
        kt_check_equal_bits(b.results->curves[i].method->name, &b.results->curves[i].stable_step, &(double){0.0}, 1);
}

/* Two bobs let go from the horizontal: from the literature a Lyapunov exponent of one or so a second at this energy. */
KT_TEST(chaotic_motion_is_cut_at_its_horizon_and_no_other) {
    const kt_method *const methods[] = {kt_method_find("dop853")};
    bench b;
    make_pendulum(&b, 2, 1.5707963267948966, 100.0);
    b.options.methods = methods;
    b.options.method_count = 1;
    make_study(&b);
    kt_check_equal_int("cut", b.results->cut, KT_ACCURACY_GROWTH);
    kt_check_near("duration", b.results->duration, 17.0, 5.0);
    kt_check_below("growth up to there", b.results->amplification, b.options.amplification);
    kt_check_above("growth up to there", b.results->amplification, 0.1 * b.options.amplification);
    kt_check_below("and the reference is still good", b.results->uncertainty.position, 1e-6);
    kt_check_equal_int("all its records", b.results->records, b.options.records);
    make_pendulum(&b, 1, start_angle, 100.0);
    b.options.methods = methods;
    b.options.method_count = 1;
    make_study(&b);
    kt_check_equal_int("a pendulum is not cut", b.results->cut, KT_ACCURACY_WHOLE);
    /* period and amplitude: errors grow in proportion to time */
    kt_check_below("growth", b.results->amplification, 1000.0);
}

/* ---- variants, budget, errors ------------------------------------------------------------------------------------ */

KT_TEST(variants_are_the_same_motion) {
    bench b;
    const kt_method *const methods[] = {kt_method_find("dopri5")};
    const double tolerance = 1e-9;
    kt_variant variants[2];
    make_pendulum(&b, 2, 1.0, 2.0);
    variants[0] = variants[1] = kt_variant_default(&b.run);
    variants[1].label = "absolute";
    variants[1].formulation = KT_FORMULATION_ABSOLUTE;
    b.options.methods = methods;
    b.options.method_count = 1;
    b.options.tolerances = &tolerance;
    b.options.tolerance_count = 1;
    b.options.variants = variants;
    b.options.variant_count = 2;
    make_study(&b);
    kt_need(kt_check_equal_int("points", b.results->point_count, 2));
    for (int i = 0; i < 2; i++) {
        const kt_accuracy_point *point = &b.results->points[i];
        kt_check_equal_int("usable", point->usable, true);
        kt_check_below("error", point->error.position, 1e-7);
        kt_check_equal_int("front is the scene's own", point->fewest, i == 0);
    }
    kt_accuracy_point measured;
    if (b.study != NULL &&
        kt_check_equal_int("measure",
                           kt_accuracy_measure(b.study, &variants[1], methods[0], true, tolerance, &measured, &b.error),
                           KT_OK))
        kt_check_equal_bits("again", &measured.error.position, &b.results->points[1].error.position, 1);
}

typedef struct ticking {
    double time;
    int told;
    int stop_at;
} ticking;

static double tick(void *user) { return ((ticking *)user)->time += 1e-3; }

static int tell(double done, const char *what, void *user) {
    ticking *ticker = user;
    kt_check_true(what, done >= 0.0 && done <= 1.0);
    return ++ticker->told == ticker->stop_at;
}

/* Smooth errors of fixed steps: the setting for a goal has nearly its error, whatever rungs the ladder has. */
KT_TEST(settings_are_refined_to_the_goals) {
    static const double goals[] = {3e-4, 7e-7};
    bench b;
    if (takes_a_minute("goals"))
        return;
    make_pendulum(&b, 1, start_angle, 2.0);
    b.options.goals = goals;
    b.options.goal_count = 2;
    make_study(&b);
    for (int c = 0; c < b.results->curve_count; c++) {
        const kt_accuracy_curve *curve = &b.results->curves[c];
        const kt_accuracy_point *points = b.results->points + curve->first;
        for (int which = 0; which < 2; which++) {
            const int found = kt_accuracy_best_of(b.study, points, curve->count, goals[which]);
            if (found <= 0 || (curve->adaptive && points[found - 1].setting / points[found].setting < 1.3))
                continue; /* tolerances have two digits, and errors that are less smooth */
            kt_check_above(curve->method->name, points[found].error.judged,
                           (curve->adaptive ? 0.15 : 0.75) * goals[which]);
        }
    }
}

KT_TEST(settings_that_are_small_by_chance_do_not_count) {
    static const double errors[] = {1e-7, 1e-5, 9e-7, HUGE_VAL, 2e-7};
    kt_accuracy_point points[5] = {0};
    bench b;
    make_pendulum(&b, 1, start_angle, 1.0);
    const kt_method *method = kt_method_find("rk4");
    b.options.methods = &method;
    b.options.method_count = 1;
    make_study(&b);
    for (int i = 0; i < 5; i++) {
        points[i].error.judged = errors[i];
        points[i].usable = isfinite(errors[i]);
        points[i].status = isfinite(errors[i]) ? KT_OK : KT_ERROR_STEP; /* it failed, so it has no error */
        points[i].counts.evaluations = 10U + (unsigned)i;
    }
    kt_check_equal_int("the loosest of the last ones", kt_accuracy_best_of(b.study, points, 5, 1e-6), 2);
    kt_check_equal_int("one", kt_accuracy_best_of(b.study, points, 5, 5e-7), 4);
    kt_check_equal_int("none", kt_accuracy_best_of(b.study, points, 5, 1.5e-7), -1);
}

/* A clock that ticks at each reading: the study ends by its budget, with the points that it has. */
KT_TEST(budget_ends_the_study_and_progress_may_stop_it) {
    bench b;
    ticking ticker = {0.0, 0, -1};
    make_pendulum(&b, 1, start_angle, 5.0);
    b.options.clock = tick;
    b.options.progress = tell;
    b.options.user = &ticker;
    b.options.budget = 3.0;
    make_study(&b);
    kt_check_below("time", ticker.time, 2.0 * b.options.budget);
    kt_check_above("points", b.results->point_count, 10);
    kt_check_above("told of each method and the reference", ticker.told, b.results->curve_count + 1);
    for (int i = 0; i < b.results->point_count; i++)
        if (b.results->points[i].usable && !(b.results->points[i].cpu > 0.0 && b.results->points[i].spread >= 0.0))
            kt_check_true("time above zero", false);
    b.study = NULL;
    ticker = (ticking){0.0, 0, 3};
    kt_check_equal_int("stopped", create_study(&b), KT_ERROR_CALLBACK);
    kt_check_true("no study", b.study == NULL);
}

KT_TEST(wrong_options_are_rejected_in_words) {
    bench b;
    const double zero = 0.0;
    make_pendulum(&b, 1, 1.0, 1.0);
    b.options.steps = &zero;
    b.options.step_count = 1;
    kt_check_equal_int("step", create_study(&b), KT_ERROR_ARGUMENT);
    kt_check_text("where", b.error.where, "steps");
    make_pendulum(&b, 1, 1.0, 0.0);
    kt_check_equal_int("duration", create_study(&b), KT_ERROR_ARGUMENT);
    make_pendulum(&b, 1, 1.0, 1.0);
    b.bodies[0].joint.type = KT_JOINT_FIXED;
    kt_check_equal_int("fixed", create_study(&b), KT_ERROR_ARGUMENT);
    kt_check_contains("in words", b.error.message, "nothing moves");
    make_pendulum(&b, 1, 1.0, 1.0);
    b.bodies[0].mass = -1.0;
    kt_check_equal_int("mass", create_study(&b), KT_ERROR_MODEL);
}
