"""What a simulation of this package does as the command does it: the integrator of the scene, its present state, and no silence."""
import numpy as np

import kinetree as kt

STIFF = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.5}, mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333]}
effects:
  - {name: d, type: joint_damper, joint: arm, damping: 94}
simulate: {duration: 1, integrator: radau5, step: 1.0e-2}
"""


def test_a_step_keeps_the_integrator_of_the_scene(held):
    scene = kt.Scene(STIFF)
    stepped, plain = scene.simulation(step=1e-2), scene.simulation()
    for each in (stepped, plain):
        each.advance(1.0)
    assert stepped.integrator == plain.integrator == "radau5"
    assert np.array_equal(stepped.state, plain.state)
    run = scene.run(step=1e-2)
    assert run.summary["method"]["integrator"] == "radau5"
    held(abs(stepped.positions[0] - run["position.arm"][-1]), 0.0, "simulation(step) against run(step), rad")
    nameless = kt.Scene(STIFF.replace("integrator: radau5, ", "")).simulation(step=1e-3)
    assert nameless.integrator == "rk4" and scene.simulation(step=1e-3, integrator="rk4").integrator == "rk4"
