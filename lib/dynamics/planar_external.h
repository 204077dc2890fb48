/* An external wrench on a body as planar kernels read it: components out of the plane move nothing. */
#ifndef KT_DYNAMICS_PLANAR_EXTERNAL_H
#define KT_DYNAMICS_PLANAR_EXTERNAL_H

#include "dynamics/aba_planar.h"

typedef struct kt_planar_external_wrench {
    size_t link;       /* planar index */
    kt_real2 x, force; /* the body's origin relative to that of its link */
    kt_real1 moment;   /* about n through the body's origin */
} kt_planar_external_wrench;

/* The wrench on a body that is on a link other than the ground. */
KT_INLINE kt_planar_external_wrench kt_planar_external_of(const kt_model *model, const kt_planar_motion *motion,
                                                          const kt_body_record *body, const kt_external *external) {
    const size_t k = (size_t)body->link - model->n.spatial + 1;
    const kt_planar_rest *rest = &model->planar_rest[k];
    const kt_const_mat3 *basis = &model->plane[rest->plane].basis;
    const kt_real3 axes[3] = {kt_splat3(rest->axes[0]), kt_splat3(rest->axes[1]), kt_splat3(rest->axes[2])};
    const kt_real3 arm = kt_apply3(axes, kt_const_from3(body->in_link.position));
    return (kt_planar_external_wrench){
        .link = k,
        .x = kt_planar_sum(kt_load2(motion[k].rotation), KT_PART3(arm, 0), KT_PART3(arm, 1)),
        .force = kt_make2(kt_external_along(basis->x, &external->force), kt_external_along(basis->y, &external->force)),
        .moment = kt_external_along(basis->z, &external->moment)};
}

#endif
