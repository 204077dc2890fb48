/* The driver for models some or all links of which are planar. */
/* SPDX-License-Identifier: Apache-2.0 */
#define KT_PLANAR true
#include "reduction/driver.h"

const kt_reduction_kernels KT_KERNEL(kt_reduction_planar_kernels) = {KT_DRIVER_KERNELS};
