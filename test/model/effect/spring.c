/* Springs: forces against differences of the energy, power against its sources, and forces at coincident points.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "effect/effect.h"

#include <float.h>

#define EPS DBL_EPSILON

static kt_vec3 random_vector(kt_random *random, double size) {
    return kt_vec3_make(size * kt_random_normal(random), size * kt_random_normal(random),
                        size * kt_random_normal(random));
}

static void random_ends(kt_random *random, kt_effect_end end[2]) {
    for (int k = 0; k < 2; k++) {
        end[k].axes = kt_mat3_from_euler_vector(random_vector(random, 1.0));
        end[k].point = random_vector(random, 1.0);
        end[k].velocity = random_vector(random, 1.0);
        end[k].omega = random_vector(random, 1.0);
    }
}

static kt_effect_record random_spring(kt_random *random) {
    return (kt_effect_record){.type = KT_EFFECT_SPRING,
                              .stiffness = kt_random_uniform(random, 1.0, 3.0),
                              .damping = kt_random_uniform(random, 0.5, 2.0),
                              .length = kt_random_uniform(random, 0.0, 2.0)};
}

static void push(const kt_effect_record *spring, const kt_effect_end end[2], kt_wrench wrench[2],
                 kt_effect_balance *balance) {
    kt_effect_kinds[KT_EFFECT_SPRING]->wrench(spring, NULL, end, 0.0, wrench, balance);
}

static double *component(kt_vec3 *u, int k) { return k == 0 ? &u->x : k == 1 ? &u->y : &u->z; }

/* -dV/dx by differences of sixth order, error step^6 / 140 of the seventh derivative of V. */
static double slope(const kt_effect_record *spring, const kt_effect_end end[2], int which, int k) {
    static const double weight[4] = {0.0, 0.75, -0.15, 1.0 / 60.0};
    const double step = 0.004;
    double sum = 0.0;
    for (int i = -3; i <= 3; i++) {
        kt_effect_end moved[2] = {end[0], end[1]};
        kt_wrench wrench[2];
        kt_effect_balance balance;
        *component(&moved[which].point, k) += i * step;
        push(spring, moved, wrench, &balance);
        sum += (i < 0 ? -weight[-i] : weight[i]) * balance.energy / step;
    }
    return -sum;
}

/* Energies reach 50 J, so rounding is 50 EPS / step = 3e-12. The distance is kept from zero, because derivatives grow
 * there. */
KT_TEST(spring_forces_are_the_energy_s_gradient) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force"), moment = kt_worst_make("moment");
    for (int n = 0; n < 500; n++) {
        kt_effect_end end[2];
        kt_wrench wrench[2];
        kt_effect_record spring = random_spring(&random);
        spring.damping = 0.0;
        random_ends(&random, end);
        if (kt_vec3_norm(kt_vec3_sub(end[1].point, end[0].point)) < 0.5)
            continue;
        push(&spring, end, wrench, NULL);
        for (int k = 0; k < 2; k++) {
            for (int i = 0; i < 3; i++)
                kt_worst_near(&force, *component(&wrench[k].force, i), slope(&spring, end, k, i), 5e-12,
                              "%d, end %d, direction %d", n, k, i);
            kt_worst_below(&moment, kt_vec3_norm(wrench[k].moment), 0.0, "%d, end %d", n, k);
        }
    }
}

/* P = supplied - dissipated - dV/dt. Here dV/dt = -sum of (force of a spring without damping) . velocity. */
KT_TEST(spring_power_is_what_the_energy_loses_and_the_damper_takes) {
    kt_random random = kt_random_of_test();
    KT_WORST power = kt_worst_make("power"), heat = kt_worst_make("dissipated, when negative");
    for (int n = 0; n < 500; n++) {
        kt_effect_end end[2];
        kt_wrench all[2], elastic[2];
        kt_effect_balance balance, conservative;
        const kt_effect_record spring = random_spring(&random);
        kt_effect_record undamped = spring;
        undamped.damping = 0.0;
        random_ends(&random, end);
        push(&spring, end, all, &balance);
        push(&undamped, end, elastic, &conservative);
        double sum = 0.0, gain = 0.0, scale = 0.0;
        for (int k = 0; k < 2; k++) {
            sum += kt_vec3_dot(all[k].force, end[k].velocity);
            gain -= kt_vec3_dot(elastic[k].force, end[k].velocity);
            scale += (kt_vec3_norm(all[k].force) + kt_vec3_norm(elastic[k].force)) * kt_vec3_norm(end[k].velocity);
        }
        kt_worst_near(&power, sum, balance.supplied - balance.dissipated - gain, 2.0 * EPS * scale, "%d", n);
        kt_worst_below(&heat, fmax(0.0, -balance.dissipated) + conservative.dissipated + fabs(balance.supplied), 0.0,
                       "%d", n);
    }
}

/* No net force, no net moment about the origin. */
KT_TEST(springs_pull_their_ends_along_one_line) {
    kt_random random = kt_random_of_test();
    KT_WORST net = kt_worst_make("net force"), moment = kt_worst_make("net moment");
    for (int n = 0; n < 500; n++) {
        kt_effect_end end[2];
        kt_wrench wrench[2];
        const kt_effect_record spring = random_spring(&random);
        random_ends(&random, end);
        push(&spring, end, wrench, NULL);
        const kt_vec3 total = kt_vec3_add(wrench[0].force, wrench[1].force);
        const kt_vec3 turn =
            kt_vec3_add(kt_vec3_cross(end[0].point, wrench[0].force), kt_vec3_cross(end[1].point, wrench[1].force));
        const double size = kt_vec3_norm(wrench[0].force) * (kt_vec3_norm(end[0].point) + kt_vec3_norm(end[1].point));
        kt_worst_below(&net, kt_vec3_norm(total), 0.0, "%d", n);
        kt_worst_below(&moment, kt_vec3_norm(turn), 2.0 * EPS * size, "%d", n);
    }
}

/* Ends on the x axis, 2.5 m apart, parting at 0.5 m/s. The spring has k = 4, c = 3, L = 2. */
KT_TEST(a_stretched_spring_pulls_with_its_tension) {
    const kt_effect_record spring = {.type = KT_EFFECT_SPRING, .stiffness = 4.0, .damping = 3.0, .length = 2.0};
    kt_effect_end end[2] = {{.axes = kt_mat3_identity()}, {.axes = kt_mat3_identity()}};
    kt_wrench wrench[2];
    kt_effect_balance balance;
    end[0].point = kt_vec3_make(1.0, 0.0, 0.0);
    end[1].point = kt_vec3_make(3.5, 0.0, 0.0);
    end[1].velocity = kt_vec3_make(0.5, 7.0, 0.0);
    push(&spring, end, wrench, &balance);
    kt_check_near("on the first end", wrench[0].force.x, 4.0 * 0.5 + 3.0 * 0.5, 4.0 * EPS);
    kt_check_near("on the second end", wrench[1].force.x, -3.5, 4.0 * EPS);
    kt_check_near("across", wrench[1].force.y, 0.0, 0.0);
    kt_check_near("energy", balance.energy, 0.5, EPS);
    kt_check_near("dissipated", balance.dissipated, 0.75, EPS);
    kt_check_near("supplied", balance.supplied, 0.0, 0.0);
}

/* The force is -k d at any distance, down to zero, and never NaN. */
KT_TEST(a_spring_of_no_length_pulls_with_minus_k_d) {
    const double distances[6] = {1.0, 1e-8, 1e-100, 1e-153, 1e-160, 0.0};
    const kt_effect_record spring = {.type = KT_EFFECT_SPRING, .stiffness = 4.0, .damping = 3.0};
    for (int i = 0; i < 6; i++) {
        kt_effect_end end[2] = {{.axes = kt_mat3_identity()}, {.axes = kt_mat3_identity()}};
        kt_wrench wrench[2];
        kt_effect_balance balance;
        end[1].point = kt_vec3_make(0.6 * distances[i], 0.0, -0.8 * distances[i]);
        push(&spring, end, wrench, &balance);
        const double bound = 8.0 * EPS * distances[i] + (distances[i] < 1e-153 ? 4e-160 : 0.0);
        kt_check_near("force x", wrench[1].force.x, -2.4 * distances[i], bound);
        kt_check_near("force z", wrench[1].force.z, 3.2 * distances[i], bound);
    }
}

/* Through coincident points along d': the mean of just before and just after. */
KT_TEST(coincident_points_feel_the_mean_of_both_sides) {
    kt_random random = kt_random_of_test();
    KT_WORST mean = kt_worst_make("mean force"), heat = kt_worst_make("dissipated");
    for (int n = 0; n < 100; n++) {
        const kt_effect_record spring = random_spring(&random);
        kt_effect_end end[2];
        kt_wrench wrench[3][2];
        kt_effect_balance balance[3];
        random_ends(&random, end);
        const kt_vec3 at = end[0].point = kt_vec3_make(0.0, 0.0, 0.0);
        const kt_vec3 along = kt_vec3_sub(end[1].velocity, end[0].velocity);
        for (int i = 0; i < 3; i++) {
            end[1].point = kt_vec3_add(at, kt_vec3_scale(1e-12 * (i - 1), along));
            push(&spring, end, wrench[i], &balance[i]);
        }
        for (int k = 0; k < 3; k++)
            kt_worst_near(&mean, *component(&wrench[1][1].force, k),
                          0.5 * (*component(&wrench[0][1].force, k) + *component(&wrench[2][1].force, k)),
                          20.0 * EPS * (1.0 + spring.stiffness * spring.length), "%d", n);
        kt_worst_near(&heat, balance[1].dissipated, balance[2].dissipated, 8.0 * EPS * (1.0 + balance[2].dissipated),
                      "%d", n);
    }
    const kt_effect_record spring = {.type = KT_EFFECT_SPRING, .stiffness = 4.0, .damping = 3.0, .length = 1.0};
    const kt_effect_end still[2] = {{.axes = kt_mat3_identity()}, {.axes = kt_mat3_identity()}};
    kt_wrench wrench[2];
    kt_effect_balance balance;
    push(&spring, still, wrench, &balance);
    kt_check_below("force at rest", kt_vec3_norm(wrench[1].force), 0.0);
    kt_check_near("energy at rest", balance.energy, 2.0, 0.0);
}
