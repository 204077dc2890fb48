/* A caller's own loop. The record of such a loop has a callback, which writes the equations of the second end's motion
 * as seen from the first (kinetree/loop.h). This file computes terms that the callback does not write, by differences.
 *
 * In the first end's frame, with d the second point, R the second end's axes, u = d' and R' = w x R,
 *     phi'  = moment . w  + force . u  + rate
 *     phi'' = moment . w' + force . u' + drift
 * so that along the motion (d + s u, exp(s w) R, t + s) at constant u and w
 *     drift = d/ds phi' = d^2/ds^2 phi
 * and moment, force and rate are the derivatives of phi by rotations, translations and time. First derivatives are
 * central differences of order four, and second derivatives of order six. Steps are parts of a radian, and of the arm
 * of the motion.
 *
 * Compiled for dual numbers, all is differenced once more, along the direction of the derivative.
 *
 * In the world's axes w' and u' are less by the terms of relative_motion.h.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop_custom.h"

#include <math.h>

/* ---- the motion that the callback sees --------------------------------------------------------------------------- */

typedef kt_loop_equation equations[KT_LOOP_ROW_MAX];

static kt_vec3 add_scaled(kt_vec3 a, double s, kt_vec3 b) { return kt_vec3_add(a, kt_vec3_scale(s, b)); }

/* exp(angle) R */
static kt_mat3 turned_frame(kt_vec3 angle, kt_mat3 R) {
    kt_mat3 turn;
    const kt_rotation rotation = kt_rotation_vector(angle);
    kt_error ignored;
    return kt_rotation_evaluate(&rotation, &turn, &ignored) == KT_OK ? kt_mat3_multiply(turn, R) : R;
}

/* A place next to a motion: moved by s (d, angle, u, w), at the time t + s time. */
typedef struct direction {
    kt_vec3 d, angle, u, w;
    double time;
} direction;

/* Calls the caller's function. *code becomes the first number other than 0 that the function has returned, or the first
 * negative number. */
static bool call(const kt_loop_record *loop, double t, const kt_loop_motion *motion, kt_loop_equation *out, int *code) {
    for (int r = 0; r < loop->row_count; r++)
        out[r] = (kt_loop_equation){.residual = 0.0};
    const int returned = loop->equations(loop->user, t, motion, out);
    if (*code == 0 || (*code > 0 && returned < 0))
        *code = returned;
    return returned == 0;
}

static kt_loop_motion moved(const kt_loop_motion *m, const direction *by, double s) {
    return (kt_loop_motion){.position = add_scaled(m->position, s, by->d),
                            .rotation = turned_frame(kt_vec3_scale(s, by->angle), m->rotation),
                            .velocity = add_scaled(m->velocity, s, by->u),
                            .omega = add_scaled(m->omega, s, by->w)};
}

/* ---- terms that callbacks do not write --------------------------------------------------------------------------- */

#define STEP 1e-3       /* of first differences */
#define STEP_TWICE 1e-2 /* of second ones */

static double arm_of(const kt_loop_motion *m) { return 1.0 + kt_vec3_norm(m->position); }

/* First differences of the residuals along a direction, of order four. */
static bool differences(const kt_loop_record *loop, double t, const kt_loop_motion *m, const direction *by, double step,
                        double out[KT_LOOP_ROW_MAX], int *code) {
    static const double weight[2] = {2.0 / 3.0, -1.0 / 12.0};
    bool fine = true;
    for (int r = 0; r < loop->row_count; r++)
        out[r] = 0.0;
    for (int i = -2; i <= 2; i++) {
        const double s = i * step;
        const kt_loop_motion there = moved(m, by, s);
        equations rows;
        if (i == 0)
            continue;
        fine &= call(loop, t + s * by->time, &there, rows, code);
        for (int r = 0; r < loop->row_count; r++)
            out[r] += (i < 0 ? -weight[-i - 1] : weight[i - 1]) * rows[r].residual / step;
    }
    return fine;
}

static double *component_at(kt_vec3 *v, int k) { return k == 0 ? &v->x : k == 1 ? &v->y : &v->z; }

/* Finds moment, force and rate of each row as derivatives of phi by three rotations, three translations and time. Steps
 * of translations are parts of the arm. */
static bool difference_rows(const kt_loop_record *loop, double t, const kt_loop_motion *m, kt_loop_equation *rows,
                            int *code) {
    double slope[KT_LOOP_ROW_MAX];
    bool fine = true;
    for (int k = 0; k < 7; k++) {
        direction by = {.time = k == 6 ? 1.0 : 0.0};
        if (k < 6)
            *component_at(k < 3 ? &by.angle : &by.d, k % 3) = 1.0;
        fine &= differences(loop, t, m, &by, k < 3 || k == 6 ? STEP : STEP * arm_of(m), slope, code);
        for (int r = 0; r < loop->row_count; r++)
            *(k == 6 ? &rows[r].rate : component_at(k < 3 ? &rows[r].moment : &rows[r].force, k % 3)) = slope[r];
    }
    return fine;
}

/* The direction of the present motion, with constant velocities and the time. *step becomes the length of a step that
 * turns or moves by about `part`. */
static direction onwards(const kt_loop_motion *m, double part, double *step) {
    *step = part / fmax(1.0, kt_vec3_norm(m->omega) + kt_vec3_norm(m->velocity) / arm_of(m));
    return (direction){.d = m->velocity, .angle = m->omega, .time = 1.0};
}

static double row_power_of(const kt_loop_equation *row, const kt_loop_motion *m) {
    return kt_vec3_dot(row->moment, m->omega) + kt_vec3_dot(row->force, m->velocity) + row->rate;
}

/* Finds the drift b of each row, phi'' = (row . accelerations) + b. It is the derivative of phi' = (row . velocities) +
 * phi_t along the motion at constant velocities, by central differences of fourth order of the caller's rows. */
static bool difference_drift(const kt_loop_record *loop, double t, const kt_loop_motion *m, kt_loop_equation *rows,
                             int *code) {
    static const double weight[2] = {2.0 / 3.0, -1.0 / 12.0};
    double step;
    const direction by = onwards(m, STEP, &step);
    bool fine = true;
    for (int i = -2; i <= 2; i++) {
        const kt_loop_motion there = moved(m, &by, i * step);
        equations near;
        if (i == 0)
            continue;
        fine &= call(loop, t + i * step, &there, near, code);
        for (int r = 0; r < loop->row_count; r++)
            rows[r].drift += (i < 0 ? -weight[-i - 1] : weight[i - 1]) * row_power_of(&near[r], m) / step;
    }
    return fine;
}

/* From the residuals alone. */
static bool difference_drift_twice(const kt_loop_record *loop, double t, const kt_loop_motion *m,
                                   kt_loop_equation *rows, int *code) {
    static const double weight[4] = {-49.0 / 18.0, 1.5, -0.15, 1.0 / 90.0};
    double step;
    const direction by = onwards(m, STEP_TWICE, &step);
    bool fine = true;
    for (int i = -3; i <= 3; i++) {
        const kt_loop_motion there = moved(m, &by, i * step);
        equations near;
        fine &= call(loop, t + i * step, &there, near, code);
        for (int r = 0; r < loop->row_count; r++)
            rows[r].drift += weight[i < 0 ? -i : i] * near[r].residual / (step * step);
    }
    return fine;
}

/* Evaluates all equations. If the callback rejects the state, all results are NaN, and the rates carry the number that
 * the callback returned. */
static void find_equations(const kt_loop_record *loop, double t, const kt_loop_motion *m, kt_loop_equation *rows) {
    int code = 0;
    bool fine = call(loop, t, m, rows, &code);
    for (int r = 0; r < loop->row_count; r++) {
        if (loop->given == KT_LOOP_GIVES_RESIDUAL)
            rows[r].moment = rows[r].force = kt_vec3_make(0.0, 0.0, 0.0);
        if (loop->given != KT_LOOP_GIVES_ALL)
            rows[r].drift = 0.0;
    }
    if (fine && loop->given == KT_LOOP_GIVES_RESIDUAL)
        fine = difference_rows(loop, t, m, rows, &code) && difference_drift_twice(loop, t, m, rows, &code);
    if (fine && loop->given == KT_LOOP_GIVES_ROWS)
        fine = difference_drift(loop, t, m, rows, &code);
    for (int r = 0; r < loop->row_count && !fine; r++) {
        rows[r].residual = rows[r].drift = rows[r].force.x = (double)NAN;
        rows[r].rate = kt_custom_stop(code);
    }
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static kt_vector custom_vector_of(kt_vec3 a) { return kt_vector_make(a.x, a.y, a.z); }

/* An equation of numbers with derivatives. */
typedef struct row_parts {
    kt_vector moment, force;
    kt_real residual, rate, drift;
} row_parts;

static row_parts parts_of(const kt_loop_equation *row) {
    return (row_parts){custom_vector_of(row->moment), custom_vector_of(row->force), row->residual, row->rate,
                       row->drift};
}

#ifdef KT_DUAL
static kt_vec3 derivative_of(kt_vector a) {
    return kt_vec3_make(kt_derivative_of(kt_component(a, 0)), kt_derivative_of(kt_component(a, 1)),
                        kt_derivative_of(kt_component(a, 2)));
}

static void add_real(double factor, double value, kt_real *sum) { *sum += kt_dual_make(0.0, factor * value); }

static void add_vector(double factor, kt_vec3 value, kt_vector *sum) {
    *sum += kt_vector_make(kt_dual_make(0.0, factor * value.x), kt_dual_make(0.0, factor * value.y),
                           kt_dual_make(0.0, factor * value.z));
}

/* Adds the derivatives along the direction in which the ends' numbers have theirs. R' = sum of x_k x x_k' / 2. */
static void add_derivatives(const kt_loop_record *loop, double t, const kt_loop_motion *m, const direction *by,
                            row_parts *parts) {
    static const double weight[2] = {2.0 / 3.0, -1.0 / 12.0};
    const double size = 1.0 + kt_vec3_norm(by->d) + kt_vec3_norm(by->angle) + kt_vec3_norm(by->u) + kt_vec3_norm(by->w);
    const double step = 4.0 * STEP / size;
    for (int i = -2; i <= 2; i++) {
        const kt_loop_motion there = moved(m, by, i * step);
        const double factor = i == 0 ? 0.0 : (i < 0 ? -weight[-i - 1] : weight[i - 1]) / step;
        equations near;
        if (i == 0)
            continue;
        int code;
        find_equations(loop, t, &there, near);
        if (kt_custom_stopped(near[0].rate, &code))
            parts[0].rate = kt_dual_make(near[0].rate, 0.0);
        for (int r = 0; r < loop->row_count; r++) {
            add_vector(factor, near[r].moment, &parts[r].moment);
            add_vector(factor, near[r].force, &parts[r].force);
            add_real(factor, near[r].residual, &parts[r].residual);
            add_real(factor, near[r].rate, &parts[r].rate);
            add_real(factor, near[r].drift, &parts[r].drift);
        }
    }
}

/* The direction of the derivative in a dual motion: of R' = angle x R it has angle = sum r_k x r_k' / 2. */
static direction motion_direction_of(const kt_custom_motion *m) {
    direction by = {.d = derivative_of(m->d), .u = derivative_of(m->u), .w = derivative_of(m->w)};
    for (int k = 0; k < 3; k++)
        by.angle = add_scaled(by.angle, 0.5, kt_vec3_cross(kt_value_of(m->axes[k]), derivative_of(m->axes[k])));
    return by;
}
#endif

/* Rows of the callback are in the first end's axes, and as seen from this end. The last terms of the drift are due to
 * the motion of this end (relative_motion.h). */
static int evaluate_custom(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                           kt_loop_row *rows) {
    (void)numbers;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector *e = end[0].axes;
    const kt_custom_motion seen = kt_custom_motion_of(end, &r);
    const kt_loop_motion motion = kt_custom_motion_value(&seen);
    equations found;
    row_parts parts[KT_LOOP_ROW_MAX];
    find_equations(loop, t, &motion, found);
    for (int k = 0; k < loop->row_count; k++)
        parts[k] = parts_of(&found[k]);
#ifdef KT_DUAL
    const direction by = motion_direction_of(&seen);
    add_derivatives(loop, t, &motion, &by, parts);
#endif
    for (int k = 0; k < loop->row_count; k++) {
        const kt_vector moment = kt_apply(e, parts[k].moment), force = kt_apply(e, parts[k].force);
        rows[k] = (kt_loop_row){.moment = moment,
                                .force = force,
                                .residual = loop->contact ? parts[k].residual : 0.0,
                                .rate = parts[k].rate,
                                .drift = parts[k].drift + kt_dot(force, r.coriolis) - kt_dot(moment, r.turning),
                                .holonomic = loop->contact};
    }
    return loop->row_count;
}

static int custom_row_count(const kt_loop *loop) { return loop->equation_count; }

/* NOLINTNEXTLINE(readability-non-const-parameter): a type with numbers of its own writes them */
static void prepare_custom(const kt_description *description, const kt_loop *loop, double *numbers,
                           kt_loop_record *record) {
    (void)description, (void)numbers;
    record->equations = loop->equations;
    record->user = loop->user;
    record->given = (int32_t)loop->given;
}

const kt_loop_kind KT_KERNEL(kt_loop_custom) = {
    .rows = KT_LOOP_ROW_MAX,
    .evaluate = evaluate_custom,
    .part = {KT_PART_SPATIAL, KT_PART_SPATIAL, KT_PART_SPATIAL, KT_PART_SPATIAL, KT_PART_SPATIAL, KT_PART_SPATIAL},
    .row_count = custom_row_count,
    .prepare = prepare_custom};

#if KT_DESCRIBES
static const kt_key keys[] = {KT_BETWEEN_KEY(kt_loop)};
const kt_descriptor kt_loop_custom_descriptor = {.name = "custom", KT_DESCRIPTOR_KEYS};
#endif
