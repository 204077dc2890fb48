/* The points of a disc's rim that touch a plane elastically (effect_contact.c), by their angles 2 pi i / 16 from the
 * lowest one. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EFFECT_RIM_H
#define KT_EFFECT_RIM_H

enum { KT_RIM_POINTS = 16 };

/* A disc with the axle a lies flat on a plane of normal n below this |n x a|. */
#define KT_RIM_FLAT 1e-6

static inline double kt_rim_cosine(int i) {
    static const double eighth[] = {1.0, 0.92387953251128676, 0.70710678118654752, 0.38268343236508977, 0.0};
    const int k = i % KT_RIM_POINTS, up = k > 8 ? KT_RIM_POINTS - k : k;
    return up > 4 ? -eighth[8 - up] : eighth[up];
}
static inline double kt_rim_sine(int i) { return kt_rim_cosine(i + 3 * KT_RIM_POINTS / 4); }

#endif
