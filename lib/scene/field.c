/* Mappings by tables: one list of keys serves reading, writing, comparing and suggesting. If a mapping has types, its
 * keys are those of the table and those of the type's descriptor. */
#include "scene/number.h"
#include "scene/reader.h"

#include <string.h>

kt_scope kt_item_scope(const char *noun, const char *list, int index, const kt_node *node) {
    const kt_node *name = kt_node_find(node, "name");
    bool is_named = name != NULL && name->kind == KT_NODE_TEXT && name->count > 0;
    return (kt_scope){.noun = noun, .list = list, .index = index, .name = is_named ? name->of.text : NULL};
}

/* ---- words ------------------------------------------------------------------------------------------------------- */

/* "a, b or c" */
static void add_choices(kt_phrase *phrase, const kt_choice *choice) {
    for (int i = choice->first; i < choice->count; i++)
        kt_phrase_add(phrase, "%s%s", choice->names[i],
                      i + 2 < choice->count   ? ", "
                      : i + 1 < choice->count ? " or "
                                              : "");
}

static void report_choice(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_choice *choice) {
    const char *word = node->of.text;
    kt_phrase phrase = {.length = 0};
    kt_nearest nearest = kt_nearest_make(word, &r->effort);
    for (int i = choice->first; i < choice->count; i++)
        if (!kt_nearest_try(&nearest, choice->names[i]))
            break;
    kt_phrase_add(&phrase, "%s is unknown; ", kt_name_quote(word).text);
    if (nearest.best != NULL)
        kt_phrase_add(&phrase, "did you mean '%s'? Choose ", nearest.best);
    else
        kt_phrase_add(&phrase, "choose ");
    add_choices(&phrase, choice);
    kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", phrase.text);
}

int kt_choice_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_choice *choice) {
    if (node->kind != KT_NODE_TEXT || node->count == 0) {
        kt_phrase expected = {.length = 0};
        add_choices(&expected, choice);
        kt_fault_expected(r, scope, node, expected.text);
        return -1;
    }
    for (int i = choice->first; i < choice->count; i++)
        if (strcmp(node->of.text, choice->names[i]) == 0)
            return i;
    report_choice(r, scope, node, choice);
    return -1;
}

/* ---- the fields of a mapping ------------------------------------------------------------------------------------- */

/* The fields of the table, and those of a type. */
typedef struct kt_fields {
    kt_field field[KT_TABLE_COUNT_MAX];
    int count;
} kt_fields;

static int find_field(const kt_fields *fields, const char *key) {
    for (int i = 0; i < fields->count; i++)
        if (strcmp(fields->field[i].key, key) == 0 ||
            (fields->field[i].also != NULL && strcmp(fields->field[i].also, key) == 0))
            return i;
    return -1;
}

/* The name of a key within its mapping: of "joint.axis" the word behind the point. */
static const char *word_of(const kt_key *key) {
    const char *point = strchr(key->name, '.');
    return point == NULL ? key->name : point + 1;
}

static const kt_key *key_of_type(const kt_table *table, int type, const char *word) {
    const kt_descriptor *descriptor = table->describe(type);
    for (int i = 0; descriptor != NULL && i < descriptor->key_count; i++)
        if (strcmp(word_of(&descriptor->keys[i]), word) == 0 ||
            (descriptor->keys[i].also != NULL && strcmp(descriptor->keys[i].also, word) == 0))
            return &descriptor->keys[i];
    return NULL;
}

static void add_type(kt_fields *fields, const kt_table *table, int type) {
    const kt_descriptor *descriptor = table->describe(type);
    for (int i = 0; descriptor != NULL && i < descriptor->key_count; i++) {
        const kt_key *key = &descriptor->keys[i];
        if (find_field(fields, word_of(key)) >= 0) /* of several types: the first */
            continue;
        fields->field[fields->count++] = (kt_field){.key = word_of(key),
                                                    .also = key->also,
                                                    .kind = table->kind_of(key),
                                                    .offset = key->offset,
                                                    .flags = key->needed ? KT_FIELD_REQUIRED : 0,
                                                    .detail = key};
    }
}

static void list_fields(kt_fields *fields, const kt_table *table, int type) {
    fields->count = 0;
    for (int i = 0; i < table->count; i++)
        fields->field[fields->count++] = table->fields[i];
    if (table->describe != NULL)
        add_type(fields, table, type);
}

/* Lists the keys of all types, for a mapping whose type is not known. */
static void list_all_fields(kt_fields *fields, const kt_table *table) {
    list_fields(fields, table, -1);
    for (int type = table->types->first; type < table->types->count; type++)
        add_type(fields, table, type);
}

static bool is_type(const kt_table *table, const kt_field *field) {
    return table->types != NULL && field->detail == table->types;
}

/* The type that an object has; -1: none. */
static int type_of(const kt_table *table, const void *object) {
    for (int i = 0; i < table->count; i++) {
        int type;
        if (!is_type(table, &table->fields[i]))
            continue;
        memcpy(&type, kt_field_of(object, &table->fields[i]), sizeof type);
        return type >= 0 && type < table->types->count ? type : -1;
    }
    return table->type;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* The state of reading a mapping. */
typedef struct kt_reading {
    kt_reader *r;
    const kt_scope *scope;
    const kt_table *table;
    void *object;
    kt_fields fields;
    kt_node *values[KT_TABLE_COUNT_MAX]; /* of the fields; NULL: not there */
    const kt_node *keys[KT_TABLE_COUNT_MAX];
    bool misspelt[KT_TABLE_COUNT_MAX]; /* an unknown key was probably meant for it */
    int type;                          /* -1: it could not be read */
    bool type_is_known;                /* it could be read, or there are none to choose from */
} kt_reading;

static void report_unknown(kt_reading *reading, kt_node *key) {
    kt_reader *r = reading->r;
    const kt_fields *fields = &reading->fields;
    const char *word = key->of.text;
    kt_nearest nearest = kt_nearest_make(word, &r->effort);
    bool more = true;
    for (int i = 0; more && i < fields->count; i++) {
        more = kt_nearest_try(&nearest, fields->field[i].key);
        if (more && fields->field[i].also != NULL)
            more = kt_nearest_try(&nearest, fields->field[i].also);
    }
    kt_phrase mend = {.length = 0};
    if (strspn(word, "+-.0123456789)") > 0) {
        kt_phrase_add(&mend, "if it is part of a formula, put that in quotes: in { } and [ ] a comma ends it");
    } else if (nearest.best != NULL) {
        kt_phrase_add(&mend, "did you mean '%s'?", nearest.best);
        reading->misspelt[find_field(fields, nearest.best)] = true;
    } else {
        kt_phrase_add(&mend, "it can be");
        for (int i = 0; i < fields->count; i++) {
            kt_phrase_add(&mend, "%s %s", i > 0 ? "," : "", fields->field[i].key);
            if (fields->field[i].also != NULL)
                kt_phrase_add(&mend, ", %s", fields->field[i].also);
        }
    }
    kt_fault_at(r, KT_ERROR_SCENE, reading->scope, key, "unknown key %s; %s", kt_name_quote(word).text, mend.text);
}

/* Reports a key that other types have; returns false if none has it. */
static bool report_misplaced(const kt_reading *reading, kt_node *key) {
    const kt_table *table = reading->table;
    const kt_choice *types = table->types;
    int owners = 0;
    if (types == NULL || reading->type < 0)
        return false;
    for (int i = types->first; i < types->count; i++)
        owners += key_of_type(table, i, key->of.text) != NULL;
    if (owners == 0)
        return false;
    kt_phrase phrase = {.length = 0};
    for (int i = types->first; i < types->count; i++)
        if (key_of_type(table, i, key->of.text) != NULL)
            kt_phrase_add(&phrase, "%s%s", types->names[i], --owners > 1 ? ", " : owners == 1 ? " and " : "");
    kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "type %s has no key '%s'; it belongs to %s",
                types->names[reading->type], key->of.text, phrase.text);
    return true;
}

static void report_repeated(const kt_reading *reading, const kt_node *first, kt_node *key) {
    if (strcmp(first->of.text, key->of.text) == 0)
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key,
                    "the key '%s' is there already, in line %u; remove one of them", key->of.text,
                    (unsigned)first->line);
    else
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key,
                    "'%s' and '%s' are the same; leave one of them out", first->of.text, key->of.text);
}

static void sort_key(kt_reading *reading, kt_node *key) {
    if (key->faulty)
        return;
    if (key->kind != KT_NODE_TEXT) {
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "a key must be a word, found a %s",
                    key->kind == KT_NODE_LIST ? "list" : "mapping");
        return;
    }
    if (strcmp(key->of.text, "<<") == 0 && key->next->faulty) /* a merge key, whose alias has been reported */
        return;
    const int found = find_field(&reading->fields, key->of.text);
    if (found < 0) {
        if (!report_misplaced(reading, key))
            report_unknown(reading, key);
    } else if (reading->values[found] != NULL) {
        report_repeated(reading, reading->keys[found], key);
    } else {
        reading->values[found] = key->next;
        reading->keys[found] = key;
    }
}

static bool read_field(const kt_reading *reading, int i) {
    const kt_field *field = &reading->fields.field[i];
    const kt_scope scope = {.outer = reading->scope, .key = field->key};
    kt_node *value = reading->values[i];
    return !value->faulty && field->kind->read(reading->r, &scope, value, field, reading->object);
}

/* A key that an unknown one was probably meant for is not reported again. */
static void report_missing(const kt_reading *reading, kt_node *map) {
    const kt_table *table = reading->table;
    kt_phrase missing = {.length = 0}, mend = {.length = 0};
    int count = 0;
    for (int i = 0; i < (reading->type_is_known ? reading->fields.count : table->count); i++) {
        const kt_field *field = &reading->fields.field[i];
        if ((field->flags & KT_FIELD_REQUIRED) == 0 || reading->values[i] != NULL || reading->misspelt[i])
            continue;
        kt_phrase_add(&missing, "%s'%s'", count++ > 0 ? ", " : "", field->key);
        if (field->also != NULL)
            kt_phrase_add(&missing, " (or '%s')", field->also);
    }
    if (count == 0)
        return;
    if (table->types != NULL && kt_node_find(map, "type") == NULL) {
        kt_phrase_add(&mend, "its type is ");
        add_choices(&mend, table->types);
    } else {
        kt_phrase_add(&mend, "add %s", count > 1 ? "them" : "it");
    }
    kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, map, "the key%s %s %s missing; %s", count > 1 ? "s" : "",
                missing.text, count > 1 ? "are" : "is", mend.text);
}

/* The type is read first, wherever it stands in the mapping: it decides which other keys there are and what they
 * mean. */
static void read_type(kt_reading *reading, const kt_node *map) {
    const kt_table *table = reading->table;
    reading->type_is_known = table->types == NULL;
    for (int i = 0; i < table->count; i++) {
        if (!is_type(table, &table->fields[i]))
            continue;
        reading->fields.field[i] = table->fields[i];
        reading->values[i] = kt_node_find(map, table->fields[i].key);
        reading->type_is_known = reading->values[i] != NULL && read_field(reading, i);
        reading->values[i] = NULL;
    }
    reading->type = reading->type_is_known ? type_of(table, reading->object) : -1;
    if (reading->type_is_known)
        list_fields(&reading->fields, table, reading->type);
    else
        list_all_fields(&reading->fields, table);
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
    for (int i = 0; i < (reading.type_is_known ? reading.fields.count : table->count) && !r->out_of_memory; i++)
        if (reading.values[i] != NULL && !is_type(table, &reading.fields.field[i]))
            (void)read_field(&reading, i);
    return true;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

bool kt_field_same(const kt_field *field, const void *object, const void *standard) {
    if (field->same != NULL)
        return field->same(field, object, standard);
    return field->kind->same != NULL && field->kind->same(field, object, standard);
}

static bool is_written(const kt_field *field, const void *object, const void *standard) {
    return (field->flags & KT_FIELD_REQUIRED) != 0 || !kt_field_same(field, object, standard);
}

bool kt_table_same(const kt_table *table, const void *object, const void *standard) {
    kt_fields fields;
    list_fields(&fields, table, type_of(table, object));
    for (int i = 0; i < fields.count; i++)
        if (is_written(&fields.field[i], object, standard))
            return false;
    return true;
}

void kt_table_write(kt_emitter *e, const kt_table *table, const void *object, const void *standard) {
    kt_fields fields;
    list_fields(&fields, table, type_of(table, object));
    kt_emit_map(e, table->flow);
    for (int i = 0; i < fields.count; i++) {
        const kt_field *field = &fields.field[i];
        if (!is_written(field, object, standard))
            continue;
        if ((field->flags & KT_FIELD_SECTION) != 0)
            kt_emit_section(e, field->key);
        else
            kt_emit_key(e, field->key);
        field->kind->write(e, field, object, standard);
    }
    kt_emit_end(e);
}
