/* Elimination of a constraint group link by link: front.h. */
#include "reduction/front.h"

#include "reduction/front_link.h"
#include "reduction/householder.h"

#include <math.h>
#include <string.h>

/* ---- the factors of the equations -------------------------------------------------------------------------------- */

/* Lengthens what slots hold from n parameters to n + more, by zeros. */
KT_INLINE void extend(const kt_front *f, int n, int more) {
    for (int32_t l = 0; l < f->live_count; l++) {
        double *x = kt_front_vector(f, f->live[l]);
        for (int c = kt_front_vector_count(f, f->live[l]); c > 0; c--, x += f->width)
            for (int i = n; i < n + more; i++)
                x[i] = 0.0;
    }
}

/* T_i = [shift(T_parent) S_i], the parent's with n parameters. */
KT_INLINE void take_link(kt_front *f, const kt_front_step *step, const double *s, int dofs, int n, double *kept) {
    const int c = f->components, width = f->width, all = n + dofs;
    const kt_v4 r = kt_front_offset(f, step->link);
    const double *up = step->up < 0 ? NULL : kt_front_vector(f, step->up);
    double *own = kt_front_vector(f, (int32_t)(step - f->step));
    for (int i = 0; i < n; i++) {
        double x[KT_FRONT_SPACE];
        for (int k = 0; k < c; k++)
            x[k] = up ? up[k * width + i] : 0.0;
        kt_front_shift(c, r, x);
        for (int k = 0; k < c; k++)
            own[k * width + i] = x[k];
    }
    for (int d = 0; d < dofs; d++)
        for (int k = 0; k < c; k++)
            own[k * width + n + d] = s[d * c + k];
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
            memset(x, 0, (size_t)(n + 1) * sizeof *x);
            kt_front_enter(f, slot);
        }
        x[n] += f->fixed[local] ? 0.0 : f->model->term[term->term].coefficient;
    }
}

/* D' of the equations that the step completes, n parameters; their indices in `pivot`. Returns their number. */
KT_INLINE int complete_loops(const kt_front *f, const kt_front_step *step, int n, double *rows, int32_t *pivot) {
    const int c = f->components;
    int count = 0;
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const int32_t index = f->model->front_loop[i];
        const kt_loop_record *loop = &f->model->loop[index];
        const int32_t *slot = kt_front_slots(f, loop);
        for (int r = 0; r < loop->row_count; r++) {
            double *d = rows + count * n;
            if (!kt_front_counts(f, slot[r]))
                continue;
            pivot[count++] = slot[r];
            if (loop->term_count) {
                memcpy(d, kt_front_vector(f, kt_front_relation_of(f, step, index)), (size_t)n * sizeof *d);
                continue;
            }
            memset(d, 0, (size_t)n * sizeof *d);
            for (int k = 0; k < 2; k++) {
                const int32_t at = kt_front_step_of(f, loop->link[k]);
                const double *w = kt_front_wrench(f, slot[r], k);
                for (int j = 0; j < c && at >= 0; j++) {
                    const double *t = kt_front_vector(f, at) + j * f->width;
                    for (int p = 0; p < n; p++)
                        d[p] += w[j] * t[p];
                }
            }
        }
    }
    return count;
}

/* Releases the slots of relations that are complete and of links on which nothing depends any more. */
KT_INLINE void leave(kt_front *f, const kt_front_step *step) {
    for (int i = step->loop; i < step->loop + step->loop_count; i++)
        if (f->model->loop[f->model->front_loop[i]].term_count)
            kt_front_release(f, kt_front_relation_of(f, step, f->model->front_loop[i]));
    for (int i = step->leave; i < step->leave + step->leave_count; i++)
        kt_front_release(f, f->model->front_leave[i]);
}

static int count_vectors(const kt_front *f) {
    int count = 0;
    for (int32_t l = 0; l < f->live_count; l++)
        count += kt_front_vector_count(f, f->live[l]);
    return count;
}

/* A direction is small, and may be passed on, if others are preferred to its equation (KT_PREFERRED), and below these
 * parts of its step's usual size, as small as an equation must be to be replaced, and of what its entries could be. */
#define SMALL_OF_USUAL (1.0 / 16.0)
#define SMALL_OF_REACH (1.0 / 16.0)

KT_INLINE bool is_small(const kt_front *f, int32_t equation, double squares, double usual) {
    const double weight = f->w.weight ? f->w.weight[equation] : 1.0;
    const double reach = kt_front_reach(f->model, f->components < KT_FRONT_SPACE, &f->w, equation) *
                         f->w.scale[equation] / fmax(1.0, f->model->length);
    const double small = weight * fmax(SMALL_OF_USUAL * usual, SMALL_OF_REACH * reach);
    return (f->w.weight && weight < KT_PREFERRED) || squares < small * small;
}

/* D' Pi = Q [R1; 0] with pivoting, up to `most` columns; unless `usual` is NULL it ends early where only small directions
 * are left and all can be passed on. *first is the squared size of the largest direction of all steps so far. Returns
 * the rank, or -1 if a number is not finite. */
KT_INLINE int factor_rows(const kt_front *f, const kt_group_work *d, int most, const double *usual, double *first) {
    const int n = d->m, k = d->k;
    double *norm = f->w.work, all = 0.0;
    int rank = 0;
    for (int c = 0; c < k; c++) {
        const double weight = f->w.weight ? f->w.weight[d->pivot[c]] : 1.0;
        for (int i = 0; i < n; i++)
            d->factor[c * n + i] *= weight;
        norm[c] = kt_squares(d->factor + c * n, 0, n);
        all += norm[c];
    }
    if (!isfinite(all))
        return -1;
    for (; rank < most && rank < n && rank < k; rank++) {
        const int best = kt_longest_column(norm, rank, k, &all);
        *first = kt_larger(*first, norm[best]);
        if (!(norm[best] > KT_RANK_TOLERANCE * KT_RANK_TOLERANCE * *first))
            break;
        if (usual && k - rank <= f->plan->pending && is_small(f, d->pivot[best], norm[best], *usual))
            break;
        if (best != rank) {
            const double norm_of = norm[rank];
            kt_swap_columns(d, n, rank, best);
            norm[rank] = norm[best];
            norm[best] = norm_of;
        }
        kt_eliminate(d, n, rank, norm);
    }
    for (int c = 0; c < rank && f->w.weight; c++) {
        const double weight = f->w.weight[d->pivot[c]];
        for (int i = 0; i <= c; i++)
            d->factor[c * n + i] /= weight;
    }
    return rank;
}

/* Takes the equations that earlier steps have passed on, whose rows follow those of the step. */
KT_INLINE void take_passed(kt_front *f, kt_front_count *count, int n, double *rows, int32_t *pivot) {
    for (int d = 0; f->passing && d < f->passing->passed; d++) {
        const int32_t slot = kt_front_pending(f, d);
        count->wait[count->waiting++] = pivot[count->rows] = f->passing->pass[d];
        memcpy(rows + count->rows++ * n, kt_front_vector(f, slot), (size_t)n * sizeof *rows);
        kt_front_release(f, slot);
    }
    f->passing = NULL;
}

/* Passes the equations on that have not been eliminated, but for those that are redundant here: what is left of them, in slots. */
KT_INLINE void pass_on(kt_front *f, kt_front_count *count, const kt_front_factor *x, const int32_t *pivot, int rank,
                       double first) {
    const int n = count->params;
    double *early = x->early;
    for (int32_t l = 0; l < f->live_count; l++)
        early += kt_front_vector_count(f, f->live[l]) * rank;
    for (int c = rank; c < count->rows && count->rows - rank <= f->plan->pending; c++) {
        const double *row = x->rows + c * n, weight = f->w.weight ? f->w.weight[pivot[c]] : 1.0;
        if (!(kt_squares(row, rank, n) > KT_RANK_TOLERANCE * KT_RANK_TOLERANCE * first))
            continue;
        const int32_t slot = kt_front_pending(f, count->passed);
        double *t = kt_front_vector(f, slot);
        for (int j = 0; j < rank; j++)
            *early++ = row[j] / weight;
        for (int i = rank; i < n; i++)
            t[i - rank] = row[i] / weight;
        count->pass[count->passed++] = pivot[c];
        kt_front_enter(f, slot);
    }
    if (count->passed)
        f->passing = count;
}

/* Multiplies what slots hold by Q', stores the first `rank` entries in `early` and removes them. */
KT_INLINE void reflect_slots(const kt_front *f, const kt_front_factor *x, int n, int rank) {
    double *early = x->early;
    for (int32_t l = 0; l < f->live_count; l++) {
        double *t = kt_front_vector(f, f->live[l]);
        for (int c = kt_front_vector_count(f, f->live[l]); c > 0; c--, t += f->width) {
            for (int j = 0; j < rank; j++)
                kt_reflect(x->rows + j * n, x->scale[j], j, n, t);
            for (int j = 0; j < rank; j++)
                *early++ = t[j];
            for (int i = rank; i < n; i++)
                t[i - rank] = t[i];
        }
    }
}

static bool is_zero(const double *x, int n) {
    for (int i = 0; i < n; i++)
        if (x[i] != 0.0)
            return false;
    return true;
}

/* Reflects the parameters such that all but the first of them, whose number is returned, change nothing that slots
 * hold. */
KT_INLINE int keep_seen(const kt_front *f, const kt_front_factor *x, int n) {
    int count = 0, kept = 0;
    for (int32_t l = 0; l < f->live_count; l++) {
        const double *t = kt_front_vector(f, f->live[l]);
        for (int c = kt_front_vector_count(f, f->live[l]); c > 0; c--, t += f->width)
            count += !is_zero(t, n);
    }
    if (count >= n)
        return n;
    for (int32_t l = 0; l < f->live_count; l++) {
        double *t = kt_front_vector(f, f->live[l]);
        for (int c = kt_front_vector_count(f, f->live[l]); c > 0; c--, t += f->width) {
            double *u = x->seen + kept * n;
            for (int j = 0; j < kept; j++)
                kt_reflect(x->seen + j * n, x->seen_scale[j], j, n, t);
            if (is_zero(t + kept, n - kept))
                continue;
            const double length = sqrt(kt_squares(t, kept, n)), r = t[kept] > 0.0 ? -length : length, u0 = t[kept] - r;
            if (!(length > 0.0)) { /* the squares underflow */
                for (int i = kept; i < n; i++)
                    t[i] = 0.0;
                continue;
            }
            for (int i = kept + 1; i < n; i++) {
                u[i] = t[i] / u0;
                t[i] = 0.0;
            }
            x->seen_scale[kept++] = -u0 / r;
            t[kept - 1] = r;
        }
    }
    return kept;
}

/* How the equations are factored. */
typedef struct front_goal {
    bool eliminate, regular;
    const double *usual;
    const int32_t *cap;
    const bool *waits;
} front_goal;

/* What has been found up to a step. */
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
    take_link(f, step, own, dofs, at->params, x.motion);
    take_terms(f, step, at->params);
    count->rows = complete_loops(f, step, n, x.rows, pivot);
    if (count->rows)
        take_passed(f, count, n, x.rows, pivot);
    leave(f, step);
    kt_front_factor_find(f, s, &x);
    if (count->rows && goal->eliminate) {
        const double *usual = goal->waits[s] && !goal->regular ? goal->usual + s : NULL;
        const kt_group_work d = {.m = n, .k = count->rows, .factor = x.rows, .pivot = pivot, .reflector = x.scale};
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
    at->pivots += count->rows - count->passed;
    count->vectors = count_vectors(f);
    kt_front_factor_find(f, s, &x);
    count->left = n - count->rank;
    at->params = count->kept = keep_seen(f, &x, count->left);
    return true;
}

KT_INLINE bool factor_steps(kt_front *f, const front_goal *goal, found *at) {
    bool finite = true;
    for (int s = 0; s < f->group->link_count && finite; s++)
        finite = factor_step(f, s, goal, at);
    return finite;
}

int KT_KERNEL(kt_front_factor)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular) {
    kt_front f;
    kt_front_find(model, data, g, rows, &f);
    const size_t first = (size_t)rows * model->n.front + (size_t)f.plan->step;
    const front_goal goal = {.eliminate = true,
                             .regular = regular,
                             .usual = model->front_usual + first,
                             .cap = model->front_cap + first,
                             .waits = model->front_waits + first};
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
            const double scale = f.w.scale[f.w.pivot[count->first + r]];
            sum += kt_squares(x.rows + r * count->params, 0, count->params) / (scale * scale);
        }
    }
    return sum;
}

/* ---- the energy -------------------------------------------------------------------------------------------------- */

/* H becomes G H G for the reflector G = 1 - t u u', u = (1, tail) from entry `at` on, of `all` entries; g becomes G g,
 * and the sizes of the terms on the diagonal of H those of the sums. */
KT_INLINE void reflect_energy(const kt_front *f, const double *tail, double t, int at, int all) {
    const int level = f->level;
    double *h = f->energy, *w = f->spare, d, sum;
    for (int c = 0; c < all; c++) {
        const double *x = h + c * level + at;
        sum = x[0];
        for (int i = 1; i < all - at; i++)
            sum += tail[i] * x[i];
        w[c] = t * sum;
    }
    d = w[at];
    for (int i = 1; i < all - at; i++)
        d += tail[i] * w[at + i];
    d *= 0.5 * t;
    w[at] -= d;
    for (int i = 1; i < all - at; i++)
        w[at + i] -= d * tail[i];
    for (int c = 0; c < all; c++) {
        const double u = c < at ? 0.0 : c == at ? 1.0 : tail[c - at];
        double *x = h + c * level;
        for (int i = 0; i < at; i++)
            x[i] -= w[i] * u;
        x[at] -= w[at] * u + w[c];
        for (int i = 1; i < all - at; i++)
            x[at + i] -= w[at + i] * u + tail[i] * w[c];
    }
    double *g = f->pull + at, *size = f->size + at, whole = size[0];
    sum = g[0];
    for (int i = 1; i < all - at; i++) {
        sum += tail[i] * g[i];
        whole += tail[i] * tail[i] * size[i];
    }
    sum *= t;
    g[0] -= sum;
    size[0] = size[0] * (1.0 - 2.0 * t) + t * t * whole;
    for (int i = 1; i < all - at; i++) {
        const double square = t * tail[i] * tail[i];
        g[i] -= sum * tail[i];
        size[i] = size[i] * (1.0 - 2.0 * square) + t * square * whole;
    }
}

/* Adds n parameters after `all`. */
KT_INLINE void extend_energy(const kt_front *f, int all, int more) {
    for (int c = 0; c < all + more; c++)
        for (int i = c < all ? all : 0; i < all + more; i++)
            f->energy[c * f->level + i] = 0.0;
    for (int i = all; i < all + more; i++)
        f->pull[i] = f->size[i] = 0.0;
}

/* Removes `count` parameters from `at` on. */
KT_INLINE void remove_params(const kt_front *f, int at, int count, int all) {
    const int level = f->level;
    for (int c = 0; c < all; c++) {
        if (c >= at && c < at + count)
            continue;
        const double *from = f->energy + c * level;
        double *to = f->energy + (c < at ? c : c - count) * level;
        for (int i = 0; i < at && c >= at; i++)
            to[i] = from[i];
        for (int i = at + count; i < all; i++)
            to[i - count] = from[i];
    }
    for (int i = at + count; i < all; i++) {
        f->pull[i - count] = f->pull[i];
        f->size[i - count] = f->size[i];
    }
}

/* Adds the energy of a link: T' IA T, and the forces -T' (IA t + bias). Parameters: the parent's acceleration if `base`,
 * then n. */
KT_INLINE void weigh_link(const kt_front *f, const kt_front_step *step, const double *motion, int base, int n,
                          const double *constant) {
    const int c = f->components, level = f->level, all = base + n;
    double inertia[KT_FRONT_SPACE * KT_FRONT_SPACE], bias[KT_FRONT_SPACE], *t = f->product;
    kt_front_inertia(f, step->link, inertia, bias);
    for (int k = 0; k < c; k++)
        for (int j = 0; j < c; j++)
            bias[k] += inertia[j * c + k] * constant[j];
    for (int i = 0; i < base; i++) { /* the parent's acceleration, at the link's origin */
        for (int k = 0; k < c; k++)
            t[i * c + k] = i == k ? 1.0 : 0.0;
        kt_front_shift(c, f->data->front_motion[f->group->v + f->model->link[step->link].local].point, t + i * c);
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < c; k++)
            t[(base + i) * c + k] = motion[k * n + i];
    for (int i = 0; i < all; i++) {
        double force[KT_FRONT_SPACE] = {0.0}, size = 0.0, pull = 0.0;
        for (int j = 0; j < c; j++)
            for (int k = 0; k < c; k++)
                force[k] += inertia[j * c + k] * t[i * c + j];
        for (int k = 0; k < c; k++) {
            pull += t[i * c + k] * bias[k];
            size += t[i * c + k] * t[i * c + k] * inertia[k * (c + 1)];
        }
        f->pull[i] -= pull;
        f->size[i] += size;
        for (int j = i; j < all; j++) {
            double sum = 0.0;
            for (int k = 0; k < c; k++)
                sum += force[k] * t[j * c + k];
            f->energy[i * level + j] += sum;
            if (j > i)
                f->energy[j * level + i] += sum;
        }
    }
}

/* t of a link: that of its parent, shifted. */
KT_INLINE void carry_constant(const kt_front *f, const kt_front_step *step) {
    const int c = f->components;
    double *own = kt_front_constant(f, (int32_t)(step - f->step)), x[KT_FRONT_SPACE];
    const double *up = step->up < 0 ? NULL : kt_front_constant(f, step->up);
    for (int k = 0; k < c; k++)
        x[k] = up ? up[k] : 0.0;
    if (up)
        kt_front_shift(c, kt_front_offset(f, step->link), x);
    memcpy(own, x, (size_t)c * sizeof *own);
}

/* The part of the equation `row` that is constant in the parameters. */
KT_INLINE double constant_of(const kt_front *f, const kt_front_step *step, const kt_loop_record *loop, int32_t index,
                             int32_t row) {
    double sum = 0.0;
    if (loop->term_count)
        return *kt_front_constant(f, kt_front_relation_of(f, step, index));
    for (int k = 0; k < 2; k++) {
        const int32_t slot = kt_front_step_of(f, loop->link[k]);
        const double *w = kt_front_wrench(f, row, k), *t = kt_front_constant(f, slot < 0 ? 0 : slot);
        for (int c = 0; c < f->components && slot >= 0; c++)
            sum += w[c] * t[c];
    }
    return sum;
}

/* e of all equations that the step completes, in f->spare by their order there; see complete_loops. Then R1' y = e. */
KT_INLINE void find_y(const kt_front *f, int s, const kt_front_factor *x) {
    const kt_front_step *step = &f->step[s];
    const int rank = f->count[s].rank, n = f->count[s].params;
    const int32_t *pivot = f->w.pivot + f->count[s].first;
    for (int d = 0; d < f->count[s].waiting; d++)
        for (int j = 0; j < rank; j++)
            if (pivot[j] == f->count[s].wait[d])
                x->y[j] = f->w.right[pivot[j]] - *kt_front_constant(f, kt_front_pending(f, d));
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const int32_t index = f->model->front_loop[i];
        const kt_loop_record *loop = &f->model->loop[index];
        const int32_t *slot = kt_front_slots(f, loop);
        for (int r = 0; r < loop->row_count; r++)
            for (int j = 0; j < rank && slot[r] >= 0; j++)
                if (pivot[j] == slot[r])
                    x->y[j] = f->w.right[slot[r]] - constant_of(f, step, loop, index, slot[r]);
    }
    for (int j = 0; j < rank; j++) {
        double sum = x->y[j];
        for (int i = 0; i < j; i++)
            sum -= x->rows[j * n + i] * x->y[i];
        x->y[j] = sum / x->rows[j * (n + 1)];
    }
}

/* The constants of equations that the step passes on begin with those that they have had before it. */
KT_INLINE void pass_constants(kt_front *f, int s) {
    const kt_front_step *step = &f->step[s];
    const kt_front_count *count = &f->count[s];
    double constant[KT_FRONT_PENDING] = {0.0};
    for (int d = 0; d < count->passed; d++) {
        for (int e = 0; e < count->waiting; e++)
            if (count->wait[e] == count->pass[d])
                constant[d] = *kt_front_constant(f, kt_front_pending(f, e));
        for (int i = step->loop; i < step->loop + step->loop_count; i++) {
            const int32_t index = f->model->front_loop[i];
            const kt_loop_record *loop = &f->model->loop[index];
            const int32_t *slot = kt_front_slots(f, loop);
            for (int r = 0; r < loop->row_count; r++)
                if (slot[r] == count->pass[d])
                    constant[d] = constant_of(f, step, loop, index, slot[r]);
        }
    }
    for (int d = 0; d < count->waiting; d++)
        kt_front_release(f, kt_front_pending(f, d));
    for (int d = 0; d < count->passed; d++) {
        *kt_front_constant(f, kt_front_pending(f, d)) = constant[d];
        kt_front_enter(f, kt_front_pending(f, d));
    }
}

/* Keeps `columns` columns of the energy from entry `at` on, `rows` of each, if they are asked for. */
KT_INLINE void keep_energy(const kt_front *f, int at, int columns, int from, int rows) {
    for (int c = at; f->kept && c < at + columns; c++, *f->kept += rows)
        memcpy(*f->kept, f->energy + c * f->level + from, (size_t)rows * sizeof **f->kept);
}

/* Puts p = Q (y, p2) into the energy. */
KT_INLINE void impose(const kt_front *f, int s, const kt_front_factor *x, int base) {
    const int n = f->count[s].params, rank = f->count[s].rank, all = base + n, level = f->level;
    for (int j = 0; j < rank; j++)
        reflect_energy(f, x->rows + j * n + j, x->scale[j], base + j, all);
    keep_energy(f, base, rank, 0, all);
    for (int j = 0; j < rank; j++)
        for (int i = 0; i < all; i++)
            f->pull[i] -= f->energy[(base + j) * level + i] * x->y[j];
    remove_params(f, base, rank, all);
}

/* Adds T y of the first parameters to the constants of the slots in use. */
KT_INLINE void carry_y(const kt_front *f, const kt_front_factor *x, int rank) {
    const double *early = x->early;
    for (int32_t l = 0; l < f->live_count; l++) {
        double *t = kt_front_constant(f, f->live[l]);
        for (int c = 0; c < kt_front_vector_count(f, f->live[l]); c++, early += rank)
            for (int j = 0; j < rank; j++)
                t[c] += early[j] * x->y[j];
    }
}

/* Adds the squares of the violations (D p + gap) / scale, halved. */
KT_INLINE void add_violations(const kt_front *f, int s, const kt_front_factor *x, const double *gap) {
    const int n = f->count[s].params, level = f->level;
    const int32_t *pivot = f->w.pivot + f->count[s].first;
    for (int r = 0; r < f->count[s].rows; r++) {
        const double *d = x->rows + r * n, scale = f->w.scale[pivot[r]];
        for (int i = 0; i < n; i++) {
            const double di = d[i] / scale;
            f->pull[i] -= di * (gap[pivot[r]] / scale);
            for (int j = 0; j < n; j++)
                f->energy[i * level + j] += di * (d[j] / scale);
        }
    }
}

/* A = L L' in the lower triangle of n x n numbers of the energy from entry `at` on; false if A is not positive definite
 * beyond rounding errors (dense.h). */
KT_INLINE bool factor_energy(const kt_front *f, int at, int n, bool judge) {
    double *a = f->energy + at * (f->level + 1);
    for (int j = 0; j < n; j++) {
        double *column = a + j * f->level;
        const double whole = judge ? f->size[at + j] : column[j];
        for (int k = 0; k < j; k++) {
            const double x = a[k * f->level + j];
            for (int i = j; i < n; i++)
                column[i] -= a[k * f->level + i] * x;
        }
        if (!(column[j] > 1e-14 * whole))
            return false;
        const double d = 1.0 / sqrt(column[j]);
        for (int i = j; i < n; i++)
            column[i] *= d;
    }
    return true;
}

KT_INLINE void solve_energy(const kt_front *f, int at, int n, double *x) {
    const double *l = f->energy + at * (f->level + 1);
    const int level = f->level;
    for (int j = 0; j < n; j++) {
        x[j] /= l[j * (level + 1)];
        for (int i = j + 1; i < n; i++)
            x[i] -= l[j * level + i] * x[j];
    }
    for (int j = n - 1; j >= 0; j--) {
        for (int i = j + 1; i < n; i++)
            x[j] -= l[j * level + i] * x[i];
        x[j] /= l[j * (level + 1)];
    }
}

/* Minimises over the parameters that nothing sees: p_u = gain_0 - gain (A, p_t). */
KT_INLINE bool minimise(const kt_front *f, int s, const kt_front_factor *x, int base, bool judge) {
    const kt_front_count *count = &f->count[s];
    const int t = base + count->kept, u = count->left - count->kept, all = t + u, level = f->level;
    double *h = f->energy;
    if (u <= 0)
        return true;
    for (int j = 0; j < count->kept; j++)
        reflect_energy(f, x->seen + j * count->left + j, x->seen_scale[j], base + j, all);
    if (!factor_energy(f, t, u, judge))
        return false;
    keep_energy(f, t, u, t, u);
    memcpy(x->gain, f->pull + t, (size_t)u * sizeof *x->gain);
    solve_energy(f, t, u, x->gain);
    for (int c = 0; c < t; c++) {
        double *k = x->gain + (c + 1) * u;
        memcpy(k, h + c * level + t, (size_t)u * sizeof *k);
        solve_energy(f, t, u, k);
    }
    for (int c = 0; c < t; c++) {
        const double *coupling = h + c * level + t;
        for (int i = 0; i < u; i++)
            f->pull[c] -= coupling[i] * x->gain[i];
        for (int d = c; d < t; d++) {
            const double *k = x->gain + (d + 1) * u;
            double sum = 0.0;
            for (int i = 0; i < u; i++)
                sum += coupling[i] * k[i];
            h[c * level + d] -= sum;
            if (d > c)
                h[d * level + c] -= sum;
        }
    }
    return true;
}

/* Adds the energy of the rotors of a link, whose coordinates are parameters from `at` on. */
static __attribute__((noinline)) void add_armature(const kt_front *f, const kt_link *link, int at) {
    for (int d = 0; d < kt_link_dofs(link); d++) {
        const double armature = f->model->armature[link->v + d];
        f->energy[(at + d) * (f->level + 1)] += armature;
        f->size[at + d] += armature;
    }
}

/* Adds the energy of a link's own coordinates, and for dynamics all of its energy. */
KT_INLINE void add_link(const kt_front *f, int s, const kt_front_factor *x, const kt_front_aim *aim, int base,
                        int first, bool geared) {
    const kt_front_step *step = &f->step[s];
    const kt_link *link = &f->model->link[step->link];
    const int dofs = f->count[s].params - first;
    extend_energy(f, base + first, dofs);
    if (aim->kind == KT_FRONT_DYNAMICS)
        weigh_link(f, step, x->motion, base, f->count[s].params, kt_front_constant(f, s));
    if (geared && aim->kind == KT_FRONT_DYNAMICS)
        add_armature(f, link, base + first);
    for (int d = 0; d < dofs; d++) {
        const int at = base + first + d;
        const double unit = f->model->unit[f->group->v + link->local + d];
        if (aim->kind == KT_FRONT_DYNAMICS)
            f->pull[at] += f->w.bias[link->local + d] = aim->tau[link->v + d];
        else
            f->energy[at * (f->level + 1)] = aim->kind == KT_FRONT_DAMPED ? aim->damping / (unit * unit) : 1.0;
    }
}

/* The constants of relations begin with zero. */
KT_INLINE void enter_terms(kt_front *f, const kt_front_step *step) {
    for (int i = step->term; i < step->term + step->term_count; i++) {
        const int32_t slot = f->group->link_count + f->model->front_term[i].slot;
        if (!f->model->front_term[i].first)
            continue;
        *kt_front_constant(f, slot) = 0.0;
        kt_front_enter(f, slot);
    }
}

KT_INLINE bool reduce_steps(kt_front *f, const kt_front_aim *aim, int base, bool geared) {
    const bool dynamics = aim->kind == KT_FRONT_DYNAMICS;
    int params = 0;
    extend_energy(f, 0, base);
    for (int s = 0; s < f->group->link_count; s++) {
        const kt_front_step *step = &f->step[s];
        const kt_front_count *count = &f->count[s];
        kt_front_factor x;
        kt_front_factor_find(f, s, &x);
        carry_constant(f, step);
        kt_front_enter(f, s);
        enter_terms(f, step);
        add_link(f, s, &x, aim, base, params, geared);
        if (aim->kind == KT_FRONT_DAMPED)
            add_violations(f, s, &x, aim->gap);
        if (count->rank)
            find_y(f, s, &x);
        if (count->waiting || count->passed)
            pass_constants(f, s);
        leave(f, step);
        if (count->rank) {
            impose(f, s, &x, base);
            carry_y(f, &x, count->rank);
        }
        if (!minimise(f, s, &x, base, dynamics))
            return false;
        params = count->kept;
    }
    return true;
}

static __attribute__((noinline)) bool reduce_geared(kt_front *f, const kt_front_aim *aim, int base) {
    return reduce_steps(f, aim, base, true);
}

bool KT_KERNEL(kt_front_reduce)(const kt_model *model, kt_data *data, size_t g, const kt_front_aim *aim,
                                kt_front_total *total) {
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    f.kept = aim->kept;
    const int base = aim->base ? f.components : 0;
    const bool done = model->geared ? reduce_geared(&f, aim, base) : reduce_steps(&f, aim, base, false);
    for (int c = 0; c < base && done; c++) {
        total->bias[c] = -f.pull[c];
        memcpy(total->inertia + c * base, f.energy + c * f.level, (size_t)base * sizeof(double));
    }
    return done;
}

/* ---- the backward pass ------------------------------------------------------------------------------------------- */

/* p of a step before its changes of parameters, from those after them; the parent's acceleration, of `base` components,
 * comes first. */
KT_INLINE void substitute(const kt_front *f, int s, int base, double *z) {
    const kt_front_count *count = &f->count[s];
    const int kept = count->kept, left = count->left, rank = count->rank, n = count->params, u = left - kept;
    kt_front_factor x;
    double *p = z + base;
    kt_front_factor_find(f, s, &x);
    for (int i = 0; i < u; i++) {
        double sum = x.gain[i];
        for (int c = 0; c < base + kept; c++)
            sum -= x.gain[(c + 1) * u + i] * z[c];
        p[kept + i] = sum;
    }
    for (int j = kept - 1; j >= 0 && u; j--)
        kt_reflect(x.seen + j * left, x.seen_scale[j], j, left, p);
    if (!rank)
        return;
    for (int i = left - 1; i >= 0; i--)
        p[rank + i] = p[i];
    memcpy(p, x.y, (size_t)rank * sizeof *p);
    for (int j = rank - 1; j >= 0; j--)
        kt_reflect(x.rows + j * n, x.scale[j], j, n, p);
}

void KT_KERNEL(kt_front_respond)(const kt_model *model, kt_data *data, size_t g, const double *base, double *step) {
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    const int count = base ? f.components : 0;
    for (int c = 0; c < count; c++)
        f.z[c] = base[c];
    for (int s = f.group->link_count - 1; s >= 0; s--) {
        substitute(&f, s, count, f.z);
        (void)kt_front_take_coordinates(&f, s, f.z + count, step);
    }
}
