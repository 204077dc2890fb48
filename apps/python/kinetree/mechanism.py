"""Mechanisms without a file: bodies, joints, shapes, loops and effects as Python calls.

Each type of the scene format is a function: ``joint.revolute(axis="z")``, ``shape.rod(to=[1, 0, 0])``, ``effect.spring(...)``,
``loop.spherical(...)``. Their keywords are the keys of the format, and the engine checks them.
"""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional

import numpy as np

from ._core import ArgumentError, Json, ffi, lib, mistyped, name_of, text
from .scene import Scene


class Types:
    """The types of one kind, a function for each."""

    def __init__(self, kind: str, descriptor: Any, count: int) -> None:
        self._kind = kind
        self._descriptors = [descriptor(value) for value in range(count)]

    def _functions(self) -> Dict[str, Callable[..., Json]]:
        found = {text(each.name): _maker(each) for each in self._descriptors if each != ffi.NULL and each.help != ffi.NULL}
        self.__dict__.update(found)
        return found

    def __getattr__(self, name: str) -> Callable[..., Json]:
        functions = {} if name.startswith("_") else self._functions()
        if name not in functions:
            raise AttributeError(f"there is no {self._kind} '{name}'; there are {', '.join(functions)}")
        return functions[name]

    def __dir__(self) -> List[str]:
        return sorted(self._functions())


def _maker(descriptor: Any) -> Callable[..., Json]:
    name = text(descriptor.name)
    keys = [descriptor.keys[i] for i in range(descriptor.key_count)]

    def make(**values: Any) -> Json:
        return {"type": name, **values}

    lines = [f"    {text(key.name).split('.')[-1]}: {text(key.help)}" + (f" ({text(key.unit)})" if text(key.unit) else "") for key in keys]
    make.__name__ = make.__qualname__ = name
    make.__doc__ = f"{text(descriptor.help)}\n\n{text(descriptor.formula)}\n\nKeys\n" + "\n".join(lines)
    return make


joint = Types("joint", lib.kt_joint_descriptor, 32)
loop = Types("loop", lib.kt_loop_descriptor, 64)
effect = Types("effect", lib.kt_effect_descriptor, 64)
shape = Types("shape", lib.kt_shape_descriptor, 32)


def revolute(axis: Any = "z", **values: Any) -> Json:
    """A revolute joint.

    Parameters
    ----------
    axis : str or list of 3
        ``"x"``, ``"-x"``, ``"y"``, ... or a direction of any length.
    **values
        Other keys of the joint: ``at``, ``position``, ``velocity``, ``armature``, ... ``help(kt.joint.revolute)`` lists them.
    """
    return {"type": "revolute", "axis": axis, **values}


def prismatic(axis: Any = "z", **values: Any) -> Json:
    """A prismatic joint.

    Parameters
    ----------
    axis : str or list of 3
        ``"x"``, ``"-x"``, ``"y"``, ... or a direction of any length.
    **values
        Other keys of the joint. ``help(kt.joint.prismatic)`` lists them.
    """
    return {"type": "prismatic", "axis": axis, **values}


def rod(to: Any, **values: Any) -> Json:
    """A slender rod from the origin of the body, as a shape.

    Parameters
    ----------
    to : list of 3
        The other end in the frame of the body, m.
    **values
        Other keys of the shape. ``help(kt.shape.rod)`` lists them.
    """
    return {"type": "rod", "to": to, **values}


class Body:
    """A body and the joint that carries it.

    Parameters
    ----------
    name : str
    joint : dict, optional
        ``kt.revolute("z")``, ``kt.joint.free()``, ... Default: fixed, as in a scene.
    parent : str or Body, optional
        Default: the world.
    **values
        Other keys of a body in a scene: ``mass``, ``com``, ``inertia``, ``shape``, ``markers``, ... An inertia may be a symmetric matrix
        of 3 x 3, such as ``np.diag([1, 2, 2])``, kg m^2.
    """

    def __init__(self, name: str, joint: Optional[Json] = None, parent: Any = None, **values: Any) -> None:
        name_of(name, "name")
        self.name, self.joint, self.parent, self.values = name, joint, parent, values

    def __repr__(self) -> str:
        return f"<kinetree.Body '{self.name}'>"

    def as_dict(self) -> Json:
        """The body as the mapping that a scene file has."""
        parent = self.parent.name if isinstance(self.parent, Body) else self.parent
        given = {"name": self.name, "joint": self.joint, "parent": parent}
        values = dict(self.values)
        if "inertia" in values and np.ndim(values["inertia"]) == 2:
            values["inertia"] = _six(values["inertia"], self.name)
        return {**{key: value for key, value in given.items() if value is not None}, **values}


def _six(matrix: Any, body: str) -> List[float]:
    """An inertia matrix as the format has it: xx, yy, zz, xy, xz, yz."""
    found = np.asarray(matrix)
    if found.shape != (3, 3) or found.dtype.kind not in "biuf" or not np.allclose(found, found.T, rtol=1e-9, atol=0.0):
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, f"body '{body}': inertia", "expected 3 or 6 numbers, or a symmetric matrix of 3 x 3")
    return [float(found[i, k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def mechanism(bodies: List[Body], *, loops: Optional[List[Json]] = None, effects: Optional[List[Json]] = None,
              gravity: Any = None, name: Optional[str] = None, **sections: Any) -> Scene:
    """A scene of bodies, loops and effects.

    Parameters
    ----------
    bodies : list of Body
        A parent stands before its children.
    loops, effects : list of dict, optional
        ``kt.loop.spherical(...)``, ``kt.effect.spring(...)``, ...
    gravity : list of 3, optional
        Acceleration, m/s^2. Default: none.
    name : str, optional
        The title of the scene.
    **sections
        Other sections of the format: ``simulate``, ``output``, ``parameters``, ``events``, ...

    Returns
    -------
    Scene
    """
    if not isinstance(bodies, (list, tuple)) or not all(isinstance(body, Body) for body in bodies):
        raise mistyped("bodies", "a list of kinetree.Body", bodies)
    content: Dict[str, Any] = {"kinetree": 1}
    given = {"name": name, "gravity": gravity, "bodies": [body.as_dict() for body in bodies], "loops": loops, "effects": effects}
    content.update({key: value for key, value in given.items() if value is not None and not (isinstance(value, (list, tuple, str)) and len(value) == 0)})
    content.update(sections)
    return Scene(content)
