/* The length of a path over points, spheres and cylinders, and its gradient (path.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EFFECT_PATH_H
#define KT_EFFECT_PATH_H

#include "effect/effect.h"
#include "kinetree/effect.h"

enum { KT_PATH_POINT = 0, KT_PATH_SPHERE, KT_PATH_CYLINDER };

/* Whether an effect acts along a path. */
static inline bool kt_effect_has_path(const kt_effect *effect) {
    return effect->type == KT_EFFECT_EXPRESSION && effect->path_count > 0;
}
/* An end of an effect with two ends: of a path, its first or its last point. */
static inline const kt_end *kt_effect_end_at(const kt_effect *effect, int k) {
    return kt_effect_has_path(effect) ? &effect->path[k > 0 ? effect->path_count - 1 : 0].end : &effect->between[k];
}
static inline bool kt_path_point_is_surface(const kt_path_point *point) { return point->radius > 0.0; }

/* A path in a state: its length and rate, and the gradient of its length. unit[k] is the wrench of a unit force along
 * the path on link k of the path, about its frame's point; end[0] and end[1] are the parts at the first point and at
 * the last. A force f along the path does the work f dL, and a positive force pushes the ends apart. */
typedef struct kt_path_value {
    kt_real length, rate;
    kt_effect_wrench unit[KT_PATH_LINK_MAX];
    kt_triple end[2];
} kt_path_value;

/* A point of a description's path as one of a model, with its frame on link `link` of the path. */
static inline kt_path_point_record kt_path_record_of(const kt_path_point *from, const kt_pose *frame, int link) {
    kt_path_point_record r = {.link = link, .type = KT_PATH_POINT, .divisor = from->divisor, .at = frame->position};
    if (!kt_path_point_is_surface(from))
        return r;
    r.has_side = kt_vec3_norm_wide(from->side) > 0.0;
    r.type = kt_vec3_norm_wide(from->axis) > 0.0 ? KT_PATH_CYLINDER : KT_PATH_SPHERE;
    r.radius = from->radius;
    r.inside = from->inside;
    if (r.type == KT_PATH_CYLINDER)
        r.axis = kt_mat3_apply(frame->rotation, kt_vec3_normalize(from->axis));
    if (r.has_side)
        r.side = kt_mat3_apply(frame->rotation, kt_vec3_normalize(from->side));
    return r;
}

/* frame: the frames of the path's links, in the order of kt_path_point_record.link. */
void KT_EFFECT(kt_path_evaluate)(const kt_path_point_record *points, int count, const kt_effect_frame *frame, int links,
                                 kt_path_value *value);

#if !defined(KT_DUAL) && !defined(KT_LANES)
/* Calls `each` for the lines of a picture of the path, whose number does not depend on the frames. NULL: calls none.
 * Returns the number. */
typedef void kt_path_line(void *user, kt_vec3 from, kt_vec3 to);
int kt_path_trace(const kt_path_point_record *points, int count, const kt_effect_frame *frame, kt_path_line *each,
                  void *user);
#endif

#endif
