/* Actuators and polynomial springs as formulas of their effects (kinetree/effect.h).
 *
 * The force of an actuator along its length L is g f with the gear g, and f clamped to [lower, upper]:
 *     f = w (g0 + g1 g L + g2 g L') + b0 + b1 g L + b2 g L'.
 * Without an activation and a delay, w is a number u, and f is the clamp of c0 + c1 g L + c2 g L' with c = u g + b. If
 * the sum S = sum f of the actuators of a tendon has bounds l < 0 < u, each f has the factor u/max(u, S) l/min(l, S).
 * The force in a joint is the sum of dL/dq g f, clamped to the bounds of the effect.
 *
 * Compilation reads these formulas, so that derivatives, lanes and generated code follow from the numbers, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/actuator.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- defaults ---------------------------------------------------------------------------------------------------- */

kt_actuator kt_actuator_default(void) {
    const double none = (double)INFINITY;
    return (kt_actuator){.gear = 1.0,
                         .gain = {1.0},
                         .control_lower = -none,
                         .control_upper = none,
                         .activation_lower = -none,
                         .activation_upper = none,
                         .lower = -none,
                         .upper = none,
                         .sum_lower = -none,
                         .sum_upper = none};
}

kt_muscle kt_muscle_default(void) {
    return (kt_muscle){
        .range = {0.75, 1.05}, .shortest = 0.5, .longest = 1.6, .speed = 1.5, .passive = 1.3, .stretched = 1.2};
}

kt_activation kt_activation_default(void) {
    return (kt_activation){.control_lower = -(double)INFINITY, .control_upper = (double)INFINITY};
}

kt_polynomial_spring kt_polynomial_spring_default(void) {
    return (kt_polynomial_spring){.factor = 1.0, .smoothing = 1e-3};
}

/* ---- parts ------------------------------------------------------------------------------------------------------- */

/* Writes "clamp(", "min(", "max(" or "(", according to the finite bounds; at the end, the bounds and ")". */
static void put_bounded(kt_formula_text *to, double lower, double upper, bool begins) {
    const double bounds[2] = {lower, upper};
    const bool is_below = !isinf(upper), is_above = !isinf(lower);
    if (begins) {
        kt_formula_put(to, is_below && is_above ? "clamp(" : is_below ? "min(" : is_above ? "max(" : "(");
        return;
    }
    for (int i = 0; i < 2; i++)
        if (!isinf(bounds[i]))
            kt_formula_print(to, ", %g", bounds[i]);
    kt_formula_put(to, ")");
}

/* Writes a factor, unless it is 1, and a position or velocity: that of the effect's joint, or of term k. */
static void put_coordinate(const kt_actuator *a, int index, int k, double factor, bool is_rate, kt_formula_text *to) {
    if (factor != 1.0)
        kt_formula_print(to, "%g*", factor);
    if (a->term_count > 0)
        kt_formula_print(to, "%s%d_%d", is_rate ? "v" : "p", index, k);
    else
        kt_formula_put(to, is_rate ? "v" : "p");
}

/* "2 + -5*p + -1*v" of c0 + c1 L + c2 L'. In a joint L = sum of coefficient * position of the actuator's terms. */
static void put_affine(const kt_effect *e, int index, const double c[3], kt_formula_text *to) {
    const kt_actuator *a = &e->actuators[index];
    const bool is_path = e->end_count == 2, is_constant = c[0] != 0.0 || (c[1] == 0.0 && c[2] == 0.0);
    const int count = e->end_count > 0 ? 0 : a->term_count > 0 ? a->term_count : 1;
    const size_t first = to->length;
    if (is_constant)
        kt_formula_print(to, "%g", c[0]);
    for (int k = 0; k < 2; k++) {
        if (is_path && c[k + 1] != 0.0)
            kt_formula_print(to, "%s%g*%s", to->length > first ? " + " : "", c[k + 1], k == 1 ? "speed" : "length");
        for (int i = 0; i < count && c[k + 1] != 0.0; i++) {
            kt_formula_put(to, to->length > first ? " + " : "");
            put_coordinate(a, index, i, c[k + 1] * (a->term_count > 0 ? a->terms[i].coefficient : 1.0), k == 1, to);
        }
    }
}

/* Writes the active force of a muscle for an activation of 1, or its passive force. */
static void put_muscle(const kt_effect *e, int index, bool is_active, kt_formula_text *to) {
    const kt_actuator *a = &e->actuators[index];
    const kt_muscle *muscle = is_active ? a->active : a->passive;
    const kt_muscle_scale scale = kt_muscle_scale_of(muscle);
    kt_formula_text length = {.whole = true}, rate = {.whole = true};
    put_affine(e, index, (const double[]){scale.offset, scale.slope * a->gear, 0.0}, &length);
    put_affine(e, index, (const double[]){0.0, 0.0, scale.rate * a->gear}, &rate);
    to->whole = to->whole && length.whole && rate.whole;
    if (is_active)
        kt_formula_put_active(muscle, length.text, rate.text, to);
    else
        kt_formula_put_passive(muscle, length.text, to);
}

/* The control u within its bounds, at which it is held. */
static double held_control(const kt_actuator *a) { return kt_clamp(a->control, a->control_lower, a->control_upper); }

/* The coefficients of a constant, of L and of L', in the part of f without w. */
static void write_bias(const kt_actuator *a, double c[3]) {
    const double u = kt_actuator_is_driven(a) ? 0.0 : held_control(a);
    for (int i = 0; i < 3; i++)
        c[i] = ((a->active == NULL ? a->gain[i] * u : 0.0) + a->bias[i]) * (i > 0 ? a->gear : 1.0);
}

/* Writes w: the activation clamped to its bounds, the control before its delay, or the constant control. */
static void put_variable(const kt_actuator *a, int index, kt_formula_text *to) {
    if (a->activation != NULL) {
        put_bounded(to, a->activation_lower, a->activation_upper, true);
        kt_formula_print(to, "w%d", index);
        put_bounded(to, a->activation_lower, a->activation_upper, false);
    } else if (a->delay > 0.0) {
        kt_formula_put(to, "(");
        kt_formula_put_delayed(to, held_control(a), a->delay);
        kt_formula_put(to, ")");
    } else {
        kt_formula_print(to, "%g", held_control(a));
    }
}

/* Writes f of an actuator without its bounds: the affine part without w, the passive force of a muscle, and w times the
 * gain or the active force. */
static void put_force(const kt_effect *e, int index, kt_formula_text *to) {
    const kt_actuator *a = &e->actuators[index];
    const bool is_driven = kt_actuator_is_driven(a) || a->active != NULL;
    double c[3];
    write_bias(a, c);
    const bool is_affine = c[0] != 0.0 || c[1] != 0.0 || c[2] != 0.0;
    if (is_affine || (a->passive == NULL && !is_driven))
        put_affine(e, index, c, to);
    if (a->passive != NULL) {
        kt_formula_put(to, is_affine ? " + " : "");
        put_muscle(e, index, false, to);
    }
    if (!is_driven)
        return;
    kt_formula_put(to, is_affine || a->passive != NULL ? " + " : "");
    put_variable(a, index, to);
    kt_formula_put(to, "*(");
    if (a->active != NULL)
        put_muscle(e, index, true, to);
    else
        put_affine(e, index, (const double[]){a->gain[0], a->gain[1] * a->gear, a->gain[2] * a->gear}, to);
    kt_formula_put(to, ")");
}

/* ---- actuators of one tendon ------------------------------------------------------------------------------------- */

static bool has_bounded_sum(const kt_actuator *a) { return isfinite(a->sum_lower) || isfinite(a->sum_upper); }

/* The next actuator behind one, or from 0 on behind -1, that has the tendon or path of another; -1: there is none. */
static int next_sharer(const kt_effect *e, int of, int behind) {
    const char *tendon = e->actuators[of].tendon;
    for (int i = behind + 1; i < e->actuator_count; i++) {
        const char *other = e->actuators[i].tendon;
        if (i == of || e->end_count == 2 || (tendon != NULL && other != NULL && strcmp(tendon, other) == 0))
            return i;
    }
    return -1;
}

/* Whether all actuators of a tendon have one gear, and no bounds of their own: then the sum is clamped as a whole. */
static bool is_one_sum(const kt_effect *e, int first) {
    bool is_one = true;
    for (int i = first; i >= 0; i = next_sharer(e, first, i)) {
        const kt_actuator *a = &e->actuators[i];
        is_one = is_one && a->gear == e->actuators[first].gear && isinf(a->lower) && isinf(a->upper);
    }
    return is_one;
}

bool kt_actuator_sum_is_possible(const kt_effect *e, int index) {
    const kt_actuator *a = &e->actuators[index];
    const int first = next_sharer(e, index, -1);
    bool is_plain = true;
    for (int i = first; i >= 0; i = next_sharer(e, index, i))
        is_plain = is_plain && !kt_actuator_is_driven(&e->actuators[i]) && e->actuators[i].active == NULL &&
                   e->actuators[i].passive == NULL;
    return !has_bounded_sum(a) || (is_plain && ((a->sum_lower < 0.0 && a->sum_upper > 0.0) || is_one_sum(e, first)));
}

/* The sum of the forces of all actuators of a tendon, before bounds. */
static void put_shared_sum(const kt_effect *e, int first, kt_formula_text *to) {
    double c[3] = {0.0, 0.0, 0.0}, one[3];
    for (int i = first; i >= 0; i = next_sharer(e, first, i)) {
        write_bias(&e->actuators[i], one);
        for (int k = 0; k < 3; k++)
            c[k] += one[k];
    }
    put_affine(e, first, c, to);
}

/* The factor that brings a sum S between bounds l < 0 < u: "*u/max(u, S)*l/min(l, S)". */
static void put_share(const kt_effect *e, int first, kt_formula_text *to) {
    static const char *const calls[] = {"/min(", "/max("};
    const double bounds[2] = {e->actuators[first].sum_lower, e->actuators[first].sum_upper};
    for (int i = 0; i < 2; i++) {
        if (isinf(bounds[i]))
            continue;
        kt_formula_print(to, "*%g%s%g, ", bounds[i], calls[i], bounds[i]);
        put_shared_sum(e, first, to);
        kt_formula_put(to, ")");
    }
}

/* Writes a term such as `3*clamp(2 + -5*p + -1*v, -1, 1)`. For the first of several actuators that share a tendon with
 * a bounded sum, writes the terms of all. */
static void put_action(const kt_effect *e, int first, double lever, kt_formula_text *to) {
    const bool is_shared = has_bounded_sum(&e->actuators[first]), is_one = is_shared && is_one_sum(e, first);
    for (int i = first; i >= 0; i = is_shared && !is_one ? next_sharer(e, first, i) : -1) {
        const kt_actuator *a = &e->actuators[i];
        const double lower = is_one ? a->sum_lower : a->lower, upper = is_one ? a->sum_upper : a->upper;
        kt_formula_print(to, "%s%g*", i != first ? " + " : "", a->gear * lever);
        put_bounded(to, lower, upper, true);
        kt_formula_put(to, is_shared && !is_one ? "(" : "");
        if (is_one)
            put_shared_sum(e, i, to);
        else
            put_force(e, i, to);
        kt_formula_put(to, is_shared && !is_one ? ")" : "");
        if (is_shared && !is_one)
            put_share(e, first, to);
        put_bounded(to, lower, upper, false);
    }
}

/* dL/dq of the effect's joint; 1 if the actuator acts along the joint or path itself. */
static double lever_of(const kt_effect *e, const kt_actuator *a) {
    double sum = a->term_count > 0 ? 0.0 : 1.0;
    for (int k = 0; k < a->term_count; k++)
        sum += strcmp(a->terms[k].joint, e->joint) == 0 ? a->terms[k].coefficient : 0.0;
    return sum;
}

/* The sum of all actuators. */
static void put_sum(const kt_effect *e, kt_formula_text *to) {
    const bool is_bounded = e->end_count == 0 || isfinite(e->lower) || isfinite(e->upper);
    bool is_first = true;
    if (is_bounded)
        put_bounded(to, e->lower, e->upper, true);
    for (int i = 0; i < e->actuator_count; i++) {
        const bool is_written = has_bounded_sum(&e->actuators[i]) && next_sharer(e, i, -1) < i;
        const double lever = is_written ? 0.0 : lever_of(e, &e->actuators[i]);
        if (lever == 0.0)
            continue;
        kt_formula_put(to, is_first ? "" : " + ");
        put_action(e, i, lever, to);
        is_first = false;
    }
    kt_formula_put(to, is_first ? "0" : "");
    if (is_bounded)
        put_bounded(to, e->lower, e->upper, false);
}

/* Component k of the wrench on a point; false if it is zero. */
static bool put_component(const kt_effect *e, int k, kt_formula_text *to) {
    for (int i = 0; i < e->actuator_count; i++) {
        const kt_actuator *a = &e->actuators[i];
        if (a->wrench[k] == 0.0)
            continue;
        kt_formula_print(to, "%s%g*", to->length > 0 ? " + " : "", a->wrench[k]);
        put_bounded(to, a->lower, a->upper, true);
        put_force(e, i, to);
        put_bounded(to, a->lower, a->upper, false);
    }
    return to->length > 0;
}

/* ---- polynomial springs ------------------------------------------------------------------------------------------ */

static bool is_any(const double k[3]) { return k[0] != 0.0 || k[1] != 0.0 || k[2] != 0.0; }
static bool is_linear(const double k[3]) { return k[1] == 0.0 && k[2] == 0.0; }

/* A force in a joint: -factor x (k0 + k1 x + k2 x^2), or odd in x with k1 |x|. */
static void put_in_joint(double factor, const double k[3], const char *x, bool is_odd, kt_formula_text *to) {
    kt_formula_print(to, "%g*%s*(%g + %g*%s%s + %g*%s^2)", -factor, x, k[0], k[1], is_odd ? "abs" : "", x, k[2], x);
}

/* "(2*p + -0.1)", or "(min(0, 2*p + -0.1) + max(0, 2*p + -0.3))": the distance from the range without force. */
static void put_joint_stretch(const kt_polynomial_spring *s, kt_formula_text *to) {
    static const char *const begins[] = {"(min(0, ", ") + max(0, "};
    const bool is_range = s->rest[0] != s->rest[1];
    for (int i = 0; i < (is_range ? 2 : 1); i++) {
        kt_formula_put(to, is_range ? begins[i] : "(");
        if (s->factor != 1.0)
            kt_formula_print(to, "%g*", s->factor);
        kt_formula_print(to, "p + %g", 0.0 - s->rest[i]);
    }
    kt_formula_put(to, is_range ? "))" : ")");
}

/* Writes the force of a spring in a joint. The damping is odd in v, so that it opposes motion in both directions. */
static void put_joint_spring(const kt_polynomial_spring *s, kt_formula_text *to) {
    kt_formula_text x = {.whole = true};
    const bool has_spring = is_any(s->stiffness);
    if (has_spring) {
        put_joint_stretch(s, &x);
        put_in_joint(s->factor, s->stiffness, x.text, false, to);
    }
    if (!is_any(s->damping)) {
        kt_formula_put(to, has_spring ? "" : "0");
        return;
    }
    kt_formula_put(to, has_spring ? " + " : "");
    x = (kt_formula_text){.whole = true};
    kt_formula_put(&x, "(");
    if (s->factor != 1.0)
        kt_formula_print(&x, "%g*", s->factor);
    kt_formula_put(&x, "v)");
    put_in_joint(s->factor, s->damping, x.text, true, to);
}

/* "x*(-k0 + -k1*odd + -k2*x^2)". */
static void put_polynomial(const double k[3], const char *x, const char *odd, kt_formula_text *to) {
    kt_formula_print(to, "%s*(%g", x, -k[0]);
    for (int i = 1; i < 3; i++)
        if (k[i] != 0.0)
            kt_formula_print(to, " + %g*%s", -k[i], i == 1 ? odd : x);
    kt_formula_put(to, k[2] != 0.0 ? "^2)" : ")");
}

/* "k*clamp(L, a, b) - k*L", or a polynomial of the stretch "(length - clamp(length, a, b))". */
static void put_path_stiffness(const kt_polynomial_spring *s, kt_formula_text *to) {
    const bool is_range = s->rest[0] != s->rest[1];
    if (!is_linear(s->stiffness)) {
        kt_formula_text stretch = {.whole = true};
        if (is_range)
            kt_formula_print(&stretch, "(length - clamp(length, %g, %g))", s->rest[0], s->rest[1]);
        else
            kt_formula_print(&stretch, "(length - %g)", s->rest[0]);
        put_polynomial(s->stiffness, stretch.text, stretch.text, to);
        return;
    }
    if (is_range)
        kt_formula_print(to, "clamp(1*length, %g, %g)*%g + ", s->rest[0], s->rest[1], s->stiffness[0]);
    else
        kt_formula_print(to, "%g + ", s->stiffness[0] * s->rest[0]);
    kt_formula_print(to, "%g*length", -s->stiffness[0]);
}

/* The friction changes its sign over a small speed, as joint_friction does. */
static void put_path_spring(const kt_polynomial_spring *s, kt_formula_text *to) {
    put_path_stiffness(s, to);
    if (s->friction != 0.0)
        kt_formula_print(to, " + %g*tanh(speed/%g)", -s->friction, s->smoothing);
    if (!is_any(s->damping))
        return;
    kt_formula_put(to, " + ");
    if (is_linear(s->damping))
        kt_formula_print(to, "%g*speed", -s->damping[0]);
    else
        put_polynomial(s->damping, "speed", "abs(speed)", to);
    if (s->beyond)
        kt_formula_print(to, "*((1*length < %g) + (1*length > %g))", s->rest[0], s->rest[1]);
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The index below `count` that stands at *text, which then is behind its digits; -1 if there is none. */
static int read_index(const char **text, int count) {
    int index = -1;
    for (; **text >= '0' && **text <= '9'; (*text)++) {
        index = 10 * (index < 0 ? 0 : index) + (**text - '0');
        if (index >= count)
            return -1;
    }
    return index;
}

/* The name of the joint of "p", "p2_1" and so on, or of the activation of "w2"; NULL if there is none. */
static const char *find_by_number(const kt_effect *effect, const char *name) {
    const char *at = name + 1;
    if (*at == '\0')
        return effect->joint;
    const int i = read_index(&at, effect->actuator_count);
    if (i < 0)
        return NULL;
    const kt_actuator *actuator = &effect->actuators[i];
    if (*name == 'w')
        return actuator->activation;
    const int k = *at++ == '_' ? read_index(&at, actuator->term_count) : -1;
    return k >= 0 ? actuator->terms[k].joint : NULL;
}

/* Replaces the short name of a variable by the full name, in `full`. Other names remain. */
static const char *lengthen_name(const kt_effect *effect, const char *name, char *full) {
    const char *object = strchr("pvw", *name) != NULL ? find_by_number(effect, name) : NULL;
    if (object == NULL)
        return name;
    (void)snprintf(full, KT_EXPRESSION_NAME_MAX + 1, "%s%s",
                   *name == 'p'   ? "position."
                   : *name == 'v' ? "velocity."
                                  : "state.",
                   object);
    return full;
}

kt_formula_names kt_effect_names_of(const kt_description *description, const kt_effect *effect) {
    kt_formula_names names = kt_formula_names_of(description, effect);
    names.numbers = effect;
    names.lengthen = kt_effect_has_numbers(effect) ? lengthen_name : NULL;
    return names;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

const char *kt_effect_formula(const kt_effect *effect, int k, kt_formula_text *to) {
    if (!kt_effect_has_numbers(effect))
        return effect->formula[k];
    *to = (kt_formula_text){.whole = true};
    if (effect->end_count == 1)
        return put_component(effect, k, to) ? to->text : NULL;
    if (k > 0)
        return NULL;
    if (effect->spring == NULL)
        put_sum(effect, to);
    else if (effect->end_count == 0)
        put_joint_spring(effect->spring, to);
    else
        put_path_spring(effect->spring, to);
    return to->text;
}

void kt_activation_rate(const kt_activation *a, const char *w, kt_formula_text *to) {
    const double control = kt_clamp(a->control, a->control_lower, a->control_upper);
    *to = (kt_formula_text){.whole = true};
    if (a->type == KT_ACTIVATION_FILTER) {
        kt_formula_put(to, "(");
        kt_formula_put_delayed(to, control, a->delay);
        kt_formula_print(to, " - %s)/%g", w, a->times[0]);
    } else if (a->type == KT_ACTIVATION_MUSCLE) {
        kt_formula_put_muscle_rate(a, control, w, to);
    } else {
        kt_formula_put_delayed(to, control, a->delay);
    }
}

bool kt_effect_numbers_fit(const kt_effect *effect) {
    int variables = 2; /* those of the effect's joint or path */
    for (int i = 0; i < effect->actuator_count; i++)
        variables += 2 * effect->actuators[i].term_count + (effect->actuators[i].activation != NULL);
    for (int k = 0; k < 6; k++) {
        kt_formula_text text = {.whole = true};
        (void)kt_effect_formula(effect, k, &text);
        if (!text.whole)
            return false;
    }
    return variables <= KT_FORMULA_VARIABLE_MAX;
}
