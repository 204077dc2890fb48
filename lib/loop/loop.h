/* What a loop type tells the reduction: its equations as wrenches between two frames, or as a relation of joint
 * positions.
 */
#ifndef KT_LOOP_LOOP_H
#define KT_LOOP_LOOP_H

#include "algebra/real.h"
#include "base/isa.h"
#include "model/model.h"

enum { KT_LOOP_ROW_MAX = 6 };

/* One end of a loop. World axes; places and velocities are counted from the origin of the ancestor that carries both
 * ends, as if that origin were at rest; its angular velocity counts, its accelerations do not (a motion of both ends
 * together changes no loop). alpha and linear are what the velocities alone give: the accelerations for zero joint
 * accelerations. The equations do not read these two; who uses them does. */
typedef struct kt_loop_end {
    kt_vector axes[3]; /* z is `axis` (second end: `axis2`, where the type has it) */
    kt_vector point;
    kt_vector omega, velocity;
    kt_vector alpha, linear;
} kt_loop_end;

/* One equation phi = 0. With d = point_2 - point_1, and the second end's motion relative to the first's frame,
 *     w = omega_2 - omega_1,   u  = v_2 - v_1 - omega_1 x d,
 *     w' = alpha_2 - alpha_1,  u' = a_2 - a_1 - alpha_1 x d      (u' is this, not the rate of u)
 * it is
 *     phi'  = moment . w  + force . u  + rate
 *     phi'' = moment . w' + force . u' + drift
 * (moment, force) is the wrench that a unit multiplier exerts on the second end at its point; the first end feels the
 * opposite wrench at the same point. A row that is not holonomic has no phi, and its phi' is what must vanish. */
typedef struct kt_loop_row {
    kt_vector moment, force;
    kt_real residual; /* phi; 0 where the row is not holonomic */
    kt_real rate;     /* partial derivative of phi by time: -b' */
    kt_real drift;    /* what of phi'' is not linear in accelerations; needs the velocities, all else does not */
    bool holonomic;   /* the row has a residual to be closed */
} kt_loop_row;

/* A relation: sum of coefficient * position - f(t). */
typedef struct kt_relation_row {
    double residual, rate, drift; /* as above; drift = -f'' */
} kt_relation_row;

/* What a row is made of, for loops in a plane (flat.c): phi along an axis of end 1; the component of the relative
 * rotation along one (orientation.h: equal orientation; one axis); axes at right angles; distance. */
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
    KT_PART_DISTANCE
} kt_loop_part;

/* One file a type, each compiled for every instruction-set level: const kt_loop_kind KT_KERNEL(kt_loop_spherical); and
 * once more for derivatives, as if that were one more level, `tangent` (algebra/number.h). */
typedef struct kt_loop_kind {
    int rows; /* of a frame loop: at most; 0: a relation of joint positions, which is one row */
    unsigned char part[KT_LOOP_ROW_MAX]; /* kt_loop_part of each row, or none at all */
    /* Writes the rows and returns their number, which does not depend on the state. */
    int (*evaluate)(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows);
    /* sum: of coefficient * position. */
    kt_relation_row (*relate)(const kt_loop_record *loop, const double *numbers, double sum, double t);
} kt_loop_kind;

/* Equations of a loop: as many as its type has (rolling: 3 with contact). */
int kt_loop_row_count(const kt_loop *loop);

/* A loop as it lies in a plane: fills all but arms and places from the ends' poses in the plane's basis (e1, e2, n) at
 * q = 0; false where the type, or what it holds out of the plane, cannot be had in the plane. `direction` and `length`:
 * what passes for zero. Of relations it is true, and nothing is filled. */
bool kt_loop_planar_rows(kt_loop_type type, const kt_pose end[2], double direction, double length,
                         kt_planar_loop *flat);

#ifdef KT_DUAL
extern const kt_loop_kind *const kt_loop_kinds_dual[KT_LOOP_TYPE_COUNT];
#else
extern const kt_loop_kind *const kt_loop_kinds_baseline[KT_LOOP_TYPE_COUNT];
extern const kt_loop_kind *const kt_loop_kinds_v3[KT_LOOP_TYPE_COUNT];
extern const kt_loop_kind *const kt_loop_kinds_v4[KT_LOOP_TYPE_COUNT];
#endif

#endif
