/* Contacts and joint limits that act in a state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_PENETRATION_H
#define KT_COMMAND_ADVICE_PENETRATION_H

#include "advice/warnings.h"

/* A contact or a joint limit, and the depth by which its body or joint is beyond the plane or the limit. */
typedef struct kt_penetration {
    const kt_effect *effect;
    double depth; /* m or rad; <= 0: it does not act */
    double force; /* elastic force, N or N m; its potential energy below, J */
    double energy;
    kt_vec3 normal; /* contact: unit normal, out of the half-space, world frame */
    int body;       /* joint_limit: on which it acts */
    bool is_length; /* joint_limit: its coordinate is a length */
    bool is_below;  /* joint_limit: beyond `lower` */
} kt_penetration;

/* Returns whether an effect is a contact or a joint limit. */
bool kt_effect_can_penetrate(const kt_effect *effect);

/* Evaluates effect `index`, a contact or joint limit, at q, for which data must contain the kinematics. For any other
 * effect the depth is 0. */
kt_penetration kt_penetration_of(const kt_model *model, const kt_data *data, const kt_description *d, int index,
                                 const double *q);

/* "contact 'floor' of 'ball'" */
typedef struct kt_penetration_name {
    char text[200];
} kt_penetration_name;

kt_penetration_name kt_name_penetration(const kt_effect *effect);

/* Warns of contacts and limits whose force at the start q exceeds twice the weight of all bodies. For revolute joints,
 * the moment is compared with twice the moment of the weights. Such forces do not occur in a scene at rest. The forces
 * of all contacts are added. Also warns of springs with a length, and of attractions, whose ends coincide, and of
 * wheels that lie flat in the initial values. Returns the number of warnings. */
int kt_penetration_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model, const double *q);

#endif
