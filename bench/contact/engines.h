/* Motions with hard contacts, in this engine and in others. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_CONTACT_ENGINES_H
#define KT_BENCH_CONTACT_ENGINES_H

#include "../peers/twin.h"
#include "mechanisms.h"

enum { KT_CONTACT_SETTINGS = 3, KT_CONTACT_WORDS = 60, KT_CONTACT_COORDINATES = 8 * KT_MECHANISM_BODIES };

/* Joints of motions with a stiffness hold their start with tau = -k (q - q0) - d v. Torques are constant for an
 * interval. Poses are recorded after each interval. */
typedef struct kt_contact_motion {
    const char *name, *measured;
    void (*make)(kt_contact_mechanism *m);
    double duration, interval;        /* s */
    double stiffness, damping;        /* N m, N m s */
    double step[KT_CONTACT_SETTINGS]; /* of engines with fixed steps, s */
} kt_contact_motion;

/* A run of a motion. The twin has the poses of the bodies: at the start, and then after each interval. */
typedef struct kt_contact_run {
    const kt_contact_motion *motion;
    const kt_model *model;
    kt_twin twin;
    double setting; /* a step, s, or a tolerance */
    void *own;      /* data of the engine */
    char words[KT_CONTACT_WORDS];
} kt_contact_run;

/* An engine with one of its methods. The functions return false after a failure, with words. `close` takes a failed
 * `open`, too. */
typedef struct kt_contact_engine {
    const char *name;
    bool has_tolerance;
    bool (*open)(kt_contact_run *run);
    bool (*move)(kt_contact_run *run); /* an interval */
    bool (*look)(kt_contact_run *run);
    void (*close)(kt_contact_run *run);
} kt_contact_engine;

extern const kt_contact_engine kt_contact_events, kt_contact_steps;
extern const kt_contact_engine kt_contact_mujoco, kt_contact_mujoco_stiff;
extern const kt_contact_engine kt_contact_ode, kt_contact_ode_quick;

/* Writes the words, and returns false. */
bool kt_contact_fail(kt_contact_run *run, const char *words);

/* Steps of an interval. */
long kt_contact_steps_of(const kt_contact_run *run);

#endif
