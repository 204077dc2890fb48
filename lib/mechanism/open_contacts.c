/* Evaluations in states in which an open contact touches.
 *
 * An evaluation takes the set of its model: a contact that is open in the set has no reaction. In a state in which such
 * a contact touches and does not part
 *
 *     g <= 0,   g' = J v - b' <= 0
 *
 * the result would leave its reaction or its impulse out, and is rejected. So is a result with friction of a joint that
 * the model lets slip in a direction that the joint does not have. Contacts that are released from the start do not
 * act. A simulation follows its contacts (simulation/contact.c), so that its data are exempt (kt_data.followed).
 *
 * The gaps are those of the model in which all contacts are closed. Its data lie behind those of the caller's model
 * (kt_data_size), which keep all results. */
#include "base/copy.h"
#include "mechanism/evaluate.h"
#include "model/switching.h"
#include "reduction/kernel.h"

#include <math.h>
#include <stdio.h>

/* Gaps up to this part of the mechanism's length, or of 1 m or rad, touch. Rates up to this number do not part. */
static const double touching = 1e-9, parting = 1e-9;

static kt_status refuse_open_contact(const kt_model *model, size_t loop, double t, double gap, kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "contact '%.60s', t = %.9g s", kt_loop_name(model, (int)loop), t);
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                        "its gap is %.3g and does not open, but it is open in the model's set: its reaction would be "
                        "left out. Close it (kt_loop_enable), take the model of a simulation in this state "
                        "(kt_simulation_model), or an elastic one (stiffness)",
                        gap);
}

static kt_status refuse_wrong_friction(const kt_model *model, size_t loop, double t, double rate, kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "friction '%.60s', t = %.9g s", kt_loop_name(model, (int)loop), t);
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                        "its friction slips in the model's set, but not at the rate %.3g of this state. Let it stick "
                        "(kt_loop_enable) or slip backwards (kt_effect_enable), take the model of a simulation in this "
                        "state (kt_simulation_model), or leave stick out",
                        rate);
}

/* Writes the gap of an open contact and its rate. Returns false if its equation is void. */
static bool find_gap(const kt_model *all, kt_data *data, const kt_loop_record *loop, const double *v, double *gap,
                     double *rate) {
    const kt_group *group = &all->group[loop->group];
    const kt_group_work w = kt_group_matrices(all, data, (size_t)loop->group, KT_ROWS_ALL);
    const int32_t row = kt_rows_slots(all, group, loop)[0];
    const double sign = loop->side == KT_SIDE_BELOW ? -1.0 : 1.0;
    if (row < 0)
        return false;
    double along = 0.0;
    if (kt_group_has_fronts(group)) {
        all->group_kernels->apply(all, data, (size_t)loop->group, KT_ROWS_ALL, v, kt_group_products(&w), NULL);
        along = kt_group_products(&w)[row];
    }
    for (int i = 0; i < w.m && !kt_group_has_fronts(group); i++)
        along += w.a[(size_t)row * (size_t)w.m + (size_t)i] * v[all->group_v[group->v + i]];
    *gap = sign * w.residual[row];
    *rate = sign * (along + w.rate[row]);
    return true;
}

static bool is_open_contact(const kt_loop_record *loop) {
    return loop->side != KT_SIDE_NONE && loop->contact && kt_loop_is_off(loop);
}

static bool has_open_contact(const kt_model *model) {
    for (size_t i = 0; i < model->n.loop; i++)
        if (is_open_contact(&model->loop[i]))
            return true;
    return false;
}

/* Checks friction of joints that sticks: forwards without its switches, backwards with that of its effect. */
static kt_status check_friction(const kt_model *model, const kt_model *all, size_t i, double t, const double *v,
                                kt_error *error) {
    const int effect = model->loop[i].friction - 1;
    const uint64_t stick = kt_switch_bits(model, kt_loop_switch(model, (int)i)),
                   back = kt_switch_bits(model, kt_effect_switch(model, effect)), on = model->set & (stick | back);
    const double rate = v[all->link[all->loop[i].link[0]].v];
    if (all->loop[i].type != KT_LOOP_RATES || (on & stick) != 0)
        return KT_OK;
    return (on != 0 ? -rate : rate) > parting ? KT_OK : refuse_wrong_friction(model, i, t, rate, error);
}

kt_status kt_open_contacts_check(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                 kt_error *error) {
    const kt_model *all = kt_family_closed(model);
    const size_t size = kt_data_size_followed(model);
    if (!KT_HAS_LOOPS || all == NULL || data->bytes < kt_data_size(model))
        return KT_OK;
    const kt_input input = {.q = q, .v = v};
    kt_status status = kt_input_check(model, &input, error);
    kt_data *other = (kt_data *)(void *)((char *)data + kt_arena_round(size));
    if (status != KT_OK)
        return status;
    if (has_open_contact(model)) {
        kt_data_adapt(all, other);
        kt_copy(other->x, data->x, model->n.x * sizeof *data->x);
        all->group_kernels->fill(all, other, t, q, v);
    }
    const double least = touching * fmax(1.0, all->length);
    for (size_t i = 0; status == KT_OK && i < model->n.loop; i++) {
        const kt_loop_record *loop = &all->loop[i];
        double gap, rate;
        if (model->loop[i].friction > 0 && model->loop[i].side == KT_SIDE_NONE)
            status = check_friction(model, all, i, t, v, error);
        else if (is_open_contact(&model->loop[i]) && find_gap(all, other, loop, v, &gap, &rate) && gap <= least &&
                 !(rate > parting))
            status = refuse_open_contact(model, i, t, gap, error);
    }
    return status;
}
