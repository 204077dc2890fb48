/* Gradients of several motions at once, a motion a lane (batch/lanes.h). The computations are the steps of rollout.c
 * and their adjoints (step_adjoint.c), for trees whose effects act in joints, with explicit methods. Costs, and the
 * derivatives of effects, are evaluated lane by lane. The bits are those of kt_rollout_gradient.
 *
 * A motion that fails in a lane leaves the lanes. Such a motion is computed alone afterwards, with its error if it
 * fails again. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "batch/batch.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* W lanes of models with n coordinates and N = nq + n numbers of a state; c checkpoints, s stages. */
typedef struct kt_rollout_counts {
    const kt_model *model;
    const kt_lane_kernels *kernels;
    size_t W, nq, n, N, c, s, steps;
} kt_rollout_counts;

#define KT_ROLLOUT_LANE_FIELDS(X)                                                                                      \
    X(double, state, n->c * n->W * n->N, "checkpoints: states at the start of steps")                                  \
    X(double, kept, n->c * n->s * n->W * n->n, "accelerations of the stages of the steps from these")                  \
    X(double, after, n->c * n->W * n->N, "states after these steps")                                                   \
    X(bool, taken, n->c, "whether they have been taken")                                                               \
    X(int, index, n->c, "of which steps")                                                                              \
    X(double, here, n->W * n->N, "states between checkpoints")                                                         \
    X(double, start, n->W, "times of steps")                                                                           \
    X(double, t, n->W, "times of a stage")                                                                             \
    X(double, h, n->W, "lengths of steps")                                                                             \
    X(double, tau, n->W * n->n, "inputs of a step")                                                                    \
    X(double, total, n->W * n->n, "joint forces, with those of effects")                                               \
    X(double, wrench, n->W * 6 * kt_where(n->model->n.force_link, n->model->n.body), "wrenches of effects")            \
    X(double, stage, n->s * n->W * n->N, "states of the stages of a step")                                             \
    X(double, slope, n->s * n->W * n->N, "their slopes")                                                               \
    X(double, raw, n->W * n->N, "states after the step, before quaternions are made units")                            \
    X(double, next, n->W * n->N, "and after that")                                                                     \
    X(double, by_stage, n->s * n->W * n->N, "gradients by stages")                                                     \
    X(double, by_end, n->W * n->N, "by `raw`")                                                                         \
    X(double, by_start, n->W * n->N, "by the states before the step")                                                  \
    X(double, by_slope, n->W * n->N, "by the slope of a stage")                                                        \
    X(double, by_next, n->W * 2 * n->n, "by the states after the step, then before it, xi and dv")                     \
    X(double, by_force, n->W * n->n, "by the inputs of a step")                                                        \
    X(double, tangent, n->W * 3 * n->n, "of a stage, by xi and dv, and w = M^-1 mu")                                   \
    X(double, inputs, n->W * n->steps * n->n, "results, lane by lane")                                                 \
    X(double, value, n->W, "results")                                                                                  \
    X(double, one, n->N + 3 * n->n, "the state of a lane; derivatives of its cost by xi, dv and tau")                  \
    X(kt_stage_term, term, n->s, "a row of the table without zeros")                                                   \
    X(char, lanes, n->kernels->layout(n->model, NULL), "workspace of the recursions")                                  \
    X(char, adjoint, n->kernels->adjoint_layout(n->model, NULL), "of their adjoint")

typedef struct lanes_work {
    kt_rollout_counts n;
    const kt_lane_kernels *kernels;
    const kt_model *model; /* the model of a lane */
    const kt_method *method;
    kt_rollout_task *tasks; /* `used` of them */
    size_t used;
    kt_cost *cost;
    kt_lane_mask active; /* lanes that have been computed so far */
    int reached;         /* steps whose cost is in the values */
    KT_ARENA_DECLARE(KT_ROLLOUT_LANE_FIELDS)
} lanes_work;

KT_ARENA_ARRAYS(place_arrays, lanes_work, KT_ROLLOUT_LANE_FIELDS, const kt_rollout_counts *n)

/* ---- which motions ----------------------------------------------------------------------------------------------- */

/* The reason why gradients of a rollout are computed one by one; NULL: in lanes. */
static const char *fallback_reason_of_rollout(const kt_model *model, const kt_rollout *rollout) {
    if (kt_method_family_of(rollout->method) != &kt_family_explicit)
        return "the method is implicit";
    if (model->n.group > 0)
        return "it has loops";
    if (kt_has_auxiliary_states(model))
        return "it has auxiliary states";
    if (model->variants || (kt_step_contact_rows(model) > 0) || model->n.massless > 0 || kt_mass_curve_count(model) > 0)
        return "it has hard contacts, switched parts, masses that vary, or coordinates without mass";
    return model->n.v > 0 ? kt_sweep_rejected(model) : "nothing moves";
}

size_t kt_rollout_width(const kt_model *model, const kt_rollout *rollout, const char **why) {
    const char *reason = NULL;
    if (model && rollout && kt_rollout_work_size(model, rollout) > 0)
        reason = fallback_reason_of_rollout(model, rollout);
    else
        reason = "its gradient cannot be computed";
    if (why)
        *why = reason;
    return reason ? 1 : kt_lane_kernels_of(model)->width;
}

static kt_rollout_counts counts_of(const kt_model *model, const kt_rollout *rollout) {
    const kt_lane_kernels *kernels = kt_lane_kernels_of(model);
    return (kt_rollout_counts){.model = model,
                               .kernels = kernels,
                               .W = kernels->width,
                               .nq = model->n.q,
                               .n = model->n.v,
                               .N = model->n.q + model->n.v,
                               .c = (size_t)kt_checkpoints_of(rollout),
                               .s = kt_step_stages_of(rollout->method),
                               .steps = (size_t)rollout->steps};
}

size_t kt_rollout_gradients_work_size(const kt_model *model, const kt_rollout *rollout) {
    const size_t alone = kt_rollout_work_size(model, rollout);
    if (alone == 0 || kt_rollout_width(model, rollout, NULL) == 1)
        return alone;
    const kt_rollout_counts n = counts_of(model, rollout);
    const size_t together = place_arrays(NULL, NULL, &n);
    return together > alone ? together : alone;
}

static const kt_model *task_model_of(const kt_model *model, const kt_rollout_task *task) {
    return task->model ? task->model : model;
}

/* Whether the motions of a group can be computed together. The call for one motion rejects a model that does not fit
 * the data. */
static bool tasks_fit(const kt_model *model, const kt_rollout_task *tasks, size_t used) {
    const kt_model *first = task_model_of(model, tasks);
    for (size_t i = 0; i < used; i++) {
        const kt_rollout *r = &tasks[i].rollout, *r0 = &tasks[0].rollout;
        const kt_model *own = task_model_of(model, &tasks[i]);
        if (!tasks[i].q || r->method != r0->method || r->steps != r0->steps ||
            kt_checkpoints_of(r) != kt_checkpoints_of(r0) || !isfinite(r->h) || !isfinite(r->t))
            return false;
        if (own->shape != model->shape || !kt_lanes_agree(first, own))
            return false;
    }
    return true;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static void fail_lane(lanes_work *w, size_t lane) { w->active &= ~((kt_lane_mask)1 << lane); }

/* The status of a run without remaining lanes: its error is not read. */
static kt_status status_of_lanes(const lanes_work *w) { return w->active ? KT_OK : KT_ERROR_NOT_FINITE; }

/* Computes out = y + h sum_j weight_j k_j for all lanes, as kt_combine_rows. */
static void combine_lane_slopes(lanes_work *w, const double *y, const double *weights, size_t count, double *out) {
    double *rows[KT_METHOD_STAGES_MAX];
    for (size_t j = 0; j < count; j++)
        rows[j] = w->slope + j * w->n.W * w->n.N;
    w->kernels->combine(out, y, w->h, w->term, kt_stage_terms(weights, count, w->term), rows, w->n.N);
}

/* Sets the state of stage i, the rates of its positions, and its times. */
static kt_lane_state set_stage(lanes_work *w, size_t i, const double *y) {
    const size_t W = w->n.W, at = i * W * w->n.N;
    const double *q = w->stage + at, *v = q + W * w->n.nq;
    combine_lane_slopes(w, y, kt_step_row(w->method, i), i, w->stage + at);
    w->kernels->rate(w->model, w->lanes, q, v, w->slope + at);
    for (size_t lane = 0; lane < W; lane++)
        w->t[lane] = kt_stage_time(w->method->c[i], w->start[lane], w->h[lane]);
    return (kt_lane_state){.t = w->t, .q = q, .v = v, .tau = w->tau, .active = w->active};
}

static double *accelerations(const lanes_work *w, size_t i) { return w->slope + w->n.W * (i * w->n.N + w->n.nq); }

/* Sets times, lengths and inputs of step k. Lanes without a motion copy the values of the first lane. */
static void begin_lanes_step(lanes_work *w, int k) {
    for (size_t lane = 0; lane < w->n.W; lane++) {
        const kt_rollout *r = &w->tasks[lane < w->used ? lane : 0].rollout;
        w->start[lane] = r->t + k * r->h;
        w->h[lane] = r->h;
        kt_lane_put(r->inputs ? r->inputs + (size_t)k * w->n.n : NULL, w->n.W, lane, w->n.n, w->tau);
    }
}

/* Takes step k of all lanes, as kt_adjoint_run does for one state. */
static void run_step(lanes_work *w, int k, const double *state) {
    begin_lanes_step(w, k);
    for (size_t i = 0; i < w->n.s; i++) {
        const kt_lane_state at = set_stage(w, i, state);
        const kt_lane_work work = {.lanes = w->lanes, .total = w->total, .wrench = w->wrench, .a = accelerations(w, i)};
        w->active &= kt_lanes_accelerate(w->kernels, w->model, &at, &work);
    }
    combine_lane_slopes(w, state, w->method->b, w->n.s, w->raw);
    kt_copy(w->next, w->raw, w->n.W * w->n.N * sizeof *w->raw);
    w->active &= w->kernels->finite(w->next, w->n.nq + w->n.n);
    if (w->n.nq > w->n.n)
        w->active &= w->kernels->make_units(w->model, w->lanes, w->next);
}

/* Saves a step as kt_adjoint_save: the accelerations of its stages, and the state at its end. */
static void save_lane_states(lanes_work *w, size_t index) {
    const size_t one = w->n.W * w->n.n, N = w->n.W * w->n.N;
    for (size_t i = 0; i < w->n.s; i++)
        memcpy(w->kept + (index * w->n.s + i) * one, accelerations(w, i), one * sizeof *w->kept);
    memcpy(w->after + index * N, w->next, N * sizeof *w->next);
}

/* Restores a step from the checkpoint `index`: its stages from their accelerations, and the state at its end. */
static void recall(lanes_work *w, int k, size_t index, const double *state) {
    const size_t one = w->n.W * w->n.n, N = w->n.W * w->n.N;
    begin_lanes_step(w, k);
    for (size_t i = 0; i < w->n.s; i++) {
        (void)set_stage(w, i, state);
        memcpy(accelerations(w, i), w->kept + (index * w->n.s + i) * one, one * sizeof *w->kept);
    }
    combine_lane_slopes(w, state, w->method->b, w->n.s, w->raw);
    memcpy(w->next, w->after + index * N, N * sizeof *w->next);
}

/* Evaluates the cost of a lane at the start of step k. The gradients of the cost are written behind the state in w->one
 * unless `by` is NULL. */
static double call_lane_cost(lanes_work *w, size_t lane, int k, const double *state, double *by) {
    const size_t n = w->n.n;
    kt_rollout_task *task = &w->tasks[lane];
    double value = 0.0;
    kt_lane_take(state, w->n.W, lane, w->n.N, w->one);
    const kt_cost_point at = kt_rollout_point(w->model, &task->rollout, k, w->one);
    if (by)
        memset(by, 0, 3 * n * sizeof *by);
    const int result = w->cost(&at, &value, by, by && k < task->rollout.steps ? by + 2 * n : NULL, task->user);
    if (result != 0 || !isfinite(value))
        fail_lane(w, lane);
    return value;
}

/* kt_revolve_advance. A step may be advanced several times, from different checkpoints; its cost counts the first time
 * (w->reached steps so far). */
static kt_status advance_lanes(void *user, int k, int checkpoint, double *state, kt_error *error) {
    lanes_work *w = user;
    (void)error;
    if (k == w->reached) {
        for (size_t lane = 0; lane < w->used; lane++)
            if (kt_lane_is_in(w->active, lane))
                w->value[lane] += call_lane_cost(w, lane, k, state, NULL);
        w->reached++;
    }
    run_step(w, k, state);
    if (checkpoint >= 0)
        save_lane_states(w, (size_t)checkpoint);
    memcpy(state, w->next, w->n.W * w->n.N * sizeof *state);
    return status_of_lanes(w);
}

/* ---- adjoints ---------------------------------------------------------------------------------------------------- */

/* Computes x_i, and adds the stage's part of the gradient by tau. */
static void pull_lane_stage(lanes_work *w, size_t i) {
    const size_t W = w->n.W, nq = W * w->n.nq, n = W * w->n.n, all = nq + n;
    const double *q = w->stage + i * all, *v = q + nq;
    const kt_lane_state at = {.t = w->t, .q = q, .v = v, .active = w->active};
    double *by_q = w->by_stage + i * all, *by_v = by_q + nq;
    memcpy(w->tangent + 2 * n, w->by_slope + nq, n * sizeof *w->tangent);
    w->active &= w->kernels->adjoint(w->model, w->lanes, w->adjoint, &at, accelerations(w, i), w->tangent);
    for (size_t lane = 0; lane < w->used && w->model->n.effect > 0; lane++) {
        const double t = kt_stage_time(w->method->c[i], w->start[lane], w->h[lane]);
        kt_joint_effects_add(w->model, t, W, q + lane, v + lane, w->tangent + 2 * n + lane, w->tangent + lane,
                             w->tangent + n + lane);
    }
    memset(by_q, 0, nq * sizeof *by_q);
    memcpy(by_v, w->tangent + n, n * sizeof *by_v);
    for (size_t l = 0; l < n; l++)
        w->by_force[l] += w->tangent[2 * n + l];
    w->kernels->drop_transposed(w->model, w->lanes, q, w->tangent, by_q);
    w->kernels->rate_transposed(w->model, w->lanes, q, v, w->by_slope, by_q, by_v);
}

/* Does kt_adjoint_sweep for all lanes. */
static void sweep_lanes(lanes_work *w, const double *state) {
    const size_t W = w->n.W, nq = W * w->n.nq, n = W * w->n.n, all = nq + n;
    memset(w->by_end, 0, nq * sizeof *w->by_end);
    memcpy(w->by_end + nq, w->by_next + n, n * sizeof *w->by_end);
    w->kernels->drop_transposed(w->model, w->lanes, w->raw, w->by_next, w->by_end);
    memcpy(w->by_start, w->by_end, all * sizeof *w->by_start);
    memset(w->by_force, 0, n * sizeof *w->by_force);
    for (size_t i = w->n.s; i-- > 0;) {
        kt_adjoint_gather(w->method, i, w->n.s, all, w->by_end, w->by_stage, w->by_slope);
        for (size_t l = 0; l < all; l++)
            w->by_slope[l] *= w->h[l % W];
        pull_lane_stage(w, i);
        for (size_t l = 0; l < all; l++)
            w->by_start[l] += w->by_stage[i * all + l];
    }
    w->kernels->lift_transposed(w->model, w->lanes, state, w->by_start, w->by_next);
    memcpy(w->by_next + n, w->by_start + nq, n * sizeof *w->by_next);
    w->active &= w->kernels->finite(w->by_next, 2 * w->n.n) & w->kernels->finite(w->by_force, w->n.n);
}

/* Adds the gradient of the cost at the start of step k to that of all later steps. The last step is reversed without
 * being advanced before, so that its cost counts here. */
static void add_cost(lanes_work *w, int k, const double *state) {
    const size_t W = w->n.W, n = w->n.n;
    double *by = w->one + w->n.N;
    for (size_t lane = 0; lane < w->used; lane++) {
        if (!kt_lane_is_in(w->active, lane))
            continue;
        const double value = call_lane_cost(w, lane, k, state, by);
        double *inputs = w->inputs + (lane * w->n.steps + (size_t)k) * n;
        for (size_t i = 0; i < 2 * n; i++)
            w->by_next[i * W + lane] = by[i] + w->by_next[i * W + lane];
        for (size_t i = 0; i < n; i++)
            inputs[i] = by[2 * n + i] + w->by_force[i * W + lane];
        w->value[lane] += k == w->reached ? value : 0.0;
    }
}

/* Adds the cost after the last step. The gradient of this cost begins the sweeps. */
static void add_last_cost(lanes_work *w) {
    double *by = w->one + w->n.N;
    for (size_t lane = 0; lane < w->used; lane++) {
        if (!kt_lane_is_in(w->active, lane))
            continue;
        w->value[lane] += call_lane_cost(w, lane, (int)w->n.steps, w->next, by);
        kt_lane_put(by, w->n.W, lane, 2 * w->n.n, w->by_next);
    }
}

/* kt_revolve_reverse: the stages of step k from the checkpoint or from a repetition, then their adjoint, and the
 * gradients of the costs at both of its ends as they come. */
static kt_status reverse_lanes(void *user, int k, int checkpoint, const double *state, kt_error *error) {
    lanes_work *w = user;
    (void)error;
    if (checkpoint >= 0)
        recall(w, k, (size_t)checkpoint, state);
    else
        run_step(w, k, state);
    if (k == (int)w->n.steps - 1)
        add_last_cost(w);
    sweep_lanes(w, state);
    add_cost(w, k, state);
    return status_of_lanes(w);
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

/* Initialises w in memory, with the models and states of a group, and runs the group. Returns the lanes that
 * succeeded. */
static kt_lane_mask run_lanes(lanes_work *w, const kt_model *model, kt_rollout_task *tasks, size_t used, void *memory) {
    const kt_rollout *r = &tasks[0].rollout;
    *w = (lanes_work){.model = task_model_of(model, tasks), .tasks = tasks, .used = used, .cost = w->cost};
    w->n = counts_of(w->model, r);
    w->kernels = w->n.kernels;
    w->method = r->method;
    w->active = kt_lanes_first(used);
    (void)place_arrays(w, memory, &w->n);
    (void)w->kernels->layout(w->model, w->lanes);
    (void)w->kernels->adjoint_layout(w->model, w->adjoint);
    const size_t W = w->n.W;
    for (size_t lane = 0; lane < W; lane++) {
        const kt_rollout_task *task = &tasks[lane < used ? lane : 0];
        const kt_model *own = task_model_of(model, task);
        if (lane == 0)
            w->kernels->put_model(own, w->lanes, kt_lanes_first(W));
        else if (own != w->model)
            w->kernels->put_model(own, w->lanes, (kt_lane_mask)1 << lane);
        kt_lane_put(task->q, W, lane, w->n.nq, w->state);
        kt_lane_put(task->v, W, lane, w->n.n, w->state + W * w->n.nq);
    }
    memset(w->by_next, 0, W * 2 * w->n.n * sizeof *w->by_next);
    memset(w->value, 0, W * sizeof *w->value);
    kt_revolve checkpoints = kt_revolve_of(r, W * w->n.N, w->state, w->here, w->index, w->taken);
    return kt_revolve_run(&checkpoints, advance_lanes, reverse_lanes, w, NULL) == KT_OK ? w->active : 0;
}

/* The results of a lane. */
static void give_lane_results(const lanes_work *w, size_t lane) {
    kt_rollout_task *task = &w->tasks[lane];
    task->value = w->value[lane];
    task->status = KT_OK;
    if (task->by_start)
        kt_lane_take(w->by_next, w->n.W, lane, 2 * w->n.n, task->by_start);
    if (task->by_inputs)
        memcpy(task->by_inputs, w->inputs + lane * w->n.steps * w->n.n, w->n.steps * w->n.n * sizeof *task->by_inputs);
}

/* The gradient of one motion, in the caller's data of `model`, which serve the model of the task for this call. */
static kt_status find_gradient_alone(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                     kt_rollout_task *task, kt_cost *cost, kt_error *error) {
    const kt_model *own = task_model_of(model, task);
    if (own->shape == model->shape)
        kt_data_lend(own, data);
    task->status = kt_rollout_gradient(own, data, work, work_size, &task->rollout, task->q, task->v, &task->value,
                                       task->by_start, task->by_inputs, cost, task->user, error);
    kt_data_lend(model, data);
    return task->status;
}

kt_status kt_rollout_gradients(const kt_model *model, kt_data *data, void *work, size_t work_size,
                               kt_rollout_task *tasks, size_t count, kt_cost *cost, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, tasks || !count, cost))
        return KT_ERROR_ARGUMENT;
    kt_status first = KT_OK;
    for (size_t i = 0; i < count;) {
        const kt_rollout *r = &tasks[i].rollout;
        const kt_model *own = task_model_of(model, &tasks[i]);
        const size_t width = kt_rollout_width(own, r, NULL), left = count - i, used = left < width ? left : width;
        lanes_work w = {.cost = cost};
        kt_lane_mask done = 0;
        if (used > 1 && work && work_size >= kt_rollout_gradients_work_size(own, r) &&
            tasks_fit(model, tasks + i, used))
            done = run_lanes(&w, model, tasks + i, used, work);
        for (size_t lane = 0; lane < used; lane++) {
            tasks[i + lane].in_lanes = kt_lane_is_in(done, lane);
            if (tasks[i + lane].in_lanes)
                give_lane_results(&w, lane);
        }
        for (size_t lane = 0; lane < used; lane++) { /* in the same memory */
            kt_rollout_task *task = &tasks[i + lane];
            kt_error made;
            if (task->in_lanes)
                continue;
            if (find_gradient_alone(model, data, work, work_size, task, cost, &made) != KT_OK && first == KT_OK) {
                first = task->status;
                if (error)
                    *error = made;
            }
        }
        i += used;
    }
    return first;
}
