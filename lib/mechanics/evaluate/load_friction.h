/* Friction of joints that is proportional to a reaction (load_friction.c, load_forward.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EVALUATE_LOAD_FRICTION_H
#define KT_EVALUATE_LOAD_FRICTION_H

#include "evaluate/evaluate.h"

/* If friction comes from loads, replaces model->forward of a model whose effects are attached (load_forward.c). */
void kt_load_attach(kt_model *model);

/* The part of friction that comes from the load of the last reactions in the data, at a motion in this direction, 1 or
 * -1. Not negative; 0 for an effect without a load. */
double kt_load_friction_find(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                             double direction);

/* Friction number k; the model has model->n.loaded of them. */
const kt_effect_record *kt_loaded_effect(const kt_model *model, size_t k);
/* The friction k of a load in a direction of motion. gradient: by the load; or NULL. */
double kt_load_law(const kt_model *model, const kt_effect_record *e, const double load[3], double direction,
                   double gradient[3]);
/* The sign s of an effect: 0 if it exerts no force. And ds/dv, by the rate of its joint. */
double kt_load_sign(const kt_model *model, const kt_data *data, const kt_effect_record *e, const double *v);
double kt_load_sign_slope(const kt_model *model, const kt_data *data, const kt_effect_record *e, const double *v);

/* Computes the accelerations under the joint forces `at` and the friction in data->load_friction, and the loads in
 * data->load. */
KT_CHECKED kt_status kt_loads_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                       kt_error *error);

/* Solves data->load_matrix (column-major) for data->load_residual, which becomes the solution.
 * Errors: KT_ERROR_SINGULAR if a friction jams. */
KT_CHECKED kt_status kt_loads_solve(const kt_model *model, kt_data *data, const kt_dynamic_state *at, kt_error *error);

/* Takes the loads from reactions: from wrenches of joints (n.body), and data->loop_wrench. links: the kinematics of
 * these. */
void kt_loads_take(const kt_model *model, kt_data *data, const kt_link_kinematics *links, const kt_wrench *joints);

/* The power that this friction dissipated in the last evaluation. */
double kt_load_power(const kt_model *model, const kt_data *data, const double *v);

/* The friction of an effect in the last evaluation. NAN: the last evaluation was one of another state. */
double kt_load_friction_of(const kt_model *model, const kt_data *data, const double *q, const double *v,
                           const kt_effect_record *effect);

/* Rejects a model with such friction with KT_ERROR_UNSUPPORTED at `where`. `what`: what the caller can do instead. */
KT_INNER KT_CHECKED kt_status kt_load_reject(const kt_model *model, const char *where, const char *what,
                                             kt_error *error);

#endif
