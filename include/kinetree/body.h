/* Bodies in plain structs: the joint on the parent, mass and inertia, markers, shapes.
 *
 * Units: SI and radians.
 * Frame: a body has one joint, which connects it with its parent. Without its own name, a joint has the name of its
 * body. The body frame is the child side of the joint: at joint position zero, the body frame coincides with the joint
 * frame. The world is the parent of bodies without a named parent.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_BODY_H
#define KINETREE_BODY_H

#include "kinetree/algebra.h"
#include "kinetree/function.h"

#ifdef __cplusplus
extern "C" {
#endif

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

/* The joints between a body and its parent; kt_joint lists their coordinates. */
typedef enum kt_joint_type {
#define KT_JOINT_ENUM(id, name, nq, nv) id,
    KT_JOINT_LIST(KT_JOINT_ENUM)
#undef KT_JOINT_ENUM
        KT_JOINT_TYPE_COUNT /* how many */
} kt_joint_type;

/* The largest numbers of coordinates of a joint. */
enum { KT_JOINT_NQ_MAX = 7 /* positions */, KT_JOINT_NV_MAX = 6 /* velocities */ };

/* Parts of a joint's initial state, as bits. */
enum {
    KT_GIVEN_POSITION = 1,    /* positions without a quaternion; x, y, z of a free joint */
    KT_GIVEN_ORIENTATION = 2, /* the quaternion of a spherical or free joint */
    KT_GIVEN_VELOCITY = 4,    /* velocities; the linear velocity of a free joint */
    KT_GIVEN_ANGULAR = 8,     /* the angular velocity of a free joint */
};

/* The design limits of a joint with one coordinate. The limits are data for programs that command the joint, and
 * readers of robot formats fill them in. No computation uses these limits; the effect joint_limit makes a stop.
 * Infinity means no limit. */
typedef struct kt_joint_limits {
    double lower, upper; /* of the position, rad or m; lower <= upper */
    double velocity;     /* the largest speed, rad/s or m/s, >= 0 */
    double effort;       /* the largest torque or force of its drive, N m or N, >= 0 */
} kt_joint_limits;

/* How a body moves on its parent. The coordinates are, in this order:
 *   "revolute", "screw": angle.
 *   "prismatic": length.
 *   "cylindrical": angle, length.
 *   "universal": angle about axis, angle about axis2.
 *   "planar": x, y, angle. The axes x and y are the in-plane axes of kt_triad_from_axis(axis, 2), in the joint frame.
 *   "spherical": quaternion; angular velocity in the body frame.
 *   "free": x, y, z in the joint frame, quaternion; linear velocity in the joint frame, angular velocity in the body
 *     frame.
 * A quaternion of four zeros means no rotation.
 * A part of the initial state counts as given if the part is not zero, or if `given` names it. An assembly moves a
 * given part only if moving the other parts cannot close the loops (kt_state_assemble). */
typedef struct kt_joint {
    const char *name;                 /* as a body's; the only joint of its name; NULL: that of its body */
    kt_joint_type type;               /* default: fixed */
    kt_vec3 axis;                     /* in the joint frame; any non-zero length */
    kt_vec3 axis2;                    /* universal: second axis, which moves with the first rotation; zero: the axis
                                         after `axis` (z, x, y, z ...) */
    double pitch;                     /* screw: m per radian */
    kt_vec3 at;                       /* origin of the joint frame in the parent's body frame, m */
    kt_rotation rotation;             /* of the joint frame relative to the parent's body frame */
    double position[KT_JOINT_NQ_MAX]; /* initial positions, as many as the type has, rad or m */
    double velocity[KT_JOINT_NV_MAX]; /* initial velocities, rad/s or m/s */
    double armature[KT_JOINT_NV_MAX]; /* rotor inertia at each degree of freedom, kg m^2 or kg; not negative,
                                         default: 0 */
    bool guess;                       /* the positions are only the start of the assembly: they count as not given */
    unsigned given;                   /* KT_GIVEN_ bits: parts that are given even if they are zero; default: none */
    kt_joint_limits limits;           /* of a joint with one coordinate; default: none */
} kt_joint;

/* Returns the KT_GIVEN_ bits of all given parts: the parts that `given` names, and the parts that are not zero. A
 * quaternion of four zeros is never given, nor are the positions of a guess. Returns 0 for a fixed joint, for an
 * unknown type, and for NULL.
 * Cost: O(1). */
KT_API unsigned kt_joint_given(const kt_joint *joint);

/* A named frame of a body. A struct of zeros with a name is a marker at the body's origin, along its axes. */
typedef struct kt_marker {
    const char *name;     /* as a body's; the only marker of its name on its body */
    kt_vec3 at;           /* its origin, body frame, m */
    kt_rotation rotation; /* of its axes, relative to the body frame */
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

/* The types of solids. */
typedef enum kt_shape_type {
#define KT_SHAPE_ENUM(id, name) id,
    KT_SHAPE_LIST(KT_SHAPE_ENUM)
#undef KT_SHAPE_ENUM
        KT_SHAPE_TYPE_COUNT /* how many */
} kt_shape_type;

/* A solid for pictures. A body may take its com and its inertia from the uniform solid. */
typedef struct kt_shape {
    kt_shape_type type;   /* default: none */
    kt_vec3 from, to;     /* rod: its ends, body frame, m */
    kt_vec3 at;           /* others: the centre, or the origin of a polygon's corners, body frame, m */
    kt_rotation rotation; /* box, cylinder, polygon: of the solid's axes relative to the body's */
    kt_vec3 size;         /* box: edge lengths, m */
    double radius;        /* rod (0: slender), sphere, cylinder, m */
    double length;        /* cylinder; polygon: its thickness along z, half on either side, m */
    kt_vec3 axis;         /* cylinder: its axis, in the solid's axes */
    const double *points; /* polygon: x, y of each corner relative to `at`, in order around it, m; the caller's */
    int point_count;      /* corners */
} kt_shape;

/* The mass of a body as a function of time: fuel burns, a vessel leaks, a belt is loaded. The com is constant in the
 * body. The members mass, com and inertia of kt_body belong together, preferably as the values at t = 0. Mass leaves or
 * arrives with the velocity of the body. If the mass has another velocity, an effect of type thrust adds the force. */
typedef struct kt_variable_mass {
    kt_function mass;       /* kg; above 0 at all times */
    kt_function inertia[6]; /* xx, yy, zz, xy, xz, yz about the com, body axes, kg m^2. If none is given (default), the
                               inertia is proportional to the mass. If some are given, the others are 0 */
} kt_variable_mass;

/* A rigid body, and the joint that connects it with its parent. */
typedef struct kt_body {
    const char *name;                      /* [A-Za-z_][A-Za-z0-9_-]* */
    const char *parent;                    /* name of a body; NULL or "world": the world */
    kt_joint joint;                        /* on the parent */
    double mass;                           /* kg */
    kt_vec3 com;                           /* centre of mass, body frame, m */
    kt_sym3 inertia;                       /* about the com, body axes, kg m^2 */
    bool com_of_shape;                     /* take the com from the shape and `mass`, and ignore `com` */
    bool inertia_of_shape;                 /* take the inertia from the shape and `mass`, and ignore `inertia` */
    kt_shape shape;                        /* for pictures; also for com and inertia if one of these two is set */
    const kt_shape *shapes;                /* further ones, for pictures alone: the caller's; NULL: none */
    int shape_count;                       /* length of shapes */
    const kt_variable_mass *variable_mass; /* the caller's; NULL (default): the mass is constant */
    const kt_marker *markers;              /* the caller's; NULL: none */
    int marker_count;                      /* length of markers */
} kt_body;

/* Returns a struct with the default values: no motion (fixed joint), axes z, no mass, no shape. */
KT_API kt_joint kt_joint_default(void);
KT_API kt_shape kt_shape_default(void);
KT_API kt_body kt_body_default(void);

/* Returns the name of a type in scene files ("revolute", "rod"), or NULL for an unknown value. */
KT_API const char *kt_joint_type_name(kt_joint_type type);
KT_API const char *kt_shape_type_name(kt_shape_type type);

/* Returns the volume of a shape, m^3; zero for points and slender rods, NaN for NULL. */
KT_API double kt_shape_volume(const kt_shape *shape);

/* Computes the com and the inertia of a body, from its shape if the body requests that (com_of_shape,
 * inertia_of_shape).
 * Errors: KT_ERROR_MODEL if the shape cannot have a mass (no solid, or a negative size). */
KT_API KT_CHECKED kt_status kt_body_inertia(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
