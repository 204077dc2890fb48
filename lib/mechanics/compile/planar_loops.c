/* Loops between planar trees: the trees that they connect, and their equations in the plane.
 *
 * Planar motion does not change the equations of a loop out of the plane, so that these equations must hold at q = 0
 * already, within rounding. The directions of the ends' axes are compared relative to n, with one rotation more than
 * the axes of joints (find_planar.c). Heights are compared relative to the distance from the world's origin along the
 * joints (reach). If these equations do not hold, the loop may not close at all. The spatial kernels, which then
 * compute the trees, report that.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "compile/find_planar.h"
#include "loop/loop.h"

#include <float.h>
#include <string.h>

#define PARALLEL (64.0 * DBL_EPSILON)
#define ROUNDING (64.0 * DBL_EPSILON)

enum { GROUND = 0, SPATIAL = -1 };

/* Returns the body of a name; a missing name is the world. Names have been checked. */
static int32_t ordered_body_named(const kt_ordered *o, const char *name) {
    const int i = !name || strcmp(name, "world") == 0 ? -1 : kt_names_find(o->names, KT_NAMES_OF_BODIES, name);
    return i < 0 ? GROUND : o->body_of[i];
}

/* The number of bodies that a loop connects, and the k-th of these bodies. */
static int connected_count(const kt_loop *loop) {
    return kt_loop_is_relation(loop->type) ? kt_loop_term_count(loop) : 2;
}

static int32_t connected(const kt_ordered *o, const kt_loop *loop, int k) {
    if (!kt_loop_is_relation(loop->type))
        return ordered_body_named(o, loop->between[k].body);
    return o->body_of[kt_names_find(o->names, KT_NAMES_OF_JOINTS, kt_loop_term(loop, k).joint)];
}

/* ---- components -------------------------------------------------------------------------------------------------- */

static int32_t loop_component_of(kt_body_plane *body, int32_t tree) {
    while (body[tree].component != tree)
        tree = body[tree].component = body[body[tree].component].component;
    return tree;
}

void kt_trees_join(const kt_ordered *o, kt_body_plane *body) {
    for (int i = 0; i < o->description->loop_count; i++) {
        const kt_loop *loop = &o->description->loops[i];
        int32_t first = GROUND;
        if (KT_IS_OFF(loop))
            continue;
        for (int k = 0; k < connected_count(loop); k++) {
            const int32_t tree = body[connected(o, loop, k)].tree;
            if (tree == GROUND)
                continue;
            if (first == GROUND)
                first = tree;
            body[loop_component_of(body, tree)].component = loop_component_of(body, first);
        }
    }
    for (size_t i = 1; i <= o->count; i++)
        body[i].component = loop_component_of(body, (int32_t)i);
}

/* ---- loops in their planes --------------------------------------------------------------------------------------- */

/* The frame of an end in its body's. Returns false if a rotation cannot be evaluated. */
static bool end_frame_of(const kt_ordered *o, const kt_end *end, const kt_body_plane *b, kt_pose *frame) {
    kt_error ignored; /* such a rotation is rejected when loops are attached */
    kt_mat3 on = kt_mat3_identity();
    const int index = end->marker ? kt_names_find(o->names, b->source, end->marker) : -1;
    const kt_marker *marker = index < 0 ? NULL : &o->description->bodies[b->source].markers[index];
    frame->position = marker ? marker->at : end->at;
    if (kt_rotation_evaluate(&end->rotation, &frame->rotation, &ignored) != KT_OK ||
        (marker && kt_rotation_evaluate(&marker->rotation, &on, &ignored) != KT_OK))
        return false;
    frame->rotation = kt_mat3_multiply(on, frame->rotation);
    return true;
}

/* Finds the pose of an end in the plane's basis at q = 0: its axes, and its height along n (in position.z). Adds the
 * end's distance along the joints to *reach. Returns false if its rotation cannot be evaluated. */
static bool lay_end(const kt_ordered *o, const kt_loop *loop, int k, const kt_body_plane *b, const kt_plane *plane,
                    kt_pose *pose, double *reach) {
    const kt_end *end = &loop->between[k];
    if (!end_frame_of(o, end, b, pose))
        return false;
    const kt_vec3 at = pose->position;
    kt_attach_align_axis(pose, kt_loop_axis(loop, k));
    const bool ground = b->tree == GROUND;
    const kt_mat3 basis = ground ? kt_mat3_multiply(kt_mat3_transpose(b->rest), plane->basis) : b->basis;
    pose->rotation = kt_mat3_multiply(kt_mat3_transpose(basis), pose->rotation);
    const double height = ground ? kt_vec3_dot(plane->basis.z, b->at) : b->height;
    pose->position = kt_vec3_make(0.0, 0.0, height + kt_vec3_dot(basis.z, at));
    *reach += b->reach + kt_vec3_norm(at);
    return true;
}

/* Finds the equations of a loop in the plane (`flat`). Returns false if an equation out of the plane does not hold at
 * q = 0. Relations are equations of coordinates, the same in any plane. */
static bool lay_loop(const kt_ordered *o, const kt_loop *loop, const kt_body_plane *body, const kt_plane *plane,
                     kt_planar_loop *flat) {
    kt_pose end[2];
    double reach = 0.0;
    if (kt_attach_is_relation((int32_t)loop->type))
        return true;
    for (int k = 0; k < 2; k++)
        if (!lay_end(o, loop, k, &body[connected(o, loop, k)], plane, &end[k], &reach))
            return false;
    return kt_loop_planar_rows(loop, end, PARALLEL, ROUNDING * reach, flat);
}

void kt_loops_planar_rows(const kt_ordered *o, kt_body_plane *body, const kt_plane *plane, kt_planar_loop *flat) {
    for (int i = 0; i < o->description->loop_count; i++) {
        const kt_loop *loop = &o->description->loops[i];
        int32_t tree = GROUND;
        if (KT_IS_OFF(loop))
            continue;
        for (int k = 0; k < connected_count(loop) && tree == GROUND; k++)
            tree = body[connected(o, loop, k)].tree;
        kt_body_plane *component = &body[body[tree].component];
        if (tree != GROUND && component->plane >= 0 && !lay_loop(o, loop, body, &plane[component->plane], &flat[i]))
            component->plane = SPATIAL;
    }
}

void kt_planar_ends(const kt_model *m, const struct kt_loop_record *loop, kt_planar_loop *flat) {
    const int32_t shift = (int32_t)m->n.spatial - 1, some = loop->link[loop->link[0] ? 0 : 1] - shift;
    kt_v4 basis[3];
    kt_v4_from_mat3(m->plane[m->planar_rest[some].plane].basis, basis);
    flat->ancestor = loop->ancestor ? loop->ancestor - shift : 0;
    const kt_v4 origin = kt_v4_apply_transposed(basis, kt_v4_from(loop->origin));
    flat->origin[0] = origin[0];
    flat->origin[1] = origin[1];
    for (int k = 0; k < 2; k++) {
        const kt_v4 at = kt_v4_from(loop->frame[k].position);
        flat->link[k] = loop->link[k] ? loop->link[k] - shift : 0;
        const kt_v4 arm =
            flat->link[k] ? kt_v4_apply(m->planar_rest[flat->link[k]].axes, at) : kt_v4_apply_transposed(basis, at);
        flat->arm[k][0] = arm[0];
        flat->arm[k][1] = arm[1];
    }
}
