/* Random problems of impacts of rigid bodies with friction, and a solver for them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CONE_IMPACTS_H
#define KT_TEST_CONE_IMPACTS_H

#include "base/arena.h"
#include "cone/cone_parts.h"

#include <math.h>
#include <stdlib.h>

#include "check.h"
#include "random.h"

enum { CONTACTS = 50, BODIES = 20, ROWS = 3 * CONTACTS, DOFS = 6 * BODIES };
enum kind { BOX, WEDGE, HEAP, CHAIN, KINDS };

typedef struct problem {
    int n, dofs;
    double W[ROWS * ROWS], b[ROWS], mu[CONTACTS], least[CONTACTS];
    double J[ROWS][DOFS], mass[DOFS];
} problem;

static void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Adds a point at r, in the frame of a body's centre, to the three rows of a contact with the normal n. */
static void add_end(problem *p, int contact, int body, double sign, const double *r, const double *n) {
    const double other[3] = {fabs(n[0]) < 0.9, fabs(n[0]) >= 0.9, 0.0};
    double axis[3][3] = {{n[0], n[1], n[2]}}, norm;
    cross(n, other, axis[1]);
    norm = sqrt(axis[1][0] * axis[1][0] + axis[1][1] * axis[1][1] + axis[1][2] * axis[1][2]);
    for (int k = 0; k < 3; k++)
        axis[1][k] /= norm;
    cross(n, axis[1], axis[2]);
    for (int c = 0; c < 3; c++) {
        double turn[3];
        cross(r, axis[c], turn);
        for (int k = 0; k < 3; k++) {
            p->J[3 * contact + c][6 * body + k] += sign * axis[c][k];
            p->J[3 * contact + c][6 * body + 3 + k] += sign * turn[k];
        }
    }
}

static void draw_contact(kt_random *random, enum kind kind, problem *p, int i, int bodies, const double face[4][3]) {
    double n[3] = {0.0, 0.0, 1.0}, r[3];
    const int body = kind == HEAP ? (i < bodies ? i : kt_random_int(random, 0, bodies - 1)) : 0;
    kt_random_direction(random, 3, r);
    for (int k = 0; k < 3; k++)
        r[k] *= 0.2;
    if (kind == BOX)
        r[2] = -0.1;
    if (kind == WEDGE) {
        const double *f = face[kt_random_int(random, 0, 3)];
        const double side = r[0] * f[0] + r[1] * f[1] + r[2] * f[2] > 0.0 ? -1.0 : 1.0; /* it pushes inwards */
        for (int k = 0; k < 3; k++) {
            n[k] = f[k];
            r[k] *= side;
        }
    }
    if (kind == HEAP)
        kt_random_direction(random, 3, n);
    add_end(p, i, body, 1.0, r, n);
    if (kind == HEAP && body > 0 && kt_random_uniform(random, 0.0, 1.0) < 0.7)
        add_end(p, i, kt_random_int(random, 0, body - 1), -1.0, r, n);
}

/* W = J M^-1 J' and b = J v of random bodies; a chain is a dense J of few degrees of freedom. */
static void draw_problem(kt_random *random, enum kind kind, int n, problem *p) {
    double face[4][3], v[DOFS];
    const int bodies = kind == HEAP ? 1 + n / 3 : 1;
    const double all = kt_random_uniform(random, 0.0, 1.0) < 0.3 ? kt_random_uniform(random, 0.1, 1.2) : -1.0;
    *p = (problem){.n = n, .dofs = kind == CHAIN ? kt_random_int(random, 3, 20) : 6 * bodies};
    for (int k = 0; k < 4; k++)
        kt_random_direction(random, 3, face[k]);
    for (int i = 0; i < n; i++) {
        p->mu[i] = all >= 0.0                                  ? all
                   : kt_random_uniform(random, 0.0, 1.0) < 0.1 ? 0.0
                                                               : kt_random_uniform(random, 0.0, 1.2);
        if (kind != CHAIN)
            draw_contact(random, kind, p, i, bodies, (const double(*)[3])face);
        for (int c = 0; kind == CHAIN && c < 3; c++)
            for (int k = 0; k < p->dofs; k++)
                p->J[3 * i + c][k] = kt_random_normal(random);
    }
    for (int k = 0; k < p->dofs; k++) {
        p->mass[k] = kind == CHAIN ? pow(10.0, kt_random_uniform(random, -1.0, 1.0)) : k % 6 < 3 ? 1.0 : 0.02;
        v[k] = kt_random_normal(random);
    }
    for (int i = 0; i < 3 * n; i++) {
        for (int k = 0; k < p->dofs; k++)
            p->b[i] += p->J[i][k] * v[k];
        for (int j = 0; j < 3 * n; j++)
            for (int k = 0; k < p->dofs; k++)
                p->W[i * 3 * n + j] += p->J[i][k] * p->J[j][k] / p->mass[k];
    }
}

/* A solver, with its matrices behind it. The caller frees the memory. */
static kt_cone *make_cone(int n, int most, void **memory) {
    const size_t size = kt_cone_size(n, most);
    *memory = aligned_alloc(KT_ARENA_ALIGNMENT, size + kt_cone_matrices_size(most));
    return kt_cone_init(n, most, *memory, (char *)*memory + size);
}

#endif
