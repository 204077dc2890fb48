"""Scenes as text: names of objects in place of lines, bundled scenes, and the JSON of the command as arrays."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import difflib
import errno
import json
import os
import pathlib
import re
from typing import Any, List, Optional, Union

import numpy as np

from . import command
from ._core import Json, file_error, lib

_ITEM = re.compile(r'(?:"((?:[^"\\]|\\.)*)": )?(.*?),?$')
_PLACE = re.compile(r"scene:(\d+):(\d+)")


def _check_values(content: Any, value: Any, path: List[Union[str, int]]) -> None:
    """Reject an object that a scene cannot hold, with its place."""
    if isinstance(value, (dict, list, tuple)):
        for key, each in value.items() if isinstance(value, dict) else enumerate(value):
            _check_values(content, each, [*path, key])
    elif value is not None and not isinstance(value, (str, int, float)):
        command.plain(value, _label(content, path))


def written(content: Json) -> str:
    """The text of a scene that is a dict. YAML knows no pairs of escapes."""
    _check_values(content, content, [])
    return json.dumps(content, default=command.plain, indent=1, ensure_ascii=False)


def _label(content: Any, path: List[Union[str, int]]) -> str:
    """``bodies 'arm': joint.axis`` for the path to a value."""
    words: List[str] = []
    at: Any = content
    for key in path:
        at = at.get(key) if isinstance(at, dict) else at[int(key)] if isinstance(at, (list, tuple)) and int(key) < len(at) else None
        if isinstance(key, int) and isinstance(at, dict) and isinstance(at.get("name"), str):
            words[-1:] = [f"{words[-1] if words else ''} '{at['name']}':".strip()]
        elif isinstance(key, int):
            words[-1:] = [f"{words[-1] if words else ''}[{key}]"]
        else:
            words.append(str(key))
    return re.sub(r": *\.", ": ", ".".join(words)).rstrip(":").replace(":.", ": ")


def place(text: str, line: int) -> Optional[str]:
    """The object that a line of `written` describes."""
    path: List[Union[str, int]] = []
    counts: List[Optional[int]] = []
    lines = text.split("\n")
    if not 1 <= line <= len(lines):
        return None
    for number, each in enumerate(lines, 1):
        found = _ITEM.match(each.strip())
        key, value = (found[1], found[2]) if found else (None, "")
        if value in ("}", "]") and key is None:
            if number == line:
                break
            path, counts = path[:-1], counts[:-1]
            continue
        own: List[Union[str, int]] = [key] if key is not None else []
        if key is None and counts and counts[-1] is not None:
            own, counts[-1] = [counts[-1]], counts[-1] + 1
        if number == line:
            path += own
            break
        if value in ("{", "["):
            if number > 1:
                path += own
            counts.append(0 if value == "[" else None)
            if number == 1:
                path = []
    return _label(json.loads(text), path) or None


def named(message: str, text: str) -> str:
    """A message whose places in the text are names of objects."""
    return _PLACE.sub(lambda found: place(text, int(found[1])) or "scene", message)


def bundled() -> Optional[pathlib.Path]:
    """The folder of the bundled scenes. The environment variable ``KINETREE_SCENES`` names another one."""
    program = pathlib.Path(command.path())
    given = os.environ.get("KINETREE_SCENES")
    tries = [pathlib.Path(given)] if given else [program.parent / "../share/kinetree/scenes", *(each / "apps/scenes" for each in pathlib.Path(__file__).resolve().parents)]
    return next((each.resolve() for each in tries if each.is_dir()), None)


def found(path: str) -> str:
    """The file of a scene: the path, or that of a bundled scene of this name."""
    if os.path.exists(path) or os.path.dirname(path) or os.path.splitext(path)[1] not in ("", ".yaml"):
        return path
    folder = bundled()
    scenes = {each.stem: each for each in folder.glob("*.yaml")} if folder else {}
    name = path.removesuffix(".yaml")
    near = difflib.get_close_matches(name, scenes, 1)
    if name not in scenes and near:
        missing = os.strerror(errno.ENOENT)
        raise file_error(lib.KT_ERROR_FILE, path, f"cannot be read: {missing}; did you mean the bundled scene '{near[0]}'?")
    return str(scenes.get(name, path))


def arrays(value: Any) -> Any:
    """The JSON of the command, with its lists of numbers as arrays."""
    if isinstance(value, dict):
        return {name: arrays(each) for name, each in value.items()}
    if not isinstance(value, list):
        return value
    if value and all(isinstance(each, (int, float, list)) and not isinstance(each, bool) for each in value):
        try:
            array = np.array(value, np.float64)
        except (TypeError, ValueError):  # texts, or rows of different lengths
            return [arrays(each) for each in value]
        return array
    return [arrays(each) for each in value]
