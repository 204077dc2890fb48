/* dopri5 until the motion is stiff, and radau5 while it is (switching.c). The table is that of dopri5. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

const kt_method kt_method_auto = {
    .name = "auto",
    .title = "dopri5, and radau5 while the motion is stiff",
    .source = "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.2 and IV.8",
    .family = &kt_family_switching,
    .stages = 7,
    .order = 5,
    .embedded_order = 4,
    .fsal = true,
    .a = kt_dopri5_a,
    .b = kt_dopri5_b,
    .c = kt_dopri5_c,
    .e = kt_dopri5_e,
    .dense_order = 4,
    .dense_terms = 1,
    .dense_d = kt_dopri5_d,
};
