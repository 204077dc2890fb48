"""A simulation that Python drives records into a Run, with the columns of the command."""
# SPDX-License-Identifier: Apache-2.0
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
