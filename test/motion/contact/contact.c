/* Hard stops, contacts and slack ropes against closed forms. Balls in a row on a line have prismatic joints, and two
 * neighbours touch where their coordinates are equal. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "motion/simulation/scenes.h"

enum { BALLS = 6 };
static const double g = 9.81, pi = 3.14159265358979323846;

typedef struct row {
    kt_body body[BALLS];
    kt_loop loop[BALLS];
    kt_term term[BALLS][2];
    kt_effect effect[BALLS];
    kt_description description;
} row;

/* Balls of 1 kg at x = 0, without loops and effects. */
static void row_make(row *r, int count) {
    static const char *const names[BALLS] = {"a", "b", "c", "d", "e", "f"};
    *r = (row){.description = kt_description_default()};
    for (int i = 0; i < count; i++) {
        r->body[i] = kt_body_of(names[i], NULL, KT_JOINT_PRISMATIC, 1.0);
        r->body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        r->effect[i] = kt_effect_default();
    }
    r->description.bodies = r->body;
    r->description.body_count = count;
    r->description.loops = r->loop;
    r->description.effects = r->effect;
}

/* Ball i + 1 stays above ball i. */
static void row_touch(row *r, int i, double restitution) {
    static const char *const names[BALLS] = {"ab", "bc", "cd", "de", "ef", ""};
    kt_loop *loop = &r->loop[r->description.loop_count++];
    *loop = kt_loop_of(names[i], KT_LOOP_COUPLING);
    loop->side = KT_SIDE_ABOVE;
    loop->restitution = restitution;
    r->term[i][0] = (kt_term){.joint = r->body[i + 1].name, .coefficient = 1.0};
    r->term[i][1] = (kt_term){.joint = r->body[i].name, .coefficient = -1.0};
    loop->terms = r->term[i];
    loop->term_count = 2;
}

/* The joint of ball 0 stops at 0. */
static void row_floor(row *r, double restitution) {
    kt_effect *effect = &r->effect[r->description.effect_count++];
    effect->type = KT_EFFECT_JOINT_LIMIT;
    effect->joint = r->body[0].name;
    effect->lower = 0.0;
    effect->restitution = restitution;
}

/* ---- one ball ---------------------------------------------------------------------------------------------------- */

/* Dropped from 1 m: the ball hits the floor at t1 (1 + 2 e + 2 e^2 + ...), with t1 = sqrt(2 / g). The speeds are g t1
 * e^k, down to rest_velocity, or with adaptive steps to a bounce as high as ten tolerances. It rests from then on, to
 * within the rest of the chain. */
static void check_ball(const char *method, double step, double bound) {
    row r;
    const double e = 0.5, t1 = sqrt(2.0 / g), zeno = t1 * (1.0 + e) / (1.0 - e);
    const double lowest = step > 0.0 ? 0.0 : 10.0 * kt_scene_tolerance_of(method),
                 rest = fmax(1e-6, sqrt(2.0 * g * lowest));
    row_make(&r, 1);
    row_floor(&r, e);
    r.body[0].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, method, step, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    double expected = t1, worst = 0.0;
    int impacts = 0, count = (int)ceil(log(rest / (g * t1)) / log(e));
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation).closings == 0 &&
           kt_simulation_time(simulation) < 3.0) {
        status = kt_simulation_step(simulation, 3.0, &error);
        if (status == KT_OK && (int)kt_simulation_contacts(simulation).impacts > impacts) {
            worst = fmax(worst, fabs(kt_simulation_time(simulation) - expected));
            expected += 2.0 * t1 * pow(e, ++impacts);
        }
    }
    kt_need_fine(method, status, &error);
    kt_check_below("times of impacts, s", worst, bound);
    kt_check_equal_int("impacts", impacts, count);
    kt_check_near("rests from, s", kt_simulation_time(simulation), zeno, 4.0 * rest / g);
    kt_test_advance(simulation, 50.0);
    kt_check_near("where", kt_simulation_positions(simulation)[0], 0.0, 1e-15);
    kt_check_near("balance, J", kt_scene_balance(simulation), g, 1e-13 * g);
    kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, g, 1e-12 * g);
    kt_check_equal_int("closings", (long long)kt_simulation_contacts(simulation).closings, 1);
}

KT_TEST(bouncing_ball_comes_to_rest_at_its_zeno_point) {
    check_ball("dopri5", 0.0, 1e-12);
    check_ball("dop853", 0.0, 1e-12);
    check_ball("radau5", 0.0, 1e-12);
    check_ball(NULL, 0.0, 1e-12);
    check_ball("rk4", 0.01, 1e-12);
    check_ball("bdf2", 0.01, 1e-12);
}

/* Without a rest velocity the chain has no end. The run reports this, with the time. */
KT_TEST(chain_without_rest_ends_in_words) {
    row r;
    row_make(&r, 1);
    row_floor(&r, 0.5);
    r.effect[0].rest_velocity = 0.0;
    r.body[0].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, 0);
    kt_error error = {0};
    kt_check_true("ends", kt_simulation_advance(simulation, 3.0, &error) == KT_ERROR_STEP);
    kt_check_contains("where", error.where, "event 'a.lower' at t = 1.3545709");
    kt_check_contains("words", error.message, "without end");
}

/* On a table that moves up at w and supplies the energy of the impact: the ball leaves at w + e (w - v). */
KT_TEST(ball_on_a_moving_table_bounces_in_its_frame) {
    row r;
    const double e = 0.8, w = 0.7;
    double steps[2] = {0.0, w};
    row_make(&r, 2);
    row_touch(&r, 0, e);
    r.loop[1] = kt_loop_of("drive", KT_LOOP_MOTION);
    r.loop[1].joint = "a";
    r.loop[1].function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = steps, .number_count = 2};
    r.description.loop_count = 2;
    r.body[1].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    const double t = (-w + sqrt(w * w + 2.0 * g)) / g, fall = -g * t - w, before = kt_scene_balance(simulation);
    kt_test_advance(simulation, t + 0.1);
    kt_check_near("speed", kt_simulation_velocities(simulation)[1], w - e * fall - 0.1 * g, 1e-13);
    kt_check_near("table", kt_simulation_velocities(simulation)[0], w, 1e-13);
    kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.5 * (1.0 - e * e) * fall * fall, 1e-13);
    kt_check_near("balance, J", kt_scene_balance(simulation), before, 1e-12);
}

/* ---- several ----------------------------------------------------------------------------------------------------- */

/* A row runs for 2 s and has these speeds then. */
static kt_contact_counts check_speeds(const row *r, const double *speeds) {
    kt_model *model = kt_scene_compile(&r->description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, 0);
    kt_test_advance(simulation, 2.0);
    for (int i = 0; i < r->description.body_count; i++)
        kt_check_near("speed", kt_simulation_velocities(simulation)[i], speeds[i], 1e-14);
    const kt_contact_counts counts = kt_simulation_contacts(simulation);
    return counts;
}

/* Balls a micrometre apart hand the speed on, and only the last one moves. Balls that touch part at once, by Newton's
 * rule. Three balls have the speeds -1/3, 2/3 and 2/3. */
KT_TEST(cradle_hands_the_speed_on) {
    for (int count = 2; count <= 5; count++) {
        row r;
        row_make(&r, count);
        for (int i = 0; i < count; i++)
            r.body[i].joint.position[0] = i > 0 ? 1.0 + 1e-6 * i : 0.0;
        for (int i = 0; i + 1 < count; i++)
            row_touch(&r, i, 1.0);
        r.body[0].joint.velocity[0] = 1.0;
        double speeds[BALLS] = {0.0};
        speeds[count - 1] = 1.0;
        const kt_contact_counts counts = check_speeds(&r, speeds);
        kt_check_equal_int("impacts", (long long)counts.impacts, count - 1);
        kt_check_below("lost", counts.dissipated, 1e-14);
    }
}

KT_TEST(balls_that_touch_part_by_newtons_rule) {
    row r;
    row_make(&r, 3);
    row_touch(&r, 0, 1.0);
    row_touch(&r, 1, 1.0);
    r.body[1].joint.position[0] = r.body[2].joint.position[0] = 1.0;
    r.body[0].joint.velocity[0] = 1.0;
    (void)check_speeds(&r, (double[]){-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0});
}

/* The ball c parts from b at 0.1 when a strikes b. With e = 1, the rule would increase the energy by 0.03 J. */
KT_TEST(energy_does_not_grow_where_the_rule_would_let_it) {
    row r;
    row_make(&r, 3);
    row_touch(&r, 0, 1.0);
    row_touch(&r, 1, 1.0);
    r.body[0].joint.velocity[0] = 1.0;
    r.body[2].joint.velocity[0] = 0.1;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    const double *v = kt_simulation_velocities(simulation);
    const double kinetic = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    kt_check_equal_int("told", (long long)kt_simulation_contacts(simulation).reduced, 1);
    kt_check_below("kinetic energy, J", kinetic, 0.505);
    kt_check_near("momentum", v[0] + v[1] + v[2], 1.1, 1e-14);
    kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.505 - kinetic, 1e-14);
    kt_check_near("b leaves a at half of the rule", v[1] - v[0], 0.5, 1e-15);
    kt_check_above("c does not enter b", v[2] - v[1], -1e-15);
}

/* The same by Poisson's rule. Compression (u = -1, 1/10; W = 2, -1, -1, 2) has the impulses 19/30 and 8/30. With twice
 * these impulses, c would enter b by 1/10. An impulse larger by 1/20 at bc prevents this, at a loss of 1/400 J. */
KT_TEST(poissons_rule_needs_no_reduction) {
    row r;
    row_make(&r, 3);
    row_touch(&r, 0, 1.0);
    row_touch(&r, 1, 1.0);
    r.loop[0].poisson = r.loop[1].poisson = true;
    r.body[0].joint.velocity[0] = 1.0;
    r.body[2].joint.velocity[0] = 0.1;
    const double p1 = 19.0 / 15.0, p2 = 8.0 / 15.0 + 0.05;
    const kt_contact_counts counts = check_speeds(&r, (double[]){1.0 - p1, p1 - p2, 0.1 + p2});
    kt_check_equal_int("reduced", (long long)counts.reduced, 0);
    kt_check_near("lost, J", counts.dissipated, 0.0025, 1e-15);
}

/* At central impacts both rules agree: in a cradle, for balls that touch, and for a bouncing ball (some to the bit). */
KT_TEST(poissons_rule_is_newtons_at_central_impacts) {
    for (int touch = 0; touch < 2; touch++) {
        double v[2][BALLS];
        for (int poisson = 0; poisson < 2; poisson++) {
            row r;
            row_make(&r, BALLS - 1);
            for (int i = 0; i + 1 < BALLS - 1; i++) {
                row_touch(&r, i, 0.7);
                r.loop[i].poisson = poisson > 0;
                r.body[i + 1].joint.position[0] = touch ? 0.5 : 0.5 + 0.1 * (i + 1);
            }
            r.body[0].joint.position[0] = 0.5;
            row_floor(&r, 0.5);
            r.effect[0].poisson = poisson > 0;
            r.body[0].joint.velocity[0] = 1.0;
            kt_model *model = kt_scene_compile(&r.description);
            kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, 0);
            kt_test_advance(simulation, 2.0);
            memcpy(v[poisson], kt_simulation_velocities(simulation), (BALLS - 1) * sizeof(double));
        }
        for (int i = 0; i < BALLS - 1; i++)
            kt_check_near("speed", v[1][i], v[0][i], 1e-14);
    }
    const double e = 0.5, v0 = 3.0, zeno = 2.0 * v0 / (g * (1.0 - e));
    row r;
    row_make(&r, 1);
    row_floor(&r, e);
    r.effect[0].poisson = true;
    r.body[0].joint.velocity[0] = v0;
    r.description.gravity.z = -g;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, 0);
    kt_test_advance(simulation, zeno + 0.1);
    kt_check_below("rests", fabs(kt_simulation_positions(simulation)[0]), 1e-15);
    kt_check_equal_int("closed", (long long)kt_simulation_contacts(simulation).closings, 1);
}

/* Three fall onto each other, and rest: all of the energy is lost, and the floor carries all, ab two, bc one. */
KT_TEST(falling_stack_comes_to_rest) {
    row r;
    double multipliers[3], energy = 0.0;
    row_make(&r, 3);
    row_touch(&r, 0, 0.3);
    row_touch(&r, 1, 0.2);
    row_floor(&r, 0.4);
    for (int i = 0; i < 3; i++) {
        r.body[i].joint.position[0] = 0.5 + 0.4 * i;
        energy += g * r.body[i].joint.position[0];
    }
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_test_advance(simulation, 10.0);
    const kt_model *closed = kt_simulation_model(simulation);
    kt_check_equal_int("all closed", (long long)kt_switch_set(closed), 7);
    for (int i = 0; i < 3; i++) {
        kt_check_near("position", kt_simulation_positions(simulation)[i], 0.0, 1e-18);
        kt_check_near("velocity", kt_simulation_velocities(simulation)[i], 0.0, 1e-20);
    }
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-11);
    kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, energy, 1e-9);
    kt_data *data = kt_test_data(closed);
    kt_need_fine("reactions",
                 kt_multiplier_evaluate(closed, data, 10.0, kt_simulation_positions(simulation),
                                        kt_simulation_velocities(simulation), NULL, NULL, multipliers, &error),
                 &error);
    for (int i = 0; i < 3; i++)
        kt_check_near("reaction, N", multipliers[i], g * (i == 0 ? 2.0 : i == 1 ? 1.0 : 3.0), 1e-12);
}

/* ---- friction that sticks ---------------------------------------------------------------------------------------- */

/* A mass on a spring, pulled out by x0, makes half swings about C / k and -C / k. They end at x_n = (-1)^n (x0 - 2 n C
 * / k), at times n pi / w. When one ends within S / k, the mass sticks there without creep. */
KT_TEST(dry_oscillator_comes_to_rest_where_it_must) {
    const double k = 40.0, C = 2.0, x0 = 0.93, w = sqrt(k);
    row r;
    row_make(&r, 1);
    r.body[0].joint.position[0] = x0;
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "a";
    r.effect[0].coulomb = C;
    r.effect[0].stick = true;
    r.effect[1] = kt_effect_of(KT_EFFECT_JOINT_SPRING, "a");
    r.effect[1].stiffness = k;
    r.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    const double energy = kt_scene_balance(simulation);
    const int swings = (int)ceil((x0 - C / k) / (2.0 * C / k));
    const double rest = (swings % 2 == 0 ? 1.0 : -1.0) * (x0 - 2.0 * swings * C / k);
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks == 0 && kt_simulation_time(simulation) < 20.0)
        status = kt_simulation_step(simulation, 20.0, &error);
    kt_need_fine("swings", status, &error);
    kt_check_near("rests from, s", kt_simulation_time(simulation), swings * pi / w, 1e-12);
    kt_check_near("at", kt_simulation_positions(simulation)[0], rest, 1e-13);
    const double at = kt_simulation_positions(simulation)[0];
    kt_test_advance(simulation, 100.0);
    kt_check_near("creep", kt_simulation_positions(simulation)[0], at, 0.0);
    kt_check_near("velocity", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-11);
}

/* A mass on a spring on a belt of speed w0, with static friction S and C in motion. It sticks until k x = S. Then, with
 * w^2 = k / m, it swings about C / k: x - C / k = (S - C) / k cos(w s) + w0 / w sin(w s). It slides for (2 pi - 2
 * atan((S - C) w / (k w0))) / w. Then it sticks at C / k - (S - C) / k, for 2 (S - C) / (k w0). */
KT_TEST(stick_slip_on_a_belt_has_its_period) {
    const double k = 50.0, C = 3.0, S = 5.0, w0 = 0.4, w = sqrt(k);
    const double slip = (2.0 * pi - 2.0 * atan((S - C) * w / (k * w0))) / w, stick = 2.0 * (S - C) / (k * w0);
    double belt[2] = {0.0, w0};
    static const char *const methods[] = {"dop853", "radau5", "dopri5"};
    row r;
    row_make(&r, 2);
    r.body[1].parent = "a";
    r.loop[0] = kt_loop_of("drive", KT_LOOP_MOTION);
    r.loop[0].joint = "a";
    r.loop[0].function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = belt, .number_count = 2};
    r.description.loop_count = 1;
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "b";
    r.effect[0].coulomb = C;
    r.effect[0].breakaway = S;
    r.effect[0].stribeck = 0.0;
    r.effect[0].stick = true;
    r.effect[1] = kt_effect_of(KT_EFFECT_EXPRESSION, "b");
    r.effect[1].formula[0] = "-50*(position.a + position.b)";
    r.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&r.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation = kt_scene_start(model, methods[m], 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
        kt_error error = {0};
        kt_status status = KT_OK;
        double worst_time = 0.0, worst_place = 0.0, expected = S / (k * w0);
        for (uint64_t n = 1; status == KT_OK && n <= 10; n++) {
            while (status == KT_OK && kt_simulation_contacts(simulation).slips < n &&
                   kt_simulation_time(simulation) < 30.0)
                status = kt_simulation_step(simulation, 30.0, &error);
            const double *q = kt_simulation_positions(simulation);
            worst_time = fmax(worst_time, fabs(kt_simulation_time(simulation) - expected));
            worst_place = fmax(worst_place, fabs(q[0] + q[1] - S / k));
            while (status == KT_OK && kt_simulation_contacts(simulation).sticks < n + 1 &&
                   kt_simulation_time(simulation) < 30.0)
                status = kt_simulation_step(simulation, 30.0, &error);
            worst_time = fmax(worst_time, fabs(kt_simulation_time(simulation) - expected - slip));
            worst_place = fmax(worst_place, fabs(q[0] + q[1] - (2.0 * C - S) / k));
            expected += slip + stick;
        }
        kt_need_fine(methods[m], status, &error);
        kt_check_below("times, s", worst_time, m == 0 ? 1e-11 : 1e-8);
        kt_check_below("places, m", worst_place, m == 0 ? 1e-11 : 1e-8);
    }
}

/* A block on an incline, held by friction at 0.99 of its limit, stays in place for 100 s to the bit. At 1.01 of the
 * limit it slides at g sin(a) - C / m. */
KT_TEST(block_below_its_limit_does_not_creep) {
    for (int i = 0; i < 2; i++) {
        row r;
        const double C = i == 0 ? g / 0.99 : g / 1.01;
        row_make(&r, 1);
        r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
        r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
        r.effect[0].joint = "a";
        r.effect[0].coulomb = C;
        r.effect[0].stick = true;
        r.description.effect_count = 1;
        r.body[0].joint.position[0] = 0.3;
        kt_model *model = kt_scene_compile(&r.description);
        kt_simulation *simulation = kt_scene_start(model, "dopri5", 0.0, 0);
        kt_test_advance(simulation, i == 0 ? 100.0 : 1.0);
        const double x = kt_simulation_positions(simulation)[0];
        kt_check_near("position", x, i == 0 ? 0.3 : 0.3 - 0.5 * (g - C), i == 0 ? 0.0 : 1e-12);
        kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, i == 0);
    }
}

/* ---- the run as a whole ------------------------------------------------------------------------------------------ */

/* The second half has the bits of a run that never stopped, and nothing allocates. */
KT_TEST(checkpoint_between_impacts_goes_on_with_the_same_bits) {
    static const char *const methods[] = {"dopri5", "radau5", "rkc2"};
    row r;
    row_make(&r, 3);
    row_touch(&r, 0, 0.3);
    row_touch(&r, 1, 0.2);
    row_floor(&r, 0.4);
    for (int i = 0; i < 3; i++)
        r.body[i].joint.position[0] = 0.5 + 0.4 * i;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *one = kt_scene_start(model, methods[m], 0.0, 0),
                      *two = kt_scene_start(model, methods[m], 0.0, 0);
        kt_error error = {0};
        kt_test_advance(one, 0.5);
        kt_need(kt_scene_hand_over(one, two));
        kt_interpose_start();
        const kt_status status = kt_simulation_advance(one, 5.0, &error);
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        (void)kt_fine("second half", status, &error);
        kt_test_advance(two, 5.0);
        kt_scene_check_equal("state", two, one);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(two).impacts,
                           (long long)kt_simulation_contacts(one).impacts);
    }
}

/* ---- what is rejected -------------------------------------------------------------------------------------------- */

KT_TEST(what_cannot_be_hard_is_told) {
    row r;
    row_make(&r, 2);
    row_floor(&r, 0.5);
    r.effect[0].restitution = 1.5;
    kt_scene_check_rejected("above 1", &r.description, "restitution is 1.5; it must be 0 to 1");
    r.effect[0].restitution = 0.5;
    r.effect[0].stiffness = 100.0;
    kt_scene_check_rejected("both", &r.description, "a hard stop (restitution) has no stiffness");
    r.effect[0].stiffness = 0.0;
    r.effect[0].name = "stop";
    kt_model *hard = kt_scene_compile(&r.description);
    kt_parameter parameter;
    kt_error from = {0};
    kt_check_true("fixed", kt_parameter_find(hard, "effect stop.lower", &parameter, &from) == KT_ERROR_ARGUMENT);
    kt_check_contains("words", from.message, "effect 'stop' is hard");
    r.effect[0].name = NULL;
    r.effect[0].restitution = (double)INFINITY;
    kt_scene_check_rejected("neither", &r.description, "stiffness is 0 or missing");
    r.effect[0].stiffness = 100.0;
    r.effect[0].poisson = true;
    kt_scene_check_rejected("no impulses", &r.description, "Poisson's rule is for a hard stop");
    r.effect[0].stiffness = 0.0;
    r.effect[0].poisson = false;
    r.effect[0].restitution = 0.5;
    row_touch(&r, 0, 0.5);
    r.loop[0].type = KT_LOOP_RATES;
    kt_scene_check_rejected("no side", &r.description, "no loop but distance, inplane, surface and coupling");
    r.loop[0].type = KT_LOOP_COUPLING;
    r.loop[0].side = KT_SIDE_NONE;
    kt_scene_check_rejected("no bounce", &r.description, "only a loop that bounds one side bounces");
    r.loop[0].restitution = 0.0;
    r.loop[0].poisson = true;
    kt_scene_check_rejected("no rule", &r.description, "only a loop that bounds one side bounces");
    r.description.loop_count = 0;
    r.effect[0] = kt_effect_of(KT_EFFECT_JOINT_FRICTION, "a");
    r.effect[0].stick = true;
    kt_scene_check_rejected("nothing slips", &r.description, "coulomb is 0; give the friction of slip");
    r.effect[0].coulomb = 1.0;
    r.effect[0].smoothing = 0.1;
    kt_scene_check_rejected("smoothed", &r.description, "friction that sticks is not smoothed");
    r.effect[0].smoothing = kt_effect_default().smoothing;
    r.effect[0].stribeck = 0.0;
    r.effect[0].stick = false;
    kt_scene_check_rejected("no curve", &r.description, "stribeck is 0; it must be greater than 0");
}
