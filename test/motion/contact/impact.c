/* Impacts with friction, against closed forms and phases by hand. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "random.h"
#include "touch.h"

/* A ball with an oblique speed and no spin: the tangential impulse is the lesser of 2/7 m v and mu times the normal
 * one. */
KT_TEST(impact_with_friction_sticks_or_slips) {
    for (int i = 0; i < 2; i++) {
        const double e = 0.6, mu = i == 0 ? 0.5 : 0.1, v = 1.3, w = 2.0, m = 2.0, r = 0.1;
        const double normal = m * (1.0 + e) * w, tangent = fmin(mu * normal, 2.0 / 7.0 * m * v);
        const double after = v - tangent / m, spin = tangent * r / (0.4 * m * r * r);
        const double lost = 0.5 * m * (v * v + w * w * (1.0 - e * e) - after * after) - 0.2 * m * r * r * spin * spin;
        touch_scene s;
        touch_scene_ball(&s, mu, e);
        s.body[0].joint.velocity[0] = v;
        s.body[0].joint.velocity[2] = -w;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        const double *u = kt_simulation_velocities(simulation);
        kt_check_near("along", u[0], after, 1e-15);
        kt_check_near("up", u[2], e * w, 1e-15);
        kt_check_near("spin", u[4], spin, 1e-14);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, lost, 1e-14);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 1);
    }
}

/* A ball of radius r falls by h onto a plane. The normal is given with any length, and the plane by a marker of a body.
 * The first impact is at sqrt(2 h / g). */
KT_TEST(planes_are_where_their_markers_and_normals_have_them) {
    static const double lengths[] = {0.25, 1.0, 3.0};
    for (int i = 0; i < 3; i++)
        for (int at_marker = 0; at_marker < 2; at_marker++) {
            const double h = 0.2, top = at_marker ? 0.75 : 0.0;
            const kt_marker marker = {.name = "top", .at = kt_vec3_make(0.0, 0.0, 1.0)};
            touch_scene s;
            touch_scene_ball(&s, 0.0, 0.5);
            s.body[0].joint.position[2] = top + 0.1 + h;
            s.effect[0].axis = kt_vec3_make(0.0, 0.0, lengths[i]);
            s.body[1].name = "table";
            s.body[1].joint.at.z = -0.25;
            s.body[1].mass = 1.0;
            s.body[1].markers = &marker;
            s.body[1].marker_count = 1;
            s.description.body_count = 2;
            s.effect[0].between[1].body = at_marker ? "table" : NULL;
            s.effect[0].between[1].marker = at_marker ? "top" : NULL;
            kt_model *model = kt_scene_compile(&s.description);
            kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
            kt_error error = {0};
            kt_status status = KT_OK;
            while (status == KT_OK && kt_simulation_contacts(simulation).impacts == 0 &&
                   kt_simulation_time(simulation) < 1.0)
                status = kt_simulation_step(simulation, 1.0, &error);
            kt_need_fine("fall", status, &error);
            kt_check_near("time of the impact, s", kt_simulation_time(simulation), sqrt(2.0 * h / g), 1e-12);
        }
}

/* One phase at a contact in a plane, by hand. W = nn, nt, tt; u = n, t becomes u + W p, with p >= `least` along n. */
static void phase_by_hand(const double *W, double mu, double least, double *u, double *p) {
    for (int part = 0; part < 2; part++) { /* pressing, and then with the least impulse */
        const double n = part ? least : -(W[2] * u[0] - W[1] * u[1]) / (W[0] * W[2] - W[1] * W[1]);
        double q[2] = {n, -(u[1] + W[1] * n) / W[2]};
        if (fabs(q[1]) > mu * n) {
            const double slip = copysign(mu, q[1]);
            q[0] = part ? least : -u[0] / (W[0] + W[1] * slip);
            q[1] = slip * q[0];
        }
        const double after = u[0] + W[0] * q[0] + W[1] * q[1];
        if (part ? after < -1e-12 : q[0] < least)
            continue;
        u[0] = after;
        u[1] += W[1] * q[0] + W[2] * q[1];
        p[0] += q[0];
        p[1] += q[1];
        return;
    }
}

/* Two rods of 1 kg and 1 m hang on a pin, and the lower end strikes the floor. The source is Kane (1984), and Kane and
 * Levinson, Dynamics: Theory and Applications (1985). At one contact with friction, Newton's rule returns more than the
 * compression has taken, and the energy would grow. Poisson's does not. after: rates of both rods. */
static kt_contact_counts strike_floor(double mu, double e, bool poisson, const double *angle, const double *rate,
                                      double *after) {
    touch_scene s;
    kt_contact_counts counts = {.count = 0};
    touch_scene_make(&s, KT_JOINT_REVOLUTE);
    s.body[1].name = "upper";
    s.body[0].parent = "upper";
    s.body[1].joint.type = KT_JOINT_REVOLUTE;
    s.body[0].joint.at = kt_vec3_make(0.0, 0.0, -1.0);
    for (int i = 0; i < 2; i++) {
        s.body[i].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
        s.body[i].mass = 1.0;
        s.body[i].com = kt_vec3_make(0.0, 0.0, -0.5);
        s.body[i].inertia.xx = s.body[i].inertia.yy = s.body[i].inertia.zz = 1.0 / 12.0;
        s.body[i].joint.position[0] = angle[1 - i] - (i == 0 ? angle[0] : 0.0);
        s.body[i].joint.velocity[0] = rate[1 - i] - (i == 0 ? rate[0] : 0.0);
    }
    kt_effect *effect = touch_scene_add(&s, kt_vec3_make(0.0, 0.0, -1.0), 0.0, mu, e);
    effect->between[1].at = kt_vec3_make(0.0, 0.0, -cos(angle[0]) - cos(angle[1]));
    effect->poisson = poisson;
    s.description.body_count = 2;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
    const double *v = kt_simulation_velocities(simulation);
    after[0] = v[0]; /* the upper one is listed first, as is its joint */
    after[1] = v[0] + v[1];
    counts = kt_simulation_contacts(simulation);
    return counts;
}

/* Velocities of the end, and the rates that impulses p (normal, along) at it give the rods. */
static void end_velocity(const double *angle, const double *rate, double *u) {
    u[0] = sin(angle[0]) * rate[0] + sin(angle[1]) * rate[1];
    u[1] = -cos(angle[0]) * rate[0] - cos(angle[1]) * rate[1];
}

static void rates_of(const double *angle, const double *p, double *rate) {
    const double c = 0.5 * cos(angle[1] - angle[0]), det = 4.0 / 9.0 - c * c;
    const double f0 = sin(angle[0]) * p[0] - cos(angle[0]) * p[1], f1 = sin(angle[1]) * p[0] - cos(angle[1]) * p[1];
    rate[0] = (f0 / 3.0 - c * f1) / det;
    rate[1] = (4.0 / 3.0 * f1 - c * f0) / det;
}

static double rods_energy(const double *angle, const double *rate) {
    return 2.0 / 3.0 * rate[0] * rate[0] + rate[1] * rate[1] / 6.0 + 0.5 * cos(angle[1] - angle[0]) * rate[0] * rate[1];
}

KT_TEST(poissons_rule_does_not_let_the_energy_of_kanes_pendulum_grow) {
    const double angle[2] = {0.349, 0.524}, rate[2] = {-0.1, -0.2}, mus[3] = {0.1, 0.5, 5.0}, e = 0.7;
    uint64_t told = 0;
    for (int k = 0; k < 3; k++) {
        double unit[2][2], W[3], u[2], p[2] = {0.0, 0.0}, by[2], after[2], newton[2];
        for (int j = 0; j < 2; j++) { /* W by the rates that unit impulses give */
            rates_of(angle, (double[]){j == 0, j == 1}, by);
            end_velocity(angle, by, unit[j]);
        }
        W[0] = unit[0][0];
        W[1] = unit[0][1];
        W[2] = unit[1][1];
        end_velocity(angle, rate, u);
        phase_by_hand(W, mus[k], 0.0, u, p);
        phase_by_hand(W, mus[k], e * p[0], u, p);
        rates_of(angle, p, by);
        const kt_contact_counts poisson = strike_floor(mus[k], e, true, angle, rate, after);
        kt_check_equal_int("reduced", (long long)poisson.reduced, 0);
        kt_check_near("upper", after[0], rate[0] + by[0], 1e-14);
        kt_check_near("lower", after[1], rate[1] + by[1], 1e-14);
        const double before = rods_energy(angle, rate), lost = before - rods_energy(angle, after);
        kt_check_above("lost, J", lost, 1e-3);
        kt_check_near("told", poisson.dissipated, lost, 1e-15);
        told += strike_floor(mus[k], e, false, angle, rate, newton).reduced;
        kt_check_above("never grows", before - rods_energy(angle, newton), -1e-16);
    }
    kt_check_above("told of Newton's rule", (double)told, 0.5);
}

/* A spinning box strikes a driven plate with friction, by Newton's rule. A ball that rests on the plate is not struck,
 * and its rule has no influence. */
KT_TEST(ball_at_rest_on_a_drive_does_not_change_the_impact_of_a_box) {
    double v[2][6] = {{0.0}};
    for (int k = 0; k < 2; k++) {
        static const double up[] = {0.0, 0.3};
        touch_scene s;
        kt_loop drive = kt_loop_default();
        touch_scene_box(&s, 3, 0.3, 0.0);
        s.body[0].joint.position[2] = 0.11;
        s.body[0].joint.velocity[0] = 1.0;
        s.body[0].joint.velocity[5] = -3.0;
        s.body[1].name = "plate";
        s.body[1].mass = 1.0;
        s.body[1].joint.type = s.body[2].joint.type = KT_JOINT_PRISMATIC;
        s.body[2].name = "ball";
        s.body[2].parent = "plate";
        s.body[2].mass = 1.0;
        s.description.body_count = 3;
        for (int i = 0; i < 3; i++) {
            s.effect[i].between[1].body = "plate";
            s.effect[i].restitution = 0.2;
        }
        s.effect[3].name = "rest";
        s.effect[3].type = KT_EFFECT_JOINT_LIMIT;
        s.effect[3].joint = "ball";
        s.effect[3].lower = 0.0;
        s.effect[3].restitution = 0.0;
        s.effect[3].poisson = k == 1;
        s.description.effect_count = 4;
        drive.name = "drive";
        drive.type = KT_LOOP_MOTION;
        drive.joint = "plate";
        drive.function = kt_function_polynomial(up, 2);
        s.description.loops = &drive;
        s.description.loop_count = 1;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        kt_test_advance(simulation, 0.04);
        memcpy(v[k], kt_simulation_velocities(simulation), sizeof v[k]);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 3);
    }
    for (int i = 0; i < 6; i++)
        kt_check_near("velocity", v[1][i], v[0][i], 1e-13);
    kt_check_above("spin that friction takes, rad/s", 3.0 + v[0][5], 0.1);
}

/* Runs a ball of radius 0.1 `size` that begins a part of its radius deep in the floor. */
static kt_status status_at_depth(double size, double part) {
    kt_error error;
    touch_scene s;
    touch_scene_ball(&s, 0.5, 0.0);
    s.effect[0].radius *= size;
    s.body[0].joint.position[2] *= size * (1.0 - part);
    s.body[0].inertia.xx *= size * size;
    s.body[0].inertia.yy *= size * size;
    s.body[0].inertia.zz *= size * size;
    s.description.gravity.z *= size;
    return kt_simulation_advance(touch_start(kt_scene_compile(&s.description), "rk4", 1e-3), 1e-3, &error);
}

/* Twins in units of length: a depth is small or large beside the mechanism, not beside 1 m. */
KT_TEST(depth_at_the_start_is_relative_to_the_mechanism) {
    for (int k = -10; k <= 10; k += 10) {
        kt_check_equal_int("rounding", status_at_depth(ldexp(1.0, k), 1e-9), KT_OK);
        kt_check_equal_int("deep", status_at_depth(ldexp(1.0, k), 1e-3), KT_ERROR_CONSTRAINT);
    }
}

/* Housner (1963): a block of half-diagonal R at the angle alpha rocks from one corner to the other. If friction holds,
 * the block keeps 1 - 3/2 sin^2(alpha) of its rate. It keeps its energy between impacts. */
KT_TEST(rocking_block_loses_what_housner_says) {
    const double b = 0.1, h = 0.4, m = 2.0, R = hypot(b, h), alpha = atan2(b, h), tilt = 0.5 * alpha;
    const double keep = 1.0 - 1.5 * sin(alpha) * sin(alpha);
    touch_scene s;
    touch_scene_make(&s, KT_JOINT_PLANAR);
    s.body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0); /* z, x, angle */
    s.body[0].inertia.yy = m / 3.0 * R * R;
    s.body[0].inertia.xx = s.body[0].inertia.zz = m;
    (void)touch_scene_add(&s, kt_vec3_make(b, 0.0, -h), 0.0, 1.0, 0.0);
    (void)touch_scene_add(&s, kt_vec3_make(-b, 0.0, -h), 0.0, 1.0, 0.0);
    /* On the corner at +b, turned by `tilt` about y. */
    s.body[0].joint.position[0] = b * sin(tilt) + h * cos(tilt);
    s.body[0].joint.position[1] = b - b * cos(tilt) + h * sin(tilt);
    s.body[0].joint.position[2] = tilt;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(model, "dop853", 0.0);
    kt_error error = {0};
    double energy = m * g * (R * cos(alpha - tilt) - h), worst = 0.0;
    kt_status status = KT_OK;
    for (uint64_t n = 1; status == KT_OK && n <= 5; n++) {
        while (status == KT_OK && kt_simulation_contacts(simulation).impacts < n &&
               kt_simulation_time(simulation) < 20.0)
            status = kt_simulation_step(simulation, 20.0, &error);
        const double rate = kt_simulation_velocities(simulation)[2];
        energy *= keep * keep;
        worst = fmax(worst, fabs(0.5 * (4.0 / 3.0 * m * R * R) * rate * rate / energy - 1.0));
    }
    kt_need_fine("rocks", status, &error);
    kt_check_below("energy behind five impacts, relative", worst, 1e-9);
    kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 5);
    kt_check_equal_int("slips", (long long)kt_simulation_contacts(simulation).slips, 0);
}

/* Two balls of equal mass fly past each other, nearest at `time`, with centres that are `miss` apart there. Returns the
 * difference of their relative velocity behind the impact from the closed form: its part along the line of centres is
 * reversed. */
static double error_of_collision(kt_random *random, int *impacts) {
    const double R = kt_random_uniform(random, 0.01, 0.1), r = kt_random_uniform(random, 0.01, 0.1);
    const double speed = kt_random_uniform(random, 1.0, 12.0), time = kt_random_uniform(random, 0.25, 0.9);
    const double miss = kt_random_uniform(random, 0.0, 0.98) * (R + r), depth = sqrt((R + r) * (R + r) - miss * miss);
    double d[3], e[3], n[3], worst = 0.0;
    kt_random_direction(random, 3, d);
    kt_random_direction(random, 3, e);
    const double along = d[0] * e[0] + d[1] * e[1] + d[2] * e[2], across = sqrt(1.0 - along * along);
    touch_scene s;
    touch_scene_make(&s, KT_JOINT_FREE);
    s.body[1] = s.body[0];
    s.body[1].name = "other";
    s.description.body_count = 2;
    s.description.effect_count = 1;
    s.effect[0].name = "meet";
    s.effect[0].type = KT_EFFECT_CONTACT;
    s.effect[0].between[0].body = "body";
    s.effect[0].between[1].body = "other";
    s.effect[0].radius = R;
    s.effect[0].radius2 = r;
    s.effect[0].restitution = 1.0;
    for (int i = 0; i < 3; i++) {
        const double side = miss * (e[i] - along * d[i]) / across, drift = kt_random_normal(random);
        n[i] = (side - depth * d[i]) / (R + r);
        s.body[0].joint.position[i] = side - time * speed * d[i];
        s.body[0].joint.velocity[i] = speed * d[i] + drift;
        s.body[1].joint.velocity[i] = drift;
    }
    for (int k = 0; k < 2; k++)
        s.body[k].inertia.xx = s.body[k].inertia.yy = s.body[k].inertia.zz = 0.01;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = kt_scene_start_within(model, "dop853", 0.0, 1e-9, 0);
    kt_error error = {0};
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_time(simulation) < 1.5 * time)
        status = kt_simulation_step(simulation, 1.5 * time, &error);
    kt_need_fine("flies", status, &error);
    const double *v = kt_simulation_velocities(simulation), closing = -speed * depth / (R + r);
    for (int i = 0; i < 3; i++)
        worst = fmax(worst, fabs(v[i] - v[6 + i] - (speed * d[i] - 2.0 * closing * n[i])) / speed);
    *impacts += (int)kt_simulation_contacts(simulation).impacts;
    return worst;
}

/* A step of free flight is long. Where balls pass each other, their distance has a kink, which five values miss. */
KT_TEST(balls_that_pass_each_other_within_a_step_collide) {
    enum { COLLISIONS = 200 };
    kt_random random = kt_random_of_test();
    double worst = 0.0;
    int impacts = 0;
    for (int i = 0; i < COLLISIONS; i++)
        worst = fmax(worst, error_of_collision(&random, &impacts));
    kt_check_equal_int("impacts", impacts, COLLISIONS);
    kt_check_below("relative velocity behind the impact, relative", worst, 1e-11);
}

/* A tilted box spins on a corner, which leaves the floor at 20 um/s. The first steps are so short that the corner stays
 * within the rounding of its gap. The time advances in all of them: unless such a corner still touches, rounding closes
 * it at an instant that no step leaves. */
KT_TEST(rounding_of_a_gap_does_not_close_a_corner_that_parts) {
    enum { BOXES = 40, STEPS = 50 };
    static const double shortest = 16.0 * DBL_EPSILON;
    kt_random random = kt_random_of_test();
    int stays = 0;
    for (int i = 0; i < BOXES; i++) {
        touch_scene s;
        touch_scene_box(&s, 3, 0.0, 0.0);
        double *q = s.body[0].joint.position, *v = s.body[0].joint.velocity, least = HUGE_VAL;
        const double a = kt_random_uniform(&random, 0.1, 0.6), b = kt_random_uniform(&random, 0.1, 0.6);
        q[3] = sqrt(1.0 - a * a - b * b), q[4] = a, q[5] = b;
        const double up[3] = {-2.0 * q[3] * b, 2.0 * q[3] * a, 1.0 - 2.0 * (a * a + b * b)};
        for (int k = 0; k < 3; k++)
            least = fmin(least, up[0] * s.marker[k].at.x + up[1] * s.marker[k].at.y + up[2] * s.marker[k].at.z);
        q[2] = -least;
        v[2] = 2e-5;
        for (int k = 0; k < 3; k++)
            v[3 + k] = 20.0 * up[k];
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        kt_error error = {0};
        kt_status status = kt_simulation_set_state(simulation, 1.0, q, v, &error);
        for (int k = 0; status == KT_OK && k < STEPS; k++) {
            const double t = kt_simulation_time(simulation);
            status = kt_simulation_step(simulation, t + shortest * t, &error);
            stays += !(kt_simulation_time(simulation) > t);
        }
        kt_need_fine("spins", status, &error);
    }
    kt_check_equal_int("steps that do not advance", stays, 0);
}
