/* Contacts of the collisions of URDF and SDF with planes.
 *
 * The numbers of MuJoCo that these formats lack are its defaults, with elliptic cones and an impratio of RATIO, with
 * which feet hardly creep. Friction is that of the file. The smaller friction of two shapes applies, as in Gazebo.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/file.h"
#include "kinetree/dynamics.h"
#include "linear/cholesky.h"
#include "robot/robot_contact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const kt_contact_cone cone = {.shortest = 0.0, .ratio = 10.0};

typedef struct touching {
    kt_collisions *c;
    kt_draft *d;
    const kt_robot_source *source;
    double gravity;
    kt_namer names;
    double *mobility; /* of each body */
    bool *moves;      /* whether a joint moves the body */
} touching;

static const kt_collision *collision_at(const kt_collisions *c, int i) {
    return (const kt_collision *)c->items.items + i;
}

void kt_collisions_add(kt_collisions *c, kt_reader *r, const kt_robot_options *o, const kt_collision *item) {
    kt_left_count(&c->all, item->element);
    kt_collision *kept = o->contacts ? kt_list_add(r, &r->scratch, &c->items, sizeof *kept) : NULL;
    if (kept != NULL)
        *kept = *item;
}

/* ---- friction ---------------------------------------------------------------------------------------------------- */

static double proximity_number(const kt_element *properties, const char *child) {
    const kt_element *e = kt_xml_child(properties, child);
    const char *text = e != NULL ? kt_element_value(e) : NULL;
    double value;
    return text != NULL && kt_parse_numbers(text, 1, &value) == 1 ? value : -1.0;
}

double kt_friction_of_drake(kt_collisions *c, const kt_element *collision) {
    const kt_element *properties = kt_xml_child(collision, "drake:proximity_properties");
    if (properties == NULL)
        return -1.0;
    const double slip = proximity_number(properties, "drake:mu_dynamic");
    const double rest = proximity_number(properties, "drake:mu_static");
    if (slip >= 0.0 && rest >= 0.0 && slip != rest)
        kt_left_count(&c->standing, collision);
    return slip >= 0.0 ? slip : rest;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static void find_moving(touching *t) {
    const kt_draft *d = t->d;
    for (int i = 0; i < d->bodies.count; i++)
        for (int at = i, steps = 0; at >= 0 && steps < d->bodies.count; at = d->parents[at], steps++)
            t->moves[i] = t->moves[i] || kt_draft_body_at(d, at)->joint.type != KT_JOINT_FIXED;
}

static kt_status find_mobilities(touching *t, const kt_contact_tree *tree, kt_error *error) {
    const size_t nv = (size_t)kt_model_nv(tree->model);
    double *mass = kt_reader_take(t->d->r, &t->d->r->scratch, nv * nv + 7 * nv + 1, sizeof *mass);
    if (mass == NULL)
        return KT_ERROR_MEMORY;
    const kt_status status = kt_dynamics_mass(tree->model, tree->data, tree->q, mass, error);
    if (status != KT_OK)
        return status;
    if (!kt_dense_cholesky(mass, nv, (int)nv, NULL))
        return KT_ERROR_SINGULAR;
    for (int i = 0; i < t->d->bodies.count; i++) {
        const kt_body *b = kt_draft_body_at(t->d, i);
        const int body = kt_body_find(tree->model, b->name);
        if (t->moves[i] && body > 0)
            t->mobility[i] = kt_contact_mobility(tree, body, b->com, mass, mass + nv * nv);
    }
    return KT_OK;
}

static bool prepare_bodies(touching *t) {
    kt_reader *r = t->d->r;
    kt_contact_tree tree;
    kt_error error = {0};
    const size_t count = (size_t)t->d->bodies.count + 1;
    t->mobility = kt_reader_take(r, &r->scratch, count, sizeof *t->mobility);
    t->moves = kt_reader_take(r, &r->scratch, count, sizeof *t->moves);
    if (t->mobility == NULL || t->moves == NULL)
        return false;
    find_moving(t);
    kt_status status = kt_contact_tree_make(r, t->d->bodies.items, t->d->bodies.count, &tree, &error);
    if (status == KT_OK) {
        status = find_mobilities(t, &tree, &error);
        kt_contact_tree_free(&tree);
    }
    return status != KT_ERROR_MEMORY || kt_reader_out_of_memory(r); /* else the least mobility applies */
}

/* The mass of all that the root of a body carries. */
static double touching_tree_mass(const touching *t, int body) {
    double mass = 0.0;
    const int *parents = t->d->parents, count = t->d->bodies.count;
    int root = body;
    for (int steps = 0; parents[root] >= 0 && steps < count; steps++)
        root = parents[root];
    for (int i = 0; i < count; i++) {
        int at = i;
        for (int steps = 0; parents[at] >= 0 && steps < count; steps++)
            at = parents[at];
        mass += at == root ? kt_draft_body_at(t->d, i)->mass : 0.0;
    }
    return mass;
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

/* Reads the points of a mesh that touch planes; returns their number. */
static int read_touching_points(touching *t, const kt_collision *item, kt_vec3 points[KT_CONTACT_POINTS_MOST]) {
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    char *text = NULL;
    size_t size = 0;
    const char *path = item->mesh != NULL ? kt_mesh_path(t->d->r, t->source, item->mesh) : NULL;
    kt_status status = path != NULL ? kt_file_read(path, &text, &size, &error) : KT_ERROR_FILE;
    if (status == KT_OK)
        status = kt_triangles_parse(text, size, &mesh, &error);
    free(text);
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(t->d->r);
    if (status != KT_OK)
        return 0;
    kt_triangles_place(&mesh, kt_pose_identity(), item->scale);
    const int count = kt_contact_mesh_points(&mesh, points);
    kt_triangles_free(&mesh);
    return count;
}

/* Whether the first joint that moves a body, upwards, turns it without limits. */
static bool turns_freely(const touching *t, int body) {
    int at = body;
    for (int steps = 0; steps < t->d->bodies.count && t->d->parents[at] >= 0; steps++) {
        if (kt_draft_body_at(t->d, at)->joint.type != KT_JOINT_FIXED)
            break;
        at = t->d->parents[at];
    }
    const kt_joint *joint = &kt_draft_body_at(t->d, at)->joint;
    return joint->type == KT_JOINT_FREE ||
           (joint->type == KT_JOINT_REVOLUTE && isinf(joint->limits.lower) && isinf(joint->limits.upper));
}

static bool collision_moves(const touching *t, const kt_collision *item) {
    return item->body >= 0 && t->moves[item->body];
}

/* Makes contacts of a collision with all planes. */
static void meet_planes(touching *t, const kt_collision *item, const kt_collision *floor) {
    const kt_body *body = kt_draft_body_at(t->d, item->body);
    kt_vec3 points[KT_CONTACT_POINTS_MOST];
    kt_contact_shape shape = {.element = item->element,
                              .name = kt_element_name(item->element, body->name),
                              .body = body->name,
                              .names = &t->names,
                              .solid = item->solid,
                              .points = points,
                              .pose = item->pose,
                              .mobility = t->mobility[item->body],
                              .turns_freely = turns_freely(t, item->body),
                              .mass = touching_tree_mass(t, item->body)};
    memcpy(shape.size, item->size, sizeof shape.size);
    if (item->solid == KT_SOLID_NONE)
        shape.point_count = read_touching_points(t, item, points);
    for (int i = floor != NULL ? -1 : 0; i < t->c->items.count && !t->d->r->out_of_memory; i++) {
        const kt_collision *plane = i < 0 ? floor : collision_at(t->c, i);
        if (!plane->is_plane || (plane->mask & item->mask) == 0 || collision_moves(t, plane))
            continue;
        const kt_ground ground = {.body = plane->body >= 0 ? kt_draft_body_at(t->d, plane->body)->name : NULL,
                                  .pose = plane->pose};
        kt_contact_law law = kt_contact_law_standard();
        law.friction = fmin(item->friction, plane->friction);
        law.torsion = fmax(item->torsion, plane->torsion);
        law.rolling = fmax(item->rolling, plane->rolling);
        law.condim = 6.0;
        kt_contact_make(t->d, &shape, &ground, &law, &cone, t->gravity, &t->c->touched);
    }
}

/* Makes boxes that are ground planes. */
static void find_floors(touching *t, kt_vec3 gravity) {
    kt_floors floors;
    kt_pose plane;
    if (!kt_floors_begin(&floors, t->d, gravity, t->c->items.count))
        return;
    for (int i = 0; i < t->c->items.count; i++) {
        const kt_collision *item = collision_at(t->c, i);
        if (!item->is_plane && collision_moves(t, item))
            kt_floors_add(&floors, kt_draft_body_at(t->d, item->body)->name, item->pose);
    }
    for (int i = 0; i < t->c->items.count; i++) {
        kt_collision *item = (kt_collision *)t->c->items.items + i;
        const char *body = item->body >= 0 ? kt_draft_body_at(t->d, item->body)->name : NULL;
        if (item->solid != KT_SOLID_BOX || item->mask == 0 || collision_moves(t, item) ||
            !kt_floors_find(&floors, body, item->pose, item->size, &plane))
            continue;
        item->is_plane = true;
        item->pose = plane;
        kt_left_count(&t->c->touched.floors, item->element);
    }
    kt_floors_end(&floors);
}

void kt_collisions_contacts(kt_collisions *c, kt_draft *d, const kt_robot_source *source, kt_vec3 gravity) {
    const kt_robot_options *o = source->options;
    touching t = {.c = c, .d = d, .source = source, .gravity = kt_vec3_norm(gravity)};
    kt_collision floor = {.element = d->root, .body = -1, .is_plane = true, .friction = (double)INFINITY, .mask = ~0U};
    floor.pose = kt_pose_identity();
    floor.pose.position.z = o->ground;
    for (int i = 0; i < d->bodies.count; i++)
        c->moves_freely = c->moves_freely || kt_draft_body_at(d, i)->joint.type == KT_JOINT_FREE;
    if (!o->contacts || d->parents == NULL || !prepare_bodies(&t) ||
        !kt_namer_init(&t.names, d->r, KT_CONTACT_POINTS_MOST * (c->items.count + 1)))
        return;
    find_floors(&t, gravity);
    if (o->has_ground)
        kt_left_count(&c->touched.planes, d->root);
    for (int i = 0; i < c->items.count; i++)
        if (collision_at(c, i)->is_plane && !collision_moves(&t, collision_at(c, i)))
            kt_left_count(&c->touched.planes, collision_at(c, i)->element);
    for (int i = 0; i < c->items.count && c->touched.planes.count > 0 && !d->r->out_of_memory; i++) {
        const kt_collision *item = collision_at(c, i);
        if (!item->is_plane && collision_moves(&t, item))
            meet_planes(&t, item, o->has_ground ? &floor : NULL);
    }
    c->touched.depth = kt_contact_settle(d);
    c->stops = (kt_left){.first = d->root, .count = d->soft_stops.count};
}

/* ---- notes ------------------------------------------------------------------------------------------------------- */

static const kt_note friction_notes[] = {
    KT_NOTE(kt_collisions, directional, MOTION,
            "collision shapes whose mu2 differs from mu1; a contact has the friction mu1 in all directions:"),
    KT_NOTE(kt_collisions, standing, MOTION,
            "collision shapes whose mu_static differs from mu_dynamic; a contact has the friction mu_dynamic at rest, "
            "too:"),
    KT_NOTE(kt_collisions, deepening, MOTION,
            "collision shapes whose torsional friction has a surface_radius, left out; give a patch_radius:"),
    KT_NOTE(
        kt_collisions, disputed, MOTION,
        "collision shapes to which several simulators give different frictions; that of Drake counts before that of "
        "Gazebo, and that of PyBullet last:"),
};

static const kt_note near_notes[] = {
    KT_NOTE(kt_contact_tally, lost, MOTION,
            "collision shapes that touch planes, left out, since they have no mesh that can be read, or no mass:"),
    KT_NOTE(kt_contact_tally, made, START, KT_NOTE_STIFF),
    KT_NOTE(kt_contact_tally, floors, START, KT_NOTE_FLOORS),
    KT_NOTE(kt_contact_tally, rounded, MOTION, KT_NOTE_ROUNDED),
    KT_NOTE(kt_contact_tally, rough, MOTION, KT_NOTE_ROUGH),
};

void kt_collisions_notes(kt_notes *notes, const kt_collisions *c, const kt_robot_options *o, const kt_element *root,
                         kt_vec3 gravity) {
    const bool falls = c->moves_freely && kt_vec3_norm(gravity) > 0.0;
    if (!o->contacts && falls)
        kt_note_falling(notes, &c->all, gravity);
    else if (!o->contacts)
        kt_note_put(notes, KT_NOTE_RANK_START, &c->all,
                    "collision shapes that are left out, since contacts are effects: %d", c->all.count);
    if (!o->contacts)
        return;
    kt_note_put(notes, KT_NOTE_RANK_START, &c->touched.made,
                "collision shapes that touch planes (%d), and nothing else: %d", c->touched.planes.count,
                c->touched.made.count);
    kt_note_put(notes, KT_NOTE_RANK_START, &c->stops, KT_NOTE_SOFT_STOPS " %d", c->stops.count);
    KT_NOTES_PUT(notes, c, friction_notes);
    KT_NOTES_PUT(notes, &c->touched, near_notes);
    if (falls && c->touched.planes.count == 0)
        kt_note_groundless(notes, root);
    kt_note_sunk(notes, root, c->touched.depth);
}
