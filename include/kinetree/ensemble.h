/* Experimental. Ensembles: several simulations of similar models at once, one in each lane of the processor's vectors.
 * */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_ENSEMBLE_H
#define KINETREE_ENSEMBLE_H

#include "kinetree/simulation.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Several simulations that run at once, with the stages of their steps in lanes. Each simulation has its own steps,
 * error control, events and records. Its results have the same bits as kt_simulation_run, independent of the other
 * simulations.
 *
 * Lanes compute trees, and mechanisms whose loops a batch computes in lanes, with effects and auxiliary states. After
 * steps the loops are closed state by state. Methods must be explicit; auto is explicit while the motion is not stiff.
 * Simulations that compute the work done are excluded. Models may differ only in the initial state, gravity, masses,
 * centres of mass, inertias and lengths. All other simulations run one after the other; the report counts them and
 * gives the reason.
 *
 * After each step of a lane, events are sought on its dense output. A step with an event is repeated in lanes up to the
 * event. The steps of a lane are computed separately while the simulation has inputs, or while its model differs from
 * the others. If a simulation ends, its lane takes the next simulation. If records contain only positions, velocities
 * and energies, `data` may be NULL. Only one thread at a time may use an ensemble. */
typedef struct kt_ensemble kt_ensemble;

/* A simulation, and the recorder of its records. */
typedef struct kt_ensemble_member {
    kt_simulation *simulation; /* the simulation; no other code may use it until it has ended */
    kt_recorder *record;       /* recorder of its records */
    void *user;                /* passed to `record` */
} kt_ensemble_member;

/* Writes the next simulation to *member and returns true. Returns false if there is no further simulation. Unless
 * `may_block`, false may also mean that none is available at present: some simulations are still running, and the
 * function is called again later. */
typedef bool kt_ensemble_next(void *user, bool may_block, kt_ensemble_member *member);

/* Called when a simulation has ended as kt_simulation_run would end, with its status, and its error or NULL. The
 * ensemble no longer uses the simulation. */
typedef void kt_ensemble_done(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error);

/* Returns the number of bytes of an ensemble for simulations of models like this one; 0 for NULL. */
KT_API size_t kt_ensemble_size(const kt_model *model);

/* Initialises an ensemble in the caller's memory, at KT_ALIGNMENT. The model need not outlive the ensemble.
 * Errors: KT_ERROR_MEMORY if the memory is too small or misaligned. */
KT_API KT_CHECKED kt_status kt_ensemble_init(const kt_model *model, void *memory, size_t size, kt_ensemble **ensemble,
                                             kt_error *error);

/* Initialises an ensemble like kt_ensemble_init, in memory that the function allocates.
 * Ownership: the caller releases the ensemble with kt_ensemble_free. */
KT_API KT_CHECKED kt_status kt_ensemble_create(const kt_model *model, kt_ensemble **ensemble, kt_error *error);
/* Releases an ensemble that kt_ensemble_create made; does nothing with an ensemble in the caller's memory, nor with
 * NULL. */
KT_API void kt_ensemble_free(kt_ensemble *ensemble);

/* Runs all simulations that `next` supplies, each as kt_simulation_run from its present time to its duration. Each
 * simulation that has ended is passed to `done`.
 * Errors: those of simulations are passed to `done`. KT_ERROR_ARGUMENT if a pointer is NULL. */
KT_API KT_CHECKED kt_status kt_ensemble_run(kt_ensemble *ensemble, kt_ensemble_next *next, kt_ensemble_done *done,
                                            void *user, kt_error *error);

/* Report of the simulations of an ensemble since its initialisation. */
typedef struct kt_ensemble_report {
    size_t width;      /* number of lanes; 1: the models are computed one by one */
    uint64_t together; /* simulations in lanes */
    uint64_t alone;    /* simulations one after the other */
    const char *why;   /* reason of the last simulation that ran alone, or NULL; static storage */
    uint64_t in_lanes; /* attempted steps of simulations in lanes that were computed together */
    uint64_t left;     /* attempted steps of simulations in lanes that were computed separately: implicit methods,
                    * inputs, failures, or no other lane to share */
} kt_ensemble_report;

/* Returns the report of an ensemble; zeros for NULL. */
KT_API kt_ensemble_report kt_ensemble_report_of(const kt_ensemble *ensemble);

#ifdef __cplusplus
}
#endif
#endif
