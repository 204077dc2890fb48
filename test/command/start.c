/* Reports of the command on the start state of a scene: values that assembly moved, loops that stay open, and doubtful
 * values that `check` finds. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

typedef struct four_bar {
    const char *gravity, *axis, *coupler_axis, *crank, *coupler, *rocker, *at, *mass, *more;
} four_bar;

static const four_bar usual = {.gravity = "[0, -9.81, 0]",
                               .axis = "z",
                               .crank = ", position: 60 deg, velocity: 3",
                               .coupler = "",
                               .rocker = "",
                               .at = "2.5",
                               .mass = "mass: 1",
                               .more = ""};

/* The four-bar of README, with a free choice of the given values. */
static void write_four_bar(const four_bar *f) {
    char text[2048];
    snprintf(text, sizeof text,
             "kinetree: 1\ngravity: %s\nbodies:\n"
             "  - {name: crank, joint: {type: revolute, axis: %s%s}, %s, shape: {type: rod, to: [1, 0, 0]}}\n"
             "  - {name: coupler, parent: crank, joint: {type: revolute, axis: %s, at: [1, 0, 0]%s}, %s,\n"
             "     shape: {type: rod, to: [2, 0, 0]}, markers: {tip: [2, 0, 0]}}\n"
             "  - {name: rocker, joint: {type: revolute, axis: %s, at: [%s, 0, 0]%s}, %s,\n"
             "     shape: {type: rod, to: [1.5, 0, 0]}, markers: {tip: [1.5, 0, 0]}}\n"
             "loops: [{name: close, type: revolute, between: [coupler.tip, rocker.tip]}]\n"
             "%ssimulate: {duration: 0.01}\n",
             f->gravity, f->axis, f->crank, f->mass, f->coupler_axis != NULL ? f->coupler_axis : f->axis, f->coupler,
             f->mass, f->axis, f->at, f->rocker, f->mass, f->more);
    kt_write_file("f.yaml", text);
}

KT_TEST(given_values_that_can_stay_do) {
    write_four_bar(&usual);
    kt_ran ran = kt_shell("$K run f.yaml --out - --summary f.json");
    kt_check_near("crank", kt_csv_number(ran.out, 1, kt_csv_column(ran.out, "position.crank")), pi / 3.0, 4.5e-16);
    kt_check_near("its rate", kt_csv_number(ran.out, 1, kt_csv_column(ran.out, "velocity.crank")), 3.0, 0.0);
    kt_check_true("nothing to tell", strstr(ran.err, "assembly") == NULL);
    json_t *root = kt_json(kt_read_file("f.json"));
    kt_check_equal_int("moved", (long long)json_array_size(kt_json_find(root, "moved")), 0);
    json_decref(root);
}

KT_TEST(moved_values_are_told_with_what_hold_would_keep) {
    four_bar f = usual;
    f.coupler = ", position: -50 deg";
    f.rocker = ", position: 80 deg";
    write_four_bar(&f);
    kt_ran ran = kt_shell("$K run f.yaml --out - --summary f.json");
    const double crank = kt_csv_number(ran.out, 1, kt_csv_column(ran.out, "position.crank"));
    char line[80];
    snprintf(line, sizeof line, "  crank: position from 60 deg to %.6g deg\n", crank * 180.0 / pi);
    kt_check_contains("what", ran.err, line);
    kt_check_contains("how to keep it", ran.err, "'initial: {hold: [JOINT]}' would keep crank");
    json_t *root = kt_json(kt_read_file("f.json"));
    kt_check_text("joint", json_string_value(kt_json_find(root, "moved[0].joint")), "crank");
    kt_check_text("part", json_string_value(kt_json_find(root, "moved[0].part")), "position");
    kt_check_near("from", kt_json_at(root, "moved[0].from"), pi / 3.0, 4.5e-16);
    kt_check_near("to", kt_json_at(root, "moved[0].to"), crank, 0.0);
    json_decref(root);
    static const char *const others[] = {"check f.yaml",
                                         "info f.yaml",
                                         "evaluate f.yaml",
                                         "modes f.yaml",
                                         "equilibrium f.yaml",
                                         "stability f.yaml",
                                         "accuracy f.yaml --duration 0.01 --budget 0.1"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        ran = kt_shell("$K %s", others[i]);
        kt_check_contains(others[i], ran.err, line);
        kt_check_contains("who tells it", ran.err,
                          i == 0 ? "f.yaml: warning: to close the loops" : "kinetree: to close");
    }
    ran = kt_shell("$K run f.yaml --quiet --out /dev/null");
    kt_check_text("--quiet", ran.err, "");
}

KT_TEST(open_loops_are_told_equation_by_equation) {
    four_bar f = usual;
    f.at = "5.5"; /* 1 m out of reach, by 4.5 m of bars */
    f.crank = "";
    write_four_bar(&f);
    kt_expect(3, "loop 'close' (revolute), equation by equation: 1, 0, 0 m; 0, 0 deg", "$K check f.yaml");
    kt_expect(3,
              "  they close if 'coupler' is more than 1 m longer from its joint to the end of loop 'close': more than "
              "3 m, not 2 m\n",
              "$K run f.yaml");
    kt_expect(3,
              "  they close if the joint of 'rocker' on the world is more than 1 m nearer to the other one: less than "
              "4.5 m, not 5.5 m\n",
              "$K check f.yaml");
    f = usual;
    f.coupler_axis = "x"; /* which leaves the plane of the others */
    f.more = "initial: {hold: [crank]}\n";
    write_four_bar(&f);
    kt_expect(3, "  they close with 'axis: z' in the joint of 'coupler'\n", "$K check f.yaml");
    f = usual;
    f.axis = "y";
    f.gravity = "[0, 0, -9.81]";
    write_four_bar(&f);
    kt_expect(3, "they close with 'axis: y' in loop 'close'", "$K run f.yaml");
    f = usual;
    f.rocker = ", position: 10 deg";
    f.more = "initial: {hold: [crank, rocker]}\n";
    write_four_bar(&f);
    kt_expect(3, "they close if 'rocker' is not in 'initial: hold'", "$K info f.yaml");
}

/* A coupling and two drives agree at zero. The rates of the drives have the ratio 1/2, and the coupling demands 2. */
KT_TEST(velocities_that_contradict_each_other_are_told_as_such) {
    static const char scene[] = "kinetree: 1\nbodies:\n"
                                "  - {name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                                "  - {name: b, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                                "loops:\n"
                                "  - {name: gear, type: coupling, coefficients: {a: 1, b: -2}}\n"
                                "  - {name: one, type: motion, joint: a, position: t}\n"
                                "  - {name: two, type: motion, joint: b, position: 2*t}\n";
    kt_write_file("drives.yaml", scene);
    const kt_ran ran = kt_shell("$K check drives.yaml");
    kt_check_equal_int("exit code", ran.code, 3);
    kt_check_contains("what", ran.err, "the initial velocities contradict the loops");
    kt_check_contains("cause", ran.err, "  the positions close, but loops and held joints prescribe velocities");
    kt_check_contains("remedy", ran.err, "  the others agree without loop 'two'\n");
    kt_check_equal_int("no bars", kt_count_of(ran.err, "bars lie in line"), 0);
    kt_check_equal_int("no lengths", kt_count_of(ran.err, "check the lengths"), 0);
    kt_expect(0, NULL, "sed 's/2[*]t/t\\/2/' drives.yaml | $K check -");
}

/* A door whose second hinge is off by so much across the first one's axis, and not along any length from joint to end.
 * The reported place closes it for any size. */
KT_TEST(ends_of_loops_that_are_apart_are_told_where_to_go) {
    static const double apart[] = {1e-8, 1e-6, 1e-3};
    static const char door[] =
        "kinetree: 1\nbodies:\n"
        "  - {name: frame, joint: {type: fixed, at: [0.1, 0, 0]}}\n"
        "  - {name: door, joint: {type: revolute, axis: z, at: [0.3, 0, 0]}, mass: 2, inertia: [0.1, 0.1, 0.1]}\n"
        "loops: [{name: hinge, type: revolute, axis: z, between: [{body: frame, at: [0.2, %g, 0]}, door]}]\n"
        "simulate: {duration: 0.01}\n";
    for (size_t i = 0; i < sizeof apart / sizeof *apart; i++) {
        char text[600], advice[200];
        snprintf(text, sizeof text, door, apart[i]);
        kt_write_file("door.yaml", text);
        snprintf(advice, sizeof advice,
                 "  they close if the end of loop 'hinge' on 'frame' is moved by [0, %.3g, 0] m in that frame\n",
                 -apart[i]);
        kt_expect(3, advice, "$K check door.yaml");
        snprintf(advice, sizeof advice, "on 'door' is moved by [0, %.3g, 0] m in that frame\n", apart[i]);
        kt_expect(3, advice, "$K check door.yaml");
    }
}

/* A body is at [0, 0, 1]. Its marker at [1, 0, 0] is to be at [0, 1, 1], so the body must turn by a right angle. */
KT_TEST(hold_keeps_of_a_joint_what_the_scene_gives) {
    static const char box[] =
        "kinetree: 1\nbodies:\n"
        "  - {name: box, joint: {type: free, position: {position: [0, 0, 1]%s}}, mass: 1,\n"
        "     inertia: [1, 1, 1], markers: {tip: [1, 0, 0]}}\n"
        "loops: [{name: pin, type: spherical, between: [box.tip, {body: world, at: [0, 1, 1]}]}]\n"
        "initial: {hold: [box]}\nsimulate: {duration: 0.01}\n";
    char text[600];
    snprintf(text, sizeof text, box, "");
    kt_write_file("box.yaml", text);
    kt_expect(
        0,
        "box.yaml: warning: 'hold' keeps the part of box that the scene gives, its position. Its orientation is not "
        "given and moved to close the loops",
        "$K check box.yaml");
    json_t *root = kt_json(kt_shell("$K evaluate box.yaml 2>/dev/null").out);
    kt_check_near("position", kt_json_at(root, "pose.box.position[2]"), 1.0, 0.0);
    kt_check_near("turned", kt_json_at(root, "pose.box.rotation[1][0]"), 1.0, 1e-9);
    json_decref(root);
    snprintf(text, sizeof text, box, ", orientation: {quaternion: [1, 0, 0, 0]}");
    kt_write_file("box.yaml", text);
    kt_expect(3, "they close if 'box' is not in 'initial: hold'", "$K check box.yaml");
}

/* A gear pair: the held wheel's velocity is not given, and follows that of the other one. */
KT_TEST(held_joint_without_a_velocity_follows_those_that_are_given) {
    kt_write_file("gear.yaml", "kinetree: 1\nbodies:\n"
                               "  - {name: big, joint: {type: revolute, position: 0.5}, mass: 1, inertia: [1, 1, 1]}\n"
                               "  - {name: small, joint: {type: revolute, position: 1, velocity: 6}, mass: 1, inertia: "
                               "[1, 1, 1]}\n"
                               "loops: [{name: mesh, type: coupling, coefficients: {big: 2, small: -1}}]\n"
                               "initial: {hold: [big]}\nsimulate: {duration: 0}\n");
    const kt_ran ran = kt_shell("$K run gear.yaml --duration 0 --out - --quiet");
    kt_check_text("no words", ran.err, "");
    kt_check_contains("twice as slow", ran.out, "0,0.5,1,3,6");
}

KT_TEST(loops_without_mass_are_a_fault) {
    four_bar f = usual;
    f.mass = "mass: 0";
    write_four_bar(&f);
    kt_expect(2, "the mechanism has no positive inertia along one of the degrees of freedom", "$K check f.yaml");
}

/* A ball of 1 kg that starts 0.1 m deep flies 129 m high. It stores the energy
 *     1e6 * 0.1^2.5 / 2.5 J.
 * A ball at rest on its contact is right. */
KT_TEST(check_warns_and_ends_well) {
    static const char ball[] = "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                               "  - {name: ball, joint: {type: prismatic, position: %s}, mass: 1}\n"
                               "effects: [{name: floor, type: contact, point: ball, radius: 0.5, plane: world,\n"
                               "  stiffness: 1e6}]\n";
    char text[400];
    snprintf(text, sizeof text, ball, "0.4");
    kt_write_file("b.yaml", text);
    kt_expect(
        0,
        "b.yaml: warning: contact 'floor' of 'ball' starts 0.1 m inside its plane, where it pushes with 3.16e+04 N "
        "(all bodies weigh 9.81 N) and stores 1.26e+03 J. Start it 0.1 m further along the plane's normal [0, 0, 1]",
        "$K check b.yaml");
    snprintf(text, sizeof text, ball, "0.4995418"); /* (9.81 / 1e6)^(2/3) deep */
    kt_write_file("b.yaml", text);
    kt_expect(0, NULL, "$K check b.yaml");

    kt_write_file("b.yaml",
                  "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies: [{name: ball, joint: {type: free}, mass: 1,\n"
                  "  inertia: [1, 1, 1]}]\neffects: [{type: contact, point: ball, radius: 0.2, plane: world,\n"
                  "  axis: -y, stiffness: 1e6}]\n");
    kt_expect(0, "b.yaml: warning: contact of 'ball' starts 0.2 m inside its plane", "$K check b.yaml");
    kt_expect(0, "Start it 0.2 m further along the plane's normal [0, -1, 0]", "$K check b.yaml");

    kt_write_file("a.yaml", "kinetree: 1\ngravity: [0, 0, -9.81]\n"
                            "bodies: [{name: a, joint: {type: revolute, position: 120, velocity: 1}, mass: 1,\n"
                            "  inertia: [1, 1, 1]}]\n");
    kt_expect(
        0,
        "a.yaml: warning: body 'a': joint.position: 120 is in radians, 19.1 turns. Write '120 deg' if degrees are "
        "meant",
        "$K check a.yaml");
    kt_expect(0, "kinetree: warning: body 'a': joint.position: 120 is in radians, 19.1 turns. Write '120 deg'",
              "$K run a.yaml --duration 0.1 --out /dev/null");
    kt_check_text("ok", kt_shell("$K check a.yaml").out, "a.yaml: ok, 1 warning\n");
    kt_shell("sed s/120/120.7/ a.yaml > later.yaml");
    kt_check_true("whole numbers alone, in a run",
                  strstr(kt_shell("$K run later.yaml --duration 0.1 --out /dev/null").err, "in radians") == NULL);
    kt_write_file("a.yaml", "kinetree: 1\ngravity: [0, 0, -9.81]\n"
                            "bodies: [{name: a, joint: {type: revolute, position: 720.5 deg, velocity: 1}, mass: 1,\n"
                            "  inertia: [1, 1, 1]}]\n");
    kt_expect(0, NULL, "$K check a.yaml");

    four_bar f = usual;
    f.more = "initial: {hold: [crank]}\n";
    write_four_bar(&f);
    kt_expect(0, NULL, "$K check f.yaml");
    kt_write_file("z.yaml", "kinetree: 1\nbodies:\n"
                            "  - {name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                            "loops: [{name: stop, type: weld, between: [a, world]}]\n");
    kt_expect(0, "z.yaml: warning: nothing can move: the joints have 1 degree of freedom,", "$K check z.yaml");
    kt_write_file("z.yaml", "kinetree: 1\n");
    kt_expect(0, "z.yaml: warning: nothing can move: there are no bodies; add some under 'bodies'", "$K check z.yaml");
    kt_write_file("z.yaml", "kinetree: 1\nstates: {x: {initial: 1, rate: \"sin(t) - x\"}}\n");
    kt_expect(0, "z.yaml: warning: nothing can move: there are no bodies", "$K check z.yaml");
}

/* Three feet carry 6 kg, and each is 1.5 mm deep. One foot carries 1e6 * 0.0015^1.5 = 58.1 N, less than the weight of
 * 58.86 N. All three together carry more than twice the weight. At a depth of 0.4 mm, they carry less than this. */
KT_TEST(contacts_that_start_inside_are_judged_together_by_every_command) {
    static const char table[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: table, joint: {type: prismatic, position: %s}, mass: 6,\n"
        "     markers: {a: [1, 0, 0], b: [0, 1, 0], c: [-1, -1, 0]}}\n"
        "effects:\n"
        "  - {name: left, type: contact, point: table.a, plane: world, stiffness: 1e6, exponent: 1.5}\n"
        "  - {name: right, type: contact, point: table.b, plane: world, stiffness: 1e6, exponent: 1.5}\n"
        "  - {name: back, type: contact, point: table.c, plane: world, stiffness: 1e6, exponent: 1.5}\n"
        "simulate: {duration: 0.01, integrator: dopri5, tolerance: 1e-6}\n";
    static const char words[] = "3 contacts start inside their planes, contact 'left' of 'table' by 0.0015 m, the "
                                "deepest, where they push with 174 N together (all bodies weigh 58.9 N) and store "
                                "0.105 J. Start them further along their planes' normals, contact 'left' of 'table' "
                                "by 0.0015 m\n";
    char text[900], expected[400];
    snprintf(text, sizeof text, table, "-0.0015");
    kt_write_file("t.yaml", text);
    snprintf(expected, sizeof expected, "t.yaml: warning: %s", words);
    kt_expect(0, expected, "$K check t.yaml");
    snprintf(expected, sizeof expected, "kinetree: warning: %s", words);
    kt_expect(0, expected, "$K info t.yaml");
    kt_expect(0, expected, "$K run t.yaml --summary t.json");
    json_t *root = kt_json(kt_read_file("t.json"));
    kt_check_text("in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "starts_in_contact");
    kt_check_near("how deep", kt_json_at(root, "warnings[0].value"), 0.0015, 1e-15);
    json_decref(root);
    snprintf(text, sizeof text, table, "-0.0004");
    kt_write_file("t.yaml", text);
    kt_check_text("at rest", kt_shell("$K check t.yaml").out, "t.yaml: ok\n");
}

/* Between coincident centres a spring with k L = 1 N has no direction, and neither has an attraction. A spring of
 * length 0 needs none. Ends that are 1 mm apart have one. */
KT_TEST(forces_without_a_direction_at_the_start_are_reported) {
    static const char scene[] = "kinetree: 1\ngravity: [0, 0, 0]\nbodies:\n"
                                "  - {name: a, joint: {type: prismatic, axis: [1, 0, 0]}, mass: 1}\n"
                                "  - {name: b, joint: {type: prismatic, axis: [1, 0, 0], position: %s}, mass: 1}\n"
                                "effects: [{name: s, type: %s, between: [a, b], %s}]\n"
                                "simulate: {duration: 0.01}\n";
    static const struct {
        const char *position, *type, *numbers, *words;
    } cases[] = {{"0", "spring", "stiffness: 10, length: 0.1",
                  "w.yaml: warning: spring 's' of 'a' has both ends at one point at the start: its force, 1 N, has no "
                  "direction. Move one end, or set `length: 0`\n"},
                 {"0", "attraction", "strength: 2",
                  "w.yaml: warning: attraction 's' of 'a' has both ends at one point at the start: its force has no "
                  "direction. Move one end\n"},
                 {"0", "spring", "stiffness: 10, length: 0", NULL},
                 {"1e-3", "spring", "stiffness: 10, length: 0.1", NULL},
                 {"1e-3", "attraction", "strength: 2", NULL}};
    char text[600];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text, scene, cases[i].position, cases[i].type, cases[i].numbers);
        kt_write_file("w.yaml", text);
        if (cases[i].words != NULL)
            kt_expect(0, cases[i].words, "$K check w.yaml");
        else
            kt_check_text("no warning", kt_shell("$K check w.yaml").out, "w.yaml: ok\n");
    }
    snprintf(text, sizeof text, scene, cases[0].position, cases[0].type, cases[0].numbers);
    kt_write_file("w.yaml", text);
    kt_expect(0, "kinetree: warning: spring 's'", "$K run w.yaml --summary w.json");
    json_t *root = kt_json(kt_read_file("w.json"));
    kt_check_text("in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "no_direction");
    kt_check_near("the force", kt_json_at(root, "warnings[0].value"), 1.0, 1e-15);
    json_decref(root);
}

/* An axle along y rolls on a plane normal to z. Without `axis`, the axle is along z, too. */
KT_TEST(wheel_that_lies_flat_at_the_start_is_reported) {
    static const char scene[] = "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                                "  - {name: w, joint: {type: planar, at: [0, 0, %s]}, mass: 1, inertia: [1, 1, 1]}\n"
                                "loops: [{name: road, type: rolling, wheel: w, radius: 0.3, on: world%s}]\n"
                                "effects: [{type: joint_damper, joint: 'w[0]', damping: 1}]\n";
    char text[600];
    snprintf(text, sizeof text, scene, "0", "");
    kt_write_file("w.yaml", text);
    kt_expect(0,
              "w.yaml: warning: the wheel of loop 'road' lies flat at the start: its axle is along the normal of the "
              "plane, [0, 0, 1], and no point of contact is lowest. Give `axis` the direction of the axle in the frame "
              "of the wheel, and `normal` that of the plane\n",
              "$K check w.yaml");
    json_t *root = kt_json(kt_shell("$K run w.yaml --summary - --out w.csv").out);
    kt_check_text("in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "flat_wheel");
    json_decref(root);
    snprintf(text, sizeof text, "%s%s",
             "kinetree: 1\nbodies: [{name: w, joint: {type: free, position: {position: [0, 0, 0.3]}}, ",
             "mass: 1, inertia: [1, 1, 1]}]\nloops: [{name: road, type: rolling, wheel: w, radius: 0.3, on: world}]\n");
    kt_write_file("w.yaml", text);
    kt_expect(0, "lies flat at the start", "$K check w.yaml"); /* assembly turns it upright */
    snprintf(text, sizeof text, scene, "0.3", ", axis: y");
    kt_write_file("w.yaml", text);
    kt_check_true("no warning", strstr(kt_shell("$K check w.yaml").err, "flat") == NULL);
}

/* The body touches a stop with a restitution of 1/2 and moves against it at 1 m/s. No assembly does this, and `hold`
 * would not keep it. */
KT_TEST(an_impact_at_the_start_is_named_as_what_changes_velocities) {
    kt_write_file("i.yaml", "kinetree: 1\nbodies: [{name: slide, joint: {type: prismatic, velocity: -1}, mass: 1}]\n"
                            "effects: [{name: stop, type: joint_limit, joint: slide, lower: 0, restitution: 0.5}]\n"
                            "simulate: {duration: 0.01}\n");
    kt_expect(0,
              "kinetree: impacts at the start, and assembly where loops were open, moved initial values that the scene "
              "gives:\n  slide: velocity from -1 m/s to 0.5 m/s\n",
              "$K run i.yaml");
    kt_expect(0, "contacts: 1 impact (0.375 J dissipated), 0 closings, 0 openings; friction: 0 sticks, 0 slips\n",
              "$K run i.yaml");
    kt_expect(2, "hard contacts, and loops or effects that are switched, need the formulation 'tree'",
              "$K run i.yaml --formulation absolute");
}

/* The block comes to rest by friction and sticks. This takes the velocity that the search for the instant has left. */
KT_TEST(a_loss_below_the_rounding_of_energies_is_no_loss) {
    kt_write_file(
        "s.yaml",
        "kinetree: 1\ngravity: [-9.81, 0, 0]\n"
        "bodies: [{name: block, joint: {type: prismatic, velocity: 3}, mass: 2}]\n"
        "effects: [{type: joint_friction, joint: block, coulomb: 5.1, static: 25, stribeck: 0, stick: true}]\n"
        "simulate: {duration: 3}\n");
    kt_expect(0, "contacts: 0 impacts (0 J dissipated), 0 closings, 0 openings; friction: 1 stick, 0 slips\n",
              "$K run s.yaml --summary s.json");
    json_t *root = kt_json(kt_read_file("s.json"));
    kt_check_true("the summary has the number itself", kt_json_at(root, "contacts.dissipated") > 0.0);
    json_decref(root);
}

/* A position 0.1 m beyond a stop of 1e5 N/m gives 1e4 N, and the energy
 *     1e5 * 0.1^2 / 2 J. */
KT_TEST(check_warns_of_a_joint_limit_that_starts_violated) {
    static const char slide[] = "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                                "  - {name: slide, joint: {type: prismatic, axis: y, position: 0.1}, mass: 1}\n"
                                "effects: [{name: stop, type: joint_limit, joint: slide, lower: %s, stiffness: 1e5}]\n";
    char text[400];
    snprintf(text, sizeof text, slide, "0.2");
    kt_write_file("l.yaml", text);
    kt_expect(
        0,
        "l.yaml: warning: joint_limit 'stop' of 'slide' starts 0.1 m beyond 'lower', where it pushes with 1e+04 N "
        "and stores 500 J. Start the joint at 0.2 m or above, or move 'lower'",
        "$K check l.yaml");
    snprintf(text, sizeof text, slide, "0.1000981"); /* at rest on it: 9.81 N / 1e5 N/m */
    kt_write_file("l.yaml", text);
    kt_expect(0, NULL, "$K check l.yaml");
}

/* A stop that is hard has no inside to start in: `check` ends as `run` does, with the same words. */
KT_TEST(check_rejects_a_start_beyond_a_hard_stop_as_a_run_does) {
    static const char slide[] =
        "kinetree: 1\nbodies: [{name: slide, joint: {type: prismatic, position: %s}, mass: 1}]\n"
        "effects: [{type: joint_limit, joint: slide, upper: 0.2, restitution: 0.5}]\n";
    static const char words[] =
        "contact 'slide.upper' at t = 0 s: 'slide.upper' is 0.3 (m or rad) beyond its boundary; begin on "
        "its free side, or bound the steps (max_step) if it was there at the start";
    char text[300];
    snprintf(text, sizeof text, slide, "0.5");
    kt_write_file("h.yaml", text);
    kt_expect(3, words, "$K run h.yaml --duration 1");
    kt_expect(3, words, "$K check h.yaml");
    snprintf(text, sizeof text, slide, "0.2");
    kt_write_file("h.yaml", text);
    kt_expect(0, NULL, "$K check h.yaml");
}

/* A bob of 1 kg at 0.1 m turns its hinge. Its moment is at most 0.981 N m. Parts that are fixed to the world turn it
 * with nothing. A stop of 100 N m per rad may carry twice that moment, at 0.01962 rad. */
KT_TEST(check_warns_of_a_turning_joint_s_limit_by_what_weights_turn_it_with) {
    static const char swing[] =
        "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
        "  - {name: wall, joint: {type: fixed, at: [50, 0, 0]}, mass: 1000}\n"
        "  - {name: bob, parent: wall, joint: {type: revolute, position: %s}, mass: 1, com: [0.1, 0, 0]}\n"
        "effects: [{name: stop, type: joint_limit, joint: bob, upper: 1, stiffness: 100}]\n";
    char text[400];
    snprintf(text, sizeof text, swing, "1.0195");
    kt_write_file("b.yaml", text);
    kt_expect(0, NULL, "$K check b.yaml");
    snprintf(text, sizeof text, swing, "1.0198");
    kt_write_file("b.yaml", text);
    kt_expect(0, "joint_limit 'stop' of 'bob' starts 0.0198 rad beyond 'upper', where it pushes with 1.98 N m",
              "$K check b.yaml");
}

KT_TEST(doubtful_functions_of_driven_joints_are_told) {
    static const char drive[] = "kinetree: 1\nbodies: [{name: a, joint: {type: %s}, mass: 1, inertia: [1, 1, 1]}]\n"
                                "loops: [{name: drive, type: motion, joint: a, position: {%s}}]\n"
                                "simulate: {duration: 0.01}\n";
    static const struct {
        const char *joint, *function, *words;
    } cases[] = {
        {"revolute", "table: [[0, 0], [1, 90], [2, 0]], interpolation: cubic",
         "position.table[1][1]: 90 is in radians"},
        {"revolute", "ramp: {from: 0, to: 90, start: 0, end: 1}", "position.ramp.to: 90 is in radians"},
        {"revolute", "sine: {amplitude: 90, frequency: 1}", "position.sine.amplitude: 90 is in radians"},
        {"revolute", "table: [[0, 0], [1, 90 deg], [2, 360 deg]], interpolation: cubic", NULL},
        {"prismatic", "table: [[0, 0], [1, 90], [2, 0]], interpolation: monotone", NULL},
        {"revolute", "table: [[0, 0], [0.005, 90 deg], [2, 0]], interpolation: linear",
         "the speed of loop 'drive' jumps at a row of its table"},
    };
    char text[500];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text, drive, cases[i].joint, cases[i].function);
        kt_write_file("d.yaml", text);
        kt_expect(0, cases[i].words, "$K check d.yaml");
    }
    static const char jumps[] = "the speed of loop 'drive' jumps at a row of its table, or at a branch of its formula";
    const kt_ran ran = kt_shell("$K run d.yaml --out /dev/null --summary -");
    json_t *root = kt_json(ran.out);
    kt_check_contains("a run, too", ran.err, jumps);
    kt_check_text("in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "speed_jump");
    kt_check_text("what", json_string_value(kt_json_find(root, "warnings[0].what")), jumps);
    kt_check_text(
        "remedy", json_string_value(kt_json_find(root, "warnings[0].remedy")),
        "Give the table 'interpolation: cubic' or 'monotone'. In a formula, avoid sign, step, comparisons, and "
        "kinks of abs, min, max and clamp");
    kt_check_true("about no instant", json_is_null(kt_json_find(root, "warnings[0].time")));
    json_decref(root);
    kt_write_file("d.yaml", "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, position: 1}, mass: 1}]\n"
                            "loops: [{name: ram, type: distance, between: [{body: a}, {body: world}],\n"
                            "         length: {table: [[0, 1], [1, 2], [2, 1]]}}]\n");
    kt_expect(0, "the speed of loop 'ram' jumps at a row of its table", "$K check d.yaml");
    kt_write_file("d.yaml", "kinetree: 1\nbodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                            "effects: [{type: joint_spring, joint: a, stiffness: 1, rest: 90}]\n");
    kt_expect(0, "joint_spring of 'a': rest: 90 is in radians", "$K check d.yaml");
}

KT_TEST(accepted_inertias_are_told) {
    kt_write_file("i.yaml", "kinetree: 1\ninertia_check: warn\nbodies:\n"
                            "  - {name: cad, joint: {type: revolute}, mass: 1, inertia: [1, 2, 3.015]}\n"
                            "simulate: {duration: 0.01}\n");
    kt_ran ran = kt_shell("$K run i.yaml --out /dev/null --summary -");
    kt_check_contains("words", ran.err,
                      "inertia_check: warn accepts 1 impossible inertia: the largest principal moment of 'cad' "
                      "exceeds the sum of the others by 0.5 %; give inertias with more digits");
    json_t *root = kt_json(ran.out);
    kt_check_near("summary", kt_json_at(root, "inertia_excess.cad"), 0.005, 1e-14);
    json_decref(root);
}

/* A four-bar whose coupler is 800 m long: it was 800 mm on the drawing. */
KT_TEST(lengths_in_millimetres_are_asked_about) {
    kt_write_file("mm.yaml",
                  "kinetree: 1\nbodies:\n"
                  "  - {name: crank, joint: {type: revolute, position: 60 deg}, mass: 1, inertia: [1, 1, 1]}\n"
                  "  - {name: coupler, parent: crank, joint: {type: revolute, at: [0.3, 0, 0]}, mass: 1,\n"
                  "     inertia: [1, 1, 1], markers: {tip: [800, 0, 0]}}\n"
                  "  - {name: rocker, joint: {type: revolute, at: [0.7, 0, 0]}, mass: 1,\n"
                  "     inertia: [1, 1, 1], markers: {tip: [0.7, 0, 0]}}\n"
                  "loops: [{name: close, type: revolute, between: [coupler.tip, rocker.tip]}]\n");
    kt_expect(3,
              "millimetres? They close if the 800 m from the joint of 'coupler' to the end of loop 'close' are 0.8 m\n",
              "$K check mm.yaml");
}

KT_TEST(gravity_that_is_missing_or_in_millimetres_is_doubted) {
    static const char body[] = "bodies: [{name: a, joint: {type: revolute%s}, mass: 1, com: [1, 0, 0]}]\n";
    char text[600];
    size_t used = (size_t)snprintf(text, sizeof text, "kinetree: 1\n");
    snprintf(text + used, sizeof text - used, body, "");
    kt_write_file("g.yaml", text);
    kt_expect(0, "warning: nothing sets it in motion: it is at rest, there are no effects, and no gravity",
              "$K check g.yaml");
    snprintf(text + used, sizeof text - used, body, ", velocity: 1");
    kt_write_file("g.yaml", text);
    kt_expect(0, NULL, "$K check g.yaml");
    used = (size_t)snprintf(text, sizeof text, "kinetree: 1\ngravity: [0, -9810, 0]\n");
    snprintf(text + used, sizeof text - used, body, "");
    kt_write_file("g.yaml", text);
    kt_expect(0, "gravity is 9810 m/s^2, a thousand times that of the earth; lengths are in metres here: 9.81",
              "$K check g.yaml");
}

/* A point of 1.3 kg lies 1e-6 m off the axis that turns it. Its distance along the axis is 0.1 m. */
KT_TEST(a_joint_that_hardly_turns_its_mass_is_doubted) {
    static const char head[] =
        "kinetree: 1\n"
        "gravity: [0, -1, -9.81]\n"
        "bodies:\n"
        "  - {name: neck, joint: {type: revolute, axis: y}, mass: 0.5, inertia: [0.01, 0.01, 0.01]}\n"
        "  - {name: head, parent: neck, joint: {type: revolute, axis: z, name: turn}, mass: 1.3, com: [1e-6, 0, 0.1],\n"
        "     inertia: [0, 0, 0]}\n";
    kt_write_file("head.yaml", head);
    kt_expect(0,
              "warning: joint 'turn' turns an inertia of 1.3e-12 kg m^2, 1e-10 of a usual one for its bodies, "
              "and begins with -1e+06 rad/s^2",
              "$K check head.yaml");
    kt_expect(0, NULL, "$K check head.yaml --set bodies.head.joint.armature=1e-6");
    kt_expect(0, NULL, "$K check head.yaml --set 'bodies.head.inertia=[1e-6, 1e-6, 1e-6]'");
    kt_expect(0, NULL, "$K check head.yaml --set 'gravity=[0, 0, -9.81]'"); /* nothing turns it */
}

/* An event is a change: a condition that is true at the start does not become true. */
KT_TEST(until_that_holds_at_the_start_is_told) {
    static const struct {
        const char *until;
        bool holds;
    } cases[] = {{"position.block < 2", true},      {"2 >= position.block", true},    {"marker.block.top.y < 3", true},
                 {"position.block > 2", false},     {"position.block - 2", false},    {"marker.block.top.y > 3", false},
                 {"velocity.block <= t + 2", true}, {"velocity.block < 1 - t", false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[400], words[200];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n"
                 "  - {name: block, joint: {type: prismatic, axis: y, position: 1, velocity: 1}, mass: 1,\n"
                 "     markers: {top: [0, 0.5, 0]}}\n"
                 "simulate: {duration: 0.5, until: \"%s\"}\n",
                 cases[i].until);
        snprintf(words, sizeof words,
                 "`until: %s` is true at the start, and ends the run only when it becomes true again", cases[i].until);
        kt_write_file("u.yaml", text);
        const kt_ran ran = kt_shell("$K run u.yaml --out /dev/null --summary -");
        json_t *root = kt_json(ran.out);
        const char *code = json_string_value(kt_json_find(root, "warnings[0].code"));
        kt_check_text(cases[i].until, code != NULL ? code : "none", cases[i].holds ? "until_holds" : "none");
        kt_check_true(words, (strstr(ran.err, words) != NULL) == cases[i].holds);
        kt_check_near("it runs to its end", kt_json_at(root, "time"), 0.5, 1e-15);
        json_decref(root);
    }
}

KT_TEST(two_motions_of_one_joint_are_told) {
    static const char twice[] = "kinetree: 1\n"
                                "bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                                "loops:\n"
                                "  - {name: one, type: motion, joint: a, position: {polynomial: [0, 1]}}\n"
                                "  - {name: two, type: motion, joint: a, position: {polynomial: [%s, 1]}}\n";
    char text[600];
    snprintf(text, sizeof text, twice, "0");
    kt_write_file("twice.yaml", text);
    kt_expect(0, "warning: loops 'one' and 'two' both prescribe the motion of joint 'a'; leave one of them out",
              "$K check twice.yaml");
    snprintf(text, sizeof text, twice, "0.5");
    kt_write_file("twice.yaml", text);
    kt_expect(3, "  loops 'one' and 'two' both prescribe the motion of joint 'a'; leave one of them out",
              "$K run twice.yaml");
}
