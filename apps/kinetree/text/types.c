/* Prints 'kinetree help TYPE' and the page of all types. Both are generated from the descriptors by which scenes are
 * read. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/reference.h"

#include "kinetree/descriptor.h"
#include "kinetree/loop.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

/* ---- families ---------------------------------------------------------------------------------------------------- */

/* An item of any family. */
typedef union item {
    kt_joint joint;
    kt_loop loop;
    kt_effect effect;
    kt_function function;
    kt_shape shape;
    kt_surface surface;
    kt_track track;
} item;

typedef struct family {
    const char *noun, *title; /* "joint", "Joints" */
    const char *about;        /* lines of Markdown */
    const kt_descriptor *(*describe)(int type);
    item (*standard)(void); /* an item with its defaults */
    int first, count;
    bool drawn; /* include/pages/draw.py has a picture of each */
} family;

#define FAMILY(noun, default_value)                                                                                    \
    static const kt_descriptor *noun(int type) { return kt_##noun##_descriptor((kt_##noun##_type)type); }              \
    static item noun##_standard(void) { return (item){.noun = default_value}; }
FAMILY(joint, kt_joint_default())
FAMILY(loop, kt_loop_default())
FAMILY(effect, kt_effect_default())
FAMILY(function, kt_function_constant(0.0))
FAMILY(shape, kt_shape_default())
FAMILY(surface, (kt_surface){.type = KT_SURFACE_NONE})
FAMILY(track, (kt_track){.type = KT_TRACK_NONE})

static const family families[] = {
    {"joint", "Joints",
     "A joint defines how a body moves on its parent. R and p are rotation and position of the body frame in the joint "
     "frame;\nq are the positions. A position or velocity in the file is given, even if it is zero. When the loops are "
     "closed, a given\nvalue changes only if the loops cannot be closed otherwise.\n",
     joint, joint_standard, 0, KT_JOINT_TYPE_COUNT, true},
    {"loop", "Loops",
     "Loops are constraints that the tree of joints cannot represent. Every loop has a `name`. An end is "
     "`BODY.MARKER`,\n`BODY` (its origin), `world`, or `{body: B, at: [x, y, z], rotation: R}`. With `marker` instead "
     "of `at`, the rotation R\nis relative to the axes of the marker.\n",
     loop, loop_standard, 0, KT_LOOP_TYPE_COUNT, true},
    {"effect", "Effects",
     "Effects act on bodies and joints in addition to gravity. An effect may have a `name`. The joint of an effect has "
     "one\ncoordinate q: an angle, or a length; v is its rate. If there are two units, the first is for an angle.\n",
     effect, effect_standard, 0, KT_EFFECT_TYPE_COUNT, true},
    {"function", "Functions of time",
     "Some keys take a function of time y(t). In the tables, y is the unit of the key.\n", function, function_standard,
     KT_FUNCTION_NONE + 1, KT_FUNCTION_EXPRESSION + 1, false},
    {"shape", "Shapes",
     "Pictures show the shape of a body. A body of mass m without `com` or `inertia` I takes them from its shape.\n",
     shape, shape_standard, KT_SHAPE_NONE + 1, KT_SHAPE_TYPE_COUNT, false},
    {"surface", "Surfaces",
     "A loop `surface` keeps a point on a surface: `surface: {NAME: {KEYS}}`. x, y, z are the coordinates of the point "
     "in the\nframe of the first end of the loop, with z along its `axis`.\n",
     surface, surface_standard, KT_SURFACE_NONE + 1, KT_SURFACE_TYPE_COUNT, false},
    {"curve", "Curves",
     "A loop `curve` keeps a point on a curve: `curve: {NAME: {KEYS}}`. c is a point of the curve in the frame of the "
     "first\nend of the loop, with z along its `axis`; sigma is its arc length.\n",
     track, track_standard, KT_TRACK_NONE + 1, KT_TRACK_TYPE_COUNT, false},
};

enum { FAMILY_COUNT = sizeof families / sizeof *families };

/* ---- description of keys ----------------------------------------------------------------------------------------- */

typedef struct phrase {
    char text[128];
} phrase;

static const char *key_name_of(const kt_key *key) {
    const char *point = strchr(key->name, '.');
    return point != NULL ? point + 1 : key->name;
}

static bool is_angle(kt_coordinate_kind kind) { return kind == KT_COORDINATE_ANGLE || kind == KT_COORDINATE_TURNS; }

/* Unit of the coordinates of a joint: "rad", "[m, m, rad]". The elements of a quaternion have none. */
static phrase unit_of_coordinates(int type, bool of_rate) {
    phrase unit = {""};
    const int count = kt_joint_coordinate_kind((kt_joint_type)type, 1) != KT_COORDINATE_NONE ? KT_JOINT_NQ_MAX : 1;
    size_t used = 0;
    for (int k = 0; k < count; k++) {
        const kt_coordinate_kind kind = kt_joint_coordinate_kind((kt_joint_type)type, k);
        if (kind == KT_COORDINATE_ROTATION) {
            static const phrase alone[2] = {{""}, {"rad/s"}}, behind[2] = {{"m"}, {"m/s, rad/s"}};
            return k == 0 ? alone[of_rate] : behind[of_rate];
        }
        if (kind != KT_COORDINATE_NONE)
            used += (size_t)snprintf(unit.text + used, sizeof unit.text - used, "%s%s%s",
                                     k > 0       ? ", "
                                     : count > 1 ? "["
                                                 : "",
                                     is_angle(kind) ? "rad" : "m", of_rate ? "/s" : "");
    }
    if (count > 1)
        snprintf(unit.text + used, sizeof unit.text - used, "]");
    return unit;
}

static phrase key_unit_of(int type, const kt_key *key) {
    phrase unit;
    if (key->kind == KT_KEY_POSITION || key->kind == KT_KEY_VELOCITY)
        return unit_of_coordinates(type, key->kind == KT_KEY_VELOCITY);
    const char *second = strchr(key->unit, '|');
    if (second == NULL)
        snprintf(unit.text, sizeof unit.text, "%s", key->unit);
    else
        snprintf(unit.text, sizeof unit.text, "%.*s or %s", (int)(second - key->unit), key->unit, second + 1);
    return unit;
}

static phrase vector_phrase(kt_vec3 v, bool is_axis) {
    phrase shown;
    if (is_axis && v.x == 0.0 && v.y == 0.0 && v.z == 1.0)
        return (phrase){"z"};
    snprintf(shown.text, sizeof shown.text, "[%g, %g, %g]", v.x, v.y, v.z);
    return shown;
}

static phrase default_of(const family *f, const kt_key *key) {
    const item standard = f->standard();
    const char *member = (const char *)&standard + key->offset;
    phrase shown = {""};
    if (key->needed || key->standard != NULL) {
        snprintf(shown.text, sizeof shown.text, "%s", key->needed ? "needed" : key->standard);
        return shown;
    }
    switch (key->kind) {
    case KT_KEY_NUMBER:
        snprintf(shown.text, sizeof shown.text, "%g", *(const double *)(const void *)member);
        return shown;
    case KT_KEY_VECTOR:
    case KT_KEY_AXIS:
        return vector_phrase(*(const kt_vec3 *)(const void *)member, key->kind == KT_KEY_AXIS);
    case KT_KEY_FLAG:
        snprintf(shown.text, sizeof shown.text, "%s", *(const bool *)(const void *)member ? "true" : "false");
        return shown;
    case KT_KEY_ROTATION:
        return (phrase){"none"};
    case KT_KEY_POSITION:
    case KT_KEY_VELOCITY:
    case KT_KEY_ARMATURE:
        return (phrase){"0"};
    default: /* the default is described in words, or the key is required */
        return shown;
    }
}

/* ---- a type ------------------------------------------------------------------------------------------------------ */

/* Describes "5 equations", "1 degree of freedom". */
static phrase type_size_of(const family *f, int type) {
    phrase shown = {""};
    if (f->describe == joint) {
#define JOINT_NV(id, name, nq, nv) nv,
        static const int nv[] = {KT_JOINT_LIST(JOINT_NV)};
        snprintf(shown.text, sizeof shown.text, "%d degree%s of freedom", nv[type], nv[type] == 1 ? "" : "s");
    }
    if (f->describe == loop) {
        kt_loop most = kt_loop_default(), least = most;
        most.type = least.type = (kt_loop_type)type;
        least.holonomic = false;
        const int n = kt_loop_equation_count(&most), m = kt_loop_equation_count(&least);
        if (m < n)
            snprintf(shown.text, sizeof shown.text, "%d or %d equations", m, n);
        else
            snprintf(shown.text, sizeof shown.text, "%d equation%s", n, n == 1 ? "" : "s");
    }
    return shown;
}

/* Prints each line of a text after the prefix `before`. */
static void print_prefixed_lines(const char *before, const char *text) {
    while (*text != '\0') {
        const size_t length = strcspn(text, "\n");
        printf("%s%.*s\n", before, (int)length, text);
        text += length + (text[length] == '\n');
    }
}

static void print_scene(const char *before, const char *name, const char *example) {
    printf("%skinetree: 1\n", before);
    if (name != NULL)
        printf("%s# %s.yaml\n", before, name);
    printf("%sgravity: [0, 0, -9.81]\n", before);
    print_prefixed_lines(before, example);
    printf("%ssimulate: {duration: 1}\n", before);
}

/* "torque or force", "N m or N" */
static phrase both_of(const char *(*word)(kt_effect_quantity, bool), kt_effect_quantity quantity) {
    const char *turning = word(quantity, false), *sliding = word(quantity, true);
    phrase both;
    if (strcmp(turning, sliding) == 0)
        snprintf(both.text, sizeof both.text, "%s", turning);
    else
        snprintf(both.text, sizeof both.text, "%s or %s", turning, sliding);
    return both;
}

static void print_type(const family *f, int type) {
    const kt_descriptor *d = f->describe(type);
    const phrase size = type_size_of(f, type);
    printf("%s %s: %s%s%s%s\n\n", f->noun, d->name, d->help, size.text[0] ? " (" : "", size.text,
           size.text[0] ? ")" : "");
    print_prefixed_lines("  ", d->formula);
    printf("\nKeys\n");
    for (int i = 0; i < d->key_count; i++) {
        const kt_key *key = &d->keys[i];
        const phrase unit = key_unit_of(type, key), standard = default_of(f, key);
        printf("  %-13s %s%s%s (%s%s)\n", key_name_of(key), key->help, unit.text[0] ? ", " : "", unit.text,
               key->needed ? "" : "default: ", standard.text);
        if (key->also != NULL)
            printf("  %-13s may be written '%s'\n", "", key->also);
    }
    for (int i = 0; i < d->quantity_count; i++) {
        const phrase name = both_of(kt_quantity_name, d->quantities[i]);
        const phrase unit = both_of(kt_quantity_unit, d->quantities[i]);
        printf("%s  %-16s %s, %s\n", i == 0 ? "\nRecorded by --record effect\n" : "", name.text,
               kt_quantity_help(d->quantities[i]), unit.text);
    }
    printf("\nExample\n");
    print_scene("  ", NULL, d->example);
}

bool kt_types_print(const char *name) {
    bool found = false;
    for (int i = 0; i < FAMILY_COUNT; i++)
        for (int type = families[i].first; type < families[i].count; type++)
            if (strcmp(families[i].describe(type)->name, name) == 0) {
                fputs(found ? "\n" : "", stdout);
                print_type(&families[i], type);
                found = true;
            }
    return found;
}

void kt_types_try(kt_nearest *nearest) {
    for (int i = 0; i < FAMILY_COUNT; i++)
        for (int type = families[i].first; type < families[i].count; type++)
            (void)kt_nearest_try(nearest, families[i].describe(type)->name);
}

/* ---- the page ---------------------------------------------------------------------------------------------------- */

static void print_type_section(const family *f, int type) {
    const kt_descriptor *d = f->describe(type);
    const phrase size = type_size_of(f, type);
    char scene[96];
    printf("### %s: %s\n\n%c%s", f->noun, d->name, toupper((unsigned char)d->help[0]), d->help + 1);
    printf(".%s%s%s\n\n", size.text[0] ? " " : "", size.text, size.text[0] ? "." : "");
    if (f->drawn)
        printf("![%s %s](pictures/%s-%s.svg)\n\n", f->noun, d->name, f->noun, d->name);
    print_prefixed_lines("    ", d->formula);
    printf("\n");
    if (d->key_count > 0)
        printf("| key | meaning | unit | default |\n|---|---|---|---|\n");
    for (int i = 0; i < d->key_count; i++) {
        const kt_key *key = &d->keys[i];
        const phrase unit = key_unit_of(type, key), standard = default_of(f, key);
        printf("| `%s`%s%s%s | %s | %s | %s |\n", key_name_of(key), key->also ? ", `" : "", key->also ? key->also : "",
               key->also ? "`" : "", key->help, unit.text, standard.text);
    }
    for (int i = 0; i < d->quantity_count; i++) {
        const phrase name = both_of(kt_quantity_name, d->quantities[i]);
        const phrase unit = both_of(kt_quantity_unit, d->quantities[i]);
        printf("%s| `%s` | %s | %s |\n", i == 0 ? "\n| recorded | meaning | unit |\n|---|---|---|\n" : "", name.text,
               kt_quantity_help(d->quantities[i]), unit.text);
    }
    snprintf(scene, sizeof scene, "%s-%s", f->noun, d->name);
    printf("\n```yaml\n");
    print_scene("", scene, d->example);
    printf("```\n\n");
}

void kt_types_print_page(void) {
    printf("# Joints, loops, effects, functions and shapes\n\n"
           "This page lists every type that a scene can have, with its keys, its formula and a scene that runs.\n"
           "`kinetree help --types` makes the page. The command takes all of it from the descriptors (`descriptor.h`), "
           "which "
           "also define\n"
           "how scenes are read, checked and written. `kinetree help NAME` shows one type.\n"
           "[Scene files](scene-files.md) explains how to compose a scene.\n\n");
    for (int i = 0; i < FAMILY_COUNT; i++) {
        const family *f = &families[i];
        printf("## %s\n\n%s\n| %s | meaning |%s\n|---|---|%s\n", f->title, f->about, f->noun,
               type_size_of(f, f->first).text[0] ? " |" : "", type_size_of(f, f->first).text[0] ? "---|" : "");
        for (int type = f->first; type < f->count; type++) {
            const phrase size = type_size_of(f, type);
            printf("| `%s` | %s |%s%s%s\n", f->describe(type)->name, f->describe(type)->help, size.text[0] ? " " : "",
                   size.text, size.text[0] ? " |" : "");
        }
        printf("\n");
        for (int type = f->first; type < f->count; type++)
            print_type_section(f, type);
    }
}
