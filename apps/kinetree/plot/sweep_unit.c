/* Units of the columns of a sweep. The table has no units. Those of results follow from the kinds of columns, and those
 * of values that vary from their places in the scene: a key of joints, loops, effects or shapes has the unit of the
 * descriptors, or two units if types differ: "rad or m". Parameters of a scene are numbers without a unit. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/kind.h"
#include "plot/plot.h"

#include "kinetree/descriptor.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { TYPES_MOST = 64 };

typedef struct unit_of_place {
    const char *ending, *unit;
} unit_of_place;

/* Places without a descriptor. */
static const unit_of_place places[] = {
    {"bodies.mass", "kg"},
    {"bodies.com", "m"},
    {"bodies.inertia", "kg m²"},
    {"bodies.joint.position", "rad|m"},
    {"bodies.joint.velocity", "rad/s|m/s"},
    {"gravity", "m/s²"},
    {"simulate.duration", "s"},
    {"simulate.step", "s"},
    {"simulate.first_step", "s"},
    {"output.interval", "s"},
};

static const kt_descriptor *joint_at(int i) { return kt_joint_descriptor((kt_joint_type)i); }
static const kt_descriptor *shape_at(int i) { return kt_shape_descriptor((kt_shape_type)i); }
static const kt_descriptor *loop_at(int i) { return kt_loop_descriptor((kt_loop_type)i); }
static const kt_descriptor *effect_at(int i) { return kt_effect_descriptor((kt_effect_type)i); }

/* Adds a unit to a list such as "rad|m", unless it is there. Returns false if there are more than two. */
static bool add_unit(char list[KT_SWEEP_UNIT_SIZE], const char *unit, size_t length) {
    const size_t used = strlen(list);
    for (const char *at = list; *at != '\0'; at += strcspn(at, "|") + (at[strcspn(at, "|")] == '|'))
        if (strcspn(at, "|") == length && strncmp(at, unit, length) == 0)
            return true;
    if (length == 0 || strchr(list, '|') != NULL || used + length + 2 > KT_SWEEP_UNIT_SIZE)
        return false;
    (void)snprintf(list + used, KT_SWEEP_UNIT_SIZE - used, "%s%.*s", used > 0 ? "|" : "", (int)length, unit);
    return true;
}

/* Writes the units of a key of all types that have it, at most two; NULL: none has it, a type has none, or there are
 * more. */
static const char *unit_of_key(const kt_descriptor *descriptor_at(int), const char *name,
                               char list[KT_SWEEP_UNIT_SIZE]) {
    list[0] = '\0';
    for (int i = 0; i < TYPES_MOST; i++) {
        const kt_key *key = kt_descriptor_key(descriptor_at(i), name);
        for (const char *at = key != NULL ? key->unit : NULL; at != NULL;) {
            const size_t length = strcspn(at, "|");
            if (!add_unit(list, at, length))
                return NULL;
            at = at[length] == '|' ? at + length + 1 : NULL;
        }
    }
    return list[0] != '\0' ? list : NULL;
}

/* Writes a place without the name of its item and without indices: bodies.mass for bodies.arm.mass, bodies.com for
 * bodies.arm.com[1]. */
static void strip_place(const char *name, char place[160]) {
    const char *first = strchr(name, '.'), *rest = first != NULL ? strchr(first + 1, '.') : NULL;
    const bool has_item = rest != NULL && (kt_column_begins(name, "bodies") || kt_column_begins(name, "loops") ||
                                           kt_column_begins(name, "effects"));
    (void)snprintf(place, 160, "%.*s%s", has_item ? (int)(first - name) : (int)strlen(name), name,
                   has_item ? rest : "");
    place[strcspn(place, "[")] = '\0';
    for (size_t end = strlen(place); end > 0 && isdigit((unsigned char)place[end - 1]) != 0; end--)
        if (end > 1 && place[end - 2] == '.')
            place[end - 2] = '\0';
}

static const char *unit_of_value(const char *name, char list[KT_SWEEP_UNIT_SIZE]) {
    char place[160];
    strip_place(name, place);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        if (strcmp(place, places[i].ending) == 0)
            return places[i].unit;
    const char *key = strchr(place, '.');
    if (key == NULL)
        return NULL;
    if (kt_column_begins(place, "bodies.joint"))
        return unit_of_key(joint_at, key + 1, list);
    if (kt_column_begins(place, "bodies.shape"))
        return unit_of_key(shape_at, key + 1, list);
    if (kt_column_begins(place, "loops"))
        return unit_of_key(loop_at, key + 1, list);
    return kt_column_begins(place, "effects") ? unit_of_key(effect_at, key + 1, list) : NULL;
}

/* The unit of a functional of a column; NULL: the name is none, or the unit is unknown. `integral`: whether it is the
 * integral over time. `length`: of the unit. */
static const char *unit_of_functional(const char *name, bool *integral, size_t *length) {
    static const char functionals[] = ".end|.min|.max|.mean|.rms|.integral";
    const char *point = strrchr(name, '.');
    char column[256];
    if (point == NULL || !kt_column_ends(name, functionals))
        return NULL;
    *integral = strcmp(point, ".integral") == 0;
    (void)snprintf(column, sizeof column, "%.*s", (int)(point - name), name);
    if (kt_column_has_own_unit(column)) {
        const char *unit = strstr(name, " [") + 2;
        *length = strcspn(unit, "]");
        return unit;
    }
    const char *unit = kt_column_kinds[kt_column_kind_of(column)].unit;
    *length = unit != NULL ? strlen(unit) : 0;
    return unit;
}

const char *kt_sweep_unit(const char *name, char unit[KT_SWEEP_UNIT_SIZE]) {
    char list[KT_SWEEP_UNIT_SIZE];
    bool integral = false;
    size_t length = 0;
    if (strcmp(name, "time") == 0)
        return "s";
    if (strcmp(name, "energy.error") == 0)
        return "J";
    const char *found = unit_of_functional(name, &integral, &length);
    if (found == NULL) {
        found = unit_of_value(name, list);
        length = found != NULL ? strlen(found) : 0;
    }
    if (found == NULL)
        return NULL;
    const char *bar = memchr(found, '|', length);
    const size_t first = bar != NULL ? (size_t)(bar - found) : length;
    const bool is_group = integral && strstr(found, " or ") != NULL;
    (void)snprintf(unit, KT_SWEEP_UNIT_SIZE, "%s%.*s%s%.*s%s%s", is_group ? "(" : "", (int)first, found,
                   bar != NULL ? " or " : "", bar != NULL ? (int)(length - first - 1) : 0, bar != NULL ? bar + 1 : "",
                   is_group ? ")" : "", integral ? " s" : "");
    return unit;
}
