/* Derivatives of the wrench and of the joint force of an effect by dual numbers, from the effect's own code. Dual
 * numbers serve types without derivatives in closed form (effect/effect.h), and check those in closed form. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/dual_effect.h"

#include "constraint/relative_coordinate.h"

/* The quantities of the last end that are changed, in the order of kt_effect_jacobian. */
enum { ROTATION, DISPLACEMENT, OMEGA, VELOCITY, CHANGES };

/* An end, as dual numbers along a change (none: CHANGES) in the direction e. */
static kt_effect_frame dual_frame_of(const kt_effect_end *end, int changed, kt_v4 e) {
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

/* How wrenches depend on their ends, which a change moves: in dual numbers. */
typedef struct dependence {
    const kt_effect_record *effect;
    const double *numbers;
    double t;
    kt_relative_turns counted;  /* of an effect in a loop, */
    const kt_loop_record *loop; /* this loop, and */
    const double *force;        /* its force, and the derivatives of that by the coordinate and its rate */
} dependence;

static kt_loop_end loop_end_of(const kt_effect_frame *frame) {
    return (kt_loop_end){.axes = {frame->axes.x, frame->axes.y, frame->axes.z},
                         .point = frame->point,
                         .omega = frame->omega,
                         .velocity = frame->velocity,
                         .alpha = kt_vector_zero(),
                         .linear = kt_vector_zero()};
}

/* Returns the wrench on the last end, of an effect in a loop: Q = Q_0 + Q_c dc + Q_c' dc'. */
static kt_effect_wrench wrench_in_loop(const dependence *on, const kt_effect_frame frames[2]) {
    const kt_loop_end end[2] = {loop_end_of(&frames[0]), loop_end_of(&frames[1])};
    const kt_relative_coordinate c = kt_relative_coordinate_of(&on->effect->relative, on->counted, on->loop, end);
    const kt_real force = kt_dual_make(on->force[0], on->force[1] * kt_derivative_of(c.position) +
                                                         on->force[2] * kt_derivative_of(c.rate));
    return (kt_effect_wrench){.moment = kt_scale(force, c.moment), .force = kt_scale(force, c.force)};
}

static kt_effect_wrench wrench_on_last(const dependence *on, const kt_effect_frame frames[2]) {
    const kt_effect_record *effect = on->effect;
    kt_effect_wrench wrench[2];
    if (on->force)
        return wrench_in_loop(on, frames);
    kt_effect_kind_of(effect->type)->wrench(effect, on->numbers, frames, on->t, wrench, NULL);
    return wrench[effect->ends - 1];
}

/* Writes one column of all matrices, from the derivatives of the wrenches. */
static void store_column(kt_effect_wrench wrench, int changed, int k, kt_effect_jacobian *jacobian) {
    kt_mat3(*matrix)[2] = changed < OMEGA ? jacobian->stiffness : jacobian->damping;
    const kt_vec3 moment = kt_v4_vec3(kt_vector_derivative(wrench.moment));
    const kt_vec3 force = kt_v4_vec3(kt_vector_derivative(wrench.force));
    kt_mat3 *by[2] = {&matrix[0][changed % 2], &matrix[1][changed % 2]};
    *(k == 0 ? &by[0]->x : k == 1 ? &by[0]->y : &by[0]->z) = moment;
    *(k == 0 ? &by[1]->x : k == 1 ? &by[1]->y : &by[1]->z) = force;
    jacobian->moment = kt_v4_vec3(kt_vector_value(wrench.moment));
    jacobian->force = kt_v4_vec3(kt_vector_value(wrench.force));
}

/* The matrices column by column: one evaluation with dual numbers for each direction of each change. */
static void differentiate_effect(const dependence *on, const kt_effect_end *end, kt_effect_jacobian *jacobian) {
    const int last = on->effect->ends - 1;
    *jacobian = (kt_effect_jacobian){.at_point = false};
    for (int changed = 0; changed < CHANGES; changed++)
        for (int k = 0; k < 3; k++) {
            kt_v4 e = kt_v4_splat(0.0);
            e[k] = 1.0;
            kt_effect_frame frames[2];
            for (int i = 0; i <= last; i++)
                frames[i] = dual_frame_of(&end[i], i == last ? changed : CHANGES, e);
            store_column(wrench_on_last(on, frames), changed, k, jacobian);
        }
}

void kt_dual_effect_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian) {
    const dependence on = {.effect = effect, .numbers = numbers, .t = t};
    differentiate_effect(&on, end, jacobian);
}

void kt_dual_relative_jacobian(const kt_effect_record *effect, const kt_loop_record *loop, const double counted[2],
                               const double force[3], const kt_effect_end *end, kt_effect_jacobian *jacobian) {
    const dependence on = {.effect = effect, .counted = {counted[0], counted[1]}, .loop = loop, .force = force};
    differentiate_effect(&on, end, jacobian);
}

void kt_dual_joint_derivatives(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                               double derivative[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    for (int k = 0; k < 2; k++)
        derivative[k] = kt_derivative_of(kind->joint_force(effect, numbers, kt_dual_make(q, k ? 0.0 : 1.0),
                                                           kt_dual_make(v, k ? 1.0 : 0.0), t, NULL));
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

void kt_dual_path_jacobians(const kt_path_point_record *points, int count, const kt_effect_end *frame, int links,
                            int moved, const double force[3], kt_effect_jacobian *jacobian) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_effect_frame frames[KT_PATH_LINK_MAX];
    kt_path_value path;
    for (int i = 0; i < links; i++) {
        frames[i] = dual_frame_of(&frame[i], CHANGES, none);
        jacobian[i] = (kt_effect_jacobian){.at_point = false};
    }
    for (int changed = 0; changed < CHANGES; changed++)
        for (int k = 0; k < 3; k++) {
            kt_v4 e = none;
            e[k] = 1.0;
            frames[moved] = dual_frame_of(&frame[moved], changed, e);
            kt_path_evaluate_dual(points, count, frames, links, &path);
            const kt_real f = kt_dual_make(force[0], force[1] * kt_derivative_of(path.length) +
                                                         force[2] * kt_derivative_of(path.rate));
            for (int i = 0; i < links; i++) {
                const kt_effect_wrench *unit = &path.unit[i];
                const kt_effect_wrench wrench = {.moment = kt_scale(f, unit->moment),
                                                 .force = kt_scale(f, unit->force)};
                store_column(wrench, changed, k, &jacobian[i]);
            }
        }
}
