/* What the files of the joint types share. */
#ifndef KT_JOINT_KIND_H
#define KT_JOINT_KIND_H

#include "model/internal.h"

#define KT_JOINT_EXTERN(id, name, nq, nv) extern const kt_joint_kind kt_joint_##name;
KT_JOINT_LIST(KT_JOINT_EXTERN)
#undef KT_JOINT_EXTERN

/* The unit vector along `axis`; exact along coordinate axes, whatever the length. */
kt_vec3 kt_joint_unit(kt_vec3 axis);

/* A one-axis motion about or along `axis`. The link's frame is turned so that the motion is about or along one of its
 * coordinate axes; where `axis` is x, y or z already, it is not turned at all. */
kt_element kt_element_about(kt_motion motion, kt_vec3 axis);

/* The second axis of a universal joint, given or not. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint);

#endif
