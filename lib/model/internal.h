/* The compiled model, for the folders above.
 *
 * Two trees stand here. The *links* are what the recursions sweep: each has one elementary joint, whose motion is about
 * or along a coordinate axis of the link's own frame (or a ball, or free); a joint of more than one axis is a short
 * chain of massless links, and bodies fixed to one another share a link. The *bodies* are the caller's: each is a frame
 * at rest in its link. Link and body 0 are the ground; a parent precedes its children in both.
 */
#ifndef KT_MODEL_INTERNAL_H
#define KT_MODEL_INTERNAL_H

#include "algebra/lane.h"
#include "base/names.h"
#include "kinetree/model.h"
#include "model/function.h"
#include "model/planar.h"

#include <stdint.h>

/* What an elementary joint does; `axis` of the link says about or along which coordinate axis. */
typedef enum kt_motion {
    KT_MOTION_NONE = 0, /* ground only */
    KT_MOTION_TURN,
    KT_MOTION_SLIDE,
    KT_MOTION_HELIX, /* turn, and advance by pitch */
    KT_MOTION_BALL,
    KT_MOTION_FREE
} kt_motion;

/* An elementary joint as a joint type names it: its link's frame against the joint frame, and what moves. */
typedef struct kt_element {
    kt_motion motion;
    int axis;
    double pitch;
    kt_mat3 frame;
} kt_element;

enum { KT_ELEMENT_MAX = 3 };

/* What of a joint does not move, in the joint frame. */
typedef struct kt_joint_axes {
    kt_mat3 triad;  /* z is the axis; x and y are those of a planar joint */
    kt_vec3 second; /* unit; the second axis of a universal joint */
} kt_joint_axes;

/* A body against the joint frame on its parent, and its rates as seen from there: angular, and of the body's origin. */
typedef struct kt_joint_motion {
    kt_pose pose;
    kt_twist velocity, acceleration;
} kt_joint_motion;

/* A joint type: one file of lib/joint each; the joint has been checked before. */
typedef struct kt_joint_kind {
    int nq, nv;
    /* Writes up to KT_ELEMENT_MAX elements and returns their number. Coordinates follow the elements. */
    int (*elements)(const kt_joint *joint, kt_element *elements);
    /* The same pair as a closure, for the absolute formulation; KT_LOOP_TYPE_COUNT: nothing is held. */
    kt_loop_type loop;
    /* Coordinates of a body that moves as the joint lets it, and their first and second rates. Of the numbers that
     * stand for the same rotation those next to `near` (nq) are taken. NULL where there are none. */
    void (*measure)(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a);
    /* A wrench on the body (about its origin) and against its parent with the power tau . v in all motions that the
     * joint allows; joint frame's axes. */
    kt_wrench (*push)(const kt_joint_axes *axes, const kt_pose *pose, const double *tau);
} kt_joint_kind;

extern const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT];

typedef struct kt_link {
    kt_v4 at;         /* origin of the joint frame in the parent link's frame */
    kt_v4 turn[3];    /* this link's axes at rest (q = 0) in the parent link's frame, columns */
    kt_v4 inertia[3]; /* of all bodies on the link, about its origin, link axes */
    kt_v4 moment;     /* first moment m c, link axes */
    double mass;
    double pitch;
    double size; /* what rounding errors of an inertia along its freedoms are proportional to, with all it carries */
    int32_t parent;
    int32_t q, v;   /* first coordinate */
    int32_t angle;  /* place among the turning links' sines and cosines */
    int32_t body;   /* whose joint it is part of */
    int32_t group;  /* of loops that it is part of, or -1 */
    int32_t local;  /* its first coordinate among the group's */
    uint8_t motion; /* kt_motion */
    uint8_t axis;   /* 0, 1, 2 */
    bool turned;    /* `turn` is not the identity */
    bool follows;   /* its parent is the link before it */
    bool branches;  /* some child does not follow it directly */
    bool leads;     /* the next link is its child */
} kt_link;

/* Velocity coordinates of a link. */
static inline int kt_link_freedoms(const kt_link *link) {
    return link->motion == KT_MOTION_NONE   ? 0
           : link->motion == KT_MOTION_BALL ? 3
           : link->motion == KT_MOTION_FREE ? 6
                                            : 1;
}

/* A body of the caller's. */
typedef struct kt_body_record {
    kt_pose in_link; /* body frame in its link's frame */
    kt_pose joint;   /* joint frame in the parent's body frame */
    kt_sym3 inertia; /* own, about the com, body axes */
    kt_vec3 com;     /* body frame */
    double mass;
    int32_t link;
    int32_t parent;
    int32_t type;   /* kt_joint_type */
    int32_t q, v;   /* first coordinate */
    int32_t source; /* index in the description */
    int32_t marker, marker_count;
    uint32_t name; /* offset in the model's text */
    bool fixed;    /* to the world, with no freedom between; in the absolute formulation, by what were joints */
} kt_body_record;

typedef struct kt_marker_record {
    kt_vec3 at;
    uint32_t name;
} kt_marker_record;

/* A loop: two frames on links, or a relation of joint positions. */
typedef struct kt_loop_record {
    int32_t type;    /* kt_loop_type */
    int32_t source;  /* index in the description */
    int32_t body[2]; /* that bear the ends */
    int32_t link[2]; /* that bear the ends; of relations: the first joint's, and 0 */
    kt_pose
        frame[2];   /* ends in their links' frames, z along `axis`; where there is an axis2, the second's z along it */
    kt_vec3 origin; /* what places on the paths are counted from, in the ancestor's frame */
    int32_t ancestor;         /* the deepest link that carries both ends (or all joints) */
    int32_t path[2];          /* in model->path: the links from below the ancestor down to each end's */
    int32_t length[2];        /* of the paths */
    int32_t term, term_count; /* relations: in model->term */
    int32_t group;
    int32_t equation;       /* its first row among those of all loops */
    int32_t row, row_count; /* rows in its group: first, number */
    kt_curve curve;         /* distance: length; motion: position; coupling: offset */
    double pitch, radius;
    double angle;  /* screw: relative angle at the start */
    bool contact;  /* rolling: the wheel also touches the surface */
    uint32_t name; /* offset in the model's text */
} kt_loop_record;

/* coefficient times a link's one coordinate */
typedef struct kt_term_record {
    int32_t link;
    double coefficient;
} kt_term_record;

/* Which equations of a group: all, for velocities and accelerations; or those that have a residual, for positions. */
typedef enum kt_rows { KT_ROWS_ALL = 0, KT_ROWS_CLOSED, KT_ROWS_COUNT } kt_rows;

enum { KT_GROUP_MATRICES = 20 };

/* Loops that share links are reduced together; groups do not share any. `parent` carries the whole group and is not
 * part of it. Equations that are void at every position are left out; those with a residual come first. */
typedef struct kt_group {
    int32_t parent;               /* link */
    int32_t loop, loop_count;     /* in model->group_loop */
    int32_t link, link_count;     /* in model->group_link, ascending */
    int32_t v, v_count;           /* in model->group_v: the coordinates of these links, in their order */
    int32_t row, row_count;       /* in model->slot: its loops' equations */
    int32_t count[KT_ROWS_COUNT]; /* of them that are not void */
    int32_t rank[KT_ROWS_COUNT];  /* of them that are independent, at generic positions */
    double usual[KT_ROWS_COUNT];  /* size of the last independent direction there, the largest seen */
    bool pin;                     /* three coordinates in a plane that one pin closes (reduction/planar_pin.h) */
    size_t dense;                 /* first number in data->dense */
    size_t at[KT_GROUP_MATRICES]; /* of each of its matrices, from there */
} kt_group;

/* Numbers that a record has of its kt_effect, under the same names. */
#define KT_EFFECT_NUMBERS(X)                                                                                           \
    X(stiffness)                                                                                                       \
    X(damping)                                                                                                         \
    X(length)                                                                                                          \
    X(rest)                                                                                                            \
    X(coulomb)                                                                                                         \
    X(viscous)                                                                                                         \
    X(breakaway)                                                                                                       \
    X(stribeck)                                                                                                        \
    X(smoothing)                                                                                                       \
    X(lower)                                                                                                           \
    X(upper)                                                                                                           \
    X(linear)                                                                                                          \
    X(quadratic)                                                                                                       \
    X(strength)                                                                                                        \
    X(radius)                                                                                                          \
    X(exponent)                                                                                                        \
    X(dissipation)                                                                                                     \
    X(friction)                                                                                                        \
    X(slip)

/* An effect: one or two frames on links, or a joint. */
typedef struct kt_effect_record {
    int32_t type;      /* kt_effect_type */
    int32_t source;    /* index in the description */
    int32_t body[2];   /* that bear the ends */
    int32_t link[2];   /* of joint effects: link[0] is the joint's */
    int32_t bearer[2]; /* the links' places in model->bearer */
    int32_t ends;      /* 1 or 2; 0: a joint */
    uint32_t name;     /* offset in the model's text; 0: none */
    kt_pose frame[2];
    kt_vec3 arm[2]; /* from the bodies' frames' origins to the ends, links' axes */
    kt_effect_push *push;
    kt_effect_drive *drive;
    void *user;
#define KT_EFFECT_DECLARE(member) double member;
    KT_EFFECT_NUMBERS(KT_EFFECT_DECLARE)
#undef KT_EFFECT_DECLARE
    double stiffnesses[6], dampings[6]; /* bushing */
    kt_curve curve[3];                  /* motor: one; force, torque: the components */
    bool in_body;                       /* force, torque: components in the end's axes */
} kt_effect_record;

/* Effects of one type and kind of ends, one after the other; those on joints come first. */
typedef struct kt_effect_batch {
    int32_t type, ends;
    int32_t first, count;
} kt_effect_batch;

/* A link that bears an effect's end, or lies between such a one and the ground. */
typedef struct kt_bearer {
    int32_t link, parent; /* the parent's place among the bearers */
    bool base;            /* part of the joint that the tree stands on the ground with */
} kt_bearer;

typedef struct kt_counts {
    size_t link, body, marker, q, v, angle, text, index;
    size_t loop, term, path, group, group_link, group_v, row, effect, number;
    size_t dense; /* numbers that the groups' matrices take in the data */
    size_t batch, bearer, bearer_angle;
    /* Links from `spatial` on are planar, and so are angles from `spatial_angle` on; planar: places for planar links,
     * the ground's slot before them, or 0 where there are none. */
    size_t spatial, spatial_angle, planar, plane, planar_loop;
} kt_counts;

/* Angles are taken in groups of eight (algebra/sincos.h), from anywhere among them. */
#define KT_ANGLES(count) ((count) + 7)

/* Every array of a model: type, name, count, meaning. One list declares, measures and places. */
#define KT_MODEL_FIELDS(X)                                                                                             \
    X(kt_link, link, n->link, "elementary joints and what they carry")                                                 \
    X(kt_plane, plane, n->plane, "planes in which trees move")                                                         \
    X(kt_planar_link, planar, n->planar, "planar links as they lie in their planes; 0: the ground")                    \
    X(kt_planar_rest, planar_rest, n->planar, "planar links back to the world")                                        \
    X(kt_body_record, body, n->body, "the caller's bodies")                                                            \
    X(kt_marker_record, marker, n->marker, "named points, body by body")                                               \
    X(double, q0, n->q, "initial positions")                                                                           \
    X(double, v0, n->v, "initial velocities")                                                                          \
    X(double, zero, n->v, "zeros, where a caller gives no velocities, accelerations or forces")                        \
    X(int32_t, angle, KT_ANGLES(n->angle), "positions that are angles of turning links, and zeros")                    \
    X(kt_loop_record, loop, n->loop, "loops, in the description's order")                                              \
    X(kt_planar_loop, planar_loop, n->planar_loop, "loops as they lie in their planes, where links are planar")        \
    X(kt_term_record, term, n->term, "terms of relations between joints")                                              \
    X(int32_t, path, n->path, "links on the loops' paths")                                                             \
    X(kt_group, group, n->group, "groups of loops that share links")                                                   \
    X(int32_t, group_loop, n->loop, "loops, group by group")                                                           \
    X(int32_t, group_link, n->group_link, "links, group by group")                                                     \
    X(int32_t, group_v, n->group_v, "velocity coordinates, group by group")                                            \
    X(double, unit, n->group_v, "group by group: a large step in a coordinate, a radian or the mechanism's length")    \
    X(int32_t, slot, n->row, "place of an equation among those of its group that count, group by group; -1: void")     \
    X(double, weight, KT_ROWS_COUNT * n->row, "of an equation, by slot, where it is chosen among dependent ones")      \
    X(bool, held, n->v, "coordinates that the assembly keeps")                                                         \
    X(kt_effect_record, effect, n->effect, "effects, batch by batch, there in the description's order")                \
    X(kt_effect_batch, batch, n->batch, "effects of one type")                                                         \
    X(kt_bearer, bearer, n->bearer, "links whose motion effects ask for; 0: the ground")                               \
    X(int32_t, bearer_angle, KT_ANGLES(n->bearer_angle), "positions that are angles of these, and zeros")              \
    X(int32_t, bearer_turn, n->bearer_angle, "places of these angles among all")                                       \
    X(double, number, n->number, "of functions of time")                                                               \
    X(char, text, n->text, "names, each terminated")                                                                   \
    X(char, index, n->index, "table of names")

struct kt_model {
    size_t bytes;
    kt_counts n;
    kt_v4 gravity;
    kt_level level;
    kt_reduction reduction;
    kt_metric metric;
    kt_sweep sweep;               /* which links there are: spatial, planar or both */
    double length;                /* of the longest loop, all around: what lengths are held against */
    bool driven;                  /* some loop changes with time */
    bool placed;                  /* in the caller's memory (kt_model_copy) */
    struct kt_absolute *absolute; /* the absolute formulation (absolute.h), or NULL */
    uint32_t name;                /* offset in text */
    kt_names names; /* bodies (scope 0) and the markers of body b (scope 1 + b); the table lies in `index` */
#define KT_MODEL_DECLARE(type, name, count, meaning) type *name;
    KT_MODEL_FIELDS(KT_MODEL_DECLARE)
#undef KT_MODEL_DECLARE
};

/* Bytes of a model with these counts; places its arrays in the block at base where that and model are not NULL. */
size_t kt_model_layout(const kt_counts *n, char *base, kt_model *model);

/* Supplied by lib/dynamics: the level that is meant on this processor (KT_LEVEL_AUTO where it lacks the one asked for),
 * and the first link that has no inertia along one of its freedoms at q, or 0. */
kt_level kt_level_resolve(kt_level asked);
size_t kt_singular_link(const kt_model *model, kt_data *data, const double *q);

/* Equations of a loop: as many as its type has (rolling: 3 with contact). */
int kt_loop_row_count(const kt_loop *loop);

/* Supplied by lib/reduction: lays a group's matrices out and returns the numbers that they take; the ranks of all
 * groups. */
size_t kt_group_lay_out(kt_group *group);
kt_status kt_groups_rank(kt_model *model, kt_error *error);

/* Supplied by lib/joint; of a type without axes they mean nothing. */
kt_joint_axes kt_joint_axes_of(const kt_joint *joint);

/* kt_model_compile without the check. */
kt_status kt_model_build(const kt_description *description, const kt_model_options *options, kt_model **model,
                         kt_error *error);

/* Enters all names of bodies and markers in the model's table. */
void kt_model_name_all(kt_model *model);

/* Supplied by lib/effect, of an effect whose type exists: the frames that it acts on (0: a joint); whether the second
 * is turned to its axis; and its k-th function of time of at most three, KT_FUNCTION_NONE where there is none. */
int kt_effect_end_count(const kt_effect *effect);
bool kt_effect_is_turned(const kt_effect *effect);
const kt_function *kt_effect_function(const kt_effect *effect, int k);

/* Loops and effects onto a model that has bodies and links; *model may move. */
kt_status kt_model_attach(kt_model **model, const kt_description *description, const kt_planar_loop *flat,
                          kt_error *error);

/* Poses of all links in the world at q, and for these poses their twists (world axes, of their origins), with plain
 * arithmetic; for set-up only. */
void kt_link_poses(const kt_model *model, const double *q, kt_pose *poses);
void kt_link_twists(const kt_model *model, const double *v, const kt_pose *poses, kt_twist *twists);

/* ---- the workspace ------------------------------------------------------------------------------------------------
 */

/* A link in motion: world axes, about its own origin. */
typedef struct kt_link_motion {
    kt_v4 axes[3];       /* R: the link's axes */
    kt_v4 axis;          /* s: direction of a turn, slide or helix */
    kt_v4 offset;        /* r: own origin minus the parent's */
    kt_v4 omega;         /* angular velocity */
    kt_v4 alpha, linear; /* angular acceleration, and the origin's (in dynamics: minus gravity) */
    kt_v4 moment, force; /* wrench */
} kt_link_motion;

/* Where a link is, and how fast; by kinematics only. */
typedef struct kt_link_place {
    kt_v4 position, velocity; /* of the origin, world */
} kt_link_place;

/* A bearer in motion. Its place is base + local: from the world's origin to where its tree stands, and from there on,
 * so that what lies near to each other far from the world's origin is seen at its distance to the last digit. */
typedef struct kt_bearer_motion {
    kt_link_motion link; /* poses and angular velocity only */
    kt_v4 base, local, velocity;
} kt_bearer_motion;

/* Inertia that maps (alpha, a) to (moment, force): [J H; G M] with G = H', columns; and the bias wrench. */
typedef struct kt_articulated {
    kt_v4 j[3], g[3], h[3], m[3];
    kt_v4 moment, force;
} kt_articulated;

/* A one-axis joint accelerates by base - angular . alpha - linear . a of its parent. */
typedef struct kt_response {
    kt_v4 angular, linear;
    double base;
} kt_response;

static inline size_t kt_lanes8(size_t count) { return (count + 7) / 8 * 8; }

/* Every array of the data: type, name, count, meaning. */
#define KT_DATA_FIELDS(X)                                                                                              \
    X(kt_link_motion, motion, n->link, "motion of the links")                                                          \
    X(kt_response, response, n->link, "from the way back to the way out")                                              \
    X(kt_articulated, articulated, n->link, "articulated or composite inertias")                                       \
    X(kt_link_place, place, n->link, "places and velocities of the links")                                             \
    X(kt_bearer_motion, bearer, n->bearer, "motion of the links that effects ask for")                                 \
    X(double, bearer_sine, kt_lanes8(n->bearer_angle), "of these links' angles")                                       \
    X(double, bearer_cosine, kt_lanes8(n->bearer_angle), "of these links' angles")                                     \
    X(kt_planar_motion, planar, n->planar, "motion of the planar links; 0: the ground")                                \
    X(kt_planar_response, planar_response, n->planar, "from the way back to the way out")                              \
    X(kt_planar_inertia, planar_inertia, n->planar, "articulated or composite inertias")                               \
    X(double, planar_cosine, kt_lanes8(n->angle - n->spatial_angle), "of the planar links' angles")                    \
    X(double, planar_sine, kt_lanes8(n->angle - n->spatial_angle), "of the planar links' angles")                      \
    X(double, cosine, kt_lanes8(n->angle), "of the turning links' angles")                                             \
    X(double, sine, kt_lanes8(n->angle), "of the turning links' angles")                                               \
    X(double, scratch, kt_lanes8(n->v), "results before they are committed")                                           \
    X(double, tau, kt_lanes8(n->v), "joint forces of all effects")                                                     \
    X(double, moved_q, kt_lanes8(n->q), "a state beside the one evaluated")                                            \
    X(double, moved_v, kt_lanes8(n->v), "a state beside the one evaluated")                                            \
    X(double, assembled_q, kt_lanes8(n->q), "a state being assembled")                                                 \
    X(double, given_q, kt_lanes8(n->q), "the position that an assembly starts from")                                   \
    X(double, near_q, kt_lanes8(n->q), "a position nearer to the given one")                                           \
    X(double, assembled_v, kt_lanes8(n->v), "a state being assembled")                                                 \
    X(double, delta, kt_lanes8(n->v), "a step in positions or velocities")                                             \
    X(double, side, 3 * kt_lanes8(n->v), "accelerations at and beside a singular position")                            \
    X(double, dense, n->dense, "matrices of the groups of loops")                                                      \
    X(int32_t, pivot, n->row, "order of the equations, group by group")                                                \
    X(int32_t, rank, n->group, "of each group, as last factored")                                                      \
    X(kt_rows, factored, n->group, "which equations of each group")                                                    \
    X(double, last, n->group, "size of its last independent direction, where a group is near a singular position")     \
    X(bool, near, n->group, "whether a group is near a singular position, as last factored")                           \
    X(double, damping, n->group, "of each group's steps, as it is closed from far off")                                \
    X(double, gap, n->group, "sum of squares that a group is open by, as it is closed from far off")                   \
    X(bool, settled, n->group, "whether that is all that can be done for a group")                                     \
    X(double, beside_q, kt_lanes8(n->q), "a state beside a singular position")                                         \
    X(double, beside_v, kt_lanes8(n->v), "a state beside a singular position")                                         \
    X(kt_wrench, wrench, n->body, "wrenches on bodies: sums towards the root")                                         \
    X(kt_wrench, pushed, n->body, "wrenches on bodies: external ones and effects")                                     \
    X(kt_wrench, loaded, n->body, "wrenches on bodies: those and the loops'")                                          \
    X(kt_wrench, loop_wrench, n->loop, "reactions of loops")

struct kt_data {
    size_t bytes;
    const kt_model *model;
    void *owned; /* memory of kt_data_create, or NULL */
    bool beside; /* the last accelerations are those of states beside a singular position of the loops: poses and
                    equations are not those of the state that was asked for */
    kt_iterations iterations; /* since they were last asked for (kt_data_iterations) */
    kt_iterations closing;    /* of the last projection alone */
#define KT_DATA_DECLARE(type, name, count, meaning) type *name;
    KT_DATA_FIELDS(KT_DATA_DECLARE)
#undef KT_DATA_DECLARE
};

#endif
