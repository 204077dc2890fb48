/* The reduction's inner loops, compiled once for each instruction set. Arguments are not checked. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_KERNEL_H
#define KT_REDUCTION_KERNEL_H

#include "loop/loop.h"
#include "reduction/method.h"

/* data->special_form: groups in the form of Delassus (delassus.h), closed contacts and stops (half_columns.h), and
 * fronts in registers (front4.h) may be solved in their own forms. If this fails, the groups are factored: regularly
 * (`factor`), or as a whole. */
enum { KT_SPECIAL_FORM_NONE = 0, KT_SPECIAL_FORM_REGULAR, KT_SPECIAL_FORM_WHOLE };

typedef struct kt_reduction_kernels {
    /* Computes the accelerations of a mechanism with loops (at->tau is given). Sets data->rank and data->near of each
     * group. `regular`: directions that are about to be lost near a singular position are left out. Returns the link at
     * which the reduced inertia is singular or the equations are not finite, or 0. */
    size_t (*forward)(const kt_model *model, kt_data *data, const kt_dynamic_state *at, bool regular, double *a);
    /* Fills the equations at (t, q), and `right` with -(A v + phi_t); if v is NULL, velocities are not considered.
     * Coordinates to be held (NULL: none) count as constants. Returns false if a number is not finite. */
    bool (*residuals)(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const bool *held, kt_violation *violation);
    /* Stores -(A v + phi_t) of a group that has been filled in `right`, and adds its violation to the given one. */
    void (*violate)(const kt_model *model, kt_data *data, size_t g, const double *v, kt_violation *violation);
    /* Factors the equations that have been filled; returns false if a number is not finite. `regular`: as above. */
    bool (*factor)(const kt_model *model, kt_data *data, kt_rows rows, bool regular);
    /* As `factor`, for `least_step` only: at regular positions groups are left to their own forms. */
    bool (*prepare)(const kt_model *model, kt_data *data, kt_rows rows, bool regular);
    /* Fills the equations with the right-hand sides b'' of the accelerations. */
    void (*fill)(const kt_model *model, kt_data *data, double t, const double *q, const double *v);
    /* The two parts of `fill`: poses and velocities of all links, and the equations of a loop that is on. These go into
     * the slots of a group's matrices `w`, where the entries of A' are zero. */
    void (*follow)(const kt_model *model, kt_data *data, const double *q, const double *v);
    void (*fill_loop)(const kt_model *model, const kt_data *data, const kt_dynamic_state *at, int loop,
                      const int32_t *slot, const kt_group_work *w);
    /* Computes the least step (nv) with A step = right, as last factored. The least is in coordinates (then only those
     * of groups change), or in kinetic energy less force . step. Returns false if the inertia is singular. */
    bool (*least_step)(const kt_model *model, kt_data *data, kt_metric metric, const double *force, double *step);
    /* Writes A x of a group that is reduced by fronts (front.h) into out (k); if size is not NULL, also the largest
     * terms. */
    void (*apply)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const double *x, double *out,
                  double *size);
    /* Prepares the damped steps of such a group; returns the sum of the squares of B's entries (kt_damped_step). */
    double (*measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows);
    /* Computes the step (nv, only of the group's coordinates) that minimises |B dy + gap|^2 + damping |dy|^2. Returns
     * false if it cannot be computed. */
    bool (*damp)(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping, double *step);
    /* A vector of the basis of such a group's null space (nv, only of its coordinates). */
    void (*nullspace)(const kt_model *model, kt_data *data, size_t g, int column, double *x);
    /* Computes the multipliers of all equations for accelerations a, in the groups' work memory. The multipliers are
     * those of the state of the last `forward`, whose velocities are v. Leaves the accelerations of the links, minus
     * gravity. NULL in the table for planar links. */
    void (*multipliers)(const kt_model *model, kt_data *data, const double *v, const double *a);
    /* Computes the null spaces of the equations as last factored, of groups without fronts, into their work memory. Of
     * groups with fronts, `nullspace` has the columns. Likewise NULL. */
    void (*basis)(const kt_model *model, kt_data *data);
    /* Computes the wrenches of the loops for these multipliers (loop_wrenches.c); likewise NULL. */
    void (*react)(const kt_model *model, const kt_data *data, double t, kt_wrench *bodies, kt_wrench *idle,
                  kt_wrench *loops);
    /* Computes the self-stresses of a redundant group from the poses of the links (self_stress.c); likewise NULL. */
    void (*stress)(const kt_model *model, kt_data *data, size_t g, double t, const double *q);
    /* Compute only the poses of the links, then their velocities; likewise NULL. */
    void (*pose)(const kt_model *model, kt_data *data, const double *q);
    void (*move)(const kt_model *model, kt_data *data, const double *v);
    /* Evaluates the first equation of a loop that is on, from these poses and velocities: phi as `residual`, and
     * phi' = A v + phi_t as `rate`. If v is NULL, the velocities have not been computed, and the rate is undefined. */
    kt_relation_row (*first_row)(const kt_model *model, const kt_data *data, size_t loop, double t, const double *q,
                                 const double *v);
} kt_reduction_kernels;

#define KT_REDUCTION_DECLARE(isa)                                                                                      \
    extern const kt_reduction_kernels kt_reduction_kernels_##isa, kt_reduction_planar_kernels_##isa;
KT_EACH_ISA(KT_REDUCTION_DECLARE)

/* The kernels for the model's sweep: the spatial kernels, or the kernels that compute planar links in their planes. The
 * result is model->group_kernels. */
const kt_reduction_kernels *kt_reduction_kernels_of(const kt_model *model);

/* The spatial kernels, which treat planar links like all others. */
const kt_reduction_kernels *kt_reduction_kernels_in_space(const kt_model *model);

#endif
