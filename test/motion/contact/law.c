/* The law of rest in simulations. Random boxes on feet with different friction rest if and only if polygons inside or
 * outside of the cones allow it, for any mass. A rod that leans presses. Dry friction at late times moves a joint as at
 * zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "math/cone/squares.h"
#include "motion/simulation/parsed.h"

enum { FEET = 8, EDGES = 96 };
static const double g = 9.81;

typedef struct box {
    int feet;
    double mass, height, foot[FEET][2], mu[FEET], tilt[2]; /* gravity along x and y, as parts of that along -z */
} box;

static void draw_box(kt_random *random, box *b) {
    b->feet = kt_random_int(random, 3, FEET);
    b->mass = pow(10.0, kt_random_uniform(random, -6.0, 6.0));
    b->height = kt_random_uniform(random, 0.05, 0.3);
    for (int i = 0; i < b->feet; i++) {
        for (int k = 0; k < 2; k++)
            b->foot[i][k] = kt_random_uniform(random, -0.5, 0.5);
        b->mu[i] = kt_random_uniform(random, 0.1, 1.0);
    }
    for (int k = 0; k < 2; k++)
        b->tilt[k] = kt_random_uniform(random, -0.4, 0.4);
}

/* Whether forces in polygons balance the weight. widen: their corners, relative to the discs. */
static bool may_rest(const box *b, double widen, squares *s) {
    s->m = 6;
    s->columns = 0;
    const double load[6] = {-b->tilt[0], -b->tilt[1], 1.0, 0.0, 0.0, 0.0};
    memcpy(s->c, load, sizeof load);
    for (int i = 0; i < b->feet; i++)
        for (int e = 0; e < EDGES; e++) {
            const double angle = 2.0 * acos(-1.0) * e / EDGES, mu = widen * b->mu[i];
            const double f[3] = {mu * cos(angle), mu * sin(angle), 1.0};
            const double r[3] = {b->foot[i][0], b->foot[i][1], -b->height};
            double *column = s->A[s->columns++];
            for (int k = 0; k < 3; k++) {
                column[k] = f[k];
                column[3 + k] = r[(k + 1) % 3] * f[(k + 2) % 3] - r[(k + 2) % 3] * f[(k + 1) % 3];
            }
        }
    return solve_squares(s) < 1e-7;
}

static kt_simulation *start_box(const box *b, kt_parsed *m) {
    char text[8192];
    size_t used = (size_t)snprintf(text, sizeof text,
                                   "kinetree: 1\ngravity: [%.17g, %.17g, %.17g]\nbodies:\n"
                                   "  - name: box\n    mass: %.17g\n    inertia: [%.17g, %.17g, %.17g]\n"
                                   "    joint: {type: free, position: {position: [0, 0, %.17g]}}\n    markers:\n",
                                   g * b->tilt[0], g * b->tilt[1], -g, b->mass, 0.1 * b->mass, 0.1 * b->mass,
                                   0.15 * b->mass, b->height);
    for (int i = 0; i < b->feet; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "      p%d: [%.17g, %.17g, %.17g]\n", i,
                                 b->foot[i][0], b->foot[i][1], -b->height);
    used += (size_t)snprintf(text + used, sizeof text - used, "effects:\n");
    for (int i = 0; i < b->feet; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: c%d, type: contact, point: box.p%d, radius: 0, plane: world, axis: z, "
                                 "restitution: 0, friction: %.17g}\n",
                                 i, i, b->mu[i]);
    kt_parsed_make(m, text);
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed("dopri5", 0.0, 100.0);
    options.record = KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    return kt_test_simulation(m->model, &run, &options);
}

/* How far recorded forces are outside of their cones, relative to the weight. */
static double outside_of(const kt_record *record, const box *b) {
    double most = 0.0;
    for (int i = 0; i < b->feet; i++) {
        const kt_vec3 N = record->loop_reactions[2 * i].force, T = record->loop_reactions[2 * i + 1].force;
        most = fmax(most, hypot(N.x + T.x, N.y + T.y) - b->mu[i] * fabs(N.z + T.z));
    }
    return most / (b->mass * g);
}

KT_TEST(boxes_on_feet_rest_where_polygons_have_it) {
    kt_random random = kt_random_of_test();
    KT_WORST cones = kt_worst_make("outside of cones");
    squares *s = malloc(sizeof *s);
    int rests = 0, moves = 0, wrong = 0;
    for (int k = 0; k < kt_sample(KT_SHORT(60, 600)); k++) {
        box b;
        draw_box(&random, &b);
        const bool inside = may_rest(&b, 0.999, s), outside = !may_rest(&b, 1.002, s);
        if (!inside && !outside)
            continue;
        kt_parsed m;
        kt_record record = {0};
        kt_error error = {0};
        double speed = 0.0;
        kt_simulation *simulation = start_box(&b, &m);
        kt_test_advance(simulation, 1e-3);
        for (int i = 0; i < 6; i++)
            speed = fmax(speed, fabs(kt_simulation_velocities(simulation)[i]));
        rests += inside;
        moves += outside;
        wrong += (speed > 0.0) != outside;
        if (inside && kt_check_true("record", kt_simulation_sense(simulation, &record, &error) == KT_OK))
            kt_worst_below(&cones, outside_of(&record, &b), 1e-9, "box %d", k);
    }
    kt_check_above("boxes that rest", rests, 15.0);
    kt_check_above("boxes that move", moves, 15.0);
    kt_check_equal_int("others than the oracle has it", wrong, 0);
    free(s);
}

/* A rod of 2 kg, pinned at its top and 60 degrees steep, leans with its tip on a floor. The moments
 * N cos 60 + T sin 60 = m g cos 60 / 2 and |T| <= N / 2 allow N between 5.26 N and 73.2 N. The least force has
 * T = N / 2. */
KT_TEST(rod_that_leans_presses) {
    kt_parsed m;
    kt_record record = {0};
    kt_error error = {0};
    kt_parsed_make(&m, "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: rod, mass: 2, shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]},\n"
                       "     joint: {type: revolute, axis: y, at: [0, 0, 0.8660254037844386], position: 60 deg}}\n"
                       "effects:\n  - {name: foot, type: contact, point: rod.tip, radius: 0, plane: world, "
                       "restitution: 0, friction: 0.5}\n");
    kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_fixed("dopri5", 0.0, 100.0);
    options.record = KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_advance(simulation, 3.0);
    kt_need(kt_check_true("record", kt_simulation_sense(simulation, &record, &error) == KT_OK));
    const double least = 2.0 * g * 0.5 * 0.5 / (0.5 + 0.5 * sqrt(0.75));
    kt_check_near("normal force, N", fabs(record.loop_reactions[0].force.z), least, 1e-6);
    kt_check_equal_int("rejected steps", (long long)kt_simulation_counts_of(simulation).rejected, 0);
}

/* A joint of little inertia under a pulse comes to rest at the same place if the pulse comes 1e4 s later, where a
 * rounding of the time changes its rate by 5e-8 rad/s. */
KT_TEST(dry_friction_stops_a_joint_at_late_times_as_at_zero) {
    double end[2];
    for (int i = 0; i < 2; i++) {
        const double t0 = 1e4 * i;
        char text[1024];
        kt_parsed m;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\nbodies:\n"
                       "  - {name: a, joint: {type: revolute, axis: z}, mass: 1e-3, inertia: [1e-5, 1e-5, 1e-5]}\n"
                       "effects:\n  - {type: joint_spring, joint: a, stiffness: 0.2}\n"
                       "  - {type: motor, joint: a, torque: {table: [[%.17g, 0], [%.17g, 0.25], [%.17g, 0]]}}\n"
                       "  - {name: dry, type: joint_friction, joint: a, coulomb: 0.011, static: 0.015, stribeck: 0, "
                       "stick: true}\n",
                       t0, t0 + 0.015811387753, t0 + 0.031622775507);
        kt_parsed_make(&m, text);
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_fixed("dopri5", 0.0, 100.0);
        run.relative = run.absolute = 1e-9;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_test_advance(simulation, t0 + 0.42);
        end[i] = kt_simulation_positions(simulation)[0];
        kt_check_near("rests", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
    }
    kt_check_near("place at late times, rad", end[1], end[0], 1e-8);
    kt_check_near("place, rad", end[0], -0.05915, 1e-5);
}
