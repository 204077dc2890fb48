/* The contents of a picture of a mechanism, from its description. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/picture.h"

#include "base/arena.h"
#include "picture/maker.h"
#include "picture/picture_mesh.h"
#include "picture/solid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- memory ------------------------------------------------------------------------------------------------------ */

typedef struct counts {
    size_t bodies, joints, loops, relations, effects, solids, planes, meshes, drawn;
} counts;

#define KT_PICTURE_FIELDS(X)                                                                                           \
    X(kt_solid, solids, n->solids, "the shapes of bodies")                                                             \
    X(kt_picture_joint, joints, n->joints + n->effects, "those that move, and coordinates of loops")                   \
    X(kt_picture_loop, loops, n->loops, "those between two ends")                                                      \
    X(kt_stroke, strokes, KT_STROKES_MOST * n->drawn, "of curves and surfaces")                                        \
    X(kt_picture_relation, relations, n->relations, "couplings and motions")                                           \
    X(kt_picture_effect, effects, n->effects, "all")                                                                   \
    X(kt_picture_plane, planes, n->planes, "of contacts, rolling wheels, planar joints of the ground")                 \
    X(struct kt_mesh, meshes, n->meshes, "surfaces of solids")                                                         \
    X(int, part, n->bodies, "rigid part of each body")                                                                 \
    X(int, colour, n->bodies, "of each body")

KT_ARENA_LAYOUT(lay_out, kt_picture, KT_PICTURE_FIELDS, const counts *n)

/* An upper bound of the solids. A body has at most a solid for each shape, a point at its mass, and a rod to each
 * joint, loop and effect on it. Two rods connect a body with the body to which it is fixed. */
static counts count_picture(const kt_scene *scene, const kt_model *model) {
    const kt_description *d = &scene->description;
    const size_t bodies = (size_t)kt_model_body_count(model), loops = (size_t)d->loop_count,
                 effects = (size_t)d->effect_count;
    size_t relations = 0, drawn = 0;
    for (size_t i = 0; i < loops; i++)
        drawn += d->loops[i].type == KT_LOOP_CURVE || d->loops[i].type == KT_LOOP_SURFACE;
    for (size_t i = 0; i < loops; i++)
        relations += 1 + (size_t)d->loops[i].term_count;
    size_t shapes = 0;
    for (int i = 0; i < d->body_count; i++) {
        shapes += (size_t)d->bodies[i].shape_count + kt_solid_edge_count(&d->bodies[i].shape);
        for (int k = 0; k < d->bodies[i].shape_count; k++)
            shapes += kt_solid_edge_count(&d->bodies[i].shapes[k]);
    }
    return (counts){.bodies = bodies,
                    .joints = bodies,
                    .loops = loops,
                    .relations = relations,
                    .drawn = drawn,
                    .effects = effects,
                    .meshes = (size_t)scene->mesh_count,
                    .solids = 6 * bodies + shapes + (size_t)scene->mesh_count + 2 * loops + 2 * effects,
                    .planes = bodies + loops + effects};
}

/* ---- colours ----------------------------------------------------------------------------------------------------- */

enum { COLOURS = 6 };

/* Colours in turn; a rigid part takes the next one that no neighbour has that is coloured already. */
static void choose_colours(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    int turn = 0;
    for (int body = 0; body < p->body_count; body++) {
        const int part = p->part[body];
        unsigned taken = 0;
        p->colour[body] = part == 0 ? -1 : p->colour[part];
        if (part != body || part == 0)
            continue;
        const int parent = p->colour[kt_body_parent(m->model, body)];
        taken |= parent >= 0 ? 1U << (unsigned)parent : 0U;
        for (int i = 0; i < p->loop_count; i++)
            for (int k = 0; k < 2; k++) {
                const int other = p->part[p->loops[i].ends[1 - k].body];
                if (p->part[p->loops[i].ends[k].body] == part && other < part && p->colour[other] >= 0)
                    taken |= 1U << (unsigned)p->colour[other];
            }
        for (int k = 0; k < COLOURS && (taken & 1U << (unsigned)(turn % COLOURS)) != 0; k++)
            turn++;
        p->colour[body] = turn++ % COLOURS;
    }
}

/* ---- the plane of motion ----------------------------------------------------------------------------------------- */

/* Whether the joint leaves all in planes with this normal. */
static bool keeps_plane(const kt_picture_maker *m, const kt_picture_joint *joint, kt_vec3 normal) {
    const double c = fabs(kt_vec3_dot(kt_body_frame_pose(&joint->frame, m->poses).rotation.z, normal));
    if (joint->type == KT_JOINT_REVOLUTE || joint->type == KT_JOINT_PLANAR)
        return c > 1.0 - 1e-9;
    return joint->type == KT_JOINT_PRISMATIC && c < 1e-6;
}

/* The axis of the first joint that turns; where all slide, a normal of the first guide, with gravity in the plane. */
static kt_vec3 candidate_normal(const kt_picture_maker *m) {
    const kt_picture *p = m->picture;
    for (int i = 0; i < p->joint_count; i++)
        if (p->joints[i].type == KT_JOINT_REVOLUTE || p->joints[i].type == KT_JOINT_PLANAR)
            return kt_body_frame_pose(&p->joints[i].frame, m->poses).rotation.z;
    if (p->joint_count == 0)
        return kt_vec3_make(0.0, 0.0, 1.0);
    const kt_vec3 guide = kt_body_frame_pose(&p->joints[0].frame, m->poses).rotation.z;
    const kt_vec3 choices[] = {{0.0, 0.0, 1.0}, {0.0, -1.0, 0.0}, {1.0, 0.0, 0.0}};
    for (int i = 0; i < 3; i++)
        if (fabs(kt_vec3_dot(guide, choices[i])) < 1e-6 &&
            fabs(kt_vec3_dot(p->gravity, choices[i])) <= 1e-6 * kt_vec3_norm(p->gravity))
            return choices[i];
    return kt_vec3_make(0.0, 0.0, 1.0);
}

/* The viewer is at +z, -y or +x, whichever is nearest to the normal. */
static kt_vec3 face_viewer(kt_vec3 normal) {
    const double x = fabs(normal.x), y = fabs(normal.y), z = fabs(normal.z);
    const double towards = z >= x && z >= y ? normal.z : y >= x ? -normal.y : normal.x;
    return towards < 0.0 ? kt_vec3_scale(-1.0, normal) : normal;
}

static void find_plane(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    p->normal = face_viewer(candidate_normal(m));
    p->is_planar = true;
    for (int i = 0; i < p->joint_count; i++)
        p->is_planar = p->is_planar && keeps_plane(m, &p->joints[i], p->normal);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

/* Sets the lengths that ropes without a function have. */
static void measure_ropes(kt_picture_maker *m) {
    for (int i = 0; i < m->picture->loop_count; i++) {
        kt_picture_loop *loop = &m->picture->loops[i];
        const kt_vec3 first = kt_body_frame_pose(&loop->ends[0], m->poses).position,
                      second = kt_body_frame_pose(&loop->ends[1], m->poses).position;
        loop->rope_given = loop->rope != NULL ? kt_vec3_norm(kt_vec3_sub(second, first)) : (double)NAN;
    }
}

static kt_status fill_picture(kt_picture_maker *m, double *lengths, kt_error *error) {
    kt_status status = KT_OK;
    kt_picture *p = m->picture;
    for (int i = 0; i < p->body_count; i++)
        m->first[i] = -1;
    kt_picture_list_joints(m);
    kt_picture_list_loops(m);
    measure_ropes(m);
    kt_picture_list_relations(m);
    kt_picture_list_effects(m);
    if (m->options->boxes) {
        kt_picture_list_boxes(m);
    } else {
        kt_picture_list_shapes(m);
        status = kt_picture_list_meshes(m, error);
    }
    const kt_bounds bounds = kt_picture_measure(m, lengths);
    kt_picture_list_planes(m, bounds);
    kt_strokes_list(p, m->description->loops, m->poses, bounds);
    kt_picture_thicken(m);
    find_plane(m);
    kt_picture_imply_solids(m);
    choose_colours(m);
    return status;
}

kt_status kt_picture_create(const kt_scene *scene, const kt_model *model, const kt_pose *poses,
                            const kt_picture_options *options, kt_picture **picture, kt_error *error) {
    static const kt_picture_options standard;
    const counts n = count_picture(scene, model);
    const size_t size = lay_out(NULL, &n);
    kt_picture *made = aligned_alloc(KT_ARENA_ALIGNMENT, size);
    int *chains = calloc(n.bodies + n.solids, sizeof *chains);
    double *lengths = calloc(n.solids + n.joints, sizeof *lengths);
    kt_status status = KT_ERROR_MEMORY;
    if (made != NULL && chains != NULL && lengths != NULL) {
        memset(made, 0, size);
        (void)lay_out(made, &n);
        made->model = model;
        made->body_count = kt_model_body_count(model);
        made->gravity = scene->description.gravity;
        kt_picture_maker m = {.picture = made,
                              .scene = scene,
                              .description = &scene->description,
                              .options = options != NULL ? options : &standard,
                              .model = model,
                              .poses = poses,
                              .first = chains,
                              .next = chains + n.bodies};
        status = fill_picture(&m, lengths, error);
    } else {
        (void)kt_error_set(error, KT_ERROR_MEMORY, "picture", "there is not enough memory for the picture");
    }
    if (status == KT_OK)
        *picture = made;
    else
        kt_picture_free(made);
    free(chains);
    free(lengths);
    return status;
}

void kt_picture_free(kt_picture *picture) {
    for (int i = 0; picture != NULL && i < picture->mesh_count; i++)
        kt_mesh_free(&picture->meshes[i]);
    free(picture);
}
