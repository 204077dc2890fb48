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

#ifdef __cplusplus
}
#endif
#endif
