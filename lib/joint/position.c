/* The joints' algebra on positions. Every position but a quaternion is a plain number; a quaternion p moves by
 *   p' = 1/2 p (0, w) [MSD A.36],   p (+) d = p exp(d / 2),   w and d in the body frame.
 * Only balls and free links have quaternions, after three plain numbers in a free link. */
#include "kinetree/joint.h"
#include "model/model.h"

#include <string.h>

/* Number of plain coordinates before the quaternion of a link, or -1 where it has none. */
static int plain_before_quaternion(const kt_link *link) {
    return link->motion == KT_MOTION_SPHERICAL ? 0 : link->motion == KT_MOTION_FREE ? 3 : -1;
}

static kt_quat load(const double *p) { return kt_quat_make(p[0], p[1], p[2], p[3]); }

static void store(double *p, kt_quat a) {
    p[0] = a.w;
    p[1] = a.x;
    p[2] = a.y;
    p[3] = a.z;
}

void kt_position_rate(const kt_model *model, const double *q, const double *v, double *qdot) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const int plain = plain_before_quaternion(link);
        for (int k = 0; k < (plain < 0 ? 1 : plain); k++)
            qdot[link->q + k] = v[link->v + k];
        if (plain < 0)
            continue;
        const double *w = v + link->v + plain;
        store(qdot + link->q + plain, kt_quat_rate_body(load(q + link->q + plain), kt_vec3_make(w[0], w[1], w[2])));
    }
}

void kt_position_add(const kt_model *model, const double *q, const double *dv, double *out) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const int plain = plain_before_quaternion(link);
        for (int k = 0; k < (plain < 0 ? 1 : plain); k++)
            out[link->q + k] = q[link->q + k] + dv[link->v + k];
        if (plain < 0)
            continue;
        const double *d = dv + link->v + plain;
        const kt_quat step = kt_quat_from_euler_vector(kt_vec3_make(d[0], d[1], d[2]));
        store(out + link->q + plain, kt_quat_normalize(kt_quat_multiply(load(q + link->q + plain), step)));
    }
}

void kt_position_subtract(const kt_model *model, const double *end, const double *q, double *dv) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const int plain = plain_before_quaternion(link);
        for (int k = 0; k < (plain < 0 ? 1 : plain); k++)
            dv[link->v + k] = end[link->q + k] - q[link->q + k];
        if (plain < 0)
            continue;
        const kt_quat from = kt_quat_conjugate(load(q + link->q + plain));
        const kt_vec3 d = kt_euler_vector_from_quat(kt_quat_multiply(from, load(end + link->q + plain)));
        dv[link->v + plain] = d.x;
        dv[link->v + plain + 1] = d.y;
        dv[link->v + plain + 2] = d.z;
    }
}

bool kt_position_normalize(const kt_model *model, double *q) {
    for (int pass = 0; pass < 2; pass++) /* look first, so that a failure touches nothing */
        for (size_t i = 1; i < model->n.link; i++) {
            const int plain = plain_before_quaternion(&model->link[i]);
            if (plain < 0)
                continue;
            double *p = q + model->link[i].q + plain;
            const kt_quat unit = kt_quat_normalize(load(p));
            if (!isfinite(unit.w + unit.x + unit.y + unit.z))
                return false;
            if (pass)
                store(p, unit);
        }
    return true;
}
