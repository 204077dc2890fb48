/* Effects in coordinates: of joints, and of loops, which act on the loop's ends (evaluate/relative_force.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "constraint/relative_coordinate.h"
#include "effect/path.h"

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The body of a joint that has this coordinate: in absolute coordinates, joints of several coordinates have become
 * loops of the same name. */
static int coordinate_body_of(const kt_model *m, const char *text, kt_coordinate_name name) {
    int body = kt_joint_index(m, text);
    for (size_t i = 1; body < 0 && name.has_index && i < m->n.body; i++) {
        if (kt_coordinate_is_of(text, name, kt_joint_name(m, (int)i)) && m->body[i].type != KT_JOINT_FREE)
            body = (int)i;
    }
    return body;
}

/* The joint or loop of a coordinate's name. The search for a loop begins at the last one that was found, since effects
 * of one loop mostly follow each other. */
static kt_attach_coordinate find_attach_coordinate(kt_attach *a, const char *joint) {
    const kt_coordinate_name name = kt_coordinate_name_of(joint);
    kt_attach_coordinate c = {.body = coordinate_body_of(a->tree, joint, name), .loop = -1, .component = name.k};
    if (c.body < 0) {
        c.loop = kt_coordinate_loop(a->description, joint, a->loop_of_effect);
        a->loop_of_effect = c.loop < 0 ? 0 : c.loop;
    }
    return c;
}

/* The k-th link of a joint belongs to its coordinate k. */
static int32_t component_link_of(const kt_model *m, int body, int component) {
    return kt_attach_link_of_velocity(m, m->body[body].link, m->body[body].v + component);
}

int32_t kt_attach_joint_link(const kt_model *m, const char *joint) {
    const int own = kt_joint_index(m, joint);
    if (own >= 0)
        return m->body[own].link;
    const kt_coordinate_name name = kt_coordinate_name_of(joint);
    return component_link_of(m, coordinate_body_of(m, joint, name), name.k);
}

/* The loop in a coordinate of which an effect acts; NULL: the effect acts in no loop. */
static const kt_loop *coordinate_loop_of(kt_attach *a, const kt_effect *effect) {
    if (kt_effect_end_count(effect) > 0)
        return NULL;
    const int loop = find_attach_coordinate(a, effect->joint).loop;
    return loop >= 0 ? &a->description->loops[loop] : NULL;
}

int kt_attach_end_count(kt_attach *a, const kt_effect *effect) {
    return coordinate_loop_of(a, effect) ? 2 : kt_effect_end_count(effect);
}

const char *kt_attach_end_body(kt_attach *a, const kt_effect *effect, int k) {
    const kt_loop *loop = coordinate_loop_of(a, effect);
    return loop ? loop->between[k].body : kt_effect_end_at(effect, k)->body;
}

/* ---- turns ------------------------------------------------------------------------------------------------------- */

static double cosine_of(const kt_attach *a, int32_t link, kt_vec3 axis) {
    const kt_mat3 axes = a->pose[link].rotation;
    const int k = a->tree->link[link].axis;
    return kt_vec3_dot(k == 0 ? axes.x : k == 1 ? axes.y : axes.z, axis);
}

/* Returns the factor with which a link's angle counts in an angle about an axis. The factor is 1 or -1 if the link's
 * axis is parallel. The factor is 0 if the link does not rotate, and NAN if the link rotates about another axis. */
static double turns_of(const kt_attach *a, int32_t link, kt_vec3 axis) {
    const kt_motion motion = (kt_motion)a->tree->link[link].motion;
    if (motion == KT_MOTION_PRISMATIC)
        return 0.0;
    const double c = motion == KT_MOTION_REVOLUTE || motion == KT_MOTION_SCREW ? cosine_of(a, link, axis) : 0.0;
    return fabs(fabs(c) - 1.0) < 1e-12 ? copysign(1.0, c) : (double)NAN;
}

/* Whether the rope of a span is tied to this end: the turns of the end do not matter. */
static bool is_tied(const kt_loop_record *loop, int end) {
    return loop->type == KT_LOOP_SPAN && loop->gain[end] == 0.0;
}

/* Writes the links between the ends that count turns, unless terms is NULL, and returns their number: 0 if any other
 * link rotates. */
static size_t each_turning(const kt_attach *a, const kt_loop_record *loop, kt_term_record *terms, int32_t *of_first) {
    const kt_vec3 axis = kt_mat3_apply(a->pose[loop->link[0]].rotation, loop->frame[0].rotation.z);
    size_t count = 0;
    for (int k = 0; k < 2; k++)
        for (int32_t i = is_tied(loop, k) ? loop->ancestor : loop->link[k]; i != loop->ancestor;
             i = a->tree->link[i].parent) {
            const double turns = turns_of(a, i, axis);
            if (isnan(turns))
                return 0;
            if (turns != 0.0 && terms)
                terms[count] = (kt_term_record){.link = i, .coefficient = k ? turns : -turns};
            count += turns != 0.0;
            if (of_first && k == 0)
                *of_first = (int32_t)count;
        }
    return count;
}

/* Screws count their turns by their advance. */
static bool counts_by_links(const kt_loop *loop, kt_relative relative) {
    return relative == KT_RELATIVE_STRETCH ||
           (relative == KT_RELATIVE_ANGLE && !(loop->type == KT_LOOP_SCREW && loop->pitch != 0.0));
}

size_t kt_attach_count_turns(kt_attach *a, const kt_effect *effect) {
    const kt_loop *loop = coordinate_loop_of(a, effect);
    if (!loop)
        return 0;
    const kt_attach_coordinate c = find_attach_coordinate(a, effect->joint);
    return counts_by_links(loop, kt_relative_at(loop->type, c.component))
               ? each_turning(a, &a->loop[c.loop], NULL, NULL)
               : 0;
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

static kt_loop_end initial_end(const kt_attach *a, const kt_loop_record *loop, int k) {
    const kt_pose pose = kt_pose_compose(a->pose[loop->link[k]], loop->frame[k]);
    kt_loop_end end = {.point = kt_v4_from(pose.position)};
    end.omega = end.velocity = end.alpha = end.linear = kt_v4_splat(0.0);
    kt_v4_from_mat3(pose.rotation, end.axes);
    return end;
}

/* When both frames coincide: the angle about the z axis of end k at which the axis of the other end lies. */
static double zero_of(const kt_loop *loop, int k) {
    const kt_mat3 aligned = kt_triad_from_axis(kt_vec3_normalize(kt_loop_axis(loop, k)), 2);
    const kt_vec3 other = kt_mat3_apply_transposed(aligned, kt_loop_axis(loop, 1 - k));
    return atan2(other.y, other.x);
}

/* Places an effect in a coordinate of a loop: it acts on both ends. A screw of pitch p finds the number of its turns by
 * its advance, d_z / p. */
static void place_in_loop(const kt_attach *a, kt_attach_coordinate c, kt_effect_record *r) {
    const kt_loop *loop = &a->description->loops[c.loop];
    const kt_loop_record *of = &a->loop[c.loop];
    kt_relative_record *relative = &r->relative;
    r->ends = 2;
    for (int k = 0; k < 2; k++) {
        r->body[k] = of->body[k];
        r->link[k] = of->link[k];
        r->frame[k] = of->frame[k];
        r->arm[k] = kt_vec3_sub(of->frame[k].position, a->tree->body[of->body[k]].in_link.position);
    }
    *relative = (kt_relative_record){
        .type = (int32_t)kt_relative_at(loop->type, c.component), .loop = c.loop, .component = c.component};
    if (loop->type == KT_LOOP_SCREW && loop->pitch != 0.0)
        relative->per_length = 1.0 / loop->pitch;
    if (loop->type == KT_LOOP_UNIVERSAL)
        relative->zero = zero_of(loop, relative->type == KT_RELATIVE_SECOND);
}

void kt_attach_place_in_coordinate(kt_attach *a, const kt_model *m, const kt_effect *effect, kt_effect_record *r) {
    const kt_attach_coordinate c = find_attach_coordinate(a, effect->joint);
    if (c.body < 0) {
        place_in_loop(a, c, r);
        return;
    }
    r->body[0] = c.body;
    r->link[0] = component_link_of(m, c.body, c.component);
}

/* Prepares the count of turns of a loop's relative coordinate. The two ends determine its angle theta only up to whole
 * turns. Therefore the angle that is nearest to an estimate is taken:
 *
 *     theta ~ theta_0 + sum_k s_k (q_k - q_k0) + (d_z - d_z0) / pitch
 *
 * over the joints k between the ends that turn about the axis, with signs s_k, or for screws over the advance d_z along
 * the axis. theta_0, within half a turn, belongs to the positions q0 of the description. The constant terms of the
 * estimate become `angle`. *term: the number of terms in the model so far. */
void kt_attach_fill_turns(const kt_attach *a, kt_model *m, kt_effect_record *r, size_t *term) {
    kt_relative_record *relative = &r->relative;
    const kt_loop *loop = &a->description->loops[relative->loop];
    const kt_loop_record *of = &a->loop[relative->loop];
    const kt_loop_end end[2] = {initial_end(a, of, 0), initial_end(a, of, 1)};
    const kt_loop_relative seen = kt_loop_relative_of(end);
    relative->term = (int32_t)*term;
    if (counts_by_links(loop, (kt_relative)relative->type))
        relative->term_count = (int32_t)each_turning(a, of, NULL, &relative->first_count);
    if (relative->term_count > 0) /* else there is no room for any */
        (void)each_turning(a, of, m->term + *term, NULL);
    *term += (size_t)relative->term_count;
    if (relative->type == KT_RELATIVE_STRETCH)
        return; /* the length of a rope changes by the turns since the start */
    kt_relative_record near_zero = *relative;
    near_zero.per_length = 0.0;
    relative->angle = kt_relative_coordinate_of(&near_zero, (kt_relative_turns){0.0, 0.0}, of, end).position -
                      relative->per_length * kt_dot(end[0].axes[2], seen.d);
    for (int32_t k = relative->term; k < relative->term + relative->term_count; k++)
        relative->angle -= m->term[k].coefficient * m->q0[m->link[m->term[k].link].q];
}
