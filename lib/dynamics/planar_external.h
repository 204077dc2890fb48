/* An external wrench on a body as planar kernels read it: components out of the plane move nothing. */
#ifndef KT_DYNAMICS_PLANAR_EXTERNAL_H
#define KT_DYNAMICS_PLANAR_EXTERNAL_H

#include "dynamics/aba_planar.h"

typedef struct kt_planar_external_wrench {
    size_t link;    /* planar index */
    kt_v2 x, force; /* the body's origin relative to that of its link */
    double moment;  /* about n through the body's origin */
} kt_planar_external_wrench;

/* The wrench on a body that is on a link other than the ground. */
KT_INLINE kt_planar_external_wrench kt_planar_external_of(const kt_model *model, const kt_planar_motion *motion,
                                                          const kt_body_record *body, const kt_wrench *external) {
    const size_t k = (size_t)body->link - model->n.spatial + 1;
    const kt_planar_rest *rest = &model->planar_rest[k];
    const kt_mat3 *basis = &model->plane[rest->plane].basis;
    const kt_v4 arm = kt_v4_apply(rest->axes, kt_v4_from(body->in_link.position));
    return (kt_planar_external_wrench){
        .link = k,
        .x = kt_planar_sum(kt_v2_load(motion[k].rotation), arm[0], arm[1]),
        .force = {kt_vec3_dot(basis->x, external->force), kt_vec3_dot(basis->y, external->force)},
        .moment = kt_vec3_dot(basis->z, external->moment)};
}

#endif
