/* A clutch of dry friction in each engine. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_CLUTCH_H
#define KT_BENCH_HARD_CLUTCH_H

/* A motor (0) and a load (1) turn about the x axis; the load rests at the start. */
typedef struct kt_clutch {
    double mass[2], inertia[2], speed; /* kg; kg m^2; of the motor at the start, rad/s */
    double coulomb, breakaway;         /* C, S, N m */
    double stribeck;                   /* vs, rad/s */
} kt_clutch;

extern const kt_clutch kt_clutch_data;

/* The torque on the motor from t on, until it changes, N m. */
double kt_clutch_push(double t);

/* The torque in N m that the plates transmit at a slip: C + (S - C) exp(-(slip / vs)^2). At slip 0 this is the largest
 * torque of plates that stick. */
double kt_clutch_friction(double slip);

#endif
