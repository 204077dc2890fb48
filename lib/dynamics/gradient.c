/* The gradient of a sum of joint forces, and M^-1 x, by the kernels of a model's instruction set and sweep. Models with
 * spatial and planar links are computed in space. */
#include "dynamics/inverse_gradient.h"
#include "dynamics/mass_inverse.h"

#ifdef KT_ISAS
#define KT_BY_LEVEL(result, name, arguments)                                                                           \
    do {                                                                                                               \
        if (model->level == KT_ISA_V4)                                                                                 \
            result name##_v4 arguments;                                                                                \
        else if (model->level == KT_ISA_V3)                                                                            \
            result name##_v3 arguments;                                                                                \
        else                                                                                                           \
            result name##_baseline arguments;                                                                          \
    } while (0)
#else
#define KT_BY_LEVEL(result, name, arguments) result name##_baseline arguments
#endif

kt_status kt_gradient_evaluate(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                               const kt_wrench *external, bool posed, const double *w, kt_gradient_link *links,
                               const kt_gradient *out, kt_error *error) {
    if (model->sweep == KT_SWEEP_PLANAR && posed) {
        kt_planar_gradient_link *flat = (kt_planar_gradient_link *)(void *)links;
        KT_BY_LEVEL(, kt_planar_gradient, (model, data, v, a, external, w, flat, out));
        return KT_OK;
    }
    const kt_status status = kt_links_update(model, data, q, v, a, false, NULL, error);
    if (status == KT_OK)
        KT_BY_LEVEL(, kt_inverse_gradient, (model, data, v, a, external, w, links, out));
    return status;
}

kt_status kt_tree_respond(const kt_model *model, kt_data *data, const double *q, void *memory, double *x,
                          kt_error *error) {
    kt_inverse_terms terms;
    if (model->sweep == KT_SWEEP_PLANAR) {
        size_t failed;
        KT_BY_LEVEL(failed =, kt_planar_respond, (model, data, q, x, x));
        if (!failed)
            return KT_OK;
    }
    (void)kt_inverse_layout(&terms, memory, &model->n);
    const kt_status status = kt_inverse_compute(model, data, q, &terms, error);
    if (status == KT_OK)
        kt_inverse_apply(model, &terms, x);
    return status;
}
