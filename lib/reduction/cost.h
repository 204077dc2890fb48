/* What the evaluation of a model's accelerations costs, in floating-point operations. */
#ifndef KT_REDUCTION_COST_H
#define KT_REDUCTION_COST_H

#include "model/model.h"

typedef struct kt_cost {
    double force_links;                 /* motion of the links that bear effects */
    double external;                    /* wrenches from bodies onto links, where effects have ends */
    double angles;                      /* sines and cosines */
    double spatial, planar;             /* articulated bodies, but those in groups */
    double spatial_loops, planar_loops; /* groups of loops; NaN where LAPACK factors one */
} kt_cost;

kt_cost kt_cost_of(const kt_model *model);

/* All effects of a batch, without what the C library and a caller's own function take. */
double kt_cost_of_batch(const kt_model *model, const kt_effect_batch *batch);

#endif
