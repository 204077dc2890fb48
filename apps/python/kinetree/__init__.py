"""Kinetree: mechanisms in minimal coordinates.

    import kinetree as kt
    scene = kt.load("four-bar.yaml")
    run = scene.run(duration=5)
    run["position.crank"]

`load` reads scenes and robots. A `Scene` runs, sweeps, draws, and compiles its `Model`. `Model.data` evaluates dynamics at a
state, `Scene.simulation` is a control loop, `Model.batch` computes many states at once. `ffi` and `lib` are the C interface
itself: every public function, without checks of sizes.
"""
# SPDX-License-Identifier: Apache-2.0
from typing import TYPE_CHECKING

from . import callbacks as _callbacks  # noqa: F401 (defines the functions that C calls)
from . import command
from ._core import ArgumentError, Busy, ConstraintError, Error, FileError, KinetreeWarning, ModelError, SceneError, StepError, text as _text
from ._kinetree import ffi, lib
from .batch import Batch
from .callbacks import Compiled, End, JointForce, PointForce
from .data import Data
from .laws import Feedback, Instant
from .gradients import Gradient
from .identification import BaseParameters
from .ensemble import ensemble
from .mechanism import Body, mechanism, prismatic, revolute, rod
from .model import Model, ModelCopy, integrators
from .recording import Recording
from .records import Run, Table
from .results import Page, Picture
from .scene import Scene, load
from .simulation import Simulation

if TYPE_CHECKING:
    from ._types import effect, joint, loop, shape  # with the keywords of each type
else:
    from .mechanism import effect, joint, loop, shape

__version__ = _text(lib.kt_version())

__all__ = ["ArgumentError", "BaseParameters", "Batch", "Body", "Busy", "Compiled", "ConstraintError", "Data", "End", "Error", "Feedback", "FileError", "Gradient", "Instant",
           "JointForce", "KinetreeWarning", "Model", "ModelCopy", "ModelError", "Page", "Picture", "PointForce", "Recording", "Run", "Scene", "SceneError", "Simulation", "StepError", "Table",
           "command", "effect", "ensemble", "ffi", "integrators", "joint", "lib", "load", "loop", "mechanism", "prismatic", "revolute", "rod", "shape"]
