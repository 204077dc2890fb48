/* The evolution of closure errors: decay at the rate of the gains, drift, and stability of the steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closure.h"

#include <math.h>

enum { ROWS_MAX = 6 };

/* The four-bar off its manifold: the rocker turned by `angle`, too fast by `rate`. */
static void make_open(linkage *l, double angle, double rate) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    linkage_build(l, 0.0);
    l->q[l->nq - 1] += angle;
    l->v[l->nv - 1] += rate;
}

/* phi'' + 2 alpha phi' + beta^2 phi = 0 */
static double decayed(double alpha, double beta, double x, double v, double t) {
    const double d = alpha * alpha - beta * beta;
    if (d > 0.0) {
        const double w = sqrt(d);
        return exp(-alpha * t) * (x * cosh(w * t) + (v + alpha * x) / w * sinh(w * t));
    }
    if (d < 0.0) {
        const double w = sqrt(-d);
        return exp(-alpha * t) * (x * cos(w * t) + (v + alpha * x) / w * sin(w * t));
    }
    return exp(-alpha * t) * (x + (v + alpha * x) * t);
}

static void check_decay(kt_constraint_formulation_type type, double alpha, double beta, double bound) {
    linkage l;
    double phi[2][ROWS_MAX], slip[2][ROWS_MAX];
    kt_constraint_formulation_options o = kt_constraint_formulation_options_default(type, 1.0);
    o.alpha = alpha;
    o.beta = beta;
    KT_WORST worst = kt_worst_make(kt_constraint_formulation_name(type));
    kt_note("alpha %g, beta %g", alpha, beta);
    make_open(&l, 0.05, 0.3);
    kt_constraint_formulation *set = closure_set(l.model, &o);
    closure_run run;
    closure_at(&l, 0.0, l.q, l.v, phi[0], slip[0]);
    closure_start(&run, &l, set, "dop853", 0.0, 1e-13);
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double t = 0.1; t < 1.05; t += 0.1) {
        linkage_run_to(&run.run, t);
        closure_at(&l, t, l.q, l.v, phi[1], slip[1]);
        for (int r = 0; r < l.rows; r++)
            kt_worst_near(&worst, phi[1][r], decayed(alpha, beta, phi[0][r], slip[0][r], t), bound, "t = %g, row %d", t,
                          r);
    }
}

/* phi begins at 0.09 m and 0.5 m/s. The tolerance is 1e-13, and the bounds are four times the measured errors. */
KT_TEST(closure_errors_decay_as_the_gains_say) {
    static const double gains[][2] = {{0.0, 0.0}, {3.0, 3.0}, {8.0, 8.0}, {2.0, 9.0}, {9.0, 2.0}};
    for (int i = 0; i < 5; i++) {
        check_decay(KT_CONSTRAINT_FORMULATION_BAUMGARTE, gains[i][0], gains[i][1], 1e-13);
        check_decay(KT_CONSTRAINT_FORMULATION_AUGMENTED, gains[i][0], gains[i][1], 1e-13);
    }
    check_decay(KT_CONSTRAINT_FORMULATION_GAUSS, 0.0, 0.0, 1e-13); /* phi grows as phi0 + phi0' t */
}

/* ---- rolling ----------------------------------------------------------------------------------------------------- */

/* psi' + 2 alpha psi = 0 for a wheel that slips: a disc on two sliders and a turn, rolling along x on a plane. */
KT_TEST(slip_of_a_wheel_decays_at_twice_alpha) {
    linkage l;
    double phi[ROWS_MAX], slip[2][ROWS_MAX];
    KT_WORST worst = kt_worst_make("slip");
    linkage_begin(&l);
    kt_body *cart = linkage_bar(&l, "cart", NULL, kt_vec3_make(0.0, 0.5, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    cart->joint.type = KT_JOINT_PRISMATIC;
    cart->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    cart->joint.velocity[0] = 0.4;
    (void)linkage_bar(&l, "wheel", "cart", kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.3, 0.0, 0.0), 0.0, 0.0);
    kt_loop *loop = linkage_close(&l, "roll", KT_LOOP_ROLLING, "wheel", kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                  kt_vec3_make(0.0, 0.0, 0.0));
    loop->axis = kt_vec3_make(0.0, 0.0, 1.0);
    loop->axis2 = kt_vec3_make(0.0, 1.0, 0.0);
    loop->radius = 0.5;
    linkage_build(&l, 0.0);
    kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 1.0);
    o.alpha = 1.5;
    o.beta = 4.0;
    kt_constraint_formulation *set = closure_set(l.model, &o);
    closure_run run;
    l.v[1] += 0.7; /* the wheel spins */
    closure_at(&l, 0.0, l.q, l.v, phi, slip[0]);
    double most = 0.0;
    for (int r = 0; r < l.rows; r++)
        most = fmax(most, fabs(slip[0][r]));
    kt_check_above("slip at first", most, 0.1);
    closure_start(&run, &l, set, "dop853", 0.0, 1e-13);
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double t = 0.2; t < 1.1; t += 0.2) {
        linkage_run_to(&run.run, t);
        closure_at(&l, t, l.q, l.v, phi, slip[1]);
        for (int r = 0; r < l.rows; r++)
            kt_worst_near(&worst, slip[1][r], exp(-3.0 * t) * slip[0][r], 2e-14, "t = %g, row %d", t, r);
    }
}

/* ---- stability of the steps -------------------------------------------------------------------------------------- */

static double largest(const double *x, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* How much phi has grown or shrunk after 150 steps that hold h alpha = `reach`, or as soon as it has grown a
 * thousandfold. The mechanism is at rest and without weight, so that nothing else moves it. */
static double growth(const char *method, double reach) {
    linkage l;
    double phi[2][ROWS_MAX] = {{0.0}}, slip[ROWS_MAX], times = 0.0;
    const double h = 2e-4;
    const four_bar f = four_bar_default();
    kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, h);
    o.alpha = o.beta = reach / h;
    linkage_four_bar(&l, &f);
    l.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    linkage_build(&l, 0.0);
    for (int i = 0; i < l.nv; i++)
        l.v[i] = 0.0;
    l.q[l.nq - 1] += 1e-9;
    kt_constraint_formulation *set = closure_set(l.model, &o);
    closure_run run;
    closure_at(&l, 0.0, l.q, l.v, phi[0], slip);
    closure_start(&run, &l, set, method, h, 0.0);
    for (int k = 5; k <= 150 && times < 1e3; k += 5) {
        linkage_run_to(&run.run, k * h);
        closure_at(&l, k * h, l.q, l.v, phi[1], slip);
        times = largest(phi[1], l.rows) / largest(phi[0], l.rows);
    }
    return times;
}

/* The real intervals of stability are 2, 2.785 and 3.307. For euler, |1 + z| is 0.94 and 1.06. The double eigenvalue
 * adds a factor of 300 to its 150th power. The products are 0.03 and 2e6. The changes of rk4 and dopri5 are faster. */
KT_TEST(gains_are_stable_up_to_the_limit_of_the_method_and_no_further) {
    static const struct {
        const char *method;
        double limit, inside;
    } cases[] = {{"euler", 2.0, 0.1},
                 {"heun", 2.0, 0.1},
                 {"midpoint", 2.0, 0.1},
                 {"rk4", 2.7853, 1e-4},
                 {"dopri5", 3.3066, 1e-4}};
    for (int i = 0; i < 5; i++) {
        kt_check_below(cases[i].method, growth(cases[i].method, 0.97 * cases[i].limit), cases[i].inside);
        kt_check_above(cases[i].method, growth(cases[i].method, 1.03 * cases[i].limit), 1e3);
    }
}

/* ---- force projection -------------------------------------------------------------------------------------------- */

/* One equation, A = a row that turns and changes its length: two bars from the ground, the tip at a distance from a
 * point. Then e' = (dA/dt) A^+ e keeps e / |A|. */
static double row_length(const linkage *l, double t) {
    double jacobian[ROWS_MAX * 8], sum = 0.0;
    kt_error e = {0};
    (void)kt_fine("equations", kt_loop_equations(l->model, l->data, t, l->q, l->v, jacobian, NULL, NULL, NULL, &e), &e);
    for (int i = 0; i < l->nv; i++)
        sum += jacobian[i] * jacobian[i];
    return sqrt(sum);
}

KT_TEST(velocity_error_of_force_projection_goes_with_the_size_of_the_equation) {
    linkage l;
    double phi[ROWS_MAX], slip[2][ROWS_MAX];
    KT_WORST worst = kt_worst_make("e / |A|"), closed = kt_worst_make("positions stay");
    linkage_begin(&l);
    (void)linkage_bar(&l, "upper", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), -0.7, 1.0);
    (void)linkage_bar(&l, "lower", "upper", kt_vec3_make(1.0, 0.0, 0.0), kt_vec3_make(0.8, 0.0, 0.0), 0.9, -0.5);
    (void)linkage_close(&l, "tie", KT_LOOP_DISTANCE, "lower", kt_vec3_make(0.8, 0.0, 0.0), NULL,
                        kt_vec3_make(0.5, -1.5, 0.0));
    linkage_build(&l, 0.0);
    const kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_PROJECTION, 0.01);
    kt_constraint_formulation *set = closure_set(l.model, &o);
    closure_run run;
    l.v[0] += 0.2;
    closure_at(&l, 0.0, l.q, l.v, phi, slip[0]);
    const double length = row_length(&l, 0.0);
    double least = length, most = length;
    kt_check_above("velocity error", fabs(slip[0][0]), 0.05);
    closure_start(&run, &l, set, "dop853", 0.0, 1e-13);
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double t = 0.1; t < 2.05; t += 0.1) {
        linkage_run_to(&run.run, t);
        closure_at(&l, t, l.q, l.v, phi, slip[1]);
        const double now = row_length(&l, t);
        least = fmin(least, now);
        most = fmax(most, now);
        kt_worst_near(&worst, slip[1][0] / now, slip[0][0] / length, 3e-14, "t = %g", t);
        kt_worst_near(&closed, phi[0], 0.0, 3e-15, "t = %g", t);
    }
    kt_check_above("|A| changes by a factor", most / least, 1.5);
}
