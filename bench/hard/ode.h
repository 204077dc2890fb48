/* Motions with events in ODE. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_ODE_H
#define KT_BENCH_HARD_ODE_H

#include "events.h"

#include <ode/ode.h>

enum { KT_ODE_BODIES = 100 };

typedef struct kt_ode_scene {
    const kt_events_problem *problem;
    dWorldID world;
    dSpaceID space;
    dBodyID body[KT_ODE_BODIES];
    dJointID joint;         /* one that changes during the motion */
    dJointGroupID contacts; /* of a step */
} kt_ode_scene;

typedef struct kt_ode_motion {
    void (*build)(kt_ode_scene *s);
    void (*see)(kt_events_watch *watch, const kt_ode_scene *s, double t); /* each millisecond */
    void (*act)(kt_ode_scene *s, double t);                               /* before each step */
    void (*touch)(const kt_ode_scene *s,
                  dSurfaceParameters *surface); /* the surface between two bodies that touch; NULL: none do */
} kt_ode_motion;

/* Runs it by dWorldStep, in the problem's steps. */
bool kt_ode_run(kt_events_watch *watch, const kt_ode_motion *motion);

#endif
