/* Robots that are written start as the mechanisms do: places, velocities and accelerations of bundled scenes and of
 * imported robots with their drives and tendons. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "write_back.h"

#include "check.h"

#include "kinetree/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the start --------------------------------------------------------------------------------------------------- */

/* The places and velocities of bodies at the start of an assembled description. */
typedef struct start {
    kt_model *model;
    kt_data *data;
} start;

static bool begin(const kt_description *d, start *s) {
    kt_error error = {0};
    double *q = NULL;
    *s = (start){NULL, NULL};
    bool fine =
        kt_model_compile(d, NULL, &s->model, &error) == KT_OK && kt_data_create(s->model, &s->data, &error) == KT_OK;
    if (fine) {
        const size_t nq = (size_t)kt_model_nq(s->model), nv = (size_t)kt_model_nv(s->model);
        q = calloc(nq + nv + 1, sizeof *q);
        kt_model_initial(s->model, q, q + nq);
        fine = kt_state_assemble(s->model, s->data, 0.0, q, q + nq, &error) == KT_OK &&
               kt_kinematics_update(s->model, s->data, q, q + nq, NULL, &error) == KT_OK;
    }
    free(q);
    if (!fine)
        kt_note("%s: %s", error.where, error.message);
    return fine;
}

static void end(start *s) {
    kt_data_free(s->data);
    kt_model_free(s->model);
}

static void compare_starts(const start *ours, const start *theirs, kt_worst *place, kt_worst *speed) {
    for (int b = 1; b < kt_model_body_count(ours->model); b++) {
        const int other = kt_body_find(theirs->model, kt_body_name(ours->model, b));
        if (other < 1) /* one without mass, which has given its joint to the next */
            continue;
        const kt_pose x = kt_body_pose(ours->model, ours->data, b),
                      y = kt_body_pose(theirs->model, theirs->data, other);
        const kt_twist v = kt_body_twist(ours->model, ours->data, b),
                       w = kt_body_twist(theirs->model, theirs->data, other);
        const double size = 1.0 + kt_vec3_norm(x.position),
                     pace = 1.0 + kt_vec3_norm(v.linear) + kt_vec3_norm(v.angular);
        kt_worst_near(place, kt_vec3_norm(kt_vec3_sub(x.position, y.position)), 0.0, 1e-10 * size, "%s",
                      kt_body_name(ours->model, b));
        kt_worst_near(speed, kt_vec3_norm(kt_vec3_sub(v.angular, w.angular)), 0.0, 1e-9 * pace, "%s",
                      kt_body_name(ours->model, b));
    }
}

/* Scenes of which no loop is left out. 1e-10: both close their loops to some 1e-11. */
KT_TEST(mjcf_of_bundled_scenes_starts_as_they_do) {
    KT_WORST place = kt_worst_make("places, m"), speed = kt_worst_make("angular velocities, rad/s");
    const kt_robot_options options = {.inertia = KT_ROBOT_INERTIA_ACCEPT, .keyframe = "start"};
    int compared = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_scene *scene = kt_test_bundled(kt_bundled(i));
        char *text = NULL;
        kt_scene back;
        kt_error error = {0};
        start ours, theirs;
        told t;
        if (scene->description.body_count <= 100 &&
            write_back(&scene->description, KT_ROBOT_MJCF, &t, &text, &error) == KT_OK &&
            kt_check_equal_int("read", kt_robot_parse("back", text, strlen(text), &options, &back, NULL, NULL, &error),
                               KT_OK)) {
            kt_note("%s", kt_bundled(i));
            const bool is_whole =
                strstr(t.text, "prescribed motions") == NULL && strstr(t.text, "loops of type") == NULL;
            if (begin(&scene->description, &ours) && is_whole &&
                kt_check_true("it begins", begin(&back.description, &theirs))) {
                compare_starts(&ours, &theirs, &place, &speed);
                compared++;
                end(&theirs);
            }
            end(&ours);
            kt_scene_free(&back);
        }
    }
    kt_check_above("scenes", compared, 50.5);
}

/* ---- imported robots --------------------------------------------------------------------------------------------- */

/* Accelerations at the start, of the joints that both have. Returns how many. */
static int compare_accelerations(const kt_description *d, const kt_description *back, kt_worst *worst) {
    start s[2];
    double *a[2] = {NULL, NULL};
    const kt_description *of[] = {d, back};
    int compared = 0;
    kt_error error = {0};
    bool fine = true;
    for (int i = 0; i < 2; i++) {
        fine = begin(of[i], &s[i]) && fine;
        const size_t nq = fine ? (size_t)kt_model_nq(s[i].model) : 0, nv = fine ? (size_t)kt_model_nv(s[i].model) : 0;
        a[i] = calloc(nq + 2 * nv + 1, sizeof *a[i]);
        double *q = a[i] + nv, *v = q + nq;
        if (!fine)
            continue;
        kt_model_initial(s[i].model, q, v);
        fine = kt_state_assemble(s[i].model, s[i].data, 0.0, q, v, &error) == KT_OK &&
               kt_acceleration_evaluate(s[i].model, s[i].data, 0.0, q, v, NULL, NULL, a[i], &error) == KT_OK;
    }
    double most = 1.0;
    for (int b = 1; fine && b < kt_model_body_count(s[0].model); b++) {
        const kt_coordinates own = kt_body_coordinates(s[0].model, b);
        const int other = body_of_joint(s[1].model, kt_joint_name(s[0].model, b));
        const kt_coordinates there = kt_body_coordinates(s[1].model, other > 0 ? other : 0);
        for (int k = 0; other > 0 && k < own.nv && there.nv == own.nv; k++)
            most = fmax(most, fabs(a[0][own.v + k]));
        for (int k = 0; other > 0 && k < own.nv && there.nv == own.nv; k++, compared++)
            kt_worst_near(worst, a[1][there.v + k], a[0][own.v + k], 1e-9 * most, "%s", kt_joint_name(s[0].model, b));
    }
    for (int i = 0; i < 2; i++) {
        end(&s[i]);
        free(a[i]);
    }
    return kt_check_true("both have accelerations", fine) ? compared : 0;
}

/* Joints of one body, tendons of several joints, springs and dampers in them, motors, servos and equalities come
 * back. */
KT_TEST(imported_robots_come_back_with_their_drives_and_tendons) {
    static const char *const names[] = {"tree", "tendons", "servos"};
    const kt_robot_options options = {.inertia = KT_ROBOT_INERTIA_ACCEPT, .keyframe = "start"};
    KT_WORST worst = kt_worst_make("accelerations at the start");
    int compared = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[600];
        kt_error error = {0};
        kt_scene *scene = kt_test_scene_place();
        told t;
        (void)snprintf(path, sizeof path, "%s/mjcf/%s.xml", KT_MODELS, names[i]);
        kt_need_fine(names[i], kt_robot_read(path, NULL, scene, NULL, NULL, &error), &error);
        const kt_scene *back = come_back(&scene->description, KT_ROBOT_MJCF, &options, &t);
        kt_note("%s", t.text);
        kt_check_true("no drive is left out", strstr(t.text, "motor ") == NULL && strstr(t.text, "type servo") == NULL);
        kt_check_true("no coupling is left out", strstr(t.text, "coupling") == NULL);
        compared += compare_accelerations(&scene->description, &back->description, &worst);
    }
    kt_check_above("coordinates", compared, 20.5);
}

/* A slider that represents `2 a - 3 b + 0.5`, with a spring and a servo in it, and a body without mass before
 * another. */
KT_TEST(sums_of_joints_become_tendons_and_joints_without_mass_those_of_one_body) {
    kt_body bodies[] = {make_body("a", NULL, KT_JOINT_REVOLUTE), make_body("b", "a", KT_JOINT_REVOLUTE),
                        make_body("sum", NULL, KT_JOINT_PRISMATIC), make_body("c", "b", KT_JOINT_PRISMATIC),
                        make_body("d", "c", KT_JOINT_REVOLUTE)};
    const kt_term terms[] = {{"sum", 2.0}, {"a", -4.0}, {"b", 6.0}};
    kt_effect effects[] = {kt_effect_default(), kt_effect_default(), kt_effect_default()};
    kt_loop loop = kt_loop_default();
    kt_description d = kt_description_default();
    KT_WORST worst = kt_worst_make("accelerations at the start");
    const kt_robot_options options = {.keyframe = "start"};
    told t;
    for (int i = 2; i < 4; i++) {
        bodies[i].mass = 0.0;
        bodies[i].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    }
    bodies[0].joint.position[0] = 0.25;
    bodies[1].joint.at = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[3].joint.axis = kt_vec3_make(1.0, 0.5, 0.0);
    bodies[3].joint.rotation = kt_rotation_rpy(0.1, 0.2, 0.3);
    bodies[4].joint.rotation = kt_rotation_rpy(0.3, -0.2, 0.1);
    bodies[4].joint.at = kt_vec3_make(0.5, 0.25, 0.0);
    bodies[4].com = kt_vec3_make(0.5, 0.0, 0.0);
    effects[0].type = KT_EFFECT_JOINT_SPRING;
    effects[0].stiffness = 3.0;
    effects[0].rest = kt_function_constant(0.125);
    effects[1].type = KT_EFFECT_SERVO;
    effects[1].stiffness = 20.0;
    effects[1].damping = 2.0;
    effects[1].target = kt_function_constant(1.5);
    effects[1].lower = -0.5;
    effects[1].upper = 0.75; /* reached */
    effects[2].type = KT_EFFECT_MOTOR;
    effects[2].torque = kt_function_constant(0.75);
    effects[0].joint = effects[1].joint = "sum";
    effects[2].joint = "c";
    loop.name = "tie";
    loop.type = KT_LOOP_COUPLING;
    loop.terms = terms;
    loop.term_count = 3;
    loop.offset = 1.0;
    d.gravity = kt_vec3_make(1.0, -9.0, 2.0);
    kt_describe(&d, bodies, 5, &loop, 1, effects, 3);
    const kt_scene *back = come_back(&d, KT_ROBOT_MJCF, &options, &t);
    kt_check_text("nothing is left out", t.text, "");
    kt_check_equal_int("accelerations", compare_accelerations(&d, &back->description, &worst), 5);
}
