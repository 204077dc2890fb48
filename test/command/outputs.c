/* Results are written next to their names. They are moved there when they are complete, or when a run has failed and
 * nothing is there. A failed run therefore loses no earlier result, and no result overwrites another or its own input.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* A step far beyond the limit of stability. */
#define FAILING "--integrator euler --step 0.5 --duration 1e4 --interval 0.25"

static void make_scene(void) { kt_expect(0, NULL, "rm -rf *; $K make pendulum --links 3 >p.yaml"); }

KT_TEST(run_that_fails_leaves_the_result_of_an_earlier_one) {
    make_scene();
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 1 --out o.csv --summary o.json");
    kt_expect(0, NULL, "cp o.csv good.csv; cp o.json good.json");
    kt_ran ran = kt_shell("$K run p.yaml " FAILING " --out o.csv --summary o.json");
    kt_check_equal_int("exit code", ran.code, 4);
    kt_check_contains("words", ran.err,
                      "the run stopped early; its records are in o.csv.partial. o.csv of an earlier run is unchanged");
    kt_check_contains("report", ran.err, "summary: o.json.partial");
    kt_expect(0, NULL, "cmp o.csv good.csv && cmp o.json good.json");
    kt_check_above("lines of the part", kt_count_lines(kt_read_file("o.csv.partial")), 10);
    kt_expect(2, "mass is -1", "sed 's/mass: .*/mass: -1/' p.yaml >w.yaml; $K run w.yaml --quiet --out o.csv");
    kt_expect(1, "no method 'none'", "$K run p.yaml --quiet --integrator none --out o.csv");
    kt_expect(0, NULL, "cmp o.csv good.csv");
    /* And one that ends well replaces the whole of it and leaves no part. */
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 2 --out o.csv --summary o.json");
    kt_expect(1, NULL, "cmp -s o.csv good.csv");
    kt_expect(0, NULL, "test ! -e o.csv.partial");
}

KT_TEST(run_that_fails_leaves_its_records_where_there_is_no_earlier_result) {
    make_scene();
    kt_ran ran = kt_shell("$K run p.yaml " FAILING " --out o.csv --summary o.json");
    kt_check_equal_int("exit code", ran.code, 4);
    kt_check_contains("words", ran.err, "the run stopped early; its records are in o.csv\n");
    kt_check_contains("report", ran.err, "summary: o.json\n");
    kt_check_true("nothing of parts", strstr(ran.err, "partial") == NULL);
    kt_expect(0, NULL, "test ! -e o.csv.partial -a ! -e o.json.partial");
    kt_check_above("lines", kt_count_lines(kt_read_file("o.csv")), 10);
    json_t *root = kt_json(kt_read_file("o.json"));
    kt_check_above("the summary is of the same run", kt_json_at(root, "time"), 1.0);
    json_decref(root);
    /* A second one finds this result, and does not touch it. */
    kt_expect(0, NULL, "cp o.csv first.csv");
    kt_expect(4, "its records are in o.csv.partial. o.csv of an earlier run is unchanged",
              "$K run p.yaml " FAILING " --quiet --out o.csv");
    kt_expect(0, NULL, "cmp o.csv first.csv; cmp o.csv.partial first.csv");
}

/* A slider that its loop drives away at 1 m/s from a body that is held to 2 m from the origin. */
static const char parting[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: a, mass: 1, joint: {type: revolute, axis: z}, inertia: [1, 1, 1]}\n"
    "  - {name: s, mass: 1, joint: {type: prismatic, axis: x, position: 1.5}}\n"
    "loops:\n"
    "  - {name: rod, type: distance, between: [{body: a, at: [1, 0, 0]}, {body: s}], length: 1}\n"
    "  - {name: drive, type: motion, joint: s, position: {polynomial: [1.5, 1]}}\n"
    "simulate: {duration: 1, integrator: rk4, step: 1e-3}\n";

KT_TEST(run_that_comes_to_a_contradiction_keeps_its_records) {
    kt_expect(0, NULL, "rm -rf *");
    kt_write_file("p.yaml", parting);
    kt_ran ran = kt_shell("$K run p.yaml --out o.csv --interval 0.01");
    kt_check_equal_int("exit code", ran.code, 3);
    kt_check_contains("words", ran.err, "its records are in o.csv\n");
    const char *text = kt_read_file("o.csv");
    const int last = kt_count_lines(text) - 1;
    /* The rod is stretched out when s = 2, at 0.5 s. The interval of records is 0.01 s. */
    kt_check_near("the last record", kt_csv_number(text, last, 0), 0.495, 0.0051);
    kt_check_equal_int("every one until then", last, (int)lround(kt_csv_number(text, last, 0) / 0.01) + 1);
}

/* The records of a failed run are in NAME or in NAME.partial. In both cases, the run can be resumed from a checkpoint.
 * It gives the same records and the same failure. */
KT_TEST(failed_run_is_resumed_to_the_same_records) {
    static const char *const earlier[] = {"", "echo mine >o.csv;"};
    for (int i = 0; i < 2; i++) {
        const char *part = i == 0 ? "o.csv" : "o.csv.partial";
        make_scene();
        kt_expect(4, part,
                  "%s $K run p.yaml " FAILING " --quiet --out o.csv --checkpoint o.state --checkpoint-interval 1e-9",
                  earlier[i]);
        kt_expect(0, NULL, "cp %s good.csv; test -s good.csv", part);
        kt_expect(4, "its records are in o.csv.partial. o.csv of an earlier run is unchanged",
                  "$K run p.yaml " FAILING " --quiet --out o.csv --resume o.state");
        kt_expect(0, NULL, "cmp o.csv.partial good.csv");
        kt_expect(i == 0 ? 0 : 1, NULL, "cmp -s o.csv good.csv");
    }
}

#ifdef KT_WITH_CAIRO
KT_TEST(picture_of_a_failed_run_is_drawn_in_its_own_format) {
    make_scene();
    kt_write_file("o.svg", "mine");
    kt_check_equal_int("exit code", kt_shell("$K run p.yaml " FAILING " --quiet --out o.csv --plot o.svg").code, 4);
    kt_check_text("the old one", kt_read_file("o.svg"), "mine");
    kt_check_contains("the new one", kt_read_file("o.svg.partial"), "<svg");
}

/* One axis each is in thousandths, so that a picture has the factor once. The factor is in the title of the panel or of
 * the page. */
KT_TEST(factor_of_the_x_axis_stands_with_its_title) {
    kt_write_file("x.csv", "time,position.a,velocity.a\n0,0.001,1\n0.001,0.002,2\n0.002,0.003,-1\n");
    kt_expect(0, "picture: x.svg", "$K plot x.csv --phase a --out x.svg");
    kt_check_contains("its own title", kt_read_file("x.svg"), ">\u22123<");
    kt_expect(0, "replaces an older x.svg of ", "$K plot x.csv --columns velocity.a --out x.svg");
    kt_check_contains("the page's title", kt_read_file("x.svg"), ">\u22123<");
}

/* Curves of effects without a name have different labels. */
KT_TEST(effects_without_a_name_have_their_number_in_legends) {
    kt_write_file("two.yaml", "kinetree: 1\nbodies:\n"
                              "  - {name: a, joint: {type: prismatic, axis: x, position: 0.1}, mass: 2}\n"
                              "effects:\n  - {type: joint_spring, joint: a, stiffness: 30}\n"
                              "  - {type: joint_damper, joint: a, damping: 2}\n"
                              "  - {name: pull, type: motor, joint: a, force: 1}\n"
                              "simulate: {duration: 0.5}\noutput: {record: [effect]}\n");
    kt_expect(0, NULL, "$K run two.yaml --quiet --out two.csv --plot run.svg");
    kt_expect(0, "picture: plot.svg", "$K plot two.csv --out plot.svg");
    for (int i = 0; i < 2; i++) {
        const char *svg = kt_read_file(i == 0 ? "run.svg" : "plot.svg");
        kt_check_contains("the spring", svg, ">effect[0].force<");
        kt_check_contains("the damper", svg, ">effect[1].force<");
        kt_check_contains("a name", svg, ">pull.force<");
    }
}

/* Without a summary, the unit of a joint is 'rad or m'. */
KT_TEST(phase_plane_has_the_units_of_the_summary) {
    kt_write_file("u.csv", "time,position.a,velocity.a\n0,1,1\n1,2,2\n2,3,-1\n");
    kt_expect(0, "picture: u.svg", "$K plot u.csv --phase a");
    kt_check_contains("no summary", kt_read_file("u.svg"), "its position, rad or m<");
    kt_write_file("u.json", "{\"scene\": \"slide\", \"time\": 2.0, \"columns\": {\"position.a\": {\"unit\": \"m\"}, "
                            "\"velocity.a\": {\"unit\": \"m/s\"}}}");
    kt_expect(0, "picture: u.svg", "$K plot u.csv --phase a");
    kt_check_contains("unit of the position", kt_read_file("u.svg"), "its position, m<");
    kt_check_contains("unit of the velocity", kt_read_file("u.svg"), "Velocity of a, m/s<");
}

/* The circle is a path of width 1.6 with curves. */
KT_TEST(one_record_is_drawn_as_a_dot) {
    kt_write_file("one.csv", "time,position.a\n0,1\n");
    kt_expect(0, "picture: one.svg", "$K plot one.csv");
    kt_check_contains("its number", kt_read_file("one.svg"), ">1 record<");
    kt_check_equal_int("a circle", kt_shell("grep 'stroke-width[:=]\"*1.6' one.svg | grep -q ' C '").code, 0);
}

KT_TEST(options_that_a_picture_would_ignore_are_rejected) {
    kt_write_file("r.csv", "time,position.a,velocity.a\n0,1,1\n1,2,2\n2,3,-1\n");
    kt_write_file("s.csv", "run,L,k,status,time,position.a.end,why\n0,1,1,ok,1,2,\n1,2,1,ok,1,3,\n2,3,2,ok,1,4,\n");
    static const char *const cases[][2] = {{"--phase and --columns", "r.csv --phase a --columns position"},
                                           {"--phase and --x", "r.csv --phase a --x position.a"},
                                           {"--phase and --log", "r.csv --phase a --log"},
                                           {"--map and --x", "s.csv --map L,k --x L"},
                                           {"--map and --by", "s.csv --map L,k --by L"},
                                           {"--map and --histogram", "s.csv --map L,k --histogram"},
                                           {"--histogram and --x", "s.csv --histogram --x L"},
                                           {"--histogram and --by", "s.csv --histogram --by L"}};
    char words[80];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        (void)snprintf(words, sizeof words, "plot: %s exclude each other", cases[i][0]);
        kt_expect(1, words, "$K plot %s", cases[i][1]);
    }
    kt_expect(1, "plot: --phase goes with the records of a run, and these are the lines of a sweep",
              "$K plot s.csv --phase a");
}
#endif

KT_TEST(run_without_a_record_leaves_nothing) {
    make_scene();
    kt_write_file("contradiction.yaml",
                  "kinetree: 1\nbodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, "
                  "1, 1]}]\nloops: [{name: l, type: spherical, between: [{body: a, at: [1, 0, "
                  "0]}, {body: world, at: [3, 0, 0]}]}]\nsimulate: {duration: 1}\n");
    kt_write_file("o.csv", "mine\n");
    kt_check_equal_int("exit code", kt_shell("$K run contradiction.yaml --quiet --out o.csv").code, 3);
    kt_check_text("the old one", kt_read_file("o.csv"), "mine\n");
    kt_check_true("no part", kt_read_file("o.csv.partial") == NULL);
}

KT_TEST(two_results_are_never_one_file) {
    make_scene();
    static const char *const same[] = {"--out same --summary same",
                                       "--out same --summary ./same",
                                       "--out same --summary folder/../same",
                                       "--out same --summary folder/back/same",
                                       "--out same --summary same.partial",
                                       "--out same.partial --summary same",
                                       "--out link --summary target",
                                       "--out hard --summary target",
                                       "--out same --checkpoint same",
                                       "--summary same --checkpoint ./same --out o.csv",
                                       "--out o.csv --view a.html --glb a.html",
#ifdef KT_WITH_CAIRO
                                       "--out a.svg --plot ./a.svg",
                                       "--out o.csv --summary a.svg --plot a.svg",
                                       "--out o.csv --view a.html --glb a.html"
#endif
    };
    kt_expect(0, NULL, "mkdir folder; ln -s .. folder/back; echo mine >target; ln -s target link; ln target hard");
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++)
        kt_expect(1, "are one file", "$K run p.yaml --quiet %s", same[i]);
    kt_check_text("nothing was written", kt_read_file("target"), "mine\n");
    kt_expect(0, NULL, "test ! -e same -a ! -e same.partial -a ! -e o.csv -a ! -e a.svg");
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 0.1 --out /dev/null --summary /dev/null");
}

/* `view --view iso` is a slip for `draw --view iso`. */
KT_TEST(pages_and_models_have_names_that_say_so) {
    make_scene();
    kt_write_file("a.svg", "mine\n");
    static const char *const wrong[] = {"run p.yaml --view a.svg", "view p.yaml --view iso", "view p.yaml --view -",
                                        "check p.yaml --view a.svg", "view p.yaml --view .html"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        kt_expect(1, "--view takes the name of a file that ends in .html, not '", "$K %s", wrong[i]);
    kt_expect(1, "--glb takes the name of a file that ends in .glb, not 'a.svg'", "$K run p.yaml --glb a.svg");
    kt_expect(1, "--out writes records as CSV, not 'a.html'; did you mean --view?", "$K run p.yaml --out a.html");
    kt_expect(1, "--out writes records as CSV, not 'a.png'; did you mean --plot?", "$K run p.yaml --out a.png");
    kt_expect(1, "--out writes records as CSV, not 'a.json'; did you mean --summary?", "$K run p.yaml --out a.json");
    kt_expect(1, "--out writes records as CSV, not 'b.yaml'; did you mean --scene?", "$K run p.yaml --out b.yaml");
    kt_expect(1, "--out writes records as CSV, not 'b.gz'; did you mean --out - | gzip?", "$K run p.yaml --out b.gz");
    kt_expect(4, "standard output cannot be written", "$K run p.yaml --out /dev/null --quiet --scene - >/dev/full");
    kt_expect(1, "--summary writes JSON, not 'a.csv'; did you mean --out?", "$K run p.yaml --summary a.csv");
    kt_check_text("what was there", kt_read_file("a.svg"), "mine\n");
    kt_expect(0, NULL, "test ! -e iso -a ! -e ./- -a ! -e p.csv");
    kt_expect(0, NULL,
              "$K run p.yaml --quiet --duration 0.1 --out /dev/null --view /dev/null --glb a.glb && test -s a.glb");
}

KT_TEST(endings_have_letters_of_any_case) {
    make_scene();
    kt_expect(
        0, NULL,
        "$K view p.yaml --quiet --duration 0.1 --out p.HTML && test ! -e p.html -a ! -e p.csv && head -c 15 p.HTML | "
        "grep -qi doctype");
    kt_expect(
        0, NULL,
        "$K run p.yaml --quiet --duration 0.1 --out /dev/null --view q.Html --glb q.GLB && test -s q.Html -a -s q.GLB");
    kt_expect(1, "--out writes records as CSV, not 'a.SVG'; did you mean --plot?", "$K run p.yaml --out a.SVG");
    if (kt_shell("$K draw p.yaml --out r.svg").code == 0) {
        kt_expect(0, NULL, "$K draw p.yaml --out r.PNG 2>r.txt && head -c 4 r.PNG | grep -q PNG");
        kt_expect(0, NULL, "$K draw p.yaml --out s.SVG 2>r.txt && cmp r.svg s.SVG");
    }
}

KT_TEST(result_is_never_what_it_is_made_from) {
    make_scene();
    static const char *const commands[] = {"run p.yaml --out p.yaml",
                                           "run p.yaml --out folder/../p.yaml",
                                           "run p.yaml --out o.csv --summary hard.yaml",
                                           "run link.yaml --out p.yaml",
                                           "run p.yaml --out o.csv --checkpoint link.yaml",
                                           "evaluate p.yaml --out p.yaml",
                                           "equilibrium p.yaml --scene link.yaml",
                                           "accuracy p.yaml --out hard.yaml"};
    kt_expect(0, NULL, "mkdir folder; ln p.yaml hard.yaml; ln -s p.yaml link.yaml; cp p.yaml before.yaml");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        kt_expect(1, "is the scene itself", "$K %s", commands[i]);
    kt_expect(0, NULL, "cmp p.yaml before.yaml");
}

/* The records of traj.yaml have the name of its table by default. */
KT_TEST(result_is_no_file_that_the_scene_reads) {
    static const char table[] = "time,arm\n0,0\n1,1\n2,0.5\n",
                      surface[] = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                                  "endloop\nendfacet\nendsolid s\n";
    static const char *const commands[] = {"run traj.yaml",
                                           "run traj.yaml --out sub/../traj.csv",
                                           "run traj.yaml --out o.csv --summary traj.csv",
                                           "evaluate traj.yaml --out traj.csv",
                                           "sweep traj.yaml --vary simulate.duration=1,2 --out traj.csv",
                                           "accuracy traj.yaml --out traj.csv",
                                           "accuracy traj.yaml --vary simulate.duration=1,2 --out traj.csv",
                                           "run traj.yaml --out o.csv --scene surface.stl",
                                           "export --mjcf traj.yaml --out traj.csv"};
    kt_write_file("traj.csv", table);
    kt_write_file("surface.stl", surface);
    kt_write_file("traj.yaml", "kinetree: 1\nbodies:\n"
                               "  - {name: arm, joint: {type: revolute}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                               "loops:\n  - {name: drive, type: motion, joint: arm, position: {table: traj.csv}}\n"
                               "meshes:\n  - {body: arm, file: surface.stl}\n"
                               "simulate: {duration: 1}\n");
    kt_shell("mkdir -p sub");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        kt_ran ran = kt_shell("$K %s", commands[i]);
        kt_check_equal_int(commands[i], ran.code, 1);
        kt_check_contains(commands[i], ran.err, "is a file that the scene reads; give the results another file");
        kt_check_text("the table", kt_read_file("traj.csv"), table);
        kt_check_text("the surface", kt_read_file("surface.stl"), surface);
    }
}

/* A second run from the records of the first one would otherwise start from records of its own. */
KT_TEST(records_do_not_replace_those_that_they_start_from) {
    kt_shell("$K make pendulum >p.yaml");
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 0.1 --summary p.json");
    char *records = strdup(kt_read_file("p.csv"));
    kt_expect(1, "run: p.csv is the result to start from; give the results another file",
              "$K run p.yaml --quiet --from p.csv:0.05");
    kt_expect(1, "run: p.json is the result to start from", "$K run p.yaml --quiet --from p.json --summary p.json");
    kt_expect(1, "run: p.csv is written as p.csv.partial first, which is the result to start from; give the results",
              "cp p.csv p.csv.partial; $K run p.yaml --quiet --from p.csv.partial --out p.csv");
    kt_expect(0, NULL, "cmp p.csv p.csv.partial; rm p.csv.partial");
    kt_check_text("records", kt_read_file("p.csv"), records);
    kt_expect(0, NULL, "$K run p.yaml --quiet --from p.csv:0.05 --duration 0.1 --out rest.csv");
    free(records);
}

/* The command line names the source alone. A header of a program next to it was replaced in silence. */
KT_TEST(header_that_no_export_has_written_is_not_replaced) {
    kt_expect(0, NULL, "$K make pendulum >p.yaml; echo '#define ARM 1' >arm.h");
    kt_expect(1, "--c would replace arm.h, which no export has written; rename it", "$K export --c p.yaml --out arm.c");
    kt_expect(0, NULL, "echo '#define ARM 1' | cmp - arm.h && test ! -e arm.c && rm arm.h");
    for (int i = 0; i < 2; i++) /* an exported header is replaced */
        kt_expect(0, NULL, "$K export --c p.yaml --out arm.c && grep -q 'generated by Kinetree' arm.h");
}

KT_TEST(result_keeps_its_links_and_permissions) {
    make_scene();
    struct stat status;
    kt_expect(0, NULL, "mkdir folder; echo mine >folder/target; chmod 640 folder/target; ln -s folder/target o.csv");
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 0.1 --out o.csv");
    kt_check_true("still a link", lstat("o.csv", &status) == 0 && S_ISLNK(status.st_mode));
    kt_check_true("of the same permissions", stat("folder/target", &status) == 0 && (status.st_mode & 0777) == 0640);
    kt_check_above("lines", kt_count_lines(kt_read_file("folder/target")), 10);
    kt_expect(0, NULL, "test ! -e folder/target.partial");
}

KT_TEST(run_tells_which_results_it_replaces) {
    kt_expect(0, NULL, "$K make pendulum >again.yaml && rm -f again.csv again.json");
    kt_ran ran = kt_shell("$K run again.yaml --duration 0.1");
    kt_check_true("nothing yet", strstr(ran.err, "replaces") == NULL);
    kt_expect(0, NULL, "touch -d '2020-01-31 12:00' again.csv && touch -d '2021-02-01 13:30' again.json");
    kt_expect(0, "  replaces an older again.csv of 2020-01-31 12:00, again.json of 2021-02-01 13:30\n",
              "$K run again.yaml --duration 0.1 --summary again.json");
    kt_check_text("quiet", kt_shell("$K run again.yaml --duration 0.1 --quiet").err, "");
}

KT_TEST(demo_replaces_results_only_by_force) {
    make_scene();
    kt_write_file("pendulum.csv", "mine\n");
    kt_expect(1, "demo: pendulum.csv exists already; --force replaces it, --out FILE writes elsewhere",
              "$K demo pendulum --quiet --duration 0.1");
    kt_write_file("s.json", "mine\n");
    kt_expect(1, "demo: s.json exists already", "$K demo pendulum --quiet --out new.csv --summary s.json");
    kt_check_text("the old one", kt_read_file("pendulum.csv"), "mine\n");
    kt_expect(0, NULL, "$K demo pendulum --quiet --duration 0.1 --out new.csv");
    kt_expect(0, NULL, "$K demo pendulum --quiet --duration 0.1 --out /dev/null");
    kt_expect(0, NULL, "$K demo pendulum --force --quiet --duration 0.1");
    kt_check_above("lines", kt_count_lines(kt_read_file("pendulum.csv")), 10);
    kt_check_contains("view", kt_read_file("pendulum.html"), "<!doctype html>");
    kt_expect(1, "demo: pendulum.html exists already; --force replaces it",
              "rm pendulum.csv && $K demo pendulum --quiet");
    kt_check_contains("help", kt_shell("$K demo --help").out, "--force");
}

/* A run that ended, taken up again at its last checkpoint: its records are copied, and stay until the end. */
KT_TEST(finished_run_is_resumed_to_the_same_records) {
    make_scene();
    kt_expect(0, NULL,
              "$K run p.yaml --quiet --duration 3 --out o.csv --checkpoint o.state --checkpoint-interval 1e-9");
    kt_expect(0, NULL, "cp o.csv good.csv");
    kt_expect(0, NULL, "$K run p.yaml --quiet --duration 3 --out o.csv --resume o.state");
    kt_expect(0, NULL, "cmp o.csv good.csv; test ! -e o.csv.partial");
}
