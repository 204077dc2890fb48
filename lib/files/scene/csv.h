/* Tables in CSV files (csv.c), and names of files near a scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_CSV_H
#define KT_SCENE_CSV_H

#include "scene/value.h"

/* The columns, and their units; NULL: not given. */
typedef struct kt_csv_choice {
    const char *time, *value, *unit, *time_unit;
} kt_csv_choice;

/* The path of a file that a scene names, kept with the scene. Relative names count from the folder of the scene's file.
 * A file that is there has its whole path. The scene lists the file (kt_scene_file). */
const char *kt_path_near(kt_reader *r, const char *name);

/* Reads the rows t, y of two columns, kept with the scene, in SI units; y is of `quantity`. Reports faults of the file,
 * with their line and column, at the node of its name, and returns false. */
bool kt_read_csv(kt_reader *r, const kt_scope *scope, kt_node *file, const kt_csv_choice *choice, kt_quantity quantity,
                 const double **rows, int *count);

/* Reads the rows x, z or x, y, z of a lookup table, likewise. names: of the columns x, y and z; all NULL: the two or
 * three columns of the file. The units of the columns are those of the header. */
bool kt_read_csv_lookup(kt_reader *r, const kt_scope *scope, kt_node *file, const char *const names[3], int *inputs,
                        const double **rows, int *count);

#endif
