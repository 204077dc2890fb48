/* The frames of a motion as one block of numbers; view/motion.js defines their order. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/motion.h"

#include "picture/picture_mesh.h"

#include <math.h>

static int16_t share_of(double x, double most) { return (int16_t)lround(32767.0 * (most > 0.0 ? x / most : 0.0)); }

/* Writes points as shares of half the box, and normals times half the box, scaled to length 1. The painter of instances
 * scales points by half the box and divides normals by it, which restores both. */
static void put_meshes(const kt_picture *picture, kt_frame_sink *put, void *user) {
    for (int i = 0; i < picture->solid_count; i++) {
        const kt_mesh *mesh = picture->solids[i].mesh;
        const kt_vec3 half = picture->solids[i].half;
        for (int k = 0; mesh != NULL && k < mesh->point_count; k++) {
            const kt_vec3 p = mesh->points[k], n = mesh->normals[k];
            const kt_vec3 m = kt_vec3_normalize(kt_vec3_make(n.x * half.x, n.y * half.y, n.z * half.z));
            const int16_t numbers[] = {share_of(p.x, half.x), share_of(p.y, half.y), share_of(p.z, half.z),
                                       share_of(m.x, 1.0),    share_of(m.y, 1.0),    share_of(m.z, 1.0)};
            put(user, numbers, 6, sizeof *numbers);
        }
    }
}

void kt_motion_write_frames(const kt_motion *motion, kt_frame_sink *put, void *user) {
    const size_t n = motion->count, bodies = kt_motion_bodies(motion);
    put(user, motion->times, n, sizeof *motion->times);
    put(user, motion->places, 3 * n * bodies, sizeof *motion->places);
    put(user, motion->turns, 4 * n * bodies, sizeof *motion->turns);
    put(user, motion->values, n * kt_motion_width(motion), sizeof *motion->values);
    put(user, motion->force_values, 3 * n * (size_t)motion->force_count, sizeof *motion->force_values);
    put(user, motion->lines, 6 * n * (size_t)motion->line_count, sizeof *motion->lines);
    put_meshes(motion->picture, put, user);
}
