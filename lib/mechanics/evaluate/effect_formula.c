/* Values of the formulas of an effect. Their variables are read from the state and from the motion of links. Then the
 * formulas, or the law in C, are evaluated with these values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/effect_formula.h"

#include "dynamics/sweep.h"
#include "evaluate/relative_force.h"
#include "evaluate/variable.h"
#include "expression/wide.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A coordinate of a marker, or its rate, in the world. */
static double find_marker_coordinate(const kt_link_kinematics *kinematics, const kt_variable_record *variable) {
    const kt_link_kinematics *link = &kinematics[variable->link];
    const kt_vec3 arm = kt_mat3_apply(link->axes, variable->arm);
    const kt_vec3 found = variable->type == KT_VARIABLE_MARKER
                              ? kt_vec3_add(link->position, arm)
                              : kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm));
    return variable->component == 0 ? found.x : variable->component == 1 ? found.y : found.z;
}

/* The offset of a link's origin from that of a link that carries it. Returns false if that link does not carry the
 * link. */
static bool find_offset(const kt_model *model, const kt_link_kinematics *kinematics, int32_t link, int32_t carrier,
                        kt_vec3 *offset) {
    *offset = kt_vec3_make(0.0, 0.0, 0.0);
    for (; link > carrier; link = model->link[link].parent)
        *offset = kt_vec3_add(*offset, kinematics[link].offset);
    return link == carrier;
}

/* The joint force that balances gravity, as dynamics/force_frames.c computes it, from the poses of all links. */
static double find_gravity_force(const kt_model *model, const kt_link_kinematics *kinematics,
                                 const kt_variable_record *variable) {
    const kt_link *own = &model->link[variable->link];
    const kt_v4 up = -model->gravity;
    double mass = 0.0, forces[KT_DOF_MAX] = {0.0};
    kt_vec3 moment = {0.0, 0.0, 0.0}, offset;
    for (int32_t i = variable->link; i < (int32_t)model->n.link; i++) {
        const kt_link *link = &model->link[i];
        if (!find_offset(model, kinematics, i, variable->link, &offset))
            continue;
        mass += link->mass;
        moment = kt_vec3_add(
            moment, kt_vec3_add(kt_mat3_apply(kinematics[i].axes, link->moment), kt_vec3_scale(link->mass, offset)));
    }
    const kt_link_origin load = {.moment = kt_v4_cross(kt_v4_from(moment), up), .force = kt_v4_splat(mass) * up};
    kt_dof_projection p = {.load = &load, .tau = forces};
    kt_link_dofs_visit(model, kinematics, (size_t)variable->link, kt_project_wrench, &p);
    return forces[variable->v - own->v];
}

void kt_formula_variables_read(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                               const kt_effect_record *effect, const kt_dynamic_state *at, const kt_effect_end *end,
                               double values[KT_FORMULA_VARIABLE_MAX]) {
    const kt_variable_source from = {.data = data, .q = at->q, .v = at->v, .x = data->x, .t = at->t};
    const kt_variable_record *variable = model->variable + effect->variable;
    for (int32_t k = 0; k < effect->variable_count; k++, variable++) {
        const bool is_length = variable->type == KT_VARIABLE_LENGTH, is_speed = variable->type == KT_VARIABLE_SPEED;
        if (kinematics && (variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY)) {
            values[k] = find_marker_coordinate(kinematics, variable);
        } else if (kinematics && variable->type == KT_VARIABLE_GRAVITY) {
            values[k] = find_gravity_force(model, kinematics, variable);
        } else if (effect->relative.type && (is_length || is_speed)) { /* in a loop's coordinate */
            const kt_relative_motion motion = kt_relative_motion_of(model, effect, at->q, end);
            values[k] = is_speed ? motion.rate : motion.position;
        } else {
            values[k] = kt_variable_value(&from, variable, end);
        }
    }
}

const kt_expression *kt_formula_of(const kt_model *model, const kt_effect_record *effect, int k) {
    const size_t index = effect->formula[k];
    return index > 0 ? (const kt_expression *)(const void *)(model->number + index - 1) : NULL;
}

static int evaluate_law(const kt_effect_record *effect, const double *values, double out[6]) {
    double rates[KT_LAW_STATE_MAX] = {0.0};
    memset(out, 0, 6 * sizeof *out);
    if (effect->law_rate == 0)
        return effect->law(effect->user, values, out, NULL);
    const int code = effect->law(effect->user, values, NULL, rates);
    out[0] = rates[effect->law_rate - 1];
    return code;
}

/* In joints and between two ends there is one. */
int kt_formulas_evaluate(const kt_model *model, const kt_effect_record *effect, const double *values, double out[6]) {
    const int count = effect->ends == 1 ? 6 : 1;
    if (effect->law != NULL)
        return evaluate_law(effect, values, out);
    for (int k = 0; k < count; k++)
        out[k] = effect->formula[k] > 0 ? kt_expression_evaluate(kt_formula_of(model, effect, k), values) : 0.0;
    return 0;
}

void kt_formulas_explain(const kt_model *model, const kt_effect_record *effect, const double *values, char *text,
                         size_t size) {
    char fault[100];
    text[0] = '\0';
    for (int k = 0; k < 6 && effect->law == NULL; k++) {
        const kt_expression *formula = kt_formula_of(model, effect, k);
        if (formula == NULL || isfinite(kt_expression_evaluate(formula, values)) ||
            !kt_expression_fault(formula, values, fault, sizeof fault))
            continue;
        (void)snprintf(text, size, " (%s)", fault);
        return;
    }
}

int kt_law_differentiate(const kt_effect_record *effect, const double *values, double by[KT_FORMULA_VARIABLE_MAX][6]) {
    double all[KT_LAW_STATE_MAX * KT_FORMULA_VARIABLE_MAX] = {0.0};
    const bool is_rate = effect->law_rate > 0;
    const int count = effect->ends == 1 && !is_rate ? 6 : 1, n = effect->variable_count;
    const double *row = all + (is_rate ? (effect->law_rate - 1) * n : 0);
    const int code = effect->law_derivatives(effect->user, values, is_rate ? NULL : all, is_rate ? all : NULL);
    for (int j = 0; j < n; j++)
        for (int k = 0; k < 6; k++)
            by[j][k] = k < count ? row[k * n + j] : 0.0;
    return code;
}

/* d/dt of a law's values: sum_j of_time_j d/dx_j, with of_time the rates of its variables. */
static int differentiate_law_by_time(const kt_effect_record *effect, const double *values, const double *of_time,
                                     double rates[6]) {
    double by[KT_FORMULA_VARIABLE_MAX][6];
    const int code = kt_law_differentiate(effect, values, by);
    memset(rates, 0, 6 * sizeof *rates);
    for (int32_t j = 0; j < effect->variable_count; j++)
        for (int k = 0; k < 6; k++)
            rates[k] += of_time[j] * by[j][k];
    return code;
}

int kt_formula_time_derivatives(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                                const kt_effect_record *effect, const kt_dynamic_state *at, const kt_effect_end *end,
                                double rates[6]) {
    double values[KT_FORMULA_VARIABLE_MAX], of_time[KT_FORMULA_VARIABLE_MAX], y[3];
    kt_formula_variables_read(model, data, kinematics, effect, at, end, values);
    for (int32_t k = 0; k < effect->variable_count; k++)
        of_time[k] = model->variable[effect->variable + k].type == KT_VARIABLE_TIME;
    if (effect->law != NULL)
        return differentiate_law_by_time(effect, values, of_time, rates);
    for (int k = 0; k < 6; k++) {
        y[1] = 0.0;
        kt_expression_taylor(kt_formula_of(model, effect, k), values, of_time, NULL, y);
        rates[k] = y[1];
    }
    return 0;
}
