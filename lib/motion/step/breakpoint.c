/* Breakpoints: times at which the forces or drives of a simulation, or their derivatives, jump.
 *
 * An adaptive method evaluates forces at its stages only. In quiet motion its steps grow tenfold. A later force would
 * then begin and end between two stages. A step might also reach across a breakpoint, where a method has only the order
 * of the continuous derivatives. Therefore steps end at breakpoints. Between two breakpoints, every function of time is
 * one of these:
 *
 * - A polynomial, whose values each step samples.
 *
 * - A sine, of which a step is at most a quarter of a period (kt_simulation_longest_step).
 *
 * - A formula that is monotone with its first two derivatives, so that the ends of a step determine it
 *   (expression/formula_breakpoint.c).
 *
 * The accelerations themselves jump, for example, if a drive's second derivative or the slope of a servo's target
 * jumps. A step that ends at a breakpoint needs the limit from the left, and the next step the limit from the right.
 * The time of evaluation is moved by a few roundings into the step, and the slopes of the step before are forgotten.
 *
 * The velocity of a drive may jump, too. The step that ends at such a time is projected to the limit from the left, so
 * that its interpolant is right. The next step starts from a projection to the limit from the right. Fixed steps end at
 * such jumps only, and the next step ends on the grid again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "expression/formula_breakpoint.h"
#include "integrator/integrator.h"
#include "step/simulation_core.h"

#include <float.h>
#include <math.h>

/* ---- of the model ------------------------------------------------------------------------------------------------ */

/* A breakpoint of all functions together. The accelerations jump if a derivative on which they depend jumps. */
typedef struct breakpoint {
    double time;
    bool jumps, cut; /* cut: a search of features reached its limit */
    bool strikes;    /* a velocity or a position that a loop prescribes jumps */
} breakpoint;

/* Uses this time if it is after t, and not after the earliest breakpoint found so far. jumps: accelerations jump at the
 * time. Breakpoints at one time have the facts of all of them. */
static void meet_breakpoint(breakpoint *first, double t, double time, bool jumps) {
    if (!(time > t) || time > first->time)
        return;
    first->jumps = jumps || (time == first->time && first->jumps);
    first->cut = time == first->time && first->cut;
    first->strikes = time == first->time && first->strikes;
    first->time = time;
}

/* The next breakpoint of a function. All searches of a run take no more than KT_BREAKPOINT_OPERATIONS. */
static kt_breakpoint seek_breakpoint(kt_simulation *simulation, const kt_curve *curve, double t, double until) {
    int64_t left = KT_BREAKPOINT_OPERATIONS - simulation->memory.sought;
    const kt_breakpoint next = kt_curve_next_breakpoint(curve, simulation->model->number, t, until, &left);
    simulation->memory.sought = KT_BREAKPOINT_OPERATIONS - left;
    return next;
}

/* order: the highest derivative of the function on which accelerations depend. speed: the derivative on which
 * velocities depend; -1: none. */
static void meet_curve(kt_simulation *simulation, breakpoint *first, double t, const kt_curve *curve, int order,
                       int speed) {
    const kt_breakpoint next = seek_breakpoint(simulation, curve, t, first->time);
    meet_breakpoint(first, t, next.time, next.order <= order);
    first->cut = (first->cut || (next.order == KT_BREAKPOINT_CUT && next.time == first->time));
    first->strikes = first->strikes || (next.order <= speed && next.time == first->time && first->time < HUGE_VAL);
}

/* The functions of time of a model: of loops, effects, formulas and masses. */
static size_t time_parts_of(const kt_model *model) { return model->n.time_part; }
static size_t curves_of(const kt_model *model) {
    return model->n.loop + 3 * model->n.effect + time_parts_of(model) + kt_mass_curve_count(model);
}

/* Function of time number k of the model: those of loops, effects (three each), formulas and masses. */
static const kt_curve *curve_at(const kt_model *model, size_t k) {
    if (k < model->n.loop)
        return &model->loop[k].curve;
    k -= model->n.loop;
    if (k < 3 * model->n.effect)
        return &model->effect[k / 3].curve[k % 3];
    k -= 3 * model->n.effect;
    return k < time_parts_of(model) ? &model->time_part[k] : kt_mass_curve(model, k - time_parts_of(model));
}

/* The highest derivative of a function that the accelerations depend on. Powers depend on the rates of masses. */
static int order_of_curve(const kt_model *model, size_t k) {
    const size_t effects = model->n.loop + 3 * model->n.effect;
    if (k >= model->n.loop && k < effects)
        return kt_effect_kind_of(model->effect[(k - model->n.loop) / 3].type)->derivatives;
    return k < effects ? 2 : k < effects + time_parts_of(model) ? 0 : 1;
}

/* The highest derivative of a function that velocities depend on; -1: none. */
static int speed_order_of_curve(const kt_model *model, size_t k) {
    return k >= model->n.loop ? -1 : model->loop[k].type == KT_LOOP_RATES ? 0 : 1;
}

/* Times this close to each other count as equal, because rounding would hide a step between them. */
static double margin_at(double t) { return isfinite(t) ? kt_time_step(t) : 0.0; }

/* For fixed steps: the next jump of a velocity or a position that a loop prescribes. The search ends after this number
 * of steps, and beyond times that count as equal to t. Its end counts as a breakpoint without a jump. */
static breakpoint next_strike(kt_simulation *simulation, double t) {
    static const double steps = 1000.0;
    const kt_model *model = simulation->model;
    breakpoint first = {.time = t + fmax(steps * simulation->step, 4.0 * margin_at(t))};
    for (size_t k = 0; k < model->n.loop; k++) {
        const int speed = speed_order_of_curve(model, k);
        kt_breakpoint next = {t, speed + 1};
        while (next.time < first.time && next.order > speed)
            next = seek_breakpoint(simulation, curve_at(model, k), next.time, first.time);
        if (next.time < first.time)
            first = (breakpoint){.time = next.time, .jumps = true, .strikes = true};
    }
    return first;
}

/* The functions of loops, of effects (three each), and the others come in this order (curve_at). Each search ends at
 * the breakpoint that was found before, so that callbacks of an effect shorten the searches behind it. */
static breakpoint next_breakpoint(kt_simulation *simulation, double t) {
    const kt_model *model = simulation->model;
    breakpoint first = {.time = HUGE_VAL};
    if (simulation->breakpoints.fixed)
        return next_strike(simulation, t);
    size_t k = 0;
    for (; k < model->n.loop; k++)
        meet_curve(simulation, &first, t, curve_at(model, k), order_of_curve(model, k), speed_order_of_curve(model, k));
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        for (const size_t end = k + 3; k < end; k++)
            meet_curve(simulation, &first, t, curve_at(model, k), order_of_curve(model, k),
                       speed_order_of_curve(model, k));
        if (effect->breakpoint != NULL)
            meet_breakpoint(&first, t, effect->breakpoint(effect->user, t), true);
    }
    for (size_t i = 0; i < model->n.x; i++)
        if (model->state[i].breakpoint != NULL)
            meet_breakpoint(&first, t, model->state[i].breakpoint(model->state[i].user, t), true);
    for (; k < curves_of(model); k++)
        meet_curve(simulation, &first, t, curve_at(model, k), order_of_curve(model, k), -1);
    if (simulation->options.breakpoint != NULL)
        meet_breakpoint(&first, t, simulation->options.breakpoint(simulation->options.user, t), true);
    return first;
}

bool kt_simulation_has_motion_breakpoints(const kt_model *model) {
    bool has = false;
    for (size_t k = 0; k < model->n.loop && !has; k++)
        has = kt_curve_has_breakpoints(curve_at(model, k));
    return has;
}

bool kt_simulation_has_breakpoints(const kt_model *model) {
    bool has = false;
    for (size_t i = 0; i < model->n.effect && !has; i++)
        has = model->effect[i].breakpoint != NULL;
    for (size_t i = 0; i < model->n.x && !has; i++)
        has = model->state[i].breakpoint != NULL;
    for (size_t k = 0; k < curves_of(model) && !has; k++)
        has = kt_curve_has_breakpoints(curve_at(model, k));
    return has;
}

double kt_simulation_longest_step(const kt_model *model) {
    double longest = HUGE_VAL;
    for (size_t k = 0; k < curves_of(model); k++)
        longest = fmin(longest, kt_curve_longest_step(curve_at(model, k), model->number));
    return longest;
}

/* The least distance of two breakpoints of one function, or `least` if `least` is smaller, at times from 0 on. */
static double shortest_piece(const kt_curve *curve, const double *numbers, double duration, int64_t *left,
                             double least) {
    double last = -HUGE_VAL;
    for (kt_breakpoint c = kt_curve_next_breakpoint(curve, numbers, 0.0, duration, left); c.time < duration;
         c = kt_curve_next_breakpoint(curve, numbers, c.time, duration, left)) {
        least = c.order == KT_BREAKPOINT_CUT ? least : fmin(least, c.time - last);
        last = c.time;
    }
    return least;
}

double kt_simulation_shortest_feature(const kt_model *model, double duration) {
    double least = kt_simulation_longest_step(model);
    int64_t left = KT_BREAKPOINT_OPERATIONS;
    for (size_t k = 0; k < curves_of(model); k++)
        least = shortest_piece(curve_at(model, k), model->number, duration, &left, least);
    return least;
}

double kt_simulation_next_feature(kt_simulation *simulation, const kt_expression *const *parts, int count, double t) {
    int64_t left = KT_BREAKPOINT_OPERATIONS - simulation->memory.sought;
    double next = HUGE_VAL;
    bool cut = false;
    for (int k = 0; k < count; k++) {
        int order;
        const double found = kt_expression_next_breakpoint(parts[k], t, next, &left, &order);
        cut = found < next ? order == KT_BREAKPOINT_CUT : cut;
        next = fmin(next, found);
    }
    simulation->memory.sought = KT_BREAKPOINT_OPERATIONS - left;
    simulation->events.cut += cut;
    return next;
}

/* ---- of a step --------------------------------------------------------------------------------------------------- */

/* The distance from a jump at which the limits on its sides are evaluated. */
static double aside(const kt_simulation *simulation, double t) {
    return 4.0 * DBL_EPSILON * fmax(fabs(t), simulation->duration) + DBL_MIN;
}

void kt_simulation_forget_breakpoints(kt_simulation *simulation) {
    kt_breakpoints *c = &simulation->breakpoints;
    if (c->passing)
        return;
    c->from = c->next = c->begin = c->end = simulation->memory.piece = (double)NAN;
}

void kt_simulation_renew_breakpoints(kt_simulation *simulation) {
    const double begin = simulation->breakpoints.begin;
    kt_simulation_forget_breakpoints(simulation);
    simulation->breakpoints.begin = begin;
}

/* Finds the breakpoint after t. Returns the quantities that jump at t itself. */
static breakpoint enter_piece(kt_simulation *simulation, double t) {
    kt_breakpoints *c = &simulation->breakpoints;
    const double margin = margin_at(t);
    const int64_t before = simulation->memory.sought;
    double last = t;
    breakpoint at = {.time = t};
    breakpoint next = next_breakpoint(simulation, nextafter(t - margin, -HUGE_VAL));
    while (next.time <= t + margin) {
        at.jumps = at.jumps || next.jumps;
        at.strikes = at.strikes || next.strikes;
        last = fmax(t, next.time);
        next = next_breakpoint(simulation, next.time);
    }
    simulation->memory.piece = t;
    simulation->memory.before = before;
    *c = (kt_breakpoints){.any = true,
                          .fixed = c->fixed,
                          .from = t,
                          .next = next.time,
                          .jumps = next.jumps,
                          .cut = next.cut,
                          .strikes = next.strikes,
                          .struck = at.strikes,
                          .begin = at.jumps ? t : (double)NAN,
                          .after = last + aside(simulation, last),
                          .end = (double)NAN};
    return at;
}

/* Notes that the step that ends at t ends at a breakpoint. */
static void end_at_breakpoint(kt_breakpoints *c, double t, double before) {
    c->end = t;
    c->before = before;
}

void kt_simulation_recall_breakpoints(kt_simulation *simulation) {
    kt_breakpoints *c = &simulation->breakpoints;
    const double t = kt_integrator_time(simulation->integrator);
    if (!isnan(c->from) || !(simulation->memory.piece <= t))
        return;
    const int64_t sought = simulation->memory.sought;      /* with later searches of events */
    simulation->memory.sought = simulation->memory.before; /* the search is repeated */
    (void)enter_piece(simulation, simulation->memory.piece);
    simulation->memory.sought = sought;
    if (c->jumps && !(t < c->next - margin_at(c->next)))
        end_at_breakpoint(c, t, fmin(c->next, t) - aside(simulation, c->next));
}

/* Nothing to do while the present time is within the piece (from, next). With fixed steps, the piece also ends before a
 * step that may reach the end of the search, which is no jump. */
bool kt_simulation_pass_piece(kt_simulation *simulation, bool *strikes) {
    const kt_breakpoints *c = &simulation->breakpoints;
    const double t = kt_integrator_time(simulation->integrator);
    kt_simulation_recall_breakpoints(simulation);
    const bool ends = c->fixed && !c->jumps && c->next - t < 2.0 * simulation->step; /* the search, within a step */
    if (c->from <= t && t < c->next - margin_at(c->next) && !ends)
        return false;
    simulation->memory.breakpoints += t >= c->next - margin_at(c->next) && (c->jumps || !c->fixed);
    const breakpoint at = enter_piece(simulation, t);
    simulation->memory.cut += c->cut;
    *strikes = at.strikes;
    return at.jumps;
}

bool kt_simulation_has_inner_stage(const kt_method *method) {
    for (int i = 0; i < method->stages; i++)
        if (method->c[i] > 0.0 && method->c[i] < 1.0)
            return true;
    return kt_method_stages_vary(method);
}

/* Methods with stages only at the ends of their steps (heun) do not see a bump that ends at the value at which it
 * began. Therefore a step ends within each piece, at a time at which no cubic or bump is zero by symmetry. */
static void end_within_piece(const kt_simulation *simulation, double *t_limit) {
    static const double part = 0.4;
    const kt_breakpoints *c = &simulation->breakpoints;
    const double inside = c->from + part * (c->next - c->from);
    if (inside > kt_integrator_time(simulation->integrator) + margin_at(c->next) && inside < *t_limit)
        *t_limit = inside;
}

/* Reduces the end of the step to the next breakpoint if that comes first. */
static void limit_to_breakpoint(kt_simulation *simulation, kt_step_progress *progress) {
    kt_breakpoints *c = &simulation->breakpoints;
    double *t_limit = &progress->t_limit;
    const double margin = margin_at(c->next);
    c->end = (double)NAN;
    if (c->fixed && !c->jumps)
        return;
    if (simulation->lacks_inner_stage && isfinite(c->next) && !c->fixed)
        end_within_piece(simulation, t_limit);
    if (!isfinite(c->next) || c->next > *t_limit + margin)
        return;
    if (c->next < *t_limit - margin)
        *t_limit = c->next;
    if (c->jumps)
        end_at_breakpoint(c, *t_limit, fmin(c->next, *t_limit) - aside(simulation, c->next));
}

static bool has_breakpoints(const kt_simulation *simulation) { return simulation->breakpoints.any; }

const kt_part kt_breakpoint_part = {.is_active = has_breakpoints, .limit = limit_to_breakpoint};

/* ---- after a step of a method that does not see its end ---------------------------------------------------------- */

/* Whether a function changes far more after the last stage than before it, so that the step cannot represent it. The
 * latest time with an available slope counts as the last stage. orders: the number of its derivatives that count.
 * Changes below `nothing` are zero in every unit of a machine. */
static bool changes_behind(const kt_curve *curve, const double *numbers, const double time[3], int orders) {
    static const double more = 10.0, rounding = 1e-12, nothing = 1e-60;
    double value[3][3];
    for (int i = 0; i < 3; i++)
        kt_curve_evaluate(curve, numbers, time[i], value[i]);
    for (int k = 0; k <= orders; k++) {
        const double begin = value[0][k], last = value[1][k], end = value[2][k];
        if (fabs(end - last) > more * fabs(last - begin) + rounding * fmax(fabs(begin), fabs(end)) + nothing)
            return true;
    }
    return false;
}

/* Repeats a step of half the length if a function of time changes behind the last stage. */
static kt_status reject_missed_end(kt_simulation *simulation, kt_step_progress *progress, kt_verdict *verdict,
                                   kt_error *error) {
    static const double last_known = 2.0 / 3.0; /* where the third step of rkc4 begins */
    const kt_model *model = simulation->model;
    const kt_breakpoints *c = &simulation->breakpoints;
    const double t0 = kt_integrator_previous_time(simulation->integrator),
                 t1 = kt_integrator_time(simulation->integrator);
    const double time[3] = {c->begin == t0 ? c->after : t0, t0 + last_known * (t1 - t0), c->end == t1 ? c->before : t1};
    bool behind = false;
    for (size_t k = 0; k < curves_of(model) && !behind; k++) {
        const bool of_effect = k >= model->n.loop && k < model->n.loop + 3 * model->n.effect; /* their values alone */
        behind = changes_behind(curve_at(model, k), model->number, time, of_effect ? 0 : order_of_curve(model, k));
    }
    const double half = 0.5 * (t1 - t0);
    (void)error;
    if (!behind || !(half > margin_at(t1)))
        return KT_OK;
    progress->t_limit = t0 + half;
    kt_integrator_retreat(simulation->integrator, half);
    *verdict = KT_VERDICT_REPEAT;
    return KT_OK;
}

static bool watches_ends(const kt_simulation *simulation) { return simulation->watches_ends; }

const kt_part kt_missed_end_part = {.is_active = watches_ends, .check = reject_missed_end};

/* ---- of a record, where the step is fixed ------------------------------------------------------------------------ */

/* Whether a stage of a step from t0 over h lies strictly between a and b. */
static bool has_stage_between(const kt_method *method, double t0, double h, double a, double b) {
    for (int i = 0; i < method->stages; i++)
        if (a < t0 + method->c[i] * h && t0 + method->c[i] * h < b)
            return true;
    return false;
}

/* Whether the function changes from a to b, between which it is one polynomial. */
static bool changes(const kt_curve *curve, const double *numbers, double a, double b) {
    double begin[3], middle[3], end[3];
    kt_curve_evaluate(curve, numbers, a, begin);
    kt_curve_evaluate(curve, numbers, 0.5 * (a + b), middle);
    kt_curve_evaluate(curve, numbers, b, end);
    return begin[0] != middle[0] || middle[0] != end[0];
}

/* The first breakpoint after t with a jump of any order. HUGE_VAL if there is none before `until`. */
static double next_jump(kt_simulation *simulation, const kt_curve *curve, double t, double until) {
    kt_breakpoint next = {t, KT_BREAKPOINT_ORDER_MAX + 1};
    while (next.order > KT_BREAKPOINT_ORDER_MAX && next.time < until) {
        next = seek_breakpoint(simulation, curve, next.time, until);
        simulation->memory.cut += next.order == KT_BREAKPOINT_CUT && next.time < until;
    }
    return next.time < until ? next.time : HUGE_VAL;
}

/* Whether t lies between two breakpoints of the function, *a and *b, both within the last step, between which the
 * function changes without a stage. */
static bool breakpoint_is_missed(kt_simulation *simulation, const kt_curve *curve, double t, double *a, double *b) {
    const kt_integrator *integrator = simulation->integrator;
    const double *numbers = simulation->model->number;
    const double t0 = kt_integrator_previous_time(integrator), t1 = kt_integrator_time(integrator);
    *b = next_jump(simulation, curve, nextafter(t0, -HUGE_VAL), t1);
    do {
        *a = *b;
        *b = next_jump(simulation, curve, *a, t1);
    } while (*b < t);
    return *a < t && *b < t1 && changes(curve, numbers, *a, *b) &&
           !has_stage_between(kt_integrator_method(integrator), t0, t1 - t0, *a, *b);
}

/* With fixed steps: rejects a record at t, in the last step, if no stage has sampled a change of a function in this
 * step. */
static kt_status check_breakpoints_at(kt_simulation *simulation, double t, kt_error *error) {
    const kt_model *model = simulation->model;
    double a = 0.0, b = 0.0;
    bool missed = false;
    if (!(t < kt_integrator_time(simulation->integrator)))
        return KT_OK;
    for (size_t k = 0; k < curves_of(model) && !missed; k++)
        missed = breakpoint_is_missed(simulation, curve_at(model, k), t, &a, &b);
    if (!missed)
        return KT_OK;
    return kt_error_set(
        error, KT_ERROR_STEP, "functions of time",
        "no stage of the step of %g s evaluates the forces at t = %.9g s, between breakpoints at %.9g and "
        "%.9g s; take a smaller step, or an adaptive method, whose steps end at breakpoints",
        simulation->step, t, a, b);
}

static bool has_missed_pieces(const kt_simulation *simulation) { return simulation->breakpoints.fixed; }

const kt_part kt_missed_piece_part = {.is_active = has_missed_pieces, .admit = check_breakpoints_at};
