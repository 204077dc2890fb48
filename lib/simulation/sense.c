/* The present state, for sensors: a record of now, made of what the last step has left and what the next one needs.
 *
 * After a step the integrator may know f(t, y) (the last stage of a method with fsal); if not, it is evaluated now, as
 * the first stage of the next step, which finds it there. The data then hold what that evaluation went through, from
 * which kinematics and reactions follow; or they hold the poses that the projection ended with.
 */
#include "simulation/simulation.h"

#include <string.h>

/* The accelerations of the present state in `a`. */
static kt_status find_acceleration(kt_simulation *simulation, kt_error *from) {
    const double *slope;
    kt_status status = kt_simulation_inputs_commit(simulation, from);
    if (status == KT_OK)
        status = kt_integrator_derivative(simulation->integrator, &slope, from);
    if (status != KT_OK)
        return status;
    if (simulation->slope != slope && simulation->held == KT_CACHED_EVALUATION)
        simulation->held = KT_CACHED_NOTHING; /* another evaluation came after that one */
    memcpy(simulation->a, slope + simulation->size.nq, simulation->size.nv * sizeof(double));
    return KT_OK;
}

/* The same where records within the last step are yet to be handed over: these need the integrator as it is. */
static kt_status find_acceleration_aside(kt_simulation *simulation, kt_error *from) {
    const double t = kt_integrator_time(simulation->integrator);
    simulation->tau = simulation->memory.next.torque ? simulation->torque_next : NULL;
    simulation->external = simulation->memory.next.wrenches ? simulation->wrench_next : NULL;
    return kt_simulation_accelerate(simulation, t, simulation->y, simulation->tau, simulation->external, simulation->a,
                                    from) == 0
               ? KT_OK
               : from->code;
}

static kt_status sense(kt_simulation *simulation, kt_record *record, kt_error *from) {
    const bool accelerates = (simulation->record & KT_RECORD_ACCELERATION) != 0;
    kt_status status = KT_OK;
    memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    if (accelerates || (simulation->record & KT_RECORD_REACTIONS) != 0)
        status = kt_simulation_owes_records(simulation) ? find_acceleration_aside(simulation, from)
                                                        : find_acceleration(simulation, from);
    else if (simulation->held == KT_CACHED_EVALUATION)
        simulation->held = KT_CACHED_NOTHING; /* of some stage of the last step */
    if (status == KT_OK)
        status = kt_simulation_report(simulation, accelerates, record, from);
    kt_simulation_inputs_use(simulation);
    simulation->held = status == KT_OK && simulation->kinematics ? KT_CACHED_POSES : KT_CACHED_NOTHING;
    return status;
}

kt_status kt_simulation_sense(kt_simulation *simulation, kt_record *record, kt_error *error) {
    kt_record now = kt_record_empty(-1, kt_integrator_time(simulation->integrator));
    kt_error from = {0};
    simulation->cause.code = KT_OK;
    const kt_status status = sense(simulation, &now, &from);
    if (status != KT_OK) {
        if (simulation->cause.code == KT_OK)
            simulation->cause = from; /* which names the body */
        return kt_simulation_fail(simulation, &from, error);
    }
    *record = now;
    return KT_OK;
}
