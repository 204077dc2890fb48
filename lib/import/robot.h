/* What the readers of robots share: notes of what is left out, names, growing lists, faults in included files. */
#ifndef KT_IMPORT_ROBOT_H
#define KT_IMPORT_ROBOT_H

#include "kinetree/import.h"

#include "import/xml.h"
#include "scene/part.h"

/* ---- what is left out, or changed -------------------------------------------------------------------------------- */

/* How often, and where first. */
typedef struct kt_left {
    const char *what;
    const kt_element *first;
    int count;
} kt_left;

void kt_left_count(kt_left *left, const kt_element *e);

/* What is not known, by its name; beyond the last name, "others". */
enum { KT_UNKNOWN_MOST = 24 };
typedef struct kt_unknown {
    kt_left left[KT_UNKNOWN_MOST];
    int count;
} kt_unknown;

void kt_unknown_count(kt_unknown *unknown, const char *what, const kt_element *e);

/* Adds the names with their numbers: "camera (2), light (1)". */
void kt_unknown_list(const kt_unknown *unknown, kt_phrase *phrase);

/* The notes of a scene that is being made. */
enum { KT_NOTES_MOST = 48 };
typedef struct kt_notes {
    kt_reader *r;
    const char *path;
    kt_scene_note *notes;
    int count;
} kt_notes;

/* Begins the notes; false where there is no memory. */
bool kt_notes_begin(kt_notes *notes, kt_reader *r, const char *path);

/* Adds a note at the first place where something was counted, if it was. */
void kt_note_put(kt_notes *notes, const kt_left *left, const char *format, ...) KT_PRINTF(3, 4);

/* ---- names of bodies --------------------------------------------------------------------------------------------- */

/* Names that scenes can have, each once: '_' in place of what is not allowed, and a number where a name is taken. */
typedef struct kt_namer {
    kt_reader *r;
    kt_names names;
    int *namesakes; /* of each name: how many have a number added to it; the first is the world's */
    int count, room;
} kt_namer;

/* For up to `most` names; `world` is taken. False where there is no memory. */
bool kt_namer_init(kt_namer *namer, kt_reader *r, int most);

/* The name that stands for `wanted`, in r->keep; "" where there is no memory. */
const char *kt_namer_make(kt_namer *namer, const char *wanted);

/* ---- lists ------------------------------------------------------------------------------------------------------- */

/* An array that grows, in a pool; what has been added moves. */
typedef struct kt_list {
    void *items;
    int count, room;
} kt_list;

/* A new item of zeros at the end; NULL where there is no memory, which the reader is told. */
void *kt_list_add(kt_reader *r, kt_pool *pool, kt_list *list, size_t size);

/* ---- numbers, places --------------------------------------------------------------------------------------------- */

/* Numbers in decimal, apart by blanks: at most `most`. Returns how many; -1 where something else stands there, a number
 * is not finite, or there are more. */
int kt_parse_numbers(const char *text, int most, double *values);

/* A rotation for a description: none where it is the identity. */
kt_rotation kt_rotation_of_matrix(kt_mat3 matrix);

/* s S. */
static inline kt_sym3 kt_sym3_scaled(double s, kt_sym3 a) {
    return kt_sym3_make(s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.xz, s * a.yz);
}

/* Where the items of the scene stand, for faults of its compilation. `elements` are those of bodies and loops. */
bool kt_marks_make(kt_reader *r, const char *path, kt_scene *scene, const kt_element *const *bodies,
                   const kt_element *const *loops);

/* ---- the formats ------------------------------------------------------------------------------------------------- */

typedef struct kt_robot_source {
    const kt_robot_options *options; /* never NULL */
    const char *path;                /* its name in messages */
    const char *folder;              /* where other files are looked for; NULL: there are none */
    const kt_element *root;
    kt_xml_late late;
} kt_robot_source;

/* Reads the robot below the root element into the scene. */
void kt_urdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene);
void kt_mjcf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene);

#endif
