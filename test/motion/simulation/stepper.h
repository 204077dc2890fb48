/* Moreau's time-stepping of a free body on points, for tests of hard contacts with friction. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TEST_SIMULATION_STEPPER_H
#define TEST_SIMULATION_STEPPER_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { STEPPER_POINTS = 5 };

/* A free body whose com is its origin, in world axes, by Moreau's time-stepping. Positions and contacts are those at
 * mid-step. Then velocities follow, with the impulses of all contacts that are closed there. Sweeps of Gauss and Seidel
 * find the impulses, a contact at a time, and project them onto Coulomb's disc. It shares nothing with the library. */
typedef struct stepper {
    double x[3], R[9], v[3], w[3]; /* v, w in world axes */
    double m, I, g;                /* a ball of inertia: I the same about all axes */
    double at[STEPPER_POINTS][3];
    int count;
    double friction, restitution;
} stepper;

static inline void stepper_turn(double R[9], const double w[3], double h) {
    const double angle = h * sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double s = angle > 1e-12 ? sin(angle) / angle * h : h,
                 c = angle > 1e-12 ? (1.0 - cos(angle)) / (angle * angle) * h * h : 0.0;
    double next[9];
    for (int column = 0; column < 3; column++) {
        double a[3] = {R[column], R[3 + column], R[6 + column]}, b[3], d[3];
        for (int i = 0; i < 3; i++)
            b[i] = w[(i + 1) % 3] * a[(i + 2) % 3] - w[(i + 2) % 3] * a[(i + 1) % 3];
        for (int i = 0; i < 3; i++)
            d[i] = w[(i + 1) % 3] * b[(i + 2) % 3] - w[(i + 2) % 3] * b[(i + 1) % 3];
        for (int i = 0; i < 3; i++)
            next[3 * i + column] = a[i] + s * b[i] + c * d[i];
    }
    memcpy(R, next, sizeof next);
}

/* One step. For every contact that is closed at mid-step, u is the velocity of its point, and its laws apply to u+ + e
 * u-. */
static inline void stepper_step(stepper *s, double h) {
    double arm[STEPPER_POINTS][3], before[STEPPER_POINTS][3], p[STEPPER_POINTS][3] = {{0.0}};
    bool closed[STEPPER_POINTS];
    for (int i = 0; i < 3; i++)
        s->x[i] += 0.5 * h * s->v[i];
    stepper_turn(s->R, s->w, 0.5 * h);
    for (int k = 0; k < s->count; k++) {
        for (int i = 0; i < 3; i++)
            arm[k][i] = s->R[3 * i] * s->at[k][0] + s->R[3 * i + 1] * s->at[k][1] + s->R[3 * i + 2] * s->at[k][2];
        for (int i = 0; i < 3; i++)
            before[k][i] = s->v[i] + s->w[(i + 1) % 3] * arm[k][(i + 2) % 3] - s->w[(i + 2) % 3] * arm[k][(i + 1) % 3];
        closed[k] = s->x[2] + arm[k][2] <= 0.0;
    }
    s->v[2] -= h * s->g;
    for (int sweep = 0; sweep < 200; sweep++)
        for (int k = 0; k < s->count; k++) {
            const double *r = arm[k], rate = 1.0 / s->m + (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) / s->I;
            double u[3], old[3], to[3];
            if (!closed[k])
                continue;
            for (int i = 0; i < 3; i++)
                u[i] = s->v[i] + s->w[(i + 1) % 3] * r[(i + 2) % 3] - s->w[(i + 2) % 3] * r[(i + 1) % 3];
            memcpy(old, p[k], sizeof old);
            to[2] = fmax(0.0, old[2] - (u[2] + s->restitution * fmin(before[k][2], 0.0)) / rate);
            to[0] = old[0] - u[0] / rate;
            to[1] = old[1] - u[1] / rate;
            const double size = hypot(to[0], to[1]), most = s->friction * to[2];
            for (int i = 0; i < 2 && size > most; i++)
                to[i] *= most / size;
            for (int i = 0; i < 3; i++) {
                const double d[3] = {to[0] - old[0], to[1] - old[1], to[2] - old[2]};
                s->v[i] += d[i] / s->m;
                s->w[i] += (r[(i + 1) % 3] * d[(i + 2) % 3] - r[(i + 2) % 3] * d[(i + 1) % 3]) / s->I;
            }
            memcpy(p[k], to, sizeof to);
        }
    for (int i = 0; i < 3; i++)
        s->x[i] += 0.5 * h * s->v[i];
    stepper_turn(s->R, s->w, 0.5 * h);
}

#endif
