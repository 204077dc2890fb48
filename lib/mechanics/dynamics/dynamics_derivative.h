/* The common part of the derivatives of the dynamics: the equations, and the arrays in which they are evaluated.
 *
 * Spatial vectors. V = (w, v) and A = (alpha, a) are the angular velocity of a body and the velocity of its point that
 * is at O now, and their rates. F = (n, f) is a wrench about O.
 *     (w, v) x  (s, u) = (w x s, w x u + v x s)
 *     (s, u) x* (n, f) = (s x n + u x f, s x f)
 * A link is a chain of *nodes*. A node has degrees of freedom S_k that move along with each other: a single degree of
 * freedom, or the three rotations of a spherical joint. A free link has two nodes, three translations and then three
 * rotations. With C and A_C the motion of the frame that carries the node,
 *     V = C + sum S_k v_k
 *     A = A_C + sum S_k a_k + C x sum S_k v_k
 *
 * The step q (+) e_k moves the node and all links after it along S_k as one rigid body. The step also changes the
 * motion of these links by
 *     dV = psi',   dA = psi'' - V x psi',    psi' = C x S_k,   psi'' = A_C x S_k + C x psi'
 * and a rate v_k changes it by
 *     dV = S_k,    dA = phi - V x S_k,       phi = C x S_k + V_node x S_k
 * (Proof: differentiate the two sums above with respect to q_k and use Jacobi's identity. The links after it follow by
 * induction.) In F = I A + V x* I V - external, with I A linear in A, the terms in dV are 2B:
 *     with q_k:   dF = S_k x* F + I psi'' + 2B psi' + X s_k         s_k: the angular part of S_k
 *     with v_k:   dF = I phi + 2B S_k
 * 2B acts on the angular part alone. For mass elements m at x,
 *     2B (b, c) = sum (x x g, g),   g = 2 m b x xdot
 *     2B = [2 (tr T 1 - T); -2 [p]],   T = sum m xdot x',   p = sum m xdot
 *     of a link   T = v h' + [w] (tr J / 2 1 - J),   p = m v + w x h
 * X is needed because external wrenches do not rotate with the body: X s = (s x n + c x (s x f), s x f) for a wrench
 * (n, f) at c. Let F^C, I^C, B^C, X^C be the sums over all that a node carries. S_k x* drops out of S_i . F after k,
 * because S_i moves along, so that
 *     dtau_i / dq_k = S_i . (I^C_i psi''_k + 2B^C_i psi'_k + X^C_i s_k)                    i in k's node or after it
 *     dtau_i / dq_k = S_i . (S_k x* F^C_k + I^C_k psi''_k + 2B^C_k psi'_k + X^C_k s_k)     i before k's node
 * and likewise for v (Carpentier & Mansard 2018; Singh, Russell & Wensing 2022, IEEE RA-L 7(2), who write B and psi).
 *
 * Forward dynamics eliminates each joint from these terms in the same way as from a link's bias wrench (aba.h). With U
 * = I S and d = 1 / S.U, from the tips to the root,
 *     I -= U U' d,   2B -= U d S'2B,   X -= U d S'X
 * yields the terms that a node passes to its parent. Armature is added to S.U and appears nowhere else. Then, for each
 * k, the wrench
 *     f_k = I psi'' + 2B psi' + X s + S_k x* F^C        with q_k
 *     f_k = I phi + 2B S_k                              with v_k
 * acts on the nodes before k, on the way to the root:
 *     y_i = -d S_i . f,   f += U y_i
 * and the forward pass yields
 *     da_i = y_i - d U_i . dA - d S_i'(2B psi' + X s),   dA += S_i da_i
 * where psi''_k joins dA at k's node, and psi'_k applies from k's node on, to all that k carries.
 *
 * Lengths and velocities are expressed about the origin of the tree's first link. Therefore no digits cancel far from
 * the world's origin or in a tree that travels fast. The equations of motion do not change with this origin and
 * velocity (Galilei). A link's own matrices are about its own origin.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_DYNAMICS_DERIVATIVE_H
#define KT_DYNAMICS_DYNAMICS_DERIVATIVE_H

#include "base/arena.h"
#include "dynamics/dof.h"
#include "dynamics/dynamics.h"

/* Degrees of freedom in the order of the links, one a lane. */
enum { KT_LANES = 8 };
typedef double kt_v8 __attribute__((vector_size(64)));

typedef struct kt_derivative_node {
    int32_t link;
    int32_t parent;       /* a node; 0: the ground */
    int32_t first, count; /* degrees of freedom */
    bool branches;        /* some child is not the next node */
} kt_derivative_node;

/* The row of a degree of freedom, applied to dA, psi' and s: U = I S, S'2B and S'X; for forward dynamics times d. */
typedef struct kt_dof_row {
    double s[6], u[6], b[3], x[3], d;
    int32_t node, v;
    int32_t before; /* the degree of freedom before it on its path; -1: none */
} kt_dof_row;

/* The columns of KT_LANES degrees of freedom, expressed about the tree's origin. */
typedef struct kt_dof_batch {
    int64_t node[KT_LANES];
    kt_v8 s[6];            /* S */
    kt_v8 psi[3];          /* psi', angular */
    kt_v8 rate[6], phi[6]; /* psi'', phi */
    kt_v8 wrench[2][6];    /* f_k with q_k, with v_k */
} kt_dof_batch;

typedef struct kt_derivative_link {
    int32_t last;                   /* the link's last node */
    kt_v4 origin, velocity, linear; /* the origin, its velocity; linear: the spatial acceleration's part */
    kt_articulated inertia;         /* [J H; G M], and in moment and force F^C */
    kt_v4 bn[3], bf[3];             /* 2B by columns */
    kt_v4 xn[3], xf[3];             /* X */
} kt_derivative_link;

/* A strip of columns stored in memory on its way from a node to its children and back. */
typedef struct kt_derivative_state {
    kt_v8 q[6], psi[3], s[3];
    kt_v8 v[6];
} kt_derivative_state;

static inline size_t kt_batches(const kt_counts *n) { return (n->v + KT_LANES - 1) / KT_LANES; }

/* Every array: type, name, count, meaning. Results of forward dynamics are stored batch by batch, the lanes of a row
 * next to each other. Results of inverse dynamics are nv x nv matrices of doubles, column-major, in the order of the
 * coordinates. */
#define KT_DERIVATIVE_FIELDS(X)                                                                                        \
    X(kt_derivative_node, node, n->link + n->v / 6, "of the tree; a free link has two")                                \
    X(kt_dof_motion, motion, n->v, "of each degree of freedom")                                                        \
    X(kt_dof_row, row, n->v, "of each degree of freedom")                                                              \
    X(kt_dof_batch, batch, kt_batches(n), "of degrees of freedom")                                                     \
    X(kt_derivative_link, link, n->link, "of each link")                                                               \
    X(kt_derivative_state, state, n->link + n->v / 6, "of each node, while its terms are computed")                    \
    X(double, a, n->v, "accelerations")                                                                                \
    X(kt_v8, dq, kt_batches(n) * n->v, "result by positions")                                                          \
    X(kt_v8, dv, kt_batches(n) * n->v, "result by velocities")                                                         \
    X(kt_v8, dtau, kt_batches(n) * n->v, "result by joint forces; of inverse dynamics the mass matrix")

typedef struct kt_derivative_work {
    size_t nodes;
    int32_t dofs;  /* number of the nodes' degrees of freedom so far, while they are made */
    bool branched; /* some node branches */
    KT_ARENA_DECLARE(KT_DERIVATIVE_FIELDS)
} kt_derivative_work;

/* The accelerations that data->motion holds: minus gravity after dynamics, without gravity after kinematics. */
typedef enum kt_motion_kept { KT_MOTION_HEAVY, KT_MOTION_WEIGHTLESS } kt_motion_kept;

/* The kernels. kt_derivative_terms computes the terms from data->motion, the rates v and the accelerations a. `absorb`:
 * joints are projected out, for forward dynamics. `loaded`: there are external wrenches, without which X is zero.
 * `unit`: derivatives with respect to tau are requested, too. kt_derivative_forward returns false if a number is not
 * finite. kt_planar_derivative_inverse replaces the first two functions in a plane, and does not store the terms. */
#define KT_DERIVATIVES_DECLARE(isa)                                                                                    \
    void kt_derivative_terms_##isa(const kt_model *model, kt_data *data, const double *v, const double *a,             \
                                   const kt_wrench *external, kt_motion_kept kept, bool absorb,                        \
                                   kt_derivative_work *w);                                                             \
    void kt_derivative_inverse_##isa(const kt_model *model, bool loaded, kt_derivative_work *w);                       \
    void kt_planar_derivative_inverse_##isa(const kt_model *model, kt_data *data, const kt_dynamic_state *at,          \
                                            const double *a, kt_derivative_work *w);                                   \
    bool kt_derivative_forward_##isa(const kt_model *model, bool unit, bool loaded, kt_derivative_work *w);            \
    void kt_derivative_hand_over_##isa(const kt_model *model, const kt_derivative_work *w, const kt_v8 *from,          \
                                       double *to);

KT_EACH_ISA(KT_DERIVATIVES_DECLARE)

/* Computes kt_dynamics_inverse_derivatives, and the mass matrix. The results dq, dv and dtau (the mass matrix) stay in
 * *w, which is initialised in `memory` of kt_dynamics_work_size bytes. The matrices may overflow.
 *
 * in_space: also computes the terms and data->motion, which planar models do not need. */
KT_CHECKED kt_status kt_inverse_derivatives_fill(const kt_model *model, kt_data *data, void *memory,
                                                 const kt_dynamic_state *at, const double *a, bool in_space,
                                                 kt_derivative_work *w, kt_error *error);

/* The derivatives of accelerations by positions, velocities and joint forces, nv x nv each; the last may be NULL. */
typedef struct kt_forward_matrices {
    double *q, *v, *tau;
} kt_forward_matrices;

/* kt_dynamics_forward_derivatives, and unless a is NULL the accelerations themselves. */
KT_CHECKED kt_status kt_forward_derivatives_fill(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 const kt_dynamic_state *at, double *a, const kt_forward_matrices *by,
                                                 kt_error *error);

/* Returns the error that derivatives overflow. */
kt_status kt_derivatives_overflow(kt_error *error);

#endif
