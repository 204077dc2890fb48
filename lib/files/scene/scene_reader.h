/* The parts that readers of a scene share: names, parameters, nodes of items. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_READER_H
#define KT_SCENE_SCENE_READER_H

#include "document/document_reader.h"
#include "kinetree/scene.h"

typedef struct kt_named_number kt_named_number;
typedef struct kt_named_formula kt_named_formula;

/* A file that a scene names, besides the result that it starts from. */
typedef struct kt_named_file {
    const char *path;
    const struct kt_named_file *next; /* NULL: none */
} kt_named_file;

typedef struct kt_scene_reading {
    const kt_description *description; /* as far as it is read */
    struct kt_scene_part *parts;       /* shapes of the body that is being read; NULL: none */
    kt_node **part_nodes;
    kt_names names;         /* names of bodies (scope 0) and of the markers of body i (scope i + 1) to indices */
    bool names_are_known;   /* the name of every body could be read */
    bool names_are_doubled; /* two bodies have one name */
    bool hides_bodies;      /* markers or the joint of some body could not */
    int quantity;           /* kt_quantity of the values of the function that is being read */
    const char *unit;       /* SI unit of these values, up to a '|' or its end; NULL: any */
    int function_depth;     /* sums and products that the function is within */
    int joint_quantity;     /* kt_quantity of the position of the joint that the item acts in */

    kt_named_number *parameters; /* parameters of the file; see scene_parameter.c */
    double *parameter_values;    /* theirs, NaN if there is none: the values of expressions' symbols */
    int parameter_count;
    bool parameters_are_hidden; /* parameters could not be read: faults of their users are not reported */
    bool hides_parameters;      /* the names of some could not: unknown names are not reported */
    kt_names parameter_names;   /* to indices */
    kt_named_formula *named;    /* formulas of `expressions`; see named.c */
    int named_count;
    kt_node **table_keys;        /* as the tables of the description */
    bool *table_is_used;         /* likewise */
    bool gives_step, is_alone;   /* as in kt_scene_options */
    const char *const *settings; /* texts that have replaced values of the file */
    kt_scene_variables *varying; /* NULL: none */

    const kt_named_file *files; /* the last one first */

    const struct kt_graph *graph; /* graph of the key `joints`; NULL: none */
    kt_node **graph_nodes;        /* nodes of the joints in the graph */

    kt_node **body_nodes, **loop_nodes, **effect_nodes, **hold_nodes,
        **state_nodes; /* as the arrays of the description */
} kt_scene_reading;

/* Whether the name of every body could be read, and no two are equal. */
static inline bool kt_names_are_known(const kt_reader *r) {
    return r->scene->names_are_known && !r->scene->names_are_doubled;
}

/* Whether all names for formulas have been read. Else the names in formulas are not checked, since faults have been
 * reported. */
static inline bool kt_variables_are_known(const kt_reader *r) {
    return kt_names_are_known(r) && !r->scene->hides_bodies;
}

#endif
