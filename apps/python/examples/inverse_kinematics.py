"""A five-bar linkage draws a circle: its loops stay closed, and its tip is on the circle."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np


def linkage() -> kt.Scene:
    """Two arms of two links each, from (0, 0) and (0.4, 0) to a common tip."""
    left = kt.Body("left", joint=kt.revolute("z", position=2.0), mass=1, shape=kt.rod(to=[0.5, 0, 0]))
    left2 = kt.Body("left2", parent=left, joint=kt.revolute("z", at=[0.5, 0, 0], position=-1.2), mass=1, shape=kt.rod(to=[0.7, 0, 0]), markers={"tip": [0.7, 0, 0]})
    right = kt.Body("right", joint=kt.revolute("z", at=[0.4, 0, 0], position=1.1), mass=1, shape=kt.rod(to=[0.5, 0, 0]))
    right2 = kt.Body("right2", parent=right, joint=kt.revolute("z", at=[0.5, 0, 0], position=1.2), mass=1, shape=kt.rod(to=[0.7, 0, 0]), markers={"tip": [0.7, 0, 0]})
    return kt.mechanism([left, left2, right, right2], loops=[kt.loop.revolute(name="tip", between=["left2.tip", "right2.tip"], axis="z")])


def main() -> None:
    data = linkage().model.data()
    data.assemble()
    q, worst, gap = data.q.copy(), 0.0, 0.0
    for angle in np.linspace(0.0, 2.0 * np.pi, 37):
        q, distance = data.inverse_kinematics({"left2.tip": [0.2 + 0.1 * np.cos(angle), 0.9 + 0.1 * np.sin(angle), 0.0]}, q)
        worst, gap = max(worst, distance), max(gap, float(np.abs(data.loop_equations(q)["residual"]).max()))
    print(f"farthest from the circle {worst:.1e} m, open loops {gap:.1e} m")
    assert worst < 1e-9 and gap < 1e-9
    _, distance = data.inverse_kinematics({"left2.tip": [0.2, 2.0, 0.0]}, q)
    print(f"a target out of reach is missed by {distance:.3f} m")
    assert 0.8 < distance < 0.9


if __name__ == "__main__":
    main()
