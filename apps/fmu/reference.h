/* References of the variables of an FMU, and its token. The command writes them into modelDescription.xml, and the
 * binary of the FMU reads them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_REFERENCE_H
#define KT_FMU_REFERENCE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* The first reference of each kind. Below KT_FMU_INPUT a reference is the index of a column; column 0 is time. */
enum {
    KT_FMU_INPUT = 1 << 20,      /* + index in v: the force or torque of a joint */
    KT_FMU_PARAMETER = 2 << 20,  /* + index in the parameters of the scene */
    KT_FMU_STATE = 3 << 20,      /* + index in (q, v, x) */
    KT_FMU_DERIVATIVE = 4 << 20, /* + index in the derivatives of (q, v, x) */
    KT_FMU_INDICATOR = 5 << 20,  /* + index in the events of the scene: the value whose sign is watched */
    KT_FMU_SIGNAL = 6 << 20,     /* + KT_FMU_SIGNAL_MOST times index in the signals + number (signal.h) */
};

/* The resource of an FMU: the scene in flow style (kt_scene_write_flow), with the settings of the export. */
#define KT_FMU_SCENE "scene.yaml"

typedef struct kt_fmu_token {
    char text[24];
} kt_fmu_token;

/* Returns a checksum of the resource (FNV-1a), which ties the description to it. */
static inline kt_fmu_token kt_fmu_token_of(const char *scene, size_t size) {
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < size; i++) {
        sum ^= (unsigned char)scene[i];
        sum *= 1099511628211u;
    }
    kt_fmu_token token = {{0}};
    (void)snprintf(token.text, sizeof token.text, "{%016llx}", (unsigned long long)sum);
    return token;
}

#endif
