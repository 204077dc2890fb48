/* Accelerations of mechanisms with loops and effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_EVALUATE_H
#define KT_MECHANISM_EVALUATE_H

#include "assembly/project.h"
#include "effect/effect.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "model/switching.h"

/* kt_acceleration_evaluate without a check of its pointers: all but tau, external and error are given. */
KT_CHECKED kt_status kt_acceleration_trusted(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                             double *a, kt_error *error);

/* kt_loop_equations without these checks, with the Jacobian by groups, no two of which share coordinates. Each equation
 * of a group has a row over its coordinates (model->group_v), and `entries` has model->n.entry numbers.
 *
 * kt_loop_entry returns the first number of a row of a loop.
 *
 * kt_loop_entries_of fills the rows of one loop, which is on, into the same arrays. Before this call, the kernel
 * `follow` has computed the motion of all links, and the rows are zero at the coordinates of the loop's paths. The
 * other entries of the rows are left as they are. Numbers are not checked. */
KT_CHECKED kt_status kt_loop_entries(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *entries,
                                     double *residual, double *rate, double *drift, kt_error *error);
void kt_loop_entries_of(const kt_model *model, const kt_data *data, const kt_dynamic_state *at, int index,
                        double *entries, double *residual, double *rate, double *drift);
static inline size_t kt_loop_entry(const kt_group *group, const kt_loop_record *loop, int row) {
    return group->entry + (size_t)(loop->row + row) * (size_t)group->v_count;
}

/* kt_state_project without these checks; `changed` may be NULL. */
KT_CHECKED kt_status kt_state_project_trusted(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                              bool *changed, kt_error *error);

/* Closes a state after a step at time t. If `projects`, the loops are closed by kt_state_project. Without loops, the
 * quaternions become units (kt_position_make_units). */
KT_CHECKED kt_status kt_state_close(const kt_model *model, kt_data *data, double t, bool projects, double *q, double *v,
                                    kt_error *error);

/* Scales quaternions to unit norm. A quaternion whose norm is 1 within rounding stays unchanged, because repeated
 * division would let it drift. Returns false if a quaternion is zero or not finite. */
bool kt_unit_quaternions(const kt_model *model, double *q);

/* Assembles the initial state into q and v; leaves q and v untouched if the assembly fails. */
void kt_assemble_initial(const kt_model *model, kt_data *data, double *q, double *v);

/* Adds the forces of the effects to at->tau and at->external. If a force was added, both pointers then lead to sums in
 * data. Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK, each naming the effect and the time. */
KT_CHECKED kt_status kt_effects_apply(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_error *error);

/* Does the same as kt_effects_apply, and adds the derivatives of the forces by time (per second). All effects must have
 * these derivatives (kt_effect_is_differenced). */
KT_CHECKED kt_status kt_effects_apply_rising(const kt_model *model, kt_data *data, kt_dynamic_state *at,
                                             kt_error *error);

/* Writes da/dt at fixed q and v, from a = kt_acceleration_evaluate at this state. The model has no driven loops, and
 * all its effects have derivatives. The result is exact: a is linear in the forces, whose derivatives are exact, and so
 *     da/dt = a(tau + dtau/dt) - a(tau)
 */
KT_CHECKED kt_status kt_acceleration_time_derivative(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                                     const double *a, double *da_dt, kt_error *error);

/* Adds only the forces of a caller's own effects without derivatives. */
KT_CHECKED kt_status kt_effects_apply_differenced(const kt_model *model, kt_data *data, kt_dynamic_state *at,
                                                  kt_error *error);

/* Returns the error of a callback that did not provide derivatives: its code, or 0 if the derivatives are not
 * finite. */
kt_status kt_effect_reject_derivatives(const kt_model *model, const kt_effect_record *effect, double t, int code,
                                       kt_error *error);

/* Does the same as kt_effects_apply for all effects, and sums their powers. */
KT_CHECKED kt_status kt_effects_account(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_power *power,
                                        kt_error *error);

/* Returns the record of an effect by its index in the description, or NULL if there is none. */
const kt_effect_record *kt_effect_record_find(const kt_model *model, int source);

/* Checks a state for kt_effect_load_find: whether it is finite and, if `has_ends`, whether data hold its kinematics. */
KT_CHECKED kt_status kt_effect_state_check(const kt_model *model, const kt_data *data, const double *q, const double *v,
                                           bool has_ends, kt_error *error);
/* kt_effect_ends_find writes the motion of the ends, from the kinematics of the last update.
 *
 * kt_effect_load_find does this and finds the load of the effect, as kt_effect_evaluate. Returns the code of a
 * callback, otherwise 0. */
void kt_effect_ends_find(const kt_data *data, const kt_effect_record *effect, kt_effect_end end[2]);
int kt_effect_load_find(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                        const kt_effect_record *effect, kt_effect_end end[2], kt_effect_load *load);

/* The lowest point of the sphere of a contact, the normal of its plane, towards the sphere, and the velocity of slip.
 * Data hold the kinematics. */
typedef struct kt_contact_kinematics {
    kt_vec3 point, normal, slip;
} kt_contact_kinematics;
kt_contact_kinematics kt_contact_kinematics_find(const kt_data *data, const kt_effect_record *effect);

/* Points at->tau and at->external at the sums that kt_effects_apply left in data, if it added a force. */
void kt_effects_recall(const kt_model *model, const kt_data *data, kt_dynamic_state *at);

/* Writes the partial derivatives by time of the rates of auxiliary states (kt_auxiliary_state_count). Returns the code
 * of a law's callback, otherwise 0. */
int kt_auxiliary_state_time_derivatives(const kt_model *model, kt_data *data, double t, const double *q,
                                        const double *v, double *derivatives);

/* kt_massless_balance for a finite state of a model with massless coordinates. Writes the state to data->balanced_q and
 * balanced_v. */
KT_CHECKED kt_status kt_massless_solve(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                       kt_error *error);

/* kt_auxiliary_state_rates for a finite state; rates are written in any case. */
KT_CHECKED kt_status kt_auxiliary_state_rates_trusted(const kt_model *model, kt_data *data, double t, const double *q,
                                                      const double *v, double *rates, kt_error *error);

/* The first auxiliary state whose rate is not the number 0. If all states are constant along every motion, like the
 * positions of footholds, returns their number. */
size_t kt_auxiliary_state_varying(const kt_model *model);
/* Whether all auxiliary states are constant, and no formula of the model reads an auxiliary state. */
bool kt_auxiliary_states_are_idle(const kt_model *model);

/* Rejects a model with auxiliary states with KT_ERROR_UNSUPPORTED at `where`, for a calculation that does not support
 * auxiliary states. The argument `what` completes the message "the model has auxiliary states, and". `what` names the
 * part left out and an alternative. */
KT_INNER KT_CHECKED kt_status kt_auxiliary_states_reject(const kt_model *model, const char *where, const char *what,
                                                         kt_error *error);

/* The error of a matrix of inertia that is not positive along a degree of freedom. */
kt_status kt_inertia_reject(const char *where, kt_error *error);

/* kt_acceleration_evaluate for a model with loops, without effects. data->interpolated is set if a was interpolated
 * from neighbouring states near a singular position. */
kt_forward_call kt_closed_forward;

/* Near a singular position, rounding spoils the acceleration that `forward` has left in data->scratch. This function
 * replaces the acceleration by a better one (singular_crossing.c). `failed` is the result of `forward`. The new result
 * is returned. */
size_t kt_crossing_accelerate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, size_t failed);

/* The k-th loop that slips, and its name. */
static inline const kt_loop_record *kt_slip_loop(const kt_model *model, size_t k) {
    size_t i = 0;
    for (size_t left = k + 1; i < model->n.loop; i++)
        if (model->loop[i].slips > 0 && --left == 0)
            break;
    return &model->loop[i];
}
static inline const char *kt_slip_name(const kt_model *model, size_t k) {
    return kt_loop_name(model, (int)(kt_slip_loop(model, k) - model->loop));
}

/* The coefficient of friction of the k-th contact. */
static inline double kt_slip_friction(const kt_model *model, size_t k) {
    return kt_effect_record_find(model, kt_slip_loop(model, k)->slips - 1)->friction;
}

/* Wrenches on bodies, data->slip_loaded. kt_slip_begin_load sets these wrenches to the external wrenches (NULL: none).
 *
 * kt_slip_add_force adds a force on the sphere of the k-th contact, in the plane's axes, and its opposite on the plane.
 *
 * kt_slip_add_friction_load adds the contact's friction, with the direction of the last evaluation.
 *
 * kt_slip_load returns the wrenches in which the last evaluation ended: the external wrenches, and all friction of
 * slip. */
void kt_slip_begin_load(const kt_model *model, kt_data *data, const kt_wrench *external);
void kt_slip_add_force(kt_data *data, const kt_effect_record *effect, size_t k, double x, double y);
void kt_slip_add_friction_load(kt_data *data, const kt_effect_record *effect, size_t k, double normal);
const kt_wrench *kt_slip_load(const kt_model *model, kt_data *data, const kt_wrench *external);

/* Rejects a model in which hard contacts slip, or with friction from loads, for derivatives, which would leave the
 * friction out. */
KT_CHECKED kt_status kt_slip_reject(const kt_model *model, const char *where, kt_error *error);

/* Writes the multipliers of the equations of loops under all forces, at->tau and at->external, to the groups' data, and
 * the wrenches of the loops. Data hold the equations of the last evaluation of a. data->loaded: all wrenches on
 * bodies. */
void kt_multipliers_find(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a);

/* The first loop that bears the force of an effect: a closed contact or stop, or friction that sticks. -1: the effect
 * bears its force itself. */
static inline int kt_effect_closed_loop(const kt_model *model, const kt_effect_record *effect) {
    for (int32_t i = effect->loop; i < effect->loop + effect->loops; i++)
        if (!kt_loop_is_off(&model->loop[i]))
            return i;
    (void)model, (void)effect;
    return -1;
}

/* Rejects a state in which an open contact touches and does not part, since an evaluation would leave its reaction out
 * (evaluate/open.c). Data keep all results. Data of an owner that follows contacts are exempt. */
KT_CHECKED static inline kt_status kt_open_contacts_reject(const kt_model *model, kt_data *data,
                                                           const kt_dynamic_state *at, kt_error *error) {
    if (model->variants != NULL && !data->followed) {
        const kt_status status = model->variants->check_open(model, data, at->t, at->q, at->v, error);
        data->placed = false; /* the caller may change the poses */
        return status;
    }
    (void)model, (void)data, (void)at, (void)error;
    return KT_OK;
}

/* Completes the last evaluation of accelerations, a = kt_acceleration_evaluate at this state, from its results in data.
 * Writes the kinematics of the motion to links, and the reactions to joints and loops (unless both are NULL). An
 * interpolation near a singular position and the planar recursion leave some results out, and only these are computed
 * again. The bits are those of kt_kinematics_update with a and of kt_reaction_evaluate. */
KT_CHECKED kt_status kt_motion_complete(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                        const double *a, kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops,
                                        kt_error *error);

/* Writes the multipliers that the last kt_motion_complete with reactions left in data, in the form of
 * kt_multiplier_evaluate. */
KT_CHECKED kt_status kt_multipliers_take(const kt_model *model, const kt_data *data, double t, double *multipliers,
                                         kt_error *error);

/* Puts multipliers in the form of kt_multiplier_evaluate into the groups of the data. */
void kt_multipliers_put(const kt_model *model, kt_data *data, const double *multipliers);

/* Finds the self-stresses of redundant groups from the poses of the links (stress_share.c). Without `all`, planar
 * groups are left out whose self-stresses leave the plane, because their reactions seldom do.
 *
 * kt_reactions_share shares the reactions of these groups: adds to joints (n.body), loops, and data->stress_multiplier.
 * If a reaction leaves the plane, the self-stresses of its group are found after all. This places the links at q once
 * more, and overwrites kt_links_scratch. */
void kt_stresses_find(const kt_model *model, kt_data *data, double t, const double *q, bool all);
void kt_reactions_share(const kt_model *model, kt_data *data, double t, const double *q, kt_wrench *joints,
                        kt_wrench *loops);

/* Evaluates kt_reaction_evaluate, and writes the kinematics of the motion to links. */
KT_CHECKED kt_status kt_motion_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                        kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops,
                                        kt_error *error);

/* Checks that a caller's wrenches are finite. Planar recursions read only the components in the plane, and would not
 * detect others. */
kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error);

#endif
