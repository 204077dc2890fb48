"""Runs, sweeps, simulations and callbacks."""
# SPDX-License-Identifier: Apache-2.0
import os
import subprocess
import time

import numpy as np
import pytest

import kinetree as kt

BALL = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 2}, mass: 1, shape: {type: sphere, radius: 0.1}}
simulate: {duration: 1}
"""


@pytest.mark.filterwarnings("ignore::kinetree.KinetreeWarning")
def test_records_of_every_bundled_scene_are_those_of_the_command(scenes, tmp_path):
    """The bytes of `run`, and the bits of a simulation in this process."""
    names = sorted(scenes.glob("*.yaml"))
    for path in names:
        scene, out = kt.load(path), tmp_path / "command.csv"
        run = scene.run(duration=0.1, record="position,velocity")
        subprocess.run([kt.command.path(), "run", path, "--duration", "0.1", "--record", "position,velocity", "--quiet", "--out", out], check=True)
        assert out.read_text() == run.csv, path.name
        cells = [repr(float(cell)) for cell in out.read_text().splitlines()[-1].split(",")]
        assert cells == [repr(float(run[each][-1])) for each in run.names], path.name
        records = scene.simulation(duration=0.1).run()
        for letter, kind in (("q", "position.*"), ("v", "velocity.*")):
            columns = list(run.matching(kind).values())
            assert len(columns) == records[letter].shape[1] and np.array_equal(run.time, records["time"]), path.name
            assert np.array_equal(np.column_stack(columns), records[letter]) if columns else True, path.name
    print(f"       {len(names)} scenes")
    assert len(names) > 70


def test_warnings_of_a_run_are_sentences_with_a_remedy():
    """The words of the command: what is wrong, and the remedy."""
    with pytest.warns(kt.KinetreeWarning) as caught:
        kt.Scene(BALL.replace("gravity: [0, 0, -9.81]", "gravity: [0, -9.81, 0]")).run()
    assert [str(each.message) for each in caught] == [
        "nothing has moved: the scene starts at rest, and gravity does not accelerate it. "
        "Compare gravity with the axes of the joints, or give the scene another start"]


def test_a_simulation_in_this_process_has_the_bits_of_the_command(scenes):
    for name in ["double-pendulum", "four-bar"]:
        scene = kt.load(scenes / f"{name}.yaml")
        run = scene.run(duration=0.5, integrator="rk4", step=1e-3)
        records = scene.simulation(step=1e-3, duration=0.5, integrator="rk4").run()
        columns = np.column_stack(list(run.matching("position.*").values()))
        assert len(run) == len(records["time"]) and (columns == records["q"]).all() and (run.time == records["time"]).all()


def test_a_sweep_has_a_line_for_each_combination(tmp_path):
    scene = kt.Scene(BALL.replace("position: 2", "position: =z0").replace("simulate:", "parameters: {z0: 2}\nsimulate:"))
    file = tmp_path / "sweep.csv"
    table = scene.sweep(z0=np.linspace(1, 3, 5), jobs=2, out=file)
    fall = table["z0"] - table["position.ball.end"]
    assert len(table) == 5 and np.abs(fall - 0.5 * 9.81).max() < 1e-8
    assert table.to_records()["z0"][0] == 1.0
    lines = file.read_text().splitlines(keepends=True)
    (tmp_path / "half.csv").write_text("".join(lines[:3]))
    whole = scene.sweep(z0=np.linspace(1, 3, 5), out=tmp_path / "half.csv", resume=True)
    assert (whole["position.ball.end"] == table["position.ball.end"]).all() and (tmp_path / "half.csv").read_text() == file.read_text()
    again = scene.sweep(z0=np.linspace(1, 3, 5), out=tmp_path / "again.csv", jobs=1)
    assert (again["position.ball.end"] == table["position.ball.end"]).all()


def test_a_run_that_fails_has_its_own_records(tmp_path):
    """The file of an earlier run stays, and its records are not those of the failed run."""
    scene = kt.Scene("kinetree: 1\nparameters: {pole: 3}\nbodies: [{name: a, joint: {type: prismatic, axis: x}, mass: 1}]\n"
                     "effects: [{type: expression, joint: a, force: 1/(pole - t)}]\nsimulate: {duration: 2}\noutput: {interval: 0.1}\n")
    keep = {"out": tmp_path / "run.csv", "summary": tmp_path / "run.json"}
    for fresh in (True, False):
        with pytest.raises(kt.StepError) as failed:
            scene.run(set={"pole": 1}, **keep)
        run = failed.value.run
        assert run.time[-1] < 1.0 and run.summary["time"] < 1.0 and len(run) == 10
        if fresh:
            assert scene.run(**keep).time[-1] == 2.0
    with pytest.raises(kt.ArgumentError) as failed:
        scene.run(integrator="rk5", **keep)
    assert failed.value.run is None
    with pytest.raises(kt.ArgumentError, match="name a file"):
        scene.run(out="-")
    assert len(scene.run(out="/dev/null")) == 0
    with pytest.raises(kt.ArgumentError, match="records in HDF5 are not read back"):
        scene.run(out=tmp_path / "run.H5")
    assert not (tmp_path / "run.H5").exists()
    with pytest.raises(kt.ArgumentError, match="omit `summary`"):
        scene.run(summary="-")
    with pytest.raises(kt.ArgumentError, match="omit `out`"):
        scene.sweep(pole=[1, 2], out="-")


def test_texts_of_a_dict_are_kept_beyond_the_basic_plane():
    content = {"kinetree": 1, "name": "\U0001f600 rod \u65e5", "bodies": [{"name": "a", "joint": {"type": "revolute", "velocity": 1}, "mass": 1, "inertia": [1, 1, 1]}]}
    assert kt.Scene(content).name == content["name"]
    assert kt.Scene(content).run(duration=0.1).summary["scene"] == content["name"]
    columns = {"x": {"value": "position.a", "unit": "\U0001f4d0"}}
    assert "x [\U0001f4d0]" in kt.Scene(content).run(duration=0.1, set={"output": {"columns": columns}}).names


def test_an_event_of_python_is_located(held):
    scene = kt.Scene(BALL)
    simulation = scene.simulation(duration=1.0, tolerance=1e-10)
    seen = []
    simulation.on("low", lambda at: at.q[0] - 1.0, lambda s: seen.append(s.time), direction="falling", stop=True)
    simulation.run()
    held(abs(seen[0] - np.sqrt(2 / 9.81)), 1e-12, "time of the event, s")
    assert simulation.stopped == "low" and simulation.event_count("low") == 1
    with pytest.raises(kt.ArgumentError, match="no event 'lwo'; did you mean 'low'"):
        simulation.event_count("lwo")


def test_time_stepping_of_a_scene_holds_in_python(held):
    scene = kt.Scene(BALL.replace("simulate: {duration: 1}", "effects:\n  - {type: joint_limit, joint: ball, lower: 0, restitution: 0}\n"
                                  "simulate: {duration: 1, contact: steps, step: 1e-3}"))
    simulation = scene.simulation()
    simulation.run()
    held(abs(simulation.positions[0]), 1e-13, "the ball lies, m")
    held(np.abs(simulation.acceleration()).max(), 1e-12, "and does not accelerate, m/s^2")
    assert simulation.integrator == "moreau-jean" and simulation.step_size == 1e-3
    assert scene.simulation(step=2e-3).integrator == "moreau-jean"
    for wrong in ({"integrator": "rk4"}, {"tolerance": 1e-6}):
        with pytest.raises(kt.ArgumentError, match="a method of its own"):
            scene.simulation(**wrong)


def test_a_step_and_a_tolerance_are_rejected_together():
    scene = kt.Scene(BALL)
    for more in ({}, {"integrator": "dopri5"}, {"integrator": "rk4"}):
        with pytest.raises(kt.ArgumentError, match="'step' is for a fixed step and 'tolerance' for an adaptive one"):
            scene.simulation(step=0.1, tolerance=1e-12, **more)
    assert scene.simulation(step=0.1).step_size == 0.1  # which overrides the tolerance of the scene


def test_an_unknown_method_is_answered_with_the_nearest_and_all():
    scene = kt.Scene(BALL)
    model = scene.model
    for call in (lambda: scene.simulation(integrator="dop835"), lambda: model.batch(2, method="dop835"),
                 lambda: model.data().step_derivatives(1e-3, method="dop835")):
        with pytest.raises(kt.ArgumentError, match=r"there is no method 'dop835'; did you mean 'dop853'\? There are .*rk4"):
            call()
    with pytest.raises(kt.ArgumentError, match="there is no method 'xyzzy'; there are .*rk4"):
        scene.simulation(integrator="xyzzy")


def test_an_exception_of_a_callback_reaches_the_caller():
    simulation = kt.Scene(BALL).simulation(duration=1.0)
    simulation.on("broken", lambda at: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        simulation.run()


def test_a_force_of_python_is_that_of_a_formula(held):
    spring = kt.JointForce("ball", lambda t, q, v: -40 * (q - 2) - 0.3 * v)
    scene = kt.Scene(BALL)
    by_python = kt.Simulation(kt.Model(scene, effects=[spring]), step=1e-3, integrator="rk4")
    formula = BALL.replace("simulate:", 'effects:\n  - {type: expression, joint: ball, force: "-40*(position.ball - 2) - 0.3*velocity.ball"}\nsimulate:')
    by_formula = kt.Scene(formula).simulation(step=1e-3, integrator="rk4")
    by_python.advance(0.5)
    by_formula.advance(0.5)
    held(np.abs(by_python.positions - by_formula.positions).max(), 1e-13, "m")

    def broken(t, q, v):
        raise KeyError("broken")

    with pytest.raises(KeyError):
        kt.Simulation(kt.Model(scene, effects=[kt.JointForce("ball", broken)]), step=1e-3).advance(0.1)


def test_a_compiled_force_is_called_by_its_address(held):
    numba = pytest.importorskip("numba", reason="numba is not on this machine")
    types = numba.types
    signature = types.int32(types.voidptr, types.double, types.double, types.double, types.CPointer(types.double), types.voidptr)

    @numba.cfunc(signature)
    def spring(user, t, q, v, force, balance):
        force[0] = -40 * (q - 2)
        return 0

    scene = kt.Scene(BALL)
    compiled = kt.Simulation(kt.Model(scene, effects=[kt.JointForce("ball", spring)]), step=1e-3, integrator="rk4")
    python = kt.Simulation(kt.Model(scene, effects=[kt.JointForce("ball", lambda t, q, v: -40 * (q - 2))]), step=1e-3, integrator="rk4")
    compiled.advance(0.2)
    python.advance(0.2)
    held(np.abs(compiled.positions - python.positions).max(), 0.0)

    @numba.cfunc(types.int32(types.voidptr, types.double, *[types.CPointer(types.double)] * 3))
    def law(user, t, q, v, tau):
        tau[0] = 9 - 40 * (q[0] - 2) - 3 * v[0]
        return 0

    controlled, again = (scene.simulation(step=1e-3, duration=0.3) for _ in range(2))
    controlled.control(law)
    again.control(lambda t, q, v: 9 - 40 * (q - 2) - 3 * v)
    assert controlled.counts["steps"] == 300 and not np.array_equal(controlled.positions, python.positions)
    held(np.abs(controlled.state - again.state).max(), 1e-14, "a law of numba against one of Python")


def test_a_control_loop_holds_a_pendulum(held):
    rod = kt.mechanism([kt.Body("rod", joint=kt.revolute("y", position=0.3), mass=1, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
    data = rod.model.data()
    simulation = rod.simulation(step=1e-3, duration=4.0)
    ticks = 0
    for state in simulation:
        tau = data.inverse_dynamics(state.positions, state.velocities, -100 * (state.positions - 0.5) - 20 * state.velocities)
        state.set_torque(tau)
        ticks += 1
    assert ticks == 4000
    held(abs(simulation.positions[0] - 0.5), 1e-8, "rad")


def test_reports_of_the_command_are_reachable(scenes):
    scene = kt.load(scenes / "cart-pole.yaml")
    assert len(scene.evaluate()["mass_matrix"]) == scene.model.nv
    assert "modes" in scene.modes(at="initial") and scene.draw().startswith("<?xml")
    assert "cart" in scene.info() and scene.stability()
    assert "<html" in scene.view(duration=0.1) and "<mujoco" in scene.export("mjcf")
    assert len(kt.load(scenes / "double-pendulum.yaml").accuracy(integrators="rk4", budget=1, duration=0.2)) > 2


def test_a_run_that_fails_keeps_its_records(scenes):
    scene = kt.Scene(BALL + "effects:\n  - {type: expression, joint: ball, force: \"exp(400*t)\"}\n")
    with pytest.raises(kt.Error) as raised:
        scene.run(integrator="rk4", step=0.01, duration=4)
    assert raised.value.code == 4 and len(raised.value.run) > 5


def test_a_notebook_shows_the_progress_bar(scenes, monkeypatch, capsys):
    if os.isatty(2):
        pytest.skip("standard error is a terminal, which has the bar itself")
    scene, duration, took = kt.load(scenes / "double-pendulum.yaml"), 2.0, 0.0
    scene.run(duration=duration, interval=1)
    assert "%" not in capsys.readouterr().err
    monkeypatch.setattr(kt.command, "in_notebook", lambda: True)
    while took < 2.5:  # the bar appears after a second
        duration, start = 2.0 * duration, time.monotonic()
        run = scene.run(duration=duration, interval=duration / 20, step=1e-5, integrator="rk4")
        said, took = capsys.readouterr().err, time.monotonic() - start
    print(f"       bars: {said.count('%')} in {took:.2g} s, for {duration:g} s of the motion; bound 2")
    assert len(run) == 21 and said.count("%") >= 2 and "\r" in said
    with pytest.raises(kt.ArgumentError, match="did you mean '--duration'"):
        scene.run(durration=1)


ROD = {
    "rod.urdf": """<robot name="rod"><link name="world"/><link name="rod"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
        <inertia ixx="0.01" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="pin" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>""",
    "rod.xml": """<mujoco><worldbody><body name="rod"><joint name="pin" axis="0 1 0"/>
        <inertial pos="0.5 0 0" mass="2" diaginertia="0.01 0.2 0.2"/></body></worldbody></mujoco>""",
    "rod.sdf": """<sdf version="1.7"><model name="rod"><link name="rod"><inertial><pose>0.5 0 0 0 0 0</pose><mass>2</mass>
        <inertia><ixx>0.01</ixx><iyy>0.2</iyy><izz>0.2</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
        <joint name="pin" type="continuous"><parent>world</parent><child>rod</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>""",
}


@pytest.mark.parametrize("name", list(ROD))
def test_robots_have_the_dynamics_of_their_closed_form(name, tmp_path, held):
    (tmp_path / name).write_text(ROD[name])
    robot = kt.load(tmp_path / name)
    assert robot.is_robot and robot.model.nv == 1
    exact = 2 * (9.8 if name == "rod.sdf" else 9.81) * 0.5 / (0.2 + 2 * 0.25)  # the format of SDF has 9.8 m/s^2
    held(abs(abs(robot.model.data().forward_dynamics([0.0], [0.0], [0.0])[0]) - exact), 1e-13, "rad/s^2")
    run = robot.run(duration=0.1)
    simulation = robot.simulation(duration=0.1)
    simulation.advance(0.1)
    held(abs(list(run.matching("position.*").values())[0][-1] - simulation.positions[0]), 1e-9, "rad")
    with pytest.raises(kt.ArgumentError, match="no option 'floatin'"):
        kt.load(tmp_path / name, floatin=True)


def test_files_are_scenes_unless_they_are_xml(tmp_path):
    """A name without an ending decides nothing: the first character of the file does, as for the command."""
    scene, robot, records = tmp_path / "scene", tmp_path / "robot", tmp_path / "records.csv"
    scene.write_text("kinetree: 1\nbodies: [{name: a, mass: 1, joint: {type: prismatic}}]\n")
    robot.write_text(ROD["rod.urdf"])
    records.write_text("time,position.a\n0,1\n")
    assert not kt.load(scene).is_robot and kt.load(robot).is_robot
    with pytest.raises(kt.SceneError, match="expected a scene"):
        kt.load(records)


# The program with which the package was specified, line by line. `L` is a number of the scene that it is given.
EXAMPLE = """
import kinetree as kt, numpy as np

scene = kt.load("four-bar.yaml", set={"bodies.crank.mass": 2})
run = scene.run(duration=5, tolerance=1e-10)
run.time, run["position.crank"], run.summary["energy"]["error"]
run.plot("position.*"); scene

model = scene.model
data = model.data()
a = data.forward_dynamics(q, v, tau)
A, B = simulation.step_derivatives(tau)
for state in scene.simulation(step=1e-3): ...
batch = model.batch(4096); batch.forward_dynamics(Q, V, TAU)
table = scene.sweep(L=np.linspace(0.5, 2, 200), jobs=2)
kt.Body("arm", joint=kt.revolute("z"), mass=1.2, shape=kt.rod(to=[1, 0, 0]))
"""


def test_the_example_of_the_specification_runs(scenes, tmp_path, monkeypatch, held):
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not on this machine")
    matplotlib.use("agg")
    text = (scenes / "four-bar.yaml").read_text().replace("gravity: [0, -9.81, 0]", 'parameters: {L: 1}\ngravity: [0, "=-9.81*L", 0]')
    (tmp_path / "four-bar.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    start = kt.load("four-bar.yaml")
    q, v = start.simulation(step=1e-3).data().assemble()
    names = {"q": q, "v": v, "tau": np.zeros(3), "simulation": start.simulation(step=1e-3), "Q": np.tile(q, (4096, 1)), "V": np.tile(v, (4096, 1)),
             "TAU": np.zeros((4096, 3))}
    exec(EXAMPLE, names)
    run, state = names["run"], names["state"]
    assert run.time[-1] == 5 and run["position.crank"].shape == run.time.shape == (1001,)
    held(run.summary["energy"]["error"], 1e-8, "energy error of the run")
    assert 0 < run.summary["energy"]["error"] == run.summary["energy_watch"]["error"] / run.summary["energy_watch"]["scale"]
    held(np.abs(names["batch"].forward_dynamics(names["Q"], names["V"], names["TAU"]) - names["a"]).max(), 0.0, "batch against one")
    assert names["A"].shape == (6, 6) and names["B"].shape == (6, 3) and abs(state.time - 5) < 1e-9
    held(np.abs(state.positions - [run[f"position.{each}"][-1] for each in ("crank", "coupler", "rocker")]).max(), 1e-4, "rk4 against dop853, rad")
    table = names["table"]
    assert len(table.to_records()) == 200 and set(table["status"]) == {"done"} and np.array_equal(table["L"], np.linspace(0.5, 2, 200))
    same = start.sweep(L=[1.0], vary={"bodies.crank.mass": [2]})
    held(abs(same["position.crank.end"][0] - run["position.crank"][-1]), 1e-7, "a sweep against a run, rad")
