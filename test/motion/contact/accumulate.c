/* Impacts that accumulate are applied one by one up to the rest velocity: a point in an acute wedge, without gravity.
 *
 * Let the planes have the angle alpha between them, and restitution e. The impact at one plane, with the rates -1 there
 * and x at the other, leaves e there and x - (1 + e) cos alpha at the other. If the last number is negative, the other
 * plane is next. These numbers are the whole motion: gaps and masses do not occur in them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>

#include "check.h"
#include "motion/simulation/parsed.h"
#include "random.h"

static const double rest_velocity = 1e-6; /* the default, m/s */

typedef struct wedge {
    double angle, e, mass, rate[2], gap[2]; /* of the first plane, which closes first, and of the second one */
} wedge;

static void draw_wedge(kt_random *random, wedge *w) {
    w->mass = pow(10.0, kt_random_uniform(random, -6.0, 6.0));
    w->angle = kt_random_uniform(random, 0.1, 0.4);
    /* a double root of the ratio of rates is where the point just leaves: (1 + e) cos alpha = 2 sqrt(e) */
    const double root = (1.0 - sin(w->angle)) / cos(w->angle), most = root * root;
    w->e = (1.0 - pow(10.0, kt_random_uniform(random, -4.0, -0.1))) * most;
    w->rate[0] = -kt_random_uniform(random, 0.5, 2.0);
    w->rate[1] = kt_random_uniform(random, 0.0, 0.2) * w->rate[0];
    w->gap[0] = kt_random_uniform(random, 0.01, 0.02);
    w->gap[1] = kt_random_uniform(random, 0.1, 0.2);
}

/* The number of impacts until none is faster than the rest velocity. */
static int count_impacts(const wedge *w) {
    double closing = -w->rate[0], other = w->rate[1];
    int count = 0;
    while (closing > rest_velocity && count < 100000) {
        const double next = (1.0 + w->e) * cos(w->angle) * closing - other;
        other = w->e * closing;
        closing = next;
        count++;
    }
    return count;
}

static int ignore_record(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

/* Runs the point between the planes y = 0 and y cos alpha = x sin alpha. */
static kt_contact_counts run_wedge(const wedge *w, double interval, double *far, double *fast) {
    char text[2048];
    const double c = cos(w->angle), s = sin(w->angle), y = w->gap[0], x = (w->gap[1] + c * y) / s;
    const double vy = w->rate[0], vx = (w->rate[1] + c * vy) / s;
    kt_parsed m;
    kt_error error = {0};
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n  - name: p\n    mass: %.17g\n    inertia: [1, 1, 1]\n    markers: {c: [0, 0, 0]}\n"
        "    joint: {type: free, position: {position: [%.17g, %.17g, 0]}, velocity: {linear: [%.17g, %.17g, 0]}}\n"
        "effects:\n  - {name: a, type: contact, point: p.c, radius: 0, plane: world, axis: y, restitution: %.17g}\n"
        "  - {name: b, type: contact, point: p.c, radius: 0, plane: world, axis: [%.17g, %.17g, 0], "
        "restitution: %.17g}\n",
        w->mass, x, y, vx, vy, w->e, s, -c, w->e);
    kt_parsed_make(&m, text);
    kt_run run = kt_run_within("dopri5", 1e-9, 20.0);
    run.interval = interval;
    const kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("runs", kt_simulation_run(simulation, ignore_record, NULL, &error), &error);
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    *far = fmax(fabs(q[0]), fabs(q[1]));
    *fast = fmax(fabs(v[0]), fabs(v[1]));
    return kt_simulation_contacts(simulation);
}

KT_TEST(point_in_a_wedge_rests_after_all_impacts_whatever_the_records) {
    static const double intervals[] = {3.0, 0.1, 0.0037};
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("distance from the edge, m"), speed = kt_worst_make("speed at the end, m/s"),
             count = kt_worst_make("impacts, relative to those of the recurrence");
    int most = 0;
    for (int n = 0; n < 40; n++) {
        wedge w;
        draw_wedge(&random, &w);
        const int expected = count_impacts(&w);
        most = expected > most ? expected : most;
        for (int i = 0; i < 3; i++) {
            double far, fast;
            const kt_contact_counts counts = run_wedge(&w, intervals[i], &far, &fast);
            kt_worst_near(&place, far, 0.0, 1e-7, "wedge %d, interval %g", n, intervals[i]);
            kt_worst_near(&speed, fast, 0.0, rest_velocity / sin(w.angle), "wedge %d, interval %g", n, intervals[i]);
            kt_worst_near(&count, (double)counts.impacts, expected, 1.0, "wedge %d: angle %g, e %g", n, w.angle, w.e);
        }
    }
    kt_check_above("impacts of one wedge", most, 100.0);
}
