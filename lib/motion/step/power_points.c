/* The points of the cubic through the last powers (work_watch.c): each point adds the work of a step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "model/motion.h"
#include "step/simulation_core.h"

#include <math.h>

/* The uncertainty is this multiple of the last term of the cubic, since powers have kinks. */
static const double caution = 4.0;

static void start_points_at(kt_power_points *p, double t, double net, double size) {
    p->count = 1;
    p->t[0] = t;
    p->d[0] = net;
    p->size = size;
}

/* Adds the point (t, net power), and the work of the step from the previous point. The work is the integral of the
 * cubic through the last four points, in Newton's form with divided differences d_k. `error` grows by a multiple of
 * the last term. If the step does not resolve the motion, `error` grows by all of the power. */
static void add_power_point(kt_power_points *p, double t, double net, double size, bool resolved) {
    const double h = t - p->t[0], h1 = t - p->t[1];
    const double d1 = (net - p->d[0]) / h, d2 = p->count > 1 ? (d1 - p->d[1]) / h1 : 0.0;
    const double d3 = p->count > 2 ? (d2 - p->d[2]) / (t - p->t[2]) : 0.0;
    const double turned = 0.5 * h * (p->size + size);
    const double second = h * h * d1 / 2.0, third = h * h * h * d2 / 6.0,
                 fourth = h * h * h * (2.0 * h1 - h) * d3 / 12.0;
    const double last = p->count > 2 ? fourth : p->count > 1 ? third : second;
    p->before = p->d[0];
    p->sum[0] = p->sum[1];
    p->sum[1].net += h * net - second - third - fourth;
    p->sum[1].error += resolved ? caution * fabs(last) : turned;
    p->sum[1].turned += turned;
    for (int k = KT_POWER_POINTS - 1; k > 0; k--)
        p->t[k] = p->t[k - 1];
    p->t[0] = t;
    p->d[0] = net;
    p->d[1] = d1;
    p->d[2] = d2;
    p->d[3] = d3;
    p->size = size;
    p->count = p->count < KT_POWER_POINTS ? p->count + 1 : KT_POWER_POINTS;
}

/* Undoes the point at the end of a step that was undone: the cubic begins anew at the start of the step. */
static void drop_point(kt_power_points *p) {
    p->sum[1] = p->sum[0];
    start_points_at(p, p->t[1], p->before, fabs(p->before));
}

/* The rate of the joint that turns fastest, rad/s. */
static double fastest_rotation(const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    const double *v = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    double fastest = 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts facts = kt_motion_facts_of(link->motion);
        for (int k = facts.lengths; k < facts.velocities; k++)
            fastest = fmax(fastest, fabs(v[link->v + k]));
    }
    return fastest;
}

void kt_simulation_add_power_point(kt_simulation *simulation, kt_power power) {
    kt_power_points *p = &simulation->memory.powers;
    const double t = kt_integrator_time(simulation->integrator);
    const double net = power.dissipated - power.supplied, size = fabs(power.dissipated) + fabs(power.supplied);
    if (p->count > 1 && t < p->t[0])
        drop_point(p);
    if (p->count == 0)
        start_points_at(p, t, net, size);
    else if (t > p->t[0])
        add_power_point(p, t, net, size,
                        !simulation->model->driven || fastest_rotation(simulation) * (t - p->t[0]) <= 1.0);
}

void kt_simulation_take_power(kt_simulation *simulation, const double *y, const double *dydt, kt_power power) {
    simulation->works.end_power = power;
    simulation->works.end_slope = dydt;
    if (y == simulation->integrator->y)
        kt_simulation_add_power_point(simulation, power);
}
