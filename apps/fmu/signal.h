/* Inputs of an FMU in the place of functions of time: motions, speeds, lengths, targets of servos, torques and forces.
 * The command names them in the first line of the resource, which the binary of the FMU reads.
 *
 * The equations need a function f with its first and second derivative, or fewer of them. Each of these numbers is a
 * variable of its own: the other tool has the derivatives of its signals, and the FMU would have to guess them.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_SIGNAL_H
#define KT_FMU_SIGNAL_H

#include "kinetree/descriptor.h"

#include <string.h>

/* The line begins so. Names as for kt_parameter_find follow, with KT_FMU_SIGNALS_BETWEEN between them. */
#define KT_FMU_SIGNALS "# inputs: "
#define KT_FMU_SIGNALS_BETWEEN ", "

enum { KT_FMU_SIGNAL_MOST = 3 /* numbers */, KT_FMU_SIGNAL_NAME = 256 /* bytes */ };

/* Returns how many numbers of the function of a key are inputs: 1 is the value, 2 also its rate, 3 also its
 * acceleration; of a vector, its components. 0: the key cannot be an input. */
static inline int kt_fmu_signal_size(const kt_key *key) {
    static const struct {
        const char *name;
        int size;
    } sizes[] = {{"torque", 1},   {"target", 2}, {"rest", 2},    {"rate", 2},
                 {"position", 3}, {"length", 3}, {"distance", 3}};
    if (key->kind == KT_KEY_FUNCTIONS)
        return 3;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        if (key->kind == KT_KEY_FUNCTION && strcmp(key->name, sizes[i].name) == 0)
            return sizes[i].size;
    return 0;
}

#endif
