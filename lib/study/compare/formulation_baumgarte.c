/* Baumgarte's stabilisation [MSD 8.37, 8.38].
 *
 * The equation phi'' = A a - b'' = 0 has solutions phi = c0 + c1 t. Such solutions drift away once rounding and
 * integration errors have produced a c0 and a c1. The stabilisation replaces the equation by
 *
 *     phi'' + 2 alpha phi' + beta^2 phi = 0,   phi' = A v - b':   A a = b'' - 2 alpha (A v - b') - beta^2 phi.
 *
 * The solutions of this equation decay as exp(-alpha t) (c0 + c1 t) for alpha = beta. Equations without positions
 * (rolling) are
 *
 *     psi = A v - b' = 0,   psi' = A a - b''.
 *
 * The same equation with phi = 0 damps the violation psi: psi' = -2 alpha psi.
 *
 * The cost: M a = f + A' lambda with this right-hand side is a motion of the mechanism only if phi and phi' are
 * zero. Otherwise the stabilising forces act on the motion as well. The stabilisation adds the eigenvalues
 * -alpha +- sqrt(alpha^2 - beta^2) to those of the mechanism. An explicit method with step h must have h alpha within
 * its stability region, so that larger gains require smaller steps. In a mechanism with redundant equations a phi that
 * is not zero is inconsistent.
 *
 * Source: Baumgarte 1972.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/formulation.h"

void kt_formulation_baumgarte(kt_constraint_formulation *formulation, double alpha, double beta) {
    for (int r = 0; r < formulation->k; r++)
        formulation->target[r] =
            formulation->drift[r] - 2.0 * alpha * formulation->slip[r] - beta * beta * formulation->phi[r];
}
