/* Contacts of robots with planes: the law, the points that touch, and collisions of URDF and SDF. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_ROBOT_CONTACT_H
#define KT_ROBOT_ROBOT_CONTACT_H

#include "mesh/mesh.h"
#include "robot/robot.h"

/* ---- contact_law.c: stiffness, damping, friction ----------------------------------------------------------------- */

/* The numbers of a contact in MuJoCo. */
typedef struct kt_contact_law {
    double friction, torsion, rolling; /* coefficient of slip; lengths for a spin about the normal and for rolling, m */
    double condim, priority, mix;      /* mix: weight of a mean */
    double reference[2];               /* solref: time constant, s, and damping ratio; or -stiffness, -damping */
    double impedance[5];               /* solimp: least and largest impedance, width, m, midpoint, power */
    double distance;                   /* distance of the surfaces at which contact begins */
} kt_contact_law;

/* The settings of all contacts: the shortest time constant, impratio, and the kind of the cones. */
typedef struct kt_contact_cone {
    double shortest, ratio;
    bool is_pyramid;
} kt_contact_cone;

/* MuJoCo's defaults. */
kt_contact_law kt_contact_law_standard(void);

/* If the two numbers of solref have mixed signs, they become MuJoCo's default, as in MuJoCo; then it is false. */
bool kt_contact_law_settle(kt_contact_law *law);

#define KT_NOTE_MIXED_REFERENCE                                                                                        \
    "solref of which one number alone is above zero, so that MuJoCo's default applies, 0.02 and 1"

/* ---- robot_contact.c: solids on planes --------------------------------------------------------------------------- */

/* Directions in which a body without edges is sampled: to faces, edges and corners of a cube. */
enum { KT_CONTACT_EXTREMES = 26, KT_CONTACT_POINTS_MOST = 64 /* contacts of one solid with one plane */ };

/* A solid of a body that touches planes, and how. */
typedef struct kt_contact_shape {
    const kt_element *element;
    const char *name, *body; /* name of the effect; name of the body in the scene */
    kt_namer *names;         /* names of effects */
    kt_solid solid;          /* NONE: the points are the shape */
    double size[3];          /* half sizes; radius, half length */
    const kt_vec3 *points;
    int point_count;
    kt_pose pose;                                            /* in the body */
    double friction, slip, stiffness, exponent, dissipation; /* as in the effect */
    double torsion, rolling, turn;                           /* values as in the effect */
    double mobility, mass;                                   /* mobility of the body, 1/kg; mass of the robot */
    bool turns_freely;                                       /* turns by a free joint or about an axis without limits */
} kt_contact_shape;

/* A plane through the origin of a pose in a body (NULL: the world), with its z axis as the normal. */
typedef struct kt_ground {
    const char *body;
    kt_pose pose;
} kt_ground;

/* The spring and damper that yield as much under a force as the soft law between parts with a mobility, 1/kg. Without
 * such a force MuJoCo's law oscillates slower, by sqrt(1 - d): the law also resists accelerations. Returns d. */
double kt_contact_law_yield(const kt_contact_law *law, double shortest, double mobility, double force,
                            double *stiffness, double *damping);

/* Sets the stiffness, exponent, dissipation and frictions of a shape, with the speeds over which frictions build up.
 * `gravity` is the magnitude of gravity (0: 9.81 m/s^2). */
void kt_contact_law_apply(const kt_contact_law *law, const kt_contact_cone *cone, double gravity,
                          kt_contact_shape *shape);

/* Counts of the shapes that touch planes. */
typedef struct kt_contact_tally {
    kt_left planes, made, lost; /* lost: shapes that no contact can represent */
    kt_left floors;             /* boxes that are planes */
    kt_left rounded, rough;     /* ellipsoids, and meshes of wheels, of which contacts are near */
    double depth;               /* depth of the deepest contact at the start */
} kt_contact_tally;

/* Adds the contacts of a shape with a plane, and counts the shape. */
void kt_contact_make(kt_draft *d, kt_contact_shape *shape, const kt_ground *ground, const kt_contact_law *law,
                     const kt_contact_cone *cone, double gravity, kt_contact_tally *touched);

/* ---- contact_points.c: meshes on planes -------------------------------------------------------------------------- */

/* The vertices in which a mesh touches planes: the corners of its flat faces, and those that are the farthest in
 * KT_CONTACT_EXTREMES directions. Returns their number, 0 without vertices. Cost: O(size of the mesh). */
int kt_contact_mesh_points(const kt_triangles *mesh, kt_vec3 points[KT_CONTACT_POINTS_MOST]);

/* The directions to the faces, edges and corners of a box, for the numbers below KT_CONTACT_EXTREMES. The length of a
 * direction has no meaning. A direction has no component along an axis without an extent. */
kt_vec3 kt_contact_direction(int i, kt_vec3 extent);

#define KT_NOTE_ROUNDED                                                                                                \
    "ellipsoids that touch planes, each as 26 spheres inside it, so that it sinks by up to 8 % of its longest half "   \
    "axis, and loses speed like a polygon if it rolls:"

#define KT_NOTE_STIFF                                                                                                  \
    "contacts are stiff: the method is " KT_ROBOT_STIFF_METHOD " (--integrator names another); shapes that touch:"

/* Whether the points of a mesh are those of a wheel or ball: round about one of the axes. */
bool kt_contact_is_round(const kt_vec3 *points, int count);

#define KT_NOTE_ROUGH                                                                                                  \
    "meshes of wheels, which touch planes in points, so that they bump and lose speed like polygons; give them "       \
    "cylinders or spheres as collisions:"

/* ---- contact_tree.c: the tree of a robot that touches ------------------------------------------------------------ */

/* The tree of bodies, and data at its initial positions. */
typedef struct kt_contact_tree {
    kt_model *model;
    kt_data *data;
    double *q, *v; /* v: zeros */
} kt_contact_tree;

/* On success the caller releases the tree; on failure there is nothing to release. */
kt_status kt_contact_tree_make(kt_reader *r, const kt_body *bodies, int count, kt_contact_tree *tree, kt_error *error);
void kt_contact_tree_free(kt_contact_tree *tree);

/* The mean of (J M^-1 J')_ii over three directions, with the Jacobian J of a point of a body. `factors` is the Cholesky
 * factor of the mass matrix; `room` has space for 7 vectors of nv. */
double kt_contact_mobility(const kt_contact_tree *tree, int body, kt_vec3 at, const double *factors, double *room);

/* Gives stops their stiffness and damping that have none. Returns the depth of the deepest contact at the start, in m;
 * zero if none is closed, or if the tree cannot be computed. */
double kt_contact_settle(kt_draft *d);

#define KT_NOTE_SOFT_STOPS                                                                                             \
    "limits of position that act as stops, since shapes touch, as soft as MuJoCo's by default (--stops gives another " \
    "stiffness):"

/* The pose of an end in the world, at the start. */
kt_pose kt_contact_pose(const kt_contact_tree *tree, const kt_end *end);

/* ---- contact_floor.c: boxes as ground ---------------------------------------------------------------------------- */

typedef struct kt_floors {
    kt_draft *d;
    kt_contact_tree tree;
    kt_vec3 up;       /* against gravity; z without gravity */
    kt_vec3 *middles; /* middles of the shapes that move, at the start */
    int count;
} kt_floors;

/* For up to `most` shapes that move; on success the caller ends the search. False if there is no tree. */
bool kt_floors_begin(kt_floors *f, kt_draft *d, kt_vec3 gravity, int most);
void kt_floors_end(kt_floors *f);
void kt_floors_add(kt_floors *f, const char *body, kt_pose pose);

/* Whether a box that does not move is ground for all shapes. `plane` receives the pose of its upper face in the
 * body. */
bool kt_floors_find(const kt_floors *f, const char *body, kt_pose pose, const double half[3], kt_pose *plane);

#define KT_NOTE_FLOORS "boxes that do not move, and are ground for the shapes above them, as planes without edges:"

/* ---- collision.c: collisions of URDF and SDF --------------------------------------------------------------------- */

typedef struct kt_collision {
    const kt_element *element;
    int body; /* index of the body in the draft; -1: the world */
    bool is_plane;
    kt_solid solid; /* NONE: a mesh, or nothing known */
    double size[3];
    const char *mesh; /* the mesh's file; NULL: none */
    kt_vec3 scale;
    kt_pose pose;                      /* in the body */
    double friction, torsion, rolling; /* coefficient of slip; the arms of torsional and rolling friction, m */
    unsigned mask;                     /* two shapes touch if their masks have a bit in common */
} kt_collision;

typedef struct kt_collisions {
    kt_list items; /* kt_collision */
    kt_left all;
    kt_contact_tally touched;
    bool moves_freely;                       /* a body has a free joint */
    kt_left stops;                           /* soft ones */
    kt_left directional, disputed, standing; /* frictions that differ: by direction, of simulators, at rest */
    kt_left deepening;                       /* torsional frictions whose arm grows with the depth */
} kt_collisions;

/* The friction of a collision of which the file gives none. */
static const double KT_FRICTION_STANDARD = 1.0;

/* The friction of Drake's proximity properties of a collision, of slip before that of rest; below zero: none. */
double kt_friction_of_drake(kt_collisions *c, const kt_element *collision);

/* Counts a collision, and keeps it if the options ask for contacts. */
void kt_collisions_add(kt_collisions *c, kt_reader *r, const kt_robot_options *o, const kt_collision *item);

/* Adds the contacts of all collisions with planes that do not move. */
void kt_collisions_contacts(kt_collisions *c, kt_draft *d, const kt_robot_source *source, kt_vec3 gravity);

/* Adds the notes about collisions; `root` is the element of the whole. */
void kt_collisions_notes(kt_notes *notes, const kt_collisions *c, const kt_robot_options *o, const kt_element *root,
                         kt_vec3 gravity);

/* Notes of all formats: a robot that moves freely without a plane, and one that starts `depth` deep in a plane. */
void kt_note_groundless(kt_notes *notes, const kt_element *root);
void kt_note_sunk(kt_notes *notes, const kt_element *root, double depth);

#endif
