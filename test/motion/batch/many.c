/* SPDX-License-Identifier: Apache-2.0 */
#include "many.h"

#include "check.h"

#include "joint/joint.h"
#include "kinetree/closure.h"
#include "kinetree/control.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/sensitivity.h"
#include "kinetree/study.h"
#include "model/follow.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool kt_many_make(kt_many *many, const kt_model *model, const kt_method *method) {
    kt_error error;
    const kt_batch_options options = {.states = KT_MANY_STATES, .threads = KT_MANY_THREADS, .method = method};
    *many = (kt_many){.model = model, .nq = (size_t)kt_model_nq(model), .nv = (size_t)kt_model_nv(model)};
    many->nx = (size_t)kt_auxiliary_state_count(model);
    many->method = method;
    many->threads = 1;
    many->t = calloc(KT_MANY_STATES * (1 + many->nq + 3 * many->nv) + 1, sizeof(double));
    many->q = many->t + KT_MANY_STATES;
    many->v = many->q + KT_MANY_STATES * many->nq;
    many->tau = many->v + KT_MANY_STATES * many->nv;
    many->a = many->tau + KT_MANY_STATES * many->nv;
    many->work_size = method ? kt_step_work_size(model, method) : 0;
    many->work = many->work_size ? aligned_alloc(KT_ALIGNMENT, many->work_size) : NULL;
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        many->t[i] = 0.25 * (double)i;
        many->own[i] = model;
        kt_model_initial(model, many->q + i * many->nq, many->v + i * many->nv);
    }
    if (kt_batch_create(model, &options, &many->batch, &error) == KT_OK)
        return true;
    kt_note("%s: %s", error.where, error.message);
    return kt_check_true("a batch is made", false);
}

void kt_many_free(kt_many *many) {
    kt_batch_free(many->batch);
    for (size_t i = 0; i < KT_MANY_STATES; i++)
        free(many->copies[i]);
    free(many->t);
    free(many->work);
}

static kt_status set_parameter(kt_model *copy, const char *name, double scale, kt_error *error) {
    kt_parameter parameter;
    double values[KT_PARAMETER_MAX];
    kt_status status = kt_parameter_find(copy, name, &parameter, error);
    if (status == KT_OK)
        status = kt_parameter_get(copy, &parameter, values, error);
    for (int k = 0; status == KT_OK && k < parameter.count; k++)
        values[k] *= scale;
    return status == KT_OK ? kt_parameter_set(copy, &parameter, values, error) : status;
}

/* A copy with another gravity and other masses. */
static kt_model *copy_model(kt_many *many, size_t i, kt_random *random) {
    const size_t size = kt_model_size(many->model);
    kt_model *copy = NULL;
    kt_error error;
    many->copies[i] = aligned_alloc(KT_ALIGNMENT, size);
    kt_status status = kt_model_copy(many->model, many->copies[i], size, &copy, &error);
    if (status == KT_OK)
        status = set_parameter(copy, "gravity", kt_random_uniform(random, 0.5, 1.5), &error);
    for (int body = 1; body < kt_model_body_count(many->model) && status == KT_OK; body += 3) {
        char name[64];
        (void)snprintf(name, sizeof name, "%s.mass", kt_body_name(many->model, body));
        status = set_parameter(copy, name, kt_random_uniform(random, 0.9, 1.1), &error);
    }
    if (status == KT_OK)
        return copy;
    kt_note("%s: %s", error.where, error.message);
    return NULL;
}

bool kt_many_vary(kt_many *many, kt_random *random) {
    const size_t width = kt_batch_report_of(many->batch).width;
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        if (i > 0 && i < width)
            many->own[i] = many->own[0];
        else if (i % 4 != 3)
            many->own[i] = copy_model(many, i, random);
        if (!many->own[i])
            return kt_check_true("a copy with other parameters is made", false);
    }
    return true;
}

/* Puts n numbers of a state into an array of kt_batch_lanes, whose groups are `stride` apart; NaN if there are none. */
static void write_lane(double *all, size_t stride, size_t width, size_t state, size_t n, const double *from) {
    for (size_t k = 0; k < n; k++)
        all[state / width * stride + k * width + state % width] = from ? from[k] : (double)NAN;
}

/* Sets a state by the arrays of the batch. A state from KT_MANY_STATES on is in an unused lane. */
static void set_lanes(kt_many *many, size_t i) {
    const kt_batch_lanes to = kt_batch_lanes_of(many->batch);
    const size_t nq = many->nq, nv = many->nv;
    const bool used = i < KT_MANY_STATES;
    to.t[i] = used ? many->t[i] : (double)NAN;
    write_lane(to.q, to.state_stride, to.width, i, nq, used ? many->q + i * nq : NULL);
    write_lane(to.v, to.state_stride, to.width, i, nv, used ? many->v + i * nv : NULL);
    write_lane(to.x, to.state_stride, to.width, i, many->nx, used ? many->model->v0 + nv : NULL);
    write_lane(to.tau, to.force_stride, to.width, i, nv, used ? many->tau + i * nv : NULL);
    write_lane(to.a, to.force_stride, to.width, i, nv, used ? many->a + i * nv : NULL);
}

/* Every other state is set by a call, the others in the memory of the batch. */
static void set(kt_many *many) {
    const kt_batch_lanes lanes = kt_batch_lanes_of(many->batch);
    kt_status status = KT_OK;
    for (size_t i = KT_MANY_STATES; i < lanes.groups * lanes.width; i++)
        set_lanes(many, i);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        status |= kt_batch_set_model(many->batch, i, many->own[i], NULL);
        if (i % 2 != 0) {
            set_lanes(many, i);
            continue;
        }
        status |= kt_batch_set_state(many->batch, i, many->t[i], many->q + i * many->nq, many->v + i * many->nv, NULL);
        status |= kt_batch_set_auxiliary_states(many->batch, i, many->model->v0 + many->nv, NULL);
        status |= kt_batch_set_torque(many->batch, i, many->tau + i * many->nv, NULL);
        status |= kt_batch_set_acceleration(many->batch, i, many->a + i * many->nv, NULL);
    }
    if (status != KT_OK)
        kt_check_true("all states are set", false);
}

static bool differ(const double *a, const double *b, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (memcmp(&a[i], &b[i], sizeof *a) != 0 && !(a[i] != a[i] && b[i] != b[i])) /* a NaN is a NaN */
            return true;
    return false;
}

/* The call's status is that of the first state that failed. */
static bool told_wrong(kt_status all, kt_status first_failure, const kt_error *error, size_t state) {
    char number[32];
    if (all != first_failure)
        return true;
    (void)snprintf(number, sizeof number, "state %zu", state);
    return all != KT_OK && strncmp(error->where, number, strlen(number)) != 0;
}

typedef struct first_failure {
    kt_status status;
    size_t state;
} first_failure;

static void note(first_failure *first, kt_status status, size_t state) {
    if (first->status == KT_OK && status != KT_OK)
        *first = (first_failure){status, state};
}

/* A computation for each state, in a batch and alone. Its results are nv numbers, which are `before` until then. */
typedef struct computation {
    kt_status (*together)(kt_batch *batch, kt_error *error);
    kt_status (*take)(const kt_batch *batch, size_t state, double *x, kt_error *error);
    kt_status (*alone)(const kt_many *many, kt_data *data, size_t state, double *x);
    const double *before;
} computation;

static int compare(kt_many *many, kt_data *data, const computation *c) {
    const size_t nv = many->nv;
    kt_error error;
    first_failure first = {KT_OK, 0};
    double *expected = calloc(2 * nv + 1, sizeof *expected), *seen = expected + nv;
    int different = 0;
    set(many);
    const kt_status all = c->together(many->batch, &error);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        memcpy(expected, c->before + i * nv, nv * sizeof *expected);
        kt_data_follow(many->own[i], data);
        kt_auxiliary_states_initial(many->model, kt_auxiliary_states(many->own[i], data));
        const kt_status alone = c->alone(many, data, i, expected);
        note(&first, alone, i);
        if (c->take(many->batch, i, seen, NULL) != KT_OK || kt_batch_status(many->batch, i) != alone ||
            differ(seen, expected, nv))
            different++;
    }
    different += told_wrong(all, first.status, &error, first.state);
    free(expected);
    return different;
}

static kt_status forward_alone(const kt_many *many, kt_data *data, size_t i, double *a) {
    return kt_acceleration_evaluate(many->own[i], data, many->t[i], many->q + i * many->nq, many->v + i * many->nv,
                                    many->tau + i * many->nv, NULL, a, NULL);
}

static kt_status inverse_alone(const kt_many *many, kt_data *data, size_t i, double *tau) {
    return kt_dynamics_inverse(many->own[i], data, many->q + i * many->nq, many->v + i * many->nv,
                               many->a + i * many->nv, NULL, tau, NULL);
}

int kt_many_compare_forward(kt_many *many, kt_data *data) {
    return compare(many, data, &(computation){kt_batch_forward, kt_batch_get_acceleration, forward_alone, many->a});
}

int kt_many_compare_inverse(kt_many *many, kt_data *data) {
    return compare(many, data, &(computation){kt_batch_inverse, kt_batch_get_torque, inverse_alone, many->tau});
}

/* ---- sensors ----------------------------------------------------------------------------------------------------- */

enum { FRAMES_MOST = 64, MOTION = sizeof(kt_frame_motion) / sizeof(double) };

/* The contents of Jacobians before they are computed. */
static const double UNTOUCHED = 7.0;

/* The frames of all bodies, and of the first marker of each that has one. */
static size_t choose_frames(const kt_model *model, kt_batch_frame *frames) {
    size_t count = 0;
    for (int body = 0; body < kt_model_body_count(model) && count + 2 <= FRAMES_MOST; body++) {
        frames[count++] = (kt_batch_frame){body, -1};
        if (kt_marker_count(model, body) > 0)
            frames[count++] = (kt_batch_frame){body, 0};
    }
    return count;
}

/* Evaluates sensors of one state at the last kt_kinematics_update. */
static void sense_alone(const kt_model *model, const kt_data *data, kt_batch_frame frame, kt_frame_motion *motion,
                        double *jacobian) {
    kt_vec3 at = kt_vec3_make(0.0, 0.0, 0.0);
    motion->pose = kt_body_pose(model, data, frame.body);
    kt_point_jacobian(model, data, frame.body, at, jacobian);
    if (frame.marker >= 0) {
        at = kt_marker_at(model, frame.body, frame.marker);
        motion->pose = kt_marker_pose(model, data, frame.body, frame.marker);
        kt_marker_jacobian(model, data, frame.body, frame.marker, KT_TWIST_ALIGNED, jacobian);
    }
    motion->velocity =
        (kt_twist){kt_body_twist(model, data, frame.body).angular, kt_point_velocity(model, data, frame.body, at)};
    motion->acceleration = (kt_twist){kt_body_acceleration(model, data, frame.body).angular,
                                      kt_point_acceleration(model, data, frame.body, at)};
}

/* Compares the sensors of one state. For a state that cannot be computed, checks that nothing was written. */
static bool sensors_differ(const kt_many *many, kt_data *data, const kt_batch_sensors *seen, size_t i,
                           kt_status *status) {
    const size_t size = 6 * many->nv;
    double *jacobian = calloc(size + 1, sizeof *jacobian);
    bool different = false;
    kt_data_follow(many->own[i], data);
    *status = kt_kinematics_update(many->own[i], data, many->q + i * many->nq, many->v + i * many->nv,
                                   many->a + i * many->nv, NULL);
    for (size_t k = 0; k < seen->count; k++) {
        kt_frame_motion motion = {.velocity = {.angular = {0.0, 0.0, 0.0}}};
        for (size_t j = 0; j < size; j++)
            jacobian[j] = UNTOUCHED;
        if (*status == KT_OK)
            sense_alone(many->own[i], data, seen->frames[k], &motion, jacobian);
        const size_t place = i * seen->count + k;
        different |= differ(&seen->motion[place].pose.rotation.x.x, &motion.pose.rotation.x.x, MOTION) ||
                     differ(seen->jacobian + place * size, jacobian, size);
    }
    free(jacobian);
    return different || kt_batch_status(many->batch, i) != *status;
}

int kt_many_compare_sensors(kt_many *many, kt_data *data) {
    kt_batch_frame frames[FRAMES_MOST];
    kt_batch_sensors sensors = {.frames = frames, .count = choose_frames(many->model, frames)};
    kt_error error;
    first_failure first = {KT_OK, 0};
    int different = 0;
    sensors.motion = calloc(KT_MANY_STATES * sensors.count + 1, sizeof *sensors.motion);
    sensors.jacobian = calloc(KT_MANY_STATES * sensors.count * 6 * many->nv + 1, sizeof *sensors.jacobian);
    for (size_t j = 0; j < KT_MANY_STATES * sensors.count * 6 * many->nv; j++)
        sensors.jacobian[j] = UNTOUCHED;
    set(many);
    const kt_batch_job job = {.task = KT_BATCH_SENSE, .sensors = &sensors};
    const kt_status all = kt_batch_run(many->batch, &job, many->threads, NULL, &error);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        kt_status alone;
        different += sensors_differ(many, data, &sensors, i, &alone);
        note(&first, alone, i);
    }
    different += told_wrong(all, first.status, &error, first.state);
    free(sensors.motion);
    free(sensors.jacobian);
    return different;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* A state that takes steps alone. */
typedef struct single {
    const kt_model *model;
    double t, *q, *v;
    const double *tau;
} single;
typedef kt_status step_alone(kt_many *many, kt_data *data, single *s, double h);

static kt_status step_by_method(kt_many *many, kt_data *data, single *s, double h) {
    const kt_step step = {.method = many->method, .t = s->t, .h = h, .tau = s->tau};
    return kt_step_evaluate(s->model, data, many->work, many->work_size, &step, s->q, s->v, s->q, s->v, NULL);
}

/* v += h a, q (+) h v, closed. */
static kt_status step_semi_implicitly(kt_many *many, kt_data *data, single *s, double h) {
    const size_t nq = many->nq, nv = many->nv;
    double *a = calloc(2 * nv + nq + many->nx + 1, sizeof *a), *v = a + nv, *q = v + nv, *rates = q + nq;
    kt_status status = kt_acceleration_evaluate(s->model, data, s->t, s->q, s->v, s->tau, NULL, a, NULL);
    if (status == KT_OK && many->nx > 0)
        status = kt_auxiliary_state_rates(s->model, data, s->t, s->q, s->v, rates, NULL);
    for (size_t k = 0; k < nv; k++) {
        v[k] = s->v[k] + h * a[k];
        a[k] = h * v[k];
    }
    kt_position_add(many->model, s->q, a, q);
    if (status == KT_OK && many->model->n.group > 0)
        status = kt_state_project(s->model, data, s->t + h, q, v, NULL, NULL);
    else if (status == KT_OK && !kt_position_make_units(many->model, q))
        status = KT_ERROR_NOT_FINITE;
    if (status == KT_OK) {
        memcpy(s->q, q, nq * sizeof *q);
        memcpy(s->v, v, nv * sizeof *v);
        for (size_t k = 0; k < many->nx; k++)
            kt_auxiliary_states(s->model, data)[k] += h * rates[k];
    }
    free(a);
    return status;
}

/* One state by as many steps, until one fails. */
static kt_status advance_alone(kt_many *many, kt_data *data, size_t i, const kt_batch_job *job, single *s) {
    step_alone *step = job->task == KT_BATCH_STEP ? step_by_method : step_semi_implicitly;
    s->model = many->own[i];
    s->t = many->t[i];
    s->tau = many->tau + i * many->nv;
    kt_data_follow(s->model, data);
    kt_auxiliary_states_initial(many->model, kt_auxiliary_states(s->model, data));
    memcpy(s->q, many->q + i * many->nq, many->nq * sizeof *s->q);
    memcpy(s->v, many->v + i * many->nv, many->nv * sizeof *s->v);
    for (int k = 0; k < job->steps; k++) {
        if (job->inputs != NULL) {
            const size_t samples = (size_t)job->inputs->samples, sample = (size_t)(k / job->inputs->hold);
            s->tau = job->inputs->torque + (i * samples + (sample < samples ? sample : samples - 1)) * many->nv;
        }
        const kt_status status = step(many, data, s, job->h);
        if (status != KT_OK)
            return status;
        s->t += job->h;
    }
    return KT_OK;
}

static int compare_job(kt_many *many, kt_data *data, const kt_batch_job *job) {
    const size_t nq = many->nq, nv = many->nv, nx = many->nx, N = 1 + nq + nv + nx;
    kt_error error;
    first_failure first = {KT_OK, 0};
    double *expected = calloc(2 * N, sizeof *expected), *seen = expected + N;
    int different = 0;
    set(many);
    const kt_status all = kt_batch_run(many->batch, job, many->threads, NULL, &error);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        single s = {.q = expected + 1, .v = expected + 1 + nq};
        const kt_status alone = advance_alone(many, data, i, job, &s);
        expected[0] = s.t;
        if (nx > 0)
            memcpy(expected + 1 + nq + nv, kt_auxiliary_states(many->own[i], data), nx * sizeof *expected);
        note(&first, alone, i);
        if (kt_batch_get_state(many->batch, i, seen, seen + 1, seen + 1 + nq, NULL) != KT_OK ||
            kt_batch_get_auxiliary_states(many->batch, i, seen + 1 + nq + nv, NULL) != KT_OK ||
            kt_batch_status(many->batch, i) != alone || differ(seen, expected, N))
            different++;
    }
    different += told_wrong(all, first.status, &error, first.state);
    free(expected);
    return different;
}

int kt_many_compare_steps(kt_many *many, kt_data *data, double h, int steps) {
    return compare_job(many, data, &(kt_batch_job){.task = KT_BATCH_STEP, .h = h, .steps = steps});
}

int kt_many_compare_semi_implicit(kt_many *many, kt_data *data, double h, int steps) {
    return compare_job(many, data, &(kt_batch_job){.task = KT_BATCH_SEMI_IMPLICIT_STEP, .h = h, .steps = steps});
}

/* The forces of a state are scaled by another factor in each sample. */
int kt_many_compare_inputs(kt_many *many, kt_data *data, double h, int steps) {
    enum { SAMPLES = 2 };
    static const double factor[SAMPLES] = {1.5, -0.75};
    const size_t nv = many->nv;
    double *torque = calloc(KT_MANY_STATES * SAMPLES * nv + 1, sizeof *torque);
    const kt_batch_inputs inputs = {.samples = SAMPLES, .hold = 2, .torque = torque};
    int different = 0;
    for (size_t i = 0; i < KT_MANY_STATES; i++)
        for (size_t k = 0; k < SAMPLES * nv; k++)
            torque[i * SAMPLES * nv + k] = factor[k / nv] * many->tau[i * nv + k % nv];
    for (int task = KT_BATCH_STEP; task <= KT_BATCH_SEMI_IMPLICIT_STEP; task++)
        different += compare_job(
            many, data, &(kt_batch_job){.task = (kt_batch_task)task, .h = h, .steps = steps, .inputs = &inputs});
    free(torque);
    return different;
}
