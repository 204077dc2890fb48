/* The effects of a scene, summed into joint forces and wrenches on bodies. */
#include "dynamics/kernel.h"
#include "effect/kind.h"
#include "kinetree/dynamics.h"
#include "reduction/evaluate.h"

#include <string.h>

/* An end as the links' motion and places have it; places are counted from the world's origin. */
static kt_effect_end end_of(const kt_model *model, const kt_data *data, const kt_effect_record *effect, int k) {
    const kt_link_motion *link = &data->motion[effect->link[k]];
    const kt_link_place *place = &data->place[effect->link[k]];
    const kt_mat3 axes = kt_v4_mat3(link->axes);
    const kt_v4 arm = kt_v4_from(kt_mat3_apply(axes, effect->frame[k].position));
    (void)model;
    kt_effect_end end;
    end.axes = kt_mat3_multiply(axes, effect->frame[k].rotation);
    end.point = kt_v4_vec3(place->position + arm);
    end.omega = kt_v4_vec3(link->omega);
    end.velocity = kt_v4_vec3(place->velocity + kt_v4_cross(link->omega, arm));
    return end;
}

/* Adds a wrench about a point to what its body feels about its frame's origin. */
static void add_wrench(const kt_model *model, const kt_data *data, int32_t body, const kt_effect_end *end,
                       kt_wrench wrench, kt_wrench *bodies) {
    const kt_vec3 arm = kt_vec3_sub(end->point, kt_body_pose(model, data, body).position);
    const kt_vec3 moment = kt_vec3_add(wrench.moment, kt_vec3_cross(arm, wrench.force));
    bodies[body].moment = kt_vec3_add(bodies[body].moment, moment);
    bodies[body].force = kt_vec3_add(bodies[body].force, wrench.force);
}

static bool any_ends(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (kt_effect_kinds[model->effect[i].type]->ends)
            return true;
    return false;
}

/* What one effect tells, into the powers. */
KT_INLINE void account(const kt_effect_balance *balance, kt_power *power) {
    if (!power)
        return;
    power->dissipated += balance->dissipated;
    power->supplied += balance->supplied;
}

/* power is known where this is expanded: who does not ask for it does not even test whether. */
KT_INLINE void apply(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                     const double **tau, const kt_wrench **external, kt_power *power) {
    kt_effect_balance balance;
    kt_effect_balance *const told = power ? &balance : NULL;
    const bool ends = any_ends(model);
    memcpy(data->tau, *tau ? *tau : model->zero, model->n.v * sizeof(double));
    *tau = data->tau;
    if (ends) {
        if (*external)
            memcpy(data->pushed, *external, model->n.body * sizeof *data->pushed);
        else
            memset(data->pushed, 0, model->n.body * sizeof *data->pushed);
        *external = data->pushed;
        kt_kinematics_sweep(model, data, q, v);
    }
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_effect_kind *kind = kt_effect_kinds[effect->type];
        if (!kind->ends) {
            const kt_link *link = &model->link[effect->link[0]];
            data->tau[link->v] += kind->drive(effect, model->number, q[link->q], v[link->v], t, told);
            account(told, power);
            continue;
        }
        kt_effect_end end[2];
        kt_wrench wrench[2];
        for (int k = 0; k < kind->ends; k++)
            end[k] = end_of(model, data, effect, k);
        kind->push(effect, model->number, end, t, wrench, told);
        account(told, power);
        for (int k = 0; k < kind->ends; k++)
            add_wrench(model, data, effect->body[k], &end[k], wrench[k], data->pushed);
    }
}

void kt_effects_apply(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const double **tau, const kt_wrench **external) {
    apply(model, data, t, q, v, tau, external, NULL);
}

void kt_effects_account(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                        const double **tau, const kt_wrench **external, kt_power *power) {
    apply(model, data, t, q, v, tau, external, power);
}

double kt_effect_energy(const kt_model *model, const kt_data *data, double t, const double *q, const double *v) {
    double energy = 0.0;
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_effect_kind *kind = kt_effect_kinds[effect->type];
        kt_effect_balance balance = {0.0, 0.0, 0.0};
        if (kind->ends) {
            kt_effect_end end[2];
            kt_wrench wrench[2];
            for (int k = 0; k < kind->ends; k++)
                end[k] = end_of(model, data, effect, k);
            kind->push(effect, model->number, end, t, wrench, &balance);
        } else {
            const kt_link *link = &model->link[effect->link[0]];
            (void)kind->drive(effect, model->number, q[link->q], v[link->v], t, &balance);
        }
        energy += balance.energy;
    }
    return energy;
}
