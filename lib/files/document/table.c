/* Mappings by tables: one list of keys serves reading, writing, comparing and suggesting. If a mapping has types, its
 * keys are the keys of the table and of the type's descriptor. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/document_reader.h"
#include "document/number.h"

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
    if (choice->closed != NULL && strcmp(node->of.text, choice->closed->word) == 0)
        (void)kt_fault_at(r, KT_ERROR_UNSUPPORTED, scope, node, "'%s' %s", choice->closed->word,
                          choice->closed->remedy);
    else
        report_choice(r, scope, node, choice);
    return -1;
}

/* ---- the fields of a mapping ------------------------------------------------------------------------------------- */

/* The fields of the table, and the fields of a type. */
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

/* The name of a key within its mapping: for "joint.axis", the word after the point. */
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

/* The keys of all types together are listed for messages alone, so that a key beyond the room may be left out. */
static void append_field(kt_fields *fields, kt_field field) {
    if (fields->count < KT_TABLE_COUNT_MAX)
        fields->field[fields->count++] = field;
}

static void add_type(kt_fields *fields, const kt_table *table, int type) {
    const kt_descriptor *descriptor = table->describe(type);
    for (int i = 0; descriptor != NULL && i < descriptor->key_count; i++) {
        const kt_key *key = &descriptor->keys[i];
        if (find_field(fields, word_of(key)) >= 0) /* of several types: the first */
            continue;
        append_field(fields, (kt_field){.key = word_of(key),
                                        .also = key->also,
                                        .kind = table->kind_of(key),
                                        .offset = key->offset,
                                        .flags = key->needed ? KT_FIELD_REQUIRED : 0,
                                        .detail = key});
    }
}

static void list_fields(kt_fields *fields, const kt_table *table, int type) {
    fields->count = 0;
    for (int i = 0; i < table->count; i++)
        append_field(fields, table->fields[i]);
    if (table->describe != NULL)
        add_type(fields, table, type);
}

/* Lists the keys of all types, for a mapping of unknown type. */
static void list_all_fields(kt_fields *fields, const kt_table *table) {
    list_fields(fields, table, -1);
    for (int type = table->types->first; type < table->types->count; type++)
        add_type(fields, table, type);
}

static bool is_type(const kt_table *table, const kt_field *field) {
    return table->types != NULL && field->detail == table->types;
}

/* The type that an object has; -1: none. */
static int object_type_of(const kt_table *table, const void *object) {
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
    const kt_node *map;
    const kt_table *table;
    void *object;
    kt_fields fields;
    kt_node *values[KT_TABLE_COUNT_MAX]; /* of the fields; NULL: not there */
    const kt_node *keys[KT_TABLE_COUNT_MAX];
    bool misspelt[KT_TABLE_COUNT_MAX]; /* an unknown key was probably meant for it */
    int type;                          /* -1: it could not be read */
    bool type_is_known;                /* it could be read, or there are none to choose from */
    bool is_missing_reported;          /* which keys are missing has been reported */
    bool are_keys_listed;              /* which keys there are has been reported */
} kt_reading;

/* The key that a comma in an unquoted formula leaves: "x)" of =atan2(y, x). */
static bool is_of_formula(const kt_node *key) {
    return strpbrk(key->of.text, "()=") != NULL || strspn(key->of.text, "+-.0123456789") > 0;
}

/* The required keys that a mapping does not have, except those that an unknown key was probably meant for: "'to',
 * 'radius'". Returns their number. */
static int list_missing(const kt_reading *reading, kt_phrase *missing) {
    const int count = reading->type_is_known ? reading->fields.count : reading->table->count;
    int found = 0;
    if (reading->map->faulty)
        return 0;
    for (int i = 0; i < count; i++) {
        const kt_field *field = &reading->fields.field[i];
        if ((field->flags & KT_FIELD_REQUIRED) == 0 || reading->values[i] != NULL || reading->misspelt[i])
            continue;
        kt_phrase_add(missing, "%s'%s'", found++ > 0 ? ", " : "", field->key);
        if (field->also != NULL)
            kt_phrase_add(missing, " (or '%s')", field->also);
    }
    return found;
}

/* Reports one fault for a wrong key and for the missing keys, which it may replace. */
static void report_key(kt_reading *reading, kt_node *key, const char *what) {
    kt_phrase missing = {.length = 0};
    const int count = reading->is_missing_reported ? 0 : list_missing(reading, &missing);
    reading->is_missing_reported = reading->is_missing_reported || count > 0;
    if (count > 0)
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "%s; %s %s missing", what, missing.text,
                    count > 1 ? "are" : "is");
    else
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "%s", what);
}

/* Reports an unknown key that resembles another key. */
static void report_misspelt(kt_reading *reading, kt_node *key) {
    const kt_fields *fields = &reading->fields;
    kt_nearest nearest = kt_nearest_make(key->of.text, &reading->r->effort);
    bool more = true;
    for (int i = 0; more && i < fields->count; i++) {
        more = kt_nearest_try(&nearest, fields->field[i].key);
        if (more && fields->field[i].also != NULL)
            more = kt_nearest_try(&nearest, fields->field[i].also);
    }
    if (nearest.best == NULL || is_of_formula(key))
        return;
    reading->misspelt[find_field(fields, nearest.best)] = true;
    kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "unknown key %s; did you mean '%s'?",
                kt_name_quote(key->of.text).text, nearest.best);
}

/* So many keys fit into a message. Only a mapping of unknown type has more, since it can have the keys of all types. */
enum { LISTED_KEYS = 40 };

/* The keys that an item can have are listed with its first unknown key alone. */
static void report_unknown_key(kt_reading *reading, kt_node *key) {
    const kt_fields *fields = &reading->fields;
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what, "unknown key %s", kt_name_quote(key->of.text).text);
    if (is_of_formula(key)) {
        kt_phrase_add(&what, "; if it is part of a formula, put that in quotes: in { } and [ ] a comma ends it");
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "%s", what.text);
        return;
    }
    const int listed = fields->count < LISTED_KEYS ? fields->count : LISTED_KEYS;
    for (int i = 0; i < listed && !reading->are_keys_listed; i++) {
        kt_phrase_add(&what, "%s %s", i > 0 ? "," : "; it can be", fields->field[i].key);
        if (fields->field[i].also != NULL)
            kt_phrase_add(&what, ", %s", fields->field[i].also);
    }
    if (listed < fields->count && !reading->are_keys_listed)
        kt_phrase_add(&what, ", and keys of other types");
    reading->are_keys_listed = true;
    report_key(reading, key, what.text);
}

/* How many other types have a key. */
static int count_owners(const kt_reading *reading, const kt_node *key) {
    const kt_choice *types = reading->table->types;
    int owners = 0;
    if (types == NULL || reading->type < 0)
        return 0;
    for (int i = types->first; i < types->count; i++)
        owners += key_of_type(reading->table, i, key->of.text) != NULL;
    return owners;
}

/* Reports a key that other types have; returns false if none has it. */
static bool report_misplaced(kt_reading *reading, kt_node *key) {
    const kt_table *table = reading->table;
    const kt_choice *types = table->types;
    int owners = count_owners(reading, key);
    if (owners == 0)
        return false;
    kt_phrase phrase = {.length = 0};
    for (int i = types->first; i < types->count; i++)
        if (key_of_type(table, i, key->of.text) != NULL)
            kt_phrase_add(&phrase, "%s%s", types->names[i], --owners > 1 ? ", " : owners == 1 ? " and " : "");
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what, "type %s has no key '%s'; it belongs to %s", types->names[reading->type], key->of.text,
                  phrase.text);
    report_key(reading, key, what.text);
    return true;
}

static void report_repeated(kt_reading *reading, const kt_node *first, kt_node *key) {
    kt_phrase what = {.length = 0};
    if (strcmp(first->of.text, key->of.text) == 0)
        kt_phrase_add(&what, "the key '%s' is there already, in line %u; remove one of them", key->of.text,
                      (unsigned)first->line);
    else
        kt_phrase_add(&what, "'%s' and '%s' are the same; leave one of them out", first->of.text, key->of.text);
    report_key(reading, key, what.text);
}

/* Finds the values of fields; other keys stay for report_stray. */
static void sort_key(kt_reading *reading, kt_node *key) {
    if (key->faulty)
        return;
    if (key->kind != KT_NODE_TEXT) {
        kt_fault_at(reading->r, KT_ERROR_SCENE, reading->scope, key, "a key must be a word, found a %s",
                    key->kind == KT_NODE_LIST ? "list" : "mapping");
        return;
    }
    const int found = find_field(&reading->fields, key->of.text);
    if (found >= 0 && reading->values[found] == NULL) {
        reading->values[found] = key->next;
        reading->keys[found] = key;
    }
}

/* Reports a key that belongs to no field, or occurs twice. Without `all`, reports only keys that resemble a field. */
static void report_stray(kt_reading *reading, kt_node *key, bool all) {
    if (key->faulty || key->kind != KT_NODE_TEXT)
        return;
    if (strcmp(key->of.text, "<<") == 0 && key->next->faulty) /* a merge key, whose alias has been reported */
        return;
    const int found = find_field(&reading->fields, key->of.text);
    if (found >= 0 && (reading->keys[found] == key || !all))
        return;
    if (found >= 0)
        report_repeated(reading, reading->keys[found], key);
    else if (!all && count_owners(reading, key) == 0)
        report_misspelt(reading, key);
    else if (all && !report_misplaced(reading, key))
        report_unknown_key(reading, key);
}

static bool read_field(const kt_reading *reading, int i) {
    const kt_field *field = &reading->fields.field[i];
    const bool is_other = field->also != NULL && strcmp(reading->keys[i]->of.text, field->also) == 0;
    const kt_scope scope = {.outer = reading->scope, .key = is_other ? field->also : field->key};
    kt_node *value = reading->values[i];
    return !value->faulty && field->kind->read(reading->r, &scope, value, field, reading->object);
}

/* Reports missing keys, unless the faults of wrong keys have reported them. */
static void report_missing(const kt_reading *reading, kt_node *map) {
    const kt_table *table = reading->table;
    kt_phrase missing = {.length = 0}, mend = {.length = 0};
    const int count = reading->is_missing_reported ? 0 : list_missing(reading, &missing);
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

/* The type is read first, at any position in the mapping: because the type determines the other keys and their
 * meaning. */
static void read_object_type(kt_reading *reading, const kt_node *map) {
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
    reading->type = reading->type_is_known ? object_type_of(table, reading->object) : -1;
    if (reading->type_is_known)
        list_fields(&reading->fields, table, reading->type);
    else
        list_all_fields(&reading->fields, table);
}

/* The keys of a closed type have no meaning, and no message of their own. */
static bool type_is_closed(const kt_table *table, const kt_node *map) {
    const kt_node *type = table->types != NULL && table->types->closed != NULL ? kt_node_find(map, "type") : NULL;
    return type != NULL && type->kind == KT_NODE_TEXT && strcmp(type->of.text, table->types->closed->word) == 0;
}

/* Whether a key without a field may be meant for this field: the key resembles this field, or resembles none. */
static bool may_stand_for(kt_reader *r, const kt_fields *fields, const char *word, const char *key) {
    kt_nearest nearest = kt_nearest_make(word, &r->effort);
    for (int i = 0; i < fields->count; i++)
        (void)kt_nearest_try(&nearest, fields->field[i].key);
    return nearest.best == NULL || strcmp(nearest.best, key) == 0;
}

bool kt_key_is_hidden(kt_reader *r, const kt_table *table, const kt_node *map, const char *key) {
    kt_fields fields;
    bool seen[KT_TABLE_COUNT_MAX] = {false}, is_hidden = false;
    list_fields(&fields, table, -1);
    for (const kt_node *other = map->of.first; other != NULL; other = other->next->next) {
        const int found = other->kind == KT_NODE_TEXT ? find_field(&fields, other->of.text) : -1;
        if (found >= 0 && strcmp(fields.field[found].key, key) == 0)
            return false;
        if (found >= 0)
            is_hidden = is_hidden || seen[found];
        else
            is_hidden = is_hidden || other->kind != KT_NODE_TEXT || may_stand_for(r, &fields, other->of.text, key);
        if (found >= 0)
            seen[found] = true;
    }
    return is_hidden;
}

bool kt_table_read(kt_reader *r, const kt_scope *scope, kt_node *map, const kt_table *table, void *object) {
    if (map->kind == KT_NODE_TEXT && map->count > 0 && table->types != NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, map, "expected a mapping, found %s; write {type: ...}",
                           kt_name_quote(map->of.text).text);
    if (map->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, map, table->example == NULL ? "a mapping (key: value)" : table->example);
    kt_reading reading = {.r = r, .scope = scope, .map = map, .table = table, .object = object};
    read_object_type(&reading, map);
    if (type_is_closed(table, map))
        return false;
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next)
        sort_key(&reading, key);
    for (int all = 0; all < 2; all++)
        for (kt_node *key = map->of.first; key != NULL; key = key->next->next)
            report_stray(&reading, key, all == 1);
    report_missing(&reading, map);
    for (int i = 0; i < (reading.type_is_known ? reading.fields.count : table->count) && !r->out_of_memory; i++)
        if (reading.values[i] != NULL && !is_type(table, &reading.fields.field[i]))
            (void)read_field(&reading, i);
    return true;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static bool is_written(const kt_member *m) {
    const kt_field *field = m->field;
    const kt_kind *kind = field->kind;
    if ((field->flags & KT_FIELD_REQUIRED) != 0)
        return true;
    if (field->same != NULL || kind->same != NULL)
        return !(field->same != NULL ? field->same : kind->same)(m);
    return kind->size == 0 || memcmp(kt_member_value(m), kt_member_standard(m), kind->size) != 0;
}

bool kt_table_same(const kt_table *table, const void *object, const void *standard) {
    kt_fields fields;
    list_fields(&fields, table, object_type_of(table, object));
    for (int i = 0; i < fields.count; i++)
        if (is_written(&(kt_member){&fields.field[i], object, standard}))
            return false;
    return true;
}

void kt_table_write(kt_emitter *e, const kt_table *table, const void *object, const void *standard) {
    kt_fields fields;
    list_fields(&fields, table, object_type_of(table, object));
    kt_emit_map(e, table->flow ? KT_EMIT_FLOW : KT_EMIT_BLOCK);
    for (int i = 0; i < fields.count; i++) {
        const kt_field *field = &fields.field[i];
        const kt_member member = {field, object, standard};
        if (!is_written(&member))
            continue;
        if ((field->flags & KT_FIELD_SECTION) != 0)
            kt_emit_section(e, field->key);
        else
            kt_emit_key(e, field->key);
        field->kind->write(e, &member);
    }
    kt_emit_end(e);
}
