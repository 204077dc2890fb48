/* Accelerations of mechanisms with loops and effects. */
#ifndef KT_MECHANISM_EVALUATE_H
#define KT_MECHANISM_EVALUATE_H

#include "closure/project.h"
#include "effect/effect.h"
#include "kinetree/mechanism.h"

/* kt_acceleration_evaluate without a check of its pointers: all but tau, external and error are given. */
KT_CHECKED kt_status kt_acceleration_trusted(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                             double *a, kt_error *error);

/* The same of kt_state_project; `changed` may be NULL. */
KT_CHECKED kt_status kt_state_project_trusted(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                              bool *changed, kt_error *error);

/* Scales quaternions to unit norm; those within rounding of it keep their bits (repeated division would let them
 * drift). Returns false if one is zero or not finite. */
bool kt_unit_quaternions(const kt_model *model, double *q);

/* Assembles the initial state into q and v; leaves them untouched if that fails. */
void kt_assemble_initial(const kt_model *model, kt_data *data, double *q, double *v);

/* Adds the forces of the effects to at->tau and at->external: afterwards these point to sums in data if there was
 * something to add. Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK, each naming the effect and the
 * time. */
KT_CHECKED kt_status kt_effects_apply(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_error *error);

/* Does the same, and adds the derivatives of the forces by time (per second), of effects that all have them
 * (kt_effect_is_differenced). */
KT_CHECKED kt_status kt_effects_apply_rising(const kt_model *model, kt_data *data, kt_dynamic_state *at,
                                             kt_error *error);

/* Writes da/dt at fixed q and v, from a = kt_acceleration_evaluate at this state, of a model without driven loops and
 * whose effects all have derivatives. Exact: a is linear in the forces, whose derivatives are, and so
 *     da/dt = a(tau + dtau/dt) - a(tau) */
KT_CHECKED kt_status kt_acceleration_time_derivative(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                                     const double *a, double *da_dt, kt_error *error);

/* Adds the forces of a caller's own effects without derivatives alone. */
KT_CHECKED kt_status kt_effects_apply_differenced(const kt_model *model, kt_data *data, kt_dynamic_state *at,
                                                  kt_error *error);

/* The error of a callback that did not give derivatives: its code, or 0 where they are not finite. */
kt_status kt_effect_refuse_derivatives(const kt_model *model, const kt_effect_record *effect, double t, int code,
                                       kt_error *error);

/* Does the same for all effects, and sums their powers. */
KT_CHECKED kt_status kt_effects_account(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_power *power,
                                        kt_error *error);

/* The record of an effect by its index in the description; NULL: there is none. */
const kt_effect_record *kt_effect_record_find(const kt_model *model, int source);

/* What an effect exerts, as kt_effect_evaluate, and the motion of its ends, in a state that has been checked before:
 * whether it is finite and, for effects with ends, whether data hold its kinematics. Returns the code of a callback,
 * otherwise 0. */
KT_CHECKED kt_status kt_effect_state_check(const kt_model *model, const kt_data *data, const double *q, const double *v,
                                           bool has_ends, kt_error *error);
/* The motion of the ends, by the kinematics of the last update. */
void kt_effect_ends_find(const kt_data *data, const kt_effect_record *effect, kt_effect_end end[2]);
int kt_effect_load_find(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                        const kt_effect_record *effect, kt_effect_end end[2], kt_effect_load *load);

/* Points at->tau and at->external at the sums that kt_effects_apply left in data, if there was something to add. */
void kt_effects_recall(const kt_model *model, const kt_data *data, kt_dynamic_state *at);

/* Writes the partial derivatives by time of the rates of own states (kt_own_state_count). Returns the code of a law's
 * callback, otherwise 0. */
int kt_own_state_time_derivatives(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                  double *derivatives);

#if KT_HAS_QUASI_STATICS
/* kt_massless_balance of a state that is finite, of a model with such coordinates: the state is written to
 * data->balanced_q and balanced_v. */
KT_CHECKED kt_status kt_massless_solve(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                       kt_error *error);
#endif

/* kt_own_state_rates of a state that is finite; rates are written in any case. */
KT_CHECKED kt_status kt_own_state_rates_trusted(const kt_model *model, kt_data *data, double t, const double *q,
                                                const double *v, double *rates, kt_error *error);

/* Refuses a model with own states with KT_ERROR_UNSUPPORTED at `where`, for a calculation that does not know them. `what`
 * completes "the model has own states, and": what it would leave out, and what to do instead. */
KT_INNER KT_CHECKED kt_status kt_own_states_refuse(const kt_model *model, const char *where, const char *what,
                                                   kt_error *error);

/* kt_acceleration_evaluate for a model with loops, without effects; data->interpolated says whether a was interpolated
 * from neighbouring states near a singular position. */
kt_forward_call kt_closed_forward;

#if KT_HAS_SWITCHES
/* kt_acceleration_evaluate for a model in which hard contacts slip, without effects (slip.c); marks one more of these in a
 * model that is being compiled; the power that friction dissipated in the last evaluation. */
kt_forward_call kt_slip_forward;
void kt_slip_add(kt_model *model);
double kt_slip_power(const kt_model *model, const kt_data *data);
/* Lets the directions data->slip follow slip that has turned away from them, in the state q, v. Returns whether any did. */
bool kt_slip_follow(const kt_model *model, kt_data *data, const double *q, const double *v);
/* Refuses a model in which hard contacts slip, for derivatives: these would leave the friction out. */
KT_CHECKED kt_status kt_slip_refuse(const kt_model *model, const char *where, kt_error *error);

/* Writes the multipliers of the equations of loops under all that acts, at->tau and at->external, to the groups' data, and
 * wrenches of the loops; data hold the equations of the last evaluation of a. data->loaded: all wrenches on bodies. */
void kt_multipliers_find(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a);
#else
static inline kt_status kt_slip_refuse(const kt_model *model, const char *where, kt_error *error) {
    (void)model, (void)where, (void)error;
    return KT_OK;
}
#endif

/* Completes the last evaluation of accelerations, a = kt_acceleration_evaluate at this state, from what it left in data:
 * writes the kinematics of the motion to links, and the reactions to joints and loops (unless both are
 * NULL). Only what an interpolation near a singular position or the planar recursion does not leave in data is computed
 * again. The bits are those of kt_kinematics_update with a and of kt_reaction_evaluate. */
KT_CHECKED kt_status kt_motion_complete(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                        const double *a, kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops,
                                        kt_error *error);

/* Writes the multipliers that the last kt_motion_complete with reactions left in data, in the form of
 * kt_multiplier_evaluate. */
KT_CHECKED kt_status kt_multipliers_take(const kt_model *model, const kt_data *data, double t, double *multipliers,
                                         kt_error *error);

/* Does the same as kt_reaction_evaluate, and writes the kinematics of the motion to links. */
KT_CHECKED kt_status kt_motion_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                        kt_link_kinematics *links, kt_wrench *joints, kt_wrench *loops,
                                        kt_error *error);

/* Checks that the wrenches that a caller gives are finite: planar recursions read only the components in the plane, and
 * would not notice. */
kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error);

#endif
