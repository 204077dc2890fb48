/* The parts of a scene: a table for each. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_PART_H
#define KT_SCENE_SCENE_PART_H

#include "model/joint_name.h"
#include "scene/value.h"

extern const kt_table kt_joint_table;       /* kt_joint */
extern const kt_table kt_graph_joint_table; /* kt_graph_joint */

typedef struct kt_items kt_items;

/* Sections, of a kt_scene; lists of items (items.c). */
extern const kt_kind kt_kind_states, kt_kind_columns, kt_kind_joints, kt_kind_tables;
extern const kt_items kt_bodies, kt_loops, kt_effects, kt_meshes;
/* Reads the section `tables`, before formulas are read. */
void kt_tables_read(kt_reader *r, kt_description *description);
/* Once all else is read: checks the expressions that nothing has used, as formulas of columns. */
void kt_expressions_check(kt_reader *r);

extern const kt_table kt_initial_table;
extern const kt_kind kt_kind_simulate; /* for a kt_scene */
extern const kt_table kt_output_table; /* for a kt_scene */

/* ---- lists of items (items.c) ------------------------------------------------------------------------------------ */

/* An item of a list that is being read, with its neighbours. */
typedef struct kt_item_read {
    void *items;
    kt_node **nodes;
    int index, count;
    void *object; /* object that has the list */
} kt_item_read;

/* A list of items in an array of an object: the detail of a field of kt_kind_items. */
struct kt_items {
    const char *expected;       /* "a list of loops ('- {type: ..., between: ...}')" */
    const char *noun, *section; /* words for items that messages call by their names; NULL: by their indices */
    unsigned least;             /* items that a list must have */
    int most;                   /* most items that a list may have; 0: any number */
    size_t size, array, count;  /* size of an item; offsets of the array and of its length, an int */
    size_t nodes;               /* offset in kt_scene_reading of the array of nodes; 0: it is not kept */
    bool flow;                  /* written in one line */
    void (*read)(kt_reader *r, const kt_scope *scope, const kt_item_read *item);
    void (*write)(kt_emitter *e, const void *item, int index);
    bool (*finish)(kt_reader *r, const kt_item_read *all); /* after the last item; NULL: nothing is left to do */
};

extern const kt_kind kt_kind_items;
bool kt_items_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
void kt_items_write(kt_emitter *e, const kt_member *m);
bool kt_items_same(const kt_member *m);

/* Finds the items of a list: their number, and their nodes in an array. Returns false, after reporting why, if the node
 * is no list. */
bool kt_list_nodes(kt_reader *r, const kt_scope *scope, kt_node *list, const char *expected, kt_node ***nodes,
                   int *count);

/* Adds the effects of `exhaust` of bodies, after bodies and effects have been read. */
void kt_exhausts_add(kt_reader *r, kt_description *description);

/* The indices of a body and of its marker, once the bodies are read; -1 where there is none. O(1) on average. */
int kt_find_body(const kt_reader *r, const char *name);
/* The body that a joint carries, likewise. */
int kt_find_joint(const kt_reader *r, const char *name);
int kt_find_marker(const kt_reader *r, int body, const char *name);

/* Indexes the names of bodies that have been read, or changed. */
bool kt_bodies_index(kt_reader *r, const kt_body *bodies, int count);

/* The loops of `joints` go behind those of `loops`. Returns false if there is no memory. */
bool kt_graph_loops_append(kt_reader *r, kt_description *description);

/* The index of a loop; -1 if there is none. O(loops). */
int kt_find_loop(const kt_description *description, const char *name);

/* Whether markers or joint of a body could not be read: then references to them cannot be checked. */
bool kt_body_is_hidden(const kt_reader *r, int body);

/* Fills *names, in the pool, with the names of bodies (scope 0), of joints (KT_NAMES_OF_JOINTS) and of the markers of
 * body i (scope i + 1). False if there is no memory. */
bool kt_index_bodies(kt_pool *pool, kt_names *names, const kt_body *bodies, int count);

/* The unit of a scalar joint's position; that of an angle if there is no such joint. */
kt_quantity kt_joint_quantity(const kt_reader *r, const char *joint);

/* Checks the description, and reports its faults at their positions in the file. Faults that follow from one that has
 * been reported already are left out. */
void kt_check_description(kt_reader *r, const kt_description *description);

/* Reads a format. The function fills the scene, which holds the defaults, with data in reader->keep, and puts faults
 * into the reader. */
typedef void kt_format(kt_reader *r, const char *path, const char *text, size_t size, const void *options,
                       kt_scene *scene);

/* A format, and its options. */
typedef struct kt_format_choice {
    kt_format *read;
    const void *options;
} kt_format_choice;

/* Reads a text, or a file, in the C locale, as kt_scene_parse and kt_scene_read do. */
kt_status kt_format_parse(kt_format_choice format, const char *path, const char *text, size_t size, kt_scene *scene,
                          kt_scene_report *report, void *user, kt_error *error);
kt_status kt_format_read(kt_format_choice format, const char *path, kt_scene *scene, kt_scene_report *report,
                         void *user, kt_error *error);

/* The place of an item of a scene in its file, for faults that are found after reading. */
typedef struct kt_mark {
    uint32_t line, column;
} kt_mark;

struct kt_scene_marks {
    const char *path;
    const kt_mark *bodies, *loops; /* marks in the order of the arrays of the description */
    kt_mark from;                  /* place of `initial.from`; line 0: the file does not have this key */
    const struct kt_named_file *files;
};

/* Checks whether a run can be written and read again; *error gives the reason if it cannot. */
kt_status kt_check_run(const kt_run *run, const kt_description *description, kt_error *error);

#endif
