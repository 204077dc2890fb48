/* The file of --native, which all runs of a sweep share. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

/* How many runs of a tree a thread computes at a time, in lanes; 1: it has loops, or lanes do not compute it. */
static size_t count_lanes_of_tree(const kt_model *model) {
    kt_ensemble *ensemble = NULL;
    if (kt_loop_count(model) > 0 || kt_ensemble_create(model, &ensemble, NULL) != KT_OK)
        return 1;
    const size_t width = kt_ensemble_report_of(ensemble).width;
    kt_ensemble_free(ensemble);
    return width;
}

int kt_sweep_make_native(kt_sweep *sweep, const kt_scene *scene, const kt_model *model) {
    const kt_sweep_arguments *arguments = sweep->arguments;
    const size_t lanes = arguments->one_by_one ? 1 : count_lanes_of_tree(model);
    if (lanes <= 1 && !kt_native_is_slow(model))
        return kt_native_file_make(&sweep->native, "sweep", scene, model);
    if (arguments->quiet)
        return -1;
    if (lanes > 1)
        kt_say("--native: the library computes the accelerations, since it is faster for %zu runs of a tree at a time; "
               "leave --native out, or add --one-by-one",
               lanes);
    else
        kt_say("--native: the library computes the accelerations, since it is faster for planar trees of more than 12 "
               "coordinates; leave --native out");
    return -1;
}
