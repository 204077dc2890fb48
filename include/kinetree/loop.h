/* Loops: the constraints between links that are not joints of the tree. This header gives the loops of a model, and the
 * rows of their equations. The header description.h describes loops (kt_loop), and reduction.h describes the quantities
 * that are computed from loops.
 *
 * A loop on the tree coordinates u is phi(u, t) = 0. Velocities and accelerations satisfy A v = b' and A a = b'' [MSD
 * 7.4, 7.28]. Rolling has only the rows A v = b' [MSD 4.17]. Residuals of orientations are of first order in the error.
 * Therefore a loop type has as many equations as it removes degrees of freedom (KT_LOOP_LIST has the numbers).
 *
 * Loops are in the order of the description, counted from 0. Every call is O(1) unless its docstring gives another
 * cost, allocates nothing and cannot fail.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_LOOP_H
#define KINETREE_LOOP_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Return the number of loops of a model, the name of a loop, and its type. A name is valid as long as the model. */
KT_API int kt_loop_count(const kt_model *model);
KT_API const char *kt_loop_name(const kt_model *model, int loop);
KT_API kt_loop_type kt_loop_type_of(const kt_model *model, int loop);
/* Returns the side that a loop bounds, also for a hard stop or contact. Returns KT_SIDE_NONE for a bilateral loop, or
 * if there is no such loop.
 * Cost: O(1). */
KT_API kt_side kt_loop_side(const kt_model *model, int loop);
/* Returns whether a loop represents sticking friction (kt_effect.stick); false if there is no such loop.
 * Cost: O(1). */
KT_API bool kt_loop_is_stick(const kt_model *model, int loop);

/* Returns the index of the loop with this name, or -1 if there is none.
 * Cost: O(loops). */
KT_API int kt_loop_find(const kt_model *model, const char *name);

/* The equations of a loop among the equations of all loops. The indices refer to rows of the matrix and entries of the
 * vectors that kt_loop_equations writes. */
typedef struct kt_loop_rows {
    int first; /* index of the first row */
    int count; /* number of rows */
} kt_loop_rows;

/* Returns the rows of one loop. */
KT_API kt_loop_rows kt_loop_rows_of(const kt_model *model, int loop);

/* The quantity that the residual of an equation measures. */
typedef enum kt_loop_measure {
    KT_MEASURE_LENGTH = 0, /* m */
    KT_MEASURE_ANGLE,      /* rad, to first order: 4 tan(angle / 4). For two axes to be normal: 2 tan(angle / 2) */
    KT_MEASURE_SUM,        /* of joint positions, rad or m */
    KT_MEASURE_NONE,       /* no residual: an equation of velocities alone */
} kt_loop_measure;

/* Returns the measure of one equation of a loop, 0 <= row < kt_loop_rows_of(...).count. */
KT_API kt_loop_measure kt_loop_measure_of(const kt_model *model, int loop, int row);

/* Returns the angle by which an equation of measure KT_MEASURE_ANGLE is violated, given its residual. Rows are counted
 * as above.
 * Units: rad.
 * Cost: O(1). */
KT_API double kt_loop_residual_angle(const kt_model *model, int loop, int row, double residual);

/* The disagreement of redundant equations. If the data of a mechanism are rounded, redundant equations contradict
 * each other. An example is a pair of hinges whose axes should coincide but differ by 1e-8 rad. Up to
 * kt_description.tolerance, the ends of loops are moved by the smallest amount that makes the equations consistent.
 * If no such displacement is found, the loops are closed in the sense of least squares, and the redundant part is
 * omitted. */
typedef struct kt_loop_disagreement {
    double length; /* the largest residual that the data leave in the loop's length equations, m; 0: none */
    double angle;  /* likewise for the angle equations, rad */
} kt_loop_disagreement;

/* Returns the disagreement of a loop, as found at several positions during compilation.
 * Cost: O(1). */
KT_API kt_loop_disagreement kt_loop_disagreement_of(const kt_model *model, int loop);

/* ---- relative coordinates -----------------------------------------------------------------------------------------
 *
 * The relative motion of the ends of a loop [MSD 6.2]: the displacement d and the rotation between the ends. The loop
 * fixes some of these coordinates and leaves others free, such as the angle of a hinge that closes a linkage. */

/* The motion of the second end relative to the first end.
 * Frame: the first end's frame, z along the loop's axis; rates are relative to this frame. */
struct kt_loop_motion {
    kt_vec3 position; /* d, of the second end's point, m */
    kt_mat3 rotation; /* R: columns are the second end's axes */
    kt_vec3 velocity; /* u = d', m/s */
    kt_vec3 omega;    /* w, rad/s: R' = w x R */
};

/* Computes the relative motion in the state of the last kt_kinematics_update with these data. Returns false, and leaves
 * *motion untouched, if there is no such loop, or if the loop has no ends (a relation of joints).
 * Cost: O(1). */
KT_API bool kt_loop_motion_evaluate(const kt_model *model, const kt_data *data, int loop, kt_loop_motion *motion);

/* Returns the joint type whose motion a loop leaves free, and the numbers of its coordinates, if the loop requests
 * coordinates (kt_loop.coordinates). Otherwise nq and nv are 0. The members q and v are 0, because a state has no such
 * coordinates. */
KT_API kt_coordinates kt_loop_coordinates(const kt_model *model, int loop);

/* Computes the coordinates of such a loop, as those of a joint with the same ends: nq positions and nv velocities. The
 * state is that of the last kt_kinematics_update with these data; q (nq of the model) has its positions. The joints of
 * the loop count the whole turns of an angle if all of them turn about parallels of its axis; at the initial positions,
 * the angle is within half a turn. Otherwise the angle is within half a turn. A quaternion has w >= 0. Returns false,
 * and leaves the outputs untouched, if the loop has no such coordinates.
 * Cost: O(joints of the loop). */
KT_API bool kt_loop_coordinates_evaluate(const kt_model *model, const kt_data *data, int loop, const double *q,
                                         double *positions, double *velocities);

/* Returns the arc length at the nearest point of the curve, for a loop of type `curve` in that state; NaN for any other
 * loop.
 * Units: m. */
KT_API double kt_loop_arc_length(const kt_model *model, const kt_data *data, int loop);

/* ---- loops of a caller's own -------------------------------------------------------------------------------------
 *
 * The caller can define a constraint between two ends that no loop type covers. The constraint consists of one to six
 * equations for the motion of the second end relative to the first. This relative motion does not change if both ends
 * move together, so every such loop is invariant under common motions.
 *
 *     static int keep_off(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equation) {
 *         const double length = *(const double *)user;
 *         (void)t;
 *         equation->residual = kt_vec3_norm(motion->position) - length;
 *         return 0;
 *     }
 *
 * The description then refers to the callback. Its user pointer must outlive the model:
 *
 *     double length = 2.0;
 *     kt_loop loop = kt_loop_default();
 *     loop.name = "sling";
 *     loop.type = KT_LOOP_CUSTOM;
 *     loop.between[0].body = "mast";
 *     loop.between[1].body = "boat";
 *     loop.equations = keep_off;
 *     loop.equation_count = 1;
 *     loop.user = &length;
 *     description.loops = &loop;
 *     description.loop_count = 1;
 *
 * Only the residual is required. Moments, forces and rates are then central differences of order four. The steps are
 * 1e-3 of a radian, of a second, and of 1 m + |position|. These differences are accurate to about 1e-12. Then the drift
 * is a second difference of order six, accurate to about 1e-10 of the numbers in the callback, if the callback is
 * smooth on the scale of 0.03.
 *
 * If a callback also gives the rows (KT_LOOP_GIVES_ROWS), the drift is a first difference. A callback that gives all
 * quantities is as exact as the types of the library. A loop without residuals (holonomic = false: rolling, skates)
 * must give its rows. Derivatives of accelerations difference the callback once more. Loops of the caller work in space
 * and in the plane, with every reduction, projection, reaction and formulation. Scene files have no such loops.
 *
 * A callback is a function of its arguments alone, like the callbacks of effects (effect.h). The library may call the
 * function in any state, even far from a closed state, and from several threads that share the model at the same time.
 * The callback must not allocate memory. Return values: 0: done;
 *   > 0: the equations cannot be computed in this state. An adaptive method then tries a smaller step; otherwise the
 *     call fails with KT_ERROR_CONSTRAINT.
 *   < 0: stop. The call fails with KT_ERROR_CALLBACK.
 * The error names the loop, the time and the returned number. */

/* One equation, in the first end's frame:
 *     phi'  = moment . w  + force . u  + rate
 *     phi'' = moment . w' + force . u' + drift
 * The pair (moment, force) is the wrench of a unit multiplier on the second end, about the point of this end. The first
 * end receives the opposite wrench. */
struct kt_loop_equation {
    kt_vec3 moment;  /* moment of a unit multiplier on the second end, about its point */
    kt_vec3 force;   /* likewise */
    double residual; /* phi; not read if the loop is not holonomic */
    double rate;     /* partial derivative of phi with respect to time */
    double drift;    /* the part of phi'' without accelerations */
};

#ifdef __cplusplus
}
#endif
#endif
