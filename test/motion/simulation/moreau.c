/* Time stepping over contacts against closed forms, against events, and against its own laws at every step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include "contact/moreau.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "moreau_scenes.h"
#include "parsed.h"

static const double g = 9.81;

typedef struct kt_stepped {
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
} kt_stepped;

/* Simulates a scene with steps of this length; 0: with events, by dop853. */
static void begin(const char *text, double step, kt_stepped *s) {
    kt_simulation_options options = kt_simulation_options_default();
    *s = (kt_stepped){.model = NULL};
    kt_parsed_scene(text, &s->scene);
    kt_run run = s->scene.run;
    run.duration = 100.0;
    run.integrator = step > 0.0 ? NULL : "dop853";
    run.step = step;
    run.relative = run.absolute = 1e-11;
    options.contact = step > 0.0 ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    options.events = 1;
    options.record =
        KT_RECORD_BALANCE | KT_RECORD_ENERGY | KT_RECORD_REACTION | KT_RECORD_MULTIPLIER | KT_RECORD_ACCELERATION;
    s->model = kt_scene_compile(&s->scene.description);
    s->simulation = kt_test_simulation(s->model, &run, &options);
}

static void advance(const kt_stepped *s, double time) { kt_test_advance(s->simulation, time); }

/* A trunk flies at 100 m/s along its leg, which stands on a floor at its hip, and steps are short. Forces m v / h of
 * 1e10 N cancel in the moment of the hip, up to their rounding. The check of steps must not take this for a violation.
 */
KT_TEST(short_steps_of_a_fast_leg_obey_newtons_law) {
    kt_error error = {0};
    kt_stepped s;
    begin("kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
          "  - {name: trunk, mass: 50, inertia: [1, 2, 2],\n"
          "     joint: {type: free, position: {position: [0, 0, 0], orientation: {quaternion: "
          "[0.98877107793604224, 0, 0.14943813247359922, 0]}},\n"
          "            velocity: {linear: [100, 0, 0], angular: [0, 0, 0]}}}\n"
          "  - {name: leg, parent: trunk, mass: 5, inertia: [0.1, 0.1, 0.1], com: [0.25, 0, 0],\n"
          "     markers: {foot: [0, 0, 0]}, joint: {type: revolute, axis: y, position: -0.3}}\n"
          "effects:\n  - {name: floor, type: contact, point: leg.foot, radius: 0, plane: world, restitution: 0, "
          "friction: 0}\nsimulate: {duration: 1}\n",
          1e-7, &s);
    kt_need_fine("a hundred steps", kt_simulation_advance(s.simulation, 1e-5, &error), &error);
    kt_check_above("closed contacts", (double)kt_simulation_contacts(s.simulation).closed, 99.0);
}

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* A block slides: v = v0 - mu g t, without an error, until it rests at v0^2 / (2 mu g), with an error of the order of a
 * step. */
KT_TEST(a_block_slides_and_stops_as_coulomb_has_it) {
    const double mu = 0.3, v0 = 2.0, steps[] = {1e-2, 1e-3};
    for (int i = 0; i < 2; i++) {
        kt_stepped s;
        double worst = 0.0;
        begin(KT_MOREAU_SLIDER, steps[i], &s);
        for (int k = 1; k <= 50; k++) {
            advance(&s, 0.01 * k);
            worst = fmax(worst, fabs(kt_simulation_velocities(s.simulation)[0] - (v0 - mu * g * 0.01 * k)));
        }
        kt_check_below("velocity", worst, 1e-12);
        advance(&s, 2.0);
        kt_check_near("place", kt_simulation_positions(s.simulation)[0], v0 * v0 / (2.0 * mu * g),
                      mu * g * steps[i] * steps[i]);
        kt_check_near("rest", kt_simulation_velocities(s.simulation)[0], 0.0, 1e-14);
        kt_check_near("dissipated, J", kt_simulation_contacts(s.simulation).dissipated, 0.5 * v0 * v0, 1e-13);
    }
}

/* A ball that is dropped from 1 m reaches the height e^2 (1 - O(h)), and rests at the end of all bounces. */
KT_TEST(a_ball_bounces_and_rests) {
    const double e = 0.5, t1 = sqrt(2.0 / g), zeno = t1 * (1.0 + e) / (1.0 - e);
    for (double step = 4e-3; step > 4e-4; step /= 4.0) {
        kt_stepped s;
        double top = 0.0, depth = 0.0;
        begin(KT_MOREAU_BALL, step, &s);
        for (int k = 1; k * step < t1 * (1.0 + 2.0 * e); k++) {
            advance(&s, k * step);
            const double z = kt_simulation_positions(s.simulation)[0];
            top = k * step > t1 ? fmax(top, z) : top;
            depth = fmax(depth, -z);
        }
        kt_check_near("height", top, e * e, g * t1 * step);
        kt_check_below("depth", depth, 1e-13);
        advance(&s, zeno + 20.0 * step);
        kt_check_near("where", kt_simulation_positions(s.simulation)[0], 0.0, 1e-13);
        kt_check_near("speed", kt_simulation_velocities(s.simulation)[0], 0.0, 1e-13);
        kt_check_near("balance", kt_scene_balance(s.simulation), g, 1e-11);
        kt_check_near("penetration", kt_simulation_contacts(s.simulation).penetration, 0.0, 1e-13);
    }
}

/* A slider and the arm that it carries fall on the ground. Each impulse changes the rates of both contacts. */
KT_TEST(contacts_of_two_links_of_one_branch_come_to_rest) {
    static const char arm[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: a, joint: {type: prismatic, axis: z, position: 0.3}, mass: 2, markers: {c: [0, 0, 0]}}\n"
        "  - {name: b, parent: a, joint: {type: revolute, axis: y, position: -0.1}, mass: 1, com: [0.5, 0, 0],\n"
        "     inertia: [0.1, 0.1, 0.1], markers: {c: [1, 0, 0]}}\n"
        "effects:\n"
        "  - {name: ca, type: contact, point: a.c, plane: {body: world}, axis: z, restitution: 0}\n"
        "  - {name: cb, type: contact, point: b.c, plane: {body: world, at: [0, 0, 0.05]}, axis: z, restitution: 0}\n";
    kt_stepped s;
    begin(arm, 1e-3, &s);
    advance(&s, 2.0);
    const double *q = kt_simulation_positions(s.simulation), *v = kt_simulation_velocities(s.simulation);
    const kt_contact_counts counts = kt_simulation_contacts(s.simulation);
    kt_check_near("height of the slider", q[0], 0.0, 1e-12);
    kt_check_near("height of the arm's end", q[0] - sin(q[1]), 0.05, 1e-12);
    kt_check_below("speed", fmax(fabs(v[0]), fabs(v[1])), 1e-12);
    kt_check_below("penetration in a step", counts.penetration, 1e-5);
    kt_check_equal_int("failures", (long long)counts.failures, 0);
}

/* A square plate with its feet in the plane of its centre of mass lies on a slope. Two feet on a diagonal are rough,
 * the others are smooth. The rough feet may bear any part of the load, up to the whole. So rest exists up to the slope
 * tan a = mu, and the plate rests. If the rough feet bear no more than half, the plate slides from tan a = mu / 2. The
 * cone solver ends at 1e-7 of the rate g h that a step gives, so that the plate may creep by 1e-7 g h t. A fifth foot
 * would reach the slope within a step of free motion, but the resting plate does not touch it. */
KT_TEST(a_plate_rests_if_any_distribution_of_its_load_permits_rest) {
    static const double mu = 0.8, parts[] = {0.3, 0.7, 0.95, 1.05},
                        units[][3] = {{1.0, 1.0, 1.0},
                                      {1e6, 1.0, 1.0},
                                      {1e-6, 1e3, 1.0},
                                      {1.0, 1e-3, 1e3}}; /* of mass, length and time */
    for (int i = 0; i < 16; i++) {
        const double *unit = units[i / 4], M = unit[0], L = unit[1], T = unit[2];
        const double part = parts[i % 4], slope = atan(part * mu), step = 1e-3 * T, weight = g * L / (T * T);
        char text[1024];
        kt_stepped s;
        (void)snprintf(
            text, sizeof text,
            "kinetree: 1\ngravity: [%.17g, 0, %.17g]\nbodies:\n"
            "  - {name: b, joint: {type: free}, mass: %.17g, inertia: [%.17g, %.17g, %.17g],\n"
            "     markers: {p: [%.17g, %.17g, 0], q: [%.17g, %.17g, 0], r: [%.17g, %.17g, 0], s: [%.17g, %.17g, 0],\n"
            "     t: [%.17g, 0, %.17g]}}\n"
            "effects:\n"
            "  - {name: t, type: contact, point: b.t, plane: {body: world}, restitution: 0}\n"
            "  - {name: p, type: contact, point: b.p, plane: {body: world}, restitution: 0, friction: 0.8}\n"
            "  - {name: q, type: contact, point: b.q, plane: {body: world}, restitution: 0}\n"
            "  - {name: r, type: contact, point: b.r, plane: {body: world}, restitution: 0, friction: 0.8}\n"
            "  - {name: s, type: contact, point: b.s, plane: {body: world}, restitution: 0}\n",
            weight * sin(slope), -weight * cos(slope), 2.0 * M, 0.1 * M * L * L, 0.1 * M * L * L, 0.2 * M * L * L, L,
            0.3 * L, -0.3 * L, L, -L, -0.3 * L, 0.3 * L, -L, L, 0.5 * weight * step * step);
        begin(text, step, &s);
        advance(&s, 100.0 * step);
        const double x = kt_simulation_positions(s.simulation)[0] / L;
        if (part < 1.0)
            kt_check_near("rests, lengths", x, 0.0, 1e-7 * g * 1e-3 * 0.1);
        else
            kt_check_above("slides, lengths", x, 0.5 * 0.1 * 0.1 * g * (sin(slope) - mu * cos(slope)) - 1e-4);
    }
}

/* A rod is pinned at its top, 60 degrees steep, and stands with its tip on a floor. It is pulled upwards. Friction
 * wedges it if mu > cot 60, with N (mu sin 60 - cos 60) = m g cos 60 / 2. Otherwise it lifts off. */
KT_TEST(a_rod_stays_wedged_if_its_friction_permits_rest) {
    static const double mu[] = {0.5, 0.8};
    for (int i = 0; i < 2; i++) {
        char text[512];
        kt_stepped s;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, 9.81]\nbodies:\n"
                       "  - {name: rod, mass: 2, shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]},\n"
                       "     joint: {type: revolute, axis: y, at: [0, 0, 0.8660254037844386], position: 60 deg}}\n"
                       "effects:\n  - {name: foot, type: contact, point: rod.tip, radius: 0, plane: world, "
                       "restitution: 0, friction: %.17g}\n",
                       mu[i]);
        begin(text, 1e-3, &s);
        advance(&s, 0.1);
        const double turn = kt_simulation_positions(s.simulation)[0] - acos(0.5);
        const double force = s.simulation->contact_state[0].force[0];
        if (mu[i] > sqrt(1.0 / 3.0)) {
            kt_check_near("rests, rad", turn, 0.0, 1e-12);
            kt_check_near("force, N", force, 2.0 * g * 0.25 / (mu[i] * sqrt(0.75) - 0.5), 1e-9);
        } else {
            kt_check_above("lifts off, rad", -turn, 0.01);
        }
    }
}

static int tenths_of(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = sin(10.0 * at->t - 0.0123);
    return 0;
}

/* Events between the ends of steps repeat a step up to their instant. The counts are those of the steps that remain:
 * friction takes all of m v^2 / 2, and the block is closed once in each of them. */
KT_TEST(a_step_that_an_event_repeats_counts_once) {
    static const kt_event tenths = {.name = "tenths", .function = tenths_of};
    kt_error error = {0};
    kt_stepped s;
    begin(KT_MOREAU_SLIDER, 1e-3, &s);
    kt_need_fine("event", kt_simulation_event_add(s.simulation, &tenths, &error), &error);
    advance(&s, 1.0);
    const kt_contact_counts counts = kt_simulation_contacts(s.simulation);
    const kt_simulation_counts steps = kt_simulation_counts_of(s.simulation);
    kt_check_true("steps are repeated", steps.rejected > 0);
    kt_check_near("dissipated, J", counts.dissipated, 2.0, 1e-12);
    kt_check_equal_int("closed contacts of all steps", (int)counts.closed, (int)steps.steps);
}

/* ---- against events ---------------------------------------------------------------------------------------------- */

static double distance(const kt_stepped *a, const kt_stepped *b) {
    double worst = 0.0;
    for (int i = 0; i < kt_model_nq(a->model); i++)
        worst =
            fmax(worst, fabs(kt_simulation_positions(a->simulation)[i] - kt_simulation_positions(b->simulation)[i]));
    return worst;
}

/* The mean error at 50 times up to `duration`. */
static double error_of(const char *text, double step, double duration) {
    kt_stepped stepped, exact;
    double sum = 0.0;
    begin(text, 0.0, &exact);
    begin(text, step, &stepped);
    for (int k = 1; k <= 50; k++) {
        advance(&exact, duration * k / 50.0);
        advance(&stepped, duration * k / 50.0);
        sum += distance(&exact, &stepped) / 50.0;
    }
    return sum;
}

/* The mean error over step of four steps next to each other. Where in its step an impact lies is random. */
static double error_over_step(const char *text, double step, double duration) {
    double sum = 0.0;
    for (int k = 0; k < 4; k++)
        sum += 0.25 * error_of(text, step * (1.0 - 0.07 * k), duration) / (step * (1.0 - 0.07 * k));
    return sum;
}

/* The error over step stays below the bound, and does not grow by more than a half while steps shrink by 8. */
static void check_order(const char *name, const char *text, double step, double duration, double bound) {
    kt_note("%s", name);
    const double coarse = error_over_step(text, step, duration), fine = error_over_step(text, step / 8.0, duration);
    kt_check_below("error over step", coarse, bound);
    kt_check_below("the same with steps shorter by 8", fine, 1.5 * coarse);
}

KT_TEST(errors_are_of_first_order) {
    check_order("ball", KT_MOREAU_BALL, 4e-3, 1.5, 2.0);
    check_order("slider", KT_MOREAU_SLIDER, 4e-3, 1.0, 4e-4);
    check_order("pendulum on a stop", KT_MOREAU_PENDULUM, 4e-3, 2.0, 6.0);
    check_order("four-bar with a stop", KT_MOREAU_FOUR_BAR, 2e-3, 1.0, 2.0);
    check_order("rod that falls and slides", KT_MOREAU_ROD, 2e-3, 0.9, 0.4);
    check_order("rope", KT_MOREAU_ROPE, 4e-3, 2.0, 4.0);
    check_order("dry friction", KT_MOREAU_DRY, 4e-3, 3.0, 1.0);
}

/* A closed contact with a curved gap returns the rate of its approach, as SHAKE does, and dissipates nothing to second
 * order. Measured: 42 h^2; without the turning normal 12 h. */
KT_TEST(a_taut_rope_dissipates_nothing_to_second_order) {
    static const double steps[] = {4e-3, 1e-3};
    for (int i = 0; i < 2; i++) {
        kt_stepped s;
        begin(KT_MOREAU_SWING, steps[i], &s);
        advance(&s, 4.0);
        kt_check_near("dissipated, J", kt_simulation_contacts(s.simulation).dissipated, 0.0,
                      60.0 * steps[i] * steps[i]);
    }
}

/* Four corners of a face share its load in many ways, and friction depends on the shares. Tilts of 1e-10, which bounds
 * of the corners disagree about, do not change them. Measured: 6e-10; with bounds that disagree 4e-8 to 7e-6. */
KT_TEST(corners_of_a_face_share_its_load_whatever_the_rounding) {
    static const char *const texts[] = {KT_MOREAU_CORNERS("2e-7, 1e-7"), KT_MOREAU_CORNERS("-1e-7, 3e-8"),
                                        KT_MOREAU_CORNERS("-5e-8, -2e-7")};
    kt_stepped flat, tilted;
    begin(KT_MOREAU_CORNERS("0, 0"), 1e-3, &flat);
    advance(&flat, 0.05);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        begin(texts[i], 1e-3, &tilted);
        advance(&tilted, 0.05);
        kt_check_below("difference", distance(&flat, &tilted), 1e-8);
    }
}

/* ---- laws at every step ------------------------------------------------------------------------------------------ */

/* The largest violation of Coulomb's cone, of its direction, and of complementarity, by the impulses of the last step,
 * relative to the largest impulse and rate. */
static double violation_of(const kt_simulation *simulation) {
    const kt_moreau *m = simulation->moreau;
    const struct kt_contacts *c = simulation->contacts;
    double worst = 0.0, most = 1e-12, fastest = 1e-9;
    for (int i = m->dry; i < m->count; i++) {
        most = fmax(most, m->p[3 * i]);
        fastest = fmax(fastest, fmax(fabs(m->begin[m->first[i]]), fabs(m->free[m->first[i]])));
    }
    for (int i = m->dry; i < m->count; i++) {
        const double *p = m->p + 3 * i, cone = m->mu[i] * p[0];
        double u[3] = {0.0, 0.0, 0.0};
        for (int r = 0; r < kt_moreau_rows(m, i); r++)
            u[r] = kt_contacts_rate(c, c->rows[m->first[i] + r], c->components[m->first[i] + r], m->after);
        const double bound = m->e[i] > 0.0 ? -m->e[i] * m->begin[m->first[i]] : m->bound[i], slip = hypot(u[1], u[2]);
        worst = fmax(worst, -p[0] / most);
        worst = fmax(worst, (bound - u[0]) / fastest);
        worst = fmax(worst, p[0] / most * (u[0] - bound) / fastest);
        worst = fmax(worst, (hypot(p[1], p[2]) - cone) / most);
        if (slip > 1e-7 * fastest && cone > 0.0)
            worst = fmax(worst, hypot(p[1] + cone * u[1] / slip, p[2] + cone * u[2] / slip) / most * slip / fastest);
    }
    return worst;
}

KT_TEST(a_thrown_box_obeys_the_laws_of_contact_at_every_step) {
    kt_stepped s;
    double worst = 0.0, grown = 0.0, last = 0.0;
    kt_error error = {0};
    int closed = 0;
    begin(KT_MOREAU_BOX, 1e-3, &s);
    for (int k = 1; k <= 2000; k++) {
        advance(&s, 1e-3 * k);
        kt_record record = {.kinetic = (double)NAN};
        worst = fmax(worst, violation_of(s.simulation));
        (void)kt_fine("sense", kt_simulation_sense(s.simulation, &record, &error), &error);
        const double energy = record.kinetic + record.potential;
        grown = k > 1 ? fmax(grown, energy - last) : 0.0;
        last = energy;
        closed += s.simulation->moreau->count > 0;
    }
    kt_check_below("violation", worst, 1e-12);
    kt_check_below("growth of the energy in a step, J", grown, 1e-5);
    kt_check_true("it lies on the floor", closed > 1000);
    kt_check_equal_int("failures", (long long)kt_simulation_contacts(s.simulation).failures, 0);
    kt_check_below("penetration", kt_simulation_contacts(s.simulation).penetration, 1e-8);
    kt_check_below("speed at the end", fabs(kt_simulation_velocities(s.simulation)[2]), 1e-9);
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

static int keep_last(const kt_record *record, void *user) {
    double *force = user;
    const int loop = kt_loop_find(record->model, "floor");
    force[0] = record->multipliers[kt_loop_rows_of(record->model, loop).first];
    force[1] = record->loop_reactions[loop].force.z;
    force[2] = record->a[0];
    return 0;
}

/* A block of 2 kg that slides: its weight, and the acceleration -mu g. */
KT_TEST(records_have_forces_as_impulses_over_steps) {
    kt_stepped s;
    kt_error error = {0};
    double force[3] = {0.0, 0.0, 0.0};
    begin(KT_MOREAU_SLIDER, 1e-2, &s);
    advance(&s, 0.2);
    kt_record record;
    (void)kt_fine("sense", kt_simulation_sense(s.simulation, &record, &error), &error);
    (void)keep_last(&record, force);
    kt_check_near("multiplier", force[0], g, 1e-12);
    kt_check_near("normal force", force[1], g, 1e-12);
    kt_check_near("acceleration", force[2], -0.3 * g, 1e-12);
}

/* The works of a scene after `duration`, and the change of the balance, relative to the energy that was supplied. */
static kt_work works_of(const char *text, double duration, double *imbalance) {
    kt_stepped s;
    kt_work work = {(double)NAN, (double)NAN};
    *imbalance = (double)NAN;
    begin(text, 1e-3, &s);
    const double before = kt_scene_balance(s.simulation);
    advance(&s, duration);
    work = kt_simulation_work(s.simulation);
    *imbalance = kt_scene_balance(s.simulation) - before;
    return work;
}

/* A belt gives the block v^2 m / 2 and loses as much in friction. A lift raises both weights. A shaft turns against its
 * brake. */
KT_TEST(drives_supply_the_work_against_forces_of_contacts) {
    double imbalance;
    kt_work work = works_of(KT_MOREAU_BELT, 1.0, &imbalance);
    kt_check_near("belt, supplied", work.supplied, 0.5 * 2.0 * 0.5, 1e-14);
    kt_check_near("belt, dissipated", work.dissipated, 0.5 * 2.0 * 0.5 * 0.5, 1e-14);
    kt_check_near("belt, balance", imbalance, 0.0, 1e-14);
    work = works_of(KT_MOREAU_LIFT, 1.0, &imbalance);
    kt_check_near("lift, supplied", work.supplied, 7.0 * g * 0.5, 1e-11);
    kt_check_near("lift, balance", imbalance, 0.0, 1e-11);
    work = works_of(KT_MOREAU_WINCH, 1.0, &imbalance);
    kt_check_near("winch, supplied: m g h, and m v v while the rope becomes taut", work.supplied, 2.0 * g * 0.5 + 0.5,
                  1e-11);
    kt_check_near("winch, balance", imbalance, 0.0, 1e-11);
    work = works_of(KT_MOREAU_SHAFT, 1.0, &imbalance);
    kt_check_near("shaft, supplied", work.supplied, 4.0 * 3.0, 1e-13);
    kt_check_near("shaft, balance", imbalance, 0.0, 1e-13);
}

/* The works of a driven crank against friction and a stop, with events and with steps. */
KT_TEST(works_of_a_driven_loop_are_those_of_events) {
    kt_stepped exact;
    double imbalance;
    const kt_work work = works_of(KT_MOREAU_CRANK, 1.0, &imbalance);
    begin(KT_MOREAU_CRANK, 0.0, &exact);
    advance(&exact, 1.0);
    const kt_work expected = kt_simulation_work(exact.simulation);
    kt_check_near("supplied", work.supplied, expected.supplied, 1e-5 * expected.supplied);
    kt_check_near("dissipated", work.dissipated, expected.dissipated, 1e-5 * expected.dissipated);
    kt_check_near("balance", imbalance, 0.0, 1e-5 * expected.supplied);
}

/* v = 5 exp(-t / 2) - 2. The brake dissipates the energy of the wheel, and turns it back with 1 + v / 2. */
KT_TEST(dry_friction_of_joints_keeps_its_viscous_part) {
    kt_stepped s;
    kt_error error = {0};
    begin(KT_MOREAU_WHEEL, 1e-3, &s);
    advance(&s, 1.0);
    kt_record record;
    const double torque = -2.5 * exp(-0.5);
    kt_need_fine("sense", kt_simulation_sense(s.simulation, &record, &error), &error);
    const int loop = kt_loop_find(record.model, "brake.stick");
    kt_check_near("torque", record.multipliers[kt_loop_rows_of(record.model, loop).first], torque, 1e-3);
    kt_check_near("acceleration", record.a[0], torque, 1e-3);
    advance(&s, 4.0);
    kt_check_near("dissipated", kt_simulation_work(s.simulation).dissipated, 4.5, 1e-12);
    kt_check_near("rest", kt_simulation_velocities(s.simulation)[0], 0.0, 1e-14);
}

/* The acceleration of the present state is that of its record, and includes a torque that was just set. */
static void check_present_acceleration(const char *text, double side) {
    kt_stepped s;
    kt_error error = {0};
    double a = (double)NAN;
    begin(text, 1e-3, &s);
    advance(&s, 0.1);
    kt_need_fine("acceleration", kt_simulation_acceleration(s.simulation, &a, &error), &error);
    kt_check_near("at rest", a, 0.0, 1e-12);
    kt_need_fine("torque", kt_simulation_set_torque(s.simulation, (double[]){side * 6.0}, &error), &error);
    kt_need_fine("acceleration", kt_simulation_acceleration(s.simulation, &a, &error), &error);
    kt_check_near("pulled", a, side * 3.0, 1e-12);
}

KT_TEST(accelerations_of_the_present_state_have_forces_of_contacts) {
    check_present_acceleration(KT_MOREAU_LYING, 1.0);
    check_present_acceleration(KT_MOREAU_LYING_ON_UPPER, -1.0);
}

/* ---- continuing -------------------------------------------------------------------------------------------------- */

/* A run from a checkpoint has the bits of a run without a break, and no step allocates. */
KT_TEST(checkpoints_keep_all_bits_and_steps_do_not_allocate) {
    kt_stepped whole, broken;
    begin(KT_MOREAU_BOX, 1e-3, &whole);
    begin(KT_MOREAU_BOX, 1e-3, &broken);
    advance(&whole, 0.437);
    kt_need(kt_scene_hand_over(whole.simulation, broken.simulation));
    kt_interpose_start();
    advance(&whole, 0.8);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    advance(&broken, 0.8);
    kt_scene_check_equal("state", broken.simulation, whole.simulation);
}

/* ---- what is rejected -------------------------------------------------------------------------------------------- */

static void check_rejected(const char *text, kt_run run, kt_simulation_options options, const char *where) {
    kt_scene scene;
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    kt_parsed_scene(text, &scene);
    kt_model *model = kt_test_model(&scene.description, NULL);
    kt_check_true("rejected", kt_simulation_create(model, &run, &options, &simulation, &error) != KT_OK);
    kt_check_text(error.message, error.where, where);
    kt_simulation_free(simulation);
}

KT_TEST(time_stepping_rejects_what_it_has_not) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    options.contact = KT_CONTACT_STEPS;
    check_rejected(KT_MOREAU_BALL, run, options, "integrator"); /* the default one */
    run.integrator = NULL;
    check_rejected(KT_MOREAU_BALL, run, options, "step");
    run.step = 1e-3;
    check_rejected(KT_MOREAU_FREE, run, options, "contact");
    check_rejected(KT_MOREAU_POISSON, run, options, "contact");
    options.method = kt_method_find("rk4");
    check_rejected(KT_MOREAU_BALL, run, options, "contact");
    options.method = NULL;
    options.contact = (kt_contact_scheme)7;
    check_rejected(KT_MOREAU_BALL, run, options, "contact");
}
