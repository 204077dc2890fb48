/* A probe: the numbers of a neighbouring state on the manifold that are differenced.
 *
 * A probe at the distance s along (dq, dv) projects (q0 (+) s dq, v0 + s dv). The numbers of a probe are, in this
 * order:
 *
 *     q (-) q0, v - v0    the actual differences, nv each
 *     a                   the acceleration at the probe, nv
 *     ...                 the velocities of the markers, 3 each
 *     ...                 the rates of auxiliary states
 *
 * A direction may have components along auxiliary states, too. At rest the force M a can replace a: inverse dynamics
 * with the acceleration a minus that without.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"

#include "base/copy.h"

#include <math.h>

/* The velocities of the markers in world axes, at the state l->q and l->v. */
static kt_status probe_markers(kt_linearization *l, double *out, kt_error *error) {
    if (l->size.markers == 0)
        return KT_OK;
    const kt_status status = kt_kinematics_update(l->model, l->data, l->q, l->v, NULL, error);
    for (size_t m = 0; m < l->size.markers && status == KT_OK; m++) {
        const kt_vec3 at = kt_marker_at(l->model, l->marker[m].body, l->marker[m].marker);
        const kt_vec3 rate = kt_point_velocity(l->model, l->data, l->marker[m].body, at);
        out[3 * m] = rate.x;
        out[3 * m + 1] = rate.y;
        out[3 * m + 2] = rate.z;
    }
    return status;
}

kt_status kt_probe_force(kt_linearization *l, const double *q, double *a, kt_error *error) {
    kt_status status = kt_dynamics_inverse(l->model, l->data, q, NULL, a, NULL, a, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(l->model, l->data, q, NULL, NULL, NULL, l->weight, error);
    for (size_t i = 0; i < l->size.v && status == KT_OK; i++)
        a[i] -= l->weight[i];
    return status;
}

/* A sample for differences, at the distance `step` from the state along l->direction, with closed loops: the changes
 * of positions and velocities, the accelerations (or M a), the velocities of markers, and the rates of auxiliary
 * states. */
static kt_status probe(kt_linearization *l, double step, double *out, kt_error *error) {
    const size_t nv = l->size.v;
    for (size_t i = 0; i < nv; i++) {
        out[i] = step * l->direction[i];
        l->v[i] = l->v0[i] + step * l->direction[nv + i];
    }
    kt_position_add(l->model, l->q0, out, l->q);
    kt_status status = kt_state_project(l->model, l->data, l->t, l->q, l->v, NULL, error);
    if (status != KT_OK)
        return status;
    kt_position_subtract(l->model, l->q, l->q0, out);
    for (size_t i = 0; i < nv; i++)
        out[nv + i] = l->v[i] - l->v0[i];
    status = kt_acceleration_evaluate(l->model, l->data, l->t, l->q, l->v, l->tau, NULL, out + 2 * nv, error);
    if (status == KT_OK && l->of_force)
        status = kt_probe_force(l, l->q, out + 2 * nv, error);
    if (status == KT_OK)
        status = probe_markers(l, out + 3 * nv, error);
    if (status == KT_OK && l->size.x > 0)
        status = kt_auxiliary_state_rates(l->model, l->data, l->t, l->q, l->v, out + kt_probe_rates(l), error);
    return status;
}

kt_status kt_probe(kt_linearization *l, double step, double *out, kt_error *error) {
    for (size_t i = 0; i < l->size.x; i++)
        l->data->x[i] = l->x0[i] + step * l->direction[2 * l->size.v + i];
    const kt_status status = probe(l, step, out, error);
    kt_copy(l->data->x, l->x0, l->size.x * sizeof *l->x0);
    return status;
}

/* Rounding of angles and lengths is proportional to their size, rounding of quaternions to 1. */
static void positions_floor(const kt_linearization *l, double *floor) {
    for (size_t i = 1; i < l->model->n.link; i++) {
        const kt_link *link = &l->model->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++)
            floor[link->v + k] =
                k < kt_motion_facts_of(link->motion).plain ? fmax(fabs(l->q0[link->q + k]), l->unit[link->v + k]) : 1.0;
    }
}

void kt_probe_floor(kt_linearization *l) {
    const size_t nv = l->size.v;
    const kt_vec3 gravity = kt_model_gravity(l->model);
    const double speed = kt_largest_in_units(l, l->v0);
    double size = 0.0;
    for (size_t i = 0; i < nv; i++)
        size = fmax(size, l->unit[i]);
    const double pull = fmax(kt_largest_in_units(l, l->a0), fmax(speed * speed, kt_vec3_norm(gravity) / size));
    positions_floor(l, l->floor);
    for (size_t i = 0; i < nv; i++) {
        l->floor[nv + i] = speed * l->unit[i];
        l->floor[2 * nv + i] = pull * l->unit[i];
    }
    for (size_t i = 0; i < 3 * l->size.markers; i++)
        l->floor[3 * nv + i] = speed * size;
    for (size_t i = 0; i < l->size.x; i++)
        l->floor[kt_probe_rates(l) + i] = fabs(l->x_rate[i]);
}
