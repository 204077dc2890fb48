/* The accelerations of a mechanism with loops.
 *
 * At a singular position of the loops one equation depends on the others. The motion passes through smoothly, and so
 * does its acceleration, but the acceleration cannot be computed there, and not accurately nearby: with a residual c
 * left by rounding and the distance x to the position, a motion at speed v seems to accelerate sideways by
 * 2 c v^2 / x^3. So near a singular position (KT_NEAR_SINGULAR) the acceleration is interpolated from six neighbouring
 * states of the motion. Let (q, v)(s) be any smooth family of states on the manifold with (q, v)(0) the given one: then
 * a(s) is smooth, and a(0) is required. The states are q (+) s v and v, both projected, for s = -3, -2, -1, 1, 2 and 3
 * times h:
 *     a(0) = (15 (a_1 + a_-1) - 6 (a_2 + a_-2) + (a_3 + a_-3)) / 20 + h^6 a6 / 20      a6: the sixth derivative
 * with h such that the fastest coordinate moves by 0.02 of its unit: the error is 3e-12 a6, and rounding errors at the
 * nearest of these states are about 3e-11 v^2. The error is seen by the interpolation of the inner four states,
 *     a(0) = (4 (a_1 + a_-1) - (a_2 + a_-2)) / 6 + h^4 a4 / 6,
 * and h is halved while both differ: a mechanism may change its shape within less than its units. If loops are driven,
 * time varies with s; otherwise only the groups move that are near a singular position. Forces are those of the given
 * state throughout. If nothing moves, the acceleration computed without interpolation is used.
 */
#include "mechanism/evaluate.h"

#include "dynamics/dynamics.h"

#include <stdio.h>
#include <string.h>

/* How far the first dt moves the fastest coordinate, relative to its unit. */
#define NEIGHBOUR_DISTANCE (2.0 * KT_NEAR_SINGULAR)
/* The least size of a direction at the neighbouring states, relative to its usual size. */
#define CLEAR (0.1 * KT_NEAR_SINGULAR)
/* By how much the interpolations of six and of four states may differ, relative to the largest acceleration (if a
 * varies within R units, by 4 (0.02 / R)^4, and the error is 36 (0.02 / R)^6), and how often h is halved at most: each
 * time the error falls to 1/64, and that of rounding grows eightfold. */
#define APART_MOST 2e-6
enum { HALVINGS_MOST = 3 };

static bool is_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->near[g] && data->rank[g] < model->group[g].rank[KT_ROWS_ALL])
            return true;
    return false;
}

/* A motion near a singular position. */
typedef struct crossing {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *q, *v, *tau;
    const kt_wrench *external;
    bool driven;             /* loops change with time */
    const double *direction; /* v of the coordinates that move, zero for the others */
} crossing;

/* Whether no group is so near to a singular position that rounding errors dominate the acceleration. */
static bool is_clear(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->near[g] && (data->rank[g] < model->group[g].rank[KT_ROWS_ALL] ||
                              data->last[g] < CLEAR * model->group[g].usual[KT_ROWS_ALL]))
            return false;
    return true;
}

/* Computes the acceleration at the neighbouring state dt away along the motion, into `out`. Returns false if the
 * acceleration cannot be computed there. */
static bool accelerate_neighbour(const crossing *c, double dt, double *out) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const double t = c->t + (c->driven ? dt : 0.0);
    bool changed = false;
    kt_violation violation;
    for (size_t i = 0; i < model->n.v; i++)
        data->neighbour_v[i] = dt * c->direction[i];
    kt_position_add(model, c->q, data->neighbour_v, data->neighbour_q);
    memcpy(data->neighbour_v, c->v, model->n.v * sizeof *c->v);
    return kt_project_in_place(model, data, t, data->neighbour_q, data->neighbour_v, 6, 0.0, KT_CLOSED_ASSEMBLED,
                               &changed, &violation) == KT_CLOSURE_DONE &&
           kt_reduction_kernels_of(model)->forward(model, data, t, data->neighbour_q, data->neighbour_v, c->tau,
                                                   c->external, false, out) == 0 &&
           is_clear(model, data);
}

/* Interpolates the acceleration from six neighbouring states; returns how far it is from that of the inner four,
 * relative to the largest, or infinity if one of them cannot be computed. */
static double interpolate(const crossing *c, double dt, double *a) {
    static const double node[6] = {-3.0, -2.0, -1.0, 1.0, 2.0, 3.0};
    static const double weight[6] = {0.05, -0.3, 0.75, 0.75, -0.3, 0.05};
    static const double inner[6] = {0.0, -1.0 / 6.0, 2.0 / 3.0, 2.0 / 3.0, -1.0 / 6.0, 0.0};
    const size_t nv = c->model->n.v;
    double *one = c->data->scratch_v, *four = c->data->scratch_v + 3 * kt_lanes8(nv), apart = 0.0, most = 0.0;
    memset(a, 0, nv * sizeof *a);
    memset(four, 0, nv * sizeof *four);
    for (int k = 0; k < 6; k++) {
        if (!accelerate_neighbour(c, node[k] * dt, one))
            return (double)INFINITY;
        for (size_t i = 0; i < nv; i++) {
            a[i] += weight[k] * one[i];
            four[i] += inner[k] * one[i];
        }
    }
    for (size_t i = 0; i < nv; i++) {
        apart = fmax(apart, fabs(a[i] - four[i]));
        most = fmax(most, fabs(a[i]));
    }
    return apart > 0.0 ? apart / most : 0.0;
}

/* Writes the velocities of the coordinates that move to `direction`. Returns the largest of these speeds relative to
 * its unit, and in *pull the largest acceleration, relative to its unit, too. */
static double choose_direction(const crossing *c, const double *a, double *direction, double *pull) {
    const kt_model *model = c->model;
    double speed = 0.0;
    *pull = 0.0;
    memset(direction, 0, model->n.v * sizeof *direction);
    if (c->driven)
        memcpy(direction, c->v, model->n.v * sizeof *direction);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (!c->driven && !c->data->near[g])
            continue;
        for (int32_t i = group->v; i < group->v + group->v_count; i++) {
            const int32_t k = model->group_v[i];
            direction[k] = c->v[k];
            speed = fmax(speed, fabs(c->v[k]) / model->unit[i]);
            *pull = fmax(*pull, fabs(a[k]) / model->unit[i]);
        }
    }
    return speed;
}

/* Halves dt while the interpolations of six and of four states differ by more than APART_MOST, `apart` at first, and
 * come nearer to each other. */
static void come_nearer(const crossing *c, double dt, double apart, double *try, double *a) {
    for (int k = 0; k < HALVINGS_MOST && apart > APART_MOST; k++) {
        const double before = apart;
        dt *= 0.5;
        apart = interpolate(c, dt, try);
        if (!(apart < before))
            return;
        memcpy(a, try, c->model->n.v * sizeof *a);
    }
}

/* Replaces a, which was computed without the lost direction, by the interpolated acceleration; returns false if that
 * cannot be computed. */
static bool cross(crossing *c, double *a) {
    static const double wider[] = {1.0, 1.5, 0.6, 2.5, 4.0};
    double *try = c->data->scratch_v + 2 * kt_lanes8(c->model->n.v), *direction = c->data->moved_v, pull;
    c->driven = c->model->driven;
    c->direction = direction;
    const double speed = choose_direction(c, a, direction, &pull);
    if (!(speed > KT_SPEED_LEAST))
        return false;
    /* if time varies: at most so far that the velocity remains nearly v */
    const double most = c->driven && pull > 0.0 ? 0.1 * speed / pull : HUGE_VAL;
    for (size_t k = 0; k < sizeof wider / sizeof *wider; k++) {
        const double dt = wider[k] * fmin(NEIGHBOUR_DISTANCE / speed, most);
        const double apart = dt > most ? (double)INFINITY : interpolate(c, dt, try);
        if (apart == (double)INFINITY)
            continue;
        memcpy(a, try, c->model->n.v * sizeof *a);
        come_nearer(c, dt, apart, try, a);
        return true;
    }
    c->data->iterations.capped++;
    return false;
}

static kt_status refuse_singular(const kt_model *model, size_t link, double t, const kt_input *input, kt_error *error) {
    const kt_status status = kt_input_check(model, input, error);
    if (status != KT_OK)
        return status;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s', t = %.9g s",
                   model->text + model->body[model->link[link].body].name, t);
    return kt_error_set(
        error, KT_ERROR_SINGULAR, where,
        "the mechanism has no inertia along one of the degrees of freedom that its loops leave: give the bodies that "
        "move there mass or inertia");
}

kt_status kt_closed_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    tau = tau ? tau : model->zero;
    data->interpolated = false;
    size_t failed = kernels->forward(model, data, t, q, v, tau, external, false, data->scratch);
    if (kt_is_near_singular(model, data) && (!failed || is_singular(model, data))) {
        crossing c = {.model = model, .data = data, .t = t, .q = q, .v = v, .tau = tau, .external = external};
        failed = kernels->forward(model, data, t, q, v, tau, external, true, data->scratch);
        data->interpolated = !failed && cross(&c, data->scratch);
        if (!failed && !data->interpolated)
            failed = kernels->forward(model, data, t, q, v, tau, external, false, data->scratch);
    }
    const kt_input input = {.q = q, .v = v, .x = tau, .what = "force or torque", .external = external};
    if (failed)
        return refuse_singular(model, failed, t, &input, error);
    const kt_status status = kt_commit(model, data->scratch, a, "acceleration", error);
    if (status == KT_OK)
        return KT_OK;
    const kt_status given = kt_input_check(model, &input, error);
    return given != KT_OK ? given : status;
}
