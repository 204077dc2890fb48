/* Lookup tables, which formulas call by their names:
 *
 *     tables:
 *       lift: {rows: [[0, 0], [90 deg, 0.02], [360 deg, 0]], interpolation: cubic, outside: repeat}
 *       torque: {rows: engine.csv, x: speed, y: throttle, value: torque}
 *
 * Tables are read before formulas. A table that has faults becomes one of two rows of zeros, so that formulas that call
 * it have no further faults.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/decimal.h"
#include "document/number.h"
#include "expression/lookup.h"
#include "scene/csv.h"
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"

#include <stddef.h>
#include <string.h>

/* A table that is being read; the table is the first member, because the fields refer to it. */
typedef struct table_read {
    kt_lookup table;
    const char *column[3]; /* names of columns; NULL: not given */
    kt_node *file;         /* NULL: the rows are in the scene */
} table_read;

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* A text that is no number is the name of a file. */
static bool is_file_name(const kt_node *node) {
    double value;
    return node->kind == KT_NODE_TEXT && node->count > 0 &&
           (!node->plain || kt_scalar_classify(node->of.text, &value) == KT_SCALAR_TEXT);
}

/* Inputs and values are of any unit. An angle may be written as such. */
static bool read_table_rows(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    static const kt_quantity quantities[] = {KT_QUANTITY_ANGLE, KT_QUANTITY_ANGLE, KT_QUANTITY_ANGLE};
    table_read *t = object;
    (void)field;
    if (is_file_name(node)) {
        t->file = node; /* read with the other keys */
        return true;
    }
    const kt_node *first = node->kind == KT_NODE_LIST ? node->of.first : NULL;
    t->table.inputs = first != NULL && first->kind == KT_NODE_LIST && first->count == 3 ? 2 : 1;
    return kt_read_points(r, scope, node, t->table.inputs + 1, quantities,
                          "rows [[x, z], ...] or [[x, y, z], ...], or the name of a CSV file", &t->table.rows,
                          &t->table.row_count);
}

static void write_table_rows(kt_emitter *e, const kt_member *m) {
    const kt_lookup *table = m->object;
    kt_write_points(e, table->rows, table->inputs + 1, table->row_count);
}

/* ---- one table --------------------------------------------------------------------------------------------------- */

static const char *const interpolation_names[] = {"linear", "cubic", "monotone"};
static const kt_choice interpolations = {"tables.interpolation", interpolation_names, 3, 0, NULL};
static const char *const outside_names[] = {"reject", "hold", "extend", "repeat"};
static const kt_choice outsides = {"tables.outside", outside_names, 4, 0, NULL};
static const kt_kind kind_rows = {.read = read_table_rows, .write = write_table_rows};

#define COLUMN(k) (offsetof(table_read, column) + (k) * sizeof(const char *))
static const kt_field table_fields[] = {
    {.key = "rows", .kind = &kind_rows, .flags = KT_FIELD_REQUIRED},
    {.key = "interpolation",
     .kind = &kt_kind_choice,
     .offset = offsetof(kt_lookup, interpolation),
     .detail = &interpolations},
    {.key = "outside", .kind = &kt_kind_choice, .offset = offsetof(kt_lookup, outside), .detail = &outsides},
    {.key = "x", .kind = &kt_kind_text, .offset = COLUMN(0)},
    {.key = "y", .kind = &kt_kind_text, .offset = COLUMN(1)},
    {.key = "value", .kind = &kt_kind_text, .offset = COLUMN(2)},
};
static const kt_table table_of_keys = {.fields = table_fields, .count = KT_COUNT_OF(table_fields), .flow = true};

/* Rows alone, or a mapping. */
static bool read_table_form(kt_reader *r, const kt_scope *scope, kt_node *node, table_read *t) {
    static const char *const keys[] = {"x", "y", "value"};
    if (node->kind != KT_NODE_MAP) {
        if (!read_table_rows(r, scope, node, NULL, t))
            return false;
    } else if (!kt_table_read(r, scope, node, &table_of_keys, t)) {
        return false;
    }
    for (int k = 0; t->file == NULL && k < 3; k++)
        if (t->column[k] != NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, keys[k]),
                               "'%s' is the column of a file; write {rows: FILE.csv}, or remove the key", keys[k]);
    return t->file == NULL ||
           kt_read_csv_lookup(r, scope, t->file, t->column, &t->table.inputs, &t->table.rows, &t->table.row_count);
}

/* Letters, digits and _; none of the names that formulas have already. */
static bool check_table_name(kt_reader *r, const kt_scope *scope, kt_node *key) {
    const bool is_text = key->kind == KT_NODE_TEXT;
    if (!is_text || !kt_name_is_valid(key->of.text) || strchr(key->of.text, '-') != NULL)
        return kt_fault_expected(r, scope, key, "the name of a table: letters, digits and _, the first one no digit");
    if (kt_is_reserved(key->of.text) || strcmp(key->of.text, "length") == 0 || strcmp(key->of.text, "speed") == 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                           "'%.40s' has a meaning of its own in formulas; take another name", key->of.text);
    if (kt_is_named(r, key->of.text) || kt_is_parameter(r, key->of.text))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                           "'%.40s' is a parameter or one of `expressions`; take another name for the table",
                           key->of.text);
    return true;
}

static void read_table(kt_reader *r, const kt_scope *scope, kt_node *key, kt_lookup *out) {
    static const double nothing[] = {0.0, 0.0, 1.0, 0.0};
    const kt_scope here = {.outer = scope, .key = key->kind == KT_NODE_TEXT ? key->of.text : ""};
    table_read t = {.table = {.inputs = 1}};
    char fault[KT_MESSAGE_SIZE];
    bool good = check_table_name(r, scope, key) && read_table_form(r, &here, key->next, &t);
    if (good && !kt_lookup_check(&t.table, fault, sizeof fault))
        good = kt_fault_at(r, KT_ERROR_SCENE, &here, key->next, "%s", fault);
    if (!good)
        t.table = (kt_lookup){
            .inputs = t.table.inputs == 2 ? 2 : 1, .rows = nothing, .row_count = 2, .outside = KT_OUTSIDE_HOLD};
    *out = t.table;
    out->name = key->kind == KT_NODE_TEXT ? kt_reader_text(r, &r->keep, key->of.text, key->count) : "";
}

/* ---- the section ------------------------------------------------------------------------------------------------- */

/* Tables are compared with each other by their names. */
enum { TABLE_COUNT_MAX = 1000 };

void kt_tables_read(kt_reader *r, kt_description *description) {
    const kt_scope scope = {.key = "tables"};
    kt_node *map = kt_node_find(r->root, "tables");
    if (map == NULL)
        return;
    if (map->kind != KT_NODE_MAP) {
        (void)kt_fault_expected(r, &scope, map, "a mapping of names to tables (lift: lift.csv)");
        return;
    }
    if (map->count > TABLE_COUNT_MAX) {
        (void)kt_fault_at(r, KT_ERROR_SCENE, &scope, map, "there are %u tables; a scene has at most %d",
                          (unsigned)map->count, (int)TABLE_COUNT_MAX);
        return;
    }
    kt_lookup *tables = kt_reader_take(r, &r->keep, (size_t)map->count + 1, sizeof *tables);
    int count = 0;
    r->scene->table_keys = kt_reader_take(r, &r->scratch, (size_t)map->count + 1, sizeof *r->scene->table_keys);
    r->scene->table_is_used = kt_reader_take(r, &r->scratch, (size_t)map->count + 1, sizeof *r->scene->table_is_used);
    for (kt_node *key = map->of.first; !r->out_of_memory && key != NULL; key = key->next->next) {
        r->scene->table_keys[count] = key;
        for (int i = 0; i < count; i++)
            if (key->kind == KT_NODE_TEXT && strcmp(tables[i].name, key->of.text) == 0)
                (void)kt_fault_at(r, KT_ERROR_SCENE, &scope, key, "there is a table '%.40s' already; rename one",
                                  key->of.text);
        read_table(r, &scope, key, &tables[count++]);
    }
    description->tables = tables;
    description->table_count = r->out_of_memory ? 0 : count;
}

/* Nothing is left to read: kt_tables_read has read the section. */
static bool skip_tables(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)r, (void)scope, (void)node, (void)field, (void)object;
    return true;
}

static bool has_no_tables(const kt_member *m) { return ((const kt_scene *)m->object)->description.table_count == 0; }

static void write_tables(kt_emitter *e, const kt_member *m) {
    const kt_description *description = &((const kt_scene *)m->object)->description;
    static const table_read standard = {.table = {.inputs = 1}};
    kt_emit_map(e, KT_EMIT_BLOCK);
    for (int k = 0; k < description->table_count; k++) {
        const table_read t = {.table = description->tables[k]};
        kt_emit_key(e, t.table.name);
        kt_table_write(e, &table_of_keys, &t, &standard);
    }
    kt_emit_end(e);
}

const kt_kind kt_kind_tables = {.read = skip_tables, .write = write_tables, .same = has_no_tables};
