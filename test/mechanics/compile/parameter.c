/* Parameters: a copy with a set parameter computes, to the bit, the results of a model that was compiled with it. The
 * original model stays unchanged. Names are found or suggested. Impossible values are rejected and change nothing. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"

#include "interpose.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 32, TEXT = 4096 };

/* A four-bar whose crank is driven, with a payload; an arm in space; forces of many types. A line that begins with the
 * name of a parameter's place is replaced. */
static const char scene_text[] =
    "kinetree: 1\n"
    "gravity: [%s]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg%s}, mass: 1, shape: {type: rod, to: [0.3, 0, "
    "0]},\n"
    "     markers: {pin: [0.3, 0, 0]}}\n"
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [0.3, 0, 0], position: -75 deg}, mass: 2,\n"
    "     com: [0.5, 0, 0], inertia: [0, 0.2, 0.2], markers: {end: [1, 0, 0]}}\n"
    "  - {name: load, parent: rod, joint: {type: fixed, at: [0.4, 0.1, 0]}, mass: %s, com: [%s], inertia: [%s]}\n"
    "  - {name: ram, joint: {type: prismatic, axis: x, position: 1.1}, mass: 5}\n"
    "  - {name: arm, joint: {type: universal, axis: x, at: [0, 0, 2], position: [0.3, 0.4]%s}, mass: 1.5,\n"
    "     com: [0.1, 0.2, 0.3], inertia: [1, 1.2, 1.4], markers: {tip: [0, 0, 1]}}\n"
    "  - {name: hand, parent: arm, joint: {type: spherical, at: [0, 0, 1]%s}, mass: 0.5, com: [0, 0.1, 0.2],\n"
    "     inertia: [0.1, 0.12, 0.15]}\n"
    "  - {name: slide, parent: hand, joint: {type: prismatic, axis: y, position: 0.2}, mass: 0.3,\n"
    "     inertia: [0.01, 0.012, 0.015]}\n"
    "loops:\n"
    "  - {name: eye, type: revolute, between: [rod.end, ram], axis: z}\n"
    "  - {name: drive, type: motion, joint: crank, position: %s}\n"
    "effects:\n"
    "  - {name: coil, type: spring, between: [arm.tip, world], stiffness: %s, length: 0.5, damping: 0.1}\n"
    "  - {name: brake, type: joint_friction, joint: slide, coulomb: %s, viscous: 0.1}\n"
    "  - {name: hold, type: servo, joint: slide, target: %s, stiffness: 30, damping: 2}\n"
    "  - {name: seat, type: joint_spring, joint: slide, stiffness: 3, rest: 0.1}\n"
    "  - {name: mount, type: bushing, between: [hand, world], stiffness: [%s], damping: [0, 0, 0, 0, 0, 0]}\n"
    "  - {name: stop, type: joint_limit, joint: slide, lower: -1, upper: 1, stiffness: 100}\n"
    "  - {name: floor, type: contact, point: hand, plane: world, stiffness: 1000}\n"
    "  - {name: push, type: force, at: hand, value: [%s]}\n";

enum { PLACES = 13 };
static const char *const standard[PLACES] = {"0, -9.81, 0",
                                             "",
                                             "0.7",
                                             "0.1, 0.2, 0",
                                             "0.02, 0.03, 0.04, 0.001, 0, 0",
                                             "",
                                             "",
                                             "{polynomial: [1.0471975511965976, 2, 0.5]}",
                                             "100",
                                             "0.3",
                                             "0.1",
                                             "1, 2, 3, 4, 5, 6",
                                             "1, 2, 3"};

/* A parameter, its numbers, and the same in the text. */
typedef struct trial {
    const char *name;
    int place;
    const char *text;
    int count;
    double values[6];
} trial;

static const trial trials[] = {
    {"gravity", 0, "1, 2, -3", 3, {1, 2, -3}},
    {"crank.armature", 1, ", armature: 0.25", 1, {0.25}},
    {"load.mass", 2, "2.5", 1, {2.5}},
    {"load.com", 3, "0.3, -0.1, 0.2", 3, {0.3, -0.1, 0.2}},
    {"load.inertia", 4, "0.1, 0.2, 0.15, 0.01, -0.02, 0.03", 6, {0.1, 0.2, 0.15, 0.01, -0.02, 0.03}},
    {"arm.armature", 5, ", armature: [0.5, 0.75]", 2, {0.5, 0.75}},
    {"hand.armature", 6, ", armature: [0.5, 0.75, 0.25]", 3, {0.5, 0.75, 0.25}},
    {"loop drive.position", 7, "{polynomial: [1.0471975511965976, -1, 0.25]}", 4, {1.0471975511965976, -1, 0.5, 0}},
    {"effect coil.stiffness", 8, "250", 1, {250}},
    {"effect brake.coulomb", 9, "0.9", 1, {0.9}},
    {"effect hold.target", 10, "{polynomial: [0.3, 0.5]}", 4, {0.3, 0.5, 0, 0}},
    {"effect mount.stiffness", 11, "6, 5, 4, 3, 2, 1", 6, {6, 5, 4, 3, 2, 1}},
    {"effect push.value", 12, "-4, 5, 0.5", 3, {-4, 5, 0.5}},
};
enum { TRIALS = sizeof trials / sizeof *trials };

static kt_model *compile(const trial *with, kt_plan plan) {
    char text[TEXT];
    const char *p[PLACES];
    memcpy(p, standard, sizeof p);
    if (with)
        p[with->place] = with->text;
    (void)snprintf(text, sizeof text, scene_text, p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10],
                   p[11], p[12]);
    kt_model_options options = kt_model_options_default();
    options.plan = plan;
    return kt_test_model(&kt_test_scene(text)->description, &options);
}

static kt_model *copy_of(const kt_model *model) {
    const size_t size = (kt_model_size(model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_model *copy = NULL;
    kt_error e;
    kt_test_own(memory, free);
    kt_need_fine("copy", kt_model_copy(model, memory, size, &copy, &e), &e);
    return copy;
}

static bool set(kt_model *copy, const trial *t) {
    kt_parameter parameter;
    kt_error e;
    return kt_fine(t->name, kt_parameter_find(copy, t->name, &parameter, &e), &e) &&
           kt_check_equal_int("numbers", parameter.count, t->count) &&
           kt_fine("set", kt_parameter_set(copy, &parameter, t->values, &e), &e);
}

/* The compared results: accelerations, mass matrix, energies, reactions. */
typedef struct answer {
    double a[MOST], mass[MOST * MOST], tau[MOST], energy[3];
    kt_wrench joint[MOST];
} answer;

static answer ask(const kt_model *model) {
    static answer x;
    double q[MOST], v[MOST];
    kt_error e;
    memset(&x, 0, sizeof x);
    kt_model_initial(model, q, v);
    kt_data *data = kt_test_data(model);
    for (int i = 0; i < kt_model_nv(model); i++)
        v[i] += 0.1 * (i + 1);
    kt_fine("assemble", kt_state_assemble(model, data, 0.0, q, v, &e), &e);
    kt_fine("a", kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, x.a, &e), &e);
    kt_fine("reactions", kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, x.joint, NULL, &e), &e);
    kt_fine("mass", kt_dynamics_mass(model, data, q, x.mass, &e), &e);
    kt_fine("tau", kt_dynamics_inverse(model, data, q, v, x.a, NULL, x.tau, &e), &e);
    kt_fine("kinematics", kt_kinematics_update(model, data, q, v, x.a, &e), &e);
    x.energy[0] = kt_kinetic_energy(model, data);
    x.energy[1] = kt_potential_energy(model, data);
    x.energy[2] = kt_effect_energy(model, data, 0.0, q, v);
    return x;
}

KT_TEST(a_set_parameter_gives_the_bits_of_a_model_that_was_compiled_with_it) {
    for (int plan = 0; plan < KT_PLAN_COUNT; plan++) {
        kt_model *model = compile(NULL, (kt_plan)plan), *copy = copy_of(model);
        const answer before = ask(model);
        for (int k = 0; k < TRIALS; k++) {
            const trial *t = &trials[k];
            kt_model *other = compile(t, (kt_plan)plan);
            kt_parameter parameter;
            kt_error e;
            double old[KT_PARAMETER_MAX], now[KT_PARAMETER_MAX];
            kt_need_fine(t->name, kt_parameter_find(copy, t->name, &parameter, &e), &e);
            (void)kt_fine("get", kt_parameter_get(copy, &parameter, old, &e), &e);
            if (!set(copy, t))
                return;
            (void)kt_fine("get", kt_parameter_get(copy, &parameter, now, &e), &e);
            kt_check_true("it is read back", memcmp(now, t->values, (size_t)t->count * sizeof *now) == 0);
            const answer theirs = ask(other), ours = ask(copy);
            double most = 0.0, size = 0.0;
            for (int i = 0; i < kt_model_nv(model); i++) {
                most = fmax(most, fabs(ours.a[i] - theirs.a[i]));
                size = fmax(size, fabs(theirs.a[i]));
            }
            /* x + v s + a s^2 / 2 and a polynomial round differently; all others have equal bits */
            if (parameter.kind == KT_PARAMETER_LOOP_CURVE || parameter.kind == KT_PARAMETER_EFFECT_CURVE)
                kt_check_near(t->name, most, 0.0, 1e-12 * size);
            else
                kt_check_true(t->name, memcmp(&ours, &theirs, sizeof ours) == 0);
            kt_check_true("it matters", memcmp(&theirs, &before, sizeof before) != 0);
            if (parameter.kind != KT_PARAMETER_LOOP_CURVE && parameter.kind != KT_PARAMETER_EFFECT_CURVE) {
                const answer again =
                    kt_fine("back", kt_parameter_set(copy, &parameter, old, &e), &e) ? ask(copy) : ours;
                kt_check_true("and back", memcmp(&again, &before, sizeof before) == 0);
            } else {
                copy = copy_of(model);
            }
        }
        const answer after = ask(model);
        kt_check_true("the model it was copied from stays", memcmp(&after, &before, sizeof before) == 0);
    }
}

KT_TEST(names_that_do_not_exist_are_answered_with_the_nearest) {
    static const struct {
        const char *name, *words;
    } wrong[] = {
        {"laod.mass", "did you mean 'load'?"},
        {"load.mas", "did you mean 'mass'?"},
        {"effect coil.stifness", "'stiffness'?"},
        {"effect cool.stiffness", "did you mean 'coil'?"},
        {"loop drive.psition", "'position'?"},
        {"loop eye.position", "has no parameter 'position'"},
        {"mass", "write gravity, BODY.mass"},
        {"load.armature", "has no parameter 'armature'"},
        {"effect hold.joint", "has no parameter"},
        {"world.mass", "there is no body 'world'"},
        {"bodies.load.mass", "mean 'load.mass'?"},
        {"effects.coil.stiffness", "mean 'effect coil.stiffness'?"},
        {"loops.drive.position", "mean 'loop drive.position'?"},
        {"bodies.mass", "there is no body 'bodies'"},
    };
    kt_model *model = compile(NULL, KT_PLAN_AUTO);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        kt_parameter parameter = {.item = -7};
        kt_error e = {0};
        kt_check_equal_int(wrong[k].name, kt_parameter_find(model, wrong[k].name, &parameter, &e), KT_ERROR_ARGUMENT);
        kt_check_contains("words", e.message, wrong[k].words);
        kt_check_equal_int("untouched", parameter.item, -7);
    }
}

KT_TEST(numbers_that_cannot_be_are_rejected_and_nothing_changes) {
    static const struct {
        const char *name;
        double values[6];
    } wrong[] = {
        {"load.mass", {-1}},
        {"load.com", {0, (double)NAN, 0}},
        {"load.inertia", {1, 0.1, 0.1, 0, 0, 0}},
        {"crank.armature", {-0.1}},
        {"gravity", {0, (double)INFINITY, 0}},
        {"effect coil.stiffness", {-5}},
        {"effect mount.stiffness", {1, 1, 1, 1, 1, -1}},
        {"effect stop.lower", {1.5}},
        {"effect stop.upper", {-(double)INFINITY}},
        {"effect brake.static", {0.1}},
        {"effect floor.exponent", {0.5}},
        {"effect coil.length", {-0.5}},
        {"loop drive.position", {0, (double)NAN, 0, 0}},
    };
    kt_model *model = compile(NULL, KT_PLAN_AUTO), *copy = copy_of(model);
    const answer before = ask(copy);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        kt_parameter parameter;
        kt_error e = {0};
        kt_need_fine(wrong[k].name, kt_parameter_find(model, wrong[k].name, &parameter, &e), &e);
        kt_check_equal_int(wrong[k].name, kt_parameter_set(copy, &parameter, wrong[k].values, &e), KT_ERROR_MODEL);
        kt_check_true(e.message, e.message[0] != '\0' && e.where[0] != '\0');
        kt_check_equal_int("no copy", kt_parameter_set(model, &parameter, wrong[k].values, &e), KT_ERROR_ARGUMENT);
    }
    const answer after = ask(copy);
    kt_check_true("nothing has changed", memcmp(&after, &before, sizeof before) == 0);
}

/* A run in which a payload and a target change goes on as one that starts there with a model compiled so. */
KT_TEST(a_simulation_goes_on_with_what_is_set) {
    const trial *t = &trials[2];
    kt_model *model = compile(NULL, KT_PLAN_AUTO), *copy = copy_of(model), *other = compile(t, KT_PLAN_AUTO);
    kt_run run = kt_run_default();
    kt_parameter parameter;
    kt_error e;
    run.integrator = "dopri5";
    run.step = 1e-3;
    kt_simulation *one = kt_test_simulation(copy, &run, NULL);
    kt_simulation *two = kt_test_simulation(other, &run, NULL);
    kt_need_fine("advance", kt_simulation_advance(one, 0.1, &e), &e);
    kt_need_fine("find", kt_parameter_find(copy, t->name, &parameter, &e), &e);
    kt_fine("state",
            kt_simulation_set_state(two, kt_simulation_time(one), kt_simulation_positions(one),
                                    kt_simulation_velocities(one), &e),
            &e);
    kt_interpose_start();
    kt_fine("set", kt_simulation_set_parameter(one, copy, &parameter, t->values, &e), &e);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    kt_check_equal_int("another model", kt_simulation_set_parameter(two, copy, &parameter, t->values, &e),
                       KT_ERROR_ARGUMENT);
    kt_fine("advance", kt_simulation_advance(one, 0.2, &e), &e);
    kt_fine("advance", kt_simulation_advance(two, 0.2, &e), &e);
    KT_WORST error = kt_worst_make("positions");
    for (int i = 0; i < kt_model_nq(model); i++)
        kt_worst_near(&error, kt_simulation_positions(one)[i], kt_simulation_positions(two)[i], 1e-12, "%d", i);
}

/* A motion that was compiled at rest drives once it is set to move: its work done is the growth of the energy. */
/* The drive is a polynomial, or constant. The mass below zero is rejected when the other parameter has been set. */
KT_TEST(a_failed_change_leaves_every_bit_of_the_model) {
    static const trial rests = {"loop drive.position", 7, "60 deg", 0, {0}};
    for (int k = 0; k < 2 * TRIALS; k++) {
        const trial *t = &trials[k / 2];
        kt_model *copy = copy_of(compile(k % 2 ? &rests : NULL, KT_PLAN_AUTO));
        const size_t size = kt_model_size(copy);
        const uint64_t revision = copy->revision;
        char *before = malloc(size);
        kt_test_own(before, free);
        kt_simulation *simulation = kt_test_simulation(copy, NULL, NULL);
        kt_parameter_change changes[2] = {{.values = {0.0}}, {.values = {-1.0}}};
        kt_error e;
        memcpy(changes[0].values, t->values, sizeof t->values);
        memcpy(before, copy, size);
        kt_need_fine(t->name, kt_parameter_find(copy, t->name, &changes[0].parameter, &e), &e);
        kt_need_fine("mass", kt_parameter_find(copy, "ram.mass", &changes[1].parameter, &e), &e);
        kt_check_equal_int(t->name, kt_simulation_change(simulation, copy, changes, 2, NULL, &e), KT_ERROR_MODEL);
        kt_check_true("it has been set", copy->revision > revision);
        copy->revision = revision;
        kt_check_true("the model is as it was", memcmp(before, copy, size) == 0);
        kt_check_true("so are the numbers", memcmp(changes[0].values, t->values, sizeof t->values) == 0);
    }
}

KT_TEST(a_loop_at_rest_that_is_set_to_move_supplies_energy) {
    kt_model *model =
                 kt_test_model(&kt_test_scene("kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                                              "  - {name: arm, joint: {type: revolute, axis: y}, mass: 2, com: [1, "
                                              "0, 0], inertia: [0, 1, 1]}\n"
                                              "loops:\n  - {name: drive, type: motion, joint: arm, position: 0}\n")
                                    ->description,
                               NULL),
             *copy = copy_of(model);
    const trial to_move = {"loop drive.position", 0, "", 4, {0.0, 0.0, 3.0, 0.0}}; /* 3 t^2 / 2 */
    kt_run run = kt_run_default();
    kt_error e;
    run.record = KT_RECORD_BALANCE;
    run.integrator = "dopri5";
    if (!set(copy, &to_move))
        return;
    kt_simulation *simulation = kt_test_simulation(copy, &run, NULL);
    kt_need_fine("advance", kt_simulation_advance(simulation, 0.5, &e), &e);
    const double angle = 3.0 * 0.5 * 0.5 / 2.0, rate = 3.0 * 0.5,
                 energy = 0.5 * 3.0 * rate * rate - 2.0 * 9.81 * sin(angle);
    kt_check_near("position", kt_simulation_positions(simulation)[0], angle, 1e-9);
    kt_check_near("work of the drive, J", kt_simulation_work(simulation).supplied, energy, 1e-6);
}

/* Numbers that a description must contain may be set to no effect: a servo without gains, stops at infinity. */
KT_TEST(an_effect_is_switched_off_by_its_numbers) {
    static const struct {
        const char *name;
        double value;
    } off[] = {{"effect hold.stiffness", 0.0},
               {"effect hold.damping", 0.0},
               {"effect stop.lower", -(double)INFINITY},
               {"effect stop.upper", (double)INFINITY}};
    kt_model *model = compile(NULL, KT_PLAN_AUTO), *copy = copy_of(model);
    kt_parameter parameter;
    kt_error e;
    for (size_t k = 0; k < sizeof off / sizeof *off; k++) {
        double now = -1.0;
        kt_fine("find", kt_parameter_find(copy, off[k].name, &parameter, &e), &e);
        kt_fine(off[k].name, kt_parameter_set(copy, &parameter, &off[k].value, &e), &e);
        (void)kt_fine("get", kt_parameter_get(copy, &parameter, &now, &e), &e);
        kt_check_true("it is read back", now == off[k].value);
    }
}

static const char slider_crank[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg}, mass: 1,\n"
    "     shape: {type: rod, to: [0.3, 0, 0]}}\n"
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [0.3, 0, 0], position: -75 deg}, mass: 2,\n"
    "     shape: {type: rod, to: [1, 0, 0]}, markers: {end: [1, 0, 0]}}\n"
    "  - {name: ram, joint: {type: prismatic, axis: x, position: 1.1}, mass: 5}\n"
    "loops:\n"
    "  - {name: eye, type: revolute, between: [rod.end, ram], axis: z}\n";

static void assemble_from(const kt_model *model, double q[3]) {
    double v[3] = {0.0, 0.0, 0.0};
    kt_error e;
    memcpy(q, (const double[]){1.0, -1.2, 1.15}, 3 * sizeof *q);
    kt_data *data = kt_test_data(model);
    kt_fine("assemble", kt_state_assemble(model, data, 0.0, q, v, &e), &e);
}

/* Assembly keeps the position of a joint while the joint is held, like a model that was compiled with the joint held.
 * It moves the joint otherwise. */
KT_TEST(assembly_keeps_what_is_set_to_be_held) {
    static const char *const names[] = {"ram"};
    kt_error e;
    kt_description slider = kt_test_scene(slider_crank)->description;
    kt_model *model = kt_test_model(&slider, NULL);
    slider.hold = names;
    slider.hold_count = 1;
    kt_model *held = kt_test_model(&slider, NULL);
    kt_model *copy = copy_of(model);
    kt_parameter parameter;
    double free_q[3], held_q[3], set_q[3], back_q[3], hold = 0.0;
    assemble_from(model, free_q);
    assemble_from(held, held_q);
    kt_fine("find", kt_parameter_find(copy, "ram.hold", &parameter, &e), &e);
    (void)kt_fine("get", kt_parameter_get(copy, &parameter, &hold, &e), &e);
    kt_check_true("it is free", hold == 0.0);
    kt_fine("set", kt_parameter_set(copy, &parameter, (const double[]){1.0}, &e), &e);
    (void)kt_fine("get", kt_parameter_get(copy, &parameter, &hold, &e), &e);
    kt_check_true("it is held", hold == 1.0);
    assemble_from(copy, set_q);
    kt_fine("set", kt_parameter_set(copy, &parameter, (const double[]){0.0}, &e), &e);
    assemble_from(copy, back_q);
    kt_check_true("a free ram moves", fabs(free_q[2] - 1.15) > 1e-4);
    kt_check_true("a held ram stays", set_q[2] == 1.15);
    kt_check_true("bits of a model compiled so", memcmp(set_q, held_q, sizeof set_q) == 0);
    kt_check_true("and back", memcmp(back_q, free_q, sizeof back_q) == 0);
}

/* Each name of a parameter of the large model, in a small one and in a copy of it: none reads or writes there. */
KT_TEST(parameters_of_another_model_are_rejected) {
    static const char *const names[] = {"hand.mass",          "arm.com",
                                        "hand.armature",      "slide.hold",
                                        "effect coil.length", "effect mount.stiffness",
                                        "effect hold.target", "effect push.value",
                                        "loop drive.position"};
    kt_model *model = compile(NULL, KT_PLAN_AUTO);
    kt_model *small = kt_test_model(&kt_test_scene(slider_crank)->description, NULL);
    kt_error e;
    kt_model *copy = copy_of(small);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        double now[KT_PARAMETER_MAX] = {7.0};
        kt_parameter parameter;
        kt_need_fine(names[i], kt_parameter_find(model, names[i], &parameter, &e), &e);
        kt_note("%s", names[i]);
        kt_check_equal_int("get", kt_parameter_get(small, &parameter, now, &e), KT_ERROR_ARGUMENT);
        kt_check_contains("what", e.message, "does not belong to this model");
        kt_check_true("untouched", now[0] == 7.0);
        kt_check_equal_int("set", kt_parameter_set(copy, &parameter, now, &e), KT_ERROR_ARGUMENT);
        parameter.count++;
        kt_check_equal_int("of another length", kt_parameter_get(model, &parameter, now, &e), KT_ERROR_ARGUMENT);
    }
}

/* A rejection names the item of the parameter. */
KT_TEST(numbers_that_cannot_be_are_told_with_the_name_of_their_item) {
    static const struct {
        const char *name, *where;
    } asked[] = {{"gravity", "gravity"},
                 {"hand.mass", "hand"},
                 {"slide.hold", "body 'slide'"},
                 {"effect coil.stiffness", "coil"},
                 {"effect hold.target", "effect 'hold'"},
                 {"effect push.value", "effect 'push'"},
                 {"loop drive.position", "loop 'drive'"}};
    const double wrong[KT_PARAMETER_MAX] = {(double)NAN, 0.0, 0.0, 0.0, 0.0, 0.0};
    kt_model *model = compile(NULL, KT_PLAN_AUTO), *copy = copy_of(model);
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        kt_parameter parameter;
        kt_error e;
        kt_need_fine(asked[i].name, kt_parameter_find(copy, asked[i].name, &parameter, &e), &e);
        kt_check_equal_int(asked[i].name, kt_parameter_set(copy, &parameter, wrong, &e), KT_ERROR_MODEL);
        kt_check_contains("where", e.where, asked[i].where);
    }
}
