"""Functions of Python that C calls: reports of faults, records, events and effects."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import ctypes
from typing import Any, Callable, List, Optional, Sequence, Tuple, TypeVar, Union

import numpy as np

from ._core import ArgumentError, Numbers, Vector, doubles, ffi, lib, mistyped, name_of, number, text, unmasked

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Calls:
    """What C callbacks of one object need: the functions, and the first exception that one of them raised."""

    def __init__(self) -> None:
        self.raised: Optional[BaseException] = None

    def reraise(self) -> None:
        """Raise the exception of a callback in the call that led to it."""
        if self.raised is not None:
            raised, self.raised = self.raised, None
            raise raised


def _keep_raised(_: Any, raised: BaseException, traceback: Any) -> None:
    """Keep the exception of a callback, since Python cannot unwind through C. A signal may raise one before the first line of the callback."""
    ffi.from_handle(traceback.tb_frame.f_locals["user"]).calls.raised = raised


def _extern(**options: Any) -> Callable[[_Function], _Function]:
    """Makes a function of Python the one of its name in C."""
    made: Callable[[_Function], _Function] = ffi.def_extern(**options)
    return made


@_extern()
def kt_python_report(user: Any, fault: Any) -> None:
    faults: List[Tuple[str, str]] = ffi.from_handle(user)
    faults.append((text(fault.where), text(fault.message)))


@_extern(error=-1, onerror=_keep_raised)
def kt_python_recorder(record: Any, user: Any) -> int:
    return 1 if ffi.from_handle(user).take(record) else 0


@_extern(error=False, onerror=_keep_raised)
def kt_python_ensemble_next(user: Any, may_block: bool, member: Any) -> bool:
    found: bool = ffi.from_handle(user).next(member)
    return found


@_extern(onerror=_keep_raised)
def kt_python_ensemble_done(user: Any, member: Any, status: int, error: Any) -> None:
    ffi.from_handle(user).done(member, status, error)


@_extern(error=-1, onerror=_keep_raised)
def kt_python_event_value(at: Any, value: Any, error: Any, user: Any) -> int:
    event = ffi.from_handle(user)
    if event.calls.raised is not None:  # the engine repeats a search that has failed; a signal raises only once
        return -1
    value[0] = number(event.function(event.instant(at)), "the result of the event")
    return 0


@_extern(error=-1, onerror=_keep_raised)
def kt_python_event_action(simulation: Any, what: Any, error: Any, user: Any) -> int:
    return 1 if ffi.from_handle(user).act() else 0


@_extern(error=-1, onerror=_keep_raised)
def kt_python_joint_force(user: Any, t: float, q: float, v: float, force: Any, balance: Any) -> int:
    force[0] = number(ffi.from_handle(user).function(t, q, v), "the result of the force")
    return 0


@_extern(error=-1, onerror=_keep_raised)
def kt_python_wrench(user: Any, t: float, ends: Any, wrenches: Any, balance: Any) -> int:
    rows = ffi.from_handle(user).wrenches(t, ends)
    ffi.memmove(wrenches, rows, rows.nbytes)
    return 0


@_extern(error=-1, onerror=_keep_raised)
def kt_python_control_law(user: Any, t: float, q: Any, v: Any, tau: Any) -> int:
    return int(ffi.from_handle(user).turn(t))


@_extern(error=-1, onerror=_keep_raised)
def kt_python_cost(at: Any, value: Any, by_state: Any, by_tau: Any, user: Any) -> int:
    ffi.from_handle(user).evaluate(at, value, by_state, by_tau)
    return 0


class Compiled:
    """The address of a compiled function, for `JointForce`, `PointForce`, `Simulation.control` and `Simulation.on`.

    Functions of `numba.cfunc` and of ctypes need no wrapper. A plain number is rejected, since a wrong one would crash.

    Parameters
    ----------
    address : int
        The address of a function with the right signature, which nothing checks.
    owner : object, optional
        An object that must live as long as the function, such as its library.
    """

    def __init__(self, address: int, owner: Any = None) -> None:
        if isinstance(address, bool) or not isinstance(address, int) or not 0 < address < 1 << 64:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "address", f"expected an address, got {address!r}")
        self.address, self.owner = address, owner


# The arguments of compiled functions: a double (d), an array of doubles (D), or another address (p). Each returns an int.
LAW, EVENT, JOINT_FORCE, WRENCH = "pdDDD", "pDpp", "pdddDp", "pdppp"
_WORDS = {"d": "double", "D": "double *", "p": "void *", "i": "int"}


def _is_kind(kind: str, given: Any) -> bool:
    """Whether an argument's type, of numba or of ctypes, is of this kind. A pointer without a type fits all pointers."""
    if isinstance(given, type):  # of ctypes
        target = getattr(given, "_type_", None)
        is_pointer = issubclass(given, ctypes._Pointer)
        untyped, is_double = given in (ctypes.c_void_p, ctypes.c_char_p), given is ctypes.c_double
        to_double, is_int = is_pointer and target is ctypes.c_double, given is ctypes.c_int
    else:
        target = getattr(given, "dtype", None)
        untyped, is_double, is_int = str(given) in ("void*", "none*"), str(given) == "float64", str(given) == "int32"
        is_pointer = target is not None and not is_double
        to_double = is_pointer and str(target) == "float64"
    return {"d": is_double, "i": is_int, "D": untyped or to_double, "p": untyped or is_pointer}[kind]


def _check_signature(function: Any, kinds: str, what: str) -> None:
    """Reject a compiled function of another type, which would read or write the wrong memory."""
    signature = getattr(function, "_sig", None)
    if signature is not None and hasattr(signature, "return_type"):
        given, result = list(signature.args), signature.return_type
    elif isinstance(function, ctypes._CFuncPtr) and function.argtypes is not None:  # type: ignore[attr-defined]
        given, result = list(function.argtypes), function.restype
    else:
        return
    if len(given) != len(kinds) or not all(map(_is_kind, kinds, given)) or not _is_kind("i", result):
        names = ", ".join(getattr(each, "__name__", str(each)) for each in given)
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a function int ({', '.join(_WORDS[kind] for kind in kinds)}), got "
                            f"{getattr(result, '__name__', result)} ({names})")


def address_of(function: Any, what: str, kinds: str) -> Optional[int]:
    """The address of a compiled function with these arguments. None: it is a function of Python."""
    found = getattr(function, "address", None)
    _check_signature(function, kinds, what)
    if isinstance(found, int):
        return found
    if isinstance(function, ctypes._CFuncPtr):  # type: ignore[attr-defined]
        return ctypes.cast(function, ctypes.c_void_p).value
    if callable(function):
        return None
    wrapped = " (wrap an address: kinetree.Compiled(address))" if isinstance(function, int) else ""
    raise mistyped(what, f"a function{wrapped}", function)


class Force:
    """An effect whose force a function computes. `JointForce` and `PointForce` are the two kinds."""

    _compiled_as = _kinds = ""  # the type of a compiled function, and its arguments

    def __init__(self, function: Any, name: Optional[str]) -> None:
        if name is not None:
            name_of(name, "name")
        self.function, self.name = function, name
        self.address = address_of(function, "function", self._kinds)
        self.calls = Calls()
        self._handle = ffi.new_handle(self)  # of all models with this effect
        self._texts: List[Any] = []

    def _text(self, word: str, what: str) -> Any:
        self._texts.append(ffi.new("char[]", name_of(word, what)))
        return self._texts[-1]

    def fill(self, effect: Any) -> List[Any]:
        """Write this effect to a ``kt_effect``.

        Parameters
        ----------
        effect : cffi pointer
            The ``kt_effect``, with default values.

        Returns
        -------
        list
            Texts that must live until the model is compiled.
        """
        self._texts = []
        effect.type = lib.KT_EFFECT_CUSTOM
        if self.name is not None:
            effect.name = self._text(self.name, "name")
        if self.address is None:
            effect.user = self._handle
        self._place(effect)
        return self._texts

    def _place(self, effect: Any) -> None:
        raise NotImplementedError

    def _called(self, in_python: Any) -> Any:
        """The function that C calls."""
        return in_python if self.address is None else ffi.cast(self._compiled_as, self.address)


class JointForce(Force):
    """A force or torque in one joint coordinate by a function ``force(t, q, v)``.

    Parameters
    ----------
    joint : str
        The joint, as ``joint`` of an effect in a scene.
    function : callable
        A function of Python (slow: the engine calls it at each evaluation), or a compiled
        ``int f(void *user, double t, double q, double v, double *force, kt_effect_balance *balance)`` of ``numba.cfunc``, ctypes, or `Compiled`.
        Units: t in s, q in rad or m, v in rad/s or m/s, force in N m or N.
    name : str, optional
        The name of the effect in records and messages.
    """

    _compiled_as, _kinds = "kt_effect_joint_force_callback *", JOINT_FORCE

    def __init__(self, joint: str, function: Union[Callable[[float, float, float], float], Compiled, Any], name: Optional[str] = None) -> None:
        super().__init__(function, name)
        name_of(joint, "joint")
        self.joint = joint

    def _place(self, effect: Any) -> None:
        effect.joint = self._text(self.joint, "joint")
        effect.joint_force = self._called(lib.kt_python_joint_force)


class End:
    """The motion of a point on which a `PointForce` acts, along world axes.

    Attributes
    ----------
    axes : array of 3 x 3
        The rotation matrix of the frame of the point; its columns are the axes.
    point, velocity : arrays of 3
        The place, m, and the velocity, m/s.
    omega : array of 3
        The angular velocity, rad/s.
    """

    __slots__ = ("axes", "point", "omega", "velocity")

    def __init__(self, numbers: Vector) -> None:
        self.axes, self.point, self.omega, self.velocity = numbers[:9].reshape(3, 3).T, numbers[9:12], numbers[12:15], numbers[15:]


class PointForce(Force):
    """A force on a point, or between two points, by a function ``force(t, ends)``.

    Parameters
    ----------
    points : list of str or tuple
        One or two of ``"body"``, ``"body.marker"``, or (body, place in the frame of the body, m).
    function : callable
        A function of Python (slow: the engine calls it at each evaluation) of the time, s, and a list with an `End` for each point. It returns
        a row for each point: the force (3), N, or the moment and the force (6), N m and N, along world axes. Or a compiled
        ``int f(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance)``, as in `JointForce`.
    name : str, optional
        The name of the effect in records and messages.
    """

    _compiled_as, _kinds = "kt_effect_wrench_callback *", WRENCH

    def __init__(self, points: Sequence[Union[str, Tuple[str, Numbers]]], function: Union[Callable[[float, List[End]], Numbers], Compiled, Any],
                 name: Optional[str] = None) -> None:
        super().__init__(function, name)
        if not isinstance(points, (list, tuple)) or len(points) not in (1, 2):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "points", f"expected a list of one or two points, got {points!r}")
        self.points = list(points)

    def _place(self, effect: Any) -> None:
        effect.end_count = len(self.points)
        for end, point in zip(effect.between, self.points):
            if isinstance(point, str):
                body, _, marker = point.rpartition(".")
                end.body = self._text(body or marker, "points")
                if body:
                    end.marker = self._text(marker, "points")
            elif isinstance(point, (list, tuple)) and len(point) == 2:
                end.body = self._text(point[0], "points")
                end.at.x, end.at.y, end.at.z = (float(each) for each in doubles(point[1], (3,), "points"))
            else:
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, "points", f'expected "body", "body.marker" or (body, place in its frame), got {point!r}')
        effect.wrench = self._called(lib.kt_python_wrench)

    def wrenches(self, t: float, ends: Any) -> Vector:
        """The moment and the force on each point.

        Parameters
        ----------
        t : float
            Time, s.
        ends : cffi pointer
            The ``kt_effect_end`` of each point.

        Returns
        -------
        numpy.ndarray
            points x 6, N m and N.
        """
        count = len(self.points)
        motion = np.frombuffer(ffi.buffer(ends, count * ffi.sizeof("kt_effect_end")), np.float64).copy().reshape(count, -1)
        returned = self.function(t, [End(row) for row in motion])
        unmasked(returned, "the result of the force")
        found = np.asarray(returned)
        if count == 1 and found.shape in ((3,), (6,)):
            found = found[None]
        if found.shape not in ((count, 3), (count, 6)) or found.dtype.kind not in "biuf":
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "the result of the force", f"expected numbers of shape ({count}, 3) or ({count}, 6), got {found.shape}")
        out = np.zeros((count, 6))
        out[:, 6 - found.shape[1]:] = found
        return out


def forces(effects: Any) -> Tuple[Force, ...]:
    """The effects of a list, which has no other objects."""
    if not isinstance(effects, (list, tuple)) or not all(isinstance(each, Force) for each in effects):
        raise mistyped("effects", "a list of JointForce and PointForce", effects)
    return tuple(effects)
