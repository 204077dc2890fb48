"""The drive of a four-bar linkage: its torque from the multiplier, and the load on its bearings."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np


def main() -> None:
    model = kt.load("four-bar").model
    data = model.data()
    data.assemble()
    a = data.forward_dynamics()
    equations, multipliers = data.loop_equations(), data.multipliers()
    left = data.inverse_dynamics() - data.effect_forces() - equations["jacobian"].T @ multipliers
    joints, loops = data.reactions()
    print("largest bearing load:", f"{np.linalg.norm(joints[1:, 3:], axis=1).max():.1f} N, in the loop {np.linalg.norm(loops[0, 3:]):.1f} N")
    print("imbalance:", f"{np.abs(left).max():.1e} N m")
    assert np.abs(left).max() < 1e-9 and np.abs(equations["jacobian"] @ a - equations["drift"]).max() < 1e-9


if __name__ == "__main__":
    main()
