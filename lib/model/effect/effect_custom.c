/* A caller's own effect: its record has callbacks. Since callbacks can fail, the code that sums all effects calls them
 * (effects.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static const kt_key one_key[] = {{"at", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the end", .needed = true}};
static const kt_key two_keys[] = {KT_BETWEEN_KEY(kt_effect)};
static const kt_descriptor one_end = {.name = "custom", .keys = one_key, .key_count = 1};
static const kt_descriptor two_ends = {.name = "custom", .keys = two_keys, .key_count = 1};

static void custom_check(kt_checker *checker, const kt_effect *effect) {
    if (!effect->wrench == !effect->joint_force) {
        kt_checker_fault(checker, "wrench", -1, "%s; give one of them",
                         effect->wrench ? "both wrench and joint_force are given"
                                        : "neither wrench nor joint_force is given");
        return;
    }
    if (KT_IS_OF_VALUES &&
        (effect->wrench_derivatives ? !effect->wrench : effect->joint_force_derivatives && !effect->joint_force))
        kt_checker_fault(checker, effect->wrench ? "joint_force_derivatives" : "wrench_derivatives", -1,
                         "it belongs to %s, and %s is given; leave it out, or give %s_derivatives",
                         effect->wrench ? "joint_force" : "wrench", effect->wrench ? "wrench" : "joint_force",
                         effect->wrench ? "wrench" : "joint_force");
    if (effect->joint_force) {
        kt_checker_coordinate(checker, "joint", effect->joint);
        return;
    }
    if (effect->end_count == 1 || effect->end_count == 2)
        kt_checker_keys(checker, effect->end_count == 1 ? &one_end : &two_ends, effect, effect);
    else
        kt_checker_fault(checker, "end_count", -1, "end_count is %d; give 1 or 2", effect->end_count);
}

const kt_effect_kind KT_EFFECT(kt_effect_custom) = {.check = custom_check};
