/* Hard stops, contacts and slack ropes in mechanisms: loops, rocking, ropes, a whip, and random chains with friction
 * that sticks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/scenes.h"
#include "whip.h"

static const double g = 9.81, pi = 3.14159265358979323846;

/* ---- in mechanisms ----------------------------------------------------------------------------------------------- */

/* A parallelogram of cranks whose coupler is pinned: one degree of freedom, which a stop turns back: -e times all
 * rates. */
KT_TEST(stop_in_a_loop_turns_all_rates_back) {
    const double e = 0.6;
    kt_body body[3];
    kt_loop pin = kt_loop_default();
    kt_effect stop = kt_effect_default();
    static const char *const names[3] = {"crank", "coupler", "rocker"};
    for (int i = 0; i < 3; i++) {
        body[i] = kt_body_of(names[i], NULL, KT_JOINT_REVOLUTE, 1.0 + i);
        body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
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
    kt_description d = kt_description_of(body, 3, &pin, 1, &stop, 1);
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = kt_scene_start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    double before[3] = {0.0, 0.0, 0.0};
    kt_status status = KT_OK;
    const double energy = kt_scene_balance(simulation);
    while (status == KT_OK && kt_simulation_contacts(simulation).impacts == 0 && kt_simulation_time(simulation) < 5.0) {
        memcpy(before, kt_simulation_velocities(simulation), sizeof before);
        status = kt_simulation_step(simulation, kt_simulation_time(simulation) + 1e-4, &error);
    }
    kt_need_fine("runs", status, &error);
    const double *v = kt_simulation_velocities(simulation);
    kt_check_equal_int("one impact", (long long)kt_simulation_contacts(simulation).impacts, 1);
    kt_check_near("at the stop", kt_simulation_positions(simulation)[1], -1.5, 1e-12);
    for (int i = 0; i < 3; i++)
        kt_check_near("rate, over that of a step before", v[i] / before[i], -e, 1e-5);
    kt_check_near("ratio of rates stays", v[0] / v[1] - before[0] / before[1], 0.0, 1e-3);
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-12);
    kt_record record = {0};
    kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
    kt_check_near("lost, of what is left", kt_simulation_contacts(simulation).dissipated / record.kinetic,
                  1.0 / (e * e) - 1.0, 1e-13);
}

/* A block on two corners without friction: its centre falls straight down. With half width b, when a corner lands while
 * the block turns at w about the other,
 *     w+ = w (I - m b^2) / (I + m b^2)
 * and the other leaves (Housner's block, whose corners do not slide, has I + m h^2 in place of I). */
KT_TEST(rocking_block_keeps_the_part_of_its_rate_that_it_must) {
    const double b = 0.2, h = 0.6, m = 2.0, inertia = 0.5, tilt = 0.1;
    kt_effect corner[2];
    kt_description d = kt_description_default();
    kt_body block = kt_body_of("block", NULL, KT_JOINT_PLANAR, m);
    block.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    block.inertia.xx = block.inertia.yy = block.inertia.zz = inertia;
    block.joint.position[1] = h * cos(tilt) + b * sin(tilt);
    block.joint.position[2] = tilt;
    for (int i = 0; i < 2; i++) {
        corner[i] = kt_effect_of(KT_EFFECT_CONTACT, NULL);
        corner[i].name = i == 0 ? "left" : "right";
        corner[i].between[0] = (kt_end){.body = "block", .at = kt_vec3_make(i == 0 ? -b : b, -h, 0.0)};
        corner[i].axis = kt_vec3_make(0.0, 1.0, 0.0);
        corner[i].restitution = 0.0;
    }
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    kt_describe(&d, &block, 1, NULL, 0, corner, 2);
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = kt_scene_start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_status status = KT_OK;
    const double energy = kt_scene_balance(simulation);
    double fell = 0.0;
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
        kt_check_near("flat", kt_simulation_positions(simulation)[2], 0.0, 1e-12);
        kt_check_near("energy left", behind / before, ratio * ratio, 1e-14);
        kt_check_near("moves about the other corner", v[1], (impact % 2 == 1 ? -b : b) * v[2], 1e-13);
        kt_check_equal_int("stands on it", (long long)kt_switch_set(kt_simulation_model(simulation)),
                           impact % 2 == 1 ? 2 : 1);
    }
    kt_need_fine("runs", status, &error);
    kt_check_near("it does not slide", kt_simulation_positions(simulation)[0], 0.0, 1e-14);
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-12);
}

/* A stone on a rope of length L, with the speed v0 at the lowest point. The rope is slack from the angle a above the
 * horizontal. There g L sin a = v^2, and v^2 = v0^2 - 2 g L (1 + sin a). It stays slack for 4 v cos a / g, and becomes
 * taut plastically. */
KT_TEST(slack_pendulum_flies_and_is_caught) {
    const double L = 1.3, v0 = sqrt(3.7 * g * L), s = (v0 * v0 / (g * L) - 2.0) / 3.0, c = sqrt(1.0 - s * s);
    const double v = sqrt(g * L * s), flight = 4.0 * v * c / g;
    kt_description d = kt_description_default();
    kt_body stone = kt_body_of("stone", NULL, KT_JOINT_PLANAR, 1.0);
    stone.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    stone.inertia.xx = stone.inertia.yy = stone.inertia.zz = 0.1;
    stone.joint.position[1] = -L;
    stone.joint.velocity[0] = v0;
    kt_loop rope = kt_loop_of("rope", KT_LOOP_DISTANCE);
    rope.between[1].body = "stone";
    rope.function = kt_function_constant(L);
    rope.slack = true;
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    kt_describe(&d, &stone, 1, &rope, 1, NULL, 0);
    kt_model *model = kt_scene_compile(&d);
    kt_simulation *simulation = kt_scene_start(model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    kt_status status = KT_OK;
    const double energy = kt_scene_balance(simulation);
    while (status == KT_OK && kt_simulation_contacts(simulation).openings == 0 && kt_simulation_time(simulation) < 5.0)
        status = kt_simulation_step(simulation, 5.0, &error);
    kt_need_fine("swings", status, &error);
    const double *q = kt_simulation_positions(simulation), *w = kt_simulation_velocities(simulation);
    const double from = kt_simulation_time(simulation);
    kt_check_near("slack at x", q[0], L * c, 1e-13);
    kt_check_near("slack at y", q[1], L * s, 1e-13);
    kt_check_near("speed", hypot(w[0], w[1]), v, 1e-12);
    while (status == KT_OK && kt_simulation_contacts(simulation).closings < 2 && kt_simulation_time(simulation) < 5.0)
        status = kt_simulation_step(simulation, 5.0, &error);
    (void)kt_fine("flies", status, &error);
    const double x = L * c - v * s * flight, y = L * s + v * c * flight - 0.5 * g * flight * flight;
    const double vx = -v * s, vy = v * c - g * flight, radial = (x * vx + y * vy) / L;
    kt_check_near("taut after, s", kt_simulation_time(simulation) - from, flight, 1e-13);
    kt_check_near("at x", q[0], x, 1e-12);
    kt_check_near("velocity x", w[0], vx - radial * x / L, 1e-11);
    kt_check_near("velocity y", w[1], vy - radial * y / L, 1e-11);
    kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, 0.5 * radial * radial, 1e-11);
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-11);
}

/* ---- a whip ------------------------------------------------------------------------------------------------------ */

/* The rope is first taut when the tip of a whip without it, by another method, is as far away as the rope is long.
 * After that the tip is never farther away. The energy dissipated in impacts equals the missing energy. */
KT_TEST(whip_with_a_slack_end_is_caught) {
    kt_whip w;
    kt_error error = {0};
    kt_simulation *simulation[2];
    kt_model *model[2];
    for (int i = 0; i < 2; i++) {
        kt_whip_make(&w, 0.3, i == 0);
        model[i] = kt_scene_compile(&w.description);
        simulation[i] =
            kt_scene_start(model[i], i == 0 ? "dopri5" : "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    }
    const double energy = kt_scene_balance(simulation[0]);
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation[0]).impacts == 0 &&
           kt_simulation_time(simulation[0]) < 1.0)
        status = kt_simulation_step(simulation[0], 1.0, &error);
    kt_need_fine("falls", status, &error);
    const double t = kt_simulation_time(simulation[0]);
    kt_check_equal_int("taut", (long long)kt_simulation_contacts(simulation[0]).impacts, 1);
    kt_test_advance(simulation[1], t);
    kt_check_near("longer than it, m", kt_whip_stretch(kt_simulation_positions(simulation[1])), 0.0, 1e-12);
    double most = 0.0;
    for (int k = 1; status == KT_OK && k <= 40; k++) {
        status = kt_simulation_advance(simulation[0], t + 0.001 * k, &error);
        most = fmax(most, kt_whip_stretch(kt_simulation_positions(simulation[0])));
    }
    (void)kt_fine("is caught", status, &error);
    const kt_contact_counts counts = kt_simulation_contacts(simulation[0]);
    kt_note("%d impacts, closed %d times, %.3g J lost", (int)counts.impacts, (int)counts.closings, counts.dissipated);
    kt_check_below("beyond its length, m", most, 1e-13);
    kt_check_near("balance, J", kt_scene_balance(simulation[0]), energy, 1e-12);
    for (int i = 0; i < 2; i++) {
    }
}
