/* The types of joints, loops, effects, shapes and functions of time as data: which keys an item of each type has in
 * scene files, with units, defaults and a line of help, the type's formula, and a scene that shows it.
 *
 * Scene files are read, written and checked by these keys. A program may make its forms and its own formats from them.
 * All of it is constant and needs no memory.
 */
#ifndef KINETREE_DESCRIPTOR_H
#define KINETREE_DESCRIPTOR_H

#include "kinetree/description.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a key holds: the type of the member that lies at its offset. */
typedef enum kt_key_kind {
    KT_KEY_NUMBER = 0, /* double */
    KT_KEY_SIX,        /* double[6]: along and about x, y, z */
    KT_KEY_VECTOR,     /* kt_vec3: components in a frame */
    KT_KEY_AXIS,       /* kt_vec3: a direction of any length; x, -x, y ... in scene files */
    KT_KEY_ROTATION,   /* kt_rotation */
    KT_KEY_FLAG,       /* bool */
    KT_KEY_FRAME,      /* kt_frame: world, body */
    KT_KEY_END,        /* kt_end */
    KT_KEY_ENDS,       /* kt_end[2] */
    KT_KEY_BODY,       /* kt_end: a body, whose point another key may give */
    KT_KEY_POINT,      /* kt_vec3: the point of that end; or one of its body's markers */
    KT_KEY_JOINT,      /* const char *: the name of a joint of one coordinate */
    KT_KEY_TERMS,      /* kt_loop.terms: names of such joints, a number each */
    KT_KEY_FUNCTION,   /* kt_function */
    KT_KEY_FUNCTIONS,  /* kt_function[3] */
    KT_KEY_DISTANCE, /* kt_effect.length: the distance of both ends at the start where kt_effect.initial_length is true */
    KT_KEY_POSITION,  /* kt_joint.position: as many numbers as the type has positions */
    KT_KEY_VELOCITY,  /* kt_joint.velocity */
    KT_KEY_ARMATURE,  /* kt_joint.armature: one number for all degrees of freedom, or one for each */
    KT_KEY_LIST,      /* kt_function.numbers: coefficients of a polynomial */
    KT_KEY_ROWS,      /* kt_function.numbers: rows [t, y] of a table */
    KT_KEY_METHOD,    /* kt_function.interpolation */
    KT_KEY_PARTS,     /* kt_function.parts */
    KT_KEY_FORMULA,   /* const char *: a formula (expression.h) */
    KT_KEY_SURFACE,   /* kt_surface */
    KT_KEY_TRACK,     /* kt_track */
    KT_KEY_POINTS,    /* kt_track.points: a list of [x, y, z] */
    KT_KEY_FORMULAS,  /* const char *[3]: one formula, or three */
    KT_KEY_CORNERS,   /* kt_shape.points: a list of [x, y] */
    KT_KEY_KIND_COUNT /* how many */
} kt_key_kind;

/* Which numbers a key may hold. All are finite; a default may be infinite. */
typedef enum kt_key_range {
    KT_RANGE_ANY = 0,      /* all */
    KT_RANGE_NOT_NEGATIVE, /* 0 or more */
    KT_RANGE_POSITIVE,     /* more than 0; a function of time, at all times */
} kt_key_range;

/* One key. */
typedef struct kt_key {
    const char *name; /* "stiffness"; keys of joints, shapes, surfaces and curves begin with "joint.", "shape." ... */
    kt_key_kind kind; /* what it holds */
    size_t offset;    /* of its member in kt_joint, kt_loop, kt_effect, kt_shape, kt_function, kt_surface or kt_track */
    const char *unit; /* "N/m"; "rad|m": the first in a turning joint, the second in a sliding one; "": none */
    const char *help; /* what it is, without the unit; NULL in a library for a machine without an operating system */
    const char *standard; /* its default in words; NULL: the value that the struct's _default has */
    const char *also;     /* another name that is read for it; NULL: none */
    kt_key_range range;   /* of its numbers */
    bool needed;          /* it has no default */
} kt_key;

/* What can be recorded of an effect, a number each. X(id, name, name in a sliding joint, unit, unit in a sliding joint,
 * what it is). Of effects with two ends a wrench is that on the second end, of a contact that on the sphere; axes and
 * points are the world's. */
#define KT_QUANTITY_LIST(X)                                                                                            \
    X(KT_QUANTITY_JOINT_FORCE, "torque", "force", "N m", "N", "in the joint, on its child")                            \
    X(KT_QUANTITY_TENSION, "force", "force", "N", "N", "along the line of the ends; positive: it pulls them together") \
    X(KT_QUANTITY_NORMAL, "normal", "normal", "N", "N", "normal force")                                                \
    X(KT_QUANTITY_FRICTION, "friction", "friction", "N", "N", "friction force, its magnitude")                         \
    X(KT_QUANTITY_FORCE_X, "fx", "fx", "N", "N", "force along x")                                                      \
    X(KT_QUANTITY_FORCE_Y, "fy", "fy", "N", "N", "force along y")                                                      \
    X(KT_QUANTITY_FORCE_Z, "fz", "fz", "N", "N", "force along z")                                                      \
    X(KT_QUANTITY_MOMENT_X, "mx", "mx", "N m", "N m", "moment about x, about the end's point")                         \
    X(KT_QUANTITY_MOMENT_Y, "my", "my", "N m", "N m", "moment about y, likewise")                                      \
    X(KT_QUANTITY_MOMENT_Z, "mz", "mz", "N m", "N m", "moment about z, likewise")                                      \
    X(KT_QUANTITY_POWER, "power", "power", "W", "W", "that it delivers to the mechanism; negative: takes")             \
    X(KT_QUANTITY_COORDINATE, "position", "position", "rad", "m", "of the joint")                                      \
    X(KT_QUANTITY_COORDINATE_RATE, "rate", "rate", "rad/s", "m/s", "of the joint")                                     \
    X(KT_QUANTITY_LENGTH, "length", "length", "m", "m", "distance of the ends")                                        \
    X(KT_QUANTITY_LENGTH_RATE, "rate", "rate", "m/s", "m/s", "at which that distance grows")                           \
    X(KT_QUANTITY_EXCESS, "depth", "depth", "rad", "m", "beyond the stop, below the plane; 0: it does not act")        \
    X(KT_QUANTITY_SLIP, "slip", "slip", "m/s", "m/s", "speed at which the surfaces slide")                             \
    X(KT_QUANTITY_POINT_X, "x", "x", "m", "m", "of the sphere's lowest point")                                         \
    X(KT_QUANTITY_POINT_Y, "y", "y", "m", "m", "likewise")                                                             \
    X(KT_QUANTITY_POINT_Z, "z", "z", "m", "m", "likewise")

/* The quantities. */
typedef enum kt_effect_quantity {
#define KT_QUANTITY_ENUM(id, name, sliding_name, unit, sliding_unit, help) id,
    KT_QUANTITY_LIST(KT_QUANTITY_ENUM)
#undef KT_QUANTITY_ENUM
        KT_QUANTITY_COUNT /* how many */
} kt_effect_quantity;

/* One type. Help, formula and example are NULL in a library for a machine without an operating system. */
typedef struct kt_descriptor {
    const char *name;    /* in scene files */
    const char *help;    /* what it is, in a line */
    const char *formula; /* some lines, without a line end after the last */
    const char *example; /* a scene, but for its first lines (`kinetree: 1` and `gravity`) and its last (`simulate`) */
    const kt_key *keys;  /* in the order in which they are written */
    int key_count;       /* length of keys */
    const kt_effect_quantity *quantities; /* of an effect: what can be recorded of it; NULL where help is */
    int quantity_count;                   /* length of quantities */
} kt_descriptor;

/* The descriptor of a type; NULL for a value that is none, and for KT_EFFECT_CUSTOM, which scene files do not have (that of
 * KT_LOOP_CUSTOM has the key `between` alone, and no words);
 * and of loops for all in a library for trees alone that is for a machine without an operating system. */
KT_API const kt_descriptor *kt_joint_descriptor(kt_joint_type type);
KT_API const kt_descriptor *kt_loop_descriptor(kt_loop_type type);
KT_API const kt_descriptor *kt_effect_descriptor(kt_effect_type type);
KT_API const kt_descriptor *kt_shape_descriptor(kt_shape_type type);
KT_API const kt_descriptor *kt_function_descriptor(kt_function_type type);
KT_API const kt_descriptor *kt_surface_descriptor(kt_surface_type type);
KT_API const kt_descriptor *kt_track_descriptor(kt_track_type type);

/* The first key of this name, or of this kind; NULL if the type has none, or if descriptor is NULL. O(keys). */
KT_API const kt_key *kt_descriptor_key(const kt_descriptor *descriptor, const char *name);
KT_API const kt_key *kt_descriptor_kind(const kt_descriptor *descriptor, kt_key_kind kind);

/* The number of equations of a loop: that of its type, less the contact of a rolling wheel where holonomic is false, and
 * the arc length of a curve where it is not given; 0 for a type that does not exist, and in a library without loops.
 * O(1). */
KT_API int kt_loop_equation_count(const kt_loop *loop);

/* The words of KT_QUANTITY_LIST: the name and the unit of a quantity, of an effect in a sliding joint or of any other,
 * and what it is. Static storage; "" for a value that is none. */
KT_API const char *kt_quantity_name(kt_effect_quantity quantity, bool sliding);
KT_API const char *kt_quantity_unit(kt_effect_quantity quantity, bool sliding);
KT_API const char *kt_quantity_help(kt_effect_quantity quantity);

/* What a coordinate of a joint measures. */
typedef enum kt_coordinate_kind {
    KT_COORDINATE_NONE = 0,    /* the joint has no such coordinate */
    KT_COORDINATE_ANGLE,       /* an angle; whole turns of it are the same position */
    KT_COORDINATE_TURNS,       /* an angle that counts its turns */
    KT_COORDINATE_LENGTH,      /* a length by itself */
    KT_COORDINATE_TRANSLATION, /* a component of a translation */
    KT_COORDINATE_ROTATION,    /* a component of a rotation: of a quaternion, and of an angular velocity */
} kt_coordinate_kind;

/* Of position k, or velocity k, of a joint of this type. O(1). */
KT_API kt_coordinate_kind kt_joint_coordinate_kind(kt_joint_type type, int k);

#ifdef __cplusplus
}
#endif
#endif
