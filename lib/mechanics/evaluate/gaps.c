/* The effects that act only on one side of a boundary, contacts and stops, and their distances from acting. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/gaps.h"
#include "dynamics/dynamics.h"
#include "evaluate/effect_ends.h"
#include "evaluate/relative_force.h"

#include <math.h>

/* ---- the list ---------------------------------------------------------------------------------------------------- */

/* Returns the link of a free body whose centre of mass meets a plane on the ground, if this is the origin of its joint.
 * Otherwise returns NULL. Rotations of such a body do not move the point; only forces do. */
static const kt_link *free_link_of(const kt_model *model, const kt_effect_record *effect) {
    const kt_link *link = &model->link[model->force_link[effect->force_link[0]].link];
    const kt_vec3 at = effect->frame[0].position, moment = link->moment;
    const bool is_free = link->motion == KT_MOTION_FREE && link->parent == 0 && !link->rest_is_rotated &&
                         link->group < 0 && !link->leads && !link->branches;
    const bool is_centre = kt_vec3_dot(at, at) == 0.0 && kt_vec3_dot(moment, moment) == 0.0;
    return is_free && is_centre && !model->body[effect->body[0]].on_variable_link ? link : NULL;
}

/* Whether its second end is on the ground. */
static bool ends_on_ground(const kt_effect_record *effect) {
    return effect->ends == 2 && effect->force_link[1] == 0 && !effect->relative.type;
}

/* Whether the effect is the contact of a sphere with a plane. The distance of such a contact is the distance of the
 * sphere's centre, minus the radius. */
static bool is_sphere_on_plane(const kt_effect_record *effect) {
    if (effect->disc)
        return false;
    return effect->ends == 2 && !effect->relative.type;
}

/* Chooses the cheapest measurement of an effect's gap: a joint's coordinate, the height of a free link, the pose of one
 * end, both ends, or the effect's own function. `farthest` bounds the distance of the point from its
 * link's origin. */
static kt_gap_source source_of(const kt_model *model, const kt_effect_record *effect) {
    const bool moves = effect->ends > 0;
    const kt_link *link = !moves                   ? &model->link[effect->link[0]]
                          : ends_on_ground(effect) ? free_link_of(model, effect)
                                                   : NULL;
    const kt_pose *plane = &effect->frame[1];
    const kt_vec3 from = moves && link != NULL ? kt_vec3_sub(plane->position, link->at) : plane->position;
    kt_gap_form form = KT_GAP_OF_COORDINATE;
    if (moves && is_sphere_on_plane(effect))
        form = link != NULL ? KT_GAP_OF_HEIGHT : ends_on_ground(effect) ? KT_GAP_TO_GROUND : KT_GAP_OF_ENDS;
    else if (moves)
        form = KT_GAP_OF_OTHERS;
    return (kt_gap_source){.effect = effect,
                           .link = link,
                           .form = form,
                           .count = 1,
                           .q = link != NULL ? link->q : 0,
                           .v = link != NULL ? link->v : 0,
                           .farthest = moves ? kt_vec3_norm(effect->frame[0].position) : 0.0,
                           .offset = moves ? kt_vec3_dot(plane->rotation.z, from) : 0.0};
}

static bool vectors_are_equal(kt_vec3 a, kt_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/* Whether a row goes on: coordinates follow each other; points above the ground belong to one link above one plane. */
static bool row_goes_on(const kt_gap_source *row, const kt_gap_source *next) {
    const kt_effect_record *a = row->effect, *b = next->effect;
    if (row->form != next->form)
        return false;
    if (row->form == KT_GAP_OF_COORDINATE)
        return next->q == row->q + row->count && next->v == row->v + row->count;
    return row->form != KT_GAP_TO_GROUND ||
           (a->force_link[0] == b->force_link[0] && vectors_are_equal(a->frame[1].position, b->frame[1].position) &&
            vectors_are_equal(a->frame[1].rotation.z, b->frame[1].rotation.z));
}

size_t kt_gap_list(const kt_model *model, kt_gap_source *sources) {
    size_t count = 0, first = 0;
    for (size_t i = 0; i < model->n.batch; i++) {
        const kt_effect_batch *batch = &model->batch[i];
        if (!kt_effect_has_gap(batch->type))
            continue;
        for (int32_t j = 0; j < batch->count; j++, count++) {
            if (sources == NULL)
                continue;
            sources[count] = source_of(model, &model->effect[batch->first + j]);
            if (count == 0 || !row_goes_on(&sources[first], &sources[count])) {
                first = count;
                continue;
            }
            sources[first].count++;
            if (sources[first].form == KT_GAP_TO_GROUND)
                sources[first].farthest = fmax(sources[first].farthest, sources[count].farthest);
        }
    }
    return count;
}

/* ---- a gap ------------------------------------------------------------------------------------------------------- */

/* The gap of an effect whose second end moves, or that acts in a coordinate of a loop. */
static kt_gap gap_of_moving_ends(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                                 const double *q) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    kt_effect_end end[2];
    kt_effect_ends_of(data, effect, end);
    if (!effect->relative.type)
        return kind->gap(effect, end);
    const kt_relative_motion motion = kt_relative_motion_of(model, effect, q, end);
    return kind->joint_gap(effect, motion.position, motion.rate);
}

/* The gap of an effect whose second end is on the ground; points are relative to that end. The axes of the first end
 * are computed for discs alone. */
KT_INLINE kt_gap gap_to_ground(const kt_data *data, const kt_effect_record *effect) {
    kt_effect_end end[2];
    kt_effect_point_of(data, effect, 0, kt_v4_from(effect->frame[1].position), end);
    if (effect->disc)
        end[0].axes = kt_effect_axes_of(data, effect, 0);
    end[1].axes.z = effect->frame[1].rotation.z;
    end[1].point = kt_vec3_make(0.0, 0.0, 0.0);
    return kt_effect_kind_of(effect->type)->gap(effect, end);
}

/* The gap of an effect in a joint, or of a free body's centre, whose coordinate is the height above the plane. */
KT_INLINE kt_gap gap_in_coordinates(const kt_gap_source *from, const double *q, const double *v) {
    double position, rate;
    if (from->form == KT_GAP_OF_COORDINATE) {
        position = q[from->q];
        rate = v[from->v];
    } else {
        position = kt_gap_height(from, q);
        rate = kt_vec3_dot(from->effect->frame[1].rotation.z, kt_vec3_make(v[from->v], v[from->v + 1], v[from->v + 2]));
    }
    return kt_effect_kind_of(from->effect->type)->joint_gap(from->effect, position, rate);
}

void kt_gaps_evaluate(const kt_model *model, kt_data *data, const kt_gap_source *sources, size_t count, const double *q,
                      const double *v, bool swept, kt_gap *gaps) {
    for (size_t k = 0; k < count; k++) {
        if (sources[k].link != NULL) {
            gaps[k] = gap_in_coordinates(&sources[k], q, v);
            continue;
        }
        if (!swept)
            kt_force_frames_sweep(model, data, q, v);
        swept = true;
        gaps[k] = ends_on_ground(sources[k].effect) ? gap_to_ground(data, sources[k].effect)
                                                    : gap_of_moving_ends(model, data, sources[k].effect, q);
    }
}
