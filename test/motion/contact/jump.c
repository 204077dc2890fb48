/* Forces that jump while contacts are closed, sticking friction and slack ropes among them: drives whose accelerations
 * jump, and joint forces that a program sets. The oracles are closed forms. Between two jumps every drive is a cubic of
 * time, and so is the distance of a falling body. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

#include "check.h"
#include "motion/simulation/parsed.h"

static const double g = 9.81, end = 2.0, tick = 0.05;
enum { RAMPS = 3, RUNS = 300, RECORDS = 80 };

/* ---- a drive ----------------------------------------------------------------------------------------------------- */

/* x(t) = sum of ramps; for a rope its negative is the length. */
typedef struct drive {
    int count;
    double to[RAMPS], start[RAMPS], stop[RAMPS];
    double base, sign;
    kt_function part[RAMPS + 1];
} drive;

/* Ramps begin and end at multiples of `tick`, so that all jumps are there. */
static void draw_drive(kt_random *random, double base, double sign, double lowest, double highest, drive *d) {
    *d = (drive){.count = kt_random_int(random, 1, RAMPS), .base = base, .sign = sign};
    for (int i = 0; i < d->count; i++) {
        const int start = kt_random_int(random, 0, 30), length = kt_random_int(random, 2, 20);
        d->start[i] = tick * start;
        d->stop[i] = tick * (start + length);
        const double span = d->stop[i] - d->start[i]; /* an acceleration of 6 to / span^2 at most */
        d->to[i] = kt_random_uniform(random, lowest, highest) * span * span / 6.0;
        d->part[i] = kt_function_ramp(0.0, sign * d->to[i], d->start[i], d->stop[i]);
    }
    d->part[d->count] = kt_function_ramp(sign * base, sign * base, 0.0, 1.0);
}

/* x, x', x'', x''' at t, of the piece whose middle is `middle`. */
static void at(const drive *d, double t, double middle, double x[4]) {
    x[0] = d->base;
    x[1] = x[2] = x[3] = 0.0;
    for (int i = 0; i < d->count; i++) {
        const double T = d->stop[i] - d->start[i], s = (t - d->start[i]) / T, a = d->to[i];
        if (middle > d->stop[i])
            x[0] += a;
        if (middle < d->start[i] || middle > d->stop[i])
            continue;
        x[0] += a * s * s * (3.0 - 2.0 * s);
        x[1] += a * 6.0 * s * (1.0 - s) / T;
        x[2] += a * (6.0 - 12.0 * s) / (T * T);
        x[3] -= a * 12.0 / (T * T * T);
    }
}

/* ---- what stands on it, hangs on it ------------------------------------------------------------------------------ */

/* z >= x, and the free body has the acceleration -fall(t). It lands without a bounce. */
typedef struct faller {
    double t, z, v, since; /* when it landed: leaving at once is no rest */
    bool closed;
    int openings;
} faller;

static double cubic(const double c[4], double s) { return ((c[3] * s + c[2]) * s + c[1]) * s + c[0]; }

/* The first s in (0, most] at which the cubic passes from above zero to below; `most` if there is none. */
static double first_below(const double c[4], double most) {
    double knot[4] = {0.0, most, most, most};
    const double a = 3.0 * c[3], b = c[2], root = b * b - a * c[1];
    int n = 1;
    if (root > 0.0) {
        const double q = -(b + copysign(sqrt(root), b));
        const double s1 = a != 0.0 ? q / a : most, s2 = q != 0.0 ? c[1] / q : most;
        for (int i = 0; i < 2; i++) {
            const double s = i == 0 ? fmin(s1, s2) : fmax(s1, s2);
            if (s > 0.0 && s < most)
                knot[n++] = s;
        }
    }
    for (int i = 1; i <= n; i++) {
        double low = knot[i - 1], high = i < n ? knot[i] : most;
        if (!(cubic(c, high) < 0.0))
            continue;
        for (int k = 0; k < 200; k++) {
            const double m = 0.5 * (low + high);
            *(cubic(c, m) < 0.0 ? &high : &low) = m;
        }
        return high;
    }
    return most;
}

/* Up to `to`, within one piece. */
static void fall(const drive *d, double acceleration, faller *f, double to) {
    const double middle = 0.5 * (f->t + to);
    while (f->t < to) {
        double x[4];
        at(d, f->t, middle, x);
        const double press = x[2] + acceleration, left = to - f->t;
        if (f->closed && (press < -1e-12 || (press <= 1e-12 && x[3] < 0.0))) {
            f->closed = false;
            f->openings += f->t > f->since;
            f->z = x[0];
            f->v = x[1];
        } else if (f->closed) {
            const double s = x[3] < 0.0 ? fmin(left, -press / x[3]) : left;
            at(d, s < left ? f->t + s : to, middle, x);
            f->t = s < left ? f->t + s : to;
            f->z = x[0];
            f->v = x[1];
            continue;
        }
        double c[4] = {f->z - x[0], f->v - x[1], -0.5 * press, -x[3] / 6.0};
        const bool touches = c[0] == 0.0 && c[1] == 0.0;
        const double reduced[4] = {c[2], c[3], 0.0, 0.0};
        const double s = touches ? (c[2] > 0.0 ? first_below(reduced, left) : left) : first_below(c, left);
        f->closed = s < left;
        f->z += f->v * s - 0.5 * acceleration * s * s;
        f->v -= acceleration * s;
        f->t = s < left ? f->t + s : to;
        if (f->closed) {
            at(d, f->t, middle, x);
            f->z = x[0];
            f->v = x[1];
            f->since = f->t;
        }
    }
}

/* The multiplier of the last loop, which is closed if there are so many equations; `sign` where it presses. */
typedef struct pulls {
    int equations;
    double sign, worst, most;
} pulls;

static int watch_sign(const kt_record *record, void *user) {
    pulls *p = user;
    if (kt_model_mobility(record->model).equations < p->equations)
        return 0;
    const double force = p->sign * record->multipliers[p->equations - 1];
    p->worst = fmin(p->worst, force);
    p->most = fmax(p->most, force);
    return 0;
}

static kt_simulation *start(const kt_model *model, double duration) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.duration = duration;
    run.interval = duration / RECORDS;
    run.relative = run.absolute = 1e-11;
    options.record = KT_RECORD_MULTIPLIER;
    return kt_test_simulation(model, &run, &options);
}

/* A ball of 1 kg above a plate that is driven, or a load on a rope whose length is. */
static kt_model *compile_faller(const drive *d, bool hangs) {
    const kt_term terms[2] = {{.joint = "ball", .coefficient = 1.0}, {.joint = "plate", .coefficient = -1.0}};
    kt_body body[2];
    kt_loop loop[2] = {kt_loop_default(), kt_loop_default()};
    kt_description description = kt_description_default();
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_of(i == 0 ? "ball" : "plate", NULL, KT_JOINT_PRISMATIC, 1.0);
        body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        body[i].joint.position[0] = d->base;
    }
    kt_loop *touch = &loop[hangs ? 0 : 1];
    touch->name = "touch";
    touch->type = hangs ? KT_LOOP_DISTANCE : KT_LOOP_COUPLING;
    touch->side = hangs ? KT_SIDE_NONE : KT_SIDE_ABOVE;
    touch->slack = hangs;
    if (hangs) {
        touch->between[1].body = "ball";
        touch->function = kt_function_sum(d->part, d->count + 1);
    } else {
        touch->terms = terms;
        touch->term_count = 2;
        loop[0].name = "drive";
        loop[0].type = KT_LOOP_MOTION;
        loop[0].joint = "plate";
        loop[0].function = kt_function_sum(d->part, d->count);
    }
    description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_describe(&description, body, hangs ? 1 : 2, loop, hangs ? 1 : 2, NULL, 0);
    return kt_scene_compile(&description);
}

static void check_fallers(const char *name, bool hangs) {
    kt_random random = kt_random_named(name);
    kt_worst place = kt_worst_make("height, m"), sign = kt_worst_make("the largest pull, N");
    double most = 0.0;
    int openings = 0, others = 0;
    for (int run = 0; run < RUNS; run++) {
        drive d;
        faller f = {.since = -1.0, .closed = true};
        draw_drive(&random, hangs ? -5.0 : 0.0, hangs ? -1.0 : 1.0, -2.5 * g, 1.5 * g, &d);
        kt_model *model = compile_faller(&d, hangs);
        kt_simulation *simulation = start(model, end);
        kt_error error = {0};
        pulls p = {.equations = hangs ? 1 : 2, .sign = hangs ? -1.0 : 1.0};
        f.z = d.base;
        kt_need_fine(name, kt_simulation_run(simulation, watch_sign, &p, &error), &error);
        for (int i = 0; i < (int)lround(end / tick); i++)
            fall(&d, g, &f, tick * (i + 1));
        kt_worst_near(&place, kt_simulation_positions(simulation)[0], f.z, 1e-12, "run %d", run);
        kt_worst_below(&sign, -p.worst, 1e-5, "run %d", run);
        most = fmax(most, p.most);
        openings += f.openings;
        others += f.openings != (int)kt_simulation_contacts(simulation).openings;
    }
    kt_check_worst(&place);
    kt_check_worst(&sign);
    kt_check_above("the largest push, N", most, g);
    kt_check_above("openings in all", openings, RUNS / 2.0);
    kt_check_below("runs with another number of openings", others, RUNS / 100.0); /* it may land where a ramp ends */
}

KT_TEST(ball_leaves_a_plate_whose_acceleration_jumps) { check_fallers("plate", false); }
KT_TEST(rope_goes_slack_where_its_length_is_paid_out) { check_fallers("rope", true); }

/* ---- joint forces ------------------------------------------------------------------------------------------------ */

/* A ball on a stop at zero, under a force that a program sets at each tick. */
KT_TEST(ball_leaves_its_stop_where_a_force_is_set) {
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("height, m");
    int openings = 0, others = 0;
    for (int run = 0; run < RUNS; run++) {
        const drive still = {.count = 0};
        kt_lone lone;
        faller f = {.closed = true}; /* without a force at first, it is open where it touches */
        kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
        kt_effect stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, lone.body.name);
        stop.lower = 0.0;
        stop.restitution = 0.0;
        lone.description.effects = &stop;
        lone.description.effect_count = 1;
        kt_model *model = kt_scene_compile(&lone.description);
        kt_simulation *simulation = start(model, end);
        kt_error error = {0};
        kt_status status = KT_OK;
        for (int i = 0; status == KT_OK && i < (int)lround(end / tick); i++) {
            const double force = kt_random_uniform(&random, -2.0 * g, 1.0 * g);
            status = kt_simulation_set_torque(simulation, &force, &error);
            if (status == KT_OK)
                status = kt_simulation_advance(simulation, tick * (i + 1), &error);
            fall(&still, -force, &f, tick * (i + 1));
        }
        kt_need_fine("run", status, &error);
        kt_worst_near(&place, kt_simulation_positions(simulation)[0], f.z, 1e-12, "run %d", run);
        openings += f.openings;
        others += f.openings != (int)kt_simulation_contacts(simulation).openings;
    }
    kt_check_above("openings in all", openings, RUNS);
    kt_check_below("runs with another number of openings", others, RUNS / 100.0); /* it may land where a ramp ends */
}

/* ---- sticking friction ------------------------------------------------------------------------------------------- */

/* A crate on a truck: x its place there. It sticks up to an acceleration mu, and slips at -x'' - mu sgn x'. */
typedef struct crate {
    double t, x, v;
    int slips;
} crate;

static void slip(const drive *d, double mu, crate *c, double to) {
    const double middle = 0.5 * (c->t + to);
    while (c->t < to) {
        double x[4];
        at(d, c->t, middle, x);
        const double left = to - c->t;
        if (c->v == 0.0 && fabs(x[2]) <= mu * (1.0 + 1e-12) &&
            !(fabs(x[2]) >= mu * (1.0 - 1e-12) && x[2] * x[3] > 0.0)) {
            const double limit = x[3] > 0.0 ? mu : -mu, s = x[3] != 0.0 ? (limit - x[2]) / x[3] : left;
            c->t = s < left ? c->t + s : to;
            continue;
        }
        const double side = c->v != 0.0 ? copysign(1.0, c->v) : -copysign(1.0, x[2]);
        const double a = -x[2] - mu * side, jerk = -x[3];
        const double v[4] = {side * c->v, side * a, 0.5 * side * jerk, 0.0},
                     rest[4] = {side * a, 0.5 * side * jerk, 0.0, 0.0};
        const double s = c->v != 0.0 ? first_below(v, left) : first_below(rest, left);
        c->slips += c->v == 0.0;
        c->x += ((jerk * s / 6.0 + 0.5 * a) * s + c->v) * s;
        c->v = s < left ? 0.0 : c->v + (0.5 * jerk * s + a) * s;
        c->t = s < left ? c->t + s : to;
    }
}

KT_TEST(crate_slips_on_a_truck_whose_acceleration_jumps) {
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("place, m");
    int slips = 0;
    for (int run = 0; run < RUNS; run++) {
        const double mu = kt_random_uniform(&random, 1.0, 4.0);
        drive d;
        crate c = {.t = 0.0};
        draw_drive(&random, 0.0, 1.0, -9.0, 9.0, &d);
        kt_body body[2];
        for (int i = 0; i < 2; i++) {
            body[i] = kt_body_of(i == 0 ? "truck" : "crate", i == 0 ? NULL : "truck", KT_JOINT_PRISMATIC, 1.0);
            body[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        }
        kt_loop loop = kt_loop_of("drive", KT_LOOP_MOTION);
        loop.joint = "truck";
        loop.function = kt_function_sum(d.part, d.count);
        kt_effect rub = kt_effect_of(KT_EFFECT_JOINT_FRICTION, "crate");
        rub.name = "rub";
        rub.coulomb = mu;
        rub.stick = true;
        kt_description description = kt_description_of(body, 2, &loop, 1, &rub, 1);
        kt_model *model = kt_scene_compile(&description);
        kt_simulation *simulation = start(model, end);
        kt_test_advance(simulation, end);
        for (int i = 0; i < (int)lround(end / tick); i++)
            slip(&d, mu, &c, tick * (i + 1));
        kt_worst_near(&place, kt_simulation_positions(simulation)[1], c.x, 1e-12, "run %d", run);
        slips += c.slips;
    }
    kt_check_above("slips in all", slips, RUNS / 2.0);
}

/* The largest friction that sticks in records, N, and the largest imbalance of mass * a = push + friction, N. A push
 * that jumps in time has two values at its jump, so that its imbalance is left out. */
typedef struct balance {
    double friction, left;
    bool of_state;
} balance;

/* Takes a record of the joint 0 of 1 kg, with friction (effect 0) and a push (effect 1). */
static int take_balance(const kt_record *record, void *user) {
    balance *of = user;
    double force[2] = {0.0, 0.0};
    for (int i = 0; i < 2; i++) {
        kt_effect_load load;
        const bool sticks = i == 0 && kt_loop_rows_of(record->model, 0).count > 0;
        if (!sticks &&
            kt_effect_evaluate(record->model, record->data, record->t, record->q, record->v, i, &load, NULL) != KT_OK)
            return 1;
        force[i] = sticks ? record->multipliers[0] : load.joint_force;
        of->friction = fmax(of->friction, sticks ? fabs(force[i]) : 0.0);
    }
    of->left = fmax(of->left, of->of_state ? fabs(record->a[0] - force[0] - force[1]) : 0.0);
    return 0;
}

/* Runs a push that grows from 0.5 N to 2 N where x (the time, or the position of a slide of 1 m/s) passes `at`. Returns
 * the velocity at the end. step: 0: steps are adaptive. */
static double run_push(const char *method, double step, const char *x, double at, double interval, balance *of) {
    char text[1024];
    kt_parsed p;
    kt_error error = {0};
    of->of_state = x[0] != 't';
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\nbodies:\n  - {name: b, joint: {type: prismatic, axis: x}, mass: 1}\n"
                   "  - {name: d, joint: {type: prismatic, axis: y, velocity: 1}, mass: 1}\neffects:\n"
                   "  - {type: joint_friction, joint: b, coulomb: 1, static: 1.2, stribeck: 0, stick: true}\n"
                   "  - {type: %s, joint: b, force: \"0.5 + 1.5*(%s >= %.17g)\"}\n",
                   of->of_state ? "expression" : "motor", x, at);
    kt_parsed_make(&p, text);
    kt_run run = step > 0.0 ? kt_run_fixed(method, step, 0.2) : kt_run_within(method, 1e-9, 0.2);
    run.interval = interval;
    run.record = KT_RECORD_REACTION | KT_RECORD_ACCELERATION;
    kt_simulation *simulation = kt_test_simulation(p.model, &run, NULL);
    kt_need_fine(method, kt_simulation_run(simulation, take_balance, of, &error), &error);
    return kt_simulation_velocities(simulation)[0];
}

/* Friction of 1 N holds the smaller push. The push grows some roundings of the time before or behind the end of a fixed
 * step, where a record is made. There the push may act already, or not yet. */
KT_TEST(friction_slips_if_a_force_jumps_next_to_the_end_of_a_fixed_step) {
    static const double step = 1e-3, at = 0.1, roundings[] = {-200, -60, -1, 0, 1, 2, 30, 60, 100, 130, 200};
    static const char *const methods[] = {"heun", "rk4", "dopri5"}, *const jumps[] = {"t", "position.d"};
    KT_WORST speed = kt_worst_make("speed, m/s");
    balance of = {0.0, 0.0, false};
    for (size_t i = 0; i < sizeof roundings / sizeof *roundings; i++)
        for (size_t m = 0; m < 6; m++) {
            const double observed = run_push(methods[m % 3], step, jumps[m / 3], at + roundings[i] * DBL_EPSILON * at,
                                             i % 2 == 0 ? at : 10.0 * step, &of);
            kt_worst_near(&speed, observed, 0.1, 1e-13, "%s, %g roundings, %s", methods[m % 3], roundings[i],
                          jumps[m / 3]);
        }
    kt_check_near("friction of a record, N", of.friction, 0.5, 1e-12);
    kt_check_near("imbalance of a record, N", of.left, 0.0, 1e-12);
}

/* With adaptive steps, records may lie at the jump, too: times are breakpoints, and an even motion is exact. */
KT_TEST(records_at_a_jump_have_the_forces_before_it) {
    static const char *const methods[] = {"dopri5", "radau5"}, *const jumps[] = {"t", "position.d"};
    balance of = {0.0, 0.0, false};
    for (int i = 0; i < 4; i++)
        kt_check_near("speed, m/s", run_push(methods[i % 2], 0.0, jumps[i / 2], 0.1, 0.1, &of), 0.1, 1e-8);
    kt_check_near("friction of a record, N", of.friction, 0.5, 1e-12);
    kt_check_near("imbalance of a record, N", of.left, 0.0, 1e-12);
}
