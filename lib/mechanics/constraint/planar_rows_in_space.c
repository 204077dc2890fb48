/* The equations of a planar loop without a special form in the plane: the equations in space, for ends that move in the
 * plane.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/planar_loop_jacobian.h"

/* An end of a loop in the basis (e1, e2, n). */
static void end_in_space(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                         const kt_planar_loop *flat, int k, const kt_planar_end *end, kt_loop_end *out) {
    const kt_planar_motion *m = &data->planar[flat->link[k]];
    const kt_planar_rest *rest = &model->planar_rest[flat->link[k] ? flat->link[k] : flat->link[1 - k]];
    kt_v4 basis[3], frame[3], still[3];
    kt_v4_from_mat3(loop->frame[k].rotation, frame);
    kt_v4_from_mat3(model->plane[rest->plane].basis, basis);
    for (int i = 0; i < 3; i++) {
        still[i] = flat->link[k] ? kt_v4_apply(rest->axes, frame[i]) : kt_v4_apply_transposed(basis, frame[i]);
        out->axes[i] =
            (kt_v4){m->c * still[i][0] - m->s * still[i][1], m->s * still[i][0] + m->c * still[i][1], still[i][2], 0.0};
    }
    out->point = (kt_v4){end->point[0], end->point[1], k ? flat->height : 0.0, 0.0};
    out->velocity = (kt_v4){end->velocity[0], end->velocity[1], 0.0, 0.0};
    out->omega = (kt_v4){0.0, 0.0, end->omega, 0.0};
    out->linear = (kt_v4){end->linear[0], end->linear[1], 0.0, 0.0};
    out->alpha = kt_v4_splat(0.0);
    out->turn = 0.0;
}

int KT_KERNEL(kt_planar_rows_in_space)(const kt_model *model, const kt_data *data, const kt_group_work *w,
                                       const kt_loop_in_plane *x, const kt_planar_end end[2], double t,
                                       kt_planar_wrench *out) {
    const kt_loop_record *loop = x->loop;
    const kt_planar_loop *flat = x->flat;
    kt_loop_end ends[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    int count = 0;
    for (int k = 0; k < 2; k++)
        end_in_space(model, data, loop, flat, k, &end[k], &ends[k]);
    if (loop->counted)
        kt_ends_count(model, loop, x->q, ends);
    (void)KT_KERNEL(kt_loop_kinds)[loop->kind]->evaluate(loop, model->number, ends, t, rows);
    if (loop->equations != NULL)
        kt_stop_store_code(model, data, loop, rows[0].rate);
    for (int i = 0; i < flat->count; i++) {
        const kt_loop_row *row = &rows[flat->row[i].row];
        const int32_t at = x->slot[flat->row[i].row];
        if (flat->row[i].kind != KT_PLANAR_ROW_SPATIAL || at < 0)
            continue;
        kt_rows_store(model, w, row, ends, ends[1].point - ends[0].point, at);
        out[count++] =
            (kt_planar_wrench){.force = {row->force[0], row->force[1]}, .moment = row->moment[2], .slot = at};
    }
    return count;
}
