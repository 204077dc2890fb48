/* kt_model_check: the faults that only the mechanism as a whole shows (mechanism_inertia.c), of any description.
 *
 * If the description has other faults as well, bodies with faults are replaced by valid bodies, so that no fault is
 * reported only because of another fault.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"

#include <stdlib.h>
#include <string.h>

typedef struct others {
    const kt_description *description;
    kt_body *bodies;   /* a copy in which bodies with faults are sound; NULL: no body has faults */
    bool unknown;      /* a fault leaves the mechanism undefined */
    bool hides_joints; /* a joint has a fault */
    kt_report *report; /* of the caller; NULL: none */
    kt_error first;    /* passed to it */
    void *user;
    bool no_memory;
} others;

/* Replaces a body that has a fault by one of mass 1. A joint with a fault (not keeps_joint) becomes fixed, so that the
 * parent receives the body's inertia. */
static void make_sound(kt_body *body, bool keeps_joint) {
    kt_body sound = kt_body_default();
    if (keeps_joint)
        sound.joint = body->joint;
    sound.name = body->name;
    sound.parent = body->parent;
    sound.markers = body->markers;
    sound.marker_count = body->marker_count;
    sound.mass = 1.0;
    sound.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    *body = sound;
}

/* Stores what a fault means for a check of the mechanism as a whole. Faults of loops, names, parents and markers leave
 * the mechanism undefined. A body with another fault is replaced by a valid body, in a copy of the list. Faults of
 * gravity and of effects do not matter. */
static void record_fault(void *user, const kt_place *place, const kt_error *error) {
    others *o = user;
    const kt_description *d = o->description;
    const bool is_body = place->item == KT_ITEM_BODY;
    (void)error;
    if (place->item == KT_ITEM_LOOP || (place->item == KT_ITEM_SCENE && strcmp(place->field, "gravity") != 0) ||
        (is_body && (strcmp(place->field, "name") == 0 || strcmp(place->field, "parent") == 0 ||
                     strcmp(place->field, "markers") == 0)))
        o->unknown = true;
    if (!is_body || o->unknown || o->no_memory)
        return;
    if (!o->bodies) {
        o->bodies = malloc((size_t)d->body_count * sizeof *o->bodies);
        o->no_memory = !o->bodies;
        if (o->no_memory)
            return;
        memcpy(o->bodies, d->bodies, (size_t)d->body_count * sizeof *o->bodies);
    }
    const bool is_of_joint = strncmp(place->field, "joint", 5) == 0;
    o->hides_joints = o->hides_joints || is_of_joint;
    make_sound(&o->bodies[place->index], !is_of_joint);
}

/* A fault in a joint leaves open which parts are rigid. */
static void pass_fault(void *user, const kt_place *place, const kt_error *error) {
    others *o = user;
    if (o->hides_joints && place->item == KT_ITEM_LOOP)
        return;
    if (o->first.code == KT_OK)
        o->first = *error;
    if (o->report)
        o->report(o->user, place, error);
}

kt_status kt_model_check(const kt_description *description, kt_report *report, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, description))
        return KT_ERROR_ARGUMENT;
    others o = {.description = description, .report = report, .user = user};
    kt_status status = kt_description_check(description, record_fault, &o, error);
    if (o.no_memory)
        status = kt_error_set(error, KT_ERROR_MEMORY, "kt_model_check", "out of memory");
    if (status != KT_ERROR_MEMORY && !o.unknown) {
        kt_description sound = *description;
        sound.gravity = kt_vec3_make(0.0, 0.0, 0.0);
        sound.hold_count = 0;
        sound.bodies = o.bodies ? o.bodies : description->bodies;
        kt_error found = {.code = KT_OK};
        status = kt_model_try(&sound, pass_fault, &o, &found);
        if (status == KT_ERROR_MODEL)
            found = o.first;
        status = status == KT_ERROR_MODEL ? found.code : status;
        if (status != KT_OK && error)
            *error = found;
    } else if (status == KT_ERROR_MODEL) {
        status = KT_OK; /* the mechanism as a whole cannot be checked */
    }
    free(o.bodies);
    return status;
}
