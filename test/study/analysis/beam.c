/* Chains of many links on springs, as beams are. The lowest frequencies are 1e-6 of the largest, and follow from the
 * cancellation of numbers of all sizes. The reference is (K - omega^2 M) x = 0 in closed form:
 *
 *     M_ij = sum over k >= max(i, j) of m_k (X_k - x_i) (X_k - x_j) + I_k
 *     K_ij = stiffness_i delta_ij + g sum over k >= max(i, j) of (m_k c_k + l_k (masses beyond k))
 *
 * with hinges x_i, mass centres X_k = x_k + c_k and lengths l_k of a straight chain of relative angles. The chain hangs
 * if g > 0. With K = L L', 1 / omega^2 are the eigenvalues of `L^-1 M L^-T`. All terms are positive, so these are good
 * to some eps of the largest. They are computed by Jacobi's rotations, which share nothing with LAPACK's method.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "small.h"

#include "random.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINKS = 80 };

static const double pi = 3.14159265358979324;

typedef struct beam {
    int links;
    bool rail; /* the first hinge slides freely across the chain */
    double gravity;
    double length[LINKS], com[LINKS], mass[LINKS], inertia[LINKS], stiffness[LINKS];
    kt_model *model;
} beam;

/* ---- the same chain as a model ----------------------------------------------------------------------------------- */

static void beam_compile(beam *b) {
    static kt_body body[LINKS + 1];
    static kt_effect effect[LINKS];
    static char name[LINKS][8];
    kt_description description = kt_description_default();
    description.gravity = kt_vec3_make(b->gravity, 0.0, 0.0);
    kt_describe(&description, body + !b->rail, b->links + b->rail, NULL, 0, effect, b->links);
    body[0] = kt_body_of("rail", NULL, KT_JOINT_PRISMATIC, 1.0);
    body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    for (int i = 0; i < b->links; i++) {
        kt_body *at = &body[i + 1];
        snprintf(name[i], sizeof name[i], "b%d", i);
        *at = kt_body_of(name[i], i ? name[i - 1] : b->rail ? "rail" : NULL, KT_JOINT_REVOLUTE, b->mass[i]);
        at->joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        at->joint.at = kt_vec3_make(i ? b->length[i - 1] : 0.0, 0.0, 0.0);
        at->com = kt_vec3_make(b->com[i], 0.0, 0.0);
        at->inertia = (kt_sym3){.xx = b->inertia[i], .yy = b->inertia[i], .zz = b->inertia[i]};
        effect[i] = kt_effect_of(KT_EFFECT_JOINT_SPRING, name[i]);
        effect[i].stiffness = b->stiffness[i];
    }
    b->model = kt_test_model(&description, NULL);
}

/* ---- the closed form --------------------------------------------------------------------------------------------- */

typedef struct pair {
    double mass[LINKS][LINKS], stiffness[LINKS][LINKS];
} pair;

static void write_pair(const beam *b, pair *p) {
    double hinge[LINKS], beyond = 0.0, first = 0.0, all = b->rail ? 1.0 : 0.0, moment[LINKS] = {0};
    memset(p, 0, sizeof *p);
    for (int i = 0; i < b->links; i++)
        hinge[i] = i ? hinge[i - 1] + b->length[i - 1] : 0.0;
    for (int k = b->links - 1; k >= 0; k--) {
        const double centre = hinge[k] + b->com[k], weight = b->mass[k] * b->com[k] + b->length[k] * beyond;
        for (int i = 0; i <= k; i++) {
            for (int j = 0; j <= k; j++) {
                p->mass[i][j] += b->mass[k] * (centre - hinge[i]) * (centre - hinge[j]) + b->inertia[k];
                p->stiffness[i][j] += b->gravity * weight;
            }
            moment[i] += b->mass[k] * (centre - hinge[i]);
        }
        p->stiffness[k][k] += b->stiffness[k];
        beyond += b->mass[k];
    }
    first = all + beyond;
    for (int i = 0; i < b->links && b->rail; i++) /* the rail's momentum is zero */
        for (int j = 0; j < b->links; j++)
            p->mass[i][j] -= moment[i] * moment[j] / first;
}

/* mass <- L^-1 M L^-T, K = L L'. */
static void reduce(pair *p, int n) {
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double sum = p->stiffness[i][j];
            for (int k = 0; k < j; k++)
                sum -= p->stiffness[i][k] * p->stiffness[j][k];
            p->stiffness[i][j] = i == j ? sqrt(sum) : sum / p->stiffness[j][j];
        }
    for (int side = 0; side < 2; side++)
        for (int c = 0; c < n; c++)
            for (int i = 0; i < n; i++) {
                double *x = side ? &p->mass[c][i] : &p->mass[i][c];
                for (int k = 0; k < i; k++)
                    *x -= p->stiffness[i][k] * (side ? p->mass[c][k] : p->mass[k][c]);
                *x /= p->stiffness[i][i];
            }
}

static void rotate(double a[LINKS][LINKS], int n, int i, int j) {
    const double theta = (a[j][j] - a[i][i]) / (2.0 * a[i][j]);
    const double t = copysign(1.0, theta) / (fabs(theta) + sqrt(1.0 + theta * theta)), c = 1.0 / sqrt(1.0 + t * t);
    for (int k = 0; k < n; k++) {
        const double x = a[k][i], y = a[k][j];
        a[k][i] = c * (x - t * y);
        a[k][j] = c * (t * x + y);
    }
    for (int k = 0; k < n; k++) {
        const double x = a[i][k], y = a[j][k];
        a[i][k] = c * (x - t * y);
        a[j][k] = c * (t * x + y);
    }
}

static int compare_falling(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return x > y ? -1 : x < y;
}

/* The eigenvalues of a symmetric matrix, largest first. */
static void eigenvalues(double a[LINKS][LINKS], int n, double *value) {
    for (int sweep = 0; sweep < 30; sweep++) {
        int count = 0;
        for (int i = 0; i < n; i++)
            for (int j = i + 1; j < n; j++)
                if (fabs(a[i][j]) > DBL_EPSILON * sqrt(fabs(a[i][i] * a[j][j]))) {
                    rotate(a, n, i, j);
                    count++;
                }
        if (count == 0)
            break;
    }
    for (int i = 0; i < n; i++)
        value[i] = a[i][i];
    qsort(value, (size_t)n, sizeof *value, compare_falling);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

static void randomise(beam *b, kt_random *random) {
    const double spread = kt_random_uniform(random, 0.0, 1.0);
    b->links = kt_random_int(random, 2, LINKS);
    b->rail = kt_random_int(random, 0, 2) == 0;
    b->gravity = kt_random_int(random, 0, 1) ? 9.81 : 0.0;
    for (int i = 0; i < b->links; i++) {
        b->length[i] = exp(spread * kt_random_uniform(random, -1.0, 1.0)) / b->links;
        b->com[i] = b->length[i] * kt_random_uniform(random, 0.2, 0.8);
        b->mass[i] = exp(spread * kt_random_uniform(random, -1.0, 1.0)) / b->links;
        b->inertia[i] = b->mass[i] * b->length[i] * b->length[i] * kt_random_uniform(random, 0.03, 0.1);
        b->stiffness[i] = 100.0 * b->links * exp(2.0 * spread * kt_random_uniform(random, -1.0, 1.0));
    }
}

typedef struct census {
    kt_worst within, lowest, known, zeros;
} census;

static void compare(const beam *b, const kt_modes *modes, int round, census *c) {
    static pair p;
    double value[LINKS];
    write_pair(b, &p);
    reduce(&p, b->links);
    eigenvalues(p.mass, b->links, value);
    const int count = kt_modes_count(modes), first = count - b->links;
    int zeros = 0;
    for (int i = 0; i < count; i++) {
        const kt_mode mode = kt_modes_at(modes, i);
        zeros += mode.real == 0.0 && mode.imaginary == 0.0;
    }
    kt_worst_near(&c->zeros, zeros, b->rail ? 2.0 : 0.0, 0.0, "chain %d of %d links", round, b->links);
    for (int i = 0; i < b->links && first >= 0; i++) {
        const double omega = 1.0 / sqrt(value[i]);
        const double own = 4.0 * b->links * DBL_EPSILON * value[0] / value[i] * omega;
        const kt_mode mode = kt_modes_at(modes, first + i);
        kt_worst_near(&c->within, hypot(mode.real, mode.imaginary - omega), 0.0, mode.error + own,
                      "chain %d of %d links, mode %d", round, b->links, i + 1);
        if (i > 0)
            continue;
        kt_worst_near(&c->lowest, mode.imaginary, omega, 1e-7 * omega, "chain %d of %d links", round, b->links);
        kt_worst_near(&c->known, mode.error, 0.0, 1e-3 * omega, "chain %d of %d links", round, b->links);
    }
}

/* The estimates of mode.error cover the differences, and are small enough to call no mode neutral. */
KT_TEST(modes_of_random_chains_are_those_of_the_symmetric_problem) {
    kt_random random = kt_random_of_test();
    census c = {.within = kt_worst_make("eigenvalue over its estimated error"),
                .lowest = kt_worst_make("lowest frequency, rad/s"),
                .known = kt_worst_make("estimated error of the lowest, 1/s"),
                .zeros = kt_worst_make("eigenvalues that are zero")};
    for (int round = 0; round < 24; round++) {
        static beam b;
        static const double rest[LINKS + 1];
        small s = {0};
        randomise(&b, &random);
        beam_compile(&b);
        small_open(&s, b.model, NULL, 0.0, rest, rest, NULL);
        compare(&b, s.modes, round, &c);
    }
    kt_check_worst(&c.within);
    kt_check_worst(&c.lowest);
    kt_check_worst(&c.known);
    kt_check_worst(&c.zeros);
}

/* A cantilever of N equal rigid segments, hinged at their ends: omega_j tends to (beta_j / L)^2 sqrt(EI / mu), cos beta
 * cosh beta = -1, as 1 / N^2. */
KT_TEST(frequencies_of_a_cantilever_tend_to_those_of_euler_and_bernoulli) {
    static const double beta[] = {1.8751040687119611, 4.6940911329741746, 7.8547574382376126};
    static const double rest[LINKS];
    static beam b;
    const double bending = 875.0, mass = 3.925, length = 2.0;
    for (b.links = 20; b.links <= LINKS; b.links *= 2) {
        small s = {0};
        b.rail = false;
        for (int i = 0; i < b.links; i++) {
            b.length[i] = length / b.links;
            b.com[i] = 0.5 * b.length[i];
            b.mass[i] = mass * b.length[i];
            b.inertia[i] = b.mass[i] * b.length[i] * b.length[i] / 12.0;
            b.stiffness[i] = (i ? 1.0 : 2.0) * bending / b.length[i];
        }
        beam_compile(&b);
        small_open(&s, b.model, NULL, 0.0, rest, rest, NULL);
        for (int j = 0; j < 3; j++) {
            const double omega = beta[j] * beta[j] / (length * length) * sqrt(bending / mass);
            /* measured: `0.13, 0.072, 0.042` of beta^2 / N^2 at each N */
            kt_check_near("frequency, Hz", kt_modes_at(s.modes, j).frequency, omega / (2.0 * pi),
                          0.14 * beta[j] * beta[j] / (b.links * b.links) * omega / (2.0 * pi));
        }
    }
}
