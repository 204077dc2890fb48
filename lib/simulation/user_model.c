/* The coordinates, forces and reactions of the user model in the absolute formulation.
 *
 * `seen` is the tree's state at the current time. It is written after each step from that of the step before, so that
 * angles count whole turns; a checkpoint contains it in addition to the free state.
 */
#include "reduction/evaluate.h"
#include "simulation/absolute.h"
#include "simulation/simulation.h"

#include <string.h>

const double *kt_simulation_positions(const kt_simulation *simulation) {
    return kt_simulation_is_absolute(simulation) ? simulation->seen : kt_integrator_state(simulation->integrator);
}

const double *kt_simulation_velocities(const kt_simulation *simulation) {
    return kt_simulation_positions(simulation) + simulation->size.user_nq;
}

void kt_simulation_inputs(kt_simulation *simulation, const double *q, const double **tau, const kt_wrench **external) {
    if (!kt_simulation_is_absolute(simulation) || (*tau == NULL && *external == NULL))
        return;
    kt_absolute_wrenches(simulation->face, q, *tau, *external, simulation->pushed);
    *tau = NULL;
    *external = simulation->pushed;
}

void kt_simulation_sync(kt_simulation *simulation, double ago) {
    if (!kt_simulation_is_absolute(simulation))
        return;
    double *q = simulation->seen, *v = q + simulation->size.user_nq;
    const double *y = kt_integrator_state(simulation->integrator);
    kt_absolute_past past = {q, v, ago};
    kt_absolute_gather(simulation->face, y, y + simulation->size.nq, NULL, &past, q, v, NULL);
}

void kt_simulation_export(kt_simulation *simulation, double t, const double *y, const double *a, const double **q,
                          const double **v, const double **exported_a) {
    const kt_simulation_sizes *size = &simulation->size;
    *q = y;
    *v = y + size->nq;
    *exported_a = a;
    if (!kt_simulation_is_absolute(simulation))
        return;
    double *to = simulation->shown;
    kt_absolute_past past = {simulation->seen, simulation->seen + size->user_nq,
                             t - kt_integrator_time(simulation->integrator)};
    kt_absolute_gather(simulation->face, y, y + size->nq, a, &past, to, to + size->user_nq,
                       to + size->user_nq + size->user_nv);
    *q = to;
    *v = to + size->user_nq;
    *exported_a = a != NULL ? to + size->user_nq + size->user_nv : NULL;
}

kt_status kt_simulation_import_state(kt_simulation *simulation, double t, const double *q, const double *v, double *y,
                                     kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    kt_status status = kt_kinematics_update(simulation->face, simulation->user_data, q, v, NULL, error);
    if (status != KT_OK)
        return status;
    kt_absolute_spread(simulation->face, simulation->user_data, q, v, y, y + size->nq);
    return kt_state_project(simulation->model, simulation->data, t, y, y + size->nq, NULL, error);
}

kt_status kt_simulation_react(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    const double *q = y, *v = y + simulation->size.nq, *tau = simulation->tau;
    const kt_wrench *external = simulation->external;
    kt_data *data = simulation->data;
    kt_simulation_inputs(simulation, q, &tau, &external);
    const bool absolute = kt_simulation_is_absolute(simulation);
    kt_wrench *joints = absolute ? NULL : simulation->reaction;
    kt_wrench *loops = absolute ? simulation->free_reaction : simulation->loop_reaction;
    kt_status status = simulation->cached == KT_CACHED_EVALUATION
                           ? kt_motion_complete(simulation->model, data, t, q, v, tau, external, simulation->a,
                                                data->kinematics, joints, loops, error)
                           : kt_motion_evaluate(simulation->model, data, t, q, v, tau, external, data->kinematics,
                                                joints, loops, error);
    if (status == KT_OK) /* the tree's loops come first among those of the absolute formulation */
        status = kt_multipliers_take(simulation->model, data, t, simulation->multiplier, error);
    if (status == KT_OK && absolute)
        kt_absolute_reactions(simulation->face, q, simulation->tau, simulation->free_reaction, simulation->reaction,
                              simulation->loop_reaction);
    return status;
}
