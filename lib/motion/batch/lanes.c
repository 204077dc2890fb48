/* The recursions of lib/mechanics/dynamics in lanes: their workspace, their choice for a model, and the lanes that are
 * sound. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "assembly/lane_project.h"
#include "base/copy.h"
#include "batch/interleave.h"
#include "dynamics/dynamics.h"
#include "joint/turn.h"

KT_ARENA_LAYOUT(lay_out, kt_data, KT_LANE_FIELDS, const kt_counts *n)

/* Indices of the lanes' angles; indices that fill up the last group of eight are arbitrary. */
static void spread_angles(const int32_t *angle, size_t count, int32_t *out) {
    for (size_t i = 0; i < count; i++)
        for (int32_t lane = 0; lane < KT_LANES; lane++)
            out[i * KT_LANES + (size_t)lane] = angle[i] * KT_LANES + lane;
    for (size_t i = KT_LANES * count; i < KT_ANGLES(KT_LANES * count); i++)
        out[i] = 0;
}

static size_t lay_out_lanes(const kt_model *model, void *memory) {
    const size_t bytes = lay_out(memory, &model->n);
    kt_data *data = memory;
    if (!memory)
        return bytes;
    data->base = NULL;
    kt_clear(data->rest, kt_where(model->n.group, model->n.v) * sizeof *data->rest);
    kt_clear(data->factored, model->n.group * sizeof *data->factored); /* read even if no state could be prepared */
    spread_angles(model->angle, model->n.angle, data->lane_angle);
    spread_angles(model->force_link_angle, model->n.force_link_angle, data->lane_force_angle);
    return bytes;
}

/* Returns the model that the recursions read: a copy of the given model, with the links, bodies and planes of the
 * lanes. */
static const kt_model *lane_model_of(const kt_model *model, void *work) {
    kt_data *data = work;
    if (data->base == model)
        return data->model;
    data->base = model;
    *data->model = *model;
    data->model->link = data->link;
    data->model->rest = data->link_rest;
    data->model->planar = data->planar_link;
    data->model->plane = data->plane;
    data->model->body = data->body;
    return data->model;
}

/* Sets `rest` of the links of the lanes. The member is the distance from a link to its record at rest, in doubles. */
static void place_rests(const kt_model *model, kt_data *data) {
    const char *links = (const void *)model->link;
    for (size_t i = 0; i < model->n.link; i++) {
        kt_link *link = &data->link[i];
        if (link->rest == 0)
            continue;
        const double *own = (const double *)(const void *)(links + i * kt_link_shape.bytes) + link->rest;
        const double *to =
            (const double *)(const void *)&data->link_rest[(const kt_link_rest *)(const void *)own - model->rest];
        link->rest = (int32_t)(to - (const double *)(const void *)link);
    }
}

/* Copies the numbers of a model to the given lanes of the records that lanes share. */
static void put_lane_model(const kt_model *model, void *work, kt_lane_mask lanes) {
    kt_data *data = work;
    const kt_vec3 g = kt_v4_vec3(model->gravity);
    const kt_records records[] = {
        {&kt_link_shape, model->n.link, KT_LANES, sizeof *data->link, model->link, data->link},
        {&kt_planar_link_shape, model->n.planar, KT_LANES, sizeof *data->planar_link, model->planar, data->planar_link},
        {&kt_plane_shape, model->n.plane, KT_LANES, sizeof *data->plane, model->plane, data->plane},
        {&kt_body_shape, model->n.body, KT_LANES, sizeof *data->body, model->body, data->body}};
    for (size_t i = 0; i < sizeof records / sizeof *records; i++)
        kt_records_interleave(&records[i], lanes);
    kt_copy(data->link_rest, model->rest, model->n.rest * sizeof *data->link_rest);
    place_rests(model, data);
    for (int lane = 0; lane < KT_LANES; lane++) {
        if (!(lanes >> lane & 1U))
            continue;
        data->gravity->x[lane] = g.x;
        data->gravity->y[lane] = g.y;
        data->gravity->z[lane] = g.z;
    }
    data->base = NULL;
}

/* Returns the sound lanes whose n numbers are finite. x - x is 0 if x is finite, otherwise NaN, and NaN persists in a
 * sum. */
static kt_lane_mask finite_lanes(kt_condition sound, const kt_real1 *x, size_t n) {
    kt_real1 excess = kt_real1_splat(0.0);
    for (size_t i = 0; i < n; i++)
        excess += x[i] - x[i];
    return kt_mask_of(sound & (excess == kt_real1_splat(0.0)));
}

/* Below: the members of kt_lane_kernels, whose contracts are in lanes.h. Each casts the arrays of doubles to vectors of
 * KT_LANES states, and calls the kernel for the model whose numbers are those of the lanes. */

/* Accelerations of a tree: the spatial and the planar links of the model, which do not act on each other. */
static void forward_tree(const kt_model *model, kt_data *data, const kt_lanes_at *at, kt_real1 *a) {
    if (model->sweep != KT_SWEEP_PLANAR)
        (void)(model->has_armature ? KT_KERNEL(kt_armature_forward) : KT_KERNEL(kt_forward))(model, data, at->q, at->v,
                                                                                             at->tau, at->external, a);
    if (model->sweep != KT_SWEEP_SPATIAL)
        (void)(model->has_armature ? KT_KERNEL(kt_planar_armature_forward)
                                   : KT_KERNEL(kt_planar_forward))(model, data, at->q, at->v, at->tau, at->external, a);
}

static kt_lane_mask lanes_forward(const kt_model *model, void *work, const kt_lane_state *state, const double *external,
                                  double *a) {
    kt_data *data = work;
    const kt_lanes_at at = {.t = *(const kt_real1 *)(const void *)state->t,
                            .q = (const void *)state->q,
                            .v = (const void *)state->v,
                            .tau = (const void *)state->tau,
                            .external = (const void *)external};
    kt_real1 *as = (void *)a;
    model = lane_model_of(model, work);
    data->sound = kt_condition_true();
    if (model->n.group > 0)
        KT_KERNEL(kt_groups_accelerate)(model, data, &at, as);
    else
        forward_tree(model, data, &at, as);
    return finite_lanes(data->sound, as, model->n.v);
}

static kt_lane_mask lanes_project(const kt_model *model, void *work, kt_lane_mask active, const double *t, double *q,
                                  double *v) {
    const kt_real1 time = *(const kt_real1 *)(const void *)t;
    kt_condition lanes = kt_condition_false();
    for (int lane = 0; lane < KT_LANES; lane++)
        lanes[lane] = (active >> lane & 1U) ? -1 : 0;
    return kt_mask_of(KT_KERNEL(kt_project)(lane_model_of(model, work), work, lanes, time, (void *)q, (void *)v));
}

static kt_lane_mask effects(const kt_model *model, void *work, const kt_lane_state *at, double *tau, double *external) {
    return at->active &
           kt_mask_of(KT_KERNEL(kt_effects_sum)(lane_model_of(model, work), work, at, (void *)tau, (void *)external));
}

static kt_lane_mask own_rates(const kt_model *model, void *work, const kt_lane_state *at, double *rates) {
    return at->active & kt_mask_of(KT_KERNEL(kt_own_rates)(lane_model_of(model, work), work, at, (void *)rates));
}

static kt_lane_mask lanes_inverse(const kt_model *model, void *work, const double *q, const double *v, const double *a,
                                  const double *external, double *tau) {
    kt_data *data = work;
    const kt_real1 *qs = (const void *)q, *vs = (const void *)v, *as = (const void *)a;
    const kt_external *on_bodies = (const void *)external;
    kt_real1 *taus = (void *)tau;
    model = lane_model_of(model, work);
    if (model->sweep != KT_SWEEP_PLANAR)
        KT_KERNEL(kt_inverse)(model, data, qs, vs, as, on_bodies, taus);
    if (model->sweep != KT_SWEEP_SPATIAL)
        KT_KERNEL(kt_planar_inverse)(model, data, qs, vs, as, on_bodies, taus);
    for (size_t i = 0; i < model->n.v && model->has_armature; i++)
        taus[i] += model->armature[i] * as[i];
    return finite_lanes(kt_condition_true(), taus, model->n.v);
}

/* Motion of all links. Returns the lanes in which all numbers are finite. */
static kt_lane_mask kinematics(const kt_model *model, void *work, const double *q, const double *v, const double *a) {
    kt_data *data = work;
    const kt_real1 *qs = (const void *)q, *vs = (const void *)v, *as = (const void *)a;
    model = lane_model_of(model, work);
    data->sound = kt_condition_true();
    if (model->sweep != KT_SWEEP_PLANAR)
        (void)KT_KERNEL(kt_kinematics)(model, data, qs, vs, as);
    if (model->sweep != KT_SWEEP_SPATIAL)
        (void)KT_KERNEL(kt_planar_kinematics)(model, data, qs, vs, as);
    return kt_mask_of(data->sound);
}

static void frame(const kt_model *model, void *work, const kt_lane_frame *at, double *motion) {
    KT_KERNEL(kt_frame_motion)(lane_model_of(model, work), work, at, (void *)motion);
}

static void lanes_jacobian(const kt_model *model, void *work, const kt_lane_frame *at, double *const *out) {
    KT_KERNEL(kt_frame_columns)(lane_model_of(model, work), work, at, out);
}

static kt_lane_mask lanes_energy(const kt_model *model, void *work, const double *q, const double *v,
                                 const double *zero, double *kinetic, double *potential) {
    kt_data *data = work;
    const kt_lane_mask done = kinematics(model, work, q, v, zero);
    model = lane_model_of(model, work);
    *(kt_real1 *)(void *)kinetic = KT_KERNEL(kt_kinetic)(model, data);
    *(kt_real1 *)(void *)potential = KT_KERNEL(kt_potential)(model, data);
    return done;
}

static void lanes_rate(const kt_model *model, void *work, const double *q, const double *v, double *out) {
    if (model->n.q == model->n.v)
        kt_copy(out, v, model->n.v * sizeof(kt_real1));
    else
        kt_turns_rate(lane_model_of(model, work), (const void *)q, (const void *)v, (void *)out);
}

static kt_lane_mask make_units(const kt_model *model, void *work, double *q) {
    return kt_mask_of(kt_turns_make_units(lane_model_of(model, work), (void *)q, false));
}

static kt_lane_mask adjoint(const kt_model *model, void *work, void *memory, const kt_lane_state *at, const double *a,
                            double *gradient) {
    return at->active &
           kt_mask_of(KT_KERNEL(kt_tree_adjoint)(lane_model_of(model, work), work, memory, at, a, gradient));
}

static void drop_transposed(const kt_model *model, void *work, const double *q, const double *by_xi, double *by_q) {
    kt_turns_drop_transposed(lane_model_of(model, work), (const void *)q, (const void *)by_xi, (void *)by_q);
}

static void rate_transposed(const kt_model *model, void *work, const double *q, const double *v, const double *by_rate,
                            double *by_q, double *by_v) {
    kt_turns_rate_transposed(lane_model_of(model, work), (const void *)q, (const void *)v, (const void *)by_rate,
                             (void *)by_q, (void *)by_v);
}

static void lift_transposed(const kt_model *model, void *work, const double *q, const double *by_q, double *by_xi) {
    kt_turns_lift_transposed(lane_model_of(model, work), (const void *)q, (const void *)by_q, (void *)by_xi);
}

static kt_lane_mask finite(const double *x, size_t n) { return finite_lanes(kt_condition_true(), (const void *)x, n); }

const kt_lane_kernels KT_PASTE(kt_lane_kernels_, KT_ISA) = {.width = KT_LANES,
                                                            .layout = lay_out_lanes,
                                                            .put_model = put_lane_model,
                                                            .forward = lanes_forward,
                                                            .effects = effects,
                                                            .own_rates = own_rates,
                                                            .project = lanes_project,
                                                            .inverse = lanes_inverse,
                                                            .kinematics = kinematics,
                                                            .frame = frame,
                                                            .jacobian = lanes_jacobian,
                                                            .energy = lanes_energy,
                                                            .rate = lanes_rate,
                                                            .make_units = make_units,
                                                            .finite = finite,
                                                            .combine = KT_KERNEL(kt_lanes_combine),
                                                            .mean_square = KT_KERNEL(kt_lanes_mean_square),
                                                            .power = KT_KERNEL(kt_lanes_power),
                                                            .adjoint_layout = KT_KERNEL(kt_adjoint_layout),
                                                            .adjoint = adjoint,
                                                            .drop_transposed = drop_transposed,
                                                            .rate_transposed = rate_transposed,
                                                            .lift_transposed = lift_transposed,
                                                            .interpolate = KT_KERNEL(kt_lanes_interpolate)};
