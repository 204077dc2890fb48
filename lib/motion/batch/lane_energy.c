/* Energies of several states at once, as dynamics/total.c computes the energies of one state:
 *
 *   T = sum m v_c^2 / 2 + w . I_c w / 2,   V = -sum m g . c
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "dynamics/point.h"

/* The body's angular velocity in its own axes. */
static kt_real3 body_spin_of(const kt_body_record *b, const kt_link_motion *m) {
    const kt_const_mat3 *r = &b->in_link.rotation;
    const kt_real3 x = kt_apply3(m->axes, r->x), y = kt_apply3(m->axes, r->y), z = kt_apply3(m->axes, r->z);
    return kt_make3(kt_dot3(x, m->omega), kt_dot3(y, m->omega), kt_dot3(z, m->omega));
}

static kt_real3 apply_sym3(const kt_const_sym3 *s, kt_real3 u) {
    return kt_make3(s->xx * u.x + s->xy * u.y + s->xz * u.z, s->xy * u.x + s->yy * u.y + s->yz * u.z,
                    s->xz * u.x + s->yz * u.y + s->zz * u.z);
}

/* The sum of m v . v / 2 + w . I w / 2 over all bodies, with the velocity v of the centre of mass and the spin w. */
kt_real1 KT_KERNEL(kt_kinetic)(const kt_model *model, const kt_data *data) {
    kt_real1 twice = kt_real1_splat(0.0);
    for (size_t i = 1; i < model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        const kt_link_motion *m = &data->motion[b->link];
        const kt_real3 arm = kt_point_arm(b, m->axes, b->com);
        const kt_real3 v = kt_point_transport(data->origin[b->link].velocity, m->omega, arm);
        const kt_real3 w = body_spin_of(b, m);
        twice += b->mass * kt_dot3(v, v) + kt_dot3(w, apply_sym3(&b->inertia, w));
    }
    return 0.5 * twice + 0.0; /* the energy of rotors, of which there are none */
}

/* The sum of -m g . c over all bodies, with the centres of mass c. The energy is 0 at the world's origin. */
kt_real1 KT_KERNEL(kt_potential)(const kt_model *model, const kt_data *data) {
    kt_real1 energy = kt_real1_splat(0.0);
    for (size_t i = 1; i < model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        if (b->fixed)
            continue;
        const kt_real3 arm = kt_point_arm(b, data->motion[b->link].axes, b->com);
        const kt_real3 c = kt_add3(data->origin[b->link].position, arm);
        energy -= b->mass * kt_dot3(*data->gravity, c);
    }
    return energy;
}
