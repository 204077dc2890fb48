/* Derivatives of the joint forces of effects with respect to the state.
 *
 * Let W = (m, f) be the wrench on the last end of an effect, about its point p. The wrench on the other end, or on the
 * ground, is -W about the same point. Let S_k = (s_k, j_k) be a degree of freedom expressed about p (its rotation, and
 * its velocity at p). Let sigma_k = 1 if it moves the last end, -1 if it moves the other. Then
 *     tau_i = sigma_i S_i . W
 * Only the relative motion changes W, by the matrices of the effect (kt_effect_jacobian):
 *     with v_k:   dW = sigma_k C S_k
 *     with q_k:   dW = g_k                     of the last end
 *                 dW = s_k x W - g_k           of the other, as both ends' displacement rotates W
 *                 g_k = K S_k + C (s_k x w + psi'_k, s_k x v + psi'_k)
 * where w and v are the last end's angular velocity and velocity, and psi' (dof.h) is about p, too. S_i changes in
 * addition: the degrees of freedom before it and those of its node carry it along, and p moves with the last end. All
 * of this together is
 *     dtau_i / dq_k = sigma_i sigma_k S_i . X,   X = g_k - s_k x W      or   X = g_k + (j_k x f, 0)
 *     dtau_i / dv_k = sigma_i sigma_k S_i . C S_k
 * The first X is for those i that k of the last end carries, and for those that k of the other end does not carry, on
 * either end. The second is for all others.
 *
 * The rate of an auxiliary state is a formula, as the force in a joint is, with a row in matrices of its own. Formulas
 * that read auxiliary states add columns by these.
 *
 * The poses, S and psi' are those of the terms of the tree (dynamics/dynamics_derivative.h). Positions are relative to
 * the base of a tree, and velocities to that of its first link, so that nothing cancels far from the world's origin.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/effect_derivatives.h"

#include "base/copy.h"
#include "derivative/dual_effect.h"
#include "derivative/effect_columns.h"
#include "derivative/gravity_force.h"
#include "derivative/path_derivatives.h"
#include "effect/effect.h"
#include "evaluate/effect_formula.h"
#include "evaluate/evaluate.h"
#include "evaluate/relative_force.h"

#include <string.h>

/* ---- one effect -------------------------------------------------------------------------------------------------- */

/* An effect's ends, and the bases that the velocities of their trees are relative to. */
typedef struct ends {
    int last;
    kt_effect_pair base[2];
    kt_end_motion motion[2];
    kt_effect_end end[2];
} ends;

/* Finds the ends, and the path between them. Returns the number of degrees of freedom on it. */
static size_t find_differentiated_ends(const kt_effects_state *s, const kt_effect_record *effect, ends *e) {
    const int32_t carrier = effect->ends == 2 ? kt_effect_carrier_of(s->model, effect->link[0], effect->link[1]) : 0;
    size_t count = 0;
    e->last = effect->ends - 1;
    for (int k = 0; k <= e->last; k++) /* on one tree both are relative to its base */
        e->base[k] = kt_effect_base_of(s, carrier ? 0 : effect->link[k]);
    for (int k = 0; k <= e->last; k++)
        kt_effect_find_end(s, effect, k, e->base[k], e->base[effect->link[0] ? 0 : e->last].a, &e->motion[k],
                           &e->end[k]);
    for (int k = 0; k <= e->last; k++)
        count = kt_effect_follow(s, carrier, effect->link[k], k, e->motion[k].origin, e->motion[e->last].point, count);
    return count;
}

/* Subtracts the column of degree of freedom k. */
static void subtract_dof_column(const kt_effects_state *s, const kt_effect_dof *k, size_t count,
                                const kt_effect_columns *c, double *d_q, double *d_v) {
    const size_t column = k->v * s->model->n.v;
    for (size_t a = 0; a < count; a++) {
        const kt_effect_dof *i = &s->path[a];
        const bool same = i->end == k->end;
        const kt_effect_pair *by = same && i->index >= k->first ? &c->carried : &c->others;
        const double x = kt_v4_dot2(i->s[0], by->a, i->s[1], by->b);
        const double y = kt_v4_dot2(i->s[0], c->rate.a, i->s[1], c->rate.b);
        d_q[column + i->v] -= same ? x : -x;
        d_v[column + i->v] -= same ? y : -y;
    }
}

/* Subtracts the columns of all degrees of freedom on the path, of an effect whose matrices are by its last end. */
static void subtract_jacobian(const kt_effects_state *s, const ends *e, const kt_effect_jacobian *jacobian,
                              size_t count, double *d_q, double *d_v) {
    for (size_t b = 0; b < count; b++) {
        const kt_effect_dof *k = &s->path[b];
        const kt_end_motion *last = &e->motion[e->last];
        kt_effect_columns c;
        kt_effect_find_columns(jacobian, last->omega, last->velocity - e->base[k->end].b, k, k->end == e->last, &c);
        subtract_dof_column(s, k, count, &c, d_q, d_v);
    }
}

/* Finds the derivatives of the force in a coordinate, by the coordinate and by its rate. */
static void find_joint_derivatives(const kt_effects_state *s, const kt_effect_record *effect, double q, double v,
                                   double derivative[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    derivative[0] = derivative[1] = 0.0;
    (kind->joint_derivatives ? kind->joint_derivatives : kt_dual_joint_derivatives)(effect, s->model->number, q, v,
                                                                                    s->at->t, derivative);
}

/* The Jacobian of an effect by its force in a coordinate of a loop. */
static void write_relative_jacobian(const kt_effects_state *s, const kt_effect_record *effect, const kt_effect_end *end,
                                    kt_effect_jacobian *jacobian) {
    const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, end);
    double force[3];
    force[0] = kt_effect_kind_of(effect->type)
                   ->joint_force(effect, s->model->number, motion.position, motion.rate, s->at->t, NULL);
    find_joint_derivatives(s, effect, motion.position, motion.rate, force + 1);
    kt_dual_relative_jacobian(effect, &s->model->loop[effect->relative.loop], motion.counted, force, end, jacobian);
}

/* Subtracts the derivatives of the joint forces of an effect on one or two ends: by its relative coordinate, by
 * matrices in closed form, or by dual numbers. On fixed ends it has none. */
static void subtract_wrench(const kt_effects_state *s, const kt_effect_record *effect, double *d_q, double *d_v) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    kt_effect_jacobian jacobian = {.at_point = false};
    ends e;
    const size_t count = find_differentiated_ends(s, effect, &e);
    if (count == 0)
        return;
    if (effect->relative.type)
        write_relative_jacobian(s, effect, e.end, &jacobian);
    else if (kind->jacobian && !effect->disc)
        kind->jacobian(effect, s->model->number, e.end, s->at->t, &jacobian);
    else
        kt_dual_effect_jacobian(effect, s->model->number, e.end, s->at->t, &jacobian);
    subtract_jacobian(s, &e, &jacobian, count, d_q, d_v);
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* The formulas of an effect in a state: values, and partial derivatives by each variable. */
typedef struct formulas {
    double value[8]; /* of six formulas, and the derivatives of the first by the distance of the ends and by its rate */
    double by[KT_FORMULA_VARIABLE_MAX][6];
} formulas;

/* A marker as the only end of an effect. */
static kt_effect_record marker_end_of(const kt_variable_record *variable) {
    kt_effect_record marker = {.ends = 1, .link = {variable->link, 0}};
    marker.frame[0] = (kt_pose){.position = variable->arm, .rotation = kt_mat3_identity()};
    return marker;
}

/* Reads the same variables as kt_formula_variables_read, with the poses of the terms of the tree. */
static void read_effect_variables(const kt_effects_state *s, const kt_effect_record *effect, const kt_effect_end *end,
                                  double *values) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_formula_variables_read(s->model, s->data, NULL, effect, s->at, end, values);
    for (int32_t k = 0; k < effect->variable_count; k++) {
        const kt_variable_record *variable = &s->model->variable[effect->variable + k];
        if (variable->type == KT_VARIABLE_GRAVITY)
            values[k] = kt_gravity_force_of(s->model, s->x, variable);
        if (variable->type != KT_VARIABLE_MARKER && variable->type != KT_VARIABLE_MARKER_VELOCITY)
            continue;
        const kt_effect_record marker = marker_end_of(variable);
        kt_end_motion motion;
        kt_effect_end found;
        kt_effect_find_end(s, &marker, 0, kt_effect_base_of(s, variable->link), none, &motion, &found);
        values[k] = (variable->type == KT_VARIABLE_MARKER ? motion.point : motion.velocity)[variable->component];
    }
}

static int differentiate_law(const kt_effects_state *s, const kt_effect_record *effect, double *values, formulas *f) {
    return kt_law_is_differenced(effect) ? kt_law_difference(effect, values, f->by, &s->data->difference_error)
                                         : kt_law_differentiate(effect, values, f->by);
}

/* The partial derivatives of the formulas by each variable: the first Taylor coefficient along its unit vector. */
static void differentiate_text(const kt_effects_state *s, const kt_effect_record *effect, const double *values,
                               formulas *f) {
    double unit[KT_FORMULA_VARIABLE_MAX] = {0.0}, y[3];
    for (int32_t m = 0; m < effect->variable_count; m++) {
        unit[m] = 1.0;
        for (int k = 0; k < 6; k++) {
            y[1] = 0.0;
            kt_expression_taylor(kt_formula_of(s->model, effect, k), values, unit, NULL, y);
            f->by[m][k] = y[1];
        }
        unit[m] = 0.0;
    }
}

/* Returns the code of a law's callback, otherwise 0. */
static int differentiate_formulas(const kt_effects_state *s, const kt_effect_record *effect, const kt_effect_end *end,
                                  formulas *f) {
    double values[KT_FORMULA_VARIABLE_MAX];
    read_effect_variables(s, effect, end, values);
    memset(f, 0, sizeof *f);
    int code = kt_formulas_evaluate(s->model, effect, values, f->value);
    if (effect->law != NULL && code == 0)
        code = differentiate_law(s, effect, values, f);
    else
        differentiate_text(s, effect, values, f);
    for (int32_t m = 0; m < effect->variable_count; m++) {
        const int32_t type = s->model->variable[effect->variable + m].type;
        if (type == KT_VARIABLE_LENGTH || type == KT_VARIABLE_SPEED)
            f->value[type == KT_VARIABLE_LENGTH ? 6 : 7] += f->by[m][0];
    }
    return code;
}

/* The matrices from which the derivatives of formulas are subtracted, column-major: by positions, velocities and
 * auxiliary states. */
typedef struct target {
    double *q, *v, *x;
    size_t rows, row; /* row: of a formula without ends */
} target;

/* Subtracts from column `column` of d the joint forces of the wrenches x[k] on the ends k of an effect, times a factor.
 * For a formula without ends, subtracts x[0].b[0]. */
static void subtract_forces(const kt_effects_state *s, const kt_effect_record *effect, const target *to, size_t count,
                            const kt_effect_pair *x, double factor, size_t column, double *d) {
    d += column * to->rows;
    if (effect->ends == 0)
        d[to->row] -= factor * x[0].b[0];
    for (size_t a = 0; a < count; a++) {
        const kt_effect_dof *i = &s->path[a];
        d[i->v] -= factor * kt_v4_dot2(i->s[0], x[i->end].a, i->s[1], x[i->end].b);
    }
}

/* Subtracts the terms of a variable u that reads a marker, with x = dW/du. The derivatives du/dq and du/dv are those of
 * the marker's point, as for the last end of an effect. */
static void subtract_marker(const kt_effects_state *s, const kt_effect_record *effect, const target *to, size_t count,
                            const kt_effect_pair *x, const kt_variable_record *variable) {
    const kt_effect_record marker = marker_end_of(variable);
    const kt_effect_pair base = kt_effect_base_of(s, variable->link);
    const int c = variable->component;
    kt_end_motion motion;
    kt_effect_end end;
    kt_effect_find_end(s, &marker, 0, base, base.a, &motion, &end);
    const size_t last = kt_effect_follow(s, 0, variable->link, 0, motion.origin, motion.point, count);
    for (size_t b = count; b < last; b++) {
        const kt_effect_dof *k = &s->path[b];
        const kt_v4 turned = kt_v4_cross(k->s[0], motion.velocity - base.b) + k->psi[1];
        const bool is_point = variable->type == KT_VARIABLE_MARKER;
        subtract_forces(s, effect, to, count, x, is_point ? k->s[1][c] : turned[c], k->v, to->q);
        if (!is_point)
            subtract_forces(s, effect, to, count, x, k->s[1][c], k->v, to->v);
    }
}

/* Subtracts the terms of a variable that is a gravity force, with x = dW/du. */
static void subtract_gravity_force(const kt_effects_state *s, const kt_effect_record *effect, const target *to,
                                   size_t count, const kt_effect_pair *x, const kt_variable_record *variable) {
    const kt_derivative_work *w = s->x;
    const kt_derivative_node *node = &w->node[w->row[kt_gravity_dof_of(s->model, w, variable)].node];
    const int32_t after = node->first + node->count, end = s->model->link[variable->link].end;
    for (int32_t k = after - 1; k >= 0; k = w->row[k].before)
        subtract_forces(s, effect, to, count, x, kt_gravity_force_by(s->model, w, variable, k), (size_t)w->row[k].v,
                        to->q);
    for (int32_t k = after; k < end; k++)
        subtract_forces(s, effect, to, count, x, kt_gravity_force_by(s->model, w, variable, k), (size_t)w->row[k].v,
                        to->q);
}

/* Writes the wrenches on all ends from formulas with these values; in a joint, the force is x[0].b[0]. path: the path,
 * for an effect along a path. */
static void find_wrenches(const kt_effects_state *s, const kt_effect_record *effect, const double values[6],
                          const kt_effect_end *end, const kt_path_ends *path, kt_effect_pair *x) {
    kt_wrench wrench[2];
    if (effect->ends == 0) {
        x[0] = (kt_effect_pair){kt_v4_splat(0.0), kt_v4_splat(values[0])};
        return;
    }
    if (effect->path_count > 0) {
        kt_path_wrenches_find(effect, path, values[0], x);
        return;
    }
    if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, end);
        kt_relative_wrenches(&motion, end, values[0], wrench);
    } else {
        kt_effect_kind_of(effect->type)->formula_wrench(effect, values, end, wrench, NULL);
    }
    const int last = effect->ends - 1; /* the wrench on the other end is the opposite, about the same point */
    x[last] = (kt_effect_pair){kt_v4_from(wrench[last].moment), kt_v4_from(wrench[last].force)};
    if (last > 0)
        x[0] = (kt_effect_pair){-x[last].a, -x[last].b};
}

/* Subtracts the change of the wrenches with the motion of the effect's ends. */
static void subtract_ends(const kt_effects_state *s, const kt_effect_record *effect, const formulas *f, const ends *e,
                          const kt_path_ends *path, size_t count, const target *to) {
    const double force[3] = {f->value[0], f->value[6], f->value[7]};
    kt_effect_jacobian jacobian;
    if (effect->path_count > 0) {
        kt_path_subtract(s, effect, path, force, count, to->q, to->v);
        return;
    }
    if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, e->end);
        kt_dual_relative_jacobian(effect, &s->model->loop[effect->relative.loop], motion.counted, force, e->end,
                                  &jacobian);
    } else {
        kt_effect_kind_of(effect->type)->jacobian(effect, f->value, e->end, s->at->t, &jacobian);
    }
    subtract_jacobian(s, e, &jacobian, count, to->q, to->v);
}

/* Subtracts the change of the wrenches with each variable. */
static void subtract_variables(const kt_effects_state *s, const kt_effect_record *effect, const formulas *f,
                               const ends *e, const kt_path_ends *path, size_t count, const target *to) {
    for (int32_t m = 0; m < effect->variable_count; m++) {
        const kt_variable_record *variable = &s->model->variable[effect->variable + m];
        kt_effect_pair x[KT_PATH_LINK_MAX];
        find_wrenches(s, effect, f->by[m], e->end, path, x);
        if (variable->type == KT_VARIABLE_POSITION)
            subtract_forces(s, effect, to, count, x, 1.0, (size_t)variable->v, to->q);
        else if (variable->type == KT_VARIABLE_VELOCITY)
            subtract_forces(s, effect, to, count, x, 1.0, (size_t)variable->v, to->v);
        else if (variable->type == KT_VARIABLE_STATE)
            subtract_forces(s, effect, to, count, x, 1.0, (size_t)variable->x, to->x);
        else if (variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY)
            subtract_marker(s, effect, to, count, x, variable);
        else if (variable->type == KT_VARIABLE_GRAVITY)
            subtract_gravity_force(s, effect, to, count, x, variable);
    }
}

/* Subtracts all changes of an effect's wrenches. Rejects derivatives of laws that are not finite. Derivatives of
 * formulas are finite wherever the values are finite, except at kinks. */
static kt_status subtract_formulas(const kt_effects_state *s, const kt_effect_record *effect, const target *to,
                                   kt_error *error) {
    const bool has_path = effect->path_count > 0;
    kt_path_ends path;
    ends e = {.last = 0};
    formulas f;
    const size_t count = has_path           ? kt_path_ends_find(s, effect, &path, e.end)
                         : effect->ends > 0 ? find_differentiated_ends(s, effect, &e)
                                            : 0;
    const int code = differentiate_formulas(s, effect, e.end, &f);
    if (code != 0 || (effect->law != NULL && !kt_all_finite((const double *)&f, sizeof f / sizeof(double))))
        return kt_effect_reject_derivatives(s->model, effect, s->at->t, code, error);
    if (effect->ends > 0)
        subtract_ends(s, effect, &f, &e, &path, count, to);
    subtract_variables(s, effect, &f, &e, &path, count, to);
    return KT_OK;
}

/* The rates of auxiliary states. */
static kt_status write_rate_derivatives(const kt_effects_state *s, const kt_state_derivatives *states,
                                        kt_error *error) {
    const size_t n = s->model->n.v, x = s->model->n.x;
    target to = {.q = states->rate_q, .v = states->rate_v, .x = states->rate_x, .rows = x};
    kt_clear(states->force, n * x * sizeof(double));
    kt_clear(states->rate_q, n * x * sizeof(double));
    kt_clear(states->rate_v, n * x * sizeof(double));
    kt_clear(states->rate_x, x * x * sizeof(double));
    kt_status status = KT_OK;
    for (to.row = 0; to.row < x && status == KT_OK; to.row++)
        status = subtract_formulas(s, &s->model->state[to.row], &to, error);
    return status;
}

/* ---- a caller's own ---------------------------------------------------------------------------------------------- */

/* Finds the ends in world coordinates, and the path from the ground to each end. */
static size_t find_own_ends(const kt_effects_state *s, const kt_effect_record *effect, ends *e) {
    size_t count = 0;
    e->last = effect->ends - 1;
    for (int k = 0; k <= e->last; k++) {
        e->base[k] = kt_effect_base_of(s, effect->link[k]);
        kt_effect_find_end(s, effect, k, e->base[k], kt_v4_splat(0.0), &e->motion[k], &e->end[k]);
        count = kt_effect_follow(s, 0, effect->link[k], k, e->motion[k].origin, e->motion[k].point, count);
    }
    return count;
}

/* All that is read of an effect's wrenches and their derivatives. */
static bool are_finite(const kt_effect_record *effect, const kt_wrench wrench[2], const kt_effect_derivatives *of) {
    bool finite = kt_all_finite((const double *)wrench, 2 * sizeof *wrench / sizeof(double));
    for (int i = 0; i < effect->ends; i++)
        for (int j = 0; j < effect->ends; j++)
            finite =
                finite && kt_all_finite((const double *)&of->wrench[i][j], sizeof of->wrench[i][j] / sizeof(double));
    return finite;
}

/* The caller's derivatives of the wrench on `end` are by the motion of either end, in world coordinates. Thus the ends
 * are treated one by one, with paths from the ground. The wrench itself turns along only with its own end. */
static kt_status subtract_own_wrench(const kt_effects_state *s, const kt_effect_record *effect, double *d_q,
                                     double *d_v, kt_error *error) {
    kt_effect_derivatives of;
    kt_wrench wrench[2];
    ends e;
    const size_t count = find_own_ends(s, effect, &e);
    memset(&of, 0, sizeof of);
    memset(wrench, 0, sizeof wrench);
    int code = effect->wrench(effect->user, s->at->t, e.end, wrench, NULL);
    if (code == 0)
        code = effect->wrench_derivatives(effect->user, s->at->t, e.end, &of);
    if (code != 0 || !are_finite(effect, wrench, &of))
        return kt_effect_reject_derivatives(s->model, effect, s->at->t, code, error);
    for (int end = 0; end <= e.last; end++)
        for (size_t b = 0; b < count; b++) {
            const kt_effect_dof *k = &s->path[b];
            const kt_end_motion *moved = &e.motion[k->end];
            const kt_wrench_derivatives *by = &of.wrench[end][k->end];
            kt_effect_jacobian jacobian = {.at_point = false};
            kt_effect_columns c;
            memcpy(jacobian.stiffness, by->by_pose, sizeof jacobian.stiffness);
            memcpy(jacobian.damping, by->by_twist, sizeof jacobian.damping);
            if (k->end == end) {
                jacobian.moment = wrench[end].moment;
                jacobian.force = wrench[end].force;
            }
            kt_effect_find_columns(&jacobian, moved->omega, moved->velocity - e.base[k->end].b, k, true, &c);
            kt_effect_subtract_own_column(s, k, end, count, &c, d_q, d_v);
        }
    return KT_OK;
}

/* Likewise for a force in a joint of one coordinate, which has entries on the diagonal alone. */
static kt_status subtract_own_joint_force(const kt_effects_state *s, const kt_effect_record *effect, double *d_q,
                                          double *d_v, kt_error *error) {
    const kt_link *link = &s->model->link[effect->link[0]];
    const size_t diagonal = (size_t)link->v * (s->model->n.v + 1);
    double derivatives[3] = {0.0, 0.0, 0.0};
    const int code =
        effect->joint_force_derivatives(effect->user, s->at->t, s->at->q[link->q], s->at->v[link->v], derivatives);
    if (code != 0 || !kt_all_finite(derivatives, 2))
        return kt_effect_reject_derivatives(s->model, effect, s->at->t, code, error);
    d_q[diagonal] -= derivatives[0];
    d_v[diagonal] -= derivatives[1];
    return KT_OK;
}

/* In a loop. */
static kt_status subtract_own_relative(const kt_effects_state *s, const kt_effect_record *effect, double *d_q,
                                       double *d_v, kt_error *error) {
    double force[4] = {0.0, 0.0, 0.0, 0.0}; /* and its derivatives by the coordinate, its rate, and time */
    kt_effect_jacobian jacobian;
    ends e;
    const size_t count = find_differentiated_ends(s, effect, &e);
    const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, e.end);
    int code = effect->joint_force(effect->user, s->at->t, motion.position, motion.rate, force, NULL);
    if (code == 0)
        code = effect->joint_force_derivatives(effect->user, s->at->t, motion.position, motion.rate, force + 1);
    if (code != 0 || !kt_all_finite(force, 3))
        return kt_effect_reject_derivatives(s->model, effect, s->at->t, code, error);
    kt_dual_relative_jacobian(effect, &s->model->loop[effect->relative.loop], motion.counted, force, e.end, &jacobian);
    subtract_jacobian(s, &e, &jacobian, count, d_q, d_v);
    return KT_OK;
}

static kt_status subtract_own(const kt_effects_state *s, const kt_effect_record *effect, double *d_q, double *d_v,
                              kt_error *error) {
    if (effect->relative.type)
        return subtract_own_relative(s, effect, d_q, d_v, error);
    return effect->ends ? subtract_own_wrench(s, effect, d_q, d_v, error)
                        : subtract_own_joint_force(s, effect, d_q, d_v, error);
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

static void subtract_joint_force(const kt_effects_state *s, const kt_effect_record *effect, double *d_q, double *d_v) {
    const kt_link *link = &s->model->link[effect->link[0]];
    const size_t diagonal = (size_t)link->v * (s->model->n.v + 1);
    double derivative[2];
    find_joint_derivatives(s, effect, s->at->q[link->q], s->at->v[link->v], derivative);
    d_q[diagonal] -= derivative[0];
    d_v[diagonal] -= derivative[1];
}

kt_status kt_effects_differentiate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                   const kt_derivative_work *x, kt_effect_dof *path, const kt_state_derivatives *states,
                                   kt_error *error) {
    const kt_effects_state s = {.model = model, .data = data, .x = x, .at = at, .path = path};
    double *d_q = (double *)x->dq, *d_v = (double *)x->dv;
    target to = {.q = d_q, .v = d_v, .x = states->force, .rows = model->n.v};
    kt_status status = write_rate_derivatives(&s, states, error);
    for (size_t i = 0; i < model->n.effect && status == KT_OK; i++) {
        const kt_effect_record *effect = &model->effect[i];
        if (kt_effect_is_differenced(effect))
            continue;
        if (effect->type == KT_EFFECT_CUSTOM)
            status = subtract_own(&s, effect, d_q, d_v, error);
        else if (effect->type == KT_EFFECT_EXPRESSION) {
            to.row = (size_t)model->link[effect->link[0]].v;
            status = subtract_formulas(&s, effect, &to, error);
        } else if (effect->ends)
            subtract_wrench(&s, effect, d_q, d_v);
        else
            subtract_joint_force(&s, effect, d_q, d_v);
    }
    return status;
}
