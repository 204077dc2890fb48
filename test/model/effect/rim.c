/* The elastic contact of a disc's rim: power against energy, a disc that lies flat, and one that stands. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "effect/effect.h"

#include <math.h>

enum { DRAWS = 400 };

static kt_vec3 normal_vector(kt_random *random, double size) {
    return kt_vec3_make(size * kt_random_normal(random), size * kt_random_normal(random),
                        size * kt_random_normal(random));
}

static kt_effect_record disc_of(double radius, double exponent, double loss) {
    return (kt_effect_record){.type = KT_EFFECT_CONTACT,
                              .disc = true,
                              .ends = 2,
                              .radius = radius,
                              .stiffness = 3.0,
                              .exponent = exponent,
                              .dissipation = 0.2 * loss,
                              .friction = 0.5 * loss,
                              .rolling = 0.3 * loss,
                              .torsion = 0.2 * loss,
                              .slip = 0.7,
                              .turn = 0.9};
}

static kt_effect_end moved_by(const kt_effect_end *end, double h) {
    kt_effect_end to = *end;
    to.point = kt_vec3_add(end->point, kt_vec3_scale(h, end->velocity));
    to.axes = kt_mat3_multiply(kt_mat3_from_euler_vector(kt_vec3_scale(h, end->omega)), end->axes);
    return to;
}

static void touch(const kt_effect_record *r, const kt_effect_end end[2], double h, kt_wrench wrench[2],
                  kt_effect_balance *balance) {
    const kt_effect_end there[2] = {moved_by(&end[0], h), moved_by(&end[1], h)};
    kt_effect_kind_of(r->type)->wrench(r, NULL, there, 0.0, wrench, balance);
}

/* P = -dissipated - dV/dt, and dissipated >= 0, for ends that move at random. With the exponent 4 the third derivative
 * of V is continuous where a point begins to touch, and the error of a difference of fourth order is below 1e-7. */
KT_TEST(power_of_a_rim_is_lost_energy_and_what_it_dissipates) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("power");
    KT_WORST sink = kt_worst_make("a negative dissipation");
    KT_WORST force = kt_worst_make("sum of forces");
    int touching = 0;
    for (int draw = 0; draw < DRAWS; draw++) {
        const kt_effect_record r = disc_of(kt_random_uniform(&random, 0.2, 1.0), 4.0, draw % 2);
        const double h = 2e-3;
        kt_effect_end end[2];
        for (int k = 0; k < 2; k++)
            end[k] = (kt_effect_end){.axes = kt_mat3_from_euler_vector(normal_vector(&random, 1.0)),
                                     .point = normal_vector(&random, 0.5),
                                     .omega = normal_vector(&random, 1.0),
                                     .velocity = normal_vector(&random, 1.0)};
        kt_wrench wrench[2], other[2];
        kt_effect_balance balance, at[4];
        double power = 0.0;
        touch(&r, end, 0.0, wrench, &balance);
        for (int i = 0; i < 4; i++)
            touch(&r, end, (double[]){-2.0, -1.0, 1.0, 2.0}[i] * h, other, &at[i]);
        const double rate = (at[0].energy - at[3].energy + 8.0 * (at[2].energy - at[1].energy)) / (12.0 * h);
        for (int k = 0; k < 2; k++)
            power += kt_vec3_dot(wrench[k].force, end[k].velocity) + kt_vec3_dot(wrench[k].moment, end[k].omega);
        const double size = 1.0 + fabs(power) + fabs(rate) + balance.dissipated + at[0].energy + at[3].energy;
        kt_worst_near(&error, power, -balance.dissipated - rate, 1e-6 * size, "draw %d", draw);
        kt_worst_near(&force, kt_vec3_norm(kt_vec3_add(wrench[0].force, wrench[1].force)), 0.0, 0.0, "draw %d", draw);
        kt_worst_near(&sink, fmin(balance.dissipated, 0.0), 0.0, 1e-12 * size, "draw %d", draw);
        touching += balance.energy > 0.0;
    }
    kt_check_above("draws that touch", touching, DRAWS / 4);
}

/* A disc that lies flat at the depth x has 16 k x^m and no moment, also if it leans by less than rounding. An upright
 * one has k x^m alone. */
KT_TEST(flat_discs_stand_on_all_points_and_upright_ones_on_one) {
    static const double leans[] = {0.0, 1e-12, 1e-7, 1e-5};
    const kt_effect_record r = disc_of(0.4, 1.5, 0.0);
    const double x = 0.01, one = r.stiffness * pow(x, r.exponent);
    kt_effect_end end[2] = {{.axes = kt_mat3_identity()}, {.axes = kt_mat3_identity()}};
    kt_wrench wrench[2];
    kt_effect_balance balance;
    for (size_t i = 0; i < sizeof leans / sizeof *leans; i++)
        for (int turn = 0; turn < 3; turn++) {
            end[0].axes = kt_mat3_multiply(kt_mat3_from_euler_vector(kt_vec3_make(leans[i], 0.0, 0.0)),
                                           kt_mat3_from_euler_vector(kt_vec3_make(0.0, 0.0, turn)));
            end[0].point = kt_vec3_make(0.3, 0.2, -x);
            touch(&r, end, 0.0, wrench, &balance);
            kt_check_near("normal force", wrench[0].force.z / one, 16.0, 1e-4 + leans[i]);
            kt_check_near("moment", kt_vec3_norm(wrench[0].moment) / one, 0.0,
                          1e-12 + 16.0 * leans[i] * r.exponent * r.radius * r.radius / x);
        }
    end[0].axes = kt_mat3_from_euler_vector(kt_vec3_make(0.0, 1.5707963267948966, 0.0));
    end[0].point = kt_vec3_make(0.3, 0.2, r.radius - x);
    touch(&r, end, 0.0, wrench, &balance);
    kt_check_near("upright", wrench[0].force.z / one, 1.0, 1e-12);
}
