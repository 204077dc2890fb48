/* A generated file as the right-hand side of a simulation.
 *
 * The file computes a = M^-1 (tau + effects - h), with loops under their constraints. The function returns a number
 * other than 0 if a joint has no inertia, or if equations of loops depend on others in this position. Then the library
 * computes the acceleration of this state, which succeeds at such positions, or names the cause.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/codegen.h"

#include "base/require.h"
#include "model/model.h"

#include "kinetree/mechanism.h"

static bool is_finite_vector(const double *a, size_t count) {
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += a[i] - a[i];
    return sum == 0.0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): required by the type of the callback */
static int accelerate_natively(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    kt_native *native = user;
    const kt_model *model = native->model;
    (void)rate;
    if (at->model == model && at->external == NULL) {
        const double *tau = at->tau != NULL ? at->tau : model->zero;
        const int code = native->acceleration(native->prepared, at->t, at->q, at->v, at->x, tau, a);
        if (code == 0 && is_finite_vector(a, model->n.v)) {
            native->computed++;
            return 0;
        }
        native->refused = code != 0 ? code : native->refused;
    }
    native->left++;
    return kt_acceleration_evaluate(at->model, at->data, at->t, at->q, at->v, at->tau, at->external, a, error) == KT_OK
               ? 0
               : 1;
}

kt_status kt_native_use(kt_native *native, const kt_model *model, kt_simulation_options *options, kt_error *error) {
    if (KT_IS_MISSING(error, native, model, options) || KT_IS_MISSING(error, native->acceleration))
        return KT_ERROR_ARGUMENT;
    const uint64_t structure = kt_codegen_structure(model);
    if (native->structure != structure)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "structure",
                            "the file was generated for the structure 0x%016llx, and the model has 0x%016llx; generate "
                            "it again from this model",
                            (unsigned long long)native->structure, (unsigned long long)structure);
    const char *taken = options->acceleration != NULL ? "acceleration"
                        : options->projection != NULL || options->breakpoint != NULL || options->user != NULL ? "user"
                                                                                                              : NULL;
    if (taken != NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, taken,
                            "a generated file takes the place of functions of the caller; leave the option out");
    native->model = model;
    native->computed = native->left = 0;
    native->refused = 0;
    options->acceleration = accelerate_natively;
    options->user = native;
    options->equals_model = true;
    return KT_OK;
}
