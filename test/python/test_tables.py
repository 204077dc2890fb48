"""Lookup tables of formulas in the package: values, derivatives, runs, batches, files and errors."""
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import kinetree as kt

SPEEDS, GAS = np.array([0.0, 3, 10]), np.array([0.0, 1])
TORQUES = np.array([[0.0, 12], [-3, 18], [-6, 9]])
GRID = [[float(x), float(y), float(TORQUES[i, j])] for i, x in enumerate(SPEEDS) for j, y in enumerate(GAS)]
ANGLES, LIFTS = np.linspace(-4, 4, 17), np.linspace(-4, 4, 17) ** 2 / 16
TEXT = f"""kinetree: 1
tables:
  torque: {{rows: {GRID}, outside: hold}}
  brake: {{rows: [[-20, 8], [0, 0], [5, -1], [20, -9]]}}
  lift: {{rows: {np.column_stack((ANGLES, LIFTS)).tolist()}, interpolation: cubic, outside: extend}}
gravity: [0, 0, -9.81]
bodies:
  - {{name: crank, joint: {{type: revolute, axis: x, position: 0.2, velocity: 2}}, inertia: [0.2, 0.2, 0.2], mass: 2}}
  - {{name: valve, joint: {{type: prismatic, axis: z}}, mass: 0.3}}
loops:
  - {{name: cam, type: coupling, coefficients: {{valve: 1}}, formula: "-lift(position.crank)"}}
effects:
  - {{type: expression, joint: crank, force: "torque(velocity.crank, 0.25)"}}
  - {{type: expression, joint: crank, force: "brake(velocity.crank)"}}
initial: {{hold: [crank]}}
simulate: {{duration: 0.5, integrator: dop853, tolerance: 1e-11}}
"""


def bilinear(x, y):
    x, y = np.clip(x, SPEEDS[0], SPEEDS[-1]), np.clip(y, 0, 1)
    return (1 - y) * np.interp(x, SPEEDS, TORQUES[:, 0]) + y * np.interp(x, SPEEDS, TORQUES[:, 1])


def closed(model):
    q, v = model.initial
    return model.data(), *model.data().assemble(q, v)


def test_forces_are_those_of_linear_interpolation():
    model = kt.Scene(TEXT).model
    data = model.data()
    worst = 0.0
    for speed in np.linspace(-15, 15, 61):
        force = data.effect_forces([0.3, 0.1], [speed, 0.0])
        wanted = bilinear(speed, 0.25) + np.interp(speed, [-20, 0, 5, 20], [8, 0, -1, -9])
        worst = max(worst, abs(force[0] - wanted) / (1 + abs(wanted)))
    print(f"force: {worst:g}, bound 1e-14")
    assert worst <= 1e-14


def test_derivatives_are_those_of_differences():
    model = kt.Scene(TEXT).model
    data, q, v = closed(model)
    dq, dv, _ = (np.array(x) for x in data.forward_derivatives(q, v))
    h, worst = 1e-4, 0.0
    for i in range(model.nv):
        e = np.zeros(model.nv)
        e[i] = h
        for found, up, down in ((dq, (q + e, v), (q - e, v)), (dv, (q, v + e), (q, v - e))):
            difference = (np.array(data.forward_dynamics(*up)) - np.array(data.forward_dynamics(*down))) / (2 * h)
            worst = max(worst, np.abs(found[:, i] - difference).max() / (1 + np.abs(found).max()))
    print(f"derivatives: {worst:g}, bound 1e-8")
    assert worst <= 1e-8


def test_a_simulation_has_the_end_of_the_run():
    scene = kt.Scene(TEXT)
    run, simulation = scene.run(), scene.simulation()
    simulation.advance(0.5)
    ends = np.array([run["position.crank"][-1], run["position.valve"][-1]])
    worst = np.abs(np.array(simulation.state[:2]) - ends).max()
    print(f"end: {worst:g}, bound 1e-9")
    assert worst <= 1e-9


def test_a_table_in_a_file_is_that_of_its_rows(tmp_path):
    (tmp_path / "brake.csv").write_text("speed [rad/s],torque [N m]\n-20,8\n0,0\n5,-1\n20,-9\n")
    (tmp_path / "scene.yaml").write_text(TEXT.replace("{rows: [[-20, 8], [0, 0], [5, -1], [20, -9]]}", "brake.csv"))
    one, two = (s.model.data() for s in (kt.Scene(TEXT), kt.load(tmp_path / "scene.yaml")))
    for speed in np.linspace(-15, 15, 31):
        assert one.effect_forces([0.3, 0.1], [speed, 0.0]).tolist() == two.effect_forces([0.3, 0.1], [speed, 0.0]).tolist()


def test_an_input_outside_the_rows_is_an_error():
    data = kt.Scene(TEXT).model.data()
    with pytest.raises(kt.Error) as raised:
        data.effect_forces([0.3, 0.1], [25.0, 0.0])
    print(raised.value)
    assert "the input 25 of a table is behind its last row, at 20" in str(raised.value)
