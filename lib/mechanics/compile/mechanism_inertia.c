/* Faults that only the mechanism as a whole shows: joints that move nothing with inertia along one of their degrees of
 * freedom, and loops within one rigid part.
 *
 * If a degree of freedom has no inertia at the initial and at generic positions, its acceleration can never be
 * computed. Links are tested from the tips of the tree to the ground. A link that carries a link without inertia is not
 * tested, because only the inertia of the carried link may be missing. A link that carries an end of a loop is not
 * tested either, because the loop may constrain or drive the link. An inertia that is then still missing is found when
 * the mechanism moves. If effects act on a link without inertia, its motion follows from the balance of their forces
 * (massless.c). Such a link is given armature, and the tree is tested again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"
#include "compile/attach.h"
#include "dynamics/dynamics.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VARIANTS = 4 }; /* positions that are tried: the initial one, and generic ones */

typedef struct reporter {
    kt_report *report;
    void *user;
    kt_error first; /* code KT_OK: none yet */
} reporter;

/* Reports a fault to the caller, and stores the first one. */
static void report_fault(reporter *t, kt_item item, int index, const char *field, const kt_error *error) {
    const kt_place place = {.item = item, .index = index, .sub = -1, .field = field};
    if (t->first.code == KT_OK)
        t->first = *error;
    if (t->report)
        t->report(t->user, &place, error);
}

/* ---- inertia ----------------------------------------------------------------------------------------------------- */

/* Generic positions, the same on every machine: q0 plus a fixed sequence (golden ratio) of numbers in (-1, 1). */
static void generic_positions(const kt_model *m, int variant, double *q) {
    for (size_t i = 0; i < m->n.q; i++) {
        const double x = (double)(i + 1) * 0.61803398874989485 + 0.41421356237309505 * variant;
        q[i] = m->q0[i] + 2.0 * (x - floor(x)) - 1.0;
    }
}

/* Excludes the links from this link to the ground from the test. */
static void mark_unknown(const kt_model *m, int32_t link, unsigned char *verdict) {
    for (int32_t i = link; i > 0; i = m->link[i].parent)
        verdict[i] = KT_INERTIA_UNKNOWN;
}

static int32_t end_link_of(const kt_model *m, const kt_end *end) {
    return m->body[kt_attach_body_named(m, end->body)].link;
}

/* Excludes the links that a loop acts on: the loop may give them the inertia of other links. */
static void mark_loops_unknown(const kt_model *m, const kt_description *d, unsigned char *verdict) {
    for (int i = 0; i < d->loop_count; i++) {
        const kt_loop *loop = &d->loops[i];
        if (KT_IS_OFF(loop))
            continue;
        for (int k = 0; k < 2 && !kt_attach_is_relation((int32_t)loop->type); k++)
            mark_unknown(m, end_link_of(m, &loop->between[k]), verdict);
        for (int k = 0; k < kt_loop_term_count(loop); k++)
            mark_unknown(m, kt_attach_joint_link(m, kt_loop_term(loop, k).joint), verdict);
    }
}

/* Working arrays. */
typedef struct trial {
    kt_pool pool;
    kt_data *data;
    double *q;
    unsigned char *verdict; /* of links, at one position */
    bool *moves, *still;    /* of links: it has inertia at some position; it has none at some position */
    bool *faulty;           /* of bodies, by their indices in the description */
} trial;

static kt_status begin_trial(trial *t, const kt_model *m, kt_error *error) {
    *t = (trial){.data = NULL};
    t->q = kt_pool_take(&t->pool, m->n.q, sizeof *t->q);
    t->verdict = kt_pool_take(&t->pool, m->n.link, sizeof *t->verdict);
    t->moves = kt_pool_take(&t->pool, 2 * m->n.link, sizeof *t->moves);
    t->still = t->moves ? t->moves + m->n.link : NULL;
    t->faulty = kt_pool_take(&t->pool, m->n.body, sizeof *t->faulty);
    if (t->q && t->verdict && t->moves && t->faulty)
        return kt_data_create(m, &t->data, error);
    (void)kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
    return KT_ERROR_MEMORY;
}

static void end_trial(trial *t) {
    kt_data_free(t->data);
    kt_pool_free(t->pool.chunks);
}

/* Tests the tree at all positions. */
static void check_tree_inertia(trial *t, const kt_model *m, const kt_description *d) {
    size_t found = 1;
    memset(t->moves, 0, 2 * m->n.link * sizeof *t->moves);
    for (int variant = 0; variant < VARIANTS && found; variant++) {
        if (variant > 0)
            generic_positions(m, variant - 1, t->q);
        memset(t->verdict, KT_INERTIA_THERE, m->n.link);
        mark_loops_unknown(m, d, t->verdict);
        found = kt_singular_links(m, t->data, variant > 0 ? t->q : m->q0, t->verdict);
        for (size_t i = 1; i < m->n.link; i++) {
            t->moves[i] |= t->verdict[i] == KT_INERTIA_THERE;
            t->still[i] |= t->verdict[i] == KT_INERTIA_NONE;
        }
    }
}

/* Gives armature to the links that have no inertia and follow from the balance of forces. Returns whether such links
 * exist. Compared with a mass of 1e16, even this armature is negligible. */
static bool mark_massless(const trial *t, kt_model *m, const kt_description *d) {
    bool any = false;
    for (size_t i = 1; i < m->n.link; i++)
        if (t->still[i] && !t->moves[i] && !m->link[i].has_armature && kt_massless_is_carried(m, d, i)) {
            kt_massless_mark(m, i);
            any = true;
        }
    return any;
}

/* Marks the bodies whose joints have no inertia in some position, unless a loop or massless coordinates explain
 * that. */
static void find_faulty(trial *t, kt_model *m, const kt_description *d) {
    do
        check_tree_inertia(t, m, d);
    while (mark_massless(t, m, d));
    for (size_t i = 1; i < m->n.link; i++)
        if (t->still[i] && !t->moves[i])
            t->faulty[m->body[m->link[i].body].source] = true;
}

static void report_inertia(reporter *t, const kt_body *body, int index) {
    kt_error error;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "body '%s'", body->name);
    const bool is_slender = body->shape.type == KT_SHAPE_ROD && body->shape.radius == 0.0;
    if (is_slender && body->mass > 0.0)
        (void)kt_error_set(
            &error, KT_ERROR_MODEL, where,
            "its %s joint moves nothing that has inertia along one of its degrees of freedom: a rod without a radius "
            "does not resist a turn about its own axis. Give its shape a 'radius', or '%s' an inertia about that axis, "
            "or make the joint fixed",
            kt_joint_type_name(body->joint.type), body->name);
    else
        (void)kt_error_set(
            &error, KT_ERROR_MODEL, where,
            "its %s joint moves nothing that has inertia along one of its degrees of freedom: give '%s', or a body "
            "that it carries, mass and inertia there, or make the joint fixed",
            kt_joint_type_name(body->joint.type), body->name);
    report_fault(t, KT_ITEM_BODY, index, "joint", &error);
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

static void report_rigid(reporter *t, const kt_loop *loop, int index) {
    kt_error error;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "loop '%.100s'", loop->name);
    (void)kt_error_set(&error, KT_ERROR_MODEL, where,
                       "both its ends are on the same rigid part, which no motion can close or open; connect two "
                       "bodies that move against each other");
    report_fault(t, KT_ITEM_LOOP, index, "between", &error);
}

/* ---- both checks ------------------------------------------------------------------------------------------------- */

kt_status kt_tree_check(kt_model *tree, const kt_description *description, kt_report *report, void *user,
                        kt_error *error) {
    reporter t = {.report = report, .user = user, .first = {.code = KT_OK}};
    trial try;
    const kt_status status = begin_trial(&try, tree, error);
    if (status == KT_OK) {
        if (description->inertia_check != KT_INERTIA_ACCEPT)
            find_faulty(&try, tree, description);
        for (int i = 0; i < description->body_count; i++)
            if (try.faulty[i])
                report_inertia(&t, &description->bodies[i], i);
        for (int i = 0; i < description->loop_count; i++) {
            const kt_loop *loop = &description->loops[i];
            if (!kt_attach_is_relation((int32_t)loop->type) &&
                end_link_of(tree, &loop->between[0]) == end_link_of(tree, &loop->between[1]))
                report_rigid(&t, loop, i);
        }
    }
    end_trial(&try);
    if (t.first.code != KT_OK && error)
        *error = t.first;
    return status == KT_OK ? t.first.code : status;
}
