/* Reading a document: memory, faults with their places, scopes of messages, tables of keys. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_DOCUMENT_READER_H
#define KT_DOCUMENT_DOCUMENT_READER_H

#include "base/names.h"
#include "base/pool.h"
#include "document/emit.h"
#include "document/node.h"
#include "kinetree/descriptor.h"

#include <stdint.h>

/* ---- faults ------------------------------------------------------------------------------------------------------ */

typedef struct kt_fault {
    const char *message;
    kt_status code;
    uint32_t line, column;
    uint32_t order; /* number of the fault in the order of discovery */
} kt_fault;

/* Faults of a file beyond this number are only counted. */
enum { KT_FAULT_COUNT_MAX = 1000 };

/* ---- the reader -------------------------------------------------------------------------------------------------- */

struct kt_reader {
    kt_pool keep;              /* the data of the finished result */
    kt_pool scratch;           /* nodes, messages */
    bool out_of_memory;        /* then all other results are invalid */
    const char *path;          /* path of the file that is read, or the file's name in messages */
    size_t elements, included; /* elements of XML, and included files, all copies counted */
    int64_t effort;            /* operations that remain for finding the names to suggest */

    kt_fault *faults;
    size_t fault_count, fault_room, fault_dropped;

    kt_node *root;                  /* root of a document in YAML */
    struct kt_scene_reading *scene; /* names, parameters and nodes of a scene (scene/scene_reader.h) */
};

/* The reader's position in the file, linked from the inside out, for the beginning of a message. A body, loop or effect
 * has a noun and begins a message ("body 'crank': "), a key or an item of a list follows ("joint.axis: "). */
typedef struct kt_scope {
    const struct kt_scope *outer;
    const char *key;  /* a key; NULL: an item of a list */
    int index;        /* index of an item, from 0 */
    const char *noun; /* NULL, or the kind of item */
    const char *list; /* with a noun: the section that the item is in */
    const char *name; /* with a noun; NULL: unknown, and the message has list[index] */
} kt_scope;

/* Reports a fault at a node, which becomes faulty. The message is made of the scope and the format. Nothing is reported
 * at a node that is faulty already. Returns false. */
bool kt_fault_at(kt_reader *r, kt_status code, const kt_scope *scope, kt_node *node, const char *format, ...)
    KT_PRINTF(5, 6);

/* Reports a fault by line and column, even if one has been reported there. */
bool kt_fault_put(kt_reader *r, kt_status code, uint32_t line, uint32_t column, const char *format, ...)
    KT_PRINTF(5, 6);

/* Writes "FILE:LINE:COLUMN". */
void kt_document_where(char where[KT_WHERE_SIZE], const char *path, uint32_t line, uint32_t column);

/* Records that memory has run out. Returns false. */
bool kt_reader_out_of_memory(kt_reader *r);

/* Take memory as kt_pool_take, kt_pool_grow and kt_pool_text do, from a pool of the reader, and record that memory has
 * run out. */
void *kt_reader_take(kt_reader *r, kt_pool *pool, size_t count, size_t size);
void *kt_reader_grow(kt_reader *r, kt_pool *pool, void *items, size_t count, size_t more, size_t *room, size_t size);
char *kt_reader_text(kt_reader *r, kt_pool *pool, const char *text, size_t length);

/* Sorts the faults by line and column, and drops repeated ones. */
void kt_fault_sort(kt_reader *r);

/* Reports "expected X, found Y" with the contents of the node, and a remedy if there is one. Returns false. */
bool kt_fault_expected(kt_reader *r, const kt_scope *scope, kt_node *node, const char *expected);

/* A growing text for messages. */
typedef struct kt_phrase {
    char text[KT_MESSAGE_SIZE];
    size_t length;
} kt_phrase;

void kt_phrase_add(kt_phrase *phrase, const char *format, ...) KT_PRINTF(2, 3);

/* ---- tables of keys ---------------------------------------------------------------------------------------------- */

typedef struct kt_field kt_field;

/* A field of a struct, to be written, and the same struct after reading a mapping without its key. */
typedef struct kt_member {
    const kt_field *field;
    const void *object;
    const void *standard;
} kt_member;

/* How values of one kind are read, written and compared. `object` is the struct that the field lies in. */
typedef struct kt_kind {
    /* Reads a node into the object. On a fault, reports it, leaves the object untouched and returns false. */
    bool (*read)(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
    void (*write)(kt_emitter *e, const kt_member *m);
    /* Whether the field may be left out: it has the same bits as after reading a mapping without its key. NULL: if the
     * first `size` bytes of the value have them. */
    bool (*same)(const kt_member *m);
    size_t size;        /* size of the value, or of its first member; without `same` and 0: it is never left out */
    const void *detail; /* data of the kind, for fields whose detail is something else; NULL: that of the field */
} kt_kind;

enum {
    KT_FIELD_REQUIRED = 1,
    KT_FIELD_SECTION = 2 /* written after a blank line */
};

/* A key of a mapping. */
struct kt_field {
    const char *key;
    const char *also; /* a second spelling, which is read; NULL: none */
    const kt_kind *kind;
    size_t offset;                    /* in the struct */
    unsigned flags;                   /* KT_FIELD_ */
    const void *detail;               /* data of the kind: a kt_table or a kt_choice; of a key of a type its kt_key */
    bool (*same)(const kt_member *m); /* NULL: the kind's */
};

/* A word of earlier versions, and the end of the message that rejects it. */
typedef struct kt_closed_word {
    const char *word, *remedy;
} kt_closed_word;

/* The choices of a word, by value. */
typedef struct kt_choice {
    const char *where; /* "simulate.reduction" */
    const char *const *names;
    int count;
    int first;                    /* the smallest value that has a name in scene files */
    const kt_closed_word *closed; /* NULL: none */
} kt_choice;

/* A mapping. With types, the keys are those of the table, followed by those of the type's descriptor. */
typedef struct kt_table {
    const kt_field *fields;
    int count;
    bool flow;                                    /* written in one line */
    const kt_choice *types;                       /* types that the field `type` may name; NULL: no types */
    const kt_descriptor *(*describe)(int type);   /* the descriptor of a type; NULL: the keys are those of the table */
    const kt_kind *(*kind_of)(const kt_key *key); /* with descriptors: how a key of theirs is read, written, compared */
    int type;                                     /* the only one, where there are no types to choose from */
    const char *example; /* "{linear: [...], angular: [...]}": where no mapping is found; NULL: none */
} kt_table;

enum { KT_TABLE_COUNT_MAX = 64 };

/* The address of a field. */
static inline void *kt_field_in(void *object, const kt_field *field) { return (char *)object + field->offset; }
static inline const void *kt_field_of(const void *object, const kt_field *field) {
    return (const char *)object + field->offset;
}
static inline const void *kt_member_value(const kt_member *m) { return kt_field_of(m->object, m->field); }
static inline const void *kt_member_standard(const kt_member *m) { return kt_field_of(m->standard, m->field); }

/* The data of a field's kind. */
static inline const void *kt_detail_of(const kt_field *field) {
    return field->kind->detail != NULL ? field->kind->detail : field->detail;
}

#define KT_COUNT_OF(array) ((int)(sizeof(array) / sizeof *(array)))

/* Reads a mapping into an object that holds the defaults. Unknown, repeated, misplaced and missing keys are reported.
 * Fields are read in the order of the table, not of the file. Returns false if the node is no mapping. */
bool kt_table_read(kt_reader *r, const kt_scope *scope, kt_node *map, const kt_table *table, void *object);

/* Whether a mapping without types lacks a key, and has a wrong key in its place: an unknown key, or a repeated key. */
bool kt_key_is_hidden(kt_reader *r, const kt_table *table, const kt_node *map, const char *key);

/* Writes the mapping: the fields that differ from the fields of `standard`. */
void kt_table_write(kt_emitter *e, const kt_table *table, const void *object, const void *standard);

/* Whether the mapping would be written without any key. */
bool kt_table_same(const kt_table *table, const void *object, const void *standard);

/* The scope of an item of a section: a body, loop or effect. */
kt_scope kt_item_scope(const char *noun, const char *list, int index, const kt_node *node);

/* Returns the value of a word, or -1 after reporting a fault. */
int kt_choice_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_choice *choice);

#endif
