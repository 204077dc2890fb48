/* Loops and effects of a mechanism out of bytes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "describe.h"
#include "fuzz.h"
#include "kinetree/effect.h"

#include <stdio.h>

/* ---- functions of time ------------------------------------------------------------------------------------------- */

/* `base`: the approximate value; `above_zero`: the function is a length. */
static kt_function draw_function(kt_bytes *bytes, kt_fuzz_mechanism *m, double base, bool above_zero) {
    const kt_wildness wild = m->wild;
    double *x = m->numbers[m->functions++];
    const int type = kt_bytes_pick(bytes, 6 + (wild == KT_WILD_ALL));
    int count = 0;
    switch (type) {
    case 1:
        base += kt_bytes_number(bytes, wild);
        return kt_function_constant(above_zero && wild < KT_WILD_NUMBERS ? fabs(base) + 0.1 : base);
    case 2:
        for (int i = 0; i < 3; i++)
            x[i] = kt_bytes_number(bytes, wild);
        return kt_function_sine(x[0], x[1], x[2], above_zero ? fabs(base) + 2.0 * fabs(x[0]) + 0.1 : base);
    case 3:
        x[0] = kt_bytes_number(bytes, wild);
        return kt_function_ramp(base, kt_bytes_positive(bytes, wild), x[0], x[0] + kt_bytes_positive(bytes, wild));
    case 4:
        count = 1 + kt_bytes_pick(bytes, 4);
        x[0] = base;
        for (int i = 1; i < count; i++)
            x[i] = kt_bytes_number(bytes, wild);
        return kt_function_polynomial(x, wild == KT_WILD_ALL ? count - 1 : count);
    case 5:
        count = 4 + 2 * kt_bytes_pick(bytes, 3);
        for (int i = 0; i < count; i += 2) {
            x[i] = (i > 0 ? x[i - 2] : -0.5) + kt_bytes_positive(bytes, wild);
            x[i + 1] = above_zero ? kt_bytes_positive(bytes, wild) : kt_bytes_number(bytes, wild);
        }
        return kt_function_table(x, count - (wild == KT_WILD_ALL && kt_bytes_chance(bytes)),
                                 kt_bytes_chance(bytes) ? KT_INTERPOLATION_CUBIC : KT_INTERPOLATION_LINEAR);
    case 6: {
        const kt_function wrong = {.type = (kt_function_type)77};
        return wrong;
    }
    default: {
        const kt_function none = {.type = KT_FUNCTION_NONE};
        return above_zero ? none : kt_function_constant(base);
    }
    }
}

/* ---- ends and joints --------------------------------------------------------------------------------------------- */

static void draw_end(kt_bytes *bytes, kt_fuzz_mechanism *m, int body, kt_end *end) {
    *end = kt_end_default();
    end->body = kt_fuzz_name(bytes, m, body);
    const int kind = kt_bytes_pick(bytes, 4);
    if (kind == 1)
        end->at = kt_bytes_vector(bytes, m->wild);
    else if (kind == 2 && body >= 0 && m->body[body].marker_count > 0)
        end->marker = m->marker[body][0].name;
    else if (kind == 2 && m->wild == KT_WILD_ALL)
        end->marker = "nothing";
    kt_fuzz_rotation(bytes, m->wild, &end->rotation);
}

/* On two bodies, the world among them. */
static void draw_ends(kt_bytes *bytes, kt_fuzz_mechanism *m, kt_end end[2]) {
    const int count = m->description.body_count + 1;
    int first = count - 1 - kt_bytes_pick(bytes, count); /* zeros: the last body, and the world */
    int second = kt_bytes_pick(bytes, count);
    if (first == second && m->wild < KT_WILD_ALL)
        second = (first + 1) % count;
    draw_end(bytes, m, first - 1, &end[0]);
    draw_end(bytes, m, second - 1, &end[1]);
}

static bool is_scalar(const kt_fuzz_mechanism *m, int body) {
    const kt_joint_type type = m->body[body].joint.type;
    return type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC || type == KT_JOINT_SCREW;
}

/* A joint of one coordinate, the first from a place on; where there is none, and of wild ones, any. */
static int draw_joint(kt_bytes *bytes, const kt_fuzz_mechanism *m) {
    const int count = m->description.body_count;
    if (count == 0)
        return -1;
    const int start = kt_bytes_pick(bytes, count);
    if (m->wild == KT_WILD_ALL && kt_bytes_pick(bytes, 16) == 15)
        return start;
    for (int i = 0; i < count; i++)
        if (is_scalar(m, (start + i) % count))
            return (start + i) % count;
    return -1;
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

static bool draw_coupling(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    kt_loop *loop = &m->loop[i];
    unsigned seen = 0;
    const int wanted = 1 + kt_bytes_pick(bytes, KT_FUZZ_TERMS);
    for (int k = 0; k < wanted; k++) {
        const int joint = draw_joint(bytes, m);
        kt_term *term = &m->term[i][loop->term_count];
        term->coefficient = kt_bytes_positive(bytes, m->wild) * (kt_bytes_chance(bytes) ? -1.0 : 1.0);
        if (joint < 0 || ((seen & 1U << joint) != 0 && m->wild < KT_WILD_ALL))
            continue;
        seen |= 1U << joint;
        term->joint = kt_fuzz_name(bytes, m, joint);
        loop->term_count++;
    }
    loop->terms = m->term[i];
    loop->offset = kt_bytes_chance(bytes) ? kt_bytes_number(bytes, m->wild) : 0.0;
    if (loop->type == KT_LOOP_COUPLING && loop->term_count == 2 && loop->offset != 0.0 &&
        loop->terms[0].joint != NULL && loop->terms[1].joint != NULL) {
        (void)snprintf(m->formula[i], sizeof m->formula[i], "0.3*sin(position.%.60s)*position.%.60s^2",
                       loop->terms[0].joint, loop->terms[1].joint);
        loop->formula = m->formula[i];
    }
    return loop->term_count > 0 || m->wild == KT_WILD_ALL;
}

static bool draw_motion(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    const int joint = draw_joint(bytes, m);
    m->loop[i].joint = joint < 0 && m->wild < KT_WILD_ALL ? NULL : kt_fuzz_name(bytes, m, joint);
    m->loop[i].function = draw_function(bytes, m, joint < 0 ? 0.0 : m->body[joint].joint.position[0], false);
    return joint >= 0 || m->wild == KT_WILD_ALL;
}

/* False where the mechanism cannot have it. */
static bool draw_loop(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    static const char *const names[KT_FUZZ_LOOPS] = {"l", "m", "n", "o"};
    static const kt_vec3 bow[] = {{-0.5, 0.1, 0.0}, {0.2, 0.6, 0.1}, {0.9, 0.4, -0.3}};
    kt_loop *loop = &m->loop[i];
    const char *name = m->wild == KT_WILD_ALL && kt_bytes_pick(bytes, 16) == 15 ? names[0] : names[i];
    *loop = kt_loop_of(name, (kt_loop_type)kt_bytes_pick(bytes, KT_LOOP_TYPE_COUNT + (m->wild == KT_WILD_ALL)));
    if (loop->type == KT_LOOP_RATES && kt_bytes_chance(bytes))
        loop->function = draw_function(bytes, m, 0.0, false);
    if (loop->type == KT_LOOP_COUPLING || loop->type == KT_LOOP_RATES)
        return draw_coupling(bytes, m, i);
    if (loop->type == KT_LOOP_MOTION)
        return draw_motion(bytes, m, i);
    if (m->description.body_count == 0 && m->wild < KT_WILD_ALL)
        return false;
    draw_ends(bytes, m, loop->between);
    loop->axis = kt_fuzz_axis(bytes, m->wild);
    loop->axis2 = kt_fuzz_axis(bytes, m->wild);
    loop->pitch = kt_bytes_number(bytes, m->wild);
    loop->radius = kt_bytes_positive(bytes, m->wild);
    loop->holonomic = kt_bytes_chance(bytes);
    loop->surface = (kt_surface){.type = (kt_surface_type)kt_bytes_pick(bytes, KT_SURFACE_TYPE_COUNT),
                                 .radius = loop->radius,
                                 .tube = kt_bytes_positive(bytes, m->wild)};
    loop->curve = (kt_track){.type = (kt_track_type)kt_bytes_pick(bytes, KT_TRACK_TYPE_COUNT),
                             .radius = loop->radius,
                             .pitch = loop->pitch,
                             .points = bow,
                             .point_count = 3};
    if (loop->type == KT_LOOP_CURVE && kt_bytes_chance(bytes))
        loop->function = draw_function(bytes, m, 0.0, false);
    if (m->wild < KT_WILD_ALL && ((loop->type == KT_LOOP_SURFACE && loop->surface.type == KT_SURFACE_NONE) ||
                                  (loop->type == KT_LOOP_CURVE && loop->curve.type == KT_TRACK_NONE)))
        return false;
    if (loop->type == KT_LOOP_DISTANCE)
        loop->function = draw_function(bytes, m, 1.0, true);
    return true;
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

static int push(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const kt_fuzz_push *p = user;
    wrenches[0].force = kt_vec3_scale(p->force * (1.0 + 0.5 * sin(t)), ends[0].axes.x);
    wrenches[0].moment = kt_vec3_scale(-p->force, ends[0].omega);
    if (balance != NULL)
        balance->dissipated = fabs(p->force) * kt_vec3_dot(ends[0].omega, ends[0].omega);
    return p->returns;
}

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const kt_fuzz_push *p = user;
    *force = -p->force * (q + t) - fabs(p->force) * v;
    if (balance != NULL)
        balance->supplied = *force * v;
    return p->returns;
}

static void draw_custom(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    static const int answers[] = {0, 0, 0, 0, 0, 0, 1, -1};
    kt_effect *effect = &m->effect[i];
    effect->type = KT_EFFECT_CUSTOM;
    effect->user = &m->push[i];
    m->push[i].returns = answers[kt_bytes_pick(bytes, 8)];
    m->push[i].force = kt_bytes_number(bytes, m->wild);
    if (m->wild < KT_WILD_ALL && kt_bytes_pick(bytes, 8) == 7)
        m->push[i].force = kt_bytes_chance(bytes) ? (double)NAN : (double)INFINITY;
    effect->end_count = kt_bytes_pick(bytes, 3);
    if (effect->end_count > 0)
        effect->wrench = push;
    else
        effect->joint_force = drive;
    m->custom = true;
}

static void draw_numbers(kt_bytes *bytes, kt_wildness wild, kt_effect *effect) {
    double *const numbers[] = {&effect->stiffness, &effect->damping,     &effect->length,  &effect->limit,
                               &effect->coulomb,   &effect->viscous,     &effect->linear,  &effect->quadratic,
                               &effect->strength,  &effect->dissipation, &effect->friction};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        *numbers[i] = kt_bytes_positive(bytes, wild);
    effect->initial_length = kt_bytes_chance(bytes);
    if (kt_bytes_chance(bytes)) {
        effect->breakaway = effect->coulomb * kt_bytes_positive(bytes, wild);
        effect->stribeck = kt_bytes_positive(bytes, wild);
        effect->smoothing = kt_bytes_positive(bytes, wild);
        effect->slip = kt_bytes_positive(bytes, wild);
        effect->radius = kt_bytes_positive(bytes, wild);
        effect->exponent = 1.0 + kt_bytes_positive(bytes, wild);
    }
    effect->lower = kt_bytes_number(bytes, wild);
    if (kt_bytes_chance(bytes))
        effect->upper = effect->lower + kt_bytes_positive(bytes, wild);
    if (effect->type == KT_EFFECT_BUSHING || effect->type == KT_EFFECT_DRAG)
        for (int k = 0; k < 6; k++) {
            effect->stiffnesses[k] = kt_bytes_positive(bytes, wild);
            effect->dampings[k] = kt_bytes_positive(bytes, wild);
            effect->quadratics[k] = kt_bytes_positive(bytes, wild);
        }
    effect->axis = kt_fuzz_axis(bytes, wild);
    effect->frame = (kt_frame)kt_bytes_pick(bytes, wild == KT_WILD_ALL ? 3 : 2);
}

static bool is_in_joint(const kt_effect *effect) {
    return effect->type == KT_EFFECT_JOINT_SPRING || effect->type == KT_EFFECT_JOINT_DAMPER ||
           effect->type == KT_EFFECT_JOINT_FRICTION || effect->type == KT_EFFECT_JOINT_LIMIT ||
           effect->type == KT_EFFECT_MOTOR || effect->type == KT_EFFECT_SERVO ||
           ((effect->type == KT_EFFECT_CUSTOM || effect->type == KT_EFFECT_EXPRESSION) && effect->end_count == 0);
}

/* False where the mechanism cannot have it. */
static bool draw_effect(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    static const char *const names[KT_FUZZ_EFFECTS] = {"p", NULL, "q", NULL, "r"};
    kt_effect *effect = &m->effect[i];
    *effect =
        kt_effect_of((kt_effect_type)kt_bytes_pick(bytes, KT_EFFECT_TYPE_COUNT + 1 + (m->wild == KT_WILD_ALL)), NULL);
    effect->name = names[i];
    if (effect->type == KT_EFFECT_TYPE_COUNT)
        draw_custom(bytes, m, i);
    if (effect->type == KT_EFFECT_EXPRESSION) {
        effect->end_count = kt_bytes_chance(bytes) ? 2 : 0;
        effect->formula[0] = effect->end_count == 2 ? "-2*(length - 1) - speed*abs(speed)" : "sin(3*t) - step(t - 0.1)";
    }
    const int joint = draw_joint(bytes, m);
    if (m->wild < KT_WILD_ALL && (is_in_joint(effect) ? joint < 0 : m->description.body_count == 0))
        return false;
    if (is_in_joint(effect) || m->wild == KT_WILD_ALL)
        effect->joint = kt_fuzz_name(bytes, m, joint);
    if (!is_in_joint(effect) || m->wild == KT_WILD_ALL)
        draw_ends(bytes, m, effect->between);
    if (effect->type == KT_EFFECT_TORQUE && effect->between[0].body == NULL)
        effect->between[0].body = m->body[0].name;
    draw_numbers(bytes, m->wild, effect);
    if (effect->type == KT_EFFECT_MOTOR)
        effect->torque = draw_function(bytes, m, 0.0, false);
    if (effect->type == KT_EFFECT_SERVO)
        effect->target = draw_function(bytes, m, 0.0, false);
    if (effect->type == KT_EFFECT_THRUST)
        effect->mass = draw_function(bytes, m, 1.0, false);
    if (effect->type == KT_EFFECT_JOINT_SPRING)
        effect->rest = draw_function(bytes, m, 0.0, false);
    if (effect->type == KT_EFFECT_FORCE || effect->type == KT_EFFECT_TORQUE)
        for (int k = 0; k < 3; k++)
            effect->value[k] = draw_function(bytes, m, 0.0, false);
    return true;
}

void kt_fuzz_attach(kt_bytes *bytes, kt_fuzz_mechanism *m) {
    kt_description *d = &m->description;
    const int loops = kt_bytes_pick(bytes, KT_FUZZ_LOOPS + 1), effects = kt_bytes_pick(bytes, KT_FUZZ_EFFECTS + 1);
    d->loops = m->loop;
    d->effects = m->effect;
    for (int i = 0; i < loops; i++)
        if (draw_loop(bytes, m, d->loop_count))
            d->loop_count++;
    for (int i = 0; i < effects; i++)
        if (draw_effect(bytes, m, d->effect_count))
            d->effect_count++;
}
