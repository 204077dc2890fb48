/* Runs that are killed and go on from their checkpoint end as if there had been no break, to the last byte. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "sanitized.h"
#include "shell.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char options[] =
    "--quiet --duration 4 --interval 1e-3 --record position,velocity,acceleration,energy,balance,constraint";

static long long size_of(const char *name) {
    struct stat status;
    return stat(name, &status) == 0 ? (long long)status.st_size : -1;
}

/* Starts a run that writes checkpoints, and kills it when its records have so many bytes; false where it was through
 * before that. */
static bool try_to_kill_at(const char *scene, const char *more, long long bytes) {
    char line[512];
    (void)unlink("part.csv");
    (void)unlink("part.csv.partial");
    (void)unlink("part.state");
    snprintf(line, sizeof line,
             "exec %s run %s %s %s --out part.csv --summary part.json --checkpoint part.state "
             "--checkpoint-interval 1e-3",
             KT_COMMAND, scene, options, more);
    pid_t child = fork();
    if (child == 0) {
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
        _exit(127);
    }
    int how = 0;
    while (waitpid(child, &how, WNOHANG) == 0)
        if (size_of("part.csv.partial") >= bytes && size_of("part.state") > 0)
            kill(child, SIGKILL);
        else
            nanosleep(&(struct timespec){0, 200000}, NULL);
    return WIFSIGNALED(how) && WTERMSIG(how) == SIGKILL;
}

/* A machine that is busy may look too late. */
static void kill_at(const char *scene, const char *more, long long bytes) {
    bool killed = false;
    for (int i = 0; i < 20 && !killed; i++)
        killed = try_to_kill_at(scene, more, bytes);
    kt_check_true("it was killed", killed);
}

static void check_break(const char *scene, const char *more) {
    kt_expect(0, NULL, "$K run %s %s %s --out whole.csv --summary whole.json", scene, options, more);
    const long long whole = size_of("whole.csv");
    static int asked;
    for (int i = 1; i <= 3; i++) {
        if (!kt_is_asked(&asked, 2))
            continue;
        kill_at(scene, more, whole * i / 5);
        kt_note("%s: killed with %lld of %lld bytes", scene, size_of("part.csv.partial"), whole);
        kt_expect(0, NULL, "$K run %s %s %s --out part.csv --summary part.json --resume part.state", scene, options,
                  more);
        kt_expect(0, NULL, "cmp part.csv whole.csv");
        /* The cost differs: the first slope after the break is computed once more. */
        kt_expect(0, NULL,
                  "sed '/cpu_seconds/d; /evaluations/d; /factorizations/d' whole.json >a; "
                  "sed '/cpu_seconds/d; /evaluations/d; /factorizations/d' part.json >b; cmp a b");
    }
}

KT_TEST(killed_chain_goes_on_to_the_last_byte) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    check_break("chain.yaml", "");
}

KT_TEST(killed_linkage_goes_on_to_the_last_byte) {
    check_break(KT_SCENES "/four-bar.yaml", "");
    check_break(KT_SCENES "/slider-crank-spring.yaml", "--integrator rk4 --step 1e-3");
}

/* Before most of the breaks, one event has set the stiffness of a spring, and another one a force. Formulas of time
 * have corners. A joint sticks and slips, and meets a stop. */
KT_TEST(killed_run_with_events_and_contacts_goes_on_to_the_last_byte) {
    kt_write_file(
        "events.yaml",
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "parameters: {k: 20, pull: 1}\n"
        "bodies:\n"
        "  - {name: a, joint: {type: revolute, axis: y, position: 0.5}, mass: 1, shape: {type: rod, to: [0, 0, "
        "-0.6]}}\n"
        "  - {name: b, parent: a, joint: {type: revolute, axis: y, at: [0, 0, -0.6], position: 0.3}, mass: 1,\n"
        "     shape: {type: rod, to: [0, 0, -0.6]}}\n"
        "effects:\n"
        "  - {type: joint_spring, joint: a, stiffness: =k}\n"
        "  - {type: expression, joint: a, force: \"pull*6*sin(3*t)\"}\n"
        "  - {name: friction, type: joint_friction, joint: b, coulomb: 1, stick: true}\n"
        "  - {name: stop, type: joint_limit, joint: a, lower: -0.4, restitution: 0.5}\n"
        "events:\n"
        "  - {name: harden, when: t - 0.3, limit: 1, then: {set: {k: 2*k}}}\n"
        "  - {name: turn, when: velocity.a, direction: rising, then: {set: {pull: 1.5 + 0.3*position.b}}}\n");
    check_break("events.yaml", "--integrator dopri5");
    kt_expect(1, "it belongs to another scene",
              "sed 's/k: 2/k: 3/' events.yaml > other.yaml; $K run other.yaml %s --integrator dopri5 --out part.csv "
              "--resume part.state",
              options);
    kt_expect(1, "it belongs to another scene", /* the same number, which does not follow k */
              "sed 's/=k}/20}/' events.yaml > other.yaml; $K run other.yaml %s --integrator dopri5 --out part.csv "
              "--resume part.state",
              options);
}

KT_TEST(absolute_runs_reject_events_and_checkpoints) {
    kt_expect(1, "--checkpoint and --resume need the formulation 'tree'",
              "$K run " KT_SCENES "/double-pendulum.yaml --formulation absolute --checkpoint a.state --out a.csv");
    kt_write_file("until.yaml", "kinetree: 1\n"
                                "bodies: [{name: a, joint: {type: prismatic, axis: y, velocity: 1}, mass: 1}]\n"
                                "simulate: {formulation: absolute, until: position.a - 1}\n");
    kt_expect(2, "formulation: events need the formulation 'tree'", "$K run until.yaml --out a.csv");
    const kt_ran tree = kt_shell("$K run until.yaml --set simulate.formulation=tree --out a.csv --quiet");
    kt_check_equal_int("tree", tree.code, 0);
}

KT_TEST(killed_run_of_time_stepping_goes_on_to_the_last_byte) {
    kt_write_file("ball.yaml", "kinetree: 1\n"
                               "gravity: [0, 0, -9.81]\n"
                               "bodies: [{name: ball, joint: {type: prismatic, axis: z, position: 1}, mass: 1}]\n"
                               "effects: [{type: joint_limit, joint: ball, lower: 0, restitution: 0.5}]\n"
                               "simulate: {contact: steps, step: 1e-4}\n");
    check_break("ball.yaml", "");
}

/* A run broken off in the middle, with its checkpoint. */
static void break_off(void) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    kill_at("chain.yaml", "", 100000);
}

KT_TEST(checkpoint_that_does_not_fit_is_rejected_in_words) {
    break_off();
    const char resume[] = "--out part.csv --summary part.json --resume";
    kt_expect(0, NULL, "cp part.csv.partial before.csv; cp part.state good");
    kt_expect(1,
              "it belongs to a run with other options: that was by auto, tolerance 1e-09, 4 s, a record every 0.001 s; "
              "this one is by tsit5, tolerance 1e-09, 4 s, a record every 0.001 s",
              "$K run chain.yaml %s --integrator tsit5 %s good", options, resume);
    kt_expect(1, "it belongs to a run with other options",
              "$K run chain.yaml %s --out part.csv --resume good --interval 0.01", options);
    kt_expect(1, "it belongs to a run with other options",
              "$K run chain.yaml %s --out part.csv --resume good --duration 5", options);
    kt_expect(1, "it belongs to a run that recorded something else",
              "$K run chain.yaml %s --out part.csv --resume good --record position", options);
    kt_expect(1, "it is empty", ": >empty; $K run chain.yaml %s %s empty", options, resume);
    kt_expect(1, "it belongs to another scene",
              "sed 's/mass: 1$/mass: 1.5/; s/-9.8/-9.7/' chain.yaml >other.yaml; $K run other.yaml %s %s good", options,
              resume);
    kt_expect(1, "bad is no checkpoint; --resume takes", "head -c 10 good >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "it is not as long as it was written", "head -c -1 good >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "it is not as long as it was written", "(cat good; echo) >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "bad is no checkpoint; --resume takes", "tr k K <good >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "its sum is wrong",
              "cp good bad; printf x | dd of=bad bs=1 seek=900 conv=notrunc 2>/dev/null; $K run chain.yaml %s %s bad",
              options, resume);
    kt_expect(2, "No such file", "$K run chain.yaml %s %s none", options, resume);
    kt_expect(2, ".: this is a directory; name a checkpoint", "$K run chain.yaml %s %s .", options, resume);
    kt_expect(
        1, "the file does not have the records until the checkpoint",
        "head -c 20 part.csv.partial >short.csv; $K run chain.yaml %s --out short.csv --summary s.json --resume good",
        options);
    kt_expect(
        1, "the file does not have the records until the checkpoint",
        "sed s/time/Time/ part.csv.partial >other.csv; $K run chain.yaml %s --out other.csv --summary s.json --resume "
        "good",
        options);
    kt_expect(0, NULL, "cmp part.csv.partial before.csv");
    kt_expect(1, "standard output cannot be taken up again", "$K run chain.yaml --out - --checkpoint x");
    kt_expect(1, "--plot would not show", "$K run chain.yaml --resume x --plot x.svg");
}

/* ---- other runs -------------------------------------------------------------------------------------------------- */

/* A killed run, whose records another run writes over: neither is touched. Then the first run itself goes on. The
 * other run has another gravity, so that its first record differs already: the checkpoint may be from there. */
KT_TEST(records_of_another_run_are_rejected) {
    const char words[] = "another run has written over them";
    break_off();
    kt_expect(0, NULL, "cp part.csv.partial a.csv; cp part.state good");
    kt_expect(0, NULL,
              "sed 's/-9.8/-9.7/' chain.yaml >other.yaml; $K run other.yaml %s --out part.csv; cp part.csv b.csv",
              options);
    kt_expect(1, words, "$K run chain.yaml %s --out part.csv --resume good", options);
    kt_expect(0, NULL, "cmp part.csv b.csv; test ! -e part.csv.partial");
    kt_expect(0, NULL, "cp b.csv part.csv.partial");
    kt_expect(1, words, "$K run chain.yaml %s --out part.csv --resume good", options);
    kt_expect(0, NULL, "cmp part.csv.partial b.csv");
    kt_expect(1, words, "sed '2s/[0-9]$/x/' a.csv >part.csv.partial; $K run chain.yaml %s --out part.csv --resume good",
              options);
    kt_expect(0, NULL, "rm part.csv; mv a.csv part.csv.partial; $K run chain.yaml %s --out part.csv --resume good",
              options);
    kt_expect(0, NULL, "$K run chain.yaml %s --out whole.csv; cmp whole.csv part.csv", options);
}

/* A run that lasts until it is killed. Returns its process once it has written a checkpoint. */
static pid_t start_long_run(void) {
    char line[512];
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml; rm -f long.*");
    snprintf(line, sizeof line,
             "exec %s run chain.yaml --quiet --duration 1e5 --interval 1e-2 --out long.csv --checkpoint long.state "
             "--checkpoint-interval 1e-3",
             KT_COMMAND);
    const pid_t child = fork();
    if (child == 0) {
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
        _exit(127);
    }
    for (int i = 0; i < 50000 && size_of("long.state") <= 0; i++)
        nanosleep(&(struct timespec){0, 200000}, NULL);
    kt_check_above("its checkpoint", (double)size_of("long.state"), 1000.0);
    return child;
}

KT_TEST(second_run_with_one_checkpoint_is_rejected_at_its_start) {
    const char words[] = "checkpoint long.state cannot be written: another run writes its checkpoints there";
    const pid_t child = start_long_run();
    int how = 0;
    for (int i = 0; i < 3; i++) /* a checkpoint comes every millisecond: each of them is another file */
        kt_expect(4, words, "$K run chain.yaml --quiet --duration 1 --out second.csv --checkpoint long.state");
    kt_expect(0, NULL, "test ! -e second.csv -a ! -e second.csv.partial");
    kt_expect(4, "another run is writing it", "$K run chain.yaml --quiet --duration 1 --out long.csv");
    kt_check_true("the first goes on", waitpid(child, &how, WNOHANG) == 0);
    kill(child, SIGKILL);
    (void)waitpid(child, &how, 0);
    kt_expect(0, NULL, "$K run chain.yaml --quiet --duration 1 --out second.csv --checkpoint long.state");
}

static bool is_link(const char *name) {
    struct stat status;
    return lstat(name, &status) == 0 && S_ISLNK(status.st_mode);
}

/* Chains of links, to a file that does not exist at first, in another folder. */
KT_TEST(checkpoint_behind_a_link_is_written_there) {
    static const char line[] = "$K run chain.yaml --quiet --duration 1 --out linked.csv --checkpoint link.state "
                               "--checkpoint-interval 1e-3";
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    kt_expect(0, NULL,
              "mkdir -p store && rm -f store/* && ln -sf store/next.state link.state && "
              "ln -sf real.state store/next.state");
    for (int round = 0; round < 2; round++) {
        kt_expect(0, NULL, line);
        kt_check_true("the link stays", is_link("link.state") && is_link("store/next.state"));
        kt_check_true("its file is written", size_of("store/real.state") > 0 && !is_link("store/real.state"));
        kt_expect(0, NULL, "$K run chain.yaml --quiet --duration 1 --out linked.csv --resume link.state");
    }
    kt_expect(0, NULL, "ln -sf round.state link.state && ln -sf link.state round.state");
    kt_expect(4, "Too many levels of symbolic links", line);
}

/* A run that ends before its first checkpoint leaves no empty file, also if it is killed. An old file stays. */
KT_TEST(run_without_a_checkpoint_leaves_the_file_as_it_was) {
    kt_expect(0, NULL,
              "$K make chain --links 2 >two.yaml; $K run two.yaml --quiet --duration 1 --out o.csv --checkpoint x");
    kt_expect(0, NULL, "test ! -e x -a ! -e x.new");
    kt_expect(
        137, "another run writes its checkpoints there",
        "$K make chain --links 20 >chain.yaml; $K run chain.yaml --quiet --duration 1e5 --out k.csv --checkpoint x "
        "--checkpoint-interval 1000 & while test ! -s k.csv.partial && kill -0 $!; do :; done; $K run two.yaml --quiet "
        "--duration 1 --out o.csv --checkpoint x; kill -9 $!; wait $!");
    kt_expect(0, NULL, "test ! -e x -a -e x.new; rm x.new");
    kt_expect(0, NULL,
              "echo old >x; $K run two.yaml --quiet --duration 1 --out o.csv --checkpoint x; echo old | cmp - x");
}

/* ---- what is told of the time before the break ------------------------------------------------------------------- */

KT_TEST(summary_may_be_asked_for_at_the_break) {
    const char same[] = "sed '/cpu_seconds/d; /evaluations/d; /factorizations/d'";
    kt_expect(0, NULL, "$K run %s %s --out whole.csv --summary whole.json", KT_SCENES "/four-bar.yaml", options);
    char line[512];
    bool killed = false;
    for (int i = 0; i < 20 && !killed; i++) {
        (void)unlink("part.state");
        (void)unlink("part.csv");
        snprintf(line, sizeof line,
                 "%s run %s %s --out part.csv --checkpoint part.state --checkpoint-interval 1e-3 & while test ! -s "
                 "part.state && kill -0 $! 2>/dev/null; do :; done; kill -9 $! 2>/dev/null; wait; test ! -e part.csv",
                 KT_COMMAND, KT_SCENES "/four-bar.yaml", options);
        killed = kt_shell("%s", line).code == 0;
    }
    kt_check_true("it was killed", killed);
    kt_expect(0, NULL, "$K run %s %s --out part.csv --summary part.json --resume part.state",
              KT_SCENES "/four-bar.yaml", options);
    kt_expect(0, NULL, "%s whole.json >a; %s part.json >b; cmp a b; cmp whole.csv part.csv", same, same);
}

/* The warnings are those of steps that are too long for a mode. The watch has found modes before and after the
 * break. */
KT_TEST(warnings_are_those_of_an_unbroken_run) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    check_break("chain.yaml", "--integrator rk4 --step 0.02");
    json_t *root = kt_json(kt_read_file("part.json"));
    kt_check_above("warnings", (double)json_array_size(json_object_get(root, "warnings")), 1.0);
    json_decref(root);
}

/* ---- random breaks ----------------------------------------------------------------------------------------------- */

static double seconds_now(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Runs for so long, if it does not end before. Returns whether it was killed. */
static bool run_for(double seconds, const char *line) {
    const double end = seconds_now() + seconds;
    int how = 0;
    const pid_t child = fork();
    if (child == 0) {
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
        _exit(127);
    }
    while (waitpid(child, &how, WNOHANG) == 0)
        if (seconds_now() >= end)
            kill(child, SIGKILL);
        else
            nanosleep(&(struct timespec){0, 50000}, NULL);
    return WIFSIGNALED(how);
}

/* Killed again and again, at any moment, also while it resumes: the bytes at the end are those of an unbroken run. A
 * run that is killed before its first checkpoint is begun anew. */
KT_TEST(run_that_is_killed_at_random_times_ends_with_the_same_bytes) {
    char line[512];
    kt_random random = kt_random_of_test();
    int breaks = 0;
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    double whole = HUGE_VAL; /* seconds of an undisturbed run: the least of three */
    for (int i = 0; i < 3; i++) {
        const double begin = seconds_now();
        kt_expect(0, NULL, "$K run chain.yaml %s --out whole.csv", options);
        whole = fmin(whole, seconds_now() - begin);
    }
    /* Some three breaks a run. A busy machine that becomes idle has fewer of them, and more rounds. */
    for (int round = 0; round < KT_SHORT(1, 3) || (breaks < KT_SHORT(2, 6) && round < 20); round++) {
        kt_expect(0, NULL, "rm -f part.*");
        bool killed = true;
        for (int i = 0; killed && i < 200; i++) {
            const bool resumes = size_of("part.state") > 0;
            snprintf(line, sizeof line,
                     "exec %s run chain.yaml %s --out part.csv --checkpoint part.state --checkpoint-interval 1e-2 %s",
                     KT_COMMAND, options, resumes ? "--resume part.state" : "");
            /* Each try is given a tenth more, so that the run comes to its end however busy the machine is. */
            killed = run_for(pow(1.1, i) * kt_random_uniform(&random, 1e-4, 0.3 * whole), line);
            breaks += killed;
        }
        kt_check_true("it came to its end", !killed);
        kt_expect(0, NULL, "cmp part.csv whole.csv");
    }
    kt_note("%d breaks", breaks);
    kt_check_above("breaks", breaks, KT_SHORT(1.0, 5.0));
}

/* The folder of the checkpoint disappears during the run, as a share of a network does. The run lost its motion. */
KT_TEST(run_outlives_a_checkpoint_that_cannot_be_written) {
    static const char line[] = "$K run chain.yaml --quiet --duration 20 --interval 0.01 --out";
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml; %s whole.csv", line);
    const kt_ran ran =
        kt_shell("mkdir d; %s lost.csv --summary lost.json --checkpoint d/x --checkpoint-interval 1e-3 & "
                 "while test ! -s d/x && kill -0 $!; do :; done; mv d e; wait $!",
                 line);
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("warning", ran.err,
                      "checkpoint d/x cannot be written: No such file or directory; the last one is");
    const char *first = strstr(ran.err, "cannot be written");
    kt_check_true("once", first != NULL && strstr(first + 1, "cannot be written") == NULL);
    kt_expect(0, NULL, "cmp whole.csv lost.csv && grep -q '\"code\": \"checkpoint\"' lost.json");
    kt_expect(0, NULL, "%s lost.csv --resume e/x && cmp whole.csv lost.csv", line);
}

/* While a folder has the name of the checkpoint, the first one cannot be renamed. The next try began behind the bytes
 * of the first one, and made a checkpoint that --resume rejected. */
KT_TEST(first_checkpoint_that_cannot_be_written_is_written_later) {
    static const char line[] = "$K run chain.yaml --quiet --duration 200 --interval 0.02 --out";
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml; %s whole.csv", line);
    const kt_ran ran = kt_shell("%s late.csv --checkpoint late --checkpoint-interval 0.05 2>said & "
                                "while test ! -e late.new && kill -0 $!; do :; done; mkdir late; "
                                "until grep -q 'cannot be written' said || ! kill -0 $!; do :; done; rmdir late; "
                                "while test ! -f late && kill -0 $!; do :; done; kill -KILL $!; wait $!; cat said",
                                line);
    kt_check_contains("warning", ran.out,
                      "checkpoint late cannot be written: Is a directory; this run has written none");
    kt_expect(0, NULL, "%s late.csv --resume late && cmp whole.csv late.csv", line);
}

/* Before the first checkpoint, FILE.new holds the lock. No checkpoint could be written after somebody deleted it. */
KT_TEST(first_checkpoint_is_written_after_its_new_file_was_deleted) {
    static const char line[] = "$K run chain.yaml --quiet --duration 200 --interval 0.02 --out";
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml; %s whole.csv", line);
    const kt_ran ran = kt_shell("%s gone.csv --checkpoint gone --checkpoint-interval 0.05 2>said & "
                                "while test ! -e gone.new && kill -0 $!; do :; done; rm gone.new; "
                                "while test ! -s said -a ! -f gone && kill -0 $!; do :; done; kill -KILL $!; wait $!; "
                                "cat said",
                                line);
    kt_check_text("no warning", ran.out, "");
    kt_expect(0, NULL, "%s gone.csv --resume gone && cmp whole.csv gone.csv", line);
}

KT_TEST(checkpoint_that_cannot_be_written_ends_the_run_at_its_start) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    kt_expect(4, "checkpoint pipe cannot be written: it is not a file",
              "mkfifo pipe && $K run chain.yaml --quiet --out o.csv --checkpoint-interval 1e-9 --checkpoint pipe");
    kt_check_equal_int("the pipe is not replaced", kt_shell("test -p pipe").code, 0);
    kt_expect(4, "none/x cannot be written: No such file",
              "$K run chain.yaml --quiet --out o.csv --checkpoint none/x --checkpoint-interval 1e-9");
    kt_expect(1, "is the scene itself", "$K run chain.yaml --quiet --out o.csv --checkpoint chain.yaml");
}
