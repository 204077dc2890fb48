/* The kernels of one instruction set. The kernels of mixed models compute the spatial links, then the planar links; no
 * joint connects spatial with planar links. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"

#include <string.h>

#define KT_TEXT_(a) #a
#define KT_TEXT(a) KT_TEXT_(a)

/* All that can fail is done before the first number is written. */
static size_t mass_by_kernel(const kt_model *model, kt_data *data, const double *q, double *mass) {
    const bool spatial = model->sweep != KT_SWEEP_PLANAR;
    const bool planar = model->sweep != KT_SWEEP_SPATIAL;
    size_t failed = spatial ? KT_KERNEL(kt_mass_compose)(model, data, q) : 0;
    if (!failed && planar)
        failed = KT_KERNEL(kt_planar_mass_compose)(model, data, q);
    if (failed)
        return failed;
    if (!model->ordered) /* otherwise the columns set all */
        memset(mass, 0, model->n.v * model->n.v * sizeof *mass);
    if (spatial)
        KT_KERNEL(kt_mass_columns)(model, data, mass);
    if (planar)
        KT_KERNEL(kt_planar_mass_columns)(model, data, mass);
    return 0;
}

static size_t mixed_forward(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                            const kt_wrench *external, double *a) {
    const size_t failed = KT_KERNEL(kt_forward)(model, data, q, v, tau, external, a);
    return failed ? failed : KT_KERNEL(kt_planar_forward)(model, data, q, v, tau, external, a);
}

static void mixed_inverse(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                          const kt_wrench *external, double *tau) {
    KT_KERNEL(kt_inverse)(model, data, q, v, a, external, tau);
    KT_KERNEL(kt_planar_inverse)(model, data, q, v, a, external, tau);
}

static size_t mixed_kinematics(const kt_model *model, kt_data *data, const double *q, const double *v,
                               const double *a) {
    const size_t failed = KT_KERNEL(kt_kinematics)(model, data, q, v, a);
    return failed ? failed : KT_KERNEL(kt_planar_kinematics)(model, data, q, v, a);
}

static size_t mixed_follow(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a) {
    const size_t failed = KT_KERNEL(kt_follow)(model, data, q, v, a);
    return failed ? failed : KT_KERNEL(kt_planar_follow)(model, data, q, v, a);
}

static size_t armature_mixed_forward(const kt_model *model, kt_data *data, const double *q, const double *v,
                                     const double *tau, const kt_wrench *external, double *a) {
    const size_t failed = KT_KERNEL(kt_armature_forward)(model, data, q, v, tau, external, a);
    return failed ? failed : KT_KERNEL(kt_planar_armature_forward)(model, data, q, v, tau, external, a);
}

/* With armature a: tau = ID(q, v, q'') + a q'', M = CRBA(q) + diag(a). Forward dynamics adds the armature during the
 * elimination of joints (aba.h). */
static void armature_inverse(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                             const kt_wrench *external, double *tau) {
    KT_KERNEL(kt_kernels)[model->sweep].inverse(model, data, q, v, a, external, tau);
    for (size_t i = 0; i < model->n.v; i++)
        tau[i] += model->armature[i] * a[i];
}

static size_t armature_mass(const kt_model *model, kt_data *data, const double *q, double *matrix) {
    const size_t failed = mass_by_kernel(model, data, q, matrix);
    for (size_t i = 0; i < model->n.v && !failed; i++)
        matrix[i * (model->n.v + 1)] += model->armature[i];
    return failed;
}

#define KT_KERNELS_OF(forward_of, inverse_of, mass_of, kinematics_of, follow_of)                                       \
    {                                                                                                                  \
        .name = KT_TEXT(KT_ISA), .forward = (forward_of), .inverse = (inverse_of), .mass = (mass_of),                  \
        .mirror = KT_KERNEL(kt_mass_mirror), .kinematics = (kinematics_of), .follow = (follow_of),                     \
        .force_links = KT_KERNEL(kt_force_links)                                                                       \
    }
#define KT_KERNELS_SPATIAL(forward, inverse, mass_by_kernel)                                                           \
    KT_KERNELS_OF(forward, inverse, mass_by_kernel, KT_KERNEL(kt_kinematics), KT_KERNEL(kt_follow))
#define KT_KERNELS_PLANAR(forward, inverse, mass_by_kernel)                                                            \
    KT_KERNELS_OF(forward, inverse, mass_by_kernel, KT_KERNEL(kt_planar_kinematics), KT_KERNEL(kt_planar_follow))
#define KT_KERNELS_MIXED(forward, inverse, mass_by_kernel)                                                             \
    KT_KERNELS_OF(forward, inverse, mass_by_kernel, mixed_kinematics, mixed_follow)

/* The tables without armature, then with armature. */
const kt_kernels KT_KERNEL(kt_kernels)[2 * KT_SWEEP_COUNT] = {
    [KT_SWEEP_SPATIAL] = KT_KERNELS_SPATIAL(KT_KERNEL(kt_forward), KT_KERNEL(kt_inverse), mass_by_kernel),
    [KT_SWEEP_COUNT +
        KT_SWEEP_SPATIAL] = KT_KERNELS_SPATIAL(KT_KERNEL(kt_armature_forward), armature_inverse, armature_mass),
    [KT_SWEEP_PLANAR] = KT_KERNELS_PLANAR(KT_KERNEL(kt_planar_forward), KT_KERNEL(kt_planar_inverse), mass_by_kernel),
    [KT_SWEEP_MIXED] = KT_KERNELS_MIXED(mixed_forward, mixed_inverse, mass_by_kernel),
    [KT_SWEEP_COUNT +
        KT_SWEEP_PLANAR] = KT_KERNELS_PLANAR(KT_KERNEL(kt_planar_armature_forward), armature_inverse, armature_mass),
    [KT_SWEEP_COUNT + KT_SWEEP_MIXED] = KT_KERNELS_MIXED(armature_mixed_forward, armature_inverse, armature_mass),
};
