/* Small motions at an amplitude that can be seen.
 *
 * A point of a body moves by Re(exp(i phi) (a + i b)), an ellipse. Its squared distance from the position at rest is
 *
 *     |a cos phi - b sin phi|^2 = (|a|^2 + |b|^2) / 2 + (|a|^2 - |b|^2) / 2 cos 2 phi - a.b sin 2 phi,
 *
 * which is largest at tan 2 phi = -2 a.b / (|a|^2 - |b|^2). The point is a corner of the box around a solid.
 *
 * A shape belongs to the linear equations. Therefore each point is drawn displaced along a straight line, by its
 * first-order displacement. Finite turns of the joints would shorten a bent beam, and would open loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/deflection.h"
#include "open/play.h"

#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const double kt_deflection_share = 0.12;

static const double turn_most = 0.4; /* rad; a body then grows by at most 8 % to first order */

static kt_status fail_deflection_memory(kt_error *error) {
    error->code = KT_ERROR_MEMORY;
    return KT_ERROR_MEMORY;
}

/* Computes the part of the shape at a phase, as velocities of all joints. */
static void take_part(const kt_small_motion *motion, int mode, double amplitude, double phase, double *v) {
    const double *shape = kt_modes_positions(motion->modes, mode);
    for (int i = 0; i < kt_model_nv(motion->model); i++)
        v[i] = amplitude * (cos(phase) * shape[2 * i] - sin(phase) * shape[2 * i + 1]);
}

kt_status kt_deflection_twists(const kt_small_motion *motion, int mode, kt_twist *real, kt_twist *imaginary,
                               kt_error *error) {
    const double quarter = -1.5707963267948966;
    double *v = calloc((size_t)kt_model_nv(motion->model) + 1, sizeof *v);
    kt_status status = v != NULL ? KT_OK : fail_deflection_memory(error);
    for (int part = 0; part < 2 && status == KT_OK; part++) {
        take_part(motion, mode, 1.0, part * quarter, v);
        status = kt_kinematics_update(motion->model, motion->data, motion->q, v, NULL, error);
        for (int body = 0; body < kt_model_body_count(motion->model) && status == KT_OK; body++)
            (part == 0 ? real : imaginary)[body] = kt_body_twist(motion->model, motion->data, body);
    }
    free(v);
    return status;
}

static kt_vec3 twist_velocity_at(const kt_twist *twist, kt_vec3 arm) {
    return kt_vec3_add(twist->linear, kt_vec3_cross(twist->angular, arm));
}

/* Returns the length of the longest semi-axis of the ellipse of a + i b. *phase: the phase at its end, rad. */
static double longest_half(kt_vec3 a, kt_vec3 b, double *phase) {
    const double aa = kt_vec3_dot(a, a), bb = kt_vec3_dot(b, b), ab = kt_vec3_dot(a, b);
    *phase = 0.5 * atan2(-2.0 * ab, aa - bb);
    return sqrt(0.5 * (aa + bb) + hypot(0.5 * (aa - bb), ab));
}

/* Returns a corner of a solid's box, relative to the origin of the solid's body, in the world's axes. */
static kt_vec3 box_corner_of(const kt_solid *solid, kt_pose body, int corner) {
    const kt_vec3 h = solid->half;
    const kt_vec3 at = kt_vec3_make(corner & 1 ? h.x : -h.x, corner & 2 ? h.y : -h.y, corner & 4 ? h.z : -h.z);
    return kt_mat3_apply(body.rotation, kt_pose_apply(solid->pose, at));
}

static void find_farthest(const kt_small_motion *motion, const kt_picture *picture, const kt_twist *real,
                          const kt_twist *imaginary, kt_deflection *deflection, double *turned) {
    double phase;
    *turned = 0.0;
    for (int i = 0; i < picture->solid_count; i++) {
        const int body = picture->solids[i].body;
        const kt_pose pose = kt_body_pose(motion->model, motion->data, body);
        *turned = fmax(*turned, longest_half(real[body].angular, imaginary[body].angular, &phase));
        for (int corner = 0; corner < 8; corner++) {
            const kt_vec3 arm = box_corner_of(&picture->solids[i], pose, corner);
            const double moved =
                longest_half(twist_velocity_at(&real[body], arm), twist_velocity_at(&imaginary[body], arm), &phase);
            if (moved > deflection->moved * (1.0 + 1e-9)) {
                deflection->moved = moved;
                deflection->phase = phase;
            }
        }
    }
}

kt_status kt_deflection_choose(const kt_small_motion *motion, int mode, const kt_picture *picture,
                               kt_deflection *deflection, kt_error *error) {
    const size_t bodies = (size_t)kt_model_body_count(motion->model);
    kt_twist *twists = calloc(2 * bodies, sizeof *twists);
    kt_deflection found = {.amplitude = 0.0};
    double turned = 0.0;
    kt_status status = twists != NULL ? KT_OK : fail_deflection_memory(error);
    if (status == KT_OK)
        status = kt_deflection_twists(motion, mode, twists, twists + bodies, error);
    if (status == KT_OK)
        find_farthest(motion, picture, twists, twists + bodies, &found, &turned);
    free(twists);
    if (status != KT_OK)
        return status;
    if (found.moved > 0.0)
        found.amplitude = fmin(kt_deflection_share * picture->size / found.moved, turn_most / turned);
    found.moved *= found.amplitude;
    *deflection = found;
    return KT_OK;
}

static kt_vec3 part_at_phase(const kt_deflection *d, kt_vec3 real, kt_vec3 imaginary) {
    return kt_vec3_sub(kt_vec3_scale(d->amplitude * cos(d->phase), real),
                       kt_vec3_scale(d->amplitude * sin(d->phase), imaginary));
}

static kt_vec3 displaced_axis(kt_vec3 axis, kt_vec3 turn) { return kt_vec3_add(axis, kt_vec3_cross(turn, axis)); }

kt_status kt_deflection_poses(const kt_small_motion *motion, int mode, const kt_deflection *deflection, kt_pose *poses,
                              kt_error *error) {
    const size_t bodies = (size_t)kt_model_body_count(motion->model);
    kt_status status = kt_poses_take(motion->model, motion->data, motion->q, poses, error);
    if (deflection == NULL || status != KT_OK)
        return status;
    kt_twist *twists = calloc(2 * bodies, sizeof *twists);
    status = twists != NULL ? kt_deflection_twists(motion, mode, twists, twists + bodies, error)
                            : fail_deflection_memory(error);
    for (size_t i = 0; i < bodies && status == KT_OK; i++) {
        const kt_vec3 turn = part_at_phase(deflection, twists[i].angular, twists[bodies + i].angular);
        kt_mat3 *r = &poses[i].rotation;
        poses[i].position =
            kt_vec3_add(poses[i].position, part_at_phase(deflection, twists[i].linear, twists[bodies + i].linear));
        *r = (kt_mat3){displaced_axis(r->x, turn), displaced_axis(r->y, turn), displaced_axis(r->z, turn)};
    }
    free(twists);
    return status;
}
