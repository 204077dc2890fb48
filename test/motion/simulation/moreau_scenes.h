/* Scenes with hard contacts, for time stepping. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_MOREAU_SCENES_H
#define KT_TEST_SIMULATION_MOREAU_SCENES_H

#define KT_MOREAU_HEAD "kinetree: 1\ngravity: [0, 0, -9.81]\n"

#define KT_MOREAU_FALLING                                                                                              \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: ball, joint: {type: prismatic, axis: z, position: 1}, mass: 1}\n"

/* A ball falls from 1 m onto a stop. */
#define KT_MOREAU_BALL                                                                                                 \
    KT_MOREAU_FALLING "effects:\n"                                                                                     \
                      "  - {type: joint_limit, joint: ball, lower: 0, restitution: 0.5}\n"
#define KT_MOREAU_FREE KT_MOREAU_FALLING
#define KT_MOREAU_POISSON                                                                                              \
    KT_MOREAU_FALLING "effects:\n"                                                                                     \
                      "  - {type: joint_limit, joint: ball, lower: 0, restitution: 0.5, poisson: true}\n"

/* A block of 1 kg without rotations slides on the floor. */
#define KT_MOREAU_SLIDER                                                                                               \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: rail, joint: {type: prismatic, axis: x, velocity: 2}, mass: 0}\n"                                      \
    "  - {name: block, parent: rail, joint: {type: prismatic, axis: z}, mass: 1,"                                      \
    " markers: {foot: [0, 0, 0]}}\n"                                                                                   \
    "effects:\n"                                                                                                       \
    "  - {name: floor, type: contact, point: block.foot, plane: world, friction: 0.3, restitution: 0}\n"

/* A box slides and turns on corners with different friction. It begins with angular velocities across the floor, which
 * tilt it by rounding. */
#define KT_MOREAU_CORNERS(angular)                                                                                     \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: box, joint: {type: free, position: {position: [0, 0, 0.1]}, velocity: {linear: [0.3, 0.1, 0], "        \
    "angular: [" angular ", 0.4]}}, mass: 1, inertia: [0.1, 0.12, 0.2], markers: {a: [0.2, 0.3, -0.1], "               \
    "b: [-0.2, 0.3, -0.1], c: [0.2, -0.3, -0.1], d: [-0.2, -0.3, -0.1]}}\n"                                            \
    "effects:\n"                                                                                                       \
    "  - {type: contact, point: box.a, plane: world, friction: 0.73, restitution: 0}\n"                                \
    "  - {type: contact, point: box.b, plane: world, friction: 0.66, restitution: 0}\n"                                \
    "  - {type: contact, point: box.c, plane: world, friction: 0.19, restitution: 0}\n"                                \
    "  - {type: contact, point: box.d, plane: world, friction: 0.15, restitution: 0}\n"

/* A rod swings against a stop. */
#define KT_MOREAU_PENDULUM                                                                                             \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: rod, joint: {type: revolute, axis: y, position: 1.2}, mass: 1, com: [0, 0, -0.5]}\n"    \
                   "effects:\n"                                                                                        \
                   "  - {type: joint_limit, joint: rod, lower: 0.1, restitution: 0.6}\n"

/* A four-bar that closes in a plane falls onto a stop of its crank. */
#define KT_MOREAU_FOUR_BAR                                                                                             \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: crank, joint: {type: revolute, axis: y, position: 0.4}, mass: 1, com: [0, 0, 0.5],"     \
                   " markers: {end: [0, 0, 1]}}\n"                                                                     \
                   "  - {name: rod, parent: crank, joint: {type: revolute, axis: y, at: [0, 0, 1], position: 1.2},"    \
                   " mass: 1, com: [0, 0, 1], markers: {end: [0, 0, 2]}}\n"                                            \
                   "  - {name: rocker, joint: {type: revolute, axis: y, at: [2, 0, 0], position: 0.4}, mass: 1,"       \
                   " com: [0, 0, 0.6], markers: {end: [0, 0, 1.2]}}\n"                                                 \
                   "loops:\n"                                                                                          \
                   "  - {name: pin, type: revolute, between: [rod.end, rocker.end], axis: y}\n"                        \
                   "effects:\n"                                                                                        \
                   "  - {type: joint_limit, joint: crank, upper: 1.0, restitution: 0.4}\n"

/* A rod falls onto its end, and slides. */
#define KT_MOREAU_ROD                                                                                                  \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: rod, joint: {type: planar, axis: y, position: [0, 0, 0.4]}, mass: 1,"                   \
                   " inertia: [0.1, 0.1, 0.001], markers: {a: [0, 0, 0.5], b: [0, 0, -0.5]}}\n"                        \
                   "effects:\n"                                                                                        \
                   "  - {name: a, type: contact, point: rod.a, plane: {body: world, at: [0, 0, -0.7]}, friction: 0.3," \
                   " restitution: 0}\n"                                                                                \
                   "  - {name: b, type: contact, point: rod.b, plane: {body: world, at: [0, 0, -0.7]}, friction: 0.3," \
                   " restitution: 0}\n"

/* A ball is thrown up at the end of a rope. */
#define KT_MOREAU_ROPE                                                                                                 \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: ball, joint: {type: planar, axis: y, position: [0.2, 0.3, 0]}, mass: 1, inertia: [1, 1, 1],"           \
    " markers: {middle: [0, 0, 0]}}\n"                                                                                 \
    "loops:\n"                                                                                                         \
    "  - {name: rope, type: distance, between: [world, ball.middle], length: 1, slack: true,"                          \
    " restitution: 0.3}\n"

/* A ball swings on a rope that is taut. */
#define KT_MOREAU_SWING                                                                                                \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: ball, joint: {type: planar, axis: y, position: [-0.8, 0.6, 0]}, mass: 1, inertia: [1, 1, 1],"          \
    " markers: {middle: [0, 0, 0]}}\n"                                                                                 \
    "loops:\n"                                                                                                         \
    "  - {name: rope, type: distance, between: [world, ball.middle], length: 1, slack: true, restitution: 0}\n"

/* A mass on a spring with dry friction. */
#define KT_MOREAU_DRY                                                                                                  \
    "kinetree: 1\n"                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: mass, joint: {type: prismatic, axis: x, position: 1}, mass: 1}\n"                                      \
    "effects:\n"                                                                                                       \
    "  - {type: joint_spring, joint: mass, stiffness: 40}\n"                                                           \
    "  - {type: joint_friction, joint: mass, coulomb: 3, static: 4, stribeck: 0.1, viscous: 0.5, stick: true}\n"

/* A box with four corners is thrown onto the floor. */
#define KT_MOREAU_BOX                                                                                                  \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - name: box\n"                                                                                                  \
    "    joint: {type: free, position: {position: [0, 0, 0.5], orientation: {axis: [1, 2, 0], angle: 0.4}},"           \
    " velocity: {linear: [1, 0, 0], angular: [1, 2, 3]}}\n"                                                            \
    "    mass: 2\n"                                                                                                    \
    "    shape: {type: box, size: [0.4, 0.3, 0.2]}\n"                                                                  \
    "    markers: {a: [0.2, 0.15, -0.1], b: [0.2, -0.15, -0.1], c: [-0.2, 0.15, -0.1],"                                \
    " d: [-0.2, -0.15, -0.1]}\n"                                                                                       \
    "effects:\n"                                                                                                       \
    "  - {name: a, type: contact, point: box.a, plane: world, friction: 0.4, restitution: 0.2}\n"                      \
    "  - {name: b, type: contact, point: box.b, plane: world, friction: 0.4, restitution: 0.2}\n"                      \
    "  - {name: c, type: contact, point: box.c, plane: world, friction: 0.4, restitution: 0.2}\n"                      \
    "  - {name: d, type: contact, point: box.d, plane: world, friction: 0.4, restitution: 0.2}\n"

/* A belt with a constant speed takes a block along. */
#define KT_MOREAU_BELT                                                                                                 \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: belt, joint: {type: prismatic, axis: x}, mass: 5}\n"                                                   \
    "  - {name: block, joint: {type: planar, axis: y}, mass: 2, inertia: [0.01, 0.01, 0.01],"                          \
    " markers: {c: [0, 0, 0]}}\n"                                                                                      \
    "loops:\n"                                                                                                         \
    "  - {name: drive, type: motion, joint: belt, position: \"0.5*t\"}\n"                                              \
    "effects:\n"                                                                                                       \
    "  - {name: shoe, type: contact, point: block.c, plane: belt, restitution: 0, friction: 0.4}\n"

/* A table lifts a block, which lies on it. */
#define KT_MOREAU_LIFT                                                                                                 \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: table, joint: {type: prismatic, axis: z}, mass: 5}\n"                                   \
                   "  - {name: block, parent: table, joint: {type: prismatic, axis: z}, mass: 2}\n"                    \
                   "loops:\n"                                                                                          \
                   "  - {name: drive, type: motion, joint: table, position: \"0.5*t\"}\n"                              \
                   "effects:\n"                                                                                        \
                   "  - {type: joint_limit, joint: block, lower: 0, restitution: 0}\n"

/* A winch winds up a rope, from which a load hangs. */
#define KT_MOREAU_WINCH                                                                                                \
    KT_MOREAU_HEAD                                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: load, joint: {type: prismatic, axis: z, position: -1}, mass: 2, markers: {c: [0, 0, 0]}}\n"            \
    "loops:\n"                                                                                                         \
    "  - {name: rope, type: distance, between: [world, load.c], length: \"1-0.5*t\", slack: true,"                     \
    " restitution: 0}\n"

/* A crank drives a slider against dry and viscous friction of two joints, with a closed loop. */
#define KT_MOREAU_CRANK                                                                                                \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: crank, joint: {type: revolute, axis: y, position: 0.4}, mass: 1, com: [0.2, 0, 0],"     \
                   " markers: {end: [0.4, 0, 0]}}\n"                                                                   \
                   "  - {name: rod, parent: crank, joint: {type: revolute, axis: y, at: [0.4, 0, 0], position: -0.6}," \
                   " mass: 1, com: [0.5, 0, 0], markers: {end: [1, 0, 0]}}\n"                                          \
                   "  - {name: slider, joint: {type: prismatic, axis: x, position: 1.3}, mass: 3,"                     \
                   " markers: {pin: [0, 0, 0]}}\n"                                                                     \
                   "loops:\n"                                                                                          \
                   "  - {name: pin, type: revolute, between: [rod.end, slider.pin], axis: y}\n"                        \
                   "  - {name: drive, type: motion, joint: crank, position: \"0.4+3*t\"}\n"                            \
                   "effects:\n"                                                                                        \
                   "  - {type: joint_friction, joint: slider, coulomb: 4, viscous: 2, stick: true}\n"

/* A brake holds a shaft with a constant driven speed back. */
#define KT_MOREAU_SHAFT                                                                                                \
    "kinetree: 1\n"                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: shaft, joint: {type: revolute}, mass: 5, inertia: [1, 1, 1]}\n"                                        \
    "loops:\n"                                                                                                         \
    "  - {name: drive, type: motion, joint: shaft, position: \"3*t\"}\n"                                               \
    "effects:\n"                                                                                                       \
    "  - {name: brake, type: joint_friction, joint: shaft, coulomb: 4, stick: true}\n"

/* A wheel with dry and viscous friction comes to rest. */
#define KT_MOREAU_WHEEL                                                                                                \
    "kinetree: 1\n"                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: wheel, joint: {type: revolute, velocity: 3}, mass: 2, inertia: [1, 1, 1]}\n"                           \
    "effects:\n"                                                                                                       \
    "  - {name: brake, type: joint_friction, joint: wheel, coulomb: 1, viscous: 0.5, stick: true}\n"

/* A block lies on a stop. */
#define KT_MOREAU_LYING                                                                                                \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: block, joint: {type: prismatic, axis: z}, mass: 2}\n"                                   \
                   "effects:\n"                                                                                        \
                   "  - {name: floor, type: joint_limit, joint: block, lower: 0, restitution: 0}\n"

/* The same block, whose joint points down, so that it lies on an upper stop. */
#define KT_MOREAU_LYING_ON_UPPER                                                                                       \
    KT_MOREAU_HEAD "bodies:\n"                                                                                         \
                   "  - {name: block, joint: {type: prismatic, axis: [0, 0, -1]}, mass: 2}\n"                          \
                   "effects:\n"                                                                                        \
                   "  - {name: floor, type: joint_limit, joint: block, upper: 0, restitution: 0}\n"

#endif
