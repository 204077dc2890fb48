/* Meshes of <asset> in MJCF, and solids that are fitted to them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_MJCF_MESH_H
#define KT_ROBOT_MJCF_MESH_H

#include "robot/mjcf.h"

/* The solid that a mesh encloses, at density 1, in the axes of its file. */
typedef struct kt_mjcf_mesh {
    const kt_element *element;
    bool is_known;
    kt_vec3 points[KT_CONTACT_POINTS_MOST]; /* points that touch planes, if the options ask for contacts */
    int point_count;
    kt_enclosed enclosed;
    kt_mat3 axes;     /* principal axes of the inertia, in MuJoCo's order */
    double box[2][3]; /* least and largest coordinates about the centre of mass, in these axes */
} kt_mjcf_mesh;

/* The mesh of a geom, which is read if it was not; NULL if it encloses nothing, or cannot be read. */
const kt_mjcf_mesh *kt_mjcf_find_mesh(kt_mjcf *m, const kt_element *geom);

/* The vertices of a geom's mesh that touch planes, in the frame of the geom; none if it cannot be read. */
const kt_vec3 *kt_mjcf_mesh_points(kt_mjcf *m, const kt_element *geom, int *count);

/* Adds the mesh of a geom, whose pose in its body is given, to the picture of the body. */
void kt_mjcf_draw_mesh(kt_mjcf *m, const kt_element *geom, kt_pose pose);

/* The name of a mesh or a field of heights. Without one it has that of its file, without folder and ending. */
const char *kt_mjcf_asset_name(kt_mjcf *m, const kt_element *e);

/* ---- mjcf_fit.c -------------------------------------------------------------------------------------------------- */

/* Sets the size of a solid that a geom fits to its mesh, and its pose in the frame of the mesh. False if the mesh is
 * unknown, or after reporting. */
bool kt_mjcf_fit(kt_mjcf *m, const kt_element *geom, kt_solid solid, double size[3], kt_pose *pose);

#endif
