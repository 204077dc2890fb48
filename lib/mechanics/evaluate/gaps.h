/* The effects that act only on one side of a boundary, contacts and stops (effect/effect.h), and their gaps. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_GAPS_H
#define KT_MECHANISM_GAPS_H

#include "effect/effect.h"

/* The source of a distance. For a stop, the source is a joint's coordinate. A sphere and a plane have three forms: the
 * coordinates of a free body with the sphere at its centre, the motion of one link, and the motion of both ends.
 * KT_GAP_OF_OTHERS: some other source. */
typedef enum kt_gap_form {
    KT_GAP_OF_COORDINATE,
    KT_GAP_OF_HEIGHT,
    KT_GAP_TO_GROUND,
    KT_GAP_OF_ENDS,
    KT_GAP_OF_OTHERS
} kt_gap_form;

/* An effect whose gap has such a source. */
typedef struct kt_gap_source {
    const kt_effect_record *effect;
    const kt_link *link; /* link whose coordinates alone decide the gap; NULL: the gap is that of frames */
    int32_t q, v;        /* first indices of these coordinates */
    kt_gap_form form;
    int32_t count;   /* for the first effect of a row: how many there are (row_goes_on in gaps.c) */
    double farthest; /* distance of a point from its link's origin; of the first one of a row, the largest of all; m */
    double offset;   /* distance of the plane along its normal, from the origin of its link or of free coordinates; m */
} kt_gap_source;

/* Returns the height of a free body's centre above the plane of a contact. */
static inline double kt_gap_height(const kt_gap_source *source, const double *q) {
    const kt_vec3 n = source->effect->frame[1].rotation.z;
    const double *at = q + source->q;
    return n.x * at[0] + n.y * at[1] + n.z * at[2] - source->offset;
}

/* Lists the effects that act only on one side of a boundary (effect/effect.h), in the order of their batches. If
 * sources is NULL, only counts these effects. Returns their number. */
size_t kt_gap_list(const kt_model *model, kt_gap_source *sources);
/* Evaluates their gaps in the state (q, v). Writes only the motion of links that carry forces to data. swept: data hold
 * this motion already, from an evaluation in this state. Cost: O(effects). */
void kt_gaps_evaluate(const kt_model *model, kt_data *data, const kt_gap_source *sources, size_t count, const double *q,
                      const double *v, bool swept, kt_gap *gaps);

#endif
