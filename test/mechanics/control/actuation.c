/* Forces of actuators in mechanisms with loops. Closed forms: a delta robot and a five-bar. Forward dynamics: a Stewart
 * platform and a leg that bends its knee through a four-bar, by dense matrices and by fronts. Also rejected inputs.
 *
 * Closed form of n legs that carry a point mass m at x. Leg i has an arm of length L on a pivot p, along
 *     e = u cos(th) + w sin(th)
 * A massless rod of constant length connects the end of the arm to x + b. The motion follows from
 *     s = x + b - p - L e,      e' = de/dth,   e'' = -e
 *     th'  = s.x' / (L s.e'),   th'' = (s.x'' + |x' - L e' th'|^2 - L s.e'' th'^2) / (L s.e')
 *     sum f s = m (x'' - g),    tau = J th'' - m_arm L g.e' / 2 + f L s.e'
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../../../bench/realtime/leg.h"
#include "files/scene/collect.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/control.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double third = 2.0943951023931953; /* of a turn */

/* ---- closed form ------------------------------------------------------------------------------------------------- */

enum { LEGS = 3 };

typedef struct leg {
    kt_vec3 pivot, u, w, b; /* u, w: the arm's direction at 0 and at a right angle */
    double arm, rod, mass;
    int elbow; /* which of the two angles: 1 or -1 */
    double angle, rate, acceleration, torque;
    kt_vec3 s, slope; /* slope: de/dth */
} leg;

typedef struct parallel {
    int legs; /* 2: in the plane of x and y */
    leg leg[LEGS];
    double mass;
    kt_vec3 gravity, x, v, a;
} parallel;

static kt_vec3 along(const leg *l, double c, double s) {
    return kt_vec3_add(kt_vec3_scale(c, l->u), kt_vec3_scale(s, l->w));
}

/* |d - L e|^2 = rod^2: 2 L (d.u cos + d.w sin) = d.d + L^2 - rod^2 */
static void solve_leg(const parallel *p, leg *l) {
    const kt_vec3 d = kt_vec3_sub(kt_vec3_add(p->x, l->b), l->pivot);
    const double c = kt_vec3_dot(d, l->u), s = kt_vec3_dot(d, l->w), size = sqrt(c * c + s * s);
    const double whole = (kt_vec3_dot(d, d) + l->arm * l->arm - l->rod * l->rod) / (2.0 * l->arm);
    l->angle = atan2(s, c) + l->elbow * acos(whole / size);
    const kt_vec3 e = along(l, cos(l->angle), sin(l->angle));
    l->slope = along(l, -sin(l->angle), cos(l->angle));
    l->s = kt_vec3_sub(d, kt_vec3_scale(l->arm, e));
    const double turn = l->arm * kt_vec3_dot(l->s, l->slope);
    l->rate = kt_vec3_dot(l->s, p->v) / turn;
    const kt_vec3 change = kt_vec3_sub(p->v, kt_vec3_scale(l->arm * l->rate, l->slope));
    l->acceleration =
        (kt_vec3_dot(l->s, p->a) + kt_vec3_dot(change, change) + l->arm * kt_vec3_dot(l->s, e) * l->rate * l->rate) /
        turn;
}

static double determinant(kt_vec3 a, kt_vec3 b, kt_vec3 c) { return kt_vec3_dot(a, kt_vec3_cross(b, c)); }

static void solve_parallel(parallel *p) {
    kt_vec3 s[LEGS] = {[2] = {0.0, 0.0, 1.0}};
    for (int i = 0; i < p->legs; i++) {
        solve_leg(p, &p->leg[i]);
        s[i] = p->leg[i].s;
    }
    const kt_vec3 load = kt_vec3_scale(p->mass, kt_vec3_sub(p->a, p->gravity));
    const double all = determinant(s[0], s[1], s[2]);
    const double f[LEGS] = {determinant(load, s[1], s[2]) / all, determinant(s[0], load, s[2]) / all,
                            determinant(s[0], s[1], load) / all};
    for (int i = 0; i < p->legs; i++) {
        leg *l = &p->leg[i];
        l->torque = l->mass * l->arm * l->arm / 3.0 * l->acceleration -
                    0.5 * l->mass * l->arm * kt_vec3_dot(p->gravity, l->slope) +
                    f[i] * l->arm * kt_vec3_dot(l->s, l->slope);
    }
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

typedef struct motion {
    double q[LINKAGE_NQ], v[LINKAGE_NQ], a[LINKAGE_NQ];
} motion;

static void *work_of(const kt_model *model, size_t *size) {
    *size = (kt_actuation_work_size(model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, *size);
    if (work)
        memset(work, 0xff, *size); /* NaN: previous contents must not matter */
    return work;
}

/* Completes velocities and accelerations from those of the list, then finds the forces. */
static bool invert(const kt_model *model, kt_data *data, motion *m, kt_coordinate_list independent,
                   kt_coordinate_list actuated, const double *weights, double *forces) {
    size_t size;
    void *work = work_of(model, &size);
    kt_error e = {0};
    const bool fine =
        kt_fine("velocities", kt_velocity_complete(model, data, work, size, 0.0, m->q, independent, m->v, &e), &e) &&
        kt_fine("accelerations",
                kt_acceleration_complete(model, data, work, size, 0.0, m->q, m->v, independent, m->a, &e), &e) &&
        kt_fine("forces",
                kt_actuation_evaluate(model, data, work, size, 0.0, m->q, m->v, m->a, NULL, actuated, weights, forces,
                                      NULL, &e),
                &e);
    free(work);
    return fine;
}

/* Forward dynamics with these forces; `part` of the largest acceleration. */
static void compare_forward(const kt_model *model, kt_data *data, const motion *m, kt_coordinate_list actuated,
                            const double *forces, double part) {
    double tau[LINKAGE_NQ] = {0.0}, a[LINKAGE_NQ], size = 0.0, off = 0.0;
    kt_error e = {0};
    for (int i = 0; i < actuated.count; i++)
        tau[actuated.index[i]] += forces[i];
    kt_need_fine("forward", kt_acceleration_evaluate(model, data, 0.0, m->q, m->v, tau, NULL, a, &e), &e);
    for (int i = 0; i < kt_model_nv(model); i++) {
        size = fmax(size, fabs(m->a[i]));
        off = isnan(a[i]) ? (double)NAN : fmax(off, fabs(a[i] - m->a[i]));
    }
    kt_check_below("a by forward dynamics, against the largest", off / size, part);
}

/* ---- delta robot ------------------------------------------------------------------------------------------------- */

static void draw_delta(parallel *p) {
    *p = (parallel){.legs = 3, .mass = 0.8, .gravity = {0.0, 0.0, -9.81}};
    p->x = kt_vec3_make(0.07, -0.04, -0.62);
    p->v = kt_vec3_make(0.8, 0.5, -0.3);
    p->a = kt_vec3_make(-4.0, 3.0, 6.0);
    for (int i = 0; i < 3; i++) {
        const kt_vec3 out = kt_vec3_make(cos(i * third), sin(i * third), 0.0);
        p->leg[i] = (leg){.pivot = kt_vec3_scale(0.2, out),
                          .u = out,
                          .w = {0.0, 0.0, -1.0},
                          .b = kt_vec3_scale(0.05, out),
                          .arm = 0.3,
                          .rod = 0.6,
                          .mass = 0.4,
                          .elbow = -1};
    }
    solve_parallel(p);
}

/* The platform moves along x, y and z; two of the bodies in between have no mass. */
static void build_delta(linkage *l, const parallel *p, kt_structure structure) {
    static const char *const names[] = {"arm0", "arm1", "arm2", "along", "across", "platform"};
    const kt_vec3 none = {0.0, 0.0, 0.0}, axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    linkage_begin(l);
    l->options.structure = structure;
    l->description.gravity = p->gravity;
    for (int i = 0; i < 3; i++) {
        const leg *g = &p->leg[i];
        kt_body *arm = linkage_bar(l, names[i], NULL, g->pivot, kt_vec3_scale(g->arm, g->u), g->angle, g->rate);
        arm->joint.axis = kt_vec3_cross(g->u, g->w);
        arm->mass = g->mass;
        const double k = g->mass * g->arm * g->arm / 12.0; /* a slender rod: k (1 - u u') */
        arm->inertia =
            kt_sym3_make(k * (1.0 - g->u.x * g->u.x), k * (1.0 - g->u.y * g->u.y), k, -k * g->u.x * g->u.y, 0.0, 0.0);
    }
    for (int i = 0; i < 3; i++) {
        kt_body *body = linkage_bar(l, names[3 + i], i ? names[2 + i] : NULL, none, none, (&p->x.x)[i], (&p->v.x)[i]);
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = axes[i];
        body->mass = i == 2 ? p->mass : 0.0;
    }
    for (int i = 0; i < 3; i++)
        linkage_close(l,
                      i == 0   ? "rod0"
                      : i == 1 ? "rod1"
                               : "rod2",
                      KT_LOOP_DISTANCE, names[i], kt_vec3_scale(p->leg[i].arm, p->leg[i].u), "platform", p->leg[i].b);
    linkage_compile(l);
}

static int coordinate(const kt_model *model, const char *name) {
    return kt_body_coordinates(model, kt_body_find(model, name)).v;
}

KT_TEST(torques_of_a_delta_robot_are_those_of_the_closed_form) {
    for (int structure = KT_STRUCTURE_DENSE; structure <= KT_STRUCTURE_FRONTS; structure++) {
        linkage l;
        parallel p;
        motion m = {.q = {0.0}};
        double torque[3];
        draw_delta(&p);
        build_delta(&l, &p, (kt_structure)structure);
        const int arms[3] = {coordinate(l.model, "arm0"), coordinate(l.model, "arm1"), coordinate(l.model, "arm2")};
        const int last = coordinate(l.model, "platform"), xyz[3] = {last - 2, last - 1, last};
        const kt_coordinate_list actuated = {arms, 3}, platform = {xyz, 3};
        memcpy(m.q, l.q, sizeof l.q);
        for (int i = 0; i < 3; i++) {
            m.v[xyz[i]] = (&p.v.x)[i];
            m.a[xyz[i]] = (&p.a.x)[i];
        }
        if (invert(l.model, l.data, &m, platform, actuated, NULL, torque)) {
            compare_forward(l.model, l.data, &m, actuated, torque, 1e-14);
            for (int i = 0; i < 3; i++) {
                kt_check_near("rate of an arm", m.v[arms[i]], p.leg[i].rate, 2e-14);
                kt_check_near("acceleration of an arm", m.a[arms[i]], p.leg[i].acceleration, 2e-13);
                kt_check_near("torque", torque[i], p.leg[i].torque, 1e-14);
            }
        }
    }
}

/* ---- five-bar ---------------------------------------------------------------------------------------------------- */

static void draw_five_bar(parallel *p) {
    *p = (parallel){.legs = 2, .mass = 1.5, .gravity = {0.0, -9.81, 0.0}};
    p->x = kt_vec3_make(0.05, 0.5, 0.0);
    p->v = kt_vec3_make(0.6, -0.4, 0.0);
    p->a = kt_vec3_make(3.0, 5.0, 0.0);
    for (int i = 0; i < 2; i++)
        p->leg[i] = (leg){.pivot = {i ? 0.1 : -0.1, 0.0, 0.0},
                          .u = {1.0, 0.0, 0.0},
                          .w = {0.0, 1.0, 0.0},
                          .arm = 0.3,
                          .rod = 0.4,
                          .mass = i ? 0.5 : 0.7,
                          .elbow = i ? -1 : 1};
    solve_parallel(p);
}

/* The rod of the first leg carries the mass at its end, where that of the second is pinned to it. */
static void build_five_bar(linkage *l, const parallel *p, kt_structure structure) {
    static const char *const names[2][2] = {{"left", "carrier"}, {"right", "rod"}};
    linkage_begin(l);
    l->options.structure = structure;
    for (int i = 0; i < 2; i++) {
        const leg *g = &p->leg[i];
        kt_body *arm = linkage_bar(l, names[i][0], NULL, g->pivot, kt_vec3_make(g->arm, 0.0, 0.0), g->angle, g->rate);
        arm->mass = g->mass;
        arm->inertia = kt_sym3_make(0.0, g->mass * g->arm * g->arm / 12.0, g->mass * g->arm * g->arm / 12.0, 0, 0, 0);
        kt_body *rod = linkage_bar(l, names[i][1], names[i][0], kt_vec3_make(g->arm, 0.0, 0.0),
                                   kt_vec3_make(g->rod, 0.0, 0.0), atan2(g->s.y, g->s.x) - g->angle, 0.0);
        rod->mass = i ? 0.0 : p->mass;
        rod->com = kt_vec3_make(i ? 0.0 : g->rod, 0.0, 0.0);
        rod->inertia = kt_sym3_make(0, 0, 0, 0, 0, 0);
    }
    linkage_close(l, "pin", KT_LOOP_REVOLUTE, "carrier", kt_vec3_make(0.4, 0.0, 0.0), "rod",
                  kt_vec3_make(0.4, 0.0, 0.0));
    linkage_compile(l);
}

/* The rates of the carrier against its arm for unit rates of the arms. The end moves such that
 *     s_i . x' = L s_i.e_i' th_i'
 * The carrier turns at s x (x' - L e' th') / rod^2. */
static void carrier_rates(const parallel *p, double c[2]) {
    const kt_vec3 a = p->leg[0].s, b = p->leg[1].s;
    const double all = a.x * b.y - a.y * b.x;
    for (int i = 0; i < 2; i++) {
        const double t[2] = {i == 0 ? p->leg[0].arm * kt_vec3_dot(a, p->leg[0].slope) : 0.0,
                             i == 1 ? p->leg[1].arm * kt_vec3_dot(b, p->leg[1].slope) : 0.0};
        kt_vec3 v = kt_vec3_make((t[0] * b.y - t[1] * a.y) / all, (a.x * t[1] - b.x * t[0]) / all, 0.0);
        if (i == 0)
            v = kt_vec3_sub(v, kt_vec3_scale(p->leg[0].arm, p->leg[0].slope));
        c[i] = kt_vec3_cross(a, v).z / kt_vec3_dot(a, a) - (i == 0 ? 1.0 : 0.0);
    }
}

KT_TEST(torques_of_a_five_bar_are_those_of_the_closed_form_also_with_a_third_motor) {
    for (int structure = KT_STRUCTURE_DENSE; structure <= KT_STRUCTURE_FRONTS; structure++) {
        static const double weights[3] = {1.0, 2.5, 0.4};
        linkage l;
        parallel p;
        motion m = {.q = {0.0}};
        double torque[3], c[2];
        draw_five_bar(&p);
        build_five_bar(&l, &p, (kt_structure)structure);
        const int motors[3] = {coordinate(l.model, "left"), coordinate(l.model, "right"),
                               coordinate(l.model, "carrier")};
        memcpy(m.q, l.q, sizeof l.q);
        for (int i = 0; i < 2; i++) {
            m.v[motors[i]] = p.leg[i].rate;
            m.a[motors[i]] = p.leg[i].acceleration;
        }
        const kt_coordinate_list two = {motors, 2}, three = {motors, 3};
        if (invert(l.model, l.data, &m, two, two, NULL, torque)) {
            compare_forward(l.model, l.data, &m, two, torque, 1e-14);
            for (int i = 0; i < 2; i++)
                kt_check_near("torque", torque[i], p.leg[i].torque, 1e-14);
        }
        /* torque_i + c_i t = closed form: the least sum of weights times squares */
        carrier_rates(&p, c);
        double up = 0.0, down = weights[2];
        for (int i = 0; i < 2; i++) {
            up += weights[i] * c[i] * p.leg[i].torque;
            down += weights[i] * c[i] * c[i];
        }
        if (invert(l.model, l.data, &m, two, three, weights, torque)) {
            compare_forward(l.model, l.data, &m, three, torque, 1e-14);
            kt_check_near("third torque", torque[2], up / down, 1e-14);
            for (int i = 0; i < 2; i++)
                kt_check_near("torque next to it", torque[i], p.leg[i].torque - c[i] * up / down, 1e-14);
        }
    }
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

typedef struct subject {
    kt_model *model;
    kt_data *data;
    motion m;
} subject;

static void open_scene(subject *s, const char *name, kt_structure structure) {
    kt_error e = {0};
    kt_model_options options = kt_model_options_default();
    options.structure = structure;
    *s = (subject){.model = NULL};
    const kt_opened opened = kt_test_open(name ? kt_test_bundled(name) : kt_test_scene(kt_leg), &options);
    s->model = opened.model;
    s->data = opened.data;
    kt_model_initial(s->model, s->m.q, s->m.v);
    kt_need_fine("assembly", kt_state_assemble(s->model, s->data, 0.0, s->m.q, s->m.v, &e), &e);
}

/* Least forces times their weights are rates of a motion that the loops allow. */
static void check_least(subject *s, kt_coordinate_list first, kt_coordinate_list all, const double *weights,
                        const double *forces) {
    static double basis[LINKAGE_NQ * 6];
    const int nv = kt_model_nv(s->model);
    size_t size;
    void *work = work_of(s->model, &size);
    kt_error e = {0};
    double largest = 0.0;
    KT_WORST worst = kt_worst_make("weighted forces that are rates");
    for (int i = 0; i < all.count; i++)
        largest = fmax(largest, fabs(weights[i] * forces[i]));
    kt_need_fine("basis", kt_independent_basis(s->model, s->data, work, size, 0.0, s->m.q, first, basis, NULL, &e), &e);
    for (int i = 0; i < all.count; i++) {
        double rate = 0.0;
        for (int c = 0; c < first.count; c++)
            rate += basis[c * nv + all.index[i]] * weights[c] * forces[c];
        kt_worst_near(&worst, weights[i] * forces[i], rate, 2e-15 * largest, "actuator %d", i);
    }
    free(work);
}

/* Springs and dampers of its legs act besides. With three of the cylinders' joints there are nine actuators. */
KT_TEST(six_and_nine_actuators_move_a_stewart_platform_as_asked) {
    for (int structure = KT_STRUCTURE_DENSE; structure <= KT_STRUCTURE_FRONTS; structure++) {
        static const double weights[9] = {1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.1, 0.2, 0.3};
        subject s;
        int index[9];
        double forces[9];
        char name[16];
        open_scene(&s, "stewart", (kt_structure)structure);
        for (int i = 0; i < 9; i++) {
            (void)snprintf(name, sizeof name, "%s%d", i < 6 ? "piston" : "cylinder", i % 6 + 1);
            index[i] = coordinate(s.model, name);
            s.m.a[index[i]] = 0.5 * cos(1.7 * i);
        }
        const kt_coordinate_list six = {index, 6}, nine = {index, 9};
        if (invert(s.model, s.data, &s.m, six, six, NULL, forces))
            compare_forward(s.model, s.data, &s.m, six, forces, 3e-14);
        if (invert(s.model, s.data, &s.m, six, nine, weights, forces)) {
            compare_forward(s.model, s.data, &s.m, nine, forces, 3e-14);
            check_least(&s, six, nine, weights, forces);
        }
    }
}

KT_TEST(two_motors_move_a_leg_through_its_four_bar_as_asked) {
    for (int structure = KT_STRUCTURE_DENSE; structure <= KT_STRUCTURE_FRONTS; structure++) {
        subject s;
        double torque[2];
        open_scene(&s, NULL, (kt_structure)structure);
        const int motors[2] = {coordinate(s.model, "thigh"), coordinate(s.model, "crank")};
        const int joints[2] = {motors[0], coordinate(s.model, "shank")};
        s.m.v[joints[0]] = 2.0;
        s.m.v[joints[1]] = -3.0;
        s.m.a[joints[0]] = 10.0;
        s.m.a[joints[1]] = -25.0;
        if (invert(s.model, s.data, &s.m, (kt_coordinate_list){joints, 2}, (kt_coordinate_list){motors, 2}, NULL,
                   torque))
            compare_forward(s.model, s.data, &s.m, (kt_coordinate_list){motors, 2}, torque, 1e-14);
    }
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

/* Nothing drives the second of two pendulums; nothing but one motor the five-bar. */
KT_TEST(a_freedom_that_nothing_drives_is_named) {
    linkage l;
    size_t size;
    kt_error e = {0};
    double q[2] = {0.3, 0.4}, a[2] = {1.0, 2.0}, torque[2] = {7.0, 7.0};
    linkage_begin(&l);
    (void)linkage_bar(&l, "first", NULL, kt_vec3_make(0, 0, 0), kt_vec3_make(1, 0, 0), 0.3, 0.0);
    (void)linkage_bar(&l, "second", NULL, kt_vec3_make(3, 0, 0), kt_vec3_make(1, 0, 0), 0.4, 0.0);
    linkage_compile(&l);
    void *work = work_of(l.model, &size);
    const int index[2] = {0, 0};
    kt_check_equal_int("one of two",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){index, 1}, NULL, torque, NULL, &e),
                       KT_ERROR_SINGULAR);
    kt_check_text("where", e.where, "joint 'second'");
    kt_check_contains("what", e.message, "a motion that no actuator drives: 1 of the 1 coordinates");
    kt_check_equal_int("none",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){NULL, 0}, NULL, torque, NULL, &e),
                       KT_ERROR_SINGULAR);
    kt_check_equal_int("twice",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){index, 2}, NULL, torque, NULL, &e),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("weight",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){index, 1}, (const double[]){-1.0}, torque, NULL, &e),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("memory",
                       kt_actuation_evaluate(l.model, l.data, work, 8, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){index, 1}, NULL, torque, NULL, &e),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("one of two chosen",
                       kt_velocity_complete(l.model, l.data, work, size, 0.0, q, (kt_coordinate_list){index, 1}, a, &e),
                       KT_ERROR_SINGULAR);
    kt_check_contains("what", e.message, "in which all of the list rest");
    q[1] = (double)NAN;
    kt_check_equal_int("position",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, q, NULL, a, NULL,
                                             (kt_coordinate_list){index, 1}, NULL, torque, NULL, &e),
                       KT_ERROR_NOT_FINITE);
    kt_check_equal_int(
        "time",
        kt_velocity_complete(l.model, l.data, work, size, (double)INFINITY, a, (kt_coordinate_list){index, 1}, a, &e),
        KT_ERROR_NOT_FINITE);
    kt_check_equal_int(
        "index",
        kt_velocity_complete(l.model, l.data, work, size, 0.0, a, (kt_coordinate_list){(const int[]){2}, 1}, a, &e),
        KT_ERROR_ARGUMENT);
    kt_check_equal_int("number",
                       kt_velocity_complete(l.model, l.data, work, size, 0.0, a, (kt_coordinate_list){index, 3}, a, &e),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_bits("untouched", torque, (const double[]){7.0, 7.0}, 2);
    kt_check_equal_bits("untouched", a, (const double[]){1.0, 2.0}, 2);
    free(work);
}

KT_TEST(accelerations_that_open_a_loop_are_rejected) {
    linkage l;
    parallel p;
    motion m = {.q = {0.0}};
    kt_error e = {0};
    size_t size;
    double torque[4];
    draw_five_bar(&p);
    build_five_bar(&l, &p, KT_STRUCTURE_AUTO);
    void *work = work_of(l.model, &size);
    const int motors[4] = {coordinate(l.model, "left"), coordinate(l.model, "right"), coordinate(l.model, "carrier"),
                           coordinate(l.model, "rod")};
    const kt_coordinate_list two = {motors, 2};
    memcpy(m.q, l.q, sizeof l.q);
    for (int i = 0; i < 2; i++) {
        m.v[motors[i]] = p.leg[i].rate;
        m.a[motors[i]] = p.leg[i].acceleration;
    }
    if (invert(l.model, l.data, &m, two, two, NULL, torque)) {
        m.a[motors[3]] *= 1.0 + 1e-6;
        torque[0] = 7.0;
        kt_check_equal_int(
            "a millionth off",
            kt_actuation_evaluate(l.model, l.data, work, size, 0.0, m.q, m.v, m.a, NULL, two, NULL, torque, NULL, &e),
            KT_ERROR_CONSTRAINT);
        kt_check_contains("where", e.where, "loop 'pin'");
        kt_check_equal_bits("untouched", torque, (const double[]){7.0}, 1);
    }
    kt_check_equal_int(
        "three of two",
        kt_velocity_complete(l.model, l.data, work, size, 0.0, m.q, (kt_coordinate_list){motors, 3}, m.v, &e),
        KT_ERROR_ARGUMENT);
    kt_check_equal_int("one motor",
                       kt_actuation_evaluate(l.model, l.data, work, size, 0.0, m.q, NULL, NULL, NULL,
                                             (kt_coordinate_list){motors, 1}, NULL, torque, NULL, &e),
                       KT_ERROR_SINGULAR);
    free(work);
}
