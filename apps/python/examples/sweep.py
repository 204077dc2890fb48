"""The period of a pendulum against its length, by a sweep over all processors."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np

TEXT = """
kinetree: 1
gravity: [0, 0, -9.81]
parameters: {L: 1}
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 91 deg}, mass: 1, com: [=L, 0, 0], inertia: [0, 1.0e-9, 1.0e-9]}
simulate: {duration: 20, tolerance: 1.0e-9}
"""


def main() -> None:
    scene = kt.Scene(TEXT)
    lengths = np.linspace(0.5, 2.0, 4)
    table = scene.sweep(L=lengths)
    assert set(table["status"]) == {"done"} and len(table) == 4
    for length in lengths:
        run = kt.Scene(TEXT, set={"L": length}).run(interval=0.01)
        angle = run["position.arm"] - np.pi / 2
        crossings = run.time[1:][(angle[:-1] > 0) & (angle[1:] <= 0)]
        period, expected = np.diff(crossings).mean(), 2 * np.pi * np.sqrt(length / 9.81)
        print(f"{length:.2f} m: {period:.3f} s, in closed form {expected:.3f} s")
        assert abs(period - expected) < 2e-3 * expected


if __name__ == "__main__":
    main()
