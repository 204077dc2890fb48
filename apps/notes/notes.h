/* The exercises of Masarati's notes on multibody dynamics [MSD], computed: declarations that the files share. The page
 * include/pages/notes.md states the problems. Each line of the output is the number of an exercise and its figure. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_NOTES_H
#define KT_NOTES_H

#include <kinetree/kinetree.h>
#include <kinetree/scene.h>
#include <kinetree/study.h>

/* Prints a figure. */
void tell(const char *exercise, double figure);

/* A number in -1 to 1, the same ones in every run. */
double any(void);
kt_vec3 any_vector(void);
kt_mat3 any_rotation(void);

double size_of(kt_vec3 a);
double difference(kt_mat3 a, kt_mat3 b); /* the largest of an entry */

/* A scene by its text, at its assembled start. */
typedef struct mechanism {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    double q[32], v[32];
} mechanism;

/* Opens a scene. If it cannot be computed, prints the error and returns false. */
bool open_mechanism(mechanism *m, const char *text);
void close_mechanism(mechanism *m);
bool works(kt_status status, const kt_error *error);

/* The chapters; false if something failed. */
bool rotations(void);   /* 2 and A */
bool dynamics(void);    /* 3 and 4 */
bool integration(void); /* 5 */
bool constraints(void); /* 6 */
bool coordinates(void); /* 7 to 9 */

#endif
