/* Formulas of an effect: the names that they may use. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_FORMULA_NAMES_H
#define KT_MODEL_FORMULA_NAMES_H

#include "base/inner.h"
#include "kinetree/expression.h"
#include "model/check.h"
#include "model/record.h"

/* The variables of an effect's formulas, in the order of their first use. An effect between two ends also has `length`
 * and `speed`. An effect in a loop also has `position.NAME` and `velocity.NAME` of its coordinate. */
typedef struct kt_formula_names {
    const kt_description *description;
    int ends;
    const char *coordinate;   /* coordinate of a loop, in which the effect acts; NULL: none */
    const kt_effect *numbers; /* effect whose numbers take the place of formulas; NULL: none */
    const char *(*lengthen)(const kt_effect *numbers, const char *name, char *full); /* full name of a short one; NULL:
                                                                                        names are full */
    kt_variable variable[KT_FORMULA_VARIABLE_MAX]; /* type may be KT_VARIABLE_LENGTH, KT_VARIABLE_SPEED */
    int count;
    bool full;       /* more names than there is room for */
    bool quaternion; /* a component of a quaternion is among them */
    bool gravity;    /* a gravity force is among them */
    char shown[600]; /* the name that was listed last */
} kt_formula_names;

/* Returns the names for the formulas of an effect, without variables. */
KT_INNER kt_formula_names kt_formula_names_of(const kt_description *description, const kt_effect *effect);

/* The symbols of kt_expression_parse with the indices of `variable`. */
KT_INNER kt_symbols kt_formula_symbols(kt_formula_names *names);

/* The tables of formulas, compiled one behind the other. */
KT_INNER const double *kt_model_tables(const kt_model *model);

/* The index of the body that a joint of this name carries; -1 if there is none. O(bodies). */
KT_INNER int kt_body_with_joint(const kt_description *description, const char *name);

/* Whether a loop is a coupling with a formula. */
static inline bool kt_loop_has_formula(const kt_loop *loop) {
    return loop->type == KT_LOOP_COUPLING && loop->formula != NULL;
}

/* The names that the formula of a coupling may use, the names of its terms, in their order. */
typedef struct kt_coupling_names {
    const kt_description *description;
    const kt_loop *loop;
    char shown[300]; /* the name that was listed last */
} kt_coupling_names;

/* The symbols of kt_expression_parse with the indices of the terms. */
KT_INNER kt_symbols kt_coupling_symbols(kt_coupling_names *names);

/* The joint of a name `position.JOINT`; NULL if the name is no position of a joint. */
KT_INNER const char *kt_position_of_joint(const char *name);

/* Checks the formula of a coupling, if the coupling has one. */
void kt_checker_coupling(kt_checker *checker, const char *field, const kt_loop *loop);

/* Returns the names for a law of an effect, with its variables in their order, as far as these variables exist. A law
 * with states does not read the ends of its effect, since rates are evaluated without ends. */
kt_formula_names kt_law_names_of(const kt_description *description, const kt_effect *effect);

/* Returns the effect whose law writes the rate of a state, and sets *rate to its index among the rates of the law. The
 * search begins behind the effect `after`, at first -1. Returns -1 if there is none. */
int kt_law_of_state(const kt_description *description, const char *state, int after, int *rate);

/* Checks the law of an effect. */
void kt_checker_law(kt_checker *checker, const kt_effect *effect);

/* Whether a text can be read as a formula with these symbols. Reports a fault if not. */
bool kt_checker_text(kt_checker *checker, const char *field, const char *text, const kt_symbols *symbols);

/* Whether a formula can be read with these names, and has no variables that formulas cannot have. Reports a fault if
 * not. */
bool kt_checker_formula(kt_checker *checker, const char *field, const char *text, kt_formula_names *names);

/* Whether the masses are constant if one of the variables is a gravity force. Reports a fault if not. */
bool kt_checker_gravity(kt_checker *checker, const char *field, int sub, const kt_formula_names *names);

#endif
