"""The content of the files of a scene: a later edit of a file changes nothing in the scene that was read from it."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import os
import re
import shutil
import tempfile
import weakref
from typing import Any, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

_NESTED = (".xml", ".mjcf", ".urdf", ".sdf", ".world", ".yaml", ".yml")  # files that may name others
_FOLDERS = re.compile(r"""\b(?:meshdir|texturedir|assetdir)\s*=\s*["']([^"']*)["']""")
_WORDS = re.compile(r"""'([^'\n]*)'|"([^"\n]*)"|>([^<>\n]+)<|([^\s'"\[\]{},<>=]+)""")
_LINES = re.compile(r""":[ \t]+([^\s'"\[\]{},][^\n#]*?)[ \t]*(?:#.*)?$""", re.M)
_NUMBER = re.compile(r"[-+.\d][-+.\deE]*$")
_LONGEST = 1024

Sign = Optional[Tuple[int, ...]]


def sign(path: str) -> Sign:
    """None if there is no file. Otherwise, it differs after each change of the file."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _names(text: str) -> Iterator[str]:
    """The words of a file that may be names of files."""
    found = {each for match in _WORDS.finditer(text) for each in match.groups() if each}
    found.update(match[1] for match in _LINES.finditer(text))
    for word in found:
        word = re.sub(r"^(?:package|model|file)://", "", word)
        if len(word) <= _LONGEST and not _NUMBER.match(word):
            yield word


def _named(path: str, text: str, folders: Sequence[str]) -> Iterator[str]:
    """The files that a file names: beside it, in the folders of its meshes, in its parents, and in other folders."""
    beside = os.path.dirname(path)
    places = [beside, *(os.path.join(beside, each) for each in _FOLDERS.findall(text)), *folders]
    if path.lower().endswith((".urdf", ".sdf", ".world")):  # packages
        places += [os.path.dirname(beside), os.path.dirname(os.path.dirname(beside))]
    for word in _names(text):
        for place in places:
            found = os.path.normpath(os.path.join(place, word))
            if os.path.isfile(found):
                yield found


class Files:
    """The bytes of a file and of all files that it names, as they were when the file was read.

    As long as no file has changed, a scene is read from the files themselves. Later, it is read from copies in a folder of their own.
    """

    def __init__(self, main: str, folders: Sequence[str] = (), words: Iterable[str] = ()) -> None:
        self.main = main
        self.contents: Dict[str, bytes] = {}
        self._signs: Dict[str, Sign] = {}
        self._copies: Any = None  # their folder
        waiting = [main]
        waiting += [os.path.normpath(os.path.join(os.path.dirname(main), each)) for each in words]
        while waiting:
            waiting += self._take(waiting.pop(), folders)

    def _take(self, path: str, folders: Sequence[str]) -> List[str]:
        """Keep a file. Returns the files that it names."""
        if path in self.contents or not os.path.isfile(path):
            return []
        self._signs[path] = sign(path)
        try:
            with open(path, "rb") as file:
                self.contents[path] = file.read()
        except OSError:  # the reader reports it
            return []
        nested = path == self.main or path.lower().endswith(_NESTED)
        return list(_named(path, self.contents[path].decode("utf8", "replace"), folders)) if nested else []

    def add(self, paths: Iterable[str]) -> None:
        """Keep other files, which the reader has found."""
        for each in paths:
            self._take(os.path.normpath(os.path.join(os.path.dirname(self.main), each)), ())

    def are_unchanged(self) -> bool:
        """Whether all files are those that were read."""
        return all(sign(path) == each for path, each in self._signs.items())

    def place(self) -> str:
        """The file, or its copy if a file has changed."""
        if self._copies is None and self.are_unchanged():
            return self.main
        if self._copies is None:
            self._copies = tempfile.mkdtemp(prefix="kinetree-")  # a TemporaryDirectory that ends with its scene warns of it
            weakref.finalize(self, shutil.rmtree, self._copies, ignore_errors=True)
            for path, content in self.contents.items():
                copy = self._copy(path)
                os.makedirs(os.path.dirname(copy), exist_ok=True)
                with open(copy, "wb") as file:
                    file.write(content)
        return self._copy(self.main)

    def named(self, words: str) -> str:
        """A message, with the names of the files in place of those of their copies."""
        return words if self._copies is None else words.replace(self._copies + os.sep, os.sep)

    def _copy(self, path: str) -> str:
        return os.path.join(self._copies, path.lstrip(os.sep))

    def __getstate__(self) -> Any:
        return self.main, self.contents, self._signs

    def __setstate__(self, state: Any) -> None:
        self.main, self.contents, self._signs = state
        self._copies = None
