/* A simulation of the absolute formulation, seen in the coordinates of the tree.
 *
 * The simulation is that of an ordinary model, so that it knows nothing of the tree. After each step of a run the
 * tree's state follows from the free bodies and from the tree's previous state, so that angles count whole turns. A
 * record between two steps follows from the free bodies at its time and the tree's state after the step.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/arena.h"
#include "base/copy.h"
#include "base/options.h"
#include "base/require.h"
#include "compare/absolute.h"
#include "compare/accuracy.h"

#include "kinetree/loop.h"

#include <math.h>
#include <string.h>

/* Arrays: type, name, count, meaning. */
#define KT_ABSOLUTE_MOTION_FIELDS(X)                                                                                   \
    X(double, q, tree->n.q, "positions of the tree at `time`")                                                         \
    X(double, v, tree->n.v, "velocities")                                                                              \
    X(double, shown_q, tree->n.q, "of a record")                                                                       \
    X(double, shown_v, tree->n.v, "likewise")                                                                          \
    X(double, shown_a, tree->n.v, "likewise")                                                                          \
    X(kt_wrench, joint, tree->n.body, "reactions of a record")                                                         \
    X(kt_wrench, loop, tree->n.loop, "likewise")                                                                       \
    X(double, free_q, model->n.q, "scratch: a state of the absolute model")                                            \
    X(double, free_v, model->n.v, "its velocities, or accelerations")

struct kt_absolute_motion {
    const kt_absolute *absolute;
    kt_simulation *simulation;
    kt_data *data; /* of the tree */
    double time;   /* s, of q and v */
    kt_recorder *record;
    void *user;
    kt_progress_callback *progress;        /* the caller's, which comes after every progress_steps steps */
    uint64_t progress_steps, progress_due; /* progress_due: steps until the next call */
    void *progress_user;
    KT_ARENA_DECLARE(KT_ABSOLUTE_MOTION_FIELDS)
};

KT_ARENA_LAYOUT(lay_out, kt_absolute_motion, KT_ABSOLUTE_MOTION_FIELDS, const kt_model *tree, const kt_model *model)

/* ---- the present state ------------------------------------------------------------------------------------------- */

/* Brings q and v to the present time. The previous q and v select the number of whole turns. */
static void follow_simulation(kt_absolute_motion *motion) {
    const kt_simulation *simulation = motion->simulation;
    const double t = kt_simulation_time(simulation);
    if (t == motion->time)
        return;
    kt_absolute_to_tree(motion->absolute, kt_simulation_positions(simulation), kt_simulation_velocities(simulation),
                        NULL, t - motion->time, motion->q, motion->v, NULL);
    motion->time = t;
}

const double *kt_absolute_motion_positions(kt_absolute_motion *motion) {
    if (motion != NULL)
        follow_simulation(motion);
    return motion != NULL ? motion->q : NULL;
}

const double *kt_absolute_motion_velocities(kt_absolute_motion *motion) {
    if (motion != NULL)
        follow_simulation(motion);
    return motion != NULL ? motion->v : NULL;
}

kt_simulation *kt_absolute_motion_simulation(const kt_absolute_motion *motion) {
    return motion != NULL ? motion->simulation : NULL;
}

/* Converts a free state at the time t to `shown`. */
static void show_state(kt_absolute_motion *motion, double t, const double *q, const double *v, const double *a) {
    const kt_model *tree = motion->absolute->tree;
    kt_copy(motion->shown_q, motion->q, tree->n.q * sizeof *motion->q);
    kt_copy(motion->shown_v, motion->v, tree->n.v * sizeof *motion->v);
    kt_absolute_to_tree(motion->absolute, q, v, a, t - motion->time, motion->shown_q, motion->shown_v,
                        a != NULL ? motion->shown_a : NULL);
}

kt_status kt_absolute_motion_acceleration(kt_absolute_motion *motion, double *a, kt_error *error) {
    if (KT_IS_MISSING(error, motion, a))
        return KT_ERROR_ARGUMENT;
    const kt_simulation *simulation = motion->simulation;
    const kt_status status = kt_simulation_acceleration(motion->simulation, motion->free_v, error);
    if (status != KT_OK)
        return status;
    follow_simulation(motion);
    show_state(motion, motion->time, kt_simulation_positions(simulation), kt_simulation_velocities(simulation),
               motion->free_v);
    kt_copy(a, motion->shown_a, motion->absolute->tree->n.v * sizeof *a);
    return KT_OK;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

/* Runs after each step, so that no whole turn is missed; the caller's function runs less often. */
static int follow_step(const kt_simulation *simulation, void *user) {
    kt_absolute_motion *motion = user;
    follow_simulation(motion);
    if (motion->progress == NULL || --motion->progress_due > 0)
        return 0;
    motion->progress_due = motion->progress_steps;
    return motion->progress(simulation, motion->progress_user);
}

/* Gives the caller's recorder the record of the tree in place of the record of the free bodies. */
static int pass_on_record(const kt_record *record, void *user) {
    kt_absolute_motion *motion = user;
    kt_record shown = *record;
    show_state(motion, record->t, record->q, record->v, record->a);
    shown.model = motion->absolute->tree;
    shown.q = motion->shown_q;
    shown.v = motion->shown_v;
    shown.a = record->a != NULL ? motion->shown_a : NULL;
    if (record->reactions != NULL) {
        kt_absolute_reactions(motion->absolute, record->q, NULL, record->loop_reactions, motion->joint, motion->loop);
        shown.reactions = motion->joint;
        shown.loop_reactions = motion->loop;
    }
    if (record->data != NULL) {
        shown.data = motion->data;
        if (kt_kinematics_update(shown.model, motion->data, shown.q, shown.v, shown.a, NULL) != KT_OK)
            return -1;
    }
    return motion->record(&shown, motion->user);
}

kt_status kt_absolute_motion_run(kt_absolute_motion *motion, kt_recorder *record, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, motion, record))
        return KT_ERROR_ARGUMENT;
    follow_simulation(motion);
    motion->record = record;
    motion->user = user;
    return kt_simulation_run(motion->simulation, pass_on_record, motion, error);
}

/* ---- the beginning ----------------------------------------------------------------------------------------------- */

/* Restarts from the tree's state in `shown`, whose loops are closed. */
static kt_status restart_at_shown(kt_absolute_motion *motion, double t, kt_error *error) {
    const kt_model *tree = motion->absolute->tree;
    kt_status status = kt_kinematics_update(tree, motion->data, motion->shown_q, motion->shown_v, NULL, error);
    if (status != KT_OK)
        return status;
    kt_absolute_from_tree(motion->absolute, motion->data, motion->shown_q, motion->shown_v, motion->free_q,
                          motion->free_v);
    status = kt_simulation_set_state(motion->simulation, t, motion->free_q, motion->free_v, error);
    if (status != KT_OK)
        return status;
    kt_copy(motion->q, motion->shown_q, tree->n.q * sizeof *motion->q);
    kt_copy(motion->v, motion->shown_v, tree->n.v * sizeof *motion->v);
    motion->time = t;
    return KT_OK;
}

kt_status kt_absolute_motion_set_state(kt_absolute_motion *motion, double t, const double *q, const double *v,
                                       kt_error *error) {
    if (KT_IS_MISSING(error, motion, q))
        return KT_ERROR_ARGUMENT;
    const kt_model *tree = motion->absolute->tree;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    kt_move(motion->shown_q, q, tree->n.q * sizeof *q);
    kt_move(motion->shown_v, v != NULL ? v : tree->zero, tree->n.v * sizeof *q);
    const kt_status status = kt_state_project(tree, motion->data, t, motion->shown_q, motion->shown_v, NULL, error);
    return status == KT_OK ? restart_at_shown(motion, t, error) : status;
}

/* The quantities that the simulation records for these of the tree. The closure of the free bodies' loops is not
 * needed, and is recorded with positions and velocities. */
static unsigned free_records_of(const kt_model *tree, unsigned record) {
    const unsigned states = KT_RECORD_POSITION | KT_RECORD_VELOCITY;
    bool has_any = false;
    for (int i = 0; i < kt_loop_count(tree) && (record & states) != 0 && !has_any; i++)
        has_any = kt_loop_coordinates(tree, i).nq > 0;
    return (record & ~states) | KT_RECORD_STATE | (has_any ? KT_RECORD_CLOSURE : 0U);
}

static kt_status check_absolute_motion(const kt_model *tree, const kt_simulation_options *options, kt_error *error) {
    if (options->events > 0)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "formulation",
                            "events need the formulation 'tree'; take it, or leave events and 'until' out");
    if (kt_switch_count(tree) > 0 || kt_accuracy_has_contacts(tree))
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "formulation",
                            "hard contacts, and loops or effects that are switched, need the formulation 'tree'");
    return KT_OK;
}

/* Creates the simulation of a motion that is laid out, in the initial state of the tree. */
static kt_status begin_absolute_motion(kt_absolute_motion *motion, const kt_run *run,
                                       const kt_simulation_options *options, kt_error *error) {
    const kt_model *tree = motion->absolute->tree, *model = motion->absolute->model;
    kt_run own = run != NULL ? *run : kt_run_default();
    kt_simulation_options followed = *options;
    own.record = free_records_of(tree, kt_run_record(&own, tree) | options->record);
    followed.record = 0;
    followed.progress = follow_step;
    followed.progress_steps = options->progress == NULL || options->progress_steps > 0; /* 0 is rejected */
    followed.progress_user = motion;
    motion->progress = options->progress;
    motion->progress_steps = motion->progress_due = options->progress_steps;
    motion->progress_user = options->progress_user;
    kt_model_initial(tree, motion->shown_q, motion->shown_v);
    kt_status status = kt_data_create(tree, &motion->data, error);
    if (status == KT_OK)
        status = kt_state_assemble(tree, motion->data, 0.0, motion->shown_q, motion->shown_v, error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &own, &followed, &motion->simulation, error);
    return status == KT_OK ? restart_at_shown(motion, 0.0, error) : status;
}

kt_status kt_absolute_motion_create(const kt_absolute *absolute, const kt_run *run,
                                    const kt_simulation_options *options, kt_absolute_motion **motion,
                                    kt_error *error) {
    if (KT_IS_MISSING(error, absolute, motion))
        return KT_ERROR_ARGUMENT;
    kt_simulation_options own = kt_simulation_options_default();
    const kt_simulation_options *given = KT_OPTIONS(kt_simulation_options, steps_per_call, &own, options, error);
    if (given == NULL)
        return KT_ERROR_ARGUMENT;
    kt_status status = check_absolute_motion(absolute->tree, given, error);
    if (status != KT_OK)
        return status;
    const size_t size = lay_out(NULL, absolute->tree, absolute->model);
    kt_absolute_motion *made = kt_arena_allocate(size, "a motion in absolute coordinates", error);
    if (made == NULL)
        return KT_ERROR_MEMORY;
    memset(made, 0, size);
    (void)lay_out(made, absolute->tree, absolute->model);
    made->absolute = absolute;
    status = begin_absolute_motion(made, run, given, error);
    if (status == KT_OK)
        *motion = made;
    else
        kt_absolute_motion_free(made);
    return status;
}

void kt_absolute_motion_free(kt_absolute_motion *motion) {
    if (motion == NULL)
        return;
    kt_simulation_free(motion->simulation);
    kt_data_free(motion->data);
    kt_aligned_release(motion);
}
