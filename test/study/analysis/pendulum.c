/* Pendulums and chains of them against closed forms.
 *
 * A pendulum of point mass on length l has lambda = +- i sqrt(g/l) hanging, and +- sqrt(g/l) upright. With a damper c
 * it has `lambda^2 + c/(m l^2) lambda + g/l = 0`. A chain of n equal point masses on equal links l has omega^2 = (g/l)
 * x. The numbers x are the roots of the Laguerre polynomial L_n (D. Bernoulli, 1733). They follow from L_n's own
 * three-term recurrence, by bisection.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "small.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LINKS = 40 };

/* Point masses on massless links that hang from one another along -y. */
typedef struct chain {
    kt_description description;
    kt_body body[LINKS];
    kt_effect effect[LINKS];
    char name[LINKS][8];
    kt_model *model;
    double q[LINKS], v[LINKS];
} chain;

static void chain_begin(chain *c, int links, double length) {
    memset(c, 0, sizeof *c);
    c->description = kt_description_default();
    c->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    c->description.bodies = c->body;
    c->description.body_count = links;
    c->description.effects = c->effect;
    for (int i = 0; i < links; i++) {
        snprintf(c->name[i], sizeof c->name[i], "b%d", i);
        c->body[i] = kt_body_of(c->name[i], i ? c->name[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        c->body[i].joint.at = kt_vec3_make(0.0, i ? -length : 0.0, 0.0);
        c->body[i].com = kt_vec3_make(0.0, -length, 0.0);
    }
}

static void chain_compile(chain *c) {
    c->model = kt_test_model(&c->description, NULL);
    kt_model_initial(c->model, c->q, c->v);
}

static void chain_damp(chain *c, int link, double damping) {
    kt_effect *effect = &c->effect[c->description.effect_count++];
    *effect = kt_effect_of(KT_EFFECT_JOINT_DAMPER, c->name[link]);
    effect->damping = damping;
}

KT_TEST(pendulum_swings_falls_and_creeps_as_its_closed_form) {
    const double l = 0.7, w2 = 9.81 / l, damping = 1.3;
    KT_WORST worst = kt_worst_make("lambda of a pendulum");
    for (int damped = 0; damped < 2; damped++)
        for (int upright = 0; upright < 2; upright++) {
            chain c;
            small s = {0};
            chain_begin(&c, 1, l);
            if (damped)
                chain_damp(&c, 0, damping);
            chain_compile(&c);
            c.q[0] = upright ? acos(-1.0) : 0.0;
            const double d = damped ? damping / (l * l) : 0.0, square = d * d / 4.0 + (upright ? w2 : -w2);
            small_open(&s, c.model, NULL, 0.0, c.q, c.v, NULL);
            const double root = sqrt(fabs(square));
            /* measured: 4e-14 */
            small_expect(&s, -d / 2.0 + (square > 0.0 ? root : 0.0), square > 0.0 ? 0.0 : root, 2e-13, &worst);
            small_expect(&s, -d / 2.0 - (square > 0.0 ? root : 0.0), square > 0.0 ? 0.0 : root, 2e-13, &worst);
        }
}

/* Two point masses: omega^2 = g (2 +- sqrt 2) / l, shapes dq2 / dq1 = (absolute angles) +- sqrt 2. */
KT_TEST(double_pendulum_has_its_frequencies_and_shapes) {
    const double l = 1.3;
    chain c;
    small s = {0};
    chain_begin(&c, 2, l);
    chain_compile(&c);
    small_open(&s, c.model, NULL, 0.0, c.q, c.v, NULL);
    kt_check_equal_int("modes", kt_modes_count(s.modes), 2);
    for (int i = 0; i < kt_modes_count(s.modes); i++) {
        const double sign = i ? 1.0 : -1.0, omega = sqrt(9.81 / l * (2.0 + sign * sqrt(2.0)));
        const double *dq = kt_modes_positions(s.modes, i), *dv = kt_modes_velocities(s.modes, i);
        const kt_mode mode = kt_modes_at(s.modes, i);
        kt_check_near("omega", mode.imaginary, omega, 4.0 * DBL_EPSILON * omega);
        kt_check_near("Hz", mode.frequency, omega / (2.0 * acos(-1.0)), 4.0 * DBL_EPSILON);
        kt_check_near("damping", mode.damping, 0.0, 2.0 * DBL_EPSILON);
        kt_check_below("error", mode.error, 1e-11);
        const double absolute = -sign * sqrt(2.0), relative = absolute - 1.0; /* dq2 / dq1, of the joint */
        kt_check_near("shape", dq[2] / dq[0], relative, 40.0 * DBL_EPSILON);
        kt_check_near("in phase", dq[3], 0.0, 4.0 * DBL_EPSILON);
        kt_check_near("largest is one", fmax(fabs(dq[0]), fabs(dq[2])), 1.0, 1e-15);
        kt_check_near("dv = lambda dq", dv[1], omega * dq[0], 4.0 * DBL_EPSILON * omega);
    }
}

/* L_n(x) by (k + 1) L_{k+1} = (2 k + 1 - x) L_k - k L_{k-1} */
static double laguerre(int n, double x) {
    double before = 1.0, now = 1.0 - x;
    for (int k = 1; k < n; k++) {
        const double next = ((2.0 * k + 1.0 - x) * now - k * before) / (k + 1.0);
        before = now;
        now = next;
    }
    return now;
}

/* Roots in `(0, 4 n)`, found on a grid fine enough for n = 40 and bisected. */
static int laguerre_roots(int n, double *root) {
    const int grid = 200000;
    int count = 0;
    for (int i = 0; i < grid; i++) {
        double low = 4.0 * n * pow((double)i / grid, 2.0), high = 4.0 * n * pow((i + 1.0) / grid, 2.0);
        if ((laguerre(n, low) > 0.0) == (laguerre(n, high) > 0.0))
            continue;
        for (int k = 0; k < 80; k++) {
            const double middle = 0.5 * (low + high);
            if ((laguerre(n, low) > 0.0) == (laguerre(n, middle) > 0.0))
                low = middle;
            else
                high = middle;
        }
        root[count++] = low;
    }
    return count;
}

KT_TEST(hanging_chain_has_the_roots_of_laguerre_polynomials) {
    const int sizes[] = {1, 2, 3, 5, 10, 20, 40};
    const double l = 0.25;
    KT_WORST worst = kt_worst_make("omega / sqrt(g / l)");
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        const int n = sizes[k];
        double root[LINKS];
        chain c;
        small s = {0};
        chain_begin(&c, n, l);
        kt_check_equal_int("roots", laguerre_roots(n, root), n);
        chain_compile(&c);
        small_open(&s, c.model, NULL, 0.0, c.q, c.v, NULL);
        kt_check_equal_int("modes", kt_modes_count(s.modes), n);
        for (int i = 0; i < n && i < kt_modes_count(s.modes); i++) {
            const kt_mode mode = kt_modes_at(s.modes, i);
            const double omega = sqrt(9.81 / l * root[i]), off = hypot(mode.real, mode.imaginary - omega);
            /* measured: 3e-15 at n = 20 */
            kt_worst_below(&worst, off / sqrt(9.81 / l * root[n - 1]), 1e-15 * n, "n = %d, mode %d", n, i);
        }
    }
}
