/* Frames and points of bodies, from the kinematics of their links. A body is fixed in its link:
 *   p = p_l + R_l d
 *   v = v_l + w x R_l d
 *   a = a_l + alpha x R_l d + w x (w x R_l d)
 */
#include "dynamics/dynamics.h"
#include "dynamics/motion.h"
#include "kinetree/dynamics.h"

#include <string.h>

typedef struct carried {
    kt_v4 arm;                      /* from the link's origin to the point, world axes */
    const kt_link_kinematics *link; /* the link that carries it */
} carried;

KT_INLINE kt_v4 rotate(const kt_link_kinematics *link, kt_vec3 x) {
    kt_v4 axes[3];
    kt_v4_from_mat3(link->axes, axes);
    return kt_v4_apply(axes, kt_v4_from(x));
}

/* A point given in the body frame; links: kinematics of all links. */
static carried carry(const kt_model *model, const kt_link_kinematics *links, int body, kt_vec3 at) {
    const kt_body_record *b = &model->body[body];
    const kt_link_kinematics *link = &links[b->link];
    return (carried){.arm = rotate(link, kt_pose_apply(b->in_link, at)), .link = link};
}

static const kt_vec3 origin = {0.0, 0.0, 0.0};

static kt_vec3 velocity(const carried *c) {
    return kt_v4_vec3(kt_v4_from(c->link->velocity) + kt_v4_cross(kt_v4_from(c->link->omega), c->arm));
}

kt_vec3 kt_links_acceleration(const kt_model *model, const kt_link_kinematics *links, int body, kt_vec3 at) {
    const carried c = carry(model, links, body, at);
    const kt_v4 w = kt_v4_from(c.link->omega), alpha = kt_v4_from(c.link->alpha);
    return kt_v4_vec3(kt_v4_from(c.link->linear) + kt_v4_cross(alpha, c.arm) + kt_v4_cross(w, kt_v4_cross(w, c.arm)));
}

kt_twist kt_links_twist(const kt_model *model, const kt_link_kinematics *links, int body) {
    const carried c = carry(model, links, body, origin);
    return (kt_twist){.angular = c.link->omega, .linear = velocity(&c)};
}

kt_vec3 kt_point_position(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    const carried c = carry(model, data->kinematics, body, at);
    return kt_v4_vec3(kt_v4_from(c.link->position) + c.arm);
}

kt_vec3 kt_point_velocity(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    const carried c = carry(model, data->kinematics, body, at);
    return velocity(&c);
}

kt_vec3 kt_point_acceleration(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    return kt_links_acceleration(model, data->kinematics, body, at);
}

kt_pose kt_body_pose(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_pose){{{(double)NAN, (double)NAN, (double)NAN},
                          {(double)NAN, (double)NAN, (double)NAN},
                          {(double)NAN, (double)NAN, (double)NAN}},
                         {(double)NAN, (double)NAN, (double)NAN}};
    const kt_body_record *b = &model->body[body];
    kt_pose pose;
    pose.rotation = kt_mat3_multiply(data->kinematics[b->link].axes, b->in_link.rotation);
    pose.position = kt_point_position(model, data, body, origin);
    return pose;
}

kt_twist kt_body_twist(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_twist){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    return kt_links_twist(model, data->kinematics, body);
}

kt_twist kt_body_acceleration(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_twist){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    kt_twist twist;
    twist.angular = data->kinematics[model->body[body].link].alpha;
    twist.linear = kt_point_acceleration(model, data, body, origin);
    return twist;
}

/* Where the columns of a link begin, and the arm from its origin to the point. */
typedef struct columns {
    double *first;
    kt_v4 arm;
} columns;

/* (w, u + w x arm) for the degree of freedom (w, u). */
static inline void write_column(const kt_dof *dof, void *context) {
    const columns *c = context;
    const kt_v4 w = kt_dof_angular(dof), linear = kt_dof_linear(dof) + kt_v4_cross(w, c->arm);
    double *column = c->first + 6 * dof->index;
    for (int k = 0; k < 3; k++) {
        column[k] = w[k];
        column[3 + k] = linear[k];
    }
}

void kt_point_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, double *jacobian) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body) || !jacobian)
        return;
    memset(jacobian, 0, 6 * model->n.v * sizeof *jacobian);
    columns c = {.arm = carry(model, data->kinematics, body, at).arm};
    kt_v4 axes[3], parent[3] = {{0.0}};
    for (int32_t i = model->body[body].link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        const kt_link_kinematics *m = &data->kinematics[i];
        kt_v4_from_mat3(m->axes, axes);
        if (kt_link_dofs(link) > 1) /* one degree of freedom has its axis, and does not ask for the parent's */
            kt_v4_from_mat3(data->kinematics[link->parent].axes, parent);
        c.first = jacobian + 6 * (size_t)link->v;
        kt_dofs_visit(link, parent, axes, write_column, &c);
        c.arm += kt_v4_from(m->offset);
    }
}
