/* Runs that are killed and go on from their checkpoint end as if there had been no break, to the last byte. */
#define _XOPEN_SOURCE 700
#include "shell.h"

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
        if (size_of("part.csv.partial") >= bytes && size_of("part.state") >= 0)
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
    for (int i = 1; i <= 3; i++) {
        kill_at(scene, more, whole * i / 5);
        kt_note("%s: killed with %lld of %lld bytes", scene, size_of("part.csv.partial"), whole);
        kt_expect(0, NULL, "$K run %s %s %s --out part.csv --summary part.json --resume part.state", scene, options,
                  more);
        kt_expect(0, NULL, "cmp part.csv whole.csv");
        /* What it cost is another matter: the first slope after the break is computed once more. */
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

KT_TEST(killed_absolute_run_goes_on_to_the_last_byte) {
    check_break(KT_SCENES "/double-pendulum.yaml", "--formulation absolute");
}

/* A run broken off in the middle, with its checkpoint. */
static void break_off(void) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    kill_at("chain.yaml", "", 100000);
}

KT_TEST(checkpoint_that_does_not_fit_is_refused_in_words) {
    break_off();
    const char resume[] = "--out part.csv --summary part.json --resume";
    kt_expect(0, NULL, "cp part.csv.partial before.csv; cp part.state good");
    kt_expect(1, "it belongs to another scene, or to this one run with other options",
              "$K run chain.yaml %s --integrator tsit5 %s good", options, resume);
    kt_expect(1, "it belongs to another scene, or to this one run with other options",
              "$K run chain.yaml %s --out part.csv --resume good --interval 0.01", options);
    kt_expect(1, "it belongs to another scene",
              "sed 's/mass: 1$/mass: 1.5/; s/-9.8/-9.7/' chain.yaml >other.yaml; $K run other.yaml %s %s good", options,
              resume);
    kt_expect(1, "it is too short to be a checkpoint", "head -c 10 good >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "it is not as long as it was written", "head -c -1 good >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "it is not as long as it was written", "(cat good; echo) >bad; $K run chain.yaml %s %s bad", options,
              resume);
    kt_expect(1, "it is not a checkpoint", "tr k K <good >bad; $K run chain.yaml %s %s bad", options, resume);
    kt_expect(1, "its sum is wrong",
              "cp good bad; printf x | dd of=bad bs=1 seek=900 conv=notrunc 2>/dev/null; $K run chain.yaml %s %s bad",
              options, resume);
    kt_expect(1, "No such file", "$K run chain.yaml %s %s none", options, resume);
    kt_expect(1, "it is not a file", "$K run chain.yaml %s %s .", options, resume);
    kt_expect(
        1, "these are not the records until the checkpoint",
        "head -c 2000 part.csv.partial >short.csv; $K run chain.yaml %s --out short.csv --summary s.json --resume good",
        options);
    kt_expect(
        1, "these are not the records until the checkpoint",
        "sed s/time/Time/ part.csv.partial >other.csv; $K run chain.yaml %s --out other.csv --summary s.json --resume "
        "good",
        options);
    kt_expect(0, NULL, "cmp part.csv.partial before.csv");
    kt_expect(1, "standard output cannot be taken up again", "$K run chain.yaml --out - --checkpoint x");
    kt_expect(1, "--plot would not show", "$K run chain.yaml --resume x --plot x.svg");
}

KT_TEST(checkpoint_that_cannot_be_written_ends_the_run) {
    kt_expect(0, NULL, "$K make chain --links 20 >chain.yaml");
    kt_expect(4, "none/x cannot be written: No such file",
              "$K run chain.yaml --quiet --out o.csv --checkpoint none/x --checkpoint-interval 1e-9");
    kt_expect(1, "is the scene itself", "$K run chain.yaml --quiet --out o.csv --checkpoint chain.yaml");
}
