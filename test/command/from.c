/* Going on: a scene that starts from the result of another run. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A chain whose spring is slack at the start, and a loop whose length is that at the given positions. */
static const char chain[] = "kinetree: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "bodies:\n"
                            "  - {name: arm, joint: {type: revolute, position: 30 deg, velocity: 1}, mass: 1,\n"
                            "     shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}\n"
                            "  - {name: ball, parent: arm, joint: {type: spherical, at: [1, 0, 0]}, mass: 1,\n"
                            "     com: [0.1, 0, 0], inertia: [1, 1, 1], markers: {tip: [1, 0, 0]}}\n"
                            "  - {name: crank, joint: {type: revolute, at: [0, 0, 1]}, mass: 1,\n"
                            "     shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}\n"
                            "loops:\n"
                            "  - {name: bar, type: distance, between: [arm.tip, crank.tip]}\n"
                            "effects:\n"
                            "  - {name: strut, type: spring, between: [ball.tip, world], stiffness: 10}\n"
                            "simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}\n"
                            "output: {interval: 0.125}\n";

/* Over the second half the error of the state at 1 s, 1e-12 a step, grows by no more than a thousand. */
static void check_same_end(const char *what, const json_t *whole, const char *summary) {
    json_t *part = kt_json(kt_read_file(summary));
    kt_check_near(what, kt_json_at(part, "position.arm"), kt_json_at(whole, "position.arm"), 1e-9);
    kt_check_near("  velocity", kt_json_at(part, "velocity.arm"), kt_json_at(whole, "velocity.arm"), 1e-9);
    kt_check_near("  quaternion", kt_json_at(part, "position.ball[0]"), kt_json_at(whole, "position.ball[0]"), 1e-9);
    kt_check_near("  other side of the loop", kt_json_at(part, "position.crank"), kt_json_at(whole, "position.crank"),
                  1e-9);
    kt_check_near("  energy", kt_json_at(part, "energy.total"), kt_json_at(whole, "energy.total"), 1e-8);
    json_decref(part);
}

KT_TEST(a_run_goes_on_from_a_summary_a_record_and_a_written_scene) {
    kt_write_file("chain.yaml", chain);
    json_t *whole = kt_json(kt_shell("$K run chain.yaml --quiet --out all.csv --summary -").out);
    kt_expect(0, "  scene: end.yaml\n",
              "$K run chain.yaml --duration 1 --out half.csv --summary half.json --scene end.yaml");
    kt_expect(0, NULL, "$K run chain.yaml --from half.json --duration 1 --quiet --out a.csv --summary a.json");
    check_same_end("from a summary", whole, "a.json");
    kt_expect(0, NULL, "$K run chain.yaml --from half.csv --duration 1 --quiet --out b.csv --summary b.json");
    check_same_end("from records", whole, "b.json");
    kt_expect(0, NULL, "$K run chain.yaml --from all.csv:1 --duration 1 --quiet --out c.csv --summary c.json");
    check_same_end("from a record", whole, "c.json");
    kt_expect(0, NULL, "$K run end.yaml --duration 1 --quiet --out d.csv --summary d.json");
    check_same_end("the scene that was written", whole, "d.json");
    json_decref(whole);
}

/* The result is named from the scene's own folder, in every subcommand. */
KT_TEST(a_scene_names_the_result_that_it_starts_from) {
    char text[2048];
    kt_write_file("chain.yaml", chain);
    snprintf(text, sizeof text, "%sinitial: {from: mid.json}\n", chain);
    kt_shell("mkdir -p sub");
    kt_write_file("sub/on.yaml", text);
    kt_expect(0, NULL, "$K run chain.yaml --quiet --duration 1 --out /dev/null --summary sub/mid.json");
    json_t *start = kt_json(kt_read_file("sub/mid.json")), *now = kt_json(kt_shell("$K evaluate sub/on.yaml").out);
    kt_check_near("energy of the start", kt_json_at(now, "energy.kinetic"), kt_json_at(start, "energy.kinetic"), 2e-13);
    json_decref(now);
    json_decref(start);
    kt_expect(2, "mid.json: cannot be read", "cp sub/on.yaml lost.yaml; $K check lost.yaml");
}

KT_TEST(what_does_not_fit_is_told) {
    kt_write_file("chain.yaml", chain);
    kt_write_file("r.json", "{\"time\": 1, \"position\": {\"arm\": 0.5, \"bal\": [1, 0, 0, 0]}, \"velocity\": {}}");
    kt_ran ran = kt_shell("$K run chain.yaml --from r.json --duration 0.1 --quiet --out /dev/null");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("velocities", ran.err, "r.json has no velocities of 1 joint, which starts at rest");
    kt_check_contains("another name", ran.err, "a joint 'bal', which the scene does not have; did you mean 'ball'?");
    kt_check_contains("missing ones", ran.err, "r.json has no state of ball, crank: the values of the scene stay");
    kt_write_file("r.json", "{\"time\": 1, \"position\": {\"arm\": [1, 2]}}");
    kt_expect(2, "joint 'arm' has 2 positions there, and 1 in the scene", "$K run chain.yaml --from r.json");
    kt_write_file("r.json", "{\"time\": 1, \"position\": {\"x\": 1}}");
    kt_expect(2, "has the state of no joint of the scene", "$K run chain.yaml --from r.json");
    kt_expect(1, "which has the state at its end alone, t = 1 s, not that at 0.5 s",
              "$K run chain.yaml --from r.json:0.5");
    kt_write_file("r.json", "{\"time\": 1,\n \"position\": }");
    kt_expect(2, "r.json:2:", "$K run chain.yaml --from r.json");
    kt_expect(1, "give one of them", "$K run chain.yaml --from r.json --resume x");
    kt_write_file("r.csv", "time,position.arm,velocity.arm\n0,1,0\n0.5,2,0\n");
    kt_expect(1, "--from takes FILE or FILE:TIME, and 'x' is no time; write ", "$K run chain.yaml --from r.csv:x");
    kt_expect(0, "has no record at 0.4 s; the nearest record, at 0.5 s, is used",
              "$K run chain.yaml --from r.csv:0.4 --duration 0.1 --quiet --out /dev/null");
    kt_write_file("part.csv",
                  "time,position.ball[0],position.ball[1],position.ball[2],position.ball[3],velocity.ball[0]\n"
                  "0,1,0,0,0,7\n");
    kt_expect(0, "part.csv has no velocities of 1 joint, which starts at rest",
              "$K run chain.yaml --from part.csv --duration 0.1 --quiet --out part-run.csv --record velocity");
    ran = kt_shell(
        "awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == \"velocity.ball[0]\") k = i } NR == 2 { print $k }' "
        "part-run.csv");
    kt_check_text("of a part of the columns nothing is taken", ran.out, "0\n");
    char text[2048];
    const char *simulate = strstr(chain, "simulate:");
    snprintf(text, sizeof text, "%.*s  - {type: motor, joint: arm, torque: {sine: {amplitude: 1, frequency: 1}}}\n%s",
             (int)(simulate - chain), chain, simulate);
    kt_write_file("driven.yaml", text);
    kt_expect(0, "functions of time begin anew",
              "$K run driven.yaml --from r.csv --duration 0.1 --quiet --out /dev/null");
    for (int with_t = 0; with_t < 2; with_t++) { /* a formula that reads t, or does not though it has the letter */
        snprintf(text, sizeof text, "%.*s  - {type: expression, joint: arm, force: \"tan(position.arm) - %s*2\"}\n%s",
                 (int)(simulate - chain), chain, with_t ? "t" : "atan(1)", simulate);
        kt_write_file("driven.yaml", text);
        ran = kt_shell("$K run driven.yaml --from r.csv --duration 0.1 --quiet --out /dev/null");
        kt_check_equal_int("exit code", ran.code, 0);
        kt_check_true("a formula of time is told", (strstr(ran.err, "begin anew") != NULL) == (with_t != 0));
    }
}

/* A summary with a text in a list took 0 in silence; records with a text ended as a failed integration. */
KT_TEST(result_with_values_that_are_no_numbers_is_rejected) {
    kt_write_file("chain.yaml", chain);
    kt_write_file("r.csv", "time,position.arm,velocity.arm\n0,oops,0\n0.5,2,oops\n");
    kt_expect(2, "r.csv: the position of 'arm' is no finite number there", "$K run chain.yaml --from r.csv:0");
    kt_expect(2, "r.csv: the velocity of 'arm' is no finite number there", "$K run chain.yaml --from r.csv");
    kt_write_file("r.json", "{\"time\": 1, \"position\": {\"ball\": [1, 0, null, \"0\"]}, \"velocity\": {}}");
    kt_expect(2, "r.json: the position of 'ball' is no finite number there", "$K run chain.yaml --from r.json");
}

/* A result has neither the counts of events nor the time that their formulas read. */
KT_TEST(times_and_limits_of_events_that_begin_anew_are_reported) {
    static const char scene[] = "kinetree: 1\n"
                                "bodies: [{name: a, joint: {type: prismatic, position: 0.3}, mass: 1}]\n"
                                "%s"
                                "simulate: {duration: 1%s}\n";
    static const struct {
        const char *events, *until, *timed, *limited;
    } cases[] = {
        {"events: [{name: hit, when: position.a, limit: 2, then: record}]\n", "", NULL,
         "the limit of 'hit' counts from 0"},
        {"events: [{name: stop here, when: t > 1.5, then: stop}]\n", "", "the time in 'stop here' begins anew", NULL},
        {"states: {x: {rate: 0}}\nevents: [{name: keep, when: position.a, then: {set: {x: t}}}]\n", "",
         "the time in 'keep' begins anew", NULL},
        {"", ", until: t > 3", "the time in 'until' begins anew", NULL},
        {"events: [{name: a, when: t - 1, limit: 1, then: stop}, {name: b, when: t - 2, limit: 1, then: stop}]\n", "",
         "the time in 'a', 'b' begins anew", "the limit of 'a', 'b' counts from 0"},
        {"events: [{name: top, when: position.a, then: record}]\n", "", NULL, NULL},
    };
    kt_write_file("r.csv", "time,position.a,velocity.a\n0,1,0\n");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        snprintf(text, sizeof text, scene, cases[i].events, cases[i].until);
        kt_write_file("timed.yaml", text);
        const kt_ran ran = kt_shell("$K run timed.yaml --from r.csv --duration 0.1 --quiet --out /dev/null");
        kt_check_equal_int("exit code", ran.code, 0);
        if (cases[i].timed != NULL)
            kt_check_contains("times", ran.err, cases[i].timed);
        if (cases[i].limited != NULL)
            kt_check_contains("limits", ran.err, cases[i].limited);
        kt_check_true("no times", cases[i].timed != NULL || strstr(ran.err, "t = 0") == NULL);
        kt_check_true("no limits", cases[i].limited != NULL || strstr(ran.err, "limit") == NULL);
    }
}

/* Masses, rest positions and thrusts that are functions of time begin anew, too. A scene that `run --scene` writes has
 * the same parts. Both were continued in silence. */
KT_TEST(parts_that_begin_anew_are_reported_for_both_ways_to_go_on) {
    static const char scene[] = "kinetree: 1\n"
                                "bodies: [{name: a, joint: {type: prismatic}, mass: %s}]\n"
                                "%s"
                                "simulate: {duration: 1}\n";
    static const char functions[] = "functions of time begin anew", mass[] = "the mass of 'a' is a function of time",
                      ramp[] = "{ramp: {from: 2, to: 1, start: 0, end: 1}}";
    static const struct {
        const char *mass, *more, *expected;
    } cases[] = {
        {ramp, "", mass},
        {"1", "effects: [{type: joint_spring, joint: a, stiffness: 1, rest: \"sin(t)\"}]\n", functions},
        {"1", "effects: [{type: thrust, at: a, mass: \"2 - t\", exhaust: [0, 0, 1]}]\n", functions},
        {"1", "loops: [{name: m, type: motion, joint: a, position: \"t^2\"}]\n", functions},
        {"1", "events: [{name: e, when: t - 2, then: stop}]\n", "the time in 'e' begins anew"},
        {"1", "events: [{name: e, when: position.a - 2, then: stop, limit: 1}]\n", "the limit of 'e' counts from 0"},
        {"1", "effects: [{type: joint_spring, joint: a, stiffness: 1, rest: 2}]\n", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        snprintf(text, sizeof text, scene, cases[i].mass, cases[i].more);
        kt_write_file("anew.yaml", text);
        static const char *const ways[][2] = {
            {"--scene", "$K run anew.yaml --duration 0.5 --out /dev/null --scene l.yaml --summary e.json"},
            {"--from", "$K run anew.yaml --from e.json --duration 0.1 --out /dev/null"}};
        for (int k = 0; k < 2; k++) {
            const kt_ran ran = kt_shell("%s", ways[k][1]);
            kt_check_equal_int("exit code", ran.code, 0);
            if (cases[i].expected != NULL)
                kt_check_contains(ways[k][0], ran.err, cases[i].expected);
            else
                kt_check_true("nothing begins anew", strstr(ran.err, "t = 0") == NULL);
        }
    }
}

/* A four-bar whose rocker's angle is but a guess. */
static const char fourbar[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, position: 60 deg}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]},\n"
    "     markers: {tip: [0.3, 0, 0]}}\n"
    "  - {name: coupler, parent: crank, joint: {type: revolute, at: [0.3, 0, 0], position: %s}, mass: 1,\n"
    "     shape: {type: rod, to: [0.8, 0, 0]}, markers: {tip: [0.8, 0, 0]}}\n"
    "  - {name: rocker, joint: {type: revolute, at: [0.7, 0, 0], position: %s}, mass: 1,\n"
    "     shape: {type: rod, to: [0.7, 0, 0]}, markers: {tip: [0.7, 0, 0]}}\n"
    "loops: [{name: close, type: revolute, between: [coupler.tip, rocker.tip]}]\n";

static double rocker_of(const char *coupler, const char *rocker, const char *told) {
    char text[2048];
    snprintf(text, sizeof text, fourbar, coupler, rocker);
    kt_write_file("fourbar.yaml", text);
    const kt_ran ran = kt_shell("$K run fourbar.yaml --duration 0 --out /dev/null --summary s.json");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_true(told != NULL ? told : "nothing is told",
                  told != NULL ? strstr(ran.err, told) != NULL : strstr(ran.err, "moved") == NULL);
    json_t *root = kt_json(kt_read_file("s.json"));
    const double angle = kt_json_at(root, "position.rocker");
    if (told == NULL)
        kt_check_near("the crank stays", kt_json_at(root, "position.crank"), 1.0471975511965976, 1e-14);
    json_decref(root);
    return angle;
}

/* |A + B e^(i rocker)|: by the law of cosines the joint of coupler and rocker lies on one of two sides. */
KT_TEST(a_guess_that_assembly_moves_is_not_told) {
    const double above = rocker_of("-20 deg, guess: true", "100 deg, guess: true", NULL);
    const double below = rocker_of("-150 deg, guess: true", "-120 deg, guess: true", NULL);
    const double x = 0.3 * 0.5 - 0.7, y = 0.3 * sqrt(0.75), d = hypot(x, y), bearing = atan2(y, x);
    const double half = acos((d * d + 0.7 * 0.7 - 0.8 * 0.8) / (2.0 * d * 0.7));
    kt_check_near("the side of the guess", above, bearing - half, 1e-9);
    kt_check_near("the other side", remainder(below - (bearing + half), 6.283185307179586), 0.0, 1e-9);
    (void)rocker_of("-20 deg", "100 deg", "assembly moved initial values that the scene gives");
}

/* At 1 s, a string and a floor have been released, a brake is engaged, and a drive is off. */
static const char let_go[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: stone, joint: {type: planar, position: [1, 0, 0]}, mass: 0.3, inertia: [1, 1, 1]}\n"
    "  - {name: clock, joint: {type: prismatic, axis: z, velocity: 1}, mass: 1}\n"
    "  - {name: block, joint: {type: prismatic, axis: y}, mass: 1}\n"
    "  - {name: wheel, joint: {type: revolute, axis: z, velocity: 5}, mass: 1, inertia: [1, 1, 1]}\n"
    "  - {name: rotor, joint: {type: revolute, axis: z}, mass: 1, inertia: [1, 1, 1]}\n"
    "loops:\n"
    "  - {name: string, type: distance, between: [world, stone], length: 1}\n"
    "effects:\n"
    "  - {name: floor, type: joint_limit, joint: block, lower: 0, restitution: 0}\n"
    "  - {name: brake, type: joint_friction, joint: wheel, coulomb: 1, stick: true, switched: off}\n"
    "  - {name: drive, type: motor, joint: rotor, torque: 1}\n"
    "events:\n"
    "  - {name: now, when: position.clock - 0.6, then: [{release: string}, {release: floor}, {engage: brake}, "
    "{release: drive}]}\n"
    "simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}\n"
    "output: {interval: 0.125}\n";

static void check_same_motion(const char *what, const json_t *whole, const char *summary) {
    static const char *const joints[] = {"stone[0]", "stone[1]", "clock", "block", "wheel", "rotor"};
    json_t *part = kt_json(kt_read_file(summary));
    kt_note("%s", what);
    for (size_t i = 0; i < sizeof joints / sizeof *joints; i++) {
        char at[64];
        snprintf(at, sizeof at, "position.%s", joints[i]);
        kt_check_near(joints[i], kt_json_at(part, at), kt_json_at(whole, at), 1e-13);
    }
    json_decref(part);
}

KT_TEST(what_is_released_stays_so_where_a_run_goes_on) {
    kt_write_file("go.yaml", let_go);
    kt_expect(0, NULL, "$K run go.yaml --quiet --out all.csv --summary all.json");
    json_t *whole = kt_json(kt_read_file("all.json"));
    kt_expect(0, NULL, "$K run go.yaml --quiet --duration 1 --out half.csv --summary half.json --scene end.yaml");
    kt_expect(0, NULL, "$K run go.yaml --quiet --from half.json --duration 1 --out a.csv --summary a.json");
    check_same_motion("from a summary", whole, "a.json");
    kt_expect(0, NULL, "$K run end.yaml --quiet --duration 1 --out b.csv --summary b.json");
    check_same_motion("the scene that was written", whole, "b.json");
    kt_expect(3, "half.csv does not list the released loops and effects: string, floor, brake, drive begin",
              "$K run go.yaml --from half.csv --duration 1 --out c.csv");
    json_decref(whole);
}
