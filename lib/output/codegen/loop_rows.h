/* The equations of a loop between two ends: which (loop_part.c), and their rows. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_LOOP_ROWS_H
#define KT_CODEGEN_LOOP_ROWS_H

#include "codegen/loops.h"
#include "loop/loop.h"

/* Equations after the equations of kt_loop_part; each belongs to a single type of loop. */
enum {
    KT_CODE_ADVANCE = KT_PART_SPATIAL + 1, /* screw: along the axis */
    KT_CODE_TURN,                          /* homokinetic: the angle about the axes */
    KT_CODE_SURFACE,
    KT_CODE_CURVE_FIRST, /* curve: across it, twice, and along it */
    KT_CODE_CURVE_SECOND,
    KT_CODE_CURVE_ALONG,
    KT_CODE_ROLL_X, /* rolling: velocities in the plane, and the gap */
    KT_CODE_ROLL_Y,
    KT_CODE_ROLL_GAP,
    KT_CODE_EDGE,  /* knife_edge */
    KT_CODE_WHEEL, /* gear, rack, worm, span; belt: its first span, and its second one */
    KT_CODE_WHEEL_SECOND,
};

#define KT_CODE_POINT (1u << KT_PART_X | 1u << KT_PART_Y | 1u << KT_PART_Z)

/* The equations of a loop that are independent and not void: bits of kt_loop_part. */
unsigned kt_code_active_parts(const kt_model *model, const kt_loop_record *r);

/* The number of equations with which both points of a loop coincide, in any axes; 0 if the points do not coincide. */
int kt_code_count_coincidence(const kt_model *model, const kt_loop_record *r, unsigned active);

/* Whether the group of a loop moves in a plane. */
bool kt_code_loop_is_planar(const kt_model *model, const kt_loop_record *loop);

/* A loop whose equations are being made, in the axes of its ancestor. */
typedef struct kt_code_closing {
    kt_code_tree *tree;
    const kt_loop_record *record;
    const kt_code_loop *number;
    const kt_code_places *place; /* places of the links on both paths */
    int end[2];                  /* ends of the record that count as the first, and as the second */
    bool moves;        /* rates and right-hand sides are wanted, which need velocities and bias accelerations */
    kt_op function[3]; /* length, offset or position: its value and two derivatives by time */
    kt_op3 point[2];
    kt_op33 axes[2]; /* axes of the ends, columns */
    kt_op3 omega[2], velocity[2], alpha[2],
        linear[2];     /* motion of the ends' links, at their origins; relative to the ancestor */
    kt_op3 d, u, bias; /* from the first point to the second; its rate and d'' seen from the first end */
    kt_op *column;     /* 6 x nv: velocities of the second end relative to the first for unit rates, at its point */
} kt_code_closing;

typedef enum kt_code_measure { KT_CODE_LENGTH, KT_CODE_ANGLE, KT_CODE_VELOCITY } kt_code_measure;

/* A row, with its numbers as in loop/loop.h. A row of velocities has no phi. */
typedef struct kt_code_row {
    kt_op3 moment, force;
    kt_op phi, drift;
    kt_code_measure measure;
    const kt_op3 *reach; /* from the second point to the place at which the row acts; NULL: the point itself */
    const kt_op *pitch;  /* pitch by which a rotation changes a length; NULL: 0 */
} kt_code_row;

/* Adds a row without a function of time. */
void kt_code_add_row(const kt_code_closing *c, kt_code_loop_rows *rows, const kt_code_row *row);

/* phi = e . d for an axis of the first end. */
void kt_code_add_along(const kt_code_closing *c, kt_code_loop_rows *rows, kt_op3 e);

/* An axis of an end. */
static inline kt_op3 kt_code_end_axis(const kt_code_closing *c, int end, int k) {
    const kt_op33 *axes = &c->axes[end];
    return (kt_op3){{axes->row[0].x[k], axes->row[1].x[k], axes->row[2].x[k]}};
}

/* Orientations (loop_orientation.c), and angles about one axis. */
void kt_code_add_one_axis(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);
void kt_code_add_orientation(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);
void kt_code_add_right_angle(const kt_code_closing *c, kt_code_loop_rows *rows);
void kt_code_add_turn(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);

/* Points on surfaces and curves (loop_surface.c). */
void kt_code_add_surface(const kt_code_closing *c, kt_code_loop_rows *rows);
void kt_code_add_curve(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);

/* Rolling and skating (loop_rolling.c). */
void kt_code_add_rolling(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);
void kt_code_add_edge(const kt_code_closing *c, kt_code_loop_rows *rows);

/* Wheels that mesh, and ropes between pulleys (loop_wheel.c). */
void kt_code_add_wheels(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active);

/* Adds the equations of the loop. */
void kt_code_add_end_rows(const kt_code_closing *c, kt_code_loop_rows *rows);

#endif
