/* How contacts come to rest: bounces of hard stops and their largest number, slip of light feet, boxes, and blocks that
 * rock. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/parsed.h"
#include "motion/simulation/scenes.h"

static const double g = 9.81;

static void add_stop(kt_lone *lone, kt_effect *stop, double lower, double restitution) {
    *stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, lone->body.name);
    stop->lower = lower;
    stop->restitution = restitution;
    lone->description.effects = stop;
    lone->description.effect_count = 1;
}

/* A finger that is pressed against a stop bounces in ever lower jumps, at last lower than the rounding of where the
 * stop is. It rests from there on, and the work on the finger equals the lost energy. Speeds shrink by e, from the
 * first down to the rest velocity or sqrt(2 a 16 eps x). */
KT_TEST(pressed_finger_comes_to_rest_on_a_stop_anywhere) {
    static const char *const methods[] = {"dopri5", "rk4", "radau5", NULL};
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("place, relative"), energy = kt_worst_make("work that is not lost, relative");
    int late = 0, more = 0;
    for (int run = 0; run < 200; run++) {
        const double a = pow(10.0, kt_random_uniform(&random, 0.0, 6.0)), e = kt_random_uniform(&random, 0.0, 0.9);
        const double x = pow(10.0, kt_random_uniform(&random, -3.0, 4.0)), way = kt_random_uniform(&random, 0.01, 0.5);
        const double v = sqrt(2.0 * a * way), stop = 2.0 * v / a * (1.0 + e) / (1.0 - e);
        const double rest = fmax(1e-6, sqrt(2.0 * a * 16.0 * DBL_EPSILON * x));
        const int count = e > 0.0 ? (int)ceil(log(rest / v) / log(e)) + 1 : 1;
        kt_lone r;
        kt_effect limit;
        kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
        add_stop(&r, &limit, x, e);
        r.body.joint.position[0] = x + way;
        kt_model *model = kt_scene_compile(&r.description);
        kt_simulation *simulation =
            kt_scene_start(model, methods[run % 4], run % 4 == 1 ? 0.1 * v / a : 0.0, KT_RECORD_BALANCE);
        kt_error error = {0};
        kt_status status = KT_OK;
        if (status == KT_OK)
            status = kt_simulation_set_torque(simulation, &(double){-a}, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(simulation, stop, &error);
        kt_need_fine("runs", status, &error);
        const kt_contact_counts counts = kt_simulation_contacts(simulation);
        kt_worst_near(&place, kt_simulation_positions(simulation)[0] / (x + way), x / (x + way), 8.0 * DBL_EPSILON,
                      "run %d", run);
        kt_worst_near(&energy, counts.dissipated / (a * way), 1.0, 1e-8, "run %d: a %g x %g e %g", run, a, x, e);
        late += counts.closings != 1 || kt_simulation_velocities(simulation)[0] != 0.0;
        more += (int)counts.impacts > count;
    }
    kt_check_below("fingers that do not rest", late, 0.0);
    kt_check_below("fingers with more impacts than until rest", more, 0.0);
}

/* Lets a ball bounce with fixed steps until it rests. *late: the time by which it rests after its Zeno point, over the
 * length of a step. Returns the number of impacts above the number that the rule permits. */
static int rest_ball(double a, double e, double way, double step, kt_worst *place, kt_worst *energy, double *late) {
    const double v = sqrt(2.0 * a * way), zeno = v / a * (1.0 + e) / (1.0 - e);
    const int unresolved = (int)ceil(log(step * a * (1.0 - e) / (2.0 * v)) / log(e));
    kt_lone r;
    kt_effect limit;
    kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
    add_stop(&r, &limit, 0.0, e);
    r.body.joint.position[0] = way;
    r.description.gravity = kt_vec3_make(-a, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "rk4", step, KT_RECORD_BALANCE);
    kt_error error = {0};
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation).closings == 0 &&
           kt_simulation_time(simulation) < 2.0 * zeno)
        status = kt_simulation_step(simulation, 2.0 * zeno, &error);
    const kt_contact_counts counts = kt_simulation_contacts(simulation);
    kt_need_fine("runs", status, &error);
    *late = (kt_simulation_time(simulation) - zeno) / step;
    kt_worst_near(place, kt_simulation_positions(simulation)[0], 0.0, 1e-15, "e %g", e);
    kt_worst_near(energy, counts.dissipated / (a * way), 1.0, 1e-11, "e %g", e);
    return (int)counts.impacts - unresolved - 2 * 16 - 1;
}

/* Behind 16 instants of events within a fixed step, bounces that end within its length are not resolved. So the ball
 * rests up to a step before its Zeno point. It has lost all of its energy all the same. Two lengths of a step may hold
 * the last bounces that are longer. */
KT_TEST(bounces_that_a_fixed_step_does_not_resolve_end) {
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("place, m"), energy = kt_worst_make("energy that is not lost, relative");
    double first = 0.0, last = -HUGE_VAL;
    int more = -1000;
    for (int i = 0; i < 100; i++) {
        const double a = pow(10.0, kt_random_uniform(&random, 0.0, 3.0)), e = kt_random_uniform(&random, 0.9, 0.97);
        double late = (double)NAN;
        const int impacts = rest_ball(a, e, kt_random_uniform(&random, 0.01, 0.1), 1e-3, &place, &energy, &late);
        more = impacts > more ? impacts : more;
        first = fmin(first, late);
        last = fmax(last, late);
    }
    kt_check_above("earliest rest, steps after the Zeno point", first, -1.0);
    kt_check_above("latest rest, steps before it", -last, 0.0);
    kt_check_below("impacts above those that are resolved", fmax(more, 0.0), 0.5);
}

/* A ball above a plate that moves at the speed w. Relative to the plate, it falls from rest at the height h, or faster.
 */
static kt_model *compile_ball_on_plate(double h, double w, double e, double rest) {
    const kt_term terms[2] = {{.joint = "ball", .coefficient = 1.0}, {.joint = "plate", .coefficient = -1.0}};
    const double motion[2] = {0.0, w};
    kt_body body[2] = {kt_body_default(), kt_body_default()};
    kt_loop loop[2];
    kt_description description = kt_description_default();
    for (int i = 0; i < 2; i++) {
        body[i].name = i == 0 ? "ball" : "plate";
        body[i].joint.type = KT_JOINT_PRISMATIC;
        body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        body[i].mass = 1.0;
    }
    body[0].joint.position[0] = h;
    body[1].joint.velocity[0] = w;
    loop[0] = kt_loop_of("drive", KT_LOOP_MOTION);
    loop[0].joint = "plate";
    loop[0].function = kt_function_polynomial(motion, 2);
    loop[1] = kt_loop_of("touch", KT_LOOP_COUPLING);
    loop[1].side = KT_SIDE_ABOVE;
    loop[1].terms = terms;
    loop[1].term_count = 2;
    loop[1].restitution = e;
    loop[1].rest_velocity = rest;
    description.gravity = kt_vec3_make(0.0, 0.0, -g);
    kt_describe(&description, body, 2, loop, 2, NULL, 0);
    return kt_scene_compile(&description);
}

/* The last bounce of a ball may be slower than its rest velocity. The ball is then held on the plate, and the energy of
 * this bounce is dissipated, too. All together dissipate the energy relative to the plate, m g h + m w^2 / 2. So does
 * the balance, whose supply is that of the plate. Unless held energy counts, up to 24 % of it are missing. */
KT_TEST(bounces_that_are_held_dissipate_their_energy) {
    static const char *const methods[] = {"dopri5", "rk4", "radau5"};
    kt_random random = kt_random_of_test();
    KT_WORST counted = kt_worst_make("dissipated by contacts, relative");
    KT_WORST work = kt_worst_make("dissipated in the balance, relative");
    int held = 0, late = 0;
    for (int i = 0; i < 60; i++) {
        const double h = kt_random_uniform(&random, 0.1, 1.0), e = kt_random_uniform(&random, 0.3, 0.7);
        const double w = i % 2 == 0 ? 0.0 : kt_random_uniform(&random, -1.0, 1.0);
        const double speed = sqrt(2.0 * g * h + w * w), rest = kt_random_uniform(&random, 0.1, 0.5) * speed;
        const double all = 0.5 * speed * speed, last = speed * pow(e, floor(log(rest / speed) / log(e)) + 1.0);
        kt_model *model = compile_ball_on_plate(h, w, e, rest);
        kt_simulation *simulation = kt_scene_start(model, methods[i % 3], i % 3 == 1 ? 1e-3 : 0.0, KT_RECORD_BALANCE);
        kt_error error = {0};
        const kt_status status = kt_simulation_advance(simulation, 6.0, &error);
        kt_need_fine("runs", status, &error);
        const kt_contact_counts counts = kt_simulation_contacts(simulation);
        kt_worst_near(&counted, counts.dissipated / all, 1.0, 1e-12, "run %d: e %g w %g", i, e, w);
        kt_worst_near(&work, kt_simulation_work(simulation).dissipated / all, 1.0, 1e-12, "run %d: w %g", i, w);
        late += counts.closings != 1;
        held += last > 0.1 * rest;
    }
    kt_check_equal_int("balls that do not rest", late, 0);
    kt_check_above("balls that are held", held, 50.0);
}

/* The cost of a step has a bound. A ball that bounces more than 10,000 times within one step causes an error with the
 * name of its event. */
KT_TEST(bounces_within_a_step_have_a_limit) {
    kt_lone r;
    kt_effect limit;
    kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
    add_stop(&r, &limit, 0.0, 1.0);
    limit.name = "anvil";
    r.body.joint.position[0] = 1e-6;
    r.description.gravity = kt_vec3_make(-g, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = kt_scene_start(model, "rk4", 50.0, 0);
    kt_error error = {0};
    kt_check_true("ends", kt_simulation_advance(simulation, 50.0, &error) == KT_ERROR_STEP);
    kt_check_contains("words", error.message, "10000 instants of events lie within 50 s");
    kt_check_contains("words", error.message, "larger rest_velocity");
    kt_check_contains("where", error.where, "event 'anvil.lower' at t = ");
}

/* Each call has this limit for itself: a control loop goes on after 10,000 bounces. In one call, the limit counts those
 * within a thousandth of the run, 50 s, whatever the interval between records. */
KT_TEST(limit_of_bounces_is_that_of_a_tick) {
    kt_lone r;
    kt_effect limit;
    kt_run run = kt_run_fixed("dopri5", 0.0, 50000.0);
    kt_simulation_options options = kt_simulation_options_default();
    kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
    add_stop(&r, &limit, 0.0, 1.0);
    r.body.joint.position[0] = 1e-6;
    r.description.gravity = kt_vec3_make(-g, 0.0, 0.0);
    run.interval = 1.0;
    const double flight = 2.0 * sqrt(2e-6 / g), time = 12.0;
    kt_model *model = kt_scene_compile(&r.description);
    for (int ticks = 1; ticks <= 12; ticks += 11) {
        kt_simulation *simulation = kt_test_simulation(model, &run, &options);
        kt_error error = {0};
        kt_status status = KT_OK;
        for (int i = 0; status == KT_OK && i < ticks; i++)
            status = kt_simulation_tick(simulation, time / ticks, &error);
        kt_check_equal_int("status", status, ticks == 1 ? KT_ERROR_STEP : KT_OK);
        if (status == KT_OK)
            kt_check_near("impacts", (double)kt_simulation_contacts(simulation).impacts, time / flight, 1.0);
    }
}

/* A call takes no more steps than its options allow, accepted and rejected together. It fails with the name of the
 * contact, and the next call goes on. If a call may take one step, its first step takes all its tries: calls arrive. */
static void limit_calls(const kt_model *model, const char *method, double step, uint64_t most) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    options.steps_per_call = most;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_error error = {0};
    int used_up = 0, named = 0, others = 0;
    uint64_t worst = 0, steps = 0, calls = 0;
    for (int tick = 1; others == 0 && tick <= 40 && calls < 10000; calls++) {
        const kt_status status = kt_simulation_advance(simulation, 0.01 * tick, &error);
        const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
        worst = counts.steps + counts.rejected - steps > worst ? counts.steps + counts.rejected - steps : worst;
        steps = counts.steps + counts.rejected;
        used_up += status == KT_ERROR_STEP;
        named += status == KT_ERROR_STEP && strstr(error.message, "contact 'anvil.lower'") != NULL;
        others += status != KT_OK && (status != KT_ERROR_STEP || strstr(error.message, "steps_per_call") == NULL);
        tick += status == KT_OK;
    }
    kt_check_below("steps of a call", (double)worst, most > 1 ? (double)most + 0.5 : 24.0);
    kt_check_above("calls that fail", used_up, 0.0);
    if (most > 1)
        kt_check_equal_int("of them name the contact", named, used_up);
    kt_check_equal_int("other failures", others, 0);
    kt_check_near("reached, s", kt_simulation_time(simulation), 0.4, 1e-15);
}

KT_TEST(steps_of_a_call_have_the_limit_of_the_options) {
    static const char *const methods[] = {"rk4", "dopri5", "radau5", "heun"};
    kt_lone r;
    kt_effect limit;
    kt_lone_make(&r, KT_JOINT_PRISMATIC, 1.0);
    add_stop(&r, &limit, 0.0, 0.9);
    limit.name = "anvil";
    r.body.joint.position[0] = 1e-3;
    r.description.gravity = kt_vec3_make(-g, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&r.description);
    for (int i = 0; i < 4; i++)
        for (uint64_t most = 1; most <= 24; most += 23)
            limit_calls(model, methods[i], i % 3 == 0 ? 1e-3 : 0.0, most);
}

/* Three sliders whose coordinates add up to a gap. The first one moves towards the stop from q, the second one cancels
 * the place of the stop, and the third one is `below`, a part of the rounding of the first one. */
typedef struct slow_gap {
    kt_body body[3];
    kt_term term[3];
    kt_loop loop;
    kt_description description;
} slow_gap;

static void make_slow_gap(slow_gap *s, double q, double v, double stop, double below, double restitution) {
    static const char *const names[] = {"first", "second", "third"};
    const double position[] = {q, -stop, below};
    *s = (slow_gap){.loop = kt_loop_default(), .description = kt_description_default()};
    for (int i = 0; i < 3; i++) {
        s->body[i] = kt_body_of(names[i], NULL, KT_JOINT_PRISMATIC, 1.0);
        s->body[i].joint.position[0] = position[i];
        s->term[i] = (kt_term){.joint = names[i], .coefficient = 1.0};
    }
    s->body[0].joint.velocity[0] = v;
    s->loop.name = "gap";
    s->loop.type = KT_LOOP_COUPLING;
    s->loop.side = KT_SIDE_ABOVE;
    s->loop.restitution = restitution;
    s->loop.terms = s->term;
    s->loop.term_count = 3;
    s->description.bodies = s->body;
    s->description.body_count = 3;
    s->description.loops = &s->loop;
    s->description.loop_count = 1;
    s->description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
}

/* A tick ends at a gap that is smaller than the rounding of a position. Steps up to the impact do not change that
 * position, so that the gap does not close along them. The impact happens all the same. It gives each slider the
 * impulse (1 + e) v / 3. */
KT_TEST(impacts_within_the_rounding_of_a_position_happen) {
    static const struct {
        const char *method;
        double step;
    } ways[] = {{"dopri5", 0.0}, {"radau5", 0.0}, {"heun", 0.0}, {"rk4", 1e-3}};
    const double v = -0.3, stop = 0.9, e = 0.4, ulp = DBL_EPSILON / 2.0;
    KT_WORST place = kt_worst_make("place after two ticks, m");
    int wrong = 0, next = 0;
    for (int i = 0; i < 160; i++) {
        slow_gap s;
        make_slow_gap(&s, stop - 1e-3 * v + (i / 4 % 10 - 5) * ulp, v, stop, 0.2 * (i / 40 + 1) * ulp, e);
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = kt_scene_start(model, ways[i % 4].method, ways[i % 4].step, 0);
        kt_error error = {0};
        kt_status status = kt_simulation_tick(simulation, 1e-3, &error);
        next += status == KT_OK && kt_simulation_contacts(simulation).impacts == 0;
        if (status == KT_OK)
            status = kt_simulation_tick(simulation, 1e-3, &error);
        kt_need_fine("runs", status, &error);
        wrong += kt_simulation_contacts(simulation).impacts != 1;
        kt_worst_near(&place, kt_simulation_positions(simulation)[0], stop + 1e-3 * v * (1.0 - (1.0 + e) / 3.0), 1e-14,
                      "run %d", i);
        kt_worst_near(&place, kt_simulation_positions(simulation)[1], -stop - 1e-3 * v * (1.0 + e) / 3.0, 1e-14,
                      "run %d", i);
    }
    kt_check_equal_int("runs without one impact", wrong, 0);
    kt_check_above("ticks that end before the impact", next, 20.0);
}

/* Two sliders that touch move on together, far from the origin, and part more slowly than the rest velocity. At first
 * their gap is smaller than the rounding of their positions, whose sign changes. The contact does not close again. A
 * step rounds each of two positions by half a rounding at most. */
KT_TEST(slow_parting_is_not_ended_by_rounding) {
    static const char *const methods[] = {"rk4", "heun", "dopri5"};
    kt_random random = kt_random_of_test();
    KT_WORST gap = kt_worst_make("gap, in roundings of the position");
    uint64_t most = 0;
    for (int i = 0; i < 80; i++) {
        const double x = kt_random_uniform(&random, 1e3, 1e5), v = kt_random_uniform(&random, 0.5, 2.0);
        const double u = pow(10.0, kt_random_uniform(&random, -8.5, -7.0)), step = 1e-4;
        slow_gap s;
        make_slow_gap(&s, x, v + u, x, 0.0, 0.0);
        s.body[1].joint.velocity[0] = -v;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = kt_scene_start(model, methods[i % 3], step, 0);
        kt_error error = {0};
        const kt_status status = kt_simulation_advance(simulation, 200.0 * step, &error);
        kt_need_fine("runs", status, &error);
        const double *q = kt_simulation_positions(simulation);
        const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
        kt_worst_near(&gap, (q[0] + q[1]) / (x * DBL_EPSILON), 200.0 * step * u / (x * DBL_EPSILON), 200.0, "run %d",
                      i);
        most = counts.steps + counts.rejected > most ? counts.steps + counts.rejected : most;
    }
    kt_check_below("steps", (double)most, 205.0);
}

static int add_forces(const kt_record *record, void *user) {
    double *N = user;
    *N = fabs(record->loop_reactions[0].force.z + record->loop_reactions[2].force.z);
    return 0;
}

/* A block on two slides rocks on a rough floor until it rests flat. Its weight acts on the vertical slide alone. The
 * horizontal one then carries the roundings of friction alone, which Newton's law of the records must not take for
 * forces. */
KT_TEST(block_on_slides_rocks_until_it_rests) {
    kt_random random = kt_random_of_test();
    KT_WORST weight = kt_worst_make("normal forces, part of the weight"), lean = kt_worst_make("lean, rad");
    for (int i = 0; i < 30; i++) {
        char text[2048];
        kt_parsed m;
        kt_error error = {0};
        double N = 0.0;
        const double mass = pow(10.0, kt_random_uniform(&random, -6.0, 6.0)),
                     to = kt_random_uniform(&random, 0.02, 0.2);
        const double a = 0.2, b = 0.4, inertia = mass * (a * a + b * b) / 3.0;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: cart, mass: 0, joint: {type: prismatic, axis: x}}\n"
                       "  - {name: lift, parent: cart, mass: 0, joint: {type: prismatic, axis: z, position: %.17g}}\n"
                       "  - {name: block, parent: lift, mass: %.17g, inertia: [%.17g, %.17g, %.17g],\n"
                       "     markers: {left: [%g, 0, %g], right: [%g, 0, %g]},\n"
                       "     joint: {type: revolute, axis: y, position: %.17g}}\n"
                       "effects:\n"
                       "  - {name: l, type: contact, point: block.left, radius: 0, plane: world, restitution: 0, "
                       "friction: 1}\n"
                       "  - {name: r, type: contact, point: block.right, radius: 0, plane: world, restitution: 0, "
                       "friction: 1}\n",
                       a * sin(to) + b * cos(to), mass, inertia, inertia, inertia, -a, -b, a, -b, to);
        kt_parsed_make(&m, text);
        kt_run run = kt_run_within("dopri5", 1e-9, 2.0);
        run.interval = 1e-3;
        run.record = KT_RECORD_REACTION;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        kt_need_fine("runs", kt_simulation_run(simulation, add_forces, &N, &error), &error);
        kt_worst_near(&weight, N / (mass * g), 1.0, 1e-9, "block %d", i);
        kt_worst_near(&lean, kt_simulation_positions(simulation)[2], 0.0, 1e-13, "block %d", i);
    }
}

/* A box turns about a foot that sticks. Two feet on a diagonal carry it, below its centre of mass. So it may tilt on
 * the diagonal, at first more slowly than the rest velocity. The foot that sinks must close, however slowly it sinks.
 * A fixed step might take it for far from its event, because its gap hardly changes in a step. */
KT_TEST(foot_that_sinks_slowly_closes) {
    static const double rates[] = {1e-9, 1e-8, -1e-8, 1e-7}; /* rad/s, about x */
    static const char *const methods[] = {"rk4", "heun", "dopri5"};
    const double a = 0.126, b = 0.168, c = 0.104, w = 1.3, friction[] = {0.8, 0.0, 0.3, 0.3};
    KT_WORST deep = kt_worst_make("depth, m");
    for (size_t i = 0; i < 12; i++) {
        char text[2048];
        kt_parsed m;
        kt_error error = {0};
        int n = snprintf(text, sizeof text,
                         "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                         "  - {name: box, mass: 0.22, shape: {type: box, size: [%g, %g, %g]},\n"
                         "     markers: {m0: [%g, %g, %g], m1: [%g, %g, %g], m2: [%g, %g, %g], m3: [%g, %g, %g]},\n"
                         "     joint: {type: free, position: {position: [0, 0, %g]},\n"
                         "             velocity: {linear: [%.17g, %.17g, 0], angular: [%g, 0, %g]}}}\neffects:\n",
                         2.0 * a, 2.0 * b, 2.0 * c, -a, -b, -c, a, -b, -c, -a, b, -c, a, b, -c, c, w * b, w * a,
                         rates[i % 4], w);
        for (int k = 0; k < 4; k++)
            n += snprintf(text + n, sizeof text - (size_t)n,
                          "  - {name: f%d, type: contact, point: box.m%d, radius: 0, plane: world, restitution: 0, "
                          "friction: %g}\n",
                          k, k, friction[k]);
        kt_parsed_make(&m, text);
        const kt_run run = kt_run_fixed(methods[i / 4], 1e-3, 4.0);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        for (int tick = 1; tick <= 40; tick++) {
            kt_record record = {0};
            kt_need_fine("runs", kt_simulation_advance(simulation, 0.1 * tick, &error), &error);
            kt_need_fine("record", kt_simulation_sense(simulation, &record, &error), &error);
            const double *q = record.q; /* a vertical tilt of the box by 2 |(qx, qy)|, and its height */
            kt_worst_near(&deep, q[2] - c, 0.0, 1e-10, "%s, %g rad/s", methods[i / 4], rates[i % 4]);
            kt_worst_near(&deep, 2.0 * hypot(a, b) * hypot(q[4], q[5]), 0.0, 1e-10, "%s, %g rad/s", methods[i / 4],
                          rates[i % 4]);
        }
    }
}

/* A frame on two legs falls over. Dry friction holds one leg. When its foot is pressed to the floor, friction of the
 * joint in either direction turns the joint back at once (Painleve's paradox). Such reversals have no end, and a time
 * step replaces the rest of the fixed step. */
KT_TEST(joint_that_reverses_without_end_is_left_to_a_time_step) {
    static const double steps[] = {0.9e-3, 1e-3, 2e-3};
    for (int i = 0; i < 3; i++) {
        kt_parsed m;
        kt_error error = {0};
        kt_parsed_make(&m,
                       "kinetree: 1\ngravity: [-1.458, 0, -9.81]\nbodies:\n"
                       "  - {name: frame, mass: 24.463219113933246,\n"
                       "     shape: {type: box, size: [0.530664226242856, 0.44350905639788873, 0.7694785353824527]},\n"
                       "     joint: {type: free, position: {position: [0, 0, 1.057301174494897]},\n"
                       "             velocity: {linear: [0.6903, -0.221, 0], angular: [1.7133, -1.4706, -0.0313]}}}\n"
                       "  - {name: a, parent: frame, mass: 2.4463219113933246, com: [0, 0, -0.2],\n"
                       "     inertia: [0.04892643822786649, 0.04892643822786649, 0.0024463219113933245],\n"
                       "     markers: {tip: [0, 0, -0.45]},\n"
                       "     joint: {type: revolute, axis: x, at: [-0.265332113121428, -0.22175452819894437, "
                       "-0.19236963384561317], position: -0.4689}}\n"
                       "  - {name: b, parent: frame, mass: 2.4463219113933246, com: [0, 0, -0.2],\n"
                       "     inertia: [0.04892643822786649, 0.04892643822786649, 0.0024463219113933245],\n"
                       "     markers: {tip: [0, 0, -0.45]},\n"
                       "     joint: {type: revolute, axis: y, at: [0.265332113121428, -0.22175452819894437, "
                       "-0.19236963384561317], position: -0.3331}}\n"
                       "effects:\n"
                       "  - {name: foot_a, type: contact, point: a.tip, radius: 0, plane: world, restitution: 0.3, "
                       "friction: 0.1}\n"
                       "  - {name: spring, type: joint_spring, joint: a, stiffness: 978.5287645573299, damping: "
                       "48.92643822786649}\n"
                       "  - {name: foot_b, type: contact, point: b.tip, radius: 0, plane: world, restitution: 0.3, "
                       "friction: 0.5}\n"
                       "  - {name: dry, type: joint_friction, joint: b, coulomb: 23.53438966403953, stick: true}\n");
        const kt_run run = kt_run_fixed("rk4", steps[i], 1.7);
        kt_simulation_options options = kt_simulation_options_default();
        options.stall_evaluations = KT_STALL_EVALUATIONS;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("runs", kt_simulation_advance(simulation, 1.7, &error), &error);
        kt_check_above("completed", (double)kt_simulation_contacts(simulation).completed, 0.5);
    }
}
