/* Reactions, computed only on request. A' lambda = M a + h - tau yields the loops' multipliers, and these yield the
 * loops' wrenches (loop_wrenches.c). With the loops' wrenches as external wrenches, Newton-Euler on the bodies yields
 * the joints' reactions (dynamics/total.c). Redundant loops can share a reaction in infinitely many ways. With QR and
 * partitioning, dependent equations carry no reaction at first; then reactions are shared (stress_share.c). Towards a
 * singular position reactions may grow without bound, because the lever arm of the vanishing direction vanishes. At the
 * position itself that direction carries none.
 *
 * Reactions of planar loops include the components out of the plane. The spatial kernels compute them from the
 * accelerations of the planar kernels.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/load_friction.h"
#include "model/scratch.h"
#include "model/switching.h"

#include <string.h>

void kt_multipliers_put(const kt_model *model, kt_data *data, const double *multipliers) {
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (kt_loop_is_off(loop))
            continue;
        const int32_t *slot = model->slot + loop->slot;
        const kt_group_work w = kt_group_matrices(model, data, (size_t)loop->group, KT_ROWS_ALL);
        for (int r = 0; r < loop->row_count; r++)
            if (slot[r] >= 0)
                w.multiplier[slot[r]] = multipliers[loop->equation + r];
    }
}

/* Some loops press on their bearings with forces that do no work, such as the parting force of teeth
 * (kt_loop_kind.load). Bearings that are joints of the tree need no more. If a bearing is a loop, its multipliers have
 * to balance these forces: they act on the bodies, and the equations are solved once more. The multipliers on which the
 * forces depend do not change. */
static void balance_idle_wrenches(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    kt_dynamic_state loaded = *at;
    for (size_t i = 0; i < model->n.body; i++)
        if (at->external) {
            data->idle[i].moment = kt_vec3_add(data->idle[i].moment, at->external[i].moment);
            data->idle[i].force = kt_vec3_add(data->idle[i].force, at->external[i].force);
        }
    loaded.external = data->idle;
    (void)kernels->forward(model, data, &loaded, false, data->scratch);
    kernels->multipliers(model, data, at->v, a);
    kt_copy_or_clear(data->loaded, at->external, model->n.body * sizeof *data->loaded);
    kernels->react(model, data, at->t, data->loaded, NULL, data->loop_wrench);
}

/* Finds the multipliers for the accelerations a, and from these the wrenches of the loops on the links
 * (data->loop_wrench). */
KT_INLINE void find_multipliers(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a) {
    kt_dynamic_state loaded = *at;
    model = kt_model_now(model, data);
    kt_copy_or_clear(data->loaded, loaded.external, model->n.body * sizeof *data->loaded);
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    loaded.tau = loaded.tau ? loaded.tau : model->zero;
    if (data->interpolated || model->sweep != KT_SWEEP_SPATIAL)
        (void)kernels->forward(model, data, &loaded, false, data->scratch);
    kernels->multipliers(model, data, at->v, a);
    if (data->given_multipliers != NULL)
        kt_multipliers_put(model, data, data->given_multipliers);
    if (model->n.load > 0)
        memset(data->idle, 0, model->n.body * sizeof *data->idle);
    kernels->react(model, data, at->t, data->loaded, model->n.load > 0 ? data->idle : NULL, data->loop_wrench);
    if (model->n.load > 0 && data->given_multipliers == NULL)
        balance_idle_wrenches(model, data, &loaded, a);
    kt_clear(data->stress_multiplier, kt_where(model->n.stress, model->n.row) * sizeof *data->stress_multiplier);
}

void kt_multipliers_find(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a) {
    find_multipliers(model, data, at, a);
}

/* Returns the wrenches on bodies, of external forces and of loops, and writes the loops' wrenches into data. Data hold
 * the equations of the last evaluation unless it was planar or interpolated from neighbouring states. */
static const kt_wrench *load_wrenches(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                      const double *a) {
    kt_dynamic_state loaded = *at;
    if (model->n.effect > 0) /* links carry forces also if only auxiliary states read markers */
        kt_effects_recall(model, data, &loaded);
    if (model->n.loaded > 0)
        loaded.tau = data->load_tau;
    if (model->variants) /* no reactions of loops that are off */
        memset(data->loop_wrench, 0, model->n.loop * sizeof *data->loop_wrench);
    if (!model->n.group)
        return loaded.external;
    if (model->n.slip > 0)
        loaded.external = kt_slip_load(model, data, loaded.external);
    find_multipliers(model, data, &loaded, a);
    if (model->n.stress > 0) /* friction by loads reads the links after the reactions are shared */
        kt_stresses_find(model, data, at->t, at->q, model->n.loaded > 0);
    return data->loaded;
}

/* Returns the index of the first wrench that is not finite, or count if there is none. */
static size_t find_not_finite(const kt_wrench *wrenches, size_t count) {
    size_t i = 0;
    while (i < count && kt_vec3_is_finite(wrenches[i].moment) && kt_vec3_is_finite(wrenches[i].force))
        i++;
    return i;
}

/* Reactions can overflow where accelerations do not: a torque that a loop holds moves nothing. */
static kt_status reject_reaction(const char *kind, const char *name, double t, kt_error *error) {
    return kt_error_set(error, KT_ERROR_NOT_FINITE, kt_where_format("t = %.9g s, %s '%s'", t, kind, name).text,
                        "the reaction overflows; look for a velocity, force or torque that is huge");
}

kt_status kt_motion_complete(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a,
                             kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops, kt_error *error) {
    const kt_wrench *loaded = joints || loops ? load_wrenches(model, data, at, a) : NULL;
    const kt_status status = kt_links_update(model, data, at->q, at->v, a, !data->interpolated, links, error);
    if (status != KT_OK)
        return status;
    const bool shares = loaded && model->n.stress > 0;
    const bool rubs = (joints || loops) && model->n.loaded > 0;
    const kt_wrench *found = joints || shares || rubs ? kt_joint_reactions_find(model, data, links, loaded) : NULL;
    if (shares)
        kt_reactions_share(model, data, at->t, at->q, data->wrench, data->loop_wrench);
    if (rubs)
        kt_loads_take(model, data, links, found);
    const size_t loop = loops ? find_not_finite(data->loop_wrench, model->n.loop) : model->n.loop;
    const size_t body = joints ? find_not_finite(found, model->n.body) : model->n.body;
    if (loop < model->n.loop)
        return reject_reaction("loop", kt_loop_name(model, (int)loop), at->t, error);
    if (body < model->n.body)
        return reject_reaction("body", kt_body_name(model, (int)body), at->t, error);
    if (loops)
        memcpy(loops, data->loop_wrench, model->n.loop * sizeof *loops);
    if (joints)
        memcpy(joints, found, model->n.body * sizeof *joints);
    return KT_OK;
}

kt_status kt_motion_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                             kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops, kt_error *error) {
    double *a = kt_scratch_part(model, data, 2);
    const kt_status status = kt_acceleration_trusted(model, data, at, a, error);
    return status == KT_OK ? kt_motion_complete(model, data, at, a, links, joints, loops, error) : status;
}

/* The multiplier of an equation of a loop; zero for equations that no group contains. */
static double equation_multiplier_of(const kt_model *model, const kt_data *data, const kt_loop_record *loop, int r) {
    const int32_t slot = model->slot[loop->slot + r];
    const double shared = model->n.stress > 0 ? data->stress_multiplier[loop->equation + r] : 0.0;
    return slot >= 0 ? kt_group_matrices(model, data, (size_t)loop->group, KT_ROWS_ALL).multiplier[slot] + shared
                     : shared;
}

kt_status kt_multipliers_take(const kt_model *model, const kt_data *data, double t, double *multipliers,
                              kt_error *error) {
    for (size_t i = 0; i < model->n.loop; i++)
        for (int r = 0; r < model->loop[i].row_count; r++)
            if (!isfinite(equation_multiplier_of(model, data, &model->loop[i], r)))
                return reject_reaction("loop", kt_loop_name(model, (int)i), t, error);
    for (size_t i = 0; i < model->n.loop; i++)
        for (int r = 0; r < model->loop[i].row_count; r++)
            multipliers[model->loop[i].equation + r] = equation_multiplier_of(model, data, &model->loop[i], r);
    return KT_OK;
}

kt_status kt_multiplier_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                 const double *tau, const kt_wrench *external, double *multipliers, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, multipliers || !model->n.row))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    double *a = kt_scratch_part(model, data, 2);
    kt_status status = kt_open_contacts_reject(model, data, &at, error);
    if (status == KT_OK)
        status = kt_acceleration_trusted(model, data, &at, a, error);
    if (status != KT_OK)
        return status;
    const kt_wrench *loaded = load_wrenches(model, data, &at, a);
    if (model->n.stress > 0) {
        kt_link_kinematics *links = kt_links_scratch(data);
        status = kt_links_update(model, data, q, at.v, a, !data->interpolated, links, error);
        if (status != KT_OK)
            return status;
        (void)kt_joint_reactions_find(model, data, links, loaded);
        kt_reactions_share(model, data, t, q, data->wrench, data->loop_wrench);
    }
    return kt_multipliers_take(model, data, t, multipliers, error);
}

kt_status kt_reaction_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                               const double *tau, const kt_wrench *external, kt_wrench *joints, kt_wrench *loops,
                               kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    const kt_status status = kt_open_contacts_reject(model, data, &at, error);
    return status == KT_OK ? kt_motion_evaluate(model, data, &at, kt_links_scratch(data), joints, loops, error)
                           : status;
}
