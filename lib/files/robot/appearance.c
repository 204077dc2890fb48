/* Pictures of robots: the solids and meshes of their links. They have no effect on the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"
#include "robot/robot.h"

#include <math.h>
#include <string.h>

/* ---- a body ------------------------------------------------------------------------------------------------------ */

static bool is_number_of_scenes(double x) { return fabs(x) <= KT_NUMBER_MOST; }

static bool is_vector_of_scenes(kt_vec3 v) {
    return is_number_of_scenes(v.x) && is_number_of_scenes(v.y) && is_number_of_scenes(v.z);
}

/* A solid is seen if all of its dimensions are above zero, and numbers that a scene may have. */
static bool shape_has_size(const kt_shape *shape) {
    const bool is_box = shape->type == KT_SHAPE_BOX, is_cylinder = shape->type == KT_SHAPE_CYLINDER;
    const bool is_above = is_box ? shape->size.x > 0.0 && shape->size.y > 0.0 && shape->size.z > 0.0
                                 : shape->radius > 0.0 && (!is_cylinder || shape->length > 0.0);
    return is_above && is_number_of_scenes(shape->radius) && is_number_of_scenes(shape->length) &&
           is_vector_of_scenes(shape->size) && is_vector_of_scenes(shape->at) && is_vector_of_scenes(shape->from) &&
           is_vector_of_scenes(shape->to);
}

void kt_appearance_begin(kt_appearance *appearance, const char *body) {
    appearance->shapes = (kt_list){.items = NULL};
    appearance->body = body;
    appearance->is_seen = false;
}

static bool keep_shape(kt_appearance *appearance, const kt_element *e, const kt_shape *shape) {
    if (!shape_has_size(shape)) {
        kt_left_count(&appearance->sizeless, e);
        return false;
    }
    kt_shape *kept = kt_list_add(appearance->r, &appearance->r->keep, &appearance->shapes, sizeof *kept);
    if (kept != NULL)
        *kept = *shape;
    return appearance->is_seen = true;
}

/* A rod of the ellipsoid's length; its round ends and sides have the mean radius of the other two axes. Or a sphere. */
static void draw_ellipsoid(const double half[3], kt_pose pose, kt_shape *shape) {
    const int longest = half[0] >= half[1] && half[0] >= half[2] ? 0 : half[1] >= half[2] ? 1 : 2;
    double end[3] = {0.0, 0.0, 0.0};
    shape->radius = sqrt(half[(longest + 1) % 3] * half[(longest + 2) % 3]);
    end[longest] = half[longest] - shape->radius;
    shape->type = end[longest] > 1e-6 * half[longest] ? KT_SHAPE_ROD : KT_SHAPE_SPHERE;
    const kt_vec3 v = kt_vec3_make(end[0], end[1], end[2]);
    if (shape->type == KT_SHAPE_SPHERE) {
        shape->at = pose.position;
        return;
    }
    shape->from = kt_pose_apply(pose, kt_vec3_scale(-1.0, v));
    shape->to = kt_pose_apply(pose, v);
}

bool kt_appearance_add_solid(kt_appearance *appearance, const kt_element *e, kt_solid solid, const double size[3],
                             kt_pose pose, const kt_rotation *rotation) {
    kt_shape shape = kt_shape_default();
    if (solid == KT_SOLID_ELLIPSOID) {
        draw_ellipsoid(size, pose, &shape);
        kt_left_count(&appearance->ellipsoids, e);
        return keep_shape(appearance, e, &shape);
    }
    shape.at = pose.position;
    if (solid != KT_SOLID_SPHERE)
        shape.rotation = rotation != NULL ? *rotation : kt_rotation_of_matrix(pose.rotation);
    if (solid == KT_SOLID_BOX) {
        shape.type = KT_SHAPE_BOX;
        shape.size = kt_vec3_scale(2.0, kt_vec3_make(size[0], size[1], size[2]));
    } else {
        shape.type = solid == KT_SOLID_SPHERE ? KT_SHAPE_SPHERE : KT_SHAPE_CYLINDER;
        shape.radius = solid == KT_SOLID_CONE ? 0.5 * size[0] : size[0];
        shape.length = solid == KT_SOLID_SPHERE ? 0.0 : 2.0 * size[1];
    }
    if (shape.type == KT_SHAPE_CYLINDER)
        shape.axis = kt_vec3_make(0.0, 0.0, 1.0);
    if (solid == KT_SOLID_CONE)
        kt_left_count(&appearance->cones, e);
    return keep_shape(appearance, e, &shape);
}

/* Counts a missing mesh, with the name of the first. */
static void count_missing_mesh(kt_appearance *appearance, const kt_element *e, const char *name) {
    if (appearance->missing.count == 0)
        appearance->missing.what = name == NULL
                                       ? "one without a name"
                                       : kt_reader_text(appearance->r, &appearance->r->keep, name, strlen(name));
    kt_left_count(&appearance->missing, e);
}

static bool put_mesh(kt_appearance *appearance, const kt_scene_mesh *mesh, kt_pose pose, kt_vec3 scale) {
    kt_scene_mesh *kept = kt_list_add(appearance->r, &appearance->r->keep, &appearance->meshes, sizeof *kept);
    if (kept != NULL) {
        *kept = *mesh;
        kept->body = appearance->body;
        kept->scale = scale;
        kept->at = pose.position;
        kept->rotation = kt_rotation_of_matrix(pose.rotation);
    }
    return appearance->is_seen = true;
}

bool kt_appearance_add_mesh(kt_appearance *appearance, const kt_element *e, const char *name, kt_pose pose,
                            kt_vec3 scale) {
    const char *file = name != NULL ? kt_mesh_path(appearance->r, appearance->source, name) : NULL;
    if (file == NULL) {
        count_missing_mesh(appearance, e, name);
        return false;
    }
    const kt_scene_mesh mesh = {.file = file};
    return put_mesh(appearance, &mesh, pose, scale);
}

void kt_appearance_end(kt_appearance *appearance, bool of_collisions, const kt_element *e, kt_body *body) {
    const kt_shape *shapes = appearance->shapes.items;
    if (appearance->shapes.count == 1) {
        body->shape = shapes[0];
    } else {
        body->shapes = shapes;
        body->shape_count = appearance->shapes.count;
    }
    kt_seen_collision *collision =
        of_collisions && appearance->shapes.count > 0
            ? kt_list_add(appearance->r, &appearance->r->scratch, &appearance->collisions, sizeof *collision)
            : NULL;
    if (collision != NULL)
        *collision = (kt_seen_collision){.body = body->name, .element = e};
}

/* ---- collision shapes that are far larger than the robot --------------------------------------------------------- */

static const double far_larger = 5.0; /* times the robot's reach */

typedef struct sizes {
    const kt_draft *d;
    double *away; /* distance of each body's origin from the root, along the joints; -1: not computed yet */
    int *path;
} sizes;

static bool take_sizes(sizes *s, const kt_draft *d) {
    const size_t room = (size_t)d->bodies.count + 1;
    *s = (sizes){.d = d};
    s->away = kt_reader_take(d->r, &d->r->scratch, room, sizeof *s->away);
    s->path = kt_reader_take(d->r, &d->r->scratch, room, sizeof *s->path);
    if (s->away == NULL || s->path == NULL || d->parents == NULL)
        return false;
    for (int i = 0; i < d->bodies.count; i++)
        s->away[i] = -1.0;
    return true;
}

/* The distance of a body on the world is zero, at any position of its origin. A circle of parents ends the walk, and
 * the check of the description reports the circle. */
static void find_distances(sizes *s) {
    const kt_draft *d = s->d;
    for (int i = 0; i < d->bodies.count; i++) {
        int length = 0, at = i;
        while (at >= 0 && s->away[at] < 0.0 && length < d->bodies.count) {
            s->path[length++] = at;
            at = d->parents[at];
        }
        double away = at >= 0 ? fmax(s->away[at], 0.0) : 0.0;
        while (length-- > 0) {
            const int body = s->path[length];
            away += d->parents[body] >= 0 ? kt_vec3_norm(kt_draft_body_at(d, body)->joint.at) : 0.0;
            s->away[body] = away;
        }
    }
}

/* An upper bound of the distance of a solid's points from its body's origin. */
static double reach_of(const kt_shape *shape) {
    const double half = shape->type == KT_SHAPE_CYLINDER ? 0.5 * shape->length : 0.0;
    const double own = shape->type == KT_SHAPE_BOX ? 0.5 * kt_vec3_norm(shape->size) : shape->radius + half;
    const bool is_rod = shape->type == KT_SHAPE_ROD;
    return own + (is_rod ? fmax(kt_vec3_norm(shape->from), kt_vec3_norm(shape->to)) : kt_vec3_norm(shape->at));
}

static double reach_of_shapes(const kt_body *body) {
    double reach = body->shape.type != KT_SHAPE_NONE ? reach_of(&body->shape) : 0.0;
    for (int k = 0; k < body->shape_count; k++)
        reach = fmax(reach, reach_of(&body->shapes[k]));
    return reach;
}

/* The extent of the robot, without the shapes of its collisions: origins, centres of mass, and solids of visuals.
 * Zero: there is nothing to compare with. */
static double reach_of_robot(const sizes *s, const kt_appearance *appearance) {
    const kt_seen_collision *collision = appearance->collisions.items;
    double reach = 0.0;
    bool has_length = false;
    for (int i = 0, next = 0; i < s->d->bodies.count; i++) {
        const kt_body *body = kt_draft_body_at(s->d, i);
        const bool of_collisions = next < appearance->collisions.count && strcmp(collision[next].body, body->name) == 0;
        const double own = of_collisions ? 0.0 : reach_of_shapes(body);
        has_length = has_length || s->away[i] > 0.0 || own > 0.0;
        reach = fmax(reach, s->away[i] + fmax(own, body->mass > 0.0 ? kt_vec3_norm(body->com) : 0.0));
        next += of_collisions;
    }
    return has_length ? reach : 0.0;
}

/* Takes shapes beyond a reach from a body. */
static void drop_larger(kt_appearance *appearance, const kt_seen_collision *collision, double most, kt_body *body) {
    if (body->shape.type != KT_SHAPE_NONE && reach_of(&body->shape) > most) {
        body->shape = kt_shape_default();
        kt_left_count(&appearance->large, collision->element);
    }
    kt_shape *shapes = (kt_shape *)body->shapes; /* made by keep_shape */
    int kept = 0;
    for (int k = 0; k < body->shape_count; k++)
        if (reach_of(&shapes[k]) > most)
            kt_left_count(&appearance->large, collision->element);
        else
            shapes[kept++] = shapes[k];
    body->shape_count = kept;
}

void kt_appearance_finish(kt_appearance *appearance, const kt_draft *d, kt_scene *scene) {
    sizes s;
    scene->meshes = appearance->meshes.items;
    scene->mesh_count = appearance->meshes.count;
    if (appearance->collisions.count == 0 || !take_sizes(&s, d))
        return;
    find_distances(&s);
    const double most = far_larger * reach_of_robot(&s, appearance);
    for (int i = 0; i < appearance->collisions.count && most > 0.0; i++) {
        const kt_seen_collision *collision = (const kt_seen_collision *)appearance->collisions.items + i;
        const int body = kt_names_find(&d->body_names, 0, collision->body);
        if (body >= 0)
            drop_larger(appearance, collision, most, kt_draft_body_at(d, body));
    }
}

static const kt_note notes_of_pictures[] = {
    KT_NOTE(kt_appearance, ellipsoids, DETAIL,
            "ellipsoids, which pictures have as rods with round ends, as long, and of their mean radius:"),
    KT_NOTE(kt_appearance, cones, DETAIL, "cones, which pictures have as cylinders of half their radius:"),
    KT_NOTE(kt_appearance, sizeless, DETAIL,
            "shapes that are left out of pictures, since a dimension is not above zero, or above 1e50:"),
    KT_NOTE(kt_appearance, missing, DETAIL,
            "meshes that are not found, left out of pictures (--search FOLDER:FOLDER, or KINETREE_SEARCH, names "
            "where packages and models are):"),
    KT_NOTE(kt_appearance, large, DETAIL,
            "collision shapes that are left out of pictures, since they are far larger than the robot:"),
};

void kt_appearance_notes(kt_notes *notes, const kt_appearance *appearance) {
    KT_NOTES_PUT(notes, appearance, notes_of_pictures);
}
