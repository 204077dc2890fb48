/* Laws in C in place of the formulas of effects: their variables and states by name. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"
#include "model/model.h"

#include <string.h>

static bool has_law(const kt_effect *effect) { return effect->type == KT_EFFECT_EXPRESSION && effect->law != NULL; }

/* The names for a law, before its variables are added. */
static kt_formula_names names_without_variables(const kt_description *description, const kt_effect *effect) {
    kt_effect of = *effect;
    if (effect->state_count > 0) { /* as that of a rate, which has no ends */
        of.end_count = 0;
        of.joint = NULL;
    }
    return kt_formula_names_of(description, &of);
}

kt_formula_names kt_law_names_of(const kt_description *description, const kt_effect *effect) {
    kt_formula_names names = names_without_variables(description, effect);
    const kt_symbols symbols = kt_formula_symbols(&names);
    kt_symbol symbol;
    for (int k = 0; k < effect->variable_count; k++)
        (void)symbols.find(symbols.user, effect->variables[k], &symbol);
    return names;
}

int kt_law_of_state(const kt_description *description, const char *state, int after, int *rate) {
    for (int i = after + 1; i < description->effect_count; i++) {
        const kt_effect *effect = &description->effects[i];
        for (int k = 0; has_law(effect) && effect->states != NULL && k < effect->state_count; k++)
            if (effect->states[k] != NULL && strcmp(effect->states[k], state) == 0) {
                *rate = k;
                return i;
            }
    }
    return -1;
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

/* Whether a list can be read. */
static bool check_law_list(kt_checker *checker, const char *field, const char *const *list, int count, int most) {
    if (count < 0 || count > most)
        kt_checker_fault(checker, field, -1, "%s: the count is %d; it must be 0 to %d", field, count, most);
    else if (count > 0 && list == NULL)
        kt_checker_fault(checker, field, -1, "%s: the list is NULL, and its count %d", field, count);
    else
        return true;
    return false;
}

/* Checks the k-th variable of a law. A formula in place of a name is a fault, too; an unknown name is reported as
 * formulas report it. */
static void check_variable(kt_checker *checker, kt_formula_names *names, const char *name, int k) {
    const kt_symbols symbols = kt_formula_symbols(names);
    const int before = names->count;
    kt_symbol symbol;
    if (name == NULL)
        kt_checker_fault(checker, "variables", k, "a name is NULL; give that of a variable ('velocity.crank')");
    else if (symbols.find(symbols.user, name, &symbol)) {
        if (names->quaternion)
            kt_checker_fault(checker, "variables", k, "%s is a component of a quaternion; take coordinates of markers",
                             kt_name_quote(name).text);
        else if (names->count == before)
            kt_checker_fault(checker, "variables", k, "%s is listed twice; name it once", kt_name_quote(name).text);
    } else if (kt_checker_formula(checker, "variables", name, names)) { /* its report names the unknown variable */
        kt_checker_fault(checker, "variables", k, "%s is a formula; give the name of a variable",
                         kt_name_quote(name).text);
    }
}

/* Checks the k-th state whose rate a law writes: the state exists, has no formula of its own, and is listed once. */
static void check_law_state(kt_checker *checker, const kt_effect *effect, int k) {
    const kt_description *d = checker->description;
    const char *name = effect->states[k];
    const int index = name != NULL ? kt_names_find(&checker->names, KT_SCOPE_STATE, name) : -1;
    if (index < 0) {
        kt_checker_fault(checker, "states", k, "state %s does not exist; list it in kt_description.states",
                         name != NULL ? kt_name_quote(name).text : "NULL");
        return;
    }
    if (d->states[index].rate != NULL)
        kt_checker_fault(checker, "states", k,
                         "state %s has both a formula for its rate and a law; leave one of the two out",
                         kt_name_quote(name).text);
    for (int j = 0; j < k; j++)
        if (effect->states[j] != NULL && strcmp(effect->states[j], name) == 0)
            kt_checker_fault(checker, "states", k, "%s is listed twice; name it once", kt_name_quote(name).text);
}

void kt_checker_law(kt_checker *checker, const kt_effect *effect) {
    kt_formula_names names = names_without_variables(checker->description, effect);
    for (int k = 0; k < 6; k++)
        if (effect->formula[k] != NULL) {
            kt_checker_fault(checker, "law", -1, "both a formula and a law are given; give one of them");
            return;
        }
    if (check_law_list(checker, "variables", effect->variables, effect->variable_count, KT_FORMULA_VARIABLE_MAX))
        for (int k = 0; k < effect->variable_count && !kt_checker_is_done(checker); k++)
            check_variable(checker, &names, effect->variables[k], k);
    (void)kt_checker_gravity(checker, "variables", -1, &names);
    if (check_law_list(checker, "states", effect->states, effect->state_count, KT_LAW_STATE_MAX))
        for (int k = 0; k < effect->state_count && !kt_checker_is_done(checker); k++)
            check_law_state(checker, effect, k);
}
