/* Parameters, expressions and settings: a scene with them against the scene with the numbers written out. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "difference.h"

static const char *const with_parameters =
    "kinetree: 1\n"
    "parameters: {area: =0.01*L^2, L: 1.5, rho: 7800, tilt: 30 deg, half: \"=tilt/2\", k: \"=max(100, 2*rho)\"}\n"
    "gravity: [0, =-g, 0]\n"
    "bodies:\n"
    "  - name: arm\n"
    "    joint: {type: revolute, position: =tilt, velocity: =half}\n"
    "    mass: =rho*area*L\n"
    "    com: [=L/2, 0, 0]\n"
    "    inertia: [0, =rho*area*L^3/12, =rho*area*L^3/12]\n"
    "    markers: {tip: [=L, 0, 0]}\n"
    "  - {name: ball, parent: arm, joint: {type: cylindrical, at: [=L, 0, 0], position: [=-tilt, =L/10]}, mass: 1}\n"
    "loops: [{name: rail, type: coupling, coefficients: {arm: \"=hypot(3, 4)\"}, offset: =5*tilt}]\n"
    "effects:\n"
    "  - {type: spring, between: [arm.tip, world], stiffness: =k, length: =2*L}\n"
    "  - {type: motor, joint: arm, torque: {sine: {amplitude: =k/100, frequency: =1/L}}}\n"
    "simulate: {duration: =L, tolerance: =1e-3^2}\n";

static const char *const with_numbers =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - name: arm\n"
    "    joint: {type: revolute, position: 30 deg, velocity: 15 deg}\n"
    "    mass: 263.25\n"
    "    com: [0.75, 0, 0]\n"
    "    inertia: [0, 49.359375, 49.359375]\n"
    "    markers: {tip: [1.5, 0, 0]}\n"
    "  - {name: ball, parent: arm, joint: {type: cylindrical, at: [1.5, 0, 0], position: [-30 deg, 0.15]}, mass: 1}\n"
    "loops: [{name: rail, type: coupling, coefficients: {arm: 5}, offset: 150 deg}]\n"
    "effects:\n"
    "  - {type: spring, between: [arm.tip, world], stiffness: 15600, length: 3}\n"
    "  - {type: motor, joint: arm, torque: {sine: {amplitude: 156, frequency: 0.66666666666666663}}}\n"
    "simulate: {duration: 1.5, tolerance: 1e-6}\n";

static kt_collected faults;

static kt_status parse_with(const char *text, const char *const *settings, int count, kt_scene *scene) {
    const kt_scene_options options = {.settings = settings, .setting_count = count};
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    return kt_scene_parse_with("x", text, strlen(text), &options, scene, kt_collect, &faults, &error);
}

/* The numbers of both differ by the rounding of a few operations. */
KT_TEST(a_scene_with_parameters_is_that_with_their_numbers) {
    char text[2048];
    (void)snprintf(text, sizeof text, "%s", with_parameters);
    char *end = strstr(text, "tilt: 30 deg");
    memmove(end + strlen("g: 9.81, "), end, strlen(end) + 1);
    memcpy(end, "g: 9.81, ", strlen("g: 9.81, "));
    const kt_scene *a = kt_test_scene(text), *b = kt_test_scene(with_numbers);
    const kt_body *arm = a->description.bodies, *same = b->description.bodies;
    kt_check_near("position", arm->joint.position[0], same->joint.position[0], 0.0);
    kt_check_near("velocity", arm->joint.velocity[0], same->joint.velocity[0], DBL_EPSILON);
    kt_check_near("mass", arm->mass, same->mass, 4.0 * DBL_EPSILON * 263.25);
    kt_check_near("inertia", arm->inertia.yy, same->inertia.yy, 8.0 * DBL_EPSILON * 49.359375);
    kt_check_near("com", arm->com.x, same->com.x, 0.0);
    kt_check_near("angle of a list", arm[1].joint.position[0], same[1].joint.position[0], 0.0);
    kt_check_near("length of a list", arm[1].joint.position[1], same[1].joint.position[1], 0.0);
    kt_check_near("gravity", a->description.gravity.y, b->description.gravity.y, 0.0);
    kt_check_near("coefficient", a->description.loops[0].terms[0].coefficient, 5.0, 0.0);
    kt_check_near("offset", a->description.loops[0].offset, b->description.loops[0].offset, 4.0 * DBL_EPSILON);
    kt_check_near("stiffness", a->description.effects[0].stiffness, 15600.0, 0.0);
    kt_check_near("length", a->description.effects[0].length, 3.0, 0.0);
    kt_check_near("amplitude", a->description.effects[1].torque.amplitude, 156.0, 0.0);
    kt_check_near("frequency", a->description.effects[1].torque.frequency, 1.0 / 1.5, DBL_EPSILON);
    kt_check_near("duration", a->run.duration, 1.5, 0.0);
    kt_check_near("tolerance", a->run.relative, 1e-6, DBL_EPSILON * 1e-6);
    kt_check_equal_int("parameters", a->parameter_count, 7);
    kt_check_text("the first", a->parameters[0].name, "area");
    kt_check_near("its value", a->parameters[0].value, 0.0225, DBL_EPSILON * 0.0225);
    kt_check_equal_int("notes", a->note_count, 0);
}

KT_TEST(a_parameter_that_nothing_uses_is_noted) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nparameters: {L: 1, M: =N, N: 2}\n"
                                    "bodies:\n  - {name: a, joint: {type: revolute}, mass: =L, inertia: [1, 1, 1]}\n");
    kt_check_equal_int("notes", scene->note_count, 2);
    if (scene->note_count == 2) {
        kt_check_text("where", scene->notes[0].where, "test.yaml:2:20");
        kt_check_contains("what", scene->notes[0].what, "nothing uses the parameter 'M'; write =M");
        kt_check_text("where", scene->notes[1].where, "test.yaml:2:27");
        kt_check_contains("what", scene->notes[1].what, "nothing uses the parameter 'N' but others that nothing uses");
    }
}

/* The scene keeps its meaning: the formula has the distance of the ends, and the number has the parameter. */
KT_TEST(a_parameter_that_a_variable_of_a_formula_hides_is_noted) {
    static const char text[] = "kinetree: 1\nparameters: {length: 4, speed: 2}\n"
                               "bodies:\n  - {name: a, joint: {type: prismatic}, mass: %s, inertia: [1, 1, 1]}\n"
                               "effects:\n  - {type: expression, between: [a, world], force: \"%s\"}\n";
    static const struct {
        const char *mass, *force, *where, *what;
    } cases[] = {
        {"=length*speed", "-length", "test.yaml:6:52",
         "'length' is a variable of this formula, which hides the "
         "parameter 'length'; give the parameter another name"},
        {"=speed", "-2*length", "test.yaml:6:52", "and nothing else uses the parameter; give the parameter another"},
        {"=length", "-speed", "test.yaml:6:52", "'speed' is a variable of this formula"},
        {"=length*speed", "-1", NULL, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        kt_scene *scene = kt_test_scene_of(text, cases[i].mass, cases[i].force);
        kt_check_equal_int("notes", scene->note_count, cases[i].where != NULL);
        if (scene->note_count == 1 && cases[i].where != NULL) {
            kt_check_text("where", scene->notes[0].where, cases[i].where);
            kt_check_contains("what", scene->notes[0].what, cases[i].what);
        }
    }
}

/* An expression that nothing uses is in no formula, so that nothing is hidden there. */
KT_TEST(an_expression_that_nothing_uses_hides_no_parameter) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nparameters: {length: 4}\nexpressions: {twice: \"2*length\"}\n"
                                    "bodies:\n  - {name: a, joint: {type: prismatic}, mass: =length, "
                                    "inertia: [1, 1, 1]}\n");
    kt_check_equal_int("notes", scene->note_count, 1);
    if (scene->note_count == 1)
        kt_check_contains("what", scene->notes[0].what, "nothing uses the expression 'twice'");
}

/* A table that no formula calls is noted, also if an expression without a use calls it. */
KT_TEST(a_table_that_no_formula_calls_is_noted) {
    static const struct {
        const char *formula;
        int notes;
    } cases[] = {{"lift(position.a)", 1},
                 {"2*lift (position.a) + 1", 1},
                 {"half", 0},
                 {"position.a", 2},
                 {"lifted(position.a)", 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        kt_scene *scene = kt_test_scene_of(
            "kinetree: 1\ntables:\n  lift: {rows: [[0, 0], [1, 2]]}\n  lifted: {rows: [[0, 0], [1, 2]]}\n"
            "expressions: {half: 0.5*lift(position.a) + lifted(1), none: lift(1)}\n"
            "bodies:\n  - {name: a, joint: {type: prismatic}, mass: 1}\n"
            "effects:\n  - {type: expression, joint: a, force: \"%s\"}\n",
            cases[i].formula);
        int tables = 0;
        for (int k = 0; k < scene->note_count; k++)
            tables += strstr(scene->notes[k].what, "no formula calls the table 'lift") != NULL;
        kt_note("%s", cases[i].formula);
        kt_check_equal_int("notes on tables", tables, cases[i].notes);
    }
}

/* An event sets an auxiliary state of the parameter's name, which the formula reads: nothing is hidden. */
KT_TEST(a_parameter_that_an_event_sets_is_not_hidden) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nparameters: {k: 4}\n"
                                    "bodies:\n  - {name: a, joint: {type: prismatic}, mass: 1, inertia: [1, 1, 1]}\n"
                                    "effects:\n  - {type: expression, joint: a, force: \"-k*position.a\"}\n"
                                    "events:\n  - {name: late, when: t - 1, then: {set: {k: 2}}}\n");
    kt_check_equal_int("notes", scene->note_count, 0);
}

/* K is used by L, which a number uses. Only an expression that nothing uses contains M. */
KT_TEST(uses_are_followed_through_parameters_and_not_from_unused_expressions) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nparameters: {L: =K, K: 1, M: 2}\nexpressions: {lift: \"M*t\"}\n"
                                    "bodies:\n  - {name: a, joint: {type: revolute}, mass: =L, inertia: [1, 1, 1]}\n");
    kt_check_equal_int("notes", scene->note_count, 2);
    for (int k = 0; k < scene->parameter_count; k++)
        kt_check_true(scene->parameters[k].name, scene->parameters[k].is_used == (scene->parameters[k].name[0] != 'M'));
}

KT_TEST(many_circles_are_each_told_once) {
    kt_scene scene;
    char text[8192], *to = text;
    to += sprintf(to, "kinetree: 1\nparameters:\n");
    for (int k = 0; k < 40; k++)
        to += sprintf(to, "  a%d: =b%d\n  b%d: =a%d + c%d\n  c%d: =a%d\n  d%d: =a%d\n", k, k, k, k, k, k, k, k, k);
    kt_check_equal_int("status", parse_with(text, NULL, 0, &scene), KT_ERROR_SCENE);
    kt_check_equal_int("faults", faults.count, 40);
    kt_check_contains("first", faults.first.message, "the parameter depends on itself: a0 -> b0 -> a0");
}

/* ---- settings ---------------------------------------------------------------------------------------------------- */

static const char *const arm =
    "kinetree: 1\n"
    "parameters: {L: 1, m: =2*L}\n"
    "bodies:\n"
    "  - {name: arm, joint: {type: revolute}, mass: =m, com: [=L, 0, 0], inertia: [0, 1, 1]}\n"
    "effects: [{type: joint_damper, joint: arm, damping: 1}]\n";

KT_TEST(settings_replace_values_and_add_keys) {
    static const char *const settings[] = {"L=3",
                                           "bodies.arm.com[1]=0.5",
                                           "effects[0].damping==L/2",
                                           "bodies.arm.joint.position=90 deg",
                                           "simulate.duration=7",
                                           "gravity=[0, -1, 0]",
                                           "bodies.arm.name=leg",
                                           "effects[0].joint=leg"};
    kt_scene *scene = kt_test_scene_place();
    if (!kt_check_equal_int("status", parse_with(arm, settings, 8, scene), KT_OK)) {
        kt_note("%s", faults.text);
        return;
    }
    const kt_description *d = &scene->description;
    kt_check_text("name", d->bodies[0].name, "leg");
    kt_check_near("mass", d->bodies[0].mass, 6.0, 0.0);
    kt_check_near("com x", d->bodies[0].com.x, 3.0, 0.0);
    kt_check_near("com y", d->bodies[0].com.y, 0.5, 0.0);
    kt_check_near("position", d->bodies[0].joint.position[0], 1.5707963267948966, 0.0);
    kt_check_near("damping", d->effects[0].damping, 1.5, 0.0);
    kt_check_near("gravity", d->gravity.y, -1.0, 0.0);
    kt_check_near("duration", scene->run.duration, 7.0, 0.0);
    kt_check_equal_int("kept", scene->setting_count, 8);
    kt_check_text("the third", scene->settings[2], settings[2]);
    kt_check_true("L is set", scene->parameters[0].is_set);
    kt_check_true("m is not", !scene->parameters[1].is_set);
}

KT_TEST(faults_of_settings_are_located_in_them) {
    static const struct {
        const char *setting, *says;
    } cases[] = {
        {"K=1", "the scene has no parameter 'K'"},
        {"LL=1", "did you mean 'L'?"},
        {"L", "a setting is PATH=VALUE"},
        {"L=", "a value is missing"},
        {"=1", "a word of the path is missing"},
        {"bodies.amr.mass=1", "did you mean 'arm'?"},
        {"bodies.arm.mas=1", "unknown key 'mas'; did you mean 'mass'?"},
        {"bodies.arm.mass=heavy", "expected a number, found 'heavy'"},
        {"bodies.arm.mass=[1", "missing"},
        {"bodies.arm.com[3]=1", "the list has 3 items"},
        {"effects[1].damping=1", "the list has one item, [0]"},
        {"bodies.arm.com[x]=1", "write [k], k from 0"},
        {"bodies[0][0]=1", "this is no list"},
        {"bodies.arm.mass.x=1", "the file has a single value here"},
        {"bodies..mass=1", "a word of the path is missing"},
        {"m==m", "the parameter depends on itself"},
        {"simulate.step=-1", "greater than 0"},
        {"kinetree=2", "there is no version '2'"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const kt_scene rest = kt_scene_default();
        kt_scene scene = rest;
        const kt_status status = parse_with(arm, &cases[k].setting, 1, &scene);
        kt_check_equal_int(cases[k].setting, status, KT_ERROR_SCENE);
        kt_check_contains("message", faults.first.message, cases[k].says);
        kt_check_text("where", faults.first.where, cases[k].setting);
        kt_check_true("scene is untouched", kt_same_bytes(&scene, &rest, sizeof scene));
    }
}

KT_TEST(options_are_checked) {
    kt_scene scene = kt_scene_default();
    kt_error error = {0};
    const char *const nothing[] = {NULL};
    const double one = 1.0;
    const kt_scene_options wrong[] = {
        {.setting_count = -1},  {.setting_count = 1},  {.settings = nothing, .setting_count = 1},
        {.variable_count = -1}, {.variable_count = 1}, {.variables = nothing, .values = &one, .variable_count = 1}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
        kt_check_equal_int("status", kt_scene_parse_with("x", arm, strlen(arm), &wrong[k], &scene, NULL, NULL, &error),
                           KT_ERROR_ARGUMENT);
    kt_check_equal_int("none", kt_scene_parse_with("x", arm, strlen(arm), NULL, &scene, NULL, NULL, &error), KT_OK);
    kt_scene_free(&scene);
}
