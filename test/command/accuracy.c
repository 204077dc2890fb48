/* kinetree accuracy and kinetree plot: their prints, files and drawings, and their errors for wrong command lines. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include "kinetree/method.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char pendulum[] = "kinetree: 1\n"
                               "name: a pendulum\n"
                               "gravity: [0, -9.81, 0]\n"
                               "bodies:\n"
                               "  - name: bob\n"
                               "    joint: {type: revolute, position: 1}\n"
                               "    mass: 1\n"
                               "    shape: {type: point, at: [0, -1, 0]}\n"
                               "simulate: {duration: 2}\n";

/* Ends within a few seconds on any machine: few methods, few settings. */
static const char quick[] = "--integrators=rk4,dopri5 --steps=0.02,0.01,0.005 --tolerances=1e-5,1e-7,1e-9 --quiet";

/* The line of a method at a setting; -1: none. */
static int find_row(const char *csv, const char *method, double setting) {
    char start[64];
    snprintf(start, sizeof start, "\n,%s,", method);
    const int column = kt_csv_column(csv, "setting");
    int line = 0;
    for (const char *at = csv; (at = strchr(at, '\n')) != NULL; at++) {
        line++;
        if (strncmp(at, start, strlen(start)) == 0 && kt_csv_number(csv, line, column) == setting)
            return line;
    }
    return -1;
}

/* Errors of velocities and of columns: each relation between them is exact. A quantity in other units has its error in
 * these units, and the only column of a pendulum's velocity has the error of velocities. */
KT_TEST(accuracy_of_velocities_and_columns) {
    static const char few[] = "--integrators=dopri5 --tolerances=1e-5,1e-7 --quiet --plot=/dev/null";
    kt_write_file("p.yaml", pendulum);
    kt_expect(0, NULL, "$K accuracy p.yaml %s --out v.csv --of velocity.bob", few);
    kt_expect(0, NULL, "$K accuracy p.yaml %s --out q.csv --of '1000*position.bob'", few);
    for (int line = 1; line <= 2; line++) {
        const char *csv = kt_read_file("v.csv");
        const double velocity = kt_csv_number(csv, line, kt_csv_column(csv, "error.velocity"));
        const double column = kt_csv_number(csv, line, kt_csv_column(csv, "error.quantity"));
        kt_check_above("a velocity error", velocity, 1e-9);
        kt_check_equal_bits("of the column", &column, &velocity, 1);
        csv = kt_read_file("q.csv");
        const double position = kt_csv_number(csv, line, kt_csv_column(csv, "error.position"));
        kt_check_near("in other units", kt_csv_number(csv, line, kt_csv_column(csv, "error.quantity")), 1e3 * position,
                      1e-9 * 1e3 * position + 1e-12);
    }
    kt_ran ran = kt_shell("$K accuracy p.yaml --integrators=dopri5 --of velocity --goal 1e-6 --budget 2");
    kt_check_contains("said", ran.out, "errors of velocities are the largest over all joints and records, in rad/s");
    kt_check_contains("recommended", ran.out, "for 1e-06 rad/s use dopri5");
    ran = kt_shell("$K accuracy p.yaml --integrators=dopri5 --of reaction.bob.fy --goal 1e-6 --budget 2");
    kt_check_contains("said", ran.out, "errors are the largest of 'reaction.bob.fy' over all records, in N");
    kt_check_contains("recommended", ran.out, "for 1e-06 N use dopri5");
    kt_expect(2, "accuracy: --of reaction.bib.fy: there is no name 'reaction.bib.fy'",
              "$K accuracy p.yaml --of reaction.bib.fy");
    kt_expect(1, "is zero during the whole motion", "$K accuracy p.yaml %s --of reaction.bob.fz", few);
    kt_expect(1, "--peers and --baselines compare positions", "$K accuracy p.yaml --peers --of velocity");
}

/* The estimate of --check-error is near the true error, which a run at 1e-13 shows. */
KT_TEST(run_estimates_its_error_by_a_second_run) {
    static const char *const settings[] = {"--tolerance 1e-5", "--tolerance 1e-8",
                                           "--integrator radau5 --tolerance 1e-6", "--integrator rk4 --step 0.02"};
    kt_write_file("p.yaml", pendulum);
    kt_expect(0, NULL, "$K run p.yaml --integrator dop853 --tolerance 1e-13 --interval 0.01 --out exact.csv --quiet");
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        kt_ran ran =
            kt_shell("$K run p.yaml %s --interval 0.01 --out r.csv --summary s.json --check-error", settings[i]);
        kt_need(kt_check_equal_int(settings[i], ran.code, 0));
        kt_check_contains("printed", ran.err, "  error: about ");
        kt_check_contains("printed", ran.err, "estimated by a second run with ");
        char *exact = strdup(kt_read_file("exact.csv"));
        const char *run = kt_read_file("r.csv");
        double worst = 0.0;
        for (int line = 1; line <= 201; line++)
            worst = fmax(worst, fabs(kt_csv_number(run, line, 1) - kt_csv_number(exact, line, 1)));
        free(exact);
        const char *summary = kt_read_file("s.json"), *error = strstr(summary, "\"error\": {");
        kt_need(kt_check_true("in the summary", error != NULL));
        const char *angle = strstr(error, "\"angle\": ");
        kt_need(kt_check_true("its angle", angle != NULL));
        kt_check_above("the error", worst, 1e-12);
        kt_check_near("the estimate over the error", strtod(angle + strlen("\"angle\": "), NULL) / worst, 1.0, 0.5);
    }
    kt_expect(1, "--check-error compares the whole run", "$K run p.yaml --check-error --resume x");
}

KT_TEST(accuracy_writes_every_run) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran = kt_shell("$K accuracy p.yaml %s --out a.csv", quick);
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_text("quiet", ran.out, "");
    const char *csv = kt_read_file("a.csv");
    kt_need(kt_check_equal_int("lines", kt_count_lines(csv), 7));
    const int position = kt_csv_column(csv, "error.position"), cpu = kt_csv_column(csv, "cpu");
    const int coarse = find_row(csv, "rk4", 0.01), fine = find_row(csv, "rk4", 0.005);
    const int adaptive = find_row(csv, "dopri5", 1e-9);
    const double ratio = kt_csv_number(csv, coarse, position) / kt_csv_number(csv, fine, position);
    kt_check_near("order of rk4", log2(ratio), 4.0, 0.1);
    kt_check_below("dopri5 at 1e-9", kt_csv_number(csv, adaptive, position), 1e-8);
    kt_check_above("dopri5 at 1e-9", kt_csv_number(csv, adaptive, position), 1e-10);
    kt_check_equal_int("steps", (int)kt_csv_number(csv, fine, kt_csv_column(csv, "steps")), 400);
    kt_check_equal_int("evaluations", (int)kt_csv_number(csv, fine, kt_csv_column(csv, "evaluations")), 1600);
    kt_check_true("time", kt_csv_number(csv, fine, cpu) > 0.0);
}

/* The outputs go to the present folder under the scene's name, as with `kinetree run`. The records have another
 * name. */
KT_TEST(accuracy_writes_by_default_what_it_found) {
    static const char few[] = "--integrators=rk4 --steps=0.02,0.01 --quiet";
    kt_expect(0, NULL, "rm -rf d; mkdir d");
    kt_write_file("d/p.yaml", pendulum);
    kt_expect(0, NULL, "rm -f p-accuracy.*; $K accuracy d/p.yaml %s", few);
    kt_check_equal_int("lines", kt_count_lines(kt_read_file("p-accuracy.csv")), 3);
    kt_expect(0, NULL, "cd d; $K accuracy p.yaml %s --out - >lines; test $(wc -l <lines) -eq 3 -a ! -e p-accuracy.csv",
              few);
    kt_expect(0, NULL,
              "cd d; rm -f p-accuracy.*; $K accuracy p.yaml %s --out /dev/null --plot /dev/null; "
              "test \"$(echo *)\" = 'lines p.yaml'",
              few);
    kt_expect(1, "p-accuracy.csv is the reference itself", "$K accuracy d/p.yaml %s --reference p-accuracy.csv", few);
#ifdef KT_WITH_CAIRO
    kt_check_contains("the picture", kt_read_file("p-accuracy.svg"), "<svg");
    kt_expect(0, NULL, "cd d; $K accuracy p.yaml %s --plot-dark dark.svg; test -s dark.svg -a ! -e p-accuracy.svg",
              few);
#endif
}

/* The sentence names a setting; run by itself at that setting, the error is within the goal. */
KT_TEST(recommended_setting_reaches_the_goal_when_it_is_run) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran = kt_shell("$K accuracy p.yaml --integrators dopri5 --goal 1e-6 --budget 3");
    static const char start[] = "for 1e-06 rad use dopri5 with tolerance ";
    const char *sentence = strstr(ran.out, start);
    kt_check_equal_int("exit code", ran.code, 0);
    kt_need(kt_check_true("the sentence", sentence != NULL));
    const double tolerance = strtod(sentence + strlen(start), NULL);
    kt_check_true("its setting", tolerance > 0.0);
    kt_check_contains("its cost", sentence, " per simulated second\n");
    ran =
        kt_shell("$K run p.yaml --tolerance %.17g --interval 0.01 --out fast.csv --quiet && $K run p.yaml --integrator "
                 "dop853 --tolerance 1e-13 --interval 0.01 --out exact.csv --quiet",
                 tolerance);
    kt_check_equal_int("runs", ran.code, 0);
    char *exact = strdup(kt_read_file("exact.csv"));
    const char *fast = kt_read_file("fast.csv");
    double worst = 0.0;
    for (int line = 1; line <= 201; line++)
        worst = fmax(worst, fabs(kt_csv_number(fast, line, 1) - kt_csv_number(exact, line, 1)));
    kt_check_below("error", worst, 1e-6);
    kt_check_above("but not for nothing", worst, 1e-9);
    free(exact);
}

KT_TEST(accuracy_says_how_it_was_made) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran = kt_shell("$K accuracy p.yaml --integrators rk4,dopri5 --budget 2 --prices");
    static const char *const parts[] = {
        "a pendulum\n  2 s in 200 records",
        "in rad, angles on the circle",
        "reference: dop853 at tolerance 1e-13, checked by tsit5 at 1e-13: they differ by ",
        "a small error grows",
        "\n  rk4                4  h^",
        "\n  dopri5             5  tol^",
        "for 0.001 rad use ",
        "with its records",
        "absolute formulation"};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        kt_check_contains("table", ran.out, parts[i]);
#ifdef KT_WITH_CAIRO
    kt_check_text("no words but of files", ran.err, "  every run: p-accuracy.csv\n  picture: p-accuracy.svg\n");
#else
    kt_check_text("no words but of files", ran.err, "  every run: p-accuracy.csv\n");
#endif
}

/* A formulation that a scene cannot have is a line of the table, and no failure of the study. */
KT_TEST(price_of_what_a_scene_cannot_have_is_its_reason) {
    kt_write_file(
        "lag.yaml",
        "kinetree: 1\nbodies: [{name: a, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1]}]\n"
        "states: {x: {initial: 1, rate: \"-x\"}}\n"
        "simulate: {duration: 1}\n");
    const kt_ran ran = kt_shell("$K accuracy lag.yaml --integrators rk4,dopri5 --budget 2 --prices");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("line", ran.out, "\n  absolute formulation       fails: the model has auxiliary states");
}

/* Nothing moves; rounding alone moves; the amplitude is below tolerances; the budget ends before explicit methods have
 * a stable step. */
KT_TEST(accuracy_names_what_cannot_be_studied) {
    static const char form[] = "kinetree: 1\ngravity: [0, -9.81, 0]\n"
                               "bodies: [{name: p, joint: {type: revolute, axis: z, position: %s}, mass: 1, shape: "
                               "{type: point, at: [0, -1, 0]}}]\nsimulate: {duration: 10}\n";
    char scene[400];
    (void)snprintf(scene, sizeof scene, form, "0");
    kt_write_file("rest.yaml", scene);
    kt_ran ran = kt_shell("$K accuracy rest.yaml --integrators rk4 2>&1");
    kt_check_contains("rest", ran.out, "nothing moves in 10 s");
    (void)snprintf(scene, sizeof scene, form, "180 deg");
    kt_write_file("upright.yaml", scene);
    ran = kt_shell("$K accuracy upright.yaml --integrators rk4 2>&1");
    kt_check_contains("unstable", ran.out, "the motion starts at an unstable rest: rounding alone moves it");
    (void)snprintf(scene, sizeof scene, form, "1e-8");
    kt_write_file("tiny.yaml", scene);
    ran = kt_shell("$K accuracy tiny.yaml --integrators dopri5 --goal 1e-12 --budget 4 2>&1");
    kt_check_contains("tiny", ran.out, "hence absolute tolerances are 1e-08 times these");
    kt_check_contains("use", ran.out, "use dopri5 with tolerance ");
    kt_write_file("stiff.yaml", "kinetree: 1\n"
                                "bodies: [{name: p, joint: {type: prismatic, axis: x, position: 1}, mass: 1}]\n"
                                "effects: [{type: joint_spring, joint: p, stiffness: 2e5, damping: 1e5}]\n"
                                "simulate: {duration: 3}\n");
    ran = kt_shell("$K accuracy stiff.yaml --integrators dop853,radau5 --budget 0.5 2>&1");
    kt_check_contains("budget", ran.out, "the time was used up (--budget)");
    kt_check_true("no limit of an L-stable method", strstr(ran.out, "stable to'") == NULL);
}

/* Two pendulums start from the horizontal. No double precision number can follow them for a hundred seconds. */
KT_TEST(accuracy_stops_where_errors_mean_nothing_and_says_so) {
    kt_ran ran = kt_shell("$K make pendulum --links 2 --angle 120deg >c.yaml; $K accuracy c.yaml --duration 200 "
                          "--integrators dop853 --tolerances 1e-9 --budget 5");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("said", ran.out, "chaotic: a small error grows by a factor of e every ");
    kt_check_contains("said", ran.out, "of 200 s, the study compares the first ");
}

/* rk4 is stable up to steps of 2.785 / 1000 for
 *     x'' = -1001 x' - 1000 x. */
KT_TEST(accuracy_tells_stability_from_accuracy) {
    kt_write_file("s.yaml", "kinetree: 1\n"
                            "bodies: [{name: a, joint: {type: prismatic, axis: x, position: 1}, mass: 1}]\n"
                            "effects:\n"
                            "  - {type: spring, between: [world, a], stiffness: 1000, length: 0}\n"
                            "  - {type: joint_damper, joint: a, damping: 1001}\n"
                            "simulate: {duration: 5}\n");
    kt_ran ran = kt_shell("$K accuracy s.yaml --integrators rk4 --budget 4");
    const char *row = strstr(ran.out, "\n  rk4                4  ");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_need(kt_check_true("row", row != NULL));
    row += strlen("\n  rk4                4  ");
    row += strcspn(row, " ");
    kt_check_near("stable to", strtod(row, NULL), 2.785e-3, 0.02 * 2.785e-3);
    kt_check_contains("unit", ran.out, "records, in m\n");
    kt_check_contains("said", ran.out, "steps longer than 'stable to' are unstable");
    ran = kt_shell("$K accuracy p.yaml --integrators rk4 --budget 1");
    kt_check_true("and only there", strstr(ran.out, "are unstable") == NULL);
}

KT_TEST(accuracy_takes_a_run_as_its_reference) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran =
        kt_shell("$K run p.yaml --integrator dop853 --tolerance 1e-13 --out r.csv --quiet && $K accuracy p.yaml "
                 "%s --reference r.csv --out a.csv",
                 quick);
    kt_check_equal_int("exit code", ran.code, 0);
    const char *csv = kt_read_file("a.csv");
    const int row = find_row(csv, "rk4", 0.005);
    kt_check_below("error", kt_csv_number(csv, row, kt_csv_column(csv, "error.position")), 1e-8);
    kt_expect(2, "has no column 'position.bob'",
              "sed 1s/position.bob/position.bab/ r.csv >s.csv; $K accuracy p.yaml "
              "--reference s.csv");
    kt_expect(2, "even intervals", "sed 3d r.csv >s.csv; $K accuracy p.yaml --reference s.csv");
    kt_expect(2, "s.csv:4: fewer", "sed '4s/,.*//' r.csv >s.csv; $K accuracy p.yaml --reference s.csv");
    kt_expect(2, "s.csv:4: 'position.bob' is no number",
              "sed '4s/,[^,]*/,x/' r.csv >s.csv; $K accuracy p.yaml "
              "--reference s.csv");
    kt_expect(2, "none.csv", "$K accuracy p.yaml --reference none.csv");
    kt_expect(1, "is it of this scene",
              "sed 's/position: 1/position: 2/' p.yaml >q.yaml; $K accuracy q.yaml --reference "
              "r.csv");
}

/* Parts that are left out of a motion are reported. Formulations and engines have neither events nor contacts. */
KT_TEST(other_equations_leave_events_out_in_words_and_reject_hard_contacts) {
    char text[600];
    snprintf(text, sizeof text,
             "%sevents: [{name: half, when: t - 1, then: record}, {name: third, when: t - 1.5, then: record}]\n",
             pendulum);
    kt_write_file("events.yaml", text);
    const kt_ran ran = kt_shell("$K accuracy events.yaml --integrators rk4 --steps 0.02 --out /dev/null --plot "
                                "/dev/null");
    kt_check_contains("events are studied", ran.out, "instants of events: half (1), third (1)");
    kt_expect(0, "stability: event 'half' and others are left out", "$K stability events.yaml");
    kt_expect(0, "modes: --period: event 'half' and others are left out", "$K modes events.yaml --period 2.1");
    snprintf(text, sizeof text,
             "%seffects: [{name: stop, type: joint_limit, joint: bob, upper: 1.5, restitution: 0.5}]\n", pendulum);
    kt_write_file("stop.yaml", text);
    kt_expect(2, "accuracy: 'stop.upper': other formulations and engines have no hard stops",
              "$K accuracy stop.yaml --formulations");
    kt_expect(1, "time stepping is for hard stops", "$K accuracy events.yaml --integrators steps");
}

/* Events and time stepping are methods of one study. rodas5p needs exact derivatives, which friction does not have. */
KT_TEST(hard_contacts_are_studied_with_both_methods) {
    const kt_ran ran =
        kt_shell("$K accuracy " KT_SCENES "/bouncing-ball.yaml --integrators dopri5,rodas5p,steps --goal 0.02,1e-6 "
                 "--steps 1e-3 --tolerances 1e-6 --out b.csv --plot /dev/null");
    kt_check_equal_int("exit", ran.code, 0);
    kt_check_contains("instants", ran.out, "instants of events: floor (48), top (6)");
    kt_check_contains("windows", ran.out, "windows of +-0.0025 s about these instants: 6 of 201 records are left out");
    kt_check_contains("excluded", ran.out,
                      "rodas5p            5  -               -             -          the method "
                      "cannot run this scene");
    kt_check_contains("table", ran.out, "the largest error of the instants of events, s, at these settings");
    kt_check_contains("time stepping", kt_read_file("b.csv"), "\n,steps,1,step,0.001,ok,");
}

KT_TEST(wrong_command_lines_end_in_one_and_say_what_is_wanted) {
    kt_write_file("p.yaml", pendulum);
    kt_expect(1, "SCENE is missing", "$K accuracy");
    kt_expect(1, "did you mean 'accuracy'?", "$K acuracy p.yaml");
    kt_expect(1, "did you mean 'dopri5'?", "$K accuracy p.yaml --integrators rk4,dopri");
    kt_expect(1, "the list is empty", "$K accuracy p.yaml --integrators=");
    kt_expect(1, "--steps takes numbers above zero", "$K accuracy p.yaml --steps 1e-3,0");
    kt_expect(1, "--tolerances takes numbers above zero", "$K accuracy p.yaml --tolerances 1e-3,");
    kt_expect(1, "--goal takes numbers above zero", "$K accuracy p.yaml --goal x");
    kt_expect(1, "did you mean '--tolerances'?", "$K accuracy p.yaml --tolerance 1e-3");
    kt_expect(1, "p.yaml is the scene itself", "$K accuracy p.yaml --out p.yaml");
    kt_check_text("the scene is untouched", kt_read_file("p.yaml"), pendulum);
    kt_expect(2, "none.yaml", "$K accuracy none.yaml");
    kt_expect(1, "RESULT... is missing", "$K plot");
    kt_expect(2, "none.csv", "$K plot none.csv --out a.svg");
    kt_expect(1, "--out writes lines as CSV, not 'a.svg'; did you mean --plot?", "$K accuracy p.yaml --out a.svg");
    kt_expect(1, "nothing moves", "printf 'kinetree: 1\\nbodies: [{name: a, mass: 1}]\\n' | $K accuracy -");
}

#ifdef KT_WITH_CAIRO
/* An SVG is text, so its elements can be counted. */
static int count_of(const char *text, const char *part) {
    int count = 0;
    for (const char *at = text; at != NULL && (at = strstr(at, part)) != NULL; at++)
        count++;
    return count;
}

static bool is_png(const char *name) {
    const char *bytes = kt_read_file(name);
    return bytes != NULL && memcmp(bytes, "\x89PNG", 4) == 0;
}

/* A name that does not exist, a parameter without use, and a value that is fixed, too, leave the earlier file as it
 * is. */
KT_TEST(varied_values_that_the_scene_lacks_leave_the_file) {
    static const char *const wrong[][2] = {
        {"the scene has no parameter 'Lenght'; did you mean 'Length'?", "--vary Lenght=1,2"},
        {"'idle' varies, but nothing in the scene uses the parameter 'idle'", "--vary idle=1,2"},
        {"'Length' varies, and '--set Length=3' sets the same value", "--set Length=3 --vary Length=1,2"},
        {"'Length' varies, and '--set parameters.Length=3' sets", "--set parameters.Length=3 --vary Length=1,2"},
        {"'Length' varies, and '--set parameters.Length=3.5' sets", "--set parameters.Length=3.5 --vary Length=1,2"},
        {"'Length' is varied twice", "--vary Length=1,2 --vary parameters.Length=1,2"},
        {"'Length' is varied twice", "--vary Length=1,2 --vary parameters.Length=1.5,2"}};
    kt_write_file("v.yaml", "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {Length: 1, idle: 2}\nbodies:\n"
                            "  - {name: a, joint: {type: revolute, position: 1}, mass: 1, shape: {type: rod, to: "
                            "[=Length, 0, 0]}}\nsimulate: {duration: 0.1}\n");
    kt_write_file("v.csv", "earlier\n");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        for (int sweeps = 0; sweeps < 2; sweeps++) {
            kt_ran ran = kt_shell("$K %s v.yaml %s --out v.csv", sweeps ? "sweep" : "accuracy", wrong[i][1]);
            kt_check_true(wrong[i][1], ran.code == 1 || ran.code == 2);
            kt_check_contains(wrong[i][1], ran.err, wrong[i][0]);
            kt_check_text("the file", kt_read_file("v.csv"), "earlier\n");
        }
    kt_expect(1, "standard input can be read once", "$K accuracy - --vary Length=1,2 --out v.csv <v.yaml");
    kt_check_text("the file", kt_read_file("v.csv"), "earlier\n");
    kt_shell("(until grep -qs '^0,1,done,' v.csv.partial || ! kill -0 $$; do sleep 0.02; done; kill -INT $$) & "
             "exec $K accuracy v.yaml --vary Length=1:2:1000 --budget 0.1 --quiet --out v.csv");
    kt_check_text("the file of an earlier study", kt_read_file("v.csv"), "earlier\n");
    kt_check_contains("studies before Ctrl-C", kt_read_file("v.csv.partial"), "\n0,1,done,");
    kt_ran ran = kt_shell("$K accuracy v.yaml --vary Length=-0.0,1 --budget 0.1 --quiet --out v.csv");
    kt_check_contains("a value that is wrong alone is a line", kt_read_file("v.csv"), "\n0,-0,failed,");
    kt_check_contains("and the other is studied", kt_read_file("v.csv"), "\n1,1,done,");
    kt_check_equal_int("exit status of the failure", ran.code, 2);
}

/* Parameters with the names of columns that all lines have keep their section. */
KT_TEST(columns_of_varied_values_have_names_of_their_own) {
    kt_write_file("u.yaml", "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {uncertainty: 1, why: 2}\nbodies:\n"
                            "  - {name: a, joint: {type: revolute, position: 1}, mass: =why, shape: {type: rod, to: "
                            "[=uncertainty, 0, 0]}}\nsimulate: {duration: 0.1}\n");
    kt_ran ran = kt_shell("$K accuracy u.yaml --vary uncertainty=1,2 --vary why=1 --goal 1e-3 --budget 0.1 --out -");
    kt_check_equal_int("exit status", ran.code, 0);
    kt_check_contains("those of a study", ran.out,
                      "run,parameters.uncertainty,parameters.why,status,uncertainty,evaluations.0.001,");
    ran =
        kt_shell("$K sweep u.yaml --vary uncertainty=1,2 --vary why=1 --columns position.a --functionals end --out -");
    kt_check_contains("those of a run", ran.out,
                      "run,uncertainty,parameters.why,status,time,steps,evaluations,energy.error,position.a.end,");
}

KT_TEST(pictures_are_drawn_light_and_dark) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran = kt_shell("$K accuracy p.yaml %s --plot a.svg && $K accuracy p.yaml %s --dark --plot b.svg && "
                          "$K accuracy p.yaml %s --plot a.png",
                          quick, quick, quick);
    kt_check_equal_int("accuracy", ran.code, 0);
    const int light = count_of(kt_read_file("a.svg"), "<path"), dark = count_of(kt_read_file("b.svg"), "<path");
    kt_check_above("marks and lines", light, 30);
    kt_check_above("marks and lines", dark, 30);
    kt_check_near("a white page", kt_page_lightness(kt_read_file("a.svg")), 1.0, 0.0);
    kt_check_below("and a dark one", kt_page_lightness(kt_read_file("b.svg")), 0.25);
    kt_check_true("PNG", is_png("a.png"));
    kt_expect(1, "ends in .svg, .png or .pdf", "$K accuracy p.yaml --plot a.jpg");
}

/* The curves of a picture: their labels in the legend end with the order. */
static int curve_count_of(const char *svg) { return count_of(svg, ", order "); }

/* A picture with all methods cannot be read. It has the best method of each family, and the others on request. The
 * dashed line, the rings, the fan of slopes and the settings are on the page, light or dark, wide or narrow. */
KT_TEST(picture_of_accuracy_has_the_best_of_each_family) {
    static const char few[] = "--steps=0.02,0.01,0.005 --tolerances=1e-4,1e-6,1e-8 --quiet --out=/dev/null";
    kt_write_file("p.yaml", pendulum);
    kt_expect(0, NULL, "$K accuracy p.yaml %s --plot f.svg; $K accuracy p.yaml %s --all --plot a.svg", few, few);
    char *family = strdup(kt_read_file("f.svg"));
    const int curves = curve_count_of(family), all = curve_count_of(kt_read_file("a.svg"));
    kt_check_below("curves", curves, 8.5);
    kt_check_above("curves", curves, 4.5);
    kt_check_above("all methods", all, 15.5);
    char left_out[32];
    snprintf(left_out, sizeof left_out, ">and %d more<", kt_method_count() - curves);
    kt_check_contains("the others are counted", family, left_out);
    kt_check_contains("recommended points", family, ">recommended<");
    kt_check_contains("their goals", family, ">for 0.001<");
    kt_check_equal_int("a fan in each panel", count_of(family, ">order<"), 2);
    kt_check_equal_int("rounding in each panel", count_of(family, ">rounding<"), 2);
    kt_check_contains("dashed lines", family, "stroke-dasharray");
    kt_check_true("no settings", strstr(family, ">1e-8<") == NULL);
    free(family);
    kt_expect(0, NULL, "$K accuracy p.yaml %s --settings --size 420x800 --plot-dark n.svg", few);
    const char *narrow = kt_read_file("n.svg");
    kt_check_contains("settings", narrow, ">1e-8<");
    kt_check_contains("settings", narrow, ">0.005<");
    kt_check_contains("size", narrow, "viewBox=\"0 0 420 800\"");
    kt_check_true("the legend is on the page", strstr(narrow, ">recommended<") != NULL);
    kt_expect(1, "--size takes WIDTHxHEIGHT", "$K accuracy p.yaml --size 10");
}

KT_TEST(plot_draws_columns_of_a_result) {
    kt_write_file("p.yaml", pendulum);
    kt_ran ran =
        kt_shell("$K run p.yaml --out r.csv --quiet; $K plot r.csv && $K plot r.csv --columns velocity,energy.total "
                 "--out v.png && $K plot r.csv --phase bob --dark --out f.png && $K plot - --x position.bob "
                 "--columns velocity.bob --log --out x.png <r.csv");
    kt_check_equal_int("plot", ran.code, 0);
    kt_check_text("names of pictures alone", ran.err,
                  "picture: r.svg\npicture: v.png\npicture: f.png\npicture: x.png\n");
    kt_check_above("by default an SVG", count_of(kt_read_file("r.svg"), "<path"), 10);
    kt_check_true("velocities", is_png("v.png"));
    kt_check_true("phase plane", is_png("f.png"));
    kt_check_true("from standard input", is_png("x.png"));
    kt_expect(1, "did you mean 'velocity.bob'?", "$K plot r.csv --columns velocty.bob");
    kt_expect(1, "there is no column 'position.rod'", "$K plot r.csv --phase rod");
    kt_expect(1, "ends in .svg, .png or .pdf", "$K plot r.csv --out r.csv");
    kt_expect(2, "no lines of numbers", "head -1 r.csv >h.csv; $K plot h.csv");
}
#endif
