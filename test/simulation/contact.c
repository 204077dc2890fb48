/* Hard stops, contacts and slack ropes against closed forms. Balls stand in a row on a line, each a prismatic joint, and two
 * neighbours touch where their coordinates are equal. */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "scenes.h"

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
        r->body[i] = kt_body_default();
        r->body[i].name = names[i];
        r->body[i].joint.type = KT_JOINT_PRISMATIC;
        r->body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        r->body[i].mass = 1.0;
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
    *loop = kt_loop_default();
    loop->name = names[i];
    loop->type = KT_LOOP_COUPLING;
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

static kt_simulation *start(const kt_model *model, const char *method, double step, unsigned record) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    run.duration = 100.0;
    run.relative = run.absolute = method != NULL && strcmp(method, "dop853") == 0 ? 1e-13 : 1e-10;
    options.record = record;
    return model != NULL ? kt_scene_simulate(model, &run, &options) : NULL;
}

/* ---- one ball ---------------------------------------------------------------------------------------------------- */

/* Dropped from 1 m: impacts at t1 (1 + 2 e + 2 e^2 + ...), t1 = sqrt(2 / g), at speeds g t1 e^k, down to rest_velocity; it
 * rests from then on, within what is left of the chain. */
static void check_ball(const char *method, double step, double bound) {
    row r;
    const double e = 0.5, t1 = sqrt(2.0 / g), zeno = t1 * (1.0 + e) / (1.0 - e), rest = 1e-6;
    row_make(&r, 1);
    row_floor(&r, e);
    r.body[0].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, method, step, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    double expected = t1, worst = 0.0;
    int impacts = 0, count = (int)ceil(log(rest / (g * t1)) / log(e));
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    while (status == KT_OK && kt_simulation_contacts(simulation).closings == 0 &&
           kt_simulation_time(simulation) < 3.0) {
        status = kt_simulation_step(simulation, 3.0, &error);
        if (status == KT_OK && (int)kt_simulation_contacts(simulation).impacts > impacts) {
            worst = fmax(worst, fabs(kt_simulation_time(simulation) - expected));
            expected += 2.0 * t1 * pow(e, ++impacts);
        }
    }
    if (kt_fine(method, status, &error)) {
        kt_check_below("times of impacts, s", worst, bound);
        kt_check_equal_int("impacts", impacts, count);
        kt_check_near("rests from, s", kt_simulation_time(simulation), zeno, 4.0 * rest / g);
        (void)kt_fine("rests", kt_simulation_advance(simulation, 50.0, &error), &error);
        kt_check_near("where", kt_simulation_positions(simulation)[0], 0.0, 1e-15);
        kt_check_near("balance, J", kt_scene_balance(simulation), g, 1e-12 * g);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, g, 1e-12 * g);
        kt_check_equal_int("closings", (long long)kt_simulation_contacts(simulation).closings, 1);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

KT_TEST(bouncing_ball_comes_to_rest_at_its_zeno_point) {
    check_ball("dopri5", 0.0, 1e-12);
    check_ball("dop853", 0.0, 1e-12);
    check_ball("radau5", 0.0, 1e-12);
    check_ball(NULL, 0.0, 1e-12);
    check_ball("rk4", 0.01, 1e-12);
    check_ball("bdf2", 0.01, 1e-12);
}

/* Without a rest velocity the chain has no end: it is told, with the time. */
KT_TEST(chain_without_rest_ends_in_words) {
    row r;
    row_make(&r, 1);
    row_floor(&r, 0.5);
    r.effect[0].rest_velocity = 0.0;
    r.body[0].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0, 0);
    kt_error error = {0};
    if (simulation != NULL) {
        kt_check_true("ends", kt_simulation_advance(simulation, 3.0, &error) == KT_ERROR_STEP);
        kt_check_contains("where", error.where, "event 'a.lower' at t = 1.3545709");
        kt_check_contains("words", error.message, "without end");
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* On a table that moves up at w and supplies what it takes: it leaves at w + e (w - v). */
KT_TEST(ball_on_a_moving_table_bounces_in_its_frame) {
    row r;
    const double e = 0.8, w = 0.7;
    double steps[2] = {0.0, w};
    row_make(&r, 2);
    row_touch(&r, 0, e);
    r.loop[1] = kt_loop_default();
    r.loop[1].name = "drive";
    r.loop[1].type = KT_LOOP_MOTION;
    r.loop[1].joint = "a";
    r.loop[1].function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = steps, .number_count = 2};
    r.description.loop_count = 2;
    r.body[1].joint.position[0] = 1.0;
    r.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    const double t = (-w + sqrt(w * w + 2.0 * g)) / g, fall = -g * t - w,
                 before = simulation ? kt_scene_balance(simulation) : 0.0;
    if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, t + 0.1, &error), &error)) {
        kt_check_near("speed", kt_simulation_velocities(simulation)[1], w - e * fall - 0.1 * g, 1e-11);
        kt_check_near("table", kt_simulation_velocities(simulation)[0], w, 1e-13);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.5 * (1.0 - e * e) * fall * fall,
                      1e-11);
        kt_check_near("balance, J", kt_scene_balance(simulation), before, 1e-9);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- several ----------------------------------------------------------------------------------------------------- */

/* A row runs for 2 s and has these speeds then. */
static kt_contact_counts check_speeds(const row *r, const double *speeds) {
    kt_model *model = kt_scene_compile(&r->description);
    kt_simulation *simulation = start(model, "dopri5", 0.0, 0);
    kt_error error = {0};
    if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, 2.0, &error), &error))
        for (int i = 0; i < r->description.body_count; i++)
            kt_check_near("speed", kt_simulation_velocities(simulation)[i], speeds[i], 1e-14);
    const kt_contact_counts counts = kt_simulation_contacts(simulation);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return counts;
}

/* Balls a micrometre apart hand the speed on; only the last one moves. Balls that touch part by Newton's rule all at once:
 * of three, -1/3, 2/3, 2/3. */
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

/* c parts from b at 0.1 when a strikes b: by the rule with e = 1 the energy would grow by 0.03 J. */
KT_TEST(energy_does_not_grow_where_the_rule_would_let_it) {
    row r;
    row_make(&r, 3);
    row_touch(&r, 0, 1.0);
    row_touch(&r, 1, 1.0);
    r.body[0].joint.velocity[0] = 1.0;
    r.body[2].joint.velocity[0] = 0.1;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    if (simulation != NULL) {
        const double *v = kt_simulation_velocities(simulation);
        const double kinetic = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        kt_check_equal_int("told", (long long)kt_simulation_contacts(simulation).reduced, 1);
        kt_check_below("kinetic energy, J", kinetic, 0.505);
        kt_check_near("momentum", v[0] + v[1] + v[2], 1.1, 1e-14);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.505 - kinetic, 1e-14);
        kt_check_above("b leaves a", v[1] - v[0], 0.0);
        kt_check_above("c does not enter b", v[2] - v[1], -1e-15);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
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
    kt_simulation *simulation = start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_data *data = NULL;
    if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, 10.0, &error), &error)) {
        const kt_model *closed = kt_simulation_model(simulation);
        kt_check_equal_int("all closed", (long long)kt_switch_set(closed), 7);
        for (int i = 0; i < 3; i++) {
            kt_check_near("position", kt_simulation_positions(simulation)[i], 0.0, 1e-14);
            kt_check_near("velocity", kt_simulation_velocities(simulation)[i], 0.0, 1e-14);
        }
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-11);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, energy, 1e-9);
        if (kt_fine("data", kt_data_create(closed, &data, &error), &error) &&
            kt_fine("reactions",
                    kt_multiplier_evaluate(closed, data, 10.0, kt_simulation_positions(simulation),
                                           kt_simulation_velocities(simulation), NULL, NULL, multipliers, &error),
                    &error))
            for (int i = 0; i < 3; i++)
                kt_check_near("reaction, N", multipliers[i], g * (i == 0 ? 2.0 : i == 1 ? 1.0 : 3.0), 1e-12);
    }
    kt_data_free(data);
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- in mechanisms ----------------------------------------------------------------------------------------------- */

/* A parallelogram of cranks whose coupler is pinned: one degree of freedom, which a stop turns back: -e times all rates. */
KT_TEST(stop_in_a_loop_turns_all_rates_back) {
    const double e = 0.6;
    kt_body body[3];
    kt_loop pin = kt_loop_default();
    kt_effect stop = kt_effect_default();
    kt_description d = kt_description_default();
    static const char *const names[3] = {"crank", "coupler", "rocker"};
    for (int i = 0; i < 3; i++) {
        body[i] = kt_body_default();
        body[i].name = names[i];
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        body[i].mass = 1.0 + i;
        body[i].inertia.xx = body[i].inertia.yy = body[i].inertia.zz = 0.2;
        body[i].com = kt_vec3_make(0.4, 0.1, 0.0);
    }
    body[1].parent = "crank";
    body[1].joint.at = kt_vec3_make(1.0, 0.0, 0.0);
    body[2].joint.at = kt_vec3_make(2.0, 0.0, 0.0);
    body[0].joint.position[0] = pi / 2.0;
    body[0].joint.velocity[0] = 1.0;
    body[1].joint.position[0] = -pi / 3.0;
    body[2].joint.position[0] = pi / 2.0;
    body[1].joint.guess = body[2].joint.guess = true;
    pin.name = "pin";
    pin.type = KT_LOOP_SPHERICAL;
    pin.between[0] = (kt_end){.body = "coupler", .at = kt_vec3_make(2.2, 0.0, 0.0)};
    pin.between[1] = (kt_end){.body = "rocker", .at = kt_vec3_make(1.3, 0.0, 0.0)};
    stop.type = KT_EFFECT_JOINT_LIMIT;
    stop.joint = "coupler";
    stop.lower = -1.5;
    stop.restitution = e;
    d.bodies = body;
    d.body_count = 3;
    d.loops = &pin;
    d.loop_count = 1;
    d.effects = &stop;
    d.effect_count = 1;
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    double before[3] = {0.0, 0.0, 0.0};
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
    while (status == KT_OK && kt_simulation_contacts(simulation).impacts == 0 && kt_simulation_time(simulation) < 5.0) {
        memcpy(before, kt_simulation_velocities(simulation), sizeof before);
        status = kt_simulation_step(simulation, kt_simulation_time(simulation) + 1e-4, &error);
    }
    if (kt_fine("runs", status, &error)) {
        const double *v = kt_simulation_velocities(simulation);
        kt_check_equal_int("one impact", (long long)kt_simulation_contacts(simulation).impacts, 1);
        kt_check_near("at the stop", kt_simulation_positions(simulation)[1], -1.5, 1e-12);
        for (int i = 0; i < 3; i++)
            kt_check_near("rate, over that of a step before", v[i] / before[i], -e, 1e-3);
        kt_check_near("ratio of rates stays", v[0] / v[1] - before[0] / before[1], 0.0, 1e-3);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-9);
        kt_record record = {0};
        if (kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error))
            kt_check_near("lost, of what is left", kt_simulation_contacts(simulation).dissipated / record.kinetic,
                          1.0 / (e * e) - 1.0, 1e-10);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* A block on two corners without friction: its centre falls straight down. With half width b, when a corner lands while the
 * block turns at w about the other,
 *     w+ = w (I - m b^2) / (I + m b^2)
 * and the other leaves (Housner's block, whose corners do not slide, has I + m h^2 in place of I). */
KT_TEST(rocking_block_keeps_the_part_of_its_rate_that_it_must) {
    const double b = 0.2, h = 0.6, m = 2.0, inertia = 0.5, tilt = 0.1;
    kt_body block = kt_body_default();
    kt_effect corner[2] = {kt_effect_default(), kt_effect_default()};
    kt_description d = kt_description_default();
    block.name = "block";
    block.joint.type = KT_JOINT_PLANAR;
    block.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    block.mass = m;
    block.inertia.xx = block.inertia.yy = block.inertia.zz = inertia;
    block.joint.position[1] = h * cos(tilt) + b * sin(tilt);
    block.joint.position[2] = tilt;
    for (int i = 0; i < 2; i++) {
        corner[i].type = KT_EFFECT_CONTACT;
        corner[i].name = i == 0 ? "left" : "right";
        corner[i].between[0] = (kt_end){.body = "block", .at = kt_vec3_make(i == 0 ? -b : b, -h, 0.0)};
        corner[i].axis = kt_vec3_make(0.0, 1.0, 0.0);
        corner[i].restitution = 0.0;
    }
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    d.bodies = &block;
    d.body_count = 1;
    d.effects = corner;
    d.effect_count = 2;
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
    double fell = 0.0;
    if (simulation != NULL)
        kt_check_equal_int("it stands on one corner", (long long)kt_switch_set(kt_simulation_model(simulation)), 1);
    for (int impact = 1; status == KT_OK && impact <= 5; impact++) {
        while (status == KT_OK && (int)kt_simulation_contacts(simulation).impacts < impact &&
               kt_simulation_time(simulation) < 20.0)
            status = kt_simulation_step(simulation, 20.0, &error);
        const double *v = kt_simulation_velocities(simulation);
        const double behind = 0.5 * (m * v[1] * v[1] + inertia * v[2] * v[2]);
        const double ratio = (inertia - m * b * b) / (inertia + m * b * b);
        const double before = behind + kt_simulation_contacts(simulation).dissipated - fell;
        fell = kt_simulation_contacts(simulation).dissipated;
        kt_check_near("flat", kt_simulation_positions(simulation)[2], 0.0, 1e-9);
        kt_check_near("energy left", behind / before, ratio * ratio, 1e-9);
        kt_check_near("moves about the other corner", v[1], (impact % 2 == 1 ? -b : b) * v[2], 1e-12);
        kt_check_equal_int("stands on it", (long long)kt_switch_set(kt_simulation_model(simulation)),
                           impact % 2 == 1 ? 2 : 1);
    }
    if (kt_fine("runs", status, &error)) {
        kt_check_near("it does not slide", kt_simulation_positions(simulation)[0], 0.0, 1e-14);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-8);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* A stone on a rope of length L, at a speed v0 in the lowest point: the rope is slack from the angle a above the horizontal
 * with g L sin a = v^2 = v0^2 - 2 g L (1 + sin a), for 4 v cos a / g, and then taut again, plastically. */
KT_TEST(slack_pendulum_flies_and_is_caught) {
    const double L = 1.3, v0 = sqrt(3.7 * g * L), s = (v0 * v0 / (g * L) - 2.0) / 3.0, c = sqrt(1.0 - s * s);
    const double v = sqrt(g * L * s), flight = 4.0 * v * c / g;
    kt_body stone = kt_body_default();
    kt_loop rope = kt_loop_default();
    kt_description d = kt_description_default();
    stone.name = "stone";
    stone.joint.type = KT_JOINT_PLANAR;
    stone.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    stone.mass = 1.0;
    stone.inertia.xx = stone.inertia.yy = stone.inertia.zz = 0.1;
    stone.joint.position[1] = -L;
    stone.joint.velocity[0] = v0;
    rope.name = "rope";
    rope.type = KT_LOOP_DISTANCE;
    rope.between[1].body = "stone";
    rope.function = kt_function_constant(L);
    rope.slack = true;
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    d.bodies = &stone;
    d.body_count = 1;
    d.loops = &rope;
    d.loop_count = 1;
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
    while (status == KT_OK && kt_simulation_contacts(simulation).openings == 0 && kt_simulation_time(simulation) < 5.0)
        status = kt_simulation_step(simulation, 5.0, &error);
    if (kt_fine("swings", status, &error)) {
        const double *q = kt_simulation_positions(simulation), *w = kt_simulation_velocities(simulation);
        const double from = kt_simulation_time(simulation);
        kt_check_near("slack at x", q[0], L * c, 1e-8);
        kt_check_near("slack at y", q[1], L * s, 1e-8);
        kt_check_near("speed", hypot(w[0], w[1]), v, 1e-8);
        while (status == KT_OK && kt_simulation_contacts(simulation).closings < 2 &&
               kt_simulation_time(simulation) < 5.0)
            status = kt_simulation_step(simulation, 5.0, &error);
        (void)kt_fine("flies", status, &error);
        const double x = L * c - v * s * flight, y = L * s + v * c * flight - 0.5 * g * flight * flight;
        const double vx = -v * s, vy = v * c - g * flight, radial = (x * vx + y * vy) / L;
        kt_check_near("taut after, s", kt_simulation_time(simulation) - from, flight, 1e-8);
        kt_check_near("at x", q[0], x, 1e-8);
        kt_check_near("velocity x", w[0], vx - radial * x / L, 1e-7);
        kt_check_near("velocity y", w[1], vy - radial * y / L, 1e-7);
        kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.5 * radial * radial, 1e-7);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-8);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- friction that sticks ---------------------------------------------------------------------------------------- */

/* A mass on a spring, pulled out by x0: half swings about C / k and -C / k, to x_n = (-1)^n (x0 - 2 n C / k), at times
 * n pi / w, until one ends within S / k; then it sticks there, without creep. */
KT_TEST(dry_oscillator_comes_to_rest_where_it_must) {
    const double k = 40.0, C = 2.0, x0 = 0.93, w = sqrt(k);
    row r;
    row_make(&r, 1);
    r.body[0].joint.position[0] = x0;
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "a";
    r.effect[0].coulomb = C;
    r.effect[0].stick = true;
    r.effect[1] = kt_effect_default();
    r.effect[1].type = KT_EFFECT_JOINT_SPRING;
    r.effect[1].joint = "a";
    r.effect[1].stiffness = k;
    r.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
    const int swings = (int)ceil((x0 - C / k) / (2.0 * C / k));
    const double rest = (swings % 2 == 0 ? 1.0 : -1.0) * (x0 - 2.0 * swings * C / k);
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks == 0 && kt_simulation_time(simulation) < 20.0)
        status = kt_simulation_step(simulation, 20.0, &error);
    if (kt_fine("swings", status, &error)) {
        kt_check_near("rests from, s", kt_simulation_time(simulation), swings * pi / w, 1e-9);
        kt_check_near("at", kt_simulation_positions(simulation)[0], rest, 1e-10);
        const double at = kt_simulation_positions(simulation)[0];
        (void)kt_fine("lies", kt_simulation_advance(simulation, 100.0, &error), &error);
        kt_check_near("creep", kt_simulation_positions(simulation)[0], at, 0.0);
        kt_check_near("velocity", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-9);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* A mass on a spring on a belt that moves at w0, with static friction S and C in motion. It sticks until k x = S; then, with
 * w^2 = k / m, it swings about C / k, x - C / k = (S - C) / k cos(w s) + w0 / w sin(w s), until it moves with the belt again:
 * after (2 pi - 2 atan((S - C) w / (k w0))) / w, at C / k - (S - C) / k. It then sticks for 2 (S - C) / (k w0). */
KT_TEST(stick_slip_on_a_belt_has_its_period) {
    const double k = 50.0, C = 3.0, S = 5.0, w0 = 0.4, w = sqrt(k);
    const double slip = (2.0 * pi - 2.0 * atan((S - C) * w / (k * w0))) / w, stick = 2.0 * (S - C) / (k * w0);
    double belt[2] = {0.0, w0};
    static const char *const methods[] = {"dop853", "radau5", "dopri5"};
    row r;
    row_make(&r, 2);
    r.body[1].parent = "a";
    r.loop[0] = kt_loop_default();
    r.loop[0].name = "drive";
    r.loop[0].type = KT_LOOP_MOTION;
    r.loop[0].joint = "a";
    r.loop[0].function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = belt, .number_count = 2};
    r.description.loop_count = 1;
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "b";
    r.effect[0].coulomb = C;
    r.effect[0].breakaway = S;
    r.effect[0].stribeck = 0.0;
    r.effect[0].stick = true;
    r.effect[1] = kt_effect_default();
    r.effect[1].type = KT_EFFECT_EXPRESSION;
    r.effect[1].joint = "b";
    r.effect[1].formula[0] = "-50*(position.a + position.b)";
    r.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&r.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation = start(model, methods[m], 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
        kt_error error = {0};
        kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
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
        if (kt_fine(methods[m], status, &error)) {
            kt_check_below("times, s", worst_time, m == 0 ? 1e-11 : 1e-8);
            kt_check_below("places, m", worst_place, m == 0 ? 1e-11 : 1e-8);
        }
        kt_simulation_free(simulation);
    }
    kt_model_free(model);
}

/* A block on an incline, held by friction at 0.99 of its limit, lies for 100 s to the bit; one at 1.01 slides at
 * g sin(a) - C / m. */
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
        kt_simulation *simulation = start(model, "dopri5", 0.0, 0);
        kt_error error = {0};
        if (simulation != NULL &&
            kt_fine("runs", kt_simulation_advance(simulation, i == 0 ? 100.0 : 1.0, &error), &error)) {
            const double x = kt_simulation_positions(simulation)[0];
            kt_check_near("position", x, i == 0 ? 0.3 : 0.3 - 0.5 * (g - C), i == 0 ? 0.0 : 1e-12);
            kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, i == 0);
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
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
        kt_simulation *one = start(model, methods[m], 0.0, 0), *two = start(model, methods[m], 0.0, 0);
        void *block = one != NULL ? malloc(kt_simulation_state_size(one)) : NULL;
        kt_error error = {0};
        if (two != NULL && block != NULL && kt_fine("half", kt_simulation_advance(one, 0.5, &error), &error)) {
            kt_simulation_save(one, block);
            kt_interpose_start();
            const kt_status status = kt_simulation_advance(one, 5.0, &error);
            kt_check_equal_int("allocations", kt_interpose_stop(), 0);
            (void)kt_fine("second half", status, &error);
            (void)kt_fine("restores", kt_simulation_restore(two, block, &error), &error);
            (void)kt_fine("second half again", kt_simulation_advance(two, 5.0, &error), &error);
            kt_check_equal_bits("positions", kt_simulation_positions(two), kt_simulation_positions(one), 3);
            kt_check_equal_bits("velocities", kt_simulation_velocities(two), kt_simulation_velocities(one), 3);
            kt_check_equal_int("impacts", (long long)kt_simulation_contacts(two).impacts,
                               (long long)kt_simulation_contacts(one).impacts);
        }
        free(block);
        kt_simulation_free(one);
        kt_simulation_free(two);
    }
    kt_model_free(model);
}

static void check_refused(const char *what, const kt_description *d, const char *words) {
    kt_model *model = NULL;
    kt_error error = {0};
    kt_check_true(what, kt_model_compile(d, NULL, &model, &error) != KT_OK);
    kt_check_contains("words", error.message, words);
    kt_model_free(model);
}

KT_TEST(what_cannot_be_hard_is_told) {
    row r;
    row_make(&r, 2);
    row_floor(&r, 0.5);
    r.effect[0].restitution = 1.5;
    check_refused("above 1", &r.description, "restitution is 1.5; it must be 0 to 1");
    r.effect[0].restitution = 0.5;
    r.effect[0].stiffness = 100.0;
    check_refused("both", &r.description, "a hard stop (restitution) has no stiffness");
    r.effect[0].stiffness = 0.0;
    r.effect[0].name = "stop";
    kt_model *hard = kt_scene_compile(&r.description);
    kt_parameter parameter;
    kt_error from = {0};
    kt_check_true("fixed", kt_parameter_find(hard, "effect stop.lower", &parameter, &from) == KT_ERROR_ARGUMENT);
    kt_check_contains("words", from.message, "effect 'stop' is hard");
    kt_model_free(hard);
    r.effect[0].name = NULL;
    r.effect[0].restitution = (double)INFINITY;
    check_refused("neither", &r.description, "stiffness is 0 or missing");
    r.effect[0].restitution = 0.5;
    r.effect[0].switching = KT_SWITCHED_ON;
    check_refused("switched", &r.description, "closes and opens by itself");
    r.effect[0].switching = KT_ALWAYS_ON;
    row_touch(&r, 0, 0.5);
    r.loop[0].type = KT_LOOP_RATES;
    check_refused("no side", &r.description, "no loop but distance, inplane, surface and coupling");
    r.loop[0].type = KT_LOOP_COUPLING;
    r.loop[0].side = KT_SIDE_NONE;
    check_refused("no bounce", &r.description, "a loop that holds does not bounce");
    r.description.loop_count = 0;
    kt_effect stop = r.effect[0];
    r.effect[0] = kt_effect_default();
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "a";
    r.effect[0].stick = true;
    check_refused("nothing slips", &r.description, "coulomb is 0; give what slips");
    r.effect[0].coulomb = 1.0;
    r.effect[0].smoothing = 0.1;
    check_refused("smoothed", &r.description, "friction that sticks is not smoothed");
    r.effect[0].smoothing = kt_effect_default().smoothing;
    r.effect[0].stribeck = 0.0;
    r.effect[0].stick = false;
    check_refused("no curve", &r.description, "stribeck is 0; it must be greater than 0");
    r.effect[0] = stop;
    r.description.loop_count = 0;
    r.body[0].joint.position[0] = -0.01;
    kt_model *model = kt_scene_compile(&r.description);
    const kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    kt_check_true("deep", kt_simulation_create(model, &run, NULL, &simulation, &error) == KT_ERROR_CONSTRAINT);
    kt_check_contains("where", error.where, "contact 'a.lower' at t = 0 s");
    kt_check_contains("words", error.message, "it is 0.01 (m or rad) beyond its boundary");
    kt_model_free(model);
}

/* ---- random mechanisms ------------------------------------------------------------------------------------------- */

enum { LINKS = 4 };

typedef struct chain {
    kt_body body[LINKS];
    kt_effect effect[2 * LINKS];
    kt_loop rope;
    char name[LINKS][8];
    kt_description description;
} chain;

/* Links in a chain or a tree, each revolute or prismatic about any axis, with a stop on one side, perhaps friction that sticks, and perhaps a rope from
 * the last one to the world. */
static void chain_make(chain *c, kt_random *random) {
    int used = 0;
    *c = (chain){.description = kt_description_default()};
    for (int i = 0; i < LINKS; i++) {
        kt_body *body = &c->body[i];
        double axis[3];
        *body = kt_body_default();
        (void)snprintf(c->name[i], sizeof c->name[i], "b%d", i);
        body->name = c->name[i];
        body->parent = i > 0 ? c->name[kt_random_int(random, 0, i - 1)] : NULL;
        body->joint.type = kt_random_int(random, 0, 2) == 0 ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE;
        kt_random_direction(random, 3, axis);
        body->joint.axis = kt_vec3_make(axis[0], axis[1], axis[2]);
        body->joint.at = kt_vec3_make(i > 0 ? 0.5 : 0.0, 0.0, 0.0);
        body->joint.velocity[0] = kt_random_uniform(random, -2.0, 2.0);
        body->mass = kt_random_uniform(random, 0.3, 2.0);
        body->com = kt_vec3_make(kt_random_uniform(random, -0.4, 0.4), kt_random_uniform(random, -0.4, 0.4), 0.2);
        body->inertia.xx = body->inertia.yy = body->inertia.zz = kt_random_uniform(random, 0.05, 0.3);
        kt_effect *effect = &c->effect[used++];
        *effect = kt_effect_default();
        effect->joint = body->name;
        effect->type = KT_EFFECT_JOINT_LIMIT;
        effect->lower = -kt_random_uniform(random, 0.1, 1.0);
        effect->restitution = kt_random_int(random, 0, 2) == 0 ? 0.0 : kt_random_uniform(random, 0.0, 0.9);
    }
    for (int i = 0; i < LINKS && 2 * used - LINKS + 2 < KT_SWITCH_MAX; i++) { /* friction has two switches */
        if (kt_random_int(random, 0, 2) > 0)
            continue;
        kt_effect *effect = &c->effect[used++];
        *effect = kt_effect_default();
        effect->joint = c->body[i].name;
        effect->type = KT_EFFECT_JOINT_FRICTION;
        effect->coulomb = kt_random_uniform(random, 0.2, 2.0);
        effect->breakaway = effect->coulomb * kt_random_uniform(random, 1.0, 1.5);
        effect->stick = true;
    }
    c->rope = kt_loop_default();
    c->rope.name = "rope";
    c->rope.type = KT_LOOP_DISTANCE;
    c->rope.slack = true;
    c->rope.between[0].at = kt_vec3_make(0.3, 0.2, 2.0);
    c->rope.between[1] = (kt_end){.body = c->name[LINKS - 1], .at = kt_vec3_make(0.2, 0.0, 0.0)};
    c->rope.function = kt_function_constant(4.0);
    c->description.gravity = kt_vec3_make(0.0, 0.0, -g);
    c->description.bodies = c->body;
    c->description.body_count = LINKS;
    c->description.effects = c->effect;
    c->description.effect_count = used;
    c->description.loops = &c->rope;
    c->description.loop_count = 2 * used - LINKS < KT_SWITCH_MAX && kt_random_int(random, 0, 1) == 0;
}

/* No stop is passed, energy stays, and chains of events end. KT_CONTACTS, or 20. */
KT_TEST(random_mechanisms_keep_their_bounds_and_their_energy) {
    kt_random random = kt_random_named("contacts");
    const char *asked = getenv("KT_CONTACTS");
    const int count = asked != NULL ? atoi(asked) : 20;
    double deepest = 0.0, drift = 0.0;
    unsigned long long impacts = 0;
    int failed = 0;
    for (int n = 0; n < count; n++) {
        chain c;
        chain_make(&c, &random);
        kt_model *model = kt_scene_compile(&c.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
        kt_error error = {0};
        const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
        kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
        for (int k = 1; status == KT_OK && k <= 300; k++) {
            status = kt_simulation_advance(simulation, 0.01 * k, &error);
            for (int i = 0; i < LINKS; i++) {
                const int at = kt_body_coordinates(model, kt_body_find(model, c.name[i])).q;
                deepest = fmax(deepest, c.effect[i].lower - kt_simulation_positions(simulation)[at]);
            }
        }
        if (status != KT_OK) {
            kt_note("mechanism %d: %s: %s", n, error.where, error.message);
            failed++;
        } else {
            drift = fmax(drift, fabs(kt_scene_balance(simulation) - energy));
            impacts += kt_simulation_contacts(simulation).impacts;
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
    kt_note("%llu impacts", impacts);
    kt_check_equal_int("failed", failed, 0);
    kt_check_below("beyond a stop, rad or m", deepest, 1e-14);
    kt_check_below("drift of the balance, J", drift, 1e-8);
}
