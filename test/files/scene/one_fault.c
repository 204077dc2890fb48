/* A first fault has no followers: in the bundled scenes one key or one value is broken at a time. A fault that is
 * reported at the broken place must be the only one.
 *
 * KT_BROKEN=N breaks each scene N times; 0: in every way.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "check.h"
#include "collect.h"
#include "folder.h"
#include "random.h"

/* ---- what can be broken ------------------------------------------------------------------------------------------ */

/* A scalar of a file: its bytes, and where the place of a fault in it may be. */
typedef struct scalar {
    size_t begin, end;
    unsigned line, first; /* from 1 */
    bool is_key;
} scalar;

enum { SCALARS = 4000, DEPTH = 40 };

typedef struct scalars {
    scalar at[SCALARS];
    int count;
} scalars;

/* Whether the next scalar is a key: in each mapping keys and values take turns. */
typedef struct nesting {
    bool is_map[DEPTH], expects_key[DEPTH];
    int depth;
} nesting;

static bool take_turn(nesting *n) {
    bool *expects = &n->expects_key[n->depth];
    const bool is_key = n->is_map[n->depth] && *expects;
    *expects = !*expects;
    return is_key;
}

static void enter(nesting *n, bool is_map) {
    (void)take_turn(n);
    n->depth++;
    n->is_map[n->depth] = n->expects_key[n->depth] = is_map;
}

static void list_scalars(const char *text, size_t size, scalars *to) {
    yaml_parser_t parser;
    yaml_event_t event;
    nesting in = {.depth = 0};
    bool goes_on = yaml_parser_initialize(&parser);
    to->count = 0;
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, size);
    while (goes_on && yaml_parser_parse(&parser, &event)) {
        const yaml_mark_t a = event.start_mark, b = event.end_mark;
        if (event.type == YAML_MAPPING_START_EVENT || event.type == YAML_SEQUENCE_START_EVENT)
            enter(&in, event.type == YAML_MAPPING_START_EVENT);
        else if (event.type == YAML_MAPPING_END_EVENT || event.type == YAML_SEQUENCE_END_EVENT)
            in.depth--;
        else if (event.type == YAML_SCALAR_EVENT) {
            const bool is_key = take_turn(&in);
            if (to->count < SCALARS && a.line == b.line)
                to->at[to->count++] = (scalar){a.index, b.index, (unsigned)a.line + 1, (unsigned)a.column + 1, is_key};
        }
        goes_on = event.type != YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
    }
    yaml_parser_delete(&parser);
}

/* ---- breaking ---------------------------------------------------------------------------------------------------- */

static const char *const wrong_values[] = {"-1",  "0",   "1e60", "bogus",  "[1, 2]", "{bogus: 1}",
                                           "[]",  "=q",  "=1/0", "30 deg", "\"\"",   "[-1, -1, -1]",
                                           "1e9", "nan", "true", "world"};
static const char *const wrong_keys[] = {"bogus", "name", "type"};

typedef struct broken {
    int count, alone, silent, followed;
} broken;

static kt_collected faults;

/* Whether a fault of "X:LINE:COLUMN: ..." lies at the broken place; its bytes may be others now. */
static bool is_at(const char *fault, const scalar *what, size_t length) {
    unsigned line = 0, column = 0;
    return sscanf(fault, "%u:%u", &line, &column) == 2 && line == what->line && column >= what->first &&
           column < what->first + length + 1;
}

/* Items of a list in place of a value may each be wrong, but no fault is reported twice. */
static void judge(const char *name, const scalar *what, const char *instead, broken *sum) {
    int here = 0, elsewhere = 0, again = 0;
    unsigned last = 0;
    for (const char *fault = faults.text; *fault != '\0'; fault = strchr(fault, '\n') + 1) {
        unsigned line = 0, column = 0;
        (void)sscanf(fault, "%u:%u", &line, &column);
        if (is_at(fault, what, strlen(instead))) {
            again += here > 0 && column == last;
            here++;
            last = column;
        } else {
            elsewhere++;
        }
    }
    sum->count++;
    sum->silent += here == 0;
    const bool is_alone = here > 0 && elsewhere == 0 && again == 0;
    sum->alone += is_alone;
    sum->followed += here > 0 && !is_alone;
    if (here > 0 && !is_alone)
        kt_note("%s:%u:%u: '%s' in place of it:\n%s", name, what->line, what->first, instead, faults.text);
}

static void break_one(const char *name, const char *text, size_t size, const scalar *what, const char *instead,
                      broken *sum) {
    kt_scene scene;
    const size_t length = strlen(instead);
    char *changed = malloc(size + length + 1);
    if (changed == NULL)
        return;
    memcpy(changed, text, what->begin);
    memcpy(changed + what->begin, instead, length);
    memcpy(changed + what->begin + length, text + what->end, size - what->end);
    changed[size - (what->end - what->begin) + length] = '\0';
    memset(&faults, 0, sizeof faults);
    if (kt_collect_parse(&faults, changed, &scene) == KT_OK)
        kt_scene_free(&scene);
    else
        judge(name, what, instead, sum);
    free(changed);
}

/* Keys at random, or each in every way. */
static void break_scene(const char *name, const char *text, size_t size, int times, kt_random *random, broken *sum) {
    static scalars all;
    const int values = (int)(sizeof wrong_values / sizeof *wrong_values),
              keys = (int)(sizeof wrong_keys / sizeof *wrong_keys);
    list_scalars(text, size, &all);
    for (int i = 0; i < times; i++) {
        const scalar *what = &all.at[kt_random_int(random, 0, all.count - 1)];
        break_one(name, text, size, what,
                  what->is_key ? wrong_keys[kt_random_int(random, 0, keys - 1)]
                               : wrong_values[kt_random_int(random, 0, values - 1)],
                  sum);
    }
    for (int i = 0; times == 0 && i < all.count; i++)
        for (int k = 0; k < (all.at[i].is_key ? keys : values); k++)
            break_one(name, text, size, &all.at[i], all.at[i].is_key ? wrong_keys[k] : wrong_values[k], sum);
}

KT_TEST(a_fault_of_a_bundled_scene_has_no_followers) {
    const char *given = getenv("KT_BROKEN");
    const int times = given != NULL ? atoi(given) : 40;
    kt_random random = kt_random_of_test();
    broken sum = {.count = 0};
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        size_t size;
        const char *text = kt_test_read(kt_bundled_path(kt_bundled(i)), &size);
        break_scene(kt_bundled(i), text, size, times, &random, &sum);
    }
    kt_note("%d broken scenes: %d with one fault, %d with faults elsewhere alone", sum.count, sum.alone, sum.silent);
    kt_check_true("scenes were broken", sum.alone > 1000);
    kt_check_equal_int("faults with followers", sum.followed, 0);
}

/* The name was quoted that was not there. */
KT_TEST(axis_of_zeros_of_a_body_without_name_and_type_is_a_fault) {
    kt_scene scene;
    const kt_status status =
        kt_collect_parse(&faults, "kinetree: 1\nbodies:\n  - {joint: {type: x, axis: [0, 0, 0]}}\n", &scene);
    kt_check_equal_int("status", status, KT_ERROR_SCENE);
    kt_check_contains("faults", faults.text, "3:29: body without a name: joint.axis is zero");
}
