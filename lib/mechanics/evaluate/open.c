/* Evaluations in states in which an open contact touches.
 *
 * An evaluation takes the set of its model: a contact that is open in the set has no reaction. In a state in which such
 * a contact touches and does not part
 *
 *     g <= 0,   g' = J v - b' <= 0
 *
 * the result would leave its reaction or its impulse out, and is rejected. So is a result with friction of a joint that
 * the model lets slip in a direction that the joint does not have. Contacts that are released from the start do not
 * act. Masked friction that is released from the start would act in compiled models, and is rejected in such a model. A
 * simulation follows its contacts (contact/contact_part.c), so that its data are exempt (kt_data.followed).
 *
 * The equations are those of the model in which all contacts are closed. Only poses are computed, and velocities only
 * if a gap has closed. Both lie in the caller's data, in which the following evaluation overwrites them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/open.h"

#include "base/where.h"
#include "evaluate/evaluate.h"
#include "evaluate/slip.h"
#include "loop/loop.h"
#include "model/switching.h"
#include "reduction/kernel.h"

#include <math.h>

/* Gaps up to this part of the contact's unit touch. Rates up to this part of the speed of the motion do not part. */
static const double touching = 1e-9, parting = 1e-9;

/* The speed of the motion, at least that of a fall from the mechanism's length, over this length, 1/s. */
static double pace_of(const kt_model *all, const double *v) {
    const double g = kt_vec3_norm(kt_v4_vec3(all->gravity)), fall = sqrt(g * all->length);
    const double speed = kt_largest_speed(all, v);
    return fmax(speed, fall) / all->length;
}

static kt_status reject_open_contact(const kt_model *model, size_t loop, double t, double gap, kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED,
                        kt_where_format("contact '%.60s', t = %.9g s", kt_loop_name(model, (int)loop), t).text,
                        "its gap is %.3g and does not open, but the model leaves it open, without a reaction; take a "
                        "simulation that starts in this state, or an elastic contact (stiffness)",
                        gap);
}

static kt_status reject_wrong_friction(const kt_model *model, size_t loop, double t, double rate, kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED,
                        kt_where_format("friction '%.60s', t = %.9g s", kt_loop_name(model, (int)loop), t).text,
                        "the model lets it slip, but not at the rate %.3g of this state; take a "
                        "simulation that starts in this state, or leave stick out",
                        rate);
}

/* Rejects masked friction that is released at first (compile/variants.c), because such friction slips in the compiled
 * model. */
static kt_status reject_released_friction(const kt_model *model, size_t loop, double t, kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED,
                        kt_where_format("friction '%.60s', t = %.9g s", kt_loop_name(model, (int)loop), t).text,
                        "it is released at first, which the compiled model cannot represent; take a "
                        "simulation, or compile with more contact_switches");
}

/* The state that is checked; with `kernels`, data with its poses, and with its velocities if `moves`. */
typedef struct open_contacts {
    const kt_model *all;
    const kt_reduction_kernels *kernels;
    kt_data *data;
    double t;
    const double *q, *v;
    bool moves;
} open_contacts;

/* Whether a gap is small in metres or in radians. This test comes first, because kt_loop_unit evaluates a row to find
 * the measure of the gap. */
static bool is_near_contact(const kt_model *all, size_t i, double gap) {
    return all->loop[i].term_count > 0 || gap <= touching * fmax(1.0, all->length);
}

/* Whether an open contact touches and does not part; false for a NaN, which the evaluation rejects. Writes its gap. */
static bool touches(open_contacts *c, size_t i, double *gap) {
    const kt_loop_record *loop = &c->all->loop[i];
    const double sign = loop->side == KT_SIDE_BELOW ? -1.0 : 1.0;
    if (c->all->slot[loop->slot] < 0)
        return false;
    if (c->kernels == NULL) {
        c->kernels = kt_reduction_kernels_in_space(c->all);
        c->kernels->pose(c->all, c->data, c->q);
        c->data->placed = c->all->n.planar == 0;
    }
    *gap = sign * c->kernels->first_row(c->all, c->data, i, c->t, c->q, NULL).residual;
    if (!is_near_contact(c->all, i, *gap))
        return false;
    const double unit = kt_loop_unit(c->all, (int)i, 0);
    if (!(*gap <= touching * unit))
        return false;
    if (!c->moves)
        c->kernels->move(c->all, c->data, c->v);
    c->moves = true;
    return sign * c->kernels->first_row(c->all, c->data, i, c->t, c->q, c->v).rate <=
           parting * unit * pace_of(c->all, c->v);
}

static bool is_open_contact(const kt_loop_record *loop) {
    return loop->side != KT_SIDE_NONE && !loop->released && kt_loop_is_off(loop);
}

static bool is_joint_friction(const kt_loop_record *loop) {
    return loop->friction > 0 && loop->side == KT_SIDE_NONE && loop->type == KT_LOOP_RATES;
}

/* Checks friction of joints that sticks: slip forwards without its switches, slip backwards with the switch of its
 * effect. */
static kt_status check_friction(const kt_model *model, const open_contacts *c, size_t i, kt_error *error) {
    const int effect = model->loop[i].friction - 1;
    const uint64_t stick = kt_switch_bits(model, kt_loop_switch(model, (int)i)),
                   back = kt_switch_bits(model, kt_effect_switch(model, effect)), on = model->set & (stick | back);
    const double rate = c->v[c->all->link[c->all->loop[i].link[0]].v];
    const double least = parting * kt_loop_unit(c->all, (int)i, 0) * pace_of(c->all, c->v);
    if ((on & stick) != 0)
        return KT_OK;
    if ((model->variants->switches.masked & stick) != 0 && model->loop[i].released)
        return reject_released_friction(model, i, c->t, error);
    return (on != 0 ? -rate : rate) <= least ? reject_wrong_friction(model, i, c->t, rate, error) : KT_OK;
}

/* Checks open contacts and friction of joints from a loop on. */
static kt_status check_from(const kt_model *model, open_contacts *c, size_t first, kt_error *error) {
    kt_status status = KT_OK;
    for (size_t i = first; status == KT_OK && i < model->n.loop; i++) {
        double gap;
        if (is_joint_friction(&model->loop[i]))
            status = check_friction(model, c, i, error);
        else if (is_open_contact(&model->loop[i]) && touches(c, i, &gap))
            status = reject_open_contact(model, i, c->t, gap, error);
    }
    return status;
}

kt_status kt_open_contacts_place(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                 kt_error *error) {
    size_t first = 0;
    data->placed = false;
    while (first < model->n.loop && !is_open_contact(&model->loop[first]) && !is_joint_friction(&model->loop[first]))
        first++;
    if (first == model->n.loop)
        return KT_OK;
    open_contacts c = {.all = kt_variants_closed(model), .data = data, .t = t, .q = q, .v = v};
    return c.all != NULL ? check_from(model, &c, first, error) : KT_OK;
}

kt_status kt_open_contacts_check(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                 kt_error *error) {
    const kt_status status = kt_open_contacts_place(model, data, t, q, v, error);
    data->placed = false; /* the next evaluation is that of any state */
    return status;
}
