/* Every key of scene-files.md, and its result in the scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "difference.h"
#include "expect.h"

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static const char contract[] = "kinetree: 1                      # required: version of this format\n"
                               "name: four-bar linkage           # optional, free text\n"
                               "gravity: [0, -9.81, 0]\n"
                               "\n"
                               "bodies:\n"
                               "  - name: crank\n"
                               "    parent: world\n"
                               "    joint:\n"
                               "      type: revolute\n"
                               "      axis: -y\n"
                               "      at: [0.1, 0.2, 0.3]\n"
                               "      rotation: {rpy: [0, 0, 90 deg]}\n"
                               "      position: 60 deg\n"
                               "      velocity: 0.5\n"
                               "    mass: 1.2\n"
                               "    com: [0.5, 0, 0]\n"
                               "    inertia: [0.1, 0.2, 0.3]\n"
                               "    shape: {type: rod, to: [1, 0, 0]}\n"
                               "    markers:\n"
                               "      tip: [1, 0, 0]\n"
                               "      mid: [0.5, 0, 0]\n"
                               "  - {name: coupler, parent: crank}\n"
                               "simulate:\n"
                               "  duration: 2.5\n"
                               "  integrator: rk4\n"
                               "  step: 1e-3\n"
                               "  formulation: tree\n"
                               "  reduction: qr\n"
                               "  metric: identity\n"
                               "  plan: spatial\n"
                               "output:\n"
                               "  interval: 0.01\n"
                               "  record: [position, reaction]\n"
                               "  markers: [crank.tip, crank.mid]\n";

static void check_crank(const kt_body *crank) {
    kt_check_text("name", crank->name, "crank");
    kt_check_true("the world is NULL", crank->parent == NULL);
    kt_check_equal_int("type", crank->joint.type, KT_JOINT_REVOLUTE);
    CHECK_VECTOR("axis", crank->joint.axis, 0, -1, 0);
    CHECK_VECTOR("at", crank->joint.at, 0.1, 0.2, 0.3);
    kt_check_equal_int("rotation", crank->joint.rotation.type, KT_ROTATION_RPY);
    CHECK_NUMBERS("rpy", crank->joint.rotation.value, 0, 0, PI / 2);
    kt_check_near("position", crank->joint.position[0], PI / 3, 3e-16);
    CHECK_NUMBERS("velocity", crank->joint.velocity, 0.5, 0, 0, 0, 0, 0);
    CHECK_NUMBERS("mass", &crank->mass, 1.2);
    CHECK_VECTOR("com", crank->com, 0.5, 0, 0);
    const double inertia[] = {crank->inertia.xx, crank->inertia.yy, crank->inertia.zz,
                              crank->inertia.xy, crank->inertia.xz, crank->inertia.yz};
    CHECK_NUMBERS("inertia", inertia, 0.1, 0.2, 0.3, 0, 0, 0);
    kt_check_true("com and inertia are its own", !crank->com_of_shape && !crank->inertia_of_shape);
    kt_check_equal_int("shape", crank->shape.type, KT_SHAPE_ROD);
    CHECK_VECTOR("from", crank->shape.from, 0, 0, 0);
    CHECK_VECTOR("to", crank->shape.to, 1, 0, 0);
    CHECK_NUMBERS("radius", &crank->shape.radius, 0);
    kt_check_equal_int("markers", crank->marker_count, 2);
    kt_check_text("marker", crank->markers[1].name, "mid");
    CHECK_VECTOR("marker", crank->markers[1].at, 0.5, 0, 0);
}

static void check_run(const kt_run *run) {
    CHECK_NUMBERS("duration", &run->duration, 2.5);
    kt_check_text("integrator", run->integrator, "rk4");
    CHECK_NUMBERS("step", &run->step, 1e-3);
    CHECK_NUMBERS("interval", &run->interval, 0.01);
    kt_check_equal_int("record", run->record, KT_RECORD_POSITION | KT_RECORD_REACTION);
    kt_check_equal_int("plan", run->plan, KT_PLAN_SPATIAL);
    kt_check_equal_int("markers", run->marker_count, 2);
    kt_check_text("body", run->markers[1].body, "crank");
    kt_check_text("marker", run->markers[1].marker, "mid");
}

KT_TEST(scene_of_the_contract_is_read) {
    kt_scene *scene = kt_test_scene(contract);
    const kt_description *d = &scene->description;
    kt_check_text("name", d->name, "four-bar linkage");
    CHECK_VECTOR("gravity", d->gravity, 0, -9.81, 0);
    kt_check_equal_int("bodies", d->body_count, 2);
    kt_check_equal_int("loops, effects and held joints", d->loop_count + d->effect_count + d->hold_count, 0);

    kt_check_text("parent", d->bodies[1].parent, "crank");
    check_crank(&d->bodies[0]);
    check_run(&scene->run);
    kt_scene_free(scene);
    kt_check_true("a scene that was freed is empty", scene->memory == NULL && scene->description.body_count == 0);
    kt_scene_free(NULL);
}

KT_TEST(what_is_not_there_is_the_default) {
    const kt_scene rest = kt_scene_default();
    const kt_body body = kt_body_default();
    kt_scene *scene = kt_test_scene("kinetree: 1\nbodies: [{name: a}]\n");
    kt_check_true("no name", scene->description.name == NULL);
    CHECK_VECTOR("no gravity", scene->description.gravity, 0, 0, 0);
    kt_check_text("the run is kt_run_default", kt_run_difference(&scene->run, &rest.run), "");
    kt_check_true("no method is named", scene->run.integrator == NULL);
    const kt_body *a = &scene->description.bodies[0];
    kt_check_true("no parent", a->parent == NULL);
    kt_check_equal_int("joint", a->joint.type, KT_JOINT_FIXED);
    CHECK_VECTOR("axis", a->joint.axis, body.joint.axis.x, body.joint.axis.y, body.joint.axis.z);
    CHECK_NUMBERS("mass", &a->mass, 0.0);
    kt_check_equal_int("shape", a->shape.type, KT_SHAPE_NONE);
    kt_check_true("nothing of a shape's", !a->com_of_shape && !a->inertia_of_shape);
    kt_check_equal_int("markers", a->marker_count, 0);
    scene = kt_test_scene("kinetree: 1\n");
    kt_check_equal_int("bodies of a scene without any", scene->description.body_count, 0);
}

/* Mark at the beginning, lines of Windows, no line end at the end, flow style throughout: all the same to YAML. */
KT_TEST(one_scene_reads_alike_in_every_spelling) {
    static const char *const texts[] = {
        "kinetree: 1\nname: a\nbodies:\n- name: b\n  mass: 2\n",
        "\xEF\xBB\xBFkinetree: 1\nname: a\nbodies:\n- name: b\n  mass: 2\n",
        "kinetree: 1\r\nname: a\r\nbodies:\r\n  - name: b\r\n    mass: 2\r\n",
        "{kinetree: 1, name: a, bodies: [{name: b, mass: 2}]}",
        "---\nbodies:\n  - mass: 2.0\n    name: \"b\"\nname: 'a'\nkinetree: 1\n...\n",
        "# a comment\n\"kinetree\": 1\n? name\n: a\nbodies: [{mass: 0.2e1, name: b}]",
        "{\"kinetree\": 1, \"name\": \"a\", \"bodies\": [{\"name\": \"b\", \"mass\": 2}]}\n",
        "kinetree: 1\nname: >-\n  a\nbodies:\n    -   name:   b\n        mass: +2.\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        kt_scene *scene = kt_test_scene(texts[i]);
        const char *written = kt_test_written(scene);
        kt_check_text(texts[i], written, "kinetree: 1\nname: a\n\nbodies:\n  - name: b\n    mass: 2\n");
    }
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

KT_TEST(shapes_take_their_keys) {
    static const char text[] =
        "kinetree: 1\n"
        "bodies:\n"
        "  - {name: a, shape: {type: point, at: [1, 2, 3]}}\n"
        "  - {name: b, shape: {type: rod, from: [1, 0, 0], to: [2, 0, 0], radius: 0.1}}\n"
        "  - {name: c, shape: {type: box, size: [1, 2, 3]}}\n"
        "  - {name: d, shape: {type: sphere, radius: 2, at: [0, 0, 1], rotation: {vector: [0, 0, 1]}}}\n"
        "  - {name: e, shape: {type: cylinder, radius: 1, length: 2, axis: x, at: [3, 0, 0], rotation: {rpy: [1, 0, "
        "0]}}}\n"
        "  - {name: f, shape: {type: cylinder, radius: 1, length: 2}}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_body *b = scene->description.bodies;
    kt_check_equal_int("point", b[0].shape.type, KT_SHAPE_POINT);
    CHECK_VECTOR("at", b[0].shape.at, 1, 2, 3);
    kt_check_equal_int("rod", b[1].shape.type, KT_SHAPE_ROD);
    CHECK_VECTOR("from", b[1].shape.from, 1, 0, 0);
    CHECK_VECTOR("to", b[1].shape.to, 2, 0, 0);
    CHECK_NUMBERS("radius", &b[1].shape.radius, 0.1);
    kt_check_equal_int("box", b[2].shape.type, KT_SHAPE_BOX);
    CHECK_VECTOR("size", b[2].shape.size, 1, 2, 3);
    kt_check_equal_int("sphere", b[3].shape.type, KT_SHAPE_SPHERE);
    CHECK_NUMBERS("radius", &b[3].shape.radius, 2);
    CHECK_VECTOR("at", b[3].shape.at, 0, 0, 1);
    kt_check_equal_int("rotation", b[3].shape.rotation.type, KT_ROTATION_VECTOR);
    kt_check_equal_int("cylinder", b[4].shape.type, KT_SHAPE_CYLINDER);
    CHECK_VECTOR("axis", b[4].shape.axis, 1, 0, 0);
    CHECK_NUMBERS("length", &b[4].shape.length, 2);
    CHECK_VECTOR("at", b[4].shape.at, 3, 0, 0);
    kt_check_equal_int("rotation", b[4].shape.rotation.type, KT_ROTATION_RPY);
    CHECK_VECTOR("axis by default", b[5].shape.axis, 0, 0, 1);
}

KT_TEST(com_and_inertia_are_the_shapes_where_they_are_missing) {
    static const char *const shape = "shape: {type: sphere, radius: 1}";
    static const struct {
        const char *keys;
        bool has_shape, com_of_shape, inertia_of_shape;
    } table[] = {
        {"mass: 1", true, true, true},
        {"mass: 0", true, true, true},
        {"mass: 1, com: [1, 0, 0]", true, false, true},
        {"mass: 1, inertia: [1, 1, 1]", true, true, false},
        {"mass: 1, com: [0, 0, 0], inertia: [0, 0, 0]", true, false, false},
        {"inertia: [1, 1, 1]", true, false, false},
        {"com: [1, 0, 0]", true, false, false},
        {"mass: 1", false, false, false},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = kt_test_scene_of("kinetree: 1\nbodies:\n  - {name: a, %s%s%s}\n", table[i].keys,
                                           table[i].has_shape ? ", " : "", table[i].has_shape ? shape : "");
        kt_check_equal_int(table[i].keys, scene->description.bodies[0].com_of_shape, table[i].com_of_shape);
        kt_check_equal_int(table[i].keys, scene->description.bodies[0].inertia_of_shape, table[i].inertia_of_shape);
    }
}

KT_TEST(inertia_has_three_or_six_numbers) {
    kt_scene *scene =
        kt_test_scene("kinetree: 1\nbodies:\n  - {name: a, mass: 1, inertia: [4, 5, 6, 0.1, 0.2, 0.3]}\n");
    const kt_sym3 i = scene->description.bodies[0].inertia;
    const double seen[] = {i.xx, i.yy, i.zz, i.xy, i.xz, i.yz};
    CHECK_NUMBERS("Ixx Iyy Izz Ixy Ixz Iyz", seen, 4, 5, 6, 0.1, 0.2, 0.3);
}

KT_TEST(bodies_stand_in_any_order) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nbodies: [{name: b, parent: a}, {name: a, parent: c}, {name: c}]\n");
    kt_check_text("first", scene->description.bodies[0].name, "b");
    kt_check_text("its parent", scene->description.bodies[0].parent, "a");
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

KT_TEST(every_method_is_known_by_its_name) {
    kt_check_above("methods", kt_method_count(), 8.0);
    for (int i = 0; i < kt_method_count(); i++) {
        kt_scene *scene =
            kt_test_scene_of("kinetree: 1\nsimulate: {integrator: %s, step: 0.25}\n", kt_method_at(i)->name);
        kt_check_text("integrator", scene->run.integrator, kt_method_at(i)->name);
        CHECK_NUMBERS("step", &scene->run.step, 0.25);
    }
}

KT_TEST(the_two_step_method_has_a_radius_at_infinity) {
    kt_method storage;
    kt_scene *scene = kt_test_scene("kinetree: 1\nsimulate: {integrator: two-step, step: 0.1, rho: 0.25}\n");
    CHECK_NUMBERS("rho", &scene->run.rho, 0.25);
    CHECK_NUMBERS("of its method", &kt_run_method(&scene->run, NULL, &storage)->rho, 0.25);
    scene = kt_test_scene("kinetree: 1\nsimulate: {integrator: bdf2, step: 0.1}\n");
    kt_check_true("bdf2 has its own", kt_run_method(&scene->run, NULL, &storage) == kt_method_find("bdf2"));
}

KT_TEST(tolerances_are_one_number_or_two) {
    kt_scene *scene = kt_test_scene("kinetree: 1\nsimulate: {tolerance: 1e-6}\n");
    CHECK_NUMBERS("relative", &scene->run.relative, 1e-6);
    CHECK_NUMBERS("absolute", &scene->run.absolute, 1e-6);
    scene = kt_test_scene("kinetree: 1\nsimulate: {tolerance: {relative: 0, absolute: 1e-8}}\n");
    CHECK_NUMBERS("relative", &scene->run.relative, 0);
    CHECK_NUMBERS("absolute", &scene->run.absolute, 1e-8);
}

KT_TEST(records_are_bits) {
    kt_scene *scene =
        kt_test_scene("kinetree: 1\noutput: {record: [reaction, constraint, energy, acceleration, velocity, "
                      "position]}\n");
    kt_check_equal_int("all", scene->run.record, 63);
}

KT_TEST(files_that_a_scene_names_are_listed) {
    static const char text[] = "kinetree: 1\nbodies:\n  - {name: a, mass: 1}\n"
                               "meshes:\n  - {body: a, file: none/one.stl}\n  - {body: a, file: /none/two.stl}\n"
                               "initial: {from: none.json}\n";
    kt_scene scene;
    kt_error error = {0};
    kt_need(kt_check_equal_int("status",
                               kt_scene_parse("folder/a.yaml", text, strlen(text), &scene, NULL, NULL, &error), KT_OK));
    kt_check_text("in the folder of the scene", kt_scene_file(&scene, 1), "folder/none/one.stl");
    kt_check_text("absolute", kt_scene_file(&scene, 0), "/none/two.stl");
    kt_check_true("no more", kt_scene_file(&scene, 2) == NULL && kt_scene_file(NULL, 0) == NULL);
    (void)kt_error_set(&error, KT_ERROR_FILE, "initial.from", "words");
    kt_check_true("the result is located", kt_scene_locate(&scene, &error));
    kt_check_text("where", error.where, "folder/a.yaml:7:17");
    kt_scene_free(&scene);
    kt_check_true("nothing after its end", kt_scene_file(&scene, 0) == NULL);
}

/* ---- faults that only compiling finds ---------------------------------------------------------------------------- */

/* Compiles a scene that must be rejected there. The place precedes the message. */
static void check_located(const char *path, const char *text, const char *where, const char *message) {
    kt_scene scene;
    kt_model *model = NULL;
    kt_error error = {0}, plain;
    if (kt_scene_parse(path, text, strlen(text), &scene, NULL, NULL, &error) != KT_OK) {
        kt_check_text("reading", error.message, "nothing wrong");
        return;
    }
    kt_check_equal_int("status", kt_model_compile(&scene.description, NULL, &model, &error), KT_ERROR_MODEL);
    plain = error;
    kt_check_true("located", kt_scene_locate(&scene, &error));
    kt_check_text("where", error.where, where);
    kt_check_contains("message", error.message, message);
    kt_check_contains("the words are kept", error.message, plain.message);
    kt_check_equal_int("code", error.code, KT_ERROR_MODEL);
    kt_scene_free(&scene);
    kt_check_true("no place any more", !kt_scene_locate(&scene, &plain));
}

KT_TEST(fault_that_compiling_finds_is_put_where_it_stands) {
    check_located("a.yaml", "kinetree: 1\nbodies:\n  - {name: a, mass: 1}\n  - name: b\n    joint: {type: revolute}\n",
                  "a.yaml:5:12", "body 'b': its revolute joint moves nothing");
    check_located(NULL,
                  "kinetree: 1\nbodies:\n  - {name: a, mass: 1}\n  - {name: b, mass: 1}\nloops:\n"
                  "  - {name: x, type: weld, between: [a, b]}\n",
                  "scene:6:36", "loop 'x': both its ends are on the same rigid part");
}

KT_TEST(fault_of_nothing_in_the_scene_is_not_put_anywhere) {
    kt_error error, before;
    kt_scene *scene = kt_test_scene("kinetree: 1\nbodies:\n  - {name: a, mass: 1}\n");
    static const char *const elsewhere[] = {"", "t = 0 s", "body 'b'", "loop 'a'", "body 'a"};
    for (size_t i = 0; i < sizeof elsewhere / sizeof elsewhere[0]; i++) {
        (void)kt_error_set(&error, KT_ERROR_MODEL, elsewhere[i], "words");
        before = error;
        kt_check_true(elsewhere[i], !kt_scene_locate(scene, &error));
        kt_check_true("untouched", kt_same_bytes(&error, &before, sizeof error));
    }
    kt_scene made = kt_scene_default();
    made.description = scene->description;
    (void)kt_error_set(&error, KT_ERROR_MODEL, "body 'a'", "words");
    kt_check_true("a scene that was made, not read", !kt_scene_locate(&made, &error));
}
