/* Responses to forces at contacts that slip, in range space (slip.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "evaluate/slip.h"

#include <string.h>

/* A wrench about the origin of a link, and the forces of its joint. */
typedef struct joint_forces {
    kt_real3 moment, force;
    double *x;
} joint_forces;

KT_INLINE void add_joint_force(const kt_dof *dof, void *context) {
    const joint_forces *p = context;
    p->x[dof->index] += dof->kind == KT_DOF_ROTATION      ? kt_dot3(dof->u, p->moment)
                        : dof->kind == KT_DOF_TRANSLATION ? kt_dot3(dof->u, p->force)
                                                          : kt_along(dof->u, kt_dof_linear(dof), p->moment, p->force);
}

/* Adds the joint forces of a wrench about the origin of a link, whose pose data hold. */
static void add_joint_forces(const kt_model *model, const kt_data *data, int32_t link, const double *wrench,
                             double *x) {
    joint_forces p = {.moment = kt_load3(wrench), .force = kt_load3(wrench + 3)};
    for (int32_t i = link; i > 0; i = model->link[i].parent) {
        const kt_link *at = &model->link[i];
        p.x = x + at->v;
        kt_dofs_visit(at, data->motion[at->parent].axes, data->motion[i].axes, add_joint_force, &p);
        p.moment = kt_add3(p.moment, kt_cross3(data->motion[i].offset, p.force));
    }
}

/* Units of force, and the joint forces of two of each contact. */
static void find_unit_forces_of_slip(const kt_model *model, const kt_data *data, kt_slip_problem *p) {
    static const double axis[2][2] = {{1.0, 0.0}, {0.0, 1.0}};
    if (p->per == 2)
        memset(p->unit_force, 0, 2 * p->at->n * model->n.v * sizeof *p->unit_force);
    for (size_t j = 0; j < p->per * p->at->n; j++) {
        const size_t k = kt_slip_index(p, p->per == 2 ? j / 2 : j);
        const kt_slip_frame *frame = &data->slip_frame[k];
        const double *e = p->per == 2 ? axis[j % 2] : data->slip_direction + 2 * k;
        const kt_v4 x = kt_v4_from(frame->axis[0]), y = kt_v4_from(frame->axis[1]);
        const kt_v4 along = kt_v4_splat(e[0]) * x + kt_v4_splat(e[1]) * y;
        kt_half_force *to = &p->force[j];
        for (int end = 0; end < 2; end++) {
            to->link[end] = p->contact[k].effect->link[end];
            if (to->link[end] == 0)
                continue;
            const kt_v4 force = kt_v4_splat(end == 0 ? 1.0 : -1.0) * along;
            const kt_v4 moment = kt_v4_cross(kt_v4_from(frame->lever[end]), force);
            memcpy(to->wrench[end], &moment, 3 * sizeof(double));
            memcpy(to->wrench[end] + 3, &force, 3 * sizeof(double));
            if (p->per == 2)
                add_joint_forces(model, data, to->link[end], to->wrench[end], p->unit_force + j * model->n.v);
        }
    }
}

/* Whether a group has equations, and is in range space. Joints at open stops are groups without an equation. Forces at
 * contacts do not act on their links, and kt_half_solve stores no terms for these links. */
static bool has_equations_in_range(const kt_model *model, const kt_data *data, size_t g) {
    return model->group[g].rank[KT_ROWS_ALL] > 0 && kt_half_has_terms(model, data, g);
}

bool kt_slip_has_responses(const kt_model *model, const kt_data *data) {
    const kt_slip_contact *contact = kt_slip_problem_of(data)->contact, *end = contact + model->n.slip;
    int32_t last = -1; /* contacts of a group follow each other */
    for (; contact < end; contact++) {
        if (contact->loop->group == last)
            continue;
        last = contact->loop->group;
        if (!has_equations_in_range(model, data, (size_t)last))
            return false;
    }
    return true;
}

/* The slot of the normal force in the contact's group; -1: no slot. */
static int32_t slot_of(const kt_model *model, const kt_loop_record *loop) { return model->slot[loop->slot]; }

double kt_slip_multiplier(const kt_model *model, const kt_data *data, const kt_loop_record *loop) {
    const int32_t slot = slot_of(model, loop);
    if (slot < 0)
        return 0.0;
    const kt_group_work w = kt_group_matrices(model, data, (size_t)loop->group, KT_ROWS_ALL);
    return w.multiplier[slot];
}

/* Whether group g is in the present island, in range space. */
static bool is_part(const kt_model *model, const kt_data *data, const kt_slip_problem *p, size_t g) {
    return model->group[g].island == p->at->index && has_equations_in_range(model, data, g);
}

void kt_slip_find_responses(const kt_model *model, const kt_data *data, kt_slip_problem *p) {
    const size_t n = p->at->n, count = p->per * n;
    double *column = p->column, *change = p->change;
    memcpy(p->responded + p->at->first, p->order + p->at->first, n * sizeof *p->order);
    find_unit_forces_of_slip(model, data, p);
    if (p->per == 2)
        memset(p->by_rate, 0, count * count * sizeof *p->by_rate);
    for (size_t g = 0; g < model->n.group; g++) {
        const size_t rows = (size_t)model->group[g].row_count;
        if (!is_part(model, data, p, g))
            continue;
        KT_BY_ISA(model->isa, , kt_half_respond,
                  (model, data, g, p->force, (int)count, column, change, p->per == 2 ? p->by_rate : NULL));
        for (size_t k = 0; k < n; k++) {
            const kt_loop_record *loop = p->contact[kt_slip_index(p, k)].loop;
            if (loop->group != (int32_t)g)
                continue;
            const int32_t slot = slot_of(model, loop);
            const double *from = change + (slot < 0 ? 0 : slot);
            double *to = p->by_normal + k, *end = to + count * n;
            for (; to < end; to += n, from += rows)
                *to = slot < 0 ? 0.0 : *from;
        }
        change += count * rows;
        column += kt_half_response_count((size_t)model->group[g].v_count, count);
    }
}

void kt_slip_add_friction(const kt_model *model, kt_data *data, kt_slip_problem *p) {
    const size_t count = p->per * p->at->n;
    double *column = p->column, *change = p->change;
    for (size_t j = 0; j < count; j++) {
        const size_t k = (size_t)p->responded[p->at->first + j / p->per];
        const double along = p->per == 2 ? data->slip_direction[2 * k + j % 2] : 1.0;
        p->factor[j] = -p->contact[k].effect->friction * data->slip_normal[k] * along;
    }
    for (size_t g = 0; g < model->n.group; g++) {
        if (!is_part(model, data, p, g))
            continue;
        KT_BY_ISA(model->isa, , kt_half_add_forces, (model, data, g, p->factor, (int)count, change, column));
        change += count * (size_t)model->group[g].row_count;
        column += kt_half_response_count((size_t)model->group[g].v_count, count);
    }
}

bool kt_slip_resume(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a) {
    const size_t nv = model->n.v, end = model->n.planar > 0 ? model->n.spatial : model->n.link;
    double *found = data->scratch;
    memcpy(found, a, nv * sizeof *a);
    KT_BY_ISA(model->isa, , kt_spatial_links_resume, (model, data, at->v, end, found));
    if (!kt_all_finite(found, nv))
        return false;
    memcpy(a, found, nv * sizeof *a);
    return true;
}
