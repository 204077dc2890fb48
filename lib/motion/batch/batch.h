/* The memory of many states (batch.c), and a group of them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BATCH_BATCH_H
#define KT_BATCH_BATCH_H

#include "batch/lanes.h"
#include "integrator/integrator.h"
#include "kinetree/batch.h"
#include "model/model.h"

/* Numbers that the groups and a workspace take; nx auxiliary states, N = nq + nv + nx. */
typedef struct kt_batch_counts {
    size_t states, groups, width, stages, threads;
    size_t nq, nv, nx, N, body, loops;
    size_t lane_bytes, data_bytes, work_bytes;
} kt_batch_counts;

/* Every array of a workspace, in which one thread computes one group. */
#define KT_BATCH_WORK_FIELDS(X)                                                                                        \
    X(double, result, n->width * n->nv, "accelerations or forces of a group")                                          \
    X(double, total, n->width * n->nv, "joint forces of a group with those of effects")                                \
    X(double, wrench, n->width * 6 * n->body, "wrenches on bodies of a group")                                         \
    X(double, stage, n->width * n->N, "the state of a stage")                                                          \
    X(double, slope, n->width * n->N * n->stages, "slopes of the stages")                                              \
    X(double, moved, kt_where(n->loops, n->width *(n->nq + n->nv)), "the state of a stage, its loops being closed")    \
    X(double, one_q, kt_lanes8(n->nq), "positions of one state")                                                       \
    X(double, one_v, kt_lanes8(n->nv), "velocities of one state")                                                      \
    X(double, one_tau, kt_lanes8(n->nv), "joint forces of one state")                                                  \
    X(double, one_a, kt_lanes8(n->nv + n->nq), "accelerations, or rates, of one state")                                \
    X(char, lanes, n->lane_bytes, "workspace of the recursions in lanes")                                              \
    X(char, alone, n->data_bytes, "data of one state")

typedef struct kt_batch_work {
    kt_batch *batch;
    kt_data *data;                          /* data of one state */
    uint64_t in_lanes, alone_count, failed; /* as in kt_batch_report */
    const kt_model *put;                    /* model whose numbers all lanes have, NULL if they differ; its revision */
    uint64_t revision;
    KT_ARENA_DECLARE(KT_BATCH_WORK_FIELDS)
} kt_batch_work;

/* Every array of a batch: the arrays of all groups, group by group, and the workspaces. */
#define KT_BATCH_FIELDS(X)                                                                                             \
    X(double, t, n->groups * n->width, "time of each state")                                                           \
    X(double, y, n->groups * n->width * n->N, "positions, then velocities, then auxiliary states")                     \
    X(double, tau, n->groups * n->width * n->nv, "joint forces")                                                       \
    X(double, a, n->groups * n->width * n->nv, "accelerations")                                                        \
    X(const kt_model *, own, n->groups * n->width,                                                                     \
      "model of each state: the batch's, or a copy with other parameters")                                             \
    X(uint8_t, status, n->groups * n->width, "kt_status of the last computation of each state")                        \
    X(char, work, n->threads * n->work_bytes, "a kt_batch_work of each thread")

struct kt_batch {
    void *owned; /* memory of kt_batch_create, or NULL */
    const kt_model *model;
    const kt_lane_kernels *kernels; /* NULL: state by state */
    const kt_method *method;        /* NULL: no steps by a table */
    kt_batch_counts n;
    const char *why; /* as in kt_batch_report */
    KT_ARENA_DECLARE(KT_BATCH_FIELDS)
};

static inline kt_batch_work *kt_batch_work_of(const kt_batch *batch, size_t thread) {
    return (kt_batch_work *)(void *)(batch->work + thread * batch->n.work_bytes);
}

/* A group of states at some instant: `used` lanes of width, their times, and numbers that lie x[i * width + lane]. */
typedef struct kt_batch_group {
    size_t first; /* the number of lane 0 among all states */
    size_t used;
    kt_lane_mask active;   /* lanes that are computed: those that have not failed */
    const kt_model *model; /* model of a lane, equal in all lanes but for numbers; NULL: lanes are computed in turn */
    const double *q, *v, *x, *tau;
} kt_batch_group;

/* The error of a call: the error of the state with the least number. */
typedef struct kt_batch_fault {
    kt_status status;
    size_t state;
    kt_error *error;
} kt_batch_fault;

/* Copies the numbers of one lane, n of them. */
static inline void kt_lane_take(const double *group, size_t width, size_t lane, size_t n, double *out) {
    for (size_t i = 0; i < n; i++)
        out[i] = group[i * width + lane];
}
static inline void kt_lane_put(const double *x, size_t width, size_t lane, size_t n, double *group) {
    for (size_t i = 0; i < n; i++)
        group[i * width + lane] = x ? x[i] : 0.0;
}

static inline bool kt_lane_is_in(kt_lane_mask mask, size_t lane) { return (mask >> lane & 1U) != 0; }
static inline kt_lane_mask kt_lanes_first(size_t count) { return (kt_lane_mask)((UINT64_C(1) << count) - 1); }

/* Returns the group with this number, with unchanged states, and writes the numbers of its models to the lanes. */
kt_batch_group kt_batch_group_of(kt_batch_work *w, size_t group);

/* Excludes a lane whose computation has failed from later computations. Records the error `made` of the call for one
 * state. */
void kt_batch_fail(kt_batch_work *w, kt_batch_group *group, size_t lane, const kt_error *made, kt_batch_fault *fault);

/* Copies the numbers of one lane to w->one_q, one_v and one_tau, and its auxiliary states to the data. */
void kt_batch_take(kt_batch_work *w, const kt_batch_group *group, size_t lane);

/* Memory for the accelerations of a group: the workspace of the recursions, forces that include effects, and the
 * result. The joint forces are `total`. The wrenches are needed if links carry forces. */
typedef struct kt_lane_work {
    void *lanes;
    double *total, *wrench, *a;
} kt_lane_work;

/* Forward dynamics with effects for the lanes that have not failed. Returns the lanes with a result. */
kt_lane_mask kt_lanes_accelerate(const kt_lane_kernels *kernels, const kt_model *model, const kt_lane_state *at,
                                 const kt_lane_work *work);

/* The kernels for the instruction set of a model; NULL: the model has loops that lanes do not support. */
const kt_lane_kernels *kt_lane_kernels_of(const kt_model *model);

/* Computes the accelerations of the active lanes of a group, of which lane l is at the time t[l], into w->result. Lanes
 * that fail are removed from group->active. */
void kt_batch_accelerate(kt_batch_work *w, kt_batch_group *group, const double *t, kt_batch_fault *fault);

/* Computes the joint forces of the active lanes by inverse dynamics of the tree, into w->result, likewise. */
void kt_batch_invert(kt_batch_work *w, kt_batch_group *group, kt_batch_fault *fault);

/* Evaluates the sensors of the active lanes of a group (sense.c). The second call checks the sensors of a job. */
void kt_batch_sense_group(kt_batch_work *w, kt_batch_group *group, const kt_batch_sensors *sensors,
                          kt_batch_fault *fault);
kt_status kt_batch_check_sensors(const kt_batch *batch, const kt_batch_sensors *sensors, kt_error *error);

/* Steps of a group (lane_explicit.c), by the group's explicit method, or by semi-implicit steps. */
void kt_batch_advance(kt_batch_work *w, kt_batch_group *group, const kt_batch_job *job, kt_batch_fault *fault);

/* Checks the numbers of a job. Returns KT_OK, or the error. */
kt_status kt_batch_check_step(const kt_batch *batch, const kt_batch_job *job, kt_error *error);

#endif
