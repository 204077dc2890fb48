/* The columns of the regressor that belong to bodies (kinetree/identification.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_REGRESSOR_H
#define KT_DYNAMICS_REGRESSOR_H

#include "dynamics/dynamics.h"

enum { KT_BODY_PARAMETERS = 10 };

/* Writes the columns of all bodies, nv rows, from the motion in the data (kinematics of kt_kernels). The motion is
 * without gravity, which this function subtracts from the accelerations. */
#define KT_REGRESSOR_DECLARE(isa) void kt_regressor_bodies_##isa(const kt_model *model, const kt_data *data, double *y);
KT_EACH_ISA(KT_REGRESSOR_DECLARE)
#undef KT_REGRESSOR_DECLARE

#endif
