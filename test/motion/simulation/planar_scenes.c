/* Every bundled scene of planar trees without loops, in the plane and in space. The test compares the first tenth of
 * each, record for record, with energies and all reactions.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "both.h"
#include "files/scene/collect.h"
#include "scene_files.h"

#include "kinetree/scene.h"
#include "kinetree/study.h"

#include <string.h>

static kt_model *compile(const kt_scene *scene, kt_plan plan) {
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(scene->reduction);
    options.metric = scene->run.metric;
    options.plan = plan;
    return kt_test_model(&scene->description, &options);
}

/* Bounds: five times the largest of all scenes. */
static void compare(kt_both_worst *worst, const char *name, const kt_scene *scene, const kt_model *planar,
                    const kt_model *spatial) {
    static kt_both_trace flat, space;
    const kt_both_bounds bounds = {
        .position = 5e-15, .velocity = 1e-14, .acceleration = 2.5e-14, .energy = 2e-14, .reaction = 1e-14};
    kt_run run = kt_run_fixed("dop853", 2e-4 * scene->run.duration, 0.1 * scene->run.duration);
    run.interval = 1e-3 * scene->run.duration;
    if (kt_both_run(spatial, NULL, run, &space) && kt_both_run(planar, NULL, run, &flat))
        kt_both_compare(worst, name, &space, &flat, &bounds);
}

KT_TEST(planar_scenes_move_in_the_plane_as_in_space) {
    kt_both_worst worst = kt_both_worst_make();
    int compared = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_scene *scene = kt_test_bundled(kt_bundled(i));
        kt_model *planar = compile(scene, KT_PLAN_AUTO), *spatial = compile(scene, KT_PLAN_SPATIAL);
        const bool is_planar = planar && scene->description.loop_count == 0 && !kt_is_switched(&scene->description) &&
                               strcmp(kt_model_plan(planar), "spatial") != 0;
        if (is_planar && scene->description.body_count >= KT_BOTH_BODIES)
            kt_note("%s: %s, left out: %d bodies", kt_bundled(i), kt_model_plan(planar), scene->description.body_count);
        else if (is_planar && spatial) {
            kt_note("%s: %s", kt_bundled(i), kt_model_plan(planar));
            compare(&worst, kt_bundled(i), scene, planar, spatial);
            compared++;
        }
    }
    kt_check_above("scenes compared", compared, 5);
    kt_both_check(&worst);
}
