/* Shares reactions among redundant loops.
 *
 * The balance of forces leaves the reactions r of a group of loops, and of the joints on their paths, open by W z
 * (constraint/self_stress.c). In a real mechanism, elasticity and clearance decide, which a model of rigid bodies does
 * not have. The library takes the least sum
 *
 *     S |F|^2 + |M|^2 / L^2     over the loops, and the joints of the group that move:     z = -(D W)^+ D r,
 *
 * each moment about the point at which the reaction is reported. D divides moments by L, the length of the longest loop
 * once around. A relation counts with the forces on its joints. The least sum is that of an elastic mechanism whose
 * joints all yield alike, to a force as to a moment over L. A component is unique if its row of W is zero.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "constraint/self_stress.h"
#include "evaluate/evaluate.h"
#include "kinetree/mechanism.h"
#include "reduction/kernel.h"

#include <string.h>

/* Parts of a component that are rounding, relative to the whole self-stress. */
static const double unique_below = 1e-8;

/* Self-stresses that are rounding, relative to the reactions. */
static const double least_share = 1e-13;

/* data->stress_count of a group whose self-stresses have not been needed so far. */
enum { NOT_FOUND = -1 };

typedef struct sharing {
    const kt_model *model;
    kt_data *data;
    size_t g;
    kt_stress s;
    int rows, d; /* rows of W in use; self-stresses */
} sharing;

static kt_vec3 plane_normal(const kt_model *model, const kt_group *planar) {
    const size_t link = (size_t)model->group_link[planar->link] - model->n.spatial + 1; /* its planar index */
    return model->plane[model->planar_rest[link].plane].basis.z;
}

/* The self-stresses of a group, with the rows of the joints and loops that share them. */
static sharing sharing_of(const kt_model *model, kt_data *data, size_t g) {
    sharing w = {model, data, g, kt_stress_of(model, data, g), 0, data->stress_count[g]};
    const kt_group *group = &model->group[g];
    w.rows = KT_STRESS_JOINT * kt_stress_number_joints(model, g, data->stress_joint);
    for (int i = 0; i < group->loop_count; i++)
        w.rows += kt_stress_shares(&model->loop[model->group_loop[group->loop + i]]) ? KT_STRESS_LOOP : 0;
    return w;
}

/* Is called with the first row of a joint (body, and -1) or a loop (-1, and loop). */
typedef void visit_rows(const sharing *w, int row, int32_t body, int32_t loop, void *context);

/* Visits the rows of all joints on paths of loops, in their order, and then the rows of the loops. */
static void visit_stress(const sharing *w, visit_rows *visit, void *context) {
    const kt_model *model = w->model;
    const kt_group *group = &model->group[w->g];
    int32_t next = 0;
    int end;
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        kt_stress_path path = {{loop->body[0], loop->body[1]}};
        int32_t body;
        while (kt_stress_shares(loop) && !loop->term_count && (body = kt_stress_path_next(model, &path, &end)) >= 0)
            if (w->data->stress_joint[body] == next) /* joints are numbered in this order */
                visit(w, KT_STRESS_JOINT * next++, body, -1, context);
    }
    int row = KT_STRESS_JOINT * next;
    for (int i = 0; i < group->loop_count; i++) {
        const int32_t index = model->group_loop[group->loop + i];
        if (!kt_stress_shares(&model->loop[index]))
            continue;
        visit(w, row, -1, index, context);
        row += KT_STRESS_LOOP;
    }
}

/* ---- the objective ----------------------------------------------------------------------------------------------- */

/* Writes the rows of D. Joints that do not move, and the wrench of a relation, do not count. */
static void set_weights(const sharing *w, int row, int32_t body, int32_t loop, void *context) {
    double *weight = context;
    const double per_length = 1.0 / w->model->group[w->g].stress_length;
    const bool counts = body >= 0 ? w->model->body[body].type != KT_JOINT_FIXED : !w->model->loop[loop].term_count;
    for (int c = 0; c < 6; c++)
        weight[row + c] = !counts ? 0.0 : c < 3 ? per_length : 1.0;
    if (loop >= 0)
        weight[row + KT_STRESS_RELATION] = w->model->loop[loop].term_count ? 1.0 : 0.0;
}

/* Factors D W; returns its rank. The array `value` holds D. */
static int factor_objective(const sharing *w) {
    const kt_stress *s = &w->s;
    const kt_qr qr = {w->rows, w->d, s->factor, s->reflector_scale, s->pivot};
    double all, first = 0.0;
    int rank = 0;
    for (int c = 0; c < w->d; c++) {
        double *to = s->factor + (size_t)c * (size_t)w->rows;
        for (int i = 0; i < w->rows; i++)
            to[i] = s->value[i] * s->wrench[(size_t)c * s->rows + (size_t)i];
        s->pivot[c] = c;
        s->norm[c] = kt_dense_dot(to, to, w->rows);
    }
    for (; rank < w->d && rank < w->rows; rank++) {
        const int best = kt_longest_column(s->norm, rank, w->d, &all);
        first = rank ? first : sqrt(s->norm[best]);
        if (!(sqrt(s->norm[best]) > KT_RANK_TOLERANCE * first))
            break;
        kt_qr_step(&qr, w->rows, rank, best, s->norm);
    }
    return rank;
}

/* ---- reactions --------------------------------------------------------------------------------------------------- */

typedef struct reactions_of {
    kt_wrench *joints, *loops; /* of bodies and loops */
} reactions_of;

static kt_wrench *reaction_of(const reactions_of *r, int32_t body, int32_t loop) {
    return body >= 0 ? &r->joints[body] : &r->loops[loop];
}

/* Multiplies D in `value` by the reactions before they are shared. A relation has the forces of its multiplier. */
static void apply_weights(const sharing *w, int row, int32_t body, int32_t loop, void *context) {
    const kt_stress *s = &w->s;
    const kt_wrench *r = reaction_of(context, body, loop);
    for (int c = 0; c < 3; c++) {
        s->value[row + c] *= kt_vec3_part(r->moment, c);
        s->value[row + c + 3] *= kt_vec3_part(r->force, c);
    }
    if (loop < 0 || !w->model->loop[loop].term_count)
        return;
    const kt_loop_record *of = &w->model->loop[loop];
    const int32_t slot = w->model->slot[of->slot];
    double size = 0.0; /* of the forces on joints by a unit multiplier */
    for (size_t i = 0; i < s->k; i++)
        for (int c = 0; c < w->d && s->equation[i] == of->equation && size == 0.0; c++) {
            const double n = s->basis[(size_t)c * s->k + i];
            size = n != 0.0 ? s->wrench[(size_t)c * s->rows + (size_t)row + KT_STRESS_RELATION] / n : 0.0;
        }
    const double *multiplier = kt_group_matrices(w->model, w->data, w->g, KT_ROWS_ALL).multiplier;
    s->value[row + KT_STRESS_RELATION] = slot < 0 ? 0.0 : size * multiplier[slot];
}

/* Adds the self-stresses, times their amounts z, to the wrench of one joint or loop. */
static void add_shares(const sharing *w, int row, int32_t body, int32_t loop, void *context) {
    kt_wrench *r = reaction_of(context, body, loop);
    for (int c = 0; c < w->d; c++) {
        const double *x = w->s.wrench + (size_t)c * w->s.rows + row, z = w->s.amount[c];
        r->moment = kt_vec3_add(r->moment, kt_vec3_scale(z, kt_vec3_make(x[0], x[1], x[2])));
        r->force = kt_vec3_add(r->force, kt_vec3_scale(z, kt_vec3_make(x[3], x[4], x[5])));
    }
}

/* Chooses the amounts of a group's self-stresses such that the weighted sum of the squares of the reactions is
 * least, and adds the stresses to the reactions and multipliers. */
static void share_group(const kt_model *model, kt_data *data, size_t g, reactions_of r) {
    const sharing w = sharing_of(model, data, g);
    const kt_stress *s = &w.s;
    const kt_qr qr = {w.rows, w.d, s->factor, s->reflector_scale, s->pivot};
    if (w.d == 0)
        return;
    visit_stress(&w, set_weights, s->value);
    const int rank = factor_objective(&w);
    visit_stress(&w, apply_weights, &r);
    for (int j = 0; j < rank; j++)
        kt_reflect(s->factor + (size_t)j * (size_t)w.rows, s->reflector_scale[j], j, w.rows, s->value);
    const double open = kt_dense_dot(s->value, s->value, rank);
    const double all = open + kt_dense_dot(s->value + rank, s->value + rank, w.rows - rank);
    if (!(open > least_share * least_share * all)) /* they are the least already: forces within a plane */
        return;
    kt_qr_solve(&qr, w.rows, rank, s->value);
    memset(s->amount, 0, (size_t)w.d * sizeof *s->amount);
    for (int j = 0; j < rank; j++)
        s->amount[s->pivot[j]] = -s->value[j];
    visit_stress(&w, add_shares, &r);
    for (size_t i = 0; i < s->k; i++)
        for (int c = 0; c < w.d; c++)
            data->stress_multiplier[s->equation[i]] += s->amount[c] * s->basis[(size_t)c * s->k + i];
}

/* Whether a wrench lies in the plane with this normal: the rest of it is rounding in the objective. */
static bool is_in_plane(const kt_wrench *wrench, kt_vec3 normal, double per_length) {
    const kt_vec3 moment = kt_vec3_scale(per_length, wrench->moment), across = kt_vec3_cross(normal, moment);
    const double along = kt_vec3_dot(normal, wrench->force), rest = along * along + kt_vec3_dot(across, across);
    const double all = kt_vec3_dot(wrench->force, wrench->force) + kt_vec3_dot(moment, moment);
    return !(rest > least_share * least_share * all);
}

/* Whether the reactions of a group have the least sum already, because they lie in its plane, and its self-stresses do
 * not. This holds for most planar mechanisms, and is known without the self-stresses. */
static bool have_least_sum(const kt_model *model, const kt_data *data, size_t g, const reactions_of *r) {
    const kt_group *group = &model->group[g];
    const kt_vec3 normal = plane_normal(model, group);
    const double per_length = 1.0 / group->stress_length;
    bool least = !data->near[g]; /* at a singular position there are self-stresses in the plane */
    for (int i = 0; i < group->loop_count && least; i++) {
        const int32_t index = model->group_loop[group->loop + i];
        const kt_loop_record *loop = &model->loop[index];
        kt_stress_path path = {{loop->body[0], loop->body[1]}};
        int32_t body;
        int end;
        if (!kt_stress_shares(loop) || loop->term_count)
            continue;
        least = is_in_plane(&r->loops[index], normal, per_length);
        while (least && (body = kt_stress_path_next(model, &path, &end)) >= 0)
            least = is_in_plane(&r->joints[body], normal, per_length);
    }
    return least;
}

void kt_stresses_find(const kt_model *model, kt_data *data, double t, const double *q, bool all) {
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].redundancy == KT_REDUNDANCY_SHARED && !all && model->group[g].is_redundant_in_normal)
            data->stress_count[g] = NOT_FOUND;
        else if (model->group[g].redundancy == KT_REDUNDANCY_SHARED)
            kt_reduction_kernels_in_space(model)->stress(model, data, g, t, q);
}

void kt_reactions_share(const kt_model *model, kt_data *data, double t, const double *q, kt_wrench *joints,
                        kt_wrench *loops) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    const reactions_of r = {joints, loops};
    for (size_t g = 0; g < model->n.group; g++) {
        if (model->group[g].redundancy != KT_REDUNDANCY_SHARED)
            continue;
        if (data->stress_count[g] == NOT_FOUND) {
            if (have_least_sum(model, data, g, &r))
                continue;
            kernels->pose(model, data, q); /* the kinematics of the links may have taken its place */
            kernels->stress(model, data, g, t, q);
        }
        share_group(model, data, g, r);
    }
}

/* ---- which are unique -------------------------------------------------------------------------------------------- */

typedef struct shares_of {
    kt_reaction_share *joints, *loops;
} shares_of;

/* Returns the size of row i of W in a basis in which D W is orthonormal: its row times R^-1. */
static double open_size(const sharing *w, int i) {
    double squares = 0.0, *y = w->s.amount;
    for (int j = 0; j < w->d; j++) {
        const double *r = w->s.factor + (size_t)j * (size_t)w->rows;
        y[j] = w->s.wrench[(size_t)w->s.pivot[j] * w->s.rows + (size_t)i];
        for (int k = 0; k < j; k++)
            y[j] -= r[k] * y[k];
        y[j] /= r[j];
        squares += y[j] * y[j];
    }
    return sqrt(squares);
}

/* Sets the bits of the components whose rows of W are not zero. */
static void mark_undetermined_reaction(const sharing *w, int row, int32_t body, int32_t loop, void *context) {
    const shares_of *r = context;
    kt_reaction_share *to = body >= 0 ? &r->joints[body] : &r->loops[loop];
    to->length = w->model->group[w->g].stress_length;
    for (int i = 0; i < (body >= 0 ? KT_STRESS_JOINT : KT_STRESS_LOOP); i++)
        if (open_size(w, row + i) > unique_below * (i < 3 ? to->length : 1.0))
            to->open |= 1U << (i < 3 ? i + 3 : i < KT_STRESS_RELATION ? i - 3 : i);
}

/* Returns the components that a planar group leaves undetermined if its equations in the plane are independent: forces
 * out of the plane, and moments in it. 0: these equations repeat others, too, or the group moves in space. */
static unsigned open_out_of_plane(const kt_model *model, const kt_group *group) {
    unsigned open = 0;
    if (!group->is_redundant_in_normal)
        return 0;
    const kt_vec3 normal = plane_normal(model, group);
    for (int i = 0; i < 3; i++) {
        const double along = fabs(kt_vec3_part(normal, i));
        open |= along > unique_below ? 1U << i : 0U;
        open |= sqrt(fmax(0.0, 1.0 - along * along)) > unique_below ? 8U << i : 0U;
    }
    return open;
}

static void mark_large_group(const kt_model *model, const kt_group *group, kt_reaction_share *loops) {
    const unsigned open = open_out_of_plane(model, group);
    for (int i = 0; i < group->loop_count; i++)
        if (kt_stress_shares(&model->loop[model->group_loop[group->loop + i]]))
            loops[model->group_loop[group->loop + i]] =
                (kt_reaction_share){.open = open, .length = group->stress_length, .is_too_large = true};
}

kt_status kt_reaction_shares(const kt_model *model, kt_data *data, double t, const double *q, kt_reaction_share *joints,
                             kt_reaction_share *loops, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, q || !model->n.q, joints && (loops || !model->n.loop)))
        return KT_ERROR_ARGUMENT;
    for (size_t i = 0; i < model->n.q; i++)
        if (!isfinite(q[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, "kt_reaction_shares", "q[%d] is %g", (int)i, q[i]);
    shares_of r = {joints, loops};
    for (size_t i = 0; i < model->n.body; i++)
        joints[i] = (kt_reaction_share){.open = 0};
    for (size_t i = 0; i < model->n.loop; i++)
        loops[i] = (kt_reaction_share){.open = 0};
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].redundancy == KT_REDUNDANCY_LARGE)
            mark_large_group(model, &model->group[g], loops);
    if (model->n.stress == 0)
        return KT_OK;
    kt_reduction_kernels_in_space(model)->pose(model, data, q);
    kt_stresses_find(model, data, t, q, true);
    for (size_t g = 0; g < model->n.group; g++) {
        if (model->group[g].redundancy != KT_REDUNDANCY_SHARED || data->stress_count[g] == 0)
            continue;
        sharing w = sharing_of(model, data, g);
        visit_stress(&w, set_weights, w.s.value);
        w.d = factor_objective(&w);
        visit_stress(&w, mark_undetermined_reaction, &r);
    }
    return KT_OK;
}
