/* Effects that exert no force, whatever the motion: a key was forgotten, or the force acts on the ground. */
#include "advice/angles.h"

#include "advice/advice.h"

#include <math.h>
#include <stdio.h>

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
        return e->coulomb == 0.0 && !(e->breakaway > 0.0) && e->viscous == 0.0 ? "`coulomb`, `static` or `viscous`"
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
