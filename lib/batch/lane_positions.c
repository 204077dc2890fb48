/* Positions of several states at once, as joint/position.c and joint/units.c have those of one: rates and norms of
 * quaternions. And gradients by them, as the transposed functions of sensitivity/tangent.c. */
#include "batch/lanes.h"

#include "algebra/real.h"
#include "joint/joint.h"

#include <float.h>

typedef struct quaternion {
    kt_real1 w, x, y, z;
} quaternion;

static quaternion load(const kt_real1 *p) { return (quaternion){p[0], p[1], p[2], p[3]}; }

static void store(kt_real1 *p, quaternion a) {
    p[0] = a.w;
    p[1] = a.x;
    p[2] = a.y;
    p[3] = a.z;
}

static kt_real1 norm_squared(quaternion p) { return p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z; }

static quaternion multiply(quaternion p, quaternion q) {
    return (quaternion){p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                        p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

/* s p (0, w), with the products by 0 that functions for one state have, too. */
static quaternion times(quaternion p, kt_real1 s, const kt_real1 *w) {
    return multiply(p, (quaternion){kt_real1_splat(0.0), s * w[0], s * w[1], s * w[2]});
}

/* p (0, w) / 2 */
static quaternion rate_of(quaternion p, const kt_real1 *omega) { return times(p, kt_real1_splat(0.5), omega); }

void KT_KERNEL(kt_rates)(const kt_model *model, const double *q, const double *v, double *out) {
    const kt_real1 *qs = (const void *)q, *vs = (const void *)v;
    kt_real1 *rates = (void *)out;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            rates[link->q + k] = vs[link->v + k];
        if (motion.quaternions)
            store(rates + link->q + motion.plain,
                  rate_of(load(qs + link->q + motion.plain), vs + link->v + motion.plain));
    }
}

/* The quaternion of a link. */
static kt_real1 *quaternion_of(const kt_link *link, kt_real1 *q) {
    return q + link->q + kt_motion_facts_of(link->motion).plain;
}

kt_lane_mask KT_KERNEL(kt_units)(const kt_model *model, double *q) {
    kt_real1 *qs = (void *)q;
    kt_condition off = kt_condition_false(), usual = kt_condition_true();
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        if (!kt_motion_facts_of(link->motion).quaternions)
            continue;
        const kt_real1 n2 = norm_squared(load(quaternion_of(link, qs)));
        off |= ~(kt_abs(n2 - 1.0) <= 4.0 * DBL_EPSILON);
        usual &= (n2 > 1e-280) & (n2 < 1e280);
    }
    for (size_t i = 1; i < model->n.link && kt_is_anywhere(off & usual); i++) {
        const kt_link *link = &model->link[i];
        if (!kt_motion_facts_of(link->motion).quaternions)
            continue;
        kt_real1 *p = quaternion_of(link, qs);
        const kt_real1 s = 1.0 / kt_sqrt(norm_squared(load(p)));
        for (int k = 0; k < 4; k++)
            p[k] = kt_choose(off & usual, s * p[k], p[k]);
    }
    return kt_mask_of(usual);
}

/* ---- gradients --------------------------------------------------------------------------------------------------- */

static void add(kt_real1 *to, quaternion a) {
    to[0] += a.w;
    to[1] += a.x;
    to[2] += a.y;
    to[3] += a.z;
}

/* vec(conj(p) o y) / 2 */
static void lift(quaternion p, quaternion y, kt_real1 out[3]) {
    const quaternion x = multiply((quaternion){p.w, -p.x, -p.y, -p.z}, y);
    out[0] = 0.5 * x.x;
    out[1] = 0.5 * x.y;
    out[2] = 0.5 * x.z;
}

void KT_KERNEL(kt_drop_transposed)(const kt_model *model, const double *q, const double *by_xi, double *by_q) {
    const kt_real1 *qs = (const void *)q, *by = (const void *)by_xi;
    kt_real1 *out = (void *)by_q;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            out[link->q + k] += by[link->v + k];
        if (!motion.quaternions)
            continue;
        const quaternion p = load(qs + link->q + motion.plain);
        add(out + link->q + motion.plain, times(p, 2.0 / norm_squared(p), by + link->v + motion.plain));
    }
}

void KT_KERNEL(kt_rate_transposed)(const kt_model *model, const double *q, const double *v, const double *by_rate,
                                   double *by_q, double *by_v) {
    const kt_real1 *qs = (const void *)q, *vs = (const void *)v, *by = (const void *)by_rate;
    kt_real1 *to_q = (void *)by_q, *to_v = (void *)by_v;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            to_v[link->v + k] += by[link->q + k];
        if (!motion.quaternions)
            continue;
        const int at = link->q + motion.plain, w = link->v + motion.plain;
        const quaternion y = load(by + at);
        const kt_real1 back[3] = {-1.0 * vs[w], -1.0 * vs[w + 1], -1.0 * vs[w + 2]};
        kt_real1 lifted[3];
        add(to_q + at, rate_of(y, back));
        lift(load(qs + at), y, lifted);
        for (int k = 0; k < 3; k++)
            to_v[w + k] += lifted[k];
    }
}

void KT_KERNEL(kt_lift_transposed)(const kt_model *model, const double *q, const double *by_q, double *by_xi) {
    const kt_real1 *qs = (const void *)q, *by = (const void *)by_q;
    kt_real1 *out = (void *)by_xi;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            out[link->v + k] = by[link->q + k];
        const int at = link->q + motion.plain;
        if (motion.quaternions)
            lift(load(qs + at), load(by + at), out + link->v + motion.plain);
    }
}
