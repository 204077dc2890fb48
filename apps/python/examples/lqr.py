"""A linear-quadratic regulator balances a pole on a cart."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np
from numpy.typing import NDArray

CART = kt.Body("cart", joint=kt.prismatic("x"), mass=0.8, inertia=np.diag([0.01, 0.01, 0.01]))
POLE = kt.Body("pole", parent=CART, joint=kt.revolute("y", position=3.0), mass=0.2, shape=kt.rod(to=[0, 0, -0.6]))


def gain_of(A: NDArray[np.float64], B: NDArray[np.float64]) -> NDArray[np.float64]:
    """The gain that Riccati's equation of differences converges to."""
    P = Q = np.diag([10.0, 10.0, 1.0, 1.0])
    for _ in range(20000):
        K = np.linalg.solve(1.0 + B.T @ P @ B, B.T @ P @ A)
        P = Q + A.T @ P @ (A - B @ K)
    return K


def main() -> None:
    scene = kt.mechanism([CART, POLE], gravity=[0, 0, -9.81], simulate={"duration": 8})
    upright = np.array([0.0, np.pi])
    A, B = scene.model.data().step_derivatives(1e-3, upright, np.zeros(2), np.zeros(2))
    gain = np.vstack([gain_of(A, B[:, :1]), np.zeros(4)])
    simulation = scene.simulation(step=1e-3)
    simulation.control(simulation.feedback(gain, q=upright))
    print("angle from upright:", f"{abs(simulation.positions[1] - np.pi):.1e} rad")
    assert np.abs(simulation.state - [0.0, np.pi, 0.0, 0.0]).max() < 1e-3


if __name__ == "__main__":
    main()
