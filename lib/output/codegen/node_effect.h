/* An effect as nodes: its ends, and the forces that it exerts. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_NODE_EFFECT_H
#define KT_CODEGEN_NODE_EFFECT_H

#include "codegen/recursion.h"

/* An end of an effect. */
typedef struct code_end {
    int link;
    kt_op33 axes;                  /* to the world */
    kt_op3 arm;                    /* from the link's origin, link axes */
    kt_op3 point, velocity, omega; /* world axes */
} code_end;

typedef struct code_effect {
    kt_code_tree *tree;
    const kt_effect_record *record;
    const kt_code_speed *speed; /* speeds of all links */
    const kt_code_places *place;
    char name[KT_CODE_NAME]; /* name with which its parameters begin */
    code_end end[2];
    kt_op3 moment[2], force[2]; /* on the ends, world axes */
} code_effect;

/* The wrench on a link, about its origin and in its axes. */
typedef struct code_load {
    kt_op3 moment, force;
} code_load;

/* The line between two ends: d = p2 - p1, its length, its rate and d'. */
typedef struct code_line {
    kt_op3 d, moving;
    kt_op length, rate;
} code_line;

/* A formula of an effect that has this formula. */
static inline const kt_expression *kt_code_formula_of(const kt_model *model, const kt_effect_record *effect, int k) {
    return (const kt_expression *)(const void *)(model->number + effect->formula[k] - 1);
}

/* The line between the ends, and a variable of the effect's formulas (node_variable.c). */
code_line kt_code_line_of(const code_effect *e);
kt_op kt_code_variable(const code_effect *e, const kt_variable_record *x);

/* The force of an effect in a joint (laws.c). */
kt_op kt_code_joint_force(const code_effect *e, kt_op q, kt_op v);

/* The value of the effect's formula k; 0 if there is none. */
kt_op kt_code_formula_value(const code_effect *e, int k);

/* Sets the moments and forces on the ends. */
void kt_code_wrench(code_effect *e);

#endif
