/* Mass properties of uniform solids against quadrature of
 *   m = int rho dV,  m c = int rho r dV,  I = int rho ((r - c)'(r - c) 1 - (r - c)(r - c)') dV
 * over points of the solid put in place by other means than the library's, with rho from the mass and the volume found.
 *
 * Points: Gauss-Legendre in lengths and radii, and equal steps in angles. The 4 points of Gauss-Legendre are exact to
 * degree 7, and integrands have degree 4 at most. The 8 angles are exact for harmonics below the 8th. So the sums are
 * exact but for rounding. The rounding of 400 points is 1e-14 of m l^2.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include <float.h>
#include <math.h>

#include "check.h"
#include "kinetree/model.h"

static const double two_pi = 6.283185307179586476925286766559;

typedef struct sums {
    double volume;
    kt_vec3 first;
    kt_sym3 second; /* int r r' dV */
} sums;

static void add_point(sums *s, kt_vec3 r, double w) {
    s->volume += w;
    s->first = kt_vec3_add(s->first, kt_vec3_scale(w, r));
    s->second = kt_sym3_add(s->second, kt_sym3_make(w * r.x * r.x, w * r.y * r.y, w * r.z * r.z, w * r.x * r.y,
                                                    w * r.x * r.z, w * r.y * r.z));
}

/* Point i and weight of the four-point Gauss-Legendre rule on [a, b]. */
static double gauss(int i, double a, double b, double *w) {
    const double root = sqrt(6.0 / 5.0) * 2.0 / 7.0;
    const double x = sqrt(3.0 / 7.0 + (i == 0 || i == 3 ? root : -root));
    *w = 0.5 * (b - a) * (18.0 + (i == 0 || i == 3 ? -sqrt(30.0) : sqrt(30.0))) / 36.0;
    return 0.5 * (a + b) + 0.5 * (b - a) * (i < 2 ? -x : x);
}

/* Any two unit vectors normal to u and to each other: Gram-Schmidt. */
static void complete(kt_vec3 u, kt_vec3 *a, kt_vec3 *b) {
    const kt_vec3 e = fabs(u.x) < 0.6 ? kt_vec3_make(1.0, 0.0, 0.0) : kt_vec3_make(0.0, 1.0, 0.0);
    *a = kt_vec3_sub(e, kt_vec3_scale(kt_vec3_dot(e, u), u));
    *a = kt_vec3_scale(1.0 / kt_vec3_norm(*a), *a);
    *b = kt_vec3_cross(u, *a);
}

static kt_vec3 combine(kt_vec3 o, double x, kt_vec3 a, double y, kt_vec3 b, double z, kt_vec3 c) {
    return kt_vec3_add(kt_vec3_add(o, kt_vec3_scale(x, a)), kt_vec3_add(kt_vec3_scale(y, b), kt_vec3_scale(z, c)));
}

static sums box_sums(kt_vec3 centre, kt_mat3 axes, kt_vec3 size) {
    sums s = {0};
    for (int i = 0; i < 64; i++) {
        double wx, wy, wz;
        const double x = gauss(i / 16, -size.x / 2.0, size.x / 2.0, &wx);
        const double y = gauss(i / 4 % 4, -size.y / 2.0, size.y / 2.0, &wy);
        const double z = gauss(i % 4, -size.z / 2.0, size.z / 2.0, &wz);
        add_point(&s, combine(centre, x, axes.x, y, axes.y, z, axes.z), wx * wy * wz);
    }
    return s;
}

/* From one face's middle to the other's. Radius 0: a line. */
static sums cylinder_sums(kt_vec3 from, kt_vec3 to, double radius) {
    const kt_vec3 along = kt_vec3_sub(to, from);
    kt_vec3 a, b;
    complete(kt_vec3_scale(1.0 / kt_vec3_norm(along), along), &a, &b);
    sums s = {0};
    for (int i = 0; i < 128; i++) {
        double wz, wr;
        const double z = gauss(i / 32, 0.0, 1.0, &wz), rho = gauss(i / 8 % 4, 0.0, radius, &wr);
        const double phi = two_pi * (i % 8) / 8.0;
        const double weight = radius > 0.0 ? wr * rho : 1.0;
        add_point(&s, combine(from, z, along, rho * cos(phi), a, rho * sin(phi), b), wz * weight);
    }
    return s;
}

static sums sphere_sums(kt_vec3 centre, double radius) {
    const kt_mat3 e = kt_mat3_identity();
    sums s = {0};
    for (int i = 0; i < 128; i++) {
        double wr, wc;
        const double rho = gauss(i / 32, 0.0, radius, &wr), c = gauss(i / 8 % 4, -1.0, 1.0, &wc);
        const double phi = two_pi * (i % 8) / 8.0, sine = rho * sqrt(1.0 - c * c);
        add_point(&s, combine(centre, sine * cos(phi), e.x, sine * sin(phi), e.y, rho * c, e.z), wr * wc * rho * rho);
    }
    return s;
}

static void compare(const char *what, const kt_body *body, sums s, double size) {
    kt_vec3 com;
    kt_sym3 inertia;
    kt_error error;
    kt_need(kt_check_equal_int(what, kt_body_inertia(body, &com, &inertia, &error), KT_OK));
    const double rho = body->mass / s.volume;
    const kt_vec3 c = kt_vec3_scale(1.0 / s.volume, s.first);
    const kt_sym3 p = s.second; /* int r r' - V c c' */
    const double xx = rho * p.xx - body->mass * c.x * c.x, yy = rho * p.yy - body->mass * c.y * c.y;
    const double zz = rho * p.zz - body->mass * c.z * c.z;
    const double expected[9] = {c.x,
                                c.y,
                                c.z,
                                yy + zz,
                                zz + xx,
                                xx + yy,
                                body->mass * c.x * c.y - rho * p.xy,
                                body->mass * c.x * c.z - rho * p.xz,
                                body->mass * c.y * c.z - rho * p.yz};
    const double observed[9] = {com.x,      com.y,      com.z,      inertia.xx, inertia.yy,
                                inertia.zz, inertia.xy, inertia.xz, inertia.yz};
    /* Sums of 128 positive terms in double, about the origin. Their error is sqrt(128) eps of m l^2, where l is the
     * farthest reach. */
    KT_WORST worst = kt_worst_make(what);
    for (int i = 0; i < 9; i++)
        kt_worst_near(&worst, observed[i], expected[i], 11.0 * DBL_EPSILON * (i < 3 ? size : body->mass * size * size),
                      "number %d", i);
}

static kt_body solid_of(kt_shape_type type) {
    kt_body body = kt_body_default();
    body.name = "solid";
    body.mass = 2.5;
    body.com_of_shape = body.inertia_of_shape = true;
    body.com.x = body.inertia.xx = (double)NAN; /* ignored */
    body.shape.type = type;
    body.shape.at = kt_vec3_make(0.3, -0.5, 0.2);
    body.shape.rotation = kt_rotation_rpy(0.4, -0.7, 1.1);
    return body;
}

/* R = Rz(yaw) Ry(pitch) Rx(roll), written out. */
static kt_mat3 turned(void) {
    const double cr = cos(0.4), sr = sin(0.4), cp = cos(-0.7), sp = sin(-0.7), cy = cos(1.1), sy = sin(1.1);
    kt_mat3 r;
    r.x = kt_vec3_make(cy * cp, sy * cp, -sp);
    r.y = kt_vec3_make(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr);
    r.z = kt_vec3_make(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr);
    return r;
}

KT_TEST(box_has_the_inertia_of_its_points) {
    kt_body body = solid_of(KT_SHAPE_BOX);
    body.shape.size = kt_vec3_make(0.4, 1.1, 1.7);
    compare("box", &body, box_sums(body.shape.at, turned(), body.shape.size), 1.6);
}

KT_TEST(sphere_has_the_inertia_of_its_points) {
    kt_body body = solid_of(KT_SHAPE_SPHERE);
    body.shape.radius = 0.7;
    compare("sphere", &body, sphere_sums(body.shape.at, 0.7), 1.3);
}

KT_TEST(cylinder_has_the_inertia_of_its_points) {
    kt_body body = solid_of(KT_SHAPE_CYLINDER);
    body.shape.radius = 0.3;
    body.shape.length = 1.4;
    body.shape.axis = kt_vec3_make(1.0, -2.0, 2.0);
    const kt_mat3 r = turned();
    const kt_vec3 half = combine(kt_vec3_make(0.0, 0.0, 0.0), 0.7 / 3.0, r.x, -1.4 / 3.0, r.y, 1.4 / 3.0, r.z);
    compare("cylinder", &body, cylinder_sums(kt_vec3_sub(body.shape.at, half), kt_vec3_add(body.shape.at, half), 0.3),
            1.4);
}

KT_TEST(rod_has_the_inertia_of_its_points) {
    kt_body body = solid_of(KT_SHAPE_ROD);
    body.shape.from = kt_vec3_make(-0.2, 0.4, 0.1);
    body.shape.to = kt_vec3_make(0.9, -0.3, 0.5);
    compare("slender", &body, cylinder_sums(body.shape.from, body.shape.to, 0.0), 1.1);
    body.shape.radius = 0.25;
    compare("thick", &body, cylinder_sums(body.shape.from, body.shape.to, 0.25), 1.3);
}

static void add_sums(sums *s, sums t) {
    s->volume += t.volume;
    s->first = kt_vec3_add(s->first, t.first);
    s->second = kt_sym3_add(s->second, t.second);
}

/* An angle of two boxes, its corners either way round and from any of them. */
KT_TEST(polygon_has_the_inertia_of_the_boxes_that_it_consists_of) {
    static const double corners[6][2] = {{0.3, -0.2}, {1.3, -0.2}, {1.3, 0.1}, {0.7, 0.1}, {0.7, 1.4}, {0.3, 1.4}};
    kt_body body = solid_of(KT_SHAPE_POLYGON);
    const kt_mat3 r = turned();
    const kt_vec3 at = body.shape.at;
    sums both = box_sums(combine(at, 0.8, r.x, -0.05, r.y, 0.0, r.z), r, kt_vec3_make(1.0, 0.3, 0.25));
    add_sums(&both, box_sums(combine(at, 0.5, r.x, 0.75, r.y, 0.0, r.z), r, kt_vec3_make(0.4, 1.3, 0.25)));
    body.shape.length = 0.25;
    body.shape.point_count = 6;
    for (int first = 0; first < 6; first++)
        for (int way = 0; way < 2; way++) {
            double points[12];
            for (int i = 0; i < 6; i++) {
                const double *corner = corners[way ? (first + 6 - i) % 6 : (first + i) % 6];
                points[2 * i] = corner[0];
                points[2 * i + 1] = corner[1];
            }
            body.shape.points = points;
            compare("polygon", &body, both, 2.0);
        }
}

/* For legs a and b, the means of squares from the centroid are a^2 / 18 and b^2 / 18. The mean of the product is -a b /
 * 36. */
KT_TEST(triangle_has_the_inertia_of_its_closed_form) {
    static const double points[6] = {0.0, 0.0, 0.6, 0.0, 0.0, 0.9};
    kt_body body = solid_of(KT_SHAPE_POLYGON);
    kt_vec3 com;
    kt_sym3 inertia;
    body.shape.at = kt_vec3_make(0.0, 0.0, 1.0);
    body.shape.rotation = (kt_rotation){.type = KT_ROTATION_NONE};
    body.shape.points = points;
    body.shape.point_count = 3;
    body.shape.length = 0.3;
    kt_check_equal_int("status", kt_body_inertia(&body, &com, &inertia, NULL), KT_OK);
    const double xx = 0.36 / 18.0, yy = 0.81 / 18.0, xy = -0.54 / 36.0, zz = 0.09 / 12.0, m = body.mass;
    const double observed[] = {com.x, com.y, com.z, inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz};
    const double expected[] = {0.2, 0.3, 1.0, m * (yy + zz), m * (xx + zz), m * (xx + yy), -m * xy, 0.0};
    for (int i = 0; i < 8; i++)
        kt_check_near("number", observed[i], expected[i], 8.0 * DBL_EPSILON);
}

KT_TEST(point_has_no_inertia) {
    kt_body body = solid_of(KT_SHAPE_POINT);
    kt_vec3 com;
    kt_sym3 inertia;
    kt_check_equal_int("status", kt_body_inertia(&body, &com, &inertia, NULL), KT_OK);
    kt_check_equal_bits("com", &com.x, &body.shape.at.x, 3);
    static const double none[6] = {0.0};
    kt_check_equal_bits("inertia", &inertia.xx, none, 6);
}

KT_TEST(given_com_and_inertia_stay) {
    kt_body body = solid_of(KT_SHAPE_SPHERE);
    body.shape.radius = 0.5;
    body.com = kt_vec3_make(1.0, 2.0, 3.0);
    body.inertia = kt_sym3_make(2.0, 2.5, 3.0, 0.1, 0.2, 0.3);
    kt_vec3 com;
    kt_sym3 inertia;
    body.com_of_shape = false;
    kt_check_equal_int("status", kt_body_inertia(&body, &com, &inertia, NULL), KT_OK);
    kt_check_equal_bits("com given", &com.x, &body.com.x, 3);
    kt_check_near("inertia of the shape, 2/5 m r^2", inertia.yy, 0.25, DBL_EPSILON);
    body.com_of_shape = true;
    body.inertia_of_shape = false;
    kt_check_equal_int("status", kt_body_inertia(&body, &com, &inertia, NULL), KT_OK);
    kt_check_equal_bits("com of the shape", &com.x, &body.shape.at.x, 3);
    kt_check_equal_bits("inertia given", &inertia.xx, &body.inertia.xx, 6);
    body.com_of_shape = false;
    body.shape.type = KT_SHAPE_NONE;
    kt_check_equal_int("status without a shape", kt_body_inertia(&body, &com, &inertia, NULL), KT_OK);
}

KT_TEST(shape_without_mass_properties_is_rejected) {
    kt_body body = solid_of(KT_SHAPE_NONE);
    kt_vec3 com = {7.0, 7.0, 7.0};
    kt_sym3 inertia = {7.0, 7.0, 7.0, 7.0, 7.0, 7.0};
    const kt_vec3 com_before = com;
    const kt_sym3 inertia_before = inertia;
    kt_error error;
    kt_check_equal_int("none", kt_body_inertia(&body, &com, &inertia, &error), KT_ERROR_MODEL);
    kt_check_text("where", error.where, "body 'solid'");
    kt_check_text("message", error.message,
                  "the com is to follow from the shape, and the body has no shape; give a shape or the com");
    body.shape.type = KT_SHAPE_SPHERE;
    body.shape.radius = -1.0;
    kt_check_equal_int("negative", kt_body_inertia(&body, &com, &inertia, &error), KT_ERROR_MODEL);
    kt_check_text("message", error.message, "shape.radius is -1; it must be greater than 0");
    kt_check_equal_int("no error wanted", kt_body_inertia(&body, &com, &inertia, NULL), KT_ERROR_MODEL);
    kt_check_equal_bits("com is not touched", &com.x, &com_before.x, 3);
    kt_check_equal_bits("inertia is not touched", &inertia.xx, &inertia_before.xx, 6);
}
