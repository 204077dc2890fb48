"""Mechanisms without a file: bodies, joints, shapes, loops and effects as Python calls.

Each type of the scene format is a function: ``joint.revolute(axis="z")``, ``shape.rod(to=[1, 0, 0])``, ``effect.spring(...)``,
``loop.spherical(...)``. Their keywords are the keys of the format, and the engine checks them.
"""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional

from ._core import Json, ffi, lib, text
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


class _Shapes:
    """Shapes: ``shape.rod(to=[1, 0, 0])``, ``shape.box(size=[1, 1, 1])``, ``shape.sphere(radius=0.1)``, ..."""

    def __getattr__(self, name: str) -> Callable[..., Json]:
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda **values: {"type": name, **values}


shape = _Shapes()


def revolute(axis: Any = "z", **values: Any) -> Json:
    """A revolute joint about `axis`."""
    return {"type": "revolute", "axis": axis, **values}


def prismatic(axis: Any = "z", **values: Any) -> Json:
    """A prismatic joint along `axis`."""
    return {"type": "prismatic", "axis": axis, **values}


def rod(to: Any, **values: Any) -> Json:
    """A slender rod from the origin of the body to `to`."""
    return {"type": "rod", "to": to, **values}


class Body:
    """A body and the joint that carries it.

    Parameters
    ----------
    name : str
    joint : dict
        ``kt.revolute("z")``, ``kt.joint.free()``, ...
    parent : str or Body, optional
        Default: the world.
    **values
        Other keys of a body in a scene: ``mass``, ``com``, ``inertia``, ``shape``, ``markers``, ...
    """

    def __init__(self, name: str, joint: Json, parent: Any = None, **values: Any) -> None:
        self.name, self.joint, self.parent, self.values = name, joint, parent, values

    def as_dict(self) -> Json:
        """The body as the mapping that a scene file has."""
        parent = self.parent.name if isinstance(self.parent, Body) else self.parent
        return {"name": self.name, "joint": self.joint, **({} if parent is None else {"parent": parent}), **self.values}


def mechanism(bodies: List[Body], *, loops: Optional[List[Json]] = None, effects: Optional[List[Json]] = None,
              gravity: Any = None, name: Optional[str] = None, **sections: Any) -> Scene:
    """A scene of bodies, loops and effects. Other sections of the format (``simulate``, ``output``, ...) are keywords."""
    content: Dict[str, Any] = {"kinetree": 1}
    given = {"name": name, "gravity": gravity, "bodies": [body.as_dict() for body in bodies], "loops": loops, "effects": effects}
    content.update({key: value for key, value in given.items() if value})
    content.update(sections)
    return Scene(content)
