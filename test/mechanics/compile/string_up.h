/* Mechanisms that a test strings up body by body. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_MODEL_STRING_UP_H
#define KT_TEST_MODEL_STRING_UP_H

#include "mechanics/dynamics/tree.h"

/* Starts a mechanism, or goes on with it: a massless body on the one before. */
static inline kt_body *add(kt_tree *tree, const char *name, kt_joint_type type, kt_vec3 axis) {
    if (tree->description.bodies == NULL) {
        tree->description = kt_description_default();
        tree->description.bodies = tree->body;
    }
    const int i = tree->description.body_count++;
    kt_body *body = &tree->body[i];
    *body = kt_body_of(name, i ? tree->body[i - 1].name : NULL, type, 0.0);
    body->joint.axis = axis;
    return body;
}

/* Its inertia about its centre of mass is the same about every axis. */
static inline void load(kt_body *body, double mass, kt_vec3 com, double moment) {
    body->mass = mass;
    body->com = com;
    body->inertia = kt_sym3_make(moment, moment, moment, 0.0, 0.0, 0.0);
}

#endif
