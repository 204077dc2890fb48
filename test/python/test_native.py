"""What a user of Python expects: mappings, names in messages, bundled scenes, summaries, arrays."""
# SPDX-License-Identifier: Apache-2.0
import html
import subprocess
import sys

import numpy as np
import pytest

import kinetree as kt

ARM = kt.Body("arm", joint=kt.revolute("y"), mass=1, inertia=[1, 2, 2])


def test_tables_and_runs_are_mappings(scenes):
    run = kt.load(scenes / "four-bar.yaml").run(duration=0.1)
    assert list(run.keys()) == run.names == list(dict(run)) and run.get("nothing", 5) == 5 and len(run) == len(run.time)
    assert all(np.array_equal(column, run[name]) for name, column in run.items()) and len(list(run.values())) == len(run.names)
    with pytest.raises(KeyError, match="there is no column 'position.crnk'; did you mean 'position.crank'"):
        run["position.crnk"]
    pandas = pytest.importorskip("pandas", reason="pandas is not on this machine")
    frame = pandas.DataFrame(run)
    assert list(frame.columns) == run.names and np.array_equal(frame["position.crank"], run["position.crank"])
    table = kt.Table({"L": np.array([1.0, 2.0]), "status": np.array(["done", "failed"])})
    assert list(pandas.DataFrame(table)["status"]) == ["done", "failed"] and "<td>failed</td>" in table._repr_html_()


@pytest.mark.parametrize("make, where", [
    (lambda: [kt.Body("arm", joint=kt.revolute("q"), mass=1)], "bodies 'arm': joint.axis"),
    (lambda: [ARM, kt.Body("hand", parent="arrm", joint=kt.revolute("y"), mass=1)], "bodies 'hand': parent"),
    (lambda: [kt.Body("arm", joint=kt.revolute("y"), mass=-1)], "bodies 'arm': mass"),
    (lambda: [kt.Body("arm", joint=kt.revolute("y"), mass=1, com=[0, 0])], "bodies 'arm': com"),
])
def test_a_fault_of_a_mechanism_names_the_object(make, where):
    with pytest.raises(kt.SceneError) as raised:
        kt.mechanism(make())
    assert raised.value.where == where and "scene:" not in str(raised.value)


def test_faults_of_effects_and_of_dicts_name_the_object():
    for content in ({"effects": [kt.effect.spring(name="s", between=["arm", "world"], stifness=3)]}, {"effects": [kt.effect.joint_spring(joint="arm", stiffness=[3, 3])]}):
        with pytest.raises(kt.SceneError, match=r"^effects( 's': stifness|\[0\]\.stiffness)"):
            kt.mechanism([ARM], **content)
    with pytest.raises(kt.SceneError, match=r"2 faults\nbodies 'a': mas: .*\nbodies 'a': com: "):
        kt.Scene({"kinetree": 1, "bodies": [{"name": "a", "joint": {"type": "revolute", "axis": "y"}, "mas": 1, "com": [0, 0]}]})


def test_an_inertia_may_be_a_matrix():
    matrix = np.array([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]])
    model = kt.mechanism([kt.Body("a", joint=kt.joint.spherical(), mass=1, inertia=matrix), kt.Body("b", joint=kt.joint.spherical(), mass=1, inertia=np.diag([1, 2, 2.5]))]).model
    assert list(model.get("a.inertia")) == [2, 3, 4, 0.1, 0.2, 0.3] and list(model.get("b.inertia")) == [1, 2, 2.5, 0, 0, 0]
    for wrong in (np.eye(2), [[1, 2, 0], [0, 1, 0], [0, 0, 1]]):
        with pytest.raises(kt.ArgumentError, match="body 'a': inertia: expected 3 or 6 numbers, or a symmetric matrix"):
            kt.mechanism([kt.Body("a", joint=kt.joint.spherical(), mass=1, inertia=wrong)])


def test_bundled_scenes_load_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert kt.load("double-pendulum").model.nv == 2 and kt.load("four-bar.yaml").model.nv == 3
    (tmp_path / "four-bar.yaml").write_text("kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, axis: x}, mass: 1}]\n")
    assert kt.load("four-bar.yaml").model.nv == 1  # a file comes first
    with pytest.raises(FileNotFoundError, match="did you mean the bundled scene 'double-pendulum'"):
        kt.load("double-pendulumm")
    with pytest.raises(FileNotFoundError) as caught:
        kt.load("nothing-of-this-kind.yaml")
    assert "did you mean" not in str(caught.value) and caught.value.filename == "nothing-of-this-kind.yaml"


def test_a_scene_is_shown_without_a_run(monkeypatch):
    scene = kt.load("double-pendulum")
    monkeypatch.setattr(kt.command, "run", lambda *_, **__: pytest.fail("a command ran"))
    assert "<table>" in scene._repr_html_() and "double pendulum" in scene._repr_html_()


def test_a_page_is_shown_in_a_frame_without_access_to_the_notebook():
    page = kt.load("double-pendulum").view(duration=0.1)
    frame = page._repr_html_()
    assert isinstance(page, kt.Page) and page.startswith("<!") and 'sandbox="allow-scripts"' in frame
    assert html.unescape(frame.partition('srcdoc="')[2].partition('"')[0]) == page


def test_reports_have_arrays(held):
    scene = kt.load("four-bar")
    modes, evaluated = scene.modes(), scene.evaluate()
    eigenvalues = np.linalg.eigvals(modes["state_matrix"])
    held(min(abs(eigenvalues - modes["modes"][0]["real"])), 1e-9, "1/s, of a matrix that is an array")
    data = scene.model.data()
    data.assemble()
    held(np.abs(evaluated["mass_matrix"] - data.mass_matrix()).max(), 1e-12, "kg m^2")
    assert evaluated["coordinates"] == ["crank", "coupler", "rocker"] and evaluated["bias"].shape == (3,)


def test_python_m_kinetree_is_the_command():
    done = subprocess.run([sys.executable, "-m", "kinetree", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.splitlines()[0] == f"kinetree {kt.__version__}"
    assert subprocess.run([sys.executable, "-m", "kinetree", "nothing"], capture_output=True).returncode == 1


def test_robots_take_settings_as_scenes_do(tmp_path, held):
    (tmp_path / "rod.xml").write_text('<mujoco><worldbody><body name="rod"><joint name="j" axis="0 1 0"/><geom type="capsule" size=".05" fromto="0 0 0 1 0 0" mass="2"/></body></worldbody></mujoco>')
    plain, heavy = kt.load(tmp_path / "rod.xml"), kt.load(tmp_path / "rod.xml", set={"bodies.rod.mass": 7})
    assert plain.model.get("rod.mass") == 2.0 and heavy.model.get("rod.mass") == 7.0
    run, simulation = heavy.run(duration=0.2), heavy.simulation(duration=0.2)
    simulation.advance(0.2)
    held(abs(run["position.j"][-1] - simulation.positions[0]), 1e-6, "rad, of the run and of the simulation")
    with pytest.raises(kt.SceneError, match="rodd"):
        kt.load(tmp_path / "rod.xml", set={"bodies.rodd.mass": 7})
