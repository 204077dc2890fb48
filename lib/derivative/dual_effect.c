/* Derivatives of the wrench and of the joint force of an effect by dual numbers, of its own code: for types that have
 * none in closed form (effect/effect.h), and to hold these against. */
#include "derivative/dual_effect.h"

/* What is changed of the last end, in the order of kt_effect_jacobian. */
enum { ROTATION, DISPLACEMENT, OMEGA, VELOCITY, CHANGES };

/* An end, as dual numbers along a change (none: CHANGES) in the direction e. */
static kt_effect_frame frame_of(const kt_effect_end *end, int changed, kt_v4 e) {
    const kt_v4 none = kt_v4_splat(0.0), rotation = changed == ROTATION ? e : none;
    kt_v4 axes[3];
    kt_v4_from_mat3(end->axes, axes);
    return (kt_effect_frame){
        .axes = {kt_vector_of(axes[0], kt_v4_cross(rotation, axes[0])),
                 kt_vector_of(axes[1], kt_v4_cross(rotation, axes[1])),
                 kt_vector_of(axes[2], kt_v4_cross(rotation, axes[2]))},
        .point = kt_vector_of(kt_v4_from(end->point), changed == DISPLACEMENT ? e : none),
        .omega = kt_vector_of(kt_v4_from(end->omega), changed == OMEGA ? e : none),
        .velocity = kt_vector_of(kt_v4_from(end->velocity), changed == VELOCITY ? e : none),
    };
}

void kt_dual_effect_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian) {
    const int last = effect->ends - 1;
    *jacobian = (kt_effect_jacobian){.at_point = false};
    for (int changed = 0; changed < CHANGES; changed++) {
        kt_vec3 moment[3], force[3];
        for (int k = 0; k < 3; k++) {
            kt_v4 e = kt_v4_splat(0.0);
            e[k] = 1.0;
            kt_effect_frame frames[2];
            kt_effect_wrench wrench[2];
            for (int i = 0; i <= last; i++)
                frames[i] = frame_of(&end[i], i == last ? changed : CHANGES, e);
            kt_effect_kind_of(effect->type)->wrench(effect, numbers, frames, t, wrench, NULL);
            moment[k] = kt_v4_vec3(kt_vector_derivative(wrench[last].moment));
            force[k] = kt_v4_vec3(kt_vector_derivative(wrench[last].force));
            jacobian->moment = kt_v4_vec3(kt_vector_value(wrench[last].moment));
            jacobian->force = kt_v4_vec3(kt_vector_value(wrench[last].force));
        }
        kt_mat3(*matrix)[2] = changed < OMEGA ? jacobian->stiffness : jacobian->damping;
        matrix[0][changed % 2] = (kt_mat3){moment[0], moment[1], moment[2]};
        matrix[1][changed % 2] = (kt_mat3){force[0], force[1], force[2]};
    }
}

void kt_dual_joint_derivatives(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                               double derivative[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    for (int k = 0; k < 2; k++)
        derivative[k] = kt_derivative_of(kind->joint_force(effect, numbers, kt_dual_make(q, k ? 0.0 : 1.0),
                                                           kt_dual_make(v, k ? 1.0 : 0.0), t, NULL));
}
