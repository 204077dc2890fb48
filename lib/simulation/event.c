/* Events: times at which a function g(t, q, v) of the motion changes its sign.
 *
 * After a step from t0 to t1, g is sampled on the dense output: at t0, at t1 and three times between them. If two
 * neighbouring samples differ in sign, there is a root between them. If three samples of one sign have the middle one
 * nearest to zero, the vertex of the parabola through them is sampled, too. In this way, two roots between two
 * neighbours are found if the parabola shows them. No step sees two roots closer than that: max_step bounds the roots
 * that can be missed.
 *
 * A step is long if the motion is simple (a driven crank, a wheel that turns freely), but g need not be simple. Such a
 * step is divided into panels. In a panel, no joint turns by more than half a turn, by its rates at the ends of the
 * step. A panel also ends at breakpoints of g as a function of time. Panels are sampled in turn until one has a root.
 *
 * The number of values of g that the search of a step may take is limited, for all its repetitions together. Each
 * repetition takes at most half of the remaining values. Beyond this limit, an adaptive step is repeated with the
 * length for which half of these values suffice. A fixed step has fewer, longer panels, and is counted (kt_event_cuts).
 *
 * The first root in the event's direction is enclosed with ITP, to four units of rounding of the time. Source:
 * Oliveira, Takahashi 2021, "An enhancement of the bisection method average performance preserving minmax optimality".
 *
 * The step is then undone, and repeated so that it ends at that root. The state at the root has the order of the
 * method, not that of the dense output, and the next step begins there. The repeated step has another dense output, on
 * which the root differs by the error of the first one. The root is searched again. Towards the end of a step the two
 * agree better and better, so that one or two repetitions suffice.
 *
 * An event has a side: the sign that g had last. A value of zero keeps the previous side, so that a root at the end of
 * a step is not found twice. Hard contacts that are left open while they touch have the side -1: they part, and may
 * close again. If forces have changed before they parted, they penetrate instead, which is an event, too. Roots within
 * `together` of each other are one instant. At an instant, events take effect in the order in which they were added.
 */
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "integrator/integrator.h"
#include "mechanism/evaluate.h"
#include "simulation/simulation.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Samples of a panel; samples with the vertices of parabolas; vertices at three samples. */
enum { SAMPLES = 5, SAMPLES_MOST = SAMPLES + 3, VERTICES = 4, REPETITIONS = 8, SETTLES = 3, ROOT_STEPS = 128 };
_Static_assert(KT_EVENT_VALUES == SAMPLES + 1, "the last row of values is that of the beginning of the step");

/* The largest turn of a joint in a panel, by the rates at both ends of the step. */
static const double half_turn = 3.14159265358979323846;

/* Values that every repetition of a step may take: of one panel, and of a root. PARABOLAS: of vertices in a panel. */
enum { AT_LEAST = SAMPLES - 1 + ROOT_STEPS, PARABOLAS = (SAMPLES - 2) * VERTICES };
_Static_assert((REPETITIONS + 1) * AT_LEAST + 2 <= KT_EVENT_EVALUATIONS_LEAST, "what a step takes in any case");

/* Roots within 1e-12 s, or eight units of rounding of the time, are one instant. */
static double together(double t) { return fmax(1e-12, 8.0 * DBL_EPSILON * fabs(t)); }
/* The size that rounding of times in a step is relative to. A step from t = 0 would shrink without end towards a root
 * there. It is bounded by a rounding of the end of its first try: in a rounding of this time, no state changes. */
static double extent_of_times(const kt_simulation *simulation, double t) {
#if KT_HAS_EVENTS
    return fmax(fabs(t), DBL_EPSILON * fabs(simulation->event_end));
#else
    (void)simulation;
    return fabs(t);
#endif
}
static double least_width(const kt_simulation *simulation, double t) {
    return 4.0 * DBL_EPSILON * extent_of_times(simulation, t);
}
/* No step is shorter. */
static double shortest(const kt_simulation *simulation, double t) {
    return 64.0 * DBL_EPSILON * extent_of_times(simulation, t);
}

/* If the step was to end at a root, values below this part of the largest along the step are the root. */
static const double reached = 1e-3;
/* Reactions below this part of the largest along a step are rounding. */
static const double nothing = 1e-9;

/* ---- the function ------------------------------------------------------------------------------------------------ */

/* The error of a caller's function or action. */
static kt_status fail_event(const kt_event *event, const char *what, double t, const kt_error *from, int code,
                            kt_error *error) {
    char where[KT_WHERE_SIZE];
    snprintf(where, sizeof where, "event '%.60s' at t = %.9g s", event->name, t);
    return from->code != KT_OK ? kt_error_set(error, from->code, where, "%s", from->message)
                               : kt_error_set(error, KT_ERROR_CALLBACK, where, "its %s returned %d", what, code);
}

/* Evaluates g of one event in the state y. */
static kt_status evaluate(kt_simulation *simulation, size_t k, double t, const double *y, double *value,
                          kt_error *error) {
    const kt_event *event = &simulation->event[k];
    const double *shown;
    kt_error from = {0};
    kt_instant at = {.model = simulation->user_model, .data = simulation->user_data, .t = t};
    kt_simulation_export(simulation, t, y, NULL, &at.q, &at.v, &shown);
    at.x = y + simulation->size.nq + simulation->size.nv;
    kt_simulation_use_states(simulation, y);
    at.tau = simulation->memory.now.torque ? simulation->torque : NULL;
    at.external = simulation->memory.now.wrenches ? simulation->wrench : NULL;
    simulation->cached = KT_CACHED_NOTHING; /* data are the function's scratch */
    simulation->event_search[k].spent++;
    const int code = event->function(&at, value, &from, event->user);
    if (code != 0 || isnan(*value)) {
        if (code == 0)
            (void)kt_error_set(&from, KT_ERROR_NOT_FINITE, NULL, "its value is NaN");
        return fail_event(event, "function", t, &from, code, error);
    }
    return KT_OK;
}

static bool is_armed(const kt_simulation *simulation, size_t k) {
    const uint64_t limit = simulation->event[k].limit;
    return !simulation->event_memory[k].disarmed && (limit == 0 || simulation->event_memory[k].count < limit);
}

/* Evaluates g of all armed events in the state y. */
static kt_status evaluate_all(kt_simulation *simulation, double t, const double *y, double *values, kt_error *error) {
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && k < simulation->event_count; k++)
        if (is_armed(simulation, k))
            status = evaluate(simulation, k, t, y, &values[k], error);
    return status;
}

static int sign_of(double value) { return (value > 0.0) - (value < 0.0); }

/* ---- the first root in a step ------------------------------------------------------------------------------------ */

typedef struct sample {
    double t, g;
} sample;

static kt_status value_at(kt_simulation *simulation, size_t k, double t, sample *to, kt_error *error) {
    const kt_status status = kt_simulation_between(simulation, t, error);
    to->t = t;
    return status == KT_OK ? evaluate(simulation, k, t, simulation->y, &to->g, error) : status;
}

/* The time at which the parabola through three samples of one sign comes nearest to zero. Returns false unless that
 * time is between them. */
static bool vertex_of(const sample *a, const sample *m, const sample *b, double *t) {
    const double left = (m->g - a->g) / (m->t - a->t), right = (b->g - m->g) / (b->t - m->t);
    const double curvature = (right - left) / (b->t - a->t);
    if (!(curvature * sign_of(m->g) > 0.0))
        return false;
    *t = 0.5 * (a->t + m->t) - 0.5 * left / curvature;
    return a->t < *t && *t < b->t && *t != m->t;
}

/* Searches a sample of another sign between three samples of one sign, at the vertices of parabolas. */
static kt_status find_hidden(kt_simulation *simulation, size_t k, sample a, sample m, sample b, sample *hidden,
                             bool *found, kt_error *error) {
    const int side = sign_of(m.g);
    double t;
    *found = false;
    for (int i = 0; i < VERTICES && vertex_of(&a, &m, &b, &t); i++) {
        sample v;
        const kt_status status = value_at(simulation, k, t, &v, error);
        if (status != KT_OK)
            return status;
        if (sign_of(v.g) == -side) {
            *hidden = v;
            *found = true;
            return KT_OK;
        }
        if (fabs(v.g) >= fmin(fmin(fabs(a.g), fabs(b.g)), fabs(m.g)))
            return KT_OK;
        if (v.t < m.t) {
            b = m;
        } else {
            a = m;
        }
        m = v;
    }
    return KT_OK;
}

static int insert(sample *samples, int count, sample new) {
    int i = count;
    for (; i > 0 && samples[i - 1].t > new.t; i--)
        samples[i] = samples[i - 1];
    samples[i] = new;
    return count + 1;
}

/* Clears values of rounding at the beginning of a panel. A step that ended at the root may have left such a value on
 * the side from which it came. With its present rate, g reaches the other side within the same instant. Up to there,
 * values that are no farther from zero are rounding too, and count as on the other side. For contacts, such values are
 * penetration instead. Returns the size of the rounding. */
static double clear_rounding(const kt_simulation *simulation, size_t k, sample *base) {
    const int from = simulation->event_search[k].side;
    const double left = fabs(base[0].g), reach = fabs(base[1].g - base[0].g) * together(base[0].t);
    if (from == 0 || sign_of(base[0].g) == from)
        return 0.0;
    base[0].g = from * DBL_MIN;
    if (k < kt_simulation_contact_events(simulation) || !(left * (base[1].t - base[0].t) <= reach))
        return 0.0;
    for (int j = 1; j < SAMPLES && sign_of(base[j].g) == -from && fabs(base[j].g) <= left; j++)
        base[j].g = from * DBL_MIN;
    return left;
}

/* Whether the search of the step may still take the values of a panel's parabolas. */
static bool has_values_left(const kt_simulation *simulation, size_t k) {
#if KT_HAS_EVENTS
    return simulation->event_search[k].spent + PARABOLAS <= simulation->event_most;
#else
    (void)simulation, (void)k;
    return true;
#endif
}

/* Lists the samples of event k along a panel, with those that parabolas add. */
static kt_status place_samples(kt_simulation *simulation, size_t k, const double *times, sample *samples, int *count,
                               kt_error *error) {
    sample base[SAMPLES];
    kt_status status = KT_OK;
    for (int j = 0; j < SAMPLES; j++)
        base[j] = (sample){times[j], simulation->event_value[(size_t)j * simulation->size.event + k]};
    const double left = clear_rounding(simulation, k, base);
    memcpy(samples, base, sizeof base);
    *count = SAMPLES;
    for (int j = 1; status == KT_OK && j + 1 < SAMPLES; j++) {
        const int side = sign_of(base[j].g);
        sample hidden = base[j];
        bool found;
        if (!has_values_left(simulation, k) || side == 0 || sign_of(base[j - 1].g) != side ||
            sign_of(base[j + 1].g) != side)
            continue;
        status = find_hidden(simulation, k, base[j - 1], base[j], base[j + 1], &hidden, &found, error);
        if (status == KT_OK && found && !(fabs(hidden.g) <= left))
            *count = insert(samples, *count, hidden);
    }
    return status;
}

/* Finds the root of g - threshold between a and b: the end of an interval of the least width in which the sign changes.
 * Method: ITP.
 *
 *    kappa_1 = 0.2 / (b - a), kappa_2 = 2, n_0 = 1 */
static kt_status enclose(kt_simulation *simulation, size_t k, double threshold, sample a, sample b, double *root,
                         kt_error *error) {
    a.g -= threshold;
    b.g -= threshold;
    const int side = sign_of(b.g);
    const double width = fmax(least_width(simulation, b.t), DBL_MIN), kappa = 0.2 / (b.t - a.t);
    double radius = width * exp2(ceil(log2((b.t - a.t) / width)));
    for (int i = 0; i < ROOT_STEPS && b.t - a.t > width; i++) {
        const double half = 0.5 * (a.t + b.t), length = b.t - a.t;
        const double secant = (b.g * a.t - a.g * b.t) / (b.g - a.g), toward = secant < half ? 1.0 : -1.0;
        const double shift = fmin(kappa * length * length, fabs(half - secant)),
                     reach = fmax(0.0, radius - 0.5 * length);
        double t = secant + toward * shift;
        if (fabs(t - half) > reach)
            t = half - toward * reach;
        if (!(a.t < t && t < b.t)) /* rounding, or values that are infinite */
            t = half;
        if (!(a.t < t && t < b.t))
            break;
        sample m;
        const kt_status status = value_at(simulation, k, t, &m, error);
        if (status != KT_OK)
            return status;
        m.g -= threshold;
        *(sign_of(m.g) == side ? &b : &a) = m;
        radius *= 0.5;
    }
    *root = b.t;
    return KT_OK;
}

/* Whether forces that jump at the beginning of the step have made the reaction of contact k negative there, beyond
 * rounding. */
static bool is_negative_at_once(const kt_simulation *simulation, size_t k, const double *times) {
    const kt_event_search *search = &simulation->event_search[k];
    return kt_simulation_has_jumped(simulation) && k < kt_simulation_contact_events(simulation) && search->side > 0 &&
           times[0] == kt_integrator_previous_time(simulation->integrator) &&
           simulation->event_value[k] < -nothing * search->size;
}

/* Finds the first root of event k in a panel in its direction, and the side behind it. HUGE_VAL if there is none: then
 * the side of g behind the panel is kept. */
static kt_status find_root(kt_simulation *simulation, size_t k, const double *times, double *root, int *side,
                           kt_error *error) {
    sample samples[SAMPLES_MOST];
    int count, from = simulation->event_search[k].side;
    const kt_status status = place_samples(simulation, k, times, samples, &count, error);
    const double begin = simulation->event_value[SAMPLES * simulation->size.event + k]; /* of the step */
    const double margin = kt_simulation_contact_margin(simulation), depth = fmin(begin + 0.5 * margin, 0.0) - margin;
    *root = HUGE_VAL;
    if (status == KT_OK && is_negative_at_once(simulation, k, times)) {
        *root = times[0];
        *side = -1;
        return KT_OK;
    }
    for (int i = 1; status == KT_OK && i < count; i++) {
        const int to = sign_of(samples[i].g);
        if (from < 0 && samples[i].g < depth && k < kt_simulation_contact_events(simulation)) {
            *side = -1;
            return enclose(simulation, k, depth, samples[i - 1], samples[i], root, error);
        }
        if (to == 0 || to == from)
            continue;
        const kt_direction direction = simulation->event[k].direction;
        const bool fits = direction == KT_DIRECTION_EITHER || (direction == KT_DIRECTION_RISING) == (to > 0);
        const bool counts = from != 0 && fits;
        from = to;
        if (!counts)
            continue;
        *side = to;
        return enclose(simulation, k, 0.0, samples[i - 1], samples[i], root, error);
    }
    simulation->event_search[k].side = from;
    return status;
}

/* ---- a panel ----------------------------------------------------------------------------------------------------- */

/* Samples g along a panel whose first values are available: at its end, and three times between. */
static kt_status sample_panel(kt_simulation *simulation, double from, double to, double *times, kt_error *error) {
    const double t1 = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    for (int j = 0; j < SAMPLES; j++)
        times[j] = j + 1 < SAMPLES ? from + (to - from) * j / (SAMPLES - 1) : to;
    for (int j = 1; status == KT_OK && j < SAMPLES; j++) {
        const double *y = kt_integrator_state(simulation->integrator);
        if (j + 1 < SAMPLES || to != t1) {
            status = kt_simulation_between(simulation, times[j], error);
            y = simulation->y;
        }
        if (status == KT_OK)
            status = evaluate_all(simulation, times[j], y, simulation->event_value + (size_t)j * simulation->size.event,
                                  error);
    }
    return status;
}

/* The time of an event at which the step was to end. If the state has almost reached the event, this is the end of the
 * step. If the state is far from it, the dense output of the longer step before was wrong, for example because friction
 * reversed within it. Then the result is the time to which the slope at the end leads, HUGE_VAL if it leads nowhere. */
static double arrival_of(const kt_simulation *simulation, size_t k, const double *times) {
    const double *before = simulation->event_value + (SAMPLES - 2) * simulation->size.event + k,
                 *end = times + SAMPLES - 1;
    const double last = before[simulation->size.event], slope = (last - *before) / (end[0] - end[-1]);
    const bool is_hidden = *end - times[0] <= together(times[0]) && kt_simulation_hides_contact(simulation, k);
    if (is_hidden || sign_of(last) != -simulation->event_root[k].side ||
        !(fabs(last) > reached * simulation->event_search[k].size))
        return *end;
    return slope * last < 0.0 ? *end - last / slope : HUGE_VAL;
}

/* Finds the roots of all events in a panel, in `root` and `side`. The earliest one so far becomes *first. settles: an
 * awaited end of slip is at the end of the step if the slip is below its rest velocity there. */
static kt_status find_roots_in(kt_simulation *simulation, const double *times, bool settles, double *first,
                               kt_error *error) {
    const double t1 = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && k < simulation->event_count; k++) {
        kt_event_root *found = &simulation->event_root[k];
        kt_event_search *search = &simulation->event_search[k];
        double root = HUGE_VAL;
        int side = 0;
        if (found->due && found->time <= times[0]) /* in an earlier panel */
            continue;
        for (size_t j = 0; j < SAMPLES; j++)
            search->size = fmax(search->size, fabs(simulation->event_value[j * simulation->size.event + k]));
        if (is_armed(simulation, k))
            status = find_root(simulation, k, times, &root, &side, error);
        const bool is_awaited = found->due && found->time == t1;
        const bool settled =
            is_awaited && settles && times[SAMPLES - 1] == t1 && kt_simulation_ends_slip(simulation, k);
        root = settled ? HUGE_VAL : root;
        found->due = root < HUGE_VAL || is_awaited;
        if (root < HUGE_VAL) {
            found->time = root;
            found->side = side;
        } else if (is_awaited && times[SAMPLES - 1] == t1) {
            found->time = settled ? t1 : arrival_of(simulation, k, times);
            found->due = found->time < HUGE_VAL;
        }
        if (found->due)
            *first = fmin(*first, found->time);
    }
    return status;
}

/* The first breakpoint of an event after t, and the index of that event. A breakpoint is searched again only after it
 * is passed: a search costs more than a step. */
static double next_event_breakpoint(kt_simulation *simulation, double t, size_t *of) {
    double next = HUGE_VAL;
    for (size_t k = 0; k < simulation->event_count; k++) {
        const kt_event *event = &simulation->event[k];
        double *breakpoint = &simulation->event_search[k].breakpoint;
        if (event->corner == NULL || !is_armed(simulation, k))
            continue;
        if (!(t < *breakpoint))
            *breakpoint = event->corner(event->user, t);
        if (*breakpoint > t && *breakpoint < next) {
            next = *breakpoint;
            *of = k;
        }
    }
    return next;
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* The largest rate at which a joint turns in the state y, rad/s. */
static double largest_rate(kt_simulation *simulation, double t, const double *y) {
    const kt_model *model = simulation->user_model;
    const double *q, *v, *shown;
    double most = 0.0;
    kt_simulation_export(simulation, t, y, NULL, &q, &v, &shown);
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        double square = 0.0;
        for (int k = kt_link_lengths(link); k < kt_link_dofs(link); k++)
            square += v[link->v + k] * v[link->v + k];
        most = fmax(most, square);
    }
    return sqrt(most);
}

/* Evaluates g at the present time, unless the values are available, and sets the sides that are not set yet. */
static kt_status begin_events(kt_simulation *simulation, kt_error *error) {
    const double t = kt_integrator_time(simulation->integrator);
    const double *y = kt_integrator_state(simulation->integrator);
    if (simulation->event_time == t)
        return KT_OK;
    const kt_status status = evaluate_all(simulation, t, y, simulation->event_value, error);
    if (status != KT_OK)
        return status;
    simulation->event_time = t;
    simulation->event_rate = largest_rate(simulation, t, y);
    for (size_t k = 0; k < simulation->event_count; k++)
        if (simulation->event_memory[k].side == 0 && is_armed(simulation, k))
            simulation->event_memory[k].side = sign_of(simulation->event_value[k]);
    return KT_OK;
}

/* Sets the values with which a search along the last step begins. */
static void begin_search(kt_simulation *simulation) {
    const size_t n = simulation->size.event;
    simulation->event_rate_end = largest_rate(simulation, kt_integrator_time(simulation->integrator),
                                              kt_integrator_state(simulation->integrator));
    kt_copy(simulation->event_value + SAMPLES * n, simulation->event_value, n * sizeof(double));
    simulation->event_cut = 0;
    for (size_t k = 0; k < simulation->event_count; k++)
        simulation->event_search[k] = (kt_event_search){.side = (int)simulation->event_memory[k].side,
                                                        .spent = simulation->event_search[k].spent,
                                                        .breakpoint = simulation->event_memory[k].breakpoint};
}

/* The largest number of values that the step has taken so far for one event. */
static int most_spent(const kt_simulation *simulation) {
    int most = 0;
    for (size_t k = 0; k < simulation->event_count; k++)
        most = simulation->event_search[k].spent > most ? simulation->event_search[k].spent : most;
    return most;
}

/* The first armed event; event_count if there is none. */
static size_t first_armed(const kt_simulation *simulation) {
    size_t k = 0;
    while (k < simulation->event_count && !is_armed(simulation, k))
        k++;
    return k;
}

/* The limits of the search along a step, and its progress. */
typedef struct reach {
    int begin, most; /* values taken before, and those with which the search ends */
    double half;     /* s, the time at which half of them were taken */
    bool cut;        /* the last panel contains more than half a turn, or breakpoints */
    size_t of;       /* the event that is reported: that of the last breakpoint, else the first armed one */
} reach;

static reach begin_reach(kt_simulation *simulation) {
    const int begin = most_spent(simulation);
    reach r = {.begin = begin, .most = INT_MAX, .half = -HUGE_VAL, .of = first_armed(simulation)};
#if KT_HAS_EVENTS
    const int left = simulation->event_evaluations - KT_EVENT_EVALUATIONS_LEAST - begin;
    r.most = simulation->event_most = begin + (left > 0 ? left / 2 : 0);
#endif
    return r;
}

/* The number of panels of equal length of a step. An adaptive step is searched as far as its values suffice. */
static double count_panels(const kt_simulation *simulation, double length, reach *r) {
    const double turn = length * fmax(simulation->event_rate, simulation->event_rate_end);
    const double count = fmax(1.0, ceil(turn / half_turn)), most = floor((double)(r->most - r->begin) / (SAMPLES - 1));
    if (simulation->step > 0.0 && count > most) {
        r->cut = true;
        return fmax(1.0, most);
    }
    return count;
}

/* The end of a panel, or the end of the step if one more panel takes too many values. */
static double end_of_panel(const kt_simulation *simulation, double from, double to, double t1, reach *r) {
    const int spent = most_spent(simulation);
    if (2 * (spent - r->begin) <= r->most - r->begin)
        r->half = from;
    if (!(to < t1) || spent + 2 * (SAMPLES - 1) <= r->most)
        return to;
    r->cut = true;
    return t1;
}

/* Counts a search that was cut, with a last panel that is too long. */
static void count_cut(kt_simulation *simulation, const reach *r) {
#if KT_HAS_EVENTS
    kt_simulation_memory *memory = &simulation->memory;
    if (memory->event_cuts++ == 0) {
        memory->event_cut_time = kt_integrator_previous_time(simulation->integrator);
        memory->event_cut_of = (int64_t)r->of;
    }
#else
    (void)simulation, (void)r;
#endif
}

/* Finds the roots of all events in the first panel of the last step that has any, and the roots of the same instant.
 * The earliest root, or HUGE_VAL, goes to *first. If the search of an adaptive step takes too many values, the end of
 * the repeated step goes to *shorter, else HUGE_VAL. */
static kt_status find_roots(kt_simulation *simulation, bool may_shorten, bool settles, double *first, double *shorter,
                            kt_error *error) {
    const size_t n = simulation->size.event;
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator);
    double *value = simulation->event_value;
    double times[SAMPLES], from = t0, i = 1.0;
    kt_status status = KT_OK;
    *first = *shorter = HUGE_VAL;
    begin_search(simulation);
    reach r = begin_reach(simulation);
    if (r.of == simulation->event_count)
        return KT_OK;
    const double count = count_panels(simulation, t1 - t0, &r);
    while (status == KT_OK && from < t1 && from <= *first + together(*first)) {
        const double even = i < count ? t0 + (t1 - t0) * (i / count) : t1,
                     breakpoint = next_event_breakpoint(simulation, from, &r.of);
        const double to = end_of_panel(simulation, from, fmin(even, breakpoint), t1, &r);
        if (may_shorten && r.cut && r.half > t0 + shortest(simulation, t0)) {
            *shorter = r.half;
            break;
        }
        if (from > t0)
            kt_copy(value, value + (SAMPLES - 1) * n, n * sizeof(double));
        status = sample_panel(simulation, from, to, times, error);
        if (status == KT_OK)
            status = find_roots_in(simulation, times, settles, first, error);
        from = to;
        i += to == even;
    }
    if (r.cut && !(*shorter < HUGE_VAL))
        count_cut(simulation, &r);
    kt_copy(value, value + SAMPLES * n, n * sizeof(double));
    simulation->event_reach = from;
    return status;
}

/* The last root that belongs to the same instant as the first one. Roots behind it are not due any longer. */
static double instant_of(kt_simulation *simulation, double first) {
    double last = first;
    for (size_t k = 0; k < simulation->event_count; k++)
        if (simulation->event_root[k].due && simulation->event_root[k].time <= first + together(first))
            last = fmax(last, simulation->event_root[k].time);
    for (size_t k = 0; k < simulation->event_count; k++)
        if (simulation->event_root[k].due) {
            simulation->event_root[k].due = simulation->event_root[k].time <= last;
            simulation->event_root[k].time = last;
        }
    return last;
}

/* Accepts the last step: its end becomes the beginning of the next one. */
static void pass(kt_simulation *simulation, bool fires) {
    const size_t n = simulation->size.event;
    kt_copy(simulation->event_value, simulation->event_value + (SAMPLES - 1) * n, n * sizeof(double));
    simulation->event_time = kt_integrator_time(simulation->integrator);
    simulation->event_rate = simulation->event_rate_end;
    kt_simulation_clear_jump(simulation);
    simulation->memory.cut += simulation->event_cut;
    for (size_t k = 0; k < simulation->event_count; k++) {
        const int side = sign_of(simulation->event_value[k]);
        const bool due = fires && simulation->event_root[k].due;
        simulation->event_memory[k].size = simulation->event_search[k].size;
        simulation->event_memory[k].breakpoint = simulation->event_search[k].breakpoint;
        if (due || side != 0)
            simulation->event_memory[k].side = due ? simulation->event_root[k].side : side;
    }
    simulation->memory.fires = fires;
}

/* Begins the tries of a step, the first of which ends at t1. */
static void begin_tries(kt_simulation *simulation, double t1) {
#if KT_HAS_EVENTS
    simulation->event_beyond = HUGE_VAL;
    simulation->event_end = t1;
#else
    (void)t1;
#endif
    for (size_t k = 0; k < simulation->event_count; k++)
        simulation->event_root[k].due = false;
}

/* Whether this is the first search of a step. */
static bool is_first_search(kt_simulation *simulation) {
#if KT_HAS_EVENTS
    const bool first = !simulation->event_searched;
    simulation->event_searched = true;
    return first;
#else
    (void)simulation;
    return true;
#endif
}

/* The event at which this try of the step was to end; event_count if there is none. */
static size_t aim_of(const kt_simulation *simulation) {
    const double t1 = kt_integrator_time(simulation->integrator);
    size_t k = 0;
    while (k < simulation->event_count && !(simulation->event_root[k].due && simulation->event_root[k].time == t1))
        k++;
    return k;
}

/* Remembers an event for which a step is repeated (steps_per_call). */
static void remember_due(kt_simulation *simulation) {
    for (size_t k = simulation->event_count; k-- > 0;)
        if (simulation->event_root[k].due)
            simulation->event_latest = k;
}

static kt_status reject_event_step(kt_simulation *simulation, int repetition, double *t_limit, bool *again,
                                   kt_error *error) {
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator);
    double first, shorter;
    *again = false;
    if (is_first_search(simulation))
        for (size_t k = 0; k < simulation->event_count; k++)
            simulation->event_search[k].spent = 0;
    if (repetition == 0)
        begin_tries(simulation, t1);
    const size_t aim = aim_of(simulation);
    const bool may_shorten = simulation->step == 0.0 && repetition < REPETITIONS;
    kt_status status = find_roots(simulation, may_shorten, repetition >= SETTLES, &first, &shorter, error);
    double instant = status == KT_OK && first < HUGE_VAL ? instant_of(simulation, first) : HUGE_VAL;
    const bool ends =
        repetition >= REPETITIONS && !(t1 - instant > together(t1) && kt_simulation_skips_contact(simulation));
    const bool fires = instant < HUGE_VAL && (fabs(t1 - instant) <= least_width(simulation, t1) || ends);
    if (fires && simulation->event_reach != t1) /* the last panel ended before the end of the step */
        status = evaluate_all(simulation, t1, kt_integrator_state(simulation->integrator),
                              simulation->event_value + (SAMPLES - 1) * simulation->size.event, error);
    if (status != KT_OK) {
        kt_simulation_note_cause(simulation, error);
        kt_integrator_retreat(simulation->integrator, t1 - t0);
        return status;
    }
    if (shorter < HUGE_VAL) {
        kt_integrator_retreat(simulation->integrator, shorter - t0);
        *again = true;
        *t_limit = shorter;
        return KT_OK;
    }
    if (fires || !(instant < HUGE_VAL)) {
        pass(simulation, fires);
        return kt_simulation_count_miss(simulation, aim < simulation->event_count && !fires, aim, error);
    }
    instant = repetition >= REPETITIONS && !ends ? 0.5 * (t0 + t1) : kt_simulation_end_within(simulation, instant);
    kt_integrator_retreat(simulation->integrator, instant - t0);
    remember_due(simulation);
    *again = instant - t0 > shortest(simulation, instant);
    *t_limit = instant;
    if (!*again) { /* no step is so short: the event happens at the present state */
        for (size_t k = 0; k < simulation->event_count; k++)
            if (simulation->event_root[k].due)
                simulation->event_memory[k].side = simulation->event_root[k].side;
        simulation->memory.fires = true;
    }
    return KT_OK;
}

/* ---- effects of events ------------------------------------------------------------------------------------------- */

/* Hands over the record of an event: once before its action, and once after it if the action changed the state. */
static kt_status hand_over(kt_simulation *simulation, size_t k, kt_recorder *recorder, void *user, kt_error *error) {
    const kt_event *event = &simulation->event[k];
    if (recorder == NULL || !(event->record || event->stop))
        return KT_OK;
    return kt_simulation_record_event(simulation, event, recorder, user, error);
}

/* Applies one event: its action, or the end of the run. */
static kt_status act(kt_simulation *simulation, size_t k, kt_error *error) {
    const kt_event *event = &simulation->event[k];
    kt_error from = {0};
    const double t = kt_integrator_time(simulation->integrator);
    const kt_occurrence what = {.event = event,
                                .time = t,
                                .side = (int)simulation->event_root[k].side,
                                .count = ++simulation->event_memory[k].count};
    const int code = event->action != NULL ? event->action(simulation, &what, &from, event->user) : 0;
    if (code < 0)
        return fail_event(event, "action", t, &from, code, error);
    if (code > 0 || event->stop)
        simulation->memory.stopped = (int64_t)k + 1;
    return KT_OK;
}

/* Renews the sides after actions. An event whose value changed is on the side of its new value. If that value is zero,
 * the next nonzero value decides. */
static kt_status renew_sides(kt_simulation *simulation, kt_error *error) {
    if (simulation->event_time == kt_integrator_time(simulation->integrator))
        return KT_OK;
    const size_t n = simulation->size.event;
    double *before = simulation->event_value + n;
    memcpy(before, simulation->event_value, n * sizeof(double));
    const kt_status status = begin_events(simulation, error);
    for (size_t k = 0; status == KT_OK && k < simulation->event_count; k++)
        if (simulation->event_value[k] != before[k] && k >= kt_simulation_contact_events(simulation))
            simulation->event_memory[k].side = sign_of(simulation->event_value[k]);
    return status;
}

/* Applies one event that is due. If a recorder stops the run at an event, it does not get this event's record again. */
static kt_status fire(kt_simulation *simulation, size_t k, kt_recorder *recorder, void *user, kt_error *error) {
    kt_event_root *root = &simulation->event_root[k];
    const double t = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    if (!root->recorded) {
        root->recorded = true;
        status = hand_over(simulation, k, recorder, user, error);
    }
    if (status != KT_OK)
        return status;
    root->due = root->recorded = false;
    status = act(simulation, k, error);
    if (status != KT_OK || simulation->event_time == t)
        return status;
    status = renew_sides(simulation, error); /* before the record: a checkpoint there holds them */
    return status == KT_OK ? hand_over(simulation, k, recorder, user, error) : status;
}

static kt_status fire_all(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    kt_status status = begin_events(simulation, error); /* the values are missing only after a checkpoint */
    size_t k = 0;
    while (k < simulation->event_count && !simulation->event_root[k].due)
        k++;
    if (status == KT_OK && k < simulation->event_count && !simulation->event_root[k].recorded)
        status = kt_simulation_count_instant(simulation, k, kt_integrator_time(simulation->integrator), error);
    for (; status == KT_OK && k < simulation->event_count; k++)
        if (simulation->event_root[k].due)
            status = fire(simulation, k, recorder, user, error);
    if (status != KT_OK)
        return status;
    simulation->memory.fires = false;
    return renew_sides(simulation, error);
}

const kt_event_watch kt_event_watch_all = {
    .begin = begin_events, .reject_step = reject_event_step, .fire = fire_all, .value = evaluate};
