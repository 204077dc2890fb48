/* Drives whose speeds jump while hard contacts are closed, sticking friction and slack ropes among them. A drive pushes
 * what rests on it, and cannot pull it. Forces far beyond friction, too. The oracles are closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "touch.h"

enum { ROWS = 6, RUNS = 200 };

/* A table that is driven along an axis, and a block of 2 kg on it, which slides on massless guides along x and z. */
typedef struct struck_scene {
    touch_scene s;
    kt_loop drive;
} struck_scene;

static void set_drive(struck_scene *b, kt_loop_type type) {
    b->drive = kt_loop_of("drive", type);
    b->drive.joint = type == KT_LOOP_MOTION ? "table" : NULL;
    b->s.description.loops = &b->drive;
    b->s.description.loop_count = 1;
}

static void make_struck(struck_scene *b, kt_vec3 axis, double friction, double restitution) {
    static const char *const names[] = {"body", "table", "guide"};
    touch_scene_make(&b->s, KT_JOINT_PRISMATIC);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &b->s.body[i];
        body->name = names[i];
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = i == 1 ? axis : kt_vec3_make(i == 2, 0.0, i == 0);
    }
    b->s.body[0].parent = "guide";
    b->s.body[1].mass = 1.0;
    b->s.description.body_count = 3;
    touch_scene_add(&b->s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, friction, restitution)->between[1].body = "table";
    set_drive(b, KT_LOOP_MOTION);
}

/* The coordinate of a body. */
static size_t place_of(const kt_model *model, const char *body) {
    return (size_t)kt_body_coordinates(model, kt_body_find(model, body)).v;
}

/* ---- along gravity ----------------------------------------------------------------------------------------------- */

/* A ball on a plate whose speed jumps at each row. It lands without a bounce. */
typedef struct thrown {
    double z, v;
    bool closed;
    int throws;
} thrown;

static void throw_on(thrown *b, double plate, double speed, double time) {
    b->throws += b->closed && speed < b->v;
    b->closed = b->closed && speed >= b->v;
    while (!b->closed && time > 0.0) { /* the gap is c + b s - g s^2 / 2 */
        const double c = b->z - plate, rate = b->v - speed;
        const double s = fmin((rate + sqrt(rate * rate + 2.0 * g * fmax(c, 0.0))) / g, time);
        b->closed = s < time;
        b->z += b->v * s - 0.5 * g * s * s;
        b->v -= g * s;
        plate += speed * s;
        time -= s;
    }
    if (b->closed)
        *b = (thrown){plate + speed * time, speed, true, b->throws};
}

KT_TEST(ball_leaves_a_plate_that_slows_down_at_once) {
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("height, m");
    int throws = 0, others = 0;
    for (int run = 0; run < RUNS; run++) {
        struck_scene b;
        double rows[2 * ROWS] = {0.0};
        thrown ball = {.closed = true};
        make_struck(&b, kt_vec3_make(0.0, 0.0, 1.0), 0.0, 0.0);
        for (int i = 1; i < ROWS; i++) {
            const double time = i == 1 ? 0.5 : kt_random_uniform(&random, 0.1, 0.5);
            const double speed = i == 1 ? 0.0 : kt_random_uniform(&random, -3.0, 3.0);
            throw_on(&ball, rows[2 * i - 1], speed, time);
            rows[2 * i] = rows[2 * i - 2] + time;
            rows[2 * i + 1] = rows[2 * i - 1] + speed * time;
        }
        b.drive.function = kt_function_table(rows, 2 * ROWS, KT_INTERPOLATION_LINEAR);
        kt_model *model = kt_scene_compile(&b.s.description);
        kt_simulation *simulation = touch_start(model, run % 2 ? "dopri5" : "radau5", 0.0);
        kt_test_advance(simulation, rows[2 * ROWS - 2]);
        const size_t z = place_of(model, "body");
        kt_worst_near(&place, kt_simulation_positions(simulation)[z], ball.z, 1e-10, "run %d", run);
        throws += ball.throws;
        others += ball.throws != (int)kt_simulation_contacts(simulation).openings;
    }
    kt_check_above("throws in all", throws, RUNS / 2.0);
    kt_check_equal_int("runs with another number of openings", others, 0);
}

/* A hoist lifts a load of 1 kg at 1 m/s and halts. The rope is slack for 2 (1 m/s) / g. */
KT_TEST(rope_of_a_hoist_that_halts_goes_slack) {
    static const double rows[] = {0.0, 5.0, 1.0, 4.0, 9.0, 4.0};
    kt_lone lone;
    kt_loop rope = kt_loop_default();
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    lone.body.joint.axis = kt_vec3_make(0.0, 0.0, -1.0);
    lone.body.joint.position[0] = 5.0;
    lone.body.joint.velocity[0] = -1.0;
    rope.name = "rope";
    rope.type = KT_LOOP_DISTANCE;
    rope.slack = true;
    rope.between[1].body = lone.body.name;
    rope.function = kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR);
    lone.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    lone.description.loops = &rope;
    lone.description.loop_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
    const double s = 0.15;
    kt_test_advance(simulation, 1.0 + s);
    kt_check_near("height, m", -kt_simulation_positions(simulation)[0], -4.0 + s - 0.5 * g * s * s, 1e-11);
    kt_test_advance(simulation, 1.0 + 2.0 / g + 0.01);
    kt_check_near("height, m", -kt_simulation_positions(simulation)[0], -4.0, 1e-11);
}

/* ---- across gravity ---------------------------------------------------------------------------------------------- */

/* The table moves along x at 1 m/s and halts at 1 s, the end of 1000 fixed steps. Friction brakes the block with mu g,
 * since no impulse presses it. A call may end there, or a rounding before, and a jump of nothing may follow. */
KT_TEST(block_slides_on_over_a_table_that_halts) {
    static const double rows[] = {0.0, 0.0, 1.0, 1.0, 9.0, 1.0}, mu = 0.3;
    enum { WHOLE, AT, BEFORE, JUMP, WAYS };
    const double stop = 1.0 / (mu * g);
    for (int k = 0; k < 2 * WAYS; k++) {
        const bool fixed = k % 2;
        const int way = k / 2;
        struck_scene b;
        kt_error error = {0};
        make_struck(&b, kt_vec3_make(1.0, 0.0, 0.0), mu, 0.5);
        b.s.body[2].joint.velocity[0] = 1.0;
        b.drive.function = kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR);
        kt_model *model = kt_scene_compile(&b.s.description);
        kt_simulation *simulation = touch_start(model, fixed ? "rk4" : "dopri5", fixed ? 1e-3 : 0.0);
        const size_t x = place_of(model, "guide");
        kt_note("%s, way %d", fixed ? "fixed steps" : "adaptive steps", way);
        if (way != WHOLE)
            kt_test_advance(simulation, way == BEFORE ? nextafter(1.0, 0.0) : 1.0);
        if (way == JUMP)
            (void)kt_fine("jumps", kt_simulation_jump(simulation, NULL, NULL, &error), &error);
        kt_test_advance(simulation, 1.0 + 0.5 * stop);
        kt_check_near("speed, m/s", kt_simulation_velocities(simulation)[x], 0.5, 1e-10);
        kt_test_advance(simulation, 1.0 + 2.0 * stop);
        kt_check_near("place, m", kt_simulation_positions(simulation)[x], 1.0 + 0.5 * stop, 1e-10);
        kt_check_near("dissipated by friction, J", kt_simulation_work(simulation).dissipated, 1.0, 1e-9);
        kt_check_near("supplied, J", kt_simulation_work(simulation).supplied, -0.5, 1e-9);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 0);
    }
}

/* The table starts at 1 m/s, at an angle to its normal. The contact has the impulse p = m cos(angle) along its normal,
 * and friction has at most mu p. So the block sticks, or slips behind at mu cos(angle). It does not bounce at any
 * restitution. Friction dissipates the mean of its slip before and behind the jump, times its impulse. */
KT_TEST(block_is_pushed_within_the_cone_of_friction) {
    static const double rows[] = {0.0, 0.0, 1.0, 0.0, 9.0, 8.0}, mu = 0.5, mass = 2.0;
    static const double angles[] = {0.0, 0.2, 0.46, 0.47, 1.0, 1.5}, restitutions[] = {0.0, 0.7};
    for (int k = 0; k < 12; k++) {
        const double angle = angles[k / 2], c = cos(angle), s = sin(angle), slides = fmin(s, mu * c);
        struck_scene b;
        kt_error error = {0};
        make_struck(&b, kt_vec3_make(s, 0.0, c), mu, restitutions[k % 2]);
        b.s.effect[0].poisson = k / 2 == 1;
        b.drive.function = kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR);
        kt_model *model = kt_scene_compile(&b.s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        const double start = kt_scene_balance(simulation), behind = 1e-9;
        kt_note("%g rad, restitution %g", angle, restitutions[k % 2]);
        if (k > 5) { /* it does not take the place of the drive's jump */
            kt_test_advance(simulation, 1.0);
            (void)kt_fine("jumps", kt_simulation_jump(simulation, NULL, NULL, &error), &error);
        }
        kt_test_advance(simulation, 1.0 + behind);
        kt_check_near("up, m/s", kt_simulation_velocities(simulation)[place_of(model, "body")], c, 1e-12);
        kt_check_near("along, m/s", kt_simulation_velocities(simulation)[place_of(model, "guide")],
                      slides + (slides < s ? mu * g * behind : 0.0), 1e-12);
        kt_check_near("dissipated, J", kt_simulation_work(simulation).dissipated,
                      mass * (s - slides) * (0.5 * slides + mu * g * behind), 1e-12);
        /* the jump closes loops some roundings later, 1e-13 s */
        kt_check_near("balance, J", kt_scene_balance(simulation), start, 1e-11);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 0);
    }
}

/* A box on three feet and a table that starts up, down or along, in the plane of symmetry. A ramp of its speed within
 * 1e-7 s is an event search and forces only, without any jump. Out of this plane, slip may turn within the ramp. */
KT_TEST(box_moves_as_in_a_fast_ramp) {
    static const double ramp = 1e-7;
    static const kt_term term = {.joint = "table", .coefficient = 1.0};
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("velocities, m/s or rad/s");
    int opened = 0;
    for (int run = 0; run < RUNS / 4; run++) {
        const double speed = kt_random_uniform(&random, -1.5, 1.5), end = 1.02;
        const double place[] = {0.0, 0.0, 1.0, 0.0, 2.0, speed},
                     rate[] = {0.0, 0.0, 1.0, 0.0, 1.0 + ramp, speed, 3.0, speed};
        double v[2][7] = {{0.0}};
        struck_scene b;
        touch_scene_box(&b.s, 3, 0.3 * kt_random_int(&random, 0, 4), 0.0);
        b.s.body[1].name = "table";
        b.s.body[1].mass = 1.0;
        b.s.body[1].joint.type = KT_JOINT_PRISMATIC;
        const double angle = kt_random_uniform(&random, -3.2, 3.2);
        b.s.body[1].joint.axis = kt_vec3_make(cos(angle), 0.0, sin(angle));
        b.s.description.body_count = 2;
        for (int k = 0; k < 3; k++) {
            b.s.effect[k].between[1].body = "table";
            b.s.effect[k].restitution = 0.5 * (run % 2);
        }
        for (int k = 0; k < 2; k++) {
            set_drive(&b, k == 0 ? KT_LOOP_MOTION : KT_LOOP_RATES);
            b.drive.terms = &term;
            b.drive.term_count = k;
            b.drive.function = kt_function_table(k == 0 ? place : rate, k == 0 ? 6 : 8, KT_INTERPOLATION_LINEAR);
            kt_model *model = kt_scene_compile(&b.s.description);
            kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
            kt_test_advance(simulation, end);
            memcpy(v[k], kt_simulation_velocities(simulation), sizeof v[k]);
            opened += k == 0 && kt_simulation_contacts(simulation).openings > 0;
        }
        for (int i = 0; i < 7; i++)
            kt_worst_near(&worst, v[0][i], v[1][i], 1e-5, "run %d, velocity %d", run, i);
    }
    kt_check_above("runs that open contacts", opened, RUNS / 16.0);
    kt_check_below("runs that open contacts", opened, RUNS / 5.0);
}

/* The acceleration of a table jumps to -6 (10 m) / (1 s)^2 at 0.3 s. A box falls behind it. Its feet open at one
 * instant, one event after another, and each of these is behind the jump. */
KT_TEST(box_falls_freely_over_a_table_that_falls_faster) {
    for (int feet = 3; feet <= 4; feet++) {
        const double start = 0.3, fall = 0.1;
        struck_scene b;
        kt_error error = {0};
        touch_scene_box(&b.s, feet, 1.0, 0.0);
        b.s.body[1].name = "table";
        b.s.body[1].mass = 1.0;
        b.s.body[1].joint.type = KT_JOINT_PRISMATIC;
        b.s.description.body_count = 2;
        for (int k = 0; k < feet; k++)
            b.s.effect[k].between[1].body = "table";
        set_drive(&b, KT_LOOP_MOTION);
        b.drive.function = kt_function_ramp(0.0, -10.0, start, start + 1.0);
        kt_model *model = kt_scene_compile(&b.s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        kt_note("%d feet", feet);
        if (simulation == NULL || !kt_fine("falls", kt_simulation_advance(simulation, start + fall, &error), &error))
            continue;
        const kt_contact_counts counts = kt_simulation_contacts(simulation);
        kt_check_near("height, m", kt_simulation_positions(simulation)[2], 0.1 - 0.5 * g * fall * fall, 1e-11);
        kt_check_equal_int("contacts that open", (long long)counts.openings, (long long)counts.closings);
        kt_check_equal_int("contacts that friction holds", (long long)counts.rested, 0);
    }
}

/* A blow of 1e-5 s on a box with three or four feet, at their height: F / (mu m g) from 2 to 1e4. Friction brakes the
 * box in the blow and behind it. */
KT_TEST(box_slides_under_a_force_far_beyond_its_friction) {
    const double mu = 0.01, mass = 2.0, start = 0.1, blow = 1e-5, height = 0.1;
    KT_WORST worst = kt_worst_make("slip, m");
    for (int k = 0; k < 80; k++) {
        const double times = 2.0 * pow(5e3, (k / 2) / 39.0), force = times * mu * mass * g;
        const double push[6] = {force, 0.0, 0.0, 0.0, -force * height};
        const double speed = (times - 1.0) * mu * g * blow, slip = 0.5 * speed * (blow + speed / (mu * g));
        kt_error error = {0};
        touch_scene s;
        touch_scene_box(&s, 3 + k % 2, mu, 0.0);
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        kt_test_advance(simulation, start);
        kt_need_fine("push", kt_simulation_set_torque(simulation, push, &error), &error);
        kt_test_advance(simulation, start + blow);
        kt_need_fine("ends", kt_simulation_set_torque(simulation, NULL, &error), &error);
        kt_test_advance(simulation, 1.0);
        kt_worst_near(&worst, kt_simulation_positions(simulation)[0], slip, 1e-6 * slip + 1e-15, "%d feet, %g times",
                      3 + k % 2, times);
    }
}

/* A crate sticks on a truck by friction of its joint, 2 N. The truck moves at 1 m/s and halts. */
KT_TEST(crate_slips_on_a_truck_that_halts) {
    static const double rows[] = {0.0, 0.0, 1.0, 1.0, 9.0, 1.0};
    kt_body body[2];
    kt_loop drive = kt_loop_default();
    kt_effect rub = kt_effect_default();
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_of(i == 0 ? "truck" : "crate", i == 0 ? NULL : "truck", KT_JOINT_PRISMATIC, 1.0);
        body[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    }
    drive.name = "drive";
    drive.type = KT_LOOP_MOTION;
    drive.joint = "truck";
    drive.function = kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR);
    rub.name = "rub";
    rub.type = KT_EFFECT_JOINT_FRICTION;
    rub.joint = "crate";
    rub.coulomb = 2.0;
    rub.stick = true;
    kt_description description = kt_description_of(body, 2, &drive, 1, &rub, 1);
    kt_model *model = kt_scene_compile(&description);
    kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
    kt_test_advance(simulation, 1.25);
    kt_check_near("speed, m/s", kt_simulation_velocities(simulation)[1], 0.5, 1e-10);
    kt_test_advance(simulation, 3.0);
    kt_check_near("place, m", kt_simulation_positions(simulation)[1], 0.25, 1e-10);
}
