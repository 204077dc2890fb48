"""Models (immutable) and data (the workspace of one thread)."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import callbacks
from ._core import (ArgumentError, Fixed, Guard, Memory, Numbers, Vector, apart, check, count, doubles, fail, ffi, hint, lib, mistyped, name_of, output, pointer, text)

if TYPE_CHECKING:
    from .batch import Batch
    from .data import Data
Point = Sequence[float]


class Model(Fixed):
    """A compiled mechanism. It is immutable, and threads may share it.

    Parameters
    ----------
    scene : Scene
    effects : list of JointForce or PointForce, optional
        Forces by functions, in addition to the effects of the scene.

    Attributes
    ----------
    nq, nv, nx : int
        Numbers of positions, velocities and auxiliary states.
    """

    def __init__(self, scene: Any, effects: Sequence[callbacks.Force] = ()) -> None:
        if not hasattr(scene, "_scene"):
            raise mistyped("scene", "a kinetree.Scene", scene)
        self.scene, self.effects = scene, callbacks.forces(effects)
        record = scene._scene
        options = ffi.new("kt_model_options *", lib.kt_model_options_default())
        options.metric, options.plan = record.run.metric, record.run.plan
        options.settable = lib.kt_scene_needs_settable(record)
        description = ffi.new("kt_description *", record.description)
        keep = self._with_effects(description)
        out, error = ffi.new("kt_model **"), ffi.new("kt_error *")
        status = lib.kt_model_compile(description, options, out, error)
        del keep
        if status:
            lib.kt_scene_locate(record, error)
            fail(error, status)
        self._set_up(ffi.gc(out[0], lib.kt_model_free, lib.kt_model_size(out[0])))

    def _set_up(self, compiled: Any) -> None:
        self._pointer = compiled
        self.nq: int = lib.kt_model_nq(compiled)
        self.nv: int = lib.kt_model_nv(compiled)
        self.nx: int = lib.kt_auxiliary_state_count(compiled)
        self.body_count: int = lib.kt_model_body_count(compiled)
        self._is_fixed = True

    def _with_effects(self, description: Any) -> Any:
        if not self.effects:
            return None
        count, texts = description.effect_count, []
        array = ffi.new("kt_effect[]", count + len(self.effects))
        for i in range(count):
            array[i] = description.effects[i]
        for i, effect in enumerate(self.effects):
            array[count + i] = lib.kt_effect_default()
            texts.append(effect.fill(array[count + i]))
        description.effects, description.effect_count = array, count + len(self.effects)
        return array, texts

    def __reduce__(self) -> Any:
        if self.effects:
            raise TypeError("a model with functions of Python cannot be pickled; pickle its scene")
        return _compiled, (self.scene,)

    def __deepcopy__(self, memo: Any) -> "Model":
        return self

    # ---- names ------------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The name of the scene."""
        return text(lib.kt_model_name(self._pointer)) or self.scene.name

    @property
    def bodies(self) -> List[str]:
        """Names of the bodies; the first is the world."""
        return [text(lib.kt_body_name(self._pointer, i)) for i in range(self.body_count)]

    @property
    def joints(self) -> Dict[str, Tuple[slice, slice]]:
        """The joints, and the slices of their coordinates in q and v."""
        found = {}
        for i in range(1, self.body_count):
            at = lib.kt_body_coordinates(self._pointer, i)
            found[text(lib.kt_joint_name(self._pointer, i))] = (slice(at.q, at.q + at.nq), slice(at.v, at.v + at.nv))
        return found

    @property
    def markers(self) -> List[str]:
        """The markers of all bodies, as ``"body.marker"``."""
        counts = [range(lib.kt_marker_count(self._pointer, body)) for body in range(self.body_count)]
        return [f"{name}.{text(lib.kt_marker_name(self._pointer, body, i))}" for body, name in enumerate(self.bodies) for i in counts[body]]

    @property
    def loops(self) -> Dict[str, str]:
        """The loops and their types, in the order of the scene. Hard contacts and friction that sticks are among them."""
        return {text(lib.kt_loop_name(self._pointer, i)): text(lib.kt_loop_type_name(lib.kt_loop_type_of(self._pointer, i)))
                for i in range(lib.kt_loop_count(self._pointer))}

    @property
    def equations(self) -> List[str]:
        """The loop of each equation, in the order of `Data.loop_equations` and `Data.multipliers`."""
        names = [text(lib.kt_loop_name(self._pointer, i)) for i in range(lib.kt_loop_count(self._pointer))]
        return [name for i, name in enumerate(names) for _ in range(lib.kt_loop_rows_of(self._pointer, i).count)]

    @property
    def effect_types(self) -> List[Tuple[str, str]]:
        """Name and type of each effect, in the order of the scene. An effect may have no name."""
        count = lib.kt_effect_count(self._pointer)
        types = [lib.kt_effect_type_of(self._pointer, i) for i in range(count)]
        return [(text(lib.kt_effect_name(self._pointer, i)), text(lib.kt_effect_type_name(types[i])) or "custom") for i in range(count)]

    @property
    def limits(self) -> Dict[str, Dict[str, float]]:
        """The design limits of joints that have some: ``lower`` and ``upper`` (rad, m), ``velocity`` (rad/s, m/s) and ``effort`` (N m, N).

        No motion depends on them: a stop is the effect ``joint_limit``.
        """
        found = {}
        for i in range(1, self.body_count):
            each = lib.kt_joint_limits_of(self._pointer, i)
            values = {"lower": each.lower, "upper": each.upper, "velocity": each.velocity, "effort": each.effort}
            if not all(np.isinf(value) for value in values.values()):
                found[text(lib.kt_joint_name(self._pointer, i))] = values
        return found

    @property
    def parameters(self) -> List[str]:
        """Names for `get`, `ModelCopy.set` and `Simulation.set`: gravity, and the numbers of bodies, effects and loops."""
        bodies = [f"{name}.{key}" for name in self.bodies[1:] for key in ("mass", "com", "inertia", "armature", "hold")]
        names = ["gravity", *bodies]
        for kind, table, describe in (("effect", self.effect_types, lib.kt_effect_descriptor), ("loop", list(self.loops.items()), lib.kt_loop_descriptor)):
            for name, each in table:
                names += [f"{kind} {name}.{key}" for key in _keys_of(each, describe) if name]
        return [name for name in names if self._has(name)]

    def _has(self, name: str) -> bool:
        found, error = ffi.new("kt_parameter *"), ffi.new("kt_error *")
        values = np.zeros(lib.KT_PARAMETER_MAX)
        if lib.kt_parameter_find(self._pointer, name_of(name, "parameter"), found, error):
            return False
        return bool(found.count) and not lib.kt_parameter_get(self._pointer, found, pointer(values), error)

    @property
    def dynamic_parameters(self) -> Dict[str, float]:
        """The parameters of `Data.regressor` and their values, such as ``"Izz(arm)"``: kg, kg m, kg m^2. Inertias are about the origin of the body."""
        from .identification import parameter_names
        values = np.zeros(lib.kt_regressor_columns(self._pointer))
        lib.kt_regressor_parameters(self._pointer, pointer(values))
        return dict(zip(parameter_names(self._pointer), values.tolist()))

    def body(self, name: str) -> int:
        """The index of a body, for calls of `kinetree.lib`.

        Parameters
        ----------
        name : str
            The name of the body; ``"world"`` is 0.
        """
        found: int = lib.kt_body_find(self._pointer, name_of(name, "body"))
        if found < 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "body", f"there is no body '{name}'{hint(name, self.bodies)}")
        return found

    def _frame(self, name: str) -> Tuple[int, int]:
        """Body and marker of ``"body.marker"``; marker -1 of a body."""
        body, _, marker = name.rpartition(".") if isinstance(name, str) else ("", "", "")
        if not body:
            return self.body(name), -1
        at = self.body(body)
        found: int = lib.kt_marker_find(self._pointer, at, name_of(marker, "marker"))
        if found < 0:
            names = [text(lib.kt_marker_name(self._pointer, at, i)) for i in range(lib.kt_marker_count(self._pointer, at))]
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "point", f"body '{body}' has no marker '{marker}'{hint(marker, names)}")
        return at, found

    def point(self, name: str) -> Tuple[int, Vector]:
        """Body and place of a marker, or of the origin of a body.

        Parameters
        ----------
        name : str
            ``"body.marker"`` or ``"body"``.

        Returns
        -------
        tuple
            The index of the body, and three numbers in its frame, m.
        """
        body, marker = self._frame(name)
        return body, np.zeros(3) if marker < 0 else vector(lib.kt_marker_at(self._pointer, body, marker))

    @property
    def initial(self) -> Tuple[Vector, Vector]:
        """Positions (nq; rad, m) and velocities (nv; rad/s, m/s) that the description gives. Loops may be open there."""
        q, v = np.zeros(self.nq), np.zeros(self.nv)
        lib.kt_model_initial(self._pointer, pointer(q), pointer(v))
        return q, v

    @property
    def initial_x(self) -> Vector:
        """Auxiliary states that the description gives, nx."""
        x = np.zeros(self.nx)
        lib.kt_auxiliary_states_initial(self._pointer, pointer(x))
        return x

    # ---- parameters -------------------------------------------------------------------------------------------------

    def copy(self) -> "ModelCopy":
        """A copy whose parameters can be set. It serves one simulation, the latest that was made with it, or the data of one thread."""
        return ModelCopy(self)

    def _parameter(self, name: str) -> Any:
        found, error = ffi.new("kt_parameter *"), ffi.new("kt_error *")
        check(lib.kt_parameter_find(self._pointer, name_of(name, "parameter"), found, error), error)
        return found

    def get(self, name: str) -> Union[float, Vector]:
        """The value of a parameter.

        Parameters
        ----------
        name : str
            Such as ``"arm.mass"``, ``"arm.com"``, ``"gravity"``, or ``"effect spring.stiffness"`` of the effect ``spring``.

        Returns
        -------
        float or numpy.ndarray
            In SI units and radians; an array if the parameter has several numbers.
        """
        found, error = self._parameter(name), ffi.new("kt_error *")
        values = np.zeros(lib.KT_PARAMETER_MAX)
        check(lib.kt_parameter_get(self._pointer, found, pointer(values), error), error)
        return float(values[0]) if found.count == 1 else values[:found.count].copy()

    # ---- coordinates ------------------------------------------------------------------------------------------------

    def add(self, q: Numbers, dv: Numbers, out: Optional[Vector] = None) -> Vector:
        """Move positions along the exponential maps of the joints: q (+) dv. Quaternions keep their norm.

        Parameters
        ----------
        q, dv : arrays of nq and nv
            Positions and their change, rad or m.
        out : array of nq, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nq positions, rad or m.
        """
        out = output(out, (self.nq,))
        apart(out, (q, dv))
        q, dv = doubles(q, (self.nq,), "q"), doubles(dv, (self.nv,), "dv")
        lib.kt_position_add(self._pointer, pointer(q), pointer(dv), pointer(out))
        return out

    def subtract(self, end: Numbers, q: Numbers, out: Optional[Vector] = None) -> Vector:
        """The difference of two positions, the inverse of `add`: ``add(q, subtract(end, q))`` is `end`.

        Parameters
        ----------
        end, q : arrays of nq
            Positions, rad or m.
        out : array of nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv numbers, rad or m.
        """
        out = output(out, (self.nv,))
        apart(out, (end, q))
        end, q = doubles(end, (self.nq,), "end"), doubles(q, (self.nq,), "q")
        lib.kt_position_subtract(self._pointer, pointer(end), pointer(q), pointer(out))
        return out

    # ---- what computes ----------------------------------------------------------------------------------------------

    def data(self) -> Data:
        """A workspace for evaluations. Each thread needs its own."""
        from .data import Data
        return Data(self)

    def batch(self, states: int, threads: int = 1, method: Optional[str] = None) -> Batch:
        """Many states of this model at once. See `Batch`.

        Parameters
        ----------
        states : int
            How many states.
        threads : int
            Threads that share the work.
        method : str, optional
            An explicit Runge-Kutta method for `Batch.step`, such as ``"rk4"``.
        """
        from .batch import Batch
        return Batch(self, states, threads, method)

    @property
    def pointer(self) -> Any:
        """The ``const kt_model *`` for calls of `kinetree.lib`. It is valid as long as this object."""
        return self._pointer

    def __repr__(self) -> str:
        return f"<kinetree.Model '{self.name}': {count(self.body_count - 1, 'body', 'bodies')}, nq {self.nq}, nv {self.nv}>"


def _compiled(scene: Any, values: Optional[Dict[str, Vector]] = None) -> Model:
    model: Model = scene.model
    if values is None:
        return model
    copy = model.copy()
    for name, value in values.items():
        copy.set(name, value)
    return copy


class ModelCopy(Model):
    """A model with parameters of its own. It serves one simulation, the latest that was made with it, or the data of one thread."""

    def __init__(self, model: Model) -> None:
        self.scene, self.effects = model.scene, model.effects
        self._original = model  # it owns what this copy refers to
        self._values: Dict[str, Vector] = dict(model._values) if isinstance(model, ModelCopy) else {}
        self._memory = Memory(lib.kt_model_size(model._pointer))
        out, error = ffi.new("kt_model **"), ffi.new("kt_error *")
        check(lib.kt_model_copy(model._pointer, self._memory.pointer, self._memory.array.size, out, error), error)
        self._served: Optional[Guard] = None  # of the simulation that has this copy
        self._set_up(out[0])

    def _serve(self, guard: Guard) -> None:
        """Serve a simulation. Its parameters would change those of an earlier one, which is busy from now on."""
        if self._served is not None:
            self._served.__enter__()
        self._served = guard

    def __reduce__(self) -> Any:
        super().__reduce__()  # rejects functions of Python
        return _compiled, (self.scene, self._values)

    def __deepcopy__(self, memo: Any) -> "ModelCopy":
        return ModelCopy(self)

    def set(self, name: str, value: Numbers) -> None:
        """Set a parameter, such as ``set("arm.mass", 2.0)``.

        A new mass leaves ``"arm.com"`` and ``"arm.inertia"`` as they are, also if they came from a shape.

        Parameters
        ----------
        name : str
            As in `get`.
        value : float or array
            In SI units and radians.
        """
        found, values, error = *self._given(name, value), ffi.new("kt_error *")
        check(lib.kt_parameter_set(self._pointer, found, pointer(values), error), error)
        self._remember(name, values)

    def _given(self, name: str, value: Numbers) -> Tuple[Any, Vector]:
        """A parameter, and its new numbers."""
        found = self._parameter(name)
        return found, doubles(value, (found.count,), f"value of '{name}'")

    def _remember(self, name: str, values: Vector) -> None:
        """Keep what was set, the latest last: pickle sets it again."""
        self._values.pop(name, None)
        self._values[name] = values.copy()


def _keys_of(kind: str, describe: Any) -> List[str]:
    """The keys of a type, and the place of a loop."""
    for value in range(64):
        each = describe(value)
        if each != ffi.NULL and text(each.name) == kind:
            return [text(each.keys[i].name) for i in range(each.key_count)] + (["place"] if describe == lib.kt_loop_descriptor else [])
    return []


def integrators() -> Dict[str, str]:
    """The methods of integration and their families, as ``kinetree integrators`` lists them."""
    methods = [lib.kt_method_at(k) for k in range(lib.kt_method_count())]
    return {text(each.name): text(lib.kt_method_family_name(each)) for each in methods}


def vector(at: Any, out: Optional[Vector] = None) -> Vector:
    out = output(out, (3,))
    out[:] = at.x, at.y, at.z
    return out


def vector3(at: Any) -> Any:
    return ffi.new("kt_vec3 *", doubles(at, (3,), "at").tolist())[0]


class State:
    """Arrays q, v, tau and a at fixed addresses: views of one block, which cannot be resized."""

    def __init__(self, nq: int, nv: int) -> None:
        counts = (nq, nv, nv, nv)
        self.memory = Memory(8 * sum(counts))
        numbers = self.memory.array.view(np.float64)
        ends = itertools.accumulate(counts)
        self.arrays = [numbers[end - count:end] for count, end in zip(counts, ends)]
        self.pointers = [pointer(array) for array in self.arrays]
