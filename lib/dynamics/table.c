/* The kernels of one level. */
#include "dynamics/kernel.h"

#define KT_TEXT_(a) #a
#define KT_TEXT(a) KT_TEXT_(a)

const kt_kernels KT_KERNEL(kt_kernels) = {
    .name = KT_TEXT(KT_LEVEL),
    .forward = KT_KERNEL(kt_forward),
    .inverse = KT_KERNEL(kt_inverse),
    .mass = KT_KERNEL(kt_mass),
    .kinematics = KT_KERNEL(kt_kinematics),
    .bearers = KT_KERNEL(kt_bearers),
};
