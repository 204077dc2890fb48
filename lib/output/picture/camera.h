/* From the world to the picture: an orthographic projection. In the camera's frame x points right, y up, and z from the
 * picture towards the viewer. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_CAMERA_H
#define KT_PICTURE_CAMERA_H

#include "picture/picture.h"

typedef struct kt_camera {
    kt_mat3 axes; /* right, up, towards the viewer, in the world */
} kt_camera;

/* The upward direction of the world: the coordinate axis nearest to the direction against gravity. Without gravity, z;
 * but y for a planar mechanism that moves in the plane of x and y. */
kt_vec3 kt_picture_vertical(const kt_picture *picture);

/* From a viewer in the direction `towards`, with `vertical` as far up as possible. If the two are parallel, the
 * picture's up is y (or -z, seen along y). */
kt_camera kt_camera_facing(kt_vec3 towards, kt_vec3 vertical);

/* From a viewer at an azimuth about the vertical, counted from the front, anticlockwise as seen from above, and an
 * elevation above the horizon, rad. The front is where x points right: of a vertical z the direction -y, of y the
 * direction z, of x the direction z. */
kt_camera kt_camera_around(kt_vec3 vertical, double azimuth, double elevation);

/* A view that shows a mechanism in these poses well. */
typedef struct kt_chosen_view {
    kt_camera camera;
    bool is_plane;             /* the camera is that of a planar mechanism */
    double azimuth, elevation; /* angles of the camera otherwise, rad */
} kt_chosen_view;

/* Chooses a view. A planar mechanism is seen along its normal, unless gravity pulls out of its plane. Other mechanisms
 * are seen from an elevation of 25 degrees. The azimuth is 35 or 55 degrees, to the right or to the left. The first of
 * the four is taken, unless joints and solids are clearly further from each other in the picture at another. */
kt_chosen_view kt_camera_choose(const kt_picture *picture, const kt_pose *poses);

/* A point in the camera's frame; a pose of the world in this frame. */
static inline kt_vec3 kt_camera_point(const kt_camera *camera, kt_vec3 point) {
    return kt_mat3_apply_transposed(camera->axes, point);
}
static inline kt_pose kt_camera_pose(const kt_camera *camera, kt_pose pose) {
    const kt_pose view = {.rotation = kt_mat3_transpose(camera->axes)};
    return kt_pose_compose(view, pose);
}

#endif
