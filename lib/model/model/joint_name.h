/* Joints have the names of their bodies, or names of their own. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_JOINT_NAME_H
#define KT_MODEL_JOINT_NAME_H

#include "kinetree/description.h"

/* The scope of joints with names of their own, in tables of names. */
enum { KT_NAMES_OF_JOINTS = -4 };

/* The name of the joint of a body: the name of the joint if given, else the name of the body. */
static inline const char *kt_joint_name_of(const kt_body *body) {
    return body->joint.name ? body->joint.name : body->name;
}

#endif
