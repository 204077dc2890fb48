/* Small motions at an amplitude that can be seen: the positions in which a mode is drawn. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_DEFLECTION_H
#define KT_COMMAND_SCENE_DEFLECTION_H

#include "open/linear.h"
#include "picture/picture.h"

/* A mode moves the mechanism by Re(amplitude exp(i phase) dq), dq being its shape (kt_modes_positions). */
typedef struct kt_deflection {
    double amplitude; /* 0: nothing that is shown moves */
    double phase;     /* rad; at this phase, the point that moves most is farthest from its position at rest */
    double moved;     /* m; the distance of this point from its position at rest, to first order */
} kt_deflection;

/* The displacement of the point that moves most, as a share of the picture's size. The displacement is smaller if a
 * body would turn by too much. */
extern const double kt_deflection_share;

/* Chooses amplitude and phase of a mode. The picture is that of the state of the linearisation. The motion's data are
 * overwritten. */
kt_status kt_deflection_choose(const kt_small_motion *motion, int mode, const kt_picture *picture,
                               kt_deflection *deflection, kt_error *error);

/* Computes the poses of all bodies in the deflected positions, to first order in the amplitude: all points move along
 * straight lines, joints stay together, and loops stay closed. A turned body grows in second order of its angle, so its
 * pose is no rotation. deflection: NULL for the position at rest. The motion's data are overwritten. */
kt_status kt_deflection_poses(const kt_small_motion *motion, int mode, const kt_deflection *deflection, kt_pose *poses,
                              kt_error *error);

/* Computes the twists of all bodies (index 0: the world) to first order, with a real and an imaginary part for each. */
kt_status kt_deflection_twists(const kt_small_motion *motion, int mode, kt_twist *real, kt_twist *imaginary,
                               kt_error *error);

#endif
