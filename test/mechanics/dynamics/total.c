/* Energies, momenta and the centre of mass: against sums over bodies in long double, and against their balances along
 * motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

static const double *components(const kt_vec3 *a) { return &a->x; }

KT_TEST(totals_are_sums_over_bodies) {
    kt_random random = kt_random_of_test();
    KT_WORST potential = kt_worst_make("V"), linear = kt_worst_make("p"), angular = kt_worst_make("L");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.is_shuffled = n % 2;
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_oracle_body bodies[KT_TREE_SLOTS];
        kt_oracle_motion(&tree, s.q, s.v, NULL, bodies);
        kt_tree_kinematics(&tree, &s);
        const kt_wrench m = kt_momentum(tree.model, tree.data);
        const kt_oracle_wrench slow = kt_oracle_momentum(&tree, bodies);
        kt_vec3 center;
        const double mass = kt_mass_center(tree.model, tree.data, &center);
        /* |p| of each body is at most sqrt(2 m T); arms are a few metres */
        const double scale = sqrt(2.0 * mass * kt_kinetic_energy(tree.model, tree.data));
        kt_worst_near(&potential, kt_potential_energy(tree.model, tree.data),
                      (double)kt_oracle_potential(&tree, bodies), 10.0 * EPS * mass * 9.81, "tree %d", n);
        for (int i = 0; i < 3; i++) {
            kt_worst_near(&linear, components(&m.force)[i], (double)slow.force[i], 20.0 * EPS * scale, "tree %d", n);
            kt_worst_near(&angular, components(&m.moment)[i], (double)slow.moment[i], 60.0 * EPS * scale, "tree %d", n);
        }
    }
}

/* V = -M g . c, p = M dc/dt: both hold with the bodies that move, and no others. */
KT_TEST(mass_center_bears_weight_and_momentum_of_the_moving_bodies) {
    kt_random random = kt_random_of_test();
    KT_WORST weight = kt_worst_make("V + M g.c"), motion = kt_worst_make("M dc - p h"), sum = kt_worst_make("M");
    const double h = 1e-3;
    for (int n = 0; n < 50; n++) {
        kt_tree tree;
        kt_tree_state s, moved;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.from_world = 0.4;
        double step[KT_TREE_NV];
        kt_vec3 center, c[4];
        kt_tree_sample(&tree, &plan, &random, &s);

        for (int k = 0; k < 4; k++) {
            moved = s;
            for (int i = 0; i < tree.nv; i++)
                step[i] = (k < 2 ? k - 2 : k - 1) * h * s.v[i];
            kt_position_add(tree.model, s.q, step, moved.q);
            kt_tree_kinematics(&tree, &moved);
            (void)kt_mass_center(tree.model, tree.data, &c[k]);
        }
        kt_tree_kinematics(&tree, &s);
        double expected = 0.0;
        for (int b = 1; b < tree.count; b++)
            expected += kt_oracle_moves(&tree, b) ? kt_body_mass(tree.model, b) : 0.0;
        const double mass = kt_mass_center(tree.model, tree.data, &center);
        const kt_vec3 g = tree.description.gravity, p = kt_momentum(tree.model, tree.data).force;
        kt_worst_near(&sum, mass, expected, 4.0 * EPS * expected, "tree %d", n);
        kt_worst_near(&weight, kt_potential_energy(tree.model, tree.data), -mass * kt_vec3_dot(g, center),
                      10.0 * EPS * mass * 9.81, "tree %d", n);
        for (int i = 0; i < 3; i++) {
            const double near = components(&c[2])[i] - components(&c[1])[i],
                         far = components(&c[3])[i] - components(&c[0])[i];
            /* `h^4 / 30` of fifth derivatives (several `m rad^5/s^5`), rounding EPS / h; measured 0.3 */
            kt_worst_near(&motion, mass * (8.0 * near - far) / (12.0 * h), components(&p)[i], 2e-11 * mass, "tree %d",
                          n);
        }
    }
}

/* ---- balances ------------------------------------------------------------------------------------------------ */

typedef struct totals {
    double energy;
    double momentum[6]; /* moment about the origin, force */
} totals;

static totals totals_now(const kt_tree *tree) {
    const kt_wrench m = kt_momentum(tree->model, tree->data);
    totals t = {.energy = kt_kinetic_energy(tree->model, tree->data) + kt_potential_energy(tree->model, tree->data)};
    memcpy(t.momentum, &m, sizeof t.momentum);
    return t;
}

/* d/dt along q (+) (v h + a h^2 / 2), v + a h, by fourth-order differences. */
static void rates(const kt_tree *tree, const kt_tree_state *s, double h, totals *out) {
    totals at[4];
    for (int k = 0; k < 4; k++) {
        kt_tree_state moved = *s;
        double step[KT_TREE_NV];
        const double t = (k < 2 ? k - 2 : k - 1) * h;
        for (int i = 0; i < tree->nv; i++) {
            step[i] = t * (s->v[i] + 0.5 * t * s->a[i]);
            moved.v[i] = s->v[i] + t * s->a[i];
        }
        kt_position_add(tree->model, s->q, step, moved.q);
        kt_tree_kinematics(tree, &moved);
        at[k] = totals_now(tree);
    }
    out->energy = (8.0 * (at[2].energy - at[1].energy) - (at[3].energy - at[0].energy)) / (12.0 * h);
    for (int i = 0; i < 6; i++)
        out->momentum[i] =
            (8.0 * (at[2].momentum[i] - at[1].momentum[i]) - (at[3].momentum[i] - at[0].momentum[i])) / (12.0 * h);
}

/* The forces are those that inverse dynamics finds for any acceleration. The errors with h = 1e-3 are `h^4 / 30` of
 * fifth derivatives of T + V, and EPS (T + V) / h. The factor c is measured: the worst of 31 seeds is half of the
 * bound. */
KT_TEST(power_of_forces_is_rate_of_energy) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("d(T + V)/dt - tau.v - external power");
    for (int n = 0; n < 60; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        totals rate;
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_inverse(&tree, &s, s.tau);
        rates(&tree, &s, 1e-3, &rate);
        kt_tree_kinematics(&tree, &s);
        double power = 0.0;
        for (int i = 0; i < tree.nv; i++)
            power += s.tau[i] * s.v[i];
        for (int b = 1; b < tree.count; b++) {
            const kt_twist t = kt_body_twist(tree.model, tree.data, b);
            power += kt_vec3_dot(t.angular, s.external[b].moment) + kt_vec3_dot(t.linear, s.external[b].force);
        }
        const double energy =
            kt_kinetic_energy(tree.model, tree.data) + fabs(kt_potential_energy(tree.model, tree.data));
        kt_worst_near(&error, rate.energy, power, 1e-10 * energy, "tree %d", n);
    }
}

/* Everything that acts on the tree as a whole, about the world's origin: external wrenches, weight, and the world's
 * reactions in the joints to it. */
static void acting(const kt_tree *tree, const kt_tree_state *s, double out[6]) {
    kt_wrench reactions[KT_TREE_SLOTS];
    kt_vec3 center, moment, force;
    const double mass = kt_mass_center(tree->model, tree->data, &center);
    kt_joint_reactions(tree->model, tree->data, s->external, reactions);
    force = kt_vec3_scale(mass, tree->description.gravity);
    moment = kt_vec3_cross(center, force);
    for (int b = 1; b < tree->count; b++) {
        if (!kt_oracle_moves(tree, b))
            continue;
        const kt_vec3 p = kt_body_pose(tree->model, tree->data, b).position;
        const kt_wrench w = s->external[b];
        force = kt_vec3_add(force, w.force);
        moment = kt_vec3_add(moment, kt_vec3_add(w.moment, kt_vec3_cross(p, w.force)));
        const int parent = kt_body_parent(tree->model, b);
        if (kt_oracle_moves(tree, parent))
            continue;
        const kt_vec3 at = tree->body[kt_body_source(tree->model, b)].joint.at;
        const kt_vec3 joint = kt_point_position(tree->model, tree->data, parent, at);
        force = kt_vec3_add(force, reactions[b].force);
        moment = kt_vec3_add(moment, kt_vec3_add(reactions[b].moment, kt_vec3_cross(joint, reactions[b].force)));
    }
    memcpy(out, (kt_wrench[]){{moment, force}}, 6 * sizeof *out);
}

KT_TEST(rate_of_momentum_is_what_acts_from_outside) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("d(L, p)/dt - external - weight - reactions");
    for (int n = 0; n < 60; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        totals rate;
        kt_tree_sample(&tree, &plan, &random, &s); /* any acceleration: the reactions follow */
        rates(&tree, &s, 1e-3, &rate);
        kt_tree_kinematics(&tree, &s);
        double expected[6];
        acting(&tree, &s, expected);
        for (int i = 0; i < 6; i++) /* some hundred N m; differences as for points */
            kt_worst_near(&error, rate.momentum[i], expected[i], 2e-8, "tree %d component %d", n, i);
    }
}

/* One step of the classical fourth-order method on (q, v), as the exponential coordinates of q: h^5 local error. */
static void step(const kt_tree *tree, kt_tree_state *s, double h) {
    kt_tree_state at = *s;
    double k[4][KT_TREE_NQ + KT_TREE_NV];
    static const double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    for (int j = 0; j < 4; j++) {
        for (int i = 0; j && i < tree->nq; i++)
            at.q[i] = s->q[i] + h * node[j] * k[j - 1][i];
        for (int i = 0; j && i < tree->nv; i++)
            at.v[i] = s->v[i] + h * node[j] * k[j - 1][tree->nq + i];
        kt_position_rate(tree->model, at.q, at.v, k[j]);
        kt_error e = {0};
        const kt_status status =
            kt_dynamics_forward(tree->model, tree->data, at.q, at.v, s->tau, NULL, k[j] + tree->nq, &e);
        kt_need_fine("forward", status, &e);
    }
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < tree->nq; i++)
            s->q[i] += h * weight[j] * k[j][i];
        for (int i = 0; i < tree->nv; i++)
            s->v[i] += h * weight[j] * k[j][tree->nq + i];
    }
    kt_need(kt_check_true("unit quaternions", kt_position_normalize(tree->model, s->q)));
}

/* Internal torques do work but move no momentum. The drift is that of the method, of fourth order. A step half as long
 * leaves a sixteenth, until rounding (EPS times a thousand steps) is reached. */
KT_TEST(floating_trees_keep_their_momentum_along_motions) {
    kt_random random = kt_random_of_test();
    KT_WORST drift = kt_worst_make("change of (L, p) in 0.25 s");
    for (int n = 0; n < 10; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 8;
        plan.floats = plan.weightless = true;
        plan.massless = false;
        kt_tree_sample(&tree, &plan, &random, &s);
        for (int i = 0; i < 6; i++)
            s.tau[i] = 0.0; /* the free joint's own forces are external */
        kt_tree_kinematics(&tree, &s);
        const kt_wrench before = kt_momentum(tree.model, tree.data);
        const double scale = sqrt(2.0 * kt_mass_center(tree.model, tree.data, &(kt_vec3){0.0, 0.0, 0.0}) *
                                  kt_kinetic_energy(tree.model, tree.data));
        for (int i = 0; i < 1000; i++)
            step(&tree, &s, 2.5e-4);
        kt_tree_kinematics(&tree, &s);
        const kt_wrench after = kt_momentum(tree.model, tree.data);
        for (int i = 0; i < 6; i++)
            kt_worst_near(&drift, (&after.moment.x)[i], (&before.moment.x)[i], 5e-11 * scale, "tree %d %d", n, i);
    }
}
