/* A loop type: its equations as wrenches between two frames, or as a relation of joint positions. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_LOOP_H
#define KT_LOOP_LOOP_H

#include "algebra/real.h"
#include "base/isa.h"
#include "model/describe.h"
#include "model/model.h"

enum { KT_LOOP_ROW_MAX = 6 };

/* One end of a loop, in world axes. Positions and velocities are relative to the origin of the nearest common ancestor
 * of both ends, as if that origin were at rest. The ancestor's angular velocity is included. The ancestor's
 * accelerations are not, as a motion of both ends together changes no loop. alpha and linear are the accelerations for
 * zero joint accelerations. Only the reduction reads these; the equations do not. */
typedef struct kt_loop_end {
    kt_vector axes[3]; /* z is `axis` (second end: `axis2`, where the type has it) */
    kt_vector point;
    kt_vector omega, velocity;
    kt_real turn; /* about z, as the joints from the ancestor on count it; 0 unless the loop counts (kt_loop_kind) */
    kt_vector alpha, linear;
} kt_loop_end;

/* The ends in the given positions, world axes. */
typedef struct kt_loop_start {
    kt_pose end[2];
    double turn[2];  /* as in kt_loop_end */
    bool counted[2]; /* all joints from the ancestor on turn about z, or slide */
} kt_loop_start;

/* One equation phi = 0. With d = point_2 - point_1, and the second end's motion relative to the first's frame,
 *     w = omega_2 - omega_1,   u  = v_2 - v_1 - omega_1 x d,
 *     w' = alpha_2 - alpha_1, u' = a_2 - a_1 - alpha_1 x d (u' is this expression, not the rate of u) the rates are
 *     phi'  = moment . w  + force . u  + rate
 *     phi'' = moment . w' + force . u' + drift
 * (moment, force) is the wrench that a unit multiplier exerts on the second end at its point. The opposite wrench acts
 * on the first end at the same point. A row that is not holonomic has no phi; its equation is phi' = 0. */
typedef struct kt_loop_row {
    kt_vector moment, force;
    kt_real residual; /* phi; 0 where the row is not holonomic */
    kt_real rate;     /* partial derivative of phi by time: -b' */
    kt_real drift;    /* the part of phi'' that is not linear in accelerations; it alone depends on the velocities */
    bool holonomic;   /* the row has a residual */
} kt_loop_row;

/* A relation of joint positions: phi = sum of coefficient * position - f(t); or of their rates, phi' alone. */
typedef struct kt_relation_row {
    double residual, rate, drift; /* as above */
    double closes;                /* 1 where there is a residual, 0 of a relation of rates */
} kt_relation_row;

/* The kind of a row, for loops in a plane (planar_rows.c). The first three parts are d along an axis of end 1. The next
 * parts are the components of the relative rotation along that axis (orientation.h): of equal orientation, and of one
 * axis. The others are axes at right angles, distance, and any other row. A row of the last kind is evaluated in the
 * plane in the same way as in space.
 */
typedef enum kt_loop_part {
    KT_PART_NONE = 0, /* the type has no form in a plane */
    KT_PART_X,
    KT_PART_Y,
    KT_PART_Z,
    KT_PART_ROTATION_X,
    KT_PART_ROTATION_Y,
    KT_PART_ROTATION_Z,
    KT_PART_TILT_X,
    KT_PART_TILT_Y,
    KT_PART_NORMAL,
    KT_PART_DISTANCE,
    KT_PART_SPATIAL
} kt_loop_part;

/* A type is one file, compiled for every instruction set, const kt_loop_kind KT_KERNEL(kt_loop_spherical). The file is
 * compiled once more for derivatives (algebra/real.h), as if for one more instruction set. The descriptor, which is
 * compiled once, has the keys of the type. The ends, axes and joints that a type reads follow from the keys. */
typedef struct kt_loop_kind {
    int rows; /* the most that evaluate writes; 0: a relation of joint positions, which is one row */
    unsigned char part[KT_LOOP_ROW_MAX]; /* kt_loop_part of each row, or none at all */
    bool initial_angle;                  /* the loop reads the angle about the axis in the given positions */
    bool initial_distance; /* the loop's function, if not given, is the distance of the ends in the given positions */
    /* How many rows a loop has; NULL: all. Numbers of its own that it needs; NULL: none. Both of a checked loop. */
    int (*row_count)(const kt_loop *loop);
    size_t (*number_count)(const kt_loop *loop);
    /* Copies the members of the loop that the type needs into the record; the loop is not read later. Fills the type's
     * numbers from record->number on. NULL: pitch, radius and holonomic are enough. */
    void (*prepare)(const kt_description *description, const kt_loop *loop, double *numbers, kt_loop_record *record);
    /* Completes the record from the ends in the given positions, world axes. Returns false, with the reason in *error,
     * if the loop does not fit them. NULL: nothing to complete. */
    bool (*start)(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error);
    /* The wrench on the second end, about its point, for multipliers of the rows: where it is not their sum, as rows
     * give only the part that does work. NULL: the sum. */
    void (*load)(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                 kt_vector *force);
    /* The arc length of the point of a curve that is nearest to p, in the first end's frame; NULL: no curve. */
    double (*arc_length)(const kt_loop_record *loop, const double *numbers, const double p[3]);
    /* Writes the rows and returns their number, which does not depend on the state. */
    int (*evaluate)(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows);
    /* sum: the sum of coefficient * position. */
    kt_relation_row (*relate)(const kt_loop_record *loop, const double *numbers, double sum, double t);
} kt_loop_kind;

/* The list of kinds: the types of scene files, and the loops that a caller defines. */
enum { KT_LOOP_KIND_CUSTOM = KT_LOOP_TYPE_COUNT, KT_LOOP_KIND_COUNT };

/* The bodies that roll (kt_loop_record.form): a thin disc; for hard contacts a ball, a disc that may leave its plane,
 * or a ball on another ball. */
enum { KT_ROLLING_DISC, KT_ROLLING_BALL, KT_ROLLING_RIM, KT_ROLLING_BALLS };

static inline int32_t kt_loop_kind_index(kt_loop_type type) {
    return type == KT_LOOP_CUSTOM ? (int32_t)KT_LOOP_KIND_CUSTOM : (int32_t)type;
}

/* Whether there is such a type. */
static inline bool kt_loop_type_exists(kt_loop_type type) {
    return type == KT_LOOP_CUSTOM || (unsigned)type < KT_LOOP_TYPE_COUNT;
}

#define KT_LOOP_AT(member) offsetof(kt_loop, member)

/* The beginning of an example: a free box, to be held by a loop. */
#define KT_EXAMPLE_BOX                                                                                                 \
    "bodies:\n"                                                                                                        \
    "  - name: box\n"                                                                                                  \
    "    joint: {type: free}\n"                                                                                        \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"                                                                  \
    "    markers: {corner: [0.1, 0.15, 0.2]}\n"                                                                        \
    "loops:\n"

/* For a loop whose type exists: whether the loop relates joint positions, not frames. Then the terms of a
 * relation, and the axis of an end. */
bool kt_loop_is_relation(kt_loop_type type);
int kt_loop_term_count(const kt_loop *loop);
kt_term kt_loop_term(const kt_loop *loop, int k);
kt_vec3 kt_loop_axis(const kt_loop *loop, int end);

/* The change of the residual of an equation if joints move by their units: 1 rad, or the mechanism's length. */
double kt_loop_unit(const kt_model *model, int loop, int row);

/* Computes the planar form of a loop from the poses of its ends in the plane's basis (e1, e2, n) at q = 0. Fills all
 * but arms and places. Returns false if the type, or its equations out of the plane, have no planar form. For
 * relations, returns true and fills nothing. `direction` and `length` are the bounds below which a number counts as
 * zero. */
bool kt_loop_planar_rows(const kt_loop *loop, const kt_pose end[2], double direction, double length,
                         kt_planar_loop *flat);

#ifdef KT_DUAL
extern const kt_loop_kind *const kt_loop_kinds_dual[KT_LOOP_KIND_COUNT];
#else
extern const kt_loop_kind *const kt_loop_kinds_baseline[KT_LOOP_KIND_COUNT];
extern const kt_loop_kind *const kt_loop_kinds_v3[KT_LOOP_KIND_COUNT];
extern const kt_loop_kind *const kt_loop_kinds_v4[KT_LOOP_KIND_COUNT];
#endif

#endif
