/* The report of a run on the terminal: its counts, its energy, and the messages of a run that ends early. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>

static const char pendulum[] = "kinetree: 1\n"
                               "gravity: [0, -9.81, 0]\n"
                               "bodies:\n"
                               "  - name: rod\n"
                               "    mass: 1\n"
                               "    shape: {type: rod, to: [0, -1, 0]}\n"
                               "    joint: {type: revolute, axis: z, position: 60 deg}\n";

/* A ball whose hard contact is a loop of the model, although the scene has no loops. */
KT_TEST(report_counts_hard_contacts_apart_from_loops) {
    kt_write_file("ball.yaml", "kinetree: 1\n"
                               "gravity: [0, 0, -9.81]\n"
                               "bodies:\n"
                               "  - name: ball\n"
                               "    joint: {type: free, position: {position: [0, 0, 1]}}\n"
                               "    mass: 1\n"
                               "    shape: {type: sphere, radius: 0.1}\n"
                               "effects:\n"
                               "  - {type: contact, point: ball, radius: 0.1, plane: world, restitution: 0.5}\n"
                               "simulate: {duration: 1}\n");
    const kt_ran ran = kt_shell("$K run ball.yaml --out /dev/null");
    kt_check_equal_int("code", ran.code, 0);
    kt_check_contains("counts", ran.err, "  1 body, 1 hard contact, 6 degrees of freedom, ");
    kt_check_equal_int("loops", kt_count_of(ran.err, "loop"), 0);
    kt_expect(0, "  1 body, 1 hard contact, 6 degrees of freedom, ",
              "$K run ball.yaml --set effects[0].friction=0.5 --out /dev/null");
}

/* Its energy is 9.81 / 2 (1 - cos 60 deg) J below that of the start in its lowest position. The report says of which
 * instant the energy is, unless the energy is constant. */
KT_TEST(report_names_the_instant_of_an_energy_that_changes) {
    kt_write_file("rod.yaml", pendulum);
    kt_expect(0, "  total energy -2.4525 J, drift at most ", "$K run rod.yaml --out /dev/null");
    kt_expect(0, "  total energy -2.4525 J at the start, change at most 2.5 J\n",
              "(cat rod.yaml; echo 'effects: [{type: joint_damper, joint: rod, damping: 20}]') >damped.yaml; "
              "$K run damped.yaml --duration 60 --out /dev/null");
}

/* Only the first record has an energy, so that no change is known. */
KT_TEST(report_of_one_record_has_no_change_of_energy) {
    kt_write_file("rod.yaml", pendulum);
    const kt_ran ran = kt_shell("(cat rod.yaml; echo 'effects: [{type: joint_spring, joint: rod, stiffness: 1e8}]') "
                                ">stiff.yaml; $K run stiff.yaml --step 0.01 --out o.csv");
    kt_check_equal_int("code", ran.code, 4);
    kt_check_contains("energy", ran.err, "J at the start\n");
    kt_check_equal_int("change", kt_count_of(ran.err, "change at most"), 0);
}

/* sqrt(position) ends where the rod passes the vertical. The remedy is one for the formula, not for its numbers. */
KT_TEST(formula_outside_its_domain_has_a_remedy_of_its_own) {
    kt_write_file("rod.yaml", pendulum);
    const kt_ran ran = kt_shell("(cat rod.yaml; echo 'effects: [{name: f, type: expression, joint: rod, force: "
                                "\"sqrt(position.rod)\"}]') >root.yaml; $K run root.yaml --quiet --out o.csv");
    kt_check_equal_int("code", ran.code, 4);
    kt_check_contains("fault", ran.err, "effect 'f' (expression) on joint 'rod', t = 0.");
    kt_check_contains("remedy", ran.err, "is not defined); bound the argument, with max(x, 0) or clamp(x, a, b)");
    kt_check_contains("steps", ran.err, "(smaller steps did not help)\n");
    kt_check_equal_int("the engine's own words", kt_count_of(ran.err, "right-hand side"), 0);
}

/* Gravity along the axis of the only joint. Hanging straight down is an equilibrium, and a spring may hold a scene. */
KT_TEST(run_in_which_nothing_moves_is_doubted) {
    static const char words[] = "warning: nothing has moved: the scene starts at rest, and gravity does not accelerate";
    kt_write_file("rod.yaml", pendulum);
    kt_expect(0, words, "$K run rod.yaml --set gravity=[0,0,-9.81] --out /dev/null");
    kt_expect(0, "has neither effects nor gravity. Give the scene gravity",
              "$K run rod.yaml --set gravity=[0,0,0] --out /dev/null");
    kt_expect(0, "does not accelerate it; compare gravity with the axes of the joints",
              "$K check rod.yaml --set gravity=[0,0,-9.81]");
    kt_expect(0, words, "$K run rod.yaml --set bodies.rod.joint.position=0 --out /dev/null");
    kt_ran ran = kt_shell("$K run rod.yaml --set gravity=[0,0,0] --set bodies.rod.joint.velocity=1 --out /dev/null");
    kt_check_equal_int("a rod that turns", kt_count_of(ran.err, "nothing has moved"), 0);
    ran = kt_shell("(cat rod.yaml; echo 'effects: [{type: joint_spring, joint: rod, stiffness: 1}]') >held.yaml; "
                   "$K run held.yaml --set bodies.rod.joint.position=0 --out /dev/null");
    kt_check_equal_int("a spring that exerts no force", kt_count_of(ran.err, "nothing has moved"), 1);
    ran = kt_shell("(cat rod.yaml; echo 'effects: [{type: joint_friction, joint: rod, coulomb: 100, stick: true}]') "
                   ">held.yaml; $K run held.yaml --set bodies.rod.joint.position=1 --out /dev/null");
    kt_check_equal_int("a brake that holds the rod", kt_count_of(ran.err, "nothing has moved"), 0);
}

KT_TEST(run_with_gravity_in_millimetres_is_doubted) {
    kt_write_file("rod.yaml", pendulum);
    kt_expect(0, "warning: gravity is 9810 m/s^2, a thousand times that of the earth. Give all lengths in metres",
              "$K run rod.yaml --set gravity=[0,-9810,0] --duration 0.1 --out /dev/null");
    const kt_ran ran = kt_shell("$K run rod.yaml --duration 0.1 --out /dev/null");
    kt_check_equal_int("on the earth", kt_count_of(ran.err, "warning"), 0);
}

/* `run` rejects --integrator with `contact: steps`. */
KT_TEST(energy_of_time_stepping_is_mended_without_an_integrator) {
    kt_write_file("swing.yaml",
                  "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, position: 1}, mass: 1}]\n"
                  "effects:\n  - {type: joint_spring, joint: a, stiffness: 100}\n"
                  "  - {type: joint_limit, joint: a, lower: -0.5, restitution: 0.5}\n"
                  "simulate: {duration: 2, contact: steps, step: 0.05}\noutput: {record: [position, balance]}\n");
    const kt_ran ran = kt_shell("$K run swing.yaml --out /dev/null");
    kt_check_contains("error", ran.err, "the balance of energies");
    kt_check_contains("remedy", ran.err, "Take much smaller steps, or events: --set simulate.contact=events");
    kt_expect(0, "2 s simulated",
              "$K run swing.yaml --set simulate.contact=events --step 1e-3 --integrator rk4 --out /dev/null");
}

/* 90 rad are 14.3 turns. */
KT_TEST(run_warns_of_rotations_that_may_be_degrees) {
    kt_write_file(
        "turned.yaml",
        "kinetree: 1\nbodies:\n"
        "  - name: arm\n"
        "    joint: {type: revolute, rotation: {rpy: [0, 90, 90 deg]}, velocity: 1}\n"
        "    mass: 1\n"
        "    shape: {type: box, size: [1, 1, 1], rotation: {axis: [1, 0, 0], angle: 45}}\n"
        "    markers: {tool: {at: [1, 0, 0], rotation: {euler: {sequence: 313, angles: [0.5, 6, 30]}}}}\n"
        "  - {name: disc, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
        "loops: [{name: pin, type: orthogonal, axis: x, between: [arm, {body: disc, rotation: {rpy: [180, 0, 0]}}]}]\n"
        "effects: [{type: bushing, between: [{body: arm, rotation: {rpy: [0, 0, 270]}}, world]}]\n"
        "simulate: {duration: 0.01}\n");
    const kt_ran ran = kt_shell("$K run turned.yaml --out /dev/null");
    kt_check_contains("joint", ran.err,
                      "body 'arm': joint.rotation.rpy[1]: 90 is in radians, 14.3 turns. Write '90 deg' if degrees are");
    kt_check_contains("shape", ran.err, "body 'arm': shape.rotation.angle: 45 is in radians");
    kt_check_contains("marker", ran.err, "body 'arm': markers.tool.rotation.euler.angles[2]: 30 is in radians");
    kt_check_contains("loop", ran.err, "loop 'pin': between[1].rotation.rpy[0]: 180 is in radians");
    kt_check_contains("effect", ran.err, "effect 'effect[0]': between[0].rotation.rpy[2]: 270 is in radians");
    kt_check_equal_int("warnings", kt_count_of(ran.err, "is in radians"), 5);
}

/* Effects without a number, and effects on the ground. One with a number that an event sets is none of them. */
KT_TEST(run_and_check_warn_of_effects_without_a_force) {
    static const char bodies[] = "kinetree: 1\nbodies:\n"
                                 "  - {name: plate, shape: {type: sphere, radius: 1}}\n"
                                 "  - {name: arm, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1], "
                                 "markers: {tip: [1, 0, 0]}}\n"
                                 "simulate: {duration: 0.01}\n";
    char text[1600];
    (void)snprintf(text, sizeof text, "%s%s", bodies,
                   "effects:\n"
                   "  - {type: spring, between: [world, arm.tip], length: 0.5}\n"
                   "  - {name: bearing, type: joint_friction, joint: arm}\n"
                   "  - {type: drag, on: arm}\n"
                   "  - {type: bushing, between: [world, arm]}\n"
                   "  - {type: force, at: plate, value: [1, 0, 0]}\n"
                   "  - {type: spring, between: [world, plate], stiffness: 3}\n"
                   "  - {type: force, at: arm.tip, value: [0, 0, 0]}\n"
                   "  - {type: joint_damper, joint: arm, damping: 0}\n");
    kt_write_file("idle.yaml", text);
    kt_ran ran = kt_shell("$K run idle.yaml --out /dev/null");
    kt_check_contains(
        "spring", ran.err,
        "effects[0] (spring) exerts no force: all of its numbers are 0. Give it `stiffness` or `damping`");
    kt_check_contains("friction", ran.err, "'bearing' (joint_friction) exerts no force");
    kt_check_contains("drag", ran.err, "effects[2] (drag) exerts no force");
    kt_check_contains("bushing", ran.err, "effects[3] (bushing) exerts no force");
    kt_check_contains(
        "force", ran.err,
        "effects[4] (force) moves nothing: its end is fixed to the world. Let it act on a body that moves");
    kt_check_contains("fixed spring", ran.err, "effects[5] (spring) moves nothing: both its ends are fixed");
    kt_check_equal_int("warnings", kt_count_of(ran.err, "exerts no force") + kt_count_of(ran.err, "moves nothing"), 6);
    kt_check_contains("check", kt_shell("$K check idle.yaml").out, "idle.yaml: ok, 6 warnings");
    (void)snprintf(text, sizeof text, "%s%s", bodies,
                   "parameters: {k: 0}\neffects: [{type: joint_spring, joint: arm, stiffness: =k}]\n"
                   "events: [{name: lock, when: \"position.arm > 0.005\", then: {set: {k: 10}}}]\n");
    kt_write_file("set.yaml", text);
    kt_check_contains("check", kt_shell("$K check set.yaml").out, "set.yaml: ok\n");
    kt_check_equal_int("warnings", kt_count_of(kt_shell("$K run set.yaml --out /dev/null").err, "exerts no force"), 0);
}

/* A wrong digit of the interval is reported before the file grows. The run ends after a hundred records. */
KT_TEST(run_warns_of_very_many_records) {
    kt_write_file("rod.yaml", "kinetree: 1\nbodies: [{name: rod, joint: {type: revolute, velocity: 1}, mass: 1, "
                              "inertia: [1, 1, 1]}]\nsimulate: {duration: 10, until: t > 1e-7}\n");
    kt_expect(0, "1e+10 records are to be written, one every 1e-09 s. Give a longer --interval",
              "$K run rod.yaml --interval 1e-9 --out /dev/null");
    kt_check_equal_int("fewer",
                       kt_count_of(kt_shell("$K run rod.yaml --interval 1e-6 --out /dev/null").err, "records are"), 0);
}

KT_TEST(check_warns_of_meshes_that_cannot_be_read) {
    kt_write_file("bad.obj", "v 0 0\n");
    kt_write_file("good.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    kt_write_file("mesh.yaml", "kinetree: 1\nbodies: [{name: rod, joint: {type: revolute, velocity: 1}, mass: 1, "
                               "inertia: [1, 1, 1]}]\nmeshes: [{body: rod, file: good.obj}, {body: rod, file: "
                               "none.stl}, {body: rod, file: bad.obj}]\n");
    const kt_ran ran = kt_shell("$K check mesh.yaml");
    kt_check_equal_int("code", ran.code, 0);
    kt_check_contains("missing", ran.err,
                      "warning: meshes[1]: none.stl: cannot be read: No such file or directory; mend");
    kt_check_contains("wrong", ran.err, "bad.obj: a vertex of the mesh has less than three numbers; mend");
    kt_check_contains("count", ran.out, "ok, 2 warnings");
}

/* URDF has radians alone, and rejects '-30 deg'. */
KT_TEST(rotations_of_robots_are_advised_in_radians) {
    kt_write_file("r.urdf", "<robot name=\"r\"><link name=\"base\"/><link name=\"a\"><inertial><mass value=\"1\"/>"
                            "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
                            "<joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"a\"/>"
                            "<origin rpy=\"0 -30 0\"/><axis xyz=\"0 1 0\"/></joint></robot>");
    static const char *const files[] = {"r.urdf", "- < r.urdf", "r.txt"};
    kt_expect(0, "copied", "cp r.urdf r.txt && echo copied >&2");
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        kt_expect(0,
                  "body 'a': joint.rotation.rpy[1]: -30 is in radians, -4.77 turns. Write -0.523598776, in radians, if "
                  "degrees are meant",
                  "$K run --duration 0.01 --out /dev/null %s", files[i]);
    kt_write_file("turned.yaml",
                  "kinetree: 1\nbodies: [{name: arm, joint: {type: revolute, position: 120, velocity: 1}, "
                  "mass: 1, inertia: [1, 1, 1]}]\nsimulate: {duration: 0.01}\n");
    kt_expect(0, "Write '120 deg' if degrees are meant", "$K run - --out /dev/null < turned.yaml");
}

/* A limit of 90 rad is 14 turns away: the joint would never meet it. */
KT_TEST(run_warns_of_limits_and_targets_that_may_be_degrees) {
    static const struct {
        const char *effect, *words;
    } cases[] = {
        {"type: joint_limit, joint: arm, stiffness: 9, upper: 90", "joint_limit of 'arm': upper: 90 is in radians"},
        {"type: joint_limit, joint: arm, restitution: 0, lower: -90", "joint_limit of 'arm': lower: -90 is in radians"},
        {"type: servo, joint: arm, stiffness: 9, target: 45", "servo of 'arm': target: 45 is in radians"},
        {"type: joint_spring, joint: 'table[2]', stiffness: 9, rest: 45",
         "joint_spring of 'table[2]': rest: 45 is in radians, 7.16 turns. Write '45 deg' if degrees are meant"},
        {"type: joint_spring, joint: 'table[0]', stiffness: 9, rest: 45", NULL},
        {"type: joint_limit, joint: arm, stiffness: 9, upper: 90 deg", NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[600];
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\nbodies:\n"
                       "  - {name: hub, joint: {type: revolute, name: arm, velocity: 1}, mass: 1, inertia: [1, 1, 1]}\n"
                       "  - {name: table, joint: {type: planar}, mass: 1, inertia: [1, 1, 1]}\n"
                       "effects: [{%s}]\nsimulate: {duration: 0.01}\n",
                       cases[i].effect);
        kt_write_file("units.yaml", text);
        const kt_ran ran = kt_shell("$K run units.yaml --out /dev/null");
        kt_check_equal_int("code", ran.code, 0);
        if (cases[i].words != NULL)
            kt_check_contains("warning", ran.err, cases[i].words);
        kt_check_equal_int("warnings", kt_count_of(ran.err, "is in radians"), cases[i].words != NULL);
    }
}
