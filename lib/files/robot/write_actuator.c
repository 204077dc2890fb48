/* Forces by formulas as actuators of MJCF, in a joint of one coordinate or along a path.
 *
 * A force is that of an actuator if it is affine in the length L and its rate, and in an auxiliary state w:
 *     b0 + b1 L + b2 L' + w (g0 + g1 L + g2 L').
 * The rate of w must be constant, an integrator, or (u - w) / T, a filter. The actuator then has the dynamics of w, the
 * bias b and the gain g. A force with several such states is the sum of as many actuators. The values at some
 * positions, rates and states decide whether a formula has this form. A sum of other formulas is one actuator for each,
 * and bounds of such a sum are those of the joint. A factor step(t - D) of the control is a delay D. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"
#include "model/joint_name.h"
#include "robot/write.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* A formula of L, L' and w. */
typedef struct actuator_formula {
    const kt_expression *formula;
    kt_formula_names names;
    int body; /* of the joint; -1: along a path */
    int states[KT_EXPORT_STATES_MOST], state_count;
    const char *text; /* without the bounds */
    bool has_bounds;  /* of the force: then they are `bounds`, without the factor of the text */
    double bounds[2];
    double factor;
    bool has_act_bounds; /* of its state */
    double act_bounds[2];
} actuator_formula;

static int find_actuator_state(const actuator_formula *f, int state) {
    int k = 0;
    while (k < f->state_count && f->states[k] != state)
        k++;
    return k;
}

static double actuator_value(const actuator_formula *f, double length, double rate, const double *states) {
    double at[KT_FORMULA_VARIABLE_MAX] = {0.0};
    for (int k = 0; k < f->names.count; k++) {
        const int type = (int)f->names.variable[k].type;
        at[k] = type == KT_VARIABLE_POSITION || type == KT_VARIABLE_LENGTH ? length
                : type == KT_VARIABLE_STATE ? states[find_actuator_state(f, f->names.variable[k].component)]
                                            : rate;
    }
    return kt_expression_evaluate(f->formula, at);
}

/* Whether the variables are L, L' and some states, which are found. */
static bool find_actuator_variables(actuator_formula *f) {
    for (int k = 0; k < f->names.count; k++) {
        const kt_variable *v = &f->names.variable[k];
        const int type = (int)v->type;
        const bool is_motion = f->body >= 0 ? (type == KT_VARIABLE_POSITION || type == KT_VARIABLE_VELOCITY)
                                            : (type == KT_VARIABLE_LENGTH || type == KT_VARIABLE_SPEED);
        if (type == KT_VARIABLE_STATE && f->state_count < KT_EXPORT_STATES_MOST)
            f->states[f->state_count++] = v->component;
        else if (!is_motion || (f->body >= 0 && v->body != f->body))
            return false;
    }
    return true;
}

static bool parse_actuator(kt_export *x, const char *text, const kt_effect *e, actuator_formula *f) {
    f->names = kt_formula_names_of(x->d, e);
    const kt_symbols symbols = kt_formula_symbols(&f->names);
    f->formula = kt_export_parse(x, text, &symbols);
    return f->formula != NULL;
}

/* The coefficients of a constant, of L and of L', with one state 1 or none. */
static void fit_line(const actuator_formula *f, int state, double c[3]) {
    double states[KT_EXPORT_STATES_MOST] = {0.0};
    if (state >= 0)
        states[state] = 1.0;
    c[0] = actuator_value(f, 0.0, 0.0, states);
    c[1] = actuator_value(f, 1.0, 0.0, states) - c[0];
    c[2] = actuator_value(f, 0.0, 1.0, states) - c[0];
}

/* A difference of two numbers, or zero if it is their rounding. */
static double coefficient_between(double a, double b) {
    return fabs(a - b) > 4.0 * DBL_EPSILON * fabs(b) ? a - b : 0.0;
}

/* Finds b, and g for each state. */
static bool fit_actuator(const actuator_formula *f, double b[3], double g[KT_EXPORT_STATES_MOST][3]) {
    static const double lengths[] = {-7.0, 0.02, 0.37, 1.7, 13.0}, rates[] = {-50.0, -0.4, 0.02, 5.3, 80.0},
                        values[] = {-9.0, -0.3, 0.4, 1.0, 30.0};
    fit_line(f, -1, b);
    for (int k = 0; k < f->state_count; k++) {
        fit_line(f, k, g[k]);
        for (int i = 0; i < 3; i++)
            g[k][i] = coefficient_between(g[k][i], b[i]);
    }
    for (int i = 0; i < 125; i++) {
        const double motion[] = {1.0, lengths[i % 5], rates[i / 5 % 5]};
        double states[KT_EXPORT_STATES_MOST] = {0.0}, sum = 0.0, size = 0.0;
        for (int k = -1; k < f->state_count; k++) {
            const double w = k < 0 ? 1.0 : values[(i / 25 + k + k * i) % 5], *c = k < 0 ? b : g[k];
            if (k >= 0)
                states[k] = w;
            for (int n = 0; n < 3; n++) {
                sum += w * c[n] * motion[n];
                size += fabs(w * c[n] * motion[n]);
            }
        }
        if (!(fabs(actuator_value(f, motion[1], motion[2], states) - sum) <= 1e-12 * size))
            return false;
    }
    return true;
}

/* ---- bounds ------------------------------------------------------------------------------------------------------ */

/* The position of the parenthesis that closes the one at `open`; NULL if there is none. */
static const char *find_partner(const char *open) {
    int depth = 0;
    for (const char *at = open; *at != '\0'; at++) {
        depth += *at == '(' ? 1 : *at == ')' ? -1 : 0;
        if (depth == 0)
            return at;
    }
    return NULL;
}

/* Reads "clamp(INNER, a, b)", "min(INNER, b)" or "max(INNER, a)" at the beginning of a text. Moves behind it, and
 * *inner to its first argument, which ends at *stop. False if it is none of them. */
static bool read_bounded(const char **at, const char **inner, const char **stop, double bounds[2]) {
    const char *text = *at, *open = strchr(text, '('), *close = open != NULL ? find_partner(open) : NULL;
    const bool is_clamp = strncmp(text, "clamp(", 6) == 0, is_min = strncmp(text, "min(", 4) == 0;
    if (close == NULL || !(is_clamp || is_min || strncmp(text, "max(", 4) == 0))
        return false;
    int commas = 0, depth = 0;
    const char *parts[2] = {NULL, NULL};
    for (const char *c = open + 1; c < close; c++) {
        depth += *c == '(' ? 1 : *c == ')' ? -1 : 0;
        if (*c == ',' && depth == 0 && commas < 2)
            parts[commas] = c;
        commas += *c == ',' && depth == 0;
    }
    if (commas != (is_clamp ? 2 : 1))
        return false;
    bounds[0] = (double)-INFINITY;
    bounds[1] = (double)INFINITY;
    for (int i = 0; i < commas; i++) {
        char *end = NULL;
        bounds[is_clamp ? i : is_min] = strtod(parts[i] + 1, &end);
        if (end == parts[i] + 1 || end != (i + 1 < commas ? parts[i + 1] : close))
            return false;
    }
    *inner = open + 1;
    *stop = parts[0];
    *at = close + 1;
    return bounds[0] < bounds[1];
}

/* Removes the bounds of the activation: "clamp(w, a, b)" becomes "(w)". False if there are several. */
static bool strip_activation(kt_export *x, char *text, actuator_formula *f) {
    static const char *const words[] = {"clamp(", "min(", "max("};
    for (int k = 0; k < x->d->state_count; k++) {
        const char *name = x->d->states[k].name;
        const size_t length = strlen(name);
        for (size_t n = 0; n < 3; n++)
            for (char *found = strstr(text, words[n]); found != NULL; found = strstr(found + 1, words[n])) {
                const char *at = found, *inner, *stop;
                double bounds[2];
                if (!read_bounded(&at, &inner, &stop, bounds) || (size_t)(stop - inner) != length ||
                    strncmp(inner, name, length) != 0)
                    continue;
                if (f->has_act_bounds || strstr(at, name) != NULL)
                    return false;
                f->has_act_bounds = true;
                memcpy(f->act_bounds, bounds, sizeof bounds);
                found[0] = '(';
                memmove(found + 1, inner, length);
                found[length + 1] = ')';
                memmove(found + length + 2, at, strlen(at) + 1);
            }
    }
    return true;
}

/* Finds the text without the bounds of "G*clamp(INNER, a, b)", and without those of an activation. */
static bool strip_bounds(kt_export *x, const char *text, actuator_formula *f) {
    const size_t size = strlen(text) + 3;
    char *copy = kt_pool_take(&x->pool, size, 1), *behind = NULL;
    const char *inner, *stop, *last = text + strlen(text);
    if (copy == NULL)
        return false;
    f->text = copy;
    if (text[0] == '(' && find_partner(text) == last - 1) {
        text++;
        last--;
    }
    f->factor = strtod(text, &behind);
    const char *at = behind != text && *behind == '*' ? behind + 1 : text, *first = at;
    f->factor = at != text ? f->factor : 1.0;
    if (read_bounded(&at, &inner, &stop, f->bounds) && at == last) {
        f->has_bounds = true;
        (void)snprintf(copy, size, "%.*s(%.*s)", (int)(first - text), text, (int)(stop - inner), inner);
    } else {
        (void)snprintf(copy, size, "%.*s", (int)(last - text), text);
    }
    return strip_activation(x, copy, f);
}

/* ---- delays ------------------------------------------------------------------------------------------------------ */

/* A text with factors "*step(t - D)": after the delay D without them, and before it with zeros in their place. */
typedef struct delayed_text {
    const char *late, *early;
    double delay; /* 0: there is none */
} delayed_text;

/* False if there are several delays, there is no memory, or no text: a state whose rate the law of an effect writes. */
static bool split_delay(kt_export *x, const char *text, delayed_text *to) {
    static const char factor[] = "*step(t - ";
    *to = (delayed_text){.late = NULL};
    if (text == NULL)
        return false;
    char *late = kt_pool_take(&x->pool, strlen(text) + 1, 1), *early = kt_pool_take(&x->pool, strlen(text) + 1, 1);
    *to = (delayed_text){late, early, 0.0};
    if (late == NULL || early == NULL)
        return false;
    for (const char *found; (found = strstr(text, factor)) != NULL;) {
        char *end = NULL;
        const double delay = strtod(found + strlen(factor), &end);
        if (*end != ')' || !(delay > 0.0) || (to->delay > 0.0 && delay != to->delay))
            return false;
        to->delay = delay;
        memcpy(late, text, (size_t)(found - text));
        memcpy(early, text, (size_t)(found - text));
        late += found - text;
        early += found - text;
        *early++ = '*';
        *early++ = '0';
        text = end + 1;
    }
    memcpy(late, text, strlen(text) + 1);
    memcpy(early, text, strlen(text) + 1);
    return true;
}

/* ---- which effects are actuators --------------------------------------------------------------------------------- */

/* The value of a rate at w = 0, and its slope; false if it is not affine in its own state. */
static bool fit_rate(kt_export *x, const char *text, int state, double *constant, double *slope) {
    static const double states[] = {-9.0, -0.3, 0.4, 2.0, 30.0};
    const kt_effect none = kt_effect_default();
    actuator_formula f = {.body = -1};
    if (!parse_actuator(x, text, &none, &f) || !find_actuator_variables(&f) || f.state_count > 1 ||
        (f.state_count == 1 && f.states[0] != state))
        return false;
    *constant = actuator_value(&f, 0.0, 0.0, &(double){0.0});
    *slope = actuator_value(&f, 0.0, 0.0, &(double){1.0}) - *constant;
    for (size_t i = 0; i < sizeof states / sizeof *states; i++)
        if (!(fabs(actuator_value(&f, 0.0, 0.0, &states[i]) - *constant - *slope * states[i]) <=
              1e-12 * (fabs(*constant) + fabs(*slope * states[i]))))
            return false;
    return true;
}

/* Finds the control, its delay and the time constant of a state, or its rate; false if it follows another law. */
static bool find_actuator_dynamics(kt_export *x, kt_export_actuator *to) {
    delayed_text text;
    double late, early, by_state[2];
    if (!split_delay(x, x->d->states[to->state].rate, &text) ||
        !fit_rate(x, text.late, to->state, &late, &by_state[0]) ||
        !fit_rate(x, text.early, to->state, &early, &by_state[1]) ||
        (text.delay > 0.0 && (early != 0.0 || by_state[0] != by_state[1])))
        return false;
    to->delay = text.delay;
    to->time = by_state[0] != 0.0 ? -1.0 / by_state[0] : 0.0;
    to->control = by_state[0] != 0.0 ? late * to->time : late;
    return to->time >= 0.0;
}

/* A tendon is shorter than the position of its slider by an offset. */
static void shift_actuator(const kt_export *x, kt_export_actuator *d) {
    double own;
    if (d->body < 0 || x->role[d->body] != KT_EXPORT_SUM)
        return;
    const double offset = kt_export_number_offset(x, d->body, &own);
    d->bias[0] += d->bias[1] * offset;
    d->gain[0] += d->gain[1] * offset;
}

/* Whether a muscle has the force and the rate of its formulas, in and beyond its range. */
static bool agrees_with_muscle(kt_export *x, const actuator_formula *f, const char *rate_text,
                               const kt_export_muscle *m) {
    static const double lengths[] = {-0.3, 0.4, 0.63, 0.8, 0.97, 1.0, 1.1, 1.26, 1.4, 1.9},
                        speeds[] = {-1.4, -0.7, -0.1, 0.0, 0.15, 0.4, 2.0}, values[] = {0.0, 0.13, 0.5, 0.8, 1.0, 1.3};
    const kt_effect none = kt_effect_default();
    const double most = fabs(m->gear) * m->force;
    actuator_formula rate = {.body = -1};
    if (!parse_actuator(x, rate_text, &none, &rate) || !find_actuator_variables(&rate) || rate.state_count != 1 ||
        rate.states[0] != f->states[0])
        return false;
    for (size_t i = 0; i < 420; i++) {
        const double length = (lengths[i % 10] - m->offset) / m->slope, speed = speeds[i / 10 % 7] / m->rate;
        const double w = values[i / 70], size = fabs(length * m->slope) + fabs(m->offset) + 1.0;
        const double force = kt_export_muscle_force(m, length, speed, w), own = kt_export_muscle_rate(m, w);
        if (!(fabs(actuator_value(f, length, speed, &w) - force) <= 1e-11 * most * size * (1.0 + m->passive)) ||
            !(fabs(actuator_value(&rate, 0.0, 0.0, &w) - own) <= 1e-12 * (fabs(own) + 1.0 / m->times[0])))
            return false;
    }
    return true;
}

/* Adds the actuators of an effect. */
static bool add_actuators(kt_export *x, const kt_effect *e, kt_export_actuator *made, int count) {
    const bool is_path = e->end_count == 2;
    const bool has_rope = x->rope_count > 0 && x->ropes[x->rope_count - 1].effect == e;
    if (x->actuator_count + count > KT_EXPORT_STATES_MOST * x->d->effect_count ||
        (is_path && !has_rope && !kt_export_add_rope(x, e)))
        return false;
    for (int k = 0; k < count; k++) {
        made[k].rope = is_path ? x->rope_count - 1 : -1;
        if (made[k].state >= 0)
            x->is_kept[made[k].state] = true;
        x->actuators[x->actuator_count++] = made[k];
    }
    return true;
}

/* Whether an effect is the only one that drives its joint, of which MuJoCo can bound the sum of actuators. Those of
 * tendons and paths may count in this sum, too. */
static bool drives_alone(const kt_export *x, const kt_effect *e) {
    int count = 0;
    for (int i = 0; i < x->d->effect_count; i++) {
        const kt_effect *other = &x->d->effects[i];
        if (other->type != KT_EFFECT_EXPRESSION && other->type != KT_EFFECT_MOTOR && other->type != KT_EFFECT_SERVO)
            continue;
        const int body = other->joint != NULL ? kt_export_scalar(x, other->joint) : -1;
        if (other->end_count == 2 || (body >= 0 && x->role[body] == KT_EXPORT_SUM))
            return false;
        count += other->joint != NULL && e->joint != NULL && strcmp(other->joint, e->joint) == 0;
    }
    return count == 1 && e->end_count != 2 && x->role[kt_export_scalar(x, e->joint)] != KT_EXPORT_SUM;
}

static void keep_bounds(const actuator_formula *f, double factor, kt_export_actuator *to) {
    for (int i = 0; i < 2; i++) {
        to->force_range[i] = factor * kt_export_bound(f->bounds[factor < 0.0 ? 1 - i : i]);
        to->act_range[i] = kt_export_bound(f->act_bounds[i]);
    }
    to->has_force_range = f->has_bounds;
    to->has_act_range = f->has_act_bounds;
}

/* A muscle in the slider of a tendon would need other numbers: an import makes none. */
static bool take_muscle(kt_export *x, const kt_effect *e, const actuator_formula *f, bool is_first) {
    kt_export_muscle read, resting, *muscle = NULL;
    delayed_text rate;
    if (f->state_count != 1 || (f->body >= 0 && x->role[f->body] == KT_EXPORT_SUM) ||
        !split_delay(x, x->d->states[f->states[0]].rate, &rate) || !kt_export_read_muscle(f->text, rate.late, &read) ||
        !agrees_with_muscle(x, f, rate.late, &read) || (muscle = kt_pool_take(&x->pool, 1, sizeof *muscle)) == NULL)
        return false;
    resting = read;
    resting.control = 0.0;
    if (rate.delay > 0.0 && !agrees_with_muscle(x, f, rate.early, &resting))
        return false;
    *muscle = read;
    kt_export_actuator made = {.effect = e,
                               .body = f->body,
                               .state = f->states[0],
                               .is_first = is_first,
                               .control = read.control,
                               .delay = rate.delay,
                               .muscle = muscle};
    keep_bounds(f, f->factor / read.gear, &made); /* MuJoCo bounds the force before the gear */
    return add_actuators(x, e, &made, 1);
}

/* The part of the bias that a delay leaves out is the control; `early`: the formula before the delay. */
static bool find_delayed_control(const actuator_formula *early, double delay, kt_export_actuator *to) {
    double bias[3], gain[KT_EXPORT_STATES_MOST][3];
    if (to->state >= 0 || !fit_actuator(early, bias, gain))
        return false;
    for (int i = 1; i < 3; i++)
        if (fabs(bias[i] - to->bias[i]) > 1e-14 * (fabs(to->bias[0]) + fabs(bias[i])))
            return false;
    to->delay = delay;
    to->control = to->bias[0] - bias[0];
    memcpy(to->bias, bias, sizeof bias);
    to->gain[0] = 1.0;
    return true;
}

static bool take_affine(kt_export *x, const kt_effect *e, const actuator_formula *f, const actuator_formula *early,
                        double delay, bool is_first) {
    kt_export_actuator made[KT_EXPORT_STATES_MOST] = {0};
    double bias[3], gain[KT_EXPORT_STATES_MOST][3];
    const int count = f->state_count > 0 ? f->state_count : 1;
    if (!fit_actuator(f, bias, gain) || ((f->has_bounds || f->has_act_bounds) && count > 1))
        return false;
    for (int k = 0; k < count; k++) {
        kt_export_actuator *a = &made[k];
        *a = (kt_export_actuator){.effect = e, .body = f->body, .is_first = is_first && k == 0};
        a->state = f->state_count > 0 ? f->states[k] : -1;
        for (int i = 0; i < 3; i++) {
            a->bias[i] = k == 0 ? bias[i] : 0.0;
            a->gain[i] = a->state >= 0 ? gain[k][i] : 0.0;
        }
        if ((a->state >= 0 && !find_actuator_dynamics(x, a)) || (delay > 0.0 && !find_delayed_control(early, delay, a)))
            return false;
        shift_actuator(x, a);
        keep_bounds(f, f->factor, a);
    }
    return add_actuators(x, e, made, count);
}

/* Adds the actuators of a formula, one term of the force of an effect; false if it is none. */
static bool take_term(kt_export *x, const kt_effect *e, const char *text, bool is_first) {
    actuator_formula f = {.body = e->end_count == 2 ? -1 : kt_export_scalar(x, e->joint)}, early;
    delayed_text parts;
    if (!strip_bounds(x, text, &f) || !split_delay(x, f.text, &parts))
        return false;
    early = f;
    f.text = parts.late;
    early.text = parts.early;
    return parse_actuator(x, f.text, e, &f) && find_actuator_variables(&f) &&
           parse_actuator(x, early.text, e, &early) && find_actuator_variables(&early) &&
           (take_affine(x, e, &f, &early, parts.delay, is_first) ||
            (parts.delay == 0.0 && take_muscle(x, e, &f, is_first)));
}

/* The end of the first term of a sum: " + " outside of all parentheses; NULL: there is one term. */
static char *find_plus(char *text) {
    int depth = 0;
    for (char *at = text; *at != '\0'; at++) {
        depth += *at == '(' ? 1 : *at == ')' ? -1 : 0;
        if (depth == 0 && strncmp(at, " + ", 3) == 0)
            return at;
    }
    return NULL;
}

/* A copy of the sum in "clamp(SUM, a, b)" or "(SUM)", with its bounds, which are infinite of the second. */
static char *copy_sum(kt_export *x, const char *text, double bounds[2]) {
    const char *inner, *stop, *at = text;
    if (!read_bounded(&at, &inner, &stop, bounds) || *at != '\0') {
        inner = text;
        stop = text + strlen(text);
        bounds[0] = (double)-INFINITY;
        bounds[1] = (double)INFINITY;
        if (text[0] == '(' && find_partner(text) == stop - 1) {
            inner++;
            stop--;
        }
    }
    char *copy = kt_pool_take(&x->pool, (size_t)(stop - inner) + 1, 1);
    if (copy != NULL)
        memcpy(copy, inner, (size_t)(stop - inner));
    return copy;
}

/* Whether one of the first actuators has a state. */
static bool has_state(const kt_export *x, int count, int state) {
    for (int i = 0; i < count; i++)
        if (x->actuators[i].state == state)
            return true;
    return false;
}

/* Adds the actuators of each term of a sum; none if one of them is no actuator. */
static bool take_sum(kt_export *x, const kt_effect *e) {
    const int before = x->actuator_count, ropes = x->rope_count;
    double bounds[2];
    char *text = copy_sum(x, e->formula[0], bounds);
    const bool is_bounded = isfinite(bounds[0]) || isfinite(bounds[1]);
    bool is_taken = text != NULL && find_plus(text) != NULL && !(is_bounded && !drives_alone(x, e));
    for (char *plus = NULL; is_taken && text != NULL; text = plus != NULL ? plus + 3 : NULL) {
        plus = find_plus(text);
        if (plus != NULL)
            *plus = '\0';
        is_taken = take_term(x, e, text, x->actuator_count == before);
    }
    for (int i = before; i < x->actuator_count && !is_taken; i++)
        if (x->actuators[i].state >= 0)
            x->is_kept[x->actuators[i].state] = has_state(x, before, x->actuators[i].state);
    x->actuator_count = is_taken ? x->actuator_count : before;
    x->rope_count = is_taken ? x->rope_count : ropes;
    for (int i = 0; i < 2 && is_taken && is_bounded; i++)
        x->forces[kt_export_scalar(x, e->joint)].range[i] = kt_export_bound(bounds[i]);
    return is_taken;
}

/* A force with bounds that is all of its joint: the joint's bounds are these, and not its effort, which is data. */
static bool take_alone(kt_export *x, const kt_effect *e) {
    if (!take_term(x, e, e->formula[0], true))
        return false;
    const kt_export_actuator *last = &x->actuators[x->actuator_count - 1];
    const double gear = last->muscle != NULL ? last->muscle->gear : 1.0;
    if (last->has_force_range && last->body >= 0 && isfinite(kt_export_body(x, last->body)->joint.limits.effort) &&
        drives_alone(x, e))
        for (int i = 0; i < 2; i++)
            x->forces[last->body].range[i] = gear * last->force_range[gear < 0.0 ? 1 - i : i];
    return true;
}

bool kt_export_take_actuator(kt_export *x, const kt_effect *e) {
    const bool is_path = e->end_count == 2;
    return e->type == KT_EFFECT_EXPRESSION && e->law == NULL && e->end_count != 1 &&
           (is_path || kt_export_scalar(x, e->joint) >= 0) && e->formula[0] != NULL &&
           (take_alone(x, e) || take_sum(x, e));
}

/* ---- actuators --------------------------------------------------------------------------------------------------- */

/* MuJoCo keeps the controls of its last `nsample` steps. There are as many as the delay has steps of this length. */
static const double buffer_step = 1e-4;

static void write_formula_actuator(kt_export *x, const kt_export_actuator *d) {
    kt_export_print(x, "    <%s", d->muscle != NULL ? "muscle" : "general");
    if (d->effect->name != NULL && d->is_first)
        kt_export_print(x, " name=\"%s\"", d->effect->name);
    if (d->rope >= 0)
        kt_export_rope_name(x, "tendon", d->rope);
    else
        kt_export_print(x, " %s=\"%s\"", x->role[d->body] == KT_EXPORT_SUM ? "tendon" : "joint",
                        kt_joint_name_of(kt_export_body(x, d->body)));
    if (d->has_force_range)
        kt_export_numbers(x, "forcerange", d->force_range, 2);
    if (d->has_act_range)
        kt_export_numbers(x, "actrange", d->act_range, 2);
    if (d->body >= 0 && isfinite(kt_export_body(x, d->body)->joint.limits.effort) &&
        !kt_export_has_force_range(&x->forces[d->body]))
        kt_export_lose(x, KT_EXPORT_EFFORTS);
    if (d->delay > 0.0)
        kt_export_print(x, " delay=\"%g\" nsample=\"%d\"", d->delay,
                        (int)fmin(ceil(d->delay / buffer_step) + 1.0, 16777216.0));
    if (d->muscle != NULL) {
        kt_export_write_muscle(x, d->muscle);
        return;
    }
    if (d->state >= 0)
        kt_export_print(x, " dyntype=\"%s\" gaintype=\"affine\"", d->time > 0.0 ? "filterexact" : "integrator");
    if (d->time > 0.0)
        kt_export_print(x, " dynprm=\"%g\"", d->time);
    kt_export_numbers(x, "gainprm", d->gain, d->state >= 0 ? 3 : 1);
    kt_export_print(x, " biastype=\"affine\" biasprm=\"%g %g %g\"/>\n", d->bias[0], d->bias[1], d->bias[2]);
}

void kt_export_formula_actuators(kt_export *x) {
    for (int i = 0; i < x->actuator_count; i++)
        write_formula_actuator(x, &x->actuators[i]);
}
