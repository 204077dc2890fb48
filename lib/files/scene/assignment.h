/* Parameters that events set: {set: {k: "2*k"}}.
 *
 * Such a parameter, and each that follows from one, is an auxiliary state of its name, whose rate is 0. Formulas of
 * forces, rates, events and columns read it there, records show it and checkpoints hold it. Numbers that follow from it
 * are parameters of the model, which an event sets together with the state (kt_simulation_change). Any other use is
 * rejected when the scene is read.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_RESET_H
#define KT_SCENE_RESET_H

#include "base/pool.h"
#include "kinetree/expression.h"
#include "kinetree/model.h"
#include "kinetree/scene.h"
#include "scene/scene_reader.h"

/* ---- while a scene is read (vary.c) ------------------------------------------------------------------------------ */

/* Whether an event of the file sets anything, and whether it sets this name. */
bool kt_assignments_exist(const kt_reader *r);
bool kt_is_assigned(const kt_reader *r, const char *name);

/* After parameters are read: adds auxiliary states for those that events set. */
void kt_assignments_add_states(kt_reader *r, kt_description *description);

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* A number of a description that is a number of a model's parameter. */
typedef struct kt_assignment_target {
    kt_parameter parameter; /* `item` is the body, loop or effect of the description */
    int component;
} kt_assignment_target;

/* Finds the number at this address; false: no number that can be set. */
bool kt_assignment_target_of(const kt_description *description, const double *at, kt_assignment_target *target);

/* ---- of a scene that has been read (vary.c) ---------------------------------------------------------------------- */

/* The number of parameters of a scene, if events set any of them; else 0. */
int kt_assignments_parameters(const kt_scene *scene);

typedef struct kt_assigned_parameter {
    double value; /* as read */
    int state;    /* the parameter's auxiliary state, an index in the description; -1: events do not reach it */
    bool is_set;  /* set by an event; else it follows */
} kt_assigned_parameter;

kt_assigned_parameter kt_assignments_parameter(const kt_scene *scene, int k);

/* A number that follows. */
typedef struct kt_assigned_number {
    const kt_expression *expression; /* expression of parameters */
    int parameter;                   /* the parameter; -1: a number of the description, */
    kt_assignment_target target;     /* and its place in the description */
} kt_assigned_number;

/* The next number from the *k-th on, in the order in which they are evaluated; NULL: there is none. */
const kt_assigned_number *kt_assignments_next(const kt_scene *scene, size_t *k);

/* The next of the numbers of the description that follow from variables (kt_scene_options); and the present value of
 * the number *k - 1, after the call. */
const kt_assigned_number *kt_varied_next(const kt_scene *scene, size_t *k);
double kt_varied_value(const kt_scene *scene, size_t k);

/* A copy of an expression; NULL: out of memory. */
const kt_expression *kt_expression_keep(kt_pool *pool, const kt_expression *expression);

/* The present values of these variables, and their number. */
const double *kt_varied_values(const kt_scene *scene, size_t *count);

/* ---- in a simulation (assignment.c) ------------------------------------------------------------------------------ */

typedef struct kt_assignments kt_assignments;

/* Binds the numbers that follow to a model; *assignments is NULL if events set nothing. */
KT_CHECKED kt_status kt_assignments_create(kt_pool *pool, const kt_scene *scene, const kt_model *model,
                                           kt_assignments **assignments, kt_error *error);

/* Binds the numbers that follow from the variables of a scene, which must outlive *assignments. The two calls below
 * then set the numbers that the scene has after kt_scene_vary, and leave auxiliary states as they are. */
KT_CHECKED kt_status kt_assignments_create_varied(kt_pool *pool, const kt_scene *scene, const kt_model *model,
                                                  kt_assignments **assignments, kt_error *error);

/* The auxiliary states, to be changed by the caller before the next call: those of the simulation. */
double *kt_assignments_states(kt_assignments *assignments, const kt_simulation *simulation);

/* Sets all that follows from these states. */
KT_CHECKED kt_status kt_assignments_apply(kt_assignments *assignments, kt_simulation *simulation, kt_error *error);

/* Sets the model's parameters by the states that the simulation has, and leaves the simulation as it is. */
KT_CHECKED kt_status kt_assignments_sync(kt_assignments *assignments, const kt_simulation *simulation, kt_error *error);

/* Whether a name that an event sets is that of a velocity. */
bool kt_is_velocity_name(const char *name);

/* velocities: whether an event of the scene sets velocities; otherwise whether one sets parameters or auxiliary
 * states. */
bool kt_events_set(const kt_scene *scene, bool velocities);

/* Velocities that events set: {set: {velocity.arm: "-0.8*velocity.arm"}} (impulse.c). */

typedef struct kt_impulses kt_impulses;

/* Memory for a model and for `count` velocities at most; NULL if there is not enough. */
kt_impulses *kt_impulses_create(kt_pool *pool, const kt_model *model, int count);

/* Sets the velocities at[i] of the simulation to values[i]. The others become the velocities nearest to theirs with
 * which the loops stay closed. If loops, or the velocities before, do not permit a value, it is counted
 * (kt_impulses_missed). */
KT_CHECKED kt_status kt_impulses_apply(kt_impulses *impulses, kt_simulation *simulation, kt_data *data, const int *at,
                                       const double *values, int count, kt_error *error);

/* The values that could not be set: their count, and the first of them. */
kt_scene_missed kt_impulses_missed(const kt_impulses *impulses);

#endif
