/* Every type of effect: its forces against differences of its energy, and its power against its reported sources and
 * sinks. No force or moment is left over on a pair. Records and motions are random.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "effect/effect.h"

#include <float.h>

#define EPS DBL_EPSILON

/* ---- records and motions ----------------------------------------------------------------------------------------- */

static kt_vec3 random_vector(kt_random *random, double size) {
    return kt_vec3_make(size * kt_random_normal(random), size * kt_random_normal(random),
                        size * kt_random_normal(random));
}

/* Numbers of size 1, all of them; `elastic`: nothing that dissipates. */
static kt_effect_record random_record(kt_random *random, kt_effect_type type, bool elastic) {
    kt_effect_record r = {.type = (int32_t)type, .exponent = kt_random_uniform(random, 1.0, 3.0)};
    const double loss = elastic ? 0.0 : 1.0;
    r.stiffness = kt_random_uniform(random, 1.0, 3.0);
    r.length = kt_random_uniform(random, 0.0, 2.0);
    r.limit = kt_random_uniform(random, 0.5, 5.0);
    r.lower = kt_random_uniform(random, -1.0, 0.0);
    r.upper = kt_random_uniform(random, 0.0, 1.0);
    r.strength = kt_random_uniform(random, -3.0, 3.0);
    r.radius = kt_random_uniform(random, 0.0, 1.0);
    r.damping = loss * kt_random_uniform(random, 0.5, 2.0);
    r.coulomb = loss * kt_random_uniform(random, 0.5, 1.0);
    r.breakaway = loss * kt_random_uniform(random, 0.0, 2.0);
    r.viscous = loss * kt_random_uniform(random, 0.0, 1.0);
    r.linear = loss * kt_random_uniform(random, 0.0, 1.0);
    r.quadratic = loss * kt_random_uniform(random, 0.0, 1.0);
    r.dissipation = loss * kt_random_uniform(random, 0.0, 1.0);
    r.friction = loss * kt_random_uniform(random, 0.0, 1.0);
    r.stribeck = kt_random_uniform(random, 0.5, 2.0);
    r.smoothing = kt_random_uniform(random, 0.5, 2.0);
    r.slip = kt_random_uniform(random, 0.5, 2.0);
    r.in_body = kt_random_int(random, 0, 1) == 1;
    for (int i = 0; i < 6; i++) {
        r.stiffnesses[i] = kt_random_uniform(random, 0.0, 3.0);
        r.dampings[i] = loss * kt_random_uniform(random, 0.0, 2.0);
        r.quadratics[i] = loss * kt_random_uniform(random, 0.0, 2.0);
    }
    for (int i = 0; i < 3; i++) {
        const kt_function f = kt_function_constant(kt_random_normal(random));
        r.curve[i] = kt_curve_compile(&f, NULL, 0);
    }
    return r;
}

static double *component(kt_vec3 *u, int k) { return k == 0 ? &u->x : k == 1 ? &u->y : &u->z; }

/* Random ends. The second frame is turned from the first by less than 2.4 rad. The ends are neither near to coincidence
 * nor to a sphere's first touch, because derivatives of the energy grow there. */
static void random_ends(kt_random *random, const kt_effect_record *r, kt_effect_end end[2]) {
    for (bool again = true; again;) {
        double n[3];
        kt_random_direction(random, 3, n);
        const double angle = kt_random_uniform(random, 0.0, 2.4);
        for (int k = 0; k < 2; k++) {
            end[k].axes = kt_mat3_from_euler_vector(random_vector(random, 1.0));
            end[k].point = random_vector(random, 1.0);
            end[k].velocity = random_vector(random, 1.0);
            end[k].omega = random_vector(random, 1.0);
        }
        end[1].axes = kt_mat3_multiply(
            end[0].axes, kt_mat3_from_euler_vector(kt_vec3_make(angle * n[0], angle * n[1], angle * n[2])));
        const kt_vec3 d = kt_vec3_sub(end[0].point, end[1].point);
        const double far = kt_vec3_norm(d), dent = fabs(r->radius - kt_vec3_dot(d, end[1].axes.z));
        again = far < 0.8 || dent < 0.5 || dent < 0.3 * far; /* a turn of the plane does not reach its edge */
    }
}

/* An end after a step h along its twist, the velocity being `linear` and `angular`. */
static kt_effect_end moved(const kt_effect_end *end, kt_vec3 linear, kt_vec3 angular, double h) {
    kt_effect_end to = *end;
    to.point = kt_vec3_add(end->point, kt_vec3_scale(h, linear));
    to.axes = kt_mat3_multiply(kt_mat3_from_euler_vector(kt_vec3_scale(h, angular)), end->axes);
    return to;
}

static const kt_effect_kind *kind_of(const kt_effect_record *r) { return kt_effect_kinds[r->type]; }
static int ends_of(const kt_effect_record *r) {
    return kt_descriptor_end_count(kt_effect_descriptor((kt_effect_type)r->type));
}

static double energy_at(const kt_effect_record *r, const kt_effect_end end[2], const kt_vec3 linear[2],
                        const kt_vec3 angular[2], double h) {
    kt_wrench wrench[2];
    kt_effect_balance balance;
    const kt_effect_end there[2] = {moved(&end[0], linear[0], angular[0], h), moved(&end[1], linear[1], angular[1], h)};
    kind_of(r)->wrench(r, NULL, there, 0.0, wrench, &balance);
    return balance.energy;
}

/* Differences of sixth order, error h^6 / 140 of the seventh derivative. */
static const double weight[4] = {0.0, 0.75, -0.15, 1.0 / 60.0}, step = 0.003;

/* A rate by differences of step h, and its largest error. This is a sixty-third of the error with 2 h, and rounding of
 * energies, and of places of some metres in a force field, over h. */
typedef struct rate {
    double value, error;
} rate;

static rate rate_of(double fine, double coarse, double h, double energy, double pull) {
    return (rate){fine, fabs(coarse - fine) / 32.0 + 8.0 * EPS / h * (1.0 + fabs(energy) + pull)};
}

/* How far a motion goes in a unit of time. */
static double reach(const kt_vec3 linear[2], const kt_vec3 angular[2]) {
    return 1.0 + kt_vec3_norm(linear[0]) + kt_vec3_norm(linear[1]) + kt_vec3_norm(angular[0]) +
           kt_vec3_norm(angular[1]);
}

/* pull: of the force, times a motion of a metre and a radian. */
static rate energy_rate(const kt_effect_record *r, const kt_effect_end end[2], const kt_vec3 linear[2],
                        const kt_vec3 angular[2], double pull) {
    const double h = step / reach(linear, angular);
    double sum[2] = {0.0, 0.0};
    for (int k = 0; k < 2; k++)
        for (int i = 1; i <= 3; i++) {
            const double s = (k + 1) * h;
            sum[k] += weight[i] / s *
                      (energy_at(r, end, linear, angular, i * s) - energy_at(r, end, linear, angular, -i * s));
        }
    return rate_of(sum[0], sum[1], h, energy_at(r, end, linear, angular, 0.0), pull);
}

static rate joint_energy_rate(const kt_effect_record *r, double q, double v) {
    double sum[2] = {0.0, 0.0};
    kt_effect_balance balance;
    for (int k = 0; k < 2; k++)
        for (int i = -3; i <= 3; i++) {
            const double s = (k + 1) * 0.5 * step;
            (void)kind_of(r)->joint_force(r, NULL, q + i * s * v, v, 0.0, &balance);
            sum[k] += (i < 0 ? -weight[-i] : weight[i]) / s * balance.energy;
        }
    const double force = kind_of(r)->joint_force(r, NULL, q, v, 0.0, &balance);
    return rate_of(sum[0], sum[1], 0.5 * step, balance.energy, fabs(force));
}

/* Not within the differences' reach of a stop. */
static double random_position(kt_random *random, const kt_effect_record *r) {
    for (;;) {
        const double q = kt_random_uniform(random, -3.0, 3.0);
        if (fabs(q - r->lower) > 0.05 && fabs(q - r->upper) > 0.05)
            return q;
    }
}

/* ---- gradients --------------------------------------------------------------------------------------------------- */

static double pull_of(const kt_wrench w[2]) {
    return kt_vec3_norm(w[0].force) + kt_vec3_norm(w[0].moment) + kt_vec3_norm(w[1].force) + kt_vec3_norm(w[1].moment);
}

/* Each end, shifted and turned along and about each of the world's axes, at rest. */
static void check_gradient(kt_random *random, kt_effect_type type, kt_worst *worst) {
    const kt_effect_record r = random_record(random, type, true);
    const kt_vec3 zero = {0.0, 0.0, 0.0};
    kt_effect_end end[2];
    kt_wrench wrench[2];
    kt_effect_balance balance;
    random_ends(random, &r, end);
    for (int k = 0; k < 2; k++)
        end[k].velocity = end[k].omega = zero;
    kind_of(&r)->wrench(&r, NULL, end, 0.0, wrench, &balance);
    for (int i = 0; i < 12; i++) {
        kt_vec3 linear[2] = {zero, zero}, angular[2] = {zero, zero};
        const int k = i / 6;
        const bool turn = i % 6 >= 3;
        *component(turn ? &angular[k] : &linear[k], i % 3) = 1.0;
        const double force = *component(turn ? &wrench[k].moment : &wrench[k].force, i % 3);
        const rate rise = energy_rate(&r, end, linear, angular, pull_of(wrench));
        kt_worst_near(worst, force, -rise.value, rise.error, "end %d, direction %d", k, i % 6);
    }
}

KT_TEST(forces_are_the_gradient_of_the_energy) {
    static const kt_effect_type types[] = {KT_EFFECT_SPRING, KT_EFFECT_BUSHING, KT_EFFECT_ATTRACTION,
                                           KT_EFFECT_CONTACT};
    kt_random random = kt_random_of_test();
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        KT_WORST worst = kt_worst_make(kt_effect_type_name(types[i]));
        for (int n = 0; n < 300; n++)
            check_gradient(&random, types[i], &worst);
    }
}

KT_TEST(joint_forces_are_the_slope_of_the_energy) {
    static const kt_effect_type types[] = {KT_EFFECT_JOINT_SPRING, KT_EFFECT_JOINT_LIMIT};
    kt_random random = kt_random_of_test();
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        KT_WORST worst = kt_worst_make(kt_effect_type_name(types[i]));
        for (int n = 0; n < 300; n++) {
            const kt_effect_record r = random_record(&random, types[i], true);
            const double q = random_position(&random, &r);
            const rate slope = joint_energy_rate(&r, q, 1.0);
            kt_worst_near(&worst, kind_of(&r)->joint_force(&r, NULL, q, 0.0, 0.0, NULL), -slope.value, slope.error,
                          "%d", n);
        }
    }
}

/* ---- power ------------------------------------------------------------------------------------------------------- */

static double power_of(const kt_effect_end *end, kt_wrench w) {
    return kt_vec3_dot(w.force, end->velocity) + kt_vec3_dot(w.moment, end->omega);
}

/* The same with nothing cancelled: sum of |f_i v_i|. */
static double power_size(const kt_effect_end *end, kt_wrench w) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        kt_effect_end e = *end;
        sum += fabs(*component(&w.force, i) * *component(&e.velocity, i));
        sum += fabs(*component(&w.moment, i) * *component(&e.omega, i));
    }
    return sum;
}

/* P = supplied - dissipated - dV/dt on any motion, and heat is never given back.
 *
 * Without energy nothing is differenced: both sides are products of the same numbers. The longest way is drag's, in
 * units of EPS / 2 of sum |f_i v_i| = c |v|^2: f_i = -c v_i rounds once, f . v three times (a product, two sums); c
 * |v|^2 three times and once: 8. */
static void check_power(kt_random *random, kt_effect_type type, kt_worst *power, kt_worst *heat) {
    const kt_effect_record r = random_record(random, type, false);
    const kt_effect_kind *kind = kind_of(&r);
    kt_effect_balance balance;
    double sum, size;
    rate rise;
    if (ends_of(&r) == 0) {
        const double q = random_position(random, &r), v = kt_random_normal(random);
        sum = kind->joint_force(&r, NULL, q, v, 0.0, &balance) * v;
        rise = joint_energy_rate(&r, q, v);
        size = fabs(sum);
    } else {
        kt_effect_end end[2];
        kt_wrench wrench[2];
        random_ends(random, &r, end);
        kind->wrench(&r, NULL, end, 0.0, wrench, &balance);
        const kt_vec3 linear[2] = {end[0].velocity, end[1].velocity}, angular[2] = {end[0].omega, end[1].omega};
        sum = power_of(&end[0], wrench[0]) + (ends_of(&r) == 2 ? power_of(&end[1], wrench[1]) : 0.0);
        rise = energy_rate(&r, end, linear, angular, pull_of(wrench));
        size = power_size(&end[0], wrench[0]) + (ends_of(&r) == 2 ? power_size(&end[1], wrench[1]) : 0.0);
    }
    const bool stores = balance.energy != 0.0 || rise.value != 0.0;
    kt_worst_near(power, sum, balance.supplied - balance.dissipated - rise.value,
                  (stores ? rise.error : 0.0) + 4.0 * EPS * size, "%s", kt_effect_type_name(type));
    kt_worst_below(heat, fmax(0.0, -balance.dissipated), 0.0, "%s", kt_effect_type_name(type));
}

KT_TEST(power_is_supplied_less_dissipated_less_stored) {
    kt_random random = kt_random_of_test();
    KT_WORST heat = kt_worst_make("dissipated, when negative");
    for (int type = 0; type < KT_EFFECT_EXPRESSION; type++) { /* formulas: expression.c */
        KT_WORST power = kt_worst_make(kt_effect_type_name((kt_effect_type)type));
        for (int n = 0; n < 500; n++)
            check_power(&random, (kt_effect_type)type, &power, &heat);
    }
}

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

KT_TEST(pairs_leave_neither_force_nor_moment) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_EFFECT_EXPRESSION; type++) { /* formulas: expression.c */
        if (kt_descriptor_end_count(kt_effect_descriptor((kt_effect_type)type)) != 2)
            continue;
        KT_WORST net = kt_worst_make(kt_effect_type_name((kt_effect_type)type));
        for (int n = 0; n < 300; n++) {
            const kt_effect_record r = random_record(&random, (kt_effect_type)type, false);
            kt_effect_end end[2];
            kt_wrench w[2];
            random_ends(&random, &r, end);
            kind_of(&r)->wrench(&r, NULL, end, 0.0, w, NULL);
            const kt_vec3 moment = kt_vec3_add(kt_vec3_add(w[0].moment, kt_vec3_cross(end[0].point, w[0].force)),
                                               kt_vec3_add(w[1].moment, kt_vec3_cross(end[1].point, w[1].force)));
            const double size =
                kt_vec3_norm(w[0].force) * (1.0 + kt_vec3_norm(end[0].point) + kt_vec3_norm(end[1].point)) +
                kt_vec3_norm(w[0].moment) + kt_vec3_norm(w[1].moment);
            kt_worst_below(&net, kt_vec3_norm(kt_vec3_add(w[0].force, w[1].force)), 0.0, "force %d", n);
            kt_worst_below(&net, kt_vec3_norm(moment), 4.0 * EPS * size, "moment %d", n);
        }
    }
}

/* ---- corners ----------------------------------------------------------------------------------------------------- */

static bool is_finite(const kt_effect_balance *balance, double force) {
    return isfinite(force) && isfinite(balance->energy) && isfinite(balance->dissipated) && isfinite(balance->supplied);
}

/* Coincident points and frames, down to the smallest distances, at rest and in motion. */
KT_TEST(coincidence_and_rest_are_defined) {
    static const double sizes[] = {0.0, 5e-324, 1e-310, 1e-160, 1e-60, 1e-50, 1e-49, 1e-20};
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_EFFECT_EXPRESSION; type++) { /* formulas: expression.c */
        int undefined = 0;
        for (int n = 0; n < 64; n++) {
            const kt_effect_record r = random_record(&random, (kt_effect_type)type, false);
            const double at = sizes[n % 8], speed = sizes[n / 8];
            kt_effect_balance balance;
            double force = 0.0;
            if (ends_of(&r) == 0) {
                force = kind_of(&r)->joint_force(&r, NULL, at, speed, 0.0, &balance);
            } else {
                kt_effect_end end[2] = {{.axes = kt_mat3_identity()}, {.axes = kt_mat3_identity()}};
                kt_wrench w[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
                end[1].point = kt_vec3_make(at, -at, 0.5 * at);
                end[1].velocity = kt_vec3_make(speed, 0.0, -speed);
                end[0].omega = kt_vec3_make(0.0, speed, speed);
                kind_of(&r)->wrench(&r, NULL, end, 0.0, w, &balance);
                for (int k = 0; k < 3; k++)
                    force += *component(&w[0].force, k) + *component(&w[1].moment, k) + *component(&w[0].moment, k);
            }
            undefined += !is_finite(&balance, force);
        }
        kt_check_equal_int(kt_effect_type_name((kt_effect_type)type), undefined, 0);
    }
}
