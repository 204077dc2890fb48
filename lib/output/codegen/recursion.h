/* The recursions over a tree, as nodes (recursion.c). Outputs have kt_model_nv entries, unless stated otherwise. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_RECURSION_H
#define KT_CODEGEN_RECURSION_H

#include "codegen/node_tree.h"
#include "kinetree/expression.h"

/* The motion of a link, in its own axes, and the wrench on the link. */
typedef struct kt_code_moving {
    kt_code_frame frame;
    kt_op3 omega, alpha, linear;
    kt_op square[6]; /* products of omega: xx, yy, zz, xy, xz, yz */
    kt_op33 u;       /* [alpha] + [omega][omega] */
    kt_op3 force, moment;
} kt_code_moving;

/* Computes `square` and `u` from omega and alpha. */
void kt_code_multiply_rates(kt_graph *g, kt_code_moving *m);

/* The motion of all links, with the accelerations KT_OP_GIVEN or none, and the wrench that each takes alone. The ground
 * accelerates against gravity. */
void kt_code_move_links(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all);
/* tau = M a + h for the accelerations KT_OP_GIVEN; or h alone. */
void kt_code_inverse(kt_code_tree *tree, bool has_acceleration, kt_op *tau);
/* Inverse dynamics that also returns the motion of all links, and the wrench on each link with all bodies that it
 * carries. */
void kt_code_inverse_links(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all, kt_op *tau);

/* The mass matrix, nv x nv, column by column, both triangles. */
void kt_code_mass(kt_code_tree *tree, kt_op *mass);
/* The frames of all links, and the composite inertia of each link with all bodies that it carries. */
void kt_code_compose_bodies(kt_code_tree *tree, kt_code_frame *frame, kt_code_link *body);

/* A condition without which a function returns the number of a body: pivot > NO_INERTIA limit. For an equation of a
 * loop, the condition is pivot > SINGULAR limit, and the function returns minus the number of the loop, counted from
 * 1. */
typedef struct kt_code_guard {
    kt_op pivot, limit;
    int body, loop; /* loop: 0 if the guard is that of a body */
    bool is_near;   /* NEAR_SINGULAR takes the place of SINGULAR */
} kt_code_guard;

/* a = M^-1 (tau - h) for the forces KT_OP_GIVEN, through the mass matrix. work: nv x nv, then the factors of M.
 * inverse: 1 / D. mass_inverse: M^-1, column by column, or NULL. One guard for each coordinate. */
void kt_code_forward_mass(kt_code_tree *tree, kt_op *work, kt_op *a, kt_op *inverse, kt_op *mass_inverse,
                          kt_code_guard *guard);

/* M = L'DL in place, L below the diagonal; inverse: 1 / D. guard[k].limit holds M_kk. Then x := L'^-1 x, and
 * x := (D L)^-1 x. */
void kt_code_factor_mass(kt_code_tree *tree, kt_op *m, kt_op *inverse, kt_code_guard *guard);
void kt_code_solve_transposed(kt_code_tree *tree, const kt_op *m, kt_op *x);
void kt_code_solve_lower(kt_code_tree *tree, const kt_op *m, const kt_op *inverse, kt_op *x);

/* Forward dynamics by articulated bodies. */
void kt_code_forward_articulated(kt_code_tree *tree, kt_op *a, kt_code_guard *guard);

/* Forward dynamics by articulated bodies in the axes of planes (node_planar.c), if all links move in planes. */
bool kt_code_is_planar(const kt_model *model);
void kt_code_forward_planar(kt_code_tree *tree, kt_op *a, kt_code_guard *guard);

/* Kinetic energy and potential energy of gravity. */
void kt_code_energy(kt_code_tree *tree, kt_op energy[2]);

/* tau = S . (n, f): the joint forces of a wrench about the link's origin, in its axes. */
void kt_code_project(kt_code_tree *tree, const kt_code_frame *f, kt_op3 n, kt_op3 force, kt_op *tau);

/* The velocity of a link's origin and its angular velocity, in the axes of the link. */
typedef struct kt_code_speed {
    kt_code_frame frame;
    kt_op3 omega, linear;
    kt_op3 moment; /* first moment of all that it carries */
    kt_op mass;
} kt_code_speed;

/* The velocities of all links; NULL if memory is insufficient. */
kt_code_speed *kt_code_speeds(kt_code_tree *tree);

/* Rotations and positions of all links in the world. */
typedef struct kt_code_places {
    kt_op33 *turn;
    kt_op3 *position;
} kt_code_places;

kt_code_places kt_code_place_links(kt_code_tree *tree);

/* Room for places in other axes. */
kt_code_places kt_code_no_places(kt_code_tree *tree);

/* The rotation from a link's axes to those of its parent. */
kt_op33 kt_code_turn_of_frame(kt_graph *g, const kt_code_frame *f);

/* The columns of a joint in the Jacobian (6 x nv) of a point that it carries: rotations about axes of the link,
 * translations along its axes at rest. The positions are those of the link and of its parent, in any common axes. */
void kt_code_fill_jacobian(kt_code_tree *tree, const kt_code_places *at, int i, kt_op3 point, kt_op *jacobian);

/* Why the force of an effect cannot be generated; NULL: the force can be generated. */
const char *kt_code_effect_fault(const kt_model *model, const kt_effect_record *effect);

/* Whether the forces of effects or the rates of auxiliary states depend on time. */
bool kt_code_has_time(const kt_model *model);

/* Adds all that the functions of effects fold to a hash, by calls of `hash`. */
typedef void kt_code_hash(uint64_t *h, const void *bytes, size_t count);
void kt_code_hash_effects(const kt_model *model, kt_code_hash *hash, uint64_t *h);

/* The joint forces of all effects. */
void kt_code_effects(kt_code_tree *tree, kt_op *tau);

/* The rates of auxiliary states: as many as the model has. */
void kt_code_states(kt_code_tree *tree, kt_op *rate);

/* A function of time (node_curve.c): a constant is the parameter PREFIX_KEY, all other numbers are folded. */
kt_op kt_code_curve(kt_code_tree *tree, const kt_curve *curve, const char *prefix, const char *key,
                    const char *meaning);
bool kt_code_has_curve(const kt_model *model, const kt_curve *curve);
void kt_code_hash_curve(const kt_model *model, const kt_curve *curve, kt_code_hash *hash, uint64_t *h);

/* Rows that a table of generated code may have: each row becomes a choice, so that a longer table would need too much
 * code. */
enum { KT_CODE_TABLE_ROWS = 100 };
/* A table of cubic pieces at t (node_lookup.c), constant outside; rows: KT_PIECE_SIZE numbers each. */
kt_op kt_code_rows(kt_graph *g, const double *rows, int count, kt_op t);

/* A formula, with nodes for its variables (node_formula.c). */
kt_op kt_code_formula(kt_graph *g, const kt_expression *formula, const kt_op *value);
/* The node of a lookup table (node_lookup.c); y: of the second input, if the table has two. */
kt_op kt_code_lookup(kt_graph *g, const double *table, kt_op x, kt_op y);
/* Whether all tables that a formula calls are short enough for generated code. */
bool kt_code_has_tables(const kt_expression *formula);
void kt_code_hash_formula(const kt_expression *formula, kt_code_hash *hash, uint64_t *h);

/* The derivative of a function of time, by the chain rule. */
kt_op kt_code_rate_of_time(kt_graph *g, kt_op value);
/* The derivative by the position of a joint of one coordinate. */
kt_op kt_code_rate_of_position(kt_graph *g, kt_op value, const kt_link *link);

/* Positions and velocities of all markers in world axes: first three numbers for each position,
 * then three for each velocity. */
void kt_code_markers(kt_code_tree *tree, kt_op *out);

/* The Jacobians of all markers, 6 x nv each, column by column: angular velocity, velocity of the marker, world axes. */
void kt_code_jacobians(kt_code_tree *tree, kt_op *out);

/* dtau/dq and dtau/dv of the inverse dynamics: out has 2 nv nv entries. The accelerations in tree->acceleration are
 * inputs and count as constants. The function needs the next `also` entries of out, too, so that their operations add
 * no cost. */
void kt_code_inverse_derivatives(kt_code_tree *tree, size_t also, kt_op *out);

/* tau of the inverse dynamics, dtau/dq and dtau/dv. */
void kt_code_composite_derivatives(kt_code_tree *tree, kt_op *tau, kt_op *by_q, kt_op *by_v);

/* The derivatives of the joint forces of all effects. */
void kt_code_effect_derivatives(kt_code_tree *tree, kt_op *out);

/* The derivatives of `count` nodes by q, then by v. out: count entries for each coordinate. */
void kt_code_differentiate(kt_code_tree *tree, const kt_op *f, int count, kt_op *out);

/* da/dq, da/dv and da/dtau of the forward dynamics for the forces KT_OP_GIVEN: out has 3 nv nv entries. work: nv x nv.
 * One guard for each coordinate. */
void kt_code_forward_derivatives(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

#endif
