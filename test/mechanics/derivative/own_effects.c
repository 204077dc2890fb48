/* A caller's own effects with derivatives and without. The effect is friction in a joint of one bar that changes its
 * sign over a small speed. Its derivatives have a closed form. The tests cover the reported error of differences, and
 * callbacks that fail. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/effect.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

/* -coulomb tanh(v / smoothing) + drive sin(9 t); a code where it is not 0. */
typedef struct friction {
    double coulomb, smoothing, drive;
    int code;
    bool nan;
} friction;

static int rub(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const friction *f = user;
    (void)q, (void)balance;
    *force = f->drive * sin(9.0 * t) - f->coulomb * tanh(v / f->smoothing);
    return 0;
}

static int differentiate_rub(void *user, double t, double q, double v, double derivatives[3]) {
    const friction *f = user;
    const double c = cosh(v / f->smoothing);
    (void)q;
    derivatives[1] = f->nan ? (double)NAN : -f->coulomb / (f->smoothing * c * c);
    derivatives[2] = f->drive * 9.0 * cos(9.0 * t);
    return f->code;
}

/* Jumps at v = 1e-7. */
static int jump(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)t, (void)q, (void)balance;
    *force = v > 1e-7 ? -1.0 : 1.0;
    return 0;
}

/* The same friction at the end of a bar of 1 m, as a force along its path. */
static int rub_on_body(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
                       kt_effect_balance *balance) {
    const friction *f = user;
    (void)t, (void)balance;
    wrenches[0].moment.z = -f->coulomb * tanh(ends[0].omega.z / f->smoothing);
    return 0;
}

static int differentiate_rub_on_body(void *user, double t, const kt_effect_end *ends,
                                     kt_effect_derivatives *derivatives) {
    const friction *f = user;
    const double c = cosh(ends[0].omega.z / f->smoothing);
    (void)t;
    derivatives->wrench[0][0].by_twist[0][0].z.z = f->nan ? (double)NAN : -f->coulomb / (f->smoothing * c * c);
    return f->code;
}

/* A bar of 1 kg and 1 m that hangs, with this effect. Its state is 0.3 rad and v rad/s. */
static void make_bar(linkage *l, const kt_effect *effect, double v) {
    linkage_begin(l);
    linkage_bar(l, "bar", NULL, none, down, 0.3, v);
    l->description.effects = effect;
    l->description.effect_count = 1;
    linkage_compile(l);
}

static kt_effect own_effect(friction *f, bool on_body, bool exact) {
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, NULL);
    effect.name = "mine";
    effect.user = f;
    if (on_body) {
        effect.between[0].body = "bar";
        effect.end_count = 1;
        effect.wrench = rub_on_body;
        effect.wrench_derivatives = exact ? differentiate_rub_on_body : NULL;
    } else {
        effect.joint = "bar";
        effect.joint_force = rub;
        effect.joint_force_derivatives = exact ? differentiate_rub : NULL;
    }
    return effect;
}

static kt_status derive(const linkage *l, double *by_q, double *by_v, kt_error *e) {
    const size_t size = kt_acceleration_work_size(l->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    memset(work, 0xFF, size);
    const kt_status status =
        kt_acceleration_derivatives(l->model, l->data, work, size, 0.0, l->q, l->v, NULL, NULL, by_q, by_v, NULL, e);
    free(work);
    return status;
}

/* With the inertia I = 1/3,
 *     da/dv = -3 coulomb / (smoothing cosh^2(v / smoothing))
 * Differences over 0.002 rad/s are off by a quarter of it. The bound of the differences that are found is the reported
 * error. */
KT_TEST(derivatives_of_sharp_friction_are_exact_if_given_and_fine_if_not) {
    kt_error e = {0};
    for (int form = 0; form < 4; form++) {
        const bool on_body = form / 2, exact = form % 2;
        friction f = {.coulomb = 2.0, .smoothing = 1e-3};
        const kt_effect effect = own_effect(&f, on_body, exact);
        static linkage l;
        double by_q = 0.0, by_v = 0.0;
        make_bar(&l, &effect, 4e-4);
        const double c = cosh(0.4), expected = -3.0 * 2.0 / (1e-3 * c * c);
        kt_check_true("differenced", kt_model_is_differenced(l.model) == !exact);
        kt_need_fine("derivatives", derive(&l, &by_q, &by_v, &e), &e);
        kt_check_near("da/dv", by_v / expected, 1.0, exact ? 1e-14 : 5e-10);
        kt_check_near("da/dq, by the weight", by_q, -1.5 * 9.81 * cos(0.3), exact ? 1e-13 : 1e-11);
        const double told = kt_data_difference_error(l.data);
        kt_check_below("told", told, exact ? 0.0 : 3e-8);
        kt_check_below("told once", kt_data_difference_error(l.data), 0.0);
    }
}

KT_TEST(differences_across_a_jump_are_told) {
    kt_error e = {0};
    static linkage l;
    double by_q = 0.0, by_v = 0.0;
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, "bar");
    effect.joint_force = jump;
    make_bar(&l, &effect, 0.0);
    kt_need_fine("derivatives", derive(&l, &by_q, &by_v, &e), &e);
    kt_check_above("told", kt_data_difference_error(l.data), 1e-3);
    make_bar(&l, &effect, 0.5); /* the force is constant here */
    kt_need_fine("derivatives", derive(&l, &by_q, &by_v, &e), &e);
    kt_check_below("told", kt_data_difference_error(l.data), 0.0);
    kt_check_near("da/dv", by_v, 0.0, 1e-12);
    kt_check_true("no data", isnan(kt_data_difference_error(NULL)) && !kt_model_is_differenced(NULL));
}

/* The force does not depend on the second joint, whose differences have no error. */
KT_TEST(the_largest_error_of_differences_is_told) {
    kt_error e = {0};
    static linkage l;
    double by_q[4], by_v[4];
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, "bar");
    effect.joint_force = jump;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.3, 0.0);
    linkage_bar(&l, "last", "bar", down, down, 0.2, 0.5);
    l.description.effects = &effect;
    l.description.effect_count = 1;
    linkage_compile(&l);
    kt_need_fine("derivatives", derive(&l, by_q, by_v, &e), &e);
    kt_check_above("told", kt_data_difference_error(l.data), 1e-3);
}

KT_TEST(derivatives_that_cannot_be_given_name_their_effect) {
    for (int form = 0; form < 6; form++) {
        const bool on_body = form % 2;
        friction f = {.coulomb = 2.0, .smoothing = 1.0, .code = (int[]){3, -4, 0}[form / 2], .nan = form / 2 == 2};
        const kt_effect effect = own_effect(&f, on_body, true);
        const kt_status expected = (kt_status[]){KT_ERROR_EFFECT, KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE}[form / 2];
        static linkage l;
        kt_error e = {0};
        double by_q = 77.0, by_v = 77.0;
        make_bar(&l, &effect, 0.4);
        kt_check_equal_int("status", derive(&l, &by_q, &by_v, &e), expected);
        kt_check_contains("where", e.where,
                          on_body ? "effect 'mine' (custom) on body 'bar', t = 0 s"
                                  : "effect 'mine' (custom) on joint 'bar', t = 0 s");
        kt_check_contains("message", e.message,
                          (const char *[]){"code 3", "code -4", "derivatives that are not finite"}[form / 2]);
        kt_check_true("nothing is written", by_q == 77.0 && by_v == 77.0);
    }
}

KT_TEST(derivatives_of_the_other_kind_are_rejected) {
    for (int on_body = 0; on_body < 2; on_body++) {
        friction f = {.coulomb = 2.0, .smoothing = 1.0};
        kt_effect effect = own_effect(&f, on_body, true);
        static linkage l;
        kt_error e = {0};
        kt_model *model = NULL;
        effect.wrench_derivatives = on_body ? NULL : differentiate_rub_on_body;
        effect.joint_force_derivatives = on_body ? differentiate_rub : NULL;
        linkage_begin(&l);
        linkage_bar(&l, "bar", NULL, none, down, 0.3, 0.0);
        l.description.effects = &effect;
        l.description.effect_count = 1;
        kt_check_equal_int("rejected", kt_model_compile(&l.description, NULL, &model, &e), KT_ERROR_MODEL);
        kt_check_contains("message", e.message,
                          on_body ? "it belongs to joint_force, and wrench is given"
                                  : "it belongs to wrench, and joint_force is given");
    }
}

/* ---- implicit steps ---------------------------------------------------------------------------------------------- */

/* Runs 0.3 s of it by rodas5p. */
static void run(const kt_effect *effect, double *q, uint64_t *evaluations) {
    static linkage l;
    kt_error e = {0};
    kt_run with = kt_run_default();
    with.integrator = "rodas5p";
    with.step = 0.01;
    make_bar(&l, effect, 0.4);
    kt_simulation *simulation = kt_test_simulation(l.model, &with, NULL);
    while (kt_simulation_time(simulation) < 0.295)
        kt_need_fine("step", kt_simulation_step(simulation, HUGE_VAL, &e), &e);
    *q = kt_simulation_positions(simulation)[0];
    *evaluations = kt_simulation_counts_of(simulation).evaluations;
}

/* Rosenbrock methods need the force's derivative by time: by differences it costs an evaluation more in each step. */
KT_TEST(rosenbrock_steps_take_the_derivative_by_time_that_is_given) {
    friction f = {.coulomb = 0.5, .smoothing = 0.3, .drive = 2.0};
    kt_effect exact = own_effect(&f, false, true), differenced = own_effect(&f, false, false);
    double q[2] = {0.0, 1.0};
    uint64_t evaluations[2] = {0, 0};
    run(&exact, &q[0], &evaluations[0]);
    run(&differenced, &q[1], &evaluations[1]);
    kt_check_near("the same motion", q[0], q[1], 1e-13);
    kt_check_equal_int("evaluations saved", (long long)(evaluations[1] - evaluations[0]), 30);
}
