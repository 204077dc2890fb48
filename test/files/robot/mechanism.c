/* A mechanism from a file in one call: a scene with an event, a robot, and files that are wrong. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "kinetree/import.h"

#include <math.h>
#include <stdio.h>

static const char scene_text[] = "kinetree: 1\n"
                                 "gravity: [0, 0, -9.81]\n"
                                 "bodies:\n"
                                 "  - name: rod\n"
                                 "    joint: {type: revolute, axis: y, position: 20 deg}\n"
                                 "    mass: 1\n"
                                 "    shape: {type: rod, to: [0, 0, -1]}\n"
                                 "simulate: {duration: 2, integrator: dopri5, tolerance: 1e-8}\n"
                                 "events:\n"
                                 "  - {name: lowest, when: position.rod, then: stop}\n";
static const char robot_text[] =
    "<robot name='arm'><link name='base'/><link name='hand'><inertial><mass value='2'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='continuous'>"
    "<parent link='base'/><child link='hand'/><axis xyz='0 0 1'/></joint></robot>";

/* Writes a file of the build's folder; its name is `name`. */
static const char *written(const char *name, const char *text) {
    FILE *file = fopen(name, "w");
    kt_check_true("written", file && fputs(text, file) >= 0 && fclose(file) == 0);
    return name;
}

KT_TEST(one_call_reads_a_scene_and_runs_it_with_its_events) {
    kt_mechanism m;
    kt_error e = {0};
    const char *path = written("import-mechanism.yaml", scene_text);
    const kt_status status = kt_mechanism_load(path, NULL, NULL, &m, &e);
    kt_check_equal_int(e.message, status, KT_OK);
    if (status != KT_OK)
        return;
    kt_check_near("start", kt_simulation_positions(m.simulation)[0], acos(-1.0) / 9.0, 1e-15);
    kt_check_equal_int("runs", kt_simulation_advance(m.simulation, 2.0, &e), KT_OK);
    kt_check_true("the event has stopped it", kt_simulation_stopped(m.simulation) != NULL);
    kt_check_near("at the lowest position", kt_simulation_positions(m.simulation)[0], 0.0, 1e-8); /* its tolerance */
    kt_mechanism_free(&m);
    kt_check_true("freed", !m.model && !m.simulation);
    kt_mechanism_free(&m);
    kt_mechanism_free(NULL);
    (void)remove(path);
}

/* A ball falls from 0.1 m for 0.1414 s. Steps over contacts end on their grid, although this instant is not on it.
 * Steps that end at events also end at the impact. */
KT_TEST(a_scene_with_contact_steps_takes_fixed_steps_across_an_impact) {
    static const char text[] = "kinetree: 1\n"
                               "gravity: [0, 0, -10]\n"
                               "bodies: [{name: ball, joint: {type: prismatic, axis: z, position: 0.1}, mass: 1}]\n"
                               "effects: [{name: floor, type: contact, point: ball, plane: world, restitution: 0}]\n"
                               "simulate: {duration: 1, step: 0.01, contact: steps}\n";
    kt_mechanism m;
    kt_error e = {0};
    const char *path = written("import-mechanism-steps.yaml", text);
    kt_status status = kt_mechanism_load(path, NULL, NULL, &m, &e);
    kt_check_equal_int(e.message, status, KT_OK);
    if (status != KT_OK)
        return;
    for (int k = 1; k <= 20 && status == KT_OK; k++) {
        status = kt_simulation_step(m.simulation, HUGE_VAL, &e);
        kt_check_near("time", kt_simulation_time(m.simulation), 0.01 * k, 1e-15);
    }
    kt_check_equal_int(e.message, status, KT_OK);
    kt_check_near("on the floor", kt_simulation_positions(m.simulation)[0], 0.0, 1e-9);
    kt_mechanism_free(&m);
    (void)remove(path);
}

/* A robot's file names no method: the default, unless a run is given. Its parameters can be set. */
KT_TEST(one_call_reads_a_robot_whose_parameters_can_be_set) {
    kt_mechanism m;
    kt_error e = {0};
    kt_parameter mass;
    kt_run run = kt_run_default();
    const char *path = written("import-mechanism.urdf", robot_text);
    kt_status status = kt_mechanism_load(path, NULL, NULL, &m, &e);
    kt_check_equal_int(e.message, status, KT_OK);
    if (status != KT_OK)
        return;
    status = kt_simulation_step(m.simulation, HUGE_VAL, &e);
    kt_check_above("a step", kt_simulation_time(m.simulation), 1e-9);
    status = kt_parameter_find(m.model, "hand.mass", &mass, &e) ||
             kt_simulation_set_parameter(m.simulation, m.model, &mass, (double[]){3.0}, &e);
    kt_check_equal_int("set", status, KT_OK);
    kt_check_near("mass", kt_body_mass(m.model, kt_body_find(m.model, "hand")), 3.0, 0.0);
    kt_mechanism_free(&m);
    run.integrator = "dopri5";
    run.step = 0.25;
    status = kt_mechanism_load(path, NULL, &run, &m, &e) || kt_simulation_step(m.simulation, HUGE_VAL, &e);
    kt_check_equal_int(e.message, status, KT_OK);
    kt_check_near("a step that was asked for", kt_simulation_time(m.simulation), 0.25, 0.0);
    kt_mechanism_free(&m);
    (void)remove(path);
}

KT_TEST(what_cannot_be_loaded_is_told_and_leaves_the_output) {
    kt_mechanism m = {.model = NULL};
    kt_error e = {0};
    const char *path = written("import-mechanism-bad.yaml", "kinetree: 1\nbodies: [{name: a, mass: -1}]\n");
    kt_check_equal_int("a mass", kt_mechanism_load(path, NULL, NULL, &m, &e), KT_ERROR_MODEL);
    kt_check_contains("where", e.where, "import-mechanism-bad.yaml:2");
    (void)remove(path);
    kt_check_equal_int("no file", kt_mechanism_load("none.urdf", NULL, NULL, &m, &e), KT_ERROR_FILE);
    kt_run run = kt_run_default();
    run.integrator = "rk5";
    run.step = 1.0;
    path = written("import-mechanism.urdf", robot_text);
    kt_check_equal_int("a method", kt_mechanism_load(path, NULL, &run, &m, &e), KT_ERROR_ARGUMENT);
    kt_check_true("untouched", !m.model && !m.simulation && !m.data);
    (void)remove(path);
}
