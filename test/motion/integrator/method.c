/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "kinetree/integrator.h"

#include <string.h>

KT_TEST(every_method_is_found_by_its_name) {
    static const char *const names[] = {"euler", "implicit-euler", "midpoint", "heun",  "ralston", "crank-nicolson",
                                        "bdf2",  "two-step",       "ab2",      "rkc2",  "kutta3",  "bs32",
                                        "rk4",   "rk38",           "ab4",      "rkc4",  "dopri5",  "tsit5",
                                        "auto",  "rodas5p",        "radau5",   "dop853"};
    kt_check_equal_int("count", kt_method_count(), (long long)(sizeof names / sizeof *names));
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_find(names[i]);
        kt_check_true(names[i], m != NULL);
        if (m == NULL)
            continue;
        kt_check_true("the same at its index", m == kt_method_at(i));
        kt_check_true("title and source", m->title != NULL && m->source != NULL);
        kt_check_true("in rising order", i == 0 || m->order >= kt_method_at(i - 1)->order);
    }
}

/* implicit_euler is implicit-euler. */
KT_TEST(every_method_is_found_by_its_identifier) {
    int found = 0;
#define FIND(id) found += kt_check_true(#id, kt_method_find(#id) == kt_method_at(found));
    KT_METHOD_LIST(FIND)
#undef FIND
    kt_check_equal_int("all", found, kt_method_count());
}

KT_TEST(names_of_all_methods_stand_in_one_line) {
    for (int adaptive = 0; adaptive <= 1; adaptive++) {
        char expected[256] = "", names[256], some[8];
        for (int i = 0; i < kt_method_count(); i++)
            if (!adaptive || kt_method_is_adaptive(kt_method_at(i))) {
                strcat(expected, expected[0] != '\0' ? ", " : "");
                strcat(expected, kt_method_at(i)->name);
            }
        const long long length = (long long)strlen(expected);
        kt_check_equal_int("length", (long long)kt_method_names(adaptive, names, sizeof names), length);
        kt_check_text("names", names, expected);
        kt_check_equal_int("length of no text", (long long)kt_method_names(adaptive, NULL, 0), length);
        kt_check_equal_int("length of a short text", (long long)kt_method_names(adaptive, some, sizeof some), length);
        expected[sizeof some - 1] = '\0';
        kt_check_text("what fits", some, expected);
    }
}

KT_TEST(a_method_tells_its_family) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const bool stabilised = strncmp(m->name, "rkc", 3) == 0, adams = strncmp(m->name, "ab", 2) == 0;
        const bool radau = strcmp(m->name, "radau5") == 0, rosenbrock = strcmp(m->name, "rodas5p") == 0;
        const bool dirk = strcmp(m->name, "implicit-euler") == 0 || strcmp(m->name, "crank-nicolson") == 0;
        const bool two_step = strcmp(m->name, "bdf2") == 0 || strcmp(m->name, "two-step") == 0;
        const bool switches = strcmp(m->name, "auto") == 0;
        kt_check_text(m->name, kt_method_family_name(m),
                      stabilised   ? "stabilised"
                      : adams      ? "adams"
                      : radau      ? "radau"
                      : rosenbrock ? "rosenbrock"
                      : dirk       ? "dirk"
                      : two_step   ? "two-step"
                      : switches   ? "switching"
                                   : "explicit");
        kt_check_true("implicit", kt_method_is_implicit(m) == (radau || rosenbrock || dirk || two_step));
        kt_check_true("steps", m->steps == (adams || two_step ? (m->order == 4 ? 4 : 2) : 0));
        kt_check_true("stages vary", kt_method_stages_vary(m) == stabilised);
        kt_check_true("adaptive", kt_method_is_adaptive(m) == (m->e != NULL));
    }
}

KT_TEST(what_is_no_method_is_not_found) {
    kt_check_true("as in KT_METHOD_LIST", kt_method_find("rk_4") == NULL && kt_method_find("rk") == NULL);
    kt_check_true("unknown", kt_method_find("rk5") == NULL);
    kt_check_true("empty", kt_method_find("") == NULL);
    kt_check_true("NULL", kt_method_find(NULL) == NULL);
    kt_check_true("-1", kt_method_at(-1) == NULL);
    kt_check_true("count", kt_method_at(kt_method_count()) == NULL);
}

KT_TEST(dense_orders_are_those_documented) {
    static const int expected[] = {1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 7};
    for (int i = 0; i < kt_method_count(); i++)
        kt_check_equal_int(kt_method_at(i)->name, kt_method_dense_order(kt_method_at(i)), expected[i]);
}
