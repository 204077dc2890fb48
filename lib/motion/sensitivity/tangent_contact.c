/* Hard contacts, stops and slack ropes in a step that is a function of a state, and in its derivatives. The step uses
 * the equations of the model. In these equations, each contact is open or closed from the beginning of the step to its
 * end. If a contact closes within the step, or its reaction changes sign, the motion has an event, which the step would
 * omit. Friction has an event when it begins to stick, and when it begins to slip. Such steps are rejected, as
 * their error exceeds rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "loop/loop.h"
#include "model/switching.h"
#include "sensitivity/sensitivity.h"

#include <math.h>

/* Gaps within this part of their units (a radian, the mechanism's length) count as zero. Reactions within this part of
 * the largest reaction also count as zero, each times the unit of its equation. */
static const double rounding = 1e-9;

static uint64_t bit_of(const kt_model *model, size_t loop) {
    return kt_switch_bits(model, kt_loop_switch(model, (int)loop));
}

static bool bounds(const kt_loop_record *loop) { return loop->side != KT_SIDE_NONE; }
static double side_sign_of(const kt_loop_record *loop) { return loop->side == KT_SIDE_BELOW ? -1.0 : 1.0; }

static kt_status reject_contact_derivatives(const kt_step_work *w, size_t loop, const char *what, double size,
                                            kt_error *error) {
    const char *name = kt_loop_name(w->model, (int)loop);
    return kt_error_set(
        error, KT_ERROR_UNSUPPORTED,
        kt_where_format("contact '%.60s' by t = %.9g s", name, w->step->t + w->step->h).text,
        "it %s (%.3g) within the step, an event that the step and its derivatives would leave out; take a simulation "
        "(kt_simulation_advance, kt_motion_derivatives)",
        what, size);
}

/* Rejects steps with friction that sticks: friction of a joint always, friction of a contact while sticking. */
static kt_status check_sticks(const kt_step_work *w, kt_error *error) {
    for (size_t i = 0; i < w->model->n.loop; i++) {
        const kt_loop_record *loop = &w->model->loop[i];
        if (!kt_loop_is_stick(w->model, (int)i) || (loop->type != KT_LOOP_RATES && kt_loop_is_off(loop)))
            continue;
        const char *name = kt_loop_name(w->model, (int)i);
        return kt_error_set(
            error, KT_ERROR_UNSUPPORTED,
            kt_where_format("friction '%.60s' by t = %.9g s", name, w->step->t + w->step->h).text,
            "it sticks, and a step alone does not follow where it comes to rest and begins to slip; take a "
            "simulation (kt_simulation_advance, kt_motion_derivatives)");
    }
    return KT_OK;
}

/* Rejects the step if an open contact has a negative gap at its end, since the contact has closed in it. mask: the
 * switches of side_mask_of. */
static kt_status check_gaps(kt_step_work *w, const double *next, uint64_t mask, kt_error *error) {
    const kt_model *model = w->model,
                   *all = kt_model_switched(model, model->set | mask | model->variants->switches.masked);
    kt_data *data = NULL;
    kt_status status = kt_data_init_followed(all, w->contact_memory, kt_data_size(model), &data, error);
    if (status == KT_OK)
        status = kt_loop_equations(all, data, w->step->t + w->step->h, next, next + model->n.q, NULL, w->contact_row,
                                   NULL, NULL, error);
    for (size_t i = 0; status == KT_OK && i < all->n.loop; i++) {
        const kt_loop_record *loop = &all->loop[i];
        if (!bounds(loop) || !kt_loop_is_off(&model->loop[i]))
            continue;
        const double gap = side_sign_of(loop) * w->contact_row[loop->equation];
        if (gap < -rounding * kt_loop_unit(all, (int)i, 0))
            status = reject_contact_derivatives(w, i, "closes", gap, error);
    }
    return status;
}

/* Checks the reactions of closed contacts. */
static kt_status check_reactions(kt_step_work *w, const double *next, kt_error *error) {
    const kt_model *model = w->model;
    kt_data *data = NULL;
    double most = 0.0;
    kt_status status = kt_data_init_followed(model, w->contact_memory, kt_data_size(model), &data, error);
    if (status != KT_OK)
        return status;
    kt_auxiliary_states_put(model, data, next);
    status = kt_multiplier_evaluate(model, data, w->step->t + w->step->h, next, next + model->n.q, w->step->tau,
                                    w->step->external, w->contact_row, error);
    for (size_t i = 0; status == KT_OK && i < model->n.loop; i++)
        for (int r = 0; r < model->loop[i].row_count; r++)
            most = fmax(most, fabs(w->contact_row[model->loop[i].equation + r]) * kt_loop_unit(model, (int)i, r));
    for (size_t i = 0; status == KT_OK && i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (!bounds(loop) || kt_loop_is_off(loop))
            continue;
        const double reaction = side_sign_of(loop) * w->contact_row[loop->equation];
        if (reaction * kt_loop_unit(model, (int)i, 0) < -rounding * fmax(most, 1e-300))
            status = reject_contact_derivatives(w, i, "opens, as its reaction would pull,", reaction, error);
    }
    return status;
}

/* The switches of all loops that bound a side. */
static uint64_t side_mask_of(const kt_model *model) {
    uint64_t mask = 0;
    for (size_t i = 0; model->variants != NULL && i < model->n.loop; i++)
        if (bounds(&model->loop[i]))
            mask |= bit_of(model, i);
    return mask;
}

kt_status kt_step_reject_contacts(kt_step_work *w, const double *next, kt_error *error) {
    const kt_model *model = w->model;
    const uint64_t mask = side_mask_of(model);
    if (model->variants == NULL)
        return KT_OK;
    kt_status status = check_sticks(w, error);
    if (status == KT_OK && (model->set & mask) != mask)
        status = check_gaps(w, next, mask, error);
    if (status == KT_OK && (model->set & mask) != 0)
        status = check_reactions(w, next, error);
    return status;
}

size_t kt_step_contact_rows(const kt_model *model) {
    size_t rows = 0;
    for (uint64_t k = 0; side_mask_of(model) != 0 && k < kt_variants_count(model->variants); k++) {
        const kt_model *one = kt_variants_model(model->variants, k);
        rows = one->n.row > rows ? one->n.row : rows;
    }
    return rows;
}
