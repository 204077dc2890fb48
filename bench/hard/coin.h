/* A coin that spins on its rim and falls flat, in each engine. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_COIN_H
#define KT_BENCH_HARD_COIN_H

#include "../../test/files/scene/coin.h"

/* rad; N m s/rad, against the rate Omega at which it turns about the vertical; Coulomb's coefficient. */
#define KT_COIN_ALPHA 0.1
#define KT_COIN_DAMPING 2e-6
#define KT_COIN_FRICTION 1.0

/* Omega at the start, about the vertical; the coin turns about its axle `a` against it, so that its centre rests. */
double kt_coin_rate(void);

/* The damper's torque on a coin with the angular velocity w, all in world axes. It acts on Omega alone:
 * T = -c Omega n / n.n, n = z - (z.a) a, for which T.a = 0, T.z = -c Omega, and Omega = w.n / n.n. */
void kt_coin_damper(const double axle[3], const double w[3], double torque[3]);

#endif
