"""The torques that swing a pendulum up in a second with the least effort, by exact gradients of the motion."""
# SPDX-License-Identifier: Apache-2.0
from typing import Tuple

import kinetree as kt
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

STEPS, H = 100, 0.01
Vector = NDArray[np.float64]


def cost(step: int, t: float, q: Vector, v: Vector, tau: Vector) -> Tuple[float, Vector, Vector]:
    """Effort on the way, and the distance from rest in the upright position at the end, with gradients."""
    if step < STEPS:
        return 1e-3 * float(tau @ tau), np.zeros(2), 2e-3 * tau
    away = np.array([q[0] - np.pi, v[0]])
    return 50.0 * float(away @ away), 100.0 * away, np.zeros(1)


def main() -> None:
    model = kt.mechanism([kt.Body("arm", joint=kt.revolute("y"), mass=1, shape=kt.rod(to=[0, 0, -1]))], gravity=[0, 0, -9.81]).model
    data = model.data()

    def value(inputs: Vector) -> Tuple[float, Vector]:
        found = data.rollout_gradient(H, inputs.reshape(STEPS, 1), cost, q=[0.0], v=[0.0])
        return found.value, found.by_inputs.ravel()

    start = np.full(STEPS, 3.0)
    direction = np.random.default_rng(0).standard_normal(STEPS)
    slope = (value(start + 1e-6 * direction)[0] - value(start - 1e-6 * direction)[0]) / 2e-6
    exact = float(value(start)[1] @ direction)
    print(f"gradient against differences: {abs(slope - exact) / abs(exact):.0e}")
    assert abs(slope - exact) < 1e-6 * abs(exact)
    best = minimize(value, start, jac=True, method="L-BFGS-B", options={"maxiter": 300})
    simulation_q, simulation_v = np.zeros(1), np.zeros(1)
    for tau in best.x:
        simulation_q, simulation_v = data.step(H, simulation_q, simulation_v, [tau])
    print(f"end: {simulation_q[0]:.3f} rad, effort {float(best.x @ best.x) * H:.1f} (N m)^2 s")
    assert abs(simulation_q[0] - np.pi) < 0.05


if __name__ == "__main__":
    main()
