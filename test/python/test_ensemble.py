"""Many simulations at once: the bits of single runs, failures, and guards."""
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import kinetree as kt


def chains(scene, count, **options):
    """Simulations of copies of a model with masses of their own."""
    found = []
    for k in range(count):
        model = scene.model.copy()
        model.set("lower.mass", 1.0 + 0.1 * k)
        found.append(scene.simulation(model=model, duration=0.5, **options))
    return found


@pytest.mark.parametrize("options", [{"integrator": "dopri5", "tolerance": 1e-8}, {"step": 1e-2, "integrator": "rk4"}])
def test_an_ensemble_has_the_bits_of_single_runs(options, held):
    scene = kt.load("double-pendulum")
    found, single = kt.ensemble(chains(scene, 9, **options)), [each.run() for each in chains(scene, 9, **options)]
    assert all(np.array_equal(a["time"], b["time"]) for a, b in zip(found, single)) and len(found[0]["time"]) > 2
    held(max(np.abs(a[name] - b[name]).max() for a, b in zip(found, single) for name in "qv"), 0.0, "rad, rad/s, against single runs")
    assert np.abs(found[0]["q"][-1] - found[8]["q"][-1]).max() > 1e-3


def test_a_simulation_that_fails_leaves_the_others():
    scene = kt.load("double-pendulum")
    simulations = chains(scene, 5, step=1e-2)
    simulations[2].on("wrong", lambda at: 1.0 / 0.0 if at.t > 0.2 else 1.0)
    found = kt.ensemble(simulations)
    assert [isinstance(each.get("error"), ZeroDivisionError) for each in found] == [False, False, True, False, False]
    assert found[2]["time"][-1] < 0.25 and found[4]["time"][-1] == 0.5
    simulations[0].advance(0.6)  # no guard is held


def test_a_simulation_is_in_an_ensemble_once():
    simulation = kt.load("double-pendulum").simulation(step=1e-2, duration=0.1)
    with pytest.raises(kt.Busy):
        kt.ensemble([simulation, simulation])
    assert kt.ensemble([]) == [] and len(kt.ensemble([simulation])) == 1
    with pytest.raises(TypeError, match="^simulations: "):
        kt.ensemble([1])
