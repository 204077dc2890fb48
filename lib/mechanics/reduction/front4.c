/* Fronts of at most four parameters in a plane: front4.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front4.h"

#include "reduction/front_link.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* An active link: T' and t. */
typedef struct front4_link {
    kt_v4 motion[3];
    double constant[3];
} front4_link;

typedef struct front4 {
    kt_front f;
    kt_front4_step *kept;
    front4_link link[KT_FRONT4_SLOTS]; /* by slots */
    uint32_t open;                     /* slots in use, as bits */
    kt_v4 energy[KT_FRONT4_PARAMS], pull, size;
    double last; /* the smallest of the last directions relative to their usual sizes */
} front4;

static const kt_v4 unit[KT_FRONT4_PARAMS] = {
    {1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}, {0.0, 0.0, 0.0, 1.0}};
static const kt_v4 first_three = {1.0, 1.0, 1.0, 0.0};

/* Over four lanes. */
KT_INLINE double dot(kt_v4 a, kt_v4 b) {
    const kt_v4 x = a * b;
    return (x[0] + x[1]) + (x[2] + x[3]);
}

/* x = sum a_i r_i */
KT_INLINE kt_v4 combine(kt_v4 a, const kt_v4 r[KT_FRONT4_PARAMS]) {
    return (kt_v4_splat(a[0]) * r[0] + kt_v4_splat(a[1]) * r[1]) +
           (kt_v4_splat(a[2]) * r[2] + kt_v4_splat(a[3]) * r[3]);
}

/* Adds the energy T' IA T of a link, and the forces -T' (IA t + bias). */
KT_INLINE void apply_link_inertia(front4 *s, const kt_planar_inertia *x, const front4_link *own) {
    const double ta = own->constant[0], tb = own->constant[1], tc = own->constant[2];
    const kt_v4 a = own->motion[0], b = own->motion[1], c = own->motion[2];
    const kt_v4 j = kt_v4_splat(x->j), hx = kt_v4_splat(x->h[0]), hy = kt_v4_splat(x->h[1]);
    const kt_v4 xx = kt_v4_splat(x->xx), xy = kt_v4_splat(x->xy), yy = kt_v4_splat(x->yy);
    const kt_v4 fa = j * a + (hx * b + hy * c), fb = hx * a + (xx * b + xy * c), fc = hy * a + (xy * b + yy * c);
    for (int i = 0; i < KT_FRONT4_PARAMS; i++)
        s->energy[i] += kt_v4_splat(a[i]) * fa + (kt_v4_splat(b[i]) * fb + kt_v4_splat(c[i]) * fc);
    const double na = x->moment + (x->j * ta + (x->h[0] * tb + x->h[1] * tc));
    const double nb = x->force[0] + (x->h[0] * ta + (x->xx * tb + x->xy * tc));
    const double nc = x->force[1] + (x->h[1] * ta + (x->xy * tb + x->yy * tc));
    s->pull -= a * kt_v4_splat(na) + (b * kt_v4_splat(nb) + c * kt_v4_splat(nc));
    s->size += a * a * j + (b * b * xx + c * c * yy);
}

/* Takes a link, whose coordinate is parameter n, and adds its energy and its force; without tau, the square of the
 * coordinate. has_armature is a constant at each use, so that models without armature have code of their own. */
KT_INLINE void add_front4_link(front4 *s, const kt_front_step *step, int n, const double *tau, bool has_armature) {
    const int32_t k = step->link + s->f.model->to_planar;
    const kt_planar_link *link = &s->f.model->planar[k];
    const kt_planar_motion *m = &s->f.data->planar[k];
    const kt_v4 own = unit[n];
    kt_v4 a = {0.0}, b = a, c = a;
    double ta = 0.0, tb = 0.0, tc = 0.0, u[2];
    if (step->up >= 0) {
        const front4_link *up = &s->link[s->f.step[step->up].slot];
        const double rx = m->offset[0], ry = m->offset[1];
        a = up->motion[0];
        b = up->motion[1] - kt_v4_splat(ry) * a;
        c = up->motion[2] + kt_v4_splat(rx) * a;
        ta = up->constant[0];
        tb = up->constant[1] - ry * ta;
        tc = up->constant[2] + rx * ta;
    }
    if (link->revolute) {
        a += kt_v4_splat(link->sign) * own;
    } else {
        kt_planar_along(link, m, u);
        b += kt_v4_splat(u[0]) * own;
        c += kt_v4_splat(u[1]) * own;
    }
    s->link[step->slot] = (front4_link){.motion = {a, b, c}, .constant = {ta, tb, tc}};
    s->open |= 1U << step->slot;
    if (tau) {
        apply_link_inertia(s, &s->f.data->planar_inertia[k], &s->link[step->slot]);
        s->pull += kt_v4_splat(tau[link->v]) * own;
    }
    if (!tau || has_armature) {
        const kt_v4 inertia = own * kt_v4_splat(tau ? link->armature : 1.0);
        s->energy[n] += inertia;
        s->size += inertia;
    }
}

/* The equations that a step completes: D and e. Returns their number. */
KT_INLINE int complete_loops(const front4 *s, const kt_front_step *step, kt_v4 *d, double *e) {
    int count = 0;
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const kt_loop_record *loop = &s->f.model->loop[s->f.model->front_loop[i]];
        const int32_t *slot = s->f.model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++) {
            if (!kt_front_counts(&s->f, slot[r]))
                continue;
            d[count] = kt_v4_splat(0.0);
            e[count] = s->f.w.right[slot[r]];
            for (int k = 0; k < 2; k++) {
                const int32_t at = kt_front_step_of(&s->f, loop->link[k]);
                if (at < 0)
                    continue;
                const double *w = kt_front_wrench(&s->f, slot[r], k);
                const front4_link *link = &s->link[s->f.step[at].slot];
                for (int c = 0; c < KT_FRONT_SPACE / 2; c++) {
                    d[count] += kt_v4_splat(w[c]) * link->motion[c];
                    e[count] -= w[c] * link->constant[c];
                }
            }
            count++;
        }
    }
    return count;
}

/* The reflector 1 - t u u' that maps x, whose entries before j are zero, onto r times the j-th unit vector. */
typedef struct reflector {
    kt_v4 u;
    double t, r, length;
} reflector;

KT_INLINE reflector reflector_of(kt_v4 x, int j) {
    const double length = sqrt(dot(x, x)), r = x[j] > 0.0 ? -length : length;
    return (reflector){
        .u = x - kt_v4_splat(r) * unit[j], .t = 1.0 / (length * (length + fabs(x[j]))), .r = r, .length = length};
}

KT_INLINE kt_v4 reflect(const reflector *h, kt_v4 x) { return x - kt_v4_splat(h->t * dot(h->u, x)) * h->u; }

/* p0 and Z for D p = e. Returns the size of the last direction. */
KT_INLINE double factor(int rank, int n, kt_v4 *d, double *e, kt_front4_step *out) {
    if (rank == 2 && dot(d[1], d[1]) > dot(d[0], d[0])) {
        const kt_v4 row = d[0];
        const double right = e[0];
        d[0] = d[1], d[1] = row;
        e[0] = e[1], e[1] = right;
    }
    const reflector first = reflector_of(d[0], 0);
    const double y = e[0] / first.r;
    if (rank == 1) {
        out->particular = reflect(&first, kt_v4_splat(y) * unit[0]);
        for (int i = 1; i < n; i++)
            out->basis[i - 1] = reflect(&first, unit[i]);
        return first.length;
    }
    const kt_v4 row = reflect(&first, d[1]);
    const reflector second = reflector_of(row - kt_v4_splat(row[0]) * unit[0], 1);
    const kt_v4 solution = {y, (e[1] - row[0] * y) / second.r, 0.0, 0.0};
    out->particular = reflect(&first, reflect(&second, solution));
    for (int i = 2; i < n; i++)
        out->basis[i - 2] = reflect(&first, reflect(&second, unit[i]));
    return second.length;
}

/* p = p0 + Z p2 in the active links and the energy; `left` parameters remain. */
KT_INLINE void impose(front4 *s, const kt_front4_step *kept, int left) {
    const kt_v4 none = kt_v4_splat(0.0), *z = kept->basis, p = kept->particular;
    kt_v4 r[KT_FRONT4_PARAMS], product[KT_FRONT4_PARAMS], pull = none, size = none,
                                                          energy[KT_FRONT4_PARAMS] = {none, none, none, none};
    for (int i = 0; i < KT_FRONT4_PARAMS; i++)
        r[i] = (kt_v4){z[0][i], z[1][i], z[2][i], p[i]};
    for (uint32_t open = s->open; open; open &= open - 1) {
        front4_link *link = &s->link[__builtin_ctz(open)];
        for (int c = 0; c < KT_FRONT_SPACE / 2; c++) {
            const kt_v4 x = combine(link->motion[c], r);
            link->motion[c] = x * first_three;
            link->constant[c] += x[3];
        }
    }
    for (int i = 0; i < KT_FRONT4_PARAMS; i++) {
        product[i] = combine(s->energy[i], r);
        pull += kt_v4_splat(s->pull[i] - product[i][3]) * r[i];
        size += kt_v4_splat(s->size[i]) * (r[i] * r[i]);
    }
    for (int j = 0; j < left; j++)
        energy[j] = first_three * combine(z[j], product);
    s->pull = pull * first_three;
    s->size = size * first_three;
    for (int i = 0; i < KT_FRONT4_PARAMS; i++)
        s->energy[i] = energy[i];
}

/* Computes p = H^-1 g of n parameters by Cholesky's method. Returns false if the inertia along a parameter does not
 * exceed rounding errors (maggi_kane.h). */
static bool minimise_parameters(const front4 *s, int n, kt_v4 *out) {
    double l[KT_FRONT4_PARAMS][KT_FRONT4_PARAMS], x[KT_FRONT4_PARAMS] = {0.0};
    for (int j = 0; j < n; j++) {
        for (int i = j; i < n; i++) {
            l[i][j] = s->energy[i][j];
            for (int k = 0; k < j; k++)
                l[i][j] -= l[i][k] * l[j][k];
        }
        if (!(l[j][j] > 1e-14 * s->size[j]))
            return false;
        const double d = sqrt(l[j][j]);
        for (int i = j; i < n; i++)
            l[i][j] /= d;
        x[j] = s->pull[j];
        for (int k = 0; k < j; k++)
            x[j] -= l[j][k] * x[k];
        x[j] /= l[j][j];
    }
    for (int j = n - 1; j >= 0; j--) {
        for (int i = j + 1; i < n; i++)
            x[j] -= l[i][j] * x[i];
        x[j] /= l[j][j];
    }
    *out = (kt_v4){x[0], x[1], x[2], x[3]};
    return true;
}

/* A step: takes a link, completes its loops, and minimises if no link remains open. *n is the number of parameters
 * before and after. Returns false near a singular position, or if an inertia is not positive. */
KT_INLINE bool advance(front4 *s, int at, const double *usual, const double *tau, bool has_armature, int *n) {
    const kt_front_step *step = &s->f.step[at];
    kt_front4_step *kept = &s->kept[at];
    kt_v4 d[KT_FRONT4_ROWS];
    double e[KT_FRONT4_ROWS];
    add_front4_link(s, step, *n, tau, has_armature);
    kept->params = ++*n;
    kept->rank = complete_loops(s, step, d, e);
    for (int i = step->last_use; i < step->last_use + step->last_use_count; i++)
        s->open &= ~(1U << s->f.step[s->f.model->front_last_use[i]].slot);
    if (kept->rank) {
        kept->basis[0] = kept->basis[1] = kept->basis[2] = kt_v4_splat(0.0);
        const double size = factor(kept->rank, *n, d, e, kept) / usual[at];
        if (!(size > KT_NEAR_SINGULAR))
            return false;
        s->last = size < s->last ? size : s->last;
        *n -= kept->rank;
        impose(s, kept, *n);
    }
    kept->ends = !s->open;
    if (!kept->ends)
        return true;
    if (!minimise_parameters(s, *n, &kept->last))
        return false;
    *n = 0;
    for (int i = 0; i < KT_FRONT4_PARAMS; i++)
        s->energy[i] = kt_v4_splat(0.0);
    s->pull = s->size = kt_v4_splat(0.0);
    return true;
}

KT_INLINE bool advance_all(front4 *s, const double *usual, const double *tau, bool has_armature) {
    int n = 0;
    for (int at = 0; at < s->f.group->link_count; at++)
        if (!advance(s, at, usual, tau, has_armature, &n))
            return false;
    return true;
}

static __attribute__((noinline)) bool advance_armature(front4 *s, const double *usual, const double *tau) {
    return advance_all(s, usual, tau, true);
}

/* The backward pass: from the last step to the first, the parameters p of each step follow from those of the step
 * after, and the last parameter of a step is the acceleration of its coordinate. */
static void respond_to_front4(const front4 *s, double *a) {
    kt_v4 p = kt_v4_splat(0.0);
    for (int at = s->f.group->link_count - 1; at >= 0; at--) {
        const kt_front4_step *kept = &s->kept[at];
        double last[KT_FRONT4_PARAMS];
        if (kept->ends)
            p = kept->last;
        if (kept->rank)
            p = (kept->particular + kt_v4_splat(p[0]) * kept->basis[0]) +
                (kt_v4_splat(p[1]) * kept->basis[1] + kt_v4_splat(p[2]) * kept->basis[2]);
        memcpy(last, &p, sizeof last);
        a[s->f.model->link[s->f.step[at].link].v] = last[kept->params - 1];
    }
}

bool KT_KERNEL(kt_front4_solve)(const kt_model *model, kt_data *data, size_t g, const double *tau, double *a) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(model->group[g].form == KT_FORM_FRONT4);
    front4 s;
    const kt_rows rows = data->factored[g];
    kt_front_find(model, data, g, rows, &s.f);
    const double *usual = model->front_usual + (size_t)rows * model->n.front + s.f.plan->step;
    s.kept = (kt_front4_step *)(void *)s.f.w.front; /* groups' matrices begin at multiples of eight numbers */
    s.open = 0;
    s.last = (double)INFINITY;
    s.pull = s.size = kt_v4_splat(0.0);
    for (int i = 0; i < KT_FRONT4_PARAMS; i++)
        s.energy[i] = kt_v4_splat(0.0);
    if (!(model->has_armature ? advance_armature(&s, usual, tau) : advance_all(&s, usual, tau, false)))
        return false;
    data->near[g] = false;
    data->last[g] = s.last;
    data->rank[g] = s.f.group->rank[rows];
    respond_to_front4(&s, a);
    return true;
}
