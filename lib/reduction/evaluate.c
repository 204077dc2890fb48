/* The accelerations of a whole mechanism.
 *
 * At a singular position of the loops one equation depends on the others. The motion goes through smoothly, and so does
 * its acceleration, but it cannot be computed there, and not well nearby: with a residual of c left by rounding and x
 * the distance to the position, a motion at speed v seems to accelerate sideways by 2 c v^2 / x^3. So near it
 * (KT_NEAR_SINGULAR) the acceleration is interpolated from states beside, at distances -2, -1, 1 and 2 times dt along
 * the motion, projected: a = (4 (a_1 + a_-1) - (a_2 + a_-2)) / 6 + O(dt^4). The states are reached with an acceleration
 * without the direction that is about to be lost, and once more with the one found. Where there is hardly any motion to
 * go along, the plain acceleration stands.
 */
#include "reduction/evaluate.h"

#include "dynamics/kernel.h"

#include <stdio.h>
#include <string.h>

#define BESIDE (2.0 * KT_NEAR_SINGULAR) /* rad or m: how far dt moves the fastest coordinate, to begin with */

enum { WIDER_MOST = 5, PASSES = 2 };

static bool is_near_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->near[g])
            return true;
    return false;
}

static bool is_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->rank[g] < model->group[g].rank)
            return true;
    return false;
}

/* A mechanism in motion, near a singular position. */
typedef struct crossing {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *q, *v, *tau;
    const kt_wrench *external;
} crossing;

/* The acceleration dt later, on the way that a gives, into `out`; false where it cannot be had there. */
static bool accelerate_beside(const crossing *c, double dt, const double *a, double *out) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    bool changed;
    kt_violation violation;
    for (size_t i = 0; i < model->n.v; i++)
        data->beside_v[i] = dt * (c->v[i] + 0.5 * dt * a[i]);
    kt_position_add(model, c->q, data->beside_v, data->beside_q);
    for (size_t i = 0; i < model->n.v; i++)
        data->beside_v[i] = c->v[i] + dt * a[i];
    return kt_project_in_place(model, data, c->t + dt, data->beside_q, data->beside_v, 5, 1e-9, &changed, &violation) ==
               0 &&
           kt_reduction_kernels_of(model)->forward(model, data, c->t + dt, data->beside_q, data->beside_v, c->tau,
                                                   c->external, false, out) == 0 &&
           !is_near_singular(model, data);
}

/* a (in and out) from four states beside. */
static bool interpolate(const crossing *c, double dt, double *a) {
    static const double place[4] = {-2.0, -1.0, 1.0, 2.0};
    const size_t nv = c->model->n.v;
    double *sum = c->data->side, *one = c->data->side + kt_lanes8(nv);
    memset(sum, 0, nv * sizeof *sum);
    for (int k = 0; k < 4; k++) {
        if (!accelerate_beside(c, place[k] * dt, a, one))
            return false;
        const double weight = k == 0 || k == 3 ? -1.0 / 6.0 : 4.0 / 6.0;
        for (size_t i = 0; i < nv; i++)
            sum[i] += weight * one[i];
    }
    memcpy(a, sum, nv * sizeof *a);
    return true;
}

/* The largest magnitude among the coordinates of groups. */
static double largest(const kt_model *model, const double *x) {
    double most = 0.0;
    for (size_t i = 0; i < model->n.group_v; i++)
        most = fmax(most, fabs(x[model->group_v[i]]));
    return most;
}

/* Replaces a, found without the lost direction, by what the states beside say; false where they say nothing. */
static bool cross(const crossing *c, double *a) {
    const double speed = largest(c->model, c->v), pull = largest(c->model, a);
    double *try = c->data->side + 2 * kt_lanes8(c->model->n.v);
    if (!(speed > 0.0))
        return false;
    double dt = BESIDE / speed;
    for (int wider = 0; wider < WIDER_MOST; wider++, dt *= 2.0) {
        if (dt * pull > 0.2 * speed)
            return false; /* so slow that the motion is not the one that the speed tells of */
        memcpy(try, a, c->model->n.v * sizeof *try);
        int pass = 0;
        while (pass < PASSES && interpolate(c, dt, try))
            pass++;
        if (pass < PASSES)
            continue;
        memcpy(a, try, c->model->n.v * sizeof *a);
        return true;
    }
    return false;
}

static kt_status refuse_singular(const kt_model *model, size_t link, double t, const double *q, const double *v,
                                 kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s', t = %.9g s",
                   model->text + model->body[model->link[link].body].name, t);
    for (size_t i = 0; i < model->n.q; i++)
        if (!isfinite(q[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, where, "a position is not finite");
    for (size_t i = 0; i < model->n.v; i++)
        if (!isfinite(v[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, where, "a velocity is not finite");
    return kt_error_set(
        error, KT_ERROR_SINGULAR, where,
        "the mechanism has no inertia along one of the freedoms that its loops leave: give the bodies that "
        "move there mass or inertia");
}

kt_status kt_closed_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    size_t failed = kernels->forward(model, data, t, q, v, tau, external, false, data->scratch);
    if (is_near_singular(model, data) && (!failed || is_singular(model, data))) {
        const crossing c = {.model = model, .data = data, .t = t, .q = q, .v = v, .tau = tau, .external = external};
        failed = kernels->forward(model, data, t, q, v, tau, external, true, data->scratch);
        if (!failed && !cross(&c, data->scratch))
            failed = kernels->forward(model, data, t, q, v, tau, external, false, data->scratch);
    }
    if (failed)
        return refuse_singular(model, failed, t, q, v, error);
    return kt_commit(model, data->scratch, a, "acceleration", error);
}

kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    if (model->n.effect)
        kt_effects_apply(model, data, t, q, v, &tau, &external);
    if (!model->n.group)
        return kt_dynamics_forward(model, data, q, v, tau, external, a, error);
    return kt_closed_forward(model, data, t, q, v, tau ? tau : model->zero, external, a, error);
}
