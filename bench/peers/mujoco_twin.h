/* A mechanism in MuJoCo. Its tree is written as nested bodies, placed at their start, so that all joints start at
 * zero. Body i of the description has the name bi, and its joint the name ji. Its loops are `connect` constraints,
 * one for a point. A hinge that is not in the plane has a second one, 1 m along the axis. Constraints, which are soft
 * by design, have the advised stiffness, with a time constant of two steps. The ground has geoms with MuJoCo's
 * defaults. The integrator is a Runge-Kutta method of order 4. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PEERS_MUJOCO_TWIN_H
#define KT_BENCH_PEERS_MUJOCO_TWIN_H

#include "twin.h"

#include <mujoco/mujoco.h>
#include <stddef.h>

/* Writes MJCF, which is released with free; NULL without memory. */
char *kt_mujoco_twin_write(const kt_twin *twin, double step, size_t *size);

/* Writes the velocities v of a model into those of its twin. They are the same numbers: a ball's in its own axes, and
 * those of a free body's place in the world's. */
void kt_mujoco_twin_rates(const kt_model *model, const double *v, const mjModel *m, mjData *d);

/* Finds the poses and twists of the bodies. */
void kt_mujoco_twin_read(const mjModel *m, mjData *d, const kt_twin *to);

enum { KT_MUJOCO_REASON = 300 };

/* The model of an MJCF in memory, which is freed; NULL and MuJoCo's words where there is no text, or it is rejected. */
mjModel *kt_mujoco_read(char *text, size_t size, char reason[KT_MUJOCO_REASON]);

/* The same of a scene that includes "part.xml" (NULL: does not): MuJoCo's parser nests no more than a hundred elements
 * in one file. */
typedef struct kt_mujoco_text {
    char *text;
    size_t size;
} kt_mujoco_text;
mjModel *kt_mujoco_read_parts(kt_mujoco_text *scene, kt_mujoco_text *part, char reason[KT_MUJOCO_REASON]);

#endif
