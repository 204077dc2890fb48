/* The ends of loops and effects: their bodies, links and frames. The pose of an end in its link is
 *
 *     X_link = X_body X_marker X_end     at a marker, whose origin is the end's point: X_end is a rotation
 *     X_link = X_body X_end              else
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"

kt_status kt_attach_place_end(const kt_model *m, const kt_end *end, int32_t *body, int32_t *link, kt_pose *frame,
                              kt_error *error) {
    *body = kt_attach_body_named(m, end->body);
    const kt_body_record *b = &m->body[*body];
    kt_pose own = {.position = end->marker ? (kt_vec3){0.0, 0.0, 0.0} : end->at};
    const kt_status status = kt_rotation_evaluate(&end->rotation, &own.rotation, error);
    *link = b->link;
    if (status != KT_OK)
        return status;
    if (end->marker)
        own = kt_pose_compose(m->marker[b->marker + kt_marker_find(m, *body, end->marker)].frame, own);
    *frame = kt_pose_compose(b->in_link, own);
    return KT_OK;
}
