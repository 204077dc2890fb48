/* Random models in MJCF, of the elements that decide forces and accelerations. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_IMPORT_DRAW_H
#define KT_TEST_IMPORT_DRAW_H

#include "random.h"

#include <stdbool.h>
#include <stdio.h>

/* Writes a model with a keyframe `k` of controls, perhaps with meshes. Returns false if writing fails. */
bool draw_mjcf(FILE *to, kt_random *random, bool has_meshes);

#endif
