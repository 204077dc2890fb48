/* Parameters and numbers that events set (assignment.h): their names, and the numbers of a description that can be
 * set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "model/parameter_key.h"
#include "scene/assignment.h"
#include "scene/expand.h"

#include <stdint.h>
#include <string.h>

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Whether a mapping {set: {NAME: VALUE, ...}} has this name; NULL: any. */
static bool sets(const kt_node *action, const char *name) {
    kt_node *map = kt_node_find(action, "set");
    if (map == NULL || map->kind != KT_NODE_MAP)
        return false;
    for (const kt_node *key = map->of.first; key != NULL; key = key->next->next)
        if (name == NULL || (key->kind == KT_NODE_TEXT && strcmp(key->of.text, name) == 0))
            return true;
    return false;
}

typedef struct name_sought {
    const char *name;
    bool is_found;
} name_sought;

static void seek_name(const kt_node *action, void *user) {
    name_sought *sought = user;
    sought->is_found = sought->is_found || sets(action, sought->name);
}

static bool is_set_by_event(const kt_reader *r, const char *name) {
    name_sought sought = {name, false};
    kt_actions_visit(r, seek_name, &sought);
    return sought.is_found;
}

bool kt_assignments_exist(const kt_reader *r) { return is_set_by_event(r, NULL); }
bool kt_is_assigned(const kt_reader *r, const char *name) {
    return r->scene->varying != NULL && is_set_by_event(r, name);
}

/* ---- numbers of a description ------------------------------------------------------------------------------------ */

/* The index of the number at `at` among `count` from `first` on; -1: it is none of them. */
static int index_in(const double *first, int count, const double *at) {
    for (int k = 0; k < count; k++)
        if (at == first + k)
            return k;
    return -1;
}

/* The part of a body that has the number at an address. Numbers that follow from the body's shape, or vary with time,
 * are none. */
static bool find_in_body(const kt_body *body, const double *at, kt_assignment_target *target) {
    const struct {
        kt_parameter_kind kind;
        const double *first;
        int count;
    } parts[] = {{KT_PARAMETER_MASS, &body->mass, 1},
                 {KT_PARAMETER_COM, &body->com.x, body->com_of_shape ? 0 : 3},
                 {KT_PARAMETER_INERTIA, &body->inertia.xx, body->inertia_of_shape ? 0 : 6},
                 {KT_PARAMETER_ARMATURE, body->joint.armature, (int)(sizeof body->joint.armature / sizeof(double))}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts && body->variable_mass == NULL; i++) {
        const int k = index_in(parts[i].first, parts[i].count, at);
        if (k < 0)
            continue;
        target->parameter.kind = parts[i].kind;
        target->parameter.count = parts[i].count;
        target->component = k;
        return true;
    }
    return false;
}

/* Whether a number of an effect can change in a model, as in kt_parameter_find. */
static bool can_change(const kt_effect *effect, const kt_key *key) {
    const bool is_coefficient = key->offset == offsetof(kt_effect, friction);
    if (kt_effect_is_hard(effect))
        return is_coefficient && effect->type == KT_EFFECT_CONTACT && effect->friction > 0.0;
    return effect->type != KT_EFFECT_JOINT_FRICTION || kt_effect_has_load(effect) ||
           !(is_coefficient || key->offset == offsetof(kt_effect, efficiency));
}

/* Finds the key of a loop or of an effect that has the number at an address. Of a function of time, this is its
 * `value`. On failure, *target is overwritten. */
static bool find_in_keys(const kt_descriptor *d, const void *object, bool of_loop, const double *at,
                         kt_assignment_target *target) {
    for (int i = 0; i < d->key_count; i++) {
        const void *member = (const char *)object + d->keys[i].offset;
        const kt_function *functions = member;
        if (!kt_parameter_classify(&d->keys[i], of_loop, &target->parameter))
            continue;
        if (!of_loop && !can_change(object, &d->keys[i]))
            continue;
        const int count = target->parameter.count;
        target->component = target->parameter.kind == KT_PARAMETER_EFFECT ? index_in(member, count, at) : -1;
        for (int j = 0; j < (count == 3 ? 3 : 1) && target->parameter.kind != KT_PARAMETER_EFFECT; j++)
            if (at == &functions[j].value)
                target->component = j;
        if (target->component >= 0)
            return true;
    }
    return false;
}

/* Whether `at` lies in one of the items of an array, and in which. */
static bool lies_in_items(const void *items, int count, size_t size, const double *at, int *item) {
    const uintptr_t begin = (uintptr_t)items, here = (uintptr_t)at;
    if (count == 0 || here < begin || here >= begin + (size_t)count * size)
        return false;
    *item = (int)((here - begin) / size);
    return true;
}

bool kt_assignment_target_of(const kt_description *description, const double *at, kt_assignment_target *target) {
    const kt_description *d = description;
    int *item = &target->parameter.item;
    *target = (kt_assignment_target){.parameter = {.kind = KT_PARAMETER_GRAVITY, .count = 3},
                                     .component = index_in(&d->gravity.x, 3, at)};
    if (target->component >= 0)
        return true;
    if (lies_in_items(d->bodies, d->body_count, sizeof *d->bodies, at, item))
        return find_in_body(&d->bodies[*item], at, target);
    if (lies_in_items(d->loops, d->loop_count, sizeof *d->loops, at, item)) {
        const kt_loop *loop = &d->loops[*item];
        return find_in_keys(kt_loop_descriptor(loop->type), loop, true, at, target);
    }
    if (lies_in_items(d->effects, d->effect_count, sizeof *d->effects, at, item)) {
        const kt_effect *effect = &d->effects[*item];
        return find_in_keys(kt_effect_descriptor(effect->type), effect, false, at, target);
    }
    return false;
}
