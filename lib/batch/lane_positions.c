/* Positions of several states at once, as joint/position.c and joint/units.c have those of one: rates and norms of
 * quaternions. */
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

/* p (0, w) / 2, with the products by 0 that kt_quat_rate_body has, too. */
static quaternion rate_of(quaternion p, const kt_real1 *omega) {
    const kt_real1 w = kt_real1_splat(0.0), x = 0.5 * omega[0], y = 0.5 * omega[1], z = 0.5 * omega[2];
    return (quaternion){p.w * w - p.x * x - p.y * y - p.z * z, p.w * x + p.x * w + p.y * z - p.z * y,
                        p.w * y - p.x * z + p.y * w + p.z * x, p.w * z + p.x * y - p.y * x + p.z * w};
}

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
