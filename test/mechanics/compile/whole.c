/* Faults that only the whole mechanism shows. All are reported at once, and together with other faults. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "interpose.h"
#include "string_up.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const kt_vec3 ex = {1.0, 0.0, 0.0}, ey = {0.0, 1.0, 0.0}, ez = {0.0, 0.0, 1.0};

typedef struct told {
    char text[600]; /* "item index field: where; " of each */
    size_t length;
    int strange; /* words that are not those of kt_model_compile, or another code */
} told;

static void note_told(void *user, const kt_place *place, const kt_error *error) {
    told *t = user;
    const bool body = place->item == KT_ITEM_BODY;
    const char *words = body ? "moves nothing that has inertia" : "both its ends are on the same rigid part";
    t->strange += error->code != KT_ERROR_MODEL || !strstr(error->message, words) || place->sub != -1;
    t->length += (size_t)snprintf(t->text + t->length, sizeof t->text - t->length, "%s %d %s: %s; ",
                                  body ? "body" : "loop", place->index, place->field, error->where);
}

/* The result of kt_model_check for a description. Without other faults, its first fault is that of kt_model_compile. */
static void check_told(const char *what, const kt_description *d, const char *expected, const char *where) {
    told t = {.length = 0};
    kt_error error = {KT_OK, "", ""}, other = {KT_OK, "", ""};
    kt_model *model = NULL;
    const kt_status status = kt_model_check(d, note_told, &t, &error);
    kt_check_text(what, t.text, expected);
    kt_check_equal_int("strange", t.strange, 0);
    kt_check_equal_int("status", status, *expected ? KT_ERROR_MODEL : KT_OK);
    kt_check_text("first", error.where, where);
    kt_check_equal_int("status without a report", kt_model_check(d, NULL, NULL, &other), status);
    kt_check_text("the same", other.message, error.message);
    if (kt_description_check(d, NULL, NULL, &other) == KT_OK) {
        kt_check_equal_int("compiling", kt_model_compile(d, NULL, &model, &other), status);
        kt_check_text("says the first", status == KT_OK ? "" : other.where, where);
        kt_model_free(model);
    }
}

/* Four trees. The first is a slide without mass, and the second is valid. The third is a chain whose tip has no mass,
 * and only this is reported. The fourth is a wheel without inertia about its axis on a massless cross. */
static void grow_four(kt_tree *tree) {
    static const char *const names[7] = {"slide", "rotor", "root", "middle", "tip", "cross", "wheel"};
    static const kt_joint_type types[7] = {KT_JOINT_PRISMATIC, KT_JOINT_REVOLUTE,  KT_JOINT_REVOLUTE, KT_JOINT_REVOLUTE,
                                           KT_JOINT_REVOLUTE,  KT_JOINT_UNIVERSAL, KT_JOINT_REVOLUTE};
    *tree = (kt_tree){.count = 0};
    for (int i = 0; i < 7; i++)
        (void)add(tree, names[i], types[i], ez);
    tree->body[0].parent = tree->body[1].parent = tree->body[2].parent = tree->body[5].parent = NULL;
    load(&tree->body[1], 1.0, ex, 1.0);
    load(&tree->body[6], 1.0, ey, 0.0);
    tree->body[6].joint.axis = ey; /* the point of the wheel lies on its axis */
    tree->body[3].joint.at = tree->body[4].joint.at = ex;
}

KT_TEST(all_freedoms_without_inertia_are_told_at_once) {
    kt_tree tree;
    grow_four(&tree);
    check_told("four trees", &tree.description,
               "body 0 joint: body 'slide'; body 4 joint: body 'tip'; body 6 joint: body 'wheel'; ", "body 'slide'");
    load(&tree.body[4], 1.0, ex, 0.1);
    load(&tree.body[6], 1.0, ey, 0.1);
    check_told("one is left", &tree.description, "body 0 joint: body 'slide'; ", "body 'slide'");
    load(&tree.body[0], 1.0, ex, 0.0);
    check_told("none is left", &tree.description, "", "");
}

/* Other faults are reported together with these. Freedoms that depend on the other faults are not reported. */
KT_TEST(freedoms_without_inertia_are_told_beside_other_faults) {
    kt_tree tree;
    grow_four(&tree);
    tree.body[1].mass = -1.0;
    tree.description.gravity = kt_vec3_make((double)NAN, 0.0, 0.0);
    check_told("a sound one with a wrong mass", &tree.description,
               "body 0 joint: body 'slide'; body 4 joint: body 'tip'; body 6 joint: body 'wheel'; ", "body 'slide'");
    tree.body[4].mass = (double)NAN;
    tree.body[6].joint.axis = kt_vec3_make(0.0, 0.0, 0.0);
    check_told("wrong ones themselves", &tree.description, "body 0 joint: body 'slide'; ", "body 'slide'");
    tree.body[3].parent = "nobody";
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int("a parent that is not there", kt_model_check(&tree.description, NULL, NULL, &error), KT_OK);
    kt_check_equal_int("nothing", kt_model_check(NULL, NULL, NULL, &error), KT_ERROR_ARGUMENT);
}

static kt_loop loop_between(const char *name, const char *first, const char *second) {
    kt_loop loop = kt_loop_of(name, KT_LOOP_SPHERICAL);
    loop.between[0].body = first;
    loop.between[1].body = second;
    return loop;
}

/* A loop may hold a body without inertia. Bodies that carry one end of the loop are not judged, and all others are. */
KT_TEST(freedoms_that_no_loop_holds_are_judged_beside_loops) {
    kt_tree tree;
    kt_term terms[2] = {{"slide", 1.0}, {"rotor", 1.0}};
    grow_four(&tree);
    kt_loop loops[4] = {loop_between("a", "tip", "rotor"), loop_between("rigid", NULL, "world"), kt_loop_default(),
                        kt_loop_default()};
    tree.description.loops = loops;
    tree.description.loop_count = 1;
    check_told("the chain is held", &tree.description, "body 0 joint: body 'slide'; body 6 joint: body 'wheel'; ",
               "body 'slide'");
    loops[2].name = "gear";
    loops[2].type = KT_LOOP_COUPLING;
    loops[2].terms = terms;
    loops[2].term_count = 2;
    loops[3].name = "drive";
    loops[3].type = KT_LOOP_MOTION;
    loops[3].joint = "wheel";
    loops[3].function = kt_function_constant(0.0);
    loops[1] = loops[2];
    loops[2] = loops[3];
    tree.description.loop_count = 3;
    check_told("the slide is geared, the wheel driven", &tree.description, "", "");
}

KT_TEST(all_loops_within_one_rigid_part_are_told_at_once) {
    kt_tree tree = {.count = 0};
    load(add(&tree, "a", KT_JOINT_REVOLUTE, ez), 1.0, ex, 1.0);
    load(add(&tree, "b", KT_JOINT_FIXED, ez), 1.0, ex, 1.0);
    load(add(&tree, "c", KT_JOINT_REVOLUTE, ez), 1.0, ex, 1.0);
    (void)add(&tree, "d", KT_JOINT_REVOLUTE, ez);
    tree.body[3].parent = NULL;
    kt_loop loops[3] = {loop_between("x", "a", "b"), loop_between("y", "b", "c"), loop_between("z", "b", "a")};
    tree.description.loops = loops;
    tree.description.loop_count = 3;
    check_told("two of three", &tree.description,
               "body 3 joint: body 'd'; loop 0 between: loop 'x'; loop 2 between: loop 'z'; ", "body 'd'");
}

KT_TEST(without_memory_nothing_of_the_whole_is_told) {
    kt_tree tree;
    grow_four(&tree);
    tree.body[1].mass = -1.0;
    int tried = 0;
    for (long n = 1;; n++) {
        told t = {.length = 0};
        kt_error error = {KT_OK, "", ""};
        kt_interpose_start_failing(n);
        const kt_status status = kt_model_check(&tree.description, note_told, &t, &error);
        const long allocations = kt_interpose_stop();
        if (!kt_interpose_has_failed()) {
            kt_check_equal_int("in the end", status, KT_ERROR_MODEL);
            kt_check_equal_int("all is released", kt_interpose_frees(), allocations);
            break;
        }
        tried++;
        kt_check_equal_int("status", status, KT_ERROR_MEMORY);
        kt_check_equal_int("code", error.code, KT_ERROR_MEMORY);
        kt_check_text("told", t.text, "");
        kt_check_equal_int("released", kt_interpose_frees(), allocations - 1);
    }
    kt_check_above("allocations made to fail", tried, 5.0); /* a step of set-up takes its arrays as one */
}
