/* Friction that wedges contacts (Painleve's paradox) within steps and behind impacts: runs go on. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>

#include "check.h"
#include "motion/simulation/parsed.h"
#include "motion/simulation/scenes.h"
#include "random.h"

enum { ENDS = 2, RODS = 60 };
static const double g = 9.81, a = 0.5, thick = 0.01;

/* Rods of length 2 a with spheres at both ends, on the plane z = 0. */
typedef struct rods {
    kt_body body;
    kt_marker marker[ENDS];
    kt_effect effect[ENDS];
    kt_description description;
} rods;

static void make_rod(rods *s, double friction, double restitution) {
    static const char *const names[ENDS] = {"head", "foot"};
    *s = (rods){.body = kt_body_default(), .description = kt_description_default()};
    s->body.name = "rod";
    s->body.joint.type = KT_JOINT_FREE;
    s->body.mass = 2.0;
    s->body.inertia.xx = 0.01;
    s->body.inertia.yy = s->body.inertia.zz = 2.0 * a * a / 3.0;
    s->body.markers = s->marker;
    s->body.marker_count = ENDS;
    for (int i = 0; i < ENDS; i++) {
        kt_effect *effect = &s->effect[i];
        s->marker[i] = (kt_marker){.name = names[i], .at = kt_vec3_make(i == 0 ? a : -a, 0.0, 0.0)};
        *effect = kt_effect_of(KT_EFFECT_CONTACT, NULL);
        effect->name = names[i];
        effect->between[0].body = "rod";
        effect->between[0].marker = names[i];
        effect->radius = thick;
        effect->friction = friction;
        effect->restitution = restitution;
    }
    s->description.bodies = &s->body;
    s->description.body_count = 1;
    s->description.effects = s->effect;
    s->description.effect_count = ENDS;
    s->description.gravity = kt_vec3_make(0.0, 0.0, -g);
}

/* A rod, inclined by theta, whose head slides on the plane. */
static void throw_rod(kt_random *random, double *q, double *v) {
    const double theta = kt_random_uniform(random, 0.3, 1.3), c = cos(0.5 * theta), s = sin(0.5 * theta);
    q[0] = q[1] = 0.0;
    q[2] = a * sin(theta) + thick;
    q[3] = c;
    q[4] = q[6] = 0.0;
    q[5] = s;
    for (int i = 0; i < 6; i++)
        v[i] = kt_random_uniform(random, -3.0, 3.0);
    v[2] = v[4] * a * cos(theta); /* the head has no speed along z */
}

/* The larger number, or a NaN. */
static double larger(double x, double y) { return y > x || isnan(y) ? y : x; }

static double energy_of(kt_simulation *simulation) {
    kt_record record = {0};
    kt_error error = {0};
    const kt_status status = kt_simulation_sense(simulation, &record, &error);
    return status == KT_OK ? record.kinetic + record.potential : (double)NAN;
}

/* Throws a rod for half a second in ticks of 10 ms. Returns the largest growth of its energy in a tick. */
static double run_rod(kt_random *random, const char *method, double step, bool *ends, kt_contact_counts *counts) {
    rods s;
    make_rod(&s, kt_random_uniform(random, 1.5, 3.0), kt_random_uniform(random, 0.0, 0.5));
    kt_run run = kt_run_fixed(method, step, 10.0);
    kt_simulation_options options = kt_simulation_options_default();
    double q[7], v[6], growth = 0.0;
    throw_rod(random, q, v);
    run.relative = run.absolute = 1e-9;
    options.record = KT_RECORD_ENERGY;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_error error = {0};
    kt_status status = kt_simulation_set_state(simulation, 0.0, q, v, &error);
    for (int k = 0; status == KT_OK && k < 50; k++) {
        const double before = energy_of(simulation);
        status = kt_simulation_tick(simulation, 0.01, &error);
        growth = larger(growth, energy_of(simulation) - before);
    }
    *ends = status == KT_OK;
    if (!*ends)
        kt_note("%s: %s", error.where, error.message);
    counts->jammed += kt_simulation_contacts(simulation).jammed;
    counts->unconverged += kt_simulation_contacts(simulation).unconverged;
    return growth;
}

/* Throws rods, and checks that their energy grows no more than by the errors of free flight. */
static void slide_rods(const char *method, double step, double bound, uint64_t seed) {
    kt_random random = kt_random_seeded(seed, "sliding_rods_are_not_wedged");
    kt_contact_counts counts = {0};
    int failed = 0;
    double growth = 0.0;
    for (int i = 0; i < RODS; i++) {
        bool ends;
        growth = larger(growth, run_rod(&random, method, step, &ends, &counts));
        failed += !ends;
    }
    kt_note("%s, seed %llu", method, (unsigned long long)seed);
    kt_check_below("runs that fail", failed, 0.0);
    kt_check_below("growth of energy in a tick, J", growth, bound);
    kt_check_above("impulses without a collision", (double)counts.jammed, 1.0);
    kt_check_above("evaluations in which slow slip has no direction", (double)counts.unconverged, 1.0);
}

/* Forces act on a rod that do no work, or dissipate: gravity, normal forces and friction. Measured before steps were
 * repeated: 15 of these runs fail with rk4, since friction wedges the head. */
KT_TEST(sliding_rods_are_not_wedged) {
    slide_rods("dopri5", 0.0, 1e-10, kt_random_seed());
    slide_rods("heun", 1e-3, 1e-5, kt_random_seed());
    slide_rods("rk4", 5e-3, 1e-8, kt_random_seed());
}

/* A fixed step of a rod that slides may not resolve its friction. If it gains energy, it is repeated with a part of its
 * length. Unless such steps are repeated, heun gains up to 8 mJ in a tick, and rk4 0.12 J. */
KT_TEST(fixed_steps_of_sliding_rods_gain_no_energy) {
    static const uint64_t seeds[] = {3, 7, 9};
    for (int i = 0; i < KT_SHORT(1, 3); i++) {
        slide_rods("heun", 1e-3, 1e-5, seeds[i]);
        slide_rods("rk4", 5e-3, 1e-8, seeds[i]);
    }
}

/* A rod lies on the plane and slides under a force, which supplies energy. None of its steps is repeated. */
KT_TEST(steps_of_a_driven_rod_are_not_repeated) {
    static const double friction = 0.5, step = 1e-3, end = 0.5, pull[6] = {20.0};
    rods s;
    make_rod(&s, friction, 0.0);
    s.body.joint.position[2] = thick;
    s.body.joint.velocity[0] = 1.0;
    const kt_run run = kt_run_fixed("heun", step, 10.0);
    const kt_simulation_options options = kt_simulation_options_default();
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_error error = {0};
    kt_status status = kt_simulation_set_torque(simulation, pull, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, end, &error);
    kt_need_fine("runs", status, &error);
    const double a_x = pull[0] / s.body.mass - friction * g;
    kt_check_near("place, m", kt_simulation_positions(simulation)[0], end + 0.5 * a_x * end * end, 1e-12);
    kt_check_equal_int("steps", (long long)kt_simulation_counts_of(simulation).steps, lround(end / step));
    kt_check_equal_int("rejected steps", (long long)kt_simulation_counts_of(simulation).rejected, 0);
}

/* A plate on one foot carries a box on two feet, which slide. Friction of the plate's foot alone would wedge it: its
 * pivot 1 - G_ii is negative. But the box's forces change with it, so that all forces are unique when the foot begins
 * to slide. Before, 146 steps held the foot with up to 0.076 of its cone too much. */
KT_TEST(a_foot_slides_where_forces_of_others_relieve_it) {
    static const char scene[] =
        "kinetree: 1\ngravity: [-0.99, -0.06, -9.81]\nbodies:\n"
        "  - {name: plate, joint: {type: free, position: {position: [0, 0, 0.056]},\n"
        "     velocity: {linear: [0.7, 0.58, 0], angular: [0, 0, -0.58]}},\n"
        "     mass: 0.19, inertia: [0.00221, 0.00265, 0.00331], markers: {foot: [0.32, 0.116, -0.056]}}\n"
        "  - {name: box, joint: {type: free, position: {position: [0, 0, 0.262]},\n"
        "     velocity: {linear: [0.7, 0.58, 0], angular: [0, 0, -0.58]}},\n"
        "     mass: 4.82, inertia: [0.06504, 0.07805, 0.09756],\n"
        "     markers: {left: [0.356, 0.093, -0.15], right: [-0.329, -0.164, -0.15]}}\n"
        "effects:\n"
        "  - {type: contact, point: plate.foot, plane: {body: world}, restitution: 0, friction: 0.81}\n"
        "  - {type: contact, point: box.left, plane: {body: plate, at: [0, 0, 0.056]}, restitution: 0,\n"
        "     friction: 0.6}\n"
        "  - {type: contact, point: box.right, plane: {body: plate, at: [0, 0, 0.056]}, restitution: 0, friction: "
        "0.25}\n";
    const kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_within(NULL, 1e-9, 0.2);
    kt_parsed m;
    kt_parsed_make(&m, scene);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_advance(simulation, 0.2);
    kt_check_equal_int("steps beyond cones", (long long)kt_simulation_contact_excess(simulation).steps, 0);
    kt_check_equal_int("jams", (long long)kt_simulation_contacts(simulation).jammed, 0);
    kt_check_above("slip of the foot", (double)kt_simulation_contacts(simulation).slips, 0.5);
}

/* A drive lowers a rod with the slope tan 0.05 to a floor. Within the cone, impulses do not turn the rod, so that no
 * impulse separates it. The solver once returned 2e9 times the rates, and the rod bounced 10,000 times at
 * one instant. */
KT_TEST(no_impulse_stops_a_drive_within_its_cone) {
    static const char scene[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: lift, joint: {type: prismatic, axis: z, position: 1.05}, mass: 1, inertia: [1, 1, 1]}\n"
        "  - {name: rod, parent: lift, joint: {type: revolute, axis: y, position: 0.05}, mass: 1,\n"
        "     shape: {type: rod, to: [0, 0, -1]}, markers: {tip: [0, 0, -1]}}\n"
        "loops: [{name: drive, type: motion, joint: lift, position: {polynomial: [1.05, -0.5]}}]\n"
        "effects: [{name: floor, type: contact, point: rod.tip, plane: world, restitution: 0.5, friction: %s}]\n";
    static const char *const friction[] = {"0.04", "0.2"};
    for (int k = 0; k < 2; k++) {
        char text[1024];
        kt_parsed m;
        kt_error error = {0};
        const kt_simulation_options options = kt_simulation_options_default();
        const kt_run run = kt_run_within(NULL, 1e-9, 0.11);
        (void)snprintf(text, sizeof text, scene, friction[k]);
        kt_parsed_make(&m, text);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        const kt_status status = kt_simulation_advance(simulation, 0.11, &error);
        kt_check_equal_int("status", status, k == 0 ? KT_OK : KT_ERROR_CONSTRAINT);
        if (k > 0)
            kt_check_contains("error", error.message, "no impulses separate it");
        kt_check_below("impacts", (double)kt_simulation_contacts(simulation).impacts, 10.0);
    }
}

/* A sphere falls between walls within its cones of friction. No impulse lets it bounce from one and rest on the other.
 * So both hold it, and restitutions are less there. */
KT_TEST(walls_within_its_cones_hold_a_sphere) {
    static const char scene[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: s, joint: {type: free, position: {position: [0.02, 0, 0.64]}, velocity: {linear: [0, -0.2, -1.5],\n"
        "     angular: [3, 5, 0.8]}}, mass: 8, inertia: [0.043, 0.043, 0.043], markers: {c: [0, 0, 0]}}\n"
        "effects:\n"
        "  - {name: left, type: contact, point: s.c, radius: 0.117, plane: world, axis: [0.952, 0, 0.306],\n"
        "     restitution: 0.3, friction: 0.9}\n"
        "  - {name: right, type: contact, point: s.c, radius: 0.117, plane: world, axis: [-0.867, 0, 0.498],\n"
        "     restitution: 0.3, friction: 0.9}\n";
    const kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_within(NULL, 1e-9, 0.6);
    kt_parsed m;
    kt_parsed_make(&m, scene);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_advance(simulation, 0.6);
    double most = 0.0;
    for (int i = 0; i < 3; i += 2) /* the sphere rolls along the walls */
        most = larger(most, fabs(kt_simulation_velocities(simulation)[i]));
    kt_check_near("speed between the walls, m/s", most, 0.0, 1e-9);
    kt_check_above("impacts with less restitution", (double)kt_simulation_contacts(simulation).reduced, 0.5);
}
