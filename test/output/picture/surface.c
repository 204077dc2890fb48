/* Surfaces of solids: closed, of the right volume, with normals that point out; and where rays meet them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "picture/picture_mesh.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>

static const double pi = 3.14159265358979323846;
static const char *const names[] = {"box", "ball", "cylinder", "rod"};

enum { TYPES = 4 };

static kt_solid random_solid(kt_random *random, kt_solid_type type) {
    kt_solid solid = {.type = type};
    double x[4];
    kt_random_direction(random, 4, x);
    solid.pose.rotation = kt_mat3_from_quat(kt_quat_make(x[0], x[1], x[2], x[3]));
    solid.pose.position = kt_vec3_make(kt_random_normal(random), kt_random_normal(random), kt_random_normal(random));
    solid.half = kt_vec3_make(kt_random_uniform(random, 0.1, 2.0), kt_random_uniform(random, 0.1, 2.0),
                              kt_random_uniform(random, 0.1, 2.0));
    if (type != KT_SOLID_BOX)
        solid.half.y = solid.half.x;
    if (type == KT_SOLID_SPHERE)
        solid.half.z = solid.half.x;
    return solid;
}

static kt_vec3 corner(const kt_mesh *mesh, int triangle, int k) {
    return mesh->points[mesh->corners[3 * triangle + k % 3]];
}

static bool is_same(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_sub(a, b)) < 1e-9; }

/* How many triangles have the edge from a to b, in this direction. */
static int count_edges(const kt_mesh *mesh, kt_vec3 a, kt_vec3 b) {
    int count = 0;
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            count += is_same(corner(mesh, i, k), a) && is_same(corner(mesh, i, k + 1), b);
    return count;
}

KT_TEST(every_edge_belongs_to_two_triangles_in_opposite_directions) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < TYPES; type++)
        for (int sides = 3; sides <= 13; sides += 5) {
            const kt_solid solid = random_solid(&random, (kt_solid_type)type);
            kt_mesh mesh = {0};
            int wrong = 0;
            kt_check_true(names[type], kt_mesh_add_solid(&mesh, &solid, sides));
            for (int i = 0; i < mesh.triangle_count; i++)
                for (int k = 0; k < 3; k++) {
                    const kt_vec3 a = corner(&mesh, i, k), b = corner(&mesh, i, k + 1);
                    wrong += count_edges(&mesh, a, b) != 1 || count_edges(&mesh, b, a) != 1;
                }
            kt_check_equal_int("open edges", wrong, 0);
            kt_mesh_free(&mesh);
        }
}

/* The volume by the divergence theorem: the sum of the tetrahedra that triangles form with a point. */
static double volume_of(const kt_mesh *mesh) {
    double sum = 0.0;
    for (int i = 0; i < mesh->triangle_count; i++)
        sum += kt_vec3_dot(corner(mesh, i, 0), kt_vec3_cross(corner(mesh, i, 1), corner(mesh, i, 2))) / 6.0;
    return sum;
}

static double volume_in_closed_form(const kt_solid *solid) {
    const kt_vec3 h = solid->half;
    const double ball = 4.0 / 3.0 * pi * h.x * h.x * h.x, tube = 2.0 * pi * h.x * h.x * h.z;
    const double volumes[TYPES] = {8.0 * h.x * h.y * h.z, ball, tube, ball + tube};
    return volumes[solid->type];
}

/* To leading order, a polygon of n corners in a circle lacks 2 s of its area, with
 *     s = 1/3 (pi / n)^2
 * Arcs of a meridian lie s of the radius outside of their chords on average. For the volume of a ball, this counts
 * three times, together 5 s. For a rod, the lack is a mean of 5 s and 2 s. */
KT_TEST(volume_is_that_of_the_solid) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < TYPES; type++)
        for (int sides = 16; sides <= 128; sides *= 2) {
            const kt_solid solid = random_solid(&random, (kt_solid_type)type);
            const double expected = volume_in_closed_form(&solid);
            const double lacking = type == KT_SOLID_BOX ? 1e-14 : 5.0 / 3.0 * pow(pi / sides, 2.0);
            kt_mesh mesh = {0};
            kt_check_true(names[type], kt_mesh_add_solid(&mesh, &solid, sides));
            kt_check_near("volume", volume_of(&mesh), expected, lacking * expected);
            kt_mesh_free(&mesh);
        }
}

/* The point of a convex solid that lies furthest along its normal is the point itself. */
KT_TEST(normals_point_out_of_the_solid) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < TYPES; type++) {
        const kt_solid solid = random_solid(&random, (kt_solid_type)type);
        KT_WORST length = kt_worst_make("length of normals"), furthest = kt_worst_make("reach along normals");
        kt_mesh mesh = {0};
        int inward = 0;
        kt_check_true(names[type], kt_mesh_add_solid(&mesh, &solid, 12));
        for (int i = 0; i < mesh.point_count; i++) {
            const kt_vec3 normal = kt_mat3_apply_transposed(solid.pose.rotation, mesh.normals[i]);
            const kt_vec3 point = kt_pose_apply(kt_pose_invert(solid.pose), mesh.points[i]);
            kt_worst_near(&length, kt_vec3_norm(normal), 1.0, 8.0 * DBL_EPSILON, "point %d", i);
            kt_worst_near(&furthest, kt_vec3_dot(normal, point), kt_solid_reach(&solid, normal), 1e-14, "point %d", i);
        }
        for (int i = 0; i < mesh.triangle_count; i++)
            for (int k = 0; k < 3; k++) {
                const kt_vec3 a = corner(&mesh, i, 0), across = kt_vec3_cross(kt_vec3_sub(corner(&mesh, i, 1), a),
                                                                              kt_vec3_sub(corner(&mesh, i, 2), a));
                inward += !(kt_vec3_dot(across, mesh.normals[mesh.corners[3 * i + k]]) > 0.0);
            }
        kt_check_equal_int("normals that point inwards", inward, 0);
        kt_mesh_free(&mesh);
    }
}

/* How far a point in the solid's frame is outside, along coordinates; below zero inside. */
static double outside(const kt_solid *solid, kt_vec3 p) {
    const kt_vec3 h = solid->half;
    switch (solid->type) {
    case KT_SOLID_BOX:
        return fmax(fabs(p.x) - h.x, fmax(fabs(p.y) - h.y, fabs(p.z) - h.z));
    case KT_SOLID_SPHERE:
        return kt_vec3_norm(p) - h.x;
    case KT_SOLID_CYLINDER:
        return fmax(hypot(p.x, p.y) - h.x, fabs(p.z) - h.z);
    default:
        return kt_vec3_norm(kt_vec3_make(p.x, p.y, fmax(fabs(p.z) - h.z, 0.0))) - h.x;
    }
}

KT_TEST(rays_enter_and_leave_at_the_surface) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < TYPES; type++) {
        KT_WORST at_surface = kt_worst_make("distance from the surface");
        int wrong = 0, hits = 0;
        for (int trial = 0; trial < 400; trial++) {
            const kt_solid solid = random_solid(&random, (kt_solid_type)type);
            double x[3], enter, leave, least = DBL_MAX;
            kt_random_direction(&random, 3, x);
            const kt_vec3 d = trial % 5 == 0 ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_make(x[0], x[1], x[2]);
            const kt_vec3 from =
                kt_vec3_make(kt_random_normal(&random), kt_random_normal(&random), kt_random_normal(&random));
            const bool hit = kt_solid_cut(&solid, from, d, &enter, &leave);
            for (int i = -500; i <= 500; i++) {
                const double s = 0.02 * i, out = outside(&solid, kt_vec3_add(from, kt_vec3_scale(s, d)));
                least = fmin(least, out);
                wrong += hit ? out < -1e-12 && (s < enter || s > leave) : out < -1e-12;
                wrong += hit && out > 1e-12 && s > enter && s < leave;
            }
            hits += hit;
            wrong += hit && least > 0.02;
            if (hit) {
                const kt_vec3 a = kt_vec3_add(from, kt_vec3_scale(enter, d)),
                              b = kt_vec3_add(from, kt_vec3_scale(leave, d));
                kt_worst_near(&at_surface, outside(&solid, a), 0.0, 1e-13, "trial %d, in", trial);
                kt_worst_near(&at_surface, outside(&solid, b), 0.0, 1e-13, "trial %d, out", trial);
            }
        }
        kt_check_above(names[type], hits, 100.0);
        kt_check_equal_int("points on the wrong side", wrong, 0);
    }
}

KT_TEST(nearest_point_of_a_solid_is_in_it_and_no_sample_is_nearer) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < TYPES - 1; type++) {
        const kt_solid solid = random_solid(&random, (kt_solid_type)type);
        int wrong = 0;
        for (int trial = 0; trial < 200; trial++) {
            const kt_vec3 p = kt_vec3_make(2.0 * kt_random_normal(&random), 2.0 * kt_random_normal(&random),
                                           2.0 * kt_random_normal(&random));
            const kt_vec3 near = kt_solid_nearest(&solid, p);
            const double distance = kt_vec3_norm(kt_vec3_sub(p, near));
            wrong += outside(&solid, near) > 1e-12;
            for (int i = 0; i < 100; i++) {
                const kt_vec3 other =
                    kt_vec3_make(kt_random_normal(&random), kt_random_normal(&random), kt_random_normal(&random));
                wrong += outside(&solid, other) < 0.0 && kt_vec3_norm(kt_vec3_sub(p, other)) < distance - 1e-12;
            }
        }
        kt_check_equal_int(names[type], wrong, 0);
    }
}
