/* The calls of dynamics.h: choose the kernels of the model's instruction-set level, stand in for what is not given, and
 * hand results over only when they are whole. */
#include "kinetree/dynamics.h"
#include "dynamics/kernel.h"

#include <stdio.h>
#include <string.h>

static const kt_kernels *kernels_of(const kt_model *model) {
#ifdef KT_LEVELS
    if (model->level == KT_LEVEL_V4)
        return &kt_kernels_v4;
    if (model->level == KT_LEVEL_V3)
        return &kt_kernels_v3;
#endif
    (void)model;
    return &kt_kernels_baseline;
}

kt_level kt_level_resolve(kt_level asked) {
    kt_level best = KT_LEVEL_BASE;
#ifdef KT_LEVELS
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        best = KT_LEVEL_V3;
    if (best == KT_LEVEL_V3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd"))
        best = KT_LEVEL_V4;
#endif
    if (asked == KT_LEVEL_AUTO)
        return best;
    return asked <= best ? asked : KT_LEVEL_AUTO;
}

/* Whether all are finite, without a branch a number: x - x is 0 for a finite x, and NaN else. */
static bool all_finite(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] - x[i];
    return sum == 0.0;
}

static const char *body_of_velocity(const kt_model *model, size_t v) {
    size_t best = 0;
    for (size_t b = 1; b < model->n.body; b++)
        if ((size_t)model->body[b].v <= v && kt_joint_kinds[model->body[b].type]->nv > 0)
            best = b;
    return model->text + model->body[best].name;
}

/* Copies a result that is finite; else says which joint it is not. */
kt_status kt_commit(const kt_model *model, const double *from, double *to, const char *what, kt_error *error) {
    const size_t n = model->n.v;
    if (all_finite(from, n)) {
        memcpy(to, from, n * sizeof *to);
        return KT_OK;
    }
    size_t i = 0;
    while (i < n - 1 && isfinite(from[i]))
        i++;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s'", body_of_velocity(model, i));
    return kt_error_set(error, KT_ERROR_NOT_FINITE, where,
                        "its %s is %g; look for a position, velocity, force or torque that is not finite or is huge",
                        what, from[i]);
}

kt_status kt_dynamics_forward(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                              const kt_wrench *external, double *a, kt_error *error) {
    const size_t failed = kernels_of(model)->forward(model, data, q, v ? v : model->zero, tau ? tau : model->zero,
                                                     external, data->scratch);
    if (!failed)
        return kt_commit(model, data->scratch, a, "acceleration", error);
    const kt_body_record *body = &model->body[model->link[failed].body];
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s'", model->text + body->name);
    if (!all_finite(q, model->n.q) || (v && !all_finite(v, model->n.v)))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, where, "a position or velocity is not finite");
    return kt_error_set(error, KT_ERROR_SINGULAR, where,
                        "what it carries has no inertia along one of its freedoms at this position");
}

kt_status kt_dynamics_inverse(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                              const kt_wrench *external, double *tau, kt_error *error) {
    kernels_of(model)->inverse(model, data, q, v ? v : model->zero, a ? a : model->zero, external, data->scratch);
    return kt_commit(model, data->scratch, tau, "force", error);
}

kt_status kt_dynamics_mass(const kt_model *model, kt_data *data, const double *q, double *mass, kt_error *error) {
    const size_t nv = model->n.v;
    if (!all_finite(q, model->n.q))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "mass matrix", "a position is not finite");
    memset(mass, 0, nv * nv * sizeof *mass);
    kernels_of(model)->mass(model, data, q, mass);
    for (size_t column = 0; column < nv; column++)
        for (size_t row = column + 1; row < nv; row++)
            mass[row * nv + column] = mass[column * nv + row];
    return KT_OK;
}

kt_status kt_kinematics_update(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                               kt_error *error) {
    if (!all_finite(q, model->n.q) || (v && !all_finite(v, model->n.v)) || (a && !all_finite(a, model->n.v)))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "kinematics",
                            "a position, velocity or acceleration is not finite");
    kernels_of(model)->kinematics(model, data, q, v ? v : model->zero, a ? a : model->zero);
    return KT_OK;
}

size_t kt_singular_link(const kt_model *model, kt_data *data, const double *q) {
    return kernels_of(model)->forward(model, data, q, model->zero, model->zero, NULL, data->scratch);
}

void kt_kinematics_sweep(const kt_model *model, kt_data *data, const double *q, const double *v) {
    kernels_of(model)->kinematics(model, data, q, v, model->zero);
}
