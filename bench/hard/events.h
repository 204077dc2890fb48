/* Motions with impacts, stick and slip, in this engine and in others: the error against the closed form, and the
 * time. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_EVENTS_H
#define KT_BENCH_HARD_EVENTS_H

#include "kinetree/scene.h"

#include <stdbool.h>

enum { KT_EVENTS_WORDS = 40, KT_EVENTS_BODIES = 5, KT_EVENTS_COUNT = 9, KT_EVENTS_ENGINES = 3, KT_EVENTS_STATES = 8 };

/* Axes along which bodies move and contacts press. Nothing leaves the plane of x and z. */
typedef enum kt_events_axis { KT_EVENTS_X, KT_EVENTS_Z, KT_EVENTS_AXES } kt_events_axis;

typedef enum kt_events_shape { KT_EVENTS_BLOCK, KT_EVENTS_BALL } kt_events_shape;

/* A body on slides along those axes along which it is free; it may turn about y as well. */
typedef struct kt_events_body {
    kt_events_shape shape;
    double half[KT_EVENTS_AXES]; /* half sides, m; of a ball both are its radius */
    double at[KT_EVENTS_AXES];   /* its centre at the start, m */
    bool is_free[KT_EVENTS_AXES], turns;
    double lean;              /* of one that turns, from z towards x at the start, rad */
    double mass, speed, push; /* kg; along x at the start, m/s; a constant force along x, N */
} kt_events_body;

/* `upper` stays on the positive side of `lower` along the axis. Engines that look for contacts themselves need only the
 * planes. */
typedef struct kt_events_contact {
    int lower, upper; /* bodies; a lower one of -1 is the plane through the origin */
    kt_events_axis axis;
} kt_events_contact;

typedef struct kt_events_watch kt_events_watch;

/* False where the engine is not here, or gave up; then with words. */
typedef bool kt_events_engine(kt_events_watch *watch);
kt_events_engine kt_events_kinetree, kt_events_mujoco, kt_events_ode;

/* Bodies in the plane of x and z, and their contacts, which all have the same friction and restitution. The first body
 * may be on a spring along x, whose other end moves at -`belt`, as seen from a belt. Or it may be on a rope whose other
 * end is the origin. */
typedef struct kt_events_problem kt_events_problem;
struct kt_events_problem {
    const char *name, *measured;
    kt_events_engine *engine[KT_EVENTS_ENGINES]; /* of NULL, the one that builds these bodies and contacts */
    double bound, duration, step;                /* of the error; s; s, of the engines with fixed steps */
    double tolerance;                            /* of this engine's steps; 0: 1e-10 */
    double gravity, tilt;                        /* m/s^2, rad: from -z towards x */
    double friction, restitution;                /* mu, e */
    double stiffness, belt;                      /* N/m, m/s */
    double rope;                                 /* its length, m */
    int body_count, contact_count;
    kt_events_body body[KT_EVENTS_BODIES];
    kt_events_contact contact[KT_EVENTS_BODIES];
    kt_events_axis axis;                                             /* of the measured coordinate: */
    double (*exact)(const kt_events_problem *p, int body, double t); /* where its centre is, m */
};

extern const kt_events_problem kt_events_problems[KT_EVENTS_COUNT];

/* Motions of mechanisms that each engine describes by itself, in sources of their own. */
extern const kt_events_problem kt_events_clutch, kt_events_coin, kt_events_trebuchet, kt_events_whip,
    kt_events_woodpecker;
kt_events_engine kt_events_clutch_mujoco, kt_events_clutch_ode;
kt_events_engine kt_events_coin_mujoco, kt_events_coin_ode;
kt_events_engine kt_events_trebuchet_mujoco, kt_events_trebuchet_ode;
kt_events_engine kt_events_whip_mujoco, kt_events_whip_ode;
kt_events_engine kt_events_woodpecker_mujoco, kt_events_woodpecker_ode;

/* The quantities watched every millisecond: the centres of all bodies along one axis, or numbers of a mechanism. */
struct kt_events_watch {
    const kt_events_problem *problem;
    double error, seconds; /* the largest; processor time of the motion */
    bool is_seen;          /* something was */
    char words[KT_EVENTS_WORDS];
};

/* Records the position at t of the centre of a body along the problem's axis, or a number of a mechanism. */
void kt_events_see(kt_events_watch *watch, int body, double t, double at);

/* The force of the spring on the first body where that is at x, N. */
double kt_events_pull(const kt_events_problem *p, double x, double t);

/* Processor time of this process, s. */
double kt_events_clock(void);

/* A step of an integration of a motion's own equations, y' = rate(y), by RK4 in place; n <= KT_EVENTS_STATES. */
typedef void kt_events_rate(const double y[], double rate[]);
void kt_events_step(kt_events_rate *rate, int n, double y[], double h);

/* Runs a scene with its events in this engine, by dopri5 for the problem's duration, with a record each millisecond,
 * which `see` takes with `user`. */
bool kt_events_run(kt_events_watch *watch, const kt_scene *scene, kt_recorder *see, void *user);

/* Does the same with a scene's text, named after the problem. */
bool kt_events_run_text(kt_events_watch *watch, const char *text, kt_recorder *see, void *user);

#endif
