/* A mechanism: its description in plain structs, and the immutable model compiled from it.
 *
 * The caller fills a kt_description (start every struct from its _default() call), kt_model_compile checks it, orders
 * it and lays it out. The description and its strings may be released afterwards. A model may be shared between
 * threads; each thread has its own kt_data.
 *
 * SI units and radians. Body 0 is the world. A body bears one joint, the one that carries it on its parent, and the
 * joint bears the body's name. The body frame is the child side of its joint.
 */
#ifndef KINETREE_MODEL_H
#define KINETREE_MODEL_H

#include "kinetree/algebra.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- functions of time ------------------------------------------------------------------------------------------- */

typedef enum kt_function_type {
    KT_FUNCTION_NONE = 0, /* not given: the default of the place where it stands */
    KT_FUNCTION_CONSTANT,
    KT_FUNCTION_SINE,
    KT_FUNCTION_RAMP,
    KT_FUNCTION_POLYNOMIAL,
    KT_FUNCTION_TABLE,
} kt_function_type;

typedef enum kt_interpolation { KT_INTERPOLATION_LINEAR = 0, KT_INTERPOLATION_CUBIC } kt_interpolation;

/* A scalar function of time; only the members of its type are read. */
typedef struct kt_function {
    kt_function_type type;
    double value;                               /* constant */
    double amplitude, frequency, phase, offset; /* offset + amplitude sin(2 pi frequency t + phase); Hz, rad */
    double from, to, start, end;                /* C1 ramp: `from` up to t = start, `to` from t = end on */
    const double *numbers;                      /* polynomial: c0, c1, ... of t; table: t0, y0, t1, y1, ... */
    int number_count;                           /* length of numbers */
    kt_interpolation interpolation;             /* of a table */
} kt_function;

/* Functions of each type. Lists of numbers stay the caller's; kt_model_compile copies them.
 *   constant: value, always;
 *   sine: offset + amplitude sin(2 pi frequency t + phase), frequency in Hz, phase in rad;
 *   ramp: `from` until t = start, `to` from t = end on, between them from + (to - from) s^2 (3 - 2 s) with
 *     s = (t - start) / (end - start): value and slope are continuous, the second derivative jumps at both ends;
 *   polynomial: coefficients[0] + coefficients[1] t + ...;
 *   table: rows t0, y0, t1, y1, ... with t increasing (number_count is twice the number of rows, at least two). Linear,
 *     or the natural cubic spline, which is twice continuously differentiable and has no curvature at its ends. Outside
 *     its rows a table keeps its first or last value, with no slope. */
KT_API kt_function kt_function_constant(double value);
KT_API kt_function kt_function_sine(double amplitude, double frequency, double phase, double offset);
KT_API kt_function kt_function_ramp(double from, double to, double start, double end);
KT_API kt_function kt_function_polynomial(const double *coefficients, int count);
KT_API kt_function kt_function_table(const double *rows, int number_count, kt_interpolation interpolation);

/* ---- joints and bodies ------------------------------------------------------------------------------------------- */

/* type, name in scene files, positions, velocities */
#define KT_JOINT_LIST(X)                                                                                               \
    X(KT_JOINT_FIXED, fixed, 0, 0)                                                                                     \
    X(KT_JOINT_REVOLUTE, revolute, 1, 1)                                                                               \
    X(KT_JOINT_PRISMATIC, prismatic, 1, 1)                                                                             \
    X(KT_JOINT_SCREW, screw, 1, 1)                                                                                     \
    X(KT_JOINT_CYLINDRICAL, cylindrical, 2, 2)                                                                         \
    X(KT_JOINT_PLANAR, planar, 3, 3)                                                                                   \
    X(KT_JOINT_UNIVERSAL, universal, 2, 2)                                                                             \
    X(KT_JOINT_SPHERICAL, spherical, 4, 3)                                                                             \
    X(KT_JOINT_FREE, free, 7, 6)

typedef enum kt_joint_type {
#define KT_JOINT_ENUM(id, name, nq, nv) id,
    KT_JOINT_LIST(KT_JOINT_ENUM)
#undef KT_JOINT_ENUM
        KT_JOINT_TYPE_COUNT
} kt_joint_type;

enum { KT_JOINT_NQ_MAX = 7, KT_JOINT_NV_MAX = 6 };

/* How a body moves on its parent. Coordinates, in this order:
 *   revolute, screw: angle; prismatic: length; cylindrical: angle, length; universal: angle about axis, about axis2;
 *   planar: x, y, angle (x, y along the in-plane axes of kt_triad_from_axis(axis, 2), in the joint frame);
 *   spherical: quaternion; angular velocity in the body frame;
 *   free: x, y, z in the joint frame, quaternion; linear velocity in the joint frame, angular velocity in the body
 * frame. A quaternion of four zeros stands for no rotation. */
typedef struct kt_joint {
    kt_joint_type type;
    kt_vec3 axis;         /* in the joint frame; any non-zero length */
    kt_vec3 axis2;        /* universal: second axis, carried along; zero: the axis after `axis` (z, x, y, z ...) */
    double pitch;         /* screw: m per radian */
    kt_vec3 at;           /* origin of the joint frame in the parent's body frame, m */
    kt_rotation rotation; /* joint frame against the parent's body frame */
    double position[7];   /* initial coordinates */
    double velocity[6];
} kt_joint;

typedef struct kt_marker {
    const char *name;
    kt_vec3 at; /* body frame, m */
} kt_marker;

/* type, name in scene files */
#define KT_SHAPE_LIST(X)                                                                                               \
    X(KT_SHAPE_NONE, none)                                                                                             \
    X(KT_SHAPE_POINT, point)                                                                                           \
    X(KT_SHAPE_ROD, rod)                                                                                               \
    X(KT_SHAPE_BOX, box)                                                                                               \
    X(KT_SHAPE_SPHERE, sphere)                                                                                         \
    X(KT_SHAPE_CYLINDER, cylinder)

typedef enum kt_shape_type {
#define KT_SHAPE_ENUM(id, name) id,
    KT_SHAPE_LIST(KT_SHAPE_ENUM)
#undef KT_SHAPE_ENUM
        KT_SHAPE_TYPE_COUNT
} kt_shape_type;

/* What a picture shows, and the uniform solid whose com and inertia a body may take. */
typedef struct kt_shape {
    kt_shape_type type;
    kt_vec3 from, to;     /* rod: its ends, body frame, m */
    kt_vec3 at;           /* others: centre, body frame, m */
    kt_rotation rotation; /* box, cylinder: solid's axes against the body's */
    kt_vec3 size;         /* box: edge lengths, m */
    double radius;        /* rod (0: slender), sphere, cylinder, m */
    double length;        /* cylinder, m */
    kt_vec3 axis;         /* cylinder: its axis, in the solid's axes */
} kt_shape;

typedef struct kt_body {
    const char *name;   /* [A-Za-z_][A-Za-z0-9_-]* */
    const char *parent; /* name of a body; NULL or "world": the world */
    kt_joint joint;
    double mass;           /* kg */
    kt_vec3 com;           /* centre of mass, body frame, m */
    kt_sym3 inertia;       /* about the com, body axes, kg m^2 */
    bool com_of_shape;     /* take the com from the shape and `mass`, and ignore `com` */
    bool inertia_of_shape; /* take the inertia from the shape and `mass`, and ignore `inertia` */
    kt_shape shape;
    const kt_marker *markers;
    int marker_count;
} kt_body;

/* ---- loops and effects ------------------------------------------------------------------------------------------- */

/* A frame on a body: at a marker, or at `at` in the body frame, turned by `rotation` against the body frame. */
typedef struct kt_end {
    const char *body;   /* NULL or "world": the world */
    const char *marker; /* NULL: `at` counts */
    kt_vec3 at;
    kt_rotation rotation;
} kt_end;

/* type, name in scene files */
#define KT_LOOP_LIST(X)                                                                                                \
    X(KT_LOOP_SPHERICAL, spherical)                                                                                    \
    X(KT_LOOP_INLINE, inline)                                                                                          \
    X(KT_LOOP_INPLANE, inplane)                                                                                        \
    X(KT_LOOP_DISTANCE, distance)                                                                                      \
    X(KT_LOOP_PARALLEL, parallel)                                                                                      \
    X(KT_LOOP_COAXIAL, coaxial)                                                                                        \
    X(KT_LOOP_ORTHOGONAL, orthogonal)                                                                                  \
    X(KT_LOOP_REVOLUTE, revolute)                                                                                      \
    X(KT_LOOP_PRISMATIC, prismatic)                                                                                    \
    X(KT_LOOP_SCREW, screw)                                                                                            \
    X(KT_LOOP_CYLINDRICAL, cylindrical)                                                                                \
    X(KT_LOOP_PLANAR, planar)                                                                                          \
    X(KT_LOOP_WELD, weld)                                                                                              \
    X(KT_LOOP_UNIVERSAL, universal)                                                                                    \
    X(KT_LOOP_COUPLING, coupling)                                                                                      \
    X(KT_LOOP_MOTION, motion)                                                                                          \
    X(KT_LOOP_ROLLING, rolling)

typedef enum kt_loop_type {
#define KT_LOOP_ENUM(id, name) id,
    KT_LOOP_LIST(KT_LOOP_ENUM)
#undef KT_LOOP_ENUM
        KT_LOOP_TYPE_COUNT
} kt_loop_type;

/* One term of a coupling: coefficient * position of a scalar joint. */
typedef struct kt_term {
    const char *joint;
    double coefficient;
} kt_term;

/* A constraint that the tree cannot carry; only the members of its type are read. */
typedef struct kt_loop {
    const char *name;
    kt_loop_type type;
    kt_end between[2];    /* rolling: the wheel's centre, and the surface it rolls on */
    kt_vec3 axis;         /* in both ends' frames; rolling: the wheel's axle, in the wheel's frame */
    kt_vec3 axis2;        /* orthogonal, universal: in the second end's frame; rolling: the surface's normal */
    double pitch;         /* screw, m per radian */
    double radius;        /* rolling, m */
    bool holonomic;       /* rolling: the contact (wheel touches the surface) is a third equation; default true */
    kt_function function; /* distance: the length (not given: the initial one); motion: the joint's position */
    const char *joint;    /* motion */
    const kt_term *terms; /* coupling: sum of terms = offset */
    int term_count;
    double offset;
} kt_loop;

/* type, name in scene files */
#define KT_EFFECT_LIST(X)                                                                                              \
    X(KT_EFFECT_SPRING, spring)                                                                                        \
    X(KT_EFFECT_JOINT_SPRING, joint_spring)                                                                            \
    X(KT_EFFECT_JOINT_DAMPER, joint_damper)                                                                            \
    X(KT_EFFECT_JOINT_FRICTION, joint_friction)                                                                        \
    X(KT_EFFECT_JOINT_LIMIT, joint_limit)                                                                              \
    X(KT_EFFECT_BUSHING, bushing)                                                                                      \
    X(KT_EFFECT_MOTOR, motor)                                                                                          \
    X(KT_EFFECT_FORCE, force)                                                                                          \
    X(KT_EFFECT_TORQUE, torque)                                                                                        \
    X(KT_EFFECT_DRAG, drag)                                                                                            \
    X(KT_EFFECT_ATTRACTION, attraction)                                                                                \
    X(KT_EFFECT_CONTACT, contact)

typedef enum kt_effect_type {
#define KT_EFFECT_ENUM(id, name) id,
    KT_EFFECT_LIST(KT_EFFECT_ENUM)
#undef KT_EFFECT_ENUM
        KT_EFFECT_TYPE_COUNT,
    KT_EFFECT_CUSTOM = 1000 /* a caller's own (effect.h); not in scene files */
} kt_effect_type;

/* What a caller's own effect does: a wrench at each of its ends (moment about the end's point, world axes), or the
 * force of a scalar joint with position q and velocity v. Outputs come as zeros; balance may be NULL. effect.h has the
 * structs, an example, and what the returned number means. */
typedef struct kt_effect_end kt_effect_end;
typedef struct kt_effect_balance kt_effect_balance;
typedef int kt_effect_push(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
                           kt_effect_balance *balance);
typedef int kt_effect_drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance);

typedef enum kt_frame { KT_FRAME_WORLD = 0, KT_FRAME_BODY } kt_frame;

/* Something that pushes; only the members of its type are read. Each type's file in lib/effect has its formula.
 *   spring: pulls its ends together with stiffness (distance - length) + damping (rate of the distance);
 *   joint_spring: -stiffness (q - rest) - damping v in a joint; joint_damper: -damping v;
 *   joint_friction: -(coulomb + (breakaway - coulomb) exp(-(v / stribeck)^2)) tanh(v / smoothing) - viscous v;
 *   joint_limit: nothing between lower and upper; beyond, stiffness times the excess back, and damping that grows from
 *     zero with it, so that the force is continuous and never pulls back;
 *   bushing: -stiffnesses of displacement and rotation (Euler vector) of the second frame, -dampings of their rates,
 *     along and about the first end's axes; for less than half a turn between the ends;
 *   motor: torque(t) in a joint; force: value(t) on a point; torque: value(t) on a body;
 *   drag: -(linear + quadratic |v|) v on a point; attraction: strength / distance^2 pulls two points together;
 *   contact: a sphere on a plane that bears a half-space; where it is x deep, a normal force that never pulls,
 *     stiffness x^exponent (1 + 3/2 dissipation dx/dt) (Hunt and Crossley 1975), and friction times that, at the
 *     sphere's lowest point, against the slip.
 * All forces are continuous, for the integrator's error control. Friction is a function of the speed, smooth over
 * `smoothing` or `slip`: a load below it creeps instead of resting, and the smaller they are, the smaller the steps
 * must be. Joint effects are for joints of one coordinate: revolute, prismatic or screw. "N (m)" below: N m, or N where
 * the joint slides. */
typedef struct kt_effect {
    const char *name; /* may be NULL */
    kt_effect_type type;
    kt_end between[2];     /* the first is: force, torque, drag: where it acts; contact: the sphere's centre, and the
                              second a frame in the plane */
    const char *joint;     /* joint_*, motor, custom with drive */
    double stiffness;      /* spring N/m; joint_spring, joint_limit N (m) per rad or m; contact N/m^exponent */
    double damping;        /* spring N s/m; joint_spring, joint_damper, joint_limit N (m) s per rad or m */
    double length;         /* spring: rest length, m */
    bool initial_length;   /* spring: the rest length is the distance at the start, and `length` is ignored */
    double rest;           /* joint_spring: position without force, rad or m; default 0 */
    double coulomb;        /* joint_friction: in motion, N (m) */
    double viscous;        /* joint_friction: N (m) s per rad or m */
    double breakaway;      /* joint_friction: at rest, N (m); not below coulomb; default (0): as coulomb */
    double stribeck;       /* joint_friction: speed over which breakaway falls to coulomb, rad/s or m/s; default 0.01 */
    double smoothing;      /* joint_friction: speed over which the force changes sign; default 1e-3 */
    double lower, upper;   /* joint_limit: rad or m; default: infinite, which is none; at least one is needed */
    double stiffnesses[6]; /* bushing: x, y, z in N/m, about x, y, z in N m/rad; default 0 */
    double dampings[6];    /* bushing: N s/m, N m s/rad; default 0 */
    kt_function torque;    /* motor: N (m) */
    kt_function value[3];  /* force, torque: components, N or N m */
    kt_frame frame;        /* force, torque: the axes of its components: the world's, or the end's */
    double linear;         /* drag: N s/m */
    double quadratic;      /* drag: N s^2/m^2 */
    double strength;       /* attraction: N m^2; negative: repulsion */
    kt_vec3 axis;          /* contact: the plane's normal in the second end's frame, out of the half-space; default z */
    double radius;         /* contact: of the sphere, m; default 0, a point */
    double exponent;       /* contact: 1 or more; default 1.5, Hertz's */
    double dissipation;    /* contact: s/m; an impact at a slow v comes back with v - dissipation v^2; default 0 */
    double friction;       /* contact: coefficient; default 0 */
    double slip;           /* contact: slip speed over which friction builds up, m/s; default 1e-3 */
    kt_effect_push *push;  /* custom: at `end_count` ends, */
    int end_count;         /* custom: 1 or 2; */
    kt_effect_drive *drive; /* custom: or in `joint` */
    void *user;             /* custom: handed to the callback; must outlive the model */
} kt_effect;

/* ---- the description --------------------------------------------------------------------------------------------- */

typedef struct kt_description {
    const char *name; /* free text; may be NULL */
    kt_vec3 gravity;  /* m/s^2, world frame */
    const kt_body *bodies;
    int body_count;
    const kt_loop *loops;
    int loop_count;
    const kt_effect *effects;
    int effect_count;
    const char *const *hold; /* joints whose given position and velocity the assembly keeps */
    int hold_count;
} kt_description;

/* Structs to start from: no motion (fixed joint), axes z, no mass, no shape. */
KT_API kt_joint kt_joint_default(void);
KT_API kt_shape kt_shape_default(void);
KT_API kt_body kt_body_default(void);
KT_API kt_end kt_end_default(void);
KT_API kt_loop kt_loop_default(void);
KT_API kt_effect kt_effect_default(void);
KT_API kt_description kt_description_default(void);

/* The name of a type in scene files ("revolute", "rod"); NULL for a value that is none. */
KT_API const char *kt_joint_type_name(kt_joint_type type);
KT_API const char *kt_shape_type_name(kt_shape_type type);
KT_API const char *kt_loop_type_name(kt_loop_type type);
KT_API const char *kt_effect_type_name(kt_effect_type type);

/* Where in a description a fault lies. */
typedef enum kt_item { KT_ITEM_SCENE = 0, KT_ITEM_BODY, KT_ITEM_LOOP, KT_ITEM_EFFECT, KT_ITEM_HOLD } kt_item;

typedef struct kt_place {
    kt_item item;
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

/* ---- the model --------------------------------------------------------------------------------------------------- */

typedef struct kt_model kt_model;
typedef struct kt_data kt_data;

/* Instruction sets that the recursions are built for. The same numbers come out of each, to the last bit. */
typedef enum kt_level { KT_LEVEL_AUTO = 0, KT_LEVEL_BASE, KT_LEVEL_V3, KT_LEVEL_V4 } kt_level;

/* How the equations of loops are solved for the freedoms that are left, and in which metric a state that has left the
 * constraint manifold moves back to it (identity: the least change of coordinates; mass: of kinetic energy). */
typedef enum kt_reduction { KT_REDUCTION_QR = 0, KT_REDUCTION_PARTITION, KT_REDUCTION_SVD } kt_reduction;
typedef enum kt_metric { KT_METRIC_IDENTITY = 0, KT_METRIC_MASS } kt_metric;

/* id, name in scene files */
#define KT_FORMULATION_LIST(X)                                                                                         \
    X(KT_FORMULATION_TREE, tree)                                                                                       \
    X(KT_FORMULATION_ABSOLUTE, absolute)

/* What is integrated: the coordinates of the tree's joints; or, as a reference for these, the positions of all bodies
 * in the world, every joint being a constraint between two of them [MSD 7.1]. */
typedef enum kt_formulation {
#define KT_FORMULATION_ENUM(id, name) id,
    KT_FORMULATION_LIST(KT_FORMULATION_ENUM)
#undef KT_FORMULATION_ENUM
        KT_FORMULATION_COUNT
} kt_formulation;

/* id, name in scene files */
#define KT_PLAN_LIST(X)                                                                                                \
    X(KT_PLAN_AUTO, auto)                                                                                              \
    X(KT_PLAN_SPATIAL, spatial)

/* How trees are computed that move in a plane, all their joints being turns about one direction or slides normal to it:
 * in the plane (auto), or like all others (spatial). The results are the same, but for rounding. */
typedef enum kt_plan {
#define KT_PLAN_ENUM(id, name) id,
    KT_PLAN_LIST(KT_PLAN_ENUM)
#undef KT_PLAN_ENUM
        KT_PLAN_COUNT
} kt_plan;

typedef struct kt_model_options {
    kt_level level; /* auto: the best that this processor has */
    kt_reduction reduction;
    kt_metric metric;
    kt_formulation formulation; /* absolute: the model can be simulated in this formulation too */
    kt_plan plan;
} kt_model_options;

KT_API kt_model_options kt_model_options_default(void);

/* Checks, orders and compiles a description. *model is allocated and released with kt_model_free; this and the _create
 * calls are the only ones that allocate. options may be NULL. Errors: KT_ERROR_MEMORY; KT_ERROR_MODEL with what, where
 * and how: the first fault of kt_description_check, or a joint without inertia, a loop on one rigid part. O(size). */
KT_API KT_CHECKED kt_status kt_model_compile(const kt_description *description, const kt_model_options *options,
                                             kt_model **model, kt_error *error);
KT_API void kt_model_free(kt_model *model);

/* Bytes that the model takes. */
KT_API size_t kt_model_size(const kt_model *model);

/* A copy of a model in the caller's memory, at KT_ALIGNMENT: kt_model_size(model) bytes, static ones for example, which
 * must stay where they are while the copy is used. Nothing of it lies elsewhere: the original may be released. Equal
 * inputs give equal bits with both. A copy may be copied; kt_model_free does nothing with one.
 * Errors: KT_ERROR_MEMORY (too small or misaligned; *copy and the memory are then untouched). O(size). */
KT_API KT_CHECKED kt_status kt_model_copy(const kt_model *model, void *memory, size_t size, kt_model **copy,
                                          kt_error *error);

/* The absolute formulation of a model that was compiled for it, or NULL: a model in its own right, with every body free
 * and every joint a loop of the body's name behind the loops of the description. Bodies are in the description's order;
 * behind them there may be massless ones, NAME.position and NAME.cross, on which relations, effects and oblique
 * universal joints rest. Lives as long as `model`. */
KT_API const kt_model *kt_model_absolute(const kt_model *model);

/* Number of bodies, the world included; of positions; of velocities. */
KT_API int kt_model_body_count(const kt_model *model);
KT_API int kt_model_nq(const kt_model *model);
KT_API int kt_model_nv(const kt_model *model);

/* Bodies come in the description's order, except that a parent precedes its children; 0 is the world. */
KT_API const char *kt_model_name(const kt_model *model);
KT_API const char *kt_body_name(const kt_model *model, int body);
KT_API int kt_body_parent(const kt_model *model, int body);
KT_API double kt_body_mass(const kt_model *model, int body);
/* The index of a body; -1 where there is none of that name. O(1). */
KT_API int kt_body_find(const kt_model *model, const char *name);

/* Where a body stood in the description's array; -1 for the world. */
KT_API int kt_body_source(const kt_model *model, int body);

/* The joint that carries a body: its type, and where its coordinates lie in q and v. */
typedef struct kt_coordinates {
    kt_joint_type type;
    int q, nq; /* first position, count */
    int v, nv; /* first velocity, count */
} kt_coordinates;

KT_API kt_coordinates kt_body_coordinates(const kt_model *model, int body);

/* Markers of a body. */
KT_API int kt_marker_count(const kt_model *model, int body);
KT_API const char *kt_marker_name(const kt_model *model, int body, int marker);
KT_API kt_vec3 kt_marker_at(const kt_model *model, int body, int marker);
KT_API int kt_marker_find(const kt_model *model, int body, const char *name);

/* The initial state of the description: q (nq), v (nv). */
KT_API void kt_model_initial(const kt_model *model, double *q, double *v);

/* The instruction set that the recursions use. */
KT_API kt_level kt_model_level(const kt_model *model);

/* What the recursions sweep: "planar" or "spatial" trees, or "mixed": some of each. */
KT_API const char *kt_model_plan(const kt_model *model);

/* Gravity, world frame, m/s^2. */
KT_API kt_vec3 kt_model_gravity(const kt_model *model);

/* ---- the workspace ----------------------------------------------------------------------------------------------- */

enum { KT_ALIGNMENT = 64 };

/* Bytes that the data of a model take; KT_ALIGNMENT is the alignment that they need. */
KT_API size_t kt_data_size(const kt_model *model);

/* Lays the data out in the caller's memory, which must stay there while the data are used. Refuses memory that is too
 * small or misaligned with KT_ERROR_MEMORY. The data are scratch: what a call leaves there is read only by the calls
 * whose docstrings say so. */
KT_API KT_CHECKED kt_status kt_data_place(const kt_model *model, void *memory, size_t size, kt_data **data,
                                          kt_error *error);

/* The same in memory of its own, released with kt_data_free. */
KT_API KT_CHECKED kt_status kt_data_create(const kt_model *model, kt_data **data, kt_error *error);
KT_API void kt_data_free(kt_data *data);

/* How far iterations have gone with these data. Each of them has a cap (reduction.h), and none goes beyond it. */
typedef struct kt_iterations {
    uint32_t
        position; /* the most steps that a projection has taken to close positions: at most KT_POSITION_STEPS_MAX */
    uint32_t velocity; /* ... and velocities: at most KT_VELOCITY_STEPS_MAX */
    uint32_t assembly; /* the most steps of an assembly: at most KT_ASSEMBLY_STEPS_MAX */
    uint32_t capped;   /* how often one of these ended at its cap, whether it had got there (what it leaves open is an
                          error) or not; or none of the states beside a singular position told the acceleration there */
} kt_iterations;

/* Since the data were placed or this was last asked. */
KT_API kt_iterations kt_data_iterations(kt_data *data);

#ifdef __cplusplus
}
#endif
#endif
