/* The records of a compiled model: links, bodies, loops, effects.
 *
 * The records form two trees. The recursions sweep the *links*, each with one elementary joint. The motion is about or
 * along a coordinate axis of the link's own frame, or spherical, or free (motion.h). A joint of more than one axis is a
 * short chain of massless links, and bodies fixed to one another share a link. The *bodies* are the caller's: each is a
 * frame fixed in its link. Link and body 0 are the ground; a parent precedes its children in both trees.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_RECORD_H
#define KT_MODEL_RECORD_H

#include "algebra/real3.h"
#include "kinetree/model.h"
#include "model/front_plan.h"
#include "model/function.h"
#include "model/motion.h"

#include <stdint.h>

/* Whether a loop or an effect that is being compiled is off in this model. */
#define KT_IS_OFF(item) ((item)->switching == KT_SWITCHED_OFF || (item)->switching == KT_NEVER_ON)
/* Whether the item may be switched. */
#define KT_IS_SWITCHED(item) ((item)->switching == KT_SWITCHED_ON || (item)->switching == KT_SWITCHED_OFF)

/* The axes of a joint at q = 0, expressed in the joint frame. */
typedef struct kt_joint_axes {
    kt_mat3 triad;  /* z is the axis; x and y are those of a planar joint */
    kt_vec3 second; /* unit; the second axis of a universal joint */
} kt_joint_axes;

/* Data that only some links have: screws, and links that are rotated at rest. */
typedef struct kt_link_rest {
    kt_mat3 axes; /* this link's axes at rest (q = 0) in the parent link's frame, columns */
    double pitch;
} kt_link_rest;

/* Every evaluation reads all links several times. Therefore data that evaluations do not read lie elsewhere. In the
 * records of links, bodies and planes, the floating-point numbers come first. In code that is compiled for lanes, each
 * of these numbers is a vector of lanes (batch/interleave.h). */
typedef struct kt_link {
    kt_const3 at;          /* origin of the joint frame in the parent link's frame */
    kt_const_sym3 inertia; /* inertia of all bodies on the link, about the link's origin, link axes */
    kt_const3 moment;      /* first moment m c, link axes */
    kt_const1 mass;
    kt_const1
        size; /* rounding errors of its articulated inertia along its degrees of freedom are proportional to this */
    int32_t parent;
    int32_t q, v;         /* first coordinate */
    int32_t angle;        /* the joint's index among the sines and cosines */
    int32_t body;         /* the body whose joint it is part of */
    int32_t group;        /* the constraint group that it is part of, or -1 */
    int32_t local;        /* the link's first coordinate among the group's */
    int32_t rest;         /* the kt_link_rest lies so many doubles after this record (kt_link_rest_of); 0: none */
    int32_t articulated;  /* the link's index among the articulated inertias, if it has one */
    int32_t end;          /* one past the last degree of freedom that the link carries, in the order of the links */
    uint8_t motion;       /* kt_motion */
    uint8_t axis;         /* 0, 1, 2 */
    bool rest_is_rotated; /* the link's axes at rest are not the parent's */
    bool follows;         /* the link's parent is the link before this one */
    bool branches;        /* some child does not follow it directly */
    bool leads;           /* the next link is its child */
    bool has_armature;    /* the link's joint has armature */
} kt_link;

/* Returns the record at rest of a link with such a record (`rest` is not 0). The array of these records follows that of
 * the links. */
static inline const kt_link_rest *kt_link_rest_of(const kt_link *link) {
    return (const kt_link_rest *)(const void *)((const double *)(const void *)link + link->rest);
}

/* The advance of a screw along its axis for each radian. */
static inline double kt_link_pitch(const kt_link *link) { return link->rest ? kt_link_rest_of(link)->pitch : 0.0; }

static inline int kt_link_dofs(const kt_link *link) { return kt_motion_facts_of(link->motion).velocities; }
/* How many of its velocities are rates of lengths; these come first. */
static inline int kt_link_lengths(const kt_link *link) { return kt_motion_facts_of(link->motion).lengths; }

/* A body of the description. */
typedef struct kt_body_record {
    kt_const_pose in_link; /* body frame in its link's frame */
    kt_const_pose joint;   /* joint frame in the parent's body frame */
    kt_const_sym3 inertia; /* own, about the com, body axes */
    kt_const3 com;         /* body frame */
    kt_const1 mass;
    int32_t link;
    int32_t parent;
    int32_t type;   /* kt_joint_type */
    int32_t q, v;   /* first coordinate */
    int32_t source; /* index in the description */
    int32_t marker, marker_count;
    int32_t limit;       /* index of the joint's limits, counted from 1; 0: none */
    uint32_t name;       /* offset in the model's text */
    uint32_t joint_name; /* offset, too; equal to `name` where the joint has no name of its own */
    bool fixed; /* to the world: no degree of freedom between (compare/absolute.c: by the joints of the tree) */
    bool on_variable_link; /* a body on its link has a variable mass, perhaps this one */
} kt_body_record;

/* The number of functions of a body whose mass is a function of time. */
enum { KT_MASS_CURVES = 7 };

/* A body whose mass is a function of time; its record has the mass to which its inertia belongs. */
typedef struct kt_mass_record {
    int32_t body;
    bool has_moments;               /* the body's inertia is given; otherwise it is in proportion to the mass */
    kt_curve curve[KT_MASS_CURVES]; /* the mass, and xx, yy, zz, xy, xz, yz */
} kt_mass_record;

typedef struct kt_marker_record {
    kt_pose frame; /* in the body's */
    uint32_t name;
} kt_marker_record;

/* A loop: two frames on links, or a relation of joint positions. */
typedef struct kt_loop_record {
    int32_t type;    /* kt_loop_type */
    int32_t kind;    /* index of the type in the list of kinds */
    int32_t source;  /* index in the description */
    int32_t body[2]; /* bodies of the ends */
    int32_t link[2]; /* links of the ends; for relations: the first joint's, and 0 */
    bool counted;    /* wheels: joints count the turns of the ends; here, as every evaluation reads it */
    kt_pose
        frame[2]; /* ends in their links' frames, z along `axis`; if the type has an axis2, the second's z along that */
    kt_vec3 origin;           /* positions on the paths are relative to it; in the ancestor's frame */
    int32_t ancestor;         /* the deepest link that carries both ends (or all joints) */
    int32_t path[2];          /* in model->path: the links from the ancestor's child to the end's link */
    int32_t length[2];        /* numbers of links on the paths */
    int32_t term, term_count; /* relations: in model->term; -1 terms: it is switched off */
    int32_t group;            /* -1: it is switched off */
    double around;            /* length of a loop between frames, once around, at the initial positions */
    double disagreement[2];   /* with others: the largest residual that stays, a length and an angle */
    int32_t equation;         /* the loop's first row among those of all loops */
    int32_t slot;             /* in model->slot: the index of its first equation; those of the others follow */
    int32_t row, row_count;   /* rows in its group: first, number */
    kt_curve curve;           /* distance: length; motion: position; coupling: offset; rates: rate; curve: arc length */
    double pitch, radius;
    double angle; /* screw, homokinetic: relative angle at the start */
    double tube;  /* surface: of a torus */
    int32_t form; /* surface, curve: its type; coupling: 1 if it has a formula */
    size_t
        number; /* curve: where the numbers of a spline begin among those of functions of time; coupling: those of its
                      formula */
    int32_t count;               /* curve: points of a spline */
    bool contact;                /* rolling: the wheel also touches the surface; custom: its equations have residuals */
    bool driven;                 /* custom: its equations depend on time */
    int32_t given;               /* custom: kt_loop_given */
    kt_loop_callback *equations; /* custom */
    void *user;                  /* custom: of the callback */

    /* gear, rack, worm, span, belt */
    double gain[2];    /* gear, worm: lengths for a radian of each wheel; rack: of the wheel; span, belt: radii */
    double bearing[2]; /* angles of the line of the ends in their frames, without the ends' turns, at the start */
    double turned[2];  /* the ends' turns at the start */
    double sense;      /* 1, or -1 if the axes of the ends are opposite */
    double phase[2];   /* phase of each row, at the start */
    double period;     /* after which residuals repeat; 0: never */
    double slope[3];   /* parting, axial and tangential force of teeth for each unit of the multiplier */
    double tension;
    size_t turn; /* index, among the numbers, of the signs with which the joints on both paths count turns */

    int32_t joint;   /* kt_joint_type of the coordinates that records have; 0: none */
    kt_vec3 axis[2]; /* axes of this joint */

    uint32_t name;                     /* offset in the model's text */
    bool comes;                        /* the loop is off at first, and is switched on later */
    bool released;                     /* a contact or friction that does not act by itself at first */
    int32_t side;                      /* kt_side */
    double restitution, rest_velocity; /* for a loop that bounds a side */
    bool poisson;                      /* for a loop that bounds a side: its restitution is of impulses */
    int32_t friction;                  /* the effect whose sticking it is, from 1; 0: none */
    int32_t rubs;                      /* for a contact with friction: its effect, from 1; 0: none */
    int32_t slips;                     /* the contact's effect in models in which it slips (evaluate/slip.c) */
} kt_loop_record;

/* Whether the loop is switched off. Such a loop is in no group, and has no rows. The loop's term_count is -1, as in a
 * relation without terms, so that derivatives of frames leave the loop out. */
static inline bool kt_loop_is_off(const kt_loop_record *loop) { return loop->group < 0; }

/* Whether its equation depends on time. */
static inline bool kt_loop_is_driven(const kt_loop_record *loop) {
    return loop->driven || !kt_curve_rests(&loop->curve);
}

/* A term of a relation: coefficient times the one coordinate of a link. */
typedef struct kt_term_record {
    int32_t link;
    double coefficient;
} kt_term_record;

/* The equations of a group to be used: all, for velocities and accelerations; or the equations with a residual, for
 * positions. */
typedef enum kt_rows { KT_ROWS_ALL = 0, KT_ROWS_CLOSED, KT_ROWS_COUNT } kt_rows;

enum { KT_GROUP_MATRICES = 22 };

/* Why a group has its form. X(id, words) */
#define KT_FORM_REASON_LIST(X)                                                                                         \
    X(KT_FORM_REASON_SMALL, "dense matrices of its coordinates take the fewest operations")                            \
    X(KT_FORM_REASON_ASKED, "it was requested")                                                                        \
    X(KT_FORM_REASON_METHOD, "the requested reduction has no other form")                                              \
    X(KT_FORM_REASON_FORMULA, "an equation is a formula, which dense matrices alone have")                             \
    X(KT_FORM_REASON_RATIO, "ratios of couplings are so large that its equations are scaled")                          \
    X(KT_FORM_REASON_PIN, "one pin closes three coordinates in a plane")                                               \
    X(KT_FORM_REASON_ARMATURE, "one pin closes three coordinates, but a joint has armature")                           \
    X(KT_FORM_REASON_TIME, "link by link it takes less time than dense matrices")                                      \
    X(KT_FORM_REASON_REGISTERS, "four parameters or fewer pass from link to link in a plane")                          \
    X(KT_FORM_REASON_FEW, "one to four equations hold many links on the ground")                                       \
    X(KT_FORM_REASON_INEXACT, "its few equations alone would lose digits where heavy links hang on light ones")

typedef enum kt_form_reason {
#define KT_FORM_REASON_ENUM(id, words) id,
    KT_FORM_REASON_LIST(KT_FORM_REASON_ENUM)
#undef KT_FORM_REASON_ENUM
} kt_form_reason;

/* Whether the loops of a group share reactions in several ways, and whether a least sum decides
 * (evaluate/stress_share.c). */
typedef enum kt_redundancy { KT_REDUNDANCY_NONE, KT_REDUNDANCY_SHARED, KT_REDUNDANCY_LARGE } kt_redundancy;

/* A constraint group: loops that share links and are therefore reduced together. No link is in two groups. `parent`
 * carries all links of the group, but does not belong to the group. Equations that vanish at every position are left
 * out; equations with a residual come first. */
typedef struct kt_group {
    int32_t parent;                  /* link */
    int32_t island;                  /* in model->island */
    int32_t loop, loop_count;        /* in model->group_loop */
    int32_t link, link_count;        /* in model->group_link, ascending */
    int32_t v, v_count;              /* in model->group_v: the coordinates of these links, in their order */
    int32_t row, row_count;          /* in model->slot: the equations of the group's loops */
    size_t entry;                    /* the first number of its equations among those of all groups */
    int32_t count[KT_ROWS_COUNT];    /* equations that are not void */
    int32_t rank[KT_ROWS_COUNT];     /* equations that are independent, at generic positions */
    double usual[KT_ROWS_COUNT];     /* size of the last independent direction there, the largest seen */
    double least[KT_ROWS_COUNT];     /* the least size that the first direction counts as (constraint/group.h) */
    double tolerance[KT_ROWS_COUNT]; /* the size, relative to that, below which a direction is lost */
    kt_group_form form;              /* how it is eliminated (compile/form.c) */
    kt_group_form damped_form;       /* form for damped steps: DENSE, FRONT or DELASSUS */
    kt_form_reason reason;           /* why it has this form */
    bool planar;                     /* its links are planar; otherwise all are spatial */
    bool has_fronts;                 /* the form is one of those by fronts, so that its matrices are those of fronts */
    bool has_armature;               /* a joint of it has */
    bool balanced;                   /* the group's equations are solved in the units of their rows and coordinates */
    kt_redundancy redundancy;        /* whether its reactions are unique (constraint/self_stress.h) */
    double stress_length;            /* length by which moments are divided where reactions are not unique */
    size_t stress;                   /* first byte in data->stress */
    bool is_redundant_in_normal;     /* planar: forces along the normal and moments in the plane alone are redundant */
    bool ranges;                     /* closed contacts may be solved in range space (reduction/half_columns.h) */
    size_t dense;                    /* first number in data->dense */
    size_t at[KT_GROUP_MATRICES];    /* place of each of the group's matrices, from `dense` on */
    kt_front_plan front;
} kt_group;

/* An island: constraint groups whose forces change the accelerations of each other. The links of the groups are on the
 * same base, or on bases that groups connect. A force in one island changes no acceleration in another. */
typedef struct kt_island {
    int32_t v, v_count; /* in model->island_coordinate: the coordinates of all links on its bases */
    int32_t side, dry;  /* numbers of loops that bound a side, and of friction of joints that sticks */
    int32_t rubs;       /* number of contacts with friction, among those that bound a side */
} kt_island;

/* Numbers that are copied from a kt_effect to its record, under the same names. */
#define KT_EFFECT_NUMBERS(X)                                                                                           \
    X(stiffness)                                                                                                       \
    X(damping)                                                                                                         \
    X(length)                                                                                                          \
    X(coulomb)                                                                                                         \
    X(viscous)                                                                                                         \
    X(breakaway)                                                                                                       \
    X(stribeck)                                                                                                        \
    X(smoothing)                                                                                                       \
    X(efficiency)                                                                                                      \
    X(lower)                                                                                                           \
    X(upper)                                                                                                           \
    X(limit)                                                                                                           \
    X(linear)                                                                                                          \
    X(quadratic)                                                                                                       \
    X(strength)                                                                                                        \
    X(radius)                                                                                                          \
    X(radius2)                                                                                                         \
    X(exponent)                                                                                                        \
    X(dissipation)                                                                                                     \
    X(friction)                                                                                                        \
    X(slip)                                                                                                            \
    X(rolling)                                                                                                         \
    X(torsion)                                                                                                         \
    X(turn)

/* The relative coordinate of a loop (constraint/relative_coordinate.h). */
typedef struct kt_relative_record {
    int32_t type;             /* kt_relative; 0: none */
    int32_t loop;             /* index in the description */
    int32_t component;        /* number among the loop's coordinates */
    int32_t term, term_count; /* in model->term: the links that count turns */
    int32_t first_count;      /* terms of the first end, which come before those of the second */
    double angle, per_length; /* an angle is near the sum of the terms, d_z per_length (a screw's 1 / pitch) and this */
    double zero;              /* universal: the direction from which it is counted */
} kt_relative_record;

/* A point of an effect's path, or a surface (effect/path.c). All vectors are in the axes of its link, and `at` is from
 * the link's origin. */
typedef struct kt_path_point_record {
    int32_t link; /* index among the links of the path */
    int32_t type; /* KT_PATH_POINT, KT_PATH_SPHERE or KT_PATH_CYLINDER (effect/path.h) */
    bool has_side, inside;
    double radius;
    double divisor; /* above 0: a branch begins */
    kt_vec3 at, axis, side;
} kt_path_point_record;

/* A link of an effect's path. */
typedef struct kt_path_link {
    int32_t body, link;
    int32_t force_link; /* the link's index in model->force_link */
    kt_vec3 arm;        /* from the body's frame's origin to the link's, link axes */
} kt_path_link;

/* An effect: one or two frames on links, or a joint. One in a loop's coordinate acts on the loop's ends. */
typedef struct kt_effect_record {
    int32_t type;          /* kt_effect_type */
    int32_t source;        /* index in the description */
    int32_t body[2];       /* bodies of the ends */
    int32_t link[2];       /* links of the ends; for joint effects, link[0] is the joint's */
    int32_t force_link[2]; /* the links' indices in model->force_link */
    int32_t ends;          /* 1 or 2; 0: a joint */
    uint32_t name;         /* offset in the model's text; 0: none */
    kt_pose frame[2];
    kt_vec3 arm[2]; /* from the bodies' frames' origins to the ends, links' axes */
    kt_effect_wrench_callback *wrench;
    kt_effect_joint_force_callback *joint_force;
    kt_effect_wrench_derivatives_callback *wrench_derivatives;
    kt_effect_joint_force_derivatives_callback *joint_force_derivatives;
    kt_breakpoint_callback *breakpoint;
    void *user;
#define KT_EFFECT_DECLARE(member) double member;
    KT_EFFECT_NUMBERS(KT_EFFECT_DECLARE)
#undef KT_EFFECT_DECLARE
    double stiffnesses[6], dampings[6]; /* bushing; drag: dampings */
    double quadratics[6];               /* drag */
    size_t formula[6];                /* expression: where the terms of each begin in model->number, from 1; 0: none */
    int32_t variable, variable_count; /* expression: in model->variable */
    kt_effect_law_callback *law;      /* expression: in place of formulas */
    kt_effect_law_derivatives_callback *law_derivatives;
    int32_t law_rate;  /* for an auxiliary state: which of the law's rates is its own, from 1; 0: the force */
    kt_curve curve[3]; /* motor, servo, joint_spring, thrust: one; force, torque: the components */
    kt_vec3 exhaust;   /* thrust */
    bool in_body;      /* force, torque: components in the end's axes */
    bool hard;         /* joint_limit, contact: loops are in its place */
    int32_t loop;      /* hard, or friction that sticks: the first of its loops */
    int32_t loops;     /* number of these loops */
    bool disc;         /* contact: of the rim of a disc, not of a sphere */
    double direction;  /* sign of slip, for joint_friction that sticks; 0: it is smoothed */
    bool idle;         /* joint_friction that sticks or is released, in a mask: it exerts no force */
    int32_t load_slot; /* joint_friction from a load: its index in kt_data.load, from 1; 0: there is no load */
    int32_t load_loop; /* of this loop; -1: of the joint */
    kt_relative_record relative;
    int32_t path_point, path_count;     /* expression along a path: in model->path_point; 0: it is along none */
    int32_t path_link, path_link_count; /* in model->path_link */
} kt_effect_record;

/* Variables that only the formulas of one effect have: the distance of its ends, with its rate. For an effect in a
 * loop, the effect's coordinate, with its rate. */
enum { KT_VARIABLE_LENGTH = KT_VARIABLE_GRAVITY + 1, KT_VARIABLE_SPEED };

/* The source of a variable of a formula. */
typedef struct kt_variable_record {
    int32_t type;       /* kt_variable_type, or one of these */
    int32_t q, v;       /* the coordinate of a joint: of positions q, and v the velocity that changes it */
    int32_t x;          /* an auxiliary state */
    int32_t link;       /* link of a marker; for a gravity force, the link that has this degree of freedom */
    int32_t force_link; /* the link's index in model->force_link */
    int32_t component;  /* component of a marker's motion */
    kt_vec3 arm;        /* arm of a marker, from the link's origin, link axes */
} kt_variable_record;

/* Effects of one type that have the same number of ends; effects on joints come first. */
typedef struct kt_effect_batch {
    const struct kt_effect_kind *kind; /* of the type (effect/effect.h) */
    int32_t type, ends;
    int32_t first, count;
} kt_effect_batch;

/* A link on which an effect has an end, or a link between such a link and the ground. */
typedef struct kt_force_link {
    int32_t link, parent; /* the parent's index in model->force_link */
    int32_t base;         /* the joint connects the tree with the ground; no bool: lanes compare all
                             bytes */
} kt_force_link;

#endif
