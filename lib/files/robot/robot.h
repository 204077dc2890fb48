/* Shared parts of the readers of robots: notes of omissions, names, growing lists, faults in included files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_ROBOT_H
#define KT_ROBOT_ROBOT_H

#include "base/decimal.h"
#include "document/xml.h"
#include "kinetree/import.h"
#include "scene/scene_part.h"
#include "scene/shapes.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* ---- what is left out, or changed -------------------------------------------------------------------------------- */

/* The number of occurrences, and the first of them. */
typedef struct kt_left {
    const char *what;
    const kt_element *first;
    int count;
} kt_left;

void kt_left_count(kt_left *left, const kt_element *e);

/* Unknown items by name; beyond the last name, "others". */
enum { KT_UNKNOWN_MOST = 24 };
typedef struct kt_unknown {
    kt_left left[KT_UNKNOWN_MOST];
    int count;
} kt_unknown;

void kt_unknown_count(kt_unknown *unknown, const char *what, const kt_element *e);

/* Elements of a format that have the same attributes, all between blanks. */
typedef struct kt_known {
    const char *names, *attributes;
} kt_known;

typedef struct kt_known_list {
    const kt_known *known;
    size_t count;
    const char *apart;  /* elements that are counted as a whole, though the format has them */
    const char *closed; /* elements in which nothing is searched */
    const char *read;   /* elements of which nothing is to be counted */
    const char
        *harmless;      /* elements and attributes of the format that do not concern the motion: looks, measurements */
    const char *moving; /* elements and attributes that do concern the motion */
} kt_known_list;

/* Elements by which Drake extends URDF and SDF, and which change the motion. */
#define KT_MOVING_OF_DRAKE                                                                                             \
    "drake:joint drake:mimic drake:linear_bushing_rpy drake:linear_spring_damper drake:ball_constraint "               \
    "drake:distance_constraint drake:tendon_constraint drake:weld_constraint "

/* Drake's numbers of compliance, of which contacts have MuJoCo's. */
#define KT_COMPLIANCE_OF_DRAKE                                                                                         \
    "drake:hydroelastic_modulus drake:rigid_hydroelastic drake:compliant_hydroelastic drake:mesh_resolution_hint "     \
    "drake:hunt_crossley_dissipation drake:relaxation_time drake:point_contact_stiffness drake:soft_hydroelastic "

/* Names that are left out. Harmless and moving ones are of the format; only the moving ones change the motion. Unknown
 * ones are not of the format, such as misspelt ones. */
typedef struct kt_strange {
    kt_unknown harmless, moving, unknown;
} kt_strange;

/* Whether two texts that may be missing are equal. */
static inline bool kt_text_is(const char *a, const char *b) { return a != NULL && b != NULL && strcmp(a, b) == 0; }

/* Whether a word is one of those between blanks. */
bool kt_words_have(const char *words, const char *word);

/* Counts elements and attributes of an element, and in it, that are left out. */
void kt_strange_search(kt_strange *strange, const kt_known_list *list, const kt_element *e);

/* The notes of a scene that is being made. */
enum { KT_NOTES_MOST = 96 };
typedef struct kt_notes {
    kt_reader *r;
    const char *path;
    kt_scene_note *notes;
    int count;
} kt_notes;

/* Begins the notes; false if there is no memory. */
bool kt_notes_begin(kt_notes *notes, kt_reader *r, const char *path);

/* Adds a note at the first place where something was counted, if anything was. */
void kt_note_put(kt_notes *notes, kt_note_rank rank, const kt_left *left, const char *format, ...) KT_PRINTF(4, 5);

/* The note of what a struct counts in a kt_left at an offset. The number follows a text that ends with ':', and then
 * the first of them, if it is recorded. */
typedef struct kt_note {
    size_t left;
    const char *text;
    kt_note_rank rank;
} kt_note;
#define KT_NOTE(type, member, rank, text)                                                                              \
    { offsetof(type, member), text, KT_NOTE_RANK_##rank }

void kt_notes_put(kt_notes *notes, const void *object, const kt_note *list, size_t count);
#define KT_NOTES_PUT(notes, object, list) kt_notes_put(notes, object, list, sizeof(list) / sizeof *(list))

/* Adds the name of a body whose mass is not all there to those of the first five, and counts it. */
void kt_note_massless(kt_phrase *names, kt_left *left, const char *body, const kt_element *e);

/* Notes of all formats: changed names of joints, each item that changes the motion, and names that are left out. */
#define KT_NOTE_SMOOTH_FRICTION                                                                                        \
    "dry friction that is smooth here (joint_friction), so that a joint at rest creeps, at up to about 0.001 rad/s "   \
    "or "                                                                                                              \
    "m/s:"
void kt_note_each(kt_notes *notes, const kt_unknown *items, const char *before, const char *behind);
/* Adds the last ones, of names that are left out, and gives all to the scene. */
void kt_notes_end(kt_notes *notes, const kt_strange *strange, kt_scene *scene);

/* The warning of shapes that touch nothing, while a robot moves freely. */
void kt_note_falling(kt_notes *notes, const kt_left *shapes, kt_vec3 gravity);

/* ---- faults ------------------------------------------------------------------------------------------------------ */

/* Reports a fault at an element: "joint 'elbow': limit: " and the format. Returns false. */
bool kt_robot_fault(kt_reader *r, const kt_element *e, const char *format, ...) KT_PRINTF(3, 4);

/* ---- names of bodies --------------------------------------------------------------------------------------------- */

/* Names that scenes can have, each once. '_' replaces characters that are not allowed, and a number is added to a name
 * that is taken. */
typedef struct kt_namer {
    kt_reader *r;
    kt_names names;
    int *namesakes; /* for each name: how many have a number added to it; the first is the world's */
    int count, room;
} kt_namer;

/* For up to `most` names; `world` is taken. False if there is no memory. */
bool kt_namer_init(kt_namer *namer, kt_reader *r, int most);

/* The name in the scene for `wanted`, in r->keep; "" if there is no memory. */
const char *kt_namer_make(kt_namer *namer, const char *wanted);

/* The name of an element; `standard` if it has none. */
static inline const char *kt_element_name(const kt_element *e, const char *standard) {
    const char *name = kt_xml_attribute(e, "name");
    return name != NULL && *name != '\0' ? name : standard;
}

/* The attribute `value`, or else the text, as in Gazebo. NULL: the element has neither. */
static inline const char *kt_element_value(const kt_element *e) {
    const char *value = kt_xml_attribute(e, "value");
    return value != NULL ? value : e->text;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* Takes a text of this format from a pool. NULL, after reporting to the reader, if there is no memory. */
const char *kt_robot_print(kt_reader *r, kt_pool *pool, const char *format, ...) KT_PRINTF(3, 4);

/* Makes a table for `count` names; false if there is no memory. */
bool kt_robot_names(kt_reader *r, kt_names *names, size_t count);

/* ---- lists ------------------------------------------------------------------------------------------------------- */

/* An array that grows, in a pool. Items move when it grows. */
typedef struct kt_list {
    void *items;
    int count;
    size_t room;
} kt_list;

/* A new item of zeros at the end; NULL, after reporting to the reader, if there is no memory. */
void *kt_list_add(kt_reader *r, kt_pool *pool, kt_list *list, size_t size);

/* ---- elements that a reader makes -------------------------------------------------------------------------------- */

/* The list of known attributes for an element without attributes. */
extern const char *const kt_no_attributes[1];

/* A new element at the place of another one, without children; NULL: no memory. */
kt_element *kt_element_at(kt_reader *r, const kt_element *place, const char *name, const char *const *attributes);

/* Gives an element a copy of its attributes, whose values can be changed; NULL: no memory. */
const char **kt_element_own(kt_reader *r, kt_element *e);

/* Adds an element at the end of another's. */
void kt_element_hang(kt_element *parent, kt_element *e);

/* ---- numbers, places --------------------------------------------------------------------------------------------- */

/* Parses at most `most` decimal numbers, separated by blanks. Returns the count. Returns -1 if the text has anything
 * else, a number that is not finite, or more numbers. */
int kt_parse_numbers(const char *text, int most, double *values);

/* Parses numbers as kt_parse_numbers does, but each may be infinite: "inf", "-inf" or "infinity", in either case. */
int kt_parse_bounds(const char *text, int most, double *values);

/* A rotation for a description: none if it is the identity. */
kt_rotation kt_rotation_of_matrix(kt_mat3 matrix);

/* The matrix of a rotation; the identity of one that is faulty, which the check of the description reports. */
kt_mat3 kt_mat3_of_rotation(const kt_rotation *rotation);

/* The least rotation that takes z to a unit vector. */
kt_mat3 kt_mat3_z_to(kt_vec3 axis);

/* The frame of a joint in the body that carries it. */
kt_pose kt_frame_of_joint(const kt_joint *joint);

/* The centre of mass and the inertia of a body, also where they are those of its shapes. */
void kt_properties_of(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia);

/* The moments of an inertia about three axes. */
void kt_moments_about(kt_sym3 inertia, kt_mat3 axes, double moments[3]);

/* Marks the places of the scene's items in the file, for faults of its compilation. `bodies` and `loops` are their
 * elements. */
bool kt_marks_make(kt_reader *r, const char *path, kt_scene *scene, const kt_element *const *bodies,
                   const kt_element *const *loops);

/* ---- draft.c: the scene that is being made ----------------------------------------------------------------------- */

typedef struct kt_draft {
    kt_reader *r;
    const kt_element *root;                                /* root element of the file */
    kt_list bodies, loops, effects, states;                /* kt_body ..., in r->keep */
    kt_list body_elements, loop_elements, effect_elements; /* const kt_element *: the element of each */
    kt_list joint_names;  /* for each body: const char *, the name of the joint in the file; NULL: none */
    kt_list link_names;   /* for each body: name of the link whose mass the body has; NULL: no link's */
    kt_list links;        /* for each body: const kt_element *, the element around the <inertial> */
    kt_names body_names;  /* with kt_draft_find_parents */
    const int *parents;   /* parents of bodies; -1: the world; NULL: not found yet */
    bool has_link_places; /* faults of masses are at elements in the links */
    kt_namer loop_names;
    kt_list renamed;    /* kt_renamed: joints */
    kt_list soft_stops; /* int: effects whose stiffness follows from the inertia of their joints */
} kt_draft;

/* New items, with defaults; of a loop with a name of its own that is like `name`. NULL: no memory. */
kt_body *kt_draft_body(kt_draft *d, const kt_element *e, const kt_element *link);
kt_loop *kt_draft_loop(kt_draft *d, const kt_element *e, kt_loop_type type, const char *name);
kt_effect *kt_draft_effect(kt_draft *d, const kt_element *e, kt_effect_type type);
kt_effect *kt_draft_joint_effect(kt_draft *d, const kt_element *e, kt_effect_type type, const char *joint);

/* A coupling of `count` joints, whose terms are zeros. */
kt_loop *kt_draft_coupling(kt_draft *d, const kt_element *e, const char *name, int count, kt_term **terms);

/* The name in the file of the joint of a body. */
static inline const char **kt_draft_joint_name(const kt_draft *d, int body) {
    return (const char **)d->joint_names.items + body;
}

static inline const char **kt_draft_link_name(const kt_draft *d, int body) {
    return (const char **)d->link_names.items + body;
}

/* Finds the bodies that carry the bodies, by their names; false if there is no memory. */
bool kt_draft_find_parents(kt_draft *d);

static inline kt_body *kt_draft_body_at(const kt_draft *d, int i) { return (kt_body *)d->bodies.items + i; }

/* Gives joints the names of the file, if those are not the bodies'; names of joints differ. Names that had to be
 * changed are in `renamed`. joints: a namer for twice as many names as there are bodies. */
void kt_draft_name_joints(kt_draft *d, kt_namer *joints);

/* A joint whose name in the file is not that in the scene. */
typedef struct kt_renamed {
    const kt_element *element;
    const char *before, *now;
} kt_renamed;

/* A note of each joint that has another name, and of how many there are beyond a page of them. */
void kt_note_renamed_joints(kt_notes *notes, const kt_draft *d);

/* Makes a joint free, which starts at a pose in the world. */
void kt_joint_set_free(kt_joint *joint, kt_pose pose);

/* The end at a pose in a body. */
kt_end kt_end_at(const char *body, kt_pose pose);

/* Adds a spring of a joint, if its stiffness is not zero. */
void kt_draft_spring(kt_draft *d, const kt_element *e, const char *joint, double stiffness, double rest);

/* Adds damping and dry friction of a joint, if they are not zero. */
void kt_draft_resistance(kt_draft *d, const kt_element *e, const char *joint, double damping, double friction);

/* Adds a force against a share of the weight of a body. Returns whether there is such a force. */
bool kt_draft_lift(kt_draft *d, const kt_element *e, const kt_body *body, kt_vec3 gravity, double share);

/* Whether limits of position act: by a stiffness, or as shapes touch. */
static inline bool kt_robot_has_stops(const kt_robot_options *o) { return o->stop_stiffness != 0.0 || o->contacts; }

/* Adds a stop at the limits of a joint, if limits act. Without a stiffness it is as soft as MuJoCo's by default
 * (kt_contact_settle). */
void kt_draft_stop(kt_draft *d, const kt_element *e, const kt_robot_options *o, const char *joint, double lower,
                   double upper);

/* Terms of one joint become one; returns how many are left. */
int kt_terms_merge(kt_term *terms, int count);

/* Whether faults have been reported, or memory is insufficient. */
bool kt_draft_is_wrong(const kt_draft *d);

/* ---- robot_inertia.c: inertias that no body has ------------------------------------------------------------------ */

typedef struct kt_inertia_findings {
    kt_draft *d;
    const kt_robot_options *options;
    kt_inertia_limit limit;                    /* the result, for the description */
    kt_left odd_inertias, odd_links, nothings; /* accepted: of rigid parts, of links alone; rounding of zero */
    double worst_excess;                       /* largest excess among `odd_inertias` */
} kt_inertia_findings;

/* Checks the inertias of the rigid parts of a draft, according to the options. */
void kt_inertias_check(kt_inertia_findings *findings, kt_draft *d, const kt_robot_options *options);
void kt_inertia_notes(kt_notes *notes, const kt_inertia_findings *findings);

/* ---- robot_mass.c: masses that the file does not give ------------------------------------------------------------ */

/* Gives a body mass, com and inertia of its shapes, as solids of a density; false if they have no volume. */
bool kt_mass_by_shapes(kt_body *body, double density);

/* Gives links the masses that the options name. */
void kt_masses_give(kt_draft *d, const kt_robot_options *options);

/* ---- solid_mass.c: what uniform solids weigh --------------------------------------------------------------------- */

typedef enum kt_solid {
    KT_SOLID_NONE,
    KT_SOLID_SPHERE,
    KT_SOLID_CAPSULE,
    KT_SOLID_ELLIPSOID,
    KT_SOLID_CYLINDER,
    KT_SOLID_CONE, /* a cone whose point is on the side of z */
    KT_SOLID_BOX
} kt_solid;

/* Volume, and principal moments of a mass of 1 about the centre of mass; `size` is half sizes, or radius and half
 * length along z. */
double kt_solid_volume(kt_solid solid, const double size[3]);
kt_vec3 kt_solid_moments(kt_solid solid, const double size[3]);

/* Area, and principal moments of a mass of 1 on the surface. Zero for solids without such a rule,
 * which are all but spheres, capsules, cylinders, ellipsoids and boxes. */
double kt_shell_area(kt_solid solid, const double size[3]);
kt_vec3 kt_shell_moments(kt_solid solid, const double size[3]);

/* ---- the formats ------------------------------------------------------------------------------------------------- */

typedef struct kt_robot_source {
    const kt_robot_options *options; /* never NULL */
    const char *path;                /* the source's name in messages */
    const char *folder;              /* the folder of other files; NULL: there are none */
    const kt_element *root;
    kt_xml_late late;
} kt_robot_source;

/* ---- robot_mass.c, with solids and files ------------------------------------------------------------------------- */

/* Add a solid of a density to the mass, com and inertia of a body. False: it has no volume, or the mesh cannot be read,
 * or is not closed. */
bool kt_mass_add_solid(kt_body *body, kt_solid solid, const double size[3], kt_pose pose, double density);
bool kt_mass_add_mesh(kt_reader *r, const kt_robot_source *source, kt_body *body, const char *name, kt_pose pose,
                      kt_vec3 scale, double density);

/* MuJoCo's `balanceinertia`: an inertia that no body has becomes that of a sphere with the same trace. And
 * `boundinertia`: moments about the principal axes below the least become the least. False: nothing changes. */
bool kt_inertia_balance(kt_sym3 *inertia);
bool kt_inertia_raise(kt_sym3 *inertia, kt_mat3 axes, double least);

/* ---- search.c, appearance.c: pictures of robots ------------------------------------------------------------------ */

/* The path of a mesh's file, package:// and model:// among them; NULL: there is none. */
const char *kt_mesh_path(kt_reader *r, const kt_robot_source *source, const char *name);

/* A body whose picture is that of its collisions. */
typedef struct kt_seen_collision {
    const char *body;
    const kt_element *element;
} kt_seen_collision;

typedef struct kt_appearance {
    kt_reader *r;
    const kt_robot_source *source;
    const char *body;                 /* the one that is being read */
    kt_list shapes;                   /* kt_shape: of that body */
    bool is_seen;                     /* the body has a shape or a mesh */
    kt_list meshes;                   /* kt_scene_mesh: of all bodies */
    kt_list collisions;               /* kt_seen_collision, in the order of the bodies */
    kt_left sizeless, missing, large; /* left out; `missing.what`: the first file */
    kt_left ellipsoids, cones;        /* drawn as something near */
} kt_appearance;

/* Begins the picture of a body, adds to it, and gives it to the body. Items without a size or a file are counted, and
 * the function returns false. With `of_collisions`, the shapes are those of collisions, for lack of visuals. */
void kt_appearance_begin(kt_appearance *appearance, const char *body);
/* size: half sizes, or radius and half length along z. rotation: that of the pose, as the file gives it, or NULL. A
 * capsule is drawn as a cylinder. */
bool kt_appearance_add_solid(kt_appearance *appearance, const kt_element *e, kt_solid solid, const double size[3],
                             kt_pose pose, const kt_rotation *rotation);
bool kt_appearance_add_mesh(kt_appearance *appearance, const kt_element *e, const char *name, kt_pose pose,
                            kt_vec3 scale);
void kt_appearance_end(kt_appearance *appearance, bool of_collisions, const kt_element *e, kt_body *body);

/* Gives the scene the meshes, and takes collision shapes away that are far larger than the robot. */
void kt_appearance_finish(kt_appearance *appearance, const kt_draft *d, kt_scene *scene);
void kt_appearance_notes(kt_notes *notes, const kt_appearance *appearance);

/* The method of robots with contacts. */
#define KT_ROBOT_STIFF_METHOD "radau5"

/* Makes the scene of a draft and the pictures, checks it and marks its items; returns false after reporting. `name` may
 * be NULL. */
bool kt_draft_finish(kt_draft *d, kt_appearance *appearance, const char *name, kt_scene *scene);

/* ---- include.c --------------------------------------------------------------------------------------------------- */

/* The path of a file or folder that an element names, relative to the robot's folder. The file must be in that folder,
 * or in one of options->search or options->allow. NULL after reporting the reason. */
const char *kt_include_path(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name);

/* A name in the folder of the file that has the element, as a path relative to the robot's folder. If that file is
 * elsewhere, the path is absolute. NULL: no memory. */
const char *kt_include_relative(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name);

/* The path of a file or folder NAME/REST in the folders of options->search; NULL: it is in none of them. */
const char *kt_search_path(kt_reader *r, const kt_robot_source *source, const char *name);
bool kt_include_exists(const char *path, bool folder); /* as a file, or a folder */

/* Whether there is a file or folder of a path that is seen from the robot's folder, or absolute. */
bool kt_include_is_there(kt_reader *r, const kt_robot_source *source, const char *name);

/* Whether a file is one of those that have an element, up to the file `outermost` (NULL: the robot's own), or these are
 * `most` files. */
bool kt_include_is_circular(const kt_element *e, const char *outermost, const char *path, int most);

/* The most files that a robot includes, directly or through others. A file that is included again counts again. */
enum { KT_INCLUDED_MOST = 4096 };

/* The root element of a file that an element includes; NULL after reporting why not. `bytes` sums the sizes of files,
 * whose sum is limited. */
kt_element *kt_include_read(kt_reader *r, const kt_element *e, const char *path, size_t *bytes);

/* ---- readers ----------------------------------------------------------------------------------------------------- */

/* Reads the robot below the root element into the scene. */
void kt_urdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene);
void kt_mjcf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene);
void kt_sdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene);
bool kt_sdf_is_root(const kt_element *root); /* whether an element is the root of a file in SDF */

#endif
