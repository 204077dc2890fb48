/* Every bundled scene as a batch: with loops and effects, which are computed state by state. The states lie around the
 * initial one, loops closed. */
#include "check.h"
#include "many.h"
#include "scene_files.h"

#include "kinetree/closure.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* States that differ from the initial one by little, in positions, velocities and forces. */
static void draw_states(kt_many *many, kt_data *data, kt_random *random) {
    double *step = calloc(many->nv + 1, sizeof *step);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        double *q = many->q + i * many->nq, *v = many->v + i * many->nv;
        for (size_t k = 0; k < many->nv; k++) {
            step[k] = kt_random_uniform(random, -0.02, 0.02);
            v[k] += kt_random_uniform(random, -0.1, 0.1);
            many->tau[i * many->nv + k] = kt_random_uniform(random, -1.0, 1.0);
            many->a[i * many->nv + k] = kt_random_uniform(random, -1.0, 1.0);
        }
        kt_position_add(many->model, q, step, q);
        if (kt_state_project(many->model, data, many->t[i], q, v, NULL, NULL) != KT_OK)
            kt_note("state %zu: its loops stay open", i);
    }
    free(step);
}

typedef struct sums {
    int scenes, in_lanes, different;
} sums;

static void compare(const char *name, const kt_scene *scene, kt_random *random, sums *s) {
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_many many;
    kt_error error;
    options.metric = scene->run.metric;
    if (!kt_check_equal_int(name, kt_model_compile(&scene->description, &options, &model, &error), KT_OK) ||
        !kt_check_equal_int(name, kt_data_create(model, &data, &error), KT_OK))
        return;
    if (kt_has_variable_mass(&scene->description)) { /* which a batch does not carry, and refuses */
        kt_batch *batch = NULL;
        const kt_batch_options one = kt_batch_options_default();
        kt_check_true("variable masses are refused", kt_batch_create(model, &one, &batch, &error) != KT_OK);
        kt_batch_free(batch);
    } else if (kt_many_make(&many, model, kt_method_find("rk4"))) {
        draw_states(&many, data, random);
        int different = kt_many_compare_forward(&many, data) + kt_many_compare_inverse(&many, data);
        if (many.nv <= 200) /* of large ones each step takes long, state by state, and again */
            different +=
                kt_many_compare_steps(&many, data, 1e-4, 2) + kt_many_compare_semi_implicit(&many, data, 1e-4, 2);
        const kt_batch_report report = kt_batch_report_of(many.batch);
        if (different > 0)
            kt_note("%s: %d differ", name, different);
        s->scenes++;
        s->different += different;
        s->in_lanes += report.in_lanes > 0;
        if (report.width == 1 && report.why == NULL)
            kt_check_true("it says why it is computed state by state", false);
        kt_many_free(&many);
    }
    kt_data_free(data);
    kt_model_free(model);
}

KT_TEST(bundled_scenes_have_the_bits_of_single_states) {
    struct dirent **entries = NULL;
    const int count = scandir(KT_SCENES, &entries, kt_is_scene_file, alphasort);
    kt_random random = kt_random_of_test();
    sums s = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        char path[1024];
        kt_scene scene;
        kt_error error;
        snprintf(path, sizeof path, "%s/%s", KT_SCENES, entries[i]->d_name);
        if (kt_check_equal_int(entries[i]->d_name, kt_scene_read(path, &scene, NULL, NULL, &error), KT_OK)) {
            compare(entries[i]->d_name, &scene, &random, &s);
            kt_scene_free(&scene);
        }
        free(entries[i]);
    }
    free(entries);
    kt_note("%d scenes, %d of them in lanes", s.scenes, s.in_lanes);
    kt_check_above("scenes", s.scenes, 50);
    kt_check_above("scenes in lanes", s.in_lanes, 10);
    kt_check_equal_int("results that differ", s.different, 0);
}
