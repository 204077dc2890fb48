/* Derivatives of the rates and columns of an instance along a direction (dy, du, dw), with y = (q, v, x), u = torque,
 * and w the numbers of signals (signal.h).
 *
 * A change dq of positions turns each quaternion p of any norm by d = 2 Im (p^-1 dp) in body axes, since the rotation
 * depends on p / |p| alone. With d for all joints (nv numbers), and E the map of kt_position_rate,
 *
 *     q' = E(q) v:            dq' = E(q) dv + E(dq) v
 *     v' = a(t, q, v, x, u):  dv' = a_q d + a_v dv + a_x dx + a_u du
 *     x' = f(t, q, v, x):     dx' = f_q d + f_v dv + f_x dx
 *
 * The matrices are exact (kt_acceleration_derivatives). They are computed once in a state, for all directions.
 *
 * A signal (f, f') of a servo in a joint has the force F(f - q, f' - v), so that F_f = -F_q and F_f' = -F_v. The force
 * of a spring does not depend on f'.
 *
 *     dv' += a_u (-F_q df - F_v df')
 *
 * Accelerations are affine in all other signals: in components of forces, and in f'' of motions. Their difference over
 * any distance is the derivative. Hard contacts keep their mode in it. One that slips is rejected, as for all
 * derivatives. Accelerations do not depend on f and f' of motions, whose equations are those of accelerations.
 *
 * Positions, velocities, accelerations and auxiliary states among the columns follow from these numbers. In model
 * exchange columns are those of the state that is projected onto the loops. With loops, and for all other columns,
 * the derivatives are central differences of order eight (derivative/difference.h) along the direction.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"
#include "present.h"

#include "base/arena.h"
#include "derivative/difference.h"
#include "derivative/effect_derivatives.h"
#include "derivative/stiffness.h"
#include "effect/effect.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef struct kt_fmu_sizes {
    size_t work, q, v, x, y, w, columns, run;
} kt_fmu_sizes;

#define KT_FMU_LINEAR_FIELDS(X)                                                                                        \
    X(char, work, s->work, "of kt_acceleration_derivatives")                                                           \
    X(double, a_q, s->v * s->v, "accelerations by positions")                                                          \
    X(double, a_v, s->v * s->v, "by velocities")                                                                       \
    X(double, a_u, s->v * s->v, "by torques")                                                                          \
    X(double, a_x, s->v * s->x, "by auxiliary states")                                                                 \
    X(double, f_q, s->x * s->v, "rates of auxiliary states by positions, negative")                                    \
    X(double, f_v, s->x * s->v, "by velocities, negative")                                                             \
    X(double, f_x, s->x * s->x, "by auxiliary states, negative")                                                       \
    X(double, dy, s->y, "the direction")                                                                               \
    X(double, du, s->v, "likewise")                                                                                    \
    X(double, dw, s->w, "likewise")                                                                                    \
    X(double, affine, s->w, "its part in which accelerations are affine")                                              \
    X(double, before, s->y, "rates at one end of a difference")                                                        \
    X(double, behind, s->y, "and at the other")                                                                        \
    X(double, turn, s->v, "d")                                                                                         \
    X(double, moved, s->q, "E(q) d / |p|: dq of unit quaternions")                                                     \
    X(double, still, s->q, "zeros")                                                                                    \
    X(double, part, s->q, "E(dq) v")                                                                                   \
    X(double, rates, s->y, "result")                                                                                   \
    X(double, y0, s->y, "the state between differences")                                                               \
    X(double, u0, s->v, "likewise the torques")                                                                        \
    X(double, eight, s->columns, "differences of order eight")                                                         \
    X(double, six, s->columns, "and of order six")                                                                     \
    X(double, size, s->columns, "the largest value of a column")                                                       \
    X(double, bound, s->columns, "the error of a result")                                                              \
    X(double, columns, s->columns, "result")                                                                           \
    X(double, run, s->run, "the run of co-simulation before differences")

struct kt_fmu_linear {
    void *owned;
    size_t work_size;
    KT_ARENA_DECLARE(KT_FMU_LINEAR_FIELDS)
};

KT_ARENA_LAYOUT(lay_out_linear, kt_fmu_linear, KT_FMU_LINEAR_FIELDS, const kt_fmu_sizes *s)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static const kt_model *present_model(const kt_fmu *fmu) {
    return fmu->is_exchange ? fmu->model : kt_simulation_model(fmu->simulation);
}

void kt_fmu_linear_free(kt_fmu_linear *linear) { kt_arena_free(linear); }

kt_status kt_fmu_direction_make(kt_fmu *fmu, kt_fmu_direction *along, kt_error *error) {
    const kt_fmu_sizes sizes = {kt_acceleration_work_size(present_model(fmu)),
                                (size_t)fmu->nq,
                                (size_t)fmu->nv,
                                (size_t)fmu->nx,
                                (size_t)kt_fmu_size(fmu),
                                (size_t)(KT_FMU_SIGNAL_MOST * fmu->signals.count),
                                fmu->columns.count,
                                fmu->is_exchange ? 0 : kt_simulation_state_size(fmu->simulation) / sizeof(double) + 1};
    if (fmu->linear == NULL || fmu->linear->work_size < sizes.work) {
        kt_fmu_linear_free(fmu->linear);
        fmu->has_jacobian = false;
        fmu->linear = kt_arena_allocate(lay_out_linear(NULL, &sizes), "derivatives", error);
        if (fmu->linear == NULL)
            return KT_ERROR_MEMORY;
        (void)lay_out_linear(fmu->linear, &sizes);
        (void)kt_arena_own(fmu->linear, KT_OK);
        fmu->linear->work_size = sizes.work;
        memset(fmu->linear->still, 0, sizes.q * sizeof(double));
    }
    memset(fmu->linear->dy, 0, sizes.y * sizeof(double));
    memset(fmu->linear->du, 0, sizes.v * sizeof(double));
    memset(fmu->linear->dw, 0, sizes.w * sizeof(double));
    *along = (kt_fmu_direction){fmu->linear->dy, fmu->linear->du, fmu->linear->dw};
    return KT_OK;
}

/* ---- rates ------------------------------------------------------------------------------------------------------- */

/* Computes the matrices of the present state. */
static kt_status linearize_rates(kt_fmu *fmu, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    const double *y = kt_fmu_state(fmu), *v = y + fmu->nq;
    kt_data *data = fmu->is_exchange ? fmu->data : kt_fmu_present_data(fmu->simulation);
    const kt_state_derivatives states = {l->a_x, l->f_q, l->f_v, l->f_x};
    const kt_dynamic_state at = {.t = fmu->time, .q = y, .v = v, .tau = fmu->torque};
    const kt_acceleration_matrices to = {.by = {l->a_q, l->a_v, l->a_u}, .states = fmu->nx > 0 ? &states : NULL};
    if (fmu->has_jacobian)
        return KT_OK;
    if (fmu->is_exchange && fmu->nx > 0)
        memcpy(kt_auxiliary_states(fmu->model, data), v + fmu->nv, (size_t)fmu->nx * sizeof *v);
    const kt_status status =
        kt_acceleration_derivatives_at(present_model(fmu), data, l->work, l->work_size, &at, NULL, &to, error);
    fmu->has_jacobian = status == KT_OK;
    return status;
}

/* Computes d of a joint with a quaternion p, of which dp is a change. */
static void quaternion_turn_of(const double *p, const double *dp, double *d) {
    const double square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3];
    d[0] = 2.0 * (p[0] * dp[1] - p[1] * dp[0] - p[2] * dp[3] + p[3] * dp[2]) / square;
    d[1] = 2.0 * (p[0] * dp[2] - p[2] * dp[0] - p[3] * dp[1] + p[1] * dp[3]) / square;
    d[2] = 2.0 * (p[0] * dp[3] - p[3] * dp[0] - p[1] * dp[2] + p[2] * dp[1]) / square;
}

/* Computes d of all joints. */
static void write_turns(const kt_fmu *fmu, const double *q, const double *dq, double *turn) {
    for (int body = 1; body < kt_model_body_count(fmu->model); body++) {
        const kt_coordinates c = kt_body_coordinates(fmu->model, body);
        const int plain = c.nq > c.nv ? c.nq - 4 : c.nq;
        memcpy(turn + c.v, dq + c.q, (size_t)plain * sizeof *dq);
        if (c.nq > c.nv)
            quaternion_turn_of(q + c.q + plain, dq + c.q + plain, turn + c.v + plain);
    }
}

/* Turns changes of quaternions of any norm into those of the unit quaternions that columns have. */
static void normalise_changes(const kt_fmu *fmu, const double *q, double *moved) {
    for (int body = 1; body < kt_model_body_count(fmu->model); body++) {
        const kt_coordinates c = kt_body_coordinates(fmu->model, body);
        const int first = c.q + c.nq - 4;
        if (c.nq == c.nv)
            continue;
        const double *p = q + first, norm = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
        for (int i = 0; i < 4; i++)
            moved[first + i] /= norm;
    }
}

/* y += factor A x, for a matrix with `rows` rows. */
static void add_matrix_columns(const double *matrix, int rows, int columns, double factor, const double *x, double *y) {
    for (int k = 0; k < columns; k++)
        for (int i = 0; i < rows; i++)
            y[i] += factor * x[k] * matrix[(size_t)k * (size_t)rows + (size_t)i];
}

/* ---- signals ----------------------------------------------------------------------------------------------------- */

/* Returns the effect of a signal in the present model; NULL: it is no servo, spring or motor in a joint. *is_on: it is
 * not switched off. */
static const kt_effect_record *joint_effect_of(const kt_fmu *fmu, const kt_parameter *parameter, bool *is_on) {
    const kt_model *model = present_model(fmu);
    *is_on = true;
    if (parameter->kind != KT_PARAMETER_EFFECT_CURVE)
        return NULL;
    const kt_effect_record *own = &fmu->model->effect[parameter->item];
    if (own->ends > 0 || own->relative.type != 0)
        return NULL;
    for (size_t i = 0; i < model->n.effect; i++)
        if (model->effect[i].source == own->source)
            return &model->effect[i];
    *is_on = false;
    return own;
}

/* Adds the accelerations by a change of a signal of such an effect. */
static void add_joint_signal(const kt_fmu *fmu, const kt_effect_record *effect, const double *dw, double *a) {
    const kt_link *link = &present_model(fmu)->link[effect->link[0]];
    const double *q = kt_fmu_state(fmu), *v = q + fmu->nq;
    const size_t nv = (size_t)fmu->nv;
    double force[2] = {0.0, 0.0}, change = dw[0];
    if (effect->type != KT_EFFECT_MOTOR) {
        kt_effect_kind_of(effect->type)
            ->joint_derivatives(effect, present_model(fmu)->number, q[link->q], v[link->v], fmu->time, force);
        change = -force[0] * dw[0] - (effect->type == KT_EFFECT_SERVO ? force[1] * dw[1] : 0.0);
    }
    add_matrix_columns(fmu->linear->a_u + (size_t)link->v * nv, fmu->nv, 1, 1.0, &change, a);
}

/* Computes the rates with signals at a distance along the affine part of the direction. */
static kt_status derive_shifted(kt_fmu *fmu, double distance, double *rates, kt_error *error) {
    kt_status status = kt_fmu_shift_signals(fmu, distance, fmu->linear->affine, error);
    fmu->has_rates = false;
    if (status == KT_OK)
        status = kt_fmu_derive(fmu, error);
    memcpy(rates, fmu->rates, (size_t)kt_fmu_size(fmu) * sizeof *rates);
    return status;
}

/* Differences evaluate the run of co-simulation with other inputs. It then goes on as if there were none. */
static void save_run(kt_fmu *fmu) {
    if (!fmu->is_exchange)
        kt_simulation_save(fmu->simulation, fmu->linear->run);
}

static kt_status return_to_run(kt_fmu *fmu, kt_error *error) {
    kt_status status = kt_fmu_shift_signals(fmu, 0.0, NULL, error);
    if (!fmu->is_exchange && status == KT_OK)
        status = kt_simulation_restore(fmu->simulation, fmu->linear->run, error);
    if (!fmu->is_exchange && status == KT_OK && fmu->watch != NULL)
        status = kt_scene_watch_sync(fmu->watch, fmu->simulation, error);
    return status;
}

/* Adds the rates along the affine part of the direction, of `length`. */
static kt_status add_affine(kt_fmu *fmu, double length, double *a, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    const double distance = 1.0 / length;
    const int first = fmu->nq, count = fmu->nv + fmu->nx;
    save_run(fmu);
    kt_status status = derive_shifted(fmu, -distance, l->before, error);
    if (status == KT_OK)
        status = derive_shifted(fmu, distance, l->behind, error);
    const kt_status back = return_to_run(fmu, error);
    fmu->has_rates = false;
    for (int i = first; i < first + count && status == KT_OK; i++)
        a[i - first] += (l->behind[i] - l->before[i]) / (2.0 * distance);
    return status == KT_OK ? back : status;
}

/* Adds the rates along the signals of the direction. */
static kt_status add_signals(kt_fmu *fmu, double *a, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    double length = 0.0;
    for (int k = 0; k < fmu->signals.count; k++) {
        const kt_fmu_signal *signal = &fmu->signals.signal[k];
        bool is_on;
        const kt_effect_record *effect = joint_effect_of(fmu, &signal->parameter, &is_on);
        if (effect != NULL && is_on)
            add_joint_signal(fmu, effect, l->dw + k * KT_FMU_SIGNAL_MOST, a);
        for (int i = k * KT_FMU_SIGNAL_MOST; i < (k + 1) * KT_FMU_SIGNAL_MOST; i++) {
            const bool is_affine = effect == NULL && !kt_fmu_signal_moves(fmu, i);
            l->affine[i] = is_affine ? l->dw[i] : 0.0;
            length = fmax(length, fabs(l->affine[i]));
        }
    }
    return length > 0.0 ? add_affine(fmu, length, a, error) : KT_OK;
}

/* ---- the rates --------------------------------------------------------------------------------------------------- */

kt_status kt_fmu_rates_along(kt_fmu *fmu, const double **rates, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    const int nq = fmu->nq, nv = fmu->nv, nx = fmu->nx;
    const double *q = kt_fmu_state(fmu), *v = q + nq, *dv = l->dy + nq, *dx = dv + nv;
    double *a = l->rates + nq, *f = a + nv;
    kt_status status = kt_fmu_show_signals(fmu, error);
    if (status == KT_OK)
        status = linearize_rates(fmu, error);
    if (status != KT_OK)
        return status;
    write_turns(fmu, q, l->dy, l->turn);
    kt_position_rate(fmu->model, q, l->turn, l->moved);
    normalise_changes(fmu, q, l->moved);
    kt_position_rate(fmu->model, l->dy, v, l->part);
    kt_position_rate(fmu->model, l->still, v, l->rates); /* v in plain coordinates, which do not depend on q */
    for (int i = 0; i < nq; i++)
        l->part[i] -= l->rates[i];
    kt_position_rate(fmu->model, q, dv, l->rates);
    for (int i = 0; i < nq; i++)
        l->rates[i] += l->part[i];
    memset(a, 0, (size_t)(nv + nx) * sizeof *a);
    add_matrix_columns(l->a_q, nv, nv, 1.0, l->turn, a);
    add_matrix_columns(l->a_v, nv, nv, 1.0, dv, a);
    add_matrix_columns(l->a_x, nv, nx, 1.0, dx, a);
    add_matrix_columns(l->a_u, nv, nv, 1.0, l->du, a);
    add_matrix_columns(l->f_q, nx, nv, -1.0, l->turn, f);
    add_matrix_columns(l->f_v, nx, nv, -1.0, dv, f);
    add_matrix_columns(l->f_x, nx, nx, -1.0, dx, f);
    *rates = l->rates;
    return add_signals(fmu, a, error);
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

/* Writes the derivative of a column of coordinates, and returns true; false: the column is another one. */
static bool write_coordinate(const kt_fmu *fmu, size_t column, double *value) {
    const kt_fmu_linear *l = fmu->linear;
    const kt_column *c = &fmu->columns.columns[column];
    const double *from = c->source == KT_COLUMN_POSITION       ? l->moved
                         : c->source == KT_COLUMN_VELOCITY     ? l->dy + fmu->nq
                         : c->source == KT_COLUMN_STATE        ? l->dy + fmu->nq + fmu->nv
                         : c->source == KT_COLUMN_ACCELERATION ? l->rates + fmu->nq
                                                               : NULL;
    if (c->source == KT_COLUMN_TIME)
        *value = 0.0;
    else if (from != NULL && kt_loop_count(fmu->model) == 0)
        *value = from[c->at];
    return c->source == KT_COLUMN_TIME || (from != NULL && kt_loop_count(fmu->model) == 0);
}

/* Evaluates the columns at (y, u, w) + distance (dy, du, dw). */
static kt_status evaluate_columns_at(kt_fmu *fmu, double distance, kt_error *error) {
    const kt_fmu_linear *l = fmu->linear;
    for (int i = 0; i < kt_fmu_size(fmu) && fmu->is_exchange; i++)
        fmu->y[i] = l->y0[i] + distance * l->dy[i];
    for (int i = 0; i < fmu->nv; i++)
        fmu->torque[i] = l->u0[i] + distance * l->du[i];
    kt_fmu_change(fmu);
    const kt_status status = kt_fmu_shift_signals(fmu, distance, l->dw, error);
    fmu->signals.are_set = true; /* those that were shifted */
    return status == KT_OK ? kt_fmu_evaluate(fmu, error) : status;
}

/* Takes over the differences of a step whose errors are less than those of the steps before. Returns the largest of
 * the errors over the sizes of the differences. */
static double take_differences(kt_fmu *fmu, double step, bool is_first) {
    kt_fmu_linear *l = fmu->linear;
    double worst = 0.0;
    for (size_t i = 0; i < fmu->columns.count; i++) {
        const double rounding = KT_DIFFERENCE_ROUNDING * DBL_EPSILON * l->size[i] / step;
        const double bound = fabs(l->eight[i] - l->six[i]) + rounding;
        if (is_first || bound < l->bound[i]) {
            l->bound[i] = bound;
            l->columns[i] = l->eight[i];
        }
        worst = fmax(worst, l->bound[i] / fmax(1.0, fabs(l->columns[i])));
    }
    return worst;
}

/* Computes the differences of all columns with one step. */
static kt_status difference_columns(kt_fmu *fmu, double step, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    const size_t bytes = fmu->columns.count * sizeof(double);
    memset(l->eight, 0, bytes);
    memset(l->six, 0, bytes);
    memset(l->size, 0, bytes);
    for (int k = -4; k <= 4; k++) {
        double eight, six;
        if (k == 0)
            continue;
        const kt_status status = evaluate_columns_at(fmu, k * step, error);
        if (status != KT_OK)
            return status;
        kt_difference_weights(k, step, &eight, &six);
        for (size_t i = 0; i < fmu->columns.count; i++) {
            l->eight[i] += eight * fmu->values[i];
            l->six[i] += six * fmu->values[i];
            l->size[i] = fmax(l->size[i], fabs(fmu->values[i]));
        }
    }
    return KT_OK;
}

static kt_status difference_along(kt_fmu *fmu, double length, kt_error *error) {
    static const double enough = 1e-10;
    kt_status status = KT_OK;
    double step = KT_DIFFERENCE_STEP / length, worst = (double)INFINITY;
    for (int k = 0; k < KT_DIFFERENCE_STEPS && worst > enough && status == KT_OK; k++) {
        status = difference_columns(fmu, step, error);
        if (status == KT_OK)
            worst = take_differences(fmu, step, k == 0);
        step /= 8.0;
    }
    return status;
}

kt_status kt_fmu_columns_along(kt_fmu *fmu, const double **columns, kt_error *error) {
    kt_fmu_linear *l = fmu->linear;
    const size_t count = fmu->columns.count, y_size = (size_t)kt_fmu_size(fmu), u_size = (size_t)fmu->nv;
    double length = 0.0, by_state = 0.0;
    size_t others = 0;
    *columns = l->columns;
    memset(l->columns, 0, count * sizeof *l->columns);
    for (size_t i = 0; i < y_size; i++)
        by_state = fmax(by_state, fabs(l->dy[i]));
    length = by_state;
    for (size_t i = 0; i < u_size; i++)
        length = fmax(length, fabs(l->du[i]));
    for (int i = 0; i < KT_FMU_SIGNAL_MOST * fmu->signals.count; i++)
        length = fmax(length, fabs(l->dw[i]));
    for (size_t i = 0; i < count; i++)
        others += !write_coordinate(fmu, i, &l->columns[i]);
    if (others == 0 || length == 0.0)
        return KT_OK;
    if (by_state > 0.0 && !fmu->is_exchange)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                            "in co-simulation only coordinates have derivatives by states; use model exchange");
    memcpy(l->y0, fmu->y, y_size * sizeof *l->y0);
    memcpy(l->u0, fmu->torque, u_size * sizeof *l->u0);
    const bool are_set = fmu->signals.are_set;
    save_run(fmu);
    kt_status status = difference_along(fmu, length, error);
    const kt_status back = return_to_run(fmu, error);
    status = status == KT_OK ? back : status;
    memcpy(fmu->y, l->y0, y_size * sizeof *l->y0);
    memcpy(fmu->torque, l->u0, u_size * sizeof *l->u0);
    kt_fmu_change(fmu);
    fmu->signals.are_set = are_set;
    fmu->has_jacobian = true;
    for (size_t i = 0; i < count; i++)
        (void)write_coordinate(fmu, i, &l->columns[i]);
    return status;
}
