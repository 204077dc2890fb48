/* Contacts and stops that a step may leap over (gap.c), and their distances (clearance.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_GAP_H
#define KT_SIMULATION_GAP_H

#include "evaluate/gaps.h"
#include "simulation/simulation.h"

/* A gap that is computed only if a step may have reached the boundary. */
typedef struct kt_known_gap {
    kt_gap gap;
    bool known;
} kt_known_gap;

/* Every array: type, name, count, meaning. n effects act on one side of a boundary. */
#define KT_GAP_FIELDS(X)                                                                                               \
    X(double, stop_lower, n, "of stops, as their effects have them")                                                   \
    X(double, stop_upper, n, "likewise")                                                                               \
    X(double, clearance_begin, 2 * n, "at `time`: distances of effects; no less than their speeds")                    \
    X(double, clearance_end, 2 * n, "scratch: where a step ends, likewise")                                            \
    X(kt_gap_source, source, n, "the effects")                                                                         \
    X(kt_known_gap, begin, n, "gaps at `time`, of some")                                                               \
    X(kt_known_gap, end, n, "scratch: where a step ends, of those that it may have reached")                           \
    X(kt_gap, middle, n, "scratch: in its middle")                                                                     \
    X(kt_gap, inside, n, "scratch: anywhere in it")                                                                    \
    X(kt_gap, recorded, n, "scratch: at a record")

typedef struct kt_gaps {
    uint64_t revision; /* revision of the model whose parameters the arrays have */
    double time;       /* time of clearance_begin; NaN: not available */
    bool known;        /* `begin` has valid gaps; else none of its gaps is valid */
    double far_time;   /* the end of the last step, if it can have reached no boundary; else NaN */
    KT_ARENA_DECLARE(KT_GAP_FIELDS)
} kt_gaps;

/* Distances from boundaries (clearance.c). swept: data hold the motion of the links that carry forces. */
/* Measures the present distances, since parameters may have changed. Cost: O(effects). */
void kt_simulation_begin_clearances(kt_simulation *simulation, bool swept);
/* Measures the distances at the end of a step of length h. Returns whether the step may have reached a boundary. Cost:
 * O(effects). */
bool kt_simulation_measure_clearances(kt_simulation *simulation, bool swept, double h);
/* Whether the step may have reached the boundary of effect k. Cost: O(1). */
bool kt_simulation_reaches_gap(const kt_simulation *simulation, size_t k, double h);
/* Passes the distances at the end of a step to the beginning of the next step. Cost: O(1). */
void kt_simulation_pass_clearances(kt_simulation *simulation);

#endif
