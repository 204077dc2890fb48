/* The structural rank of groups with loops that close anywhere: footholds.
 *
 * A program may move an end of a loop to the position of the other end (loop_place.c), and then switch the loop on.
 * The place of the description is one of many. The compiled position may be out of reach: a hinge at the origin, whose
 * tip a pin holds at the origin. Or the position is special: two legs of equal length from one hip, with both feet
 * pinned at the same point, have three independent equations, but four at other positions. Therefore such loops are
 * also closed at generic positions of the mechanism, with their ends moved to these positions. The largest rank counts,
 * as for other samples.
 *
 * Loops that are on at first, groups that a switch closes in the given positions, and models whose parameters cannot be
 * set have their places in the description. Such models keep its rank: at all other places, Bennett's linkage is rigid.
 *
 * If the group has other loops, these are closed with the places held. If that fails, the places follow, and the loops
 * are closed once more. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/levenberg_marquardt.h"
#include "assembly/rounding.h"
#include "base/pool.h"
#include "compile/rank_samples.h"
#include "loop/loop.h"

#include <string.h>

enum { ROUNDS = 4 };

/* The gap that a switch closes, over the model's length (kt_simulation_options.switch_gap). */
#define CLOSED_BY_SWITCH 1e-6

/* Copies of the records that hold places, and the poses of links. */
typedef struct place_samples {
    kt_loop_record *loop;
    kt_planar_loop *flat;
    kt_pose *pose;
} place_samples;

/* Whether coinciding ends close the loop, and a program may set the loop's place before the loop is switched on. */
static bool closes_anywhere(const kt_loop_record *r) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[r->kind];
    bool closes = r->comes && !kt_loop_is_off(r) && kt_loop_movable_end(r) >= 0;
    for (int k = 0; closes && k < kind->rows; k++)
        closes = kind->part[k] >= KT_PART_X && kind->part[k] <= KT_PART_TILT_Y;
    return closes;
}

/* Marks the groups with such loops that are open in the given positions; returns whether such groups exist. */
static bool mark_movable_ends(const kt_model *model, kt_data *data, bool *placed) {
    bool any = false;
    kt_violation violation;
    for (size_t i = 0; i < model->n.loop; i++)
        if (closes_anywhere(&model->loop[i]))
            any = placed[model->loop[i].group] = true;
    if (!any || !model->group_kernels->residuals(model, data, 0.0, model->q0, NULL, NULL, &violation))
        return false;
    any = false;
    for (size_t g = 0; g < model->n.group; g++) {
        placed[g] = placed[g] && !kt_group_is_closed(model, data, g, model->q0, CLOSED_BY_SWITCH);
        any = any || placed[g];
    }
    return any;
}

/* Moves the place of each loop to the position that its other end has at q. */
static void move_loop_ends(kt_model *model, kt_pose *pose, const bool *placed, const double *q) {
    kt_link_poses(model, q, pose);
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *r = &model->loop[i];
        double x[6];
        if (!closes_anywhere(r) || !placed[r->group])
            continue;
        const int end = kt_loop_movable_end(r), other = 1 - end;
        const kt_pose here = kt_pose_compose(pose[r->link[other]], r->frame[other]);
        const kt_pose holder = kt_pose_compose(pose[r->link[end]], model->body[r->body[end]].in_link);
        kt_loop_end_pose_write(r->link[end] == 0 ? here : kt_pose_compose(kt_pose_invert(holder), here), x);
        kt_loop_end_pose_put(model, (int)i, x);
    }
}

/* Whether all marked groups are closed as last filled. */
static bool placed_are_closed(const kt_model *model, const kt_data *data, const bool *placed) {
    bool all = true;
    for (size_t g = 0; g < model->n.group; g++)
        all = all && (!placed[g] || kt_rank_is_closed(model, data, g));
    return all;
}

/* Closes the loops at a generic position with their ends moved there, into found->q + nq. Closing the group's other
 * loops moves q, so that the ends follow, for at most ROUNDS times. */
static void sample_moved_ends(kt_model *model, kt_data *data, kt_pose *pose, size_t sample, kt_rank_samples *found) {
    double *q = found->q + model->n.q;
    kt_violation violation;
    kt_rank_scatter(model, kt_rank_sample_size(sample), found->fraction, sample, data->delta);
    kt_position_add(model, model->q0, data->delta, q);
    for (int round = 0; round < ROUNDS; round++) {
        move_loop_ends(model, pose, found->placed, q);
        if (!model->group_kernels->residuals(model, data, 0.0, q, NULL, NULL, &violation) ||
            placed_are_closed(model, data, found->placed))
            return;
        (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_SAMPLE, q);
        if (placed_are_closed(model, data, found->placed))
            return;
    }
}

/* Samples the ranks of the marked groups with moved ends. Other groups are neither displaced (fraction 0) nor evaluated
 * (places). */
static void sample_with_moved_ends(kt_model *model, kt_data *data, kt_pose *pose, kt_rank_samples *found) {
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = found->placed[g] ? 1.0 : 0.0;
    found->places = true;
    for (size_t s = 0; s < KT_RANK_SAMPLES; s++) {
        sample_moved_ends(model, data, pose, s, found);
        kt_rank_sample_groups(model, data, found->q + model->n.q, true, found);
    }
    found->places = false;
}

kt_status kt_rank_sample_places(kt_model *model, kt_data *data, kt_rank_samples *found) {
    const size_t loops = model->n.loop * sizeof *model->loop;
    const size_t flats = model->n.planar ? model->n.loop * sizeof *model->planar_loop : 0;
    if (!model->settable || !mark_movable_ends(model, data, found->placed))
        return KT_OK;
    kt_pool pool = {.chunks = NULL};
    place_samples kept;
    kept.loop = kt_pool_take(&pool, loops, 1);
    kept.flat = kt_pool_take(&pool, flats, 1);
    kept.pose = kt_pool_take(&pool, model->n.link, sizeof *kept.pose);
    const bool all = kept.loop != NULL && kept.flat != NULL && kept.pose != NULL;
    if (all) {
        memcpy(kept.loop, model->loop, loops);
        if (flats > 0)
            memcpy(kept.flat, model->planar_loop, flats);
        sample_with_moved_ends(model, data, kept.pose, found);
        memcpy(model->loop, kept.loop, loops);
        if (flats > 0)
            memcpy(model->planar_loop, kept.flat, flats);
    }
    kt_pool_free(pool.chunks);
    return all ? KT_OK : KT_ERROR_MEMORY;
}
