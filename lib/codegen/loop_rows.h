/* The equations of a loop between two ends (loop_rows.c). */
#ifndef KT_CODEGEN_LOOP_ROWS_H
#define KT_CODEGEN_LOOP_ROWS_H

#include "codegen/loops.h"

/* A loop whose equations are being made, in the axes of its ancestor. */
typedef struct kt_code_closing {
    kt_code_tree *tree;
    const kt_loop_record *record;
    const kt_code_loop *number;
    const kt_code_places *place; /* of the links on both paths */
    bool moves;
    kt_op function[3]; /* of the length, the offset or the position: its value and two derivatives by time */
    kt_op3 point[2];
    kt_op33 axes[2]; /* of the ends, columns */
    kt_op3 omega[2], velocity[2], alpha[2],
        linear[2];     /* of the ends' links, at their origins; relative to the ancestor */
    kt_op3 d, u, bias; /* from the first point to the second; its rate and d'' seen from the first end */
    kt_op *column;     /* 6 x nv: velocities of the second end relative to the first for unit rates, at its point */
} kt_code_closing;

/* Adds the equations of the loop. */
void kt_code_add_end_rows(const kt_code_closing *c, kt_code_loop_rows *rows);

#endif
