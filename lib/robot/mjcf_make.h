/* Makes the elements of MJCF that a shorter element stands for, such as the bodies of a flexcomp. This happens before
 * default classes are found. */
#ifndef KT_ROBOT_MJCF_MAKE_H
#define KT_ROBOT_MJCF_MAKE_H

#include "robot/mjcf.h"

/* A new element below another, for an element of the file, with attributes before those of `like` (NULL: none). The
 * first of a name counts. NULL after reporting, or if a value is missing, which has been reported. */
kt_element *kt_mjcf_add_element(kt_mjcf *m, kt_element *parent, const kt_element *from, const char *name,
                                const char *const *attributes, const kt_element *like);

/* The text of up to eight numbers; NULL: no memory. */
const char *kt_mjcf_write_numbers(kt_mjcf *m, int count, const double *values);

/* ---- mjcf_mesh.c ------------------------------------------------------------------------------------------------- */

/* The file that an element names, without the folder where the compiler strips paths; NULL: it names none. */
const char *kt_mjcf_file_of_mesh(const kt_mjcf *m, const kt_element *e);

/* The name of a mesh or a field of heights. Without one it has that of its file, without folder and ending. */
const char *kt_mjcf_asset_name(kt_mjcf *m, const kt_element *e);

/* The path of a file of a mesh; NULL after setting the error. */
const char *kt_mjcf_whole_path(kt_mjcf *m, const kt_element *e, const char *file, kt_error *error);
kt_status kt_mjcf_read_surface(kt_mjcf *m, const kt_element *e, const char *file, kt_triangles *mesh, kt_error *error);

#define KT_MJCF_TOO_LARGE "a vertex is beyond the range of single-precision numbers"

/* Counts an element whose file cannot be read, with the reason of the first. */
void kt_mjcf_count_unread(kt_mjcf *m, kt_left *left, const kt_element *e, const kt_error *error);

/* ---- mjcf_flex.c ------------------------------------------------------------------------------------------------- */

/* The points or nodes of a <flexcomp> as bodies below `chain`, and its edges as tendons or equalities of the document.
 * A flexcomp that is left out is counted. */
void kt_mjcf_make_flex(kt_mjcf *m, const kt_element *e, kt_element *chain);

/* Whether a body may be a point of a flexcomp that is left out, by its name. */
bool kt_mjcf_is_lost_point(const kt_mjcf *m, const char *body);

#endif
