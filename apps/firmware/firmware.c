/* Computed torque of an arm by generated C alone, on a Cortex-M7 and here. test/apps/firmware.py writes arm.c and
 * arm.h by `kinetree export --c`, compiles both programs, and compares their outputs: the bits of the last
 * positions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "arm.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

int main(void) {
    static arm_model model;
    arm_parameters parameters = arm_default;
    arm_real q[arm_NQ] = {0}, v[arm_NV] = {0}, a[arm_NV], tau[arm_NV];
    const arm_real target[arm_NV] = {0.9, 0.2, 0.1, 0.9, -0.5, 1.5, 1.0}, step = 1e-3; /* rad, s */
    parameters.tool_mass = 1.5;                                                        /* kg */
    arm_prepare(&parameters, &model);
    for (int k = 0; k < 500; k++) {
        for (int i = 0; i < arm_NV; i++)
            a[i] = 100 * (target[i] - q[i]) - 20 * v[i];
        if (arm_inverse(&model, q, v, a, tau) != 0 || arm_forward(&model, q, v, tau, a) != 0)
            return 1;
        for (int i = 0; i < arm_NV; i++) {
            v[i] += step * a[i];
            q[i] += step * v[i];
        }
    }
    for (int i = 0; i < arm_NQ; i++) {
        const double angle = q[i];
        uint32_t word[2];
        memcpy(word, &angle, sizeof word);
        printf("%08lx%08lx\n", (unsigned long)word[1], (unsigned long)word[0]);
    }
    return 0;
}
