/* Loops: the constraints between links that a tree cannot carry. The loops of a model, and the rows of their equations;
 * description.h has how they are described (kt_loop), and reduction.h what is computed of them.
 *
 * A loop of u tree coordinates is phi(u, t) = 0, with A v = b' and A a = b'' for velocities and accelerations [MSD 7.4,
 * 7.28]; rolling has rows A v = b' alone [MSD 4.17]. Residuals of orientations are of first order in the error, so that
 * a type has as many equations as it removes degrees of freedom (KT_LOOP_LIST has the numbers).
 *
 * Loops come in the description's order, counted from 0. Every call is O(1) unless it says
 * otherwise, allocates nothing and cannot fail.
 */
#ifndef KINETREE_LOOP_H
#define KINETREE_LOOP_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The number of loops of a model; their names (valid as long as the model) and types. */
KT_API int kt_loop_count(const kt_model *model);
KT_API const char *kt_loop_name(const kt_model *model, int loop);
KT_API kt_loop_type kt_loop_type_of(const kt_model *model, int loop);
/* The side that a loop bounds, of a hard stop or contact, too; KT_SIDE_NONE of one that holds, or of none. O(1). */
KT_API kt_side kt_loop_side(const kt_model *model, int loop);
/* Whether a loop is that of friction that sticks (kt_effect.stick); false of one that is none. O(1). */
KT_API bool kt_loop_is_stick(const kt_model *model, int loop);

/* The index of the loop of that name; -1: none. O(loops). */
KT_API int kt_loop_find(const kt_model *model, const char *name);

/* The equations of a loop among those of all loops: rows of the matrix, and entries of the vectors, that
 * kt_loop_equations writes. */
typedef struct kt_loop_rows {
    int first; /* row */
    int count; /* how many */
} kt_loop_rows;

/* Of one loop. */
KT_API kt_loop_rows kt_loop_rows_of(const kt_model *model, int loop);

/* What the residual of an equation measures. */
typedef enum kt_loop_measure {
    KT_MEASURE_LENGTH = 0, /* m */
    KT_MEASURE_ANGLE, /* rad, to first order: 4 tan(angle / 4), of two axes that are to be normal 2 tan(angle / 2) */
    KT_MEASURE_SUM,   /* of joint positions, rad or m */
    KT_MEASURE_NONE,  /* none: an equation of velocities alone */
} kt_loop_measure;

/* Of one equation of a loop, 0 <= row < kt_loop_rows_of(...).count. */
KT_API kt_loop_measure kt_loop_measure_of(const kt_model *model, int loop, int row);

/* The angle (rad) by which an equation that measures one is open, given its residual; O(1). Rows as above. */
KT_API double kt_loop_residual_angle(const kt_model *model, int loop, int row, double residual);

/* Where data of a mechanism are rounded, equations that repeat each other disagree: those of two hinges on one axis but
 * for 1e-8 rad. Up to kt_description.tolerance the ends of loops are moved by as little as makes them agree; where that is
 * not found, they are closed in the sense of least squares, and what they repeat is left out. */
typedef struct kt_loop_disagreement {
    double length; /* the largest residual that data leave in the loop's equations of lengths, m; 0: none */
    double angle;  /* likewise of angles, rad */
} kt_loop_disagreement;

/* Of a loop, as seen at several positions when the model was compiled. O(1). */
KT_API kt_loop_disagreement kt_loop_disagreement_of(const kt_model *model, int loop);

/* ---- relative coordinates -----------------------------------------------------------------------------------------
 *
 * What the ends of a loop do to each other [MSD 6.2]: d and the rotation between them, of which the loop fixes some and
 * leaves others free, such as the angle of a hinge that closes a linkage. */

/* The motion of the second end as seen from the first: in the first end's frame, z along the loop's axis, and its rates
 * as seen there. */
struct kt_loop_motion {
    kt_vec3 position; /* d, of the second end's point, m */
    kt_mat3 rotation; /* R: columns are the second end's axes */
    kt_vec3 velocity; /* u = d', m/s */
    kt_vec3 omega;    /* w, rad/s: R' = w x R */
};

/* Of the state of the last kt_kinematics_update with these data. False, and *motion is untouched, if there is no such
 * loop or it has no ends (a relation of joints). O(1). */
KT_API bool kt_loop_motion_evaluate(const kt_model *model, const kt_data *data, int loop, kt_loop_motion *motion);

/* Of a loop `curve` at that state: the arc length of the nearest point of the curve, m; NaN of any other loop. */
KT_API double kt_loop_arc_length(const kt_model *model, const kt_data *data, int loop);

/* ---- loops of a caller's own -------------------------------------------------------------------------------------
 *
 * A constraint between two ends that no type has, as one to six equations of the motion of the second end as seen from
 * the first. What is seen from there does not change if both ends move together, and so no loop can be wrong in that.
 *
 *     static int keep_off(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equation) {
 *         const double length = *(const double *)user;
 *         (void)t;
 *         equation->residual = kt_vec3_norm(motion->position) - length;
 *         return 0;
 *     }
 *
 * and where the mechanism is described, with a length that outlives the model
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
 * Only the residual is needed: moments, forces and rates are then central differences of order four with steps of 1e-3
 * rad, s, and of 1 m + |position|, good to about 1e-12, and the drift a second difference of order six, good to about
 * 1e-10 of what the callback computes with, if it is smooth on the scale of 0.03. A callback that gives the rows too
 * (KT_LOOP_GIVES_ROWS) leaves the drift to a first difference; one that gives all is as exact as the library's types.
 * A loop without residuals (holonomic = false: rolling, skates) gives its rows. Derivatives of accelerations difference
 * the callback once more. Loops of the caller's own work in space and in the plane, with every reduction, projection,
 * reaction and formulation; scene files have no such loops.
 *
 * A callback is a function of its arguments alone, as those of effects are (effect.h), and may be called in any state,
 * also far from closed ones, and from several threads if these share the model. It allocates nothing, and returns
 *   0: done;
 *   > 0: the equations cannot be computed in this state: an adaptive method tries a smaller step; else the call fails
 *     with KT_ERROR_CONSTRAINT;
 *   < 0: stop: the call fails with KT_ERROR_CALLBACK.
 * The error names the loop, the time and the number. */

/* One equation, in the first end's frame:
 *     phi'  = moment . w  + force . u  + rate
 *     phi'' = moment . w' + force . u' + drift
 * (moment, force) is the wrench of a unit multiplier on the second end, about its point; the first end receives the
 * opposite. */
struct kt_loop_equation {
    kt_vec3 moment;  /* of a unit multiplier on the second end, about its point */
    kt_vec3 force;   /* likewise */
    double residual; /* phi; not read of a loop that is not holonomic */
    double rate;     /* partial derivative of phi by time */
    double drift;    /* what phi'' has besides accelerations */
};

#ifdef __cplusplus
}
#endif
#endif
