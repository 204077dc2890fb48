/* The law of rest in simulations. Random boxes on feet with different friction rest if and only if polygons inside or
 * outside of the cones allow it, for any mass. A rod that leans presses. Dry friction at late times moves a joint as at
 * zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "kinetree/simulation.h"
#include "simulation/simulation.h"

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

/* A rod leans on a floor, and another one slides. A number of their record is then replaced by a wrong one. The check
 * of records must find it, and name its place. */
KT_TEST(records_with_a_wrong_number_are_rejected) {
    static const struct {
        const char *what, *where, *message;
        bool slides;
        int acceleration, multiplier; /* index; -1: right */
        double factor;
    } wrong[] = {
        {"acceleration", "body 'rod'", "Newton's law", false, 0, -1, 0.0},
        {"acceleration of slip", "body 'rod'", "Newton's law", true, 0, -1, 0.0},
        {"normal force", "body 'rod'", "Newton's law", false, -1, 0, 1.0 + 1e-6},
        {"normal force of slip", "body 'rod'", "Newton's law", true, -1, 0, 1.0 - 1e-6},
        {"friction", "body 'rod'", "Newton's law", false, -1, 1, 1.0 - 1e-6},
        {"friction beyond its cone", "contact 'foot.stick'", "exceeds its friction", false, -1, 1, 2.0},
        {"normal force that pulls", "contact 'foot'", "pulls", true, -1, 0, -1.0},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char text[1024];
        kt_parsed m;
        kt_record record;
        kt_error error = {0};
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: rod, mass: 2, com: [0.5, 0, 0], inertia: [0.1, 0.2, 0.2],\n"
                       "     markers: {tip: [1, 0, 0]},\n"
                       "     joint: {type: %s}}\n"
                       "effects:\n  - {name: foot, type: contact, point: rod.tip, radius: 0, plane: world, "
                       "restitution: 0, friction: 0.5}\n",
                       wrong[i].slides ? "free, velocity: {linear: [1, 0, 0], angular: [0, 0, 0]}"
                                       : "revolute, axis: y, at: [0, 0, 0.8660254037844386], position: 60 deg");
        kt_parsed_make(&m, text);
        kt_run run = kt_run_fixed("dopri5", 0.0, 100.0);
        run.record = KT_RECORD_REACTION | KT_RECORD_ACCELERATION;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        kt_test_advance(simulation, 0.01);
        kt_need_fine("record", kt_simulation_sense(simulation, &record, &error), &error);
        kt_need_fine("law", kt_contacts_check_record(simulation, record.t, &error), &error);
        if (wrong[i].acceleration >= 0)
            simulation->a[wrong[i].acceleration] += 1e-6;
        else
            simulation->multiplier[wrong[i].multiplier] *= wrong[i].factor;
        kt_check_equal_int(wrong[i].what, kt_contacts_check_record(simulation, record.t, &error), KT_ERROR_STEP);
        kt_check_contains("place", error.where, wrong[i].where);
        kt_check_contains("time", error.where, "t = 0.01 s");
        kt_check_contains("message", error.message, wrong[i].message);
    }
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

/* Scenes that an oracle's random draws have found. The first scene has a solution that the cone solver once missed. In
 * the second scene, each impact makes a joint slip, which sticks before the next impact. In the third scene, a contact
 * that was opened for another one accelerated into its boundary. In the last scene, friction reached its limit and
 * stuck again at one instant without end. */
static const char *const found[][2] = {
    {"a box on three feet, two of which begin to slip, and a box on one foot, with a bar",
     "kinetree: 1\n"
     "gravity: [0.7560555353226921, -1.8214405972924974, -9.81]\n"
     "bodies:\n"
     "  - {name: b0, joint: {type: free, position: {position: [3.0, 0, 0.19648972680339555]}, "
     "velocity: {linear: [0, 0, 0], angular: [0, 0, 0]}}, mass: 0.2175574641130792, inertia: "
     "[0.0012143821368646654, 0.0014572585642375982, 0.0018215732052969977], markers: {c0: [0.2116, "
     "0.1051, -0.19648972680339555], c1: [-0.2021, 0.1224, -0.19648972680339555], c2: [-0.1125, "
     "-0.2078, -0.19648972680339555]}}\n"
     "  - {name: b1, joint: {type: free, position: {position: [6.0, 0, 0.10958132280335982]}, "
     "velocity: {linear: [0, 0, 0], angular: [0, 0, 0]}}, mass: 3.5721144054152623, inertia: "
     "[0.018594740326475217, 0.02231368839177026, 0.027892110489712827], markers: {c3: [0.2193, "
     "0.063, -0.10958132280335982]}}\n"
     "effects:\n"
     "  - {name: c0, type: contact, point: b0.c0, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.30400576241051136}\n"
     "  - {name: c1, type: contact, point: b0.c1, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.9335974538267856}\n"
     "  - {name: c2, type: contact, point: b0.c2, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.41831923363988377}\n"
     "  - {name: c3, type: contact, point: b1.c3, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.6702193887973302}\n"
     "loops:\n"
     "  - {name: bar, type: distance, between: [b1, b0]}\n"},
    {"an arm whose friction sticks between impacts",
     "kinetree: 1\n"
     "gravity: [-4.7600978770153155, -3.826163877122312, -9.81]\n"
     "bodies:\n"
     "  - {name: b0, joint: {type: revolute, axis: y, at: [0.0, 2.0, 0.07584992320759293], position: "
     "-0.03013540238040574, velocity: -0.13490690137935626}, mass: 1.0683389896298827, com: [0.2, 0, "
     "0], inertia: [0.009615050906668945, 0.011538061088002732, 0.014422576360003415]}\n"
     "  - {name: b1, parent: b0, joint: {type: prismatic, axis: z, at: [0.4, 0, 0], position: 0, "
     "velocity: -0.03650229650617942}, mass: 0.7975659975721845, com: [0.2, 0, 0], inertia: "
     "[0.007178093978149661, 0.008613712773779592, 0.010767140967224491], markers: {c0: [0.4, 0, "
     "-0.1]}}\n"
     "effects:\n"
     "  - {name: c0, type: contact, point: b1.c0, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0.4, friction: 0.2930737391075881}\n"
     "  - {name: d0, type: joint_friction, joint: b0, coulomb: 8.188178975721245, stick: true}\n"},
    {"a box on four feet carries a box on four feet",
     "kinetree: 1\n"
     "gravity: [1.3297132300201782, 0.44425803699373906, -9.81]\n"
     "bodies:\n"
     "  - {name: b0, joint: {type: free, position: {position: [3.0, 0, 0.07900791788863805]}, "
     "velocity: {linear: [-0.14172154987772867, -0.3099597610655114, 0], angular: [0, 0, "
     "0.07536141824866638]}}, mass: 0.13429686804636903, inertia: [0.0012171969879694008, "
     "0.0014606363855632807, 0.0018257954819541008], markers: {c0: [0.265, 0.1428, "
     "-0.07900791788863805], c1: [-0.0326, 0.2993, -0.07900791788863805], c2: [-0.257, -0.1568, "
     "-0.07900791788863805], c3: [0.007, -0.301, -0.07900791788863805]}}\n"
     "  - {name: b1, joint: {type: free, position: {position: [3.0, 0, 0.3761313103121183]}, "
     "velocity: {linear: [-0.14172154987772867, -0.3099597610655114, 0], angular: [0, 0, "
     "0.07536141824866638]}}, mass: 4.294744234825044, inertia: [0.004927282814847723, "
     "0.005912739377817267, 0.007390924222271584], markers: {c4: [0.1013, 0.0348, "
     "-0.21811547453484226], c5: [-0.0323, 0.1021, -0.21811547453484226], c6: [-0.1006, -0.0367, "
     "-0.21811547453484226], c7: [0.0236, -0.1045, -0.21811547453484226]}}\n"
     "effects:\n"
     "  - {name: c0, type: contact, point: b0.c0, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0}\n"
     "  - {name: c1, type: contact, point: b0.c1, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0}\n"
     "  - {name: c2, type: contact, point: b0.c2, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.9192807469943566}\n"
     "  - {name: c3, type: contact, point: b0.c3, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.7253751403316367}\n"
     "  - {name: c4, type: contact, point: b1.c4, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.07900791788863805]}, restitution: 0, friction: 0.26441947255899445}\n"
     "  - {name: c5, type: contact, point: b1.c5, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.07900791788863805]}, restitution: 0, friction: 0.3541097326520326}\n"
     "  - {name: c6, type: contact, point: b1.c6, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.07900791788863805]}, restitution: 0, friction: 0}\n"
     "  - {name: c7, type: contact, point: b1.c7, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.07900791788863805]}, restitution: 0, friction: 0}\n"},
    {"friction at its limit wedges a box on four feet",
     "kinetree: 1\n"
     "gravity: [0.6921319009546477, 1.3334468009260505, -9.81]\n"
     "bodies:\n"
     "  - {name: b0, joint: {type: free, position: {position: [3.0, 0, 0.29911029689927116]}, "
     "velocity: {linear: [0, 0, 0], angular: [0, 0, 0]}}, mass: 0.17752572260302713, inertia: "
     "[0.0005624026227060538, 0.0006748831472472644, 0.0008436039340590805], markers: {c0: [0.1501, "
     "0.0956, -0.29911029689927116], c1: [-0.0785, 0.1598, -0.29911029689927116], c2: [-0.1731, "
     "-0.0416, -0.29911029689927116], c3: [0.0105, -0.1777, -0.29911029689927116]}}\n"
     "  - {name: b1, joint: {type: free, position: {position: [3.0, 0, 0.8097288594455034]}, "
     "velocity: {linear: [0, 0, 0], angular: [0, 0, 0]}}, mass: 2.4738762572917965, inertia: "
     "[0.009321971329062038, 0.011186365594874445, 0.013982956993593058], markers: {c4: [0.151, "
     "0.1219, -0.21150826564696107], c5: [-0.1859, -0.0559, -0.21150826564696107]}}\n"
     "effects:\n"
     "  - {name: c0, type: contact, point: b0.c0, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.7603151948398381}\n"
     "  - {name: c1, type: contact, point: b0.c1, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0}\n"
     "  - {name: c2, type: contact, point: b0.c2, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.25503412409040915}\n"
     "  - {name: c3, type: contact, point: b0.c3, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
     "restitution: 0, friction: 0.11334901736217423}\n"
     "  - {name: c4, type: contact, point: b1.c4, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.29911029689927116]}, restitution: 0, friction: 0}\n"
     "  - {name: c5, type: contact, point: b1.c5, radius: 0, plane: {body: b0, at: [0, 0, "
     "0.29911029689927116]}, restitution: 0, friction: 0.8814308081028237}\n"},
};

KT_TEST(random_scenes_run_to_their_end) {
    for (size_t i = 0; i < sizeof found / sizeof *found; i++) {
        kt_parsed m;
        kt_error error = {0};
        kt_record record = {0};
        kt_parsed_make(&m, found[i][1]);
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_default();
        run.duration = 100.0;
        options.record = KT_RECORD_ACCELERATION | KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        for (int k = 0; k <= 8; k++) {
            kt_note("%s, %g s", found[i][0], 0.025 * k);
            if (kt_fine("motion", kt_simulation_advance(simulation, 0.025 * k, &error), &error))
                (void)kt_fine("record", kt_simulation_sense(simulation, &record, &error), &error);
        }
    }
}

/* A pulse of a force or of a motion at 0.137 s, between the stages of rk4 with steps of 0.1 s, which these steps cannot
 * see. The record within the pulse violates the law. In the three scenes, a force of 100 N lifts a block of 9.81 N, the
 * same force pushes it beyond its friction, and a drive moves it 0.04 m into the floor. The run ends with the place,
 * whatever is recorded. */
#define PULSE_BLOCK(position, axis)                                                                                    \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - {name: block, mass: 1, inertia: [1, 1, 1], joint: {type: " axis \
    ", position: " position "}, markers: {foot: [0, 0, 0]}}\neffects:\n  - {name: floor, type: contact, point: "       \
    "block.foot, radius: 0, plane: world, axis: z, restitution: 0, friction: 0.5}\n"
static const char *const violations[][3] = {
    {"a force lifts", "pulls",
     PULSE_BLOCK("0", "prismatic, axis: z") "  - {type: expression, joint: block, force: "
                                            "\"100*exp(-((t-0.137)/0.002)^2)\"}\n"},
    {"a force pushes aside", "exceeds its friction",
     PULSE_BLOCK("{}", "free") "  - {type: force, at: block.foot, value: [\"100*exp(-((t-0.137)/0.002)^2)\", 0, 0]}\n"},
    {"a drive penetrates", "open at a gap of -0.04",
     PULSE_BLOCK("0.01", "prismatic, axis: z") "loops:\n  - {name: drive, type: motion, joint: block, position: "
                                               "\"0.01 - 0.05*exp(-((t-0.137)/0.002)^2)\"}\n"},
};

static int count_records(const kt_record *record, void *user) {
    (void)record;
    ++*(int *)user;
    return 0;
}

KT_TEST(records_without_reactions_are_checked) {
    for (size_t i = 0; i < sizeof violations / sizeof *violations; i++) {
        kt_parsed m;
        kt_error error = {0};
        int records = 0;
        kt_note("%s", violations[i][0]);
        kt_parsed_make(&m, violations[i][2]);
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_fixed("rk4", 0.1, 0.411);
        run.interval = 0.137;
        options.record = KT_RECORD_POSITION;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        const kt_status status = kt_simulation_run(simulation, count_records, &records, &error);
        kt_check_equal_int("status", status, KT_ERROR_STEP);
        kt_check_equal_int("records before the violation", records, 1);
        kt_check_contains("message", error.message, violations[i][1]);
        kt_check_contains("place", error.where, "t = 0.137");
    }
}

/* A box slides on four feet, and its weight passes over the diagonal of two of them. A foot aside of it leaves,
 * and the opposite foot presses from then on, at first with a force of the size of rounding. It must not sink into the
 * floor in the meantime. Rounding decides which of the boxes shows this. */
KT_TEST(feet_that_begin_to_press_do_not_sink) {
    static const double velocities[][3] = {{0.24752303899608075, 0.11310335164148633, 0.8414073530816257},
                                           {0.904934776536539, 0.15558961560240614, 0.027543326375274013}};
    for (size_t i = 0; i < sizeof velocities / sizeof *velocities; i++) {
        kt_parsed m;
        kt_error error = {0};
        char text[2048];
        int records = 0;
        (void)snprintf(
            text, sizeof text,
            "kinetree: 1\ngravity: [0.19862035063097894, -4.3886661824219795, -9.81]\nbodies:\n"
            "  - name: box\n    mass: 3.7225049798660708\n"
            "    inertia: [0.03686552785980859, 0.0442386334317703, 0.05529829178971287]\n"
            "    joint: {type: free, position: {position: [9, 0, 0.12819575730846544]}, velocity: {linear: [%.17g, "
            "%.17g, "
            "0], angular: [0, 0, %.17g]}}\n"
            "    markers: {a: [0.3078, 0.0654, -0.12819575730846544], b: [-0.191, 0.2501, -0.12819575730846544],"
            " c: [-0.262, -0.1743, -0.12819575730846544], d: [0.186, -0.2538, -0.12819575730846544]}\n"
            "effects:\n"
            "  - {name: a, type: contact, point: box.a, radius: 0, plane: world, axis: z, restitution: 0.4,"
            " friction: 0.8808283723153202}\n"
            "  - {name: b, type: contact, point: box.b, radius: 0, plane: world, axis: z, restitution: 0.4, friction: "
            "0}\n"
            "  - {name: c, type: contact, point: box.c, radius: 0, plane: world, axis: z, restitution: 0.4,"
            " friction: 0.7936331347771548}\n"
            "  - {name: d, type: contact, point: box.d, radius: 0, plane: world, axis: z, restitution: 0.4,"
            " friction: 0.8910170664720403}\n",
            velocities[i][0], velocities[i][1], velocities[i][2]);
        kt_parsed_make(&m, text);
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_within(NULL, 1e-9, 0.2);
        run.interval = 0.025;
        options.record = KT_RECORD_POSITION;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("slides", kt_simulation_run(simulation, count_records, &records, &error), &error);
        kt_check_equal_int("records", records, 9);
    }
}

/* A load touches a box in flight, and both fall alike: their contacts have no forces, and friction is at its limit of
 * zero. At such an instant friction ends, and its contact must not close again with friction that sticks. Rounding
 * decides whether the instant occurs. This is a random scene of command/contact_oracle in which it does. */
static const char falling_load[] =
    "{kinetree: 1, gravity: [-1.4407477594751894, 0.7003512447433083, -9.81], bodies: [{name: b0, joint: "
    "{type: free, position: {position: [3.0, 0, 0.2845793519165886]}, velocity: {linear: "
    "[-0.3170166295326353, 0.20219712061644235, 0], angular: [0, 0, -0.6684654308358866]}}, mass: "
    "0.12526078273762684, com: [0, 0, 0], inertia: [0.0012591509700325583, 0.0015109811640390697, "
    "0.001888726455048837], markers: {c0: [0.2985, 0.1069, -0.2645793519165886], c1: [-0.1715, 0.2667, "
    "-0.2645793519165886], c2: [-0.2604, -0.1809, -0.2645793519165886], c3: [0.0113, -0.3169, "
    "-0.2645793519165886]}}, {name: b1, joint: {type: free, position: {position: [3.0, 0, "
    "0.6351620428401594]}, velocity: {linear: [-0.3170166295326353, 0.20219712061644235, 0], angular: [0, "
    "0, -0.6684654308358866]}}, mass: 1.5982425699684442, com: [0, 0, 0], inertia: "
    "[0.0030990389043642017, 0.003718846685237042, 0.004648558356546303], markers: {c4: [0.139, 0.0076, "
    "-0.08600333900698225], c5: [-0.0751, 0.1172, -0.08600333900698225], c6: [-0.019, -0.1379, "
    "-0.08600333900698225]}}, {name: b2, joint: {type: free, position: {position: [9.0, 0, "
    "0.2213326877362847]}, velocity: {linear: [0.4922921435313523, 0.8195918923370997, 0], angular: [0, "
    "0, -0.29958718958870567]}}, mass: 7.346250648867376, com: [0, 0, 0], inertia: [0.06378988258792775, "
    "0.0765478591055133, 0.09568482388189162], markers: {c7: [0.262, 0.1349, -0.2013326877362847]}}], "
    "effects: [{name: c0, type: contact, point: b0.c0, radius: 0, plane: {body: world, at: [0, 0, 0]}, "
    "restitution: 0.4, friction: 0.32990608628979856}, {name: c1, type: contact, point: b0.c1, radius: 0, "
    "plane: {body: world, at: [0, 0, 0]}, restitution: 0.4, friction: 0.4823939021883996}, {name: c2, "
    "type: contact, point: b0.c2, radius: 0, plane: {body: world, at: [0, 0, 0]}, restitution: 0.4, "
    "friction: 0}, {name: c3, type: contact, point: b0.c3, radius: 0, plane: {body: world, at: [0, 0, "
    "0]}, restitution: 0.4, friction: 0.6941835369413042}, {name: c4, type: contact, point: b1.c4, "
    "radius: 0, plane: {body: b0, at: [0, 0, 0.2645793519165886]}, restitution: 0.4, friction: 0}, {name: "
    "c5, type: contact, point: b1.c5, radius: 0, plane: {body: b0, at: [0, 0, 0.2645793519165886]}, "
    "restitution: 0.4, friction: 0.9512477512898638}, {name: c6, type: contact, point: b1.c6, radius: 0, "
    "plane: {body: b0, at: [0, 0, 0.2645793519165886]}, restitution: 0.4, friction: 0}, {name: c7, type: "
    "contact, point: b2.c7, radius: 0, plane: {body: world, at: [0, 0, 0]}, restitution: 0.4, friction: "
    "0.691409030502456}], loops: []} ";

KT_TEST(load_on_a_falling_box_does_not_stick_and_slip_without_end) {
    kt_parsed m;
    kt_error error = {0};
    int records = 0;
    kt_parsed_make(&m, falling_load);
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_within(NULL, 1e-9, 0.2);
    run.interval = 0.025;
    options.record =
        KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ACCELERATION | KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("falls", kt_simulation_run(simulation, count_records, &records, &error), &error);
    kt_check_equal_int("records", records, 9);
}

/* Rows of contacts are stored over their group, and read at the coordinates of their paths alone (islands.c). The rates
 * of random velocities must have the bits of the sums over the whole group. */
static int count_wrong_rows(const struct kt_contacts *c, const double *x, int *read, int *stored) {
    int wrong = 0;
    for (int k = 0; k < c->n; k++) {
        const kt_loop_record *loop = &c->all->loop[c->item[k].loop];
        const kt_group *group = &c->all->group[loop->group];
        for (int r = 0; r < loop->row_count; r++) {
            const double *row = c->jacobian + kt_loop_entry(group, loop, r);
            double sum = -c->rate[kt_contact_row(c->all, &c->item[k]) + r];
            for (int j = 0; j < group->v_count; j++)
                sum += row[j] * x[c->all->group_v[group->v + j]];
            wrong += kt_contacts_rate(c, k, r, x) != c->item[k].sign * sum;
            *read += c->item[k].count;
            *stored += group->v_count;
        }
    }
    return wrong;
}

KT_TEST(rows_of_contacts_are_read_at_the_coordinates_of_their_paths) {
    kt_random random = kt_random_of_test();
    int wrong = 0, read = 0, stored = 0;
    for (size_t i = 0; i < sizeof found / sizeof *found; i++) {
        kt_parsed m;
        kt_error error = {0};
        double x[64];
        const kt_run run = kt_run_fixed("dopri5", 0.0, 100.0);
        kt_parsed_make(&m, found[i][1]);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        for (int k = 0; k < 64; k++)
            x[k] = kt_random_uniform(&random, -1.0, 1.0);
        kt_need_fine("equations",
                     kt_contacts_find_equations(simulation->contacts, simulation->model, 0.0,
                                                kt_simulation_positions(simulation), x, true, &error),
                     &error);
        wrong += count_wrong_rows(simulation->contacts, x, &read, &stored);
    }
    kt_check_equal_int("rows with another rate", wrong, 0);
    kt_check_below("coordinates that are read, of those stored", (double)read / stored, 0.9);
}
