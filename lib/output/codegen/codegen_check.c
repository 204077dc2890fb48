/* Checks for items that kt_codegen_write cannot generate. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/functions.h"

#include "base/where.h"
#include "codegen/loops.h"
#include "codegen/node_effect.h"
#include "kinetree/codegen.h"
#include "kinetree/descriptor.h"
#include "kinetree/loop.h"

#include <ctype.h>
#include <string.h>

bool kt_code_is_identifier(const char *name) {
    if (!isalpha((unsigned char)name[0]) || strlen(name) > KT_CODE_BODY_NAME)
        return false;
    for (const char *at = name; *at != '\0'; at++)
        if (!isalnum((unsigned char)*at) && *at != '_')
            return false;
    return true;
}

static const char *name_of_effect(const kt_model *model, const kt_effect_record *effect) {
    const kt_descriptor *descriptor = kt_effect_descriptor((kt_effect_type)effect->type);
    return effect->name > 0 ? model->text + effect->name : descriptor != NULL ? descriptor->name : "effect";
}

/* Returns the effect whose contact or sticking friction is this loop, or NULL, such as for a slack rope, which belongs
 * to no effect. Effects that are switched off follow the active effects. */
static const kt_effect_record *find_hard_effect(const kt_model *model, int loop) {
    for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++) {
        const kt_effect_record *effect = &model->effect[i];
        if (loop >= effect->loop && loop < effect->loop + effect->loops)
            return effect;
    }
    return NULL;
}

/* Rejects loops for which code cannot be generated. Switches come first, because one hard contact makes the other loops
 * seem faulty. */
static kt_status check_loops(const kt_model *model, unsigned functions, kt_error *error) {
    const unsigned closed = KT_CODEGEN_FORWARD_DERIVATIVES | KT_CODEGEN_STEP_DERIVATIVES | KT_CODEGEN_FORWARD |
                            KT_CODEGEN_ACCELERATION | KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT | KT_CODEGEN_STEPS,
                   projected = KT_CODEGEN_PROJECT | KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES;
    for (int i = 0; i < (int)model->n.loop && (functions & closed); i++) {
        const char *fault = kt_code_switched_fault(model, i);
        const kt_effect_record *effect = fault == NULL ? NULL : find_hard_effect(model, i);
        if (fault != NULL)
            return kt_error_set(error, KT_ERROR_MODEL,
                                effect != NULL ? kt_where_format("effect '%s'", name_of_effect(model, effect)).text
                                               : kt_loop_name(model, i),
                                "code for it cannot be generated: %s; or use the library for this mechanism", fault);
    }
    for (int i = 0; i < (int)model->n.loop && (functions & closed); i++) {
        const char *fault = kt_code_loop_fault(model, i);
        if (fault != NULL)
            return kt_error_set(error, KT_ERROR_MODEL, kt_loop_name(model, i),
                                "code for this loop cannot be generated (%s); %suse the library for this mechanism",
                                fault,
                                functions == KT_CODEGEN_ACCELERATION
                                    ? ""
                                    : "leave out forward, forward_derivatives, acceleration, loops, project and "
                                      "steps, or ");
    }
    for (int i = 0; i < (int)model->n.loop && (functions & projected); i++) {
        const char *fault = kt_code_projection_fault(model, i);
        if (fault != NULL)
            return kt_error_set(error, KT_ERROR_MODEL, kt_loop_name(model, i),
                                "its projection cannot be generated (%s); leave out project and steps, or use the "
                                "library for this mechanism",
                                fault);
    }
    if (kt_code_count_loop_rows(model) == 0 && (functions & (KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT)))
        return kt_error_set(error, KT_ERROR_MODEL, "loops", "no loop has an equation; leave out loops and project");
    return KT_OK;
}

/* Not whether the model is one that cannot be generated: kt_code_check reports that. */
unsigned kt_code_available(const kt_model *model) {
    unsigned functions = KT_CODEGEN_ALL;
    if (kt_code_count_loop_rows(model) == 0)
        functions &= ~(unsigned)(KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT);
    if (model->n.x == 0)
        functions &= ~(unsigned)KT_CODEGEN_STATES;
    if (model->n.x > 0 || model->n.q > model->n.v)
        functions &= ~(unsigned)KT_CODEGEN_STEP_DERIVATIVES;
    if (model->n.marker == 0)
        functions &= ~(unsigned)(KT_CODEGEN_MARKERS | KT_CODEGEN_JACOBIANS);
    return functions;
}

kt_status kt_code_check(const kt_model *model, unsigned functions, kt_error *error) {
    const unsigned forces = KT_CODEGEN_EFFECTS | KT_CODEGEN_EFFECT_DERIVATIVES | KT_CODEGEN_ACCELERATION;
    const kt_status status = check_loops(model, functions, error);
    if (status != KT_OK)
        return status;
    if (model->n.varying > 0)
        return kt_error_set(
            error, KT_ERROR_MODEL, kt_body_name(model, model->varying[0].body),
            "code for a mass that changes with time cannot be generated; use the library for this mechanism");
    for (size_t i = 0; i < model->n.effect && (functions & forces); i++) {
        const kt_effect_record *effect = &model->effect[i];
        const char *fault = kt_code_effect_fault(model, effect);
        if (fault != NULL)
            return kt_error_set(
                error, KT_ERROR_MODEL, name_of_effect(model, effect),
                functions == KT_CODEGEN_ACCELERATION
                    ? "code for this effect cannot be generated (%s); use the library for this mechanism"
                : functions & (KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES)
                    ? "code for this effect cannot be generated (%s), and steps need it; leave out "
                      "effects and steps, and add the force to the tau of forward"
                    : "code for this effect cannot be generated (%s); leave out the functions effects "
                      "and acceleration, and add the force to tau",
                fault);
    }
    if ((functions & KT_CODEGEN_STEP_DERIVATIVES) && (model->n.x > 0 || model->n.q > model->n.v))
        return kt_error_set(error, KT_ERROR_MODEL, model->n.x > 0 ? "auxiliary states" : "quaternions",
                            "A and B of steps cannot be generated with these; use kt_step_derivatives of the library");
    if ((functions & KT_CODEGEN_STATES) && model->n.x == 0)
        return kt_error_set(error, KT_ERROR_MODEL, "states", "there are no auxiliary states; leave out states");
    for (size_t i = 0; i < model->n.x && (functions & KT_CODEGEN_STATES); i++)
        if (model->state[i].law != NULL)
            return kt_error_set(error, KT_ERROR_MODEL, model->text + model->state[i].name,
                                "its rate is a function in C; leave out states and steps, or give a formula");
    for (size_t i = 0; i < model->n.x && (functions & KT_CODEGEN_STATES); i++)
        if (model->state[i].formula[0] > 0 && !kt_code_has_tables(kt_code_formula_of(model, &model->state[i], 0)))
            return kt_error_set(error, KT_ERROR_MODEL, model->text + model->state[i].name,
                                "its rate calls a table of more than 100 rows, or of more than 400 points of a grid; "
                                "leave out states and steps, or shorten the table");
    if (model->n.v == 0)
        return kt_error_set(error, KT_ERROR_MODEL, NULL, "no joint can move, and there is nothing to generate");
    if ((functions &
         (KT_CODEGEN_FORWARD | KT_CODEGEN_ACCELERATION | KT_CODEGEN_FORWARD_DERIVATIVES | KT_CODEGEN_PROJECT)) &&
        model->n.massless > 0)
        return kt_error_set(error, KT_ERROR_MODEL, "forward",
                            "%d coordinates move no mass, and accelerations do not follow; give the bodies masses, or "
                            "leave out forward, its derivatives, acceleration and project",
                            (int)model->n.massless);
    if ((functions & (KT_CODEGEN_MARKERS | KT_CODEGEN_JACOBIANS)) && model->n.marker == 0)
        return kt_error_set(error, KT_ERROR_MODEL, "markers",
                            "there are no markers; name one, or leave out markers and jacobians");
    return KT_OK;
}
