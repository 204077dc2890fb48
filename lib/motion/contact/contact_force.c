/* The force of a contact on its first body, F = N n + T.
 *
 * An elastic contact has the load of its effect. A hard contact that is closed has the reaction N n of its loop. If its
 * friction sticks, T is the reaction of the loop of its friction. If it slips, friction is an applied force, without a
 * loop, and
 *
 *     T = -mu N e,    e = s / |s|
 *
 * with the velocity of slip s. Slow slip has the direction e of a later instant (evaluate/slip_prediction.c). The
 * evaluation of the record left e in the data, so that the force balances the acceleration of the record. Loops of
 * planes report the wrench on the sphere. The loop of friction is one of rolling, and reports the wrench on the plane,
 * which is the opposite. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "base/where.h"
#include "evaluate/evaluate.h"
#include "kinetree/algebra.h"
#include "kinetree/record.h"

static kt_vec3 reaction_on_first_body(const kt_record *record, int loop) {
    const double sign = record->model->loop[loop].type == KT_LOOP_ROLLING ? -1.0 : 1.0;
    return kt_vec3_scale(sign, record->loop_reactions[loop].force);
}

/* The direction against which friction of a contact acts that slips. */
static kt_vec3 direction_of_friction(const kt_record *record, int loop) {
    const kt_data *data = record->data;
    size_t k = 0;
    for (int i = 0; i < loop; i++)
        k += record->model->loop[i].slips > 0;
    const double *e = data->slip_direction + 2 * k;
    return kt_vec3_add(kt_vec3_scale(e[0], data->slip_frame[k].axis[0]),
                       kt_vec3_scale(e[1], data->slip_frame[k].axis[1]));
}

/* The force of a hard contact on the first body: the reaction of its normal row, with the reaction of friction that
 * sticks, or with the friction of slip against its direction. */
static void find_hard_contact(const kt_record *record, const kt_effect_record *effect, kt_contact_load *load) {
    const kt_model *model = record->model;
    const int loop = effect->loop, friction = loop + 1;
    if (kt_loop_is_off(&model->loop[loop]))
        return;
    load->touches = true;
    load->force = reaction_on_first_body(record, loop);
    if (effect->loops > 1 && !kt_loop_is_off(&model->loop[friction])) {
        load->sticks = !(kt_vec3_norm(load->slip) >= record->slow_slip);
        load->force = kt_vec3_add(load->force, reaction_on_first_body(record, friction));
    } else if (model->loop[loop].slips > 0) {
        const double size = effect->friction * kt_vec3_norm(load->force);
        load->force = kt_vec3_sub(load->force, kt_vec3_scale(size, direction_of_friction(record, loop)));
    }
}

kt_status kt_record_contact(const kt_record *record, int effect, kt_contact_load *load, kt_error *error) {
    if (KT_IS_MISSING(error, record, load))
        return KT_ERROR_ARGUMENT;
    const kt_model *model = record->model;
    const kt_effect_record *found = model != NULL ? kt_effect_record_find(model, effect) : NULL;
    if (found == NULL || found->type != KT_EFFECT_CONTACT)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "effect", "effect %d of the model is no contact", effect);
    if (record->data == NULL || KT_IS_OTHER_DATA(NULL, model, record->data) ||
        (found->loops > 0 && record->loop_reactions == NULL))
        return kt_error_set(error, KT_ERROR_ARGUMENT,
                            kt_where_at("contact", kt_effect_name(model, effect), record->t).text,
                            "the record has no reactions, which are the forces of hard contacts; request "
                            "KT_RECORD_REACTION in kt_run.record");
    const kt_contact_kinematics at = kt_contact_kinematics_find(record->data, found);
    kt_contact_load out = {.point = at.point, .normal = at.normal, .slip = at.slip};
    if (found->loops > 0) {
        find_hard_contact(record, found, &out);
    } else {
        kt_effect_load elastic;
        const kt_status status =
            kt_effect_evaluate(model, record->data, record->t, record->q, record->v, effect, &elastic, error);
        if (status != KT_OK)
            return status;
        out.force = elastic.wrench[0].force;
        out.touches = kt_vec3_norm(out.force) > 0.0;
    }
    *load = out;
    return KT_OK;
}
