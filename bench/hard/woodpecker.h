/* The woodpecker toy in engines whose bodies turn by finite angles: its equations are those of small ones. Let the
 * levers be N times as long, with N^2 times the moments of inertia and the stiffness. Then the same equations apply to
 * angles N times as small, which are small. Edges and the beak are spheres of the radius RHO. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_WOODPECKER_H
#define KT_BENCH_HARD_WOODPECKER_H

#include "../../test/files/scene/woodpecker.h"

#define KT_WOODPECKER_N 100.0
#define KT_WOODPECKER_RHO 0.01

#endif
