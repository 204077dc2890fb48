"""Errors, memory and arrays: the part that all other modules share."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import difflib
import errno
import math
import os
import sys
import warnings
from typing import TYPE_CHECKING, Any, Callable, Dict, NoReturn, Optional, Sequence, Tuple

import numpy as np

from ._kinetree import Lock, ffi as ffi, learn, lib as lib

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    Vector = NDArray[np.float64]
    Array = NDArray[Any]
    Numbers = ArrayLike  # an input: an array, a list, a number
else:
    Vector = Array = Numbers = np.ndarray
Json = Dict[str, Any]
Shape = Tuple[int, ...]

__all__ = ["Error", "ArgumentError", "FileError", "ModelError", "ConstraintError", "StepError", "SceneError", "Busy", "KinetreeWarning"]


class KinetreeWarning(UserWarning):
    """A doubtful number, a fallback or a moved value that a run reports."""


class Error(RuntimeError):
    """A call failed.

    Attributes
    ----------
    code : int
        The ``kt_status`` of the C interface, or the exit status of the command.
    where : str
        File, line and column, body, joint or time.
    message : str
        The fault and its remedy.
    """

    def __init__(self, code: int, where: str, message: str) -> None:
        super().__init__(f"{where}: {message}" if where else message)
        self.code, self.where, self.message = code, where, message

    def __reduce__(self) -> Any:
        return type(self), (self.code, self.where, self.message)


class ArgumentError(Error, ValueError):
    """An argument has a wrong value, shape or type. With a wrong type, the error is a `TypeError`, too."""


class _ArgumentTypeError(ArgumentError, TypeError):
    pass


def mistyped(what: str, expected: str, value: Any) -> ArgumentError:
    """The error of an argument whose type is wrong."""
    return _ArgumentTypeError(lib.KT_ERROR_ARGUMENT, what, f"expected {expected}, got {value!r}")


class SceneError(Error, ValueError):
    """The scene file, or the mechanism in it, is wrong."""


class FileError(Error, OSError):
    """A file cannot be read or written.

    A missing file is a `FileNotFoundError`, too, a file without permission a `PermissionError`, and a folder an `IsADirectoryError`.

    Attributes
    ----------
    errno : int or None
        The number of the system's error.
    filename : str or None
        The file.
    """

    def __init__(self, code: int, where: str, message: str) -> None:
        super().__init__(code, where, message)
        self.errno = next((number for number in _SYSTEM if os.strerror(number).lower() in message.lower()), None)  # type: ignore[arg-type]
        self.filename, self.strerror = where or None, os.strerror(self.errno) if self.errno else message

    def __str__(self) -> str:
        return f"{self.where}: {self.message}" if self.where else self.message

    def __reduce__(self) -> Any:
        return file_error, (self.code, self.where, self.message)


class _NoFileError(FileError, FileNotFoundError):
    pass


class _NoPermissionError(FileError, PermissionError):
    pass


class _FolderError(FileError, IsADirectoryError):
    pass


_SYSTEM = {errno.ENOENT: _NoFileError, errno.EACCES: _NoPermissionError, errno.EISDIR: _FolderError, errno.ENOTDIR: FileError, errno.ENOSPC: FileError,
           errno.EROFS: FileError}


def file_error(code: int, where: str, message: str) -> FileError:
    """The error of a file as the class of the system's error."""
    plain = FileError(code, where, message)
    kind = _SYSTEM.get(plain.errno or 0, FileError)
    return plain if kind is FileError else kind(code, where, message)


class ModelError(SceneError):
    """The description of the mechanism is wrong."""


class ConstraintError(Error):
    """The loops cannot be closed, or contradict each other."""


class StepError(Error):
    """The integration failed: a step became too small, or a value is not finite."""


class Busy(RuntimeError):
    """Another thread, or the call that runs a function of Python, uses the object at this moment. Give each thread its own data."""


for _kind in (_NoFileError, _NoPermissionError, _FolderError):
    _kind.__name__ = _kind.__qualname__ = "FileError"
_ArgumentTypeError.__name__ = _ArgumentTypeError.__qualname__ = "ArgumentError"
_ArgumentTypeError.__module__ = "kinetree"
for _name in __all__:  # a traceback shows the name that a program uses, kinetree.SceneError
    globals()[_name].__module__ = "kinetree"

_KINDS: Dict[int, Callable[[int, str, str], Error]] = {
    lib.KT_ERROR_ARGUMENT: ArgumentError,
    lib.KT_ERROR_MODEL: ModelError,
    lib.KT_ERROR_SCENE: SceneError,
    lib.KT_ERROR_SINGULAR: ModelError,
    lib.KT_ERROR_CONSTRAINT: ConstraintError,
    lib.KT_ERROR_NOT_FINITE: StepError,
    lib.KT_ERROR_STEP: StepError,
    lib.KT_ERROR_FILE: file_error,
}


_ARGUMENTS = {"t_end": "t", "t_limit": "until"}  # of the C interface, and their names here


def fail(error: Any, default: int = lib.KT_ERROR_ARGUMENT) -> NoReturn:
    """Raise the exception that a filled ``kt_error`` describes."""
    code, where = error.code or default, text(error.where)
    raise _KINDS.get(code, Error)(code, _ARGUMENTS.get(where, where), text(error.message))


def check(status: int, error: Any) -> None:
    if status:
        fail(error, status)


def text(pointer: Any) -> str:
    return "" if pointer == ffi.NULL else str(ffi.string(pointer).decode("utf8", "replace"))


_FOLDER = os.path.dirname(__file__)


def warn(what: str) -> None:
    """Issue a warning at the line of the program that called the package."""
    frame, level = sys._getframe(1), 2
    while frame is not None and os.path.dirname(frame.f_code.co_filename) == _FOLDER and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(what, KinetreeWarning, stacklevel=level)


def sentence(warning: Json) -> str:
    """A warning of the command in words: the fact and the remedy."""
    return ". ".join(part for part in (warning["what"], warning["remedy"]) if part)


def count(number: int, one: str, more: str) -> str:
    """``1 body``, ``2 bodies``."""
    return f"{number} {one if number == 1 else more}"


def hint(word: Any, names: Sequence[str]) -> str:
    """The end of a message about a name that does not exist: the nearest name, or the first ones."""
    near = difflib.get_close_matches(str(word), names, 1)
    return f"; did you mean '{near[0]}'?" if near else f"; there are {', '.join(names[:8]) or 'none'}"


def name_of(word: Any, what: str) -> bytes:
    """The bytes of a name; a name has no zero byte."""
    if not isinstance(word, str):
        raise mistyped(what, "a name as a str", word)
    if "\0" in word:
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a name without a byte of zero, got {word!r}")
    return encoded(word, what)


def encoded(word: str, what: str) -> bytes:
    """The bytes of a text. Half of a pair of surrogates is no character."""
    try:
        return word.encode("utf8")
    except UnicodeEncodeError as fault:
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"{word[fault.start]!r} at place {fault.start} of the text is no character: Unicode has it as "
                            "half of a pair only") from None


def method_of(word: Any, what: str) -> Any:
    """The method of this name."""
    found = lib.kt_method_find(name_of(word, what))
    if found != ffi.NULL:
        return found
    names = [text(lib.kt_method_at(k).name) for k in range(lib.kt_method_count())]
    near = difflib.get_close_matches(word, names, 1)
    guess = f"did you mean '{near[0]}'? There" if near else "there"
    raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"there is no method '{word}'; {guess} are {', '.join(names)}")


def check_file(name: str, path: Any) -> None:
    """Reject a name of a file for results that is no path, or standard output."""
    if path is not None and not isinstance(path, (str, bytes, os.PathLike)):
        raise mistyped(name, "a str or an os.PathLike", path)
    if path is not None and os.fsdecode(path) in ("-", "", "."):
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, f"the results are read back from files; name a file, or omit `{name}`")


def finite(value: Any, what: str, least: Optional[float] = None) -> float:
    """A finite number, at or above `least`."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise mistyped(what, "a number", value) from None
    if not math.isfinite(number) or (least is not None and number < least):
        bound = "" if least is None else f" of at least {least}"
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a finite number{bound}, got {number}")
    return number


class Fixed:
    """An object whose public attributes do not change after set-up: sizes and addresses that C relies on stay right."""

    _is_fixed = False
    _assignable: Tuple[str, ...] = ()  # arrays: an assignment copies into them

    def __setattr__(self, name: str, value: Any) -> None:
        if not self._is_fixed or name.startswith("_") or getattr(getattr(type(self), name, None), "fset", None):
            super().__setattr__(name, value)
        elif name in self._assignable:
            array = getattr(self, name)
            array[:] = doubles(value, array.shape, name)
        else:
            raise AttributeError(f"'{name}' of a {type(self).__name__} cannot be set")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"'{name}' of a {type(self).__name__} cannot be deleted")


_DOUBLES, _from_buffer = ffi.typeof("double[]"), ffi.from_buffer


class Memory:
    """Aligned memory that numpy owns. A view of it keeps it alive, so that no pointer outlives it."""

    __slots__ = ("array", "address", "pointer")

    def __init__(self, size: int) -> None:
        raw = np.zeros(size + lib.KT_ALIGNMENT, np.uint8)
        start = -raw.ctypes.data % lib.KT_ALIGNMENT
        self.array = raw[start:start + size]
        self.address = self.array.ctypes.data
        self.pointer = ffi.cast("void *", self.address)

    def view(self, pointer: Any, count: int) -> Vector:
        """A read-only view of `count` doubles in this memory."""
        found = self.strided(pointer, (count,), (8,))
        found.flags.writeable = False
        return found

    def strided(self, pointer: Any, shape: Shape, strides: Shape) -> Vector:
        """A writable view of doubles in this memory."""
        if 0 in shape:
            return np.zeros(shape)
        offset = address_number(pointer) - self.address
        last = offset + sum((count - 1) * stride for count, stride in zip(shape, strides))
        if offset < 0 or last + 8 > self.array.size:
            raise AssertionError("the pointer is outside the memory")
        return np.ndarray(shape, np.float64, self.array, offset, strides)


class Guard(Lock):  # type: ignore[misc]
    """Rejects a second thread while a call runs: two threads must not share a workspace.

    The flag is in C, so that calls that are made often can enter and leave without a call of Python for each. ``__enter__`` and
    ``__exit__`` are in C, so that a KeyboardInterrupt never leaves the guard held.
    """

    __slots__ = ("pointer",)

    def __init__(self) -> None:
        self.pointer = ffi.new("kt_python_guard *")
        self._hold(address_number(self.pointer))

    def _reject(self) -> None:
        raise busy()


def busy() -> Busy:
    return Busy("this object is in use: by another thread, or by the call that runs this function; give each thread its own data, "
                "and let the function return first. If simulations share a copy of a model, it serves the latest one: give each its own copy")


def doubles(value: Any, shape: Shape, what: str) -> Vector:
    """`value` as a C-contiguous array of doubles of this shape. It is not copied if it already is one."""
    if type(value) is np.ndarray and value.dtype == np.float64 and value.shape == shape and value.flags.c_contiguous:
        return value
    unmasked(value, what)
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":  # numpy would read texts, and drop imaginary parts
            raise TypeError
        array = np.asarray(array, np.float64, order="C")
    except (TypeError, ValueError):
        kind = f"an array of {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
        raise _ArgumentTypeError(lib.KT_ERROR_ARGUMENT, what, f"expected numbers of shape {shape}, got {kind}") from None
    if array.shape != shape:
        if shape == (0,) and array.size == 0:
            return np.zeros(0)
        if shape == () or array.size != int(np.prod(shape)) or array.ndim != 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected shape {shape}, got {array.shape}")
        array = array.reshape(shape)
    return array


def unmasked(value: Any, what: str) -> None:
    """Reject an array with masked values, whose numbers would count."""
    masked = int(np.count_nonzero(value.mask)) if isinstance(value, np.ma.MaskedArray) else 0
    if masked:
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"{masked} of {value.size} values are masked; replace them, as with "
                            "array.filled(0.0)")


def number(value: Any, what: str) -> float:
    """The number that a function of a program returns. A truth value is rejected: its value never passes through zero."""
    unmasked(value, what)
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "iuf":
        remedy = ", such as at.q[0] - 1.0 in place of at.q[0] > 1.0" if array.dtype.kind == "b" else ""
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a number{remedy}; got {value!r}")
    return float(array.reshape(()))


def output(out: Optional[Vector], shape: Shape, what: str = "out", order: str = "C") -> Vector:
    """`out` if it can be written to in place, or a new array."""
    if out is None:
        return np.empty(shape, order=order)  # type: ignore[call-overload, no-any-return]
    if not isinstance(out, np.ndarray):
        raise mistyped(what, f"an array of shape {shape}", out)
    if type(out) is not np.ndarray or out.dtype != np.float64 or out.shape != shape or not out.flags.writeable or \
            not (out.flags.c_contiguous if order == "C" else out.flags.f_contiguous):
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a writable array of float64 in {order} order of shape {shape}")
    return out


def outputs(out: Optional[Sequence[Vector]], shapes: Sequence[Shape], order: str = "C", inputs: Sequence[Any] = ()) -> Tuple[Vector, ...]:
    """`output` for a call with several results, which must not overlap. An output may be a whole input, and not a part of one."""
    if out is None:
        return tuple(output(None, shape, order=order) for shape in shapes)
    if not isinstance(out, (tuple, list)):
        raise mistyped("out", f"a tuple of {len(shapes)} arrays", out)
    if len(out) != len(shapes):
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, "out", f"expected a tuple of {len(shapes)} arrays")
    found = tuple(output(each, shape, f"out[{i}]", order) for i, (each, shape) in enumerate(zip(out, shapes)))
    for i, each in enumerate(found):
        apart(each, inputs, f"out[{i}]")
        for other in found[:i]:
            if np.may_share_memory(each, other):
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, f"out[{i}]", "it shares memory with another output; give each result an array of its own")
    return found


def apart(out: Vector, inputs: Sequence[Any], what: str = "out") -> Vector:
    """Reject an output that shares memory with a part of an input: the call would read what it has written."""
    for each in inputs:
        if isinstance(each, np.ndarray) and np.may_share_memory(out, each) and \
                (out.ctypes.data, out.shape, out.strides) != (each.ctypes.data, each.shape, each.strides):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, "it shares memory with a part of an input; give the result an array of its own")
    return out


_Array, _FLOAT = np.ndarray, np.dtype(np.float64)
_known = np.zeros((2, 3))
learn(_Array, _FLOAT, np.empty, _known, _known.ctypes.data, _known.flags.num)


def address(value: Any, shape: Shape, own: Any, what: str) -> Any:
    """The address of an input, which keeps its array alive; `own` if there is none. This path is short: control loops take it."""
    if value is None:
        return own
    if type(value) is _Array and value.dtype is _FLOAT and value.shape == shape:
        try:
            return _from_buffer(_DOUBLES, value)
        except (ValueError, BufferError):  # it is not contiguous
            pass
    return pointer(doubles(value, shape, what))


def address_number(of: Any) -> int:
    """The address in a pointer of cffi, for the functions of methods.c."""
    return int(ffi.cast("uintptr_t", of))


def pointer(array: Optional[Array]) -> Any:
    """The address of an array of doubles for a call. The caller keeps the array."""
    if array is None or array.size == 0:
        return ffi.NULL
    if array.ndim > 1 and not array.flags.c_contiguous:
        array = array.T  # of column-major order: the same numbers in the same places
    return _from_buffer(_DOUBLES, array)
