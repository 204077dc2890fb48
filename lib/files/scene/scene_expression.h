/* Expressions of parameters where a scene has a number: "=0.01*L^2". */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_EXPRESSION_H
#define KT_SCENE_SCENE_EXPRESSION_H

#include "kinetree/expression.h"
#include "scene/scene_reader.h"

/* A parameter of the scene. */
struct kt_named_number {
    const char *name;
    kt_node *key, *node;
    const kt_expression *expression; /* NULL: a number, or faulty */
    double value;
    size_t use; /* the expression's first index in `uses`, which has use_count of them */
    int use_count;
    int missing; /* parameters that its expression uses and that have no value yet */
    bool is_known, is_angle;
    bool is_used;      /* used by a number or a formula, directly or through other parameters */
    bool is_mentioned; /* mentioned by a parameter, used or not */
    bool varies;       /* the number depends on a variable (vary.h) */
    bool is_set;       /* set by an event */
    bool is_assigned;  /* an event sets it or a number that it depends on. Formulas then see an auxiliary state of its
                          name (assignment.h) */
    uint32_t hidden_line, hidden_column; /* place of the first formula that has a variable of this name; 0: none */
};

/* The name of a variable of the description, which lasts as long as the reading; NULL: out of memory. */
const char *kt_variable_text(kt_reader *r, const kt_variable *variable);

/* Whether there is a parameter of this name. */
bool kt_is_parameter(const kt_reader *r, const char *name);

/* Whether a scalar is an expression: '=' begins it. */
bool kt_is_expression(const kt_node *node);

/* Whether a text, which lacks the '=', is an expression of parameters. */
bool kt_is_bare_expression(kt_reader *r, const char *text);

/* Reads the expression of a node, which lives as long as the reading; NULL after reporting a fault. */
const kt_expression *kt_expression_of_node(kt_reader *r, const kt_scope *scope, kt_node *node);

/* Reads a formula without '='. Names in the formula are those of `variables`, whose `find` comes first, and of
 * parameters, which it holds as numbers. The text in *text is the formula with numbers in place of parameters, and is
 * kept. Reports a fault and returns false. If `angle` is false, an angle is a fault. */
bool kt_read_formula(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *variables, bool angle,
                     const char **text);

/* Evaluates an expression of parameters that have values; reports a value that is not finite, and then leaves *out
 * untouched and returns false. */
bool kt_expression_value(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_expression *expression,
                         double *out);

/* Reads and evaluates an expression. On a fault, reports it, leaves *out untouched and returns false. If `angle` is
 * false, an angle is a fault. */
bool kt_read_expression(kt_reader *r, const kt_scope *scope, kt_node *node, bool angle, double *out);

#endif
