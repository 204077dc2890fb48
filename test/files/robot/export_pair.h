/* Mechanisms beside their exports, as today's MuJoCo reads them: coordinates of the one by those of the other. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_EXPORT_PAIR_H
#define KT_TEST_ROBOT_EXPORT_PAIR_H

#include "answer.h"

#include "kinetree/export.h"
#include "kinetree/kinetree.h"

enum { LINE = 600 };

/* An export: of which scene, in which format, and what its writer reported. */
typedef struct exported {
    char source[LINE], path[120];
    kt_robot_format format;
    double raised;   /* the largest moment of inertia that was added */
    bool is_changed; /* inertias, as a warning states */
    bool has_screw;  /* a screw has become a hinge and a slide */
    kt_scene scene;
} exported;

/* The mechanism that was written, and their model of the export. */
typedef struct export_pair {
    const exported *file;
    answer theirs;
    kt_model *model;
    kt_data *data;
    double *a, *b;                                               /* A and B, a column for each y */
    double *q, *v, *zero, *tau, *matrix, *left, *right, *forces; /* forces: A' f and B' g */
} export_pair;

/* Whether URDF turns the mechanism, so that its gravity is along -z. */
bool is_turned_upright(const exported *e);

/* Our model, after theirs is described; false after a failed check or with a note. */
bool load_export_pair(export_pair *p);
void release_export_pair(export_pair *p);

/* Sets our state to theirs, A and B. Returns whether all of our coordinates are found in theirs. */
bool map_export_pair(export_pair *p);

#endif
