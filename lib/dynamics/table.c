/* The kernels of one instruction set. Those of mixed models compute the spatial links, then the planar ones; no joint
 * connects the two. */
#include "dynamics/dynamics.h"

#include <string.h>

#define KT_TEXT_(a) #a
#define KT_TEXT(a) KT_TEXT_(a)

/* All that can fail is done before the first number is written. */
static size_t mass(const kt_model *model, kt_data *data, const double *q, double *mass) {
    const bool spatial = model->sweep != KT_SWEEP_PLANAR, planar = model->sweep != KT_SWEEP_SPATIAL;
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

const kt_kernels KT_KERNEL(kt_kernels)[KT_SWEEP_COUNT] = {
    [KT_SWEEP_SPATIAL] = {.name = KT_TEXT(KT_ISA),
                          .forward = KT_KERNEL(kt_forward),
                          .inverse = KT_KERNEL(kt_inverse),
                          .mass = mass,
                          .mirror = KT_KERNEL(kt_mass_mirror),
                          .kinematics = KT_KERNEL(kt_kinematics),
                          .follow = KT_KERNEL(kt_follow),
                          .force_links = KT_KERNEL(kt_force_links)},
    [KT_SWEEP_PLANAR] = {.name = KT_TEXT(KT_ISA),
                         .forward = KT_KERNEL(kt_planar_forward),
                         .inverse = KT_KERNEL(kt_planar_inverse),
                         .mass = mass,
                         .mirror = KT_KERNEL(kt_mass_mirror),
                         .kinematics = KT_KERNEL(kt_planar_kinematics),
                         .follow = KT_KERNEL(kt_planar_follow),
                         .force_links = KT_KERNEL(kt_force_links)},
    [KT_SWEEP_MIXED] = {.name = KT_TEXT(KT_ISA),
                        .forward = mixed_forward,
                        .inverse = mixed_inverse,
                        .mass = mass,
                        .mirror = KT_KERNEL(kt_mass_mirror),
                        .kinematics = mixed_kinematics,
                        .follow = mixed_follow,
                        .force_links = KT_KERNEL(kt_force_links)},
};
