/* Groups of few equations by the Delassus matrix: delassus.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/delassus.h"

#include "reduction/front_link.h"

#include <assert.h>

/* C is computed from A A' if each row has a part orthogonal to earlier rows that exceeds this fraction of its
 * length. A A' squares the condition, so that C is exact to 1e-10. The rows' own lengths do not matter: scaling them
 * changes no digit of A A'. */
#define SMALL 1e-3

/* The constants for which the sweeps are compiled: 3 or 6 components of wrenches, and the number of equations. For one
 * state, the vector always has all four equations. */
typedef struct shape {
    int components, equations;
} shape;

enum { ALL = KT_DELASSUS_MAX };

/* ---- the equations ----------------------------------------------------------------------------------------------- */

typedef struct sweep {
    kt_front f;
    kt_delassus d;
    const kt_model *model;
    kt_data *data;
    const double *unit; /* of a damped step: of coordinates; or NULL */
} sweep;

/* Points to the arrays of a group. The equations are those that the last call of list_equations has found. */
static void begin_sweep(const kt_model *model, kt_data *data, size_t g, kt_rows rows, sweep *s) {
    s->model = model;
    s->data = data;
    s->unit = NULL;
    kt_front_find(model, data, g, rows, &s->f);
    kt_delassus_find(model, data, g, &s->d);
}

/* Whether an equation is among the chosen independent ones or, for a damped step, not trivial. */
static bool is_included(const sweep *s, int32_t slot, bool independent) {
#ifndef KT_LANES
    if (!independent)
        return kt_front_reach(s->model, s->f.components < KT_FRONT_SPACE, &s->f.w, slot) > 0.0;
#endif
    (void)independent;
    return !s->f.w.weight || s->f.w.weight[slot] != 1.0;
}

/* Lists the equations: all equations that do not vanish, or only the independent equations, which are all or those
 * chosen at generic positions. most: the largest number of equations. Returns false if there are more of them. */
static bool list_equations(const sweep *s, bool independent, int32_t most) {
    kt_delassus_equations *all = s->d.equations;
    const int32_t begin = s->f.step[0].loop;
    int32_t step = 0;
    all->count = 0;
    for (int32_t l = begin; l < begin + s->f.group->loop_count; l++) {
        const kt_loop_record *loop = &s->model->loop[s->model->front_loop[l]];
        while (l >= s->f.step[step].loop + s->f.step[step].loop_count)
            step++; /* the step that completes the loop */
        const int32_t *slot = s->f.model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++) {
            if (!kt_front_counts(&s->f, slot[r]) || !is_included(s, slot[r], independent))
                continue;
            if (all->count == most)
                return false;
            all->row[all->count].loop = s->model->front_loop[l];
            all->row[all->count].slot = slot[r];
            all->row[all->count++].step = step;
        }
    }
    return true;
}

/* The number of equations that a sweep computes; SWEEP calls one with its shape as a constant. */
#ifdef KT_LANES
#define EQUATIONS(s) (s)->d.equations->count
#define SWEEP_OF(function, s, components, ...)                                                                         \
    ((s)->d.equations->count < 3    ? function(s, (shape){components, 2}, __VA_ARGS__)                                 \
     : (s)->d.equations->count == 3 ? function(s, (shape){components, 3}, __VA_ARGS__)                                 \
                                    : function(s, (shape){components, ALL}, __VA_ARGS__))
#else
#define EQUATIONS(s) ALL
#define SWEEP_OF(function, s, components, ...) function(s, (shape){components, ALL}, __VA_ARGS__)
#endif
#define SWEEP(function, s, ...)                                                                                        \
    ((s)->f.components == KT_FRONT_SPACE / 2 ? SWEEP_OF(function, s, KT_FRONT_SPACE / 2, __VA_ARGS__)                  \
                                             : SWEEP_OF(function, s, KT_FRONT_SPACE, __VA_ARGS__))

/* ---- wrenches on the links, joint forces of relations ------------------------------------------------------------ */

/* Adds wrenches to the wrenches that a link will receive. */
KT_INLINE void add_to_load(const sweep *s, int32_t link, shape is, const kt_real4 *x) {
    const int32_t local = s->model->link[link].local;
    kt_real4 *to = s->d.load + KT_FRONT_SPACE * local;
    const bool more = s->d.present[local] & KT_DELASSUS_WRENCH;
    for (int c = 0; c < is.components; c++)
        kt_store4(is.equations, more ? kt_add4(is.equations, to[c], x[c]) : x[c], &to[c]);
    s->d.present[local] |= KT_DELASSUS_WRENCH;
}

/* Adds sign times W C of a loop to its links. */
static void add_loop_wrenches(const sweep *s, int r, double sign) {
    const kt_front *f = &s->f;
    const kt_loop_record *loop = &s->model->loop[s->d.equations->row[r].loop];
    kt_real4 x[KT_FRONT_SPACE];
    for (int k = 0; k < 2; k++) {
        const int32_t link = loop->link[k];
        if (link == f->group->parent)
            continue;
        const kt_real4 columns = kt_scale4(ALL, kt_real1_splat(sign), s->d.transform[r]);
        const kt_real1 *w = kt_front_wrench(f, s->d.equations->row[r].slot, k);
        for (int c = 0; c < f->components; c++)
            x[c] = kt_scale4(ALL, w[c], columns);
        add_to_load(s, link, (shape){f->components, ALL}, x);
    }
}

/* The joint forces of relations on a link's one degree of freedom. */
KT_INLINE kt_real4 joint_force_of(const sweep *s, int32_t local) {
    return s->d.present[local] & KT_DELASSUS_FORCE ? s->d.column[local] : kt_zero4();
}

/* Adds the joint forces of a relation; the forces of planar revolute joints are moments about n. */
static void add_relation_forces(const sweep *s, int r) {
    const kt_loop_record *loop = &s->model->loop[s->d.equations->row[r].loop];
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &s->model->term[loop->term + k];
        kt_real1 coefficient = kt_real1_splat(term->coefficient);
        if (s->f.components == KT_FRONT_SPACE / 2) {
            const kt_planar_link *planar = &s->model->planar[term->link + s->model->to_planar];
            if (planar->revolute)
                coefficient *= planar->sign;
        }
        const int32_t local = s->model->link[term->link].local;
        s->d.column[local] = kt_add_scaled4(ALL, joint_force_of(s, local), coefficient, s->d.transform[r]);
        s->d.present[local] |= KT_DELASSUS_FORCE;
    }
}

/* Stores sign times W C on the loops' links, and the joint forces of relations in the columns. */
static void set_loads(const sweep *s, double sign) {
    memset(s->d.present, 0, (size_t)s->f.w.m);
    for (int r = 0; r < s->d.equations->count; r++)
        if (s->model->loop[s->d.equations->row[r].loop].term_count)
            add_relation_forces(s, r);
        else
            add_loop_wrenches(s, r, sign);
}

/* A wrench of each column, on a link about its origin. */
typedef struct wrenches {
    kt_real4 x[KT_FRONT_SPACE];
} wrenches;

/* Sums the wrenches that link i receives: the stored wrenches, and those of the next link if this is its child
 * (`from_child`). */
KT_INLINE void collect_wrenches(const sweep *s, int32_t i, shape is, bool from_child, wrenches *p) {
    const int32_t local = s->model->link[i].local;
    const bool has = s->d.present[local] & KT_DELASSUS_WRENCH;
    const kt_real4 *stored = s->d.load + KT_FRONT_SPACE * local;
    for (int c = 0; c < is.components && !from_child; c++)
        p->x[c] = kt_zero4();
    for (int c = 0; c < is.components && has; c++)
        p->x[c] = kt_add4(is.equations, p->x[c], stored[c]);
}

/* To the origin of the parent: n += r x f. */
KT_INLINE void shift_to_parent(kt_real3 r, shape is, wrenches *p) {
#ifndef KT_LANES
    kt_wrench_shift_of4(is.components, r, p->x);
#else
    for (int k = 0; k < is.equations; k++) {
        kt_real1 x[KT_FRONT_SPACE];
        for (int c = 0; c < is.components; c++)
            x[c] = p->x[c].of[k];
        kt_wrench_shift(is.components, r, x);
        for (int c = 0; c < is.components; c++)
            p->x[c].of[k] = x[c];
    }
#endif
}

/* e . x */
KT_INLINE kt_real4 along3(int n, kt_real3 e, const kt_real4 *x) {
    return kt_add_scaled4(n, kt_add4(n, kt_scale4(n, KT_PART3(e, 0), x[0]), kt_scale4(n, KT_PART3(e, 1), x[1])),
                          KT_PART3(e, 2), x[2]);
}

/* Returns S . p of an axis; for a planar revolute joint, the component about n, whatever the sign of the axis. */
KT_INLINE kt_real4 along_axis(const sweep *s, int32_t i, shape is, const wrenches *p) {
    const kt_real4 *x = p->x;
    const int n = is.equations;
    if (is.components == KT_FRONT_SPACE / 2) {
        const int32_t k = i + s->model->to_planar;
        const kt_planar_link *link = &s->model->planar[k];
        kt_real1 u[2];
        if (link->revolute)
            return x[0];
        kt_planar_along(link, &s->data->planar[k], u);
        return kt_add4(n, kt_scale4(n, u[0], x[1]), kt_scale4(n, u[1], x[2]));
    }
    const kt_link *link = &s->model->link[i];
    const kt_real3 e = kt_link_axis(link, &s->data->motion[i]);
    const kt_real4 moment = along3(n, e, x);
    if (link->motion == KT_MOTION_REVOLUTE)
        return moment;
    const kt_real4 force = along3(n, e, x + 3);
    return link->motion == KT_MOTION_SCREW ? kt_add_scaled4(n, moment, kt_real1_splat(kt_link_pitch(link)), force)
                                           : force;
}

/* ---- C ----------------------------------------------------------------------------------------------------------- */

/* Zero for a coordinate that counts as a constant, otherwise its unit. */
KT_INLINE double unit_of(const sweep *s, int32_t local) {
    return kt_front_is_fixed(&s->f, local) ? 0.0 : s->unit ? s->unit[local] : 1.0;
}

/* A A', and the rows of A' as columns; if `units`, of coordinates in these. */
KT_INLINE void sweep_rows(const sweep *s, shape is, bool units, kt_real4 *square) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    const int n = is.equations;
    wrenches p;
    bool from_child = false;
    for (int l = s->f.group->link_count - 1; l >= 0; l--) {
        const int32_t i = link[l], up = s->model->link[i].parent;
        collect_wrenches(s, i, is, from_child, &p);
        const int dofs = s->model->link[i].motion == KT_MOTION_SPHERICAL ? 3 : 1;
        for (int c = 0; c < dofs; c++) {
            const int32_t local = s->model->link[i].local + c;
            kt_real4 row = dofs == 1 ? kt_add4(n, joint_force_of(s, local), along_axis(s, i, is, &p)) : p.x[c];
            row = units ? kt_scale4(n, kt_real1_splat(unit_of(s, local)), row) : row;
            kt_store4(n, row, &s->d.column[local]);
            kt_square4_add(n, row, kt_real1_splat(1.0), square);
        }
        from_child = l > 0 && up == link[l - 1];
        shift_to_parent(kt_front_offset(&s->f, i), is, &p);
        if (!from_child && up != 0)
            add_to_load(s, up, is, p.x);
    }
    kt_square4_mirror(square);
}

#ifndef KT_LANES
static __attribute__((noinline)) void find_square_in_units(const sweep *s, kt_v4 *square) {
    sweep_rows(s, (shape){s->f.components, ALL}, true, square);
}
#endif

/* C in columns, for the loops in the order of the steps. Returns the smallest of the steps' last directions relative to
 * their usual sizes, 0 if one is not clear. */
static kt_real1 orthonormalise_steps(const sweep *s, kt_rows rows, const kt_real4 *g, kt_real4 *c) {
    const double *usual = s->model->front_usual + (size_t)rows * s->model->n.front + s->f.plan->step;
    const kt_delassus_equations *all = s->d.equations;
    kt_real1 first = kt_real1_splat(s->f.w.least * s->f.w.least), least = kt_real1_splat((double)INFINITY);
    for (int begin = 0, end = 0; begin < all->count && kt_is_anywhere(least > 0.0); begin = end) {
        const int32_t step = all->row[begin].step;
        while (end < all->count && all->row[end].step == step)
            end++;
        const kt_real1 last =
            kt_square4_orthonormalise(g, begin, end, SMALL, s->f.w.tolerance, c, &first) / usual[step];
        least = KT_CHOOSE(last < least, last, least);
    }
    return least;
}

kt_condition KT_KERNEL(kt_delassus_prepare)(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    assert(g < model->n.group && model->group[g].form == KT_FORM_DELASSUS);
    kt_real4 square[KT_DELASSUS_MAX], c[KT_DELASSUS_MAX];
    const int32_t rank = model->group[g].rank[rows];
    sweep s;
    begin_sweep(model, data, g, rows, &s);
    if (!list_equations(&s, true, rank) || s.d.equations->count < rank)
        return kt_condition_false();
    for (int r = 0; r < KT_DELASSUS_MAX; r++) {
        square[r] = c[r] = s.d.transform[r] = kt_zero4();
        kt_set_part4(&s.d.transform[r], r, kt_real1_splat(1.0));
    }
    set_loads(&s, 1.0);
#ifndef KT_LANES
    if (memchr(s.f.fixed, 1, (size_t)s.f.w.m)) /* coordinates that count as constants have the unit 0 */
        find_square_in_units(&s, square);
    else
#endif
        SWEEP(sweep_rows, &s, false, square);
    const kt_real1 last = orthonormalise_steps(&s, rows, square, c);
    kt_condition regular = kt_condition_true();
    if (kt_fails(&regular, (last > KT_NEAR_SINGULAR) & kt_is_finite1(last)))
        return kt_condition_false();
    for (int r = 0; r < KT_DELASSUS_MAX; r++)
        for (int n = 0; n < KT_DELASSUS_MAX; n++)
            kt_set_part4(&s.d.transform[r], n, kt_part4(c[n], r));
    data->factored[g] = rows;
#ifndef KT_LANES
    data->near[g] = false;
    data->last[g] = last;
    data->rank[g] = rank;
#endif
    return regular;
}

/* Writes the step A' lambda; of a damped step, in the coordinates' own units. */
static void write_step(const sweep *s, kt_real4 lambda, kt_real1 *step) {
    const kt_model *model = s->model;
    const int n = EQUATIONS(s);
    for (int l = 0; l < s->f.group->link_count; l++) {
        const int32_t i = model->group_link[s->f.group->link + l];
        const kt_link *link = &model->link[i];
        const kt_real4 *row = s->d.column + link->local;
        kt_real1 *x = step + link->v;
        x[0] = kt_dot4(n, row[0], lambda) * (s->unit ? s->unit[link->local] : 1.0);
        if (s->f.components == KT_FRONT_SPACE / 2) {
            const kt_planar_link *planar = &model->planar[i + model->to_planar];
            if (planar->revolute)
                x[0] *= planar->sign;
        } else if (link->motion == KT_MOTION_SPHERICAL) {
            const kt_real3 world = kt_make3(x[0], kt_dot4(n, row[1], lambda), kt_dot4(n, row[2], lambda));
            for (int c = 0; c < 3; c++)
                x[c] = kt_dot3(s->data->motion[i].axes[c], world);
        }
    }
}

void KT_KERNEL(kt_delassus_least)(const kt_model *model, kt_data *data, size_t g, kt_real1 *step) {
    assert(g < model->n.group && model->group[g].form == KT_FORM_DELASSUS);
    kt_real4 mu = kt_zero4(), lambda = mu;
    sweep s;
    begin_sweep(model, data, g, data->factored[g], &s);
    for (int r = 0; r < s.d.equations->count; r++)
        mu = kt_add_scaled4(ALL, mu, s.f.w.right[s.d.equations->row[r].slot], s.d.transform[r]);
    for (int r = 0; r < s.d.equations->count; r++)
        kt_set_part4(&lambda, r, kt_dot4(ALL, s.d.transform[r], mu));
    write_step(&s, lambda, step);
}

/* ---- S and mu ---------------------------------------------------------------------------------------------------- */

/* S = sum u d u', and B' M^-1 f = sum u (y - K . A0). */
typedef struct sums {
    kt_real4 square[KT_DELASSUS_MAX], force;
} sums;

/* Adds the part of a degree of freedom: S += u d u', force += u (y - K . A0). `inverse` is d, `free` is y - K . A0. */
KT_INLINE void add_dof(const sweep *s, int n, int32_t local, kt_real4 u, kt_real1 inverse, kt_real1 free, sums *to) {
    kt_store4(n, u, &s->d.column[local]);
    s->d.inverse[local] = inverse;
    kt_square4_add(n, u, inverse, to->square);
    to->force = kt_add_scaled4(n, to->force, free, u);
}

/* Eliminates a link in a plane, whose parent has the acceleration `at`:
 *   u = b - S . P,   P_parent = shift(P) + K u,   b: the joint forces of relations */
KT_INLINE void eliminate_planar(const sweep *s, shape is, int32_t i, const kt_real3 at, wrenches *p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_planar_response *response = &s->data->planar_response[i + s->model->to_planar];
    const kt_real1 *gain = response->gain_linear;
    const int n = is.equations;
    const kt_real4 u = kt_sub4(n, joint_force_of(s, local), along_axis(s, i, is, p));
    add_dof(s, n, local, u, s->d.inverse[local],
            response->free - (gain[0] * KT_PART3(at, 0) + gain[1] * KT_PART3(at, 1)), to);
    shift_to_parent(kt_front_offset(&s->f, i), is, p);
    p->x[0] = kt_add_scaled4(n, p->x[0], response->gain_angular, u);
    p->x[1] = kt_add_scaled4(n, p->x[1], gain[0], u);
    p->x[2] = kt_add_scaled4(n, p->x[2], gain[1], u);
}

/* P <- P + K u */
KT_INLINE void add_gain(int n, kt_real3 angular, kt_real3 linear, kt_real4 u, wrenches *p) {
    for (int c = 0; c < 3; c++) {
        p->x[c] = kt_add_scaled4(n, p->x[c], KT_PART3(angular, c), u);
        p->x[c + 3] = kt_add_scaled4(n, p->x[c + 3], KT_PART3(linear, c), u);
    }
}

/* Eliminates a joint with one axis in space: u = b - S . P,   P_parent = shift(P) + K u */
KT_INLINE void eliminate_axis(const sweep *s, shape is, int32_t i, const kt_front_motion *at, wrenches *p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_response *response = &s->data->response[i];
    const kt_real3 gn = response->gain_angular, gf = response->gain_linear;
    const int n = is.equations;
    const kt_real4 u = kt_sub4(n, joint_force_of(s, local), along_axis(s, i, is, p));
    add_dof(s, n, local, u, s->d.inverse[local], kt_response_free(response) - kt_dots3(gn, at->alpha, gf, at->linear),
            to);
    shift_to_parent(s->data->motion[i].offset, is, p);
    add_gain(n, gn, gf, u, p);
}

/* Eliminates the three rotations of a spherical joint: u = -n, L y = u, z = L^-T y / D, then f += G z and n = 0. `at`:
 * the motion of the link itself. */
KT_INLINE void eliminate_spherical(const sweep *s, shape is, int32_t i, const kt_front_motion *at, wrenches *p,
                                   sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_articulated *kept = &s->data->articulated[s->model->link[i].articulated];
    const kt_real3 l = kept->j[0], e = kept->j[1];
    const kt_real3 free =
        kt_sub3(kt_solve3(l, e, kt_sub3(kept->moment, kt_apply_transposed3(kept->g, at->linear))), at->alpha);
    const int n = is.equations;
    kt_real4 u[3], y[3], z[3];
    for (int c = 0; c < 3; c++) {
        u[c] = kt_minus4(n, p->x[c]);
        kt_store4(n, u[c], &s->d.column[local + c]);
        to->force = kt_add_scaled4(n, to->force, KT_PART3(free, c), u[c]);
        p->x[c] = kt_zero4();
    }
    y[0] = u[0];
    y[1] = kt_sub_scaled4(n, u[1], KT_PART3(l, 0), y[0]);
    y[2] = kt_sub_scaled4(n, kt_sub_scaled4(n, u[2], KT_PART3(l, 1), y[0]), KT_PART3(l, 2), y[1]);
    for (int c = 0; c < 3; c++) {
        kt_square4_add(n, y[c], KT_PART3(e, c), to->square);
        z[c] = kt_scale4(n, KT_PART3(e, c), y[c]);
    }
    z[1] = kt_sub_scaled4(n, z[1], KT_PART3(l, 2), z[2]);
    z[0] = kt_sub4(n, z[0], kt_add4(n, kt_scale4(n, KT_PART3(l, 0), z[1]), kt_scale4(n, KT_PART3(l, 1), z[2])));
    for (int c = 0; c < 3; c++) {
        const kt_real3 g = kt_make3(KT_PART3(kept->g[0], c), KT_PART3(kept->g[1], c), KT_PART3(kept->g[2], c));
        p->x[c + 3] = kt_add4(n, p->x[c + 3], along3(n, g, z));
    }
    shift_to_parent(s->data->motion[i].offset, is, p);
}

#ifndef KT_LANES
/* Eliminates a joint with armature, one degree of freedom after the other (kt_project_armature). The wrenches are
 * passed by value, so that the wrenches of other joints stay in registers. */
static __attribute__((noinline)) wrenches eliminate_armature(const sweep *s, int32_t i, const kt_front_motion *at,
                                                             wrenches p, sums *to) {
    const int32_t local = s->model->link[i].local;
    const kt_link_motion *m = &s->data->motion[i];
    const shape is = {KT_FRONT_SPACE, ALL};
    kt_articulated *kept = &s->data->articulated[s->model->link[i].articulated];
    for (int k = 2; k >= 0; k--) {
        const kt_v4 n = *kt_armature_gain(kept, 2 * k), f = *kt_armature_gain(kept, 2 * k + 1);
        const kt_v4 u = -along3(ALL, m->axes[k], p.x);
        add_dof(s, ALL, local + k, u, n[3], kept->moment[k] - kt_v4_dot2(n, at->alpha, f, at->linear), to);
        add_gain(ALL, n, f, u, &p);
    }
    shift_to_parent(m->offset, is, &p);
    return p;
}
#endif

/* The sweep over the links, tips first, that eliminates each joint. ground: the acceleration of the ground, minus
 * gravity. */
KT_INLINE void sweep_responses(const sweep *s, shape is, kt_real3 ground, sums *to) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    const kt_front_motion rest = {.alpha = kt_zero3(), .linear = kt_zero3()};
    wrenches p;
    bool from_child = false;
    for (int l = s->f.group->link_count - 1; l >= 0; l--) {
        const int32_t i = link[l], up = s->model->link[i].parent;
        const bool spherical = s->model->link[i].motion == KT_MOTION_SPHERICAL;
        const kt_front_motion *from = spherical ? kt_front_motion_of(&s->f, i)
                                      : up      ? kt_front_motion_of(&s->f, up)
                                                : &rest;
        const kt_front_motion at = {.alpha = from->alpha, .linear = kt_add3(from->linear, ground)};
        collect_wrenches(s, i, is, from_child, &p);
        if (is.components == KT_FRONT_SPACE / 2)
            eliminate_planar(s, is, i, at.linear, &p, to);
        else if (!spherical)
            eliminate_axis(s, is, i, &at, &p, to);
#ifndef KT_LANES
        else if (s->model->link[i].has_armature)
            p = eliminate_armature(s, i, &at, p, to);
#endif
        else
            eliminate_spherical(s, is, i, &at, &p, to);
        from_child = l > 0 && up == link[l - 1];
        if (!from_child && up != 0)
            add_to_load(s, up, is, p.x);
    }
}

/* Adds the accelerations due to B mu to the joint accelerations without multipliers, which the forward pass then
 * completes. In the plane they are in other arrays than in space. */
KT_INLINE void add_responses(const sweep *s, bool planar, kt_real4 mu) {
    const int32_t *link = s->model->group_link + s->f.group->link;
    const int n = EQUATIONS(s);
    for (int l = 0; l < s->f.group->link_count; l++) {
        const int32_t i = link[l], local = s->model->link[i].local;
        const kt_real1 x = kt_dot4(n, s->d.column[local], mu);
        if (planar) {
            s->data->planar_response[i + s->model->to_planar].free += s->d.inverse[local] * x;
        } else if (s->model->link[i].motion == KT_MOTION_SPHERICAL) {
            const kt_real1 y = kt_dot4(n, s->d.column[local + 1], mu), z = kt_dot4(n, s->d.column[local + 2], mu);
            kt_real3 *moment = &s->data->articulated[s->model->link[i].articulated].moment, more = kt_make3(x, y, z);
#ifndef KT_LANES
            if (s->model->link[i].has_armature)
                more *= kt_load3(s->d.inverse + local);
#endif
            *moment = kt_add3(*moment, more);
        } else {
            kt_response_add(&s->data->response[i], s->d.inverse[local] * x);
        }
    }
}

kt_condition KT_KERNEL(kt_delassus_solve)(const kt_model *model, kt_data *data, size_t g, const kt_const1 *gravity) {
    assert(g < model->n.group && model->group[g].form == KT_FORM_DELASSUS);
    sums to = {.force = kt_zero4()};
    kt_real4 mu = kt_zero4();
    sweep s;
    begin_sweep(model, data, g, data->factored[g], &s);
    const kt_delassus_equations *all = s.d.equations;
    const bool planar = s.f.components == KT_FRONT_SPACE / 2;
    set_loads(&s, -1.0);
    const kt_real3 ground =
        planar ? kt_make3(kt_const_real1(-gravity[0]), kt_const_real1(-gravity[1]), kt_real1_splat(0.0))
               : data->motion[0].linear;
    SWEEP(sweep_responses, &s, ground, &to);
    for (int r = 0; r < all->count; r++)
        mu = kt_add_scaled4(ALL, mu, s.f.w.right[all->row[r].slot], s.d.transform[r]);
    mu = kt_sub4(ALL, mu, to.force);
    kt_condition positive = kt_square4_solve(to.square, all->count, &mu);
    if (kt_fails(&positive, positive))
        return kt_condition_false();
#ifndef KT_LANES
    memset(s.f.w.multiplier, 0, (size_t)s.f.w.k * sizeof *s.f.w.multiplier);
    for (int r = 0; r < all->count; r++)
        s.f.w.multiplier[all->row[r].slot] = kt_dot4(ALL, s.d.transform[r], mu);
#endif
    if (planar)
        add_responses(&s, true, mu);
    else
        add_responses(&s, false, mu);
    return positive;
}

#ifndef KT_LANES

/* ---- damped steps ------------------------------------------------------------------------------------------------ */

bool KT_KERNEL(kt_delassus_measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, double *size) {
    assert(kt_data_serve(model, data) && model->group[g].damped_form == KT_FORM_DELASSUS);
    kt_v4 square[KT_DELASSUS_MAX];
    sweep s;
    begin_sweep(model, data, g, rows, &s);
    if (!list_equations(&s, false, KT_DELASSUS_MAX))
        return false;
    s.unit = model->unit + s.f.group->v;
    for (int r = 0; r < KT_DELASSUS_MAX; r++) {
        square[r] = s.d.transform[r] = kt_v4_splat(0.0);
        if (r < s.d.equations->count)
            s.d.transform[r][r] = 1.0 / s.f.w.scale[s.d.equations->row[r].slot];
    }
    set_loads(&s, 1.0);
    find_square_in_units(&s, square);
    *size = (square[0][0] + square[1][1]) + (square[2][2] + square[3][3]);
    memcpy(s.d.transform, square, sizeof square);
    data->factored[g] = rows;
    return true;
}

/* lambda = -(B B' + mu 1)^-1 (gap / scale), step = B' lambda in units */
bool KT_KERNEL(kt_delassus_damp)(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,
                                 double *step) {
    assert(damping >= 0.0);
    assert(kt_data_serve(model, data) && model->group[g].damped_form == KT_FORM_DELASSUS);
    kt_v4 square[KT_DELASSUS_MAX], lambda = kt_v4_splat(0.0);
    sweep s;
    begin_sweep(model, data, g, data->factored[g], &s);
    s.unit = model->unit + s.f.group->v;
    memcpy(square, s.d.transform, sizeof square);
    for (int r = 0; r < s.d.equations->count; r++) {
        const int32_t slot = s.d.equations->row[r].slot;
        square[r][r] += damping;
        lambda[r] = -gap[slot] / s.f.w.scale[slot];
    }
    if (!kt_square4_solve(square, s.d.equations->count, &lambda))
        return false;
    write_step(&s, lambda, step);
    return true;
}

#endif
