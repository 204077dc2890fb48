/* Actuators by numbers as actuators of MJCF, in a joint of one coordinate, along a path or a tendon, or at a site.
 *
 * A formula of the user has no place in MJCF, and is counted. An actuator of a tendon that is fixed to joints is listed
 * by an effect of each of these joints; the effect of the first joint writes the actuator. MuJoCo bounds the sum of all
 * actuators that move a joint, so that the bounds of an effect are those of its joint if nothing else drives it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>
#include <string.h>

/* ---- what drives a joint ----------------------------------------------------------------------------------------- */

static bool is_carried(const kt_export *x, int body, int by) {
    while (body >= 0 && body != by)
        body = x->parent[body];
    return body == by;
}

/* Whether a joint changes the length of a path, or moves a point of the effect. */
static bool joint_moves_ends(const kt_export *x, const kt_effect *e, int body) {
    bool moves = false, rests = false;
    for (int k = 0; k < (e->path_count > 0 ? e->path_count : e->end_count); k++) {
        const kt_end *end = e->path_count > 0 ? &e->path[k].end : &e->between[k];
        const bool is_on = is_carried(x, kt_export_find(x, end->body), body);
        moves = moves || is_on;
        rests = rests || !is_on;
    }
    return moves && (rests || e->end_count == 1);
}

/* Whether a tendon's slider is a sum that contains a joint. */
static bool sum_has_joint(const kt_export *x, int slider, const char *joint) {
    for (int k = 0; k < x->sum[slider]->term_count; k++)
        if (strcmp(x->sum[slider]->terms[k].joint, joint) == 0)
            return true;
    return false;
}

/* Whether an effect is an actuator in MJCF that moves the joint of a body. */
static bool drives(const kt_export *x, const kt_effect *e, int body) {
    const int own = e->joint != NULL ? kt_export_scalar(x, e->joint) : -1;
    if (e->type != KT_EFFECT_MOTOR && e->type != KT_EFFECT_SERVO && e->actuators == NULL)
        return false;
    if (e->end_count > 0 && e->type == KT_EFFECT_EXPRESSION)
        return joint_moves_ends(x, e, body);
    return own == body || (own >= 0 && x->role[own] == KT_EXPORT_SUM &&
                           sum_has_joint(x, own, kt_joint_name_of(kt_export_body(x, body))));
}

/* The bounds of an effect become those of its joint. */
static void take_bounds(kt_export *x, const kt_effect *e, int body) {
    int count = 0;
    if (isinf(e->lower) && isinf(e->upper))
        return;
    for (int i = 0; i < x->d->effect_count && body >= 0; i++)
        count += drives(x, &x->d->effects[i], body);
    if (count != 1 || x->role[body] == KT_EXPORT_SUM) {
        kt_export_lose(x, "bounds of sums of actuators, which MuJoCo has for all that move a joint alone");
        return;
    }
    x->forces[body].range[0] = kt_export_bound(e->lower);
    x->forces[body].range[1] = kt_export_bound(e->upper);
}

/* Whether an effect of the first joint of a tendon lists the actuator, too. */
static bool is_listed_first(const kt_export *x, const kt_actuator *a) {
    for (int i = 0; i < x->d->effect_count; i++) {
        const kt_effect *e = &x->d->effects[i];
        for (int k = 0; k < e->actuator_count && kt_text_is(e->joint, a->terms[0].joint); k++)
            if (kt_text_is(e->actuators[k].name, a->name) ||
                (a->name == NULL && kt_text_is(e->actuators[k].tendon, a->tendon)))
                return true;
    }
    return false;
}

/* ---- which effects are actuators --------------------------------------------------------------------------------- */

/* The state of an activation by numbers; -1: there is none of this name. */
static int find_activation(const kt_export *x, const char *name) {
    for (int i = 0; i < x->d->state_count; i++)
        if (strcmp(x->d->states[i].name, name) == 0 && x->d->states[i].activation != NULL)
            return i;
    return -1;
}

/* A tendon is shorter than the position of its slider by an offset. */
static const kt_actuator *shift_actuator(kt_export *x, const kt_actuator *a, int body) {
    double own;
    const double offset = a->gear * kt_export_number_offset(x, body, &own);
    kt_actuator *shifted = offset != 0.0 ? kt_pool_take(&x->pool, 1, sizeof *shifted) : NULL;
    kt_muscle *muscles = shifted != NULL ? kt_pool_take(&x->pool, 2, sizeof *muscles) : NULL;
    if (muscles == NULL)
        return a;
    *shifted = *a;
    shifted->bias[0] += a->bias[1] * offset;
    shifted->gain[0] += a->gain[1] * offset;
    for (int k = 0; k < 2; k++) {
        const kt_muscle **muscle = k == 0 ? &shifted->active : &shifted->passive;
        if (*muscle == NULL)
            continue;
        muscles[k] = **muscle;
        muscles[k].lengths[0] -= offset;
        muscles[k].lengths[1] -= offset;
        *muscle = &muscles[k];
    }
    return shifted;
}

/* Reports numbers that MuJoCo has no place for. */
static void lose_of_actuator(kt_export *x, const kt_actuator *a) {
    if (a->passive != NULL && (a->bias[0] != 0.0 || a->bias[1] != 0.0 || a->bias[2] != 0.0))
        kt_export_lose(x, "biases next to the passive force of a muscle");
    if (a->active == NULL && a->passive == NULL && a->gain[0] == -a->bias[1] && a->bias[2] > 0.0)
        kt_export_lose(x, "biases that grow with the rate, which MuJoCo takes for a ratio of damping");
}

/* Until actuator_count grows at the end, the entry does not count: each return before it leaves the actuator out. */
static void add_actuator(kt_export *x, const kt_effect *e, const kt_actuator *a, int body, int rope) {
    kt_export_actuator *to = &x->actuators[x->actuator_count];
    *to = (kt_export_actuator){.effect = e, .numbers = a, .body = body, .rope = rope, .line = -1, .state = -1};
    if (a->activation != NULL && (to->state = find_activation(x, a->activation)) < 0) {
        kt_export_lose(x, "actuators whose activation has a rate by a formula");
        return;
    }
    if (a->term_count > 0 && !kt_text_is(a->terms[0].joint, e->joint)) {
        if (!is_listed_first(x, a))
            kt_export_lose(x, "actuators of a tendon that an effect of its first joint does not list");
        return;
    }
    for (int k = 0; k < a->term_count; k++) {
        const int of = kt_export_scalar(x, a->terms[k].joint);
        if (of < 0 || x->role[of] == KT_EXPORT_SUM) {
            kt_export_lose(x, "actuators of tendons that are fixed to other tendons");
            return;
        }
    }
    if (a->term_count > 0) {
        to->line = kt_export_add_line(x, a->tendon, a->terms, a->term_count);
        x->lines[to->line].actuator = a;
    }
    if (body >= 0 && a->term_count == 0 && x->role[body] == KT_EXPORT_SUM)
        to->numbers = shift_actuator(x, a, body);
    if (to->state >= 0)
        x->is_kept[to->state] = true;
    lose_of_actuator(x, a);
    x->actuator_count++;
}

bool kt_export_take_actuators(kt_export *x, const kt_effect *e) {
    const int body = e->end_count == 0 ? kt_export_scalar(x, e->joint) : -1;
    if (e->type != KT_EFFECT_EXPRESSION || e->actuators == NULL || (e->end_count == 0 && body < 0))
        return false;
    if (e->end_count == 1 && e->frame != KT_FRAME_BODY) {
        kt_export_lose(x, "actuators on points along the axes of the world");
        return true;
    }
    if (e->end_count == 2 && !kt_export_add_rope(x, e))
        return false;
    for (int i = 0; i < e->actuator_count; i++)
        add_actuator(x, e, &e->actuators[i], body, e->end_count == 2 ? x->rope_count - 1 : -1);
    take_bounds(x, e, body);
    return true;
}

/* ---- elements ---------------------------------------------------------------------------------------------------- */

/* MuJoCo keeps the controls of its last `nsample` steps. There are as many as the delay has steps of this length. */
static const double buffer_step = 1e-4;

double kt_export_control(const kt_export *x, const kt_export_actuator *d) {
    return d->state >= 0 ? x->d->states[d->state].activation->control : d->numbers->control;
}

static void write_range(kt_export *x, const char *name, double lower, double upper) {
    if (isfinite(lower) || isfinite(upper))
        kt_export_print(x, " %s=\"%g %g\"", name, kt_export_bound(lower), kt_export_bound(upper));
}

/* The nine numbers of a muscle. `scale` has no meaning, since the force is given. */
static void write_muscle(kt_export *x, const char *name, const kt_muscle *m) {
    const double scale = 200.0;
    kt_export_print(x, " %stype=\"muscle\" %sprm=\"%g %g %g %g %g %g %g %g %g\"", name, name, m->range[0], m->range[1],
                    m->force, scale, m->shortest, m->longest, m->speed, m->passive, m->stretched);
}

static void write_affine(kt_export *x, const char *name, const double c[3]) {
    kt_export_print(x, " %stype=\"affine\" %sprm=\"%g %g %g\"", name, name, c[0], c[1], c[2]);
}

static void write_gain_and_bias(kt_export *x, const kt_actuator *a) {
    if (a->active != NULL)
        write_muscle(x, "gain", a->active);
    else if (a->gain[1] != 0.0 || a->gain[2] != 0.0)
        write_affine(x, "gain", a->gain);
    else
        kt_export_numbers(x, "gainprm", a->gain, 1);
    if (a->passive != NULL)
        write_muscle(x, "bias", a->passive);
    else if (a->bias[0] != 0.0 || a->bias[1] != 0.0 || a->bias[2] != 0.0)
        write_affine(x, "bias", a->bias);
    if (a->active != NULL || a->passive != NULL)
        kt_export_numbers(x, "lengthrange", (a->active != NULL ? a->active : a->passive)->lengths, 2);
}

static void write_dynamics(kt_export *x, const kt_activation *w) {
    static const char *const types[] = {"filterexact", "integrator", "muscle"};
    kt_export_print(x, " dyntype=\"%s\"", types[w->type]);
    if (w->type != KT_ACTIVATION_INTEGRATOR)
        kt_export_numbers(x, "dynprm", w->times, w->type == KT_ACTIVATION_MUSCLE ? 3 : 1);
}

static void write_place_of_actuator(kt_export *x, int i) {
    const kt_export_actuator *d = &x->actuators[i];
    if (d->rope >= 0)
        kt_export_rope_name(x, "tendon", d->rope);
    else if (d->line >= 0)
        kt_export_line_name(x, "tendon", d->line);
    else if (d->body >= 0)
        kt_export_print(x, " %s=\"%s\"", x->role[d->body] == KT_EXPORT_SUM ? "tendon" : "joint",
                        kt_joint_name_of(kt_export_body(x, d->body)));
    else
        kt_export_print(x, " site=\"actuator__%d\"", i + 1);
    if (d->body >= 0 || d->rope >= 0)
        kt_export_print(x, " gear=\"%g\"", d->numbers->gear);
    else
        kt_export_numbers(x, "gear", d->numbers->wrench, 6);
}

static void write_actuator(kt_export *x, int i) {
    const kt_export_actuator *d = &x->actuators[i];
    const kt_actuator *a = d->numbers;
    const kt_activation *w = d->state >= 0 ? x->d->states[d->state].activation : NULL;
    const double delay = w != NULL ? w->delay : a->delay;
    kt_export_print(x, "    <general");
    if (a->name != NULL)
        kt_export_print(x, " name=\"%s\"", a->name);
    write_place_of_actuator(x, i);
    write_range(x, "ctrlrange", w != NULL ? w->control_lower : a->control_lower,
                w != NULL ? w->control_upper : a->control_upper);
    write_range(x, "forcerange", a->lower, a->upper);
    write_range(x, "actrange", a->activation_lower, a->activation_upper);
    if (delay > 0.0)
        kt_export_print(x, " delay=\"%g\" nsample=\"%d\"", delay,
                        (int)fmin(ceil(delay / buffer_step) + 1.0, 16777216.0));
    if (w != NULL)
        write_dynamics(x, w);
    write_gain_and_bias(x, a);
    kt_export_print(x, "/>\n");
    if (d->body >= 0 && isfinite(kt_export_body(x, d->body)->joint.limits.effort) &&
        !kt_export_has_force_range(&x->forces[d->body]))
        kt_export_lose(x, KT_EXPORT_EFFORTS);
}

void kt_export_listed_actuators(kt_export *x) {
    for (int i = 0; i < x->actuator_count; i++)
        write_actuator(x, i);
}
