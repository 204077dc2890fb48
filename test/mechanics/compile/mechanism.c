/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanism.h"
#include "describe.h"

#include <stdio.h>
#include <string.h>

#include "check.h"

static kt_body body_of(const char *name, const char *parent, kt_joint_type type) {
    kt_body body = kt_body_of(name, parent, type, 2.0);
    body.inertia = kt_sym3_make(1.0, 2.0, 2.5, 0.1, -0.2, 0.3);
    return body;
}

static kt_loop loop_of(const char *name, kt_loop_type type, const char *first, const char *second) {
    kt_loop loop = kt_loop_of(name, type);
    loop.between[0].body = first;
    loop.between[1].body = second;
    return loop;
}

static void fill_bodies(mechanism *m) {
    m->bodies[CRANK] = body_of("crank", NULL, KT_JOINT_REVOLUTE);
    m->bodies[COUPLER] = body_of("coupler", "crank", KT_JOINT_REVOLUTE);
    m->bodies[ROCKER] = body_of("rocker", "world", KT_JOINT_REVOLUTE);
    m->bodies[SLIDER] = body_of("slider", "gimbal", KT_JOINT_PRISMATIC); /* its parent comes later */
    m->bodies[BALL] = body_of("ball", NULL, KT_JOINT_SPHERICAL);
    m->bodies[BIRD] = body_of("bird", NULL, KT_JOINT_FREE);
    m->bodies[GIMBAL] = body_of("gimbal", NULL, KT_JOINT_UNIVERSAL);
    m->bodies[SCREW] = body_of("screw", NULL, KT_JOINT_SCREW);
    m->bodies[BASE] = body_of("base", NULL, KT_JOINT_FIXED);
    m->bodies[SCREW].joint.pitch = 0.01;
    m->tips[0] = (kt_marker){.name = "tip", .at = {1.0, 0.0, 0.0}};
    m->tips[1] = (kt_marker){.name = "heel", .at = {-1.0, 0.0, 0.0}};
    m->bodies[CRANK].markers = m->tips;
    m->bodies[CRANK].marker_count = 2;
    m->end[0] = (kt_marker){.name = "end", .at = {0.5, 0.0, 0.0}};
    m->bodies[ROCKER].markers = m->end;
    m->bodies[ROCKER].marker_count = 1;
    m->bodies[BALL].shape.type = KT_SHAPE_SPHERE;
    m->bodies[BALL].shape.radius = 0.2;
    m->bodies[BALL].com_of_shape = m->bodies[BALL].inertia_of_shape = true;
}

static void fill_loops(mechanism *m) {
    m->loops[CLOSE] = loop_of("close", KT_LOOP_REVOLUTE, "coupler", "rocker");
    m->loops[CLOSE].between[1].marker = "end";
    m->loops[ROD] = loop_of("rod", KT_LOOP_DISTANCE, NULL, "ball");
    m->loops[ROD].between[1].at = kt_vec3_make(0.0, 0.5, 0.0);
    m->loops[GEAR] = loop_of("gear", KT_LOOP_COUPLING, NULL, NULL);
    m->terms[0] = (kt_term){"crank", 1.0};
    m->terms[1] = (kt_term){"rocker", -2.0};
    m->loops[GEAR].terms = m->terms;
    m->loops[GEAR].term_count = 2;
    m->loops[DRIVE] = loop_of("drive", KT_LOOP_MOTION, NULL, NULL);
    m->loops[DRIVE].joint = "slider";
    m->loops[DRIVE].function = kt_function_sine(1.0, 2.0, 0.0, 0.0);
    m->loops[WHEEL] = loop_of("wheel", KT_LOOP_ROLLING, "bird", NULL);
    m->loops[WHEEL].axis = kt_vec3_make(0.0, 1.0, 0.0);
    m->loops[WHEEL].radius = 0.3;
    m->loops[CARDAN] = loop_of("cardan", KT_LOOP_UNIVERSAL, "screw", "world");
}

void mechanism_fill(mechanism *m) {
    fill_bodies(m);
    fill_loops(m);
    for (int i = 0; i < EFFECTS; i++)
        m->effects[i] = kt_effect_default();
    m->effects[COIL].type = KT_EFFECT_SPRING; /* without a name: it may be so */
    m->effects[COIL].between[0].body = "bird";
    m->effects[COIL].between[1].body = "crank";
    m->effects[COIL].between[1].marker = "heel";
    m->effects[COIL].stiffness = 100.0;
    m->effects[OIL].name = "oil";
    m->effects[OIL].type = KT_EFFECT_JOINT_DAMPER;
    m->effects[OIL].joint = "screw";
    m->effects[OIL].damping = 0.1;
    m->effects[ENGINE].name = "engine";
    m->effects[ENGINE].type = KT_EFFECT_MOTOR;
    m->effects[ENGINE].joint = "crank";
    m->effects[ENGINE].torque = kt_function_constant(3.0);
    m->hold[0] = "crank";
    m->hold[1] = "slider";
    m->description = kt_description_of(m->bodies, BODIES, m->loops, LOOPS, m->effects, EFFECTS);
    m->description.hold = m->hold;
    m->description.hold_count = 2;
}

/* ---- the check --------------------------------------------------------------------------------------------------- */

static void add_fault(void *user, const kt_place *place, const kt_error *error) {
    static const char *const items[] = {"scene", "body", "loop", "effect", "hold"};
    fault_list *list = user;
    const size_t end = strlen(list->text);
    list->count++;
    if (error->code != KT_ERROR_MODEL)
        kt_check_equal_int("code of a fault", error->code, KT_ERROR_MODEL);
    snprintf(list->text + end, sizeof list->text - end, "%s %d %d %s | %s | %s\n", items[place->item], place->index,
             place->sub, place->field, error->where, error->message);
}

fault_list mechanism_faults(const kt_description *description) {
    fault_list list = {0, ""};
    kt_error error = {KT_OK, "untouched", "untouched"}, alone = error;
    const kt_status status = kt_description_check(description, add_fault, &list, &error);
    const kt_status status_alone = kt_description_check(description, NULL, NULL, &alone);
    const kt_status status_silent = kt_description_check(description, NULL, NULL, NULL);

    /* With or without listeners the answer is the same, and it is the first fault. */
    char line[sizeof error.where + sizeof error.message + 8];
    snprintf(line, sizeof line, "| %s | %s\n", error.where, error.message);
    const char *first = strchr(list.text, '|');
    if (status != (list.count > 0 ? KT_ERROR_MODEL : KT_OK) || status_alone != status || status_silent != status)
        kt_check_true("status tells whether there are faults", false);
    if (list.count > 0 ? first == NULL || strncmp(first, line, strlen(line)) != 0
                       : strcmp(error.where, "untouched") != 0)
        kt_check_text("error is the first fault", line, list.text);
    if (error.code != status || alone.code != status || strcmp(error.message, alone.message) != 0 ||
        strcmp(error.where, alone.where) != 0)
        kt_check_true("error is the same without a report", false);
    return list;
}

void mechanism_passes(const char *what, const mechanism *m) {
    const fault_list list = mechanism_faults(&m->description);
    kt_check_text(what, list.text, "");
}

void mechanism_fails(const mechanism *m, kt_item item, int index, int sub, const char *field, const char *where,
                     const char *message) {
    static const char *const items[] = {"scene", "body", "loop", "effect", "hold"};
    char expected[1024];
    snprintf(expected, sizeof expected, "%s %d %d %s | %s | %s\n", items[item], index, sub, field, where, message);
    const fault_list list = mechanism_faults(&m->description);
    kt_check_text(field, list.text, expected);
}
