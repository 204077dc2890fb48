/* Beams: the bodies and effects of a section, and the errors of wrong beams. Frequencies, large deflections and
 * rotation are compared with closed forms and published numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "collect.h"

#include "kinetree/analysis.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* A scene of one beam, its state, and the workspaces for its modes and equilibria. */
typedef struct beam {
    kt_opened at;
    kt_linearization *linearization;
    kt_modes *modes;
    double q[1200], v[1200];
} beam;

static void release_modes(void *modes) { kt_modes_free(modes); }

static void open_beam(beam *b, const char *text) {
    kt_error e = {0};
    b->at = kt_test_open(kt_test_scene(text), NULL);
    b->linearization = kt_test_linearization(b->at.model, NULL);
    kt_need_fine("modes", kt_modes_create(b->at.model, &b->modes, &e), &e);
    kt_test_own(b->modes, release_modes);
    kt_model_initial(b->at.model, b->q, b->v);
    kt_need_fine("assembled", kt_state_assemble(b->at.model, b->at.data, 0.0, b->q, b->v, &e), &e);
}

/* The first `count` frequencies that are not zero, rad/s. */
static void frequencies(const char *text, double *omega, int count) {
    static beam b;
    kt_error e = {0};
    int found = 0;
    open_beam(&b, text);
    kt_need_fine("linearised", kt_linearization_evaluate(b.linearization, 0.0, b.q, b.v, NULL, &e), &e);
    kt_need_fine("their modes", kt_modes_evaluate(b.modes, kt_linearization_system(b.linearization), &e), &e);
    for (int i = 0; i < kt_modes_count(b.modes) && found < count; i++)
        if (kt_modes_at(b.modes, i).imaginary > 1e-3)
            omega[found++] = kt_modes_at(b.modes, i).imaginary;
    kt_need(kt_check_equal_int("frequencies", found, count));
}

/* ---- frequencies ------------------------------------------------------------------------------------------------- */

/* The text with a number in place of '@'. */
static void count_segments(char *text, size_t size, const char *format, int segments) {
    const int before = (int)strcspn(format, "@");
    snprintf(text, size, "%.*s%d%s", before, format, segments, format + before + 1);
}

/* The order at which n, 2 n and 4 n segments approach a value, and how near the finest comes. */
static void check_order(const char *what, const char *format, int first, int mode, double exact, double order,
                        double error) {
    double omega[8], off[3];
    char text[1024];
    for (int i = 0; i < 3; i++) {
        count_segments(text, sizeof text, format, first << i);
        frequencies(text, omega, mode + 1);
        off[i] = fabs(omega[mode] - exact);
    }
    kt_note("%s: %.6g, %.4g %.4g %.4g off with %d, %d, %d segments", what, exact, off[0], off[1], off[2], first,
            2 * first, 4 * first);
    kt_check_below("error over the value", off[2] / exact, error);
    kt_check_near("order of the coarser two", log2(off[0] / off[1]), order, 0.5);
    kt_check_near("order of the finer two", log2(off[1] / off[2]), order, 0.2);
}

#define PLANE "kinetree: 1\nbeams:\n  - {name: b, segments: @, length: 1, mass_per_length: 1, EI: 1"

/* Roots of 1 + cos x cosh x = 0, squared: 3.516, 22.03, 61.70 [S. Timoshenko, Vibration Problems in Engineering]. */
KT_TEST(cantilevers_converge_to_eulers_frequencies_at_second_order) {
    check_order("first", PLANE "}\n", 8, 0, 3.51601526850015, 2.0, 2e-3);
    check_order("second", PLANE "}\n", 8, 1, 22.0344915646688, 2.0, 3e-3);
    check_order("third", PLANE "}\n", 8, 2, 61.6972144135491, 2.0, 4e-3);
}

/* Hinged at both ends (n pi)^2; clamped at both, and free at both, 22.3733. Without a clamped end errors of the second
 * order cancel, those of masses against those of springs. Between fixed ends a straight beam must stretch: one that
 * keeps its length is at a singular position there. */
KT_TEST(other_ends_have_their_own_frequencies) {
    static const char stretching[] =
        "kinetree: 1\nbeams:\n  - {name: b, to: {body: world, at: [1, 0, 0]}, segments: @, "
        "length: 1, mass_per_length: 1, EA: 1e6, GA: [1e6, 1e6], GJ: 1, EI: [1, 9]";
    char text[3][512];
    double omega[1];
    snprintf(text[0], sizeof text[0], "%s, ends: [hinged, hinged]}\n", stretching);
    snprintf(text[1], sizeof text[1], "%s}\n", stretching);
    snprintf(text[2], sizeof text[2], "%s, ends: [free, free]}\n", PLANE);
    check_order("clamped", text[1], 6, 0, 22.3732854480611, 2.0, 8e-3);
    check_order("free", text[2], 6, 0, 22.3732854480611, 4.0, 2e-4);
    count_segments(text[2], sizeof text[2], text[0], 12);
    frequencies(text[2], omega, 1); /* shear and rotary inertia take 1e-5 of it */
    kt_check_near("hinged", omega[0], pi * pi, 4e-4);
}

#define SPACE                                                                                                          \
    "kinetree: 1\nbeams:\n  - {name: b, segments: @, length: 2, mass_per_length: 3, inertia_per_length: 0.3, EA: "     \
    "12, "                                                                                                             \
    "GA: [1e9, 1e9], GJ: 30, EI: [1e6, 4e6]}\n"

/* A soft spring along and about its axis: axial pi / 2 sqrt(EA / m) / L, torsional pi / 2 sqrt(GJ / J) / L. */
KT_TEST(stretching_and_torsion_have_the_frequencies_of_bars) {
    check_order("axial", SPACE, 5, 0, 0.25 * pi * 2.0, 2.0, 1e-3);
    check_order("torsional", SPACE, 5, 2, 0.25 * pi * 10.0, 2.0, 1e-2);
}

/* The same cantilever in space: bending about y and about z by their own stiffnesses, whether the beam stretches or
 * not. Rotary inertia and shear lower the frequencies by some 1e-5 and 1e-4 here. */
KT_TEST(beams_in_space_bend_about_both_axes) {
    static const char *const texts[] = {"kinetree: 1\nbeams:\n  - {name: b, segments: @, length: 1, mass_per_length: "
                                        "1, inertia_per_length: 2e-6, GJ: 1, "
                                        "EI: [1, 4]}\n",
                                        "kinetree: 1\nbeams:\n  - {name: b, segments: @, length: 1, mass_per_length: "
                                        "1, EA: 1e6, GA: [4e5, 4e5], GJ: 1, "
                                        "EI: [1, 4]}\n"};
    for (int i = 0; i < 2; i++) {
        char text[512];
        double omega[2];
        count_segments(text, sizeof text, texts[i], 40);
        frequencies(text, omega, 2);
        kt_check_near("about y", omega[0], 3.51601526850015, 2e-3);
        kt_check_near("about z", omega[1], 2.0 * 3.51601526850015, 4e-3);
    }
}

/* A wedge of constant width that comes to a point, 5.315 sqrt(EI / (m L^4)) [G. Kirchhoff 1879]: EI falls as the cube
 * of the depth, here to a thousandth of it, at 33 stations. */
KT_TEST(a_tapered_beam_has_kirchhoffs_frequency) {
    static char text[8192];
    double omega[1];
    size_t used =
        (size_t)snprintf(text, sizeof text,
                         "kinetree: 1\nbeams:\n  - {name: w, segments: 60, length: 1, mass_per_length: [1, 1e-3], "
                         "inertia_per_length: 1e-9, GJ: 1, EI: [");
    for (int i = 0; i <= 32; i++) {
        const double depth = 1.0 - 0.999 * i / 32.0, cube = depth * depth * depth;
        used +=
            (size_t)snprintf(text + used, sizeof text - used, "%s[%.17g, %.17g]", i > 0 ? ", " : "", cube, 10.0 * cube);
    }
    snprintf(text + used, sizeof text - used, "]}\n");
    frequencies(text, omega, 1);
    kt_check_near("first frequency", omega[0], 5.315, 0.01);
}

/* ---- large deflections ------------------------------------------------------------------------------------------- */

/* The end of the last segment at rest. */
static kt_vec3 settle(const char *text, const char *last) {
    static beam b;
    kt_error e = {0};
    const kt_equilibrium_options options = {.nearest = false, .most = 2000};
    open_beam(&b, text);
    kt_need_fine("equilibrium", kt_equilibrium_find(b.linearization, &options, 0.0, b.q, NULL, NULL, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(b.at.model, b.at.data, b.q, b.v, NULL, &e), &e);
    const int body = kt_body_find(b.at.model, last);
    return kt_pose_apply(kt_body_pose(b.at.model, b.at.data, body), kt_marker_at(b.at.model, body, 0));
}

/* 2 pi EI / L at the end bends the beam into a circle: its segments are a regular polygon, which closes exactly. */
KT_TEST(an_end_moment_bends_a_beam_into_a_full_circle) {
    const kt_vec3 tip =
        settle("kinetree: 1\nbeams:\n  - {name: b, segments: 20, length: 3, mass_per_length: 1, EI: 6}\neffects:\n"
               "  - {type: torque, on: b-20, value: [0, 0, 12.566370614359172], frame: world}\n",
               "b-20");
    kt_check_below("the end comes back to the beginning, m", hypot(tip.x, tip.y), 1e-12);
}

/* The tip deflection and the shortening over L as functions of P L^2 / EI: K. Mattiasson, Numerical results from large
 * deflection beam and frame problems analysed by means of elliptic integrals, Int. J. Numer. Meth. Engng 17 (1981)
 * 145. */
KT_TEST(the_elastica_under_an_end_load_has_mattiassons_numbers) {
    static const double rows[][3] = {
        {1.0, 0.30172, 0.05643}, {2.0, 0.49346, 0.16064}, {5.0, 0.71379, 0.38763}, {10.0, 0.81061, 0.55500}};
    KT_WORST deflection = kt_worst_make("deflection over L"), shortening = kt_worst_make("shortening over L");
    double coarse = (double)NAN, last = (double)NAN;
    for (int i = 0; i < 5; i++) {
        const int n = i < 4 ? 40 : 20;
        const double *row = rows[i < 4 ? i : 3];
        char text[512], name[16];
        kt_vec3 tip;
        snprintf(name, sizeof name, "b-%d", n);
        snprintf(text, sizeof text,
                 "kinetree: 1\nbeams:\n  - {name: b, segments: %d, length: 1, mass_per_length: 1, EI: 1}\neffects:\n"
                 "  - {type: force, at: b-%d.end, value: [0, %g, 0]}\n",
                 n, n, row[0]);
        tip = settle(text, name);
        if (i == 4) {
            coarse = fabs(tip.y - row[1]);
            break;
        }
        last = fabs(tip.y - row[1]);
        kt_worst_near(&deflection, tip.y, row[1], 3e-4, "P L^2 / EI = %g", row[0]);
        kt_worst_near(&shortening, 1.0 - tip.x, row[2], 5e-4, "P L^2 / EI = %g", row[0]);
    }
    kt_check_near("order in segments, at 10", log2(coarse / last), 2.0, 0.1);
}

/* The bend of 45 degrees has a radius of 100 and a unit square section. A force of 600 acts out of its plane. The
 * published positions of the tip are
 *     (15.9, 47.2, 53.4)      K.-J. Bathe, S. Bolourchi, Int. J. Numer. Meth. Engng 14 (1979) 961
 *     (15.79, 47.23, 53.37)   J. C. Simo, L. Vu-Quoc, CMAME 58 (1986) 79
 *     (15.55, 47.04, 53.50)   A. Cardona, M. Geradin, Int. J. Numer. Meth. Engng 26 (1988) 2403
 * The bend begins along y and turns to x. */
KT_TEST(the_bend_of_45_degrees_goes_where_the_literature_says) {
    const kt_vec3 tip =
        settle("kinetree: 1\nbeams:\n"
               "  - {name: b, from: {body: world, rotation: {rpy: [0, 0, 90 deg]}}, segments: 32, length: "
               "78.53981633974483, mass_per_length: 1, EA: 1e7, GA: [5e6, 5e6], GJ: 833333.333, EI: [833333.333, "
               "833333.333], curvature: [0, 0, -0.01]}\n"
               "effects:\n  - {type: force, at: b-32.end, value: [0, 0, 600]}\n",
               "b-32");
    kt_check_near("x", tip.x, 15.79, 0.15);
    kt_check_near("y", tip.y, 47.23, 0.15);
    kt_check_near("z", tip.z, 53.37, 0.15);
}

/* ---- rotation ---------------------------------------------------------------------------------------------------- */

/* The first flapping frequency, out of the plane of rotation. Frequency and speed are divided by sqrt(EI / (m L^4)).
 * Source: A. D. Wright, C. E. Smith, R. W. Thresher, J. L. C. Wang, J. Appl. Mech. 49 (1982) 197. */
KT_TEST(rotating_cantilevers_stiffen_as_wright_and_others_have_it) {
    static const double rows[][2] = {{0.0, 3.5160}, {1.0, 3.6816}, {2.0, 4.1373}, {5.0, 6.4495}, {10.0, 11.2023}};
    for (int i = 0; i < 5; i++) {
        char text[1024];
        double omega[1];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: hub, joint: {type: revolute, axis: z, velocity: %g}}\nbeams:\n"
                 "  - {name: b, from: {body: hub, rotation: {rpy: [90 deg, 0, 0]}}, segments: 40, length: 1, "
                 "mass_per_length: "
                 "1, EI: 1}\nloops:\n  - {name: drive, type: motion, joint: hub, position: {polynomial: [0, %g]}}\n",
                 rows[i][0], rows[i][0]);
        frequencies(text, omega, 1);
        kt_check_near("first flapping frequency", omega[0], rows[i][1], 1.5e-3 * rows[i][1]);
    }
}

/* A shaft turns about its own axis at W and has the frequency omega at rest. Seen from axes that turn with it, its
 * frequencies are omega - W and omega + W. At the critical speed W = omega, the first of them vanishes, and an
 * unbalanced shaft bends without bound. Beyond this speed, the shaft runs on [S. Timoshenko, Vibration Problems in
 * Engineering; H. H. Jeffcott 1919]. */
KT_TEST(a_shaft_has_its_critical_speed_at_its_frequency) {
    static const char format[] =
        "kinetree: 1\nbodies:\n  - {name: hub, joint: {type: revolute, axis: x, velocity: %.17g}}\nbeams:\n"
        "  - {name: s, from: hub, segments: 24, length: 1, mass_per_length: 1, inertia_per_length: 1e-7, GJ: 1, EI: "
        "[1, 1]}\n"
        "loops:\n  - {name: drive, type: motion, joint: hub, position: {polynomial: [0, %.17g]}}\n";
    static const double parts[] = {0.0, 0.5, 0.95, 1.5};
    double rest = (double)NAN;
    KT_WORST worst = kt_worst_make("frequencies in turning axes");
    for (int i = 0; i < 4; i++) {
        char text[1024];
        double omega[2];
        const double speed = i == 0 ? 0.0 : parts[i] * rest;
        snprintf(text, sizeof text, format, speed, speed);
        frequencies(text, omega, 2);
        rest = i == 0 ? omega[0] : rest;
        kt_worst_near(&worst, omega[0], fabs(rest - speed), 2e-5, "%g of the critical speed", parts[i]);
        kt_worst_near(&worst, omega[1], rest + speed, 2e-5, "%g of the critical speed", parts[i]);
    }
    kt_check_near("critical speed", rest, 3.51601526850015, 4e-3);
}

/* ---- strains and section forces ---------------------------------------------------------------------------------- */

enum { SECTIONS = 8 };

/* Small loads act at the end of a cantilever of 2 m: the force (N, V_y, V_z) and the moment (T, M_y, M_z). The force in
 * a section s is the same. The moment is
 *     (T, M_y - V_z (L - s), M_z + V_y (L - s)),
 * and strains follow from the stiffnesses. The records have the forces of an effect on its second end, and the
 * positions of the joints. These are strains times the length of the joint: half a segment for the first. Deflections
 * of 1e-8 m change the moments of a force of 2e-3 N. The relative change is 1e-4. */
KT_TEST(strains_and_section_forces_are_those_of_a_cantilever) {
    static const double load[6] = {2e-3, 3e-7, -4e-7, 5e-7, 6e-7, -7e-7}, stiff[6] = {1e5, 2e4, 3e4, 50, 40, 60};
    static beam b;
    static double values[SECTIONS * 12 + 32];
    const double length = 2.0, h = length / SECTIONS;
    kt_error e = {0};
    KT_WORST force = kt_worst_make("section forces over the loads"),
             strain = kt_worst_make("strains times stiffnesses, over the loads");
    open_beam(&b, "kinetree: 1\nbeams:\n  - {name: b, segments: 8, length: 2, mass_per_length: 1, EA: 1e5, "
                  "GA: [2e4, 3e4], GJ: 50, EI: [40, 60]}\neffects:\n"
                  "  - {type: force, at: b-8.end, value: [2e-3, 3e-7, -4e-7]}\n"
                  "  - {type: torque, on: b-8, value: [5e-7, 6e-7, -7e-7]}\n");
    kt_need_fine("rest", kt_equilibrium_find(b.linearization, NULL, 0.0, b.q, NULL, NULL, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(b.at.model, b.at.data, b.q, b.v, NULL, &e), &e);
    kt_need_fine("record", kt_effect_quantities_evaluate(b.at.model, b.at.data, 0.0, b.q, b.v, values, &e), &e);
    int at = 0;
    for (int effect = 0; effect < kt_effect_count(b.at.model); effect++) {
        int section = -1;
        const int count = kt_effect_quantity_count(b.at.model, effect);
        (void)sscanf(kt_effect_name(b.at.model, effect), "b-joint-%d", &section);
        const double s = (section - 1) * h, rest = length - s, part = section == 1 ? 0.5 * h : h;
        const double expected[6] = {
            load[0], load[1], load[2], load[3], load[4] - load[2] * rest, load[5] + load[1] * rest};
        for (int k = 0; k < count && section > 0; k++) {
            const int of = (int)kt_effect_quantity_at(b.at.model, effect, k) - (int)KT_QUANTITY_FORCE_X;
            if (of >= 0 && of < 6)
                kt_worst_near(&force, -values[at + k] / fabs(load[of]), expected[of] / fabs(load[of]), 1e-3,
                              "%d at section %d", of, section);
        }
        at += count;
        if (section <= 0)
            continue;
        char name[16];
        snprintf(name, sizeof name, "b-%d", section);
        const double *q = b.q + kt_body_coordinates(b.at.model, kt_body_find(b.at.model, name)).q;
        for (int k = 0; k < 6; k++)
            kt_worst_near(&strain, (k < 3 ? q[k] : 2.0 * q[k + 1]) / part * stiff[k] / fabs(load[k]),
                          expected[k] / fabs(load[k]), 1e-3, "%d at section %d", k, section);
    }
    kt_check_equal_int("numbers", (long long)(force.count + strain.count), 2 * 6 * SECTIONS);
}

/* ---- what a section becomes -------------------------------------------------------------------------------------- */

/* Segments are bodies like others: a parent, an end, a shape; effects have names. */
KT_TEST(a_beam_becomes_bodies_and_effects_with_names) {
    kt_scene *s = kt_test_scene(
        "kinetree: 1\nparameters: {n: 3}\nbodies:\n"
        "  - {name: arm, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1], markers: {tip: [2, 0, 0]}}\n"
        "  - {name: ball, parent: w-3, joint: {type: fixed, at: [0.5, 0, 0]}, mass: 2}\n"
        "beams:\n  - {name: w, from: arm.tip, to: world, ends: [hinged, clamped], segments: =n, length: 1.5, "
        "mass_per_length: [2, 1], EA: 6, GA: [3, 5], GJ: 7, EI: [[8, 9], [4, 3]], damping: 0.1}\n");
    const kt_description *d = &s->description;
    kt_check_equal_int("bodies", d->body_count, 5);
    kt_check_equal_int("effects", d->effect_count, 4);
    kt_check_equal_int("loops", d->loop_count, 0);
    const kt_body *first = &d->bodies[2];
    kt_check_text("first", first->name, "w-1");
    kt_check_text("its parent", first->parent, "arm");
    kt_check_near("its place", first->joint.at.x, 2.0, 0.0);
    kt_check_near("its mass: 2 - 1/6 over 0.5", first->mass, (2.0 - 1.0 / 6.0) * 0.5, 1e-15);
    kt_check_text("hinged: effect", d->effects[0].name, "w-joint-1");
    kt_check_near("hinged: force", d->effects[0].stiffnesses[0], 6.0 / 0.25, 1e-14);
    kt_check_near("hinged: moment", d->effects[0].stiffnesses[5], 0.0, 0.0);
    kt_check_near("between: about y at a third", d->effects[1].stiffnesses[4], (8.0 - 4.0 / 3.0) / 0.5, 1e-14);
    kt_check_near("damping there", d->effects[1].dampings[4], 0.1 * (8.0 - 4.0 / 3.0) / 0.5, 1e-15);
    kt_check_near("clamped: about z", d->effects[3].stiffnesses[5], 3.0 / 0.25, 1e-14);
}

/* The written scene has the bodies and effects that represent the beams. */
KT_TEST(a_beam_is_written_as_what_it_stands_for) {
    kt_scene *s =
        kt_test_scene("kinetree: 1\nbeams:\n  - {name: b, segments: 2, length: 1, mass_per_length: 1, EI: 1}\n");
    const char *text = kt_test_written(s);
    kt_scene *again = kt_test_scene(text);
    kt_check_equal_int("bodies", again->description.body_count, 2);
    kt_check_true("no beams", strstr(text, "beams") == NULL);
}

static void check_fault(const char *keys, const char *words) {
    static kt_collected faults;
    char text[512];
    kt_scene s;
    snprintf(text, sizeof text,
             "kinetree: 1\nbeams:\n  - {name: b, %s}\n"
             "bodies: [{name: crank, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n",
             keys);
    kt_need(kt_check_true(words, kt_collect_parse(&faults, text, &s) != KT_OK));
    kt_check_contains("fault", faults.text, words);
    kt_check_contains("where", faults.text, "3:");
}

KT_TEST(what_is_wrong_with_a_beam_is_told_with_the_mend) {
    const char *whole = "segments: 4, length: 1, mass_per_length: 1, EI: 1";
    char keys[256];
    check_fault("length: 1, mass_per_length: 1, EI: 1", "segments");
    check_fault("segments: 2.5, length: 1, mass_per_length: 1, EI: 1", "segments are a whole number, 2 to 10000");
    check_fault("segments: 4, length: 1, mass_per_length: 1, EI: [1, 2]", "also needs GJ");
    check_fault("segments: 4, length: 1, mass_per_length: 1, EI: 1, GJ: 2", "leave out EA, GA and GJ");
    check_fault("segments: 4, length: 1, mass_per_length: 1, EI: [1, 2], GJ: 2", "give inertia_per_length");
    check_fault("segments: 4, length: 1, mass_per_length: 1, EI: [1, 2], GJ: 2, EA: 1", "EA and GA belong together");
    check_fault("segments: 4, length: 1, mass_per_length: 0, EI: 1", "mass_per_length");
    snprintf(keys, sizeof keys, "%s, ends: [clamped, hinged]", whole);
    check_fault(keys, "'to: END' is missing");
    snprintf(keys, sizeof keys, "%s, ends: [clamped, free], to: world", whole);
    check_fault(keys, "leave out one of them");
    snprintf(keys, sizeof keys, "%s, curvature: [0.1, 0, 0]", whole);
    check_fault(keys, "curvature about x or y (0.1, 0 rad/m) needs EI: [y, z] and GJ");
    snprintf(keys, sizeof keys, "%s, damping: -1", whole);
    check_fault(keys, "zero or more");
    snprintf(keys, sizeof keys, "%s, from: crnak", whole);
    check_fault(keys, "crnak");
    snprintf(keys, sizeof keys, "%s, from: crank.tip", whole);
    check_fault(keys, "body 'crank' has no marker 'tip'");
    snprintf(keys, sizeof keys, "%s, from: carnk.tip", whole);
    check_fault(keys, "body 'carnk' does not exist; did you mean 'crank'?");
    snprintf(keys, sizeof keys, "%s, from: nothing.tip", whole);
    check_fault(keys, "body 'nothing' does not exist; name a body of the scene");
}
