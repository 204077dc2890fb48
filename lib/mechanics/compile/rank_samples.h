/* The samples of rank.c: positions at which constraint groups are closed, and the ranks of the groups at these
 * positions. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMPILE_RANK_SAMPLES_H
#define KT_COMPILE_RANK_SAMPLES_H

#include "base/arena.h"
#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "model/model.h"
#include "reduction/delassus.h"
#include "reduction/kernel.h"
#include "reduction/method.h"

enum { KT_RANK_SAMPLES = 7 };

/* The results of the samples: type, name, count, meaning. */
#define KT_RANK_SAMPLES_FIELDS(X)                                                                                      \
    X(double, q, 3 * n->q, "three positions; the third of each group's links where its rank was found")                \
    X(double, fraction, n->group, "of the displacements, from which a group closes")                                   \
    X(double, near, n->v, "a displacement that the equations allow")                                                   \
    X(bool, nontrivial, n->row, "equations that are not void")                                                         \
    X(bool, sampled, n->group, "groups that are closed at any position")                                               \
    X(bool, open, n->group, "groups that no sample closes")                                                            \
    X(bool, seen, n->group, "those of them that one closes except for a disagreement")                                 \
    X(bool, placed, n->group, "groups with a loop whose place may move")                                               \
    X(bool, chosen, KT_ROWS_COUNT * n->row, "equations, at the best position of each group")                           \
    X(int32_t, rank, KT_ROWS_COUNT * n->group, "of each group")                                                        \
    X(int32_t, cap, KT_ROWS_COUNT * n->front, "of the steps of fronts: independent equations up to there")             \
    X(double, usual, KT_ROWS_COUNT * n->front, "likewise: the largest size of the last one")

typedef struct kt_rank_samples {
    bool places; /* only groups with a place that may move are evaluated */
    KT_ARENA_DECLARE(KT_RANK_SAMPLES_FIELDS)
} kt_rank_samples;

/* The size of the displacement of a sample. */
static inline double kt_rank_sample_size(size_t sample) { return sample < 3 ? 0.3 : sample < 6 ? 0.15 : 0.1; }

/* A step that moves the coordinates of groups by up to `size` and the group's fraction of their units. */
void kt_rank_scatter(const kt_model *model, double size, const double *fraction, size_t sample, double *step);

/* Closes the loops from the base, displaced by up to `size` and each group's fraction of that. */
void kt_rank_take_sample(const kt_model *model, kt_data *data, double size, size_t sample, kt_rank_samples *found);

/* Whether a group is closed as last filled, except for rounding. */
bool kt_rank_is_closed(const kt_model *model, const kt_data *data, size_t g);

/* Evaluates the groups that are closed at q; without `closed`, the groups that no sample found closed. */
void kt_rank_sample_groups(kt_model *model, kt_data *data, const double *q, bool closed, kt_rank_samples *found);

/* Evaluates the groups at all samples. */
void kt_rank_find(kt_model *model, kt_data *data, kt_rank_samples *found);

/* Evaluates groups with a loop that bounds one side, and that no sample found closed. */
void kt_rank_sample_bounds(kt_model *model, kt_data *data, kt_rank_samples *found);
/* Evaluates groups with a switched loop to the world at generic positions, at which the loop is closed because its end
 * on the world is moved to these positions (rank_places.c). Errors: KT_ERROR_MEMORY. */
KT_CHECKED kt_status kt_rank_sample_places(kt_model *model, kt_data *data, kt_rank_samples *found);

/* Factors all groups. Returns false if one cannot be factored. */
bool kt_rank_factor(const kt_model *model, kt_data *data, int rows);

/* Stores the results of a sample for a group that is reduced by fronts. `best`: its rank is the largest so far. */
void kt_rank_store_steps(const kt_model *model, const kt_data *data, const kt_group *group, int rows, bool best,
                         kt_rank_samples *found);

/* A lower bound of the size that the largest direction of a group counts as. Needs the equations' scales. */
double kt_rank_least(const kt_model *model, const kt_group *group, const kt_group_work *w);

/* Takes the equations of a group for as uncertain as the model's rounding. */
void kt_rank_coarsen(kt_model *model, const kt_data *data, size_t g);

/* Treats groups that close at no position, except for a disagreement below the tolerance. Such a group's data are
 * corrected, or the group counts as closed (rank_disagreement.c). Errors: KT_ERROR_MEMORY. */
kt_status kt_rank_accept_disagreement(kt_model *model, kt_data *data, kt_rank_samples *found);

/* Loops whose equations repeat each other except for the rounding of the data. */

/* Moves the ends of the loops of a group that leaves one degree of freedom, along the motion that leads through a
 * position near q. The moves are the least ones with which the equations repeat each other to the last digit. Stores by
 * how much the equations disagree. *found: whether such moves exist below the model's tolerance. If not, all ends are
 * back at the positions in `given`, two for each loop.
 * Errors: KT_ERROR_MEMORY.
 * Cost: O((coordinates + equations + corrections)^3) a position. */
kt_status kt_group_repair(kt_model *model, kt_data *data, size_t g, const double *q, const kt_pose *given, bool *found);

/* Puts the ends of all loops to given places, two a loop. */
void kt_loops_place_ends(kt_model *model, const kt_pose *ends);

/* Stores the gaps of the loops of a group, as last filled, if the gaps are larger than the stored gaps. Returns the
 * largest gap, relative to the scales. */
double kt_group_store_disagreement(kt_model *model, const kt_data *data, size_t g);

#endif
