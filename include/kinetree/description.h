/* A mechanism in plain structs: functions of time, joints, bodies, loops, effects.
 *
 * Start every struct from its _default() call and fill in what is there. Nothing here allocates but for
 * kt_description_check, and nothing is owned: names, lists and numbers stay the caller's. kt_model_compile copies what
 * it needs, and the description may go.
 *
 * SI units and radians. A body has one joint, which connects it with its parent, and the joint has the name of its
 * body unless it is given another. The body frame is the child side of its joint: at joint position zero it is the joint frame. The world is the
 * parent of bodies that name none. Names of types and keys are those of scene files (types.md).
 */
#ifndef KINETREE_DESCRIPTION_H
#define KINETREE_DESCRIPTION_H

#include "kinetree/algebra.h"

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- functions of time ------------------------------------------------------------------------------------------- */

/* How a kt_function depends on time. */
typedef enum kt_function_type {
    KT_FUNCTION_NONE = 0,   /* not given: the default of the place where it stands */
    KT_FUNCTION_CONSTANT,   /* always `value` */
    KT_FUNCTION_SINE,       /* about an offset */
    KT_FUNCTION_RAMP,       /* from one value to another, smoothly */
    KT_FUNCTION_POLYNOMIAL, /* coefficients of powers of t */
    KT_FUNCTION_TABLE,      /* interpolated between rows */
    KT_FUNCTION_BUMP,       /* rises once and falls back, smoothly */
    KT_FUNCTION_SUM,        /* of other functions */
    KT_FUNCTION_PRODUCT,    /* of other functions */
    KT_FUNCTION_EXPRESSION, /* a formula of t in text */
} kt_function_type;

/* Between the rows of a table: straight lines, a natural spline, or cubics that do not overshoot. */
typedef enum kt_interpolation {
    KT_INTERPOLATION_LINEAR = 0 /* lines */,
    KT_INTERPOLATION_CUBIC /* spline */,
    KT_INTERPOLATION_MONOTONE /* cubics without overshoot */
} kt_interpolation;

/* A scalar function of time; only the members of its type are read. */
typedef struct kt_function {
    kt_function_type type;                      /* KT_FUNCTION_NONE: not given */
    double value;                               /* constant */
    double amplitude, frequency, phase, offset; /* offset + amplitude sin(2 pi frequency t + phase); Hz, rad */
    double from, to, start, end;                /* C1 ramp: `from` up to t = start, `to` from t = end on */
    const double *numbers;                      /* polynomial: c0, c1, ... of t; table: t0, y0, t1, y1, ... */
    int number_count;                           /* length of numbers */
    kt_interpolation interpolation;             /* of a table */
    bool has_slopes;                            /* of a cubic table: y' at its ends is given, in `slopes` */
    double slopes[2];                           /* at the first row and at the last */
    const struct kt_function *parts;            /* sum, product */
    int part_count;                             /* length of parts */
    const char *text;                           /* expression */
} kt_function;

/* Functions of each type. Lists of numbers stay the caller's; kt_model_compile copies them.
 *   constant: value, always;
 *   sine: offset + amplitude sin(2 pi frequency t + phase), frequency in Hz, phase in rad;
 *   ramp: `from` until t = start, `to` from t = end on, between them from + (to - from) s^2 (3 - 2 s) with
 *     s = (t - start) / (end - start): value and slope are continuous, the second derivative jumps at both ends;
 *   polynomial: coefficients[0] + coefficients[1] t + ...;
 *   table: rows t0, y0, t1, y1, ... with t increasing (number_count is twice the number of rows, at least two). Linear,
 *     or the natural cubic spline, which is twice continuously differentiable, has no curvature at its ends (or there
 *     the slopes that are given: the clamped spline, which a small library rejects), and overshoots (rows of 0, 0, 90, 90 degrees, 1 s apart: from -11.5 to 101.5 degrees), or monotone: cubics with
 *     continuous slope that stay between the values of their two rows (Fritsch and Butland 1984), and whose second
 *     derivative jumps at rows. Outside its rows a table keeps its first or last value, with no slope; at the first and
 *     the last it has that of the inside;
 *   bump: height (4 s (1 - s))^3 with s = (t - start) / (end - start) between start and end, else 0: value, slope and
 *     second derivative are continuous, the third jumps at both ends;
 *   sum, product: of at least one function, each of any type, of at most KT_FUNCTION_DEPTH_MAX within one another;
 *   expression: a formula (expression.h) whose only name is t, "0.5*(1 - cos(2*t))". Steps end at its corners, and
 *     where its first three derivatives change their sign.
 * A small library (-Dsmall=enabled) has the first five only. */
KT_API kt_function kt_function_constant(double value);
KT_API kt_function kt_function_sine(double amplitude, double frequency, double phase, double offset);
KT_API kt_function kt_function_ramp(double from, double to, double start, double end);
KT_API kt_function kt_function_polynomial(const double *coefficients, int count);
KT_API kt_function kt_function_table(const double *rows, int number_count, kt_interpolation interpolation);
KT_API kt_function kt_function_bump(double height, double start, double end);
KT_API kt_function kt_function_sum(const kt_function *parts, int part_count);
KT_API kt_function kt_function_product(const kt_function *parts, int part_count);
KT_API kt_function kt_function_expression(const char *text);

/* out = value, first and second derivative of a function at time t. Errors: KT_ERROR_MODEL, saying what is wrong with the
 * function; KT_ERROR_MEMORY; out is then untouched. Allocates, since it compiles the function: for programs that prepare a
 * description. O(its size). */
KT_API KT_CHECKED kt_status kt_function_evaluate(const kt_function *function, double t, double out[3], kt_error *error);

/* Bounds of functions. */
enum { KT_FUNCTION_DEPTH_MAX = 4 /* sums and products within one another */ };

/* ---- joints and bodies ------------------------------------------------------------------------------------------- */

/* Types of joints. X(type, name in scene files, positions, velocities) */
#define KT_JOINT_LIST(X)                                                                                               \
    X(KT_JOINT_FIXED, fixed, 0, 0)             /* no motion */                                                         \
    X(KT_JOINT_REVOLUTE, revolute, 1, 1)       /* rotation about axis */                                               \
    X(KT_JOINT_PRISMATIC, prismatic, 1, 1)     /* translation along axis */                                            \
    X(KT_JOINT_SCREW, screw, 1, 1)             /* rotation, and translation by pitch */                                \
    X(KT_JOINT_CYLINDRICAL, cylindrical, 2, 2) /* rotation about and translation along axis */                         \
    X(KT_JOINT_PLANAR, planar, 3, 3)           /* in the plane normal to axis */                                       \
    X(KT_JOINT_UNIVERSAL, universal, 2, 2)     /* rotation about axis, then about axis2 */                             \
    X(KT_JOINT_SPHERICAL, spherical, 4, 3)     /* every rotation */                                                    \
    X(KT_JOINT_FREE, free, 7, 6)               /* all six */

/* How a body can be joined to its parent; kt_joint has their coordinates. */
typedef enum kt_joint_type {
#define KT_JOINT_ENUM(id, name, nq, nv) id,
    KT_JOINT_LIST(KT_JOINT_ENUM)
#undef KT_JOINT_ENUM
        KT_JOINT_TYPE_COUNT /* how many */
} kt_joint_type;

/* The most coordinates that a joint has. */
enum { KT_JOINT_NQ_MAX = 7 /* positions */, KT_JOINT_NV_MAX = 6 /* velocities */ };

/* Parts of a joint's initial state, as bits. */
enum {
    KT_GIVEN_POSITION = 1,    /* positions but for a quaternion; of a free joint x, y, z */
    KT_GIVEN_ORIENTATION = 2, /* the quaternion of a spherical or free joint */
    KT_GIVEN_VELOCITY = 4,    /* velocities; of a free joint the linear one */
    KT_GIVEN_ANGULAR = 8,     /* the angular velocity of a free joint */
};

/* What a joint of one coordinate was built for: data for programs that command it, and what readers of robot formats
 * find. Nothing that is computed depends on them (the effect joint_limit is a stop). Infinite where there is none. */
typedef struct kt_joint_limits {
    double lower, upper; /* of the position, rad or m; lower <= upper */
    double velocity;     /* the largest speed, rad/s or m/s, >= 0 */
    double effort;       /* the largest torque or force of its drive, N m or N, >= 0 */
} kt_joint_limits;

/* How a body moves on its parent. Coordinates, in this order:
 *   revolute, screw: angle; prismatic: length; cylindrical: angle, length; universal: angle about axis, about axis2;
 *   planar: x, y, angle (x, y along the in-plane axes of kt_triad_from_axis(axis, 2), in the joint frame);
 *   spherical: quaternion; angular velocity in the body frame;
 *   free: x, y, z in the joint frame, quaternion; linear velocity in the joint frame, angular in the body frame.
 * A quaternion of four zeros stands for no rotation.
 * An assembly moves a given part of the initial state only where it cannot close the loops by moving the other parts
 * (kt_state_assemble). A part is given if it is not zero, or if `given` names it. */
typedef struct kt_joint {
    const char *name;     /* as a body's; the only joint of its name; NULL: that of its body */
    kt_joint_type type;   /* default: fixed */
    kt_vec3 axis;         /* in the joint frame; any non-zero length */
    kt_vec3 axis2;        /* universal: second axis, carried along; zero: the axis after `axis` (z, x, y, z ...) */
    double pitch;         /* screw: m per radian */
    kt_vec3 at;           /* origin of the joint frame in the parent's body frame, m */
    kt_rotation rotation; /* joint frame against the parent's body frame */
    double position[KT_JOINT_NQ_MAX]; /* initial positions, as many as the type has, rad or m */
    double velocity[KT_JOINT_NV_MAX]; /* initial velocities, rad/s or m/s */
    double armature[KT_JOINT_NV_MAX]; /* rotor inertia at each degree of freedom, kg m^2 or kg, >= 0; default: 0 */
    bool guess;             /* the positions say where assembly begins, and no more: they count as not given */
    unsigned given;         /* KT_GIVEN_ bits: parts that are given even where they are zero; default: none */
    kt_joint_limits limits; /* of a joint of one coordinate; default: none */
} kt_joint;

/* The KT_GIVEN_ bits of all parts that are given: those that `given` names, and those that are not zero. A quaternion
 * of four zeros never is. 0 for a fixed joint, or one of a type that does not exist. O(1). */
KT_API unsigned kt_joint_given(const kt_joint *joint);

/* A named frame of a body. A struct of zeros with a name is one at the body's origin, along its axes. */
typedef struct kt_marker {
    const char *name;     /* as a body's; the only one of its name on its body */
    kt_vec3 at;           /* its origin, body frame, m */
    kt_rotation rotation; /* its axes, against the body frame */
} kt_marker;

/* Types of shapes. X(type, name in scene files) */
#define KT_SHAPE_LIST(X)                                                                                               \
    X(KT_SHAPE_NONE, none)         /* no solid */                                                                      \
    X(KT_SHAPE_POINT, point)       /* a point mass */                                                                  \
    X(KT_SHAPE_ROD, rod)           /* between two points */                                                            \
    X(KT_SHAPE_BOX, box)           /* edges along the axes */                                                          \
    X(KT_SHAPE_SPHERE, sphere)     /* a ball */                                                                        \
    X(KT_SHAPE_CYLINDER, cylinder) /* about its axis */                                                                \
    X(KT_SHAPE_POLYGON, polygon)   /* a plate of any outline */

/* The solids that a body can be. */
typedef enum kt_shape_type {
#define KT_SHAPE_ENUM(id, name) id,
    KT_SHAPE_LIST(KT_SHAPE_ENUM)
#undef KT_SHAPE_ENUM
        KT_SHAPE_TYPE_COUNT /* how many */
} kt_shape_type;

/* What a picture shows, and the uniform solid whose com and inertia a body may take. */
typedef struct kt_shape {
    kt_shape_type type;   /* default: none */
    kt_vec3 from, to;     /* rod: its ends, body frame, m */
    kt_vec3 at;           /* others: centre, of a polygon the origin of its corners, body frame, m */
    kt_rotation rotation; /* box, cylinder, polygon: solid's axes against the body's */
    kt_vec3 size;         /* box: edge lengths, m */
    double radius;        /* rod (0: slender), sphere, cylinder, m */
    double length;        /* cylinder; polygon: its thickness along z, half on either side, m */
    kt_vec3 axis;         /* cylinder: its axis, in the solid's axes */
    const double *points; /* polygon: x, y of each corner, one after the other around it, from `at`, m; the caller's */
    int point_count;      /* corners */
} kt_shape;

/* The mass of a body as a function of time: fuel burns, a vessel leaks, a belt is loaded. kt_body.mass, .com and .inertia
 * are those to which the inertia belongs, best those at t = 0; the centre of mass stays where it is in the body.
 * What leaves or arrives does so at the velocity of the body; where it has another one, an effect of type thrust is the
 * force of that. A small library has none of this. */
typedef struct kt_variable_mass {
    kt_function mass;       /* kg; above 0 at all times */
    kt_function inertia[6]; /* xx, yy, zz, xy, xz, yz about the com, body axes, kg m^2; all not given (default): in
                               proportion to the mass; only some: the others are 0 */
} kt_variable_mass;

/* A rigid body, and the joint that carries it. */
typedef struct kt_body {
    const char *name;       /* [A-Za-z_][A-Za-z0-9_-]* */
    const char *parent;     /* name of a body; NULL or "world": the world */
    kt_joint joint;         /* on the parent */
    double mass;            /* kg */
    kt_vec3 com;            /* centre of mass, body frame, m */
    kt_sym3 inertia;        /* about the com, body axes, kg m^2 */
    bool com_of_shape;      /* take the com from the shape and `mass`, and ignore `com` */
    bool inertia_of_shape;  /* take the inertia from the shape and `mass`, and ignore `inertia` */
    kt_shape shape;         /* for pictures, and where it is asked for, for com and inertia */
    const kt_shape *shapes; /* further ones, for pictures alone: the caller's; NULL where there are none */
    int shape_count;        /* length of shapes */
    const kt_variable_mass *variable_mass; /* the caller's; NULL (default): the mass is constant */
    const kt_marker *markers;              /* the caller's; NULL where there are none */
    int marker_count;                      /* length of markers */
} kt_body;

/* ---- loops and effects ------------------------------------------------------------------------------------------- */

/* A frame on a body: a marker's, or one at `at` along the axes of the body; turned by `rotation` against it. */
typedef struct kt_end {
    const char *body;     /* NULL or "world": the world */
    const char *marker;   /* NULL: `at` counts */
    kt_vec3 at;           /* body frame, m */
    kt_rotation rotation; /* of the end's frame against the marker's, or without one the body's */
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
    X(KT_LOOP_ROLLING, rolling)         /* 2 of velocities, and 1 where holonomic */                                   \
    X(KT_LOOP_KNIFE_EDGE, knife_edge)   /* 1 of velocities: none along axis */                                         \
    X(KT_LOOP_RATES, rates)             /* 1 of velocities: terms = function */                                        \
    X(KT_LOOP_HOMOKINETIC, homokinetic) /* 4: constant-velocity joint */                                               \
    X(KT_LOOP_SURFACE, surface)         /* 1: the second point stays on a surface */                                   \
    X(KT_LOOP_CURVE, curve)             /* 2: on a curve, and 1 where its arc length is given */

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

/* The callback of a caller's own loop: it writes the equations of the motion of the second end as seen from the first.
 * Outputs are zeros when it is called. loop.h has the structs, an example, and what the returned number means. */
typedef int kt_loop_callback(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equations);

/* What the callback of a caller's own loop writes; what it does not is differenced. */
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

/* A surface in the frame of a loop's first end; only the members of its type are read. */
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

/* A curve in the frame of a loop's first end; only the members of its type are read. Its arc length is counted from the
 * first end's point (line), the x axis (circle, helix; of a helix in the plane through that point), or the first point
 * (spline). */
typedef struct kt_track {
    kt_track_type type;    /* default: none */
    double radius;         /* circle, helix, m */
    double pitch;          /* helix: advance along the axis, m per radian; not 0 */
    const kt_vec3 *points; /* spline, m: the caller's; the natural cubic spline through them, whose parameter is the sum
                              of their distances, and the straight lines beyond its ends */
    int point_count;       /* spline: two or more, each apart from the one before */
} kt_track;

/* One term of a coupling: coefficient * position of a scalar joint; of rates: coefficient * its rate. */
typedef struct kt_term {
    const char *joint;  /* of one coordinate */
    double coefficient; /* of its position, rad or m, or of its rate */
} kt_term;

/* Whether a loop or an effect acts throughout, or may be switched on and off while a program runs (model.h). */
typedef enum kt_switching {
    KT_ALWAYS_ON = 0, /* cannot be switched */
    KT_SWITCHED_ON,   /* may be switched; at first it is on */
    KT_SWITCHED_OFF, /* may be switched; at first it is off. Of what bounds a side, or friction that sticks: it is released (kt_simulation_release) */
    KT_SWITCHING_COUNT, /* how many of these there are */
} kt_switching;

/* The most loops and effects that may be switched; with hard contacts, stops and slack ropes they may be 16 in all. */
enum { KT_SWITCH_MAX = 10 /* loops and effects */ };

/* Whether the equation of a loop holds, or bounds one side alone: a stop, a floor, a rope. Of a loop of one equation that has a
 * residual phi (distance, inplane, surface, coupling). It acts while it is closed and would be crossed, and never pulls;
 * what comes at it bounces off by Newton's rule, or Poisson's (restitution, poisson). It is switched by simulations (kt_simulation_contacts), and
 * open in a model by itself. */
typedef enum kt_side {
    KT_SIDE_NONE = 0, /* phi = 0 holds: an equation */
    KT_SIDE_ABOVE,    /* phi >= 0 */
    KT_SIDE_BELOW,    /* phi <= 0 */
    KT_SIDE_COUNT,    /* how many of these there are */
} kt_side;

/* A constraint that the tree cannot carry; only the members of its type are read. */
typedef struct kt_loop {
    const char *name;     /* as a body's; the only loop of its name */
    kt_loop_type type;    /* how many equations it is, and of what */
    kt_end between[2];    /* rolling: the wheel's centre, and the surface it rolls on */
    kt_vec3 axis;         /* in both ends' frames; rolling: the wheel's axle, in the wheel's frame; knife_edge: the
                             direction without velocity, in the second end's frame */
    kt_vec3 axis2;        /* orthogonal, universal: in the second end's frame; rolling: the surface's normal */
    double pitch;         /* screw, m per radian */
    double radius;        /* rolling, m */
    bool holonomic;       /* rolling: the contact (wheel touches the surface) is a third equation; default true */
    kt_function function; /* distance: the length (not given: that in the given positions, before loops are closed);
                             motion: the joint's position; rates: what the terms add up to (not given: 0); curve: the
                             arc length (not given: free) */
    kt_surface surface;   /* surface: on which the second point stays */
    kt_track curve;       /* curve: likewise */
    const char *joint;    /* motion: that is driven */
    const kt_term *terms; /* coupling: sum of terms = offset; rates: sum of terms, of rates, = function */
    int term_count;       /* coupling, rates: length of terms */
    double offset;        /* coupling: what the terms, and the formula, add up to */
    const char
        *formula; /* coupling: is added to the terms; of position.NAME of the joints NAME that terms have, of which
                             coefficients may be 0. NULL (default): none. As a force's (expression.h), at most
                             KT_FORMULA_VARIABLE_MAX terms */
    kt_loop_callback *equations; /* custom */
    int equation_count;          /* custom: 1 to 6. All of them are holonomic, or none (`holonomic`) */
    kt_loop_given given;         /* custom: what the callback writes; default: residuals */
    bool driven;                 /* custom: the equations depend on time */
    void *user;                  /* custom: handed to the callback; must outlive the model */
    kt_switching switching;      /* whether it may be switched on and off while a program runs; default: always on */
    bool slack;                  /* distance: it only pulls, a rope (KT_SIDE_BELOW) */
    kt_side side;                /* that it bounds; default: none, an equation */
    double restitution;          /* of one that bounds a side: 0, plastic (default), to 1, elastic */
    double rest_velocity;        /* likewise: what comes slower does not bounce, m/s or rad/s; default 1e-6 */
    bool poisson; /* likewise: it gives back that part of the impulse of compression (Poisson's rule), not
                                    of the speed (Newton's); default: false */
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
typedef struct kt_effect_derivatives kt_effect_derivatives;

/* The callback of a caller's own effect: it writes a wrench at each of its ends (moment about the end's point, world
 * axes), or the force in a joint of one coordinate with position q and velocity v. Outputs are zeros when it is called;
 * balance may be NULL. effect.h has the structs, an example, and what the returned number means. */
typedef int kt_effect_wrench_callback(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
                                      kt_effect_balance *balance);
typedef int kt_effect_joint_force_callback(void *user, double t, double q, double v, double *force,
                                           kt_effect_balance *balance);

/* The callback of its derivatives, which are zeros when it is called: of the wrenches by the motion of the ends and by
 * time (effect.h); or of the joint force by q, v and t, in this order. What it returns means the same. Without it they
 * are found by differences, which are coarse where the force changes fast (kt_data_difference_error). */
typedef int kt_effect_wrench_derivatives_callback(void *user, double t, const kt_effect_end *ends,
                                                  kt_effect_derivatives *derivatives);
typedef int kt_effect_joint_force_derivatives_callback(void *user, double t, double q, double v, double derivatives[3]);

/* The callback of a law in C, in place of the formulas of an effect of type expression. u: the values of its variables,
 * in their order. It writes the force (one number; on a body six: force, moment) and the rates of the states that it
 * lists; of both only what is not NULL, which is zeros when it is called. The next one writes their derivatives,
 * likewise zeros: of force number i, or of rate i, by u[j] at [i * variable_count + j]. What they return means the
 * same as above. */
typedef int kt_effect_law_callback(void *user, const double *u, double *force, double *rates);
typedef int kt_effect_law_derivatives_callback(void *user, const double *u, double *force, double *rates);

/* Bounds of laws. */
enum { KT_LAW_STATE_MAX = 16 /* states of one effect */ };

/* A query for the corners of a caller's own force: returns the first time after t at which the force, or a derivative
 * of it, jumps, or at which it begins or ends to act; HUGE_VAL (or any time that is not after t) if there is none.
 * Steps of adaptive methods end there, and the force is evaluated just before and just after that time. A function of
 * its arguments alone, as the force is. */
typedef double kt_corner_callback(void *user, double t);

/* Whose axes the components of a force or torque are along. */
typedef enum kt_frame { KT_FRAME_WORLD = 0 /* the world's */, KT_FRAME_BODY /* the end's */ } kt_frame;

/* A force element; only the members of its type are read. types.md has the keys that stand for them.
 *   spring: pulls its ends together with stiffness (distance - length) + damping (rate of the distance);
 *   joint_spring: -stiffness (q - rest(t)) - damping v in a joint; joint_damper: -damping v;
 *   joint_friction: -(coulomb + (breakaway - coulomb) exp(-(v / stribeck)^2)) tanh(v / smoothing) - viscous v; with `stick`
 *     the sign of v in place of tanh, and rest at rest;
 *   joint_limit: nothing between lower and upper; beyond, stiffness times the excess back, and damping that grows from
 *     zero with it, so that the force is continuous and never pulls back; with a restitution hard stops;
 *   bushing: -stiffnesses of displacement and rotation (Euler vector) of the second frame, -dampings of their rates,
 *     along and about the first end's axes; for less than half a turn between the ends;
 *   motor: torque(t) in a joint; force: value(t) on a point; torque: value(t) on a body;
 *   servo: stiffness (target(t) - q) + damping (target'(t) - v) in a joint, never more than limit (smoothly), nor
 *     beyond lower and upper (sharply);
 *   thrust: d(mass)/dt (t) times exhaust, a velocity in the axes of the end's body: of mass that leaves or arrives there
 *     with that velocity, relative to the body (kt_variable_mass);
 *   drag: -(linear + quadratic |v|) v on a point; attraction: strength / distance^2 pulls two points together;
 *   contact: a sphere (a hard one: or the rim of a thin disc) and the half-space under a plane; at a depth x, a normal force that never pulls,
 *     stiffness x^exponent (1 + 3/2 dissipation dx/dt) (Hunt and Crossley 1975), and friction times that, at the
 *     sphere's lowest point, against the slip.
 *   expression: forces by formulas (expression.h) of t and of variables (kt_variable): in a joint, formula[0]; along the line between
 *     two ends, formula[0], which pushes them apart where it is positive, and may use `length` and `speed`, the distance
 *     of the ends and its rate; or on a point of a body, force formula[0] to [2] and moment formula[3] to [5] along the
 *     axes of `frame`. All that it does counts as supplied. At most KT_FORMULA_VARIABLE_MAX different variables. Instead
 *     of formulas it may have a law in C (effect.h), which lists its variables by name, and the own states whose rates it
 *     writes. One with states reads neither `length` and `speed` nor the coordinate of a loop, but markers at its ends.
 * All forces are continuous, for the integrator's error control. Friction is a function of the speed, smooth over
 * `smoothing` or `slip`: a load below it creeps instead of resting, and the smaller they are, the smaller the steps
 * must be. Joint effects act in one coordinate, along which the force does its work: of a joint, or a relative coordinate
 * of a loop. `joint` is the joint's or the loop's name, or NAME[k] for the k-th of several, in the order of kt_joint for
 * joints (without spherical and free ones). Loops: revolute, screw, coaxial: angle; prismatic, inline: length;
 * cylindrical: angle, length; planar: x, y, angle; inplane: x, y; universal: angle about axis, about axis2. Angles and
 * lengths are those of the second end's frame against the first's, in which both are 0 where the frames coincide. An angle
 * is counted from the given positions, where it is within half a turn: through whole turns where the links between the
 * ends rotate about axes that are parallel to it, and of a screw; elsewhere it is the one nearest to that at the given
 * positions, and a force that depends on it must not go beyond half a turn from there, where it would jump. A joint goes
 * before a loop of the same name. A small library has no effects in loops. "N (m)" below: N m, or N where the
 * coordinate is a length. */
typedef struct kt_effect {
    const char *name;    /* may be NULL */
    kt_effect_type type; /* which members are read */
    kt_end
        between[2]; /* the first is: force, torque, thrust, drag: where it acts; contact: the sphere's centre, and the
                              second a frame in the plane */
    const char *joint;     /* joint_*, motor, servo, expression, custom with joint_force: the coordinate, see above */
    double stiffness;      /* spring N/m; joint_spring, joint_limit, servo N (m) per rad or m; contact N/m^exponent */
    double damping;        /* spring N s/m; joint_spring, joint_damper, joint_limit, servo N (m) s per rad or m */
    double length;         /* spring: rest length, m */
    bool initial_length;   /* spring: the rest length is the distance at the start, where loops have been closed (in
                              the given positions where they cannot be), and `length` is ignored */
    kt_function rest;      /* joint_spring: position without force, rad or m; default 0 */
    double coulomb;        /* joint_friction: in motion, N (m) */
    double viscous;        /* joint_friction: N (m) s per rad or m */
    double breakaway;      /* joint_friction: at rest, N (m); not below coulomb; default (0): as coulomb */
    double stribeck;       /* joint_friction: speed over which breakaway falls to coulomb, rad/s or m/s; default 0.01 */
    double smoothing;      /* joint_friction: speed over which the force changes sign; default 1e-3 */
    double lower, upper;   /* joint_limit: rad or m, at least one is needed; servo: hard bounds of the force, N (m);
                              default: infinite, which is none */
    double stiffnesses[6]; /* bushing: x, y, z in N/m, about x, y, z in N m/rad; default 0 */
    double dampings[6];    /* bushing: N s/m, N m s/rad; default 0 */
    kt_function torque;    /* motor: N (m) */
    kt_function target;    /* servo: rad or m */
    double limit;          /* servo: largest force, N (m); default: infinite, which is none */
    kt_function value[3];  /* force, torque: components, N or N m */
    kt_frame frame;        /* force, torque: the axes of its components: the world's, or the end's */
    kt_function mass;      /* thrust: of the body, kg; its rate alone counts */
    kt_vec3 exhaust;       /* thrust: velocity of what leaves or arrives relative to the end, body axes, m/s */
    double linear;         /* drag: N s/m */
    double quadratic;      /* drag: N s^2/m^2 */
    double strength;       /* attraction: N m^2; negative: repulsion */
    kt_vec3 axis;          /* contact: the plane's normal in the second end's frame, out of the half-space; default z */
    double radius;         /* contact: of the sphere, m; default 0, a point */
    kt_vec3 axle;    /* contact: of a thin disc in place of the sphere, whose rim touches: its axis in the first end's
                              frame; of hard ones. Default 0: a sphere */
    double exponent; /* contact: 1 or more; default 1.5, Hertz's */
    double dissipation;     /* contact: s/m; an impact at a slow v comes back with v - dissipation v^2; default 0 */
    double friction;        /* contact: coefficient; default 0. Of a hard one (restitution) friction sticks */
    double slip;            /* contact: slip speed over which friction builds up, m/s; default 1e-3; of elastic ones */
    const char *formula[6]; /* expression: force, moment; NULL: none of that component */
    kt_effect_wrench_callback *wrench;           /* custom: acts at `end_count` ends, */
    int end_count;                               /* custom: 1 or 2; expression: 0 in a joint, 1 on a body, 2 between */
    kt_effect_joint_force_callback *joint_force; /* custom: or acts in `joint` */
    kt_effect_wrench_derivatives_callback *wrench_derivatives;           /* custom: of `wrench`; NULL: differences */
    kt_effect_joint_force_derivatives_callback *joint_force_derivatives; /* custom: of `joint_force`; NULL: likewise */
    kt_effect_law_callback *law;                         /* expression: in place of formulas; NULL: there are some */
    kt_effect_law_derivatives_callback *law_derivatives; /* of the law; NULL: differences */
    const char *const *variables; /* of the law: their names, as kt_variable_find has them, each once */
    int variable_count;           /* length of variables */
    const char *const *states;    /* of the law: names of own states of the description that have no formula */
    int state_count;              /* length of states, at most KT_LAW_STATE_MAX */
    kt_corner_callback *corner;   /* custom, law: when its force has corners; NULL: never */
    void *user;                   /* custom, law: handed to the callback; must outlive the model */
    kt_switching switching;       /* as of a loop */
    bool stick; /* joint_friction: it sticks: at rest it is a constraint, until the force on it exceeds breakaway
                             (or coulomb), and then it slips, with the sign of the speed (not smoothed); default: false */
    double restitution;   /* joint_limit, contact: it is hard, and gives back this part of the speed, 0 to 1; default:
                             infinite, which is none: it is elastic. Hard ones are loops that bound a side (kt_loop.side),
                             named after the effect, or its joint or body */
    double rest_velocity; /* likewise: what comes slower does not bounce, m/s or rad/s; default 1e-6 */
    bool poisson;         /* likewise: as of a loop */
} kt_effect;

/* ---- own states -------------------------------------------------------------------------------------------------- */

/* A state that is neither a position nor a velocity: a current, a pressure, the integral of a controller. Its rate
 *     x' = rate(t, q, v, x)
 * is a formula (expression.h) of the variables of kt_variable, all own states among them, and is integrated with the
 * motion; or the law of one effect in C writes it (kt_effect.states), which is asked for it while the effect is switched off, too. Effects of
 * type expression and other states use it by its name. */
typedef struct kt_state {
    const char *name; /* letters, digits and _, as formulas have names; the only state of its name */
    double initial;   /* at the start; default 0 */
    const char *rate; /* a formula; NULL: the law of an effect writes it */
} kt_state;

/* ---- the description --------------------------------------------------------------------------------------------- */

/* Inertia checks. X(id, name in scene files) */
#define KT_INERTIA_LIMIT_LIST(X)                                                                                       \
    X(KT_INERTIA_STRICT, strict) /* no more than rounding */                                                           \
    X(KT_INERTIA_WARN, warn)     /* up to KT_INERTIA_EXCESS_MAX */                                                     \
    X(KT_INERTIA_ACCEPT, accept) /* any, negative moments too: what moves may then have no inertia, or a negative one */

/* How far inertias may break the triangle inequality of principal moments. Rounded CAD data breaks it a little. */
typedef enum kt_inertia_limit {
#define KT_INERTIA_LIMIT_ENUM(id, name) id,
    KT_INERTIA_LIMIT_LIST(KT_INERTIA_LIMIT_ENUM)
#undef KT_INERTIA_LIMIT_ENUM
        KT_INERTIA_LIMIT_COUNT /* how many */
} kt_inertia_limit;

/* The most that KT_INERTIA_WARN accepts of kt_inertia_excess. */
#define KT_INERTIA_EXCESS_MAX 0.01

/* A mechanism. All that it points to stays the caller's, and may go once the model is compiled. */
typedef struct kt_description {
    const char *name;               /* free text; may be NULL */
    kt_vec3 gravity;                /* m/s^2, world frame */
    const kt_body *bodies;          /* in any order; the world is none of them */
    int body_count;                 /* length of bodies */
    const kt_loop *loops;           /* constraints that the tree cannot carry */
    int loop_count;                 /* length of loops */
    const kt_effect *effects;       /* what acts besides gravity */
    int effect_count;               /* length of effects */
    const char *const *hold;        /* joints of which the assembly keeps what is given of position and velocity; all
                                       of the position where none of it is given; and, unless the loops cannot
                                       be closed then, the velocity where no joint's velocity is given */
    int hold_count;                 /* length of hold */
    double tolerance;               /* by which loops may contradict each other, or held joints, where data are rounded:
                                       relative to a radian or the length of the longest loop. 0: not at all; default:
                                       1e-6 (kt_loop_disagreement_of tells) */
    kt_inertia_limit inertia_check; /* default: strict. Else kt_inertia_excess is what was accepted */
    const kt_state *states;         /* own states; a small library has none */
    int state_count;                /* length of states */
} kt_description;

/* Structs to start from: no motion (fixed joint), axes z, no mass, no shape. */
KT_API kt_joint kt_joint_default(void);
KT_API kt_shape kt_shape_default(void);
KT_API kt_body kt_body_default(void);
KT_API kt_end kt_end_default(void);
KT_API kt_loop kt_loop_default(void);
KT_API kt_effect kt_effect_default(void);
KT_API kt_state kt_state_default(void);
KT_API kt_description kt_description_default(void);

/* The name of a type in scene files ("revolute", "rod"); NULL for a value that is none. */
KT_API const char *kt_joint_type_name(kt_joint_type type);
KT_API const char *kt_shape_type_name(kt_shape_type type);
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

/* Called once for each fault that kt_description_check finds. */
typedef void kt_report(void *user, const kt_place *place, const kt_error *error);

/* Checks a description: names, parents, numbers, masses, inertias, axes, references. Calls report (may be NULL) for
 * every fault. Returns KT_OK, or the code of the first fault with that fault in *error. May allocate. O(size). */
KT_API KT_CHECKED kt_status kt_description_check(const kt_description *description, kt_report *report, void *user,
                                                 kt_error *error);

/* The mass properties that a body has in the end, its shape's put in where they are asked for.
 * Returns KT_ERROR_MODEL where the shape cannot have a mass (none, or of negative size). */
KT_API KT_CHECKED kt_status kt_body_inertia(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia, kt_error *error);

/* ---- variables of formulas --------------------------------------------------------------------------------------- */

/* What a variable of a formula measures. */
typedef enum kt_variable_type {
    KT_VARIABLE_TIME = 0,        /* t, s */
    KT_VARIABLE_POSITION,        /* position.JOINT, position.JOINT[k]: a position of a joint */
    KT_VARIABLE_VELOCITY,        /* velocity.JOINT, velocity.JOINT[k]: a velocity of a joint */
    KT_VARIABLE_MARKER,          /* marker.BODY.MARKER.x: a world coordinate of a marker, m */
    KT_VARIABLE_MARKER_VELOCITY, /* marker.BODY.MARKER.vx: a component of its velocity, m/s */
    KT_VARIABLE_STATE            /* NAME, state.NAME: an own state */
} kt_variable_type;

/* The most variables that the formulas of one effect use together. */
enum { KT_FORMULA_VARIABLE_MAX = 32 /* of one effect */ };

/* A variable of a formula, by its place in a description. */
typedef struct kt_variable {
    kt_variable_type type; /* what it measures */
    int body;              /* whose joint or marker it is: index in kt_description.bodies; of others -1 */
    int marker;            /* index in that body's markers */
    int component;         /* of the joint's positions or velocities, or x, y, z (0, 1, 2); index of an own state */
} kt_variable;

/* Finds a variable by its name, that of the column that records it: "t", "velocity.crank", "position.ball[2]" (where a
 * joint has more than one), "marker.crank.tip.x", "marker.crank.tip.vx"; "current" or "state.current". Returns false if there is none, or if an
 * argument is NULL; *variable is then untouched. O(bodies + markers). */
KT_API bool kt_variable_find(const kt_description *description, const char *name, kt_variable *variable);

/* The k-th of all variables of a description, k from 0. Returns false beyond the last, and then *variable is untouched.
 * O(bodies). */
KT_API bool kt_variable_at(const kt_description *description, int k, kt_variable *variable);

/* Writes the name of a variable of this description into `size` bytes, terminated and cut where they do not suffice; an
 * empty text if there is no such variable. Returns the length of the whole name, without its end. O(1). */
KT_API int kt_variable_name(const kt_description *description, const kt_variable *variable, char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
