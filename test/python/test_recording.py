"""A simulation that Python drives records into a Run, with the columns of the command."""
# SPDX-License-Identifier: Apache-2.0
import shutil
import subprocess

import numpy as np
import pytest

import kinetree as kt


@pytest.mark.parametrize("name", ["double-pendulum", "rolling-ball", "pid-arm", "four-bar", "humanoid"])
def test_columns_of_a_recording_are_those_of_the_command(name, held):
    scene = kt.load(name)
    simulation = scene.simulation(step=1e-3, integrator="rk4", duration=0.02)
    recording = simulation.record()
    for _ in simulation:
        pass
    found, run = recording.run(), scene.run(duration=0.02, step=1e-3, integrator="rk4", interval=1e-3, quiet=True)
    shared = [column for column in found if column in run]
    assert len(found) == len(run) == 21 and {"time", "energy.total"} <= set(shared)
    assert {column for column in run if column.startswith(("position.", "velocity.", "state."))} <= set(shared)
    worst = max(np.abs(found[column] - run[column]).max() / max(np.abs(run[column]).max(), 1e-3) for column in shared)
    held(worst, 1e-12, f"{len(shared)} columns against those of the command, relative")
    units = run.summary["columns"]
    assert not [column for column in shared if column != "time" and found.summary["columns"][column]["unit"] != units[column]["unit"]]


def test_torques_intervals_and_events_are_recorded(held):
    simulation = kt.load("double-pendulum").simulation(step=1e-3, duration=1.0)
    simulation.on("low", lambda at: float(at.q[0]) - 1.6)
    recording = simulation.record(interval=0.1)
    for k, state in enumerate(simulation):
        state.torque[:] = [k, -k]
    run = recording.run()
    held(np.abs(run.time - np.linspace(0, 1, 11)).max(), 1e-12, "s")
    held(np.abs(run["torque.upper"][1:] - np.arange(99, 1000, 100)).max(), 0.0, "N m, of the step before each record")
    assert run.summary["events"]["low"] == simulation.event_count("low") >= 1 and run.summary["columns"]["torque.upper"]["unit"] == "N m"
    assert len(recording) == 11 and "11 records" in repr(recording)
    second = simulation.record()
    simulation.tick(1e-3)
    assert len(second) == 2 and len(recording) == 11


def test_states_between_records_are_interpolated(held):
    fine, coarse = (kt.load("rolling-ball").simulation(step=1e-3, duration=0.5) for _ in range(2))
    recording = coarse.record(interval=0.02)
    coarse.advance(0.5)
    errors = []
    for t in (0.013, 0.111, 0.25, 0.437):
        fine.advance(t)
        steps = coarse.model.subtract(recording.at(t)[0], fine.positions.copy())
        errors.append(np.abs(steps).max())
        held(np.abs(recording.at(t)[1] - fine.velocities).max(), 1e-2, "rad/s, m/s")
    assert len(recording) > 3
    held(max(errors), 1e-5, "rad, m")
    for wrong in (-1.0, 9.0, np.nan):
        with pytest.raises(kt.ArgumentError, match="^t: "):
            recording.at(wrong)


def test_a_recording_is_plotted_and_changes_nothing(held, tmp_path):
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not on this machine")
    matplotlib.use("Agg")
    plain, recorded = (kt.load("double-pendulum").simulation(step=1e-3, duration=0.2) for _ in range(2))
    recording = recorded.record()
    plain.advance(0.2)
    recorded.advance(0.2)
    held(np.abs(plain.state - recorded.state).max(), 0.0, "with and without records")
    axes = recording.run().plot("position.*", "energy.total")
    axes[0].figure.savefig(tmp_path / "recording.png")
    assert (tmp_path / "recording.png").stat().st_size > 1000 and len(axes) == 2


BALL = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 1}, mass: 1, shape: {type: sphere, radius: 0.1}, markers: {c: [0, 0, 0]}}
effects:
  - {name: floor, type: contact, point: ball.c, radius: 0.1, plane: world, restitution: 0.5}
events:
  - {name: half, when: position.ball < 0.5, then: record}
simulate: {duration: 0.9}
"""


def test_events_of_a_recording_have_their_times(held):
    plain, simulation = kt.Scene(BALL).simulation(step=1e-2), kt.Scene(BALL).simulation(step=1e-2)
    for each in (plain, simulation):
        each.on("slow", lambda at: float(at.v[0]) + 2.0, direction="falling")
    recording = simulation.record(interval=0.1)
    for _ in simulation:
        pass
    for _ in plain:
        pass
    held(np.abs(plain.state - simulation.state).max(), 0.0, "with and without records, to the bit")
    times = {name: [t for t, other in recording.events if other == name] for name in ("half", "slow", "floor")}
    touch = np.sqrt(2 * 0.9 / 9.81)
    held(abs(times["half"][0] - np.sqrt(2 * 0.5 / 9.81)), 1e-9, "s, of a fall by 0.5 m")
    held(abs(times["slow"][0] - 2.0 / 9.81), 1e-9, "s, of the speed 2 m/s")
    held(abs(times["floor"][0] - touch), 1e-9, "s, of the first impact")
    run = recording.run()
    assert [mark["name"] for mark in run.summary["marks"]][:3] == ["slow", "half", "floor"] and not run.summary["marks_cut"]
    assert {name: len(found) for name, found in times.items()} == {name: simulation.event_count(name) for name in times}


def test_a_recording_is_seen_and_animated(held, tmp_path):
    simulation = kt.Scene(BALL).simulation(step=1e-2)
    recording = simulation.record()
    with pytest.raises(kt.ArgumentError, match="no records"):
        _empty(simulation).view()
    for _ in simulation:
        pass
    page = recording.view(out=tmp_path / "page.html")
    assert "<html" in page and '"half"' in page and (tmp_path / "page.html").read_text() == page and "records of recording.csv" in page
    picture = recording.animate()
    assert picture.startswith("<") and "animate" in picture
    frames = pytest.importorskip("PIL.Image", reason="Pillow is not on this machine")
    recording.animate(out=tmp_path / "ball.gif", speed=0.5)
    with frames.open(tmp_path / "ball.gif") as film:
        held(abs(film.n_frames - (25 * 0.9 / 0.5 + 1)), 0.0, "frames, of 25 a second at half of real time")
        assert film.size[0] == 900
    with pytest.raises(kt.ArgumentError, match="expected .svg, .gif, .mp4 or .webm"):
        recording.animate(out=tmp_path / "ball.avi")


@pytest.mark.skipif(shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None, reason="ffmpeg is not on this machine")
def test_a_recording_becomes_a_video(held, tmp_path):
    frames = pytest.importorskip("PIL.Image", reason="Pillow is not on this machine")
    simulation = kt.Scene(BALL).simulation(step=1e-2)
    recording = simulation.record()
    for _ in simulation:
        pass
    for name in ("ball.mp4", "ball.webm"):
        file = tmp_path / name
        assert recording.animate(out=str(file), speed=0.5) == ""
        probed = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries", "stream=width,height,nb_read_frames:format=duration",
                                 "-of", "default=noprint_wrappers=1", file], check=True, capture_output=True, text=True).stdout
        found = dict(line.split("=") for line in probed.split())
        held(abs(int(found["nb_read_frames"]) - (25 * 0.9 / 0.5 + 1)), 0.0, f"frames of {name}")
        held(abs(float(found["duration"]) - 46 / 25), 1e-3, f"duration of {name}, s")
        assert int(found["width"]) % 2 == 0 and int(found["height"]) % 2 == 0
    subprocess.run(["ffmpeg", "-loglevel", "error", "-i", tmp_path / "ball.mp4", "-vf", "select=eq(n\\,0)+eq(n\\,23)", "-vsync", "0", tmp_path / "at-%d.png"], check=True)
    one, other = (np.asarray(frames.open(tmp_path / f"at-{k}.png").convert("RGB"), float) for k in (1, 2))
    held(0.01 / np.mean(np.abs(one - other)), 1.0, "changes between two frames, inverse")
    with pytest.raises(FileNotFoundError, match="missing: No such file"):
        recording.animate(out=tmp_path / "missing" / "ball.mp4")
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(kt.FileError, match="ffmpeg could not write it"):
        recording.animate(out=tmp_path / "folder.mp4")


def test_a_video_needs_ffmpeg(tmp_path, monkeypatch):
    simulation = kt.Scene(BALL).simulation(step=1e-2)
    recording = simulation.record()
    simulation.tick(1e-2)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(kt.Error, match="needs the program ffmpeg, which is not installed"):
        recording.animate(out=tmp_path / "ball.mp4")


def _empty(simulation):
    from kinetree.recording import Recording
    return Recording(simulation, None)
