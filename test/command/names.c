/* Names from files are always shown without characters that would control a terminal. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <string.h>

/* A title that turns the terminal red, sets its window's name and rings; a line break, and a mark that turns the text.
 */
static const char scene[] = "kinetree: 1\n"
                            "name: \"a\\x1b[31mb\\x1b]0;mine\\x07\\n\\u009bc\\u202ed\"\n"
                            "gravity: [0, -9.81, 0]\n"
                            "bodies: [{name: bob, joint: {type: revolute, position: 1}, mass: 1, com: [0, -1, 0]}]\n"
                            "simulate: {duration: 0.1}\n";

#define SHOWN "a\\x1b[31mb\\x1b]0;mine\\x07\\n\\u009bc\\u202ed"

static void check_plain(const char *what, const char *text) {
    if (text == NULL) {
        kt_check_true(what, false);
        return;
    }
    bool plain = strstr(text, "\xc2\x9b") == NULL && strstr(text, "\xe2\x80\xae") == NULL;
    for (const char *c = text; *c != '\0'; c++)
        plain = plain && ((unsigned char)*c >= 0x20U || *c == '\n') && *c != '\x7f';
    if (!kt_check_true(what, plain))
        kt_note("%zu bytes", strlen(text));
}

KT_TEST(name_of_a_scene_is_escaped_where_it_is_shown) {
    kt_write_file("s.yaml", scene);
    static const char *const commands[] = {"run s.yaml --out o.csv", "info s.yaml", "modes s.yaml", "stability s.yaml",
                                           "accuracy s.yaml --integrators rk4 --budget 0.1 --out a.csv --plot a.svg"};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
#ifndef KT_WITH_CAIRO
        if (strstr(commands[i], ".svg") != NULL)
            continue;
#endif
        const kt_ran ran = kt_shell("$K %s >both 2>&1; code=$?; cat both; exit $code", commands[i]);
        kt_check_equal_int(commands[i], ran.code, 0);
        kt_check_contains(commands[i], ran.out, SHOWN);
        check_plain(commands[i], ran.out);
    }
    kt_shell("mkdir folder; cp s.yaml folder/one.yaml");
    const kt_ran listed = kt_shell("KINETREE_SCENES=folder $K demo");
    kt_check_text("demo", listed.out, "one  " SHOWN "\n");
    /* JSON escapes by itself, and gives the name back as it is. */
    json_t *root = kt_json(kt_shell("$K run s.yaml --quiet --out o.csv --summary -").out);
    kt_check_contains("summary", json_string_value(json_object_get(root, "scene")), "a\x1b[31mb");
    json_decref(root);
}

KT_TEST(words_of_a_wrong_file_are_escaped) {
    kt_write_file("w.yaml",
                  "kinetree: 1\n\"ke\\x1b[31my\": 1\nbodies:\n  - {name: \"b\\u009bob\", parent: \"\\u202ea\"}\n"
                  "  - {name: c, joint: {type: \"rev\\x07olute\"}}\n");
    kt_ran ran = kt_shell("$K check w.yaml");
    kt_check_equal_int("exit code", ran.code, 2);
    check_plain("standard error", ran.err);
    ran = kt_shell("$K run \"$(printf 'no\\033[31mne\\377.yaml')\"");
    kt_check_equal_int("exit code", ran.code, 2);
    kt_check_contains("file", ran.err, "no\\x1b[31mne\\xff.yaml");
    check_plain("standard error", ran.err);
}

KT_TEST(names_of_columns_are_escaped) {
    kt_write_file("t.csv", "time,x\x1b[31m\xff\n0,1\n1,2\n");
    kt_ran ran = kt_shell("$K plot t.csv --columns none");
    check_plain("standard error", ran.err);
#ifdef KT_WITH_CAIRO
    ran = kt_shell("$K plot t.csv --out t.svg");
    kt_check_equal_int("drawn", ran.code, 0);
    check_plain("standard error", ran.err);
    check_plain("picture", kt_read_file("t.svg"));
#endif
}
