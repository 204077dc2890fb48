"""A scene keeps the content of its files, and errors of files are those of Python."""
# SPDX-License-Identifier: Apache-2.0
import copy
import errno
import gc
import multiprocessing
import os
import pickle
import warnings

import numpy as np
import pytest

import kinetree as kt

SCENE = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.3}, mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333]}
loops:
  - {name: drive, type: motion, joint: arm, table: TABLE}
simulate: {duration: 1}
"""


def lengthen(path):
    """Edit a file: the number 1.5 becomes 7."""
    path.write_text(path.read_text().replace("1.5", "7.0"))


def end_of(scene):
    simulation = scene.simulation(duration=1.0, tolerance=1e-9)
    simulation.advance(1.0)
    return simulation.positions.copy()


def test_a_scene_keeps_its_content_after_an_edit_of_the_file(tmp_path, held):
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE[:SCENE.index("loops:")].replace("com: [0.5,", "com: [1.5,").replace("0.0833333333333", "2.5") + "simulate: {duration: 1, tolerance: 1e-9}\noutput: {interval: 0.1}\n")
    scene = kt.load(path)
    before, run, stored = end_of(scene), scene.run(), pickle.dumps(scene)
    lengthen(path)
    held(abs(end_of(kt.load(path))[0] - before[0]) < 1e-3, 0, "the edit changes nothing")
    for again in (scene, copy.copy(scene), copy.deepcopy(scene), pickle.loads(stored), pickle.loads(pickle.dumps(scene))):
        held(abs(end_of(again) - before).max(), 0.0, "rad, in this process")
        held(np.abs(again.run()["position.arm"] - run["position.arm"]).max(), 0.0, "rad, by the command")
    path.unlink()
    held(np.abs(pickle.loads(stored).run()["position.arm"] - run["position.arm"]).max(), 0.0, "rad, without the file")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        held(abs(pool.map(end_of, [scene])[0] - before).max(), 0.0, "rad, in a spawned worker")


def test_a_scene_keeps_the_tables_and_the_files_that_it_includes(tmp_path, held):
    path, table = tmp_path / "arm.yaml", tmp_path / "drive.csv"
    table.write_text("time,angle\n0,0.3\n0.5,1.5\n1,1.5\n")
    path.write_text(SCENE.replace("table: TABLE", "position: {table: drive.csv, value: angle}"))
    scene = kt.load(path)
    before, stored = scene.run()["position.arm"], pickle.dumps(scene)
    lengthen(table)
    held(np.abs(kt.load(path).run()["position.arm"] - before).max() < 1, 0, "the edit changes nothing")
    for again in (scene, copy.copy(scene), pickle.loads(stored)):
        held(np.abs(again.run()["position.arm"] - before).max(), 0.0, "rad, with the table as it was")
    parts, robot = tmp_path / "parts.xml", tmp_path / "robot.xml"
    parts.write_text('<mujocoinclude><body name="arm"><joint name="j" axis="0 1 0"/><geom type="sphere" size=".1" mass="1.5" pos=".5 0 0"/></body></mujocoinclude>')
    robot.write_text('<mujoco><worldbody><include file="parts.xml"/></worldbody></mujoco>')
    scene = kt.load(robot)
    lengthen(parts)
    assert kt.load(robot).model.get("arm.mass") == 7.0
    assert scene.model.get("arm.mass") == copy.copy(scene).model.get("arm.mass") == pickle.loads(pickle.dumps(scene)).model.get("arm.mass") == 1.5


def test_messages_name_the_file_and_not_its_copy(tmp_path, recwarn):
    path = tmp_path / "robot.urdf"
    path.write_text('<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>')
    scene = kt.load(path, floating=True)
    path.unlink()
    pickle.loads(pickle.dumps(scene))
    gc.collect()  # the folder of the copies goes without a word
    words = [str(each.message) for each in recwarn]
    print("      ", *words)
    assert len(words) > 1 and all(each.startswith(str(path)) for each in words)
    with pytest.raises(kt.Error) as caught:
        scene.run(duration=0.1, keyframe="home")
    print("      ", caught.value)
    assert "/kinetree-" not in str(caught.value)


def test_an_unchanged_file_is_read_in_its_place(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE[:SCENE.index("loops:")] + "simulate: {duration: 0.1}\n")
    scene = kt.load(path)
    assert scene._file() == str(path) and pickle.loads(pickle.dumps(scene))._file() == str(path)
    os.utime(path, (0, 0))
    assert scene._file() != str(path) and scene._file().endswith("arm.yaml")


def test_errors_of_files_are_those_of_python(tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.yaml") as raised:
        kt.load(tmp_path / "nothing.yaml")
    assert isinstance(raised.value, kt.FileError) and raised.value.errno == errno.ENOENT
    assert raised.value.filename == str(tmp_path / "nothing.yaml") and type(raised.value).__name__ == "FileError"
    again = pickle.loads(pickle.dumps(raised.value))
    assert isinstance(again, FileNotFoundError) and again.errno == errno.ENOENT and str(again) == str(raised.value)
    with pytest.raises(FileNotFoundError):
        kt.load(tmp_path / "robot.urdf")
    with pytest.raises(IsADirectoryError):
        kt.load(tmp_path)
    scene = kt.Scene("kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, axis: x}, mass: 1}]\nsimulate: {duration: 0.1}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(FileNotFoundError):
            scene.run(out=tmp_path / "no" / "records.csv")
