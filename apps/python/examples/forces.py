"""A force of one's own: the wind on a swinging sign, against the effect of the engine."""
# SPDX-License-Identifier: Apache-2.0
from typing import Any, Dict, List

import kinetree as kt
import numpy as np
from numpy.typing import NDArray

SIGN = [kt.Body("sign", joint=kt.revolute("y", position=0.4), mass=2, shape=kt.rod(to=[0, 0, -1]), markers={"edge": [0, 0, -1]})]


def drag(t: float, ends: List[kt.End]) -> NDArray[np.float64]:
    return np.asarray(-0.7 * ends[0].velocity)


def main() -> None:
    options: Dict[str, Any] = {"gravity": [0, 0, -9.81], "simulate": {"duration": 2, "tolerance": 1e-9}}
    own = kt.mechanism(SIGN, **options).simulation(effects=[kt.PointForce(["sign.edge"], drag)])
    engine = kt.mechanism(SIGN, effects=[kt.effect.drag(on="sign.edge", linear=0.7)], **options).simulation()
    for simulation in (own, engine):
        simulation.advance(2.0)
    print("difference:", f"{np.abs(own.state - engine.state).max():.1e}")
    assert np.abs(own.state - engine.state).max() < 1e-7


if __name__ == "__main__":
    main()
