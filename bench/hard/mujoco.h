/* Functions for MuJoCo that the parts of bench/run hard share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_MUJOCO_H
#define KT_BENCH_HARD_MUJOCO_H

#include "../peers/mujoco_twin.h"
#include "events.h"

#include <stdio.h>

/* A motion with events; all but `write` and `see` may be NULL. */
typedef struct kt_mujoco_motion {
    void (*write)(FILE *xml, const kt_events_problem *p);                       /* its MJCF */
    void (*begin)(const kt_events_problem *p, const mjModel *m, mjData *d);     /* sets its start; NULL: it rests */
    void (*see)(kt_events_watch *watch, const mjModel *m, mjData *d, double t); /* each millisecond */
    void (*act)(const kt_events_problem *p, mjModel *m, mjData *d, double t);   /* before each step */
    void (*write_part)(FILE *xml);                                              /* what that includes */
} kt_mujoco_motion;

/* Runs it in the problem's steps. */
bool kt_mujoco_run(kt_events_watch *watch, const kt_mujoco_motion *motion);

/* The damping ratio of a contact, as a spring and a damper that do not pull, which gives back e (events_mujoco.c). */
double kt_mujoco_damping(double e);

#endif
