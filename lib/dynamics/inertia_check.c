/* Whether a tree has inertia along all its degrees of freedom at a position: the backward pass of forward.c at rest,
 * with a sharper pivot test than forward dynamics can afford.
 *
 * Projecting out a degree of freedom leaves rounding errors in J and M that are proportional to what was there. These
 * sizes are carried along: for M the mass carried; for J the sum of the traces of the rigid inertias carried, and the
 * largest among the terms sum s_i^2 J_ii of rotations that were projected out and mass times r^2 of shifts, with the
 * present r where prismatic joints change it. Nothing of J remains behind a spherical or a free joint, whose rows are
 * then exactly zero.
 */
#include "dynamics/articulated.h"
#include "dynamics/dynamics.h"

#include <string.h>

typedef struct size {
    double mass, trace, largest;
} size;

/* Where the sizes of a link's children are summed: at set-up the memory of the kinematics is not used yet. */
static size *size_of(kt_data *data, size_t i) { return (size *)&data->kinematics[i]; }

/* Whether there is inertia along all degrees of freedom of a link; adds what is projected out to the size. */
static bool is_regular(const kt_link *link, const kt_link_motion *m, const kt_articulated *x, size *s) {
    const kt_v4 n = m->axis;
    kt_v4 unused[3];
    const double turn = kt_v4_dot(n, kt_v4_apply(x->j, n)), slide = kt_v4_dot(n, kt_v4_apply(x->m, n));
    const double both = kt_v4_dot(n, kt_v4_apply(x->h, n)), p = link->pitch;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        s->largest = fmax(s->largest, kt_v4_dot(n * n, kt_diagonal3(x->j)));
        return turn > KT_NO_INERTIA * (s->trace + s->largest);
    case KT_MOTION_PRISMATIC:
        return slide > KT_NO_INERTIA * s->mass;
    case KT_MOTION_SCREW:
        s->largest = fmax(s->largest, kt_v4_dot(n * n, kt_diagonal3(x->j)));
        return turn + p * (2.0 * both + p * slide) > KT_NO_INERTIA * (s->trace + s->largest + p * p * s->mass);
    case KT_MOTION_SPHERICAL:
        return kt_invert3(x->j, kt_diagonal3(x->j) + kt_v4_splat(s->trace + s->largest), unused);
    case KT_MOTION_FREE:
        return kt_invert3(x->m, kt_v4_splat(s->mass), unused);
    case KT_MOTION_NONE:
        break;
    }
    return false;
}

static void take_position(const kt_model *model, kt_data *data, const double *q) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_sincos_gather(q, model->angle, model->n.angle, data->sine, data->cosine);
    kt_ground_set(none, &data->motion[0]);
    for (size_t i = 1; i < model->n.link; i++) {
        kt_link_motion *m = &data->motion[i];
        kt_link_pose(&model->link[i], &data->motion[model->link[i].parent], q, data->cosine, data->sine, m);
        m->omega = m->alpha = m->linear = m->moment = m->force = none;
    }
}

size_t kt_singular_links(const kt_model *model, kt_data *data, const double *q, unsigned char *verdict) {
    size_t found = 0;
    take_position(model, data, q);
    memset(data->articulated, 0, model->n.link * sizeof *data->articulated);
    memset(data->kinematics, 0, model->n.link * sizeof *data->kinematics);
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &data->motion[i];
        kt_articulated x;
        size s = *size_of(data, i), *up = size_of(data, (size_t)link->parent);
        kt_articulated_rigid(link, m, &x);
        s.trace += kt_v4_dot(kt_v4_splat(1.0), kt_diagonal3(x.j));
        s.mass += link->mass;
        kt_articulated_add(&x, &data->articulated[i]);
        if (verdict[i] == KT_INERTIA_THERE &&
            (!is_regular(link, m, &x, &s) || !kt_articulated_project(model, data, i, model->zero, &x))) {
            verdict[i] = KT_INERTIA_NONE;
            found++;
        }
        if (verdict[i] != KT_INERTIA_THERE) {
            if (link->motion != KT_MOTION_FREE) /* which passes no inertia to its parent */
                verdict[link->parent] = KT_INERTIA_UNKNOWN;
            continue;
        }
        if (link->motion == KT_MOTION_SPHERICAL)
            s.trace = s.largest = 0.0;
        if (link->motion == KT_MOTION_FREE || link->parent == 0)
            continue;
        kt_articulated_shift(&x, m->offset);
        kt_articulated_add(&data->articulated[link->parent], &x);
        up->mass += s.mass;
        up->trace += s.trace;
        up->largest = fmax(up->largest, fmax(s.largest, s.mass * kt_v4_dot(m->offset, m->offset)));
    }
    return found;
}
