/* A woodpecker toy: its scene, and Moreau's time stepping of its equations, which shares nothing with the library. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "woodpecker.h"

#include <math.h>

const char kt_woodpecker_scene[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "parameters: {r0: 0.0025, rM: 0.0031, hM: 0.0058, lM: 0.010, lG: 0.015, hS: 0.020, lS: 0.0201, c: 0.0056, mu: "
    "0.3,\n"
    "  nM: '=hypot(hM, rM)', nS: '=hypot(hS, lG - lS)', phiM: '=(r0 - rM)/hM', phiS: -0.2788, wS: -7.4583}\n"
    "bodies:\n"
    "  - {name: sleeve, joint: {type: prismatic, axis: 'y', velocity: -0.3411}, mass: 0.0003}\n"
    "  - {name: edge, parent: sleeve, joint: {type: prismatic, axis: [=hM, =rM, 0], position: =phiM*nM, armature: "
    "=5e-9/nM^2},\n"
    "     mass: 0, markers: {p: [0, 0, 0]}}\n"
    "  - {name: arm, parent: sleeve, joint: {type: prismatic, axis: 'y', position: =phiM*lM}, mass: 0}\n"
    "  - {name: bird, parent: arm, joint: {type: prismatic, axis: 'y', position: =phiS*lG, velocity: =wS*lG}, mass: "
    "0.0045}\n"
    "  - {name: beak, parent: arm, joint: {type: prismatic, axis: [=-hS, =lG-lS, 0], position: =phiS*nS, velocity: "
    "=wS*nS,\n"
    "     armature: =7e-7/nS^2}, mass: 0, markers: {p: [0, 0, 0]}}\n"
    "loops:\n"
    "  - {name: M, type: coupling, coefficients: {edge: =1/nM, arm: =-1/lM}}\n"
    "  - {name: S, type: coupling, coefficients: {beak: =1/nS, bird: =-1/lG}}\n"
    "effects:\n"
    "  - {type: expression, joint: edge, force: '-c*(position.edge/nM - position.bird/lG)/nM'}\n"
    "  - {type: expression, joint: bird, force: '-c*(position.bird/lG - position.edge/nM)/lG'}\n"
    "  - {name: pecks, type: contact, point: beak.p, plane: {body: world, at: [=lS+r0-lM-lG, 0, 0]}, axis: x,\n"
    "     restitution: 0.5, friction: =mu, poisson: true}\n"
    "  - {name: lower, type: contact, point: edge.p, plane: {body: world, at: [=r0-rM, 0, 0]}, axis: x,\n"
    "     restitution: 0, friction: =mu, poisson: true}\n"
    "  - {name: upper, type: contact, point: edge.p, plane: {body: world, at: [=rM-r0, 0, 0]}, axis: -x,\n"
    "     restitution: 0, friction: =mu, poisson: true}\n"
    "events: [{name: section, when: position.bird/lG - phiS, direction: falling, then: record}]\n"
    "simulate: {duration: 3}\n"
    "output: {interval: 0.001, record: [position, velocity, balance]}\n";

const kt_woodpecker kt_woodpecker_data = {
    .r0 = 0.0025,
    .rM = 0.0031,
    .hM = 0.0058,
    .lM = 0.010,
    .lG = 0.015,
    .hS = 0.020,
    .lS = 0.0201,
    .c = 0.0056,
    .friction = 0.3,
    .restitution = 0.5,
    .mM = 0.0003,
    .mS = 0.0045,
    .JM = 5e-9,
    .JS = 7e-7,
    .g = 9.81,
    .phiS = -0.2788,
    .fall = -0.3411,
    .turn = -7.4583,
};

/* ---- pecks ------------------------------------------------------------------------------------------------------- */

void kt_pecks_see(kt_pecks *pecks, double t) {
    if (t <= pecks->last + 0.05)
        return;
    pecks->count += t > 1.0;
    pecks->first = t < 1.0 ? t : pecks->first;
    pecks->last = t;
}

double kt_pecks_period(const kt_pecks *pecks) { return (pecks->last - pecks->first) / pecks->count; }

/* ---- time stepping ----------------------------------------------------------------------------------------------- */

/* The same in the three coordinates y, phi_M, phi_S. */
static const double toy_normal[3][3] = {{0.0, 0.0, -0.02}, {0.0, 0.0058, 0.0}, {0.0, -0.0058, 0.0}};
static const double toy_along[3][3] = {{1.0, 0.01, 0.015 - 0.0201}, {1.0, 0.0031, 0.0}, {1.0, 0.0031, 0.0}};
static const double toy_gap[3] = {0.0024, 0.0006, 0.0006};

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void invert_toy(double *inverse) {
    const double m = 0.0048, mS = 0.0045, lM = 0.01, lG = 0.015;
    const double M[9] = {
        m, mS * lM, mS * lG, mS * lM, 5e-9 + mS * lM * lM, mS * lM * lG, mS * lG, mS * lM * lG, 7e-7 + mS * lG * lG};
    double determinant = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3, k = (j + 1) % 3, l = (j + 2) % 3;
            inverse[3 * j + i] = M[3 * a + k] * M[3 * b + l] - M[3 * a + l] * M[3 * b + k];
            determinant += i == 0 ? M[j] * inverse[3 * j] : 0.0;
        }
    for (int i = 0; i < 9; i++)
        inverse[i] /= determinant;
}

/* One sweep of projected Gauss-Seidel: the largest change of an impulse. */
static double sweep_toy(const double *inverse, const double *q, const double *back, double *u, double *p) {
    double change = 0.0;
    for (int row = 0; row < 6; row++) {
        const int i = row / 2;
        const double *w = row % 2 ? toy_along[i] : toy_normal[i];
        if (toy_gap[i] + dot(toy_normal[i], q) > 0.0)
            continue;
        const double by[3] = {dot(inverse, w), dot(inverse + 3, w), dot(inverse + 6, w)};
        const double rate = dot(w, u) + (row % 2 ? 0.0 : back[i]), most = row % 2 ? 0.3 * p[row - 1] : HUGE_VAL;
        const double d = fmax(row % 2 ? -most : 0.0, fmin(most, p[row] - rate / dot(w, by))) - p[row];
        p[row] += d;
        change = fmax(change, fabs(d));
        for (int k = 0; k < 3; k++)
            u[k] += by[k] * d;
    }
    return change;
}

double kt_woodpecker_period(double h) {
    const double c = 0.0056, g = 9.81;
    double q[3] = {0.0, -0.0006 / 0.0058, -0.2788}, u[3] = {-0.3411, 0.0, -7.4583}, inverse[9];
    kt_pecks pecks = {.count = 0};
    invert_toy(inverse);
    for (int step = 0; step * h < 3.0; step++) {
        const double turn = c * (q[1] - q[2] + 0.5 * h * (u[1] - u[2]));
        const double f[3] = {-0.0048 * g, -turn - 0.0045 * g * 0.01, turn - 0.0045 * g * 0.015};
        const double back[3] = {0.5 * dot(toy_normal[0], u), 0.0, 0.0};
        double p[6] = {0.0}, change = 1.0;
        for (int k = 0; k < 3; k++)
            q[k] += 0.5 * h * u[k];
        for (int k = 0; k < 3; k++)
            u[k] += h * dot(inverse + 3 * k, f);
        for (int sweep = 0; sweep < 400 && change > 1e-13; sweep++)
            change = sweep_toy(inverse, q, back, u, p);
        for (int k = 0; k < 3; k++)
            q[k] += 0.5 * h * u[k];
        if (p[0] > 0.0)
            kt_pecks_see(&pecks, step * h);
    }
    return kt_pecks_period(&pecks);
}
