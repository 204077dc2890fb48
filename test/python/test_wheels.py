"""Wheels and ropes: derivatives against differences, batches against single states, the plane against space, and generated C."""
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import kinetree as kt

WHEEL = "shape: {type: cylinder, radius: 0.05, length: 0.02}"
SCENES = {
    "planetary": f"""
bodies:
  - {{name: sun, joint: {{type: revolute, axis: z, velocity: 3}}, mass: 1, {WHEEL}}}
  - {{name: carrier, joint: {{type: revolute, axis: z}}, mass: 0.5, shape: {{type: rod, to: [0.05, 0, 0]}}}}
  - {{name: planet, parent: carrier, joint: {{type: revolute, axis: z, at: [0.05, 0, 0]}}, mass: 0.7, {WHEEL}}}
loops:
  - {{name: inner, type: gear, between: [sun, planet], teeth: 30, teeth2: 20}}
initial: {{hold: [sun]}}
""",
    "tensioner": f"""
bodies:
  - {{name: motor, joint: {{type: revolute, axis: z, velocity: 3}}, mass: 1, {WHEEL}}}
  - {{name: arm, joint: {{type: revolute, axis: z, at: [0.5, -0.3, 0], position: 10 deg}}, mass: 1, shape: {{type: rod, to: [0, 0.3, 0]}}}}
  - {{name: idler, parent: arm, joint: {{type: revolute, axis: z, at: [0, 0.3, 0]}}, mass: 0.4, {WHEEL}}}
  - {{name: block, joint: {{type: prismatic, axis: y, at: [-0.3, -0.5, 0]}}, mass: 2, {WHEEL}}}
loops:
  - {{name: upper, type: span, between: [motor, idler], radius: 0.06, radius2: 0.09}}
  - {{name: lower, type: span, between: [motor, block], radius: 0.04}}
initial: {{hold: [motor]}}
""",
    "belt": f"""
bodies:
  - {{name: base, joint: {{type: revolute, axis: z, velocity: 1}}, mass: 3, {WHEEL}}}
  - {{name: a, parent: base, joint: {{type: revolute, axis: z, at: [0.1, 0, 0], velocity: 3}}, mass: 1, {WHEEL}}}
  - {{name: slide, parent: base, joint: {{type: prismatic, axis: x, at: [0.6, 0.1, 0]}}, mass: 1, {WHEEL}}}
  - {{name: b, parent: slide, joint: {{type: revolute, axis: z}}, mass: 1, {WHEEL}}}
loops:
  - {{name: belt, type: belt, between: [a, b], radius: 0.06, radius2: 0.09, crossed: true}}
initial: {{hold: [base, a]}}
""",
    "rack": f"""
bodies:
  - {{name: base, joint: {{type: universal, axis: x, axis2: y, velocity: [1, 2]}}, mass: 3, shape: {{type: box, size: [0.1, 0.2, 0.3]}}}}
  - {{name: pinion, parent: base, joint: {{type: revolute, axis: z, at: [0.1, 0, 0], velocity: 3}}, mass: 1, {WHEEL}}}
  - {{name: bar, parent: base, joint: {{type: prismatic, axis: x, at: [0.3, 0.05, 0]}}, mass: 2, {WHEEL}}}
loops:
  - {{name: mesh, type: rack, between: [pinion, bar], axis2: x, radius: 0.05}}
initial: {{hold: [base, pinion]}}
""",
    "worm": f"""
bodies:
  - {{name: base, joint: {{type: universal, axis: x, axis2: y, velocity: [1, 2]}}, mass: 3, shape: {{type: box, size: [0.1, 0.2, 0.3]}}}}
  - {{name: worm, parent: base, joint: {{type: revolute, axis: x, velocity: 30}}, mass: 1, {WHEEL}}}
  - {{name: wheel, parent: base, joint: {{type: revolute, axis: y, at: [0, 0, 0.1]}}, mass: 2, {WHEEL}}}
loops:
  - {{name: mesh, type: worm, between: [worm, wheel], axis: x, axis2: y, radius: 0.02, teeth: 2, teeth2: 40}}
initial: {{hold: [base, worm]}}
""",
    "differential": f"""
bodies:
  - {{name: base, joint: {{type: spherical}}, mass: 3, shape: {{type: box, size: [0.1, 0.2, 0.3]}}}}
  - {{name: cage, parent: base, joint: {{type: revolute, axis: x, velocity: 2}}, mass: 4, {WHEEL}}}
  - {{name: left, parent: base, joint: {{type: revolute, axis: x, at: [-0.03, 0, 0], velocity: 5}}, mass: 2, {WHEEL}}}
  - {{name: right, parent: base, joint: {{type: revolute, axis: x, at: [0.03, 0, 0]}}, mass: 2, {WHEEL}}}
  - {{name: pinion, parent: cage, joint: {{type: revolute, axis: z, at: [0, 0, 0.04]}}, mass: 0.5, {WHEEL}}}
loops:
  - {{name: one, type: gear, between: [left, pinion], axis: x, axis2: z, teeth: 16, teeth2: 12}}
  - {{name: two, type: gear, between: [right, pinion], axis: x, axis2: z, teeth: 16, teeth2: 12}}
initial: {{hold: [base, cage, left]}}
""",
    "pulleys in space": f"""
bodies:
  - {{name: base, joint: {{type: spherical}}, mass: 3, shape: {{type: box, size: [0.1, 0.2, 0.3]}}}}
  - {{name: drum, parent: base, joint: {{type: revolute, axis: y, velocity: 3}}, mass: 4, {WHEEL}}}
  - {{name: arm, parent: base, joint: {{type: revolute, axis: y, at: [0.5, 0, 0]}}, mass: 1, shape: {{type: rod, to: [0.3, 0, 0]}}}}
  - {{name: pulley, parent: arm, joint: {{type: revolute, axis: y, at: [0.3, 0, 0.1]}}, mass: 1, {WHEEL}}}
loops:
  - {{name: rope, type: span, between: [drum, pulley], axis: y, radius: 0.07, radius2: -0.04}}
initial: {{hold: [base, drum]}}
""",
}


def text_of(name, plan="auto"):
    return f"kinetree: 1\ngravity: [1, -9.81, 2]\n{SCENES[name].lstrip()}simulate: {{duration: 1, plan: {plan}}}\n"


def moving(model):
    """A closed state some steps after the start."""
    data = model.data()
    q, v = model.initial
    q, v = data.assemble(q, v)
    for i in range(20):
        q, v = data.step(2e-3, q, v, t=2e-3 * i)
    return data, q, v


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_of_wheels_are_those_of_differences(name, held):
    model = kt.Scene(text_of(name)).model
    data, q, v = moving(model)
    rng = np.random.default_rng(1)
    tau = rng.normal(size=model.nv)
    dq, dv, dtau = (np.array(x) for x in data.forward_derivatives(q, v, tau))
    A = np.array(data.step_derivatives(1e-3, q, v, tau)[0])
    h = 1e-5
    scale = 1 + max(np.abs(dq).max(), np.abs(dv).max(), np.abs(dtau).max())
    for i in range(model.nv):
        e = np.zeros(model.nv)
        e[i] = h
        for found, up, down in ((dv, (q, v + e, tau), (q, v - e, tau)), (dq, (model.add(q, e), v, tau), (model.add(q, -e), v, tau))):
            column = (np.array(data.forward_dynamics(*up)) - np.array(data.forward_dynamics(*down))) / (2 * h)
            held(np.abs(column - found[:, i]).max() / scale, 3e-9, f"{name}, acceleration by {i}")
        up, down = data.step(1e-3, model.add(q, e), v, tau), data.step(1e-3, model.add(q, -e), v, tau)
        column = np.concatenate([model.subtract(up[0], down[0]), up[1] - down[1]]) / (2 * h)
        held(np.abs(column - A[:, i]).max() / (1 + np.abs(A).max()), 2e-9, f"{name}, step by {i}")


@pytest.mark.parametrize("name", SCENES)
def test_lanes_and_space_agree_with_single_states_of_wheels(name, held):
    model, space = kt.Scene(text_of(name)).model, kt.Scene(text_of(name, "spatial")).model
    data, q, v = moving(model)
    states = []
    for _ in range(11):
        q, v = data.step(2e-3, q, v)
        states.append((q, v, data.forward_dynamics(q, v)))
    other = space.data()
    for m in (model, space):
        batch = m.batch(len(states))
        found = np.array(batch.forward_dynamics(np.array([s[0] for s in states]), np.array([s[1] for s in states])))
        for k, (_, _, a) in enumerate(states):
            held(np.abs(found[k] - a).max() / (1 + np.abs(a).max()), 1e-11, f"{name}, state {k}")
    for q, v, a in states:
        held(np.abs(np.array(other.forward_dynamics(q, v)) - a).max() / (1 + np.abs(a).max()), 1e-11, f"{name} in space")
