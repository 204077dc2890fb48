/* The first root of one event's function g(t, q, v) in a panel of a step.
 *
 * A panel has five samples of g. If two neighbouring samples differ in sign, a root lies between them. If, among three
 * samples of one sign, the middle sample is nearest to zero, the vertex of their parabola is sampled, too. Thus two
 * roots between neighbouring samples are found if the parabola shows both.
 *
 * The first root in the event's direction is enclosed with ITP, to four units of rounding of the time. Source:
 * Oliveira, Takahashi 2021, "An enhancement of the bisection method average performance preserving minmax optimality".
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation/event_root.h"
#include "base/where.h"
#include "integrator/integrator.h"
#include "simulation/response.h"

#include <string.h>

/* Samples with the vertices of parabolas; vertices at three samples; values of vertices in a panel. */
enum { SAMPLES_MOST = KT_EVENT_SAMPLES + 3, VERTICES = 4, PARABOLAS = (KT_EVENT_SAMPLES - 2) * VERTICES };

/* Reactions below this part of the largest along a step are rounding. */
static const double nothing = 1e-9;

double kt_event_extent_of_times(const kt_simulation *simulation, double t) {
    return fmax(fabs(t), DBL_EPSILON * fabs(simulation->events.end));
}

double kt_event_least_width(const kt_simulation *simulation, double t) {
    return kt_time_width(kt_event_extent_of_times(simulation, t));
}

/* ---- the function ------------------------------------------------------------------------------------------------ */

kt_status kt_event_fail(const kt_event *event, const char *what, double t, const kt_error *from, int code,
                        kt_error *error) {
    kt_where_text where = kt_where_at("event", event->name, t);
    if (from->code != KT_OK && strncmp(from->where, "t = ", 4) == 0)
        where = kt_where_format("event '%.60s' at %s", event->name, from->where);
    else if (from->code != KT_OK && from->where[0] != '\0') /* the joint, body or loop that a call of it has named */
        where = kt_where_format("event '%.60s' at t = %.9g s, %s", event->name, t, from->where);
    return from->code != KT_OK ? kt_error_set(error, from->code, where.text, "%s", from->message)
                               : kt_error_set(error, KT_ERROR_CALLBACK, where.text, "its %s returned %d", what, code);
}

kt_status kt_event_evaluate(kt_simulation *simulation, size_t k, double t, const double *y, double *value,
                            kt_error *error) {
    const kt_event *event = &simulation->events.list[k];
    kt_error from = {0};
    kt_instant at = {.model = simulation->model, .data = simulation->data, .t = t, .q = y};
    at.v = y + simulation->size.nq;
    at.x = at.v + simulation->size.nv;
    kt_simulation_use_states(simulation, y);
    at.tau = simulation->memory.now.torque ? simulation->torque : NULL;
    at.external = simulation->memory.now.wrenches ? simulation->wrench : NULL;
    simulation->cached = KT_CACHED_NOTHING; /* data are the function's scratch */
    simulation->events.search[k].spent++;
    const int code = event->function(&at, value, &from, event->user);
    if (code == KT_EVENT_HOLDS && t < kt_integrator_time(simulation->integrator)) {
        *value = simulation->events.value[KT_EVENT_SAMPLES * simulation->size.event + k];
        return KT_OK;
    }
    if (code != 0 || isnan(*value)) {
        if (code == 0)
            (void)kt_error_set(&from, KT_ERROR_NOT_FINITE, NULL, "its value is NaN");
        return kt_event_fail(event, "function", t, &from, code, error);
    }
    return KT_OK;
}

bool kt_event_is_watched(const kt_simulation *simulation, size_t k) {
    const uint64_t limit = simulation->events.list[k].limit;
    const bool is_stepped = simulation->steps_over_contacts && k < kt_simulation_contact_events(simulation);
    return !is_stepped && !simulation->event_memory[k].off && (limit == 0 || simulation->event_memory[k].count < limit);
}

kt_status kt_event_evaluate_all(kt_simulation *simulation, double t, const double *y, double *values, kt_error *error) {
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && k < simulation->events.count; k++)
        if (kt_event_is_watched(simulation, k))
            status = kt_event_evaluate(simulation, k, t, y, &values[k], error);
    return status;
}

/* ---- the first root in a panel ----------------------------------------------------------------------------------- */

typedef struct sample {
    double t, g; /* the event's value at a time */
} sample;

static kt_status event_value_at(kt_simulation *simulation, size_t k, double t, sample *to, kt_error *error) {
    const kt_status status = kt_simulation_between(simulation, t, error);
    to->t = t;
    return status == KT_OK ? kt_event_evaluate(simulation, k, t, simulation->y, &to->g, error) : status;
}

/* The gap of two spheres has a kink where they pass each other. With b = 2 (R + r), g (g + b) = |d|^2 - (R + r)^2 has
 * no kink, but the sign of g. The product is a parabola if the spheres move uniformly. */
static double kink_of(const kt_simulation *simulation, size_t k) {
    return k < simulation->contact_count ? simulation->events.source->kink(simulation, k) : 0.0;
}

static double smooth_value(const sample *s, double kink) { return kink > 0.0 ? s->g * (s->g + kink) : s->g; }

/* The time at which the parabola through three samples of one sign comes nearest to zero. Returns false unless that
 * time is between them. */
static bool vertex_of(const sample *a, const sample *m, const sample *b, double kink, double *t) {
    const double middle = smooth_value(m, kink), left = (middle - smooth_value(a, kink)) / (m->t - a->t),
                 right = (smooth_value(b, kink) - middle) / (b->t - m->t);
    const double curvature = (right - left) / (b->t - a->t);
    if (!(curvature * kt_sign_of(m->g) > 0.0))
        return false;
    *t = 0.5 * (a->t + m->t) - 0.5 * left / curvature;
    return a->t < *t && *t < b->t && *t != m->t;
}

/* Searches a sample of another sign between three samples of one sign, at the vertices of parabolas. */
static kt_status find_hidden(kt_simulation *simulation, size_t k, sample a, sample m, sample b, sample *hidden,
                             bool *found, kt_error *error) {
    const int side = kt_sign_of(m.g);
    const double kink = kink_of(simulation, k);
    double t;
    *found = false;
    for (int i = 0; i < VERTICES && vertex_of(&a, &m, &b, kink, &t); i++) {
        sample v;
        const kt_status status = event_value_at(simulation, k, t, &v, error);
        if (status != KT_OK)
            return status;
        if (kt_sign_of(v.g) == -side) {
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

static int insert_sample(sample *samples, int count, sample new) {
    int i = count;
    for (; i > 0 && samples[i - 1].t > new.t; i--)
        samples[i] = samples[i - 1];
    samples[i] = new;
    return count + 1;
}

/* Clears values of rounding at the beginning of a panel. A step that ended at the root may have left such a value on
 * the side before the event. With its present rate, g reaches the other side within the same instant. Until then,
 * values that are not farther from zero are rounding, too, and count as on the other side. For contacts, such values
 * are penetration instead. Returns the size of the rounding. */
static double clear_panel_rounding(const kt_simulation *simulation, size_t k, sample *base) {
    const int from = simulation->events.search[k].side;
    const double left = fabs(base[0].g), reach = fabs(base[1].g - base[0].g) * kt_event_together(simulation, base[0].t);
    if (from == 0 || kt_sign_of(base[0].g) == from)
        return 0.0;
    base[0].g = from * DBL_MIN;
    if (k < kt_simulation_contact_events(simulation) || !(left * (base[1].t - base[0].t) <= reach))
        return 0.0;
    for (int j = 1; j < KT_EVENT_SAMPLES && kt_sign_of(base[j].g) == -from && fabs(base[j].g) <= left; j++)
        base[j].g = from * DBL_MIN;
    return left;
}

/* Whether the search of the step may still take the values of a panel's parabolas. */
static bool has_values_left(const kt_simulation *simulation, size_t k) {
    return simulation->events.search[k].spent + PARABOLAS <= simulation->events.most;
}

/* Lists the samples of event k along a panel, with the samples that parabolas add. */
static kt_status place_samples(kt_simulation *simulation, size_t k, const double *times, sample *samples, int *count,
                               kt_error *error) {
    sample base[KT_EVENT_SAMPLES];
    kt_status status = KT_OK;
    for (int j = 0; j < KT_EVENT_SAMPLES; j++)
        base[j] = (sample){times[j], simulation->events.value[(size_t)j * simulation->size.event + k]};
    const double left = clear_panel_rounding(simulation, k, base);
    memcpy(samples, base, sizeof base);
    *count = KT_EVENT_SAMPLES;
    for (int j = 1; status == KT_OK && j + 1 < KT_EVENT_SAMPLES; j++) {
        const int side = kt_sign_of(base[j].g);
        sample hidden = base[j];
        bool found;
        if (!has_values_left(simulation, k) || side == 0 || kt_sign_of(base[j - 1].g) != side ||
            kt_sign_of(base[j + 1].g) != side)
            continue;
        status = find_hidden(simulation, k, base[j - 1], base[j], base[j + 1], &hidden, &found, error);
        if (status == KT_OK && found && !(fabs(hidden.g) <= left))
            *count = insert_sample(samples, *count, hidden);
    }
    return status;
}

/* Finds the root of g - threshold between a and b: the end of an interval of the least width in which the sign changes.
 * Method: ITP.
 *
 *    kappa_1 = 0.2 / (b - a), kappa_2 = 2, n_0 = 1 */
static kt_status enclose_root(kt_simulation *simulation, size_t k, double threshold, sample a, sample b, double *root,
                              kt_error *error) {
    a.g -= threshold;
    b.g -= threshold;
    const int side = kt_sign_of(b.g);
    const double width = fmax(kt_event_least_width(simulation, b.t), DBL_MIN), kappa = 0.2 / (b.t - a.t);
    double radius = width * exp2(ceil(log2((b.t - a.t) / width)));
    for (int i = 0; i < KT_EVENT_ROOT_STEPS && b.t - a.t > width; i++) {
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
        const kt_status status = event_value_at(simulation, k, t, &m, error);
        if (status != KT_OK)
            return status;
        m.g -= threshold;
        *(kt_sign_of(m.g) == side ? &b : &a) = m;
        radius *= 0.5;
    }
    *root = b.t;
    return KT_OK;
}

/* Whether forces that jump at the beginning of the step have made the reaction of contact k negative there, beyond
 * rounding. This instant is times[0]. */
static bool is_negative_at_once(const kt_simulation *simulation, size_t k, const double *times) {
    const kt_event_search *search = &simulation->events.search[k];
    const double first = simulation->events.value[k]; /* of sample 0, at times[0] */
    return kt_simulation_has_jumped(simulation) && k < kt_simulation_contact_events(simulation) && search->side > 0 &&
           times[0] == kt_integrator_previous_time(simulation->integrator) && first < -nothing * search->size;
}

double kt_event_depth(const kt_simulation *simulation, size_t k) {
    if (k >= kt_simulation_contact_events(simulation))
        return -HUGE_VAL;
    const double begin = simulation->events.value[KT_EVENT_SAMPLES * simulation->size.event + k]; /* of the step */
    const double margin = simulation->events.source->margin(simulation, k);
    return begin > -margin ? -margin : begin - 0.5 * margin;
}

kt_status kt_event_find_root(kt_simulation *simulation, size_t k, const double *times, double *root, int *side,
                             kt_error *error) {
    sample samples[SAMPLES_MOST];
    int count, from = simulation->events.search[k].side;
    const kt_status status = place_samples(simulation, k, times, samples, &count, error);
    const double depth = kt_event_depth(simulation, k);
    *root = HUGE_VAL;
    if (status == KT_OK && is_negative_at_once(simulation, k, times)) {
        *root = times[0];
        *side = -1;
        return KT_OK;
    }
    for (int i = 1; status == KT_OK && i < count; i++) {
        const int to = kt_sign_of(samples[i].g);
        if (from < 0 && samples[i].g < depth) {
            *side = -1;
            return enclose_root(simulation, k, depth, samples[i - 1], samples[i], root, error);
        }
        if (to == 0 || to == from)
            continue;
        const kt_direction direction = simulation->events.list[k].direction;
        const bool fits = direction == KT_DIRECTION_EITHER || (direction == KT_DIRECTION_RISING) == (to > 0);
        const bool counts = from != 0 && fits;
        from = to;
        if (!counts)
            continue;
        *side = to;
        return enclose_root(simulation, k, 0.0, samples[i - 1], samples[i], root, error);
    }
    simulation->events.search[k].side = from;
    return status;
}
