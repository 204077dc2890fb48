"""A ball that bounces: an event finds each impact, and its action turns the velocity round."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np


def main() -> None:
    scene = kt.mechanism([kt.Body("ball", joint=kt.prismatic("z", position=1.0), mass=1, inertia=np.diag([0.1, 0.1, 0.1]))], gravity=[0, 0, -9.81],
                         simulate={"duration": 1.4, "tolerance": 1e-9})
    simulation, times = scene.simulation(), []

    def bounce(at: kt.Simulation) -> None:
        times.append(at.time)
        at.jump(v=-0.8 * at.velocities)

    simulation.on("floor", lambda at: float(at.q[0]), bounce, direction="falling")
    simulation.advance(1.4)
    first = np.sqrt(2.0 / 9.81)
    expected = [first, first + 2 * 0.8 * first]
    print("impacts at", [f"{time:.6f} s" for time in times])
    assert len(times) == simulation.event_count("floor") == 2 and np.abs(np.array(times) - expected).max() < 1e-9


if __name__ == "__main__":
    main()
