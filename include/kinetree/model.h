/* The immutable model that is compiled from a description, and its workspace.
 *
 * The caller fills a kt_description (description.h). The function kt_model_compile checks, orders and arranges the
 * description. The description and its strings may be released afterwards. A model may be shared between threads; each
 * thread has its own kt_data.
 *
 * Units are SI units and radians. Body 0 is the world. Queries take the indices of bodies, markers and loops that these
 * calls return. For other indices they return NULL, -1, 0 or NaN. Queries allocate nothing and cannot fail; their cost
 * is O(1) unless another cost is given. Names are valid as long as the model.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_MODEL_H
#define KINETREE_MODEL_H

#include "kinetree/description.h"

#include <stddef.h>
#include <stdint.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the model --------------------------------------------------------------------------------------------------- */

/* A compiled mechanism. A model is immutable unless its options make it settable, so that threads may share the
 * model. */
typedef struct kt_model kt_model;
/* The workspace of one thread with a model. */
typedef struct kt_data kt_data;

/* Instruction sets of the recursions. All instruction sets give the same numbers to the last bit. */
typedef enum kt_isa {
    KT_ISA_AUTO = 0, /* the best set of the processor */
    KT_ISA_BASE,     /* the common set of all processors of this kind */
    KT_ISA_V3,       /* x86-64-v3, AVX2; not on other processors */
    KT_ISA_V4,       /* x86-64-v4, AVX-512 */
} kt_isa;

/* A method that solves the equations of loops: QR decomposition with column pivoting, or an object of another library
 * (kt_reduction_method_of in study.h). */
typedef struct kt_reduction_method kt_reduction_method;

/* The norm that is minimal when a state is projected onto the constraint manifold. */
typedef enum kt_metric {
    KT_METRIC_IDENTITY = 0 /* norm of the change of coordinates */,
    KT_METRIC_MASS /* kinetic energy of this change */
} kt_metric;

/* The reduction of loops that share coordinates. The results differ only by rounding. */
typedef enum kt_structure {
    KT_STRUCTURE_AUTO = 0, /* link by link if this takes less time than dense matrices */
    KT_STRUCTURE_DENSE,    /* one dense matrix; the cost rises with the cube of the coordinates */
    KT_STRUCTURE_FRONTS,   /* link by link, with dense matrices for the dependence on the remaining links */
} kt_structure;

/* Forms of the elimination of a constraint group. The forms from FRONT on eliminate link by link. X(id, name) */
#define KT_GROUP_FORM_LIST(X)                                                                                          \
    X(KT_FORM_DENSE, dense)       /* one dense QR decomposition, and Maggi-Kane */                                     \
    X(KT_FORM_PIN, pin)           /* three coordinates in a plane and one pin: closed form */                          \
    X(KT_FORM_FRONT, front)       /* frontal elimination */                                                            \
    X(KT_FORM_FRONT4, front4)     /* the same in registers, in a plane, with four parameters or fewer */               \
    X(KT_FORM_DELASSUS, delassus) /* range space, of few equations on many links */

/* The form of a constraint group. kt_model_compile chooses the form; all forms give the same results except for
 * rounding. */
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

/* The kernels for trees that move in a plane. All joints of such a tree are revolute about one direction or prismatic
 * normal to it. These trees are computed in the plane (auto), or in space like all other trees (spatial). The results
 * differ only by rounding. */
typedef enum kt_plan {
#define KT_PLAN_ENUM(id, name) id,
    KT_PLAN_LIST(KT_PLAN_ENUM)
#undef KT_PLAN_ENUM
        KT_PLAN_COUNT /* how many */
} kt_plan;

/* A hard contact without friction, a stop and a slack rope have a switch each. A hard contact with friction and
 * friction of a joint that sticks have two. With at most this many switches, each set of contacts has a compiled model.
 * With more switches, a simulation derives the model of a set from two compiled models, so that memory grows linearly
 * with the number of contacts. */
enum { KT_CONTACT_SWITCHES = 2 /* switches of contacts */ };

/* Options of the compilation of a description. */
typedef struct kt_model_options {
    size_t size;                          /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    kt_isa isa;                           /* instruction set of the recursions; results have the same bits with each
                                           * set */
    const kt_reduction_method *reduction; /* reduction of loops; must outlive the model. NULL: QR decomposition */
    kt_metric metric;                     /* metric of projections */
    kt_plan plan;                         /* plan for trees that move in a plane */
    kt_structure structure;               /* structure of the reduction by QR; other methods are dense */
    unsigned excluded_forms;              /* bits 1 << kt_group_form of forms that are not chosen, for comparisons;
                                           * DENSE remains */
    bool settable;                        /* its parameters may be set, as in a copy (kt_parameter_set). The model
                                           * then serves one simulation, or the data of one thread */
    int contact_switches;                 /* up to so many switches of hard contacts, each set of these has a compiled
                                           * model (kt_model_switched): 2^n models. At most KT_SWITCH_MAX; at least,
                                           * and by default, KT_CONTACT_SWITCHES */
} kt_model_options;

/* Returns the defaults: auto, QR decomposition, identity, auto, auto, none excluded, not settable, no more models of
 * contacts than usual. */
static inline kt_model_options kt_model_options_default(void) {
    kt_model_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Checks, orders and compiles a description. In the core library only this call, the checks of descriptions, the
 * _create calls and kt_spectrum_along allocate memory. The argument options may be NULL.
 * Ownership: the caller releases *model with kt_model_free.
 * Errors: KT_ERROR_MEMORY. KT_ERROR_MODEL for the first fault of kt_description_check or kt_model_check, with its
 * location and a remedy. KT_ERROR_ARGUMENT (an option is out of its range, or model is NULL). KT_ERROR_UNSUPPORTED (an
 * instruction set that this processor does not have). *model is untouched on failure.
 * Cost: O(size), and an assembly (kt_state_assemble) if springs in loops start unstretched. */
KT_API KT_CHECKED kt_status kt_model_compile(const kt_description *description, const kt_model_options *options,
                                             kt_model **model, kt_error *error);
/* Checks for faults of the mechanism as a whole. Such a fault is a joint that moves no inertia along one of its degrees
 * of freedom. The joint is accepted if a loop may constrain or drive the bodies on the joint. A loop within one rigid
 * part is also a fault. The function calls report (may be NULL) for every fault, in the order of the description. If
 * kt_description_check finds faults, kt_model_check reports only faults that do not follow from these. If these faults
 * leave the tree undetermined, kt_model_check reports none. The function allocates the same memory as a compilation.
 * Errors: KT_ERROR_MODEL with the first fault in *error; KT_ERROR_ARGUMENT (NULL), KT_ERROR_MEMORY.
 * Cost: O(size). */
KT_API KT_CHECKED kt_status kt_model_check(const kt_description *description, kt_report *report, void *user,
                                           kt_error *error);

/* Releases a model that kt_model_compile made; does nothing with a copy, nor with NULL. */
KT_API void kt_model_free(kt_model *model);

/* Returns the number of bytes of the model. */
KT_API size_t kt_model_size(const kt_model *model);

/* Copies a model into the caller's memory, at KT_ALIGNMENT. The copy is self-contained: the original may be released.
 * Equal inputs give equal bits with both. A copy may be copied; kt_model_free does nothing with a copy.
 * Ownership: the caller provides kt_model_size(model) bytes, for example static ones. This memory must stay at its
 * address while the copy is used.
 * Errors: KT_ERROR_MEMORY (too small or misaligned; *copy and the memory are then untouched).
 * Cost: O(size). */
KT_API KT_CHECKED kt_status kt_model_copy(const kt_model *model, void *memory, size_t size, kt_model **copy,
                                          kt_error *error);

/* Return the numbers of bodies (including the world), of positions, and of velocities. */
KT_API int kt_model_body_count(const kt_model *model);
KT_API int kt_model_nq(const kt_model *model);
KT_API int kt_model_nv(const kt_model *model);

/* Return the name of the model, and the name, parent and mass (kg) of a body. Bodies are in the order of the
 * description, except that a parent precedes its children. Body 0 is the world. */
KT_API const char *kt_model_name(const kt_model *model);
KT_API const char *kt_body_name(const kt_model *model, int body);
KT_API int kt_body_parent(const kt_model *model, int body);
KT_API double kt_body_mass(const kt_model *model, int body);
/* Returns the index of a body, or -1 if there is no body with this name.
 * Cost: O(1). */
KT_API int kt_body_find(const kt_model *model, const char *name);

/* Returns the name of the joint that carries a body: the name of the joint if given, else the name of the body. */
KT_API const char *kt_joint_name(const kt_model *model, int body);
/* Writes the index of the body that the joint with this name carries. A joint with its own name is found only under
 * this name.
 * Errors: KT_ERROR_ARGUMENT (NULL, or there is no such joint). The message suggests the nearest name.
 * Cost: O(1). */
KT_API KT_CHECKED kt_status kt_joint_find(const kt_model *model, const char *name, int *body, kt_error *error);
/* Returns the limits that the description gives the joint which carries a body; infinite if there are none. */
KT_API kt_joint_limits kt_joint_limits_of(const kt_model *model, int body);

/* Returns the index of a body in the description's array; -1 for the world. */
KT_API int kt_body_source(const kt_model *model, int body);

/* The joint that carries a body: its type, and the position of its coordinates in q and v. */
typedef struct kt_coordinates {
    kt_joint_type type; /* type of the joint */
    int q, nq;          /* index of the first position in q, and number of positions */
    int v, nv;          /* index of the first velocity in v, and number of velocities */
} kt_coordinates;

/* Returns the coordinates of a body, 0 <= body < kt_model_body_count. */
KT_API kt_coordinates kt_body_coordinates(const kt_model *model, int body);
/* Returns the body whose joint has the velocity coordinate v. Coordinates are counted as columns of Jacobians and mass
 * matrices. The result satisfies 0 <= v - kt_body_coordinates(...).v < nv. Returns -1 unless 0 <= v < kt_model_nv.
 * Cost: O(log bodies). */
KT_API int kt_velocity_body(const kt_model *model, int v);

/* Return the markers of a body, in the order of the description: their number, names, origins (m) and axes. The
 * function kt_marker_find returns the index of a marker, or -1 if there is no marker with this name. The function
 * kt_marker_pose (control.h) returns poses in the world.
 * Frame: body frame. */
KT_API int kt_marker_count(const kt_model *model, int body);
KT_API const char *kt_marker_name(const kt_model *model, int body, int marker);
KT_API kt_vec3 kt_marker_at(const kt_model *model, int body, int marker);
KT_API kt_mat3 kt_marker_rotation(const kt_model *model, int body, int marker);
KT_API int kt_marker_find(const kt_model *model, int body, const char *name);

/* Writes the initial state of the description: q (nq) and v (nv), either of which may be NULL. Its loops may be open
 * (kt_state_assemble).
 * Cost: O(nq). */
KT_API void kt_model_initial(const kt_model *model, double *q, double *v);

/* Returns the instruction set of the recursions. */
KT_API kt_isa kt_model_isa(const kt_model *model);

/* Returns the kind of trees that the recursions compute: "planar", "spatial", or "mixed" if there are both. */
KT_API const char *kt_model_plan(const kt_model *model);

/* Returns the gravity.
 * Units: m/s^2.
 * Frame: world frame. */
KT_API kt_vec3 kt_model_gravity(const kt_model *model);

/* The influence of effects and loops on the energy of a mechanism, kinetic and potential (kt_kinetic_energy,
 * kt_potential_energy, kt_effect_energy). */
typedef enum kt_energetics {
    KT_ENERGY_CONSERVED = 0, /* the energy is constant */
    KT_ENERGY_DISSIPATED,    /* the energy can only decrease: damping, friction, drag */
    KT_ENERGY_SUPPLIED,      /* the energy can increase: forces, torques, motors, effects of the caller, loops that
                              * change with time */
} kt_energetics;

/* Returns the energetics of a model, without torques and wrenches that the caller sets. If loops or effects are
 * switched, the result covers all sets and the switching itself.
 * Cost: O(effects). */
KT_API kt_energetics kt_model_energetics(const kt_model *model);

/* ---- loops and effects that are switched ---------------------------------------------------------------------------
 *
 * Loops and effects with `switching` in their description can be switched on and off while a program runs. Examples are
 * feet in stance and swing, clutches, and ropes that are released. Each set of active switches has its own model. All
 * these models are compiled at once, with the same bodies, coordinates and indices of loops and effects. Each model
 * equals, to the last bit, the compilation of a description without the other loops and effects, and has the same cost.
 * A loop that is off has no equations (kt_loop_rows_of is empty), zero reactions, and costs nothing. To switch, select
 * another model and initialise the data for this model. Nothing is allocated.
 *
 * A switch has an index, 0 <= k < kt_switch_count: loops first, then effects, each in the order of the description. A
 * set is a number with the bits 1 << k of the switches that are on. With more than 62 switches, hard contacts and stops
 * come last. These share two bits: bit 62 is set if any of these is closed, bit 63 if all are closed.
 *
 * Velocities before a loop is switched on need not be consistent with it; kt_velocity_impact (mechanism.h) makes them
 * consistent. For positions, kt_state_project closes gaps that are no larger than after a step. */

/* Returns the number of loops and effects that may be switched; 0 for NULL. */
KT_API int kt_switch_count(const kt_model *model);
/* Returns the name of a switch; NULL unless 0 <= k < kt_switch_count; "" for an effect without a name. */
KT_API const char *kt_switch_name(const kt_model *model, int k);
/* Return the switch of a loop, and of an effect; -1 for a loop or an effect that is always on. */
KT_API int kt_loop_switch(const kt_model *model, int loop);
KT_API int kt_effect_switch(const kt_model *model, int effect);
/* Returns the bits of switch k in a set: 1 << k, or the two bits that contacts share; 0: there is no such switch. */
KT_API uint64_t kt_switch_bits(const kt_model *model, int k);
/* Returns the set of switches that are on in this model. The model that kt_model_compile returns has the set of the
 * description. */
KT_API uint64_t kt_switch_set(const kt_model *model);
/* Returns the model with another set, in the same block of memory; NULL if there is none. With more switches of
 * contacts than kt_model_options.contact_switches, only a simulation has models for some sets of contacts. The function
 * kt_model_free releases all models at once, kt_model_copy copies all, kt_model_size counts all, and kt_parameter_set
 * sets all.
 * Cost: O(1). */
KT_API const kt_model *kt_model_switched(const kt_model *model, uint64_t set);

/* Switches a loop on or off: *model becomes the model with or without the loop. The data, made for any of these models,
 * are initialised for the new model (data may be NULL). Counts of iterations continue. Nothing is allocated.
 * Errors: KT_ERROR_ARGUMENT (the loop does not exist or is always on, or the data belong to another mechanism). Model
 * and data are then untouched.
 * Cost: the data are cleared. */
KT_API KT_CHECKED kt_status kt_loop_set_on(const kt_model **model, kt_data *data, int loop, bool on, kt_error *error);
/* Switches an effect on or off, like kt_loop_set_on. */
KT_API KT_CHECKED kt_status kt_effect_set_on(const kt_model **model, kt_data *data, int effect, bool on,
                                             kt_error *error);

/* ---- the workspace ----------------------------------------------------------------------------------------------- */

/* The alignment of the caller's memory: addresses are multiples of this number. */
enum { KT_ALIGNMENT = 64 /* bytes */ };

/* Returns the number of bytes of the data of a model. If loops or effects are switched, this is the maximum over all
 * models. */
KT_API size_t kt_data_size(const kt_model *model);

/* Initialises data in the caller's memory. The data are scratch. A call reads results of an earlier call from the data
 * only if its docstring states this.
 * Ownership: the memory must stay at its address while the data are used.
 * Errors: KT_ERROR_MEMORY if the memory is too small or misaligned. */
KT_API KT_CHECKED kt_status kt_data_init(const kt_model *model, void *memory, size_t size, kt_data **data,
                                         kt_error *error);

/* Initialises data like kt_data_init, in memory of their own.
 * Ownership: the caller releases the data with kt_data_free. */
KT_API KT_CHECKED kt_status kt_data_create(const kt_model *model, kt_data **data, kt_error *error);
/* Releases data that kt_data_create made; does nothing with data in the caller's memory, nor with NULL. */
KT_API void kt_data_free(kt_data *data);

/* Counts of iterations with these data. Each iteration has a limit (reduction.h). */
typedef struct kt_iterations {
    uint32_t
        position; /* the largest number of steps of a projection to close positions: at most KT_POSITION_STEPS_MAX */
    uint32_t velocity; /* likewise for velocities: at most KT_VELOCITY_STEPS_MAX */
    uint32_t assembly; /* the largest number of steps of an assembly: at most KT_ASSEMBLY_STEPS_MAX */
    uint32_t capped;   /* number of iterations that ended at their limit, converged or not (if not, the call returns
                        * an error). Includes accelerations at a singular position that could not be interpolated */
} kt_iterations;

/* Returns the counts since the data were initialised or this function was last called. */
KT_API kt_iterations kt_data_iterations(kt_data *data);

/* Statistics of accelerations near singular positions of loops, where an equation is about to depend on the others. */
typedef struct kt_crossings {
    uint64_t near;         /* accelerations that were computed near such positions */
    uint64_t interpolated; /* accelerations of these that were interpolated along the motion */
    double error;          /* the largest estimated drift of the motion near such a position that results from the
                            * error of an acceleration, relative to a radian or to the length of the longest loop */
    double smallest;       /* the smallest size of a direction of the equations in these accelerations, if there are
                            * any, relative to its usual size */
    double bend;  /* the shortest time, s, within which the path was found to bend away from such a position; 0: no
                   * bend. A longer step misses the bend */
    double since; /* time of the first of these accelerations, s; without meaning if there is none */
} kt_crossings;

/* Returns the statistics since the data were initialised or this function was last called. */
KT_API kt_crossings kt_data_crossings(kt_data *data);

/* Returns the error of derivatives that are found by differences, for effects of the caller that give none
 * (kt_model_is_differenced). The result is the largest estimated error of a column, relative to the largest number of
 * the column. The estimate covers the time since the data were initialised or this function was last called. A result
 * of 0 means exact to rounding. A result above 1e-6 means that no step was good enough. The force jumps, has a kink, or
 * changes within 1e-5 rad or m or their rates. In this case, supply the derivatives of the force (effect.h). Returns
 * NaN without data. */
KT_API double kt_data_difference_error(kt_data *data);

/* ---- parameters ---------------------------------------------------------------------------------------------------
 *
 * Numbers of a mechanism that may change while a program runs: payloads, gravity, springs, dampers, friction, rotors,
 * targets.
 *
 * A compiled model is immutable, unless its options make it settable. A program changes parameters in a copy of the
 * model (kt_model_copy), in the caller's memory, with one copy for each thread. The program finds a parameter by its
 * name once, and sets the parameter in a copy any number of times, without allocation. Data of the original also serve
 * its copies. A parameter that is never set costs nothing: a copy is a model like any other.
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
 * | BODY.mass | 1: kg; com and inertia are unchanged, also if they came from a shape |
 * | BODY.com | 3: body frame, m |
 * | BODY.inertia | 6: xx, yy, zz, xy, xz, yz about the com, body axes, kg m^2 |
 * | BODY.armature | as many as its joint has velocities: kg m^2 or kg |
 * | BODY.hold | 1: not 0 if assembly keeps the joint (`hold` of a description) |
 * | effect NAME.KEY | a number of an effect (stiffness, damping, length, coulomb ...) under its key; of a bushing six |
 * | effect NAME.KEY | function of time (rest, target, torque): 4 numbers, as of a loop; value of a force or torque: 3 |
 * | loop NAME.KEY | function of time (position, length, offset): 4 numbers, see below |
 * | loop NAME.place | 6: place of an end: its point, m, and the rotation vector of its frame, rad |
 *
 * A function of time is replaced by x + v s + a s^2 / 2 with s = t - t0. The numbers are x, v, a, t0: position,
 * velocity and acceleration at the time t0, and the time t0 itself. The function continues in this form until the next
 * setting. A distance must be > 0 at t0.
 *
 * The place of a loop belongs to the end on the world, and is in world axes. If both ends are on moving bodies, the
 * place belongs to the second end, and is in the frame of its body. The frame that the rotation vector turns has its z
 * axis along the loop's `axis`. Loops that bound a side have no place. Screws and homokinetic joints count an angle
 * from the start, and have none, either. In a model that is computed in a plane, places stay in that plane.
 * kt_loop_place_here returns the place that a foot has at the moment: a foothold, or the grip of a gripper.
 *
 * Decisions of the compilation remain: the plan, the structural ranks, and the sizes below which inertias count as
 * none. Every number is checked as in a description. Relations to other numbers are checked, too. For lower < upper,
 * first set the number that widens the interval. An effect may be disabled with its numbers: a servo without gains, a
 * stop at infinity.
 *
 * Derivatives with respect to a parameter follow from the equations of motion r(q, v, a; p) = 0 (kt_dynamics_inverse,
 * minus forces of effects). These equations are linear in gravity, mass, inertia and armature, and in the stiffnesses,
 * dampings and coefficients of friction of effects. The equations are quadratic in com. The difference (r(p + d) - r(p
 * - d)) / 2d, with d of the size of p, is therefore exact up to rounding. The function kt_step_parameter_derivatives
 * (sensitivity.h) gives the derivatives of a whole step. */

/* The largest number of numbers of a parameter. */
enum { KT_PARAMETER_MAX = 6 /* numbers */ };

/* The owner of a parameter. */
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
    KT_PARAMETER_LOOP_PLACE,   /* place of a loop's end */
} kt_parameter_kind;

struct kt_key;

/* A parameter, as kt_parameter_find returns it; the same for a model and all its copies. */
typedef struct kt_parameter {
    kt_parameter_kind kind;   /* owner of the parameter */
    int item;                 /* body, effect or loop */
    int count;                /* number of its numbers */
    const struct kt_key *key; /* key of an effect or loop (descriptor.h); NULL for other owners */
} kt_parameter;

/* Finds a parameter by its name.
 * Errors: KT_ERROR_ARGUMENT for a name that does not exist; the message has the nearest name.
 * Cost: O(effects + loops). */
KT_API KT_CHECKED kt_status kt_parameter_find(const kt_model *model, const char *name, kt_parameter *parameter,
                                              kt_error *error);

/* Writes the present numbers of a parameter to values (parameter->count). For a function of time that has not been set,
 * the numbers are its value and rates at the time 0, and 0.
 * Errors: KT_ERROR_ARGUMENT for a parameter that this model does not have, such as one of another model.
 * Cost: O(1). */
KT_API KT_CHECKED kt_status kt_parameter_get(const kt_model *model, const kt_parameter *parameter, double *values,
                                             kt_error *error);

/* Sets the numbers of a parameter (parameter->count) in a copy of a model, or in a settable model. The result has the
 * same bits as a model that is compiled with these numbers, except that several bodies on one link may be added up in
 * another order. No call may use data with the copy at the same time. While a simulation runs on the copy, use
 * kt_simulation_set_parameter instead. Checkpoints do not contain parameters, so that a program must set parameters
 * again before it resumes a run.
 * Errors: KT_ERROR_ARGUMENT (the model is not a copy, or does not have this parameter). KT_ERROR_MODEL (an invalid
 * number, reported as for a description). The copy is unchanged on failure.
 * Cost: O(1); O(bodies) for mass, com and inertia of a body; O(links) for armature. */
KT_API KT_CHECKED kt_status kt_parameter_set(kt_model *copy, const kt_parameter *parameter, const double *values,
                                             kt_error *error);

/* Writes the numbers of `loop NAME.place` with which the ends of a loop coincide at the positions of the last
 * kt_kinematics_update ("weld here"). Then the equations of welds, hinges and pins are satisfied. Thus a loop can hold
 * a foot at its present position:
 *
 *     double here[KT_PARAMETER_MAX];
 *     status = kt_kinematics_update(model, data, kt_simulation_positions(simulation), NULL, NULL, &error);
 *     status = kt_loop_place_here(model, data, kt_loop_find(model, "foot"), here, &error);
 *
 * Then kt_simulation_set_parameter sets the place, and kt_simulation_set_switches switches the loop on.
 * Shape: values has 6 numbers.
 * Errors: KT_ERROR_ARGUMENT (the loop does not exist or has no place, the data belong to another model, or the
 * kinematics are not available). `values` is then unchanged.
 * Cost: O(1). */
KT_API KT_CHECKED kt_status kt_loop_place_here(const kt_model *model, const kt_data *data, int loop, double *values,
                                               kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
