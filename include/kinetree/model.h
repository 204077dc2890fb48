/* The immutable model that is compiled from a description, and the workspace that goes with it.
 *
 * The caller fills a kt_description (description.h), kt_model_compile checks it, orders it and lays it out. The
 * description and its strings may be released afterwards. A model may be shared between threads; each thread has its
 * own kt_data.
 *
 * SI units and radians. Body 0 is the world. Queries take indices of bodies, markers, loops as these calls give them; for
 * others they return NULL, -1, 0 or NaN. They are O(1) where they do not say otherwise, allocate nothing and cannot
 * fail. Names live as long as the model.
 */
#ifndef KINETREE_MODEL_H
#define KINETREE_MODEL_H

#include "kinetree/description.h"
#include "kinetree/descriptor.h"

#include <stddef.h>
#include <stdint.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the model --------------------------------------------------------------------------------------------------- */

/* A compiled mechanism: immutable, so that threads may share it. */
typedef struct kt_model kt_model;
/* The workspace of one thread with a model. */
typedef struct kt_data kt_data;

/* Instruction sets that the recursions are built for. The same numbers come out of each, to the last bit. */
typedef enum kt_isa {
    KT_ISA_AUTO = 0, /* the best that the processor has */
    KT_ISA_BASE,     /* what every processor of its kind has */
    KT_ISA_V3,       /* x86-64-v3, AVX2; not on other processors */
    KT_ISA_V4,       /* x86-64-v4, AVX-512 */
} kt_isa;

/* How the equations of loops are solved: by QR decomposition with column pivoting, or as an object of another library
 * says (kt_reduction_method_of in study.h). */
typedef struct kt_reduction_method kt_reduction_method;

/* The norm that is least when a state that has left the constraint manifold is projected onto it. */
typedef enum kt_metric {
    KT_METRIC_IDENTITY = 0 /* of the change of coordinates */,
    KT_METRIC_MASS /* its kinetic energy */
} kt_metric;

/* How loops that share coordinates are reduced. The results differ by rounding only. */
typedef enum kt_structure {
    KT_STRUCTURE_AUTO = 0, /* link by link, where that takes fewer operations than dense matrices */
    KT_STRUCTURE_DENSE,    /* as one dense matrix; the cost rises with the cube of the coordinates */
    KT_STRUCTURE_FRONTS,   /* link by link, with dense matrices of what the links still to come depend on */
} kt_structure;

/* Forms in which a constraint group is eliminated; those from FRONT on go link by link. X(id, name) */
#define KT_GROUP_FORM_LIST(X)                                                                                          \
    X(KT_FORM_DENSE, dense)       /* one dense QR decomposition, and Maggi-Kane */                                     \
    X(KT_FORM_PIN, pin)           /* three coordinates in a plane and one pin: closed form */                          \
    X(KT_FORM_FRONT, front)       /* frontal elimination */                                                            \
    X(KT_FORM_FRONT4, front4)     /* the same in registers, in a plane, with four parameters or fewer */               \
    X(KT_FORM_DELASSUS, delassus) /* range space, of few equations on many links */

/* The form of a constraint group: the compiler chooses it; all give the same results but for rounding. */
typedef enum kt_group_form {
#define KT_GROUP_FORM_ENUM(id, name) id,
    KT_GROUP_FORM_LIST(KT_GROUP_FORM_ENUM)
#undef KT_GROUP_FORM_ENUM
        KT_GROUP_FORM_COUNT /* how many */
} kt_group_form;

/* Plans. X(id, name in scene files) */
#define KT_PLAN_LIST(X)                                                                                                \
    X(KT_PLAN_AUTO, auto)       /* trees that move in a plane are computed in it */                                    \
    X(KT_PLAN_SPATIAL, spatial) /* all trees are computed in space */

/* How trees that move in a plane are computed, all their joints being revolute about one direction or prismatic normal
 * to it: in the plane (auto), or like all others (spatial). The results differ by rounding only. */
typedef enum kt_plan {
#define KT_PLAN_ENUM(id, name) id,
    KT_PLAN_LIST(KT_PLAN_ENUM)
#undef KT_PLAN_ENUM
        KT_PLAN_COUNT /* how many */
} kt_plan;

/* How a description is compiled. */
typedef struct kt_model_options {
    size_t size;                          /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    kt_isa isa;                           /* of the recursions; results have the same bits with each */
    const kt_reduction_method *reduction; /* of loops; must outlive the model. NULL: by QR decomposition */
    kt_metric metric;                     /* of projections */
    kt_plan plan;                         /* of trees that move in a plane */
    kt_structure structure;               /* of the reduction by QR; the others are dense */
    unsigned excluded_forms;              /* bits 1 << kt_group_form that are not chosen: to compare; DENSE stays */
    bool settable;                        /* its parameters may be set, as those of a copy (kt_parameter_set): it then
                                             serves one simulation, or data of one thread */
} kt_model_options;

/* auto, by QR decomposition, identity, auto, auto, none excluded, not settable. */
static inline kt_model_options kt_model_options_default(void) {
    kt_model_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Checks, orders and compiles a description. *model is allocated and released with kt_model_free. Of the core
 * only this call, the checks of descriptions, the _create calls and kt_spectrum_along allocate. options may be NULL.
 * Errors: KT_ERROR_MEMORY; KT_ERROR_MODEL with what, where and how: the first fault of kt_description_check, or of
 * kt_model_check; KT_ERROR_ARGUMENT (an option out of its range; model is NULL); KT_ERROR_UNSUPPORTED (an instruction
 * set that this processor does not have). *model is then untouched. O(size), and an assembly (kt_state_assemble) where
 * springs in loops start unstretched. */
KT_API KT_CHECKED kt_status kt_model_compile(const kt_description *description, const kt_model_options *options,
                                             kt_model **model, kt_error *error);
/* The faults that show only in the mechanism as a whole: joints that move nothing with inertia along one of their
 * degrees of freedom, unless a loop may constrain or drive what they carry; loops within one rigid part. Calls report
 * (may be NULL) for every one, in the order of the description. If the description has faults of kt_description_check,
 * only those are reported that do not depend on them, and none if they leave the tree undetermined.
 * Returns KT_OK, or KT_ERROR_MODEL with the first in *error; KT_ERROR_ARGUMENT (NULL), KT_ERROR_MEMORY. Allocates what
 * a compilation does. O(size). */
KT_API KT_CHECKED kt_status kt_model_check(const kt_description *description, kt_report *report, void *user,
                                           kt_error *error);

/* Releases what kt_model_compile made; does nothing with a copy, nor with NULL. */
KT_API void kt_model_free(kt_model *model);

/* Bytes that the model takes. */
KT_API size_t kt_model_size(const kt_model *model);

/* A copy of a model in the caller's memory, at KT_ALIGNMENT: kt_model_size(model) bytes, static ones for example, which
 * must stay where they are while the copy is used. Nothing of it lies elsewhere: the original may be released. Equal
 * inputs give equal bits with both. A copy may be copied; kt_model_free does nothing with one.
 * Errors: KT_ERROR_MEMORY (too small or misaligned; *copy and the memory are then untouched). O(size). */
KT_API KT_CHECKED kt_status kt_model_copy(const kt_model *model, void *memory, size_t size, kt_model **copy,
                                          kt_error *error);

/* Number of bodies, the world included; of positions; of velocities. */
KT_API int kt_model_body_count(const kt_model *model);
KT_API int kt_model_nq(const kt_model *model);
KT_API int kt_model_nv(const kt_model *model);

/* Names, parents and masses, kg. Bodies come in the description's order, except that a parent precedes its children; 0
 * is the world. */
KT_API const char *kt_model_name(const kt_model *model);
KT_API const char *kt_body_name(const kt_model *model, int body);
KT_API int kt_body_parent(const kt_model *model, int body);
KT_API double kt_body_mass(const kt_model *model, int body);
/* The index of a body; -1 where there is none of that name. O(1). */
KT_API int kt_body_find(const kt_model *model, const char *name);

/* The name of the joint that carries a body: its own, or that of the body. */
KT_API const char *kt_joint_name(const kt_model *model, int body);
/* Writes the body that the joint of this name carries. A joint with a name of its own has that one alone.
 * Errors: KT_ERROR_ARGUMENT (NULL; there is no such joint, and the message suggests the nearest). O(1). */
KT_API KT_CHECKED kt_status kt_joint_find(const kt_model *model, const char *name, int *body, kt_error *error);
/* The limits that the description gives the joint which carries a body; infinite where there are none. */
KT_API kt_joint_limits kt_joint_limits_of(const kt_model *model, int body);

/* Where a body stood in the description's array; -1 for the world. */
KT_API int kt_body_source(const kt_model *model, int body);

/* The joint that carries a body: its type, and where its coordinates lie in q and v. */
typedef struct kt_coordinates {
    kt_joint_type type; /* of the joint */
    int q, nq;          /* first position in q, and how many */
    int v, nv;          /* first velocity in v, and how many */
} kt_coordinates;

/* Of a body, 0 <= body < kt_model_body_count. */
KT_API kt_coordinates kt_body_coordinates(const kt_model *model, int body);
/* The body whose joint velocity coordinate v belongs to, as the columns of Jacobians and mass matrices do: that with
 * 0 <= v - kt_body_coordinates(...).v < nv; -1 unless 0 <= v < kt_model_nv. O(log bodies). */
KT_API int kt_body_of_velocity(const kt_model *model, int v);

/* Markers of a body, in the order of the description: how many, their names, origins (m) and axes, both in the body
 * frame; the index of one, -1 where there is none of that name. kt_marker_pose (control.h) has them in the world. */
KT_API int kt_marker_count(const kt_model *model, int body);
KT_API const char *kt_marker_name(const kt_model *model, int body, int marker);
KT_API kt_vec3 kt_marker_at(const kt_model *model, int body, int marker);
KT_API kt_mat3 kt_marker_rotation(const kt_model *model, int body, int marker);
KT_API int kt_marker_find(const kt_model *model, int body, const char *name);

/* Writes the initial state as the description gives it: q (nq), v (nv), either of which may be NULL. Its loops may be
 * open (kt_state_assemble). O(nq). */
KT_API void kt_model_initial(const kt_model *model, double *q, double *v);

/* The instruction set that the recursions use. */
KT_API kt_isa kt_model_isa(const kt_model *model);

/* The trees that the recursions compute: "planar", "spatial", or "mixed", which has some of each. */
KT_API const char *kt_model_plan(const kt_model *model);

/* Gravity, world frame, m/s^2. */
KT_API kt_vec3 kt_model_gravity(const kt_model *model);

/* What the effects and loops of a mechanism can do to its energy, kinetic and potential (kt_kinetic_energy,
 * kt_potential_energy, kt_effect_energy). */
typedef enum kt_energetics {
    KT_ENERGY_CONSERVED = 0, /* it stays what it is */
    KT_ENERGY_DISSIPATED,    /* it can only fall: damping, friction, drag */
    KT_ENERGY_SUPPLIED,      /* it can rise: forces, torques, motors, effects of the caller's, loops that change with
                                time */
} kt_energetics;

/* Of a model, without torques and wrenches that the caller sets; where loops or effects are switched, of all their sets, and of
 * switching itself. O(effects). */
KT_API kt_energetics kt_model_energetics(const kt_model *model);

/* ---- loops and effects that are switched ---------------------------------------------------------------------------
 *
 * Loops and effects whose description says so (`switching`) can be switched on and off while a program runs: feet that
 * stand and swing, clutches, ropes that are let go. For each set of those that are on there is a model of its own; all
 * are compiled at once, with the same bodies, coordinates and indices of loops and effects. Each of these models is what
 * a description without the others would be compiled to, to the last bit, and costs what that costs: what is off has no
 * equations (kt_loop_rows_of has none), reactions of zero, and takes no instruction. Switching is taking another model,
 * and initialising the data for it; nothing is allocated.
 *
 * What is switched has an index, 0 <= k < kt_switch_count: loops first, then effects, each in the order of the
 * description. A set is a number with the bits 1 << k of those that are on.
 *
 * Velocities before a loop is switched on need not fit it: kt_velocity_impact (mechanism.h) makes them. Of positions,
 * kt_state_project closes what is open by no more than a step would leave.
 */

/* How many loops and effects may be switched; 0 of NULL. This and the next five calls are not in
 * a small library (-Dsmall=enabled). */
KT_API int kt_switch_count(const kt_model *model);
/* The name of one; NULL unless 0 <= k < kt_switch_count; "" of an effect without a name. */
KT_API const char *kt_switch_name(const kt_model *model, int k);
/* The switch of a loop, and of an effect; -1 of those that are always on. */
KT_API int kt_loop_switch(const kt_model *model, int loop);
KT_API int kt_effect_switch(const kt_model *model, int effect);
/* The set of those that are on in this model; kt_model_compile returns the model of the description's. */
KT_API uint64_t kt_switch_set(const kt_model *model);
/* The model with another set, in the same block of memory; NULL if there is none (of some of the contacts, if there are
 * more than KT_SWITCH_MAX switches, a simulation alone has one). kt_model_free releases all at once, kt_model_copy copies and kt_model_size counts all, and kt_parameter_set sets all. O(1). */
KT_API const kt_model *kt_model_switched(const kt_model *model, uint64_t set);

/* Switches a loop on or off: *model becomes the model with it or without it, and the data, made for any of these models,
 * are initialised for that one (data may be NULL). Counts of iterations go on. Errors: KT_ERROR_ARGUMENT (there is no
 * such loop, or it is always on; the data are of another mechanism); both are then untouched. Nothing is allocated. Cost:
 * the data are cleared. Not in a small library (-Dsmall=enabled). */
KT_API KT_CHECKED kt_status kt_loop_enable(const kt_model **model, kt_data *data, int loop, bool on, kt_error *error);
/* Likewise of an effect. */
KT_API KT_CHECKED kt_status kt_effect_enable(const kt_model **model, kt_data *data, int effect, bool on,
                                             kt_error *error);

/* ---- the workspace ----------------------------------------------------------------------------------------------- */

/* What the addresses of the caller's memory must be a multiple of. */
enum { KT_ALIGNMENT = 64 /* bytes */ };

/* Bytes that the data of a model take; where loops or effects are switched, of the model for which they take most. */
KT_API size_t kt_data_size(const kt_model *model);

/* Initialises data in the caller's memory, which must stay there while the data are used. Refuses memory that is too
 * small or misaligned with KT_ERROR_MEMORY. The data are scratch: what a call leaves there is read only by the calls
 * whose docstrings say so. */
KT_API KT_CHECKED kt_status kt_data_init(const kt_model *model, void *memory, size_t size, kt_data **data,
                                         kt_error *error);

/* The same in memory of its own, released with kt_data_free. */
KT_API KT_CHECKED kt_status kt_data_create(const kt_model *model, kt_data **data, kt_error *error);
/* Releases what _create made; does nothing with data in the caller's memory, nor with NULL. */
KT_API void kt_data_free(kt_data *data);

/* How many steps iterations have taken with these data. Each has a cap (reduction.h). */
typedef struct kt_iterations {
    uint32_t
        position; /* the most steps that a projection has taken to close positions: at most KT_POSITION_STEPS_MAX */
    uint32_t velocity; /* ... and velocities: at most KT_VELOCITY_STEPS_MAX */
    uint32_t assembly; /* the most steps of an assembly: at most KT_ASSEMBLY_STEPS_MAX */
    uint32_t
        capped; /* how often one of these ended at its cap, converged or not (if not, the call returns an error), or
                          the acceleration at a singular position could not be interpolated */
} kt_iterations;

/* Since the data were initialised or this was last called. */
KT_API kt_iterations kt_data_iterations(kt_data *data);

/* What accelerations near singular positions of loops were like, where an equation is about to depend on the others. */
typedef struct kt_crossings {
    uint64_t near;         /* accelerations that were computed near such positions */
    uint64_t interpolated; /* those of them that were interpolated along the motion */
    double error;    /* the largest estimated error: by how much that of an acceleration leads the motion off while
                              it is near the position, relative to a radian or to the length of the longest loop */
    double smallest; /* the smallest size of a direction of the equations, relative to its usual size; of these
                              accelerations, if there are any */
    double bend;  /* the shortest time, s, within which the path was seen to bend away from such a position; 0: it was
                    not. A longer step leaps over the bend */
    double since; /* the time of the first of these accelerations, s; of no meaning if there is none */
} kt_crossings;

/* Since the data were initialised or this was last called. */
KT_API kt_crossings kt_data_crossings(kt_data *data);

/* How coarse derivatives were that had to be found by differences, those of a caller's own effects that give none
 * (kt_model_is_differenced), since the data were initialised or this was last called: the largest estimated error of a
 * column, relative to the largest number of it. 0: they were exact to rounding. Above 1e-6 no step was good enough: the
 * force jumps, has a kink, or changes within 1e-5 rad or m or of their rates; give its derivatives (effect.h). NaN
 * without data. */
KT_API double kt_data_difference_error(kt_data *data);

/* ---- parameters ---------------------------------------------------------------------------------------------------
 *
 * Numbers of a mechanism that may change while a program runs: payloads, gravity, springs, dampers, friction, rotors,
 * targets.
 *
 * A compiled model is immutable, unless its options say that it is settable. What may change is a copy of it
 * (kt_model_copy), in the caller's memory, one a thread:
 * a parameter is found by its name once, and set in a copy as often as wanted, without allocation. Data of the original
 * serve its copies. Nothing is computed for a parameter that is never set: a copy is a model like any other.
 *
 *     const size_t size = kt_model_size(model);
 *     void *memory = aligned_alloc(KT_ALIGNMENT, size);
 *     kt_parameter payload;
 *     kt_model *own = NULL;
 *     status = kt_model_copy(model, memory, size, &own, &error);
 *     status = kt_parameter_find(model, "hand.mass", &payload, &error);
 *     status = kt_parameter_set(own, &payload, (double[]){2.5}, &error);
 *
 * | name | numbers |
 * |---|---|
 * | gravity | 3: world frame, m/s^2 |
 * | BODY.mass | 1: kg; com and inertia stay what they are, also where they came from a shape |
 * | BODY.com | 3: body frame, m |
 * | BODY.inertia | 6: xx, yy, zz, xy, xz, yz about the com, body axes, kg m^2 |
 * | BODY.armature | as many as its joint has velocities: kg m^2 or kg |
 * | BODY.hold | 1: not 0 if assembly keeps the joint (`hold` of a description) |
 * | effect NAME.KEY | a number of an effect (stiffness, damping, length, coulomb ...) under its key; of a bushing six |
 * | effect NAME.KEY | a function of time (rest, target, torque): 4 numbers, as of a loop; value of a force or torque: 3 |
 * | loop NAME.KEY | a function of time (position, length, offset): 4 numbers, see below |
 *
 * A function of time is replaced by x + v s + a s^2 / 2 with s = t - t0, from the numbers x, v, a, t0: position,
 * velocity and acceleration at the time t0 and, between two settings, what follows from them. (A distance must be > 0
 * at t0.)
 *
 * What is decided when a model is compiled stays: the plan, the structural ranks, and the sizes below which inertias
 * count as none. Every number is checked as in a description, and so is what must hold between it and the others (lower
 * < upper: set first what widens). An effect may be set to nothing: a servo without gains, a stop at infinity.
 * Derivatives with respect to a parameter: the equations of motion r(q, v, a; p) = 0 (kt_dynamics_inverse, minus forces
 * of effects) are linear in gravity, mass, inertia, armature and in the stiffnesses, dampings and coefficients of
 * friction of effects, and quadratic in com, so that (r(p + d) - r(p - d)) / 2d, with d of the size of p, is exact up
 * to rounding. Those of a whole step: kt_step_parameter_derivatives (sensitivity.h).
 */

/* The most numbers that a parameter has. */
enum { KT_PARAMETER_MAX = 6 /* numbers */ };

/* What a parameter belongs to. */
typedef enum kt_parameter_kind {
    KT_PARAMETER_GRAVITY = 0,  /* the gravity of all */
    KT_PARAMETER_MASS,         /* mass of a body */
    KT_PARAMETER_COM,          /* centre of mass of a body */
    KT_PARAMETER_INERTIA,      /* inertia of a body */
    KT_PARAMETER_ARMATURE,     /* rotor inertias of a body's joint */
    KT_PARAMETER_HOLD,         /* whether assembly keeps a body's joint */
    KT_PARAMETER_EFFECT,       /* one number or six of an effect */
    KT_PARAMETER_EFFECT_CURVE, /* function of time of an effect */
    KT_PARAMETER_EFFECT_VALUE, /* components of a force or torque */
    KT_PARAMETER_LOOP_CURVE,   /* function of time of a loop */
} kt_parameter_kind;

/* A parameter, as kt_parameter_find returns it; the same for a model and all its copies. */
typedef struct kt_parameter {
    kt_parameter_kind kind; /* what it belongs to */
    int item;               /* body, effect or loop */
    int count;              /* of its numbers */
    const kt_key *key;      /* of an effect or loop; of others NULL */
} kt_parameter;

/* Finds a parameter by its name. Errors: KT_ERROR_ARGUMENT for a name that does not exist, with the nearest one.
 * O(effects + loops). */
KT_API KT_CHECKED kt_status kt_parameter_find(const kt_model *model, const char *name, kt_parameter *parameter,
                                              kt_error *error);

/* The present numbers of a parameter into values (parameter->count). Of a function of time that has not been set: its
 * value and rates at the time 0, and 0. Errors: KT_ERROR_ARGUMENT for a parameter that this model has not, such as one
 * of another model. O(1). */
KT_API KT_CHECKED kt_status kt_parameter_get(const kt_model *model, const kt_parameter *parameter, double *values,
                                             kt_error *error);

/* Sets the numbers of a parameter (parameter->count) in a copy of a model, or in one that is settable. Equal numbers give the bits of a model that
 * was compiled with them, except that several bodies on one link may add up in another order. No data may be in use by
 * a call with the copy meanwhile; while a simulation runs on it, kt_simulation_set_parameter serves instead.
 * Checkpoints do not contain parameters: set them again before a run is resumed. Errors: KT_ERROR_ARGUMENT (the model
 * is no copy, or has not this parameter), KT_ERROR_MODEL (a number that cannot be, told as for a description); the copy is then unchanged. O(1);
 * of a body's mass, com and inertia O(bodies); of armature O(links). */
KT_API KT_CHECKED kt_status kt_parameter_set(kt_model *copy, const kt_parameter *parameter, const double *values,
                                             kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
