"""A robot with four legs stands on the floor: its joints are held by a law, and contacts carry its weight."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np
from numpy.typing import NDArray


def robot() -> kt.Scene:
    bodies = [kt.Body("trunk", joint=kt.joint.free(position={"position": [0, 0, 0.399]}), mass=6, shape=kt.shape.box(size=[0.5, 0.3, 0.1]))]
    feet = []
    for name, x, y in (("fl", 0.2, 0.15), ("fr", 0.2, -0.15), ("hl", -0.2, 0.15), ("hr", -0.2, -0.15)):
        bodies.append(kt.Body(f"hip_{name}", parent="trunk", joint=kt.revolute("y", at=[x, y, 0]), mass=0.5, shape=kt.rod(to=[0, 0, -0.2])))
        bodies.append(kt.Body(f"knee_{name}", parent=f"hip_{name}", joint=kt.revolute("y", at=[0, 0, -0.2]), mass=0.3, shape=kt.rod(to=[0, 0, -0.18]),
                              markers={"foot": [0, 0, -0.18]}))
        feet.append(kt.effect.contact(name=f"foot_{name}", point=f"knee_{name}.foot", plane="world", axis="z", radius=0.02, stiffness=2e4, exponent=1,
                                      dissipation=0.5, friction=0.8))
    return kt.mechanism(bodies, effects=feet, gravity=[0, 0, -9.81], simulate={"duration": 2})


def main() -> None:
    scene = robot()
    simulation = scene.simulation(step=1e-3, integrator="radau5")
    posture = simulation.positions.copy()

    def law(t: float, q: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([np.zeros(6), 150.0 * (posture[7:] - q[7:]) - 4.0 * v[6:]])

    simulation.control(law)
    contacts = simulation.data().contacts()
    weight = 9.81 * simulation.data().mass_center()[0]
    carried = sum(each["force"][2] for each in contacts)
    print(f"{len(contacts)} feet carry {carried:.1f} N of {weight:.1f} N at a height of {simulation.positions[2]:.3f} m")
    assert len(contacts) == 4 and abs(carried - weight) < 1e-3 * weight and np.abs(simulation.velocities).max() < 1e-3


if __name__ == "__main__":
    main()
