"""Regressors and base parameters: what measurements of a motion determine."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, List, NamedTuple, Optional

import numpy as np

from ._core import Array, Guard, Memory, Numbers, Vector, address, ffi, lib, output, pointer, text
from .model import Model

_KINDS = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "armature", "viscous", "coulomb")


class BaseParameters(NamedTuple):
    """The combinations of parameters that decide all joint forces: ``regressor @ parameters == regressor[:, columns] @ (matrix @ parameters)``.

    Attributes
    ----------
    names : list of str
        The combinations in words, such as ``"Izz(upper) + 0.25 m(lower)"``.
    columns : array of the number of combinations
        The column of the regressor that stands for each.
    matrix : array of combinations x parameters
        The coefficients.
    """

    names: List[str]
    columns: Array
    matrix: Vector


class Identification:
    """The part of `Data` for the identification of inertial parameters."""

    model: Model
    _m: Any
    _data: Any
    _error: Any
    _guard: Guard
    _q: Any
    _v: Any
    _a: Any

    def _check(self, status: Optional[int]) -> None:
        raise NotImplementedError

    def regressor(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, a: Optional[Numbers] = None, *, out: Optional[Vector] = None) -> Vector:
        """The regressor of the tree: ``regressor @ parameters`` are the joint forces for accelerations, without effects.

        Parameters
        ----------
        q, v, a : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), accelerations (rad/s^2, m/s^2). Default: the arrays of this object.
        out : array of nv x parameters, optional
            Where to write, in column-major order (``order="F"``). Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv x parameters, column-major. `Model.dynamic_parameters` lists names and values, in SI units.
        """
        m = self.model
        q, v, a = address(q, (m.nq,), self._q, "q"), address(v, (m.nv,), self._v, "v"), address(a, (m.nv,), self._a, "a")
        out = output(out, (m.nv, lib.kt_regressor_columns(self._m)), order="F")
        with self._guard:
            self._check(lib.kt_regressor_evaluate(self._m, self._data, q, v, a, pointer(out), self._error))
        return out

    def base_parameters(self) -> BaseParameters:
        """The least set of combinations of parameters that decides all joint forces.

        Returns
        -------
        BaseParameters
            Names, columns of the regressor, and coefficients.
        """
        count = lib.kt_regressor_columns(self._m)
        size = lib.kt_base_parameters_work_size(self._m)
        work, rank, columns = Memory(max(size, 1)), ffi.new("int *"), ffi.new("int[]", max(count, 1))
        relation = np.zeros(max(count * count, 1))
        with self._guard:
            self._check(lib.kt_base_parameters_find(self._m, self._data, work.pointer, size, rank, columns, pointer(relation), self._error))
        b, order = int(rank[0]), np.array(list(columns)[:count], np.int64)
        matrix = np.zeros((b, count))
        matrix[np.arange(b), order[:b]] = 1.0
        matrix[:, order[b:]] = relation[:b * (count - b)].reshape(count - b, b).T
        names = []
        for i in range(b):
            words = ffi.new("char[]", 1 + lib.kt_base_parameter_name(self._m, b, columns, pointer(relation), i, ffi.NULL, 0))
            lib.kt_base_parameter_name(self._m, b, columns, pointer(relation), i, words, len(words))
            names.append(text(words))
        return BaseParameters(names, order[:b], matrix)


def parameter_names(model: Any) -> List[str]:
    """The names of the columns of a regressor, such as ``"Izz(arm)"``."""
    found = []
    for column in range(lib.kt_regressor_columns(model)):
        each = lib.kt_regressor_parameter(model, column)
        owner = lib.kt_body_name(model, each.body) if each.coordinate < 0 else lib.kt_joint_name(model, each.body)
        inner = each.coordinate - lib.kt_body_coordinates(model, each.body).v if each.coordinate >= 0 else 0
        found.append(f"{_KINDS[each.kind]}({text(owner)}{f'[{inner}]' if inner else ''})")
    return found
