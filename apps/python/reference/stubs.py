"""Write the stub of the types of a mechanism from the descriptors: stubs.py > apps/python/kinetree/_types.pyi

An editor then completes the keywords of each joint, loop, effect and shape, and mypy rejects a name or a keyword that does not exist.
The package must be importable.
"""
# SPDX-License-Identifier: Apache-2.0
import keyword
import math
import textwrap

import kinetree as kt
from kinetree._core import text

HEAD = '''"""The types of the scene format. Written by apps/python/reference/stubs.py from the descriptors; do not edit."""
from typing import Any, Dict, List, Sequence, Union

from numpy.typing import NDArray

Json = Dict[str, Any]
Number = Union[float, str]
Numbers = Union[float, str, Sequence[Number], NDArray[Any]]
Axis = Union[str, Sequence[float], NDArray[Any]]
End = Union[str, Json]
'''
KINDS = {"NUMBER": "Number", "SIX": "Numbers", "VECTOR": "Numbers", "AXIS": "Axis", "FLAG": "Union[bool, str]", "FRAME": "str", "END": "End",
         "ENDS": "Sequence[End]", "BODY": "str", "POINT": "Union[str, Numbers]", "JOINT": "str", "DISTANCE": "Number", "POSITION": "Union[Numbers, Json]",
         "VELOCITY": "Union[Numbers, Json]", "ARMATURE": "Numbers", "FORMULA": "Number", "FORMULAS": "Union[Number, Sequence[Number]]",
         "FUNCTION": "Union[Number, Json]", "LOOP": "str"}
COMMON = {"joint": {"name": "str", "guess": "Numbers", "limits": "Json"}, "loop": {"name": "str", "switched": "bool"},
          "effect": {"name": "str", "switched": "bool"}, "shape": {}}
DEFAULTS = {"joint": kt.lib.kt_joint_default, "loop": kt.lib.kt_loop_default, "effect": kt.lib.kt_effect_default, "shape": kt.lib.kt_shape_default}


def kind_of(key):
    names = {getattr(kt.lib, f"KT_KEY_{name}"): word for name, word in KINDS.items()}
    return names.get(key.kind, "Any")


def default_of(group, key):
    """The default of a number or a flag, as the engine has it; `...` for others."""
    if key.standard != kt.ffi.NULL or key.kind not in (kt.lib.KT_KEY_NUMBER, kt.lib.KT_KEY_FLAG):
        return "..."
    record = kt.ffi.new(f"kt_{group} *", DEFAULTS[group]())
    place = kt.ffi.cast("char *", record) + key.offset
    if key.kind == kt.lib.KT_KEY_FLAG:
        return str(bool(kt.ffi.cast("bool *", place)[0]))
    value = kt.ffi.cast("double *", place)[0]
    return repr(value) if math.isfinite(value) else "..."


def parameters(group, descriptor):
    needed, others = [], []
    for i in range(descriptor.key_count):
        key = descriptor.keys[i]
        name = text(key.name).split(".")[-1]
        if keyword.iskeyword(name):
            others.append("**others: Any")
        elif key.needed:
            needed.append(f"{name}: {kind_of(key)}")
        else:
            others.append(f"{name}: {kind_of(key)} = {default_of(group, key)}")
        if text(key.also):
            others.append(f"{text(key.also).split('.')[-1]}: {kind_of(key)} = ...")
    common = [f"{name}: {kind} = ..." for name, kind in COMMON[group].items()]
    rest = [each for each in others if each.startswith("**")]
    return ["*", *needed, *common, *(each for each in others if each not in rest), *rest[:1]]


def written(group):
    lines = [f"class _{group.capitalize()}:"]
    for descriptor in getattr(kt, group)._descriptors:
        if descriptor == kt.ffi.NULL or descriptor.help == kt.ffi.NULL:
            continue
        given = parameters(group, descriptor)
        given = [] if given == ["*"] else given
        name = text(descriptor.name)
        lines += [*textwrap.wrap(f"    def {name}({', '.join(['self', *given])}) -> Json:", 150, subsequent_indent=" " * 8, break_on_hyphens=False),
                  f'        """{text(descriptor.help)}"""']
    return "\n".join([*lines, f"    def __dir__(self) -> List[str]: ...", "", f"{group}: _{group.capitalize()}"])


def stub():
    return "\n\n".join([HEAD.rstrip(), *map(written, COMMON)]) + "\n"


if __name__ == "__main__":
    print(stub(), end="")
