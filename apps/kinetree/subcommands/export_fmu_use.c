/* Units and descriptions of the parameters of a scene, which has neither. A parameter is a number of the description if
 * the number equals it, up to its sign, for two values of the parameter. The key of this number has a name and a unit.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/export_fmu.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A search: the values of the parameter in both scenes. */
typedef struct kt_fmu_search {
    double before, after;
    const char *of; /* the body, loop or effect that is searched now */
    bool slides;    /* its joint slides: it takes the second one of two units */
    kt_fmu_use *use;
} kt_fmu_search;

void kt_fmu_copy_unit(const char *unit, bool slides, int k, char to[KT_FMU_UNIT]) {
    const char *bar = strchr(unit, '|'), *comma = strchr(unit, ',');
    const char *from = bar != NULL && slides ? bar + 1 : comma != NULL && k >= 3 ? comma + 2 : unit;
    (void)snprintf(to, KT_FMU_UNIT, "%.*s", (int)strcspn(from, "|,"), from);
}

/* Compares numbers of both scenes. The first one that is the parameter describes it. If others have another unit, the
 * parameter has none. */
static void compare_numbers_of(kt_fmu_search *s, const double *a, const double *b, int count, const char *what,
                               const char *unit) {
    for (int k = 0; k < count; k++) {
        char own[KT_FMU_UNIT];
        if (!(fabs(a[k]) == fabs(s->before) && fabs(b[k]) == fabs(s->after)))
            continue;
        kt_fmu_copy_unit(unit, s->slides, k, own);
        if (s->use->text[0] == '\0') {
            (void)snprintf(s->use->text, sizeof s->use->text, "%s of %s", what, s->of);
            (void)snprintf(s->use->unit, sizeof s->use->unit, "%s", own);
        } else if (strcmp(s->use->unit, own) != 0) {
            s->use->unit[0] = '\0';
        }
    }
}

/* The name of a key. A motor has a torque or a force. */
static const char *name_of_key(const kt_fmu_search *s, const kt_key *key) {
    return s->slides && strchr(key->unit, '|') != NULL && key->also != NULL ? key->also : key->name;
}

/* Numbers of a function of time have the unit of its key. */
static void compare_functions(kt_fmu_search *s, const kt_function *a, const kt_function *b, int count,
                              const kt_key *key) {
    const char *name = name_of_key(s, key);
    for (int k = 0; k < count; k++, a++, b++) {
        compare_numbers_of(s, &a->value, &b->value, 1, name, key->unit);
        compare_numbers_of(s, &a->amplitude, &b->amplitude, 1, name, key->unit);
        compare_numbers_of(s, &a->offset, &b->offset, 1, name, key->unit);
        compare_numbers_of(s, &a->from, &b->from, 1, name, key->unit);
        compare_numbers_of(s, &a->to, &b->to, 1, name, key->unit);
        compare_numbers_of(s, &a->frequency, &b->frequency, 1, "frequency", "Hz");
        compare_numbers_of(s, &a->phase, &b->phase, 1, "phase", "rad");
        compare_numbers_of(s, &a->start, &b->start, 1, "start", "s");
        compare_numbers_of(s, &a->end, &b->end, 1, "end", "s");
    }
}

static void compare_keys(kt_fmu_search *s, const kt_descriptor *d, const void *a, const void *b) {
    for (int i = 0; d != NULL && i < d->key_count; i++) {
        const kt_key *key = &d->keys[i];
        const void *one = (const char *)a + key->offset, *other = (const char *)b + key->offset;
        if (key->kind == KT_KEY_NUMBER || key->kind == KT_KEY_DISTANCE)
            compare_numbers_of(s, one, other, 1, key->name, key->unit);
        else if (key->kind == KT_KEY_VECTOR || key->kind == KT_KEY_POINT)
            compare_numbers_of(s, one, other, 3, key->name, key->unit);
        else if (key->kind == KT_KEY_SIX)
            compare_numbers_of(s, one, other, 6, key->name, key->unit);
        else if (key->kind == KT_KEY_FUNCTION || key->kind == KT_KEY_FUNCTIONS)
            compare_functions(s, one, other, key->kind == KT_KEY_FUNCTION ? 1 : 3, key);
    }
}

/* Begins with another owner of numbers. Loops and effects without a name have the name of their type. */
static void enter_owner(kt_fmu_search *s, const char *name, const kt_descriptor *type, bool slides) {
    s->of = name != NULL ? name : type != NULL ? type->name : "the scene";
    s->slides = slides;
}

static void compare_body(kt_fmu_search *s, const kt_body *a, const kt_body *b) {
    const bool turns = a->joint.type == KT_JOINT_REVOLUTE, slides = a->joint.type == KT_JOINT_PRISMATIC;
    enter_owner(s, a->name, NULL, slides);
    compare_numbers_of(s, &a->mass, &b->mass, 1, "mass", "kg");
    compare_numbers_of(s, &a->com.x, &b->com.x, 3, "centre of mass", "m");
    compare_numbers_of(s, &a->inertia.xx, &b->inertia.xx, 6, "inertia", "kg m^2");
    compare_numbers_of(s, a->joint.position, b->joint.position, turns || slides, "position", "rad|m");
    compare_numbers_of(s, a->joint.velocity, b->joint.velocity, turns || slides, "velocity", "rad/s|m/s");
    compare_numbers_of(s, a->joint.armature, b->joint.armature, turns || slides, "armature", "kg m^2|kg");
    compare_numbers_of(s, &a->joint.at.x, &b->joint.at.x, 3, "place", "m");
    if (a->shape.type == b->shape.type)
        compare_keys(s, kt_shape_descriptor(a->shape.type), &a->shape, &b->shape);
}

/* A loop of the type `prismatic` has a coordinate, too. */
bool kt_fmu_joint_slides(const kt_description *d, const char *joint) {
    for (int i = 0; i < d->body_count; i++) {
        const char *own = d->bodies[i].joint.name != NULL ? d->bodies[i].joint.name : d->bodies[i].name;
        if (joint != NULL && strcmp(own, joint) == 0)
            return d->bodies[i].joint.type == KT_JOINT_PRISMATIC;
    }
    for (int i = 0; i < d->loop_count; i++)
        if (joint != NULL && strcmp(d->loops[i].name, joint) == 0)
            return d->loops[i].type == KT_LOOP_PRISMATIC;
    return false;
}

void kt_fmu_find_use(const kt_scene *scene, const kt_scene *other, int parameter, kt_fmu_use *use) {
    const kt_description *a = &scene->description, *b = &other->description;
    kt_fmu_search s = {scene->parameters[parameter].value, other->parameters[parameter].value, "the scene", false, use};
    use->text[0] = use->unit[0] = '\0';
    if (s.before == s.after || a->body_count != b->body_count || a->loop_count != b->loop_count ||
        a->effect_count != b->effect_count)
        return;
    compare_numbers_of(&s, (const double[]){a->gravity.x, a->gravity.y, a->gravity.z},
                       (const double[]){b->gravity.x, b->gravity.y, b->gravity.z}, 3, "gravity", "m/s^2");
    for (int i = 0; i < a->body_count; i++)
        compare_body(&s, &a->bodies[i], &b->bodies[i]);
    for (int i = 0; i < a->loop_count; i++) {
        const kt_loop *loop = &a->loops[i];
        enter_owner(&s, loop->name, kt_loop_descriptor(loop->type), kt_fmu_joint_slides(a, loop->joint));
        compare_keys(&s, kt_loop_descriptor(loop->type), loop, &b->loops[i]);
    }
    for (int i = 0; i < a->effect_count; i++) {
        const kt_effect *effect = &a->effects[i];
        enter_owner(&s, effect->name, kt_effect_descriptor(effect->type), kt_fmu_joint_slides(a, effect->joint));
        compare_keys(&s, kt_effect_descriptor(effect->type), effect, &b->effects[i]);
    }
}
