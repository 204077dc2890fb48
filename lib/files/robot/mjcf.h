/* A model in MJCF while it is read. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_MJCF_H
#define KT_ROBOT_MJCF_H

#include "effect/actuator.h"
#include "kinetree/expression.h"
#include "mesh/mesh.h"
#include "robot/mjcf_notes.h"
#include "robot/robot_contact.h"

#include <math.h>

/* ---- default classes --------------------------------------------------------------------------------------------- */

/* A <default> element. An attribute has the value in the element, else in the element's class, else in the class around
 * this class. The class main may be written in several places. */
typedef struct kt_mjcf_class {
    const char *name;
    const kt_element *element;
    int outer; /* the class around it; of one at the root: the place of main before it; -2: none */
} kt_mjcf_class;

/* ---- settings ---------------------------------------------------------------------------------------------------- */

typedef enum kt_mjcf_from_geom { KT_MJCF_NEVER, KT_MJCF_ALWAYS, KT_MJCF_AUTO } kt_mjcf_from_geom;

/* Settings of <compiler>. The comments give their defaults. */
typedef struct kt_mjcf_settings {
    double angle;                   /* radians a unit: degrees */
    char sequence[4];               /* order of Euler angles: xyz, about carried axes; capital letters: fixed ones */
    bool autolimits;                /* a range is a limit unless `limited` overrides it: true */
    double total_mass;              /* <= 0: as it is */
    bool balance;                   /* inertias that no body has become spheres': false */
    double mass_least, least;       /* least masses and principal moments: 0 */
    kt_mjcf_from_geom from_geom;    /* inertia from geoms: where there is no <inertial> */
    double group_first, group_last; /* groups of geoms that have mass: 0 to 5 */
    const char *mesh_folder;
    bool exact_meshes; /* volumes with signs: false */
    bool fits_boxes;   /* solids are fitted to the box around a mesh: false */
    bool strip_path;
    bool fuses_static; /* MuJoCo makes bodies without joints parts of their parents: false */
    bool align_free;   /* frames of free bodies that carry nothing are those of their inertia: false */
} kt_mjcf_settings;

/* The features that <option> turns off. */
typedef struct kt_mjcf_off {
    bool springs, dampers, friction, limits, actuation, equalities, control_limits, contacts;
    unsigned actuator_groups; /* a bit each */
} kt_mjcf_off;

/* ---- documents --------------------------------------------------------------------------------------------------- */

/* The model itself (document 0), or an attached model. An element has the settings and default classes of its document.
 * Files that a document includes are part of the document. */
typedef struct kt_mjcf_document {
    kt_element *root;
    int parent; /* the document that attaches it; -1: the model itself */
    const char *path, *prefix;
    kt_mjcf_settings settings;
    int main;       /* the document's last class at the root; -2: none */
    kt_list joints; /* const kt_element *: all that it has, in MuJoCo's order, attached or not */
} kt_mjcf_document;

/* ---- bodies, joints, sites --------------------------------------------------------------------------------------- */

typedef struct kt_mjcf_body {
    const kt_element *element;
    int parent;
    kt_pose pose, world; /* in the parent, and in the world, at the reference position of all joints */
    kt_pose frame;       /* in the body: MuJoCo's frame, that of the inertia (`align`) or the body's own */
    const char *name;    /* in the scene; NULL: the world */
    double mass;
    kt_vec3 com;
    kt_sym3 inertia; /* about com, body axes */
    double gravcomp;
    double mobility; /* acceleration of its centre of mass per force, 1/kg, at the reference; 0: not computed */
    kt_shape shape;
    const kt_shape *shapes;
    int shape_count;
    kt_list markers; /* kt_marker */
    int first_joint, joint_count;
    bool is_freed;   /* fixed to the world, and moved freely by the options */
    int lost_meshes; /* geoms of unknown mass */
    int heavy_geoms; /* geoms that have mass */
    bool has_mesh;   /* one of these is a mesh */
    bool has_axes;   /* `inertial` has the axes of the inertia, as MuJoCo has them */
    kt_pose inertial;
    int child_count;
    bool has_ellipsoids; /* some geoms in a medium are ellipsoids */
    const char *medium;  /* the marker at which a medium acts, along the axes of the inertia; NULL: none */
    kt_mat3 medium_axes; /* axes of this marker, in the body */
} kt_mjcf_body;

typedef enum kt_mjcf_motion { KT_MJCF_FREE, KT_MJCF_BALL, KT_MJCF_SLIDE, KT_MJCF_HINGE } kt_mjcf_motion;

typedef struct kt_mjcf_joint {
    const kt_element *element;
    const char *tag; /* class of the joint's defaults; NULL: none */
    int body;
    kt_mjcf_motion type;
    kt_vec3 at, axis;                 /* body frame */
    double ref, spring, lower, upper; /* spring: position at which the joint's spring has no force */
    double effort;                    /* the largest of its actuators' */
    double force[2];                  /* bounds of the sum of actuator forces in it */
    double inertia; /* effective inertia at the reference positions, if requested (springdamper); else 0 */
    bool is_limited;
    int position, velocity; /* the joint's first coordinates in MuJoCo's order */
    const char *carrier;    /* body of the scene that has it */
    const char *name;       /* in the scene */
    int carrier_index;
    double start; /* initial position of a scalar joint */
} kt_mjcf_joint;

typedef struct kt_mjcf_site {
    const kt_element *element;
    int body;
    kt_pose pose;
} kt_mjcf_site;

/* A sphere or cylinder with a name, around which tendons may lead. */
typedef struct kt_mjcf_wrap {
    int body;
    kt_pose pose;
    double radius;
    bool is_cylinder; /* along z of the pose */
} kt_mjcf_wrap;

/* A fixed tendon: L = sum c_i q_i. A spatial one has no terms, but a path. */
typedef struct kt_mjcf_tendon {
    const kt_element *element;
    int first, count;   /* terms */
    const char *joint;  /* the scalar joint that it acts in; NULL: not made yet */
    double coefficient; /* L = coefficient times the position of that joint */
    double length;      /* at the reference positions */
    double rest;        /* while the springs of all joints have no force */
    double start;       /* initially */
    kt_path_point *path;
    int path_count;
    bool moves;      /* the tendon has points on several bodies */
    bool is_bounded; /* a joint between a site and the ground has bounds of the sum of its actuators */
} kt_mjcf_tendon;

typedef struct kt_mjcf_term {
    int joint;
    double coefficient;
} kt_mjcf_term;

/* Scopes of names; classes have one for each document, from KT_MJCF_CLASSES on. */
enum {
    KT_MJCF_BODIES,
    KT_MJCF_JOINTS,
    KT_MJCF_SITES,
    KT_MJCF_WRAPS, /* geoms around which tendons may lead */
    KT_MJCF_TENDONS,
    KT_MJCF_COMPLETE_TENDONS, /* tendons without a missing reference */
    KT_MJCF_MESHES,
    KT_MJCF_CLASSES
};

/* Numbers in place of the class of an element. Incomplete: the element refers to an item that is not attached. */
enum { KT_MJCF_INCOMPLETE = -3 };

typedef struct kt_mjcf {
    kt_reader *r;
    const kt_robot_source *source;
    kt_element *root;
    kt_list documents;                   /* kt_mjcf_document */
    size_t included_bytes, joined_bytes; /* bytes of files; of names that kt_mjcf_join made */
    int elements;                        /* number of elements of all files */
    kt_list lost_names;                  /* const char *: names of incomplete items */
    kt_list classes;                     /* kt_mjcf_class */
    kt_vec3 gravity;
    double density, viscosity; /* properties of the medium */
    kt_mjcf_off off;
    kt_names names;
    kt_namer bodies_named, joints_named, effects_named;

    kt_list bodies, joints, sites, tendons, terms, meshes; /* bodies[0] is the world */
    kt_list surfaces;                                      /* geoms that touch others (mjcf_contact.c) */
    const kt_mjcf_settings *body_settings;                 /* settings for the body whose geoms are read */
    bool geoms_have_mass, has_visuals;
    int nq, nv;
    double *qpos, *qvel, *ctrl, *mpos, *mquat; /* values of the keyframe; NULL: none is requested */
    const double *act;                         /* activations of all actuators, by the keyframe; NULL: zeros */
    kt_namer states_named;
    kt_list wraps;                            /* kt_mjcf_wrap */
    kt_list reaches;                          /* kt_mjcf_reach */
    int ctrl_count, mocap_count, mocap_keyed; /* bodies that a program moves: of the scene so far, of the keyframe */

    kt_draft draft;

    kt_strange strange;         /* elements and attributes that are left out */
    kt_unknown forces, changes; /* actuators, tendons, equalities that are left out; omissions that change the motion */
    kt_mjcf_notes notes;        /* counters of what else the report names */
    kt_phrase massless_names;   /* bodies of mesh_masses */
    kt_appearance appearance;
    kt_contact_tally touched;
} kt_mjcf;

/* ---- mjcf_attribute.c -------------------------------------------------------------------------------------------- */

/* Reports a fault: "body 'thigh': joint 'knee': " and the format. Returns false. */
bool kt_mjcf_fault(kt_mjcf *m, const kt_element *e, const char *format, ...) KT_PRINTF(3, 4);

/* The nearest body around an element; NULL: the world. */
const kt_element *kt_mjcf_body_around(const kt_element *e);

/* Finds the classes, and gives each element the number of its class. */
void kt_mjcf_classes(kt_mjcf *m);

/* The <default> element of a class, whose number becomes the number of the class around it; NULL: no such class. */
const kt_element *kt_mjcf_class_element(const kt_mjcf *m, int *number);

/* The value of an attribute, or of its default for elements called `tag` (NULL: no defaults); NULL if there is none. */
const char *kt_mjcf_text(const kt_mjcf *m, const kt_element *e, const char *tag, const char *name);

/* Reads the numbers of an attribute, from `least` to `most`. Missing numbers at the end are taken from the class, as in
 * MuJoCo; others do not change. Returns the count of the numbers in the element itself; 0 if the attribute is missing,
 * or wrong, which is reported. */
int kt_mjcf_numbers(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, int least, int most,
                    double *values);
double kt_mjcf_number(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, double standard);
kt_vec3 kt_mjcf_vector(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, kt_vec3 standard);

/* Returns which of the words, which end with NULL, an attribute is; `standard` if there is none. */
int kt_mjcf_choice(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, const char *const *words,
                   int standard);
bool kt_mjcf_flag(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, bool standard);

/* Whether a range is a limit, by `limited` (true, false, auto). */
bool kt_mjcf_is_limited(kt_mjcf *m, const kt_element *e, const char *tag, const char *limited, const char *range);

/* The rotation by three angles of `euler`. */
kt_mat3 kt_mjcf_rotation_of_euler(const kt_mjcf_settings *settings, const double angles[3]);

/* `pos`, and the orientation by any of its ways. */
kt_pose kt_mjcf_pose(kt_mjcf *m, const kt_element *e, const char *tag);

/* Two parts of a name in one, such as a prefix and the name of an element. The total size of such names is bounded, so
 * that a small file cannot use up memory. NULL after reporting. */
const char *kt_mjcf_join(kt_mjcf *m, const kt_element *e, const char *first, const char *second);

/* Adds the name of an element, if any; reports a name that exists already. */
void kt_mjcf_add_name(kt_mjcf *m, int scope, const kt_element *e, int index);

/* The index that an attribute names; -1 after reporting. */
int kt_mjcf_find(kt_mjcf *m, const kt_element *e, const char *attribute, int scope);

/* Counts unknown elements and attributes. */
void kt_mjcf_count_strange(kt_mjcf *m);

/* The element after `last` (NULL: the first) in the sections of a name, such as <equality>; NULL: there is no more.
 * Incomplete elements are skipped, except with kt_mjcf_section_of_all. */
const kt_element *kt_mjcf_section(const kt_mjcf *m, const char *section, const kt_element *last);
kt_element *kt_mjcf_section_of_all(const kt_mjcf *m, const char *section, const kt_element *last);

/* Calls `each` for the elements of a name directly in a body, or in frames of it, with the pose of the frame. */
typedef void kt_mjcf_each(kt_mjcf *m, const kt_element *e, int body, kt_pose frame);
void kt_mjcf_for_each(kt_mjcf *m, const kt_element *within, const char *name, int body, kt_mjcf_each *each);

/* ---- mjcf_include.c ---------------------------------------------------------------------------------------------- */

/* Replaces each <include> with the contents of its file, below a depth. */
void kt_mjcf_include(kt_mjcf *m, int document, int depth);

/* The path of a file that an element of a document names. The order is that of MuJoCo: first the document's folder,
 * then the folder of the file that has the element. NULL after reporting the reason. */
const char *kt_mjcf_find_file(kt_mjcf *m, int document, const kt_element *e, const char *name);

/* Puts the children of `from` (NULL: none) in place of an element that follows `before` (NULL: it is the first).
 * Returns the first of the children; if there are none, the element that follows. */
kt_element *kt_mjcf_splice(kt_element *parent, kt_element *before, kt_element *e, kt_element *from);

/* ---- mjcf_attach.c ----------------------------------------------------------------------------------------------- */

/* Makes the whole tree: files that are included, models that are attached. */
void kt_mjcf_expand(kt_mjcf *m);

/* Marks elements of attached models that refer to bodies that are not attached. Requires the complete names. */
void kt_mjcf_mark_incomplete(kt_mjcf *m);

/* Whether a document is another one, or is attached to it. */
bool kt_mjcf_is_within(const kt_mjcf *m, int document, int other);

static inline kt_mjcf_document *kt_mjcf_document_at(const kt_mjcf *m, int i) {
    return (kt_mjcf_document *)m->documents.items + i;
}
static inline const kt_mjcf_settings *kt_mjcf_settings_of(const kt_mjcf *m, const kt_element *e) {
    return &kt_mjcf_document_at(m, e->document)->settings;
}

/* ---- mjcf_mesh.c ------------------------------------------------------------------------------------------------- */

/* Lists the meshes of <asset>. */
void kt_mjcf_read_meshes(kt_mjcf *m);

/* ---- mjcf_geom.c ------------------------------------------------------------------------------------------------- */

/* Mass and inertia of a body from its <inertial> or its geoms, and its picture. */
void kt_mjcf_masses(kt_mjcf *m, int body);

/* Applies the compiler's settings to all masses. */
void kt_mjcf_settle_masses(kt_mjcf *m);

/* ---- mjcf_settings.c, _body.c, _key.c, _force.c, _inertia.c, _actuator.c, _loop.c -------------------------------- */

void kt_mjcf_read_settings(kt_mjcf *m, int document); /* reads <compiler> */
void kt_mjcf_read_options(kt_mjcf *m);                /* reads <option> */

void kt_mjcf_collect(kt_mjcf *m); /* bodies, joints, sites, tendons */
kt_mjcf_motion kt_mjcf_motion_of(kt_mjcf *m, const kt_element *joint);
void kt_mjcf_start(kt_mjcf *m);                                /* the requested keyframe */
kt_pose kt_mjcf_mocap_pose(kt_mjcf *m, const kt_mjcf_body *b); /* at the start */
void kt_mjcf_keep_start(kt_mjcf *m);  /* loops of lengths move none of its positions and velocities */
void kt_mjcf_make_bodies(kt_mjcf *m); /* makes the bodies of the scene */
void kt_mjcf_passive(kt_mjcf *m);
void kt_mjcf_find_inertias(kt_mjcf *m); /* for joints with `springdamper`; reaches of muscles */
/* The coordinates of a joint in a model of the tree; none (nv = 0) if the model does not have it. */
kt_coordinates kt_mjcf_coordinates_of(const kt_mjcf *m, const kt_model *model, const kt_mjcf_joint *j);
void kt_mjcf_read_tendons(kt_mjcf *m);
void kt_mjcf_make_tendons(kt_mjcf *m);
void kt_mjcf_actuators(kt_mjcf *m);
void kt_mjcf_equalities(kt_mjcf *m);

void kt_mjcf_contacts(kt_mjcf *m);

/* ---- mjcf_medium.c ----------------------------------------------------------------------------------------------- */

/* Adds the markers at which a medium acts, if there is one; then its forces on a body. */
void kt_mjcf_place_media(kt_mjcf *m);
void kt_mjcf_resist(kt_mjcf *m, const kt_mjcf_body *b);

/* Keeps a geom, whose solid and pose in its body are given, for contacts. */
void kt_mjcf_add_surface(kt_mjcf *m, const kt_element *e, int body, kt_solid solid, const double size[3], kt_pose pose);

/* An element that acts along a length L = factor q of a scalar joint. */
typedef struct kt_mjcf_line {
    const kt_element *element;
    const char *tag, *joint; /* class of the line's defaults; name of the joint in the scene */
    double factor;
} kt_mjcf_line;

/* Finds, or makes, the joint that a tendon acts in; false if it has none. */
bool kt_mjcf_find_length(kt_mjcf *m, kt_mjcf_tendon *t);

/* ---- mjcf_formula.c ---------------------------------------------------------------------------------------------- */

/* "2*position.a", "velocity.a": `quantity` is position or velocity. */
void kt_mjcf_put_coordinate(kt_formula_text *to, double factor, const char *quantity, const char *joint);
/* The text for a description; NULL if it had no room, or there is no memory. */
const char *kt_mjcf_keep_formula(kt_mjcf *m, const kt_formula_text *formula);
/* Names the last effect of the draft, if there is a name. */
void kt_mjcf_name_effect(kt_mjcf *m, const char *name);

/* ---- mjcf_activation.c ------------------------------------------------------------------------------------------- */

typedef enum kt_mjcf_dynamics_type {
    KT_MJCF_STATIC,
    KT_MJCF_INTEGRATOR,
    KT_MJCF_FILTER,
    KT_MJCF_MUSCLE = 4,
    KT_MJCF_LOST /* dynamics of a user: left out */
} kt_mjcf_dynamics_type;

/* The dynamics of an actuator. */
typedef struct kt_mjcf_dynamics {
    kt_mjcf_dynamics_type type;
    double numbers[3]; /* the time constant, s; of a muscle: activation, deactivation, width of the smooth transition */
    double count;      /* activations */
    double delay;      /* s, by which the control is late; the control is zero before */
} kt_mjcf_dynamics;

/* The dynamics that <general> gives, on top of those of its defaults. */
kt_mjcf_dynamics kt_mjcf_dynamics_of(kt_mjcf *m, const kt_element *e, kt_mjcf_dynamics inherited);

/* Whether an activation is computed: if not, and it is not lost, the activation is the control. */
bool kt_mjcf_is_dynamic(const kt_mjcf_dynamics *d);

/* The numbers of an actuator in `act` of a keyframe. */
int kt_mjcf_activations_of(const kt_mjcf_dynamics *d);

/* Adds the auxiliary state of an actuator, whose numbers have the control; returns its name, NULL if there is no
 * memory. */
const char *kt_mjcf_add_activation(kt_mjcf *m, const kt_element *e, const kt_mjcf_dynamics *d,
                                   const kt_actuator *control, double initial);

/* ---- mjcf_spatial.c ---------------------------------------------------------------------------------------------- */

/* Adds a geom with a name, if it is a sphere or cylinder, to those around which tendons may lead. */
void kt_mjcf_add_wrap(kt_mjcf *m, const kt_element *e, int body, kt_pose frame);

/* Reads the path of a spatial tendon, and its length while the springs of all joints have no force, as MuJoCo does.
 * False if it is left out. */
bool kt_mjcf_read_path(kt_mjcf *m, kt_mjcf_tendon *t);

int kt_mjcf_body_of_end(const kt_mjcf *m, const kt_end *end);
int kt_mjcf_common_body(const kt_mjcf *m, int a, int b); /* the body that carries both */
/* Adds springs, dampers and stops along a spatial tendon. */
void kt_mjcf_act_in_path(kt_mjcf *m, kt_mjcf_tendon *t);

/* Adds an effect along the path, without a force so far. NULL: the path is on one body, or there is no memory. */
kt_effect *kt_mjcf_add_along_path(kt_mjcf *m, kt_mjcf_tendon *t, const kt_element *e);

/* Adds its armature, as that of a slider whose position is the length (mjcf_length.c). */
void kt_mjcf_add_armature(kt_mjcf *m, const kt_mjcf_tendon *t);

enum { KT_MJCF_MUSCLE_NUMBERS = 9 };

/* ---- mjcf_reach.c ------------------------------------------------------------------------------------------------ */

/* For an actuator that is a muscle: the range of its length, and |M^-1 J'| for its length's gradient J at the reference
 * positions, the acceleration by a unit force. */
typedef struct kt_mjcf_reach {
    const kt_element *element;
    double range[2], acceleration;
    bool is_found; /* a range has been found */
} kt_mjcf_reach;

/* Adds the armatures of spatial tendons to the mass matrix at the reference positions; `room` as below. */
void kt_mjcf_add_path_armatures(kt_mjcf *m, const kt_contact_tree *tree, double *mass, double *room);
/* Finds them for all muscles. `factors` is the Cholesky factor of the tree's mass matrix at the reference positions;
 * `room` has space for 8 vectors of nv. */
void kt_mjcf_find_reaches(kt_mjcf *m, const kt_contact_tree *tree, const double *factors, double *room);

/* The next actuator with the force of a muscle after `last` (NULL: the first); NULL: there is none. */
const kt_element *kt_mjcf_find_muscle(kt_mjcf *m, const kt_element *last);

/* NULL: the actuator has no length, or the tree could not be computed. */
const kt_mjcf_reach *kt_mjcf_reach_of(const kt_mjcf *m, const kt_element *e);

/* ---- mjcf_gain.c ------------------------------------------------------------------------------------------------- */

/* The properties of an actuator with its defaults. MuJoCo keeps one set of numbers for all kinds. */
typedef struct kt_mjcf_actuator {
    int gain_type, bias_type;
    kt_mjcf_dynamics dynamics;
    bool is_strange, is_of_user;  /* kinds that are left out: its element; one of a user */
    bool has_affine_gain;         /* the gain depends on the length and its rate */
    bool has_active, has_passive; /* gain and bias are those of a muscle */
    double gain[KT_MJCF_MUSCLE_NUMBERS], bias[KT_MJCF_MUSCLE_NUMBERS];
    double inherit; /* the range of control is this part of the length's range; 0: it has its own */
} kt_mjcf_actuator;

kt_mjcf_actuator kt_mjcf_actuator_of(kt_mjcf *m, const kt_element *e);

/* To defaults, all kinds of actuators are one: each changes the attributes of all. */
#define KT_MJCF_ACTUATORS " general motor position velocity damper intvelocity cylinder muscle adhesion "
/* The numbers of `gear`, and the first of them. */
void kt_mjcf_gears_of(kt_mjcf *m, const kt_element *e, double gears[6]);
double kt_mjcf_gear_of(kt_mjcf *m, const kt_element *e);

/* Reads a range with its switch; false if it limits nothing. */
bool kt_mjcf_actuator_range(kt_mjcf *m, const kt_element *e, const char *limited, const char *name, double range[2]);

/* A range that is a part of the range of the actuator's joint or tendon; false if there is none. */
bool kt_mjcf_inherited_range(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double range[2]);

/* The range of the control; false if it has none. Then the control, clamped to its range. */
bool kt_mjcf_control_range(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double range[2]);
double kt_mjcf_control_of(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control);

/* Gain and bias by a constant, the length and its rate, without those of a muscle. */
void kt_mjcf_gains_of(const kt_mjcf_actuator *a, double gain[3], double bias[3]);

/* The muscle of MuJoCo's nine numbers; NULL if there is no memory. If its force is below zero, `scale` divided by the
 * acceleration that a unit force gives takes its place. */
const kt_muscle *kt_mjcf_muscle_of(kt_mjcf *m, const double numbers[KT_MJCF_MUSCLE_NUMBERS],
                                   const kt_mjcf_reach *reach);

/* c0 + c1 L + c2 L', the force for a constant control, without that of a muscle. */
void kt_mjcf_force_of(const kt_mjcf_actuator *a, double control, double c[3]);

/* If the damping of an actuator of positions is above zero, it is a ratio to the critical one: replaces it. The
 * actuator acts along a tendon or a joint, as in kt_mjcf_terms_of. */
void kt_mjcf_resolve_damping(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a, double gear, int tendon,
                             const kt_mjcf_term *own);

/* ---- mjcf_thrust.c ----------------------------------------------------------------------------------------------- */

void kt_mjcf_act_at_site(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double u,
                         const kt_actuator *driven);
bool kt_mjcf_act_in_free(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control);

/* Whether a polynomial has a term. */
static inline bool kt_mjcf_is_any(const double k[3]) { return k[0] != 0.0 || k[1] != 0.0 || k[2] != 0.0; }

static inline kt_mjcf_body *kt_mjcf_body_at(const kt_mjcf *m, int i) { return (kt_mjcf_body *)m->bodies.items + i; }
/* Whether a body is another one, or is carried by it. */
static inline bool kt_mjcf_is_carried(const kt_mjcf *m, int body, int by) {
    while (body > by)
        body = kt_mjcf_body_at(m, body)->parent;
    return body == by;
}
/* The pose, in the parent, of the frame that MuJoCo uses for a body, at the reference position of its joints. */
static inline kt_pose kt_mjcf_place_of(const kt_mjcf *m, int i) {
    return kt_pose_compose(kt_mjcf_body_at(m, i)->pose, kt_mjcf_body_at(m, i)->frame);
}
static inline kt_mjcf_joint *kt_mjcf_joint_at(const kt_mjcf *m, int i) { return (kt_mjcf_joint *)m->joints.items + i; }
/* Whether the forces of actuators are bounded in a joint that carries a body. */
static inline bool kt_mjcf_is_bounded_above(const kt_mjcf *m, int body) {
    bool found = false;
    for (int i = 0; i < m->joints.count; i++)
        found = found ||
                (kt_mjcf_is_carried(m, body, kt_mjcf_joint_at(m, i)->body) && !isinf(kt_mjcf_joint_at(m, i)->effort));
    return found;
}
/* Whether the bodies of two joints are the same, or one carries the other. */
static inline bool kt_mjcf_is_chain(const kt_mjcf *m, int joint, int other) {
    const int a = kt_mjcf_joint_at(m, joint)->body, b = kt_mjcf_joint_at(m, other)->body;
    return kt_mjcf_is_carried(m, a > b ? a : b, a > b ? b : a);
}
static inline kt_mjcf_site *kt_mjcf_site_at(const kt_mjcf *m, int i) { return (kt_mjcf_site *)m->sites.items + i; }
static inline kt_mjcf_tendon *kt_mjcf_tendon_at(const kt_mjcf *m, int i) {
    return (kt_mjcf_tendon *)m->tendons.items + i;
}
/* The terms of joints whose sum is a length: those of a tendon, or without one (-1) the term `own` of a joint. */
const kt_mjcf_term *kt_mjcf_terms_of(const kt_mjcf *m, int tendon, const kt_mjcf_term *own, int *count);
/* NULL beyond the last: the first of a tendon without terms, for one. */
static inline kt_mjcf_term *kt_mjcf_term_at(const kt_mjcf *m, int i) {
    return i < m->terms.count ? (kt_mjcf_term *)m->terms.items + i : NULL;
}
/* The armature of a tendon along a path; 0 of others. */
static inline double kt_mjcf_path_armature(kt_mjcf *m, const kt_mjcf_tendon *t) {
    return t->path_count > 0 && t->moves ? kt_mjcf_number(m, t->element, "tendon", "armature", 0.0) : 0.0;
}
static inline int kt_mjcf_nq(kt_mjcf_motion type) { return type == KT_MJCF_FREE ? 7 : type == KT_MJCF_BALL ? 4 : 1; }
static inline int kt_mjcf_nv(kt_mjcf_motion type) { return type == KT_MJCF_FREE ? 6 : type == KT_MJCF_BALL ? 3 : 1; }
static inline bool kt_mjcf_is_scalar(const kt_mjcf_joint *j) { return j->type >= KT_MJCF_SLIDE; }

#endif
