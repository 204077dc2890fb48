/* A model in MJCF while it is read. */
#ifndef KT_IMPORT_MJCF_H
#define KT_IMPORT_MJCF_H

#include "import/robot.h"
#include "mesh/mesh.h"

/* ---- default classes --------------------------------------------------------------------------------------------- */

/* A <default> element. The value of an attribute is that of the element, else that of its class, else of the class
 * around that. `main` may be written in several places. */
typedef struct kt_mjcf_class {
    const char *name;
    const kt_element *element;
    int outer; /* -1: main, of which there may be several; -2: none */
} kt_mjcf_class;

/* ---- settings ---------------------------------------------------------------------------------------------------- */

typedef enum kt_mjcf_from_geom { KT_MJCF_NEVER, KT_MJCF_ALWAYS, KT_MJCF_AUTO } kt_mjcf_from_geom;

/* What <compiler> says; the comments tell what is taken if it is silent. */
typedef struct kt_mjcf_settings {
    double angle;                   /* radians a unit: degrees */
    char sequence[4];               /* of Euler angles: xyz, about carried axes; capital letters: fixed ones */
    bool autolimits;                /* a range is a limit unless `limited` says otherwise: true */
    double total_mass;              /* <= 0: as it is */
    bool balance;                   /* inertias that no body has become spheres': false */
    double mass_least, least;       /* of masses and principal moments: 0 */
    kt_mjcf_from_geom from_geom;    /* inertia from geoms: where there is no <inertial> */
    double group_first, group_last; /* of geoms that have mass: 0 to 5 */
    const char *mesh_folder;
    bool exact_meshes; /* volumes with signs: false */
    bool strip_path;
} kt_mjcf_settings;

/* ---- bodies, joints, sites --------------------------------------------------------------------------------------- */

typedef struct kt_mjcf_body {
    const kt_element *element;
    int parent;
    kt_pose pose, world; /* in the parent, and in the world, at the reference position of all joints */
    const char *name;    /* in the scene; NULL: the world */
    double mass;
    kt_vec3 com;
    kt_sym3 inertia; /* about com, body axes */
    double gravcomp;
    kt_shape shape;
    const kt_shape *shapes;
    int shape_count;
    kt_list markers; /* kt_marker */
    int first_joint, joint_count;
    int lost_meshes; /* geoms whose mass is not known */
} kt_mjcf_body;

typedef enum kt_mjcf_motion { KT_MJCF_FREE, KT_MJCF_BALL, KT_MJCF_SLIDE, KT_MJCF_HINGE } kt_mjcf_motion;

typedef struct kt_mjcf_joint {
    const kt_element *element;
    const char *tag; /* of its defaults; NULL: none */
    int body;
    kt_mjcf_motion type;
    kt_vec3 at, axis; /* body frame */
    double ref, lower, upper;
    double effort;
    bool is_limited;
    int position, velocity; /* its first coordinates in MuJoCo's order */
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

/* A fixed tendon: L = sum c_i q_i. */
typedef struct kt_mjcf_tendon {
    const kt_element *element;
    int first, count;   /* terms */
    const char *joint;  /* the scalar joint that it acts in; NULL: not made yet */
    double coefficient; /* L = coefficient times the position of that joint */
    double length;      /* at the reference positions */
    double start;       /* initially */
} kt_mjcf_tendon;

typedef struct kt_mjcf_term {
    int joint;
    double coefficient;
} kt_mjcf_term;

/* What a mesh of <asset> encloses, at density 1, in the axes of its file. */
typedef struct kt_mjcf_mesh {
    const kt_element *element;
    bool is_known;
    kt_enclosed enclosed;
} kt_mjcf_mesh;

enum { KT_MJCF_CLASSES, KT_MJCF_BODIES, KT_MJCF_JOINTS, KT_MJCF_SITES, KT_MJCF_TENDONS, KT_MJCF_MESHES };

typedef struct kt_mjcf {
    kt_reader *r;
    const kt_robot_source *source;
    kt_element *root;
    kt_list files; /* const char *: that have been included */
    size_t included_bytes;
    int elements; /* of the whole, with copies of replicates */

    kt_list classes; /* kt_mjcf_class */
    int main;        /* the last; -1: none */
    kt_mjcf_settings settings;
    kt_vec3 gravity;
    kt_names names;
    kt_namer bodies_named, joints_named, effects_named;

    kt_list bodies, joints, sites, tendons, terms, meshes; /* bodies[0] is the world */
    bool geoms_have_mass, has_visuals;                     /* of the body whose geoms are read */
    int nq, nv;
    double *qpos, *qvel, *ctrl; /* of the keyframe; NULL: none is asked for */
    int ctrl_count;

    kt_draft draft;

    kt_unknown unknown, forces; /* elements; actuators, tendons, equalities that are left out */
    kt_left limits, contacts, pictures, mesh_files, mesh_rules, renamed_joints, offsets, several, mocap, soft, inactive,
        keys, tied, lost_limits, freed, attached;
    kt_appearance appearance;
    kt_left by_density, mesh_masses, balanced, bounded, by_geoms, unnamed_sites, fluid, renamed, friction, servos,
        motors, fixed_bodies;
} kt_mjcf;

/* ---- mjcf_attribute.c -------------------------------------------------------------------------------------------- */

/* Reports a fault: "body 'thigh': joint 'knee': " and the format. Returns false. */
bool kt_mjcf_fault(kt_mjcf *m, const kt_element *e, const char *format, ...) KT_PRINTF(3, 4);

/* Finds the classes, and gives each element the number of its own. */
void kt_mjcf_classes(kt_mjcf *m);

/* The <default> element of a class, whose number becomes that of the class around it; NULL: there is none. */
const kt_element *kt_mjcf_class_element(const kt_mjcf *m, int *number);

/* The value of an attribute, or of its default for elements called `tag` (NULL: no defaults); NULL if there is none. */
const char *kt_mjcf_text(const kt_mjcf *m, const kt_element *e, const char *tag, const char *name);

/* Its numbers, from `least` to `most` of them; others stay as they are. Returns how many; 0 where the attribute is
 * missing, or wrong, which is reported. */
int kt_mjcf_numbers(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, int least, int most,
                    double *values);
double kt_mjcf_number(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, double standard);
kt_vec3 kt_mjcf_vector(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, kt_vec3 standard);

/* Which of the words, which end with NULL, an attribute is; `standard` if there is none. */
int kt_mjcf_choice(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, const char *const *words,
                   int standard);
bool kt_mjcf_flag(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, bool standard);

/* Whether a range is a limit, by `limited` (true, false, auto). */
bool kt_mjcf_is_limited(kt_mjcf *m, const kt_element *e, const char *tag, const char *limited, const char *range);

/* `pos`, and the orientation by any of its ways. */
kt_pose kt_mjcf_pose(kt_mjcf *m, const kt_element *e, const char *tag);

/* Adds the name of an element, if it has one; reports one that is there already. */
void kt_mjcf_add_name(kt_mjcf *m, int scope, const kt_element *e, int index);

/* The index that an attribute names; -1 after reporting. */
int kt_mjcf_find(kt_mjcf *m, const kt_element *e, const char *attribute, int scope);

/* Counts elements and attributes that are not known. */
void kt_mjcf_count_strange(kt_mjcf *m);

/* The element after `last` (NULL: the first) in the sections of a name, such as <equality>; NULL: there is no more. */
const kt_element *kt_mjcf_section(const kt_mjcf *m, const char *section, const kt_element *last);

/* Calls `each` for the elements of a name directly in a body, or in frames of it, with the pose of the frame. */
typedef void kt_mjcf_each(kt_mjcf *m, const kt_element *e, int body, kt_pose frame);
void kt_mjcf_for_each(kt_mjcf *m, const kt_element *within, const char *name, int body, kt_mjcf_each *each);

/* ---- mjcf_include.c ---------------------------------------------------------------------------------------------- */

/* Puts the contents of files in place of <include>; then, once the compiler's settings are known, copies in place of
 * <replicate>. */
void kt_mjcf_expand(kt_mjcf *m);
void kt_mjcf_replicate(kt_mjcf *m);

/* ---- mjcf_mesh.c ------------------------------------------------------------------------------------------------- */

/* Reads the meshes of <asset>; what a mesh encloses, or NULL where that is not known. */
void kt_mjcf_read_meshes(kt_mjcf *m);
const kt_enclosed *kt_mjcf_find_mesh(kt_mjcf *m, const kt_element *geom);

/* Adds the mesh of a geom, whose pose in its body is given, to what the body looks like. */
void kt_mjcf_draw_mesh(kt_mjcf *m, const kt_element *geom, kt_pose pose);

/* ---- mjcf_geom.c ------------------------------------------------------------------------------------------------- */

/* Mass and inertia of a body from its <inertial> or its geoms, and its picture. */
void kt_mjcf_masses(kt_mjcf *m, int body);

/* What the compiler's settings make of all masses. */
void kt_mjcf_settle_masses(kt_mjcf *m);

/* ---- mjcf_body.c, mjcf_force.c, mjcf_loop.c ---------------------------------------------------------------------- */

void kt_mjcf_collect(kt_mjcf *m);     /* bodies, joints, sites, tendons */
void kt_mjcf_start(kt_mjcf *m);       /* the keyframe that is asked for */
void kt_mjcf_make_bodies(kt_mjcf *m); /* of the scene */
void kt_mjcf_passive(kt_mjcf *m);
void kt_mjcf_make_tendons(kt_mjcf *m);
void kt_mjcf_actuators(kt_mjcf *m);
void kt_mjcf_equalities(kt_mjcf *m);

/* A new loop, which has the name of its element, or `standard_name`. NULL: no memory. */
kt_loop *kt_mjcf_add_loop(kt_mjcf *m, const kt_element *e, kt_loop_type type, const char *standard_name);

static inline kt_mjcf_body *kt_mjcf_body_at(const kt_mjcf *m, int i) { return (kt_mjcf_body *)m->bodies.items + i; }
static inline kt_mjcf_joint *kt_mjcf_joint_at(const kt_mjcf *m, int i) { return (kt_mjcf_joint *)m->joints.items + i; }
static inline kt_mjcf_site *kt_mjcf_site_at(const kt_mjcf *m, int i) { return (kt_mjcf_site *)m->sites.items + i; }
static inline kt_mjcf_tendon *kt_mjcf_tendon_at(const kt_mjcf *m, int i) {
    return (kt_mjcf_tendon *)m->tendons.items + i;
}
static inline kt_mjcf_term *kt_mjcf_term_at(const kt_mjcf *m, int i) { return (kt_mjcf_term *)m->terms.items + i; }
static inline bool kt_mjcf_is_scalar(const kt_mjcf_joint *j) { return j->type >= KT_MJCF_SLIDE; }

#endif
