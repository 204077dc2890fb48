/* Self-stresses: multipliers that balance one another.
 *
 * If equations of loops depend on each other, or vanish, the equation A' lambda = f has many solutions. They differ by
 *
 *     A' N z = 0,        N: a basis of the null space of A', k x d,  d = k - rank,
 *
 * which moves nothing, and changes the reactions of loops and of the joints on their paths by W z (Pellegrino &
 * Calladine 1986, doi:10.1016/0020-7683(86)90014-4, call N the states of self-stress). Here A has all equations of the
 * loops that hold both ways. Those that are void, which the reduction leaves out, are rows of zeros in A and unit
 * vectors in N: the forces out of the plane of a planar linkage are among them.
 *
 * Column-pivoted QR of A' = Q [R1 R2; 0 0] P' yields N = P [-R1^-1 R2; 1]. Equations and coordinates have their units,
 * so that the rank does not depend on units of length; it is at most the structural one. A multiplier of an equation
 * loads the bodies on the path of the loop's second end by its wrench, about the second end's point, and those on the
 * path of the first end by the opposite one. The joints carry it with the other sign.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/self_stress.h"
#include "constraint/loop_jacobian.h"

#include <assert.h>

typedef struct stress_work {
    const kt_model *model;
    kt_data *data;
    const kt_group *group;
    double t;
    const double *q;
    kt_stress s;
} stress_work;

/* Writes the column of A' of a relation, its scale, and no wrench. */
static void fill_relation(const stress_work *w, const kt_loop_record *loop, size_t row) {
    double *a = w->s.a + row * w->s.m, scale = 0.0;
    kt_formula_row f = {.value = 0.0};
    if (loop->form)
        kt_formula_row_evaluate(w->model, loop, w->q, NULL, &f);
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &w->model->term[loop->term + k];
        const int32_t local = w->model->link[term->link].local;
        a[local] += term->coefficient + (loop->form ? f.by[k] : 0.0);
        scale = fmax(scale, fabs(a[local]) * w->model->unit[w->group->v + local]);
    }
    w->s.scale[row] = scale > 0.0 ? scale : 1.0;
}

/* Writes the columns of A' of a loop between frames, their scales, and the wrenches. Void equations are zeros. */
static void fill_frames(const stress_work *w, const kt_loop_record *loop, size_t first) {
    const int32_t *slot = w->model->slot + loop->slot;
    const kt_group_work to = {.m = (int)w->s.m, .a = w->s.a};
    int32_t column[KT_LOOP_ROW_MAX];
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_v4 arm[2];
    for (int k = 0; k < 2; k++)
        arm[k] = kt_end_follow(w->model, w->data, loop, k, false, NULL, &end[k]);
    const int count = KT_KERNEL(kt_loop_kinds)[loop->kind]->evaluate(loop, w->model->number, end, w->t, rows);
    for (int r = 0; r < count; r++) {
        double *unit = w->s.unit + 6 * (first + (size_t)r);
        column[r] = slot[r] < 0 ? -1 : (int32_t)first + r;
        w->s.scale[first + (size_t)r] = kt_dot3(rows[r].force, rows[r].force) > 0.0 ? w->group->stress_length : 1.0;
        for (int c = 0; c < 3; c++) {
            unit[c] = rows[r].moment[c];
            unit[c + 3] = rows[r].force[c];
        }
    }
    kt_rows_path_terms p = {.w = &to, .slot = column, .rows = rows, .count = count};
    for (int k = 0; k < 2; k++) {
        p.arm = k == 0 ? arm[0] + end[1].point - end[0].point : arm[1];
        if (loop->length[k] > 0)
            kt_rows_path(w->model, w->data, loop, k, p);
    }
}

/* Writes A' in the units of coordinates and equations. */
static void fill_stress(const stress_work *w) {
    const kt_stress *s = &w->s;
    size_t row = 0;
    memset(s->a, 0, s->m * s->k * sizeof *s->a);
    memset(s->unit, 0, 6 * s->k * sizeof *s->unit);
    for (int i = 0; i < w->group->loop_count; i++) {
        const kt_loop_record *loop = &w->model->loop[w->model->group_loop[w->group->loop + i]];
        if (!kt_stress_shares(loop))
            continue;
        if (loop->term_count)
            fill_relation(w, loop, row);
        else
            fill_frames(w, loop, row);
        for (int r = 0; r < loop->row_count; r++)
            s->equation[row + (size_t)r] = loop->equation + r;
        row += (size_t)loop->row_count;
    }
    for (size_t r = 0; r < s->k; r++)
        for (size_t i = 0; i < s->m; i++)
            s->a[r * s->m + i] *= w->model->unit[(size_t)w->group->v + i] / s->scale[r];
}

/* Factors A'; returns the rank, at most `most`. Directions below KT_RANK_TOLERANCE of the first do not count. */
static int factor_stress(const kt_stress *s, int most) {
    const kt_qr qr = {(int)s->m, (int)s->k, s->a, s->tau, s->pivot};
    double all, first = 0.0;
    int rank = 0;
    for (int c = 0; c < qr.k; c++) {
        s->pivot[c] = c;
        s->norm[c] = kt_dense_dot(s->a + (size_t)c * s->m, s->a + (size_t)c * s->m, qr.m);
    }
    for (; rank < most; rank++) {
        const int best = kt_longest_column(s->norm, rank, qr.k, &all);
        first = rank ? first : sqrt(s->norm[best]);
        if (!(sqrt(s->norm[best]) > KT_RANK_TOLERANCE * fmax(first, KT_RANK_FLOOR)))
            break;
        kt_qr_step(&qr, qr.m, rank, best, s->norm);
    }
    return rank;
}

/* Writes N = P [-R1^-1 R2; 1], divided by the scales of the equations. */
static void write_basis(const kt_stress *s, int rank, int d) {
    const kt_qr qr = {(int)s->m, (int)s->k, s->a, s->tau, s->pivot};
    for (int c = 0; c < d; c++) {
        double *n = s->basis + (size_t)c * s->k, *y = s->norm;
        const double *r2 = s->a + (size_t)(rank + c) * s->m;
        memset(n, 0, s->k * sizeof *n);
        for (int i = 0; i < rank; i++)
            y[i] = -r2[i];
        kt_qr_solve(&qr, qr.m, rank, y);
        for (int i = 0; i < rank; i++)
            n[s->pivot[i]] = y[i] / s->scale[s->pivot[i]];
        n[s->pivot[rank + c]] = 1.0 / s->scale[s->pivot[rank + c]];
    }
}

KT_INLINE kt_v4 vector_at(const double *x) { return (kt_v4){x[0], x[1], x[2], 0.0}; }

/* The sum of the wrenches of a loop's equations in column c of N, about the second end's point: moment, force (6). */
static void sum_wrench(const kt_stress *s, const kt_loop_record *loop, size_t first, int c, double *sum) {
    kt_v4 moment = kt_v4_splat(0.0), force = moment;
    for (size_t r = first; r < first + (size_t)loop->row_count; r++) {
        const kt_v4 n = kt_v4_splat(s->basis[(size_t)c * s->k + r]);
        moment += n * vector_at(s->unit + 6 * r);
        force += n * vector_at(s->unit + 6 * r + 3);
    }
    for (int i = 0; i < 3; i++) {
        sum[i] = moment[i];
        sum[i + 3] = force[i];
    }
}

static void add_to_row(const kt_stress *s, size_t row, int c, kt_v4 moment, kt_v4 force) {
    double *x = s->wrench + (size_t)c * s->rows + row;
    for (int i = 0; i < 3; i++) {
        x[i] += moment[i];
        x[i + 3] += force[i];
    }
}

/* Returns the vector from the origin of a body's joint frame to the second end's point, given that from the origin of
 * the body's frame; *up: that from the origin of its parent's frame. Sums offsets between links alone (total.c). */
static kt_v4 arm_of_parent(const kt_model *model, const kt_data *data, int32_t body, kt_v4 arm, kt_v4 *up) {
    const kt_body_record *b = &model->body[body], *parent = &model->body[b->parent];
    kt_v4 in_link = kt_v4_apply(data->motion[b->link].axes, kt_v4_from(b->in_link.position));
    const kt_v4 of_parent = kt_v4_apply(data->motion[parent->link].axes, kt_v4_from(parent->in_link.position));
    kt_v4 from_parent_link = in_link; /* the origin of the body's frame, from that of its parent's link */
    for (int32_t l = b->link; l != parent->link; l = model->link[l].parent)
        from_parent_link += data->motion[l].offset;
    const kt_vec3 joint = kt_mat3_apply(parent->in_link.rotation, b->joint.position);
    const kt_v4 at = kt_v4_apply(data->motion[parent->link].axes, kt_v4_from(joint));
    *up = arm + from_parent_link - of_parent;
    return *up - at;
}

/* Adds the wrenches of a loop between frames to the rows of the joints on its paths, and to its own. The sums are kept
 * in `factor`, which is free until W is factored. */
static void load_paths(const stress_work *w, const kt_loop_record *loop, size_t first, size_t row, int d) {
    const kt_stress *s = &w->s;
    kt_stress_path path = {{loop->body[0], loop->body[1]}};
    kt_loop_end end[2];
    kt_v4 arm[2];
    for (int k = 0; k < 2; k++) {
        const kt_body_record *b = &w->model->body[loop->body[k]];
        kt_end_follow(w->model, w->data, loop, k, false, NULL, &end[k]);
        arm[k] = kt_v4_apply(w->data->motion[loop->link[k]].axes,
                             kt_v4_from(kt_vec3_sub(loop->frame[k].position, b->in_link.position)));
    }
    const kt_v4 apart = end[1].point - end[0].point;
    arm[0] += apart;
    for (int c = 0; c < d; c++) {
        double *sum = s->factor + 6 * c;
        sum_wrench(s, loop, first, c, sum);
        add_to_row(s, row, c, vector_at(sum) + kt_v4_cross(apart, vector_at(sum + 3)), vector_at(sum + 3));
    }
    int k;
    for (int32_t body; (body = kt_stress_path_next(w->model, &path, &k)) >= 0;) {
        const kt_v4 joint = arm_of_parent(w->model, w->data, body, arm[k], &arm[k]);
        const kt_v4 sign = kt_v4_splat(k ? -1.0 : 1.0);
        for (int c = 0; c < d; c++) {
            const kt_v4 moment = vector_at(s->factor + 6 * c), force = vector_at(s->factor + 6 * c + 3);
            add_to_row(s, KT_STRESS_JOINT * (size_t)w->data->stress_joint[body], c,
                       sign * (moment + kt_v4_cross(joint, force)), sign * force);
        }
    }
}

/* The rows of a relation: a prescribed motion's wrench, and the size of its forces on joints. */
static void load_relation(const stress_work *w, const kt_loop_record *loop, size_t first, size_t row, int d) {
    const kt_stress *s = &w->s;
    const kt_term_record *term = &w->model->term[loop->term];
    const kt_v4 axis = kt_link_axis(&w->model->link[term->link], &w->data->motion[term->link]), none = axis - axis;
    const bool lengths = kt_link_lengths(&w->model->link[term->link]);
    double squares = 0.0;
    kt_formula_row f = {.value = 0.0};
    if (loop->form)
        kt_formula_row_evaluate(w->model, loop, w->q, NULL, &f);
    for (int k = 0; k < loop->term_count; k++) {
        const double by = term[k].coefficient + (loop->form ? f.by[k] : 0.0);
        const double unit = kt_link_lengths(&w->model->link[term[k].link]) ? 1.0 : w->group->stress_length;
        squares += by * by / (unit * unit);
    }
    for (int c = 0; c < d; c++) {
        const double n = s->basis[(size_t)c * s->k + first];
        s->wrench[(size_t)c * s->rows + row + KT_STRESS_RELATION] = n * sqrt(squares);
        if (loop->type == KT_LOOP_MOTION)
            add_to_row(s, row, c, lengths ? none : kt_v4_splat(n) * axis, lengths ? kt_v4_splat(n) * axis : none);
    }
}

void KT_KERNEL(kt_stress_find)(const kt_model *model, kt_data *data, size_t g, double t, const double *q) {
    assert(kt_data_serve(model, data) && model->group[g].redundancy == KT_REDUNDANCY_SHARED);
    const stress_work w = {model, data, &model->group[g], t, q, kt_stress_of(model, data, g)};
    const int all = (int)(w.s.k < w.s.m ? w.s.k : w.s.m), structural = (int)(w.s.k - w.s.redundant);
    fill_stress(&w);
    const int rank = factor_stress(&w.s, (int32_t)w.s.k == w.group->row_count ? structural : all);
    const int d = (int)w.s.k - rank, kept = d < (int)w.s.most ? d : (int)w.s.most;
    size_t row = KT_STRESS_JOINT * (size_t)kt_stress_number_joints(model, g, data->stress_joint), first = 0;
    write_basis(&w.s, rank, kept);
    memset(w.s.wrench, 0, w.s.rows * (size_t)kept * sizeof *w.s.wrench);
    for (int i = 0; i < w.group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[w.group->loop + i]];
        if (!kt_stress_shares(loop))
            continue;
        if (loop->term_count)
            load_relation(&w, loop, first, row, kept);
        else
            load_paths(&w, loop, first, row, kept);
        first += (size_t)loop->row_count;
        row += KT_STRESS_LOOP;
    }
    data->stress_count[g] = kept;
}
