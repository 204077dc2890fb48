/* Forward dynamics: the articulated-body algorithm (Featherstone 1983; 2008, 7.3), in world axes about each link's own
 * origin, on classical accelerations.
 *
 * The wrench that a link with all it carries requires of its joint is, with G = H' and a the acceleration of the
 * origin,
 *   (n, f) = [J H; G M] (alpha, a) + (n_b, f_b)
 * 1. Forward pass: positions, velocities and c = (c_n, c_f) (sweep.h).
 * 2. Backward pass: articulated inertias from the tips to the ground. For one degree of freedom along S = (s_n, s_f):
 *      U = [J H; G M] S,   d = 1 / S.U,   y = (tau - S.(n_b, f_b) - U.c) d
 *      (n_b, f_b) += [J H; G M] c + U y                          with the inertia before the next line
 *      [J H; G M] -= U U' d
 *    then the shift by r to the parent, a = a_p + alpha_p x r, n_p = n + r x f, hence, with [r] u = r x u,
 *      J -= H [r],   G -= M [r],   then   J += [r] G,   H += [r] M
 *    A spherical joint transmits the applied moment tau alone: alpha = J^-1 (tau - n_b - H a). A free joint passes on
 *    nothing but the wrench tau.
 * 3. Forward pass: accelerations, of a joint y - d U . (the parent's A, shifted).
 */
#include "dynamics/articulated.h"
#include "dynamics/dynamics.h"

#include <string.h>

static inline size_t backward_pass(const kt_model *model, kt_data *data, const double *tau) {
    kt_articulated x, carried;
    memset(&carried, 0, sizeof carried);
    for (size_t i = model->n.spatial - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        kt_articulated_rigid(link, &data->motion[i], &x);
        if (link->leads)
            kt_articulated_add(&x, &carried);
        if (link->branches)
            kt_articulated_add(&x, &data->articulated[i]);
        if (!kt_articulated_project(model, data, i, tau, &x))
            return i;
        if (link->parent == 0)
            continue;
        kt_articulated_shift(&x, data->motion[i].offset);
        if (link->follows)
            carried = x;
        else
            kt_articulated_add(&data->articulated[link->parent], &x);
    }
    return 0;
}

size_t KT_KERNEL(kt_forward)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                             const kt_wrench *external, double *a) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_link_motion *motion = data->motion;
    kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(model->gravity, &motion[0]);
    for (size_t i = 1; i < model->n.spatial; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        kt_link_pose(link, parent, q, data->cosine, data->sine, &motion[i]);
        kt_link_velocity(link, parent, v, &motion[i]);
        motion[i].moment = motion[i].force = none;
        if (link->branches)
            memset(&data->articulated[i], 0, sizeof data->articulated[i]);
    }
    if (external)
        kt_external_subtract(model, motion, external);
    const size_t failed = backward_pass(model, data, tau);
    for (size_t i = 1; i < model->n.spatial && !failed; i++)
        kt_link_respond(model, data, i, a);
    return failed;
}
