/* SPDX-License-Identifier: Apache-2.0 */
#include "energy.h"

#include <stdio.h>

bool energy_mujoco(const char *mjcf, double duration, double step) {
    (void)mjcf;
    (void)duration;
    (void)step;
    printf("MuJoCo,not on this machine,,\n");
    return true;
}
