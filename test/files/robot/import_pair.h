/* Models of files as today's MuJoCo reads them, beside ours: joints and bodies of the one by names of the other. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_IMPORT_PAIR_H
#define KT_TEST_ROBOT_IMPORT_PAIR_H

#include "answer.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

/* A model of theirs, and ours of the same file. The vectors of both are in the order of theirs. */
typedef struct import_pair {
    kt_scene scene;
    kt_model *model;
    bool is_tree;   /* no loops but the lengths of tendons */
    bool has_paths; /* lengths of spatial tendons, which have armature, and follow from no linear rule */
    kt_data *data;
    answer theirs;
    double *of;   /* T: our velocities by theirs, in columns */
    bool is_ours; /* an export of a bundled scene, which may have neither gravity nor springs */
    int lengths;  /* of tendons, that are compared */
    double *q, *v, *a, *tau, *matrix;
    double *product, *reduced, *along; /* M T, T' M T, T' f */
} import_pair;

/* Reads a file and compiles it, after theirs is described; false after a failed check or with a note. */
bool load_import_pair(import_pair *p, const char *path, const kt_robot_options *options);
void release_import_pair(import_pair *p);

/* Finds our bodies of theirs, and T. Returns false after a failed check. */
bool match_import_pair(import_pair *p);

/* Sets our state to theirs. */
void set_import_state(import_pair *p);

#endif
