/* Scenes compared in every member, to the bit. Written out by hand, so that a key that the library's tables forget is
 * missed here. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_DIFFERENCE_H
#define KT_TEST_SCENE_DIFFERENCE_H

#include "kinetree/scene.h"

/* The first member that differs ("bodies[3].joint.at"), or "". Valid until the next call. */
const char *kt_scene_difference(const kt_scene *a, const kt_scene *b);
const char *kt_run_difference(const kt_run *a, const kt_run *b);

#endif
