/* The scenes of the notes' syllabus (helicopters, landing gear, control surfaces), each against its theory. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "reference/scene.h"

#include "kinetree/analysis.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

enum { NUMBERS = 200 };

/* A scene at its initial state. */
typedef struct opened {
    kt_case c;
    kt_data *data;
    double q[NUMBERS], v[NUMBERS];
} opened;

static bool open_scene(opened *o, const char *name) {
    kt_error e = {0};
    memset(o, 0, sizeof *o);
    o->c = kt_case_open(name);
    o->data = kt_test_data(o->c.model);
    kt_model_initial(o->c.model, o->q, o->v);
    return kt_fine("assembled", kt_state_assemble(o->c.model, o->data, 0.0, o->q, o->v, &e), &e);
}

/* Modes about the state, by rising |lambda|; how many. */
static int modes_of(const opened *o, kt_mode *mode, int most) {
    kt_error e = {0};
    int count = 0;
    kt_linearization *linearization = kt_test_linearization(o->c.model, NULL);
    kt_need_fine("its evaluation", kt_linearization_evaluate(linearization, 0.0, o->q, o->v, NULL, &e), &e);
    kt_modes *modes = kt_test_modes(o->c.model);
    kt_need_fine("their evaluation", kt_modes_evaluate(modes, kt_linearization_system(linearization), &e), &e);
    for (; count < kt_modes_count(modes) && count < most; count++)
        mode[count] = kt_modes_at(modes, count);
    return count;
}

/* ---- landing gear ------------------------------------------------------------------------------------------------ */

/* Let y be the pin's position, theta the fork's angle, and a the trail. The mass m is at l behind the pin, with I about
 * it. There is no slip: `y' = a theta' + V theta`. The ground's multiplier is eliminated:
 *
 *     (I + m (a - l)^2) s^3 + m (a - l) V s^2 + k a^2 s + k a V = 0
 *
 * Routh: stable at any speed if m l (a - l) > I, else at none. */
static double cubic(double s_re, double s_im, const double *p) {
    double re = p[3], im = 0.0;
    for (int i = 2; i >= 0; i--) {
        const double next = re * s_re - im * s_im + p[i];
        im = re * s_im + im * s_re;
        re = next;
    }
    return hypot(re, im);
}

KT_TEST(nose_wheels_shimmy_by_the_cubic_of_a_towed_wheel) {
    opened o;
    if (open_scene(&o, "nose-wheel-shimmy")) {
        const double V = 30.0, m = 20.0, a = 0.3, l = 0.2, I = 0.6, k = 50000.0;
        const double p[4] = {k * a * V, k * a * a, m * (a - l) * V, I + m * (a - l) * (a - l)};
        kt_mode mode[8];
        KT_WORST residual = kt_worst_make("cubic at an eigenvalue, over its terms");
        int found = 0, growing = 0;
        o.q[kt_case_q(&o.c, "fork")] = o.v[kt_case_v(&o.c, "fork")] = o.v[kt_case_v(&o.c, "pin")] = 0.0;
        o.v[kt_case_v(&o.c, "wheel")] = V / 0.15;
        const int count = modes_of(&o, mode, 8);
        for (int i = 0; i < count; i++) {
            const double size = hypot(mode[i].real, mode[i].imaginary);
            if (size < 1.0)
                continue;
            found += mode[i].count;
            growing += mode[i].real > 0.1 ? mode[i].count : 0;
            kt_worst_near(&residual, cubic(mode[i].real, mode[i].imaginary, p) / (p[3] * size * size * size), 0.0,
                          4e-13, "%g + %g i", mode[i].real, mode[i].imaginary);
        }
        kt_check_equal_int("eigenvalues", found, 3);
        kt_check_equal_int("of which grow: m l (a - l) is 0.4, I is 0.6", growing, 2);
    }
}

/* ---- helicopters ------------------------------------------------------------------------------------------------- */

/* The height of the horn follows from the circle about the blade's axis and the sphere about the link's lower end. It
 * is found by bisection, without the tree or its loops. */
typedef struct plate {
    double tilt, rise, height, horn, out, link, ring;
} plate;

static double link_error(const plate *p, double azimuth, double ring, double pitch) {
    /* the ring's point in the plate's axes, tilted about x and raised */
    const double x = p->out * cos(ring) - p->horn * sin(ring), y = p->out * sin(ring) + p->horn * cos(ring);
    const double low[3] = {x, y * cos(p->tilt), y * sin(p->tilt) + p->rise};
    const double along = p->out, across = p->horn * cos(pitch);
    const double high[3] = {along * cos(azimuth) - across * sin(azimuth), along * sin(azimuth) + across * cos(azimuth),
                            p->height + p->horn * sin(pitch)};
    const double d[3] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - p->link;
}

/* The scissors keep (-ring, 0) of the ring in the plane of the shaft: tan(ring angle) cos(tilt) = tan(azimuth). */
static double ring_of(const plate *p, double azimuth) {
    return azimuth + atan2((cos(p->tilt) - 1.0) * -sin(azimuth) * cos(azimuth),
                           cos(p->tilt) * cos(azimuth) * cos(azimuth) + sin(azimuth) * sin(azimuth));
}

static double pitch_of(const plate *p, double azimuth) {
    double low = -0.5, high = 0.5;
    const double ring = ring_of(p, azimuth);
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (link_error(p, azimuth, ring, middle) < 0.0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

typedef struct pitches {
    const opened *o;
    plate p;
    kt_worst worst;
    double most, least;
} pitches;

static int note_pitch(const kt_record *record, void *user) {
    pitches *n = user;
    const double azimuth = record->q[kt_case_q(&n->o->c, "shaft")], pitch = record->q[kt_case_q(&n->o->c, "blade1")];
    kt_worst_near(&n->worst, pitch, pitch_of(&n->p, azimuth), 2e-14, "azimuth %g", azimuth);
    n->most = fmax(n->most, pitch);
    n->least = fmin(n->least, pitch);
    return 0;
}

KT_TEST(pitch_links_turn_blades_by_the_tilt_of_the_swashplate) {
    opened o;
    pitches n = {.o = &o,
                 .p = {6.0 * pi / 180.0, 0.01, 0.6, 0.15, 0.1, 0.6, 0.18},
                 .worst = kt_worst_make("pitch against the geometry, rad")};
    if (open_scene(&o, "swashplate") && kt_case_run(&o.c, &(kt_setting){.integrator = NULL}, 0.001, note_pitch, &n)) {
        kt_check_worst(&n.worst);
        /* the ring's point is hypot(out, horn) from the axis: cyclic pitch by the tilt, over the horn */
        const double amplitude = hypot(0.1, 0.15) * sin(n.p.tilt) / 0.15;
        kt_check_near("cyclic pitch, rad", 0.5 * (n.most - n.least), amplitude, 0.02 * amplitude);
    }
}

/* Flap stiffened by rotation; 16 segments are 0.4 % off at this speed. */
KT_TEST(hingeless_rotors_flap_at_wrights_frequency) {
    opened o;
    kt_mode mode[4];
    if (open_scene(&o, "hingeless-rotor") && kt_check_equal_int("modes", modes_of(&o, mode, 4), 4)) {
        kt_check_near("first flap of one blade, a turn", mode[0].imaginary / 40.0, 11.2023 * 4.0 / 40.0, 5e-3);
        kt_check_near("and of the other", mode[1].imaginary / 40.0, 11.2023 * 4.0 / 40.0, 5e-3);
    }
}

static double growth_of(const char *name) {
    opened o;
    kt_error e = {0};
    const kt_floquet_options options = kt_floquet_options_default(2.0 * pi / 17.0);
    kt_need(open_scene(&o, name));
    kt_floquet *f = kt_test_floquet(o.c.model, &options);
    kt_need_fine("evaluate", kt_floquet_evaluate(f, 0.0, o.q, o.v, &e), &e);
    return kt_floquet_at(f, 0).growth;
}

/* The roots of Coleman's equations are found in test/study/analysis/floquet.c. */
KT_TEST(rotors_on_the_ground_grow_or_decay_as_coleman_says) {
    kt_check_near("without dampers, 1/s", growth_of("ground-resonance"), 1.20295924, 2e-8);
    kt_check_near("with lag dampers, 1/s", growth_of("lag-dampers"), -0.94834835, 2e-8);
}

/* ---- control surfaces -------------------------------------------------------------------------------------------- */

typedef struct track {
    const opened *o;
    kt_worst worst;
} track;

/* |(s + c cos t, c sin t) - p| = L: c (s - px) cos t - c py sin t = (L^2 - c^2 - (s - px)^2 - py^2) / 2 */
static int note_flap(const kt_record *record, void *user) {
    track *n = user;
    const double s = record->q[kt_case_q(&n->o->c, "carriage")], c = 0.4, L = 0.5, px = 0.3, py = -0.35;
    const double A = c * (s - px), B = -c * py, C = 0.5 * (L * L - c * c - (s - px) * (s - px) - py * py);
    const double angle = atan2(B, A) - acos(C / hypot(A, B));
    kt_worst_near(&n->worst, record->q[kt_case_q(&n->o->c, "flap")], angle, 1e-14, "out by %g m", s);
    return 0;
}

KT_TEST(a_flap_on_its_track_turns_as_its_link_says) {
    opened o;
    track n = {.o = &o, .worst = kt_worst_make("angle of the flap, rad")};
    if (open_scene(&o, "flap-track") && kt_case_run(&o.c, &(kt_setting){.integrator = NULL}, 0.01, note_flap, &n))
        kt_check_worst(&n.worst);
}
