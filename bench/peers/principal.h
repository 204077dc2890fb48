/* Principal axes of an inertia, for engines that want them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PRINCIPAL_H
#define KT_BENCH_PRINCIPAL_H

#include "kinetree/algebra.h"

/* J = R diag(moments) R', R of the quaternion that is returned, to rounding. */
kt_quat kt_principal_axes(kt_sym3 inertia, kt_vec3 *moments);

#endif
