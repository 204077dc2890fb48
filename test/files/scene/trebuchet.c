/* A trebuchet. With angles q_i of beam, box and sling every mass is at a sum of r_i (cos q_i, sin q_i). With c_ij = sum
 * m r_i r_j and the moments of inertia on the diagonal, Lagrange's equations are
 *     sum_j c_ij (cos(q_i - q_j) q_j'' + sin(q_i - q_j) q_j'^2) = -g sum m r_i cos q_i */
/* SPDX-License-Identifier: Apache-2.0 */
#include "trebuchet.h"

#include <math.h>

const kt_trebuchet kt_trebuchet_data = {.ball = 2.0,
                                        .box = 300.0,
                                        .beam = 20.0,
                                        .long_arm = 3.0,
                                        .short_arm = 1.0,
                                        .sling = 2.0,
                                        .hangs = 0.8,
                                        .beam_inertia = 20.0,
                                        .box_inertia = 5.0,
                                        .release = 4.2,
                                        .ground = -2.0,
                                        .gravity = 9.81};

const char kt_trebuchet_scene[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: beam, joint: {type: revolute, position: -135 deg}, mass: 20, inertia: [20, 20, 20], markers: {tip: [3, "
    "0, "
    "0]}}\n"
    "  - {name: box, parent: beam, joint: {type: revolute, at: [-1, 0, 0], position: 135 deg}, mass: 300, com: [0, "
    "-0.8, "
    "0], inertia: [5, 5, 5]}\n"
    "  - name: ball\n"
    "    joint: {type: planar, position: [-0.1213203435596424, -2.121320343559643, 0]}\n"
    "    mass: 2\n"
    "    inertia: [0.01, 0.01, 0.01]\n"
    "    markers: {centre: [0, 0, 0]}\n"
    "loops:\n"
    "  - {name: sling, type: distance, between: [beam.tip, ball.centre], length: 2}\n"
    "events:\n"
    "  - {name: let go, when: marker.ball.centre.y - 4.2, direction: rising, limit: 1, then: [{release: sling}]}\n"
    "simulate: {duration: 20, until: \"marker.ball.centre.y < -2\", tolerance: 1e-13}\n";

void kt_trebuchet_start(double y[KT_TREBUCHET_STATES]) {
    const double pi = 3.14159265358979323846;
    y[0] = -0.75 * pi;
    y[1] = -0.5 * pi;
    y[2] = y[3] = y[4] = y[5] = 0.0;
}

void kt_trebuchet_rate(const double y[KT_TREBUCHET_STATES], double rate[KT_TREBUCHET_STATES]) {
    const kt_trebuchet *s = &kt_trebuchet_data;
    const double mass[2] = {s->ball, s->box};
    const double arm[2][3] = {{s->long_arm, 0.0, s->sling}, {-s->short_arm, s->hangs, 0.0}};
    const double inertia[3] = {s->beam_inertia, s->box_inertia, 0.0};
    double m[3][4];
    for (int i = 0; i < 3; i++) {
        m[i][3] = 0.0;
        for (int j = 0; j < 3; j++) {
            const double c = mass[0] * arm[0][i] * arm[0][j] + mass[1] * arm[1][i] * arm[1][j];
            m[i][j] = c * cos(y[i] - y[j]) + (i == j ? inertia[i] : 0.0);
            m[i][3] -= c * sin(y[i] - y[j]) * y[3 + j] * y[3 + j];
        }
        m[i][3] -= s->gravity * (mass[0] * arm[0][i] + mass[1] * arm[1][i]) * cos(y[i]);
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            for (int j = 3; i != k && j >= k; j--)
                m[i][j] -= m[i][k] / m[k][k] * m[k][j];
    for (int i = 0; i < 3; i++) {
        rate[i] = y[3 + i];
        rate[3 + i] = m[i][3] / m[i][i];
    }
}

void kt_trebuchet_ball(const double y[KT_TREBUCHET_STATES], double ball[4]) {
    const double arm = kt_trebuchet_data.long_arm, sling = kt_trebuchet_data.sling;
    ball[0] = arm * cos(y[0]) + sling * cos(y[2]);
    ball[1] = arm * sin(y[0]) + sling * sin(y[2]);
    ball[2] = -arm * sin(y[0]) * y[3] - sling * sin(y[2]) * y[5];
    ball[3] = arm * cos(y[0]) * y[3] + sling * cos(y[2]) * y[5];
}

double kt_trebuchet_range(const double ball[4]) {
    const double g = kt_trebuchet_data.gravity, fall = ball[1] - kt_trebuchet_data.ground;
    return ball[0] + ball[2] * (ball[3] + sqrt(ball[3] * ball[3] + 2.0 * g * fall)) / g;
}
