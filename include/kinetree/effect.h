/* Effects of a caller's own, through the interface that the library's effects have.
 *
 *     static double stiffness = 40.0;
 *
 *     static int pull(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
 *                     kt_effect_balance *balance) {
 *         const double k = *(const double *)user;
 *         const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point);
 *         (void)t;
 *         wrenches[0].force = kt_vec3_scale(k, d);
 *         wrenches[1].force = kt_vec3_scale(-k, d);
 *         if (balance)
 *             balance->energy = 0.5 * k * kt_vec3_dot(d, d);
 *         return 0;
 *     }
 *
 * and where the mechanism is described
 *
 *     kt_effect effect = kt_effect_default();
 *     effect.type = KT_EFFECT_CUSTOM;
 *     effect.between[0].body = "anchor";
 *     effect.between[1].body = "boat";
 *     effect.end_count = 2;
 *     effect.wrench = pull;
 *     effect.user = &stiffness;
 *     description.effects = &effect;
 *     description.effect_count = 1;
 *
 * or, in a scalar joint, effect.joint and effect.joint_force. Scene files have no such effects.
 *
 * A callback is a function of its arguments alone: the same arguments must give the same result, at any time and in any
 * order of calls, and from several threads if these share the model. It is called at every stage of every step, also of
 * steps that are not accepted. It returns
 *   0: done;
 *   > 0: the force cannot be computed in this state: an adaptive method tries a smaller step, with a fixed one the step
 *     fails with KT_ERROR_EFFECT;
 *   < 0: stop: the step fails with KT_ERROR_CALLBACK.
 * After a failure the state is what it was before the step, and the error names the time and the effect. The same
 * holds, with KT_ERROR_NOT_FINITE, if the force of any effect is not finite.
 */
#ifndef KINETREE_EFFECT_H
#define KINETREE_EFFECT_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An end in motion, world axes. In a caller's effects the point is relative to the world's origin. */
struct kt_effect_end {
    kt_mat3 axes;     /* of the end's frame */
    kt_vec3 point;    /* its origin, m */
    kt_vec3 omega;    /* angular velocity, rad/s */
    kt_vec3 velocity; /* of the point, m/s */
};

/* The parts of the power P of an effect: P = supplied - dissipated - d(energy)/dt. */
struct kt_effect_balance {
    double energy;     /* potential energy, J */
    double dissipated; /* power turned into heat, W */
    double supplied;   /* power that comes from outside, W */
};

#ifdef __cplusplus
}
#endif
#endif
