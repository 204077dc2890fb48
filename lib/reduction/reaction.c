/* Reactions, only when they are asked for: A' lambda = M a + h - tau gives the loops' multipliers, these their wrenches
 * (react.c), and with them as external wrenches Newton-Euler on the bodies gives the joints' (dynamics/total.c).
 * Redundant loops share a reaction in infinitely many ways: dependent equations carry none. Towards a singular position
 * reactions may grow without bound, as the direction that is lost there can hold less and less; at the position itself
 * the equation that is lost carries none.
 *
 * Of loops in a plane the reactions are those in space, with what acts out of the plane: the spatial kernels are asked,
 * for which the planar ones' accelerations are as good as their own.
 */
#include "dynamics/kernel.h"
#include "reduction/evaluate.h"

#include <string.h>

kt_status kt_reaction_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                               const double *tau, const kt_wrench *external, kt_wrench *joints, kt_wrench *loops,
                               kt_error *error) {
    const size_t bodies = model->n.body;
    double *a = data->side + 2 * kt_lanes8(model->n.v);
    kt_wrench *on_bodies = data->loaded;
    bool crossed = false;
    kt_status status = external ? kt_wrenches_check(model, q, v, external, error) : KT_OK;
    if (status == KT_OK && model->n.effect)
        status = kt_effects_apply(model, data, t, q, v, &tau, &external, error);
    if (status != KT_OK)
        return status;
    if (external)
        memcpy(on_bodies, external, bodies * sizeof *on_bodies);
    else
        memset(on_bodies, 0, bodies * sizeof *on_bodies);
    status = model->n.group
                 ? kt_closed_forward(model, data, t, q, v, tau ? tau : model->zero, external, a, &crossed, error)
                 : kt_forward_trusted(model, data, q, v, tau, external, a, error);
    if (status == KT_OK && model->n.group) {
        const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
        if (crossed ||
            model->sweep != KT_SWEEP_SPATIAL) /* the equations are those of a position beside, or in a plane */
            (void)kernels->forward(model, data, t, q, v, tau ? tau : model->zero, external, false, data->scratch);
        kernels->multipliers(model, data, v, a);
        kernels->react(model, data, t, on_bodies, data->loop_wrench);
    }
    if (status == KT_OK)
        status = kt_kinematics_update(model, data, q, v, a, error);
    if (status != KT_OK)
        return status;
    if (loops)
        memcpy(loops, data->loop_wrench, model->n.loop * sizeof *loops);
    if (joints)
        kt_joint_reactions(model, data, on_bodies, joints);
    return KT_OK;
}
