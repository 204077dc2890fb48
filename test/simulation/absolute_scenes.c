/* Every bundled scene in both formulations.
 *
 * At instants of the tree's run the absolute formulation is set to the tree's state and asked for accelerations, which
 * must be the same to rounding. And where it can be had in a blink, the motion from the start is followed as well.
 */
#include "both.h"

#include "kinetree/scene.h"

#include <dirent.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INSTANTS = 6, NUMBERS = 160 };

static int is_scene(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 5 && strcmp(entry->d_name + length - 5, ".yaml") == 0;
}

/* Calls visit with each scene that has no more bodies than that, compiled for both formulations. */
static void visit_all(int most, void (*visit)(const char *name, const kt_scene *scene, const kt_model *model)) {
    struct dirent **entries = NULL;
    const int count = scandir(KT_SCENES, &entries, is_scene, alphasort);
    kt_check_above("scenes", count, 18);
    for (int i = 0; i < count; i++) {
        char path[1024];
        kt_scene scene;
        kt_error error;
        snprintf(path, sizeof path, "%s/%s", KT_SCENES, entries[i]->d_name);
        if (kt_fine(entries[i]->d_name, kt_scene_read(path, &scene, NULL, NULL, &error), &error)) {
            kt_model_options options = kt_model_options_default();
            options.reduction = scene.run.reduction;
            options.metric = scene.run.metric;
            kt_model *model = NULL;
            if (scene.description.body_count > most)
                kt_note("%s: left out, %d bodies", entries[i]->d_name, scene.description.body_count);
            else
                model = kt_both_compile(&scene.description, &options);
            if (model)
                visit(entries[i]->d_name, &scene, model);
            kt_model_free(model);
            kt_scene_free(&scene);
        }
        free(entries[i]);
    }
    free(entries);
}

static kt_simulation *simulate(const kt_scene *scene, const kt_model *model, kt_formulation formulation) {
    kt_run run = scene->run;
    run.formulation = formulation;
    return kt_scene_simulate(model, &run, NULL);
}

/* The accelerations of both where the tree is now, each times the square root of the inertia along it: as an error
 * weighs in kinetic energy, a thumb's less than the body's that carries it. *least is the least of these roots. */
static bool weighted_accelerations(kt_simulation *tree, kt_simulation *other, const kt_model *model, kt_data *data,
                                   double *a, double *b, double *least) {
    static double mass[NUMBERS * NUMBERS];
    const double *q = kt_simulation_positions(tree), *v = kt_simulation_velocities(tree);
    const int nv = kt_model_nv(model);
    kt_error error;
    kt_status status = kt_simulation_set_state(other, kt_simulation_time(tree), q, v, &error);
    if (status == KT_OK)
        status = kt_simulation_acceleration(tree, a, &error);
    if (status == KT_OK)
        status = kt_simulation_acceleration(other, b, &error);
    if (status == KT_OK)
        status = kt_dynamics_mass(model, data, q, mass, &error);
    *least = INFINITY;
    for (int i = 0; i < nv; i++) {
        const double weight = sqrt(mass[(size_t)i * (size_t)(nv + 1)]);
        *least = fmin(*least, weight);
        a[i] *= weight;
        b[i] *= weight;
    }
    return kt_fine("accelerations", status, &error);
}

/* A length and a rate that are off by so much are a force where a spring or a damper measures them. */
static double force_of(const kt_scene *scene, double length, double rate) {
    double most = 0.0;
    for (int i = 0; i < scene->description.effect_count; i++) {
        const kt_effect *effect = &scene->description.effects[i];
        most = fmax(most, effect->stiffness * length + effect->damping * rate);
    }
    return most;
}

/* Relative to the largest; bound: five times the largest of all scenes, for each freedom squared; and what eight
 * roundings of a metre do to a spring. */
static void compare_accelerations(const char *name, const kt_scene *scene, const kt_model *model) {
    kt_worst worst = kt_worst_make(name);
    kt_error error;
    kt_data *data = NULL;
    const int nv = kt_model_nv(model);
    kt_simulation *tree = simulate(scene, model, KT_FORMULATION_TREE);
    kt_simulation *other = simulate(scene, model, KT_FORMULATION_ABSOLUTE);
    const double last = fmin(scene->run.duration, 2.0);
    bool fine = tree && other && nv <= NUMBERS && kt_fine("data", kt_data_create(model, &data, &error), &error);
    for (int k = 0; k < INSTANTS && fine; k++) {
        double a[NUMBERS], b[NUMBERS], most = 1.0, least = 1.0;
        const double t = last * k / (INSTANTS - 1);
        fine = kt_fine(name, kt_simulation_advance(tree, t, &error), &error) &&
               weighted_accelerations(tree, other, model, data, a, b, &least);
        for (int i = 0; i < nv; i++)
            most = fmax(most, fabs(a[i]));
        const double bound = 9e-15 * nv * nv + force_of(scene, 8.0 * DBL_EPSILON, 0.0) / (least * most);
        for (int i = 0; i < nv && fine; i++)
            kt_worst_near(&worst, b[i] / most, a[i] / most, bound, "t = %g, %d", t, i);
    }
    kt_check_worst(&worst);
    kt_data_free(data);
    kt_simulation_free(tree);
    kt_simulation_free(other);
}

KT_TEST(accelerations_agree_in_every_scene) { visit_all(100, compare_accelerations); }

/* Freedoms less independent equations, redundant ones included. */
static void compare_mobility(const char *name, const kt_scene *scene, const kt_model *model) {
    (void)scene;
    kt_check_equal_int(name, kt_model_freedom(kt_model_absolute(model)).minimal, kt_model_freedom(model).minimal);
}

KT_TEST(mobility_agrees_in_every_scene) { visit_all(40, compare_mobility); }

static kt_both_worst motions;

/* The least inertia along a coordinate at the start. */
static double least_inertia(const kt_model *model) {
    static double q[NUMBERS], v[NUMBERS], mass[NUMBERS * NUMBERS];
    const int nv = kt_model_nv(model);
    kt_data *data = NULL;
    kt_error error;
    double least = INFINITY;
    kt_model_initial(model, q, v);
    kt_status status = kt_data_create(model, &data, &error);
    if (status == KT_OK)
        status = kt_dynamics_mass(model, data, q, mass, &error);
    for (int i = 0; i < nv && kt_fine("mass", status, &error); i++)
        least = fmin(least, mass[(size_t)i * (size_t)(nv + 1)]);
    kt_data_free(data);
    return least;
}

/* How far off the world's origin free bodies start, or a metre: moments of their joints are about that origin. */
static double arm_of(const kt_scene *scene) {
    double most = 1.0;
    for (int i = 0; i < scene->description.body_count; i++) {
        const kt_joint *joint = &scene->description.bodies[i].joint;
        for (int k = 0; k < 3 && joint->type == KT_JOINT_FREE; k++)
            most = fmax(most, fabs(joint->position[k]));
    }
    return most;
}

/* The first 200 steps of 50 000, which leave rounding alone to differ, as long as it is cheap. Bounds: five times the
 * largest of all scenes, and what springs and dampers make of that. Reactions of redundant loops are shared in more
 * ways than one. */
static void compare_motions(const char *name, const kt_scene *scene, const kt_model *model) {
    static kt_both_trace tree, other;
    const kt_freedom freedom = kt_model_freedom(model);
    const double off = force_of(scene, 1.2e-14, 2e-12);
    const kt_both_bounds bounds = {.position = 1.2e-14,
                                   .velocity = 2e-12,
                                   .acceleration = 5.5e-12 + off / least_inertia(model),
                                   .energy = 2e-13,
                                   .reaction = freedom.rank == freedom.equations ? (6e-13 + off) * arm_of(scene) : 0.0};
    kt_run run = kt_run_fixed("dop853", 2e-5 * scene->run.duration, 4e-3 * scene->run.duration);
    run.interval = 4e-4 * scene->run.duration;
    if (kt_both_run(model, KT_FORMULATION_TREE, run, NULL, &tree) &&
        kt_both_run(model, KT_FORMULATION_ABSOLUTE, run, NULL, &other))
        kt_both_compare(&motions, name, &tree, &other, &bounds);
}

KT_TEST(motions_agree_in_every_small_scene) {
    motions = kt_both_worst_make();
    visit_all(KT_BOTH_BODIES - 1, compare_motions);
    kt_both_check(&motions);
}
