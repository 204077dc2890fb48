/* The recursions' inner loops, compiled once for each instruction-set level (KT_LEVEL names it).
 *
 * A kernel checks nothing about its arguments: every pointer is there, and outputs are scratch of the data. Those that
 * can fail return the link at which they did, or 0.
 */
#ifndef KT_DYNAMICS_KERNEL_H
#define KT_DYNAMICS_KERNEL_H

#include "base/level.h"
#include "model/internal.h"

typedef struct kt_kernels {
    const char *name;
    /* Articulated bodies: a; external may be NULL. Returns a link without inertia along its freedom. */
    size_t (*forward)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                      const kt_wrench *external, double *a);
    /* Newton-Euler: tau. */
    void (*inverse)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                    const kt_wrench *external, double *tau);
    /* Composite bodies: lower triangle of the mass matrix, whose other entries are not touched. */
    void (*mass)(const kt_model *model, kt_data *data, const double *q, double *mass);
    /* Motion and places of all links; accelerations without gravity. */
    void (*kinematics)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a);
} kt_kernels;

#define KT_KERNELS_DECLARE(level)                                                                                      \
    extern const kt_kernels kt_kernels_##level;                                                                        \
    size_t kt_forward_##level(const kt_model *, kt_data *, const double *, const double *, const double *,             \
                              const kt_wrench *, double *);                                                            \
    void kt_inverse_##level(const kt_model *, kt_data *, const double *, const double *, const double *,               \
                            const kt_wrench *, double *);                                                              \
    void kt_mass_##level(const kt_model *, kt_data *, const double *, double *);                                       \
    void kt_kinematics_##level(const kt_model *, kt_data *, const double *, const double *, const double *);

/* Copies a result of nv numbers that is finite; else says of which joint it is not. */
kt_status kt_commit(const kt_model *model, const double *from, double *to, const char *what, kt_error *error);

/* kt_kinematics_update without accelerations and without a look at the numbers. */
void kt_kinematics_sweep(const kt_model *model, kt_data *data, const double *q, const double *v);

KT_KERNELS_DECLARE(baseline)
KT_KERNELS_DECLARE(v3)
KT_KERNELS_DECLARE(v4)

#endif
