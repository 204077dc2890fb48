/* Groups of few equations by the Delassus matrix: delassus.h. */
#include "reduction/delassus.h"

#include "reduction/front_link.h"

#include <float.h>

/* The part of a row that is orthogonal to those before it, relative to its length, above which C is found from A A'.
 * That squares the condition: C then is exact to 1e-10. The rows' own lengths do not matter: scaling them changes no
 * digit of A A'. */
#define SMALL 1e-3

typedef struct sweep {
    kt_front f;
    kt_delassus d;
    const kt_model *model;
    kt_data *data;
    const double *unit; /* of a damped step: of coordinates; or NULL */
    int count;          /* equations, in the order of the steps: */
    struct {
        const kt_loop_record *loop;
        int32_t slot, step;
    } row[KT_DELASSUS_MAX];
} sweep;

/* The step that completes a loop. */
static int32_t step_of(const kt_front *f, const kt_loop_record *loop) {
    int32_t last = -1;
    for (int k = 0; k < (loop->term_count ? loop->term_count : 2); k++) {
        const int32_t link = loop->term_count ? f->model->term[loop->term + k].link : loop->link[k];
        const int32_t step = kt_front_step_of(f, link);
        last = step > last ? step : last;
    }
    return last;
}

static bool is_wanted(const sweep *s, int32_t slot, bool independent) {
    return independent ? !s->f.w.weight || s->f.w.weight[slot] != 1.0
                       : kt_front_reach(s->model, s->f.components < KT_FRONT_SPACE, &s->f.w, slot) > 0.0;
}

/* The equations: of all that are not void, or of the independent ones, which are all or those that have been chosen at
 * generic positions. Returns false if they are more than that, or the independent ones fewer. */
static bool find(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool independent, sweep *s) {
    s->model = model;
    s->data = data;
    s->unit = NULL;
    s->count = 0;
    kt_front_find(model, data, g, rows, &s->f);
    kt_delassus_find(model, data, g, &s->d);
    const int32_t begin = s->f.step[0].loop, most = independent ? s->f.group->rank[rows] : KT_DELASSUS_MAX;
    for (int32_t l = begin; l < begin + s->f.group->loop_count; l++) {
        const kt_loop_record *loop = &model->loop[model->front_loop[l]];
        const int32_t *slot = kt_rows_slots(s->f.model, s->f.group, loop);
        for (int r = 0; r < loop->row_count; r++) {
            if (!kt_front_counts(&s->f, slot[r]) || !is_wanted(s, slot[r], independent))
                continue;
            if (s->count == most)
                return false;
            s->row[s->count].loop = loop;
            s->row[s->count].slot = slot[r];
            s->row[s->count++].step = step_of(&s->f, loop);
        }
    }
    return !independent || s->count == most;
}

/* Over all lanes. */
KT_INLINE double dot(kt_v4 a, kt_v4 b) {
    const kt_v4 x = a * b;
    return (x[0] + x[1]) + (x[2] + x[3]);
}

/* ---- wrenches on the links, joint forces of relations ------------------------------------------------------------ */

/* Adds wrenches to those that a link has to receive. */
KT_INLINE void store(const sweep *s, int32_t link, int components, const kt_v4 *x) {
    const int32_t local = s->model->link[link].local;
    kt_v4 *to = s->d.load + KT_FRONT_SPACE * local;
    const bool more = s->d.given[local] & KT_DELASSUS_WRENCH;
    for (int c = 0; c < components; c++)
        to[c] = more ? to[c] + x[c] : x[c];
    s->d.given[local] |= KT_DELASSUS_WRENCH;
}

/* Adds sign times W C of a loop to its links. */
static void place_wrenches(const sweep *s, int r, double sign) {
    const kt_front *f = &s->f;
    kt_v4 x[KT_FRONT_SPACE];
    for (int k = 0; k < 2; k++) {
        const int32_t link = s->row[r].loop->link[k];
        if (link == f->group->parent)
            continue;
        const kt_v4 columns = kt_v4_splat(sign) * s->d.transform[r];
        const double *w = kt_front_wrench(f, s->row[r].slot, k);
        for (int c = 0; c < f->components; c++)
            x[c] = kt_v4_splat(w[c]) * columns;
        store(s, link, f->components, x);
    }
}

/* The joint forces of relations on a link's one degree of freedom. */
KT_INLINE kt_v4 force_on(const sweep *s, int32_t local) {
    return s->d.given[local] & KT_DELASSUS_FORCE ? s->d.column[local] : kt_v4_splat(0.0);
}

/* Adds the joint forces of a relation; those of planar revolute joints are about n. */
static void place_forces(const sweep *s, int r) {
    const kt_loop_record *loop = s->row[r].loop;
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &s->model->term[loop->term + k];
        double coefficient = term->coefficient;
        if (s->f.components == KT_FRONT_SPACE / 2) {
            const kt_planar_link *planar = &s->model->planar[kt_planar_index_shift(s->model, term->link)];
            coefficient *= planar->revolute ? planar->sign : 1.0;
        }
        const int32_t local = s->model->link[term->link].local;
        s->d.column[local] = force_on(s, local) + kt_v4_splat(coefficient) * s->d.transform[r];
        s->d.given[local] |= KT_DELASSUS_FORCE;
    }
}

/* sign times W C on the loops' links, and the joint forces of relations in the columns. */
static void place_loads(const sweep *s, double sign) {
    memset(s->d.given, 0, (size_t)s->f.w.m);
    for (int r = 0; r < s->count; r++)
        if (s->row[r].loop->term_count)
            place_forces(s, r);
        else
            place_wrenches(s, r, sign);
}

/* A wrench of each column, on a link about its origin. */
typedef struct wrenches {
    kt_v4 x[KT_FRONT_SPACE];
} wrenches;

/* What link i receives: from the link after it, if that is its child (`from_child`), and what has been stored. */
KT_INLINE void receive(const sweep *s, int32_t i, int components, bool from_child, wrenches *p) {
    const int32_t local = s->model->link[i].local;
    const bool has = s->d.given[local] & KT_DELASSUS_WRENCH;
    const kt_v4 *stored = s->d.load + KT_FRONT_SPACE * local;
    for (int c = 0; c < components && !from_child; c++)
        p->x[c] = kt_v4_splat(0.0);
    for (int c = 0; c < components && has; c++)
        p->x[c] += stored[c];
}

/* To the origin of the parent: n += r x f. Wrenches that are not for the link before are stored. */
KT_INLINE void pass_on(const sweep *s, int32_t up, kt_v4 r, int components, bool from_child, wrenches *p) {
    kt_wrench_shift_of4(components, r, p->x);
    if (!from_child && up != 0)
        store(s, up, components, p->x);
}

/* S . p of an axis; of a planar revolute joint about n, whatever its sign. */
KT_INLINE kt_v4 along(const sweep *s, int32_t i, int components, const wrenches *p) {
    const kt_v4 *x = p->x;
    if (components == KT_FRONT_SPACE / 2) {
        const int32_t k = kt_planar_index_shift(s->model, i);
        const kt_planar_link *link = &s->model->planar[k];
        double u[2];
        if (link->revolute)
            return x[0];
        kt_planar_along(link, &s->data->planar[k], u);
        return kt_v4_splat(u[0]) * x[1] + kt_v4_splat(u[1]) * x[2];
    }
    const kt_link *link = &s->model->link[i];
    const kt_v4 e = kt_link_axis(link, &s->data->motion[i]), ex = kt_v4_splat(e[0]), ey = kt_v4_splat(e[1]),
                ez = kt_v4_splat(e[2]);
    const kt_v4 n = ex * x[0] + ey * x[1] + ez * x[2];
    if (link->motion == KT_MOTION_REVOLUTE)
        return n;
    const kt_v4 force = ex * x[3] + ey * x[4] + ez * x[5];
    return link->motion == KT_MOTION_SCREW ? n + kt_v4_splat(kt_link_pitch(link)) * force : force;
}

/* ---- C ----------------------------------------------------------------------------------------------------------- */

static void add_square(kt_v4 u, double weight, kt_v4 *square) {
    for (int r = 0; r < KT_DELASSUS_MAX; r++)
        square[r] += kt_v4_splat(u[r] * weight) * u;
}

/* Zero for a coordinate that counts as a constant, otherwise its unit. */
KT_INLINE kt_v4 unit_of(const sweep *s, int32_t local) {
    return kt_v4_splat(s->f.fixed[local] ? 0.0 : s->unit ? s->unit[local] : 1.0);
}

/* A A', and the rows of A' as columns; if `units`, of coordinates in these. */
KT_INLINE void square_rows(const sweep *s, int components, bool units, kt_v4 *square) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    wrenches p;
    bool from_child = false;
    for (int l = s->f.group->link_count - 1; l >= 0; l--) {
        const int32_t i = link[l], up = s->model->link[i].parent;
        receive(s, i, components, from_child, &p);
        const int dofs = s->model->link[i].motion == KT_MOTION_SPHERICAL ? 3 : 1;
        for (int c = 0; c < dofs; c++) {
            const int32_t local = s->model->link[i].local + c;
            kt_v4 row = dofs == 1 ? force_on(s, local) + along(s, i, components, &p) : p.x[c];
            row = units ? row * unit_of(s, local) : row;
            s->d.column[local] = row;
            add_square(row, 1.0, square);
        }
        from_child = l > 0 && up == link[l - 1];
        pass_on(s, up, kt_front_offset(&s->f, i), components, from_child, &p);
    }
}

static __attribute__((noinline)) void square_in_units(const sweep *s, kt_v4 *square) {
    square_rows(s, s->f.components, true, square);
}

/* x' G y */
static double product(const kt_v4 *g, kt_v4 x, kt_v4 y) {
    kt_v4 sum = kt_v4_splat(0.0);
    for (int r = 0; r < KT_DELASSUS_MAX; r++)
        sum += kt_v4_splat(x[r]) * g[r];
    return dot(sum, y);
}

/* The columns of C for the equations from `begin` to `end`, after those before, by Gram and Schmidt with the scalar
 * product of G = A A': the longest remainder first. *first is the squared size of the largest so far. Returns the size
 * of the last, 0 if that is not clear. */
static double orthonormalise(const kt_v4 *g, int begin, int end, double tolerance, kt_v4 *c, double *first) {
    bool taken[KT_DELASSUS_MAX] = {false};
    double last = 0.0;
    for (int n = begin; n < end; n++) {
        double most = 0.0;
        int best = -1;
        kt_v4 column = kt_v4_splat(0.0);
        for (int j = begin; j < end; j++) {
            kt_v4 e = kt_v4_splat(0.0);
            if (taken[j])
                continue;
            e[j] = 1.0;
            for (int i = 0; i < n; i++)
                e -= kt_v4_splat(product(g, c[i], e)) * c[i];
            const double length = product(g, e, e);
            if (length > most) {
                most = length;
                best = j;
                column = e;
            }
        }
        *first = fmax(*first, most);
        if (best < 0 || !(most > SMALL * SMALL * g[best][best] && most > tolerance * tolerance * *first))
            return 0.0;
        last = sqrt(most);
        taken[best] = true;
        c[n] = column / kt_v4_splat(last);
    }
    return last;
}

/* C in columns, for the loops in the order of the steps. Returns the smallest of the steps' last directions relative to
 * their usual sizes, 0 if one is not clear. */
static double orthonormalise_steps(const sweep *s, kt_rows rows, const kt_v4 *g, kt_v4 *c) {
    const double *usual = s->model->front_usual + (size_t)rows * s->model->n.front + s->f.plan->step;
    double first = s->f.w.least * s->f.w.least, least = (double)INFINITY;
    for (int begin = 0, end = 0; begin < s->count && least > 0.0; begin = end) {
        const int32_t step = s->row[begin].step;
        while (end < s->count && s->row[end].step == step)
            end++;
        least = fmin(least, orthonormalise(g, begin, end, s->f.w.tolerance, c, &first) / usual[step]);
    }
    return least;
}

bool KT_KERNEL(kt_delassus_prepare)(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    kt_v4 square[KT_DELASSUS_MAX], c[KT_DELASSUS_MAX];
    sweep s;
    if (!find(model, data, g, rows, true, &s))
        return false;
    for (int r = 0; r < KT_DELASSUS_MAX; r++) {
        square[r] = c[r] = s.d.transform[r] = kt_v4_splat(0.0);
        s.d.transform[r][r] = 1.0;
    }
    place_loads(&s, 1.0);
    if (memchr(s.f.fixed, 1, (size_t)s.f.w.m))
        square_in_units(&s, square);
    else if (s.f.components == KT_FRONT_SPACE / 2)
        square_rows(&s, KT_FRONT_SPACE / 2, false, square);
    else
        square_rows(&s, KT_FRONT_SPACE, false, square);
    const double last = orthonormalise_steps(&s, rows, square, c);
    if (!(last > KT_NEAR_SINGULAR) || !isfinite(last))
        return false;
    for (int r = 0; r < KT_DELASSUS_MAX; r++)
        for (int n = 0; n < KT_DELASSUS_MAX; n++)
            s.d.transform[r][n] = c[n][r];
    data->factored[g] = rows;
    data->near[g] = false;
    data->last[g] = last;
    data->rank[g] = model->group[g].rank[rows];
    return true;
}

/* A' lambda; of a damped step, in the coordinates' own units. */
static void take_steps(const sweep *s, kt_v4 lambda, double *step) {
    const kt_model *model = s->model;
    for (int l = 0; l < s->f.group->link_count; l++) {
        const int32_t i = model->group_link[s->f.group->link + l];
        const kt_link *link = &model->link[i];
        const kt_v4 *row = s->d.column + link->local;
        double *x = step + link->v;
        x[0] = dot(row[0], lambda) * (s->unit ? s->unit[link->local] : 1.0);
        if (s->f.components == KT_FRONT_SPACE / 2) {
            const kt_planar_link *planar = &model->planar[kt_planar_index_shift(model, i)];
            x[0] *= planar->revolute ? planar->sign : 1.0;
        } else if (link->motion == KT_MOTION_SPHERICAL) {
            const kt_v4 world = {x[0], dot(row[1], lambda), dot(row[2], lambda), 0.0};
            for (int c = 0; c < 3; c++)
                x[c] = kt_v4_dot(s->data->motion[i].axes[c], world);
        }
    }
}

void KT_KERNEL(kt_delassus_least)(const kt_model *model, kt_data *data, size_t g, double *step) {
    kt_v4 mu = kt_v4_splat(0.0), lambda = mu;
    sweep s;
    (void)find(model, data, g, data->factored[g], true, &s);
    for (int r = 0; r < s.count; r++)
        mu += kt_v4_splat(s.f.w.right[s.row[r].slot]) * s.d.transform[r];
    for (int r = 0; r < s.count; r++)
        lambda[r] = dot(s.d.transform[r], mu);
    take_steps(&s, lambda, step);
}

/* ---- S and mu ---------------------------------------------------------------------------------------------------- */

/* S, and B' M^-1 f. */
typedef struct sums {
    kt_v4 square[KT_DELASSUS_MAX], force;
} sums;

KT_INLINE const kt_front_motion *motion_of(const sweep *s, int32_t link) {
    return &s->data->front_motion[s->f.group->v + s->model->link[link].local];
}

KT_INLINE void add_dof(const sweep *s, int32_t local, kt_v4 u, double inverse, double free, sums *to) {
    s->d.column[local] = u;
    s->d.inverse[local] = inverse;
    add_square(u, inverse, to->square);
    to->force += u * kt_v4_splat(free);
}

/* One link in a plane; its parent accelerates by `at`. */
KT_INLINE void take_planar(const sweep *s, int32_t i, const kt_v4 at, wrenches *p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_planar_response *response = &s->data->planar_response[kt_planar_index_shift(s->model, i)];
    const double *gain = response->gain_linear;
    const kt_v4 u = force_on(s, local) - along(s, i, KT_FRONT_SPACE / 2, p);
    add_dof(s, local, u, s->d.inverse[local], response->free - (gain[0] * at[0] + gain[1] * at[1]), to);
    pass_on(s, 0, kt_front_offset(&s->f, i), KT_FRONT_SPACE / 2, true, p);
    p->x[0] += kt_v4_splat(response->gain_angular) * u;
    p->x[1] += kt_v4_splat(gain[0]) * u;
    p->x[2] += kt_v4_splat(gain[1]) * u;
}

KT_INLINE void take_axis(const sweep *s, int32_t i, kt_v4 alpha, kt_v4 linear, wrenches *p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_response *response = &s->data->response[i];
    const kt_v4 n = response->gain_angular, f = response->gain_linear;
    const kt_v4 u = force_on(s, local) - along(s, i, KT_FRONT_SPACE, p);
    add_dof(s, local, u, s->d.inverse[local], n[3] - kt_v4_dot2(n, alpha, f, linear), to);
    pass_on(s, 0, s->data->motion[i].offset, KT_FRONT_SPACE, true, p);
    for (int c = 0; c < 3; c++) {
        p->x[c] += kt_v4_splat(n[c]) * u;
        p->x[c + 3] += kt_v4_splat(f[c]) * u;
    }
}

/* u = -n: of the rotations, with L y = u and z = L^-T y / D; f += G z, n = 0. `alpha`, `linear`: the link's own. */
KT_INLINE void take_spherical(const sweep *s, int32_t i, kt_v4 alpha, kt_v4 linear, wrenches *p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_articulated *kept = &s->data->articulated[s->model->link[i].articulated];
    const kt_v4 l = kept->j[0], e = kept->j[1];
    const kt_v4 free = kt_solve3(l, e, kept->moment - kt_v4_apply_transposed(kept->g, linear)) - alpha;
    kt_v4 u[3], y[3], z[3];
    for (int c = 0; c < 3; c++) {
        u[c] = -p->x[c];
        s->d.column[local + c] = u[c];
        to->force += u[c] * kt_v4_splat(free[c]);
        p->x[c] = kt_v4_splat(0.0);
    }
    y[0] = u[0];
    y[1] = u[1] - kt_v4_splat(l[0]) * y[0];
    y[2] = u[2] - kt_v4_splat(l[1]) * y[0] - kt_v4_splat(l[2]) * y[1];
    for (int c = 0; c < 3; c++) {
        add_square(y[c], e[c], to->square);
        z[c] = y[c] * kt_v4_splat(e[c]);
    }
    z[1] -= kt_v4_splat(l[2]) * z[2];
    z[0] -= kt_v4_splat(l[0]) * z[1] + kt_v4_splat(l[1]) * z[2];
    for (int c = 0; c < 3; c++)
        p->x[c + 3] +=
            kt_v4_splat(kept->g[0][c]) * z[0] + kt_v4_splat(kept->g[1][c]) * z[1] + kt_v4_splat(kept->g[2][c]) * z[2];
    pass_on(s, 0, s->data->motion[i].offset, KT_FRONT_SPACE, true, p);
}

/* The same of one with armature, its degrees of freedom one after the other (kt_project_armature). The wrenches are
 * passed by value, so that those of the others stay in registers. */
static __attribute__((noinline)) wrenches take_armature(const sweep *s, int32_t i, kt_v4 alpha, kt_v4 linear,
                                                        wrenches p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_link_motion *m = &s->data->motion[i];
    kt_articulated *kept = &s->data->articulated[s->model->link[i].articulated];
    for (int k = 2; k >= 0; k--) {
        const kt_v4 n = *kt_armature_gain(kept, 2 * k), f = *kt_armature_gain(kept, 2 * k + 1), e = m->axes[k];
        const kt_v4 u = -(kt_v4_splat(e[0]) * p.x[0] + kt_v4_splat(e[1]) * p.x[1] + kt_v4_splat(e[2]) * p.x[2]);
        add_dof(s, local + k, u, n[3], kept->moment[k] - kt_v4_dot2(n, alpha, f, linear), to);
        for (int c = 0; c < 3; c++) {
            p.x[c] += kt_v4_splat(n[c]) * u;
            p.x[c + 3] += kt_v4_splat(f[c]) * u;
        }
    }
    pass_on(s, 0, m->offset, KT_FRONT_SPACE, true, &p);
    return p;
}

/* ground: its acceleration, minus gravity. */
KT_INLINE void sum_columns(const sweep *s, int components, kt_v4 ground, sums *to) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    const kt_front_motion rest = {.alpha = kt_v4_splat(0.0), .linear = kt_v4_splat(0.0)};
    wrenches p;
    bool from_child = false;
    for (int l = s->f.group->link_count - 1; l >= 0; l--) {
        const int32_t i = link[l], up = s->model->link[i].parent;
        const kt_front_motion *from = up ? motion_of(s, up) : &rest, *own = motion_of(s, i);
        receive(s, i, components, from_child, &p);
        if (components == KT_FRONT_SPACE / 2)
            take_planar(s, i, from->linear + ground, &p, to);
        else if (s->model->link[i].motion != KT_MOTION_SPHERICAL)
            take_axis(s, i, from->alpha, from->linear + ground, &p, to);
        else if (s->model->link[i].has_armature)
            p = take_armature(s, i, own->alpha, own->linear + ground, p, to);
        else
            take_spherical(s, i, own->alpha, own->linear + ground, &p, to);
        from_child = l > 0 && up == link[l - 1];
        if (!from_child && up != 0)
            store(s, up, components, p.x);
    }
}

/* S mu = b by Cholesky's method; false if S is not positive definite. */
static bool solve_multipliers(kt_v4 *a, int k, kt_v4 *b) {
    for (int j = 0; j < k; j++) {
        for (int i = 0; i < j; i++)
            a[j] -= kt_v4_splat(a[i][j]) * a[i];
        if (!(a[j][j] > 0.0) || !isfinite(a[j][j]))
            return false;
        a[j] /= kt_v4_splat(sqrt(a[j][j])); /* row j of L' */
        double sum = (*b)[j];
        for (int i = 0; i < j; i++)
            sum -= a[i][j] * (*b)[i];
        (*b)[j] = sum / a[j][j];
    }
    for (int j = k - 1; j >= 0; j--) {
        for (int i = j + 1; i < k; i++)
            (*b)[j] -= a[j][i] * (*b)[i];
        (*b)[j] /= a[j][j];
    }
    return true;
}

/* Adds the accelerations that B mu gives to the joints' free ones. */
KT_INLINE void add_responses(const sweep *s, bool planar, kt_v4 mu) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    for (int l = 0; l < s->f.group->link_count; l++) {
        const int32_t i = link[l], local = s->model->link[i].local;
        const double x = dot(s->d.column[local], mu);
        if (planar) {
            s->data->planar_response[kt_planar_index_shift(s->model, i)].free += s->d.inverse[local] * x;
        } else if (s->model->link[i].motion == KT_MOTION_SPHERICAL) {
            const bool has_armature = s->model->link[i].has_armature;
            const kt_v4 one = kt_v4_splat(1.0), inverse = has_armature ? kt_load3(s->d.inverse + local) : one;
            const double y = dot(s->d.column[local + 1], mu), z = dot(s->d.column[local + 2], mu);
            s->data->articulated[s->model->link[i].articulated].moment += inverse * (kt_v4){x, y, z, 0.0};
        } else {
            s->data->response[i].gain_angular[3] += s->d.inverse[local] * x;
        }
    }
}

bool KT_KERNEL(kt_delassus_solve)(const kt_model *model, kt_data *data, size_t g, const double *gravity) {
    sums to = {.force = kt_v4_splat(0.0)};
    kt_v4 mu = kt_v4_splat(0.0);
    sweep s;
    (void)find(model, data, g, data->factored[g], true, &s);
    const bool planar = s.f.components == KT_FRONT_SPACE / 2;
    place_loads(&s, -1.0);
    if (planar)
        sum_columns(&s, KT_FRONT_SPACE / 2, (kt_v4){-gravity[0], -gravity[1], 0.0, 0.0}, &to);
    else
        sum_columns(&s, KT_FRONT_SPACE, data->motion[0].linear, &to);
    for (int r = 0; r < s.count; r++)
        mu += kt_v4_splat(s.f.w.right[s.row[r].slot]) * s.d.transform[r];
    mu -= to.force;
    if (!solve_multipliers(to.square, s.count, &mu))
        return false;
    memset(s.f.w.multiplier, 0, (size_t)s.f.w.k * sizeof *s.f.w.multiplier);
    for (int r = 0; r < s.count; r++)
        s.f.w.multiplier[s.row[r].slot] = dot(s.d.transform[r], mu);
    if (planar)
        add_responses(&s, true, mu);
    else
        add_responses(&s, false, mu);
    return true;
}

/* ---- damped steps ------------------------------------------------------------------------------------------------ */

bool KT_KERNEL(kt_delassus_measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, double *size) {
    kt_v4 square[KT_DELASSUS_MAX];
    sweep s;
    if (!find(model, data, g, rows, false, &s))
        return false;
    s.unit = model->unit + s.f.group->v;
    for (int r = 0; r < KT_DELASSUS_MAX; r++) {
        square[r] = s.d.transform[r] = kt_v4_splat(0.0);
        if (r < s.count)
            s.d.transform[r][r] = 1.0 / s.f.w.scale[s.row[r].slot];
    }
    place_loads(&s, 1.0);
    square_in_units(&s, square);
    *size = (square[0][0] + square[1][1]) + (square[2][2] + square[3][3]);
    memcpy(s.d.transform, square, sizeof square);
    data->factored[g] = rows;
    return true;
}

bool KT_KERNEL(kt_delassus_damp)(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,
                                 double *step) {
    kt_v4 square[KT_DELASSUS_MAX], lambda = kt_v4_splat(0.0);
    sweep s;
    (void)find(model, data, g, data->factored[g], false, &s);
    s.unit = model->unit + s.f.group->v;
    memcpy(square, s.d.transform, sizeof square);
    for (int r = 0; r < s.count; r++) {
        const int32_t slot = s.row[r].slot;
        square[r][r] += damping;
        lambda[r] = -gap[slot] / s.f.w.scale[slot];
    }
    if (!solve_multipliers(square, s.count, &lambda))
        return false;
    take_steps(&s, lambda, step);
    return true;
}
