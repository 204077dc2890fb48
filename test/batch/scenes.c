/* Every bundled scene as a batch, and random linkages: with effects and loops, in lanes and state by state. The states lie
 * around the initial one, loops closed. */
#include "check.h"
#include "linkages.h"
#include "many.h"
#include "scene_files.h"

#include "dynamics/dynamics.h"
#include "kinetree/closure.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* States that differ from the initial one by `most` in positions, and in velocities and forces. */
static void draw_states(kt_many *many, kt_data *data, double most, kt_random *random) {
    double *step = calloc(many->nv + 1, sizeof *step);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        double *q = many->q + i * many->nq, *v = many->v + i * many->nv;
        for (size_t k = 0; k < many->nv; k++) {
            step[k] = kt_random_uniform(random, -most, most);
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
        draw_states(&many, data, 0.02, random);
        int different = kt_many_compare_forward(&many, data) + kt_many_compare_inverse(&many, data) +
                        kt_many_compare_sensors(&many, data);
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

/* An effect in the coordinate of a loop is not computed in lanes, nor are the others of such a model. */
KT_TEST(effects_in_coordinates_of_loops_have_the_bits_of_single_states) {
    kt_effect spring = kt_effect_default();
    kt_random random = kt_random_of_test();
    sums s = {0, 0, 0};
    kt_scene scene;
    kt_error error;
    spring.type = KT_EFFECT_JOINT_SPRING;
    spring.joint = "close";
    spring.stiffness = 3.0;
    if (!kt_check_equal_int("four-bar", kt_scene_read(KT_SCENES "/four-bar.yaml", &scene, NULL, NULL, &error), KT_OK))
        return;
    const kt_effect *effects = scene.description.effects;
    const int count = scene.description.effect_count;
    scene.description.effects = &spring;
    scene.description.effect_count = 1;
    compare("four-bar with a spring in its loop", &scene, &random, &s);
    scene.description.effects = effects;
    scene.description.effect_count = count;
    kt_scene_free(&scene);
    kt_check_equal_int("scenes in lanes", s.in_lanes, 0);
    kt_check_equal_int("results that differ", s.different, 0);
}

enum { LINKAGES = 80 };

/* Random linkages of which some states are near singular positions: these leave the lanes. */
static void compare_linkages(kt_isa isa, const char *name) {
    kt_random random = kt_random_of_test();
    int different = 0;
    uint64_t in_lanes = 0, alone = 0;
    for (int n = 0; n < LINKAGES && kt_isa_resolve(isa) == isa; n++) {
        static kt_linkages linkages;
        const kt_model_options options = {.isa = isa};
        kt_model *model = NULL;
        kt_data *data = NULL;
        kt_many many;
        kt_error error;
        kt_linkages_describe(&linkages, n % 5 == 4, &random);
        if (kt_model_compile(&linkages.description, &options, &model, &error) != KT_OK ||
            kt_data_create(model, &data, &error) != KT_OK ||
            !kt_many_make(&many, model, kt_method_find(n % 2 ? "dopri5" : "rk4"))) {
            kt_note("linkage %d: %s: %s", n, error.where, error.message);
            kt_check_true("a linkage is compiled", false);
            return;
        }
        draw_states(&many, data, n % 5 == 4 ? 1e-3 : 0.1, &random);
        many.threads = 1 + (size_t)n % KT_MANY_THREADS;
        const int found = kt_many_compare_forward(&many, data) + kt_many_compare_inverse(&many, data) +
                          kt_many_compare_sensors(&many, data) + kt_many_compare_steps(&many, data, 1e-3, 2) +
                          kt_many_compare_semi_implicit(&many, data, 1e-3, 2);
        different += kt_batch_is_fused() && n % 5 == 4 ? 0 : found; /* next to singular positions rounding is large */
        const kt_batch_report report = kt_batch_report_of(many.batch);
        in_lanes += report.in_lanes;
        alone += report.alone;
        kt_many_free(&many);
        kt_data_free(data);
        kt_model_free(model);
    }
    if (kt_isa_resolve(isa) != isa) {
        kt_skip(name, KT_NO_ISA);
        return;
    }
    kt_note("%s: %llu evaluations in lanes, %llu alone", name, (unsigned long long)in_lanes, (unsigned long long)alone);
    kt_check_equal_int("states that differ", different, 0);
    kt_check_above("evaluations in lanes for one alone", (double)in_lanes / (double)(alone + 1), 2.0);
    kt_check_above("evaluations that leave the lanes", (double)alone, 1.0);
}

KT_TEST(linkages_have_the_bits_of_single_states_on_the_baseline) { compare_linkages(KT_ISA_BASE, "baseline"); }
KT_TEST(linkages_have_the_bits_of_single_states_on_v3) { compare_linkages(KT_ISA_V3, "v3"); }
KT_TEST(linkages_have_the_bits_of_single_states_on_v4) { compare_linkages(KT_ISA_V4, "v4"); }
