/* Forward dynamics through the mass matrix, energy and markers, as nodes.
 *
 * M = L'DL in the order of the coordinates, parents first: L and M have zeros for coordinates on different branches,
 * and there is no fill-in. A pivot D_kk that is not above rounding errors of M means that the joint has no inertia.
 */
#include "codegen/recursion.h"
#include "dynamics/no_inertia.h"

#include <stdlib.h>

/* ---- forward dynamics -------------------------------------------------------------------------------------------- */

/* Factors M in place: L below the diagonal. inverse: 1 / D. */
static void factor_mass(kt_code_tree *tree, kt_op *m, kt_op *inverse, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    const kt_op one = kt_op_number(g, 1.0), least = kt_op_number(g, KT_NO_INERTIA);
    for (int c = tree->link_count - 1; c > 0; c--) {
        const kt_code_link *l = &tree->link[c];
        for (int d = kt_link_dofs(l->link) - 1; d >= 0; d--) {
            const int k = l->link->v + d;
            kt_op *row = m + (size_t)k * nv;
            kt_graph_section(g, "%s: D_kk = M_kk,  L_ki = M_ki / D_kk,  M_ij -= L_ki M_kj  (k = %d)", l->name, k);
            guard[k].pivot = row[k];
            guard[k].body = l->link->body;
            guard[k].limit = kt_op_multiply(
                g, least, kt_op_add(g, guard[k].limit, d < kt_link_lengths(l->link) ? l->carried : l->size));
            inverse[k] = kt_op_divide(g, one, row[k]);
            kt_op_name(g, row[k], "D%d", k);
            kt_op_name(g, inverse[k], "E%d", k);
            for (int i = tree->before[k]; i >= 0; i = tree->before[i]) {
                const kt_op ratio = kt_op_multiply(g, row[i], inverse[k]);
                for (int j = i; j >= 0; j = tree->before[j])
                    m[(size_t)i * nv + (size_t)j] =
                        kt_op_subtract(g, m[(size_t)i * nv + (size_t)j], kt_op_multiply(g, ratio, row[j]));
                row[i] = ratio;
                kt_op_name(g, ratio, "L%d_%d", k, i);
            }
        }
    }
}

void kt_code_forward_mass(kt_code_tree *tree, kt_op *work, kt_op *a, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    kt_op *inverse = calloc((size_t)nv + 1, sizeof *inverse);
    if (inverse == NULL) {
        g->failed = true;
        return;
    }
    kt_code_inverse(tree, false, a);
    kt_code_mass(tree, work);
    for (int k = 0; k < nv; k++)
        guard[k].limit = work[(size_t)k * (size_t)(nv + 1)];
    factor_mass(tree, work, inverse, guard);
    kt_graph_section(g, "accelerations: L'D L a = tau - h");
    for (int k = 0; k < nv; k++)
        a[k] = kt_op_subtract(g, kt_op_input(g, KT_OP_GIVEN, k), a[k]);
    for (int k = nv - 1; k >= 0; k--)
        for (int i = tree->before[k]; i >= 0; i = tree->before[i])
            a[i] = kt_op_subtract(g, a[i], kt_op_multiply(g, work[(size_t)k * (size_t)nv + (size_t)i], a[k]));
    for (int k = 0; k < nv; k++) {
        a[k] = kt_op_multiply(g, a[k], inverse[k]);
        for (int i = tree->before[k]; i >= 0; i = tree->before[i])
            a[k] = kt_op_subtract(g, a[k], kt_op_multiply(g, work[(size_t)k * (size_t)nv + (size_t)i], a[i]));
    }
    free(inverse);
}

/* ---- energy ------------------------------------------------------------------------------------------------------ */

/* The velocity of a link: of its origin, and angular. In its own axes. */
typedef struct code_speed {
    kt_code_frame frame;
    kt_op3 omega, linear;
    kt_op3 moment; /* first moment of all that it carries */
    kt_op mass;
} code_speed;

static void speed_link(kt_code_tree *tree, int i, code_speed *all) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    code_speed *s = &all[i];
    const code_speed *p = &all[l->parent];
    kt_op3 spin, shift;
    kt_graph_section(g, "%s: velocity of link %d in its own axes\nw = R'w_p + s v,  u = R'(u_p + w_p x r) + s v",
                     l->name, i);
    s->frame = kt_code_frame_of(tree, i);
    kt_code_rates(tree, i, KT_OP_RATE, &spin, &shift);
    const kt_op3 carried = kt_op3_add(g, p->linear, kt_op3_cross(g, p->omega, s->frame.offset));
    s->linear = kt_code_from_rest(g, &s->frame, kt_op3_add(g, kt_code_rest_down(g, &s->frame, carried), shift));
    s->omega = kt_op3_add(g, kt_code_down(g, &s->frame, p->omega), spin);
    kt_op3_name(g, s->omega, "w", i);
    kt_op3_name(g, s->linear, "u", i);
}

/* Twice the kinetic energy of a link and of the rotors of its joint. */
static kt_op twice_energy(kt_code_tree *tree, int i, const code_speed *s) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_op3 momentum = kt_op3_add(g, kt_op3_scale(g, l->mass, s->linear),
                                       kt_op3_scale(g, kt_op_number(g, 2.0), kt_op3_cross(g, s->omega, l->moment)));
    kt_op sum = kt_op_add(g, kt_op3_dot(g, s->linear, momentum),
                          kt_op3_dot(g, s->omega, kt_op6_apply(g, &l->inertia, s->omega)));
    for (int k = 0; k < kt_link_dofs(l->link); k++) {
        const kt_op v = kt_op_input(g, KT_OP_RATE, l->link->v + k);
        sum = kt_op_add(g, sum, kt_op_multiply(g, l->armature[k], kt_op_multiply(g, v, v)));
    }
    return sum;
}

static code_speed *speed_links(kt_code_tree *tree) {
    kt_graph *g = tree->graph;
    code_speed *all = calloc((size_t)tree->link_count, sizeof *all);
    if (all == NULL) {
        g->failed = true;
        return NULL;
    }
    all[0].omega = all[0].linear = kt_op3_zero(g);
    for (int i = 1; i < tree->link_count; i++)
        speed_link(tree, i, all);
    return all;
}

void kt_code_energy(kt_code_tree *tree, kt_op energy[2]) {
    kt_graph *g = tree->graph;
    code_speed *all = speed_links(tree);
    if (all == NULL)
        return;
    kt_op twice = kt_op_number(g, 0.0);
    for (int i = 0; i < tree->link_count; i++) {
        const kt_code_link *l = &tree->link[i];
        all[i].moment = l->moment;
        all[i].mass = l->mass;
        kt_graph_section(g, "%s: kinetic energy, m u.u / 2 + u.(w x h) + w.J w / 2", i > 0 ? l->name : "ground");
        if (i > 0)
            twice = kt_op_add(g, twice, twice_energy(tree, i, &all[i]));
    }
    energy[0] = kt_op_multiply(g, kt_op_number(g, 0.5), twice);
    for (int i = tree->link_count - 1; i > 0; i--) {
        const code_speed *s = &all[i];
        code_speed *p = &all[tree->link[i].parent];
        kt_graph_section(g, "%s: first moment, R h + m r", tree->link[i].name);
        const kt_op3 moved =
            kt_op3_add(g, kt_code_up(g, &s->frame, s->moment), kt_op3_scale(g, s->mass, s->frame.offset));
        p->moment = kt_op3_add(g, p->moment, moved);
        p->mass = kt_op_add(g, p->mass, s->mass);
    }
    kt_graph_section(g, "potential energy: - g . h");
    energy[1] = kt_op_negate(g, kt_op3_dot(g, tree->gravity, all[0].moment));
    free(all);
}

/* ---- markers ----------------------------------------------------------------------------------------------------- */

/* The rotation from a link's axes to those of its parent. */
static kt_op33 turn_of_frame(kt_graph *g, const kt_code_frame *f) {
    kt_op33 out;
    for (int k = 0; k < 3; k++) {
        kt_op3 unit = kt_op3_zero(g);
        unit.x[k] = kt_op_number(g, 1.0);
        const kt_op3 column = kt_code_up(g, f, unit);
        for (int i = 0; i < 3; i++)
            out.row[i].x[k] = column.x[i];
    }
    return out;
}

void kt_code_markers(kt_code_tree *tree, kt_op *out) {
    kt_graph *g = tree->graph;
    const kt_model *model = tree->model;
    const int count = (int)model->n.marker;
    code_speed *all = speed_links(tree);
    kt_op33 *turn = calloc((size_t)tree->link_count, sizeof *turn);
    kt_op3 *position = calloc((size_t)tree->link_count, sizeof *position);
    g->failed |= turn == NULL || position == NULL;
    for (int i = 0; i < tree->link_count && !g->failed; i++) {
        static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
        const int up = tree->link[i].parent;
        kt_graph_section(g, "%s: rotation and position of link %d in the world", i > 0 ? tree->link[i].name : "ground",
                         i);
        turn[i] = kt_op33_of(g, unit);
        position[i] = kt_op3_zero(g);
        if (i == 0)
            continue;
        const kt_op33 own = turn_of_frame(g, &all[i].frame);
        turn[i] = kt_op33_multiply(g, &turn[up], &own);
        position[i] = kt_op3_add(g, position[up], kt_op33_apply(g, &turn[up], all[i].frame.offset));
        kt_op3_name(g, position[i], "p", i);
    }
    for (int b = 0; b < (int)model->n.body && !g->failed; b++)
        for (int k = 0; k < model->body[b].marker_count; k++) {
            const int link = model->body[b].link, index = model->body[b].marker + k;
            kt_graph_section(g, "marker %s of %s: p + R c,  R (u + w x c)", kt_marker_name(model, b, k),
                             kt_body_name(model, b));
            const kt_op3 arm = kt_code_marker(tree, b, k);
            const kt_op3 rate = kt_op3_add(g, all[link].linear, kt_op3_cross(g, all[link].omega, arm));
            const kt_op3 at = kt_op3_add(g, position[link], kt_op33_apply(g, &turn[link], arm));
            const kt_op3 velocity = kt_op33_apply(g, &turn[link], rate);
            for (int x = 0; x < 3; x++) {
                out[3 * index + x] = at.x[x];
                out[3 * (count + index) + x] = velocity.x[x];
            }
        }
    free(all);
    free(turn);
    free(position);
}
