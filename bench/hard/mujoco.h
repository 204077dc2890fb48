/* Functions for MuJoCo that the parts of bench/run hard share. */
#ifndef KT_BENCH_HARD_MUJOCO_H
#define KT_BENCH_HARD_MUJOCO_H

#include "events.h"

#include <mujoco/mujoco.h>
#include <stddef.h>
#include <stdio.h>

enum { KT_MUJOCO_REASON = 300 };

/* The model of an MJCF in memory, which is freed; NULL and MuJoCo's words where there is no text, or it is refused. */
mjModel *kt_mujoco_read(char *text, size_t size, char reason[KT_MUJOCO_REASON]);

/* The same of a scene that includes "part.xml" (NULL: does not): MuJoCo's parser nests no more than a hundred elements
 * in one file. */
typedef struct kt_mujoco_text {
    char *text;
    size_t size;
} kt_mujoco_text;
mjModel *kt_mujoco_read_parts(kt_mujoco_text *scene, kt_mujoco_text *part, char reason[KT_MUJOCO_REASON]);

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
