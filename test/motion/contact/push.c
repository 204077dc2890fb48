/* Boxes on corners with friction that a growing force pushes from rest: where slip begins, friction turns it at a rate
 * without a bound. The energy balance, the speed after a push through the centre, and the cost of a push beside it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "motion/simulation/parsed.h"

static const double gravity = 9.81, strongest = 0.8, half_height = 0.1, duration = 4.0;

/* A force along x, which grows to 2 `strongest` times the limit of friction in 4 s. */
typedef struct push {
    double mass, friction, height, ahead, beside; /* kg; where it acts, from the middle of the bottom, m */
    int corners;                                  /* 4, or 3: two in front and one behind */
} push;

/* A push that fades: the largest force, as a part of the limit, and the times at which the force has grown, begins to
 * fall, and is 0, s. */
typedef struct fading {
    double part, grown, falls, ends;
} fading;

static double force_of_part(const push *p, double part) { return part * p->friction * p->mass * gravity; }

static double largest_force(const push *p) { return force_of_part(p, 2.0 * strongest); }

/* fades: or NULL. */
static void make_pushed_box(const push *p, const fading *fades, kt_parsed *m) {
    const double largest = fades != NULL ? force_of_part(p, fades->part) : largest_force(p);
    static const char *const behind[] = {"[-0.2, 0, -0.1]", "[-0.2, 0.15, -0.1]", "[-0.2, -0.15, -0.1]"};
    char text[4096];
    size_t used = (size_t)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [0, 0, -%.17g]\nbodies:\n  - name: box\n"
        "    joint: {type: free, position: {position: [0, 0, 0.1]}}\n    mass: %.17g\n"
        "    shape: {type: box, size: [0.4, 0.3, 0.2]}\n    markers:\n      p: [%.17g, %.17g, %.17g]\n"
        "      c0: [0.2, 0.15, -0.1]\n      c1: [0.2, -0.15, -0.1]\n      c2: %s\n      c3: %s\neffects:\n"
        "  - {name: push, type: force, at: box.p, value: [{ramp: {from: 0, to: %.17g, start: 0, end: %.17g}}, 0, 0]}\n",
        gravity, p->mass, p->ahead, p->beside, p->height - half_height, behind[p->corners - 3], behind[2], largest,
        fades != NULL ? fades->grown : duration);
    if (fades != NULL)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: fade, type: force, at: box.p, value: [{ramp: {from: 0, to: %.17g, start: "
                                 "%.17g, end: %.17g}}, 0, 0]}\n",
                                 -largest, fades->falls, fades->ends);
    for (int i = 0; i < p->corners; i++)
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "  - {name: corner%d, type: contact, point: box.c%d, plane: world, restitution: 0, friction: %.17g}\n", i,
            i, p->friction);
    kt_parsed_make(m, text);
}

static void make_box(const push *p, kt_parsed *m) { make_pushed_box(p, NULL, m); }

/* At the end: speed, supplied energy, and how far the balance is from that at the beginning; counts. */
typedef struct outcome {
    double speed, supplied, gain;
    bool ends;
    double steps, holds;
} outcome;

static int take_energies(const kt_record *record, void *user) {
    outcome *o = user;
    const double balance = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    o->gain = record->index == 0 ? -balance : record->t < duration ? o->gain : o->gain + balance;
    o->speed = record->v[0];
    o->supplied = record->work.supplied;
    return 0;
}

static outcome push_box(const push *p, const fading *fades, const char *method, double step) {
    kt_error error = {0};
    kt_parsed m;
    kt_simulation_options options = kt_simulation_options_default();
    outcome o = {.ends = false};
    kt_run run = kt_run_fixed(method, step, duration);
    run.interval = 0.01;
    if (step == 0.0)
        run.relative = run.absolute = 1e-9;
    options.record = KT_RECORD_BALANCE;
    make_pushed_box(p, fades, &m);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    o.ends = kt_fine("runs", kt_simulation_run(simulation, take_energies, &o, &error), &error);
    o.steps = (double)kt_simulation_counts_of(simulation).steps;
    o.holds = (double)kt_simulation_contacts(simulation).rested;
    return o;
}

/* step 0: adaptive. The largest errors of the balance and of the speed are relative. With fixed steps, friction may
 * hold a corner for one step more. `fading` is that of the balance if the push fades: at most five times what was
 * measured. */
typedef struct stepping {
    const char *method;
    double step, balance, speed, fading;
} stepping;

static const stepping steppings[] = {{"rk4", 1e-2, 1e-10, 1e-4, 1.5e-3},  {"rk4", 1e-3, 1e-10, 1e-6, 2e-5},
                                     {"heun", 1e-2, 1e-6, 1e-4, 2e-3},    {"heun", 1e-3, 1e-9, 1e-6, 2e-4},
                                     {"dopri5", 1e-2, 1e-10, 1e-4, 2e-3}, {"dopri5", 1e-3, 1e-10, 1e-6, 2e-4},
                                     {"dopri5", 0.0, 1e-9, 1e-8, 1e-10},  {"auto", 0.0, 1e-9, 1e-8, 4e-9}};
enum { STEPPINGS = sizeof steppings / sizeof *steppings };

/* Boxes of 3 and 4 corners, light and heavy, smooth and rough, that are pushed through the middle at several
 * heights. */
static push variant_of(int k) {
    static const double masses[] = {10.0, 0.3, 400.0}, frictions[] = {0.5, 0.2, 0.9}, heights[] = {0.1, 0.0, 0.15};
    return (push){masses[k % 3], frictions[k / 3 % 3], heights[k / 9 % 3], 0.0, 0.0, 4 - k / 27 % 2};
}
enum { VARIANTS = 54 };

/* The force F = A (3 x^2 - 2 x^3), x = t / T, reaches mu m g at x1. The speed is then that of the integral. */
static double speed_after_push(const push *p) {
    const double A = largest_force(p), limit = p->friction * p->mass * gravity;
    double x = 0.5;
    for (int i = 0; i < 60; i++)
        x -= (x * x * (3.0 - 2.0 * x) - limit / A) / (6.0 * x * (1.0 - x));
    return duration / p->mass * (A * (0.5 - x * x * x + 0.5 * x * x * x * x) - limit * (1.0 - x));
}

/* Friction turns slip at a rate without a bound where it begins, which no fixed step resolves. */
KT_TEST(boxes_that_are_pushed_gain_no_energy) {
    for (int i = 0; i < STEPPINGS; i++) {
        const stepping *s = &steppings[i];
        KT_WORST balance = kt_worst_make("balance, relative"), speed = kt_worst_make("speed, relative");
        kt_note("%s, %g s", s->method, s->step);
        for (int k = 0; k < VARIANTS; k += s->step == 1e-3 ? 5 : 2) {
            const push p = variant_of(k);
            const outcome o = push_box(&p, NULL, s->method, s->step);
            const double expected = speed_after_push(&p);
            kt_worst_below(&balance, fabs(o.gain) / o.supplied, s->balance, "variant %d", k);
            kt_worst_below(&speed, fabs(o.speed / expected - 1.0), s->speed, "variant %d", k);
        }
    }
}

/* A box turns while its push beside the middle grows: a corner next to the centre of the turn hardly slips, and has
 * friction to spare. Holds of corners at rest take some 8 steps each. Without them, each box takes less than 5000
 * steps, but some 90000 if this corner turns at its own rate. The last box changes the corners that carry it while it
 * turns, which fixed steps do not resolve. With present directions at events, it takes 16000 steps. */
KT_TEST(boxes_that_are_pushed_beside_the_middle_take_few_steps) {
    static const push pushes[] = {
        {10.0, 0.5, 0.0, 0.05, 0.1, 4}, {10.0, 0.5, 0.05, -0.1, 0.14, 4}, {10.0, 0.5, 0.02, 0.08187, -0.1329, 4}};
    for (int i = 0; i < STEPPINGS; i++) {
        const stepping *s = &steppings[i];
        KT_WORST balance = kt_worst_make("balance, relative"), steps = kt_worst_make("steps");
        kt_note("%s, %g s", s->method, s->step);
        for (size_t k = 0; k < (s->step > 0.0 ? 2 : sizeof pushes / sizeof *pushes); k++) {
            const outcome o = push_box(&pushes[k], NULL, s->method, s->step);
            const double most = s->step > 0.0 ? 2.0 * duration / s->step : 10000.0 + 8.0 * o.holds;
            kt_worst_below(&balance, o.ends ? fabs(o.gain) / o.supplied : HUGE_VAL, s->speed, "push %zu", k);
            kt_worst_below(&steps, o.steps, most, "push %zu", k);
        }
    }
}

/* A push beside the middle passes the limit of friction shortly, and fades. Slip that ends just below the limit takes
 * many steps. Unless it is predicted, the turn of the box grows there until it is as fast as the slip, and the balance
 * has errors of up to 6e-2. The corners of the last box would part and close thousands of times if events had other
 * directions of slip than accelerations. */
KT_TEST(boxes_that_slip_until_a_push_fades_gain_no_energy) {
    static const push pushes[] = {{400.0, 1.2, 0.0173, 0.0195, 0.0609, 4},
                                  {10.0, 0.2, 0.0726, 0.1631, -0.0926, 3},
                                  {400.0, 1.2, 0.0259, -0.0289, 0.0537, 3},
                                  {10.0, 0.9, 0.0338851581068972, -0.15443483504290795, -0.07944314658473474, 4}};
    static const fading fades[] = {{0.9778, 0.731, 0.785, 1.116},
                                   {0.9529, 0.7223, 0.8588, 1.2401},
                                   {1.4273, 0.8543, 0.9023, 1.3871},
                                   {1.0218113796559076, 0.6409363792553733, 0.6930737862626761, 0.9243840245005538}};
    for (int i = 0; i < STEPPINGS; i++) {
        const stepping *s = &steppings[i];
        KT_WORST balance = kt_worst_make("balance, relative"), speed = kt_worst_make("speed at the end"),
                 steps = kt_worst_make("steps");
        kt_note("%s, %g s", s->method, s->step);
        for (size_t k = 0; k < sizeof pushes / sizeof *pushes; k++) {
            const outcome o = push_box(&pushes[k], &fades[k], s->method, s->step);
            kt_worst_below(&balance, o.ends ? fabs(o.gain) / o.supplied : HUGE_VAL, s->fading, "push %zu", k);
            kt_worst_below(&speed, fabs(o.speed), 1e-9, "push %zu", k);
            kt_worst_below(&steps, o.steps, s->step > 0.0 ? 1.5 * duration / s->step : 10000.0, "push %zu", k);
        }
    }
}

/* ---- limit of rest ----------------------------------------------------------------------------------------------- */

enum { LEGS = 3 };

/* A box at rest on three corners, with a force F along x. */
typedef struct rest_on_legs {
    const push *p;
    double force, normal[LEGS];
} rest_on_legs;

static const double legs[LEGS][2] = {{0.2, 0.15}, {0.2, -0.15}, {-0.2, 0.0}};

/* Normal forces: their sum is m g, and their moment about the middle that of F. */
static void find_normals_of_legs(rest_on_legs *r) {
    const double weight = r->p->mass * gravity, moment = r->force * r->p->height;
    r->normal[2] = 0.5 * weight - 0.5 * moment / 0.2;
    r->normal[0] = r->normal[1] = 0.5 * (weight - r->normal[2]);
}

/* The power of friction in a motion of the box. The velocity of the point of F along x is 1 m/s, and that of the middle
 * along y is y. The box turns at the rate w. */
static double power_of_friction(const rest_on_legs *r, double w, double y) {
    double sum = 0.0;
    for (int i = 0; i < LEGS; i++)
        sum += r->p->friction * r->normal[i] * hypot(1.0 + w * (r->p->beside - legs[i][1]), y + w * legs[i][0]);
    return sum;
}

/* The least power of all motions with this w. It is convex: golden sections. */
static double least_power_of_turn(const rest_on_legs *r, double w) {
    const double golden = 0.5 * (sqrt(5.0) - 1.0);
    double from = -50.0, to = 50.0;
    for (int i = 0; i < 100; i++) {
        const double a = to - golden * (to - from), b = from + golden * (to - from);
        if (power_of_friction(r, w, a) < power_of_friction(r, w, b))
            to = b;
        else
            from = a;
    }
    return power_of_friction(r, w, 0.5 * (from + to));
}

/* The limit of F: the least power of all motions of friction that has its limit everywhere (theorem of limit analysis).
 * The normal forces depend on F. */
static double limit_of_rest(const push *p) {
    const double golden = 0.5 * (sqrt(5.0) - 1.0);
    rest_on_legs r = {.p = p, .force = p->friction * p->mass * gravity};
    for (int k = 0; k < 40; k++) {
        double from = -50.0, to = 50.0;
        find_normals_of_legs(&r);
        for (int i = 0; i < 100; i++) {
            const double a = to - golden * (to - from), b = from + golden * (to - from);
            if (least_power_of_turn(&r, a) < least_power_of_turn(&r, b))
                to = b;
            else
                from = a;
        }
        r.force = least_power_of_turn(&r, 0.5 * (from + to));
    }
    return r.force;
}

/* The time at which F = A (3 x^2 - 2 x^3), x = t / T, has this value. */
static double time_of_force(const push *p, double force) {
    double x = 0.5;
    for (int i = 0; i < 60; i++)
        x -= (x * x * (3.0 - 2.0 * x) - force / largest_force(p)) / (6.0 * x * (1.0 - x));
    return x * duration;
}

/* How many corners stick at the force F. */
static double sticking_corners(kt_simulation *simulation, const push *p, double force) {
    kt_test_advance(simulation, time_of_force(p, force));
    const kt_contact_counts counts = kt_simulation_contacts(simulation);
    return (double)counts.sticks - (double)counts.slips;
}

static void check_limit_of_rest(const push *p, const char *method, kt_worst *before, kt_worst *after, kt_worst *held) {
    const double limit = limit_of_rest(p), near = 1e-6;
    kt_parsed m;
    kt_run run = kt_run_default();
    run.integrator = method;
    run.relative = run.absolute = 1e-9;
    make_box(p, &m);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
    kt_worst_near(before, sticking_corners(simulation, p, limit * (1.0 - near)), LEGS, 0.5, "%s, %.6g N", method,
                  limit);
    kt_worst_near(held, (double)kt_simulation_contacts(simulation).rested, 0.0, 0.5, "%s, %.6g N", method, limit);
    kt_worst_near(after, sticking_corners(simulation, p, limit * (1.0 + near)), 0.0, 0.5, "%s, %.6g N", method, limit);
}

/* Friction of several corners at rest can be shared in several ways. The box rests as long as one of them is within the
 * limits of all corners. Then all corners begin to slip together. */
KT_TEST(boxes_rest_up_to_the_limit_of_all_shares) {
    static const double pushes[][3] = {
        {0.05, -0.1, 0.14}, {0.0, 0.05, 0.1}, {0.1, 0.0, -0.05}, {0.02, 0.19, 0.02}, {0.12, -0.2, -0.15}};
    KT_WORST before = kt_worst_make("corners at rest before the limit"),
             after = kt_worst_make("corners at rest behind the limit"), held = kt_worst_make("friction held");
    for (size_t k = 0; k < sizeof pushes / sizeof *pushes; k++) {
        const push p = {10.0, 0.5, pushes[k][0], pushes[k][1], pushes[k][2], 3};
        check_limit_of_rest(&p, k % 2 == 0 ? "dopri5" : "radau5", &before, &after, &held);
    }
}

/* ---- tolerances -------------------------------------------------------------------------------------------------- */

/* The speed along x after 2.4 s, 0.35 s behind the limit of rest. *steps: that it took. */
static double speed_behind_limit(const push *p, const char *method, double tolerance, double *steps) {
    kt_parsed m;
    kt_run run = kt_run_default();
    run.integrator = method;
    run.relative = run.absolute = tolerance;
    make_box(p, &m);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
    kt_test_advance(simulation, 2.4);
    const double speed = kt_simulation_velocities(simulation)[0];
    *steps = (double)kt_simulation_counts_of(simulation).steps;
    return speed;
}

/* Slip that begins is slower than the tolerance at first. It must not count as rest, nor need steps of its own. The
 * error at the end is that of some tens of steps. */
KT_TEST(slip_begins_at_every_tolerance) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5", "auto"};
    static const push pushes[] = {{10.0, 0.5, 0.05, -0.1, 0.14, LEGS},
                                  {10.0, 0.9, 0.02, 0.00281, 0.02562, LEGS},
                                  {10.0, 0.9, 0.02, 0.0623, 0.0348, LEGS}};
    KT_WORST speed = kt_worst_make("speed, relative to the tolerance"), steps = kt_worst_make("steps");
    double count;
    for (size_t k = 0; k < sizeof pushes / sizeof *pushes; k++) {
        const double exact = speed_behind_limit(&pushes[k], "dopri5", 1e-11, &count);
        kt_check_above("speed", exact, 0.002);
        for (size_t i = 0; i < sizeof methods / sizeof *methods; i++)
            for (double tolerance = 1e-3; tolerance > 5e-9; tolerance *= 0.1) {
                const double observed = speed_behind_limit(&pushes[k], methods[i], tolerance, &count);
                kt_worst_below(&speed, fabs(observed - exact) / tolerance, 30.0, "%zu, %s, %.0e", k, methods[i],
                               tolerance);
                kt_worst_below(&steps, count, 3000.0, "%zu, %s, %.0e", k, methods[i], tolerance);
            }
    }
}

static int take_slow_slip(const kt_record *record, void *user) {
    *(double *)user = record->slow_slip;
    return 0;
}

/* It grows with the root of the tolerance above 1e-9, at most by 300, and is the same for all fixed steps. */
KT_TEST(records_have_the_speed_of_predicted_slip) {
    static const double tolerances[] = {0.0, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3};
    const push p = {10.0, 0.5, 0.05, -0.1, 0.14, LEGS};
    double speed[sizeof tolerances / sizeof *tolerances];
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++) {
        kt_parsed m;
        kt_run run = kt_run_default();
        double observed = (double)NAN;
        run.duration = run.interval = 0.01;
        run.step = tolerances[k] > 0.0 ? 0.0 : 1e-3;
        if (tolerances[k] > 0.0)
            run.relative = run.absolute = tolerances[k];
        make_box(&p, &m);
        kt_test_run(kt_test_simulation(m.model, &run, NULL), take_slow_slip, &observed);
        speed[k] = observed;
    }
    kt_check_near("fixed steps, and small tolerances", speed[0] / speed[1], 1.0, 0.0);
    kt_check_near("tolerances times 100", speed[4] / speed[3], 10.0, 1e-13);
    kt_check_near("large tolerances", speed[5] / speed[0], 300.0, 1e-11);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* Restores a copy at many times, and compares it with the original after three more intervals. Returns how many copies
 * had the same bits. */
static int compare_copies(kt_simulation *one, kt_simulation *two, void *block) {
    kt_error error = {0};
    bool fine = true;
    int compared = 0;
    for (int k = 1; fine && k <= 300; k++) {
        fine = kt_fine("to the checkpoint", kt_simulation_advance(one, 0.01 * k, &error), &error);
        if (k % 10 != 5 && (k < 225 || k > 245)) /* slip begins at 2.29 s */
            continue;
        kt_simulation_save(one, block);
        fine = fine && kt_fine("restores", kt_simulation_restore(two, block, &error), &error);
        for (int i = 1; fine && i <= 3; i++)
            fine = kt_fine("copy", kt_simulation_advance(two, 0.01 * (k + i), &error), &error) &&
                   kt_fine("original", kt_simulation_advance(one, 0.01 * (k + i), &error), &error) &&
                   kt_scene_check_equal("state", two, one);
        fine = fine && kt_fine("back", kt_simulation_restore(one, block, &error), &error);
        compared += fine;
    }
    return compared;
}

/* Before slip begins, while it is slow, and behind that. The corners are one island: their responses to forces of each
 * other must follow from the present state alone. */
KT_TEST(checkpoints_of_slip_that_begins_go_on_with_the_same_bits) {
    static const stepping chosen[] = {{.method = "rk4", .step = 0.01}, {.method = "dopri5"}, {.method = "radau5"}};
    const push p = {10.0, 0.5, 0.1, 0.0, 0.05, 4};
    for (size_t i = 0; i < sizeof chosen / sizeof *chosen; i++) {
        kt_parsed m;
        kt_run run = kt_run_default();
        run.integrator = chosen[i].method;
        run.step = chosen[i].step;
        make_box(&p, &m);
        kt_simulation *one = kt_test_simulation(m.model, &run, NULL), *two = kt_test_simulation(m.model, &run, NULL);
        void *block = malloc(kt_simulation_state_size(one));
        kt_need(kt_check_true(chosen[i].method, block != NULL));
        kt_check_equal_int("copies with the same bits", compare_copies(one, two, block), 48);
        kt_check_above("speed", kt_simulation_velocities(one)[0], 0.5);
        free(block);
    }
}
