/* Two legs as scenes. The knee of the first is bent through a four-bar linkage: thigh, crank and rod on it, shank. The
 * second is between hard stops, and its springs press it against them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_REALTIME_LEG_H
#define KT_BENCH_REALTIME_LEG_H

#define KT_LEG                                                                                                         \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  - name: thigh\n"                                                                                                \
    "    joint: {type: revolute, axis: z, position: 0.5}\n"                                                            \
    "    mass: 3\n"                                                                                                    \
    "    shape: {type: rod, to: [0, -0.4, 0]}\n"                                                                       \
    "  - name: crank\n"                                                                                                \
    "    parent: thigh\n"                                                                                              \
    "    joint: {type: revolute, axis: z}\n"                                                                           \
    "    mass: 0.3\n"                                                                                                  \
    "    shape: {type: rod, to: [-0.07, 0, 0]}\n"                                                                      \
    "  - name: rod\n"                                                                                                  \
    "    parent: crank\n"                                                                                              \
    "    joint: {type: revolute, axis: z, at: [-0.07, 0, 0], position: 0.05}\n"                                        \
    "    mass: 0.3\n"                                                                                                  \
    "    shape: {type: rod, to: [0, -0.4, 0]}\n"                                                                       \
    "  - name: shank\n"                                                                                                \
    "    parent: thigh\n"                                                                                              \
    "    joint: {type: revolute, axis: z, at: [0, -0.4, 0], position: -0.9}\n"                                         \
    "    mass: 1.5\n"                                                                                                  \
    "    shape: {type: rod, to: [0, -0.4, 0]}\n"                                                                       \
    "loops:\n"                                                                                                         \
    "  - {name: pin, type: revolute, between: [{body: rod, at: [0, -0.4, 0]},"                                         \
    " {body: shank, at: [-0.031, -0.039, 0]}]}\n"

static const char kt_leg[] = KT_LEG;
static const char kt_leg_stops[] = KT_LEG "effects:\n"
                                          "  - {type: joint_limit, joint: thigh, lower: 0.4999, restitution: 0.5}\n"
                                          "  - {type: joint_limit, joint: shank, upper: -0.8999, restitution: 0}\n"
                                          "  - {type: joint_friction, joint: thigh, coulomb: 0.5, stick: true}\n";

#endif
