/* kinetree accuracy --formulations: every way to keep loops closed in one study, with the errors of each. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>
#include <string.h>

enum { FORMULATIONS = 7 };
static const char *const formulations[FORMULATIONS] = {"minimal",         "unprojected", "absolute",  "Baumgarte",
                                                       "stiff Baumgarte", "augmented",   "projection"};
static const bool closed[FORMULATIONS] = {true, false, true, false, false, false, true};

/* The line of a formulation, a method and a setting; -1: none. */
static int find_row(const char *csv, const char *formulation, const char *method, double setting) {
    char start[64];
    snprintf(start, sizeof start, "\n%s,%s,", formulation, method);
    const int column = kt_csv_column(csv, "setting");
    int line = 0;
    for (const char *at = csv; (at = strchr(at, '\n')) != NULL; at++) {
        line++;
        if (strncmp(at, start, strlen(start)) == 0 && kt_csv_number(csv, line, column) == setting)
            return line;
    }
    return -1;
}

/* Errors of every formulation, and the gaps of its loops: projected ones are closed to rounding, the others are not. */
KT_TEST(comparison_runs_every_set_with_both_methods) {
    const kt_ran ran = kt_shell("$K accuracy " KT_SCENES "/four-bar.yaml --formulations --duration 1 --steps 2e-3,1e-3 "
                                "--tolerances 1e-6 --budget 30 --out a.csv"); /* 10 s are too few under sanitizers */
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("table", ran.out, "\nrk4, step 0.002 s\n");
    kt_check_contains("table", ran.out, "\ndopri5, tolerance 1e-06\n");
    for (int i = 1; i < FORMULATIONS; i++) {
        char words[64];
        snprintf(words, sizeof words, "  %s gets wrong: ", formulations[i]);
        kt_check_contains("lines", ran.out, words);
    }
    const char *csv = kt_read_file("a.csv");
    kt_check_equal_int("lines", kt_count_lines(csv), 1 + 3 * FORMULATIONS);
    for (int i = 0; i < FORMULATIONS; i++) {
        const int coarse = find_row(csv, formulations[i], "rk4", 2e-3),
                  fine = find_row(csv, formulations[i], "rk4", 1e-3);
        const int adaptive = find_row(csv, formulations[i], "dopri5", 1e-6);
        const bool stiff = strcmp(formulations[i], "stiff Baumgarte") == 0; /* costs order */
        if (!kt_check_true(formulations[i], coarse > 0 && fine > 0 && adaptive > 0))
            continue;
        const int error = kt_csv_column(csv, "error.position"), open = kt_csv_column(csv, "constraint.position");
        kt_check_below("rk4, 1 ms", kt_csv_number(csv, fine, error), stiff ? 1e-5 : 1e-6);
        if (!stiff)
            kt_check_below("halved", kt_csv_number(csv, fine, error), 0.3 * kt_csv_number(csv, coarse, error));
        if (closed[i])
            kt_check_below("open", kt_csv_number(csv, fine, open), 3e-14);
        else
            kt_check_above("open", kt_csv_number(csv, fine, open), 1e-9);
    }
}

/* Whether a formulation's line reports that the run stopped early. */
static bool is_lost(const char *text, const char *formulation) {
    char words[64];
    snprintf(words, sizeof words, "\n  %s gets wrong: ", formulation);
    const char *line = strstr(text, words);
    if (!kt_check_true(formulation, line != NULL))
        return false;
    line += strlen(words);
    return strncmp(line, "takes another branch", 20) == 0 || strncmp(line, "breaks down", 11) == 0;
}

/* Through singular positions; dopri5 at a tolerance that the reduction takes to 1e-6. */
KT_TEST(comparison_says_which_sets_lose_the_n_four_bar) {
    const kt_ran ran = kt_shell("$K accuracy " KT_SCENES "/n-four-bar-2.yaml --formulations --integrators dopri5 "
                                "--tolerances 1e-9 --budget 10 --plot n.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_true("unprojected", is_lost(ran.out, "unprojected"));
    kt_check_true("Baumgarte", is_lost(ran.out, "Baumgarte"));
    kt_check_true("projection", !is_lost(ran.out, "projection"));
    kt_check_contains("verdict", ran.out, "passes singular positions without means to cross them\n");
#ifdef KT_WITH_CAIRO
    kt_check_true("picture", strstr(kt_read_file("n.svg"), "<svg") != NULL);
#endif
}

KT_TEST(comparison_needs_loops) {
    kt_expect(1, "the option '--compare-sets' is called '--formulations' now",
              "$K accuracy " KT_SCENES "/four-bar.yaml --compare-sets");
    kt_expect(1, "there are no loops to keep closed", "$K accuracy " KT_SCENES "/pendulum.yaml --formulations");
}

/* Orders of Radau IIA in tree and absolute coordinates, from the last lines of their tables. Further options are
 * rejected. */
KT_TEST(baselines_print_orders_in_tree_and_absolute_coordinates) {
    const kt_ran ran = kt_shell("$K accuracy " KT_SCENES "/four-bar.yaml --baselines --duration 0.25 "
                                "--steps 0.00625,0.003125");
    kt_check_equal_int("exit code", ran.code, 0);
    const char *tree = strstr(ran.out, "in tree coordinates"), *absolute = strstr(ran.out, "in absolute coordinates");
    kt_need(kt_check_true("both", tree != NULL && absolute != NULL));
    for (int i = 0; i < 2; i++) {
        const char *at = strstr(i ? absolute : tree, "  ggl, radau5\n");
        double x[7], orders[3] = {0.0};
        for (int line = 0; line < 2 && at != NULL; line++)
            at = strchr(at, '\n') != NULL ? strchr(at, '\n') + 1 : NULL;
        const int count = at == NULL ? 0
                                     : sscanf(at, "%lf %lf %lf %lf %lf %lf %lf %lf %lf %lf", &x[0], &x[1], &x[2], &x[3],
                                              &x[4], &x[5], &x[6], &orders[0], &orders[1], &orders[2]);
        kt_check_equal_int(i ? "absolute: numbers" : "tree: numbers", count, 10);
        kt_check_near("order of positions", orders[0], 5.0, 0.5);
        kt_check_near("order of velocities", orders[1], 5.0, 0.5);
        kt_check_near("order of multipliers", orders[2], 3.0, 0.7);
    }
    kt_check_contains("conflict", kt_shell("$K accuracy " KT_SCENES "/four-bar.yaml --baselines --plot a.svg").err,
                      "--baselines has a table of its own");
    kt_check_contains("a tree", kt_shell("$K accuracy " KT_SCENES "/pendulum.yaml --baselines").err,
                      "no loops to keep closed");
}
