/* From a checked description to the model: orders the bodies, creates the links, and lays everything out in one block.
 *
 * Bodies keep the description's order, except that parents precede their children; coordinates are in the order of the
 * bodies. Links are numbered depth first, so that the recursions mostly pass from a link to the next one in memory.
 * Bodies fixed to one another share a link, whose inertia is the sum of theirs.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "base/aligned.h"
#include "base/arena.h"
#include "compile/compile.h"
#include "compile/find_planar.h"
#include "dynamics/dynamics.h"
#include "joint/joint.h"
#include "reduction/kernel.h"

#include <math.h>
#include <string.h>

/* Working arrays of a compilation, in one block. */
#define BUILD_FIELDS(X)                                                                                                \
    X(int32_t, order, n, "description index of body 1, 2, ...")                                                        \
    X(int32_t, body_of, n, "body of a description index; 0: not yet")                                                  \
    X(int32_t, first, n + 1, "first child of a body, 0: none")                                                         \
    X(int32_t, next, n + 1, "next sibling of a body, 0: none")                                                         \
    X(int32_t, stack, n + 1, "of bodies to visit")                                                                     \
    X(double, mass, (KT_ELEMENT_MAX * n + 1), "that a link carries, itself included")                                  \
    X(double, trace, (KT_ELEMENT_MAX * n + 1), "sum of the traces of the inertias that a link carries")                \
    X(double, shift, (KT_ELEMENT_MAX * n + 1), "largest mass times offset^2 among the steps down from a link")         \
    X(kt_body_plane, moves, n + 1, "how bodies move in planes")                                                        \
    X(kt_planar_loop, flat, loops, "loops as they lie in planes")                                                      \
    X(kt_plane, plane, n + 1, "planes")                                                                                \
    X(int32_t, tree, n + 1, "bodies that carry a tree")                                                                \
    X(int32_t, sorted, n + 1, "the same in the order of their links")                                                  \
    X(int32_t, place, n + 2, "of the trees of a plane among these")                                                    \
    X(char, table, table_size, "of the names")

typedef struct build {
    const kt_description *description;
    kt_report *report; /* receives the faults that the whole tree shows; NULL: no report */
    void *user;
    bool trial; /* the model is built only to find these faults */
    kt_model *model;
    kt_names names;
    KT_ARENA_DECLARE(BUILD_FIELDS)
} build;

KT_ARENA_ARRAYS(place_arrays, build, BUILD_FIELDS, size_t n, size_t loops, size_t table_size)

static bool is_world(const char *name) { return !name || strcmp(name, "world") == 0; }

static int parent_index(const build *b, int i) {
    const char *parent = b->description->bodies[i].parent;
    return is_world(parent) ? -1 : kt_names_find(&b->names, KT_NAMES_OF_BODIES, parent);
}

/* Orders the bodies: each body follows those of its ancestors that are not yet in `order`. O(n), since every body
 * enters the stack once. */
static void order_bodies(build *b) {
    const int n = b->description->body_count;
    int32_t placed = 0;
    for (int i = 0; i < n; i++) {
        int depth = 0;
        for (int j = i; j >= 0 && !b->body_of[j]; j = parent_index(b, j))
            b->stack[depth++] = j;
        while (depth > 0) {
            const int32_t j = b->stack[--depth];
            b->order[placed] = j;
            b->body_of[j] = ++placed;
        }
    }
}

/* Counts the elements of the arrays of the tree. Spatial counts leave out the trees that move in planes. */
static void count_all(const build *b, kt_counts *n) {
    const kt_description *d = b->description;
    *n = (kt_counts){.link = 1, .body = (size_t)d->body_count + 1, .spatial = 1};
    n->text = sizeof "world" + strlen(d->name ? d->name : "") + 1;
    for (int i = 0; i < d->body_count; i++) {
        const kt_body *body = &d->bodies[i];
        const kt_joint_size *size = &kt_joint_sizes[body->joint.type];
        kt_element elements[KT_ELEMENT_MAX];
        const int count = kt_joint_elements(&body->joint, elements);
        const bool is_spatial = b->moves[b->moves[b->body_of[i]].tree].plane < 0;
        n->link += (size_t)count;
        n->spatial += is_spatial ? (size_t)count : 0;
        n->spatial_v += is_spatial ? (size_t)size->nv : 0;
        for (int k = 0; k < count; k++) {
            const size_t angles = (size_t)kt_motion_facts_of(elements[k].motion).angles;
            n->angle += angles;
            n->spatial_angle += is_spatial ? angles : 0;
        }
        n->q += (size_t)size->nq;
        n->v += (size_t)size->nv;
        n->marker += (size_t)body->marker_count;
        n->text += strlen(body->name) + 1;
        n->varying += body->variable_mass != NULL;
        n->named_joint += body->joint.name != NULL;
        n->limit += kt_joint_is_limited(&body->joint);
        n->text += body->joint.name ? strlen(body->joint.name) + 1 : 0;
        for (int k = 0; k < body->marker_count; k++)
            n->text += strlen(body->markers[k].name) + 1;
    }
    n->planar = n->link > n->spatial ? n->link - n->spatial + 1 : 0;
    n->index = kt_names_size(n->body + n->named_joint + n->marker);
}

/* Finds the trees that move in planes; returns the number of planes. */
static size_t find_planes(build *b, kt_plan plan) {
    const size_t n = (size_t)b->description->body_count;
    for (size_t i = 1; i <= n; i++) {
        const int up = parent_index(b, b->order[i - 1]);
        b->moves[i].source = b->order[i - 1];
        b->moves[i].parent = up < 0 ? 0 : b->body_of[up];
    }
    const kt_ordered ordered = {.description = b->description, .names = &b->names, .body_of = b->body_of, .count = n};
    const size_t planes = kt_planes_find(&ordered, b->moves, b->plane, b->flat);
    const bool in_space = plan == KT_PLAN_SPATIAL;
    for (size_t i = 1; i <= n && in_space; i++)
        b->moves[i].plane = -1;
    return in_space ? 0 : planes;
}

/* Marks the coordinates whose initial values the description gives. The last three velocity coordinates of a joint with
 * a quaternion are its angular velocity. */
static void mark_given_coordinates(kt_model *m, const kt_joint *joint, const kt_body_record *record) {
    const int quaternion = kt_joint_quaternion(joint->type), nv = kt_joint_sizes[joint->type].nv;
    const unsigned given = kt_joint_given(joint);
    for (int k = 0; k < nv; k++) {
        const bool rotates = quaternion >= 0 && k >= quaternion;
        const unsigned position = rotates ? KT_GIVEN_ORIENTATION : KT_GIVEN_POSITION;
        const unsigned velocity = rotates && quaternion > 0 ? KT_GIVEN_ANGULAR : KT_GIVEN_VELOCITY;
        m->given[record->v + k] =
            (uint8_t)((given & position ? KT_POSITION_GIVEN : 0) | (given & velocity ? KT_VELOCITY_GIVEN : 0));
    }
}

/* Stores the initial coordinates of a joint; a quaternion of zeros means no rotation. */
static void store_initial_state(kt_model *m, const kt_joint *joint, const kt_body_record *record) {
    const kt_joint_size *size = &kt_joint_sizes[joint->type];
    const int quaternion = kt_joint_quaternion(joint->type);
    memcpy(m->q0 + record->q, joint->position, (size_t)size->nq * sizeof(double));
    memcpy(m->v0 + record->v, joint->velocity, (size_t)size->nv * sizeof(double));
    if (quaternion < 0)
        return;
    double *p = m->q0 + record->q + quaternion;
    kt_quat a = kt_quat_make(p[0], p[1], p[2], p[3]);
    if (a.w == 0.0 && a.x == 0.0 && a.y == 0.0 && a.z == 0.0)
        a.w = 1.0;
    if (fabs(kt_quat_norm_squared(a) - 1.0) > 1e-15) /* within rounding of 1, its bits are kept */
        a = kt_quat_normalize(a);
    p[0] = a.w;
    p[1] = a.x;
    p[2] = a.y;
    p[3] = a.z;
}

/* Fills body records, coordinates, markers and names, in the order of the bodies. */
static kt_status store_bodies(build *b, kt_error *error) {
    kt_model *m = b->model;
    const kt_description *d = b->description;
    size_t text = 0, marker = 0;
    int32_t q = 0, v = 0, limit = 0;
    m->body[0] = (kt_body_record){.in_link = kt_pose_identity(), .joint = kt_pose_identity(), .source = -1};
    m->body[0].name = kt_model_store_text(m, &text, "world");
    m->name = kt_model_store_text(m, &text, d->name ? d->name : "");
    kt_status status = KT_OK;
    for (int i = 0; i < d->body_count && status == KT_OK; i++) {
        const kt_body *body = &d->bodies[b->order[i]];
        const int self = i + 1, up = parent_index(b, b->order[i]);
        kt_body_record *r = &m->body[self];
        *r = (kt_body_record){.mass = body->mass, .source = b->order[i], .type = (int32_t)body->joint.type};
        r->parent = up < 0 ? 0 : b->body_of[up];
        r->q = q;
        r->v = v;
        q += kt_joint_sizes[r->type].nq;
        v += kt_joint_sizes[r->type].nv;
        status = kt_body_inertia(body, &r->com, &r->inertia, error);
        if (status == KT_OK)
            status = kt_rotation_evaluate(&body->joint.rotation, &r->joint.rotation, error);
        r->joint.position = body->joint.at;
        store_initial_state(m, &body->joint, r);
        mark_given_coordinates(m, &body->joint, r);
        if (kt_joint_is_limited(&body->joint)) {
            m->limit[limit] = body->joint.limits;
            r->limit = ++limit;
        }
        r->name = kt_model_store_text(m, &text, body->name);
        r->joint_name = body->joint.name ? kt_model_store_text(m, &text, body->joint.name) : r->name;
        r->marker = (int32_t)marker;
        r->marker_count = body->marker_count;
        for (int k = 0; k < body->marker_count && status == KT_OK; k++) {
            kt_marker_record *mark = &m->marker[marker++];
            mark->frame.position = body->markers[k].at;
            mark->name = kt_model_store_text(m, &text, body->markers[k].name);
            status = kt_rotation_evaluate(&body->markers[k].rotation, &mark->frame.rotation, error);
        }
    }
    return status;
}

/* Stores the axes at rest and the pitch of the last link. Unrotated axes with a pitch of 0 are the default and need no
 * entry. link->rest is the distance from the link to the entry, in doubles (kt_link_rest_of). */
static void store_rest(kt_model *m, kt_link *link, kt_mat3 axes, double pitch) {
    link->rest_is_rotated = !kt_mat3_is_same(axes, kt_mat3_identity());
    if (!link->rest_is_rotated && pitch == 0.0)
        return;
    kt_link_rest *rest = &m->rest[m->n.rest++];
    *rest = (kt_link_rest){.axes = axes, .pitch = pitch};
    link->rest = (int32_t)((const double *)(const void *)rest - (const double *)(const void *)link);
}

/* Creates the links of one body's joint, a chain that begins at its parent's link; *count, *angle: links and angles so
 * far. */
static void create_joint_links(kt_model *m, const kt_description *d, int32_t self, size_t *count, size_t *angle) {
    kt_body_record *body = &m->body[self];
    const kt_body_record *parent = &m->body[body->parent];
    kt_pose frame = kt_pose_compose(parent->in_link, body->joint); /* joint frame in the parent's link */
    kt_element elements[KT_ELEMENT_MAX];
    const int element_count = kt_joint_elements(&d->bodies[body->source].joint, elements);
    int32_t q = body->q, v = body->v, up = parent->link;
    for (int k = 0; k < element_count; k++) {
        const kt_element *e = &elements[k];
        kt_link *link = &m->link[*count];
        memset(link, 0, sizeof *link);
        link->group = -1;
        const bool same = k > 0 && kt_mat3_is_same(elements[k - 1].frame, e->frame); /* rest is exactly identity */
        const kt_mat3 rest = same ? kt_mat3_identity() : kt_mat3_multiply(frame.rotation, e->frame);
        link->at = frame.position;
        store_rest(m, link, rest, e->pitch);
        link->parent = up;
        link->body = self;
        link->motion = (uint8_t)e->motion;
        link->axis = (uint8_t)e->axis;
        link->q = q;
        link->v = v;
        q += kt_motion_facts_of(link->motion).positions;
        v += kt_motion_facts_of(link->motion).velocities;
        if (kt_motion_facts_of(link->motion).angles) {
            m->angle[*angle] = link->q;
            link->angle = (int32_t)(*angle)++;
        }
        /* the next frame is expressed in the axes of this link */
        frame = (kt_pose){.rotation = kt_mat3_transpose(e->frame), .position = kt_vec3_make(0.0, 0.0, 0.0)};
        up = (int32_t)(*count)++;
    }
    body->link = up;
    body->in_link = frame;
    body->fixed = up == 0;
    kt_link_load(m, body);
}

/* Creates the links of a body and of all bodies that it carries, depth first. With `stop`, creates only the links of
 * bodies that are part of the ground. Then the bodies that carry trees are stored in b->tree, and their number is
 * returned. */
static size_t create_tree_links(build *b, int32_t root, bool stop, size_t *count, size_t *angle) {
    size_t trees = 0;
    int depth = 0;
    b->stack[depth++] = root;
    while (depth > 0) {
        const int32_t i = b->stack[--depth];
        const bool hold = stop && b->moves[i].tree;
        if (hold)
            b->tree[trees++] = i;
        else if (i > 0)
            create_joint_links(b->model, b->description, i, count, angle);
        if (i != root && b->next[i])
            b->stack[depth++] = b->next[i];
        if (!hold && b->first[i])
            b->stack[depth++] = b->first[i];
    }
    return trees;
}

/* Sorts the trees: spatial trees first, then planar trees plane by plane, without changing the order within these
 * sets. */
static void sort_trees(build *b, size_t trees) {
    const size_t planes = b->model->n.plane;
    memset(b->place, 0, (planes + 2) * sizeof *b->place);
    for (size_t k = 0; k < trees; k++) /* place[p + 2]: trees in plane p; then, place[p + 1]: where they begin */
        b->place[b->moves[b->tree[k]].plane + 2]++;
    for (size_t p = 1; p < planes + 2; p++)
        b->place[p] += b->place[p - 1];
    for (size_t k = 0; k < trees; k++)
        b->sorted[b->place[b->moves[b->tree[k]].plane + 1]++] = b->tree[k];
}

/* Creates the links of all bodies: fixed bodies of the ground first, then tree by tree. Finds which links follow their
 * parents in memory. */
static void create_links(build *b) {
    kt_model *m = b->model;
    const int32_t n = (int32_t)m->n.body;
    size_t count = 1, angle = 0;
    m->n.rest = 0; /* counts the records at rest (store_rest) until all links exist */
    memset(&m->link[0], 0, sizeof m->link[0]);
    m->link[0].group = -1;
    for (int32_t i = n - 1; i > 0; i--) { /* children in the order of the bodies */
        b->next[i] = b->first[m->body[i].parent];
        b->first[m->body[i].parent] = i;
    }
    const size_t trees = create_tree_links(b, 0, true, &count, &angle);
    sort_trees(b, trees);
    for (size_t k = 0; k < trees; k++)
        (void)create_tree_links(b, b->sorted[k], false, &count, &angle);
    for (size_t i = 1; i < count; i++) {
        kt_link *up = &m->link[m->link[i].parent];
        m->link[i].follows = (size_t)m->link[i].parent == i - 1;
        up->leads |= m->link[i].follows;
        up->branches |= !m->link[i].follows;
    }
    m->n.rest = m->n.link; /* the length of the array */
}

/* Finds the order of the velocity coordinates, link by link, and the coordinates that each link carries. */
static void count_carried(kt_model *m) {
    int32_t dof = 0;
    m->ordered = true;
    for (size_t i = 1; i < m->n.link; i++) {
        const kt_link *link = &m->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++, dof++) {
            m->link_v[dof] = link->v + k;
            m->ordered &= m->link_v[dof] == dof;
        }
    }
    for (size_t i = m->n.link - 1; i > 0; i--) {
        kt_link *link = &m->link[i];
        link->end = link->end ? link->end : dof; /* no child has set it: its own are the last */
        if (m->link[link->parent].end == 0)
            m->link[link->parent].end = link->end;
        dof -= kt_link_dofs(link);
    }
}

/* Copies the armature of the joints, and marks the links that have armature, because every evaluation traverses the
 * links. */
static void gear_links(build *b) {
    kt_model *m = b->model;
    for (size_t i = 1; i < m->n.body; i++) {
        const kt_joint *joint = &b->description->bodies[m->body[i].source].joint;
        memcpy(m->armature + m->body[i].v, joint->armature,
               (size_t)kt_joint_sizes[m->body[i].type].nv * sizeof *m->armature);
    }
    kt_armature_update_flags(m);
}

/* link->size has the order of magnitude of the rigid inertia that a link carries. The size leaves out the growth of
 * that inertia with the cube of a chain's length, which is mostly in directions in which no joint moves. */
static void size_links(build *b) {
    kt_model *m = b->model;
    for (size_t i = m->n.link - 1; i > 0; i--) {
        kt_link *link = &m->link[i];
        b->mass[i] += link->mass;
        b->trace[i] += link->inertia.xx + link->inertia.yy + link->inertia.zz;
        const double pitch = kt_link_pitch(link), turning = b->trace[i] + b->shift[i],
                     step = b->mass[i] * kt_vec3_dot(link->at, link->at);
        link->size = kt_link_lengths(link) == kt_link_dofs(link) ? b->mass[i] : turning + pitch * pitch * b->mass[i];
        b->mass[link->parent] += b->mass[i];
        b->trace[link->parent] += b->trace[i];
        b->shift[link->parent] = fmax(b->shift[link->parent], fmax(b->shift[i], step));
    }
}

/* Lays out and fills the model of the tree, and attaches loops, effects, states and variable masses. A trial needs the
 * tree alone, because it only looks for faults. On failure b->model is what has been allocated so far. */
static kt_status build_model(build *b, const kt_model_options *options, kt_error *error) {
    kt_counts n;
    order_bodies(b);
    const size_t planes = find_planes(b, options->plan);
    count_all(b, &n);
    n.plane = planes;
    if (n.q > INT32_MAX || n.marker > INT32_MAX || n.text > UINT32_MAX) /* the ranges of the indices */
        return kt_error_set(error, KT_ERROR_MEMORY, "",
                            "the description is too large: %lu coordinates, %lu markers, names of %lu bytes",
                            (unsigned long)n.q, (unsigned long)n.marker, (unsigned long)n.text);
    n.rest = n.link; /* at most: the axes at rest are found later */
    const size_t bytes = kt_model_layout(NULL, &n);
    kt_model *m = kt_arena_allocate(bytes, "the model", error);
    if (!m)
        return KT_ERROR_MEMORY;
    memset(m, 0, bytes);
    (void)kt_model_layout(m, &n);
    m->n = n;
    m->gravity = kt_v4_from(b->description->gravity);
    m->metric = options->metric;
    m->structure = options->structure;
    m->excluded_forms = options->excluded_forms;
    m->settable = options->settable;
    b->model = m;
    if (n.plane)
        memcpy(m->plane, b->plane, n.plane * sizeof *m->plane);
    kt_status status = store_bodies(b, error);
    if (status == KT_OK) {
        kt_model_name_all(m);
        create_links(b);
        count_carried(m);
        kt_articulated_number(m);
        size_links(b);
        kt_planar_links_fill(m, b->moves);
        m->exceeds_caches = m->n.link > KT_LINKS_NEAR;
        m->isa = kt_isa_resolve(options->isa);
        gear_links(b);
        m->forward = kt_forward_tree;
        m->reduction = kt_reduction_kind_of(options->reduction, m->isa);
        m->group_kernels = kt_reduction_kernels_of(m);
        if (m->isa == KT_ISA_AUTO)
            status = kt_error_set(error, KT_ERROR_UNSUPPORTED, "options.isa",
                                  "this processor or build does not have that instruction set; use KT_ISA_AUTO");
    }
    if (status == KT_OK)
        status = kt_tree_check(m, b->description, b->report, b->user, error);
    if (status == KT_OK && !b->trial &&
        (b->description->loop_count || b->description->effect_count || b->description->state_count || n.varying))
        status = kt_model_attach(&b->model, b->description, b->flat, error);
    return status;
}

/* Names that loops refer to: of bodies and joints and, with loops, of markers. */
static size_t name_count(const kt_description *d) {
    size_t count = 2 * (size_t)d->body_count;
    for (int i = 0; i < d->body_count && d->loop_count > 0; i++)
        count += (size_t)d->bodies[i].marker_count;
    return count;
}

static void add_description_names(kt_names *names, const kt_description *d) {
    for (int i = 0; i < d->body_count; i++) {
        (void)kt_names_add(names, KT_NAMES_OF_BODIES, d->bodies[i].name, i);
        (void)kt_names_add(names, KT_NAMES_OF_JOINTS, kt_joint_name_of(&d->bodies[i]), i);
        for (int k = 0; k < d->bodies[i].marker_count && d->loop_count > 0; k++)
            (void)kt_names_add(names, i, d->bodies[i].markers[k].name, k);
    }
}

/* Builds the model from the description in b; b also selects a trial, which only finds faults. */
static kt_status build_all(build *b, const kt_model_options *options, kt_error *error) {
    const kt_description *d = b->description;
    const size_t n = (size_t)d->body_count, loops = (size_t)d->loop_count, names = name_count(d);
    const size_t table = kt_names_size(names);
    const size_t bytes = place_arrays(NULL, NULL, n, loops, table);
    void *memory = kt_arena_allocate(bytes, "compiling the description", error);
    if (!memory)
        return KT_ERROR_MEMORY;
    memset(memory, 0, bytes);
    (void)place_arrays(b, memory, n, loops, table);
    kt_names_init(&b->names, names, b->table);
    add_description_names(&b->names, d);
    const kt_status status = build_model(b, options, error);
    kt_aligned_release(memory);
    return status;
}

kt_status kt_model_build(const kt_description *description, const kt_model_options *options, kt_model **model,
                         kt_error *error) {
    build b = {.description = description};
    const kt_status status = build_all(&b, options, error);
    if (status == KT_OK) {
        kt_masses_attach(b.model);
        kt_massless_attach(b.model);
        kt_model_identify(b.model);
        kt_model_seal(b.model);
        *model = b.model;
    } else {
        kt_aligned_release(b.model);
    }
    return status;
}

kt_status kt_model_try(const kt_description *description, kt_report *report, void *user, kt_error *error) {
    const kt_model_options options = kt_model_options_default();
    build b = {.description = description, .report = report, .user = user, .trial = true};
    const kt_status status = build_all(&b, &options, error);
    kt_aligned_release(b.model);
    return status;
}
