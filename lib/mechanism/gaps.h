/* The effects that act on one side of a boundary alone, contacts and stops (effect/effect.h), and their gaps. */
#ifndef KT_MECHANISM_GAPS_H
#define KT_MECHANISM_GAPS_H

#include "effect/effect.h"

/* What a distance follows from: a joint's coordinate, a stop's; of a sphere from a plane, the coordinates of a free body whose
 * centre it is, the motion of one link, or that of both ends; or something else. */
typedef enum kt_gap_form {
    KT_GAP_OF_COORDINATE,
    KT_GAP_OF_HEIGHT,
    KT_GAP_TO_GROUND,
    KT_GAP_OF_ENDS,
    KT_GAP_OF_OTHERS
} kt_gap_form;

/* Such an effect. */
typedef struct kt_gap_source {
    const kt_effect_record *effect;
    const kt_link *link; /* whose coordinates alone its gap depends on; NULL: the gap is that of frames */
    int32_t q, v;        /* of these coordinates */
    kt_gap_form form;
    int32_t count;   /* of the first one of a row, how many there are (goes_on in gaps.c) */
    double farthest; /* distance of a point from its link's origin; of the first one of a row, the largest of all; m */
    double
        offset; /* of the plane from its link's origin, or from that of a free body's coordinates, along its normal, m */
} kt_gap_source;

/* Of a free body's centre, how high it is above the plane of a contact. */
static inline double kt_gap_height(const kt_gap_source *source, const double *q) {
    const kt_vec3 n = source->effect->frame[1].rotation.z;
    const double *at = q + source->q;
    return n.x * at[0] + n.y * at[1] + n.z * at[2] - source->offset;
}

/* The effects that act on one side of a boundary alone (effect/effect.h), in the order of their batches; NULL: they are
 * counted. Returns their number. */
size_t kt_gap_list(const kt_model *model, kt_gap_source *sources);
/* Their gaps in the state (q, v). Only the motion of links that carry forces is written to data; swept: it is that of this
 * state already, from an evaluation there. O(effects). */
void kt_gaps_evaluate(const kt_model *model, kt_data *data, const kt_gap_source *sources, size_t count, const double *q,
                      const double *v, bool swept, kt_gap *gaps);

#endif
