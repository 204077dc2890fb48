/* Every allocation fails once: the call reports the failure, and nothing leaks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <malloc.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/pool.h"
#include "check.h"
#include "collect.h"
#include "interpose.h"

#include "kinetree/import.h"

static char right[] = "kinetree: 1\n"
                      "name: a scene\n"
                      "bodies:\n"
                      "  - {name: a, joint: {type: revolute}, markers: {tip: [1, 0, 0]}}\n"
                      "  - {name: b, parent: a, mass: 1, shape: {type: sphere, radius: 1}}\n"
                      "loops:\n"
                      "  - {name: l, type: motion, joint: a, position: {polynomial: [0, 1]}}\n"
                      "  - {name: m, type: coupling, coefficients: {a: 1}}\n"
                      "initial: {hold: [a]}\n"
                      "effects:\n"
                      "  - {type: spring, between: [a.tip, world], stiffness: 1}\n"
                      "output: {markers: [a.tip]}\n";
/* Lists of which each takes more than the step by which the lengths of names grow. */
static char lists[] = "kinetree: 1\n"
                      "name: lists\n"
                      "bodies:\n"
                      "  - {name: a, joint: {type: revolute}, markers: {t: [1, 0, 0], u: [0, 0, 0]}}\n"
                      "  - {name: b, joint: {type: revolute}}\n"
                      "  - {name: c, joint: {type: revolute}}\n"
                      "  - {name: d, joint: {type: revolute}}\n"
                      "  - {name: e, joint: {type: revolute}}\n"
                      "  - {name: f, joint: {type: revolute}}\n"
                      "  - {name: g, joint: {type: revolute}}\n"
                      "loops:\n"
                      "  - {name: k, type: motion, joint: a, position: {polynomial: [0, 1, 2, 3, 4, 5, 6]}}\n"
                      "  - {name: l, type: motion, joint: b, position: {table: [[0, 1], [1, 2], [2, 3], [3, 4]]}}\n"
                      "initial: {hold: [a, b, c, d, e, f, g]}\n"
                      "output: {markers: [a.t, a.u]}\n";
/* More faults than their first list has room for, and two that are found while the file is taken apart. */
static char faults[] = "kinetree: 1\n"
                       "name: &anchor faults\n"
                       "gravity: !!seq [0, 0]\n"
                       "bodies: [{mas: 1}, {mas: 1}, {mas: 1}, {mas: 1}, {mas: 1}, {mas: 1}, {mas: 1}, {mas: 1}]\n";
static char wrong[] = "kinetree: 1\nbodys: []\nbodies: [{name: a, mas: 1}, {name: a}]\ngravity: [0, 0]\n";
/* Parameters, of which one is used by nothing, and settings. */
static char computed[] = "kinetree: 1\n"
                         "name: computed\n"
                         "parameters: {L: =2*M, M: =N + 1, N: 3, O: 4}\n"
                         "bodies: [{name: a, joint: {type: revolute}, mass: =L, inertia: [1, 1, =M/N]}]\n";
static char no_yaml[] = "kinetree: 1\nname: [\n";

/* The memory that malloc has given out and not got back. Under the address sanitizer it is always zero, and leaks are
 * reported at the end of the program. */
static long held(void) { return (long)mallinfo2().uordblks; }

/* Runs a call with its n-th allocation failing, n = 1, 2, ... until all have been tried. */
typedef kt_status attempt(void *user);

typedef struct outcome {
    int tried; /* the last of them without a failure */
    int wrong; /* calls that did not return KT_ERROR_MEMORY though an allocation failed */
    int leaks; /* calls after which memory was missing */
    kt_status without_failure;
} outcome;

static outcome fail_each(attempt *call, void *user) {
    /* malloc's own caches come and go by a few hundred bytes. A leak loses ROUNDS pieces of 32 bytes or more. */
    enum { WARM = 4, ROUNDS = 24, PIECE = 32 };
    outcome seen = {0, 0, 0, KT_OK};
    for (int failed = 1; failed && seen.tried < 100000; seen.tried++) {
        long before = 0;
        for (int round = 0; round < WARM + ROUNDS; round++) {
            if (round == WARM)
                before = held();
            kt_interpose_start_failing(seen.tried + 1);
            kt_status status = call(user);
            (void)kt_interpose_stop();
            failed = kt_interpose_has_failed();
            seen.wrong += failed && status != KT_ERROR_MEMORY;
            seen.without_failure = status;
        }
        seen.leaks += held() - before >= ROUNDS * PIECE;
    }
    return seen;
}

static void check_calls(const char *what, attempt *call, void *user, kt_status without_failure, double least) {
    outcome seen = fail_each(call, user);
    kt_note("%s", what);
    kt_check_above("allocations that were made to fail", seen.tried - 1, least);
    kt_check_equal_int("calls that did not say so", seen.wrong, 0);
    kt_check_equal_int("calls that leaked", seen.leaks, 0);
    kt_check_equal_int("without a failure", seen.without_failure, without_failure);
}

static int touched; /* scenes that a failing call changed, or errors that it left empty */

static kt_status parse(void *user) {
    const char *text = user;
    kt_scene scene, rest = kt_scene_default();
    kt_error error = {KT_OK, "", ""};
    memcpy(&scene, &rest, sizeof scene);
    kt_status status = kt_scene_parse("x", text, strlen(text), &scene, NULL, NULL, &error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    else
        touched += !kt_same_bytes(&scene, &rest, sizeof scene) || error.code != status || error.message[0] == '\0';
    return status;
}

static kt_status parse_with_settings(void *user) {
    static const char *const settings[] = {"bodies.a.com=[=L, 0, 0]", "simulate.duration=3"};
    static const char *const variables[] = {"N", "L"};
    static const double values[] = {5.0, 2.0};
    const kt_scene_options options = {
        .settings = settings, .setting_count = 2, .variables = variables, .values = values, .variable_count = 2};
    const char *text = user;
    kt_scene scene;
    kt_error error = {KT_OK, "", ""};
    kt_status status = kt_scene_parse_with("x", text, strlen(text), &options, &scene, NULL, NULL, &error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    return status;
}

KT_TEST(each_failing_allocation_is_an_error_of_reading) {
    touched = 0;
    check_calls("a right scene", parse, right, KT_OK, 20.0);
    check_calls("parameters and settings", parse_with_settings, computed, KT_OK, 8.0);
    check_calls("a wrong scene", parse, wrong, KT_ERROR_SCENE, 20.0);
    check_calls("no YAML", parse, no_yaml, KT_ERROR_SCENE, 10.0);
    kt_check_equal_int("scenes touched, or errors left empty", touched, 0);
}

/* Names of every length move the places where nodes and the scene request more memory. Each of the requests therefore
 * fails once. */
static void check_pieces(const char *scene, const char *key, kt_status without_failure) {
    enum { LONGEST = 4096, STEP = 48 };
    static char text[sizeof lists + sizeof right + LONGEST + 1];
    int calls = 0, wrong_calls = 0;
    const char *rest = strstr(scene, key) + strlen(key);
    const size_t before = (size_t)(rest - scene);
    for (size_t length = 0; length <= LONGEST; length += STEP) {
        memcpy(text, scene, before);
        memset(text + before, 'x', length);
        strcpy(text + before + length, rest);
        for (int n = 1, failed = 1; failed; n++, calls++) {
            kt_interpose_start_failing(n);
            kt_status status = parse(text);
            (void)kt_interpose_stop();
            failed = kt_interpose_has_failed();
            wrong_calls += status != (failed ? KT_ERROR_MEMORY : without_failure);
        }
    }
    kt_check_above("calls", calls, 5000.0);
    kt_check_equal_int("calls that did not say so", wrong_calls, 0);
}

KT_TEST(each_piece_can_fail_to_be_taken) {
    touched = 0;
    check_pieces(right, "name: ", KT_OK);
    check_pieces(lists, "name: ", KT_OK);
    check_pieces(computed, "kinetree: 1\nname: ", KT_OK);
    check_pieces(faults, "name: &anchor ", KT_ERROR_SCENE);
    kt_check_equal_int("scenes touched, or errors left empty", touched, 0);
}

KT_TEST(sizes_beyond_all_memory_are_rejected) {
    kt_pool pool = {NULL, 0};
    kt_check_true("a product that overflows", kt_pool_take(&pool, SIZE_MAX / 2, 3) == NULL);
    kt_check_true("a piece that leaves no room for its chunk", kt_pool_take(&pool, SIZE_MAX - 16, 1) == NULL);
    kt_check_true("a text without room for its end", kt_pool_text(&pool, "", SIZE_MAX) == NULL);
    kt_check_true("nothing was taken", pool.chunks == NULL);
    kt_check_true("pieces of no size are there", kt_pool_take(&pool, 3, 0) != NULL);
    kt_check_true("a text is", kt_pool_text(&pool, "abc", 2) != NULL);
    kt_pool_free(pool.chunks);
}

static kt_status read_file(void *user) {
    kt_scene scene;
    kt_status status = kt_scene_read(user, &scene, NULL, NULL, NULL);
    if (status == KT_OK)
        kt_scene_free(&scene);
    return status;
}

KT_TEST(each_failing_allocation_is_an_error_of_reading_a_file) {
    char path[] = "/tmp/kinetree-memory-XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    kt_need(kt_check_true("a file", file != NULL));
    for (int i = 0; i < 4000; i++) /* more than the first piece, 64 KB */
        fputs("# a line of a comment\n", file);
    fputs("kinetree: 1\n", file);
    (void)fclose(file);
    check_calls("a file", read_file, path, KT_OK, 10.0);
    (void)unlink(path);
}

typedef struct writing {
    const kt_scene *scene;
    FILE *stream;
} writing;

static kt_status write_scene(void *user) {
    const writing *job = user;
    return kt_scene_write(job->scene, job->stream, NULL);
}

KT_TEST(each_failing_allocation_is_an_error_of_writing) {
    writing job = {kt_test_scene(right), fopen("/dev/null", "w")};
    kt_need(kt_check_true("a stream", job.stream != NULL));
    kt_check_equal_int("once, for the stream's buffer", write_scene(&job), KT_OK);
    check_calls("writing", write_scene, &job, KT_OK, 1.0);
    (void)fclose(job.stream);
}

/* The last, for expat's memory leaves malloc's caches in another state every time. */
static char robot[] =
    "<robot name='r'><link name='a b'/><link name='b'><inertial><mass value='1'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
    "<link name='c'><inertial><mass value='1'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
    "<joint name='j' type='revolute'><parent link='a b'/><child link='b'/><dynamics damping='1'/></joint>"
    "<joint name='k' type='revolute'><parent link='b'/><child link='c'/><mimic joint='j'/></joint>"
    "<gazebo/></robot>";

static char model[] =
    "<mujoco model='m'><compiler angle='radian' eulerseq='ZYX'/><default><joint damping='1'/>"
    "<default class='c'><geom density='1'/></default></default><worldbody><body name='a b' childclass='c'><freejoint/>"
    "<geom size='1' fromto='0 0 0 0 0 1' type='capsule'/><geom type='mesh' mesh='t'/><frame euler='1 2 3'>"
    "<body name='r'><joint name='j0'/><joint name='j1' pos='0 1 0'/><geom size='1'/><site name='s'/></body></frame>"
    "</body></worldbody><tendon><fixed name='t' stiffness='2'><joint joint='j0' coef='1'/>"
    "<joint joint='j1' coef='2'/></fixed></tendon><actuator><position name='p' joint='j1' kp='3'/>"
    "<velocity tendon='t' kv='2'/></actuator><equality><connect body1='a b' anchor='0 0 0'/>"
    "<joint joint1='j0' joint2='j1'/></equality><keyframe><key name='home' ctrl='1 2'/></keyframe><camera/>"
    "<asset><mesh name='t' vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3'/></asset></mujoco>";

static char joints[] =
    "<sdf version='1.9'><!-- -- --><world name='w'><model name='a b'><link name='l'/><link name='k'><inertial "
    "auto='1'/>"
    "<collision name='c'><geometry><sphere/></geometry></collision><gravity>0</gravity></link><link name='h'/>"
    "<frame name='f' attached_to='k'><pose>1 0 0 0 0 0</pose></frame><joint name='j' type='universal'><pose>0 1 0 0 0 0"
    "</pose><parent>l</parent><child>k</child><axis><xyz>1 0 0</xyz><dynamics><damping>1</damping></dynamics></axis>"
    "<axis2><xyz>0 1 0</xyz></axis2></joint><joint name='i' type='revolute'><parent>f</parent><child>h</child><axis>"
    "<xyz>0 0 1</xyz><mimic joint='j'/></axis></joint><joint name='o' type='ball'><parent>l</parent><child>h</child>"
    "</joint><joint name='g' type='gearbox'><parent>l</parent><child>h</child><gearbox_reference_body>k"
    "</gearbox_reference_body></joint></model><light/></world></sdf>";

static kt_status parse_robot(void *user) {
    const char *text = user;
    const kt_robot_options how = {.keyframe = text == model ? "home" : NULL};
    kt_scene scene, rest = kt_scene_default();
    kt_error error = {KT_OK, "", ""};
    memcpy(&scene, &rest, sizeof scene);
    const kt_status status = kt_robot_parse("x", text, strlen(text), &how, &scene, NULL, NULL, &error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    else
        touched += !kt_same_bytes(&scene, &rest, sizeof scene) || error.code != status || error.message[0] == '\0';
    return status;
}

KT_TEST(each_failing_allocation_is_an_error_of_reading_a_robot) {
    touched = 0;
    check_calls("a robot in URDF", parse_robot, robot, KT_OK, 20.0);
    check_calls("a model in MJCF", parse_robot, model, KT_OK, 20.0);
    check_calls("a model in SDF", parse_robot, joints, KT_OK, 20.0);
    kt_check_equal_int("scenes touched, or errors left empty", touched, 0);
}
