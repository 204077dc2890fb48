/* The reduction's inner loops, compiled once for each instruction-set level. Arguments are not checked. */
#ifndef KT_REDUCTION_KERNEL_H
#define KT_REDUCTION_KERNEL_H

#include "reduction/reduce.h"

typedef struct kt_reduction_kernels {
    /* Accelerations of a mechanism with loops; data->rank and data->near tell of each group. `regular`: directions that
     * are about to be lost near a singular position do not count. Returns the link at which the reduced inertia is
     * singular, or of which the equations are not finite; or 0. */
    size_t (*forward)(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const double *tau, const kt_wrench *external, bool regular, double *a);
    /* Fills the equations at (t, q), and `right` with -(A v + phi_t); v may be NULL, and then velocities are not looked
     * at. Coordinates that are held (NULL: none) count as constants. Returns false where a number is not finite. */
    bool (*look)(const kt_model *model, kt_data *data, double t, const double *q, const double *v, const bool *held,
                 kt_violation *violation);
    /* Factors the equations that have been filled; false where a number is not finite. `regular`: as above. */
    bool (*factor)(const kt_model *model, kt_data *data, kt_rows rows, bool regular);
    /* Fills the equations with accelerations' right-hand sides b''. */
    void (*fill)(const kt_model *model, kt_data *data, double t, const double *q, const double *v);
    /* The least step (nv) with A step = right, as last factored: in coordinates (then only those of groups move), or in
     * kinetic energy. false: the inertia is singular. */
    bool (*close)(const kt_model *model, kt_data *data, kt_metric metric, double *step);
    /* Multipliers of all equations for accelerations a, in the groups' work: those of the state of the last `forward`,
     * whose velocities are v. Leaves the accelerations of the links, minus gravity. NULL where links are planar. */
    void (*multipliers)(const kt_model *model, kt_data *data, const double *v, const double *a);
    /* The null spaces of the groups' equations as last factored, into their work; NULL as well. */
    void (*basis)(const kt_model *model, kt_data *data);
    /* What the loops exert with these multipliers (react.c); NULL as well. */
    void (*react)(const kt_model *model, const kt_data *data, double t, kt_wrench *bodies, kt_wrench *loops);
} kt_reduction_kernels;

#define KT_REDUCTION_DECLARE(level)                                                                                    \
    extern const kt_reduction_kernels kt_reduction_kernels_##level, kt_reduction_planar_kernels_##level;               \
    void kt_react_##level(const kt_model *, const kt_data *, double, kt_wrench *, kt_wrench *);
KT_REDUCTION_DECLARE(baseline)
KT_REDUCTION_DECLARE(v3)
KT_REDUCTION_DECLARE(v4)

/* As the model is swept: the spatial ones, or those that take planar links in their planes. */
const kt_reduction_kernels *kt_reduction_kernels_of(const kt_model *model);

/* The spatial ones, which take planar links like all others. */
const kt_reduction_kernels *kt_reduction_kernels_in_space(const kt_model *model);

#endif
