/* Views: of a plane, around the vertical. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/camera.h"

#include <math.h>

static const double degree = 3.14159265358979323846 / 180.0;

/* The coordinate axis nearest to a direction, with its sign. */
static kt_vec3 nearest_axis(kt_vec3 d) {
    const double x = fabs(d.x), y = fabs(d.y), z = fabs(d.z);
    if (z >= x && z >= y)
        return kt_vec3_make(0.0, 0.0, d.z < 0.0 ? -1.0 : 1.0);
    if (y >= x)
        return kt_vec3_make(0.0, d.y < 0.0 ? -1.0 : 1.0, 0.0);
    return kt_vec3_make(d.x < 0.0 ? -1.0 : 1.0, 0.0, 0.0);
}

kt_vec3 kt_picture_vertical(const kt_picture *picture) {
    if (kt_vec3_dot(picture->gravity, picture->gravity) > 0.0)
        return nearest_axis(kt_vec3_scale(-1.0, picture->gravity));
    if (picture->is_planar && fabs(picture->normal.z) > 0.9)
        return kt_vec3_make(0.0, 1.0, 0.0);
    return kt_vec3_make(0.0, 0.0, 1.0);
}

kt_camera kt_camera_facing(kt_vec3 towards, kt_vec3 vertical) {
    const kt_vec3 z = kt_vec3_normalize(towards);
    kt_vec3 right = kt_vec3_cross(vertical, z);
    if (kt_vec3_norm(right) < 1e-6 * kt_vec3_norm(vertical))
        right = kt_vec3_cross(fabs(z.y) > 0.9 ? kt_vec3_make(0.0, 0.0, -1.0) : kt_vec3_make(0.0, 1.0, 0.0), z);
    kt_camera camera;
    camera.axes.x = kt_vec3_normalize(right);
    camera.axes.z = z;
    camera.axes.y = kt_vec3_cross(z, camera.axes.x);
    return camera;
}

kt_camera kt_camera_around(kt_vec3 vertical, double azimuth, double elevation) {
    const kt_vec3 up = kt_vec3_normalize(vertical);
    const kt_vec3 front = fabs(up.z) > 0.9 ? kt_vec3_make(0.0, -1.0, 0.0) : kt_vec3_make(0.0, 0.0, 1.0);
    const kt_vec3 right = kt_vec3_cross(up, front);
    const kt_vec3 level = kt_vec3_add(kt_vec3_scale(cos(azimuth), front), kt_vec3_scale(sin(azimuth), right));
    const kt_vec3 towards = kt_vec3_add(kt_vec3_scale(cos(elevation), level), kt_vec3_scale(sin(elevation), up));
    kt_camera camera = kt_camera_facing(towards, up);
    if (fabs(cos(elevation)) < 1e-9) { /* from above: the level direction to the right stays so */
        camera.axes.x = kt_vec3_normalize(kt_vec3_cross(up, level));
        camera.axes.y = kt_vec3_cross(camera.axes.z, camera.axes.x);
    }
    return camera;
}

/* The sum of squares of the lengths of rods, and of the distances of solids from the joints of their bodies, in the
 * picture. */
static double extent(const kt_picture *picture, const kt_pose *poses, const kt_camera *camera) {
    double sum = 0.0;
    for (int i = 0; i < picture->solid_count; i++) {
        const kt_solid *solid = &picture->solids[i];
        const kt_pose pose = kt_camera_pose(camera, kt_pose_compose(poses[solid->body], solid->pose));
        const kt_vec3 z = pose.rotation.z,
                      arm = kt_vec3_sub(pose.position, kt_camera_point(camera, poses[solid->body].position));
        const double half = solid->type == KT_SOLID_ROD || solid->type == KT_SOLID_CYLINDER ? solid->half.z : 0.0;
        const bool is_carried = kt_body_coordinates(picture->model, solid->body).type != KT_JOINT_FREE;
        sum += half * half * (z.x * z.x + z.y * z.y);
        sum += is_carried ? arm.x * arm.x + arm.y * arm.y : 0.0;
    }
    return sum;
}

kt_chosen_view kt_camera_choose(const kt_picture *picture, const kt_pose *poses) {
    static const double azimuths[] = {35.0, -35.0, 55.0, -55.0};
    const kt_vec3 vertical = kt_picture_vertical(picture), g = picture->gravity;
    if (picture->is_planar && fabs(kt_vec3_dot(g, picture->normal)) <= 0.3 * kt_vec3_norm(g))
        return (kt_chosen_view){.camera = kt_camera_facing(picture->normal, vertical), .is_plane = true};
    kt_chosen_view best = {.elevation = 25.0 * degree};
    double most = -1.0;
    for (int i = 0; i < 4; i++) {
        const kt_camera camera = kt_camera_around(vertical, azimuths[i] * degree, best.elevation);
        const double found = extent(picture, poses, &camera);
        if (found > 1.3 * most) { /* the first one, unless another one is clearly better */
            most = found;
            best.camera = camera;
            best.azimuth = azimuths[i] * degree;
        }
    }
    return best;
}
