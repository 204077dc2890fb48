/* Frames and points of bodies, from the motion of their links. A body is at rest in its link:
 *   p = p_l + R_l d,   v = v_l + w x R_l d,   a = a_l + alpha x R_l d + w x (w x R_l d). */
#include "kinetree/dynamics.h"
#include "model/internal.h"

#include <string.h>

typedef struct carried {
    kt_v4 arm;                  /* from the link's origin to the point, world axes */
    const kt_link_motion *link; /* what carries it */
    const kt_link_place *place;
} carried;

/* A point given in the body frame. */
static carried carry(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    const kt_body_record *b = &model->body[body];
    const kt_link_motion *link = &data->motion[b->link];
    const kt_v4 local = kt_v4_from(kt_pose_apply(b->in_link, at));
    return (carried){.arm = kt_v4_apply(link->axes, local), .link = link, .place = &data->place[b->link]};
}

static const kt_vec3 origin = {0.0, 0.0, 0.0};

kt_vec3 kt_point_position(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    const carried c = carry(model, data, body, at);
    return kt_v4_vec3(c.place->position + c.arm);
}

kt_vec3 kt_point_velocity(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    const carried c = carry(model, data, body, at);
    return kt_v4_vec3(c.place->velocity + kt_v4_cross(c.link->omega, c.arm));
}

kt_vec3 kt_point_acceleration(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    const carried c = carry(model, data, body, at);
    const kt_v4 w = c.link->omega;
    return kt_v4_vec3(c.link->linear + kt_v4_cross(c.link->alpha, c.arm) + kt_v4_cross(w, kt_v4_cross(w, c.arm)));
}

kt_pose kt_body_pose(const kt_model *model, const kt_data *data, int body) {
    const kt_body_record *b = &model->body[body];
    kt_pose pose;
    pose.rotation = kt_mat3_multiply(kt_v4_mat3(data->motion[b->link].axes), b->in_link.rotation);
    pose.position = kt_point_position(model, data, body, origin);
    return pose;
}

kt_twist kt_body_twist(const kt_model *model, const kt_data *data, int body) {
    kt_twist twist;
    twist.angular = kt_v4_vec3(data->motion[model->body[body].link].omega);
    twist.linear = kt_point_velocity(model, data, body, origin);
    return twist;
}

kt_twist kt_body_acceleration(const kt_model *model, const kt_data *data, int body) {
    kt_twist twist;
    twist.angular = kt_v4_vec3(data->motion[model->body[body].link].alpha);
    twist.linear = kt_point_acceleration(model, data, body, origin);
    return twist;
}

/* One column: angular velocity w of the freedom, and velocity u + w x arm of the point. */
static void write_column(double *column, kt_v4 w, kt_v4 u, kt_v4 arm) {
    const kt_v4 linear = u + kt_v4_cross(w, arm);
    for (int k = 0; k < 3; k++) {
        column[k] = w[k];
        column[3 + k] = linear[k];
    }
}

void kt_point_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, double *jacobian) {
    const kt_v4 none = kt_v4_splat(0.0);
    memset(jacobian, 0, 6 * model->n.v * sizeof *jacobian);
    kt_v4 arm = carry(model, data, body, at).arm; /* from the current link's origin to the point */
    for (int32_t i = model->body[body].link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &data->motion[i];
        double *column = jacobian + 6 * (size_t)link->v;
        switch ((kt_motion)link->motion) {
        case KT_MOTION_TURN:
            write_column(column, m->axis, none, arm);
            break;
        case KT_MOTION_SLIDE:
            write_column(column, none, m->axis, arm);
            break;
        case KT_MOTION_HELIX:
            write_column(column, m->axis, kt_v4_splat(link->pitch) * m->axis, arm);
            break;
        case KT_MOTION_FREE: {
            kt_v4 base[3];
            kt_v4_multiply(data->motion[link->parent].axes, link->turn, base);
            for (int k = 0; k < 3; k++, column += 6)
                write_column(column, none, base[k], arm);
        } /* fall through */
        case KT_MOTION_BALL:
            for (int k = 0; k < 3; k++, column += 6)
                write_column(column, m->axes[k], none, arm);
            break;
        case KT_MOTION_NONE:
            break;
        }
        arm += m->offset;
    }
}
