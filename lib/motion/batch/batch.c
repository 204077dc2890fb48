/* Many states of one model: their memory.
 *
 * States are in groups of as many as a vector of the instruction set has lanes. The recursions over trees, effects and
 * loops in groups of moderate size (kt_lanes_fit_model) are computed for a group at once (lanes.c). Other models with
 * loops are computed state by state, by the calls for one state. So is a lane that fails, to obtain the error that
 * names the joint.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/batch.h"
#include "base/options.h"

#include "constraint/group.h"
#include "evaluate/evaluate.h"
#include "loop/loop.h"
#include "reduction/method.h"

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_batch, KT_BATCH_FIELDS, const kt_batch_counts *n)
KT_ARENA_LAYOUT(lay_out_work, kt_batch_work, KT_BATCH_WORK_FIELDS, const kt_batch_counts *n)

/* Whether lanes have all equations of a loop. Lanes have no formulas, no equations of a caller, and no spatial
 * equations in a plane. */
static bool loop_fits(const kt_model *model, int32_t index, bool in_plane) {
    const kt_loop_record *loop = &model->loop[index];
    if (loop->kind == KT_LOOP_KIND_CUSTOM)
        return false;
    if (loop->term_count || !in_plane)
        return loop->term_count == 0 || loop->form == 0;
    const kt_planar_loop *flat = &model->planar_loop[index];
    for (int i = 0; i < flat->count; i++)
        if (flat->row[i].kind == KT_PLANAR_ROW_SPATIAL)
            return false;
    return true;
}

/* Whether lanes compute a group. A group in space passes an inertia to its moving parent that is symmetric only to
 * rounding. In lanes, dynamics/aba_armature.c does not have such inertias. */
static bool group_fits_lanes(const kt_model *model, const kt_group *group) {
    const bool in_plane = model->sweep != KT_SWEEP_SPATIAL && group->planar;
    if (group->form == KT_FORM_DENSE ? group->v_count >= KT_LARGE || group->ranges || group->balanced
                                     : group->form != KT_FORM_PIN && group->form != KT_FORM_DELASSUS)
        return false;
    for (int i = 0; i < group->link_count && group->form == KT_FORM_DELASSUS; i++) {
        const kt_link *link = &model->link[model->group_link[group->link + i]];
        if (link->motion == KT_MOTION_SPHERICAL && link->has_armature) /* whose inverse inertias lanes do not keep */
            return false;
    }
    if (!in_plane && group->parent && model->has_armature)
        return false;
    for (int i = 0; i < group->loop_count; i++)
        if (!loop_fits(model, model->group_loop[group->loop + i], in_plane))
            return false;
    return true;
}

/* Whether an effect acts in a coordinate of a loop, or along a path. Lanes compute neither. */
static bool has_effects_without_lanes(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (model->effect[i].relative.type || model->effect[i].path_count > 0)
            return true;
    return false;
}

bool kt_lanes_fit_model(const kt_model *model) {
    if (has_effects_without_lanes(model) || model->n.loaded > 0)
        return false;
    if (model->n.group == 0)
        return true;
    if (model->forward != kt_closed_forward || !model->reduction->pins || model->disagreement > 0.0)
        return false;
    for (size_t g = 0; g < model->n.group; g++)
        if (!group_fits_lanes(model, &model->group[g]))
            return false;
    return true;
}

const kt_lane_kernels *kt_lane_kernels_of(const kt_model *model) {
    if (!kt_lanes_fit_model(model))
        return NULL;
    KT_BY_ISA(model->isa, return &, kt_lane_kernels, );
}

static bool is_explicit(const kt_method *method) {
    return kt_method_family_of(method) == &kt_family_explicit && kt_method_check_sizes(method, NULL) == KT_OK;
}

/* The fsal stage of a method is not counted: it belongs to the next step. Wrenches on bodies exist if links carry
 * forces (kt_where: the count, or 0). */
static kt_batch_counts count_batch(const kt_model *model, const kt_batch_options *options) {
    const kt_lane_kernels *kernels = kt_lane_kernels_of(model);
    const kt_method *method = options->method;
    kt_batch_counts n = {.states = options->states,
                         .threads = options->threads > 0 ? options->threads : 1,
                         .width = kernels ? kernels->width : 1};
    n.groups = (n.states + n.width - 1) / n.width;
    n.stages = method ? (size_t)(method->stages - (method->fsal ? 1 : 0)) : 0;
    n.nq = model->n.q;
    n.nv = model->n.v;
    n.nx = model->n.x;
    n.N = n.nq + n.nv + n.nx;
    n.loops = model->n.group;
    n.body = kt_where(model->n.force_link, model->n.body);
    n.lane_bytes = kernels ? kernels->layout(model, NULL) : 0;
    n.data_bytes = kt_data_size(model);
    n.work_bytes = lay_out_work(NULL, &n);
    return n;
}

/* Whether `most` times the bytes of a batch of one state and one thread are at most a quarter of all addresses. Then no
 * sum or product of sizes wraps around, since a state or a thread of a larger batch needs no more bytes. */
static bool fits_memory(const kt_model *model, const kt_batch_options *options, size_t most) {
    const kt_batch_counts n =
        count_batch(model, &(kt_batch_options){.states = 1, .threads = 1, .method = options->method});
    return most <= SIZE_MAX / 4 / lay_out(NULL, &n);
}

static kt_status check_batch_options(const kt_model *model, const kt_batch_options *options, kt_error *error) {
    if (options->states == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options.states", "there are no states; give 1 or more");
    if (options->method && !is_explicit(options->method))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options.method",
                            "many states step at once with explicit Runge-Kutta methods only, and '%s' is not one: "
                            "take rk4, dopri5 or another one of that family",
                            options->method->name);
    const bool states_fit = fits_memory(model, options, options->states);
    if (!states_fit || !fits_memory(model, options, options->threads))
        return kt_error_set(error, KT_ERROR_ARGUMENT, states_fit ? "options.threads" : "options.states",
                            "%lu: more than memory can hold",
                            (unsigned long)(states_fit ? options->threads : options->states));
    return KT_OK;
}

size_t kt_batch_size(const kt_model *model, const kt_batch_options *options) {
    kt_batch_options own = kt_batch_options_default();
    const kt_batch_options *o = KT_OPTIONS(kt_batch_options, method, &own, options, NULL);
    if (!model || !options || !o || check_batch_options(model, o, NULL) != KT_OK)
        return 0;
    const kt_batch_counts n = count_batch(model, o);
    return lay_out(NULL, &n);
}

/* Initialises the workspace of a thread; no lane has the numbers of a model yet. */
static kt_status init_work(kt_batch *batch, size_t thread, kt_error *error) {
    kt_batch_work *w = kt_batch_work_of(batch, thread);
    (void)lay_out_work(w, &batch->n);
    w->batch = batch;
    w->put = NULL;
    if (batch->kernels)
        (void)batch->kernels->layout(batch->model, w->lanes);
    return kt_data_init(batch->model, w->alone, batch->n.data_bytes, &w->data, error);
}

kt_status kt_batch_init(const kt_model *model, const kt_batch_options *options, void *memory, size_t size,
                        kt_batch **batch, kt_error *error) {
    if (KT_IS_MISSING(error, model, options, batch))
        return KT_ERROR_ARGUMENT;
    kt_batch_options own = kt_batch_options_default();
    const kt_batch_options *o = KT_OPTIONS(kt_batch_options, method, &own, options, error);
    kt_status status = o ? check_batch_options(model, o, error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status =
            kt_masses_reject(model, "kt_batch_init", "a batch has one model; take a simulation for each state", error);
    if (status == KT_OK)
        status = kt_massless_reject(model, "kt_batch_init", "a batch does not compute this balance", error);
    if (status == KT_OK)
        status = kt_arena_begin("kt_batch_init", "kt_batch_size", memory, size, kt_batch_size(model, o), error);
    if (status != KT_OK)
        return status;
    const kt_batch_counts n = count_batch(model, o);
    (void)lay_out(memory, &n);
    kt_batch *made = memory;
    made->model = model;
    made->kernels = kt_lane_kernels_of(model);
    made->method = o->method;
    made->n = n;
    made->why = made->kernels ? NULL
                              : "it has large groups of loops, equations by formulas or by a program, wheels or ropes "
                                "in a plane, effects in coordinates of loops, or friction from loads: these are "
                                "computed state by state";
    for (size_t i = 0; i < n.threads && status == KT_OK; i++)
        status = init_work(made, i, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < n.groups * n.width; i++) { /* those that fill up the last group, too */
        made->own[i] = model;
        double *y = made->y + i / n.width * n.width * n.N;
        kt_lane_put(model->q0, n.width, i % n.width, n.nq, y);
        kt_lane_put(model->v0, n.width, i % n.width, n.nv + n.nx, y + n.width * n.nq); /* auxiliary states follow */
    }
    *batch = made;
    return KT_OK;
}

kt_status kt_batch_create(const kt_model *model, const kt_batch_options *options, kt_batch **batch, kt_error *error) {
    if (KT_IS_MISSING(error, model, options, batch))
        return KT_ERROR_ARGUMENT;
    kt_batch_options own = kt_batch_options_default();
    const kt_batch_options *o = KT_OPTIONS(kt_batch_options, method, &own, options, error);
    const kt_status status = o ? check_batch_options(model, o, error) : KT_ERROR_ARGUMENT;
    if (status != KT_OK)
        return status;
    const size_t size = kt_batch_size(model, options);
    void *memory = kt_arena_allocate(size, "the batch", error);
    return memory ? kt_arena_own(memory, kt_batch_init(model, options, memory, size, batch, error)) : KT_ERROR_MEMORY;
}

void kt_batch_free(kt_batch *batch) { kt_arena_free(batch); }

size_t kt_batch_count(const kt_batch *batch) { return batch ? batch->n.states : 0; }

/* ---- one state --------------------------------------------------------------------------------------------------- */

/* Reports an index that is not one of the batch's states. */
static bool is_other_state(const kt_batch *batch, size_t state, kt_error *error) {
    if (state < batch->n.states)
        return false;
    (void)kt_error_set(error, KT_ERROR_ARGUMENT, "state", "there is no state %lu: the batch has %lu",
                       (unsigned long)state, (unsigned long)batch->n.states);
    return true;
}

/* The numbers of a state's group, of which each state has n, in an array of all groups. */
static double *group_in(const kt_batch *batch, double *all, size_t state, size_t n) {
    const size_t width = batch->n.width;
    return all + state / width * width * n;
}

kt_status kt_batch_set_state(kt_batch *batch, size_t state, double t, const double *q, const double *v,
                             kt_error *error) {
    if (KT_IS_MISSING(error, batch, q || !batch->n.nq) || is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "t", "the time %g s of state %lu is not finite", t,
                            (unsigned long)state);
    const size_t width = batch->n.width, nq = batch->n.nq, nv = batch->n.nv;
    double *y = group_in(batch, batch->y, state, batch->n.N);
    kt_lane_put(q, width, state % width, nq, y);
    kt_lane_put(v, width, state % width, nv, y + width * nq);
    batch->t[state] = t;
    batch->status[state] = KT_OK;
    return KT_OK;
}

kt_status kt_batch_set_model(kt_batch *batch, size_t state, const kt_model *model, kt_error *error) {
    if (KT_IS_MISSING(error, batch, model) || is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    if (model->shape != batch->model->shape)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_batch_set_model",
                            "the model is of another mechanism than the batch; take a copy of its model "
                            "(kt_model_copy)");
    batch->own[state] = model;
    for (size_t i = 0; i < batch->n.threads; i++)
        kt_batch_work_of(batch, i)->put = NULL; /* it may be another one in the same place */
    return KT_OK;
}

/* Sets the nv numbers of a state in an array of all groups. */
static kt_status set_state_numbers(kt_batch *batch, size_t state, double *all, const double *from, kt_error *error) {
    if (is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    const size_t width = batch->n.width, nv = batch->n.nv;
    kt_lane_put(from, width, state % width, nv, group_in(batch, all, state, nv));
    return KT_OK;
}

kt_status kt_batch_set_torque(kt_batch *batch, size_t state, const double *tau, kt_error *error) {
    return KT_IS_MISSING(error, batch) ? KT_ERROR_ARGUMENT : set_state_numbers(batch, state, batch->tau, tau, error);
}

kt_status kt_batch_set_acceleration(kt_batch *batch, size_t state, const double *a, kt_error *error) {
    return KT_IS_MISSING(error, batch) ? KT_ERROR_ARGUMENT : set_state_numbers(batch, state, batch->a, a, error);
}

kt_status kt_batch_get_state(const kt_batch *batch, size_t state, double *t, double *q, double *v, kt_error *error) {
    if (KT_IS_MISSING(error, batch) || is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    const size_t width = batch->n.width, nq = batch->n.nq, nv = batch->n.nv;
    const double *y = group_in(batch, batch->y, state, batch->n.N);
    if (t)
        *t = batch->t[state];
    if (q)
        kt_lane_take(y, width, state % width, nq, q);
    if (v)
        kt_lane_take(y + width * nq, width, state % width, nv, v);
    return KT_OK;
}

/* The auxiliary states of a state's group. */
static double *auxiliary_states_in(const kt_batch *batch, size_t state) {
    return group_in(batch, batch->y, state, batch->n.N) + batch->n.width * (batch->n.nq + batch->n.nv);
}

kt_status kt_batch_set_auxiliary_states(kt_batch *batch, size_t state, const double *x, kt_error *error) {
    if (KT_IS_MISSING(error, batch, x || !batch->n.nx) || is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    kt_lane_put(x, batch->n.width, state % batch->n.width, batch->n.nx, auxiliary_states_in(batch, state));
    return KT_OK;
}

kt_status kt_batch_get_auxiliary_states(const kt_batch *batch, size_t state, double *x, kt_error *error) {
    if (KT_IS_MISSING(error, batch, x || !batch->n.nx) || is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    kt_lane_take(auxiliary_states_in(batch, state), batch->n.width, state % batch->n.width, batch->n.nx, x);
    return KT_OK;
}

/* Copies the nv numbers of a state out of an array of all groups. */
static kt_status get_numbers(const kt_batch *batch, size_t state, double *all, double *to, kt_error *error) {
    if (is_other_state(batch, state, error))
        return KT_ERROR_ARGUMENT;
    const size_t width = batch->n.width, nv = batch->n.nv;
    kt_lane_take(group_in(batch, all, state, nv), width, state % width, nv, to);
    return KT_OK;
}

kt_status kt_batch_get_torque(const kt_batch *batch, size_t state, double *tau, kt_error *error) {
    return KT_IS_MISSING(error, batch, tau || !batch->n.nv) ? KT_ERROR_ARGUMENT
                                                            : get_numbers(batch, state, batch->tau, tau, error);
}

kt_status kt_batch_get_acceleration(const kt_batch *batch, size_t state, double *a, kt_error *error) {
    return KT_IS_MISSING(error, batch, a || !batch->n.nv) ? KT_ERROR_ARGUMENT
                                                          : get_numbers(batch, state, batch->a, a, error);
}

kt_status kt_batch_status(const kt_batch *batch, size_t state) {
    return batch && state < batch->n.states ? (kt_status)batch->status[state] : KT_ERROR_ARGUMENT;
}

kt_batch_report kt_batch_report_of(const kt_batch *batch) {
    kt_batch_report report = {0, NULL, 0, 0, 0};
    if (!batch)
        return report;
    report.width = batch->n.width;
    report.why = batch->why;
    for (size_t i = 0; i < batch->n.threads; i++) {
        const kt_batch_work *w = kt_batch_work_of(batch, i);
        report.in_lanes += w->in_lanes;
        report.alone += w->alone_count;
        report.failed += w->failed;
    }
    return report;
}

kt_batch_lanes kt_batch_lanes_of(kt_batch *batch) {
    kt_batch_lanes lanes;
    memset(&lanes, 0, sizeof lanes);
    if (!batch)
        return lanes;
    const kt_batch_counts *n = &batch->n;
    lanes.width = n->width;
    lanes.groups = n->groups;
    lanes.state_stride = n->width * n->N;
    lanes.force_stride = n->width * n->nv;
    lanes.t = batch->t;
    lanes.q = batch->y;
    lanes.v = batch->y + n->width * n->nq;
    lanes.x = lanes.v + n->width * n->nv;
    lanes.tau = batch->tau;
    lanes.a = batch->a;
    return lanes;
}
