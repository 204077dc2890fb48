/* Effects that exert no force, whatever the motion: a key was forgotten, or the force acts on the ground. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/angles.h"

#include "advice/advice.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Counts to the number of bodies, and so ends in a ring. */
bool kt_body_stands_still(const kt_description *d, const char *name) {
    int left = d->body_count, i = kt_advised_body(d, name);
    for (; i >= 0 && left > 0 && d->bodies[i].joint.type == KT_JOINT_FIXED; left--)
        i = kt_advised_body(d, d->bodies[i].parent);
    return i < 0;
}

static bool all_are_zero(const double *numbers, int count) {
    for (int i = 0; i < count; i++)
        if (numbers[i] != 0.0)
            return false;
    return true;
}

/* Returns the keys of an effect of which one at least must not be 0; NULL: one is not, or the type has no such keys. */
static const char *missing_keys_of(const kt_effect *e) {
    switch (e->type) {
    case KT_EFFECT_SPRING:
    case KT_EFFECT_JOINT_SPRING:
        return e->stiffness == 0.0 && e->damping == 0.0 ? "`stiffness` or `damping`" : NULL;
    case KT_EFFECT_BUSHING:
        return all_are_zero(e->stiffnesses, 6) && all_are_zero(e->dampings, 6) ? "`stiffness` or `damping`" : NULL;
    case KT_EFFECT_JOINT_FRICTION:
        return e->coulomb == 0.0 && !(e->breakaway > 0.0) && e->viscous == 0.0 && e->friction == 0.0 &&
                       e->efficiency == 1.0
                   ? "`coulomb`, `static`, `viscous`, `coefficient` or `efficiency`"
                   : NULL;
    case KT_EFFECT_DRAG:
        return e->linear == 0.0 && e->quadratic == 0.0 && all_are_zero(e->dampings, 6) && all_are_zero(e->quadratics, 6)
                   ? "`linear` or `quadratic`"
                   : NULL;
    default:
        return NULL;
    }
}

/* The number of ends of an effect; 0: it acts in a joint or along a path, or the number is unknown here. */
static int ends_of(const kt_effect *e) {
    switch (e->type) {
    case KT_EFFECT_FORCE:
    case KT_EFFECT_TORQUE:
    case KT_EFFECT_DRAG:
    case KT_EFFECT_THRUST:
        return 1;
    case KT_EFFECT_SPRING:
    case KT_EFFECT_BUSHING:
    case KT_EFFECT_ATTRACTION:
    case KT_EFFECT_CONTACT:
        return 2;
    case KT_EFFECT_EXPRESSION:
        return e->joint == NULL && e->path == NULL ? e->end_count : 0;
    default:
        return 0;
    }
}

static bool sets_numbers(const kt_scene *scene) {
    for (int i = 0; i < scene->event_count; i++)
        if (scene->events[i].set_count > 0)
            return true;
    return false;
}

int kt_idle_warn(kt_warnings *warnings, const kt_scene *scene) {
    const kt_description *d = &scene->description;
    const bool is_set = sets_numbers(scene);
    int count = 0;
    for (int i = 0; i < d->effect_count; i++) {
        const kt_effect *e = &d->effects[i];
        const char *missing = is_set ? NULL : missing_keys_of(e), *type = kt_effect_type_name(e->type);
        const int ends = ends_of(e);
        bool still = ends > 0;
        for (int k = 0; k < ends; k++)
            still = still && kt_body_stands_still(d, e->between[k].body);
        if (missing == NULL && !still)
            continue;
        char name[100], remedy[80];
        if (e->name != NULL && e->name[0] != '\0')
            (void)snprintf(name, sizeof name, "'%.90s'", e->name);
        else
            (void)snprintf(name, sizeof name, "effects[%d]", i);
        if (still)
            (void)snprintf(remedy, sizeof remedy, "Let it act on a body that moves");
        else
            (void)snprintf(remedy, sizeof remedy, "Give it %s", missing);
        const kt_warning warning = kt_warning_at("idle_effect", 0.0, (double)NAN, NULL, remedy);
        if (still)
            kt_warn(warnings, &warning, "%s (%s) moves nothing: %s fixed to the world", name, type,
                    ends > 1 ? "both its ends are" : "its end is");
        else
            kt_warn(warnings, &warning, "%s (%s) exerts no force: all of its numbers are 0", name, type);
        count++;
    }
    return count;
}

/* ---- slender rods ------------------------------------------------------------------------------------------------ */

/* Returns whether a point of the body's frame is on the axis of its rod. */
static bool is_on_axis(const kt_shape *rod, kt_vec3 at) {
    const kt_vec3 along = kt_vec3_normalize(kt_vec3_sub(rod->to, rod->from)), from = kt_vec3_sub(at, rod->from);
    return kt_vec3_norm(kt_vec3_cross(along, from)) <= 1e-9 * (kt_vec3_norm(from) + kt_vec3_norm(rod->to));
}

static kt_vec3 end_on_body(const kt_body *body, const kt_end *end) {
    for (int i = 0; end->marker != NULL && i < body->marker_count; i++)
        if (strcmp(body->markers[i].name, end->marker) == 0)
            return body->markers[i].at;
    return end->at;
}

/* Returns whether a loop may hold the turn of a body about the axis of its rod. */
static bool loop_holds_turn(const kt_loop *loop, const kt_body *body) {
    for (int k = 0; k < 2; k++)
        if (loop->between[k].body != NULL && strcmp(loop->between[k].body, body->name) == 0 &&
            ((loop->type != KT_LOOP_SPHERICAL && loop->type != KT_LOOP_DISTANCE) ||
             !is_on_axis(&body->shape, end_on_body(body, &loop->between[k]))))
            return true;
    return false;
}

/* Returns whether nothing resists or holds the turn of a body about the axis of its rod. */
static bool turns_without_inertia(const kt_description *d, const kt_body *body) {
    kt_vec3 com;
    kt_sym3 inertia;
    bool turns = (body->joint.type == KT_JOINT_SPHERICAL || body->joint.type == KT_JOINT_FREE) &&
                 body->shape.type == KT_SHAPE_ROD && body->mass > 0.0 && body->shape.radius == 0.0 &&
                 body->inertia_of_shape && body->joint.armature[0] == 0.0 &&
                 is_on_axis(&body->shape, kt_vec3_make(0.0, 0.0, 0.0)) &&
                 kt_body_inertia(body, &com, &inertia, NULL) == KT_OK;
    for (int i = 0; turns && i < d->body_count; i++)
        turns = d->bodies[i].parent == NULL || strcmp(d->bodies[i].parent, body->name) != 0;
    for (int i = 0; turns && i < d->loop_count; i++)
        turns = !loop_holds_turn(&d->loops[i], body);
    return turns;
}

int kt_slender_warn(kt_warnings *warnings, const kt_scene *scene) {
    const kt_description *d = &scene->description;
    int count = 0;
    for (int i = 0; i < d->body_count; i++) {
        if (!turns_without_inertia(d, &d->bodies[i]))
            continue;
        const kt_warning warning = kt_warning_of("slender_rod", 0.0, "kg m^2", "Give its shape a `radius`");
        kt_warn(warnings, &warning,
                "body '%s' is a rod without a radius on a %s joint: nothing resists its turn about its own axis, so "
                "that the motion is undetermined",
                d->bodies[i].name, kt_joint_type_name(d->bodies[i].joint.type));
        count++;
    }
    return count;
}
