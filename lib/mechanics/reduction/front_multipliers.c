/* The multipliers of a constraint group that is reduced by fronts (front.h).
 *
 * The forces r = M x + F' A - (tau - h) that the loops have to exert on the coordinates are A' lambda. As a linear
 * function of the parameters the forces are c = (c of the previous step, r_i), and Q' c = (c_y, c of the next step).
 * Equations that are completed later depend on y as well, by the acceleration T Q1 y of a link in a slot. Let w be the
 * wrenches that these equations exert on such links. Then
 *
 *     R1 lambda = c_y - (T Q1)' w
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front.h"

#include "linear/cholesky.h"
#include "linear/qr.h"
#include "reduction/front_link.h"

#include <assert.h>
#include <string.h>

/* Adds to x the wrench w on a link of the group, about its origin, expressed about the parent's: r is the offset. */
static void add_shifted_wrench(int components, kt_v4 r, const double *w, double *x) {
    double shifted[KT_FRONT_SPACE];
    memcpy(shifted, w, sizeof shifted);
    kt_wrench_shift(components, r, shifted);
    for (int c = 0; c < components; c++)
        x[c] += shifted[c];
}

/* r of all coordinates, in f->w.free. Requires the accelerations of the links. */
static void find_joint_forces(const kt_front *f, const double *a) {
    for (int s = 0; s < f->group->link_count; s++)
        memset(kt_front_constant(f, s), 0, KT_FRONT_SPACE * sizeof(double));
    for (int s = f->group->link_count - 1; s >= 0; s--) {
        const kt_front_step *step = &f->step[s];
        const kt_link_motion *m = &f->data->motion[step->link];
        const kt_response *bias = &f->data->response[step->link];
        const kt_articulated *x = &f->data->articulated[step->link];
        const kt_v4 alpha = m->alpha - bias->bias_angular, linear = m->linear - bias->bias_linear;
        const kt_v4 moment = x->moment + kt_articulated_moment(x, alpha, linear);
        const kt_v4 force = x->force + kt_articulated_force(x, alpha, linear);
        const int32_t local = f->model->link[step->link].local, v = f->model->link[step->link].v;
        double own[KT_DOF_MAX * KT_FRONT_SPACE], *w = kt_front_constant(f, s);
        const int dofs = kt_front_subspace(f, step->link, own);
        for (int c = 0; c < 3; c++) {
            w[c] += moment[c];
            w[c + 3] += force[c];
        }
        for (int d = 0; d < dofs; d++)
            f->w.free[local + d] = kt_dense_dot(own + d * KT_FRONT_SPACE, w, KT_FRONT_SPACE) - f->w.bias[local + d] +
                                   f->model->armature[v + d] * a[v + d];
        if (step->up >= 0)
            add_shifted_wrench(f->components, m->offset, w, kt_front_constant(f, step->up));
        memset(w, 0, KT_FRONT_SPACE * sizeof *w); /* for the link that has the slot before */
    }
}

/* c_y of all steps, in the steps' `force`. */
static void find_covectors(const kt_front *f) {
    double *c = f->z;
    int params = 0;
    memset(c, 0, (size_t)f->stride * sizeof *c);
    for (int s = 0; s < f->group->link_count; s++) {
        const kt_front_count *at = &f->count[s];
        const int32_t local = f->model->link[f->step[s].link].local;
        kt_front_factor x;
        kt_front_factor_find(f, s, &x);
        for (int d = 0; d < at->params - params; d++)
            c[params + d] = f->w.free[local + d];
        for (int j = 0; j < at->rank; j++)
            kt_reflect(x.rows + j * at->params, x.scale[j], j, at->params, c);
        memcpy(x.force, c, (size_t)at->rank * sizeof *c);
        for (int i = at->rank; i < at->params; i++)
            c[i - at->rank] = c[i];
        for (int j = 0; j < at->reflectors; j++)
            kt_front_reflect(x.coupled + j * kt_front_padded(at->left), x.coupled_scale[j], at->left, c);
        params = at->kept;
    }
}

/* Adds the wrenches of a step's equations to the wrenches of their links, and to the sums of relations. */
static void load_slots(const kt_front *f, const kt_front_step *step, const double *lambda) {
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const int32_t index = f->model->front_loop[i];
        const kt_loop_record *loop = &f->model->loop[index];
        const int32_t *slot = f->model->slot + loop->slot;
        if (loop->term_count)
            *kt_front_constant(f, kt_front_relation_of(f, step, index)) =
                kt_front_counts(f, slot[0]) ? lambda[slot[0]] : 0.0;
        for (int r = 0; r < loop->row_count && !loop->term_count; r++)
            for (int k = 0; k < 2 && kt_front_counts(f, slot[r]); k++) {
                const int32_t at = kt_front_step_of(f, loop->link[k]);
                const double *w = kt_front_wrench(f, slot[r], k);
                for (int c = 0; c < f->components && at >= 0; c++)
                    kt_front_constant(f, at)[c] += lambda[slot[r]] * w[c];
            }
    }
}

/* c -= (T Q1)' w, see reflect_slots. */
static void unload_slots(const kt_front *f, const double *early, int rank, double *c) {
    for (int32_t l = 0; l < f->active_count; l++) {
        const double *w = kt_front_constant(f, f->active[l]);
        for (int k = 0; k < kt_front_vector_count(f, f->active[l]); k++, early += rank)
            for (int j = 0; j < rank; j++)
                c[j] -= early[j] * w[k];
    }
}

/* R1 lambda = c */
static void solve_multipliers(const kt_front_count *count, const kt_front_factor *x, const int32_t *pivot,
                              double *lambda) {
    for (int j = count->rank - 1; j >= 0; j--) {
        double sum = x->force[j];
        for (int i = j + 1; i < count->rank; i++)
            sum -= x->rows[i * count->params + j] * lambda[pivot[i]];
        lambda[pivot[j]] = sum / x->rows[j * (count->params + 1)];
    }
}

/* Restores the slots of delayed equations as before the step: after the call, the slots hold the equations that the
 * step received, not those that it delayed. */
static void return_delayed(kt_front *f, const kt_front_count *count, const double *lambda) {
    for (int d = 0; d < count->delayed; d++)
        kt_front_release(f, kt_front_delayed(f, d));
    for (int d = 0; d < count->received; d++) {
        *kt_front_constant(f, kt_front_delayed(f, d)) = lambda[count->received_row[d]];
        kt_front_enter(f, kt_front_delayed(f, d));
    }
}

/* Restores the slots in use as before the step: adds the slots that the step released, and removes the slots that it
 * took. The wrench on the step's link passes to the parent. */
static void undo_step(kt_front *f, int s) {
    const kt_front_step *step = &f->step[s];
    double *w = kt_front_constant(f, s);
    if (step->up >= 0)
        add_shifted_wrench(f->components, kt_front_offset(f, step->link), w, kt_front_constant(f, step->up));
    memset(w, 0, KT_FRONT_SPACE * sizeof *w);
    kt_front_release(f, s);
    for (int i = step->term; i < step->term + step->term_count; i++)
        if (f->model->front_term[i].first)
            kt_front_release(f, f->group->link_count + f->model->front_term[i].slot);
}

/* lambda, of the forces r; the links' slots hold zeros. */
static void find_front_multipliers(kt_front *f, double *lambda) {
    const kt_model *model = f->model;
    find_covectors(f);
    for (int r = 0; r < f->w.k; r++)
        lambda[r] = 0.0;
    for (int s = f->group->link_count - 1; s >= 0; s--) {
        const kt_front_step *step = &f->step[s];
        kt_front_factor x;
        kt_front_factor_find(f, s, &x);
        unload_slots(f, x.early, f->count[s].rank, x.force);
        solve_multipliers(&f->count[s], &x, f->w.pivot + f->count[s].first, lambda);
        return_delayed(f, &f->count[s], lambda);
        for (int i = step->loop; i < step->loop + step->loop_count; i++)
            if (model->loop[model->front_loop[i]].term_count)
                kt_front_enter(f, kt_front_relation_of(f, step, model->front_loop[i]));
        for (int i = step->last_use; i < step->last_use + step->last_use_count; i++)
            kt_front_enter(f, model->front_last_use[i]);
        load_slots(f, step, lambda);
        undo_step(f, s);
    }
}

void KT_KERNEL(kt_front_multipliers)(const kt_model *model, kt_data *data, size_t g, const double *a, double *lambda) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    find_joint_forces(&f, a);
    find_front_multipliers(&f, lambda);
}

void KT_KERNEL(kt_front_multipliers_of)(const kt_model *model, kt_data *data, size_t g, double *lambda) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    for (int s = 0; s < f.group->link_count; s++)
        memset(kt_front_constant(&f, s), 0, KT_FRONT_SPACE * sizeof(double));
    find_front_multipliers(&f, lambda);
}
