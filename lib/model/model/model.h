/* The compiled model: arrays of records (record.h); and its workspace, the data. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_MODEL_H
#define KT_MODEL_MODEL_H

#include "base/arena.h"
#include "base/inner.h"
#include "base/names.h"
#include "base/require.h"
#include "model/joint_name.h"
#include "model/planar.h"
#include "model/record.h"

#include <stdint.h>

/* The numbers of positions and velocities of each type of joint. */
typedef struct kt_joint_size {
    int nq, nv;
} kt_joint_size;
KT_INNER extern const kt_joint_size kt_joint_sizes[KT_JOINT_TYPE_COUNT];

typedef struct kt_counts {
    size_t link, body, named_joint, limit, marker, q, v, angle, text, index;
    size_t loop, term, path, group, group_link, group_v, row, effect, number;
    size_t effect_off; /* effects that are switched off, behind the others */
    size_t slip;       /* hard contacts that slip */
    size_t loaded;     /* friction of joints from a load (evaluate/load_friction.c) */
    size_t load;       /* loops whose wrenches have parts that do no work (kt_loop_kind.load) */
    size_t slip_work;  /* bytes of the scratch memory with which their directions are found (evaluate/slip.c) */
    size_t island_side, island_v, island_row; /* the most of an island: contacts and stops, coordinates, equations */
    size_t stress;                            /* bytes of the self-stresses of redundant groups */
    size_t dense;                             /* numbers that the groups' matrices take in the data */
    size_t island;
    size_t entry; /* entries of the equations of all groups, each over the coordinates of its group (kt_loop_entries) */
    size_t batch, force_link, force_link_angle, variable, time_part, x;
    size_t path_point, path_link; /* for effects along paths: points, and links */
    size_t gravity;               /* variables of formulas that are gravity forces */
    size_t varying;               /* bodies whose mass is a function of time */
    size_t massless;              /* velocity coordinates that follow from the balance of forces */
    size_t front;                 /* links of groups, if any group is large enough for fronts */
    /* Links from `spatial` on are planar, and so are angles from `spatial_angle` on. The other links have `spatial_v`
     * velocities. The planar arrays have the length `planar`, with the ground as first entry; 0 if no link is planar.
     */
    size_t rest;        /* room for those that are rotated at rest, and screws */
    size_t articulated; /* links that have an entry among the articulated inertias, and the ground */
    size_t spatial, spatial_angle, spatial_v, planar, plane, planar_loop;
} kt_counts;

/* How many contacts of an island slip, at most. */
static inline size_t kt_slip_most(const kt_counts *n) { return n->island_side < n->slip ? n->island_side : n->slip; }

/* Returns the count of an array that only models with some of these need. */
static inline size_t kt_where(size_t some, size_t count) { return some ? count : 0; }

/* Sines and cosines are computed for eight angles at a time (algebra/sincos.h), from any index on. Seven entries are
 * therefore added at the end. */
#define KT_ANGLES(count) ((count) + 7)

/* Arrays of models and data that have bodies of variable mass; others, and libraries without, have none. */
#define KT_MODEL_MASS_FIELDS(X) X(kt_mass_record, varying, n->varying, "bodies whose mass is a function of time")
#define KT_DATA_MASS_FIELDS(X)                                                                                         \
    X(double, mass_time, kt_where(n->varying, 1), "time that masses are of where a call has none, an input")           \
    X(kt_model, instant, kt_where(n->varying, 1), "the model with the masses of an instant")                           \
    X(char, instant_links, kt_where(n->varying, kt_links_bytes(n)), "its links, and those at rest behind them")        \
    X(kt_planar_link, instant_planar, kt_where(n->varying, n->planar), "its planar links")                             \
    X(kt_body_record, instant_body, kt_where(n->varying, n->body), "its bodies")                                       \
    X(kt_wrench, mass_wrench, kt_where(n->varying, n->body), "wrenches on bodies, and what masses add by time")

/* Arrays of models and data in which coordinates move no mass (evaluate/quasi_static.c). */
#define KT_MODEL_STATIC_FIELDS(X)                                                                                      \
    X(int32_t, massless, n->massless,                                                                                  \
      "velocity coordinates that move no mass, each in place of one motion that does not")                             \
    X(double, massless_basis, n->massless * n->massless, "B: combinations of these, those that dampers resist first")  \
    X(double, massless_motion, n->massless * n->v, "N B: what moves with them while no mass does, nv x massless")
#define KT_DATA_STATIC_FIELDS(X)                                                                                       \
    X(double, balanced_q, kt_where(n->massless, n->q), "positions in which forces are balanced")                       \
    X(double, balanced_v, kt_where(n->massless, n->v), "velocities likewise")                                          \
    X(double, balance, kt_where(n->massless, 2 * n->q + 4 * n->v), "scratch: neighbouring states and accelerations")   \
    X(double, balance_matrix, n->massless * n->massless, "derivative of the residuals")                                \
    X(double, balance_residual, 2 * n->massless, "residuals, and those of a neighbouring state")                       \
    X(int, balance_pivot, n->massless, "of the factors of that matrix")

/* Bytes of the links of a model and of the array behind them. */
static inline size_t kt_links_bytes(const kt_counts *n) {
    return kt_arena_round(n->link * sizeof(kt_link)) + kt_arena_round(n->rest * sizeof(kt_link_rest));
}

/* Every array of a model: type, name, count, meaning. One list declares, measures and lays out. */
#define KT_MODEL_FIELDS(X)                                                                                             \
    X(kt_link, link, n->link, "elementary joints and what they carry")                                                 \
    X(kt_link_rest, rest, n->rest, "of the links that have one; this array follows that of the links")                 \
    X(kt_plane, plane, n->plane, "planes in which trees move")                                                         \
    X(kt_planar_link, planar, n->planar, "planar links as they lie in their planes; 0: the ground")                    \
    X(kt_planar_rest, planar_rest, n->planar, "planar links back to the world")                                        \
    X(kt_body_record, body, n->body, "the caller's bodies")                                                            \
    X(kt_joint_limits, limit, n->limit, "what joints were built for, of those that tell")                              \
    X(kt_marker_record, marker, n->marker, "named points, body by body")                                               \
    X(double, q0, n->q, "initial positions")                                                                           \
    X(double, v0, n->v + n->x, "initial velocities, and auxiliary states")                                             \
    X(double, armature, n->v, "rotor inertia of each degree of freedom")                                               \
    X(double, zero, n->v, "zeros, where a caller gives no velocities, accelerations or forces")                        \
    X(int32_t, angle, KT_ANGLES(n->angle), "positions that are angles, and zeros")                                     \
    X(int32_t, link_v, n->v, "velocity coordinates in the order of the links")                                         \
    X(kt_loop_record, loop, n->loop, "loops, in the description's order")                                              \
    X(kt_planar_loop, planar_loop, n->planar_loop, "loops as they lie in their planes, where links are planar")        \
    X(kt_term_record, term, n->term, "terms of relations between joints")                                              \
    X(int32_t, path, n->path, "links on the loops' paths")                                                             \
    X(kt_group, group, n->group, "groups of loops that share links")                                                   \
    X(int, group_loop, n->loop, "loops, group by group")                                                               \
    X(int32_t, group_link, n->group_link, "links, group by group")                                                     \
    X(int32_t, group_v, n->group_v, "velocity coordinates, group by group")                                            \
    X(double, unit, n->group_v, "group by group: a large step in a coordinate (compile/group_units.c)")                \
    X(bool, is_linear, n->group_v, "group by group: only relations with constant coefficients have the coordinate")    \
    X(kt_island, island, n->group, "sets of groups that act on each other; there are n.island")                        \
    X(int32_t, island_coordinate, kt_where(n->group, n->v), "velocity coordinates, island by island")                  \
    X(int32_t, slot, n->row, "index of an equation among those of its group that are not void, or -1")                 \
    X(double, weight, KT_ROWS_COUNT * n->row, "of an equation, by slot, where it is chosen among dependent ones")      \
    X(kt_front_step, front, n->front, "steps of the groups that are reduced by fronts")                                \
    X(int32_t, front_loop, kt_where(n->front, n->loop), "loops, in the order in which these steps complete them")      \
    X(int32_t, front_last_use, n->front, "steps of links, in the order in which their slots are released")             \
    X(kt_front_term, front_term, kt_where(n->front, n->term), "terms of relations, in the order of these steps")       \
    X(double, front_usual, KT_ROWS_COUNT * n->front, "size of a step's last independent equation, the largest seen")   \
    X(int32_t, front_step, kt_where(n->front, n->group_v), "steps of links, by first coordinates, group by group")     \
    X(bool, front_may_delay, KT_ROWS_COUNT * n->front, "whether a later step completes redundant equations")           \
    X(int32_t, front_cap, KT_ROWS_COUNT * n->front, "independent equations up to a step, at generic positions")        \
    X(bool, held, n->v, "coordinates whose positions assembly fixes")                                                  \
    X(bool, held_velocity, n->v, "coordinates whose velocities assembly fixes")                                        \
    X(uint8_t, given, n->v, "which of a coordinate's position (1) and velocity (2) the description gives")             \
    X(kt_effect_record, effect, n->effect + n->effect_off, "batch by batch, in the description's order; those off")    \
    X(kt_effect_batch, batch, n->batch, "effects of one type")                                                         \
    X(kt_force_link, force_link, n->force_link, "links that carry forces; 0: the ground")                              \
    X(int32_t, force_link_angle, KT_ANGLES(n->force_link_angle), "positions that are angles of these, and zeros")      \
    X(int32_t, force_link_angle_index, n->force_link_angle, "their indices among all angles")                          \
    X(kt_variable_record, variable, n->variable, "of formulas, effect by effect")                                      \
    X(kt_path_point_record, path_point, n->path_point, "of the paths of effects, effect by effect")                    \
    X(kt_path_link, path_link, n->path_link, "of the paths of effects, effect by effect")                              \
    X(kt_curve, time_part, n->time_part,                                                                               \
      "parts of formulas that depend on time alone, where steps end at breakpoints")                                   \
    X(kt_effect_record, state, n->x, "rates of auxiliary states: formulas, as those of an effect in a joint")          \
    KT_MODEL_MASS_FIELDS(X)                                                                                            \
    KT_MODEL_STATIC_FIELDS(X)                                                                                          \
    X(double, number, n->number, "of functions of time, and formulas")                                                 \
    X(char, text, n->text, "names, each terminated")                                                                   \
    X(char, index, n->index, "table of names")

/* In `given`. A velocity is kept if its joint is held and the description gives no velocity at all. */
enum { KT_POSITION_GIVEN = 1, KT_VELOCITY_GIVEN = 2, KT_VELOCITY_KEPT = 4 };

/* A state of a mechanism, with the joint forces and wrenches that act on it. */
typedef struct kt_dynamic_state {
    double t;
    const double *q, *v;       /* nq, nv */
    const double *tau;         /* joint forces, nv; NULL: none */
    const kt_wrench *external; /* on bodies, as for kt_dynamics_forward; NULL: none */
} kt_dynamic_state;

/* Accelerations of a mechanism, effects not included: kt_forward_tree (dynamics/dynamics.h) or kt_closed_forward
 * (evaluate/evaluate.h). Wrenches have been checked. */
typedef kt_status kt_forward_call(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                  kt_error *error);

/* Data of so many links fit into the caches of a processor (dynamics/sweep.h). */
enum { KT_LINKS_NEAR = 3000 };

struct kt_model {
    size_t bytes;
    kt_counts n;
    kt_v4 gravity;
    kt_isa isa;
    const struct kt_kernels *kernels; /* the recursions for this instruction set and sweep (dynamics/dynamics.h) */
    kt_forward_call *forward;
    kt_forward_call *unloaded; /* where friction comes from loads: `forward` without this friction */
    void (*place_slip)(const kt_model *model, kt_data *data); /* places kt_data.slip_work; NULL: nothing slips */
    kt_forward_call *steady; /* `forward` of the model of an instant, for masses that vary */
    size_t found_massless;   /* while it is built: how many coordinates will be `massless` */
    size_t damped;           /* how many of the combinations of `massless` dampers resist: the first ones */
    const struct kt_reduction_kind *reduction;        /* how the equations of loops are solved (constraint/group.h) */
    const struct kt_reduction_kernels *group_kernels; /* recursions of the groups (reduction/kernel.h) */
    kt_metric metric;
    kt_structure structure;
    unsigned excluded_forms;
    kt_sweep sweep;      /* kinds of the links: spatial, planar or both */
    double length;       /* length of the longest loop, once around: the scale of lengths */
    double tolerance;    /* tolerance of the description: by which loops may contradict each other (compile/rank.c) */
    double disagreement; /* largest contradiction of loops, with the increase that motion may cause; 0: none */
    double rounding;     /* relative gaps that given lengths leave by their rounding (assembly/rounding.h) */
    int32_t to_planar;   /* planar index of a link minus its index (planar.h) */
    bool exceeds_caches; /* the model has more than KT_LINKS_NEAR links */
    bool ordered;        /* velocity coordinates have the order of the links */
    bool driven;         /* some loop depends on time, or drives at a constant speed */
    bool has_delassus;   /* some group is solved by reduction/delassus.h */
    bool has_armature;   /* some joint has armature */
    bool placed;         /* in the caller's memory (kt_model_copy) */
    bool settable;       /* from the options of the compilation */
    uint32_t name;       /* offset in text */
    kt_names
        names; /* bodies (scope 0), joints with names of their own (KT_NAMES_OF_JOINTS) and the markers of body b (scope
                          1 + b); the table lies in `index` */
    KT_ARENA_DECLARE(KT_MODEL_FIELDS)
    struct kt_variants *variants; /* of models with other sets of switched loops and effects, or NULL (switching.h) */
    uint64_t set;                 /* of those that are on in this one */
    uint64_t shape;               /* of the data that belong to it: a hash of their lengths */
    uint64_t constants;           /* a hash of the numbers with which it was compiled; copies share them */
    uint64_t identity;            /* a hash of both, which its data have, too */
    bool custom;                  /* it has loops of the caller's */
    uint64_t slips;               /* which loops slip, their places, and the order of effects: a hash; 0: none */
    uint64_t revision;            /* how often parameters have been set */
};

/* The functions of time of all bodies of variable mass: their number, and the k-th. */
static inline size_t kt_mass_curve_count(const kt_model *model) { return KT_MASS_CURVES * model->n.varying; }
static inline const kt_curve *kt_mass_curve(const kt_model *model, size_t k) {
    return &model->varying[k / KT_MASS_CURVES].curve[k % KT_MASS_CURVES];
}

/* Whether a link is computed in a plane. */
static inline bool kt_link_is_planar(const kt_model *model, size_t link) { return link >= model->n.spatial; }

/* Whether a velocity coordinate is one of those that move no mass. Such a coordinate has the armature 1 in the model,
 * which is no rotor, but replaces the missing mass (evaluate/quasi_static.c). */
static inline bool kt_is_massless(const kt_model *model, size_t v) {
    for (size_t k = 0; k < model->n.massless; k++)
        if ((size_t)model->massless[k] == v)
            return true;
    return false;
}

/* Returns the bytes of a model with these counts. If memory is not NULL, also sets the pointers of the model at
 * memory to its arrays, and its number of bytes. */
size_t kt_model_layout(void *memory, const kt_counts *n);

/* Sets the hash of the numbers of a model that has just been compiled. Data of a model with other numbers may fit by
 * their sizes, but their poses would mix with the lengths and masses of this model. */
void kt_model_identify(kt_model *model);

/* Notes which data serve the model, whose counts and loops are final. */
void kt_model_seal(kt_model *model);

/* A characteristic length of the mechanism, m: the longest distance from joint to joint or from joint to centre of
 * mass; 1 if there is none. O(links). */
double kt_model_extent(const kt_model *model);

/* Writes the size of a large change of each velocity coordinate (nv): a radian, or this length. O(links). */
void kt_model_units(const kt_model *model, double *unit);

/* The body that the joint of this name carries; -1 where there is none. */
KT_INNER int kt_joint_index(const kt_model *model, const char *name);

/* Initialises the model's table of names with the names of all bodies, joints and markers. */
void kt_model_name_all(kt_model *model);

/* ---- the workspace ----------------------------------------------------------------------------------------------- */

/* The motion of a link, expressed in world axes about the link's own origin. */
typedef struct kt_link_motion {
    kt_real3 axes[3];       /* R: the link's axes, s among them: that of a revolute, prismatic or screw motion */
    kt_real3 offset;        /* r: own origin minus the parent's */
    kt_real3 omega;         /* angular velocity */
    kt_real3 alpha, linear; /* angular acceleration, and the origin's (in dynamics: minus gravity) */
} kt_link_motion;

/* The wrench on a body, in the form that recursions read: about the origin of the body frame, in world axes. */
#ifndef KT_LANES
typedef kt_wrench kt_external;
typedef kt_vec3 kt_external3;
KT_OPERATOR kt_real3 kt_of_external3(kt_external3 x) { return kt_v4_from(x); }
#else
typedef kt_real3 kt_external3;
typedef struct kt_external {
    kt_external3 moment, force;
} kt_external;
KT_OPERATOR kt_real3 kt_of_external3(kt_external3 x) { return x; }
#endif

/* Data of a link that only some recursions have: a wrench in dynamics, the motion of its origin in kinematics. */
typedef union kt_link_origin {
    struct {
        kt_real3 moment, force;
    };
    struct {
        kt_real3 position, velocity; /* world */
    };
} kt_link_origin;

/* The motion of a link for queries. Only kt_kinematics_update writes it. Queries therefore refer to the state of the
 * last update, even after computations at other states. */
typedef struct kt_link_kinematics {
    kt_mat3 axes;
    kt_vec3 offset, omega, alpha, linear, position, velocity; /* as in kt_link_motion, without gravity */
} kt_link_kinematics;

/* The motion of a link that carries forces. The position of the link is base + local: from the world's origin to the
 * origin of the tree, and from this origin to the link. Because of this split, distances within a tree lose no digits
 * far from the world's origin. */
typedef struct kt_force_frame {
    kt_link_motion link; /* poses and angular velocity only */
    kt_real3 base, local, velocity;
} kt_force_frame;

/* Mass and first moment of all that a link carries, about the link's origin, world axes. */
typedef struct kt_carried_mass {
    kt_real3 moment;
    kt_real1 mass;
} kt_carried_mass;

/* An articulated inertia and its bias wrench. The inertia [J G'; G M] maps (alpha, a) to (moment, force). The matrix is
 * stored by columns, with J and M symmetric as in algebra/real3.h. */
typedef struct kt_articulated {
    union {
        struct {
            kt_real3 j[3], g[3], m[3];
        };
        kt_real3 gain[12]; /* for a joint with armature that has been eliminated (kt_armature_gain) */
    };
    kt_real3 moment, force;
} kt_articulated;

/* The acceleration of a joint with one degree of freedom is y - K (alpha, a) of its parent. */
typedef struct kt_response {
    union {
        kt_real3 gain_angular; /* K, parent gain; of one state, lane 3: y, free acceleration (kt_response_free) */
        kt_real3 bias_angular; /* in a constraint group: the acceleration that the velocities alone give */
    };
    union {
        kt_real3 gain_linear;
        kt_real3 bias_linear;
    };
#ifdef KT_LANES
    kt_real1 free;
#endif
} kt_response;

static inline size_t kt_lanes8(size_t count) { return (count + 7) / 8 * 8; }

/* The motion of a link relative to the origin of its group's parent, as if the parent were at rest. The planar or the
 * spatial kernels define the numbers. alpha and linear are the accelerations that the velocities alone cause. */
typedef struct kt_front_motion {
    kt_real3 point, velocity, alpha, linear;
} kt_front_motion;

/* The counts of a step in the last factorisation. The parameters, `params`, include the new ones. The equations,
 * `rows`, include those that earlier steps have delayed; `rank` of them are independent. Afterwards `left` parameters
 * remain, and `kept` of these stay in the front. The `reflectors` separate the parameters that stay from the others.
 * The slots hold `vectors`. */
typedef struct kt_front_count {
    int32_t params, rows, rank, left, kept, reflectors, vectors;
    int32_t first;             /* the equations' place among the group's pivots */
    int32_t received, delayed; /* equations delayed until this step, and by it */
    int32_t received_row[KT_FRONT_DELAYED_MOST], delayed_row[KT_FRONT_DELAYED_MOST]; /* rows of the delayed equations */
    double last; /* size of the last independent equation */
} kt_front_count;

/* Every array of the data: type, name, count, meaning. First the arrays of the recursions over the tree. */
#define KT_SWEEP_FIELDS(X)                                                                                             \
    X(kt_link_motion, motion, n->link, "motion of the links")                                                          \
    X(kt_link_origin, origin, n->link, "wrenches of the links, in forward dynamics external ones; or positions")       \
    X(kt_response, response, n->link, "from the backward pass to the last")                                            \
    X(kt_articulated, articulated, n->articulated, "inertias: articulated, composite, sums of what children pass")     \
    X(kt_force_frame, force_link, n->force_link, "motion of the links that carry forces")                              \
    X(kt_real1, force_link_sine, kt_lanes8(n->force_link_angle), "of these links' angles")                             \
    X(kt_real1, force_link_cosine, kt_lanes8(n->force_link_angle), "of these links' angles")                           \
    X(kt_carried_mass, carried, kt_where(n->gravity, n->force_link), "of the links that carry forces")                 \
    X(kt_real1, gravity_force, kt_where(n->gravity, n->v), "joint forces that balance gravity, if read")               \
    X(kt_planar_motion, planar, n->planar, "motion of the planar links; 0: the ground")                                \
    X(kt_planar_response, planar_response, n->planar, "from the backward pass to the last")                            \
    X(kt_planar_inertia, planar_inertia, n->planar, "articulated or composite inertias")                               \
    X(kt_real1, planar_cosine, kt_lanes8(n->angle - n->spatial_angle), "of the planar links' angles")                  \
    X(kt_real1, planar_sine, kt_lanes8(n->angle - n->spatial_angle), "of the planar links' angles")                    \
    X(kt_real1, cosine, kt_lanes8(n->angle), "of all angles")                                                          \
    X(kt_real1, sine, kt_lanes8(n->angle), "of all angles")

/* The frame in which friction of a hard contact acts. The frame has the plane's axes, and the point relative to the
 * origins of the sphere's body and the plane's (arm), and of their links (lever). The ground has no lever. */
typedef struct kt_slip_frame {
    kt_vec3 axis[2], arm[2], lever[2];
} kt_slip_frame;

/* Arrays of data of models in which hard contacts slip. */
#define KT_DATA_SLIP_FIELDS(X)                                                                                         \
    X(double, slip, 2 * n->slip, "directions in which they began to, an input; 0: none (evaluate/slip.c)")             \
    X(double, slip_slow, 2 * n->slip, "of fixed steps, an input: the time s and speed m/s of slow slip; else 0")       \
    X(double, slip_velocity, 2 * n->slip, "slip velocities of the last evaluation")                                    \
    X(double, slip_normal, n->slip, "normal forces of the last evaluation")                                            \
    X(double, slip_direction, 2 * n->slip, "likewise directions against which friction acts")                          \
    X(kt_slip_frame, slip_frame, n->slip, "where friction acts")                                                       \
    X(kt_wrench, slip_loaded, kt_where(n->slip, n->body), "scratch: wrenches on bodies, with friction (kt_slip_load)") \
    X(double, slip_multiplier, kt_where(n->slip, n->row), "of all equations")                                          \
    X(double, slip_matrix, kt_slip_most(n) * (kt_slip_most(n) + 1), "of normal forces of an island, and right sides")  \
    X(char, slip_work, n->slip_work, "a kt_slip_problem, laid out with the data (evaluate/slip.h)")

/* Arrays of data of models with friction of joints from loads (evaluate/load_friction.c). */
#define KT_DATA_LOAD_FIELDS(X)                                                                                         \
    X(bool, load_rests, n->loaded, "whether the friction is left out, since its joint is at rest, an input")           \
    X(double, load_friction, n->loaded, "friction of the last evaluation")                                             \
    X(double, load, 3 * n->loaded, "loads of the last reactions")                                                      \
    X(double, load_free, 3 * n->loaded, "loads without this friction")                                                 \
    X(double, load_gain, 3 * n->loaded * n->loaded, "changes of the loads by units of friction")                       \
    X(double, load_matrix, n->loaded * n->loaded, "scratch: of Newton's method")                                       \
    X(double, load_residual, n->loaded, "scratch: likewise")                                                           \
    X(double, load_tau, kt_where(n->loaded, kt_lanes8(n->v)), "joint forces with this friction")                       \
    X(kt_wrench, load_joint, kt_where(n->loaded, n->body), "scratch: reactions of joints")

#define KT_DATA_FIELDS(X)                                                                                              \
    KT_SWEEP_FIELDS(X)                                                                                                 \
    X(kt_link_kinematics, kinematics, n->link, "of the last kt_kinematics_update, for queries")                        \
    X(double, scratch, kt_lanes8(n->v), "results before they are committed")                                           \
    X(double, scratch_v, 6 * kt_lanes8(n->v), "accelerations, steps; of CRBA, wrenches of unit accelerations")         \
    X(double, x, 2 * n->x, "auxiliary states, an input (kt_auxiliary_states); their rates before they are committed")  \
    KT_DATA_MASS_FIELDS(X)                                                                                             \
    KT_DATA_STATIC_FIELDS(X)                                                                                           \
    KT_DATA_SLIP_FIELDS(X)                                                                                             \
    KT_DATA_LOAD_FIELDS(X)                                                                                             \
    X(double, tau, kt_lanes8(n->v), "joint forces of all effects")                                                     \
    X(double, moved_q, kt_where(n->group, kt_lanes8(n->q)), "a neighbour of the state evaluated")                      \
    X(double, moved_v, kt_where(n->group, kt_lanes8(n->v)), "a neighbour of the state evaluated")                      \
    X(double, assembled_q, kt_lanes8(n->q), "a state being assembled")                                                 \
    X(double, given_q, kt_lanes8(n->q), "the position that an assembly starts from")                                   \
    X(double, near_q, kt_where(n->group, kt_lanes8(n->q)), "a position nearer to the given one")                       \
    X(bool, fixed, kt_where(n->group, n->v), "coordinates that an assembly does not move yet")                         \
    X(double, assembled_v, kt_lanes8(n->v), "a state being assembled")                                                 \
    X(double, delta, kt_lanes8(n->v), "a step in positions or velocities")                                             \
    X(double, dense, n->dense, "matrices of the constraint groups")                                                    \
    X(int32_t, pivot, n->row, "order of the equations, group by group")                                                \
    X(int32_t, rank, n->group, "of each group, as last factored")                                                      \
    X(kt_rows, factored, n->group, "which equations of each group")                                                    \
    X(double, last, n->group, "size of its last independent direction if it is near a singular position")              \
    X(kt_front_count, front, n->front, "steps of the groups that are reduced by fronts, as last factored")             \
    X(kt_front_motion, front_motion, kt_where(n->front, n->group_v), "motion of the links, by first coordinates")      \
    X(int32_t, front_active, kt_where(n->front, n->front + n->loop + KT_FRONT_DELAYED_MOST),                           \
      "slots in use: of links, of relations, delayed")                                                                 \
    X(bool, front_fixed, kt_where(n->front, n->group_v), "coordinates that count as constants, as last filled")        \
    X(bool, front_planar, kt_where(n->front, n->group), "whether the planar kernels have filled a group's equations")  \
    X(uint8_t, special_form, n->group, "0, or that a group is solved in its own form (reduction/kernel.h)")            \
    X(bool, near, n->group, "whether a group is near a singular position, as last factored")                           \
    X(bool, lost, n->group, "whether one of its directions is nearly lost (dead_point.c)")                             \
    X(double, damping, n->group, "of each group's steps in Levenberg-Marquardt assembly")                              \
    X(double, gap, n->group, "sum of squares of a group's residuals in Levenberg-Marquardt assembly")                  \
    X(bool, settled, n->group, "whether no step reduces that sum any more")                                            \
    X(double, neighbour_q, kt_where(n->group, kt_lanes8(n->q)), "a state near a singular position")                    \
    X(double, neighbour_v, kt_where(n->group, kt_lanes8(n->v)), "a state near a singular position")                    \
    X(kt_wrench, wrench, n->body, "wrenches on bodies: sums towards the root")                                         \
    X(kt_wrench, applied, kt_where(n->force_link, n->body), "wrenches on bodies: external ones and effects")           \
    X(kt_wrench, loaded, kt_where(n->group, n->body), "wrenches on bodies: those and the loops'")                      \
    X(kt_wrench, idle, kt_where(n->load, n->body), "wrenches on bodies: parts of the loops' that do no work")          \
    X(kt_wrench, loop_wrench, n->loop, "reactions of loops")                                                           \
    X(char, stress, n->stress, "of redundant groups (constraint/self_stress.h)")                                       \
    X(int32_t, stress_joint, kt_where(n->stress, n->body), "rows of the joints of one of them")                        \
    X(int32_t, stress_count, kt_where(n->stress, n->group), "self-stresses of each")                                   \
    X(double, stress_multiplier, kt_where(n->stress, n->row), "what sharing adds to multipliers")                      \
    X(int32_t, stopped, kt_where(n->loop, 2), "the loop (from 1) whose callback stopped in this call, and its code")

/* The motion next to a singular position, since the start of the last step or the last call of kt_data_crossings. The
 * number `acceleration` is the largest estimated error of an acceleration, over its unit. The least time in which the
 * position would be reached is `time`. The number `error` is kt_crossings.error. Interpolated accelerations differ by
 * `jump` from direct ones that may be right, too. All numbers are 0 if no such motion exists. */
typedef struct kt_passage {
    double acceleration, time, error, jump;
} kt_passage;

#ifdef KT_LANES

/* Indices of angles among the positions of all lanes. */
#define KT_LANE_FIELDS(X)                                                                                              \
    X(kt_model, model, 1, "that of the lanes: a model's, but for the arrays here")                                     \
    X(kt_link, link, n->link, "links, with the numbers of each lane's model")                                          \
    X(kt_link_rest, link_rest, n->rest, "of the links that have one, the same in all lanes")                           \
    X(kt_planar_link, planar_link, n->planar, "planar links, as links")                                                \
    X(kt_plane, plane, n->plane, "planes, as links")                                                                   \
    X(kt_body_record, body, n->body, "bodies, as links")                                                               \
    X(kt_real3, gravity, 1, "of each lane's model")                                                                    \
    KT_SWEEP_FIELDS(X)                                                                                                 \
    X(int32_t, lane_angle, KT_ANGLES(KT_LANES * n->angle), "positions that are angles, of each lane, and any others")  \
    X(int32_t, lane_force_angle, KT_ANGLES(KT_LANES * n->force_link_angle), "those of links that carry forces")        \
    X(kt_real1, dense, n->dense, "matrices of the constraint groups")                                                  \
    X(kt_index1, pivot, n->row, "order of the equations, group by group")                                              \
    X(kt_rows, factored, n->group, "which equations of each group")                                                    \
    X(kt_front_motion, front_motion, kt_where(n->front, n->group_v), "motion of the links, by first coordinates")      \
    X(kt_real1, delta, kt_where(n->group, n->v), "a step in positions or velocities")                                  \
    X(kt_real1, rest, kt_where(n->group, n->v), "velocities or forces of zero")

/* The data in code that is compiled for lanes: the arrays that the recursions write. */
struct kt_data {
    bool has_external;    /* as below */
    kt_condition sound;   /* for each lane: no joint is without inertia */
    const kt_model *base; /* the model that `model` is a copy of; NULL: none yet */
    KT_ARENA_DECLARE(KT_LANE_FIELDS)
};

/* Whether data have been prepared for a model in lanes. */
static inline bool kt_data_serve(const kt_model *model, const kt_data *data) { return model && data && data->base; }

#else

struct kt_data {
    void *owned;         /* memory of kt_data_create, or NULL */
    uint64_t identity;   /* of its model */
    uint64_t state;      /* kt_state_hash of the q and v that `kinematics` are of */
    bool has_external;   /* external wrenches act on links, and `origin` has them */
    bool followed;       /* their owner follows where contacts close and open: evaluations do not check this */
    uint64_t load_state; /* kt_state_hash of the q and v that `load_friction` belongs to */
    double slow_slip;  /* an input: the largest slip of which the direction is predicted, m/s; or 0 (evaluate/slip.h) */
    double still_slip; /* an input: slip up to this is rounding, m/s */
    bool posed;        /* poses and velocities of the spatial links are those of the next accelerations, once */
    bool placed;       /* poses of the spatial links are those of the accelerations that are evaluated now (open.c) */
    bool dead;         /* the last projection was rejected at a dead point (assembly/dead_point.c) */
    bool interpolated; /* the last accelerations are interpolated from neighbouring states: poses and equations are not
                          those of the state that was given */
    kt_crossings crossings; /* since the last call of kt_data_crossings */
    kt_passage passage;
    kt_iterations iterations;   /* since the last call of kt_data_iterations */
    kt_iterations closing;      /* counts of the last projection alone */
    double difference_error;    /* since the last call of kt_data_difference_error */
    double correction, fastest; /* the largest change of a velocity by the last projection, and the largest velocity of
                                   these coordinates, each over model->unit, 1/s */
    int32_t corrected_v;        /* the velocity of which `correction` is the change */
    uint32_t unconverged;       /* directions of slow slip that were not found (evaluate/slip.c), since a simulation has
                                   counted them */
    /* Multipliers that reactions follow from, in place of those that are found, in the form of kt_multiplier_evaluate;
     * or NULL. */
    const double *given_multipliers;
    /* Called once between the passes of the next accelerations, when groups have their multipliers; or NULL. */
    void (*between)(const kt_model *model, struct kt_data *data);
    KT_ARENA_DECLARE(KT_DATA_FIELDS)
    size_t bytes; /* bytes of the data's memory */
};

/* kt_data_init for an owner that follows contacts, as simulations do. */
KT_CHECKED kt_status kt_data_init_followed(const kt_model *model, void *memory, size_t size, kt_data **data,
                                           kt_error *error);

/* Whether the model or data are missing, or the data do not serve the model. Data serve their own model, its copies,
 * the original of a copy, and models that were compiled from equal descriptions. *error is then filled. */
#define KT_IS_OTHER_DATA(error, model, data)                                                                           \
    (KT_IS_MISSING(error, model, data) || kt_is_other_data(error, __func__, model, data))

/* Fills the error of data that are another model's. */
void kt_other_data_report(kt_error *error, const char *call);

static inline bool kt_is_other_data(kt_error *error, const char *call, const kt_model *model, const kt_data *data) {
    const bool other = data->identity != model->identity;
    if (other)
        kt_other_data_report(error, call);
    return other;
}

/* Whether data belong to a model; false if either is NULL. For calls that cannot fail. */
static inline bool kt_data_serve(const kt_model *model, const kt_data *data) {
    return model && data && model->identity == data->identity;
}

/* Lets data serve another model of the same shape, for calls in which several models share one workspace. Kinematics of
 * the model before must not be read any more. */
static inline void kt_data_lend(const kt_model *model, kt_data *data) { data->identity = model->identity; }

#endif

#endif
