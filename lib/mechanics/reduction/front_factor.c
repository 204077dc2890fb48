/* The factors of the equations of a constraint group that is reduced link by link: front.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front.h"

#include "linear/qr.h"
#include "reduction/front_link.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- the factors of the equations -------------------------------------------------------------------------------- */

/* Lengthens the vectors in slots from n parameters to n + more, by zeros. */
KT_INLINE void extend(const kt_front *f, int n, int more) {
    const int end = kt_front_padded(n + more);
    for (int32_t l = 0; l < f->active_count; l++) {
        double *x = kt_front_vector(f, f->active[l]);
        for (int c = kt_front_vector_count(f, f->active[l]); c > 0; c--, x += f->width)
            for (int i = n; i < end; i++)
                x[i] = 0.0;
    }
}

/* Writes the vectors of a link, T_i = [shift(T_parent) S_i], whose parent has n parameters. The link becomes active. */
KT_INLINE void form_link_vectors(kt_front *f, const kt_front_step *step, const double *s, int dofs, int n,
                                 double *kept) {
    const int c = f->components, width = f->width, all = n + dofs;
    const kt_v4 r = kt_front_offset(f, step->link);
    const double *up = step->up < 0 ? NULL : kt_front_vector(f, step->up);
    double *own = kt_front_vector(f, (int32_t)(step - f->step));
    const int end = kt_front_padded(all);
    for (int i = 0; i < end; i += KT_FRONT_LANES) {
        kt_v4 x[KT_FRONT_SPACE];
        for (int k = 0; k < c; k++)
            x[k] = up ? kt_v4_load(up + k * width + i) : kt_v4_splat(0.0);
        kt_motion_shift_of4(c, r, x);
        for (int k = 0; k < c; k++)
            kt_v4_store(own + k * width + i, x[k]);
    }
    for (int k = 0; k < c; k++)
        for (int i = n; i < end; i++)
            own[k * width + i] = i < all ? s[(i - n) * c + k] : 0.0;
    for (int k = 0; k < c; k++)
        memcpy(kept + k * all, own + k * width, (size_t)all * sizeof *kept);
    kt_front_enter(f, (int32_t)(step - f->step));
}

/* Adds the terms of relations on this link, whose coordinate is parameter n. */
KT_INLINE void take_terms(kt_front *f, const kt_front_step *step, int n) {
    for (int i = step->term; i < step->term + step->term_count; i++) {
        const kt_front_term *term = &f->model->front_term[i];
        const int32_t local = f->model->link[step->link].local, slot = f->group->link_count + term->slot;
        double *x = kt_front_vector(f, slot);
        if (term->first) {
            memset(x, 0, (size_t)kt_front_padded(n + 1) * sizeof *x);
            kt_front_enter(f, slot);
        }
        x[n] += f->fixed[local] ? 0.0 : f->model->term[term->term].coefficient;
    }
}

/* D' of the equations that the step completes, n parameters; their indices in `pivot`. Returns their number. */
KT_INLINE int complete_loops(const kt_front *f, const kt_front_step *step, int n, double *rows, int32_t *pivot) {
    const int c = f->components;
    double *sum = f->spare;
    int count = 0;
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const int32_t index = f->model->front_loop[i];
        const kt_loop_record *loop = &f->model->loop[index];
        const int32_t *slot = f->model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++) {
            double *d = rows + count * n;
            if (!kt_front_counts(f, slot[r]))
                continue;
            pivot[count++] = slot[r];
            if (loop->term_count) {
                memcpy(d, kt_front_vector(f, kt_front_relation_of(f, step, index)), (size_t)n * sizeof *d);
                continue;
            }
            memset(sum, 0, (size_t)kt_front_padded(n) * sizeof *sum);
            for (int k = 0; k < 2; k++) {
                const int32_t at = kt_front_step_of(f, loop->link[k]);
                const double *w = kt_front_wrench(f, slot[r], k);
                for (int j = 0; j < c && at >= 0; j++)
                    kt_front_add(w[j], kt_front_vector(f, at) + j * f->width, n, sum);
            }
            memcpy(d, sum, (size_t)n * sizeof *d);
        }
    }
    return count;
}

/* The number of vectors in slots that are in use. */
static int count_vectors(const kt_front *f) {
    int count = 0;
    for (int32_t l = 0; l < f->active_count; l++)
        count += kt_front_vector_count(f, f->active[l]);
    return count;
}

/* A direction is small, and may be delayed, in two cases. Either other equations are preferred to its equation
 * (KT_PREFERRED), or the direction is below one of these limits. The limits are parts of the step's usual size, as
 * small as an equation must be to be replaced, and of the largest possible size of its entries. */
#define SMALL_OF_USUAL (1.0 / 16.0)
#define SMALL_OF_REACH (1.0 / 16.0)

/* squares: the squared size of the direction; `usual`: the step's usual size. */
KT_INLINE bool is_small(const kt_front *f, int32_t equation, double squares, double usual) {
    const double weight = f->w.weight ? f->w.weight[equation] : 1.0;
    const double reach = kt_front_reach(f->model, f->components < KT_FRONT_SPACE, &f->w, equation) *
                         f->w.scale[equation] / fmax(1.0, f->model->length);
    const double small = weight * fmax(SMALL_OF_USUAL * usual, SMALL_OF_REACH * reach);
    return (f->w.weight && weight < KT_PREFERRED) || squares < small * small;
}

/* Factors D' Pi = Q [R1; 0] with pivoting, up to `most` columns. Unless `usual` is NULL, it ends early if only small
 * directions are left and all can be delayed. *first is the squared size of the largest direction of all steps so far.
 * Returns the rank, or -1 if a number is not finite. */
KT_INLINE int factor_rows(const kt_front *f, const kt_qr *d, int most, const double *usual, double *first) {
    const int n = d->m, k = d->k;
    double *norm = f->w.work, all = 0.0;
    int rank = 0;
    for (int c = 0; c < k; c++) {
        const double weight = f->w.weight ? f->w.weight[d->pivot[c]] : 1.0;
        for (int i = 0; i < n; i++)
            d->factor[c * n + i] *= weight;
        norm[c] = kt_dense_dot(d->factor + c * n, d->factor + c * n, n);
        all += norm[c];
    }
    if (!isfinite(all))
        return -1;
    for (; rank < most && rank < n && rank < k; rank++) {
        const int best = kt_longest_column(norm, rank, k, &all);
        *first = kt_larger(*first, norm[best]);
        if (!(norm[best] > f->w.tolerance * f->w.tolerance * *first))
            break;
        if (usual && k - rank <= f->plan->delayed_most && is_small(f, d->pivot[best], norm[best], *usual))
            break;
        kt_qr_step(d, n, rank, best, norm);
    }
    if (f->w.weight)
        kt_qr_unweight(d, n, rank, f->w.weight);
    return rank;
}

/* Takes the equations that earlier steps have delayed, whose rows follow those of the step. */
KT_INLINE void take_delayed(kt_front *f, kt_front_count *count, int n, double *rows, int32_t *pivot) {
    for (int d = 0; f->delaying && d < f->delaying->delayed; d++) {
        const int32_t slot = kt_front_delayed(f, d);
        count->received_row[count->received++] = pivot[count->rows] = f->delaying->delayed_row[d];
        memcpy(rows + count->rows++ * n, kt_front_vector(f, slot), (size_t)n * sizeof *rows);
        kt_front_release(f, slot);
    }
    f->delaying = NULL;
}

/* Passes on the equations that have not been eliminated, except redundant equations. The remainders of these
 * equations are stored in slots. */
KT_INLINE void pass_on(kt_front *f, kt_front_count *count, const kt_front_factor *x, const int32_t *pivot, int rank,
                       double first) {
    const int n = count->params;
    double *early = x->early;
    for (int32_t l = 0; l < f->active_count; l++)
        early += kt_front_vector_count(f, f->active[l]) * rank;
    for (int c = rank; c < count->rows && count->rows - rank <= f->plan->delayed_most; c++) {
        const double *row = x->rows + c * n, weight = f->w.weight ? f->w.weight[pivot[c]] : 1.0;
        if (!(kt_dense_dot(row + rank, row + rank, n - rank) > f->w.tolerance * f->w.tolerance * first))
            continue;
        const int32_t slot = kt_front_delayed(f, count->delayed);
        double *t = kt_front_vector(f, slot);
        for (int j = 0; j < rank; j++)
            *early++ = row[j] / weight;
        for (int i = rank; i < kt_front_padded(n); i++)
            t[i - rank] = i < n ? row[i] / weight : 0.0;
        count->delayed_row[count->delayed++] = pivot[c];
        kt_front_enter(f, slot);
    }
    if (count->delayed)
        f->delaying = count;
}

/* Removes the first of n entries. */
KT_INLINE void shorten(double *x, int first, int n) {
    for (int i = first; i < n; i++)
        x[i - first] = x[i];
}

/* Multiplies the vectors in slots by Q', stores the first `rank` entries in `early`, and removes these from the
 * vectors. */
KT_INLINE void reflect_slots(const kt_front *f, const kt_front_factor *x, int n, int rank) {
    double *early = x->early;
    for (int j = 0; j < rank; j++) {
        kt_front_expand_reflector(x->rows + j * n, j, n, f->spare);
        for (int32_t l = 0; l < f->active_count; l++) {
            double *t = kt_front_vector(f, f->active[l]);
            for (int c = kt_front_vector_count(f, f->active[l]); c > 0; c--, t += f->width)
                kt_front_reflect(f->spare, x->scale[j], n, t);
        }
    }
    for (int32_t l = 0; l < f->active_count && rank; l++) {
        double *t = kt_front_vector(f, f->active[l]);
        for (int c = kt_front_vector_count(f, f->active[l]); c > 0; c--, t += f->width) {
            for (int j = 0; j < rank; j++)
                *early++ = t[j];
            shorten(t, rank, n);
        }
    }
}

static bool is_zero_column(const double *x, int n) {
    int i = 0;
    while (i < n && x[i] == 0.0)
        i++;
    return i == n;
}

/* Copies the vectors in slots that are not zero, one after the other; returns the smaller of their number and n. */
KT_INLINE int copy_coupled(const kt_front *f, int n) {
    const int end = kt_front_padded(n);
    int count = 0;
    for (int32_t l = 0; l < f->active_count; l++) {
        const double *t = kt_front_vector(f, f->active[l]);
        for (int c = kt_front_vector_count(f, f->active[l]); c > 0; c--, t += f->width) {
            double *to = f->copy + count * end;
            if (is_zero_column(t, n))
                continue;
            if (++count >= n)
                return n;
            for (int i = 0; i < end; i++)
                to[i] = i < n ? t[i] : 0.0;
        }
    }
    return count;
}

/* Factors T' = Q [R; 0] of `count` vectors, and replaces these vectors by the reflectors of Q; scale: their scales.
 * Returns the rank. */
KT_INLINE int factor_coupled(const kt_front *f, int count, int n, double *scale) {
    const int end = kt_front_padded(n);
    int rank = 0;
    for (int v = 0; v < count; v++) {
        double *u = f->copy + rank * end, *of = f->copy + v * end, r;
        for (int i = 0; i < end; i++)
            u[i] = i < rank ? 0.0 : of[i];
        scale[rank] = kt_front_make_reflector(u, rank, n, &r);
        if (scale[rank] == 0.0)
            continue;
        for (int w = v + 1; w < count; w++)
            kt_front_reflect(u, scale[rank], n, f->copy + w * end);
        rank++;
    }
    return rank;
}

/* Finds reflectors for n parameters, if the last of Q'p are free. As few reflectors move these, the columns of Q, to
 * the end. */
KT_INLINE void reflect_free(const kt_front *f, const double *scale, int rank, int n, const kt_front_factor *x) {
    const int end = kt_front_padded(n);
    for (int c = 0; c < n - rank; c++) {
        double *u = x->coupled + c * end, r;
        for (int i = 0; i < end; i++)
            u[i] = i == rank + c ? 1.0 : 0.0;
        for (int j = rank - 1; j >= 0; j--)
            kt_front_reflect(f->copy + j * end, scale[j], n, u);
        for (int j = 0; j < c; j++)
            kt_front_reflect(x->coupled + j * end, x->coupled_scale[j], n, u);
        for (int i = n - c; i < n; i++)
            u[i] = 0.0;
        x->coupled_scale[c] = kt_front_make_reflector(u, n - 1 - c, n, &r);
    }
}

/* Reflects the parameters so that only the first of them change the vectors in slots. Returns the number of parameters
 * that change them. */
KT_INLINE int store_coupled_parameters(const kt_front *f, kt_front_count *count, int s) {
    const int n = count->left, vectors = copy_coupled(f, n), end = kt_front_padded(n);
    double *scale = f->z;
    kt_front_factor x;
    if (vectors >= n)
        return n;
    const int kept = factor_coupled(f, vectors, n, scale);
    count->kept = kept;
    count->reflectors = kept < n - kept ? kept : n - kept;
    kt_front_factor_find(f, s, &x);
    if (count->reflectors == kept) {
        memcpy(x.coupled, f->copy, (size_t)(kept * end) * sizeof *x.coupled);
        memcpy(x.coupled_scale, scale, (size_t)kept * sizeof *scale);
    } else {
        reflect_free(f, scale, kept, n, &x);
    }
    for (int32_t l = 0; l < f->active_count; l++) {
        double *t = kt_front_vector(f, f->active[l]);
        for (int c = kt_front_vector_count(f, f->active[l]); c > 0; c--, t += f->width)
            for (int j = 0; j < count->reflectors; j++)
                kt_front_reflect(x.coupled + j * end, x.coupled_scale[j], n, t);
    }
    return kept;
}

/* How the equations are factored. */
typedef struct front_goal {
    bool eliminate, regular;
    const double *usual;
    const int32_t *cap;
    const bool *may_delay;
} front_goal;

/* The counts and sizes that have been found up to a step. */
typedef struct found {
    int params, rank, dropped, pivots;
    double first; /* the squared size of the largest direction */
    double last;  /* the smallest of the last directions, relative to their usual sizes */
} found;

/* The step s; returns false if a number is not finite. */
KT_INLINE bool factor_step(kt_front *f, int s, const front_goal *goal, found *at) {
    const kt_front_step *step = &f->step[s];
    kt_front_count *count = &f->count[s];
    kt_front_factor x;
    double own[KT_DOF_MAX * KT_FRONT_SPACE];
    const int dofs = kt_front_subspace(f, step->link, own), n = at->params + dofs;
    int32_t *pivot = f->w.pivot + at->pivots;
    extend(f, at->params, dofs);
    *count = (kt_front_count){.params = n, .first = at->pivots};
    kt_front_factor_find(f, s, &x);
    form_link_vectors(f, step, own, dofs, at->params, x.motion);
    take_terms(f, step, at->params);
    count->rows = complete_loops(f, step, n, x.rows, pivot);
    if (count->rows)
        take_delayed(f, count, n, x.rows, pivot);
    kt_front_release_last_uses(f, step);
    kt_front_factor_find(f, s, &x);
    if (count->rows && goal->eliminate) {
        const double *usual = goal->may_delay[s] && !goal->regular ? goal->usual + s : NULL;
        const kt_qr d = {.m = n, .k = count->rows, .factor = x.rows, .pivot = pivot, .reflector_scale = x.scale};
        const int rank = factor_rows(f, &d, goal->cap[s] - at->rank - at->dropped, usual, &at->first);
        if (rank < 0)
            return false;
        count->rank = rank;
        count->last = rank ? fabs(x.rows[(rank - 1) * (n + 1)]) : 0.0;
        if (rank && count->last < at->last * goal->usual[s])
            at->last = count->last / goal->usual[s];
        while (goal->regular && count->rank > 0 &&
               fabs(x.rows[(count->rank - 1) * (n + 1)]) < KT_NEAR_SINGULAR * goal->usual[s])
            count->rank--;
        at->rank += count->rank;
        at->dropped += rank - count->rank;
        reflect_slots(f, &x, n, count->rank);
        if (usual)
            pass_on(f, count, &x, pivot, rank, at->first);
    }
    at->pivots += count->rows - count->delayed;
    count->vectors = count_vectors(f);
    count->left = n - count->rank;
    at->params = count->kept = store_coupled_parameters(f, count, s);
    return true;
}

KT_INLINE bool factor_steps(kt_front *f, const front_goal *goal, found *at) {
    bool finite = true;
    for (int s = 0; s < f->group->link_count && finite; s++)
        finite = factor_step(f, s, goal, at);
    return finite;
}

int KT_KERNEL(kt_front_factor)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    kt_front f;
    kt_front_find(model, data, g, rows, &f);
    const size_t first = (size_t)rows * model->n.front + (size_t)f.plan->step;
    const front_goal goal = {.eliminate = true,
                             .regular = regular,
                             .usual = model->front_usual + first,
                             .cap = model->front_cap + first,
                             .may_delay = model->front_may_delay + first};
    found at = {.first = f.w.least * f.w.least, .last = (double)INFINITY};
    data->factored[g] = rows;
    data->last[g] = 0.0;
    data->near[g] = false;
    data->rank[g] = 0;
    const bool finite = factor_steps(&f, &goal, &at);
    if (!finite)
        return -1;
    const int rank = at.rank + at.dropped;
    data->last[g] = rank ? at.last : 0.0;
    data->near[g] = rank < f.group->rank[rows] || (rank && at.last < KT_NEAR_SINGULAR);
    data->rank[g] = at.rank;
    return rank;
}

double KT_KERNEL(kt_front_measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    kt_front f;
    const front_goal goal = {.eliminate = false};
    found at = {.last = (double)INFINITY};
    data->factored[g] = rows;
    kt_front_find(model, data, g, rows, &f);
    (void)factor_steps(&f, &goal, &at);
    double sum = 0.0;
    for (int s = 0; s < f.group->link_count; s++) {
        const kt_front_count *count = &f.count[s];
        kt_front_factor x;
        kt_front_factor_find(&f, s, &x);
        for (int r = 0; r < count->rows; r++) {
            const double scale = f.w.scale[f.w.pivot[count->first + r]], *row = x.rows + r * count->params;
            sum += kt_dense_dot(row, row, count->params) / (scale * scale);
        }
    }
    return sum;
}
