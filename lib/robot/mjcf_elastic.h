/* Elasticity of a <flexcomp> whose points are bodies: the parts that stretching and bending share. */
#ifndef KT_ROBOT_MJCF_ELASTIC_H
#define KT_ROBOT_MJCF_ELASTIC_H

#include "robot/mjcf_flex.h"

typedef struct kt_elasticity {
    double young, poisson, thickness, damping;
    int shell; /* none, bend, stretch, both */
} kt_elasticity;

/* A flexcomp and the bodies of its points; -1: pinned. */
typedef struct kt_elastic {
    const kt_flex *f;
    const int *body;
} kt_elastic;

#define KT_ELASTIC_FLAT "an element without area or volume has no elasticity; remove it, or its <elasticity>"

/* ---- mjcf_flex_point.c ------------------------------------------------------------------------------------------- */

/* The vector between two points at rest. */
kt_vec3 kt_elastic_span(const kt_flex *f, int from, int to);

/* Adds "factor*position.j + ..." of a point along an axis, and its rest to *constant. Returns how many variables. */
int kt_elastic_put_point(const kt_mjcf *m, const kt_elastic *p, int point, int axis, bool is_rate, double factor,
                         double *constant, kt_mjcf_formula *to);

/* Adds "(x_1 - x_0)", of two points along an axis, or of their speeds. */
void kt_elastic_put_span(const kt_mjcf *m, const kt_elastic *p, const int ends[2], int axis, bool is_rate,
                         kt_mjcf_formula *to);

/* Adds an effect with a formula; NULL after counting, if the formula had no room. */
kt_effect *kt_elastic_add(kt_mjcf *m, const kt_flex *f, const kt_mjcf_formula *formula);

/* ---- mjcf_flex_bend.c -------------------------------------------------------------------------------------------- */

/* Adds the forces by which a surface resists bending. */
void kt_elastic_resist_bending(kt_mjcf *m, const kt_elastic *p, const kt_elasticity *l);

#endif
