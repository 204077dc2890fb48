/* Parents, cycles, lists, the order of faults, and size. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "describe.h"
#include "interpose.h"
#include "mechanism.h"

static const double nan_value = (double)NAN;

static fault_list faults_with_parent(int body, const char *parent) {
    mechanism m;
    mechanism_fill(&m);
    m.bodies[body].parent = parent;
    return mechanism_faults(&m.description);
}

KT_TEST(parents_exist) {
    kt_check_text("swapped letters", faults_with_parent(COUPLER, "crnak").text,
                  "body 1 -1 parent | body 'coupler' | parent 'crnak' does not exist; did you mean 'crank'?\n");
    kt_check_text("world in capitals", faults_with_parent(COUPLER, "World").text,
                  "body 1 -1 parent | body 'coupler' | parent 'World' does not exist; did you mean 'world'?\n");
    kt_check_text("nothing near", faults_with_parent(COUPLER, "piston").text,
                  "body 1 -1 parent | body 'coupler' | parent 'piston' does not exist; name a body of the scene, or "
                  "'world'\n");
    kt_check_text("empty", faults_with_parent(COUPLER, "").text,
                  "body 1 -1 parent | body 'coupler' | parent '' does not exist; name a body of the scene, or "
                  "'world'\n");
    kt_check_text("a body is no suggestion for its own parent", faults_with_parent(COUPLER, "couple").text,
                  "body 1 -1 parent | body 'coupler' | parent 'couple' does not exist; name a body of the scene, or "
                  "'world'\n");
    kt_check_text("a later body", faults_with_parent(COUPLER, "base").text, "");
}

KT_TEST(cycles_are_named_once) {
    kt_check_text("of one", faults_with_parent(CRANK, "crank").text,
                  "body 0 -1 parent | body 'crank' | parent 'crank' is the body itself; name another body, or "
                  "'world'\n");
    kt_check_text("of two", faults_with_parent(CRANK, "coupler").text,
                  "body 0 -1 parent | body 'crank' | the parents form a cycle of 2 bodies, 'crank' -> 'coupler' -> "
                  "'crank'; give one of them another parent\n");
    mechanism m;
    mechanism_fill(&m);
    m.bodies[CRANK].parent = "base"; /* a branch that leads into the first cycle */
    m.bodies[BASE].parent = "bird";
    m.bodies[BIRD].parent = "ball";
    m.bodies[BALL].parent = "base";
    m.bodies[SLIDER].parent = "gimbal";
    m.bodies[GIMBAL].parent = "slider";
    kt_check_text("two cycles", mechanism_faults(&m.description).text,
                  "body 3 -1 parent | body 'slider' | the parents form a cycle of 2 bodies, 'slider' -> 'gimbal' -> "
                  "'slider'; give one of them another parent\n"
                  "body 4 -1 parent | body 'ball' | the parents form a cycle of 3 bodies, 'ball' -> 'base' -> 'bird' "
                  "-> 'ball'; give one of them another parent\n");
    mechanism_fill(&m);
    m.bodies[CRANK].parent = "rocker";
    m.bodies[ROCKER].parent = "slider";
    m.bodies[SLIDER].parent = "ball";
    m.bodies[BALL].parent = "bird";
    m.bodies[BIRD].parent = "coupler";
    const kt_description four = {.bodies = m.bodies + 1, .body_count = 4};
    m.bodies[COUPLER].parent = "rocker";
    m.bodies[BALL].parent = "coupler";
    kt_check_text("four are named", mechanism_faults(&four).text,
                  "body 0 -1 parent | body 'coupler' | the parents form a cycle of 4 bodies, 'coupler' -> 'rocker' -> "
                  "'slider' -> 'ball' -> 'coupler'; give one of them another parent\n");
    m.bodies[COUPLER].parent = "crank";
    m.bodies[BALL].parent = "bird";
    kt_check_text("a long one", mechanism_faults(&m.description).text,
                  "body 0 -1 parent | body 'crank' | the parents form a cycle of 6 bodies, 'crank' -> 'rocker' -> "
                  "'slider' -> 'ball' -> ... -> 'crank'; give one of them another parent\n");
}

KT_TEST(held_joints_exist_once) {
    mechanism m;
    mechanism_fill(&m);
    m.hold[1] = "crnak";
    mechanism_fails(&m, KT_ITEM_HOLD, 1, -1, "hold", "hold[1]", "joint 'crnak' does not exist; did you mean 'crank'?");
    m.hold[1] = NULL;
    mechanism_fails(&m, KT_ITEM_HOLD, 1, -1, "hold", "hold[1]", "joint is missing; name the body that it carries");
    m.hold[1] = "crank";
    mechanism_fails(&m, KT_ITEM_HOLD, 1, -1, "hold", "hold[1]", "joint 'crank' is listed twice; name it once");
    m.hold[0] = m.hold[1] = "nobody";
    kt_check_equal_int("unknown joints do not stand twice", mechanism_faults(&m.description).count, 2);
    m.hold[0] = "crank";
    m.hold[1] = "ball";
    mechanism_passes("a joint of many coordinates", &m);
}

KT_TEST(lists_and_counts_agree) {
    mechanism m;
#define REJECTS(change, field, message)                                                                                \
    mechanism_fill(&m);                                                                                                \
    m.description.change;                                                                                              \
    mechanism_fails(&m, KT_ITEM_SCENE, 0, -1, field, "scene", message)
    REJECTS(body_count = -1, "bodies", "bodies: the count is -1; it cannot be negative");
    REJECTS(bodies = NULL, "bodies", "bodies: the list is NULL, and its count 9");
    REJECTS(body_count = INT_MAX, "bodies", "bodies: the count is 2147483647; 100000000 is the most");
    REJECTS(loop_count = -2, "loops", "loops: the count is -2; it cannot be negative");
    REJECTS(loops = NULL, "loops", "loops: the list is NULL, and its count 6");
    REJECTS(effect_count = -2, "effects", "effects: the count is -2; it cannot be negative");
    REJECTS(effects = NULL, "effects", "effects: the list is NULL, and its count 3");
    REJECTS(hold_count = -2, "hold", "hold: the count is -2; it cannot be negative");
    REJECTS(hold = NULL, "hold", "hold: the list is NULL, and its count 2");
    REJECTS(gravity.z = nan_value, "gravity", "gravity[2] is nan; give a finite number");
    REJECTS(gravity.x = 1e200, "gravity",
            "gravity[0] is 1e+200, and the equations would overflow; magnitudes end at 1e+50");
#undef REJECTS
    mechanism_fill(&m);
    m.bodies[0].marker_count = m.bodies[2].marker_count = 60000000;
    mechanism_fails(&m, KT_ITEM_SCENE, 0, -1, "bodies", "scene",
                    "bodies have 120000000 markers in all; 100000000 is the most");
}

KT_TEST(faults_come_in_the_order_of_the_description) {
    mechanism m;
    mechanism_fill(&m);
    m.hold[0] = "nobody";
    m.effects[OIL].damping = -1.0;
    m.loops[WHEEL].radius = 0.0;
    m.loops[ROD].between[1].body = "nobody";
    m.bodies[BASE].mass = -1.0;
    m.bodies[ROCKER].parent = "nobody";
    m.bodies[ROCKER].joint.axis = kt_vec3_make(0.0, 0.0, 0.0);
    m.bodies[ROCKER].joint.at.x = nan_value;
    m.bodies[ROCKER].mass = nan_value;
    m.end[0].at.x = nan_value;
    m.description.gravity.x = nan_value;
    kt_check_text("faults", mechanism_faults(&m.description).text,
                  "scene 0 -1 gravity | scene | gravity[0] is nan; give a finite number\n"
                  "body 2 -1 parent | body 'rocker' | parent 'nobody' does not exist; name a body of the scene, or "
                  "'world'\n"
                  "body 2 -1 joint.axis | body 'rocker' | joint.axis is zero; give it a direction, such as [0, 0, 1]\n"
                  "body 2 -1 joint.at | body 'rocker' | joint.at[0] is nan; give a finite number\n"
                  "body 2 -1 mass | body 'rocker' | mass is nan; give a finite number\n"
                  "body 2 0 markers | body 'rocker' | markers 'end'[0] is nan; give a finite number\n"
                  "body 8 -1 mass | body 'base' | mass is -1; it cannot be negative\n"
                  "loop 1 1 between | loop 'rod' | body 'nobody' does not exist; name a body of the scene, or 'world'\n"
                  "loop 4 -1 radius | loop 'wheel' | radius is 0; it must be greater than 0\n"
                  "effect 1 -1 damping | effect 'oil' | damping is -1; it cannot be negative\n"
                  "hold 0 -1 hold | hold[0] | joint 'nobody' does not exist; name a body of the scene\n");
}

KT_TEST(children_of_a_wrong_body_are_not_wrong) {
    mechanism m;
    mechanism_fill(&m);
    m.bodies[CRANK].name = "1st";
    m.bodies[COUPLER].parent = "1st";
    m.effects[COIL].between[1].body = m.effects[ENGINE].joint = m.hold[0] = m.terms[0].joint = "1st";
    kt_check_equal_int("faults", mechanism_faults(&m.description).count, 1);
    mechanism_fill(&m);
    m.bodies[SLIDER].joint.type = (kt_joint_type)-1;
    kt_check_equal_int("faults", mechanism_faults(&m.description).count, 1);
}

KT_TEST(every_kind_of_name_has_room) {
    enum { COUNT = 300 };
    static char names[COUNT][8];
    static kt_loop loops[COUNT];
    static kt_effect effects[COUNT];
    static kt_marker markers[COUNT];
    kt_body body = kt_body_of("slider", NULL, KT_JOINT_PRISMATIC, 0.0);
    for (int i = 0; i < COUNT; i++) {
        snprintf(names[i], sizeof names[i], "n%d", i);
        loops[i] = kt_loop_default();
        loops[i].name = effects[i].name = markers[i].name = names[i];
        loops[i].type = KT_LOOP_MOTION;
        loops[i].function = effects[i].torque = kt_function_constant(0.0);
        loops[i].joint = effects[i].joint = body.name;
        effects[i].type = KT_EFFECT_MOTOR;
    }
    kt_description d = kt_description_default();
    d.loops = loops;
    d.effects = effects;
    d.bodies = &body;
    d.body_count = 1;
    d.loop_count = COUNT;
    kt_check_text("loops", mechanism_faults(&d).text, "");
    d.loop_count = 0;
    d.effect_count = COUNT;
    kt_check_text("effects", mechanism_faults(&d).text, "");
    d.effect_count = 0;
    body.markers = markers;
    body.marker_count = COUNT;
    kt_check_text("markers", mechanism_faults(&d).text, "");
}

KT_TEST(missing_memory_is_told) {
    mechanism m;
    mechanism_fill(&m);
    m.bodies[0].mass = -1.0;
    kt_error error = {KT_OK, "", ""};
    kt_interpose_start_failing(1);
    const kt_status status = kt_description_check(&m.description, NULL, NULL, &error);
    const long allocations = kt_interpose_stop();
    kt_check_equal_int("status", status, KT_ERROR_MEMORY);
    kt_check_equal_int("code", error.code, KT_ERROR_MEMORY);
    kt_check_text("message", error.message, "no memory to check 9 bodies; use a smaller model");
    kt_check_equal_int("allocations", allocations, 1);

    kt_interpose_start();
    kt_check_equal_int("status", kt_description_check(&m.description, NULL, NULL, NULL), KT_ERROR_MODEL);
    kt_check_equal_int("allocations", kt_interpose_stop(), 1);
    kt_check_equal_int("frees", kt_interpose_frees(), 1);
    kt_check_equal_int("no description", kt_description_check(NULL, NULL, NULL, &error), KT_ERROR_ARGUMENT);
}

/* ---- size ---------------------------------------------------------------------------------------------------------
 */

enum { MANY = 200000 };

typedef struct crowd {
    kt_body *bodies;
    char (*names)[16], (*parents)[16];
    kt_description description;
} crowd;

/* Bodies b0, b1, ... each on the next, the last on `end`. */
static crowd crowd_make(const char *end) {
    crowd c = {calloc(MANY, sizeof *c.bodies), calloc(MANY, 16), calloc(MANY, 16), kt_description_default()};
    for (int i = 0; i < MANY; i++) {
        snprintf(c.names[i], 16, "b%d", i);
        snprintf(c.parents[i], 16, "b%d", i + 1);
        c.bodies[i] = kt_body_default();
        c.bodies[i].name = c.names[i];
        c.bodies[i].parent = c.parents[i];
    }
    snprintf(c.parents[MANY - 1], 16, "%s", end);
    c.description.bodies = c.bodies;
    c.description.body_count = MANY;
    return c;
}

static void crowd_free(crowd *c) {
    free(c->bodies);
    free(c->names);
    free(c->parents);
}

static void count_fault(void *user, const kt_place *place, const kt_error *error) {
    int *count = user;
    count[0]++;
    count[1] += strstr(error->message, "did you mean") != NULL;
    count[2] = place->index;
}

/* Would not end within the test's time were any part quadratic: 4e10 operations. */
KT_TEST(large_descriptions_take_linear_time) {
    crowd c = crowd_make("world");
    int count[3] = {0, 0, 0};
    kt_check_equal_int("chain", kt_description_check(&c.description, count_fault, count, NULL), KT_OK);

    snprintf(c.parents[MANY - 1], 16, "b0");
    kt_check_equal_int("ring", kt_description_check(&c.description, count_fault, count, NULL), KT_ERROR_MODEL);
    kt_check_equal_int("cycles", count[0], 1);
    kt_check_equal_int("first body of the cycle", count[2], 0);

    count[0] = 0;
    for (int i = 0; i < MANY; i++)
        snprintf(c.parents[i], 16, "c%d", (int)(i * 7L % MANY));
    kt_check_equal_int("orphans", kt_description_check(&c.description, count_fault, count, NULL), KT_ERROR_MODEL);
    kt_check_equal_int("unknown parents", count[0], MANY);
    kt_check_true("some come with a suggestion", count[1] > 3 && count[1] < 100);

    count[0] = 0;
    for (int i = 0; i < MANY; i++) {
        c.bodies[i].name = "same";
        c.bodies[i].parent = NULL;
    }
    kt_check_equal_int("namesakes", kt_description_check(&c.description, count_fault, count, NULL), KT_ERROR_MODEL);
    kt_check_equal_int("names used again", count[0], MANY - 1);
    crowd_free(&c);
}
