"""Write the reference page of the package from its docstrings: page.py > include/pages/python-reference.md

The package must be importable.
"""
# SPDX-License-Identifier: Apache-2.0
import inspect

import kinetree as kt

HEAD = """# Python reference

This page lists all public names of the package, with the text that `help` shows. [Python](python.md) explains the parts. The page is made of the docstrings
by `apps/python/reference/page.py`, and a test compares both.

`kt.joint`, `kt.loop`, `kt.effect` and `kt.shape` have a function for each type of the [format](types.md). `kt.lib` and `kt.ffi` are the
[C interface](c-interface.md).
"""


def signature(found, name):
    """Names and defaults without types, which the text has."""
    try:
        given = inspect.signature(found).parameters.values()
    except (TypeError, ValueError):
        return name
    words, starred = [], False
    for each in given:
        if each.name == "self" or each.name.startswith("_"):
            continue
        if each.kind is each.KEYWORD_ONLY and not starred:
            words.append("*")
            starred = True
        starred = starred or each.kind is each.VAR_POSITIONAL
        mark = {each.VAR_POSITIONAL: "*", each.VAR_KEYWORD: "**"}.get(each.kind, "")
        words.append(f"{mark}{each.name}" + ("" if each.default is each.empty else f"={each.default!r}"))
    return f"{name}({', '.join(words)})"


def block(head, found):
    return "\n".join(["```text", head, "", inspect.getdoc(found) or "", "```", ""])


def members(kind):
    """The public methods and properties of a class, with those that it inherits from the package."""
    for name in sorted({each for base in kind.__mro__ if base.__module__.startswith("kinetree") for each in vars(base) if not each.startswith("_")}):
        found = inspect.getattr_static(kind, name)
        if isinstance(found, property):
            yield name, name, found.fget
        elif callable(getattr(kind, name)):
            yield name, signature(getattr(kind, name), name), getattr(kind, name)


def page():
    lines = [HEAD]
    for name in sorted(kt.__all__, key=str.lower):
        found = getattr(kt, name)
        if name in ("ffi", "lib", "joint", "loop", "effect", "shape"):
            continue
        lines.append(f"## {name}\n")
        if inspect.isclass(found):
            lines.append(block(signature(found, f"kt.{name}"), found))
            lines += [f"### {name}.{each}\n\n{block(head, member)}" for each, head, member in members(found)]
        elif inspect.ismodule(found):
            lines.append(block(f"kt.{name}", found))
            functions = [(each, member) for each, member in vars(found).items() if inspect.isfunction(member) and member.__module__ == found.__name__ and each in ("path", "run")]
            lines += [f"### {name}.{each}\n\n{block(signature(member, each), member)}" for each, member in functions]
        else:
            lines.append(block(signature(found, f"kt.{name}"), found))
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    print(page(), end="")
