/* Results that cannot be written, and runs that fail or are killed. The files that exist are whole, and the message has
 * the reason. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE /* prctl's numbers */
#define _XOPEN_SOURCE 700
#include "shell.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Whether the text ends in a newline, and every line of it has as many commas as the first. */
static void check_whole(const char *text) {
    int commas = 0, first = -1, ragged = 0;
    kt_need(kt_check_true("there is a file, and something in it", text != NULL && *text != '\0'));
    kt_check_true("it ends in a newline", text[strlen(text) - 1] == '\n');
    for (const char *c = text; *c != '\0'; c++) {
        commas += *c == ',';
        if (*c == '\n') {
            first = first < 0 ? commas : first;
            ragged += commas != first;
            commas = 0;
        }
    }
    kt_check_equal_int("lines with too few or too many numbers", ragged, 0);
}

KT_TEST(write_errors_are_said_and_end_in_four) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml");
    kt_expect(4, "/dev/full cannot be written: No space left on device", "$K run p.yaml --quiet --out /dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K run p.yaml --quiet --out - >/dev/full");
    kt_expect(4, "/dev/full cannot be written: No space left on device",
              "$K run p.yaml --quiet --out o.csv --summary /dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K evaluate p.yaml >/dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K info p.yaml >/dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K check p.yaml >/dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K integrators >/dev/full");
    kt_expect(4, "standard output cannot be written: No space left", "$K run --help >/dev/full");
    kt_expect(4, "is the disk full?", "$K make chain >/dev/full");
    kt_expect(4, "full.html cannot be written: No space left on device",
              "ln -sf /dev/full full.html && $K view p.yaml --view full.html");
    kt_expect(4, "full.svg cannot be written: No space left on device",
              "ln -sf /dev/full full.svg && $K draw p.yaml --animate --out full.svg");
    kt_expect(4, "full.pdf cannot be written: No space left on device",
              "ln -sf /dev/full full.pdf && $K draw p.yaml --out full.pdf");
    kt_expect(4, "none/o.csv cannot be written: No such file or directory; create the folder none first",
              "$K run p.yaml --quiet --out none/o.csv");
    kt_expect(4, "none/o.json cannot be written: No such file",
              "$K run p.yaml --quiet --out o.csv --summary none/o.json");
}

/* Not after hours of work. */
KT_TEST(results_that_have_no_place_are_rejected_before_the_run) {
    static const struct {
        const char *file, *why;
    } wrong[] = {{"none/o.svg", "none/o.svg cannot be written: No such file or directory"},
                 {"folder.svg", "folder.svg cannot be written: Is a directory"},
                 {"p.yaml/o.svg", "p.yaml/o.svg cannot be written: Not a directory"}};
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml; mkdir -p folder.svg; rm -f r.csv");
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        kt_expect(4, wrong[i].why, "$K run p.yaml --quiet --out r.csv --summary %s", wrong[i].file);
        kt_expect(4, wrong[i].why, "$K accuracy p.yaml --quiet --out %s", wrong[i].file);
#ifdef KT_WITH_CAIRO
        kt_expect(4, wrong[i].why, "$K run p.yaml --quiet --out r.csv --plot %s", wrong[i].file);
        kt_expect(4, wrong[i].why, "$K stability p.yaml --plot %s", wrong[i].file);
#endif
    }
    kt_expect(0, NULL, "test ! -e r.csv");
    kt_expect(4, "a file without a name cannot be written", "$K run p.yaml --quiet --out r.csv --summary=");
}

/* A file that could not be written is not among the results. */
KT_TEST(report_lists_what_was_written) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml");
    const kt_ran ran = kt_shell("$K run p.yaml --out o.csv --summary /dev/full");
    kt_check_equal_int("code", ran.code, 4);
    kt_check_contains("records", ran.err, "records: o.csv");
    kt_check_true("no summary", strstr(ran.err, "summary: ") == NULL);
}

/* The file system gives out in the middle of a line. 40 blocks of 512 bytes are some hundred records. */
KT_TEST(disk_that_fills_up_leaves_whole_lines) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml");
    kt_expect(4, "o.csv cannot be written: File too large",
              "rm -f o.csv*; trap '' XFSZ; ulimit -f 40; $K run p.yaml --quiet --out o.csv");
    const char *text = kt_read_file("o.csv");
    check_whole(text);
    kt_check_above("lines", kt_count_lines(text), 50);
    kt_check_below("bytes", (double)strlen(text), 40.0 * 512.0);
}

/* The number of records in the report of a run, before the words; -1: there is none. */
static int find_record_count(const char *report, const char *words) {
    const char *said = strstr(report, words);
    while (said != NULL && said > report && said[-1] >= '0' && said[-1] <= '9')
        said--;
    return said != NULL ? atoi(said) : -1;
}

/* Records that the disk did not take are not among those that the report counts. Standard output may be appended to a
 * file. */
KT_TEST(report_counts_the_records_that_the_disk_took) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml");
    const kt_ran ran = kt_shell("rm -f o.csv*; trap '' XFSZ; ulimit -f 40; $K run p.yaml --out o.csv");
    kt_check_equal_int("code", ran.code, 4);
    kt_check_equal_int("records", find_record_count(ran.err, " records: o.csv"),
                       kt_count_lines(kt_read_file("o.csv")) - 1);
    const kt_ran added = kt_shell("seq 3000 | tr '\\n' , >a.csv; trap '' XFSZ; ulimit -f 40; "
                                  "$K run p.yaml --out - >>a.csv");
    kt_check_equal_int("code", added.code, 4);
    kt_check_equal_int("records behind other text", find_record_count(added.err, " records: standard output"),
                       kt_count_lines(kt_read_file("a.csv")) - 1);
    const kt_ran none = kt_shell("rm -f o.csv*; trap '' XFSZ; ulimit -f 0; $K run p.yaml --out o.csv");
    kt_check_equal_int("code", none.code, 4);
    kt_check_true("no line about records", strstr(none.err, "records") == NULL);
    kt_expect(0, NULL, "test ! -e o.csv; test ! -e o.csv.partial");
}

/* A sweep that fills the disk names the file with the finished runs, and how to go on. */
KT_TEST(sweep_that_fills_the_disk_says_how_to_go_on) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml; rm -f w.csv* all.csv*");
    kt_expect(4,
              "w.csv.partial holds the finished runs. To go on, free some space and repeat the command with --resume",
              "trap '' XFSZ; ulimit -f 40; $K sweep p.yaml --vary bodies.link1.mass=1:2:200 --jobs 1 --quiet "
              "--set simulate.duration=0.1 --out w.csv");
    kt_expect(0, NULL, "test -s w.csv.partial; test ! -e w.csv");
    for (int i = 0; i < 2; i++)
        kt_expect(0, NULL,
                  "$K sweep p.yaml --vary bodies.link1.mass=1:2:200 --jobs 1 --quiet --set simulate.duration=0.1 "
                  "--out %s",
                  i == 0 ? "w.csv --resume" : "all.csv");
    kt_expect(0, NULL, "cmp w.csv all.csv");
}

#ifdef KT_WITH_HDF5
/* The HDF5 file is made at the end. If the disk has no room for it, no message says that it has the records. */
KT_TEST(hdf5_that_could_not_be_made_is_not_said_to_have_records) {
    kt_expect(0, NULL, "$K make pendulum --links 2 >p.yaml");
    const kt_ran ran = kt_shell("rm -f o.h5*; trap '' XFSZ; ulimit -f 40; $K run p.yaml --out o.h5");
    kt_check_equal_int("code", ran.code, 4);
    kt_check_contains("the reason and a remedy", ran.err,
                      "o.h5.partial has no HDF5 yet, and cannot be read; free some");
    kt_check_true("no records", strstr(ran.err, "records are in") == NULL && strstr(ran.err, "records: ") == NULL);
    kt_expect(0, NULL, "test ! -e o.h5");
}
#endif

/* Runs it until the file has that many bytes more, kills it without warning, and waits for all that it leaves behind.
 * Returns the lines that are there. */
static int kill_in_the_middle(const char *links, long long bytes) {
    kt_expect(0, NULL, "rm -f k.csv.partial; $K make chain --links %s >c.yaml", links);
    const pid_t child = fork();
    if (child == 0) {
        (void)setpgid(0, 0);
        execl(KT_COMMAND, "kinetree", "run", "c.yaml", "--quiet", "--out", "k.csv", "--duration", "1000", "--interval",
              "1e-4", (char *)NULL);
        _exit(127);
    }
    struct stat status = {0};
    for (int i = 0; i < 200000 && (stat("k.csv.partial", &status) != 0 || status.st_size < bytes); i++)
        nanosleep(&(struct timespec){0, 100000}, NULL);
    kill(-child, SIGKILL); /* the run and whoever is of its group */
    int how = 0;
    waitpid(child, &how, 0);
    kt_check_true("it was killed", WIFSIGNALED(how) && WTERMSIG(how) == SIGKILL);
    while (wait(NULL) > 0 || errno == EINTR) {
    }
    const char *text = kt_read_file("k.csv.partial");
    check_whole(text);
    return kt_count_lines(text);
}

/* Lines within a page of memory, and of two or three pages each. It is killed as its file grows: without a child that
 * writes them, every other time a line is cut. */
KT_TEST(killed_run_leaves_whole_lines) {
    (void)prctl(PR_SET_CHILD_SUBREAPER, 1L);
    for (int k = 0; k < 5; k++)
        kt_check_above("lines", kill_in_the_middle("20", 200000 + 70001 * k), 100);
    for (int k = 0; k < 20; k++)
        kt_check_above("long lines", kill_in_the_middle("200", 50000 + 7001 * k), 4);
    (void)prctl(PR_SET_CHILD_SUBREAPER, 0L);
}

/* Two runs that would write the same records: the second is rejected and changes nothing of the first. Both used to
 * write into one file, and the run that ended later renamed the file of the other. */
KT_TEST(run_of_records_that_another_run_is_writing_is_rejected) {
    kt_expect(4, "two.csv.partial cannot be written: another run is writing it; --out FILE writes elsewhere",
              "rm -f two.csv*; $K make pendulum --links 2 >p.yaml; "
              "$K run p.yaml --quiet --out two.csv --duration 1e9 --integrator rk4 --step 1e-3 --interval 0.1 & "
              "first=$!; until test -s two.csv.partial; do :; done; kill -STOP $first; sleep 0.1; cp two.csv.partial "
              "before.csv; "
              "$K run p.yaml --quiet --out two.csv --duration 1; code=$?; kill -KILL $first; exit $code");
    kt_expect(0, NULL, "cmp two.csv.partial before.csv; test ! -e two.csv");
    kt_expect(0, NULL, "$K run p.yaml --quiet --out two.csv --duration 1; test ! -e two.csv.partial");
}

/* A step far beyond the limit of stability: numbers grow until they overflow, for a motor might have driven them. */
KT_TEST(failed_integration_keeps_its_records_and_ends_in_four) {
    kt_expect(0, NULL,
              "rm -f o.*; ($K make pendulum --links 3; echo 'effects: [{type: motor, joint: link1, torque: 1e-9}]') "
              ">p.yaml");
    kt_ran ran = kt_shell("$K run p.yaml --integrator euler --step 0.5 --duration 1e4 --interval 0.25 --out o.csv "
                          "--summary o.json --plot o.svg");
    kt_check_equal_int("exit code", ran.code, 4);
    kt_check_contains("time", ran.err, "kinetree: t = ");
    kt_check_contains("joint", ran.err, "'link");
    kt_check_contains("report", ran.err, " s simulated of 10000 s");
    kt_note("%.*s", (int)strcspn(ran.err, "\n"), ran.err);
    const char *text = kt_read_file("o.csv");
    check_whole(text);
    int last = kt_count_lines(text) - 1;
    double end = kt_csv_number(text, last, 0);
    kt_check_equal_int("a record every 0.25 s", last, (long long)floor(end / 0.25) + 1);
    kt_check_true("the last one is finite", isfinite(kt_csv_number(text, last, 1)));
    json_t *root = kt_json(kt_read_file("o.json"));
    /* The last step may end in a state without an acceleration. Records within the step cannot be interpolated then.
     */
    kt_check_above("the summary is of the time reached", kt_json_at(root, "time"), end);
    kt_check_below("which is at most a step later", kt_json_at(root, "time") - end, 0.5);
    json_decref(root);
}

/* Speeds of 1e200 are numbers, but those of no motion. */
KT_TEST(speeds_beyond_all_reason_end_in_four) {
    kt_write_file("grow.yaml", "kinetree: 1\nbodies:\n"
                               "  - {name: a, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1]}\n"
                               "effects: [{type: joint_spring, joint: a, stiffness: 1e6},\n"
                               "          {type: motor, joint: a, torque: 1e-9}]\n"
                               "simulate: {duration: 10, step: 0.1, integrator: euler}\n");
    kt_ran ran = kt_shell("$K run grow.yaml --out g.csv --summary g.json");
    kt_check_equal_int("exit code", ran.code, 4);
    kt_check_contains("words", ran.err, " s: the speed of joint 'a' is ");
    kt_check_contains("words", ran.err, ", above that of light (299792458): the integration has blown up");
    const char *text = kt_read_file("g.csv");
    check_whole(text);
    const int last = kt_count_lines(text) - 1;
    kt_check_equal_int("records until then", last, (long long)floor(kt_csv_number(text, last, 0) / 0.01 + 0.5) + 1);
    for (int column = 0; column < 6; column++)
        kt_check_true("the last one is finite", isfinite(kt_csv_number(text, last, column)));
    kt_check_contains("warning", kt_read_file("g.json"), "\"code\": \"blow_up\"");
    kt_expect(4, "above that of light", "$K run grow.yaml --quiet --out h.csv --record position,velocity");
}

/* The limit is far, and the event that ends the motion is not. A window of 10000 steps covers 430 s of 1e9 s, which
 * counted as no progress. The motion has the bits of a run with a near limit. */
KT_TEST(a_motion_that_an_event_ends_may_have_a_far_limit) {
    static const char line[] = "$K run far.yaml --set simulate.duration=%s --quiet --out %s.csv && tail -n 1 %s.csv";
    kt_write_file("far.yaml", "kinetree: 1\ngravity: [0, -9.81, 0]\nstates: {clock: {rate: 1}}\n"
                              "bodies: [{name: a, joint: {type: revolute, position: 1}, mass: 1,\n"
                              "          shape: {type: rod, to: [0, -1, 0]}}]\n"
                              "simulate: {duration: 1, integrator: dop853, tolerance: 1e-12, until: clock > 700}\n"
                              "output: {interval: 10}\n");
    const kt_ran near = kt_shell(line, "800", "near", "near");
    char *end = strdup(near.out);
    const kt_ran far = kt_shell(line, "1e9", "far", "far");
    kt_check_equal_int("near", near.code, 0);
    kt_check_equal_int("far", far.code, 0);
    kt_check_true("it ends at 700 s", strncmp(end, "700", 3) == 0 || strncmp(end, "699.99", 6) == 0);
    kt_check_text("the end", far.out, end);
    free(end);
}

/* An event that has not happened is named, in words and in the summary. `until` is not named if another event has ended
 * the run. */
KT_TEST(events_that_never_happened_are_named) {
    static const char scene[] = "kinetree: 1\nbodies:\n  - {name: a, joint: {type: prismatic, velocity: 1}, mass: 1}\n"
                                "events:\n  - {name: near, when: position.a > 0.5, then: %s}\n"
                                "  - {name: far, when: position.a > 5, then: record}\n"
                                "simulate: {duration: 1, until: position.a > 4}\n";
    char text[400];
    (void)snprintf(text, sizeof text, scene, "record");
    kt_write_file("n.yaml", text);
    kt_ran ran = kt_shell("$K run n.yaml --out n.csv --summary n.json");
    kt_check_contains("the event", ran.err, "  event 'far' never happened: position.a > 5\n");
    kt_check_contains("until", ran.err, "  until never happened: position.a > 4\n");
    kt_check_true("not what has happened", strstr(ran.err, "'near' never") == NULL);
    ran = kt_shell("tr -d ' \\n' <n.json");
    kt_check_contains("the summary", ran.out, "\"never_happened\":[\"far\",\"until\"]");
    (void)snprintf(text, sizeof text, scene, "stop");
    kt_write_file("n.yaml", text);
    ran = kt_shell("$K run n.yaml --out n.csv");
    kt_check_true("until is moot", strstr(ran.err, "until never") == NULL);
    kt_check_contains("the event", ran.err, "'far' never happened");
}

/* A reader that has seen enough. */
KT_TEST(closed_pipe_ends_the_run_quietly) {
    kt_expect(0, NULL, "$K make chain --links 20 >c.yaml");
    kt_ran ran = kt_shell("$K run c.yaml --quiet --out - --duration 1000 | head -2 | wc -l");
    kt_check_text("lines", ran.out, "2\n");
    kt_check_text("standard error", ran.err, "");
}

/* A parallelogram whose cranks differ by 2e-7 turns over at its flat position. Its exact twin does not. With a second
 * coupler, which repeats the first, the pins are moved by these digits. Both mechanisms then pass the position
 * alike. */
#define CRANKS                                                                                                         \
    "kinetree: 1\ngravity: [0, 0, 0]\nparameters: {L: 1, Q: 0.2}\nbodies:\n"                                           \
    "  - {name: a, joint: {type: revolute, axis: z, position: =Q, velocity: -2}, mass: 1,\n"                           \
    "     shape: {type: rod, to: [=L, 0, 0]}}\n"                                                                       \
    "  - {name: k, parent: a, joint: {type: revolute, axis: z, at: [=L, 0, 0], position: =-Q}, mass: 1,\n"             \
    "     shape: {type: rod, to: [1.5, 0, 0]}, markers: {tip: [1.5, 0, 0]}}\n"                                         \
    "  - {name: b, joint: {type: revolute, axis: z, at: [1.5, 0, 0], position: =Q}, mass: 1,\n"                        \
    "     shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0], mid: [0.5, 0, 0]}}\n"
#define COUPLER                                                                                                        \
    "  - {name: m, parent: a, joint: {type: revolute, axis: z, at: [0.5, 0, 0], position: =-Q}, mass: 1,\n"            \
    "     shape: {type: rod, to: [1.5, 0, 0]}, markers: {tip: [1.5, 0, 0]}}\n"
#define PIN "loops:\n  - {name: tips, type: revolute, between: [k.tip, b.tip]}\n"
#define PINS PIN "  - {name: mids, type: revolute, between: [m.tip, b.mid]}\n"
#define END "initial: {hold: [a]}\nsimulate: {duration: 1, tolerance: 1e-9}\n"

KT_TEST(lengths_whose_rounding_decides_the_branch_are_told) {
    static const char *const silent[] = {"", "--set L=1.0000002 --set initial.tolerance=0", "--set L=1.01"};
    kt_write_file("p.yaml", CRANKS PIN END);
    kt_write_file("d.yaml", CRANKS COUPLER PINS END);
    kt_expect(0, "their last digits decide how the motion continues", "$K run p.yaml --set L=1.0000002 --out o.csv");
    kt_ran ran = kt_shell("$K run p.yaml --set L=1.0000002 --quiet --out o.csv --summary -");
    json_t *root = kt_json(ran.out);
    kt_check_text("code", json_string_value(kt_json_find(root, "warnings[0].code")), "branch");
    kt_check_above("by how much lengths are off", kt_json_at(root, "warnings[0].value"), 1e-7);
    kt_check_below("by how much lengths are off", kt_json_at(root, "warnings[0].value"), 16.0 * 2e-7);
    json_decref(root);
    for (size_t i = 0; i < sizeof silent / sizeof *silent; i++) {
        ran = kt_shell("$K run p.yaml %s --out o.csv", silent[i]);
        kt_check_equal_int(silent[i], ran.code, 0);
        kt_check_true("nothing is said of branches", strstr(ran.err, "another branch") == NULL);
    }
}

/* A crank that is too long by 6e-15 bends the path within 1e-7 rad. Steps of dop853 leap over the bend as if the path
 * were straight. The part of the bend that reaches their stages is magnified between their ends. */
#define HEAVY                                                                                                          \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {L: 1}\nbodies:\n"                                               \
    "  - {name: a, joint: {type: revolute, axis: z, position: 1, velocity: 3}, mass: 1,\n"                             \
    "     shape: {type: rod, to: [=L, 0, 0]}}\n"                                                                       \
    "  - {name: k, parent: a, joint: {type: revolute, axis: z, at: [=L, 0, 0], position: -1}, mass: 2,\n"              \
    "     shape: {type: rod, to: [2, 0, 0]}, markers: {tip: [2, 0, 0]}}\n"                                             \
    "  - {name: b, joint: {type: revolute, axis: z, at: [2, 0, 0], position: 1}, mass: 1,\n"                           \
    "     shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}\n"
#define LEAPING "simulate: {duration: 10, integrator: dop853, tolerance: 1e-9}\noutput: {interval: 0.05}\n"

KT_TEST(energy_that_is_lost_next_to_singular_positions_is_told) {
    kt_write_file("h.yaml", HEAVY PIN "initial: {hold: [a]}\n" LEAPING);
    kt_ran ran = kt_shell("$K run h.yaml --set L=1.0000000000000059 --quiet --out o.csv --summary -");
    json_t *root = kt_json(ran.out);
    kt_check_text("code", json_string_value(kt_json_find(root, "warnings[0].code")), "singular_energy");
    kt_check_near("J", kt_json_at(root, "warnings[0].value"), kt_json_at(root, "energy_watch.error"), 0.0);
    json_decref(root);
    ran = kt_shell("$K run h.yaml --set L=1.001 --out o.csv");
    kt_check_equal_int("where it is kept", ran.code, 0);
    kt_check_true("nothing is said", strstr(ran.err, "the energy is off by") == NULL);
}

KT_TEST(rounded_parallelograms_that_repeat_each_other_pass_where_they_lie_flat) {
    static const char *const starts[] = {"1", "0.2"}, *const methods[] = {"dopri5", "radau5", "rodas5p", "dop853"};
    KT_WORST apart = kt_worst_make("crank, rad");
    kt_write_file("d.yaml", CRANKS COUPLER PINS END);
    kt_expect(0, "Their ends are moved as little as possible until the loops agree",
              "$K run d.yaml --set L=1.0000002 --out o.csv");
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++)
        for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
            double end[2];
            for (int rounded = 0; rounded < 2; rounded++) {
                kt_ran ran =
                    kt_shell("$K run d.yaml --set L=%s --set Q=%s --set simulate.integrator=%s --quiet --out o.csv",
                             rounded ? "1.0000002" : "1", starts[i], methods[k]);
                kt_check_equal_int("exit code", ran.code, 0);
                const char *text = kt_read_file("o.csv");
                end[rounded] = kt_csv_number(text, kt_count_lines(text) - 1, 1);
            }
            kt_worst_near(&apart, end[1], end[0], 1e-9, "from %s by %s", starts[i], methods[k]);
        }
}
