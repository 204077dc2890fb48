/* Contacts and stops that a step has not seen.
 *
 * A method evaluates forces at its stages only. An effect that acts on one side of a boundary (a contact, a stop) may
 * begin and end to act between two stages. Such a force happens if steps have grown during quiet motion. After a step,
 * this file therefore follows the distance d of each such effect from its boundary. The search uses the dense output
 * from t0 to t1 = t0 + h. Let u be the relative velocity, with d' = u_z, and w = max |u|. Let r be the rate at which
 * the two bodies turn relative to each other. Nothing happens if
 *
 *     d0 + d1 >= 4 w h                        the speeds cannot reach the boundary; or
 *     min(d0, d1) >= h (|u1 - u0| + r h w)    the path is straight within its distance; not if d0 + d1 < w h / 16
 *
 * If neither holds, the interval is halved. The cubic through d and d' at its ends lies above the least of its
 * Bernstein coefficients d0, d0 + h d0' / 3, d1 - h d1' / 3, d1. The error of the cubic is about the difference from d
 * and d' of the dense output in the middle. If the least coefficient of a half exceeds twice that error, the half needs
 * no evaluation. Otherwise the half is halved again. While the bodies turn by more than a radian, every half is halved
 * again.
 *
 * If stages of the method meet the effect, the error of its dense output (dop853) can be metres. Therefore, from sample
 * to sample, w is at least |d1 - d0| / h. If the effect acts at an end of the step, the boundary lies at twice the
 * depth at that end. The stages next to that end have seen this depth. The depth of rounding does not count. For some
 * effects d is a coordinate: for a stop, and for the centre of a free body above a plane on the ground. Rotations do
 * not move that centre. Then u is d' and r is 0.
 *
 * Nearly all steps are far from nearly all boundaries. Therefore distances and bounds of the speeds are computed first
 * (clearance.c). The conditions above are tested only for effects that violate the following condition. Records are
 * checked only if an effect violates this condition.
 *     min(d0, d1) >= 2 w h
 *
 * A step that went deeper in between is undone, and repeated up to the crossing. The last stage of the
 * repeated step sees the effect, and the error control does the rest.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation/gap.h"
#include "base/where.h"
#include "integrator/integrator.h"

#include <math.h>

/* The most halvings of a step, and the most evaluations within a step for one effect. If a path remains at a boundary
 * for long, no number of halvings decides. The remaining uncertainty is a contact of 1 / 4096 of the step. */
enum { HALVINGS = 12, EVALUATIONS = 64 };

/* Depths below these parts of the path w h do not count: rounding in a step, the error of the state in a record. */
static const double depth_of_rounding = 1e-9, depth_of_record = 1e-4;

/* min(a, b); fmin of <math.h> is a call. */
static double smaller_double(double a, double b) { return a < b ? a : b; }

typedef struct sample {
    double t, d, rate; /* d: beyond the boundary of the search */
    kt_vec3 u;
} sample;

/* The larger depth of an effect at the ends of the step, from its distances at the ends; 0 if the effect acts at
 * neither end. */
static double deepest(double begin, double end) { return kt_larger(0.0, -smaller_double(begin, end)); }

/* The depth that counts as an unseen action, from the depth that the step has seen and a negligible depth. */
static double boundary_of(double seen, double negligible) { return 2.0 * seen + negligible; }

/* The larger of the speeds at both ends, squared. */
static double speed_squared(const kt_gap *begin, const kt_gap *end) {
    return kt_larger(kt_vec3_dot(begin->velocity, begin->velocity), kt_vec3_dot(end->velocity, end->velocity));
}

/* The search for the instant at which effect k begins to act within a step. */
typedef struct search {
    kt_simulation *simulation;
    size_t k;
    double boundary; /* added to distances: the depth that counts as an unseen action (boundary_of) */
    double turn;     /* r */
    int evaluations; /* that are left */
    double when;     /* the first time found at which d < 0 */
} search;

static sample sample_of(const search *s, double t, const kt_gap *gap) {
    return (sample){.t = t, .d = gap->distance + s->boundary, .rate = gap->rate, .u = gap->velocity};
}

/* Whether the effect cannot begin to act between the distances d0 and d1, with velocities u0 and u1, on a path of
 * length w h. */
static bool is_out_of_reach(double d0, double d1, kt_vec3 u0, kt_vec3 u1, double turn, double path, double h) {
    if (d0 + d1 >= 4.0 * path)
        return true;
    const double deviation = h * (kt_vec3_norm(kt_vec3_sub(u1, u0)) + turn * path);
    return smaller_double(d0, d1) >= deviation && d0 + d1 >= path / 16.0;
}

/* The least Bernstein coefficient of the cubic from a to b. */
static double least_coefficient(const sample *a, const sample *b) {
    const double third = (b->t - a->t) / 3.0;
    return fmin(fmin(a->d, b->d), fmin(a->d + third * a->rate, b->d - third * b->rate));
}

/* A bound of the error of the cubic from a to b, from the differences in d and d' in the middle, m. The bound does not
 * hold for bodies that have turned far: then the result is HUGE_VAL. */
static double error_of_cubic(const search *s, const sample *a, const sample *m, const sample *b) {
    const double h = b->t - a->t, d = 0.5 * (a->d + b->d) + 0.125 * h * (a->rate - b->rate);
    const double rate = 1.5 * (b->d - a->d) / h - 0.25 * (a->rate + b->rate);
    return s->turn * h > 1.0 ? HUGE_VAL : 2.0 * fabs(m->d - d) + 0.5 * h * fabs(m->rate - rate);
}

/* The gaps in the state y, written to `gaps`. */
static void gaps_in(kt_simulation *simulation, const double *y, kt_gap *gaps) {
    kt_gaps_evaluate(simulation->model, simulation->data, simulation->gaps->source, simulation->size.gap, y,
                     y + simulation->size.nq, false, gaps);
}

/* The gaps at a time within the step, written to `gaps`. Returns false if the dense output is not available. */
static bool evaluate_gaps(kt_simulation *simulation, double t, kt_gap *gaps) {
    kt_error ignored;
    if (kt_integrator_interpolate(simulation->integrator, t, simulation->y, &ignored) != KT_OK)
        return false;
    simulation->cached = KT_CACHED_NOTHING;
    gaps_in(simulation, simulation->y, gaps);
    return true;
}

/* Whether d < 0 somewhere from a to b. middle: the gaps in the middle, or NULL to compute them. */
static bool goes_deeper(search *s, sample a, sample b, const kt_gap *middle, int halvings) {
    kt_simulation *simulation = s->simulation;
    const double h = b.t - a.t, t = a.t + 0.5 * h;
    const double speed = sqrt(kt_larger(kt_vec3_dot(a.u, a.u), kt_vec3_dot(b.u, b.u)));
    const double path = kt_larger(h * speed, fabs(b.d - a.d));
    if (halvings == 0 || s->evaluations == 0 || is_out_of_reach(a.d, b.d, a.u, b.u, s->turn, path, h))
        return false;
    if (middle == NULL) {
        s->evaluations--;
        if (!evaluate_gaps(simulation, t, simulation->gaps->inside))
            return false; /* dense output needs the slope at the end, which the next step evaluates and reports */
        middle = simulation->gaps->inside;
    }
    const sample m = sample_of(s, t, &middle[s->k]);
    if (m.d < 0.0) {
        s->when = t;
        return true;
    }
    const double off = error_of_cubic(s, &a, &m, &b);
    return (least_coefficient(&a, &m) < off && goes_deeper(s, a, m, NULL, halvings - 1)) ||
           (least_coefficient(&m, &b) < off && goes_deeper(s, m, b, NULL, halvings - 1));
}

/* ---- methods that do not see the end of a step ------------------------------------------------------------------- */

/* If a method has no stage at the end of a step (rkc4), the step misses forces that begin or end after the last stage,
 * and the next step begins with these forces. Therefore a step of such a method ends at the boundary that it crosses,
 * to within this part of the path w h. */
static const double crossing_part = 1e-6;

bool kt_simulation_has_end_stage(const kt_method *method) {
    for (int i = 0; i < method->stages; i++)
        if (method->c[i] == 1.0)
            return true;
    return method->fsal;
}

/* Whether the effect acts just after the sample. */
static bool acts_after(const sample *a, double tolerance) {
    return a->d < -tolerance || (a->d < tolerance && a->rate < 0.0);
}

/* Whether the step crosses the boundary before its end; *when: the time, by bisection along the dense output. */
static bool crosses(search s, const kt_gap *begin, const kt_gap *end, double t0, double t1, double *when) {
    s.boundary = 0.0;
    sample a = sample_of(&s, t0, begin), b = sample_of(&s, t1, end);
    const double close = crossing_part * (t1 - t0) * fmax(kt_vec3_norm(a.u), kt_vec3_norm(b.u));
    const bool acts = acts_after(&a, 10.0 * close);
    if (acts == (b.d < 0.0) || fabs(b.d) <= close)
        return false;
    for (; s.evaluations > 0 && (acts == (b.d < 0.0) || fabs(b.d) > close); s.evaluations--) {
        const double t = a.t + 0.5 * (b.t - a.t);
        if (!evaluate_gaps(s.simulation, t, s.simulation->gaps->inside))
            return false;
        const sample m = sample_of(&s, t, &s.simulation->gaps->inside[s.k]);
        *((m.d < 0.0) == acts ? &a : &b) = m;
    }
    *when = b.t;
    return true;
}

/* ---- after a step ------------------------------------------------------------------------------------------------ */

/* Whether the last evaluation gave the slope of the present state, and therefore left the motion of links in data. */
static bool is_swept(const kt_simulation *simulation, const double *slope) {
    return simulation->cached == KT_CACHED_EVALUATION && simulation->slope == slope;
}

/* Makes the end of a step the beginning of the next one. known: gaps->begin has the gaps at this end. They are those of
 * effects that the step may have reached. far: the time of the end, or NaN if the step may have reached a boundary. */
static void pass_gaps(kt_simulation *simulation, bool known, double far) {
    kt_simulation_pass_clearances(simulation);
    simulation->gaps->time = simulation->integrator->memory.t;
    simulation->gaps->known = known;
    simulation->gaps->far_time = far;
}

/* Makes the list of effects anew, since parameters may have changed. */
static void begin_gaps(kt_simulation *simulation) {
    const double *slope = kt_integrator_known_derivative(simulation->integrator);
    (void)kt_gap_list(simulation->model, simulation->gaps->source);
    kt_simulation_begin_clearances(simulation, is_swept(simulation, slope));
    simulation->cached = KT_CACHED_NOTHING;
    pass_gaps(simulation, false, (double)NAN);
}

/* Whether the last step may have reached a boundary. If its last evaluation was at its end and no loops are closed,
 * only the scaling of quaternions followed, which changes gaps by rounding. */
static bool reaches_any(kt_simulation *simulation) {
    const kt_integrator *it = simulation->integrator;
    const double *slope = it->gives_end_derivative ? it->k[it->fresh] : kt_integrator_known_derivative(it);
    return kt_simulation_measure_clearances(simulation, is_swept(simulation, slope),
                                            it->memory.t - it->memory.previous_t);
}

/* Computes the gap of effect k in the state y. swept: as in kt_gaps_evaluate. */
static void find_effect_gap(kt_simulation *simulation, size_t k, const double *y, bool *swept, kt_known_gap *gap) {
    kt_gaps_evaluate(simulation->model, simulation->data, &simulation->gaps->source[k], 1, y, y + simulation->size.nq,
                     *swept, &gap->gap);
    *swept = *swept || simulation->gaps->source[k].link == NULL;
    gap->known = true;
}

/* The gaps of the effects that the step may have reached, at both ends of the step. Gaps at the end are computed for
 * these effects only. */
static bool find_gaps(kt_simulation *simulation) {
    const double *y0 = simulation->integrator->previous_y, *y1 = simulation->integrator->y;
    const double h = simulation->integrator->memory.t - simulation->integrator->memory.previous_t;
    bool any = false, swept = false, swept_end = true;
    for (size_t k = 0; k < simulation->size.gap; k++) {
        simulation->gaps->end[k].known = kt_simulation_reaches_gap(simulation, k, h);
        if (!simulation->gaps->end[k].known)
            continue;
        find_effect_gap(simulation, k, y1, &swept_end, &simulation->gaps->end[k]);
        simulation->gaps->begin[k].known = simulation->gaps->begin[k].known && simulation->gaps->known;
        any = true;
    }
    for (size_t k = 0; any && k < simulation->size.gap; k++)
        if (simulation->gaps->end[k].known && !simulation->gaps->begin[k].known) {
            find_effect_gap(simulation, k, y0, &swept, &simulation->gaps->begin[k]);
            simulation->cached = KT_CACHED_NOTHING;
        }
    return any;
}

/* Follows effect k through the last step. *evaluated: whether the gaps in the middle of the step are available. Returns
 * whether the step leapt over the effect; *when: a time at which the effect acts. */
static bool leaps_over(kt_simulation *simulation, size_t k, bool *evaluated, double *when) {
    const kt_gap *begin = &simulation->gaps->begin[k].gap, *end = &simulation->gaps->end[k].gap;
    const double t0 = simulation->integrator->memory.previous_t, t1 = simulation->integrator->memory.t, h = t1 - t0;
    const double seen = deepest(begin->distance, end->distance), path = h * sqrt(speed_squared(begin, end));
    const double boundary = boundary_of(seen, depth_of_rounding * path), turn = kt_larger(begin->turn, end->turn);
    const bool far = is_out_of_reach(begin->distance + boundary, end->distance + boundary, begin->velocity,
                                     end->velocity, turn, path, h);
    if (far && !simulation->lacks_end_stage)
        return false;
    search s = {simulation, k, boundary, turn, EVALUATIONS, t1};
    bool found = simulation->lacks_end_stage && crosses(s, begin, end, t0, t1, when);
    if (!found && !far) {
        *evaluated = *evaluated || evaluate_gaps(simulation, t0 + 0.5 * h, simulation->gaps->middle);
        found = *evaluated &&
                goes_deeper(&s, sample_of(&s, t0, begin), sample_of(&s, t1, end), simulation->gaps->middle, HALVINGS);
        *when = s.when;
    }
    return found;
}

/* Whether the last step leapt over an effect that it may have reached. */
static bool leaps(kt_simulation *simulation, double *when) {
    bool evaluated = false;
    const bool any = find_gaps(simulation);
    for (size_t k = 0; any && k < simulation->size.gap; k++)
        if (simulation->gaps->end[k].known && leaps_over(simulation, k, &evaluated, when))
            return true;
    return false;
}

#define KT_BY_ITSELF __attribute__((noinline)) /* most steps skip this call and would save its registers */

/* Checks a step that may have reached a boundary. Returns the verdict; if the step is undone, *t_limit is the end of
 * the next try. */
static KT_BY_ITSELF kt_verdict reject_near_leap(kt_simulation *simulation, double *t_limit) {
    kt_integrator *integrator = simulation->integrator;
    double when;
    if (leaps(simulation, &when)) {
        const double t0 = kt_integrator_previous_time(integrator);
        if (when - t0 > kt_time_step(when)) {
            *t_limit = when;
            kt_integrator_retreat(integrator, when - t0);
            return KT_VERDICT_REPEAT;
        }
    }
    kt_known_gap *gaps = simulation->gaps->begin;
    simulation->gaps->begin = simulation->gaps->end;
    simulation->gaps->end = gaps;
    pass_gaps(simulation, true, (double)NAN);
    return KT_VERDICT_ACCEPT;
}

/* The hook of the phase `check`. Distances and speeds exclude a leap for most steps; only the others compute gaps. */
static kt_status reject_leap(kt_simulation *simulation, kt_step_progress *progress, kt_verdict *verdict,
                             kt_error *error) {
    (void)error;
    if (reaches_any(simulation))
        *verdict = reject_near_leap(simulation, &progress->t_limit);
    else
        pass_gaps(simulation, false, simulation->integrator->memory.t);
    return KT_OK;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a hook of the phase `prepare` */
static void prepare_gaps(kt_simulation *simulation, kt_step_progress *progress) {
    (void)progress;
    if (simulation->gaps->time != simulation->integrator->memory.t)
        begin_gaps(simulation);
}

static bool may_leap(const kt_simulation *simulation) { return simulation->size.gap > 0 && !(simulation->step > 0.0); }

/* Adaptive steps do not leap over contacts and stops. */
const kt_part kt_leap_part = {.is_active = may_leap, .prepare = prepare_gaps, .check = reject_leap};

/* ---- of a record ------------------------------------------------------------------------------------------------- */

static kt_status reject_gap(const kt_simulation *simulation, size_t k, double t, double depth, kt_error *error) {
    const kt_effect_record *effect = simulation->gaps->source[k].effect;
    const char *type = kt_effect_type_name((kt_effect_type)effect->type);
    const kt_where_text name =
        effect->name ? kt_where_format("effect '%.40s' (%s)", simulation->model->text + effect->name, type)
                     : kt_where_format("effects[%d] (%s)", (int)effect->source, type);
    return kt_error_set(error, KT_ERROR_STEP, name.text,
                        "it acts at t = %.9g s, %.3g %s beyond its boundary, but no stage of the step from %.9g to "
                        "%.9g s has detected it; take %s",
                        t, depth, effect->ends > 0 ? "m" : "rad or m",
                        kt_integrator_previous_time(simulation->integrator), kt_integrator_time(simulation->integrator),
                        simulation->step > 0.0 ? "a smaller step" : "a smaller max_step, or a smaller tolerance");
}

/* Rejects a record at t, with its state in y, if an effect on one side of a boundary acts at t, but at neither end of
 * the step. */
static kt_status check_gaps_at(kt_simulation *simulation, double t, kt_error *error) {
    kt_gap *begin = simulation->gaps->inside, *end = simulation->gaps->middle, *now = simulation->gaps->recorded;
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator);
    const bool far = simulation->gaps->far_time == t1 && simulation->gaps->time == t1;
    if (!(t0 < t && t < t1) || far)
        return KT_OK;
    simulation->cached = KT_CACHED_NOTHING; /* the evaluations below overwrite the data */
    gaps_in(simulation, simulation->y, now);
    bool acts = false;
    for (size_t k = 0; k < simulation->size.gap; k++)
        acts = acts || now[k].distance < 0.0;
    if (!acts)
        return KT_OK;
    gaps_in(simulation, kt_integrator_previous_state(simulation->integrator), begin);
    gaps_in(simulation, simulation->integrator->y, end);
    for (size_t k = 0; k < simulation->size.gap; k++) {
        const double path = (t1 - t0) * sqrt(speed_squared(&begin[k], &end[k]));
        if (now[k].distance + boundary_of(deepest(begin[k].distance, end[k].distance), depth_of_record * path) < 0.0)
            return reject_gap(simulation, k, t, -now[k].distance, error);
    }
    return KT_OK;
}

/* ---- the part of a simulation ------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out_gaps, kt_gaps, KT_GAP_FIELDS, size_t n)

static size_t measure_gaps(const kt_simulation_sizes *size) {
    return size->gap > 0 ? lay_out_gaps(NULL, size->gap) : 0;
}

static void init_gaps(kt_simulation *simulation, void *memory) {
    (void)lay_out_gaps(memory, simulation->size.gap);
    simulation->gaps = memory;
}

static bool has_gaps(const kt_simulation *simulation) { return simulation->size.gap > 0; }

static void forget_gaps(kt_simulation *simulation) { simulation->gaps->time = (double)NAN; }

static void rebind_gaps(kt_simulation *simulation) {
    (void)kt_gap_list(simulation->model, simulation->gaps->source);
    forget_gaps(simulation);
}

/* If parameters have changed, the stored distances are not valid. */
static void renew_gaps(const kt_simulation *simulation) {
    kt_gaps *gaps = simulation->gaps;
    if (gaps->revision != simulation->model->revision)
        gaps->time = (double)NAN;
    gaps->revision = simulation->model->revision;
}

const kt_part kt_gap_part = {.is_active = has_gaps,
                             .measure = measure_gaps,
                             .init = init_gaps,
                             .rebind = rebind_gaps,
                             .renew = renew_gaps,
                             .forget = forget_gaps,
                             .resume = forget_gaps,
                             .admit = check_gaps_at};
