/* Static equilibrium: a position where the mechanism stays at rest.
 *
 * In the directions E that the loops allow (independent_coordinates.c: free velocities, so that rolling wheels roll) the force is
 * g = E' M a, and its change along E y is -H y, H = -E' d(M a)/dy. With V the potential energy, where
 * there is one, g is -dV/dy and H its second derivative. A step solves
 *     (H + mu D) y = g,   D the diagonal of E' M E
 * which is the way of D y' = g, overdamped motion, taken implicitly in steps of 1 / mu (pseudo-transient
 * continuation: C. T. Kelley & D. E. Keyes, SIAM Journal on Numerical Analysis 35, 1998, 508-523). With mu large enough
 * for H + mu D to be positive definite it leads downhill and past saddles; at a stable equilibrium mu = 0 is enough,
 * and that is Newton's method. A step counts where the mean of the forces at both its ends does work along it. D is
 * diagonal, so that freedoms without force or stiffness stay where they are.
 *
 * The same with mu = 0 for any H, and steps counting where |a| falls, finds the equilibria nearby, whatever their kind.
 */
#include "analysis/analysis.h"
#include "dynamics/dynamics.h"
#include "reduction/lapack.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { STEPS_MOST = 300, SHORTER_MOST = 40 };

#define REACH 0.3     /* first limit of a step, in units */
#define TURN_MOST 1.0 /* an angle never moves farther in one step, rad */
#define RUNAWAY 1e9   /* in units: who has come so far does not come back; */
#define FAR 50.0      /* and who has come so far without finding anything seems to go on */
#define NEUTRAL 1e-10 /* of the largest stiffness: what is added where there is none */
#define CLOSE 1e-6    /* steps so short are Newton's own, */
#define ROUNDING (4.0 * DBL_EPSILON)
#define THERE 1e-9 /* and these end the search where nothing gets better any more */

kt_equilibrium_options kt_equilibrium_options_default(void) {
    const kt_equilibrium_options options = {0};
    return options;
}

/* A search under way; q0, a0 of the linearisation are where it is. */
typedef struct search {
    kt_linearization *l;
    kt_system_arrays *out;
    bool nearest;
    int dofs;
    double reach;    /* limit of a step */
    double rounding; /* of forces times units, J */
} search;

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

static double dot(const double *a, const double *b, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* E' f */
static void reduce_force(const search *s, const double *f, double *force) {
    for (int j = 0; j < s->dofs; j++)
        force[j] = dot(s->l->free_velocity + (size_t)j * s->l->size.v, f, s->l->size.v);
}

/* E' M a at q, by way of scratch. */
static kt_status force_at(const search *s, const double *q, const double *a, double *scratch, double *force,
                          kt_error *error) {
    memcpy(scratch, a, s->l->size.v * sizeof *a);
    const kt_status status = kt_probe_force(s->l, q, scratch, error);
    reduce_force(s, scratch, force);
    return status;
}

/* D, the diagonal of E' M E at q0. */
static kt_status fill_inertia(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    for (size_t j = 0; j < (size_t)s->dofs; j++) {
        const double *e = l->free_velocity + j * nv;
        memcpy(l->ahead, e, nv * sizeof *e);
        const kt_status status = kt_probe_force(l, l->q0, l->ahead, error);
        if (status != KT_OK)
            return status;
        l->inertia[j] = dot(e, l->ahead, nv);
    }
    return KT_OK;
}

/* g at q0, and what its numbers are rounded in proportion to. */
static kt_status fill_force(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    double most = 0.0;
    const kt_status status = force_at(s, l->q0, l->a0, l->ahead, l->force, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < nv; i++)
        most = fmax(most, fmax(fabs(l->ahead[i]), fabs(l->weight[i])) * l->unit[i]);
    for (size_t i = 0; i < nv; i++)
        l->floor[2 * nv + i] = most / l->unit[i];
    return KT_OK;
}

/* d(M a)/dy along the directions E. */
static kt_status differentiate_force(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    kt_status status = kt_exact_is_possible(l) ? kt_exact_slopes(l, (size_t)s->dofs, l->free_velocity, NULL, error)
                                               : KT_ERROR_SINGULAR;
    if (status != KT_ERROR_SINGULAR)
        return status;
    status = KT_OK;
    for (size_t j = 0; j < (size_t)s->dofs && status == KT_OK; j++)
        status = kt_linearization_differentiate(l, l->free_velocity + j * l->size.v, NULL, 1.0, j, error);
    return status;
}

/* H at q0; numbers below their estimated error are zero. */
static kt_status fill_stiffness(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v, n = (size_t)s->dofs;
    const kt_status status = differentiate_force(s, error);
    if (status != KT_OK)
        return status;
    for (size_t j = 0; j < n; j++) {
        const double *slope = l->slope + j * l->size.f + 2 * nv, *slope_error = l->slope_error + j * l->size.f + 2 * nv;
        for (size_t i = 0; i < nv; i++)
            l->step[i] = fabs(slope[i]) > slope_error[i] ? -slope[i] : 0.0;
        reduce_force(s, l->step, l->stiffness + j * n);
    }
    return KT_OK;
}

/* The stiffest freedom for its mass: a bound for eigenvalues of D^-1 H but for a small factor. */
static double stiffest(const search *s) {
    const size_t n = (size_t)s->dofs;
    double most = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            most = fmax(most, fabs(s->l->stiffness[j * n + i]) / sqrt(s->l->inertia[i] * s->l->inertia[j]));
    return most;
}

/* factor <- H + mu D, or its symmetric part */
static void add_up(const search *s, double mu, bool symmetric) {
    const size_t n = (size_t)s->dofs;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double h = s->l->stiffness[j * n + i];
            s->l->factor[j * n + i] =
                (symmetric ? 0.5 * (h + s->l->stiffness[i * n + j]) : h) + (i == j ? mu * s->l->inertia[i] : 0.0);
        }
}

/* What forces are rounded to, from weights and the forces of the stiffest freedom moved by a unit. */
static void expect_rounding(search *s) {
    kt_linearization *l = s->l;
    double most = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        most = fmax(most, l->floor[2 * l->size.v + i] * l->unit[i]);
    for (size_t j = 0; j < (size_t)s->dofs; j++) {
        const double unit = l->unit[s->out->velocity_coordinate[j]];
        most = fmax(most, fabs(l->stiffness[j * (size_t)s->dofs + j]) * unit * unit);
    }
    s->rounding = ROUNDING * most;
}

/* Forces below their rounding are zero, so that no step follows from them where nothing resists; returns whether any
 * are left. */
static bool clear_rounding(const search *s) {
    bool any = false;
    for (int j = 0; j < s->dofs; j++) {
        const bool zero = fabs(s->l->force[j]) * s->l->unit[s->out->velocity_coordinate[j]] <= s->rounding;
        s->l->force[j] = zero ? 0.0 : s->l->force[j];
        any |= !zero;
    }
    return any;
}

/* The step, into l->step; false where there is none. */
static bool solve(const search *s, double stiff) {
    kt_linearization *l = s->l;
    double mu = NEUTRAL * (stiff > 0.0 ? stiff : 1.0);
    for (int i = 0; i < 60 && !s->nearest; i++) {
        add_up(s, mu, true);
        if (kt_lapack_potrf(s->dofs, l->factor) == 0)
            break;
        mu = fmax(2.0 * mu, 1e-3 * stiff);
    }
    add_up(s, mu, false);
    memcpy(l->step, l->force, (size_t)s->dofs * sizeof *l->step);
    return kt_lapack_gesv(s->dofs, l->factor, l->pivot, l->step) == 0;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static double size_of(const kt_linearization *l, const double *x) {
    double most = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        most = fmax(most, fabs(x[i]) / l->unit[i]);
    return most;
}

static double sum_of_squares(const kt_linearization *l, const double *x) {
    double sum = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        sum += x[i] / l->unit[i] * (x[i] / l->unit[i]);
    return sum;
}

/* All coordinates' step E y, shortened to what is allowed, into l->direction; returns its length in units. */
static double spread(const search *s) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    double part = 1.0;
    memset(l->direction, 0, nv * sizeof *l->direction);
    for (size_t j = 0; j < (size_t)s->dofs; j++)
        for (size_t i = 0; i < nv; i++)
            l->direction[i] += l->free_velocity[j * nv + i] * l->step[j];
    const double length = size_of(l, l->direction);
    for (size_t k = 1; k < l->model->n.link; k++) {
        const kt_link *link = &l->model->link[k];
        for (int i = 0; i < kt_link_dofs(link); i++) {
            const double most = i < kt_link_lengths(link) ? s->reach * l->unit[link->v + i] : fmin(s->reach, TURN_MOST);
            part = fmin(part, most / fmax(fabs(l->direction[link->v + i]), most));
        }
    }
    for (size_t i = 0; i < nv; i++)
        l->direction[i] *= part;
    return part * length;
}

/* Goes `part` of the way: tried_q, tried_a. */
static kt_status try_step(const search *s, double part, kt_error *error) {
    kt_linearization *l = s->l;
    for (size_t i = 0; i < l->size.v; i++) {
        l->ahead[i] = part * l->direction[i];
        l->v[i] = 0.0;
    }
    kt_position_add(l->model, l->q0, l->ahead, l->tried_q);
    kt_status status = kt_state_project(l->model, l->data, l->t, l->tried_q, l->v, NULL, error);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(l->model, l->data, l->t, l->tried_q, l->v0, l->tau, NULL, l->tried_a, error);
    return status;
}

/* Whether what was tried is nearer to rest. */
static bool is_better(const search *s, double length) {
    kt_linearization *l = s->l;
    if (s->nearest || length < CLOSE)
        return sum_of_squares(l, l->tried_a) < sum_of_squares(l, l->a0);
    if (force_at(s, l->tried_q, l->tried_a, l->ahead, l->behind, NULL) != KT_OK)
        return false;
    const double work = dot(l->force, l->step, (size_t)s->dofs) + dot(l->behind, l->step, (size_t)s->dofs);
    return work > 0.0;
}

/* One step of the search, its length in *length; 0 where nothing is better than where it is. */
static kt_status step(search *s, double *length, kt_error *error) {
    kt_linearization *l = s->l;
    const double whole = spread(s);
    kt_status status = KT_OK;
    *length = 0.0;
    for (int i = 0; i < SHORTER_MOST; i++) {
        const double part = ldexp(1.0, -i);
        status = try_step(s, part, error);
        if (status == KT_OK && is_better(s, part * whole)) {
            *length = part * whole;
            s->reach = i ? fmax(part * s->reach, REACH) : 2.0 * s->reach;
            memcpy(l->q0, l->tried_q, l->size.q * sizeof *l->q0);
            memcpy(l->a0, l->tried_a, l->size.v * sizeof *l->a0);
            return KT_OK;
        }
        if (part * whole < DBL_EPSILON)
            break;
    }
    return KT_OK;
}

/* ---- the search -------------------------------------------------------------------------------------------------- */

/* A loop that moves by itself at t does not let the mechanism rest. */
static kt_status refuse_driven(const kt_linearization *l, kt_error *error) {
    for (size_t i = 0; i < l->model->n.loop; i++) {
        const kt_loop_record *loop = &l->model->loop[i];
        double f[3] = {0.0, 0.0, 0.0};
        if (loop->curve.type != KT_FUNCTION_NONE)
            kt_curve_evaluate(&loop->curve, l->model->number, l->t, f);
        if (f[1] != 0.0 || f[2] != 0.0) {
            char where[KT_WHERE_SIZE];
            (void)snprintf(where, sizeof where, "loop '%s'", l->model->text + loop->name);
            return kt_error_set(error, KT_ERROR_CONSTRAINT, where,
                                "it is driven: at t = %g s it moves the mechanism, which so cannot be at rest; take a "
                                "time when it stands still, or a constant",
                                l->t);
        }
    }
    return KT_OK;
}

/* Whether the k-th freedom of a link is a length. */
static bool is_length(const kt_link *link, int k) { return k < kt_link_lengths(link); }

/* The joint whose acceleration is largest against its unit; that acceleration, and what it is in. */
static const char *joint_of(const kt_linearization *l, const double *x, double *acceleration, const char **unit) {
    const char *name = "";
    double most = 0.0;
    *acceleration = 0.0;
    *unit = "rad/s^2";
    for (size_t i = 1; i < l->model->n.link; i++) {
        const kt_link *link = &l->model->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++)
            if (fabs(x[link->v + k]) / l->unit[link->v + k] >= most) {
                most = fabs(x[link->v + k]) / l->unit[link->v + k];
                *acceleration = fabs(x[link->v + k]);
                *unit = is_length(link, k) ? "m/s^2" : "rad/s^2";
                name = l->model->text + l->model->body[link->body].name;
            }
    }
    return name;
}

static kt_status give_up(const search *s, int steps, bool gone, kt_error *error) {
    double acceleration;
    const char *unit, *name = joint_of(s->l, s->l->a0, &acceleration, &unit);
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.120s'", name);
    return kt_error_set(error, KT_ERROR_STEP, where,
                        gone ? "no equilibrium: this joint accelerates without bound, and nothing holds it (still "
                               "accelerating by %.3g %s after %d steps)"
                             : "no equilibrium was found: this joint still accelerates by %.3g %s after %d steps; try "
                               "another start",
                        acceleration, unit, steps);
}

/* From q0 to an equilibrium, or words. */
static kt_status run(search *s, int most, kt_equilibrium *found, kt_error *error) {
    kt_linearization *l = s->l;
    kt_linear_system system = {0};
    double length = HUGE_VAL, path = 0.0;
    for (found->steps = 0; found->steps < most && path < RUNAWAY; found->steps++) {
        found->distance = length < HUGE_VAL ? length : 0.0;
        found->acceleration = size_of(l, l->a0);
        if (found->acceleration == 0.0)
            return KT_OK;
        kt_status status = kt_independent_coordinates_choose(l, s->out, &system, error);
        s->dofs = system.velocities;
        kt_probe_floor(l);
        if (status == KT_OK)
            status = fill_inertia(s, error);
        if (status == KT_OK)
            status = fill_force(s, error);
        if (status == KT_OK)
            status = fill_stiffness(s, error);
        if (status != KT_OK)
            return status;
        expect_rounding(s);
        if (!clear_rounding(s))
            return KT_OK;
        if (!solve(s, stiffest(s)))
            break;
        const double before = length, wanted = spread(s);
        status = step(s, &length, error);
        if (status != KT_OK)
            return status;
        path += length;
        if (length == 0.0 && (wanted < THERE || before < THERE)) /* rounding rules */
            return KT_OK;
        if (length == 0.0)
            break;
    }
    return give_up(s, found->steps, path >= FAR, error);
}

kt_status kt_equilibrium_find(kt_linearization *l, const kt_equilibrium_options *options, double t, double *q,
                              const double *tau, kt_equilibrium *found, kt_error *error) {
    const kt_equilibrium_options settings = options ? *options : kt_equilibrium_options_default();
    search s = {.l = l, .out = &l->arrays[l->next], .nearest = settings.nearest, .reach = REACH};
    kt_linear_system system = {0};
    kt_equilibrium result = {0};
    kt_status status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    status = kt_linearization_begin(l, t, q, l->model->zero, tau, &system, error);
    if (status == KT_OK)
        status = refuse_driven(l, error);
    memcpy(l->v0, l->model->zero, l->size.v * sizeof *l->v0);
    l->of_force = true;
    if (status == KT_OK)
        status = run(&s, settings.most > 0 ? settings.most : STEPS_MOST, &result, error);
    l->of_force = false;
    if (status != KT_OK)
        return status;
    memcpy(q, l->q0, l->size.q * sizeof *q);
    if (found)
        *found = result;
    return KT_OK;
}
