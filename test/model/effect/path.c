/* Paths around spheres and cylinders: closed forms and least lengths, differences of the length, the balance of energy,
 * and faults. effect/expression differentiates them, and robot/mujoco compares them with MuJoCo's. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "files/scene/collect.h"

#include "evaluate/path_force.h"
#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

typedef struct mechanism {
    kt_scene *scene;
    kt_model *model;
    kt_data *data;
    double q[40], v[40];
} mechanism;

static void make(mechanism *s, const char *text) {
    const kt_opened at = kt_test_open(kt_test_scene(text), NULL);
    *s = (mechanism){.scene = at.scene, .model = at.model, .data = at.data};
    kt_model_initial(s->model, s->q, s->v);
}

/* A recorded quantity of an effect, at the state of the mechanism. */
static double quantity_of(mechanism *s, int effect, kt_effect_quantity quantity) {
    double values[64];
    int at = 0;
    kt_error error = {0};
    if (kt_kinematics_update(s->model, s->data, s->q, s->v, NULL, &error) != KT_OK ||
        kt_effect_quantities_evaluate(s->model, s->data, 0.0, s->q, s->v, values, &error) != KT_OK)
        return (double)NAN;
    for (int i = 0; i < effect; i++)
        at += kt_effect_quantity_count(s->model, i);
    for (int k = 0; k < kt_effect_quantity_count(s->model, effect); k++)
        if (kt_effect_quantity_at(s->model, effect, k) == quantity)
            return values[at + k];
    return (double)NAN;
}

static double length_of(mechanism *s, int effect) { return quantity_of(s, effect, KT_QUANTITY_LENGTH); }

/* The length of a path from p, which is fixed, to q on a free body, around a surface in the origin. */
static double length_around(kt_vec3 p, kt_vec3 q, const char *surface) {
    char text[1000];
    mechanism s;
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n  - {name: b, joint: {type: free, position: {position: [%.17g, %.17g, %.17g]}}, "
        "mass: 1, shape: {type: sphere, radius: 0.1}}\neffects:\n  - {type: expression, force: \"-length\", "
        "path: [{body: world, at: [%.17g, %.17g, %.17g]}, {body: world, %s}, b]}\n",
        q.x, q.y, q.z, p.x, p.y, p.z, surface);
    make(&s, text);
    return length_of(&s, 0);
}

/* ---- lengths ----------------------------------------------------------------------------------------------------- */

/* The points lie above the surface by 1e-12 of its radius, which lengthens a path by less than 1e-17. */
KT_TEST(paths_between_points_of_a_surface_are_geodesics) {
    const double r = 0.3 * (1.0 + 1e-12), phi = 2.2, h = 0.7;
    const kt_vec3 p = {r, 0.0, 0.1}, q = {r * cos(phi), r * sin(phi), 0.1 + h};
    kt_check_near("helix", length_around(p, q, "radius: 0.3, axis: z"), hypot(0.3 * phi, h), 1e-12);
    const kt_vec3 a = {r, 0.0, 0.0}, b = {r * cos(phi), 0.6 * r * sin(phi), 0.8 * r * sin(phi)};
    kt_check_near("great circle", length_around(a, b, "radius: 0.3"), 0.3 * phi, 1e-12);
    const double d = 0.9, arc = 2.0 * (pi - acos(0.3 / d)) - phi; /* on the other side */
    const kt_vec3 from = {d, 0.0, 0.0}, to = {d * cos(phi), 0.6 * d * sin(phi), 0.8 * d * sin(phi)};
    kt_check_near("on a side", length_around(from, to, "radius: 0.3, side: [-1, -3, -4]"),
                  2.0 * sqrt(d * d - 0.09) + 0.3 * arc, 1e-14);
}

/* A rope over a wheel, with both ends at the depth h below its axis and a beside it: two tangents and an arc. */
KT_TEST(a_rope_over_a_wheel_has_two_tangents_and_an_arc) {
    const double a = 0.5, h = 1.2, r = 0.2, d = hypot(a, h), s = sqrt(d * d - r * r);
    const double arc = 2.0 * (pi - atan2(a, h) - acos(r / d));
    const kt_vec3 p = {-a, 0.0, -h}, q = {a, 0.0, -h};
    const double bound = 8.0 * DBL_EPSILON * (2.0 * s + r * arc);
    kt_check_near("over", length_around(p, q, "radius: 0.2, axis: y, side: [0, 0, 1]"), 2.0 * s + r * arc, bound);
    kt_check_near("under", length_around(p, q, "radius: 0.2, axis: y, side: [0, 0, -1]"), 2.0 * a, bound);
    kt_check_near("beside", length_around(p, q, "radius: 0.2, axis: y"), 2.0 * a, bound);
}

static kt_vec3 random_point(kt_random *random, double least, double most) {
    kt_vec3 p;
    do
        p = kt_vec3_make(most * kt_random_uniform(random, -1.0, 1.0), most * kt_random_uniform(random, -1.0, 1.0),
                         most * kt_random_uniform(random, -1.0, 1.0));
    while (hypot(p.x, p.y) < least);
    return p;
}

/* Whether the line from p to the point of the circle at an angle does not cut the circle. */
static bool sees(kt_vec3 p, double r, double angle) {
    return fabs(remainder(angle - atan2(p.y, p.x), 2.0 * pi)) <= acos(r / hypot(p.x, p.y));
}

/* |p - T(alpha)| + |q - T(beta)| + r |beta - alpha| about z, and with the height h along z. Infinite for a path through
 * the cylinder. */
static double length_by_angles(kt_vec3 p, kt_vec3 q, double r, double alpha, double beta, bool is_ring) {
    const double first = hypot(p.x - r * cos(alpha), p.y - r * sin(alpha));
    const double last = hypot(q.x - r * cos(beta), q.y - r * sin(beta));
    if (!is_ring && !(sees(p, r, alpha) && sees(q, r, beta)))
        return INFINITY;
    return hypot(first + last + (is_ring ? 0.0 : r * fabs(beta - alpha)), q.z - p.z);
}

/* The least length over both angles by halved grids; at a ring the angles are one. */
static double least_length(kt_vec3 p, kt_vec3 q, double r, bool is_ring) {
    double best = INFINITY, at[2] = {atan2(p.y, p.x), 0.0}, width = pi;
    for (int round = 0; round < 60; round++, width *= 0.6) {
        const double middle[2] = {at[0], at[1]};
        for (int i = -20; i <= 20; i++)
            for (int k = is_ring ? i : -20; k <= (is_ring ? i : 20); k++) {
                const double alpha = middle[0] + width * i / 20.0;
                const double turn = is_ring ? 0.0 : middle[1] + width * k / 20.0;
                const double length = length_by_angles(p, q, r, alpha, alpha + turn, is_ring);
                if (!(length < best))
                    continue;
                best = length;
                at[0] = alpha;
                at[1] = turn;
            }
    }
    return best;
}

/* Points on both sides of the axis, so that the line meets the cylinder; or outside of the ring. A path through tangent
 * points is a least one among all with an arc. */
KT_TEST(bent_paths_are_the_least_ones) {
    kt_random random = kt_random_of_test();
    KT_WORST around = kt_worst_make("around"), through = kt_worst_make("through a ring");
    for (int i = 0; i < 40; i++) {
        const double r = 0.3, turn = 0.4 * kt_random_uniform(&random, -1.0, 1.0);
        const kt_vec3 p = random_point(&random, 0.35, 1.0);
        const double reach = 0.4 + 0.3 * kt_random_uniform(&random, -1.0, 1.0) + 0.3;
        const double angle = atan2(p.y, p.x) + pi + turn * asin(0.3 / hypot(p.x, p.y));
        const kt_vec3 q = {reach * cos(angle), reach * sin(angle), kt_random_uniform(&random, -1.0, 1.0)};
        const double observed = length_around(p, q, "radius: 0.3, axis: z");
        if (reach > r && observed > kt_vec3_norm(kt_vec3_sub(q, p)) + 1e-6)
            kt_worst_near(&around, observed, least_length(p, q, r, false), 1e-14, "%d", i);
        const kt_vec3 to = random_point(&random, 0.35, 1.0);
        const double inside = length_around(p, to, "radius: 0.3, axis: z, inside: true");
        if (inside > kt_vec3_norm(kt_vec3_sub(to, p)) + 1e-6)
            kt_worst_near(&through, inside, least_length(p, to, r, true), 1e-14, "%d", i);
    }
    kt_check_above("bent paths", (double)around.count, 20.0);
    kt_check_above("paths at the ring", (double)through.count, 10.0);
}

/* ---- gradients --------------------------------------------------------------------------------------------------- */

#define BODIES                                                                                                         \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"                                                                   \
    "  - {name: arm, joint: {type: revolute, axis: y, at: [3, 0, 0], position: 20 deg, velocity: 1}, mass: 1,\n"       \
    "     shape: {type: rod, to: [0, 0, -1]}, markers: {tip: [0, 0.02, -1]}}\n"                                        \
    "  - {name: leg, parent: arm, joint: {type: universal, at: [0, 0, -1], axis: x, axis2: y,\n"                       \
    "     position: [40 deg, 10 deg], velocity: [-2, 1]}, mass: 1, shape: {type: rod, to: [0, 0, -1]},\n"              \
    "     markers: {toe: [0.1, 0, -1]}}\n"                                                                             \
    "  - {name: ball, joint: {type: free, position: {position: [4, 0.2, 0]}, velocity: {linear: [1, 2, 3],\n"          \
    "     angular: [1, -1, 2]}}, mass: 1, shape: {type: sphere, radius: 0.3}, markers: {eye: [0.1, 0, 0.05]}}\n"

static const char *const paths[] = {
    "[world, {body: arm, at: [0, 0, -0.5], radius: 0.2}, ball.eye]",
    "[leg.toe, {body: arm, at: [0.2, 0, 0], radius: 0.4, axis: [0.1, 1, 0.2]}, ball.eye]",
    "[arm.tip, {body: ball, at: [0.3, 0, 0], radius: 0.1, axis: x, side: [0, 1, 0]}, leg.toe]",
    "[arm.tip, {body: ball, radius: 0.15, inside: true}, leg.toe]",
    "[arm.tip, {body: ball, radius: 0.15, axis: [1, 0.4, 0], inside: true}, leg.toe]",
    "[world, {body: arm, radius: 0.25, side: [0, 0, 1]}, ball.eye, leg.toe, {body: world, at: [3, 0.5, 1], divisor: "
    "0.5}, {body: leg, at: [0, 0, -0.5], radius: 0.1, axis: z}, {body: ball, at: [0, 0, -0.2]}, {body: arm, divisor: "
    "3}, ball.eye]",
};

/* The joint forces of a unit force along a path are the derivatives of its length, whose rate is J v. The central
 * differences with h = 1e-6 have an error of some 1e-10 by rounding. */
KT_TEST(forces_along_paths_are_gradients_of_their_lengths) {
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        char text[3000];
        mechanism s;
        kt_error error = {0};
        double forces[40], rate = 0.0, step[40] = {0.0}, q[40];
        (void)snprintf(text, sizeof text, BODIES "effects:\n  - {type: expression, path: %s, force: \"1 + 0*t\"}\n",
                       paths[i]);
        make(&s, text);
        kt_check_equal_int("status", kt_effect_forces(s.model, s.data, 0.0, s.q, s.v, forces, &error), KT_OK);
        const double observed = quantity_of(&s, 0, KT_QUANTITY_LENGTH_RATE);
        kt_check_near("power", quantity_of(&s, 0, KT_QUANTITY_POWER), observed, 1e-15);
        KT_WORST worst = kt_worst_make(paths[i]);
        memcpy(q, s.q, sizeof q);
        for (int j = 0; j < kt_model_nv(s.model); j++) {
            double length[2];
            for (int k = 0; k < 2; k++) {
                step[j] = k == 0 ? -1e-6 : 1e-6;
                kt_position_add(s.model, q, step, s.q);
                length[k] = length_of(&s, 0);
            }
            step[j] = 0.0;
            rate += forces[j] * s.v[j];
            kt_worst_near(&worst, forces[j], (length[1] - length[0]) / 2e-6, 1e-8, "dL/dq[%d]", j);
        }
        kt_check_near("rate", observed, rate, 1e-13);
    }
}

typedef struct traced {
    double length;
    int count, gaps;
    kt_vec3 last;
} traced;

static void add_line(void *user, kt_vec3 from, kt_vec3 to) {
    traced *t = user;
    t->gaps += t->count > 0 && kt_vec3_norm(kt_vec3_sub(from, t->last)) > 1e-14;
    t->length += kt_vec3_norm(kt_vec3_sub(to, from));
    t->count++;
    t->last = to;
}

/* The lines of a picture are inside of the arcs: 12 lines of an arc are shorter than the arc, by (theta / 12)^2 / 24 of
 * it. They follow one another, but for the beginnings of branches. */
KT_TEST(lines_of_pictures_follow_the_paths) {
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        char text[3000];
        mechanism s;
        kt_pose poses[4];
        traced t = {.length = 0.0};
        (void)snprintf(text, sizeof text, BODIES "effects:\n  - {type: expression, path: %s, force: \"1 + 0*t\"}\n",
                       paths[i]);
        make(&s, text);
        const double length = length_of(&s, 0);
        for (int body = 0; body < 4; body++)
            poses[body] = kt_body_pose(s.model, s.data, body);
        const int count = kt_path_lines(s.model, 0, poses, add_line, &t);
        kt_check_equal_int("lines", count, t.count);
        kt_check_equal_int("their number alone", kt_path_lines(s.model, 0, NULL, NULL, NULL), count);
        const bool is_branched = strstr(paths[i], "divisor") != NULL;
        kt_check_equal_int("gaps", t.gaps, is_branched ? 2 : 0);
        if (!is_branched)
            kt_check_near(paths[i], t.length, length * (1.0 - 2e-4), 2e-4 * length + 1e-13);
    }
}

/* The length and its slope are continuous where a line begins to touch a surface. The change over 2 h is then 2 h times
 * the slope, up to some h^2. */
KT_TEST(lengths_have_no_kink_where_a_line_touches_a_surface) {
    static const char *const surfaces[] = {"radius: 0.5", "radius: 0.5, axis: y", "radius: 0.5, inside: true",
                                           "radius: 0.5, axis: y, inside: true", "radius: 0.5, side: [0, 0, 1]"};
    const double h = 1e-5;
    for (size_t i = 0; i < sizeof surfaces / sizeof *surfaces; i++) {
        double length[3];
        for (int k = 0; k < 3; k++) {
            const kt_vec3 p = {-1.0, 0.0, 0.5 + (k - 1) * h}, q = {1.5, 0.0, 0.5 + (k - 1) * h};
            length[k] = length_around(p, q, surfaces[i]);
        }
        kt_check_near(surfaces[i], length[2] - length[0], 0.0, 10.0 * h * h);
        kt_check_near("touching", length[1], 2.5, 1e-12);
    }
}

/* ---- a motion ---------------------------------------------------------------------------------------------------- */

/* Two weights on an elastic rope over a drum, and a pendulum whose elastic rope touches and leaves a peg. The energy
 * k (L - L0)^2 / 2 of the ropes is what the formulas have taken. */
KT_TEST(elastic_ropes_conserve_energy) {
    static const char *const text =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: a, joint: {type: prismatic, axis: z, at: [-0.25, 0, -1], velocity: 0.2}, mass: 1, shape: {type: "
        "sphere, radius: 0.05}}\n"
        "  - {name: b, joint: {type: prismatic, axis: [0.1, 0.2, 1], at: [0.3, 0.1, -1.1]}, mass: 1, shape: {type: "
        "sphere, radius: 0.05}}\n"
        "  - {name: bob, joint: {type: free, position: {position: [2.6, 0.1, -0.8]}}, mass: 1, shape: {type: sphere, "
        "radius: 0.05}}\n"
        "effects:\n"
        "  - {type: expression, path: [a, {body: world, radius: 0.2, axis: y, side: [0, 0, 1]}, b], "
        "force: \"-300*(length - 2.7)\"}\n"
        "  - {type: expression, path: [{body: world, at: [2, 0, 0]}, {body: world, at: [1.85, 0, -0.5], radius: "
        "0.05, axis: y}, bob], force: \"-400*(length - 1)\"}\n"
        "simulate: {duration: 2, tolerance: 1e-11, integrator: dop853}\n";
    mechanism s;
    kt_error error = {0};
    make(&s, text);
    kt_simulation *simulation = kt_test_simulation(s.model, &s.scene->run, NULL);
    double first = 0.0;
    int bent = 0, straight = 0;
    KT_WORST worst = kt_worst_make("energy, J");
    for (int k = 0; k <= 100; k++) {
        memcpy(s.q, kt_simulation_positions(simulation), (size_t)kt_model_nq(s.model) * sizeof(double));
        memcpy(s.v, kt_simulation_velocities(simulation), (size_t)kt_model_nv(s.model) * sizeof(double));
        const double x = length_of(&s, 0) - 2.7, y = length_of(&s, 1) - 1.0;
        const double energy =
            kt_kinetic_energy(s.model, s.data) + kt_potential_energy(s.model, s.data) + 150.0 * x * x + 200.0 * y * y;
        const kt_vec3 b = kt_body_pose(s.model, s.data, 3).position;
        const double line = kt_vec3_norm(kt_vec3_sub(b, kt_vec3_make(2.0, 0.0, 0.0)));
        bent += y + 1.0 > line + 1e-9;
        straight += y + 1.0 <= line + 1e-9;
        first = k == 0 ? energy : first;
        kt_worst_near(&worst, energy, first, 1e-8, "t = %g", 0.02 * k);
        if (kt_simulation_advance(simulation, 0.02 * (k + 1), &error) != KT_OK)
            break;
    }
    kt_check_text("error", error.message, "");
    kt_check_above("records at the peg", (double)bent, 5.0);
    kt_check_above("records beside it", (double)straight, 5.0);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(impossible_paths_are_rejected) {
    static const struct {
        const char *path, *message;
    } table[] = {
        {"[{body: world, radius: 1}, ball]", "a surface is between two points"},
        {"[world, {body: arm, radius: 1}, {body: leg, radius: 1}, ball]", "a surface is between two points"},
        {"[world, {body: arm, radius: 1}, {body: leg, divisor: 1}, ball]", "a surface is between two points"},
        {"[world, arm, {body: arm, radius: 1, divisor: 2}, ball]", "a branch begins at a point"},
        {"[world, arm, {body: ball, divisor: 2}]", "a branch of a path has two points or more"},
        {"[ball, ball.eye]", "all its points are on one body"},
        {"[world, {body: arm, axis: y}, ball]", "axis, side and inside are of a surface"},
        {"[world, {body: arm, radius: -1}, ball]", "0"},
        {"[world, {body: hand, radius: 1}, ball]", "hand"},
        {"[world, arm.top]", "top"},
        {"[world]", "a list of two points or more"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[3000];
        kt_scene scene;
        kt_error error = {0};
        (void)snprintf(text, sizeof text, BODIES "effects:\n  - {type: expression, path: %s, force: \"1 + 0*t\"}\n",
                       table[i].path);
        kt_need(
            kt_check_true(table[i].path, kt_scene_parse("x", text, strlen(text), &scene, NULL, NULL, &error) != KT_OK));
        kt_check_contains("message", error.message, table[i].message);
    }
}
