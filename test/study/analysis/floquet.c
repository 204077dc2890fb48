/* Floquet multipliers: Mathieu's pendulum against published characteristic values, ground resonance against Coleman's
 * equations with constant coefficients. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/analysis.h"

#include <complex.h>
#include <math.h>

#define J ((double complex)I) /* C has a float */

static const double pi = 3.14159265358979323846;

static kt_floquet *multipliers(const linkage *l, double period, int steps) {
    kt_floquet_options options = kt_floquet_options_default(period);
    kt_error e = {0};
    options.steps = steps;
    kt_floquet *floquet = kt_test_floquet(l->model, &options);
    kt_need_fine("evaluate", kt_floquet_evaluate(floquet, 0.0, l->q, l->v, &e), &e);
    return floquet;
}

/* ---- Mathieu ----------------------------------------------------------------------------------------------------- */

/* A point mass 1 m below a pivot that moves as A cos 2 t. Its equation is `theta'' + (g - 4 A cos 2 t) theta = 0`. This
 * is `y'' + (a - 2 q cos 2 t) y = 0` with a = g, q = 2 A. */
static void make_mathieu(linkage *l, double a, double q) {
    linkage_begin(l);
    l->description.gravity = kt_vec3_make(0.0, -a, 0.0);
    kt_body *pivot = linkage_bar(l, "pivot", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    pivot->joint.type = KT_JOINT_PRISMATIC;
    pivot->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    pivot->joint.position[0] = 0.5 * q;
    kt_body *bob = linkage_bar(l, "bob", "pivot", kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    bob->mass = 3.0;
    bob->com = kt_vec3_make(0.0, -1.0, 0.0);
    bob->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    kt_loop *shaker = linkage_close(l, "shaker", KT_LOOP_MOTION, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                    kt_vec3_make(0.0, 0.0, 0.0));
    shaker->joint = "pivot";
    shaker->function = kt_function_sine(0.5 * q, 1.0 / pi, 0.5 * pi, 0.0);
    linkage_build(l, 0.0);
}

/* mu_1 + mu_2, whose product is 1. */
static double trace(double a, double q) {
    linkage l;
    make_mathieu(&l, a, q);
    kt_floquet *f = multipliers(&l, pi, 800);
    KT_WORST product = kt_worst_make("product of multipliers");
    double re = 1.0, all = 0.0;
    for (int i = 0; i < kt_floquet_count(f); i++) {
        const kt_multiplier m = kt_floquet_at(f, i);
        re *= m.count == 2 ? m.modulus * m.modulus : m.real;
        all += m.count * m.real;
    }
    kt_worst_near(&product, re, 1.0, 2e-11, "a = %g", a);
    kt_check_below("it comes back", kt_floquet_gap(f), 1e-14);
    return all;
}

/* Abramowitz and Stegun, table 20.1. At a_0, b_2 and a_2 there is a solution of period pi, and both multipliers are 1.
 * At b_1 and a_1 there is a solution of period 2 pi, and both are -1. Eight digits are given; d trace / d a is up to
 * some 10. */
KT_TEST(mathieus_pendulum_is_neutral_at_the_published_characteristic_values) {
    static const struct {
        double a, q, trace;
    } rows[] = {{-0.45513860, 1.0, 2.0},
                {-0.11024882, 1.0, -2.0},
                {1.85910807, 1.0, -2.0},
                {3.91702477, 1.0, 2.0},
                {4.37130098, 1.0, 2.0}};
    for (int i = 0; i < 5; i++)
        kt_check_near("trace", trace(rows[i].a, rows[i].q), rows[i].trace, 2e-7);
}

/* Between the values it is stable or not: upright with a < 0 above a_0 (Kapitza), unstable between b_1 and a_1. */
KT_TEST(mathieus_pendulum_is_stable_between_the_right_values) {
    kt_check_below("upright, shaken: |trace|", fabs(trace(-0.3, 1.0)), 1.99);
    kt_check_above("upright, shaken too little", trace(-0.6, 1.0), 2.01);
    kt_check_above("hanging, in resonance", -trace(1.0, 1.0), 2.01);
    kt_check_below("hanging, out of it", fabs(trace(3.0, 1.0)), 1.99);
}

/* ---- ground resonance -------------------------------------------------------------------------------------------- */

/* C. E. Hammond, J. American Helicopter Society `19 (1974) 14`, in SI units. */
typedef struct rotor {
    double speed, offset, blade, moment, inertia, hub, support; /* rad/s, m, kg, kg m, kg m^2, kg, N/m */
    double lag_damping, support_damping;                        /* N m s, N s/m */
} rotor;

static const rotor hammond = {.speed = 17.0,
                              .offset = 0.3048,
                              .blade = 94.9,
                              .moment = 289.1,
                              .inertia = 1084.7,
                              .hub = 8026.6,
                              .support = 1240481.8};

static kt_effect effects[6];

static void make_rotor(linkage *l, const rotor *r) {
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), along = kt_vec3_make(1.0, 0.0, 0.0);
    static const char *const names[] = {"blade1", "blade2", "blade3", "blade4"};
    linkage_begin(l);
    l->description.gravity = none;
    kt_body *x = linkage_bar(l, "x", NULL, none, along, 0.0, 0.0), *y = linkage_bar(l, "y", "x", none, along, 0.0, 0.0);
    x->joint.type = y->joint.type = KT_JOINT_PRISMATIC;
    x->joint.axis = along;
    y->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    x->mass = 0.0;
    y->mass = r->hub;
    kt_body *hub = linkage_bar(l, "hub", "y", none, along, 0.0, r->speed);
    hub->mass = 0.0;
    x->com = y->com = hub->com = none;
    x->inertia = y->inertia = hub->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    const double arm = r->moment / r->blade, about = r->inertia - r->moment * arm;
    for (int i = 0; i < 4; i++) {
        const double angle = 0.5 * pi * i;
        kt_body *blade = linkage_bar(
            l, names[i], "hub", kt_vec3_make(r->offset * cos(angle), r->offset * sin(angle), 0.0), along, 0.0, 0.0);
        blade->joint.rotation.type = KT_ROTATION_VECTOR;
        blade->joint.rotation.value[2] = angle;
        blade->mass = r->blade;
        blade->com = kt_vec3_make(arm, 0.0, 0.0);
        blade->inertia = kt_sym3_make(0.0, about, about, 0.0, 0.0, 0.0);
    }
    for (int i = 0; i < 6; i++) {
        effects[i] = kt_effect_of(KT_EFFECT_JOINT_SPRING, i == 0 ? "x" : i == 1 ? "y" : names[i - 2]);
        effects[i].stiffness = i < 2 ? r->support : 0.0;
        effects[i].damping = i < 2 ? r->support_damping : r->lag_damping;
        effects[i].rest = kt_function_constant(0.0);
    }
    l->description.effects = effects;
    l->description.effect_count = 6;
    kt_loop *shaft = linkage_close(l, "shaft", KT_LOOP_MOTION, NULL, none, NULL, none);
    const double turning[] = {0.0, r->speed};
    shaft->joint = "hub";
    shaft->function = kt_function_polynomial(turning, 2);
    linkage_build(l, 0.0);
}

/* With z = x + i y of the hub and w = sum_k i exp(i psi_k) zeta_k of the lag angles, R. P. Coleman (NACA TR 1351,
 * 1958):
 *
 *     M z'' + C z' + K z + S w'' = 0
 *     I D^2 w + c D w + W^2 e S w + (N / 2) S z'' = 0,   D = d/dt - i W
 *
 * The largest real part of the four roots of the determinant, by the iteration of Durand and Kerner. */
static double coleman(const rotor *r) {
    const double complex d[3] = {-r->inertia * r->speed * r->speed - J * r->speed * r->lag_damping +
                                     r->speed * r->speed * r->offset * r->moment,
                                 -2.0 * J * r->speed * r->inertia + r->lag_damping, r->inertia};
    const double h[3] = {r->support, r->support_damping, r->hub + 4.0 * r->blade};
    double complex p[5] = {0.0}, root[4];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            p[i + j] += h[i] * d[j];
    p[4] -= 2.0 * r->moment * r->moment;
    for (int i = 0; i < 4; i++)
        root[i] = 12.0 * cpow(0.4 + 0.9 * J, i);
    for (int iteration = 0; iteration < 500; iteration++)
        for (int i = 0; i < 4; i++) {
            double complex value = p[4], others = p[4];
            for (int k = 3; k >= 0; k--)
                value = value * root[i] + p[k];
            for (int k = 0; k < 4; k++)
                others *= k == i ? 1.0 : root[i] - root[k];
            root[i] -= value / others;
        }
    double most = creal(root[0]);
    for (int i = 1; i < 4; i++)
        most = fmax(most, creal(root[i]));
    return most;
}

/* The largest growth by the multipliers of a turn; lag modes that do not move the hub are no part of Coleman's. */
static double growth(const rotor *r) {
    linkage l;
    double found = (double)NAN;
    make_rotor(&l, r);
    kt_floquet *f = multipliers(&l, 2.0 * pi / r->speed, 400);
    kt_check_below("it comes back", kt_floquet_gap(f), 1e-14);
    kt_check_equal_int("what loops forbid is left out",
                       kt_floquet_at(f, 0).count + kt_floquet_at(f, 1).count + kt_floquet_at(f, 2).count +
                           kt_floquet_at(f, 3).count + kt_floquet_at(f, 4).count + kt_floquet_at(f, 5).count,
                       12);
    found = kt_floquet_at(f, 0).growth;
    kt_check_below("error of the multiplier", kt_floquet_at(f, 0).error, 4e-9);
    return found;
}

KT_TEST(ground_resonance_grows_as_coleman_says) {
    static const double speeds[] = {16.0, 17.0, 18.0, 19.56936896};
    for (int i = 0; i < 4; i++) {
        rotor r = hammond;
        r.speed = speeds[i];
        const double theory = coleman(&r);
        kt_note("%.0f rad/s: %.6f 1/s", r.speed, theory);
        kt_check_near("growth, 1/s", growth(&r), theory, 4e-9);
    }
}

/* Dampers of blades and support, a tenth of Hammond's, slow it; all of them end it. */
KT_TEST(dampers_end_ground_resonance) {
    rotor r = hammond;
    r.lag_damping = 406.75;
    r.support_damping = 5107.87;
    kt_check_near("growth with weak dampers, 1/s", growth(&r), coleman(&r), 4e-9);
    r.lag_damping = 4067.5;
    r.support_damping = 51078.7;
    kt_check_above("theory: decay", -coleman(&r), 0.5);
    kt_check_near("rate, 1/s", growth(&r), coleman(&r), 4e-9);
}

/* About the state at an instant the same rotor looks neutral: the coefficients are taken as constant. */
KT_TEST(linearisation_at_an_instant_does_not_see_ground_resonance) {
    linkage l;
    kt_error e = {0};
    double most = (double)NAN;
    make_rotor(&l, &hammond);
    kt_linearization *linearization = kt_test_linearization(l.model, NULL);
    kt_need_fine("evaluation", kt_linearization_evaluate(linearization, 0.0, l.q, l.v, NULL, &e), &e);
    kt_modes *modes = kt_test_modes(l.model);
    kt_need_fine("their evaluation", kt_modes_evaluate(modes, kt_linearization_system(linearization), &e), &e);
    most = 0.0;
    for (int i = 0; i < kt_modes_count(modes); i++)
        most = fmax(most, kt_modes_at(modes, i).real);
    kt_check_below("growth, 1/s", most, 1e-13);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

KT_TEST(options_of_a_period_are_checked) {
    linkage l;
    make_mathieu(&l, 1.0, 1.0);
    const kt_floquet_options good = kt_floquet_options_default(1.0);
    kt_floquet_options bad[3] = {good, good, good};
    static const char *const where[] = {"period", "steps", "method"};
    bad[0].period = -1.0;
    bad[1].steps = 3;
    bad[2].method = kt_method_find("rkc2");
    for (int i = 0; i < 3; i++) {
        kt_floquet *f = NULL;
        kt_error e = {0};
        kt_check_equal_int(where[i], kt_floquet_create(l.model, &bad[i], &f, &e), KT_ERROR_ARGUMENT);
        kt_check_text("where", e.where, where[i]);
        kt_check_true("none", f == NULL);
    }
    kt_check_true("no multiplier", isnan(kt_floquet_at(NULL, 0).modulus) && kt_floquet_count(NULL) == 0);
}
