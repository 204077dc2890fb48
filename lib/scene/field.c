/* Mappings by table: one list of keys reads, writes, compares and suggests. */
#include "scene/number.h"
#include "scene/reader.h"
#include "scene/support.h"

#include <string.h>

/* ---- words ------------------------------------------------------------------------------------------------------- */

/* "a, b or c", without what is refused. */
static void add_choices(const kt_reader *r, kt_phrase *phrase, const kt_choice *choice) {
    int left = 0;
    for (int i = choice->first; i < choice->count; i++)
        left += !kt_support_is_refused(r->refused, choice->where, choice->names[i]);
    for (int i = choice->first; i < choice->count; i++)
        if (!kt_support_is_refused(r->refused, choice->where, choice->names[i]))
            kt_phrase_add(phrase, "%s%s", choice->names[i], --left > 1 ? ", " : left == 1 ? " or " : "");
}

static void report_choice(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_choice *choice) {
    const char *word = node->of.text;
    kt_phrase phrase = {.length = 0};
    if (kt_support_is_refused(r->refused, choice->where, word)) {
        kt_phrase_add(&phrase, "'%s' is not supported yet; choose ", word);
        add_choices(r, &phrase, choice);
        kt_fault_at(r, KT_ERROR_UNSUPPORTED, scope, node, "%s", phrase.text);
        return;
    }
    kt_nearest nearest = kt_nearest_make(word, &r->effort);
    bool more = true;
    for (int i = choice->first; more && i < choice->count; i++)
        more = kt_nearest_try(&nearest, choice->names[i]);
    const char *name;
    for (size_t i = 0; more && (name = kt_support_refused_name(r->refused, choice->where, i)) != NULL; i++)
        more = kt_nearest_try(&nearest, name);
    kt_phrase_add(&phrase, "%s is unknown; ", kt_name_quote(word).text);
    if (nearest.best != NULL)
        kt_phrase_add(&phrase, "did you mean '%s'? Choose ", nearest.best);
    else
        kt_phrase_add(&phrase, "choose ");
    add_choices(r, &phrase, choice);
    kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", phrase.text);
}

int kt_choice_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_choice *choice) {
    if (node->kind != KT_NODE_TEXT || node->count == 0) {
        kt_phrase expected = {.length = 0};
        add_choices(r, &expected, choice);
        kt_fault_expected(r, scope, node, expected.text);
        return -1;
    }
    if (!kt_support_is_refused(r->refused, choice->where, node->of.text))
        for (int i = choice->first; i < choice->count; i++)
            if (strcmp(node->of.text, choice->names[i]) == 0)
                return i;
    report_choice(r, scope, node, choice);
    return -1;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* One reading of a mapping. */
typedef struct kt_reading {
    kt_reader *r;
    const kt_scope *scope;
    const kt_table *table;
    void *object;
    kt_node *values[KT_TABLE_COUNT_MAX]; /* of the fields; NULL: not there */
    uint32_t lines[KT_TABLE_COUNT_MAX];
    bool misspelt[KT_TABLE_COUNT_MAX]; /* an unknown key was probably meant for it */
    unsigned type;                     /* its bit; ~0: no types, or the type could not be read */
    bool type_is_known;
} kt_reading;

static bool applies(const kt_field *field, unsigned type) { return field->types == 0 || (field->types & type) != 0; }

/* The field of this key, rather one that the type has; -1: none. */
static int find_field(const kt_table *table, const char *key, unsigned type) {
    int found = -1;
    for (int i = 0; i < table->count; i++)
        if (strcmp(table->fields[i].key, key) == 0 && (found < 0 || applies(&table->fields[i], type)))
            found = i;
    return found;
}

static void report_unknown(kt_reading *reading, kt_node *key) {
    kt_reader *r = reading->r;
    const kt_table *table = reading->table;
    const char *word = key->of.text;
    if (kt_support_is_refused(r->refused, table->where, word)) {
        kt_fault_at(r, KT_ERROR_UNSUPPORTED, reading->scope, key, "'%s' is not supported yet; remove it", word);
        return;
    }
    kt_nearest nearest = kt_nearest_make(word, &r->effort);
    bool more = true;
    for (int i = 0; more && i < table->count; i++)
        if (applies(&table->fields[i], reading->type))
            more = kt_nearest_try(&nearest, table->fields[i].key);
    kt_phrase mend = {.length = 0};
    if (nearest.best != NULL) {
        kt_phrase_add(&mend, "did you mean '%s'?", nearest.best);
        reading->misspelt[find_field(table, nearest.best, reading->type)] = true;
    } else {
        kt_phrase_add(&mend, "it can be");
        for (int i = 0, n = 0; i < table->count; i++)
            if (find_field(table, table->fields[i].key, reading->type) == i && /* once, whatever types share it */
                applies(&table->fields[i], reading->type) &&
                !kt_support_is_refused(r->refused, table->where, table->fields[i].key))
                kt_phrase_add(&mend, "%s %s", n++ > 0 ? "," : "", table->fields[i].key);
    }
    kt_fault_at(r, KT_ERROR_SCENE, reading->scope, key, "unknown key %s; %s", kt_name_quote(word).text, mend.text);
}

/* A key that other types have. */
static void report_misplaced(const kt_reading *reading, const kt_field *field, kt_node *key) {
    const kt_table *table = reading->table;
    kt_phrase owners = {.length = 0};
    unsigned having = 0;
    for (int i = 0; i < table->count; i++)
        if (strcmp(table->fields[i].key, field->key) == 0)
            having |= table->fields[i].types;
    int left = 0;
    for (int i = table->types->first; i < table->types->count; i++)
        left += (having >> i & 1U) != 0;
    int type = 0;
    for (int i = table->types->first; i < table->types->count; i++) {
        if ((having >> i & 1U) != 0)
            kt_phrase_add(&owners, "%s%s", table->types->names[i], --left > 1 ? ", " : left == 1 ? " and " : "");
        if ((reading->type >> i & 1U) != 0)
            type = i;
    }
    kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "type %s has no key '%s'; it belongs to %s",
                table->types->names[type], field->key, owners.text);
}

static void sort_key(kt_reading *reading, kt_node *key) {
    if (key->faulty)
        return;
    if (key->kind != KT_NODE_TEXT) {
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "a key must be a word, found a %s",
                    key->kind == KT_NODE_LIST ? "list" : "mapping");
        return;
    }
    if (strcmp(key->of.text, "<<") == 0 && key->next->faulty) /* a merge key: its alias has been told */
        return;
    int found = find_field(reading->table, key->of.text, reading->type);
    const kt_field *field = found < 0 ? NULL : &reading->table->fields[found];
    if (field == NULL || kt_support_is_refused(reading->r->refused, reading->table->where, field->key))
        report_unknown(reading, key);
    else if (!applies(field, reading->type))
        report_misplaced(reading, field, key);
    else if (reading->values[found] != NULL)
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key,
                    "the key '%s' is there already, in line %u; remove one of them", field->key,
                    (unsigned)reading->lines[found]);
    else {
        reading->values[found] = key->next;
        reading->lines[found] = key->line;
    }
}

static bool read_field(const kt_reading *reading, int i) {
    const kt_field *field = &reading->table->fields[i];
    const kt_scope scope = {.outer = reading->scope, .key = field->key};
    kt_node *value = reading->values[i];
    return !value->faulty && field->kind->read(reading->r, &scope, value, field, reading->object);
}

/* One that an unknown key was probably meant for is not told again. */
static void report_missing(const kt_reading *reading, kt_node *map) {
    const kt_table *table = reading->table;
    kt_phrase missing = {.length = 0}, mend = {.length = 0};
    int count = 0;
    for (int i = 0; i < table->count; i++) {
        const kt_field *field = &table->fields[i];
        bool wanted = field->types == 0 || (reading->type_is_known && applies(field, reading->type));
        if (wanted && (field->flags & KT_FIELD_REQUIRED) != 0 && reading->values[i] == NULL && !reading->misspelt[i])
            kt_phrase_add(&missing, "%s'%s'", count++ > 0 ? ", " : "", field->key);
    }
    if (count == 0)
        return;
    if (table->types != NULL && kt_node_find(map, "type") == NULL) {
        kt_phrase_add(&mend, "its type is ");
        add_choices(reading->r, &mend, table->types);
    } else {
        kt_phrase_add(&mend, "add %s", count > 1 ? "them" : "it");
    }
    kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, map, "the key%s %s %s missing; %s", count > 1 ? "s" : "",
                missing.text, count > 1 ? "are" : "is", mend.text);
}

static bool is_type(const kt_table *table, const kt_field *field) {
    return table->types != NULL && field->detail == table->types;
}

/* The bit of the type that an object has; all bits where there are no types. */
static unsigned type_of(const kt_table *table, const void *object) {
    for (int i = 0; i < table->count; i++) {
        int type;
        if (!is_type(table, &table->fields[i]))
            continue;
        memcpy(&type, kt_field_of(object, &table->fields[i]), sizeof type);
        return type >= 0 && type < table->types->count ? 1U << type : 0U;
    }
    return ~0U;
}

/* The type decides what the other keys mean, wherever it stands. */
static void read_type(kt_reading *reading, const kt_node *map) {
    const kt_table *table = reading->table;
    reading->type = ~0U;
    reading->type_is_known = table->types == NULL;
    for (int i = 0; i < table->count; i++) {
        if (!is_type(table, &table->fields[i]))
            continue;
        reading->values[i] = kt_node_find(map, table->fields[i].key);
        reading->type_is_known = reading->values[i] != NULL && read_field(reading, i);
        reading->values[i] = NULL;
    }
    if (reading->type_is_known)
        reading->type = type_of(table, reading->object);
}

bool kt_table_read(kt_reader *r, const kt_scope *scope, kt_node *map, const kt_table *table, void *object) {
    if (map->kind == KT_NODE_TEXT && map->count > 0 && table->types != NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, map, "expected a mapping, found %s; write {type: ...}",
                           kt_name_quote(map->of.text).text);
    if (map->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, map, table->example == NULL ? "a mapping (key: value)" : table->example);
    kt_reading reading = {.r = r, .scope = scope, .table = table, .object = object};
    read_type(&reading, map);
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next)
        sort_key(&reading, key);
    report_missing(&reading, map);
    for (int i = 0; i < table->count && !r->out_of_memory; i++) {
        const kt_field *field = &table->fields[i];
        bool readable = reading.type_is_known || field->types == 0;
        if (reading.values[i] != NULL && readable && !is_type(table, field))
            (void)read_field(&reading, i);
    }
    return true;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

bool kt_field_same(const kt_field *field, const void *object, const void *standard) {
    if (field->same != NULL)
        return field->same(field, object, standard);
    return field->kind->same != NULL && field->kind->same(field, object, standard);
}

static bool is_written(const kt_field *field, unsigned type, const void *object, const void *standard) {
    if (!applies(field, type) || (field->flags & KT_FIELD_READ_ONLY) != 0)
        return false;
    return (field->flags & KT_FIELD_REQUIRED) != 0 || !kt_field_same(field, object, standard);
}

bool kt_table_same(const kt_table *table, const void *object, const void *standard) {
    unsigned type = type_of(table, object);
    for (int i = 0; i < table->count; i++)
        if (is_written(&table->fields[i], type, object, standard))
            return false;
    return true;
}

void kt_table_write(kt_emitter *e, const kt_table *table, const void *object, const void *standard) {
    unsigned type = type_of(table, object);
    kt_emit_map(e, table->flow);
    for (int i = 0; i < table->count; i++) {
        const kt_field *field = &table->fields[i];
        if (!is_written(field, type, object, standard))
            continue;
        if (kt_support_is_refused(e->refused, table->where, field->key))
            kt_emit_refuse(e, KT_ERROR_UNSUPPORTED, "'%s' is not supported yet", field->key);
        if ((field->flags & KT_FIELD_SECTION) != 0)
            kt_emit_section(e, field->key);
        else
            kt_emit_key(e, field->key);
        field->kind->write(e, field, object, standard);
    }
    kt_emit_end(e);
}
