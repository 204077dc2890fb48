/* Checks an item using the keys of its type. The kind of a key selects the check of the member to which it refers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"
#include "model/describe.h"
#include "model/formula_names.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>

/* The check of one item. */
typedef struct kt_checked {
    kt_checker *checker;
    const void *object, *standard; /* the item, and the struct that its kind of item starts from */
    int end_body[2], end_count;    /* the bodies of the ends so far */
} kt_checked;

static const void *member(const void *object, const kt_key *key) { return (const char *)object + key->offset; }

/* An infinite default means "none". */
static void check_number(kt_checked *c, const kt_key *key) {
    const double *x = member(c->object, key), *standard = member(c->standard, key);
    if (isinf(*standard) && *x == *standard)
        return;
    if (key->range == KT_RANGE_POSITIVE)
        kt_checker_positive(c->checker, key->name, *x);
    else if (key->range == KT_RANGE_NOT_NEGATIVE)
        (void)kt_checker_not_negative(c->checker, key->name, "", *x);
    else
        (void)kt_checker_number(c->checker, key->name, *x);
}

static const char *const places_of_six[6] = {"[0]", "[1]", "[2]", "[3]", "[4]", "[5]"};

static void check_six(kt_checked *c, const kt_key *key) {
    const double *x = member(c->object, key);
    for (int i = 0; i < 6; i++)
        (void)kt_checker_not_negative(c->checker, key->name, places_of_six[i], x[i]);
}

/* A default of zero means that no axis is given. */
static void check_axis(kt_checked *c, const kt_key *key) {
    const kt_vec3 *axis = member(c->object, key), *standard = member(c->standard, key);
    const bool is_zero = axis->x == 0.0 && axis->y == 0.0 && axis->z == 0.0;
    const bool may_be_zero = standard->x == 0.0 && standard->y == 0.0 && standard->z == 0.0;
    if (!is_zero || !may_be_zero)
        (void)kt_checker_axis(c->checker, key->name, *axis);
}

static void check_vector(kt_checked *c, const kt_key *key) {
    const kt_vec3 *v = member(c->object, key);
    const double x[3] = {v->x, v->y, v->z};
    if (!kt_checker_values(c->checker, key->name, -1, "", x, 3))
        return;
    for (int i = 0; i < 3 && key->range == KT_RANGE_POSITIVE; i++)
        if (!(x[i] > 0.0)) {
            kt_checker_fault(c->checker, key->name, -1, "%s[%d] is %g; it must be greater than 0", key->name, i, x[i]);
            return;
        }
}

static void check_frame(kt_checked *c, const kt_key *key) {
    const kt_frame *frame = member(c->object, key);
    if (*frame != KT_FRAME_WORLD && *frame != KT_FRAME_BODY)
        kt_checker_fault(c->checker, key->name, -1, "%s is %d; take KT_FRAME_WORLD or KT_FRAME_BODY", key->name,
                         (int)*frame);
}

/* Two ends, given by one key or by two, must lie on two bodies. */
static void check_end(kt_checked *c, const kt_key *key, const kt_end *end, int sub) {
    const int k = c->end_count++;
    c->end_body[k] = kt_checker_end(c->checker, key->name, sub, end);
    if (k == 1 && c->end_body[0] == c->end_body[1] && c->end_body[0] != KT_BODY_UNKNOWN)
        kt_checker_fault(c->checker, key->name, -1, "both ends are on %s; it takes two bodies",
                         c->end_body[0] == KT_BODY_WORLD ? "the world" : kt_name_quote(end->body).text);
}

/* The terms must refer to distinct joints of one coordinate, and not all coefficients may be zero. */
static void check_terms(kt_checked *c, const kt_key *key) {
    kt_checker *checker = c->checker;
    const kt_loop *loop = c->object;
    if (loop->term_count < 1 || loop->terms == NULL) {
        kt_checker_fault(checker, key->name, -1, "%s are missing; give each joint its own", key->name);
        return;
    }
    const int stamp = ++checker->stamp;
    double most = 0.0;
    bool fine = true;
    for (int i = 0; i < loop->term_count; i++) {
        const kt_term *term = &loop->terms[i];
        const int body = kt_checker_scalar_joint(checker, key->name, i, term->joint);
        if (body >= 0 && checker->mark[body] == stamp)
            kt_checker_fault(checker, key->name, i, "joint %s is given twice; add up its %s",
                             kt_name_quote(term->joint).text, key->name);
        if (body >= 0)
            checker->mark[body] = stamp;
        if (!kt_number_is_fine(term->coefficient)) {
            char suffix[KT_NAME_TEXT_SIZE + 8];
            snprintf(suffix, sizeof suffix, " of %s", kt_name_quote(term->joint == NULL ? "" : term->joint).text);
            fine = kt_checker_value(checker, key->name, i, suffix, -1, term->coefficient);
        }
        most = fmax(most, fabs(term->coefficient));
    }
    if (fine && !kt_loop_has_formula(loop) && !(most >= 1.0 / KT_NUMBER_MOST))
        kt_checker_fault(checker, key->name, -1, "%s are all zero, or nearly so; give one that is not zero", key->name);
}

/* Checks the formula of a coupling; other formulas are functions of time. */
static void check_coupling_formula(kt_checked *c, const kt_key *key) {
    const kt_loop *loop = c->object;
    if (loop->formula != NULL)
        kt_checker_coupling(c->checker, key->name, loop);
}

static void check_function(kt_checked *c, const kt_key *key) {
    const kt_function *function = member(c->object, key);
    if (function->type == KT_FUNCTION_NONE && key->needed)
        kt_checker_fault(c->checker, key->name, -1, "%s is missing; give a number or a function of time", key->name);
    else if (key->range == KT_RANGE_POSITIVE)
        kt_checker_positive_function(c->checker, key->name, function);
    else
        (void)kt_checker_function(c->checker, key->name, function);
}

static void check_functions(kt_checked *c, const kt_key *key) {
    const kt_function *functions = member(c->object, key);
    for (int k = 0; k < 3; k++) {
        if (functions[k].type == KT_FUNCTION_NONE)
            kt_checker_fault(c->checker, key->name, -1,
                             "%s has a component missing; give three numbers or functions of time", key->name);
        else
            (void)kt_checker_function(c->checker, key->name, &functions[k]);
    }
}

/* The quaternion among the initial coordinates must be a unit quaternion; four zeros mean no rotation. */
static void check_initial_quaternion(kt_checked *c, const kt_key *key, const double *q) {
    const kt_quat quat = {q[0], q[1], q[2], q[3]};
    const double norm = sqrt(kt_quat_norm_squared(quat)); /* no overflow: magnitudes are at most 1e50 */
    if (q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0 && q[3] == 0.0)
        return;
    if (!(fabs(norm - 1.0) <= 1e-3))
        kt_checker_fault(c->checker, key->name, -1,
                         "%s: the quaternion [%g, %g, %g, %g] has norm %.6g; it must be 1 within 0.001", key->name,
                         q[0], q[1], q[2], q[3], norm);
}

/* Initial positions or velocities of a joint: as many numbers as the joint has. A quaternion is the last of a joint's
 * positions. */
static void check_coordinates(kt_checked *c, const kt_key *key) {
    const kt_joint_size *size = &kt_joint_sizes[((const kt_joint *)c->object)->type];
    const int count = key->kind == KT_KEY_POSITION ? size->nq : size->nv;
    const double *x = member(c->object, key);
    bool fine;
    if (count == 1)
        fine = kt_checker_number(c->checker, key->name, x[0]);
    else
        fine = kt_checker_values(c->checker, key->name, -1, "", x, count);
    if (fine && key->kind == KT_KEY_POSITION && size->nq > size->nv)
        check_initial_quaternion(c, key, x + size->nq - 4);
}

static void check_armature(kt_checked *c, const kt_key *key) {
    const int count = kt_joint_sizes[((const kt_joint *)c->object)->type].nv;
    const double *x = member(c->object, key);
    for (int i = 0; i < count; i++) {
        const char *suffix = count == 1 ? "" : places_of_six[i];
        if (kt_checker_not_negative(c->checker, key->name, suffix, x[i]) && x[i] != 0.0 && x[i] < KT_MASS_LEAST)
            kt_checker_fault(c->checker, key->name, -1, "%s%s is %g, too small to compute with; give 0, or %g or more",
                             key->name, suffix, x[i], KT_MASS_LEAST);
    }
}

/* The points of a spline: each must differ from the previous point. */
static void check_points(kt_checked *c, const kt_key *key) {
    const kt_track *track = c->object;
    if (track->points == NULL || track->point_count < 2) {
        kt_checker_fault(c->checker, key->name, -1, "a spline takes two points or more");
        return;
    }
    for (int i = 0; i < track->point_count; i++) {
        const kt_vec3 *p = &track->points[i];
        const double x[3] = {p->x, p->y, p->z};
        if (!kt_checker_values(c->checker, key->name, i, "", x, 3))
            return;
        if (i > 0 && !(kt_vec3_norm(kt_vec3_sub(*p, p[-1])) > 0.0)) {
            kt_checker_fault(c->checker, key->name, i, "points %d and %d of the spline are the same; leave one out",
                             i - 1, i);
            return;
        }
    }
}

/* A surface and a curve are checked by the keys of their own types. */
static void check_surface(kt_checked *c, const kt_key *key) {
    static const kt_surface standard = {.type = KT_SURFACE_NONE};
    const kt_surface *surface = member(c->object, key);
    const kt_descriptor *descriptor = kt_surface_descriptor(surface->type);
    if (descriptor == NULL)
        kt_checker_fault(c->checker, key->name, -1, "%s is missing; give one of plane, cylinder, sphere, torus",
                         key->name);
    else
        kt_checker_keys(c->checker, descriptor, surface, &standard);
}

static void check_track(kt_checked *c, const kt_key *key) {
    static const kt_track standard = {.type = KT_TRACK_NONE};
    const kt_track *track = member(c->object, key);
    const kt_descriptor *descriptor = kt_track_descriptor(track->type);
    if (descriptor == NULL)
        kt_checker_fault(c->checker, key->name, -1, "%s is missing; give one of line, circle, helix, spline",
                         key->name);
    else
        kt_checker_keys(c->checker, descriptor, track, &standard);
    if (track->type == KT_TRACK_HELIX && track->pitch == 0.0)
        kt_checker_fault(c->checker, "curve.pitch", -1, "the pitch of a helix is 0, which is a circle; give circle");
}

/* Checks the surface, curve or points of a loop on surfaces and curves. */
static void check_form(kt_checked *c, const kt_key *key) {
    if (key->kind == KT_KEY_SURFACE)
        check_surface(c, key);
    else if (key->kind == KT_KEY_TRACK)
        check_track(c, key);
    else if (key->kind == KT_KEY_POINTS)
        check_points(c, key);
}

static void check_key_joint(kt_checked *c, const kt_key *key) {
    const char *joint = *(const char *const *)member(c->object, key);
    if (c->checker->item == KT_ITEM_EFFECT)
        kt_checker_coordinate(c->checker, key->name, joint);
    else
        (void)kt_checker_scalar_joint(c->checker, key->name, -1, joint);
}

/* The name of a loop; a missing name is valid. */
static void check_loop_name(kt_checked *c, const kt_key *key) {
    const char *name = *(const char *const *)member(c->object, key);
    if (name != NULL && kt_names_find(&c->checker->names, KT_SCOPE_LOOP, name) < 0)
        kt_checker_fault(c->checker, key->name, -1, "there is no loop %s; name a loop of the scene",
                         kt_name_quote(name).text);
}

static void check_distance_key(kt_checked *c, const kt_key *key) {
    if (!((const kt_effect *)c->object)->initial_length)
        check_number(c, key);
}

static void check_rotation_key(kt_checked *c, const kt_key *key) {
    kt_checker_rotation(c->checker, key->name, -1, "", member(c->object, key));
}

static void check_one_end(kt_checked *c, const kt_key *key) { check_end(c, key, member(c->object, key), -1); }

static void check_both_ends(kt_checked *c, const kt_key *key) {
    const kt_end *ends = member(c->object, key);
    check_end(c, key, &ends[0], 0);
    check_end(c, key, &ends[1], 1);
}

/* The checks of the kinds of keys, except those of check_form. A flag has two valid values; a point is checked with its
 * end; check_function.c checks functions. */
static void (*const key_checks[KT_KEY_KIND_COUNT])(kt_checked *c, const kt_key *key) = {
    [KT_KEY_NUMBER] = check_number,
    [KT_KEY_DISTANCE] = check_distance_key,
    [KT_KEY_SIX] = check_six,
    [KT_KEY_VECTOR] = check_vector,
    [KT_KEY_AXIS] = check_axis,
    [KT_KEY_ROTATION] = check_rotation_key,
    [KT_KEY_FRAME] = check_frame,
    [KT_KEY_END] = check_one_end,
    [KT_KEY_BODY] = check_one_end,
    [KT_KEY_ENDS] = check_both_ends,
    [KT_KEY_JOINT] = check_key_joint,
    [KT_KEY_TERMS] = check_terms,
    [KT_KEY_FORMULA] = check_coupling_formula,
    [KT_KEY_LOOP] = check_loop_name,
    [KT_KEY_FUNCTION] = check_function,
    [KT_KEY_FUNCTIONS] = check_functions,
    [KT_KEY_POSITION] = check_coordinates,
    [KT_KEY_VELOCITY] = check_coordinates,
    [KT_KEY_ARMATURE] = check_armature,
};

static void check_key(kt_checked *c, const kt_key *key) {
    if (key_checks[key->kind] != NULL)
        key_checks[key->kind](c, key);
    else
        check_form(c, key);
}

void kt_checker_keys(kt_checker *checker, const kt_descriptor *descriptor, const void *object, const void *standard) {
    kt_checked c = {.checker = checker, .object = object, .standard = standard};
    for (int i = 0; i < descriptor->key_count; i++)
        check_key(&c, &descriptor->keys[i]);
}

void kt_checker_key(kt_checker *checker, const kt_key *key, const void *object, const void *standard) {
    kt_checked c = {.checker = checker, .object = object, .standard = standard};
    check_key(&c, key);
}
