/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#pragma GCC diagnostic ignored "-Wdouble-promotion" /* to long double: that is the purpose */

static const kt_body *described(const kt_tree *tree, int body) {
    return &tree->description.bodies[kt_body_source(tree->model, body)];
}

/* ---- bodies with mass ---------------------------------------------------------------------------------------- */

static void cross(const long double a[3], const long double b[3], long double out[3]) {
    const long double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, c, sizeof c);
}

/* The centre of mass against the body's origin, world axes, and the inertia about it times a vector. */
static void arm_of(const kt_body *body, const kt_oracle_body *m, long double arm[3]) {
    const long double c[3] = {body->com.x, body->com.y, body->com.z};
    for (int i = 0; i < 3; i++)
        arm[i] = m->r[i][0] * c[0] + m->r[i][1] * c[1] + m->r[i][2] * c[2];
}

static void inertia_times(const kt_body *body, const kt_oracle_body *m, const long double x[3], long double out[3]) {
    const kt_sym3 s = body->inertia;
    const long double j[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    long double local[3] = {0}, turned[3] = {0};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            local[i] += m->r[k][i] * x[k];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            turned[i] += j[i][k] * local[k];
    for (int i = 0; i < 3; i++)
        out[i] = m->r[i][0] * turned[0] + m->r[i][1] * turned[1] + m->r[i][2] * turned[2];
}

/* Velocity and acceleration of a point at `arm` from the origin. */
static void velocity_at(const kt_oracle_body *m, const long double arm[3], long double out[3]) {
    cross(m->w, arm, out);
    for (int i = 0; i < 3; i++)
        out[i] += m->u[i];
}

static void acceleration_at(const kt_oracle_body *m, const long double arm[3], long double out[3]) {
    long double x[3];
    cross(m->w, arm, x);
    cross(m->w, x, out);
    cross(m->alpha, arm, x);
    for (int i = 0; i < 3; i++)
        out[i] += m->a[i] + x[i];
}

/* The force that a body needs: inertia less gravity less external, about its origin. */
static kt_oracle_wrench demand(const kt_tree *tree, int b, const kt_oracle_body *m, const kt_wrench *external) {
    const kt_body *body = described(tree, b);
    const kt_vec3 g = tree->description.gravity;
    const long double gravity[3] = {g.x, g.y, g.z};
    long double arm[3], a[3], x[3], spin[3];
    kt_oracle_wrench out;
    arm_of(body, m, arm);
    acceleration_at(m, arm, a);
    for (int i = 0; i < 3; i++)
        out.force[i] = body->mass * (a[i] - gravity[i]);
    inertia_times(body, m, m->w, x);
    cross(m->w, x, spin);
    inertia_times(body, m, m->alpha, x);
    cross(arm, out.force, out.moment);
    const double *n = external ? &external[b].moment.x : NULL, *f = external ? &external[b].force.x : NULL;
    for (int i = 0; i < 3; i++) {
        out.moment[i] += x[i] + spin[i] - (n ? n[i] : 0.0);
        out.force[i] -= f ? f[i] : 0.0;
    }
    return out;
}

/* Twists of all bodies for a unit velocity of each coordinate: columns[k * KT_TREE_SLOTS + body]. */
static kt_oracle_body *unit_twists(const kt_tree *tree, const double *q) {
    kt_oracle_body *columns = calloc((size_t)tree->nv * KT_TREE_SLOTS, sizeof *columns);
    double e[KT_TREE_NV] = {0};
    if (!columns)
        abort();
    for (int k = 0; k < tree->nv; k++) {
        e[k] = 1.0;
        kt_oracle_motion(tree, q, e, NULL, columns + k * KT_TREE_SLOTS);
        e[k] = 0.0;
    }
    return columns;
}

static long double dot(const long double a[3], const long double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The armature of velocity coordinate v. */
static long double armature_of(const kt_tree *tree, int v) {
    const int body = kt_velocity_body(tree->model, v);
    return described(tree, body)->joint.armature[v - kt_body_coordinates(tree->model, body).v];
}

void kt_oracle_mass(const kt_tree *tree, const double *q, long double *mass) {
    kt_oracle_body *columns = unit_twists(tree, q);
    const int nv = tree->nv;
    memset(mass, 0, (size_t)nv * (size_t)nv * sizeof *mass);
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = described(tree, b);
        for (int i = 0; i < nv; i++) {
            const kt_oracle_body *m = &columns[i * KT_TREE_SLOTS + b];
            long double arm[3], u[3], h[3];
            arm_of(body, m, arm);
            velocity_at(m, arm, u);
            inertia_times(body, m, m->w, h);
            for (int j = 0; j < nv; j++) {
                const kt_oracle_body *other = &columns[j * KT_TREE_SLOTS + b];
                long double x[3];
                velocity_at(other, arm, x);
                mass[i * nv + j] += body->mass * dot(u, x) + dot(h, other->w);
            }
        }
    }
    for (int i = 0; i < nv; i++)
        mass[i * (nv + 1)] += armature_of(tree, i);
    free(columns);
}

static long double norm(const long double a[3]) { return sqrtl(dot(a, a)); }
static long double norm_of(kt_vec3 a) {
    return sqrtl((long double)a.x * a.x + (long double)a.y * a.y + (long double)a.z * a.z);
}

/* The terms of a body's demand that round: their magnitudes, moment first. */
static void magnitude(const kt_tree *tree, int b, const kt_oracle_body *m, const kt_wrench *external,
                      long double size[2]) {
    const kt_body *body = described(tree, b);
    long double arm[3], x[3];
    arm_of(body, m, arm);
    const long double w2 = dot(m->w, m->w), r = norm(arm);
    const long double f = body->mass * (norm(m->a) + (norm(m->alpha) + w2) * r + norm_of(tree->description.gravity));
    inertia_times(body, m, m->w, x);
    size[0] = r * f + norm(x) * norm(m->w);
    inertia_times(body, m, m->alpha, x);
    size[0] += norm(x) + (external ? norm_of(external[b].moment) : 0);
    size[1] = f + (external ? norm_of(external[b].force) : 0);
}

void kt_oracle_inverse(const kt_tree *tree, const kt_tree_state *s, const double *a, long double *tau,
                       long double *size) {
    kt_oracle_body bodies[KT_TREE_SLOTS], *columns = unit_twists(tree, s->q);
    kt_oracle_motion(tree, s->q, s->v, a, bodies);
    for (int k = 0; k < tree->nv; k++)
        size[k] = fabsl(tau[k] = a ? armature_of(tree, k) * a[k] : 0);
    for (int b = 1; b < tree->count; b++) {
        const kt_oracle_wrench w = demand(tree, b, &bodies[b], s->external);
        long double terms[2];
        magnitude(tree, b, &bodies[b], s->external, terms);
        for (int k = 0; k < tree->nv; k++) {
            const kt_oracle_body *m = &columns[k * KT_TREE_SLOTS + b];
            tau[k] += dot(m->w, w.moment) + dot(m->u, w.force);
            size[k] += norm(m->w) * terms[0] + norm(m->u) * terms[1];
        }
    }
    free(columns);
}

/* ---- equations ----------------------------------------------------------------------------------------------- */

bool kt_oracle_solve(int n, long double *a, int columns, long double *b) {
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabsl(a[i * n + k]) > fabsl(a[pivot * n + k]))
                pivot = i;
        if (a[pivot * n + k] == 0)
            return false;
        for (int j = 0; j < n + columns; j++) {
            long double *x = j < n ? &a[k * n + j] : &b[k * columns + j - n];
            long double *y = j < n ? &a[pivot * n + j] : &b[pivot * columns + j - n];
            const long double kept = *x;
            *x = *y;
            *y = kept;
        }
        for (int i = 0; i < n; i++) {
            const long double f = i == k ? 0 : a[i * n + k] / a[k * n + k];
            for (int j = k; f != 0 && j < n; j++)
                a[i * n + j] -= f * a[k * n + j];
            for (int j = 0; f != 0 && j < columns; j++)
                b[i * columns + j] -= f * b[k * columns + j];
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < columns; j++)
            b[i * columns + j] /= a[i * n + i];
    return true;
}

bool kt_oracle_forward(const kt_tree *tree, const kt_tree_state *s, long double *a, double *sensitivity) {
    const int n = tree->nv;
    const size_t square = (size_t)n * (size_t)n;
    long double *mass = malloc((3 * square + 2 * (size_t)n) * sizeof *mass);
    if (!mass)
        abort();
    long double *inverse = mass + square, *kept = inverse + square, *right = kept + square, *size = right + n;
    kt_oracle_mass(tree, s->q, mass);
    memcpy(kept, mass, square * sizeof *kept);
    memset(inverse, 0, square * sizeof *inverse);
    kt_oracle_inverse(tree, s, NULL, right, size);
    for (int i = 0; i < n; i++) {
        inverse[i * n + i] = 1;
        right[i] = s->tau[i] - right[i];
        size[i] += fabs(s->tau[i]);
    }
    const bool regular = kt_oracle_solve(n, mass, n, inverse);
    for (int i = 0; regular && i < n; i++) {
        a[i] = 0;
        for (int j = 0; j < n; j++)
            a[i] += inverse[i * n + j] * right[j];
    }
    for (int i = 0; regular && i < n; i++)
        for (int j = 0; j < n; j++)
            size[i] += fabsl(kept[i * n + j] * a[j]);
    for (int i = 0; regular && i < n; i++) {
        long double sum = 0;
        for (int j = 0; j < n; j++)
            sum += fabsl(inverse[i * n + j]) * size[j];
        sensitivity[i] = (double)sum;
    }
    free(mass);
    return regular;
}

/* ---- sums over bodies ---------------------------------------------------------------------------------------- */

static bool carries(const kt_tree *tree, int ancestor, int body) {
    while (body > ancestor)
        body = kt_body_parent(tree->model, body);
    return body == ancestor;
}

void kt_oracle_reactions(const kt_tree *tree, const kt_tree_state *s, kt_oracle_wrench *wrenches) {
    kt_oracle_body bodies[KT_TREE_SLOTS];
    kt_oracle_motion(tree, s->q, s->v, s->a, bodies);
    memset(wrenches, 0, (size_t)tree->count * sizeof *wrenches);
    for (int i = 1; i < tree->count; i++) {
        const kt_oracle_body *parent = &bodies[kt_body_parent(tree->model, i)];
        const kt_vec3 at = described(tree, i)->joint.at;
        long double joint[3];
        for (int k = 0; k < 3; k++)
            joint[k] = parent->p[k] + parent->r[k][0] * at.x + parent->r[k][1] * at.y + parent->r[k][2] * at.z;
        for (int b = i; b < tree->count; b++) {
            if (!carries(tree, i, b))
                continue;
            const kt_oracle_wrench w = demand(tree, b, &bodies[b], s->external);
            const long double arm[3] = {bodies[b].p[0] - joint[0], bodies[b].p[1] - joint[1],
                                        bodies[b].p[2] - joint[2]};
            long double x[3];
            cross(arm, w.force, x);
            for (int k = 0; k < 3; k++) {
                wrenches[i].moment[k] += w.moment[k] + x[k];
                wrenches[i].force[k] += w.force[k];
            }
        }
    }
}

long double kt_oracle_kinetic(const kt_tree *tree, const kt_oracle_body *bodies) {
    long double twice = 0;
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = described(tree, b);
        long double arm[3], u[3], h[3];
        arm_of(body, &bodies[b], arm);
        velocity_at(&bodies[b], arm, u);
        inertia_times(body, &bodies[b], bodies[b].w, h);
        twice += body->mass * dot(u, u) + dot(h, bodies[b].w);
    }
    return twice / 2;
}

long double kt_oracle_potential(const kt_tree *tree, const kt_oracle_body *bodies) {
    const kt_vec3 g = tree->description.gravity;
    const long double gravity[3] = {g.x, g.y, g.z};
    long double energy = 0;
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = described(tree, b);
        long double arm[3];
        if (!kt_oracle_moves(tree, b))
            continue;
        arm_of(body, &bodies[b], arm);
        energy -= body->mass * (dot(gravity, bodies[b].p) + dot(gravity, arm));
    }
    return energy;
}

kt_oracle_wrench kt_oracle_momentum(const kt_tree *tree, const kt_oracle_body *bodies) {
    kt_oracle_wrench sum = {{0}, {0}};
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = described(tree, b);
        long double arm[3], u[3], spin[3], place[3], x[3];
        arm_of(body, &bodies[b], arm);
        velocity_at(&bodies[b], arm, u);
        inertia_times(body, &bodies[b], bodies[b].w, spin);
        for (int k = 0; k < 3; k++) {
            place[k] = bodies[b].p[k] + arm[k];
            u[k] *= body->mass;
        }
        cross(place, u, x);
        for (int k = 0; k < 3; k++) {
            sum.force[k] += u[k];
            sum.moment[k] += x[k] + spin[k];
        }
    }
    return sum;
}
