/* Every bundled scene: that it is there, described, and runs in a blink. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef void kt_visit(const char *name);

/* Calls visit for each scene, in alphabetical order. */
static void visit_all(kt_visit *visit) {
    kt_check_above("scenes", kt_bundled_count(), 36);
    for (int i = 0; kt_bundled(i) != NULL; i++)
        visit(kt_bundled(i));
}

/* Scenes that were promised. */
static const char *const promised[] = {"pendulum",
                                       "double-pendulum",
                                       "rod-chain-3",
                                       "rod-chain-5",
                                       "spherical-pendulum",
                                       "spinning-top",
                                       "lagrange-top",
                                       "precessing-top",
                                       "flip",
                                       "three-body",
                                       "arm7",
                                       "humanoid",
                                       "conical-pendulum",
                                       "trolley",
                                       "screw",
                                       "puck",
                                       "sleeve",
                                       "chain",
                                       "bead",
                                       "flyball-governor",
                                       "four-bar",
                                       "slider-crank",
                                       "slider-crank-spring",
                                       "n-four-bar-2",
                                       "n-four-bar-40",
                                       "andrews",
                                       "bricard",
                                       "scissor-lift",
                                       "stewart",
                                       "watt",
                                       "stephenson",
                                       "peaucellier",
                                       "hooke-shaft",
                                       "rolling-disc",
                                       "skate",
                                       "constant-velocity",
                                       "spiral-wire",
                                       "torus-marble",
                                       "bicycle",
                                       "cart-pole",
                                       "furuta-pendulum",
                                       "quarter-car",
                                       "tethered-satellites",
                                       "walking-beam-pump",
                                       "landing-gear",
                                       "thruster-lag",
                                       "rocket",
                                       "sliding-chain",
                                       "leaking-pendulum",
                                       "dc-motor",
                                       "hydraulic-cylinder",
                                       "pid-arm",
                                       "lugre",
                                       "flapping-wings",
                                       "articulated-rotor",
                                       "rolling-ball",
                                       "rope",
                                       "engine-mounts",
                                       "servo-arm",
                                       "fishing-rod",
                                       "five-bar",
                                       "shot"};

KT_TEST(scenes_that_were_promised_are_there) {
    for (size_t i = 0; i < sizeof promised / sizeof promised[0]; i++)
        kt_check_above(promised[i], kt_model_body_count(kt_case_open(promised[i]).model), 1.0);
}

KT_TEST(human_figure_is_a_tree_of_thirty_bodies) {
    kt_case c = kt_case_open("humanoid");
    double mass = 0.0;
    for (int i = 1; i < kt_model_body_count(c.model); i++)
        mass += kt_body_mass(c.model, i);
    kt_check_equal_int("bodies", kt_model_body_count(c.model) - 1, 30);
    kt_check_equal_int("freedoms", kt_model_nv(c.model), 53);
    kt_check_near("mass", mass, 75.0, 1e-12);
}

/* Each joint type is shown in some scene. */
static bool shown[KT_JOINT_TYPE_COUNT];

static void note_joints(const char *name) {
    kt_case c = kt_case_open(name);
    for (int i = 1; i < kt_model_body_count(c.model); i++)
        shown[kt_body_coordinates(c.model, i).type] = true;
}

KT_TEST(every_joint_type_is_shown_in_a_scene) {
    memset(shown, 0, sizeof shown);
    visit_all(note_joints);
    for (int type = 0; type < KT_JOINT_TYPE_COUNT; type++)
        kt_check_true(kt_joint_type_name((kt_joint_type)type), shown[type]);
}

/* And each effect. */
static bool acts[KT_EFFECT_TYPE_COUNT];

static void note_effects(const char *name) {
    kt_case c = kt_case_open(name);
    for (int i = 0; i < c.scene.description.effect_count; i++)
        acts[c.scene.description.effects[i].type] = true;
}

KT_TEST(every_effect_type_is_shown_in_a_scene) {
    memset(acts, 0, sizeof acts);
    visit_all(note_effects);
    for (int type = 0; type < KT_EFFECT_EXPRESSION; type++) /* formulas have no bundled scene yet */
        kt_check_true(kt_effect_type_name((kt_effect_type)type), acts[type]);
}

/* ---- what a file says of itself ---------------------------------------------------------------------------------- */

/* The number of lines of comment that a file begins with, and its longest line. */
static int count_comment(const char *name, int *longest) {
    char line[1024];
    int count = 0;
    bool begins = true;
    FILE *file = fopen(kt_bundled_path(name), "r");
    *longest = 0;
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        int length = (int)strcspn(line, "\n");
        *longest = length > *longest ? length : *longest;
        begins = begins && line[0] == '#';
        count += begins ? 1 : 0;
    }
    if (file != NULL)
        fclose(file);
    return count;
}

static void check_words(const char *name) {
    int longest, comment = count_comment(name, &longest);
    kt_note("%s", name);
    if (comment < 2 || comment > 4)
        kt_check_equal_int("lines of comment, 2 to 4", comment, 3);
    kt_check_below("longest line", longest, 120);
    kt_case c = kt_case_open(name);
    const char *title = c.scene.description.name;
    kt_check_below("length of the title", title == NULL ? (double)NAN : (double)strlen(title), 64);
    kt_check_above("markers recorded", c.scene.run.marker_count, 1);
}

KT_TEST(every_scene_says_what_it_is) { visit_all(check_words); }

/* ---- writing ----------------------------------------------------------------------------------------------------- */

/* Accelerations of the start. If an open contact touches there, a simulation finds its set. */
static kt_status accelerate(const kt_model *model, kt_data *data, const double *q, const double *v, double *a,
                            kt_error *error) {
    const kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    kt_status status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, error);
    if (status != KT_ERROR_UNSUPPORTED)
        return status;
    status = kt_simulation_create(model, &run, NULL, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_acceleration(simulation, a, error);
    kt_simulation_free(simulation);
    return status;
}

/* The same initial state, assembled, and the same accelerations there, to the bit. */
static void check_same_motion(const kt_case *c, const kt_scene *again) {
    enum { NUMBERS = 256 };
    double q[2][NUMBERS], v[2][NUMBERS], a[2][NUMBERS];
    const kt_model *model = kt_test_model(&again->description, NULL);
    kt_error error = {KT_OK, "", ""};
    const kt_model *models[2] = {c->model, model};
    kt_need(kt_check_equal_int("positions", kt_model_nq(model), kt_model_nq(c->model)) &&
            kt_check_below("positions", kt_model_nq(model), NUMBERS));
    for (int k = 0; k < 2; k++) {
        kt_data *data = kt_test_data(models[k]);
        kt_model_initial(models[k], q[k], v[k]);
        kt_need_fine("assembly", kt_state_assemble(models[k], data, 0.0, q[k], v[k], &error), &error);
        kt_need_fine("accelerations", accelerate(models[k], data, q[k], v[k], a[k], &error), &error);
    }
    const size_t nv = (size_t)kt_model_nv(c->model) * sizeof(double);
    kt_check_true("moves the same, to the bit",
                  memcmp(q[0], q[1], (size_t)kt_model_nq(c->model) * sizeof(double)) == 0 &&
                      memcmp(v[0], v[1], nv) == 0 && memcmp(a[0], a[1], nv) == 0);
}

static void check_written(const char *name) {
    kt_note("%s", name);
    const kt_case c = kt_case_open(name);
    const char *text = kt_test_written(&c.scene);
    kt_scene *again = kt_test_scene(text);
    kt_check_true("writing what was read of what was written gives the same bytes",
                  strcmp(kt_test_written(again), text) == 0);
    check_same_motion(&c, again);
}

KT_TEST(every_scene_comes_back_from_the_writer_to_the_bit) { visit_all(check_written); }

/* ---- running ----------------------------------------------------------------------------------------------------- */

static int count_finite(const kt_record *record, void *user) {
    long long *finite = user;
    *finite += isfinite(record->kinetic + record->potential) ? 1 : 0;
    return 0;
}

/* In a blink: a million evaluations of a body take some 0.1 s. A scene has enough records for smooth curves, and not
 * more than a picture needs. */
static void check_run(const char *name) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {KT_OK, "", ""};
    long long finite = 0;
    options.record = KT_RECORD_ENERGY;
    kt_note("%s", name);
    kt_case c = kt_case_open(name);
    kt_simulation *simulation = kt_test_simulation(c.model, &c.scene.run, &options);
    kt_need_fine("run", kt_simulation_run(simulation, count_finite, &finite, &error), &error);
    const long long records = (long long)kt_simulation_record_count(simulation);
    kt_check_equal_int("records, all finite", finite, records);
    kt_check_above("records", (double)records, 200);
    kt_check_below("records", (double)records, 2001);
    kt_check_below("evaluations times bodies",
                   (double)kt_simulation_counts_of(simulation).evaluations * kt_model_body_count(c.model), 1.2e6);
}

KT_TEST(every_scene_runs_to_its_end_in_a_blink) { visit_all(check_run); }
