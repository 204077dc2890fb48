/* Formulas of a scene in a simulation, with the variables that they read bound to its model (bound.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_BOUND_H
#define KT_SCENE_BOUND_H

#include "base/pool.h"
#include "kinetree/expression.h"
#include "kinetree/scene.h"
#include "scene/scene_response.h"

/* A variable of a formula in a model. */
typedef struct kt_bound {
    kt_variable_type type;
    int body, at, component; /* at: in q, v or gravity forces, or of auxiliary states */
    kt_vec3 point;           /* place of a marker, in the body's frame */
    bool responds;           /* the variable is `response` instead */
    kt_event_response response;
} kt_bound;

typedef struct kt_bound_formula {
    kt_expression *expression; /* of a condition: its margin (expression/margin.h) */
    kt_bound *variables;
    double *values;
    int count;
    bool moves;        /* a marker or another quantity that needs data is among them */
    double *gravity;   /* gravity forces of all joints; NULL: none is among them */
    unsigned responds; /* bits of accelerations and reactions among them (kt_response_bit) */
    kt_responses *responses;
    kt_expression **parts; /* parts of formulas that depend on time alone */
    int part_count;
} kt_bound_formula;

/* The parts that all formulas of one simulation share. */
typedef struct kt_binding {
    kt_pool *pool;
    const kt_model *model;
    kt_responses *responses; /* `a` is NULL until a formula has any */
} kt_binding;

/* Binds a variable of a description to a model. */
KT_CHECKED kt_status kt_variable_bind(const kt_description *description, const kt_model *model,
                                      const kt_variable *variable, kt_bound *to, kt_error *error);

/* Reads a formula of the scene, and binds its variables to the model. For a comparison that is watched, it takes the
 * difference of both sides. */
KT_CHECKED kt_status kt_formula_bind(const kt_binding *in, const kt_scene *scene, const char *text, bool is_watched,
                                     kt_bound_formula *to, kt_error *error);

/* Evaluates a formula. The data of `at` are scratch. Returns 0, or 1 after an error. */
int kt_bound_evaluate(kt_bound_formula *f, const kt_instant *at, double *value, kt_error *error);

#endif
