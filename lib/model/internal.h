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

/* A joint type: one file of lib/joint each. `elements` writes up to KT_ELEMENT_MAX elements and returns their number;
 * the joint has been checked before. Coordinates follow the elements. */
typedef struct kt_joint_kind {
    int nq, nv;
    int (*elements)(const kt_joint *joint, kt_element *elements);
} kt_joint_kind;

extern const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT];

typedef struct kt_link {
    kt_v4 at;         /* origin of the joint frame in the parent link's frame */
    kt_v4 turn[3];    /* this link's axes at rest (q = 0) in the parent link's frame, columns */
    kt_v4 inertia[3]; /* of all bodies on the link, about its origin, link axes */
    kt_v4 moment;     /* first moment m c, link axes */
    double mass;
    double pitch;
    int32_t parent;
    int32_t q, v;   /* first coordinate */
    int32_t angle;  /* place among the turning links' sines and cosines */
    int32_t body;   /* whose joint it is part of */
    uint8_t motion; /* kt_motion */
    uint8_t axis;   /* 0, 1, 2 */
    bool turned;    /* `turn` is not the identity */
    bool follows;   /* its parent is the link before it */
    bool branches;  /* some child does not follow it directly */
    bool leads;     /* the next link is its child */
} kt_link;

/* A body of the caller's. */
typedef struct kt_body_record {
    kt_pose in_link; /* body frame in its link's frame */
    kt_pose joint;   /* joint frame in the parent's body frame */
    kt_sym3 inertia; /* own, about the com, body axes */
    kt_vec3 com;     /* body frame */
    double mass;
    int32_t link;
    int32_t parent;
    int32_t type; /* kt_joint_type */
    int32_t q, v; /* first coordinate */
    int32_t source; /* index in the description */
    int32_t marker, marker_count;
    uint32_t name; /* offset in the model's text */
} kt_body_record;

typedef struct kt_marker_record {
    kt_vec3 at;
    uint32_t name;
} kt_marker_record;

typedef struct kt_counts {
    size_t link, body, marker, q, v, angle, text, index;
} kt_counts;

/* Every array of a model: type, name, count, meaning. One list declares, measures and places. */
#define KT_MODEL_FIELDS(X)                                                                                             \
    X(kt_link, link, n->link, "elementary joints and what they carry")                                                 \
    X(kt_body_record, body, n->body, "the caller's bodies")                                                            \
    X(kt_marker_record, marker, n->marker, "named points, body by body")                                               \
    X(double, q0, n->q, "initial positions")                                                                           \
    X(double, v0, n->v, "initial velocities")                                                                          \
    X(double, zero, n->v, "zeros, where a caller gives no velocities, accelerations or forces")                        \
    X(int32_t, angle, n->angle, "positions that are angles of turning links")                                          \
    X(char, text, n->text, "names, each terminated")                                                                   \
    X(char, index, n->index, "table of names")

struct kt_model {
    size_t bytes;
    kt_counts n;
    kt_v4 gravity;
    double mass; /* of all bodies that move */
    kt_level level;
    uint32_t name;  /* offset in text */
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

/* ---- the workspace ------------------------------------------------------------------------------------------------ */

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
    X(double, cosine, kt_lanes8(n->angle), "of the turning links' angles")                                             \
    X(double, sine, kt_lanes8(n->angle), "of the turning links' angles")                                               \
    X(double, scratch, kt_lanes8(n->v), "results before they are committed")                                           \
    X(kt_wrench, wrench, n->body, "wrenches on bodies")

struct kt_data {
    size_t bytes;
    const kt_model *model;
    void *owned; /* memory of kt_data_create, or NULL */
#define KT_DATA_DECLARE(type, name, count, meaning) type *name;
    KT_DATA_FIELDS(KT_DATA_DECLARE)
#undef KT_DATA_DECLARE
};

#endif
