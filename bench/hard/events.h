/* Motions with impacts, stick and slip, in this engine and in others: the error against the closed form, and the time. */
#ifndef KT_BENCH_HARD_EVENTS_H
#define KT_BENCH_HARD_EVENTS_H

#include <stdbool.h>

enum { KT_EVENTS_WORDS = 40 };

typedef enum kt_events_case { KT_EVENTS_CREEP, KT_EVENTS_BOUNCE, KT_EVENTS_BELT, KT_EVENTS_COUNT } kt_events_case;

/* One mass on a plane z = 0. A block (half sides 0.1, 0.1, 0.05 m, its centre 0.05 m high) under gravity that is tilted towards x,
 * with friction, and perhaps on a spring along x whose other end moves at -`belt`, as seen from a belt; or a ball. */
typedef struct kt_events_problem {
    const char *name, *measured;
    double bound, duration, step;     /* of the error, m; s; s, of the engines with fixed steps */
    double mass, gravity, tilt;       /* kg, m/s^2, rad */
    double friction;                  /* mu */
    double stiffness, belt;           /* N/m, m/s */
    double restitution, drop, radius; /* of the ball, m, m */
} kt_events_problem;

/* What is watched every millisecond: x of the block, from where it was put, or the height of the ball above the plane. */
typedef struct kt_events_watch {
    const kt_events_problem *problem;
    kt_events_case which;
    double error, seconds; /* the largest, m; processor time of the motion */
    char words[KT_EVENTS_WORDS];
} kt_events_watch;

void kt_events_see(kt_events_watch *watch, double t, double x);

/* Processor time of this process, s. */
double kt_events_clock(void);

/* False where the engine is not here, or gave up; then with words. */
typedef bool kt_events_engine(kt_events_watch *watch);
kt_events_engine kt_events_kinetree, kt_events_mujoco, kt_events_ode;

#endif
