/* Finds the trees that move in a plane, and fills their planar links. Trees that loops connect are treated as one.
 *
 * Axes are compared joint by joint, because rounding would add up in a comparison with one distant normal. The normal n
 * is passed from body to body in the body's own axes, transformed only by the rotation of the joint frame between them.
 * Every revolute joint replaces n by its own axis. Thus a thousand unrotated joints about one oblique axis agree to the
 * last bit. In a chain of rotated joints, each joint only has to agree with the previous revolute joint.
 *
 * Differences within rounding are allowed. A rotation from Euler angles or a quaternion has errors of up to 4 eps in an
 * entry. The product of such a rotation with n adds 3 eps, and a unit axis 2 eps. The tolerance permits a few fixed or
 * prismatic joints between two revolute joints. An axis that is oblique by more than PARALLEL = 32 eps (1.5e-9 arc
 * seconds) is taken as oblique on purpose.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/find_planar.h"
#include "algebra/vector_parts.h"

#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "joint/joint.h"

#include <float.h>
#include <string.h>

#define PARALLEL (32.0 * DBL_EPSILON)

enum {
    GROUND = 0,
    LOOK_BACK = 16, /* planes with which a tree is compared before it gets a new one */
    SPATIAL = -1,
    UNDECIDED = -2
};

/* The joints that determine the normal of a tree so far: none, two prismatic joints, or a revolute joint. */
enum { NORMAL_OPEN = 0, NORMAL_OF_SLIDES, NORMAL_OF_TURN };

static bool is_parallel(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_cross(a, b)) <= PARALLEL; }

static bool is_normal(kt_vec3 a, kt_vec3 b) { return fabs(kt_vec3_dot(a, b)) <= PARALLEL; }

/* The joint frame's rotation on the parent's body. A rotation that cannot be evaluated is rejected later, when bodies
 * are stored. */
static kt_mat3 joint_rotation(const kt_joint *joint) {
    kt_mat3 r;
    kt_error ignored;
    return kt_rotation_evaluate(&joint->rotation, &r, &ignored) == KT_OK ? r : kt_mat3_identity();
}

/* ---- normals ----------------------------------------------------------------------------------------------------- */

/* Considers one more joint of a tree. The first revolute motion gives the normal (in basis.z). Before there is one, two
 * prismatic motions that are not parallel give the normal (the first is kept in basis.x). */
static void add_joint_axes(const kt_joint *joint, const kt_mat3 *rest, kt_body_plane *tree) {
    kt_element elements[KT_ELEMENT_MAX];
    const int count = kt_joint_elements(joint, elements);
    for (int k = 0; k < count; k++) {
        const kt_vec3 along = kt_mat3_apply(*rest, kt_mat3_column(elements[k].frame, elements[k].axis));
        const kt_motion_facts motion = kt_motion_facts_of(elements[k].motion);
        if (!motion.planar) {
            tree->plane = SPATIAL;
        } else if (motion.angles && tree->known != NORMAL_OF_TURN) {
            tree->basis.z = along;
            tree->known = NORMAL_OF_TURN;
        } else if (motion.lengths && tree->known == NORMAL_OPEN) {
            const kt_vec3 across = kt_vec3_cross(tree->basis.x, along);
            if (kt_vec3_norm(across) > PARALLEL) {
                tree->basis.z = kt_vec3_normalize(across);
                tree->known = NORMAL_OF_SLIDES;
            } else {
                tree->basis.x = along;
            }
        }
    }
}

/* Finds the axes and origins of the bodies at q = 0, and the tree to which each belongs. */
static void find_trees(const kt_description *d, kt_body_plane *body, size_t count) {
    body[GROUND] = (kt_body_plane){.rest = kt_mat3_identity(), .source = -1, .plane = SPATIAL};
    for (size_t i = 1; i <= count; i++) {
        kt_body_plane *b = &body[i];
        const kt_body_plane *up = &body[b->parent];
        const kt_joint *joint = &d->bodies[b->source].joint;
        const kt_mat3 r = joint_rotation(joint);
        b->rest = kt_mat3_is_same(r, kt_mat3_identity()) ? up->rest : kt_mat3_multiply(up->rest, r);
        b->tree = up->tree || joint->type == KT_JOINT_FIXED ? up->tree : (int32_t)i;
        b->component = (int32_t)i;
        b->plane = UNDECIDED;
        b->known = NORMAL_OPEN;
        memset(&b->basis, 0, sizeof b->basis);
        b->at = kt_vec3_add(up->at, kt_mat3_apply(up->rest, joint->at));
        b->reach = up->reach + kt_vec3_norm(joint->at);
    }
}

/* The entry that represents all trees with which loops connect the body's tree. */
static kt_body_plane *tree_component_of(kt_body_plane *body, const kt_body_plane *b) {
    return &body[body[b->tree].component];
}

static void find_plane_normals(const kt_description *d, kt_body_plane *body, size_t count) {
    for (size_t i = 1; i <= count; i++)
        if (body[i].tree != GROUND)
            add_joint_axes(&d->bodies[body[i].source].joint, &body[i].rest, tree_component_of(body, &body[i]));
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* Returns a plane with this normal or its opposite among the last planes, or a new plane. */
static int32_t plane_with(kt_vec3 normal, kt_plane *plane, size_t *count) {
    for (size_t back = 1; back <= LOOK_BACK && back <= *count; back++)
        if (is_parallel(plane[*count - back].basis.z, normal))
            return (int32_t)(*count - back);
    plane[*count] = (kt_plane){.basis = kt_triad_from_axis(normal, 2)};
    return (int32_t)(*count)++;
}

/* Returns a plane that contains the direction of a prismatic motion. */
static int32_t plane_along(kt_vec3 slide, kt_plane *plane, size_t *count) {
    for (size_t back = 1; back <= LOOK_BACK && back <= *count; back++)
        if (is_normal(plane[*count - back].basis.z, slide))
            return (int32_t)(*count - back);
    return plane_with(kt_triad_from_axis(slide, 2).x, plane, count);
}

/* Chooses a plane for each set of trees that loops connect: first for sets whose normal is known. Returns the number of
 * planes. */
static size_t choose_planes(kt_body_plane *body, size_t count, kt_plane *plane) {
    size_t planes = 0;
    for (int round = 0; round < 2; round++) /* trees of parallel prismatic joints take an existing plane if any */
        for (size_t i = 1; i <= count; i++) {
            kt_body_plane *b = &body[i];
            if (b->tree != (int32_t)i || tree_component_of(body, b) != b || b->plane != UNDECIDED ||
                (b->known == NORMAL_OPEN) != (round == 1))
                continue;
            b->plane = round ? plane_along(b->basis.x, plane, &planes) : plane_with(b->basis.z, plane, &planes);
        }
    return planes;
}

/* ---- do all joints move in the plane? ---------------------------------------------------------------------------- */

/* Returns the basis with its third column replaced by n, which is parallel to this column within rounding. */
static kt_mat3 basis_about(kt_mat3 basis, kt_vec3 n) {
    if (basis.z.x == n.x && basis.z.y == n.y && basis.z.z == n.z)
        return basis;
    const kt_vec3 e1 = kt_vec3_sub(basis.x, kt_vec3_scale(kt_vec3_dot(basis.x, n), n));
    return (kt_mat3){.x = kt_vec3_normalize(e1), .y = kt_vec3_cross(n, kt_vec3_normalize(e1)), .z = n};
}

/* Whether a joint moves in the plane of b->basis, whose third column is replaced by the axis of a revolute motion. */
static bool joint_moves_in_plane(const kt_joint *joint, kt_body_plane *b) {
    kt_element elements[KT_ELEMENT_MAX];
    const int count = kt_joint_elements(joint, elements);
    for (int k = 0; k < count; k++) {
        const kt_vec3 along = kt_mat3_column(elements[k].frame, elements[k].axis);
        const kt_motion_facts motion = kt_motion_facts_of(elements[k].motion);
        if (!motion.planar || !(motion.lengths ? is_normal : is_parallel)(along, b->basis.z))
            return false;
        if (motion.lengths)
            continue;
        const double sign = kt_vec3_dot(along, b->basis.z) > 0.0 ? 1.0 : -1.0;
        b->basis = basis_about(b->basis, kt_vec3_scale(sign, along));
    }
    return true;
}

/* Passes the plane's basis in the axes of each body, and the body's height above the plane, from the ground to the
 * tips. A set of trees with a joint that does not move in the plane becomes spatial. */
static void check_planes(const kt_description *d, kt_body_plane *body, size_t count, const kt_plane *plane) {
    for (size_t i = 1; i <= count; i++) {
        kt_body_plane *b = &body[i], *tree = tree_component_of(body, b);
        if (b->tree == GROUND || tree->plane < 0)
            continue;
        const kt_joint *joint = &d->bodies[b->source].joint;
        const kt_body_plane *up = &body[b->parent];
        const kt_mat3 r = joint_rotation(joint);
        const bool root = up->tree == GROUND;
        const kt_mat3 above =
            root ? kt_mat3_multiply(kt_mat3_transpose(up->rest), plane[tree->plane].basis) : up->basis;
        b->height =
            kt_vec3_dot(above.z, joint->at) + (root ? kt_vec3_dot(plane[tree->plane].basis.z, up->at) : up->height);
        b->basis = above;
        if (!kt_mat3_is_same(r, kt_mat3_identity()))
            b->basis = kt_mat3_multiply(kt_mat3_transpose(r), b->basis);
        if (!joint_moves_in_plane(joint, b))
            tree->plane = SPATIAL;
    }
}

/* ---- planes that are used ---------------------------------------------------------------------------------------- */

/* Removes planes without trees, and renumbers the others in their order; returns their number. */
static size_t drop_planes(kt_body_plane *body, size_t count, kt_plane *plane, size_t planes) {
    size_t left = 0;
    for (size_t p = 0; p < planes; p++)
        plane[p].first = SPATIAL;
    for (size_t i = 1; i <= count; i++)
        if (body[i].tree == (int32_t)i && body[i].plane >= 0)
            plane[body[i].plane].first = 0;
    for (size_t p = 0; p < planes; p++)
        if (plane[p].first != SPATIAL) {
            plane[p].first = (int32_t)left;
            plane[left++].basis = plane[p].basis;
        }
    for (size_t i = 1; i <= count; i++) {
        const bool is_planar = body[i].tree == (int32_t)i && body[i].plane >= 0;
        body[i].plane = is_planar ? plane[body[i].plane].first : SPATIAL;
    }
    return left;
}

size_t kt_planes_find(const kt_ordered *o, kt_body_plane *body, kt_plane *plane, kt_planar_loop *flat) {
    find_trees(o->description, body, o->count);
    kt_trees_join(o, body);
    find_plane_normals(o->description, body, o->count);
    const size_t planes = choose_planes(body, o->count, plane);
    check_planes(o->description, body, o->count, plane);
    kt_loops_planar_rows(o, body, plane, flat);
    for (size_t i = 1; i <= o->count; i++)
        if (body[i].tree == (int32_t)i)
            body[i].plane = body[body[i].component].plane;
    return drop_planes(body, o->count, plane, planes);
}

/* ---- links in their planes --------------------------------------------------------------------------------------- */

/* The plane's basis e1, e2, n in a link's axes, at q = 0. */
static kt_mat3 link_basis(const kt_model *m, const kt_body_plane *body, int32_t link, const kt_plane *plane) {
    if (link == 0)
        return plane->basis;
    const int32_t b = m->link[link].body;
    return kt_mat3_multiply(m->body[b].in_link.rotation, body[b].basis);
}

/* Fills a planar link from its spatial link: vectors in the plane's basis, indices among planar links. A revolute joint
 * about -n has the sign -1. */
static void place_link(kt_model *m, const kt_body_plane *body, size_t index, int32_t plane) {
    const kt_link *link = &m->link[m->n.spatial + index - 1];
    const int32_t up = link->parent, k = link->axis;
    const kt_mat3 above = link_basis(m, body, up, &m->plane[plane]);
    const kt_mat3 own = link_basis(m, body, (int32_t)(m->n.spatial + index - 1), &m->plane[plane]);
    const kt_vec3 at = kt_mat3_apply_transposed(above, link->at);
    const double x = kt_vec3_part(own.x, k), y = kt_vec3_part(own.y, k), length = sqrt(x * x + y * y);
    const bool slides = kt_link_lengths(link) > 0;
    m->planar[index] = (kt_planar_link){
        .at = {at.x, at.y},
        .along = {slides ? x / length : 0.0, slides ? y / length : 0.0},
        .size = link->size,
        .sign = kt_vec3_part(own.z, k) < 0.0 ? -1.0 : 1.0,
        .parent = up ? up + m->to_planar : 0,
        .group = -1,
        .q = link->q,
        .v = link->v,
        .angle = slides ? 0 : link->angle - (int32_t)m->n.spatial_angle,
        .end = link->end - (int32_t)m->n.spatial_v,
        .revolute = !slides,
        .follows = link->follows,
        .branches = link->branches,
        .leads = link->leads,
    };
    kt_planar_rest *rest = &m->planar_rest[index];
    rest->plane = plane;
    kt_v4_from_mat3(kt_mat3_transpose(own), rest->axes);
    kt_planar_link_set_inertia(m, index);
}

void kt_planar_links_fill(kt_model *m, const kt_body_plane *body) {
    int32_t plane = -1;
    for (size_t index = 1; index < m->n.planar; index++) {
        const kt_link *link = &m->link[m->n.spatial + index - 1];
        const int32_t own = body[body[link->body].tree].plane;
        if (own != plane) {
            kt_plane_set_weights(m, &m->plane[own]);
            m->plane[own].first = (int32_t)index;
        }
        plane = own;
        place_link(m, body, index, plane);
        m->plane[plane].last = (int32_t)index + 1;
    }
    m->sweep = m->n.planar == 0 ? KT_SWEEP_SPATIAL : m->n.spatial > 1 ? KT_SWEEP_MIXED : KT_SWEEP_PLANAR;
}
