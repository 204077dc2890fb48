/* Random mechanisms for the tests of the recursions, with a model, data and random states. They have every joint type,
 * branches, massless bodies inside chains, oblique axes of any length, turned and shifted joint frames, and markers. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_DYNAMICS_TREE_H
#define KT_TEST_DYNAMICS_TREE_H

#include "fixture.h"

#include "kinetree/dynamics.h"

enum { KT_TREE_BODIES = 24, KT_TREE_SLOTS = KT_TREE_BODIES + 1, KT_TREE_NV = 6 * KT_TREE_BODIES };
enum { KT_TREE_NQ = 7 * KT_TREE_BODIES, KT_TREE_ALL_TYPES = (1 << KT_JOINT_TYPE_COUNT) - 1 };

enum {
    KT_TREE_PLANAR_TYPES = 1 << KT_JOINT_FIXED | 1 << KT_JOINT_REVOLUTE | 1 << KT_JOINT_PRISMATIC | 1 << KT_JOINT_PLANAR
};

/* What to grow. A tree with as many bodies as there are joint types in the set, or more, has each of them. */
typedef struct kt_tree_plan {
    int bodies;
    unsigned types;       /* joint types: bits 1 << KT_JOINT_... */
    bool massless;        /* some bodies have no mass, some are points; the mechanism is regular nevertheless */
    bool weightless;      /* no gravity */
    bool floats;          /* the first body is free and carries all others */
    bool is_shuffled;     /* the description lists children before their parents */
    double from_world;    /* chance that a body hangs on the world */
    int planar;           /* N: every N-th tree moves in an oblique plane; 0: no tree is forced into one. Only types of
                           * KT_TREE_PLANAR_TYPES occur; masses and forces lie anywhere. Not with massless or
                           * shuffled. */
    bool one_plane;       /* all of them in the same plane, or in parallel ones */
    double with_armature; /* chance that a joint has armature, which differs between its degrees of freedom */
} kt_tree_plan;

/* 12 bodies, all types, massless ones, gravity, in order. */
kt_tree_plan kt_tree_plan_default(void);

/* The same of trees that move in planes. */
kt_tree_plan kt_tree_plan_planar(void);

/* Points into itself: not to be copied. */
typedef struct kt_tree {
    kt_description description;
    kt_body body[KT_TREE_BODIES];
    char name[KT_TREE_BODIES][16];
    kt_marker marker[KT_TREE_BODIES];
    kt_model *model;
    kt_data *data;
    int count; /* of bodies in the model, world included */
    int nq, nv;
    kt_vec3 normal; /* of one_plane, in the world */
} kt_tree;

/* Describes a mechanism, without a model. */
void kt_tree_describe(kt_tree *tree, const kt_tree_plan *plan, kt_random *random);

/* Compiles tree->description. A failure ends the test, which owns the model and its data. */
void kt_tree_compile(kt_tree *tree, const kt_model_options *options);

/* Both. */
void kt_tree_grow(kt_tree *tree, const kt_tree_plan *plan, kt_random *random);

/* Gives a model and data to the running test that kt_tree_compile has not made. */
void kt_tree_own(const kt_tree *tree);

/* Frees both at once, for a tree that is compiled again. */
void kt_tree_free(kt_tree *tree);

typedef struct kt_tree_state {
    double q[KT_TREE_NQ], v[KT_TREE_NV], a[KT_TREE_NV], tau[KT_TREE_NV];
    kt_wrench external[KT_TREE_SLOTS];
} kt_tree_state;

/* Angles within half a turn, lengths within 1 m, unit quaternions; velocities, accelerations, forces and wrenches of
 * the order of one. */
void kt_tree_state_draw(const kt_tree *tree, kt_random *random, kt_tree_state *state);

/* A random tree at a random state. */
void kt_tree_sample(kt_tree *tree, const kt_tree_plan *plan, kt_random *random, kt_tree_state *state);

/* Calls that must succeed: a failure ends the test. */
void kt_tree_forward(const kt_tree *tree, const kt_tree_state *s, double *a);
void kt_tree_inverse(const kt_tree *tree, const kt_tree_state *s, double *tau);
void kt_tree_mass(const kt_tree *tree, const kt_tree_state *s, double *mass);
void kt_tree_kinematics(const kt_tree *tree, const kt_tree_state *s);

/* A spring, drag and a bushing on bodies b1 to b6. */
enum { KT_TREE_BURDENS = 3 };
void kt_tree_burden(kt_effect effects[KT_TREE_BURDENS]);

kt_vec3 kt_tree_vector(kt_random *random, double lower, double upper);
kt_vec3 kt_tree_direction(kt_random *random);

/* A rotation, uniform, in a description of any type. */
kt_rotation kt_tree_rotation(kt_random *random);

/* An inertia that a body of about the given size can have, turned anyhow. */
kt_sym3 kt_tree_inertia(kt_random *random, double mass, double size);

/* Largest magnitude of n numbers. */
double kt_tree_largest(const double *x, int n);

#endif
