/* `response` and `modes --sweep` against closed forms: an oscillator, two masses, and two oscillators whose frequencies
 * cross. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <complex.h>
#include <math.h>

static const double two_pi = 6.28318530717958647693;
static const double complex J = (double complex)I;

/* A number of an array in an output of `response --json`. */
static double response_at(const json_t *root, int output, const char *key, size_t k) {
    const json_t *one = json_array_get(json_object_get(root, "outputs"), (size_t)output);
    return json_number_value(json_array_get(json_object_get(one, key), k));
}

/* The response of an output against an exact one, as a complex number relative to the size of its terms. */
static void compare_response(kt_worst *worst, const json_t *root, int output, size_t k, double complex exact,
                             double size) {
    const double complex found =
        response_at(root, output, "amplitude", k) * cexp(J * response_at(root, output, "phase", k));
    kt_worst_below(worst, cabs(found - exact) / size, 1e-12, "output %d, frequency %zu", output, k);
}

KT_TEST(an_oscillator_has_its_closed_response) {
    const double m = 2.0, k = 50.0, c = 1.2;
    KT_WORST worst = kt_worst_make("1 / (k - m w^2 + i c w)");
    kt_write_file("oscillator.yaml", "kinetree: 1\n"
                                     "bodies: [{name: block, joint: {type: prismatic, axis: x}, mass: 2}]\n"
                                     "effects: [{type: joint_spring, joint: block, stiffness: 50, damping: 1.2}]\n");
    const kt_ran ran = kt_shell("$K response oscillator.yaml --input block --output position.block,velocity.block "
                                "--from 0.01 --to 100 --points 101 --json");
    json_t *root = kt_json(ran.out);
    const json_t *frequency = json_object_get(root, "frequency");
    kt_need(kt_check_above("frequencies, with those of the resonance", (double)json_array_size(frequency), 102.0));
    for (size_t i = 0; i < json_array_size(frequency); i++) {
        const double w = two_pi * json_number_value(json_array_get(frequency, i));
        const double complex exact = 1.0 / (k - m * w * w + J * c * w);
        compare_response(&worst, root, 0, i, exact, cabs(exact));
        compare_response(&worst, root, 1, i, J * w * exact, w * cabs(exact));
    }
    json_decref(root);
}

/* (K - w^2 M + i w C) x = e_j, with the displacement of the second mass relative to the first. */
static void two_masses(double w, int j, double complex x[2]) {
    const double m1 = 3.0, m2 = 0.5;
    const double complex a = 200.0 + J * w * 4.0 - w * w * (m1 + m2), b = -w * w * m2,
                         d = 80.0 + J * w * 0.3 - w * w * m2, det = a * d - b * b;
    x[0] = (j == 0 ? d : -b) / det;
    x[1] = (j == 0 ? -b : a) / det;
}

KT_TEST(two_masses_have_their_closed_response) {
    static const char *const inputs[] = {"car", "wheel"};
    KT_WORST worst = kt_worst_make("(K - w^2 M + i w C)^-1");
    kt_write_file(
        "masses.yaml",
        "kinetree: 1\n"
        "bodies:\n"
        "  - {name: car, joint: {type: prismatic, axis: z}, mass: 3}\n"
        "  - {name: wheel, parent: car, joint: {type: prismatic, axis: z}, mass: 0.5, markers: {hub: [0, 0, 1]}}\n"
        "effects:\n"
        "  - {type: joint_spring, joint: car, stiffness: 200, damping: 4}\n"
        "  - {type: joint_spring, joint: wheel, stiffness: 80, damping: 0.3}\n");
    for (int j = 0; j < 2; j++) {
        const kt_ran ran = kt_shell("$K response masses.yaml --input %s --output "
                                    "position.car,position.wheel,marker.wheel.hub.z --points 200 --json",
                                    inputs[j]);
        json_t *root = kt_json(ran.out);
        const json_t *frequency = json_object_get(root, "frequency");
        kt_need(kt_check_above("frequencies", (double)json_array_size(frequency), 200.0));
        for (size_t i = 0; i < json_array_size(frequency); i++) {
            double complex x[2];
            two_masses(two_pi * json_number_value(json_array_get(frequency, i)), j, x);
            compare_response(&worst, root, 0, i, x[0], cabs(x[0]));
            compare_response(&worst, root, 1, i, x[1], cabs(x[1]));
            compare_response(&worst, root, 2, i, x[0] + x[1], cabs(x[0]) + cabs(x[1]));
        }
        json_decref(root);
    }
}

KT_TEST(responses_that_cannot_be_computed_are_rejected) {
    kt_expect(1, "there is no joint 'blok'; did you mean 'block'?", "$K response oscillator.yaml --input blok");
    kt_expect(1, "the scene has 0 motors", "$K response oscillator.yaml");
    kt_expect(1, "an output is position.JOINT", "$K response oscillator.yaml --input block --output height");
    kt_expect(1, "--to must be above --from", "$K response oscillator.yaml --input block --from 3 --to 2");
}

/* The frequencies sqrt(k / m) and sqrt(100) rad/s cross at k = 200; curves follow the joints. */
KT_TEST(curves_of_a_sweep_cross_with_their_modes) {
    KT_WORST still = kt_worst_make("curve of the fixed oscillator, Hz"), moving = kt_worst_make("of the other one");
    kt_write_file("two.yaml", "kinetree: 1\n"
                              "parameters: {k: 100}\n"
                              "bodies:\n"
                              "  - {name: a, joint: {type: prismatic, axis: x}, mass: 2}\n"
                              "  - {name: b, joint: {type: prismatic, axis: y}, mass: 1}\n"
                              "effects:\n"
                              "  - {type: joint_spring, joint: a, stiffness: =k}\n"
                              "  - {type: joint_spring, joint: b, stiffness: 100}\n");
    const kt_ran ran = kt_shell("$K modes two.yaml --sweep k=50:400:36 --json");
    json_t *root = kt_json(ran.out);
    const json_t *values = json_object_get(root, "values");
    kt_need(kt_check_equal_int("values", (long long)json_array_size(values), 36));
    for (size_t i = 0; i < 36; i++) {
        const json_t *at = json_array_get(values, i);
        const double k = json_number_value(json_object_get(at, "value"));
        for (size_t j = 0; j < 2; j++) {
            const json_t *mode = json_array_get(json_object_get(at, "modes"), j);
            const double f = json_number_value(json_object_get(mode, "frequency"));
            if (json_integer_value(json_object_get(mode, "curve")) == 1) /* the slower one at k = 50 */
                kt_worst_near(&moving, f, sqrt(k / 2.0) / two_pi, 1e-12, "k = %g", k);
            else
                kt_worst_near(&still, f, 10.0 / two_pi, 1e-12, "k = %g", k);
        }
    }
    json_decref(root);
    kt_expect(1, "PARAMETER=FROM:TO", "$K modes two.yaml --sweep k=5");
    kt_expect(1, "leave --period, --formulation, --view and --bars out", "$K modes two.yaml --sweep k=5:6 --period 1");
}

/* A pendulum of length 1 m on a shaft that turns at W: cos(angle) = g / W^2, and small motions about it have the
 * frequency W sin(angle). */
KT_TEST(a_pendulum_rests_in_a_rotating_frame_as_its_closed_form) {
    const double w = 5.0, cosine = 9.81 / (w * w), sine = sqrt(1.0 - cosine * cosine);
    kt_write_file("conical.yaml",
                  "kinetree: 1\n"
                  "gravity: [0, 0, -9.81]\n"
                  "parameters: {w: 5}\n"
                  "bodies:\n"
                  "  - {name: shaft, joint: {type: revolute, axis: z, velocity: =w}, mass: 1, inertia: [1, 1, 1]}\n"
                  "  - {name: bob, parent: shaft, joint: {type: revolute, axis: y, position: 20 deg}, mass: 2,\n"
                  "     com: [0, 0, -1], inertia: [0, 0, 0]}\n"
                  "loops: [{name: drive, type: motion, joint: shaft, position: {polynomial: [0, =w]}}]\n");
    kt_ran ran = kt_shell("$K equilibrium conical.yaml --rotating shaft --json");
    json_t *root = kt_json(ran.out);
    kt_check_near("cosine of the angle", cos(kt_json_at(root, "position.bob")), cosine, 1e-10);
    json_decref(root);
    ran = kt_shell("$K modes conical.yaml --rotating shaft --json");
    root = kt_json(ran.out);
    kt_check_near("frequency, Hz", kt_json_at(root, "modes[0].frequency"), w * sine / two_pi, 1e-9);
    json_decref(root);
    ran = kt_shell("$K modes conical.yaml --rotating shaft --sweep w=4:8:9 --json");
    root = kt_json(ran.out);
    kt_check_near("at 8 rad/s", kt_json_at(root, "values[8].modes[0].frequency"),
                  8.0 * sqrt(1.0 - pow(9.81 / 64.0, 2.0)) / two_pi, 1e-9);
    json_decref(root);
    kt_expect(1, "has the velocity 0", "$K equilibrium conical.yaml --rotating shaft --set w=0");
    kt_expect(1, "is not a revolute joint on the world", "$K equilibrium conical.yaml --rotating bob");
}
