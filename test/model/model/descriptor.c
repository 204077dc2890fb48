/* Descriptors: every type has one, and its contents agree with the other definitions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/descriptor.h"

#include <stddef.h>

#include "check.h"
#include "model/describe.h"
#include "model/model.h"

typedef const kt_descriptor *describe(int type);

static const kt_descriptor *joint(int type) { return kt_joint_descriptor((kt_joint_type)type); }
static const kt_descriptor *loop(int type) { return kt_loop_descriptor((kt_loop_type)type); }
static const kt_descriptor *effect(int type) { return kt_effect_descriptor((kt_effect_type)type); }
static const kt_descriptor *shape(int type) { return kt_shape_descriptor((kt_shape_type)type); }
static const kt_descriptor *function(int type) { return kt_function_descriptor((kt_function_type)type); }

static const char *joint_name(int type) { return kt_joint_type_name((kt_joint_type)type); }
static const char *loop_name(int type) { return kt_loop_type_name((kt_loop_type)type); }
static const char *effect_name(int type) { return kt_effect_type_name((kt_effect_type)type); }
static const char *shape_name(int type) { return kt_shape_type_name((kt_shape_type)type); }

static const struct family {
    describe *describe;
    const char *(*name)(int type); /* NULL: functions have none */
    int first, count;
    size_t size; /* of the struct that its keys describe */
} families[] = {
    {joint, joint_name, 0, KT_JOINT_TYPE_COUNT, sizeof(kt_joint)},
    {loop, loop_name, 0, KT_LOOP_TYPE_COUNT, sizeof(kt_loop)},
    {effect, effect_name, 0, KT_EFFECT_TYPE_COUNT, sizeof(kt_effect)},
    {shape, shape_name, KT_SHAPE_NONE + 1, KT_SHAPE_TYPE_COUNT, sizeof(kt_shape)},
    {function, NULL, KT_FUNCTION_NONE + 1, KT_FUNCTION_EXPRESSION + 1, sizeof(kt_function)},
};

static bool has_text(const char *text) { return text != NULL && *text != '\0'; }

KT_TEST(every_type_has_a_descriptor_with_words) {
    for (size_t f = 0; f < sizeof families / sizeof *families; f++) {
        for (int type = families[f].first; type < families[f].count; type++) {
            const kt_descriptor *d = families[f].describe(type);
            if (!kt_check_true("a descriptor", d != NULL))
                continue;
            if (families[f].name != NULL)
                kt_check_text("name", d->name, families[f].name(type));
            kt_check_true(d->name, has_text(d->help) && has_text(d->formula) && has_text(d->example));
        }
        kt_check_true("none below", families[f].describe(families[f].first - 1) == NULL);
        kt_check_true("none above", families[f].describe(families[f].count) == NULL);
    }
    kt_check_true("a caller's own has none", kt_effect_descriptor(KT_EFFECT_CUSTOM) == NULL);
}

/* A key has a name of its own, words, a member within its struct, and a default in words where its kind has no
 * other. */
KT_TEST(keys_are_whole) {
    for (size_t f = 0; f < sizeof families / sizeof *families; f++)
        for (int type = families[f].first; type < families[f].count; type++) {
            const kt_descriptor *d = families[f].describe(type);
            for (int i = 0; i < d->key_count; i++) {
                const kt_key *key = &d->keys[i];
                kt_check_true(key->name, has_text(key->help) && key->unit != NULL && key->offset < families[f].size &&
                                             key->kind < KT_KEY_KIND_COUNT);
                kt_check_true("  is found", kt_descriptor_key(d, key->name) == key);
                kt_check_true("  by its kind", kt_descriptor_kind(d, key->kind)->kind == key->kind);
                const bool needs_words =
                    !key->needed && (key->kind == KT_KEY_DISTANCE || key->kind == KT_KEY_FUNCTION ||
                                     key->kind == KT_KEY_SIX || key->kind == KT_KEY_FRAME);
                kt_check_true("  has a default in words", !needs_words || has_text(key->standard));
            }
        }
    kt_check_true("no such key", kt_descriptor_key(kt_loop_descriptor(KT_LOOP_WELD), "axis") == NULL);
    kt_check_true("no such kind", kt_descriptor_kind(kt_loop_descriptor(KT_LOOP_WELD), KT_KEY_AXIS) == NULL);
    kt_check_true("of no descriptor", kt_descriptor_key(NULL, "axis") == NULL);
}

/* A number that is missing in KT_EFFECT_NUMBERS would be read, checked, and 0 in every evaluation. Those of hard stops
 * and contacts are in their loops (compile/one_sided.c). */
KT_TEST(numbers_of_effects_are_in_the_model_s_record) {
#define OFFSET(member) offsetof(kt_effect, member),
    static const size_t kept[] = {KT_EFFECT_NUMBERS(OFFSET)};
    for (int type = 0; type < KT_EFFECT_TYPE_COUNT; type++) {
        const kt_descriptor *d = effect(type);
        for (int i = 0; i < d->key_count; i++) {
            bool found = false;
            for (size_t k = 0; k < sizeof kept / sizeof *kept; k++)
                found = found || kept[k] == d->keys[i].offset;
            found = found || d->keys[i].offset == offsetof(kt_effect, restitution) ||
                    d->keys[i].offset == offsetof(kt_effect, rest_velocity);
            if (d->keys[i].kind == KT_KEY_NUMBER || d->keys[i].kind == KT_KEY_DISTANCE)
                kt_check_true(d->keys[i].name, found);
        }
    }
}

/* There are as many velocity coordinates as in KT_JOINT_LIST, and a quaternion if there is one position more. */
KT_TEST(coordinates_of_joints_are_those_of_the_list) {
    for (int type = 0; type < KT_JOINT_TYPE_COUNT; type++) {
        const kt_joint_size size = kt_joint_sizes[type];
        int known = 0, rotations = 0;
        for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
            const kt_coordinate_kind kind = kt_joint_coordinate_kind((kt_joint_type)type, k);
            known += kind != KT_COORDINATE_NONE;
            rotations += kind == KT_COORDINATE_ROTATION;
        }
        kt_check_equal_int(joint_name(type), known, size.nq);
        kt_check_equal_int("  numbers of its quaternion", rotations, size.nq > size.nv ? 4 : 0);
    }
    kt_check_equal_int("before the first", kt_joint_coordinate_kind(KT_JOINT_FREE, -1), KT_COORDINATE_NONE);
    kt_check_equal_int("of no type", kt_joint_coordinate_kind(KT_JOINT_TYPE_COUNT, 0), KT_COORDINATE_NONE);
}
