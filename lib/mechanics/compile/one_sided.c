/* Hard stops and contacts (a restitution in place of a stiffness) as loops that bound one side (kt_loop.side):
 *
 *     joint_limit    q - lower >= 0, q - upper <= 0            couplings of one joint
 *     contact        n . (c - p - r n) >= 0                    inplane, its plane moved by the sphere's radius r
 *                    |c - p| - r - r2 >= 0                     distance of two spheres
 *                    n . (c - p) - r |n x a| >= 0              of a disc with the axle a: the third row of rolling
 *
 *     joint_friction q' = 0, that sticks                       rates of one joint
 *     contact        s = 0, whose friction sticks              rolling of a ball, or of a disc without its contact row
 *
 * Such a loop is switched: a model contains the loop while the loop is closed (sticks). The effect itself is off in all
 * models, and keeps its index. If the loop or its effect is switched off, the loop is released at first. Friction of a
 * joint is released with both of its switches (compile/variants.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/one_sided.h"

#include "base/copy.h"
#include "base/sum.h"
#include "effect/effect.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_SIZE = 200 };

/* The allocated arrays, in one block. */
typedef struct hard_parts {
    kt_loop *loop;
    kt_effect *effect;
    kt_term *term;
    kt_hard_loop *hard;
    int *slot;    /* loops by the hashes of their names, from 1; 0: free */
    size_t slots; /* a power of two */
    char (*name)[NAME_SIZE];
    int loops, made; /* in all; of these, those of effects */
} hard_parts;

/* The slot of a name, or the empty slot for the name. */
static size_t slot_of_name(const hard_parts *p, const char *name) {
    const uint64_t hash = kt_sum_add_text(KT_SUM_START, name);
    size_t slot = (size_t)(hash ^ hash >> 32) & (p->slots - 1);
    while (p->slot[slot] > 0 && strcmp(p->loop[p->slot[slot] - 1].name, name) != 0)
        slot = (slot + 1) & (p->slots - 1);
    return slot;
}

static bool is_taken(const hard_parts *p, const char *name) { return p->slot[slot_of_name(p, name)] > 0; }

/* The next loop, with a name that is still free. */
static kt_loop *add_hard_loop(hard_parts *p, const kt_effect *effect, const char *of, const char *suffix) {
    char *name = p->name[p->made];
    (void)snprintf(name, NAME_SIZE, "%.150s%s", effect->name != NULL ? effect->name : of, suffix);
    for (int k = 2; is_taken(p, name); k++)
        (void)snprintf(name, NAME_SIZE, "%.150s%s_%d", effect->name != NULL ? effect->name : of, suffix, k);
    kt_loop *loop = &p->loop[p->loops++];
    *loop = kt_loop_default();
    loop->name = name;
    p->slot[slot_of_name(p, name)] = p->loops;
    loop->restitution = effect->restitution;
    loop->rest_velocity = effect->rest_velocity;
    loop->poisson = effect->poisson;
    loop->switching = effect->switching;
    p->hard[p->loops - 1] = (kt_hard_loop){.effect = -1};
    p->made++;
    return loop;
}

/* Adds the loop of a stop at q = `at`. An infinite limit is no stop. */
static void add_stop_loop(hard_parts *p, const kt_effect *effect, double at, kt_side side) {
    if (!isfinite(at))
        return;
    kt_term *term = &p->term[p->made];
    kt_loop *loop = add_hard_loop(p, effect, effect->joint, side == KT_SIDE_ABOVE ? ".lower" : ".upper");
    *term = (kt_term){.joint = effect->joint, .coefficient = 1.0};
    loop->type = KT_LOOP_COUPLING;
    loop->terms = term;
    loop->term_count = 1;
    loop->offset = at;
    loop->side = side;
}

/* The loop of friction that sticks: no rate. */
static void add_stick(hard_parts *p, const kt_effect *effect, int index) {
    kt_term *term = &p->term[p->made];
    kt_loop *loop = add_hard_loop(p, effect, effect->joint, ".stick");
    *term = (kt_term){.joint = effect->joint, .coefficient = 1.0};
    loop->type = KT_LOOP_RATES;
    loop->terms = term;
    loop->term_count = 1;
    loop->switching = effect->switching == KT_SWITCHED_OFF ? KT_SWITCHED_ON : KT_SWITCHED_OFF;
    loop->restitution = 0.0;
    p->hard[p->loops - 1].effect = index;
}

/* The point of an end, in its body's frame. */
static kt_vec3 point_of(const kt_description *d, const kt_end *end) {
    for (int i = 0; end->marker != NULL && i < d->body_count; i++)
        for (int k = 0; strcmp(d->bodies[i].name, end->body) == 0 && k < d->bodies[i].marker_count; k++)
            if (strcmp(d->bodies[i].markers[k].name, end->marker) == 0)
                return d->bodies[i].markers[k].at;
    return end->at;
}

/* Adds a rolling loop of a contact, of a ball or of a disc. The loop's type recognises a ball by a surface; a disc has
 * none. */
static kt_loop *add_rolling(hard_parts *p, const kt_effect *effect, const char *of, const char *suffix) {
    kt_loop *loop = add_hard_loop(p, effect, of, suffix);
    loop->type = KT_LOOP_ROLLING;
    loop->between[0] = effect->between[0];
    loop->between[1] = effect->between[1];
    loop->axis2 = effect->axis;
    loop->radius = effect->radius;
    if (kt_effect_has_axle(effect))
        loop->axis = effect->axle;
    else
        loop->surface.type = KT_SURFACE_SPHERE;
    loop->surface.tube = effect->radius2;
    return loop;
}

/* Adds the loop of a contact whose friction sticks: its point on the sphere has no velocity against the plane. */
static void add_contact_stick(hard_parts *p, const kt_effect *effect, const char *of, int index) {
    kt_loop *loop = add_rolling(p, effect, of, ".stick");
    loop->holonomic = false;
    loop->switching = KT_SWITCHED_OFF;
    loop->restitution = 0.0;
    p->hard[p->loops - 1] = (kt_hard_loop){.effect = index, .released = true};
}

/* The plane of a sphere, moved by its radius, in which its centre stays. */
static kt_status add_plane(hard_parts *p, const kt_description *d, const kt_effect *effect, const char *of,
                           kt_loop **added, kt_error *error) {
    const kt_end *plane = &effect->between[1];
    kt_mat3 axes;
    const kt_status status = kt_rotation_evaluate(&plane->rotation, &axes, error);
    kt_loop *loop = *added = add_hard_loop(p, effect, of, "");
    const double norm = kt_vec3_norm(effect->axis), up = norm > 0.0 ? effect->radius / norm : 0.0;
    loop->type = KT_LOOP_INPLANE;
    loop->between[0] = *plane;
    loop->between[0].marker = NULL;
    loop->between[0].at = kt_vec3_add(point_of(d, plane), kt_vec3_scale(up, kt_mat3_apply(axes, effect->axis)));
    loop->between[1] = effect->between[0];
    loop->axis = effect->axis;
    return status;
}

/* The distance of the centres of two spheres. */
static void add_hard_distance(hard_parts *p, const kt_effect *effect, const char *of, kt_loop **added) {
    kt_loop *loop = *added = add_hard_loop(p, effect, of, "");
    loop->type = KT_LOOP_DISTANCE;
    loop->between[0] = effect->between[1];
    loop->between[1] = effect->between[0];
    loop->function = kt_function_constant(effect->radius + effect->radius2);
}

/* Adds the loop of the gap of a contact and, with friction, a second loop, in which the contact sticks. If the effect
 * has no name, its loops are named after the end at the centre. */
static kt_status add_hard_contact(hard_parts *p, const kt_description *d, int index, kt_error *error) {
    const kt_effect *effect = &d->effects[index];
    const kt_end *centre = &effect->between[0];
    char of[NAME_SIZE];
    kt_loop *loop = NULL;
    kt_status status = KT_OK;
    (void)snprintf(of, sizeof of, "%.90s%s%.90s", centre->body != NULL ? centre->body : "world",
                   centre->marker != NULL ? "." : "", centre->marker != NULL ? centre->marker : "");
    if (kt_effect_has_axle(effect))
        loop = add_rolling(p, effect, of, "");
    else if (effect->radius2 > 0.0)
        add_hard_distance(p, effect, of, &loop);
    else
        status = add_plane(p, d, effect, of, &loop, error);
    loop->side = KT_SIDE_ABOVE;
    if (effect->friction > 0.0) {
        p->hard[p->loops - 1].effect = index;
        add_contact_stick(p, effect, loop->name, index);
    }
    return status;
}

/* Allocates the arrays, with the loops and effects of the description. */
static kt_status allocate_parts(const kt_description *d, hard_parts *p, void **memory, kt_error *error) {
    const size_t loops = (size_t)d->loop_count, effects = (size_t)d->effect_count;
    const size_t most = loops + 2 * effects + 1;
    *p = (hard_parts){.loops = d->loop_count, .slots = 2};
    while (p->slots < 2 * most)
        p->slots *= 2;
    *memory = malloc(most * (sizeof *p->loop + sizeof *p->term + sizeof *p->hard + sizeof *p->name) +
                     (effects + 1) * sizeof *p->effect + p->slots * sizeof *p->slot);
    if (*memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
    p->loop = *memory;
    p->effect = (kt_effect *)(void *)(p->loop + most);
    p->term = (kt_term *)(void *)(p->effect + effects + 1);
    p->hard = (kt_hard_loop *)(void *)(p->term + most);
    p->slot = (int *)(void *)(p->hard + most);
    p->name = (char(*)[NAME_SIZE])(void *)(p->slot + p->slots);
    kt_copy(p->loop, d->loops, loops * sizeof *p->loop);
    kt_copy(p->effect, d->effects, effects * sizeof *p->effect);
    memset(p->slot, 0, p->slots * sizeof *p->slot);
    for (int i = 0; i < d->loop_count; i++)
        p->hard[i] = (kt_hard_loop){.effect = -1};
    for (int i = 0; i < d->loop_count; i++)
        if (p->loop[i].name != NULL)
            p->slot[slot_of_name(p, p->loop[i].name)] = i + 1;
    return KT_OK;
}

kt_status kt_contacts_expand(const kt_description *d, kt_expansion *to, kt_error *error) {
    const size_t loops = (size_t)d->loop_count, effects = (size_t)d->effect_count;
    hard_parts p;
    kt_status status = allocate_parts(d, &p, &to->memory, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < loops; i++)
        if (kt_loop_bounds(&p.loop[i]))
            p.loop[i].side = kt_loop_is_rope(&p.loop[i]) ? KT_SIDE_BELOW : p.loop[i].side;
    for (size_t i = 0; status == KT_OK && i < effects; i++) {
        kt_effect *effect = &p.effect[i];
        if (kt_effect_sticks(effect))
            add_stick(&p, effect, (int)i);
        if (!kt_effect_is_hard(effect))
            continue;
        if (effect->type == KT_EFFECT_CONTACT)
            status = add_hard_contact(&p, d, (int)i, error);
        else
            add_stop_loop(&p, effect, effect->lower, KT_SIDE_ABOVE);
        if (effect->type == KT_EFFECT_JOINT_LIMIT)
            add_stop_loop(&p, effect, effect->upper, KT_SIDE_BELOW);
        effect->switching = KT_SWITCHED_OFF;
    }
    for (int i = 0; i < p.loops; i++)
        if (p.loop[i].side != KT_SIDE_NONE) {
            p.hard[i].released = p.loop[i].switching == KT_SWITCHED_OFF;
            p.loop[i].switching = KT_SWITCHED_OFF;
        }
    to->hard = p.hard;
    to->description = *d;
    to->description.loops = p.loop;
    to->description.loop_count = p.loops;
    to->description.effects = p.effect;
    return status;
}
