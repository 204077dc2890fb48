/* Parts of a mechanism in one line each: those of the library's defaults, with the members that nearly all of them
 * set. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_DESCRIBE_H
#define KT_TEST_DESCRIBE_H

#include "kinetree/description.h"

#include <stddef.h>

static inline kt_body kt_body_of(const char *name, const char *parent, kt_joint_type type, double mass) {
    kt_body body = kt_body_default();
    body.name = name;
    body.parent = parent;
    body.joint.type = type;
    body.mass = mass;
    return body;
}

static inline kt_loop kt_loop_of(const char *name, kt_loop_type type) {
    kt_loop loop = kt_loop_default();
    loop.name = name;
    loop.type = type;
    return loop;
}

/* joint may be NULL: of effects between ends. */
static inline kt_effect kt_effect_of(kt_effect_type type, const char *joint) {
    kt_effect effect = kt_effect_default();
    effect.type = type;
    effect.joint = joint;
    return effect;
}

/* Sets the lists of a description, each with its length. They stay the caller's. */
static inline void kt_describe(kt_description *description, const kt_body *bodies, int body_count, const kt_loop *loops,
                               int loop_count, const kt_effect *effects, int effect_count) {
    description->bodies = bodies;
    description->body_count = body_count;
    description->loops = loops;
    description->loop_count = loop_count;
    description->effects = effects;
    description->effect_count = effect_count;
}

static inline kt_description kt_description_of(const kt_body *bodies, int body_count, const kt_loop *loops,
                                               int loop_count, const kt_effect *effects, int effect_count) {
    kt_description description = kt_description_default();
    kt_describe(&description, bodies, body_count, loops, loop_count, effects, effect_count);
    return description;
}

#endif
