/* The effects of a scene, summed into joint forces and wrenches on bodies. The sum runs batch by batch, so that nothing
 * is executed for types that the scene does not have. Powers are summed only on request, because the sum is compiled
 * once with and once without powers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "evaluate/effect_ends.h"
#include "evaluate/effect_formula.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "evaluate/path_force.h"
#include "evaluate/relative_force.h"
#include "kinetree/dynamics.h"
#include "model/scratch.h"

#include <stdio.h>
#include <string.h>

/* The state of a summation. */
typedef struct sum {
    const kt_model *model;
    kt_data *data;
    const kt_dynamic_state *at;
    kt_power *power;                /* NULL: powers are not summed */
    bool differenced;               /* only a caller's own effects without derivatives */
    double excess;                  /* the sum of x - x over all forces: 0 if finite, otherwise NaN */
    const kt_effect_record *failed; /* the effect whose callback did not return 0 */
    int code;                       /* the code that the callback returned */
} sum;

/* ---- one effect -------------------------------------------------------------------------------------------------- */

/* Adds the wrenches on the ends to the wrenches on their bodies. */
KT_INLINE void add_wrenches(sum *s, const kt_effect_record *effect, const kt_wrench *wrench) {
    s->excess += kt_effect_wrenches_add(s->data, effect, wrench, s->data->applied);
}

KT_INLINE void add_balance(sum *s, const kt_effect_balance *balance) {
    s->power->dissipated += balance->dissipated;
    s->power->supplied += balance->supplied;
    s->excess += (balance->dissipated - balance->dissipated) + (balance->supplied - balance->supplied);
}

/* The surroundings of formulas: a state, and the source of their markers. */
typedef struct surroundings {
    const kt_data *data;
    const kt_link_kinematics *kinematics; /* NULL: the links that carry forces */
    const kt_dynamic_state *at;
} surroundings;

/* A coordinate that a force acts in, and its rate. */
typedef struct coordinate {
    double position, rate;
} coordinate;

/* Returns the code of a callback, otherwise 0. */
static int evaluate_formulas(const kt_model *model, const surroundings *in, const kt_effect_record *effect,
                             const kt_effect_end *end, double out[6]) {
    double values[KT_FORMULA_VARIABLE_MAX];
    kt_formula_variables_read(model, in->data, in->kinematics, effect, in->at, end, values);
    return kt_formulas_evaluate(model, effect, values, out);
}

/* Computes the force of an effect in a coordinate: of a joint, or between two ends of a loop. Returns the code of a
 * callback, otherwise 0. */
KT_INLINE int evaluate_joint_force(const kt_model *model, const surroundings *in, const kt_effect_record *effect,
                                   const kt_effect_kind *kind, const kt_effect_end *end, coordinate x, double *force,
                                   kt_effect_balance *balance) {
    if (kind->joint_force) {
        *force = kind->joint_force(effect, model->number, x.position, x.rate, in->at->t, balance);
        return 0;
    }
    if (kind->formula_wrench) {
        double values[6];
        const int code = evaluate_formulas(model, in, effect, end, values);
        *force = values[0];
        if (balance)
            *balance = (kt_effect_balance){.supplied = values[0] * x.rate};
        return code;
    }
    *force = 0.0;
    if (balance)
        *balance = (kt_effect_balance){0.0, 0.0, 0.0};
    return effect->joint_force(effect->user, in->at->t, x.position, x.rate, force, balance);
}

/* Computes the force of an effect in a coordinate of a loop, and its wrenches. Returns the code of a callback,
 * otherwise 0. */
static int evaluate_in_loop(const kt_model *model, const surroundings *in, const kt_effect_record *effect,
                            const kt_effect_end *end, double *force, kt_wrench wrench[2], kt_effect_balance *balance) {
    const kt_relative_motion motion = kt_relative_motion_of(model, effect, in->at->q, end);
    const int code = evaluate_joint_force(model, in, effect, kt_effect_kind_of(effect->type), end,
                                          (coordinate){motion.position, motion.rate}, force, balance);
    kt_relative_wrenches(&motion, end, *force, wrench);
    return code;
}

/* Computes the wrenches of an effect with ends. Returns the code of a callback, otherwise 0. */
KT_INLINE int evaluate_wrench(const kt_model *model, const surroundings *in, const kt_effect_record *effect,
                              const kt_effect_kind *kind, const kt_effect_end *end, kt_wrench wrench[2],
                              kt_effect_balance *balance) {
    if (kind->wrench) {
        kind->wrench(effect, model->number, end, in->at->t, wrench, balance);
        return 0;
    }
    if (effect->relative.type) {
        double force;
        return evaluate_in_loop(model, in, effect, end, &force, wrench, balance);
    }
    if (kind->formula_wrench) {
        double values[6];
        const int code = evaluate_formulas(model, in, effect, end, values);
        kind->formula_wrench(effect, values, end, wrench, balance);
        return code;
    }
    memset(wrench, 0, 2 * sizeof *wrench);
    if (balance)
        *balance = (kt_effect_balance){0.0, 0.0, 0.0};
    return effect->wrench(effect->user, in->at->t, end, wrench, balance);
}

/* Computes the force of any effect, and the wrenches on its ends. Returns the code of a callback, otherwise 0. */
static int evaluate_load(const kt_model *model, const surroundings *in, const kt_effect_record *effect,
                         const kt_effect_end end[2], kt_effect_load *load, kt_effect_balance *balance) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    if (effect->relative.type)
        return evaluate_in_loop(model, in, effect, end, &load->joint_force, load->wrench, balance);
    if (effect->path_count > 0) {
        kt_path_value path;
        const int code =
            kt_path_force_find(model, in->data, in->kinematics, effect, in->at, &path, &load->joint_force, balance);
        for (int k = 0; k < 2; k++)
            load->wrench[k].force = kt_vec3_scale(load->joint_force, path.end[k]);
        load->wrench[0].moment.x = path.length - path.length; /* NaN: it has no line */
        return code;
    }
    if (effect->ends > 0)
        return evaluate_wrench(model, in, effect, kind, end, load->wrench, balance);
    const kt_link *link = &model->link[effect->link[0]];
    return evaluate_joint_force(model, in, effect, kind, NULL, (coordinate){in->at->q[link->q], in->at->v[link->v]},
                                &load->joint_force, balance);
}

static bool is_load_finite(const kt_effect_load *load) {
    double excess = load->joint_force - load->joint_force;
    for (int k = 0; k < load->end_count; k++)
        excess += kt_effect_excess(&load->wrench[k]);
    return excess == 0.0;
}

/* ---- batches ----------------------------------------------------------------------------------------------------- */

/* Returns whether all callbacks succeeded. */
KT_INLINE bool apply_joint_forces(sum *s, const kt_effect_batch *batch) {
    const kt_effect_kind *kind = batch->kind;
    kt_effect_balance balance;
    /* cppcheck-suppress uninitvar ; its address is taken, no value */
    kt_effect_balance *const asked = s->power ? &balance : NULL;
    for (int32_t i = batch->first; i < batch->first + batch->count; i++) {
        const kt_effect_record *effect = &s->model->effect[i];
        const kt_link *link = &s->model->link[effect->link[0]];
        const coordinate x = {s->at->q[link->q], s->at->v[link->v]};
        double force;
        if (s->differenced && !kt_effect_is_differenced(effect))
            continue;
        const surroundings in = {.data = s->data, .at = s->at};
        s->code = evaluate_joint_force(s->model, &in, effect, kind, NULL, x, &force, asked);
        s->failed = effect;
        if (s->code != 0)
            return false;
        s->data->tau[link->v] += force;
        s->excess += force - force;
        if (asked)
            add_balance(s, asked);
    }
    return true;
}

/* Returns the code of a callback, otherwise 0. */
static int apply_along_path(sum *s, const kt_effect_record *effect, kt_effect_balance *asked) {
    kt_path_value path;
    double force;
    const int code = kt_path_force_find(s->model, s->data, NULL, effect, s->at, &path, &force, asked);
    s->excess += kt_path_wrenches_add(s->model, s->data, effect, force, path.unit, s->data->applied);
    return code;
}

/* Adds the wrenches of the effects of a batch, which act on ends or along paths. Returns whether all callbacks
 * succeeded. */
KT_INLINE bool apply_wrenches(sum *s, const kt_effect_batch *batch) {
    const kt_effect_kind *kind = batch->kind;
    kt_effect_balance balance;
    /* cppcheck-suppress uninitvar ; its address is taken, no value */
    kt_effect_balance *const asked = s->power ? &balance : NULL;
    for (int32_t i = batch->first; i < batch->first + batch->count; i++) {
        const kt_effect_record *effect = &s->model->effect[i];
        kt_effect_end end[2];
        kt_wrench wrench[2];
        if (s->differenced && !kt_effect_is_differenced(effect))
            continue;
        s->failed = effect;
        if (effect->path_count > 0) {
            s->code = apply_along_path(s, effect, asked);
        } else {
            kt_effect_ends_of(s->data, effect, end);
            const surroundings in = {.data = s->data, .at = s->at};
            s->code = evaluate_wrench(s->model, &in, effect, kind, end, wrench, asked);
            if (s->code == 0)
                add_wrenches(s, effect, wrench);
        }
        if (s->code != 0)
            return false;
        if (asked)
            add_balance(s, asked);
    }
    return true;
}

/* Whether some effect acts on joint coordinates. Batches of such effects come before those of effects with ends. */
KT_INLINE bool acts_on_joints(const kt_model *model) { return model->n.effect > 0 && model->batch[0].ends == 0; }

void kt_effects_recall(const kt_model *model, const kt_data *data, kt_dynamic_state *at) {
    if (acts_on_joints(model))
        at->tau = data->tau;
    if (model->n.force_link > 0)
        at->external = data->applied;
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

/* "effect 'tether' (spring) between 'hull' and 'world', t = 0.5 s" */
static kt_where_text name_effect_at_fault(const sum *s, const kt_effect_record *effect) {
    const char *type = kt_effect_type_name((kt_effect_type)effect->type);
    char own[56], on[72];
    if (effect->law_rate > 0) /* of an auxiliary state */
        return kt_where_format("the law of state '%.60s', t = %.9g s", s->model->text + effect->name, s->at->t);
    if (effect->name)
        (void)snprintf(own, sizeof own, "effect '%.24s'", s->model->text + effect->name);
    else
        (void)snprintf(own, sizeof own, "effects[%d]", (int)effect->source);
    if (effect->ends == 2)
        (void)snprintf(on, sizeof on, "between '%.24s' and '%.24s'", kt_body_name(s->model, effect->body[0]),
                       kt_body_name(s->model, effect->body[1]));
    else
        (void)snprintf(on, sizeof on, "on %s '%.24s'", effect->ends ? "body" : "joint",
                       effect->ends ? kt_body_name(s->model, effect->body[0])
                                    : kt_joint_name(s->model, effect->body[0]));
    return kt_where_format("%s (%s) %s, t = %.9g s", own, type, on, s->at->t);
}

static kt_status reject_code(const sum *s, kt_error *error) {
    const kt_where_text where = name_effect_at_fault(s, s->failed);
    if (s->code < 0)
        return kt_error_set(error, KT_ERROR_CALLBACK, where.text, "its callback stopped (code %d)", s->code);
    return kt_error_set(error, KT_ERROR_EFFECT, where.text, "its callback cannot compute its force here (code %d)",
                        s->code);
}

kt_status kt_effect_reject_derivatives(const kt_model *model, const kt_effect_record *effect, double t, int code,
                                       kt_error *error) {
    const sum s = {.model = model, .at = &(kt_dynamic_state){.t = t}, .failed = effect, .code = code};
    if (code != 0)
        return reject_code(&s, error);
    return kt_error_set(error, KT_ERROR_NOT_FINITE, name_effect_at_fault(&s, effect).text,
                        "its callback gave derivatives that are not finite");
}

/* Finds the ends of an effect, or the ends that represent its path. */
static void find_effect_ends(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                             kt_path_value *path, kt_effect_end end[2]) {
    if (effect->path_count > 0) {
        kt_path_value_find(model, data, NULL, effect, path);
        kt_path_as_ends(path->length, path->rate, end);
    } else {
        kt_effect_ends_of(data, effect, end);
    }
}

/* The operation of an effect's formulas that is not finite, "" if there is none. */
static void explain_force(const sum *s, const kt_effect_record *effect, char *text, size_t size) {
    double values[KT_FORMULA_VARIABLE_MAX];
    kt_effect_end end[2];
    text[0] = '\0';
    if (effect->type != KT_EFFECT_EXPRESSION)
        return;
    kt_path_value path;
    find_effect_ends(s->model, s->data, effect, &path, end);
    kt_formula_variables_read(s->model, s->data, NULL, effect, s->at, end, values);
    kt_formulas_explain(s->model, effect, values, text, size);
}

/* The error of an effect whose force or power is not finite. The advice names the argument of the formula that is at
 * fault, if there is one. */
static kt_status reject_force(const sum *s, const kt_effect_record *effect, kt_error *error) {
    const kt_where_text where = name_effect_at_fault(s, effect);
    char fault[120];
    if (effect->type == KT_EFFECT_CUSTOM || (effect->law != NULL))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text,
                            "its callback gave a force or power that is not finite");
    explain_force(s, effect, fault, sizeof fault);
    return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text, "its force is not finite%s; %s", fault,
                        fault[0] != '\0' ? "bound the argument, with max(x, 0) or clamp(x, a, b), or end the run before"
                                         : "look for a number or a function of it that is huge there");
}

/* Whether the effect's force or power is not finite. */
static bool is_culprit(const sum *s, const kt_effect_record *effect) {
    kt_effect_balance balance = {0.0, 0.0, 0.0}, *asked = s->power ? &balance : NULL;
    kt_effect_load load = {.end_count = effect->ends};
    kt_effect_end end[2];
    const surroundings in = {.data = s->data, .at = s->at};
    if (effect->ends > 0 && effect->path_count == 0)
        kt_effect_ends_of(s->data, effect, end);
    (void)evaluate_load(s->model, &in, effect, end, &load, asked);
    return !is_load_finite(&load) || !isfinite(balance.dissipated) || !isfinite(balance.supplied);
}

/* Names the effect at fault; returns KT_OK if only the test sum overflowed. */
static kt_status blame_effect(const sum *s, kt_error *error) {
    const kt_input input = {
        .q = s->at->q, .v = s->at->v, .x = s->at->tau, .what = "force or torque", .external = s->at->external};
    const kt_status status = kt_input_check(s->model, &input, error);
    for (size_t i = 0; i < s->model->n.effect && status == KT_OK; i++) {
        const kt_effect_record *effect = &s->model->effect[i];
        if (!is_culprit(s, effect))
            continue;
        return reject_force(s, effect, error);
    }
    return status;
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

/* Makes at->tau and at->external the sums; or the error names the effect at fault. s->power and s->differenced are
 * constants where this is inlined. */
KT_INLINE kt_status sum_all(sum *s, kt_dynamic_state *at, kt_error *error) {
    const kt_model *model = s->model;
    kt_data *data = s->data;
    s->at = at;
    if (acts_on_joints(model))
        memcpy(data->tau, at->tau ? at->tau : model->zero, model->n.v * sizeof(double));
    if (model->n.force_link > 0) {
        kt_copy_or_clear(data->applied, at->external, model->n.body * sizeof *data->applied);
        kt_force_frames_sweep(model, data, at->q, at->v);
    }
    for (size_t i = 0; i < model->n.batch; i++)
        if ((!s->differenced || model->batch[i].type == KT_EFFECT_CUSTOM) &&
            !(model->batch[i].ends ? apply_wrenches(s, &model->batch[i]) : apply_joint_forces(s, &model->batch[i])))
            return reject_code(s, error);
    const kt_status status = s->excess == 0.0 ? KT_OK : blame_effect(s, error);
    kt_effects_recall(model, data, at);
    return status;
}

kt_status kt_effects_apply(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_error *error) {
    sum s = {.model = model, .data = data, .power = NULL};
    return sum_all(&s, at, error);
}

#if KT_IS_OF_VALUES
/* Adds the derivatives by time that a caller's own effect provides. Returns the code of its callback. */
static int differentiate_own(sum *s, const kt_effect_record *effect) {
    const kt_link *link = &s->model->link[effect->link[0]];
    kt_effect_derivatives of_ends = {.by_time = {{.force = {0.0, 0.0, 0.0}}}};
    double derivatives[3] = {0.0, 0.0, 0.0};
    kt_effect_end end[2];
    if (effect->ends == 0) {
        const int code =
            effect->joint_force_derivatives(effect->user, s->at->t, s->at->q[link->q], s->at->v[link->v], derivatives);
        s->data->tau[link->v] += derivatives[2];
        return code;
    }
    kt_effect_ends_of(s->data, effect, end);
    int code;
    if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, end);
        code = effect->joint_force_derivatives(effect->user, s->at->t, motion.position, motion.rate, derivatives);
        kt_relative_wrenches(&motion, end, derivatives[2], of_ends.by_time);
    } else {
        code = effect->wrench_derivatives(effect->user, s->at->t, end, &of_ends);
    }
    add_wrenches(s, effect, of_ends.by_time);
    return code;
}

/* Adds the derivatives by time of an effect with formulas: in a joint, along a path, in the coordinate of a loop, or on
 * its ends. */
static int differentiate_formula(sum *s, const kt_effect_record *effect) {
    kt_path_value path;
    kt_effect_end end[2];
    kt_wrench wrench[2];
    double rates[6];
    find_effect_ends(s->model, s->data, effect, &path, end);
    const int code = kt_formula_time_derivatives(s->model, s->data, NULL, effect, s->at, end, rates);
    if (code != 0)
        return code;
    if (effect->path_count > 0) {
        s->excess += kt_path_wrenches_add(s->model, s->data, effect, rates[0], path.unit, s->data->applied);
    } else if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, s->at->q, end);
        kt_relative_wrenches(&motion, end, rates[0], wrench);
        add_wrenches(s, effect, wrench);
    } else if (effect->ends == 0) {
        s->data->tau[s->model->link[effect->link[0]].v] += rates[0];
    } else {
        kt_effect_kind_of(effect->type)->formula_wrench(effect, rates, end, wrench, NULL);
        add_wrenches(s, effect, wrench);
    }
    return 0;
}

/* Adds the derivatives by time of an effect with functions of time: in a joint, in the coordinate of a loop, or on its
 * ends. Effects without such functions add nothing. */
static void differentiate_functions(sum *s, const kt_effect_record *effect) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    const double *q = s->at->q, *v = s->at->v, t = s->at->t;
    kt_effect_end end[2];
    kt_wrench wrench[2];
    if (effect->ends == 0) {
        const kt_link *link = &s->model->link[effect->link[0]];
        if (kind->joint_time_derivative)
            s->data->tau[link->v] += kind->joint_time_derivative(effect, s->model->number, q[link->q], v[link->v], t);
        return;
    }
    if (effect->relative.type ? !kind->joint_time_derivative : !kind->time_derivative)
        return;
    kt_effect_ends_of(s->data, effect, end);
    if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(s->model, effect, q, end);
        const double rate = kind->joint_time_derivative(effect, s->model->number, motion.position, motion.rate, t);
        kt_relative_wrenches(&motion, end, rate, wrench);
    } else {
        kind->time_derivative(effect, s->model->number, end, t, wrench);
    }
    add_wrenches(s, effect, wrench);
}

kt_status kt_effects_apply_rising(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_error *error) {
    sum s = {.model = model, .data = data, .at = at};
    const kt_status status = kt_effects_apply(model, data, at, error);
    for (size_t i = 0; i < model->n.effect && status == KT_OK; i++) {
        const kt_effect_record *effect = &model->effect[i];
        int code = 0;
        if (effect->type == KT_EFFECT_CUSTOM)
            code = differentiate_own(&s, effect);
        else if (kt_effect_kind_of(effect->type)->formula_wrench)
            code = differentiate_formula(&s, effect);
        else
            differentiate_functions(&s, effect);
        if (code != 0)
            return kt_effect_reject_derivatives(model, effect, at->t, code, error);
    }
    return status;
}
#endif

kt_status kt_effects_apply_differenced(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_error *error) {
    sum s = {.model = model, .data = data, .power = NULL, .differenced = true};
    return sum_all(&s, at, error);
}

kt_status kt_effects_account(const kt_model *model, kt_data *data, kt_dynamic_state *at, kt_power *power,
                             kt_error *error) {
    sum s = {.model = model, .data = data, .power = power};
    return sum_all(&s, at, error);
}

/* Adds J' W = g(q) - (g(q) - J' W), from inverse dynamics at rest with the wrenches and without. */
static kt_status add_wrenches_along(const kt_model *model, kt_data *data, const double *q, const kt_wrench *wrenches,
                                    double *forces, kt_error *error) {
    double *with = kt_scratch_part(model, data, 0), *without = kt_scratch_part(model, data, 1);
    kt_status status = kt_inverse_trusted(model, data, q, NULL, NULL, wrenches, with, error);
    if (status == KT_OK)
        status = kt_inverse_trusted(model, data, q, NULL, NULL, NULL, without, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        forces[i] += without[i] - with[i];
    return status;
}

static kt_status reject_unknown_load(kt_error *error) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, "data",
                        "friction is proportional to a reaction; compute the accelerations of this q and v first");
}

kt_status kt_effect_forces(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           double *forces, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, forces || !model->n.v))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    kt_dynamic_state at = {.t = t, .q = q, .v = v, .tau = model->zero};
    double *all = kt_scratch_part(model, data, 2);
    const kt_input input = {.q = q, .v = v};
    kt_status status = kt_input_check(model, &input, error);
    if (status == KT_OK && model->n.loaded > 0 && data->load_state != kt_state_hash(model, q, v))
        return reject_unknown_load(error);
    if (status == KT_OK)
        status = kt_effects_apply(model, data, &at, error);
    if (status != KT_OK)
        return status;
    memcpy(all, at.tau, model->n.v * sizeof *all);
    if (at.external)
        status = add_wrenches_along(model, data, q, at.external, all, error);
    for (size_t k = 0; k < model->n.loaded; k++)
        all[model->link[kt_loaded_effect(model, k)->link[0]].v] += data->load_friction[k];
    return status == KT_OK ? kt_commit(model, NULL, all, forces, "force", error) : status;
}

double kt_effect_energy(const kt_model *model, kt_data *data, double t, const double *q, const double *v) {
    if (!kt_data_serve(model, data) || (!q && model->n.q > 0))
        return (double)NAN;
    double energy = 0.0;
    v = v ? v : model->zero;
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    if (model->n.force_link > 0)
        kt_force_frames_sweep(model, data, q, v);
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        kt_effect_balance balance = {0.0, 0.0, 0.0};
        kt_effect_load load;
        kt_effect_end end[2];
        const surroundings in = {.data = data, .at = &at};
        if (effect->path_count > 0) /* it stores none */
            continue;
        if (effect->ends)
            kt_effect_ends_of(data, effect, end);
        energy += evaluate_load(model, &in, effect, end, &load, &balance) == 0 ? balance.energy : (double)NAN;
    }
    return energy;
}

/* ---- one effect, for queries ------------------------------------------------------------------------------------- */

kt_status kt_effect_state_check(const kt_model *model, const kt_data *data, const double *q, const double *v,
                                bool has_ends, kt_error *error) {
    const kt_input input = {.q = q, .v = v};
    const kt_status status = kt_input_check(model, &input, error);
    if (status == KT_OK && has_ends && data->state != kt_state_hash(model, q, v ? v : model->zero))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "data",
                            "they hold the kinematics of another state; call kt_kinematics_update with this q and v "
                            "first");
    return status;
}

int kt_effect_load_find(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                        const kt_effect_record *effect, kt_effect_end end[2], kt_effect_load *load) {
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    const surroundings in = {.data = data, .kinematics = data->kinematics, .at = &at};
    *load = (kt_effect_load){.end_count = effect->ends};
    kt_effect_ends_find(data, effect, end);
    for (int k = 0; k < effect->ends; k++)
        load->point[k] = end[k].point;
    if ((size_t)(effect - model->effect) >= model->n.effect) /* switched off: it exerts nothing */
        return 0;
    const int code = evaluate_load(model, &in, effect, end, load, NULL);
    load->joint_force += kt_load_friction_of(model, data, q, v, effect);
    return code;
}

/* Rejects an effect whose force a loop bears. */
static kt_status reject_borne(const kt_model *model, const kt_effect_record *effect, double t, kt_error *error) {
    const int loop = kt_effect_closed_loop(model, effect);
    if (loop < 0)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, kt_where_at("effect", model->text + effect->name, t).text,
                        "it is hard and closed, or it sticks: its force is the reaction of the loop '%.60s' "
                        "(kt_reaction_evaluate, kt_multiplier_evaluate)",
                        kt_loop_name(model, loop));
}

kt_status kt_effect_evaluate(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                             int effect, kt_effect_load *load, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, load))
        return KT_ERROR_ARGUMENT;
    const kt_effect_record *record = kt_effect_record_find(model, effect);
    if (!record)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "effect", "there is no effect %d: the model has %lu", effect,
                            (unsigned long)(model->n.effect + model->n.effect_off));
    kt_status status = kt_effect_state_check(model, data, q, v, record->ends > 0 || record->variable_count > 0, error);
    if (status == KT_OK)
        status = reject_borne(model, record, t, error);
    if (status != KT_OK)
        return status;
    sum s = {.model = model, .at = &(kt_dynamic_state){.t = t}, .failed = record};
    kt_effect_load found;
    kt_effect_end end[2];
    s.code = kt_effect_load_find(model, data, t, q, v ? v : model->zero, record, end, &found);
    if (s.code != 0)
        return reject_code(&s, error);
    if (isnan(kt_load_friction_of(model, data, q, v ? v : model->zero, record)))
        return reject_unknown_load(error);
    if (!is_load_finite(&found))
        return reject_force(&s, record, error);
    *load = found;
    return KT_OK;
}
