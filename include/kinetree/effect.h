/* Effects of a caller's own, through the interface of the library's effects.
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
 * Derivatives serve kt_acceleration_derivatives, steps and their gradients, linear systems and implicit methods.
 * Derivatives are exact if the effect has a function for its derivatives. This is the function of the example:
 *
 *     static int pull_derivatives(void *user, double t, const kt_effect_end *ends,
 *                                 kt_effect_derivatives *derivatives) {
 *         const double k = *(const double *)user;
 *         (void)t, (void)ends;
 *         for (int i = 0; i < 2; i++)
 *             for (int j = 0; j < 2; j++)
 *                 derivatives->wrench[i][j].by_pose[1][1] = kt_mat3_scale(i == j ? -k : k, kt_mat3_identity());
 *         return 0;
 *     }
 *
 * and effect.wrench_derivatives = pull_derivatives, or effect.joint_force_derivatives in a joint. Without such a
 * function, the library computes differences. The error of the differences is reported by kt_data_difference_error.
 *
 * Laws. An effect of type expression may have a law in C in place of formulas. The law is a callback. It receives the
 * values of the variables that the effect lists by name. It writes the force and the rates of the auxiliary states that
 * the effect lists. The example is the coil of a motor:
 *
 *     static int motor(void *user, const double *u, double *force, double *rates) {
 *         const double k = 0.05, R = 0.8, L = 0.02;
 *         (void)user;
 *         if (force)
 *             force[0] = k * u[0];
 *         if (rates)
 *             rates[0] = (12.0 - R * u[0] - k * u[1]) / L;
 *         return 0;
 *     }
 *
 *     static int motor_derivatives(void *user, const double *u, double *force, double *rates) {
 *         const double k = 0.05, R = 0.8, L = 0.02;
 *         (void)user, (void)u;
 *         if (force)
 *             force[0] = k;
 *         if (rates) {
 *             rates[0] = -R / L;
 *             rates[1] = -k / L;
 *         }
 *         return 0;
 *     }
 *
 * and where the mechanism is described
 *
 *     kt_auxiliary_state current = kt_auxiliary_state_default();
 *     static const char *const variables[] = {"current", "velocity.rotor"}, *const names[] = {"current"};
 *     current.name = "current";
 *     description.states = &current;
 *     description.state_count = 1;
 *     kt_effect effect = kt_effect_default();
 *     effect.type = KT_EFFECT_EXPRESSION;
 *     effect.joint = "rotor";
 *     effect.law = motor;
 *     effect.law_derivatives = motor_derivatives;
 *     effect.variables = variables;
 *     effect.variable_count = 2;
 *     effect.states = names;
 *     effect.state_count = 1;
 *     description.effects = &effect;
 *     description.effect_count = 1;
 *
 * The law is computed, integrated, differentiated and recorded as formulas are. Without law_derivatives, its
 * derivatives are differences in each variable.
 *
 * A callback is a function of its arguments alone. The same arguments must give the same result, at any time and in any
 * order of calls. This includes calls from several threads if these share the model. A callback is called at every
 * stage of every step, also of steps that are not accepted. Compiling a model with joints that move no mass also calls
 * the callback. Return values: 0: done.
 *   > 0: the force cannot be computed in this state. An adaptive method tries a smaller step. With a fixed step, the
 *     step fails with KT_ERROR_EFFECT.
 *   < 0: stop. The step fails with KT_ERROR_CALLBACK.
 *
 * After a failure the state is the one before the step, and the error names the time and the effect. If the force of
 * any effect is not finite, the step fails in this way with KT_ERROR_NOT_FINITE. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_EFFECT_H
#define KINETREE_EFFECT_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An end in motion, world axes. In a caller's own effects, the point is relative to the world's origin. */
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

/* A point of the path of an effect (kt_effect.path), or a surface between two points around which the path leads. All
 * members except `end` are zero by default. The path has the shortest length, without friction. A point within a
 * surface has a straight line to the other point. The length and its gradient are continuous where the line touches the
 * surface.
 *
 * A surface with a side: the line is straight only if it passes the surface on this side, and bent around the surface
 * otherwise. The length jumps where such a line changes the side without touching the surface. */
struct kt_path_point {
    kt_end end;     /* the point; of a surface its centre, or a point of its axis */
    double radius;  /* of a surface, m; 0: a point */
    kt_vec3 axis;   /* of a cylinder without ends, in the end's frame; zero: a sphere */
    kt_vec3 side;   /* from the centre to the side of the path, in the end's frame; zero: the shorter way */
    bool inside;    /* the surface is a ring: the path leads through it, and touches it from within */
    double divisor; /* of a point: a new branch begins here, with its length divided by this. 0: the branch goes on */
};

/* The most bodies that a path may touch. */
enum { KT_PATH_LINK_MAX = 16 /* bodies */ };

/* ---- forces by numbers ------------------------------------------------------------------------------------------- */

/* The force of a muscle: an active part F w A(l) V(v) and a passive part F P(l), which both pull.
 *     F   `force`                       w   the control, or the activation
 *     l   the scaled length             v   its rate over `speed`
 * While gear L grows from lengths[0] to lengths[1], l grows from range[0] to range[1]. The curves A, V and P are those
 * of MuJoCo (documentation, modeling, section Muscles). */
typedef struct kt_muscle {
    double range[2];   /* scaled lengths; default 0.75, 1.05 */
    double lengths[2]; /* of gear L, rad or m */
    double force;      /* the largest at rest, N (m) */
    double shortest;   /* scaled length from which A is above 0; default 0.5 */
    double longest;    /* scaled length up to which A is above 0; default 1.6 */
    double speed;      /* speed of shortening at which V is 0, in scaled lengths a second; default 1.5 */
    double passive;    /* P at the scaled length `longest`; default 1.3 */
    double stretched;  /* the largest V, which fast stretching has; default 1.2 */
} kt_muscle;

/* An actuator (kt_effect.actuators). Its force along the length L is gear f, with f between lower and upper:
 *     f = w (gain[0] + gain[1] g L + gain[2] g L') + bias[0] + bias[1] g L + bias[2] g L',   g = gear.
 * L is the position of the effect's joint, the length of its path, or the sum of `terms`, as of a tendon that is fixed
 * to joints. Then the force in the joint has the factor of its term, and an effect of every joint lists the actuator.
 * w is `control` from the time `delay` on, and 0 before. With an activation, w is that auxiliary state instead, between
 * its bounds. With `active`, its force per w replaces the gain. The force of `passive` is added to the bias.
 *
 * If an effect on a point of a body lists the actuator, L is 0, and f acts with the six components of `wrench`. */
typedef struct kt_actuator {
    const char *name;     /* may be NULL */
    const char *tendon;   /* name of the tendon of `terms`; NULL: none. Actuators of one tendon, and those of one path,
                             may have a bounded sum */
    const kt_term *terms; /* L = sum of coefficients times positions of joints; NULL: L is that of the effect */
    int term_count;       /* length of terms */
    double gear;          /* default 1 */
    double gain[3];       /* default 1, 0, 0 */
    double bias[3];       /* default 0 */
    double control;       /* between control_lower and control_upper; default 0 */
    double control_lower, control_upper;       /* default: infinite, which means none; likewise below */
    double delay;                              /* s; default 0 */
    const char *activation;                    /* name of an auxiliary state; NULL: none */
    double activation_lower, activation_upper; /* of the activation */
    double lower, upper;                       /* of f */
    double sum_lower, sum_upper;       /* of the sum of f of all actuators of the tendon or path, none of which has an
                                          activation or a muscle. With zero between the bounds, a factor scales each f.
                                          Otherwise all have one gear, and no bounds of their own */
    const kt_muscle *active, *passive; /* NULL: none */
    double wrench[6];                  /* on a point: force, and moment, along the axes of the effect's frame */
} kt_actuator;

/* Returns an actuator with its defaults; likewise below. */
KT_API kt_actuator kt_actuator_default(void);
KT_API kt_muscle kt_muscle_default(void);

/* The laws of an activation w by the control u, which is 0 before a delay. X(id, name in scene files) */
#define KT_ACTIVATION_LIST(X)                                                                                          \
    X(KT_ACTIVATION_FILTER, filter)         /* w' = (u - w) / times[0] */                                              \
    X(KT_ACTIVATION_INTEGRATOR, integrator) /* w' = u */                                                               \
    X(KT_ACTIVATION_MUSCLE, muscle)         /* w' = (u - w) / T; times[3]: rise, fall, and a smooth change of T */

/* Types of activations. */
typedef enum kt_activation_type {
#define KT_ACTIVATION_ENUM(id, name) id,
    KT_ACTIVATION_LIST(KT_ACTIVATION_ENUM)
#undef KT_ACTIVATION_ENUM
        KT_ACTIVATION_TYPE_COUNT /* how many */
} kt_activation_type;

/* The numbers of an activation (kt_auxiliary_state.activation). */
typedef struct kt_activation {
    kt_activation_type type;             /* its law */
    double control;                      /* as of an actuator */
    double control_lower, control_upper; /* likewise */
    double delay;                        /* s; likewise */
    double times[3];                     /* s; of a filter the first, of a muscle all; default 0 */
} kt_activation;

/* Returns an activation with its defaults. */
KT_API kt_activation kt_activation_default(void);

/* A spring and a damper by polynomials (kt_effect.spring). L is the length of the effect's path, or of the line between
 * its ends. In a joint of position q, L = factor q. The number x is the distance of L from the range `rest`. The force
 * along L is
 *     -(k[0] x + k[1] x^2 + k[2] x^3) - (c[0] L' + c[1] |L'| L' + c[2] L'^3) - friction tanh(L' / smoothing).
 * The force in a joint is `factor` times as large. */
typedef struct kt_polynomial_spring {
    double factor;       /* in a joint; default 1 */
    double stiffness[3]; /* k; default 0 */
    double damping[3];   /* c; default 0 */
    double rest[2];      /* lengths between which the spring has no force; default 0 */
    double friction;     /* along a path or line, N; default 0 */
    double smoothing;    /* m/s; default 1e-3 */
    bool beyond;         /* along a path or line: the damper acts only outside of `rest`, as that of a stop */
} kt_polynomial_spring;

/* Returns a spring with its defaults. */
KT_API kt_polynomial_spring kt_polynomial_spring_default(void);

/* Derivatives of a wrench with respect to the motion of an end. Row 0 of each array is the moment, row 1 the force, in
 * world axes. The moment is about the point of the wrench's own end, which may move. */
typedef struct kt_wrench_derivatives {
    kt_mat3 by_pose[2]
                   [2]; /* by a rotation of the end's axes (rad, about world axes), and a displacement of its point */
    kt_mat3 by_twist[2][2]; /* by the angular velocity of the end, and the velocity of its point */
} kt_wrench_derivatives;

/* The derivatives of an effect with ends. If there is one end, only the first element of each
 * array is read. */
struct kt_effect_derivatives {
    kt_wrench_derivatives wrench[2][2]; /* [i][j]: of wrenches[i] by the motion of ends[j] */
    kt_wrench by_time[2];               /* of wrenches[i], while the ends rest: per second */
};

#ifdef __cplusplus
}
#endif
#endif
