/* A trebuchet that lets go of its ball, for tests and for bench/run hard: a scene, and its own equations. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_TREBUCHET_H
#define KT_TEST_SCENE_TREBUCHET_H

/* A beam on a hinge at the origin, with a box that hangs on its short arm. At its long arm, a ball hangs on a sling,
 * which is a rod until it lets go. */
typedef struct kt_trebuchet {
    double ball, box, beam;            /* masses, kg; the beam's centre is the origin */
    double long_arm, short_arm, sling; /* m */
    double hangs;                      /* the box's centre below its hinge, m */
    double beam_inertia, box_inertia;  /* about their centres, kg m^2 */
    double release, ground, gravity;   /* heights at which it lets go, and where the ball lands, m; m/s^2 */
} kt_trebuchet;

extern const kt_trebuchet kt_trebuchet_data;
extern const char kt_trebuchet_scene[]; /* the third position is the ball's place along x, the fourth its height */

enum { KT_TREBUCHET_STATES = 6 }; /* angles of beam, box and sling against the horizontal, and their rates */

/* The state at the start, and its rate while the sling holds. */
void kt_trebuchet_start(double y[KT_TREBUCHET_STATES]);
void kt_trebuchet_rate(const double y[KT_TREBUCHET_STATES], double rate[KT_TREBUCHET_STATES]);

/* The position and velocity of the ball: x, y, x', y'. */
void kt_trebuchet_ball(const double y[KT_TREBUCHET_STATES], double ball[4]);

/* The x at which a ball that flies freely lands. */
double kt_trebuchet_range(const double ball[4]);

#endif
