/* Own columns in records, in the summary and in sweeps, for recorded and unrecorded quantities. Further tests carry
 * auxiliary states from file to file. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>

/* A block that a force pulls over a rail, and a marker on it. Its weight is carried by the joint. */
#define BLOCK                                                                                                          \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, 0, -10]\n"                                                                                           \
    "parameters: {m: 2, T: 0.5}\n"                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: block, joint: {type: prismatic, axis: x, velocity: 1}, mass: =m, inertia: [1, 1, 1],\n"                \
    "     markers: {nose: [0.25, 0, 0]}}\n"                                                                            \
    "states: {thrust: {initial: 3, rate: \"-thrust/T\"}}\n"                                                            \
    "effects: [{type: expression, joint: block, force: thrust}, {name: rest, type: motor, joint: block, torque: 0}]\n" \
    "simulate: {duration: 1, integrator: dop853, tolerance: 1e-12}\n"

static const char scene[] =
    BLOCK "output:\n"
          "  interval: 0.125\n"
          "  record: [position]\n"
          "  columns:\n"
          "    kinetic: m*velocity.block^2/2 - energy.kinetic\n"
          "    newton: m*acceleration.block - thrust\n"
          "    ahead: marker.block.nose.x - position.block + marker.block.nose.vx - velocity.block\n"
          "    weight: reaction.block.fz + momentum.px\n"
          "    rest: effect.rest.force + state.thrust - thrust + 1\n"
          "    clock: 2*t + 1\n";

KT_TEST(own_columns_are_computed_of_what_is_recorded_and_what_is_not) {
    kt_write_file("block.yaml", scene);
    kt_expect(0, NULL, "$K run block.yaml --quiet --out block.csv --summary block.json");
    static char csv[20000];
    snprintf(csv, sizeof csv, "%s", kt_read_file("block.csv"));
    kt_check_equal_int("time, position and six", kt_csv_column(csv, "clock"), 7);
    for (int line = 1; line <= 9; line++) {
        const double t = 0.125 * (line - 1), v = 1.0 + 1.5 * 0.5 * (1.0 - exp(-t / 0.5));
        kt_check_near("kinetic energy", kt_csv_number(csv, line, kt_csv_column(csv, "kinetic")), 0.0, 1e-13);
        kt_check_near("Newton's law", kt_csv_number(csv, line, kt_csv_column(csv, "newton")), 0.0, 1e-13);
        kt_check_near("place of the marker", kt_csv_number(csv, line, kt_csv_column(csv, "ahead")), 0.25, 1e-14);
        kt_check_near("weight and momentum", kt_csv_number(csv, line, kt_csv_column(csv, "weight")), 20.0 + 2.0 * v,
                      2e-11);
        kt_check_near("force", kt_csv_number(csv, line, kt_csv_column(csv, "rest")), 1.0, 1e-13);
        kt_check_near("clock", kt_csv_number(csv, line, kt_csv_column(csv, "clock")), 2.0 * t + 1.0, 1e-15);
    }
    json_t *summary = kt_json(kt_read_file("block.json"));
    kt_check_near("end", kt_json_at(summary, "columns.clock.end"), 3.0, 1e-15);
    kt_check_near("largest", kt_json_at(summary, "columns.clock.max"), 3.0, 1e-15);
    kt_check_near("final state", kt_json_at(summary, "state.thrust"), 3.0 * exp(-2.0), 2e-12);
    json_decref(summary);
}

KT_TEST(own_columns_are_swept) {
    kt_write_file("block.yaml", scene);
    kt_expect(0, NULL, "$K sweep block.yaml --vary m=1:2:2 --columns weight --out sweep.csv --quiet");
    static char csv[20000];
    snprintf(csv, sizeof csv, "%s", kt_read_file("sweep.csv"));
    const int end = kt_csv_column(csv, "weight.end");
    const double p = 3.0 * 0.5 * (1.0 - exp(-2.0)); /* impulse of the force */
    kt_check_near("m = 1", kt_csv_number(csv, 1, end), 10.0 + 1.0 + p, 2e-12);
    kt_check_near("m = 2", kt_csv_number(csv, 2, end), 20.0 + 2.0 + p, 2e-12);
}

/* A pendulum: m g r sin(q) is recorded, read by own columns, events and values that events set, also while the mass
 * changes. */
KT_TEST(gravity_in_joints_is_a_column_and_a_variable_of_events) {
    static const char *const masses[] = {"2", "{sine: {amplitude: 0.5, frequency: 1, offset: 2}}"};
    for (int k = 0; k < 2; k++) {
        char text[1200];
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: arm, joint: {type: revolute, axis: y, position: 1.2}, mass: %s,\n"
                       "     com: [0, 0, -0.5], inertia: [0.1, 0.1, 0.1]}\n"
                       "states: {seen: {rate: 0*t}}\n"
                       "events: [{name: light, when: gravity.arm < 5, limit: 1, then: {set: {seen: 2*gravity.arm}}}]\n"
                       "simulate: {duration: 0.8, integrator: dop853, tolerance: 1e-12}\n"
                       "output: {interval: 0.1, record: [position, gravity, state], columns: {twice: 2*gravity.arm}}\n",
                       masses[k]);
        kt_write_file("swing.yaml", text);
        kt_expect(0, NULL, "$K run swing.yaml --quiet --out swing.csv");
        static char csv[20000];
        snprintf(csv, sizeof csv, "%s", kt_read_file("swing.csv"));
        const int at = kt_csv_column(csv, "gravity.arm"), seen = kt_csv_column(csv, "state.seen");
        int line = 1;
        for (; kt_csv_number(csv, line, seen) == 0.0 && line < 9; line++) {
            const double t = kt_csv_number(csv, line, 0), q = kt_csv_number(csv, line, 1);
            const double force = (k ? 2.0 + 0.5 * sin(2.0 * acos(-1.0) * t) : 2.0) * 9.81 * 0.5 * sin(q);
            kt_check_near("recorded", kt_csv_number(csv, line, at), force, 1e-14 * force);
            kt_check_near("read", kt_csv_number(csv, line, kt_csv_column(csv, "twice")), 2.0 * force, 1e-13);
        }
        kt_check_above("records before the event", line - 1, 2.0);
        kt_check_near("at the event", kt_csv_number(csv, line, at), 5.0, 1e-10);
        kt_check_near("set", kt_csv_number(csv, line, seen), 10.0, 1e-10);
    }
}

/* A wheel of 2 kg presses its road with its weight. */
KT_TEST(reactions_of_rolling_act_on_the_road) {
    kt_write_file("roll.yaml",
                  "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - name: wheel\n"
                  "    joint: {type: free, position: {position: [0, 0, 0.3]}, velocity: {linear: [0.9, 0, 0], angular: "
                  "[0, 3, 0]}}\n"
                  "    mass: 2\n    shape: {type: cylinder, radius: 0.3, length: 0.02, axis: y}\n"
                  "loops: [{name: road, type: rolling, wheel: wheel, axis: y, radius: 0.3, on: world, normal: z}]\n"
                  "simulate: {duration: 0.1}\n");
    const kt_ran ran = kt_shell("$K run roll.yaml --record reaction --quiet --out -");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_near("fz", kt_csv_number(ran.out, 1, kt_csv_column(ran.out, "reaction.road.fz")), -2.0 * 9.81, 1e-13);
}

KT_TEST(names_that_are_no_columns_are_told) {
    kt_write_file("wrong.yaml", BLOCK "output: {columns: {x: velocity.blok}}\n");
    kt_expect(2, "wrong.yaml:10:23: output.columns.x: there is no name 'velocity.blok'; did you mean 'velocity.block'?",
              "$K check wrong.yaml");
    kt_write_file("wrong.yaml", BLOCK "output: {columns: {x: reaction.blok.fx}}\n");
    kt_expect(2, "output.columns.x: there is no name 'reaction.blok.fx'; did you mean 'reaction.block.fx'?",
              "$K run wrong.yaml --out /dev/null");
    kt_write_file("wrong.yaml", BLOCK "output: {columns: {time: \"1\"}}\n");
    kt_expect(2, "there is a column 'time' already; take another name", "$K check wrong.yaml");
    kt_write_file("wrong.yaml", BLOCK "output: {columns: {x y: \"1\"}}\n");
    kt_expect(2, "'x y' is no name of a column; begin with a letter or _, go on with letters, digits, _ and -\n",
              "$K check wrong.yaml");
}

KT_TEST(written_scenes_have_their_columns_and_states) {
    kt_write_file("block.yaml", scene);
    kt_expect(0, NULL, "$K run block.yaml --quiet --duration 0.5 --out half.csv --scene end.yaml --summary half.json");
    kt_expect(0, NULL, "$K run end.yaml --quiet --duration 0.5 --out rest.csv --summary rest.json");
    json_t *rest = kt_json(kt_read_file("rest.json"));
    kt_check_near("state of a written scene", kt_json_at(rest, "state.thrust"), 3.0 * exp(-2.0), 2e-12);
    kt_check_near("column of a written scene", kt_json_at(rest, "columns.clock.end"), 2.0, 1e-15);
    json_decref(rest);
    kt_expect(0, NULL, "$K run block.yaml --from half.json --quiet --duration 0.5 --out rest.csv --summary rest.json");
    rest = kt_json(kt_read_file("rest.json"));
    kt_check_near("state from a summary", kt_json_at(rest, "state.thrust"), 3.0 * exp(-2.0), 2e-12);
    json_decref(rest);
    kt_expect(0, "half.csv has no state 'thrust', which starts with its value in the scene",
              "$K run block.yaml --from half.csv --quiet --duration 0.5 --out rest.csv");
}

/* The unit of an own column is a label. One that is not that of the column which it copies is doubted, if it measures
 * the same quantity with another factor. Formulas that may convert, and units of other names, are not doubted. */
KT_TEST(unit_of_a_copied_column_is_compared) {
    static const struct {
        const char *value, *unit, *own; /* own: NULL, no doubt */
    } cases[] = {{"position.arm", "deg", "rad"},
                 {"velocity.arm", "rpm", "rad/s"},
                 {"position.block", "mm", "m"},
                 {"velocity.block", "km/h", "m/s"},
                 {"reaction.block.fx", "kN", "N"},
                 {"marker.arm.tip.x", "cm", "m"},
                 {"t", "ms", "s"},
                 {"position.arm", "rad", NULL},
                 {"position.arm*180/pi", "deg", NULL},
                 {"position.block", "m", NULL},
                 {"position.arm", "turns of the shaft", NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[1000], words[200];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: block, joint: {type: prismatic, axis: x, velocity: 1}, mass: 2}\n"
                 "  - {name: arm, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1],\n"
                 "     markers: {tip: [1, 0, 0]}}\n"
                 "simulate: {duration: 0.1}\noutput: {columns: {mine: {value: %s, unit: %s}}}\n",
                 cases[i].value, cases[i].unit);
        kt_write_file("unit.yaml", text);
        const char *own = cases[i].own != NULL ? cases[i].own : "";
        snprintf(words, sizeof words, "column 'mine' has the numbers of '%s', in %s, and its unit is %s",
                 cases[i].value, own, cases[i].unit);
        kt_expect(0, cases[i].own != NULL ? words : "records: u.csv",
                  "$K run unit.yaml --out u.csv --summary u.json >/dev/null");
        json_t *summary = kt_json(kt_read_file("u.json"));
        const char *code =
            json_string_value(json_object_get(json_array_get(json_object_get(summary, "warnings"), 0), "code"));
        kt_check_text(cases[i].unit, code != NULL ? code : "none", cases[i].own != NULL ? "column_unit" : "none");
        json_decref(summary);
        kt_expect(0, cases[i].own != NULL ? words : NULL, "$K check unit.yaml >/dev/null");
    }
}

KT_TEST(quantities_without_columns_are_named) {
    kt_write_file("block.yaml", BLOCK);
    const kt_ran ran = kt_shell("$K run block.yaml --duration 0.1 --out o.csv --record position,effect,state,closure,"
                                "multiplier,'marker velocity'");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("no loops", ran.err, "run: --record: the scene has no multiplier to record\n");
    kt_check_contains("no loops", ran.err, "run: --record: the scene has no closure to record\n");
    kt_check_contains("no --markers", ran.err, "run: --record: the scene has no marker velocity to record\n");
    kt_check_equal_int("nothing else", kt_count_of(ran.err, "to record"), 3);
    kt_expect(0, NULL, "$K run block.yaml --duration 0.1 --out o.csv --record multiplier --quiet");
    const kt_ran clutch =
        kt_shell("$K run " KT_SCENES "/clutch.yaml --duration 0.1 --out o.csv --record multiplier,reaction");
    kt_check_equal_int("reactions have the multipliers", kt_count_of(clutch.err, "to record"), 0);
}
