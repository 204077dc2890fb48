/* A bundled scene, read from its file and run with its own or other settings, and compared with reference results. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REFERENCE_SCENE_H
#define KT_TEST_REFERENCE_SCENE_H

#include "fixture.h"

#include "kinetree/scene.h"

typedef struct kt_case {
    const char *name;
    kt_scene scene;
    kt_model *model;
} kt_case;

/* apps/scenes/NAME.yaml, read and compiled, for the running test (see fixture.h). */
kt_case kt_case_open(const char *name);

/* The first position (velocity) of a joint; a failed check and 0 where there is none of that name. */
int kt_case_q(const kt_case *c, const char *joint);
int kt_case_v(const kt_case *c, const char *joint);

/* How to run, and the error that is allowed. The scene's own settings where there is no integrator. */
typedef struct kt_setting {
    const char *integrator;
    double step, tolerance; /* one of them is 0 */
    double bound;
} kt_setting;

/* "dop853 1e-12", "rk4 h=0.01"; static storage, overwritten by the next call but three. */
const char *kt_setting_text(const kt_case *c, const kt_setting *setting);

/* Runs with records every `interval` seconds (0: those of the scene) and energies and kinematics in each of them. */
bool kt_case_run(const kt_case *c, const kt_setting *setting, double interval, kt_recorder *record, void *user);

/* The error of a record, not negative: the distance to the reference result at this time. */
typedef double kt_error_of(const kt_case *c, const kt_record *record, const void *about);

/* Checks the error of every record of a scene, for each of the settings. */
void kt_scene_follow(const char *scene, const kt_setting *settings, size_t count, kt_error_of *error_of,
                     const void *about);
void kt_case_follow(const kt_case *c, const kt_setting *settings, size_t count, kt_error_of *error_of,
                    const void *about);

/* The error of the last record with a step h and with h / 2: its order, to 0.2. */
void kt_case_order(const kt_case *c, const char *integrator, double step, double order, kt_error_of *error_of,
                   const void *about);

/* ---- what stays -------------------------------------------------------------------------------------------------- */

enum { KT_INVARIANTS_MAX = 8 };

/* Writes numbers that do not change during the motion, at most KT_INVARIANTS_MAX, and returns how many. */
typedef int kt_invariants(const kt_case *c, const kt_record *record, double *out);

/* Checks these numbers for each of the settings. They must differ from those of the first record by less than the bound
 * times `scale`, one scale for each. */
void kt_case_conserve(const kt_case *c, const kt_setting *settings, size_t count, kt_invariants *invariants,
                      const char *const *names, const double *scale);

/* Total energy, the one invariant, with its scale 1. */
void kt_case_conserve_energy(const kt_case *c, const kt_setting *settings, size_t count);

/* The largest difference between two runs in any coordinate, rotations as Euler vectors, over all records. */
void kt_case_agree(const kt_case *c, const kt_setting *a, const kt_setting *b, double bound);

/* ---- tables ------------------------------------------------------------------------------------------------------ */

/* A reference in data/NAME.json: rows of `columns` numbers at times t. */
typedef struct kt_table {
    size_t rows, columns;
    double *t, *value;
} kt_table;

/* `columns` are the names that the file must have, in order, separated by spaces. For the running test. */
kt_table kt_table_open(const char *name, const char *columns);

/* Checks the distance to every row of the table, for each of the settings; about points to the row (columns numbers).
 * If the settings are not the scene's own, records come at the table's times. */
void kt_case_compare(const kt_case *c, const kt_table *table, const kt_setting *settings, size_t count,
                     kt_error_of *error_of);

/* An angle given in degrees, in radians. */
double kt_degrees(double degrees);

/* The angle of the rotation between two orientations; signs and norms of quaternions do not matter. */
double kt_angle_between(kt_quat a, kt_quat b);

#endif
