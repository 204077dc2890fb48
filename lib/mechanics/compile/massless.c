/* Coordinates that move no mass and are held by springs and dampers, and the corresponding motions.
 *
 * A joint whose articulated inertia is zero is found by mechanism_inertia.c; its coordinates w are given an armature of
 * 1 (dynamics/massless_recursion.c). In one motion w moves by 1 and no mass does. This is the response of that
 * mechanism to a unit force in w, at rest without gravity,
 *
 *     (M + E E') n_w = e_w     as    M n_w = 0,  E' n_w = e_w
 *
 * The direction n_w is the unit vector e_w itself if w carries no mass at all. The direction is (1, -1) for two sliders
 * in a row of which the first has none. The direction must be the same in all positions, or the balance of forces would
 * contain accelerations. How the forces along these motions depend on their speeds s, r(s) - r(0) = -C s, is found at
 * unit speeds. Congruence makes C diagonal,
 *
 *     B' C B = diag(C_d, 0)
 *
 * with pivots on the diagonal: along the first columns of N B dampers resist, along the others none does
 * (evaluate/quasi_static.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"
#include "compile/attach.h"
#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "effect/path.h"
#include "evaluate/evaluate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- in a tree --------------------------------------------------------------------------------------------------- */

/* Whether a body is on the link or behind it: parents have smaller indices. */
static bool link_carries_body(const kt_model *m, size_t link, int body) {
    int32_t at = body > 0 ? m->body[body].link : 0;
    while (at > (int32_t)link)
        at = m->link[at].parent;
    return at == (int32_t)link;
}

/* The body whose joint an effect names, or a coordinate of this joint; 0: none. */
static int body_of_joint(const kt_model *m, const char *name) {
    char joint[KT_WHERE_SIZE];
    if (name == NULL)
        return 0;
    (void)snprintf(joint, sizeof joint, "%s", name);
    joint[strcspn(joint, "[")] = '\0';
    const int body = kt_joint_index(m, joint);
    return body > 0 ? body : 0;
}

bool kt_massless_is_carried(const kt_model *tree, const kt_description *description, size_t link) {
    for (int i = 0; i < description->effect_count; i++) {
        const kt_effect *effect = &description->effects[i];
        bool acts = link_carries_body(tree, link, body_of_joint(tree, effect->joint));
        for (int k = 0; k < 2; k++)
            acts |= link_carries_body(tree, link, kt_attach_body_named(tree, effect->between[k].body));
        for (int k = 0; kt_effect_has_path(effect) && k < effect->path_count; k++)
            acts |= link_carries_body(tree, link, kt_attach_body_named(tree, effect->path[k].end.body));
        if (acts && !KT_IS_OFF(effect))
            return true;
    }
    return false;
}

void kt_massless_mark(kt_model *tree, size_t link) {
    const kt_link *l = &tree->link[link];
    for (int k = 0; k < kt_link_dofs(l); k++)
        tree->armature[l->v + k] = 1.0;
    tree->found_massless += (size_t)kt_link_dofs(l);
    kt_armature_update_flags(tree);
}

/* ---- in a complete model ----------------------------------------------------------------------------------------- */

enum { VARIANTS = 4 }; /* positions at which motions are compared */

typedef struct finder {
    kt_pool pool;
    kt_model *model;
    kt_data *data;
    double *q, *v, *a, *motion; /* nq, nv, nv, nv */
    double *c;                  /* massless x massless, column-major: C, and its remainder */
    double stiffest;            /* the largest derivative of a force by a position */
    bool *used;                 /* of the coordinates: a pivot */
} finder;

static kt_status reject_massless_joint(const kt_model *m, size_t k, const char *what, kt_error *error) {
    char where[KT_WHERE_SIZE];
    const int body = kt_velocity_body(m, m->massless[k]);
    (void)snprintf(where, sizeof where, "body '%.100s'", kt_body_name(m, body));
    return kt_error_set(
        error, KT_ERROR_MODEL, where,
        "its %s joint moves no mass, and %s: give '%s', or a body that it carries, mass and inertia there "
        "(a small mass, with an implicit method as radau5), or make the joint fixed",
        kt_joint_type_name((kt_joint_type)m->body[body].type), what, kt_body_name(m, body));
}

/* The coordinates of massless links: coordinates with an armature that the description does not give. */
static void list_massless_coordinates(kt_model *m, const kt_description *d) {
    size_t count = 0;
    for (size_t b = 1; b < m->n.body; b++) {
        const kt_body_record *r = &m->body[b];
        for (int k = 0; k < kt_joint_sizes[r->type].nv; k++)
            if (m->armature[r->v + k] == 1.0 && d->bodies[r->source].joint.armature[k] == 0.0)
                m->massless[count++] = (int32_t)(r->v + k);
    }
}

/* Writes n_w of coordinate k at q to f->motion; returns the reason if n_w does not exist, or NULL. Gravity is switched
 * off in the model. */
static const char *find_motion(const finder *f, size_t k) {
    const kt_model *m = f->model;
    memset(f->v, 0, m->n.v * sizeof *f->v);
    f->v[m->massless[k]] = 1.0;
    const size_t failed = m->kernels->forward(m, f->data, f->q, m->zero, f->v, NULL, f->motion);
    if (failed > 0)
        return "another joint, which a loop drives, moves no mass either: give a body on that joint a mass";
    for (size_t j = 0; j < m->n.massless; j++)
        if (!(fabs(f->motion[m->massless[j]] - (j == k)) <= 1e-12))
            return "has inertia in part of its degrees of freedom or positions";
    return NULL;
}

/* Generic positions: the initial positions, changed by increments. */
static void move_to_variant(const finder *f, int variant) {
    const kt_model *m = f->model;
    for (size_t i = 0; i < m->n.v; i++) {
        const double x = (double)(i + 1) * 0.61803398874989485 + 0.41421356237309505 * variant;
        f->v[i] = variant > 0 ? 2.0 * (x - floor(x)) - 1.0 : 0.0;
    }
    kt_position_add(m, m->q0, f->v, f->q);
}

/* Finds the motions n_w, a row for each coordinate w without mass, and checks that they are the same in several
 * positions. */
static kt_status find_motions(const finder *f, kt_error *error) {
    kt_model *m = f->model;
    const size_t nv = m->n.v;
    for (int variant = 0; variant < VARIANTS; variant++) {
        move_to_variant(f, variant);
        for (size_t k = 0; k < m->n.massless; k++) {
            double *first = m->massless_motion + k * nv;
            const char *why = find_motion(f, k);
            if (why != NULL)
                return reject_massless_joint(m, k, why, error);
            if (variant == 0)
                memcpy(first, f->motion, nv * sizeof *first);
            for (size_t i = 0; i < nv; i++)
                if (!(fabs(f->motion[i] - first[i]) <= 1e-9))
                    return reject_massless_joint(
                        m, k, "the joints that must move with it, so that no mass moves, change with the positions",
                        error);
        }
    }
    return KT_OK;
}

/* Residuals of the balance at (q, v), which are the accelerations of the coordinates. */
static kt_status find_balance_residuals(const finder *f, const double *q, const double *v, kt_error *error) {
    return kt_acceleration_trusted(f->model, f->data, &(kt_dynamic_state){.t = 0.0, .q = q, .v = v}, f->a, error);
}

/* C, and the largest derivative by a position. */
static kt_status find_damping(finder *f, kt_error *error) {
    const kt_model *m = f->model;
    const size_t n = m->n.massless, nv = m->n.v;
    const double small = 1e-6;
    double *rest = f->motion;
    kt_status status = find_balance_residuals(f, m->q0, m->zero, error);
    memcpy(rest, f->a, nv * sizeof *rest);
    for (size_t k = 0; k < n && status == KT_OK; k++) {
        const double *motion = m->massless_motion + k * nv;
        status = find_balance_residuals(f, m->q0, motion, error);
        for (size_t i = 0; i < n && status == KT_OK; i++)
            f->c[k * n + i] = rest[m->massless[i]] - f->a[m->massless[i]];
        for (size_t i = 0; i < nv; i++)
            f->v[i] = small * motion[i];
        kt_position_add(m, m->q0, f->v, f->q);
        if (status == KT_OK)
            status = find_balance_residuals(f, f->q, m->zero, error);
        for (size_t i = 0; i < n && status == KT_OK; i++)
            f->stiffest = fmax(f->stiffest, fabs(f->a[m->massless[i]] - rest[m->massless[i]]) / small);
    }
    return status;
}

/* The largest entry of C that is left on the diagonal, and of all entries. */
static size_t find_diagonal_pivot(const finder *f, size_t n, double *all) {
    size_t best = n;
    *all = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n && !f->used[j]; i++) {
            const double x = f->used[i] ? 0.0 : fabs(f->c[j * n + i]);
            *all = fmax(*all, x);
            if (i == j && (best == n || x > fabs(f->c[best * n + best])))
                best = i;
        }
    return best;
}

/* Eliminates pivot p from the other rows and columns: B := B T, C := T' C T. */
static void eliminate_pivot(const finder *f, size_t p) {
    const size_t n = f->model->n.massless;
    double *b = f->model->massless_basis;
    for (size_t j = 0; j < n; j++) {
        const double x = f->used[j] || j == p ? 0.0 : f->c[j * n + p] / f->c[p * n + p];
        for (size_t i = 0; i < n; i++) {
            b[j * n + i] -= x * b[p * n + i];
            f->c[j * n + i] -= x * f->c[p * n + i];
        }
    }
    f->used[p] = true;
}

/* B with the columns along which dampers resist first. */
static void sort_basis(const finder *f) {
    kt_model *m = f->model;
    const size_t n = m->n.massless;
    size_t damped = 0, free = m->damped;
    memcpy(f->c, m->massless_basis, n * n * sizeof *f->c);
    for (size_t k = 0; k < n; k++)
        memcpy(m->massless_basis + (f->used[k] ? damped++ : free++) * n, f->c + k * n, n * sizeof *f->c);
}

/* Finds the basis B that makes C diagonal, by symmetric elimination with pivots on the diagonal. m->damped becomes
 * the number of motions that a damper resists. */
static kt_status find_basis(const finder *f, kt_error *error) {
    kt_model *m = f->model;
    const size_t n = m->n.massless;
    double all, most = 0.0;
    for (size_t k = 0; k < n; k++)
        m->massless_basis[k * (n + 1)] = 1.0;
    for (m->damped = 0; m->damped < n; m->damped++) {
        const size_t p = find_diagonal_pivot(f, n, &all);
        most = fmax(most, all);
        /* A damper that settles within 1e-12 s is taken for the rounding of forces. */
        const double nothing = 1e-12 * fmax(most, f->stiffest);
        if (!(all > nothing))
            break;
        if (!(fabs(f->c[p * (n + 1)]) > nothing))
            return reject_massless_joint(m, p, "forces depend on its velocity, but do not resist it", error);
        eliminate_pivot(f, p);
    }
    sort_basis(f);
    return KT_OK;
}

/* Replaces the motions N by N B: along its first columns dampers resist, along the others none does. */
static void combine_motions(const finder *f) {
    const kt_model *m = f->model;
    const size_t n = m->n.massless, nv = m->n.v;
    for (size_t i = 0; i < nv; i++) {
        for (size_t k = 0; k < n; k++)
            f->c[k] = m->massless_motion[k * nv + i];
        for (size_t k = 0; k < n; k++) {
            double sum = 0.0;
            for (size_t j = 0; j < n; j++)
                sum += f->c[j] * m->massless_basis[k * n + j];
            m->massless_motion[k * nv + i] = sum;
        }
    }
}

/* Takes the memory of the search. */
static kt_status begin_finder(finder *f, kt_model *m, kt_error *error) {
    const size_t n = m->n.massless;
    *f = (finder){.model = m};
    f->q = kt_pool_take(&f->pool, m->n.q + 3 * m->n.v + n * n, sizeof *f->q);
    f->used = kt_pool_take(&f->pool, n, sizeof *f->used);
    if (!f->q || !f->used)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
    f->v = f->q + m->n.q;
    f->a = f->v + m->n.v;
    f->motion = f->a + m->n.v;
    f->c = f->motion + m->n.v;
    return kt_data_create(m, &f->data, error);
}

kt_status kt_massless_find(kt_model *model, const kt_description *description, kt_error *error) {
    static const kt_parameter gravity = {.kind = KT_PARAMETER_GRAVITY, .count = 3};
    const double weightless[3] = {0.0, 0.0, 0.0};
    const double weight[3] = {model->gravity[0], model->gravity[1], model->gravity[2]};
    finder f;
    kt_status status = begin_finder(&f, model, error);
    if (status == KT_OK) {
        list_massless_coordinates(model, description);
        if (model->n.varying)
            status = reject_massless_joint(model, 0, "masses of other bodies are functions of time", error);
    }
    if (status == KT_OK) {
        kt_parameter_put(model, &gravity, weightless);
        status = find_motions(&f, error);
        kt_parameter_put(model, &gravity, weight);
    }
    if (status == KT_OK)
        status = find_damping(&f, error);
    if (status == KT_OK)
        status = find_basis(&f, error);
    if (status == KT_OK) {
        combine_motions(&f);
        kt_massless_attach(model);
        if (!(f.stiffest > 0.0) && model->damped == 0)
            status = reject_massless_joint(model, 0, "no spring or damper holds it", error);
    }
    kt_data_free(f.data);
    kt_pool_free(f.pool.chunks);
    return status;
}
