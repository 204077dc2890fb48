/* A mechanism in plain structs: bodies (body.h), loops, effects, and functions of time (function.h).
 *
 * Initialise every struct with its _default() call, and then set the members that differ.
 *
 * Units: SI and radians.
 * Ownership: names, lists and numbers remain the caller's. After kt_model_compile the description may be released. Only
 * kt_description_check and kt_function_evaluate allocate memory.
 *
 * The names of types and keys are those of scene files (types.md).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_DESCRIPTION_H
#define KINETREE_DESCRIPTION_H

#include "kinetree/algebra.h"
#include "kinetree/body.h"
#include "kinetree/function.h"

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- loops and effects ------------------------------------------------------------------------------------------- */

/* A frame on a body: the frame of a marker, or a frame at `at` along the axes of the body. The member `rotation` turns
 * the end's frame relative to this frame. */
typedef struct kt_end {
    const char *body;     /* NULL or "world": the world */
    const char *marker;   /* NULL: `at` counts */
    kt_vec3 at;           /* body frame, m */
    kt_rotation rotation; /* of the end's frame relative to the marker's, or to the body's if there is no marker */
} kt_end;

/* Types of loops. X(type, name in scene files) */
#define KT_LOOP_LIST(X)                                                                                                \
    X(KT_LOOP_SPHERICAL, spherical)     /* 3 equations: the two points coincide */                                     \
    X(KT_LOOP_INLINE, inline)           /* 2: the second point stays on the line along axis */                         \
    X(KT_LOOP_INPLANE, inplane)         /* 1: the second point stays in the plane normal to axis */                    \
    X(KT_LOOP_DISTANCE, distance)       /* 1: the points keep a distance */                                            \
    X(KT_LOOP_PARALLEL, parallel)       /* 3: equal orientation */                                                     \
    X(KT_LOOP_COAXIAL, coaxial)         /* 2: axis of both ends parallel */                                            \
    X(KT_LOOP_ORTHOGONAL, orthogonal)   /* 1: axis normal to axis2 */                                                  \
    X(KT_LOOP_REVOLUTE, revolute)       /* 5: free to rotate about axis */                                             \
    X(KT_LOOP_PRISMATIC, prismatic)     /* 5: free to move along axis */                                               \
    X(KT_LOOP_SCREW, screw)             /* 5: free to rotate and move by pitch */                                      \
    X(KT_LOOP_CYLINDRICAL, cylindrical) /* 4: free to rotate about and move along axis */                              \
    X(KT_LOOP_PLANAR, planar)           /* 3: free in the plane normal to axis */                                      \
    X(KT_LOOP_WELD, weld)               /* 6: one rigid part */                                                        \
    X(KT_LOOP_UNIVERSAL, universal)     /* 4: Cardan joint */                                                          \
    X(KT_LOOP_COUPLING, coupling)       /* 1: terms (+ formula) = offset: gears, cams */                               \
    X(KT_LOOP_MOTION, motion)           /* 1: a joint's position is a function of time */                              \
    X(KT_LOOP_ROLLING, rolling)         /* 2 of velocities, and 1 if holonomic */                                      \
    X(KT_LOOP_KNIFE_EDGE, knife_edge)   /* 1 of velocities: none along axis */                                         \
    X(KT_LOOP_RATES, rates)             /* 1 of velocities: terms = function */                                        \
    X(KT_LOOP_HOMOKINETIC, homokinetic) /* 4: constant-velocity joint */                                               \
    X(KT_LOOP_SURFACE, surface)         /* 1: the second point stays on a surface */                                   \
    X(KT_LOOP_CURVE, curve)             /* 2: on a curve, and 1 if its arc length is given */                          \
    X(KT_LOOP_GEAR, gear)               /* 1: two toothed wheels mesh */                                               \
    X(KT_LOOP_RACK, rack)               /* 1: a toothed wheel meshes with a rack */                                    \
    X(KT_LOOP_WORM, worm)               /* 1: a worm meshes with a wheel */                                            \
    X(KT_LOOP_SPAN, span)               /* 1: a rope runs from one pulley to another */                                \
    X(KT_LOOP_BELT, belt)               /* 2: a belt around two pulleys */

/* Types of constraints between two ends, or between joints. */
typedef enum kt_loop_type {
#define KT_LOOP_ENUM(id, name) id,
    KT_LOOP_LIST(KT_LOOP_ENUM)
#undef KT_LOOP_ENUM
        KT_LOOP_TYPE_COUNT, /* how many in scene files */
    KT_LOOP_CUSTOM = 1000   /* a caller's own (loop.h); not in scene files */
} kt_loop_type;

typedef struct kt_loop_motion kt_loop_motion;
typedef struct kt_loop_equation kt_loop_equation;

/* Computes the equations of a caller's own loop from the motion of the second end relative to the first. On entry the
 * outputs are zeros. See loop.h for the structs, an example, and the meaning of the returned number. */
typedef int kt_loop_callback(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equations);

/* The outputs of the callback of a caller's own loop. Differences replace the missing derivatives. */
typedef enum kt_loop_given {
    KT_LOOP_GIVES_RESIDUAL = 0 /* residuals alone */,
    KT_LOOP_GIVES_ROWS /* residuals, moments, forces and rates */,
    KT_LOOP_GIVES_ALL /* all of kt_loop_equation */
} kt_loop_given;

/* Types of surfaces. X(type, name in scene files) */
#define KT_SURFACE_LIST(X)                                                                                             \
    X(KT_SURFACE_NONE, none)         /* not given */                                                                   \
    X(KT_SURFACE_PLANE, plane)       /* normal to the axis */                                                          \
    X(KT_SURFACE_CYLINDER, cylinder) /* about the axis */                                                              \
    X(KT_SURFACE_SPHERE, sphere)     /* about the first end's point */                                                 \
    X(KT_SURFACE_TORUS, torus)       /* about the axis */

/* The surfaces on which a loop can keep a point. */
typedef enum kt_surface_type {
#define KT_SURFACE_ENUM(id, name) id,
    KT_SURFACE_LIST(KT_SURFACE_ENUM)
#undef KT_SURFACE_ENUM
        KT_SURFACE_TYPE_COUNT /* how many */
} kt_surface_type;

/* A surface in the frame of a loop's first end. Only the members of its type are used. */
typedef struct kt_surface {
    kt_surface_type type; /* default: none */
    double radius;        /* cylinder, sphere; torus: of the circle in the middle of its tube, m */
    double tube;          /* torus: radius of the tube, m */
} kt_surface;

/* Types of curves in space. X(type, name in scene files) */
#define KT_TRACK_LIST(X)                                                                                               \
    X(KT_TRACK_NONE, none)     /* not given */                                                                         \
    X(KT_TRACK_LINE, line)     /* along the axis */                                                                    \
    X(KT_TRACK_CIRCLE, circle) /* about the axis */                                                                    \
    X(KT_TRACK_HELIX, helix)   /* about the axis */                                                                    \
    X(KT_TRACK_SPLINE, spline) /* through points */

/* The curves on which a loop can keep a point. */
typedef enum kt_track_type {
#define KT_TRACK_ENUM(id, name) id,
    KT_TRACK_LIST(KT_TRACK_ENUM)
#undef KT_TRACK_ENUM
        KT_TRACK_TYPE_COUNT /* how many */
} kt_track_type;

/* A curve in the frame of a loop's first end. Only the members of its type are used. The arc length begins at the first
 * end's point (line), at the x axis (circle, helix), or at the first point (spline). The arc length of a helix is 0 in
 * the plane through the first end's point. */
typedef struct kt_track {
    kt_track_type type;    /* default: none */
    double radius;         /* circle, helix, m */
    double pitch;          /* helix: advance along the axis, m per radian; not 0 */
    const kt_vec3 *points; /* spline, m: the caller's. The curve is the natural cubic spline through the points, with
                              the sum of their distances as its parameter. Beyond its ends the spline continues as
                              straight lines */
    int point_count;       /* spline: two or more, each apart from the one before */
} kt_track;

/* One term of a coupling: coefficient * position of a scalar joint. One term of rates: coefficient * rate of the
 * joint. */
typedef struct kt_term {
    const char *joint;  /* of one coordinate */
    double coefficient; /* of its position, rad or m, or of its rate */
} kt_term;

/* Whether a loop or an effect always acts, or may be switched on and off while a program runs (model.h). For a loop
 * that bounds a side, and for friction that sticks, KT_SWITCHED_OFF means that the item is released at first
 * (kt_simulation_set_released). */
typedef enum kt_switching {
    KT_ALWAYS_ON = 0,   /* cannot be switched */
    KT_SWITCHED_ON,     /* may be switched; on at first */
    KT_SWITCHED_OFF,    /* may be switched; off at first */
    KT_NEVER_ON,        /* a loop without equations: effects may act in its coordinates, as of a span that is elastic */
    KT_SWITCHING_COUNT, /* the number of values */
} kt_switching;

/* The largest number of loops and effects that may be switched. Hard contacts, stops and slack ropes do not count
 * towards this number. */
enum { KT_SWITCH_MAX = 10 /* loops and effects */ };

/* Whether the equation of a loop holds, or bounds one side alone: a stop, a floor, a rope. A side needs a loop with one
 * equation that has a residual phi: distance, inplane, surface or coupling. A closed bound exerts the force that
 * prevents the motion from crossing the bound, and never pulls. A restitution according to Newton or Poisson describes
 * impacts (`restitution`, `poisson`). Simulations close and open the loop (kt_simulation_contacts); in a model without
 * a simulation, the loop is open. */
typedef enum kt_side {
    KT_SIDE_NONE = 0, /* phi = 0 holds: an equation */
    KT_SIDE_ABOVE,    /* phi >= 0 */
    KT_SIDE_BELOW,    /* phi <= 0 */
    KT_SIDE_COUNT,    /* the number of values */
} kt_side;

/* A constraint that the tree cannot represent. Only the members of its type are used. */
typedef struct kt_loop {
    const char *name;     /* letters, digits, '_' and '-', as for a body; unique among the loops */
    kt_loop_type type;    /* kt_loop_type lists the equations of each type */
    kt_end between[2];    /* rolling: the wheel's centre, and the surface on which it rolls */
    kt_vec3 axis;         /* in both ends' frames. For rolling: the wheel's axle, in the wheel's frame. For knife_edge:
                             the direction without velocity, in the second end's frame */
    kt_vec3 axis2;        /* orthogonal, universal: in the second end's frame; rolling: the surface's normal */
    double pitch;         /* screw, m per radian */
    double radius;        /* rolling, m; gear, rack, worm, span, belt: see below */
    bool holonomic;       /* rolling: the contact (wheel touches the surface) is a third equation; default true */
    kt_function function; /* distance: the length (not given: the distance in the given positions, before loops are
                             closed). For motion: the joint's position. For rates: the sum of the terms (not given: 0).
                             For curve: the arc length (not given: free) */
    kt_surface surface;   /* surface: on which the second point stays */
    kt_track curve;       /* curve: on which the second point stays */
    const char *joint;    /* motion: the driven joint */
    const kt_term *terms; /* coupling: sum of terms (+ formula) = offset; rates: sum of terms, of rates, = function */
    int term_count;       /* coupling, rates: length of terms */
    double offset;        /* coupling: the sum of the terms and the formula */
    const char *formula;  /* coupling: a formula as that of a force (expression.h), which is added to the terms; NULL
                             (default): none. Its variables are position.NAME for the joints NAME of the terms; their
                             coefficients may be 0. At most KT_FORMULA_VARIABLE_MAX terms */

    kt_loop_callback *equations; /* custom */
    int equation_count;          /* custom: 1 to 6. All of them are holonomic, or none (`holonomic`) */
    kt_loop_given given;         /* custom: the outputs of the callback; default: residuals */
    bool driven;                 /* custom: the equations depend on time */
    void *user;                  /* custom: an argument of the callback; must outlive the model */

    bool coordinates;       /* revolute, prismatic, screw, cylindrical, planar, universal, spherical: records have its
                               positions and velocities, as those of a joint (kt_loop_coordinates); default: false */
    kt_switching switching; /* whether it may be switched on and off while a program runs; default: always on */
    bool slack;             /* distance, span: a rope, which only pulls (KT_SIDE_BELOW) */
    kt_side side;           /* the side that it bounds; default: none, an equation */
    double restitution;     /* of a loop that bounds a side: 0, plastic (default), to 1, elastic */
    double rest_velocity;   /* likewise: slower impacts do not bounce, m/s or rad/s; default 1e-6 */
    bool poisson;           /* likewise: restitution is a ratio of impulses of expansion and compression (Poisson's
                               rule), not of speeds (Newton's rule); default: false */

    /* Wheels and ropes. `radius` is the pitch radius of the first wheel, or the radius of the first pulley. */
    kt_vec3 second_axis;   /* gear, worm, span, belt: axis in the second end's frame; default: as `axis`. For rack: the
                              direction of the pitch line in the second end's frame */
    double radius2;        /* gear: of the second wheel; 0, the default: from the teeth. A negative radius is that of a
                              ring. For span and belt: of the second pulley. A radius of a span is positive if the rope
                              passes the centre on the left, looking along the rope with the axis towards the viewer; 0:
                              the rope is tied to the point */
    double teeth, teeth2;  /* gear: whole numbers, negative for a ring; 0, the default: from the radii. For worm: starts
                              of the worm, negative for left-handed threads, and teeth of the wheel */
    double module;         /* gear: of the normal section, m; 0, the default: from the distance of the axes */
    double pressure_angle; /* gear, rack, worm: of the normal section, rad; default: 20 degrees */
    double helix_angle;    /* gear: at the pitch circle, rad; positive: right-handed teeth on the first wheel */
    double tension;        /* span, belt: of the rope at rest, N, in addition to what the multipliers give */
    bool crossed;          /* belt: its spans cross, so that the pulleys turn in opposite senses */
} kt_loop;

/* Types of effects. X(type, name in scene files) */
#define KT_EFFECT_PLAIN_LIST(X)                                                                                        \
    X(KT_EFFECT_SPRING, spring)                 /* between two points, with damping */                                 \
    X(KT_EFFECT_JOINT_SPRING, joint_spring)     /* in a joint, with damping */                                         \
    X(KT_EFFECT_JOINT_DAMPER, joint_damper)     /* in a joint */                                                       \
    X(KT_EFFECT_JOINT_FRICTION, joint_friction) /* in a joint, with Stribeck's curve */                                \
    X(KT_EFFECT_JOINT_LIMIT, joint_limit)       /* elastic stops of a joint */                                         \
    X(KT_EFFECT_BUSHING, bushing)               /* six stiffnesses between two frames */                               \
    X(KT_EFFECT_MOTOR, motor)                   /* a function of time in a joint */                                    \
    X(KT_EFFECT_SERVO, servo)                   /* towards a target in a joint, limited */                             \
    X(KT_EFFECT_FORCE, force)                   /* on a point */                                                       \
    X(KT_EFFECT_TORQUE, torque)                 /* on a body */                                                        \
    X(KT_EFFECT_DRAG, drag)                     /* against the velocity of a point */                                  \
    X(KT_EFFECT_ATTRACTION, attraction)         /* by inverse squares */                                               \
    X(KT_EFFECT_CONTACT, contact)               /* a sphere and a half-space */
#define KT_EFFECT_LIST(X)                                                                                              \
    KT_EFFECT_PLAIN_LIST(X)                                                                                            \
    X(KT_EFFECT_EXPRESSION, expression) /* formulas in text */                                                         \
    X(KT_EFFECT_THRUST, thrust)         /* of mass that leaves or arrives */

/* Types of force elements; kt_effect has the formulas. */
typedef enum kt_effect_type {
#define KT_EFFECT_ENUM(id, name) id,
    KT_EFFECT_LIST(KT_EFFECT_ENUM)
#undef KT_EFFECT_ENUM
        KT_EFFECT_TYPE_COUNT, /* how many in scene files */
    KT_EFFECT_CUSTOM = 1000   /* a caller's own (effect.h); not in scene files */
} kt_effect_type;

typedef struct kt_effect_end kt_effect_end;
typedef struct kt_effect_balance kt_effect_balance;
typedef struct kt_path_point kt_path_point;
typedef struct kt_effect_derivatives kt_effect_derivatives;

/* Computes a caller's own effect. The first form writes a wrench at each end of the effect: the moment is about the
 * end's point, along world axes. The second form writes the force in a joint of one coordinate with position q and
 * velocity v. On entry the outputs are zeros; `balance` may be NULL. See effect.h for the structs, an example, and the
 * meaning of the returned number. */
typedef int kt_effect_wrench_callback(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
                                      kt_effect_balance *balance);
typedef int kt_effect_joint_force_callback(void *user, double t, double q, double v, double *force,
                                           kt_effect_balance *balance);

/* Computes the derivatives of a caller's own effect. The first form differentiates the wrenches with respect to the
 * motion of the ends and to time (effect.h). The second form differentiates the joint force with respect to q, v and
 * t, in this order. On entry the derivatives are zeros. The returned number has the same meaning as above. Without
 * this callback, differences replace the derivatives. Differences are coarse if the force changes fast
 * (kt_data_difference_error). */
typedef int kt_effect_wrench_derivatives_callback(void *user, double t, const kt_effect_end *ends,
                                                  kt_effect_derivatives *derivatives);
typedef int kt_effect_joint_force_derivatives_callback(void *user, double t, double q, double v, double derivatives[3]);

/* Computes a law in C, in place of the formulas of an effect of type expression. The array u has the values of its
 * variables, in their order. The first function writes the force and the rates of the states that the law lists. In a
 * joint, the force is one number; on a body, six numbers, force and moment. Either output may be NULL; on entry the
 * others are zeros. The second function writes the derivatives of the same outputs, which are likewise zeros on entry.
 * The derivative of force number i, or of rate i, by u[j] has the index i * variable_count + j. The returned numbers
 * have the same meaning as above. */
typedef int kt_effect_law_callback(void *user, const double *u, double *force, double *rates);
typedef int kt_effect_law_derivatives_callback(void *user, const double *u, double *force, double *rates);

/* The largest number of states of a law. */
enum { KT_LAW_STATE_MAX = 16 /* states of one effect */ };

/* Returns the next breakpoint of a caller's own force: the first time after t at which the force, or a derivative of
 * the force, jumps. Times at which the force begins or ceases to act are breakpoints, too. If no breakpoint follows,
 * returns HUGE_VAL or any time that is not after t. Steps of adaptive methods end at a breakpoint, and the force is
 * evaluated just before and just after that time. As for the force, the result depends on the arguments alone. */
typedef double kt_breakpoint_callback(void *user, double t);

/* The axes of the components of a force or torque. The axes of an end are the axes of its body or marker (kt_end). */
typedef enum kt_frame { KT_FRAME_WORLD = 0 /* the world's */, KT_FRAME_BODY /* the end's */ } kt_frame;

/* A force element. Only the members of its type are used. See types.md for the corresponding keys of scene files.
 *   "spring": pulls its ends together with stiffness (distance - length) + damping (rate of the distance).
 *   "joint_spring": -stiffness (q - rest(t)) - damping v in a joint.
 *   "joint_damper": -damping v in a joint.
 *   "joint_friction": -(coulomb + (breakaway - coulomb) exp(-(v / stribeck)^2)) tanh(v / smoothing) - viscous v. With
 *     `stick` the sign of v replaces tanh, and friction at rest is a constraint. `friction` and `efficiency` add a part
 *     that grows with a reaction to coulomb (lib/mechanics/evaluate/load_friction.c).
 *   "joint_limit": no force between lower and upper. Beyond them, stiffness times the excess acts back, and a damping
 *     that grows from zero with the excess. Therefore the force is continuous and never pulls back. With a restitution,
 * the effect is a pair of hard stops.
 *   "bushing": -stiffnesses times displacement and rotation (Euler vector) of the second frame, and -dampings times
 *     their rates. Forces and moments act along and about the first end's axes. The ends must differ by less than half
 * a turn.
 *   "motor": torque(t) in a joint.
 *   "force": value(t) on a point.
 *   "torque": value(t) on a body.
 *   "servo": stiffness (target(t) - q) + damping (target'(t) - v) in a joint. A smooth bound limits the torque to
 * `limit`, and a sharp bound limits it to [lower, upper].
 *   "thrust": d(mass)/dt (t) times exhaust. The mass leaves or arrives with the velocity `exhaust` relative to the
 *     body, along the end's axes (kt_variable_mass).
 *   "drag": -(linear + quadratic |v|) v on a point. Besides, -(dampings + quadratics |s|) s for each of six speeds s.
 *     The velocity along an axis of the end has a force against it. The angular velocity about this axis has a moment
 *     against it.
 *   "attraction": strength / distance^2 pulls two points together.
 *   "contact": a sphere, and the half-space under a plane. The rim of a thin disc may replace the sphere. At a depth x
 *     the normal force is stiffness x^exponent (1 + 3/2 dissipation x'), but never below zero. Friction, with its
 *     coefficient times the normal force, acts against the slip at the lowest point. Rolling and torsional friction are
 *     moments of an arm times the normal force, against the relative angular velocity. Source: Hunt and Crossley 1975.
 *   "expression": forces by formulas (expression.h) of variables (kt_variable), a law in C, or numbers (effect.h).
 *
 * An expression acts in one of three ways.
 *   In a joint: formula[0].
 *   Between two ends, along their line or a path: formula[0], which pushes the ends apart if positive. The
 *     formula may use `length` and `speed`, the distance of the ends or the length of the path, and its rate.
 *   On a point of a body: the force has the first three formulas, and the moment has the other three. Both are along
 *     the axes of `frame`.
 * All work of an expression counts as supplied. An expression has at most KT_FORMULA_VARIABLE_MAX different variables.
 * A law in C (effect.h) lists its variables by name, and the auxiliary states with rates that it writes. A law with
 * states can use markers at its ends, but neither `length` and `speed` nor the coordinate of a loop.
 *
 * All forces are continuous, for the integrator's error control; hard effects and friction with `stick` are constraints
 * instead. Friction is a smooth function of the speed over `smoothing` or `slip`. A load below the friction force
 * therefore creeps instead of resting. Smaller values of these two need smaller steps.
 *
 * Joint effects act in one coordinate, along which the force does its work: that of a joint, or a relative coordinate
 * of a loop. The member `joint` is the name of the joint or loop. If there are several coordinates, NAME[k] is the k-th
 * of them. For joints the order is that of kt_joint, without spherical and free joints. For loops the coordinates are:
 *   "revolute", "screw", "coaxial": angle.
 *   "prismatic", "inline": length.
 *   "cylindrical": angle, length.
 *   "planar": x, y, angle.
 *   "inplane": x, y.
 *   "universal": angle about axis, angle about axis2.
 * Angles and lengths are those of the second end's frame relative to the first's; both are 0 if the frames coincide. In
 * the given positions an angle lies within half a turn. From this position on, the angle counts whole turns if all
 * links between the ends rotate about parallel axes, and in a screw. Otherwise the angle is the value nearest to the
 * angle in the given positions. A force that depends on such an angle would jump half a turn away from the given
 * position, so that the motion must not go beyond. If a joint and a loop have the same name, the joint is used.
 *
 * Units: "N (m)" below means N m, or N if the coordinate is a length. */
typedef struct kt_effect {
    const char *name;    /* may be NULL */
    kt_effect_type type; /* selects the members that are used */
    kt_end between[2];   /* force, torque, thrust, drag: the first one is where the effect acts; contact: the sphere's
                            centre, and a frame in the plane */
    const char *joint;   /* joint_*, motor, servo, expression, custom with joint_force: the coordinate, see above */

    double stiffness;      /* spring N/m; joint_spring, joint_limit, servo N (m) per rad or m; contact N/m^exponent */
    double damping;        /* spring N s/m; joint_spring, joint_damper, joint_limit, servo N (m) s per rad or m */
    double length;         /* spring: rest length, m */
    bool initial_length;   /* spring: `length` is ignored. The rest length is the distance at the start, after loops
                              have been closed (in the given positions if they cannot be closed) */
    kt_function rest;      /* joint_spring: position without force, rad or m; default 0 */
    double coulomb;        /* joint_friction: in motion, N (m) */
    double viscous;        /* joint_friction: N (m) s per rad or m */
    double breakaway;      /* joint_friction: at rest, N (m); not below coulomb; default (0): as coulomb */
    double stribeck;       /* joint_friction: speed over which breakaway falls to coulomb, rad/s or m/s; default 0.01 */
    double smoothing;      /* joint_friction: speed over which the force changes sign; default 1e-3 */
    double efficiency;     /* joint_friction: part of the power that the loop `load` passes on; default 1 */
    const char *load;      /* joint_friction: the loop whose force causes the friction; NULL: the joint's reaction */
    double lower, upper;   /* joint_limit: rad or m, at least one is needed; servo, actuators of an expression: hard
                              bounds of the force or its sum, N (m). Default: infinite, which means none */
    double stiffnesses[6]; /* bushing: x, y, z in N/m, about x, y, z in N m/rad; default 0 */
    double dampings[6];    /* bushing, drag: N s/m, N m s/rad; default 0 */
    double quadratics[6];  /* drag: N s^2/m^2, N m s^2/rad^2; default 0 */
    kt_function torque;    /* motor: N (m) */
    kt_function target;    /* servo: rad or m */
    double limit;          /* servo: largest force, N (m); default: infinite, which means none */
    kt_function value[3];  /* force, torque: components, N or N m */
    kt_frame frame;        /* force, torque, expression on a body: the axes of the components: the world's, or the
                              end's */
    kt_function mass;      /* thrust: of the body, kg; only its rate counts */
    kt_vec3 exhaust;       /* thrust: velocity of the leaving or arriving mass relative to the end, its axes, m/s */
    double linear;         /* drag: N s/m */
    double quadratic;      /* drag: N s^2/m^2 */
    double strength;       /* attraction: N m^2; negative: repulsion */

    kt_vec3 axis;       /* contact: the plane's normal in the second end's frame, out of the half-space; default z */
    double radius;      /* contact: of the sphere or disc, m; default 0, a point. joint_friction: the arm of `friction`
                           in a joint that turns, m */
    kt_vec3 axle;       /* contact: the axis of a thin disc in the first end's frame. The rim of the disc then replaces
                           the sphere. Default 0: a sphere */
    double radius2;     /* hard contact: of a sphere about the second end, in place of the plane, m; default 0: a plane.
                           Spheres with friction need time stepping (KT_CONTACT_STEPS) */
    double exponent;    /* contact: 1 or more; default 1.5, Hertz's */
    double dissipation; /* contact: s/m; after an impact at a slow v the speed is v - dissipation v^2; default 0 */
    double friction;    /* contact: coefficient; default 0. Friction of a hard contact (restitution) sticks.
                           joint_friction: likewise, of the joint's reaction or of the force of `load` */
    double slip;        /* elastic contact: slip speed over which friction builds up, m/s; default 1e-3 */
    double rolling;     /* elastic contact: the arm of rolling friction, m; default 0 */
    double torsion;     /* elastic contact: the arm of friction against a spin about the normal, m; default 0 */
    double turn;        /* elastic contact: angular velocity over which both build up, rad/s; default 1e-2 */

    const char *formula[6];                      /* expression: force, moment; NULL: that component is zero */
    kt_effect_wrench_callback *wrench;           /* custom: acts at `end_count` ends, or is NULL */
    int end_count;                               /* custom: one or two; expression: none in a joint, one on a body, two
                                                    between ends */
    kt_effect_joint_force_callback *joint_force; /* custom: acts in `joint`, in place of `wrench` */

    kt_effect_wrench_derivatives_callback *wrench_derivatives;           /* custom: of `wrench`; NULL: differences */
    kt_effect_joint_force_derivatives_callback *joint_force_derivatives; /* custom: of `joint_force`; NULL: likewise */
    kt_effect_law_callback *law;                                         /* expression: replaces formulas; NULL:
                                                                            formulas */
    kt_effect_law_derivatives_callback *law_derivatives;                 /* of the law; NULL: differences */

    const char *const *variables; /* law: the names of its variables, each once, in the form of kt_variable_find */
    int variable_count;           /* length of variables */
    const char *const *states;    /* law: names of auxiliary states of the description that have no formula */
    int state_count;              /* length of states, at most KT_LAW_STATE_MAX */
    kt_breakpoint_callback *breakpoint; /* custom, law: the breakpoints of its force; NULL: none */
    void *user;                         /* custom, law: an argument of the callback; must outlive the model */

    kt_switching switching; /* as in kt_loop */
    bool stick;             /* joint_friction: the friction sticks. At rest it is a constraint, until its force exceeds
                               breakaway (or coulomb). The joint then slips, and the friction has the sign of the speed,
                               not smoothed. Default: false */
    double restitution;     /* joint_limit, contact: the effect is hard, and an impact returns this part of the speed, 0
                               to 1. Default: infinite, which means an elastic effect. Hard ones are loops that bound a
                               side (kt_loop.side), with the name of the effect, or of its joint or body */
    double rest_velocity;   /* likewise: slower impacts do not bounce, m/s or rad/s; default 1e-6 */
    bool poisson;           /* likewise: as in kt_loop */

    const kt_path_point *path; /* expression: acts along a path (effect.h) in place of `between`; NULL: it does not */
    int path_count;            /* length of path; its first and last point are the ends */
    const struct kt_actuator *actuators;       /* expression: numbers (effect.h) in place of formulas; NULL: none */
    int actuator_count;                        /* length of actuators */
    const struct kt_polynomial_spring *spring; /* expression: likewise; NULL: none */
} kt_effect;

/* ---- auxiliary states -------------------------------------------------------------------------------------------- */

/* An auxiliary state, which is neither a position nor a velocity: a current, a pressure, the integral of a controller.
 * The integrator advances the state with the motion. The rate is a formula (expression.h) of variables (kt_variable).
 * Alternatively a law in C (kt_effect.states) writes the rate, even while its effect is switched off. */
typedef struct kt_auxiliary_state {
    const char *name; /* letters, digits and _, as for names in formulas; the only state of its name */
    double initial;   /* at the start; default 0 */
    const char *rate; /* a formula x' = rate(t, q, v, x); NULL: the law of an effect, or `activation`, writes it */
    const struct kt_activation *activation; /* numbers (effect.h) in place of the formula; NULL: none */
} kt_auxiliary_state;

/* ---- the description --------------------------------------------------------------------------------------------- */

/* Inertia checks. X(id, name in scene files) */
#define KT_INERTIA_LIMIT_LIST(X)                                                                                       \
    X(KT_INERTIA_STRICT, strict) /* no more than rounding */                                                           \
    X(KT_INERTIA_WARN, warn)     /* up to KT_INERTIA_EXCESS_MAX */                                                     \
    X(KT_INERTIA_ACCEPT, accept) /* any, even negative moments; inertias of coordinates may then be zero or negative */

/* How far inertias may violate the triangle inequality of principal moments. Rounded CAD data violate this inequality
 * slightly. */
typedef enum kt_inertia_limit {
#define KT_INERTIA_LIMIT_ENUM(id, name) id,
    KT_INERTIA_LIMIT_LIST(KT_INERTIA_LIMIT_ENUM)
#undef KT_INERTIA_LIMIT_ENUM
        KT_INERTIA_LIMIT_COUNT /* how many */
} kt_inertia_limit;

/* The largest kt_inertia_excess that KT_INERTIA_WARN accepts. */
#define KT_INERTIA_EXCESS_MAX 0.01

/* A mechanism.
 * Ownership: the caller owns all data to which the description points, and may release the data once the model is
 * compiled. */
typedef struct kt_description {
    const char *name;               /* free text; may be NULL */
    kt_vec3 gravity;                /* m/s^2, world frame */
    const kt_body *bodies;          /* in any order, without the world */
    int body_count;                 /* length of bodies */
    const kt_loop *loops;           /* constraints that the tree cannot represent */
    int loop_count;                 /* length of loops */
    const kt_effect *effects;       /* all forces besides gravity */
    int effect_count;               /* length of effects */
    const char *const *hold;        /* joints whose given position and velocity the assembly keeps. If none of a
                                       position is given, the assembly keeps all of it. If no joint's velocity is given,
                                       it keeps the velocity, unless the loops then cannot be closed */
    int hold_count;                 /* length of hold */
    double tolerance;               /* the permitted contradiction of loops or held joints in rounded data, relative to
                                       a radian or to the length of the longest loop. 0: none; default: 1e-6. See
                                       kt_loop_disagreement_of */
    kt_inertia_limit inertia_check; /* default: strict. Otherwise kt_inertia_excess returns the accepted violation */
    const kt_auxiliary_state *states; /* auxiliary states */
    int state_count;                  /* length of states */
    const kt_lookup *tables;          /* tables that formulas of effects, states and couplings may call */
    int table_count;                  /* length of tables */
} kt_description;

/* Returns a struct with the default values: axes z, no forces. */
KT_API kt_end kt_end_default(void);
KT_API kt_loop kt_loop_default(void);
KT_API kt_effect kt_effect_default(void);
KT_API kt_auxiliary_state kt_auxiliary_state_default(void);
KT_API kt_description kt_description_default(void);

/* Returns the name of a type in scene files ("revolute", "spring"), or NULL for an unknown value. */
KT_API const char *kt_loop_type_name(kt_loop_type type);
KT_API const char *kt_effect_type_name(kt_effect_type type);

/* Arrays of a description in which a fault may lie. */
typedef enum kt_item {
    KT_ITEM_SCENE = 0, /* the whole */
    KT_ITEM_BODY,      /* bodies */
    KT_ITEM_LOOP,      /* loops */
    KT_ITEM_EFFECT,    /* effects */
    KT_ITEM_HOLD,      /* hold */
    KT_ITEM_STATE,     /* states */
} kt_item;

/* The place of a fault. */
typedef struct kt_place {
    kt_item item;      /* which array */
    int index;         /* in the description's array of that item */
    int sub;           /* in a list within the item (marker, term, end); -1: none */
    const char *field; /* the key in a scene file ("parent", "joint.axis", "markers"); static storage */
} kt_place;

/* Receives a fault. kt_description_check calls this function once for each fault. */
typedef void kt_report(void *user, const kt_place *place, const kt_error *error);

/* Checks a description: names, parents, numbers, masses, inertias, axes, references. Calls `report` (may be NULL) for
 * every fault. May allocate memory.
 * Errors: the code of the first fault, with that fault in *error.
 * Cost: O(size). */
KT_API KT_CHECKED kt_status kt_description_check(const kt_description *description, kt_report *report, void *user,
                                                 kt_error *error);

/* ---- variables of formulas --------------------------------------------------------------------------------------- */

/* The quantities that a variable of a formula can measure. */
typedef enum kt_variable_type {
    KT_VARIABLE_TIME = 0,        /* t, s */
    KT_VARIABLE_POSITION,        /* position.JOINT, position.JOINT[k]: a position of a joint */
    KT_VARIABLE_VELOCITY,        /* velocity.JOINT, velocity.JOINT[k]: a velocity of a joint */
    KT_VARIABLE_MARKER,          /* marker.BODY.MARKER.x: a world coordinate of a marker, m */
    KT_VARIABLE_MARKER_VELOCITY, /* marker.BODY.MARKER.vx: a component of its velocity, m/s */
    KT_VARIABLE_STATE,           /* NAME, state.NAME: an auxiliary state */
    KT_VARIABLE_GRAVITY          /* gravity.JOINT, gravity.JOINT[k]: the joint force that balances gravity, N m or N */
} kt_variable_type;

/* The largest number of variables in all formulas of one effect together. */
enum { KT_FORMULA_VARIABLE_MAX = 32 /* of one effect */ };

/* A variable of a formula, as indices in a description. */
typedef struct kt_variable {
    kt_variable_type type; /* the measured quantity */
    int body;              /* the body of the joint or marker: index in kt_description.bodies; -1 for other types */
    int marker;            /* index in that body's markers */
    int component;         /* index of a joint's position or velocity, of x, y, z, or of an auxiliary state; from 0 */
} kt_variable;

/* Finds a variable by its name. The name is the name of the column that records the variable: "t", "velocity.crank",
 * "marker.crank.tip.x" or "marker.crank.tip.vx". An auxiliary state is "current" or "state.current". If a joint has
 * several positions, the name has an index: "position.ball[2]".
 *
 * "gravity.crank" is the derivative of the potential energy of gravity (kt_potential_energy) along a velocity of the
 * joint. A joint force equal to this derivative balances gravity. Loops have no influence: the derivative moves this
 * joint alone. Forces and rates of states reject the variable if a mass is a function of time.
 *
 * Returns false if there is no such variable, or if an argument is NULL; *variable is then unchanged.
 * Cost: O(bodies + markers). */
KT_API bool kt_variable_find(const kt_description *description, const char *name, kt_variable *variable);

/* Finds the k-th of all variables of a description, k from 0. Returns false beyond the last; *variable is then
 * unchanged.
 * Cost: O(bodies). */
KT_API bool kt_variable_at(const kt_description *description, int k, kt_variable *variable);

/* Writes the name of a variable of this description into `size` bytes. The text is terminated, and cut if the bytes do
 * not suffice. If the variable does not exist, the text is empty. Returns the length of the whole name, without the
 * terminator.
 * Cost: O(1). */
KT_API int kt_variable_name(const kt_description *description, const kt_variable *variable, char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
