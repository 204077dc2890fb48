/* The direction in which `kinetree draw` looks, and the words for it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/draw.h"

#include "command.h"
#include "text/list.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double degree = 3.14159265358979323846 / 180.0;

static int reject_view(const char *view) {
    return kt_misuse("draw: --view takes x, y, z, iso or AZIMUTH,ELEVATION in degrees, such as 35,25, not '%s'", view);
}

static kt_view_words name_angles(double azimuth, double elevation) {
    kt_view_words words;
    snprintf(words.text, sizeof words.text, "from %.4g\u00b0 to the %s and %.4g\u00b0 %s", fabs(azimuth),
             azimuth < 0.0 ? "left" : "right", fabs(elevation), elevation < 0.0 ? "below" : "above");
    return words;
}

/* Returns a camera that faces along a coordinate axis, from its positive side. Along y, it faces from the front, unless
 * y is up. */
static kt_camera face_axis(const kt_picture *picture, char axis) {
    const kt_vec3 vertical = kt_picture_vertical(picture);
    const kt_vec3 towards = kt_vec3_make(axis == 'x' ? 1.0 : 0.0,
                                         axis != 'y'        ? 0.0
                                         : vertical.y > 0.5 ? 1.0
                                                            : -1.0,
                                         axis == 'z' ? 1.0 : 0.0);
    return kt_camera_facing(towards, vertical);
}

int kt_draw_direction_choose(const char *view, const kt_picture *picture, const kt_pose *poses, kt_camera *camera,
                             kt_view_words *words) {
    const kt_vec3 vertical = kt_picture_vertical(picture);
    double angles[2] = {45.0, atan(sqrt(0.5)) / degree}; /* azimuth, elevation */
    const kt_chosen_view chosen = kt_camera_choose(picture, poses);
    *camera = chosen.camera;
    *words = name_angles(chosen.azimuth / degree, chosen.elevation / degree);
    if (chosen.is_plane)
        snprintf(words->text, sizeof words->text, "in its plane");
    if (view == NULL)
        return -1;
    if (strlen(view) == 1 && strchr("xyz", view[0]) != NULL) {
        *camera = face_axis(picture, view[0]);
        snprintf(words->text, sizeof words->text, "along %s", view);
        return -1;
    }
    const bool is_iso = strcmp(view, "iso") == 0;
    if (!is_iso && (kt_numbers_read(view, angles, 2) != 2 || fabs(angles[1]) > 90.0))
        return reject_view(view);
    *camera = kt_camera_around(vertical, degree * angles[0], degree * angles[1]);
    *words = name_angles(angles[0], angles[1]);
    if (is_iso)
        snprintf(words->text, sizeof words->text, "isometric");
    return -1;
}
