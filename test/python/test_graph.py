"""Scenes of bodies and joints as a graph, and frequency responses."""
# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np

import kinetree as kt

BODIES = [kt.Body("crank", mass=1, shape=kt.rod([0.3, 0, 0]), markers={"a": [0, 0, 0], "b": [0.3, 0, 0]}),
          kt.Body("rod", mass=2, inertia=[0.1, 0.1, 0.1], com=[0.6, 0.3, 0], markers={"b": [0.3, 0, 0], "c": [1, 0.6, 0]}),
          kt.Body("rocker", mass=2, inertia=[0.1, 0.1, 0.1], com=[1, 0.3, 0], markers={"c": [1, 0.6, 0], "d": [1, 0, 0]})]
JOINTS = [{"name": "A", "type": "revolute", "between": ["world", "crank.a"], "velocity": 2},
          {"name": "B", "type": "revolute", "between": ["crank.b", "rod.b"]},
          {"name": "C", "type": "revolute", "between": ["rod.c", "rocker.c"]},
          {"name": "D", "type": "revolute", "between": [{"body": "world", "at": [1, 0, 0]}, "rocker.d"]}]


def test_a_graph_moves_as_the_tree_and_loops_that_it_is_written_as(held, tmp_path):
    scene = kt.mechanism(BODIES, joints=JOINTS, gravity=[0, -9.81, 0], initial={"hold": ["A"]}, simulate={"duration": 0.5, "integrator": "dop853", "tolerance": 1e-11},
                         output={"interval": 0.05, "record": ["position"]})
    run = scene.run()
    assert list(scene.model.loops) == ["C"]
    assert [name for name in run if name.startswith("position.")] == ["position.A", "position.B", "position.D", "position.C"]
    angles = run["position.A"] + run["position.B"] + run["position.C"] - run["position.D"]
    held(np.abs(angles).max(), 1e-9, "rad, the sum of the angles around the loop")


def test_the_response_of_an_oscillator_is_its_closed_form(held):
    scene = kt.mechanism([kt.Body("block", kt.prismatic("x"), mass=2)], effects=[kt.effect.joint_spring(joint="block", stiffness=50, damping=1.2)])
    found = json.loads(scene.command("response", json=True, input="block", points=50).stdout)
    w = 2 * np.pi * np.array(found["frequency"])
    output = found["outputs"][0]
    exact = 1 / (50 - 2 * w ** 2 + 1.2j * w)
    response = np.array(output["amplitude"]) * np.exp(1j * np.array(output["phase"]))
    held(np.abs(response / exact - 1).max(), 1e-12, "of the response")
