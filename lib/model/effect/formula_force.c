/* Forces with formulas of t and of the motion of joints and markers (kt_variable).
 *
 *   in a joint           force = f
 *   between two ends     with d = p2 - p1, n = d / |d|: f n on the second, -f n on the first; f may use |d| and n . d'
 *   along a path         f dL/dq, L the length of the path (path.c); f may use L and L'
 *   on a point           force (f1, f2, f3) and moment (f4, f5, f6), in world axes or in the end's
 *
 * Numbers of actuators or of a polynomial spring may take the place of formulas (actuator.c).
 * Power: supplied = f q', f n . d', f L', or f . v + m . w. The formulas, or a law in C, are evaluated by
 * evaluate/effect_formula.c, and differentiated by derivative/effect_derivatives.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#include "effect/actuator.h"
#include "effect/path.h"
#include "model/formula_names.h"

#include <string.h>

/* Checks a point or surface of a path. */
static void check_point(kt_checker *checker, int i, const kt_path_point *point) {
    (void)kt_checker_end(checker, "path", i, &point->end);
    if (!kt_checker_not_negative(checker, "path", ".radius", point->radius) ||
        !kt_checker_not_negative(checker, "path", ".divisor", point->divisor) ||
        !kt_checker_vector(checker, "path", i, ".axis", point->axis) ||
        !kt_checker_vector(checker, "path", i, ".side", point->side))
        return;
    const bool is_surface = kt_path_point_is_surface(point);
    if (!is_surface && (point->inside || kt_vec3_norm_wide(point->axis) > 0.0 || kt_vec3_norm_wide(point->side) > 0.0))
        kt_checker_fault(checker, "path", i, "axis, side and inside are of a surface; give its radius, too");
    if (is_surface && point->divisor > 0.0)
        kt_checker_fault(checker, "path", i, "a branch begins at a point; give the divisor there, not at a surface");
}

/* Whether a body is the body of an earlier point. */
static bool is_known_body(const kt_effect *effect, int i) {
    const char *name = effect->path[i].end.body;
    for (int k = 0; k < i; k++) {
        const char *other = effect->path[k].end.body;
        if ((name == NULL && other == NULL) || (name != NULL && other != NULL && strcmp(name, other) == 0))
            return true;
    }
    return false;
}

static bool is_point_of_branch(const kt_effect *effect, int i) {
    return i >= 0 && i < effect->path_count && !kt_path_point_is_surface(&effect->path[i]);
}

/* A path consists of branches of two points or more; a divisor above 0 begins a branch. A surface lies between two
 * points of one branch. */
static void check_path(kt_checker *checker, const kt_effect *effect) {
    int bodies = 0;
    for (int i = 0; i < effect->path_count; i++) {
        const kt_path_point *point = &effect->path[i];
        check_point(checker, i, point);
        bodies += !is_known_body(effect, i);
        const bool begins = i == 0 || point->divisor > 0.0;
        if (kt_path_point_is_surface(point) &&
            !(is_point_of_branch(effect, i - 1) && is_point_of_branch(effect, i + 1) &&
              !(effect->path[i + 1].divisor > 0.0)))
            kt_checker_fault(checker, "path", i,
                             "a surface is between two points of a branch; give a point before it "
                             "and one behind it");
        else if (begins && !kt_path_point_is_surface(point) &&
                 (i + 1 >= effect->path_count || effect->path[i + 1].divisor > 0.0))
            kt_checker_fault(checker, "path", i,
                             "a branch of a path has two points or more; this one has a single "
                             "point");
    }
    if (bodies < 2)
        kt_checker_fault(checker, "path", -1,
                         "all its points are on one body, which it cannot move; give points on "
                         "two bodies");
    if (bodies > KT_PATH_LINK_MAX)
        kt_checker_fault(checker, "path", -1, "it touches %d bodies, but at most %d are possible", bodies,
                         (int)KT_PATH_LINK_MAX);
}

static void expression_check(kt_checker *checker, const kt_effect *effect) {
    kt_formula_names names = kt_formula_names_of(checker->description, effect);
    const bool on_body = effect->end_count == 1;
    bool any = false;
    if (effect->end_count < 0 || effect->end_count > 2) {
        kt_checker_fault(checker, "end_count", -1,
                         "end_count is %d; give 0 (in a joint), 1 (on a body) or 2 (between two)", effect->end_count);
        return;
    }
    if (effect->path_count < 0 || (effect->path_count > 0 && (effect->path == NULL || effect->end_count != 2))) {
        kt_checker_fault(checker, "path", -1, "a path has path_count points in `path`, and end_count 2");
        return;
    }
    if (effect->end_count == 0)
        kt_checker_coordinate(checker, "joint", effect->joint);
    if (kt_effect_has_path(effect))
        check_path(checker, effect);
    for (int k = 0; k < effect->end_count && !kt_effect_has_path(effect); k++)
        (void)kt_checker_end(checker, on_body ? "at" : "between", on_body ? -1 : k, &effect->between[k]);
    if (kt_effect_has_numbers(effect)) {
        kt_checker_numbers(checker, effect);
        return;
    }
    if (effect->law != NULL) {
        kt_checker_law(checker, effect);
        return;
    }
    for (int k = 0; k < 6; k++) {
        if (effect->formula[k] == NULL)
            continue;
        any = true;
        if (k > 0 && !on_body) {
            kt_checker_fault(checker, k < 3 ? "force" : "torque", -1,
                             "an effect in a joint or between two ends has one formula, force; leave the others out");
            return;
        }
        if (!kt_checker_formula(checker, k < 3 ? "force" : "torque", effect->formula[k], &names))
            return;
    }
    if (!any || (!on_body && effect->formula[0] == NULL))
        kt_checker_fault(checker, "force", -1, "the formula is missing; give force%s, or actuators",
                         on_body ? " or torque" : "");
}

#if KT_IS_OF_VALUES
static kt_vec3 in_world(const kt_effect_record *effect, const kt_effect_end *end, const double x[3]) {
    const kt_vec3 value = {x[0], x[1], x[2]};
    return effect->in_body ? kt_mat3_apply(end->axes, value) : value;
}

/* The wrenches of the formulas' values: f1 .. f6 on a point, or f1 along the line between two ends. */
static void expression_wrench(const kt_effect_record *effect, const double values[6], const kt_effect_end *end,
                              kt_wrench *wrench, kt_effect_balance *balance) {
    double supplied;
    if (effect->ends == 1) {
        wrench[0] = (kt_wrench){.moment = in_world(effect, end, values + 3), .force = in_world(effect, end, values)};
        supplied = kt_vec3_dot(wrench[0].force, end[0].velocity) + kt_vec3_dot(wrench[0].moment, end[0].omega);
    } else {
        const kt_vec3 d = kt_vec3_sub(end[1].point, end[0].point),
                      moving = kt_vec3_sub(end[1].velocity, end[0].velocity);
        const double length = kt_vec3_norm(d); /* coincident ends have no direction, and no force */
        const kt_vec3 force = kt_vec3_scale(length > 0.0 ? values[0] / length : 0.0, d), none = {0.0, 0.0, 0.0};
        wrench[0] = (kt_wrench){.moment = none, .force = kt_vec3_scale(-1.0, force)};
        wrench[1] = (kt_wrench){.moment = none, .force = force};
        supplied = kt_vec3_dot(force, moving);
    }
    if (balance)
        *balance = (kt_effect_balance){.supplied = supplied};
}

/* numbers: the values of the formulas, and the partial derivatives of the first by length and speed. With P = 1 - n n':
 *     d(f n)/dd = f_l n n' + n (f_s P d')' / |d| + f P / |d|,   d(f n)/dd' = f_s n n'
 * Vectors that are fixed in the body turn with it. */
static void expression_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                double t, kt_effect_jacobian *jacobian) {
    (void)t;
    *jacobian = (kt_effect_jacobian){.at_point = effect->ends == 2};
    if (effect->ends == 1) {
        jacobian->force = in_world(effect, end, numbers);
        jacobian->moment = in_world(effect, end, numbers + 3);
        if (effect->in_body) {
            jacobian->stiffness[0][0] = kt_mat3_scale(-1.0, kt_mat3_skew(jacobian->moment));
            jacobian->stiffness[1][0] = kt_mat3_scale(-1.0, kt_mat3_skew(jacobian->force));
        }
        return;
    }
    const kt_vec3 d = kt_vec3_sub(end[1].point, end[0].point), moving = kt_vec3_sub(end[1].velocity, end[0].velocity);
    const double length = kt_vec3_norm(d);
    if (!(length > 0.0))
        return;
    const kt_vec3 n = kt_vec3_scale(1.0 / length, d);
    const double rate = kt_vec3_dot(n, moving), across = numbers[0] / length;
    const kt_vec3 turning = kt_vec3_scale(numbers[7] / length, kt_vec3_sub(moving, kt_vec3_scale(rate, n)));
    const kt_vec3 along = kt_vec3_add(kt_vec3_scale(numbers[6] - across, n), turning);
    jacobian->force = kt_vec3_scale(numbers[0], n);
    jacobian->stiffness[1][1] = kt_mat3_add(kt_mat3_scale(across, kt_mat3_identity()), kt_outer_product(n, along));
    jacobian->damping[1][1] = kt_mat3_scale(numbers[7], kt_outer_product(n, n));
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_expression) = {.check = expression_check,
                                                        .jacobian = KT_IF_JACOBIAN(expression_jacobian),
                                                        .formula_wrench = KT_IF_JACOBIAN(expression_wrench),
                                                        .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"joint", KT_KEY_JOINT, KT_EFFECT_AT(joint), "", "the joint or loop, or `NAME[k]`, in which it acts; or", "none",
     .needed = false},
    {"between", KT_KEY_ENDS, KT_EFFECT_AT(between), "", "the two ends that it pushes apart; or", "none",
     .needed = false},
    {"path", KT_KEY_PATH, KT_EFFECT_AT(path), "", "the points and surfaces along which it acts; or", "none",
     .needed = false},
    {"at", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the point of a body that it acts on", "none", .needed = false},
    {"force", KT_KEY_FORMULAS, KT_EFFECT_AT(formula[0]), "N m|N", "f: a formula; on a body a list of three, N", "none",
     .needed = false},
    {"torque", KT_KEY_FORMULAS, KT_EFFECT_AT(formula[3]), "N m", "on a body: a list of three formulas", "none",
     .needed = false},
    {"actuators", KT_KEY_ACTUATORS, KT_EFFECT_AT(actuators), "",
     "in place of formulas: a list of actuators, whose forces are added", "none", .needed = false},
    {"lower", KT_KEY_BOUND, KT_EFFECT_AT(lower), "N m|N", "of actuators: the least sum", "none", .needed = false},
    {"upper", KT_KEY_BOUND, KT_EFFECT_AT(upper), "N m|N", "of actuators: the largest sum", "none", .needed = false},
    {"spring", KT_KEY_SPRING, KT_EFFECT_AT(spring), "", "in place of formulas: a spring and a damper by polynomials",
     "none", .needed = false},
    {"frame", KT_KEY_FRAME, KT_EFFECT_AT(frame), "",
     "on a body: `world`, or `body` for components along the axes of the marker, or else of the body", "world",
     .needed = false},
};
const kt_descriptor kt_effect_expression_descriptor = {
    .name = "expression",
    .help = "a force by formulas of t, parameters and the motion of joints and markers",
    .formula = "force = f    of t, position.JOINT, velocity.JOINT, marker.BODY.MARKER.x, .vx, as columns are\n"
               "             named, and gravity.JOINT, which balances gravity in a joint;\n"
               "             in a loop also of position.LOOP and velocity.LOOP;\n"
               "             between two ends of length and speed, and f > 0 pushes them apart;\n"
               "             along a path likewise, of its length; or by numbers of actuators, or of a spring",
    .example = KT_EXAMPLE_ARM
    "  - {type: expression, joint: arm, force: \"-3*position.arm^3 - 0.2*velocity.arm*abs(velocity.arm)\"}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
