/* The points and elements of a <flexcomp>, before they become bodies. */
#ifndef KT_ROBOT_MJCF_FLEX_H
#define KT_ROBOT_MJCF_FLEX_H

#include "robot/mjcf_make.h"

/* The slides of a point, or nodes of a box around the points that have three slides each. */
typedef enum kt_flex_motion {
    KT_FLEX_FULL,
    KT_FLEX_RADIAL, /* along the position of the point */
    KT_FLEX_PLANE,  /* along x and y of the parent */
    KT_FLEX_TRILINEAR,
    KT_FLEX_QUADRATIC
} kt_flex_motion;

/* A point of a flexcomp, or a node. */
typedef struct kt_flex_point {
    double at[3]; /* in the parent */
    bool is_pinned;
    double mass;
    const char *name; /* of its body */
} kt_flex_point;

typedef struct kt_flex {
    const kt_element *element;
    const char *name, *type;
    kt_flex_motion motion;
    int dim, counts[3];
    bool is_given; /* points of the file or of a mesh: those without an element vanish */
    kt_flex_point *points;
    int *elements; /* dim + 1 points each */
    int count, room, element_count, element_room;
    double low[3], high[3]; /* of the box around all points, those without an element too */
    double radius;
} kt_flex;

enum { KT_FLEX_POINTS_MOST = 3000 /* that are bodies */, KT_FLEX_NUMBERS_MOST = 1 << 24 };

/* The numbers of an attribute of any length; -1 after reporting. */
int kt_flex_numbers(kt_mjcf *m, const kt_element *e, const char *name, double **values);

/* Makes room for a number of points and elements. False after reporting. */
bool kt_flex_take(kt_mjcf *m, kt_flex *f, double points, double elements);
void kt_flex_add_point(kt_flex *f, double x, double y, double z);
void kt_flex_add_element(kt_flex *f, const int *points);

/* ---- mjcf_flex_point.c ------------------------------------------------------------------------------------------- */

/* "NAME_3", and "NAME_3__site" of its site. */
const char *kt_flex_name_point(kt_mjcf *m, const kt_flex *f, int i, const char *suffix);

/* ---- mjcf_flex_shape.c ------------------------------------------------------------------------------------------- */

/* Makes the points and elements of the types that are a formula. False after reporting. */
bool kt_flex_grid(kt_mjcf *m, kt_flex *f);
bool kt_flex_box(kt_mjcf *m, kt_flex *f);

/* ---- mjcf_flex_file.c -------------------------------------------------------------------------------------------- */

/* Makes the points and elements of the attributes, of a mesh or of a file of Gmsh. False after reporting. */
bool kt_flex_direct(kt_mjcf *m, kt_flex *f);
bool kt_flex_mesh(kt_mjcf *m, kt_flex *f);
bool kt_flex_gmsh(kt_mjcf *m, kt_flex *f);

/* ---- mjcf_flex_pin.c --------------------------------------------------------------------------------------------- */

/* Marks points that do not move, and removes points without an element. `pinned` has `room` flags. */
bool kt_flex_pin(kt_mjcf *m, kt_flex *f, bool *pinned, int room);

/* ---- mjcf_flex_node.c -------------------------------------------------------------------------------------------- */

/* The number of nodes; 0 of points that are bodies. */
int kt_flex_node_count(kt_mjcf *m, const kt_flex *f);

/* Replaces the points by nodes of cells of the box around them. */
bool kt_flex_nodes(kt_mjcf *m, kt_flex *f, const bool *pinned);

/* ---- mjcf_flex_elastic.c ----------------------------------------------------------------------------------------- */

/* Warns of a flexcomp that MuJoCo drops: one with pins in the world of an attached model. */
void kt_flex_note_attached_pins(kt_mjcf *m, const kt_flex *f);

/* Keeps a flexcomp with elasticity until its bodies have names, or counts that it is left out. */
void kt_flex_keep_elastic(kt_mjcf *m, const kt_flex *f);

#endif
