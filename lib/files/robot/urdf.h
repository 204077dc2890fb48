/* A robot in URDF while it is read: its links and joints, and its omissions. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_URDF_H
#define KT_ROBOT_URDF_H

#include "robot/robot_contact.h"

/* The kinds of joints. A scalar one has one coordinate, which may have limits, damping and friction. */
typedef struct kt_urdf_kind {
    const char *name;
    kt_joint_type type;
    bool is_scalar, is_limited;
} kt_urdf_kind;

typedef struct kt_urdf_joint {
    const kt_element *element;
    const kt_urdf_kind *kind; /* NULL: it could not be read */
    int parent, child;        /* links; -1: not found */
    double lower, upper;      /* infinite if there are none */
    double effort, speed;     /* infinite if there are none */
    const char *name;         /* in the scene */
    double start;             /* initial position of a scalar joint */
    double armature;          /* armature by a transmission */
    int master;               /* the joint that it follows; -1: none */
    double multiplier, offset;
    bool is_placed;         /* the joint's start has been found */
    double stiffness, rest; /* numbers of a spring by <gazebo> */
} kt_urdf_joint;

typedef struct kt_urdf_link {
    const kt_element *element;
    const char *body; /* the link's name in the scene; NULL: the link is the world */
    int carrier;      /* the joint that has it as child; -1: none */
    int index;        /* index of the link's body in the scene; -1: none */
    double mu[3];     /* `mu`, `mu1` and `mu2` of <gazebo>; below zero: not given */
    bool is_light;    /* without weight */
} kt_urdf_link;

/* <compiler> of <mujoco>: what changes masses. */
typedef struct kt_urdf_compiler {
    bool balances, from_geoms;                    /* balanceinertia, inertiafromgeom */
    double mass_least, inertia_least, total_mass; /* 0: none */
} kt_urdf_compiler;

enum { LINKS = 0, JOINTS = 1 }; /* scopes of names */

typedef struct kt_urdf {
    kt_reader *r;
    const kt_robot_source *source;
    kt_draft draft;
    kt_appearance appearance;
    const kt_element *robot;
    kt_urdf_link *links;
    kt_urdf_joint *joints;
    int link_count, joint_count;
    kt_names names;
    kt_namer namer; /* names of bodies */
    kt_strange strange;
    kt_collisions collisions;
    kt_left shapes, limits, rates, scales, words, starts, renamed;
    kt_left disordered;                      /* limits that are left out */
    kt_left followers, beyond, fixed_mimics; /* mimic joints that start elsewhere than at zero, that start beyond their
                                                limits, and that are left out */
    kt_inertia_findings inertias;
    kt_left geared, ungeared, massless; /* transmissions with and without armature; a robot without masses */
    kt_left by_density, by_geoms;       /* links with a mass by density, or by inertiafromgeom */
    kt_left hollow, doubled;            /* meshes without a mass; second <inertial> */
    kt_left bounded, balanced;          /* counts of inertias changed by MuJoCo's compiler */
    kt_urdf_compiler compiler;
    kt_left undeclared, freed; /* the link `world`; links on it that move freely */
    kt_left no_gravity;        /* links without weight */
    kt_vec3 gravity;
    bool has_gravity; /* the file gives it */
} kt_urdf;

/* ---- urdf_attribute.c: numbers ----------------------------------------------------------------------------------- */

/* Reads an attribute of one, three or four numbers. Without it, or if e is NULL, values stay as they are. Returns
 * whether there were numbers, and reports a text that is no number. */
bool kt_urdf_numbers(kt_reader *r, const kt_element *e, const char *name, int count, double *values);
void kt_urdf_need_number(kt_reader *r, const kt_element *e, const char *name, double *value);
kt_vec3 kt_urdf_vector(kt_reader *r, const kt_element *e, const char *name, kt_vec3 standard);

/* Reads a bound, which may be infinite. Returns whether there is one, and reports a text that is none. */
bool kt_urdf_bound(kt_reader *r, const kt_element *e, const char *name, double *value);

/* The pose of an element's `origin`, and its rotation as the file gives it. */
kt_pose kt_urdf_origin(kt_reader *r, const kt_element *e, kt_rotation *rotation);

/* ---- urdf_tree.c: links and joints ------------------------------------------------------------------------------- */

/* Numbers the links and joints of <robot>, in the order of the file. Returns false if there is no memory. */
bool kt_urdf_collect(kt_urdf *u);

/* Reads armatures from transmissions. */
void kt_urdf_transmissions(kt_urdf *u);

/* Whether the root link (-1: none) represents the world. */
bool kt_urdf_is_world(const kt_urdf *u, int root);

/* The link that no joint carries; -1 after reporting that there is not one. */
int kt_urdf_root(kt_urdf *u);

/* Gives each link the name of its body, or NULL if it is the world. */
void kt_urdf_names(kt_urdf *u, int root);

/* ---- urdf_extension.c: what simulators add ----------------------------------------------------------------------- */

/* Reads what <gazebo> gives to links and joints, and gravity, before bodies are made. */
void kt_urdf_read_extensions(kt_urdf *u);

/* The friction of a collision of a link, by Drake, Gazebo or PyBullet; 1 if none of them gives it. */
double kt_urdf_friction(kt_urdf *u, const kt_urdf_link *link, const kt_element *collision);

/* The arm of rolling or torsional friction, m, which PyBullet gives by an element in <contact>; 0: none. */
double kt_urdf_arm(kt_urdf *u, const kt_urdf_link *link, const char *name);

/* Adds springs of joints, and forces against the weight of links, after the masses are known. */
void kt_urdf_extend(kt_urdf *u);

/* ---- urdf_body.c: what they become ------------------------------------------------------------------------------- */

/* Gives links the masses that the options name. */
void kt_urdf_given_masses(kt_urdf *u);

/* Masses by the settings of MuJoCo's compiler. */
void kt_urdf_settle_masses(kt_urdf *u);

/* Bodies, loops and effects of the draft. */
void kt_urdf_bodies(kt_urdf *u);

#endif
