/* A coin that spins to its end, for tests and for bench/run hard. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_COIN_H
#define KT_TEST_SCENE_COIN_H

/* A thin disc of radius r rolls on its rim, inclined by alpha, with its centre at rest. Its speed and energy are
 * (Moffatt, Euler's disk and its finite-time singularity, Nature 404, 2000)
 *     Omega^2 sin(alpha) = 4 g / r,   E = 3/2 m g r sin(alpha).
 * A damper c against Omega takes c Omega^2. While the disc falls slowly, its inclination is
 *     sin(alpha)^2 = sin(alpha_0)^2 - 16 c t / (3 m r^2),
 * except for terms of the order of alpha: its centre begins to move.
 *
 * A format for alpha, c, the tolerance, and the formula of `until`. `rim` is the contact of the rim, KT_COIN_ROLLS or
 * KT_COIN_TOUCHES. */
#define KT_COIN_RADIUS 0.0375
#define KT_COIN_MASS 0.44
#define KT_COIN(rim)                                                                                                   \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "parameters: {r: 0.0375, m: 0.44, alpha: %g, c: %g, Omega: '=sqrt(4*9.81/(r*sin(alpha)))'}\n"                      \
    "bodies:\n"                                                                                                        \
    "  - {name: carriage, joint: {type: planar, axis: z, velocity: [0, 0, =Omega]}, mass: 0}\n"                        \
    "  - {name: post, parent: carriage, joint: {type: prismatic, axis: z, position: =r*sin(alpha)}, mass: 0}\n"        \
    "  - {name: tilt, parent: post, joint: {type: revolute, axis: x, position: =alpha}, mass: 0}\n"                    \
    "  - {name: coin, parent: tilt, joint: {type: revolute, axis: z, velocity: =-Omega*cos(alpha)}, mass: =m,\n"       \
    "     inertia: [=m*r^2/4, =m*r^2/4, =m*r^2/2], markers: {centre: [0, 0, 0]}}\n"                                    \
    "effects:\n"                                                                                                       \
    "  - {type: joint_damper, joint: 'carriage[2]', damping: =c}\n" rim                                                \
    "simulate: {duration: 2, tolerance: %g, until: %s}\n"
#define KT_COIN_ROLLS                                                                                                  \
    "loops:\n"                                                                                                         \
    "  - {name: rim, type: rolling, wheel: coin.centre, radius: =r, on: world}\n"
#define KT_COIN_TOUCHES                                                                                                \
    "  - {name: rim, type: contact, point: coin, radius: =r, axle: z, plane: world, restitution: 0, friction: 1}\n"

/* Its positions; velocities likewise, but for the turn of the carriage. */
enum { KT_COIN_HEIGHT = 3, KT_COIN_TILT, KT_COIN_TURN = 2 };

#endif
