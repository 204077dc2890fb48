/* A leg whose knee is bent through a four-bar linkage, as a scene: thigh, crank and rod on it, shank. */
#ifndef KT_BENCH_REALTIME_LEG_H
#define KT_BENCH_REALTIME_LEG_H

static const char kt_leg[] = "kinetree: 1\n"
                             "gravity: [0, -9.81, 0]\n"
                             "bodies:\n"
                             "  - name: thigh\n"
                             "    joint: {type: revolute, axis: z, position: 0.5}\n"
                             "    mass: 3\n"
                             "    shape: {type: rod, to: [0, -0.4, 0]}\n"
                             "  - name: crank\n"
                             "    parent: thigh\n"
                             "    joint: {type: revolute, axis: z}\n"
                             "    mass: 0.3\n"
                             "    shape: {type: rod, to: [-0.07, 0, 0]}\n"
                             "  - name: rod\n"
                             "    parent: crank\n"
                             "    joint: {type: revolute, axis: z, at: [-0.07, 0, 0], position: 0.05}\n"
                             "    mass: 0.3\n"
                             "    shape: {type: rod, to: [0, -0.4, 0]}\n"
                             "  - name: shank\n"
                             "    parent: thigh\n"
                             "    joint: {type: revolute, axis: z, at: [0, -0.4, 0], position: -0.9}\n"
                             "    mass: 1.5\n"
                             "    shape: {type: rod, to: [0, -0.4, 0]}\n"
                             "loops:\n"
                             "  - {name: pin, type: revolute, between: [{body: rod, at: [0, -0.4, 0]},"
                             " {body: shank, at: [-0.031, -0.039, 0]}]}\n";

#endif
