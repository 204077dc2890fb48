"""The present model of a simulation, and the data of it."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

from ._core import ArgumentError, lib
from .data import Data
from .model import Model


class Present(Model):
    """The model of a simulation with the loops and effects that are on at this moment."""

    def __init__(self, model: Model, pointer: Any, owner: Any) -> None:
        self.scene, self.effects = model.scene, model.effects
        self._owners = model, owner
        self._set_up(pointer)

    def __reduce__(self) -> Any:
        raise TypeError("the present model of a simulation cannot be pickled; pickle the simulation")


class Stepped(Data):
    """Data of a simulation with ``contact: steps``, which has kinematics, and forces only over a step."""

    def _no_forces(self, *_: Any, **__: Any) -> Any:
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, "data", "the scene has 'contact: steps': its contacts act over a step, and have no force at a state; "
                            "simulation.acceleration() has that of the last step, and model.data() the mechanism without contacts")

    forward_dynamics = effect_forces = forward_derivatives = step = step_derivatives = _no_forces
