/* The forces of loops, as `run` records them and `evaluate` prints them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- what loops exert -------------------------------------------------------------------------------------------- */

/* Two level rods, geared a + 2 b = 0: with M1 = 1/3, M2 = 1/6 and h = g / 2 on both, M1 a1 + h = lambda and
 * M2 a2 + h = 2 lambda give a2 = g / 3 and lambda = g / 2 - 2 M1 g / 3 = 5 g / 18. */
static const char geared[] = "kinetree: 1\n"
                             "gravity: [0, -9.81, 0]\n"
                             "bodies:\n"
                             "  - {name: a, joint: {type: revolute}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                             "  - {name: b, joint: {type: revolute, at: [2, 0, 0]}, mass: 2,\n"
                             "     shape: {type: rod, to: [0.5, 0, 0]}}\n"
                             "loops:\n"
                             "  - {name: gear, type: coupling, coefficients: {a: 1, b: 2}}\n"
                             "simulate: {duration: 1, integrator: rk4, step: 0.01}\n"
                             "output: {interval: 0.1, record: [position, reaction]}\n";

KT_TEST(coupling_has_its_generalised_force_in_a_column) {
    static const char *const options[] = {"", "--formulation absolute --integrator dop853 --step 0.01"};
    kt_write_file("gear.yaml", geared);
    for (int i = 0; i < 2; i++) {
        kt_ran ran = kt_shell("$K run gear.yaml --quiet --out - %s", options[i]);
        const int column = kt_csv_column(ran.out, "reaction.gear.multiplier");
        kt_check_near("lambda", kt_csv_number(ran.out, 1, column), 5.0 * 9.81 / 18.0, 1e-13);
        kt_check_equal_int("no wrench", kt_csv_column(ran.out, "reaction.gear.fx"), -1);
        kt_check_near("what the gear does to b", kt_csv_number(ran.out, 1, kt_csv_column(ran.out, "reaction.b.mz")),
                      5.0 * 9.81 / 9.0, 1e-13);
    }
    kt_ran ran = kt_shell("$K run gear.yaml --quiet --out - --record multiplier");
    kt_check_true("alone", strncmp(ran.out, "time,reaction.gear.multiplier\n", 30) == 0);
    ran = kt_shell(
        "$K run gear.yaml --quiet --out - --record reaction,multiplier | head -1 | tr , '\\n' | sort | uniq -d");
    kt_check_text("no column twice", ran.out, "");
    kt_expect(0, "picture: gear.svg\n",
              "$K run gear.yaml --quiet --record multiplier --out gear.csv && $K plot gear.csv --out gear.svg");
    kt_check_contains("drawn", kt_read_file("gear.svg"), "<svg");
}

KT_TEST(every_equation_of_a_loop_has_its_multiplier_where_asked) {
    kt_ran ran =
        kt_shell("$K run \"" KT_SCENES "/slider-crank.yaml\" --quiet --duration 0.1 --out - --record multiplier");
    kt_check_above("five equations", kt_csv_column(ran.out, "reaction.pin.multiplier[4]"), 1);
    kt_check_above("the first", kt_csv_column(ran.out, "reaction.pin.multiplier[0]"), 0.5);
    kt_check_true("and no more", strstr(ran.out, ".multiplier[5]") == NULL);
}

/* The report also has quantities that were not recorded. */
KT_TEST(report_says_how_far_loops_were_open_whatever_was_recorded) {
    static const char run[] =
        "$K run \"" KT_SCENES "/slider-crank.yaml\" --duration 1 --integrator rk4 --step 0.02 --unprojected";
    kt_ran ran = kt_shell("%s --quiet --out - --record constraint", run);
    const int column = kt_csv_column(ran.out, "constraint.position");
    double most = 0.0;
    for (int line = 1; line < kt_count_lines(ran.out); line++)
        most = fmax(most, kt_csv_number(ran.out, line, column));
    kt_check_above("they drift open", most, 0.05);
    char words[80];
    (void)snprintf(words, sizeof words, "loops closed to %.2g m or rad", most);
    kt_check_contains("report", kt_shell("%s --out /dev/null --record position", run).err, words);
}

/* ---- the equations of motion add up ------------------------------------------------------------------------------ */

typedef struct balance {
    double off, size; /* the largest |M a + h - Q - A' lambda|, and sum of the sizes of its terms in a row */
    double slip;      /* the largest |A N|, over the length of the row of A where this is above 1 */
    long long free, rank, coordinates;
} balance;

static double number_at(const json_t *list, size_t i) { return json_number_value(json_array_get(list, i)); }

static balance add_up(const json_t *root) {
    const json_t *mass = kt_json_find(root, "mass_matrix"), *a = kt_json_find(root, "acceleration");
    const json_t *h = kt_json_find(root, "bias"), *applied = kt_json_find(root, "applied_force");
    const json_t *jacobian = kt_json_find(root, "constraint.jacobian");
    const json_t *lambda = kt_json_find(root, "constraint.multiplier");
    const json_t *basis = kt_json_find(root, "constraint.null_space");
    const size_t n = json_array_size(h), k = json_array_size(lambda);
    balance b = {.free = (long long)json_array_size(json_array_get(basis, 0)),
                 .rank = (long long)kt_json_at(root, "constraint.rank"),
                 .coordinates = (long long)n};
    for (size_t i = 0; i < n; i++) {
        double sum = number_at(h, i) - number_at(applied, i);
        double size = fabs(number_at(h, i)) + fabs(number_at(applied, i));
        for (size_t j = 0; j < n; j++) {
            const double term = number_at(json_array_get(mass, i), j) * number_at(a, j);
            sum += term;
            size += fabs(term);
        }
        for (size_t r = 0; r < k; r++) {
            const double term = number_at(json_array_get(jacobian, r), i) * number_at(lambda, r);
            sum -= term;
            size += fabs(term);
        }
        b.off = isnan(sum) ? (double)NAN : fmax(b.off, fabs(sum));
        b.size = fmax(b.size, size);
    }
    for (size_t r = 0; r < k; r++) {
        double square = 0.0;
        for (size_t i = 0; i < n; i++)
            square += number_at(json_array_get(jacobian, r), i) * number_at(json_array_get(jacobian, r), i);
        for (size_t c = 0; c < (size_t)b.free; c++) {
            double sum = 0.0;
            for (size_t i = 0; i < n; i++)
                sum += number_at(json_array_get(jacobian, r), i) * number_at(json_array_get(basis, i), c);
            b.slip = fmax(b.slip, fabs(sum) / fmax(1.0, sqrt(square)));
        }
    }
    return b;
}

/* M a + h = Q + A' lambda and A N = 0, from the printed numbers alone. The bounds are measured rounding errors. For the
 * first equation, this is 2.8 eps of the largest row's terms. It comes from the row of 40 four-bars; all others stay
 * below 1.4 eps. For the second one, it is 6 eps of a radian or a metre, or of the row of A. */
KT_TEST(evaluate_prints_equations_that_add_up_for_every_bundled_scene) {
    char scenes[8192];
    (void)snprintf(scenes, sizeof scenes, "%s", kt_shell("cd \"" KT_SCENES "\" && ls *.yaml").out);
    KT_WORST motion = kt_worst_make("M a + h - Q - A' lambda"), still = kt_worst_make("A N");
    int count = 0, with_loops = 0, wrong = 0, rotors = 0;
    for (char *name = strtok(scenes, "\n"); name != NULL; name = strtok(NULL, "\n"), count++) {
        kt_ran ran = kt_shell("$K evaluate \"" KT_SCENES "/%s\"", name);
        json_t *root = kt_json(ran.out);
        const balance b = add_up(root);
        /* For a rotor that turns evenly at omega about a fixed axis, every term is rounding of cancelling terms within
         * h. These are sums of m (dx/dq_i) . x'' with |x''| = omega |x'|. The inequality of Cauchy and Schwarz bounds
         * the sum of their sizes in a row by omega sqrt(M_ii 2 T). For the rotor's own coordinate, this is 2 T. If
         * other terms remain, only these count. */
        const double kinetic = kt_json_at(root, "energy.kinetic");
        const bool even = b.size <= 1e-12 * kinetic;
        rotors += even && kinetic > 0.0;
        const double size = even ? kinetic : b.size;
        kt_worst_below(&motion, b.off, 6.0 * DBL_EPSILON * size, "%s", name);
        kt_worst_below(&still, b.slip, 12.0 * DBL_EPSILON, "%s", name);
        if (kt_json_at(root, "constraint.equations") > 0.0) {
            with_loops++;
            wrong += b.free != b.coordinates - b.rank;
        }
        json_decref(root);
    }
    kt_check_equal_int("bases of another size than coordinates - rank", wrong, 0);
    kt_check_above("rotors that turn evenly", rotors, 2);
    kt_check_above("scenes", count, 40);
    kt_check_above("with loops", with_loops, 20);
}
