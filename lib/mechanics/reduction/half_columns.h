/* A dense group of closed contacts in range space. The links of the group stay links of the tree, for which the
 * articulated-body recursion provides M^-1, and the multipliers follow from the few equations:
 *
 *     A x = b'',   x = M^-1 (f + A' lambda),   S lambda = b'' - A M^-1 f,   S = A M^-1 A'
 *
 * M^-1 = H' D H with the factors of the recursion (dynamics/aba_inverse.h). So S = U D U' with the half columns U' =
 * H A', which only the backward half of a pass takes. Four equations are in the lanes of a vector, and links on which
 * none of the four acts are left out. A free joint has the factors of its elimination: L D L' of the mass, and of the
 * inertia that is left for the rotation (dynamics/aba.h). With the free acceleration y of a joint, its parent gain K,
 * and the parent's acceleration A0 due to velocities and gravity alone, A M^-1 f = U (y - K A0)
 * (reduction/delassus.h). The multipliers' accelerations D U' lambda are added to y before the forward pass.
 *
 * S has the condition of A squared. So equations have to be independent: in the metric of M^-1, the sine of the angle
 * between each row and the rows before must exceed 0.01. Otherwise the null space of A decides, with its ranks and its
 * treatment of singular positions. Among dependent equations, those that compilation or a mask chose take part.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_HALF_COLUMNS_H
#define KT_REDUCTION_HALF_COLUMNS_H

#include "constraint/group.h"
#include "dynamics/aba.h"

#ifndef KT_LANES

/* Equations in a vector. */
enum { KT_HALF_LANES = 4 };

/* The arrays of a group of m coordinates and n vectors of equations. A link has the position of its first coordinate.
 * The arrays follow the struct (kt_half_count), and kt_half_prepare sets the pointers. */
typedef struct kt_half {
    int m, n, rank;
    KT_ARENA_DECLARE(KT_HALF_FIELDS)
} kt_half;

/* A force between two links: wrenches about their origins, moment and force. Nothing acts on the ground, 0. */
typedef struct kt_half_force {
    int32_t link[2];
    double wrench[2][6];
} kt_half_force;

/* Whether the last accelerations stored the terms of a group that kt_half_respond needs. */
static inline bool kt_half_has_terms(const kt_model *model, const kt_data *data, size_t g) {
    const kt_group *group = &model->group[g];
    return data->special_form[g] && group->form == KT_FORM_DENSE && !kt_group_is_locked(model, group);
}

/* The size of half columns of joint forces. */
static inline size_t kt_half_response_count(size_t nv, size_t count) { return (count + 3) / 4 * 4 * nv; }

/* kt_half_prepare chooses the equations of a group that have been filled. Returns false if the null space must solve
 * the group.
 *
 * kt_half_store stores the terms of a link of the group, whose articulated inertia is x. The function also eliminates a
 * free link, whose factors are these terms, and returns true; false if the link has no inertia, or is not free.
 *
 * kt_half_lock treats the link of a group that a stop locks: its acceleration is known, and the inertia that it passes
 * on is not projected. Stores the terms of its multiplier, as kt_group_assemble does.
 *
 * kt_half_solve adds the multipliers' accelerations of a group that is not locked to the joints' free ones, between
 * backward and forward pass. Stores lambda. Returns false if the equations are not independent, or a number is not
 * finite. With data->between, these accelerations are left to kt_half_add_forces or kt_half_complete.
 *
 * kt_half_respond finds responses to more forces f_j, after `solve`. Adds f_i' a to rate unless it is NULL (count x
 * count), with the accelerations a due to f_j. Stores the changes of lambda in the columns of `change` (row_count
 * numbers each, by slots). column: kt_half_response_count numbers.
 *
 * kt_half_add_forces adds the sum of these forces, times factors: to lambda, and to the free accelerations of the
 * joints. `change` and `column` are the outputs of `respond`.
 *
 * kt_spatial_links_resume repeats the forward pass of the last accelerations, after kt_half_add_forces. This function
 * is in spatial_links.c. */
#define KT_HALF_DECLARE_ISA(isa)                                                                                       \
    bool kt_half_prepare_##isa(const kt_model *model, kt_data *data, size_t g);                                        \
    bool kt_half_store_##isa(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x);    \
    void kt_half_lock_##isa(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x);     \
    bool kt_half_solve_##isa(const kt_model *model, kt_data *data, size_t g);                                          \
    void kt_half_complete_##isa(const kt_model *model, kt_data *data, size_t g);                                       \
    void kt_half_respond_##isa(const kt_model *model, const kt_data *data, size_t g, const kt_half_force *force,       \
                               int count, double *column, double *change, double *rate);                               \
    void kt_half_add_forces_##isa(const kt_model *model, kt_data *data, size_t g, const double *factor, int count,     \
                                  const double *change, const double *column);                                         \
    void kt_spatial_links_resume_##isa(const kt_model *model, kt_data *data, const double *v, size_t end, double *a);
KT_EACH_ISA(KT_HALF_DECLARE_ISA)
#undef KT_HALF_DECLARE_ISA

#endif

#endif
