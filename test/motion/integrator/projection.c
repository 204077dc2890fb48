/* The effect of a projection after each step on the motion, the dense output and the slopes that are reused. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- quaternions ------------------------------------------------------------------------------------------------- */

/* A known rotation, q = exp(alpha i) exp(beta j), alpha = t + sin t, beta = t^2 / 2:
 *
 *     q' = alpha' i q + beta' q j = q (alpha' conj(e) i e + beta' j),  e = exp(beta j),  conj(e) i e = i cos 2 beta + k
 * sin 2 beta
 */
static void rotation(double t, double q[4]) {
    const double a = t + sin(t), b = 0.5 * t * t;
    q[0] = cos(a) * cos(b);
    q[1] = sin(a) * cos(b);
    q[2] = cos(a) * sin(b);
    q[3] = sin(a) * sin(b);
}

static int turn(double t, const double *q, double *dq, void *user) {
    (void)user;
    const double rate = 1.0 + cos(t), b = 0.5 * t * t;
    const double x = rate * cos(2.0 * b), y = t, z = rate * sin(2.0 * b); /* half the angular velocity */
    dq[0] = -q[1] * x - q[2] * y - q[3] * z;
    dq[1] = q[0] * x + q[2] * z - q[3] * y;
    dq[2] = q[0] * y + q[3] * x - q[1] * z;
    dq[3] = q[0] * z + q[1] * y - q[2] * x;
    return 0;
}

static double norm(const double *q) { return sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); }

static int renormalise(double t, double *q, bool *changed, void *user) {
    (void)t;
    (void)user;
    *changed = true;
    const double r = norm(q);
    for (int i = 0; i < 4; i++)
        q[i] /= r;
    return 0;
}

static kt_integrator *rotation_begin(const kt_method *m, kt_integrator_options options,
                                     int (*project)(double, double *, bool *, void *)) {
    kt_error error;
    double q[4];
    rotation(0.0, q);
    const kt_integrator_callbacks callbacks = {turn, project, NULL};
    kt_integrator *it = integrator_make(m, 4, options);
    kt_fine("start", kt_integrator_start(it, 0.0, q, &callbacks, &error), &error);
    return it;
}

static double rotation_error(const kt_integrator *it) {
    double q[4], worst = 0.0;
    rotation(kt_integrator_time(it), q);
    for (int i = 0; i < 4; i++)
        worst = fmax(worst, fabs(kt_integrator_state(it)[i] - q[i]));
    return worst;
}

KT_TEST(quaternions_stay_on_the_sphere) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        kt_integrator *it = rotation_begin(m, m->e != NULL ? tolerance(1e-6, 1e-6) : fixed_step(0.01), renormalise);
        double worst = 0.0;
        while (kt_integrator_time(it) < 5.0 && integrator_step(it, 5.0))
            worst = fmax(worst, fabs(norm(kt_integrator_state(it)) - 1.0));
        kt_note("%s: error of the rotation %.2g", m->name, rotation_error(it));
        kt_check_below("norm", worst, 2.0 * DBL_EPSILON); /* a square root and a division */
    }
}

/* The projection moves by no more than the error of the step, so that the order stays. Here it even rises where the
 * order is odd: the equation is linear and skew, and the leading error then is along q. */
KT_TEST(renormalising_keeps_the_order) {
    static const int first[9] = {0, 8192, 1024, 1024, 128, 64, 0, 0, 12};
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        double h[3], with[3], without[3];
        for (int l = 0; l < 3; l++) {
            const int steps = first[m->order] / 2 * (l + 2);
            h[l] = 2.0 / steps;
            const kt_integrator_options options = fixed_step(h[l]);
            kt_integrator *it = rotation_begin(m, options, renormalise), *free_one = rotation_begin(m, options, NULL);
            integrate_to(it, 2.0);
            integrate_to(free_one, 2.0);
            with[l] = rotation_error(it);
            without[l] = rotation_error(free_one);
        }
        kt_note("%s: errors %.2g ... %.2g; %.2g without renormalising", m->name, with[0], with[2], without[2]);
        kt_check_above("slope", slope_of(h, with, 3),
                       m->order - (kt_method_is_implicit(m) || m->steps > 0 ? 0.05 : 0.01)); /* measured */
        kt_check_below("error, over that without", with[2] / without[2], 1.05);
    }
}

/* ---- slopes that are reused -------------------------------------------------------------------------------------- */

/* NOLINTNEXTLINE(readability-non-const-parameter): it is the type of the callback */
static int claims_nothing_moved(double t, double *q, bool *changed, void *user) {
    (void)t;
    (void)q;
    (void)user;
    *changed = false;
    return 0;
}

static int moves_by_a_bit(double t, double *q, bool *changed, void *user) {
    (void)t;
    (void)user;
    *changed = true;
    q[0] = nextafter(q[0], 2.0);
    return 0;
}

static long long evaluations_of_ten_steps(const kt_method *m, int (*project)(double, double *, bool *, void *),
                                          double *state) {
    kt_integrator *it = rotation_begin(m, fixed_step(0.05), project);
    for (int k = 0; k < 10; k++)
        integrator_step(it, HUGE_VAL);
    memcpy(state, kt_integrator_state(it), 4 * sizeof *state);
    const long long evaluations = (long long)kt_integrator_counts_of(it).evaluations;
    return evaluations;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): it is the type of the callback */
static int says_nothing(double t, double *q, bool *changed, void *user) {
    (void)changed;
    return moves_by_a_bit(t, q, &(bool){false}, user);
}

KT_TEST(a_slope_is_evaluated_again_if_one_bit_was_moved) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (!goes_by_its_table(m)) /* see stabilised.c and radau.c */
            continue;
        const long long s = m->stages;
        double a[4], b[4];
        kt_check_equal_int(m->name, evaluations_of_ten_steps(m, NULL, a), m->fsal ? 10 * (s - 1) + 1 : 10 * s);
        kt_check_equal_int("nothing moved", evaluations_of_ten_steps(m, claims_nothing_moved, b),
                           m->fsal ? 10 * (s - 1) + 1 : 10 * s);
        kt_check_equal_bits("nothing moved", b, a, 4);
        kt_check_equal_int("moved, not said", evaluations_of_ten_steps(m, says_nothing, b), 10 * s);
        kt_check_equal_int("moved", evaluations_of_ten_steps(m, moves_by_a_bit, b), 10 * s);
    }
}

/* The reference is a step from the moved state, started afresh. */
KT_TEST(steps_after_a_projection_begin_at_the_projected_state) {
    kt_error error;
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (kt_method_is_implicit(m) || m->steps > 0) /* a fresh start forgets its Jacobian, and past slopes */
            continue;
        const kt_integrator_options options = fixed_step(0.0625);
        kt_integrator *it = rotation_begin(m, options, renormalise), *by_hand = rotation_begin(m, options, NULL);
        const kt_integrator_callbacks callbacks = {turn, NULL, NULL};
        for (int k = 0; k < 8; k++) {
            double q[4];
            bool changed = true;
            integrator_step(it, HUGE_VAL);
            integrator_step(by_hand, HUGE_VAL);
            memcpy(q, kt_integrator_state(by_hand), sizeof q);
            renormalise(0.0, q, &changed, NULL);
            kt_fine("start", kt_integrator_start(by_hand, kt_integrator_time(by_hand), q, &callbacks, &error), &error);
        }
        kt_check_equal_bits(m->name, kt_integrator_state(it), kt_integrator_state(by_hand), 4);
    }
}

/* ---- dense output ------------------------------------------------------------------------------------------------ */

/* A projection that moves visibly: the dense output still joins the states that there are, with the slopes there. */
static int shrink(double t, double *q, bool *changed, void *user) {
    (void)t;
    (void)user;
    *changed = true;
    for (int i = 0; i < 4; i++)
        q[i] *= 0.99;
    return 0;
}

KT_TEST(dense_output_joins_the_projected_states) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        kt_integrator *it = rotation_begin(m, fixed_step(0.125), shrink);
        double y0[4], y1[4], f0[4], f1[4], y[4];
        integrator_step(it, HUGE_VAL);
        memcpy(y0, kt_integrator_state(it), sizeof y0);
        integrator_step(it, HUGE_VAL);
        memcpy(y1, kt_integrator_state(it), sizeof y1);
        turn(0.125, y0, f0, NULL);
        turn(0.25, y1, f1, NULL);
        const double d = 1e-6;
        /* The bound is d^2 y'' / 2. The jump contributes 6 * 0.01 / 0.125^2 to y'', and the motion contributes 5. An
         * implicit method's slope is that of its own polynomial, of the state before the projection: 1.01 f, f up to
         * 2.5. */
        /* The cubic of rkc4 has no slope at its end: the jump of 0.01 adds 11/2 of 0.01 / 0.125. */
        const double cubic = strcmp(m->name, "rkc4") == 0 ? 5.5 * 0.01 / 0.125 * d : 0.0;
        const double bound = 7.0 * d * d + (kt_method_is_implicit(m) ? 0.01 * 2.5 * d : 0.0) + cubic;
        KT_WORST worst = kt_worst_make(m->name);
        integrator_value(it, 0.125 + d, y);
        for (int l = 0; l < 4; l++)
            kt_worst_near(&worst, y[l], y0[l] + d * f0[l], bound, "begin %d", l);
        integrator_value(it, 0.25 - d, y);
        for (int l = 0; l < 4; l++)
            kt_worst_near(&worst, y[l], y1[l] - d * f1[l], bound, "end %d", l);
    }
}

KT_TEST(dense_output_keeps_its_order_beside_a_projection) {
    static const int first[9] = {0, 8192, 1024, 256, 128, 64, 0, 0, 16};
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        double h[3], worst[3] = {0.0, 0.0, 0.0};
        for (int l = 0; l < 3; l++) {
            const int steps = first[m->order] / 2 * (l + 2);
            h[l] = 2.0 / steps;
            kt_integrator *it = rotation_begin(m, fixed_step(h[l]), renormalise);
            int record = 0;
            while (kt_integrator_time(it) < 2.0 && integrator_step(it, 2.0))
                for (; 0.00137 * record <= kt_integrator_time(it); record++) {
                    double q[4], exact[4];
                    rotation(0.00137 * record, exact);
                    integrator_value(it, 0.00137 * record, q);
                    for (int j = 0; j < 4; j++)
                        worst[l] = fmax(worst[l], fabs(q[j] - exact[j]));
                }
        }
        kt_note("%s: errors %.2g ... %.2g", m->name, worst[0], worst[2]);
        kt_check_above("slope", slope_of(h, worst, 3), m->order - 0.15);
    }
}
