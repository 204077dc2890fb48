/* The ends of loops and effects: their bodies, links and frames. */
#include "compile/attach.h"

kt_status kt_attach_place_end(const kt_model *m, const kt_end *end, int32_t *body, int32_t *link, kt_pose *frame,
                              kt_error *error) {
    *body = kt_attach_body_named(m, end->body);
    const kt_body_record *b = &m->body[*body];
    const kt_pose *on[] = {&b->in_link,
                           &b->in_link}; /* the frame that carries the end, and the carrier of that frame */
    const int count = end->marker ? 2 : 1;
    *link = b->link;
    frame->position = end->at;
    if (end->marker) {
        on[0] = &m->marker[b->marker + kt_marker_find(m, *body, end->marker)].frame;
        frame->position = (kt_vec3){0.0, 0.0, 0.0};
    }
    const kt_status status = kt_rotation_evaluate(&end->rotation, &frame->rotation, error);
    for (int k = 0; k < count && status == KT_OK; k++)
        *frame = kt_pose_compose(*on[k], *frame);
    return status;
}
