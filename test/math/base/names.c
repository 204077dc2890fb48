/* SPDX-License-Identifier: Apache-2.0 */
#include "base/names.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* ---- tables ------------------------------------------------------------------------------------------------------ */

enum { MANY = 50000 };

KT_TEST(table_finds_every_name_in_its_scope) {
    static char names[MANY][16];
    kt_names table;
    void *memory = malloc(kt_names_size(2 * MANY));
    kt_names_init(&table, 2 * MANY, memory);
    for (int i = 0; i < MANY; i++)
        snprintf(names[i], sizeof names[i], "link%d", i);
    long wrong = 0;
    for (int i = 0; i < MANY; i++)
        wrong += kt_names_add(&table, -1, names[i], i) != -1;
    for (int i = 0; i < MANY; i++) /* the same names again, elsewhere */
        wrong += kt_names_add(&table, i % 3, names[i], MANY - i) != -1;
    kt_check_equal_int("names rejected", wrong, 0);
    for (int i = 0; i < MANY; i++) {
        char copy[16];
        memcpy(copy, names[i], sizeof copy);
        wrong += kt_names_find(&table, -1, copy) != i;
        wrong += kt_names_find(&table, i % 3, copy) != MANY - i;
        wrong += kt_names_find(&table, (i + 1) % 3, copy) != -1;
        wrong += kt_names_add(&table, -1, copy, 0) != i; /* the first stands */
        wrong += kt_names_find(&table, -1, copy) != i;
    }
    kt_check_equal_int("wrong answers", wrong, 0);
    kt_check_equal_int("absent", kt_names_find(&table, -1, "link50000"), -1);
    kt_check_equal_int("empty", kt_names_find(&table, -1, ""), -1);
    free(memory);
}

/* Linear probing at a load a takes `(1 + 1 / (1 - a)^2) / 2` probes for an absent name if the hash is even. This is 5
 * at `a = 2/3` (Knuth, The Art of Computer Programming, volume `3, section 6.4`). Names that count up, as those of
 * chains do, must not do worse than 1.5 times that. */
KT_TEST(table_spreads_names_that_count_up) {
    static char names[MANY][16];
    kt_names table;
    const int count = 43690; /* two thirds of 65536: as full as a table gets */
    void *memory = malloc(kt_names_size((size_t)count));
    kt_names_init(&table, (size_t)count, memory);
    for (int i = 0; i < count; i++) {
        snprintf(names[i], sizeof names[i], "link%d", i);
        (void)kt_names_add(&table, -1, names[i], i);
    }
    kt_check_equal_int("slots", (long long)table.mask + 1, 65536);
    double probes = 0.0;
    for (size_t i = 0; i <= table.mask; i++)
        for (size_t k = i; table.slots[k & table.mask].name != NULL; k++)
            probes += 1.0;
    kt_check_below("mean probes of an absent name", 1.0 + probes / 65536.0, 1.5 * 5.0);
    free(memory);
}

KT_TEST(table_needs_at_most_three_slots_a_name) {
    KT_WORST worst = kt_worst_make("slots a name");
    for (size_t count = 2; count < 3000; count++) {
        const double slots = (double)kt_names_size(count) / sizeof(kt_name_slot);
        kt_worst_below(&worst, slots / (double)count, 3.01, "%zu names", count);
        if (slots < 1.5 * (double)count)
            kt_check_true("at most two thirds full", false);
    }
    kt_names table;
    char memory[4 * sizeof(kt_name_slot)] __attribute__((aligned(8)));
    kt_check_equal_int("bytes for none", (long long)kt_names_size(0), sizeof memory);
    kt_names_init(&table, 0, memory);
    kt_check_equal_int("in an empty table", kt_names_find(&table, 0, "a"), -1);
}

/* ---- spelling ---------------------------------------------------------------------------------------------------- */

KT_TEST(names_begin_with_a_letter) {
    static const char *const valid[] = {"a", "Z", "_", "a9", "a0", "link-2", "_-", "A_b-9z"};
    static const char *const invalid[] = {"",          "9",  "-a", "a b", "a.b", "a'", "a\n", "\xC3\xA4",
                                          "a\xC3\xA4", "a@", "a[", "a`",  "a{",  "a/", "a:"};
    for (size_t i = 0; i < sizeof valid / sizeof *valid; i++)
        kt_check_true(valid[i], kt_name_is_valid(valid[i]));
    for (size_t i = 0; i < sizeof invalid / sizeof *invalid; i++)
        kt_check_true("invalid", !kt_name_is_valid(invalid[i]));
    kt_check_true("NULL", !kt_name_is_valid(NULL));
}

KT_TEST(quoted_names_are_safe_to_print) {
    kt_check_text("plain", kt_name_quote("crank").text, "'crank'");
    kt_check_text("empty", kt_name_quote("").text, "''");
    kt_check_text("control characters", kt_name_quote("a\tb\x7F\x1B[0m").text, "'a?b??[0m'");
    kt_check_text("space", kt_name_quote("a b").text, "'a b'");
    kt_check_text("UTF-8 stays", kt_name_quote("\xC3\xA4").text, "'\xC3\xA4'");
    char name[100], expected[120];
    memset(name, 'x', sizeof name);
    name[69] = '\0';
    snprintf(expected, sizeof expected, "'%s'", name);
    kt_check_text("69 characters fit", kt_name_quote(name).text, expected);
    name[69] = 'x';
    name[70] = '\0';
    snprintf(expected, sizeof expected, "'%.66s...'", name);
    kt_check_text("70 do not", kt_name_quote(name).text, expected);
    memcpy(name + 65, "\xC3\xA4", 2); /* its second byte would be cut off */
    snprintf(expected, sizeof expected, "'%.65s...'", name);
    kt_check_text("no character is cut in two", kt_name_quote(name).text, expected);
}

/* ---- the nearest name -------------------------------------------------------------------------------------------- */

static const char *nearest(const char *wanted, const char *const *candidates, int count) {
    kt_nearest search = kt_nearest_make(wanted, NULL);
    for (int i = 0; i < count; i++)
        if (!kt_nearest_try(&search, candidates[i]))
            break;
    return search.best;
}

KT_TEST(slips_of_the_pen_are_understood) {
    static const char *const names[] = {"crank", "coupler", "rocker", NULL, "joint_damper",
                                        "ab",    "x",       "tip",    "z",  "bodies"};
    static const struct {
        const char *wanted, *meant;
    } table[] = {
        {"crnak", "crank"},
        {"Crank", "crank"},
        {"rank", "crank"},
        {"cranks", "crank"},
        {"krank", "crank"},
        {"rokcer", "rocker"},
        {"JOINT-DAMPER", "joint_damper"},
        {"jointdampr", "joint_damper"},
        {"ba", "ab"},
        {"X", "x"},
        {"Z", "z"},
        {"tpi", "tip"},
        {"bodys", "bodies"}, /* two slips, of the six letters that are meant */
        {"bc", NULL},
        {"y", NULL},
        {"crabs", NULL},
        {"piston", NULL},
        {"", NULL},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const char *found = nearest(table[i].wanted, names, 10);
        if (table[i].meant == NULL)
            kt_check_true(table[i].wanted, found == NULL);
        else
            kt_check_text(table[i].wanted, found, table[i].meant);
    }
    static const char *const twins[] = {"leg3", "leg1", "leg2"};
    kt_check_text("of equally near ones the first", nearest("leg9", twins, 3), "leg3");
}

/* The distance by its recursion, without a table. */
static int plain_distance(const char *a, int m, const char *b, int n) {
    if (m == 0 || n == 0)
        return m + n;
    int least = plain_distance(a, m - 1, b, n - 1) + (a[m - 1] != b[n - 1]);
    const int deleted = plain_distance(a, m - 1, b, n) + 1, inserted = plain_distance(a, m, b, n - 1) + 1;
    least = deleted < least ? deleted : least;
    least = inserted < least ? inserted : least;
    if (m > 1 && n > 1 && a[m - 1] == b[n - 2] && a[m - 2] == b[n - 1]) {
        const int swapped = plain_distance(a, m - 2, b, n - 2) + 1;
        least = swapped < least ? swapped : least;
    }
    return least;
}

enum { LONGEST = 8 };

/* A word of the letters a, b and c; returns its length. */
static int draw_word(kt_random *random, int least, char word[LONGEST + 1]) {
    const int length = kt_random_int(random, least, LONGEST);
    for (int k = 0; k <= LONGEST; k++)
        word[k] = (char)(k < length ? 'a' + kt_random_int(random, 0, 2) : '\0');
    return length;
}

KT_TEST(nearest_name_is_that_of_the_plain_recursion) {
    kt_random random = kt_random_of_test();
    long wrong = 0, found = 0, none = 0;
    for (int trial = 0; trial < 400; trial++) {
        enum { COUNT = 6 };
        char wanted[LONGEST + 1], text[COUNT][LONGEST + 1];
        const char *candidates[COUNT];
        const int m = draw_word(&random, 2, wanted);
        const char *best = NULL;
        int least = LONGEST;
        for (int i = 0; i < COUNT; i++) {
            const int n = draw_word(&random, 1, text[i]), longer = m > n ? m : n;
            candidates[i] = text[i];
            const int d = plain_distance(wanted, m, text[i], n);
            if (d < least && d <= (longer > 3 ? longer : 3) / 3) {
                least = d;
                best = text[i];
            }
        }
        wrong += nearest(wanted, candidates, COUNT) != best;
        found += best != NULL;
        none += best == NULL;
    }
    kt_check_equal_int("wrong answers", wrong, 0);
    kt_check_above("trials with a near name", (double)found, 50.0);
    kt_check_above("trials without", (double)none, 50.0);
}

KT_TEST(far_and_long_names_are_no_suggestion) {
    char longest[66], other[66];
    memset(longest, 'x', sizeof longest);
    memset(other, 'x', sizeof other);
    longest[64] = other[64] = '\0';
    const char *candidate = other;
    memset(other, 'y', 4);
    kt_check_true("four letters of 64 differ", nearest(longest, &candidate, 1) == other);
    memset(other, 'y', 5);
    kt_check_true("five differ", nearest(longest, &candidate, 1) == NULL);
    memset(other, 'x', 5);
    longest[64] = 'x';
    longest[65] = '\0';
    kt_check_true("65 letters are too long to look for", nearest(longest, &candidate, 1) == NULL);
    const char *one_longer = longest;
    kt_check_true("and to find", nearest(other, &one_longer, 1) == NULL);
}

KT_TEST(search_stops_when_its_effort_is_spent) {
    int64_t effort = 20;
    kt_nearest search = kt_nearest_make("crank", &effort);
    kt_check_true("too short to compare: cheap", kt_nearest_try(&search, "a"));
    kt_check_equal_int("left", effort, 18);
    kt_check_true("compared", kt_nearest_try(&search, "xxxxx"));
    kt_check_equal_int("left", effort, 18 - 21);
    kt_check_true("no more", !kt_nearest_try(&search, "crank"));
    kt_check_equal_int("left as it was", effort, 18 - 21);
    kt_check_true("nothing found", search.best == NULL);
    effort = 0;
    kt_check_true("none left", !kt_nearest_try(&search, "crank") && search.best == NULL);
    effort = 1000;
    kt_check_true("found: nothing can be nearer", !kt_nearest_try(&search, "CRANK"));
    kt_check_text("best", search.best, "CRANK");
}
