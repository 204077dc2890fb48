/* Derivatives of effects in closed form, against those of their own code by dual numbers.
 *
 * Both are exact but for rounding. The units of bounds are the largest number of an effect's wrench and matrices, and
 * of the terms that add up to a joint's slope. The worst of sixty seeds is 0.40 of these units.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "derivative/dual_effect.h"

#include <math.h>
#include <string.h>

#define BOUND 1e-14
enum { DRAWS = 400, NUMBERS = 6 + 2 * 36 };

static kt_vec3 draw_vector(kt_random *random, double size) {
    return kt_vec3_make(size * kt_random_normal(random), size * kt_random_normal(random),
                        size * kt_random_normal(random));
}

static kt_effect_record draw_effect(kt_random *random, int type, int ends) {
    kt_effect_record effect = {.type = type, .ends = ends, .in_body = kt_random_int(random, 0, 1) == 1};
#define DRAW(member) effect.member = kt_random_uniform(random, 0.1, 3.0);
    KT_EFFECT_NUMBERS(DRAW)
#undef DRAW
    effect.exponent = kt_random_uniform(random, 1.0, 2.5);
    effect.upper = effect.lower + kt_random_uniform(random, 0.0, 2.0);
    if (type == KT_EFFECT_SERVO) /* bounds of a force: none, above alone, or both */
        effect.lower = effect.lower > 1.0 ? -(double)INFINITY : -5.0 * effect.lower;
    if (type == KT_EFFECT_SERVO)
        effect.upper *= effect.stiffness > 1.5 ? (double)INFINITY : 3.0;
    effect.breakaway = effect.coulomb * kt_random_uniform(random, 0.5, 2.0);
    for (int k = 0; k < 6 && (type != KT_EFFECT_DRAG || effect.in_body); k++) { /* drag of a point, or along axes */
        effect.stiffnesses[k] = kt_random_uniform(random, 0.0, 3.0);
        effect.dampings[k] = kt_random_uniform(random, 0.0, 3.0);
        effect.quadratics[k] = kt_random_uniform(random, 0.0, 3.0);
    }
    for (int k = 0; k < 3; k++)
        effect.curve[k] = (kt_curve){.type = KT_FUNCTION_CONSTANT, .a = kt_random_normal(random)};
    if (type == KT_EFFECT_THRUST) /* a function that changes */
        effect.curve[0] = (kt_curve){.type = KT_FUNCTION_SINE, .a = 2.0, .b = 1.0, .c = 3.0};
    effect.exhaust = draw_vector(random, 1.0);
    return effect;
}

/* Two frames, at every seventh draw at rest, at every fifth in one place, and else from far apart to next to each
 * other. */
static void draw_ends(kt_random *random, int draw, kt_effect_end end[2]) {
    const double apart = draw % 5 ? pow(10.0, kt_random_uniform(random, -4.0, 0.5)) : 0.0;
    kt_vec3 theta = draw_vector(random, 1.0);
    const double angle = fmin(3.0, (draw % 3 ? 1.0 : apart) * kt_vec3_norm(theta));
    end[0] = (kt_effect_end){.axes = kt_mat3_from_euler_vector(draw_vector(random, 1.0)),
                             .point = draw_vector(random, 1.0),
                             .omega = draw_vector(random, draw % 7 ? 1.0 : 0.0),
                             .velocity = draw_vector(random, draw % 7 ? 1.0 : 0.0)};
    theta = kt_vec3_scale(angle, kt_vec3_normalize(theta));
    end[1] = (kt_effect_end){.axes = kt_mat3_multiply(end[0].axes, kt_mat3_from_euler_vector(theta)),
                             .point = kt_vec3_add(end[0].point, draw_vector(random, apart)),
                             .omega = draw_vector(random, draw % 7 ? 1.0 : 0.0),
                             .velocity = draw_vector(random, draw % 7 ? 1.0 : 0.0)};
}

/* All numbers, in the order of the struct; those that a force at a point does not set are zero. */
static void flatten(kt_effect_jacobian s, double *x) {
    const kt_mat3 none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    size_t n = 0;
    const kt_vec3 wrench[2] = {s.at_point ? none.x : s.moment, s.force};
    for (int k = 0; k < 2; k++, n += 3)
        memcpy(x + n, &wrench[k], sizeof wrench[k]);
    for (int k = 0; k < 8; k++, n += 9) {
        const kt_mat3 m = k < 4 ? s.stiffness[k / 2][k % 2] : s.damping[k / 2 - 2][k % 2];
        const kt_mat3 kept = s.at_point && k % 4 != 3 ? none : m;
        memcpy(x + n, &kept, sizeof kept);
    }
}

/* Returns whether anything changes the effect. */
static bool compare(const kt_effect_record *effect, const kt_effect_end end[2], kt_worst *worst, int draw) {
    kt_effect_jacobian closed, dual;
    double x[NUMBERS], y[NUMBERS], largest = 0.0, slope = 0.0;
    memset(&closed, 0xFF, sizeof closed);
    kt_effect_kind_of(effect->type)->jacobian(effect, NULL, end, 0.3, &closed);
    kt_dual_effect_jacobian(effect, NULL, end, 0.3, &dual);
    flatten(closed, x);
    flatten(dual, y);
    for (int i = 0; i < NUMBERS; i++) {
        largest = fmax(largest, fabs(y[i]));
        slope = fmax(slope, i < 6 ? 0.0 : fabs(y[i]));
    }
    for (int i = 0; i < NUMBERS; i++)
        kt_worst_near(worst, x[i], y[i], BOUND * largest, "draw %d number %d", draw, i);
    return slope > 0.0;
}

KT_TEST(slopes_of_effects_between_ends_in_closed_form_are_those_of_dual_numbers) {
    static const struct {
        int type, ends;
        const char *name;
    } types[] = {
        {KT_EFFECT_SPRING, 2, "spring"},   {KT_EFFECT_BUSHING, 2, "bushing"}, {KT_EFFECT_ATTRACTION, 2, "attraction"},
        {KT_EFFECT_CONTACT, 2, "contact"}, {KT_EFFECT_FORCE, 1, "force"},     {KT_EFFECT_TORQUE, 1, "torque"},
        {KT_EFFECT_DRAG, 1, "drag"},       {KT_EFFECT_THRUST, 1, "thrust"}};
    kt_random random = kt_random_of_test();
    for (size_t k = 0; k < sizeof types / sizeof *types; k++) {
        KT_WORST error = kt_worst_make(types[k].name);
        int changed = 0;
        for (int draw = 0; draw < DRAWS; draw++) {
            const kt_effect_record effect = draw_effect(&random, types[k].type, types[k].ends);
            kt_effect_end end[2];
            draw_ends(&random, draw, end);
            changed += compare(&effect, end, &error, draw);
        }
        kt_check_above("draws that change with the state", changed, 0.3 * DRAWS);
    }
}

KT_TEST(slopes_of_joint_forces_in_closed_form_are_those_of_dual_numbers) {
    static const struct {
        int type;
        const char *name;
    } types[] = {{KT_EFFECT_JOINT_SPRING, "joint_spring"},
                 {KT_EFFECT_JOINT_DAMPER, "joint_damper"},
                 {KT_EFFECT_JOINT_FRICTION, "joint_friction"},
                 {KT_EFFECT_JOINT_LIMIT, "joint_limit"},
                 {KT_EFFECT_SERVO, "servo"},
                 {KT_EFFECT_MOTOR, "motor"}};
    kt_random random = kt_random_of_test();
    for (size_t k = 0; k < sizeof types / sizeof *types; k++) {
        KT_WORST error = kt_worst_make(types[k].name);
        int changed = 0;
        for (int draw = 0; draw < DRAWS; draw++) {
            const kt_effect_record effect = draw_effect(&random, types[k].type, 0);
            const double q = 2.0 * kt_random_normal(&random), v = draw % 7 ? kt_random_normal(&random) : 0.0;
            double closed[2], dual[2];
            kt_effect_kind_of(effect.type)->joint_derivatives(&effect, NULL, q, v, 0.3, closed);
            kt_dual_joint_derivatives(&effect, NULL, q, v, 0.3, dual);
            const double terms = effect.stiffness + (effect.coulomb + effect.breakaway) / effect.smoothing;
            for (int i = 0; i < 2; i++)
                kt_worst_near(&error, closed[i], dual[i], BOUND * (terms + fmax(fabs(dual[0]), fabs(dual[1]))),
                              "draw %d by %s", draw, i ? "v" : "q");
            changed += dual[0] != 0.0 || dual[1] != 0.0;
        }
        if (types[k].type != KT_EFFECT_MOTOR)
            kt_check_above("draws that change with the state", changed, 0.3 * DRAWS);
    }
}
