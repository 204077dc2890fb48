/* A mechanism while it is written as a robot. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_WRITE_H
#define KT_ROBOT_WRITE_H

#include "kinetree/effect.h"
#include "kinetree/export.h"
#include "kinetree/expression.h"
#include "robot/robot.h"

/* The forces in a joint of one coordinate. */
typedef struct kt_export_forces {
    double damping[3], stiffness[3]; /* polynomials, as of kt_polynomial_spring */
    double friction, rest[2];        /* rest: positions between which the spring has no force; equal but of a sum */
    double range[2];                 /* bounds of the sum of its actuators; none if both are equal */
} kt_export_forces;

static inline bool kt_export_has_force_range(const kt_export_forces *f) { return f->range[0] < f->range[1]; }

/* A coupling as a joint's: q = a0 + a1 q' + a2 q'^2 + ..., with q' of another body's joint; -1: it follows none. */
typedef struct kt_export_follower {
    int master;
    double a[5];
} kt_export_follower;

/* The form in which a body is written. */
typedef enum kt_export_role {
    KT_EXPORT_BODY,   /* a body */
    KT_EXPORT_MERGED, /* a body without mass: the only body that it carries has its joints */
    KT_EXPORT_SUM,    /* a fixed tendon, whose length its position represents */
} kt_export_role;

/* A motor or servo, in the joint of a body. */
typedef struct kt_export_motor {
    const kt_effect *effect;
    int body;
} kt_export_motor;

/* A spring and a damper between two ends or along a path: a spatial tendon. */
typedef struct kt_export_rope {
    const kt_effect *effect;
    double stiffness[3], damping[3], friction, armature;
    double rest[2]; /* lengths between which the spring has no force */
} kt_export_rope;

/* A tendon that is fixed to joints. */
typedef struct kt_export_line {
    const char *name;                   /* NULL: it has none */
    bool is_renamed;                    /* another element has the name */
    const kt_term *terms;               /* joints, a coefficient each */
    int count;                          /* length of terms */
    const kt_polynomial_spring *spring; /* NULL: none */
    const kt_actuator *actuator;        /* the last one that has it; NULL: none */
} kt_export_line;

/* An actuator by numbers. */
typedef struct kt_export_actuator {
    const kt_effect *effect;
    const kt_actuator *numbers;
    int body, rope, line; /* body of the joint; index in `ropes`, in `lines`; -1: none. A site if all are -1 */
    int state;            /* of its activation; -1: none */
} kt_export_actuator;

enum { KT_LOST_MOST = 64 };

/* An item that the format does not have. */
#define KT_EXPORT_EFFORTS "motors and servos that MuJoCo limits to the effort of their joints (it is data here)"

/* Mass, its centre and moments about it. */
typedef struct kt_export_inertial {
    double mass;
    kt_vec3 com;
    kt_sym3 inertia;
} kt_export_inertial;

typedef struct kt_export {
    const kt_description *d;
    const kt_scene *scene; /* scene of the description; NULL: none */
    const kt_scene_mesh *meshes;
    int mesh_count;
    const char *folder; /* folder where the file will be; NULL: unknown */
    FILE *stream;
    kt_pool pool;
    kt_names names;                         /* scopes from 0 on: bodies, joints, markers (to the first body) */
    int *parent, *first_child, *next_child; /* tree of bodies; -1: the world, none */
    int first_root;                         /* the first body on the world */
    kt_export_role *role;                   /* role of each body */
    const kt_loop **sum;                    /* for a slider that is a sum: the coupling that defines it */
    kt_export_forces *forces;               /* forces of bodies' joints */
    kt_export_follower *followers;
    kt_export_motor *motors;
    int motor_count;
    kt_export_rope *ropes;
    int rope_count;
    kt_export_rope *lengths; /* ropes that have an armature alone */
    int length_count;
    kt_export_actuator *actuators;
    int actuator_count;
    kt_export_line *lines;
    int line_count;
    bool *is_kept;           /* for each auxiliary state: whether an actuator has it */
    kt_loop const **tendons; /* couplings of several joints, or of one */
    int tendon_count;
    const char **mesh_files; /* for each mesh: its file, seen from `folder`; NULL: the mesh is left out */
    int raised, lightened;   /* bodies whose moments were raised, and those that got a mass since they move */
    int weighted;            /* bodies without a joint that got a mass since they have moments */
    double most_raised;      /* kg m^2 */
    const char *most_raised_body;
    kt_export_inertial *inertials; /* inertials of bodies, as they are written */
    double least;                  /* the smallest mass and moment that the format's readers accept */
    double least_fixed;            /* the smallest mass of a body without a joint that readers do not leave out */
    double spare; /* share by which the largest moment is below the sum of the others, for bodies that are turned */
    struct {
        const char *what;
        int count;
    } lost[KT_LOST_MOST];
    int lost_count;
} kt_export;

/* One joint of those that a joint of several coordinates becomes. */
typedef struct kt_export_step {
    kt_joint_type type; /* revolute, prismatic, spherical, free */
    kt_vec3 axis;
} kt_export_step;

enum { KT_EXPORT_STEPS = 4 };

/* How many joints a joint becomes, one after the other; 0 of a fixed one. A free joint stays one. */
int kt_export_steps(const kt_joint *joint, kt_export_step steps[KT_EXPORT_STEPS]);

/* A bound; 1e9 or -1e9 in place of an infinite one, which the formats do not have. */
static inline double kt_export_bound(double x) { return isfinite(x) ? x : copysign(1e9, x); }

/* Counts an item that the format does not have. */
void kt_export_lose(kt_export *x, const char *what);

/* A coupling of two joints as the polynomial with which the joint of the term `own` follows the other. Returns false if
 * the coupling is none. */
bool kt_export_polynomial(kt_export *x, const kt_loop *loop, int own, double a[5]);

/* Writes a text with %s, %d and %g (kt_print_pieces). In the arguments, special characters of XML are replaced. */
void kt_export_print(kt_export *x, const char *format, ...) KT_PRINTF(2, 3);

/* Write ` name="1 2 3"`; a number unless it is zero. */
void kt_export_numbers(kt_export *x, const char *name, const double *values, int count);
void kt_export_vector(kt_export *x, const char *name, kt_vec3 v);
void kt_export_unless_zero(kt_export *x, const char *name, double value);

/* The body of a name; -1: the world. */
static inline int kt_export_find(const kt_export *x, const char *body) {
    return body != NULL ? kt_names_find(&x->names, 0, body) : -1;
}
static inline const kt_body *kt_export_body(const kt_export *x, int i) { return &x->d->bodies[i]; }

/* A shape as a box, sphere or cylinder along z; a rod is a cylinder between its ends. Returns false, and counts it,
 * where it has no size or is a point. */
bool kt_export_solid(kt_export *x, kt_shape *shape);

/* Shape k of a body: its own, then the further ones. */
static inline const kt_shape *kt_export_shape(const kt_body *body, int k) {
    return k == 0 ? &body->shape : &body->shapes[k - 1];
}

/* The point of an end, in its body's frame. */
kt_pose kt_export_end(const kt_export *x, const kt_end *end);

/* The body of a joint with one coordinate; -1 where there is none of the name. */
int kt_export_scalar(const kt_export *x, const char *joint);

/* Parses a formula in the memory of the export. NULL if it has none, is faulty, or if there is no memory. */
const kt_expression *kt_export_parse(kt_export *x, const char *text, const kt_symbols *symbols);

/* The action at each body; `depth` is the number of bodies around it. */
typedef void kt_export_visit(kt_export *x, int body, int depth);

/* ---- write_role.c ------------------------------------------------------------------------------------------------ */

/* Finds the form in which each body of MJCF is written. False if there is no memory. */
bool kt_export_find_roles(kt_export *x);

/* For a slider that is a sum of joints, returns offset / c_n, its position less the length L of the tendon
 * (write_role.c). *own is its coefficient c_n. */
double kt_export_number_offset(const kt_export *x, int body, double *own);

/* ---- write_moment.c ---------------------------------------------------------------------------------------------- */

/* An inertia that readers accept: moments about axes, which are those of the body if `is_plain`. */
typedef struct kt_export_moments {
    double mass;
    kt_vec3 com;
    kt_sym3 full;     /* about the axes of the body */
    double moment[3]; /* about `axes` */
    kt_mat3 axes;
    double raised;   /* the largest change of a moment */
    bool is_raised;  /* the moment was raised by more than rounding */
    bool is_nothing; /* no mass and no moments */
    bool is_plain;   /* `full` is accepted as it is */
} kt_export_moments;

/* The inertia of body i (-1: without mass). If it moves, mass and moments are raised to the least that readers accept,
 * and counted. */
kt_export_moments kt_export_take_moments(kt_export *x, int i, bool moves);

/* Finds the masses and moments that bodies are written with. False if there is no memory. */
bool kt_export_find_inertials(kt_export *x);

/* ---- write_start.c, write_mesh.c --------------------------------------------------------------------------------- */

/* Makes x->d a copy whose joints start where assembly closes all loops. False if there is no memory. */
bool kt_export_assemble(kt_export *x);

/* Finds the files of meshes. `endings`: those that the format's readers support, as " .stl .obj "; NULL: all. */
bool kt_export_find_meshes(kt_export *x, const char *endings);

/* ---- write_path.c ------------------------------------------------------------------------------------------------ */

/* Takes the armatures of paths out of the description (write_length.c). False if there is no memory. */
bool kt_export_take_lengths(kt_export *x);

/* Adds an effect to the ropes; false if no tendon has its force. */
bool kt_export_take_rope(kt_export *x, const kt_effect *e);

/* Adds the path of an effect; false if MJCF has no such path. */
bool kt_export_add_rope(kt_export *x, const kt_effect *e);

/* Writes ` attribute="NAME"` of a rope. */
void kt_export_rope_name(kt_export *x, const char *attribute, int rope);

/* Writes the sites and geoms of ropes that are on a body (-1: the world), and their tendons. */
void kt_export_rope_points(kt_export *x, int body);
void kt_export_ropes(kt_export *x);

/* ---- write_actuator.c -------------------------------------------------------------------------------------------- */

/* Adds the actuators of an effect; false if it has none, or MJCF has no such place. */
bool kt_export_take_actuators(kt_export *x, const kt_effect *e);
void kt_export_listed_actuators(kt_export *x);

/* The control of an actuator, or of its activation. */
double kt_export_control(const kt_export *x, const kt_export_actuator *d);

/* Adds a polynomial spring; false if MJCF has no such one. Then the attributes of polynomials, as far as there are any:
 * ` name="1"`, or ` name="1 2 3"`. */
bool kt_export_take_spring(kt_export *x, const kt_effect *e);
void kt_export_write_polynomial(kt_export *x, const char *name, const double k[3]);

/* ---- write_line.c ------------------------------------------------------------------------------------------------ */

/* Adds a tendon that is fixed to joints, unless one without a spring has the name; returns its index. */
int kt_export_add_line(kt_export *x, const char *name, const kt_term *terms, int count);

/* Write ` attribute="NAME"` of such a tendon, and the bounds of the sum of an actuator's tendon (NULL: none). */
void kt_export_line_name(kt_export *x, const char *attribute, int line);
void kt_export_sum_range(kt_export *x, const kt_actuator *actuator);

/* ---- the formats ------------------------------------------------------------------------------------------------- */

void kt_export_urdf(kt_export *x);
void kt_export_mjcf(kt_export *x);

/* write_tree.c: visits bodies within one another. `end` (NULL: none) is called after the bodies that a body carries. */
void kt_export_tree(kt_export *x, kt_export_visit *begin, kt_export_visit *end);

/* write_mjcf_force.c: tendons, equalities, actuators, the start. */
void kt_export_tendons(kt_export *x);
void kt_export_equalities(kt_export *x);
void kt_export_actuators(kt_export *x);
void kt_export_start(kt_export *x);

/* The pose of a body of MJCF in its parent: its joint frame, with the start of a free joint on the world. */
kt_pose kt_export_pose(const kt_export *x, int body);

/* Whether a free joint is on another body than the world: in MJCF three slides and a ball. */
static inline bool kt_export_is_deep(const kt_export *x, int body) {
    return kt_export_body(x, body)->joint.type == KT_JOINT_FREE && x->parent[body] >= 0;
}

/* Whether a loop prescribes the motion of a joint of one coordinate. MJCF has no such motion: an equality holds the
 * joint at its start. */
static inline bool kt_export_is_held(const kt_export *x, const kt_loop *loop) {
    return loop->type == KT_LOOP_MOTION && kt_export_scalar(x, loop->joint) >= 0;
}

/* Whether a loop is an equality of sites in MJCF. */
static inline bool kt_export_has_sites(const kt_loop *loop) {
    return loop->side == KT_SIDE_NONE && (loop->type == KT_LOOP_SPHERICAL || loop->type == KT_LOOP_WELD ||
                                          loop->type == KT_LOOP_REVOLUTE || loop->type == KT_LOOP_UNIVERSAL);
}

#endif
