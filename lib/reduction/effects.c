/* The effects of a scene, summed into joint forces and wrenches on bodies. */
#include "reduction/evaluate.h"

void kt_effects_apply(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const double **tau, const kt_wrench **external) {
    (void)model, (void)data, (void)t, (void)q, (void)v, (void)tau, (void)external;
}
