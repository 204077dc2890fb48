/* Writing: the layout, and that nothing is lost on the way there and back. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "difference.h"
#include "invent.h"

static const char layout[] =
    "kinetree: 1\n"
    "name: \"every section: a sample\"\n"
    "gravity: [0, -9.81, 0]\n"
    "\n"
    "bodies:\n"
    "  - name: crank\n"
    "    joint:\n"
    "      type: revolute\n"
    "      axis: -y\n"
    "      at: [0.1, 0, 0]\n"
    "      rotation: {euler: {sequence: 313, angles: [0.1, 0.2, 0.3]}}\n"
    "      position: 1.5\n"
    "      velocity: -0.1\n"
    "    mass: 1.2\n"
    "    com: [0.5, 0, 0]\n"
    "    inertia: [1, 1, 1, 0.1, 0, 0]\n"
    "    shape: {type: cylinder, radius: 0.1, length: 1, axis: x, at: [0.5, 0, 0]}\n"
    "    markers:\n"
    "      tip: [1, 0, 0]\n"
    "      \"no\": [0, 1.0e-9, 0]\n"
    "  - name: ball\n"
    "    parent: crank\n"
    "    joint:\n"
    "      type: spherical\n"
    "      position: [0.6, 0.8, 0, 0]\n"
    "    mass: 2\n"
    "    shape: {type: box, size: [1, 2, 3], rotation: {axis: z, angle: 0.5}}\n"
    "  - name: \"null\"\n"
    "    parent: ball\n"
    "    joint:\n"
    "      type: free\n"
    "      position: {position: [1, 2, 3], orientation: {quaternion: [1, 0, 0, 0]}}\n"
    "      velocity: {angular: [0, 0, 1]}\n"
    "\n"
    "loops:\n"
    "  - {name: close, type: revolute, between: [crank.tip, {body: ball, at: [0, 0, 1], rotation: {rpy: [0, 0, "
    "1]}}]}\n"
    "  - {name: rod, type: distance, between: [ball, world], length: {sine: {amplitude: 0.1, frequency: 2, offset: "
    "3}}}\n"
    "  - {name: gear, type: coupling, coefficients: {crank: 1}, offset: 0.5}\n"
    "  - {name: drive, type: motion, joint: crank, position: {table: [[0, 0], [1, 2]], interpolation: cubic}}\n"
    "  - {name: roll, type: rolling, wheel: crank.tip, radius: 0.3, on: world, normal: y}\n"
    "\n"
    "initial:\n"
    "  hold: [crank]\n"
    "\n"
    "effects:\n"
    "  - {type: spring, between: [crank.tip, world], stiffness: 100, damping: 1}\n"
    "  - {name: brake, type: joint_damper, joint: crank, damping: 0.1}\n"
    "  - {type: motor, joint: crank, torque: {ramp: {from: 0, to: 1, start: 0, end: 2}}}\n"
    "  - {type: servo, joint: crank, target: {ramp: {from: 0, to: 1, start: 0, end: 2}}, stiffness: 2}\n"
    "\n"
    "simulate:\n"
    "  duration: 2\n"
    "  integrator: rk4\n"
    "  step: 0.001\n"
    "  formulation: absolute\n"
    "  reduction: svd\n"
    "  metric: mass\n"
    "  plan: spatial\n"
    "\n"
    "output:\n"
    "  interval: 0.01\n"
    "  record: [position, energy]\n"
    "  markers: [crank.tip]\n";

KT_TEST(layout_is_that_of_the_contract) {
    kt_scene *scene = kt_test_scene(layout);
    const char *written = kt_test_written(scene);
    kt_check_text("written", written, layout);
}

/* Zeros that are given are not those that are not. */
KT_TEST(given_zeros_are_read_and_written) {
    static const char text[] =
        "kinetree: 1\n"
        "inertia_check: warn\n\n"
        "bodies:\n"
        "  - name: a\n"
        "    joint: {type: revolute, position: 0}\n"
        "  - name: b\n"
        "    joint: {type: cylindrical, velocity: [0, 0]}\n"
        "  - name: c\n"
        "    joint: {type: free, position: {position: [0, 0, 0]}, velocity: {angular: [0, 0, 0]}}\n"
        "  - name: d\n"
        "    joint: {type: spherical, position: [1, 0, 0, 0]}\n"
        "  - name: e\n"
        "    joint: {type: revolute}\n";
    static const unsigned given[] = {KT_GIVEN_POSITION, KT_GIVEN_VELOCITY, KT_GIVEN_POSITION | KT_GIVEN_ANGULAR,
                                     KT_GIVEN_ORIENTATION, 0};
    kt_scene *scene = kt_test_scene(text);
    for (int i = 0; i < 5; i++)
        kt_check_equal_int("given", kt_joint_given(&scene->description.bodies[i].joint), given[i]);
    kt_check_equal_int("inertias", scene->description.inertia_check, KT_INERTIA_WARN);
    const char *written = kt_test_written(scene);
    kt_scene *again = kt_test_scene(written);
    const char *twice = kt_test_written(again);
    kt_check_text("written again", twice, written);
    for (int i = 0; i < 5; i++)
        kt_check_equal_int("given again", kt_joint_given(&again->description.bodies[i].joint), given[i]);
}

KT_TEST(empty_scene_is_one_line) {
    const kt_scene scene = kt_scene_default();
    const char *written = kt_test_written(&scene);
    kt_check_text("written", written, "kinetree: 1\n");
}

/* Lists of numbers break; no line is much longer than 110 columns (the last item may exceed it by one). */
KT_TEST(long_lists_break_into_lines) {
    static double points[2 * 500];
    kt_scene scene = kt_scene_default();
    kt_body body = kt_body_of("a", NULL, KT_JOINT_REVOLUTE, 0.0);
    kt_loop loop = kt_loop_of("drive", KT_LOOP_MOTION);
    loop.joint = "a";
    loop.function.type = KT_FUNCTION_TABLE;
    loop.function.numbers = points;
    loop.function.number_count = 1000;
    for (int i = 0; i < 500; i++) {
        points[2 * i] = i;
        points[2 * i + 1] = sin(i);
    }
    scene.description.bodies = &body;
    scene.description.loops = &loop;
    scene.description.body_count = scene.description.loop_count = 1;
    const char *written = kt_test_written(&scene);
    size_t longest = 0;
    for (const char *line = written; *line != '\0'; line += strcspn(line, "\n") + 1)
        if (strcspn(line, "\n") > longest)
            longest = strcspn(line, "\n");
    kt_check_below("longest line", (double)longest, 140.0);
    kt_check_text("first difference", kt_scene_difference(&scene, kt_test_scene(written)), "");
}

/* x -> write -> read is x, and writing that gives the same bytes. */
static void check_round_trips(bool everything, int count) {
    static kt_invented invented;
    kt_random random = kt_random_of_test();
    int right = 0;
    for (int i = 0; i < count; i++) {
        kt_invent(&invented, &random, everything);
        const char *written = kt_test_written(&invented.scene);
        const kt_scene *again = kt_test_scene(written);
        const char *difference = kt_scene_difference(&invented.scene, again);
        const bool same = difference[0] == '\0' && strcmp(written, kt_test_written(again)) == 0;
        if (!same)
            kt_note("scene %d: %s\n%s", i, difference, written);
        right += same;
    }
    kt_check_equal_int("scenes that come back to the bit", right, count);
}

KT_TEST(scenes_of_bodies_come_back_to_the_bit) { check_round_trips(false, 400); }
KT_TEST(scenes_with_loops_and_effects_come_back_to_the_bit) { check_round_trips(true, 400); }

/* ---- text -------------------------------------------------------------------------------------------------------- */

static size_t encode(char *to, unsigned c) {
    if (c < 0x80U) {
        to[0] = (char)c;
        return 1;
    }
    size_t length = c < 0x800U ? 2 : c < 0x10000U ? 3 : 4;
    for (size_t i = length - 1; i > 0; i--, c >>= 6)
        to[i] = (char)(0x80U | (c & 0x3FU));
    to[0] = (char)((0xF00U >> length & 0xF0U) | c);
    return length;
}

static unsigned any_character(kt_random *random) {
    static const unsigned special[] = {' ',    '\t',   '\n', '\r', '"',  '\'',   '\\',   ':',     '#',      '-',
                                       '?',    '%',    '@',  '`',  '&',  '*',    '!',    '|',     '>',      '{',
                                       '[',    ',',    '~',  0x7F, 0x85, 0xA0,   0x2028, 0x2029,  0xFEFF,   0xFFFD,
                                       0xFFFE, 0xFFFF, 0x1F, 0x01, 0x9F, 0xD7FF, 0xE000, 0x10000, 0x10FFFF, '0'};
    int kind = kt_random_int(random, 0, 3);
    if (kind == 0)
        return special[kt_random_int(random, 0, (int)(sizeof special / sizeof *special) - 1)];
    if (kind == 1)
        return (unsigned)kt_random_int(random, 1, 0x7F);
    if (kind == 2)
        return (unsigned)kt_random_int(random, 'a', 'z');
    unsigned c = (unsigned)kt_random_int(random, 0x80, 0x10FFFF);
    return c >= 0xD800U && c <= 0xDFFFU ? 'x' : c;
}

static bool comes_back(const char *name) {
    kt_scene scene = kt_scene_default(), again;
    scene.description.name = name;
    const char *written = kt_test_written(&scene);
    bool same = false;
    if (kt_scene_parse(NULL, written, strlen(written), &again, NULL, NULL, NULL) == KT_OK) {
        same = again.description.name != NULL && strcmp(again.description.name, name) == 0;
        kt_scene_free(&again);
    }
    if (!same)
        kt_note("lost: %s", written);
    return same;
}

KT_TEST(any_text_comes_back) {
    static const char *const words[] = {
        "",           " ",    "a ",   " a",    "1",    "1.5",  "1e3",  "-1",  ".inf", "~",     "null", "yes", "true",
        "012",        "0x1F", "1:30", "1_000", "a: b", "a:",   "a #b", "- a", "? a",  "[a",    "a]",   "{",   "'a'",
        "\"a\"",      "a'b",  "%a",   "@a",    "*a",   "&a",   "!a",   "|",   ">",    "---",   "...",  "<<",  "=",
        "2026-01-02", "a\nb", "a\n",  "\n",    "\r\n", "a\\n", "=1",   "+.e", "-",    "30 deg"};
    int lost = 0;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        lost += !comes_back(words[i]);
    kt_random random = kt_random_of_test();
    for (int i = 0; i < 5000; i++) {
        char name[4 * 12 + 1];
        size_t length = 0;
        for (int left = kt_random_int(&random, 0, 12); left > 0; left--)
            length += encode(name + length, any_character(&random));
        name[length] = '\0';
        lost += !comes_back(name);
    }
    kt_check_equal_int("texts that do not come back", lost, 0);
}

/* ---- what cannot be written -------------------------------------------------------------------------------------- */

/* NOLINTNEXTLINE(readability-function-size): a list */
KT_TEST(nothing_is_written_of_a_scene_that_is_wrong) {
    kt_scene scene = kt_scene_default();
    kt_body body = kt_body_default();
    body.name = "a";
    body.mass = (double)NAN;
    scene.description.bodies = &body;
    scene.description.body_count = 1;
    kt_check_unwritable("a mass that is no number", &scene, KT_ERROR_MODEL, "mass is nan");
    body.mass = 1.0;
    body.parent = "b";
    kt_check_unwritable("a parent that does not exist", &scene, KT_ERROR_MODEL, "parent 'b' does not exist");
    body.parent = NULL;
    scene.description.name = "\xFF";
    kt_check_unwritable("a text that is not UTF-8", &scene, KT_ERROR_MODEL, "not UTF-8");
    scene.description.name = NULL;

    scene.run.integrator = "leapfrog";
    kt_check_unwritable("an unknown method", &scene, KT_ERROR_ARGUMENT, "leapfrog");
    scene.run.integrator = "rk4";
    kt_check_unwritable("a method that needs a step", &scene, KT_ERROR_ARGUMENT, "fixed step");
    scene.run = kt_run_default();
    scene.run.duration = (double)INFINITY;
    kt_check_unwritable("an endless run", &scene, KT_ERROR_ARGUMENT, "finite");
    scene.run = kt_run_default();
    scene.run.integrator = "";
    kt_check_unwritable("an empty name", &scene, KT_ERROR_ARGUMENT, "there is no method ''");
    scene.run = kt_run_default();
    scene.run.interval = -1.0;
    kt_check_unwritable("a negative interval", &scene, KT_ERROR_ARGUMENT, "not negative");
    scene.run = kt_run_default();
    scene.run.step = (double)NAN;
    kt_check_unwritable("a step that is no number", &scene, KT_ERROR_ARGUMENT, "finite");
    scene.run = kt_run_default();
    scene.run.relative = scene.run.absolute = 0.0;
    kt_check_unwritable("no tolerance", &scene, KT_ERROR_ARGUMENT, "above 0");
    scene.run.relative = -1.0;
    kt_check_unwritable("a negative relative tolerance", &scene, KT_ERROR_ARGUMENT, "not negative");
    scene.run.relative = 1.0;
    scene.run.absolute = -1.0;
    kt_check_unwritable("a negative absolute tolerance", &scene, KT_ERROR_ARGUMENT, "not negative");
    scene.run.relative = scene.run.absolute = DBL_MAX;
    kt_check_unwritable("tolerances without a sum", &scene, KT_ERROR_ARGUMENT, "finite");
    scene.run = kt_run_default();
#define ADD_BIT(id, bit, name) +(bit)
    scene.run.record = 1U KT_RECORD_LIST(ADD_BIT); /* the lowest bit that none has */
#undef ADD_BIT
    kt_check_unwritable("a record that does not exist", &scene, KT_ERROR_ARGUMENT, "record");
    scene.run = kt_run_default();
    const kt_marker_pair pair = {"a", "tip"};
    scene.run.markers = &pair;
    scene.run.marker_count = 1;
    kt_check_unwritable("a marker that does not exist", &scene, KT_ERROR_ARGUMENT, "has no marker 'tip'");
    const kt_marker_pair stranger = {"b", "tip"}, nobody = {NULL, "tip"}, nothing = {"a", NULL};
    scene.run.markers = &stranger;
    kt_check_unwritable("a marker of nobody", &scene, KT_ERROR_ARGUMENT, "body 'b' does not exist");
    scene.run.markers = &nobody;
    kt_check_unwritable("a marker without a body", &scene, KT_ERROR_ARGUMENT, "no body or no marker");
    scene.run.markers = &nothing;
    kt_check_unwritable("a body without a marker", &scene, KT_ERROR_ARGUMENT, "no body or no marker");
    scene.run.marker_count = -1;
    kt_check_unwritable("markers fewer than none", &scene, KT_ERROR_ARGUMENT, "is not the length of the array");
    scene.run.marker_count = 1;
    scene.run.markers = NULL;
    kt_check_unwritable("markers that are NULL", &scene, KT_ERROR_ARGUMENT, "is not the length of the array");
    scene.run = kt_run_default();
    scene.run.metric = (kt_metric)9;
    kt_check_unwritable("a metric that does not exist", &scene, KT_ERROR_ARGUMENT, "has no meaning");
    scene.run.metric = (kt_metric)-1;
    kt_check_unwritable("a metric below all", &scene, KT_ERROR_ARGUMENT, "has no meaning");
}

static int push_nothing(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches,
                        kt_effect_balance *balance) {
    (void)user;
    (void)t;
    (void)ends;
    (void)wrenches;
    (void)balance;
    return 0;
}

KT_TEST(effect_of_a_program_is_not_written) {
    kt_scene scene = kt_scene_default();
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, NULL);
    effect.wrench = push_nothing;
    effect.end_count = 1;
    scene.description.effects = &effect;
    scene.description.effect_count = 1;
    kt_check_unwritable("an effect that calls back", &scene, KT_ERROR_UNSUPPORTED,
                        "effects[0] calls back into a program; no scene file can hold it");
}

static int exert_nothing(void *user, const double *u, double *force, double *rates) {
    (void)user, (void)u, (void)force, (void)rates;
    return 0;
}

KT_TEST(law_of_a_program_is_not_written) {
    kt_scene scene = kt_scene_default();
    kt_auxiliary_state state = kt_auxiliary_state_default();
    kt_body body = kt_body_of("a", NULL, KT_JOINT_REVOLUTE, 0.0);
    scene.description.bodies = &body;
    scene.description.body_count = 1;
    kt_effect effect = kt_effect_of(KT_EFFECT_EXPRESSION, "a");
    effect.law = exert_nothing;
    scene.description.effects = &effect;
    scene.description.effect_count = 1;
    kt_check_unwritable("a law", &scene, KT_ERROR_UNSUPPORTED,
                        "effects[0] calls back into a program; no scene file can hold it");
    const char *const names[] = {"current"};
    effect.states = names;
    effect.state_count = 1;
    state.name = "current";
    scene.description.states = &state;
    scene.description.state_count = 1;
    kt_check_unwritable("a rate", &scene, KT_ERROR_UNSUPPORTED,
                        "the rate of state 'current' is a program's; no scene file can hold it");
}

KT_TEST(full_disk_is_an_error) {
    const kt_scene scene = kt_scene_default();
    kt_error error;
    FILE *full = fopen("/dev/full", "w");
    kt_need(kt_check_true("/dev/full", full != NULL));
    kt_check_equal_int("status", kt_scene_write(&scene, full, &error), KT_ERROR_FILE);
    (void)fclose(full);
    FILE *closed = fopen("/dev/null", "r");
    kt_need(kt_check_true("/dev/null", closed != NULL));
    kt_check_equal_int("a stream for reading", kt_scene_write(&scene, closed, &error), KT_ERROR_FILE);
    kt_check_text("message", error.message, "the stream cannot be written to; is the disk full?");
    (void)fclose(closed);
    kt_check_equal_int("no stream", kt_scene_write(&scene, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no scene", kt_scene_write(NULL, stdout, &error), KT_ERROR_ARGUMENT);
}
