/* Contacts and joint limits that act in a state. */
#ifndef KT_COMMAND_TOUCH_H
#define KT_COMMAND_TOUCH_H

#include "warnings.h"

/* A contact or a joint limit, and how far its body or joint is beyond the plane or the limit. */
typedef struct kt_touch {
    const kt_effect *effect;
    double depth; /* m or rad; <= 0: it does not act */
    double force; /* elastic, N or N m; and what it stores, J */
    double energy;
    kt_vec3 normal; /* contact: out of the half-space, in the world */
    bool is_length; /* joint_limit: its joint slides */
    bool is_below;  /* joint_limit: beyond `lower` */
} kt_touch;

/* How a contact or joint limit stands at q, for which data hold the kinematics. For any other effect the depth is 0. */
kt_touch kt_touch_of(const kt_model *model, const kt_data *data, const kt_effect *effect, const double *q);

/* "contact 'floor' of 'ball'" */
typedef struct kt_touch_name {
    char text[200];
} kt_touch_name;

kt_touch_name kt_name_touch(const kt_effect *effect);

/* Warns of contacts and limits that push, at the start q, with more than twice the weight of all bodies: a scene at rest
 * does not. Contacts are judged together. Returns how many warnings there were. */
int kt_touch_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model, const double *q);

#endif
