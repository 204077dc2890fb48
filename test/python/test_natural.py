"""Arguments that a program has naturally are taken: arrays, mappings, truth values, paths. Others are rejected with a remedy."""
# SPDX-License-Identifier: Apache-2.0
import copy
import pickle

import numpy as np
import pytest

import kinetree as kt

ROD = """
kinetree: 1
gravity: [0, -9.81, 0]
parameters: {L: 1}
bodies:
  - {name: rod, joint: {type: revolute, axis: z, position: 60 deg}, mass: 2, shape: {type: rod, to: [=L, 0, 0]}, markers: {tip: [=L, 0, 0]}}
simulate: {duration: 0.1, tolerance: 1e-9}
"""

BALL = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies: [{name: ball, joint: {type: prismatic, axis: z, position: 2}, mass: 1, shape: {type: sphere, radius: 0.1}}]
simulate: {duration: 1}
"""


def test_values_of_set_are_those_of_a_scene(tmp_path):
    """A uniform rod at angle q has the acceleration -3 g cos(q) / (2 L)."""
    (tmp_path / "rod.yaml").write_text(ROD)
    for gravity in (np.array([0.0, -2.0, 0.0]), [0, -2, 0], (0, -2.0, np.float32(0))):
        scene = kt.load(tmp_path / "rod.yaml", set={"gravity": gravity, "bodies.rod.joint.guess": False})
        assert scene.model.get("gravity").tolist() == [0, -2, 0]
        assert scene.evaluate()["acceleration"][0] == pytest.approx(-1.5, abs=1e-12)
    changed = kt.load(tmp_path / "rod.yaml", set={"simulate": {"duration": 0.25}})
    assert changed.run().time[-1] == 0.25
    run = kt.load(tmp_path / "rod.yaml").run(set={"L": 2, "gravity": [0, -2, 0]}, record="acceleration")
    assert run["acceleration.rod"][0] == pytest.approx(-0.75, abs=1e-12)
    with pytest.raises(kt.ArgumentError, match="L: expected a value, got None"):
        kt.load(tmp_path / "rod.yaml", set={"L": None})
    with pytest.raises(kt.ArgumentError, match="bodies 'a': mass: expected numbers, texts, lists and mappings, got {1, 2}"):
        kt.Scene({"kinetree": 1, "bodies": [{"name": "a", "mass": {1, 2}}]})
    assert kt.load(bytes(tmp_path / "rod.yaml")).name == "rod"


def test_a_mechanism_takes_vectors_of_numpy():
    rod = kt.Body("rod", kt.revolute(np.array([0, 0, 1.0])), mass=2, shape=kt.rod(np.array([1.0, 0, 0])))
    scene = kt.mechanism([rod], gravity=np.array([0, -9.81, 0]))
    assert scene.model.data().forward_dynamics([0.0], [0.0])[0] == pytest.approx(-1.5 * 9.81, abs=1e-12)


def test_files_are_kept_where_the_call_names_them(tmp_path):
    scene = kt.Scene(ROD)
    run = scene.run(out=tmp_path / "a.csv", summary=tmp_path / "a.json")
    assert (tmp_path / "a.csv").read_text() == run.csv and (tmp_path / "a.json").stat().st_size > 100
    assert scene.view(out=tmp_path / "a.html") == (tmp_path / "a.html").read_text()
    picture = scene.draw(out=tmp_path / "a.svg")
    assert picture == (tmp_path / "a.svg").read_text() and scene.draw(out=tmp_path / "a.png") == picture
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(kt.FileError, match="create the folder"):
        scene.run(out=tmp_path / "none/a.csv")


def test_values_of_a_sweep():
    scene = kt.Scene(ROD)
    assert scene.sweep(L=range(1, 3))["L"].tolist() == [1, 2]
    longer = kt.Scene(ROD, set={"parameters.L": 5})
    assert longer.sweep(L=[1, 2])["L"].tolist() == [1, 2] and longer.set == {"parameters.L": 5}
    for values in ("1:2:3", (each for each in [1.0])):
        with pytest.raises(kt.ArgumentError, match="sweep: L: expected a list or an array of numbers"):
            scene.sweep(L=values)
    with pytest.raises(kt.ArgumentError, match="sweep: L: the values are given twice"):
        scene.sweep({"L": [1]}, L=[2])


def test_faults_name_the_argument():
    scene = kt.Scene(ROD)
    with pytest.raises(kt.ArgumentError, match="option 'ground'"):
        kt.Scene(ROD, ground=0)
    with pytest.raises(kt.ArgumentError, match=r"got the name of a file; kinetree.load\('rod.yaml'\) reads it"):
        kt.Scene("rod.yaml")
    assert kt.Scene(ROD + "# rod.yaml").name == "scene"
    with pytest.raises(kt.ArgumentError, match="^set: expected a mapping, such as"):
        kt.Scene(ROD, set="L=2")
    copy = scene.model.copy()
    for wrong in ([[1], [2, 3]], None, "1", [1, 2]):
        with pytest.raises(kt.ArgumentError, match="^value of 'rod.mass': expected"):
            copy.set("rod.mass", wrong)
    data = scene.model.data()
    for call in (data.forward_dynamics, data.effect_forces, data.forward_derivatives):
        for wrong in ("a", np.nan):
            with pytest.raises(kt.ArgumentError, match="^t: expected a"):
                call([0], [0], t=wrong)
            with pytest.raises(kt.ArgumentError, match="^t: expected a"):
                call(np.zeros(1), np.zeros(1), t=wrong)
    with pytest.raises(kt.StepError, match="point: expected finite numbers"):
        scene.model.data().kinematics([0.0], [0.0]).position(("rod", [0, np.nan, 0]))
    simulation = scene.simulation(step=1e-3, duration=0.1)
    simulation.on("doubt", lambda at: np.nan)
    with pytest.raises(kt.StepError, match="event 'doubt' at t = 0 s: its value is NaN"):
        simulation.advance(0.05)
    again = scene.simulation(step=1e-3, duration=0.1)
    for k in range(15):
        again.on(f"event {k}", lambda at: at.t - 1.0)
    again.on("stop", lambda at: at.t - 0.01, lambda at: at.advance(0.09))
    with pytest.raises(kt.Busy, match="by the call that runs this function"):
        again.run()
    with pytest.raises(kt.ArgumentError, match="takes 16 events by functions; write others into `events` of the scene"):
        again.on("more", lambda at: at.t - 1.0)


def test_copies_of_a_batch_have_its_states():
    model = kt.Scene(ROD).model
    batch = model.batch(11, method="rk4")
    Q = np.linspace(-1, 1, 11)[:, None]
    batch.step(1e-3, 5, Q, 0 * Q)
    for other in (pickle.loads(pickle.dumps(batch)), copy.deepcopy(batch), copy.copy(batch)):
        assert other.q is not batch.q and np.array_equal(other.rows(other.q), batch.rows(batch.q))
        batch_next, other_next = (each.step(1e-3, 5, each.rows(each.q), each.rows(each.v)) for each in (batch, other))
        assert all(np.array_equal(a, b) for a, b in zip(batch_next, other_next))
        batch.step(1e-3, 5, Q, 0 * Q)


def test_a_body_without_a_joint_is_fixed():
    arm = kt.Body("arm", joint=kt.revolute("y"), mass=1, shape=kt.rod(to=[1, 0, 0]))
    scene = kt.mechanism([arm, kt.Body("load", parent=arm, mass=2, com=[1, 0, 0])], gravity=[0, 0, -9.81])
    assert scene.model.nv == 1 and scene.model.data().mass_matrix()[0, 0] == pytest.approx(1 / 3 + 2)


def test_texts_that_are_no_characters_are_rejected(tmp_path):
    """Half of a pair of surrogates raised an error of Python. A zero byte ended a value in silence."""
    half = "\ud83d"
    scene = kt.Scene(BALL)
    calls = {
        "the text of a scene": lambda: kt.Scene(BALL + f"name: {half}"),
        "a dict": lambda: kt.Scene({"kinetree": 1, "name": half}),
        "a value": lambda: kt.Scene(BALL, set={"gravity": half}),
        "a name of set": lambda: kt.Scene(BALL, set={half: 1}),
        "a path": lambda: kt.load(tmp_path / f"{half}.yaml"),
        "a name": lambda: scene.model.copy().get(half),
        "a method": lambda: scene.simulation(integrator=half),
        "an option": lambda: scene.run(integrator=half),
        "a folder": lambda: kt.load(tmp_path / "x.urdf", search=half),
        "a value with a zero byte": lambda: kt.Scene(BALL, set={"gravity[2]": "-1\0 5"}),
    }
    for what, call in calls.items():
        with pytest.raises(kt.ArgumentError, match="no character|no zero byte"):
            print("       " + what)
            call()


def test_a_scene_keeps_its_file_if_the_program_changes_its_folder(tmp_path, monkeypatch):
    """Another file of the same name in the new folder was run in silence."""
    for name, height in (("first", 2.0), ("second", 5.0)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ball.yaml").write_text(BALL.replace("position: 2", f"position: {height}"))
    monkeypatch.chdir(tmp_path / "first")
    scene = kt.load("ball.yaml")
    monkeypatch.chdir(tmp_path / "second")
    assert scene.run(duration=0.1)["position.ball"][0] == 2.0 == scene.model.data().q[0]


def test_an_export_warns_of_parts_that_it_leaves_out(recwarn):
    damped = BALL + "events: [{name: e, when: position.ball, then: record}]\n"
    kt.Scene(BALL).export()
    assert not recwarn.list
    with pytest.warns(kt.KinetreeWarning, match="left out or changed: events"):
        assert "<mujoco" in kt.Scene(damped).export()
