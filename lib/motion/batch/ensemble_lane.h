/* The lanes of an ensemble: the part of each simulation that lanes hold (ensemble.c), and its records
 * (ensemble_records.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BATCH_ENSEMBLE_LANE_H
#define KT_BATCH_ENSEMBLE_LANE_H

#include "batch/batch.h"
#include "integrator/integrator.h"
#include "kinetree/ensemble.h"
#include "simulation/simulation.h"

typedef struct kt_ensemble_counts {
    size_t width, nq, nv, nx, N, body, lane_bytes; /* nx auxiliary states, N = nq + nv + nx */
} kt_ensemble_counts;

/* A simulation that runs. */
typedef struct kt_ensemble_lane {
    kt_ensemble_member member; /* without a simulation: none runs here */
    uint64_t revision;         /* revision of the member's model, whose numbers the lane has */
    uint64_t begun;            /* the model's when the simulation began */
    kt_attempt attempt;
    kt_try tried;
    bool steps; /* within a step */
    kt_step_progress progress;
    bool shares;      /* the simulation's records are computed in lanes, too */
    bool holds;       /* the lanes hold the last try of its step: stages and states at both ends */
    kt_record record; /* the next one, where it shares them */
    kt_status status; /* status of records that were handed over */
    kt_error error;
} kt_ensemble_lane;

#define KT_ENSEMBLE_FIELDS(X)                                                                                          \
    X(kt_ensemble_lane, lane, n->width, "simulations")                                                                 \
    X(double, t, n->width, "times of a stage")                                                                         \
    X(double, h, n->width, "lengths of steps")                                                                         \
    X(double, y, n->width * n->N, "states in which steps begin")                                                       \
    X(double, stage, n->width * n->N, "states of a stage")                                                             \
    X(double, stages, n->width * n->N * KT_METHOD_STAGES_MAX, "slopes of all stages")                                  \
    X(double *, k, KT_METHOD_STAGES_MAX, "slope i of all lanes")                                                       \
    X(double, tau, n->width * n->nv, "joint forces: none")                                                             \
    X(double, total, n->width * n->nv, "joint forces of effects")                                                      \
    X(double, wrench, n->width * 6 * n->body, "wrenches of effects")                                                   \
    X(double, absolute, n->width, "absolute tolerances")                                                               \
    X(double, relative, n->width, "relative tolerances")                                                               \
    X(double, norm, 2 * n->width, "mean squares of the error, and of the second estimate")                             \
    X(double, base, 2 * n->width, "errors of this step and of the one before, of which powers are taken")              \
    X(double, exponent, 2 * n->width, "their exponents")                                                               \
    X(double, power, 2 * n->width, "the powers")                                                                       \
    X(double, theta, n->width, "times of records over the step: 0 to 1")                                               \
    X(double, read, n->width * n->N, "states of records")                                                              \
    X(double, one, n->N, "the state of one record")                                                                    \
    X(double, energy, 2 * n->width, "kinetic, then potential")                                                         \
    X(char, work, n->lane_bytes, "workspace of the recursions")

struct kt_ensemble {
    void *owned; /* memory of kt_ensemble_create, or NULL */
    const kt_lane_kernels *kernels;
    uint64_t shape; /* kt_model.shape of the models */
    kt_ensemble_counts n;
    kt_ensemble_report report;
    const kt_method *table; /* method of the last try in lanes */
    kt_error from;          /* error of a call; its text is arbitrary where the call has succeeded */
    KT_ARENA_DECLARE(KT_ENSEMBLE_FIELDS)
};

/* Whether the lane has the numbers of its model, whose parameters a recorder may have set since. */
static inline bool kt_ensemble_is_current(const kt_ensemble_lane *l) {
    return l->revision == l->member.simulation->model->revision;
}

/* Returns the first lane that has the numbers of its model. */
static inline const kt_ensemble_lane *kt_ensemble_first_lane(const kt_ensemble *e) {
    for (size_t i = 0; i < e->n.width; i++)
        if (e->lane[i].member.simulation && kt_ensemble_is_current(&e->lane[i]))
            return &e->lane[i];
    return NULL;
}

static inline void kt_ensemble_clear(kt_error *from) {
    from->code = KT_OK;
    from->where[0] = from->message[0] = '\0';
}

/* Whether records of a simulation hold no more than states and energies of bodies. */
bool kt_ensemble_shares_records(const kt_simulation *s);

/* Whether the records of a lane are computed together with records of other lanes. */
bool kt_ensemble_shares_now(const kt_ensemble_lane *l);

/* Hands over the records of all lanes up to the present, one of each lane at a time. */
void kt_ensemble_give_records(kt_ensemble *e);

#endif
