/* The links of a model with nodes in place of numbers.
 *
 * All numbers that are not zero are parameters, unless the options fix these numbers (`constant`): gravity; mass, com,
 * inertia, armature and pitch of bodies; and the positions of joint frames. Zeros and rotations are constants.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_NODE_TREE_H
#define KT_CODEGEN_NODE_TREE_H

#include "codegen/node_vector.h"
#include "model/model.h"

/* Longer names of bodies and markers are cut. */
enum { KT_CODE_BODY_NAME = 64, KT_CODE_NAME = 3 * KT_CODE_BODY_NAME };

/* A number that the user of a generated file may change. */
typedef struct kt_code_parameter {
    char name[KT_CODE_NAME]; /* name of the struct's member */
    const char *meaning;     /* with its unit */
    double value;
} kt_code_parameter;

/* A link. The joint rotates the link from its axes at rest, which are fixed in the parent. */
typedef struct kt_code_link {
    const kt_link *link;
    const char *name; /* name of the body whose joint the link is part of */
    int parent;
    bool is_rotated; /* at rest */
    kt_op33 rest;    /* axes at rest in the parent's axes */
    kt_op3 at;       /* origin in the parent */
    kt_op shift;     /* along the joint's axis, of the origin from where the model has it */
    kt_op pitch;
    kt_op mass, armature[KT_DOF_MAX];
    kt_op size;    /* size of the inertia that the link carries, as kt_link.size */
    kt_op carried; /* the mass */
    kt_op3 moment;
    kt_op6 inertia;
} kt_code_link;

/* The numbers of a loop. */
typedef struct kt_code_loop {
    char name[KT_CODE_BODY_NAME]; /* name with which its parameters begin */
    kt_op3 at[2];                 /* ends, in their links */
    kt_op value;                  /* length or offset */
    kt_op pitch, radius, tube, angle;
} kt_code_loop;

typedef struct kt_code_tree {
    const kt_model *model;
    kt_graph *graph;
    bool constant;
    bool is_uniform; /* links of a long chain, which are alike */
    int link_count;
    kt_code_link *link;
    kt_link *record; /* records of the links, if they differ from those of the model */
    kt_code_parameter *parameter;
    int parameter_count;
    size_t parameter_room;
    kt_op3 gravity;
    kt_op33 *body_rotation; /* rotation of each body in its link */
    kt_op3 *body_position;
    char (*body_name)[KT_CODE_NAME]; /* as an identifier of C */
    int32_t *before;                 /* the coordinate that carries each one; -1: none */
    kt_op3 *marker;                  /* positions of markers in their links, once they are used; before, -1 */
    const kt_op *acceleration;       /* accelerations for inverse dynamics; NULL: KT_OP_GIVEN */
    bool is_at_rest;                 /* rates are zero */
    const kt_op *load;               /* joint forces besides KT_OP_GIVEN of forward dynamics; NULL: none */
    kt_op *force;                    /* joint forces of effects, once they are made; before, NULL */
    kt_code_loop *loop;              /* all loops, once their equations are made; before, NULL */
    kt_op *coefficient;              /* coefficients of the loops' terms, once made; before, NULL */
    kt_op loop_length;               /* length to which residuals in m are relative */
} kt_code_tree;

/* Reads a model. Returns false if memory is insufficient. */
bool kt_code_tree_read(kt_code_tree *tree, const kt_model *model, kt_graph *graph, bool constant);

/* Moves the origins of links along the axes of their joints. */
void kt_code_tree_place_origins(kt_code_tree *tree);

/* Moves to the parent the part of a link's inertia that acts, for every motion of the joint, like inertia of the
 * parent. */
void kt_code_tree_regroup(kt_code_tree *tree);

/* Makes a copy of a long chain whose links have the axes of their joints as third axes, by cyclic permutations. Sets
 * is_uniform if all links of the copy, except the first and the last links, then have the same zeros; other numbers may
 * differ. All but the links is shared with the original. */
void kt_code_tree_turn(kt_code_tree *turned, const kt_code_tree *tree);

/* Adds a rigid body at the position r: mass m, first moment h and inertia J about the body's origin. */
void kt_code_add_rigid(kt_graph *g, kt_code_link *to, kt_op m, kt_op3 h, const kt_op6 *j, kt_op3 r);

/* The pose of a link in its parent, in the function that is being made. */
typedef struct kt_code_frame {
    const kt_code_link *link;
    kt_op cosine, sine, square, product; /* the last two are sin^2 and sin cos */
    kt_op33 turn;                        /* rotation by a quaternion */
    kt_op3 offset;                       /* position of the origin, parent's axes */
} kt_code_frame;

kt_code_frame kt_code_frame_of(kt_code_tree *tree, int link);
/* Rotates a vector from the axes of the link to those of the parent; and back. */
kt_op3 kt_code_up(kt_graph *g, const kt_code_frame *f, kt_op3 a);
kt_op3 kt_code_down(kt_graph *g, const kt_code_frame *f, kt_op3 a);
/* The two parts of this rotation: from the axes of the link to the axes at rest, and from the axes at rest to the
 * parent's. */
kt_op3 kt_code_to_rest(kt_graph *g, const kt_code_frame *f, kt_op3 a);
kt_op3 kt_code_from_rest(kt_graph *g, const kt_code_frame *f, kt_op3 a);
kt_op3 kt_code_rest_up(kt_graph *g, const kt_code_frame *f, kt_op3 a);
kt_op3 kt_code_rest_down(kt_graph *g, const kt_code_frame *f, kt_op3 a);
/* Symmetric and other matrices, to the axes at rest and from these to the parent's. */
kt_op6 kt_code_inertia_to_rest(kt_graph *g, const kt_code_frame *f, const kt_op6 *j);
kt_op6 kt_code_inertia_rest_up(kt_graph *g, const kt_code_frame *f, const kt_op6 *j);
kt_op33 kt_code_matrix_to_rest(kt_graph *g, const kt_code_frame *f, const kt_op33 *h);
kt_op33 kt_code_matrix_rest_up(kt_graph *g, const kt_code_frame *f, const kt_op33 *h);
kt_op6 kt_code_up_inertia(kt_graph *g, const kt_code_frame *f, const kt_op6 *j);

/* A rate or an acceleration: an input, or a node of tree->acceleration. */
kt_op kt_code_rate(const kt_code_tree *tree, kt_op_array array, int index);
/* The force in a joint, of forward dynamics: an input, and a node of tree->load. */
kt_op kt_code_given_force(const kt_code_tree *tree, int index);
/* Rates or accelerations of a joint: rotations in the link's axes, translations in its axes at rest. */
void kt_code_rates(kt_code_tree *tree, int link, kt_op_array array, kt_op3 *angular, kt_op3 *linear);
/* The node of a number: a parameter PREFIX_SUFFIX (NULL: SUFFIX), or a constant if the number is zero or fixed.
 * `meaning` must stay valid. */
kt_op kt_code_number(kt_code_tree *tree, const char *prefix, const char *suffix, const char *meaning, double value);
/* Three numbers SUFFIX_x, SUFFIX_y and SUFFIX_z. */
kt_op3 kt_code_numbers(kt_code_tree *tree, const char *prefix, const char *suffix, const char *meaning,
                       const double value[3]);
/* The position of a marker in its link. */
kt_op3 kt_code_marker(kt_code_tree *tree, int body, int marker);
/* The marker of a body at a position in the body's frame; -1: there is none. */
int kt_code_find_marker(const kt_code_tree *tree, int body, kt_vec3 at);
/* The position of an end of an effect or a loop in its link: the position of the link's marker, or parameters NAME_at
 * or NAME_at2. at: in the axes of the body, about its origin. */
kt_op3 kt_code_place_in_link(kt_code_tree *tree, int body, kt_vec3 at, const char *name, int end);
/* A rotation, without its rounding errors near 0 and 1. */
kt_op33 kt_code_rotation(kt_graph *g, const kt_mat3 *r, bool *is_rotated);

/* Degree of freedom d of a link: a rotation about axis k of the link, or a translation along its axis k at rest. A
 * screw is a rotation with a pitch, which is 0 for all others. */
typedef struct kt_code_dof {
    bool turns, is_of_three; /* of_three: there is one for each axis */
    int k;
} kt_code_dof;

static inline kt_code_dof kt_code_dof_of(const kt_link *link, int d) {
    const int lengths = kt_link_lengths(link);
    const bool turns = d >= lengths, is_of_three = kt_motion_facts_of((kt_motion)link->motion).quaternions > 0;
    return (kt_code_dof){turns, is_of_three, !is_of_three ? link->axis : turns ? d - lengths : d};
}

static inline kt_motion kt_code_motion(const kt_code_link *l) { return (kt_motion)l->link->motion; }

#endif
