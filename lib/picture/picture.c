/* The contents of a picture of a mechanism, from its description. */
#include "picture/picture.h"

#include "algebra/principal.h"
#include "base/arena.h"
#include "kinetree/descriptor.h"
#include "kinetree/mechanism.h"
#include "picture/load.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
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
    X(kt_picture_plane, planes, n->planes, "of contacts, rolling wheels and planar joints")                            \
    X(struct kt_mesh, meshes, n->meshes, "surfaces of solids")                                                         \
    X(int, part, n->bodies, "rigid part of each body")                                                                 \
    X(int, colour, n->bodies, "of each body")

KT_ARENA_LAYOUT(lay_out, kt_picture, KT_PICTURE_FIELDS, const counts *n)

/* An upper bound of the solids. A body has at most a solid for each shape, a point at its mass, and a rod to each
 * joint, loop and effect on it. Two rods connect it with the body to which it is fixed. */
static counts count(const kt_scene *scene, const kt_model *model) {
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

/* ---- frames ------------------------------------------------------------------------------------------------------ */

typedef struct maker {
    kt_picture *picture;
    const kt_scene *scene;
    const kt_description *description;
    const kt_picture_options *options;
    const kt_model *model;
    const kt_pose *poses;
    int *first, *next; /* solids of each rigid part, as chained lists: -1 ends one */
} maker;

/* The frame with z along an axis; the frame itself where the axis is zero. */
static kt_mat3 frame_along(kt_mat3 frame, kt_vec3 axis) {
    return kt_vec3_dot(axis, axis) > 0.0 ? kt_mat3_multiply(frame, kt_triad_from_axis(kt_vec3_normalize(axis), 2))
                                         : frame;
}

static kt_body_frame frame_of(const maker *m, const kt_end *end, kt_vec3 axis) {
    kt_body_frame frame = {.body = end->body != NULL ? kt_body_find(m->model, end->body) : 0};
    frame.body = frame.body > 0 ? frame.body : 0;
    const int marker = end->marker != NULL ? kt_marker_find(m->model, frame.body, end->marker) : -1;
    frame.pose.position = marker >= 0 ? kt_marker_at(m->model, frame.body, marker) : end->at;
    kt_mat3 turned = kt_solid_rotation(&end->rotation);
    if (marker >= 0)
        turned = kt_mat3_multiply(kt_marker_rotation(m->model, frame.body, marker), turned);
    frame.pose.rotation = frame_along(turned, axis);
    return frame;
}

kt_pose kt_body_frame_pose(const kt_body_frame *frame, const kt_pose *poses) {
    return kt_pose_compose(poses[frame->body], frame->pose);
}

static const kt_body *source_of(const maker *m, int body) {
    return &m->description->bodies[kt_body_source(m->model, body)];
}

/* ---- lists ------------------------------------------------------------------------------------------------------- */

static bool is_coupled(const maker *m, int body) {
    const char *name = kt_joint_name(m->model, body);
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        for (int k = 0; k < loop->term_count && loop->type == KT_LOOP_COUPLING; k++)
            if (strcmp(loop->terms[k].joint, name) == 0)
                return true;
    }
    return false;
}

/* Whether a slider of the world represents only a number, such as the length of a tendon. A coupling moves such a
 * slider; it has neither mass nor shape and carries nothing. */
static bool is_number(const maker *m, int body) {
    const kt_body *source = source_of(m, body);
    bool carries = false;
    for (int i = body + 1; i < m->picture->body_count; i++)
        carries = carries || kt_body_parent(m->model, i) == body;
    return source->joint.type == KT_JOINT_PRISMATIC && kt_body_parent(m->model, body) == 0 && !(source->mass > 0.0) &&
           source->shape.type == KT_SHAPE_NONE && source->shape_count == 0 && !carries && is_coupled(m, body);
}

static void list_joints(maker *m) {
    kt_picture *p = m->picture;
    for (int body = 1; body < p->body_count; body++) {
        const kt_joint *joint = &source_of(m, body)->joint;
        const int parent = kt_body_parent(m->model, body);
        p->part[body] = joint->type == KT_JOINT_FIXED ? p->part[parent] : body;
        if (joint->type == KT_JOINT_FIXED || is_number(m, body))
            continue;
        const bool has_axis = joint->type != KT_JOINT_SPHERICAL && joint->type != KT_JOINT_FREE;
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(joint->axis), 2);
        const bool has_axis2 = kt_vec3_dot(joint->axis2, joint->axis2) > 0.0;
        p->joints[p->joint_count++] = (kt_picture_joint){
            .type = joint->type,
            .body = body,
            .frame = {.body = parent,
                      .pose = {.rotation =
                                   frame_along(kt_solid_rotation(&joint->rotation), has_axis ? joint->axis : none),
                               .position = joint->at}},
            .child = kt_mat3_transpose(frame_along(kt_mat3_identity(), has_axis ? joint->axis : none)),
            .axis2 = has_axis2 ? kt_vec3_normalize(joint->axis2) : triad.x,
            .name = kt_joint_name(m->model, body)};
    }
}

/* Whether a key of the type refers to the member at this offset. */
static bool has_key(const kt_descriptor *type, size_t offset) {
    for (int i = 0; i < type->key_count; i++)
        if (type->keys[i].offset == offset)
            return true;
    return false;
}

static void list_loops(maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        const kt_descriptor *type = kt_loop_descriptor(loop->type);
        const bool two_axes = has_key(type, offsetof(kt_loop, axis2));
        if (!has_key(type, offsetof(kt_loop, between)))
            continue;
        p->loops[p->loop_count++] =
            (kt_picture_loop){.type = loop->type,
                              .loop = i,
                              .ends = {frame_of(m, &loop->between[0], loop->axis),
                                       frame_of(m, &loop->between[1], two_axes ? loop->axis2 : loop->axis)},
                              .radius = loop->radius,
                              .name = loop->name};
    }
}

int kt_body_of_joint(const kt_model *model, const char *name) {
    kt_error ignored;
    int body;
    return kt_joint_find(model, name, &body, &ignored) == KT_OK ? body : -1;
}

static int joint_of(const maker *m, const char *name) {
    const int body = name != NULL ? kt_body_of_joint(m->model, name) : -1;
    for (int i = 0; i < m->picture->joint_count && body > 0; i++)
        if (m->picture->joints[i].body == body)
            return i;
    return -1;
}

static void add_relation(maker *m, int loop, int joint, int other) {
    kt_picture *p = m->picture;
    const kt_loop *source = &m->description->loops[loop];
    p->relations[p->relation_count++] = (kt_picture_relation){source->type, loop, joint, other, source->name};
}

static void list_relations(maker *m) {
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        const kt_descriptor *type = kt_loop_descriptor(loop->type);
        if (has_key(type, offsetof(kt_loop, joint)) && joint_of(m, loop->joint) >= 0)
            add_relation(m, i, joint_of(m, loop->joint), -1);
        for (int k = 1; k < loop->term_count && has_key(type, offsetof(kt_loop, terms)); k++) {
            const int joint = joint_of(m, loop->terms[k - 1].joint), other = joint_of(m, loop->terms[k].joint);
            if (joint >= 0 && other >= 0)
                add_relation(m, i, joint, other);
        }
    }
}

/* How many ends the keys of a type fill. */
static int end_count_of(const kt_effect *effect) {
    const kt_descriptor *type = kt_effect_descriptor(effect->type);
    int count = type == NULL ? effect->end_count : 0; /* a caller's own effect */
    for (int i = 0; type != NULL && i < type->key_count; i++) {
        const kt_key_kind kind = type->keys[i].kind;
        count += kind == KT_KEY_ENDS ? 2 : kind == KT_KEY_END || kind == KT_KEY_BODY;
    }
    return count;
}

/* The coordinate of a loop in which an effect acts, as a joint: between the loop's ends, z along the motion. */
static int coordinate_of(maker *m, int effect) {
    kt_picture *p = m->picture;
    int k = 0;
    const int index = kt_effect_loop(m->model, effect, &k), body = kt_effect_body(m->model, effect, 0);
    for (int i = 0; i < p->joint_count && index < 0; i++)
        if (p->joints[i].body == body)
            return i;
    if (index < 0)
        return -1;
    const kt_loop *loop = &m->description->loops[index];
    const bool slides = kt_effect_is_sliding(m->model, effect);
    const bool in_plane = loop->type == KT_LOOP_PLANAR || loop->type == KT_LOOP_INPLANE;
    const bool second = loop->type == KT_LOOP_UNIVERSAL && k == 1;
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(second ? loop->axis2 : loop->axis), 2);
    p->joints[p->joint_count + p->coordinate_count] =
        (kt_picture_joint){.type = slides ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE,
                           .body = kt_effect_body(m->model, effect, 1),
                           .frame = frame_of(m, &loop->between[second],
                                             !slides || !in_plane ? triad.z
                                             : k == 0             ? triad.x
                                                                  : triad.y),
                           .child = kt_mat3_identity(),
                           .axis2 = triad.x,
                           .name = loop->name};
    return p->joint_count + p->coordinate_count++;
}

static void list_effects(maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < m->description->effect_count; i++) {
        const kt_effect *effect = &m->description->effects[i];
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
        const bool is_contact = effect->type == KT_EFFECT_CONTACT;
        const bool is_sphere = is_contact && kt_vec3_norm_wide(effect->axle) == 0.0;
        kt_picture_effect *shown = &p->effects[p->effect_count++];
        *shown = (kt_picture_effect){.type = effect->type,
                                     .effect = i,
                                     .joint = -1,
                                     .end_count = end_count_of(effect),
                                     .radius = is_sphere ? effect->radius : 0.0,
                                     .lower = effect->lower,
                                     .upper = effect->upper,
                                     .has_stiffness = effect->stiffness > 0.0,
                                     .has_damping = effect->damping > 0.0,
                                     .direction = kt_load_direction(effect),
                                     .is_carried = effect->frame == KT_FRAME_BODY || effect->type == KT_EFFECT_THRUST,
                                     .name = effect->name};
        for (int k = 0; k < shown->end_count; k++)
            shown->ends[k] = frame_of(m, &effect->between[k], is_contact && k == 1 ? effect->axis : none);
        if (shown->end_count == 0)
            shown->joint = coordinate_of(m, i);
    }
}

/* A plane, unless there is one already that is the same. */
static void list_plane(maker *m, kt_body_frame frame) {
    kt_picture *p = m->picture;
    const kt_pose pose = kt_body_frame_pose(&frame, m->poses);
    for (int i = 0; i < p->plane_count; i++) {
        const kt_pose other = kt_body_frame_pose(&p->planes[i].frame, m->poses);
        const kt_vec3 apart = kt_vec3_sub(pose.position, other.position);
        if (p->part[p->planes[i].frame.body] == p->part[frame.body] &&
            kt_vec3_dot(pose.rotation.z, other.rotation.z) > 1.0 - 1e-9 &&
            fabs(kt_vec3_dot(apart, other.rotation.z)) <= 1e-6 * p->size)
            return;
    }
    p->planes[p->plane_count++] = (kt_picture_plane){.frame = frame};
}

void kt_picture_fit_planes(kt_picture *p, const kt_pose *poses, kt_bounds bounds) {
    const kt_vec3 middle = kt_vec3_scale(0.5, kt_vec3_add(bounds.low, bounds.high));
    const double size = kt_vec3_norm(kt_vec3_sub(bounds.high, bounds.low));
    for (int i = 0; i < p->plane_count; i++) {
        kt_body_frame *frame = &p->planes[i].frame;
        const kt_pose pose = kt_body_frame_pose(frame, poses);
        const double height = kt_vec3_dot(pose.rotation.z, kt_vec3_sub(middle, pose.position));
        const kt_vec3 foot = kt_vec3_sub(middle, kt_vec3_scale(height, pose.rotation.z));
        frame->pose.position = kt_pose_apply(kt_pose_invert(poses[frame->body]), foot);
        p->planes[i].half = 0.6 * fmax(size, 0.5 * p->size);
    }
}

static void list_planes(maker *m, kt_bounds bounds) {
    kt_picture *p = m->picture;
    for (int i = 0; i < p->loop_count; i++)
        if (p->loops[i].type == KT_LOOP_ROLLING)
            list_plane(m, p->loops[i].ends[1]);
    for (int i = 0; i < p->effect_count; i++)
        if (p->effects[i].type == KT_EFFECT_CONTACT)
            list_plane(m, p->effects[i].ends[1]);
    for (int i = 0; i < p->joint_count; i++)
        if (p->joints[i].type == KT_JOINT_PLANAR)
            list_plane(m, p->joints[i].frame);
    kt_picture_fit_planes(p, m->poses, bounds);
}

/* ---- sizes ------------------------------------------------------------------------------------------------------- */

kt_bounds kt_bounds_empty(void) {
    return (kt_bounds){.low = {DBL_MAX, DBL_MAX, DBL_MAX}, .high = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
}

static void widen(kt_bounds *b, kt_vec3 point) {
    b->low = kt_vec3_make(fmin(b->low.x, point.x), fmin(b->low.y, point.y), fmin(b->low.z, point.z));
    b->high = kt_vec3_make(fmax(b->high.x, point.x), fmax(b->high.y, point.y), fmax(b->high.z, point.z));
}

static void widen_by_solid(kt_bounds *bounds, const kt_solid *solid, const kt_pose *poses) {
    const kt_pose pose = kt_pose_compose(poses[solid->body], solid->pose);
    const kt_vec3 reach = kt_vec3_make(kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).x),
                                       kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).y),
                                       kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).z));
    widen(bounds, kt_vec3_sub(pose.position, reach));
    widen(bounds, kt_vec3_add(pose.position, reach));
}

bool kt_picture_shows_end(const kt_picture_effect *effect, int end) {
    return !(effect->type == KT_EFFECT_CONTACT && end == 1) &&
           !(effect->type == KT_EFFECT_ATTRACTION && effect->ends[end].body == 0);
}

kt_bounds kt_picture_widen(const kt_picture *p, const kt_pose *poses, kt_bounds bounds) {
    for (int i = 0; i < p->solid_count; i++)
        widen_by_solid(&bounds, &p->solids[i], poses);
    for (int i = 0; i < p->joint_count; i++)
        if (p->joints[i].type != KT_JOINT_FREE && p->joints[i].type != KT_JOINT_PLANAR)
            widen(&bounds, kt_body_frame_pose(&p->joints[i].frame, poses).position);
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < (p->loops[i].type == KT_LOOP_ROLLING ? 1 : 2); k++)
            widen(&bounds, kt_body_frame_pose(&p->loops[i].ends[k], poses).position);
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < p->loops[i].stroke_count; k++)
            widen(&bounds, kt_pose_apply(kt_body_frame_pose(&p->loops[i].ends[0], poses), p->loops[i].strokes[k].to));
    for (int i = 0; i < p->effect_count; i++)
        for (int k = 0; k < p->effects[i].end_count; k++)
            if (kt_picture_shows_end(&p->effects[i], k))
                widen(&bounds, kt_body_frame_pose(&p->effects[i].ends[k], poses).position);
    return bounds;
}

static int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of the lengths of links: of rods, and between the joints of a body; 0 if there are none. */
static double median_length(const maker *m, double *lengths) {
    const kt_picture *p = m->picture;
    size_t n = 0;
    for (int i = 0; i < p->solid_count; i++)
        if (p->solids[i].type == KT_SOLID_ROD && p->solids[i].half.z > 0.0)
            lengths[n++] = 2.0 * p->solids[i].half.z;
    for (int i = 0; i < p->joint_count; i++) {
        const double length = kt_vec3_norm(p->joints[i].frame.pose.position);
        if (p->joints[i].frame.body > 0 && length > 0.0)
            lengths[n++] = length;
    }
    qsort(lengths, n, sizeof *lengths, compare_numbers);
    return n > 0 ? lengths[n / 2] : 0.0;
}

/* Whether a body has solids of its own, of those that are listed so far. */
static bool has_own(const maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->solids[i].body != body)
        i = m->next[i];
    return i >= 0;
}

/* Size of the mechanism, and lengths that suit this size. Centres of mass count, too: a body may have no shape. */
static kt_bounds measure_picture(maker *m, double *lengths) {
    kt_picture *p = m->picture;
    kt_bounds bounds = kt_picture_widen(p, m->poses, kt_bounds_empty());
    for (int body = 1; body < p->body_count; body++)
        if (!has_own(m, body) && source_of(m, body)->mass > 0.0)
            widen(&bounds, kt_pose_apply(m->poses[body], source_of(m, body)->com));
    if (bounds.low.x > bounds.high.x)
        widen(&bounds, kt_vec3_make(0.0, 0.0, 0.0));
    p->size = kt_vec3_norm_wide(kt_vec3_sub(bounds.high, bounds.low));
    p->size = p->size > 0.0 && isfinite(p->size) ? p->size : 1.0;
    const double median = median_length(m, lengths);
    p->radius = 0.011 * p->size;
    if (median > 0.0)
        p->radius = fmax(fmin(p->radius, 0.06 * median), 0.0008 * p->size);
    return bounds;
}

/* ---- solids ------------------------------------------------------------------------------------------------------ */

static void add_solid(maker *m, kt_solid solid) {
    kt_picture *p = m->picture;
    m->next[p->solid_count] = m->first[p->part[solid.body]];
    m->first[p->part[solid.body]] = p->solid_count;
    p->solids[p->solid_count++] = solid;
}

static void add_shape(maker *m, int body, const kt_shape *shape) {
    kt_solid solid = {.body = body};
    if (kt_solid_of_shape(shape, &solid))
        add_solid(m, solid);
    for (size_t k = 0; k < kt_solid_edge_count(shape); k++) {
        solid = kt_solid_edge(shape, k);
        solid.body = body;
        add_solid(m, solid);
    }
}

static void list_shapes(maker *m) {
    for (int body = 1; body < m->picture->body_count; body++) {
        add_shape(m, body, &source_of(m, body)->shape);
        for (int i = 0; i < source_of(m, body)->shape_count; i++)
            add_shape(m, body, &source_of(m, body)->shapes[i]);
    }
}

/* The meshes that can be read; each has its part of the triangles. */
static kt_status list_meshes(maker *m, kt_error *error) {
    kt_picture *p = m->picture;
    const int count = m->scene->mesh_count, all = m->options->triangles > 0 ? m->options->triangles : 400000;
    for (int i = 0; i < count; i++) {
        kt_error reason = {0};
        kt_solid solid = {.body = kt_body_find(m->model, m->scene->meshes[i].body)};
        if (solid.body < 0)
            continue;
        const kt_status status =
            kt_mesh_load(&m->scene->meshes[i], all / count, &p->meshes[p->mesh_count], &solid, &reason);
        if (status == KT_ERROR_MEMORY)
            return kt_error_set(error, status, "picture", "%s", reason.message);
        if (status != KT_OK) {
            if (p->lost_meshes++ == 0)
                (void)snprintf(p->lost_reason, sizeof p->lost_reason, "%s: %s", reason.where, reason.message);
            continue;
        }
        solid.mesh = &p->meshes[p->mesh_count++];
        add_solid(m, solid);
    }
    return KT_OK;
}

/* The half edges a, b, c of a box of mass m follow from its principal moments of inertia:
 *
 *     I_x = m (b^2 + c^2) / 3,    a^2 = 3/2 (I_y + I_z - I_x) / m
 */
static void list_boxes(maker *m) {
    for (int body = 1; body < m->picture->body_count; body++) {
        const kt_body *source = source_of(m, body);
        kt_solid solid = {.type = KT_SOLID_BOX, .source = KT_SOURCE_INERTIA, .body = body};
        kt_sym3 inertia;
        if (!(source->mass > 0.0) || kt_body_inertia(source, &solid.pose.position, &inertia, NULL) != KT_OK)
            continue;
        solid.pose.rotation = kt_principal_axes(inertia);
        const kt_sym3 d = kt_sym3_rotate(kt_mat3_transpose(solid.pose.rotation), inertia);
        const double k = 1.5 / source->mass;
        solid.half = kt_vec3_make(sqrt(fmax(k * (d.yy + d.zz - d.xx), 0.0)), sqrt(fmax(k * (d.zz + d.xx - d.yy), 0.0)),
                                  sqrt(fmax(k * (d.xx + d.yy - d.zz), 0.0)));
        add_solid(m, solid);
    }
}

/* Slender rods and points, whose radius follows from the size. */
static void thicken(maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < p->solid_count; i++)
        if (p->solids[i].source == KT_SOURCE_SLENDER) {
            const double radius = p->solids[i].type == KT_SOLID_SPHERE ? 2.4 * p->radius : p->radius;
            p->solids[i].half.x = p->solids[i].half.y = radius;
            if (p->solids[i].type == KT_SOLID_SPHERE)
                p->solids[i].half.z = radius;
        } else if (p->solids[i].source == KT_SOURCE_INERTIA) { /* inertias of points and rods */
            const kt_vec3 half = p->solids[i].half;
            const double least = 0.5 * p->radius;
            p->solids[i].half = kt_vec3_make(fmax(half.x, least), fmax(half.y, least), fmax(half.z, least));
        }
}

static kt_solid thin_rod(const maker *m, int body, kt_vec3 from, kt_vec3 to) {
    kt_solid rod = kt_solid_rod(from, to, 0.7 * m->picture->radius);
    rod.body = body;
    rod.source = KT_SOURCE_IMPLIED;
    return rod;
}

/* Whether a rigid part has a mesh. Frames of joints need not be on the mesh, and a body without looks may be inside of
 * it (a sensor, a screw). */
static bool has_mesh_near(const maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->solids[i].mesh == NULL)
        i = m->next[i];
    return i >= 0;
}

/* The mass of a body without shape: a ball; the body of a slider: a block along its guide. */
static void imply_mass(maker *m, int body) {
    const kt_body *source = source_of(m, body);
    const double r = m->picture->radius;
    const bool slides = source->joint.type == KT_JOINT_PRISMATIC;
    kt_solid solid = {.type = slides ? KT_SOLID_BOX : KT_SOLID_SPHERE,
                      .source = KT_SOURCE_IMPLIED,
                      .body = body,
                      .half =
                          slides ? kt_vec3_make(2.0 * r, 2.0 * r, 3.5 * r) : kt_vec3_make(2.4 * r, 2.4 * r, 2.4 * r)};
    solid.pose.rotation = slides ? kt_triad_from_axis(kt_vec3_normalize(source->joint.axis), 2) : kt_mat3_identity();
    solid.pose.position = slides ? kt_vec3_make(0.0, 0.0, 0.0) : source->com;
    if (!has_own(m, body) && !has_mesh_near(m, body) && (source->mass > 0.0 || (slides && !is_number(m, body))))
        add_solid(m, solid);
}

/* Connects a point of a body with the nearest solid of its rigid part, if the point is not at a solid already. If
 * `only` is not -1, only solids of that body count. */
static void attach_to(maker *m, int body, kt_vec3 point, int only) {
    const kt_picture *p = m->picture;
    const kt_vec3 at = kt_pose_apply(m->poses[body], point);
    kt_vec3 nearest = at;
    double least = DBL_MAX;
    if (has_mesh_near(m, body))
        return;
    for (int i = m->first[p->part[body]]; i >= 0; i = m->next[i]) {
        if (only >= 0 && p->solids[i].body != only)
            continue;
        const kt_pose pose = kt_pose_compose(m->poses[p->solids[i].body], p->solids[i].pose);
        const kt_vec3 local = kt_pose_apply(kt_pose_invert(pose), at);
        const kt_vec3 found = kt_pose_apply(pose, kt_solid_nearest(&p->solids[i], local));
        const double distance = kt_vec3_norm(kt_vec3_sub(found, at));
        if (distance < least) {
            least = distance;
            nearest = found;
        }
    }
    if (least < DBL_MAX && least > 1.5 * p->radius)
        add_solid(m, thin_rod(m, body, point, kt_pose_apply(kt_pose_invert(m->poses[body]), nearest)));
}

/* Among bodies that are fixed to the world, only the solids of the body itself count. */
static void attach(maker *m, int body, kt_vec3 point) {
    attach_to(m, body, point, m->picture->part[body] == 0 ? body : -1);
}

/* Whether a body has a solid yet. Any solid of its rigid part counts; if that is fixed to the world, only its own. */
static bool has_solid(const maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->part[body] == 0 && p->solids[i].body != body)
        i = m->next[i];
    return i >= 0;
}

/* A body without any solid is a star of rods from its own joint, or, if it is fixed to the world, from its origin. */
static void begin_star(maker *m, int body, kt_vec3 point) {
    const kt_joint_type type = source_of(m, body)->joint.type;
    const bool is_base = m->picture->part[body] == 0;
    const bool has_place = is_base || (type != KT_JOINT_FREE && type != KT_JOINT_FIXED);
    if (has_place && !has_solid(m, body) && kt_vec3_norm(point) > 1.5 * m->picture->radius)
        add_solid(m, thin_rod(m, body, kt_vec3_make(0.0, 0.0, 0.0), point));
    else
        attach(m, body, point);
}

/* A body that is fixed to one without any solid is at the end of a rod, as a joint there would be. */
static void attach_fixed(maker *m, int body) {
    const kt_body *source = source_of(m, body);
    const int parent = source->parent != NULL ? kt_body_find(m->picture->model, source->parent) : 0;
    if (parent > 0 && m->picture->part[body] > 0 && source->joint.type == KT_JOINT_FIXED && !has_solid(m, body))
        begin_star(m, parent, source->joint.at);
}

/* The body's own solids are all implied, and there are some. */
static bool is_implied(const maker *m, int body) {
    const kt_picture *p = m->picture;
    bool has_implied = false;
    for (int i = m->first[p->part[body]]; i >= 0; i = m->next[i])
        if (p->solids[i].body == body && p->solids[i].source != KT_SOURCE_IMPLIED)
            return false;
        else
            has_implied = has_implied || p->solids[i].body == body;
    return has_implied;
}

/* Joins a body with the one to which it is fixed, across bodies without solids. Rods lead from its own solids to those
 * of the next body that has some. Two bodies with shapes from the scene stay as they are. */
static void bridge_fixed(maker *m, int body) {
    int on = body;
    do
        on = source_of(m, on)->joint.type == KT_JOINT_FIXED ? kt_body_parent(m->model, on) : 0;
    while (on > 0 && !has_own(m, on));
    if (on <= 0 || !has_own(m, body) || !(is_implied(m, body) || is_implied(m, on)))
        return;
    const kt_vec3 origin = m->poses[body].position;
    attach_to(m, body, kt_vec3_make(0.0, 0.0, 0.0), body);
    attach_to(m, on, kt_pose_apply(kt_pose_invert(m->poses[on]), origin), on);
}

static void attach_frame(maker *m, const kt_body_frame *frame) {
    if (frame->body > 0)
        begin_star(m, frame->body, frame->pose.position);
}

/* Whether a joint's place is fixed to the body that it carries. */
static bool is_pivot(kt_joint_type type) {
    return type == KT_JOINT_REVOLUTE || type == KT_JOINT_UNIVERSAL || type == KT_JOINT_SPHERICAL ||
           type == KT_JOINT_FIXED;
}

static void imply_solids(maker *m) {
    const kt_picture *p = m->picture;
    for (int body = 1; body < p->body_count; body++)
        imply_mass(m, body);
    for (int body = 1; body < p->body_count; body++) {
        if (is_pivot(source_of(m, body)->joint.type))
            attach(m, body, kt_vec3_make(0.0, 0.0, 0.0));
    }
    for (int i = 0; i < p->joint_count + p->coordinate_count; i++)
        if (p->joints[i].type != KT_JOINT_FREE && p->joints[i].type != KT_JOINT_PLANAR)
            attach_frame(m, &p->joints[i].frame);
    for (int body = 1; body < p->body_count; body++) {
        attach_fixed(m, body);
        bridge_fixed(m, body);
    }
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < (p->loops[i].type == KT_LOOP_ROLLING ? 1 : 2); k++)
            attach_frame(m, &p->loops[i].ends[k]);
    for (int i = 0; i < p->effect_count; i++)
        for (int k = 0; k < p->effects[i].end_count; k++)
            if (kt_picture_shows_end(&p->effects[i], k))
                attach_frame(m, &p->effects[i].ends[k]);
}

/* ---- colours ----------------------------------------------------------------------------------------------------- */

enum { COLOURS = 6 };

/* Colours in turn; a rigid part takes the next one that no neighbour has that is coloured already. */
static void choose_colours(maker *m) {
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
static bool keeps_plane(const maker *m, const kt_picture_joint *joint, kt_vec3 normal) {
    const double c = fabs(kt_vec3_dot(kt_body_frame_pose(&joint->frame, m->poses).rotation.z, normal));
    if (joint->type == KT_JOINT_REVOLUTE || joint->type == KT_JOINT_PLANAR)
        return c > 1.0 - 1e-9;
    return joint->type == KT_JOINT_PRISMATIC && c < 1e-6;
}

/* The axis of the first joint that turns; where all slide, a normal of the first guide, with gravity in the plane. */
static kt_vec3 candidate_normal(const maker *m) {
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

static void find_plane(maker *m) {
    kt_picture *p = m->picture;
    p->normal = face_viewer(candidate_normal(m));
    p->is_planar = true;
    for (int i = 0; i < p->joint_count; i++)
        p->is_planar = p->is_planar && keeps_plane(m, &p->joints[i], p->normal);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

static kt_status fill(maker *m, double *lengths, kt_error *error) {
    kt_status status = KT_OK;
    kt_picture *p = m->picture;
    for (int i = 0; i < p->body_count; i++)
        m->first[i] = -1;
    list_joints(m);
    list_loops(m);
    list_relations(m);
    list_effects(m);
    if (m->options->boxes) {
        list_boxes(m);
    } else {
        list_shapes(m);
        status = list_meshes(m, error);
    }
    const kt_bounds bounds = measure_picture(m, lengths);
    list_planes(m, bounds);
    kt_strokes_list(p, m->description->loops, m->poses, bounds);
    thicken(m);
    imply_solids(m);
    choose_colours(m);
    find_plane(m);
    return status;
}

kt_status kt_picture_create(const kt_scene *scene, const kt_model *model, const kt_pose *poses,
                            const kt_picture_options *options, kt_picture **picture, kt_error *error) {
    static const kt_picture_options standard;
    const counts n = count(scene, model);
    kt_picture *made = calloc(1, lay_out(NULL, &n));
    int *chains = calloc(n.bodies + n.solids, sizeof *chains);
    double *lengths = calloc(n.solids + n.joints, sizeof *lengths);
    kt_status status = KT_ERROR_MEMORY;
    if (made != NULL && chains != NULL && lengths != NULL) {
        (void)lay_out(made, &n);
        made->model = model;
        made->body_count = kt_model_body_count(model);
        made->gravity = scene->description.gravity;
        maker m = {.picture = made,
                   .scene = scene,
                   .description = &scene->description,
                   .options = options != NULL ? options : &standard,
                   .model = model,
                   .poses = poses,
                   .first = chains,
                   .next = chains + n.bodies};
        status = fill(&m, lengths, error);
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
