/* How well steps keep the energy of a mechanism that cannot lose any. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_BOOK_ENERGY_H
#define KT_BENCH_BOOK_ENERGY_H

#include <stdbool.h>

/* Energies along a run. The error is the largest change of the total energy over the largest kinetic energy. */
typedef struct energy_watch {
    bool begun;
    double start, change, kinetic;
} energy_watch;

void energy_watch_add(energy_watch *watch, double kinetic, double potential);

/* Prints a line for each of MuJoCo's integrators; false if it cannot read the file. Without MuJoCo, a comment. */
bool energy_mujoco(const char *mjcf, double duration, double step);

#endif
