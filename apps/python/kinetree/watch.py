"""The watch over a simulation: the rules of the command for the start, the steps and the energy."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
from typing import Any, List

from ._core import Json, ffi, lib, sentence, warn
from .model import Model


class Watch:
    """Takes states of a simulation, and gives the warnings of the command."""

    def __init__(self, model: Model, run: Any, simulation: Any, events: Any) -> None:
        self.warnings: List[Json] = []
        made = lib.kt_driven_create(model.scene._scene, model._pointer, run, simulation, events, bool(model.effects))
        if made == ffi.NULL:
            raise MemoryError
        self.pointer = ffi.gc(made, lib.kt_driven_free)

    def examine(self) -> List[Json]:
        """Judge the states so far. Returns the warnings that are new, and adds them to `warnings`."""
        found = lib.kt_driven_warnings(self.pointer, len(self.warnings))
        if found == ffi.NULL:
            raise MemoryError
        new: List[Json] = json.loads(ffi.string(found))
        lib.kt_driven_text_free(found)
        self.warnings += new
        return new

    def restart(self, is_supplied: bool) -> None:
        """A state or a parameter has changed, and the energy with it. Torques may supply energy."""
        lib.kt_driven_restart(self.pointer)
        if is_supplied:
            lib.kt_driven_supply(self.pointer)


def issue(found: List[Json]) -> None:
    """Issue warnings of the command as those of Python. The scene has issued its notes."""
    for each in found:
        if each["code"] != "left_out":
            warn(sentence(each))
