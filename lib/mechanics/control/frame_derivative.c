/* Derivatives of Jacobians of frames, by time and by positions. Let S_k = (s, l) be a degree of freedom of a link,
 * about the link's origin o, and p the point. J's column in world axes at the point is (s, j), j = l + s x (p - o).
 *
 * In time, an axis moves along with its carrier. The axes of rotations are fixed in the link itself, and those of
 * translations in the frame that carries the link. With (w, c) the carrier's motion, c at o, and u the velocity of the
 * point,
 *     ds/dt = w x s,   dj/dt = w x l + c x s + (w x s) x (p - o) + s x u
 * With position q_k, everything that the degree of freedom carries turns with it. Its own carrier, (w_p, c), does not:
 *     d(omega)/dq_k = s x omega + w_p x s,   d(u)/dq_k = s x u + w_p x l + c x s + (w_p x s) x (p - o)
 * (dynamics/dof.h: psi'). In other frames, with R the axes of the body,
 *     d(R' y) = R' (dy - dr x y),   d(u + p x omega) = du + dp x omega + p x d(omega)
 * dr and dp are the rotation of the body and the displacement of the point: omega and u by time, s and j by q_k.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/control.h"
#include "dynamics/joint_motion.h"

#include <string.h>

/* A point of a body, its motion, and how the result is expressed. */
typedef struct point {
    kt_twist_frame frame;
    bool by_position; /* derivatives of the point's twist by q_k; otherwise of J's columns by time */
    kt_mat3 axes;
    kt_v4 position, omega, velocity;
} point;

/* A link on the path, and the begin of its columns. */
typedef struct columns {
    const point *p;
    double *first;
    kt_v4 carrying, own, origin; /* angular velocities of the link's carrier and of the link; velocity of its origin */
    kt_v4 arm;                   /* from its origin to the point */
} columns;

static void store_triple(double *to, kt_v4 x) {
    for (int k = 0; k < 3; k++)
        to[k] = x[k];
}

static kt_v4 into_body(const point *p, kt_v4 x) { return kt_v4_from(kt_mat3_apply_transposed(p->axes, kt_v4_vec3(x))); }

/* The column of one degree of freedom (s, l). By time y = (s, j) changes, and by position y = (omega, u). Then y is
 * expressed in the frame that was requested (last formulas above). */
static void write_frame_column(const kt_dof *dof, void *context) {
    const columns *c = context;
    const point *p = c->p;
    const kt_v4 s = kt_dof_angular(dof), l = kt_dof_linear(dof), j = l + kt_v4_cross(s, c->arm);
    const kt_v4 w = p->by_position || dof->kind == KT_DOF_TRANSLATION ? c->carrying : c->own;
    const kt_v4 turned = kt_v4_cross(w, s);
    kt_v4 angular = turned, linear = kt_v4_cross(w, l) + kt_v4_cross(c->origin, s) + kt_v4_cross(turned, c->arm) +
                                     kt_v4_cross(s, p->velocity);
    if (p->by_position)
        angular += kt_v4_cross(s, p->omega);
    const kt_v4 y[2] = {p->by_position ? p->omega : s, p->by_position ? p->velocity : j};
    const kt_v4 rotation = p->by_position ? s : p->omega, displacement = p->by_position ? j : p->velocity;
    if (p->frame == KT_TWIST_BODY) {
        angular = into_body(p, angular - kt_v4_cross(rotation, y[0]));
        linear = into_body(p, linear - kt_v4_cross(rotation, y[1]));
    } else if (p->frame == KT_TWIST_WORLD) {
        linear += kt_v4_cross(displacement, y[0]) + kt_v4_cross(p->position, angular);
    }
    store_triple(c->first + 6 * dof->index, angular);
    store_triple(c->first + 6 * dof->index + 3, linear);
}

/* Writes dJ/dt, or the derivatives of the twist by positions, of the point `at` of a body: 6 x nv, zero in the columns
 * of joints that do not carry the body. Leaves `out` unchanged if an argument is invalid. */
static void write_frame_derivatives(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                    kt_twist_frame frame, bool by_position, double *out) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body) || !kt_is_twist_frame(frame) || !out)
        return;
    const kt_body_record *b = &model->body[body];
    const kt_link_kinematics *links = data->kinematics;
    const point p = {.frame = frame,
                     .by_position = by_position,
                     .axes = kt_body_pose(model, data, body).rotation,
                     .position = kt_v4_from(kt_point_position(model, data, body, at)),
                     .omega = kt_v4_from(links[b->link].omega),
                     .velocity = kt_v4_from(kt_point_velocity(model, data, body, at))};
    columns c = {.p = &p, .arm = kt_v4_from(kt_mat3_apply(links[b->link].axes, kt_pose_apply(b->in_link, at)))};
    memset(out, 0, 6 * model->n.v * sizeof *out);
    for (int32_t i = b->link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        c.first = out + 6 * (size_t)link->v;
        c.carrying = kt_v4_from(links[link->parent].omega);
        c.own = kt_v4_from(links[i].omega);
        c.origin = kt_v4_from(links[i].velocity);
        kt_link_dofs_visit(model, links, (size_t)i, write_frame_column, &c);
        c.arm += kt_v4_from(links[i].offset);
    }
}

void kt_frame_jacobian_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                  kt_twist_frame frame, double *derivative) {
    write_frame_derivatives(model, data, body, at, frame, false, derivative);
}

void kt_frame_twist_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame,
                               double *derivative) {
    write_frame_derivatives(model, data, body, at, frame, true, derivative);
}
