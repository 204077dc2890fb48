/* A model or world in SDF while it is read. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_SDF_H
#define KT_ROBOT_SDF_H

#include "robot/robot_contact.h"

/* ---- frames ------------------------------------------------------------------------------------------------------ */

/* An item with a name and a pose. The frames are a tree: each has a pose in its base, at the position of all joints
 * zero. */
typedef enum kt_sdf_kind { KT_SDF_WORLD, KT_SDF_MODEL, KT_SDF_LINK, KT_SDF_JOINT, KT_SDF_FRAME } kt_sdf_kind;

typedef struct kt_sdf_frame {
    kt_sdf_kind kind;
    const kt_element *element;
    const char *name;
    int scope;   /* the model or the world in which it has its name; of the world -1 */
    int home;    /* base of poses in this scope without `relative_to`; the frame __model__ */
    int version; /* version of the frame's file: 112 for 1.12 */
    bool is_static;

    const kt_element *pose_element; /* NULL: none */
    const kt_element *placement;    /* for a model: names the frame that the pose places; NULL: the model's own */
    const char *placed;             /* name of that frame */
    int base;                       /* -1: of the world, or not found yet */
    kt_pose pose, world;            /* in base, in the world */
    int depth;                      /* number of bases below it; -1: not found yet */

    int follows; /* the frame that it moves with; a link or the world follow themselves; -1: nothing */
    int link;    /* a link's number; for a joint that of its first axis; else -1 */
} kt_sdf_frame;

/* ---- links and joints -------------------------------------------------------------------------------------------- */

/* A link; that of number 0 is the world. Between the two axes of a joint there is one without mass. */
typedef struct kt_sdf_link {
    const kt_element *element; /* the link's; between axes, the joint's */
    int frame;                 /* the link's; between axes, the joint's */
    const char *body;          /* the link's name in the scene; NULL: the world */
    bool is_between, is_static;
    int carrier; /* the joint that carries it in the tree; -1: none */
    int depth;   /* -1: not in the tree yet */
    int index;   /* index of the link's body in the scene; -1: the world */
    int rigid;   /* the link that it is fixed to, by any number of fixed joints; itself where it moves */
} kt_sdf_link;

/* A joint of one axis, or of none; revolute2, universal and piston are two. */
typedef struct kt_sdf_joint {
    const kt_element *element, *axis; /* axis: NULL if it has none */
    int frame, parent, child;         /* links */
    kt_joint_type type;
    kt_vec3 direction; /* direction of the axis, in the frame `expressed` */
    int expressed;
    double pitch;     /* m per radian */
    bool is_cut;      /* the joint closes a loop in any tree */
    bool is_used;     /* the joint carries a link */
    bool is_reversed; /* the joint carries its parent */
    int body;         /* the body of the scene that has the joint; -1: none */
    const char *name; /* in the scene; NULL: it has no coordinate there */
} kt_sdf_joint;

/* A mechanism in SDF, from its frames to the scene. Each kt_left is reported as a note. */
typedef struct kt_sdf {
    kt_reader *r;
    const kt_robot_source *source;
    kt_element *root;
    size_t included_bytes;
    int root_scope; /* names of bodies begin below it */
    kt_vec3 gravity;
    kt_names names;
    kt_namer bodies_named, joints_named;
    kt_draft draft;
    kt_list frames, links, joints; /* kt_sdf_frame ... */
    kt_list gears;                 /* int: frames of gearboxes */
    int *order, order_count;       /* links from the world outwards */
    kt_inertia_findings inertias;

    const kt_known_list *known; /* lists of the format */
    kt_strange strange;         /* elements that the files have besides */
    kt_left renamed, renamed_frames, renamed_models, unversioned, others, missing, newer, older, no_gravity, floating,
        reserved, at_rest, kinematic, freed;
    kt_left standard_masses, by_geometry, lost_masses;
    kt_phrase massless_names; /* links of lost_masses */
    kt_left offsets, halves, reversed, loops, loop_forces, still_joints, outside, limits, disordered, friction;
    kt_left gearboxes, lost_gears, mimics, lost_mimics, states;
    kt_left pictures, by_density;
    kt_collisions collisions;
    kt_appearance appearance;
} kt_sdf;

/* ---- sdf_value.c: numbers in elements ---------------------------------------------------------------------------- */

/* Reads the numbers of a child element; without it, values stay as they are. Returns whether there are numbers now, and
 * reports a text that is no numbers. e may be NULL. */
bool kt_sdf_numbers(kt_sdf *m, const kt_element *e, const char *child, int count, double *values);
double kt_sdf_number(kt_sdf *m, const kt_element *e, const char *child, double standard);
kt_vec3 kt_sdf_vector(kt_sdf *m, const kt_element *e, const char *child, kt_vec3 standard);
bool kt_sdf_flag(kt_sdf *m, const kt_element *e, const char *child, bool standard);
bool kt_sdf_is_true(kt_sdf *m, const kt_element *e, const char *text);

/* The text of a child element; NULL if there is none. */
const char *kt_sdf_text(const kt_element *e, const char *child);

/* The pose that a <pose> gives (NULL: none). */
kt_pose kt_sdf_read_pose(kt_sdf *m, const kt_element *pose);

/* ---- sdf_frame.c ------------------------------------------------------------------------------------------------- */

/* Finds links, joints, frames and models in a <world> or <model>, and in its included models. */
void kt_sdf_collect(kt_sdf *m, const kt_element *within, bool is_world, int version);

/* Names, and the poses of all frames. */
void kt_sdf_place(kt_sdf *m);

/* The frame of a name, as seen from a frame's own scope; -1 after reporting, at e, that there is none. */
int kt_sdf_find(kt_sdf *m, const kt_element *e, int frame, const char *name);

/* The frame that an element of a joint names; -1 after reporting, also if there is no such element. */
int kt_sdf_named_by(kt_sdf *m, int frame, const char *child);

/* The pose of a frame in another. */
kt_pose kt_sdf_pose(const kt_sdf *m, int of, int in);

/* The pose of an element of a frame, such as a visual of a link, in that frame. */
kt_pose kt_sdf_pose_within(kt_sdf *m, const kt_element *e, int frame);

/* The number of the link that a frame moves with; 0: the world; -1 after reporting that there is none. */
int kt_sdf_link_of(kt_sdf *m, const kt_element *e, int frame);

/* ---- sdf_include.c ----------------------------------------------------------------------------------------------- */

/* The <model> of the file that an <include> names, and its version; NULL if it is left out. */
const kt_element *kt_sdf_include(kt_sdf *m, const kt_element *e, int *version);

/* The version that an <sdf> has, which becomes 1.4 where it is older; 0 after reporting. */
int kt_sdf_version(kt_sdf *m, kt_element *sdf);

/* ---- sdf_old.c --------------------------------------------------------------------------------------------------- */

/* Makes the tree of a version before 1.4 one of 1.4. */
void kt_sdf_convert(kt_sdf *m, kt_element *sdf);

/* ---- sdf_joint.c, sdf_tree.c, sdf_body.c, sdf_force.c ------------------------------------------------------------ */

/* The link that an element of a joint names; -1 after reporting, as above. */
int kt_sdf_link_named(kt_sdf *m, int frame, const char *child);

/* Reads the axis of a joint whose element and frame are given, in its child `which`. */
void kt_sdf_read_axis(kt_sdf *m, kt_sdf_joint *j, const char *which);

void kt_sdf_read_joints(kt_sdf *m);
void kt_sdf_grow_tree(kt_sdf *m);
void kt_sdf_make_bodies(kt_sdf *m);
void kt_sdf_make_loops(kt_sdf *m);

/* Adds the spring, damping, friction and stop of a joint of one coordinate; in a loop, `name` is that of the loop.
 * Without a name it adds nothing, and returns whether there is one of these. */
bool kt_sdf_resist(kt_sdf *m, const kt_sdf_joint *j, const char *name);
void kt_sdf_make_effects(kt_sdf *m);
void kt_sdf_couple(kt_sdf *m); /* gearboxes and mimics */

/* Mass, centre and inertia of a link, and its picture. */
void kt_sdf_masses(kt_sdf *m, const kt_sdf_link *link, kt_body *body);
void kt_sdf_picture(kt_sdf *m, const kt_sdf_link *link, kt_body *body);

static inline kt_sdf_frame *kt_sdf_frame_at(const kt_sdf *m, int i) { return (kt_sdf_frame *)m->frames.items + i; }
static inline kt_sdf_link *kt_sdf_link_at(const kt_sdf *m, int i) { return (kt_sdf_link *)m->links.items + i; }
static inline kt_sdf_joint *kt_sdf_joint_at(const kt_sdf *m, int i) { return (kt_sdf_joint *)m->joints.items + i; }
static inline bool kt_sdf_is_scalar(const kt_sdf_joint *j) {
    return j->type == KT_JOINT_REVOLUTE || j->type == KT_JOINT_PRISMATIC || j->type == KT_JOINT_SCREW;
}

/* The joint on the other side of a link between two axes. */
static inline kt_sdf_joint *kt_sdf_other_half(const kt_sdf *m, const kt_sdf_link *between, const kt_sdf_joint *half) {
    kt_sdf_joint *first = kt_sdf_joint_at(m, kt_sdf_frame_at(m, between->frame)->link);
    return half == first ? first + 1 : first;
}

/* The direction of a joint's axis in a frame. */
static inline kt_vec3 kt_sdf_axis_in(const kt_sdf *m, const kt_sdf_joint *j, int frame) {
    return kt_mat3_apply(kt_sdf_pose(m, j->expressed, frame).rotation, j->direction);
}

#endif
