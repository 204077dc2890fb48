/* The directions of slow slip of hard contacts, a moment later (slip.c).
 *
 * If slip is slow, e is the direction at the end of an implicit step of length tau. With s' the rate of s under these
 * forces
 *
 *     s + tau s' = sigma e,   sigma >= 0
 *
 * If slip comes to rest within tau, sigma = 0, and T is the force that stops slip: |e| < 1. At s = 0, e is the
 * direction in which slip begins. While |s| grows, tau = tau0 (1 - |s| / s0)^2 with |s| <= s0. Friction may be able to
 * hold all slow contacts, and this contact with a reserve of a part x of its force. Then slip comes to rest at a rate
 * of x a, with a the deceleration by friction alone, and tau is no more than
 *
 *     |s| / (2 x a) (1 - 10 x)^2,   x <= 1 / 10
 *
 * so that sigma is half of |s|. Next to the limit slip follows its forces for much longer than it turns. For larger x
 * it mostly comes to rest before the equations become stiff. Slip that turns around the state of rest instead is
 * brought to rest between steps (contact/directions.c). If friction cannot hold some contacts, tau of slip that grows
 * has no such limit. For example, a corner may have friction to spare while a box begins to turn about a point next to
 * it. The slip of this corner does not end.
 *
 * Across e this makes an error of the acceleration. The error is tau times the acceleration of s along e, times the
 * rate at which e turns. In total the velocity is off by tau0 s0 times this rate. Let T be the time in which the
 * mechanism moves by its own size L (contact/own_time.c). With adaptive steps and the absolute tolerance R of
 * velocities
 *
 *     tau0 = 1.2e-6 T r,   s0 = 1.2e-6 L / T r,   r = sqrt(R T / (1e-9 L)),   1 <= r <= 300
 *
 * so that a turn of 1 rad within T makes an error of R / 690. Near the point about which a foot turns, slip remains
 * slow for long, and friction turns it as fast as this permits. The rate s' is affine in the forces at all contacts
 * that slip. The iteration for the directions is in cone/coulomb.h. If no solution is found, e is the direction of s,
 * which is counted (kt_contact_counts.unconverged). Then forces jump: without sigma = 0, implicit steps found no
 * solution in such states.
 *
 * Fixed steps of explicit methods. Friction turns slip at a rate of mu N W / |s|. W is the response of slip to
 * forces across it. Steps of length h are unstable where this rate exceeds about 2 / h. A turn of the body that should
 * fade then grows until it is as fast as the slip, and the energy grows with it. With
 *
 *     tau0 = h,   s0 = h sum mu N W   over the slip of a block of W
 *
 * and x = |s| / s0, the rate is at most 1 / (h ((1 - x)^2 + x)) <= 4 / (3 h). The velocity is off by h s0 times the
 * rate at which e turns, of order h^2. Straight slip has no error. A prediction shows whether slip grows,
 * e . (s + tau s') >= |s|. If slip does not grow, tau = h would reverse friction before slip ends, and the error would
 * be of order h. At stages behind the end of slip, s . d < 0, e is on the side of d (slip.c), and |s| e replaces s.
 * Otherwise slip would grow in reverse at such a stage, and friction would jump where slip ends. With a > 0 the
 * deceleration in the present direction, the prediction is then repeated with
 *
 *     tau <= |s| / (2 a) min(1, 9 - 10 a / A)
 *
 * so that sigma is about half of |s| again. A = s0 / h is the deceleration by friction alone. Friction that
 * predicts turns slip at the rate A / (|s| + tau (A - a)) = 2 a A / (|s| (A + a)). Slip ends after the time |s| / a.
 * Therefore this rate exceeds 2 / h only within the last step; without a prediction, it does so A / a times as long.
 * The turn of a box next to its limit of rest would grow until it is as fast as the slip. Slip that friction alone
 * stops, a = A, keeps its present direction exactly. In evaluations, tau is at least the tau of adaptive steps. At
 * events under fixed steps, slip that grows keeps its present direction: at events, a prediction changed no balance of
 * pushed boxes, and walks of robots took up to 3 % more evaluations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/slip.h"
#include "kinetree/algebra.h"

#include <math.h>
#include <string.h>

/* Predictions that are repeated. */
enum { PREDICTIONS = 2 };

/* The reciprocal of the largest x. */
static const double shrinking = 10.0;

double kt_slip_time_at_speed(double speed, double tau0, double s0) {
    const double part = 1.0 - speed / s0;
    return part > 0.0 ? tau0 * part * part : 0.0;
}

/* The prediction time tau (s) of slip k: tau0 at rest, and 0 from the slip velocity s0 on. *grows: the ratio by
 * which slip changes tau (kt_slip_time_at_speed). */
static double prediction_time_of(const kt_data *data, size_t k, double tau0, double s0, double *grows) {
    const double *s = data->slip_velocity + 2 * k, *d = data->slip + 2 * k;
    *grows = 0.0;
    if (fabs(s[0]) >= s0 || fabs(s[1]) >= s0)
        return 0.0;
    const double speed = kt_hypot(s[0], s[1]), part = 1.0 - speed / s0;
    *grows = (2.0 - part) / part;
    return d[0] != 0.0 || d[1] != 0.0 ? kt_slip_time_at_speed(speed, tau0, s0) : 0.0;
}

/* Whether steps are fixed, and too long to resolve the turning of this slip without a prediction. */
static bool is_unresolved(const kt_data *data, size_t k) { return data->slip_slow[2 * k + 1] > data->slow_slip; }

/* The largest part of s0 up to which slip keeps its direction within a fixed step. Tests pass with 1e-2, too. */
static const double kept = 1e-4;

double kt_slip_still_speed(const kt_data *data, size_t k) {
    const double *s = data->slip_velocity + 2 * k, s0 = data->slip_slow[2 * k + 1];
    if (!is_unresolved(data, k) || kt_slip_is_fast(data, k))
        return data->still_slip;
    return fmax(data->still_slip, kept * kt_slip_time_at_speed(kt_hypot(s[0], s[1]), s0, s0));
}

bool kt_slip_lags(const kt_data *data, size_t k) {
    const double *s = data->slip_velocity + 2 * k, *d = data->slip + 2 * k;
    return is_unresolved(data, k) && !kt_slip_is_fast(data, k) &&
           fabs(d[0] * s[1] - d[1] * s[0]) > kt_slip_still_speed(data, k);
}

double kt_slip_prediction_time(const kt_data *data, size_t k, double *grows) {
    const double *of = data->slip_slow + 2 * k;
    const bool wide = is_unresolved(data, k);
    const double time = kt_slip_problem_of(data)->slow_time;
    return prediction_time_of(data, k, wide ? fmax(of[0], time) : time, wide ? of[1] : data->slow_slip, grows);
}

/* The prediction time tau (s) of a contact with adaptive steps. */
static double adaptive_prediction_time(const kt_data *data, size_t index) {
    double grows;
    return prediction_time_of(data, index, kt_slip_problem_of(data)->slow_time, data->slow_slip, &grows);
}

/* tau of slip that grows, for a contact of a problem. */
static double largest_prediction_time(const kt_data *data, const kt_slip_problem *p, size_t index) {
    double grows;
    return p->wide ? kt_slip_prediction_time(data, index, &grows) : adaptive_prediction_time(data, index);
}

/* Sets the present contacts, with their directions and the rates of slip without friction. The rows of normal forces
 * are multiplied by `scale`. */
static void set_items(const kt_data *data, kt_slip_problem *p, double scale) {
    kt_coulomb *c = p->c;
    c->n = (int)p->at->n;
    c->rows = 3 * c->n;
    c->stride = (int)p->stride;
    c->W = p->W_at;
    for (int i = 0; i < c->rows; i++)
        c->line[i] = i;
    for (size_t k = 0; k < p->at->n; k++) {
        const double *e = data->slip_direction + 2 * kt_slip_index(p, k);
        p->to.mode[k] = KT_COULOMB_SLIP;
        memcpy(p->to.e[k], e, sizeof p->to.e[k]);
        c->b[3 * k] = -scale * (p->N0[kt_slip_index(p, k)] / p->at->unit);
        for (size_t i = 0; i < 2; i++)
            c->b[3 * k + 1 + i] = p->rate0[2 * kt_slip_index(p, k) + i] + p->drift[2 * kt_slip_index(p, k) + i];
        c->item[k] = (kt_coulomb_item){.type = KT_COULOMB_SLIPS,
                                       .row = (int)(3 * k),
                                       .across = (int)(3 * k + 1),
                                       .friction = p->contact[kt_slip_index(p, k)].effect->friction,
                                       .e = {e[0], e[1]}};
    }
}

/* Finds by how much slip would slow down in the present directions. */
static void find_slowing(kt_slip_problem *p) {
    kt_coulomb_linear(p->c, &p->to);
    for (int k = 0; k < p->c->n; k++) {
        const double *e = p->to.e[k], *u = p->to.u + p->c->item[k].across;
        p->slowing[kt_slip_index(p, (size_t)k)] = -e[0] * u[0] - e[1] * u[1];
    }
}

/* Finds the forces that would hold all slow contacts while the slip of all other contacts does not change. Returns how
 * many are slow. */
static int hold_slow(const kt_data *data, kt_slip_problem *p) {
    int slow_ones = 0;
    for (int i = 0; i < p->c->n; i++) {
        const bool is_slow = largest_prediction_time(data, p, kt_slip_index(p, (size_t)i)) > 0.0;
        p->c->item[i].type = is_slow ? KT_COULOMB_CONE : KT_COULOMB_SLIPS;
        p->held->mode[i] = is_slow ? KT_COULOMB_STICK : p->to.mode[i];
        memcpy(p->held->e[i], p->to.e[i], sizeof p->to.e[i]);
        slow_ones += is_slow;
    }
    kt_coulomb_linear(p->c, p->held);
    return slow_ones;
}

double kt_slip_excess(const kt_coulomb_item *item, const double *p) {
    return item->friction * p[item->row] - kt_hypot(p[item->across], p[item->across + 1]);
}

/* Whether these forces are within friction of all slow contacts. */
static bool may_hold_all(const kt_slip_problem *p) {
    bool all = true;
    for (int i = 0; i < p->c->n; i++)
        all = all && (p->c->item[i].type != KT_COULOMB_CONE || kt_slip_excess(&p->c->item[i], p->held->p) > 0.0);
    return all;
}

/* tau is at most half of the time in which the friction in excess of the holding force stops the slip. This limit
 * requires that friction `holds` all slow contacts, or that this slip fades. If a contact would part at rest, no
 * friction holds it. Its slip ends with the present deceleration if it fades, and begins otherwise. */
double kt_slip_limited_time(const kt_coulomb *c, int i, const double *held, int slow_ones, const kt_slip_fate *of,
                            bool holds, bool fades) {
    const kt_coulomb_item *item = &c->item[i];
    const int x = item->across, y = x + 1;
    const bool slows = fades && of->friction < HUGE_VAL;
    const double fading = fades ? kt_slip_fading_time(of->largest, of->speed, of->slowing, of->friction) : of->largest;
    if (!(of->largest > 0.0) || !(fades || holds))
        return of->largest;
    if (!(held[item->row] > 0.0))
        return fading;
    const double response = 0.5 * slow_ones * (kt_coulomb_entry(c, x, x) + kt_coulomb_entry(c, y, y));
    const double excess = kt_slip_excess(item, held), friction = item->friction * held[item->row];
    const double part = excess > 0.0 ? fmax(0.0, 1.0 - shrinking * excess / friction) : 0.0;
    const double most = slows ? of->adaptive : of->largest;
    const double tau = excess > 0.0 ? fmin(most, 0.5 * of->speed / (response * excess) * part * part) : most;
    return slows ? fmax(tau, fading) : tau;
}

/* Slow slip of contact k of a problem. */
static kt_slip_fate fate_of_slip(const kt_data *data, const kt_slip_problem *p, int k) {
    const size_t index = kt_slip_index(p, (size_t)k);
    const double *s = data->slip_velocity + 2 * index, *of = data->slip_slow + 2 * index;
    return (kt_slip_fate){.speed = kt_hypot(s[0], s[1]),
                          .slowing = p->slowing[index],
                          .largest = largest_prediction_time(data, p, index),
                          .adaptive = adaptive_prediction_time(data, index),
                          .friction = p->wide && is_unresolved(data, index) ? of[1] / of[0] : HUGE_VAL};
}

/* The speed of slip of a contact in predictions: that of the slip whose direction e is (slip.c). */
static double size_of_slip(const kt_data *data, size_t index) {
    const double *s = data->slip_velocity + 2 * index;
    return kt_hypot(kt_hypot(s[0], s[1]), kt_slip_still_speed(data, index));
}

/* Sets the problem of the prediction, from the present directions e = s / |s|: the rates b of slow slip receive s /
 * tau, so that a solution has the rates u = s' + s / tau. *holds: friction can hold all slow contacts. */
static void predict_directions(const kt_data *data, kt_slip_problem *p, bool *holds) {
    kt_coulomb *c = p->c;
    const int slow_ones = hold_slow(data, p);
    *holds = may_hold_all(p);
    for (int k = 0; k < c->n; k++) {
        const kt_slip_fate of = fate_of_slip(data, p, k);
        const size_t index = kt_slip_index(p, (size_t)k);
        p->tau[index] = kt_slip_limited_time(c, k, p->held->p, slow_ones, &of, *holds, p->fades[index]);
    }
    for (int k = 0; k < c->n; k++) {
        const size_t index = kt_slip_index(p, (size_t)k);
        const double size = size_of_slip(data, index), tau = p->tau[index];
        p->predicted[index] = tau > 0.0;
        c->item[k].type = tau > 0.0 ? KT_COULOMB_CONE : KT_COULOMB_SLIPS;
        for (int i = 0; i < 2 && tau > 0.0; i++)
            c->b[c->item[k].across + i] += size * p->to.e[k][i] / tau;
    }
    for (int k = 0; k < c->n; k++) {
        const double *b = c->b + c->item[k].row;
        c->item[k].size = fmax(fabs(b[0]), fmax(fabs(b[1]), fabs(b[2])));
    }
}

/* Finds the directions of slow slip at the end of the implicit step, e = -T / (mu N). Slip that has come to rest at the
 * end has |e| < 1. */
static bool solve_prediction(size_t n, kt_slip_problem *p) {
    const kt_coulomb *c = p->c;
    kt_coulomb_solution *to = &p->to;
    bool found = kt_coulomb_iterate_modes(c, to);
    if (!found)
        found = kt_coulomb_solve_modes(c, kt_coulomb_solver_init(n, 3 * n, n, p->solver, p->matrices), to);
    for (int i = 0; found && i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double most = item->friction * to->p[item->row];
        const bool rests = item->type == KT_COULOMB_CONE && to->mode[i] != KT_COULOMB_SLIP;
        for (int k = 0; rests && k < 2; k++)
            to->e[i][k] = most > 0.0 ? -to->p[item->across + k] / most : 0.0;
        if (item->type == KT_COULOMB_SLIPS)
            memcpy(to->e[i], item->e, sizeof to->e[i]);
    }
    return found;
}

/* Finds slip that does not grow, e . (s + tau s') < |s|, although the prediction assumed growth. Returns whether the
 * number of such contacts has grown. The rates of the solution are u = |s| e / tau + s' (predict_directions), where e
 * is the present direction. If friction `holds` all slow contacts, tau of resolved slip was limited already. If no
 * solution was `found`, all slip that may fade counts as fading, since a smaller tau may have a solution. */
static bool find_fading(const kt_data *data, kt_slip_problem *p, bool holds, bool found) {
    bool any = false;
    for (int i = 0; i < p->c->n; i++) {
        const size_t index = kt_slip_index(p, (size_t)i);
        const double *e = data->slip_direction + 2 * index, *u = p->to.u + p->c->item[i].across;
        const bool may_fade =
            is_unresolved(data, index) ? largest_prediction_time(data, p, index) > 0.0 : p->predicted[index] && !holds;
        if (p->fades[index] || !may_fade)
            continue;
        p->fades[index] = !found || p->tau[index] * (e[0] * u[0] + e[1] * u[1]) < size_of_slip(data, index);
        any = any || p->fades[index];
    }
    return any;
}

bool kt_slip_predicts_wide(const kt_data *data, const kt_slip_problem *p) {
    bool any = false;
    for (size_t k = 0; k < p->at->n; k++) {
        const size_t index = kt_slip_index(p, k);
        any = any || (p->predicted[index] && is_unresolved(data, index));
    }
    return any;
}

/* The rows of normal forces have no unit, but those of slip are accelerations. One number bounds the residuals of all
 * rows, so the rows of normal forces are measured in the largest acceleration of slip under a unit of force. If the
 * unit moves no slip except by rounding, as at an arm that points along its slip, they are measured in the largest
 * acceleration without friction. A power of two leaves the bits of W. */
static double scale_of_normals(const kt_slip_problem *p) {
    static const double rounding = 1e-11;
    const size_t rows = 3 * p->at->n;
    double most = 0.0, steady = 0.0;
    for (size_t i = 0; i < rows; i++) {
        const size_t slip = 2 * kt_slip_index(p, i / 3) + i % 3 - 1;
        most = i % 3 == 0 ? most : fmax(most, p->W_at[i * p->stride + i]);
        steady = i % 3 == 0 ? steady : fmax(steady, fabs(p->rate0[slip] + p->drift[slip]));
    }
    most = most > rounding * steady ? most : steady;
    return most > 0.0 && isfinite(most) ? exp2(floor(log2(most))) : 1.0;
}

/* Multiplies the normal rows of W by a factor. */
static void scale_normals(kt_slip_problem *p, double by) {
    const size_t rows = 3 * p->at->n;
    for (size_t i = 0; i < rows; i += 3)
        for (size_t j = 0; j < rows; j++)
            p->W_at[i * p->stride + j] *= by;
}

int kt_slip_list_blocks(const kt_data *data, kt_slip_problem *p) {
    const double scale = scale_of_normals(p);
    scale_normals(p, scale);
    set_items(data, p, scale);
    const int blocks = kt_coulomb_list_blocks(p->c, p->coupled, p->end);
    scale_normals(p, 1.0 / scale);
    return blocks;
}

bool kt_slip_predict(const kt_data *data, kt_slip_problem *p, bool wide) {
    const double scale = scale_of_normals(p);
    bool holds = false, found = false;
    p->wide = wide;
    scale_normals(p, scale);
    for (size_t k = 0; k < p->at->n; k++)
        p->fades[kt_slip_index(p, k)] = !wide && is_unresolved(data, kt_slip_index(p, k));
    for (int i = 0; i == 0 || (i <= PREDICTIONS && find_fading(data, p, holds, found)); i++) {
        set_items(data, p, scale);
        if (i == 1 || (i == 0 && !wide))
            find_slowing(p);
        predict_directions(data, p, &holds);
        found = solve_prediction(p->at->n, p);
    }
    scale_normals(p, 1.0 / scale);
    return found;
}
