/* Experimental. The types of joints, loops, effects, shapes and functions of time as data. Each type has the keys of an
 * item in scene files, with units, defaults and a line of help. Each type also has its formula, and an example scene.
 *
 * Scene files are read, written and checked with these keys. A program may use them for its own forms and formats. All
 * data are constant and need no memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_DESCRIPTOR_H
#define KINETREE_DESCRIPTOR_H

#include "kinetree/description.h"
#include "kinetree/quantity.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The type of a key's value: the type of the member at its offset. */
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
    KT_KEY_DISTANCE,  /* kt_effect.length: the distance of both ends at the start if kt_effect.initial_length is true */
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
    KT_KEY_PATH,      /* kt_effect.path: a list of points and surfaces */
    KT_KEY_LOOP,      /* const char *: the name of a loop between two ends */
    KT_KEY_ACTUATORS, /* kt_effect.actuators: a list of actuators */
    KT_KEY_BOUND,     /* double: a bound of the sum of actuators, which is no parameter of a model */
    KT_KEY_SPRING,    /* kt_effect.spring */
    KT_KEY_KIND_COUNT /* how many */
} kt_key_kind;

/* The numbers that a key may hold. All are finite; a default may be infinite. */
typedef enum kt_key_range {
    KT_RANGE_ANY = 0,      /* all */
    KT_RANGE_NOT_NEGATIVE, /* 0 or more */
    KT_RANGE_POSITIVE,     /* more than 0; a function of time, at all times */
} kt_key_range;

/* One key. */
typedef struct kt_key {
    const char *name; /* "stiffness"; keys of joints, shapes, surfaces and curves begin with "joint.", "shape." ... */
    kt_key_kind kind; /* the type of its value */
    size_t offset;    /* of its member in kt_joint, kt_loop, kt_effect, kt_shape, kt_function, kt_surface or kt_track */
    const char *unit; /* "N/m"; "rad|m": the first in a turning joint, the second in a sliding one; "": none */
    const char *help; /* meaning, without the unit; NULL in a library for a machine without an operating system */
    const char *standard; /* its default in words; NULL: the value in the struct of the _default function */
    const char *also;     /* an alternative name that is read as well; NULL: none */
    kt_key_range range;   /* of its numbers */
    bool needed;          /* it has no default */
} kt_key;

/* One type. Help, formula and example are NULL in a library for a machine without an operating system. */
typedef struct kt_descriptor {
    const char *name;    /* in scene files */
    const char *help;    /* meaning, in a line */
    const char *formula; /* some lines, without a line end after the last */
    const char *example; /* a scene without its first lines (`kinetree: 1` and `gravity`) and without its last line
                            (`simulate`) */
    const kt_key *keys;  /* in the order of written files */
    int key_count;       /* length of keys */
    const kt_effect_quantity *quantities; /* of an effect: the quantities that can be recorded; NULL if help is */
    int quantity_count;                   /* length of quantities */
} kt_descriptor;

/* Returns the descriptor of a type; NULL for an invalid value. Returns NULL for KT_EFFECT_CUSTOM, too, because scene
 * files do not have this type. The descriptor of KT_LOOP_CUSTOM has only the key `between`, and no texts. */
KT_API const kt_descriptor *kt_joint_descriptor(kt_joint_type type);
KT_API const kt_descriptor *kt_loop_descriptor(kt_loop_type type);
KT_API const kt_descriptor *kt_effect_descriptor(kt_effect_type type);
KT_API const kt_descriptor *kt_shape_descriptor(kt_shape_type type);
KT_API const kt_descriptor *kt_function_descriptor(kt_function_type type);
KT_API const kt_descriptor *kt_surface_descriptor(kt_surface_type type);
KT_API const kt_descriptor *kt_track_descriptor(kt_track_type type);

/* Returns the first key of this name, or of this kind; NULL if the type has none, or if descriptor is NULL. O(keys). */
KT_API const kt_key *kt_descriptor_key(const kt_descriptor *descriptor, const char *name);
KT_API const kt_key *kt_descriptor_kind(const kt_descriptor *descriptor, kt_key_kind kind);

/* Returns the number of equations of a loop, which may depend on its members as well as on its type. A rolling wheel
 * with holonomic = false has no equation for its contact, and a wheel with a side has only the equation of its contact.
 * A curve without an arc length has no equation for the arc length. KT_LOOP_CUSTOM has kt_loop.equation_count
 * equations. Returns 0 for a type that does not exist. O(1). */
KT_API int kt_loop_equation_count(const kt_loop *loop);

/* The meaning of a coordinate of a joint. */
typedef enum kt_coordinate_kind {
    KT_COORDINATE_NONE = 0,    /* the joint has no such coordinate */
    KT_COORDINATE_ANGLE,       /* an angle; whole turns of it are the same position */
    KT_COORDINATE_TURNS,       /* an angle that counts its turns */
    KT_COORDINATE_LENGTH,      /* a length by itself */
    KT_COORDINATE_TRANSLATION, /* a component of a translation */
    KT_COORDINATE_ROTATION,    /* a component of a rotation: of a quaternion, and of an angular velocity */
} kt_coordinate_kind;

/* Returns the kind of position k, or velocity k, of a joint of this type. O(1). */
KT_API kt_coordinate_kind kt_joint_coordinate_kind(kt_joint_type type, int k);

#ifdef __cplusplus
}
#endif
#endif
