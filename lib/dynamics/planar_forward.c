/* Forward dynamics of planar trees: the articulated-body algorithm of forward.c in the plane.
 *
 * With p = r turned by a right angle,
 *   n = J alpha + h . a + n_b,   f = h alpha + M a + f_b,   a = a_p + alpha_p p + c_f
 * is what a link with all it carries asks of its joint. A turn, with y = tau - n_b (tau and the rest about n):
 *   alpha = (y - h . a) / J,   M -= h h' / J,   f_b += h y / J + M c_f,   J = 0, h = 0, n_b = tau
 * so that a turn's link passes on no more than M, f_b and tau. A slide along u, with U = M u, n_u = h . u, D = u . U:
 *   y = (tau - u . f_b - U . c_f) / D,   n_b += h . c_f + n_u y,   f_b += M c_f + U y,
 *   J -= n_u^2 / D,   h -= n_u U / D,   M -= U U' / D
 * then the shift to the parent:
 *   J += 2 p . h + p . M p,   h += M p,   n_b += p . f_b.
 */
#include "dynamics/kernel.h"
#include "dynamics/planar_articulated.h"

static inline void way_out(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q,
                           const double *v) {
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        kt_planar_motion *m = &motion[k];
        kt_planar_pose(link, &motion[link->parent], q, data->planar_cosine, data->planar_sine, m);
        kt_planar_velocity(link, &motion[link->parent], v, m);
        m->moment = m->force[0] = m->force[1] = 0.0;
        if (link->branches)
            data->planar_inertia[k] = (kt_planar_inertia){.j = 0.0};
    }
}

/* Returns the place of a link without inertia along its freedom, or 0. */
static inline int32_t way_back(const kt_model *model, kt_data *data, const kt_plane *plane, const double *tau) {
    kt_planar_inertia x, carried = {.j = 0.0};
    for (int32_t k = plane->last - 1; k >= plane->first; k--) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *m = &data->planar[k];
        kt_planar_response *response = &data->planar_response[k];
        kt_planar_rigid(link, m, &x);
        if (link->leads)
            kt_planar_add(&x, &carried);
        if (link->branches)
            kt_planar_add(&x, &data->planar_inertia[k]);
        const bool done = link->motion == KT_MOTION_TURN
                              ? kt_absorb_turn(link, m, link->sign * tau[link->v], &x, response)
                              : kt_absorb_slide(link, m, tau[link->v], &x, response);
        if (!done)
            return k;
        if (link->parent == 0)
            continue;
        kt_planar_shift(&x, m->offset);
        if (link->follows)
            carried = x;
        else
            kt_planar_add(&data->planar_inertia[link->parent], &x);
    }
    return 0;
}

size_t KT_KERNEL(kt_planar_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                    const double *tau, const kt_wrench *external, double *a) {
    kt_planar_motion *motion = data->planar;
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        way_out(model, data, &model->plane[p], q, v);
    if (external)
        kt_planar_external(model, motion, external);
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        const int32_t failed = way_back(model, data, plane, tau);
        if (failed)
            return model->n.spatial + (size_t)failed - 1;
        kt_planar_ground_set(plane->gravity, &motion[0]);
        for (int32_t k = plane->first; k < plane->last; k++) {
            const kt_planar_link *link = &model->planar[k];
            kt_planar_respond(link, &data->planar_response[k], &motion[link->parent], &motion[k], a);
        }
    }
    return 0;
}
