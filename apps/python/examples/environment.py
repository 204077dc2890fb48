"""An environment of 1,024 carts with poles, each with another pole, under one law."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np
from numpy.typing import NDArray

STATES = 1024


class Environment:
    """Observations and actions of all states at once. A state is done if its pole falls below 0.3 rad from upright."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng(seed)
        model = kt.mechanism([kt.Body("cart", joint=kt.prismatic("x"), mass=0.8, inertia=np.diag([0.01, 0.01, 0.01])),
                              kt.Body("pole", parent="cart", joint=kt.revolute("y"), mass=0.2, shape=kt.rod(to=[0, 0, 0.6]))], gravity=[0, 0, -9.81]).model
        self.batch = model.batch(STATES, method="rk4")
        for state, mass in enumerate(draw.uniform(0.1, 0.4, STATES)):
            own = model.copy()
            own.set("pole.mass", mass)
            self.batch.set_model(state, own)
        self.batch.q[:] = draw.uniform(-0.05, 0.05, self.batch.q.shape)
        self.batch.v[:] = 0.0

    def step(self, action: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Take ten steps of 2 ms with a force on each cart, N."""
        self.batch.tau[:, 0] = action
        self.batch.step(2e-3, 10)
        done: NDArray[np.bool_] = np.abs(self.batch.rows(self.batch.q)[:, 1]) > 0.3
        return done


def main() -> None:
    environment = Environment(seed=0)
    batch = environment.batch
    for _ in range(100):
        done = environment.step(30.0 * batch.q[:, 1] + 6.0 * batch.v[:, 1])
    print(STATES - np.count_nonzero(done), "of", STATES, "stand")
    assert not done.any()
    idle = Environment(seed=0)
    for _ in range(100):
        done = idle.step(np.zeros_like(idle.batch.tau[:, 0]))
    assert np.count_nonzero(done) > 0.9 * STATES


if __name__ == "__main__":
    main()
