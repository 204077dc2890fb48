/* Small mechanisms with motions in closed form, and a recorder that keeps its records. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_SCENES_H
#define KT_TEST_SIMULATION_SCENES_H

#include "fixture.h"

#include "kinetree/simulation.h"

/* One body on a joint of this type, without gravity. The axis is z (prismatic: x), and the centre of mass is the
 * joint's origin. The inertia is diag(1, 2, 3). The caller's to change before kt_scene_compile. */
typedef struct kt_lone {
    kt_body body;
    kt_description description;
} kt_lone;

void kt_lone_make(kt_lone *lone, kt_joint_type type, double mass);

/* A point mass of 1 kg hangs along -y on a massless link of 1 m, from a revolute joint about z. Gravity is 9.81 along
 * -y. */
void kt_pendulum_make(kt_lone *lone, double angle, double velocity);

/* A model with the options of the library (fixture.h). */
kt_model *kt_scene_compile(const kt_description *description);
/* A run of 100 s with a method, a fixed step or adaptive ones (0), and records. kt_scene_start takes the tolerance
 * kt_scene_tolerance_of(method): 1e-13 for dop853, else 1e-10. */
kt_simulation *kt_scene_start(const kt_model *model, const char *method, double step, unsigned record);
kt_simulation *kt_scene_start_within(const kt_model *model, const char *method, double step, double tolerance,
                                     unsigned record);
double kt_scene_tolerance_of(const char *method);

/* Checks that a description does not compile, and the words of its fault. */
void kt_scene_check_rejected(const char *what, const kt_description *description, const char *words);

/* The largest drift of the energy balance over all records, and the last record's works. */
typedef struct kt_ledger {
    double start, drift;
    kt_work last;
    int count;
} kt_ledger;

/* A recorder whose user is a kt_ledger. */
int kt_ledger_enter(const kt_record *record, void *user);

/* The energy plus dissipated minus supplied work. */
double kt_scene_balance(kt_simulation *simulation);

/* Fixed steps of this method, and its adaptive ones within a tolerance. */
kt_run kt_run_fixed(const char *integrator, double step, double duration);
kt_run kt_run_within(const char *integrator, double tolerance, double duration);

/* Checks that two simulations of a model have equal bits: positions, velocities and auxiliary states. */
bool kt_scene_check_equal(const char *what, const kt_simulation *observed, const kt_simulation *expected);

/* ---- records ----------------------------------------------------------------------------------------------------- */

enum { KT_KEPT_RECORDS = 4096, KT_KEPT_NUMBERS = 64 };

typedef struct kt_kept {
    int count;
    int stop_at; /* returns -1 at the record of this index; -1: never */
    int nq, nv, nx;
    double time[KT_KEPT_RECORDS];
    int64_t index[KT_KEPT_RECORDS];
    double state[KT_KEPT_RECORDS][KT_KEPT_NUMBERS]; /* q, v, a where there is one, and auxiliary states */
    double energy[KT_KEPT_RECORDS];                 /* NaN where it is not recorded */
} kt_kept;

/* Static storage, emptied; there is one. */
kt_kept *kt_kept_empty(const kt_model *model);
int kt_keep(const kt_record *record, void *user); /* user: a kt_kept */

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* Restores a checkpoint of one simulation in another one, whose checkpoint must then have the same bytes. Returns false
 * after a failed check. */
bool kt_scene_hand_over(const kt_simulation *from, kt_simulation *to);

/* Runs that go on from a checkpoint. All but the model may be NULL: positions and velocities at the start, and torques
 * and wrenches from there on. */
typedef struct kt_resumption {
    const kt_model *model;
    const kt_run *run;
    const kt_simulation_options *options;
    const double *q, *v, *torque;
    const kt_wrench *external;
} kt_resumption;

/* Starts a simulation of it. */
kt_simulation *kt_resumption_start(const kt_resumption *r);

/* Checks that a run which stops at record `stop`, and goes on in another simulation, has the same records to the bit as
 * a whole run. Returns the number of records. */
int kt_resumption_check(const kt_resumption *r, int stop);

#endif
