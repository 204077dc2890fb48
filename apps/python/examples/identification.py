"""Base parameters of an arm from torques that a motion needs."""
# SPDX-License-Identifier: Apache-2.0
import kinetree as kt
import numpy as np


def main() -> None:
    model = kt.load("arm7").model
    data, draw = model.data(), np.random.default_rng(1)
    base = data.base_parameters()
    rows, torques = [], []
    for _ in range(60):
        q, v, a = draw.uniform(-1, 1, model.nq), draw.standard_normal(model.nv), draw.standard_normal(model.nv)
        rows.append(data.regressor(q, v, a)[:, base.columns])
        torques.append(data.inverse_dynamics(q, v, a) + 1e-3 * draw.standard_normal(model.nv))
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(torques), rcond=None)[0]
    true = base.matrix @ np.array(list(model.dynamic_parameters.values()))
    print(len(base.names), "base parameters, the first is", base.names[0])
    print("largest error:", f"{np.abs(found - true).max():.1e}")
    assert np.abs(found - true).max() < 1e-2


if __name__ == "__main__":
    main()
