"""Help, types and messages: what a reader of the package sees."""
# SPDX-License-Identifier: Apache-2.0
import inspect
import re

import numpy as np
import pytest

import kinetree as kt


def documented():
    """All public functions, methods and properties: name and object."""
    for name in kt.__all__:
        found = getattr(kt, name)
        if inspect.isclass(found):
            yield name, found
            yield from ((f"{name}.{each}", value.fget if isinstance(value, property) else value) for each, value in vars(found).items()
                        if not each.startswith("_") and (callable(value) or isinstance(value, property)))
        elif inspect.isfunction(found):
            yield name, found


def test_every_public_function_has_a_text_with_its_parameters():
    count, missing = 0, []
    for name, found in documented():
        text = inspect.getdoc(found) or ""
        count += 1
        if not text:
            missing.append(f"{name} has no text")
        if inspect.isclass(found):
            continue
        head = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
        named = {each.strip("* ") for line in head.splitlines() if not line.startswith(" ") for each in line.partition(" : ")[0].split(",")}
        missing += [f"{name} does not describe '{each}'" for each in inspect.signature(found).parameters if each not in ("self", *named)]
    print(f"       {count} texts, {len(missing)} faults")
    assert count > 110 and not missing, missing


def test_arrays_have_shapes_and_units():
    """Each text that names an array says how long it is."""
    missing = [f"{name}: {line.strip()}" for name, found in documented() for line in (inspect.getdoc(found) or "").splitlines()
               if re.match(r"\s*[\w, ]+ : arrays?\b", line) and not re.search(r"arrays? of [\w ]*(n|\d|states|groups)", line) and "arrays, optional" not in line]
    assert not missing
    for call in ("forward_dynamics", "inverse_dynamics", "kinematics", "step", "jacobian", "position", "mass_matrix"):
        assert re.search(r"rad|\bm\b|kg", inspect.getdoc(getattr(kt.Data, call)))


def test_types_of_a_scene_have_their_help():
    for kind, some in ((kt.joint, "screw"), (kt.loop, "distance"), (kt.effect, "contact"), (kt.shape, "box")):
        assert some in dir(kind)
        for name in dir(kind):
            assert "Keys" in getattr(kind, name).__doc__ and getattr(kind, name)() == {"type": name}
    assert "lengths of its edges" in kt.shape.box.__doc__
    with pytest.raises(AttributeError, match="there is no shape 'bocks'"):
        kt.shape.bocks()


def test_objects_have_a_short_text(scenes):
    model = kt.load(scenes / "four-bar.yaml").model
    table = kt.Table({"L": np.array([1.0, 2.0]), "status": np.array(["done", "done"])})
    for found in (model, model.data(), model.batch(3), kt.Body("rod", kt.revolute()), table, model.scene.simulation()):
        assert re.match(r"<kinetree\.\w+", repr(found)) and " object at" not in repr(found)
    assert np.asarray(table).dtype.names == ("L", "status") and np.asarray(table)["L"][1] == 2.0


def test_names_and_numbers_of_a_model_are_at_hand(scenes, held):
    model = kt.load(scenes / "four-bar.yaml").model
    assert model.markers[0] == "crank.tip" and all(model.point(each)[0] for each in model.markers)
    rod = kt.mechanism([kt.Body("rod", joint=kt.revolute("y", position=0.3, velocity=2), mass=2, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
    data = rod.model.data()
    for call in (lambda: data.position("rod"), lambda: data.jacobian("rod"), data.energy, data.mass_center, data.momentum, lambda: data.pose("rod")):
        with pytest.raises(kt.ArgumentError, match=r"call data.kinematics\(q, v\) first"):
            call()
    data.kinematics()
    mass, center = data.mass_center()
    held(abs(mass - 2) + np.abs(center - 0.5 * np.array([np.cos(0.3), 0, -np.sin(0.3)])).max(), 1e-15, "kg and m")
    held(np.abs(data.momentum()[3:] - 2 * data.velocity(("rod", [0.5, 0, 0]))).max(), 1e-15, "N s")
    held(abs(data.momentum()[1] - 2 / 3 * 2), 1e-15, "N m s")  # the axis is y
    held(abs(kt.lib.kt_kinetic_energy(rod.model.pointer, data.pointer) - data.energy()[0]), 0.0, "J, by the interface of C")
    simulation, batch = rod.simulation(step=1e-3), rod.model.batch(3)
    assert kt.lib.kt_simulation_time(simulation.pointer) == 0.0 and kt.lib.kt_batch_count(batch.pointer) == 3


def test_a_missing_file_is_an_error_of_files(tmp_path):
    with pytest.raises(OSError, match="cannot be read") as raised:
        kt.load(tmp_path / "nothing.yaml")
    assert isinstance(raised.value, kt.FileError) and raised.value.code == kt.lib.KT_ERROR_FILE


def test_a_ground_is_a_height_and_brings_contacts(tmp_path, held):
    (tmp_path / "box.xml").write_text('<mujoco><worldbody><body name="box" pos="0 0 1"><freejoint/>'
                                      '<geom type="sphere" size=".1" mass="1"/></body></worldbody></mujoco>')
    falls, lies = kt.load(tmp_path / "box.xml"), kt.load(tmp_path / "box.xml", ground=0)
    ends = [each.simulation(duration=2).run()["q"][-1][2] for each in (falls, lies)]
    held(abs(ends[0] - (1 - 0.5 * 9.81 * 4)), 1e-8, "height after a fall, m")
    assert 0.09 < ends[1] < 0.11 and "contacts" in lies.options and len(lies.run(duration=0.1)) > 5
    for wrong in (True, "x", np.nan):
        with pytest.raises(kt.ArgumentError, match="ground: expected"):
            kt.load(tmp_path / "box.xml", ground=wrong)
    with pytest.raises(kt.ArgumentError, match="bodies: expected a list of kinetree.Body"):
        kt.mechanism(kt.Body("rod", kt.revolute()))
